//! From a recording to what the report tells: moments worth a picture, extremes, verdicts.

pub(crate) mod drawing;
mod handbook;
mod moments;
mod skin;
pub(crate) mod strain;
mod words;

use glam::DVec3;

use crate::Error;
use crate::between::BetweenNodes;
use crate::choice::Why;
use crate::drive::{Driven, Seen};
use crate::effects::{self, Motion, Observed, Verdict, judge};
use crate::elsewhere::Elsewhere;
use crate::engine::{Engine, Stage};
use crate::fields::FieldSolver;
use crate::machine::Machine;
use crate::prepare::PreparedPart;
use crate::report::{
    self, ContactForce, Doubts, Effect, Facts, Frame, FrictionFacts, Limits, MultiplyFacts,
    MultiplyRace, Origin, Outputs, PaperStage, PartCurve, Phase, RateFacts, Run, StepRow,
    StrainFacts, TwoRateFacts, View, Viewing, Warning,
};
use crate::scene::{self, EffectChoice, Scene, ToolShape};
use crate::session::{Record, Recording, part_extent};
use crate::shape::Shape;
pub(crate) use drawing::shortest_edge;
use moments::Moments;

/// Of the peak, the height of steps from node to node above which they are taken for it.
const MOST_TOOTH: f64 = 0.5;

/// Everything that a run is made of.
pub(crate) struct Story<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) prepared: &'a PreparedPart,
    /// Of the drive.
    pub(crate) engine: &'a Engine,
    /// The part's own curve: verdict, strain and pictures are of it.
    pub(crate) driven: &'a Driven,
    /// What a hand felt, if the scene has one.
    pub(crate) felt: Option<Felt<'a>>,
    pub(crate) remarks: Vec<String>,
    /// What makes the result doubtful.
    pub(crate) doubts: Vec<Warning>,
    pub(crate) origin: Origin,
    /// What a time budget was made into.
    pub(crate) picked: Option<String>,
}

/// A session of a hand.
#[derive(Clone, Copy)]
pub(crate) struct Felt<'a> {
    pub(crate) recording: &'a Recording,
    pub(crate) shape: &'a Shape,
    /// Whether the steps had to keep up with a clock.
    pub(crate) is_real_time: bool,
}

