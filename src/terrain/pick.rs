//! Where a ray meets the four coarse triangles of the active patches.
//!
//! # The surface
//!
//! Each active patch is replaced by a fan: its four corners and its centre (clamped to the map like all vertices) span
//! four triangles, one per side. The fan's corners are samples, so it lies between the patch's smallest and largest
//! height; how far it is from the full-resolution surface is known per patch ([`FanErrors`]). Where patches of different
//! size meet, their fans leave a gap; it is closed by a vertical wall.
//!
//! # The walk
//!
//! Along the ray, f(t) = w_ray(t) − h(u(t), v(t)) is the height above the surface. The patch tree is walked front to back:
//! the ray's interval is split where it crosses grid lines, each crossing computed once from the line's integer index, so
//! that both neighbours use the same bits and no gap or overlap can open between them. A block is skipped when the ray
//! stays above its largest or below its smallest height. Inside a patch the interval is split at the fan's spokes. The
//! *sign* of f is carried from piece to piece: a change is a hit wherever it is seen, inside a triangle, or at the border
//! of two patches (a wall, or rounding). Only crossings count, not mere touching; a ray that starts or ends exactly on the
//! surface, or passes the border of the map exactly on it, hits it there.
//!
//! Where the map has holes, the fans are those of the surface with its lids, and a crossing counts only where the
//! full-resolution surface is ground: four triangles show no outline, so picks pass through the holes as they are in truth.
//!
//! Steps go from grid line to grid line by integer index, never by "a little further", so their number is bounded: each
//! level of the tree visits at most `columns + rows` blocks.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing))]

use glam::DVec3;

use super::errors::{round_up, triangle_error};
use super::height_field::{HeightField, SampleRect};
use super::hierarchy::{Hierarchy, PatchId};
use super::parts::Side;
use super::selection::Selection;

/// A place where a ray meets a terrain, in lattice coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TerrainHit {
    /// Ray parameter.
    pub t: f64,
    /// Column coordinate, row coordinate and raw height of the point.
    pub point: DVec3,
    /// Slope ∂w/∂u and ∂w/∂v of the surface there, in raw units per cell; for a wall that of the patch that was entered.
    pub gradient: [f64; 2],
    /// For a wall between patches of different size: the side of the entered patch that it stands on.
    pub wall: Option<Side>,
    /// The patch.
    pub patch: PatchId,
    /// Which of its four triangles: the one at this side.
    pub triangle: Side,
    /// No point of the full-resolution surface is vertically further from the coarse one in this patch, in raw units.
    pub error: f64,
    /// Whether the ray goes into the ground here (from above); otherwise it comes out.
    pub entering: bool,
}

/// The fan of a patch: corners north-west, north-east, south-east, south-west, and the centre, with raw heights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fan {
    /// The corners clockwise from the north-west; the triangle at side k has corners k, k + 1 and the centre.
    pub corners: [DVec3; 4],
    /// The centre.
    pub center: DVec3,
}

fn cross(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)
}

impl Fan {
    /// The fan of a patch.
    #[must_use]
    pub fn new(field: &HeightField, tree: &Hierarchy, patch: PatchId) -> Self {
        let [[u0, v0], [u1, v1]] = tree.extent(patch);
        let half = tree.size(patch.level) / 2;
        let sample = |u: u32, v: u32| DVec3::new(f64::from(u), f64::from(v), field.raw(u, v));
        Self {
            corners: [sample(u0, v0), sample(u1, v0), sample(u1, v1), sample(u0, v1)],
            center: sample((u0 + half).min(u1), (v0 + half).min(v1)),
        }
    }

    /// Corners of the triangle at a side: along the side clockwise, then the centre.
    #[must_use]
    pub fn triangle(&self, side: Side) -> [DVec3; 3] {
        let [nw, ne, se, sw] = self.corners;
        match side {
            Side::North => [nw, ne, self.center],
            Side::East => [ne, se, self.center],
            Side::South => [se, sw, self.center],
            Side::West => [sw, nw, self.center],
        }
    }

    /// Twice the area of the triangle at a side, in cells; 0 where it is clamped to the border of the map.
    #[must_use]
    pub fn area(&self, side: Side) -> f64 {
        let [a, b, c] = self.triangle(side);
        cross(a, b, c)
    }

