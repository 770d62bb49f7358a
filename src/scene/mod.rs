//! The retained scene graph: nodes in a slot map, shared by several parents if so wished, edited through checked calls.
//!
//! A [`Scene`] owns all nodes. A node is named by a [`NodeKey`], one *occurrence* of it by a [`Path`], since a node may
//! have several parents. Edits keep the graph a directed acyclic graph whose inner nodes are groups; each edit raises
//! the version of what it changed, so that whatever was derived can tell whether it is current.

mod files;
mod font;
mod image;
mod input;
mod path;
mod resources;
mod sensor;
mod text;

use std::any::Any;
use std::collections::{HashMap, VecDeque};
use std::ops::{Deref, DerefMut};
use std::path::{Path as FilePath, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use slotmap::SlotMap;
use thiserror::Error;

pub(crate) use files::Shown;
pub use font::FontError;
pub(crate) use font::{DEFAULT_FONT, Ink, MOST_PIXELS, MOST_REACH, Typeface};
pub use image::{Image, ImageError, Pixels};
pub(crate) use input::regular;
pub use path::{NodePlace, Path};
pub use resources::Resources;
pub use sensor::{Sensor, Watched};
pub use text::TextError;

use self::files::Files;
use crate::action::{Index, IndexCache};
use crate::node::{ImageRef, Node, Role, Separator, Texture2};
use crate::terrain::SampleRect;

slotmap::new_key_type! {
    /// Names a node of one [`Scene`]. Keys of removed nodes are never used again.
    pub struct NodeKey;
}

/// Why an edit was refused. The scene is as it was.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum EditError {
    /// The key names no node of this scene (any more).
    #[error("the node was removed from the scene, or belongs to another one")]
    Removed,
    /// Only groups have children.
    #[error("{kind} is not a group: it can not have children")]
    NotAGroup {
        /// Kind of the would-be parent.
        kind: &'static str,
    },
    /// This kind of group takes only certain children.
    #[error("{parent} can not have {child} as a child: it takes {takes}")]
    WrongChild {
        /// Kind of the would-be parent.
        parent: &'static str,
        /// Kind of the would-be child.
        child: &'static str,
        /// What would be accepted.
        takes: String,
    },
    /// The child contains the parent.
    #[error("the edit would make a cycle: the child contains the parent")]
    Cycle,
    /// No such child.
    #[error("there is no child number {index}: the group has {count}")]
    NoSuchChild {
        /// The index asked for.
        index: usize,
        /// Number of children there are.
        count: usize,
    },
    /// Another node of the same file has this name.
    #[error("the name \"{0}\" is taken by another node")]
    NameTaken(String),
    /// What a File shows and the scene around it are two files, whatever else they are.
    #[error("the nodes belong to different files: what a File shows can not stand elsewhere, only the File can")]
    OtherFile,
    /// The root has to stay.
    #[error("the root can not be removed")]
    Root,
}

/// Why heights could not be changed. The scene is as it was.
#[derive(Debug, Clone, Error)]
#[non_exhaustive]
pub enum SetHeightsError {
    /// The key names no texture of this scene.
    #[error("the node is no Texture2 of this scene: name the texture that carries the heights")]
    NoTexture,
    /// The texture has no image.
    #[error("the texture has neither an image nor a file name: there are no heights to change")]
    NoImage,
    /// The image could not be had, or the rectangle or its samples do not fit it.
    #[error(transparent)]
    Image(#[from] ImageError),
}

/// Where in its file a node was written. Lines and columns count from 1, columns in characters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Position {
    /// Line, from 1.
    pub line: usize,
    /// Column, from 1.
    pub column: usize,
}

impl std::fmt::Display for Position {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}:{}", self.line, self.column)
    }
}

#[derive(Debug)]
struct Slot {
    node: Box<dyn Node>,
    children: Vec<NodeKey>,
    /// One entry per occurrence as a child.
    parents: Vec<NodeKey>,
    name: Option<String>,
    version: u64,
    /// Version of the newest change at or below this node.
    subtree_version: u64,
    /// Number of the file that it belongs to; 0 is the scene's own.
    file: usize,
    position: Option<Position>,
}

