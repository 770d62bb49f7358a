//! A ray seen from above: which patches, triangles and edges its line meets, decided by signs at lattice points alone.
//!
//! # Why nothing is lost
//!
//! * The side of a point, d_u (v − o_v) − d_v (u − o_u), is computed by one expression. What meets the line is decided by
//!   its sign at lattice points, so all who share a point agree. An edge is crossed if its two ends have unequal signs; a
//!   triangle is crossed by none or by exactly two of its edges, and the triangles that the line crosses make a chain from
//!   edge to edge.
//! * A point exactly on the line counts as lying beyond it, seen from the middle of the map: as if the line were moved towards
//!   the middle by less than any number. So a line along the border of the map has the triangles there, and a ray and its
//!   reverse meet the same.
//! * Rounding is monotone, so the computed side is monotone in u and in v: over a box it is between its values at the
//!   corners. A box whose corners all have one sign contains no triangle that is crossed, also as computed.
//! * Parameter and height at an edge are computed from its two ends in the order of their coordinates: neighbours that
//!   share the edge get the same bits, so the sign of "above or below" at the edge is one.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing))]

use glam::DVec3;

use super::pick::LatticeRay;

/// ε of the bounds on rounding.
const EPSILON: f64 = f64::EPSILON / 2.0;
/// A direction that rises more than this often its way over ground is vertical: on the whole map (2²⁴ cells), and down from
/// 10³⁸, it leaves its place by less than f64 can tell.
const STEEPEST: f64 = 1e200;

/// The line of a ray, with the part of it over the map.
#[derive(Debug, Clone, Copy)]
pub(super) struct Line {
    pub origin: DVec3,
    pub direction: DVec3,
    /// 1 / `direction`, for bounds.
    inverse: DVec3,
    /// Part of the parameter's range over the map.
    pub near: f64,
    /// See `near`.
    pub far: f64,
    /// How far the height along the ray may be off at a parameter of an edge or line, in raw units.
    ///
    /// A parameter is a coordinate of the crossing minus the origin's, over the direction's. The crossing of a slanted edge
    /// is off by at most 6 ε cells, the difference and the quotient add 2 ε (cells + |o|): the parameter is off by less
    /// than 8 ε (cells + |o|) / |d| along the larger axis. Times |d_w|, and 3 ε (|o_w| + |d_w t|) for origin + direction · t.
    /// Both a bound on a block and a value at an edge are off by that; 32 leaves room.
    pub margin: f64,
    /// Factor from parameters of this line to those of the ray.
    pub unit: f64,
    /// Largest horizontal coordinate of the origin and the map, in cells: how far apart points may be.
    size: f64,
    /// Whether points on the line count as lying on its positive side: not if the middle of the map does.
    zero_is_positive: bool,
}

/// What a ray looks like from above.
#[derive(Debug, Clone, Copy)]
pub(super) enum Seen {
    /// A line.
    Line(Line),
    /// A point: the ray is vertical.
    Point(Line),
}

/// Where the line crosses an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Crossing {
    /// The ends of the edge.
    pub edge: [[u32; 2]; 2],
    /// Parameter.
    pub t: f64,
    /// Height of the edge there, raw.
    pub height: f64,
    /// Height of the ray above the edge.
    pub above: f64,
    /// Bound of what rounding may make of a height of 0 above the edge.
    pub rounding: f64,
}

/// A value between two, never outside of them, and exactly they at the ends.
#[inline(always)]
pub(super) fn between(a: f64, b: f64, s: f64) -> f64 {
    // The difference of floats of very unequal size is rounded: start from the nearer end.
    if s < 0.5 { a + s * (b - a) } else { b - (1.0 - s) * (b - a) }
}

impl Line {
    /// The part of a ray over a map of so many cells; `None` if there is none, or the ray is not finite.
    pub(super) fn seen(ray: &LatticeRay, cells: [u32; 2]) -> Option<Seen> {
        let [cu, cv] = cells.map(f64::from);
        let largest = ray.direction.abs().max_element();
        if !(ray.origin.is_finite() && ray.direction.is_finite() && largest > 0.0) || ray.near.is_nan() {
            return None;
        }
        // Scaling by a power of two is exact. In two steps: its square may not be a number.
        let exponent = largest.log2().floor() as i32;
        let half = 2f64.powi(-(exponent / 2));
        let rest = 2f64.powi(-(exponent - exponent / 2));
        let direction = ray.direction * half * rest;
        let scaled = |t: f64| t / half / rest;
        let flat = |d: f64| if d.abs() * STEEPEST < 1.0 { 0.0 } else { d };
        let d = DVec3::new(flat(direction.x), flat(direction.y), direction.z);
        let o = ray.origin;
        let mut line = Line {
            origin: o,
            direction: d,
            inverse: DVec3::ONE / d,
            near: scaled(ray.near),
            far: scaled(ray.far),
            margin: 0.0,
            unit: half * rest,
            size: cu.max(cv) + o.x.abs().max(o.y.abs()),
            zero_is_positive: true,
        };
        line.zero_is_positive = line.side([0.5 * cu, 0.5 * cv]) <= 0.0;
        for (o, d, last) in [(o.x, d.x, cu), (o.y, d.y, cv)] {
            if d == 0.0 {
                if !(0.0..=last).contains(&o) {
                    return None;
                }
            } else {
                let (a, b) = ((0.0 - o) / d, (last - o) / d);
                line.near = line.near.max(a.min(b));
                line.far = line.far.min(a.max(b));
            }
        }
        if !(line.near <= line.far && line.near.is_finite()) {
            return None;
        }
        if d.x == 0.0 && d.y == 0.0 {
            // To a height w it is |d_w t| <= |o_w| + |w|.
            line.margin = 64.0 * EPSILON * o.z.abs();
            return Some(Seen::Point(line));
        }
        let along = d.x.abs().max(d.y.abs());
        let reach = line.near.abs().max(line.far.abs()) + line.size / along;
        line.margin = 32.0 * EPSILON * (o.z.abs() + d.z.abs() * reach);
        Some(Seen::Line(line))
    }

