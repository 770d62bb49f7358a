//! Fonts: what characters look like and how wide they are.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing))]

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, LazyLock, Mutex, PoisonError};

use ab_glyph::{Font as _, FontArc, GlyphId, Outline, OutlineCurve, Rect, point};
use thiserror::Error;

/// Why a font could not be had.
#[derive(Debug, Clone, Error)]
#[non_exhaustive]
pub enum FontError {
    /// There is no such file.
    #[error(
        "there is no font {path}: the `name` of a Font is \"defaultFont\", which is always there, or a file (.ttf or .otf), \
         relative to the folder of the file in which it stands",
        path = path.display()
    )]
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
    /// The file is no font, or one without sizes.
    #[error("{path} is no font that can be used: a TrueType or OpenType file (.ttf or .otf) is wanted", path = path.display())]
    Broken {
        /// The file.
        path: PathBuf,
    },
    /// The size can not be used.
    #[error("a font of {0} pixels does not work: from above 0 to {MOST_PIXELS}")]
    Size(f64),
}

impl FontError {
    /// Why a file can not be read.
    pub(crate) fn of(path: &Path, error: std::io::Error) -> Self {
        let path = path.to_owned();
        match error.kind() {
            std::io::ErrorKind::NotFound => FontError::Missing { path },
            _ => FontError::Unreadable { path, error: Arc::new(error) },
        }
    }
}

/// Largest size of a font: to paint a character of one em by one takes 4 MiB then, an f32 for each pixel.
pub(crate) const MOST_PIXELS: f64 = 1024.0;

/// How far the ink of a character may be from its pen, in ems: nothing is drawn eight times as large as it is said to be.
pub(crate) const MOST_REACH: f64 = 8.0;

/// Most pixels of the rectangle around a character: 4 by 4 ems of the largest size, which take 64 MiB to paint.
const MOST_AREA: f64 = 16.0 * MOST_PIXELS * MOST_PIXELS;

/// The font that is always there.
pub(crate) const DEFAULT_FONT: &str = "defaultFont";

/// A font, its lengths in ems: multiples of its size. x runs to the right and y up from the pen on the baseline.
#[derive(Debug)]
pub(crate) struct Typeface {
    font: FontArc,
    /// An identity that no other has.
    id: u64,
    /// From the font's own units to ems.
    scale: f64,
    /// The largest advance of a glyph.
    widest: f64,
    /// How far the ink of a character reaches; `None` without any.
    ink: Mutex<HashMap<u16, Option<Ink>>>,
}

/// The smallest rectangle around what is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ink {
    pub(crate) left: f64,
    pub(crate) right: f64,
    pub(crate) bottom: f64,
    pub(crate) top: f64,
}

/// Ems that a character without a glyph takes in a font that does not say.
const NO_ADVANCE: f64 = 0.5;

/// That of [`DEFAULT_FONT`], read once.
static BUILT_IN: LazyLock<Result<Arc<Typeface>, FontError>> = LazyLock::new(|| {
    let font = FontArc::try_from_slice(epaint_default_fonts::HACK_REGULAR).ok();
    font.and_then(Typeface::new).map(Arc::new).ok_or_else(|| FontError::Broken { path: DEFAULT_FONT.into() })
});

impl Typeface {
    fn new(font: FontArc) -> Option<Self> {
        static NEXT_ID: AtomicU64 = AtomicU64::new(1);
        let scale = 1.0 / f64::from(font.units_per_em()?);
        let height = f64::from(font.height_unscaled()) * scale;
        let usable = scale > 0.0 && scale.is_finite() && height > 0.0 && height.is_finite();
        let id = NEXT_ID.fetch_add(1, Ordering::Relaxed);
        let glyphs = (0..=u16::MAX).take(font.glyph_count());
        let widest = glyphs.map(|glyph| font.h_advance_unscaled(GlyphId(glyph))).fold(0.0, f32::max);
        let widest = (f64::from(widest) * scale).max(NO_ADVANCE);
        usable.then(|| Self { font, id, scale, widest, ink: Mutex::default() })
    }

    /// The font in a file, or the one that is always there.
    pub(super) fn read(file: Option<&Path>) -> Result<Arc<Self>, FontError> {
        let Some(path) = file else { return BUILT_IN.clone() };
        let bytes = super::regular(path).and_then(std::fs::read).map_err(|error| FontError::of(path, error))?;
        let font = FontArc::try_from_vec(bytes).ok();
        font.and_then(Self::new).map(Arc::new).ok_or_else(|| FontError::Broken { path: path.to_owned() })
    }

    pub(crate) fn id(&self) -> u64 {
        self.id
    }

