//! The settings that are compared: the scene's own, with one of them changed at a time.

use std::path::Path;

use super::course::{Course, Increment};
use crate::choice::SOFTWARE;
use crate::report::plot::short;
use crate::scene::{
    Accuracy, Adaptive, ContactAt, ContactIterations, FreeNodes, Multiply, MultiplyScalar, Preset,
    QuadratureRule, Rates, Scalar, Scene,
};

/// What is changed along a line of the plots.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Axis {
    /// Order of the elements.
    Order,
    /// Order of the elements inside.
    Interior,
    /// Mesh of the scene, others, and the scene's refined.
    Mesh,
    /// Where contact acts.
    Contact,
    /// Passes over the contact planes.
    Planes,
    /// Way between two steps, where there is friction.
    Increments,
    /// Which interface nodes are free, forces of the full order.
    Select,
    /// Planes kept in a step.
    MaxContacts,
    /// Periods after which the results of whole steps are there.
    Rates,
    /// Number type of the drawn shape.
    Scalar,
    /// Number type of the compliance that the step reads.
    ContactScalar,
    /// Rule for the element integrals.
    Quadrature,
    /// Settings for a goal.
    Preset,
}

impl Axis {
    /// All, in the order of the tables.
    pub const ALL: [Self; 13] = [
        Self::Order,
        Self::Interior,
        Self::Mesh,
        Self::Contact,
        Self::Planes,
        Self::Increments,
        Self::Select,
        Self::MaxContacts,
        Self::Rates,
        Self::Scalar,
        Self::ContactScalar,
        Self::Quadrature,
        Self::Preset,
    ];

    /// As on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Order => "order",
            Self::Interior => "interior",
            Self::Mesh => "mesh",
            Self::Contact => "contact",
            Self::Planes => "planes",
            Self::Increments => "increments",
            Self::Select => "select",
            Self::MaxContacts => "contacts",
            Self::Rates => "rates",
            Self::Scalar => "scalar",
            Self::ContactScalar => "contact-scalar",
            Self::Quadrature => "quadrature",
            Self::Preset => "preset",
        }
    }

    /// What it is, for tables.
    pub fn title(self) -> &'static str {
        match self {
            Self::Order => "order of the elements",
            Self::Interior => "order inside (surface and contact as they are)",
            Self::Mesh => "mesh",
            Self::Contact => "contact at nodes or at places that move",
            Self::Planes => "passes over the contact planes",
            Self::Increments => "size of the increments (way between two steps)",
            Self::Select => "p-method: select (free nodes drawn)",
            Self::MaxContacts => "contacts kept",
            Self::Rates => "two rates (frozen problems in the loop)",
            Self::Scalar => "numbers of the drawn shape",
            Self::ContactScalar => "numbers of the contact compliance",
            Self::Quadrature => "quadrature",
            Self::Preset => "preset",
        }
    }

    /// Whether its settings trade the accuracy of a step for its time. What is drawn is no part of a step, and smaller
    /// increments are more steps, not longer ones: between those, differences in time are the clock's.
    pub(super) fn is_choice_of_step(self) -> bool {
        !matches!(self, Self::Scalar | Self::Increments)
    }

    /// The axis of this name.
    pub fn of_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|axis| axis.name() == name)
    }
}

/// One setting. Where the multiply runs is written in it: what is `"auto"` in the scene is measured on the processor.
#[derive(Clone, Debug)]
pub struct Setting {
    /// The scene with its settings changed.
    pub scene: Scene,
    /// How often its mesh is refined.
    pub refinements: u8,
    /// In which it is driven.
    pub increment: Increment,
    /// Name of the graphics adapter that multiplies, if one does.
    pub adapter: Option<String>,
}

impl Setting {
    /// All that the result depends on beside the scene itself; equal keys are one run.
    pub fn key(&self) -> String {
        let accuracy = Accuracy {
            preset: None,
            budget_us: None,
            ..self.scene.accuracy.clone()
        };
        let on_adapter = match &self.adapter {
            Some(adapter) if accuracy.multiply == Multiply::Gpu => format!(" on {adapter}"),
            _ => String::new(),
        };
        let in_steps = match self.increment {
            Increment::OWN => String::new(),
            other => format!(" {other:?}"),
        };
        format!(
            "{} refined {} order {:?} inside {:?} {:?} {accuracy:?}{on_adapter}{in_steps}",
            self.scene.part.mesh.display(),
            self.refinements,
            self.scene.part.order,
            self.scene.part.interior_order,
            self.scene.part.quadrature,
        )
    }
}

impl Setting {
    /// What its preparing depends on.
    pub(super) fn part_key(&self) -> String {
        let part = &self.scene.part;
        format!(
            "{} refined {} order {:?} inside {:?} {:?}",
            part.mesh.display(),
            self.refinements,
            part.order,
            part.interior_order,
            part.quadrature
        )
    }
}

