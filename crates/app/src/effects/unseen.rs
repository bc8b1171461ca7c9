//! Effects of which a quasi-static run shows nothing: each is left out, and told so.
//!
//! Settings: `effects.gravity`, `tool_inertia`, `part_inertia`, `damping`, `deformable_tool`. Stage: none yet.

use super::{Effect, Verdict};

pub(super) fn judge(effect: Effect) -> Verdict {
    let why = match effect {
        Effect::Gravity => "not estimated; weight of part and tool is left out",
        Effect::ToolInertia => "not estimated; the tool follows its coupling without mass",
        Effect::PartInertia => "not estimated; the part answers quasi-statically",
        Effect::Damping => "not estimated; only of interest with part inertia",
        _ => "not estimated; the tool is rigid",
    };
    Verdict::quiet(effect, why.to_owned())
}
