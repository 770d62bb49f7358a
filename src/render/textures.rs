//! Maps and images as textures.

use half::f16;
use half::slice::HalfFloatSliceExt;
use rayon::prelude::*;

use super::RenderError;
use super::bindings::Slot;
use super::cache::{Cache, PATIENCE};
use super::error::guarded;
use super::mips::{ColorHalver, Level, full_chain, half_data, half_gradients};
use super::objects::{Make, make_view};
use super::shader::Variant;
use super::uniforms::Factors;
use crate::action::{ColorMap, Draw, Geometry};
use crate::node::{TextureFilter, Wrap};
use crate::scene::Image;
use crate::terrain::{HeightField, LatticeLight, Samples, ShadowMap};

/// Bytes that are handed to the queue at once: it keeps a copy until they are on the device.
const BAND: u64 = 64 << 20;

/// A texture with its view.
#[derive(Debug)]
pub(super) struct Texture {
    pub view: wgpu::TextureView,
    pub bytes: u64,
    /// For gradients: the factor from stored to raw values. Else 1.
    pub factor: f32,
}

/// All textures in use.
#[derive(Debug, Default)]
pub(super) struct Textures {
    heights: Cache<u64, Texture>,
    gradients: Cache<u64, Texture>,
    colors: Cache<ImageKey, Texture>,
    samplers: Cache<SamplerKey, wgpu::Sampler>,
    shadows: Shadows,
    /// Bytes sent since the last frame began.
    pub uploaded: u64,
}

/// Where things are made and sent.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gpu<'a> {
    pub device: &'a wgpu::Device,
    pub queue: &'a wgpu::Queue,
    /// Number of the frame, for the caches.
    pub frame: u64,
}

/// What a sampler depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct SamplerKey {
    filter: TextureFilter,
    wrap: [Wrap; 2],
}

impl SamplerKey {
    /// A number for each.
    fn bits(self) -> u64 {
        self.wrap.into_iter().fold(self.filter.bits(), |bits, wrap| bits << 1 | u64::from(wrap == Wrap::Repeat))
    }
}

/// What an image on the device depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct ImageKey {
    image: u64,
    mipmaps: bool,
    stored: Stored,
}

/// What of an image is on the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Stored {
    /// Colours in sRGB.
    Colors,
    /// Numbers as they are.
    Data,
    /// Differences of the intensity from texel to texel, as half floats.
    Slopes,
}

impl ImageKey {
    fn new(map: &ColorMap, slot: Slot) -> Self {
        Self {
            image: map.image.id(),
            mipmaps: map.filter.mipmaps,
            stored: match slot {
                Slot::DetailMask | Slot::NormalMap => Stored::Data,
                Slot::BumpMap => Stored::Slopes,
                _ => Stored::Colors,
            },
        }
    }

    /// The image of a shader's parameter.
    fn of_parameter(map: &ColorMap, colors: bool) -> Self {
        let stored = if colors { Stored::Colors } else { Stored::Data };
        Self { image: map.image.id(), mipmaps: map.filter.mipmaps, stored }
    }

    /// A number for each.
    fn bits(self) -> u64 {
        self.image << 3 | u64::from(self.mipmaps) << 2 | self.stored as u64
    }
}

/// The image that a draw has for a slot of an image or of its sampler.
fn image_in(draw: &Draw, slot: Slot) -> Option<&ColorMap> {
    let detail = draw.coloring.detail.as_ref();
    let texture = |k: usize| detail.and_then(|detail| detail.textures.get(k));
    match slot {
        Slot::ColorMap | Slot::ColorMapSampler => draw.coloring.color_map.as_ref(),
        Slot::DetailMask | Slot::DetailMaskSampler => detail.map(|detail| &detail.mask),
        Slot::DetailTexture0 | Slot::DetailTextureSampler => texture(0),
        Slot::NormalMap | Slot::NormalMapSampler => draw.coloring.relief.as_ref().map(|relief| &relief.map),
        Slot::BumpMap | Slot::BumpMapSampler => draw.coloring.bump.as_ref().map(|bump| &bump.map),
        Slot::DetailTexture1 => texture(1),
        Slot::DetailTexture2 => texture(2),
        Slot::DetailTexture3 => texture(3),
        _ => None,
    }
}