/// A setting on an axis.
#[derive(Clone, Debug)]
pub struct Point {
    /// Which setting was changed.
    pub axis: Axis,
    /// To what.
    pub label: String,
    /// The whole.
    pub setting: Setting,
}

/// The scene's own settings. `adapter`: name of the graphics adapter that multiplies where a setting asks for one.
pub(super) fn base(scene: &Scene, adapter: Option<&str>) -> Setting {
    Setting {
        scene: scene.clone(),
        refinements: 0,
        increment: Increment::OWN,
        adapter: adapter.map(str::to_owned),
    }
}

/// The scene with `"auto"` of the multiply made into what it means on the processor or on a GPU, so that settings are
/// compared on the same, whatever is faster for each of them.
pub(super) fn multiply_written(scene: &mut Scene) {
    let accuracy = &mut scene.accuracy;
    if accuracy.multiply == Multiply::Auto {
        accuracy.multiply = Multiply::Cpu;
    }
    accuracy.scalar = match (accuracy.multiply, accuracy.scalar) {
        (Multiply::Gpu, MultiplyScalar::Auto) => MultiplyScalar::F32,
        (_, MultiplyScalar::Auto) => MultiplyScalar::F64,
        (Multiply::Cpu, MultiplyScalar::F16) => MultiplyScalar::F32,
        (_, written) => written,
    };
}

/// Another order throughout.
pub(super) fn set_order(scene: &mut Scene, order: u8) {
    scene.part.order = Some(order);
    scene.part.interior_order = None;
}

/// What the points of a scene depend on, beside the scene.
pub(super) struct Surroundings<'a> {
    /// Order of the elements in the mesh file.
    pub(super) own_order: u8,
    /// Size of the part, m.
    pub(super) extent: f64,
    /// As of [`base`].
    pub(super) adapter: Option<&'a str>,
    /// The way on which they are compared.
    pub(super) course: &'a Course,
}

/// All points of the axes asked for.
pub(super) fn points(scene: &Scene, axes: &[Axis], around: &Surroundings<'_>) -> Vec<Point> {
    let mut list = List {
        scene,
        around,
        axis: Axis::Order,
        points: Vec::new(),
    };
    for &axis in axes {
        list.axis = axis;
        if !list.of_part() {
            list.of_step();
        }
    }
    list.points
}

/// Why a scene has no points of an axis; `None` if it has some, or if this is plain from its settings.
pub(super) fn reason_for_none(axis: Axis, scene: &Scene) -> Option<&'static str> {
    let has_friction = scene.effects.simulated_friction().is_some();
    match axis {
        Axis::Increments if !has_friction => {
            Some("without friction the force at a place does not depend on the way to it")
        }
        _ => None,
    }
}

struct List<'a> {
    scene: &'a Scene,
    around: &'a Surroundings<'a>,
    /// Of what is added.
    axis: Axis,
    points: Vec<Point>,
}

