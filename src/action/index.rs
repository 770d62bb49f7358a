//! Every place of a shape with its box, kept from one question to the next.
//!
//! A walk over all of a large scene costs milliseconds, and most questions change nothing in between. The index is what a
//! walk finds: all shapes, each with path, State and box in the world, below a tree of boxes. It is made when it is needed
//! first, and brought up to date by what was edited since: each place of a group that keeps all changes to itself is a
//! *block*, and an edit reaches no further than the blocks around it, so that only these are walked again. What it answers is
//! what a walk answers, to the bit: unions of boxes do not depend on their order.
//!
//! Scenes in which the walk itself must decide are left to the walk: boxes that are reset, shapes that can not be had, groups
//! that look at the camera (for picks), properties that do something of their own.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing))]

use std::collections::HashSet;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use glam::DMat3;
use slotmap::SecondaryMap;

use super::bvh::BoxTree;
use super::walk::{Go, Visitor, walk_from};
use super::{Aabb, ActionError, ActionKind, Branches, Ray, ShapeContext, State};
use crate::node::{Reset, ResetTransform, Restores, Role, ShapeNode};
use crate::scene::{NodeKey, Path, Scene};

/// Most shapes and blocks that are kept; larger scenes are walked. A place takes some hundred bytes, most of it its State,
/// which it shares with its neighbours.
const MOST: usize = 1 << 18;

/// The index of a scene, or that there is none, for one version of it.
#[derive(Debug, Default)]
pub(crate) struct IndexCache(Mutex<Option<(Versions, Option<Arc<Index>>)>>);

/// What an index depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Versions {
    scene: u64,
    resources: u64,
}

/// A place of a shape.
#[derive(Debug)]
pub(crate) struct Place {
    pub(crate) path: Path,
    pub(crate) state: Arc<State>,
    pub(crate) bounds: Aabb,
    /// Whether its box does not decide whether a ray meets it: its map to the world magnifies rounding too much, or it says
    /// so itself.
    unboxed: bool,
    /// The next place of its block.
    next: Option<usize>,
}

/// A place of a group that restores all of the State.
#[derive(Debug)]
struct Block {
    path: Path,
    index: usize,
    /// The State that it is reached with.
    entry: Arc<State>,
    /// The blocks directly in it.
    inner: Vec<usize>,
    /// The first of its own shapes, those of inner blocks left out; each place says the next. Nearly every block has few, and a list
    /// would be an allocation of its own.
    first: Option<usize>,
    /// The block of the same node before this one and the one after it: copies can be many, and each can go by itself.
    before: Option<usize>,
    after: Option<usize>,
    /// What is here that needs care.
    special: Special,
}

#[derive(Debug, Clone, Copy, Default)]
struct Special {
    /// Nodes that reset the box.
    resets: u32,
    /// Groups that look at the camera.
    looks: u32,
    /// Shapes that are picked before others.
    on_top: u32,
    /// Cameras.
    cameras: u32,
}

/// See the module.
#[derive(Debug, Default)]
pub(crate) struct Index {
    blocks: Vec<Option<Block>>,
    free_blocks: Vec<usize>,
    /// The first block of each node; each block says the next.
    of_node: SecondaryMap<NodeKey, usize>,
    places: Vec<Option<Place>>,
    free_places: Vec<usize>,
    special: Special,
    /// Places that every ray is tried on.
    unboxed: HashSet<usize>,
    /// The box around all.
    bounds: Option<Aabb>,
    /// Made by the first ray or edit: a box alone needs none.
    tree: OnceLock<BoxTree>,
}

/// Largest condition number of a map for which boxes decide which shapes a ray is tried on.
const STEEP: f64 = 1e4;

/// Boxes are grown by this many EPSILON of the sizes in play: 16 roundings of each number on the way of a ray to local
/// coordinates, magnified by the condition number of the map.
const SLACK: f64 = 16.0 * STEEP;

impl Special {
    fn add(&mut self, other: Special) {
        self.resets += other.resets;
        self.looks += other.looks;
        self.on_top += other.on_top;
        self.cameras += other.cameras;
    }

    fn subtract(&mut self, other: Special) {
        self.resets -= other.resets;
        self.looks -= other.looks;
        self.on_top -= other.on_top;
        self.cameras -= other.cameras;
    }
}