/// The image that a draw has for a parameter of its shaders, and whether it has colours.
fn parameter_in(draw: &Draw, place: u16) -> Option<&(ColorMap, bool)> {
    draw.program.as_ref()?.textures.get(usize::from(place))
}

/// What is put into a slot of the bindings.
#[derive(Debug)]
pub(super) enum Content {
    View(wgpu::TextureView),
    Sampler(wgpu::Sampler),
}

impl Content {
    pub(super) fn resource(&self) -> wgpu::BindingResource<'_> {
        match self {
            Content::View(view) => wgpu::BindingResource::TextureView(view),
            Content::Sampler(sampler) => wgpu::BindingResource::Sampler(sampler),
        }
    }
}

impl Textures {
    /// What a draw has for a slot, and a number that tells it from whatever else may be in the same slot.
    pub(super) fn content(&mut self, gpu: Gpu<'_>, draw: &Draw, slot: Slot) -> Result<(u64, Content), RenderError> {
        let missing = RenderError::Effects("an image is asked for, but there is none");
        match slot {
            Slot::Parameter(place) => {
                let (map, colors) = parameter_in(draw, place).ok_or(missing)?;
                let key = ImageKey::of_parameter(map, *colors);
                return Ok((key.bits(), Content::View(self.colors(gpu, &map.image, key)?.view.clone())));
            }
            Slot::ParameterSampler(place) => {
                let (map, _) = parameter_in(draw, place).ok_or(missing)?;
                let key = SamplerKey { filter: map.filter, wrap: map.wrap };
                return Ok((key.bits(), Content::Sampler(self.sampler(gpu, key)?.clone())));
            }
            _ => {}
        }
        let field = || match &draw.geometry {
            Geometry::Terrain(terrain) => Ok(&terrain.heights),
            Geometry::Mesh(_) | Geometry::Strokes(_) => {
                Err(RenderError::Effects("the effects are for another kind of geometry"))
            }
        };
        let image = || image_in(draw, slot).ok_or(RenderError::Effects("an image is asked for, but there is none"));
        Ok(match slot {
            Slot::Heights => (field()?.id(), Content::View(self.heights(gpu, field()?)?.view.clone())),
            Slot::Gradients => (field()?.id(), Content::View(self.gradients(gpu, field()?)?.view.clone())),
            Slot::Shadow => {
                let light = draw
                    .coloring
                    .shadow
                    .ok_or(RenderError::Effects("a shadow is asked for, but no light throws one"))?;
                let shadow = self.shadows.get(gpu, field()?, light, &mut self.uploaded)?;
                (shadow.id, Content::View(shadow.finished.view.clone()))
            }
            Slot::GradientSampler => {
                let key = SamplerKey { filter: SMOOTH, wrap: [Wrap::Clamp; 2] };
                (0, Content::Sampler(self.sampler(gpu, key)?.clone()))
            }
            sampler if sampler.is_sampler() => {
                let map = image()?;
                let key = SamplerKey { filter: map.filter, wrap: map.wrap };
                (key.bits(), Content::Sampler(self.sampler(gpu, key)?.clone()))
            }
            _ => {
                let map = image()?;
                let key = ImageKey::new(map, slot);
                (key.bits(), Content::View(self.colors(gpu, &map.image, key)?.view.clone()))
            }
        })
    }

