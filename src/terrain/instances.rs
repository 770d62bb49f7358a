//! From active patches to what a renderer draws: one list of instances per part.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use super::hierarchy::Hierarchy;
use super::morph::PatchWeights;
use super::parts::{Parts, parts_of};
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

/// Instances sorted by part, ready for one instanced draw call per part in use.
#[derive(Debug, Clone, Default)]
pub struct Instances {
    data: Vec<Instance>,
    /// For each part in use: its number (see [`Parts::index`]) and its instances.
    ranges: Vec<(usize, Range<u32>)>,
    triangles: u64,
    cursor: Vec<u32>,
    /// One per instance if the selection morphs, otherwise none.
    weights: Vec<PatchWeights>,
}

impl Instances {
    /// Lists the parts of all `patches`. Buffers are used again; nothing is allocated once they have grown.
    pub fn update(&mut self, tree: &Hierarchy, parts: &Parts, patches: &[ActivePatch]) {
        self.weights.clear();
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
        if !selection.morphs() {
            return;
        }
        self.weights.resize(self.data.len(), PatchWeights::zeroed());
        // The cursors stand behind the last instance of their part: backwards.
        for patch in patches.iter().rev() {
            let Some(weights) = selection.weights(tree, patch.id) else { continue };
            for part in parts_of(patch.sides) {
                let cursor = &mut self.cursor[parts.index(part)];
                *cursor -= 1;
                self.weights[*cursor as usize] = weights;
            }
        }
    }

    /// The weights of the instances, in their order; none unless the selection morphs.
    #[must_use]
    pub fn weights(&self) -> &[PatchWeights] {
        &self.weights
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
}
