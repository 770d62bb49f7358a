//! How high the ground is at a place, and whether two points see each other.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing))]

use glam::{DVec2, DVec3};

use super::{ActionError, PickedPoint, Picker, Ray, RayPickAction, Surface};
use crate::node::{HitDetail, TerrainDetail};
use crate::scene::Scene;

/// The ground at a place of the world's (x, y) plane.
#[derive(Debug, Clone, PartialEq)]
pub struct GroundPoint {
    /// World z.
    pub height: f64,
    /// Slope ∂z/∂x and ∂z/∂y in world coordinates; infinite or NaN where the ground stands upright.
    pub gradient: DVec2,
    /// The place as a pick sees it: normals, the terrain, cell, void or not, and the bound of the error.
    pub picked: PickedPoint,
}

fn exact(scene: &Scene) -> Result<Picker<'_>, ActionError> {
    RayPickAction { surface: Surface::Exact, ..RayPickAction::pixel(0, 0, [1, 1]) }.picker(scene)
}

/// What a hit on the line from `a` to `b` may be off by: coordinates are taken to the shape's own and back with a few roundings each.
fn rounding(a: DVec3, b: DVec3, hit: &PickedPoint) -> f64 {
    16.0 * f64::EPSILON * (a.length() + b.length() + hit.point.length())
}

fn is_terrain(detail: &HitDetail) -> bool {
    matches!(detail, HitDetail::Terrain(_))
}

impl Scene {
    /// The ground at a place of the world, on every cell of the maps: [`Picker::height_at`] on the exact surface. For many
    /// places make one picker.
    ///
    /// # Errors
    ///
    /// When the place is not finite, or a shape can not be had.
    ///
    /// ```
    /// use seamount::prelude::*;
    ///
    /// let mut scene = Scene::new();
    /// let root = scene.root();
    /// // A slope that rises to the east, 20 wide and 10 high, 100 above the origin.
    /// scene.add(root, Transform { translation: DVec3::new(0.0, 0.0, 100.0), ..Transform::default() })?;
    /// scene.add(root, Texture2::from_image(Image::new(3, 3, Pixels::GrayF32([0.0, 0.5, 1.0].repeat(3)))?))?;
    /// scene.add(root, SeamlessTerrain { scale: 20.0, max_height: 10.0, ..SeamlessTerrain::default() })?;
    ///
    /// let ground = scene.height_at(15.0, 5.0)?.expect("there is ground");
    /// assert_eq!((ground.height, ground.gradient), (107.5, DVec2::new(0.5, 0.0)));
    /// assert_eq!(scene.height_at(-1.0, 5.0)?, None);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn height_at(&self, x: f64, y: f64) -> Result<Option<GroundPoint>, ActionError> {
        exact(self)?.height_at(x, y)
    }

    /// The first obstacle between two points of the world, `None` if they see each other: [`Picker::line_of_sight`] on the
    /// exact surface. For many lines make one picker.
    ///
    /// # Errors
    ///
    /// When a point is not finite, or a shape can not be had.
    ///
    /// ```
    /// use seamount::prelude::*;
    ///
    /// // A ridge from north to south, 10 high, in a plain 20 wide.
    /// let mut scene = Scene::new();
    /// let root = scene.root();
    /// scene.add(root, Texture2::from_image(Image::new(5, 5, Pixels::GrayF32([0.0, 0.0, 1.0, 0.0, 0.0].repeat(5)))?))?;
    /// scene.add(root, SeamlessTerrain { scale: 20.0, max_height: 10.0, ..SeamlessTerrain::default() })?;
    ///
    /// let (west, east) = (DVec3::new(2.0, 10.0, 5.0), DVec3::new(18.0, 10.0, 5.0));
    /// let obstacle = scene.line_of_sight(west, east)?.expect("the ridge is higher");
    /// assert!(obstacle.point.distance(DVec3::new(7.5, 10.0, 5.0)) < 1e-9);
    /// // The top of the ridge, on the ground as it is, is seen from either side.
    /// assert_eq!(scene.line_of_sight(west, DVec3::new(10.0, 10.0, 10.0))?, None);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn line_of_sight(&self, a: DVec3, b: DVec3) -> Result<Option<PickedPoint>, ActionError> {
        exact(self)?.line_of_sight(a, b)
    }
}

