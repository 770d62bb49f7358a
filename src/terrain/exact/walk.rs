//! The walk of a ray through the min/max tree and the cells.

use glam::DVec3;

use super::ExactHit;
use crate::terrain::axis::{Axis, approach, number};
use crate::terrain::height_field::HeightField;
use crate::terrain::pick::LatticeRay;
use crate::terrain::pyramid::{Height, Level, MinMaxPyramid, larger, smaller};
use crate::terrain::sign::Sign;

/// Blocks of the smallest level of the tree have 2^BASE_BITS cells a side.
const BASE_BITS: u32 = MinMaxPyramid::BASE.trailing_zeros();
/// From level to level of the walk the side of a block grows by 2^STEP_BITS.
const STEP_BITS: u32 = 2;

pub(super) fn step_limit([columns, rows]: [u32; 2]) -> u32 {
    columns + rows + (columns + rows) / 2 + 2 * u32::BITS
}

/// Side of a block of a level of the walk: level 0 are the cells.
fn shift(level: usize) -> u32 {
    if level == 0 { 0 } else { BASE_BITS + (level as u32 - 1) * STEP_BITS }
}

/// A block and the parameter at which the ray enters it.
#[derive(Debug, Clone, Copy)]
struct Place {
    level: usize,
    column: usize,
    row: usize,
    t: f64,
    /// Height of the ray at t.
    z: f64,
}

/// A place on the surface, known by its triangle.
#[derive(Debug, Clone, Copy)]
struct Contact {
    t: f64,
    column: usize,
    row: usize,
    upper: bool,
}

/// Where the surface is ground, and not the lid over a hole.
pub(super) trait Ground {
    /// A triangle of the ground at a point: the one given, or another that it lies on the border of. The point is given by its
    /// triangle (cell, and whether it is the upper one) and how far beyond the cell's column and row it is.
    fn triangle_at(&self, cell: [usize; 2], upper: bool, beyond: [f64; 2]) -> Option<([usize; 2], bool)>;
}

/// The surface of a map without holes.
pub(super) struct Everywhere;

impl Ground for Everywhere {
    #[inline(always)]
    fn triangle_at(&self, cell: [usize; 2], upper: bool, _: [f64; 2]) -> Option<([usize; 2], bool)> {
        Some((cell, upper))
    }
}

impl Ground for &HeightField {
    fn triangle_at(&self, cell: [usize; 2], upper: bool, [s, r]: [f64; 2]) -> Option<([usize; 2], bool)> {
        let [c, row] = cell.map(|i| i as u32);
        if self.is_ground([c, row], upper) {
            return Some((cell, upper));
        }
        let (cell, upper) = self.ground_at(f64::from(c) + s, f64::from(row) + r)?;
        Some((cell.map(|i| i as usize), upper))
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Outcome {
    /// The sign has changed.
    Turned,
    /// The end of the ray or of the map.
    Ended,
    /// Nothing more is wanted.
    Stopped,
}

struct Walk<'t, T, G, F> {
    samples: &'t [T],
    levels: &'t [Level<T>],
    ground: G,
    /// The level of the walk that is one block.
    top: usize,
    u: Axis,
    v: Axis,
    /// u − v along the ray: where it starts, and 1 / slope.
    across: (f64, f64, f64),
    z: (f64, f64),
    near: f64,
    far: f64,
    sign: Sign<Contact>,
    /// Steps that may still be made.
    left: u32,
    /// The ray's t is this times the walk's.
    unit: f64,
    found: F,
}

/// Walks along the ray and returns the number of steps.
pub(super) fn walk<T: Height, G: Ground, F: FnMut(ExactHit) -> bool>(
    samples: &[T],
    levels: &[Level<T>],
    ground: G,
    cells: [u32; 2],
    ray: &LatticeRay,
    found: F,
) -> u32 {
    let base = levels.first().map_or([0; 2], |l| [l.columns, l.rows]);
    if base != cells.map(|n| n.div_ceil(MinMaxPyramid::BASE)) {
        return 0;
    }
    let Some((LatticeRay { origin: o, direction: d, mut near, far }, unit)) = ray.tamed() else { return 0 };
    // A ray beside the map, along its lines.
    let beside = |o: f64, d: f64, cells: u32| d == 0.0 && !(0.0..=f64::from(cells)).contains(&o);
    if beside(o.x, d.x, cells[0]) || beside(o.y, d.y, cells[1]) {
        return 0;
    }
    let (u, v) = (Axis::new(o.x, d.x, cells[0]), Axis::new(o.y, d.y, cells[1]));
    let mut top = 1;
    while levels.get((top - 1) * STEP_BITS as usize).is_some_and(|l| l.columns > 1 || l.rows > 1) {
        top += 1;
    }
    let limit = step_limit(cells);
    let mut walk = Walk {
        samples,
        levels,
        ground,
        top,
        u,
        v,
        across: (o.x - o.y, d.x - d.y, 1.0 / (d.x - d.y)),
        z: (o.z, d.z),
        near,
        far,
        sign: Sign::unknown(),
        left: limit,
        unit,
        found,
    };
    if d.x == 0.0 && d.y == 0.0 {
        walk.vertical();
        return 1;
    }
    let ([enter_u, leave_u], [enter_v, leave_v]) = (u.range(), v.range());
    near = near.max(enter_u).max(enter_v);
    walk.far = far.min(leave_u).min(leave_v);
    if !(near <= walk.far && near.is_finite() && walk.far.is_finite()) {
        return 0;
    }
    walk.near = near;
    walk.run();
    limit - walk.left
}

/// Half a unit in the last place of 1.
const EPSILON: f64 = f64::EPSILON / 2.0;

/// The range of heights of a block that is not there: nothing is skipped for it.
const ANYTHING: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

impl<T: Height, G: Ground, F: FnMut(ExactHit) -> bool> Walk<'_, T, G, F> {
    #[inline(always)]
    fn sample(&self, column: usize, row: usize) -> T {
        // Columns and rows are clamped to the map by whoever steps.
        self.samples.get(row * (self.u.cells as usize + 1) + column).copied().unwrap_or_default()
    }

