//! `accuracy = "fast"`, `"balanced"` or `"exact"`: one word for all keys of the section.

use std::borrow::Cow;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::value::MapAccessDeserializer;
use serde::de::{self, IntoDeserializer, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::AccuracyKeys;

/// A goal that stands for all settings of accuracy.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Preset {
    /// two passes over the contact planes, shape drawn between the elements' vertices.
    Fast,
    /// converged contact planes, shape drawn exactly where it is seen to bend.
    Balanced,
    /// order 3, everything converged and free.
    Exact,
}

impl Preset {
    /// As in the file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fast => "fast",
            Self::Balanced => "balanced",
            Self::Exact => "exact",
        }
    }
}

/// The keys, or one word for all of them.
#[derive(Debug, Default)]
pub(in crate::scene) struct WordOrKeys(pub(in crate::scene) AccuracyKeys);

impl<'de> Deserialize<'de> for WordOrKeys {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Choice;
        impl<'de> Visitor<'de> for Choice {
            type Value = AccuracyKeys;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("\"fast\", \"balanced\", \"exact\" or a section [accuracy]")
            }
            fn visit_str<E: de::Error>(self, word: &str) -> Result<AccuracyKeys, E> {
                Ok(AccuracyKeys {
                    preset: Some(Preset::deserialize(word.into_deserializer())?),
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

impl JsonSchema for WordOrKeys {
    fn schema_name() -> Cow<'static, str> {
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
