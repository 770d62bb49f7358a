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
//! Along the ray, f(t) = w_ray(t) − h(u(t), v(t)) is the height above the surface. It is looked at patch by patch, in the order in
//! which the ray passes them, each time between the parameters at which it enters and leaves the patch. Those are computed once
//! from the lines' integer coordinates, so that both neighbours use the same bits and no gap or overlap can open between them.
//! Patches are not looked at where the ray stays above the largest or below the smallest height of the fans in a block of them; which
//! ones are left says [`FanTree`]. Inside a patch the interval is split at the fan's spokes. The *sign* of f is carried from piece to
//! piece: a change is a hit wherever it is seen, inside a triangle, or at the border of two patches (a wall, or rounding). Only
//! crossings count, not mere touching; a ray that starts or ends exactly on the surface, or passes the border of the map exactly on
//! it, hits it there.
//!
//! Where the map has holes, the fans are those of the surface with its lids, and a crossing counts only where the
//! full-resolution surface is ground: four triangles show no outline, so picks pass through the holes as they are in truth.
//!
//! No patch is looked at twice until the sign has changed, and then only those further on: a walk can not loop. A line passes
//! at most `columns + rows` of the finest patches ([`Hierarchy::step_limit`]).
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing))]

use arrayvec::ArrayVec;
use glam::DVec3;

use super::axis::{Axis, approach};
use super::errors::{round_up, triangle_error};
pub use super::fan_tree::FanTree;
use super::fan_tree::{Below, Course, LEVELS, SelectedFan, Visit};
use super::height_field::{HeightField, SampleRect};
use super::hierarchy::{Hierarchy, PatchId};
use super::parts::Side;
use super::pyramid::{larger, smaller};
use super::selection::Selection;
use super::sign::Sign;

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

fn lattice_point([u, v]: [u32; 2], w: f64) -> DVec3 {
    DVec3::new(f64::from(u), f64::from(v), w)
}

fn cross(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)
}

impl Fan {
    /// The fan of a patch.
    #[must_use]
    pub fn new(field: &HeightField, tree: &Hierarchy, patch: PatchId) -> Self {
        let [nw, ne, se, sw, center] = Self::places(tree, patch).map(|[u, v]| lattice_point([u, v], field.raw(u, v)));
        Self { corners: [nw, ne, se, sw], center }
    }

    /// The fan of a patch as it is seen from above: all heights 0.
    #[must_use]
    pub(crate) fn flat(tree: &Hierarchy, patch: PatchId) -> Self {
        Self::with_heights(tree, patch, [0.0; 5])
    }

    /// The fan of a patch, from its heights in the order of [`Fan::places`].
    fn with_heights(tree: &Hierarchy, patch: PatchId, heights: [f32; 5]) -> Self {
        let mut heights = heights.into_iter();
        let [nw, ne, se, sw, center] =
            Self::places(tree, patch).map(|place| lattice_point(place, heights.next().map_or(0.0, f64::from)));
        Self { corners: [nw, ne, se, sw], center }
    }

