//! What walks along a ray have in common: where it crosses the lines of the lattice, in which blocks it is in between, and
//! where it comes down to the heights of the map.
//!
//! Used by the walks through the cells of a map and through the fans of its patches.

/// An index as a float. Indices are below 2²⁵; signed numbers convert faster.
#[inline(always)]
pub(super) fn number(i: usize) -> f64 {
    f64::from(i as i32)
}

/// One horizontal axis along the ray. Lines are numbered by their coordinate.
#[derive(Debug, Clone, Copy)]
pub(super) struct Axis {
    pub(super) origin: f64,
    pub(super) direction: f64,
    /// Where lines are measured from: the origin, or for a ray along the lines the middle of its cell, so that no line
    /// coincides with it.
    pub(super) from: f64,
    /// 1 / direction.
    pub(super) inverse: f64,
    /// Whether the ray goes towards larger indices (also if it goes along the lines).
    pub(super) forward: bool,
    pub(super) cells: u32,
}

impl Axis {
    #[inline(always)]
    pub(super) fn new(origin: f64, direction: f64, cells: u32) -> Self {
        let from = if direction == 0.0 { f64::from((origin as u32).min(cells - 1)) + 0.5 } else { origin };
        let inverse = if direction == 0.0 { f64::INFINITY } else { 1.0 / direction };
        Self { origin, direction, from, inverse, forward: inverse > 0.0, cells }
    }

    /// Parameter at which the ray crosses a line: the only expression for it, so that all who ask get the same bits. For a
    /// ray along the lines −∞ for those up to its cell and ∞ for those beyond.
    #[inline(always)]
    pub(super) fn line(&self, x: f64) -> f64 {
        (x - self.from) * self.inverse
    }

    /// How far beyond line `i` the ray is at `t`, within 0..=1. Subtracting first makes the answer one of the distance
    /// alone: a map and a ray that are moved by whole cells give the same bits.
    #[inline(always)]
    pub(super) fn fraction(&self, i: usize, t: f64) -> f64 {
        ((self.origin - number(i)) + self.direction * t).clamp(0.0, 1.0)
    }

    /// Parameters at which the ray enters and leaves the map.
    pub(super) fn range(&self) -> [f64; 2] {
        self.across(0, self.cells)
    }

    /// The parameters at which the ray enters and leaves what is between line `i` and the one `size` further.
    #[inline(always)]
    pub(super) fn across(&self, i: u32, size: u32) -> [f64; 2] {
        // Numbers are chosen rather than parameters: without a branch, which could not be foreseen. They become floats at once: by way
        // of `number` coarse picks took 5 % longer.
        let back = if self.forward { 0 } else { size };
        [self.line(f64::from((i + back) as i32)), self.line(f64::from((i + size - back) as i32))]
    }

    /// The line through which the ray leaves block `i` of a size, and the step to the next.
    #[inline(always)]
    pub(super) fn ahead(&self, i: usize, size: f64) -> (f64, f64) {
        (number(i + usize::from(self.forward)) * size, if self.forward { size } else { -size })
    }

    /// Of the 2^bits blocks of 2^shift cells in a block `i` of 2^(shift + bits), the one in which the ray is at `t`: that
    /// behind the last line crossed, by the same parameters that stepping uses.
    #[inline(always)]
    pub(super) fn child(&self, i: usize, bits: u32, shift: u32, t: f64) -> usize {
        let size = number(1 << shift);
        let first = i << bits;
        let start = number(first) * size;
        let mut crossed = 0;
        // All at once rather than by halving: comparisons that wait for each other would take longer.
        for k in 1..1usize << bits {
            crossed += usize::from(self.line(start + number(k) * size) <= t);
        }
        // A ray that touches the far border is still in the last block.
        let last = (self.cells as usize - 1) >> shift;
        if self.forward { (first + crossed).min(last) } else { first + (1 << bits) - 1 - crossed }
    }

    #[inline(always)]
    pub(super) fn next(&self, i: usize) -> usize {
        if self.forward { i + 1 } else { i.wrapping_sub(1) }
    }
}

/// Skips the part of a ray that lies above all heights, or below them: the parameter to start from, and the sign of its height
/// above the ground there (0 if it is not known). `None` if that part is the whole ray.
///
/// The ray is at `z + slope · t`; `range` is the smallest and the largest height.
#[inline(always)]
pub(super) fn approach(z: f64, slope: f64, [low, high]: [f64; 2], [near, far]: [f64; 2]) -> Option<(f64, i8)> {
    let start = z + slope * near;
    let (bound, sign) = if start > high {
        (high, 1)
    } else if start < low {
        (low, -1)
    } else {
        return Some((near, 0));
    };
    if slope == 0.0 || (slope > 0.0) == (sign > 0) {
        return None;
    }
    let t = (bound - z) / slope;
    // A little earlier, where rounding leaves no doubt.
    let t = t - t.abs() * 2f64.powi(-50);
    let at = z + slope * t;
    if !(t > near && if sign > 0 { at > high } else { at < low }) {
        return Some((near, sign));
    }
    (t <= far).then_some((t, sign))
}
