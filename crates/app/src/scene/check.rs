//! From a value as written to one that makes sense, in SI.

use std::path::{Path, PathBuf};

use glam::DVec3;

use super::error::{SceneError, line_of, plain};
use super::keys::{At, Direction, In, Vector, Whole};
use super::units::{TABLE, Units, to_si};

/// What every check needs: the text for lines, the path for messages, the units.
pub(super) struct Check<'a> {
    pub(super) source: &'a str,
    pub(super) path: &'a Path,
    pub(super) units: Units,
}

/// Which values a number may have, in the file's units, with the words for it.
#[derive(Clone, Copy)]
pub(super) enum Range {
    Positive,
    NotNegative,
    Any,
}

impl Check<'_> {
    /// Line of a byte offset.
    pub(super) fn line(&self, offset: usize) -> usize {
        line_of(self.source, offset)
    }

    /// A value that makes no sense.
    pub(super) fn error(
        &self,
        offset: usize,
        what: impl AsRef<str>,
        mend: impl Into<String>,
    ) -> SceneError {
        SceneError::Value {
            path: self.path.to_path_buf(),
            line: self.line(offset),
            what: plain(what.as_ref()),
            mend: mend.into(),
        }
    }

    /// What must be there; `offset` is that of its section.
    pub(super) fn missing(
        &self,
        offset: usize,
        what: impl Into<String>,
        mend: impl Into<String>,
    ) -> SceneError {
        SceneError::Missing {
            path: self.path.to_path_buf(),
            line: self.line(offset),
            what: what.into(),
            mend: mend.into(),
        }
    }

    /// A finite number in range, in SI.
    pub(super) fn number<const Q: usize>(
        &self,
        key: &str,
        number: At<In<Q>>,
        range: Range,
    ) -> Result<f64, SceneError> {
        let (written, offset) = (number.value.0, number.offset);
        let value = written * to_si(self.units, TABLE[Q].0);
        if !written.is_finite() {
            return Err(self.error(offset, format!("{key} is {written}"), "write a number"));
        }
        if !value.is_finite() || (value == 0.0 && written != 0.0) {
            let what = format!("{key} {written:e} is beyond what SI numbers can hold");
            return Err(self.error(offset, what, "check the units"));
        }
        match range {
            Range::Positive if value <= 0.0 => {
                let what = format!("{key} {written} must be above 0");
                Err(self.error(offset, what, "write a positive number"))
            }
            Range::NotNegative if value < 0.0 => {
                let what = format!("{key} {written} must not be negative");
                Err(self.error(offset, what, "write 0 or more"))
            }
            _ => Ok(value),
        }
    }

    /// As `number`, if it is written.
    pub(super) fn optional<const Q: usize>(
        &self,
        key: &str,
        number: Option<At<In<Q>>>,
        range: Range,
    ) -> Result<Option<f64>, SceneError> {
        number
            .map(|number| self.number(key, number, range))
            .transpose()
    }

    /// As `number`, or the default, which is in SI.
    pub(super) fn number_or<const Q: usize>(
        &self,
        key: &str,
        number: Option<At<In<Q>>>,
        default: f64,
        range: Range,
    ) -> Result<f64, SceneError> {
        Ok(self.optional(key, number, range)?.unwrap_or(default))
    }

    /// Each component as `number`.
    pub(super) fn vector<const N: usize, const Q: usize>(
        &self,
        key: &str,
        vector: At<Vector<N, Q>>,
        range: Range,
    ) -> Result<[f64; N], SceneError> {
        let mut values = vector.value.0;
        for (value, name) in values.iter_mut().zip(["x", "y", "z", "w"]) {
            let component = At {
                value: In::<Q>(*value),
                offset: vector.offset,
            };
            *value = self.number(&format!("{key} {name}"), component, range)?;
        }
        Ok(values)
    }

    /// Unit vector of a direction.
    pub(super) fn direction(&self, key: &str, direction: Direction) -> Result<DVec3, SceneError> {
        let written = self.vector(key, direction, Range::Any)?;
        // First by the largest component, so that the square neither overflows nor vanishes.
        let vector = DVec3::from_array(written);
        (vector / vector.abs().max_element())
            .try_normalize()
            .ok_or_else(|| {
                let what = format!("{key} {written:?} has no direction");
                let mend = "write where it points, such as [0.0, -1.0, 0.0]";
                self.error(direction.offset, what, mend)
            })
    }

    /// A whole number within its bounds.
    pub(super) fn whole<const LEAST: u32, const MOST: u32>(
        &self,
        key: &str,
        number: Whole<LEAST, MOST>,
    ) -> Result<u32, SceneError> {
        let fits = u32::try_from(number.value.0).ok();
        fits.filter(|fits| (LEAST..=MOST).contains(fits))
            .ok_or_else(|| {
                let what = format!("{key} {} is out of range", number.value.0);
                self.error(number.offset, what, format!("write {LEAST} to {MOST}"))
            })
    }

    /// Relative to the scene's folder.
    pub(super) fn beside(&self, name: &str) -> PathBuf {
        self.path.parent().unwrap_or(Path::new("")).join(name)
    }

    /// A file that is there; its name is relative to the scene's folder.
    pub(super) fn file(
        &self,
        key: &str,
        name: &At<String>,
        mend: &str,
    ) -> Result<PathBuf, SceneError> {
        let path = self.beside(&name.value);
        if path.is_file() {
            return Ok(path);
        }
        let found = if path.is_dir() {
            "is a folder"
        } else {
            "does not exist"
        };
        let what = format!("{key} file {} {found}", path.display());
        Err(self.error(name.offset, what, mend))
    }
}
