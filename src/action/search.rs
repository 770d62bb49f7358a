//! Finding nodes by name, kind or key.

use std::ops::ControlFlow;

use super::walk::{Visitor, walk};
use super::{ActionError, State};
use crate::scene::{NodeKey, Path, Scene};

/// Finds the occurrences of nodes that meet all of the conditions given, in the order of the walk.
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
    /// Nodes with this name.
    pub name: Option<String>,
    /// Nodes of this kind.
    pub kind: Option<String>,
    /// This node.
    pub node: Option<NodeKey>,
    /// Stop at the first.
    pub first: bool,
}

impl SearchAction {
    /// The paths to what was found.
    ///
    /// # Errors
    ///
    /// Only if the scene is nested too deep to be walked.
    pub fn apply(&self, scene: &Scene) -> Result<Vec<Path>, ActionError> {
        struct Search<'s> {
            action: &'s SearchAction,
            scene: &'s Scene,
            found: Vec<Path>,
        }
        impl Visitor for Search<'_> {
            fn enter(&mut self, path: &Path, _: &State) -> Result<ControlFlow<()>, ActionError> {
                let Some(key) = path.tail() else {
                    return Ok(ControlFlow::Continue(()));
                };
                let SearchAction { name, kind, node, first } = self.action;
                let matches = name.as_deref().is_none_or(|n| self.scene.name(key) == Some(n))
                    && kind.as_deref().is_none_or(|k| self.scene.node(key).is_some_and(|n| n.info().kind == k))
                    && node.is_none_or(|n| n == key);
                if matches {
                    self.found.push(path.clone());
                    if *first {
                        return Ok(ControlFlow::Break(()));
                    }
                }
                Ok(ControlFlow::Continue(()))
            }
        }
        let mut search = Search { action: self, scene, found: Vec::new() };
        walk(scene, &mut search)?;
        Ok(search.found)
    }
}
