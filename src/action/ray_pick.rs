//! Where a ray meets the scene.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing))]

use std::cmp::Ordering;
use std::sync::{Arc, Mutex, PoisonError};

use glam::{DAffine3, DVec2, DVec3};

use super::camera::unit;
use super::memo::{Lent, Memo, Memos};
use super::walk::{Go, Visitor, walk};
use super::{
    Aabb, ActionError, ActionKind, Branches, Cameras, Index, Lens, PickCone, PixelArea, Ray, ShapeContext, State, View,
    Viewpoint,
};
use crate::node::{Cube, HitDetail, PickStyleKind, Role, ShapeHit, ShapeNode};
use crate::scene::{NodeKey, Path, Scene};

/// What to pick along.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PickTarget {
    /// The ray through a point of the picture in pixels from the top left corner: pixel (x, y) has its centre at
    /// (x + 0.5, y + 0.5).
    Pixel(f64, f64),
    /// The ray through a point of the picture, (0, 0) top left to (1, 1) bottom right.
    Point(f64, f64),
    /// The ray through a point of the picture as Open Inventor counts: (0, 0) bottom left to (1, 1) top right.
    Normalized(f64, f64),
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
    /// Whether the shape's PickStyle puts it before all others.
    pub on_top: bool,
    /// From the shape's local coordinates to those of the world.
    pub local_to_world: DAffine3,
    /// What only this kind of shape can say.
    pub detail: HitDetail,
}

impl PickedPoint {
    /// The shape.
    #[must_use]
    pub fn node(&self) -> Option<NodeKey> {
        self.path.tail()
    }

    /// From the coordinates of the world to the shape's local ones.
    #[must_use]
    pub fn world_to_local(&self) -> DAffine3 {
        self.local_to_world.inverse()
    }
}

/// Finds where a ray meets the shapes of a scene.
///
/// A terrain is met on the surface that is asked for: by default the four coarse triangles of each of its active patches,
/// those of the picture that the camera takes (without a camera, of its finest patches), on the very triangles of that
/// picture, or exactly on every cell of its map. What is outside the picture is picked as well. No GPU is used.
///
/// Lines and points have no extent; they are met through the picture, within [`RayPickAction::radius`] pixels of the picked
/// place. The hit is the point of the line that is nearest there, as far along the ray as that point is deep in the picture.
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
    /// All crossings in order of distance (those on top before the others), instead of the first.
    pub all: bool,
    /// Width and height of the picture that pixels refer to and detail is chosen for.
    pub size: [u32; 2],
    /// Name of the camera; the first one if not given.
    pub camera: Option<String>,
    /// How far from the picked place of the picture lines and points are met, in pixels (of a stretched picture, in those of
    /// the direction that has more), from 0 up. A ray in world
    /// coordinates knows no pixels, and meets none.
    pub radius: f64,
}

impl RayPickAction {
    /// Open Inventor's radius for lines and points, in pixels.
    pub const RADIUS: f64 = 5.0;

    fn new(target: PickTarget, size: [u32; 2]) -> Self {
        Self { target, surface: Surface::default(), all: false, size, camera: None, radius: Self::RADIUS }
    }

    /// The first hit along a ray in world coordinates.
    #[must_use]
    pub fn ray(ray: Ray) -> Self {
        Self::new(PickTarget::Ray(ray), [1280, 720])
    }

    /// The first hit through the centre of a pixel of a picture of this size.
    #[must_use]
    pub fn pixel(x: u32, y: u32, size: [u32; 2]) -> Self {
        Self::new(PickTarget::Pixel(f64::from(x) + 0.5, f64::from(y) + 0.5), size)
    }

