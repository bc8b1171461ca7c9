//! Which physical effects are simulated, and what the others would change.

use super::super::data::Effect;
use super::super::plot::short;
use super::blocks::{section, table};

/// Every effect with its estimate.
pub(super) fn effects(page: &mut String, effects: &[Effect]) {
    section(page, "Physical effects");
    let rows: Vec<Vec<String>> = effects
        .iter()
        .map(|effect| {
            vec![
                effect.name.clone(),
                if effect.on { "on" } else { "off" }.to_owned(),
                effect.number.map_or("not estimated".into(), short),
                short(effect.threshold),
                effect.why.clone(),
            ]
        })
        .collect();
    page.push_str(
        "<p>An effect matters from its threshold on. What is off is not simulated and costs \
         nothing.</p>\n",
    );
    let loud: Vec<usize> = effects
        .iter()
        .enumerate()
        .filter(|(_, e)| !e.on && e.number.is_some_and(|n| n >= e.threshold))
        .map(|(idx, _)| idx)
        .collect();
    table(
        page,
        &["effect", "", "number", "threshold", "why"],
        &rows,
        &loud,
        true,
    );
}
