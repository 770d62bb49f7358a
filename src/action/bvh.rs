//! A tree of boxes, so that a ray need not be tried on everything.
//!
//! Built by the surface area heuristic over 16 bins (Wald, "On fast Construction of SAH-based Bounding Volume Hierarchies",
//! 2007), in f64. Boxes are grown by more than what rounding can move a hit, so that the tree never hides one.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing))]

use std::collections::HashMap;

use glam::DVec3;

use super::{Aabb, Ray};

/// Most entries of a leaf.
const LEAF: usize = 4;

/// Bins per split.
const BINS: usize = 16;

/// Deepest tree. Halving by number, which is what is left when bins do not separate, ends after 32 levels; bins are not used
/// below half of this.
const MAX_DEPTH: usize = 64;

#[derive(Debug, Clone, Copy)]
struct BvhNode {
    bounds: Aabb,
    /// A leaf: its first entry. Else: the second child; the first one follows its parent.
    first: u32,
    /// Number of entries; 0 for inner nodes.
    count: u32,
}

/// A bounding volume hierarchy over boxes that are given by number.
#[derive(Debug, Default)]
pub(crate) struct Bvh {
    nodes: Vec<BvhNode>,
    order: Vec<u32>,
}

impl Bvh {
    /// The tree over these boxes.
    pub(crate) fn new(boxes: &[Aabb]) -> Self {
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        let mut nodes = Vec::with_capacity(boxes.len());
        let centers: Vec<DVec3> = boxes.iter().map(Aabb::center).collect();
        // Pieces of `order` that are to become nodes, and the parent whose second child each is.
        let mut pending = vec![(0, order.len(), 0, None::<usize>)];
        while let Some((start, end, depth, parent)) = pending.pop() {
            let at = nodes.len();
            if let Some(parent) = parent.and_then(|parent: usize| nodes.get_mut(parent)) {
                let parent: &mut BvhNode = parent;
                parent.first = at as u32;
            }
            let Some(part) = order.get_mut(start..end) else { continue };
            let of = |k: &u32| boxes.get(*k as usize).copied();
            let Some(bounds) = part.iter().filter_map(of).reduce(|a, b| a.union(&b)) else { continue };
            if part.len() <= LEAF {
                nodes.push(BvhNode { bounds, first: start as u32, count: part.len() as u32 });
                continue;
            }
            nodes.push(BvhNode { bounds, first: 0, count: 0 });
            let middle = start + split(part, boxes, &centers, depth);
            pending.push((middle, end, depth + 1, Some(at)));
            pending.push((start, middle, depth + 1, None));
        }
        Self { nodes, order }
    }

    fn entries_of(&self, leaf: &BvhNode) -> &[u32] {
        let first = leaf.first as usize;
        self.order.get(first..first + leaf.count as usize).unwrap_or_default()
    }

    /// Calls `visit` with the entries whose boxes the ray meets in its range, in about the order of the ray. What it returns
    /// becomes the end of the range.
    #[inline]
    pub(crate) fn ray(&self, ray: &Ray, visit: impl FnMut(u32, f64) -> f64) {
        // A hit is computed from differences to the origin with a handful of roundings, each of half an EPSILON of numbers
        // that are not larger than those of box and origin together: 16 of them are more than all of these.
        self.ray_with(ray, 16.0, visit);
    }

