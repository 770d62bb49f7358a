//! The fans of a selection, compact: what a coarse pick walks through.
//!
//! A tree of blocks of four by four squares, whatever the patches' own branching: a square is a patch, a part of a larger one, or
//! a block of smaller ones. With each goes the range of heights of the fans below, which is much tighter than that of the ground:
//! most patches are passed without a look at their fan. It is there in the order of each [`View`], so that the way a ray takes is no
//! question for the walk.
//!
//! # All squares at a time
//!
//! A ray does not go from square to square. It asks a block once which of its squares it passes, and where it is not clear of what is
//! below ([`Course`]): all sixteen, four at a time, without a branch. What costs a walk is the branches that can not be foreseen, and
//! going on to the next square is two of them.
//!
//! # Why nothing is missed
//!
//! Only the squares that the answer names are looked at, so it may name too many but never one too few. It is worked out in f32, and
//! to be safe squares are widened. Let S be the side of the block at the top, in cells, e = 2⁻²⁴ (half an ulp of f32) and ε = 2⁻⁵³.
//!
//! * *When* the ray enters a square counts from where it starts, in steps that take it one cell along its longer axis. In cells of
//!   either axis such a number is at most S, and off by at most e S for the place where it starts, e S for the step, on each of at most
//!   13 levels e S for a sum (and e S for the products of all), and 4 e S for the four lines of a block and the way to leave a
//!   square: less than 2⁵ e S = 2⁻¹⁹ S. The walk's own parameters, of which the fans' are made, are f64: off by 3 ε of the
//!   distance to the origin o for a line and 4 ε for the start, less than 2⁻⁵⁰ (|o| + S). Each square is widened by 2⁻¹⁸ S + 2⁻⁴⁹ |o|
//!   on all sides.
//! * A ray that would take more than 2⁶⁰ steps to cross a cell is taken to need 2⁶⁰. It is under way for less than 2²⁷: what is
//!   further from it than 2⁻³³ cells it does not reach, and squares are widened by more.
//! * *When it comes down* from a height h at the start to a bound b, or rises beyond it, is (b - h) r: with r, what it takes to change
//!   by a unit of height. Both are off by e of themselves, so is the product: together by less than 3 e |b - h| in height, and h is off
//!   by e |h|. A bound is that of a fan, at most H: all this is less than 8 e times the larger of |h| and H. The walk's own heights are
//!   off by 2 ε (|o| + |d t|) and what 3 ε |t| make of d: less than 2⁻⁵⁰ (|o| + |d t|). The ray is lowered by 2⁻²¹ max(|h|, H) +
//!   2⁻⁴⁹ (|o| + |d t|) for the longest t.
//! * A ray that would take more than 2¹²⁸ steps for a unit of height is taken to need as many. One that goes down is below its true
//!   height, as it may be. One that rises is above it, but by less than 2⁻¹⁰⁰ while it is under way: it is lowered by as much. That is
//!   also more than what rounding makes of a height that is too small for all its digits; a time that is too small for them is off by
//!   less than squares are widened.
//! * Bounds are heights of a map, at most 10³⁸. Of a ray that is further up than 2¹²⁷ where it starts, or changes by more than 2¹²⁶ in
//!   a step, nothing is clear. So b - h is a number, r is one with all its digits, and (b - h) r is one or infinite with the right sign.
//!
//! A ray from a million map's widths away still sees the squares it passes and few others. From further than 2⁴⁹ S it sees them all,
//! but f64 does not know any more where it passes.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing))]

use glam::Vec4;

use super::axis::Axis;
use super::height_field::HeightField;
use super::hierarchy::{Hierarchy, PatchId};
use super::pick::{Fan, LatticeRay};
use super::pyramid::{larger, smaller};
use super::selection::Selection;

