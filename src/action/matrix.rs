//! From the coordinates at the end of a path to those of the world.

use std::sync::Arc;

use glam::DAffine3;

use super::walk::{Go, Visitor, walk};
use super::{ActionError, ActionKind, Branches, State};
use crate::node::Role;
use crate::scene::{Path, Scene};

/// Finds the matrix at the end of a path: what all transforms before it make together.
///
/// For a transform at the end of the path its own effect counts, for a group none of its children's. What stands in several
/// copies has the matrix of the first.
///
/// # Example
///
/// ```
/// use seamount::prelude::*;
///
/// let mut scene = Scene::new();
/// let root = scene.root();
/// scene.add(root, Translation { translation: DVec3::X })?;
/// let cube = scene.add(root, Cube::default())?;
/// let path = SearchAction { node: Some(cube), ..SearchAction::default() }.apply(&scene)?.remove(0);
/// let matrix = MatrixAction::new(path).apply(&scene)?.expect("the cube is there");
/// assert_eq!(matrix.translation, DVec3::X);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct MatrixAction {
    /// The way from the scene's root.
    pub path: Path,
}

impl MatrixAction {
    /// The matrix at the end of a path.
    #[must_use]
    pub fn new(path: Path) -> Self {
        Self { path }
    }

    /// The map from local coordinates to those of the world; `None` when the path leads nowhere in this scene,
    /// or to what a Switch hides.
    ///
    /// # Errors
    ///
    /// Only if the scene is nested too deep or too large to be walked.
    pub fn apply(&self, scene: &Scene) -> Result<Option<DAffine3>, ActionError> {
        let mut matrix = Matrix { scene, path: &self.path, found: None };
        walk(scene, Branches::Possible, &mut matrix)?;
        Ok(matrix.found)
    }
}

struct Matrix<'s> {
    scene: &'s Scene,
    path: &'s Path,
    found: Option<DAffine3>,
}

impl Visitor for Matrix<'_> {
    fn action(&self) -> ActionKind {
        ActionKind::Matrix
    }

    fn enter(&mut self, path: &Path, state: &Arc<State>) -> Result<Go, ActionError> {
        let property = path.tail().is_some_and(|key| matches!(self.scene.role(key), Some(Role::Property(_))));
        if path == self.path && !property {
            self.found = Some(state.model);
            return Ok(Go::End);
        }
        Ok(Go::On)
    }

    fn leave(&mut self, path: &Path, state: &Arc<State>) -> Result<Go, ActionError> {
        if path == self.path {
            self.found = Some(state.model);
            return Ok(Go::End);
        }
        Ok(Go::On)
    }
}
