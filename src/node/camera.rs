use std::sync::Arc;

use glam::{DQuat, DVec2, DVec3};
use serde::{Deserialize, Serialize};

use super::field::enum_field;
use super::{AxisAngle, FieldProblem, PropertyNode};
use crate::action::{Lens, PlacedCamera, PropertyContext, State};

/// What becomes of a camera's picture in a place for it that has other proportions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, Default)]
pub enum ViewportMapping {
    /// More is seen on two sides, so that all of the place is filled and nothing that the camera shows is lost.
    #[default]
    AdjustCamera,
    /// The picture is stretched to fill the place.
    LeaveAlone,
    /// The picture keeps its proportions in the middle of the place; what is left is grey.
    CropViewportFillFrame,
    /// As before, but what is left has the colour of the background, and a line parts it from the picture.
    CropViewportLineFrame,
    /// As before, without the line.
    CropViewportNoFrame,
}

enum_field!(ViewportMapping: AdjustCamera | LeaveAlone | CropViewportFillFrame | CropViewportLineFrame | CropViewportNoFrame);

/// What the kinds of camera have in common, as the actions use it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraFields {
    /// Where the eye is, in local coordinates; `None` sees all of the scene.
    pub position: Option<DVec3>,
    /// The point looked at, in local coordinates; goes before `orientation`.
    pub look_at: Option<DVec3>,
    /// Turns the default direction (−z, y up).
    pub orientation: DQuat,
    /// Field of view.
    pub lens: Lens,
    /// Width over height of what is meant to be in the picture.
    pub aspect: f64,
    /// The middle of the picture, as in [`Viewpoint::center`](crate::action::Viewpoint::center).
    pub center: DVec2,
    /// How it gets into a picture of other proportions.
    pub viewport_mapping: ViewportMapping,
    /// `None`: fitted to the scene.
    pub near_distance: Option<f64>,
    /// `None`: without limit (perspective), fitted to the scene (orthographic).
    pub far_distance: Option<f64>,
}

fn place(fields: CameraFields, state: &mut State, cx: &PropertyContext<'_>) {
    state.camera = Some(Arc::new(PlacedCamera { fields, model: state.model, key: cx.key, path: cx.path.clone() }));
}

/// Width over height of the picture of a camera whose own is a square unless it is cropped or stretched.
fn aspect(mapping: ViewportMapping, ratio: f64) -> f64 {
    if mapping == ViewportMapping::AdjustCamera { 1.0 } else { ratio }
}

fn bad_ratio(ratio: f64) -> Option<FieldProblem> {
    (!(ratio > 0.0 && ratio.is_finite()))
        .then(|| FieldProblem::new("aspect_ratio", format!("{ratio} does not work: it has to be above 0")))
}

fn problems(near: Option<f64>, far: Option<f64>, position: Option<DVec3>, look_at: Option<DVec3>) -> Vec<FieldProblem> {
    let mut problems = Vec::new();
    if let Some(near) = near
        && near <= 0.0
    {
        problems.push(FieldProblem::new("near_distance", format!("{near} does not work: it has to be above 0")));
    }
    if let Some(far) = far
        && far <= near.unwrap_or(0.0)
    {
        problems.push(FieldProblem::new("far_distance", format!("{far} does not work: it has to be beyond near")));
    }
    if position.is_some() && position == look_at {
        problems.push(FieldProblem::new("look_at", "the camera can not look at its own position"));
    }
    problems
}

