//! Keys of `[accuracy]` as written.

use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::MapAccessDeserializer;
use serde::de::{self, Deserialize, Deserializer, MapAccess, Visitor};

use super::{At, default};
use crate::scene::Columns;

/// How often contact planes are put on anew.
#[derive(Debug)]
pub(in crate::scene) enum IterationsRaw {
    Converged,
    Times(i64),
}

impl<'de> Deserialize<'de> for IterationsRaw {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Iterations;
        impl Visitor<'_> for Iterations {
            type Value = IterationsRaw;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("\"converged\" or a number from 1 to 50")
            }
            fn visit_str<E: de::Error>(self, word: &str) -> Result<IterationsRaw, E> {
                match word {
                    "converged" => Ok(IterationsRaw::Converged),
                    _ => Err(E::unknown_variant(word, &["converged"])),
                }
            }
            fn visit_i64<E: de::Error>(self, times: i64) -> Result<IterationsRaw, E> {
                Ok(IterationsRaw::Times(times))
            }
        }
        deserializer.deserialize_any(Iterations)
    }
}

impl JsonSchema for IterationsRaw {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "ContactIterations".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "x-type": "`\"converged\"` or integer",
            "anyOf": [
                { "const": "converged" },
                { "type": "integer", "minimum": 1, "maximum": 50 }
            ]
        })
    }
}

/// One rate or two.
#[derive(Debug)]
pub(in crate::scene) enum RatesRaw {
    Auto,
    One,
    Every(At<i64>),
}

/// Two rates in full.
#[derive(Debug, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct RatesKeys {
    every: At<i64>,
}

impl<'de> Deserialize<'de> for RatesRaw {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Choice;
        impl<'de> Visitor<'de> for Choice {
            type Value = RatesRaw;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("\"auto\", \"one\" or a table with every")
            }
            fn visit_str<E: de::Error>(self, word: &str) -> Result<RatesRaw, E> {
                match word {
                    "auto" => Ok(RatesRaw::Auto),
                    "one" => Ok(RatesRaw::One),
                    _ => Err(E::unknown_variant(word, &["auto", "one"])),
                }
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<RatesRaw, A::Error> {
                let keys = RatesKeys::deserialize(MapAccessDeserializer::new(map))?;
                Ok(RatesRaw::Every(keys.every))
            }
        }
        deserializer.deserialize_any(Choice)
    }
}

impl JsonSchema for RatesRaw {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> std::borrow::Cow<'static, str> {
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

/// Number type of a kept compliance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(in crate::scene) enum ScalarRaw {
    /// 64 bits.
    F64,
    /// 32 bits: half the memory to read, about seven digits.
    F32,
}

/// Number type of the displacement multiply.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(in crate::scene) enum MultiplyScalarRaw {
    /// 64 bits on the processor, 32 on a GPU.
    Auto,
    /// 64 bits, on the processor.
    F64,
    /// 32 bits, about seven digits.
    F32,
    /// 16 bits on a GPU, about three digits; the processor keeps 32.
    F16,
}

/// Where the displacement multiply runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(in crate::scene) enum MultiplyRaw {
    /// on the faster of processor and GPU.
    Auto,
    /// on the processor.
    Cpu,
    /// on the best GPU, one in software too, or else an error.
    Gpu,
}

/// Whether the tool's corners and edges touch the part between its nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(in crate::scene) enum ToolFeaturesRaw {
    /// if the tool has some and the contact groups have faces.
    Auto,
    /// or else an error.
    On,
    /// contact at the part's nodes only.
    Off,
}

/// One word for all settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(in crate::scene) enum PresetRaw {
    /// two passes over the contact planes, shape drawn between the elements' vertices.
    Fast,
    /// converged contact planes, shape drawn exactly where it is seen to bend.
    Balanced,
    /// order 3, everything converged and free.
    Exact,
}

/// Which interface nodes are free.
#[derive(Debug)]
pub(in crate::scene) enum AdaptiveRaw {
    Off,
    Radius(f64),
    Keys(AdaptiveKeys),
}

