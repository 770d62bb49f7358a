//! Where a ray meets the scene.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing))]

use std::ops::ControlFlow;

use glam::{DAffine3, DVec2, DVec3};

use super::camera::unit;
use super::render::find_camera;
use super::walk::{Visitor, walk};
use super::{ActionError, Cameras, Lens, Ray, ShapeContext, State, View, Viewpoint};
use crate::node::{HitDetail, ShapeHit, ShapeNode};
use crate::scene::{Path, Scene};

/// What to pick along.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PickTarget {
    /// The ray through a point of the picture in pixels from the top left corner: pixel (x, y) has its centre at
    /// (x + 0.5, y + 0.5).
    Pixel(f64, f64),
    /// The ray through a point of the picture, (0, 0) top left to (1, 1) bottom right.
    Point(f64, f64),
    /// A ray in world coordinates.
    Ray(Ray),
}

/// Which surface of a shape is met. Only terrains have more than one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Surface {
    /// Four coarse triangles per active patch of a terrain, each hit with the bound of its error.
    #[default]
    Coarse,
    /// The very triangles of a terrain that the picture shows, each hit with the bound of its error. Without a camera all
    /// cells of the map.
    Drawn,
    /// The shape itself: of a terrain every cell of the full-resolution map.
    Exact,
}

impl Surface {
    /// The name, as the command prints it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Surface::Coarse => "coarse",
            Surface::Drawn => "drawn",
            Surface::Exact => "exact",
        }
    }
}

/// A place where the ray meets the scene. World coordinates and distances are in units of the scene, all in f64.
#[derive(Debug, Clone, PartialEq)]
pub struct PickedPoint {
    /// The point in world coordinates.
    pub point: DVec3,
    /// Distance from the ray's origin.
    pub distance: f64,
    /// Unit normal in world coordinates (by the inverse transpose of the transform).
    pub normal: DVec3,
    /// The point in the shape's local coordinates.
    pub object_point: DVec3,
    /// Unit normal in the shape's local coordinates.
    pub object_normal: DVec3,
    /// Unit normal in world coordinates as shading uses it: of a terrain, blended between the slopes at the corners of the
    /// cell; else `normal`.
    pub smooth_normal: DVec3,
    /// Texture coordinate; (0, 0) is the south-west corner of a terrain.
    pub uv: DVec2,
    /// The way to the shape.
    pub path: Path,
    /// Which surface was hit.
    pub surface: Surface,
    /// How far the picked surface may be from the full-resolution one here, along the shape's own z, in world units. `None`:
    /// not known.
    pub error_bound: Option<f64>,
    /// What only this kind of shape can say.
    pub detail: HitDetail,
}

/// Finds where a ray meets the shapes of a scene.
///
/// A terrain is met on the surface that is asked for: by default the four coarse triangles of each of its active patches,
/// those of the picture that the camera takes (without a camera, of its finest patches), on the very triangles of that
/// picture, or exactly on every cell of its map. What is outside the picture is picked as well. No GPU is used.
///
/// # Example
///
/// ```
/// use seamount::prelude::*;
///
/// let mut scene = Scene::new();
/// let root = scene.root();
/// scene.add(root, Cube::default())?;
/// let down = Ray::new(DVec3::new(0.5, 0.5, 10.0), DVec3::NEG_Z)?;
/// let hits = RayPickAction::ray(down).apply(&scene)?;
/// assert_eq!(hits[0].point, DVec3::new(0.5, 0.5, 1.0));
/// assert_eq!((hits[0].distance, hits[0].normal), (9.0, DVec3::Z));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct RayPickAction {
    /// What to pick along.
    pub target: PickTarget,
    /// Which surface of terrains is met.
    pub surface: Surface,
    /// All crossings in order of distance, instead of the first.
    pub all: bool,
    /// Width and height of the picture that pixels refer to and detail is chosen for.
    pub size: [u32; 2],
    /// Name of the camera; the first one if not given.
    pub camera: Option<String>,
}