impl List<'_> {
    fn add(&mut self, label: impl Into<String>, change: impl FnOnce(&mut Setting)) {
        let mut setting = base(self.scene, self.around.adapter);
        setting.scene.accuracy.preset = None;
        change(&mut setting);
        self.points.push(Point {
            axis: self.axis,
            label: label.into(),
            setting,
        });
    }

    /// What changes the part, or all. Whether the axis is such a one.
    fn of_part(&mut self) -> bool {
        let part = &self.scene.part;
        let own = part.order.unwrap_or(self.around.own_order);
        match self.axis {
            Axis::Order => {
                for order in 1..=3u8 {
                    self.add(format!("order {order}"), |s| set_order(&mut s.scene, order));
                }
            }
            Axis::Interior => {
                self.add(format!("order {own} throughout"), |s| {
                    s.scene.part.interior_order = None;
                });
                for order in (own + 1..=5).filter(|order| order.is_multiple_of(own)) {
                    self.add(format!("order {order} inside"), |s| {
                        s.scene.part.interior_order = Some(order);
                    });
                }
            }
            Axis::Mesh => {
                self.add(name_of(&part.mesh), |_| {});
                for mesh in &part.other_meshes {
                    self.add(name_of(mesh), |s| s.scene.part.mesh.clone_from(mesh));
                }
                let refined = format!("{}, each element in eight", name_of(&part.mesh));
                self.add(refined, |s| s.refinements = 1);
            }
            Axis::Quadrature => {
                for (label, rule) in [
                    ("fast", QuadratureRule::Fast),
                    ("converged", QuadratureRule::Converged),
                ] {
                    self.add(label, |s| s.scene.part.quadrature = rule);
                }
            }
            Axis::Preset => {
                for preset in [Preset::Fast, Preset::Balanced, Preset::Exact] {
                    self.add(preset.name(), |s| {
                        set_accuracy(&mut s.scene, Accuracy::of(Some(preset)));
                        if preset == Preset::Exact {
                            set_order(&mut s.scene, 3);
                        }
                    });
                }
            }
            _ => return false,
        }
        true
    }

    /// What changes the step.
    fn of_step(&mut self) {
        let own = self.scene.part.order.unwrap_or(self.around.own_order);
        match self.axis {
            axis if reason_for_none(axis, self.scene).is_some() => {}
            Axis::Contact => {
                for (label, at) in [("nodes", ContactAt::Nodes), ("places", ContactAt::Places)] {
                    self.add(label, |s| s.scene.accuracy.contact_at = at);
                }
            }
            Axis::Planes => {
                for times in [1, 2, 3, 5] {
                    let label = format!("{times} passes").replace("1 passes", "1 pass");
                    self.add(label, |s| {
                        s.scene.accuracy.contact_iterations = ContactIterations::Times(times);
                    });
                }
                self.add("converged", |s| {
                    s.scene.accuracy.contact_iterations = ContactIterations::Converged;
                });
            }
            Axis::Increments => self.increments(),
            Axis::Select if own > 1 => self.free_nodes(),
            Axis::MaxContacts => {
                for most in [8, 16, 32, 500] {
                    self.add(format!("{most} planes"), |s| {
                        s.scene.accuracy.max_contacts = most;
                    });
                }
            }
            Axis::Rates => {
                self.add("one rate", |s| s.scene.accuracy.rates = Rates::One);
                for every in [2, 5, 10, 20] {
                    self.add(format!("results {every} periods later"), |s| {
                        s.scene.accuracy.rates = Rates::Every(every);
                    });
                }
            }
            Axis::Scalar => self.shapes(),
            Axis::ContactScalar => {
                for (label, scalar) in [("f32", Scalar::F32), ("f64", Scalar::F64)] {
                    self.add(label, |s| s.scene.accuracy.contact_scalar = scalar);
                }
            }
            _ => {}
        }
    }

    fn increments(&mut self) {
        let course = self.around.course;
        for increment in Increment::COMPARED {
            // A way of a few steps has no larger ones.
            if increment == Increment::OWN || course.n_steps(increment) > 1 {
                let n = course.n_steps(increment);
                let label = format!("{}, {n} steps", length(course.length(increment)));
                self.add(label, |s| s.increment = increment);
            }
        }
    }

    fn free_nodes(&mut self) {
        let extent = self.around.extent;
        let mut free = |label: String, free| {
            self.add(label, |s| s.scene.accuracy.adaptive = Adaptive::On(free));
        };
        free("none free".to_owned(), FreeNodes::Radius(0.0));
        for share in [0.05, 0.1] {
            let radius = rounded(share * extent);
            free(
                format!("within {}", length(radius)),
                FreeNodes::Radius(radius),
            );
        }
        free("where bent by 0.1 %".to_owned(), FreeNodes::Indicator(1e-3));
        self.add("all free", |s| s.scene.accuracy.adaptive = Adaptive::Off);
    }

    fn shapes(&mut self) {
        let adapter = self.around.adapter;
        let mut kept = |label: String, multiply, scalar| {
            self.add(label, |s| {
                s.scene.accuracy.multiply = multiply;
                s.scene.accuracy.scalar = scalar;
            });
        };
        for (name, scalar) in [("f32", MultiplyScalar::F32), ("f64", MultiplyScalar::F64)] {
            kept(name.to_owned(), Multiply::Cpu, scalar);
        }
        if let Some(adapter) = adapter {
            let of = if adapter.ends_with(SOFTWARE) {
                format!("the GPU{SOFTWARE}")
            } else {
                "the GPU".to_owned()
            };
            for (name, scalar) in [("f16", MultiplyScalar::F16), ("f32", MultiplyScalar::F32)] {
                kept(format!("{name} on {of}"), Multiply::Gpu, scalar);
            }
        }
    }
}

/// Takes settings of accuracy over; what depends on the scene's size stays the scene's.
pub(super) fn set_accuracy(scene: &mut Scene, accuracy: Accuracy) {
    scene.accuracy = Accuracy {
        near_distance: scene.accuracy.near_distance,
        max_contacts: scene.accuracy.max_contacts,
        multiply: scene.accuracy.multiply,
        ..accuracy
    };
    multiply_written(scene);
}

fn name_of(mesh: &Path) -> String {
    mesh.file_name()
        .map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}

pub(super) fn length(metres: f64) -> String {
    format!("{} mm", short(1e3 * metres))
}

/// To two digits: radii that are read easily.
fn rounded(length: f64) -> f64 {
    if length == 0.0 {
        return 0.0;
    }
    let unit = 10f64.powf(length.log10().floor() - 1.0);
    (length / unit).round() * unit
}
