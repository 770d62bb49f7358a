//! Where a ray meets the surface that is on the screen: the very triangles of tiles and strips.
//!
//! # The surface
//!
//! What [`DrawnSurface`] lists, nothing else. A triangle that is left out is a hole; a ray goes through it, and what it finds
//! beyond is judged there alone, so no wall stands on the rim of a hole. The rim itself belongs to the triangles that are drawn:
//! a ray that meets the surface exactly there hits it, though it be over the hole. Where a patch crosses the border of the map its
//! triangles beyond collapse to slivers in the vertical plane of the border. They are drawn, so they are hit too, as small
//! walls; they are as high as the error of the patch's sides at most.
//!
//! # The walk
//!
//! Patches are visited front to back; one that the ray passes above or below all heights of is left out. In an active patch
//! each triangle that the line crosses gives two values of f = w_ray − h, where the line comes in and where it goes out.
//! Neighbours compute the same two numbers for the edge that they share (see the module `line`), so the triangles make a chain from
//! edge to edge along which f is followed, as on the other surfaces, by its sign (see the module `sign`). Patches that lie on one side
//! beyond doubt are left out of it. So on a surface without cracks no crossing is lost between two triangles, and none is found
//! twice. Where the chain is broken, 0 counts as above.
//!
//! Only crossings count, not mere touching; but a ray that starts or ends exactly on the surface, or passes the border of the map
//! exactly on it, hits it there. The number of steps is bounded by that of the patches and triangles that the line meets.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing))]

use glam::{DVec2, DVec3};

use super::drawn::{DrawnSurface, DrawnTriangle};
use super::errors::TileErrors;
use super::hierarchy::{Hierarchy, PatchId};
use super::line::{Crossing, Line, Seen, between};
use super::morph::{MorphErrors, PatchWeights};
use super::parts::{Part, Side};
use super::pick::LatticeRay;
use super::pyramid::MinMaxPyramid;
use super::selection::ActivePatch;
use super::sign::Sign;

/// A place where a ray meets the drawn surface, in lattice coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DrawnHit {
    /// Ray parameter.
    pub t: f64,
    /// Column coordinate, row coordinate and raw height of the point.
    pub point: DVec3,
    /// Slope ∂w/∂u and ∂w/∂v of the triangle, in raw units per cell; zero for a sliver.
    pub gradient: [f64; 2],
    /// For a sliver in the plane of the map's border: which border.
    pub border: Option<Side>,
    /// The active patch.
    pub patch: ActivePatch,
    /// The triangle, with the tile or strip that it belongs to.
    pub triangle: DrawnTriangle,
    /// Weights of the triangle's corners at the point; each in 0..=1, sum 1.
    pub barycentric: [f64; 3],
    /// Whether the ray goes into the ground here (from above); otherwise it comes out.
    pub entering: bool,
    /// Bound of the vertical distance between the ray at `t` and the triangle, in raw units: rounding alone. With
    /// ε = 2⁻⁵³: 32 ε times the sum of |o_w|, |w|, |d_w| (|t| + (cells + |o|) / |d|) and |g| (|o| + |d t| + cells) for
    /// either axis, where |d| is the larger horizontal component of the direction.
    pub rounding: f64,
}

impl DrawnHit {
    /// No point of the full-resolution surface is vertically further from the drawn one in this part, in raw units,
    /// rounding included; the errors are not asked for where all cells are drawn.
    #[must_use]
    pub fn error<'e>(&self, tree: &Hierarchy, errors: impl FnOnce() -> &'e TileErrors) -> f64 {
        self.rounding + part_error(tree, self.patch, self.triangle.part, errors)
    }

    /// [`DrawnHit::error`] of a selection that morphs, with its weights of the patch.
    #[must_use]
    pub fn error_morphing(&self, tree: &Hierarchy, weights: &PatchWeights, errors: &MorphErrors) -> f64 {
        self.rounding + errors.drawn(tree, self.patch.id, weights)
    }
}

