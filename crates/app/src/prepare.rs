//! From a mesh to a part that can be touched: assembled, held, factored, condensed, checked, kept.
//!
//! The costly result, the compliance of the surface under forces on the nodes that can touch,
//! is cached under a hash of everything it depends on ([`cache`]); what it will need is told
//! before it is begun ([`budget`]).

pub mod budget;
pub mod cache;
mod demand;
mod interior;
mod load;
mod surface;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use fem::{
    Compliance, ComplianceChecks, FactoredStiffness, Material, Mesh, OrderedStiffness, Quadrature,
    Supports,
};
use glam::DVec3;
use gpu::Scalar;

use crate::Error;
use crate::engine::ContactPart;
use crate::progress::Ui;
use crate::stored::{Blocks, Source, StoredCompliance};
use budget::Forecast;
pub use demand::Demand;
pub use interior::Interior;
pub use load::load;

/// A physical group and who asks for it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GroupRef {
    /// Name of the group in the mesh.
    pub name: String,
    /// Who names it, for messages: file and line.
    pub place: String,
}

/// What is to be prepared: the part of a scene in plain terms.
#[derive(Clone, Debug)]
pub struct PartSpec {
    /// Gmsh mesh.
    pub mesh_path: PathBuf,
    /// Factor from mesh coordinates to metres.
    pub length_scale: f64,
    /// Order that the scene asks for; `None`: the mesh's own.
    pub order: Option<u8>,
    /// Order of the elements inside; `None`: that of the surface.
    pub interior_order: Option<u8>,
    /// How often each element is divided into eight, before the order is changed.
    pub refinements: u8,
    /// Elasticity.
    pub material: Material,
    /// Held groups and which of x, y, z is held.
    pub fixed: Vec<(GroupRef, [bool; 3])>,
    /// Groups of nodes that can touch the tool.
    pub contact: Vec<GroupRef>,
    /// Rule for the element integrals.
    pub quadrature: Quadrature,
    /// Which columns of the compliance are there from the start.
    pub columns: ColumnChoice,
    /// Numbers in which the compliance between candidates is kept for the step.
    pub contact_scalar: Scalar,
}

/// Which columns of the compliance are there from the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ColumnChoice {
    /// All if they fit into memory, those near the tool otherwise.
    #[default]
    Auto,
    /// All.
    All,
    /// Some; the others are fetched when the tool comes near.
    Near,
}

/// The compliance of a part.
#[derive(Debug)]
pub enum PreparedCompliance {
    /// Every candidate's column.
    All(StoredCompliance),
    /// Columns that are fetched when the tool comes near.
    Near(Arc<Demand>),
}

impl PreparedCompliance {
    /// Memory, bytes.
    pub fn bytes(&self) -> f64 {
        match self {
            Self::All(stored) => stored.bytes() as f64,
            Self::Near(demand) => demand.bytes(),
        }
    }

    /// The whole, if it is there.
    pub fn all(&self) -> Option<&StoredCompliance> {
        match self {
            Self::All(stored) => Some(stored),
            Self::Near(_) => None,
        }
    }
}

/// How to prepare.
#[derive(Clone, Debug, Default)]
pub struct PrepareOptions {
    /// Folder of cached parts; `None`: do not read or write any.
    pub cache_dir: Option<PathBuf>,
    /// Ignore what is cached and write it anew.
    pub rebuild: bool,
    /// What the folder may hold; beyond it, parts that were not used for the longest time go.
    pub cache_limit: cache::shelf::Limit,
}

/// A part that is read, held and checked, before its compliance is known.
#[derive(Debug)]
pub struct LoadedPart {
    /// What was asked for.
    pub spec: PartSpec,
    /// In metres.
    pub mesh: Mesh,
    /// Held degrees of freedom.
    pub supports: Supports,
    /// What is solved on, where that is not `mesh`.
    pub interior: Option<Interior>,
    /// Node indices that can touch and may move, ascending.
    pub candidates: Vec<u32>,
    /// Node indices that can touch and are held in all directions, ascending: obstacles that do not give way.
    pub held: Vec<u32>,
    /// Node indices of the whole surface, candidates first.
    pub rows: Vec<u32>,
    /// Lines about the mesh that the user should see.
    pub warnings: Vec<String>,
    pub(crate) mesh_hash: [u8; 32],
}

