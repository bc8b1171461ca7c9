//! What a live session is made of, before its first period.

use contact::tool::Tool;
use device::{Mapping, MappingSettings, ServoSettings};

use super::LiveArgs;
use super::open::{self, Hand};
use crate::Error;
use crate::cli::period_of;
use crate::engine::Engine;
use crate::prepare::{PrepareOptions, PreparedCompliance, PreparedPart, prepare};
use crate::progress::Ui;
use crate::scene::Scene;
use crate::session::live::{self, LiveSpec};
use crate::session::rates::ChosenRates;
use crate::session::{Held, SessionSpec, part_extent};
use crate::shape::Shape;
use crate::study::accuracy::resolved;
use crate::{drive, plausibility, setup};

/// A scene with its part, whatever device comes.
pub(in crate::cli) struct Loaded {
    pub(in crate::cli) scene: Scene,
    pub(in crate::cli) prepared: PreparedPart,
    pub(in crate::cli) session: SessionSpec,
    pub(in crate::cli) tool: Tool,
    pub(in crate::cli) options: PrepareOptions,
}

impl Loaded {
    /// Prepares the part, and sees by the scene's own way whether friction is called for.
    ///
    /// # Errors
    /// What the scene, its mesh or its tool are refused for; Ctrl-C.
    pub(in crate::cli) fn new(args: &LiveArgs, scene: Scene, ui: &Ui<'_>) -> Result<Self, Error> {
        let options = args.cache.options(false)?;
        let (scene, picked) = resolved(scene, &options, ui)?;
        let (tool, remarks) = setup::tool(&scene)?;
        let notes = remarks.iter().chain(&picked);
        notes.for_each(|line| ui.note(line));
        let prepared = prepare(&setup::part_spec(&scene)?, &options, ui)?;
        plausibility::tell(&plausibility::before(&scene, &prepared, &tool), ui);
        let progress = ui.progress();
        let has_friction = drive::calls_for_friction(&scene, &prepared, tool.clone(), &progress)?;
        let scene = scene.with_friction(has_friction);
        let period_s = match args.rate {
            Some(rate) => period_of(rate)?,
            None => period_of_scene(&scene)?,
        };
        let held = setup::held(&scene, &prepared, &tool);
        Ok(Self {
            session: setup::live_session(&scene, held, period_s),
            scene,
            prepared,
            tool,
            options,
        })
    }

    /// The body that the first device does not hold.
    pub(in crate::cli) fn other(&self) -> Held {
        let mesh = &self.prepared.loaded.mesh;
        self.session.held.other(&self.tool, mesh)
    }
}

/// What a scene asks for may be more than a live loop can keep.
fn period_of_scene(scene: &Scene) -> Result<f64, Error> {
    let period_s = scene.device.servo_period;
    period_of(period_s.recip()).map_err(|_| {
        Error::Input(format!(
            "{}: device.servo_period of {period_s} s is {} forces per second, and a live session has 100 to 10000; give \
             --rate",
            scene.path.display(),
            period_s.recip()
        ))
    })
}

/// All of it.
pub(in crate::cli) struct Ready {
    pub(in crate::cli) scene: Scene,
    /// The virtual coupling, and why it is so stiff.
    pub(in crate::cli) coupling: String,
    pub(in crate::cli) engine: Engine,
    pub(in crate::cli) rates: ChosenRates,
    pub(in crate::cli) spec: LiveSpec,
    /// What fetches columns of the compliance ahead of the tool, where they are fetched.
    pub(in crate::cli) shape: Option<Shape>,
    /// The body of a second device.
    pub(in crate::cli) other: Held,
}

impl Ready {
    /// # Errors
    /// A tool that overlaps the part; settings that are refused.
    pub(in crate::cli) fn new(
        args: &LiveArgs,
        loaded: Loaded,
        first: &Hand,
    ) -> Result<Self, Error> {
        let limits = first.limits(args.max_force)?;
        let other = loaded.other();
        if setup::live_rail(&loaded.scene).is_some() && args.second_device.is_some() {
            return Err(Error::Input(format!(
                "{}: the part is cut at a plane of symmetry, so the tool stays on its axis and one hand moves it: leave \
                 --second-device out",
                loaded.scene.path.display()
            )));
        }
        let Loaded {
            scene,
            prepared,
            session,
            tool,
            options,
        } = loaded;
        let (scene, coupling) = open::coupled(scene, &limits, session.period_s)?;
        let mut engine = setup::live_engine(&scene, &prepared, tool)?;
        let rates = live::rates(&session, &prepared, &mut engine)?;
        let shape = match &prepared.compliance {
            PreparedCompliance::All(_) => None,
            PreparedCompliance::Near(_) => {
                let folder = options.cache_dir.as_deref();
                let mut shape = Shape::new(&prepared, &scene.accuracy, folder)?;
                shape.follow(&engine, true);
                Some(shape)
            }
        };
        let mut spec = LiveSpec {
            n_periods: first.n_periods(session.period_s),
            seconds: checked_seconds(args.seconds)?,
            mapping: first.mapping(args.axes, args.scale, session.held)?,
            clutch: args.clutch.map_or(0, |button| 1 << (button - 1)),
            slips: first.is_rate,
            rail: setup::live_rail(&scene),
            largest_force: live::largest_force(&session, &mut engine),
            stiffness: scene.coupling.translational_stiffness,
            lever: part_extent(&prepared.loaded.mesh),
            servo: ServoSettings::live(&limits)?,
            session,
        };
        if first.is_in_world {
            // A scripted hand cannot be hurt, and does not wait.
            spec.servo.safety.arming = None;
        }
        if first.is_rate {
            // What a motor shakes does no work on the hand.
            spec.servo.safety.passivity = None;
        }
        Ok(Self {
            scene,
            coupling,
            engine,
            rates,
            spec,
            shape,
            other,
        })
    }
}

impl Hand {
    /// From its frame to the world; `None` where its frame is the world.
    ///
    /// # Errors
    /// A scale that is none.
    pub(in crate::cli) fn mapping(
        &self,
        axes: open::Axes,
        scale: f64,
        held: Held,
    ) -> Result<Option<Mapping>, Error> {
        let settings = MappingSettings {
            axes: axes.0,
            scale,
            ..MappingSettings::default()
        };
        let mapping = Mapping::new(settings, held.start())?;
        Ok((!self.is_in_world).then_some(mapping))
    }

    /// Periods of its script, which goes by the loop's own time.
    fn n_periods(&self, period_s: f64) -> Option<u64> {
        self.ends_after_s.map(|s| (s / period_s).ceil() as u64)
    }
}

/// As long as the user says, by the clock.
fn checked_seconds(seconds: Option<f64>) -> Result<Option<f64>, Error> {
    /// A hundred years: more is no time a clock can be asked for.
    const MOST: f64 = 3e9;
    match seconds {
        Some(s) if !(s > 0.0 && s < MOST) => {
            Err(Error::Input(format!("--for {s} is no time above 0 s")))
        }
        seconds => Ok(seconds),
    }
}
