//! Which points of the tool are at which faces of the part: the rows of a pass.

use contact::Contact;
use contact::face::{Face, FaceOrder, MAX_FACE_NODES, Nearest};
use contact::surface::{NO_FACE, SMOOTH_SLOPE, Surface};
use glam::DVec3;

use super::super::late::has_columns;
use super::super::near::Look;
use super::super::watch::Watch;
use super::{Found, ToolFeatures};

/// Of the near distance: a point that is less deep behind several faces is at all of them, as in a hollow corner of the
/// part. 6 to 40 times what counts as standing still in the shipped scenes.
const CORNER_SHARE: f64 = 0.01;

/// Of a face's size: how far beyond a hollow border a point still leans on it within a stride.
const HOLLOW_SHARE: f64 = 0.25;

/// Of a face's reach, how much farther it looks for features: until tool and part have moved by as much it need not look
/// again.
const LOOK_AHEAD: f64 = 1.0;

/// Faces that a point is followed over from the one it was at.
const MOST_WALKED: usize = 8;

/// A feature at a face.
#[derive(Clone, Copy)]
struct At {
    feature: u32,
    face: u32,
    /// Of the feature: tool's and part's frame, m.
    local: DVec3,
    point: DVec3,
    key: u32,
}

impl Found {
    fn new(surface: &Surface, at: At, nearest: &Nearest, look: &mut Look<'_>) -> Self {
        let displacement = |node| look.forces.displacement(look.part, node);
        let face = at.face as usize;
        Self {
            feature: at.feature,
            face: at.face,
            gap: nearest.height,
            place: surface.place(face, at.key, nearest, at.local, displacement),
            contact: Contact {
                place: 0,
                gap: nearest.height,
                normal: -nearest.outward,
                point: at.point,
            },
        }
    }
}

impl ToolFeatures {
    fn at(&self, feature: u32, face: u32, look: &Look<'_>) -> At {
        let local = self.features.points()[feature as usize];
        At {
            feature,
            face,
            local,
            point: look.tool_pose.transform_point(local),
            key: self.first_key + feature,
        }
    }

    /// Adds the points of the tool that are at faces to the places of this pass.
    pub(in crate::engine) fn find(&mut self, watch: &Watch, look: &mut Look<'_>) {
        self.memory.begin_pass();
        self.found.clear();
        let room = look.places.room();
        let mut n_left_out = 0;
        let mut appointments = std::mem::take(&mut self.appointments);
        appointments.take_in(watch, look.part);
        appointments.visit(watch.sums(), |face, moved| {
            moved + self.look_at(face, look, room, &mut n_left_out)
        });
        self.appointments = appointments;
        self.keep_one_side(look);
        n_left_out += self.keep_seen(look, room);
        look.report.dropped += n_left_out as u32;
        self.found.retain(|found| {
            let is_there = has_columns(&found.place, look.part);
            if let (false, Some(late)) = (is_there, &mut look.late) {
                late.leave_out(&found.place, found.gap);
                look.report.without_column += 1;
            }
            is_there
        });
        self.memory.remember(&self.found);
        self.first_place = look.places.list().len() as u32;
        for found in &self.found {
            let u = found
                .place
                .displacement(|node| look.forces.displacement(look.part, node));
            look.places.push(found.place, found.contact, u);
        }
    }

    /// Finds the features at one face; how far tool and part must move before others can be there, m.
    fn look_at(
        &mut self,
        face: usize,
        look: &mut Look<'_>,
        room: usize,
        n_left_out: &mut usize,
    ) -> f64 {
        let tool_pose = look.tool_pose;
        let n_nodes = self.surface.order().n_nodes();
        let mut places = [DVec3::ZERO; MAX_FACE_NODES];
        self.surface
            .positions_into(face, |c| look.forces.position(look.part, c), &mut places);
        let places = &places[..n_nodes];
        let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for place in places {
            let local = tool_pose.inverse_transform_point(*place);
            (min, max) = (min.min(local), max.max(local));
        }
        // A curved face goes beyond its nodes by no more than this.
        let sum = self.surface.order().largest_sum();
        let centre = 0.5 * (min + max);
        let half = sum * 0.5 * (max - min);
        let depth = self.surface.depth(face);
        let reach = self
            .surface
            .reach(face, self.near_distance, self.near_distance);
        let (rows, memory, surface) = (&mut self.found, &self.memory, &self.surface);
        let first_key = self.first_key;
        let (features, near_distance) = (&self.features, self.near_distance);
        let mut ahead = LOOK_AHEAD * reach;
        let grown = half + DVec3::splat(reach + ahead);
        let mut is_empty = true;
        let slab = Slab::of(surface.order(), places);
        features.inside_box(centre - grown, centre + grown, |feature| {
            is_empty = false;
            let point = tool_pose.transform_point(features.points()[feature as usize]);
            // Most points are clear of the face by the plane of its vertices alone.
            let way = slab.way(point, near_distance, reach);
            if way > 0.0 {
                ahead = ahead.min(way);
                return;
            }
            let nearest = Face::new(surface.order(), places).nearest(point);
            let was_here = memory.face_before(feature) == face as u32;
            let hold = if was_here { near_distance } else { 0.0 };
            let is_near = nearest.height < near_distance && nearest.height >= -depth;
            if is_near && surface.is_at(face, &nearest, hold) {
                let at = At {
                    feature,
                    face: face as u32,
                    local: features.points()[feature as usize],
                    point,
                    key: first_key + feature,
                };
                let found = Found::new(surface, at, &nearest, look);
                *n_left_out += usize::from(!push(rows, found, room));
            }
            // In front it has to come to the face, or round its border. Behind, it is only far if it is out of reach:
            // the border reaches down to the depth.
            let apart = nearest.height.hypot(nearest.aside);
            let way = if nearest.height >= near_distance {
                0.5 * (apart - 3.0 * near_distance)
            } else {
                apart - reach
            };
            ahead = if way.is_finite() {
                ahead.min(way.max(0.0))
            } else {
                0.0
            };
        });
        if is_empty {
            // The box round the face holds all of it.
            let apart = features.distance_bound(centre) - half.length();
            ahead = ahead.max(apart - reach);
        }
        ahead / sum
    }

