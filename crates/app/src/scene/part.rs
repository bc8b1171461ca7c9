//! `[part]`: the deformable part, its mesh, orders and groups.

use std::fmt;
use std::path::PathBuf;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::MapAccessDeserializer;
use serde::de::{self, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use super::SceneError;
use super::check::Check;
use super::keys::{At, Listed, OneOrMore, Whole};
use super::material::{Material, WordOrKeys};

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

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct PartKeys {
    /// Gmsh mesh (`.msh`, version 2 or 4, text or binary, whole or partitioned) of tetrahedra, relative to the scene
    /// file. The volume must be in a physical group, or Gmsh does not save its elements.
    mesh: At<String>,
    /// Order of the elements, 1, 2 or 3. Another one than the mesh's own raises or lowers it; new
    /// nodes lie on the mesh's curved edges and faces. The same as `accuracy.order`.
    #[schemars(extend("x-default" = "the mesh's own"))]
    pub(super) order: Option<Whole<1, 3>>,
    /// Order of the elements inside the part, 1 to 5, a multiple of `order`: what bends is then solved for more exactly,
    /// while contact, steps and pictures keep the nodes of `order`. Costs time when the part is prepared, none in a step. With
    /// quadratic elements 4 takes the clip's bending error from 9 to below 1 %; `snapin accuracy` shows it as an axis.
    #[schemars(extend("x-default" = "the same as `order`"))]
    interior_order: Option<Whole<1, 5>>,
    /// Other meshes of the same part with the same groups, coarser or finer, relative to the scene
    /// file: an axis of `snapin accuracy`, which is the only command that reads them.
    #[serde(default)]
    #[schemars(extend("x-default" = "none"))]
    other_meshes: Vec<String>,
    /// Material of the part: one word, such as `material = "POM"`, or keys; may be its own section `[part.material]`. What is
    /// not written is that of the named material, where it is one of the table below.
    material: At<WordOrKeys>,
    /// What is held: the name of a physical group of the mesh (of volumes, surfaces, curves or points), or a list of
    /// names and of tables with `group` and `components`, such as `{ group = "symmetry", components = ["x"] }`.
    fixed: At<OneOrMore<FixedEntry>>,
    /// What can touch the tool: the name of a physical group, or a list of names.
    contact: At<OneOrMore<String>>,
    /// Rule for the element integrals.
    #[serde(default)]
    quadrature: QuadratureRule,
}

/// One held group: its name, or a table.
#[derive(Debug)]
struct FixedEntry(FixedKeys);

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct FixedKeys {
    group: String,
    // Without it all are held.
    #[schemars(length(min = 1))]
    components: Option<At<Vec<Component>>>,
}

// A direction of the part's frame. No doc comment here and above: the schema would have it.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
enum Component {
    X,
    Y,
    Z,
}

impl PartKeys {
    /// `order`: what this section and `[accuracy]` say together.
    pub(super) fn checked(self, order: Option<u8>, check: &Check<'_>) -> Result<Part, SceneError> {
        let interior_order = self.interior_order;
        let interior_order = interior_order.map(|order| check.whole("interior_order", order));
        let interior_order = interior_order.transpose()?.map(|order| order as u8);
        for (key, offset, is_empty) in [
            ("fixed", self.fixed.offset, self.fixed.is_empty()),
            ("contact", self.contact.offset, self.contact.is_empty()),
        ] {
            if is_empty {
                let what = format!("{key} names no group");
                return Err(check.error(offset, what, "name a physical group of the mesh"));
            }
        }
        let material = self.material.checked(check)?;
        let fixed = self.fixed.into_values();
        let fixed = fixed.map(|at| at.value.checked(at.offset, check));
        let fixed = fixed.collect::<Result<_, _>>()?;
        let contact = self.contact.into_values();
        let contact = contact.map(|at| group("contact", at.value, at.offset, check));
        let contact = contact.collect::<Result<_, _>>()?;
        let mend = "paths are relative to the scene file; scenes/README.md shows how to make one";
        Ok(Part {
            mesh: check.file("mesh", &self.mesh, mend)?,
            mesh_line: check.line(self.mesh.offset),
            other_meshes: self
                .other_meshes
                .iter()
                .map(|name| check.beside(name))
                .collect(),
            order,
            interior_order,
            material,
            fixed,
            contact,
            quadrature: self.quadrature,
        })
    }
}

fn group(
    key: &str,
    name: String,
    offset: usize,
    check: &Check<'_>,
) -> Result<GroupName, SceneError> {
    if name.is_empty() {
        let what = format!("{key} has an empty group name");
        return Err(check.error(offset, what, "name a physical group of the mesh"));
    }
    let line = check.line(offset);
    Ok(GroupName { name, line })
}

impl FixedEntry {
    fn checked(self, offset: usize, check: &Check<'_>) -> Result<Fixed, SceneError> {
        let FixedKeys {
            group: name,
            components: written,
        } = self.0;
        let components = match &written {
            None => [true; 3],
            Some(list) if list.value.is_empty() => {
                let what = format!("components of `{name}` are empty");
                let mend = "name some of \"x\", \"y\", \"z\", or leave the key out for all";
                return Err(check.error(list.offset, what, mend));
            }
            Some(list) => {
                let mut components = [false; 3];
                for component in &list.value {
                    components[*component as usize] = true;
                }
                components
            }
        };
        Ok(Fixed {
            group: group("fixed", name, offset, check)?,
            components,
        })
    }
}

impl Listed for FixedEntry {
    const EXPECTED: &str = "a group name, or a list of group names and of tables with `group`";
}

impl Listed for String {
    const EXPECTED: &str = "a group name or a list of group names";
}

impl<'de> Deserialize<'de> for FixedEntry {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Entry;
        impl<'de> Visitor<'de> for Entry {
            type Value = FixedKeys;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a group name or a table with `group` and `components`")
            }
            fn visit_str<E: de::Error>(self, name: &str) -> Result<FixedKeys, E> {
                Ok(FixedKeys {
                    group: name.to_owned(),
                    components: None,
                })
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<FixedKeys, A::Error> {
                FixedKeys::deserialize(MapAccessDeserializer::new(map))
            }
        }
        deserializer.deserialize_any(Entry).map(Self)
    }
}

impl JsonSchema for FixedEntry {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Fixed".into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "anyOf": [{ "type": "string" }, FixedKeys::json_schema(generator)]
        })
    }
}
