//! Choosing the level of detail: which patches are active and which resolution each of their sides has.
//!
//! A [`Metric`] says of one patch alone whether it has to be split or, if not, which resolution each of its sides
//! demands. That leaves neighbours in disagreement. Agreement is *made*, by one mechanism for every metric:
//!
//! # The rule
//!
//! Two active patches that share a piece of a side must put the same vertices on it:
//!
//! 1. patches of one level: the side takes the finer of the two demands;
//! 2. a patch beside one that is split into active children: its side has r_max, theirs have r_min (R · r_min = r_max,
//!    so the steps are equal). If a child demands more than r_min there, **the coarser patch is split**;
//! 3. a patch beside one that is two or more levels finer is split.
//!
//! A demand is only ever met or exceeded, never lowered, so what a metric promised of a patch is kept as long as its
//! errors do not grow with resolution.
//!
//! # Why it ends, does not depend on the order, and needs one visit per patch
//!
//! Splits are never taken back and the tree is finite, so it ends. Each forced split is necessary in any conforming
//! mesh that refines the demands; the result is the least such mesh, whatever the order. Rules 2 and 3 are checked from
//! the finer side, when an active patch is visited: its neighbour of the same level either exists (active: rule 1; split:
//! that one's children look at us) or lies inside a coarser patch, which is split until it is our level's parent and our
//! demand on that side is r_min, or until the neighbour exists. Splitting changes nothing for patches that were visited
//! before: towards them the coarser patch only became finer, which no rule of theirs forbids, and its new children are
//! visited in their turn. A leaf is never forced: nothing is finer than it.

use super::hierarchy::{Hierarchy, PatchId};
use super::morph::{Graded, PatchWeights, Urgency, weight};
use super::parts::{Resolutions, Side};

/// What a metric asks of one patch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Demand {
    /// Too coarse even at r_max. (A leaf that asks for it is drawn at r_max.)
    Split,
    /// Fine enough with these indices of resolutions on its north, east, south and west side.
    Keep([u8; 4]),
}

/// Decides the detail of a patch by itself.
pub trait Metric {
    /// What `patch` needs.
    fn demand(&self, tree: &Hierarchy, patch: PatchId) -> Demand;
}

/// Everything at the finest resolution of the finest level: every cell of the map.
#[derive(Debug, Clone, Copy)]
pub struct Full;

impl Metric for Full {
    fn demand(&self, _: &Hierarchy, _: PatchId) -> Demand {
        Demand::Split
    }
}

/// The metric of Livny, Kogan and El-Sana: a side of length l at distance d needs ε · r_max triangles, ε = ρ · l / d; a
/// patch with ε > 1 on any side is split.
///
/// Lengths are measured in lattice units (cells), d to the whole side as a segment, and the number is rounded up to the
/// next resolution. For ρ ≥ 1 the patches then agree by themselves; see the project's notes on the algorithm. With cells
/// that are not square, lattice units are what keeps that true.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Precision {
    /// ρ: positive; 1 is coarse, 4 is fine. +∞ is full detail.
    pub precision: f64,
    /// Where distances are measured from.
    pub eye: LodEye,
}

/// The eye as the metrics see it, in lattice units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LodEye {
    /// A point (u, v) at a height above the ground below it, all in cells. One height for the whole frame, or neighbours
    /// would disagree.
    Point {
        /// Column coordinate.
        u: f64,
        /// Row coordinate.
        v: f64,
        /// Height above the ground below the eye, in cells.
        height: f64,
    },
    /// The same distance to everything, in cells: for orthographic cameras.
    Everywhere {
        /// The distance.
        distance: f64,
    },
}

impl Precision {
    fn demand_of_side(&self, resolutions: Resolutions, length: f64, squared_distance: f64) -> Option<u8> {
        let epsilon = self.precision * length / squared_distance.sqrt();
        // 0/0 (a side of no length at no distance) is not "> 1": it needs nothing.
        if epsilon > 1.0 {
            return None;
        }
        let needed = epsilon * f64::from(resolutions.max());
        let mut index = 0;
        while f64::from(resolutions.get(index)) < needed && u32::from(index) + 1 < resolutions.count() {
            index += 1;
        }
        Some(index)
    }
}

