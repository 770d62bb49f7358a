//! A picture read back from the device.

use std::io;
use std::path::Path;

use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder, ImageError};

use super::DrawReport;
use crate::output::{OutputError, write_file};

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

    /// Writes it as a PNG, whole or not at all; see [`write_file`].
    ///
    /// # Errors
    ///
    /// When the folder is missing or can not be written to, or the disk is full.
    pub fn save_png(&self, path: impl AsRef<Path>) -> Result<(), OutputError> {
        write_file(path.as_ref(), |out| {
            // Pictures are opaque: the fourth byte is left out.
            let rgb: Vec<u8> = self.rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
            let encoder = PngEncoder::new(out);
            encoder.write_image(&rgb, self.width, self.height, ExtendedColorType::Rgb8).map_err(|error| match error {
                ImageError::IoError(error) => error,
                other => io::Error::other(other),
            })
        })
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
}