impl RayPickAction {
    /// The first hit along a ray in world coordinates.
    #[must_use]
    pub fn ray(ray: Ray) -> Self {
        Self { target: PickTarget::Ray(ray), surface: Surface::default(), all: false, size: [1280, 720], camera: None }
    }

    /// The first hit through the centre of a pixel of a picture of this size.
    #[must_use]
    pub fn pixel(x: u32, y: u32, size: [u32; 2]) -> Self {
        let target = PickTarget::Pixel(f64::from(x) + 0.5, f64::from(y) + 0.5);
        Self { target, surface: Surface::default(), all: false, size, camera: None }
    }

    /// What the ray meets, nearest first; empty if nothing.
    ///
    /// # Errors
    ///
    /// When the ray is none, a picture is asked for without a camera, or a shape can not be had.
    pub fn apply(&self, scene: &Scene) -> Result<Vec<PickedPoint>, ActionError> {
        let picker = self.picker(scene)?;
        let ray = match self.target {
            PickTarget::Ray(ray) => ray,
            PickTarget::Pixel(x, y) => picker.ray_through(x / f64::from(self.size[0]), y / f64::from(self.size[1]))?,
            PickTarget::Point(x, y) => picker.ray_through(x, y)?,
        };
        picker.pick(&ray, self.all)
    }

    /// Everything that many picks of one scene have in common, found once.
    ///
    /// # Errors
    ///
    /// When the camera can not be used, or a shape that near and far depend on can not be had.
    pub fn picker<'s>(&self, scene: &'s Scene) -> Result<Picker<'s>, ActionError> {
        let cameras = Cameras::new(scene, self.size);
        let (viewpoint, limits) = match cameras.viewpoint(self.camera.as_deref()) {
            Ok(view) => {
                let fields = find_camera(scene, self.camera.as_deref())?.fields;
                (Some(view), (fields.near_distance, fields.far_distance))
            }
            Err(ActionError::NoCamera) => (None, (None, None)),
            Err(error) => return Err(error),
        };
        Ok(Picker { scene, surface: self.surface, viewpoint, cameras, frozen: None, limits })
    }

    /// The picker for what is shown in a view: while the view is frozen it picks the detail that is drawn there.
    ///
    /// # Errors
    ///
    /// As for [`RayPickAction::picker`].
    pub fn picker_in<'s>(&self, scene: &'s Scene, view: &'s View) -> Result<Picker<'s>, ActionError> {
        Ok(Picker { frozen: view.freeze.then_some(view), ..self.picker(scene)? })
    }
}

/// Picks in one scene through one camera; see [`RayPickAction::picker`].
#[derive(Debug)]
pub struct Picker<'s> {
    pub(super) scene: &'s Scene,
    surface: Surface,
    viewpoint: Option<Viewpoint>,
    pub(super) cameras: Cameras<'s>,
    frozen: Option<&'s View>,
    /// Near and far as the camera's node gives them.
    limits: (Option<f64>, Option<f64>),
}

