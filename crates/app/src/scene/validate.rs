//! From keys as written to a scene that makes sense, in SI.

mod accuracy;
mod handbook;
mod motion;
mod part;

use std::path::{Path, PathBuf};

use glam::{DQuat, DVec3};
use glamx::DPose3;

use super::error::{SceneError, line_of, plain};
use super::raw::{self, At, EffectRaw, ShapeRaw, Vector, default};
use super::units::{Quantity, to_si};
use super::{
    Coupling, Device, EffectChoice, Effects, FieldOf, Output, Scene, Tool, ToolShape, Units,
};

/// Servo periods in one run: 10 000 s at 1 kHz. More is a slip of the units, and would fill disks.
const MOST_STEPS: f64 = 1e7;

/// Checks everything and converts it to SI.
pub(super) fn scene(raw: raw::SceneRaw, source: String, path: &Path) -> Result<Scene, SceneError> {
    let (check, units) = (
        Check {
            source: &source,
            path,
            units: raw.units,
        },
        raw.units,
    );
    let device = check.device(&raw.device)?;
    let (drive, hand) = check.motion(raw.drive.as_ref(), raw.hand.as_ref(), &device)?;
    let part = check.part(raw.part, &raw.accuracy.0)?;
    let handbook = raw
        .handbook
        .map(|handbook| check.handbook(&handbook, &raw.tool.value, &part.material))
        .transpose()?;
    let scene = Scene {
        title: raw.title.unwrap_or_else(|| {
            path.file_stem()
                .map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
        }),
        units,
        length_scale: to_si(units, Quantity::Length),
        part,
        handbook,
        tool: check.tool(&raw.tool)?,
        handle: raw.holds.handle,
        grip: check.grip(&raw.holds)?,
        drive,
        hand,
        limits: check.limits(raw.limits.as_ref())?,
        coupling: check.coupling(&raw.coupling)?,
        accuracy: check.accuracy(&raw.accuracy.0, device.servo_period)?,
        device,
        effects: check.effects(&raw.effects)?,
        output: check.output(&raw.output)?,
        path: path.to_path_buf(),
        source: String::new(),
    };
    Ok(Scene { source, ..scene })
}

/// What every check needs: the text for lines, the path for messages, the units.
struct Check<'a> {
    source: &'a str,
    path: &'a Path,
    units: Units,
}

/// Which values a number may have, in the file's units, with the words for it.
#[derive(Clone, Copy)]
enum Range {
    Positive,
    NotNegative,
    Any,
}