crate::define_node! {
    /// A camera with a field of view: what is far away looks small.
    ///
    /// Acts on the shapes that follow it in the walk; a picture is taken by the first camera unless another is named. With
    /// no `position` it stands where it sees the whole scene; near and far fit the scene unless given. Picks through a
    /// pixel use it; the bounding box ignores it.
    ///
    /// ```ron
    /// PerspectiveCamera(position: (0.0, -100.0, 50.0), look_at: (0.0, 0.0, 0.0))
    /// ```
    pub struct PerspectiveCamera: property {
        /// Where the eye is, local coordinates. None: where all of the scene is in view. (Open Inventor's default is
        /// (0, 0, 1), which sees nothing of a landscape.)
        pub position: Option<DVec3> = None,
        /// Turns the view from its default, along −z with y up.
        pub orientation: AxisAngle = AxisAngle::IDENTITY,
        /// A point to look at, instead of `orientation`; up is z, or y when looking along z. Without `position` the point
        /// is the middle of the picture.
        pub look_at: Option<DVec3> = None,
        /// Vertical field of view in radians, above 0 and below π. Where `AdjustCamera` finds a picture higher than wide, the
        /// horizontal one.
        pub height_angle: f64 = std::f64::consts::FRAC_PI_4,
        /// Nearest distance seen. None: fitted to the scene.
        pub near_distance: Option<f64> = None,
        /// Furthest distance seen. None: no limit.
        pub far_distance: Option<f64> = None,
        /// What becomes of the picture in a place of other proportions.
        pub viewport_mapping: ViewportMapping = ViewportMapping::AdjustCamera,
        /// Width over height of the picture, above 0, where it is cropped or stretched. Not read by `AdjustCamera`.
        pub aspect_ratio: f64 = 1.0,
    }
    actions {
        Render: "looks through the first camera, or the one that is named";
        RayPick, HandleEvent: "send rays through its picture";
        Callback, PrimitiveCount: "choose levels of detail for its picture";
    }
    check |c: &PerspectiveCamera| {
        let mut found = problems(c.near_distance, c.far_distance, c.position, c.look_at);
        found.extend(bad_ratio(c.aspect_ratio));
        if !(c.height_angle > 0.0 && c.height_angle < std::f64::consts::PI) {
            let message = format!("{} does not work: an angle in radians above 0 and below π", c.height_angle);
            found.push(FieldProblem::new("height_angle", message));
        }
        found
    };
}

impl PropertyNode for PerspectiveCamera {
    fn apply(&self, state: &mut State, cx: &PropertyContext<'_>) {
        let fields = CameraFields {
            position: self.position,
            look_at: self.look_at,
            orientation: self.orientation.quat(),
            lens: Lens::Perspective { tan_half_height: (self.height_angle * 0.5).tan() },
            aspect: aspect(self.viewport_mapping, self.aspect_ratio),
            center: DVec2::ZERO,
            viewport_mapping: self.viewport_mapping,
            near_distance: self.near_distance,
            far_distance: self.far_distance,
        };
        place(fields, state, cx);
    }

    fn moves_shapes(&self) -> bool {
        false
    }
}

crate::define_node! {
    /// A camera without perspective: what is far away looks as large as what is near.
    ///
    /// Otherwise as [`PerspectiveCamera`].
    ///
    /// ```ron
    /// OrthographicCamera(position: (0.0, 0.0, 100.0), height: 50.0)
    /// ```
    pub struct OrthographicCamera: property {
        /// A point of the plane from which on things are seen, in the middle of the picture, local coordinates. None: where
        /// all of the scene is in view; `height` is fitted too then.
        pub position: Option<DVec3> = None,
        /// Turns the view from its default, along −z with y up.
        pub orientation: AxisAngle = AxisAngle::IDENTITY,
        /// A point to look at, instead of `orientation`; up is z, or y when looking along z.
        pub look_at: Option<DVec3> = None,
        /// Height of the picture in local units, above 0. Where `AdjustCamera` finds a picture higher than wide, the width.
        pub height: f64 = 2.0,
        /// Nearest distance seen. None: fitted to the scene.
        pub near_distance: Option<f64> = None,
        /// Furthest distance seen. None: fitted to the scene.
        pub far_distance: Option<f64> = None,
        /// What becomes of the picture in a place of other proportions.
        pub viewport_mapping: ViewportMapping = ViewportMapping::AdjustCamera,
        /// Width over height of the picture, above 0, where it is cropped or stretched. Not read by `AdjustCamera`.
        pub aspect_ratio: f64 = 1.0,
    }
    actions {
        Render: "looks through the first camera, or the one that is named";
        RayPick, HandleEvent: "send rays through its picture";
        Callback, PrimitiveCount: "choose levels of detail for its picture";
    }
    check |c: &OrthographicCamera| {
        let mut found = problems(c.near_distance, c.far_distance, c.position, c.look_at);
        found.extend(bad_ratio(c.aspect_ratio));
        if c.height <= 0.0 {
            found.push(FieldProblem::new("height", format!("{} does not work: it has to be above 0", c.height)));
        }
        found
    };
}

