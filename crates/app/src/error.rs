//! Everything that can end a command, with the exit code it means.

use std::path::PathBuf;

use crate::{crash, interrupt};

/// Why a command ended without its result.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The scene file.
    #[error(transparent)]
    Scene(#[from] crate::scene::SceneError),
    /// The mesh, the material or the supports.
    #[error("{path}: {source}", path = path.display())]
    Part {
        /// The mesh file.
        path: PathBuf,
        /// What is wrong with it.
        source: fem::Error,
    },
    /// The tool.
    #[error("{path}: {source}", path = path.display())]
    Tool {
        /// The scene or tool file.
        path: PathBuf,
        /// What is wrong with it.
        source: contact::Error,
    },
    /// The device.
    #[error("device: {0}")]
    Device(#[from] device::DeviceError),
    /// The GPU path or its CPU twin.
    #[error("compliance multiply: {0}")]
    Multiply(#[from] gpu::Error),
    /// `accuracy.multiply = "gpu"` where that cannot be.
    #[error("accuracy.multiply is \"gpu\", but {source} (multiply = \"auto\" or \"cpu\")")]
    GpuAsked {
        /// What is in the way.
        source: gpu::Error,
    },
    /// Writing the result.
    #[error("{0}; make room or name another folder with --out (an earlier result is untouched)")]
    Report(#[from] crate::report::ReportError),
    /// A file or folder that cannot be read or written.
    #[error("{path}: cannot {action}: {source}", path = path.display())]
    Io {
        /// Where.
        path: PathBuf,
        /// What was tried.
        action: &'static str,
        /// What the system says.
        source: std::io::Error,
    },
    /// The engine beside the haptic loop ended before the loop.
    #[error(
        "the engine beside the haptic loop ended before its time; the device was released and nothing was written; run with accuracy.rates = \"one\" and report this"
    )]
    EngineEnded,
    /// Input that fits no command.
    #[error("{0}")]
    Input(String),
    /// Ctrl-C.
    #[error("stopped by Ctrl-C; nothing was written and earlier results are untouched")]
    Interrupted,
}

impl Error {
    /// 130 for Ctrl-C, 70 for a fault of the program, else 2: a usage or input error.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Interrupted => interrupt::EXIT_CODE,
            Self::EngineEnded => crash::EXIT_CODE,
            Self::Part { source, .. } if source.is_cancelled() => interrupt::EXIT_CODE,
            _ => 2,
        }
    }

    /// Whether the user stopped it.
    pub(crate) fn is_interrupt(&self) -> bool {
        self.exit_code() == interrupt::EXIT_CODE
    }

    pub(crate) fn part(path: &std::path::Path, source: fem::Error) -> Self {
        if source.is_cancelled() {
            return Self::Interrupted;
        }
        Self::Part {
            path: path.to_path_buf(),
            source,
        }
    }

    pub(crate) fn io(
        path: &std::path::Path,
        action: &'static str,
    ) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self::Io {
            path,
            action,
            source,
        }
    }
}
