//! What a run tells of strain: the largest, where and when, how sure it is, and what the material bears.

use serde::Serialize;

use super::plot::short;

/// What separates a place whose strain can be trusted from one whose strain grows as the mesh is refined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PeakKind {
    /// None of the others: the strain converges as the mesh is refined.
    Free,
    /// Within about an element of a node that carries contact force: point loads strain without bound.
    AtContact,
    /// Within an element of the border of a held region.
    AtHeld,
    /// Within an element of an inner edge without a fillet.
    AtInnerEdge,
}

impl PeakKind {
    /// All, in the order of the tables.
    pub const ALL: [Self; 4] = [Self::Free, Self::AtContact, Self::AtHeld, Self::AtInnerEdge];

    /// In tables.
    pub fn words(self) -> &'static str {
        match self {
            Self::Free => "largest strain",
            Self::AtContact => "at contact nodes",
            Self::AtHeld => "at the border of a held region",
            Self::AtInnerEdge => "at an inner edge without a fillet",
        }
    }

    /// Why the number is told apart; empty for the one that is the result.
    pub fn why(self) -> &'static str {
        match self {
            Self::Free => "",
            Self::AtContact => {
                "forces act at single nodes: their strain depends on the fineness of the mesh"
            }
            Self::AtHeld | Self::AtInnerEdge => "grows without bound as the mesh is refined",
        }
    }
}

/// The largest principal strain (by size) of one kind of place, with its place and moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrainPeak {
    /// Recovered at the skin, 1 (0.01 is 1 %), >= 0.
    pub value: f64,
    /// Estimated error of `value`, 1, >= 0.
    pub error: f64,
    /// Of the node at rest, m, part's frame.
    pub place: [f64; 3],
    /// Tag of the node in the mesh file, or in the mesh as it was raised or refined.
    pub node_tag: u64,
    /// Travel of the held body at that moment, m.
    pub travel_m: f64,
    /// Force at the hand at that moment, positive when it resists, N.
    pub force_n: f64,
    /// What kind of place it is.
    pub kind: PeakKind,
}

impl StrainPeak {
    /// "0.553 ± 0.061 %".
    pub fn percent(&self) -> String {
        with_bar(100.0 * self.value, 100.0 * self.error) + " %"
    }

    /// Node, coordinates in mm, travel in mm and force in N.
    pub fn where_and_when(&self) -> String {
        let [x, y, z] = self.place.map(millimetres);
        format!(
            "node {} at ({x}, {y}, {z}) mm, at {} mm of travel and {} N",
            self.node_tag,
            millimetres(self.travel_m),
            newtons(self.force_n),
        )
    }
}

/// A value and its bar, which is known to two digits, and the value no better: "0.71 ± 0.11".
fn with_bar(value: f64, bar: f64) -> String {
    let digits = 1.0 - bar.log10().floor();
    if !(0.0..=9.0).contains(&digits) {
        return format!("{} ± {}", short(value), short(bar));
    }
    let rounded = |x: f64| {
        let text = format!("{x:.*}", digits as usize);
        let is_whole = !text.contains('.');
        let trimmed = text.trim_end_matches('0').trim_end_matches('.');
        if is_whole { text } else { trimmed.to_owned() }
    };
    format!("{} ± {}", rounded(value), rounded(bar))
}

/// Share of the strain for single use that snap joints bear when they are opened and closed often: "about 60 %" (Covestro,
/// formerly Bayer MaterialScience, "Snap-Fit Joints for Plastics: A Design Guide").
pub const REPEATED_SHARE: f64 = 0.6;

/// Largest strains of a run by kind, beside what the material bears.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StrainFacts {
    /// One of each kind that occurred.
    pub peaks: Vec<StrainPeak>,
    /// The largest where the body is pressed into its seat harder than over the snap, if it is; not among the others.
    pub at_seat: Option<StrainPeak>,
    /// Largest strain that the material bears once, if the scene gives it.
    pub permissible: Option<f64>,
    /// Moments that were looked at.
    pub n_moments: usize,
}

