//! Which lines and points are near enough to a ray to be picked, in f64.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing))]

use glam::{DAffine3, DVec3};

use super::{Lens, PlacedPlane, Ray, ShapeContext, Viewpoint};
use crate::node::{HitDetail, LineDetail, PointDetail, ShapeHit, ShapeNode};

/// The part of space around a ray within which lines and points are met: all that a picture shows within so many pixels of
/// the picked place.
///
/// Distances are measured across the view, where depth is the same, so that they are distances in the picture: at depth d
/// along [`PickCone::forward`] from the ray's origin the radius is `start + growth · d` in world units. In perspective the start
/// is 0, since the ray begins at the eye; for parallel rays the growth is.
///
/// ```
/// use seamount::action::PickCone;
/// use seamount::prelude::*;
///
/// let mut scene = Scene::new();
/// let root = scene.root();
/// let (position, look_at) = (Some(DVec3::Z * 10.0), Some(DVec3::ZERO));
/// scene.add(root, OrthographicCamera { position, look_at, height: 2.0, ..OrthographicCamera::default() })?;
/// let view = RenderAction::new(200, 100).viewpoint(&scene)?;
/// let (origin, direction) = view.ray(0.5, 0.5);
/// // Two units in 100 pixels.
/// let cone = PickCone::new(Ray::new(origin, direction)?, &view, 5.0);
/// assert_eq!((cone.start, cone.growth), (0.1, 0.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PickCone {
    /// The ray in the middle, in world coordinates.
    pub ray: Ray,
    /// Unit vector into the picture; not across the ray.
    pub forward: DVec3,
    /// The radius where the ray begins, world units.
    pub start: f64,
    /// What the radius grows by per unit of depth.
    pub growth: f64,
}

/// The place of a piece of a line that is nearest to the picked place in the picture.
#[derive(Debug, Clone, Copy)]
struct Nearest {
    /// From the start of the piece, 0, to its end, 1.
    along: f64,
    /// The ray's parameter at the same depth.
    t: f64,
    /// Distance in radii.
    radii: f64,
    /// Whether it is the very start or end of the piece, and not where something cuts it.
    at_start: bool,
    at_end: bool,
}

impl PickCone {
    /// What a picture shows within `radius` pixels of where this ray goes through it.
    #[must_use]
    pub fn new(ray: Ray, view: &Viewpoint, radius: f64) -> Self {
        let (start, growth) = match view.lens {
            Lens::Perspective { tan_half_height: t } => (0.0, 2.0 * t / view.pixels * radius),
            Lens::Orthographic { half_height: h } => (2.0 * h / view.pixels * radius, 0.0),
        };
        // What is nearer than the near plane is not drawn, and not picked.
        let slant = ray.direction.dot(view.forward);
        let far = view.far.map_or(ray.far, |far| ray.far.min(far / slant));
        Self { ray: Ray { near: ray.near.max(view.near / slant), far, ..ray }, forward: view.forward, start, growth }
    }

    /// The nearest place of a piece of a line, or of a point, which is a piece without length. Nothing where all of it is
    /// before or beyond the ray's range, or cut off.
    ///
    /// Offset from the ray over radius is a projective map, so that a piece becomes a piece of a line there: its point nearest
    /// to 0 is found as usual, and taken back.
    fn nearest(&self, piece: [DVec3; 2], planes: &[PlacedPlane]) -> Option<Nearest> {
        let [a, b] = piece.map(|p| p - self.ray.origin);
        let slant = self.ray.direction.dot(self.forward);
        let depths = [a.dot(self.forward), b.dot(self.forward)];
        let (mut from, mut to) = (0.0f64, 1.0f64);
        // Keeps where a function that is linear along the piece is not negative.
        let mut keep = |[at_a, at_b]: [f64; 2]| {
            let crossing = at_a / (at_a - at_b);
            match (at_a >= 0.0, at_b >= 0.0) {
                (true, true) => true,
                (true, false) => {
                    to = to.min(crossing);
                    from <= to
                }
                (false, true) => {
                    from = from.max(crossing);
                    from <= to
                }
                (false, false) => false,
            }
        };
        let near = self.ray.near * slant;
        if !keep(depths.map(|d| d - near)) {
            return None;
        }
        let far = self.ray.far * slant;
        if far.is_finite() && !keep(depths.map(|d| far - d)) {
            return None;
        }
        for plane in planes {
            if !keep(piece.map(|p| plane.normal.dot(p - plane.point))) {
                return None;
            }
        }
        let [(p, r), (q, s)] = [from, to].map(|along| {
            let (place, depth) = (a + (b - a) * along, depths[0] + (depths[1] - depths[0]) * along);
            let radius = self.start + self.growth * depth;
            ((place - self.ray.direction * (depth / slant)) / radius, radius)
        });
        let way = q - p;
        let length = way.length_squared();
        let step = if length > 0.0 { (-p.dot(way) / length).clamp(0.0, 1.0) } else { 0.0 };
        // Back from the quotient: weights are the radii of the other end.
        let along = from + (to - from) * (step * r / (s * (1.0 - step) + r * step));
        let depth = depths[0] + (depths[1] - depths[0]) * along;
        Some(Nearest {
            along,
            t: depth / slant,
            radii: (p + way * step).length(),
            at_start: along == 0.0,
            at_end: along == 1.0,
        })
    }
}

