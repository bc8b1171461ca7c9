//! A scene in the terms of the crates: the one place that maps keys of the file to settings of
//! `fem`, `contact`, `device` and the engine.

use std::path::Path;
use std::sync::Arc;

use contact::lcp;
use contact::surface::Surface;
use contact::tool::{
    BoxShape, Capsule, Cylinder, DistanceField, Features, HalfSpace, Mesh as ToolMesh, MeshRepair,
    Sphere, Tool,
};
use device::driver::simulated::Model;
use device::{HandSettings, VirtualCoupling};
use fem::{Material, Quadrature};
use glam::DVec3;

use crate::Error;
use crate::drive::DriveSpec;
use crate::engine::{ContactIterations, ContactPlaces, Engine, EngineSettings, Plan};
use crate::machine::Machine;
use crate::prepare::budget::bytes;
use crate::prepare::{ColumnChoice, GroupRef, PartSpec, PreparedPart};
use crate::scene::{self, Adaptive, ContactAt, QuadratureRule, Scene, ToolFeatures, ToolShape};
use crate::session::rates::Rates;
use crate::session::{Clearance, Held, Holds, SessionSpec, part_extent};

/// The part of a scene.
///
/// # Errors
/// A material that `fem` refuses (the scene's own checks are the same).
pub fn part_spec(scene: &Scene) -> Result<PartSpec, Error> {
    let place = |line: usize| format!("{}:{line}", scene.path.display());
    let group = |g: &scene::GroupName| GroupRef {
        name: g.name.clone(),
        place: place(g.line),
    };
    let material = &scene.part.material;
    // What draws between nodes needs all columns.
    let is_plain = scene.accuracy.adaptive == Adaptive::Off;
    Ok(PartSpec {
        mesh_path: scene.part.mesh.clone(),
        length_scale: scene.length_scale,
        order: scene.part.order,
        interior_order: scene.part.interior_order,
        refinements: 0,
        columns: match scene.accuracy.columns {
            scene::Columns::Auto if is_plain => ColumnChoice::Auto,
            scene::Columns::Near if is_plain => ColumnChoice::Near,
            _ => ColumnChoice::All,
        },
        contact_scalar: scalar(scene.accuracy.contact_scalar),
        material: Material::new(material.young_modulus, material.poisson_ratio)
            .map_err(|e| Error::part(&scene.path, e))?,
        fixed: scene
            .part
            .fixed
            .iter()
            .map(|f| (group(&f.group), f.components))
            .collect(),
        contact: scene.part.contact.iter().map(group).collect(),
        quadrature: match scene.part.quadrature {
            QuadratureRule::Fast => Quadrature::Fast,
            QuadratureRule::Converged => Quadrature::Converged,
        },
    })
}

/// Number type in the words of the multiply.
pub(crate) fn scalar(scalar: scene::Scalar) -> gpu::Scalar {
    match scalar {
        scene::Scalar::F64 => gpu::Scalar::F64,
        scene::Scalar::F32 => gpu::Scalar::F32,
    }
}

/// The tool of a scene, with remarks on what was mended in its mesh.
///
/// # Errors
/// A tool mesh that cannot be read or is not a closed surface.
pub fn tool(scene: &Scene) -> Result<(Tool, Vec<String>), Error> {
    let in_scene = |source| Error::Tool {
        path: scene.path.clone(),
        source,
    };
    let tool = match &scene.tool.shape {
        ToolShape::Sphere { radius } => Sphere::new(*radius).map(Tool::Sphere).map_err(in_scene)?,
        ToolShape::Cylinder {
            radius,
            half_length,
        } => Cylinder::new(*radius, *half_length)
            .map(Tool::Cylinder)
            .map_err(in_scene)?,
        ToolShape::Box { half_extents } => BoxShape::new(*half_extents)
            .map(Tool::Box)
            .map_err(in_scene)?,
        ToolShape::Capsule {
            radius,
            half_length,
        } => Capsule::new(*radius, *half_length)
            .map(Tool::Capsule)
            .map_err(in_scene)?,
        ToolShape::HalfSpace => Tool::HalfSpace(HalfSpace),
        ToolShape::Mesh {
            file,
            line,
            scale,
            field,
        } => {
            let (tool, mut remarks) = tool_mesh(scene, file, *line, *scale)?;
            let tool = match field {
                Some(field) => with_field(scene, tool, *field, &mut remarks)?,
                None => tool,
            };
            return Ok((tool, remarks));
        }
    };
    Ok((tool, Vec::new()))
}