impl Metric for Precision {
    fn demand(&self, tree: &Hierarchy, patch: PatchId) -> Demand {
        let size = f64::from(tree.size(patch.level));
        let [u0, v0] = tree.origin(patch).map(f64::from);
        let (u1, v1) = (u0 + size, v0 + size);
        let squares = match self.eye {
            LodEye::Everywhere { distance } => [distance * distance; 4],
            LodEye::Point { u, v, height } => {
                let outside = |x: f64, low: f64, high: f64| (low - x).max(x - high).max(0.0).powi(2);
                let (along_u, along_v) = (outside(u, u0, u1), outside(v, v0, v1));
                let h = height * height;
                [
                    along_u + (v - v0).powi(2) + h,
                    along_v + (u - u1).powi(2) + h,
                    along_u + (v - v1).powi(2) + h,
                    along_v + (u - u0).powi(2) + h,
                ]
            }
        };
        let mut needs = [0; 4];
        for (need, square) in needs.iter_mut().zip(squares) {
            match self.demand_of_side(tree.resolutions(), size, square) {
                Some(index) => *need = index,
                None => return Demand::Split,
            }
        }
        Demand::Keep(needs)
    }
}

/// A patch of the mesh to draw, with the resolution of each side.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ActivePatch {
    /// Which patch.
    pub id: PatchId,
    /// Indices of the resolutions of the north, east, south and west side.
    pub sides: [u8; 4],
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Node {
    /// Inside an active patch (or not looked at yet).
    Absent,
    Active,
    Split,
}

/// The active patches of a tree for one metric: a cut through the tree that tiles the map without T-junctions.
///
/// The value can be used again for the next frame: [`Selection::update`] allocates nothing once the buffers have grown.
///
/// # Example
///
/// ```
/// use seamount::terrain::{Hierarchy, LodEye, Precision, Resolutions, Selection};
///
/// let tree = Hierarchy::new([1024, 1024], Resolutions::new(8, 3)?);
/// let mut selection = Selection::new(&tree);
/// selection.update(&tree, &Precision { precision: 1.0, eye: LodEye::Point { u: 0.0, v: 0.0, height: 10.0 } });
/// let near = selection.patches(&tree).count();
/// selection.update(&tree, &Precision { precision: 1.0, eye: LodEye::Point { u: 0.0, v: 0.0, height: 1e6 } });
/// assert!(selection.patches(&tree).count() < near);
/// # Ok::<(), seamount::terrain::ResolutionsError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Selection {
    nodes: Vec<Node>,
    needs: Vec<[u8; 4]>,
    /// Patches made active, in the order of creation; those split later are skipped when listing.
    created: Vec<PatchId>,
    /// Nodes to set back to `Absent` before the next update.
    touched: Vec<PatchId>,
    pending: Vec<PatchId>,
    traversed: u32,
    forced: u32,
    /// Whether the weights are of this selection. They are made when a selection morphs first.
    morphing: bool,
    /// One per patch of the tree, 0 but for those listed.
    weights: Vec<f32>,
    weighed: Vec<PatchId>,
}

impl Selection {
    /// An empty selection for trees of this shape.
    #[must_use]
    pub fn new(tree: &Hierarchy) -> Self {
        Self {
            nodes: vec![Node::Absent; tree.len()],
            needs: vec![[0; 4]; tree.len()],
            created: Vec::new(),
            touched: Vec::new(),
            pending: Vec::new(),
            traversed: 0,
            forced: 0,
            morphing: false,
            weights: Vec::new(),
            weighed: Vec::new(),
        }
    }

    /// The selection for one metric.
    #[must_use]
    pub fn of(tree: &Hierarchy, metric: &impl Metric) -> Self {
        let mut selection = Self::new(tree);
        selection.update(tree, metric);
        selection
    }

