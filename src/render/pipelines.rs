//! Pipelines and bindings, one for each variant of the shaders, made when they are first drawn with.

use std::collections::HashMap;

use super::RenderError;
use super::bindings::{Slot, SlotSet};
use super::error::guarded;
use super::objects::Make;
use super::program::{checked_text, has_values};
use super::shader::{Variant, sky_text};
use crate::action::{DepthOffset, Draw};
use crate::terrain::{Instance, LooseVertex, PatchWeights};

/// Depth is kept in 32-bit floats.
pub(super) const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Bytes of a corner of a mesh: position, and normal.
pub(super) const MESH_STRIDE: u64 = 24;

/// Bytes of the colour of a corner.
pub(super) const COLOR_STRIDE: u64 = 16;

/// Bytes of the texture coordinate of a corner.
pub(super) const UV_STRIDE: u64 = 8;

/// What a pipeline does with what it draws.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Pass {
    /// Replaces colour and depth.
    Opaque,
    /// Replaces depth alone.
    Depth,
    /// Mixes colour with what is there; depth is there already.
    Blend,
}

/// A compiled variant.
#[derive(Debug, Clone)]
pub(super) struct Pipeline {
    pub pipeline: wgpu::RenderPipeline,
    /// For what is transparent: draws its depth alone.
    pub depth_only: Option<wgpu::RenderPipeline>,
    /// Layout of its textures, if it reads any.
    pub textures: Option<wgpu::BindGroupLayout>,
}

/// What a pipeline depends on beside its shader.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Raster {
    mirrored: bool,
    /// Bits of the factor, and units.
    depth_offset: (u32, i32),
}

impl Raster {
    pub(super) fn of(draw: &Draw) -> Self {
        let DepthOffset { factor, units } = draw.depth_offset;
        // 0.0 and -0.0 are one.
        Self { mirrored: draw.mirrored, depth_offset: ((factor + 0.0).to_bits(), units) }
    }

    /// Depth is reversed: what is to be deeper gets less of it.
    fn bias(self) -> wgpu::DepthBiasState {
        let (factor, units) = self.depth_offset;
        wgpu::DepthBiasState { constant: units.saturating_neg(), slope_scale: -f32::from_bits(factor), clamp: 0.0 }
    }
}

/// All variants compiled so far, for one format and number of samples.
#[derive(Debug)]
pub(super) struct Pipelines {
    format: wgpu::TextureFormat,
    samples: u32,
    draw_layout: Option<wgpu::BindGroupLayout>,
    texture_layouts: HashMap<SlotSet, wgpu::BindGroupLayout>,
    sky: Option<wgpu::RenderPipeline>,
    compiled: HashMap<(Variant, Raster), Pipeline>,
    /// How many were made in all.
    pub made: u32,
}

impl Pipelines {
    pub(super) fn new(format: wgpu::TextureFormat, samples: u32) -> Self {
        let (texture_layouts, compiled) = (HashMap::new(), HashMap::new());
        Self { format, samples, draw_layout: None, texture_layouts, sky: None, compiled, made: 0 }
    }

