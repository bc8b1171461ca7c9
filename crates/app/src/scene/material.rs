//! `[part.material]`: what the part is made of, by keys or by the name of a plastic that is known.
//!
//! Sources of the table: tensile modulus (ISO 527, 23 °C, at small strain) from the data sheet of the grade that is named;
//! Poisson's ratio (0.35 for plastics in general) and the strain that is permissible once from Bayer, "Snap-Fit Joints for
//! Plastics - A Design Guide". Others whose friction is known are not in it: their moduli differ by a factor of two or more
//! between grades (PP, PE, PVC) or with the water they hold (PA: 3.1 and 1.1 GPa), or we have no source for all of it.

use std::borrow::Cow;
use std::fmt;
use std::fmt::Write as _;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::value::MapAccessDeserializer;
use serde::de::{self, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::SceneError;
use super::check::Check;
use super::check::Range::{Any, Positive};
use super::friction;
use super::keys::{At, Density, Plain, Pressure};

/// Material of the part.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// For reports.
    pub name: Option<String>,
    /// Pa, > 0.
    pub young_modulus: f64,
    /// In (-1, 0.5).
    pub poisson_ratio: f64,
    /// kg/m³, > 0.
    pub density: Option<f64>,
    /// Largest strain that the material bears once, > 0 (0.02 is 2 %).
    pub permissible_strain: Option<f64>,
    /// What of it is not written but the named material's, and by whom.
    pub source: Option<String>,
}

/// A plastic without fibres.
#[derive(Debug, PartialEq)]
struct Known {
    name: &'static str,
    /// Pa.
    young_modulus: f64,
    grade: &'static str,
    permissible_strain: f64,
}

const KNOWN: [Known; 3] = [
    Known {
        name: "POM",
        young_modulus: 2.85e9,
        grade: "Hostaform C 9021",
        permissible_strain: 0.06,
    },
    Known {
        name: "PC",
        young_modulus: 2.4e9,
        grade: "Makrolon 2405",
        permissible_strain: 0.04,
    },
    Known {
        name: "ABS",
        young_modulus: 2.3e9,
        grade: "Terluran GP-22",
        permissible_strain: 0.025,
    },
];

/// By the guide, for plastics.
const POISSON_RATIO: f64 = 0.35;

const GUIDE: &str = "Bayer's snap-fit guide";

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct MaterialKeys {
    /// Name for reports, for `tool.material`, and for what is not written here: the table below, for exactly these names.
    name: Option<At<String>>,
    /// Young's modulus, above 0.
    #[schemars(extend("x-default" = "by `name`"))]
    young_modulus: Option<Pressure>,
    /// Poisson's ratio, above -1 and below 0.5; for rubber-like parts 0.49 with order = 3 (elements lock nearer to 0.5 and at lower order).
    #[schemars(extend("x-default" = "by `name`"))]
    poisson_ratio: Option<Plain>,
    /// Density, above 0; needed for the size of gravity and of the part's inertia.
    density: Option<Density>,
    /// Largest strain that the material bears once, such as 0.02; the report compares with it.
    #[schemars(extend("x-default" = "by `name`, or none"))]
    permissible_strain: Option<Plain>,
}

/// The keys, or one word for all of them.
#[derive(Debug)]
pub(super) struct WordOrKeys(MaterialKeys);

impl At<WordOrKeys> {
    pub(super) fn checked(self, check: &Check<'_>) -> Result<Material, SceneError> {
        let WordOrKeys(keys) = self.value;
        let name = keys.name.map(|name| At {
            // A word has the place of the whole.
            offset: name.offset.max(self.offset),
            ..name
        });
        let known = name.as_ref().and_then(|name| known(&name.value));
        let or_known = |key: &str, written: Option<f64>, of: fn(&Known) -> f64| {
            written
                .or(known.map(of))
                .ok_or_else(|| missing(key, name.as_ref(), self.offset, check))
        };
        let young = check.optional("young_modulus", keys.young_modulus, Positive)?;
        let poisson = checked_poisson_ratio(keys.poisson_ratio, check)?;
        let strain = check.optional("permissible_strain", keys.permissible_strain, Positive)?;
        let source = known.and_then(|known| {
            let by_guide = [
                (poisson.is_none(), "Poisson's ratio"),
                (strain.is_none(), "permissible strain"),
            ];
            source(known, young.is_none(), by_guide)
        });
        Ok(Material {
            young_modulus: or_known("young_modulus", young, |known| known.young_modulus)?,
            poisson_ratio: or_known("poisson_ratio", poisson, |_| POISSON_RATIO)?,
            density: check.optional("density", keys.density, Positive)?,
            permissible_strain: strain.or(known.map(|known| known.permissible_strain)),
            source,
            name: name.map(|name| name.value),
        })
    }
}

/// The plastic of this very name: what is added to it, such as fibres, makes another one.
fn known(name: &str) -> Option<&'static Known> {
    let is_meant = |known: &&Known| known.name.eq_ignore_ascii_case(name.trim());
    KNOWN.iter().find(is_meant)
}

