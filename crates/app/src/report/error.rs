//! Why a result file could not be written.

use std::path::{Path, PathBuf};

/// Why a result file could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReportError {
    /// The file or its folder.
    #[error("{path}: cannot write: {source}", path = path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A plot.
    #[error("{path}: cannot draw the plot: {cause}", path = path.display())]
    Plot {
        /// The file.
        path: PathBuf,
        /// What the plot library says.
        cause: String,
    },
    /// A picture.
    #[error("{path}: cannot encode the picture: {cause}", path = path.display())]
    Picture {
        /// The file.
        path: PathBuf,
        /// What the encoder says.
        cause: String,
    },
    /// A deformed shape.
    #[error("{path}: cannot write the shape: {cause}", path = path.display())]
    Shape {
        /// The file.
        path: PathBuf,
        /// What the writer says.
        cause: String,
    },
    /// The recording of the session.
    #[error("{path}: cannot write the recording: {cause}", path = path.display())]
    Recording {
        /// The file.
        path: PathBuf,
        /// What the writer says.
        cause: String,
    },
    /// The data contradict themselves.
    #[error("{what}")]
    Inconsistent {
        /// How.
        what: String,
    },
}

impl ReportError {
    pub(super) fn plot(path: &Path, cause: impl ToString) -> Self {
        Self::Plot {
            path: path.to_path_buf(),
            cause: cause.to_string(),
        }
    }

    pub(super) fn picture(path: &Path, cause: impl ToString) -> Self {
        Self::Picture {
            path: path.to_path_buf(),
            cause: cause.to_string(),
        }
    }

    pub(super) fn shape(path: &Path, cause: impl ToString) -> Self {
        Self::Shape {
            path: path.to_path_buf(),
            cause: cause.to_string(),
        }
    }

    pub(super) fn recording(path: &Path, cause: impl ToString) -> Self {
        Self::Recording {
            path: path.to_path_buf(),
            cause: cause.to_string(),
        }
    }
}