impl PropertyNode for OrthographicCamera {
    fn apply(&self, state: &mut State, cx: &PropertyContext<'_>) {
        let fields = CameraFields {
            position: self.position,
            look_at: self.look_at,
            orientation: self.orientation.quat(),
            lens: Lens::Orthographic { half_height: self.height * 0.5 },
            aspect: aspect(self.viewport_mapping, self.aspect_ratio),
            center: DVec2::ZERO,
            viewport_mapping: self.viewport_mapping,
            near_distance: self.near_distance,
            far_distance: self.far_distance,
        };
        place(fields, state, cx);
    }

    fn moves_shapes(&self) -> bool {
        false
    }
}

crate::define_node! {
    /// A camera with perspective whose picture is any window before the eye: for tiles of large pictures, for walls of
    /// screens, and for pairs of pictures for two eyes.
    ///
    /// Otherwise as [`PerspectiveCamera`].
    ///
    /// ```ron
    /// FrustumCamera(position: (0.0, 0.0, 10.0), left: 0.0, right: 1.0, bottom: 0.0, top: 0.5)
    /// ```
    pub struct FrustumCamera: property {
        /// Where the eye is, local coordinates. None: where all of the scene is in view.
        pub position: Option<DVec3> = None,
        /// Turns the view from its default, along −z with y up.
        pub orientation: AxisAngle = AxisAngle::IDENTITY,
        /// A point to look at, instead of `orientation`; up is z, or y when looking along z. Without `position` the point
        /// is the middle of the picture.
        pub look_at: Option<DVec3> = None,
        /// Left border of the picture: to the right of where the view goes, at a distance of 1 before the eye. (Open Inventor
        /// measures at `near_distance`, which is 1 by default there and may be fitted here: divide by it.)
        pub left: f64 = -0.5,
        /// Right border of the picture, beyond `left`.
        pub right: f64 = 0.5,
        /// Upper border of the picture, above `bottom`.
        pub top: f64 = 0.5,
        /// Lower border of the picture.
        pub bottom: f64 = -0.5,
        /// Nearest distance seen. None: fitted to the scene.
        pub near_distance: Option<f64> = None,
        /// Furthest distance seen. None: no limit.
        pub far_distance: Option<f64> = None,
        /// What becomes of the picture in a place of other proportions.
        pub viewport_mapping: ViewportMapping = ViewportMapping::AdjustCamera,
    }
    actions {
        Render: "looks through the first camera, or the one that is named";
        RayPick, HandleEvent: "send rays through its picture";
        Callback, PrimitiveCount: "choose levels of detail for its picture";
    }
    check |c: &FrustumCamera| {
        let mut found = problems(c.near_distance, c.far_distance, c.position, c.look_at);
        if c.left >= c.right {
            let message = format!("{} does not work: it has to be beyond left ({})", c.right, c.left);
            found.push(FieldProblem::new("right", message));
        }
        if c.bottom >= c.top {
            let message = format!("{} does not work: it has to be above bottom ({})", c.top, c.bottom);
            found.push(FieldProblem::new("top", message));
        }
        found
    };
}

impl PropertyNode for FrustumCamera {
    fn apply(&self, state: &mut State, cx: &PropertyContext<'_>) {
        let (low, high) = (DVec2::new(self.left, self.bottom), DVec2::new(self.right, self.top));
        let size = high - low;
        let fields = CameraFields {
            position: self.position,
            look_at: self.look_at,
            orientation: self.orientation.quat(),
            lens: Lens::Perspective { tan_half_height: size.y * 0.5 },
            aspect: size.x / size.y,
            center: (low + high) / size,
            viewport_mapping: self.viewport_mapping,
            near_distance: self.near_distance,
            far_distance: self.far_distance,
        };
        place(fields, state, cx);
    }

    fn moves_shapes(&self) -> bool {
        false
    }
}
