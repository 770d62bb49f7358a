use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::{Color, FieldProblem, PropertyNode};
use crate::action::{Cone, LightSource, PlacedLight, PropertyContext, State, unit};

fn check_intensity(intensity: f32) -> Option<FieldProblem> {
    (intensity < 0.0)
        .then(|| FieldProblem::new("intensity", format!("{intensity} is negative: light adds, it goes from 0 up")))
}

fn check_direction(direction: DVec3) -> Option<FieldProblem> {
    (direction == DVec3::ZERO)
        .then(|| FieldProblem::new("direction", "a direction of length zero does not say where the light goes"))
}

/// The light of a lamp, if there is any.
fn shine(on: bool, intensity: f32, color: Color) -> Option<Vec3> {
    let light = color.linear() * intensity;
    (on && intensity > 0.0 && light != Vec3::ZERO).then_some(light)
}

fn place(state: &mut State, color: Vec3, source: LightSource, cx: &PropertyContext<'_>) {
    Arc::make_mut(&mut state.lights).push(PlacedLight { color, source, visit: cx.visit });
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
        /// Whether a `SeamlessTerrain` throws a shadow of this light on itself. Shadows are those of the full-resolution ground,
        /// whatever detail is drawn, and not of other shapes or on them. Of several such lights the first is the one. Takes 4
        /// bytes on the device per sample of the map, and a pass over the map when the light turns.
        pub shadow: bool = false,
    }
    actions {
        Render: "lights what follows with it";
    }
    check |l: &DirectionalLight| {
        let mut problems: Vec<_> = check_intensity(l.intensity).into_iter().collect();
        problems.extend(check_direction(l.direction));
        problems
    };
}

impl PropertyNode for DirectionalLight {
    fn apply(&self, state: &mut State, cx: &PropertyContext<'_>) {
        if let Some(direction) = unit(state.model.matrix3 * self.direction)
            && let Some(color) = shine(self.on, self.intensity, self.color)
        {
            let towards = -direction;
            place(state, color, LightSource::Directional { towards, shadow: self.shadow }, cx);
        }
    }

    fn moves_shapes(&self) -> bool {
        false
    }
}

crate::define_node! {
    /// Light from a point, in all directions, on what follows; as strong far away as near, unless the `Environment` before it
    /// says how it weakens.
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
    actions {
        Render: "lights what follows with it";
    }
    check |l: &PointLight| check_intensity(l.intensity).into_iter().collect();
}

impl PropertyNode for PointLight {
    fn apply(&self, state: &mut State, cx: &PropertyContext<'_>) {
        if let Some(color) = shine(self.on, self.intensity, self.color) {
            let position = state.model.transform_point3(self.location);
            let attenuation = state.environment.light_attenuation();
            place(state, color, LightSource::Point { position, attenuation }, cx);
        }
    }

    fn moves_shapes(&self) -> bool {
        false
    }
}

crate::define_node! {
    /// Light from a point into a cone, on what follows; it weakens with distance as the `Environment` before it says.
    ///
    /// Read by the render action; the others ignore it. At an angle a to the axis there is cos(a)^(128 · `drop_off_rate`) of
    /// the light, and none beyond `cut_off_angle`: the edge of the cone is sharp, as in Open Inventor.
    ///
    /// ```ron
    /// SpotLight(location: (0.0, 0.0, 100.0), direction: (0.0, 1.0, -1.0), cut_off_angle: 0.5)
    /// ```
    pub struct SpotLight: property {
        /// Whether it shines.
        pub on: bool = true,
        /// Multiplies the colour; from 0 up.
        pub intensity: f32 = 1.0,
        /// Colour, sRGB 0..1.
        pub color: Color = Color::WHITE,
        /// Where it stands, in local coordinates.
        pub location: DVec3 = DVec3::Z,
        /// The axis of the cone, away from the light, in local coordinates, any length but zero.
        pub direction: DVec3 = DVec3::NEG_Z,
        /// How fast the light weakens away from the axis: 0 not at all, 1 fast.
        pub drop_off_rate: f32 = 0.0,
        /// Angle between the axis and the edge of the cone in radians, 0..π/2.
        pub cut_off_angle: f64 = std::f64::consts::FRAC_PI_4,
    }
    actions {
        Render: "lights what follows with it";
    }
    check |l: &SpotLight| {
        let mut problems: Vec<_> = check_intensity(l.intensity).into_iter().chain(check_direction(l.direction)).collect();
        if !(0.0..=1.0).contains(&l.drop_off_rate) {
            let message = format!("{} is out of range: it goes from 0 to 1", l.drop_off_rate);
            problems.push(FieldProblem::new("drop_off_rate", message));
        }
        if !(0.0..=std::f64::consts::FRAC_PI_2).contains(&l.cut_off_angle) {
            let message = format!("{} is out of range: it goes from 0 to π/2, in radians", l.cut_off_angle);
            problems.push(FieldProblem::new("cut_off_angle", message));
        }
        problems
    };
}

impl PropertyNode for SpotLight {
    fn apply(&self, state: &mut State, cx: &PropertyContext<'_>) {
        if let Some(direction) = unit(state.model.matrix3 * self.direction)
            && let Some(color) = shine(self.on, self.intensity, self.color)
        {
            let position = state.model.transform_point3(self.location);
            let attenuation = state.environment.light_attenuation();
            let cone = Cone { cos_cut_off: self.cut_off_angle.cos() as f32, exponent: 128.0 * self.drop_off_rate };
            place(state, color, LightSource::Spot { position, attenuation, direction, cone }, cx);
        }
    }

    fn moves_shapes(&self) -> bool {
        false
    }
}
