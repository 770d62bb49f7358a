//! From active patches to what a renderer draws: one list of instances per part.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use super::hierarchy::Hierarchy;
use super::parts::{Parts, parts_of};
use super::selection::ActivePatch;

/// One part at one place. Its vertices are `origin + step · unit`, clamped to the map: all integers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Instance {
    /// Lattice column and row of the patch's north-west corner.
    pub origin: [u32; 2],
    /// Lattice steps per unit.
    pub step: u32,
}

/// Instances sorted by part, ready for one instanced draw call per part in use.
#[derive(Debug, Clone, Default)]
pub struct Instances {
    data: Vec<Instance>,
    /// For each part in use: its number (see [`Parts::index`]) and its instances.
    ranges: Vec<(usize, Range<u32>)>,
    triangles: u64,
    cursor: Vec<u32>,
}

impl Instances {
    /// Lists the parts of all `patches`. Buffers are used again; nothing is allocated once they have grown.
    pub fn update(&mut self, tree: &Hierarchy, parts: &Parts, patches: &[ActivePatch]) {
        self.cursor.clear();
        self.cursor.resize(parts.len(), 0);
        for patch in patches {
            for part in parts_of(patch.sides) {
                self.cursor[parts.index(part)] += 1;
            }
        }
        self.ranges.clear();
        self.triangles = 0;
        let mut first = 0;
        for (index, cursor) in self.cursor.iter_mut().enumerate() {
            let count = *cursor;
            let triangles = parts.range(index).len() as u64;
            // A tile of resolution 2 is empty: its strips cover it.
            if count > 0 && triangles > 0 {
                self.ranges.push((index, first..first + count));
                self.triangles += u64::from(count) * triangles;
            }
            *cursor = first;
            first += count;
        }
        self.data.clear();
        self.data.resize(first as usize, Instance::zeroed());
        for patch in patches {
            let instance = Instance { origin: tree.origin(patch.id), step: tree.step(patch.id.level) };
            for part in parts_of(patch.sides) {
                let cursor = &mut self.cursor[parts.index(part)];
                self.data[*cursor as usize] = instance;
                *cursor += 1;
            }
        }
    }

    /// All instances; the ranges of [`Instances::ranges`] index them.
    #[must_use]
    pub fn data(&self) -> &[Instance] {
        &self.data
    }

    /// Parts in use with their instances.
    #[must_use]
    pub fn ranges(&self) -> &[(usize, Range<u32>)] {
        &self.ranges
    }

    /// Triangles that drawing all instances takes.
    #[must_use]
    pub fn triangles(&self) -> u64 {
        self.triangles
    }

    /// The same parts in the same places with a range, and so a draw call, for each of them: what drawing takes without
    /// instancing. For measuring.
    ///
    /// ```
    /// use seamount::terrain::{Full, Hierarchy, Instances, Parts, Resolutions, Selection};
    ///
    /// let resolutions = Resolutions::new(8, 2)?;
    /// let (tree, parts) = (Hierarchy::new([32, 32], resolutions), Parts::new(resolutions));
    /// let patches: Vec<_> = Selection::of(&tree, &Full).patches(&tree).collect();
    /// let mut instances = Instances::default();
    /// instances.update(&tree, &parts, &patches);
    /// let separated = instances.separated();
    /// // Four tiles and four strips of one resolution; four patches.
    /// assert_eq!((instances.ranges().len(), separated.ranges().len()), (8, 32));
    /// assert_eq!(instances.triangles(), separated.triangles());
    /// # Ok::<(), seamount::terrain::ResolutionsError>(())
    /// ```
    #[must_use]
    pub fn separated(&self) -> Self {
        let one_by_one = |(part, range): &(usize, Range<u32>)| {
            let part = *part;
            range.clone().map(move |k| (part, k..k + 1))
        };
        Self { ranges: self.ranges.iter().flat_map(one_by_one).collect(), ..self.clone() }
    }
}
