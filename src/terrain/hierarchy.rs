//! The tree of patches over a map: which patches there are and where they lie. It holds no geometry.
//!
//! A leaf patch has r_max × r_max cells; a patch of the level above is R times as wide, R = r_max / r_min. The tree needs
//! no pointers: each level is a grid, and the children of a patch are a block of R × R in the grid below. The top is a
//! grid of root patches too: roots are the widest patches that do not exceed the longer side of the map, so that a map
//! of any size and shape wastes less than one root along each side (a 1201² map under a single root of 4096² would be
//! 91 % empty). Patches that would lie wholly beyond the map do not exist; those that cross its border are clamped to it
//! (see [`crate::terrain::parts`]).

use super::parts::{Resolutions, Side};

/// Names a patch: its level (0 has the roots) and its place in the level's grid, from the north-west corner.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PatchId {
    /// 0 for the roots, [`Hierarchy::depth`] for the leaves.
    pub level: u8,
    /// Patches west of it.
    pub column: u32,
    /// Patches north of it.
    pub row: u32,
}

#[derive(Debug, Clone, Copy)]
struct Level {
    /// Cells along a side of a patch.
    size: u32,
    columns: u32,
    rows: u32,
    /// Number of patches on the levels above.
    first: usize,
}

/// The patch tree of a map with given resolutions.
///
/// # Example
///
/// ```
/// use seamount::terrain::{Hierarchy, PatchId, Resolutions};
///
/// let tree = Hierarchy::new([1200, 1200], Resolutions::new(16, 3)?);
/// assert_eq!((tree.depth(), tree.roots().count()), (2, 4)); // roots of 1024 cells, then 256, then 64
/// let root = PatchId { level: 0, column: 1, row: 0 };
/// assert_eq!(tree.extent(root), [[1024, 0], [1200, 1024]]); // clamped to the map
/// assert_eq!(tree.children(root).count(), 4); // 1 × 4 of its 4 × 4 children meet the map
/// # Ok::<(), seamount::terrain::ResolutionsError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Hierarchy {
    cells: [u32; 2],
    resolutions: Resolutions,
    levels: Vec<Level>,
}

impl Hierarchy {
    /// The tree for a map of `cells` (u, v), each at least 1 and below 2²⁴.
    #[must_use]
    pub fn new(cells: [u32; 2], resolutions: Resolutions) -> Self {
        let cells = cells.map(|c| c.clamp(1, 1 << 24));
        let longest = cells[0].max(cells[1]);
        let mut sizes = vec![resolutions.max()];
        while let Some(size) = sizes.last().and_then(|s| s.checked_mul(resolutions.branching()))
            && size <= longest
        {
            sizes.push(size);
        }
        let mut first = 0;
        let levels = sizes
            .into_iter()
            .rev()
            .map(|size| {
                let level = Level { size, columns: cells[0].div_ceil(size), rows: cells[1].div_ceil(size), first };
                first += level.columns as usize * level.rows as usize;
                level
            })
            .collect();
        Self { cells, resolutions, levels }
    }

    /// Cells of the map along u and v.
    #[must_use]
    pub fn cells(&self) -> [u32; 2] {
        self.cells
    }

    /// The resolutions of the patches' sides.
    #[must_use]
    pub fn resolutions(&self) -> Resolutions {
        self.resolutions
    }

    /// Level of the leaves; 0 when the roots are leaves.
    #[must_use]
    pub fn depth(&self) -> u8 {
        (self.levels.len() - 1) as u8
    }

    /// Number of patches of the whole tree.
    #[must_use]
    pub fn len(&self) -> usize {
        self.levels.last().map_or(0, |l| l.first + l.columns as usize * l.rows as usize)
    }