    /// The first hit through a point of a picture of this size, (0, 0) bottom left to (1, 1) top right, as Open Inventor's
    /// `setNormalizedPoint` has it.
    ///
    /// ```
    /// use seamount::prelude::*;
    ///
    /// let mut scene = Scene::new();
    /// let root = scene.root();
    /// let (position, look_at) = (Some(DVec3::Z * 9.0), Some(DVec3::ZERO));
    /// scene.add(root, OrthographicCamera { position, look_at, ..OrthographicCamera::default() })?;
    /// scene.add(root, Cube::default())?;
    /// // The camera sees a square from -1 to 1, the picture twice as much across.
    /// let hits = RayPickAction::normalized(0.5, 0.75, [200, 100]).apply(&scene)?;
    /// assert_eq!(hits[0].point, DVec3::new(0.0, 0.5, 1.0));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn normalized(x: f64, y: f64, size: [u32; 2]) -> Self {
        Self::new(PickTarget::Normalized(x, y), size)
    }

    /// What the ray meets, nearest first; empty if nothing.
    ///
    /// # Errors
    ///
    /// When the ray is none, a picture is asked for without a camera, or a shape can not be had.
    pub fn apply(&self, scene: &Scene) -> Result<Vec<PickedPoint>, ActionError> {
        let picker = self.picker(scene)?;
        match self.target {
            PickTarget::Ray(ray) => picker.pick(&ray, self.all),
            PickTarget::Pixel(x, y) => {
                picker.pick_through(x / f64::from(self.size[0]), y / f64::from(self.size[1]), self.all)
            }
            PickTarget::Point(x, y) => picker.pick_through(x, y, self.all),
            PickTarget::Normalized(x, y) => picker.pick_through(x, 1.0 - y, self.all),
        }
    }

    /// Everything that many picks of one scene have in common, found once.
    ///
    /// # Errors
    ///
    /// When the camera can not be used, or a shape that near and far depend on can not be had.
    pub fn picker<'s>(&self, scene: &'s Scene) -> Result<Picker<'s>, ActionError> {
        if !(self.radius >= 0.0 && self.radius.is_finite()) {
            return Err(ActionError::Radius(self.radius));
        }
        let cameras = Cameras::new(scene, self.size);
        let camera = cameras.camera_if_any(self.camera.as_deref())?;
        let crop = camera.as_ref().and_then(|(camera, _)| camera.crop(self.size)).map(|crop| crop.area);
        let fields = camera.as_ref().map(|(camera, _)| camera.fields);
        let limits = fields.map_or((None, None), |fields| (fields.near_distance, fields.far_distance));
        let viewpoint = camera.map(|(_, viewpoint)| viewpoint);
        let index = scene.index();
        let (surface, radius) = (self.surface, self.radius);
        let size = self.size.map(f64::from);
        let memos = Memos::default();
        Ok(Picker { scene, surface, viewpoint, cameras, frozen: None, limits, size, crop, index, radius, memos })
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
    /// Width and height of the picture in pixels.
    size: [f64; 2],
    /// What of it the camera's own picture is cropped to.
    crop: Option<PixelArea>,
    index: Option<Arc<Index>>,
    /// How far lines and points are met, in pixels.
    radius: f64,
    memos: Memos,
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

    /// What is met through a point of the picture, (0, 0) top left to (1, 1) bottom right: [`Picker::pick`] along
    /// [`Picker::ray_through`], and lines and points within the radius of [`RayPickAction::radius`]. Nothing where the camera's
    /// picture is cropped.
    ///
    /// # Errors
    ///
    /// As for these.
    pub fn pick_through(&self, x: f64, y: f64, all: bool) -> Result<Vec<PickedPoint>, ActionError> {
        let ray = self.ray_through(x, y)?;
        if self.crop.is_some_and(|area| !area.contains(x * self.size[0], y * self.size[1])) {
            return Ok(Vec::new());
        }
        let cone = self.viewpoint.as_ref().map(|view| PickCone::new(ray, view, self.radius));
        self.pick_with(&ray, cone.as_ref(), all, |_| true, &self.memos.lend(self.scene))
    }

    /// [`Picker::pick`] along many rays, on all cores: the same answers in the same order.
    ///
    /// # Errors
    ///
    /// That of the first ray which has one: it is none, or a shape can not be had.
    pub fn pick_many(&self, rays: &[Ray], all: bool) -> Result<Vec<Vec<PickedPoint>>, ActionError> {
        use rayon::prelude::*;
        // Answers are written where they stay, which a collection that ends with the first error would not do: its pieces were put
        // together by one thread.
        let failed = Mutex::new(None::<(usize, ActionError)>);
        let fail = |i: usize, error| {
            let mut failed = failed.lock().unwrap_or_else(PoisonError::into_inner);
            if failed.as_ref().is_none_or(|&(first, _)| i < first) {
                *failed = Some((i, error));
            }
            Vec::new()
        };
        // A pick takes about a microsecond; smaller pieces of work would cost more to hand out.
        let memo = || self.memos.lend(self.scene);
        let pick = |memo: &mut Lent<'_>, (i, ray)| {
            self.pick_with(ray, None, all, |_| true, memo).unwrap_or_else(|error| fail(i, error))
        };
        let found = rays.par_iter().enumerate().with_min_len(64).map_init(memo, pick).collect();
        match failed.into_inner().unwrap_or_else(PoisonError::into_inner) {
            Some((_, error)) => Err(error),
            None => Ok(found),
        }
    }

    /// What the ray meets, nearest first: the first, or all.
    ///
    /// # Errors
    ///
    /// When the ray is none, or a shape can not be had.
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
        self.pick_with(ray, None, all, wanted, &self.memos.lend(self.scene))
    }

    fn pick_with(
        &self,
        ray: &Ray,
        cone: Option<&PickCone>,
        all: bool,
        wanted: fn(&HitDetail) -> bool,
        memo: &Memo,
    ) -> Result<Vec<PickedPoint>, ActionError> {
        ray.check()?;
        let (far, local, found) = ([ray.far; 2], memo.hits.take(), Vec::new());
        let (unit, known) = (ray.unit(), Some(memo));
        let mut pick = Pick { picker: self, ray: *ray, unit, cone, far, all, wanted, memo: known, local, found };
        if !pick.indexed()? {
            // Only the index keeps the paths of places where they are.
            pick.memo = None;
            walk(self.scene, Branches::Seen(self.viewpoint.as_ref()), &mut pick)?;
        }
        let Pick { local, mut found, .. } = pick;
        memo.hits.replace(local);
        found.sort_by(order);
        if !all {
            found.truncate(1);
            found.shrink_to_fit();
        }
        Ok(found)
    }
}