fn tool_mesh(
    scene: &Scene,
    file: &Path,
    line: usize,
    scale: f64,
) -> Result<(Tool, Vec<String>), Error> {
    let mesh = ToolMesh::read(file, scale).map_err(|e| {
        let what = match e {
            contact::Error::MeshFile { cause, .. } => cause,
            other => other.to_string(),
        };
        Error::Input(format!(
            "{}:{line}: tool.file {}: {what}",
            scene.path.display(),
            file.display()
        ))
    })?;
    let remarks = repairs(mesh.repair(), scene.length_unit())
        .map(|what| format!("{}: {what}", file.display()))
        .collect();
    Ok((Tool::Mesh(Arc::new(mesh)), remarks))
}

/// What the reader of a mesh changed, in words. Equal corner points, which every STL file has, are not worth any.
fn repairs(repair: MeshRepair, (unit, metres): (&str, f64)) -> impl Iterator<Item = String> {
    let counts = [
        (
            repair.n_removed_triangles,
            "triangles without area were removed".to_owned(),
        ),
        (
            repair.n_welded_vertices,
            format!(
                "corner points, apart by round-off, became one with their neighbour; none moved by more than {:.1e} {unit}",
                repair.weld_distance / metres
            ),
        ),
        (
            repair.n_turned_triangles,
            "triangles were turned to face the same way".to_owned(),
        ),
        (
            repair.n_inverted_pieces,
            "pieces were turned inside out to face outwards".to_owned(),
        ),
    ];
    counts
        .into_iter()
        .filter(|(n, _)| *n > 0)
        .map(|(n, what)| format!("{n} {what}"))
}

/// The tool behind a distance field, with a remark on what it holds.
fn with_field(
    scene: &Scene,
    tool: Tool,
    field: scene::FieldOf,
    remarks: &mut Vec<String>,
) -> Result<Tool, Error> {
    /// Of the tool's size, the distance at which the field still answers; beyond, a node is asked for once in
    /// many steps.
    const BAND_SHARE: f64 = 0.02;
    /// Of the memory that is free.
    const MEMORY_SHARE: f64 = 0.25;
    let band = (BAND_SHARE * tool.characteristic_size()).max(4.0 * field.error);
    let max_bytes = MEMORY_SHARE * Machine::read().available_memory as f64;
    let built = DistanceField::new(tool, field.error, band, max_bytes as usize).map_err(|e| {
        Error::Input(format!(
            "{}:{}: tool.field_error: {e}",
            scene.path.display(),
            field.line
        ))
    })?;
    remarks.push(format!(
        "distance field of the tool: {} in {} cells, {:.1} % of which ask the mesh; wrong by {:e} m at most",
        bytes(built.bytes() as f64),
        built.n_cells(),
        100.0 * built.exact_share(),
        built.error_bound(),
    ));
    Ok(Tool::Field(Arc::new(built)))
}

/// The engine of a scene's session: handle and tool are joined by the virtual coupling.
///
/// # Errors
/// Settings that the crates refuse; a distance of near nodes beyond the part's size.
pub fn engine(scene: &Scene, prepared: &PreparedPart, tool: Tool) -> Result<Engine, Error> {
    let coupling = Some(coupling(scene)?);
    let plan = plan(scene, prepared, tool, coupling, scene.accuracy.max_contacts)?;
    built(scene, plan)
}

/// The engine of a live session: as that of a script, but a half or quarter of a part keeps the held body on its axis.
///
/// # Errors
/// As [`engine`].
pub fn live_engine(scene: &Scene, prepared: &PreparedPart, tool: Tool) -> Result<Engine, Error> {
    let rail = live_rail(scene);
    let held = held(scene, prepared, &tool);
    let coupling = Some(coupling(scene)?);
    let plan = plan(scene, prepared, tool, coupling, scene.accuracy.max_contacts)?;
    let rail = rail.map(|direction| held.way_of_tool(direction));
    built(scene, Plan { rail, ..plan })
}

/// Unit, world: the axis that a held body stays on in a live session. A part that is held in some directions alone is
/// cut at a plane of symmetry; what the other half would balance pushes the tool aside, and no hand is there for it.
pub fn live_rail(scene: &Scene) -> Option<DVec3> {
    let mut fixed = scene.part.fixed.iter();
    let is_cut = fixed.any(|group| group.components != [true; 3]);
    let is_guided = scene.drive.guide == scene::Guide::Axis;
    (is_cut && is_guided).then_some(scene.drive.direction)
}

/// The engine of the part's own curve: the tool's pose is imposed, or guided along the direction. `max_contacts`: rows of
/// a contact problem at most, in place of the scene's.
///
/// # Errors
/// As [`engine`].
pub fn drive_engine(
    scene: &Scene,
    prepared: &PreparedPart,
    tool: Tool,
    max_contacts: usize,
) -> Result<Engine, Error> {
    let held = held(scene, prepared, &tool);
    let coupling = match scene.drive.guide {
        scene::Guide::Axis => None,
        scene::Guide::Free => Some(coupling(scene)?),
    };
    let plan = plan(scene, prepared, tool, coupling, max_contacts)?;
    let guide = Some(held.way_of_tool(scene.drive.direction));
    built(scene, Plan { guide, ..plan })
}

