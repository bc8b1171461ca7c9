//! The scene format as JSON Schema and as `docs/scene.md`, both from the doc comments of the keys.

use std::fmt::Write as _;

use schemars::generate::SchemaSettings;
use serde::de::{self, Deserialize, Deserializer, Visitor};
use serde_json::Value;

use super::{SceneKeys, accuracy, units};
use super::{
    coupling, device, drive, effects, hand, handbook, holds, limits, material, output, part, tool,
};

/// A short whole scene, as the document shows it.
const EXAMPLE: &str = r#"title = "Clip on a 20 mm tube"
units = "SI"

[part]
mesh = "clip.msh"
fixed = "fixed"
contact = "contact"
material = { name = "POM", young_modulus = 2.7e9, poisson_ratio = 0.35 }

[tool]
shape = "cylinder"
radius = 0.01
position = [0.0, 0.014, 0.005]
axis = [0.0, 0.0, 1.0]

[drive]
direction = [0.0, -1.0, 0.0]
travel = 0.014
"#;

/// What the document adds to the example for a hand.
const EXAMPLE_HAND: &str = r#"[hand]
speed = 0.02
stiffness = 6000.0

[coupling]
translational_stiffness = 2e4

[limits]
insertion_below = 20.0
removal_above = 5.0
strain_below = 0.02
strain_use = "repeatedly"

[effects]
friction_coefficient = 0.2
"#;

/// Sections that a scene must have.
pub(super) const REQUIRED_SECTIONS: [&str; 2] = ["part", "tool"];

/// JSON Schema (draft 7, which most editors read) of the scene format.
pub fn json() -> String {
    let mut text = serde_json::to_string_pretty(&schema()).unwrap_or_default();
    text.push('\n');
    text
}

/// The text of `docs/scene.md`.
pub fn markdown() -> String {
    let schema = schema();
    let mut out = String::from(
        "# Scene file\n\n\
         A scene is a TOML file that says which part is held where, which tool meets it, and how \
         one is pushed onto the other. This page is written by the program: \
         `cargo run --release -- scene --markdown > docs/scene.md` renews it, and \
         `cargo run --release -- scene --schema` prints a JSON Schema that editors can check \
         scenes with.\n\n\
         Paths are relative to the scene file. Angles of directions and lengths of axes do not \
         matter; other numbers are in the scene's units, given below for `\"SI\"` and, after \
         \"or\", for `\"mm-N-MPa\"`. Defaults are in SI whatever the scene's units. A key that is \
         not listed is an error, and so is a value that makes no sense: the message names file, \
         line and mend.\n\n\
         ## Example\n\n```toml\n",
    );
    out.push_str(EXAMPLE);
    out.push_str(
        "```\n\nThat gives the part's own curve: force over travel in and out, the verdict, strain, pictures. A hand \
         that feels it, limits to keep and what friction would add are further sections:\n\n```toml\n",
    );
    out.push_str(EXAMPLE_HAND);
    out.push_str(
        "```\n\nThe scenes in `scenes/` are whole ones to start from.\n\n## Top level\n\n",
    );
    let names = field_names::<SceneKeys>();
    let is_section = |name: &str| match &schema["properties"][name]["type"] {
        // Either a section or one word for it.
        Value::Array(types) => types.iter().any(|name| name == "object"),
        name => name == "object",
    };
    table(
        &mut out,
        &schema,
        names.iter().filter(|name| !is_section(name)),
    );
    for name in names.iter().filter(|name| is_section(name)) {
        let section = &schema["properties"][name];
        let need = if REQUIRED_SECTIONS.contains(name) {
            ""
        } else if ["drive", "hand"].contains(name) {
            " (one of [drive] and [hand] is required)"
        } else {
            " (optional)"
        };
        let _ = write!(out, "\n## [{name}]{need}\n\n{}\n\n", description(section));
        let keys = section_keys(name);
        table(
            &mut out,
            section,
            keys.iter().filter(|key| **key != "material"),
        );
        if *name == "part" {
            let keys = &section["properties"]["material"];
            let _ = write!(out, "\n## [part.material]\n\n{}\n\n", description(keys));
            table(
                &mut out,
                keys,
                field_names::<material::MaterialKeys>().iter(),
            );
            out.push_str(&material::markdown());
        }
    }
    out
}

