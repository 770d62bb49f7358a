//! What may be read.

use std::io;
use std::path::Path;

/// The path of a regular file. What is none, such as a device or a pipe, is refused unopened: it may never end.
pub(crate) fn regular(path: &Path) -> io::Result<&Path> {
    match std::fs::metadata(path)?.is_file() {
        true => Ok(path),
        false => Err(io::Error::new(io::ErrorKind::InvalidInput, "it is no regular file")),
    }
}
