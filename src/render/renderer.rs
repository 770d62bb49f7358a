//! Draws frames with the caller's device.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::{Vec2, Vec3, Vec4};

use super::RenderError;
use super::bindings::{Slot, SlotSet};
use super::buffers::GrowingBuffer;
use super::cache::Cache;
use super::error::guarded;
use super::objects::Make;
use super::pipelines::{COLOR_STRIDE, DEPTH_FORMAT, MESH_STRIDE, Pipeline, Pipelines, Raster, UV_STRIDE};
use super::program::{has_values, whole_text, write_values};
use super::shader::{Variant, encodes, sky_text};
use super::targets::Targets;
use super::textures::{Gpu, Textures};
use super::timer::Timer;
use super::uniforms::{self, Factors, STRIP_COLOR, TILE_COLOR};
use crate::action::{DebugColor, Draw, Fill, Frame, Geometry, GeometryKind, Mesh, PixelArea};
use crate::terrain::{Instance, LooseVertex, Parts, PatchWeights, Resolutions};

/// What a [`Renderer`] is made with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RendererOptions {
    /// Samples per pixel that edges are smoothed with: 1 (not at all) or 4, which every device can do for the usual
    /// formats; more where the device can. See [`RendererOptions::for_adapter`].
    pub samples: u32,
    /// Keeps the depth of the last frame, for [`Renderer::depth`].
    pub keep_depth: bool,
    /// Measures the time that the GPU takes, for [`Renderer::gpu_time`]; needs a device with `TIMESTAMP_QUERY`.
    pub timestamps: bool,
}

impl Default for RendererOptions {
    /// Four samples, depth and times not kept.
    fn default() -> Self {
        Self { samples: 4, keep_depth: false, timestamps: false }
    }
}

impl RendererOptions {
    /// The default for targets of this format: four samples where the adapter has them, else one.
    #[must_use]
    pub fn for_adapter(adapter: &wgpu::Adapter, format: wgpu::TextureFormat) -> Self {
        let can = |format| adapter.get_texture_format_features(format).flags.sample_count_supported(4);
        let resolves = adapter
            .get_texture_format_features(format)
            .flags
            .contains(wgpu::TextureFormatFeatureFlags::MULTISAMPLE_RESOLVE);
        let samples = if can(format) && can(DEPTH_FORMAT) && resolves { 4 } else { 1 };
        Self { samples, ..Self::default() }
    }
}

/// What drawing one frame took.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct DrawReport {
    /// Time on the CPU from the frame to submitted commands: uploads and new pipelines included, waiting not.
    pub encode: Duration,
    /// Time that the GPU took, where it is measured: [`Renderer::draw`] does not wait for it and leaves it out, see
    /// [`Renderer::gpu_time`]; [`Headless`](super::Headless) fills it in.
    pub gpu: Option<Duration>,
    /// Bytes sent to the device: maps and images when they are drawn first, uniforms, instances, loose triangles and meshes
    /// each frame.
    pub bytes_uploaded: u64,
    /// Pipelines that were compiled for this frame.
    pub pipelines_made: u32,
    /// Draw calls.
    pub draw_calls: u32,
    /// Bytes that the renderer holds on the device after the frame: textures, buffers and its own targets.
    pub gpu_bytes: u64,
}

/// What one draw of a frame takes. What several draws share is counted with each of them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct DrawCost {
    /// Number of the shader variant, counted from 0 in the order of the frame: draws with the same number share it.
    pub variant: usize,
    /// Bytes of the variant's WGSL.
    pub shader_bytes: u64,
    /// Bytes of its textures on the device.
    pub texture_bytes: u64,
    /// Bytes of its vertices, indices and instances on the device.
    pub buffer_bytes: u64,
    /// Bytes of its uniforms.
    pub uniform_bytes: u64,
}

/// Draws [`Frame`]s into texture views with a device and queue that the caller owns.
///
/// It keeps pipelines, maps and images on the device from frame to frame, and gives up maps and images that are not drawn
/// for a while. All calls of one renderer have to be given the device that it was made for.
///
/// # Example
///
/// ```no_run
/// use seamount::prelude::*;
/// use seamount::render::{Renderer, RendererOptions};
///
/// # fn draw(device: &wgpu::Device, queue: &wgpu::Queue, view: &wgpu::TextureView, scene: &Scene)
/// # -> Result<(), Box<dyn std::error::Error>> {
/// let format = wgpu::TextureFormat::Rgba8UnormSrgb;
/// let mut renderer = Renderer::new(device, queue, format, RendererOptions::default());
/// // `view` is of that format and 640 × 480 pixels.
/// let frame = RenderAction::new(640, 480).apply(scene)?;
/// let report = renderer.draw(device, queue, &frame, view)?;
/// println!("{} draw calls", report.draw_calls);
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Renderer {
    format: wgpu::TextureFormat,
    options: RendererOptions,
    frame: u64,
    pipelines: Pipelines,
    textures: Textures,
    /// Bindings of the textures of draws.
    bound_textures: Cache<TextureKey, wgpu::BindGroup>,
    /// Index buffers of tiles and strips.
    parts: Cache<Resolutions, wgpu::Buffer>,
    targets: Option<Targets>,
    uniforms: GrowingBuffer,
    /// Bindings of the uniforms by their size.
    bound_uniforms: HashMap<u64, wgpu::BindGroup>,
    instances: GrowingBuffer,
    loose: GrowingBuffer,
    /// Weights of the instances, and of the loose corners, of terrains that morph.
    weights: GrowingBuffer,
    loose_weights: GrowingBuffer,
    /// Errors of instances and of loose corners, where they are coloured by them.
    errors: GrowingBuffer,
    corners: GrowingBuffer,
    /// Colours of corners, where they have any.
    colors: GrowingBuffer,
    /// Texture coordinates of corners, where there is a texture.
    uvs: GrowingBuffer,
    corner_indices: GrowingBuffer,
    timer: Option<Timer>,
    scratch: Scratch,
}