/// Squares along a side of a block: as many as a vector has places.
const SIDE: usize = 4;
/// A block has 2^BITS squares along a side.
const BITS: u32 = SIDE.trailing_zeros();
/// More levels than any tree has: a map has at most 2²⁴ cells along a side.
pub(super) const LEVELS: usize = 24 / BITS as usize + 1;

/// The fans of a selection: what a coarse pick walks through. Made once for a selection, shared by all its picks.
///
/// Heights are samples, which f32 holds exactly. 32 bytes for each fan, and 512 (where not all squares are fans 640) for a block.
#[derive(Debug)]
pub struct FanTree {
    top: Block,
    /// As each of the [`View`]s has them, block by block: first of those that are not made of sixteen fans.
    bounds: Vec<Bounds>,
    /// What those are made of.
    squares: Vec<Square>,
    /// The fans among that.
    single: Vec<SelectedFan>,
    /// The fans of the other blocks, which most are. There is no number to fetch first.
    fans: Vec<SelectedFan>,
    /// The squares of the block at the top have 2^shift cells a side.
    shift: u32,
    /// Smallest and largest height of all fans.
    pub(super) range: [f64; 2],
    /// More squares than a walk along a straight line can come to ([`Hierarchy::step_limit`]).
    pub(super) step_limit: u32,
}

/// The largest heights of the sixteen squares of a block as one of the [`View`]s has them, in the order in which rays pass them. Squares
/// beyond the map are empty: no ray comes near.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
struct Bounds([[f32; SIDE]; SIDE]);

/// Smallest and largest height of each square of a block, row by row.
type Ranges = [[f32; 2]; SIDE * SIDE];

/// Those of a block of nothing.
const EMPTY: Ranges = [[f32::INFINITY, f32::NEG_INFINITY]; SIDE * SIDE];

impl Bounds {
    fn new(ranges: &Ranges, view: View) -> Self {
        let mut bounds = [[f32::NEG_INFINITY; SIDE]; SIDE];
        for (square, &[low, high]) in ranges.iter().enumerate() {
            if let Some(bound) = bounds.as_flattened_mut().get_mut(view.number(square)) {
                *bound = if view.is_upside_down() { -low } else { high };
            }
        }
        Self(bounds)
    }
}

/// How a ray sees blocks: a bit for going west, one for going north, and one for seeing the surface from below. Then all is upside
/// down: the largest heights are the smallest, negated.
#[derive(Debug, Clone, Copy)]
struct View(usize);

impl View {
    /// So many there are.
    const ALL: usize = 8;

    #[inline(always)]
    fn new(east: bool, south: bool, above: bool) -> Self {
        Self(usize::from(!east) | usize::from(!south) << 1 | usize::from(!above) << 2)
    }

    fn is_upside_down(self) -> bool {
        self.0 & 0b100 != 0
    }

    /// The number of a square, row by row, when they are counted in the order in which rays pass them; and the other way round.
    #[inline(always)]
    fn number(self, square: usize) -> usize {
        let (west, north) = (self.0 & 1, self.0 >> 1 & 1);
        square ^ (west * 0b0011) ^ (north * 0b1100)
    }
}

/// The number of a block.
pub(super) type Block = u32;

/// What a square of a block is.
#[derive(Debug, Clone, Copy)]
enum Square {
    Block(Block),
    /// The number of one of the fans of a tree that are single.
    Fan(u32),
    BeyondMap,
}

/// The same, for a walk.
pub(super) enum Below<'t> {
    Block(Block),
    Fan(&'t SelectedFan),
    Nothing,
}

/// The fan of an active patch.
#[derive(Debug, Clone, Copy)]
#[repr(align(32))]
pub(super) struct SelectedFan {
    /// Corners north-west, north-east, south-east, south-west, and the centre.
    pub(super) heights: [f32; 5],
    /// North-west corner.
    pub(super) corner: [u32; 2],
    /// The patch has 2^shift cells a side.
    shift: u8,
    level: u8,
}