    /// Chooses anew. The tree has to have the shape that the selection was made for.
    pub fn update(&mut self, tree: &Hierarchy, metric: &impl Metric) {
        debug_assert_eq!(self.nodes.len(), tree.len(), "a selection belongs to one tree");
        for patch in self.touched.drain(..) {
            self.nodes[tree.index(patch)] = Node::Absent;
        }
        self.created.clear();
        self.morphing = false;
        self.traversed = 0;
        self.forced = 0;
        self.pending.extend(tree.roots());
        self.descend(tree, metric);
        // `created` grows while it is walked: patches that come from a forced split are visited too.
        let mut next = 0;
        while let Some(&patch) = self.created.get(next) {
            next += 1;
            if self.nodes[tree.index(patch)] == Node::Active {
                self.agree(tree, metric, patch);
            }
        }
    }

    /// Chooses anew, with weights for heights that blend between levels; see [`super::morph`]. The tree has to have two
    /// resolutions.
    ///
    /// # Example
    ///
    /// ```
    /// use seamount::terrain::{Hierarchy, LodEye, Precision, Resolutions, Selection};
    ///
    /// let tree = Hierarchy::new([1024, 1024], Resolutions::new(8, 2)?);
    /// let root = tree.roots().next().unwrap();
    /// let mut selection = Selection::new(&tree);
    /// // e = 2 ρ · l / d: the refinement of the root, 1024 cells wide, is complete up to d = 2048, and none of it is left from 4096 on.
    /// for (distance, weight) in [(1000.0, 1.0), (2048.0, 1.0), (2730.7, 0.5), (4096.0, 0.0)] {
    ///     selection.update_morphing(&tree, &Precision { precision: 1.0, eye: LodEye::Everywhere { distance } });
    ///     let weights = selection.weights(&tree, root).unwrap();
    ///     assert!((weights.inside - weight).abs() < 1e-4);
    /// }
    /// # Ok::<(), seamount::terrain::ResolutionsError>(())
    /// ```
    pub fn update_morphing(&mut self, tree: &Hierarchy, urgency: &impl Urgency) {
        debug_assert_eq!(tree.resolutions().count(), 2, "patches with one refinement each");
        let mut weights = std::mem::take(&mut self.weights);
        weights.resize(tree.len(), 0.0);
        for patch in self.weighed.drain(..) {
            weights[tree.index(patch)] = 0.0;
        }
        // Patches in those that are not complete have none.
        self.pending.extend(tree.roots());
        while let Some(patch) = self.pending.pop() {
            let own = weight(urgency.urgency(tree, patch));
            if own > 0.0 {
                weights[tree.index(patch)] = own;
                self.weighed.push(patch);
            }
            if own >= 1.0 {
                self.pending.extend(tree.children(patch));
            }
        }
        self.update(tree, &Graded { weights: &weights });
        self.weights = weights;
        self.morphing = true;
    }

    /// How much of the refinement of a patch is drawn, if the selection was made with weights. Patches that share a side
    /// have the same weight there.
    #[must_use]
    pub fn weights(&self, tree: &Hierarchy, id: PatchId) -> Option<PatchWeights> {
        let weight = |id| self.weights.get(tree.index(id)).copied().unwrap_or(0.0);
        self.morphing.then(|| {
            let inside = weight(id);
            let side = |side| tree.neighbour(id, side).map_or(inside, |across| inside.max(weight(across)));
            PatchWeights { sides: Side::ALL.map(side), inside }
        })
    }

    /// Whether the selection was made with weights.
    #[must_use]
    pub fn morphs(&self) -> bool {
        self.morphing
    }