    /// [`Bvh::ray`] with boxes grown by so many EPSILON of the sizes in play.
    #[inline]
    pub(crate) fn ray_with(&self, ray: &Ray, slack: f64, mut visit: impl FnMut(u32, f64) -> f64) {
        let Some(root) = self.nodes.first() else { return };
        let inverse = ray.direction.recip();
        let size = root.bounds.min.abs().max(root.bounds.max.abs());
        let slack = (size + ray.origin.abs()) * (slack * f64::EPSILON);
        let mut far = ray.far;
        let enter = |bounds: &Aabb, far: f64| {
            let a = (bounds.min - slack - ray.origin) * inverse;
            let b = (bounds.max + slack - ray.origin) * inverse;
            // 0 · ∞, a ray in the plane of a side, is no limit: min and max leave NaN out.
            let low = a.x.min(b.x).max(a.y.min(b.y)).max(a.z.min(b.z)).max(ray.near);
            let high = a.x.max(b.x).min(a.y.max(b.y)).min(a.z.max(b.z)).min(far);
            // Three roundings on each side (Ize, "Robust BVH Ray Traversal", JCGT 2013).
            (low <= high + high.abs() * (4.0 * f64::EPSILON)).then_some(low)
        };
        let mut stack = [(0u32, 0.0f64); MAX_DEPTH + 1];
        let mut depth = 0;
        let Some(mut low) = enter(&root.bounds, far) else { return };
        let mut at = 0u32;
        loop {
            let node = self.nodes.get(at as usize).filter(|_| low <= far + far.abs() * (4.0 * f64::EPSILON));
            let mut next = None;
            match node {
                Some(node) if node.count > 0 => {
                    for &entry in self.entries_of(node) {
                        far = visit(entry, far);
                    }
                }
                Some(node) => {
                    let child =
                        |at: u32| self.nodes.get(at as usize).and_then(|n| enter(&n.bounds, far)).map(|low| (at, low));
                    let (mut near, mut later) = (child(at + 1), child(node.first));
                    if let (Some((_, a)), Some((_, b))) = (near, later)
                        && b < a
                    {
                        std::mem::swap(&mut near, &mut later);
                    }
                    if near.is_none() {
                        std::mem::swap(&mut near, &mut later);
                    }
                    if let Some(later) = later
                        && let Some(slot) = stack.get_mut(depth)
                    {
                        *slot = later;
                        depth += 1;
                    }
                    next = near;
                }
                None => {}
            }
            if next.is_none() && depth > 0 {
                depth -= 1;
                next = stack.get(depth).copied();
            }
            let Some(found) = next else { return };
            (at, low) = found;
        }
    }
}

/// A tree of boxes whose boxes may change.
#[derive(Debug, Default)]
pub(crate) struct BoxTree {
    bvh: Bvh,
    /// What the entries of the tree are called outside.
    ids: Vec<usize>,
    boxes: Vec<Aabb>,
    /// The entry of each name.
    entries: HashMap<usize, u32>,
    /// The leaf of each entry, and the parent of each node; the root is its own.
    leaves: Vec<u32>,
    parents: Vec<u32>,
}

impl BoxTree {
    /// The tree over boxes with names.
    pub(crate) fn new(boxes: impl Iterator<Item = (usize, Aabb)>) -> Self {
        let (ids, boxes): (Vec<usize>, Vec<Aabb>) = boxes.unzip();
        let bvh = Bvh::new(&boxes);
        let entries = ids.iter().zip(0..).map(|(&id, entry)| (id, entry)).collect();
        let (mut leaves, mut parents) = (vec![0; boxes.len()], vec![0; bvh.nodes.len()]);
        for (at, node) in bvh.nodes.iter().enumerate() {
            if node.count > 0 {
                for &entry in bvh.entries_of(node) {
                    if let Some(leaf) = leaves.get_mut(entry as usize) {
                        *leaf = at as u32;
                    }
                }
            } else {
                for child in [at + 1, node.first as usize] {
                    if let Some(parent) = parents.get_mut(child) {
                        *parent = at as u32;
                    }
                }
            }
        }
        Self { bvh, ids, boxes, entries, leaves, parents }
    }

    /// The box around all.
    pub(crate) fn bounds(&self) -> Option<Aabb> {
        self.bvh.nodes.first().map(|root| root.bounds)
    }

    /// [`Bvh::ray_with`] with names.
    pub(crate) fn ray(&self, ray: &Ray, slack: f64, mut visit: impl FnMut(usize, f64) -> f64) {
        self.bvh.ray_with(ray, slack, |entry, far| self.ids.get(entry as usize).map_or(far, |&id| visit(id, far)));
    }