impl Picker<'_> {
    /// The view, if the scene has a camera.
    #[must_use]
    pub fn viewpoint(&self) -> Option<&Viewpoint> {
        self.viewpoint.as_ref()
    }

    /// The ray through a point of the picture, (0, 0) top left to (1, 1) bottom right, between the camera's near and far
    /// planes where it has such.
    ///
    /// # Errors
    ///
    /// Without a camera, or for coordinates that are not finite.
    pub fn ray_through(&self, x: f64, y: f64) -> Result<Ray, ActionError> {
        let view = self.viewpoint.as_ref().ok_or(ActionError::NoCamera)?;
        let (origin, direction) = view.ray(x, y);
        let ray = Ray::new(origin, direction)?;
        // Planes lie across the view; distances along the ray are longer.
        let slant = match view.lens {
            Lens::Perspective { .. } => ray.direction.dot(view.forward),
            Lens::Orthographic { .. } => 1.0,
        };
        let near = self.limits.0.map_or(0.0, |near| near / slant);
        let far = self.limits.1.map_or(f64::INFINITY, |far| far / slant);
        Ok(ray.with_range(near, far)?)
    }

    /// [`Picker::pick`] along many rays, on all cores: the same answers in the same order.
    ///
    /// # Errors
    ///
    /// The first error, if a shape can not be had.
    pub fn pick_many(&self, rays: &[Ray], all: bool) -> Result<Vec<Vec<PickedPoint>>, ActionError> {
        use rayon::prelude::*;
        // A pick takes about a microsecond; smaller pieces of work would cost more to hand out.
        rays.par_iter().with_min_len(64).map(|ray| self.pick(ray, all)).collect()
    }

    /// What the ray meets, nearest first: the first, or all.
    ///
    /// # Errors
    ///
    /// When a shape can not be had.
    pub fn pick(&self, ray: &Ray, all: bool) -> Result<Vec<PickedPoint>, ActionError> {
        self.pick_of(ray, all, |_| true)
    }

    /// [`Picker::pick`] among the hits that are wanted.
    pub(super) fn pick_of(
        &self,
        ray: &Ray,
        all: bool,
        wanted: fn(&HitDetail) -> bool,
    ) -> Result<Vec<PickedPoint>, ActionError> {
        let mut pick = Pick { picker: self, ray: *ray, all, wanted, local: Vec::new(), found: Vec::new() };
        walk(self.scene, &mut pick)?;
        let mut found = pick.found;
        found.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        if !all {
            found.truncate(1);
        }
        Ok(found)
    }
}

struct Pick<'p, 's> {
    picker: &'p Picker<'s>,
    ray: Ray,
    all: bool,
    wanted: fn(&HitDetail) -> bool,
    local: Vec<ShapeHit>,
    found: Vec<PickedPoint>,
}

impl Visitor for Pick<'_, '_> {
    fn shape(&mut self, shape: &dyn ShapeNode, path: &Path, state: &State) -> Result<ControlFlow<()>, ActionError> {
        let picker = self.picker;
        let cx = ShapeContext {
            viewpoint: picker.viewpoint.as_ref(),
            surface: picker.surface,
            cameras: Some(&picker.cameras),
            kept: picker.frozen.and_then(|view| view.kept(path)),
            ..ShapeContext::new(picker.scene, state, path)
        };
        // A shape flattened by its transform has no inside to meet.
        let Some(inverse) = super::state::inverse(&state.model.matrix3) else {
            return Ok(ControlFlow::Continue(()));
        };
        // The translation is subtracted first: far from the origin the digits are there.
        let local = Ray {
            origin: inverse * (self.ray.origin - state.model.translation),
            direction: inverse * self.ray.direction,
            ..self.ray
        };
        self.local.clear();
        shape.ray(&cx, &local, !self.all, &mut self.local).map_err(|e| cx.error(e))?;
        for hit in self.local.iter().filter(|hit| (self.wanted)(&hit.detail)) {
            self.found.push(picked(hit, &state.model, path));
        }
        if !self.all
            && let Some(nearest) = self.found.iter().map(|p| p.distance).min_by(f64::total_cmp)
        {
            self.ray.far = self.ray.far.min(nearest);
        }
        Ok(ControlFlow::Continue(()))
    }
}

fn picked(hit: &ShapeHit, model: &DAffine3, path: &Path) -> PickedPoint {
    let normals = super::state::normal_matrix(&model.matrix3);
    let (surface, error_bound) = match hit.detail {
        HitDetail::Terrain(detail) => (detail.surface, Some(detail.error * model.matrix3.z_axis.length())),
        _ => (Surface::Exact, Some(0.0)),
    };
    PickedPoint {
        point: model.transform_point3(hit.point),
        distance: hit.t,
        normal: unit(normals * hit.normal).unwrap_or(DVec3::Z),
        object_point: hit.point,
        object_normal: unit(hit.normal).unwrap_or(DVec3::Z),
        smooth_normal: unit(normals * hit.smooth_normal).unwrap_or(DVec3::Z),
        uv: hit.uv,
        path: path.clone(),
        surface,
        error_bound,
        detail: hit.detail,
    }
}