impl StrainFacts {
    /// The largest of a kind.
    pub fn of(&self, kind: PeakKind) -> Option<&StrainPeak> {
        self.peaks.iter().find(|p| p.kind == kind)
    }

    /// The result: the largest of the free skin; where the part has no such place, the largest of all.
    pub fn governing(&self) -> Option<&StrainPeak> {
        let of_all = || {
            let peaks = self.peaks.iter();
            peaks.max_by(|a, b| a.value.total_cmp(&b.value))
        };
        self.of(PeakKind::Free).or_else(of_all)
    }

    /// Value of [`StrainFacts::governing`]; 0 for a part that was not strained.
    pub fn value(&self) -> f64 {
        self.governing().map_or(0.0, |p| p.value)
    }

    /// Permissible over largest strain, for single use; `None` without a permissible strain or without strain.
    pub fn safety_once(&self) -> Option<f64> {
        self.permissible
            .map(|limit| limit / self.value())
            .filter(|s| s.is_finite())
    }

    /// The same for a joint that is opened and closed often.
    pub fn safety_repeated(&self) -> Option<f64> {
        self.safety_once().map(|s| REPEATED_SHARE * s)
    }

    /// "safety 3.61 once, 2.17 repeatedly".
    pub fn safety_words(&self) -> String {
        match (self.permissible, self.safety_once(), self.safety_repeated()) {
            (Some(limit), Some(once), Some(repeated)) => format!(
                "safety {} once, {} repeatedly, against {} %",
                short(once),
                short(repeated),
                short(100.0 * limit)
            ),
            (Some(_), ..) => "not strained".to_owned(),
            (None, ..) => {
                "no safety: no permissible strain given (part.material.permissible_strain)"
                    .to_owned()
            }
        }
    }

    /// Sentence above the table.
    pub fn words(&self) -> String {
        let seat = self.at_seat.as_ref().map(seat_words);
        let seat = seat.map_or_else(String::new, |words| format!(" {words}."));
        match self.governing() {
            Some(peak) => format!(
                "{}: {}; {}.{seat} {} moments were looked at.",
                peak.percent(),
                peak.where_and_when(),
                self.safety_words(),
                self.n_moments
            ),
            None => "Nothing was strained.".to_owned(),
        }
    }

    /// Lines for the terminal, each with its end.
    pub fn text(&self) -> String {
        let Some(peak) = self.governing() else {
            return "  largest strain        none: nothing was strained\n".to_owned();
        };
        let mut text = format!(
            "  largest strain        {}, {}\n                        {}\n",
            peak.percent(),
            self.safety_words(),
            peak.where_and_when()
        );
        if peak.kind != PeakKind::Free {
            text += &format!(
                "                        {}: {}\n",
                peak.kind.words(),
                peak.kind.why()
            );
        }
        for other in self.larger_elsewhere() {
            text += &format!(
                "                        {} {}: {}\n",
                other.percent(),
                other.kind.words(),
                other.kind.why()
            );
        }
        if let Some(seat) = &self.at_seat {
            text += &format!("                        {}\n", seat_words(seat));
        }
        text
    }

    /// What the reader must not miss.
    pub fn remarks(&self) -> Vec<String> {
        let mut remarks = Vec::new();
        let Some((peak, limit)) = self.governing().zip(self.permissible) else {
            return remarks;
        };
        if peak.value > limit {
            remarks.push(format!(
                "the largest strain of {:.2} % is beyond what the material bears ({:.2} %): the real \
                 part yields, and the force is not to be trusted",
                100.0 * peak.value,
                100.0 * limit
            ));
        } else if peak.value + peak.error > limit {
            remarks.push(format!(
                "the largest strain of {} may be beyond what the material bears ({:.2} %): the bar is the mesh's; raise \
                 accuracy.order or refine the mesh near node {}",
                peak.percent(),
                100.0 * limit,
                peak.node_tag
            ));
        }
        remarks
    }