    /// Column and row of the corners and of the centre.
    pub(super) fn places(tree: &Hierarchy, patch: PatchId) -> [[u32; 2]; 5] {
        let [[u0, v0], [u1, v1]] = tree.extent(patch);
        let half = tree.size(patch.level) / 2;
        [[u0, v0], [u1, v0], [u1, v1], [u0, v1], [(u0 + half).min(u1), (v0 + half).min(v1)]]
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
        let p = DVec3::new(u, v, 0.0);
        let mut best = (f64::NEG_INFINITY, Side::North);
        for side in Side::ALL {
            let [a, b, c] = self.triangle(side);
            // Twice the areas that the point spans with the sides: it lies in the triangle if none is negative. All triangles are
            // turned the same way, and their corners are whole numbers: none without area looks as if it had one.
            let depth = smaller(smaller(cross(b, c, p), cross(c, a, p)), cross(a, b, p));
            if depth > best.0 && cross(a, b, c) != 0.0 {
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
        self.facet(side).height(u, v)
    }

    fn facet(&self, side: Side) -> Facet {
        Facet { side, gradient: self.gradient(side), center: self.center }
    }
}

/// The plane of one triangle of a fan.
#[derive(Clone, Copy)]
struct Facet {
    side: Side,
    gradient: [f64; 2],
    center: DVec3,
}

impl Facet {
    #[inline(always)]
    fn height(&self, u: f64, v: f64) -> f64 {
        self.height_from(u - self.center.x, v - self.center.y)
    }

    /// Height at a distance from the centre.
    #[inline(always)]
    fn height_from(&self, u: f64, v: f64) -> f64 {
        // From the nearest corner on a flat side this would be exact; from the centre it is within a few ulp.
        self.center.z + (self.gradient[0] * u + self.gradient[1] * v)
    }
}

/// The fan of a patch that is wholly on the map: its centre is the middle.
struct WholeFan {
    /// 1 / size.
    scale: f64,
    /// Corners north-west, north-east, south-east, south-west.
    heights: [f64; 4],
    center: DVec3,
}

impl WholeFan {
    #[inline(always)]
    fn new(fan: &SelectedFan) -> Self {
        let shift = fan.shift() as i32;
        let half = power(shift - 1);
        let [u, v] = fan.corner.map(|i| f64::from(i as i32));
        let [nw, ne, se, sw, center] = fan.heights.map(f64::from);
        Self { scale: power(-shift), heights: [nw, ne, se, sw], center: DVec3::new(u + half, v + half, center) }
    }

    /// The triangle at a distance from the centre.
    #[inline(always)]
    fn facet(&self, u: f64, v: f64) -> Facet {
        let [nw, ne, se, sw] = self.heights;
        let center = self.center.z;
        let (scale, scale_half) = (self.scale, 2.0 * self.scale);
        // Sums of two samples and differences are exact, and so are products with powers of two.
        let (side, gu, gv) = if v.abs() >= u.abs() {
            if v < 0.0 {
                (Side::North, (ne - nw) * scale, (center - 0.5 * (nw + ne)) * scale_half)
            } else {
                (Side::South, (se - sw) * scale, (0.5 * (sw + se) - center) * scale_half)
            }
        } else if u < 0.0 {
            (Side::West, (center - 0.5 * (nw + sw)) * scale_half, (sw - nw) * scale)
        } else {
            (Side::East, (0.5 * (ne + se) - center) * scale_half, (se - ne) * scale)
        };
        Facet { side, gradient: [gu, gv], center: self.center }
    }

    /// Height on the spokes of two corners, west and east of the centre, at a distance from it along u.
    #[inline(always)]
    fn on_spoke(&self, [west, east]: [f64; 2], u: f64) -> f64 {
        let corner = if u < 0.0 { west } else { east };
        self.center.z + (corner - self.center.z) * (u.abs() * (2.0 * self.scale))
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

    /// The same ray with reciprocals and products that are finite, and the factor from its parameters to those of this one. `None` for
    /// one that is not finite, has no direction, or an empty range.
    #[inline(always)]
    pub(super) fn tamed(&self) -> Option<(Self, f64)> {
        let Self { origin, mut direction, mut near, mut far } = *self;
        let length = direction.abs().max_element();
        if !(origin.is_finite() && direction.is_finite() && length > 0.0 && near <= far) {
            return None;
        }
        let mut unit = 1.0;
        if !(1.0 / EXTREME..EXTREME).contains(&length) {
            // Powers of two are exact. The factor has to be a float itself.
            let exponent = (length.log2().floor() as i32).clamp(-1000, 1000);
            unit = 2f64.powi(-exponent);
            direction *= unit;
            (near, far) = (near / unit, far / unit);
        }
        // Too steep for a reciprocal, a ray is vertical: before it has moved by a cell it is beyond all heights.
        let upright = |d: f64| if d.abs() < 1e-300 { 0.0 } else { d };
        let direction = DVec3::new(upright(direction.x), upright(direction.y), direction.z);
        (direction != DVec3::ZERO).then_some((Self { origin, direction, near, far }, unit))
    }
}

/// Directions beyond are scaled.
const EXTREME: f64 = 1e120;

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

/// A place on the surface.
#[derive(Clone, Copy)]
struct Contact<'t> {
    t: f64,
    fan: &'t SelectedFan,
    /// A parameter at which the ray is over the triangle.
    over: f64,
    /// For a wall between patches of different size: the side of the entered patch that it stands on.
    wall: Option<Side>,
}

/// Whoever was told of a hit wants no more.
struct Stopped;

struct Walk<'t, F> {
    surface: CoarseSurface<'t>,
    /// Its range is clipped to the map.
    ray: LatticeRay,
    u: Axis,
    v: Axis,
    /// 1 / (d_v − d_u) and 1 / (d_v + d_u), for the diagonals of patches.
    across: [f64; 2],
    sign: Sign<Contact<'t>>,
    /// The fan that was looked at last, unless the ray has been clear since.
    last: Option<&'t SelectedFan>,
    /// The ray's t is this times the walk's.
    unit: f64,
    found: F,
}

impl CoarseSurface<'_> {
    /// Calls `found` with the crossings of the ray with the surface, in order of t, each once, until it returns `false`.
    ///
    /// A ray whose origin or direction is not finite, whose direction is zero or whose range is empty crosses nothing.
    pub fn intersect(&self, ray: &LatticeRay, found: impl FnMut(TerrainHit) -> bool) {
        let [cu, cv] = self.tree.cells();
        let Some((mut ray, unit)) = ray.tamed() else { return };
        let (o, d) = (ray.origin, ray.direction);
        let (u, v) = (Axis::new(o.x, d.x, cu), Axis::new(o.y, d.y, cv));
        let beside = |axis: &Axis| axis.direction == 0.0 && !(0.0..=f64::from(axis.cells)).contains(&axis.origin);
        if beside(&u) || beside(&v) {
            return;
        }
        let ([near_u, far_u], [near_v, far_v]) = (u.range(), v.range());
        ray.near = larger(ray.near, larger(near_u, near_v));
        ray.far = smaller(ray.far, smaller(far_u, far_v));
        let across = [1.0 / (d.y - d.x), 1.0 / (d.y + d.x)];
        let mut walk = Walk { surface: *self, ray, u, v, across, sign: Sign::unknown(), last: None, unit, found };
        if d.x == 0.0 && d.y == 0.0 {
            walk.vertical();
        } else if ray.near <= ray.far
            && ray.near.is_finite()
            && ray.far.is_finite()
            && let Some((start, sign)) = approach(o.z, d.z, self.fans.range, [ray.near, ray.far])
        {
            walk.sign.now = sign;
            walk.march(start);
        }
    }
}

