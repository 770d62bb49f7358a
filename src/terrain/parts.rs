//! Tiles and strips: the handful of meshes that every patch is put together from.
//!
//! A patch is a square of `r × r` lattice steps. Its two diagonals cut it into four **tiles**, one per side; along the
//! diagonals run four **strips**, one per corner, which join two tiles whatever their resolutions are. With `n`
//! resolutions there are `4·n` tiles and `4·n²` strips; they are made once, in integer unit coordinates `0..=r_max`, and
//! drawn as instances.
//!
//! # Which triangle belongs where
//!
//! Every cell of a patch is split like the cells of the map, from its north-west to its south-east corner (`U` is the
//! upper right half, `L` the lower left). Seen from the north-west to south-east diagonal of the *patch*, that diagonal
//! runs along cell diagonals; seen from the other one it crosses them. For resolution `r`, with cell `(i, j)`:
//!
//! * cells with `i = j` or `i + j = r − 1` (those on a patch diagonal) belong to strips, both halves;
//! * of the cells beside them one half belongs to the strip, the other to the tile: where `|i − j| = 1` the strip has `L`
//!   on the north and east side, `U` on the south and west; where `i + j = r − 2` or `r` likewise, which leaves the tile
//!   the half that has an edge towards its side;
//! * everything else belongs to the tile it lies in.
//!
//! So a tile of resolution `r` has `(r−2)²/2` triangles and owns `r − 2` of the steps along its side; the strip of two
//! tiles of the *same* resolution has `2r − 2`, and tiles and strips of one resolution together are exactly the lattice
//! triangles: drawn, picked and measured surface are one. The counts are those of the published implementation (test
//! `counts_of_the_published_layout`), the outlines differ: there the cells beside two of the strips are turned.
//!
//! A strip between *different* resolutions `a > b` runs along the patch's diagonal with the finer step: each half of it
//! takes its tile's outline on one side and the diagonal's `a/2 + 1` points on the other. It has
//! `max(a, b) + (a + b)/2 − 2` triangles.
//!
//! # Clamping at the border of the map
//!
//! A map need not be a whole number of patches. Vertices beyond its border are moved onto it: `u' = min(u, cells_u)`,
//! `v' = min(v, cells_v)`. This keeps the patch a triangulation of what remains of it if no triangle turns over, and a
//! triangle turns over exactly if the slopes of its three edges all have the same strict sign: let its corners be sorted
//! by u and p₃ be moved left; the area changes sign iff p₃ lies on the other side of p₂ vertically than of the line
//! p₁p₂, that is iff all three descend or all three climb. Clamping moves coordinates monotonically, so it can take a
//! sign away but never make one. All lattice triangles have an edge along an axis; the triangles between two different
//! resolutions have one edge along the diagonal and two of the opposite slope. The test
//! `no_triangle_turns_over_when_clamped` tries all clamps.

use std::ops::Range;

use thiserror::Error;

/// A side of a patch. North is row 0 (v = 0).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Side {
    /// v = 0
    North = 0,
    /// u = max
    East = 1,
    /// v = max
    South = 2,
    /// u = 0
    West = 3,
}

impl Side {
    /// All sides, clockwise from the north.
    pub const ALL: [Side; 4] = [Side::North, Side::East, Side::South, Side::West];

    /// The side that a neighbour across this one shares with it.
    #[must_use]
    pub fn opposite(self) -> Side {
        match self {
            Side::North => Side::South,
            Side::East => Side::West,
            Side::South => Side::North,
            Side::West => Side::East,
        }
    }

    /// The next side clockwise.
    #[must_use]
    pub fn next(self) -> Side {
        match self {
            Side::North => Side::East,
            Side::East => Side::South,
            Side::South => Side::West,
            Side::West => Side::North,
        }
    }
}

/// Resolutions that were asked for do not work.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ResolutionsError {
    /// One resolution would make the branching factor 1: a split would never end.
    #[error("{0} resolutions do not work: 2 to 5 are needed (with one a split patch would have one child)")]
    Count(u32),
    /// The smallest resolution is not a power of two from 2 to 256.
    #[error("the smallest resolution {0} does not work: it has to be a power of two from 2 to 256")]
    Min(u32),
    /// The largest resolution is beyond what a part may have.
    #[error("resolutions {min} to {max} do not work: the largest may be {limit}", limit = Resolutions::LIMIT)]
    Max {
        /// Smallest resolution.
        min: u32,
        /// Largest resolution.
        max: u32,
    },
}

