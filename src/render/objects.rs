//! The one place where objects are made on the GPU, which counts them.

use std::sync::atomic::{AtomicU64, Ordering};

/// How many GPU objects the library has made in this process, by kind; those that are gone count as well. What asks where
/// something is makes none of them.
///
/// # Example
///
/// ```
/// use seamount::prelude::*;
/// use seamount::render::ObjectsMade;
///
/// let mut scene = Scene::new();
/// let root = scene.root();
/// scene.add(root, Cube::default())?;
/// let down = Ray::new(DVec3::Z * 9.0, DVec3::NEG_Z)?;
/// assert_eq!(RayPickAction::ray(down).apply(&scene)?.len(), 1);
/// assert_eq!(ObjectsMade::so_far(), ObjectsMade::default());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ObjectsMade {
    /// Instances of wgpu, which load the drivers, and devices.
    pub devices: u64,
    /// Buffers.
    pub buffers: u64,
    /// Textures.
    pub textures: u64,
    /// Compiled shaders.
    pub shader_modules: u64,
    /// Pipelines.
    pub pipelines: u64,
    /// What binds and uses them: layouts, groups, samplers, views, queries and lists of commands.
    pub others: u64,
}

static DEVICES: AtomicU64 = AtomicU64::new(0);
static BUFFERS: AtomicU64 = AtomicU64::new(0);
static TEXTURES: AtomicU64 = AtomicU64::new(0);
static SHADER_MODULES: AtomicU64 = AtomicU64::new(0);
static PIPELINES: AtomicU64 = AtomicU64::new(0);
static OTHERS: AtomicU64 = AtomicU64::new(0);

impl ObjectsMade {
    /// Up to now, on all threads.
    #[must_use]
    pub fn so_far() -> Self {
        let of = |count: &AtomicU64| count.load(Ordering::Relaxed);
        Self {
            devices: of(&DEVICES),
            buffers: of(&BUFFERS),
            textures: of(&TEXTURES),
            shader_modules: of(&SHADER_MODULES),
            pipelines: of(&PIPELINES),
            others: of(&OTHERS),
        }
    }
}

fn count(kind: &AtomicU64) {
    kind.fetch_add(1, Ordering::Relaxed);
}

/// An instance without a display.
pub(super) fn make_instance() -> wgpu::Instance {
    count(&DEVICES);
    wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle())
}

/// A device with its queue.
pub(super) fn make_device(
    adapter: &wgpu::Adapter,
    descriptor: &wgpu::DeviceDescriptor<'_>,
) -> Result<(wgpu::Device, wgpu::Queue), wgpu::RequestDeviceError> {
    count(&DEVICES);
    pollster::block_on(adapter.request_device(descriptor))
}

/// The `create_…` of [`wgpu::Device`], counted.
pub(super) trait Make {
    fn make_buffer(&self, descriptor: &wgpu::BufferDescriptor<'_>) -> wgpu::Buffer;
    fn make_texture(&self, descriptor: &wgpu::TextureDescriptor<'_>) -> wgpu::Texture;
    fn make_shader_module(&self, descriptor: wgpu::ShaderModuleDescriptor<'_>) -> wgpu::ShaderModule;
    fn make_render_pipeline(&self, descriptor: &wgpu::RenderPipelineDescriptor<'_>) -> wgpu::RenderPipeline;
    fn make_pipeline_layout(&self, descriptor: &wgpu::PipelineLayoutDescriptor<'_>) -> wgpu::PipelineLayout;
    fn make_bind_group_layout(&self, descriptor: &wgpu::BindGroupLayoutDescriptor<'_>) -> wgpu::BindGroupLayout;
    fn make_bind_group(&self, descriptor: &wgpu::BindGroupDescriptor<'_>) -> wgpu::BindGroup;
    fn make_sampler(&self, descriptor: &wgpu::SamplerDescriptor<'_>) -> wgpu::Sampler;
    fn make_query_set(&self, descriptor: &wgpu::QuerySetDescriptor<'_>) -> wgpu::QuerySet;
    fn make_command_encoder(&self, descriptor: &wgpu::CommandEncoderDescriptor<'_>) -> wgpu::CommandEncoder;
}

impl Make for wgpu::Device {
    fn make_buffer(&self, descriptor: &wgpu::BufferDescriptor<'_>) -> wgpu::Buffer {
        count(&BUFFERS);
        self.create_buffer(descriptor)
    }

    fn make_texture(&self, descriptor: &wgpu::TextureDescriptor<'_>) -> wgpu::Texture {
        count(&TEXTURES);
        self.create_texture(descriptor)
    }

    fn make_shader_module(&self, descriptor: wgpu::ShaderModuleDescriptor<'_>) -> wgpu::ShaderModule {
        count(&SHADER_MODULES);
        self.create_shader_module(descriptor)
    }

    fn make_render_pipeline(&self, descriptor: &wgpu::RenderPipelineDescriptor<'_>) -> wgpu::RenderPipeline {
        count(&PIPELINES);
        self.create_render_pipeline(descriptor)
    }

    fn make_pipeline_layout(&self, descriptor: &wgpu::PipelineLayoutDescriptor<'_>) -> wgpu::PipelineLayout {
        count(&OTHERS);
        self.create_pipeline_layout(descriptor)
    }

    fn make_bind_group_layout(&self, descriptor: &wgpu::BindGroupLayoutDescriptor<'_>) -> wgpu::BindGroupLayout {
        count(&OTHERS);
        self.create_bind_group_layout(descriptor)
    }

    fn make_bind_group(&self, descriptor: &wgpu::BindGroupDescriptor<'_>) -> wgpu::BindGroup {
        count(&OTHERS);
        self.create_bind_group(descriptor)
    }

    fn make_sampler(&self, descriptor: &wgpu::SamplerDescriptor<'_>) -> wgpu::Sampler {
        count(&OTHERS);
        self.create_sampler(descriptor)
    }

    fn make_query_set(&self, descriptor: &wgpu::QuerySetDescriptor<'_>) -> wgpu::QuerySet {
        count(&OTHERS);
        self.create_query_set(descriptor)
    }

    fn make_command_encoder(&self, descriptor: &wgpu::CommandEncoderDescriptor<'_>) -> wgpu::CommandEncoder {
        count(&OTHERS);
        self.create_command_encoder(descriptor)
    }
}

/// A view of all of a texture.
pub(super) fn make_view(texture: &wgpu::Texture) -> wgpu::TextureView {
    count(&OTHERS);
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

#[cfg(test)]
mod tests {
    /// Nothing is made without being counted.
    #[test]
    fn objects_are_made_nowhere_else() {
        let mut folders = vec![std::path::PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/src"))];
        let mut files = 0;
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    folders.push(path);
                } else if !path.ends_with("render/objects.rs") {
                    files += 1;
                    let text = std::fs::read_to_string(&path).unwrap();
                    let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
                    for line in code {
                        let makes = [".create_", ".request_device(", "Instance::new("].iter().any(|m| line.contains(m));
                        assert!(!makes, "{}: {line}", path.display());
                    }
                }
            }
        }
        assert!(files > 50);
    }
}
