//! Coulomb's coefficient of a pair of materials.
//!
//! Source: Bayer, "Snap-Fit Joints for Plastics - A Design Guide", table of friction coefficients: dry, plastic on steel,
//! as ranges; a plastic on itself by a factor; two different plastics at most as on steel. Its middle is taken.

/// A material of the table.
#[derive(Debug)]
struct Sliding {
    name: &'static str,
    /// On steel.
    from: f64,
    to: f64,
    /// On itself, times that on steel; where the source has none, 1.
    on_itself: f64,
}

const fn sliding(name: &'static str, from: f64, to: f64, on_itself: f64) -> Sliding {
    Sliding {
        name,
        from,
        to,
        on_itself,
    }
}

const PLASTICS: [Sliding; 13] = [
    sliding("PTFE", 0.12, 0.22, 1.0),
    sliding("PE-HD", 0.20, 0.25, 2.0),
    sliding("PP", 0.25, 0.30, 1.5),
    sliding("POM", 0.20, 0.35, 1.5),
    sliding("PA", 0.30, 0.40, 1.5),
    sliding("PBT", 0.35, 0.40, 1.0),
    sliding("PS", 0.40, 0.50, 1.2),
    sliding("SAN", 0.45, 0.55, 1.0),
    sliding("PC", 0.45, 0.55, 1.2),
    sliding("PMMA", 0.50, 0.60, 1.2),
    sliding("ABS", 0.50, 0.65, 1.2),
    sliding("PE-LD", 0.55, 0.60, 1.2),
    sliding("PVC", 0.55, 0.60, 1.0),
];

const STEEL: &str = "steel";

/// A coefficient out of the table.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct OfPair {
    /// Middle of the range.
    pub(super) coefficient: f64,
    /// The pair, its range and the source.
    pub(super) words: String,
}

/// Names of the materials that a pair may have.
pub(super) fn names() -> impl Iterator<Item = &'static str> {
    PLASTICS.iter().map(|m| m.name).chain([STEEL])
}

/// The known material that is meant by a name: `pom`, or `POM` in `POM-C, natural`.
pub(super) fn known(name: &str) -> Option<&'static str> {
    let lower = name.trim().to_lowercase();
    let is_meant = |known: &&str| {
        let rest = lower.strip_prefix(&known.to_lowercase());
        // PC is neither PCTG nor PC/ABS.
        rest.is_some_and(|rest| !rest.starts_with(|c: char| c.is_alphabetic() || "/+".contains(c)))
    };
    // The longest: PE-HD and not another that begins alike.
    names().filter(is_meant).max_by_key(|known| known.len())
}

/// Of two known materials; `None` for steel on steel, which the source does not have.
pub(super) fn of_pair(a: &'static str, b: &'static str) -> Option<OfPair> {
    let find = |name: &str| PLASTICS.iter().find(|m| m.name == name);
    let (from, to) = match (find(a), find(b)) {
        (None, None) => return None,
        (Some(plastic), None) | (None, Some(plastic)) => (plastic.from, plastic.to),
        (Some(a), Some(b)) if a.name == b.name => (a.from * a.on_itself, a.to * a.on_itself),
        // At most as on steel, for both.
        (Some(a), Some(b)) => (a.from.min(b.from), a.to.min(b.to)),
    };
    let coefficient = 0.5 * (from + to);
    Some(OfPair {
        coefficient,
        words: format!(
            "{a} on {b}, dry: {from:.2} to {to:.2} by Bayer's snap-fit guide, {coefficient:.3} taken"
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_found_in_what_is_written() {
        for (written, meant) in [
            ("POM", Some("POM")),
            ("pom-c, natural", Some("POM")),
            ("PE-HD", Some("PE-HD")),
            (" Steel ", Some("steel")),
            ("PA66", Some("PA")),
            ("PCTG", None),
            ("PC/ABS", None),
            ("", None),
        ] {
            assert_eq!(known(written), meant, "{written}");
        }
    }

    #[test]
    fn a_pair_has_the_middle_of_its_range_whichever_is_named_first() {
        let of = |a, b| of_pair(a, b).map(|pair| pair.coefficient);
        assert!((of("POM", "steel").unwrap() - 0.275).abs() < 1e-12);
        assert_eq!(of("POM", "steel"), of("steel", "POM"));
        assert!((of("POM", "POM").unwrap() - 0.4125).abs() < 1e-12);
        assert!((of("POM", "ABS").unwrap() - 0.275).abs() < 1e-12);
        assert_eq!(of("steel", "steel"), None);
    }
}
