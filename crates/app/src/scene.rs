//! The scene: what a TOML file says about a part, a tool and a hand, checked and in SI units.
//!
//! The data's way: text → keys as written (every one with its place in the file) →
//! [`Scene`], in which nothing has to be checked again. Each section is one file, with its keys as
//! written and as they mean. What is wrong is a [`SceneError`] with
//! file, line, key and mend. The keys are listed in `docs/scene.md`, which [`schema`] writes.
//!
//! ```no_run
//! let scene = snapin::scene::Scene::load("scenes/clip.toml".as_ref())?;
//! assert_eq!(scene.part.material.young_modulus, 2.7e9); // Pa
//! # Ok::<(), snapin::scene::SceneError>(())
//! ```

mod accuracy;
mod check;
mod coupling;
mod device;
mod drive;
mod effects;
mod error;
mod friction;
mod hand;
pub mod handbook;
mod holds;
mod keys;
mod limits;
mod material;
mod output;
mod part;
mod reader;
pub mod schema;
#[cfg(test)]
mod tests;
mod tool;
mod units;

use std::path::{Path, PathBuf};

use glam::DVec3;
use schemars::JsonSchema;
use serde::Deserialize;

pub use accuracy::{
    Accuracy, Adaptive, Columns, ContactAt, ContactIterations, FreeNodes, Multiply, MultiplyScalar,
    Preset, Rates, Scalar, ToolFeatures,
};
use check::Check;
pub use coupling::Coupling;
pub use device::{Device, DeviceModel};
pub use drive::{Drive, Guide};
pub use effects::{EffectChoice, Effects, StaticFriction};
pub use error::SceneError;
pub use hand::Hand;
pub use handbook::Handbook;
pub use holds::Handle;
use keys::At;
pub use limits::{Limits, StrainUse};
pub use material::Material;
pub use output::Output;
pub use part::{Fixed, GroupName, Part, QuadratureRule};
pub use tool::{FieldOf, Start, Tool, ToolShape};
use units::Quantity;
pub use units::Units;

/// A validated scene. Lengths in m, forces in N, times in s, whatever the file's units.
///
/// Two frames: the *part's frame* is the mesh's; the *world* is the part's frame at the start.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// The scene file, as it was named.
    pub path: PathBuf,
    /// The scene file's text.
    pub source: String,
    /// One line for reports; the file's stem if the scene has none.
    pub title: String,
    /// Units of the numbers in the file and in the mesh.
    pub units: Units,
    /// Factor from mesh coordinates to m: 1 or 1e-3.
    pub length_scale: f64,
    /// The deformable part.
    pub part: Part,
    /// The rigid tool.
    pub tool: Tool,
    /// Which of the two is held and moved.
    pub handle: Handle,
    /// Where the held body is held, m, in its own frame; `None`: the centre of its bounding box.
    pub grip: Option<DVec3>,
    /// The way of the held body in the part's own curve.
    pub drive: Drive,
    /// The scripted hand, if one is to feel the part too.
    pub hand: Option<Hand>,
    /// What the part's own curve has to keep.
    pub limits: Limits,
    /// Spring between handle and held body.
    pub coupling: Coupling,
    /// The haptic device.
    pub device: Device,
    /// What accuracy is asked for.
    pub accuracy: Accuracy,
    /// Effects that can be estimated.
    pub effects: Effects,
    /// Which results are written.
    pub output: Output,
    /// Dimensions for the handbook's formula, if the part is a plain cantilever hook.
    pub handbook: Option<Handbook>,
}

impl Scene {
    /// A stiffness (N/m) in the scene's unit, with it, as the scene would have to say it.
    pub(crate) fn stiffness_words(&self, si: f64) -> String {
        self.in_units(Quantity::Stiffness, si)
    }

    /// A mass (kg), likewise.
    pub(crate) fn mass_words(&self, si: f64) -> String {
        self.in_units(Quantity::Mass, si)
    }

    /// A damping (N s/m), likewise.
    pub(crate) fn damping_words(&self, si: f64) -> String {
        self.in_units(Quantity::Damping, si)
    }

    /// A pressure (Pa), likewise.
    pub(crate) fn pressure_words(&self, si: f64) -> String {
        self.in_units(Quantity::Pressure, si)
    }

    /// A rotational stiffness (N m/rad), likewise.
    pub(crate) fn rotational_stiffness_words(&self, si: f64) -> String {
        self.in_units(Quantity::RotationalStiffness, si)
    }

    fn in_units(&self, quantity: Quantity, si: f64) -> String {
        let unit = units::label(self.units, quantity);
        // Nine digits: what a scene says in mm is the same again.
        let value = si / units::to_si(self.units, quantity);
        let value = format!("{value:.8e}").parse().unwrap_or(value);
        let plain = (1e-4..1e7).contains(&f64::abs(value)) || value == 0.0;
        if plain {
            format!("{value} {unit}")
        } else {
            format!("{value:e} {unit}")
        }
    }

    /// Length unit of the file: its name, and m.
    pub fn length_unit(&self) -> (&'static str, f64) {
        match self.units {
            Units::Si => ("m", 1.0),
            Units::MmNMpa => ("mm", 1e-3),
        }
    }

