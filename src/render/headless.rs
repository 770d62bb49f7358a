//! Pictures without a window.

use std::sync::{Arc, Mutex, PoisonError};

use super::error::guarded;
use super::objects::{Make, make_device, make_instance, make_view};
use super::targets::check_size;
use super::timer::read_buffer;
use super::{DrawCost, Picture, RenderError, Renderer, RendererOptions};
use crate::action::Frame;

/// Pictures are drawn into this format: the device encodes sRGB.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;

/// Draws frames into pictures in memory, with an adapter and a device of its own.
///
/// # Example
///
/// ```no_run
/// use seamount::prelude::*;
/// use seamount::render::Headless;
///
/// let mut scene = Scene::new();
/// let root = scene.root();
/// scene.add(root, PerspectiveCamera::default())?;
/// scene.add(root, Cube::default())?;
///
/// let mut headless = Headless::new(None)?;
/// let picture = headless.draw(&RenderAction::new(640, 480).apply(&scene)?)?;
/// picture.save_png("cube.png")?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Headless {
    adapter: wgpu::AdapterInfo,
    device: wgpu::Device,
    queue: wgpu::Queue,
    renderer: Renderer,
    /// For depth, which is read back with one sample; made when it is asked for.
    depth_renderer: Option<Renderer>,
    target: Option<Target>,
    /// What the device reported outside of any call.
    uncaptured: Arc<Mutex<Option<String>>>,
}

/// The texture that is drawn into and the buffer it is read back through.
#[derive(Debug)]
struct Target {
    size: [u32; 2],
    texture: wgpu::Texture,
    view: wgpu::TextureView,
    buffer: wgpu::Buffer,
    /// Bytes from row to row in the buffer.
    pitch: u32,
}

impl Headless {
    /// Finds an adapter and makes a device: the first one, hardware before software, whose name contains `adapter`
    /// (upper and lower case are the same), and that gives a device.
    ///
    /// # Errors
    ///
    /// [`RenderError::NoAdapter`] when there is none, or none of that name; [`RenderError::NoDevice`] when none of them
    /// gives a device.
    pub fn new(adapter: Option<&str>) -> Result<Self, RenderError> {
        let instance = make_instance();
        let mut adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
        adapters.sort_by_key(|adapter| rank(adapter.get_info().device_type));
        let names: Vec<String> = adapters.iter().map(|a| describe(&a.get_info())).collect();
        if let Some(part) = adapter {
            let part = part.to_lowercase();
            adapters.retain(|a| a.get_info().name.to_lowercase().contains(&part));
        }
        let mut refused = None;
        for found in &adapters {
            match Self::with_adapter(found) {
                Ok(headless) => return Ok(headless),
                Err(error) => refused = refused.or(Some(error)),
            }
        }
        Err(refused.unwrap_or(RenderError::NoAdapter { wanted: adapter.map(str::to_owned), found: names }))
    }