/// The resolutions `r_min, 2·r_min, .. r_max` of a side: how many lattice steps it is divided into.
///
/// # Example
///
/// ```
/// use seamount::terrain::Resolutions;
///
/// let resolutions = Resolutions::new(16, 3)?;
/// assert_eq!((resolutions.min(), resolutions.max(), resolutions.branching()), (16, 64, 4));
/// assert!(Resolutions::new(16, 1).is_err());
/// # Ok::<(), seamount::terrain::ResolutionsError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Resolutions {
    min: u32,
    count: u32,
}

impl Resolutions {
    /// Largest resolution of a side.
    pub const LIMIT: u32 = 512;

    /// `count` resolutions from `min` on, each twice the one before.
    ///
    /// # Errors
    ///
    /// Unless `count` is 2 to 5, `min` a power of two from 2 to 256 and the largest at most 512.
    pub fn new(min: u32, count: u32) -> Result<Self, ResolutionsError> {
        if !(2..=5).contains(&count) {
            return Err(ResolutionsError::Count(count));
        }
        if !(2..=256).contains(&min) || !min.is_power_of_two() {
            return Err(ResolutionsError::Min(min));
        }
        let max = min << (count - 1);
        if max > Self::LIMIT {
            return Err(ResolutionsError::Max { min, max });
        }
        Ok(Self { min, count })
    }

    /// Smallest resolution r_min.
    #[must_use]
    pub fn min(self) -> u32 {
        self.min
    }

    /// Largest resolution r_max = r_min · 2^(n−1).
    #[must_use]
    pub fn max(self) -> u32 {
        self.min << (self.count - 1)
    }

    /// Number of resolutions n.
    #[must_use]
    pub fn count(self) -> u32 {
        self.count
    }

    /// Branching factor R = r_max / r_min: a split patch has R × R children.
    #[must_use]
    pub fn branching(self) -> u32 {
        1 << (self.count - 1)
    }

    /// Resolution number `index` (0 is r_min).
    #[must_use]
    pub fn get(self, index: u8) -> u32 {
        self.min << u32::from(index).min(self.count - 1)
    }
}

/// One of the meshes that a patch is put together from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Part {
    /// The tile on a side, with the index of its resolution.
    Tile(Side, u8),
    /// The strip at the corner *after* a side (clockwise): between that side's tile and the next one's, with the indices
    /// of their resolutions.
    Strip(Side, u8, u8),
}

/// A corner of a triangle in unit coordinates: `[u, v]` from the north-west corner of the patch, `0..=r_max`.
pub type UnitVertex = [u16; 2];

/// All tiles and strips for one set of resolutions, in unit coordinates, as triangle lists.
#[derive(Debug)]
pub struct Parts {
    resolutions: Resolutions,
    triangles: Vec<[UnitVertex; 3]>,
    /// Range of `triangles` per part, by [`Parts::index`].
    ranges: Vec<Range<u32>>,
    /// Boxes of the groups of each part, by [`Parts::index`]: of GROUP² triangles, then of GROUP.
    groups: Vec<[Vec<[UnitVertex; 2]>; 2]>,
}

/// Triangles of a part that have a box in common: about two rows of the default tile.
const GROUP: usize = 16;

impl Parts {
    /// Makes all parts. Triangles are counter-clockwise seen from above (u east, v south: clockwise in (u, v)).
    #[must_use]
    pub fn new(resolutions: Resolutions) -> Self {
        let n = resolutions.count() as u8;
        let mut parts = Self { resolutions, triangles: Vec::new(), ranges: Vec::new(), groups: Vec::new() };
        for side in Side::ALL {
            for r in 0..n {
                parts.add(|out| tile(resolutions, side, r, out));
            }
        }
        for side in Side::ALL {
            for a in 0..n {
                for b in 0..n {
                    parts.add(|out| strip(resolutions, side, a, b, out));
                }
            }
        }
        parts
    }