/// Finds the places of lines and points within a cone, in the coordinates of a shape.
///
/// A line is met where it is nearer than on both sides of there, once at each such place; a point is met by itself.
#[derive(Debug)]
pub struct Near<'a> {
    cone: &'a PickCone,
    model: &'a DAffine3,
    planes: &'a [PlacedPlane],
    far: f64,
    normal: DVec3,
    /// The end of the piece before, where that is its nearest place.
    open: Option<ShapeHit>,
    hits: &'a mut Vec<ShapeHit>,
}

impl<'a> Near<'a> {
    /// For the shape at this place; hits beyond `far` along the ray are left out.
    #[must_use]
    pub fn new(cx: &ShapeContext<'a>, cone: &'a PickCone, far: f64, hits: &'a mut Vec<ShapeHit>) -> Self {
        let model = &cx.state.model;
        // A line has no side: what comes out in the world looks back along the ray. Normals are taken there by the inverse
        // transpose, so the transpose brings them here.
        let normal = model.matrix3.transpose() * -cone.ray.direction;
        Self { cone, model, planes: &cx.state.clip_planes, far, normal, open: None, hits }
    }

    /// A piece of a line in local coordinates; `joined` if it goes on where the one before ended. The detail is given how far
    /// along the piece the place is, 0 to 1, and may bring a normal.
    pub fn piece(&mut self, piece: [DVec3; 2], joined: bool, detail: impl FnOnce(f64) -> (HitDetail, Option<DVec3>)) {
        let [a, b] = piece;
        if joined && a == b {
            return;
        }
        if !joined {
            self.finish();
        }
        let before = self.open.take();
        let Some(nearest) = self.cone.nearest(piece.map(|p| self.model.transform_point3(p)), self.planes) else {
            self.hits.extend(before);
            return;
        };
        if joined && nearest.at_start {
            // Nearest where the two meet, or else nearer on the piece before.
            self.hits.extend(before);
            return;
        }
        // Of a radius of 0 the quotient may be no number: met is what is known to be within.
        if !(nearest.radii <= 1.0 && nearest.t <= self.far) {
            return;
        }
        let (detail, normal) = detail(nearest.along);
        let normal = normal.unwrap_or(self.normal);
        let point = a + (b - a) * nearest.along;
        let uv = glam::DVec2::ZERO;
        let hit = ShapeHit { t: nearest.t, point, normal, smooth_normal: normal, uv, detail };
        if nearest.at_end {
            self.open = Some(hit);
        } else {
            self.hits.push(hit);
        }
    }

    /// A point in local coordinates.
    pub fn point(&mut self, point: DVec3, detail: impl FnOnce() -> (HitDetail, Option<DVec3>)) {
        self.piece([point; 2], false, |_| detail());
        self.finish();
    }

    /// Takes what the last piece left open. To be called at the end.
    pub fn finish(&mut self) {
        self.hits.extend(self.open.take());
    }

    /// The lines and points that a shape hands over: pieces that go on where the one before ended are one line.
    pub(crate) fn pieces_of<S: ShapeNode + ?Sized>(
        &mut self,
        shape: &S,
        cx: &ShapeContext<'_>,
    ) -> Result<(), super::ShapeError> {
        let (mut line, mut piece, mut end) = (0, 0, None);
        shape.lines(cx, &mut |points| {
            let joined = end == Some(points[0]);
            (line, piece) = match (joined, end) {
                (true, _) => (line, piece + 1),
                (false, Some(_)) => (line + 1, 0),
                (false, None) => (0, 0),
            };
            let points_of_line = [piece, piece + 1];
            end = Some(points[1]);
            self.piece(points, joined, |along| {
                (HitDetail::Line(LineDetail { line, piece, points: points_of_line, along }), None)
            });
        })?;
        self.finish();
        let mut index = 0;
        shape.points(cx, &mut |point| {
            self.point(point, || (HitDetail::Point(PointDetail { index, point: index }), None));
            index += 1;
        })
    }
}