    #[inline(always)]
    fn height_along(&self, t: f64) -> f64 {
        self.z.0 + self.z.1 * t
    }

    /// Smallest and largest height of a map.
    fn range(&self) -> [f64; 2] {
        match self.levels.last().map(|l| (l.low.first(), l.high.first())) {
            Some((Some(&low), Some(&high))) => [low.into(), high.into()],
            _ => ANYTHING,
        }
    }

    fn run(&mut self) {
        let Some((start, sign)) = approach(self.z.0, self.z.1, self.range(), [self.near, self.far]) else {
            return;
        };
        self.sign.now = sign;
        let mut place = Place { level: self.top, column: 0, row: 0, t: start, z: self.height_along(start) };
        loop {
            let outcome = match self.sign.now {
                1 => self.march::<1>(&mut place),
                -1 => self.march::<-1>(&mut place),
                _ => self.march::<0>(&mut place),
            };
            match outcome {
                Outcome::Turned => {}
                Outcome::Stopped => return,
                Outcome::Ended => break,
            }
        }
        if let Some((contact, entering)) = self.sign.end() {
            self.report(contact, entering);
        }
    }

    /// Walks from a place on. `SIGN` is the sign of f there: blocks on that side of the ray are passed, with 0 none.
    #[inline(always)]
    fn march<const SIGN: i8>(&mut self, place: &mut Place) -> Outcome {
        let (u, v) = (self.u, self.v);
        let far = self.far;
        loop {
            let level = place.level;
            let size = number(1 << shift(level));
            let ((mut line_u, step_u), (mut line_v, step_v)) = (u.ahead(place.column, size), v.ahead(place.row, size));
            let (mut leave_u, mut leave_v) = (u.line(line_u), v.line(line_v));
            let up = if level == 0 { BASE_BITS } else { STEP_BITS };
            let block = if level == 0 { None } else { self.levels.get((level - 1) * STEP_BITS as usize) };
            loop {
                if self.left == 0 {
                    debug_assert!(false, "a walk visits no block twice");
                    return Outcome::Stopped;
                }
                self.left -= 1;
                let leave = smaller(if leave_u <= leave_v { leave_u } else { leave_v }, far);
                let z = self.height_along(leave);
                let [low, high] = match block {
                    Some(block) => {
                        let at = place.row * block.columns as usize + place.column;
                        match (block.low.get(at), block.high.get(at)) {
                            (Some(&low), Some(&high)) => [low.into(), high.into()],
                            _ => ANYTHING,
                        }
                    }
                    None if level == 0 => self.cell_range(place.column, place.row),
                    None => self.range(),
                };
                let clear = match SIGN {
                    1 => smaller(place.z, z) > high,
                    -1 => larger(place.z, z) < low,
                    _ => false,
                };
                if !clear {
                    if level > 0 {
                        break;
                    }
                    if !self.cell(place, leave, leave_u, leave_v) {
                        return Outcome::Stopped;
                    }
                }
                if leave >= far {
                    return Outcome::Ended;
                }
                (place.t, place.z) = (leave, z);
                let crossed;
                if leave_u <= leave_v {
                    let next = u.next(place.column);
                    crossed = (next ^ place.column) >> up;
                    place.column = next;
                    line_u += step_u;
                    leave_u = u.line(line_u);
                } else {
                    let next = v.next(place.row);
                    crossed = (next ^ place.row) >> up;
                    place.row = next;
                    line_v += step_v;
                    leave_v = v.line(line_v);
                }
                if crossed != 0 && level < self.top {
                    place.level += 1;
                    place.column >>= up;
                    place.row >>= up;
                    if self.sign.now != SIGN {
                        return Outcome::Turned;
                    }
                    break;
                }
                if self.sign.now != SIGN {
                    return Outcome::Turned;
                }
            }
            if place.level == level {
                // Look closer.
                place.level -= 1;
                let bits = shift(level) - shift(level - 1);
                let below = shift(level - 1);
                place.column = u.child(place.column, bits, below, place.t);
                place.row = v.child(place.row, bits, below, place.t);
            }
        }
    }