impl IndexCache {
    /// The index for the scene as it is; nothing if only a walk can answer.
    pub(crate) fn get(&self, scene: &Scene) -> Option<Arc<Index>> {
        let now = Versions { scene: scene.version(), resources: scene.resources().version() };
        let cache = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let old = {
            let mut cache = cache();
            match &*cache {
                Some((then, index)) if *then == now => return index.clone(),
                _ => cache.take(),
            }
        };
        // The lock is not held meanwhile: the walk asks shapes that may be defined anywhere. Threads that come now make an
        // index of their own.
        let current = old.filter(|(then, _)| then.resources == now.resources).and_then(|(then, index)| {
            let mut index = index?;
            let matters = |key: &NodeKey| !matches!(scene.role(*key), Some(Role::Property(p)) if !p.moves_shapes());
            let edited: HashSet<NodeKey> = scene.edits_since(then.scene)?.filter(matters).collect();
            Arc::get_mut(&mut index)?.update(scene, &edited)?;
            Some(index)
        });
        let index = current.or_else(|| Index::new(scene).map(Arc::new));
        *cache() = Some((now, index.clone()));
        index
    }
}

impl Index {
    fn new(scene: &Scene) -> Option<Self> {
        let mut index = Self::default();
        index.walk(scene, &Path::default(), (scene.root(), 0), Arc::default())?;
        index.bounds = index.boxes().map(|(_, bounds)| bounds).reduce(|a, b| a.union(&b));
        Some(index)
    }

    /// The box of everything; the outer `None` if a walk has to tell.
    pub(crate) fn bounds(&self) -> Option<Option<Aabb>> {
        (self.special.resets == 0).then_some(self.bounds)
    }

    /// Calls `visit` with the places that a ray may meet in its range, in about the order of the ray; `visit` returns how far
    /// the ray goes from then on. False, without any call, if a walk has to tell.
    pub(crate) fn ray(&self, ray: &Ray, mut visit: impl FnMut(&Place) -> f64) -> bool {
        if self.special.looks > 0 {
            return false;
        }
        let mut far = ray.far;
        for &id in &self.unboxed {
            if let Some(Some(place)) = self.places.get(id) {
                far = visit(place);
            }
        }
        self.tree.get_or_init(|| BoxTree::new(self.boxes())).ray(&Ray { far, ..*ray }, SLACK, |id, far| {
            match self.places.get(id) {
                Some(Some(place)) if !place.unboxed => visit(place),
                _ => far,
            }
        });
        true
    }

    /// Whether some shapes are picked before others.
    pub(crate) fn on_top(&self) -> bool {
        self.special.on_top > 0
    }

    /// Whether there is any camera.
    pub(crate) fn has_camera(&self) -> bool {
        self.special.cameras > 0
    }

    /// Walks from a node and adds what is there; returns the places.
    fn walk(&mut self, scene: &Scene, path: &Path, start: (NodeKey, usize), state: Arc<State>) -> Option<Vec<usize>> {
        let mut collect = Collect { scene, index: self, open: Vec::new(), added: Vec::new(), visits: 0 };
        let walked = walk_from(scene, path, start, state, Branches::Possible, &mut collect);
        let added = std::mem::take(&mut collect.added);
        walked.ok()?;
        (self.places.len() + self.blocks.len() <= MOST).then_some(added)
    }

