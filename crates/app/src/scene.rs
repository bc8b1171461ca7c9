//! The scene: what a TOML file says about a part, a tool and a hand, checked and in SI units.
//!
//! The data's way: text → keys as written (every one with its place in the file) →
//! [`Scene`], in which nothing has to be checked again. What is wrong is a [`SceneError`] with
//! file, line, key and mend. The keys are listed in `docs/scene.md`, which [`schema`] writes.
//!
//! ```no_run
//! let scene = snapin::scene::Scene::load("scenes/clip.toml".as_ref())?;
//! assert_eq!(scene.part.material.young_modulus, 2.7e9); // Pa
//! # Ok::<(), snapin::scene::SceneError>(())
//! ```

mod accuracy;
mod error;
pub mod handbook;
mod raw;
pub mod schema;
#[cfg(test)]
mod tests;
mod units;
mod validate;

use std::path::{Path, PathBuf};

use glam::DVec3;
use glamx::DPose3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use accuracy::{
    Accuracy, Adaptive, Columns, ContactIterations, FreeNodes, Multiply, MultiplyScalar, Preset,
    Rates, Scalar, ToolFeatures,
};
pub use error::SceneError;
pub use handbook::Handbook;
use units::Quantity;

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
        let raw = raw::parse(&source, path)?;
        validate::scene(raw, source, path)
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

/// Units of the scene file and of its mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Units {
    /// m, N, s, Pa, kg.
    #[default]
    #[serde(rename = "SI")]
    Si,
    /// mm, N, s, MPa, t (tonne).
    #[serde(rename = "mm-N-MPa")]
    MmNMpa,
}

/// The deformable part.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Gmsh mesh; exists.
    pub mesh: PathBuf,
    /// Line of `mesh` in the scene file, for messages.
    pub mesh_line: usize,
    /// Other meshes of the same part, for the accuracy study; whether they exist is seen there.
    pub other_meshes: Vec<PathBuf>,
    /// Element order that is asked for, 1, 2 or 3; `None`: the mesh's own.
    pub order: Option<u8>,
    /// Order of the elements inside, 1 to 5; `None`: that of the surface.
    pub interior_order: Option<u8>,
    /// Linear elasticity and limits.
    pub material: Material,
    /// Held groups; never empty.
    pub fixed: Vec<Fixed>,
    /// Groups whose nodes can touch the tool; never empty.
    pub contact: Vec<GroupName>,
    /// Rule for the element integrals.
    pub quadrature: QuadratureRule,
}

/// A mesh group by name, with the line that names it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GroupName {
    /// Name of the physical group.
    pub name: String,
    /// Line in the scene file.
    pub line: usize,
}

/// A held group.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fixed {
    /// The group.
    pub group: GroupName,
    /// Which of x, y, z are held; at least one.
    pub components: [bool; 3],
}

/// Material of the part.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// For reports.
    pub name: Option<String>,
    /// Pa, > 0.
    pub young_modulus: f64,
    /// In (-1, 0.5).
    pub poisson_ratio: f64,
    /// kg/m³, > 0.
    pub density: Option<f64>,
    /// Largest strain that the material bears once, > 0 (0.02 is 2 %).
    pub permissible_strain: Option<f64>,
}

/// Rule for the element integrals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum QuadratureRule {
    /// exact for straight elements only (4 points for quadratic ones).
    Fast,
    /// more points, so that curved elements are integrated to rounding too.
    #[default]
    Converged,
}

/// The rigid tool.
#[derive(Clone, Debug, PartialEq)]
pub struct Tool {
    /// In the tool's own frame.
    pub shape: ToolShape,
    /// Where the tool starts: its frame in the part's.
    pub pose_part_tool: DPose3,
    /// Whether it may start in the part.
    pub start: Start,
}

/// How the tool stands to the part before the first step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Start {
    /// clear of the part or in touch with it; a tool inside the part is refused with the depth.
    #[default]
    Clear,
    /// it may be inside the part, as after a press fit: the first step pushes the part out of it.
    Overlap,
}

/// Shape of the tool in its own frame. Lengths in m, all > 0.
#[derive(Clone, Debug, PartialEq)]
pub enum ToolShape {
    /// About the origin.
    Sphere {
        /// Radius.
        radius: f64,
    },
    /// About local z.
    Cylinder {
        /// Radius.
        radius: f64,
        /// Half of its length along z; `None`: infinite.
        half_length: Option<f64>,
    },
    /// About the origin.
    Box {
        /// Half of each edge along x, y, z.
        half_extents: DVec3,
    },
    /// About local z.
    Capsule {
        /// Radius of the tube and of its two ends.
        radius: f64,
        /// Half of the distance between the centres of the two ends.
        half_length: f64,
    },
    /// All with local z < 0; its outward normal is +z.
    HalfSpace,
    /// Closed surface from an STL or OBJ file; exists.
    Mesh {
        /// The file.
        file: PathBuf,
        /// Line of `file` in the scene file, for messages.
        line: usize,
        /// Factor from the file's coordinates to m.
        scale: f64,
        /// Distance field to be computed at load.
        field: Option<FieldOf>,
    },
}

