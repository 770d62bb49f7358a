use std::sync::Arc;

use glam::{DVec2, Vec3};
use serde::{Deserialize, Serialize};

use super::field::enum_field;
use super::{Color, FieldProblem, PropertyNode};
use crate::action::{Aspect, PropertyContext, State};

/// What a ramp colours by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, Default)]
pub enum RampBy {
    /// The height: local z.
    #[default]
    Height,
    /// The steepness against the terrain's own horizontal, in radians.
    Slope,
}

enum_field!(RampBy: Height | Slope);

/// A row of colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, Default)]
pub enum Ramp {
    /// As atlases colour heights: green lowland, yellow and brown hills, white peaks.
    #[default]
    Hypsometric,
    /// Black to white.
    Gray,
    /// Dark violet over green to yellow; even steps look even, to people with any colour vision.
    Viridis,
    /// Black over red and yellow to white.
    Heat,
    /// Green over yellow to red, as maps of avalanche danger have slopes.
    Signal,
}

enum_field!(Ramp: Hypsometric | Gray | Viridis | Heat | Signal);

/// Most colours that a [`Ramp`] has.
pub const RAMP_STOPS: usize = 8;

impl Ramp {
    /// Colours with their places, 0..1, in rising order; between them linear light is mixed.
    #[must_use]
    pub fn stops(self) -> &'static [(f32, [u8; 3])] {
        match self {
            Ramp::Hypsometric => &[
                (0.0, [77, 126, 84]),
                (0.12, [132, 166, 98]),
                (0.28, [204, 196, 130]),
                (0.45, [186, 142, 92]),
                (0.65, [142, 102, 80]),
                (0.82, [172, 160, 154]),
                (1.0, [250, 250, 252]),
            ],
            Ramp::Gray => &[(0.0, [0, 0, 0]), (1.0, [255, 255, 255])],
            Ramp::Viridis => &[
                (0.0, [68, 1, 84]),
                (0.14, [70, 51, 127]),
                (0.29, [54, 92, 141]),
                (0.43, [39, 127, 142]),
                (0.57, [31, 161, 135]),
                (0.71, [74, 194, 109]),
                (0.86, [159, 218, 58]),
                (1.0, [253, 231, 37]),
            ],
            Ramp::Heat => &[
                (0.0, [0, 0, 0]),
                (0.35, [160, 20, 10]),
                (0.7, [250, 150, 20]),
                (0.9, [255, 230, 90]),
                (1.0, [255; 3]),
            ],
            Ramp::Signal => &[(0.0, [60, 150, 80]), (0.5, [240, 215, 80]), (1.0, [200, 40, 40])],
        }
    }

    /// The colour at a place, 0..1, in linear light; beyond its ends that of the end.
    ///
    /// ```
    /// use seamount::node::Ramp;
    ///
    /// assert_eq!(Ramp::Gray.color(0.25).x, 0.25);
    /// assert_eq!(Ramp::Viridis.color(7.0), Ramp::Viridis.color(1.0));
    /// ```
    #[must_use]
    pub fn color(self, place: f32) -> Vec3 {
        mix_stops(self.stops(), place)
    }
}

/// The colour at a place between `stops` in rising order, in linear light; beyond their ends that of the end.
pub(crate) fn mix_stops(stops: &[(f32, [u8; 3])], place: f32) -> Vec3 {
    let linear =
        |[r, g, b]: [u8; 3]| Color::new(f32::from(r) / 255.0, f32::from(g) / 255.0, f32::from(b) / 255.0).linear();
    let Some(((_, first), rest)) = stops.split_first() else { return Vec3::ZERO };
    let mut color = linear(*first);
    for (&(from, _), &(to, next)) in stops.iter().zip(rest) {
        color = color.lerp(linear(next), ((place - from) / (to - from)).clamp(0.0, 1.0));
    }
    color
}

crate::define_node! {
    /// Colours the terrains that follow by height or slope, with a row of colours.
    ///
    /// Read by the render action; the others ignore it. The colour multiplies that of the material, as a texture does, so put a
    /// white material before it. Meshes are not coloured by it.
    ///
    /// ```ron
    /// ColorRamp(ramp: Viridis, by: Slope)
    /// ```
    pub struct ColorRamp: property {
        /// Whether it colours; a ramp that is off takes an earlier one away.
        pub on: bool = true,
        /// The colours.
        pub ramp: Ramp = Ramp::Hypsometric,
        /// What they stand for.
        pub by: RampBy = RampBy::Height,
        /// What the first and the last colour stand for: local z, or radians. None: the lowest and highest point of the map;
        /// slopes from level to 45°.
        pub range: Option<DVec2> = None,
    }
    actions {
        Render: "colours terrains that follow by it";
    }
    check |r: &ColorRamp| match r.range {
        Some(DVec2 { x, y }) if x == y => {
            vec![FieldProblem::new("range", format!("({x}, {y}) is one value: the colours need two to lie between"))]
        }
        _ => Vec::new(),
    };
}

impl PropertyNode for ColorRamp {
    fn apply(&self, state: &mut State, cx: &PropertyContext<'_>) {
        state.color_ramp = self.on.then(|| Arc::new(self.clone()));
        state.credit(Aspect::ColorRamp, cx);
    }

    fn moves_shapes(&self) -> bool {
        false
    }
}