    /// Never true: a tree has at least one patch.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        false
    }

    /// More patches than a walk along a straight line can look at: on each level it goes from one to the next by a column or a
    /// row, always in one direction, and the levels double in size at least.
    #[must_use]
    pub fn step_limit(&self) -> u32 {
        let [columns, rows] = self.grid(self.depth());
        2 * (columns + rows) + 2 * u32::BITS
    }

    fn level(&self, level: u8) -> Level {
        self.levels[usize::from(level).min(self.levels.len() - 1)]
    }

    /// Columns and rows of the grid of patches of a level.
    #[must_use]
    pub fn grid(&self, level: u8) -> [u32; 2] {
        let l = self.level(level);
        [l.columns, l.rows]
    }

    /// Cells along a side of the patches of a level, before clamping to the map: a power of two.
    #[must_use]
    pub fn size(&self, level: u8) -> u32 {
        self.level(level).size
    }

    /// Lattice steps between neighbouring vertices of a patch of this level at r_max.
    #[must_use]
    pub fn step(&self, level: u8) -> u32 {
        self.size(level) / self.resolutions.max()
    }

    /// Dense number of a patch, below [`Hierarchy::len`].
    #[inline]
    #[must_use]
    pub fn index(&self, patch: PatchId) -> usize {
        let l = self.level(patch.level);
        l.first + patch.row as usize * l.columns as usize + patch.column as usize
    }

    /// The root patches.
    pub fn roots(&self) -> impl Iterator<Item = PatchId> + use<> {
        self.patches(0)
    }

    /// All patches of a level, row by row.
    pub fn patches(&self, level: u8) -> impl Iterator<Item = PatchId> + use<> {
        let [columns, rows] = self.grid(level);
        (0..rows).flat_map(move |row| (0..columns).map(move |column| PatchId { level, column, row }))
    }

    /// The children of a patch that meet the map; none for a leaf.
    pub fn children(&self, patch: PatchId) -> impl Iterator<Item = PatchId> + use<> {
        let r = self.resolutions.branching();
        let (columns, rows) = if patch.level < self.depth() {
            let below = self.level(patch.level + 1);
            (
                patch.column * r..(patch.column * r + r).min(below.columns),
                patch.row * r..(patch.row * r + r).min(below.rows),
            )
        } else {
            (0..0, 0..0)
        };
        rows.flat_map(move |row| columns.clone().map(move |column| PatchId { level: patch.level + 1, column, row }))
    }

    /// The patches of the next level that touch this one's closed square: its children and those around them, corners
    /// included; none for a leaf.
    pub fn touching_below(&self, patch: PatchId) -> impl Iterator<Item = PatchId> + use<> {
        let r = self.resolutions.branching();
        let around = |at: u32, count: u32| (at * r).saturating_sub(1)..(at * r + r + 1).min(count);
        let (columns, rows) = if patch.level < self.depth() {
            let below = self.level(patch.level + 1);
            (around(patch.column, below.columns), around(patch.row, below.rows))
        } else {
            (0..0, 0..0)
        };
        rows.flat_map(move |row| columns.clone().map(move |column| PatchId { level: patch.level + 1, column, row }))
    }

    /// The patch that contains this one, one level up.
    #[must_use]
    pub fn parent(&self, patch: PatchId) -> Option<PatchId> {
        let r = self.resolutions.branching();
        Some(PatchId { level: patch.level.checked_sub(1)?, column: patch.column / r, row: patch.row / r })
    }

    /// The patch of the same level across a side, `None` across the border of the map.
    #[inline]
    #[must_use]
    pub fn neighbour(&self, patch: PatchId, side: Side) -> Option<PatchId> {
        let l = self.level(patch.level);
        let PatchId { level, column, row } = patch;
        let (column, row) = match side {
            Side::North => (column, row.checked_sub(1)?),
            Side::East => (column + 1, row),
            Side::South => (column, row + 1),
            Side::West => (column.checked_sub(1)?, row),
        };
        (column < l.columns && row < l.rows).then_some(PatchId { level, column, row })
    }

    /// Lattice coordinates of the north-west corner.
    #[inline]
    #[must_use]
    pub fn origin(&self, patch: PatchId) -> [u32; 2] {
        let size = self.size(patch.level);
        [patch.column * size, patch.row * size]
    }

    /// North-west and south-east corner in lattice coordinates, clamped to the map.
    #[inline]
    #[must_use]
    pub fn extent(&self, patch: PatchId) -> [[u32; 2]; 2] {
        let size = self.size(patch.level);
        let [u, v] = self.origin(patch);
        [[u, v], [(u + size).min(self.cells[0]), (v + size).min(self.cells[1])]]
    }

    /// The leaf in which cell `(c, r)` lies.
    #[must_use]
    pub fn leaf_at(&self, c: u32, r: u32) -> PatchId {
        let size = self.size(self.depth());
        PatchId { level: self.depth(), column: c / size, row: r / size }
    }
}