/// A scene graph with the resources it refers to.
///
/// # Example
///
/// ```
/// use seamount::prelude::*;
///
/// let mut scene = Scene::new();
/// let root = scene.root();
/// scene.add(root, PerspectiveCamera::default())?;
/// let box_group = scene.add(root, Separator::default())?;
/// let cube = scene.add(box_group, Cube { width: 4.0, ..Cube::default() })?;
/// scene.set_name(cube, "box")?;
///
/// // The same cube once more, somewhere else: a node may have several parents.
/// let other = scene.add(root, Separator::default())?;
/// scene.add(other, Transform { translation: DVec3::new(10.0, 0.0, 0.0), ..Transform::default() })?;
/// scene.add_child(other, cube)?;
///
/// // Changes go through a guard, which raises the version.
/// if let Some(mut cube) = scene.edit::<Cube>(cube) {
///     cube.height = 3.0;
/// }
/// let bounds = BoundingBoxAction::default().apply(&scene)?.expect("not empty");
/// assert_eq!(bounds.max, DVec3::new(12.0, 1.5, 1.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Scene {
    id: u64,
    slots: SlotMap<NodeKey, Slot>,
    root: NodeKey,
    files: Files,
    version: u64,
    resources: Resources,
    /// The last edits: what was edited, and the version that came of it.
    edits: VecDeque<(u64, NodeKey)>,
    /// All edits that gave a later version are in `edits`.
    edits_from: u64,
    index: IndexCache,
}

/// Most edits that are remembered. Whoever asks less often looks at all of the scene again.
const EDITS: usize = 256;

static NEXT_ID: AtomicU64 = AtomicU64::new(1);

impl Default for Scene {
    fn default() -> Self {
        Self::new()
    }
}

impl Scene {
    /// A scene whose root is an empty [`Separator`].
    #[must_use]
    pub fn new() -> Self {
        Self::with_root(Separator::default())
    }

    /// A scene with the given root.
    #[must_use]
    pub fn with_root(node: impl Node) -> Self {
        let mut slots = SlotMap::with_key();
        let root = slots.insert(Slot::new(Box::new(node)));
        let id = NEXT_ID.fetch_add(1, Ordering::Relaxed);
        Self {
            id,
            slots,
            root,
            files: Files::default(),
            version: 1,
            resources: Resources::default(),
            edits: VecDeque::with_capacity(EDITS),
            edits_from: 1,
            index: IndexCache::default(),
        }
    }

    /// The root of the graph.
    #[must_use]
    pub fn root(&self) -> NodeKey {
        self.root
    }

    /// Makes another node the root. The old root stays in the scene.
    ///
    /// # Errors
    ///
    /// When the key names no node, or one that a File shows.
    pub fn set_root(&mut self, key: NodeKey) -> Result<(), EditError> {
        if self.slot(key)?.file != 0 {
            return Err(EditError::OtherFile);
        }
        self.root = key;
        self.version += 1;
        self.edits_from = self.version;
        Ok(())
    }

    /// Number of nodes, whether reachable from the root or not.
    #[must_use]
    pub fn len(&self) -> usize {
        self.slots.len()
    }

