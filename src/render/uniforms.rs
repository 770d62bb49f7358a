//! The bytes of `struct Draw` in `shaders/draw.wesl`: the same members under the same conditions in the same order.

use glam::{Mat3, Mat4, UVec4, Vec3, Vec4};

use super::shader::Variant;
use crate::action::{Draw, FrameLight, Geometry, linear_color};

/// Colours of the levels, the finest first: the palette of Okabe and Ito, which people with any colour vision can tell
/// apart, with grey for black. sRGB.
const LEVEL_COLORS: [[u8; 3]; 8] = [
    [230, 159, 0],
    [86, 180, 233],
    [0, 158, 115],
    [240, 228, 66],
    [0, 114, 178],
    [213, 94, 0],
    [204, 121, 167],
    [153, 153, 153],
];

/// Colour of tiles in [`DebugColor::Parts`](crate::action::DebugColor::Parts), sRGB.
pub(super) const TILE_COLOR: [u8; 3] = [40, 150, 60];
/// Colour of strips, sRGB.
pub(super) const STRIP_COLOR: [u8; 3] = [205, 45, 40];

pub(super) fn linear([r, g, b]: [u8; 3]) -> Vec3 {
    linear_color(Vec3::new(r.into(), g.into(), b.into()) / 255.0)
}

struct Writer<'a>(&'a mut Vec<u8>);

impl Writer<'_> {
    fn vec4(&mut self, v: Vec4) {
        self.0.extend_from_slice(bytemuck::bytes_of(&v.to_array()));
    }

    fn vec3(&mut self, v: Vec3, w: f32) {
        self.vec4(v.extend(w));
    }

    fn uvec4(&mut self, v: UVec4) {
        self.0.extend_from_slice(bytemuck::bytes_of(&v.to_array()));
    }

    fn mat4(&mut self, m: &Mat4) {
        [m.x_axis, m.y_axis, m.z_axis, m.w_axis].into_iter().for_each(|c| self.vec4(c));
    }

    fn mat3(&mut self, m: &Mat3) {
        [m.x_axis, m.y_axis, m.z_axis].into_iter().for_each(|c| self.vec3(c, 0.0));
    }
}

/// Appends the uniforms of a draw; returns how many bytes they are. `gradient_factor` takes stored gradients to raw ones.
pub(super) fn write(variant: &Variant, draw: &Draw, diffuse: Vec3, gradient_factor: f32, out: &mut Vec<u8>) -> u64 {
    let start = out.len();
    let mut w = Writer(out);
    w.mat4(&draw.clip_from_rel);
    if variant.position() {
        w.mat4(&draw.eye_from_rel);
    }
    if variant.lit() {
        w.mat3(&draw.normal_from_rel);
    }
    if let Geometry::Terrain(terrain) = &draw.geometry {
        let ([u, v], raw) = terrain.anchor;
        let [cells_u, cells_v] = terrain.heights.cells();
        w.uvec4(UVec4::new(u, v, cells_u, cells_v));
        w.vec4(Vec4::new(raw, gradient_factor, 0.0, 0.0));
        if variant.morph {
            w.uvec4(UVec4::new(terrain.parts.resolutions().max(), 0, 0, 0));
        }
        if variant.levels {
            LEVEL_COLORS.into_iter().for_each(|c| w.vec3(linear(c), 1.0));
            w.uvec4(UVec4::new(terrain.branching.trailing_zeros().max(1), 0, 0, 0));
        }
    }
    let m = &draw.material;
    if !variant.levels {
        w.vec3(diffuse, 1.0);
    }
    if variant.ambient {
        w.vec3(draw.ambient * m.ambient, 0.0);
    }
    if variant.specular {
        w.vec3(m.specular, 128.0 * m.shininess);
        match draw.towards_eye {
            Some(direction) => w.vec3(direction, 0.0),
            None => w.vec3(Vec3::ZERO, 1.0),
        }
    }
    if variant.emissive {
        w.vec3(m.emissive, 0.0);
    }
    let mut lights = |count: u8, select: &dyn Fn(&FrameLight) -> Option<(Vec3, Vec3)>| {
        let found = draw.lights.iter().filter_map(select);
        // Lights that the effects count but the draw does not have are black.
        let dark = std::iter::repeat((Vec3::Z, Vec3::ZERO));
        for (place, color) in found.chain(dark).take(count.into()) {
            w.vec3(place, 0.0);
            w.vec3(color, 0.0);
        }
    };
    lights(variant.directional, &|light| match *light {
        FrameLight::Directional { towards, color } => Some((towards, color)),
        FrameLight::Point { .. } => None,
    });
    lights(variant.point, &|light| match *light {
        FrameLight::Point { position, color } => Some((position, color)),
        FrameLight::Directional { .. } => None,
    });
    (out.len() - start) as u64
}
