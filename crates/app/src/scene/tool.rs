//! `[tool]`: the rigid tool, its shape and where it starts.

use std::path::{Path, PathBuf};

use glam::{DQuat, DVec3};
use glamx::DPose3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::check::Check;
use super::check::Range::{Any, Positive};
use super::friction::{self, OfPair};
use super::keys::{At, Direction, In, Length, Plain, Point, Quaternion, place};
use super::{Material, SceneError};

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

/// Shape of the tool.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(super) enum ShapeWord {
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

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ToolKeys {
    /// Shape; a key that does not belong to it is an error.
    shape: ShapeWord,
    /// Radius of a cylinder, sphere or capsule, above 0.
    #[schemars(extend("x-default" = "by shape"))]
    radius: Option<Length>,
    /// Half of a cylinder's length, or half of the distance between the centres of a capsule's
    /// round ends, above 0. A cylinder without it is infinite.
    #[schemars(extend("x-default" = "by shape"))]
    half_length: Option<Length>,
    /// Half of each edge of a box, along local x, y, z, above 0.
    #[schemars(extend("x-default" = "by shape"))]
    half_extents: Option<Point>,
    /// STL (text or binary, all its solids) or OBJ file of a closed mesh, relative to the scene file. Corners that
    /// round-off holds apart, by up to 1e-6 of the size, are joined where that closes it; triangles the wrong way are
    /// turned; polygons may be concave. What was changed is told.
    #[schemars(extend("x-default" = "by shape"))]
    file: Option<At<String>>,
    /// Factor from the coordinates of `file` to the scene's length unit, above 0.
    #[schemars(extend("default" = 1.0))]
    scale: Option<Plain>,
    /// Distances to a mesh are interpolated from a field that is computed at load, wrong by no more than this, above
    /// 0. For meshes of very many triangles; without it the mesh itself is asked.
    #[schemars(extend("x-default" = "no field"))]
    field_error: Option<Length>,
    /// Where the tool's origin starts, in the part's frame.
    position: Point,
    /// Where the tool's local +z points, in the part's frame; any length but 0. The shortest turn
    /// from +z leads there.
    #[schemars(extend("default" = [0.0, 0.0, 1.0]))]
    axis: Option<Direction>,
    /// The tool's rotation as a quaternion x, y, z, w, instead of `axis`; any length but 0.
    #[schemars(extend("x-default" = "by `axis`"))]
    rotation: Option<Quaternion>,
    /// What it is made of, for the coefficient of friction with `part.material.name`: steel, PTFE, PE-HD, PP, POM, PA, PBT,
    /// PS, SAN, PC, PMMA, ABS, PE-LD or PVC.
    #[schemars(extend("x-default" = "not said"))]
    material: Option<At<String>>,
    /// How the tool stands to the part before the first step.
    #[serde(default)]
    start: Start,
}

impl ToolKeys {
    /// Friction of the tool's material with that of the part; `None` where the tool's is not said.
    pub(super) fn friction(
        &self,
        part: &Material,
        check: &Check<'_>,
    ) -> Result<Option<OfPair>, SceneError> {
        let Some(At { value, offset }) = &self.material else {
            return Ok(None);
        };
        let listed: Vec<&str> = friction::names().collect();
        let unknown = |whose: &str, name: &str| {
            let what = format!("{whose} \"{name}\" is in no table of friction");
            let mend = format!(
                "{}; or state friction_coefficient in [effects] and leave tool.material out",
                SceneError::mend_of(name, &listed)
            );
            check.error(*offset, what, mend)
        };
        let tool = friction::known(value).ok_or_else(|| unknown("tool.material", value))?;
        let name = part.name.as_deref().ok_or_else(|| {
            let what =
                "tool.material asks for the friction of a pair, and part.material has no name";
            let mend = format!("write part.material.name, one of {}", listed.join(", "));
            check.error(*offset, what, mend)
        })?;
        let part = friction::known(name).ok_or_else(|| unknown("part.material.name", name))?;
        friction::of_pair(part, tool).map(Some).ok_or_else(|| {
            let what = format!("the friction of {part} on {tool} is in no table");
            check.error(*offset, what, "state friction_coefficient in [effects]")
        })
    }

    /// The radius of a cylinder, for what stands for it elsewhere. One that makes no sense is left
    /// to this section's check.
    pub(super) fn cylinder_radius(&self) -> Option<Length> {
        let radius = self.radius.filter(|radius| radius.value.0 > 0.0);
        radius.filter(|_| self.shape == ShapeWord::Cylinder)
    }

    /// `offset` is that of the section.
    pub(super) fn checked(&self, offset: usize, check: &Check<'_>) -> Result<Tool, SceneError> {
        let shape = self.shape(offset, check)?;
        let position = check.vector("position", self.position, Any)?;
        let rotation = self.rotation(check)?;
        Ok(Tool {
            shape,
            pose_part_tool: DPose3::from_parts(DVec3::from_array(position), rotation),
            start: self.start,
        })
    }

