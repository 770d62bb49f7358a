//! Pictures in memory, at the depth of their file.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing))]

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

use thiserror::Error;

use crate::terrain::{HeightField, HeightFieldError, SampleRect, Samples, Voids};

/// Why a picture could not be had.
#[derive(Debug, Clone, Error)]
#[non_exhaustive]
pub enum ImageError {
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
    /// A rectangle to change lies beyond the picture.
    #[error(
        "columns {c0}..{c1}, rows {r0}..{r1} do not lie within a picture of {width} × {height} pixels",
        c0 = rect.column,
        c1 = u64::from(rect.column) + u64::from(rect.columns),
        r0 = rect.row,
        r1 = u64::from(rect.row) + u64::from(rect.rows)
    )]
    Outside {
        /// The rectangle.
        rect: SampleRect,
        /// Width of the picture.
        width: u32,
        /// Height of the picture.
        height: u32,
    },
    /// Pixels of one kind can not be put into a picture of another.
    #[error("{given} were given, but the picture is made of {image}: give samples of its own depth")]
    OtherDepth {
        /// What was given.
        given: &'static str,
        /// What the picture has.
        image: &'static str,
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
            ImageError::WrongCount { .. } | ImageError::Outside { .. } | ImageError::OtherDepth { .. } => None,
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
    /// What kind of pixels they are, for messages.
    fn depth(&self) -> &'static str {
        match self {
            Pixels::Gray8(_) => "8-bit grey",
            Pixels::Gray16(_) => "16-bit grey",
            Pixels::GrayF32(_) => "floats",
            Pixels::Rgba8(_) => "8-bit colours",
            Pixels::Rgba16(_) => "16-bit colours",
        }
    }

    /// The pixels as heights, with the void in their units. 8-bit grey becomes 16 bits exactly (v · 257), colour becomes its
    /// intensity.
    pub(super) fn samples(&self, void_sample: Option<f64>) -> (Samples, Voids) {
        let voids = |scale: f64| Voids { sample: void_sample.map(|v| v * scale) };
        match self {
            Pixels::Gray8(p) => (Samples::U16(p.iter().map(|&v| u16::from(v) * 257).collect()), voids(257.0)),
            Pixels::Gray16(p) => (Samples::U16(p.clone()), voids(1.0)),
            Pixels::GrayF32(p) => (Samples::F32(p.clone()), voids(1.0)),
            Pixels::Rgba8(p) => {
                let value = |[r, g, b, _]: &[u8; 4]| intensity([r, g, b].map(|&c| f64::from(c)));
                colour_samples(p.iter().map(value), 255.0, void_sample)
            }
            Pixels::Rgba16(p) => {
                let value = |[r, g, b, _]: &[u16; 4]| intensity([r, g, b].map(|&c| f64::from(c)));
                colour_samples(p.iter().map(value), 65535.0, void_sample)
            }
        }
    }

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
    /// Found out when it is asked for first.
    opaque: OnceLock<bool>,
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
        Ok(Self { width, height, pixels, id: NEXT_ID.fetch_add(1, Ordering::Relaxed), opaque: OnceLock::new() })
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
        let reader = super::regular(path).and_then(image::ImageReader::open).map_err(unreadable)?;
        let mut reader = reader.with_guessed_format().map_err(unreadable)?;
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

    /// Whether nothing shows through, as the 8 bits that are drawn have it.
    ///
    /// ```
    /// use seamount::scene::{Image, Pixels};
    ///
    /// assert!(Image::new(1, 1, Pixels::Rgba8(vec![[0, 0, 0, 255]]))?.is_opaque());
    /// assert!(!Image::new(1, 1, Pixels::Rgba8(vec![[0, 0, 0, 254]]))?.is_opaque());
    /// # Ok::<(), seamount::scene::ImageError>(())
    /// ```
    #[must_use]
    pub fn is_opaque(&self) -> bool {
        *self.opaque.get_or_init(|| match &self.pixels {
            Pixels::Gray8(_) | Pixels::Gray16(_) | Pixels::GrayF32(_) => true,
            Pixels::Rgba8(p) => p.iter().all(|&[.., alpha]| alpha == u8::MAX),
            Pixels::Rgba16(p) => p.iter().all(|&[.., alpha]| wide(alpha) == u8::MAX),
        })
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
        let (samples, voids) = self.pixels.samples(void_sample);
        HeightField::new(self.width, self.height, samples, voids)
    }

    /// The picture with other pixels in a rectangle of it, in the memory of this one unless somebody else holds it too. It
    /// has an identity of its own.
    ///
    /// # Errors
    ///
    /// When the rectangle is not within the picture, the number of pixels is not that of the rectangle, or they are of
    /// another kind.
    ///
    /// ```
    /// use std::sync::Arc;
    ///
    /// use seamount::scene::{Image, Pixels};
    /// use seamount::terrain::SampleRect;
    ///
    /// let flat = Arc::new(Image::new(3, 2, Pixels::Gray16(vec![7; 6]))?);
    /// let middle = SampleRect { column: 1, row: 0, columns: 1, rows: 2 };
    /// let edited = flat.overwritten(middle, &Pixels::Gray16(vec![8, 9]))?;
    /// assert_eq!(edited.pixels(), &Pixels::Gray16(vec![7, 8, 7, 7, 9, 7]));
    /// # Ok::<(), seamount::scene::ImageError>(())
    /// ```
    pub fn overwritten(self: Arc<Self>, rect: SampleRect, with: &Pixels) -> Result<Self, ImageError> {
        fn copy<T: Copy>(pixels: &mut [T], width: usize, rect: SampleRect, with: &[T]) {
            let (column, columns) = (rect.column as usize, rect.columns as usize);
            let lines = pixels.chunks_exact_mut(width).skip(rect.row as usize);
            for (line, with) in lines.zip(with.chunks_exact(columns.max(1))) {
                if let Some(part) = line.get_mut(column..column + columns) {
                    part.copy_from_slice(with);
                }
            }
        }
        self.check(rect, with)?;
        let mut image = Arc::try_unwrap(self).unwrap_or_else(|shared| Self {
            width: shared.width,
            height: shared.height,
            pixels: shared.pixels.clone(),
            id: 0,
            opaque: OnceLock::new(),
        });
        image.id = NEXT_ID.fetch_add(1, Ordering::Relaxed);
        image.opaque = OnceLock::new();
        let width = image.width.max(1) as usize;
        match (&mut image.pixels, with) {
            (Pixels::Gray8(p), Pixels::Gray8(with)) => copy(p, width, rect, with),
            (Pixels::Gray16(p), Pixels::Gray16(with)) => copy(p, width, rect, with),
            (Pixels::GrayF32(p), Pixels::GrayF32(with)) => copy(p, width, rect, with),
            (Pixels::Rgba8(p), Pixels::Rgba8(with)) => copy(p, width, rect, with),
            (Pixels::Rgba16(p), Pixels::Rgba16(with)) => copy(p, width, rect, with),
            _ => {}
        }
        Ok(image)
    }

    /// Whether pixels can be put into a rectangle of the picture.
    pub(super) fn check(&self, rect: SampleRect, with: &Pixels) -> Result<(), ImageError> {
        if !rect.is_within(self.width, self.height) {
            return Err(ImageError::Outside { rect, width: self.width, height: self.height });
        }
        if with.len() as u64 != u64::from(rect.columns) * u64::from(rect.rows) {
            return Err(ImageError::WrongCount { width: rect.columns, height: rect.rows, given: with.len() });
        }
        if with.depth() != self.pixels.depth() {
            return Err(ImageError::OtherDepth { given: with.depth(), image: self.pixels.depth() });
        }
        Ok(())
    }

    /// Heights as [`Image::height_field`] reads them, 0..1 for pixels of integers; what is no number is 0.
    #[cfg(feature = "render")]
    pub(crate) fn intensities(&self) -> Vec<f32> {
        match self.pixels.samples(None).0 {
            Samples::U16(samples) => samples.into_iter().map(|v| f32::from(v) / 65_535.0).collect(),
            Samples::F32(samples) => samples.into_iter().map(|v| if v.is_finite() { v } else { 0.0 }).collect(),
        }
    }

    /// The picture as 8-bit sRGB with alpha, for a colour texture.
    #[must_use]
    pub fn rgba8(&self) -> Vec<[u8; 4]> {
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

/// 16 bits as 8.
fn wide(v: u16) -> u8 {
    ((u32::from(v) + 128) / 257) as u8
}

fn colour_samples(values: impl Iterator<Item = f64>, depth: f64, void_sample: Option<f64>) -> (Samples, Voids) {
    let samples = values
        .map(|v| {
            // The void is compared at the file's depth, before scaling rounds it.
            if void_sample == Some(v) { f32::NAN } else { (v / depth) as f32 }
        })
        .collect();
    (Samples::F32(samples), Voids::default())
}