/// Lists that are filled for each frame, kept for their memory.
#[derive(Debug, Default)]
struct Scratch {
    uniforms: Vec<u8>,
    instances: Vec<Instance>,
    loose: Vec<LooseVertex>,
    weights: Vec<PatchWeights>,
    loose_weights: Vec<f32>,
    errors: Vec<f32>,
    corners: Vec<[Vec3; 2]>,
    colors: Vec<Vec4>,
    uvs: Vec<Vec2>,
    corner_indices: Vec<u32>,
    jobs: Vec<Job>,
    fills: Vec<FillJob>,
}

/// A part of the picture to be filled, with all it needs on the device.
#[derive(Debug)]
struct FillJob {
    area: PixelArea,
    pipeline: wgpu::RenderPipeline,
    uniform_size: u64,
    uniforms: u32,
}

/// A draw with all it needs on the device, but for the buffers of the frame.
#[derive(Debug)]
struct Job {
    /// Which draw of the frame.
    draw: usize,
    pipeline: wgpu::RenderPipeline,
    depth_only: Option<wgpu::RenderPipeline>,
    uniform_size: u64,
    /// Where its uniforms lie, for tiles and for strips.
    uniforms: [u32; 2],
    /// Where the values of its shaders' parameters lie, and how many bytes they are.
    values: Option<(u32, u64)>,
    /// Whether corners are drawn one after the other instead of by index.
    edges: bool,
    textures: Option<wgpu::BindGroup>,
    geometry: Ready,
}

#[derive(Debug)]
enum Ready {
    Terrain {
        indices: wgpu::Buffer,
        /// First of its instances in the buffer of the frame.
        first: u32,
        /// First of their weights, if the terrain morphs.
        first_weight: Option<u32>,
        /// First of their errors, if they are coloured by them.
        first_error: Option<u32>,
    },
    Loose {
        /// First of its corners in the buffer of the frame.
        first: u32,
        /// First of their weights, if the terrain morphs.
        first_weight: Option<u32>,
        /// First of their errors, if they are coloured by them.
        first_error: Option<u32>,
    },
    Mesh {
        corners: Corners,
        /// First of its indices in the buffer of the frame; 0 where corners are drawn one after the other.
        first: u32,
        /// Number of indices, or of corners.
        count: u32,
    },
    Strokes {
        /// The ends of its pieces.
        ends: Corners,
        /// Number of pieces.
        count: u32,
    },
}

/// First of the corners of a draw in the buffers of the frame.
#[derive(Debug, Clone, Copy)]
struct Corners {
    first: u32,
    /// First of their colours, where they have any.
    color: Option<u32>,
    /// First of their texture coordinates, where there is a texture.
    uv: Option<u32>,
}

/// What bindings of textures depend on: the slots, and what is in each of them.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct TextureKey {
    slots: SlotSet,
    contents: [u64; Slot::ALL.len()],
    /// Those of the shaders' parameters.
    parameters: Vec<u64>,
}

impl Renderer {
    /// A renderer for targets of `format`. If the format is of integers and does not encode sRGB by itself, the shaders do;
    /// formats of floats are given linear light.
    ///
    /// Nothing is made on the device until something is drawn.
    #[must_use]
    pub fn new(
        _device: &wgpu::Device,
        _queue: &wgpu::Queue,
        format: wgpu::TextureFormat,
        options: RendererOptions,
    ) -> Self {
        let buffer = GrowingBuffer::new;
        Self {
            format,
            options,
            frame: 0,
            pipelines: Pipelines::new(format, options.samples),
            textures: Textures::default(),
            bound_textures: Cache::default(),
            parts: Cache::default(),
            targets: None,
            uniforms: buffer("uniforms of a frame", wgpu::BufferUsages::UNIFORM),
            bound_uniforms: HashMap::new(),
            instances: buffer("instances of a frame", wgpu::BufferUsages::VERTEX),
            loose: buffer("loose triangles of a frame", wgpu::BufferUsages::VERTEX),
            weights: buffer("weights of a frame", wgpu::BufferUsages::VERTEX),
            loose_weights: buffer("weights of loose triangles", wgpu::BufferUsages::VERTEX),
            errors: buffer("errors of a frame", wgpu::BufferUsages::VERTEX),
            corners: buffer("meshes of a frame", wgpu::BufferUsages::VERTEX),
            colors: buffer("colours of corners", wgpu::BufferUsages::VERTEX),
            uvs: buffer("texture coordinates of corners", wgpu::BufferUsages::VERTEX),
            corner_indices: buffer("meshes of a frame", wgpu::BufferUsages::INDEX),
            timer: None,
            scratch: Scratch::default(),
        }
    }