impl SelectedFan {
    /// Fills up a block at the border of the map: far beyond.
    const NONE: Self = Self { heights: [0.0; 5], corner: [u32::MAX; 2], shift: 0, level: 0 };

    /// Smallest and largest height.
    #[inline(always)]
    pub(super) fn range(&self) -> [f32; 2] {
        let [first, rest @ ..] = self.heights;
        [rest.into_iter().fold(first, smaller), rest.into_iter().fold(first, larger)]
    }

    /// The patch has 2^shift cells a side.
    #[inline(always)]
    pub(super) fn shift(&self) -> u32 {
        self.shift.into()
    }

    #[inline(always)]
    pub(super) fn size(&self) -> u32 {
        1 << self.shift
    }

    /// The north-west corner of that part of the patch, of 2^shift cells a side, which is the square with a number in a block.
    #[inline(always)]
    pub(super) fn part(&self, shift: u32, number: usize) -> [u32; 2] {
        let [u, v] = self.corner;
        let parts = self.size() >> shift;
        let [column, row] = [number % SIDE, number / SIDE].map(|i| i as u32 & (parts - 1));
        [u + (column << shift), v + (row << shift)]
    }

    #[inline(always)]
    pub(super) fn patch(&self) -> PatchId {
        let [column, row] = self.corner.map(|i| i >> self.shift);
        PatchId { level: self.level, column, row }
    }
}

impl FanTree {
    /// The fans of the active patches.
    #[must_use]
    pub fn new(field: &HeightField, tree: &Hierarchy, selection: &Selection) -> Self {
        let [columns, rows] = tree.cells();
        let mut shift = tree.size(tree.depth()).trailing_zeros();
        while columns.max(rows) > (SIDE as u32) << shift {
            shift += BITS;
        }
        let mut maker = Maker {
            field,
            tree,
            selection,
            whole: Vec::new(),
            fans: Vec::new(),
            mixed: Vec::new(),
            single: Vec::new(),
        };
        let (top, range) = maker.add([0, 0], shift, None);
        let Maker { whole, fans, mixed, single, .. } = maker;
        // Those of fans last.
        let number = |block| if block & MIXED == 0 { block + mixed.len() as u32 } else { block & !MIXED };
        let square = |square| if let Square::Block(block) = square { Square::Block(number(block)) } else { square };
        let ranges = mixed.iter().map(|(ranges, _)| ranges).chain(&whole);
        Self {
            top: number(top),
            bounds: ranges.flat_map(|ranges| (0..View::ALL).map(|view| Bounds::new(ranges, View(view)))).collect(),
            squares: mixed.iter().flat_map(|(_, squares)| squares.map(square)).collect(),
            fans,
            single,
            shift,
            range: range.map(f64::from),
            step_limit: tree.step_limit(),
        }
    }

    /// Bytes that the blocks and fans occupy.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let fans = size_of_val(self.fans.as_slice()) + size_of_val(self.single.as_slice());
        fans + size_of_val(self.bounds.as_slice()) + size_of_val(self.squares.as_slice())
    }

    /// What a square of a block is.
    #[inline(always)]
    pub(super) fn below(&self, block: Block, square: usize) -> Below<'_> {
        let i = block as usize * (SIDE * SIDE) + square;
        match self.squares.get(i) {
            Some(&Square::Block(block)) => Below::Block(block),
            Some(&Square::Fan(i)) => self.single.get(i as usize).map_or(Below::Nothing, Below::Fan),
            Some(Square::BeyondMap) => Below::Nothing,
            None => self.fans.get(i.wrapping_sub(self.squares.len())).map_or(Below::Nothing, Below::Fan),
        }
    }

    /// The fan of the patch in which a cell lies.
    pub(super) fn fan_at(&self, cell: [u32; 2]) -> Option<&SelectedFan> {
        let (mut block, mut shift) = (self.top, self.shift);
        loop {
            let [column, row] = cell.map(|i| (i >> shift) as usize % SIDE);
            match self.below(block, row * SIDE + column) {
                Below::Block(below) => (block, shift) = (below, shift.checked_sub(BITS)?),
                Below::Fan(fan) => return Some(fan),
                Below::Nothing => return None,
            }
        }
    }
}

