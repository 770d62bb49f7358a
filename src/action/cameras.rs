//! The cameras of a scene by name, and the views they give.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::render::find_camera;
use super::{Aabb, ActionError, BoundingBoxAction, CameraError, PlacedCamera, Viewpoint};
use crate::scene::Scene;

/// A camera and its view.
type Placed = (Arc<PlacedCamera>, Viewpoint);

/// The views that the cameras of a scene give in pictures of one size. Each is worked out when it is asked for first and
/// kept, so that many shapes and rays can ask.
///
/// # Example
///
/// ```
/// use seamount::action::Cameras;
/// use seamount::prelude::*;
///
/// let mut scene = Scene::new();
/// let root = scene.root();
/// let camera = scene.add(root, PerspectiveCamera { position: Some(DVec3::Z), ..PerspectiveCamera::default() })?;
/// scene.set_name(camera, "above")?;
/// let cameras = Cameras::new(&scene, [640, 480]);
/// assert_eq!(cameras.viewpoint(Some("above"))?.eye, DVec3::Z);
/// assert!(cameras.viewpoint(Some("below")).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Cameras<'s> {
    scene: &'s Scene,
    size: [u32; 2],
    bounds: OnceLock<Result<Option<Aabb>, ActionError>>,
    found: Mutex<Vec<(Option<String>, Placed)>>,
}

impl<'s> Cameras<'s> {
    /// The cameras of a scene for pictures of so many pixels in width and height.
    #[must_use]
    pub fn new(scene: &'s Scene, size: [u32; 2]) -> Self {
        Self { scene, size, bounds: OnceLock::new(), found: Mutex::default() }
    }

    /// Width and height of the pictures in pixels.
    pub(crate) fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The box of the scene, found once.
    pub(super) fn bounds(&self) -> Result<Option<Aabb>, ActionError> {
        self.bounds.get_or_init(|| BoundingBoxAction::default().apply(self.scene)).clone()
    }

    /// The view of the camera with this name, or of the first one.
    ///
    /// # Errors
    ///
    /// When the picture has no pixels, there is no such camera, it can not be used, or a shape that near and far depend on
    /// can not be had.
    pub fn viewpoint(&self, name: Option<&str>) -> Result<Viewpoint, ActionError> {
        Ok(self.camera(name)?.1)
    }

    /// The camera with this name, or the first one, and its view.
    pub(super) fn camera(&self, name: Option<&str>) -> Result<Placed, ActionError> {
        let [width, height] = self.size;
        if width == 0 || height == 0 {
            return Err(ActionError::Viewport(width, height));
        }
        let found = || self.found.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, (camera, view))) = found().iter().find(|(known, _)| known.as_deref() == name) {
            return Ok((Arc::clone(camera), *view));
        }
        if name.is_none() && self.scene.index().is_some_and(|index| !index.has_camera()) {
            return Err(ActionError::NoCamera);
        }
        let camera = find_camera(self.scene, name)?;
        // The lock is not held meanwhile: the walk asks shapes that may be defined anywhere.
        let bounds = self.bounds()?;
        let refused = |error| ActionError::Camera { error, path: camera.path.names(self.scene) };
        let view = camera.viewpoint(self.size, bounds).map_err(refused)?;
        // Fields set in code were not checked by a reader: an angle beyond π has a tangent like any other.
        if let Some(node) = self.scene.node(camera.key)
            && let Some(problem) = node.problems().into_iter().next()
        {
            return Err(refused(CameraError::Field(Box::new(problem))));
        }
        found().push((name.map(str::to_owned), (Arc::clone(&camera), view)));
        Ok((camera, view))
    }

    /// [`Cameras::viewpoint`], or nothing in a scene without a camera.
    ///
    /// # Errors
    ///
    /// As for [`Cameras::viewpoint`], but for scenes without any camera.
    pub fn viewpoint_if_any(&self, name: Option<&str>) -> Result<Option<Viewpoint>, ActionError> {
        Ok(self.camera_if_any(name)?.map(|(_, view)| view))
    }

    /// [`Cameras::camera`], or nothing in a scene without a camera.
    pub(super) fn camera_if_any(&self, name: Option<&str>) -> Result<Option<Placed>, ActionError> {
        match self.camera(name) {
            Ok(camera) => Ok(Some(camera)),
            Err(ActionError::NoCamera) => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// How far there is anything to see: up to the far plane or, without one, to the far end of the scene, along the view.
    pub(super) fn furthest(&self, view: &Viewpoint) -> f64 {
        let scene = || self.bounds().ok().flatten();
        let corner =
            || scene().map(|b| b.corners().map(|c| (c - view.eye).dot(view.forward)).into_iter().fold(0.0, f64::max));
        view.far.or_else(corner).unwrap_or(0.0)
    }
}