    /// The triangle that a point of the patch lies in. On a border any of the triangles there, never one without area.
    #[must_use]
    pub fn side_at(&self, u: f64, v: f64) -> Side {
        let mut best = (f64::NEG_INFINITY, Side::North);
        for side in Side::ALL {
            if self.area(side) == 0.0 {
                continue;
            }
            // Least of the barycentric coordinates: the triangle in which the point lies deepest.
            let [a, b, c] = self.barycentric(side, u, v);
            let depth = a.min(b).min(c);
            if depth > best.0 {
                best = (depth, side);
            }
        }
        best.1
    }

    /// Weights of the corners of the triangle at a side (see [`Fan::triangle`]) at a point; those of its first corner if it
    /// has no area.
    #[must_use]
    pub fn barycentric(&self, side: Side, u: f64, v: f64) -> [f64; 3] {
        let [a, b, c] = self.triangle(side);
        let p = DVec3::new(u, v, 0.0);
        let area = cross(a, b, c);
        if area == 0.0 {
            return [1.0, 0.0, 0.0];
        }
        [cross(b, c, p) / area, cross(c, a, p) / area, cross(a, b, p) / area]
    }

    /// Slope ∂w/∂u, ∂w/∂v of the triangle at a side; zero if it has no area.
    #[must_use]
    pub fn gradient(&self, side: Side) -> [f64; 2] {
        let [a, b, c] = self.triangle(side);
        let area = cross(a, b, c);
        if area == 0.0 {
            return [0.0, 0.0];
        }
        let (e, f) = (b - a, c - a);
        [(e.z * f.y - f.z * e.y) / area, (f.z * e.x - e.z * f.x) / area]
    }

    /// Raw height of the fan at a point of the patch, in the triangle at `side`.
    #[must_use]
    pub fn height(&self, side: Side, u: f64, v: f64) -> f64 {
        let [gu, gv] = self.gradient(side);
        // From the nearest corner on a flat side this would be exact; from the centre it is within a few ulp.
        self.center.z + gu * (u - self.center.x) + gv * (v - self.center.y)
    }
}

/// Largest vertical distance between the fan of each patch and the full-resolution surface.
#[derive(Debug, Clone)]
pub struct FanErrors {
    errors: Vec<f32>,
}

impl FanErrors {
    /// Measures all patches of a tree, on all cores.
    ///
    /// The difference of two piecewise linear surfaces is largest at a corner of their overlay: at a sample, or where a
    /// spoke of the fan crosses a grid line or a cell's diagonal. All of these are tried, so the value is exact up to
    /// rounding (outwards, to f32).
    #[must_use]
    pub fn new(field: &HeightField, tree: &Hierarchy) -> Self {
        use rayon::prelude::*;
        // In the tree's own order: level by level, row by row.
        let patches: Vec<PatchId> = (0..=tree.depth()).flat_map(|level| tree.patches(level)).collect();
        let errors = patches.par_iter().map(|&patch| round_up(fan_error(field, tree, patch))).collect();
        Self { errors }
    }

    /// Measures the patches anew that have samples in a rectangle, after those have changed.
    pub fn update(&mut self, field: &HeightField, tree: &Hierarchy, rect: SampleRect) {
        use rayon::prelude::*;
        let patches = (0..=tree.depth()).flat_map(|level| tree.patches(level));
        let touched: Vec<(&mut f32, PatchId)> =
            self.errors.iter_mut().zip(patches).filter(|&(_, patch)| rect.meets(tree.extent(patch))).collect();
        touched.into_par_iter().for_each(|(error, patch)| *error = round_up(fan_error(field, tree, patch)));
    }

    /// The largest error in a patch, in raw units.
    #[must_use]
    pub fn get(&self, tree: &Hierarchy, patch: PatchId) -> f64 {
        self.errors.get(tree.index(patch)).map_or(f64::INFINITY, |&e| f64::from(e))
    }
}

/// The largest vertical distance between one patch's fan and the full-resolution surface, in raw units.
#[must_use]
pub fn fan_error(field: &HeightField, tree: &Hierarchy, patch: PatchId) -> f64 {
    let fan = Fan::new(field, tree, patch);
    // A triangle without area, clamped to the border of the map, is no part of the surface.
    Side::ALL
        .iter()
        .filter(|&&side| fan.area(side) != 0.0)
        .map(|&side| triangle_error(field, fan.triangle(side).map(|p| [p.x as u32, p.y as u32])))
        .fold(0.0, f64::max)
}