    fn add(&mut self, make: impl FnOnce(&mut Vec<[UnitVertex; 3]>)) {
        let start = self.triangles.len() as u32;
        make(&mut self.triangles);
        self.ranges.push(start..self.triangles.len() as u32);
        let made = self.triangles.get(start as usize..).unwrap_or(&[]);
        self.groups.push([GROUP * GROUP, GROUP].map(|size| made.chunks(size).map(box_of).collect()));
    }

    /// The resolutions the parts were made for.
    #[must_use]
    pub fn resolutions(&self) -> Resolutions {
        self.resolutions
    }

    /// Number of parts: 4·n + 4·n².
    #[must_use]
    pub fn len(&self) -> usize {
        self.ranges.len()
    }

    /// Never true: there are always parts.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.ranges.is_empty()
    }

    /// Dense number of a part, below [`Parts::len`].
    #[inline]
    #[must_use]
    pub fn index(&self, part: Part) -> usize {
        let n = self.resolutions.count() as usize;
        match part {
            Part::Tile(side, r) => side as usize * n + usize::from(r),
            Part::Strip(side, a, b) => 4 * n + (side as usize * n + usize::from(a)) * n + usize::from(b),
        }
    }

    /// The triangles of all parts, one part after the other.
    #[must_use]
    pub fn all_triangles(&self) -> &[[UnitVertex; 3]] {
        &self.triangles
    }

    /// Where in [`Parts::all_triangles`] the part with this number lies.
    #[must_use]
    pub fn range(&self, index: usize) -> Range<u32> {
        self.ranges.get(index).cloned().unwrap_or(0..0)
    }

    /// The triangles of one part.
    #[must_use]
    pub fn triangles(&self, part: Part) -> &[[UnitVertex; 3]] {
        let range = self.range(self.index(part));
        self.triangles.get(range.start as usize..range.end as usize).unwrap_or(&[])
    }

    /// The triangles of one part in groups that lie together, without those in boxes that are not wanted: `wanted` is asked
    /// about a large box first, then about those in it.
    pub fn groups<W>(&self, part: Part, wanted: W) -> impl Iterator<Item = &[[UnitVertex; 3]]>
    where
        W: Fn([UnitVertex; 2]) -> bool + Copy,
    {
        let [large, small] =
            self.groups.get(self.index(part)).map_or([&[][..]; 2], |g| g.each_ref().map(Vec::as_slice));
        let pieces = self.triangles(part).chunks(GROUP * GROUP).zip(small.chunks(GROUP));
        let pieces = large.iter().zip(pieces).filter(move |(bounds, _)| wanted(**bounds));
        pieces.flat_map(move |(_, (triangles, boxes))| {
            let groups = boxes.iter().zip(triangles.chunks(GROUP)).filter(move |(bounds, _)| wanted(**bounds));
            groups.map(|(_, triangles)| triangles)
        })
    }
}

/// The smallest box around triangles.
fn box_of(triangles: &[[UnitVertex; 3]]) -> [UnitVertex; 2] {
    let corners = || triangles.iter().flatten();
    let low = corners().fold([u16::MAX; 2], |low, p| [low[0].min(p[0]), low[1].min(p[1])]);
    [low, corners().fold([0; 2], |high, p| [high[0].max(p[0]), high[1].max(p[1])])]
}

/// The eight parts of a patch whose sides (north, east, south, west) have these resolution indices.
#[must_use]
pub fn parts_of([n, e, s, w]: [u8; 4]) -> [Part; 8] {
    use Side::{East, North, South, West};
    [
        Part::Tile(North, n),
        Part::Tile(East, e),
        Part::Tile(South, s),
        Part::Tile(West, w),
        Part::Strip(North, n, e),
        Part::Strip(East, e, s),
        Part::Strip(South, s, w),
        Part::Strip(West, w, n),
    ]
}

/// Half of a lattice cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Half {
    Upper,
    Lower,
}

/// Who owns half a cell in a patch of uniform resolution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Owner {
    Tile(Side),
    /// The strip at the corner after this side.
    Strip(Side),
}

