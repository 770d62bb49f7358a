//! What shaders read beside their uniforms: one table of slots, from which layouts and bindings are made.

use super::shader::Variant;

/// A binding of the second group. Its number there is its place in [`Slot::ALL`].
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
}

impl Slot {
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
        self as u32
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
        )
    }

    /// Whether a variant reads it.
    pub(super) fn is_in(self, variant: &Variant) -> bool {
        let e = &variant.effects;
        match self {
            Slot::Heights => variant.terrain(),
            Slot::Gradients | Slot::GradientSampler => variant.gradients(),
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
        }
    }

    /// The slots of a variant, in the order of their bindings.
    pub(super) fn of(variant: &Variant) -> impl Iterator<Item = Slot> {
        Self::ALL.into_iter().filter(|slot| slot.is_in(variant))
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
            Slot::Heights => wgpu::ShaderStages::VERTEX,
            _ => wgpu::ShaderStages::FRAGMENT,
        };
        wgpu::BindGroupLayoutEntry { binding: self.binding(), visibility, ty, count: None }
    }
}

/// The slots of a variant as bits, with what else their layout depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct SlotSet {
    bits: u32,
    float_heights: bool,
}

impl SlotSet {
    pub(super) fn of(variant: &Variant) -> Self {
        let bits = Slot::of(variant).fold(0, |bits, slot| bits | 1 << slot.binding());
        Self { bits, float_heights: variant.float_heights() }
    }

    pub(super) fn is_empty(self) -> bool {
        self.bits == 0
    }
}
