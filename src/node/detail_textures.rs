use std::sync::Arc;

use super::{FieldProblem, PropertyNode};
use crate::action::{Aspect, PropertyContext, State};

crate::define_node! {
    /// Covers the terrains that follow with four textures, such as grass, rock, scree and snow, where a mask says.
    ///
    /// The mask lies over the map edge to edge; its red, green, blue and alpha are the shares of the four textures, divided by
    /// their sum. An image without alpha counts as opaque, so give the mask an alpha channel. The result multiplies the colour of the surface, as a texture
    /// does. Read by the render action; the others ignore it.
    ///
    /// ```ron
    /// TextureUnit(unit: 2),
    /// Texture2(filename: "mask.png"),
    /// TextureUnit(unit: 3),
    /// Texture2(filename: "grass.png"),
    /// TextureUnit(unit: 4),
    /// Texture2(filename: "rock.png"),
    /// TextureUnit(unit: 5),
    /// Texture2(filename: "scree.png"),
    /// TextureUnit(unit: 6),
    /// Texture2(filename: "snow.png"),
    /// DetailTextures(size: 500.0)
    /// ```
    pub struct DetailTextures: property {
        /// Whether they cover anything; a node that is off takes an earlier one away.
        pub on: bool = true,
        /// The texture unit of the mask.
        pub mask: u32 = 2,
        /// The texture unit of the first texture; the others are on the three units after it.
        pub first: u32 = 3,
        /// Length in local units that a texture covers before it repeats; above 0.
        pub size: f64 = 1000.0,
    }
    actions {
        Render: "lays them over terrains that follow";
    }
    check |d: &DetailTextures| {
        if d.size > 0.0 && d.size.is_finite() {
            Vec::new()
        } else {
            vec![FieldProblem::new("size", format!("{} does not work: a length above 0", d.size))]
        }
    };
}

impl PropertyNode for DetailTextures {
    fn apply(&self, state: &mut State, cx: &PropertyContext<'_>) {
        state.detail_textures = (self.on && self.size > 0.0).then(|| Arc::new(self.clone()));
        state.credit(Aspect::DetailTextures, cx);
    }

    fn moves_shapes(&self) -> bool {
        false
    }
}