    /// On which side of the line a point lies, and how far times the direction's length.
    #[inline(always)]
    fn side(&self, [u, v]: [f64; 2]) -> f64 {
        self.direction.x * (v - self.origin.y) - self.direction.y * (u - self.origin.x)
    }

    /// Whether a point of the lattice counts as lying on the positive side of the line.
    #[inline(always)]
    pub(super) fn is_positive(&self, point: [u32; 2]) -> bool {
        let side = self.side(point.map(f64::from));
        side > 0.0 || side == 0.0 && self.zero_is_positive
    }

    /// Whether a point of the lattice lies exactly on the line.
    #[inline(always)]
    pub(super) fn is_on(&self, point: [u32; 2]) -> bool {
        self.side(point.map(f64::from)) == 0.0
    }

    /// Whether the line meets a box, given by its lattice corners.
    #[inline(always)]
    pub(super) fn meets(&self, [[u0, v0], [u1, v1]]: [[u32; 2]; 2]) -> bool {
        let first = self.is_positive([u0, v0]);
        [[u1, v0], [u1, v1], [u0, v1]].into_iter().any(|p| self.is_positive(p) != first)
    }

    /// Parameters between which the line is in a box, within the ray's range; empty if the first is larger.
    #[inline(always)]
    pub(super) fn within(&self, [low, high]: [[u32; 2]; 2]) -> [f64; 2] {
        let (o, inverse) = (self.origin, self.inverse);
        let (mut enter, mut leave) = (self.near, self.far);
        for (o, inverse, low, high) in [(o.x, inverse.x, low[0], high[0]), (o.y, inverse.y, low[1], high[1])] {
            if inverse.is_finite() {
                let (a, b) = ((f64::from(low) - o) * inverse, (f64::from(high) - o) * inverse);
                enter = enter.max(a.min(b));
                leave = leave.min(a.max(b));
            }
        }
        [enter, leave]
    }

    /// Height along the ray.
    #[inline(always)]
    pub(super) fn height(&self, t: f64) -> f64 {
        self.origin.z + self.direction.z * t
    }

    /// The point at a parameter.
    #[inline(always)]
    pub(super) fn at(&self, t: f64) -> DVec3 {
        self.origin + self.direction * t
    }

    /// +1 if the ray stays above all of a range of heights between two parameters, −1 if below, 0 if it does not.
    #[inline(always)]
    pub(super) fn clear_of(&self, [low, high]: [f64; 2], [enter, leave]: [f64; 2]) -> i8 {
        let (a, b) = (self.height(enter), self.height(leave));
        i8::from(a.min(b) - self.margin > high) - i8::from(a.max(b) + self.margin < low)
    }

    /// Where the line crosses an edge whose ends lie on unequal sides: points on the lattice and their raw heights.
    #[inline(always)]
    pub(super) fn crossing(&self, a: ([u32; 2], f64), b: ([u32; 2], f64)) -> Crossing {
        let ((a, ha), (b, hb)) = if a.0 <= b.0 { (a, b) } else { (b, a) };
        let (p, q) = (a.map(f64::from), b.map(f64::from));
        let (sa, sb) = (self.side(p), self.side(q));
        // Unequal signs: no digits cancel.
        let s = (sa / (sa - sb)).clamp(0.0, 1.0);
        let (o, d) = (self.origin, self.direction);
        // Along a grid line one coordinate is given, and the parameter is that of the line; else that of the axis which
        // the ray follows more.
        let along_u = if p[0] == q[0] {
            true
        } else if p[1] == q[1] {
            false
        } else {
            d.x.abs() >= d.y.abs()
        };
        let t = if along_u { (p[0] + s * (q[0] - p[0]) - o.x) / d.x } else { (p[1] + s * (q[1] - p[1]) - o.y) / d.y };
        // The ray's height is off by the margin. The point is one of the edge, but up to 8 ε cells beside the ray (see there): on
        // triangles no steeper than the edge that is 8 ε of its rise, once for either end, and its height is off by 3 ε.
        let rounding = self.margin + 16.0 * EPSILON * (ha.abs().max(hb.abs()) + (hb - ha).abs() * self.size);
        let height = between(ha, hb, s);
        Crossing { edge: [a, b], t, height, above: self.height(t) - height, rounding }
    }

    /// Bound of the vertical distance between the ray at a crossing and a triangle of this slope there, raw.
    pub(super) fn rounding(&self, t: f64, height: f64, [gu, gv]: [f64; 2], cells: [u32; 2]) -> f64 {
        let (o, d) = (self.origin, self.direction);
        let ground = |g: f64, o: f64, d: f64, cells: u32| g.abs() * (o.abs() + (d * t).abs() + f64::from(cells));
        self.margin + 32.0 * EPSILON * (height.abs() + ground(gu, o.x, d.x, cells[0]) + ground(gv, o.y, d.y, cells[1]))
    }
}
