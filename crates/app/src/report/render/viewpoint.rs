//! From where contact is seen best, and where part and tool must be cut open to see it at all.

use std::f64::consts::PI;

use glam::{DQuat, DVec3};

use super::super::data::{ContactForce, Frame, PartDrawing, View, Viewing};
use super::camera::Camera;
use super::canvas::Layer;
use super::paint::Painter;
use super::section::Cut;
use super::surface::Surface;

/// Samples of a trial picture: coarse, because only depths are asked for.
const TRIAL: (usize, usize) = (240, 180);

/// How well a contact behind the glass tool alone is seen; 1 is in plain sight.
const THROUGH_GLASS: f64 = 0.55;

/// Share of the contact that must be seen for the part to stay whole.
const ENOUGH: f64 = 0.35;

/// What the way of the held body lying across the picture is worth, beside a contact in plain sight: motion is seen from the side.
const ACROSS: f64 = 0.25;

/// What the accustomed view is worth: it is left only for one that shows clearly more.
const ACCUSTOMED: f64 = 0.1;

/// What it is worth to look from the accustomed side, and from above.
const NEAR: f64 = 0.08;

/// Contacts whose places are tried for a cut.
const TRIED_CONTACTS: usize = 6;

/// Where the pictures of a run are taken from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Viewpoint {
    pub(crate) view: View,
    pub(super) cut: Option<Cut>,
}

/// The view that shows most of the contact, weighted by force, in the moment with the largest forces. A view that the user
/// chose is kept, and so is that of a run without contact.
pub(crate) fn choose(
    part: &PartDrawing,
    frames: &[Frame],
    viewing: &Viewing,
    points: &[DVec3],
) -> Viewpoint {
    let own = Viewpoint {
        view: viewing.view,
        cut: None,
    };
    let pressed = |frame: &Frame| frame.contacts.iter().map(|c| c.force.length()).sum::<f64>();
    let strongest = frames
        .iter()
        .filter(|frame| pressed(frame) > 0.0 && pressed(frame).is_finite())
        .max_by(|a, b| pressed(a).total_cmp(&pressed(b)));
    let (Some(frame), Some(way), false) = (
        strongest,
        viewing.approach.try_normalize(),
        viewing.is_fixed,
    ) else {
        return own;
    };
    let trial = Trial::new(part, frame, points);
    let taste = |view: &View| {
        let along = view.direction.normalize_or_zero().dot(way);
        let near = view
            .direction
            .normalize_or_zero()
            .dot(own.view.direction.normalize_or_zero());
        let above = -view.direction.normalize_or_zero().dot(view.up);
        ACROSS * (1.0 - along.abs()) + NEAR * (near + above.signum())
    };
    let whole = best(open_views(&viewing.view, way), |v| {
        let bonus = if v.view == own.view { ACCUSTOMED } else { 0.0 };
        trial.seen(v) + taste(&v.view) + bonus
    });
    let whole = whole.unwrap_or(own);
    let seen = trial.seen(&whole);
    if seen >= ENOUGH {
        return whole;
    }
    let cut = best(trial.cut_views(way), |v| trial.seen(v));
    match cut {
        Some(cut) if trial.seen(&cut) > seen => cut,
        _ => whole,
    }
}

/// The accustomed view, or the one that was asked for, where it shows enough of the contact, and else as [`choose`]; never cut open.
#[cfg(feature = "viewer")]
pub(crate) fn accustomed_or_best(
    part: &PartDrawing,
    frame: &Frame,
    viewing: &Viewing,
    points: &[DVec3],
) -> View {
    let own = Viewpoint {
        view: viewing.view,
        cut: None,
    };
    if Trial::new(part, frame, points).seen(&own) >= ENOUGH {
        return own.view;
    }
    choose(part, std::slice::from_ref(frame), viewing, points).view
}

/// The first of those with the highest mark.
fn best(views: Vec<Viewpoint>, mark: impl Fn(&Viewpoint) -> f64) -> Option<Viewpoint> {
    let mut best: Option<(Viewpoint, f64)> = None;
    for view in views {
        let mark = mark(&view);
        if best.as_ref().is_none_or(|b| mark > b.1 + 1e-9) {
            best = Some((view, mark));
        }
    }
    best.map(|b| b.0)
}

/// The accustomed view, and around the way of the held body from ahead, from behind and steeply.
fn open_views(own: &View, way: DVec3) -> Vec<Viewpoint> {
    let level = own.direction.reject_from(way);
    let level = level.normalize_or(way.any_orthonormal_vector());
    let mut views = vec![*own];
    for (tilt, n_sides) in [(20.0, 24), (-20.0, 24), (50.0, 12), (-50.0f64, 12)] {
        for k in 0..n_sides {
            let turn = f64::from(k) * 2.0 * PI / f64::from(n_sides);
            let into = DQuat::from_axis_angle(way, turn) * level;
            let (sin, cos) = tilt.to_radians().sin_cos();
            views.push(upright(into * cos + way * sin, way));
        }
    }
    views
        .into_iter()
        .map(|view| Viewpoint { view, cut: None })
        .collect()
}