    /// Of several faces that a feature is behind, one stays: the one that it was at, else the nearest.
    fn keep_one_side(&mut self, look: &mut Look<'_>) {
        let shallow = -CORNER_SHARE * self.near_distance;
        let is_deep = |row: &Found| row.gap < shallow;
        for k in 0..self.found.len() {
            let row = self.found[k];
            if !is_deep(&row) {
                continue;
            }
            match self.memory.side_of(row.feature) {
                None => {
                    let before = self.memory.face_before(row.feature);
                    let walked = self.walk(before, row.feature, look);
                    let face = walked.map_or(row.face, |(face, _)| face);
                    self.memory
                        .set_side(row.feature, face, row.gap, walked.is_some());
                }
                Some(side) if !side.is_by_walk && row.gap > side.gap => {
                    self.memory.set_side(row.feature, row.face, row.gap, false);
                }
                Some(_) => {}
            }
        }
        let memory = &self.memory;
        self.found.retain(|row| {
            let side = memory.side_of(row.feature);
            !is_deep(row) || side.is_none_or(|side| side.face == row.face)
        });
    }

    /// Features that had a row earlier in the stride keep one as long as they are before or behind the surface.
    fn keep_seen(&mut self, look: &mut Look<'_>, room: usize) -> usize {
        self.memory.note(&self.found);
        let mut n_left_out = 0;
        for k in 0..self.memory.seen().len() {
            let feature = self.memory.seen()[k];
            if self.memory.has_row(feature) {
                n_left_out += self.keep_hollow(feature, look, room);
                continue;
            }
            let face = self.memory.face_before(feature);
            if let Some((face, nearest)) = self.walk(face, feature, look) {
                let found = Found::new(&self.surface, self.at(feature, face, look), &nearest, look);
                n_left_out += usize::from(!push(&mut self.found, found, room));
            }
        }
        n_left_out
    }

    /// Rows at faces that a feature was at earlier in the stride, now beyond a smooth border, if the surface is hollow
    /// there: the face then goes on behind the one that it is at, and its row asks for no more. A point in the kink
    /// between two faces leans on both; without this it would be pushed from each onto the other and back.
    fn keep_hollow(&mut self, feature: u32, look: &mut Look<'_>, room: usize) -> usize {
        let (faces, n_faces) = self.memory.faces(feature);
        if n_faces < 2 {
            return 0;
        }
        let mut n_left_out = 0;
        let of_feature = |rows: &[Found]| {
            let of = rows.iter().filter(|row| row.feature == feature);
            of.map(|row| row.gap).fold(f64::INFINITY, f64::min)
        };
        let gap = of_feature(&self.found);
        for &face in &faces[..n_faces] {
            let mut rows = self.found.iter();
            if rows.any(|row| row.feature == feature && row.face == face) {
                continue;
            }
            let at = self.at(feature, face, look);
            let nearest = self.nearest(face, at.point, look);
            let is_smooth =
                (0..3).all(|k| !nearest.is_beyond[k] || self.surface.is_smooth(face as usize, k));
            let hold = HOLLOW_SHARE * self.surface.size(face as usize);
            if is_smooth && nearest.aside <= hold && nearest.height >= gap {
                let found = Found::new(&self.surface, at, &nearest, look);
                n_left_out += usize::from(!push(&mut self.found, found, room));
            }
        }
        n_left_out
    }