    fn with_adapter(adapter: &wgpu::Adapter) -> Result<Self, RenderError> {
        let info = adapter.get_info();
        let made = make_device(
            adapter,
            &wgpu::DeviceDescriptor {
                label: Some("seamount"),
                required_features: adapter.features() & wgpu::Features::TIMESTAMP_QUERY,
                // Maps may be as large as the adapter's textures.
                required_limits: adapter.limits(),
                memory_hints: wgpu::MemoryHints::MemoryUsage,
                ..wgpu::DeviceDescriptor::default()
            },
        );
        let (device, queue) =
            made.map_err(|e| RenderError::NoDevice { adapter: info.name.clone(), reason: e.to_string() })?;
        let uncaptured = Arc::new(Mutex::new(None));
        let sink = Arc::clone(&uncaptured);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            sink.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error.to_string());
        }));
        let options = RendererOptions { timestamps: true, ..RendererOptions::for_adapter(adapter, FORMAT) };
        let renderer = Renderer::new(&device, &queue, FORMAT, options);
        Ok(Self { adapter: info, device, queue, renderer, depth_renderer: None, target: None, uncaptured })
    }

    /// The adapter that draws.
    #[must_use]
    pub fn adapter(&self) -> &wgpu::AdapterInfo {
        &self.adapter
    }

    /// Draws a frame and reads the picture back.
    ///
    /// # Errors
    ///
    /// As for [`Renderer::draw`], and when the device is lost.
    pub fn draw(&mut self, frame: &Frame) -> Result<Picture, RenderError> {
        let target = Self::target(&mut self.target, &self.device, frame.size)?;
        let mut report = self.renderer.draw(&self.device, &self.queue, frame, &target.view)?;
        let rgba = target.read(&self.device, &self.queue, &target.texture)?;
        report.gpu = self.renderer.gpu_time(&self.device)?;
        self.check()?;
        let [width, height] = frame.size;
        Ok(Picture { width, height, rgba, report })
    }

    /// What each draw of a frame takes, once the frame was drawn; see [`Renderer::costs`].
    ///
    /// # Errors
    ///
    /// As for [`Renderer::costs`].
    pub fn costs(&self, frame: &Frame) -> Result<Vec<DrawCost>, RenderError> {
        self.renderer.costs(frame)
    }

    /// What the sky of a frame takes, if it has one; see [`Renderer::sky_cost`].
    ///
    /// # Errors
    ///
    /// As for [`Renderer::sky_cost`].
    pub fn sky_cost(&self, frame: &Frame) -> Result<Option<DrawCost>, RenderError> {
        self.renderer.sky_cost(frame)
    }

    /// Draws a frame with one sample per pixel and reads the depth back, row by row from the top left, at the centre of
    /// each pixel: near distance over distance along the view (perspective with no far plane), 1 at the near plane; 0
    /// where nothing is.
    ///
    /// # Errors
    ///
    /// As for [`Headless::draw`].
    pub fn draw_depth(&mut self, frame: &Frame) -> Result<Vec<f32>, RenderError> {
        let target = Self::target(&mut self.target, &self.device, frame.size)?;
        let options = RendererOptions { samples: 1, keep_depth: true, timestamps: false };
        let renderer =
            self.depth_renderer.get_or_insert_with(|| Renderer::new(&self.device, &self.queue, FORMAT, options));
        renderer.draw(&self.device, &self.queue, frame, &target.view)?;
        let bytes = match renderer.depth() {
            Some(depth) => target.read(&self.device, &self.queue, depth)?,
            None => Vec::new(),
        };
        self.check()?;
        Ok(bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect())
    }

    fn target<'t>(
        target: &'t mut Option<Target>,
        device: &wgpu::Device,
        size: [u32; 2],
    ) -> Result<&'t Target, RenderError> {
        if target.as_ref().is_some_and(|t| t.size != size) {
            *target = None;
        }
        match target {
            Some(target) => Ok(target),
            None => Ok(target.insert(Target::new(device, size)?)),
        }
    }

    /// An error if the device reported one outside of a call, such as its loss.
    fn check(&self) -> Result<(), RenderError> {
        match self.uncaptured.lock().unwrap_or_else(PoisonError::into_inner).take() {
            None => Ok(()),
            Some(message) => Err(RenderError::Device { doing: "drawing", message }),
        }
    }
}

impl Target {
    fn new(device: &wgpu::Device, [width, height]: [u32; 2]) -> Result<Self, RenderError> {
        check_size(device, [width, height])?;
        // Colours and depths are both four bytes.
        let pitch = (width * 4).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        guarded(device, "making the targets of a picture", || {
            let texture = device.make_texture(&wgpu::TextureDescriptor {
                label: Some("picture"),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: FORMAT,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
                view_formats: &[],
            });
            let view = make_view(&texture);
            let buffer = device.make_buffer(&wgpu::BufferDescriptor {
                label: Some("picture"),
                size: u64::from(pitch) * u64::from(height),
                usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
                mapped_at_creation: false,
            });
            Self { size: [width, height], texture, view, buffer, pitch }
        })
    }

    /// The texels of a texture of this size, four bytes each.
    fn read(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        texture: &wgpu::Texture,
    ) -> Result<Vec<u8>, RenderError> {
        guarded(device, "reading back a picture", || {
            let mut encoder = device.make_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.copy_texture_to_buffer(
                texture.as_image_copy(),
                wgpu::TexelCopyBufferInfo {
                    buffer: &self.buffer,
                    layout: wgpu::TexelCopyBufferLayout {
                        offset: 0,
                        bytes_per_row: Some(self.pitch),
                        rows_per_image: None,
                    },
                },
                texture.size(),
            );
            queue.submit([encoder.finish()]);
        })?;
        let padded = read_buffer(device, &self.buffer)?;
        let row = self.size[0] as usize * 4;
        Ok(padded.chunks_exact(self.pitch as usize).flat_map(|line| line.iter().take(row)).copied().collect())
    }
}

/// Hardware before software.
fn rank(kind: wgpu::DeviceType) -> u8 {
    match kind {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    }
}

fn describe(info: &wgpu::AdapterInfo) -> String {
    format!("{} ({:?}, {:?})", info.name, info.backend, info.device_type)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hardware_comes_first() {
        let mut kinds = [wgpu::DeviceType::Cpu, wgpu::DeviceType::IntegratedGpu, wgpu::DeviceType::DiscreteGpu];
        kinds.sort_by_key(|&kind| rank(kind));
        assert_eq!(kinds, [wgpu::DeviceType::DiscreteGpu, wgpu::DeviceType::IntegratedGpu, wgpu::DeviceType::Cpu]);
    }
}
