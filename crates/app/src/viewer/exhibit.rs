//! What is shown, without a way to show it: surface, tool, ground, scales and the first view.

use contact::tool::Tool;
use glam::DVec3;
use glamx::DPose3;

use super::arrows::{Force, arrows_into};
use super::camera::Camera;
use super::rehearsal::{Place, Rehearsal};
use super::scene3d::{Moving, Samples, Scene3d, Still};
use super::skin::{Line, Skin, Vertex};
use crate::Error;
use crate::engine::ActiveContact;
use crate::evaluate;
use crate::prepare::PreparedPart;
use crate::report::render::overlay::{ColourBar, round_step};
use crate::report::render::surface::Surface;
use crate::report::render::{bounds, viewpoint};
use crate::report::{ContactForce, Frame, PartDrawing, View};
use crate::scene::Scene;
use crate::session::part_extent;
use crate::shape::Shape;

/// Colour of the tool, and how opaque it is where one looks straight at it.
const TOOL: [f32; 4] = [0.72, 0.76, 0.82, 0.36];

/// Its edges: colour and pixels.
const TOOL_EDGE: ([f32; 4], f32) = ([0.33, 0.37, 0.43, 0.9], 1.6);

/// Lines of the ground: colour and pixels.
const GROUND: ([f32; 4], f32) = ([0.55, 0.58, 0.62, 0.45], 1.0);

/// Of the part's size, the length of the longest arrow of the way.
const ARROW: f64 = 0.16;

/// How much longer an arrow may be than that.
const ARROW_MOST: f64 = 2.0;

/// Of the part's size: how far an endless tool is drawn, and how far one that is longer is looked at.
const TOOL_EXTENT: f64 = 0.4;
const TOOL_SEEN: f64 = 0.3;

/// What is shown of a scene.
pub(crate) struct Exhibit {
    /// Of the scene.
    pub(super) title: String,
    pub(super) rehearsal: Rehearsal,
    /// m, diagonal of the part's bounding box.
    pub(super) size: f64,
    /// The colour scale, mm.
    pub(super) bar: ColourBar,
    skin: Skin,
    tool: Vec<Vertex>,
    tool_lines: Vec<Line>,
    ground: Vec<Line>,
    /// m, between two lines of the ground.
    pub(super) ground_step: f64,
    /// m, of the contact nodes at rest, candidates first, then those that are held.
    contact_rest: Vec<DVec3>,
    n_candidates: usize,
    view: View,
    /// m, what the first picture has to hold.
    points: Vec<DVec3>,
}

impl Exhibit {
    /// Puts together what is shown.
    ///
    /// # Errors
    /// Those of the multiply.
    pub(crate) fn new(
        scene: &Scene,
        prepared: &PreparedPart,
        tool: &Tool,
        rehearsal: Rehearsal,
        shape: &mut Shape,
    ) -> Result<Self, Error> {
        let loaded = &prepared.loaded;
        let part = evaluate::drawing::part(&loaded.mesh);
        let size = part_extent(&loaded.mesh);
        let node = |n: u32| DVec3::from_array(loaded.mesh.nodes[n as usize]);
        let contact_nodes = loaded.candidates.iter().chain(&loaded.held);
        let (corners, triangles) = tool.tessellate(TOOL_EXTENT * size);
        let loose: Vec<[DVec3; 3]> = triangles
            .iter()
            .map(|t| t.map(|i| corners[i as usize]))
            .collect();
        let surface = Surface::welded(&loose);
        let mut exhibit = Self {
            title: scene.title.clone(),
            size,
            bar: ColourBar::new("displacement", "mm", 1e3 * rehearsal.largest_displacement),
            skin: Skin::new(&part, &loaded.rows),
            tool: tool_vertices(&surface),
            tool_lines: tool_lines(&surface),
            ground: Vec::new(),
            ground_step: 0.0,
            contact_rest: contact_nodes.map(|&n| node(n)).collect(),
            n_candidates: loaded.candidates.len(),
            view: View::default(),
            points: Vec::new(),
            rehearsal,
        };
        exhibit.look_at(scene, prepared, &part, &loose, shape)?;
        Ok(exhibit)
    }

    /// Chooses the first view: the accustomed one where it shows the contact when it presses most, else the report's.
    fn look_at(
        &mut self,
        scene: &Scene,
        prepared: &PreparedPart,
        part: &PartDrawing,
        tool: &[[DVec3; 3]],
        shape: &mut Shape,
    ) -> Result<(), Error> {
        let rehearsal = &self.rehearsal;
        let strongest = &rehearsal.strongest;
        let moved = shape.update(&strongest.contacts)?;
        let mut displacement = vec![DVec3::ZERO; part.nodes.len()];
        for (&node, u) in prepared.loaded.rows.iter().zip(moved.chunks_exact(3)) {
            displacement[node as usize] = DVec3::from_slice(u);
        }
        let forces = self.forces(&strongest.contacts, moved);
        let at = |pose: &DPose3| -> Vec<[DVec3; 3]> {
            tool.iter().map(|t| t.map(|p| *pose * p)).collect()
        };
        let pressed = strongest.report.tool_pose;
        let frame = Frame {
            displacement,
            contacts: forces
                .iter()
                .map(|f| ContactForce {
                    node: 0,
                    point: f.point,
                    force: f.force,
                    sticks: f.sticks,
                })
                .collect(),
            tool: at(&pressed),
            ..Frame::default()
        };
        let surface = part.triangles.iter().flatten();
        let mut points: Vec<DVec3> = surface.map(|&n| part.nodes[n as usize]).collect();
        let (low, high) = bounds(&points);
        let reach = DVec3::splat(TOOL_SEEN * self.size);
        for pose in [
            &rehearsal.held.tool_pose,
            &pressed,
            &rehearsal.last.report.tool_pose,
        ] {
            let corners = at(pose);
            let near = corners
                .iter()
                .flatten()
                .map(|p| p.clamp(low - reach, high + reach));
            points.extend(near);
        }
        let viewing = evaluate::viewing(scene, rehearsal.held.way_of_tool(rehearsal.direction));
        self.view = viewpoint::accustomed_or_best(part, &frame, &viewing, &points);
        self.points = points;
        self.lay_ground((low, high));
        Ok(())
    }

