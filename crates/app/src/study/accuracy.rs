//! `snapin accuracy`: what accuracy costs in time, for each choice that trades one for the other.
//!
//! Every setting is asked the same question: the handle goes along the scene's path, step by step,
//! and the engine answers with wrenches. They are compared with a reference, an overkill run of the
//! program's own or a file, and each step is timed. Finished settings are kept in files, so that an
//! interrupted study goes on where it was.

mod busy;
mod compare;
mod measure;
mod page;
mod peak;
mod pick;
mod point;
mod store;
mod table;

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

pub use busy::Repeats;
pub use compare::{Errors, Reference};
pub use measure::{Measured, Times};
pub use page::write;
pub use pick::{Picked, resolved};
pub use point::{Axis, Point, Setting};
pub use table::text;

use crate::choice::name_of;
use crate::machine::Machine;
use crate::prepare::{PrepareOptions, budget::Forecast, load};
use crate::progress::Ui;
use crate::report::Origin;
use crate::scene::{Accuracy, Handle, Multiply, Preset, Scene};
use crate::session::part_extent;
use crate::{Error, interrupt, plausibility, setup};
use compare::{Scales, distance, errors};
use measure::{Course, Samples};
use store::Store;

/// Seconds that preparing the reference may take by its forecast, and in a quick study.
const REFERENCE_S: f64 = 120.0;
const QUICK_REFERENCE_S: f64 = 5.0;

/// Curves that peak at more than this multiple of the reference would hide the others.
const OFF_SCALE: f64 = 2.0;

/// Planes of the exact solution: enough for any part that is touched at nodes.
const MOST_CONTACTS: usize = 500;

/// What is asked for.
#[derive(Clone, Debug)]
pub struct StudyOptions {
    /// Folder of the result.
    pub out: PathBuf,
    /// Which choices.
    pub axes: Vec<Axis>,
    /// Values to compare with, instead of an overkill run.
    pub reference: Option<PathBuf>,
    /// Where to write the reference for later.
    pub save_reference: Option<PathBuf>,
    /// s of timed steps for each setting; `None`: enough for the 99.9 % of a table.
    pub timed_s: Option<f64>,
    /// Forget what was finished before.
    pub fresh: bool,
}

/// A line of the tables.
#[derive(Clone, Debug)]
pub struct Row {
    /// Which choice.
    pub axis: Axis,
    /// Which setting.
    pub label: String,
    /// Whether it is the scene's own setting.
    pub is_own: bool,
    /// Result and errors, or why there is none.
    pub outcome: Result<(Measured, Errors), String>,
}

