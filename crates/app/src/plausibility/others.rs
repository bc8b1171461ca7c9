//! Friction so large that the body wedges: the law then has several answers, and the curve is one of them.

use super::units::short;
use super::warning;
use crate::drive::Driven;
use crate::report::{Warning, coefficient_in_words};

pub(super) fn several_answers(driven: &Driven) -> Option<Warning> {
    let (of, other) = (driven.friction?, driven.other?);
    let way = match other.phase {
        device::Phase::Retract => "out",
        _ => "in",
    };
    Some(warning(
        "several-answers",
        other.difference,
        format!(
            "with a friction coefficient of {} the body can wedge: {} mm on the way {way} other forces obey the law of friction \
             as well ({} N for {} N on this curve; the forces on the tool differ by {} % of the larger). From there on this \
             curve is one of several; a lower effects.friction_coefficient or a flatter flank has one",
            coefficient_in_words(&of),
            short(1e3 * other.travel),
            short(other.other_force),
            short(other.force),
            short(100.0 * other.difference)
        ),
    ))
}