/// 2^k.
#[inline(always)]
fn power(k: i32) -> f64 {
    f64::from_bits(((1023 + k) as u64) << 52)
}

impl<'t, F: FnMut(TerrainHit) -> bool> Walk<'t, F> {
    /// Walks from a parameter on.
    fn march(&mut self, start: f64) {
        let mut from = Some(start);
        if start == self.ray.far {
            // Nothing to walk along: the fan there says whether the ray's only point lies on it.
            from = None;
            if let Some(fan) = self.surface.fans.fan_at(self.cell(start))
                && !self.fan(fan, [start; 2])
            {
                return;
            }
        }
        while let Some(t) = from {
            let above = self.sign.now >= 0;
            let down = (self.ray.direction.z <= 0.0) == above;
            let walked = if down { self.march_on::<true>(t, above) } else { self.march_on::<false>(t, above) };
            let Ok(next) = walked else { return };
            from = next;
        }
        if let Some((contact, entering)) = self.sign.end() {
            self.report(&contact, entering);
        }
    }

    /// The cell in which the ray is at t.
    fn cell(&self, t: f64) -> [u32; 2] {
        let p = self.ray.at(t);
        [(p.x, self.u.cells), (p.y, self.v.cells)].map(|(x, cells)| (x as u32).min(cells - 1))
    }