    /// Draws a frame into `view`, which has to be a view of a texture of the renderer's format, of the frame's size, with
    /// one sample. Returns when the commands are submitted; does not wait for the GPU.
    ///
    /// # Errors
    ///
    /// When the size of the picture, a map or an image is beyond what the device can do, memory runs out, or the device
    /// refuses the view. The renderer can be used on.
    pub fn draw(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        frame: &Frame,
        view: &wgpu::TextureView,
    ) -> Result<DrawReport, RenderError> {
        let start = Instant::now();
        self.frame += 1;
        let gpu = Gpu { device, queue, frame: self.frame };
        let pipelines_before = self.pipelines.made;
        self.textures.uploaded = 0;

        if !self.targets.as_ref().is_some_and(|t| t.fits(frame.size)) {
            // The old ones first, so that both are never there at once.
            self.targets = None;
            let options = &self.options;
            self.targets = Some(Targets::new(device, frame.size, self.format, options.samples, options.keep_depth)?);
        }
        if self.options.timestamps && self.timer.is_none() {
            self.timer = Timer::new(device, queue)?;
        }
        self.prepare(gpu, frame)?;
        self.send(gpu)?;
        let draw_calls = guarded(device, "drawing", || self.encode(gpu, frame, view))?;
        self.scratch.jobs.clear();
        self.scratch.fills.clear();

        self.textures.retire(self.frame);
        self.bound_textures.retire(self.frame);
        self.parts.retire(self.frame);
        let scratch = &self.scratch;
        let sent = scratch.uniforms.len()
            + size_of_val(scratch.instances.as_slice())
            + size_of_val(scratch.loose.as_slice())
            + size_of_val(scratch.weights.as_slice())
            + size_of_val(scratch.loose_weights.as_slice())
            + size_of_val(scratch.errors.as_slice())
            + size_of_val(scratch.corners.as_slice())
            + size_of_val(scratch.colors.as_slice())
            + size_of_val(scratch.uvs.as_slice())
            + size_of_val(scratch.corner_indices.as_slice());
        Ok(DrawReport {
            encode: start.elapsed(),
            gpu: None,
            bytes_uploaded: self.textures.uploaded + sent as u64,
            pipelines_made: self.pipelines.made - pipelines_before,
            draw_calls,
            gpu_bytes: self.gpu_bytes(),
        })
    }

    /// Waits until the last frame is drawn and says how long the GPU took for it. `None` if
    /// [`RendererOptions::timestamps`] is off or the device can not measure it, or nothing was drawn yet.
    ///
    /// # Errors
    ///
    /// When the device is lost.
    pub fn gpu_time(&self, device: &wgpu::Device) -> Result<Option<Duration>, RenderError> {
        self.timer.as_ref().map_or(Ok(None), |timer| timer.read(device))
    }

    /// The depth of the last frame, a texture of format `Depth32Float` that can be copied from, if
    /// [`RendererOptions::keep_depth`] is on: 1 at the near plane, 0 infinitely far away and where nothing is.
    #[must_use]
    pub fn depth(&self) -> Option<&wgpu::Texture> {
        self.targets.as_ref().filter(|_| self.options.keep_depth).map(|t| &t.depth)
    }

    /// Bytes that the renderer holds on the device.
    #[must_use]
    pub fn gpu_bytes(&self) -> u64 {
        let instances = [&self.instances, &self.weights, &self.loose, &self.loose_weights, &self.errors];
        let meshes = [&self.uniforms, &self.corners, &self.colors, &self.uvs, &self.corner_indices];
        self.textures.bytes()
            + self.parts.values().map(wgpu::Buffer::size).sum::<u64>()
            + self.targets.as_ref().map_or(0, |t| t.bytes)
            + meshes.into_iter().chain(instances).map(GrowingBuffer::size).sum::<u64>()
    }

