//! One occurrence of a node: the way to it from the root.

use std::fmt;
use std::path::{Path as FilePath, PathBuf};

use super::{NodeKey, Position, Scene};

/// The nodes from the root to one occurrence of a node, with the index of each among its parent's children.
///
/// A node with several parents has several paths.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default)]
pub struct Path {
    steps: Vec<(NodeKey, usize)>,
}

impl Path {
    /// A path with the root alone (or any other node to start from).
    #[must_use]
    pub fn new(root: NodeKey) -> Self {
        Self { steps: vec![(root, 0)] }
    }

    /// Goes on to child number `index`, which is `child`.
    pub fn push(&mut self, child: NodeKey, index: usize) {
        self.steps.push((child, index));
    }

    /// Goes back to the parent.
    pub fn pop(&mut self) -> Option<NodeKey> {
        self.steps.pop().map(|(key, _)| key)
    }

    /// The node that the path leads to.
    #[must_use]
    pub fn tail(&self) -> Option<NodeKey> {
        self.steps.last().map(|&(key, _)| key)
    }

    /// All nodes from the root on.
    pub fn nodes(&self) -> impl DoubleEndedIterator<Item = NodeKey> + ExactSizeIterator + '_ {
        self.steps.iter().map(|&(key, _)| key)
    }

    /// Index of each node after the first among its parent's children.
    pub fn indices(&self) -> impl DoubleEndedIterator<Item = usize> + '_ {
        self.steps.iter().skip(1).map(|&(_, index)| index)
    }

    /// Whether the path leads through the end of another, or ends there.
    #[must_use]
    pub fn starts_with(&self, other: &Path) -> bool {
        self.steps.starts_with(&other.steps)
    }

    /// Whether another path is a part of this one: its nodes stand here one after the other, each the same child of the one
    /// before. What the first of them is a child of does not matter, so that the path of one node is part of all that lead
    /// through it.
    ///
    /// ```
    /// use seamount::prelude::*;
    ///
    /// let mut scene = Scene::new();
    /// let group = scene.add(scene.root(), Separator::default())?;
    /// let cube = scene.add(group, Cube::default())?;
    /// let path = SearchAction { node: Some(cube), ..SearchAction::default() }.apply(&scene)?.remove(0);
    /// assert!(path.contains(&Path::new(group)) && path.contains(&path));
    /// let mut part = Path::new(group);
    /// part.push(cube, 1);
    /// assert!(!path.contains(&part), "it is child 0");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn contains(&self, part: &Path) -> bool {
        let Some((&(first, _), rest)) = part.steps.split_first() else { return true };
        let starts = self.steps.iter().enumerate().filter(|(_, (key, _))| *key == first);
        starts.into_iter().any(|(at, _)| self.steps.iter().skip(at + 1).take(rest.len()).eq(rest))
    }

    /// Number of nodes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.steps.len()
    }

    /// Whether there is no node in it.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.steps.is_empty()
    }

    /// The path for people and JSON: for each node its name if it has one, else its kind and child index as
    /// `Separator[2]`; the root without index.
    #[must_use]
    pub fn names(&self, scene: &Scene) -> Vec<String> {
        self.steps
            .iter()
            .enumerate()
            .map(|(depth, &(key, index))| {
                let kind = scene.node(key).map_or("?", |n| n.info().kind);
                match scene.name(key) {
                    Some(name) => name.to_owned(),
                    None if depth == 0 => kind.to_owned(),
                    None => format!("{kind}[{index}]"),
                }
            })
            .collect()
    }
}

/// Where a node stands, in the scene and in its file; for errors. Printed as `file:line:column: path`, without what is not
/// known.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct NodePlace {
    /// The way to it from the root, as [`Path::names`] has it.
    pub path: Vec<String>,
    /// The file that it belongs to, if a File shows it; otherwise that of the scene is meant.
    pub file: Option<PathBuf>,
    /// Where it was written, if it came from a file.
    pub position: Option<Position>,
}

impl NodePlace {
    /// The place of a node that an error is about, with the way to the shape that could not be had for it.
    pub(crate) fn new(scene: &Scene, node: NodeKey, path: &Path) -> Self {
        let file = scene.other_file(node).map(FilePath::to_owned);
        Self { path: path.names(scene), file, position: scene.position(node) }
    }
}

impl fmt::Display for NodePlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.file, self.position) {
            (Some(file), Some(position)) => write!(f, "{}:{position}: ", file.display())?,
            (Some(file), None) => write!(f, "{}: ", file.display())?,
            (None, Some(position)) => write!(f, "{position}: ")?,
            (None, None) => {}
        }
        f.write_str(&self.path.join("/"))
    }
}