/// The fans of a selection, compact: what a coarse pick walks through. Made once for a selection, shared by all its picks.
///
/// A node for each active patch, with the five heights of its fan, and for each split one, with the range of the fans below.
/// That range is much tighter than that of the ground: most patches are passed without a look at their fan. Heights are
/// samples, which f32 holds exactly. 32 bytes a node.
#[derive(Debug)]
pub struct FanTree {
    /// The roots, row by row, then blocks of children, row by row.
    nodes: Vec<FanNode>,
}

#[derive(Debug, Clone, Copy)]
struct FanNode {
    low: f32,
    high: f32,
    /// Corners north-west, north-east, south-east, south-west, and the centre; of an active patch.
    heights: [f32; 5],
    /// The first of the children, 0 for an active patch.
    children: u32,
}

/// Where nothing is known nothing is passed.
const UNKNOWN: FanNode = FanNode { low: f32::NEG_INFINITY, high: f32::INFINITY, heights: [0.0; 5], children: 0 };

impl FanTree {
    /// The fans of the active patches.
    #[must_use]
    pub fn new(field: &HeightField, tree: &Hierarchy, selection: &Selection) -> Self {
        let roots = tree.roots().count();
        let mut fans = Self { nodes: vec![UNKNOWN; roots] };
        for (at, root) in tree.roots().enumerate() {
            fans.add(field, tree, selection, at, root);
        }
        fans
    }

    /// Fills in the node of a patch and those below it.
    fn add(
        &mut self,
        field: &HeightField,
        tree: &Hierarchy,
        selection: &Selection,
        at: usize,
        patch: PatchId,
    ) -> [f32; 2] {
        let mut made = UNKNOWN;
        let mut range = [f32::INFINITY, f32::NEG_INFINITY];
        let mut join = |[low, high]: [f32; 2]| range = [range[0].min(low), range[1].max(high)];
        if selection.is_split(tree, patch) {
            let first = self.nodes.len();
            made.children = u32::try_from(first).unwrap_or(0);
            self.nodes.resize(first + tree.children(patch).count(), UNKNOWN);
            for (child, at) in tree.children(patch).zip(first..) {
                join(self.add(field, tree, selection, at, child));
            }
        } else {
            let fan = Fan::new(field, tree, patch);
            let [a, b, c, d] = fan.corners.map(|p| p.z as f32);
            made.heights = [a, b, c, d, fan.center.z as f32];
            made.heights.iter().for_each(|&height| join([height; 2]));
        }
        [made.low, made.high] = range;
        if let Some(node) = self.nodes.get_mut(at) {
            *node = made;
        }
        range
    }

    #[inline(always)]
    fn node(&self, at: usize) -> &FanNode {
        self.nodes.get(at).unwrap_or(&UNKNOWN)
    }

    /// Bytes that the nodes occupy.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice())
    }
}

/// A ray in lattice coordinates with the range of its parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LatticeRay {
    /// Where t = 0 is.
    pub origin: DVec3,
    /// Any length but zero.
    pub direction: DVec3,
    /// Smallest t.
    pub near: f64,
    /// Largest t; may be infinite.
    pub far: f64,
}

impl LatticeRay {
    fn at(&self, t: f64) -> DVec3 {
        self.origin + self.direction * t
    }
}

/// What a pick on the coarse surface needs.
#[derive(Debug, Clone, Copy)]
pub struct CoarseSurface<'t> {
    /// The heights.
    pub field: &'t HeightField,
    /// The patches.
    pub tree: &'t Hierarchy,
    /// Which of them are active.
    pub selection: &'t Selection,
    /// The fans of those.
    pub fans: &'t FanTree,
    /// The error of each.
    pub errors: &'t FanErrors,
}

