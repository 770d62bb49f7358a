//! The bytes of `struct Draw` in `shaders/draw.wesl`: the same members under the same conditions in the same order.

use glam::{Mat3, Mat4, UVec4, Vec2, Vec3, Vec4};

use super::shader::Variant;
use crate::action::{
    Attenuation, Cone, ContourStyle, DebugColor, Draw, ERROR_STOPS, FrameLight, Geometry, RampMap, Sky, linear_color,
};
use crate::node::{FogType, RAMP_STOPS, Ramp};

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

    /// The last one again, up to the length of the list.
    fn stops(&mut self, stops: &[(f32, [u8; 3])]) {
        for (place, color) in stops.iter().chain(stops.last().into_iter().cycle()).take(RAMP_STOPS) {
            self.vec3(linear(*color), *place);
        }
    }

    fn mat4(&mut self, m: &Mat4) {
        [m.x_axis, m.y_axis, m.z_axis, m.w_axis].into_iter().for_each(|c| self.vec4(c));
    }

    fn mat3(&mut self, m: &Mat3) {
        [m.x_axis, m.y_axis, m.z_axis].into_iter().for_each(|c| self.vec3(c, 0.0));
    }
}

/// Appends the uniforms of the sky, as `struct Sky` in `shaders/sky.wesl` has them; returns how many bytes they are.
pub(super) fn write_sky(sky: &Sky, out: &mut Vec<u8>) -> u64 {
    let start = out.len();
    let mut w = Writer(out);
    for v in [sky.horizon, sky.zenith].into_iter().chain(sky.rays) {
        w.vec3(v, 0.0);
    }
    (out.len() - start) as u64
}

/// What takes stored gradients to those that were meant.
#[derive(Debug, Clone, Copy)]
pub(super) struct Factors {
    /// Those of the map.
    pub gradients: f32,
    /// Those of the small heights on it.
    pub bump: f32,
}

impl Factors {
    /// They are stored as they are.
    pub(super) const ONE: Self = Self { gradients: 1.0, bump: 1.0 };
}