    /// What each draw of a frame takes, once the frame was drawn; textures that are not on the device count nothing.
    ///
    /// # Errors
    ///
    /// When effects contradict each other.
    pub fn costs(&self, frame: &Frame) -> Result<Vec<DrawCost>, RenderError> {
        let mut variants: Vec<Variant> = Vec::new();
        let cost = |draw: &Draw| {
            let variant = Variant::of(draw, self.format)?;
            let number = variants.iter().position(|v| *v == variant).unwrap_or_else(|| {
                variants.push(variant.clone());
                variants.len() - 1
            });
            let mut uniforms = Vec::new();
            let buffer_bytes = match &draw.geometry {
                Geometry::Terrain(terrain) if variant.effects.geometry.is_loose() => {
                    let weights = if variant.effects.morph { terrain.instances.loose_weights() } else { &[] };
                    let errors = if variant.errors() { terrain.instances.loose_errors() } else { &[] };
                    (size_of_val(terrain.instances.loose()) + size_of_val(weights) + size_of_val(errors)) as u64
                }
                Geometry::Terrain(terrain) => {
                    let indices = self.parts.peek(&terrain.parts.resolutions()).map_or(0, wgpu::Buffer::size);
                    let weights = if variant.effects.morph { terrain.instances.weights() } else { &[] };
                    let errors = if variant.errors() { terrain.instances.errors() } else { &[] };
                    let data = size_of_val(terrain.instances.data());
                    indices + (data + size_of_val(weights) + size_of_val(errors)) as u64
                }
                Geometry::Mesh(mesh) => {
                    let uvs = if variant.corner_uvs() { mesh.uvs.as_slice() } else { &[] };
                    mesh.positions.len() as u64 * MESH_STRIDE
                        + size_of_val(mesh.colors.as_slice()) as u64
                        + size_of_val(uvs) as u64
                        + size_of_val(mesh.triangles.as_slice()) as u64
                }
                Geometry::Strokes(strokes) => {
                    (size_of_val(strokes.pieces.as_slice()) + size_of_val(strokes.colors.as_slice())) as u64
                }
            };
            Ok(DrawCost {
                variant: number,
                shader_bytes: whole_text(&variant)?.len() as u64,
                texture_bytes: Slot::of(&variant).map(|slot| self.textures.held(draw, slot)).sum(),
                buffer_bytes,
                uniform_bytes: uniforms::write(&variant, draw, draw.material.diffuse, Factors::ONE, &mut uniforms)
                    + draw.program.as_ref().map_or(0, |program| write_values(program, &mut uniforms)),
            })
        };
        frame.draws.iter().map(cost).collect()
    }

    /// What the sky of a frame takes, if it has one: a shader and uniforms of its own. A background of one colour takes nothing.
    ///
    /// # Errors
    ///
    /// As for [`Renderer::costs`].
    pub fn sky_cost(&self, frame: &Frame) -> Result<Option<DrawCost>, RenderError> {
        let Some(sky) = &frame.sky else { return Ok(None) };
        let variant = self.costs(frame)?.iter().map(|cost| cost.variant + 1).max().unwrap_or(0);
        let shader_bytes = sky_text(self.format)?.len() as u64;
        let uniform_bytes = uniforms::write_sky(sky, &mut Vec::new());
        Ok(Some(DrawCost { variant, shader_bytes, uniform_bytes, ..DrawCost::default() }))
    }

    /// Gets or makes all that the draws need but for the frame's own buffers, whose contents are listed.
    fn prepare(&mut self, gpu: Gpu<'_>, frame: &Frame) -> Result<(), RenderError> {
        let scratch = &mut self.scratch;
        scratch.uniforms.clear();
        scratch.instances.clear();
        scratch.loose.clear();
        scratch.weights.clear();
        scratch.loose_weights.clear();
        scratch.errors.clear();
        scratch.corners.clear();
        scratch.colors.clear();
        scratch.uvs.clear();
        scratch.corner_indices.clear();
        scratch.jobs.clear();
        scratch.fills.clear();
        for Fill { area, sky } in frame.fills().into_iter().flatten() {
            let pipeline = self.pipelines.sky(gpu.device)?;
            let (uniforms, uniform_size) = scratch.add_uniforms(gpu, |bytes| uniforms::write_sky(&sky, bytes));
            scratch.fills.push(FillJob { area, pipeline, uniform_size, uniforms });
        }
        for (index, draw) in frame.draws.iter().enumerate() {
            // What is out of view costs nothing, not even its map.
            if draw.calls() > 0 && draw.triangles() > 0 {
                let job = self.prepare_draw(gpu, draw, index)?;
                self.scratch.jobs.push(job);
            }
        }
        Ok(())
    }