    fn shape(&self, offset: usize, check: &Check<'_>) -> Result<ToolShape, SceneError> {
        let (shape, own): (_, &[&str]) = match self.shape {
            ShapeWord::Cylinder => ("cylinder", &["radius", "half_length"]),
            ShapeWord::Sphere => ("sphere", &["radius"]),
            ShapeWord::Box => ("box", &["half_extents"]),
            ShapeWord::Capsule => ("capsule", &["radius", "half_length"]),
            ShapeWord::HalfSpace => ("half-space", &[]),
            ShapeWord::Mesh => ("mesh", &["file", "scale", "field_error"]),
        };
        let written = [
            ("radius", place(&self.radius)),
            ("half_length", place(&self.half_length)),
            ("half_extents", place(&self.half_extents)),
            ("file", place(&self.file)),
            ("scale", place(&self.scale)),
            ("field_error", place(&self.field_error)),
        ];
        for (key, offset) in written {
            if let Some(offset) = offset.filter(|_| !own.contains(&key)) {
                let has = match own {
                    [] => "none".to_owned(),
                    own => own.join(" and "),
                };
                let what = format!("{key} does not belong to shape \"{shape}\"");
                return Err(check.error(offset, what, format!("remove it; its own keys: {has}")));
            }
        }
        let missing = |key: &str| {
            let what = format!("shape \"{shape}\" needs {key} in [tool]");
            check.missing(offset, what, format!("add `{key} = ...`"))
        };
        let length = |key: &str, written: Option<Length>| {
            check.number(key, written.ok_or_else(|| missing(key))?, Positive)
        };
        Ok(match self.shape {
            ShapeWord::Sphere => ToolShape::Sphere {
                radius: length("radius", self.radius)?,
            },
            ShapeWord::Cylinder => ToolShape::Cylinder {
                radius: length("radius", self.radius)?,
                half_length: check.optional("half_length", self.half_length, Positive)?,
            },
            ShapeWord::Capsule => ToolShape::Capsule {
                radius: length("radius", self.radius)?,
                half_length: length("half_length", self.half_length)?,
            },
            ShapeWord::Box => {
                let half = self.half_extents.ok_or_else(|| missing("half_extents"))?;
                let half = check.vector("half_extents", half, Positive)?;
                ToolShape::Box {
                    half_extents: DVec3::from_array(half),
                }
            }
            ShapeWord::HalfSpace => ToolShape::HalfSpace,
            ShapeWord::Mesh => {
                let file = self.file.as_ref().ok_or_else(|| missing("file"))?;
                self.mesh(file, check)?
            }
        })
    }

    fn mesh(&self, name: &At<String>, check: &Check<'_>) -> Result<ToolShape, SceneError> {
        let extension = Path::new(&name.value).extension().unwrap_or_default();
        if !["stl", "obj"]
            .iter()
            .any(|known| extension.eq_ignore_ascii_case(known))
        {
            let what = format!("tool file {} is neither .stl nor .obj", name.value);
            return Err(check.error(name.offset, what, "export the tool as STL or OBJ"));
        }
        let file = check.file("tool", name, "paths are relative to the scene file")?;
        // What one unit of the file is as a length of the scene.
        let (value, offset) = self.scale.map_or((In(1.0), name.offset), |scale| {
            (In(scale.value.0), scale.offset)
        });
        let scale = check.number("scale", Length { value, offset }, Positive)?;
        let field = self.field_error.map(|written| {
            Ok(FieldOf {
                error: check.number("field_error", written, Positive)?,
                line: check.line(written.offset),
            })
        });
        Ok(ToolShape::Mesh {
            file,
            line: check.line(name.offset),
            scale,
            field: field.transpose()?,
        })
    }

    fn rotation(&self, check: &Check<'_>) -> Result<DQuat, SceneError> {
        match (self.axis, self.rotation) {
            (Some(_), Some(rotation)) => {
                let what = "axis and rotation are both given";
                Err(check.error(rotation.offset, what, "keep one of them"))
            }
            (Some(axis), None) => {
                let axis = check.direction("axis", axis)?;
                Ok(DQuat::from_rotation_arc(DVec3::Z, axis))
            }
            (None, Some(rotation)) => {
                let [x, y, z, w] = check.vector("rotation", rotation, Any)?;
                let largest = x.abs().max(y.abs()).max(z.abs()).max(w.abs());
                if largest == 0.0 {
                    let what = "rotation [0, 0, 0, 0] turns nowhere";
                    let mend = "write x, y, z, w; [0.0, 0.0, 0.0, 1.0] is no turn";
                    return Err(check.error(rotation.offset, what, mend));
                }
                Ok(
                    DQuat::from_xyzw(x / largest, y / largest, z / largest, w / largest)
                        .normalize(),
                )
            }
            (None, None) => Ok(DQuat::IDENTITY),
        }
    }
}