/// A view in which up is an axis of the part: the one that the way lies along if it is y or z, else y, else z.
fn upright(direction: DVec3, way: DVec3) -> View {
    let wish = if way.z.abs() > 0.8 {
        DVec3::Z
    } else {
        DVec3::Y
    };
    let other = if wish == DVec3::Z { DVec3::Y } else { DVec3::Z };
    let is_level = direction.normalize_or_zero().dot(wish).abs() < 0.85;
    View {
        direction,
        up: if is_level { wish } else { other },
    }
}

/// One moment, to be looked at from many sides.
struct Trial<'a> {
    body: Surface,
    part: &'a PartDrawing,
    tool: Surface,
    contacts: &'a [ContactForce],
    points: &'a [DVec3],
    /// m.
    size: f64,
}

impl<'a> Trial<'a> {
    fn new(part: &'a PartDrawing, frame: &'a Frame, points: &'a [DVec3]) -> Self {
        let nodes: Vec<DVec3> = part
            .nodes
            .iter()
            .zip(&frame.displacement)
            .map(|(&p, &u)| p + u)
            .collect();
        let (low, high) = super::bounds(points);
        Self {
            body: Surface::new(nodes, part.triangles.clone()),
            part,
            tool: Surface::welded(&frame.tool),
            contacts: &frame.contacts,
            points,
            size: (high - low).length(),
        }
    }

    /// Share of the contact force that is seen.
    fn seen(&self, viewpoint: &Viewpoint) -> f64 {
        let stage = [0.0, 0.0, TRIAL.0 as f64, TRIAL.1 as f64];
        let camera = Camera::fit(&viewpoint.view, self.points, stage);
        let painter = Painter {
            camera: &camera,
            cut: viewpoint.cut.as_ref(),
        };
        let mut solid = Layer::new(TRIAL.0, TRIAL.1);
        painter.part_depths(&mut solid, &self.body, self.part);
        let mut glass = Layer::new(TRIAL.0, TRIAL.1);
        painter.depths(&mut glass, &self.tool);
        let mut inside = Layer::new(TRIAL.0, TRIAL.1);
        painter.cut_tool(&mut inside, &self.tool);
        // The contact lies on both surfaces, and a sample is as deep as a surface is steep.
        let slack = 0.012 * self.size * camera.pixels_per_metre();
        let (mut seen, mut all) = (0.0, 0.0);
        for contact in self.contacts {
            let force = contact.force.length();
            if !force.is_finite() || !contact.point.is_finite() {
                continue;
            }
            all += force;
            let [x, y, depth] = camera.project(contact.point);
            let is_behind = |layer: &Layer| layer.depth_at(x, y) < depth - slack;
            if painter.has(contact) && !is_behind(&solid) && !is_behind(&inside) {
                seen += force
                    * if is_behind(&glass) {
                        THROUGH_GLASS
                    } else {
                        1.0
                    };
            }
        }
        if all > 0.0 { seen / all } else { 0.0 }
    }

