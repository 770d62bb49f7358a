use std::sync::Arc;

use super::{Binding, Color, FieldProblem, List, PropertyNode};
use crate::action::{Aspect, PropertyContext, State};

crate::define_node! {
    /// How the surfaces that follow reflect light.
    ///
    /// Read by the render action; the others ignore it. Without a light in the scene shapes show `diffuse_color` as it is.
    /// Highlights cost something only where `specular_color` is not black, glow only where `emissive_color` is not.
    ///
    /// Every field takes a list; the brackets of a single value are left out. `diffuse_color` and `transparency` may differ
    /// over a shape: [`MaterialBinding`](crate::node::MaterialBinding) says what each of them belongs to, and as long as that is
    /// `Overall`, or there is only one, the first is that of the whole shape. Transparencies go with the colours of the same
    /// number, the last of them with those that are left. Of the other fields only the first value is used, as in Open
    /// Inventor from 2.1 on. An empty list leaves what was in force.
    ///
    /// ```ron
    /// Material(diffuse_color: (0.2, 0.5, 0.1), shininess: 0.5)
    /// ```
    pub struct Material: property {
        /// Reflects ambient light, sRGB 0..1.
        pub ambient_color: List<Color> = Color::new(0.2, 0.2, 0.2).into(),
        /// Reflects the light of lamps in all directions, sRGB 0..1.
        pub diffuse_color: List<Color> = Color::new(0.8, 0.8, 0.8).into(),
        /// Reflects the light of lamps as highlights, sRGB 0..1.
        pub specular_color: List<Color> = Color::BLACK.into(),
        /// Glows by itself, sRGB 0..1.
        pub emissive_color: List<Color> = Color::BLACK.into(),
        /// Sharpness of highlights, 0..1: their exponent is 128 times this.
        pub shininess: List<f32> = List::from(0.2),
        /// How much of what is behind shows through, 0..1: 1 is not to be seen at all. See-through shapes are drawn after all
        /// others, the furthest first, and show the nearest of their own surfaces. A shape is see-through if any value is above
        /// 0.
        pub transparency: List<f32> = List::from(0.0),
    }
    actions {
        Render: "draws what follows in these colours";
    }
    check |m: &Material| {
        let out = |field: &'static str, list: &List<f32>| {
            let (place, value) = list.iter().enumerate().find(|(_, value)| !(0.0..=1.0).contains(*value))?;
            let which = if list.len() == 1 { String::new() } else { format!("number {place}: ") };
            Some(FieldProblem::new(field, format!("{which}{value} is out of range: it goes from 0 to 1")))
        };
        [out("shininess", &m.shininess), out("transparency", &m.transparency)].into_iter().flatten().collect()
    };
}

impl PropertyNode for Material {
    fn apply(&self, state: &mut State, cx: &PropertyContext<'_>) {
        let before = &state.material;
        state.material = Arc::new(Material {
            ambient_color: or(&self.ambient_color, &before.ambient_color),
            diffuse_color: or(&self.diffuse_color, &before.diffuse_color),
            specular_color: or(&self.specular_color, &before.specular_color),
            emissive_color: or(&self.emissive_color, &before.emissive_color),
            shininess: or(&self.shininess, &before.shininess),
            transparency: or(&self.transparency, &before.transparency),
        });
        state.packed_colors = List::default();
        state.credit(Aspect::Material, cx);
    }

    fn moves_shapes(&self) -> bool {
        false
    }
}

/// A list, or what was in force where it is empty.
fn or<T: Clone>(list: &List<T>, before: &List<T>) -> List<T> {
    if list.is_empty() { before.clone() } else { list.clone() }
}

crate::define_node! {
    /// What the colours of the shapes after it belong to, where their [`Material`], [`BaseColor`](crate::node::BaseColor) or
    /// [`VertexProperty`](crate::node::VertexProperty) has several.
    ///
    /// Read by the render action and handed on to callbacks; the others ignore it. A part is a face of a cube (front, back,
    /// left, right, top, bottom), the sides, top or bottom of a round shape in this order, a polygon, a strip, a row of
    /// quadrilaterals, a straight piece of a line, or a point. A face is a face of a cube, a polygon, a triangle of a strip, a
    /// quadrilateral, a line, or a point. What is not made of such things shows its first colour: spheres and terrains always,
    /// cones and cylinders but for `PerPart`, cubes with `PerVertex`. Between corners of different colours they are mixed evenly,
    /// in linear light.
    ///
    /// `Indexed` asks the `material_index` of shapes that have one, and that of the coordinates where there is none. A number
    /// beyond the colours is an error; but a single colour is that of the whole shape, whatever the binding, and costs no
    /// vertex data.
    ///
    /// ```ron
    /// Material(diffuse_color: [(1.0, 0.0, 0.0), (0.0, 0.6, 0.0), (0.0, 0.2, 1.0)]),
    /// MaterialBinding(value: PerPart),
    /// Cylinder(),
    /// ```
    pub struct MaterialBinding: property {
        /// What each colour belongs to.
        pub value: Binding = Binding::Overall,
    }
    actions {
        Render: "draws each part, face or corner of what follows in its colour";
        Callback: "hands triangles out with the numbers of their colours";
    }
}

impl PropertyNode for MaterialBinding {
    fn apply(&self, state: &mut State, cx: &PropertyContext<'_>) {
        state.material_binding = self.value;
        state.credit(Aspect::MaterialBinding, cx);
    }
}