    fn prepare_draw(&mut self, gpu: Gpu<'_>, draw: &Draw, index: usize) -> Result<Job, RenderError> {
        check_effects(draw)?;
        let variant = Variant::of(draw, self.format)?;
        let pipeline = self.pipelines.get(gpu.device, variant.clone(), Raster::of(draw))?;
        let textures = match &pipeline.textures {
            Some(layout) => Some(self.bind_textures(gpu, &variant, draw, layout)?),
            None => None,
        };
        let factors = self.textures.factors(gpu, draw, &variant)?;
        let scratch = &mut self.scratch;
        let geometry = match &draw.geometry {
            Geometry::Terrain(terrain) if variant.effects.geometry.is_loose() => {
                let first = append(&mut scratch.loose, terrain.instances.loose());
                let weights = terrain.instances.loose_weights();
                let first_weight = variant.effects.morph.then(|| append(&mut scratch.loose_weights, weights));
                let errors = terrain.instances.loose_errors();
                let first_error = variant.errors().then(|| append(&mut scratch.errors, errors));
                Ready::Loose { first, first_weight, first_error }
            }
            Geometry::Terrain(terrain) => {
                let indices = self.parts.get(terrain.parts.resolutions(), gpu.frame, || {
                    index_buffer(gpu, &terrain.parts, &mut self.textures.uploaded)
                })?;
                let first = append(&mut scratch.instances, terrain.instances.data());
                let weights = terrain.instances.weights();
                let first_weight = variant.effects.morph.then(|| append(&mut scratch.weights, weights));
                let errors = terrain.instances.errors();
                let first_error = variant.errors().then(|| append(&mut scratch.errors, errors));
                Ready::Terrain { indices: indices.clone(), first, first_weight, first_error }
            }
            Geometry::Mesh(mesh) => scratch.add_mesh(mesh, &variant),
            Geometry::Strokes(strokes) => {
                let first = append(&mut scratch.corners, strokes.pieces.as_flattened());
                let colored = variant.effects.vertex_colors;
                let color = colored.then(|| append(&mut scratch.colors, strokes.colors.as_flattened()));
                Ready::Strokes { ends: Corners { first, color, uv: None }, count: strokes.pieces.len() as u32 }
            }
        };
        let mut uniform_size = 0;
        let mut add = |color: Vec3| {
            let write = |bytes: &mut Vec<u8>| uniforms::write(&variant, draw, color, factors, bytes);
            let offset;
            (offset, uniform_size) = self.scratch.add_uniforms(gpu, write);
            offset
        };
        let uniforms = match draw.effects.debug_color {
            DebugColor::Parts => [TILE_COLOR, STRIP_COLOR].map(|color| add(uniforms::linear(color))),
            DebugColor::Plain | DebugColor::Levels | DebugColor::Normals | DebugColor::Errors => {
                [add(draw.material.diffuse); 2]
            }
        };
        let values = draw
            .program
            .as_ref()
            .filter(|_| has_values(&variant))
            .map(|program| self.scratch.add_uniforms(gpu, |bytes| write_values(program, bytes)));
        let Pipeline { pipeline, depth_only, .. } = pipeline;
        Ok(Job {
            values,
            draw: index,
            pipeline,
            depth_only,
            uniform_size,
            uniforms,
            edges: variant.edges(),
            textures,
            geometry,
        })
    }

    /// The bindings of the textures that a draw reads.
    fn bind_textures(
        &mut self,
        gpu: Gpu<'_>,
        variant: &Variant,
        draw: &Draw,
        layout: &wgpu::BindGroupLayout,
    ) -> Result<wgpu::BindGroup, RenderError> {
        let mut key =
            TextureKey { slots: SlotSet::of(variant), contents: [0; Slot::ALL.len()], parameters: Vec::new() };
        let mut contents = [const { None }; Slot::ALL.len()];
        let mut parameters = Vec::new();
        // Asked for each frame, which keeps them: caches drop what is not asked for. Views and samplers are handles.
        for (index, slot) in Slot::of(variant).enumerate() {
            let (found, content) = self.textures.content(gpu, draw, slot)?;
            let content = (slot.binding(), content);
            match (key.contents.get_mut(index), contents.get_mut(index)) {
                (Some(id), Some(place)) if !slot.is_parameter() => {
                    *id = found;
                    *place = Some(content);
                }
                _ => {
                    key.parameters.push(found);
                    parameters.push(content);
                }
            }
        }
        let group = self.bound_textures.get(key, gpu.frame, || {
            let entries: Vec<_> = contents
                .iter()
                .flatten()
                .chain(&parameters)
                .map(|(binding, content)| wgpu::BindGroupEntry { binding: *binding, resource: content.resource() })
                .collect();
            let label = Some("textures of a draw");
            guarded(gpu.device, "binding textures", || {
                gpu.device.make_bind_group(&wgpu::BindGroupDescriptor { label, layout, entries: &entries })
            })
        })?;
        Ok(group.clone())
    }