    /// Bytes on the device of what a draw has for a slot.
    pub(super) fn held(&self, draw: &Draw, slot: Slot) -> u64 {
        if let Slot::Parameter(place) = slot {
            let key = parameter_in(draw, place).map(|(map, colors)| ImageKey::of_parameter(map, *colors));
            return key.and_then(|key| self.colors.peek(&key)).map_or(0, |texture| texture.bytes);
        }
        let field = match &draw.geometry {
            Geometry::Terrain(terrain) => Some(terrain.heights.id()),
            Geometry::Mesh(_) | Geometry::Strokes(_) => None,
        };
        let colors = |map: &ColorMap| self.colors.peek(&ImageKey::new(map, slot));
        let texture = match slot {
            Slot::Heights => field.and_then(|field| self.heights.peek(&field)),
            Slot::Gradients => field.and_then(|field| self.gradients.peek(&field)),
            Slot::Shadow => field.zip(draw.coloring.shadow).and_then(|(field, light)| self.shadows.peek(field, light)),
            slot if slot.is_sampler() => None,
            _ => image_in(draw, slot).and_then(colors),
        };
        texture.map_or(0, |texture| texture.bytes)
    }

    /// The samples of a map, at the depth of its file.
    pub(super) fn heights(&mut self, gpu: Gpu<'_>, field: &HeightField) -> Result<&Texture, RenderError> {
        let uploaded = &mut self.uploaded;
        self.heights.get(field.id(), gpu.frame, || {
            let (format, data): (_, &[u8]) = match field.samples() {
                Samples::U16(s) => (wgpu::TextureFormat::R16Uint, bytemuck::cast_slice(s)),
                Samples::F32(s) => (wgpu::TextureFormat::R32Float, bytemuck::cast_slice(s)),
            };
            let texture = create(gpu.device, "a height map", format, [field.columns(), field.rows()], 1)?;
            upload(gpu, &texture, 0, data, uploaded)?;
            Ok(finish(&texture, 1.0))
        })
    }

    /// The gradients of a map with smaller copies.
    pub(super) fn gradients(&mut self, gpu: Gpu<'_>, field: &HeightField) -> Result<&Texture, RenderError> {
        let uploaded = &mut self.uploaded;
        self.gradients.get(field.id(), gpu.frame, || {
            let size = [field.columns(), field.rows()];
            let levels = full_chain(size[0], size[1]);
            // The texture first: a map that is too large is refused before gradients are computed.
            let texture = create(gpu.device, "a height map", wgpu::TextureFormat::Rg16Float, size, levels)?;
            let (level, factor) = gradients(field);
            upload_gradients(gpu, &texture, level, uploaded)?;
            Ok(finish(&texture, factor))
        })
    }

    /// What takes the gradients that a draw reads to those that were meant.
    pub(super) fn factors(&mut self, gpu: Gpu<'_>, draw: &Draw, variant: &Variant) -> Result<Factors, RenderError> {
        let mut factors = Factors::ONE;
        if let Geometry::Terrain(terrain) = &draw.geometry
            && Slot::Gradients.is_in(variant)
        {
            factors.gradients = self.gradients(gpu, &terrain.heights)?.factor;
        }
        if let Some(map) = image_in(draw, Slot::BumpMap)
            && variant.effects.bump_map
        {
            factors.bump = self.colors(gpu, &map.image, ImageKey::new(map, Slot::BumpMap))?.factor;
        }
        Ok(factors)
    }

    /// An image as colours, numbers or slopes; with smaller copies if asked for.
    fn colors(&mut self, gpu: Gpu<'_>, image: &Image, key: ImageKey) -> Result<&Texture, RenderError> {
        let uploaded = &mut self.uploaded;
        self.colors.get(key, gpu.frame, || {
            let (width, height) = (image.width(), image.height());
            let levels = if key.mipmaps { full_chain(width, height) } else { 1 };
            let create = |format| create(gpu.device, "a colour map", format, [width, height], levels);
            let format = match key.stored {
                Stored::Slopes => {
                    let texture = create(wgpu::TextureFormat::Rg16Float)?;
                    let (level, factor) = slopes(image);
                    upload_gradients(gpu, &texture, level, uploaded)?;
                    return Ok(finish(&texture, factor));
                }
                Stored::Data => wgpu::TextureFormat::Rgba8Unorm,
                Stored::Colors => wgpu::TextureFormat::Rgba8UnormSrgb,
            };
            let texture = create(format)?;
            let mut level = Level { width, height, texels: image.rgba8() };
            upload(gpu, &texture, 0, bytemuck::cast_slice(&level.texels), uploaded)?;
            if levels > 1 {
                let halver = ColorHalver::new();
                for index in 1..levels {
                    level = if key.stored == Stored::Data { half_data(&level) } else { halver.half(&level) };
                    upload(gpu, &texture, index, bytemuck::cast_slice(&level.texels), uploaded)?;
                }
            }
            Ok(finish(&texture, 1.0))
        })
    }

