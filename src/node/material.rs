use super::{Color, FieldProblem, PropertyNode};
use crate::action::{Aspect, PropertyContext, State};

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
        /// How much of what is behind shows through, 0..1: 1 is not to be seen at all. See-through shapes are drawn after all
        /// others, the furthest first, and show the nearest of their own surfaces.
        pub transparency: f32 = 0.0,
    }
    check |m: &Material| {
        [("shininess", m.shininess), ("transparency", m.transparency)]
            .into_iter()
            .filter(|(_, value)| !(0.0..=1.0).contains(value))
            .map(|(field, value)| FieldProblem::new(field, format!("{value} is out of range: it goes from 0 to 1")))
            .collect()
    };
}

impl PropertyNode for Material {
    fn apply(&self, state: &mut State, cx: &PropertyContext<'_>) {
        state.material = self.clone();
        state.credit(Aspect::Material, cx);
    }

    fn moves_shapes(&self) -> bool {
        false
    }
}