/// Bound of the vertical distance of one part of a patch from the full-resolution surface, in raw units: the error of its
/// side at its resolution, for a strip the larger of its two sides'.
fn part_error<'e>(tree: &Hierarchy, patch: ActivePatch, part: Part, errors: impl FnOnce() -> &'e TileErrors) -> f64 {
    let sides = match part {
        Part::Tile(side, r) => [(side, r); 2],
        Part::Strip(side, a, b) => [(side, a), (side.next(), b)],
    };
    let resolutions = tree.resolutions();
    let [[u0, v0], [u1, v1]] = tree.extent(patch.id);
    let size = tree.size(patch.id.level);
    let whole = u1 - u0 == size && v1 - v0 == size;
    // Every cell is drawn as it is; but for slivers at the border of the map.
    if whole && tree.step(patch.id.level) == 1 && sides.iter().all(|&(_, r)| resolutions.get(r) == resolutions.max()) {
        return 0.0;
    }
    let errors = errors();
    sides.into_iter().map(|(side, r)| errors.get(tree, patch.id, side, r)).fold(0.0, f64::max)
}

/// What a pick on the drawn surface needs.
///
/// # Example
///
/// ```
/// use glam::DVec3;
/// use seamount::terrain::pick::LatticeRay;
/// use seamount::terrain::{
///     DrawnPick, DrawnSurface, Full, Hierarchy, MinMaxPyramid, Part, Parts, Resolutions, Selection, generate,
/// };
///
/// let field = generate(65, 1)?;
/// let resolutions = Resolutions::new(8, 2)?;
/// let (tree, parts) = (Hierarchy::new(field.cells(), resolutions), Parts::new(resolutions));
/// let selection = Selection::of(&tree, &Full);
/// let drawn = DrawnSurface { field: &field, tree: &tree, parts: &parts, selection: &selection };
/// let pick = DrawnPick { drawn, pyramid: &MinMaxPyramid::new(&field) };
/// let down = LatticeRay {
///     origin: DVec3::new(20.25, 31.5, 1e6),
///     direction: DVec3::NEG_Z,
///     near: 0.0,
///     far: f64::INFINITY,
/// };
/// let mut found = None;
/// pick.intersect(&down, |hit| {
///     found = Some(hit);
///     false
/// });
/// let hit = found.expect("the ray comes down on the map");
/// // Full detail is the map itself.
/// assert_eq!(Some(hit.point.z), field.surface(20.25, 31.5));
/// assert!(matches!(hit.triangle.part, Part::Tile(..) | Part::Strip(..)));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct DrawnPick<'t> {
    /// The triangles.
    pub drawn: DrawnSurface<'t>,
    /// The min/max tree of the map.
    pub pyramid: &'t MinMaxPyramid,
}

