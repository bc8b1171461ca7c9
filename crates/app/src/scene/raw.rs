//! The scene as written: every key with its place in the file, nothing checked but types.
//!
//! The doc comments of the fields here are the text of `docs/scene.md` and of the JSON Schema.
//! `x-quantity` names a row of the unit table; defaults are in SI whatever the file's units.

use std::path::Path;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::{self, Deserialize, Deserializer};

mod accuracy;
mod groups;
mod handbook;
mod words;

use super::error::SceneError;
use super::{DeviceModel, Guide, Handle, QuadratureRule, Start, StrainUse, Units};
pub(super) use accuracy::{
    AccuracyKeys, AccuracyRaw, AdaptiveKeys, AdaptiveRaw, IterationsRaw, MultiplyRaw,
    MultiplyScalarRaw, PresetRaw, RatesRaw, ScalarRaw, ToolFeaturesRaw,
};
pub(super) use groups::{FixedRaw, NamesRaw};
pub(super) use handbook::{HandbookRaw, KindRaw};

/// Values of keys that are not written.
pub(super) mod default {
    pub(crate) const HAND_MASS: f64 = 0.5;
    pub(crate) const HAND_STIFFNESS: f64 = 2000.0;
    pub(crate) const HAND_ROTATIONAL_INERTIA: f64 = 1e-3;
    pub(crate) const HAND_ROTATIONAL_STIFFNESS: f64 = 20.0;
    pub(crate) const COUPLING_TRANSLATIONAL_STIFFNESS: f64 = 1e4;
    pub(crate) const COUPLING_ROTATIONAL_STIFFNESS: f64 = 20.0;
    pub(crate) const SERVO_PERIOD: f64 = 1e-3;
    pub(crate) const MAX_CONTACTS: i64 = 500;
    pub(crate) const MERGE_TOLERANCE: f64 = 0.05;
    pub(crate) const FRAMES: i64 = 6;
    /// Of the travel.
    pub(crate) const DRIVE_STEPS: f64 = 300.0;
}

/// A value and where it stands.
#[derive(Clone, Debug)]
pub(super) struct At<T> {
    pub(super) value: T,
    /// Byte offset in the file.
    pub(super) offset: usize,
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for At<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let spanned = toml::Spanned::<T>::deserialize(deserializer)?;
        Ok(Self {
            offset: spanned.span().start,
            value: spanned.into_inner(),
        })
    }
}

impl<T: JsonSchema> JsonSchema for At<T> {
    fn inline_schema() -> bool {
        T::inline_schema()
    }
    fn schema_name() -> std::borrow::Cow<'static, str> {
        T::schema_name()
    }
    fn schema_id() -> std::borrow::Cow<'static, str> {
        T::schema_id()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        T::json_schema(generator)
    }
}

/// So many numbers and no more: serde's own arrays drop what is too much.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vector<const N: usize>(pub(super) [f64; N]);

impl<'de, const N: usize> Deserialize<'de> for Vector<N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let numbers = Vec::<f64>::deserialize(deserializer)?;
        let expected = format!("{N} numbers");
        let vector = numbers.as_slice().try_into();
        let vector = vector.map_err(|_| de::Error::invalid_length(numbers.len(), &&*expected))?;
        Ok(Self(vector))
    }
}

impl<const N: usize> JsonSchema for Vector<N>
where
    [f64; N]: JsonSchema,
{
    fn inline_schema() -> bool {
        <[f64; N]>::inline_schema()
    }
    fn schema_name() -> std::borrow::Cow<'static, str> {
        <[f64; N]>::schema_name()
    }
    fn schema_id() -> std::borrow::Cow<'static, str> {
        <[f64; N]>::schema_id()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        <[f64; N]>::json_schema(generator)
    }
}

