//! Pictures in memory, at the depth of their file.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing))]

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use thiserror::Error;

use crate::terrain::{HeightField, HeightFieldError, Voids};

/// Why a picture could not be had.
#[derive(Debug, Clone, Error)]
#[non_exhaustive]
pub enum ImageError {
    /// There is no such file.
    #[error("there is no file {path}: check the name, it is relative to the scene's folder", path = path.display())]
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
    /// The file is no picture, or a broken one.
    #[error("can not decode {path}: {reason}", path = path.display())]
    Broken {
        /// The file.
        path: PathBuf,
        /// What the decoder said.
        reason: String,
    },
    /// The number of values is not what width and height say.
    #[error("{width} × {height} pixels were announced, but {given} were given")]
    WrongCount {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
        /// Pixels that came.
        given: usize,
    },
}

impl ImageError {
    /// The file at fault.
    #[must_use]
    pub fn path(&self) -> Option<&Path> {
        match self {
            ImageError::Missing { path } | ImageError::Unreadable { path, .. } | ImageError::Broken { path, .. } => {
                Some(path)
            }
            ImageError::WrongCount { .. } => None,
        }
    }
}

/// The pixels of an [`Image`], row by row from the top left.
#[derive(Debug, Clone, PartialEq)]
pub enum Pixels {
    /// Grey, 8 bits.
    Gray8(Vec<u8>),
    /// Grey, 16 bits.
    Gray16(Vec<u16>),
    /// Grey, floats; for heights made in code.
    GrayF32(Vec<f32>),
    /// Colour, 8 bits, sRGB, with alpha.
    Rgba8(Vec<[u8; 4]>),
    /// Colour, 16 bits, sRGB, with alpha.
    Rgba16(Vec<[u16; 4]>),
}

impl Pixels {
    fn len(&self) -> usize {
        match self {
            Pixels::Gray8(p) => p.len(),
            Pixels::Gray16(p) => p.len(),
            Pixels::GrayF32(p) => p.len(),
            Pixels::Rgba8(p) => p.len(),
            Pixels::Rgba16(p) => p.len(),
        }
    }
}

/// A picture. Immutable; shared by `Arc`.
///
/// # Example
///
/// ```
/// use seamount::scene::{Image, Pixels};
///
/// let ramp = Image::new(4, 2, Pixels::GrayF32((0..8).map(|i| i as f32).collect()))?;
/// assert_eq!((ramp.width(), ramp.height()), (4, 2));
/// # Ok::<(), seamount::scene::ImageError>(())
/// ```
#[derive(Debug)]
pub struct Image {
    width: u32,
    height: u32,
    pixels: Pixels,
    id: u64,
}

/// Intensity of a colour, the weights of the original implementation: 0.2989 R + 0.5870 G + 0.1141 B.
fn intensity([r, g, b]: [f64; 3]) -> f64 {
    0.2989 * r + 0.5870 * g + 0.1141 * b
}

static NEXT_ID: AtomicU64 = AtomicU64::new(1);

impl Image {
    /// A picture from its pixels.
    ///
    /// # Errors
    ///
    /// [`ImageError::WrongCount`] when the number of pixels is not width × height.
    pub fn new(width: u32, height: u32, pixels: Pixels) -> Result<Self, ImageError> {
        if pixels.len() as u64 != u64::from(width) * u64::from(height) {
            return Err(ImageError::WrongCount { width, height, given: pixels.len() });
        }
        Ok(Self { width, height, pixels, id: NEXT_ID.fetch_add(1, Ordering::Relaxed) })
    }