    /// Walks from a parameter on while the ray is above the surface, or below it, or while it is not known which (which is walked
    /// like above). Returns the parameter from which to go on after the sign has changed, `None` after the whole ray.
    #[inline(always)]
    fn march_on<const DOWN: bool>(&mut self, start: f64, above: bool) -> Result<Option<f64>, Stopped> {
        let fans = self.surface.fans;
        let (course, top) = Course::<DOWN>::new(fans, &self.ray, [&self.u, &self.v], start, above);
        // The block where it is, and before it those around of which squares are left.
        let mut visits = ArrayVec::<Visit, LEVELS>::new();
        visits.push(top);
        // How far the fans were looked at without a gap.
        let mut reached = start;
        let mut left = fans.step_limit;
        while let Some(here) = visits.last_mut() {
            let Some(square) = here.next() else {
                visits.pop();
                continue;
            };
            let number = course.number(square);
            match fans.below(here.block, number) {
                Below::Block(block) => {
                    let below = course.below(fans, here, square, block);
                    // There is no way back to a block of which no square is left; without a branch, which could not be foreseen.
                    let done = usize::from(here.is_done());
                    visits.truncate(visits.len() - done);
                    if visits.try_push(below).is_err() {
                        break;
                    }
                }
                Below::Fan(fan) => {
                    let [enter, leave] = self.through(fan.corner, fan.size(), start);
                    if enter >= leave {
                        continue;
                    }
                    // By a square that the ray does not pass it is not known when it is the turn of a patch that fills several.
                    let up = fan.shift() - here.shift;
                    if up != 0 {
                        if !self.passes(fan.part(here.shift, number), 1 << here.shift, start) {
                            continue;
                        }
                        here.skip(square, up);
                    }
                    debug_assert!(enter >= reached, "fans are looked at in their order");
                    if left == 0 {
                        debug_assert!(false, "a walk visits no fan twice");
                        break;
                    }
                    left -= 1;
                    if enter > reached {
                        self.clear(above)?;
                    }
                    reached = leave;
                    if !self.fan(fan, [enter, leave]) {
                        return Err(Stopped);
                    }
                    if self.sign.now == if above { -1 } else { 1 } {
                        return Ok(Some(leave));
                    }
                }
                Below::Nothing => {}
            }
        }
        if self.ray.far > reached {
            self.clear(above)?;
        }
        Ok(None)
    }

    /// The parameters between which the ray is in a square, not before `start`: the first is below the second if it passes it.
    #[inline(always)]
    fn through(&self, corner: [u32; 2], size: u32, start: f64) -> [f64; 2] {
        let [column, row] = corner;
        let ([enter_u, leave_u], [enter_v, leave_v]) = (self.u.across(column, size), self.v.across(row, size));
        [larger(start, larger(enter_u, enter_v)), smaller(self.ray.far, smaller(leave_u, leave_v))]
    }

    /// Whether the ray passes a square that is part of a patch. Squares that it does not pass may be named beside those that it does.
    #[inline(never)]
    fn passes(&self, corner: [u32; 2], size: u32, start: f64) -> bool {
        let [enter, leave] = self.through(corner, size, start);
        enter < leave
    }

    /// The ray has been clear of the surface since the last fan, above it or below.
    #[inline(always)]
    fn clear(&mut self, above: bool) -> Result<(), Stopped> {
        self.last = None;
        if self.sign.now != 0 {
            self.sign.zero_since = None;
        } else if let Some(turn) = self.sign.pass(if above { 1.0 } else { -1.0 })
            && let Some(contact) = turn.zero_since
            && !self.report(&contact, turn.entering)
        {
            return Err(Stopped);
        }
        Ok(())
    }

