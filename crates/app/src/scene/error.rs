//! What can be wrong with a scene, where, and the mend.

use std::path::{Path, PathBuf};

/// Why a scene was refused. `path` is the scene file, `line` counts from 1.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The file cannot be read.
    #[error("{}: cannot read the scene: {source}; check the path", path.display())]
    Read {
        /// Scene file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file is not text.
    #[error("{}:{line}: not UTF-8 text; save the scene as UTF-8", path.display())]
    NotUtf8 {
        /// Scene file.
        path: PathBuf,
        /// Line of the first bad byte.
        line: usize,
    },
    /// The file is not TOML.
    #[error("{}:{line}: not TOML: {what}", path.display())]
    Syntax {
        /// Scene file.
        path: PathBuf,
        /// Line.
        line: usize,
        /// What the TOML reader found.
        what: String,
    },
    /// A key that there is not.
    #[error("{}:{line}: unknown key `{key}`; {mend}", path.display())]
    UnknownKey {
        /// Scene file.
        path: PathBuf,
        /// Line.
        line: usize,
        /// The key.
        key: String,
        /// Nearest valid key.
        mend: String,
    },
    /// A word that is none of the choices.
    #[error("{}:{line}: {key} has no choice `{word}`; {mend}", path.display())]
    UnknownWord {
        /// Scene file.
        path: PathBuf,
        /// Line.
        line: usize,
        /// The key.
        key: String,
        /// The word.
        word: String,
        /// Nearest valid word.
        mend: String,
    },
    /// A key or section that must be there.
    #[error("{}:{line}: {what}; {mend}", path.display())]
    Missing {
        /// Scene file.
        path: PathBuf,
        /// Line of the section, or 1.
        line: usize,
        /// What is missing.
        what: String,
        /// What to write.
        mend: String,
    },
    /// A value of the wrong type.
    #[error("{}:{line}: {key}: {what}", path.display())]
    Type {
        /// Scene file.
        path: PathBuf,
        /// Line.
        line: usize,
        /// The key.
        key: String,
        /// What was found and what is expected.
        what: String,
    },
    /// A value that makes no sense.
    #[error("{}:{line}: {what}; {mend}", path.display())]
    Value {
        /// Scene file.
        path: PathBuf,
        /// Line.
        line: usize,
        /// Key, value and what is wrong.
        what: String,
        /// What to write instead.
        mend: String,
    },
}

impl SceneError {
    /// The mend for a misspelt name in other files than scenes, in the same words.
    pub(crate) fn mend_of(name: &str, known: &[&str]) -> String {
        suggestion(name, known)
    }

    /// The line it is about, counted from 1, if the file could be read.
    pub fn line(&self) -> Option<usize> {
        match self {
            Self::Read { .. } => None,
            Self::NotUtf8 { line, .. }
            | Self::Syntax { line, .. }
            | Self::UnknownKey { line, .. }
            | Self::UnknownWord { line, .. }
            | Self::Missing { line, .. }
            | Self::Type { line, .. }
            | Self::Value { line, .. } => Some(*line),
        }
    }
}

/// Text of a file's bytes. A byte order mark, as some editors write it, is dropped.
pub(super) fn text_of(bytes: Vec<u8>, path: &Path) -> Result<String, SceneError> {
    let text = String::from_utf8(bytes).map_err(|e| SceneError::NotUtf8 {
        path: path.to_path_buf(),
        line: 1 + e.as_bytes()[..e.utf8_error().valid_up_to()]
            .iter()
            .filter(|&&byte| byte == b'\n')
            .count(),
    })?;
    Ok(match text.strip_prefix('\u{feff}') {
        Some(rest) => rest.to_owned(),
        None => text,
    })
}

/// Text of the file within a message: line breaks and other control characters are escaped, so
/// that a message stays one line.
pub(super) fn plain(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        if c.is_control() {
            out.extend(c.escape_debug());
        } else {
            out.push(c);
        }
    }
    out
}

/// Line of a byte offset, counted from 1.
pub(super) fn line_of(source: &str, offset: usize) -> usize {
    let end = offset.min(source.len());
    1 + source.as_bytes()[..end]
        .iter()
        .filter(|&&byte| byte == b'\n')
        .count()
}

/// The mend for a misspelt name: the nearest valid one, and all if none is near.
pub(super) fn suggestion(name: &str, known: &[&str]) -> String {
    let Some(nearest) = nearest(name, known) else {
        return "there is none to choose from".to_owned();
    };
    let is_near = distance(name, nearest) <= name.chars().count() / 2;
    if is_near {
        format!("the nearest is `{nearest}`")
    } else {
        let all: Vec<String> = known.iter().map(|word| format!("`{word}`")).collect();
        format!("the nearest is `{nearest}`, all are {}", all.join(", "))
    }
}

/// The known name that takes the fewest edits, the first of equals.
fn nearest<'a>(name: &str, known: &[&'a str]) -> Option<&'a str> {
    known
        .iter()
        .copied()
        .min_by_key(|word| distance(name, word))
}

/// Levenshtein's distance, in characters, without regard to case. Long names are cut: what is
/// longer than any key is not near one.
fn distance(a: &str, b: &str) -> usize {
    const LONGEST: usize = 64;
    let letters = |text: &str| -> Vec<char> {
        text.chars()
            .take(LONGEST)
            .flat_map(char::to_lowercase)
            .collect()
    };
    let (a, b) = (letters(a), letters(b));
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, from) in a.iter().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, to) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(from != to);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Textbook pair: kitten to sitting takes three edits.
    #[test]
    fn distance_is_levenshteins() {
        assert_eq!(distance("kitten", "sitting"), 3);
        assert_eq!(distance("", "abc"), 3);
        assert_eq!(distance("Radius", "radius"), 0);
    }

    #[test]
    fn nearest_is_named_and_all_if_none_is_near() {
        assert_eq!(
            suggestion("radious", &["scale", "radius"]),
            "the nearest is `radius`"
        );
        let far = suggestion("q", &["scale", "radius"]);
        assert_eq!(far, "the nearest is `scale`, all are `scale`, `radius`");
        assert!(suggestion("q", &[]).starts_with("there is none"));
    }

    #[test]
    fn text_drops_a_byte_order_mark_and_finds_the_bad_line() {
        let path = Path::new("a.toml");
        assert_eq!(text_of("\u{feff}a = 1".into(), path).unwrap(), "a = 1");
        let error = text_of(b"a = 1\nb = \"\xff\"".to_vec(), path).unwrap_err();
        assert_eq!(
            error.to_string(),
            "a.toml:2: not UTF-8 text; save the scene as UTF-8"
        );
    }
}
