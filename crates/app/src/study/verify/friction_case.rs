//! Coulomb friction along a path of poses: each increment of the path is one step of the engine that the hand feels.
//!
//! The law is that of the engine: slip counts from the displacement at the end of the last increment, in the tangent
//! plane at the end of this one.

mod asked;
mod problem;
mod values;
mod walk;

use std::sync::Arc;

use contact::delassus::ComplianceBlocks;
use fem::Quadrature;
use glam::DVec3;
use serde_json::Value;

use super::case::Case;
use super::contact_case::{Touchable, touchable};
use super::elastic_case::Elastic;
use super::expected::keys;
use super::{Failure, Outcome, Quantity};
use crate::engine::ContactPart;
use crate::progress::Ui;
pub(super) use asked::Asked;
use walk::{Walk, walk};

/// Parts by quadrature rule and walks by what they were walked with: most quantities are of the same walk.
struct Bench<'a> {
    case: &'a Case,
    ready: Vec<Touchable>,
    walks: Vec<(How, Walk)>,
}

/// How a path is walked.
#[derive(Clone, Copy, PartialEq)]
struct How {
    quadrature: Quadrature,
    substeps: u32,
    is_frictionless: bool,
    is_repeated: bool,
}

pub(super) fn run(case: &Case, ui: &Ui<'_>) -> Outcome {
    if case.poses.len() < 2 {
        return Err(Failure::Error(format!(
            "case.toml: has {} [[pose]]; a path has two or more, the first clear of the part",
            case.poses.len()
        )));
    }
    let mut bench = Bench {
        case,
        ready: Vec::new(),
        walks: Vec::new(),
    };
    let mut quantities = Vec::new();
    for quantity in case.all_quantities() {
        let name = quantity["name"].as_str().unwrap_or_default();
        if name.starts_with("compliance") {
            let quadrature = case.quadrature(quantity)?;
            let computed = bench
                .part(quadrature, ui)?
                .elastic
                .compliance_block(quantity)?;
            quantities.push(compared(quantity, computed, &[]));
        } else if let Some((asked, rule)) = Asked::of(name) {
            let quadrature = match rule {
                Some(rule) => rule,
                None => default_rule(case, quantity)?,
            };
            quantities.push(bench.compute(quantity, asked, quadrature, ui)?);
        }
    }
    let walks = || bench.walks.iter().map(|(_, walk)| walk);
    let told = walks().filter_map(|walk| walk.unsettled.as_deref());
    // Of one walk: the others go the same way.
    let other = walks().find_map(|walk| walk.other.as_deref());
    let mut message: Vec<&str> = told.chain(other).collect();
    if quantities.iter().all(Quantity::is_informative) {
        message.push("all quantities are informative: computed and finite is all that is asked");
    }
    Ok((message.join("; "), quantities))
}

/// Where a quantity names no rule: that of the file's first path, which frictionless values beside it share.
fn default_rule(case: &Case, quantity: &Value) -> Result<Quadrature, Failure> {
    if !quantity["quadrature"].is_null() {
        return case.quadrature(quantity);
    }
    let mut rules = case
        .all_quantities()
        .filter_map(|q| Asked::of(q["name"].as_str()?)?.1);
    Ok(rules.next().unwrap_or_else(|| case.own_quadrature()))
}

