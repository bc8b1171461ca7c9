//! `accuracy.contact_iterations`: how often contact planes are put on anew within a step.

use std::borrow::Cow;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, Visitor};
use serde::{Deserialize, Deserializer};

use crate::scene::SceneError;
use crate::scene::check::Check;
use crate::scene::keys::{At, Bounded};

/// How often contact planes are put on anew within a step. `N` is the number's type: another one
/// while the scene is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContactIterations<N = u32> {
    /// Until the displacement no longer changes.
    Converged,
    /// This often, 1 to 50.
    Times(N),
}

/// As written.
pub(super) type IterationsKey = ContactIterations<i64>;

impl At<IterationsKey> {
    pub(super) fn checked(self, check: &Check<'_>) -> Result<ContactIterations, SceneError> {
        let At { value, offset } = self;
        match value {
            IterationsKey::Converged => Ok(ContactIterations::Converged),
            IterationsKey::Times(value) => {
                let value = Bounded::<1, 50>(value);
                let times = check.whole("contact_iterations", At { value, offset })?;
                Ok(ContactIterations::Times(times))
            }
        }
    }
}

impl<'de> Deserialize<'de> for IterationsKey {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Choice;
        impl Visitor<'_> for Choice {
            type Value = IterationsKey;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("\"converged\" or a number from 1 to 50")
            }
            fn visit_str<E: de::Error>(self, word: &str) -> Result<IterationsKey, E> {
                match word {
                    "converged" => Ok(ContactIterations::Converged),
                    _ => Err(E::unknown_variant(word, &["converged"])),
                }
            }
            fn visit_i64<E: de::Error>(self, times: i64) -> Result<IterationsKey, E> {
                Ok(ContactIterations::Times(times))
            }
        }
        deserializer.deserialize_any(Choice)
    }
}

impl JsonSchema for IterationsKey {
    fn schema_name() -> Cow<'static, str> {
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
