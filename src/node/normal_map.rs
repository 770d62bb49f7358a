use std::sync::Arc;

use super::{FieldProblem, PropertyNode};
use crate::action::{Aspect, PropertyContext, State};

crate::define_node! {
    /// Roughens the light on the terrains that follow with an image of normals that repeats over them.
    ///
    /// Red, green and blue are x (east), y (north) and z (up) of the normal, from −1 at 0 to 1 at 255; the slopes that they stand for are
    /// added to those of the map. It changes the light alone, not the shape, and costs nothing where there is none. Read by the
    /// render action; the others ignore it.
    ///
    /// ```ron
    /// TextureUnit(unit: 7),
    /// Texture2(filename: "rough.png"),
    /// NormalMap(size: 500.0)
    /// ```
    pub struct NormalMap: property {
        /// Whether it acts; a node that is off takes an earlier one away.
        pub on: bool = true,
        /// The texture unit of the image.
        pub unit: u32 = 7,
        /// Length in local units that the image covers before it repeats; above 0.
        pub size: f64 = 1000.0,
    }
    actions {
        Render: "roughens the light on terrains that follow";
    }
    check |n: &NormalMap| {
        if n.size > 0.0 && n.size.is_finite() {
            Vec::new()
        } else {
            vec![FieldProblem::new("size", format!("{} does not work: a length above 0", n.size))]
        }
    };
}

impl PropertyNode for NormalMap {
    fn apply(&self, state: &mut State, cx: &PropertyContext<'_>) {
        state.normal_map = (self.on && self.size > 0.0).then(|| Arc::new(self.clone()));
        state.credit(Aspect::NormalMap, cx);
    }

    fn moves_shapes(&self) -> bool {
        false
    }
}
