//! Rays and their meeting with triangles, in f64.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing))]

use glam::{DAffine3, DVec2, DVec3};
use thiserror::Error;

use crate::node::{HitDetail, ShapeHit, Triangle};

/// Six numbers that are no ray.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum RayError {
    /// A coordinate is NaN or infinite.
    #[error("the ray has a coordinate that is not a finite number: origin {origin}, direction {direction}")]
    NotFinite {
        /// The origin given.
        origin: DVec3,
        /// The direction given.
        direction: DVec3,
    },
    /// The direction has no length.
    #[error("the ray's direction is zero: it points nowhere")]
    NoDirection,
    /// Near and far do not make a range.
    #[error("the ray's range {near}..{far} is empty: near has to be from 0 up, and not more than far")]
    Range {
        /// Start of the range.
        near: f64,
        /// End of the range.
        far: f64,
    },
}

/// A half-line with a range of its parameter: points `origin + t · direction`, `near <= t <= far`.
///
/// The direction need not be of unit length; `t` counts in its length. A ray taken into other coordinates keeps its `t`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Where t = 0 is.
    pub origin: DVec3,
    /// Where it goes; any length but zero.
    pub direction: DVec3,
    /// Smallest t, from 0 up.
    pub near: f64,
    /// Largest t; may be infinite.
    pub far: f64,
}

impl Ray {
    /// A half-line from `origin` on.
    ///
    /// # Errors
    ///
    /// When a coordinate is NaN or infinite or the direction is zero.
    ///
    /// ```
    /// use glam::DVec3;
    /// use seamount::action::{Ray, RayError};
    ///
    /// assert!(Ray::new(DVec3::ZERO, DVec3::NEG_Z).is_ok());
    /// assert_eq!(Ray::new(DVec3::ZERO, DVec3::ZERO), Err(RayError::NoDirection));
    /// // However short the direction is.
    /// let ray = Ray::new(DVec3::ZERO, DVec3::NEG_Z * 1e-320)?;
    /// assert!((ray.direction - DVec3::NEG_Z).length() < 1e-15);
    /// # Ok::<(), RayError>(())
    /// ```
    pub fn new(origin: DVec3, direction: DVec3) -> Result<Self, RayError> {
        let ray = Self { origin, direction, near: 0.0, far: f64::INFINITY };
        ray.check()?;
        // Scaling by a power of two is exact; it keeps squares of tiny and huge directions in range. In two steps, as the power
        // itself may not be a number.
        let exponent = direction.abs().max_element().log2().floor();
        let half = (0.5 * exponent).floor();
        let direction = direction * (-half).exp2() * (half - exponent).exp2();
        Ok(Self { direction: direction.normalize(), ..ray })
    }

    /// The same ray with a range of distances.
    ///
    /// # Errors
    ///
    /// [`RayError::Range`] when it is empty, starts before the origin, or is NaN.
    pub fn with_range(self, near: f64, far: f64) -> Result<Self, RayError> {
        let ray = Self { near, far, ..self };
        ray.check().map(|()| ray)
    }

    /// Whether it is a ray: its fields can be set to anything.
    ///
    /// # Errors
    ///
    /// As for [`Ray::new`] and [`Ray::with_range`].
    ///
    /// ```
    /// use glam::DVec3;
    /// use seamount::action::Ray;
    ///
    /// let ray = Ray::new(DVec3::ZERO, DVec3::X)?;
    /// assert!(ray.check().is_ok());
    /// assert!(Ray { far: f64::NAN, ..ray }.check().is_err());
    /// # Ok::<(), seamount::action::RayError>(())
    /// ```
    pub fn check(&self) -> Result<(), RayError> {
        let Self { origin, direction, near, far } = *self;
        if !origin.is_finite() || !direction.is_finite() {
            return Err(RayError::NotFinite { origin, direction });
        }
        if direction == DVec3::ZERO {
            return Err(RayError::NoDirection);
        }
        let is_range = near >= 0.0 && near.is_finite() && near <= far;
        if is_range { Ok(()) } else { Err(RayError::Range { near, far }) }
    }

    /// The length of t = 1: exactly 1 for directions of unit length, however they were rounded.
    pub(crate) fn unit(&self) -> f64 {
        let squared = self.direction.length_squared();
        // With u = EPSILON / 2: normalizing is off by at most 5 u (3 of the square, halved by the root, and 1 each for root,
        // inverse and product), the square of that by 10 u, and working it out adds 3 u.
        if (squared - 1.0).abs() <= 8.0 * f64::EPSILON { 1.0 } else { self.direction.length() }
    }