    /// Walks the blocks around edited nodes again. `None` if it can not be done, and the index is of no more use.
    fn update(&mut self, scene: &Scene, edited: &HashSet<NodeKey>) -> Option<()> {
        // The nearest blocks above each edited node.
        let mut stale: HashSet<NodeKey> = HashSet::new();
        let mut seen: HashSet<NodeKey> = HashSet::new();
        let mut pending: Vec<NodeKey> = edited.iter().copied().collect();
        while let Some(key) = pending.pop() {
            if !seen.insert(key) {
                continue;
            }
            if is_block(scene, key) {
                stale.insert(key);
            } else if key == scene.root() {
                return None;
            } else {
                pending.extend_from_slice(scene.parents(key));
            }
        }
        let mut ids: Vec<usize> = stale.iter().flat_map(|&key| self.blocks_of(key)).collect();
        // Outer ones first: what is in them goes and comes with them.
        ids.sort_by_key(|&id| self.blocks.get(id).and_then(Option::as_ref).map_or(0, |block| block.path.len()));
        let (mut gone, mut come) = (Vec::new(), Vec::new());
        for id in ids {
            // Gone with an outer one, and perhaps another block by now.
            let Some(Some(block)) = self.blocks.get(id) else { continue };
            let key = block.path.tail().filter(|key| stale.contains(key));
            let Some(key) = key else { continue };
            let (mut path, index, entry) = (block.path.clone(), block.index, Arc::clone(&block.entry));
            path.pop();
            self.remove(id, &mut gone);
            // The first block of this walk is the group's own, and takes the number that was freed last: its own.
            come.extend(self.walk(scene, &path, (key, index), entry)?);
        }
        gone.sort_unstable();
        come.sort_unstable();
        match self.tree.get_mut() {
            Some(tree) if gone == come => {
                tree.refit(come.iter().filter_map(|&id| Some((id, self.places.get(id)?.as_ref()?.bounds))));
            }
            _ => self.tree = BoxTree::new(self.boxes()).into(),
        }
        self.bounds = self.tree.get().and_then(BoxTree::bounds);
        Some(())
    }

    /// The blocks of a node.
    fn blocks_of(&self, key: NodeKey) -> impl Iterator<Item = usize> + '_ {
        let first = self.of_node.get(key).copied();
        std::iter::successors(first, |&id| self.blocks.get(id)?.as_ref()?.after)
    }

    /// Takes a block from those of its node.
    fn unlink(&mut self, id: usize) {
        let Some(Some(block)) = self.blocks.get(id) else { return };
        let (Some(key), before, after) = (block.path.tail(), block.before, block.after) else { return };
        if let Some(Some(next)) = after.and_then(|after| self.blocks.get_mut(after)) {
            next.before = before;
        }
        if let Some(Some(last)) = before.and_then(|before| self.blocks.get_mut(before)) {
            last.after = after;
        } else if let Some(after) = after {
            self.of_node.insert(key, after);
        } else {
            self.of_node.remove(key);
        }
    }

    /// Takes a block and all in it away.
    fn remove(&mut self, id: usize, gone: &mut Vec<usize>) {
        let mut all = vec![id];
        let mut next = 0;
        while let Some(&id) = all.get(next) {
            next += 1;
            self.unlink(id);
            let Some(block) = self.blocks.get_mut(id).and_then(Option::take) else { continue };
            all.extend_from_slice(&block.inner);
            self.special.subtract(block.special);
            let mut next = block.first;
            while let Some(place) = next {
                next = self.places.get_mut(place).and_then(Option::take).and_then(|place| place.next);
                self.unboxed.remove(&place);
                self.free_places.push(place);
                gone.push(place);
            }
        }
        self.free_blocks.extend(all.into_iter().rev());
    }

    /// The boxes of all places.
    fn boxes(&self) -> impl Iterator<Item = (usize, Aabb)> + '_ {
        self.places.iter().enumerate().filter_map(|(id, place)| Some((id, place.as_ref()?.bounds)))
    }
}

/// Whether a node is a group whose every place is a block.
fn is_block(scene: &Scene, key: NodeKey) -> bool {
    matches!(scene.role(key), Some(Role::Group(group)) if group.restores() == Restores::Everything)
}

/// Puts a value into a free slot, and says which.
fn put<T>(slots: &mut Vec<Option<T>>, free: &mut Vec<usize>, value: T) -> usize {
    match free.pop() {
        Some(id) if id < slots.len() => {
            if let Some(slot) = slots.get_mut(id) {
                *slot = Some(value);
            }
            id
        }
        _ => {
            slots.push(Some(value));
            slots.len() - 1
        }
    }
}

struct Collect<'s> {
    scene: &'s Scene,
    index: &'s mut Index,
    /// The blocks that the walk is in.
    open: Vec<usize>,
    /// Places that were added.
    added: Vec<usize>,
    /// Nodes that were met.
    visits: usize,
}