pub(super) fn owner(i: u32, j: u32, half: Half, r: u32) -> Owner {
    use Side::{East, North, South, West};
    if i + j == r - 1 {
        return Owner::Strip(if i > j { North } else { South });
    }
    let before = i + j < r - 1;
    if i == j || i.abs_diff(j) == 1 && (i > j) == (half == Half::Lower) {
        return Owner::Strip(if before { West } else { East });
    }
    let (side, inward) = match (i > j, before) {
        (true, true) => (North, Half::Lower),
        (true, false) => (East, Half::Lower),
        (false, true) => (West, Half::Upper),
        (false, false) => (South, Half::Upper),
    };
    if (i + j).abs_diff(r - 1) == 1 && half == inward {
        return Owner::Strip(if i > j { North } else { South });
    }
    Owner::Tile(side)
}

/// The corners of half a cell, counter-clockwise seen from above.
fn half_cell(i: u32, j: u32, half: Half, step: u32) -> [UnitVertex; 3] {
    let p = |a: u32, b: u32| [(a * step) as u16, (b * step) as u16];
    match half {
        Half::Upper => [p(i, j), p(i + 1, j + 1), p(i + 1, j)],
        Half::Lower => [p(i, j), p(i, j + 1), p(i + 1, j + 1)],
    }
}

fn tile(resolutions: Resolutions, side: Side, index: u8, out: &mut Vec<[UnitVertex; 3]>) {
    let r = resolutions.get(index);
    let step = resolutions.max() / r;
    for j in 0..r {
        for i in 0..r {
            for half in [Half::Upper, Half::Lower] {
                if owner(i, j, half, r) == Owner::Tile(side) {
                    out.push(half_cell(i, j, half, step));
                }
            }
        }
    }
}

fn strip(resolutions: Resolutions, side: Side, a: u8, b: u8, out: &mut Vec<[UnitVertex; 3]>) {
    let (ra, rb) = (resolutions.get(a), resolutions.get(b));
    if ra == rb {
        let step = resolutions.max() / ra;
        for j in 0..ra {
            for i in 0..ra {
                for half in [Half::Upper, Half::Lower] {
                    if owner(i, j, half, ra) == Owner::Strip(side) {
                        out.push(half_cell(i, j, half, step));
                    }
                }
            }
        }
    } else {
        let finest = ra.max(rb);
        let mut halves = Vec::new();
        half_strip(resolutions, side, side, ra, finest, out, &mut halves);
        half_strip(resolutions, side, side.next(), rb, finest, out, &mut halves);
        out.append(&mut halves);
    }
}

/// The triangles along the diagonal of half a strip between different resolutions: those that are not halves of lattice
/// cells, for a diagonal of resolution number `fine`. `tile_side` is `strip` or the side after it.
#[must_use]
pub(super) fn fan_triangles(
    resolutions: Resolutions,
    strip: Side,
    tile_side: Side,
    index: u8,
    fine: u8,
) -> Vec<[UnitVertex; 3]> {
    // Where cell diagonals run along the patch's and the steps are equal, they are the lattice's own.
    if index == fine && !crosses(strip) {
        return Vec::new();
    }
    let mut fans = Vec::new();
    let (r, fine) = (resolutions.get(index), resolutions.get(fine));
    half_strip(resolutions, strip, tile_side, r, fine, &mut fans, &mut Vec::new());
    fans
}

/// Whether at the corner after this side cell diagonals cross the patch's diagonal: the north-east and south-west corners.
fn crosses(strip: Side) -> bool {
    matches!(strip, Side::North | Side::South)
}

