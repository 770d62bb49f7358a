use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::{FieldProblem, Plane, PropertyNode, field::enum_field};
use crate::action::{PlacedPlane, PropertyContext, State};

/// How shapes are picked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum PickStyleKind {
    /// On their surface.
    #[default]
    Shape,
    /// On the surface of their box.
    BoundingBox,
    /// Not at all: rays go through.
    Unpickable,
    /// On their surface, before all that is not on top.
    ShapeOnTop,
    /// On the surface of their box, before all that is not on top.
    BoundingBoxOnTop,
    /// On their surface where it faces the ray's origin.
    ShapeFrontfaces,
}

enum_field!(PickStyleKind: Shape | BoundingBox | Unpickable | ShapeOnTop | BoundingBoxOnTop | ShapeFrontfaces);

impl PickStyleKind {
    /// Whether hits come before those that are not on top.
    #[must_use]
    pub fn on_top(self) -> bool {
        matches!(self, PickStyleKind::ShapeOnTop | PickStyleKind::BoundingBoxOnTop)
    }

    /// Whether the box is picked in place of the shape.
    #[must_use]
    pub fn boxed(self) -> bool {
        matches!(self, PickStyleKind::BoundingBox | PickStyleKind::BoundingBoxOnTop)
    }
}

crate::define_node! {
    /// How the shapes that follow are picked. Read by picks alone.
    ///
    /// ```ron
    /// PickStyle(style: Unpickable)
    /// ```
    pub struct PickStyle: property {
        /// How.
        pub style: PickStyleKind = PickStyleKind::Shape,
    }
    actions {
        RayPick, HandleEvent: "meet what follows in this way";
    }
}

impl PropertyNode for PickStyle {
    fn apply(&self, state: &mut State, _: &PropertyContext<'_>) {
        state.pick_style = self.style;
    }
}

crate::define_node! {
    /// A plane that cuts off what follows on its outer side. Planes add up, as many as there are.
    ///
    /// What is cut off is not drawn, and picks do not meet it; boxes take no notice, as in Open Inventor. What is cut open
    /// shows its inside, unless [`ShapeHints`](crate::node::ShapeHints) say that nobody sees it.
    ///
    /// ```ron
    /// ClipPlane(plane: (0.0, 0.0, -1.0, -100.0))
    /// ```
    pub struct ClipPlane: property {
        /// The plane in local coordinates; what is in front of it, on the side of its normal, stays.
        pub plane: Plane = Plane { normal: DVec3::X, distance: 0.0 },
        /// Whether it cuts.
        pub on: bool = true,
    }
    actions {
        Render: "leaves out what is cut off";
        RayPick, HandleEvent: "do not meet what is cut off";
    }
    check |c: &ClipPlane| {
        if c.plane.normal == DVec3::ZERO {
            vec![FieldProblem::new("plane", "a normal of length zero does not say how the plane lies")]
        } else {
            Vec::new()
        }
    };
}

impl PropertyNode for ClipPlane {
    fn apply(&self, state: &mut State, cx: &PropertyContext<'_>) {
        let Some(normal) = crate::action::unit(self.plane.normal).filter(|_| self.on) else { return };
        let point = state.model.transform_point3(normal * self.plane.distance);
        let normals = crate::action::normal_matrix(&state.model.matrix3);
        if let Some(normal) = crate::action::unit(normals * normal) {
            let plane = PlacedPlane { normal, point, visit: cx.visit };
            std::sync::Arc::make_mut(&mut state.clip_planes).push(plane);
        }
    }
}