/// A part, a tool that is pushed onto it, and the hand that pushes.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "snapin scene")]
pub(super) struct SceneRaw {
    /// Title for reports and windows.
    #[schemars(extend("x-default" = "the file's name"))]
    pub(super) title: Option<String>,
    /// Units of every number in the scene and of the mesh's coordinates.
    #[serde(default)]
    pub(super) units: Units,
    /// The deformable part.
    pub(super) part: PartRaw,
    /// The rigid tool that meets the part. It has its own frame, which `position` and `axis` or
    /// `rotation` place in the part's frame (the mesh's).
    pub(super) tool: At<ToolRaw>,
    /// Which of the two bodies is held and moved, and where; the other one is fixed in the world.
    #[serde(default)]
    pub(super) holds: HoldsRaw,
    /// The way of the held body in the part's own curve: driven rigidly, in steps of travel, as by a
    /// testing machine. The verdict comes from this curve. A scene with `[hand]` alone lends its
    /// `direction` and `travel`; a scene without either is refused.
    pub(super) drive: Option<At<DriveRaw>>,
    /// What the part's own curve has to keep; a run that does not, or of which that is not known, ends with exit code 1. Of a half or quarter model, forces are those of what is meshed.
    pub(super) limits: Option<LimitsRaw>,
    /// A scripted hand that feels the part besides: its target goes along `direction` at `speed`,
    /// rests, and comes back if told; the handle follows it as a mass on a spring and a damper.
    /// The defaults are an assumption: the orders of magnitude of a firm grip, not measured ones.
    /// Without the section nothing is felt, and there is the part's own curve only.
    pub(super) hand: Option<At<HandRaw>>,
    /// The spring between the handle and the body that it holds. Soft hides stiff clips; the
    /// measured curve is that of clip and coupling in series.
    #[serde(default)]
    pub(super) coupling: CouplingRaw,
    /// The haptic device.
    #[serde(default)]
    pub(super) device: DeviceRaw,
    /// What accuracy costs time, and how much of it is asked for: these keys, or one word for all
    /// of them, `accuracy = "fast"`, `"balanced"` or `"exact"`, or `accuracy = { budget_us = 200 }`.
    /// `snapin accuracy` shows what each choice costs in this scene.
    #[serde(default)]
    pub(super) accuracy: AccuracyRaw,
    /// Effects beyond the small-strain, frictionless, quasi-static model. `"off"`: left out on purpose; it is told if it would matter, and the verdict stands without it.
    /// `"auto"`: its size is estimated and told. `"on"`: simulated, which this version cannot.
    #[serde(default)]
    pub(super) effects: EffectsRaw,
    /// Which results are written.
    #[serde(default)]
    pub(super) output: OutputRaw,
    /// Dimensions of a joint for which there is a formula, for a comparison with the snap-fit
    /// handbooks: force, removal and strain by hand stand beside the computed ones. Leave the
    /// section out for any other part.
    pub(super) handbook: Option<At<HandbookRaw>>,
}

#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct PartRaw {
    /// Gmsh mesh (`.msh`, version 2 or 4, text or binary, whole or partitioned) of tetrahedra, relative to the scene
    /// file. The volume must be in a physical group, or Gmsh does not save its elements.
    pub(super) mesh: At<String>,
    /// Order of the elements, 1, 2 or 3. Another one than the mesh's own raises or lowers it; new
    /// nodes lie on the mesh's curved edges and faces. The same as `accuracy.order`.
    #[schemars(range(min = 1, max = 3), extend("x-default" = "the mesh's own"))]
    pub(super) order: Option<At<i64>>,
    /// Order of the elements inside the part, 1 to 5, a multiple of `order`: what bends is then solved for more exactly,
    /// while contact, steps and pictures keep the nodes of `order`. Costs time when the part is prepared, none in a step. With
    /// quadratic elements 4 takes the clip's bending error from 9 to below 1 %; `snapin accuracy` shows it as an axis. Not with
    /// `accuracy.adaptive`'s method `"constrain"`.
    #[schemars(range(min = 1, max = 5), extend("x-default" = "the same as `order`"))]
    pub(super) interior_order: Option<At<i64>>,
    /// Other meshes of the same part with the same groups, coarser or finer, relative to the scene
    /// file: an axis of `snapin accuracy`, which is the only command that reads them.
    #[serde(default)]
    #[schemars(extend("x-default" = "none"))]
    pub(super) other_meshes: Vec<String>,
    /// Material of the part; may be its own section `[part.material]`.
    pub(super) material: MaterialRaw,
    /// What is held: the name of a physical group of the mesh (of volumes, surfaces, curves or points), or a list of
    /// names and of tables with `group` and `components`, such as `{ group = "symmetry", components = ["x"] }`.
    pub(super) fixed: At<FixedRaw>,
    /// What can touch the tool: the name of a physical group, or a list of names.
    pub(super) contact: At<NamesRaw>,
    /// Rule for the element integrals.
    #[serde(default)]
    pub(super) quadrature: QuadratureRule,
}