    /// Reads and checks a scene file. Paths in it are relative to its folder.
    ///
    /// # Errors
    /// What cannot be read, is not TOML, or does not make sense, with the line and the mend.
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        let bytes = std::fs::read(path).map_err(|source| SceneError::Read {
            path: path.to_path_buf(),
            source,
        })?;
        Self::from_bytes(bytes, path)
    }

    /// As [`Scene::load`] for bytes that were read before; `path` serves messages and gives the
    /// folder in which the mesh is looked for.
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub fn from_bytes(bytes: Vec<u8>, path: &Path) -> Result<Self, SceneError> {
        let source = error::text_of(bytes, path)?;
        let keys: SceneKeys =
            toml::from_str(&source).map_err(|error| reader::translate(&error, &source, path))?;
        keys.checked(source, path)
    }

    /// The same scene with or without friction, whatever it changes.
    #[must_use]
    pub fn with_friction(&self, is_on: bool) -> Self {
        let mut scene = self.clone();
        scene.effects.friction = if is_on {
            EffectChoice::On
        } else {
            EffectChoice::Off
        };
        scene
    }

    /// The error for a group that the mesh does not have, naming the nearest of `known`.
    pub fn unknown_group<'a>(
        &self,
        group: &GroupName,
        known: impl IntoIterator<Item = &'a str>,
    ) -> SceneError {
        let known: Vec<&str> = known.into_iter().collect();
        SceneError::Value {
            path: self.path.clone(),
            line: group.line,
            what: format!("the mesh has no group `{}`", error::plain(&group.name)),
            mend: error::suggestion(&group.name, &known),
        }
    }
}

/// A part, a tool that is pushed onto it, and the hand that pushes.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "snapin scene")]
struct SceneKeys {
    /// Title for reports and windows.
    #[schemars(extend("x-default" = "the file's name"))]
    title: Option<String>,
    /// Units of every number in the scene and of the mesh's coordinates.
    #[serde(default)]
    units: Units,
    /// The deformable part.
    part: part::PartKeys,
    /// The rigid tool that meets the part. It has its own frame, which `position` and `axis` or
    /// `rotation` place in the part's frame (the mesh's).
    tool: At<tool::ToolKeys>,
    /// Which of the two bodies is held and moved, and where; the other one is fixed in the world.
    #[serde(default)]
    holds: holds::HoldsKeys,
    /// The way of the held body in the part's own curve: driven rigidly, in steps of travel, as by a
    /// testing machine. The verdict comes from this curve. A scene with `[hand]` alone lends its
    /// `direction` and `travel`; a scene without either is refused.
    drive: Option<At<drive::DriveKeys>>,
    /// What the part's own curve has to keep; a run that does not, or of which that is not known, ends with exit code 1. Of a half or quarter model, forces are those of what is meshed.
    limits: Option<limits::LimitsKeys>,
    /// A scripted hand that feels the part besides: its target goes along `direction` at `speed`,
    /// rests, and comes back if told; the handle follows it as a mass on a spring and a damper.
    /// The defaults are an assumption: the orders of magnitude of a firm grip, not measured ones.
    /// Without the section nothing is felt, and there is the part's own curve only.
    hand: Option<At<hand::HandKeys>>,
    /// The spring between the handle and the body that it holds. Soft hides stiff clips; the
    /// measured curve is that of clip and coupling in series.
    #[serde(default)]
    coupling: coupling::CouplingKeys,
    /// The haptic device.
    #[serde(default)]
    device: device::DeviceKeys,
    /// What accuracy costs time, and how much of it is asked for: these keys, or one word for all
    /// of them, `accuracy = "fast"`, `"balanced"` or `"exact"`, or `accuracy = { budget_us = 200 }`.
    /// `snapin accuracy` shows what each choice costs in this scene.
    #[serde(default)]
    accuracy: accuracy::WordOrKeys,
    /// Effects beyond the small-strain, frictionless, quasi-static model. `"off"`: left out on purpose; it is told if it would matter, and the verdict stands without it.
    /// `"auto"`: its size is estimated and told, and friction is simulated if it matters. `"on"`: simulated, which this
    /// version does for friction only.
    #[serde(default)]
    effects: effects::EffectsKeys,
    /// Which results are written.
    #[serde(default)]
    output: output::OutputKeys,
    /// Dimensions of a joint for which there is a formula, for a comparison with the snap-fit
    /// handbooks: force, removal and strain by hand stand beside the computed ones. Leave the
    /// section out for any other part.
    handbook: Option<At<handbook::HandbookKeys>>,
}

impl SceneKeys {
    /// Checks everything and converts it to SI.
    fn checked(self, source: String, path: &Path) -> Result<Scene, SceneError> {
        let check = &Check {
            source: &source,
            path,
            units: self.units,
        };
        let accuracy = self.accuracy.0;
        let tool = &self.tool.value;
        let device = self.device.checked(check)?;
        let (drive, hand) = drive::motion(self.drive.as_ref(), self.hand.as_ref(), &device, check)?;
        let order = accuracy.order(self.part.order, check)?;
        let part = self.part.checked(order, check)?;
        let effects = self
            .effects
            .checked(tool.friction(&part.material, check)?, check)?;
        let handbook = self
            .handbook
            .map(|handbook| handbook.checked(tool, &part.material, check));
        let scene = Scene {
            path: path.to_path_buf(),
            source: String::new(),
            title: self.title.unwrap_or_else(|| {
                path.file_stem()
                    .map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
            }),
            units: self.units,
            length_scale: units::to_si(self.units, Quantity::Length),
            part,
            handbook: handbook.transpose()?,
            tool: tool.checked(self.tool.offset, check)?,
            handle: self.holds.handle,
            grip: self.holds.grip(check)?,
            drive,
            hand,
            limits: match self.limits {
                Some(limits) => limits.checked(check)?,
                None => Limits::default(),
            },
            coupling: self.coupling.checked(check)?,
            accuracy: accuracy.checked(device.servo_period, check)?,
            device,
            effects,
            output: self.output.checked(check)?,
        };
        // The checks borrowed the text for its lines until here.
        Ok(Scene { source, ..scene })
    }
}