/// Appends the uniforms of a draw; returns how many bytes they are.
pub(super) fn write(variant: &Variant, draw: &Draw, diffuse: Vec3, factors: Factors, out: &mut Vec<u8>) -> u64 {
    let start = out.len();
    let mut w = Writer(out);
    w.mat4(&draw.clip_from_rel);
    if variant.position() {
        w.mat4(&draw.eye_from_rel);
    }
    let e = &variant.effects;
    let levels = e.debug_color == DebugColor::Levels;
    let normals = e.debug_color == DebugColor::Normals;
    if e.lit() || normals {
        w.mat3(&draw.normal_from_rel);
    }
    if let Some(program) = &draw.program {
        if variant.local() {
            w.mat4(&program.local_from_rel);
        }
        if e.shaders.vertex.is_some() {
            w.mat4(&program.clip_from_local);
            if variant.position() {
                w.mat3(&program.eye_from_local);
            }
        }
    }
    if let Geometry::Terrain(terrain) = &draw.geometry {
        let ([u, v], raw) = terrain.anchor;
        let [cells_u, cells_v] = terrain.heights.cells();
        w.uvec4(UVec4::new(u, v, cells_u, cells_v));
        w.vec4(Vec4::new(raw, factors.gradients, 0.0, 0.0));
        if e.morph {
            w.uvec4(UVec4::new(terrain.parts.resolutions().max(), 0, 0, 0));
        }
        if levels {
            LEVEL_COLORS.into_iter().for_each(|c| w.vec3(linear(c), 1.0));
            w.uvec4(UVec4::new(terrain.branching.trailing_zeros().max(1), 0, 0, 0));
        }
    }
    let coloring = &draw.coloring;
    if e.color_map_transform {
        let rows = coloring.color_uv.unwrap_or_default();
        rows.into_iter().for_each(|row| w.vec3(row, 0.0));
    }
    if e.ramp.is_some() {
        let map = coloring.ramp.unwrap_or(RampMap { ramp: Ramp::Gray, scale: 0.0, offset: 0.0, slope: Vec2::ZERO });
        w.stops(map.ramp.stops());
        w.vec4(Vec4::new(map.scale, map.offset, map.slope.x, map.slope.y));
    }
    if e.debug_color == DebugColor::Errors {
        w.stops(&ERROR_STOPS);
        w.vec4(Vec4::X);
    }
    if e.contours {
        let none = ContourStyle { scale: 0.0, offset: 0.5, width: 0.0, color: Vec3::ZERO };
        let lines = coloring.contours.unwrap_or(none);
        w.vec4(Vec4::new(lines.scale, lines.offset, 0.5 * lines.width, 0.0));
        w.vec3(lines.color, 0.0);
    }
    if e.detail_textures {
        let tiles = coloring.detail.as_ref().map_or(Vec2::ONE, |detail| detail.tiles);
        w.vec4(Vec4::new(tiles.x, tiles.y, 0.0, 0.0));
    }
    let m = &draw.material;
    if e.normal_map {
        let (tiles, raw) = coloring.relief.as_ref().map_or((Vec2::ONE, Vec2::ZERO), |r| (r.tiles, r.raw_per_slope));
        w.vec4(Vec4::new(tiles.x, tiles.y, raw.x, raw.y));
    }
    if e.bump_map {
        let (tiles, raw) = coloring.bump.as_ref().map_or((Vec2::ONE, Vec2::ZERO), |b| (b.tiles, b.raw_per_texel));
        w.vec4(Vec4::new(tiles.x, tiles.y, raw.x * factors.bump, raw.y * factors.bump));
    }
    if variant.strokes() {
        let dots = matches!(&draw.geometry, Geometry::Strokes(strokes) if strokes.dots);
        let half = 0.5 * draw.lines.width;
        w.vec4((0.5 * draw.picture).extend(half).extend(if dots { half } else { 0.0 }));
    }
    if variant.edges() {
        w.vec3(draw.lines.color, 0.5 * draw.lines.width);
    }
    if !variant.color_by_patch() && !normals && !e.vertex_colors {
        w.vec3(diffuse, m.opacity);
    }
    if e.ambient {
        w.vec3(draw.ambient * m.ambient, 0.0);
    }
    if e.specular {
        w.vec3(m.specular, 128.0 * m.shininess);
    }
    let air = e.fog != FogType::None;
    if e.specular || air {
        match draw.towards_eye {
            Some(direction) => w.vec3(direction, 0.0),
            None => w.vec3(Vec3::ZERO, 1.0),
        }
    }
    if air {
        w.vec3(draw.fog.color, draw.fog.rate);
    }
    if e.emissive {
        w.vec3(m.emissive, 0.0);
    }
    let some = |count: u8, kind: fn(&FrameLight) -> bool| {
        // Lights that the effects count but the draw does not have are black.
        let found = draw.lights.iter().filter(move |light| kind(light)).map(Some);
        found.chain(std::iter::repeat(None)).take(count.into())
    };
    let attenuation = |w: &mut Writer<'_>, a: &Attenuation| {
        if e.attenuation {
            w.vec4(Vec4::new(a.constant, a.linear, a.quadratic, 0.0));
        }
    };
    for light in some(e.directional_lights, |l| matches!(l, FrameLight::Directional { .. })) {
        let Some(FrameLight::Directional { towards, color, shadow }) = light else {
            w.vec3(Vec3::Z, 0.0);
            w.vec3(Vec3::ZERO, 0.0);
            continue;
        };
        w.vec3(*towards, 0.0);
        w.vec3(*color, f32::from(*shadow));
    }
    for light in some(e.point_lights, |l| matches!(l, FrameLight::Point { .. })) {
        let (position, color, weakening) = match light {
            Some(FrameLight::Point { position, color, attenuation }) => (*position, *color, *attenuation),
            _ => (Vec3::Z, Vec3::ZERO, Attenuation::NONE),
        };
        w.vec3(position, 0.0);
        w.vec3(color, 0.0);
        attenuation(&mut w, &weakening);
    }
    for light in some(e.spot_lights, |l| matches!(l, FrameLight::Spot { .. })) {
        let dark = (Vec3::Z, Vec3::ZERO, Attenuation::NONE, Vec3::Z, Cone { cos_cut_off: 1.0, exponent: 0.0 });
        let (position, color, weakening, direction, cone) = match light {
            Some(FrameLight::Spot { position, color, attenuation, direction, cone }) => {
                (*position, *color, *attenuation, *direction, *cone)
            }
            _ => dark,
        };
        w.vec3(position, cone.cos_cut_off);
        w.vec3(color, cone.exponent);
        w.vec3(direction, 0.0);
        attenuation(&mut w, &weakening);
    }
    // Planes that the effects count but the draw does not have cut nothing.
    let planes = draw.clip_planes.iter().copied().chain(std::iter::repeat(Vec4::ZERO));
    planes.take(e.clip_planes.into()).for_each(|plane| w.vec4(plane));
    (out.len() - start) as u64
}