/// The result of the command.
#[derive(Clone, Debug)]
pub struct Study {
    /// Title of the scene.
    pub title: String,
    /// Its file.
    pub scene_path: String,
    /// The scene's own settings in words.
    pub own: String,
    /// Where it ran.
    pub machine: String,
    /// When it ended, and from what.
    pub origin: Origin,
    /// By axis.
    pub rows: Vec<Row>,
    /// What was compared with.
    pub reference: Reference,
    /// N and m: the reference's snap, or its largest force where it does not snap.
    pub peak: (f64, f64),
    /// Whether it snaps.
    pub is_snap: bool,
    /// Programs that wanted a core when the study began, as the system counts them; 0 where it does not.
    pub load: f64,
    /// Cores.
    pub cores: usize,
    /// Curves of force (N) over travel (m) for the plot, the reference first.
    pub curves: Vec<(String, Vec<(f64, f64)>)>,
    /// Settings whose curve is beyond that plot, with their peaks (N).
    pub off_scale: Vec<(String, f64)>,
    /// Settings that were finished before.
    pub n_resumed: usize,
    /// Name of the graphics adapter that multiplied in some settings.
    pub adapter: Option<String>,
    /// A choice that this machine does not have, with the reason.
    pub not_there: Vec<(&'static str, String)>,
}

/// Runs or resumes a study.
///
/// # Errors
/// What stops the scene's own setting; a reference file that does not fit; Ctrl-C. Other settings that
/// cannot be run are rows that say why.
pub fn run(
    scene: &Scene,
    options: &StudyOptions,
    prepare: &PrepareOptions,
    ui: &Ui<'_>,
) -> Result<Study, Error> {
    let load_average = sysinfo::System::load_average().one;
    if scene.effects.friction_coefficient.is_some() {
        ui.note("friction is left out of this study, which weighs errors by the energy that a part gives back");
    }
    let mut scene = scene.with_friction(false);
    scene.accuracy.budget_us = None;
    let own_order = store::own_order(&scene)?;
    scene.part.order.get_or_insert(own_order);
    point::multiply_written(&mut scene);
    let scene = &scene;
    // Drivers are asked only if a setting may need them.
    let asks_gpu = options.axes.contains(&Axis::Scalar) || scene.accuracy.multiply == Multiply::Gpu;
    let adapters = asks_gpu.then(gpu::Adapters::find);
    let best = adapters.as_ref().and_then(|found| found.best(true).ok());
    let adapter = best.map(name_of);
    let not_there = match (&adapters, &adapter) {
        (Some(found), None) => vec![("multiply on the GPU", found.to_string())],
        _ => Vec::new(),
    };
    let identity = store::identity(scene)?;
    let course = Course::of(scene);
    let reference_file = match &options.reference {
        Some(file) => Some(store::read_reference(
            file,
            scene,
            &identity,
            course.targets.len(),
        )?),
        None => None,
    };
    let folder = options.out.join("points");
    if options.fresh {
        store::forget(&folder);
    }
    let mut runner = Runner {
        store: Store::new(&folder, &identity)?,
        course,
        samples: None,
        options,
        prepare,
        ui,
        done: HashMap::new(),
        prepare_s: HashMap::new(),
        n_resumed: 0,
        adapter,
    };
    let own = runner.base(scene);
    let loaded = load(&setup::part_spec(scene)?)?;
    plausibility::tell(&plausibility::of_part(scene, &loaded), ui);
    let scales = Scales {
        direction: match scene.handle {
            Handle::Tool => scene.drive.direction,
            Handle::Part => -scene.drive.direction,
        }
        .to_array(),
        lever: part_extent(&loaded.mesh),
        travel: scene.drive.travel,
    };
    runner.run(&own)?;
    let reference = match reference_file {
        Some(reference) => reference,
        None => runner.overkill(scene, &scales)?,
    };
    if let Some(file) = &options.save_reference {
        store::save_reference(file, scene, &identity, &reference)?;
    }

    let points = point::points(
        scene,
        &options.axes,
        store::own_order(scene)?,
        scales.lever,
        runner.adapter.as_deref(),
    );
    let mut rows = Vec::with_capacity(points.len());
    let begun = Instant::now();
    for (k, point) in points.iter().enumerate() {
        runner.tell(
            k,
            points.len(),
            begun,
            &format!("{} {}", point.axis.name(), point.label),
        );
        let outcome = match runner.run_beside_exact(&point.setting) {
            Ok((measured, exact)) => {
                let errors = errors(&measured, &exact, &reference, &scales);
                Ok((measured, errors))
            }
            Err(e) if e.is_interrupt() => return Err(e),
            Err(e) => Err(e.to_string()),
        };
        rows.push(Row {
            axis: point.axis,
            label: point.label.clone(),
            is_own: point.setting.key() == own.key(),
            outcome,
        });
    }
    let curve = |wrenches: &[[f64; 6]]| -> Vec<(f64, f64)> {
        let last = wrenches.len().saturating_sub(1).max(1) as f64;
        let at = |(k, w)| (scales.travel * k as f64 / last, scales.resistance(w));
        wrenches.iter().enumerate().map(at).collect()
    };
    let mut curves = vec![("reference".to_owned(), curve(&reference.wrench))];
    let mut off_scale = Vec::new();
    let is_curve = |r: &&Row| r.axis == Axis::Order || (r.axis == Axis::Mesh && !r.is_own);
    for row in rows.iter().filter(is_curve) {
        if let Ok((measured, _)) = &row.outcome {
            let largest = scales.largest(&measured.wrench);
            if largest > OFF_SCALE * scales.largest(&reference.wrench) {
                off_scale.push((row.label.clone(), largest));
            } else {
                curves.push((row.label.clone(), curve(&measured.wrench)));
            }
        }
    }
    let machine = Machine::read();
    let peak = scales.peak(&reference.wrench);
    Ok(Study {
        title: scene.title.clone(),
        scene_path: scene.path.display().to_string(),
        own: scene.accuracy.words(),
        machine: machine.summary(),
        origin: crate::origin::read(scene, None)?,
        peak: (
            peak.force,
            scales.travel_at(peak.at, reference.wrench.len()),
        ),
        is_snap: peak.is_snap,
        load: load_average,
        cores: machine.cores,
        rows,
        reference,
        curves,
        off_scale,
        n_resumed: runner.n_resumed,
        adapter: runner.adapter,
        not_there,
    })
}

/// Runs settings, each once.
struct Runner<'a, 'u> {
    store: Store,
    course: Course,
    samples: Option<Samples>,
    options: &'a StudyOptions,
    prepare: &'a PrepareOptions,
    ui: &'a Ui<'u>,
    done: HashMap<String, Result<Measured, String>>,
    /// s, by part.
    prepare_s: HashMap<String, f64>,
    n_resumed: usize,
    /// Name of the graphics adapter that multiplies where a setting asks for one.
    adapter: Option<String>,
}

impl Runner<'_, '_> {
    fn base(&self, scene: &Scene) -> Setting {
        point::base(scene, self.adapter.as_deref())
    }

