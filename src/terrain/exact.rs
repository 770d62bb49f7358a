//! Where a ray meets the full-resolution surface of a map.
//!
//! # The walk
//!
//! Along the ray, f(t) = w_ray(t) − h(u(t), v(t)) is the height above the surface: continuous, and linear between the
//! grid lines and cell diagonals that the ray crosses. The min/max tree is descended front to back down to single cells;
//! a block (and a cell) is passed when the ray stays on its side of all heights there. In a cell f is taken where the
//! ray comes in, where it crosses the diagonal and where it goes out, and a change of sign is a hit.
//!
//! # Why nothing is lost and nothing found twice
//!
//! * The parameter of a grid line is computed from the line's integer index by one expression, so the blocks and cells on
//!   both sides use the same bits: no gap or overlap opens between them. Since rounding is monotone, lines are crossed in
//!   their order.
//! * On a line or diagonal the height is interpolated between the two samples at its ends, so both neighbours compute the
//!   same f. The interpolation never leaves the range of the two, so a cell agrees with a block that was passed.
//! * The sign of f is carried along. If rounding at a vertex makes two cells disagree all the same, the change is still
//!   seen and reported where they meet.
//! * Steps go from line to line by integer index. Each block of each level of the tree is visited at most once, which
//!   bounds their number by the size of the map ([`ExactSurface::step_limit`]).
//!
//! Only crossings count, not mere touching; a ray that starts or ends exactly on the surface, or passes the border of the
//! map exactly on it, hits it there. A ray that runs within the surface crosses it (if it does) where it first meets it.
//!
//! # Holes
//!
//! Where a map has holes ([`HeightField::with_holes`]) the surface goes on over them as a lid, and so does f: the walk, its
//! blocks and its sign are those of the surface with its lids, and all that was said above holds. A crossing counts if one of
//! the closed triangles at that place is ground. Nothing is lost by that, since a crossing of the ground is one of the
//! surface; nothing is found at a rim that is not there, since the sign does not change at a rim but where the ray crosses
//! the surface. A ray that comes down through a hole is below the surface from there on, and where it meets the ground from
//! below it comes out of it.
//!
//! # Rounding
//!
//! See [`ExactHit::error`].
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing))]

mod walk;

use glam::DVec3;

use super::height_field::{HeightField, Samples};
use super::pick::LatticeRay;
use super::pyramid::{Height, Level, Levels, MinMaxPyramid};

/// A place where a ray meets the full-resolution surface, in lattice coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExactHit {
    /// Ray parameter.
    pub t: f64,
    /// Column coordinate and row coordinate of the place, and the raw height of the surface there.
    pub point: DVec3,
    /// Column and row of the cell.
    pub cell: [u32; 2],
    /// Which of the cell's triangles: `true` for the north-east one, with samples (c, r), (c + 1, r), (c + 1, r + 1),
    /// `false` for the south-west one, with samples (c, r), (c, r + 1), (c + 1, r + 1). On the diagonal either.
    pub upper: bool,
    /// Slope ∂w/∂u and ∂w/∂v of the triangle, in raw units per cell.
    pub gradient: [f64; 2],
    /// Weights of the triangle's samples in the order of [`ExactHit::upper`]; each in 0..=1, sum 1.
    pub barycentric: [f64; 3],
    /// Whether the ray goes into the ground here (from above); otherwise it comes out.
    pub entering: bool,
    /// Bound of the vertical distance between the ray at `t` and the surface, in raw units: rounding alone.
    ///
    /// With ε = 2⁻⁵³, the ray's origin o, direction d and gradient g:
    /// 16 ε (|o_w| + |d_w t| + |w| + (|g_u| + |g_v|) (|o_u| + |d_u t| + |o_v| + |d_v t| + 1)), where |g| is the largest slope of
    /// the cell's two triangles.
    ///
    /// Derivation: t at a line comes from one difference, one reciprocal and one product (3 ε relative), which moves the
    /// ray's point by 3 ε |d t| in each axis; o + d t adds 2 ε (|o| + |d t|), the interpolation 3 ε of the heights'
    /// difference and ε |w|; f itself ε |f|. At a diagonal t comes from the differences of the two axes, and the height from the
    /// place along u, so that each slope sees the rounding of both axes: 4 ε across the diagonal and 2 ε along it. So f at
    /// either end of a piece is off by at most 6 ε of the sum above, and as f is linear between, so is the zero of the
    /// interpolation; its own rounding is at most 4 ε of the change of f over the piece, and ε |t| in the result. The sum is
    /// below 12 ε; 16 leaves room.
    pub error: f64,
}

/// A place on the surface, with its slope.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// Raw height.
    pub height: f64,
    /// Slope ∂w/∂u and ∂w/∂v of the triangle, in raw units per cell.
    pub gradient: [f64; 2],
    /// Column and row of the cell.
    pub cell: [u32; 2],
    /// Which of the cell's triangles, as in [`ExactHit::upper`].
    pub upper: bool,
}

