//! A camera met on a walk, and the view it gives of a scene.

use glam::{DAffine3, DMat3, DVec3};
use thiserror::Error;

use super::{Aabb, Lens, Viewpoint};
use crate::node::{CameraFields, FieldProblem};
use crate::scene::{NodeKey, Path};

/// Why a camera gives no picture.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum CameraError {
    /// Position and the point looked at are the same, or the transform before the camera is singular.
    #[error("the camera looks nowhere: position and look_at must differ, and no transform before it may scale by zero")]
    NoDirection,
    /// The field of view makes no picture.
    #[error("the camera's height of view {0} does not work: angles go from above 0 to below π, heights from above 0")]
    Height(f64),
    /// Near and far make no range.
    #[error("the camera's range {near}..{far} is empty: near has to be above 0 and below far")]
    Range {
        /// Near distance.
        near: f64,
        /// Far distance.
        far: f64,
    },
    /// A coordinate is NaN or infinite.
    #[error("the camera's place is not finite")]
    NotFinite,
    /// A field has a value that can not be used.
    #[error("{}: {}", .0.field, .0.message)]
    Field(Box<FieldProblem>),
}

/// A camera node with the transform that was in force where it stands.
#[derive(Debug, Clone)]
pub struct PlacedCamera {
    /// What the node says.
    pub fields: CameraFields,
    /// From the camera's local coordinates to world coordinates.
    pub model: DAffine3,
    /// The node.
    pub key: NodeKey,
    /// The occurrence.
    pub path: Path,
}

impl PlacedCamera {
    /// The view that the camera gives in a picture of this size in pixels of a scene with this box. The box
    /// places a camera that has no position, and gives near and far where the node does not.
    ///
    /// # Errors
    ///
    /// [`CameraError`].
    pub fn viewpoint(&self, size: [u32; 2], scene: Option<Aabb>) -> Result<Viewpoint, CameraError> {
        let f = &self.fields;
        let [width, pixels] = size.map(|n| f64::from(n.max(1)));
        let aspect = width / pixels;
        let lens = match f.lens {
            // A picture higher than wide is widened so that what the camera means to show fits (ADJUST_CAMERA).
            Lens::Perspective { tan_half_height } => {
                Lens::Perspective { tan_half_height: tan_half_height / aspect.min(1.0) }
            }
            Lens::Orthographic { half_height } => {
                let scale = (self.model.matrix3 * f.orientation.mul_vec3(DVec3::Y)).length();
                Lens::Orthographic { half_height: half_height * scale / aspect.min(1.0) }
            }
        };
        let (Lens::Perspective { tan_half_height: height } | Lens::Orthographic { half_height: height }) = lens;
        if !(height > 0.0 && height.is_finite()) {
            return Err(CameraError::Height(height));
        }

        let orientation = DMat3::from_quat(f.orientation);
        let (forward, up) = match (f.look_at, f.position) {
            (Some(target), Some(position)) => {
                let forward = target - position;
                let up = if forward.x == 0.0 && forward.y == 0.0 { DVec3::Y } else { DVec3::Z };
                (forward, up)
            }
            _ => (-orientation.z_axis, orientation.y_axis),
        };
        let (forward, up) = (self.model.matrix3 * forward, self.model.matrix3 * up);
        let forward = unit(forward).ok_or(CameraError::NoDirection)?;
        let right = unit(forward.cross(unit(up).ok_or(CameraError::NoDirection)?)).ok_or(CameraError::NoDirection)?;
        let up = right.cross(forward);

        let (near, far) = (1.0, f.far_distance);
        let mut view = Viewpoint { eye: DVec3::ZERO, right, up, forward, lens, aspect, pixels, near, far };
        match f.position {
            Some(position) => view.eye = self.model.transform_point3(position),
            None => view_all(&mut view, scene, f.look_at.map(|p| self.model.transform_point3(p))),
        }
        if !view.eye.is_finite() {
            return Err(CameraError::NotFinite);
        }
        fit_range(&mut view, f.near_distance, scene);
        match view.far {
            Some(far) if view.near >= far => Err(CameraError::Range { near: view.near, far }),
            _ if !(view.near >= 0.0 && view.near.is_finite()) => {
                Err(CameraError::Range { near: view.near, far: view.far.unwrap_or(f64::INFINITY) })
            }
            _ => Ok(view),
        }
    }
}

/// Unit vector; `None` for zero and what is not finite. Scaled first, so that tiny and huge vectors work.
pub(crate) fn unit(v: DVec3) -> Option<DVec3> {
    let scale = v.abs().max_element();
    (scale > 0.0 && scale.is_finite()).then(|| (v / scale).normalize())
}

/// Places the eye so that the box fills the picture: all its corners are inside, and at least one on its border.
fn view_all(view: &mut Viewpoint, scene: Option<Aabb>, target: Option<DVec3>) {
    let Some(bounds) = scene else { return };
    let center = target.unwrap_or_else(|| bounds.center());
    let corners = bounds.corners().map(|c| c - center);
    let depth = |c: DVec3| c.dot(view.forward);
    let distance = match &mut view.lens {
        Lens::Perspective { tan_half_height: t } => {
            let (tx, ty) = (*t * view.aspect, *t);
            corners
                .iter()
                .map(|&c| (c.dot(view.right).abs() / tx).max(c.dot(view.up).abs() / ty) - depth(c))
                .fold(0.0, f64::max)
        }
        Lens::Orthographic { half_height } => {
            let needed = corners
                .iter()
                .map(|c| (c.dot(view.right).abs() / view.aspect).max(c.dot(view.up).abs()))
                .fold(0.0, f64::max);
            if needed > 0.0 {
                *half_height = needed;
            }
            // In front of everything, by the size of the box.
            corners.iter().map(|&c| -depth(c)).fold(0.0, f64::max) + bounds.size().length()
        }
    };
    // A box without extent is looked at from a distance of 1.
    let distance = if distance > 0.0 { distance } else { 1.0 };
    view.eye = center - view.forward * distance;
}

/// Near and far, where the node leaves them to us.
///
/// With reversed z and an infinite far plane the depth near/d is a float with 24 significant bits at every distance, so near
/// costs no precision however small it is; it is half the distance to the box, so that rounding can not cut the box, and
/// inside the box 2⁻²⁴ of the furthest point, which is what f32 positions relative to the eye resolve. An orthographic
/// depth is linear: its range is the box, with a margin of 2⁻²⁰ of it on both sides for rounding to f32.
fn fit_range(view: &mut Viewpoint, near: Option<f64>, scene: Option<Aabb>) {
    let depths = scene.map(|b| b.corners().map(|c| (c - view.eye).dot(view.forward)));
    let (nearest, furthest) = depths.map_or((1.0, 10.0), |d| {
        (d.iter().copied().fold(f64::INFINITY, f64::min), d.iter().copied().fold(f64::NEG_INFINITY, f64::max))
    });
    match view.lens {
        Lens::Perspective { .. } => {
            view.near = near.unwrap_or_else(|| {
                let inside = if furthest > 0.0 { furthest * f64::from(f32::EPSILON) / 2.0 } else { 1.0 };
                (nearest * 0.5).max(inside)
            });
        }
        Lens::Orthographic { .. } => {
            let margin = (furthest - nearest).max(f64::MIN_POSITIVE) * (1.0 / f64::from(1 << 20));
            view.near = near.unwrap_or((nearest - margin).max(0.0));
            let far = view.far.unwrap_or(furthest + margin);
            view.far = Some(if far > view.near { far } else { view.near + 1.0 });
        }
    }
}
