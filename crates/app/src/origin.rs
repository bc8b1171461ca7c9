//! When a run is made, and from which files.

use std::path::Path;
use std::time::SystemTime;

use crate::Error;
use crate::report::{InputFile, Origin};
use crate::scene::{Scene, ToolShape};

/// The clock's time, and the hashes of scene, mesh and tool file. `mesh_hash`: that of the mesh as it was read; without it the
/// file is read here.
///
/// # Errors
/// If a file cannot be read again.
pub(crate) fn read(scene: &Scene, mesh_hash: Option<[u8; 32]>) -> Result<Origin, Error> {
    let input = |kind, path: &Path, hash| InputFile {
        kind,
        name: name_of(path),
        hash,
    };
    let of = |bytes: &[u8]| *blake3::hash(bytes).as_bytes();
    let read = |path: &Path, what| std::fs::read(path).map_err(Error::io(path, what));
    let mesh = &scene.part.mesh;
    let mesh_hash = match mesh_hash {
        Some(hash) => hash,
        None => of(&read(mesh, "read the mesh")?),
    };
    let mut inputs = vec![
        input("scene", &scene.path, of(scene.source.as_bytes())),
        input("mesh", mesh, mesh_hash),
    ];
    if let ToolShape::Mesh { file, .. } = &scene.tool.shape {
        inputs.push(input("tool", file, of(&read(file, "read the tool")?)));
    }
    Ok(Origin {
        made: humantime::format_rfc3339_seconds(SystemTime::now()).to_string(),
        inputs,
    })
}

/// Last part of a path, as text.
fn name_of(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}