    /// Never true: there is always a root.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.slots.is_empty()
    }

    /// Tells this scene from all others of the process.
    #[must_use]
    pub fn id(&self) -> u64 {
        self.id
    }

    /// Raised by every edit of the scene.
    #[must_use]
    pub fn version(&self) -> u64 {
        self.version
    }

    /// The decoded images and what is derived from them.
    #[must_use]
    pub fn resources(&self) -> &Resources {
        &self.resources
    }

    /// The file that the scene was read from. File names in the scene are relative to its folder.
    #[must_use]
    pub fn source(&self) -> Option<&FilePath> {
        self.files.path(0)
    }

    /// Says which file the scene belongs to; file names in the scene are relative to its folder. When that changes, scene files that
    /// are shown have to be loaded anew ([`load_files`](crate::format::load_files)).
    pub fn set_source(&mut self, path: impl Into<PathBuf>) {
        let own = self.slots.iter().filter(|(_, slot)| slot.file == 0).map(|(key, _)| key);
        self.files.set_path(path.into(), own);
        self.version += 1;
        self.edits_from = self.version;
    }

    fn slot(&self, key: NodeKey) -> Result<&Slot, EditError> {
        self.slots.get(key).ok_or(EditError::Removed)
    }

    /// Puts a node into the scene without a parent.
    pub fn insert(&mut self, node: impl Node) -> NodeKey {
        self.insert_boxed(Box::new(node))
    }

    /// [`Scene::insert`] for a node whose type is not known.
    pub fn insert_boxed(&mut self, node: Box<dyn Node>) -> NodeKey {
        self.insert_of(0, node)
    }

    /// Puts a node of a file into the scene.
    pub(crate) fn insert_of(&mut self, file: usize, node: Box<dyn Node>) -> NodeKey {
        self.version += 1;
        let mut slot = Slot::new(node);
        slot.file = file;
        slot.version = self.version;
        slot.subtree_version = self.version;
        self.slots.insert(slot)
    }

    /// Puts a node into the scene as the last child of `parent`, and into the same file.
    ///
    /// # Errors
    ///
    /// As for [`Scene::insert_child`].
    pub fn add(&mut self, parent: NodeKey, node: impl Node) -> Result<NodeKey, EditError> {
        self.check_child(parent, &node)?;
        let key = self.insert_of(self.slot(parent)?.file, Box::new(node));
        self.add_child(parent, key)?;
        Ok(key)
    }

    /// Makes `child` the last child of `parent`. It may have other parents, and occur more than once under one.
    ///
    /// # Errors
    ///
    /// As for [`Scene::insert_child`].
    pub fn add_child(&mut self, parent: NodeKey, child: NodeKey) -> Result<(), EditError> {
        let count = self.slot(parent)?.children.len();
        self.insert_child(parent, count, child)
    }

    /// Makes `child` child number `index` of `parent`.
    ///
    /// # Errors
    ///
    /// When a key names no node, `parent` is not a group that takes such a child, only one of them is shown by a File, `index`
    /// is beyond the children, or `child` contains `parent`.
    pub fn insert_child(&mut self, parent: NodeKey, index: usize, child: NodeKey) -> Result<(), EditError> {
        self.check_child(parent, self.slot(child)?.node.as_ref())?;
        let slot = self.slot(parent)?;
        if slot.file != self.slot(child)?.file {
            return Err(EditError::OtherFile);
        }
        let count = slot.children.len();
        if index > count {
            return Err(EditError::NoSuchChild { index, count });
        }
        // What has no children contains nothing but itself.
        if child == parent || !self.children(child).is_empty() && self.contains(child, parent) {
            return Err(EditError::Cycle);
        }
        self.slots[parent].children.insert(index, child);
        self.slots[child].parents.push(parent);
        self.touch(parent);
        Ok(())
    }

    fn check_child(&self, parent: NodeKey, child: &dyn Node) -> Result<(), EditError> {
        let parent = self.slot(parent)?;
        let info = parent.node.info();
        let Some(rule) = &info.children else {
            return Err(EditError::NotAGroup { kind: info.kind });
        };
        if rule.accepts(child.info().kind) {
            Ok(())
        } else {
            Err(EditError::WrongChild { parent: info.kind, child: child.info().kind, takes: rule.describe() })
        }
    }

    /// Whether `ancestor` is `node` or contains it. Climbs from `node`, so the cost is that of its ancestors.
    #[must_use]
    pub fn contains(&self, ancestor: NodeKey, node: NodeKey) -> bool {
        self.way(ancestor, node).is_some()
    }

    /// The nodes from `ancestor` down to `node` on one of the ways; `None` if there is none.
    fn way(&self, ancestor: NodeKey, node: NodeKey) -> Option<Vec<NodeKey>> {
        // The node below each on the way that it was found by.
        let mut below: HashMap<NodeKey, NodeKey> = HashMap::new();
        let mut pending = vec![node];
        while let Some(key) = pending.pop() {
            if key == ancestor {
                let mut way = vec![key];
                while let Some(&next) = way.last().and_then(|last| below.get(last)) {
                    way.push(next);
                }
                return Some(way);
            }
            for &parent in self.parents(key) {
                below.entry(parent).or_insert_with(|| {
                    pending.push(parent);
                    key
                });
            }
        }
        None
    }

    /// Takes child number `index` from `parent` and returns its key. The node stays in the scene.
    ///
    /// # Errors
    ///
    /// When `parent` names no node or has no such child.
    pub fn remove_child(&mut self, parent: NodeKey, index: usize) -> Result<NodeKey, EditError> {
        let count = self.slot(parent)?.children.len();
        if index >= count {
            return Err(EditError::NoSuchChild { index, count });
        }
        let child = self.slots[parent].children.remove(index);
        if let Some(slot) = self.slots.get_mut(child)
            && let Some(at) = slot.parents.iter().position(|&p| p == parent)
        {
            slot.parents.swap_remove(at);
        }
        self.touch(parent);
        Ok(child)
    }

    /// Removes a node from the scene and from all its parents. Its children stay, without this parent.
    ///
    /// # Errors
    ///
    /// When the key names no node, or the root.
    pub fn remove(&mut self, key: NodeKey) -> Result<Box<dyn Node>, EditError> {
        if key == self.root {
            return Err(EditError::Root);
        }
        self.slot(key)?;
        self.touch(key);
        let Some(slot) = self.slots.remove(key) else {
            return Err(EditError::Removed);
        };
        for parent in slot.parents {
            // Who asks what was edited finds the node gone, but not those it is gone from.
            self.note_edit(parent);
            if let Some(parent) = self.slots.get_mut(parent) {
                parent.children.retain(|&c| c != key);
            }
        }
        for child in slot.children {
            if let Some(child) = self.slots.get_mut(child) {
                child.parents.retain(|&p| p != key);
            }
        }
        if let Some(name) = slot.name {
            self.files.names_mut(slot.file).remove(&name);
        }
        self.resources.forget_node(key);
        Ok(slot.node)
    }

    /// A node whatever its type.
    #[must_use]
    pub fn node(&self, key: NodeKey) -> Option<&dyn Node> {
        self.slots.get(key).map(|s| s.node.as_ref())
    }

    /// A node of known type; `None` if the key names no node or one of another type.
    #[must_use]
    pub fn get<T: Node>(&self, key: NodeKey) -> Option<&T> {
        let node: &dyn Any = self.node(key)?;
        node.downcast_ref()
    }

    /// A node of known type to change. When the guard is dropped the versions of the node and of all that contain it are
    /// raised.
    #[must_use]
    pub fn edit<T: Node>(&mut self, key: NodeKey) -> Option<Edit<'_, T>> {
        self.get::<T>(key)?;
        Some(Edit { scene: self, key, node: std::marker::PhantomData })
    }

    /// Gives the image of a texture, which carries the heights of a terrain for example, other pixels within a rectangle: row
    /// by row from its north-west corner, at the depth of the image (16-bit grey for a 16-bit file). From then on the texture
    /// has an image in memory of its own; the file, and other textures that show the same, are as they were.
    ///
    /// All that is derived from the heights is brought up to date with the blocks and patches that the rectangle touches, not
    /// from scratch: the min/max tree, the bounds of errors. Textures on the graphics device are sent anew as a whole when
    /// the scene is drawn next. In a map with voids, or where the new samples are voids, filling starts over, as it reaches
    /// far; so its cost is that of the map. Who still holds the heights of before, such as a frame in another thread, keeps
    /// them: they are copied then. In a frozen [`View`](crate::action::View) detail is chosen once more.
    ///
    /// # Errors
    ///
    /// When the node is no texture, its image can not be had, the rectangle lies beyond it, or the number or kind of the
    /// pixels is wrong.
    ///
    /// ```
    /// use seamount::prelude::*;
    /// use seamount::terrain::SampleRect;
    ///
    /// let mut scene = Scene::new();
    /// let root = scene.root();
    /// let flat = Image::new(9, 9, Pixels::Gray16(vec![100; 81]))?;
    /// let heights = scene.add(root, Texture2::from_image(flat))?;
    /// scene.add(root, SeamlessTerrain { scale: 8.0, max_height: 65535.0, ..SeamlessTerrain::default() })?;
    ///
    /// // Raise a hill in the middle.
    /// let hill = SampleRect { column: 3, row: 3, columns: 3, rows: 3 };
    /// scene.set_heights(heights, hill, &Pixels::Gray16(vec![110, 120, 110, 120, 150, 120, 110, 120, 110]))?;
    /// let bounds = BoundingBoxAction::default().apply(&scene)?.expect("not empty");
    /// assert_eq!((bounds.min.z, bounds.max.z), (100.0, 150.0));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn set_heights(&mut self, texture: NodeKey, rect: SampleRect, pixels: &Pixels) -> Result<(), SetHeightsError> {
        let node = self.get::<Texture2>(texture).ok_or(SetHeightsError::NoTexture)?;
        let image = match &node.image {
            Some(image) => Arc::clone(&image.0),
            None if node.filename.is_empty() => return Err(SetHeightsError::NoImage),
            None => self.resources.image(&self.resolve(texture, &node.filename))?,
        };
        // A file is still there for all who name it.
        let (before, from_file) = (image.id(), node.image.is_none());
        let shows = |node: &Texture2| node.image.as_ref().is_some_and(|image| image.0.id() == before);
        let used = from_file
            || self.slots.iter().any(|(key, slot)| {
                let node: &dyn Any = slot.node.as_ref();
                key != texture && node.downcast_ref().is_some_and(shows)
            });
        image.check(rect, pixels)?;
        // The node lets go of its image, so that it is copied only if somebody else holds it.
        let Some(mut node) = self.edit::<Texture2>(texture) else { return Err(SetHeightsError::NoTexture) };
        node.image = None;
        let edited = Arc::new(image.overwritten(rect, pixels)?);
        node.image = Some(ImageRef(Arc::clone(&edited)));
        drop(node);
        self.resources.edited(before, used, &edited, rect, pixels);
        Ok(())
    }

    /// A node of any type to change, by its fields.
    #[must_use]
    pub fn edit_node(&mut self, key: NodeKey) -> Option<&mut dyn Node> {
        self.touch(key);
        self.slots.get_mut(key).map(|s| s.node.as_mut())
    }

    /// Children of a node in order; empty for what is no group.
    #[must_use]
    pub fn children(&self, key: NodeKey) -> &[NodeKey] {
        self.slots.get(key).map_or(&[], |s| &s.children)
    }

    /// Parents of a node, one entry per occurrence.
    #[must_use]
    pub fn parents(&self, key: NodeKey) -> &[NodeKey] {
        self.slots.get(key).map_or(&[], |s| &s.parents)
    }

    /// One of the paths to a node: from the first of its parents, and so on up.
    pub(crate) fn some_path(&self, key: NodeKey) -> Path {
        let mut steps = vec![key];
        // Nothing contains itself, so the way up ends.
        while let Some(&parent) = steps.last().and_then(|&key| self.parents(key).first()) {
            steps.push(parent);
        }
        let mut path = Path::default();
        let mut above = None;
        for key in steps.into_iter().rev() {
            let index = above.and_then(|above| self.children(above).iter().position(|&child| child == key));
            path.push(key, index.unwrap_or(0));
            above = Some(key);
        }
        path
    }

    /// The version of the last edit of this node itself (its fields, name or list of children).
    #[must_use]
    pub fn node_version(&self, key: NodeKey) -> Option<u64> {
        self.slots.get(key).map(|s| s.version)
    }

    /// The version of the last edit of this node or anything below it.
    #[must_use]
    pub fn subtree_version(&self, key: NodeKey) -> Option<u64> {
        self.slots.get(key).map(|s| s.subtree_version)
    }

    /// What was edited after this version; `None` if that is not remembered.
    pub(crate) fn edits_since(&self, version: u64) -> Option<impl Iterator<Item = NodeKey> + '_> {
        let first = self.edits.partition_point(|&(edit, _)| edit <= version);
        (version >= self.edits_from).then(|| self.edits.range(first..).map(|&(_, key)| key))
    }

    /// Where all shapes are, if it can be had without a walk for each question.
    pub(crate) fn index(&self) -> Option<Arc<Index>> {
        self.index.get(self)
    }

    fn note_edit(&mut self, key: NodeKey) {
        if self.edits.len() >= EDITS
            && let Some((version, _)) = self.edits.pop_front()
        {
            self.edits_from = version;
        }
        self.edits.push_back((self.version, key));
    }

    fn touch(&mut self, key: NodeKey) {
        self.version += 1;
        let version = self.version;
        self.note_edit(key);
        if let Some(slot) = self.slots.get_mut(key) {
            slot.version = version;
        }
        let mut pending = vec![key];
        while let Some(key) = pending.pop() {
            if let Some(slot) = self.slots.get_mut(key)
                && slot.subtree_version != version
            {
                slot.subtree_version = version;
                pending.extend_from_slice(&slot.parents);
            }
        }
    }

    /// The name of a node, as `Def` gives it in a file.
    #[must_use]
    pub fn name(&self, key: NodeKey) -> Option<&str> {
        self.slots.get(key)?.name.as_deref()
    }

    /// The node with this name. What a File shows has names of its own, which a [`SearchAction`](crate::action::SearchAction)
    /// finds.
    #[must_use]
    pub fn find(&self, name: &str) -> Option<NodeKey> {
        self.files.names(0).get(name).copied()
    }

    /// All names that [`Scene::find`] knows, in alphabetical order.
    #[must_use]
    pub fn names(&self) -> Vec<&str> {
        let mut names: Vec<&str> = self.files.names(0).keys().map(String::as_str).collect();
        names.sort_unstable();
        names
    }

    /// Names a node, instead of the name it had.
    ///
    /// # Errors
    ///
    /// When the key names no node or another node of the same file has this name.
    pub fn set_name(&mut self, key: NodeKey, name: impl Into<String>) -> Result<(), EditError> {
        let name = name.into();
        let file = self.slot(key)?.file;
        let names = self.files.names_mut(file);
        match names.get(&name) {
            Some(&other) if other != key => return Err(EditError::NameTaken(name)),
            _ => {}
        }
        names.insert(name.clone(), key);
        if let Some(old) = self.slots[key].name.replace(name.clone())
            && old != name
        {
            names.remove(&old);
        }
        self.touch(key);
        Ok(())
    }

    /// Where the node was written in its file; see [`Scene::file`].
    #[must_use]
    pub fn position(&self, key: NodeKey) -> Option<Position> {
        self.slots.get(key)?.position
    }

    pub(crate) fn set_position(&mut self, key: NodeKey, position: Position) {
        if let Some(slot) = self.slots.get_mut(key) {
            slot.position = Some(position);
        }
    }

    pub(crate) fn role(&self, key: NodeKey) -> Option<Role<'_>> {
        self.slots.get(key).map(|s| s.node.role())
    }
}

impl Slot {
    fn new(node: Box<dyn Node>) -> Self {
        Self {
            node,
            children: Vec::new(),
            parents: Vec::new(),
            name: None,
            version: 0,
            subtree_version: 0,
            file: 0,
            position: None,
        }
    }
}

/// A node being changed; see [`Scene::edit`].
#[derive(Debug)]
pub struct Edit<'s, T: Node> {
    scene: &'s mut Scene,
    key: NodeKey,
    node: std::marker::PhantomData<&'s mut T>,
}

// The type and the presence of the node were checked when the guard was made, and it holds the scene exclusively.
#[allow(clippy::expect_used, reason = "checked when the guard was made")]
impl<T: Node> Deref for Edit<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        self.scene.get(self.key).expect("checked by Scene::edit")
    }
}

#[allow(clippy::expect_used, reason = "checked when the guard was made")]
impl<T: Node> DerefMut for Edit<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        let slot = self.scene.slots.get_mut(self.key).expect("checked by Scene::edit");
        let node: &mut dyn Any = slot.node.as_mut();
        node.downcast_mut().expect("checked by Scene::edit")
    }
}

impl<T: Node> Drop for Edit<'_, T> {
    fn drop(&mut self) {
        self.scene.touch(self.key);
    }
}