/// The p-method in full.
#[derive(Debug, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::scene) struct AdaptiveKeys {
    pub(in crate::scene) radius: Option<At<f64>>,
    pub(in crate::scene) indicator: Option<At<f64>>,
    pub(in crate::scene) budget_us: Option<At<f64>>,
}

impl<'de> Deserialize<'de> for AdaptiveRaw {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Choice;
        impl<'de> Visitor<'de> for Choice {
            type Value = AdaptiveRaw;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("\"off\", a radius, or a table with radius, indicator or budget_us")
            }
            fn visit_str<E: de::Error>(self, word: &str) -> Result<AdaptiveRaw, E> {
                match word {
                    "off" => Ok(AdaptiveRaw::Off),
                    _ => Err(E::unknown_variant(word, &["off"])),
                }
            }
            fn visit_f64<E: de::Error>(self, radius: f64) -> Result<AdaptiveRaw, E> {
                Ok(AdaptiveRaw::Radius(radius))
            }
            fn visit_i64<E: de::Error>(self, radius: i64) -> Result<AdaptiveRaw, E> {
                Ok(AdaptiveRaw::Radius(radius as f64))
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<AdaptiveRaw, A::Error> {
                AdaptiveKeys::deserialize(MapAccessDeserializer::new(map)).map(AdaptiveRaw::Keys)
            }
        }
        deserializer.deserialize_any(Choice)
    }
}

impl JsonSchema for AdaptiveRaw {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Adaptive".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "x-type": "`\"off\"`, number or table",
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

/// The keys, or one word for all of them.
#[derive(Debug, Default)]
pub(in crate::scene) struct AccuracyRaw(pub(in crate::scene) AccuracyKeys);

impl<'de> Deserialize<'de> for AccuracyRaw {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Choice;
        impl<'de> Visitor<'de> for Choice {
            type Value = AccuracyKeys;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("\"fast\", \"balanced\", \"exact\" or a section [accuracy]")
            }
            fn visit_str<E: de::Error>(self, word: &str) -> Result<AccuracyKeys, E> {
                let preset = match word {
                    "fast" => PresetRaw::Fast,
                    "balanced" => PresetRaw::Balanced,
                    "exact" => PresetRaw::Exact,
                    _ => return Err(E::unknown_variant(word, &["fast", "balanced", "exact"])),
                };
                Ok(AccuracyKeys {
                    preset: Some(preset),
                    ..AccuracyKeys::default()
                })
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<AccuracyKeys, A::Error> {
                AccuracyKeys::deserialize(MapAccessDeserializer::new(map))
            }
        }
        deserializer.deserialize_any(Choice).map(Self)
    }
}

impl JsonSchema for AccuracyRaw {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Accuracy".into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut schema = AccuracyKeys::json_schema(generator);
        // A word is allowed too; `properties` does not look at words, nor `pattern` at tables.
        schema.insert("type".to_owned(), serde_json::json!(["object", "string"]));
        schema.insert("pattern".to_owned(), "^(fast|balanced|exact)$".into());
        schema
    }
}