/// The half of the strip at the corner after `strip` that lies in the tile of `tile_side`: between that tile's outline at
/// resolution `r` and the diagonal at resolution `fine >= r`.
///
/// Worked out once, in the frame of a corner: `along` runs from the corner along the tile's side, `inward` into the
/// patch; the diagonal's point k is (k, k), the outline's corners are (k + 1, k). Of each coarse step k the strip holds
/// the half cell (k,k) (k+1,k) (k+1,k+1), whose long edge is divided by the fine points of the diagonal, and of the next
/// cell the half that is left by the tile. The former go to `fans`, the latter, which are lattice triangles, to `halves`.
fn half_strip(
    resolutions: Resolutions,
    strip: Side,
    tile_side: Side,
    r: u32,
    fine: u32,
    fans: &mut Vec<[UnitVertex; 3]>,
    halves: &mut Vec<[UnitVertex; 3]>,
) {
    let max = resolutions.max();
    let step = max / r;
    let fine_step = max / fine;
    // From (along, inward) to (u, v).
    let place = |along: u32, inward: u32| -> UnitVertex {
        let (u, v) = match (strip, tile_side) {
            // North-east corner.
            (Side::North, Side::North) => (max - along, inward),
            (Side::North, _) => (max - inward, along),
            // South-east corner.
            (Side::East, Side::East) => (max - inward, max - along),
            (Side::East, _) => (max - along, max - inward),
            // South-west corner.
            (Side::South, Side::South) => (along, max - inward),
            (Side::South, _) => (inward, max - along),
            // North-west corner.
            (Side::West, Side::West) => (inward, along),
            (Side::West, _) => (along, inward),
        };
        [u as u16, v as u16]
    };
    let turned = |a: UnitVertex, b: UnitVertex, c: UnitVertex| {
        let cross = (i32::from(b[0]) - i32::from(a[0])) * (i32::from(c[1]) - i32::from(a[1]))
            - (i32::from(b[1]) - i32::from(a[1])) * (i32::from(c[0]) - i32::from(a[0]));
        // v runs south, so counter-clockwise from above is a negative cross product in (u, v).
        if cross < 0 { [a, b, c] } else { [a, c, b] }
    };
    for k in 0..r / 2 {
        let apex = place((k + 1) * step, k * step);
        let mut d = k * step;
        while d < (k + 1) * step {
            fans.push(turned(apex, place(d, d), place(d + fine_step, d + fine_step)));
            d += fine_step;
        }
        if k + 1 < r / 2 {
            let on_diagonal = place((k + 1) * step, (k + 1) * step);
            // Where diagonals cross, the tile owns the half with the side's edge; its long edge runs from (k+2, k) to
            // (k+1, k+1).
            let near = if crosses(strip) { place((k + 2) * step, k * step) } else { apex };
            halves.push(turned(near, place((k + 2) * step, (k + 1) * step), on_diagonal));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn doubled_area([a, b, c]: [[i64; 2]; 3]) -> i64 {
        // Positive for counter-clockwise seen from above (v runs south).
        (b[1] - a[1]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[1] - a[1])
    }

    fn wide(t: &[UnitVertex; 3]) -> [[i64; 2]; 3] {
        t.map(|[u, v]| [i64::from(u), i64::from(v)])
    }

    fn all_resolutions() -> impl Iterator<Item = Resolutions> {
        [(2, 2), (2, 3), (2, 5), (4, 2), (4, 3), (8, 2), (4, 4), (8, 3)]
            .into_iter()
            .map(|(min, n)| Resolutions::new(min, n).unwrap())
    }

    /// Triangle counts of the published implementation for resolutions 4 and 8: index ranges 0..53 tile 8, 54..59 tile 4,
    /// 60..101 strip 8-8, 102..137 strip 8-4, 138..173 strip 4-8, 174..191 strip 4-4.
    #[test]
    fn counts_of_the_published_layout() {
        let parts = Parts::new(Resolutions::new(4, 2).unwrap());
        for side in Side::ALL {
            assert_eq!(parts.triangles(Part::Tile(side, 1)).len(), 18);
            assert_eq!(parts.triangles(Part::Tile(side, 0)).len(), 2);
            assert_eq!(parts.triangles(Part::Strip(side, 1, 1)).len(), 14);
            assert_eq!(parts.triangles(Part::Strip(side, 1, 0)).len(), 12);
            assert_eq!(parts.triangles(Part::Strip(side, 0, 1)).len(), 12);
            assert_eq!(parts.triangles(Part::Strip(side, 0, 0)).len(), 6);
        }
    }

    #[test]
    fn counts_follow_the_formula() {
        for resolutions in all_resolutions() {
            let parts = Parts::new(resolutions);
            for side in Side::ALL {
                for a in 0..resolutions.count() as u8 {
                    let ra = resolutions.get(a) as usize;
                    assert_eq!(parts.triangles(Part::Tile(side, a)).len(), (ra - 2) * (ra - 2) / 2);
                    for b in 0..resolutions.count() as u8 {
                        let rb = resolutions.get(b) as usize;
                        let count = parts.triangles(Part::Strip(side, a, b)).len();
                        assert_eq!(count, ra.max(rb) + (ra + rb) / 2 - 2, "strip {ra}-{rb}");
                    }
                }
            }
        }
    }

    /// Every combination of side resolutions tiles the patch: each inner edge is shared by exactly two triangles in
    /// opposite directions, the outer edges are the steps of the sides, all areas are positive and sum to the square's.
    #[test]
    fn parts_tile_the_patch_whatever_their_resolutions() {
        use std::collections::HashMap;
        for resolutions in all_resolutions().filter(|r| r.max() <= 16) {
            let parts = Parts::new(resolutions);
            let n = resolutions.count() as u8;
            let max = i64::from(resolutions.max());
            for code in 0..u32::from(n).pow(4) {
                let n32 = u32::from(n);
                let sides = [code % n32, code / n32 % n32, code / n32 / n32 % n32, code / n32.pow(3)].map(|i| i as u8);
                let mut edges: HashMap<([i64; 2], [i64; 2]), u32> = HashMap::new();
                let mut area = 0;
                for part in parts_of(sides) {
                    for t in parts.triangles(part) {
                        let t = wide(t);
                        assert!(doubled_area(t) > 0, "{part:?} {t:?}");
                        area += doubled_area(t);
                        for k in 0..3 {
                            *edges.entry((t[k], t[(k + 1) % 3])).or_default() += 1;
                        }
                    }
                }
                assert_eq!(area, 2 * max * max);
                let mut outer = [0u32; 4];
                for (&(a, b), &count) in &edges {
                    assert_eq!(count, 1, "edge {a:?} {b:?} twice in one direction");
                    if !edges.contains_key(&(b, a)) {
                        let side = match (a, b) {
                            ([_, 0], [_, 0]) => 0,
                            ([u, _], [w, _]) if u == max && w == max => 1,
                            ([_, v], [_, w]) if v == max && w == max => 2,
                            ([0, _], [0, _]) => 3,
                            _ => panic!("open edge {a:?} {b:?} inside the patch for {sides:?}"),
                        };
                        let step = max / i64::from(resolutions.get(sides[side]));
                        assert_eq!((a[0] - b[0]).abs() + (a[1] - b[1]).abs(), step);
                        outer[side] += 1;
                    }
                }
                assert_eq!(outer, sides.map(|r| resolutions.get(r)));
            }
        }
    }

    /// Patches of one resolution are the lattice itself: each triangle is half a cell, cut from north-west to south-east.
    #[test]
    fn uniform_patches_keep_the_lattice_diagonals() {
        for resolutions in all_resolutions() {
            let parts = Parts::new(resolutions);
            for r in 0..resolutions.count() as u8 {
                let step = i64::from(resolutions.max() / resolutions.get(r));
                for part in parts_of([r; 4]) {
                    for t in parts.triangles(part) {
                        let t = wide(t);
                        let low = [t[0][0].min(t[1][0]).min(t[2][0]), t[0][1].min(t[1][1]).min(t[2][1])];
                        assert!(t.contains(&low), "{t:?}");
                        assert!(t.contains(&[low[0] + step, low[1] + step]), "{t:?}");
                        assert_eq!(doubled_area(t), step * step);
                    }
                }
            }
        }
    }

    #[test]
    fn no_triangle_turns_over_when_clamped() {
        for resolutions in all_resolutions() {
            let parts = Parts::new(resolutions);
            let max = i64::from(resolutions.max());
            for t in parts.all_triangles() {
                let t = wide(t);
                for cu in 0..=max {
                    for cv in 0..=max {
                        let clamped = t.map(|[u, v]| [u.min(cu), v.min(cv)]);
                        assert!(doubled_area(clamped) >= 0, "{t:?} at ({cu}, {cv})");
                    }
                }
            }
        }
    }

    #[test]
    fn resolutions_that_do_not_work_are_refused() {
        assert_eq!(Resolutions::new(16, 1), Err(ResolutionsError::Count(1)));
        assert_eq!(Resolutions::new(16, 6), Err(ResolutionsError::Count(6)));
        assert_eq!(Resolutions::new(0, 3), Err(ResolutionsError::Min(0)));
        assert_eq!(Resolutions::new(12, 3), Err(ResolutionsError::Min(12)));
        assert_eq!(Resolutions::new(512, 2), Err(ResolutionsError::Min(512)));
        assert_eq!(Resolutions::new(256, 3), Err(ResolutionsError::Max { min: 256, max: 1024 }));
    }
}
