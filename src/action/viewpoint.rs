//! A camera placed in the world, in f64: where it stands, where it looks, and the rays through its pixels.

use glam::{DMat4, DVec2, DVec3, DVec4};

use crate::terrain::Frustum;

/// How a camera maps directions to the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Lens {
    /// Rays spread from the eye. The tangent of half the vertical field of view.
    Perspective {
        /// tan(field of view / 2), positive and finite.
        tan_half_height: f64,
    },
    /// Rays are parallel.
    Orthographic {
        /// Half the height of the picture in world units, positive and finite.
        half_height: f64,
    },
}

impl Lens {
    /// Half the height of the picture: the tangent of a perspective lens, the length of an orthographic one.
    #[must_use]
    pub fn half_height(self) -> f64 {
        let (Lens::Perspective { tan_half_height: half } | Lens::Orthographic { half_height: half }) = self;
        half
    }
}

/// A camera as the actions use it: an eye, an orthonormal basis and a lens, in world coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Viewpoint {
    /// The eye.
    pub eye: DVec3,
    /// Unit vector to the right of the picture.
    pub right: DVec3,
    /// Unit vector to the top of the picture.
    pub up: DVec3,
    /// Unit vector into the picture.
    pub forward: DVec3,
    /// Field of view.
    pub lens: Lens,
    /// Where the middle of the picture is, in halves of its width and height to the right of and above where `forward` goes:
    /// zero, but for a camera that looks beside the middle of its picture.
    pub center: DVec2,
    /// Width over height of what is seen in the picture.
    pub aspect: f64,
    /// Height of the picture in pixels. Where the picture is stretched, so that they are not square, the height that it would
    /// have if they were, and as many to a length as there are in the direction that has more.
    pub pixels: f64,
    /// Distance along `forward` from which on things are seen; positive.
    pub near: f64,
    /// Distance along `forward` up to which things are seen; `None` without limit.
    pub far: Option<f64>,
}

impl Viewpoint {
    /// From world axes with the origin at the eye to clip space, with reversed z: 1 at `near`, 0 at `far` or at infinity.
    ///
    /// The rotation and the projection, multiplied in f64; multiply by the model matrix relative to the eye and round once.
    #[must_use]
    pub fn clip_from_eye(&self) -> DMat4 {
        let (r, u, f) = (self.right, self.up, self.forward);
        // Rows of the rotation: x right, y up, z = depth along `forward`.
        let rotate = DMat4::from_cols(
            DVec4::new(r.x, u.x, f.x, 0.0),
            DVec4::new(r.y, u.y, f.y, 0.0),
            DVec4::new(r.z, u.z, f.z, 0.0),
            DVec4::W,
        );
        let (x, y, perspective) = match self.lens {
            Lens::Perspective { tan_half_height: t } => (1.0 / (t * self.aspect), 1.0 / t, true),
            Lens::Orthographic { half_height: h } => (1.0 / (h * self.aspect), 1.0 / h, false),
        };
        // With depth d, the third row is (a·d + b), divided by d in perspective.
        let (a, b) = match (perspective, self.far) {
            (true, None) => (0.0, self.near),
            (true, Some(far)) => (-self.near / (far - self.near), self.near * far / (far - self.near)),
            (false, far) => {
                // An open orthographic depth has no linear scale; callers give one from the scene's box.
                let far = far.unwrap_or(self.near + 1.0);
                (-1.0 / (far - self.near), far / (far - self.near))
            }
        };
        // The picture's middle moves to zero: by as much as what x and y are divided by.
        let aside = -self.center.extend(0.0).extend(0.0);
        let (per_depth, once) = if perspective { (1.0, 0.0) } else { (0.0, 1.0) };
        let project = DMat4::from_cols(
            DVec4::new(x, 0.0, 0.0, 0.0),
            DVec4::new(0.0, y, 0.0, 0.0),
            aside * per_depth + DVec4::new(0.0, 0.0, a, per_depth),
            aside * once + DVec4::new(0.0, 0.0, b, once),
        );
        project * rotate
    }

    /// Origin and direction (unit length) of the ray through a point of the picture: (0, 0) is the top left corner, (1, 1)
    /// the bottom right. Made from the basis and the angle, not by inverting a projection.
    ///
    /// The origin is the eye in perspective; in an orthographic picture it lies in the plane through the eye.
    #[must_use]
    pub fn ray(&self, x: f64, y: f64) -> (DVec3, DVec3) {
        let [sx, sy] = (DVec2::new(2.0 * x - 1.0, 1.0 - 2.0 * y) + self.center).to_array();
        match self.lens {
            Lens::Perspective { tan_half_height: t } => {
                let direction = self.forward + self.right * (sx * t * self.aspect) + self.up * (sy * t);
                (self.eye, direction.normalize())
            }
            Lens::Orthographic { half_height: h } => {
                (self.eye + self.right * (sx * h * self.aspect) + self.up * (sy * h), self.forward)
            }
        }
    }

    /// Half the width and half the height of the picture: tangents of a perspective lens, lengths of an orthographic one.
    #[must_use]
    pub fn half_size(&self) -> DVec2 {
        let half = self.lens.half_height();
        DVec2::new(half * self.aspect, half)
    }

