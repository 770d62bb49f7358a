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
//! level of the tree visits at most `columns + rows` patches ([`Hierarchy::step_limit`]).
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing))]

use glam::DVec3;

use super::axis::{Axis, approach, number};
use super::errors::{round_up, triangle_error};
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
    fn places(tree: &Hierarchy, patch: PatchId) -> [[u32; 2]; 5] {
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
struct Square {
    /// 1 / size.
    scale: f64,
    /// Corners north-west, north-east, south-east, south-west.
    heights: [f64; 4],
    center: DVec3,
}

impl Square {
    #[inline(always)]
    fn new([u0, v0]: [u32; 2], size: u32, node: &FanNode) -> Self {
        let half = f64::from(size) * 0.5;
        let [nw, ne, se, sw, center] = node.heights.map(f64::from);
        let center = DVec3::new(f64::from(u0) + half, f64::from(v0) + half, center);
        Self { scale: inverse_power(size), heights: [nw, ne, se, sw], center }
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

/// The fans of a selection, compact: what a coarse pick walks through. Made once for a selection, shared by all its picks.
///
/// A node for each active patch, with the five heights of its fan, and for split ones, with the range of the fans below.
/// That range is much tighter than that of the ground: most patches are passed without a look at their fan. Heights are
/// samples, which f32 holds exactly. 32 bytes a node.
#[derive(Debug)]
pub struct FanTree {
    /// That of the roots.
    top: Block,
    /// The roots have 2^shift cells a side.
    shift: u32,
    /// Block by block, row by row.
    nodes: Vec<FanNode>,
    /// Smallest and largest height of all fans.
    range: [f64; 2],
    /// [`Hierarchy::step_limit`].
    step_limit: u32,
}

/// The nodes below one node, or the roots: all of one level, side by side, 2^bits a side (1 to 4 bits, by the resolutions).
///
/// Where patches have two by two children and all patches of a block are split, it holds their children instead, up to four by
/// four, and on the finest level eight by eight: going down into a block costs a walk more than a step does. Where the map ends
/// within a block, nodes that no walk comes to fill it up. So all that a walk has to know of a block is packed into one number,
/// in the node above: going down waits for one load, not for two.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Block(u32);

impl Block {
    /// Below an active patch. (It would be that of the roots, which are below nothing.)
    const NONE: Self = Self(0);

    /// Its first node is number `first`: a multiple of four, so that two bits are left.
    fn new(first: usize, bits: u32) -> Self {
        Self(first as u32 | (bits - 1))
    }

    #[inline(always)]
    fn first(self) -> usize {
        (self.0 & !3) as usize
    }

    #[inline(always)]
    fn bits(self) -> u32 {
        (self.0 & 3) + 1
    }

    /// Where the node of a patch is, by its column and row in the map.
    #[inline(always)]
    fn place(self, column: usize, row: usize) -> usize {
        let (bits, mask) = (self.bits(), (1usize << self.bits()) - 1);
        self.first() + ((row & mask) << bits) + (column & mask)
    }
}

#[derive(Debug, Clone, Copy)]
struct FanNode {
    low: f32,
    high: f32,
    /// Corners north-west, north-east, south-east, south-west, and the centre; of an active patch.
    heights: [f32; 5],
    below: Block,
}

impl FanTree {
    /// The fans of the active patches.
    #[must_use]
    pub fn new(field: &HeightField, tree: &Hierarchy, selection: &Selection) -> Self {
        let mut nodes = Vec::new();
        let maker = Maker { field, tree, selection, bits: tree.resolutions().branching().trailing_zeros() };
        // The roots are no more than the children of one patch would be.
        let (top, shift, range) = maker.add(&mut nodes, PatchId { level: 0, column: 0, row: 0 }, maker.bits);
        Self { top, shift, nodes, range: range.map(f64::from), step_limit: tree.step_limit() }
    }

    /// Bytes that the nodes occupy.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice())
    }
}

/// Makes a [`FanTree`].
struct Maker<'t> {
    field: &'t HeightField,
    tree: &'t Hierarchy,
    selection: &'t Selection,
    /// A patch has 2^bits children a side.
    bits: u32,
}

impl Maker<'_> {
    /// Adds the block of 2^bits patches a side whose north-west corner is `corner`, and all below. Returns it with the shift of
    /// its patches' size and the range of its fans.
    fn add(&self, nodes: &mut Vec<FanNode>, corner: PatchId, bits: u32) -> (Block, u32, [f32; 2]) {
        let PatchId { level, column: west, row: north } = corner;
        let [columns, rows] = self.tree.grid(level);
        let (columns, rows) = (west..(west + (1 << bits)).min(columns), north..(north + (1 << bits)).min(rows));
        let patches = rows.flat_map(|row| columns.clone().map(move |column| PatchId { level, column, row }));
        // The finest level fills most of the map: larger blocks there save more ways down than they cost steps.
        let most = if level + 1 == self.tree.depth() { 3 } else { 2 };
        if self.bits == 1 && bits < most && patches.clone().all(|patch| self.selection.is_split(self.tree, patch)) {
            return self.add(nodes, PatchId { level: level + 1, column: 2 * west, row: 2 * north }, bits + 1);
        }
        let block = Block::new(nodes.len(), bits);
        let nothing = FanNode { low: f32::INFINITY, high: f32::NEG_INFINITY, heights: [0.0; 5], below: Block::NONE };
        nodes.resize(nodes.len() + (1 << (2 * bits)), nothing);
        let mut range = [f32::INFINITY, f32::NEG_INFINITY];
        for patch in patches {
            let PatchId { level, column, row } = patch;
            let mut node = nothing;
            if self.selection.is_split(self.tree, patch) {
                let corner = PatchId { level: level + 1, column: column << self.bits, row: row << self.bits };
                (node.below, _, [node.low, node.high]) = self.add(nodes, corner, self.bits);
            } else {
                node.heights = Fan::places(self.tree, patch).map(|[u, v]| self.field.raw(u, v) as f32);
                [node.low, node.high] = node
                    .heights
                    .iter()
                    .fold([node.low, node.high], |[low, high], &height| [low.min(height), high.max(height)]);
            }
            range = [range[0].min(node.low), range[1].max(node.high)];
            if let Some(place) = nodes.get_mut(block.place(column as usize, row as usize)) {
                *place = node;
            }
        }
        (block, self.tree.size(level).trailing_zeros(), range)
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
struct Contact {
    t: f64,
    patch: PatchId,
    facet: Facet,
    /// For a wall between patches of different size: the side of the entered patch that it stands on.
    wall: Option<Side>,
}

struct Walk<'t, F> {
    surface: CoarseSurface<'t>,
    /// Its range is clipped to the map.
    ray: LatticeRay,
    u: Axis,
    v: Axis,
    /// 1 / (d_v − d_u) and 1 / (d_v + d_u), for the diagonals of patches.
    across: [f64; 2],
    sign: Sign<Contact>,
    /// The patch of the last piece that was looked at closely.
    last: Option<PatchId>,
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
        for axis in [u, v] {
            if axis.direction == 0.0 && !(0.0..=f64::from(axis.cells)).contains(&axis.origin) {
                return;
            }
            let [near, far] = axis.range();
            ray.near = ray.near.max(near);
            ray.far = ray.far.min(far);
        }
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

/// 1 / 2^k for a power of two, exactly and without a division.
#[inline(always)]
fn inverse_power(power: u32) -> f64 {
    f64::from_bits(u64::from(1023 - power.trailing_zeros()) << 52)
}

/// Where a walk is.
struct Place {
    /// The block it is in, and those around it, from the top.
    blocks: [Block; 25],
    /// How many there are around it.
    depth: usize,
    /// Its patches have 2^shift cells a side.
    shift: u32,
    column: usize,
    row: usize,
    t: f64,
    /// Height of the ray at t.
    z: f64,
    /// Steps that may still be made.
    left: u32,
}

impl<F: FnMut(TerrainHit) -> bool> Walk<'_, F> {
    /// Walks from a parameter on.
    fn march(&mut self, start: f64) {
        let FanTree { top, shift, step_limit, .. } = *self.surface.fans;
        let [column, row] = [self.u, self.v].map(|axis| axis.child(0, top.bits(), shift, start));
        let mut place = Place {
            blocks: [top; 25],
            depth: 0,
            shift,
            column,
            row,
            t: start,
            z: self.height_along(start),
            left: step_limit,
        };
        while match self.sign.now {
            1 => self.march_on::<1>(&mut place),
            -1 => self.march_on::<-1>(&mut place),
            _ => self.march_on::<0>(&mut place),
        } {}
        if let Some((contact, entering)) = self.sign.end() {
            self.report(&contact, entering);
        }
    }

    /// Walks on while the ray is on one side of the surface. `SIGN` says which: blocks on that side of the ray are passed, with 0
    /// those on any. Returns `true` when the sign has changed.
    #[inline(always)]
    fn march_on<const SIGN: i8>(&mut self, place: &mut Place) -> bool {
        let (u, v, far) = (self.u, self.v, self.ray.far);
        let nodes = self.surface.fans.nodes.as_slice();
        let Place { mut shift, mut column, mut row, mut t, mut z, mut left, mut depth, .. } = *place;
        let Some(&(mut block)) = place.blocks.get(depth) else { return false };
        loop {
            let size = number(1 << shift);
            let ((mut line_u, step_u), (mut line_v, step_v)) = (u.ahead(column, size), v.ahead(row, size));
            let (mut leave_u, mut leave_v) = (u.line(line_u), v.line(line_v));
            let bits = block.bits();
            let below = loop {
                if left == 0 {
                    debug_assert!(false, "a walk visits no block twice");
                    return false;
                }
                left -= 1;
                let leave = smaller(smaller(leave_u, leave_v), far);
                let z_leave = self.height_along(leave);
                let Some(node) = nodes.get(block.place(column, row)) else {
                    debug_assert!(false, "a walk stays on the map");
                    return false;
                };
                let (low, high) = (f64::from(node.low), f64::from(node.high));
                let clear = match SIGN {
                    1 => smaller(z, z_leave) > high,
                    -1 => larger(z, z_leave) < low,
                    // Not where it has started on the surface: which side is next is for f to say.
                    _ => self.sign.zero_since.is_none() && (smaller(z, z_leave) > high || larger(z, z_leave) < low),
                };
                if clear {
                    if SIGN == 0 {
                        self.sign.now = if z > high { 1 } else { -1 };
                    }
                    self.sign.zero_since = None;
                    self.last = None;
                } else if node.below != Block::NONE {
                    // Also where a block is clear, but on the other side: so that the hit at its border gets its patch.
                    break Ok(node.below);
                } else if !self.fan(node, [column, row], shift, [t, leave]) {
                    return false;
                }
                if leave >= far {
                    return false;
                }
                (t, z) = (leave, z_leave);
                // Which of the two lines comes first is left to the compiler to guess or to work out: made to wait for it, the walk
                // was 3 to 12 % slower.
                let along_u = leave_u <= leave_v;
                let (next_column, next_row) = if along_u { (u.next(column), row) } else { (column, v.next(row)) };
                let crossed = ((next_column ^ column) | (next_row ^ row)) >> bits;
                (column, row) = (next_column, next_row);
                line_u += if along_u { step_u } else { 0.0 };
                line_v += if along_u { 0.0 } else { step_v };
                (leave_u, leave_v) = (u.line(line_u), v.line(line_v));
                if crossed != 0 || self.sign.now != SIGN {
                    break Err(crossed);
                }
            };
            match below {
                Ok(below) => {
                    block = below;
                    depth += 1;
                    let Some(slot) = place.blocks.get_mut(depth) else { return false };
                    *slot = block;
                    shift -= block.bits();
                    // The usual numbers of bits as constants: there is nothing to loop over.
                    (column, row) = match block.bits() {
                        1 => (u.child(column, 1, shift, t), v.child(row, 1, shift, t)),
                        2 => (u.child(column, 2, shift, t), v.child(row, 2, shift, t)),
                        3 => (u.child(column, 3, shift, t), v.child(row, 3, shift, t)),
                        bits => (u.child(column, bits, shift, t), v.child(row, bits, shift, t)),
                    };
                }
                Err(mut crossed) => {
                    while crossed != 0 {
                        let bits = block.bits();
                        (column, row, shift) = (column >> bits, row >> bits, shift + bits);
                        depth = depth.wrapping_sub(1);
                        let Some(&around) = place.blocks.get(depth) else { return false };
                        block = around;
                        crossed >>= block.bits();
                    }
                    if self.sign.now != SIGN {
                        (place.shift, place.column, place.row, place.depth) = (shift, column, row, depth);
                        (place.t, place.z, place.left) = (t, z, left);
                        return true;
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn height_along(&self, t: f64) -> f64 {
        self.ray.origin.z + self.ray.direction.z * t
    }

    /// The patch in a column and row of its level, with 2^shift cells a side.
    #[inline(always)]
    fn patch(&self, [column, row]: [usize; 2], shift: u32) -> PatchId {
        PatchId { level: self.surface.tree.level_with(shift), column: column as u32, row: row as u32 }
    }

    #[inline(always)]
    fn fan(&mut self, node: &FanNode, place: [usize; 2], shift: u32, [near, far]: [f64; 2]) -> bool {
        let patch = self.patch(place, shift);
        let size = 1u32 << shift;
        let [u0, v0] = [patch.column << shift, patch.row << shift];
        if u0 + size > self.u.cells || v0 + size > self.v.cells {
            return self.clamped_fan(patch, node, [near, far]);
        }
        let square = Square::new([u0, v0], size, node);
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
        let ends =
            if a <= b { [(near, f0), (a, fa), (b, fb), (far, f1)] } else { [(near, f0), (b, fb), (a, fa), (far, f1)] };
        let sign = f64::from(self.sign.now);
        if f0 * sign > 0.0 && fa * sign > 0.0 && fb * sign > 0.0 && f1 * sign > 0.0 {
            self.sign.zero_since = None;
            self.last = Some(patch);
            return true;
        }
        // No triangle rises by more than the range of heights over half the patch, along either axis.
        let rise = 4.0 * square.scale * (f64::from(node.high) - f64::from(node.low));
        self.follow((patch, node, rise), &ends, |t| {
            let (mu, mv) = at(t);
            square.facet(mu, mv)
        })
    }

    /// The fan of a patch that the border of the map cuts.
    #[cold]
    #[inline(never)]
    fn clamped_fan(&mut self, patch: PatchId, node: &FanNode, [near, far]: [f64; 2]) -> bool {
        let fan = Fan::with_heights(self.surface.tree, patch, node.heights);
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
        let facet = |t: f64| {
            let p = ray.at(t);
            fan.facet(fan.side_at(p.x, p.y))
        };
        // f at the end of a piece that has another end.
        let end = |t: f64, other: f64| {
            let p = ray.at(t);
            (t, p.z - facet(0.5 * (t + other)).height(p.x, p.y))
        };
        let last = cuts.get(count.wrapping_sub(1)).map_or(near, |cut| cut.0);
        let (first, last) = (end(near, cuts[0].0), end(far, last));
        // Behind the spokes that are crossed, the end as often as there is room.
        let mut ends = [last; 7];
        ends[0] = first;
        for (place, cut) in ends.iter_mut().skip(1).zip(cuts).take(count) {
            *place = cut;
        }
        let sign = f64::from(self.sign.now);
        if ends.iter().all(|&(_, f)| f * sign > 0.0) {
            self.sign.zero_since = None;
            self.last = Some(patch);
            return true;
        }
        let rises = Side::ALL.map(|side| fan.gradient(side)).map(|[gu, gv]| gu.abs() + gv.abs());
        self.follow((patch, node, rises.into_iter().fold(0.0, larger)), &ends, facet)
    }

    /// A vertical ray meets the surface once.
    fn vertical(&mut self) {
        let fans = self.surface.fans;
        let (o, d) = (self.ray.origin, self.ray.direction.z);
        // The lines are measured from the middle of the cell.
        let cell = [self.u.from as usize, self.v.from as usize];
        let (mut block, mut shift) = (fans.top, fans.shift);
        let (patch, node) = loop {
            let [column, row] = cell.map(|i| i >> shift);
            let Some(node) = fans.nodes.get(block.place(column, row)) else { return };
            if node.below == Block::NONE {
                break (self.patch([column, row], shift), node);
            }
            block = node.below;
            shift -= block.bits();
        };
        let [[u0, v0], [u1, v1]] = self.surface.tree.extent(patch);
        let size = self.surface.tree.size(patch.level);
        let facet = if u1 - u0 == size && v1 - v0 == size {
            let square = Square::new([u0, v0], size, node);
            square.facet(o.x - square.center.x, o.y - square.center.y)
        } else {
            let fan = Fan::with_heights(self.surface.tree, patch, node.heights);
            fan.facet(fan.side_at(o.x, o.y))
        };
        let t = (facet.height(o.x, o.y) - o.z) / d;
        if t >= self.ray.near && t <= self.ray.far {
            self.report(&Contact { t, patch, facet, wall: None }, d < 0.0);
        }
    }

    /// Follows the ray over a patch: `ends` are the parameters at which it enters it, goes from one of its triangles to the next, and
    /// leaves it, with f there; beyond the last there may be copies of it. `facet` is the triangle at a parameter; for `rise` see
    /// [`Walk::is_in_doubt`].
    #[cold]
    #[inline(never)]
    fn follow(
        &mut self,
        (patch, node, rise): (PatchId, &FanNode, f64),
        ends: &[(f64, f64)],
        facet: impl Fn(f64) -> Facet,
    ) -> bool {
        let mut before = None;
        for (i, &(t, f)) in ends.iter().enumerate() {
            let (t0, f0) = before.unwrap_or((t, f));
            if t <= t0 && i > 0 && i + 1 < ends.len() {
                continue;
            }
            before = Some((t, f));
            if f == 0.0 || self.sign.turns(f) && self.is_in_doubt(t, f, patch, node, rise) {
                let next = || ends.iter().find(|(next, _)| *next > t).map_or(t, |next| next.0);
                let facet = facet(0.5 * (t + if i == 0 { next() } else { t0 }));
                self.sign.zero_since.get_or_insert(Contact { t, patch, facet, wall: None });
                continue;
            }
            let Some(turn) = self.sign.pass(f) else { continue };
            // Where the ray ran within the surface the hit is where it met it, which may be patches ago.
            let contact = turn.zero_since.unwrap_or_else(|| {
                // At the start of the patch: a wall between patches of unequal size, or rounding.
                let wall = (i == 0).then(|| self.entered_side(patch, t)).flatten();
                let wall = wall.filter(|&side| self.unequal(patch, side));
                let t = if i == 0 { t } else { t0 + (t - t0) * (f0 / (f0 - f)) };
                Contact { t, patch, facet: facet(0.5 * (t0 + t)), wall }
            });
            if !self.report(&contact, turn.entering) {
                return false;
            }
        }
        self.last = Some(patch);
        true
    }

    /// Whether f has no sign that rounding could not have given it: at a corner or spoke it is computed from several triangles, and
    /// would change to and fro within the last digits. `rise` bounds |∂w/∂u| + |∂w/∂v| of the fan's triangles.
    ///
    /// With ε = 2⁻⁵³: a parameter comes from two differences, a reciprocal and a product, which moves the ray's point by 4 ε of
    /// |o| + |d t| in each axis, and going along the ray by 2 ε more; on the triangle that is as much times its slope. Its own height is off
    /// by 2 ε of the centre's, and by 3 ε of what it rises over the patch's size; o_w + d_w t by 2 ε of its parts. Together less
    /// than 8 ε of their sum.
    fn is_in_doubt(&self, t: f64, f: f64, patch: PatchId, node: &FanNode, rise: f64) -> bool {
        let (o, d) = (self.ray.origin.abs(), (self.ray.direction * t).abs());
        let size = f64::from(self.surface.tree.size(patch.level));
        let height = f64::from(larger(-node.low, node.high));
        f.abs() <= 4.0 * f64::EPSILON * (o.z + d.z + height + rise * (o.x + d.x + o.y + d.y + size))
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
    fn report(&mut self, &Contact { t, patch, facet, wall }: &Contact, entering: bool) -> bool {
        let tree = self.surface.tree;
        let mut error = self.surface.errors.get(tree, patch);
        let mut point = self.ray.at(t);
        if let Some(wall) = wall {
            // A wall stands between two fans: the larger of the two bounds.
            let other = self.last.or_else(|| tree.neighbour(patch, wall)).map(|p| self.covering(p));
            error = other.map_or(error, |p| error.max(self.surface.errors.get(tree, p)));
        } else {
            let cells = tree.cells();
            let (u, v) = (point.x.clamp(0.0, f64::from(cells[0])), point.y.clamp(0.0, f64::from(cells[1])));
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