/// What exact questions about a map need.
///
/// # Example
///
/// ```
/// use glam::DVec3;
/// use seamount::terrain::pick::LatticeRay;
/// use seamount::terrain::{ExactSurface, MinMaxPyramid, generate};
///
/// let field = generate(65, 1)?;
/// let pyramid = MinMaxPyramid::new(&field);
/// let surface = ExactSurface { field: &field, pyramid: &pyramid };
/// let ray = LatticeRay {
///     origin: DVec3::new(-10.0, 20.0, 90_000.0),
///     direction: DVec3::new(1.0, 0.1, -2000.0),
///     near: 0.0,
///     far: f64::INFINITY,
/// };
/// let hit = surface.first(&ray).expect("the ray comes down on the map");
/// assert!(hit.entering);
/// let ground = field.surface(hit.point.x, hit.point.y).expect("on the map");
/// assert!((hit.point.z - ground).abs() < 1e-9);
/// # Ok::<(), seamount::terrain::HeightFieldError>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct ExactSurface<'t> {
    /// The heights.
    pub field: &'t HeightField,
    /// Their min/max tree. With the tree of another map nothing is hit.
    pub pyramid: &'t MinMaxPyramid,
}

impl ExactSurface<'_> {
    /// Calls `found` with the crossings of the ray with the surface, in order of t, each once, until it returns `false`.
    ///
    /// A ray whose origin or direction is not finite, whose direction is zero or whose range is empty crosses nothing.
    pub fn intersect(&self, ray: &LatticeRay, found: impl FnMut(ExactHit) -> bool) {
        self.walk(ray, found);
    }

    /// The first crossing.
    #[must_use]
    pub fn first(&self, ray: &LatticeRay) -> Option<ExactHit> {
        let mut first = None;
        self.walk(ray, |hit| {
            first = Some(hit);
            false
        });
        first
    }

    /// How many blocks and cells a walk along the whole ray visits; at most [`ExactSurface::step_limit`].
    #[must_use]
    pub fn steps(&self, ray: &LatticeRay) -> u32 {
        self.walk(ray, |_| true)
    }

    /// The most blocks and cells that a walk can visit on this map.
    ///
    /// A walk that never turns back visits at most n + m − 1 of n × m blocks. With blocks of 1, 4, 16, 64, … cells a side
    /// that is below (1 + 1/4 + 1/16 + …) (columns + rows) and two per level for the roundings up; the limit has half of
    /// (columns + rows) to spare instead of a third.
    #[must_use]
    pub fn step_limit(&self) -> u32 {
        walk::step_limit(self.field.cells())
    }

    /// Height and slope of the surface at `(u, v)`, `None` in a hole, outside the map and for NaN. On a line between triangles the
    /// slope is that of one of them.
    ///
    /// ```
    /// use seamount::terrain::{ExactSurface, HeightField, MinMaxPyramid, Voids};
    ///
    /// let field = HeightField::from_u16(2, 2, vec![0, 10, 20, 30], Voids::default())?;
    /// let surface = ExactSurface { field: &field, pyramid: &MinMaxPyramid::new(&field) };
    /// let at = surface.height_at(0.5, 0.25).expect("on the map");
    /// assert_eq!((at.height, at.gradient), (10.0, [10.0, 20.0]));
    /// assert_eq!(surface.height_at(1.5, 0.0), None);
    /// # Ok::<(), seamount::terrain::HeightFieldError>(())
    /// ```
    #[must_use]
    pub fn height_at(&self, u: f64, v: f64) -> Option<SurfacePoint> {
        let (cell, upper) = self.field.ground_at(u, v)?;
        let height = self.field.filled_surface(u, v)?;
        Some(SurfacePoint { height, gradient: triangle_gradient(self.field, cell, upper), cell, upper })
    }

    fn walk(&self, ray: &LatticeRay, found: impl FnMut(ExactHit) -> bool) -> u32 {
        match (self.field.samples(), self.pyramid.levels()) {
            (Samples::U16(samples), Levels::U16(levels)) => self.walk_over(samples, levels, ray, found),
            (Samples::F32(samples), Levels::F32(levels)) => self.walk_over(samples, levels, ray, found),
            _ => 0,
        }
    }

    fn walk_over<T: Height>(
        &self,
        samples: &[T],
        levels: &[Level<T>],
        ray: &LatticeRay,
        found: impl FnMut(ExactHit) -> bool,
    ) -> u32 {
        let cells = self.field.cells();
        if self.field.has_holes() {
            walk::walk(samples, levels, self.field, cells, ray, found)
        } else {
            walk::walk(samples, levels, walk::Everywhere, cells, ray, found)
        }
    }
}

/// Slope of one of the triangles of a cell.
fn triangle_gradient(field: &HeightField, [c, r]: [u32; 2], upper: bool) -> [f64; 2] {
    let (north_west, south_east) = (field.raw(c, r), field.raw(c + 1, r + 1));
    if upper {
        let north_east = field.raw(c + 1, r);
        [north_east - north_west, south_east - north_east]
    } else {
        let south_west = field.raw(c, r + 1);
        [south_east - south_west, south_west - north_west]
    }
}