impl Collect<'_> {
    fn special(&mut self, special: Special) {
        self.index.special.add(special);
        if let Some(Some(block)) = self.open.last().and_then(|&id| self.index.blocks.get_mut(id)) {
            block.special.add(special);
        }
    }

    /// The index is of no use for this scene.
    fn refuse() -> ActionError {
        ActionError::TooLarge
    }
}

impl Visitor for Collect<'_> {
    fn action(&self) -> ActionKind {
        ActionKind::BoundingBox
    }

    fn enter(&mut self, path: &Path, state: &Arc<State>) -> Result<Go, ActionError> {
        let Some(key) = path.tail() else { return Ok(Go::On) };
        self.visits += 1;
        if self.visits > 8 * MOST {
            return Err(Self::refuse());
        }
        let role = self.scene.role(key);
        if let Some(Role::Property(property)) = role
            && [ActionKind::BoundingBox, ActionKind::RayPick].into_iter().any(|action| property.acts_on(action))
        {
            return Err(Self::refuse());
        }
        if let Some(Role::Group(group)) = role {
            if group.restores() == Restores::Everything {
                if self.index.blocks.len() > MOST {
                    return Err(Self::refuse());
                }
                let block = Block {
                    path: path.clone(),
                    index: path.indices().next_back().unwrap_or(0),
                    entry: Arc::clone(state),
                    inner: Vec::new(),
                    first: None,
                    before: None,
                    after: self.index.of_node.get(key).copied(),
                    special: Special::default(),
                };
                let id = put(&mut self.index.blocks, &mut self.index.free_blocks, block);
                if let Some(after) = self.index.of_node.insert(key, id)
                    && let Some(Some(after)) = self.index.blocks.get_mut(after)
                {
                    after.before = Some(id);
                }
                if let Some(Some(outer)) = self.open.last().and_then(|&outer| self.index.blocks.get_mut(outer)) {
                    outer.inner.push(id);
                }
                self.open.push(id);
            }
            if group.looks_at_camera() {
                self.special(Special { looks: 1, ..Special::default() });
            }
        } else if self.scene.get::<ResetTransform>(key).is_some_and(|r| r.what_to_reset != Reset::Transform) {
            self.special(Special { resets: 1, ..Special::default() });
        }
        Ok(Go::On)
    }

    fn leave(&mut self, path: &Path, state: &Arc<State>) -> Result<Go, ActionError> {
        if state.camera.as_ref().is_some_and(|camera| Some(camera.key) == path.tail()) {
            self.special(Special { cameras: 1, ..Special::default() });
        }
        if path.tail().is_some_and(|key| is_block(self.scene, key)) {
            self.open.pop();
        }
        Ok(Go::On)
    }

    fn shape(&mut self, shape: &dyn ShapeNode, path: &Path, state: &Arc<State>) -> Result<Go, ActionError> {
        let cx = ShapeContext::new(self.scene, state, path);
        let Some(bounds) = shape.bounds(&cx).map_err(|e| cx.error(e))? else { return Ok(Go::On) };
        let bounds = bounds.transformed(&state.model);
        if !bounds.min.is_finite() || !bounds.max.is_finite() || self.index.places.len() > MOST {
            return Err(Self::refuse());
        }
        if state.pick_style.on_top() {
            self.special(Special { on_top: 1, ..Special::default() });
        }
        let unboxed = steepness(state) > STEEP || shape.beyond_box();
        let place = Place { path: path.clone(), state: Arc::clone(state), bounds, unboxed, next: None };
        let id = put(&mut self.index.places, &mut self.index.free_places, place);
        if unboxed {
            self.index.unboxed.insert(id);
        }
        if let Some(Some(block)) = self.open.last().and_then(|&block| self.index.blocks.get_mut(block))
            && let Some(Some(place)) = self.index.places.get_mut(id)
        {
            place.next = block.first.replace(id);
        }
        self.added.push(id);
        Ok(Go::On)
    }
}

/// How much larger an error may become on the way to local coordinates and back: the condition number of the map, at least.
/// What is flat is not picked at all.
fn steepness(state: &State) -> f64 {
    let largest = |m: &DMat3| m.x_axis.abs().max(m.y_axis.abs()).max(m.z_axis.abs()).max_element();
    let m = &state.model.matrix3;
    if m.determinant() == 0.0 { 0.0 } else { 9.0 * largest(m) * largest(&m.inverse()) }
}