#[derive(Debug, Default, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(in crate::scene) struct AccuracyKeys {
    /// Settings for a goal; keys that are written beside it take precedence.
    #[schemars(extend("x-default" = "none"))]
    pub(in crate::scene) preset: Option<PresetRaw>,
    /// Time that 99.9 % of the steps may take, in microseconds whatever the units: the most
    /// accurate settings that keep it on this machine are measured, chosen and named. Stands alone.
    #[schemars(extend("x-type" = "number", "x-default" = "none"))]
    pub(in crate::scene) budget_us: Option<At<f64>>,
    /// Order of the elements, 1, 2 or 3; raised or lowered from the mesh's own.
    #[schemars(range(min = 1, max = 3), extend("x-default" = "the mesh's own"))]
    pub(in crate::scene) order: Option<At<i64>>,
    /// The p-method: which interface nodes (those on edges and faces) are drawn where they are; the others follow
    /// their principal nodes (the elements' vertices). Forces are those of the full order whatever is chosen.
    /// `"off"`: all. A number: those within this radius of the contact. A table: `radius`, or `indicator` (where the
    /// edge bends by more than this share of the largest displacement), or `budget_us` (as many as this time
    /// allows, nearest first). Example: `{ radius = 3.0 }`.
    #[schemars(extend("x-quantity" = "length", "default" = "off"))]
    pub(in crate::scene) adaptive: Option<At<AdaptiveRaw>>,
    /// How often contact planes are put on anew at the new positions within one step: until the
    /// displacement no longer changes, or 1 to 50 times.
    #[schemars(extend("default" = "converged"))]
    pub(in crate::scene) contact_iterations: Option<At<IterationsRaw>>,
    /// Nodes nearer to the tool than this get a contact plane, above 0.
    #[schemars(extend("x-quantity" = "length", "x-default" = "chosen from the tool's motion"))]
    pub(in crate::scene) near_distance: Option<At<f64>>,
    /// Rows of the contact problem of one step, 1 to 5000; its time grows with their cube. Where
    /// more nodes are near, neighbours share a row, up to eight times as many; beyond that the
    /// deepest are kept and the rest is counted and reported.
    #[schemars(range(min = 1, max = 5000), extend("default" = default::MAX_CONTACTS))]
    pub(in crate::scene) max_contacts: Option<At<i64>>,
    /// Whether the haptic loop solves the whole step (`"one"`), or the engine runs beside it and hands
    /// each step's contact problem over, which the loop solves again in every period: `{ every = 5 }`,
    /// the results being there that many periods later, 1 to 50 and 50 ms at most (where the run waits
    /// for the real clock: as soon as they are solved). `"auto"`: one; where the run waits for the
    /// clock, two if 99 % of the steps of a rehearsal do not fit 0.7 of the period.
    #[schemars(extend("default" = "auto"))]
    pub(in crate::scene) rates: Option<At<RatesRaw>>,
    /// Corners and sharp edges of the tool (a box, a cylinder of finite length, a mesh that bends by more than 20 degrees)
    /// against the part's faces between its nodes: each point of them at a face is one more contact plane, of
    /// `max_contacts` too. Without it contact acts at nodes only, and what comes between them is not seen. Edges
    /// are sampled at half the part's smallest face. A step then takes some 0.1 ms on the shipped hook (docs/performance.md).
    #[schemars(extend("default" = "auto"))]
    pub(in crate::scene) tool_features: Option<At<ToolFeaturesRaw>>,
    /// Where nodes share rows, relative error of the resultant force above which steps are counted
    /// and reported, above 0 to 1. It is estimated in each step by the gaps that are left.
    #[schemars(extend("x-quantity" = "number", "default" = default::MERGE_TOLERANCE))]
    pub(in crate::scene) merge_tolerance: Option<At<f64>>,
    /// Number type in which the displacement multiply keeps the compliance: it changes the drawn shape only, forces are
    /// always computed in f64.
    #[schemars(extend("default" = "auto"))]
    pub(in crate::scene) scalar: Option<At<MultiplyScalarRaw>>,
    /// Number type in which the compliance between nodes that can touch is kept for the step; sums and solutions are
    /// in f64. `"f32"` halves the memory and changes forces in the seventh digit.
    #[schemars(extend("default" = "f64"))]
    pub(in crate::scene) contact_scalar: Option<At<ScalarRaw>>,
    /// Which columns of the compliance, one for each node that can touch, are computed beforehand; a node without
    /// its column cannot be touched yet. `"near"` is for parts whose compliance does not fit into memory: the part is
    /// factored at each start, and a node whose column came late is eased in. Not with `adaptive`.
    #[schemars(extend("default" = "auto"))]
    pub(in crate::scene) columns: Option<At<Columns>>,
    /// Where the displacement multiply runs; forces do not depend on it. `"auto"` measures processor and GPU once for each
    /// part, remembers the winner beside the prepared part, and says what it chose; a GPU that fails in a run is given up
    /// for the processor. `"gpu"` is not for `scalar = "f64"` or `columns = "near"`.
    #[schemars(extend("default" = "auto"))]
    pub(in crate::scene) multiply: Option<At<MultiplyRaw>>,
}