struct Walk<'t, F> {
    surface: CoarseSurface<'t>,
    /// Its range is clipped to the map.
    ray: LatticeRay,
    u: Axis,
    v: Axis,
    /// 1 / (d_v − d_u) and 1 / (d_v + d_u), for the diagonals of patches.
    across: [f64; 2],
    /// +1 above, −1 below, 0 not known yet.
    sign: i8,
    /// Whether f was exactly 0 at the end of the last piece, and from which t on.
    zero_since: Option<f64>,
    /// The patch of the last piece that was looked at closely.
    last: Option<PatchId>,
    found: F,
}

impl CoarseSurface<'_> {
    /// Calls `found` with the crossings of the ray with the surface, in order of t, each once, until it returns `false`.
    ///
    /// A ray whose origin or direction is not finite, whose direction is zero or whose range is empty crosses nothing.
    pub fn intersect(&self, ray: &LatticeRay, found: impl FnMut(TerrainHit) -> bool) {
        let [cu, cv] = self.tree.cells();
        let (o, d) = (ray.origin, ray.direction);
        if !(o.is_finite() && d.is_finite()) || d == DVec3::ZERO {
            return;
        }
        let (u, v) = (Axis::new(o.x, d.x), Axis::new(o.y, d.y));
        let mut ray = *ray;
        for (axis, cells) in [(u, cu), (v, cv)] {
            let Some([near, far]) = axis.range(cells) else { return };
            ray.near = ray.near.max(near);
            ray.far = ray.far.min(far);
        }
        if ray.near > ray.far || ray.near.is_nan() || ray.far.is_nan() {
            return;
        }
        let across = [1.0 / (d.y - d.x), 1.0 / (d.y + d.x)];
        let mut walk = Walk { surface: *self, ray, u, v, across, sign: 0, zero_since: None, last: None, found };
        if d.x == 0.0 && d.y == 0.0 {
            walk.vertical();
        } else {
            let range = [ray.near, ray.far];
            walk.grid(0, [0, 0], self.tree.grid(0), 0, range);
        }
    }
}

/// 1 / 2^k for a power of two, exactly and without a division.
#[inline(always)]
fn inverse_power(power: u32) -> f64 {
    f64::from_bits(u64::from(1023 - power.trailing_zeros()) << 52)
}

/// One axis along a ray, with lines at k · size.
#[derive(Debug, Clone, Copy)]
struct Axis {
    origin: f64,
    direction: f64,
    /// 1 / direction.
    inverse: f64,
}

impl Axis {
    fn new(origin: f64, direction: f64) -> Self {
        Self { origin, direction, inverse: 1.0 / direction }
    }

    /// Parameter at which the ray crosses a line. The same bits for all who ask.
    #[inline(always)]
    fn line(&self, at: f64) -> f64 {
        (at - self.origin) * self.inverse
    }

    /// Parameters at which the ray enters and leaves the map, `None` beside it.
    fn range(&self, cells: u32) -> Option<[f64; 2]> {
        let last = f64::from(cells);
        if self.direction == 0.0 {
            return (0.0..=last).contains(&self.origin).then_some([f64::NEG_INFINITY, f64::INFINITY]);
        }
        let (a, b) = (self.line(0.0), self.line(last));
        Some([a.min(b), a.max(b)])
    }

    /// The block of `first..last` in which the ray is at `t`, by the same comparisons that stepping uses.
    #[inline(always)]
    fn block(&self, t: f64, size: f64, inverse: f64, first: u32, last: u32) -> u32 {
        let guess = (self.origin + self.direction * t) * inverse;
        let mut k = (guess.max(0.0) as u32).clamp(first, last - 1);
        let line = |k: u32| self.line(f64::from(k) * size);
        if self.direction > 0.0 {
            while k > first && line(k) > t {
                k -= 1;
            }
            while k + 1 < last && line(k + 1) <= t {
                k += 1;
            }
        } else if self.direction < 0.0 {
            while k + 1 < last && line(k + 1) > t {
                k += 1;
            }
            while k > first && line(k) <= t {
                k -= 1;
            }
        }
        k
    }

    /// Where the ray leaves block k; infinity along lines.
    #[inline(always)]
    fn leaves(&self, k: u32, size: f64) -> f64 {
        if self.direction == 0.0 {
            return f64::INFINITY;
        }
        self.line(f64::from(k + u32::from(self.direction > 0.0)) * size)
    }

    /// The next block; one that is not in any grid past the end.
    #[inline(always)]
    fn next(&self, k: u32) -> u32 {
        if self.direction > 0.0 { k + 1 } else { k.wrapping_sub(1) }
    }
}