    /// Layout of the uniforms of a draw, the same for all variants: their size differs, and is checked when drawing.
    pub(super) fn draw_layout(&mut self, device: &wgpu::Device) -> Result<wgpu::BindGroupLayout, RenderError> {
        if let Some(layout) = &self.draw_layout {
            return Ok(layout.clone());
        }
        let entry = wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Uniform,
                has_dynamic_offset: true,
                min_binding_size: None,
            },
            count: None,
        };
        let layout = bind_group_layout(device, "uniforms of a draw", &[entry])?;
        Ok(self.draw_layout.insert(layout).clone())
    }

    /// The pipeline of a variant.
    pub(super) fn get(
        &mut self,
        device: &wgpu::Device,
        variant: Variant,
        raster: Raster,
    ) -> Result<Pipeline, RenderError> {
        let key = (variant, raster);
        if let Some(found) = self.compiled.get(&key) {
            return Ok(found.clone());
        }
        let (variant, raster) = key;
        let draw_layout = self.draw_layout(device)?;
        let textures = self.texture_layout(device, &variant)?;
        let text = checked_text(&variant)?;
        let (module, layout) = guarded(device, "compiling a shader", || {
            let source = wgpu::ShaderSource::Wgsl(text.into());
            let module = wgpu::ShaderModuleDescriptor { label: Some("effects"), source };
            // Values of parameters are bound as the uniforms of a draw are.
            let values = has_values(&variant).then_some(&draw_layout);
            let layouts = [Some(&draw_layout), textures.as_ref(), values];
            let used = layouts.iter().rposition(Option::is_some).map_or(0, |last| last + 1);
            let layout = wgpu::PipelineLayoutDescriptor {
                label: None,
                bind_group_layouts: layouts.get(..used).unwrap_or_default(),
                immediate_size: 0,
            };
            (device.make_shader_module(module), device.make_pipeline_layout(&layout))
        })?;
        let compile = |pass| self.compile(device, &variant, &module, &layout, raster, pass);
        let (pipeline, depth_only) = if variant.effects.transparency {
            (compile(Pass::Blend)?, Some(compile(Pass::Depth)?))
        } else {
            (compile(Pass::Opaque)?, None)
        };
        let made = Pipeline { pipeline, depth_only, textures };
        self.made += 1 + u32::from(variant.effects.transparency);
        self.compiled.insert((variant, raster), made.clone());
        Ok(made)
    }

    /// The pipeline of the sky. It leaves depth alone.
    pub(super) fn sky(&mut self, device: &wgpu::Device) -> Result<wgpu::RenderPipeline, RenderError> {
        if let Some(sky) = &self.sky {
            return Ok(sky.clone());
        }
        let draw_layout = self.draw_layout(device)?;
        let text = sky_text(self.format)?;
        let made = guarded(device, "compiling a shader", || {
            let source = wgpu::ShaderSource::Wgsl(text.into());
            let module = device.make_shader_module(wgpu::ShaderModuleDescriptor { label: Some("sky"), source });
            let layout = device.make_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: None,
                bind_group_layouts: &[Some(&draw_layout)],
                immediate_size: 0,
            });
            device.make_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some("sky"),
                layout: Some(&layout),
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: Some("vertex_main"),
                    compilation_options: wgpu::PipelineCompilationOptions::default(),
                    buffers: &[],
                },
                primitive: wgpu::PrimitiveState::default(),
                depth_stencil: Some(depth_state(false, wgpu::CompareFunction::Always)),
                multisample: wgpu::MultisampleState { count: self.samples, ..wgpu::MultisampleState::default() },
                fragment: Some(wgpu::FragmentState {
                    module: &module,
                    entry_point: Some("fragment_main"),
                    compilation_options: wgpu::PipelineCompilationOptions::default(),
                    targets: &[Some(self.format.into())],
                }),
                multiview_mask: None,
                cache: None,
            })
        })?;
        self.made += 1;
        Ok(self.sky.insert(made).clone())
    }

    fn texture_layout(
        &mut self,
        device: &wgpu::Device,
        variant: &Variant,
    ) -> Result<Option<wgpu::BindGroupLayout>, RenderError> {
        let slots = SlotSet::of(variant);
        if slots.is_empty() {
            return Ok(None);
        }
        if let Some(layout) = self.texture_layouts.get(&slots) {
            return Ok(Some(layout.clone()));
        }
        let entries: Vec<_> = Slot::of(variant).map(|slot| slot.layout(variant)).collect();
        let layout = bind_group_layout(device, "textures of a draw", &entries)?;
        self.texture_layouts.insert(slots, layout.clone());
        Ok(Some(layout))
    }

    fn compile(
        &self,
        device: &wgpu::Device,
        variant: &Variant,
        module: &wgpu::ShaderModule,
        layout: &wgpu::PipelineLayout,
        raster: Raster,
        pass: Pass,
    ) -> Result<wgpu::RenderPipeline, RenderError> {
        let instance = wgpu::vertex_attr_array![0 => Uint32x2, 1 => Uint32];
        let lit_corner = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3];
        let corner = wgpu::vertex_attr_array![0 => Float32x3];
        let lit_ends = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x3, 3 => Float32x3];
        // The normals between them are passed over.
        let ends = [(0, 0), (1, MESH_STRIDE)].map(|(shader_location, offset)| wgpu::VertexAttribute {
            format: wgpu::VertexFormat::Float32x3,
            offset,
            shader_location,
        });
        let weights = wgpu::vertex_attr_array![2 => Float32x4, 3 => Float32];
        let weight = wgpu::vertex_attr_array![2 => Float32];
        let error = wgpu::vertex_attr_array![4 => Float32];
        let place = wgpu::vertex_attr_array![5 => Uint32];
        let color = wgpu::vertex_attr_array![6 => Float32x4];
        let colors = wgpu::vertex_attr_array![6 => Float32x4, 7 => Float32x4];
        let uv = wgpu::vertex_attr_array![8 => Float32x2];
        let loose = variant.effects.geometry.is_loose();
        let buffer = if loose {
            // Lattice point and step, in the same places.
            wgpu::VertexBufferLayout {
                array_stride: size_of::<LooseVertex>() as u64,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &instance,
            }
        } else if variant.terrain() {
            wgpu::VertexBufferLayout {
                array_stride: size_of::<Instance>() as u64,
                step_mode: wgpu::VertexStepMode::Instance,
                attributes: &instance,
            }
        } else if variant.strokes() {
            wgpu::VertexBufferLayout {
                array_stride: 2 * MESH_STRIDE,
                step_mode: wgpu::VertexStepMode::Instance,
                attributes: if variant.corner_normals() { &lit_ends } else { &ends },
            }
        } else {
            wgpu::VertexBufferLayout {
                array_stride: MESH_STRIDE,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: if variant.corner_normals() { &lit_corner } else { &corner },
            }
        };
        let mut buffers = vec![Some(buffer)];
        if variant.effects.morph {
            let (stride, step_mode, attributes): (usize, _, &[_]) = if loose {
                (size_of::<f32>(), wgpu::VertexStepMode::Vertex, &weight)
            } else {
                (size_of::<PatchWeights>(), wgpu::VertexStepMode::Instance, &weights)
            };
            buffers.push(Some(wgpu::VertexBufferLayout { array_stride: stride as u64, step_mode, attributes }));
        }
        if variant.errors() {
            let step_mode = if loose { wgpu::VertexStepMode::Vertex } else { wgpu::VertexStepMode::Instance };
            let array_stride = size_of::<f32>() as u64;
            buffers.push(Some(wgpu::VertexBufferLayout { array_stride, step_mode, attributes: &error }));
        }
        if variant.effects.vertex_colors {
            let (array_stride, step_mode, attributes): (_, _, &[_]) = if variant.strokes() {
                (2 * COLOR_STRIDE, wgpu::VertexStepMode::Instance, &colors)
            } else {
                (COLOR_STRIDE, wgpu::VertexStepMode::Vertex, &color)
            };
            buffers.push(Some(wgpu::VertexBufferLayout { array_stride, step_mode, attributes }));
        }
        if variant.corner_uvs() {
            buffers.push(Some(wgpu::VertexBufferLayout {
                array_stride: UV_STRIDE,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &uv,
            }));
        }
        if variant.listed_places() {
            // The indices, one after the other.
            buffers.push(Some(wgpu::VertexBufferLayout {
                array_stride: size_of::<u32>() as u64,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &place,
            }));
        }
        let target = wgpu::ColorTargetState {
            format: self.format,
            blend: (pass == Pass::Blend).then_some(wgpu::BlendState::ALPHA_BLENDING),
            write_mask: if pass == Pass::Depth { wgpu::ColorWrites::empty() } else { wgpu::ColorWrites::ALL },
        };
        guarded(device, "compiling a shader", || {
            device.make_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some("effects"),
                layout: Some(layout),
                vertex: wgpu::VertexState {
                    module,
                    entry_point: Some("vertex_main"),
                    compilation_options: wgpu::PipelineCompilationOptions::default(),
                    buffers: &buffers,
                },
                primitive: wgpu::PrimitiveState {
                    // Triangles are counter-clockwise seen from outside, in a picture whose y points up.
                    front_face: if raster.mirrored { wgpu::FrontFace::Cw } else { wgpu::FrontFace::Ccw },
                    // The two triangles of a stroke lie either way.
                    cull_mode: (!variant.strokes() && !variant.effects.two_sided).then_some(wgpu::Face::Back),
                    ..wgpu::PrimitiveState::default()
                },
                depth_stencil: Some(wgpu::DepthStencilState {
                    bias: raster.bias(),
                    ..depth_state(pass != Pass::Blend, wgpu::CompareFunction::GreaterEqual)
                }),
                multisample: wgpu::MultisampleState { count: self.samples, ..wgpu::MultisampleState::default() },
                fragment: Some(wgpu::FragmentState {
                    module,
                    entry_point: Some(if pass == Pass::Depth { "fragment_depth" } else { "fragment_main" }),
                    compilation_options: wgpu::PipelineCompilationOptions::default(),
                    targets: &[Some(target)],
                }),
                multiview_mask: None,
                cache: None,
            })
        })
    }
}

fn depth_state(write: bool, compare: wgpu::CompareFunction) -> wgpu::DepthStencilState {
    wgpu::DepthStencilState {
        format: DEPTH_FORMAT,
        depth_write_enabled: Some(write),
        depth_compare: Some(compare),
        stencil: wgpu::StencilState::default(),
        bias: wgpu::DepthBiasState::default(),
    }
}

fn bind_group_layout(
    device: &wgpu::Device,
    label: &'static str,
    entries: &[wgpu::BindGroupLayoutEntry],
) -> Result<wgpu::BindGroupLayout, RenderError> {
    let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some(label), entries };
    guarded(device, "laying out bindings", || device.make_bind_group_layout(&descriptor))
}
