//! A picture read back from the device.

use std::io::{BufWriter, Write};
use std::path::Path;

use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};

use super::{DrawReport, RenderError};

/// A picture in memory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Four bytes a pixel, row by row from the top left: red, green and blue encoded as sRGB, and 255.
    pub rgba: Vec<u8>,
    /// What drawing it took.
    pub report: DrawReport,
}

impl Picture {
    /// Red, green and blue of a pixel, encoded as sRGB; `None` outside. Pixels count from the top left.
    #[must_use]
    pub fn pixel(&self, x: u32, y: u32) -> Option<[u8; 3]> {
        if x >= self.width || y >= self.height {
            return None;
        }
        let at = (y as usize * self.width as usize + x as usize) * 4;
        self.rgba.get(at..at + 3)?.try_into().ok()
    }

    /// Writes it as a PNG. The file is written under another name in the same folder and takes its place when it is
    /// complete: whatever goes wrong, there is the old file or the new one, and never half of one. What is no regular file
    /// (a pipe, a device) is written to directly.
    ///
    /// # Errors
    ///
    /// [`RenderError::Write`], when the folder is missing or can not be written to, or the disk is full.
    pub fn save_png(&self, path: impl AsRef<Path>) -> Result<(), RenderError> {
        let path = path.as_ref();
        let failed = |reason: String| RenderError::Write { path: path.to_owned(), reason };
        let folder = match path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        if path.is_dir() {
            return Err(failed("it is a folder: give the name of a file".to_owned()));
        }
        if !folder.is_dir() {
            return Err(failed(format!("there is no folder {}: make it first", folder.display())));
        }
        let png = self.png().map_err(failed)?;
        if path.exists() && !path.is_file() {
            let written = std::fs::OpenOptions::new().write(true).open(path).and_then(|mut file| file.write_all(&png));
            return written.map_err(|e| failed(e.to_string()));
        }
        // Through a link to what it points at, as writing to it would.
        let target = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        let folder = target.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(folder);
        let mut builder = tempfile::Builder::new();
        builder.prefix(".picture-").suffix(".png");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // As any new file: what the umask leaves of this.
            builder.permissions(std::fs::Permissions::from_mode(0o666));
        }
        let mut file = builder.tempfile_in(folder).map_err(|e| failed(e.to_string()))?;
        file.write_all(&png).and_then(|()| file.as_file().sync_all()).map_err(|e| failed(e.to_string()))?;
        file.persist(&target).map_err(|e| failed(e.error.to_string()))?;
        Ok(())
    }

    fn png(&self) -> Result<Vec<u8>, String> {
        // Pictures are opaque: the fourth byte is left out.
        let rgb: Vec<u8> = self.rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
        let mut png = Vec::new();
        let encoder = PngEncoder::new(BufWriter::new(&mut png));
        encoder.write_image(&rgb, self.width, self.height, ExtendedColorType::Rgb8).map_err(|e| e.to_string())?;
        Ok(png)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture() -> Picture {
        Picture { width: 2, height: 1, rgba: vec![1, 2, 3, 255, 250, 0, 9, 255], report: DrawReport::default() }
    }

    #[test]
    fn a_picture_is_written_whole_and_leaves_nothing_beside_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        std::fs::write(&path, "old").unwrap();
        picture().save_png(&path).unwrap();
        let read = image::open(&path).unwrap().into_rgba8();
        assert_eq!(read.into_raw(), picture().rgba);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        assert_eq!(picture().pixel(1, 0), Some([250, 0, 9]));
        assert_eq!(picture().pixel(2, 0), None);
    }

    #[test]
    fn what_can_not_be_written_says_why() {
        let folder = tempfile::tempdir().unwrap();
        let missing = picture().save_png(folder.path().join("none").join("a.png")).unwrap_err().to_string();
        assert!(missing.contains("there is no folder") && missing.contains("none"), "{missing}");
        let is_folder = picture().save_png(folder.path()).unwrap_err().to_string();
        assert!(is_folder.contains("is a folder"), "{is_folder}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    /// A device that is always full stands for a disk that is.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_an_error() {
        let error = picture().save_png("/dev/full").unwrap_err().to_string();
        assert!(error.contains("/dev/full") && error.contains("space"), "{error}");
    }
}
