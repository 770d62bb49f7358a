//! A camera met on a walk, and the view it gives of a scene.

use glam::{DAffine3, DMat3, DVec2, DVec3};
use thiserror::Error;

use super::{Aabb, Lens, Viewpoint};
use crate::node::{CameraFields, FieldProblem, ViewportMapping};
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
    /// The window makes no picture.
    #[error("the camera's window does not work: its width over height has to be above 0, and all of it finite")]
    Window,
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

/// A rectangle of pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PixelArea {
    /// Pixels to the left of it.
    pub left: u32,
    /// Pixels above it.
    pub top: u32,
    /// Pixels across, at least 1.
    pub width: u32,
    /// Pixels from top to bottom, at least 1.
    pub height: u32,
}

impl PixelArea {
    /// Whether a point of the picture in pixels, (0, 0) top left, is in it. Its left and upper border are, not the others.
    #[must_use]
    pub fn contains(&self, x: f64, y: f64) -> bool {
        let within =
            |at: f64, start: u32, length: u32| at >= f64::from(start) && at < f64::from(start) + f64::from(length);
        within(x, self.left, self.width) && within(y, self.top, self.height)
    }
}

/// What is around a cropped picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Surround {
    /// Nothing but the colour of the background.
    Background,
    /// A line of one pixel, and the colour of the background.
    Line,
    /// A grey.
    Filled,
}

/// A picture that does not fill the place that there is for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Crop {
    /// Where it is.
    pub area: PixelArea,
    /// What is around it.
    pub surround: Surround,
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
        let [width, height] = size.map(|n| f64::from(n.max(1)));
        let picture = width / height;
        let lens = match f.lens {
            Lens::Perspective { .. } => f.lens,
            Lens::Orthographic { half_height } => {
                let scale = (self.model.matrix3 * f.orientation.mul_vec3(DVec3::Y)).length();
                Lens::Orthographic { half_height: half_height * scale }
            }
        };
        let pixels = match f.viewport_mapping {
            ViewportMapping::LeaveAlone => height.max(width / f.aspect),
            _ => height,
        };
        if !(f.aspect > 0.0 && f.aspect.is_finite() && f.center.is_finite() && pixels.is_finite()) {
            return Err(CameraError::Window);
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
        let (center, aspect) = (f.center, f.aspect);
        let mut view = Viewpoint { eye: DVec3::ZERO, right, up, forward, lens, center, aspect, pixels, near, far };
        // What the node says is in the picture fits into it. A picture that is stretched shows no more than that, another is
        // widened; if the rest will be cropped, what is to be seen has to be in the node's own part.
        let cropped = self.surround().is_some();
        if !cropped && f.viewport_mapping != ViewportMapping::LeaveAlone {
            view.widen(picture);
        }
        view.check_lens()?;
        match f.position {
            Some(position) => view.eye = self.model.transform_point3(position),
            None => view_all(&mut view, scene, f.look_at.map(|p| self.model.transform_point3(p))),
        }
        if cropped {
            view.widen(picture);
        }
        view.check_lens()?;
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

impl PlacedCamera {
    /// What is around the camera's picture, if it is cropped.
    fn surround(&self) -> Option<Surround> {
        match self.fields.viewport_mapping {
            ViewportMapping::AdjustCamera | ViewportMapping::LeaveAlone => None,
            ViewportMapping::CropViewportFillFrame => Some(Surround::Filled),
            ViewportMapping::CropViewportLineFrame => Some(Surround::Line),
            ViewportMapping::CropViewportNoFrame => Some(Surround::Background),
        }
    }

    /// What of a picture of this size in pixels the camera's own is cropped to; `None` if it is all of the picture.
    #[must_use]
    pub fn crop(&self, size: [u32; 2]) -> Option<Crop> {
        let surround = self.surround()?;
        let [width, height] = size.map(f64::from);
        // The largest that fits, in whole pixels and at least one, in the middle.
        let within = |length: f64, most: f64| (length.round() as u32).clamp(1, (most as u32).max(1));
        let (w, h) = (within(height * self.fields.aspect, width), within(width / self.fields.aspect, height));
        let area = PixelArea { left: (size[0].max(1) - w) / 2, top: (size[1].max(1) - h) / 2, width: w, height: h };
        (area.width < size[0] || area.height < size[1]).then_some(Crop { area, surround })
    }
}

impl Viewpoint {
    /// Shows more on two sides, as much as a picture of these proportions needs to show all that was in it before.
    fn widen(&mut self, aspect: f64) {
        let (wider, higher) = ((aspect / self.aspect).max(1.0), (self.aspect / aspect).max(1.0));
        self.center /= DVec2::new(wider, higher);
        self.aspect = aspect;
        match &mut self.lens {
            Lens::Perspective { tan_half_height: half } | Lens::Orthographic { half_height: half } => *half *= higher,
        }
    }

    fn check_lens(&self) -> Result<(), CameraError> {
        let half = self.lens.half_height();
        if half > 0.0 && half.is_finite() { Ok(()) } else { Err(CameraError::Height(half)) }
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
    let distance = match view.lens {
        Lens::Perspective { .. } => {
            // Where the middle of the picture is beside the view, per unit of depth.
            let (half, aside) = (view.half_size(), view.half_size() * view.center);
            corners
                .iter()
                .map(|&c| {
                    let beside = DVec2::new(c.dot(view.right), c.dot(view.up)) - aside * depth(c);
                    (beside.x.abs() / half.x).max(beside.y.abs() / half.y) - depth(c)
                })
                .fold(0.0, f64::max)
        }
        Lens::Orthographic { .. } => {
            let needed = corners
                .iter()
                .map(|c| (c.dot(view.right).abs() / view.aspect).max(c.dot(view.up).abs()))
                .fold(0.0, f64::max);
            if needed > 0.0 {
                view.lens = Lens::Orthographic { half_height: needed };
            }
            // In front of everything, by the size of the box.
            corners.iter().map(|&c| -depth(c)).fold(0.0, f64::max) + bounds.size().length()
        }
    };
    // A box without extent is looked at from a distance of 1.
    let distance = if distance > 0.0 { distance } else { 1.0 };
    let aside = match view.lens {
        Lens::Perspective { .. } => view.half_size() * view.center * distance,
        Lens::Orthographic { .. } => view.half_size() * view.center,
    };
    view.eye = center - view.forward * distance - view.right * aside.x - view.up * aside.y;
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