    #[inline(always)]
    fn cell_range(&self, column: usize, row: usize) -> [f64; 2] {
        let width = self.u.cells as usize + 1;
        let at = row * width + column;
        let rows = (self.samples.get(at..at + 2), self.samples.get(at + width..at + width + 2));
        let (Some(&[nw, ne]), Some(&[sw, se])) = rows else { return ANYTHING };
        let low = smaller(smaller(nw, ne), smaller(sw, se));
        let high = larger(larger(nw, ne), larger(sw, se));
        [low.into(), high.into()]
    }

    /// Height of the surface on the line through column `column`, between two rows.
    #[inline(always)]
    fn on_column(&self, column: usize, row: usize, t: f64) -> f64 {
        let s = self.v.fraction(row, t);
        T::between(self.sample(column, row), self.sample(column, row + 1), s)
    }

    /// Height of the surface on the line through row `row`, between two columns.
    #[inline(always)]
    fn on_row(&self, column: usize, row: usize, t: f64) -> f64 {
        let s = self.u.fraction(column, t);
        T::between(self.sample(column, row), self.sample(column + 1, row), s)
    }

    /// Looks at one cell, from where the ray enters it. `false` when nothing more is wanted.
    fn cell(&mut self, place: &Place, leave: f64, leave_u: f64, leave_v: f64) -> bool {
        let &Place { column, row, .. } = place;
        let (u, v) = (self.u, self.v);
        // Heights where the ray enters and leaves: on the line that it crosses there, the row's last if both at once, as
        // in stepping; inside the cell where the ray starts or ends.
        let (behind_u, ahead_u) = if u.forward { (column, column + 1) } else { (column + 1, column) };
        let (behind_v, ahead_v) = if v.forward { (row, row + 1) } else { (row + 1, row) };
        let (enter_u, enter_v) = (u.line(number(behind_u)), v.line(number(behind_v)));
        // Not where the walk began: that depends on heights elsewhere.
        let enter = larger(larger(enter_u, enter_v), self.near);
        let h0 = if enter == enter_v {
            self.on_row(column, behind_v, enter)
        } else if enter == enter_u {
            self.on_column(behind_u, row, enter)
        } else {
            self.inside(column, row, enter).0
        };
        let h1 = if leave == leave_u {
            self.on_column(ahead_u, row, leave)
        } else if leave == leave_v {
            self.on_row(column, ahead_v, leave)
        } else {
            self.inside(column, row, leave).0
        };
        let (f0, f1) = (self.height_along(enter) - h0, self.height_along(leave) - h1);
        // u − v = column − row is the diagonal, north-east of it is the upper triangle.
        let (from, slope, inverse) = self.across;
        let diagonal = number(column) - number(row);
        if slope == 0.0 {
            let upper = from >= diagonal;
            return self.pass(enter, f0, None, [column, row], upper)
                && self.pass(leave, f1, Some((enter, f0)), [column, row], upper);
        }
        let middle = (diagonal - from) * inverse;
        let after = slope > 0.0;
        if !(middle > enter && middle < leave) {
            let upper = if middle <= enter { after } else { !after };
            return self.pass(enter, f0, None, [column, row], upper)
                && self.pass(leave, f1, Some((enter, f0)), [column, row], upper);
        }
        let s = u.fraction(column, middle);
        let fm = self.height_along(middle) - T::between(self.sample(column, row), self.sample(column + 1, row + 1), s);
        self.pass(enter, f0, None, [column, row], !after)
            && self.pass(middle, fm, Some((enter, f0)), [column, row], !after)
            && self.pass(leave, f1, Some((middle, fm)), [column, row], after)
    }