impl Check<'_> {
    fn error(&self, offset: usize, what: String, mend: impl Into<String>) -> SceneError {
        SceneError::Value {
            path: self.path.to_path_buf(),
            line: line_of(self.source, offset),
            what: plain(&what),
            mend: mend.into(),
        }
    }

    /// A finite number in range, in SI.
    fn number(
        &self,
        key: &str,
        at: &At<f64>,
        quantity: Quantity,
        range: Range,
    ) -> Result<f64, SceneError> {
        let written = at.value;
        let value = written * to_si(self.units, quantity);
        if !written.is_finite() {
            return Err(self.error(at.offset, format!("{key} is {written}"), "write a number"));
        }
        if !value.is_finite() || (value == 0.0 && written != 0.0) {
            let what = format!("{key} {written:e} is beyond what SI numbers can hold");
            return Err(self.error(at.offset, what, "check the units"));
        }
        match range {
            Range::Positive if value <= 0.0 => {
                let what = format!("{key} {written} must be above 0");
                Err(self.error(at.offset, what, "write a positive number"))
            }
            Range::NotNegative if value < 0.0 => {
                let what = format!("{key} {written} must not be negative");
                Err(self.error(at.offset, what, "write 0 or more"))
            }
            _ => Ok(value),
        }
    }

    /// As `number`, or the default, which is in SI.
    fn number_or(
        &self,
        key: &str,
        at: Option<&At<f64>>,
        default: f64,
        quantity: Quantity,
        range: Range,
    ) -> Result<f64, SceneError> {
        at.map_or(Ok(default), |at| self.number(key, at, quantity, range))
    }

    fn vector<const N: usize>(
        &self,
        key: &str,
        at: &At<Vector<N>>,
        quantity: Quantity,
        range: Range,
    ) -> Result<[f64; N], SceneError> {
        let mut values = at.value.0;
        for (value, name) in values.iter_mut().zip(["x", "y", "z", "w"]) {
            let component = At {
                value: *value,
                offset: at.offset,
            };
            *value = self.number(&format!("{key} {name}"), &component, quantity, range)?;
        }
        Ok(values)
    }

    /// Unit vector of a direction.
    fn direction(&self, key: &str, at: &At<Vector<3>>) -> Result<DVec3, SceneError> {
        let written = self.vector(key, at, Quantity::Number, Range::Any)?;
        // First by the largest component, so that the square neither overflows nor vanishes.
        let vector = DVec3::from_array(written);
        (vector / vector.abs().max_element())
            .try_normalize()
            .ok_or_else(|| {
                let what = format!("{key} {written:?} has no direction");
                self.error(
                    at.offset,
                    what,
                    "write where it points, such as [0.0, -1.0, 0.0]",
                )
            })
    }

    /// A whole number from `least` to `most`.
    fn integer(&self, key: &str, at: &At<i64>, least: i64, most: i64) -> Result<i64, SceneError> {
        if (least..=most).contains(&at.value) {
            return Ok(at.value);
        }
        let what = format!("{key} {} is out of range", at.value);
        Err(self.error(at.offset, what, format!("write {least} to {most}")))
    }

    /// A file that is there; `name` is relative to the scene's folder.
    fn file(&self, key: &str, at: &At<String>, mend: &str) -> Result<PathBuf, SceneError> {
        let folder = self.path.parent().unwrap_or(Path::new(""));
        let path = folder.join(&at.value);
        if path.is_file() {
            return Ok(path);
        }
        let found = if path.is_dir() {
            "is a folder"
        } else {
            "does not exist"
        };
        Err(self.error(
            at.offset,
            format!("{key} file {} {found}", path.display()),
            mend,
        ))
    }

    fn tool(&self, at: &At<raw::ToolRaw>) -> Result<Tool, SceneError> {
        let raw = &at.value;
        let (shape, keys): (&str, &[&str]) = match raw.shape {
            ShapeRaw::Cylinder => ("cylinder", &["radius", "half_length"]),
            ShapeRaw::Sphere => ("sphere", &["radius"]),
            ShapeRaw::Box => ("box", &["half_extents"]),
            ShapeRaw::Capsule => ("capsule", &["radius", "half_length"]),
            ShapeRaw::HalfSpace => ("half-space", &[]),
            ShapeRaw::Mesh => ("mesh", &["file", "scale", "field_error"]),
        };
        let written = [
            ("radius", raw.radius.as_ref().map(|at| at.offset)),
            ("half_length", raw.half_length.as_ref().map(|at| at.offset)),
            (
                "half_extents",
                raw.half_extents.as_ref().map(|at| at.offset),
            ),
            ("file", raw.file.as_ref().map(|at| at.offset)),
            ("scale", raw.scale.as_ref().map(|at| at.offset)),
            ("field_error", raw.field_error.as_ref().map(|at| at.offset)),
        ];
        for (key, offset) in written {
            if let Some(offset) = offset.filter(|_| !keys.contains(&key)) {
                let has = match keys {
                    [] => "none".to_owned(),
                    keys => keys.join(" and "),
                };
                let what = format!("{key} does not belong to shape \"{shape}\"");
                return Err(self.error(offset, what, format!("remove it; its own keys: {has}")));
            }
        }
        let missing = |key: &str| SceneError::Missing {
            path: self.path.to_path_buf(),
            line: line_of(self.source, at.offset),
            what: format!("shape \"{shape}\" needs {key} in [tool]"),
            mend: format!("add `{key} = ...`"),
        };
        let length = |key: &str, at: &Option<At<f64>>| {
            let at = at.as_ref().ok_or_else(|| missing(key))?;
            self.number(key, at, Quantity::Length, Range::Positive)
        };
        let shape = match raw.shape {
            ShapeRaw::Sphere => ToolShape::Sphere {
                radius: length("radius", &raw.radius)?,
            },
            ShapeRaw::Cylinder => ToolShape::Cylinder {
                radius: length("radius", &raw.radius)?,
                half_length: match &raw.half_length {
                    None => None,
                    some => Some(length("half_length", some)?),
                },
            },
            ShapeRaw::Capsule => ToolShape::Capsule {
                radius: length("radius", &raw.radius)?,
                half_length: length("half_length", &raw.half_length)?,
            },
            ShapeRaw::Box => {
                let at = raw
                    .half_extents
                    .as_ref()
                    .ok_or_else(|| missing("half_extents"))?;
                let half = self.vector("half_extents", at, Quantity::Length, Range::Positive)?;
                ToolShape::Box {
                    half_extents: DVec3::from_array(half),
                }
            }
            ShapeRaw::HalfSpace => ToolShape::HalfSpace,
            ShapeRaw::Mesh => self.tool_mesh(raw, missing("file"))?,
        };
        let position = self.vector("position", &raw.position, Quantity::Length, Range::Any)?;
        let pose_part_tool = DPose3::from_parts(DVec3::from_array(position), self.rotation(raw)?);
        Ok(Tool {
            shape,
            pose_part_tool,
            start: raw.start,
        })
    }

    fn tool_mesh(&self, raw: &raw::ToolRaw, missing: SceneError) -> Result<ToolShape, SceneError> {
        let at = raw.file.as_ref().ok_or(missing)?;
        let extension = Path::new(&at.value).extension().unwrap_or_default();
        if !["stl", "obj"]
            .iter()
            .any(|known| extension.eq_ignore_ascii_case(known))
        {
            let what = format!("tool file {} is neither .stl nor .obj", at.value);
            return Err(self.error(at.offset, what, "export the tool as STL or OBJ"));
        }
        let file = self.file("tool", at, "paths are relative to the scene file")?;
        let scale = raw.scale.as_ref();
        let one = At {
            value: 1.0,
            offset: at.offset,
        };
        let scale = self.number(
            "scale",
            scale.unwrap_or(&one),
            Quantity::Length,
            Range::Positive,
        )?;
        let field = raw.field_error.as_ref().map(|at| {
            let error = self.number("field_error", at, Quantity::Length, Range::Positive)?;
            let line = line_of(self.source, at.offset);
            Ok(FieldOf { error, line })
        });
        Ok(ToolShape::Mesh {
            file,
            line: line_of(self.source, at.offset),
            scale,
            field: field.transpose()?,
        })
    }

    fn rotation(&self, raw: &raw::ToolRaw) -> Result<DQuat, SceneError> {
        match (&raw.axis, &raw.rotation) {
            (Some(_), Some(rotation)) => Err(self.error(
                rotation.offset,
                "axis and rotation are both given".to_owned(),
                "keep one of them",
            )),
            (Some(axis), None) => Ok(DQuat::from_rotation_arc(
                DVec3::Z,
                self.direction("axis", axis)?,
            )),
            (None, Some(at)) => {
                let [x, y, z, w] = self.vector("rotation", at, Quantity::Number, Range::Any)?;
                let largest = x.abs().max(y.abs()).max(z.abs()).max(w.abs());
                if largest == 0.0 {
                    let what = "rotation [0, 0, 0, 0] turns nowhere".to_owned();
                    let mend = "write x, y, z, w; [0.0, 0.0, 0.0, 1.0] is no turn";
                    return Err(self.error(at.offset, what, mend));
                }
                Ok(
                    DQuat::from_xyzw(x / largest, y / largest, z / largest, w / largest)
                        .normalize(),
                )
            }
            (None, None) => Ok(DQuat::IDENTITY),
        }
    }

    fn coupling(&self, raw: &raw::CouplingRaw) -> Result<Coupling, SceneError> {
        Ok(Coupling {
            translational_stiffness: self.number_or(
                "translational_stiffness",
                raw.translational_stiffness.as_ref(),
                default::COUPLING_TRANSLATIONAL_STIFFNESS,
                Quantity::Stiffness,
                Range::Positive,
            )?,
            rotational_stiffness: self.number_or(
                "rotational_stiffness",
                raw.rotational_stiffness.as_ref(),
                default::COUPLING_ROTATIONAL_STIFFNESS,
                Quantity::RotationalStiffness,
                Range::Positive,
            )?,
        })
    }

    fn device(&self, raw: &raw::DeviceRaw) -> Result<Device, SceneError> {
        let servo_period = match &raw.servo_period {
            None => default::SERVO_PERIOD,
            Some(at) => {
                let period = self.number("servo_period", at, Quantity::Time, Range::Positive)?;
                if !(1e-5..=0.1).contains(&period) {
                    let what = format!("servo_period {period} s is not between 1e-5 and 0.1");
                    return Err(self.error(at.offset, what, "haptic devices take 0.001"));
                }
                period
            }
        };
        Ok(Device {
            model: raw.model,
            servo_period,
            real_time: raw.real_time,
        })
    }

    fn effects(&self, raw: &raw::EffectsRaw) -> Result<Effects, SceneError> {
        let choice = |key: &str, at: &Option<At<EffectRaw>>| match at {
            None
            | Some(At {
                value: EffectRaw::Auto,
                ..
            }) => Ok(EffectChoice::Auto),
            Some(At {
                value: EffectRaw::Off,
                ..
            }) => Ok(EffectChoice::Off),
            Some(At {
                value: EffectRaw::On,
                offset,
            }) => Err(self.error(
                *offset,
                format!("this version does not simulate {key}"),
                "use \"auto\" to be told its size",
            )),
        };
        let coefficient = raw.friction_coefficient.as_ref();
        Ok(Effects {
            friction: choice("friction", &raw.friction)?,
            large_rotation: choice("large_rotation", &raw.large_rotation)?,
            gravity: choice("gravity", &raw.gravity)?,
            tool_inertia: choice("tool_inertia", &raw.tool_inertia)?,
            part_inertia: choice("part_inertia", &raw.part_inertia)?,
            damping: choice("damping", &raw.damping)?,
            continuous_collision: choice("continuous_collision", &raw.continuous_collision)?,
            deformable_tool: choice("deformable_tool", &raw.deformable_tool)?,
            friction_coefficient: coefficient
                .map(|at| {
                    self.number(
                        "friction_coefficient",
                        at,
                        Quantity::Number,
                        Range::NotNegative,
                    )
                })
                .transpose()?,
        })
    }

    fn output(&self, raw: &raw::OutputRaw) -> Result<Output, SceneError> {
        let frames = raw.frames.as_ref().map_or(Ok(default::FRAMES), |at| {
            self.integer("frames", at, 0, 1000)
        })?;
        Ok(Output {
            frames: frames as u32,
            camera: raw
                .camera
                .as_ref()
                .map(|at| self.direction("camera", at))
                .transpose()?,
            pictures: raw.pictures.unwrap_or(true),
            vtu: raw.vtu.unwrap_or(true),
            mcap: raw.mcap.unwrap_or(true),
        })
    }
}