fn names() -> [&'static str; KNOWN.len()] {
    KNOWN.each_ref().map(|known| known.name)
}

/// `offset` is that of the whole.
fn missing(key: &str, name: Option<&At<String>>, offset: usize, check: &Check<'_>) -> SceneError {
    let add = format!("add `{key} = ...`");
    let Some(At { value, offset }) = name else {
        let what = format!("key `{key}` is missing in [part.material]");
        let mend = format!("{add}, or name one of {}", names().join(", "));
        return check.missing(offset, what, mend);
    };
    // A word alone has no place for the key.
    let add = format!("{add} in [part.material]");
    match friction::known(value) {
        Some(rubs) => {
            let what = format!(
                "{value} is known for its friction (as {rubs}), but its {key} is in no table"
            );
            let mend = format!(
                "{add}; without fibres and fillers {} have it",
                names().join(", ")
            );
            check.error(*offset, what, mend)
        }
        None => {
            let what =
                format!("key `{key}` is missing and \"{value}\" is in no table of materials");
            let mend = format!("{}; or {add}", SceneError::mend_of(value, &names()));
            check.error(*offset, what, mend)
        }
    }
}

fn checked_poisson_ratio(
    written: Option<Plain>,
    check: &Check<'_>,
) -> Result<Option<f64>, SceneError> {
    let Some(written) = written else {
        return Ok(None);
    };
    let poisson_ratio = check.number("poisson_ratio", written, Any)?;
    if poisson_ratio >= 0.5 {
        let what = format!("poisson_ratio {poisson_ratio} must be below 0.5");
        let mend = "for rubber-like parts use 0.49 with order = 3 (nearer to 0.5, or at order 2, elements lock: \
                    forces are far too high)";
        return Err(check.error(written.offset, what, mend));
    }
    if poisson_ratio <= -1.0 {
        let what = format!("poisson_ratio {poisson_ratio} must be above -1");
        return Err(check.error(written.offset, what, "plastics have 0.3 to 0.45"));
    }
    Ok(Some(poisson_ratio))
}

/// Words for what was taken: the modulus, and of the guide those that are said to be.
fn source(known: &Known, is_modulus: bool, by_guide: [(bool, &str); 2]) -> Option<String> {
    let of_grade =
        is_modulus.then(|| format!("E at small strain by the data sheet of {}", known.grade));
    let of_guide: Vec<&str> = by_guide
        .iter()
        .filter_map(|(is_taken, what)| is_taken.then_some(*what))
        .collect();
    let of_guide = (!of_guide.is_empty()).then(|| format!("{} by {GUIDE}", of_guide.join(" and ")));
    let parts: Vec<String> = of_grade.into_iter().chain(of_guide).collect();
    (!parts.is_empty()).then(|| parts.join(", "))
}

/// The table, for `docs/scene.md`.
pub(super) fn markdown() -> String {
    let mut out = format!(
        "\n`material = \"POM\"` says all but the density, and so does `name` where a key is left out. Tensile modulus at small strain \
         (ISO 527, 23 °C) by the data sheet of the grade, permissible strain and Poisson's ratio by {GUIDE}. At the strain of a snap-fit \
         the secant modulus is lower (PC at 2 %: 1815 MPa by the guide): for the force at large strain write that of your grade.\n\n\
         | name | Young's modulus | of | Poisson's ratio | permissible strain |\n|---|---|---|---|---|\n"
    );
    for known in &KNOWN {
        let _ = writeln!(
            out,
            "| {} | {} MPa | {} | {POISSON_RATIO} | {} |",
            known.name,
            known.young_modulus / 1e6,
            known.grade,
            known.permissible_strain
        );
    }
    out
}

impl<'de> Deserialize<'de> for WordOrKeys {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Choice;
        impl<'de> Visitor<'de> for Choice {
            type Value = MaterialKeys;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("the name of a plastic or a section [part.material]")
            }
            fn visit_str<E: de::Error>(self, word: &str) -> Result<MaterialKeys, E> {
                Ok(MaterialKeys {
                    name: Some(At {
                        value: word.to_owned(),
                        offset: 0,
                    }),
                    young_modulus: None,
                    poisson_ratio: None,
                    density: None,
                    permissible_strain: None,
                })
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<MaterialKeys, A::Error> {
                MaterialKeys::deserialize(MapAccessDeserializer::new(map))
            }
        }
        deserializer.deserialize_any(Choice).map(Self)
    }
}

impl JsonSchema for WordOrKeys {
    fn schema_name() -> Cow<'static, str> {
        "Material".into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut schema = MaterialKeys::json_schema(generator);
        // A word is allowed too; `properties` does not look at words, nor `pattern` at tables.
        schema.insert("type".to_owned(), serde_json::json!(["object", "string"]));
        schema.insert(
            "pattern".to_owned(),
            format!("^({})$", names().join("|")).into(),
        );
        schema
    }
}
