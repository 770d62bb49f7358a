use glam::{DVec3, Vec3};

use super::{Color, FieldProblem, PropertyNode};
use crate::action::{Aspect, Attenuation, PropertyContext, State};

crate::define_node! {
    /// Light from the surroundings on the shapes that follow, and how the lights that follow weaken with distance.
    ///
    /// Read by the render action; the others ignore it. Ambient light shows where there is any lamp, and costs something only
    /// where both it and the material's ambient colour are not black.
    pub struct Environment: property {
        /// Multiplies the ambient colour; from 0 up.
        pub ambient_intensity: f32 = 0.2,
        /// Colour of the ambient light, sRGB 0..1.
        pub ambient_color: Color = Color::WHITE,
        /// (a, b, c): point and spot lights are divided by a · d² + b · d + c at the distance d, in world units; each from 0
        /// up, not all 0.
        pub attenuation: DVec3 = DVec3::Z,
    }
    check |e: &Environment| {
        let mut problems = Vec::new();
        if e.ambient_intensity < 0.0 {
            let message = format!("{} is negative: light adds, it goes from 0 up", e.ambient_intensity);
            problems.push(FieldProblem::new("ambient_intensity", message));
        }
        if e.attenuation.min_element() < 0.0 || e.attenuation == DVec3::ZERO {
            let DVec3 { x, y, z } = e.attenuation;
            let message = format!("({x}, {y}, {z}) does not work: three numbers from 0 up, at least one above 0");
            problems.push(FieldProblem::new("attenuation", message));
        }
        problems
    };
}

impl Environment {
    /// Ambient light: colour in linear light times intensity.
    #[must_use]
    pub fn ambient(&self) -> Vec3 {
        self.ambient_color.linear() * self.ambient_intensity
    }

    /// The attenuation of the lights that follow.
    #[must_use]
    pub fn light_attenuation(&self) -> Attenuation {
        let [quadratic, linear, constant] = self.attenuation.to_array().map(|c| c as f32);
        Attenuation { quadratic, linear, constant }
    }
}

impl PropertyNode for Environment {
    fn apply(&self, state: &mut State, cx: &PropertyContext<'_>) {
        state.environment = self.clone();
        state.credit(Aspect::Environment, cx);
    }
}
