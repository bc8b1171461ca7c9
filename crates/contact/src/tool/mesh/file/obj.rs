//! OBJ: vertices and polygons. Names, materials, normals, curves and points say nothing about the shape.

use super::polygon::{self, Fault};
use super::{Soup, decode, lines, point};

/// A polygon by its corners, from 0, and the line that it stands in.
struct Polygon {
    line: usize,
    corners: Vec<u32>,
}

pub(super) fn parse(bytes: &[u8]) -> Result<Soup, String> {
    let mut vertices = Vec::new();
    let mut polygons = Vec::new();
    let mut has_surfaces = false;
    for (line, text) in whole_lines(&decode(bytes)) {
        let at_line = |what: String| format!("line {line}: {what}");
        let mut words = text.split_whitespace();
        match words.next() {
            Some("v") => vertices.push(point(&mut words, "vertex").map_err(at_line)?),
            // `fo` is what a face was called in the format's first version.
            Some("f" | "fo") => {
                let corners = words.map(|word| corner(word, vertices.len()));
                let corners = corners.collect::<Result<_, _>>().map_err(at_line)?;
                polygons.push(Polygon { line, corners });
            }
            Some("surf") => has_surfaces = true,
            _ => {}
        }
    }
    if polygons.is_empty() && has_surfaces {
        return Err(
            "has free-form surfaces only, which are not read; export it as triangles".to_owned(),
        );
    }
    let mut triangles = Vec::new();
    for Polygon { line, corners } in polygons {
        let at_line = |what: String| format!("line {line}: {what}");
        let n_vertices = vertices.len();
        if let Some(corner) = corners
            .iter()
            .find(|corner| **corner as usize >= n_vertices)
        {
            return Err(at_line(format!(
                "a face names vertex {}, the file has {n_vertices}",
                u64::from(*corner) + 1
            )));
        }
        let cut = polygon::cut(&vertices, &corners).map_err(|fault| {
            at_line(match fault {
                Fault::NoArea => "a polygon without area; remove it".to_owned(),
                Fault::Crosses => {
                    "a polygon that crosses or touches itself; cut it into triangles".to_owned()
                }
            })
        })?;
        triangles.extend(cut);
    }
    Ok((vertices, triangles))
}

/// Lines without remarks, those that go on behind a backslash as one, with the number of the first.
fn whole_lines(text: &str) -> Vec<(usize, String)> {
    let mut whole: Vec<(usize, String)> = Vec::new();
    let mut goes_on = false;
    for (number, line) in lines(text).enumerate() {
        let is_remark = |(at, c): (usize, char)| {
            c == '#' && (at == 0 || line.as_bytes()[at - 1].is_ascii_whitespace())
        };
        let remark = line.char_indices().find(|found| is_remark(*found));
        let line = line[..remark.map_or(line.len(), |(at, _)| at)].trim();
        let (line, ends_in_backslash) = match line.strip_suffix('\\') {
            Some(line) => (line, true),
            None => (line, false),
        };
        match whole.last_mut() {
            Some((_, before)) if goes_on => {
                before.push(' ');
                before.push_str(line);
            }
            _ if line.is_empty() && !ends_in_backslash => {}
            _ => whole.push((number + 1, line.to_owned())),
        }
        goes_on = ends_in_backslash;
    }
    whole
}

/// Vertex of a face's corner, from 0: `7`, `7/2`, `7//3`, `7/2/3`, or counted back from the last one, `-1`.
fn corner(word: &str, n_vertices: usize) -> Result<u32, String> {
    let vertex = word.split('/').next().unwrap_or_default();
    let number: i64 = vertex
        .parse()
        .map_err(|_| format!("{word:?} is no corner of a face"))?;
    let from_zero = match number {
        1.. => number - 1,
        _ => n_vertices as i64 + number,
    };
    match u32::try_from(from_zero) {
        Ok(from_zero) if number != 0 => Ok(from_zero),
        _ => Err(format!(
            "a face names vertex {number}; there are {n_vertices} before it, counted from 1"
        )),
    }
}
