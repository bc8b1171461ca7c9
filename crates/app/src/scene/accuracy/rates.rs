//! `accuracy.rates`: whether the haptic loop solves whole steps.

use std::borrow::Cow;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::MapAccessDeserializer;
use serde::de::{self, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

use crate::scene::SceneError;
use crate::scene::check::Check;
use crate::scene::keys::Whole;

/// s, after which a result is too old: twice as old, before the next, it would begin to fade.
const MOST_DELAY: f64 = 0.05;

/// Whether the haptic loop solves whole steps. `N` is the number's type: another one while the
/// scene is read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rates<N = u32> {
    /// Yes; in real time only if they fit the period, by measurement.
    #[default]
    Auto,
    /// Yes.
    One,
    /// No: the engine runs beside it, and its results are there so many servo periods later, in
    /// [1, 50]; in real time as soon as they are solved.
    Every(N),
}

type Periods = Whole<1, 50>;

/// As written.
pub(super) type RatesKey = Rates<Periods>;

impl RatesKey {
    /// `period`: of the servo, s.
    pub(super) fn checked(self, period: f64, check: &Check<'_>) -> Result<Rates, SceneError> {
        let every = match self {
            Self::Auto => return Ok(Rates::Auto),
            Self::One => return Ok(Rates::One),
            Self::Every(every) => every,
        };
        let periods = check.whole("rates.every", every)?;
        let most = (MOST_DELAY / period * (1.0 + 1e-9)).floor().max(1.0);
        if f64::from(periods) > most {
            let what = format!(
                "rates.every {periods} periods of {period} s are {} s, more than {MOST_DELAY} s",
                f64::from(periods) * period
            );
            return Err(check.error(every.offset, what, format!("write {most} or less")));
        }
        Ok(Rates::Every(periods))
    }
}

impl<'de> Deserialize<'de> for RatesKey {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Table {
            every: Periods,
        }
        struct Choice;
        impl<'de> Visitor<'de> for Choice {
            type Value = RatesKey;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("\"auto\", \"one\" or a table with every")
            }
            fn visit_str<E: de::Error>(self, word: &str) -> Result<RatesKey, E> {
                match word {
                    "auto" => Ok(Rates::Auto),
                    "one" => Ok(Rates::One),
                    _ => Err(E::unknown_variant(word, &["auto", "one"])),
                }
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<RatesKey, A::Error> {
                let table = Table::deserialize(MapAccessDeserializer::new(map))?;
                Ok(Rates::Every(table.every))
            }
        }
        deserializer.deserialize_any(Choice)
    }
}

impl JsonSchema for RatesKey {
    fn schema_name() -> Cow<'static, str> {
        "Rates".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "x-type": "`\"auto\"`, `\"one\"` or table",
            "anyOf": [
                { "enum": ["auto", "one"] },
                {
                    "type": "object",
                    "properties": { "every": { "type": "integer", "minimum": 1, "maximum": 50 } },
                    "required": ["every"],
                    "additionalProperties": false
                }
            ]
        })
    }
}
