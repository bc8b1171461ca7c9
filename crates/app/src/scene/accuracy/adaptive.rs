//! `accuracy.adaptive`: which interface nodes are free.

use std::borrow::Cow;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::MapAccessDeserializer;
use serde::de::{self, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

use crate::scene::SceneError;
use crate::scene::check::Check;
use crate::scene::check::Range::{NotNegative, Positive};
use crate::scene::keys::{At, In, Length, Plain};

/// The p-method (Duriez et al. 2004, section 3.2). `F` says which nodes: in another way while the
/// scene is read.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Adaptive<F = FreeNodes> {
    /// Every interface node is free.
    #[default]
    Off,
    /// Some are; the others are interpolated for drawing. Forces are those of the full order.
    On(F),
}

/// Which interface nodes are free.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FreeNodes {
    /// Within this distance of a contact, m, >= 0.
    Radius(f64),
    /// Where the edge bends by more than this share of the largest displacement, > 0.
    Indicator(f64),
    /// As many as a step of this many µs allows, nearest to the contact first, > 0.
    BudgetUs(f64),
}

impl Adaptive {
    /// In a few words, lengths in mm.
    pub fn words(&self) -> String {
        let Self::On(free) = self else {
            return "all free".to_owned();
        };
        match free {
            FreeNodes::Radius(0.0) => "none free".to_owned(),
            FreeNodes::Radius(radius) => format!("free within {:.3} mm", 1e3 * radius),
            FreeNodes::Indicator(share) => format!("free where bent by {} %", 100.0 * share),
            FreeNodes::BudgetUs(budget) => format!("free as {budget} µs allow"),
        }
    }
}

/// As written.
pub(super) type AdaptiveKey = Adaptive<FreeNodesKeys>;

#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FreeNodesKeys {
    radius: Option<Length>,
    indicator: Option<Plain>,
    budget_us: Option<Plain>,
}

impl At<AdaptiveKey> {
    pub(super) fn checked(self, check: &Check<'_>) -> Result<Adaptive, SceneError> {
        let Adaptive::On(keys) = self.value else {
            return Ok(Adaptive::Off);
        };
        let free = match (keys.radius, keys.indicator, keys.budget_us) {
            (Some(At { value, offset }), None, None) => {
                // A radius without a table has the place of the key.
                let offset = offset.max(self.offset);
                let radius = At { value, offset };
                FreeNodes::Radius(check.number("adaptive radius", radius, NotNegative)?)
            }
            (None, Some(share), None) => {
                FreeNodes::Indicator(check.number("adaptive.indicator", share, Positive)?)
            }
            (None, None, Some(time)) => {
                FreeNodes::BudgetUs(check.number("adaptive.budget_us", time, Positive)?)
            }
            (None, None, None) => {
                let what = "adaptive says nothing of which nodes are free";
                let mend = "write radius, indicator or budget_us";
                return Err(check.error(self.offset, what, mend));
            }
            _ => {
                let what = "adaptive says more than once which nodes are free";
                let mend = "keep one of radius, indicator and budget_us";
                return Err(check.error(self.offset, what, mend));
            }
        };
        Ok(Adaptive::On(free))
    }
}

impl<'de> Deserialize<'de> for AdaptiveKey {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Choice;
        impl<'de> Visitor<'de> for Choice {
            type Value = AdaptiveKey;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("\"off\", a radius, or a table with radius, indicator or budget_us")
            }
            fn visit_str<E: de::Error>(self, word: &str) -> Result<AdaptiveKey, E> {
                match word {
                    "off" => Ok(Adaptive::Off),
                    _ => Err(E::unknown_variant(word, &["off"])),
                }
            }
            fn visit_f64<E: de::Error>(self, radius: f64) -> Result<AdaptiveKey, E> {
                let (value, offset) = (In(radius), 0);
                Ok(Adaptive::On(FreeNodesKeys {
                    radius: Some(At { value, offset }),
                    ..FreeNodesKeys::default()
                }))
            }
            fn visit_i64<E: de::Error>(self, radius: i64) -> Result<AdaptiveKey, E> {
                self.visit_f64(radius as f64)
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<AdaptiveKey, A::Error> {
                FreeNodesKeys::deserialize(MapAccessDeserializer::new(map)).map(Adaptive::On)
            }
        }
        deserializer.deserialize_any(Choice)
    }
}

impl JsonSchema for AdaptiveKey {
    fn schema_name() -> Cow<'static, str> {
        "Adaptive".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "x-type": "`\"off\"`, number or table",
            "x-quantity": "length",
            "anyOf": [
                { "const": "off" },
                { "type": "number", "minimum": 0 },
                {
                    "type": "object",
                    "properties": {
                        "radius": { "type": "number", "minimum": 0 },
                        "indicator": { "type": "number", "exclusiveMinimum": 0 },
                        "budget_us": { "type": "number", "exclusiveMinimum": 0 }
                    },
                    "additionalProperties": false
                }
            ]
        })
    }
}
