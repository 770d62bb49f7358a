//! Drawing in tests: one device for each test binary, pictures in linear light, and access to shader modules.

use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

use half::f16;
use seamount::action::Frame;
use seamount::render::{DrawReport, Headless, RenderError, Renderer, RendererOptions};

/// One for all tests of a binary: making a device takes longer than most pictures.
pub fn headless() -> MutexGuard<'static, Headless> {
    static HEADLESS: OnceLock<Mutex<Headless>> = OnceLock::new();
    let made = HEADLESS.get_or_init(|| Mutex::new(Headless::new(None).unwrap_or_else(|error| panic!("{error}"))));
    made.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Draws into 16-bit floats with one sample, so that colours are linear light at the centres of pixels, not clamped.
pub struct Linear {
    device: wgpu::Device,
    queue: wgpu::Queue,
    renderer: Renderer,
}

/// A picture in linear light: red, green, blue and opacity, row by row from the top left.
pub struct LinearPicture {
    pub size: [u32; 2],
    pub texels: Vec<[f32; 4]>,
    pub report: DrawReport,
}

impl LinearPicture {
    pub fn at(&self, x: u32, y: u32) -> [f32; 4] {
        self.texels[(y * self.size[0] + x) as usize]
    }
}

pub fn linear() -> MutexGuard<'static, Linear> {
    static LINEAR: OnceLock<Mutex<Linear>> = OnceLock::new();
    LINEAR.get_or_init(|| Mutex::new(Linear::new())).lock().unwrap_or_else(PoisonError::into_inner)
}

impl Linear {
    const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;

    pub fn new() -> Self {
        Self::with_samples(1)
    }

    /// With several samples per pixel a colour is the mean of theirs.
    pub fn with_samples(samples: u32) -> Self {
        let wanted = headless().adapter().name.clone();
        let instance = wgpu::Instance::default();
        let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
        let adapter = adapters.into_iter().find(|a| a.get_info().name == wanted).unwrap();
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor::default())).unwrap();
        let options = RendererOptions { samples, ..RendererOptions::default() };
        let renderer = Renderer::new(&device, &queue, Self::FORMAT, options);
        Self { device, queue, renderer }
    }

    pub fn draw(&mut self, frame: &Frame) -> LinearPicture {
        self.try_draw(frame).unwrap_or_else(|error| panic!("{error}"))
    }

    pub fn try_draw(&mut self, frame: &Frame) -> Result<LinearPicture, RenderError> {
        let [width, height] = frame.size;
        let texture = self.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: Self::FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let report = self.renderer.draw(&self.device, &self.queue, frame, &view)?;
        let pitch = (width * 8).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(pitch * height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(pitch), rows_per_image: None };
        let copy = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
        encoder.copy_texture_to_buffer(texture.as_image_copy(), copy, texture.size());
        self.queue.submit([encoder.finish()]);
        buffer.slice(..).map_async(wgpu::MapMode::Read, |result| result.unwrap());
        self.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        let bytes = buffer.slice(..).get_mapped_range().unwrap().to_vec();
        let half = |b: &[u8]| f16::from_le_bytes([b[0], b[1]]).to_f32();
        let texel = |b: &[u8]| [half(&b[0..]), half(&b[2..]), half(&b[4..]), half(&b[6..])];
        let rows = bytes.chunks_exact(pitch as usize);
        let texels = rows.flat_map(|row| row[..width as usize * 8].chunks_exact(8).map(texel)).collect();
        Ok(LinearPicture { size: frame.size, texels, report })
    }
}
