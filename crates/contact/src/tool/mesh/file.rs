//! STL and OBJ files.
//!
//! Read by hand: of the libraries at hand one takes text for binary unless it begins with "solid" and a space, the
//! other fans concave polygons out and stumbles over lines that say nothing about the shape.

mod obj;
mod polygon;
mod stl;

use std::path::Path;

use glam::DVec3;

use crate::error::Error;

/// Vertices in the file's unit, triangles from 0.
pub(super) type Soup = (Vec<DVec3>, Vec<[u32; 3]>);

pub(super) fn read(path: &Path) -> Result<Soup, Error> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let parse = match extension.as_deref() {
        Some("stl") => stl::parse,
        Some("obj") => obj::parse,
        _ => {
            return Err(Error::MeshFormat {
                path: path.to_owned(),
            });
        }
    };
    let refused = |cause: String| Error::MeshFile {
        path: path.to_owned(),
        cause,
    };
    let bytes = std::fs::read(path).map_err(|e| refused(e.to_string()))?;
    parse(&bytes).map_err(refused)
}

/// Text of a file whatever its encoding: only names, which are not used, hold more than ASCII.
fn decode(bytes: &[u8]) -> String {
    let utf_16 = |of_pair: fn([u8; 2]) -> u16| {
        let (pairs, _) = bytes[2..].as_chunks::<2>();
        String::from_utf16_lossy(&pairs.iter().map(|pair| of_pair(*pair)).collect::<Vec<_>>())
    };
    match bytes {
        [0xff, 0xfe, ..] => utf_16(u16::from_le_bytes),
        [0xfe, 0xff, ..] => utf_16(u16::from_be_bytes),
        [0xef, 0xbb, 0xbf, rest @ ..] => String::from_utf8_lossy(rest).into_owned(),
        _ => String::from_utf8_lossy(bytes).into_owned(),
    }
}

/// Lines that end as on any system.
fn lines(text: &str) -> std::str::Split<'_, char> {
    text.split(if text.contains('\n') { '\n' } else { '\r' })
}

/// The next three words as a finite point; `what` is named where it is none.
fn point<'a>(words: &mut impl Iterator<Item = &'a str>, what: &str) -> Result<DVec3, String> {
    let mut point = [0.0; 3];
    for x in &mut point {
        let Some(word) = words.next() else {
            return Err(format!("a {what} needs three numbers"));
        };
        *x = match word.parse::<f64>() {
            Ok(x) if x.is_finite() => x,
            Ok(_) => return Err(format!("a {what} is not finite")),
            Err(_) if word.contains(',') => {
                return Err(format!("{word:?} is no number; write a decimal point"));
            }
            Err(_) => return Err(format!("{word:?} is no number")),
        };
    }
    Ok(DVec3::from_array(point))
}

#[cfg(test)]
mod tests;