    /// Peaks of other kinds that exceed the result.
    fn larger_elsewhere(&self) -> impl Iterator<Item = &StrainPeak> {
        let value = self.value();
        self.peaks.iter().filter(move |p| p.value > value)
    }

    /// Rows of the report's table: what, strain with its bar, safety once, node, place in mm, travel in mm, force in N, why.
    pub fn table(&self) -> Vec<Vec<String>> {
        PeakKind::ALL
            .into_iter()
            .filter_map(|kind| self.of(kind))
            .map(|p| {
                let safety = self.permissible.map(|limit| limit / p.value);
                vec![
                    p.kind.words().to_owned(),
                    p.percent(),
                    safety
                        .filter(|s| s.is_finite())
                        .map_or("not given".to_owned(), short),
                    p.node_tag.to_string(),
                    p.place.map(millimetres).join(", "),
                    millimetres(p.travel_m),
                    newtons(p.force_n),
                    p.kind.why().to_owned(),
                ]
            })
            .collect()
    }
}

/// The strain of the seat.
fn seat_words(seat: &StrainPeak) -> String {
    format!(
        "{} where it is pressed into its seat, {} N at {} mm: not counted, a matter of how hard it is pushed on",
        seat.percent(),
        newtons(seat.force_n),
        millimetres(seat.travel_m)
    )
}

/// mm; below a nanometre is round-off.
fn millimetres(metres: f64) -> String {
    short(if metres.abs() < 1e-9 {
        0.0
    } else {
        1e3 * metres
    })
}

/// N; below a micronewton is round-off.
fn newtons(force: f64) -> String {
    short(if force.abs() < 1e-6 { 0.0 } else { force })
}

/// Headings of [`StrainFacts::table`].
pub const TABLE_HEADINGS: [&str; 8] = [
    "",
    "strain",
    "safety once",
    "node",
    "place (mm)",
    "travel (mm)",
    "force (N)",
    "",
];

/// What the table's numbers are.
pub const CAPTION: &str = "Largest principal strain by size, recovered at the nodes of the skin by superconvergent patch \
    recovery (Zienkiewicz and Zhu 1992), with the estimated error of the mesh: compare its value, not its bar, with other \
    runs. Strain within about an element of contact nodes, of borders of held regions and of inner edges without a fillet \
    has no limit as the mesh is refined, and is told apart: model the fillet, or read the strain beside it. For repeated \
    use the safety is 60 % of that for single use.";

#[derive(Serialize)]
#[expect(
    non_snake_case,
    reason = "keys of the file carry their unit in its own letters"
)]
struct PeakSummary {
    value: f64,
    error: f64,
    node: u64,
    place_m: [f64; 3],
    travel_m: f64,
    force_N: f64,
}

/// The object `strain` of `summary.json`.
#[derive(Serialize)]
#[expect(
    non_snake_case,
    reason = "keys of the file carry their unit in its own letters"
)]
pub(super) struct StrainSummary {
    value: f64,
    error: Option<f64>,
    node: Option<u64>,
    place_m: Option<[f64; 3]>,
    travel_m: Option<f64>,
    force_N: Option<f64>,
    kind: Option<&'static str>,
    at_contact: Option<PeakSummary>,
    at_held: Option<PeakSummary>,
    at_inner_edge: Option<PeakSummary>,
    at_seat: Option<PeakSummary>,
    permissible: Option<f64>,
    safety_once: Option<f64>,
    safety_repeated: Option<f64>,
    moments: usize,
}

