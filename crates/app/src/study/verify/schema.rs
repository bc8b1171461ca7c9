//! What the JSON files of a case may hold: every key known, every number in its range.
//!
//! A key that nobody knows is an error and not a remark: a misspelt `quantities` would else be a
//! case in which nothing is compared and nothing is wrong.

use serde_json::Value;

/// What may stand at a place.
#[derive(Debug)]
pub(super) enum Shape {
    /// Describes, is not looked at.
    Any,
    Text,
    Flag,
    /// One of these texts.
    Choice(&'static [&'static str]),
    /// A whole number between two, both included.
    Count(u64, u64),
    Number,
    NotNegative,
    /// Above zero.
    Positive,
    /// Above 0 and below 1: a relative tolerance of 1 would let zero pass for anything.
    Fraction,
    /// A list of one entry or more.
    List(&'static Shape),
    /// A list of so many entries.
    Exactly(usize, &'static Shape),
    /// Keys and what may stand there; none has to.
    Object(&'static [(&'static str, Shape)]),
    /// A value for each node tag, one node or more.
    ByNode(&'static Shape),
}

/// Node tags, orders and counts are far below: what is above is a slip.
pub(super) const MOST: u64 = 1_000_000_000;

/// Checks a value against its shape. `place`: its path in the file, empty for the whole file.
///
/// # Errors
/// Where it does not fit, in words: place, what stands there, what is wanted.
pub(super) fn check(value: &Value, shape: &Shape, place: &str) -> Result<(), String> {
    let wanted = |what: &str| Err(format!("{}{} must be {what}", at(place), brief(value)));
    let number = |what: &str, holds: fn(f64) -> bool| match value.as_f64() {
        Some(x) if x.is_finite() && holds(x) => Ok(()),
        _ => wanted(what),
    };
    match shape {
        Shape::Any => Ok(()),
        Shape::Text if value.is_string() => Ok(()),
        Shape::Text => wanted("a text"),
        Shape::Flag if value.is_boolean() => Ok(()),
        Shape::Flag => wanted("true or false"),
        Shape::Choice(choices) => match value.as_str() {
            Some(text) if choices.contains(&text) => Ok(()),
            _ => wanted(&format!("one of {}", listed(choices))),
        },
        Shape::Count(least, most) => match value.as_u64() {
            Some(n) if (*least..=*most).contains(&n) => Ok(()),
            _ => wanted(&format!("a whole number from {least} to {most}")),
        },
        Shape::Number => number("a number", |_| true),
        Shape::NotNegative => number("a number, zero or above", |x| x >= 0.0),
        Shape::Positive => number("a number above zero", |x| x > 0.0),
        Shape::Fraction => number("a number above 0 and below 1", |x| x > 0.0 && x < 1.0),
        Shape::List(entry) => match value.as_array() {
            Some(list) if !list.is_empty() => check_entries(list, entry, place),
            _ => wanted("a list of one entry or more"),
        },
        Shape::Exactly(n, entry) => match value.as_array() {
            Some(list) if list.len() == *n => check_entries(list, entry, place),
            Some(list) => Err(format!(
                "{}has {} entries, {n} are wanted",
                at(place),
                list.len()
            )),
            None => wanted(&format!("a list of {n} entries")),
        },
        Shape::Object(keys) => check_object(value, keys, place),
        Shape::ByNode(entry) => match value.as_object() {
            Some(nodes) if !nodes.is_empty() => nodes.iter().try_for_each(|(tag, value)| {
                if !tag.parse().is_ok_and(|t: u64| (1..=MOST).contains(&t)) {
                    return Err(format!(
                        "{}key {tag:?} must be the number of a node, from 1 to {MOST}",
                        at(place)
                    ));
                }
                check(value, entry, &below(place, tag))
            }),
            _ => wanted("an object with a value for one node or more, such as {\"12\": [0, 0, 0]}"),
        },
    }
}

fn check_entries(list: &[Value], entry: &Shape, place: &str) -> Result<(), String> {
    list.iter()
        .enumerate()
        .try_for_each(|(k, value)| check(value, entry, &format!("{place}[{k}]")))
}

fn check_object(value: &Value, keys: &[(&str, Shape)], place: &str) -> Result<(), String> {
    let Some(object) = value.as_object() else {
        return Err(format!(
            "{}{} must be an object, {{...}}",
            at(place),
            brief(value)
        ));
    };
    for (key, value) in object {
        match keys.iter().find(|(known, _)| known == key) {
            Some((_, shape)) => check(value, shape, &below(place, key))?,
            None => {
                let known: Vec<&str> = keys.iter().map(|(key, _)| *key).collect();
                return Err(format!(
                    "{}unknown key {key:?}: {}; remarks go into \"note\"",
                    at(place),
                    nearest(key, &known)
                ));
            }
        }
    }
    Ok(())
}