fn coupling(scene: &Scene) -> Result<VirtualCoupling, Error> {
    Ok(VirtualCoupling::new(
        scene.coupling.translational_stiffness,
        scene.coupling.rotational_stiffness,
    )?)
}

fn built(scene: &Scene, plan: Plan) -> Result<Engine, Error> {
    Engine::new(plan).map_err(|source| Error::Tool {
        path: scene.path.clone(),
        source,
    })
}

/// What a scene calls for.
fn plan(
    scene: &Scene,
    prepared: &PreparedPart,
    tool: Tool,
    coupling: Option<VirtualCoupling>,
    max_contacts: usize,
) -> Result<Plan, Error> {
    let extent = part_extent(&prepared.loaded.mesh);
    if let Some(near) = scene.accuracy.near_distance.filter(|near| *near > extent) {
        return Err(Error::Input(format!(
            "{}: accuracy.near_distance of {near} m is more than the whole part measures ({extent:.3} m), so every node \
             would get a contact plane; leave it out, or write some thousandths of the tool's size",
            scene.path.display(),
        )));
    }
    let size = extent.min(tool.characteristic_size());
    let settings = EngineSettings {
        contact_iterations: match scene.accuracy.contact_iterations {
            scene::ContactIterations::Converged => ContactIterations::Converged,
            scene::ContactIterations::Times(n) => ContactIterations::Fixed(n),
        },
        displacement_tolerance: DISPLACEMENT_TOLERANCE.min(TOLERANCE_SHARE * extent),
        near_distance: scene.accuracy.near_distance.unwrap_or(NEAR_SHARE * size),
        max_contacts,
        merge_tolerance: scene.accuracy.merge_tolerance,
        lcp: lcp::Settings::default(),
        max_stride: STRIDE_SHARE * size,
    };
    let grip = held(scene, prepared, &tool).engine_grip();
    let plan = Plan {
        grip,
        friction: scene.effects.simulated_friction(),
        ..Plan::new(prepared.contact_part(), tool, coupling, settings)
    };
    with_contact(scene, prepared, plan)
}

/// The plan with contact where the scene wants it: at places that move, and at the tool's corners and edges.
///
/// # Errors
/// A scene that insists on what is not there.
pub fn with_contact(scene: &Scene, prepared: &PreparedPart, plan: Plan) -> Result<Plan, Error> {
    let surface = contact_surface(scene, prepared)?;
    Ok(Plan {
        places: contact_places(scene, surface.as_ref())?,
        features: tool_features(scene, surface.as_ref(), &plan.tool)?,
        ..plan
    })
}

/// The part's faces that can touch; `None` where its contact groups are loose nodes.
fn contact_surface(scene: &Scene, prepared: &PreparedPart) -> Result<Option<Arc<Surface>>, Error> {
    let surface = prepared.contact_surface();
    let surface = surface.map_err(|source| Error::Tool {
        path: scene.path.clone(),
        source,
    })?;
    Ok(surface.map(Arc::new))
}

/// Where contact acts on the part.
fn contact_places(scene: &Scene, surface: Option<&Arc<Surface>>) -> Result<ContactPlaces, Error> {
    match (scene.accuracy.contact_at, surface) {
        (ContactAt::Nodes, _) => Ok(ContactPlaces::Nodes),
        (ContactAt::Places, Some(surface)) => Ok(ContactPlaces::Moving(Arc::clone(surface))),
        (ContactAt::Places, None) => Err(Error::Input(format!(
            "{}: accuracy.contact_at is \"places\", but the contact groups of the mesh have no faces; name a group of \
             faces in part.contact, or write \"nodes\"",
            scene.path.display()
        ))),
    }
}