/// Keys of a section in the order of the code; the schema itself has them by name.
fn section_keys(section: &str) -> &'static [&'static str] {
    match section {
        "part" => field_names::<part::PartKeys>(),
        "tool" => field_names::<tool::ToolKeys>(),
        "holds" => field_names::<holds::HoldsKeys>(),
        "drive" => field_names::<drive::DriveKeys>(),
        "limits" => field_names::<limits::LimitsKeys>(),
        "hand" => field_names::<hand::HandKeys>(),
        "coupling" => field_names::<coupling::CouplingKeys>(),
        "device" => field_names::<device::DeviceKeys>(),
        "accuracy" => field_names::<accuracy::AccuracyKeys>(),
        "effects" => field_names::<effects::EffectsKeys>(),
        "output" => field_names::<output::OutputKeys>(),
        "handbook" => field_names::<handbook::HandbookKeys>(),
        _ => &[],
    }
}

fn schema() -> Value {
    let settings = SchemaSettings::draft07().with(|settings| settings.inline_subschemas = true);
    let mut schema = settings
        .into_generator()
        .into_root_schema_for::<SceneKeys>()
        .to_value();
    without_null(&mut schema);
    unfold(&mut schema);
    schema
}

/// TOML has no null: an optional key is one that is left out.
fn without_null(value: &mut Value) {
    match value {
        Value::Object(map) => {
            if let Some(Value::Array(types)) = map.get_mut("type") {
                types.retain(|name| name != "null");
                if let [only] = types.as_slice() {
                    let only = only.clone();
                    map.insert("type".to_owned(), only);
                }
            }
            if let Some(Value::Array(words)) = map.get_mut("enum") {
                words.retain(|word| !word.is_null());
            }
            if let Some(Value::Array(choices)) = map.get_mut("anyOf") {
                choices.retain(|choice| choice["type"] != "null");
                if let [Value::Object(only)] = choices.as_slice() {
                    let only = only.clone();
                    map.remove("anyOf");
                    for (key, inner) in only {
                        map.entry(key).or_insert(inner);
                    }
                }
            }
            map.values_mut().for_each(without_null);
        }
        Value::Array(list) => list.iter_mut().for_each(without_null),
        _ => {}
    }
}

/// Descriptions as one line each, without the generator's wrapping.
fn unfold(value: &mut Value) {
    match value {
        Value::Object(map) => {
            if let Some(Value::String(text)) = map.get_mut("description") {
                *text = text.replace('\n', " ");
            }
            map.values_mut().for_each(unfold);
        }
        Value::Array(list) => list.iter_mut().for_each(unfold),
        _ => {}
    }
}

fn description(schema: &Value) -> &str {
    schema["description"].as_str().unwrap_or_default()
}

/// One row for each key.
fn table<'a>(out: &mut String, section: &Value, keys: impl Iterator<Item = &'a &'static str>) {
    out.push_str("| key | type | unit | default | meaning |\n|---|---|---|---|---|\n");
    let required = section["required"].as_array();
    for key in keys {
        let schema = &section["properties"][*key];
        let is_required = required.is_some_and(|names| names.iter().any(|name| name == key));
        let _ = writeln!(
            out,
            "| `{key}` | {} | {} | {} | {} |",
            type_of(schema),
            unit_of(schema),
            default_of(schema, is_required),
            meaning_of(schema)
        );
    }
}

fn type_of(schema: &Value) -> String {
    if let Some(text) = schema["x-type"].as_str() {
        return text.to_owned();
    }
    if !words(schema).is_empty() {
        return "word".to_owned();
    }
    match schema["type"].as_str() {
        Some("array") => match schema["maxItems"].as_u64() {
            Some(n) => format!("{n} numbers"),
            None => "list".to_owned(),
        },
        Some(name) => name.to_owned(),
        None => String::new(),
    }
}

fn unit_of(schema: &Value) -> String {
    match schema["x-quantity"].as_str().and_then(units::labels) {
        None => String::new(),
        Some((si, mm)) if si == mm => si.to_owned(),
        Some((si, mm)) => format!("{si} or {mm}"),
    }
}

fn default_of(schema: &Value, is_required: bool) -> String {
    match (&schema["default"], schema["x-default"].as_str()) {
        _ if is_required => "required".to_owned(),
        (_, Some(text)) => text.to_owned(),
        (Value::Null, None) => "none".to_owned(),
        (value, None) => format!("`{value}`"),
    }
}

/// Choices of a word with their meaning, which may be empty.
fn words(schema: &Value) -> Vec<(&str, &str)> {
    let alternatives = schema["oneOf"].as_array().map_or(&[][..], Vec::as_slice);
    let mut words = Vec::new();
    for alternative in std::iter::once(schema).chain(alternatives) {
        if let Some(word) = alternative["const"].as_str() {
            words.push((word, description(alternative)));
        }
        for word in alternative["enum"].as_array().into_iter().flatten() {
            words.extend(word.as_str().map(|word| (word, "")));
        }
    }
    words
}