impl LoadedPart {
    /// Node of a candidate of the engine's part: first those that may move, then those that are held.
    pub fn contact_node(&self, candidate: u32) -> u32 {
        let candidate = candidate as usize;
        match candidate.checked_sub(self.candidates.len()) {
            None => self.candidates[candidate],
            Some(held) => self.held[held],
        }
    }

    /// m, of the held nodes that can touch.
    pub fn held_positions(&self) -> Vec<DVec3> {
        let places = self.held.iter();
        places
            .map(|&node| DVec3::from_array(self.mesh.nodes[node as usize]))
            .collect()
    }
}

/// A part with its compliance.
#[derive(Debug)]
pub struct PreparedPart {
    /// Mesh, supports and who can touch.
    pub loaded: LoadedPart,
    /// Surface displacement per force on the nodes that can touch.
    pub compliance: PreparedCompliance,
    /// What was checked after the build.
    pub checks: ComplianceChecks,
    /// Seconds by stage, in order; a cached part has only the reading.
    pub seconds: Vec<(&'static str, f64)>,
    /// Whether the compliance came from the cache.
    pub from_cache: bool,
    /// The cache file, if one is used.
    pub cache_file: Option<PathBuf>,
}

impl PreparedPart {
    /// Seconds altogether.
    pub fn total_seconds(&self) -> f64 {
        self.seconds.iter().map(|(_, s)| s).sum()
    }

    /// Bytes of what the step and the drawn shape read.
    pub fn bytes(&self) -> f64 {
        self.compliance.bytes()
    }

