use serde::{Deserialize, Serialize};

use super::{PropertyNode, field::enum_field};
use crate::action::{Aspect, PropertyContext, State};

/// How light and material make the colour of a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, Default)]
pub enum LightingModel {
    /// The diffuse colour as it is; lights do nothing.
    BaseColor,
    /// Ambient, diffuse and specular reflection, and glow.
    #[default]
    Phong,
}

enum_field!(LightingModel: BaseColor | Phong);

crate::define_node! {
    /// Whether lights change how the shapes that follow look.
    ///
    /// Read by the render action; the others ignore it. With `BaseColor` normals, lights and all that belongs to them are
    /// neither computed nor on the graphics card.
    ///
    /// ```ron
    /// LightModel(model: BaseColor)
    /// ```
    pub struct LightModel: property {
        /// The model.
        pub model: LightingModel = LightingModel::Phong,
    }
    actions {
        Render: "draws what follows with or without regard to light";
    }
}

impl PropertyNode for LightModel {
    fn apply(&self, state: &mut State, cx: &PropertyContext<'_>) {
        state.light_model = self.clone();
        state.credit(Aspect::LightModel, cx);
    }

    fn moves_shapes(&self) -> bool {
        false
    }
}
