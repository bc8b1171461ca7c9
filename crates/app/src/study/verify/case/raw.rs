//! `case.toml` as it is written. Unknown keys are refused: a misspelt load would else be none.

use std::fmt;
use std::marker::PhantomData;
use std::path::Path;

use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

use crate::study::verify::Failure;
use crate::study::verify::files::wrong;

/// Kinds of cases that other programs have, by what they need.
const NOT_COMPUTED: [(&str, &str); 3] = [
    ("contact-nlgeom", "large displacement"),
    ("static-nlgeom", "large displacement"),
    ("gravity", "own weight"),
];

/// What a case asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(in crate::study::verify) enum Kind {
    Patch,
    Static,
    Convergence,
    Contact,
    #[serde(rename = "contact-friction")]
    ContactFriction,
    Error,
}

/// A table or a list of tables.
#[derive(Debug)]
pub(super) enum OneOrMore<T> {
    One(T),
    More(Vec<T>),
}

impl<T> OneOrMore<T> {
    pub(super) fn as_slice(&self) -> &[T] {
        match self {
            Self::One(x) => std::slice::from_ref(x),
            Self::More(list) => list,
        }
    }
}

/// By hand: an untagged enum would lose the line and the key of what is wrong.
impl<'de, T: Deserialize<'de>> Deserialize<'de> for OneOrMore<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Tables<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Tables<T> {
            type Value = OneOrMore<T>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a table or a list of tables")
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
                T::deserialize(MapAccessDeserializer::new(map)).map(OneOrMore::One)
            }
            fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Self::Value, A::Error> {
                Vec::deserialize(SeqAccessDeserializer::new(seq)).map(OneOrMore::More)
            }
        }
        deserializer.deserialize_any(Tables(PhantomData))
    }
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawMaterial {
    pub(super) group: Option<String>,
    #[serde(rename = "E")]
    pub(super) young_modulus: f64,
    pub(super) nu: f64,
    #[serde(rename = "name")]
    _name: Option<IgnoredAny>,
    #[serde(rename = "density")]
    _density: Option<IgnoredAny>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawFixed {
    pub(super) group: String,
    pub(super) components: Option<Vec<String>>,
}

/// A load on a group of faces.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::study::verify) struct Load {
    pub(in crate::study::verify) group: String,
    /// N, total, as a uniform dead traction.
    pub(in crate::study::verify) force: Option<[f64; 3]>,
    /// Pa, along the normal of the undeformed face, into the body.
    pub(in crate::study::verify) pressure: Option<f64>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawPrescribed {
    pub(super) group: String,
}

/// Polynomial displacement field: rows `[coefficient, i, j, k]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::study::verify) struct PolynomialField {
    pub(super) scale: f64,
    pub(super) length: f64,
    pub(super) x: Vec<[f64; 4]>,
    pub(super) y: Vec<[f64; 4]>,
    pub(super) z: Vec<[f64; 4]>,
}

/// Exact displacement of a thick cylinder, u = (A + B / r²) (x, y, 0).
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case)]
pub(in crate::study::verify) struct LameField {
    pub(super) A: f64,
    pub(super) B: f64,
    #[serde(rename = "inner_radius")]
    _inner_radius: Option<IgnoredAny>,
    #[serde(rename = "outer_radius")]
    _outer_radius: Option<IgnoredAny>,
    #[serde(rename = "pressure")]
    _pressure: Option<IgnoredAny>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawContact {
    pub(super) group: String,
    pub(super) friction: Option<f64>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::study::verify) struct RawTool {
    pub(in crate::study::verify) shape: String,
    pub(in crate::study::verify) radius: Option<f64>,
    pub(in crate::study::verify) half_length: Option<f64>,
    pub(in crate::study::verify) half_extents: Option<[f64; 3]>,
}

/// Pose of a tool, in the keys that suit its shape.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::study::verify) struct RawPose {
    #[serde(alias = "centre", alias = "center", alias = "point")]
    pub(in crate::study::verify) axis_point: [f64; 3],
    #[serde(alias = "normal")]
    pub(in crate::study::verify) axis_direction: Option<[f64; 3]>,
    /// rad, rotation vector of the step that leads here.
    pub(in crate::study::verify) turn: Option<[f64; 3]>,
}

/// How a path is walked from pose to pose.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawPath {
    /// Increments between two listed poses; values for each number.
    pub(super) substeps: Vec<i64>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawHandbook {
    pub(super) undercut: Option<f64>,
    #[serde(rename = "friction")]
    _friction: Option<IgnoredAny>,
    #[serde(rename = "lead_angle_deg")]
    _lead_angle_deg: Option<IgnoredAny>,
    #[serde(rename = "length")]
    _length: Option<IgnoredAny>,
    #[serde(rename = "thickness")]
    _thickness: Option<IgnoredAny>,
    #[serde(rename = "width")]
    _width: Option<IgnoredAny>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawCompare {
    pub(super) quantities: Vec<String>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawCase {
    pub(super) kind: Kind,
    pub(super) mesh: Option<String>,
    pub(super) meshes: Option<Vec<String>>,
    pub(super) order: Option<u8>,
    pub(super) geometry: Option<String>,
    pub(super) units: Option<String>,
    pub(super) contact_iterations: Option<toml::Value>,
    pub(super) material: OneOrMore<RawMaterial>,
    pub(super) fixed: Option<OneOrMore<RawFixed>>,
    #[serde(default)]
    pub(super) load: Vec<Load>,
    pub(super) prescribed: Option<RawPrescribed>,
    pub(super) field: Option<PolynomialField>,
    pub(super) lame: Option<LameField>,
    pub(super) contact: Option<RawContact>,
    pub(super) tool: Option<RawTool>,
    #[serde(default)]
    pub(super) pose: Vec<RawPose>,
    pub(super) path: Option<RawPath>,
    pub(super) handbook: Option<RawHandbook>,
    pub(super) compare: Option<RawCompare>,
    #[serde(rename = "title")]
    _title: Option<IgnoredAny>,
    #[serde(rename = "note")]
    _note: Option<IgnoredAny>,
    #[serde(rename = "geometry_mm")]
    _geometry_mm: Option<IgnoredAny>,
}

impl RawCase {
    /// Parses the text of the file.
    ///
    /// # Errors
    /// With file and line; a kind that is known and not computed is not supported.
    pub(super) fn parse(text: &str, path: &Path) -> Result<Self, Failure> {
        let at = |e: toml::de::Error| {
            let line = e
                .span()
                .and_then(|span| text.get(..span.start))
                .map_or(1, |before| 1 + before.matches('\n').count());
            let message = e.message().split_whitespace().collect::<Vec<_>>().join(" ");
            wrong(path, &format!("line {line}: {message}"))
        };
        // Such cases have keys of their own: the kind is what has to be said.
        let table: toml::Table = toml::from_str(text).map_err(at)?;
        let kind = table.get("kind").and_then(toml::Value::as_str);
        if let Some((kind, needs)) = NOT_COMPUTED.iter().find(|(name, _)| Some(*name) == kind) {
            return Err(Failure::NotSupported(format!(
                "kind {kind:?}; the program does not compute {needs}"
            )));
        }
        toml::from_str(text).map_err(at)
    }
}