/// Makes a [`FanTree`].
struct Maker<'t> {
    field: &'t HeightField,
    tree: &'t Hierarchy,
    selection: &'t Selection,
    whole: Vec<Ranges>,
    fans: Vec<SelectedFan>,
    mixed: Vec<(Ranges, [Square; SIDE * SIDE])>,
    single: Vec<SelectedFan>,
}

/// Marks the number of a mixed block while they are made: that among its like, as it is for those of fans.
const MIXED: Block = 1 << 31;

impl Maker<'_> {
    /// Adds the block of squares with 2^shift cells a side whose north-west square has this column and row, and all below. It lies
    /// within a split patch, or over the roots. Returns its number and the range of its fans.
    fn add(&mut self, [west, north]: [u32; 2], shift: u32, around: Option<PatchId>) -> (Block, [f32; 2]) {
        let [columns, rows] = self.tree.cells().map(|cells| cells.div_ceil(1 << shift));
        let (columns, rows) = (west..(west + SIDE as u32).min(columns), north..(north + SIDE as u32).min(rows));
        let squares = rows.flat_map(|row| columns.clone().map(move |column| [column, row]));
        let over: Vec<_> = squares.map(|square| (square, self.patch_over(square, shift, around))).collect();
        let number = |[column, row]: [u32; 2]| (row - north) as usize * SIDE + (column - west) as usize;
        let mut ranges = EMPTY;
        let made = if over.iter().all(|(_, (_, active))| *active) {
            let mut fans = [SelectedFan::NONE; SIDE * SIDE];
            for &(square, (patch, _)) in &over {
                let i = number(square);
                if let (Some(patch), Some(fan), Some(range)) = (patch, fans.get_mut(i), ranges.get_mut(i)) {
                    *fan = self.fan(patch);
                    *range = fan.range();
                }
            }
            self.fans.extend(fans);
            self.whole.push(ranges);
            self.whole.len() as u32 - 1
        } else {
            // Before those below it: the upper ones are near each other.
            let place = self.mixed.len();
            let mut squares = [Square::BeyondMap; SIDE * SIDE];
            self.mixed.push((ranges, squares));
            for &(square, (patch, active)) in &over {
                let (made, range) = match patch {
                    Some(patch) if active => {
                        let fan = self.fan(patch);
                        self.single.push(fan);
                        (Square::Fan(self.single.len() as u32 - 1), fan.range())
                    }
                    _ => {
                        let (block, range) = self.add(square.map(|i| i << BITS), shift - BITS, patch);
                        (Square::Block(block), range)
                    }
                };
                let i = number(square);
                if let (Some(place), Some(bounds)) = (squares.get_mut(i), ranges.get_mut(i)) {
                    (*place, *bounds) = (made, range);
                }
            }
            if let Some(place) = self.mixed.get_mut(place) {
                *place = (ranges, squares);
            }
            place as u32 | MIXED
        };
        let [first, ..] = ranges;
        let range = ranges.iter().fold(first, |[low, high], &[l, h]| [smaller(low, l), larger(high, h)]);
        (made, range)
    }

    /// The smallest patch that is not smaller than a square in which it lies, and whether it is active; if not it is split. `None`
    /// where even the roots are smaller.
    fn patch_over(&self, square: [u32; 2], shift: u32, around: Option<PatchId>) -> (Option<PatchId>, bool) {
        let mut over = around;
        loop {
            if let Some(patch) = over
                && !self.selection.is_split(self.tree, patch)
            {
                return (over, true);
            }
            let level = over.map_or(0, |patch| patch.level + 1);
            let up = match self.tree.size(level).trailing_zeros().checked_sub(shift) {
                Some(up) if level <= self.tree.depth() => up,
                _ => return (over, false),
            };
            let [column, row] = square.map(|i| i >> up);
            over = Some(PatchId { level, column, row });
        }
    }

    /// The fan of an active patch.
    fn fan(&self, patch: PatchId) -> SelectedFan {
        let heights = Fan::places(self.tree, patch).map(|[u, v]| self.field.raw(u, v) as f32);
        let shift = self.tree.size(patch.level).trailing_zeros() as u8;
        SelectedFan { heights, corner: self.tree.origin(patch), shift, level: patch.level }
    }
}

