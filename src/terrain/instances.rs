//! From active patches to what a renderer draws: one list of instances per part, and loose triangles where the map has holes.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use super::drawn::DrawnSurface;
use super::hierarchy::Hierarchy;
use super::morph::PatchWeights;
use super::parts::{Part, Parts, parts_of};
use super::selection::{ActivePatch, Selection};

/// One part at one place. Its vertices are `origin + step · unit`, clamped to the map: all integers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Instance {
    /// Lattice column and row of the patch's north-west corner.
    pub origin: [u32; 2],
    /// Lattice steps per unit.
    pub step: u32,
}

/// A corner of a triangle that is drawn by itself: of a patch that a hole of the map takes triangles from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct LooseVertex {
    /// Lattice column and row, clamped to the map.
    pub point: [u32; 2],
    /// Lattice steps per unit of its patch.
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
    /// Whether the selection morphs.
    morphs: bool,
    /// One per instance if it does, otherwise none.
    weights: Vec<PatchWeights>,
    /// Corners of loose triangles, three by three: those of tiles first.
    loose: Vec<LooseVertex>,
    /// How many of them belong to tiles.
    loose_tiles: u32,
    /// One per loose corner if the selection morphs, otherwise none.
    loose_weights: Vec<f32>,
    /// One per instance if they were rated, otherwise none.
    errors: Vec<f32>,
    /// One per loose corner if they were rated, otherwise none.
    loose_errors: Vec<f32>,
}

impl Instances {
    /// Lists the parts of all `patches`, and no loose triangles. Buffers are used again; nothing is allocated once they have grown.
    pub fn update(&mut self, tree: &Hierarchy, parts: &Parts, patches: &[ActivePatch]) {
        self.morphs = false;
        self.weights.clear();
        self.loose.clear();
        self.loose_tiles = 0;
        self.loose_weights.clear();
        self.errors.clear();
        self.loose_errors.clear();
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

    /// Adds the weights of the `patches` that were listed last, if the selection that they are of morphs.
    pub fn weigh(&mut self, tree: &Hierarchy, parts: &Parts, patches: &[ActivePatch], selection: &Selection) {
        self.morphs = selection.morphs();
        if !self.morphs {
            return;
        }
        self.weights.resize(self.data.len(), PatchWeights::zeroed());
        self.in_places(parts, patches, |list, patch, places| {
            let Some(weights) = selection.weights(tree, patch.id) else { return };
            places.into_iter().for_each(|(_, place)| list.weights[place] = weights);
        });
    }

    /// Notes how far off the parts of the `patches` that were listed last are, in multiples of whatever error is of interest;
    /// `off` says it of the four sides of a patch. A strip is as far off as the worse of its two sides.
    pub fn rate(&mut self, parts: &Parts, patches: &[ActivePatch], off: impl Fn(ActivePatch) -> [f32; 4]) {
        self.errors.resize(self.data.len(), 0.0);
        self.in_places(parts, patches, |list, patch, places| {
            let off = off(patch);
            places.into_iter().for_each(|(part, place)| list.errors[place] = worst(part, off));
        });
    }

    /// The parts of each of the `patches` that were listed last, with the places of their instances.
    fn in_places(
        &mut self,
        parts: &Parts,
        patches: &[ActivePatch],
        mut each: impl FnMut(&mut Self, ActivePatch, [(Part, usize); 8]),
    ) {
        // The cursors stand behind the last instance of their part: backwards, and back.
        for &patch in patches.iter().rev() {
            let places = parts_of(patch.sides).map(|part| {
                let cursor = &mut self.cursor[parts.index(part)];
                *cursor -= 1;
                (part, *cursor as usize)
            });
            each(self, patch, places);
        }
        for patch in patches {
            parts_of(patch.sides).into_iter().for_each(|part| self.cursor[parts.index(part)] += 1);
        }
    }

    /// Lists the triangles of `patches` one by one, instead of those listed before: for patches that a hole takes triangles
    /// from. If the selection morphs, their weights too. Buffers are used again.
    pub fn update_loose(&mut self, drawn: &DrawnSurface<'_>, patches: &[ActivePatch]) {
        self.loose.clear();
        self.loose_weights.clear();
        for tiles in [true, false] {
            for &patch in patches {
                let step = drawn.tree.step(patch.id.level);
                for triangle in drawn.triangles(patch).filter(|t| matches!(t.part, Part::Tile(..)) == tiles) {
                    self.loose.extend(triangle.corners.map(|point| LooseVertex { point, step }));
                    if drawn.selection.morphs() {
                        self.loose_weights.extend(triangle.weights);
                    }
                }
            }
            if tiles {
                self.loose_tiles = self.loose.len() as u32;
            }
        }
    }

    /// The same error for all instances and loose triangles: what colours cost does not depend on which they are.
    #[cfg(feature = "cost")]
    pub(crate) fn rate_alike(&mut self, error: f32) {
        self.errors = vec![error; self.data.len()];
        self.loose_errors = vec![error; self.loose.len()];
    }

    /// [`Instances::rate`] for the loose triangles of `patches`, which were listed last.
    pub fn rate_loose(
        &mut self,
        drawn: &DrawnSurface<'_>,
        patches: &[ActivePatch],
        off: impl Fn(ActivePatch) -> [f32; 4],
    ) {
        self.loose_errors.clear();
        for tiles in [true, false] {
            for &patch in patches {
                let off = off(patch);
                let triangles = drawn.triangles(patch).filter(|t| matches!(t.part, Part::Tile(..)) == tiles);
                self.loose_errors.extend(triangles.flat_map(|triangle| [worst(triangle.part, off); 3]));
            }
        }
    }

    /// Whether heights blend between levels: whether there are weights.
    #[must_use]
    pub fn morphs(&self) -> bool {
        self.morphs
    }

    /// The weights of the instances, in their order; none unless the selection morphs.
    #[must_use]
    pub fn weights(&self) -> &[PatchWeights] {
        &self.weights
    }

    /// The weights of the loose corners, in their order; none unless the selection morphs.
    #[must_use]
    pub fn loose_weights(&self) -> &[f32] {
        &self.loose_weights
    }

    /// How far off the instances are, in their order; none unless they were rated.
    #[must_use]
    pub fn errors(&self) -> &[f32] {
        &self.errors
    }

    /// How far off the triangles of the loose corners are, in their order; none unless they were rated.
    #[must_use]
    pub fn loose_errors(&self) -> &[f32] {
        &self.loose_errors
    }

    /// Corners of the triangles that are drawn by themselves, three by three.
    #[must_use]
    pub fn loose(&self) -> &[LooseVertex] {
        &self.loose
    }

    /// Which of the loose corners belong to tiles, and which to strips.
    #[must_use]
    pub fn loose_ranges(&self) -> [Range<u32>; 2] {
        [0..self.loose_tiles, self.loose_tiles..self.loose.len() as u32]
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

    /// Triangles that drawing all instances takes. Loose ones come on top.
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

/// How far off a part is, by its sides.
fn worst(part: Part, off: [f32; 4]) -> f32 {
    match part {
        Part::Tile(side, _) => off[side as usize],
        Part::Strip(side, ..) => off[side as usize].max(off[side.next() as usize]),
    }
}