impl Bench<'_> {
    fn part(&mut self, quadrature: Quadrature, ui: &Ui<'_>) -> Result<&Touchable, Failure> {
        let is_there = |t: &Touchable| t.elastic.quadrature == quadrature;
        let at = match self.ready.iter().position(is_there) {
            Some(at) => at,
            None => {
                let path = &self.case.mesh_paths[0];
                let elastic = Elastic::new(self.case, path, quadrature, ui)?;
                self.ready.push(touchable(self.case, path, elastic, ui)?);
                self.ready.len() - 1
            }
        };
        Ok(&self.ready[at])
    }

    fn walked(&mut self, how: How, ui: &Ui<'_>) -> Result<&Walk, Failure> {
        let at = match self.walks.iter().position(|(h, _)| *h == how) {
            Some(at) => at,
            None => {
                let case = self.case;
                let ready = self.part(how.quadrature, ui)?;
                let part = if how.is_repeated {
                    Arc::new(twice(&ready.part)?)
                } else {
                    ready.part.clone()
                };
                // Zero is none: the frictionless problem, not one on a cone without width.
                let friction = case.friction.filter(|mu| *mu > 0.0 && !how.is_frictionless);
                let walk = walk(case, ready, &part, how.substeps, friction)?;
                self.walks.push((how, walk));
                self.walks.len() - 1
            }
        };
        Ok(&self.walks[at].1)
    }

    fn compute(
        &mut self,
        quantity: &Value,
        asked: Asked,
        quadrature: Quadrature,
        ui: &Ui<'_>,
    ) -> Result<Quantity, Failure> {
        let expected = &quantity["value"];
        let name = quantity["name"].as_str().unwrap_or_default();
        check_against_case(self.case, name, asked, expected)?;
        let case = self.case;
        let how = How {
            quadrature,
            substeps: match asked {
                Asked::Path { substeps } | Asked::Summary { substeps } => substeps,
                _ => 1,
            },
            is_frictionless: asked == Asked::Frictionless,
            is_repeated: asked == Asked::Repeated,
        };
        let (computed, is_solved, keys): (Value, bool, &[&str]) = match asked {
            Asked::Problem => {
                let (computed, is_solved) = problem::solve(expected)?;
                (computed, is_solved, &keys::PROBLEM_COMPARED)
            }
            Asked::Path { .. } | Asked::Repeated => {
                let walk = self.walked(how, ui)?;
                (
                    values::path(&walk.listed),
                    walk.is_settled(),
                    &keys::PATH_COMPARED,
                )
            }
            Asked::Summary { .. } => {
                let walk = self.walked(how, ui)?;
                let computed = values::summary(case, &walk.listed, quantity);
                (computed, walk.is_settled(), &keys::SUMMARY_COMPARED)
            }
            Asked::Frictionless => {
                let walk = self.walked(how, ui)?;
                let mut all = values::summary(case, &walk.listed, quantity);
                all["force_on_tool_N"] = values::path(&walk.listed)["force_on_tool_N"].take();
                (all, walk.is_settled(), &keys::FRICTIONLESS_COMPARED)
            }
            Asked::State { pose } => {
                let walk = self.walked(how, ui)?;
                let is_settled = walk.is_settled();
                let listed = walk
                    .listed
                    .get(pose.wrapping_sub(1))
                    .cloned()
                    .unwrap_or_default();
                let ready = self.part(quadrature, ui)?;
                (
                    values::state(&listed, ready, expected)?,
                    is_settled,
                    &keys::STATE_COMPARED,
                )
            }
        };
        Ok(compared(quantity, computed, keys).and(is_solved))
    }
}

fn compared(quantity: &Value, computed: Value, keys: &[&str]) -> Quantity {
    let name = quantity["name"].as_str().unwrap_or_default();
    let (expected, tolerance) = (&quantity["value"], &quantity["tolerance"]);
    let compared = Quantity::compare_keys(name, computed, expected, tolerance, keys);
    if quantity["informative"] == Value::Bool(true) {
        compared.informative()
    } else {
        compared
    }
}

/// What a quantity asks for must be on the path, and its lists as long as that.
fn check_against_case(
    case: &Case,
    name: &str,
    asked: Asked,
    expected: &Value,
) -> Result<(), Failure> {
    let n = case.poses.len();
    let wrong = |what: String| Err(Failure::Error(format!("expected.json: {name}: {what}")));
    match asked {
        Asked::Path { substeps } | Asked::Summary { substeps }
            if !case.substeps.contains(&substeps) =>
        {
            return wrong(format!(
                "[path] substeps of case.toml is {:?}; add {substeps} to it, or name one of these",
                case.substeps
            ));
        }
        Asked::State { pose } if !(1..=n).contains(&pose) => {
            return wrong(format!("case.toml has [[pose]] number 1 to {n}"));
        }
        // The state's object is by node, not by pose.
        Asked::State { .. } | Asked::Problem => return Ok(()),
        _ => {}
    }
    for key in keys::PATH_COMPARED {
        match expected[key].as_array() {
            Some(list) if list.len() != n => {
                return wrong(format!(
                    "{key} has {} entries, case.toml has {n} [[pose]]; each pose has its entry",
                    list.len()
                ));
            }
            _ => {}
        }
    }
    Ok(())
}

/// Candidates that are listed twice: 4 n² blocks of 72 bytes are 1.2 GB then.
const MOST_REPEATED: usize = 2000;

/// The part with every candidate listed twice: W is singular then, and what each of the two carries is not unique.
fn twice(part: &ContactPart) -> Result<ContactPart, Failure> {
    let n = part.n_candidates();
    if n > MOST_REPEATED {
        return Err(Failure::NotSupported(format!(
            "quantity \"repeated\" with {n} nodes that can touch; {MOST_REPEATED} are the most"
        )));
    }
    let rest: Vec<DVec3> = [part.rest_positions(); 2].concat();
    let mut blocks = Vec::with_capacity(9 * rest.len() * rest.len());
    for j in 0..2 * n {
        for i in 0..2 * n {
            blocks.extend(part.block(i % n, j % n).to_cols_array());
        }
    }
    Ok(ContactPart::new(rest, 2 * n, blocks))
}

/// Numbers of a list.
fn numbers(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(Value::as_f64)
        .collect()
}
