//! Groups of the mesh as a scene names them: one, several, or with the components in which they are held.

use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::MapAccessDeserializer;
use serde::de::{self, Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};

use super::At;

/// What is held: one group or several.
#[derive(Debug)]
pub(in crate::scene) struct FixedRaw(pub(in crate::scene) Vec<At<FixedEntry>>);

/// One held group.
#[derive(Debug)]
pub(in crate::scene) struct FixedEntry {
    pub(in crate::scene) group: String,
    /// `None`: all.
    pub(in crate::scene) components: Option<At<Vec<At<Component>>>>,
}

/// A direction of the part's frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub(in crate::scene) enum Component {
    X,
    Y,
    Z,
}

impl<'de> Deserialize<'de> for FixedEntry {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Table {
            group: String,
            components: Option<At<Vec<At<Component>>>>,
        }
        struct Entry;
        impl<'de> Visitor<'de> for Entry {
            type Value = FixedEntry;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a group name or a table with `group` and `components`")
            }
            fn visit_str<E: de::Error>(self, name: &str) -> Result<FixedEntry, E> {
                Ok(FixedEntry {
                    group: name.to_owned(),
                    components: None,
                })
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<FixedEntry, A::Error> {
                let table = Table::deserialize(MapAccessDeserializer::new(map))?;
                Ok(FixedEntry {
                    group: table.group,
                    components: table.components,
                })
            }
        }
        deserializer.deserialize_any(Entry)
    }
}

impl<'de> Deserialize<'de> for FixedRaw {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Entries;
        impl<'de> Visitor<'de> for Entries {
            type Value = FixedRaw;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a group name, or a list of group names and of tables with `group`")
            }
            fn visit_str<E: de::Error>(self, name: &str) -> Result<FixedRaw, E> {
                let entry = FixedEntry {
                    group: name.to_owned(),
                    components: None,
                };
                // The offset of the whole value is known outside; see `validate`.
                Ok(FixedRaw(vec![At {
                    value: entry,
                    offset: 0,
                }]))
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<FixedRaw, A::Error> {
                let mut entries = Vec::new();
                while let Some(entry) = seq.next_element()? {
                    entries.push(entry);
                }
                Ok(FixedRaw(entries))
            }
        }
        deserializer.deserialize_any(Entries)
    }
}

impl JsonSchema for FixedRaw {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Fixed".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "x-type": "name or list",
            "anyOf": [
                { "type": "string" },
                {
                    "type": "array",
                    "minItems": 1,
                    "items": {
                        "anyOf": [
                            { "type": "string" },
                            {
                                "type": "object",
                                "properties": {
                                    "group": { "type": "string" },
                                    "components": {
                                        "type": "array",
                                        "minItems": 1,
                                        "items": { "type": "string", "enum": ["x", "y", "z"] }
                                    }
                                },
                                "required": ["group"],
                                "additionalProperties": false
                            }
                        ]
                    }
                }
            ]
        })
    }
}

/// One name or several.
#[derive(Debug)]
pub(in crate::scene) struct NamesRaw(pub(in crate::scene) Vec<At<String>>);

impl<'de> Deserialize<'de> for NamesRaw {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Names;
        impl<'de> Visitor<'de> for Names {
            type Value = NamesRaw;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a group name or a list of group names")
            }
            fn visit_str<E: de::Error>(self, name: &str) -> Result<NamesRaw, E> {
                Ok(NamesRaw(vec![At {
                    value: name.to_owned(),
                    offset: 0,
                }]))
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<NamesRaw, A::Error> {
                let mut names = Vec::new();
                while let Some(name) = seq.next_element()? {
                    names.push(name);
                }
                Ok(NamesRaw(names))
            }
        }
        deserializer.deserialize_any(Names)
    }
}

impl JsonSchema for NamesRaw {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Names".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "x-type": "name or list",
            "anyOf": [
                { "type": "string" },
                { "type": "array", "minItems": 1, "items": { "type": "string" } }
            ]
        })
    }
}
