//! Files of a case: regular ones of a bounded size. A pipe or a device would be read for ever.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::Failure;

/// bytes. The largest of the shipped cases has 0.2 MB of text.
const LONGEST_TEXT: u64 = 64 << 20;

/// Opens a regular file and tells its length, bytes.
pub(super) fn open(path: &Path) -> Result<(File, u64), Failure> {
    // Asked for before it is opened: opening a pipe waits for who writes into it.
    let metadata = std::fs::metadata(path).map_err(|e| wrong(path, &format!("{e}{MISSING}")))?;
    if !metadata.is_file() {
        return Err(wrong(
            path,
            "is no regular file; put the file itself into the case's folder",
        ));
    }
    let file = File::open(path).map_err(|e| wrong(path, &e.to_string()))?;
    Ok((file, metadata.len()))
}

const MISSING: &str = "; the case needs this file in its folder";

/// Text of a file, without a byte order mark.
pub(super) fn text(path: &Path) -> Result<String, Failure> {
    let (file, length) = open(path)?;
    if length > LONGEST_TEXT {
        return Err(wrong(
            path,
            &format!("has {length} bytes; a case's text has at most {LONGEST_TEXT}"),
        ));
    }
    let mut bytes = Vec::new();
    // It may grow while it is read.
    file.take(LONGEST_TEXT)
        .read_to_end(&mut bytes)
        .map_err(|e| wrong(path, &e.to_string()))?;
    let text = String::from_utf8(bytes).map_err(|e| {
        let before = &e.as_bytes()[..e.utf8_error().valid_up_to()];
        let line = 1 + before.iter().filter(|b| **b == b'\n').count();
        wrong(
            path,
            &format!("line {line}: is not UTF-8; save it as UTF-8"),
        )
    })?;
    Ok(match text.strip_prefix('\u{feff}') {
        Some(rest) => rest.to_owned(),
        None => text,
    })
}

/// A failure that names the file.
pub(super) fn wrong(path: &Path, what: &str) -> Failure {
    Failure::Error(format!("{}: {what}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(outcome: Result<String, Failure>) -> String {
        match outcome {
            Err(Failure::Error(message)) => message,
            other => format!("{other:?}"),
        }
    }

    #[test]
    fn what_is_no_text_file_is_refused_by_name() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("expected.json");
        assert!(message(text(&path)).contains("the case needs this file"));
        std::fs::create_dir(&path).unwrap();
        assert!(message(text(&path)).contains("no regular file"));
        let path = dir.path().join("case.toml");
        std::fs::write(&path, b"a\nb\n\xff").unwrap();
        assert!(message(text(&path)).contains("case.toml: line 3: is not UTF-8"));
        std::fs::write(&path, "\u{feff}a = 1").unwrap();
        assert_eq!(text(&path).unwrap(), "a = 1");
    }

    /// An endless device: read, it would fill the memory.
    #[cfg(unix)]
    #[test]
    fn an_endless_file_is_refused() {
        assert!(message(text(Path::new("/dev/zero"))).contains("no regular file"));
    }
}
