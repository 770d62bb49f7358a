//! The older published rule for choosing detail, and how often it cracks: what ours is measured against.

use std::collections::HashMap;

use super::hierarchy::{Hierarchy, PatchId};
use super::parts::Side;
use super::selection::{ActivePatch, Demand, Metric, side_vertices};

/// The rule of a Coin3D node of 2012: ε = ρ · l / d with d the distance to the nearer *end* of a side, rounded to the *nearest*
/// resolution, and a precision by depth that its authors found by experiment against the cracks.
///
/// It does not agree between neighbours by itself: see [`disagreements`].
///
/// # Example
///
/// ```
/// use seamount::terrain::published::{NearestPrecision, disagreements, unforced};
/// use seamount::terrain::{Hierarchy, LodEye, Precision, Resolutions};
///
/// let tree = Hierarchy::new([1024; 2], Resolutions::new(4, 3)?);
/// let eye = [300.0, 500.0, 20.0];
/// let older = NearestPrecision { precision: 1.0, by_level: &[1.0, 0.9, 0.75], eye };
/// assert!(disagreements(&tree, unforced(&tree, &older)) > 0);
/// let ours = Precision { precision: 1.0, eye: LodEye::Point { u: eye[0], v: eye[1], height: eye[2] } };
/// assert_eq!(disagreements(&tree, unforced(&tree, &ours)), 0);
/// # Ok::<(), seamount::terrain::ResolutionsError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearestPrecision {
    /// ρ.
    pub precision: f64,
    /// Factors of ρ by level from the roots down; the last goes on. Not empty, or every patch is kept at its coarsest.
    pub by_level: &'static [f64],
    /// Column, row and height of the eye above the ground, in cells.
    pub eye: [f64; 3],
}

impl Metric for NearestPrecision {
    fn demand(&self, tree: &Hierarchy, patch: PatchId) -> Demand {
        let size = f64::from(tree.size(patch.level));
        let [u, v] = tree.origin(patch).map(f64::from);
        let corners = [[u, v], [u + size, v], [u + size, v + size], [u, v + size]];
        let distance =
            |p: [f64; 2]| ((p[0] - self.eye[0]).powi(2) + (p[1] - self.eye[1]).powi(2) + self.eye[2].powi(2)).sqrt();
        let tuned = self.by_level.get(usize::from(patch.level)).or(self.by_level.last()).copied().unwrap_or(0.0);
        let resolutions = tree.resolutions();
        let mut needs = [0; 4];
        for (k, need) in needs.iter_mut().enumerate() {
            let epsilon = self.precision * tuned * size / distance(corners[k]).min(distance(corners[(k + 1) % 4]));
            if epsilon > 1.0 {
                return Demand::Split;
            }
            let off = |i: &u8| (f64::from(resolutions.get(*i)) - epsilon * f64::from(resolutions.max())).abs();
            let nearest = (0..resolutions.count() as u8).min_by(|a, b| off(a).total_cmp(&off(b)));
            *need = nearest.unwrap_or(0);
        }
        Demand::Keep(needs)
    }
}

/// The patches as a metric wants each by itself, without anything that makes neighbours agree.
#[must_use]
pub fn unforced(tree: &Hierarchy, metric: &impl Metric) -> Vec<ActivePatch> {
    let finest = (tree.resolutions().count() - 1) as u8;
    let mut found = Vec::new();
    let mut pending: Vec<PatchId> = tree.roots().collect();
    while let Some(id) = pending.pop() {
        match metric.demand(tree, id) {
            Demand::Split if id.level < tree.depth() => pending.extend(tree.children(id)),
            Demand::Split => found.push(ActivePatch { id, sides: [finest; 4] }),
            Demand::Keep(sides) => found.push(ActivePatch { id, sides }),
        }
    }
    found
}

/// Steps along sides that only one of the two patches there takes: where the mesh is open. 0 for a mesh without cracks.
#[must_use]
pub fn disagreements(tree: &Hierarchy, patches: impl IntoIterator<Item = ActivePatch>) -> usize {
    let mut steps: HashMap<([u32; 2], [u32; 2]), u32> = HashMap::new();
    for patch in patches {
        for side in Side::ALL {
            let mut last = None;
            for vertex in side_vertices(tree, patch, side) {
                // Clamped to the border, a step may shrink to a point.
                if let Some(last) = last.replace(vertex)
                    && last != vertex
                {
                    *steps.entry((last, vertex)).or_default() += 1;
                }
            }
        }
    }
    let cells = tree.cells();
    let on_border = |a: &[u32; 2], b: &[u32; 2]| (0..2).any(|k| a[k] == b[k] && (a[k] == 0 || a[k] == cells[k]));
    steps.iter().filter(|((a, b), count)| **count != 2 && !on_border(a, b)).count()
}