    /// Sends the frame's own buffers and binds the uniforms.
    fn send(&mut self, gpu: Gpu<'_>) -> Result<(), RenderError> {
        let Gpu { device, queue, .. } = gpu;
        let scratch = &mut self.scratch;
        if self.uniforms.write(device, queue, &scratch.uniforms)? {
            self.bound_uniforms.clear();
        }
        self.instances.write(device, queue, bytemuck::cast_slice(&scratch.instances))?;
        self.loose.write(device, queue, bytemuck::cast_slice(&scratch.loose))?;
        self.weights.write(device, queue, bytemuck::cast_slice(&scratch.weights))?;
        self.loose_weights.write(device, queue, bytemuck::cast_slice(&scratch.loose_weights))?;
        self.errors.write(device, queue, bytemuck::cast_slice(&scratch.errors))?;
        self.corners.write(device, queue, bytemuck::cast_slice(&scratch.corners))?;
        self.colors.write(device, queue, bytemuck::cast_slice(&scratch.colors))?;
        self.uvs.write(device, queue, bytemuck::cast_slice(&scratch.uvs))?;
        self.corner_indices.write(device, queue, bytemuck::cast_slice(&scratch.corner_indices))?;
        let Some(buffer) = self.uniforms.get() else { return Ok(()) };
        let layout = self.pipelines.draw_layout(device)?;
        let sizes = scratch.fills.iter().map(|fill| fill.uniform_size);
        let values = scratch.jobs.iter().filter_map(|job| job.values).map(|(_, size)| size);
        for size in sizes.chain(scratch.jobs.iter().map(|job| job.uniform_size)).chain(values) {
            if self.bound_uniforms.contains_key(&size) {
                continue;
            }
            let resource = wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                buffer,
                offset: 0,
                size: wgpu::BufferSize::new(size),
            });
            let group = guarded(device, "binding uniforms", || {
                device.make_bind_group(&wgpu::BindGroupDescriptor {
                    label: Some("uniforms of a draw"),
                    layout: &layout,
                    entries: &[wgpu::BindGroupEntry { binding: 0, resource }],
                })
            })?;
            self.bound_uniforms.insert(size, group);
        }
        Ok(())
    }

    /// Records and submits the commands. Returns the number of draw calls.
    fn encode(&self, gpu: Gpu<'_>, frame: &Frame, view: &wgpu::TextureView) -> u32 {
        let Some(targets) = &self.targets else { return 0 };
        let mut encoder = gpu.device.make_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("frame") });
        let mut calls = 0;
        {
            let (color_view, resolve_target) = match &targets.color {
                Some(samples) => (samples, Some(view)),
                None => (view, None),
            };
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("frame"),
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: color_view,
                    depth_slice: None,
                    resolve_target,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(self.clear_color(frame.clear())),
                        store: if resolve_target.is_some() { wgpu::StoreOp::Discard } else { wgpu::StoreOp::Store },
                    },
                })],
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: &targets.depth_view,
                    depth_ops: Some(wgpu::Operations {
                        load: wgpu::LoadOp::Clear(0.0),
                        store: if self.options.keep_depth { wgpu::StoreOp::Store } else { wgpu::StoreOp::Discard },
                    }),
                    stencil_ops: None,
                }),
                timestamp_writes: self.timer.as_ref().map(Timer::writes),
                occlusion_query_set: None,
                multiview_mask: None,
            });
            let limit = |pass: &mut wgpu::RenderPass<'_>, area: PixelArea| {
                pass.set_scissor_rect(area.left, area.top, area.width, area.height);
            };
            for fill in &self.scratch.fills {
                let Some(bound) = self.bound_uniforms.get(&fill.uniform_size) else { continue };
                if frame.crop.is_some() {
                    limit(&mut pass, fill.area);
                }
                pass.set_pipeline(&fill.pipeline);
                pass.set_bind_group(0, bound, &[fill.uniforms]);
                pass.draw(0..3, 0..1);
                calls += 1;
            }
            if let Some(crop) = frame.crop {
                limit(&mut pass, crop.area);
            }
            // What is one surface in two draws, a terrain's instances and its loose triangles, hides itself: depth of both
            // before colour of either.
            let instances = |job: &Job| match frame.draws.get(job.draw).map(|draw| &draw.geometry) {
                Some(Geometry::Terrain(terrain)) => Some(Arc::as_ptr(&terrain.instances)),
                _ => None,
            };
            for surface in self.scratch.jobs.chunk_by(|a, b| instances(a).is_some_and(|a| instances(b) == Some(a))) {
                let depths = surface.iter().filter_map(|job| Some((job, job.depth_only.as_ref()?)));
                for (job, pipeline) in depths.chain(surface.iter().map(|job| (job, &job.pipeline))) {
                    let Some(draw) = frame.draws.get(job.draw) else { continue };
                    calls += self.encode_job(&mut pass, pipeline, job, draw);
                }
            }
        }
        if let Some(timer) = &self.timer {
            timer.resolve(&mut encoder);
        }
        gpu.queue.submit([encoder.finish()]);
        calls
    }

    fn encode_job(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        pipeline: &wgpu::RenderPipeline,
        job: &Job,
        draw: &Draw,
    ) -> u32 {
        let Some(bound_uniforms) = self.bound_uniforms.get(&job.uniform_size) else { return 0 };
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, bound_uniforms, &job.uniforms[..1]);
        if let Some(textures) = &job.textures {
            pass.set_bind_group(1, textures, &[]);
        }
        if let Some((offset, size)) = job.values
            && let Some(bound) = self.bound_uniforms.get(&size)
        {
            pass.set_bind_group(2, bound, &[offset]);
        }
        match (&job.geometry, &draw.geometry) {
            (Ready::Terrain { indices, first, first_weight, first_error }, Geometry::Terrain(terrain)) => {
                let Some(instances) = self.instances.get() else { return 0 };
                // From its own on: another terrain of the frame may have no weights.
                pass.set_vertex_buffer(0, instances.slice(u64::from(*first) * size_of::<Instance>() as u64..));
                if let Some(first) = first_weight {
                    let Some(weights) = self.weights.get() else { return 0 };
                    pass.set_vertex_buffer(1, weights.slice(u64::from(*first) * size_of::<PatchWeights>() as u64..));
                }
                let errors = 1 + u32::from(first_weight.is_some());
                if !self.set_errors(pass, errors, *first_error) {
                    return 0;
                }
                if job.edges {
                    pass.set_vertex_buffer(errors + u32::from(first_error.is_some()), indices.slice(..));
                } else {
                    pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
                }
                // Parts are numbered tiles first.
                let tiles = 4 * terrain.parts.resolutions().count() as usize;
                let mut bound = job.uniforms[0];
                for (part, range) in terrain.instances.ranges() {
                    let wanted = job.uniforms[usize::from(*part >= tiles)];
                    if wanted != bound {
                        pass.set_bind_group(0, bound_uniforms, &[wanted]);
                        bound = wanted;
                    }
                    let triangles = terrain.parts.range(*part);
                    let corners = triangles.start * 3..triangles.end * 3;
                    if job.edges {
                        pass.draw(corners, range.clone());
                    } else {
                        pass.draw_indexed(corners, 0, range.clone());
                    }
                }
                terrain.instances.ranges().len() as u32
            }
            (Ready::Loose { first, first_weight, first_error }, Geometry::Terrain(terrain)) => {
                let Some(corners) = self.loose.get() else { return 0 };
                pass.set_vertex_buffer(0, corners.slice(u64::from(*first) * size_of::<LooseVertex>() as u64..));
                if let Some(first) = first_weight {
                    let Some(weights) = self.loose_weights.get() else { return 0 };
                    pass.set_vertex_buffer(1, weights.slice(u64::from(*first) * size_of::<f32>() as u64..));
                }
                if !self.set_errors(pass, 1 + u32::from(first_weight.is_some()), *first_error) {
                    return 0;
                }
                // Tiles and strips in one call, unless their uniforms differ.
                let [tiles, strips] = terrain.instances.loose_ranges();
                let whole = tiles.start..strips.end;
                let ranges =
                    if job.uniforms[0] == job.uniforms[1] { [whole, strips.end..strips.end] } else { [tiles, strips] };
                let mut calls = 0;
                for (range, uniforms) in ranges.into_iter().zip(job.uniforms).filter(|(range, _)| !range.is_empty()) {
                    pass.set_bind_group(0, bound_uniforms, &[uniforms]);
                    pass.draw(range, 0..1);
                    calls += 1;
                }
                calls
            }
            (Ready::Mesh { corners, first, count }, _) => {
                if !self.set_corners(pass, corners) {
                    return 0;
                }
                if job.edges {
                    pass.draw(0..*count, 0..1);
                    return 1;
                }
                let Some(indices) = self.corner_indices.get() else { return 0 };
                pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
                pass.draw_indexed(*first..first + count, 0, 0..1);
                1
            }
            (Ready::Strokes { ends, count }, _) => {
                if !self.set_corners(pass, ends) {
                    return 0;
                }
                pass.draw(0..6, 0..*count);
                1
            }
            (Ready::Terrain { .. } | Ready::Loose { .. }, Geometry::Mesh(_) | Geometry::Strokes(_)) => 0,
        }
    }

    /// Binds the errors from the first of a draw on, if it has some; false if there is no buffer.
    fn set_errors(&self, pass: &mut wgpu::RenderPass<'_>, slot: u32, first: Option<u32>) -> bool {
        let Some(first) = first else { return true };
        let Some(errors) = self.errors.get() else { return false };
        pass.set_vertex_buffer(slot, errors.slice(u64::from(first) * size_of::<f32>() as u64..));
        true
    }

    /// Sets the buffers of corners, each from the draw's own on; whether they are there.
    fn set_corners(&self, pass: &mut wgpu::RenderPass<'_>, of: &Corners) -> bool {
        let Some(corners) = self.corners.get() else { return false };
        pass.set_vertex_buffer(0, corners.slice(u64::from(of.first) * MESH_STRIDE..));
        let streams = [(of.color, &self.colors, COLOR_STRIDE), (of.uv, &self.uvs, UV_STRIDE)];
        let streams = streams.into_iter().filter_map(|(first, buffer, stride)| Some((first?, buffer, stride)));
        for ((first, buffer, stride), slot) in streams.zip(1..) {
            let Some(buffer) = buffer.get() else { return false };
            pass.set_vertex_buffer(slot, buffer.slice(u64::from(first) * stride..));
        }
        true
    }

    fn clear_color(&self, linear: Vec3) -> wgpu::Color {
        let encoded = |c: f32| {
            let c = f64::from(c.clamp(0.0, 1.0));
            if !encodes(self.format) {
                c
            } else if c <= 0.003_130_8 {
                c * 12.92
            } else {
                1.055 * c.powf(1.0 / 2.4) - 0.055
            }
        };
        wgpu::Color { r: encoded(linear.x), g: encoded(linear.y), b: encoded(linear.z), a: 1.0 }
    }
}