    /// Reads and decodes a file (PNG, JPEG, TIFF or PNM), told by its content, at its full depth.
    ///
    /// # Errors
    ///
    /// When there is no such file, it can not be read, or it is not a picture that can be decoded.
    pub fn open(path: &Path) -> Result<Self, ImageError> {
        let unreadable = |error: std::io::Error| match error.kind() {
            std::io::ErrorKind::NotFound => ImageError::Missing { path: path.to_owned() },
            _ => ImageError::Unreadable { path: path.to_owned(), error: Arc::new(error) },
        };
        let broken = |reason: String| ImageError::Broken { path: path.to_owned(), reason };
        let mut reader =
            image::ImageReader::open(path).map_err(unreadable)?.with_guessed_format().map_err(unreadable)?;
        // Height maps of 16384² are 512 MiB; the decoder's default limit is less.
        let mut limits = image::Limits::default();
        limits.max_alloc = Some(4 << 30);
        reader.limits(limits);
        let decoded = reader.decode().map_err(|e| broken(e.to_string()))?;
        let (width, height) = (decoded.width(), decoded.height());
        use image::DynamicImage as D;
        let pixels = match decoded {
            D::ImageLuma8(i) => Pixels::Gray8(i.into_raw()),
            D::ImageLuma16(i) => Pixels::Gray16(i.into_raw()),
            D::ImageLumaA8(i) => Pixels::Gray8(i.pixels().map(|p| p.0[0]).collect()),
            D::ImageLumaA16(i) => Pixels::Gray16(i.pixels().map(|p| p.0[0]).collect()),
            D::ImageRgb16(_) | D::ImageRgba16(_) | D::ImageRgb32F(_) | D::ImageRgba32F(_) => {
                Pixels::Rgba16(decoded.into_rgba16().pixels().map(|p| p.0).collect())
            }
            other => Pixels::Rgba8(other.into_rgba8().pixels().map(|p| p.0).collect()),
        };
        Self::new(width, height, pixels)
    }

    /// Width in pixels.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The pixels.
    #[must_use]
    pub fn pixels(&self) -> &Pixels {
        &self.pixels
    }

    /// An identity that no other image of this process has or will have.
    #[must_use]
    pub fn id(&self) -> u64 {
        self.id
    }

    /// The picture as a map of heights. 8-bit grey becomes 16 bits exactly (v · 257), colour becomes its intensity
    /// 0.2989 R + 0.5870 G + 0.1141 B. `void_sample` is a value at the file's own depth.
    ///
    /// # Errors
    ///
    /// When there are fewer than 2 × 2 pixels, or too many.
    pub fn height_field(&self, void_sample: Option<f64>) -> Result<HeightField, HeightFieldError> {
        let (w, h) = (self.width, self.height);
        let voids = |scale: f64| Voids { sample: void_sample.map(|v| v * scale) };
        match &self.pixels {
            Pixels::Gray8(p) => {
                let samples = p.iter().map(|&v| u16::from(v) * 257).collect();
                HeightField::from_u16(w, h, samples, voids(257.0))
            }
            Pixels::Gray16(p) => HeightField::from_u16(w, h, p.clone(), voids(1.0)),
            Pixels::GrayF32(p) => HeightField::from_f32(w, h, p.clone(), voids(1.0)),
            Pixels::Rgba8(p) => {
                let value = |[r, g, b, _]: &[u8; 4]| intensity([r, g, b].map(|&c| f64::from(c)));
                colour_field(w, h, p.iter().map(value), 255.0, void_sample)
            }
            Pixels::Rgba16(p) => {
                let value = |[r, g, b, _]: &[u16; 4]| intensity([r, g, b].map(|&c| f64::from(c)));
                colour_field(w, h, p.iter().map(value), 65535.0, void_sample)
            }
        }
    }

    /// The picture as 8-bit sRGB with alpha, for a colour texture.
    #[must_use]
    pub fn rgba8(&self) -> Vec<[u8; 4]> {
        let wide = |v: u16| ((u32::from(v) + 128) / 257) as u8;
        match &self.pixels {
            Pixels::Gray8(p) => p.iter().map(|&v| [v, v, v, 255]).collect(),
            Pixels::Gray16(p) => p.iter().map(|&v| [wide(v), wide(v), wide(v), 255]).collect(),
            Pixels::GrayF32(p) => p
                .iter()
                .map(|&v| {
                    let v = (v.clamp(0.0, 1.0) * 255.0).round() as u8;
                    [v, v, v, 255]
                })
                .collect(),
            Pixels::Rgba8(p) => p.clone(),
            Pixels::Rgba16(p) => p.iter().map(|&c| c.map(wide)).collect(),
        }
    }
}

fn colour_field(
    width: u32,
    height: u32,
    values: impl Iterator<Item = f64>,
    depth: f64,
    void_sample: Option<f64>,
) -> Result<HeightField, HeightFieldError> {
    let samples = values
        .map(|v| {
            // The void is compared at the file's depth, before scaling rounds it.
            if void_sample == Some(v) { f32::NAN } else { (v / depth) as f32 }
        })
        .collect();
    HeightField::from_f32(width, height, samples, Voids::default())
}
