//! Draws Mount Fuji with a wgpu device, queue and texture of the program's own, as an application with a window would.
//!
//! Writes `own_device.png` to the folder given, or to `target`.

use std::error::Error;
use std::path::PathBuf;

use seamount::prelude::*;
use seamount::render::{Picture, Renderer, RendererOptions};

const SIZE: wgpu::Extent3d = wgpu::Extent3d { width: 1024, height: 576, depth_or_array_layers: 1 };
/// Windows often have such a format. It does not encode sRGB, so the renderer's shaders do.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Bgra8Unorm;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args_os().nth(1).map_or_else(|| PathBuf::from("target"), PathBuf::from);
    let path = folder.join("own_device.png");

    // The program's own device, as it needs it for its other work. Large maps need the adapter's own limits.
    let instance = wgpu::Instance::default();
    let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
        required_limits: adapter.limits(),
        ..wgpu::DeviceDescriptor::default()
    }))?;
    let target = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("the program's picture"),
        size: SIZE,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: FORMAT,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let view = target.create_view(&wgpu::TextureViewDescriptor::default());

    // What to draw is plain data, made without a GPU ...
    let action =
        RenderAction { background: Color::new(0.72, 0.82, 0.93), ..RenderAction::new(SIZE.width, SIZE.height) };
    let frame = action.apply(&fuji()?)?;
    // ... and drawn with what the program brings.
    let mut renderer = Renderer::new(&device, &queue, FORMAT, RendererOptions::for_adapter(&adapter, FORMAT));
    let report = renderer.draw(&device, &queue, &frame, &view)?;

    let rgba = read(&device, &queue, &target)?;
    Picture { width: SIZE.width, height: SIZE.height, rgba, report }.save_png(&path)?;
    println!(
        "{}: {} triangles in {} draw calls on {}",
        path.display(),
        frame.statistics.triangles,
        report.draw_calls,
        adapter.get_info().name
    );
    Ok(())
}

/// The mountain from the south-west in the light of an afternoon.
fn fuji() -> Result<Scene, Box<dyn Error>> {
    let mut scene = Scene::new();
    let root = scene.root();
    scene.add(
        root,
        PerspectiveCamera {
            position: Some(DVec3::new(48_000.0, 12_000.0, 5_000.0)),
            look_at: Some(DVec3::new(65_900.0, 40_100.0, 2_200.0)),
            height_angle: 0.25,
            ..PerspectiveCamera::default()
        },
    )?;
    scene.add(root, DirectionalLight { direction: DVec3::new(1.0, -0.3, -0.6), ..DirectionalLight::default() })?;
    let stone = Color::new(0.86, 0.82, 0.76);
    scene.add(root, Material { ambient_color: stone.into(), diffuse_color: stone.into(), ..Material::default() })?;
    let map = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/fuji.png");
    scene.add(root, Texture2 { filename: map.to_owned(), ..Texture2::default() })?;
    scene.add(
        root,
        SeamlessTerrain {
            size: Some(DVec2::new(90_600.0, 111_240.0)),
            max_height: 65535.0,
            base_height: -1000.0,
            void_sample: Some(0.0),
            detail: DetailMode::PixelError(1.0),
            ..SeamlessTerrain::default()
        },
    )?;
    Ok(scene)
}

/// Reads the texture back, as red, green, blue and 255. Its rows are a multiple of 256 bytes, so they need no padding.
fn read(device: &wgpu::Device, queue: &wgpu::Queue, texture: &wgpu::Texture) -> Result<Vec<u8>, Box<dyn Error>> {
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("read back"),
        size: u64::from(SIZE.width * SIZE.height * 4),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(SIZE.width * 4), rows_per_image: None };
    let destination = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
    encoder.copy_texture_to_buffer(texture.as_image_copy(), destination, SIZE);
    queue.submit([encoder.finish()]);
    buffer.map_async(wgpu::MapMode::Read, .., |_| ());
    device.poll(wgpu::PollType::wait_indefinitely())?;
    let bytes = buffer.get_mapped_range(..)?;
    Ok(bytes.chunks_exact(4).flat_map(|p| [p[2], p[1], p[0], 255]).collect())
}