    /// The point of a face that is nearest to a point of the part's frame.
    fn nearest(&self, face: u32, point: DVec3, look: &mut Look<'_>) -> Nearest {
        let mut places = [DVec3::ZERO; MAX_FACE_NODES];
        self.surface.positions_into(
            face as usize,
            |c| look.forces.position(look.part, c),
            &mut places,
        );
        let order = self.surface.order();
        Face::new(order, &places[..order.n_nodes()]).nearest(point)
    }

    /// The face that a feature is at now, followed over borders from the one it was at. Over an edge of the part it comes
    /// to be in front of the face beyond: it has slid off.
    fn walk(&self, mut face: u32, feature: u32, look: &mut Look<'_>) -> Option<(u32, Nearest)> {
        let point = self.at(feature, face, look).point;
        for _ in 0..MOST_WALKED {
            if face == NO_FACE {
                return None;
            }
            let at = face as usize;
            let nearest = self.nearest(face, point, look);
            if self.surface.is_at(at, &nearest, self.near_distance) {
                return Some((face, nearest));
            }
            let beyond = (0..3).filter(|k| nearest.is_beyond[*k]);
            let mut across = beyond.map(|k| self.surface.neighbour(at, k));
            face = across.find(|face| *face != NO_FACE).unwrap_or(NO_FACE);
        }
        None
    }
}

/// The triangle of a face's vertices, and how far the face is from it at most.
struct Slab {
    vertices: [DVec3; 3],
    normal: DVec3,
    /// By vertex: unit, in the plane, out of the triangle across the edge opposite of it.
    across: [DVec3; 3],
    /// m, of any point of the face from the triangle's point with the same local coordinates.
    off: f64,
    /// Bound on the sine of the angle between the face's normals and the triangle's.
    tilt: f64,
}

impl Slab {
    fn of(order: FaceOrder, places: &[DVec3]) -> Self {
        /// Largest sum of the gradients of the shape functions beyond the vertices', times the least height of the
        /// triangle: 3 of 4 (l_a ∇l_b + l_b ∇l_a); for cubic faces 6 of 13.5 and one of 9 at most.
        fn steepness(order: FaceOrder) -> f64 {
            match order {
                FaceOrder::Linear => 0.0,
                FaceOrder::Quadratic => 12.0,
                FaceOrder::Cubic => 100.0,
            }
        }
        let vertices = [places[0], places[1], places[2]];
        let [a, b, c] = vertices;
        let area = (b - a).cross(c - a);
        let normal = area / area.length();
        let edges = [c - b, a - c, b - a];
        let longest = edges.iter().map(|e| e.length()).fold(0.0, f64::max);
        let places_of_nodes = order.node_coordinates();
        let offsets = places.iter().zip(places_of_nodes).map(|(x, l)| {
            let flat: DVec3 = vertices.iter().zip(l).map(|(v, l)| l * *v).sum();
            (*x - flat).length()
        });
        let offset = offsets.fold(0.0, f64::max);
        Self {
            across: edges.map(|edge| edge.cross(normal).normalize()),
            off: order.largest_sum() * offset,
            tilt: steepness(order) * offset * longest / area.length(),
            vertices,
            normal,
        }
    }

    /// How far tool and face must move before a point can be at the face, or less, m; not above 0 if it may be now.
    fn way(&self, point: DVec3, near_distance: f64, reach: f64) -> f64 {
        let height = self.normal.dot(point - self.vertices[0]);
        // In front it has to come to the face or round its border; behind, within reach.
        let in_front = 0.5 * (height - self.off - 3.0 * near_distance);
        let behind = -height - self.off - reach;
        if self.tilt > 0.3 {
            return in_front.max(behind);
        }
        // Beside, within the prism under the face, whose sides lean with the normals and over smooth borders. A third:
        // they also turn as the face does, at a lever of no more than the depth.
        let beside = (0..3)
            .map(|k| self.across[k].dot(point - self.vertices[(k + 1) % 3]))
            .fold(f64::NEG_INFINITY, f64::max);
        let lean = 1.2 * (self.tilt + SMOOTH_SLOPE) * (height.abs() + self.off);
        let aside = 0.3 * (beside - self.off - lean - 3.0 * near_distance);
        in_front.max(behind).max(aside)
    }
}

/// Adds a row, or, where there is no room, puts it in the place of the one with the largest gap. False if one was left
/// out.
fn push(rows: &mut Vec<Found>, row: Found, room: usize) -> bool {
    if rows.len() < room.min(rows.capacity()) {
        rows.push(row);
        return true;
    }
    if let Some(widest) = rows.iter_mut().max_by(|a, b| a.gap.total_cmp(&b.gap))
        && widest.gap > row.gap
    {
        *widest = row;
    }
    false
}