    /// Height of the surface inside a cell, and in which triangle.
    fn inside(&self, column: usize, row: usize, t: f64) -> (f64, bool) {
        let s = self.u.fraction(column, t);
        let r = self.v.fraction(row, t);
        let [a, b, c, d] = self.corners(column, row);
        if s >= r { (a + s * (b - a) + r * (d - b), true) } else { (a + r * (c - a) + s * (d - c), false) }
    }

    /// Samples north-west, north-east, south-west, south-east.
    fn corners(&self, column: usize, row: usize) -> [f64; 4] {
        let at = |i, j| self.sample(column + i, row + j).into();
        [at(0, 0), at(1, 0), at(0, 1), at(1, 1)]
    }

    /// Follows f to its value at `t` over one triangle, from the value before on the same triangle.
    #[inline(always)]
    fn pass(&mut self, t: f64, f: f64, before: Option<(f64, f64)>, [column, row]: [usize; 2], upper: bool) -> bool {
        if f == 0.0 || self.sign.turns(f) && self.is_in_doubt(t, f, [column, row]) {
            // Where the ray first met the ground: not where it met a lid in one plane with it.
            let contact = Contact { t, column, row, upper };
            if self.sign.zero_since.is_none_or(|first| self.on_ground(&first).is_none()) {
                self.sign.zero_since = Some(contact);
            }
            return true;
        }
        let Some(turn) = self.sign.pass(f) else { return true };
        let contact = turn.zero_since.unwrap_or_else(|| {
            let at = match before {
                Some((t0, f0)) => (t0 + (t - t0) * (f0 / (f0 - f))).clamp(t0, t),
                // The neighbour has rounded to the other side.
                None => t,
            };
            Contact { t: at, column, row, upper }
        });
        self.report(contact, turn.entering)
    }

    /// The triangle of the ground that a contact belongs to.
    #[inline(always)]
    fn on_ground(&self, &Contact { t, column, row, upper }: &Contact) -> Option<([usize; 2], bool)> {
        let beyond = [self.u.fraction(column, t), self.v.fraction(row, t)];
        self.ground.triangle_at([column, row], upper, beyond)
    }

    /// A vertical ray meets the surface once.
    fn vertical(&mut self) {
        // The lines are measured from the middle of the cell.
        let (column, row) = (self.u.from as usize, self.v.from as usize);
        let (height, upper) = self.inside(column, row, 0.0);
        let t = (height - self.z.0) / self.z.1;
        if t >= self.near && t <= self.far {
            self.report(Contact { t, column, row, upper }, self.z.1 < 0.0);
        }
    }

    /// Whether f has no sign that rounding could not have given it: around a vertex, where it is computed from several lines,
    /// it would change to and fro within the last digits.
    #[cold]
    #[inline(never)]
    fn is_in_doubt(&self, t: f64, f: f64, [column, row]: [usize; 2]) -> bool {
        let [a, b, c, d] = self.corners(column, row);
        let height = a.abs().max(b.abs()).max(c.abs()).max(d.abs());
        // The derivation is that of `ExactHit::error`.
        f.abs() <= 6.0 * EPSILON * self.magnitude(t, height, [a, b, c, d])
    }

    /// The sum that rounding is in proportion to, at a point of a cell.
    fn magnitude(&self, t: f64, height: f64, [a, b, c, d]: [f64; 4]) -> f64 {
        let steepest = (b - a).abs().max((d - c).abs()) + (c - a).abs().max((d - b).abs());
        let along = |axis: &Axis| axis.origin.abs() + (axis.direction * t).abs();
        self.z.0.abs() + (self.z.1 * t).abs() + height.abs() + steepest * (along(&self.u) + along(&self.v) + 1.0)
    }

    #[cold]
    #[inline(never)]
    fn report(&mut self, contact: Contact, entering: bool) -> bool {
        // A lid over a hole is crossed unseen.
        let Some(([column, row], upper)) = self.on_ground(&contact) else { return true };
        let t = contact.t;
        let [a, b, c, d] = self.corners(column, row);
        // Rounding may put the point a little beside its triangle.
        let s = self.u.fraction(column, t);
        let r = self.v.fraction(row, t);
        let (gradient, barycentric, height) = if upper {
            let r = r.min(s);
            ([b - a, d - b], [1.0 - s, s - r, r], a + s * (b - a) + r * (d - b))
        } else {
            let s = s.min(r);
            ([d - c, c - a], [1.0 - r, r - s, s], a + r * (c - a) + s * (d - c))
        };
        let sum = self.magnitude(t, height, [a, b, c, d]);
        (self.found)(ExactHit {
            t: t * self.unit,
            point: DVec3::new(number(column) + s, number(row) + r, height),
            cell: [column as u32, row as u32],
            upper,
            gradient,
            barycentric,
            entering,
            error: 16.0 * EPSILON * sum,
        })
    }
}
