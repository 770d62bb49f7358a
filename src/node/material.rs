use super::{Color, FieldProblem, PropertyNode};
use crate::action::{PropertyContext, State};

crate::define_node! {
    /// How the surfaces that follow reflect light.
    ///
    /// Read by the render action; the others ignore it. Without a light in the scene shapes show `diffuse_color` as it is.
    /// Highlights cost something only where `specular_color` is not black, glow only where `emissive_color` is not.
    ///
    /// ```ron
    /// Material(diffuse_color: (0.2, 0.5, 0.1), shininess: 0.5)
    /// ```
    pub struct Material: property {
        /// Reflects ambient light, sRGB 0..1.
        pub ambient_color: Color = Color::new(0.2, 0.2, 0.2),
        /// Reflects the light of lamps in all directions, sRGB 0..1.
        pub diffuse_color: Color = Color::new(0.8, 0.8, 0.8),
        /// Reflects the light of lamps as highlights, sRGB 0..1.
        pub specular_color: Color = Color::BLACK,
        /// Glows by itself, sRGB 0..1.
        pub emissive_color: Color = Color::BLACK,
        /// Sharpness of highlights, 0..1: their exponent is 128 times this.
        pub shininess: f32 = 0.2,
    }
    check |m: &Material| {
        if (0.0..=1.0).contains(&m.shininess) {
            Vec::new()
        } else {
            vec![FieldProblem::new("shininess", format!("{} is out of range: it goes from 0 to 1", m.shininess))]
        }
    };
}

impl PropertyNode for Material {
    fn apply(&self, state: &mut State, _: &PropertyContext<'_>) {
        state.material = self.clone();
    }

    fn moves_shapes(&self) -> bool {
        false
    }
}