impl Picker<'_> {
    /// The ground at a place of the world: the topmost point of all terrains on the line through (x, y) along the world's z,
    /// whatever transforms they stand under. `None` where there is no terrain. Other shapes do not count.
    ///
    /// # Errors
    ///
    /// When the place is not finite, or a shape can not be had.
    pub fn height_at(&self, x: f64, y: f64) -> Result<Option<GroundPoint>, ActionError> {
        let Some(bounds) = self.cameras.bounds()? else {
            return Ok(None);
        };
        // From above everything: by the height of it all, so that rounding at the top does not matter.
        let top = bounds.max.z + (bounds.max.z - bounds.min.z) + bounds.max.z.abs().max(1.0);
        let down = Ray::new(DVec3::new(x, y, top), DVec3::NEG_Z)?;
        let Some(mut picked) = self.pick_of(&down, false, is_terrain)?.pop() else {
            return Ok(None);
        };
        if picked.on_top {
            // Before all others, but perhaps not above them.
            let all = self.pick_of(&down, true, is_terrain)?;
            picked = all.into_iter().min_by(|a, b| a.distance.total_cmp(&b.distance)).unwrap_or(picked);
        }
        let gradient = -picked.normal.truncate() / picked.normal.z;
        Ok(Some(GroundPoint { height: picked.point.z, gradient, picked }))
    }

    /// The first obstacle on the straight line from `a` to `b`, points of the world; `None` if they see each other. All
    /// shapes are in the way, terrains with the surface of this picker.
    ///
    /// Terrains are known up to the bound of error that a hit carries (rounding, on the exact surface), and so is the view over
    /// them: from an end on, the line may go below the ground by up to twice that bound, measured along the terrain's own z, and
    /// is not blocked. Twice, since walls between coarse patches are as high again. An end further below does not see out and is not
    /// seen: a line that starts there is blocked where it comes out at the latest, and one that never does, by the ground above that end.
    /// A point sees itself.
    ///
    /// # Errors
    ///
    /// When a point is not finite, or a shape can not be had.
    pub fn line_of_sight(&self, a: DVec3, b: DVec3) -> Result<Option<PickedPoint>, ActionError> {
        if a == b && a.is_finite() {
            return Ok(None);
        }
        let length = (b - a).length();
        let ray = Ray::new(a, b - a)?.with_range(0.0, length)?;
        let Some(first) = self.pick(&ray, false)?.pop() else {
            // From beside a terrain, or through a hole, the line may have come below it.
            return match self.ground_above(a, b)? {
                None => self.ground_above(b, a),
                found => Ok(found),
            };
        };
        // Whether what is met is no more than an end that lies on the ground.
        let is_end = |hit: &PickedPoint| {
            let rounding = rounding(a, b, hit);
            let HitDetail::Terrain(detail) = hit.detail else {
                let slack = rounding / hit.normal.dot(ray.direction).abs();
                return Ok(hit.distance <= slack || hit.distance >= length - slack);
            };
            // Between where the line crosses the ground and the end on the other side of it, is it ever below by more? Not if
            // it is clear when it is lifted by as much.
            let [from, to] = if detail.entering { [hit.point, b] } else { [a, hit.point] };
            let lift = 2.0 * (rounding + hit.error_bound.unwrap_or(0.0));
            let up = hit.local_to_world.matrix3.z_axis.normalize_or_zero();
            Ok::<_, ActionError>(self.first_terrain(from + up * lift, to - from)?.is_none())
        };
        // Nearly always the first hit decides.
        if !is_end(&first)? {
            return Ok(Some(first));
        }
        for hit in self.pick(&ray, true)? {
            if !is_end(&hit)? {
                return Ok(Some(hit));
            }
        }
        Ok(None)
    }

    /// What blocks the line from `a` to `b` if it meets nothing: where it is below the ground all along.
    fn ground_above(&self, a: DVec3, b: DVec3) -> Result<Option<PickedPoint>, ActionError> {
        // Where a line upwards comes out of the ground.
        let out = |up: DVec3| -> Result<Option<PickedPoint>, ActionError> {
            let ground = self.pick_of(&Ray::new(a, up)?, false, is_terrain)?.pop();
            Ok(ground
                .filter(|ground| matches!(ground.detail, HitDetail::Terrain(TerrainDetail { entering: false, .. }))))
        };
        let Some(mut ground) = out(DVec3::Z)? else { return Ok(None) };
        // A terrain that leans may be above what lies on it: up is along its own z.
        let up = ground.local_to_world.matrix3.z_axis.normalize_or(DVec3::Z);
        if up != DVec3::Z {
            let Some(above) = out(up)? else { return Ok(None) };
            ground = above;
        }
        let lift = 2.0 * (rounding(a, b, &ground) + ground.error_bound.unwrap_or(0.0));
        if ground.distance > lift { Ok(Some(ground)) } else { self.first_terrain(a + up * lift, b - a) }
    }

    /// The first terrain on the way from a point; nothing on a way of no length.
    fn first_terrain(&self, from: DVec3, way: DVec3) -> Result<Option<PickedPoint>, ActionError> {
        if way == DVec3::ZERO {
            return Ok(None);
        }
        let ray = Ray::new(from, way)?.with_range(0.0, way.length())?;
        Ok(self.pick_of(&ray, false, is_terrain)?.pop())
    }
}