impl<F: FnMut(TerrainHit) -> bool> Walk<'_, F> {
    /// Walks the blocks `first..last` of a level between two parameters; their nodes start at `base`. `false` when nothing
    /// more is wanted.
    fn grid(&mut self, level: u8, first: [u32; 2], last: [u32; 2], base: usize, [near, far]: [f64; 2]) -> bool {
        let cells = self.surface.tree.size(level);
        let (size, inverse) = (f64::from(cells), inverse_power(cells));
        let (u, v) = (self.u, self.v);
        let mut column = u.block(near, size, inverse, first[0], last[0]);
        let mut row = v.block(near, size, inverse, first[1], last[1]);
        let width = last[0] - first[0];
        let (mut leave_u, mut leave_v) = (u.leaves(column, size), v.leaves(row, size));
        let (mut t, mut z) = (near, self.height_along(near));
        // Each step goes on by one column or one row.
        for _ in 0..=width + (last[1] - first[1]) {
            let leave = leave_u.min(leave_v).min(far).max(t);
            let z_leave = self.height_along(leave);
            let fans = self.surface.fans;
            let node = fans.node(base + ((row - first[1]) * width + column - first[0]) as usize);
            let clear =
                i8::from(z.min(z_leave) > f64::from(node.high)) - i8::from(z.max(z_leave) < f64::from(node.low));
            if clear != 0 && (self.sign == 0 || self.sign == clear) {
                self.sign = clear;
                self.zero_since = None;
                self.last = None;
            } else if !self.closer(PatchId { level, column, row }, node, [t, leave]) {
                // Also where a block is clear, but on the other side: so that the hit at its border gets its patch.
                return false;
            }
            (t, z) = (leave, z_leave);
            if t >= far {
                return true;
            }
            if leave_u <= leave_v {
                column = u.next(column);
                // Rounding of the clip may leave a rest beyond the last line.
                if column.wrapping_sub(first[0]) >= width {
                    return true;
                }
                leave_u = u.leaves(column, size);
            } else {
                row = v.next(row);
                if row.wrapping_sub(first[1]) >= last[1] - first[1] {
                    return true;
                }
                leave_v = v.leaves(row, size);
            }
        }
        debug_assert!(false, "a walk over a grid takes at most columns + rows steps");
        true
    }

    #[inline(always)]
    fn height_along(&self, t: f64) -> f64 {
        self.ray.origin.z + self.ray.direction.z * t
    }

    fn closer(&mut self, patch: PatchId, node: &FanNode, range: [f64; 2]) -> bool {
        if node.children == 0 {
            return self.fan(patch, node, range);
        }
        let tree = self.surface.tree;
        let r = tree.resolutions().branching();
        let [columns, rows] = tree.grid(patch.level + 1);
        let first = [patch.column * r, patch.row * r];
        let last = [(first[0] + r).min(columns), (first[1] + r).min(rows)];
        self.grid(patch.level + 1, first, last, node.children as usize, range)
    }

    fn fan(&mut self, patch: PatchId, node: &FanNode, [near, far]: [f64; 2]) -> bool {
        let tree = self.surface.tree;
        let size = tree.size(patch.level);
        let [u0, v0] = tree.origin(patch);
        let [cells_u, cells_v] = tree.cells();
        if u0 + size > cells_u || v0 + size > cells_v {
            return self.clamped_fan(patch, [near, far]);
        }
        // The centre is the middle: the spokes lie on the two diagonals.
        let half = f64::from(size) * 0.5;
        let (o, d) = (self.ray.origin, self.ray.direction);
        let (ou, ov) = (o.x - (f64::from(u0) + half), o.y - (f64::from(v0) + half));
        let cut = |t: f64| if t > near && t < far { t } else { far };
        let (a, b) = (cut((ou - ov) * self.across[0]), cut(-(ou + ov) * self.across[1]));
        let [nw, ne, se, sw, center] = node.heights.map(f64::from);
        let scale = inverse_power(size);
        let scale_half = 2.0 * scale;
        let mut from = near;
        for to in [a.min(b), a.max(b), far] {
            if to <= from && to < far {
                continue;
            }
            let middle = 0.5 * (from + to);
            let (mu, mv) = (ou + d.x * middle, ov + d.y * middle);
            // Sums of two samples and differences are exact, and so are products with powers of two.
            let (side, gu, gv) = if mv.abs() >= mu.abs() {
                if mv < 0.0 {
                    (Side::North, (ne - nw) * scale, (center - 0.5 * (nw + ne)) * scale_half)
                } else {
                    (Side::South, (se - sw) * scale, (0.5 * (sw + se) - center) * scale_half)
                }
            } else if mu < 0.0 {
                (Side::West, (center - 0.5 * (nw + sw)) * scale_half, (sw - nw) * scale)
            } else {
                (Side::East, (0.5 * (ne + se) - center) * scale_half, (se - ne) * scale)
            };
            let above = |t: f64| (o.z + d.z * t) - (center + gu * (ou + d.x * t) + gv * (ov + d.y * t));
            let (f0, f1) = (above(from), above(to));
            // Nearly always the ray stays on its side.
            let sign = f64::from(self.sign);
            let stays = f0 * sign > 0.0 && f1 * sign > 0.0;
            if stays {
                self.zero_since = None;
                self.last = Some(patch);
            } else if !self.piece(patch, side, [from, to], [f0, f1], from == near) {
                return false;
            }
            if to >= far {
                break;
            }
            from = to;
        }
        true
    }

    /// The fan of a patch that the border of the map cuts.
    fn clamped_fan(&mut self, patch: PatchId, [near, far]: [f64; 2]) -> bool {
        let fan = Fan::new(self.surface.field, self.surface.tree, patch);
        let d = self.ray.direction;
        // Spokes that the ray's line crosses: each corner and the centre lie on one side of the line.
        let side_of = |p: DVec3| d.x * (p.y - self.ray.origin.y) - d.y * (p.x - self.ray.origin.x);
        let passes = |p: DVec3| {
            let t =
                if d.x.abs() >= d.y.abs() { (p.x - self.ray.origin.x) / d.x } else { (p.y - self.ray.origin.y) / d.y };
            if t > near && t < far { t } else { far }
        };
        let center = side_of(fan.center);
        // Along the border of the map, triangles may meet in the centre alone, without a spoke that is crossed.
        let mut cuts = [passes(fan.center); 5];
        for (cut, corner) in cuts.iter_mut().zip(fan.corners) {
            let s = side_of(corner);
            if (s < 0.0) != (center < 0.0) {
                *cut = passes(corner + (fan.center - corner) * (s / (s - center)));
            }
        }
        cuts.sort_unstable_by(f64::total_cmp);
        let mut from = near;
        for to in cuts.into_iter().chain([far]) {
            let middle = self.ray.at(0.5 * (from + to));
            let side = fan.side_at(middle.x, middle.y);
            let above = |t: f64| {
                let p = self.ray.at(t);
                p.z - fan.height(side, p.x, p.y)
            };
            let (f0, f1) = (above(from), above(to));
            if !self.piece(patch, side, [from, to], [f0, f1], from == near) {
                return false;
            }
            if to >= far {
                break;
            }
            from = to;
        }
        true
    }

    /// A vertical ray meets the surface once.
    fn vertical(&mut self) {
        let CoarseSurface { tree, selection, .. } = self.surface;
        let (o, d) = (self.ray.origin, self.ray.direction.z);
        let at = |level: u8| {
            let [columns, rows] = tree.grid(level);
            let size = tree.size(level);
            PatchId { level, column: (o.x as u32 / size).min(columns - 1), row: (o.y as u32 / size).min(rows - 1) }
        };
        let mut patch = at(0);
        while selection.is_split(tree, patch) && patch.level < tree.depth() {
            patch = at(patch.level + 1);
        }
        let fan = Fan::new(self.surface.field, tree, patch);
        let side = fan.side_at(o.x, o.y);
        let t = (fan.height(side, o.x, o.y) - o.z) / d;
        if t >= self.ray.near && t <= self.ray.far {
            self.report(patch, side, t, None, d < 0.0);
        }
    }

    /// A piece of the ray over one triangle, with f at its ends.
    #[cold]
    #[inline(never)]
    fn piece(&mut self, patch: PatchId, side: Side, [t0, t1]: [f64; 2], [f0, f1]: [f64; 2], enters: bool) -> bool {
        for (t, f, start) in [(t0, f0, true), (t1, f1, false)] {
            if f == 0.0 {
                // On the surface: a crossing only if the sign is another afterwards. At the ends of the ray (or of
                // the map) it is a hit.
                let end = t <= self.ray.near || t >= self.ray.far;
                if end && self.zero_since.is_none() {
                    let entering = if start { f1 < 0.0 } else { f0 > 0.0 };
                    if !self.report(patch, side, t, None, entering) {
                        return false;
                    }
                    // Counted: what follows is on the other side, or leaves again.
                    self.sign = 0;
                }
                self.zero_since.get_or_insert(t);
                continue;
            }
            let sign = if f > 0.0 { 1 } else { -1 };
            if self.sign != 0 && sign != self.sign {
                let crossing = match (self.zero_since, start) {
                    (Some(zero), _) => zero,
                    // At the border of two pieces: a wall between patches of unequal size, or rounding.
                    (None, true) => t,
                    (None, false) => t0 + (t1 - t0) * (f0 / (f0 - f1)),
                };
                let wall = (start && enters && self.zero_since.is_none())
                    .then(|| self.entered_side(patch, t))
                    .flatten()
                    .filter(|&side| self.unequal(patch, side));
                if !self.report(patch, side, crossing, wall, sign < 0) {
                    return false;
                }
            }
            self.sign = sign;
            self.zero_since = None;
        }
        self.last = Some(patch);
        true
    }

    /// Whether the patch that was left last is of another level.
    fn unequal(&self, patch: PatchId, side: Side) -> bool {
        match self.last {
            Some(last) => last.level != patch.level,
            // The neighbour was skipped as a block: see whether its fan can differ.
            None => self
                .surface
                .tree
                .neighbour(patch, side)
                .is_some_and(|n| self.surface.selection.active(self.surface.tree, n).is_none()),
        }
    }

    /// The side through which the ray came into a patch at t.
    fn entered_side(&self, patch: PatchId, t: f64) -> Option<Side> {
        let [[u0, v0], [u1, v1]] = self.surface.tree.extent(patch);
        let p = self.ray.at(t);
        let d = self.ray.direction;
        let candidates = [
            (d.x > 0.0, (p.x - f64::from(u0)).abs(), Side::West),
            (d.x < 0.0, (p.x - f64::from(u1)).abs(), Side::East),
            (d.y > 0.0, (p.y - f64::from(v0)).abs(), Side::North),
            (d.y < 0.0, (p.y - f64::from(v1)).abs(), Side::South),
        ];
        candidates.into_iter().filter(|c| c.0).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(_, _, side)| side)
    }

    #[cold]
    #[inline(never)]
    fn report(&mut self, patch: PatchId, side: Side, t: f64, wall: Option<Side>, entering: bool) -> bool {
        let tree = self.surface.tree;
        let fan = Fan::new(self.surface.field, tree, patch);
        let mut error = self.surface.errors.get(tree, patch);
        let mut point = self.ray.at(t);
        if let Some(wall) = wall {
            // A wall stands between two fans: the larger of the two bounds.
            let other = self.last.or_else(|| tree.neighbour(patch, wall)).map(|p| self.covering(p));
            error = other.map_or(error, |p| error.max(self.surface.errors.get(tree, p)));
        } else {
            let cells = tree.cells();
            let (u, v) = (point.x.clamp(0.0, f64::from(cells[0])), point.y.clamp(0.0, f64::from(cells[1])));
            point = DVec3::new(u, v, fan.height(side, u, v));
        }
        let field = self.surface.field;
        if field.has_holes() && field.ground_at(point.x, point.y).is_none() {
            return true;
        }
        let hit = TerrainHit { t, point, gradient: fan.gradient(side), wall, patch, triangle: side, error, entering };
        (self.found)(hit)
    }

    /// The patch itself or the active one that contains it.
    fn covering(&self, mut patch: PatchId) -> PatchId {
        let (tree, selection) = (self.surface.tree, self.surface.selection);
        while selection.active(tree, patch).is_none()
            && !selection.is_split(tree, patch)
            && let Some(parent) = tree.parent(patch)
        {
            patch = parent;
        }
        patch
    }
}
