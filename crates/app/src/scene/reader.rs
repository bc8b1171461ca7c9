//! What the TOML reader says, in our words.

use std::path::Path;

use super::error::{SceneError, line_of, plain, suggestion};
use super::schema::REQUIRED_SECTIONS;

/// The TOML reader's error in our words. Its messages are serde's, which name the wrong word and
/// the right ones in backticks.
pub(super) fn translate(error: &toml::de::Error, source: &str, path: &Path) -> SceneError {
    let offset = error.span().map_or(0, |span| span.start);
    let line = line_of(source, offset);
    let path = path.to_path_buf();
    let message = error.message();
    // The name is the file's and may hold backticks itself; the known ones behind it do not.
    let (head, tail) = message.rsplit_once(", expected ").unwrap_or((message, ""));
    let first = head.split_once('`').map_or("", |(_, name)| name);
    let first = plain(first.strip_suffix('`').unwrap_or(first));
    let known: Vec<&str> = tail.split('`').skip(1).step_by(2).collect();
    if message.starts_with("unknown field") {
        let mend = suggestion(&first, &known);
        SceneError::UnknownKey {
            path,
            line,
            key: first,
            mend,
        }
    } else if message.starts_with("unknown variant") {
        let (key, mend) = (key_before(source, offset), suggestion(&first, &known));
        SceneError::UnknownWord {
            path,
            line,
            key,
            word: first,
            mend,
        }
    } else if message.starts_with("missing field") {
        let (what, mend) = if REQUIRED_SECTIONS.contains(&first.as_str()) {
            let what = format!("section [{first}] is missing");
            (what, "docs/scene.md has an example".to_owned())
        } else {
            let section = section_at(source, offset);
            let what = format!("key `{first}` is missing{section}");
            (what, format!("add `{first} = ...`"))
        };
        SceneError::Missing {
            path,
            line,
            what,
            mend,
        }
    } else if message.starts_with("invalid type") || message.starts_with("invalid length") {
        SceneError::Type {
            path,
            line,
            key: key_before(source, offset),
            what: in_words(&one_line(message)),
        }
    } else if message == "wanted string or table" {
        // What the reader says of a choice that is not a word.
        SceneError::Type {
            path,
            line,
            key: key_before(source, offset),
            what: "not a word; write one in quotes".to_owned(),
        }
    } else {
        SceneError::Syntax {
            path,
            line,
            what: one_line(message),
        }
    }
}

/// Serde's names of types in those of the document.
fn in_words(message: &str) -> String {
    let (found, expected) = message.rsplit_once(", expected ").unwrap_or((message, ""));
    let expected = match expected {
        "" => return message.to_owned(),
        "f64" => "a number",
        "i64" => "a whole number that fits 64 bits",
        section if section.starts_with("struct ") => "a section",
        other => other,
    };
    let found = found.strip_suffix(" as i128").unwrap_or(found);
    let found = match found {
        "invalid type: map" => "invalid type: table",
        other => other,
    };
    format!("{found}, expected {expected}")
}

fn one_line(message: &str) -> String {
    let lines: Vec<&str> = message
        .lines()
        .map(str::trim)
        .filter(|line| !line.is_empty())
        .collect();
    plain(&lines.join("; "))
}

/// Name of the key whose value stands at an offset, for messages: the last `name =` before it.
fn key_before(source: &str, offset: usize) -> String {
    let before = source.get(..offset).unwrap_or_default();
    let key = before
        .rfind('=')
        .map_or("", |equals| before[..equals].trim_end());
    let start = key.rfind(|c: char| !(c.is_alphanumeric() || "_-.".contains(c)));
    let start = start.map_or(0, |at| {
        at + key[at..].chars().next().map_or(0, char::len_utf8)
    });
    match &key[start..] {
        "" => "value".to_owned(),
        name => name.to_owned(),
    }
}

/// ` in [section]` if the offset is at or below a section's header.
fn section_at(source: &str, offset: usize) -> String {
    let end = source
        .get(offset..)
        .and_then(|rest| rest.find('\n'))
        .map_or(source.len(), |length| offset + length);
    let before = source.get(..end).unwrap_or_default();
    let header = before
        .lines()
        .rev()
        .map(str::trim)
        .find(|line| line.starts_with('['));
    match header.and_then(|line| line.split(']').next()) {
        Some(header) => format!(" in {header}]"),
        None => String::new(),
    }
}