    /// The lower left and the upper right corner of the picture, right and up from where `forward` goes, in the same.
    #[must_use]
    pub fn window(&self) -> [DVec2; 2] {
        let half = self.half_size();
        [half * (self.center - 1.0), half * (self.center + 1.0)]
    }

    /// Area in pixels of the rectangle around a box of the world in the picture, cut at its border; the whole picture when the
    /// box reaches behind the eye.
    #[must_use]
    pub fn area_of(&self, bounds: &super::Aabb) -> f64 {
        let clip = self.clip_from_eye();
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for corner in bounds.corners() {
            let p = clip * (corner - self.eye).extend(1.0);
            if p.w <= 0.0 {
                (low, high) = (DVec2::NEG_ONE, DVec2::ONE);
                break;
            }
            let p = p.truncate().truncate() / p.w;
            (low, high) = (low.min(p), high.max(p));
        }
        let size = (high.min(DVec2::ONE) - low.max(DVec2::NEG_ONE)).max(DVec2::ZERO) * 0.5;
        size.x * size.y * self.pixels * self.pixels * self.aspect
    }

    /// What the camera sees, in world axes with the origin **at the eye**: four sides and the near plane; the far plane if
    /// there is one.
    #[must_use]
    pub fn frustum(&self) -> Frustum {
        let (r, u, f) = (self.right, self.up, self.forward);
        let [low, high] = self.window();
        let side = |s: DVec3, most: f64| match self.lens {
            Lens::Perspective { .. } => (f * most + s).extend(0.0),
            Lens::Orthographic { .. } => s.extend(most),
        };
        let mut planes = vec![side(r, -low.x), side(-r, high.x), side(u, -low.y), side(-u, high.y)];
        planes.push(f.extend(-self.near));
        if let Some(far) = self.far {
            planes.push((-f).extend(far));
        }
        Frustum::new(planes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn views() -> Vec<Viewpoint> {
        let base = Viewpoint {
            eye: DVec3::new(1.5e11, -3.0, 7.0),
            right: DVec3::X,
            up: DVec3::Z,
            forward: DVec3::Y,
            lens: Lens::Perspective { tan_half_height: 0.5 },
            center: DVec2::ZERO,
            aspect: 1.5,
            pixels: 400.0,
            near: 0.1,
            far: None,
        };
        vec![
            base,
            Viewpoint { far: Some(100.0), ..base },
            Viewpoint { center: DVec2::new(0.4, -1.5), ..base },
            // Its rays start beside the eye, which at 1.5e11 has a digit after the point.
            Viewpoint { eye: DVec3::ONE, lens: Lens::Orthographic { half_height: 4.0 }, far: Some(100.0), ..base },
            Viewpoint {
                eye: DVec3::ONE,
                lens: Lens::Orthographic { half_height: 4.0 },
                center: DVec2::new(-2.0, 0.25),
                far: Some(100.0),
                ..base
            },
        ]
    }

    /// The pixel's ray and the projection must be each other's inverse.
    #[test]
    fn a_point_on_a_pixels_ray_projects_to_that_pixel() {
        for view in views() {
            for (x, y) in [(0.5, 0.5), (0.1, 0.8), (1.0, 0.0), (0.0, 1.0)] {
                let (origin, direction) = view.ray(x, y);
                for t in [0.2, 3.0, 50.0] {
                    let p = (origin - view.eye) + direction * t;
                    let clip = view.clip_from_eye() * p.extend(1.0);
                    let ndc = clip.truncate() / clip.w;
                    assert!((ndc.x - (2.0 * x - 1.0)).abs() < 1e-12, "{ndc} for {x}");
                    assert!((ndc.y - (1.0 - 2.0 * y)).abs() < 1e-12, "{ndc} for {y}");
                    assert!(ndc.z > 0.0 && ndc.z <= 1.0, "{ndc}");
                }
            }
        }
    }

    /// The planes of the frustum are where the picture ends.
    #[test]
    fn what_is_in_the_picture_is_in_the_frustum() {
        for view in views() {
            let frustum = view.frustum();
            for i in -3..=13 {
                for j in -3..=13 {
                    let (x, y) = (f64::from(i) / 10.0 + 0.01, f64::from(j) / 10.0 + 0.01);
                    let (origin, direction) = view.ray(x, y);
                    let p = (origin - view.eye) + direction * (2.0 * view.near / direction.dot(view.forward));
                    let inside = (0.0..=1.0).contains(&x) && (0.0..=1.0).contains(&y);
                    assert_eq!(!frustum.excludes(p, p), inside, "{x} {y} {view:?}");
                }
            }
        }
    }

    #[test]
    fn depth_runs_from_one_at_near_to_zero_at_far() {
        for view in views() {
            let depth = |d: f64| {
                let clip = view.clip_from_eye() * (view.forward * d).extend(1.0);
                clip.z / clip.w
            };
            assert!((depth(view.near) - 1.0).abs() < 1e-12);
            match view.far {
                Some(far) => assert!(depth(far).abs() < 1e-12),
                None => assert!(depth(1e9) < 1e-9 && depth(1e9) > 0.0),
            }
        }
    }
}