/// The order of hits: those on top first, then by distance; at one distance in the order of the walk. Copies of one shape that
/// meet are told apart by where they stand and by what was hit, so that the order never depends on how it was found. But a terrain
/// tells its hits along the ray: at one distance, as at walls, into the ground and out again.
fn order(a: &PickedPoint, b: &PickedPoint) -> Ordering {
    fn by_numbers(a: &[f64], b: &[f64]) -> Ordering {
        let pairs = a.iter().zip(b);
        pairs.map(|(a, b)| a.total_cmp(b)).find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
    }
    let place = |hit: &PickedPoint| hit.local_to_world.to_cols_array();
    let what = |hit: &PickedPoint| match hit.detail {
        HitDetail::Terrain(_) => [[0.0; 3]; 2],
        _ => [hit.point.to_array(), hit.normal.to_array()],
    };
    b.on_top
        .cmp(&a.on_top)
        .then(a.distance.total_cmp(&b.distance))
        .then_with(|| a.path.indices().cmp(b.path.indices()))
        .then_with(|| by_numbers(&place(a), &place(b)))
        .then_with(|| by_numbers(what(a).as_flattened(), what(b).as_flattened()))
}

struct Pick<'p, 's> {
    picker: &'p Picker<'s>,
    ray: Ray,
    /// The length of its direction.
    unit: f64,
    /// Where lines and points are met, if the ray goes through a picture.
    cone: Option<&'p PickCone>,
    /// How far the ray goes for shapes that are not on top and for those that are: up to the nearest hit of the same rank.
    far: [f64; 2],
    all: bool,
    wanted: fn(&HitDetail) -> bool,
    memo: Option<&'p Memo>,
    local: Vec<ShapeHit>,
    found: Vec<PickedPoint>,
}

impl Pick<'_, '_> {
    /// Asks the scene's index which shapes the ray may meet; false if it takes a walk.
    fn indexed(&mut self) -> Result<bool, ActionError> {
        let scene = self.picker.scene;
        let Some(index) = &self.picker.index else { return Ok(false) };
        let mut outcome = Ok(());
        let ray = self.ray;
        let answered = index.ray(&ray, |place| {
            let shape = place.path.tail().and_then(|key| scene.role(key));
            if let (Some(Role::Shape(shape)), Ok(())) = (shape, &outcome) {
                outcome = self.shape(shape, &place.path, &place.state).map(|_| ());
            }
            match (self.all, index.on_top()) {
                (true, _) => ray.far,
                (_, on_top) => {
                    let [below, top] = self.far;
                    if on_top { below.max(top) } else { below }
                }
            }
        });
        outcome.map(|()| answered)
    }
}

impl Visitor for Pick<'_, '_> {
    fn action(&self) -> ActionKind {
        ActionKind::RayPick
    }

