use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

use super::field::enum_field;
use super::{Color, FieldProblem, PropertyNode};
use crate::action::{Aspect, Attenuation, PropertyContext, State};

/// How the air hides what is far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, Default)]
pub enum FogType {
    /// Clear air.
    #[default]
    None,
    /// Thickens in proportion to the distance d: the share d / visibility of the colour is that of the fog.
    Haze,
    /// Thickens faster near by: e^(−d · ln 256 / visibility) is left of the surface.
    Fog,
    /// Thickens as smoke does: e^(−d² · ln 256 / visibility²) is left of the surface.
    Smoke,
}

enum_field!(FogType: None | Haze | Fog | Smoke);

crate::define_node! {
    /// The air: light from the surroundings and fog on the shapes that follow, and how the lights that follow weaken with
    /// distance.
    ///
    /// Read by the render action; the others ignore it. Ambient light shows where there is any lamp, and costs something only
    /// where both it and the material's ambient colour are not black. Fog mixes in linear light, by the distance from the eye;
    /// with parallel rays by the distance along the view. It does not act on a `Background`: give that the colour of the fog.
    ///
    /// ```ron
    /// Environment(fog_type: Haze, fog_color: (0.85, 0.9, 0.95), fog_visibility: 130000.0)
    /// ```
    pub struct Environment: property {
        /// Multiplies the ambient colour; from 0 up.
        pub ambient_intensity: f32 = 0.2,
        /// Colour of the ambient light, sRGB 0..1.
        pub ambient_color: Color = Color::WHITE,
        /// (a, b, c): point and spot lights are divided by a · d² + b · d + c at the distance d, in world units; each from 0
        /// up, not all 0.
        pub attenuation: DVec3 = DVec3::Z,
        /// Whether there is fog, and how it thickens.
        pub fog_type: FogType = FogType::None,
        /// Colour of the fog, sRGB 0..1.
        pub fog_color: Color = Color::WHITE,
        /// Distance in world units at which fog hides everything: all of it for `Haze`, 255 parts of 256 for the others. 0 means
        /// up to the camera's far plane or, where it has none, the far end of the scene.
        pub fog_visibility: f64 = 0.0,
    }
    actions {
        Render: "draws what follows in this air and light from the surroundings";
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
        if e.fog_visibility < 0.0 {
            let message = format!("{} is negative: a distance goes from 0 up", e.fog_visibility);
            problems.push(FieldProblem::new("fog_visibility", message));
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

    fn moves_shapes(&self) -> bool {
        false
    }
}