/// The part's faces and the tool's corners and edges, where the scene wants them to touch and there are both.
fn tool_features(
    scene: &Scene,
    surface: Option<&Arc<Surface>>,
    tool: &Tool,
) -> Result<Option<(Arc<Surface>, Features)>, Error> {
    /// Of the smallest face, the distance of the points on an edge: the edge then meets each face in one at least.
    const SPACING_SHARE: f64 = 0.5;
    let insists = match scene.accuracy.tool_features {
        ToolFeatures::Off => return Ok(None),
        ToolFeatures::Auto => None,
        ToolFeatures::On { line } => Some(line),
    };
    let missing = |what: &str| match insists {
        Some(line) => Err(Error::Input(format!(
            "{}:{line}: accuracy.tool_features is \"on\", but {what}; use \"auto\" or leave the key out",
            scene.path.display()
        ))),
        None => Ok(None),
    };
    let in_scene = |source| Error::Tool {
        path: scene.path.clone(),
        source,
    };
    if !Features::has_some(tool) {
        return missing("the tool has neither corners nor sharp edges");
    }
    let Some(surface) = surface else {
        return missing("the contact groups of the mesh have no faces");
    };
    let sizes = (0..surface.n_faces()).map(|face| surface.size(face));
    let spacing = SPACING_SHARE * sizes.fold(f64::INFINITY, f64::min);
    let features = Features::new(tool, spacing).map_err(in_scene)?;
    Ok(features.map(|features| (Arc::clone(surface), features)))
}

/// m. A nanometre on a part of 10 kN/m is a hundred-thousandth of a newton.
const DISPLACEMENT_TOLERANCE: f64 = 1e-9;
/// Of the part's diagonal: what a nanometre is on 10 mm. On a smaller part it would show.
const TOLERANCE_SHARE: f64 = 1e-7;

/// Share of the tool's size within which a node gets a plane: 4 um on a tube of 20 mm. A node that
/// comes in from farther away gets its plane one pass later; fewer rows save more than that costs.
const NEAR_SHARE: f64 = 0.0004;

/// Share of the tool's size that the tool moves in one go.
const STRIDE_SHARE: f64 = 0.02;

/// The body of a scene that is held, and where.
pub fn held(scene: &Scene, prepared: &PreparedPart, tool: &Tool) -> Held {
    let holds = match scene.handle {
        scene::Handle::Tool => Holds::Tool,
        scene::Handle::Part => Holds::Part,
    };
    let mesh = &prepared.loaded.mesh;
    let centred = Held::centred(holds, scene.tool.pose_part_tool, tool, mesh);
    Held {
        grip: scene.grip.unwrap_or(centred.grip),
        ..centred
    }
}

/// Whether the tool of a scene may start in the part.
pub fn clearance(scene: &Scene) -> Clearance {
    Clearance {
        may_overlap: scene.tool.start == scene::Start::Overlap,
        length_unit: scene.length_unit(),
    }
}

/// The way of a scene's held body in the part's own curve.
pub fn drive(scene: &Scene, held: Held) -> DriveSpec {
    let drive = &scene.drive;
    DriveSpec {
        held,
        direction: drive.direction,
        travel: drive.travel,
        step: drive.step,
        retract: drive.retract,
    }
}

/// The scripted session of a scene that has a hand.
pub fn session(scene: &Scene, held: Held) -> Option<SessionSpec> {
    let hand = scene.hand.as_ref()?;
    Some(SessionSpec {
        held,
        clearance: clearance(scene),
        direction: hand.direction,
        speed: hand.speed,
        travel: hand.travel,
        hold_s: hand.hold,
        retract: hand.retract,
        hand: HandSettings {
            apparent_mass: hand.mass,
            grip_stiffness: hand.stiffness,
            grip_damping: hand.damping,
            apparent_inertia: hand.rotational_inertia,
            grip_rotational_stiffness: hand.rotational_stiffness,
            grip_rotational_damping: hand.rotational_damping,
        },
        model: model(scene),
        period_s: scene.device.servo_period,
        real_time: scene.device.real_time,
        rates: rates(scene),
    })
}

/// A session in real time with that hand; where the scene has none, with one that goes its own curve's way.
pub fn live_session(scene: &Scene, held: Held, period_s: f64) -> SessionSpec {
    /// m/s, of a hand that nobody described: slow enough to feel where the force turns.
    const SPEED: f64 = 0.01;
    let described = session(scene, held).unwrap_or_else(|| SessionSpec {
        held,
        clearance: clearance(scene),
        direction: scene.drive.direction,
        speed: SPEED,
        travel: scene.drive.travel,
        hold_s: 0.5,
        retract: scene.drive.retract,
        hand: HandSettings::default(),
        model: model(scene),
        period_s,
        real_time: true,
        rates: rates(scene),
    });
    SessionSpec {
        period_s,
        real_time: true,
        ..described
    }
}

/// The simulated device; `None` for the paper's figures alone.
fn model(scene: &Scene) -> Option<&'static Model> {
    match scene.device.model {
        scene::DeviceModel::Virtuose6d => None,
        other => Model::named(other.key()).ok(),
    }
}

fn rates(scene: &Scene) -> Rates {
    match scene.accuracy.rates {
        scene::Rates::Auto => Rates::Auto,
        scene::Rates::One => Rates::One,
        scene::Rates::Every(n) => Rates::Every(n),
    }
}