    fn sampler(&mut self, gpu: Gpu<'_>, key: SamplerKey) -> Result<&wgpu::Sampler, RenderError> {
        let mode = |linear| if linear { wgpu::FilterMode::Linear } else { wgpu::FilterMode::Nearest };
        let address = |wrap| match wrap {
            Wrap::Repeat => wgpu::AddressMode::Repeat,
            Wrap::Clamp => wgpu::AddressMode::ClampToEdge,
        };
        self.samplers.get(key, gpu.frame, || {
            let SamplerKey { filter, wrap: [s, t] } = key;
            let descriptor = wgpu::SamplerDescriptor {
                label: Some("texture filter"),
                address_mode_u: address(s),
                address_mode_v: address(t),
                min_filter: mode(filter.min_linear),
                mag_filter: mode(filter.mag_linear),
                mipmap_filter: if filter.mip_linear {
                    wgpu::MipmapFilterMode::Linear
                } else {
                    wgpu::MipmapFilterMode::Nearest
                },
                ..wgpu::SamplerDescriptor::default()
            };
            guarded(gpu.device, "making a sampler", || gpu.device.make_sampler(&descriptor))
        })
    }

    pub(super) fn retire(&mut self, frame: u64) {
        self.heights.retire(frame);
        self.gradients.retire(frame);
        self.colors.retire(frame);
        self.samplers.retire(frame);
        self.shadows.retire(frame);
    }

    /// Bytes that the textures hold on the device.
    pub(super) fn bytes(&self) -> u64 {
        let kept = self.heights.values().chain(self.gradients.values()).chain(self.colors.values());
        kept.chain(self.shadows.kept.iter().map(|shadow| &shadow.finished)).map(|t| t.bytes).sum()
    }
}

/// Shadows of maps on themselves. When a light turns or heights change, the new shadow is written over the old one: a sun that
/// moves leaves nothing behind.
#[derive(Debug, Default)]
struct Shadows {
    kept: Vec<Shadow>,
    made: u64,
}

#[derive(Debug)]
struct Shadow {
    field: u64,
    light: LatticeLight,
    /// Tells the texture from others, for the bindings.
    id: u64,
    used: u64,
    texture: wgpu::Texture,
    finished: Texture,
}

impl Shadows {
    fn get(
        &mut self,
        gpu: Gpu<'_>,
        field: &HeightField,
        light: LatticeLight,
        uploaded: &mut u64,
    ) -> Result<&Shadow, RenderError> {
        let size = [field.columns(), field.rows()];
        let known = self.kept.iter().position(|s| s.field == field.id() && s.light == light);
        let place = if let Some(known) = known {
            known
        } else {
            // One that no draw of this frame reads, best of all of the same map.
            let free =
                |(_, s): &(usize, &Shadow)| s.used < gpu.frame && [s.texture.width(), s.texture.height()] == size;
            let old = self.kept.iter().enumerate().filter(free).max_by_key(|(_, s)| s.field == field.id());
            let place = match old.map(|(place, _)| place) {
                Some(place) => place,
                None => {
                    let texture = create(gpu.device, "a shadow map", wgpu::TextureFormat::R32Float, size, 1)?;
                    let finished = finish(&texture, 1.0);
                    self.made += 1;
                    self.kept.push(Shadow { field: 0, light, id: self.made, used: 0, texture, finished });
                    self.kept.len() - 1
                }
            };
            let shadow = &mut self.kept[place];
            // If it can not be sent, it is nobody's.
            shadow.field = 0;
            let depths = ShadowMap::new(field, &light);
            upload(gpu, &shadow.texture, 0, bytemuck::cast_slice(depths.depths()), uploaded)?;
            (shadow.field, shadow.light) = (field.id(), light);
            place
        };
        let shadow = &mut self.kept[place];
        shadow.used = gpu.frame;
        Ok(shadow)
    }