/// A ray on its way through blocks, from a parameter on.
///
/// It is above the surface. For one that is below, all is upside down. `DOWN`: it is nearest to what is below it where it leaves a
/// square, not where it enters it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Course<const DOWN: bool> {
    u: Along,
    v: Along,
    /// When the ray ends: like all that says "when", in steps of one cell along its longer axis, after it has started.
    end: f32,
    /// Height at the start, lowered by what rounding may do.
    height: f32,
    /// What it takes to rise by a unit of height: negative if the ray goes down.
    rise: f32,
    /// Which of the [`Bounds`] it looks at.
    view: View,
}

/// One axis of a [`Course`].
#[derive(Debug, Clone, Copy)]
struct Along {
    /// What it takes to cross a cell.
    cell: f32,
    /// What it takes to cross that by which a square is wider than it is.
    margin: f32,
}

/// A block on the course.
#[derive(Debug, Clone, Copy)]
pub(super) struct Visit {
    pub(super) block: Block,
    /// The squares that are still to be looked at, a bit for each.
    open: u32,
    /// When the ray enters its columns, and its rows.
    enter: [[f32; SIDE]; 2],
    /// The squares have 2^shift cells a side.
    pub(super) shift: u32,
}

impl Visit {
    /// None.
    const NONE: Self = Self { block: 0, open: 0, enter: [[0.0; SIDE]; 2], shift: 0 };

    /// The patch that fills a square fills others beside it, 2^up a side: they need not be looked at any more.
    #[inline(always)]
    pub(super) fn skip(&mut self, square: usize, up: u32) {
        // More than two a side only at the top, where there is no block above of which it would be a square: there it fills all.
        self.open &= if up == 1 { !(0b0011_0011 << (square & 0b1010)) } else { 0 };
    }

    /// No square is left.
    #[inline(always)]
    pub(super) fn is_done(&self) -> bool {
        self.open == 0
    }

    /// The next square of those to be looked at. They are counted in the order in which the ray passes them.
    #[inline(always)]
    pub(super) fn next(&mut self) -> Option<usize> {
        let next = (self.open != 0).then(|| self.open.trailing_zeros() as usize);
        self.open &= self.open.wrapping_sub(1);
        next
    }
}

impl<const DOWN: bool> Course<DOWN> {
    /// The course of a ray, whose range is clipped to the map, from `start` on; and the block at the top.
    #[inline(always)]
    pub(super) fn new(tree: &FanTree, ray: &LatticeRay, [u, v]: [&Axis; 2], start: f64, above: bool) -> (Self, Visit) {
        // Steps in a unit of the parameter.
        let pace = larger(u.direction.abs(), v.direction.abs());
        let side = f64::from(1u32 << tree.shift) * SIDE as f64;
        let along = |axis: &Axis| {
            let place = axis.from + axis.direction * start;
            let margin = side * 2f64.powi(-18) + axis.from.abs() * 2f64.powi(-49);
            let cell = smaller(axis.inverse.abs() * pace, 2f64.powi(60));
            let before = if axis.forward { place } else { side - place };
            (Along { cell: cell as f32, margin: (2.0 * margin * cell) as f32 }, (-(before + margin) * cell) as f32)
        };
        let ((u_along, enter_u), (v_along, enter_v)) = (along(u), along(v));
        let end = ((ray.far - start) * pace + side * 2f64.powi(-18)) as f32;
        let (o, d) = (ray.origin.z, ray.direction.z);
        let height = o + d * start;
        let largest = larger(height.abs(), larger(-tree.range[0], tree.range[1]));
        let rounding = (o.abs() + d.abs() * larger(start.abs(), ray.far.abs())) * 2f64.powi(-49);
        let margin = largest * 2f64.powi(-21) + 2f64.powi(-100) + rounding;
        let height = if above { height } else { -height };
        let height = (height - margin) as f32;
        let rise = smaller((pace / d.abs()) as f32, f32::MAX);
        // Where differences would be beyond f32 it is never clear.
        let tellable = height.abs() <= 2f32.powi(127) && rise >= f32::MIN_POSITIVE;
        let (height, rise) = if tellable { (height, rise) } else { (f32::MIN, f32::MAX) };
        let rise = if DOWN { -rise } else { rise };
        let course = Self { u: u_along, v: v_along, end, height, rise, view: View::new(u.forward, v.forward, above) };
        (course, course.visit(tree, tree.top, [enter_u, enter_v], tree.shift))
    }