    /// Gives entries other boxes. The nodes above get exactly the boxes that a new tree would have around the same entries.
    pub(crate) fn refit(&mut self, boxes: impl Iterator<Item = (usize, Aabb)>) {
        for (id, bounds) in boxes {
            let Some(&entry) = self.entries.get(&id) else { continue };
            if let Some(slot) = self.boxes.get_mut(entry as usize) {
                *slot = bounds;
            }
            let mut at = self.leaves.get(entry as usize).copied().unwrap_or(0) as usize;
            while let Some(&node) = self.bvh.nodes.get(at) {
                let around = if node.count > 0 {
                    let of = |entry: &u32| self.boxes.get(*entry as usize).copied();
                    self.bvh.entries_of(&node).iter().filter_map(of).reduce(|a, b| a.union(&b))
                } else {
                    let of = |child: usize| self.bvh.nodes.get(child).map(|child| child.bounds);
                    of(at + 1).zip(of(node.first as usize)).map(|(a, b)| a.union(&b))
                };
                let Some(around) = around.filter(|around| *around != node.bounds) else { break };
                if let Some(node) = self.bvh.nodes.get_mut(at) {
                    node.bounds = around;
                }
                match self.parents.get(at) {
                    Some(&parent) if parent as usize != at => at = parent as usize,
                    _ => break,
                }
            }
        }
    }
}

/// Sorts a part into two and returns where the second begins, neither of them empty.
fn split(part: &mut [u32], boxes: &[Aabb], centers: &[DVec3], depth: usize) -> usize {
    let center = |k: u32| centers.get(k as usize).copied().unwrap_or_default();
    let Some(spread) = Aabb::of(part.iter().map(|&k| center(k))) else { return 0 };
    let size = spread.size();
    let axis = if size.x >= size.y && size.x >= size.z {
        0
    } else {
        usize::from(size.y >= size.z) + 2 * usize::from(size.y < size.z)
    };
    let scale = BINS as f64 / size[axis];
    let half = part.len() / 2;
    if scale.is_finite() && depth < MAX_DEPTH / 2 {
        let bin = |k: u32| (((center(k)[axis] - spread.min[axis]) * scale) as usize).min(BINS - 1);
        let mut bins: [(usize, Option<Aabb>); BINS] = [(0, None); BINS];
        for &k in part.iter() {
            if let (Some((count, bounds)), Some(b)) = (bins.get_mut(bin(k)), boxes.get(k as usize)) {
                *count += 1;
                *bounds = Some(bounds.map_or(*b, |bounds| bounds.union(b)));
            }
        }
        let cost = |(count, bounds): (usize, Option<Aabb>)| {
            let s = bounds.map_or(DVec3::ZERO, |b| b.size());
            count as f64 * (s.x * s.y + s.y * s.z + s.z * s.x)
        };
        let join = |a: (usize, Option<Aabb>), b: &(usize, Option<Aabb>)| {
            let bounds = match (a.1, b.1) {
                (Some(a), Some(b)) => Some(a.union(&b)),
                (a, b) => a.or(b),
            };
            (a.0 + b.0, bounds)
        };
        let best = (1..BINS)
            .filter_map(|cut| {
                let (before, after) = bins.split_at_checked(cut)?;
                let (before, after) = (before.iter().fold((0, None), join), after.iter().fold((0, None), join));
                (before.0 > 0 && after.0 > 0).then(|| (cut, before.0, cost(before) + cost(after)))
            })
            .min_by(|a, b| a.2.total_cmp(&b.2));
        if let Some((cut, count, _)) = best {
            // Kept in order on each side by nothing but the bins: which entry comes first does not matter.
            let (mut low, mut high) = (0, part.len());
            while low < high {
                if part.get(low).is_some_and(|&k| bin(k) < cut) {
                    low += 1;
                } else {
                    high -= 1;
                    part.swap(low, high);
                }
            }
            return count;
        }
    }
    part.select_nth_unstable_by(half, |&a, &b| center(a)[axis].total_cmp(&center(b)[axis]));
    half
}