impl Story<'_> {
    /// Solves for the pictures and puts the report's data together.
    ///
    /// # Errors
    /// As the field solver; Ctrl-C.
    pub(crate) fn tell(mut self, progress: &dyn fem::Progress) -> Result<Run, Error> {
        let Story {
            scene, prepared, ..
        } = self;
        let recording = &self.driven.recording;
        let solver = FieldSolver::new(prepared, progress)?;
        let part_curve = PartCurve::of(&self.driven.rows());
        let snap = part_curve.snap().map(|snap| snap.row_idx);
        let moments = Moments::of(recording, snap);
        let mut between = BetweenNodes::new(prepared, self.engine);
        let mut elsewhere = Elsewhere::new(&prepared.loaded, self.engine.tool());
        // Behind the largest peak that is passed, more force than there is that of the seat.
        let is_seat = |i: usize| {
            let snap = part_curve.snap();
            snap.is_some_and(|snap| {
                i > snap.row_idx && recording.resistance(&recording.records[i]) > snap.force_n
            })
        };
        let strained = self.strain(&solver, &moments.sampled(), is_seat, &mut |u, record| {
            between.look(u, &record.report.tool_pose);
            elsewhere.look(u, &record.report.tool_pose, record.travel);
        })?;
        let (frames, drawn_rotation) = self.frames(&solver, &moments, strained.index);
        let max_rotation = strained.max_rotation.max(drawn_rotation);
        self.remarks.extend(strained.facts.remarks());
        let verdicts: Vec<Verdict> = judge(&self.observed(max_rotation))
            .into_iter()
            .map(|verdict| self.as_simulated(verdict, &part_curve))
            .filter(|v| v.effect.choice(&scene.effects) != EffectChoice::Off || v.missing)
            .collect();
        let way = recording.records.iter().map(|r| r.travel);
        let way = way.fold(0.0, f64::max);
        let gets_in = between.gets_in(way);
        let between = between.warning(way);
        let mut doubts: Vec<String> = between.clone().filter(|_| gets_in).into_iter().collect();
        // Where the force falls from node to node by most of the peak, the peak may be that of a node.
        let teeth = self
            .doubts
            .iter()
            .filter(|w| w.id == "teeth" && w.number > Some(MOST_TOOTH));
        doubts.extend(teeth.map(|w| w.text.clone()));
        let elsewhere = elsewhere.warning(way);
        doubts.extend(elsewhere.clone());
        let aside = |w: &&Warning| ["left-symmetry-plane", "several-answers"].contains(&w.id);
        doubts.extend(self.doubts.iter().filter(aside).map(|w| w.text.clone()));
        // A way that ends behind the snap ends at a seat.
        doubts.extend(self.stopped().filter(|_| snap.is_none()));
        let driven = self.judged(&verdicts, doubts, &strained.facts);
        let mut warnings = self.remarks.clone();
        warnings.extend(between);
        warnings.extend(elsewhere);
        warnings.extend(part_curve.ends_in_the_fall());
        warnings.extend(self.stopped());
        warnings.extend(
            verdicts
                .iter()
                .filter_map(|v| words::called_for(v, v.effect.choice(&scene.effects))),
        );
        warnings.extend(self.troubles());
        let felt = self.felt.map(|felt| felt.recording);
        let rows: Vec<StepRow> = felt.map_or_else(Vec::new, |felt| {
            felt.records.iter().map(|r| self.row(felt, r)).collect()
        });
        Ok(Run {
            title: scene.title.clone(),
            scene_path: scene.path.display().to_string(),
            machine: Machine::read().summary(),
            origin: self.origin.clone(),
            settings: self.settings(),
            checks: self.checks(),
            notes: self.notes(),
            warnings: [
                self.doubts.clone(),
                warnings.into_iter().map(Warning::from).collect(),
            ]
            .concat(),
            facts: self.facts(&strained.facts, max_rotation),
            handbook: handbook::beside(scene, self.driven, strained.facts.value()),
            strain: strained.facts,
            paper: paper(&rows),
            driven: Some(driven),
            rows,
            part: drawing::part(&prepared.loaded.mesh),
            frames,
            effects: verdicts.into_iter().map(effect).collect(),
            viewing: viewing(scene, recording.direction),
            outputs: Outputs {
                png: scene.output.pictures,
                vtu: scene.output.vtu,
                mcap: scene.output.mcap,
            },
        })
    }

    /// Pictures of the moments that are worth one, and the largest rotation in them, rad.
    fn frames(
        &self,
        solver: &FieldSolver<'_>,
        moments: &Moments,
        strained: Option<usize>,
    ) -> (Vec<Frame>, f64) {
        let recording = &self.driven.recording;
        let tool_extent = 0.4 * part_extent(&self.prepared.loaded.mesh);
        let mut max_rotation = 0.0_f64;
        let mut frames = Vec::new();
        let count = self.scene.output.frames as usize;
        for (label, index) in moments.labelled(count, strained) {
            let record = &recording.records[index];
            let u = solver.displacement(recording, record);
            max_rotation = max_rotation.max(solver.extremes(&u).max_rotation);
            let mut frame = self.frame(
                label,
                record,
                u.at_nodes(),
                solver.von_mises(&u),
                tool_extent,
            );
            if strained == Some(index) {
                frame.strain = solver.principal_strain(&u);
            }
            frames.push(frame);
        }
        (frames, max_rotation)
    }

    fn facts(&self, strain: &StrainFacts, max_rotation: f64) -> Facts {
        let loaded = &self.prepared.loaded;
        let felt = self.felt.as_ref();
        Facts {
            nodes: loaded.mesh.n_nodes(),
            elements: loaded.mesh.n_elements(),
            order: loaded.mesh.order as u32,
            surface_nodes: loaded.rows.len(),
            candidates: loaded.candidates.len(),
            coupling_stiffness: felt.map(|_| self.scene.coupling.translational_stiffness),
            prepare_s: self.prepared.total_seconds(),
            from_cache: self.prepared.from_cache,
            missed_deadlines: felt
                .filter(|felt| felt.is_real_time)
                .map(|felt| felt.recording.servo.missed_deadlines),
            max_principal_strain: strain.value(),
            max_rotation_deg: max_rotation.to_degrees(),
            rates: felt.map_or_else(Default::default, |felt| rate_facts(felt.recording)),
            multiply: felt.map_or_else(Default::default, |felt| multiply_facts(felt.shape)),
        }
    }

    /// The driven curve with its verdict. `others`: what makes it another than the part's, besides missing effects.
    fn judged(
        &self,
        effects: &[Verdict],
        others: Vec<String>,
        strain: &StrainFacts,
    ) -> report::Driven {
        // What the scene leaves out on purpose is told, and the curve is complete without it. No step of the drive goes
        // through anything: that is a matter of the hand.
        let counts = |v: &&Verdict| {
            v.effect.choice(&self.scene.effects) == EffectChoice::Auto
                && v.effect != effects::Effect::ContinuousCollision
        };
        let missing = || effects.iter().filter(counts);
        let friction = missing().find(|v| v.missing && v.effect == effects::Effect::Friction);
        let doubts = Doubts {
            missing_effects: missing()
                .filter_map(|v| words::called_for(v, v.effect.choice(&self.scene.effects)))
                .collect(),
            friction_share: friction.and_then(|v| v.number),
            friction_out_n: friction.and_then(|v| v.added_on_the_way_out),
            others,
        };
        let asked = &self.scene.limits;
        let limits = Limits {
            insertion_below: asked.insertion_below,
            removal_above: asked.removal_above,
            strain_below: asked.strain_below,
            strain_use: match asked.strain_use {
                scene::StrainUse::Once => report::StrainUse::Once,
                scene::StrainUse::Repeatedly => report::StrainUse::Repeatedly,
            },
        };
        let driven = report::Driven::of(self.driven.rows(), &doubts, &limits, strain);
        let source = &self.scene.effects.friction_source;
        let friction = self.driven.friction.map(|coefficients| {
            FrictionFacts::of(coefficients, source.clone(), self.driven.plain().rows())
        });
        report::Driven { friction, ..driven }
    }

    fn row(&self, felt: &Recording, record: &Record) -> StepRow {
        let reach = part_extent(&self.prepared.loaded.mesh);
        StepRow {
            step: record.step,
            time_s: record.time_s,
            phase: phase(record),
            travel_m: record.travel,
            // Adding zero turns a negative zero into a zero.
            force_n: felt.resistance(record) + 0.0,
            force_on_handle: record.wrench_on_handle.force + DVec3::ZERO,
            torque_on_handle: record.wrench_on_handle.torque + DVec3::ZERO,
            contacts: record.report.contacts,
            pivots: record.report.pivots,
            certificate: record.report.certificate,
            wrench_mismatch_rel: record.report.wrench_mismatch_rel(reach),
            handle_pose: record.handle_pose,
            tool_pose: record.report.tool_pose,
            stage_ns: record.report.stage_ns,
            total_ns: record.step_ns,
            multiply_ns: record.multiply_ns,
        }
    }

    fn frame(
        &self,
        label: String,
        record: &Record,
        u: &[f64],
        von_mises: Vec<f64>,
        extent: f64,
    ) -> Frame {
        let loaded = &self.prepared.loaded;
        let displacement: Vec<DVec3> = u.chunks_exact(3).map(DVec3::from_slice).collect();
        let recording = &self.driven.recording;
        let contacts = recording
            .contacts(record)
            .iter()
            .map(|c| {
                let node = loaded.contact_node(c.candidate);
                let rest = DVec3::from_array(loaded.mesh.nodes[node as usize]);
                ContactForce {
                    node,
                    point: rest + displacement[node as usize],
                    force: c.force_on_part,
                    sticks: c.sticks,
                }
            })
            .collect();
        let (corners, triangles) = self.engine.tool().tessellate(extent);
        let pose = record.report.tool_pose;
        let corner = |i: u32| pose * corners[i as usize];
        Frame {
            label,
            step: record.step,
            travel_m: record.travel,
            force_n: recording.resistance(record) + 0.0,
            displacement,
            von_mises,
            strain: Vec::new(),
            contacts,
            tool: triangles.into_iter().map(|t| t.map(corner)).collect(),
        }
    }

    /// What an effect that is simulated has changed, in place of what was expected of it.
    fn as_simulated(&self, verdict: Verdict, curve: &PartCurve) -> Verdict {
        match &self.driven.friction {
            Some(coefficients) if verdict.effect == effects::Effect::Friction => {
                let plain = PartCurve::of(&self.driven.plain().rows());
                words::friction_in(verdict, coefficients, curve, &plain)
            }
            _ => verdict,
        }
    }

    fn observed(&self, max_rotation: f64) -> Observed {
        let feature = drawing::shortest_edge(&self.prepared.loaded.mesh)
            .min(self.engine.tool().characteristic_size());
        // Nothing runs through anything where the steps are those of the way itself.
        let motion = self.felt.map_or(Motion::None, |felt| {
            let place = |record: &Record| record.report.tool_pose.translation;
            let records = felt.recording.records.windows(2);
            let steps = records.map(|w| (place(&w[1]) - place(&w[0])).length());
            Motion::Seen(steps.fold(0.0, f64::max) / feature)
        });
        let Seen {
            ramp,
            release,
            has_passed,
        } = Seen::of(self.driven.plain());
        Observed {
            max_rotation,
            ramp,
            release,
            has_passed,
            friction_coefficient: self.scene.effects.largest_friction(),
            motion_per_feature: motion,
        }
    }
}