    /// Looks at a fan over which the ray is between two parameters.
    // Within the walk it would need the registers of that.
    #[inline(never)]
    fn fan(&mut self, fan: &'t SelectedFan, [near, far]: [f64; 2]) -> bool {
        let Some(square) = self.whole(fan) else { return self.clamped_fan(fan, [near, far]) };
        let (o, d) = (self.ray.origin, self.ray.direction);
        let (ou, ov) = (o.x - square.center.x, o.y - square.center.y);
        // f at a place of the ray, given the height there.
        let above = |t: f64, height: f64| (o.z + d.z * t) - height;
        let at = |t: f64| (ou + d.x * t, ov + d.y * t);
        let height = |t: f64| {
            let (mu, mv) = at(t);
            square.facet(mu, mv).height_from(mu, mv)
        };
        // The spokes lie on the two diagonals.
        let (a, b) = ((ou - ov) * self.across[0], -(ou + ov) * self.across[1]);
        let [nw, ne, se, sw] = square.heights;
        let (fa, fb) = (above(a, square.on_spoke([nw, se], at(a).0)), above(b, square.on_spoke([sw, ne], at(b).0)));
        let (f0, f1) = (above(near, height(near)), above(far, height(far)));
        let (a, fa) = if a > near && a < far { (a, fa) } else { (far, f1) };
        let (b, fb) = if b > near && b < far { (b, fb) } else { (far, f1) };
        let sign = f64::from(self.sign.now);
        if f0 * sign > 0.0 && fa * sign > 0.0 && fb * sign > 0.0 && f1 * sign > 0.0 {
            self.sign.zero_since = None;
            self.last = Some(fan);
            return true;
        }
        let ends =
            if a <= b { [(near, f0), (a, fa), (b, fb), (far, f1)] } else { [(near, f0), (b, fb), (a, fa), (far, f1)] };
        // No triangle rises by more than the range of heights over half the patch, along either axis.
        self.follow(fan, |[low, high]| 4.0 * square.scale * (high - low), &ends)
    }

    /// The fan of a patch that is wholly on the map.
    #[inline(always)]
    fn whole(&self, fan: &SelectedFan) -> Option<WholeFan> {
        let ([u, v], size) = (fan.corner, fan.size());
        (u + size <= self.u.cells && v + size <= self.v.cells).then(|| WholeFan::new(fan))
    }

    /// The triangle of a fan that the ray is over at t.
    #[inline(always)]
    fn facet(&self, fan: &SelectedFan, t: f64) -> Facet {
        let (o, d) = (self.ray.origin, self.ray.direction);
        if let Some(square) = self.whole(fan) {
            square.facet((o.x - square.center.x) + d.x * t, (o.y - square.center.y) + d.y * t)
        } else {
            self.clamped_facet(fan, t)
        }
    }

    #[cold]
    #[inline(never)]
    fn clamped_facet(&self, fan: &SelectedFan, t: f64) -> Facet {
        let (fan, p) = (Fan::with_heights(self.surface.tree, fan.patch(), fan.heights), self.ray.at(t));
        fan.facet(fan.side_at(p.x, p.y))
    }

