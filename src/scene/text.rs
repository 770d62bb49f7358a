//! Texts that a scene names by their files, such as shaders.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use thiserror::Error;

/// Why a text could not be had.
#[derive(Debug, Clone, Error)]
#[non_exhaustive]
pub enum TextError {
    /// There is no such file.
    #[error("there is no file {path}: check the name, it is relative to the folder of the file in which it stands", path = path.display())]
    Missing {
        /// The path that was tried.
        path: PathBuf,
    },
    /// The file could not be read.
    #[error("can not read {path}: {error}", path = path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        error: Arc<std::io::Error>,
    },
    /// The bytes are no text.
    #[error("{path} is not UTF-8 text from byte {at} on: save it as UTF-8", path = path.display())]
    NotUtf8 {
        /// The file.
        path: PathBuf,
        /// The first byte that is wrong, from 0.
        at: usize,
    },
}

impl TextError {
    /// The file at fault.
    #[must_use]
    pub fn path(&self) -> &Path {
        match self {
            TextError::Missing { path } | TextError::Unreadable { path, .. } | TextError::NotUtf8 { path, .. } => path,
        }
    }

    /// Why a file can not be read.
    pub(crate) fn of(path: &Path, error: std::io::Error) -> Self {
        let path = path.to_owned();
        match error.kind() {
            std::io::ErrorKind::NotFound => TextError::Missing { path },
            _ => TextError::Unreadable { path, error: Arc::new(error) },
        }
    }
}

/// The text in a file, without a byte order mark.
pub(super) fn read(path: &Path) -> Result<Arc<str>, TextError> {
    let bytes = super::regular(path).and_then(std::fs::read).map_err(|error| TextError::of(path, error))?;
    let text = std::str::from_utf8(&bytes)
        .map_err(|error| TextError::NotUtf8 { path: path.to_owned(), at: error.valid_up_to() })?;
    Ok(text.strip_prefix('\u{feff}').unwrap_or(text).into())
}
