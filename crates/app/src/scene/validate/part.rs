//! The part: mesh, orders, groups, material.

use std::path::Path;

use super::super::error::{SceneError, line_of};
use super::super::raw::{self, At};
use super::super::units::Quantity;
use super::super::{Fixed, GroupName, Material, Part};
use super::{Check, Range};

impl Check<'_> {
    /// Group names; one that stands alone has the place of the whole value.
    fn group(&self, key: &str, name: String, offset: usize) -> Result<GroupName, SceneError> {
        if name.is_empty() {
            let what = format!("{key} has an empty group name");
            return Err(self.error(offset, what, "name a physical group of the mesh"));
        }
        Ok(GroupName {
            name,
            line: line_of(self.source, offset),
        })
    }

    pub(super) fn part(
        &self,
        raw: raw::PartRaw,
        accuracy: &raw::AccuracyKeys,
    ) -> Result<Part, SceneError> {
        let mend = "paths are relative to the scene file; scenes/README.md shows how to make one";
        let order = self.order(accuracy.order.as_ref(), raw.order.as_ref(), accuracy.preset)?;
        let interior_order = raw.interior_order.as_ref();
        let interior_order = interior_order
            .map(|at| self.integer("interior_order", at, 1, 5))
            .transpose()?
            .map(|order| order as u8);
        let none = |key: &str, offset| {
            self.error(
                offset,
                format!("{key} names no group"),
                "name a physical group of the mesh",
            )
        };
        if raw.fixed.value.0.is_empty() {
            return Err(none("fixed", raw.fixed.offset));
        }
        if raw.contact.value.0.is_empty() {
            return Err(none("contact", raw.contact.offset));
        }
        let material = self.material(&raw.material)?;
        let mut fixed = Vec::with_capacity(raw.fixed.value.0.len());
        for entry in raw.fixed.value.0 {
            let offset = entry.offset.max(raw.fixed.offset);
            let components = match &entry.value.components {
                None => [true; 3],
                Some(list) => {
                    let mut components = [false; 3];
                    for component in &list.value {
                        components[component.value as usize] = true;
                    }
                    if components == [false; 3] {
                        let what = format!("components of `{}` are empty", entry.value.group);
                        let mend = "name some of \"x\", \"y\", \"z\", or leave the key out for all";
                        return Err(self.error(list.offset, what, mend));
                    }
                    components
                }
            };
            fixed.push(Fixed {
                group: self.group("fixed", entry.value.group, offset)?,
                components,
            });
        }
        let mut contact = Vec::with_capacity(raw.contact.value.0.len());
        for name in raw.contact.value.0 {
            let offset = name.offset.max(raw.contact.offset);
            contact.push(self.group("contact", name.value, offset)?);
        }
        Ok(Part {
            mesh: self.file("mesh", &raw.mesh, mend)?,
            mesh_line: line_of(self.source, raw.mesh.offset),
            other_meshes: {
                let folder = self.path.parent().unwrap_or(Path::new(""));
                let names = raw.other_meshes.iter();
                names.map(|name| folder.join(name)).collect()
            },
            order,
            interior_order,
            material,
            fixed,
            contact,
            quadrature: raw.quadrature,
        })
    }

    fn material(&self, raw: &raw::MaterialRaw) -> Result<Material, SceneError> {
        use Range::{Any, Positive};
        let nu = &raw.poisson_ratio;
        let poisson_ratio = self.number("poisson_ratio", nu, Quantity::Number, Any)?;
        if poisson_ratio >= 0.5 {
            let what = format!("poisson_ratio {poisson_ratio} must be below 0.5");
            return Err(self.error(
                nu.offset,
                what,
                "for rubber-like parts use 0.49 with order = 3 (nearer to 0.5, or at order 2, elements lock: \
                 forces are far too high)",
            ));
        }
        if poisson_ratio <= -1.0 {
            let what = format!("poisson_ratio {poisson_ratio} must be above -1");
            return Err(self.error(nu.offset, what, "plastics have 0.3 to 0.45"));
        }
        let young = &raw.young_modulus;
        let young_modulus = self.number("young_modulus", young, Quantity::Pressure, Positive)?;
        let optional = |key, at: &Option<At<f64>>, quantity| {
            at.as_ref()
                .map(|at| self.number(key, at, quantity, Positive))
                .transpose()
        };
        Ok(Material {
            name: raw.name.clone(),
            young_modulus,
            poisson_ratio,
            density: optional("density", &raw.density, Quantity::Density)?,
            permissible_strain: optional(
                "permissible_strain",
                &raw.permissible_strain,
                Quantity::Number,
            )?,
        })
    }
}
