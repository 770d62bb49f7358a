//! Pipelines and bindings, one for each variant of the shaders, made when they are first drawn with.

use std::collections::HashMap;

use super::RenderError;
use super::error::guarded;
use super::shader::Variant;
use crate::terrain::{Instance, LooseVertex, PatchWeights};

/// Depth is kept in 32-bit floats.
pub(super) const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Bytes of a corner of a mesh: position, and normal.
pub(super) const MESH_STRIDE: u64 = 24;

/// Which textures a variant reads: 32-bit floats or 16-bit integers for heights, gradients, colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct TextureSet {
    float_heights: bool,
    gradients: bool,
    colors: bool,
}

/// A compiled variant.
#[derive(Debug, Clone)]
pub(super) struct Pipeline {
    pub pipeline: wgpu::RenderPipeline,
    /// Layout of the textures of a terrain.
    pub textures: Option<wgpu::BindGroupLayout>,
}

/// All variants compiled so far, for one format and number of samples.
#[derive(Debug)]
pub(super) struct Pipelines {
    format: wgpu::TextureFormat,
    samples: u32,
    draw_layout: Option<wgpu::BindGroupLayout>,
    texture_layouts: HashMap<TextureSet, wgpu::BindGroupLayout>,
    /// By variant, and whether it is mirrored.
    compiled: HashMap<(Variant, bool), Pipeline>,
    /// How many were made in all.
    pub made: u32,
}

impl Pipelines {
    pub(super) fn new(format: wgpu::TextureFormat, samples: u32) -> Self {
        Self { format, samples, draw_layout: None, texture_layouts: HashMap::new(), compiled: HashMap::new(), made: 0 }
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
        mirrored: bool,
    ) -> Result<Pipeline, RenderError> {
        if let Some(found) = self.compiled.get(&(variant, mirrored)) {
            return Ok(found.clone());
        }
        let draw_layout = self.draw_layout(device)?;
        let textures = if variant.terrain() { Some(self.texture_layout(device, &variant)?) } else { None };
        let pipeline = self.compile(device, &variant, mirrored, &draw_layout, textures.as_ref())?;
        let made = Pipeline { pipeline, textures };
        self.made += 1;
        self.compiled.insert((variant, mirrored), made.clone());
        Ok(made)
    }

    fn texture_layout(
        &mut self,
        device: &wgpu::Device,
        variant: &Variant,
    ) -> Result<wgpu::BindGroupLayout, RenderError> {
        let set =
            TextureSet { float_heights: !variant.integers(), gradients: variant.lit(), colors: variant.color_map };
        if let Some(layout) = self.texture_layouts.get(&set) {
            return Ok(layout.clone());
        }
        let entry = |binding, visibility, ty| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None };
        let texture = |sample_type| wgpu::BindingType::Texture {
            sample_type,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let smooth = texture(wgpu::TextureSampleType::Float { filterable: true });
        let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
        let heights = if set.float_heights {
            wgpu::TextureSampleType::Float { filterable: false }
        } else {
            wgpu::TextureSampleType::Uint
        };
        let fragment = wgpu::ShaderStages::FRAGMENT;
        let mut entries = vec![entry(0, wgpu::ShaderStages::VERTEX, texture(heights))];
        if set.gradients {
            entries.extend([entry(1, fragment, smooth), entry(2, fragment, sampler)]);
        }
        if set.colors {
            entries.extend([entry(3, fragment, smooth), entry(4, fragment, sampler)]);
        }
        let layout = bind_group_layout(device, "textures of a terrain", &entries)?;
        self.texture_layouts.insert(set, layout.clone());
        Ok(layout)
    }

    fn compile(
        &self,
        device: &wgpu::Device,
        variant: &Variant,
        mirrored: bool,
        draw_layout: &wgpu::BindGroupLayout,
        textures: Option<&wgpu::BindGroupLayout>,
    ) -> Result<wgpu::RenderPipeline, RenderError> {
        let text = variant.text()?;
        let mut layouts = vec![Some(draw_layout)];
        layouts.extend(textures.map(Some));
        let instance = wgpu::vertex_attr_array![0 => Uint32x2, 1 => Uint32];
        let weights = wgpu::vertex_attr_array![2 => Float32x4, 3 => Float32];
        let weight = wgpu::vertex_attr_array![2 => Float32];
        let lit_corner = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3];
        let corner = wgpu::vertex_attr_array![0 => Float32x3];
        let buffer = if variant.geometry.is_loose() {
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
        } else {
            wgpu::VertexBufferLayout {
                array_stride: MESH_STRIDE,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: if variant.lit() { &lit_corner } else { &corner },
            }
        };
        let mut buffers = vec![Some(buffer)];
        if variant.morph {
            let (stride, step_mode, attributes): (usize, _, &[_]) = if variant.geometry.is_loose() {
                (size_of::<f32>(), wgpu::VertexStepMode::Vertex, &weight)
            } else {
                (size_of::<PatchWeights>(), wgpu::VertexStepMode::Instance, &weights)
            };
            buffers.push(Some(wgpu::VertexBufferLayout { array_stride: stride as u64, step_mode, attributes }));
        }
        guarded(device, "compiling a shader", || {
            let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some("effects"),
                source: wgpu::ShaderSource::Wgsl(text.into()),
            });
            let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: None,
                bind_group_layouts: &layouts,
                immediate_size: 0,
            });
            device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some("effects"),
                layout: Some(&layout),
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: Some("vertex_main"),
                    compilation_options: wgpu::PipelineCompilationOptions::default(),
                    buffers: &buffers,
                },
                primitive: wgpu::PrimitiveState {
                    // Triangles are counter-clockwise seen from outside, in a picture whose y points up.
                    front_face: if mirrored { wgpu::FrontFace::Cw } else { wgpu::FrontFace::Ccw },
                    cull_mode: Some(wgpu::Face::Back),
                    ..wgpu::PrimitiveState::default()
                },
                depth_stencil: Some(wgpu::DepthStencilState {
                    format: DEPTH_FORMAT,
                    depth_write_enabled: Some(true),
                    depth_compare: Some(wgpu::CompareFunction::GreaterEqual),
                    stencil: wgpu::StencilState::default(),
                    bias: wgpu::DepthBiasState::default(),
                }),
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
        })
    }
}

fn bind_group_layout(
    device: &wgpu::Device,
    label: &'static str,
    entries: &[wgpu::BindGroupLayoutEntry],
) -> Result<wgpu::BindGroupLayout, RenderError> {
    let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some(label), entries };
    guarded(device, "laying out bindings", || device.create_bind_group_layout(&descriptor))
}
