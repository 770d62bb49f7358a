//! Finding nodes by name, kind or key.

use std::sync::Arc;

use super::walk::{Go, Visitor, walk};
use super::{ActionError, ActionKind, Branches, State};
use crate::scene::{NodeKey, Path, Scene};

/// Which of the occurrences that meet the conditions are wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Interest {
    /// The first alone; the search ends there.
    First,
    /// The last alone.
    Last,
    /// All.
    #[default]
    All,
}

/// Finds the occurrences of nodes that meet all of the conditions given, in the order of the walk.
///
/// What stands in several copies of an Array is one occurrence.
///
/// # Example
///
/// ```
/// use seamount::prelude::*;
///
/// let mut scene = Scene::new();
/// let root = scene.root();
/// scene.add(root, Cube::default())?;
/// let group = scene.add(root, Separator::default())?;
/// scene.add(group, Cube::default())?;
/// let cubes = SearchAction { kind: Some("Cube".into()), ..SearchAction::default() }.apply(&scene)?;
/// assert_eq!(cubes.len(), 2);
/// assert_eq!(cubes[1].names(&scene), ["Separator", "Separator[1]", "Cube[0]"]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct SearchAction {
    /// Nodes with this name, those that Files show as well.
    pub name: Option<String>,
    /// Nodes of this kind.
    pub kind: Option<String>,
    /// This node.
    pub node: Option<NodeKey>,
    /// Whether the first, the last or all are wanted.
    pub interest: Interest,
    /// Whether what a Switch hides is searched as well.
    pub hidden: bool,
}

impl SearchAction {
    /// The paths to what was found.
    ///
    /// # Errors
    ///
    /// Only if the scene is nested too deep or too large to be walked.
    pub fn apply(&self, scene: &Scene) -> Result<Vec<Path>, ActionError> {
        // A name means a node in each file, and comparing keys is what the walk does fastest.
        let named = self.name.as_deref().map(|name| scene.named(name).collect::<Vec<_>>());
        let nowhere = named.as_ref().is_some_and(Vec::is_empty);
        let mut search = Search { action: self, scene, named, found: Vec::new() };
        if !nowhere {
            walk(scene, if self.hidden { Branches::All } else { Branches::Possible }, &mut search)?;
        }
        Ok(search.found)
    }
}

struct Search<'s> {
    action: &'s SearchAction,
    scene: &'s Scene,
    /// The nodes with the name asked for.
    named: Option<Vec<NodeKey>>,
    found: Vec<Path>,
}

impl Visitor for Search<'_> {
    fn action(&self) -> ActionKind {
        ActionKind::Search
    }

    fn enter(&mut self, path: &Path, _: &Arc<State>) -> Result<Go, ActionError> {
        let Some(key) = path.tail() else { return Ok(Go::On) };
        let SearchAction { kind, node, interest, .. } = self.action;
        let matches = self.named.as_ref().is_none_or(|named| named.contains(&key))
            && node.is_none_or(|node| node == key)
            && kind.as_deref().is_none_or(|kind| self.scene.node(key).is_some_and(|n| n.info().kind == kind))
            && self.found.last() != Some(path);
        if matches {
            if *interest == Interest::Last {
                self.found.clear();
            }
            self.found.push(path.clone());
            if *interest == Interest::First {
                return Ok(Go::End);
            }
        }
        Ok(Go::On)
    }
}
