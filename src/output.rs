//! Files that are written whole or not at all.

use std::fs::{File, Metadata};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use thiserror::Error;

/// Why a file could not be written. What stood there before still stands there.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum OutputError {
    /// The folder is not there.
    #[error("there is no folder {folder} to write {path} to: make it first", path = path.display(), folder = folder.display())]
    NoFolder {
        /// The file to be written.
        path: PathBuf,
        /// The folder that is missing.
        folder: PathBuf,
    },
    /// The path names a folder.
    #[error("{path} is a folder: give the name of a file", path = path.display())]
    IsFolder {
        /// The path.
        path: PathBuf,
    },
    /// The system refused.
    #[error("can not write {path}: {error}{}", hint(error), path = path.display())]
    Io {
        /// The file to be written.
        path: PathBuf,
        /// What the system said.
        error: io::Error,
    },
}

fn hint(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::StorageFull => ": free some space or write to another disk",
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            ": choose a folder that you may write to"
        }
        _ => "",
    }
}

/// Says whether a file could be written to this path, as far as can be told without writing. For asking before work that
/// takes long.
///
/// # Errors
///
/// When the folder is missing or the path names a folder.
pub fn check_target(path: &Path) -> Result<(), OutputError> {
    let io = |error| OutputError::Io { path: path.to_owned(), error };
    match std::fs::metadata(path) {
        Ok(found) if found.is_dir() => return Err(OutputError::IsFolder { path: path.to_owned() }),
        Ok(_) => return Ok(()),
        Err(error) if error.kind() == io::ErrorKind::NotFound || error.kind() == io::ErrorKind::NotADirectory => {}
        Err(error) => return Err(io(error)),
    }
    if path.as_os_str().is_empty() {
        return Err(io(io::Error::new(io::ErrorKind::InvalidInput, "the name is empty")));
    }
    let folder = folder_of(path);
    match std::fs::metadata(folder) {
        Ok(found) if found.is_dir() => Ok(()),
        _ => Err(OutputError::NoFolder { path: path.to_owned(), folder: folder.to_owned() }),
    }
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// Writes a file by handing a buffered writer to `content`. The file appears, or is replaced, when everything is written; an
/// error leaves what was there before. A link is followed; what is no plain file, such as a device or a pipe, is written to
/// as it is.
///
/// # Errors
///
/// When the folder is missing, or the system refuses: no permission, no space.
///
/// # Example
///
/// ```
/// use std::io::Write;
///
/// let folder = tempfile::tempdir()?;
/// let path = folder.path().join("a.txt");
/// seamount::output::write_file(&path, |out| out.write_all(b"all of it"))?;
/// assert_eq!(std::fs::read(&path)?, b"all of it");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_file(path: &Path, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), OutputError> {
    check_target(path)?;
    let written = match std::fs::metadata(path) {
        Ok(found) if !found.is_file() => write_in_place(path, content),
        found => write_beside(path, found.ok(), content),
    };
    written.map_err(|error| OutputError::Io { path: path.to_owned(), error })
}

fn write_in_place(path: &Path, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut out = BufWriter::new(File::options().write(true).open(path)?);
    content(&mut out)?;
    out.flush()
}

/// Writes to a new file in the same folder, which then takes the place of the old one in one step.
fn write_beside(
    path: &Path,
    old: Option<Metadata>,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let target = if old.is_some() { path.canonicalize()? } else { path.to_owned() };
    if old.is_some() {
        // A file that may not be written to must not be replaced either.
        File::options().append(true).open(&target)?;
    }
    let mut builder = tempfile::Builder::new();
    builder.prefix(".seamount-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // What the file had before, or what the user's umask leaves of read and write for all.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let mut file = builder.tempfile_in(folder_of(&target))?;
    let mut out = BufWriter::with_capacity(1 << 16, file.as_file_mut());
    content(&mut out)?;
    out.flush()?;
    drop(out);
    if let Some(old) = old {
        file.as_file().set_permissions(old.permissions())?;
    }
    // Errors that a disk reports late must come before the old file is gone.
    file.as_file().sync_all()?;
    file.persist(&target).map_err(|e| e.error)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_leaves_the_old_file_and_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        write_file(&path, |out| out.write_all(b"old")).unwrap();
        let error = write_file(&path, |out| {
            out.write_all(&[0; 1 << 20])?;
            Err(io::Error::other("no more"))
        })
        .unwrap_err();
        assert!(error.to_string().ends_with("a: no more"), "{error}");
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        write_file(&path, |out| out.write_all(b"new")).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"new");
    }

    #[test]
    fn targets_that_can_not_be_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let error = check_target(&folder.path().join("no/where.png")).unwrap_err();
        assert!(matches!(error, OutputError::NoFolder { .. }) && error.to_string().contains("make it first"));
        assert!(matches!(check_target(folder.path()).unwrap_err(), OutputError::IsFolder { .. }));
        std::fs::write(folder.path().join("file"), "").unwrap();
        let error = check_target(&folder.path().join("file/in.png")).unwrap_err();
        assert!(matches!(error, OutputError::NoFolder { .. }), "{error}");
        assert!(check_target(Path::new("")).is_err());
        assert!(check_target(Path::new("in-this-folder.png")).is_ok());
    }

    #[cfg(unix)]
    #[test]
    fn links_and_permissions_are_kept() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        std::fs::write(&file, "old").unwrap();
        std::fs::set_permissions(&file, std::fs::Permissions::from_mode(0o640)).unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        write_file(&link, |out| out.write_all(b"new")).unwrap();
        assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(std::fs::read(&file).unwrap(), b"new");
        assert_eq!(std::fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o640);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_reported() {
        let error = write_file(Path::new("/dev/full"), |out| out.write_all(b"x")).unwrap_err();
        assert!(error.to_string().contains("free some space"), "{error}");
        let kind = std::fs::metadata("/dev/full").unwrap().file_type();
        assert!(!kind.is_file());
    }
}