    fn shape(&mut self, shape: &dyn ShapeNode, path: &Path, state: &Arc<State>) -> Result<Go, ActionError> {
        let style = state.pick_style;
        let [below, top] = self.far;
        let far = if style.on_top() { top } else { below };
        if style == PickStyleKind::Unpickable {
            return Ok(Go::On);
        }
        // What is beside the ray is cut off by itself.
        let cone = self.cone.filter(|_| shape.beyond_box() && !style.boxed());
        let range = clipped(&self.ray, far, state);
        if range.is_none() && cone.is_none() {
            return Ok(Go::On);
        }
        let picker = self.picker;
        let cx = ShapeContext {
            viewpoint: picker.viewpoint.as_ref(),
            surface: picker.surface,
            cameras: Some(&picker.cameras),
            kept: picker.frozen.and_then(|view| view.kept(path)),
            memo: self.memo,
            ..ShapeContext::new(picker.scene, state, path)
        };
        // A shape flattened by its transform has no inside to meet.
        let Some(inverse) = super::state::inverse(&state.model.matrix3) else {
            return Ok(Go::On);
        };
        // The translation is subtracted first: far from the origin the digits are there.
        let local = |(near, far)| Ray {
            origin: inverse * (self.ray.origin - state.model.translation),
            direction: inverse * self.ray.direction,
            near,
            far,
        };
        self.local.clear();
        // Of faces that look away the first hides none behind it.
        let front_only = style == PickStyleKind::ShapeFrontfaces;
        if let Some(local) = range.map(local) {
            if style.boxed() {
                // A ray of the world knows no picture: what has a size in pixels is boxed by its place.
                let cx = ShapeContext { viewpoint: cx.viewpoint.filter(|_| self.cone.is_some()), ..cx };
                if let Some(bounds) = shape.bounds(&cx).map_err(|e| cx.error(e))? {
                    meet_box(&cx, &bounds, &local, &mut self.local).map_err(|e| cx.error(e))?;
                }
            } else {
                shape.ray(&cx, &local, !self.all && !front_only, &mut self.local).map_err(|e| cx.error(e))?;
            }
        }
        if let Some(cone) = cone {
            shape.near(&cx, cone, far, &mut self.local).map_err(|e| cx.error(e))?;
        }
        let towards = inverse * self.ray.direction;
        for hit in self.local.iter().filter(|hit| (self.wanted)(&hit.detail)) {
            // Inverse transposes keep the sign of the product of a normal and a direction.
            if front_only && hit.normal.dot(towards) >= 0.0 {
                continue;
            }
            // Most picks meet one thing; a list that grows by itself would begin with room for four.
            self.found.reserve_exact(usize::from(self.found.is_empty()));
            // A sum of 0 and −0 is 0.
            self.found.push(PickedPoint { distance: 0.0 + hit.t * self.unit, ..picked(hit, state, path) });
            if !self.all {
                let far = self.far.iter_mut().skip(usize::from(style.on_top())).take(1);
                far.for_each(|far| *far = far.min(hit.t));
            }
        }
        Ok(Go::On)
    }
}

/// The ray's range up to `far` in front of all clip planes; nothing if they leave none.
fn clipped(ray: &Ray, mut far: f64, state: &State) -> Option<(f64, f64)> {
    let mut near = ray.near;
    for plane in state.clip_planes.iter() {
        let height = plane.normal.dot(ray.origin - plane.point);
        let rise = plane.normal.dot(ray.direction);
        let crossing = -height / rise;
        if rise > 0.0 {
            near = near.max(crossing);
        } else if rise < 0.0 {
            far = far.min(crossing);
        } else if height < 0.0 {
            return None;
        }
    }
    (near <= far).then_some((near, far))
}

/// Where a ray meets the surface of a box.
fn meet_box(
    cx: &ShapeContext<'_>,
    bounds: &Aabb,
    ray: &Ray,
    hits: &mut Vec<ShapeHit>,
) -> Result<(), super::ShapeError> {
    let (center, size) = (bounds.center(), bounds.size());
    let cube = Cube { width: size.x, height: size.y, depth: size.z };
    let start = hits.len();
    cube.ray(cx, &Ray { origin: ray.origin - center, ..*ray }, false, hits)?;
    for hit in hits.iter_mut().skip(start) {
        (hit.point, hit.detail) = (hit.point + center, HitDetail::None);
    }
    Ok(())
}

fn picked(hit: &ShapeHit, state: &State, path: &Path) -> PickedPoint {
    let model = &state.model;
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
        on_top: state.pick_style.on_top(),
        local_to_world: *model,
        detail: hit.detail,
    }
}
