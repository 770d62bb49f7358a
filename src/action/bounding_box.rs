//! The smallest box around a scene.

use std::sync::Arc;

use glam::DAffine3;

use super::walk::{Go, Visitor, walk, walk_from};
use super::{Aabb, ActionError, ActionKind, Branches, GroupContext, ShapeContext, State, Viewpoint};
use crate::node::{Reset, ResetTransform, ShapeNode};
use crate::scene::{Path, Scene};

/// Finds the smallest box along the world axes around the local boxes of all shapes.
///
/// Needs no camera, unless text is to be boxed as a picture shows it: a terrain's box is that of its full-resolution heights, which
/// contains every coarser mesh, and of
/// levels of detail all are boxed. Decodes height maps, but no colours. Each shape's own box is transformed by the whole map
/// to the world at once, so that turned groups in turned groups do not make it larger.
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
#[derive(Debug, Clone, Default)]
pub struct BoundingBoxAction {
    /// Boxes only what is at the end of this path, in all copies that an Array makes of it; all of the scene if not given.
    pub path: Option<Path>,
    /// The view in which text, whose size is in pixels, is boxed by what it covers; without one a text is the point that it
    /// stands at. A view does not say how far its picture is stretched (`LeaveAlone` in a picture of other proportions): text is
    /// boxed as in one that is not.
    ///
    /// ```
    /// use seamount::prelude::*;
    ///
    /// let mut scene = Scene::new();
    /// let root = scene.root();
    /// scene.add(root, OrthographicCamera { position: Some(DVec3::Z), height: 2.0, ..OrthographicCamera::default() })?;
    /// scene.add(root, Text2 { string: "label".into(), ..Text2::default() })?;
    /// let view = RenderAction::new(200, 100).viewpoint(&scene)?;
    /// let place = BoundingBoxAction::default().apply(&scene)?.expect("a text");
    /// assert_eq!(place.min, place.max);
    /// let shown = BoundingBoxAction { view: Some(view), ..BoundingBoxAction::default() }.apply(&scene)?.expect("a text");
    /// assert!(shown.size().x > 0.5 && shown.size().z == 0.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub view: Option<Viewpoint>,
}

/// A box along the axes of coordinates of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrientedBox {
    /// The box in its own coordinates.
    pub bounds: Aabb,
    /// From its own coordinates to those of the world.
    pub to_world: DAffine3,
}

impl OrientedBox {
    /// Its volume in the world.
    #[must_use]
    pub fn volume(&self) -> f64 {
        self.bounds.size().element_product() * self.to_world.matrix3.determinant().abs()
    }
}

impl BoundingBoxAction {
    /// The box in world coordinates, `None` when there is no shape.
    ///
    /// # Errors
    ///
    /// When a shape can not be had.
    pub fn apply(&self, scene: &Scene) -> Result<Option<Aabb>, ActionError> {
        let all = self.path.is_none() && self.view.is_none();
        let known = scene.index().filter(|_| all).and_then(|index| index.bounds());
        known.map_or_else(|| self.bounds_in(scene, &DAffine3::IDENTITY), Ok)
    }

    /// The box with its matrix: along the axes of the first shape's own coordinates or along those of the world, whichever is
    /// smaller; `None` when there is no shape.
    ///
    /// # Errors
    ///
    /// As for [`BoundingBoxAction::apply`].
    ///
    /// ```
    /// use seamount::prelude::*;
    ///
    /// let mut scene = Scene::new();
    /// let root = scene.root();
    /// scene.add(root, RotationXyz { angle: 0.5, ..RotationXyz::default() })?;
    /// scene.add(root, Cube::default())?;
    /// let oriented = BoundingBoxAction::default().oriented(&scene)?.expect("a cube");
    /// assert!((oriented.volume() - 8.0).abs() < 1e-12);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn oriented(&self, scene: &Scene) -> Result<Option<OrientedBox>, ActionError> {
        let mut first = FirstModel { path: self.path.as_ref(), found: None };
        walk(scene, Branches::Possible, &mut first)?;
        let world = self.apply(scene)?.map(|bounds| OrientedBox { bounds, to_world: DAffine3::IDENTITY });
        let Some(to_world) = first.found.filter(|m| m.matrix3.determinant() != 0.0 && m.inverse().is_finite()) else {
            return Ok(world);
        };
        let own = self.bounds_in(scene, &to_world.inverse())?.map(|bounds| OrientedBox { bounds, to_world });
        Ok(match (world, own) {
            (Some(world), Some(own)) if world.volume() <= own.volume() => Some(world),
            (_, own) => own,
        })
    }

    /// The box in coordinates that this map takes those of the world to.
    fn bounds_in(&self, scene: &Scene, from_world: &DAffine3) -> Result<Option<Aabb>, ActionError> {
        let (path, view) = (self.path.as_ref(), self.view.as_ref());
        let mut bounds = Bounds { scene, path, view, from_world, found: None };
        walk(scene, Branches::Possible, &mut bounds)?;
        Ok(bounds.found)
    }
}

/// The box in world coordinates of all children of a group that is reached with this state.
pub(crate) fn bounds_below(cx: &GroupContext<'_>, state: &Arc<State>) -> Result<Option<Aabb>, ActionError> {
    let mut bounds = Bounds { scene: cx.scene, path: None, view: None, from_world: &DAffine3::IDENTITY, found: None };
    for (index, &child) in cx.scene.children(cx.key).iter().enumerate() {
        walk_from(cx.scene, cx.path, (child, index), Arc::clone(state), Branches::Possible, &mut bounds)?;
    }
    Ok(bounds.found)
}

struct Bounds<'s> {
    scene: &'s Scene,
    path: Option<&'s Path>,
    view: Option<&'s Viewpoint>,
    from_world: &'s DAffine3,
    found: Option<Aabb>,
}

impl Visitor for Bounds<'_> {
    fn action(&self) -> ActionKind {
        ActionKind::BoundingBox
    }

    fn enter(&mut self, path: &Path, _: &Arc<State>) -> Result<Go, ActionError> {
        if path
            .tail()
            .and_then(|key| self.scene.get::<ResetTransform>(key))
            .is_some_and(|r| r.what_to_reset != Reset::Transform)
        {
            self.found = None;
        }
        Ok(Go::On)
    }

    fn shape(&mut self, shape: &dyn ShapeNode, path: &Path, state: &Arc<State>) -> Result<Go, ActionError> {
        if self.path.is_some_and(|wanted| !path.starts_with(wanted)) {
            return Ok(Go::On);
        }
        let cx = ShapeContext { viewpoint: self.view, ..ShapeContext::new(self.scene, state, path) };
        if let Some(bounds) = shape.bounds(&cx).map_err(|e| cx.error(e))? {
            let bounds = bounds.transformed(&super::state::compose(self.from_world, &state.model));
            self.found = Some(self.found.map_or(bounds, |b| b.union(&bounds)));
        }
        Ok(Go::On)
    }
}

/// The model map of the first shape.
struct FirstModel<'p> {
    path: Option<&'p Path>,
    found: Option<DAffine3>,
}

impl Visitor for FirstModel<'_> {
    fn action(&self) -> ActionKind {
        ActionKind::BoundingBox
    }

    fn shape(&mut self, _: &dyn ShapeNode, path: &Path, state: &Arc<State>) -> Result<Go, ActionError> {
        if self.path.is_some_and(|wanted| !path.starts_with(wanted)) {
            return Ok(Go::On);
        }
        self.found = Some(state.model);
        Ok(Go::End)
    }
}
