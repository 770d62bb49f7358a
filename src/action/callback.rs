//! Your own functions called along a walk, and counting what there is to draw.

use std::fmt;
use std::sync::Arc;

use glam::DVec3;

use super::walk::{Go, Visitor, walk};
use super::{ActionError, ActionKind, Branches, Cameras, ShapeContext, State, Viewpoint};
use crate::node::{Node, ShapeNode, Triangle};
use crate::scene::{Path, Scene};

/// Where a walk is.
#[derive(Debug, Clone, Copy)]
pub struct Visit<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The way to the node.
    pub path: &'a Path,
    /// The properties in force: before the node acts, or after it was walked.
    pub state: &'a State,
}

impl<'a> Visit<'a> {
    /// The node.
    #[must_use]
    pub fn node(&self) -> Option<&'a dyn Node> {
        self.path.tail().and_then(|key| self.scene.node(key))
    }

    fn is(&self, kind: Option<&str>) -> bool {
        kind.is_none_or(|kind| self.node().is_some_and(|node| node.info().kind == kind))
    }
}

type OnNode<'f> = Box<dyn FnMut(&Visit<'_>) -> Go + 'f>;
type OnPrimitive<'f, P> = Box<dyn FnMut(&Visit<'_>, &P) + 'f>;

/// Calls functions of yours at the nodes of a scene, and with the triangles, lines and points of its shapes.
///
/// Functions are called in the order in which they were given. Those called before a node may leave it out
/// ([`Go::Past`]) or end the walk ([`Go::End`]); after a node both but `End` go on. Levels of detail are chosen as in a picture
/// of [`CallbackAction::size`]. Primitives are in local coordinates: `visit.state.model` takes them to the world.
///
/// # Example
///
/// ```
/// use seamount::action::walk::Go;
/// use seamount::prelude::*;
///
/// let mut scene = Scene::new();
/// let root = scene.root();
/// scene.add(root, Translation { translation: DVec3::X })?;
/// scene.add(root, Cube::default())?;
/// let (mut kinds, mut east) = (Vec::new(), f64::NEG_INFINITY);
/// CallbackAction::new()
///     .before(None, |visit| {
///         kinds.extend(visit.node().map(|node| node.info().kind));
///         Go::On
///     })
///     .triangles(Some("Cube"), |visit, triangle| {
///         let x = triangle.points.map(|p| visit.state.model.transform_point3(p).x);
///         east = x.into_iter().fold(east, f64::max);
///     })
///     .apply(&scene)?;
/// assert_eq!((kinds, east), (vec!["Separator", "Translation", "Cube"], 2.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct CallbackAction<'f> {
    /// Width and height of the picture that detail is chosen for.
    pub size: [u32; 2],
    /// Name of the camera that detail is chosen for; the first one if not given. Without a camera detail is the finest.
    pub camera: Option<String>,
    before: Vec<(Option<String>, OnNode<'f>)>,
    after: Vec<(Option<String>, OnNode<'f>)>,
    triangles: Vec<(Option<String>, OnPrimitive<'f, Triangle>)>,
    lines: Vec<(Option<String>, OnPrimitive<'f, [DVec3; 2]>)>,
    points: Vec<(Option<String>, OnPrimitive<'f, DVec3>)>,
}

impl fmt::Debug for CallbackAction<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("CallbackAction").field("size", &self.size).field("camera", &self.camera).finish_non_exhaustive()
    }
}

impl Default for CallbackAction<'_> {
    fn default() -> Self {
        Self::new()
    }
}

impl<'f> CallbackAction<'f> {
    /// An action that calls nothing yet.
    #[must_use]
    pub fn new() -> Self {
        Self {
            size: [1280, 720],
            camera: None,
            before: Vec::new(),
            after: Vec::new(),
            triangles: Vec::new(),
            lines: Vec::new(),
            points: Vec::new(),
        }
    }

    /// Calls a function before each node, or each of a kind.
    #[must_use]
    pub fn before(mut self, kind: Option<&str>, call: impl FnMut(&Visit<'_>) -> Go + 'f) -> Self {
        self.before.push((kind.map(str::to_owned), Box::new(call)));
        self
    }

    /// Calls a function after each node, or each of a kind, and what is below it.
    #[must_use]
    pub fn after(mut self, kind: Option<&str>, call: impl FnMut(&Visit<'_>) -> Go + 'f) -> Self {
        self.after.push((kind.map(str::to_owned), Box::new(call)));
        self
    }

    /// Calls a function with each triangle of all shapes, or of those of a kind.
    #[must_use]
    pub fn triangles(mut self, kind: Option<&str>, call: impl FnMut(&Visit<'_>, &Triangle) + 'f) -> Self {
        self.triangles.push((kind.map(str::to_owned), Box::new(call)));
        self
    }

    /// Calls a function with each piece of line of all shapes, or of those of a kind.
    #[must_use]
    pub fn lines(mut self, kind: Option<&str>, call: impl FnMut(&Visit<'_>, &[DVec3; 2]) + 'f) -> Self {
        self.lines.push((kind.map(str::to_owned), Box::new(call)));
        self
    }

    /// Calls a function with each point of all shapes, or of those of a kind.
    #[must_use]
    pub fn points(mut self, kind: Option<&str>, call: impl FnMut(&Visit<'_>, &DVec3) + 'f) -> Self {
        self.points.push((kind.map(str::to_owned), Box::new(call)));
        self
    }

    /// Walks the scene.
    ///
    /// # Errors
    ///
    /// When the camera can not be used, or a shape whose primitives are asked for can not be had.
    pub fn apply(&mut self, scene: &Scene) -> Result<(), ActionError> {
        self.apply_as(ActionKind::Callback, scene)
    }

    fn apply_as(&mut self, kind: ActionKind, scene: &Scene) -> Result<(), ActionError> {
        let cameras = Cameras::new(scene, self.size);
        let viewpoint = cameras.viewpoint_if_any(self.camera.as_deref())?;
        let viewpoint = viewpoint.as_ref();
        walk(scene, Branches::Seen(viewpoint), &mut Call { scene, action: self, kind, viewpoint, cameras: &cameras })
    }
}

struct Call<'a, 'f, 's> {
    scene: &'s Scene,
    action: &'a mut CallbackAction<'f>,
    kind: ActionKind,
    viewpoint: Option<&'a Viewpoint>,
    cameras: &'a Cameras<'s>,
}

fn call(calls: &mut [(Option<String>, OnNode<'_>)], visit: &Visit<'_>) -> Go {
    for (kind, call) in calls {
        if visit.is(kind.as_deref()) {
            let go = call(visit);
            if go != Go::On {
                return go;
            }
        }
    }
    Go::On
}

fn call_with<P>(calls: &mut [(Option<String>, OnPrimitive<'_, P>)], visit: &Visit<'_>, primitive: &P) {
    for (kind, call) in calls {
        if visit.is(kind.as_deref()) {
            call(visit, primitive);
        }
    }
}

impl Visitor for Call<'_, '_, '_> {
    fn action(&self) -> ActionKind {
        self.kind
    }

    fn enter(&mut self, path: &Path, state: &Arc<State>) -> Result<Go, ActionError> {
        Ok(call(&mut self.action.before, &Visit { scene: self.scene, path, state }))
    }

    fn leave(&mut self, path: &Path, state: &Arc<State>) -> Result<Go, ActionError> {
        Ok(call(&mut self.action.after, &Visit { scene: self.scene, path, state }))
    }

    fn shape(&mut self, shape: &dyn ShapeNode, path: &Path, state: &Arc<State>) -> Result<Go, ActionError> {
        let visit = Visit { scene: self.scene, path, state };
        let cx = ShapeContext {
            viewpoint: self.viewpoint,
            cameras: Some(self.cameras),
            ..ShapeContext::new(self.scene, state, path)
        };
        let CallbackAction { triangles, lines, points, .. } = &mut *self.action;
        if triangles.iter().any(|(kind, _)| visit.is(kind.as_deref())) {
            shape.primitives(&cx, &mut |t| call_with(triangles, &visit, &t)).map_err(|e| cx.error(e))?;
        }
        if lines.iter().any(|(kind, _)| visit.is(kind.as_deref())) {
            shape.lines(&cx, &mut |l| call_with(lines, &visit, &l)).map_err(|e| cx.error(e))?;
        }
        if points.iter().any(|(kind, _)| visit.is(kind.as_deref())) {
            shape.points(&cx, &mut |p| call_with(points, &visit, &p)).map_err(|e| cx.error(e))?;
        }
        Ok(Go::On)
    }
}

/// How many primitives there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct PrimitiveCount {
    /// Triangles.
    pub triangles: u64,
    /// Pieces of lines.
    pub lines: u64,
    /// Points.
    pub points: u64,
}

/// Counts the triangles, lines and points of the shapes of a scene.
///
/// # Example
///
/// ```
/// use seamount::prelude::*;
///
/// let mut scene = Scene::new();
/// let root = scene.root();
/// scene.add(root, Cube::default())?;
/// assert_eq!(PrimitiveCountAction::default().apply(&scene)?.triangles, 12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct PrimitiveCountAction {
    /// Width and height of the picture that detail is chosen for.
    pub size: [u32; 2],
    /// Name of the camera that detail is chosen for; the first one if not given. Without a camera detail is the finest.
    pub camera: Option<String>,
}

impl Default for PrimitiveCountAction {
    fn default() -> Self {
        Self { size: [1280, 720], camera: None }
    }
}

impl PrimitiveCountAction {
    /// The counts.
    ///
    /// # Errors
    ///
    /// When the camera can not be used or a shape can not be had.
    pub fn apply(&self, scene: &Scene) -> Result<PrimitiveCount, ActionError> {
        let (mut triangles, mut lines, mut points) = (0, 0, 0);
        let mut action = CallbackAction { size: self.size, camera: self.camera.clone(), ..CallbackAction::new() }
            .triangles(None, |_, _| triangles += 1)
            .lines(None, |_, _| lines += 1)
            .points(None, |_, _| points += 1);
        action.apply_as(ActionKind::PrimitiveCount, scene)?;
        drop(action);
        Ok(PrimitiveCount { triangles, lines, points })
    }
}