    fn tell(&self, k: usize, n: usize, begun: Instant, what: &str) {
        let left = if k == 0 {
            String::new()
        } else {
            let each = begun.elapsed().as_secs_f64() / k as f64;
            let left = crate::prepare::budget::duration(each * (n - k) as f64);
            format!(", about {left} left")
        };
        const WIDTH: usize = 24;
        let full = WIDTH * k / n.max(1);
        let bar = "█".repeat(full) + &"░".repeat(WIDTH - full);
        let line = format!("{bar} {} of {n}: {what}{left}", k + 1);
        self.ui.status(&line);
    }

    /// The setting's result: of this run, of an earlier one, or anew.
    fn run(&mut self, setting: &Setting) -> Result<Measured, Error> {
        if interrupt::is_requested() {
            return Err(Error::Interrupted);
        }
        let key = setting.key();
        if let Some(done) = self.done.get(&key) {
            return done.clone().map_err(Error::Input);
        }
        let outcome = self.run_anew(setting);
        match &outcome {
            Ok(measured) => self.done.insert(key, Ok(measured.clone())),
            Err(e) if e.is_interrupt() => None,
            Err(e) => self.done.insert(key, Err(e.to_string())),
        };
        outcome
    }

    /// The setting's result, and the wrenches of the exact solution on its mesh.
    fn run_beside_exact(&mut self, setting: &Setting) -> Result<(Measured, Vec<[f64; 6]>), Error> {
        let measured = self.run(setting)?;
        let mut exact = setting.clone();
        // Wrenches do not depend on where the shape is multiplied.
        exact.scene.accuracy.multiply = Multiply::Cpu;
        point::set_accuracy(&mut exact.scene, Accuracy::of(Some(Preset::Exact)));
        exact.scene.accuracy.preset = None;
        exact.scene.accuracy.max_contacts = exact.scene.accuracy.max_contacts.max(MOST_CONTACTS);
        let exact = self.run(&exact)?;
        Ok((measured, exact.wrench))
    }

    fn run_anew(&mut self, setting: &Setting) -> Result<Measured, Error> {
        // The first setting is the scene's own: its nodes are where displacements are compared.
        let is_first = self.samples.is_none();
        if let (Some(found), false) = (self.store.find(setting, self.options.timed_s), is_first) {
            self.n_resumed += 1;
            return Ok(found);
        }
        // Preparing is timed once for each part, whatever the cache has.
        let part = setting.part_key();
        let options = PrepareOptions {
            rebuild: !self.prepare_s.contains_key(&part),
            ..self.prepare.clone()
        };
        let mut ready = measure::ready(setting, &options, self.ui)?;
        let prepare_s = ready.prepared.total_seconds();
        let prepare_s = *self.prepare_s.entry(part).or_insert(prepare_s);
        let samples = self
            .samples
            .get_or_insert_with(|| Samples::of(&ready.prepared));
        if let (Some(found), true) = (self.store.find(setting, self.options.timed_s), is_first) {
            self.n_resumed += 1;
            return Ok(found);
        }
        let mut measured = measure::measure(
            &mut ready,
            &setting.scene,
            &self.course,
            samples,
            self.options.timed_s,
        )?;
        measured.prepare_s = prepare_s;
        self.store.keep(setting, self.options.timed_s, &measured)?;
        Ok(measured)
    }

