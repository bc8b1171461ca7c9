//! What the name of a quantity asks for: `path.substeps2`, `state.points-4.pose11`.

use fem::Quadrature;

use crate::study::verify::expected;

/// A quantity of a path with friction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::study::verify) enum Asked {
    /// Forces and energies at each listed pose.
    Path { substeps: u32 },
    /// Peaks and totals of the path.
    Summary { substeps: u32 },
    /// Forces and displacements after a listed pose, one increment for each.
    State { pose: usize },
    /// The path without friction.
    Frictionless,
    /// The path with each candidate listed twice.
    Repeated,
    /// The problem of one increment, given as numbers.
    Problem,
}

impl Asked {
    /// With the rule, where the name has one; `None` for a name that is not computed.
    pub(in crate::study::verify) fn of(name: &str) -> Option<(Self, Option<Quadrature>)> {
        let (first, rest) = name.split_once('.').unwrap_or((name, ""));
        let (rule, last) = match rest.rsplit_once('.') {
            Some((rule, last)) => (Some(expected::quadrature(rule).ok()?), last),
            None => (None, rest),
        };
        let number = |key: &str| last.strip_prefix(key)?.parse().ok();
        let asked = match first {
            "path" => Self::Path {
                substeps: number("substeps")?,
            },
            "summary" => Self::Summary {
                substeps: number("substeps")?,
            },
            "state" => Self::State {
                pose: number("pose")? as usize,
            },
            "problem" if rule.is_none() && number("pose").is_some() => Self::Problem,
            "frictionless" | "repeated" => {
                let is_frictionless = first == "frictionless";
                let asked = if is_frictionless {
                    Self::Frictionless
                } else {
                    Self::Repeated
                };
                let rule = match last {
                    "" => None,
                    _ => Some(expected::quadrature(rest).ok()?),
                };
                return Some((asked, rule));
            }
            _ => return None,
        };
        Some((asked, rule))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_says_what_with_which_rule_and_in_how_many_increments() {
        let fast = Some(Quadrature::Fast);
        let converged = Some(Quadrature::Converged);
        for (name, expected) in [
            ("path.substeps2", Some((Asked::Path { substeps: 2 }, None))),
            (
                "summary.points-4.substeps1",
                Some((Asked::Summary { substeps: 1 }, fast)),
            ),
            (
                "state.converged.pose11",
                Some((Asked::State { pose: 11 }, converged)),
            ),
            ("frictionless", Some((Asked::Frictionless, None))),
            ("repeated.points-4", Some((Asked::Repeated, fast))),
            ("problem.pose4", Some((Asked::Problem, None))),
            ("path", None),
            ("path.points-5.substeps1", None),
            ("path.substeps", None),
            ("path.substeps-1", None),
            ("summary.pose1", None),
            ("state.points-4", None),
            ("problem.points-4.pose4", None),
            ("handbook", None),
        ] {
            assert_eq!(Asked::of(name), expected, "{name}");
        }
    }
}
