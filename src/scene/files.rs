//! The files whose nodes are in a scene: its own, and those that File nodes show.
//!
//! A node belongs to one file, and an edge of the graph leads from one file to another only below a File node. So names of
//! nodes, and names of files, mean what they mean in the file in which they stand.

use std::collections::{HashMap, HashSet};
use std::path::{Path as FilePath, PathBuf};

use slotmap::SecondaryMap;

use super::{NodeKey, Scene, Slot};
use crate::node::File;

/// See the module.
#[derive(Debug)]
pub(super) struct Files {
    /// The scene's own is the first.
    all: Vec<Known>,
    /// The root of each file that was loaded, by the file's path without links.
    roots: HashMap<PathBuf, NodeKey>,
    /// The name by which each File node got what it shows.
    shown: SecondaryMap<NodeKey, String>,
}

#[derive(Debug, Default)]
struct Known {
    /// As it was named first; names in the file are relative to its folder.
    path: Option<PathBuf>,
    names: HashMap<String, NodeKey>,
}

/// What a File node shows, and the name by which it got it.
pub(crate) type Shown = Option<(NodeKey, String)>;

impl Default for Files {
    fn default() -> Self {
        Self { all: vec![Known::default()], roots: HashMap::new(), shown: SecondaryMap::new() }
    }
}

impl Files {
    pub(super) fn path(&self, file: usize) -> Option<&FilePath> {
        self.all[file].path.as_deref()
    }

    /// Says where the scene's own file is. If that is another folder, the names of files in it mean others, of which none is
    /// shown yet; `own` are the nodes of the scene's own file.
    pub(super) fn set_path(&mut self, path: PathBuf, own: impl Iterator<Item = NodeKey>) {
        if self.path(0).is_some_and(|before| before.parent() != path.parent()) {
            own.for_each(|key| drop(self.shown.remove(key)));
        }
        self.all[0].path = Some(path);
    }

    pub(super) fn names(&self, file: usize) -> &HashMap<String, NodeKey> {
        &self.all[file].names
    }

    pub(super) fn names_mut(&mut self, file: usize) -> &mut HashMap<String, NodeKey> {
        &mut self.all[file].names
    }
}

impl Scene {
    /// The file that a node belongs to: where it was read from, or the scene's own for what was made in code; `None` if that is
    /// in no file, or the key names no node.
    #[must_use]
    pub fn file(&self, key: NodeKey) -> Option<&FilePath> {
        self.files.path(self.file_number(key)?)
    }

    /// The file that a node belongs to if it is not the scene's own.
    pub(crate) fn other_file(&self, key: NodeKey) -> Option<&FilePath> {
        self.files.path(self.file_number(key).filter(|&file| file != 0)?)
    }

    /// Files count in the order in which they were loaded.
    pub(crate) fn file_number(&self, key: NodeKey) -> Option<usize> {
        self.slots.get(key).map(|slot| slot.file)
    }

    /// A file name that stands in a node, as a path that can be opened: relative names are relative to the folder of the node's
    /// [`Scene::file`].
    #[must_use]
    pub fn resolve(&self, node: NodeKey, filename: &str) -> PathBuf {
        match self.file(node).and_then(FilePath::parent) {
            Some(folder) => folder.join(filename),
            None => PathBuf::from(filename),
        }
    }

    /// All names of nodes are looked up here: one node in each file at most.
    pub(crate) fn named<'s>(&'s self, name: &'s str) -> impl Iterator<Item = NodeKey> + 's {
        self.files.all.iter().filter_map(move |file| file.names.get(name).copied())
    }

    /// Number of files.
    pub(crate) fn file_count(&self) -> usize {
        self.files.all.len()
    }

    /// Adds a file, and says its number.
    pub(crate) fn add_file(&mut self, path: PathBuf) -> usize {
        self.files.all.push(Known { path: Some(path), names: HashMap::new() });
        self.files.all.len() - 1
    }

    /// Takes all files from this number on away, with their nodes. No other file may show them any more.
    pub(crate) fn remove_files(&mut self, from: usize) {
        self.slots.retain(|_, slot| slot.file < from);
        self.files.all.truncate(from);
        let slots = &self.slots;
        self.files.roots.retain(|_, root| slots.contains_key(*root));
    }

    /// Takes the nodes of files away that no File shows any more, and then of those that only these have shown.
    pub(crate) fn remove_unshown_files(&mut self) {
        loop {
            let slots = &self.slots;
            let shown = |root: &NodeKey| slots.get(*root).filter(|slot| !slot.parents.is_empty());
            let files: HashSet<usize> = self.files.roots.values().filter_map(shown).map(|slot| slot.file).collect();
            let unshown =
                |(key, slot): (NodeKey, &Slot)| (slot.file != 0 && !files.contains(&slot.file)).then_some(key);
            let gone: Vec<NodeKey> = self.slots.iter().filter_map(unshown).collect();
            if gone.is_empty() {
                return;
            }
            for key in gone {
                // Nothing refuses it: the root of the scene is of the scene's own file.
                let _ = self.remove(key);
            }
            let slots = &self.slots;
            self.files.roots.retain(|_, root| slots.contains_key(*root));
        }
    }

    /// The root of a file that was loaded and is still there. The path is one without links.
    pub(crate) fn root_of(&self, canonical: &FilePath) -> Option<NodeKey> {
        self.files.roots.get(canonical).copied().filter(|&root| self.slots.contains_key(root))
    }

    pub(crate) fn set_root_of(&mut self, canonical: PathBuf, root: NodeKey) {
        self.files.roots.insert(canonical, root);
    }

    /// The name by which a File node got what it shows; empty if it shows nothing.
    pub(crate) fn shown_name(&self, file: NodeKey) -> &str {
        self.files.shown.get(file).filter(|_| !self.children(file).is_empty()).map_or("", String::as_str)
    }

    /// The File nodes that do not show what they name.
    pub(crate) fn stale_files(&self) -> Vec<NodeKey> {
        let stale = |&key: &NodeKey| self.get::<File>(key).is_some_and(|file| file.name != self.shown_name(key));
        self.slots.keys().filter(stale).collect()
    }

    /// Has a File node show something else; returns what it showed.
    pub(crate) fn show(&mut self, file: NodeKey, what: Shown) -> Shown {
        let before = self.remove_child(file, 0).ok().zip(self.files.shown.remove(file));
        if let Some((root, name)) = what {
            self.slots[file].children.push(root);
            self.slots[root].parents.push(file);
            self.files.shown.insert(file, name);
        }
        self.touch(file);
        before
    }

    /// The files from the one with this root down to a node, if the root contains the node.
    pub(crate) fn files_between(&self, root: NodeKey, node: NodeKey) -> Option<Vec<PathBuf>> {
        let way = self.way(root, node)?;
        let mut files: Vec<PathBuf> =
            way.into_iter().filter_map(|key| self.file(key)).map(FilePath::to_owned).collect();
        files.dedup();
        Some(files)
    }
}