fn meaning_of(schema: &Value) -> String {
    let mut text = description(schema).to_owned();
    let words = words(schema);
    if !words.is_empty() {
        let list: Vec<String> = words
            .iter()
            .map(|(word, meaning)| match meaning.trim_end_matches('.') {
                "" => format!("`\"{word}\"`"),
                meaning => format!("`\"{word}\"`: {meaning}"),
            })
            .collect();
        let _ = write!(text, " {}.", list.join("; "));
    }
    text.replace('|', "\\|")
}

/// Names of a struct's keys in the order of the code, as its deserializer asks for them.
fn field_names<'de, T: Deserialize<'de>>() -> &'static [&'static str] {
    struct Asked<'a>(&'a mut &'static [&'static str]);
    impl<'de> Deserializer<'de> for Asked<'_> {
        type Error = de::value::Error;
        fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, Self::Error> {
            Err(de::Error::custom("not a struct"))
        }
        fn deserialize_struct<V: Visitor<'de>>(
            self,
            _: &'static str,
            fields: &'static [&'static str],
            _: V,
        ) -> Result<V::Value, Self::Error> {
            *self.0 = fields;
            Err(de::Error::custom("only asked"))
        }
        serde::forward_to_deserialize_any! {
            bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf
            option unit unit_struct newtype_struct seq tuple tuple_struct map enum identifier
            ignored_any
        }
    }
    let mut names: &'static [&'static str] = &[];
    // The answer is the side effect; the error is how the question ends.
    let _ = T::deserialize(Asked(&mut names));
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The document in the repository is the generated one.
    #[test]
    fn document_is_up_to_date() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/scene.md");
        if std::env::var_os("SNAPIN_WRITE_DOCS").is_some() {
            std::fs::write(path, markdown()).unwrap();
        }
        let written = std::fs::read_to_string(path).unwrap();
        assert!(
            written == markdown(),
            "docs/scene.md is old: cargo run --release -- scene --markdown > docs/scene.md"
        );
    }

    /// Every key has a meaning, and every section its keys.
    #[test]
    fn every_key_has_a_meaning() {
        fn visit(schema: &Value, name: &str) {
            assert!(
                !meaning_of(schema).trim().is_empty(),
                "{name} has no meaning"
            );
            let keys = schema["properties"].as_object();
            for (key, inner) in keys.into_iter().flatten() {
                // A section without own words is told by its parent's key.
                visit(inner, &format!("{name}.{key}"));
            }
        }
        let schema = schema();
        visit(&schema, "scene");
        for (name, section) in schema["properties"].as_object().unwrap() {
            let listed = section_keys(name).len();
            let there = section["properties"]
                .as_object()
                .map_or(0, serde_json::Map::len);
            assert_eq!(listed, there, "{name}");
        }
    }

    #[test]
    fn required_sections_are_those_of_the_code() {
        let schema = schema();
        let mut required: Vec<_> = schema["required"]
            .as_array()
            .unwrap()
            .iter()
            .map(|v| v.as_str().unwrap())
            .collect();
        required.sort_unstable();
        assert_eq!(required, ["part", "tool"]);
        assert!(REQUIRED_SECTIONS.iter().all(|name| required.contains(name)));
    }

    /// The example in the document is a scene.
    #[test]
    fn example_is_valid() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("clip.msh"), "").unwrap();
        let path = dir.path().join("example.toml");
        let scene = crate::scene::Scene::from_bytes(EXAMPLE.into(), &path).unwrap();
        assert!(scene.hand.is_none());
        let both = format!("{EXAMPLE}\n{EXAMPLE_HAND}");
        let scene = crate::scene::Scene::from_bytes(both.into(), &path).unwrap();
        assert_eq!(scene.coupling.translational_stiffness, 2e4);
        assert_eq!(scene.hand.unwrap().travel, 0.014);
    }

    #[test]
    fn schema_is_json_without_null() {
        let text = json();
        let value: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(value["$schema"], "http://json-schema.org/draft-07/schema#");
        assert!(!text.contains("null"), "{text}");
        assert_eq!(
            value["properties"]["coupling"]["additionalProperties"],
            false
        );
        assert_eq!(
            value["properties"]["hand"]["properties"]["mass"]["default"],
            hand::MASS
        );
    }
}
