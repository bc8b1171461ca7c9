//! The settings that are compared: the scene's own, with one of them changed at a time.

use std::path::Path;

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
    pub const ALL: [Self; 12] = [
        Self::Order,
        Self::Interior,
        Self::Mesh,
        Self::Contact,
        Self::Planes,
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
            Self::Select => "p-method: select (free nodes drawn)",
            Self::MaxContacts => "contacts kept",
            Self::Rates => "two rates (frozen problems in the loop)",
            Self::Scalar => "numbers of the drawn shape",
            Self::ContactScalar => "numbers of the contact compliance",
            Self::Quadrature => "quadrature",
            Self::Preset => "preset",
        }
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
        format!(
            "{} refined {} order {:?} inside {:?} {:?} {accuracy:?}{on_adapter}",
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

/// All points of the axes asked for. `own_order`: that of the mesh; `extent`: size of the part, m; `adapter`: see
/// [`base`].
pub(super) fn points(
    scene: &Scene,
    axes: &[Axis],
    own_order: u8,
    extent: f64,
    adapter: Option<&str>,
) -> Vec<Point> {
    let mut all = Vec::new();
    let own = scene.part.order.unwrap_or(own_order);
    for &axis in axes {
        let mut add = |label: String, change: &dyn Fn(&mut Setting)| {
            let mut setting = base(scene, adapter);
            setting.scene.accuracy.preset = None;
            change(&mut setting);
            all.push(Point {
                axis,
                label,
                setting,
            });
        };
        match axis {
            Axis::Order => {
                for order in 1..=3u8 {
                    add(format!("order {order}"), &|s| {
                        set_order(&mut s.scene, order);
                    });
                }
            }
            Axis::Interior => {
                add(format!("order {own} throughout"), &|s| {
                    s.scene.part.interior_order = None;
                });
                for order in (own + 1..=5).filter(|order| order.is_multiple_of(own)) {
                    add(format!("order {order} inside"), &|s| {
                        s.scene.part.interior_order = Some(order);
                    });
                }
            }
            Axis::Mesh => {
                add(name_of(&scene.part.mesh), &|_| {});
                for mesh in &scene.part.other_meshes {
                    add(name_of(mesh), &|s| s.scene.part.mesh.clone_from(mesh));
                }
                let refined = format!("{}, each element in eight", name_of(&scene.part.mesh));
                add(refined, &|s| s.refinements = 1);
            }
            Axis::Contact => {
                for (label, at) in [("nodes", ContactAt::Nodes), ("places", ContactAt::Places)] {
                    add(label.to_owned(), &|s| s.scene.accuracy.contact_at = at);
                }
            }
            Axis::Planes => {
                for times in [1, 2, 3, 5] {
                    add(
                        format!("{times} passes").replace("1 passes", "1 pass"),
                        &|s| {
                            s.scene.accuracy.contact_iterations = ContactIterations::Times(times);
                        },
                    );
                }
                add("converged".to_owned(), &|s| {
                    s.scene.accuracy.contact_iterations = ContactIterations::Converged;
                });
            }
            Axis::Select if own == 1 => {}
            Axis::Select => {
                let mut free = |label: String, free| {
                    add(label, &|s| {
                        s.scene.accuracy.adaptive = Adaptive::On(free);
                    });
                };
                free("none free".to_owned(), FreeNodes::Radius(0.0));
                for share in [0.05, 0.1] {
                    let radius = rounded(share * extent);
                    free(within(radius), FreeNodes::Radius(radius));
                }
                free("where bent by 0.1 %".to_owned(), FreeNodes::Indicator(1e-3));
                add("all free".to_owned(), &|s| {
                    s.scene.accuracy.adaptive = Adaptive::Off;
                });
            }
            Axis::MaxContacts => {
                for most in [8, 16, 32, 500] {
                    add(format!("{most} planes"), &|s| {
                        s.scene.accuracy.max_contacts = most;
                    });
                }
            }
            Axis::Rates => {
                add("one rate".to_owned(), &|s| {
                    s.scene.accuracy.rates = Rates::One;
                });
                for every in [2, 5, 10, 20] {
                    add(format!("results {every} periods later"), &|s| {
                        s.scene.accuracy.rates = Rates::Every(every);
                    });
                }
            }
            Axis::Scalar => {
                let mut kept = |label: String, multiply, scalar| {
                    add(label, &|s| {
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
                    for (name, scalar) in
                        [("f16", MultiplyScalar::F16), ("f32", MultiplyScalar::F32)]
                    {
                        kept(format!("{name} on {of}"), Multiply::Gpu, scalar);
                    }
                }
            }
            Axis::ContactScalar => {
                for (label, scalar) in [("f32", Scalar::F32), ("f64", Scalar::F64)] {
                    add(label.to_owned(), &|s| {
                        s.scene.accuracy.contact_scalar = scalar
                    });
                }
            }
            Axis::Quadrature => {
                for (label, rule) in [
                    ("fast", QuadratureRule::Fast),
                    ("converged", QuadratureRule::Converged),
                ] {
                    add(label.to_owned(), &|s| s.scene.part.quadrature = rule);
                }
            }
            Axis::Preset => {
                for preset in [Preset::Fast, Preset::Balanced, Preset::Exact] {
                    add(preset.name().to_owned(), &|s| {
                        set_accuracy(&mut s.scene, Accuracy::of(Some(preset)));
                        if preset == Preset::Exact {
                            set_order(&mut s.scene, 3);
                        }
                    });
                }
            }
        }
    }
    all
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

fn within(radius: f64) -> String {
    format!("within {} mm", short(1e3 * radius))
}

/// To two digits: radii that are read easily.
fn rounded(length: f64) -> f64 {
    if length == 0.0 {
        return 0.0;
    }
    let unit = 10f64.powf(length.log10().floor() - 1.0);
    (length / unit).round() * unit
}
