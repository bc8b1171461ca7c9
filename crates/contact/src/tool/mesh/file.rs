//! STL and OBJ files.

use std::io::BufReader;
use std::path::Path;

use glam::DVec3;

use crate::error::Error;

/// Vertices in the file's unit, triangles from 0.
pub(super) fn read(path: &Path) -> Result<(Vec<DVec3>, Vec<[u32; 3]>), Error> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    match extension.as_deref() {
        Some("stl") => read_stl(path),
        Some("obj") => read_obj(path),
        _ => Err(Error::MeshFormat {
            path: path.to_owned(),
        }),
    }
}

fn refused(path: &Path, cause: impl std::fmt::Display) -> Error {
    Error::MeshFile {
        path: path.to_owned(),
        cause: cause.to_string(),
    }
}

fn read_stl(path: &Path) -> Result<(Vec<DVec3>, Vec<[u32; 3]>), Error> {
    let file = std::fs::File::open(path).map_err(|e| refused(path, e))?;
    let mesh = stl_io::read_stl(&mut BufReader::new(file)).map_err(|e| refused(path, e))?;
    let vertices = mesh.vertices.iter();
    let vertices = vertices
        .map(|v| DVec3::from_array(v.0.map(f64::from)))
        .collect();
    let triangles = mesh.faces.iter();
    let triangles = triangles.map(|t| t.vertices.map(|v| v as u32)).collect();
    Ok((vertices, triangles))
}

fn read_obj(path: &Path) -> Result<(Vec<DVec3>, Vec<[u32; 3]>), Error> {
    let options = tobj::LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..tobj::LoadOptions::default()
    };
    let file = std::fs::File::open(path).map_err(|e| refused(path, e))?;
    // Materials are colours only.
    let no_materials = |_: &Path| Ok(Default::default());
    let (models, _) = tobj::load_obj_buf(&mut BufReader::new(file), &options, no_materials)
        .map_err(|e| refused(path, e))?;
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for model in models {
        let first = vertices.len() as u32;
        let (points, _) = model.mesh.positions.as_chunks::<3>();
        vertices.extend(points.iter().map(|p| DVec3::from_array(p.map(f64::from))));
        let (faces, _) = model.mesh.indices.as_chunks::<3>();
        triangles.extend(faces.iter().map(|t| t.map(|v| v + first)));
    }
    Ok((vertices, triangles))
}