pub(super) fn summary(facts: &StrainFacts) -> StrainSummary {
    let peak = facts.governing();
    let told = |p: &StrainPeak| PeakSummary {
        value: p.value,
        error: p.error,
        node: p.node_tag,
        place_m: p.place,
        travel_m: p.travel_m,
        force_N: p.force_n,
    };
    let of = |kind| facts.of(kind).map(told);
    StrainSummary {
        value: facts.value(),
        error: peak.map(|p| p.error),
        node: peak.map(|p| p.node_tag),
        place_m: peak.map(|p| p.place),
        travel_m: peak.map(|p| p.travel_m),
        force_N: peak.map(|p| p.force_n),
        kind: peak.map(|p| match p.kind {
            PeakKind::Free => "free",
            PeakKind::AtContact => "at_contact",
            PeakKind::AtHeld => "at_held",
            PeakKind::AtInnerEdge => "at_inner_edge",
        }),
        at_contact: of(PeakKind::AtContact),
        at_held: of(PeakKind::AtHeld),
        at_inner_edge: of(PeakKind::AtInnerEdge),
        at_seat: facts.at_seat.as_ref().map(told),
        permissible: facts.permissible,
        safety_once: facts.safety_once(),
        safety_repeated: facts.safety_repeated(),
        moments: facts.n_moments,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bar_has_two_digits_and_its_value_no_more() {
        for (value, bar, text) in [
            (0.70713, 0.10911, "0.71 ± 0.11"),
            (1.2894, 0.3001, "1.29 ± 0.3"),
            (28.04, 5.0731, "28 ± 5.1"),
            (120.0, 30.0, "120 ± 30"),
            (120.4, 314.0, "120 ± 314"),
            (0.5, 0.0, "0.5 ± 0"),
        ] {
            assert_eq!(with_bar(value, bar), text);
        }
    }

    fn peak(kind: PeakKind, value: f64) -> StrainPeak {
        StrainPeak {
            value,
            error: 0.1 * value,
            place: [1e-3, -1e-13, 2.5e-3],
            node_tag: 17,
            travel_m: 2e-3,
            force_n: -1e-12,
            kind,
        }
    }

    fn facts(permissible: Option<f64>) -> StrainFacts {
        StrainFacts {
            peaks: vec![peak(PeakKind::AtHeld, 0.05), peak(PeakKind::Free, 0.01)],
            permissible,
            at_seat: None,
            n_moments: 40,
        }
    }

    #[test]
    fn safety_is_against_the_free_skin_and_six_tenths_of_it_for_repeated_use() {
        let facts = facts(Some(0.02));
        assert_eq!(facts.value(), 0.01);
        assert_eq!(facts.safety_once(), Some(2.0));
        assert_eq!(facts.safety_repeated(), Some(1.2));
        assert_eq!(
            facts.text(),
            "  largest strain        1 ± 0.1 %, safety 2 once, 1.2 repeatedly, against 2 %\n                        \
             node 17 at (1, 0, 2.5) mm, at 2 mm of travel and 0 N\n                        \
             5 ± 0.5 % at the border of a held region: grows without bound as the mesh is refined\n"
        );
        assert!(facts.remarks().is_empty());
    }

    #[test]
    fn without_a_permissible_strain_that_is_said() {
        let text = facts(None).text();
        assert!(text.contains("no permissible strain given"), "{text}");
        let value = serde_json::to_value(summary(&facts(None))).unwrap();
        assert!(value["safety_once"].is_null() && value["permissible"].is_null());
        assert_eq!(value["at_held"]["value"], 0.05);
        assert!(value["at_contact"].is_null());
    }

    #[test]
    fn beyond_the_permissible_strain_is_told_within_the_bar_too() {
        assert!(facts(Some(0.009)).remarks()[0].contains("is beyond"));
        assert!(facts(Some(0.0105)).remarks()[0].contains("may be beyond"));
    }

    #[test]
    fn a_part_without_free_skin_has_the_largest_of_all() {
        let mut facts = facts(Some(0.02));
        facts.peaks.retain(|p| p.kind == PeakKind::AtHeld);
        assert_eq!(facts.value(), 0.05);
        assert!(facts.text().contains("grows without bound"));
        facts.peaks.clear();
        assert_eq!(facts.safety_once(), None);
        assert!(facts.text().contains("nothing was strained"));
    }
}