/// The mend for a misspelt word.
pub(super) fn nearest(word: &str, known: &[&str]) -> String {
    crate::scene::SceneError::mend_of(word, known)
}

/// The beginning of a message about a place; nothing for the whole file.
fn at(place: &str) -> String {
    if place.is_empty() {
        String::new()
    } else {
        format!("{place}: ")
    }
}

/// Path of what stands under a key.
pub(super) fn below(place: &str, key: &str) -> String {
    if place.is_empty() {
        key.to_owned()
    } else {
        format!("{place}.{key}")
    }
}

fn listed(words: &[&str]) -> String {
    let quoted: Vec<String> = words.iter().map(|word| format!("{word:?}")).collect();
    quoted.join(", ")
}

/// A value in a few characters.
fn brief(value: &Value) -> String {
    const LONGEST: usize = 40;
    match value {
        Value::Array(list) => format!("a list of {} entries", list.len()),
        Value::Object(object) => format!("an object of {} keys", object.len()),
        _ => {
            let text = value.to_string();
            match text.char_indices().nth(LONGEST) {
                Some((end, _)) => format!("{}...", &text[..end]),
                None => text,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    const SHAPE: Shape = Shape::Object(&[
        ("note", Shape::Text),
        ("unique", Shape::Flag),
        ("kind", Shape::Choice(&["a", "b"])),
        ("order", Shape::Count(1, 3)),
        ("force", Shape::Number),
        ("agreement", Shape::NotNegative),
        ("abs", Shape::Positive),
        ("rel", Shape::Fraction),
        ("list", Shape::List(&Shape::Number)),
        ("point", Shape::Exactly(3, &Shape::Number)),
        ("by_node", Shape::ByNode(&Shape::Exactly(3, &Shape::Number))),
        ("free", Shape::Any),
        (
            "steps",
            Shape::List(&Shape::Object(&[("m", Shape::Count(1, 9))])),
        ),
    ]);

    #[test]
    fn what_fits_passes() {
        let whole = json!({
            "note": "", "unique": true, "kind": "b", "order": 3, "force": -1, "agreement": 0, "abs": 1e-17,
            "rel": 0.98, "list": [1], "point": [1, 2, 3.5], "by_node": {"12": [0, 0, 0]},
            "free": {"x": null}, "steps": [{"m": 1}, {}],
        });
        assert_eq!(check(&whole, &SHAPE, ""), Ok(()));
        assert_eq!(check(&json!({}), &SHAPE, ""), Ok(()));
    }

    #[test]
    fn what_does_not_fit_is_named_with_place_and_range() {
        let cases = [
            (json!([]), "a list of 0 entries must be an object"),
            (json!({"note": 1}), "note: 1 must be a text"),
            (
                json!({"unique": "true"}),
                "unique: \"true\" must be true or false",
            ),
            (
                json!({"kind": "c"}),
                "kind: \"c\" must be one of \"a\", \"b\"",
            ),
            (
                json!({"order": 4_294_967_295u32}),
                "order: 4294967295 must be a whole number from 1 to 3",
            ),
            (json!({"order": 2.5}), "order: 2.5 must be"),
            (json!({"order": -1}), "order: -1 must be"),
            (json!({"force": "1"}), "force: \"1\" must be a number"),
            (json!({"force": null}), "force: null must be a number"),
            (json!({"agreement": -1e-9}), "agreement: -1e-9 must be"),
            (json!({"abs": 0}), "abs: 0 must be a number above zero"),
            (
                json!({"rel": 1}),
                "rel: 1 must be a number above 0 and below 1",
            ),
            (
                json!({"list": []}),
                "list: a list of 0 entries must be a list of one entry or more",
            ),
            (json!({"list": [1, "x"]}), "list[1]: \"x\" must be a number"),
            (
                json!({"point": [1, 2]}),
                "point: has 2 entries, 3 are wanted",
            ),
            (
                json!({"by_node": {}}),
                "by_node: an object of 0 keys must be an object with a value",
            ),
            (
                json!({"by_node": {"a": [0, 0, 0]}}),
                "by_node: key \"a\" must be the number of a node",
            ),
            (
                json!({"by_node": {"1": [0, 0]}}),
                "by_node.1: has 2 entries",
            ),
            (
                json!({"pint": [1, 2, 3]}),
                "unknown key \"pint\": the nearest is `point`",
            ),
            (
                json!({"steps": [{"m": 1}, {"mm": 1}]}),
                "steps[1]: unknown key \"mm\": the nearest is `m`",
            ),
        ];
        for (value, words) in cases {
            let message = check(&value, &SHAPE, "").unwrap_err();
            assert!(message.contains(words), "{words}: {message}");
        }
    }
}
