use super::{FieldProblem, PropertyNode};
use crate::action::{PropertyContext, State};

crate::define_node! {
    /// How finely the shapes that follow are drawn, and how well their textures are filtered.
    ///
    /// Acts on `SeamlessTerrain`, the slices of round shapes and all textures: read by all actions, since picks of terrains are done
    /// against what the detail chooses.
    ///
    /// ```ron
    /// Complexity(value: 0.8, texture_quality: 0.9)
    /// ```
    pub struct Complexity: property {
        /// Detail, 0..1. The allowed error is multiplied by 4^(1 − 2·value): 0.5 changes nothing, 1 asks for a quarter of
        /// the error, 0 allows four times as much.
        pub value: f64 = 0.5,
        /// Quality of texture filtering, 0..1, by Open Inventor's table: up to 0.5 nearest; 0.6 linear when shrunk; 0.7 and
        /// 0.8 mipmaps, nearest; 0.9 and 1.0 linear and mipmaps.
        pub texture_quality: f64 = 0.5,
    }
    actions {
        Render: "chooses detail and filters textures by it";
        RayPick, HandleEvent, Callback, PrimitiveCount: "take the detail that is drawn";
    }
    check |c: &Complexity| {
        [("value", c.value), ("texture_quality", c.texture_quality)]
            .into_iter()
            .filter(|(_, v)| !(0.0..=1.0).contains(v))
            .map(|(field, v)| FieldProblem::new(field, format!("{v} is out of range: it goes from 0 to 1")))
            .collect()
    };
}

impl PropertyNode for Complexity {
    fn apply(&self, state: &mut State, _: &PropertyContext<'_>) {
        state.complexity = self.clone();
    }
}

/// How a colour texture is sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct TextureFilter {
    /// Linear between texels when the texture is shrunk.
    pub min_linear: bool,
    /// Linear between texels when the texture is enlarged.
    pub mag_linear: bool,
    /// Whether there are smaller copies of the texture.
    pub mipmaps: bool,
    /// Linear between two of those copies.
    pub mip_linear: bool,
}

impl TextureFilter {
    /// Open Inventor's table for `Complexity.textureQuality`.
    #[must_use]
    pub fn of_quality(quality: f64) -> Self {
        let (min_linear, mag_linear, mipmaps, mip_linear) = match quality {
            q if q <= 0.5 => (false, false, false, false),
            q if q <= 0.6 => (true, false, false, false),
            q if q <= 0.7 => (false, false, true, false),
            q if q <= 0.8 => (false, true, true, true),
            q if q <= 0.9 => (true, true, true, false),
            _ => (true, true, true, true),
        };
        Self { min_linear, mag_linear, mipmaps, mip_linear }
    }

    /// A number for each filter.
    #[cfg(feature = "render")]
    pub(crate) fn bits(self) -> u64 {
        let flags = [self.min_linear, self.mag_linear, self.mipmaps, self.mip_linear];
        flags.into_iter().fold(0, |bits, flag| bits << 1 | u64::from(flag))
    }
}