impl DrawnPick<'_> {
    /// Calls `found` with the crossings of the ray with the surface, in order of t, each once, until it returns `false`.
    ///
    /// A ray whose origin or direction is not finite, whose direction is zero or whose range is empty crosses nothing.
    pub fn intersect(&self, ray: &LatticeRay, found: impl FnMut(DrawnHit) -> bool) {
        match Line::seen(ray, self.drawn.tree.cells()) {
            None => {}
            Some(Seen::Point(line)) => self.vertical(&line, found),
            Some(Seen::Line(line)) => {
                let mut walk = Walk { pick: *self, line, sign: Sign::unknown(), last: None, pieces: Vec::new(), found };
                if walk.grid(0, [0, 0], self.drawn.tree.grid(0)) {
                    walk.end();
                }
            }
        }
    }

    /// A vertical ray meets one triangle; on an edge or corner any of those there.
    fn vertical(&self, line: &Line, mut found: impl FnMut(DrawnHit) -> bool) {
        let at = [line.origin.x, line.origin.y];
        let Some((patch, triangle, weights)) = self.triangles_at(at).next() else { return };
        let [a, b, c] = triangle.heights;
        // From the first corner: exact where the weights are.
        let height = a + weights[1] * (b - a) + weights[2] * (c - a);
        let t = (height - line.origin.z) / line.direction.z;
        if t >= line.near && t <= line.far {
            let gradient = gradient(&triangle);
            found(DrawnHit {
                t: t * line.unit,
                point: DVec3::new(at[0], at[1], height),
                gradient,
                border: None,
                patch,
                triangle,
                barycentric: weights,
                entering: line.direction.z < 0.0,
                rounding: line.rounding(0.0, height, gradient, self.drawn.tree.cells()),
            });
        }
    }

    /// The triangles that a place on the map lies in or on the border of, with the weights of their corners.
    fn triangles_at(&self, at: [f64; 2]) -> impl Iterator<Item = (ActivePatch, DrawnTriangle, [f64; 3])> {
        let DrawnSurface { tree, selection, .. } = self.drawn;
        let drawn = self.drawn;
        let [cu, cv] = tree.cells();
        let leaf = tree.leaf_at((at[0] as u32).min(cu - 1), (at[1] as u32).min(cv - 1));
        // The place may be on the border of patches, where the triangle of one may be left out.
        let (us, vs) = (on_line(at[0], tree, leaf.column), on_line(at[1], tree, leaf.row));
        let patches = vs.into_iter().flat_map(move |row| us.into_iter().map(move |column| [column, row]));
        let patches = patches.filter_map(move |[column, row]| {
            let mut id = PatchId { level: tree.depth(), column, row };
            loop {
                match (selection.active(tree, id), tree.parent(id)) {
                    (Some(patch), _) => break Some(patch),
                    (None, Some(parent)) => id = parent,
                    (None, None) => break None,
                }
            }
        });
        let contains = move |[[u0, v0], [u1, v1]]: [[u32; 2]; 2]| {
            at[0] >= u0.into() && at[0] <= u1.into() && at[1] >= v0.into() && at[1] <= v1.into()
        };
        patches.flat_map(move |patch| {
            drawn
                .triangles_where(patch, contains)
                .filter_map(move |triangle| Some((patch, triangle, inside(&triangle, at)?)))
        })
    }

    /// A drawn triangle that two points of the lattice lie in or on the border of, and so all between them.
    fn triangle_with(&self, [a, b]: [[u32; 2]; 2]) -> Option<(ActivePatch, DrawnTriangle)> {
        self.triangles_at(a.map(f64::from))
            .find(|(_, triangle, _)| inside(triangle, b.map(f64::from)).is_some())
            .map(|(patch, triangle, _)| (patch, triangle))
    }
}

/// The leaves of one axis that contain a coordinate: two on a line between them.
fn on_line(x: f64, tree: &Hierarchy, leaf: u32) -> [u32; 2] {
    let before = leaf.saturating_sub(1);
    [leaf, if x == f64::from(leaf * tree.size(tree.depth())) { before } else { leaf }]
}

fn cross([au, av]: [f64; 2], [bu, bv]: [f64; 2], [cu, cv]: [f64; 2]) -> f64 {
    (bu - au) * (cv - av) - (bv - av) * (cu - au)
}

/// The weights of a triangle's corners at a point of it, borders included; `None` outside and without area.
fn inside(triangle: &DrawnTriangle, p: [f64; 2]) -> Option<[f64; 3]> {
    let [a, b, c] = triangle.corners.map(|corner| corner.map(f64::from));
    let area = cross(a, b, c);
    // The value of an edge is a difference of products with the coordinates of one lattice point less p, the same for both
    // neighbours but for its sign: on one side of the edge at least it is not negative.
    let edge = |a: [f64; 2], b: [f64; 2]| if a <= b { cross(p, a, b) } else { -cross(p, b, a) };
    let weights = [edge(b, c), edge(c, a), edge(a, b)].map(|w| w * area.signum());
    (area != 0.0 && weights.iter().all(|&w| w >= 0.0)).then(|| {
        let sum: f64 = weights.iter().sum();
        weights.map(|w| w / sum)
    })
}

