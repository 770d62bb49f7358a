use std::sync::Arc;

use super::{Color, List, PropertyNode};
use crate::action::{Aspect, PropertyContext, State};

crate::define_node! {
    /// Sets the diffuse colours alone and leaves the rest of the material as it is.
    ///
    /// Read by the render action; the others ignore it.
    ///
    /// ```ron
    /// BaseColor(rgb: (0.2, 0.5, 0.1))
    /// ```
    pub struct BaseColor: property {
        /// The colour, sRGB 0..1; or several, which a [`MaterialBinding`](crate::node::MaterialBinding) hands out.
        pub rgb: List<Color> = Color::new(0.8, 0.8, 0.8).into(),
    }
    actions {
        Render: "draws what follows in these colours";
    }
}

impl PropertyNode for BaseColor {
    fn apply(&self, state: &mut State, cx: &PropertyContext<'_>) {
        if !self.rgb.is_empty() {
            Arc::make_mut(&mut state.material).diffuse_color = self.rgb.clone();
            state.packed_colors = List::default();
            state.credit(Aspect::Material, cx);
        }
    }

    fn moves_shapes(&self) -> bool {
        false
    }
}