#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct MaterialRaw {
    /// Name for reports.
    pub(super) name: Option<String>,
    /// Young's modulus, above 0.
    #[schemars(extend("x-quantity" = "pressure"))]
    pub(super) young_modulus: At<f64>,
    /// Poisson's ratio, above -1 and below 0.5; for rubber-like parts 0.49 with order = 3 (elements lock nearer to 0.5 and at lower order).
    #[schemars(extend("x-quantity" = "number"))]
    pub(super) poisson_ratio: At<f64>,
    /// Density, above 0; needed for the size of gravity and of the part's inertia.
    #[schemars(extend("x-quantity" = "density"))]
    pub(super) density: Option<At<f64>>,
    /// Largest strain that the material bears once, such as 0.02; the report compares with it.
    #[schemars(extend("x-quantity" = "number"))]
    pub(super) permissible_strain: Option<At<f64>>,
}

/// Shape of the tool.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(super) enum ShapeRaw {
    /// about local z.
    Cylinder,
    /// about the origin.
    Sphere,
    /// about the origin.
    Box,
    /// a tube about local z with round ends.
    Capsule,
    /// all below local z = 0.
    HalfSpace,
    /// a closed surface from a file.
    Mesh,
}

#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ToolRaw {
    /// Shape; a key that does not belong to it is an error.
    pub(super) shape: ShapeRaw,
    /// Radius of a cylinder, sphere or capsule, above 0.
    #[schemars(extend("x-quantity" = "length", "x-default" = "by shape"))]
    pub(super) radius: Option<At<f64>>,
    /// Half of a cylinder's length, or half of the distance between the centres of a capsule's
    /// round ends, above 0. A cylinder without it is infinite.
    #[schemars(extend("x-quantity" = "length", "x-default" = "by shape"))]
    pub(super) half_length: Option<At<f64>>,
    /// Half of each edge of a box, along local x, y, z, above 0.
    #[schemars(extend("x-quantity" = "length", "x-default" = "by shape"))]
    pub(super) half_extents: Option<At<Vector<3>>>,
    /// STL (text or binary, all its solids) or OBJ file of a closed mesh, relative to the scene file. Corners that
    /// round-off holds apart, by up to 1e-6 of the size, are joined where that closes it; triangles the wrong way are
    /// turned; polygons may be concave. What was changed is told.
    #[schemars(extend("x-default" = "by shape"))]
    pub(super) file: Option<At<String>>,
    /// Factor from the coordinates of `file` to the scene's length unit, above 0.
    #[schemars(extend("x-quantity" = "number", "default" = 1.0))]
    pub(super) scale: Option<At<f64>>,
    /// Distances to a mesh are interpolated from a field that is computed at load, wrong by no more than this, above
    /// 0. For meshes of very many triangles; without it the mesh itself is asked.
    #[schemars(extend("x-quantity" = "length", "x-default" = "no field"))]
    pub(super) field_error: Option<At<f64>>,
    /// Where the tool's origin starts, in the part's frame.
    #[schemars(extend("x-quantity" = "length"))]
    pub(super) position: At<Vector<3>>,
    /// Where the tool's local +z points, in the part's frame; any length but 0. The shortest turn
    /// from +z leads there.
    #[schemars(extend("x-quantity" = "number", "default" = [0.0, 0.0, 1.0]))]
    pub(super) axis: Option<At<Vector<3>>>,
    /// The tool's rotation as a quaternion x, y, z, w, instead of `axis`; any length but 0.
    #[schemars(extend("x-quantity" = "number", "x-default" = "by `axis`"))]
    pub(super) rotation: Option<At<Vector<4>>>,
    /// How the tool stands to the part before the first step.
    #[serde(default)]
    pub(super) start: Start,
}

