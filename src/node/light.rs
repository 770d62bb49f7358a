use std::sync::Arc;

use glam::DVec3;

use super::{Color, FieldProblem, PropertyNode};
use crate::action::{PlacedLight, PropertyContext, State};

fn check_intensity(intensity: f32) -> Option<FieldProblem> {
    (intensity < 0.0)
        .then(|| FieldProblem::new("intensity", format!("{intensity} is negative: light adds, it goes from 0 up")))
}

crate::define_node! {
    /// Parallel light, as from the sun, on what follows.
    ///
    /// Read by the render action; the others ignore it. A light acts up to the end of the separator it stands in. One that
    /// is off, or has intensity 0, costs nothing.
    ///
    /// ```ron
    /// DirectionalLight(direction: (1.0, 1.0, -1.0))
    /// ```
    pub struct DirectionalLight: property {
        /// Whether it shines.
        pub on: bool = true,
        /// Multiplies the colour; from 0 up.
        pub intensity: f32 = 1.0,
        /// Colour, sRGB 0..1.
        pub color: Color = Color::WHITE,
        /// The way the light travels, in local coordinates, any length but zero.
        pub direction: DVec3 = DVec3::NEG_Z,
    }
    check |l: &DirectionalLight| {
        let mut problems: Vec<_> = check_intensity(l.intensity).into_iter().collect();
        if l.direction == DVec3::ZERO {
            problems.push(FieldProblem::new("direction", "a direction of length zero does not say where the light goes"));
        }
        problems
    };
}

impl PropertyNode for DirectionalLight {
    fn apply(&self, state: &mut State, _: &PropertyContext<'_>) {
        // A direction of length zero or lost to under- or overflow lights nothing.
        let direction = state.model.matrix3 * self.direction;
        let scale = direction.abs().max_element();
        if self.on && self.intensity > 0.0 && scale > 0.0 && scale.is_finite() {
            let towards = -(direction / scale).normalize();
            let color = self.color.linear() * self.intensity;
            Arc::make_mut(&mut state.lights).push(PlacedLight::Directional { towards, color });
        }
    }

    fn moves_shapes(&self) -> bool {
        false
    }
}

crate::define_node! {
    /// Light from a point, in all directions, on what follows; as strong far away as near.
    ///
    /// Read by the render action; the others ignore it.
    ///
    /// ```ron
    /// PointLight(location: (0.0, 0.0, 100.0), intensity: 0.5)
    /// ```
    pub struct PointLight: property {
        /// Whether it shines.
        pub on: bool = true,
        /// Multiplies the colour; from 0 up.
        pub intensity: f32 = 1.0,
        /// Colour, sRGB 0..1.
        pub color: Color = Color::WHITE,
        /// Where it stands, in local coordinates.
        pub location: DVec3 = DVec3::Z,
    }
    check |l: &PointLight| check_intensity(l.intensity).into_iter().collect();
}

impl PropertyNode for PointLight {
    fn apply(&self, state: &mut State, _: &PropertyContext<'_>) {
        if self.on && self.intensity > 0.0 {
            let position = state.model.transform_point3(self.location);
            let color = self.color.linear() * self.intensity;
            Arc::make_mut(&mut state.lights).push(PlacedLight::Point { position, color });
        }
    }

    fn moves_shapes(&self) -> bool {
        false
    }
}
