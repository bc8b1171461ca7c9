//! Finished settings kept in files, so that an interrupted study goes on where it was; and references
//! in files.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::compare::Reference;
use super::measure::Measured;
use super::point::Setting;
use crate::Error;
use crate::prepare::load;
use crate::scene::Scene;
use crate::{leftovers, setup};

/// Changes when what is stored of a setting means something else. Since 2, what was not timed has no times; before, it
/// had 0 µs.
const FORMAT: u32 = 3;

/// The same of a reference in a file.
const REFERENCE_FORMAT: u32 = 2;

/// What a scene is, whatever its settings of accuracy: a hash of mesh, material, supports, contact,
/// tool, path, coupling and friction.
///
/// # Errors
/// A mesh that cannot be read.
pub(super) fn identity(scene: &Scene) -> Result<String, Error> {
    let read = |path: &Path| fs::read(path).map_err(Error::io(path, "read"));
    let mut hash = blake3::Hasher::new();
    hash.update(&read(&scene.part.mesh)?);
    if let crate::scene::ToolShape::Mesh { file, .. } = &scene.tool.shape {
        hash.update(&read(file)?);
    }
    let groups: Vec<_> = scene
        .part
        .fixed
        .iter()
        .map(|f| (&f.group.name, f.components))
        .collect();
    let contact: Vec<_> = scene.part.contact.iter().map(|g| &g.name).collect();
    let material = &scene.part.material;
    let shape = match &scene.tool.shape {
        crate::scene::ToolShape::Mesh { scale, field, .. } => {
            format!("mesh {scale} {:?}", field.map(|field| field.error))
        }
        shape => format!("{shape:?}"),
    };
    let rest = format!(
        "{} {groups:?} {contact:?} {} {} {shape} {:?} {:?} {:?} {:?} {} {:?}",
        scene.length_scale,
        material.young_modulus,
        material.poisson_ratio,
        scene.tool.pose_part_tool,
        scene.handle,
        scene.drive,
        scene.hand.as_ref().map(|hand| hand.speed),
        scene.device.servo_period,
        scene.coupling,
    );
    hash.update(rest.as_bytes());
    if let Some(friction) = scene.effects.simulated_friction() {
        hash.update(format!("{friction:?}").as_bytes());
    }
    Ok(hash.finalize().to_hex()[..32].to_owned())
}

/// Settings that are done, one file each.
#[derive(Debug)]
pub(super) struct Store {
    folder: PathBuf,
    scene: String,
}

/// What a file holds.
#[derive(Serialize, Deserialize)]
struct Stored {
    format: u32,
    key: String,
    measured: Measured,
}

impl Store {
    pub(super) fn new(folder: &Path, scene: &str) -> Result<Self, Error> {
        fs::create_dir_all(folder).map_err(Error::io(folder, "create the folder of points"))?;
        leftovers::sweep_files(folder, |_, stem| is_hash(stem));
        Ok(Self {
            folder: folder.to_owned(),
            scene: scene.to_owned(),
        })
    }

    fn key(&self, setting: &Setting, timed_s: Option<f64>) -> String {
        let mesh = fs::read(&setting.scene.part.mesh).unwrap_or_default();
        format!(
            "{} {} {} {} {timed_s:?}",
            self.scene,
            env!("CARGO_PKG_VERSION"),
            blake3::hash(&mesh).to_hex(),
            setting.key()
        )
    }

    fn file(&self, key: &str) -> PathBuf {
        let name = &blake3::hash(key.as_bytes()).to_hex()[..HASH_DIGITS];
        self.folder.join(format!("{name}.json"))
    }

    /// A setting that is done already; a file that is damaged or of another version is not.
    pub(super) fn find(&self, setting: &Setting, timed_s: Option<f64>) -> Option<Measured> {
        let key = self.key(setting, timed_s);
        let text = fs::read_to_string(self.file(&key)).ok()?;
        let stored: Stored = serde_json::from_str(&text).ok()?;
        (stored.format == FORMAT && stored.key == key).then_some(stored.measured)
    }