fn phase(record: &Record) -> Phase {
    match record.phase {
        device::Phase::Approach => Phase::Approach,
        device::Phase::Retract => Phase::Retract,
        device::Phase::Hold | device::Phase::Done => Phase::Hold,
    }
}

fn effect(verdict: Verdict) -> Effect {
    Effect {
        name: verdict.effect.name().to_owned(),
        on: verdict.on,
        number: verdict.number,
        threshold: verdict.threshold,
        why: verdict.why,
    }
}

fn multiply_facts(shape: &Shape) -> MultiplyFacts {
    let choice = shape.choice();
    MultiplyFacts {
        runs_on: choice.runs_on.clone(),
        is_on_gpu: choice.is_on_gpu,
        why: choice.why.name(),
        words: choice.words_in_full(),
        race: match &choice.why {
            Why::Faster(race) => Some(MultiplyRace {
                adapter: race.adapter.clone(),
                n_contacts: race.n_contacts,
                processor_s: race.processor_s,
                gpu_s: race.gpu_s,
                is_remembered: race.is_remembered,
            }),
            _ => None,
        },
        n_late: shape.n_late(),
        given_up: shape.given_up().map(str::to_owned),
    }
}

fn rate_facts(recording: &Recording) -> RateFacts {
    let two = recording.two_rates.as_ref().map(|two| {
        let (difference_median_n, difference_max_n) = two.differences();
        TwoRateFacts {
            every: recording.rates.every.filter(|_| !recording.rates.is_beside),
            hand_overs: two.log.hand_overs.len() as u64,
            difference_median_n,
            difference_max_n,
            max_staleness: two.log.max_staleness,
            beyond_margin: two.log.beyond_margin,
            faded: two.log.faded,
            engine_us: two.step_us(),
        }
    });
    RateFacts {
        why: recording.rates.why.clone(),
        two,
    }
}