    /// What the engine needs of the part. Shares the compliance unless it is rounded to 32 bits.
    pub fn contact_part(&self) -> Arc<ContactPart> {
        let stored = match &self.compliance {
            PreparedCompliance::All(stored) => stored,
            PreparedCompliance::Near(demand) => return Arc::clone(demand.part()),
        };
        let rest: Vec<DVec3> = self
            .loaded
            .candidates
            .iter()
            .map(|&node| DVec3::from_array(self.loaded.mesh.nodes[node as usize]))
            .collect();
        let blocks = match self.loaded.spec.contact_scalar {
            Scalar::F64 => Blocks::F64(Source::Shared(Arc::clone(stored.contact()))),
            Scalar::F32 => Blocks::rounded(stored.contact()),
        };
        let held = self.loaded.held_positions();
        let n_rows = stored.n_candidates();
        Arc::new(ContactPart::with_all_and_held(rest, &held, n_rows, blocks))
    }
}

/// Loads the part and gets its compliance, from the cache or anew.
///
/// # Errors
/// As [`load`]; a part that does not fit into memory; a singular stiffness; checks that fail;
/// Ctrl-C.
pub fn prepare(
    spec: &PartSpec,
    options: &PrepareOptions,
    ui: &Ui<'_>,
) -> Result<PreparedPart, Error> {
    let begun = Instant::now();
    let loaded = load(spec)?;
    for warning in &loaded.warnings {
        ui.note(&format!("warning: {warning}"));
    }
    let mut seconds = vec![("read the mesh", begun.elapsed().as_secs_f64())];
    let (compliance, checks, cached) = compliance_of(&loaded, options, ui, &mut seconds)?;
    let (from_cache, cache_file) = match cached {
        Cached::Read(file) => (true, Some(file)),
        Cached::Written(file) => (false, Some(file)),
        Cached::No => (false, None),
    };
    Ok(PreparedPart {
        loaded,
        compliance,
        checks,
        seconds,
        from_cache,
        cache_file,
    })
}

/// Where a compliance came from and went to.
enum Cached {
    Read(PathBuf),
    Written(PathBuf),
    No,
}

/// The compliance from the cache, or built and kept; or as much of it as is there from the start.
fn compliance_of(
    loaded: &LoadedPart,
    options: &PrepareOptions,
    ui: &Ui<'_>,
    seconds: &mut Vec<(&'static str, f64)>,
) -> Result<(PreparedCompliance, ComplianceChecks, Cached), Error> {
    let forecast = Forecast::of(loaded);
    if forecast.fetches_columns(loaded) {
        return fetched(loaded, &forecast, ui, seconds);
    }
    let key = cache_key(loaded);
    let cache_file = options
        .cache_dir
        .as_ref()
        .map(|dir| cache::file_of(dir, &loaded.spec.mesh_path, &key));
    if let (Some(file), false) = (&cache_file, options.rebuild) {
        let reading = Instant::now();
        match cache::read(file, &key, loaded.candidates.len(), loaded.rows.len()) {
            Ok(Some((compliance, checks))) => {
                seconds.push(("read the cache", reading.elapsed().as_secs_f64()));
                cache::shelf::make_room(file, None, options.cache_limit, ui);
                let compliance = PreparedCompliance::All(compliance);
                return Ok((compliance, checks, Cached::Read(file.clone())));
            }
            Ok(None) => {}
            Err(why) => {
                ui.note(&format!(
                    "{}: {why}; the part is prepared anew",
                    file.display()
                ));
            }
        }
    }

    ui.note(&forecast.line(loaded));
    forecast.refuse_what_cannot_fit(loaded)?;

    let (compliance, checks, stages) = build(loaded, ui)?;
    seconds.extend(stages);
    let mut cached = Cached::No;
    if let Some(file) = cache_file {
        let coming = cache::size_of_file(loaded.candidates.len(), loaded.rows.len());
        cache::shelf::make_room(&file, Some(coming), options.cache_limit, ui);
        match cache::write(&file, &key, &compliance, &checks) {
            Ok(()) => {
                // From the file on, so that large parts are in memory once and can be given back to it.
                let read = cache::read(&file, &key, loaded.candidates.len(), loaded.rows.len());
                cached = Cached::Written(file);
                if let Ok(Some((mapped, checks))) = read {
                    return Ok((PreparedCompliance::All(mapped), checks, cached));
                }
            }
            Err(source) => ui.note(&format!(
                "{}: cannot keep the prepared part ({source}); the next run prepares it again \
                 (SNAPIN_CACHE names another folder)",
                file.display()
            )),
        }
    }
    let compliance = PreparedCompliance::All(StoredCompliance::new(compliance));
    Ok((compliance, checks, cached))
}

/// A part whose columns are fetched when the tool comes near. Its factor is not cached.
fn fetched(
    loaded: &LoadedPart,
    forecast: &Forecast,
    ui: &Ui<'_>,
    seconds: &mut Vec<(&'static str, f64)>,
) -> Result<(PreparedCompliance, ComplianceChecks, Cached), Error> {
    let capacity = forecast.columns_that_fit(loaded)?;
    ui.note(&forecast.fetched_line(loaded, capacity));
    let path = &loaded.spec.mesh_path;
    let progress = ui.progress();
    let mut lap = Instant::now();
    let mut done = |name| {
        seconds.push((name, lap.elapsed().as_secs_f64()));
        lap = Instant::now();
    };
    let stiffness = assemble(loaded)?;
    done("assemble the stiffness");
    let factor = FactoredStiffness::new(&stiffness, loaded.solved_supports(), &progress)
        .map_err(|e| Error::part(path, e))?;
    done("factor");
    // The checks of the whole, of some columns.
    let step = loaded.candidates.len().div_ceil(SAMPLE).max(1);
    let sample: Vec<u32> = loaded.candidates.iter().copied().step_by(step).collect();
    let sample = loaded.solved_nodes(&sample);
    let checks = Compliance::build(&factor, &sample, &sample, &progress)
        .and_then(|compliance| compliance.check(&stiffness, &factor))
        .map_err(|e| Error::part(path, e))?;
    done("checks");
    let demand = Demand::new(loaded, factor, capacity, loaded.spec.contact_scalar);
    done("compliance columns");
    Ok((
        PreparedCompliance::Near(Arc::new(demand)),
        checks,
        Cached::No,
    ))
}

/// Columns that are checked of a part that has not all of them.
const SAMPLE: usize = 32;

/// Stiffness of a loaded part, of the mesh that is solved on.
///
/// # Errors
/// As `fem` reports them, with the mesh's path.
pub fn assemble(loaded: &LoadedPart) -> Result<fem::Stiffness, Error> {
    let of_element = vec![0; loaded.mesh.n_elements()];
    fem::assemble_stiffness(
        loaded.solved_mesh(),
        std::slice::from_ref(&loaded.spec.material),
        &of_element,
        loaded.spec.quadrature,
    )
    .map_err(|e| Error::part(&loaded.spec.mesh_path, e))
}

type Built = (Compliance, ComplianceChecks, Vec<(&'static str, f64)>);

fn build(loaded: &LoadedPart, ui: &Ui<'_>) -> Result<Built, Error> {
    let path = &loaded.spec.mesh_path;
    let progress = ui.progress();
    let mut seconds = Vec::new();
    let mut lap = Instant::now();
    let mut done = |name, seconds: &mut Vec<(&'static str, f64)>| {
        seconds.push((name, lap.elapsed().as_secs_f64()));
        lap = Instant::now();
    };
    let stiffness = assemble(loaded)?;
    done("assemble the stiffness", &mut seconds);
    let ordered = OrderedStiffness::new(&stiffness, loaded.solved_supports(), &progress)
        .map_err(|e| Error::part(path, e))?;
    done("order the unknowns", &mut seconds);
    let factor = ordered
        .factor(&progress)
        .map_err(|e| Error::part(path, e))?;
    done("factor", &mut seconds);
    let (candidates, rows) = (
        loaded.solved_nodes(&loaded.candidates),
        loaded.solved_nodes(&loaded.rows),
    );
    let mut compliance = Compliance::build(&factor, &candidates, &rows, &progress)
        .map_err(|e| Error::part(path, e))?;
    done("compliance columns", &mut seconds);
    let checks = compliance
        .check(&stiffness, &factor)
        .map_err(|e| Error::part(path, e))?;
    done("checks", &mut seconds);
    compliance.candidates.clone_from(&loaded.candidates);
    compliance.rows.clone_from(&loaded.rows);
    Ok((compliance, checks, seconds))
}

/// Hash of all that the compliance depends on.
fn cache_key(loaded: &LoadedPart) -> [u8; 32] {
    let mut hash = blake3::Hasher::new();
    hash.update(&cache::FORMAT.to_le_bytes());
    hash.update(&loaded.mesh_hash);
    for x in [
        loaded.spec.length_scale,
        loaded.spec.material.young_modulus(),
        loaded.spec.material.poisson_ratio(),
    ] {
        hash.update(&x.to_bits().to_le_bytes());
    }
    hash.update(format!("{:?}", loaded.spec.quadrature).as_bytes());
    hash.update(&[loaded.mesh.order as u8, loaded.spec.refinements]);
    hash.update(&[loaded.solved_mesh().order as u8]);
    for dof in 0..3 * loaded.mesh.n_nodes() {
        hash.update(&[u8::from(loaded.supports.is_fixed(dof))]);
    }
    for nodes in [&loaded.candidates, &loaded.rows] {
        hash.update(&(nodes.len() as u64).to_le_bytes());
        hash.update(bytemuck::cast_slice(nodes));
    }
    *hash.finalize().as_bytes()
}