#[derive(Debug, Default, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct HoldsRaw {
    /// The body that is moved.
    pub(super) handle: Handle,
    /// Where it is held, in its own frame (that of the mesh, or of the tool): the hand's springs and those of the
    /// coupling turn it about this point. The origin of its file does not matter.
    #[schemars(extend("x-quantity" = "length", "x-default" = "centre of its bounding box"))]
    pub(super) grip: Option<At<Vector<3>>>,
}

#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct DriveRaw {
    /// Where the held body goes, in the part's frame at the start; any length but 0.
    #[schemars(extend("x-quantity" = "number", "x-default" = "that of [hand]"))]
    pub(super) direction: Option<At<Vector<3>>>,
    /// How far, above 0.
    #[schemars(extend("x-quantity" = "length", "x-default" = "that of [hand]"))]
    pub(super) travel: Option<At<f64>>,
    /// Way between two places at which the force is solved for, above 0; it is halved up to six times where
    /// the force bends.
    #[schemars(extend("x-quantity" = "length", "x-default" = "travel / 300"))]
    pub(super) step: Option<At<f64>>,
    /// What the body does across `direction`.
    #[serde(default)]
    pub(super) guide: Guide,
    /// Whether it is pulled out again afterwards.
    #[schemars(extend("default" = true))]
    pub(super) retract: Option<bool>,
}

#[derive(Debug, Default, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct LimitsRaw {
    /// The peak force of the way in stays below this, above 0.
    #[schemars(extend("x-quantity" = "force"))]
    pub(super) insertion_below: Option<At<f64>>,
    /// The largest pull on the way out is above this, above 0.
    #[schemars(extend("x-quantity" = "force"))]
    pub(super) removal_above: Option<At<f64>>,
    /// The largest principal strain (0.02 is 2 %) stays below this, above 0.
    #[schemars(extend("x-quantity" = "number"))]
    pub(super) strain_below: Option<At<f64>>,
    /// How often the joint is opened and closed.
    pub(super) strain_use: StrainUse,
}

#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct HandRaw {
    /// Where the held body goes, in the part's frame at the start; any length but 0.
    #[schemars(extend("x-quantity" = "number", "x-default" = "that of [drive]"))]
    pub(super) direction: Option<At<Vector<3>>>,
    /// Speed of the target, above 0.
    #[schemars(extend("x-quantity" = "speed"))]
    pub(super) speed: At<f64>,
    /// Way of the target, above 0.
    #[schemars(extend("x-quantity" = "length", "x-default" = "that of [drive]"))]
    pub(super) travel: Option<At<f64>>,
    /// Rest at full travel.
    #[schemars(extend("x-quantity" = "time", "default" = 0.0))]
    pub(super) hold: Option<At<f64>>,
    /// Whether the hand pulls back to the start afterwards.
    #[serde(default)]
    pub(super) retract: bool,
    /// Mass of handle and hand, above 0.
    #[schemars(extend("x-quantity" = "mass", "default" = default::HAND_MASS))]
    pub(super) mass: Option<At<f64>>,
    /// Stiffness of the grip, above 0. A grip stiffer than the clip's falling branch traces the
    /// whole force-travel curve; a softer one jumps, which is the snap that a hand feels.
    #[schemars(extend("x-quantity" = "stiffness", "default" = default::HAND_STIFFNESS))]
    pub(super) stiffness: Option<At<f64>>,
    /// Damping of the grip. The default is critical, 2 sqrt(mass stiffness), to two digits.
    #[schemars(extend("x-quantity" = "damping", "x-default" = "critical"))]
    pub(super) damping: Option<At<f64>>,
    /// Moment of inertia of handle and hand, the same about all axes, above 0.
    #[schemars(extend(
        "x-quantity" = "rotational_inertia",
        "default" = default::HAND_ROTATIONAL_INERTIA
    ))]
    pub(super) rotational_inertia: Option<At<f64>>,
    /// Stiffness of the wrist, above 0.
    #[schemars(extend(
        "x-quantity" = "rotational_stiffness",
        "default" = default::HAND_ROTATIONAL_STIFFNESS
    ))]
    pub(super) rotational_stiffness: Option<At<f64>>,
    /// Damping of the wrist. The default is critical, as for the grip.
    #[schemars(extend("x-quantity" = "rotational_damping", "x-default" = "critical"))]
    pub(super) rotational_damping: Option<At<f64>>,
}