    /// The fan of a patch that the border of the map cuts.
    #[cold]
    #[inline(never)]
    fn clamped_fan(&mut self, selected: &'t SelectedFan, [near, far]: [f64; 2]) -> bool {
        let fan = Fan::with_heights(self.surface.tree, selected.patch(), selected.heights);
        let ray = self.ray;
        let (o, d) = (ray.origin, ray.direction);
        // Each corner and the centre lie on one side of the ray's line, or on it: so it is known which spokes it crosses.
        let side_of = |p: DVec3| d.x * (p.y - o.y) - d.y * (p.x - o.x);
        let center = side_of(fan.center);
        // Where it crosses one, and f there. The centre may be the only place where two triangles along the border meet.
        let mut cuts = [(far, 0.0); 5];
        let mut count = 0;
        let spokes = fan.corners.into_iter().filter_map(|corner| {
            let s = side_of(corner);
            ((s < 0.0) != (center < 0.0)).then(|| corner + (fan.center - corner) * (s / (s - center)))
        });
        for p in spokes.chain((center == 0.0).then_some(fan.center)) {
            let t = if d.x.abs() >= d.y.abs() { (p.x - o.x) / d.x } else { (p.y - o.y) / d.y };
            if let Some(cut) = cuts.get_mut(count)
                && t > near
                && t < far
            {
                *cut = (t, o.z + d.z * t - p.z);
                count += 1;
            }
        }
        cuts.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        // f at the end of a piece that has another end.
        let end = |t: f64, other: f64| {
            let (p, middle) = (ray.at(t), ray.at(0.5 * (t + other)));
            (t, p.z - fan.height(fan.side_at(middle.x, middle.y), p.x, p.y))
        };
        let last = cuts.get(count.wrapping_sub(1)).map_or(near, |cut| cut.0);
        let (first, last) = (end(near, cuts[0].0), end(far, last));
        // Behind the spokes that are crossed, the end as often as there is room.
        let mut ends = [last; 7];
        ends[0] = first;
        for (place, cut) in ends.iter_mut().skip(1).zip(cuts).take(count) {
            *place = cut;
        }
        let rises = Side::ALL.map(|side| fan.gradient(side)).map(|[gu, gv]| gu.abs() + gv.abs());
        self.follow(selected, |_| rises.into_iter().fold(0.0, larger), &ends)
    }

    /// A vertical ray meets the surface once.
    fn vertical(&mut self) {
        let fans = self.surface.fans;
        let (o, d) = (self.ray.origin, self.ray.direction.z);
        let Some(fan) = fans.fan_at(self.cell(0.0)) else { return };
        let facet = self.facet(fan, 0.0);
        let t = (facet.height(o.x, o.y) - o.z) / d;
        if t >= self.ray.near && t <= self.ray.far {
            self.report(&Contact { t, fan, over: t, wall: None }, d < 0.0);
        }
    }

    /// Follows the ray over a patch: `ends` are the parameters at which it enters it, goes from one of its triangles to the next, and
    /// leaves it, with f there; beyond the last there may be copies of it. For `rise` see [`Walk::is_in_doubt`].
    #[cold]
    #[inline(never)]
    fn follow<const N: usize>(
        &mut self,
        fan: &'t SelectedFan,
        rise: impl Fn([f64; 2]) -> f64,
        ends: &[(f64, f64); N],
    ) -> bool {
        let Some(&(mut before)) = ends.first() else { return true };
        for (i, &(t, f)) in ends.iter().enumerate() {
            let (t0, f0) = before;
            if t <= t0 && i > 0 && i + 1 < ends.len() {
                continue;
            }
            before = (t, f);
            if f * f64::from(self.sign.now) > 0.0 {
                self.sign.zero_since = None;
                continue;
            }
            if f == 0.0 || self.sign.turns(f) && self.is_in_doubt(t, f, fan, &rise) {
                let next = || ends.iter().find(|(next, _)| *next > t).map_or(t, |next| next.0);
                let over = 0.5 * (t + if i == 0 { next() } else { t0 });
                self.sign.zero_since.get_or_insert(Contact { t, fan, over, wall: None });
                continue;
            }
            let Some(turn) = self.sign.pass(f) else { continue };
            // Where the ray ran within the surface the hit is where it met it, which may be patches ago.
            let contact = turn.zero_since.unwrap_or_else(|| {
                // At the start of the patch: a wall between patches of unequal size, or rounding.
                let wall = (i == 0).then(|| self.wall(fan, t)).flatten();
                let t = if i == 0 { t } else { t0 + (t - t0) * (f0 / (f0 - f)) };
                Contact { t, fan, over: 0.5 * (t0 + t), wall }
            });
            if !self.report(&contact, turn.entering) {
                return false;
            }
        }
        self.last = Some(fan);
        true
    }