    /// A grid below the part, across what is up.
    fn lay_ground(&mut self, (low, high): (DVec3, DVec3)) {
        let up = self.view.up.normalize_or(DVec3::Y);
        let (x, y) = up.any_orthonormal_pair();
        let step = round_step(self.size / 6.0);
        let middle = 0.5 * (low + high);
        let half = (0.75 * self.size / step).ceil() as i32;
        let down = 0.5 * (high - low).dot(up.abs()) + 0.02 * self.size;
        let origin = middle - up * down;
        let (colour, width) = GROUND;
        let at = |a: i32, b: i32| {
            let place = origin + x * (f64::from(a) * step) + y * (f64::from(b) * step);
            place.as_vec3().to_array()
        };
        let lines =
            (-half..=half).flat_map(|k| [[at(k, -half), at(k, half)], [at(-half, k), at(half, k)]]);
        self.ground = lines
            .map(|ends| Line {
                ends,
                colour,
                width,
            })
            .collect();
        self.ground_step = step;
    }

    /// mm and N that fill the plot.
    pub(super) fn plot_scale(&self) -> [f64; 2] {
        let curve = &self.rehearsal.curve;
        let largest = |k: usize| curve.iter().map(|p| p[k].abs()).fold(0.0, f64::max);
        [1e3 * largest(0).max(1e-6), largest(1).max(1e-3)]
    }

    /// The first view, for a picture of this shape (width / height).
    pub(super) fn camera(&self, aspect: f64) -> Camera {
        Camera::fit(&self.view, &self.points, aspect)
    }

    /// On an adapter.
    pub(super) fn scene3d(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        samples: Samples,
    ) -> Scene3d {
        let still = Still {
            triangles: &self.skin.triangles,
            n_vertices: self.skin.n_vertices(),
            tool: &self.tool,
            tool_lines: &self.tool_lines,
            ground: &self.ground,
        };
        // A pan goes to the side, and the way of a held part takes it along.
        Scene3d::new(device, queue, &still, 4.0 * self.size, samples)
    }

    /// A moment, as it is drawn. `displacement`: 3 components for each of the part's rows, m.
    pub(super) fn moment_into(
        &self,
        tool_pose: &DPose3,
        contacts: &[ActiveContact],
        displacement: &[f64],
        moving: &mut Moving,
    ) {
        let top = 1e-3 * self.bar.top;
        self.skin
            .vertices_into(displacement, top, &mut moving.vertices);
        self.skin.lines_into(&moving.vertices, &mut moving.lines);
        let [part, tool] = self.rehearsal.poses(tool_pose);
        moving.pose_world_part = part;
        moving.pose_world_tool = tool;
        let mut forces = self.forces(contacts, displacement);
        let longest = self.rehearsal.largest_force;
        for force in &mut forces {
            force.force = force.force.clamp_length_max(ARROW_MOST * longest);
        }
        let per_newton = if longest > 0.0 {
            ARROW * self.size / longest
        } else {
            0.0
        };
        arrows_into(&forces, per_newton, self.size, &mut moving.arrows);
    }

    /// A place of the rehearsal, as it is drawn.
    ///
    /// # Errors
    /// Those of the multiply.
    pub(super) fn place(&self, place: &Place, shape: &mut Shape) -> Result<Moving, Error> {
        let mut moving = Moving::default();
        let displacement = shape.update(&place.contacts)?;
        self.moment_into(
            &place.report.tool_pose,
            &place.contacts,
            displacement,
            &mut moving,
        );
        Ok(moving)
    }

    /// Where the contacts press.
    fn forces(&self, contacts: &[ActiveContact], displacement: &[f64]) -> Vec<Force> {
        let place = |candidate: usize| {
            let rest = *self.contact_rest.get(candidate)?;
            let row = displacement.get(3 * candidate..3 * candidate + 3);
            let moves = candidate < self.n_candidates;
            Some(rest + row.filter(|_| moves).map_or(DVec3::ZERO, DVec3::from_slice))
        };
        let force = |c: &ActiveContact| {
            Some(Force {
                point: place(c.candidate as usize)?,
                force: c.force_on_part,
                sticks: c.sticks,
            })
        };
        contacts.iter().filter_map(force).collect()
    }
}

fn tool_vertices(surface: &Surface) -> Vec<Vertex> {
    let corners = surface.triangles.iter().zip(&surface.corner_normals);
    corners
        .flat_map(|(triangle, normals)| {
            [0, 1, 2].map(|i| Vertex {
                position: surface.nodes[triangle[i] as usize].as_vec3().to_array(),
                normal: normals[i].as_vec3().to_array(),
                paint: TOOL,
            })
        })
        .collect()
}

fn tool_lines(surface: &Surface) -> Vec<Line> {
    let (colour, width) = TOOL_EDGE;
    let lines = surface.creases.iter().map(|ends| Line {
        ends: ends.map(|n| surface.nodes[n as usize].as_vec3().to_array()),
        colour,
        width,
    });
    lines.collect()
}