/// Weights of a wall's corners at a point of it; corners and point by a coordinate along the wall and a height. Between the longest edge
/// and the two others above or below it: a wall may have next to no area.
fn on_wall([a, b, c]: [DVec2; 3], at: DVec2) -> [f64; 3] {
    let mut corners = [(a, DVec3::X), (b, DVec3::Y), (c, DVec3::Z)];
    corners.sort_by(|(p, _), (q, _)| p.x.total_cmp(&q.x));
    let [first, middle, last] = corners;
    let part = |from: f64, to: f64, at: f64| if from == to { 0.0 } else { ((at - from) / (to - from)).clamp(0.0, 1.0) };
    let mix = |p: (DVec2, DVec3), q: (DVec2, DVec3), s: f64| (p.0.lerp(q.0, s), p.1.lerp(q.1, s));
    let along = |p: (DVec2, DVec3), q: (DVec2, DVec3)| mix(p, q, part(p.0.x, q.0.x, at.x));
    let long = along(first, last);
    let short = if at.x < middle.0.x { along(first, middle) } else { along(middle, last) };
    mix(long, short, part(long.0.y, short.0.y, at.y)).1.to_array()
}

/// Slope of a triangle in raw units per cell; zero if it has no area.
fn gradient(triangle: &DrawnTriangle) -> [f64; 2] {
    let [a, b, c] = triangle.corners.map(|corner| corner.map(f64::from));
    let area = cross(a, b, c);
    if area == 0.0 {
        return [0.0, 0.0];
    }
    let [ha, hb, hc] = triangle.heights;
    let (e, f) = ([b[0] - a[0], b[1] - a[1], hb - ha], [c[0] - a[0], c[1] - a[1], hc - ha]);
    [(e[2] * f[1] - f[2] * e[1]) / area, (f[2] * e[0] - e[2] * f[0]) / area]
}

/// Whether a triangle has no area seen from above.
fn is_sliver(triangle: &DrawnTriangle) -> bool {
    let [a, b, c] = triangle.corners.map(|corner| corner.map(f64::from));
    cross(a, b, c) == 0.0
}

/// The border of the map in whose plane a triangle without area lies.
fn border(triangle: &DrawnTriangle, [cu, cv]: [u32; 2]) -> Option<Side> {
    let all = |axis: usize, at: u32| triangle.corners.iter().all(|corner| corner.get(axis) == Some(&at));
    [(Side::East, 0, cu), (Side::South, 1, cv), (Side::West, 0, 0), (Side::North, 1, 0)]
        .into_iter()
        .find(|&(_, axis, at)| all(axis, at))
        .map(|(side, ..)| side)
}

/// A range that holds all heights in a box of the lattice: that of the smallest block of the tree around it.
fn range(pyramid: &MinMaxPyramid, [[u0, v0], [u1, v1]]: [[u32; 2]; 2]) -> [f64; 2] {
    // Cells, not lines: the line at its end belongs to the block as well.
    let differing = (u0 ^ u1.saturating_sub(1).max(u0)) | (v0 ^ v1.saturating_sub(1).max(v0));
    let bits = (u32::BITS - differing.leading_zeros()).max(MinMaxPyramid::BASE.trailing_zeros());
    pyramid.range(1 << bits, u0 >> bits, v0 >> bits)
}

/// The ends of an edge in the order of their coordinates, before they are clamped to the map.
type Edge = [[u32; 2]; 2];

/// The way of the ray over a triangle.
#[derive(Debug, Clone, Copy)]
struct Piece {
    enter: Crossing,
    leave: Crossing,
    entered: Edge,
    left: Edge,
    patch: ActivePatch,
    triangle: DrawnTriangle,
}

/// A place on the surface.
#[derive(Debug, Clone, Copy)]
struct Contact {
    t: f64,
    patch: ActivePatch,
    triangle: DrawnTriangle,
    /// Whether it is one of the triangles that are drawn, or lies on the rim of one.
    drawn: bool,
}

struct Walk<'t, F> {
    pick: DrawnPick<'t>,
    line: Line,
    sign: Sign<Contact>,
    /// Where the last piece ended: the edge, the parameter, and the height above the surface there.
    last: Option<(Edge, f64, f64)>,
    /// Those of one patch.
    pieces: Vec<Piece>,
    found: F,
}