    /// How far a line reaches above its baseline, and below.
    pub(crate) fn reach(&self) -> [f64; 2] {
        [self.font.ascent_unscaled(), -self.font.descent_unscaled()].map(|reach| f64::from(reach) * self.scale)
    }

    /// The glyph of a character; `None` if the font has none.
    pub(crate) fn glyph(&self, character: char) -> Option<GlyphId> {
        Some(self.font.glyph_id(character)).filter(|glyph| glyph.0 != 0)
    }

    /// How far the pen goes on after a glyph; after a character that there is none for, without one.
    pub(crate) fn advance(&self, glyph: Option<GlyphId>) -> f64 {
        let advance = f64::from(self.font.h_advance_unscaled(glyph.unwrap_or_default())) * self.scale;
        if glyph.is_none() && advance <= 0.0 { NO_ADVANCE } else { advance.min(self.widest) }
    }

    /// The most that [`Typeface::advance`] can be.
    pub(crate) fn widest(&self) -> f64 {
        self.widest
    }

    /// What the pen goes on more between two glyphs, an em at most.
    pub(crate) fn kern(&self, before: GlyphId, glyph: GlyphId) -> f64 {
        (f64::from(self.font.kern_unscaled(before, glyph)) * self.scale).clamp(-1.0, 1.0)
    }

    /// Whether a glyph is of a size that can be painted: a font may say anything.
    pub(crate) fn can_paint(&self, glyph: GlyphId, size: f64) -> bool {
        self.ink(glyph).is_none_or(|Ink { left, right, bottom, top }| {
            let reaches = [left, right, bottom, top].iter().all(|place| place.abs() <= MOST_REACH);
            reaches && (right - left) * (top - bottom) * size * size <= MOST_AREA
        })
    }

    /// The outline of a glyph, with bounds that all its control points are within: those in the file may be anything.
    fn outline(&self, glyph: GlyphId) -> Option<Outline> {
        let outline = self.font.outline(glyph)?;
        let (mut min, mut max) = (point(f32::INFINITY, f32::INFINITY), point(f32::NEG_INFINITY, f32::NEG_INFINITY));
        for curve in &outline.curves {
            let points: &[_] = match curve {
                OutlineCurve::Line(a, b) => &[*a, *b],
                OutlineCurve::Quad(a, b, c) => &[*a, *b, *c],
                OutlineCurve::Cubic(a, b, c, d) => &[*a, *b, *c, *d],
            };
            for p in points {
                (min.x, min.y) = (min.x.min(p.x), min.y.min(p.y));
                (max.x, max.y) = (max.x.max(p.x), max.y.max(p.y));
            }
        }
        // Bounds run from the upper left corner to the lower right.
        let bounds = Rect { min: point(min.x, max.y), max: point(max.x, min.y) };
        (!outline.curves.is_empty()).then_some(Outline { bounds, curves: outline.curves })
    }

    /// How far the ink of a glyph reaches.
    pub(crate) fn ink(&self, glyph: GlyphId) -> Option<Ink> {
        let mut known = self.ink.lock().unwrap_or_else(PoisonError::into_inner);
        *known.entry(glyph.0).or_insert_with(|| {
            let Rect { min, max } = self.outline(glyph)?.bounds;
            let [left, top, right, bottom] = [min.x, min.y, max.x, max.y].map(|v| f64::from(v) * self.scale);
            Some(Ink { left, right, bottom, top })
        })
    }

    /// Hands over the pixels that a glyph which [can be painted](Typeface::can_paint) covers with an em of `size` pixels, and how much of each, 0..1: the pen is at `pen`, in pixels to
    /// the right and down.
    pub(crate) fn paint(&self, glyph: GlyphId, size: f64, pen: [f64; 2], mut pixel: impl FnMut(i64, i64, f32)) {
        let Some(outline) = self.outline(glyph) else { return };
        let factor = (size * self.scale) as f32;
        let scale_factor = ab_glyph::PxScaleFactor { horizontal: factor, vertical: factor };
        // The whole part is added in integers.
        let [whole_x, whole_y] = pen.map(f64::floor);
        let position = point((pen[0] - whole_x) as f32, (pen[1] - whole_y) as f32);
        let glyph = ab_glyph::Glyph { id: glyph, scale: factor.into(), position };
        let outlined = ab_glyph::OutlinedGlyph::new(glyph, outline, scale_factor);
        let corner = outlined.px_bounds().min;
        let (left, top) = (whole_x as i64 + corner.x as i64, whole_y as i64 + corner.y as i64);
        outlined.draw(|x, y, share| pixel(left + i64::from(x), top + i64::from(y), share.clamp(0.0, 1.0)));
    }
}