    /// Planes along the way through the middle of the contact and through its strongest places, each looked at from both sides.
    fn cut_views(&self, way: DVec3) -> Vec<Viewpoint> {
        let force = |c: &ContactForce| c.force.length();
        let mut contacts: Vec<&ContactForce> = self
            .contacts
            .iter()
            .filter(|c| force(c).is_finite() && c.point.is_finite())
            .collect();
        contacts.sort_by(|a, b| force(b).total_cmp(&force(a)));
        let all: f64 = contacts.iter().map(|c| force(c)).sum();
        if all <= 0.0 {
            return Vec::new();
        }
        let middle = contacts.iter().map(|c| c.point * force(c)).sum::<DVec3>() / all;
        let aside = |c: &&ContactForce| (c.point - middle).reject_from(way);
        let mut along: Vec<DVec3> = contacts
            .iter()
            .map(aside)
            .filter(|a| a.length() > 0.02 * self.size)
            .take(TRIED_CONTACTS)
            .collect();
        along.extend([
            way.any_orthonormal_vector(),
            way.cross(way.any_orthonormal_vector()),
        ]);
        let normals = along.iter().filter_map(|a| way.cross(*a).try_normalize());
        let mut views = Vec::new();
        for normal in normals.flat_map(|n| [n, -n]) {
            let side = way.cross(normal);
            for (yaw, tilt) in [
                (20.0, 15.0),
                (-20.0, 15.0),
                (20.0, -15.0),
                (-20.0, -15.0f64),
            ] {
                let (yaw, tilt) = (f64::to_radians(yaw), tilt.to_radians());
                let level = -(normal * yaw.cos() + side * yaw.sin());
                views.push(Viewpoint {
                    view: upright(level * tilt.cos() + way * tilt.sin(), way),
                    cut: Some(Cut {
                        point: middle,
                        normal,
                        slack: 1e-3 * self.size,
                    }),
                });
            }
        }
        views
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may fail by panic")]
mod tests {
    use super::super::super::data::Run;
    use super::super::super::sample;
    use super::*;

    /// A box of 2 mm around the origin, closed, with one contact at `place` under a force along -y, seen from +z.
    fn boxed(place: DVec3) -> Run {
        let mut run = sample::run();
        let corner = |i: u32| {
            let side = |bit: u32| if i >> bit & 1 == 1 { 1e-3 } else { -1e-3 };
            DVec3::new(side(0), side(1), side(2))
        };
        run.part = PartDrawing {
            nodes: (0..8).map(corner).collect(),
            triangles: [
                [0, 2, 3, 1],
                [4, 5, 7, 6],
                [0, 1, 5, 4],
                [2, 6, 7, 3],
                [0, 4, 6, 2],
                [1, 3, 7, 5],
            ]
            .iter()
            .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
            .collect(),
            ..PartDrawing::default()
        };
        run.frames = vec![Frame {
            displacement: vec![DVec3::ZERO; 8],
            contacts: vec![ContactForce {
                node: 0,
                point: place,
                force: DVec3::NEG_Y,
                sticks: false,
            }],
            ..Frame::default()
        }];
        run.viewing = Viewing {
            view: View {
                direction: DVec3::new(0.1, -0.1, -1.0),
                up: DVec3::Y,
            },
            is_fixed: false,
            approach: DVec3::NEG_Y,
        };
        run
    }

    fn chosen(run: &Run) -> (Viewpoint, f64) {
        let viewpoint = choose(&run.part, &run.frames, &run.viewing, &run.part.nodes);
        let trial = Trial::new(&run.part, &run.frames[0], &run.part.nodes);
        (viewpoint, trial.seen(&viewpoint))
    }

    #[test]
    fn a_contact_in_plain_sight_is_seen_from_the_accustomed_side() {
        let run = boxed(DVec3::new(0.0, 0.0, 1e-3));
        let (viewpoint, seen) = chosen(&run);
        assert_eq!((viewpoint.view, viewpoint.cut), (run.viewing.view, None));
        assert_eq!(seen, 1.0);
    }

    #[test]
    fn a_contact_on_the_far_side_is_gone_round_to() {
        let (viewpoint, seen) = chosen(&boxed(DVec3::new(0.0, 0.0, -1e-3)));
        assert!(viewpoint.cut.is_none() && viewpoint.view.direction.z > 0.0);
        assert_eq!(seen, 1.0);
    }

    #[test]
    fn a_contact_that_no_view_shows_is_cut_open() {
        let run = boxed(DVec3::ZERO);
        let (viewpoint, seen) = chosen(&run);
        let cut = viewpoint.cut.unwrap();
        assert_eq!(seen, 1.0);
        assert!(
            cut.normal.dot(viewpoint.view.direction) < 0.0,
            "it is open towards the eye"
        );
        assert!(
            cut.normal.dot(run.viewing.approach).abs() < 1e-12,
            "it lies along the way"
        );
    }

    /// What the user asked for, a run without contact and one without a way are not second-guessed.
    #[test]
    fn a_camera_that_was_asked_for_is_kept() {
        let mut run = boxed(DVec3::ZERO);
        run.viewing.is_fixed = true;
        let own = run.viewing.view;
        assert!(chosen(&run).0.view == own && chosen(&run).0.cut.is_none());
        run.viewing.is_fixed = false;
        run.viewing.approach = DVec3::ZERO;
        assert!(chosen(&run).0.view == own);
        run.viewing.approach = DVec3::NEG_Y;
        run.frames[0].contacts.clear();
        assert!(chosen(&run).0.view == own);
        run.frames[0].contacts = vec![ContactForce {
            node: 0,
            point: DVec3::NAN,
            force: DVec3::NAN,
            sticks: false,
        }];
        assert!(chosen(&run).0.view == own);
    }

    #[test]
    fn up_is_never_where_one_looks() {
        for way in [DVec3::X, DVec3::NEG_Y, DVec3::Z] {
            let own = View::three_quarter(DVec3::Z, DVec3::Y);
            for Viewpoint { view, .. } in open_views(&own, way) {
                let along = view.direction.normalize().dot(view.up).abs();
                assert!(along < 0.9, "{way} {view:?}");
            }
        }
    }
}