/// A distance field that a scene asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldOf {
    /// Bound on the error of its distances, m.
    pub error: f64,
    /// Line in the scene file, for messages.
    pub line: usize,
}

/// What is held and moved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Handle {
    /// the tool moves, the part is fixed in the world.
    #[default]
    Tool,
    /// the part moves, the tool is fixed in the world.
    Part,
}

/// The way that the held body is driven, rigidly, as by a testing machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive {
    /// Unit vector in the world: where the held body goes.
    pub direction: DVec3,
    /// m, > 0.
    pub travel: f64,
    /// m between two places, > 0, at most `travel`; finer where the force bends.
    pub step: f64,
    /// What the body does across the direction.
    pub guide: Guide,
    /// Whether it is pulled out again.
    pub retract: bool,
}

/// What the driven body does across its direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Guide {
    /// it goes along `direction` only and does not turn; models with planes of symmetry need this.
    #[default]
    Axis,
    /// it gives way across `direction` and turns, against the springs of `[coupling]`.
    Free,
}

/// What the part's own curve has to keep; each limit that is not kept fails the run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Limits {
    /// N, the peak of the way in stays below, > 0.
    pub insertion_below: Option<f64>,
    /// N, the largest pull of the way out goes above, > 0.
    pub removal_above: Option<f64>,
    /// The largest principal strain stays below, > 0 (0.02 is 2 %).
    pub strain_below: Option<f64>,
    /// How often the joint is used.
    pub strain_use: StrainUse,
}

/// How often a joint is opened and closed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum StrainUse {
    /// once: `strain_below` as it is.
    #[default]
    Once,
    /// often: 60 % of `strain_below`.
    Repeatedly,
}

/// The scripted hand: a mass on a spring and a damper, whose other end follows the script.
#[derive(Clone, Debug, PartialEq)]
pub struct Hand {
    /// Unit vector in the world: where the held body goes.
    pub direction: DVec3,
    /// m/s, > 0.
    pub speed: f64,
    /// m, > 0.
    pub travel: f64,
    /// Rest at full travel, s, >= 0.
    pub hold: f64,
    /// Whether the hand pulls back to the start afterwards.
    pub retract: bool,
    /// kg, > 0.
    pub mass: f64,
    /// N/m, > 0.
    pub stiffness: f64,
    /// N s/m, >= 0.
    pub damping: f64,
    /// kg m², > 0.
    pub rotational_inertia: f64,
    /// N m/rad, > 0.
    pub rotational_stiffness: f64,
    /// N m s/rad, >= 0.
    pub rotational_damping: f64,
}

impl Hand {
    /// Time of the whole script, s.
    pub fn duration(&self) -> f64 {
        let way = self.travel / self.speed;
        way + self.hold + if self.retract { way } else { 0.0 }
    }
}

/// Virtual coupling between handle and held body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coupling {
    /// N/m, > 0.
    pub translational_stiffness: f64,
    /// N m/rad, > 0.
    pub rotational_stiffness: f64,
}

/// The haptic device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Device {
    /// Which one.
    pub model: DeviceModel,
    /// s, in [1e-5, 0.1].
    pub servo_period: f64,
    /// Whether steps wait for the clock; else they follow each other.
    pub real_time: bool,
}

/// Known devices.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum DeviceModel {
    /// simulated, with the force and torque limits of a Virtuose 6D.
    #[default]
    #[serde(rename = "virtuose-6d")]
    Virtuose6d,
}

/// How each effect is to be treated.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Effects {
    /// Coulomb friction between part and tool.
    pub friction: EffectChoice,
    /// Rotation of the part's arms beyond linear elasticity.
    pub large_rotation: EffectChoice,
    /// Weight of the part.
    pub gravity: EffectChoice,
    /// Mass of the tool.
    pub tool_inertia: EffectChoice,
    /// Mass of the part.
    pub part_inertia: EffectChoice,
    /// Damping of the part.
    pub damping: EffectChoice,
    /// Tool motion within one step.
    pub continuous_collision: EffectChoice,
    /// Elasticity of the tool.
    pub deformable_tool: EffectChoice,
    /// Coulomb's coefficient for the estimates, >= 0.
    pub friction_coefficient: Option<f64>,
}

/// Whether an effect is estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EffectChoice {
    /// Not looked at.
    Off,
    /// Its size is told.
    #[default]
    Auto,
}

/// Which results are written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Output {
    /// Number of moments of which pictures and shapes are kept.
    pub frames: u32,
    /// Unit vector from the part to the eye; `None` to choose it by the contact.
    pub camera: Option<DVec3>,
    /// PNG of each frame.
    pub pictures: bool,
    /// VTU (ParaView) of each frame.
    pub vtu: bool,
    /// Session as MCAP.
    pub mcap: bool,
}