impl Scratch {
    /// Appends uniforms where they may begin; returns where that is, and how many bytes they are.
    fn add_uniforms(&mut self, gpu: Gpu<'_>, write: impl FnOnce(&mut Vec<u8>) -> u64) -> (u32, u64) {
        let alignment = gpu.device.limits().min_uniform_buffer_offset_alignment as usize;
        self.uniforms.resize(self.uniforms.len().next_multiple_of(alignment), 0);
        let offset = self.uniforms.len() as u32;
        let size = write(&mut self.uniforms);
        (offset, size)
    }

    /// With edges each triangle has corners of its own.
    fn add_mesh(&mut self, mesh: &Mesh, variant: &Variant) -> Ready {
        let (colored, mapped) = (variant.effects.vertex_colors, variant.corner_uvs());
        let corners = Corners {
            first: self.corners.len() as u32,
            color: colored.then_some(self.colors.len() as u32),
            uv: mapped.then_some(self.uvs.len() as u32),
        };
        let count = mesh.triangles.len() as u32 * 3;
        if variant.edges() {
            let all = || mesh.triangles.iter().flatten().map(|&corner| corner as usize);
            let normal = |at: usize| mesh.normals.get(at).copied().unwrap_or_default();
            self.corners.extend(all().map(|at| [mesh.positions.get(at).copied().unwrap_or_default(), normal(at)]));
            if colored {
                self.colors.extend(all().map(|at| mesh.colors.get(at).copied().unwrap_or_default()));
            }
            if mapped {
                self.uvs.extend(all().map(|at| mesh.uvs.get(at).copied().unwrap_or_default()));
            }
            return Ready::Mesh { corners, first: 0, count };
        }
        self.corners.extend(mesh.positions.iter().zip(&mesh.normals).map(|(&p, &n)| [p, n]));
        if colored {
            self.colors.extend_from_slice(&mesh.colors);
        }
        if mapped {
            self.uvs.extend_from_slice(&mesh.uvs);
        }
        let first = append(&mut self.corner_indices, mesh.triangles.as_flattened());
        Ready::Mesh { corners, first, count }
    }
}