impl<F: FnMut(DrawnHit) -> bool> Walk<'_, F> {
    /// Visits the patches `first..last` of a level that the line meets, in order. `false` when nothing more is wanted.
    fn grid(&mut self, level: u8, first: [u32; 2], last: [u32; 2]) -> bool {
        let d = self.line.direction;
        // The line climbs or descends in both indices: this order is that along the line.
        let order = |k: u32, first: u32, last: u32, d: f64| if d >= 0.0 { first + k } else { last - 1 - k };
        for i in 0..last[0] - first[0] {
            for j in 0..last[1] - first[1] {
                let column = order(i, first[0], last[0], d.x);
                let row = order(j, first[1], last[1], d.y);
                if !self.patch(PatchId { level, column, row }) {
                    return false;
                }
            }
        }
        true
    }

    fn patch(&mut self, id: PatchId) -> bool {
        let DrawnPick { drawn: DrawnSurface { tree, selection, .. }, pyramid } = self.pick;
        let extent = tree.extent(id);
        if !self.line.meets(extent) {
            return true;
        }
        let [enter, leave] = self.line.within(extent);
        // Beyond the range by more than rounding may move a parameter.
        if enter - leave > 8.0 * f64::EPSILON * (enter.abs() + leave.abs()) {
            return true;
        }
        if self.line.clear_of(pyramid.range(tree.size(id.level), id.column, id.row), [enter, leave]) != 0 {
            return true;
        }
        if selection.is_split(tree, id) {
            let r = tree.resolutions().branching();
            let [columns, rows] = tree.grid(id.level + 1);
            let first = [id.column * r, id.row * r];
            return self.grid(id.level + 1, first, [(first[0] + r).min(columns), (first[1] + r).min(rows)]);
        }
        match selection.active(tree, id) {
            Some(patch) => self.triangles(patch),
            None => true,
        }
    }

    fn triangles(&mut self, patch: ActivePatch) -> bool {
        let line = self.line;
        let drawn = self.pick.drawn;
        let pyramid = self.pick.pyramid;
        // Heights that blend are means of samples up to a step away.
        let around = if drawn.selection.morphs() { drawn.tree.step(patch.id.level) } else { 0 };
        let cells = drawn.tree.cells();
        let may_meet = |group: [[u32; 2]; 2]| {
            let [[u0, v0], [u1, v1]] = group;
            let low = [u0.saturating_sub(around), v0.saturating_sub(around)];
            let samples = [low, [(u1 + around).min(cells[0]), (v1 + around).min(cells[1])]];
            line.meets(group) && line.clear_of(range(pyramid, samples), line.within(group)) == 0
        };
        let mut clear = true;
        for (triangle, [i, j, k]) in drawn.with_lids_where(patch, may_meet) {
            let [p, q, r] = triangle.corners.map(|corner| line.is_positive(corner));
            if p == q && q == r {
                continue;
            }
            let [a, b, c] = triangle.corners;
            let [ha, hb, hc] = triangle.heights;
            // One edge goes from the negative to the positive side, one back. Seen from above the triangle turns to the left,
            // and (u, v) is seen from below: the ray comes in where an edge goes to the positive side.
            let (mut entered, mut left) = (None, None);
            let edges =
                [(p, q, (a, ha), (b, hb), [i, j]), (q, r, (b, hb), (c, hc), [j, k]), (r, p, (c, hc), (a, ha), [k, i])];
            for (from, to, start, end, [i, j]) in edges {
                match (from, to) {
                    (false, true) => entered = Some((line.crossing(start, end), [i.min(j), i.max(j)])),
                    (true, false) => left = Some((line.crossing(start, end), [i.min(j), i.max(j)])),
                    _ => {}
                }
            }
            let (Some((enter, entered)), Some((leave, left))) = (entered, left) else { continue };
            self.pieces.push(Piece { enter, leave, entered, left, patch, triangle });
            let beyond = |end: Crossing| end.above.abs() > end.rounding;
            clear &= beyond(enter) && beyond(leave) && (enter.above > 0.0) == (leave.above > 0.0);
        }
        // In most patches all pieces lie on one side, beyond doubt.
        if clear {
            self.pieces.clear();
            return true;
        }
        // One after the other from edge to edge; parameters say where a chain begins, but not more: around a corner, and in slivers,
        // those of several edges are the same but for rounding.
        self.pieces.sort_unstable_by(|a, b| a.enter.t.total_cmp(&b.enter.t));
        while !self.pieces.is_empty() {
            let pieces = self.pieces.as_slice();
            let begins = |piece: &Piece| pieces.iter().all(|other| other.left != piece.entered);
            let next = pieces
                .iter()
                .position(|piece| self.goes_on(piece))
                .or_else(|| pieces.iter().position(begins))
                .unwrap_or(0);
            let piece = self.pieces.remove(next);
            if !self.follow(&piece) {
                return false;
            }
        }
        true
    }

    /// Whether a piece is the next of the chain.
    fn goes_on(&self, piece: &Piece) -> bool {
        self.last.is_some_and(|(edge, ..)| edge == piece.entered)
    }

    /// Follows the ray over a triangle, within its range.
    fn follow(&mut self, piece: &Piece) -> bool {
        let &Piece { enter, leave, .. } = piece;
        let (near, far) = (self.line.near, self.line.far);
        // Parameter, height above the triangle, and the edge; none where the ray starts or ends within the triangle.
        let on_edge = |edge: Crossing| (edge.t, edge.above, Some(edge.edge));
        let within = |t: f64| {
            let s = (t - enter.t) / (leave.t - enter.t);
            (t, self.line.height(t) - between(enter.height, leave.height, s), None)
        };
        let start = if enter.t < near && near <= leave.t { within(near) } else { on_edge(enter) };
        let end = if leave.t > far && far >= enter.t { within(far) } else { on_edge(leave) };
        let goes_on = self.goes_on(piece);
        if enter.edge == leave.edge || leave.t < near || enter.t > far {
            // Clamped to the border it is an edge itself, which belongs to its neighbours; or it is out of range, around a corner by
            // rounding alone.
            if goes_on {
                self.last = Some((piece.left, end.0, end.1));
            }
            return true;
        }
        // Half the bound that hits carry, which leaves room for the place of the hit itself. Either triangle at an edge is as uncertain
        // as it is steep.
        let (line, cells) = (self.line, self.pick.drawn.tree.cells());
        let (steepness, height) = (gradient(&piece.triangle), enter.height.abs().max(leave.height.abs()));
        let doubt = |t: f64| 0.5 * line.rounding(t, height, steepness, cells);
        if !goes_on {
            // What lies on one side beyond doubt says nothing by itself: it may have its place before what has been seen, around
            // a corner.
            let [beyond, beyond_too] = [start, end].map(|(t, f, _)| f.abs() > doubt(t));
            if beyond && beyond_too && (start.1 > 0.0) == (end.1 > 0.0) {
                return true;
            }
            if !self.end() {
                return false;
            }
            // 0 counts as above; but where the ray starts it is on the surface.
            let (t, f, ..) = start;
            self.sign.now = if f < 0.0 {
                -1
            } else if f == 0.0 && t == near {
                0
            } else {
                1
            };
        }
        let mut before: Option<(f64, f64)> = None;
        for (t, f, edge) in [start, end] {
            if f == 0.0 || self.sign.turns(f) && f.abs() <= doubt(t) {
                if self.sign.zero_since.is_none_or(|first| !first.drawn) {
                    self.sign.zero_since = Some(self.contact(piece, t, edge));
                }
            } else if let Some(turn) = self.sign.pass(f) {
                let contact = turn.zero_since.unwrap_or_else(|| match before {
                    // Rounding may turn the order of two edges that meet in a corner.
                    Some((t0, f0)) => {
                        self.contact(piece, (t0 + (t - t0) * (f0 / (f0 - f))).clamp(t.min(t0), t.max(t0)), None)
                    }
                    None => self.contact(piece, t, edge),
                });
                if !self.report(&contact, turn.entering) {
                    return false;
                }
            }
            before = Some((t, f));
        }
        self.last = Some((piece.left, end.0, end.1));
        true
    }

    /// Comes to the end of a chain of pieces: that of the ray, or a place beyond which nothing is near it. `false` when nothing more is
    /// wanted.
    fn end(&mut self) -> bool {
        let Some((_, t, f)) = self.last.take() else { return true };
        let hit = if t >= self.line.far || self.sign.now == 0 {
            self.sign.end()
        } else {
            // 0 counts as above.
            let turn = self.sign.pass(if f < 0.0 { f } else { 1.0 });
            turn.and_then(|turn| Some((turn.zero_since?, turn.entering)))
        };
        hit.is_none_or(|(contact, entering)| self.report(&contact, entering))
    }

    /// A place on a triangle, on an edge if it is there: if that is a lid, of the drawn triangle on whose rim it lies.
    fn contact(&self, piece: &Piece, t: f64, edge: Option<[[u32; 2]; 2]>) -> Contact {
        let this = (piece.patch, piece.triangle);
        let drawn = if self.pick.drawn.is_lid(&piece.triangle) { self.on_rim(piece, edge) } else { Some(this) };
        let (patch, triangle) = drawn.unwrap_or(this);
        Contact { t, patch, triangle, drawn: drawn.is_some() }
    }

    /// The drawn triangle that a place on a lid belongs to: if the ray runs along the edge between the two, or is on it there.
    #[cold]
    fn on_rim(&self, piece: &Piece, edge: Option<[[u32; 2]; 2]>) -> Option<(ActivePatch, DrawnTriangle)> {
        if is_sliver(&piece.triangle) {
            return None;
        }
        // Where the ray crosses an edge: in one of its ends, or between them.
        let place = |[a, b]: [[u32; 2]; 2]| match (self.line.is_on(a), self.line.is_on(b)) {
            (true, _) => [a, a],
            (false, true) => [b, b],
            (false, false) => [a, b],
        };
        let ([from, from2], [to, to2]) = (place(piece.enter.edge), place(piece.leave.edge));
        let along = (from == from2 && to == to2 && from != to).then_some([from, to]);
        along.into_iter().chain(edge.map(place)).find_map(|place| self.pick.triangle_with(place))
    }

    fn report(&mut self, contact: &Contact, entering: bool) -> bool {
        // A lid over a hole is crossed unseen.
        if !contact.drawn {
            return true;
        }
        let hit = self.hit(contact, entering);
        (self.found)(hit)
    }

    fn hit(&self, contact: &Contact, entering: bool) -> DrawnHit {
        let &Contact { t, patch, triangle, .. } = contact;
        let cells = self.pick.drawn.tree.cells();
        let p = self.line.at(t);
        let gradient = gradient(&triangle);
        let corners = triangle.corners.map(|corner| corner.map(f64::from));
        let [cu, cv] = cells.map(f64::from);
        let p = DVec3::new(p.x.clamp(0.0, cu), p.y.clamp(0.0, cv), p.z);
        let edge_on = is_sliver(&triangle).then(|| border(&triangle, cells)).flatten();
        let [a, b, c] = corners;
        let [ha, hb, hc] = triangle.heights;
        let (barycentric, height) = match edge_on {
            // Seen from the side, along the border and upwards.
            Some(side) => {
                let along_v = matches!(side, Side::East | Side::West);
                let flat = |[u, v]: [f64; 2], w: f64| DVec2::new(if along_v { v } else { u }, w);
                (on_wall([flat(a, ha), flat(b, hb), flat(c, hc)], flat([p.x, p.y], p.z)), p.z)
            }
            None => {
                let (at, area) = ([p.x, p.y], cross(a, b, c));
                let weights = [cross(at, b, c), cross(at, c, a), cross(at, a, b)].map(|w| (w / area).clamp(0.0, 1.0));
                let sum: f64 = weights.iter().sum();
                let weights = if area != 0.0 && sum > 0.0 { weights.map(|w| w / sum) } else { [1.0, 0.0, 0.0] };
                (weights, ha + weights[1] * (hb - ha) + weights[2] * (hc - ha))
            }
        };
        DrawnHit {
            t: t * self.line.unit,
            point: DVec3::new(p.x, p.y, height),
            gradient,
            border: edge_on,
            patch,
            triangle,
            barycentric,
            entering,
            rounding: self.line.rounding(t, height, gradient, cells),
        }
    }
}