    fn peek(&self, field: u64, light: LatticeLight) -> Option<&Texture> {
        self.kept.iter().find(|s| s.field == field && s.light == light).map(|s| &s.finished)
    }

    fn retire(&mut self, frame: u64) {
        self.kept.retain(|s| frame.saturating_sub(s.used) <= PATIENCE);
    }
}

/// The filter for gradients: linear in every way.
const SMOOTH: TextureFilter = TextureFilter { min_linear: true, mag_linear: true, mipmaps: true, mip_linear: true };

fn create(
    device: &wgpu::Device,
    what: &'static str,
    format: wgpu::TextureFormat,
    [width, height]: [u32; 2],
    levels: u32,
) -> Result<wgpu::Texture, RenderError> {
    let limit = device.limits().max_texture_dimension_2d;
    if width > limit || height > limit {
        return Err(RenderError::TextureSize { what, width, height, limit });
    }
    let descriptor = wgpu::TextureDescriptor {
        label: Some(what),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: levels,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    };
    guarded(device, "making a texture", || device.make_texture(&descriptor))
}

fn upload(
    gpu: Gpu<'_>,
    texture: &wgpu::Texture,
    level: u32,
    data: &[u8],
    uploaded: &mut u64,
) -> Result<(), RenderError> {
    let size = texture.size().mip_level_size(level, wgpu::TextureDimension::D2);
    let pitch = data.len() as u64 / u64::from(size.height.max(1));
    let rows = (BAND / pitch.max(1)).clamp(1, u64::from(size.height)) as usize;
    let pitch = pitch.max(1) as usize;
    *uploaded += data.len() as u64;
    guarded(gpu.device, "sending a texture", || {
        for (band, bytes) in data.chunks(pitch * rows).enumerate() {
            if band > 0 {
                // Lets go of the copy of the band before.
                gpu.queue.submit([]);
            }
            let height = (bytes.len() / pitch) as u32;
            gpu.queue.write_texture(
                wgpu::TexelCopyTextureInfo {
                    texture,
                    mip_level: level,
                    origin: wgpu::Origin3d { x: 0, y: (band * rows) as u32, z: 0 },
                    aspect: wgpu::TextureAspect::All,
                },
                bytes,
                wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(pitch as u32), rows_per_image: None },
                wgpu::Extent3d { width: size.width, height, depth_or_array_layers: 1 },
            );
        }
    })
}

/// All levels of a texture of gradients, from its first.
fn upload_gradients(
    gpu: Gpu<'_>,
    texture: &wgpu::Texture,
    mut level: Level<[f16; 2]>,
    uploaded: &mut u64,
) -> Result<(), RenderError> {
    for index in 0..texture.mip_level_count() {
        if index > 0 {
            level = half_gradients(&level);
        }
        upload(gpu, texture, index, bytemuck::cast_slice(&level.texels), uploaded)?;
    }
    Ok(())
}

fn finish(texture: &wgpu::Texture, factor: f32) -> Texture {
    let texel = texture.format().block_copy_size(None).unwrap_or(4);
    let bytes = (0..texture.mip_level_count())
        .map(|level| texture.size().mip_level_size(level, wgpu::TextureDimension::D2))
        .map(|size| u64::from(size.width) * u64::from(size.height) * u64::from(texel))
        .sum();
    Texture { view: make_view(texture), bytes, factor }
}

/// Gradients at all samples as half floats, and the factor that takes them back to raw units.
fn gradients(field: &HeightField) -> (Level<[f16; 2]>, f32) {
    let [low, high] = range(field.samples());
    halves([field.columns(), field.rows()], high - low, |c, r| field.gradient(c, r))
}