    /// A block that is a square of another.
    #[inline(always)]
    pub(super) fn below(&self, tree: &FanTree, around: &Visit, square: usize, block: Block) -> Visit {
        let ([u, v], at) = (around.enter, |times: [f32; SIDE], i: usize| times.get(i % SIDE).copied().unwrap_or(0.0));
        let enter = [at(u, square), at(v, square / SIDE)];
        self.visit(tree, block, enter, around.shift - BITS)
    }

    /// The squares of a block that the ray passes, and where it is not clear of all below it.
    #[inline(always)]
    fn visit(&self, tree: &FanTree, block: Block, enter: [f32; 2], shift: u32) -> Visit {
        let Some(&Bounds([a, b, c, d])) = tree.bounds.get(block as usize * View::ALL + self.view.0) else {
            return Visit::NONE;
        };
        // 2^shift. By a conversion coarse picks took 1 to 2 % longer.
        let size = f32::from_bits((127 + shift) << 23);
        // When it enters four columns or rows, and when it leaves them.
        let across = |along: &Along, enter: f32| {
            let square = size * along.cell;
            let enter = Vec4::splat(enter) + Vec4::new(0.0, 1.0, 2.0, 3.0) * square;
            (enter, enter + Vec4::splat(square + along.margin))
        };
        let [enter_u, enter_v] = enter;
        let ((enter_u, leave_u), (enter_v, leave_v)) = (across(&self.u, enter_u), across(&self.v, enter_v));
        let enter = [enter_u.to_array(), enter_v.to_array()];
        let (enter_u, leave_u) = (enter_u.max(Vec4::ZERO), leave_u.min(Vec4::splat(self.end)));
        let (height, rise) = (Vec4::splat(self.height), Vec4::splat(self.rise));
        let row = |enter: f32, leave: f32, bounds: [f32; SIDE]| {
            let (enter, leave) = (enter_u.max(Vec4::splat(enter)), leave_u.min(Vec4::splat(leave)));
            // When it comes down to the bounds, or rises beyond them.
            let reach = (Vec4::from_array(bounds) - height) * rise;
            if DOWN { reach.max(enter).cmple(leave) } else { enter.cmple(reach.min(leave)) }.bitmask()
        };
        let open = row(enter_v.x, leave_v.x, a)
            | row(enter_v.y, leave_v.y, b) << 4
            | row(enter_v.z, leave_v.z, c) << 8
            | row(enter_v.w, leave_v.w, d) << 12;
        Visit { block, open, enter, shift }
    }