    /// Makes the pending patches active or splits them, as the metric says.
    fn descend(&mut self, tree: &Hierarchy, metric: &impl Metric) {
        while let Some(patch) = self.pending.pop() {
            self.traversed += 1;
            let index = tree.index(patch);
            self.touched.push(patch);
            match metric.demand(tree, patch) {
                Demand::Split if patch.level < tree.depth() => {
                    self.nodes[index] = Node::Split;
                    self.pending.extend(tree.children(patch));
                }
                demand => {
                    self.nodes[index] = Node::Active;
                    let finest = (tree.resolutions().count() - 1) as u8;
                    self.needs[index] = match demand {
                        Demand::Split => [finest; 4],
                        Demand::Keep(needs) => needs.map(|n| n.min(finest)),
                    };
                    self.created.push(patch);
                }
            }
        }
    }

    /// Rules 2 and 3, from the finer side.
    fn agree(&mut self, tree: &Hierarchy, metric: &impl Metric, patch: PatchId) {
        for side in Side::ALL {
            let Some(across) = tree.neighbour(patch, side) else {
                continue;
            };
            while self.nodes[tree.index(across)] == Node::Absent {
                let (coarser, levels) = self.active_above(tree, across);
                let need = self.needs[tree.index(patch)][side as usize];
                if levels == 1 && need == 0 {
                    break;
                }
                self.forced += 1;
                self.nodes[tree.index(coarser)] = Node::Split;
                self.pending.extend(tree.children(coarser));
                self.descend(tree, metric);
            }
        }
    }

    /// The active patch that contains an absent one, and how many levels up it is.
    fn active_above(&self, tree: &Hierarchy, patch: PatchId) -> (PatchId, u8) {
        let mut above = patch;
        while let Some(parent) = tree.parent(above) {
            above = parent;
            if self.nodes[tree.index(above)] != Node::Absent {
                break;
            }
        }
        (above, patch.level - above.level)
    }

    /// The active patches, in no particular order.
    pub fn patches<'a>(&'a self, tree: &'a Hierarchy) -> impl Iterator<Item = ActivePatch> + 'a {
        self.created.iter().filter_map(move |&id| self.active(tree, id))
    }

    /// The patch as it is drawn, if it is active.
    #[must_use]
    pub fn active(&self, tree: &Hierarchy, id: PatchId) -> Option<ActivePatch> {
        if self.nodes[tree.index(id)] != Node::Active {
            return None;
        }
        let finest = (tree.resolutions().count() - 1) as u8;
        let mut sides = self.needs[tree.index(id)];
        for side in Side::ALL {
            let Some(across) = tree.neighbour(id, side) else {
                continue;
            };
            let own = &mut sides[side as usize];
            *own = match self.nodes[tree.index(across)] {
                Node::Active => (*own).max(self.needs[tree.index(across)][side.opposite() as usize]),
                Node::Split => finest,
                Node::Absent => 0,
            };
        }
        Some(ActivePatch { id, sides })
    }

    /// Whether a patch is split, that is whether its children (or theirs) are active.
    #[inline]
    #[must_use]
    pub fn is_split(&self, tree: &Hierarchy, id: PatchId) -> bool {
        self.nodes[tree.index(id)] == Node::Split
    }

    /// Patches that were looked at.
    #[must_use]
    pub fn traversed(&self) -> u32 {
        self.traversed
    }

    /// Splits that no metric asked for, made so that neighbours agree.
    #[must_use]
    pub fn forced(&self) -> u32 {
        self.forced
    }
}

/// The lattice coordinates of the vertices that a patch puts on one of its sides, in order, clamped to the map.
///
/// Two neighbours that agree list the same points for the piece they share; tests and the cost report count those that
/// do not.
pub fn side_vertices(tree: &Hierarchy, patch: ActivePatch, side: Side) -> impl Iterator<Item = [u32; 2]> + use<> {
    let resolution = tree.resolutions().get(patch.sides[side as usize]);
    let size = tree.size(patch.id.level);
    let [u, v] = tree.origin(patch.id);
    let cells = tree.cells();
    (0..=resolution).map(move |k| {
        let t = k * (size / resolution);
        let [u, v] = match side {
            Side::North => [u + t, v],
            Side::East => [u + size, v + t],
            Side::South => [u + t, v + size],
            Side::West => [u, v + t],
        };
        [u.min(cells[0]), v.min(cells[1])]
    })
}
