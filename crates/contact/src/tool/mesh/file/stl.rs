//! STL, binary and text.
//!
//! A binary file is known by its length, 84 + 50 n bytes: many begin with "solid" as text does. Facet normals are not
//! used (programs write zeros and NaN there), only the corners.

use glam::DVec3;

use super::{Soup, decode, lines, point};

/// Bytes of a binary file before its first facet: a free text and the number of facets.
const HEADER: usize = 84;
/// Bytes of a facet: normal, three corners, an attribute.
const FACET: usize = 50;

pub(super) fn parse(bytes: &[u8]) -> Result<Soup, String> {
    let facets = match bytes.get(80..HEADER) {
        Some(&[a, b, c, d]) => u32::from_le_bytes([a, b, c, d]),
        _ => 0,
    };
    let expected = HEADER as u64 + FACET as u64 * u64::from(facets);
    let length = bytes.len() as u64;
    if bytes.len() >= HEADER && length == expected {
        return binary(&bytes[HEADER..], facets as usize);
    }
    if is_text(bytes) {
        return text(&decode(bytes));
    }
    if bytes.len() < HEADER {
        return Err(format!(
            "is no STL file: {length} bytes that do not begin with \"solid\""
        ));
    }
    // Some programs add bytes of their own behind the last facet.
    if facets > 0 && length > expected {
        return binary(&bytes[HEADER..], facets as usize);
    }
    Err(format!(
        "announces {facets} triangles, which take {expected} bytes, and has {length}; it is cut short or no STL file"
    ))
}

/// Whether the words of text are there and the zeros of binary numbers are not.
fn is_text(bytes: &[u8]) -> bool {
    /// Bytes that are looked at.
    const START: usize = 4096;
    let start = &bytes[..bytes.len().min(START)];
    let is_utf_16 = matches!(start, [0xff, 0xfe, ..] | [0xfe, 0xff, ..]);
    let start_text = decode(start).to_ascii_lowercase();
    let has_word = start_text.trim_start().starts_with("solid") || start_text.contains("facet");
    has_word && (is_utf_16 || !start.contains(&0))
}

fn binary(facets: &[u8], n_facets: usize) -> Result<Soup, String> {
    let (facets, _) = facets.as_chunks::<FACET>();
    let mut vertices = Vec::with_capacity(3 * n_facets);
    for (number, facet) in facets.iter().take(n_facets).enumerate() {
        let (numbers, _) = facet.as_chunks::<4>();
        let numbers = &numbers[3..12];
        let (corners, _) = numbers.as_chunks::<3>();
        for corner in corners {
            let corner = DVec3::from_array(corner.map(|x| f64::from(f32::from_le_bytes(x))));
            if !corner.is_finite() {
                return Err(format!(
                    "triangle {} has a corner that is not finite; repair the mesh",
                    number + 1
                ));
            }
            vertices.push(corner);
        }
    }
    Ok(soup(vertices))
}

/// Every three vertices are a triangle.
fn soup(vertices: Vec<DVec3>) -> Soup {
    let triangles = (0..vertices.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
    let triangles = triangles.collect();
    (vertices, triangles)
}

fn text(text: &str) -> Result<Soup, String> {
    let mut facets = Facets::default();
    for (number, line) in lines(text).enumerate() {
        facets
            .line(line)
            .map_err(|what| format!("line {}: {what}", number + 1))?;
    }
    match facets.place {
        Place::Between | Place::AfterLoop => Ok(soup(facets.vertices)),
        Place::Normal | Place::Loop => Err("ends within a facet; it is cut short".to_owned()),
    }
}

/// Corners of the facets so far, of all solids of the file.
#[derive(Default)]
struct Facets {
    vertices: Vec<DVec3>,
    n_corners: usize,
    place: Place,
}

/// Where in the text we are.
#[derive(Default, Clone, Copy)]
enum Place {
    /// Among lines that begin or end a solid and hold its name, which may be any words.
    #[default]
    Between,
    /// Behind `facet`.
    Normal,
    /// Behind `outer`.
    Loop,
    /// Behind `endloop`.
    AfterLoop,
}

impl Facets {
    fn line(&mut self, line: &str) -> Result<(), String> {
        let is_space = |c: char| c.is_whitespace() || c == '\u{feff}';
        let words = line.split(is_space).filter(|word| !word.is_empty());
        let mut words = words.peekable();
        let mut is_first = true;
        while let Some(word) = words.next() {
            let is = |other: &str| word.eq_ignore_ascii_case(other);
            let next_is = |next: Option<&&str>, other: &str| {
                next.is_some_and(|next| next.eq_ignore_ascii_case(other))
            };
            let ends = |what: &str, next: Option<&&str>| {
                is(&format!("end{what}")) || (is("end") && next_is(next, what))
            };
            match self.place {
                Place::Between => {
                    // A name may hold the word.
                    if is("facet") && (is_first || next_is(words.peek(), "normal")) {
                        self.place = Place::Normal;
                    } else if is("vertex") && is_first {
                        return Err("a vertex outside of a facet".to_owned());
                    }
                }
                Place::Normal => {
                    if is("outer") || is("outerloop") {
                        self.place = Place::Loop;
                        self.n_corners = 0;
                    } else if is("vertex") || is("facet") || ends("facet", words.peek()) {
                        return Err("a facet needs \"outer loop\" before its corners".to_owned());
                    }
                }
                Place::Loop => {
                    if is("vertex") {
                        self.vertices.push(point(&mut words, "vertex")?);
                        self.n_corners += 1;
                    } else if ends("loop", words.peek()) {
                        self.end_of_loop()?;
                    } else if !is("loop") {
                        return Err(format!("{word:?} where \"vertex\" was expected"));
                    }
                }
                Place::AfterLoop => {
                    if is("facet") {
                        self.place = Place::Normal;
                    } else if ends("facet", words.peek()) || ends("solid", words.peek()) {
                        self.place = Place::Between;
                    } else if !is("loop") {
                        return Err(format!("{word:?} where \"endfacet\" was expected"));
                    }
                }
            }
            is_first = false;
        }
        Ok(())
    }

    fn end_of_loop(&mut self) -> Result<(), String> {
        if self.n_corners != 3 {
            return Err(format!(
                "a facet with {} corners; STL has triangles only",
                self.n_corners
            ));
        }
        self.place = Place::AfterLoop;
        Ok(())
    }
}
