use super::{Color, PropertyNode};
use crate::action::{Aspect, PropertyContext, State};

crate::define_node! {
    /// Sets the diffuse colour alone and leaves the rest of the material as it is.
    ///
    /// Read by the render action; the others ignore it.
    ///
    /// ```ron
    /// BaseColor(rgb: (0.2, 0.5, 0.1))
    /// ```
    pub struct BaseColor: property {
        /// The colour, sRGB 0..1.
        pub rgb: Color = Color::new(0.8, 0.8, 0.8),
    }
}

impl PropertyNode for BaseColor {
    fn apply(&self, state: &mut State, cx: &PropertyContext<'_>) {
        state.material.diffuse_color = self.rgb;
        state.credit(Aspect::Material, cx);
    }

    fn moves_shapes(&self) -> bool {
        false
    }
}
