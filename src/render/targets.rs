//! What is drawn into beside the caller's view: depth, and colour of several samples.

use super::RenderError;
use super::error::guarded;
use super::objects::{Make, make_view};
use super::pipelines::DEPTH_FORMAT;

/// The renderer's own targets for one size of picture.
#[derive(Debug)]
pub(super) struct Targets {
    size: [u32; 2],
    pub depth: wgpu::Texture,
    pub depth_view: wgpu::TextureView,
    /// Colour before samples are joined; none with one sample.
    pub color: Option<wgpu::TextureView>,
    pub bytes: u64,
}

impl Targets {
    pub(super) fn new(
        device: &wgpu::Device,
        [width, height]: [u32; 2],
        format: wgpu::TextureFormat,
        samples: u32,
        keep_depth: bool,
    ) -> Result<Self, RenderError> {
        check_size(device, [width, height])?;
        let target = |label, format, usage| {
            let descriptor = wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: samples,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | usage,
                view_formats: &[],
            };
            guarded(device, "making the targets of a picture", || device.make_texture(&descriptor))
        };
        let usage = if keep_depth { wgpu::TextureUsages::COPY_SRC } else { wgpu::TextureUsages::empty() };
        let depth = target("depth", DEPTH_FORMAT, usage)?;
        let color = if samples > 1 { Some(target("samples", format, wgpu::TextureUsages::empty())?) } else { None };
        let texel = 4 + color.as_ref().map_or(0, |_| format.block_copy_size(None).unwrap_or(4));
        Ok(Self {
            size: [width, height],
            depth_view: make_view(&depth),
            depth,
            color: color.as_ref().map(make_view),
            bytes: u64::from(width) * u64::from(height) * u64::from(samples * texel),
        })
    }

    pub(super) fn fits(&self, size: [u32; 2]) -> bool {
        self.size == size
    }
}

/// Whether pictures of this size can be had.
pub(super) fn check_size(device: &wgpu::Device, [width, height]: [u32; 2]) -> Result<(), RenderError> {
    let limit = device.limits().max_texture_dimension_2d;
    if (1..=limit).contains(&width) && (1..=limit).contains(&height) {
        Ok(())
    } else {
        Err(RenderError::PictureSize { width, height, limit })
    }
}
