//! Part, tool and arrows onto the layers, whole or cut open.

use glam::DVec3;

use super::super::data::{ContactForce, PartDrawing};
use super::camera::Camera;
use super::canvas::Layer;
use super::colour;
use super::section::Cut;
use super::surface::Surface;

/// Colour of a force.
const FORCE: [f32; 3] = [0.80, 0.10, 0.32];

/// Of one at a contact that sticks to the tool.
const STICKING: [f32; 3] = [0.0, 0.45, 0.30];

/// Cut faces of the tool: their ground, and the lines of the hatching.
const TOOL_CUT: [[f32; 3]; 2] = [[0.86, 0.88, 0.91], [0.45, 0.48, 0.53]];

/// Draws what the camera sees of what the cut leaves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Painter<'a> {
    pub(super) camera: &'a Camera,
    pub(super) cut: Option<&'a Cut>,
}

impl Painter<'_> {
    /// Distance of each corner from the cut, above zero in front of it; below zero everywhere without one.
    fn sides(&self, corners: [DVec3; 3]) -> [f32; 3] {
        self.cut
            .map_or([-1.0; 3], |cut| corners.map(|p| cut.side(p) as f32))
    }

    fn line(
        &self,
        layer: &mut Layer,
        ends: [DVec3; 2],
        width: f64,
        colour: [f32; 3],
        strength: f32,
    ) {
        let kept = self.cut.map_or(Some(ends), |cut| cut.kept(ends));
        if let Some(ends) = kept {
            let ends = ends.map(|p| self.camera.project(p));
            layer.line(ends, width, colour, strength);
        }
    }

    /// The part in the colours of `shades` (by node, 0 to 1), with its elements and creases; `body` has the displaced nodes.
    pub(super) fn part(
        &self,
        layer: &mut Layer,
        body: &Surface,
        part: &PartDrawing,
        shades: &[f32],
    ) {
        let map = colour::map();
        let projected = self.camera.project_all(&body.nodes);
        for (triangle_idx, triangle) in body.triangles.iter().enumerate() {
            let corners = triangle.map(|n| projected[n as usize]);
            let value = triangle.map(|n| shades[n as usize]);
            let light = body.corner_normals[triangle_idx].map(|n| self.camera.light(n) as f32);
            let sides = self.sides(triangle.map(|n| body.nodes[n as usize]));
            layer.triangle(corners, |weights| {
                let lit = mixed(light, weights);
                (mixed(sides, weights) <= 0.0).then(|| {
                    let colour = colour::at(&map, mixed(value, weights));
                    (colour.map(|c| c * lit), 1.0)
                })
            });
        }
        if let Some(cut) = self.cut {
            let lit = self.camera.light(cut.normal) as f32;
            for facet in cut.facets(part, &body.nodes, shades) {
                let corner = |i: usize| self.camera.project(facet[i].0);
                for k in 1..facet.len() - 1 {
                    let value = [facet[0].1, facet[k].1, facet[k + 1].1];
                    layer.triangle([corner(0), corner(k), corner(k + 1)], |weights| {
                        let colour = colour::at(&map, mixed(value, weights));
                        Some((colour.map(|c| c * lit), 1.0))
                    });
                }
            }
        }
        for edge in &part.edges {
            for pair in edge.windows(2) {
                let ends = [body.nodes[pair[0] as usize], body.nodes[pair[1] as usize]];
                self.line(layer, ends, 1.5, [0.06, 0.07, 0.10], 0.42);
            }
        }
        for pair in &body.creases {
            let ends = pair.map(|n| body.nodes[n as usize]);
            self.line(layer, ends, 2.6, [0.05, 0.06, 0.09], 0.85);
        }
        for ends in self.cut.iter().flat_map(|cut| cut.outline(body)) {
            let ends = ends.map(|p| self.camera.project(p));
            layer.line(ends, 3.2, [0.05, 0.06, 0.09], 0.9);
        }
    }

    /// Only where the part is, without colours.
    pub(super) fn part_depths(&self, layer: &mut Layer, body: &Surface, part: &PartDrawing) {
        self.depths(layer, body);
        let values = vec![0.0; body.nodes.len()];
        for facet in self
            .cut
            .iter()
            .flat_map(|cut| cut.facets(part, &body.nodes, &values))
        {
            let corner = |i: usize| self.camera.project(facet[i].0);
            for k in 1..facet.len() - 1 {
                let corners = [corner(0), corner(k), corner(k + 1)];
                layer.triangle(corners, |_| Some(([0.0; 3], 1.0)));
            }
        }
    }

    /// Only where a surface is.
    pub(super) fn depths(&self, layer: &mut Layer, surface: &Surface) {
        let projected = self.camera.project_all(&surface.nodes);
        for triangle in &surface.triangles {
            let sides = self.sides(triangle.map(|n| surface.nodes[n as usize]));
            layer.triangle(triangle.map(|n| projected[n as usize]), |weights| {
                (mixed(sides, weights) <= 0.0).then_some(([0.0; 3], 1.0))
            });
        }
    }

    /// The tool as glass; where it is cut, its inside as a hatched face.
    pub(super) fn tool(&self, layer: &mut Layer, tool: &Surface) {
        let projected = self.camera.project_all(&tool.nodes);
        for (triangle, normals) in tool.triangles.iter().zip(&tool.corner_normals) {
            let light = normals.map(|n| self.camera.light(n) as f32);
            // Glass is seen best where it is grazed.
            let facing = normals.map(|n| self.camera.facing(n) as f32);
            let sides = self.sides(triangle.map(|n| tool.nodes[n as usize]));
            layer.triangle(triangle.map(|n| projected[n as usize]), |weights| {
                let grazing = 1.0 - mixed(facing, weights);
                let lit = mixed(light, weights);
                (mixed(sides, weights) <= 0.0).then_some((
                    [0.74 * lit, 0.77 * lit, 0.81 * lit],
                    0.38 + 0.4 * grazing * grazing,
                ))
            });
        }
        let outline = self.cut_tool(layer, tool);
        for pair in &tool.creases {
            let ends = pair.map(|n| tool.nodes[n as usize]);
            self.line(layer, ends, 2.4, [0.35, 0.38, 0.42], 0.9);
        }
        for ends in outline {
            layer.line(ends, 3.2, [0.25, 0.28, 0.32], 0.95);
        }
    }

    /// Fills the tool's inside where it is cut; returns the lines around it on the picture.
    pub(super) fn cut_tool(&self, layer: &mut Layer, tool: &Surface) -> Vec<[[f64; 3]; 2]> {
        let Some(cut) = self.cut else {
            return Vec::new();
        };
        let lines: Vec<[[f64; 3]; 2]> = cut
            .outline(tool)
            .into_iter()
            .map(|ends| ends.map(|p| self.camera.project(p)))
            .collect();
        let depth = self.camera.depth_of_plane(cut.point, cut.normal);
        layer.hatched(&lines, depth, TOOL_CUT, 0.93);
        lines
    }

    /// Arrows end at the contact points. They lie over everything: a force that is hidden by the
    /// part is still a force. What the cut takes away takes its forces with it.
    pub(super) fn arrows(
        &self,
        layer: &mut Layer,
        contacts: &[ContactForce],
        metres_per_newton: f64,
    ) {
        let mut arrows: Vec<([[f64; 3]; 2], _)> = contacts
            .iter()
            .filter(|c| self.has(c))
            .map(|c| {
                let tail = c.point - c.force * metres_per_newton;
                let colour = if c.sticks { STICKING } else { FORCE };
                let ends = [self.camera.project(tail), self.camera.project(c.point)];
                (ends, colour)
            })
            .filter(|(ends, _)| ends.iter().flatten().all(|v| v.is_finite()))
            .collect();
        arrows.sort_by(|(a, _), (b, _)| b[1][2].total_cmp(&a[1][2]));
        for (ends, colour) in arrows {
            layer.arrow(ends, colour);
        }
    }

    /// Whether a contact is drawn.
    pub(super) fn has(&self, contact: &ContactForce) -> bool {
        self.cut
            .is_none_or(|cut| cut.side(contact.point) <= cut.slack)
    }
}

fn mixed(values: [f32; 3], weights: [f32; 3]) -> f32 {
    values[0] * weights[0] + values[1] * weights[1] + values[2] * weights[2]
}