    /// Whether f has no sign that rounding could not have given it: at a corner or spoke it is computed from several triangles, and
    /// would change to and fro within the last digits. `rise` bounds |∂w/∂u| + |∂w/∂v| of the fan's triangles, given the range of its
    /// heights.
    ///
    /// With ε = 2⁻⁵³: a parameter comes from two differences, a reciprocal and a product, which moves the ray's point by 4 ε of
    /// |o| + |d t| in each axis, and going along the ray by 2 ε more; on the triangle that is as much times its slope. Its own height is off
    /// by 2 ε of the centre's, and by 3 ε of what it rises over the patch's size; o_w + d_w t by 2 ε of its parts. Together less
    /// than 8 ε of their sum.
    #[inline(always)]
    fn is_in_doubt(&self, t: f64, f: f64, fan: &SelectedFan, rise: impl Fn([f64; 2]) -> f64) -> bool {
        let (o, d) = (self.ray.origin.abs(), (self.ray.direction * t).abs());
        let size = f64::from(fan.size());
        let range = fan.range().map(f64::from);
        let (height, rise) = (larger(-range[0], range[1]), rise(range));
        f.abs() <= 4.0 * f64::EPSILON * (o.z + d.z + height + rise * (o.x + d.x + o.y + d.y + size))
    }

    /// The side through which the ray came into a patch at t, if the patch that it left there is of another level: between the two
    /// stands a wall.
    #[cold]
    #[inline(never)]
    fn wall(&self, fan: &SelectedFan, t: f64) -> Option<Side> {
        let tree = self.surface.tree;
        let patch = fan.patch();
        let [[u0, v0], [u1, v1]] = tree.extent(patch);
        let p = self.ray.at(t);
        let d = self.ray.direction;
        let candidates = [
            (d.x > 0.0, (p.x - f64::from(u0)).abs(), Side::West),
            (d.x < 0.0, (p.x - f64::from(u1)).abs(), Side::East),
            (d.y > 0.0, (p.y - f64::from(v0)).abs(), Side::North),
            (d.y < 0.0, (p.y - f64::from(v1)).abs(), Side::South),
        ];
        let side = candidates.into_iter().filter(|c| c.0).min_by(|a, b| a.1.total_cmp(&b.1)).map(|c| c.2)?;
        let unequal = match self.last {
            Some(last) => last.patch().level != patch.level,
            // The neighbour was skipped as a block: see whether its fan can differ.
            None => tree.neighbour(patch, side).is_some_and(|n| self.surface.selection.active(tree, n).is_none()),
        };
        unequal.then_some(side)
    }

    #[cold]
    #[inline(never)]
    fn report(&mut self, &Contact { t, fan, over, wall }: &Contact, entering: bool) -> bool {
        let (tree, errors) = (self.surface.tree, self.surface.errors);
        let (patch, facet) = (fan.patch(), self.facet(fan, over));
        let mut error = errors.get(tree, patch);
        let mut point = self.ray.at(t);
        if let Some(wall) = wall {
            // A wall stands between two fans: the larger of the two bounds.
            let other =
                self.last.map(SelectedFan::patch).or_else(|| tree.neighbour(patch, wall)).map(|p| self.covering(p));
            error = other.map_or(error, |p| larger(error, errors.get(tree, p)));
        } else {
            let (u, v) = (point.x.clamp(0.0, f64::from(self.u.cells)), point.y.clamp(0.0, f64::from(self.v.cells)));
            point = DVec3::new(u, v, facet.height(u, v));
        }
        let field = self.surface.field;
        if field.has_holes() && field.ground_at(point.x, point.y).is_none() {
            return true;
        }
        let (t, gradient, triangle) = (t * self.unit, facet.gradient, facet.side);
        (self.found)(TerrainHit { t, point, gradient, wall, patch, triangle, error, entering })
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