    /// The point at parameter t.
    #[must_use]
    pub fn at(&self, t: f64) -> DVec3 {
        self.origin + self.direction * t
    }

    /// The same ray in other coordinates; t keeps its meaning.
    #[must_use]
    pub fn transformed(&self, map: &DAffine3) -> Self {
        Self { origin: map.transform_point3(self.origin), direction: map.transform_vector3(self.direction), ..*self }
    }
}

/// Where a ray meets a triangle, its edges and corners included, from both sides. A ray in the triangle's plane misses.
///
/// After Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection" (JCGT 2013): the corners are sheared so that the
/// ray is the z axis; the signs of the three edge functions then decide, and neighbours that share an edge compute the same
/// value for it.
#[must_use]
pub fn intersect_triangle(ray: &Ray, triangle: &Triangle) -> Option<ShapeHit> {
    meet_triangle(ray, triangle.points).map(|meeting| meeting.hit(triangle))
}

/// A ray and a triangle that meet.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Meeting {
    pub(crate) t: f64,
    /// Weights of the corners.
    pub(crate) weights: [f64; 3],
    /// Whether the ray goes through the edge opposite of each corner.
    on: [bool; 3],
}

impl Meeting {
    pub(crate) fn mix(&self, of: [DVec3; 3]) -> DVec3 {
        let [a, b, c] = of;
        let [u, v, w] = self.weights;
        a * u + b * v + c * w
    }

    pub(crate) fn hit(&self, triangle: &Triangle) -> ShapeHit {
        let ([a, b, c], [u, v, w]) = (triangle.uvs, self.weights);
        let uv: DVec2 = a * u + b * v + c * w;
        let normal = self.mix(triangle.normals);
        ShapeHit {
            t: self.t,
            point: self.mix(triangle.points),
            normal,
            smooth_normal: normal,
            uv,
            detail: HitDetail::None,
        }
    }
}

/// [`intersect_triangle`] for the corners alone.
#[inline]
pub(crate) fn meet_triangle(ray: &Ray, points: [DVec3; 3]) -> Option<Meeting> {
    let d = ray.direction;
    let a = d.abs();
    // The axis that the ray follows most becomes z.
    let z = if a.x >= a.y && a.x >= a.z { 0 } else { usize::from(a.y >= a.z) + 2 * usize::from(a.y < a.z) };
    let (x, y) = ((z + 1) % 3, (z + 2) % 3);
    let [p0, p1, p2] = points.map(|p| {
        let p = p - ray.origin;
        let depth = p[z] / d[z];
        DVec3::new(p[x] - d[x] * depth, p[y] - d[y] * depth, depth)
    });
    let edge = |a: DVec3, b: DVec3| a.x * b.y - a.y * b.x;
    let (u, v, w) = (edge(p1, p2), edge(p2, p0), edge(p0, p1));
    if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
        return None;
    }
    let sum = u + v + w;
    if sum == 0.0 {
        return None;
    }
    let on = [u == 0.0, v == 0.0, w == 0.0];
    let (u, v, w) = (u / sum, v / sum, w / sum);
    let t = u * p0.z + v * p1.z + w * p2.z;
    (t >= ray.near && t <= ray.far).then_some(Meeting { t, weights: [u, v, w], on })
}

/// The edges and corners that a ray was found to go through, so that a crossing there counts once and not once for each
/// triangle around it. Neighbours compute the same value for an edge that they share, so both find it exactly zero, or
/// none does.
#[derive(Debug, Default)]
pub(crate) struct Crossings {
    /// Ends of the edges, sorted; a corner is an edge from itself to itself.
    found: Vec<[DVec3; 2]>,
}

impl Crossings {
    /// Whether the ray is met here for the first time.
    pub(crate) fn is_new(&mut self, points: [DVec3; 3], meeting: &Meeting) -> bool {
        let [a, b, c] = points;
        let [p, q, r] = meeting.on;
        // Rounding may let a ray beside a corner seem to go through both edges there: the neighbours across either of them
        // see theirs, those around a true corner the corner.
        let features = [
            p.then_some([b, c]),
            q.then_some([c, a]),
            r.then_some([a, b]),
            (q && r).then_some([a, a]),
            (r && p).then_some([b, b]),
            (p && q).then_some([c, c]),
        ];
        let start = self.found.len();
        for [p, q] in features.into_iter().flatten() {
            let in_order = p.to_array().partial_cmp(&q.to_array()).is_none_or(std::cmp::Ordering::is_le);
            self.found.push(if in_order { [p, q] } else { [q, p] });
        }
        let (before, now) = self.found.split_at(start);
        !now.iter().any(|feature| before.contains(feature))
    }
}