/// Central differences of the intensities of an image that repeats, per texel along columns and rows, as half floats, and the
/// factor that takes them back.
fn slopes(image: &Image) -> (Level<[f16; 2]>, f32) {
    let (width, height) = (image.width(), image.height());
    let intensities = image.intensities();
    let bounds = intensities.iter().fold([f32::INFINITY, f32::NEG_INFINITY], |[a, b], &v| [a.min(v), b.max(v)]);
    let at = |c: u32, r: u32| {
        let place = (r % height) as usize * width as usize + (c % width) as usize;
        f64::from(intensities.get(place).copied().unwrap_or(0.0))
    };
    halves([width, height], f64::from(bounds[1]) - f64::from(bounds[0]), |c, r| {
        [0.5 * (at(c + 1, r) - at(c + width - 1, r)), 0.5 * (at(c, r + 1) - at(c, r + height - 1))]
    })
}

/// Gradients as half floats, and the factor that takes them back to what they were. None of them is larger than `span`.
///
/// Half floats reach from 6·10⁻⁸ to 65504. The gradients are scaled by the power of two that takes the span to between 2¹⁴ and 2¹⁵:
/// nothing overflows, and 2⁻³⁸ of the span is still there.
fn halves(
    [width, height]: [u32; 2],
    span: f64,
    gradient: impl Fn(u32, u32) -> [f64; 2] + Sync,
) -> (Level<[f16; 2]>, f32) {
    // f32 holds the factor and its inverse.
    let exponent = if span > 0.0 { (span.log2().floor() as i32).clamp(-110, 127) } else { 14 };
    let scale = 2f64.powi(14 - exponent);
    let mut texels = vec![[f16::ZERO; 2]; width as usize * height as usize];
    texels.par_chunks_mut(width as usize).zip(0..height).for_each_init(
        || Vec::with_capacity(2 * width as usize),
        |row, (stored, r)| {
            row.clear();
            row.extend((0..width).flat_map(|c| gradient(c, r)).map(|g| (g * scale) as f32));
            // A row at once: processors have an instruction for that.
            stored.as_flattened_mut().convert_from_f32_slice(row);
        },
    );
    (Level { width, height, texels }, (1.0 / scale) as f32)
}

fn range(samples: &Samples) -> [f64; 2] {
    let join = |[a, b]: [f64; 2], [c, d]: [f64; 2]| [a.min(c), b.max(d)];
    let nothing = || [f64::INFINITY, f64::NEG_INFINITY];
    match samples {
        Samples::U16(s) => s.par_iter().map(|&v| [f64::from(v); 2]).reduce(nothing, join),
        Samples::F32(s) => s.par_iter().map(|&v| [f64::from(v); 2]).reduce(nothing, join),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terrain::Voids;

    /// Whatever the units of a map, its gradients survive in half floats to 11 bits.
    #[test]
    fn gradients_survive_in_half_floats_whatever_the_units() {
        let shape = [0.0, 1.0, 3.0, 2.0, 8.0, 0.5, 0.25, -7.0, 4.0_f32];
        for unit in [1e-30, 1e-3, 1.0, 1e5, 1e30_f32] {
            let field = HeightField::from_f32(3, 3, shape.map(|v| v * unit).to_vec(), Voids::default()).unwrap();
            let (level, factor) = gradients(&field);
            for r in 0..3 {
                for c in 0..3 {
                    let stored = level.texels[(r * 3 + c) as usize].map(|g| f64::from(g.to_f32() * factor));
                    for (got, want) in stored.into_iter().zip(field.gradient(c, r)) {
                        assert!((got - want).abs() <= want.abs() / 1024.0, "{got} is not {want} in units of {unit}");
                    }
                }
            }
        }
        let steep = HeightField::from_u16(2, 2, vec![0, 65535, 65535, 0], Voids::default()).unwrap();
        let (level, factor) = gradients(&steep);
        assert!((level.texels[0][0].to_f32() * factor - 65535.0).abs() < 64.0);
    }
}