/// As the scene says; else along the tool's axis if it has one, or across the approach.
pub(crate) fn viewing(scene: &Scene, approach: DVec3) -> Viewing {
    let axis = match scene.tool.shape {
        ToolShape::Cylinder { .. } | ToolShape::Capsule { .. } => {
            scene.tool.pose_part_tool.rotation * DVec3::Z
        }
        _ => approach.any_orthonormal_vector(),
    };
    let up_beside = |axis: DVec3| {
        if axis.y.abs() < 0.9 {
            DVec3::Y
        } else {
            DVec3::Z
        }
    };
    let view = match scene.output.camera {
        Some(camera) => View {
            direction: -camera,
            up: up_beside(camera),
        },
        None => View::three_quarter(-axis, up_beside(axis)),
    };
    Viewing {
        view,
        is_fixed: scene.output.camera.is_some(),
        approach,
    }
}

/// The paper's three times beside the medians of the same work here, while something touches.
fn paper(rows: &[StepRow]) -> Vec<PaperStage> {
    let median = |time: &dyn Fn(&StepRow) -> Option<u64>| {
        let mut times: Vec<u64> = rows
            .iter()
            .filter(|r| r.contacts > 0)
            .filter_map(time)
            .collect();
        times.sort_unstable();
        times
            .get(times.len() / 2)
            .map_or(0.0, |ns| 1e-3 * *ns as f64)
    };
    let of =
        |row: &StepRow, stages: &[Stage]| stages.iter().map(|s| row.stage_ns[*s as usize]).sum();
    PaperStage::duriez_2004(
        median(&|r| Some(of(r, &[Stage::Proximity, Stage::Planes]))),
        median(&|r| {
            let response = [Stage::Delassus, Stage::Lcp, Stage::Update];
            Some(of(r, &response))
        }),
        median(&|r| r.multiply_ns),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn report_and_engine_name_the_same_stages() {
        assert_eq!(crate::report::STAGE_NAMES, Stage::ALL.map(Stage::name));
    }
}