    /// Keeps a setting, written beside and renamed.
    pub(super) fn keep(
        &self,
        setting: &Setting,
        timed_s: Option<f64>,
        measured: &Measured,
    ) -> Result<(), Error> {
        let key = self.key(setting, timed_s);
        let file = self.file(&key);
        let stored = Stored {
            format: FORMAT,
            key,
            measured: measured.clone(),
        };
        write(&file, &serde_json::to_string(&stored).unwrap_or_default())
    }
}

/// Writes beside and renames.
pub(super) fn write(file: &Path, text: &str) -> Result<(), Error> {
    leftovers::write_beside(file, text.as_bytes())
        .map_err(Error::io(file, "write (name another folder with --out)"))
}

/// Forgets what was finished; other files in the folder stay.
pub(super) fn forget(folder: &Path) {
    for path in points_in(folder) {
        let _ = fs::remove_file(path);
    }
}

/// Files of finished settings in a folder, by their names.
pub(super) fn points_in(folder: &Path) -> Vec<PathBuf> {
    let listed = fs::read_dir(folder).into_iter().flatten().flatten();
    listed
        .map(|entry| entry.path())
        .filter(|path| {
            let name = path.file_name().and_then(|name| name.to_str());
            name.and_then(|name| name.strip_suffix(".json"))
                .is_some_and(is_hash)
        })
        .collect()
}

fn is_hash(name: &str) -> bool {
    name.len() == HASH_DIGITS && name.bytes().all(|b| b.is_ascii_hexdigit())
}

/// Of a setting's key, in the name of its file.
const HASH_DIGITS: usize = 24;

/// A reference as a file.
#[derive(Serialize, Deserialize)]
struct ReferenceFile {
    format: u32,
    scene: String,
    title: String,
    reference: Reference,
}

/// Writes a reference for other runs.
pub(super) fn save_reference(
    file: &Path,
    scene: &Scene,
    identity: &str,
    reference: &Reference,
) -> Result<(), Error> {
    let content = ReferenceFile {
        format: REFERENCE_FORMAT,
        scene: identity.to_owned(),
        title: scene.title.clone(),
        reference: reference.clone(),
    };
    write(file, &serde_json::to_string(&content).unwrap_or_default())
}

/// Reads a reference of this scene.
///
/// # Errors
/// A file that cannot be read, is none, or belongs to another scene.
pub(super) fn read_reference(
    file: &Path,
    scene: &Scene,
    identity: &str,
    n_places: usize,
) -> Result<Reference, Error> {
    let text = fs::read_to_string(file).map_err(Error::io(file, "read the reference"))?;
    let refuse = |what: String| Error::Input(format!("{}: {what}", file.display()));
    let content: ReferenceFile = serde_json::from_str(&text).map_err(|e| {
        refuse(format!(
            "is no reference of `snapin accuracy` ({e}); write one with --save-reference"
        ))
    })?;
    if content.format != REFERENCE_FORMAT {
        return Err(refuse(format!(
            "has format {}, this version reads {REFERENCE_FORMAT}; write it anew with --save-reference",
            content.format
        )));
    }
    if content.scene != identity {
        return Err(refuse(format!(
            "is the reference of another scene ({:?}, this one is {:?}): mesh, material, supports, tool, \
             path, coupling or friction differ; write one for this scene with --save-reference",
            content.title, scene.title
        )));
    }
    let reference = content.reference;
    let is_whole = reference.wrench.len() == n_places
        && reference.potential.len() == n_places
        && reference
            .wrench
            .iter()
            .flatten()
            .chain(&reference.potential)
            .all(|x| x.is_finite());
    if !is_whole {
        return Err(refuse(format!(
            "should hold {n_places} finite wrenches and energies; write it anew with --save-reference"
        )));
    }
    Ok(reference)
}

/// Order of the elements in the mesh file.
pub(super) fn own_order(scene: &Scene) -> Result<u8, Error> {
    let mut spec = setup::part_spec(scene)?;
    spec.order = None;
    Ok(load(&spec)?.mesh.order as u8)
}