    /// The most accurate run that can be prepared in [`REFERENCE_S`], and how wrong it may be.
    fn overkill(&mut self, scene: &Scene, scales: &Scales) -> Result<Reference, Error> {
        let exact = |order: u8, refinements: u8| {
            let mut setting = point::base(scene, None);
            setting.scene.accuracy.multiply = Multiply::Cpu;
            point::set_accuracy(&mut setting.scene, Accuracy::of(Some(Preset::Exact)));
            setting.scene.accuracy.preset = None;
            point::set_order(&mut setting.scene, order);
            setting.refinements = refinements;
            setting
        };
        // Each beside a coarser one, whose difference bounds its error.
        let ladder = [
            ((3, 1), (2, 1), "each element in eight at order 3"),
            ((2, 1), (2, 0), "each element in eight at order 2"),
            ((3, 0), (2, 0), "the scene's mesh at order 3"),
        ];
        let limit_s = match self.options.timed_s {
            Some(_) => QUICK_REFERENCE_S,
            None => REFERENCE_S,
        };
        for (best, coarser, made) in ladder {
            let setting = exact(best.0, best.1);
            if self.store.find(&setting, self.options.timed_s).is_none()
                && !can_be_prepared(&setting, limit_s)?
            {
                continue;
            }
            self.ui.status(&format!("reference: {made}"));
            let (Ok(fine), Ok(coarse)) =
                (self.run(&setting), self.run(&exact(coarser.0, coarser.1)))
            else {
                if interrupt::is_requested() {
                    return Err(Error::Interrupted);
                }
                continue;
            };
            return Ok(Reference {
                made: format!(
                    "{made} ({} nodes), planes converged, LCP to 1e-13",
                    fine.nodes
                ),
                bar: Some(distance(&coarse.wrench, &fine.wrench, scales)),
                bar_made: format!(
                    "difference from {} nodes at order {}, which Richardson's rule takes for the \
                     error at first order and for more than it above",
                    coarse.nodes, coarse.order
                ),
                wrench: fine.wrench,
                potential: fine.potential,
                displacement: fine.displacement,
            });
        }
        let own = self.run(&self.base(scene))?;
        Ok(Reference {
            made: "the scene's own setting: nothing finer could be prepared".to_owned(),
            bar: None,
            bar_made: "not known: errors are differences within the scene's mesh".to_owned(),
            wrench: own.wrench,
            potential: own.potential,
            displacement: own.displacement,
        })
    }
}

/// Whether the forecast of preparing is within time and memory.
fn can_be_prepared(setting: &Setting, limit_s: f64) -> Result<bool, Error> {
    let mut spec = setup::part_spec(&setting.scene)?;
    spec.refinements = setting.refinements;
    let Ok(loaded) = load(&spec) else {
        return Ok(false);
    };
    let forecast = Forecast::of(&loaded);
    Ok(forecast.seconds < limit_s && forecast.refuse_what_cannot_fit(&loaded).is_ok())
}

/// A folder that results may be written into: new, empty, or of an earlier study, finished or not. Files of the user in
/// it stay.
///
/// # Errors
/// A file, or a folder that holds something else.
pub fn check_folder(out: &Path) -> Result<(), Error> {
    let refuse = |what: &str| {
        Err(Error::Input(format!(
            "{}: {what}; name another folder with --out",
            out.display()
        )))
    };
    if out.is_file() {
        return refuse("is a file, not a folder");
    }
    let Ok(mut entries) = std::fs::read_dir(out) else {
        return Ok(());
    };
    let points = out.join("points");
    let is_begun = || {
        let mut all = std::fs::read_dir(out).into_iter().flatten().flatten();
        points.is_dir()
            && std::fs::read_dir(&points).is_ok_and(|mut p| p.next().is_none())
            && all.all(|entry| entry.file_name() == "points")
    };
    let is_ours = || !store::points_in(&points).is_empty() || page::is_written_in(out);
    if entries.next().is_some() && !is_ours() && !is_begun() {
        return refuse("holds files that are no result of `snapin accuracy`, so it is left alone");
    }
    Ok(())
}