/// Appends to what is uploaded together; returns where the addition begins.
fn append<T: Copy>(all: &mut Vec<T>, more: &[T]) -> u32 {
    let first = all.len() as u32;
    all.extend_from_slice(more);
    first
}

/// Whether a draw has what its effects ask for.
fn check_effects(draw: &Draw) -> Result<(), RenderError> {
    let kind = match &draw.geometry {
        Geometry::Mesh(mesh) => {
            let corners = mesh.positions.len().min(mesh.normals.len());
            if mesh.triangles.iter().flatten().any(|&corner| corner as usize >= corners) {
                return Err(RenderError::Effects("a mesh has triangles between corners that it does not have"));
            }
            if draw.effects.vertex_colors && mesh.colors.len() < corners {
                return Err(RenderError::Effects("corners are to have colours, but not all have one"));
            }
            if draw.effects.color_map && mesh.uvs.len() < corners {
                return Err(RenderError::Effects("there is a texture, but not all corners have texture coordinates"));
            }
            GeometryKind::Mesh
        }
        Geometry::Strokes(strokes) => {
            if draw.effects.lit() && !strokes.lit {
                return Err(RenderError::Effects("lines are to be lit, but have no normals"));
            }
            if draw.effects.vertex_colors && strokes.colors.len() < strokes.pieces.len() {
                return Err(RenderError::Effects("the ends of lines are to have colours, but not all have one"));
            }
            GeometryKind::Strokes
        }
        Geometry::Terrain(terrain) => GeometryKind::of_terrain(&terrain.heights, draw.effects.geometry.is_loose()),
    };
    if draw.effects.morph
        && let Geometry::Terrain(terrain) = &draw.geometry
        && !terrain.instances.morphs()
    {
        return Err(RenderError::Effects("heights are to blend between levels, but the instances have no weights"));
    }
    if draw.effects.debug_color == DebugColor::Errors
        && let Geometry::Terrain(terrain) = &draw.geometry
    {
        let list = &terrain.instances;
        let rated = match kind.is_loose() {
            true => list.loose_errors().len() == list.loose().len(),
            false => list.errors().len() == list.data().len(),
        };
        if !rated {
            return Err(RenderError::Effects("errors are to be coloured, but the instances were not rated"));
        }
    }
    if draw.effects.geometry != kind {
        return Err(RenderError::Effects("the effects are for another kind of geometry"));
    }
    let has_map = draw.coloring.color_map.is_some();
    if draw.effects.color_map && draw.effects.debug_color == DebugColor::Plain && !has_map {
        return Err(RenderError::Effects("a colour map is asked for, but there is none"));
    }
    Ok(())
}

/// The corners of all parts, each as its place in the patch: `u | v << 10`.
fn index_buffer(gpu: Gpu<'_>, parts: &Parts, uploaded: &mut u64) -> Result<wgpu::Buffer, RenderError> {
    let corners = parts.all_triangles().iter().flatten();
    let indices: Vec<u32> = corners.map(|&[u, v]| u32::from(u) | u32::from(v) << 10).collect();
    let bytes: &[u8] = bytemuck::cast_slice(&indices);
    *uploaded += bytes.len() as u64;
    let mut buffer = GrowingBuffer::new("tiles and strips", wgpu::BufferUsages::INDEX | wgpu::BufferUsages::VERTEX);
    buffer.write(gpu.device, gpu.queue, bytes)?;
    buffer.get().cloned().ok_or(RenderError::Effects("there are no parts"))
}
