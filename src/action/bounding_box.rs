//! The smallest box around a scene.

use std::ops::ControlFlow;

use super::walk::{Visitor, walk};
use super::{Aabb, ActionError, ShapeContext, State};
use crate::node::ShapeNode;
use crate::scene::{Path, Scene};

/// Finds the smallest box along the world axes around the local boxes of all shapes.
///
/// Needs no camera: a terrain's box is that of its full-resolution heights, which contains every coarser mesh. Decodes
/// height maps, but no colours.
///
/// # Example
///
/// ```
/// use seamount::prelude::*;
///
/// let mut scene = Scene::new();
/// assert_eq!(BoundingBoxAction::default().apply(&scene)?, None);
/// let root = scene.root();
/// scene.add(root, Cube::default())?;
/// let bounds = BoundingBoxAction::default().apply(&scene)?.expect("a cube");
/// assert_eq!((bounds.min, bounds.max), (DVec3::splat(-1.0), DVec3::splat(1.0)));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, Default)]
pub struct BoundingBoxAction {}

impl BoundingBoxAction {
    /// The box in world coordinates, `None` when there is no shape.
    ///
    /// # Errors
    ///
    /// When a shape can not be had.
    pub fn apply(&self, scene: &Scene) -> Result<Option<Aabb>, ActionError> {
        struct Bounds<'s> {
            scene: &'s Scene,
            found: Option<Aabb>,
        }
        impl Visitor for Bounds<'_> {
            fn shape(
                &mut self,
                shape: &dyn ShapeNode,
                path: &Path,
                state: &State,
            ) -> Result<ControlFlow<()>, ActionError> {
                let cx = ShapeContext::new(self.scene, state, path);
                if let Some(bounds) = shape.bounds(&cx).map_err(|e| cx.error(e))? {
                    let bounds = bounds.transformed(&state.model);
                    self.found = Some(self.found.map_or(bounds, |b| b.union(&bounds)));
                }
                Ok(ControlFlow::Continue(()))
            }
        }
        let mut bounds = Bounds { scene, found: None };
        walk(scene, &mut bounds)?;
        Ok(bounds.found)
    }
}
