//! What shaders read beside their uniforms: one table of slots, from which layouts and bindings are made.

use super::shader::Variant;

/// A binding of the second group. Its number there is its place in [`Slot::ALL`]; those of parameters follow.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Slot {
    Heights,
    Gradients,
    GradientSampler,
    ColorMap,
    ColorMapSampler,
    DetailMask,
    DetailMaskSampler,
    DetailTexture0,
    DetailTexture1,
    DetailTexture2,
    DetailTexture3,
    DetailTextureSampler,
    NormalMap,
    NormalMapSampler,
    Shadow,
    BumpMap,
    BumpMapSampler,
    /// The texture of a shader's parameter, by its place in the code.
    Parameter(u16),
    ParameterSampler(u16),
}

/// Number of the first binding of parameters; before it there is room for more of ours.
const FIRST_PARAMETER: u32 = 32;

impl Slot {
    /// Those that do not depend on a scene's own shaders.
    pub(super) const ALL: [Slot; 17] = [
        Slot::Heights,
        Slot::Gradients,
        Slot::GradientSampler,
        Slot::ColorMap,
        Slot::ColorMapSampler,
        Slot::DetailMask,
        Slot::DetailMaskSampler,
        Slot::DetailTexture0,
        Slot::DetailTexture1,
        Slot::DetailTexture2,
        Slot::DetailTexture3,
        Slot::DetailTextureSampler,
        Slot::NormalMap,
        Slot::NormalMapSampler,
        Slot::Shadow,
        Slot::BumpMap,
        Slot::BumpMapSampler,
    ];

    pub(super) fn binding(self) -> u32 {
        match self {
            Slot::Parameter(place) => FIRST_PARAMETER + 2 * u32::from(place),
            Slot::ParameterSampler(place) => FIRST_PARAMETER + 2 * u32::from(place) + 1,
            slot => Self::ALL.iter().position(|&other| other == slot).unwrap_or_default() as u32,
        }
    }

    pub(super) fn is_sampler(self) -> bool {
        matches!(
            self,
            Slot::GradientSampler
                | Slot::ColorMapSampler
                | Slot::DetailMaskSampler
                | Slot::DetailTextureSampler
                | Slot::NormalMapSampler
                | Slot::BumpMapSampler
                | Slot::ParameterSampler(_)
        )
    }

    /// Whether it belongs to a shader's parameter.
    pub(super) fn is_parameter(self) -> bool {
        matches!(self, Slot::Parameter(_) | Slot::ParameterSampler(_))
    }

    /// Whether a variant reads it.
    pub(super) fn is_in(self, variant: &Variant) -> bool {
        let e = &variant.effects;
        match self {
            Slot::Heights => variant.terrain(),
            Slot::Gradients => variant.gradients() || variant.point_gradients(),
            Slot::GradientSampler => variant.gradients(),
            Slot::ColorMap | Slot::ColorMapSampler => e.color_map,
            Slot::DetailMask
            | Slot::DetailMaskSampler
            | Slot::DetailTexture0
            | Slot::DetailTexture1
            | Slot::DetailTexture2
            | Slot::DetailTexture3
            | Slot::DetailTextureSampler => e.detail_textures,
            Slot::NormalMap | Slot::NormalMapSampler => e.normal_map,
            Slot::Shadow => e.shadow,
            Slot::BumpMap | Slot::BumpMapSampler => e.bump_map,
            Slot::Parameter(place) | Slot::ParameterSampler(place) => {
                variant.program.as_ref().is_some_and(|program| usize::from(place) < program.textures.len())
            }
        }
    }

    /// The slots of a variant, in the order of their bindings.
    pub(super) fn of(variant: &Variant) -> impl Iterator<Item = Slot> {
        let parameters = variant.program.as_ref().map_or(0, |program| program.textures.len() as u16);
        let parameters = (0..parameters).flat_map(|place| [Slot::Parameter(place), Slot::ParameterSampler(place)]);
        Self::ALL.into_iter().filter(|slot| slot.is_in(variant)).chain(parameters)
    }

    pub(super) fn layout(self, variant: &Variant) -> wgpu::BindGroupLayoutEntry {
        let texture = |sample_type| wgpu::BindingType::Texture {
            sample_type,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let ty = match self {
            Slot::Heights if variant.float_heights() => texture(wgpu::TextureSampleType::Float { filterable: false }),
            Slot::Heights => texture(wgpu::TextureSampleType::Uint),
            Slot::Shadow => texture(wgpu::TextureSampleType::Float { filterable: false }),
            sampler if sampler.is_sampler() => wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
            _ => texture(wgpu::TextureSampleType::Float { filterable: true }),
        };
        let visibility = match self {
            // What a vertex shader of the scene's own may read, and any shader.
            Slot::Heights | Slot::Gradients | Slot::Parameter(_) | Slot::ParameterSampler(_) => {
                wgpu::ShaderStages::VERTEX_FRAGMENT
            }
            _ => wgpu::ShaderStages::FRAGMENT,
        };
        wgpu::BindGroupLayoutEntry { binding: self.binding(), visibility, ty, count: None }
    }
}

/// The slots of a variant as bits, with what else their layout depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct SlotSet {
    bits: u32,
    parameters: u16,
    float_heights: bool,
}

impl SlotSet {
    pub(super) fn of(variant: &Variant) -> Self {
        let ours = Slot::ALL.into_iter().filter(|slot| slot.is_in(variant));
        let bits = ours.fold(0, |bits, slot| bits | 1 << slot.binding());
        let parameters = variant.program.as_ref().map_or(0, |program| program.textures.len() as u16);
        Self { bits, parameters, float_heights: variant.float_heights() }
    }

    pub(super) fn is_empty(self) -> bool {
        self.bits == 0 && self.parameters == 0
    }
}