#[derive(Debug, Default, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct CouplingRaw {
    /// Stiffness against shifts, above 0.
    #[schemars(extend(
        "x-quantity" = "stiffness",
        "default" = default::COUPLING_TRANSLATIONAL_STIFFNESS
    ))]
    pub(super) translational_stiffness: Option<At<f64>>,
    /// Stiffness against turns, above 0.
    #[schemars(extend(
        "x-quantity" = "rotational_stiffness",
        "default" = default::COUPLING_ROTATIONAL_STIFFNESS
    ))]
    pub(super) rotational_stiffness: Option<At<f64>>,
}

#[derive(Debug, Default, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct DeviceRaw {
    /// Which device.
    pub(super) model: DeviceModel,
    /// Time between two forces sent to the device, 1e-5 s to 0.1 s.
    #[schemars(extend("x-quantity" = "time", "default" = default::SERVO_PERIOD))]
    pub(super) servo_period: Option<At<f64>>,
    /// Whether each step waits for its moment on the clock; else steps follow each other at once.
    pub(super) real_time: bool,
}

/// How an effect is to be treated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(super) enum EffectRaw {
    Off,
    Auto,
    On,
}

#[derive(Debug, Default, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct EffectsRaw {
    /// Coulomb friction between part and tool.
    #[schemars(extend("default" = "auto"))]
    pub(super) friction: Option<At<EffectRaw>>,
    /// Rotation of the part's arms beyond linear elasticity.
    #[schemars(extend("default" = "auto"))]
    pub(super) large_rotation: Option<At<EffectRaw>>,
    /// Weight of the part.
    #[schemars(extend("default" = "auto"))]
    pub(super) gravity: Option<At<EffectRaw>>,
    /// Mass of the tool.
    #[schemars(extend("default" = "auto"))]
    pub(super) tool_inertia: Option<At<EffectRaw>>,
    /// Mass of the part.
    #[schemars(extend("default" = "auto"))]
    pub(super) part_inertia: Option<At<EffectRaw>>,
    /// Damping of the part.
    #[schemars(extend("default" = "auto"))]
    pub(super) damping: Option<At<EffectRaw>>,
    /// Tool motion within one step.
    #[schemars(extend("default" = "auto"))]
    pub(super) continuous_collision: Option<At<EffectRaw>>,
    /// Elasticity of the tool.
    #[schemars(extend("default" = "auto"))]
    pub(super) deformable_tool: Option<At<EffectRaw>>,
    /// Coulomb's coefficient of part on tool, for the size of friction, at least 0.
    #[schemars(extend("x-quantity" = "number"))]
    pub(super) friction_coefficient: Option<At<f64>>,
}

#[derive(Debug, Default, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct OutputRaw {
    /// Moments of which pictures and shapes are kept, 0 to 1000.
    #[schemars(range(min = 0, max = 1000), extend("default" = default::FRAMES))]
    pub(super) frames: Option<At<i64>>,
    /// From where the pictures are taken: direction from the part to the eye, in the part's frame; any length but 0. Without it
    /// the view that shows most of the contact is chosen, and where no view shows it part and tool are drawn cut open.
    #[schemars(extend("x-quantity" = "number", "x-default" = "where contact is seen best"))]
    pub(super) camera: Option<At<Vector<3>>>,
    /// Write a PNG of each frame.
    #[schemars(extend("default" = true))]
    pub(super) pictures: Option<bool>,
    /// Write the deformed shape of each frame as VTU, for ParaView.
    #[schemars(extend("default" = true))]
    pub(super) vtu: Option<bool>,
    /// Write the session as MCAP, for replay and for Foxglove.
    #[schemars(extend("default" = true))]
    pub(super) mcap: Option<bool>,
}

/// Reads the text; what does not fit the keys above is an error with its line.
pub(super) fn parse(source: &str, path: &Path) -> Result<SceneRaw, SceneError> {
    toml::from_str(source).map_err(|error| words::translate(&error, source, path))
}