    /// The number of a square in its block: a visit counts them in the order in which the ray passes them.
    #[inline(always)]
    pub(super) fn number(&self, square: usize) -> usize {
        self.view.number(square)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::generate::generate;
    use super::super::parts::Resolutions;
    use super::super::random::bits;
    use super::super::selection::{LodEye, Precision};
    use super::*;

    /// Numbers from 0 to 1.
    struct Rng(u64);

    impl Rng {
        fn unit(&mut self) -> f64 {
            (bits(&mut self.0) >> 11) as f64 / (1u64 << 53) as f64
        }

        fn one_of<T: Copy>(&mut self, list: &[T]) -> T {
            list[(self.unit() * list.len() as f64) as usize]
        }
    }

    /// Squares that a ray passes without being clear, that are named without need, and that are not named.
    #[derive(Default, Debug)]
    struct Count {
        passed: usize,
        needless: usize,
        rest: usize,
    }

    /// Judges the answer for a block, and those for all below it, by f64.
    fn judge<const DOWN: bool>(
        tree: &FanTree,
        course: &Course<DOWN>,
        visit: &Visit,
        corner: [f64; 2],
        (ray, axes, start, above): (&LatticeRay, &[Axis; 2], f64, bool),
        count: &mut Count,
    ) {
        let size = f64::from(1u32 << visit.shift);
        let open = visit.open;
        for square in 0..16 {
            let number = course.number(square);
            let place = [corner[0] + (number % 4) as f64 * size, corner[1] + (number / 4) as f64 * size];
            let [[enter_u, leave_u], [enter_v, leave_v]] =
                [0, 1].map(|i| axes[i].across(place[i] as u32, 1 << visit.shift));
            let (enter, leave) = (enter_u.max(enter_v).max(start), leave_u.min(leave_v).min(ray.far));
            let [high, low] = [View(0), View(4)]
                .map(|view| tree.bounds[visit.block as usize * View::ALL + view.0].0)
                .map(|bounds| f64::from(bounds[number / 4][number % 4]));
            let heights = [enter, leave].map(|t| ray.origin.z + ray.direction.z * t);
            let near = if above { heights[0].min(heights[1]) <= high } else { heights[0].max(heights[1]) >= -low };
            let named = open >> square & 1 != 0;
            if enter < leave && near {
                assert!(
                    named,
                    "square {number} of {visit:?}, {enter} to {leave}, {heights:?}: {ray:?} from {start}, {course:?}"
                );
                count.passed += 1;
            } else if named {
                count.needless += 1;
            } else {
                count.rest += 1;
            }
            if let Below::Block(block) = tree.below(visit.block, number) {
                let below = course.below(tree, visit, square, block);
                judge(tree, course, &below, place, (ray, axes, start, above), count);
            }
        }
    }

    fn judge_ray(tree: &FanTree, ray: &LatticeRay, cells: [u32; 2], above: bool, part: f64, count: &mut Count) {
        let Some((ray, _)) = ray.tamed() else { return };
        let (o, d) = (ray.origin, ray.direction);
        let axes = [Axis::new(o.x, d.x, cells[0]), Axis::new(o.y, d.y, cells[1])];
        let [[near_u, far_u], [near_v, far_v]] = axes.map(|axis| axis.range());
        let (near, far) = (ray.near.max(near_u).max(near_v), ray.far.min(far_u).min(far_v));
        if !(near < far && near.is_finite() && far.is_finite()) {
            return;
        }
        let start = near + (far - near) * part;
        let ray = LatticeRay { near, far, ..ray };
        let (axes_of, way) = ([&axes[0], &axes[1]], (&ray, &axes, start, above));
        if (d.z <= 0.0) == above {
            let (course, top) = Course::<true>::new(tree, &ray, axes_of, start, above);
            judge(tree, &course, &top, [0.0; 2], way, count);
        } else {
            let (course, top) = Course::<false>::new(tree, &ray, axes_of, start, above);
            judge(tree, &course, &top, [0.0; 2], way, count);
        }
    }

    /// Judges rays over several maps, whose heights are numbers up to 65535 times one of the scales.
    fn judge_maps(rng: &mut Rng, scales: &[f64]) -> Count {
        let mut count = Count::default();
        for (columns, rows, min, levels, precision) in [
            (129, 129, 4, 3, 1.0),
            (201, 130, 2, 2, 4.0),
            (41, 9, 2, 3, 40.0),
            (3, 300, 8, 2, 3.0),
            (300, 300, 2, 5, 9.0),
        ] {
            let land = generate(300, 3).unwrap();
            let scale = rng.one_of(scales);
            let samples = (0..rows).flat_map(|r| (0..columns).map(move |c| (c, r)));
            let samples = samples.map(|(c, r)| ((land.raw(c, r) - 30_000.0) * scale) as f32).collect();
            let field = HeightField::from_f32(columns, rows, samples, Default::default()).unwrap();
            let tree = Hierarchy::new(field.cells(), Resolutions::new(min, levels).unwrap());
            let eye = LodEye::Point { u: 5.0, v: 60.0, height: 3.0 };
            let selection = Selection::of(&tree, &Precision { precision, eye });
            let fans = FanTree::new(&field, &tree, &selection);
            let [low, high] = fans.range;
            let [cu, cv] = field.cells().map(f64::from);
            for _ in 0..4000 {
                // Half of them samples: where patches meet, and at the very height of their bounds.
                let mut place = || {
                    let [u, v] = [rng.unit() * cu, rng.unit() * cv];
                    if rng.unit() < 0.5 {
                        let [c, r] = [u.round(), v.round()];
                        return DVec3::new(c, r, field.raw(c as u32, r as u32));
                    }
                    DVec3::new(u, v, low + (high - low) * (1.2 * rng.unit() - 0.1))
                };
                let (from, to) = (place(), place());
                let mut d = to - from;
                match rng.one_of(&[0, 1, 2, 3, 4, 5, 6, 7, 8, 9]) {
                    0 => d.x = 0.0,
                    1 => d.y = 0.0,
                    2 => d.z *= 1e-6,
                    3 => d.x *= 10f64.powf(-60.0 * rng.unit()),
                    4 => (d.x, d.y) = (d.x * 10f64.powf(-250.0 * rng.unit()), d.y * 10f64.powf(-250.0 * rng.unit())),
                    5 => d.y = d.x,
                    6 => d.z *= 10f64.powf(-60.0 * rng.unit()),
                    7 => d.z = 0.0,
                    _ => {}
                }
                if d.x == 0.0 && d.y == 0.0 {
                    continue;
                }
                let origin = from - d * rng.one_of(&[0.0, 1.0, 1000.0, 1e7, 1e12]);
                let ray = LatticeRay {
                    origin,
                    direction: d * rng.one_of(&[1.0, 1e-100, 1e100]),
                    near: 0.0,
                    far: f64::INFINITY,
                };
                let part = rng.one_of(&[0.0, 0.0, 0.3]);
                judge_ray(&fans, &ray, field.cells(), rng.unit() < 0.5, part, &mut count);
            }
        }
        count
    }

    #[test]
    fn no_square_that_a_ray_passes_is_missed() {
        // Heights of all sizes: what is clear is found by comparing.
        let count = judge_maps(&mut Rng(1), &[1.0, 1e-30, 1e-6, 1e30]);
        // And few are named without need: those that a ray touches in a corner, or passes very near.
        assert!(
            count.passed > 100_000 && count.needless < count.passed / 5 && count.rest > 10 * count.passed,
            "{count:?}"
        );
    }

    #[test]
    fn no_square_is_missed_where_heights_lose_their_digits() {
        for (seed, scale) in [(2, 1e-34), (3, 1e-40), (4, 1e-43)] {
            let count = judge_maps(&mut Rng(seed), &[scale]);
            assert!(count.passed > 100_000, "{count:?}");
        }
    }

    #[test]
    fn no_square_is_missed_where_differences_of_heights_are_beyond_f32() {
        let count = judge_maps(&mut Rng(3), &[2.8e33]);
        assert!(count.passed > 100_000, "{count:?}");
    }
}
