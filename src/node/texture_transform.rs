use glam::{DAffine2, DVec2};

use super::PropertyNode;
use crate::action::{PropertyContext, State};

crate::define_node! {
    /// Moves, turns and scales the texture coordinates of the colours on the current texture unit, for what follows.
    ///
    /// A coordinate (s, t), (0, 0) at the lower left and (1, 1) at the upper right of the image, becomes
    /// `center + translation + rotation · scale · ((s, t) − center)`: a scale of 2 shows the image twice. What is then beyond the
    /// border is as the texture's `wrap_s` and `wrap_t` say. Heights are not moved. A node that changes nothing costs nothing.
    /// Read by the render action; the others ignore it, and picks tell the coordinates as they were before. Only the last one of a
    /// unit counts.
    ///
    /// ```ron
    /// TextureUnit(unit: 1),
    /// Texture2(filename: "colors.png", wrap_s: Repeat, wrap_t: Repeat),
    /// Texture2Transform(scale_factor: (4.0, 4.0))
    /// ```
    pub struct Texture2Transform: property {
        /// Added at the end, in widths and heights of the image.
        pub translation: DVec2 = DVec2::ZERO,
        /// Angle in radians, counter-clockwise.
        pub rotation: f64 = 0.0,
        /// Factors along s and t.
        pub scale_factor: DVec2 = DVec2::ONE,
        /// The point that scaling and turning leave where it is.
        pub center: DVec2 = DVec2::ZERO,
    }
    actions {
        Render: "moves the texture over what follows";
    }
}

impl Texture2Transform {
    /// What takes a texture coordinate to the one that is looked up.
    #[must_use]
    pub fn affine(&self) -> DAffine2 {
        DAffine2::from_translation(self.center + self.translation)
            * DAffine2::from_angle(self.rotation)
            * DAffine2::from_scale(self.scale_factor)
            * DAffine2::from_translation(-self.center)
    }
}

impl PropertyNode for Texture2Transform {
    fn apply(&self, state: &mut State, cx: &PropertyContext<'_>) {
        state.set_texture_transform(self.affine(), cx);
    }

    fn moves_shapes(&self) -> bool {
        false
    }
}
