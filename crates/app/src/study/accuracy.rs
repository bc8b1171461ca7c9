//! `snapin accuracy`: what accuracy costs in time, for each choice that trades one for the other.
//!
//! Every setting is asked the same question: the handle goes along the scene's path, step by step,
//! and the engine answers with wrenches. They are compared with a reference, an overkill run of the
//! program's own or a file, and each step is timed. Finished settings are kept in files, so that an
//! interrupted study goes on where it was.

mod busy;
mod compare;
mod course;
mod law;
mod measure;
mod page;
mod peak;
mod pick;
mod point;
mod reference;
mod store;
mod table;

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

pub use busy::Repeats;
pub use compare::{Errors, Reference};
pub use course::Increment;
pub use law::Law;
pub use measure::{Measured, Times};
pub use page::write;
pub use pick::{Picked, resolved};
pub use point::{Axis, Point, Setting};
pub use table::text;

use crate::choice::name_of;
use crate::machine::Machine;
use crate::prepare::{PrepareOptions, load};
use crate::progress::Ui;
use crate::report::Origin;
use crate::scene::{Multiply, Scene};
use crate::session::part_extent;
use crate::{Error, interrupt, plausibility, setup};
use compare::{Scales, errors};
use course::Course;
use measure::Samples;
use point::Surroundings;
use store::Store;

/// Curves that peak at more than this multiple of the reference would hide the others.
const OFF_SCALE: f64 = 2.0;

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
    /// m between two steps.
    pub increment: f64,
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
    /// The law of contact of all settings, the reference included.
    pub law: Law,
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
    /// A choice that this scene or this machine does not have, with the reason.
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
    let (mut scene, mut law) = law::decided(scene, prepare, ui)?;
    scene.accuracy.budget_us = None;
    let own_order = store::own_order(&scene)?;
    scene.part.order.get_or_insert(own_order);
    point::multiply_written(&mut scene);
    let scene = &scene;
    let (adapter, not_there) = choices(scene, &options.axes);
    let identity = store::identity(scene)?;
    let course = Course::of(scene);
    law.tell_increments(&course);
    let n_places = course.n_places();
    let reference_file = options.reference.as_ref();
    let reference_file = reference_file
        .map(|file| store::read_reference(file, scene, &identity, n_places))
        .transpose()?;
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
    let loaded = load(&setup::part_spec(scene)?)?;
    plausibility::tell(&plausibility::of_part(scene, &loaded), ui);
    let scales = Scales::of(scene, part_extent(&loaded.mesh));
    runner.run(&runner.base(scene))?;
    let reference = match reference_file {
        Some(reference) => reference,
        None => runner.overkill(scene, &scales)?,
    };
    if let Some(file) = &options.save_reference {
        store::save_reference(file, scene, &identity, &reference)?;
    }
    let rows = runner.rows(scene, &reference, &scales)?;
    let (curves, off_scale) = curves(&rows, &reference, &scales);
    let machine = Machine::read();
    let peak = scales.peak(&reference.wrench);
    Ok(Study {
        title: scene.title.clone(),
        scene_path: scene.path.display().to_string(),
        own: scene.accuracy.words(),
        law,
        machine: machine.summary(),
        origin: crate::origin::read(scene, None)?,
        peak: (peak.force, scales.travel_at(peak.at, n_places)),
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

/// Name of the graphics adapter that multiplies in some settings, and the choices that are asked for and not there.
fn choices(scene: &Scene, axes: &[Axis]) -> (Option<String>, Vec<(&'static str, String)>) {
    // Drivers are asked only if a setting may need them.
    let asks_gpu = axes.contains(&Axis::Scalar) || scene.accuracy.multiply == Multiply::Gpu;
    let adapters = asks_gpu.then(gpu::Adapters::find);
    let best = adapters.as_ref().and_then(|found| found.best(true).ok());
    let adapter = best.map(name_of);
    let mut not_there = Vec::new();
    if let (Some(found), None) = (&adapters, &adapter) {
        not_there.push(("multiply on the GPU", found.to_string()));
    }
    let reasons = axes.iter().filter_map(|&axis| {
        let why = point::reason_for_none(axis, scene)?;
        Some((axis.title(), why.to_owned()))
    });
    not_there.extend(reasons);
    (adapter, not_there)
}

/// Force (N) over travel (m) with its name.
type Curve = (String, Vec<(f64, f64)>);

/// Curves of the reference, the orders and the meshes, and those that are too large to be shown, with their peaks (N).
fn curves(
    rows: &[Row],
    reference: &Reference,
    scales: &Scales,
) -> (Vec<Curve>, Vec<(String, f64)>) {
    let curve = |wrenches: &[[f64; 6]]| -> Vec<(f64, f64)> {
        let n = wrenches.len();
        let at = |(k, w)| (scales.travel_at(k, n), scales.resistance(w));
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
    (curves, off_scale)
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

    /// All settings that are asked for, each compared.
    fn rows(
        &mut self,
        scene: &Scene,
        reference: &Reference,
        scales: &Scales,
    ) -> Result<Vec<Row>, Error> {
        let own = self.base(scene).key();
        let around = Surroundings {
            own_order: store::own_order(scene)?,
            extent: scales.lever,
            adapter: self.adapter.as_deref(),
            course: &self.course,
        };
        let points = point::points(scene, &self.options.axes, &around);
        let mut rows = Vec::with_capacity(points.len());
        let begun = Instant::now();
        for (k, point) in points.iter().enumerate() {
            let what = format!("{} {}", point.axis.name(), point.label);
            self.tell(k, points.len(), begun, &what);
            let increment = point.setting.increment;
            let outcome = match self.run_beside_exact(&point.setting) {
                Ok((measured, exact)) => {
                    let places = self.course.places(increment);
                    let errors = errors(&measured, &places, &exact, reference, scales);
                    Ok((measured, errors))
                }
                Err(e) if e.is_interrupt() => return Err(e),
                Err(e) => Err(e.to_string()),
            };
            rows.push(Row {
                axis: point.axis,
                label: point.label.clone(),
                is_own: point.setting.key() == own,
                increment: self.course.length(increment),
                outcome,
            });
        }
        Ok(rows)
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
        let exact = self.run(&reference::exact_on(setting))?;
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
        let timed_s = self.options.timed_s;
        let mut measured = measure::measure(&mut ready, setting, &self.course, samples, timed_s)?;
        measured.prepare_s = prepare_s;
        self.store.keep(setting, self.options.timed_s, &measured)?;
        Ok(measured)
    }
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
