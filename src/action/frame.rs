//! What to draw, as plain data: the product of the render action and the only thing the renderer sees.
//!
//! A [`Frame`] is made without a GPU, can be sent to another thread, and holds no reference into the scene: maps, images
//! and meshes are shared by `Arc`. All matrices were multiplied in f64, relative to the eye, and rounded once.

use std::sync::Arc;

use glam::{DVec3, Mat3, Mat4, Vec2, Vec3, Vec4};

use super::program::{DrawProgram, ShaderUses};
use super::{Crop, PixelArea, Surround};
use crate::node::{Color, FogType, Ramp, RampBy, Style, TextureFilter, Wrap, mix_stops};
use crate::scene::Image;
use crate::terrain::{HeightField, Instances, LatticeLight, Parts, Samples};

/// One picture's worth of drawing.
#[derive(Debug, Clone, Default)]
pub struct Frame {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Colour where nothing is drawn, linear light, 0..1.
    pub background: Vec3,
    /// The sky, instead of the background.
    pub sky: Option<Sky>,
    /// The part of the picture that all of this is drawn in, if it is not the whole.
    pub crop: Option<Crop>,
    /// What to draw: in the order of the walk, but what is transparent after all else and the furthest of it first.
    pub draws: Vec<Draw>,
    /// What the walk counted.
    pub statistics: Statistics,
}

impl Frame {
    /// What is filled before anything is drawn, the first below the second. The whole picture is cleared to
    /// [`Frame::clear`] before.
    #[must_use]
    pub fn fills(&self) -> [Option<Fill>; 2] {
        let whole = PixelArea { left: 0, top: 0, width: self.size[0], height: self.size[1] };
        let area = self.crop.map_or(whole, |crop| crop.area);
        let behind = self.sky.map(|sky| Fill { area, sky });
        let plain = |area, color| Some(Fill { area, sky: Sky::plain(color) });
        match self.crop.map(|crop| crop.surround) {
            None | Some(Surround::Background) => [None, behind],
            Some(Surround::Filled) => [None, behind.or(plain(area, self.background))],
            Some(Surround::Line) => {
                // One pixel more on each side, as far as there is one.
                let (left, top) = (area.left.saturating_sub(1), area.top.saturating_sub(1));
                let width = (area.left + area.width + 1).min(whole.width) - left;
                let height = (area.top + area.height + 1).min(whole.height) - top;
                let line = plain(PixelArea { left, top, width, height }, SURROUND.linear());
                [line, behind.or(plain(area, self.background))]
            }
        }
    }

    /// The colour that the whole picture is cleared to, linear.
    #[must_use]
    pub fn clear(&self) -> Vec3 {
        let filled = self.crop.is_some_and(|crop| crop.surround == Surround::Filled);
        if filled { SURROUND.linear() } else { self.background }
    }
}

/// What is around a cropped picture: lines and areas.
const SURROUND: Color = Color::new(0.5, 0.5, 0.5);

/// A part of the picture to be filled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fill {
    /// Which.
    pub area: PixelArea,
    /// What with: seen through the whole picture.
    pub sky: Sky,
}

impl Sky {
    /// One colour in all directions, linear.
    #[must_use]
    pub fn plain(color: Vec3) -> Self {
        Self { horizon: color, zenith: color, rays: [Vec3::Z, Vec3::ZERO, Vec3::ZERO] }
    }
}

/// A sky behind everything: its colour goes from the horizon up to the zenith with the sine of the elevation, and is that of
/// the horizon below it. World z points up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sky {
    /// Colour at and below the horizon, linear.
    pub horizon: Vec3,
    /// Colour straight above, linear.
    pub zenith: Vec3,
    /// Direction of the ray through the middle of the picture, and what is added to it from there to the right and to the
    /// upper border, in world axes.
    pub rays: [Vec3; 3],
}

/// Counts of one walk over the scene.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Triangles that the frame draws.
    pub triangles: u64,
    /// Draw calls that the frame takes.
    pub draw_calls: u32,
    /// Choices of detail made for this frame; those of other shapes were kept from the frame before.
    pub selections: u32,
    /// Patches that the choice of detail looked at.
    pub patches_traversed: u64,
    /// Active patches outside the view.
    pub patches_culled: u64,
    /// Active patches drawn.
    pub patches_rendered: u64,
}

/// One shape with everything that decides its looks.
#[derive(Debug, Clone)]
pub struct Draw {
    /// Which effects the draw calls for; chooses shader, bindings and resources.
    pub effects: Effects,
    /// The shape.
    pub geometry: Geometry,
    /// From the shape's relative coordinates (see [`TerrainDraw::anchor`]; plain local coordinates for meshes) to clip
    /// space: reversed z, far plane at infinity.
    pub clip_from_rel: Mat4,
    /// From the same coordinates to world axes with the origin at the eye. Only read when a light or a highlight needs a
    /// position.
    pub eye_from_rel: Mat4,
    /// Takes covectors (−∂w/∂u, −∂w/∂v, 1) of a terrain, or local normals of a mesh, to world axes: the inverse transpose
    /// up to a positive factor. Results are not of unit length.
    pub normal_from_rel: Mat3,
    /// Whether the model transform mirrors, which turns front faces over.
    pub mirrored: bool,
    /// Colours of the surface.
    pub material: SurfaceMaterial,
    /// The lights that reach this shape; empty means unlit: the base colour as it is.
    pub lights: Arc<[FrameLight]>,
    /// Ambient light, linear, already multiplied by its intensity. Black when unlit.
    pub ambient: Vec3,
    /// Unit vector towards the eye for orthographic cameras, where it is the same everywhere; `None` for perspective.
    pub towards_eye: Option<Vec3>,
    /// What colours a surface beside its material.
    pub coloring: Coloring,
    /// What is cut off: where a plane's (normal, distance) · (place, 1) is negative, in world axes with the origin at the eye.
    pub clip_planes: Arc<[Vec4]>,
    /// How much deeper faces are drawn than they are; see [`PolygonOffset`](crate::node::PolygonOffset).
    pub depth_offset: DepthOffset,
    /// Width and height of the picture in pixels, for what has its size there.
    pub picture: Vec2,
    /// The edges and corners of triangles, where they are drawn, and lines and points.
    pub lines: LineStyle,
    /// The air between eye and shape, where there is fog.
    pub fog: Fog,
    /// For transparent shapes: distance of the middle of their box from the eye, along the view. Others have 0.
    pub distance: f64,
    /// Shaders of the scene's own, as [`Effects::shaders`] says.
    pub program: Option<Arc<DrawProgram>>,
}

/// How much deeper faces are drawn than they are.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DepthOffset {
    /// Multiplies the slope, in depth per pixel.
    pub factor: f32,
    /// Multiplies the smallest difference of depth.
    pub units: i32,
}

/// The material of a surface in linear light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceMaterial {
    /// Reflects ambient light.
    pub ambient: Vec3,
    /// Reflects light in all directions; the base colour when unlit.
    pub diffuse: Vec3,
    /// Reflects light as highlights.
    pub specular: Vec3,
    /// Glows.
    pub emissive: Vec3,
    /// Open Inventor's shininess, 0..1; the exponent of the highlight is 128 times that.
    pub shininess: f32,
    /// How much of what is behind is hidden, 0..1.
    pub opacity: f32,
}

/// How lines and points are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LineStyle {
    /// Colour of edges on filled faces, linear.
    pub color: Vec3,
    /// Width of lines, or of points, in pixels.
    pub width: f32,
}

/// Fog; [`Effects::fog`] says how it thickens.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Fog {
    /// Colour, linear.
    pub color: Vec3,
    /// Multiplies the distance: `Haze` leaves 1 − x of the surface, `Fog` e^−x, `Smoke` e^−x².
    pub rate: f32,
}

/// A light in eye-relative world axes, linear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FrameLight {
    /// Parallel light.
    Directional {
        /// Unit vector towards the light.
        towards: Vec3,
        /// Whether it is the one whose shadow [`Coloring::shadow`] is.
        shadow: bool,
        /// Colour times intensity.
        color: Vec3,
    },
    /// Light from a point.
    Point {
        /// Position relative to the eye.
        position: Vec3,
        /// Colour times intensity.
        color: Vec3,
        /// How it weakens with distance.
        attenuation: Attenuation,
    },
    /// Light from a point into a cone.
    Spot {
        /// Position relative to the eye.
        position: Vec3,
        /// Colour times intensity.
        color: Vec3,
        /// How it weakens with distance.
        attenuation: Attenuation,
        /// Unit vector along the axis, away from the light.
        direction: Vec3,
        /// Its shape.
        cone: Cone,
    },
}

/// How light weakens with the distance d from its source, in world units: it is divided by
/// `constant + linear · d + quadratic · d²`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attenuation {
    /// Multiplies the square of the distance.
    pub quadratic: f32,
    /// Multiplies the distance.
    pub linear: f32,
    /// Does not depend on the distance.
    pub constant: f32,
}

impl Attenuation {
    /// As strong far away as near.
    pub const NONE: Self = Self { quadratic: 0.0, linear: 0.0, constant: 1.0 };
}

/// The cone of a spot light. Inside of it light that leaves at an angle a to the axis is multiplied by cos(a)^exponent,
/// outside there is none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cone {
    /// Cosine of the angle between the axis and the edge of the cone.
    pub cos_cut_off: f32,
    /// Exponent of the drop-off, 0..128; 0 is the same everywhere in the cone.
    pub exponent: f32,
}

/// The shapes that a renderer knows how to draw.
#[derive(Debug, Clone)]
pub enum Geometry {
    /// Patches of a height map.
    Terrain(TerrainDraw),
    /// Triangles.
    Mesh(Arc<Mesh>),
    /// Lines or points.
    Strokes(Arc<Strokes>),
}

/// The patches to draw of one terrain.
#[derive(Debug, Clone)]
pub struct TerrainDraw {
    /// The heights, on the GPU as a texture of integers or floats, shared by all draws of the same map.
    pub heights: Arc<HeightField>,
    /// The meshes of tiles and strips.
    pub parts: Arc<Parts>,
    /// What to draw of them: the instances, or the loose triangles, as the kind of the draw's effects says.
    pub instances: Arc<Instances>,
    /// The lattice point (column, row, raw height) that relative coordinates start from: near the eye, so that the
    /// subtraction is exact in integers and what is rounded is small where the eye looks closely. The relative
    /// coordinates of sample (c, r) are (c − anchor.c, r − anchor.r, raw − anchor.raw), the same bits from every patch.
    pub anchor: ([u32; 2], f32),
    /// Levels of the patch tree, for colouring by level.
    pub levels: u32,
    /// Lattice steps per unit at the finest level is 1; each level up multiplies by this.
    pub branching: u32,
}

/// What colours a surface beside its material: a terrain all of it, a mesh the colour map alone.
#[derive(Debug, Clone, Default)]
pub struct Coloring {
    /// An image: on the whole extent of a terrain, its first row north; on a mesh by the texture coordinates of its corners.
    pub color_map: Option<ColorMap>,
    /// Colours by height or slope.
    pub ramp: Option<RampMap>,
    /// Lines of equal height.
    pub contours: Option<ContourStyle>,
    /// Four textures and their mask.
    pub detail: Option<Box<DetailMaps>>,
    /// Normals that roughen the light.
    pub relief: Option<Relief>,
    /// Small heights that roughen the light.
    pub bump: Option<Bump>,
    /// The light that throws a shadow of the terrain on itself.
    pub shadow: Option<LatticeLight>,
    /// Where the colour map is looked up, if it is moved: rows that take (column, row, 1) of a terrain, or (s, t, 1) of a mesh,
    /// to the place in the image, its rows running down.
    pub color_uv: Option<[Vec3; 2]>,
}

/// A ramp and what it is looked up by: its place is `scale · value + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RampMap {
    /// The colours.
    pub ramp: Ramp,
    /// Multiplies the height relative to the anchor in raw units, or the slope in radians.
    pub scale: f32,
    /// Is added.
    pub offset: f32,
    /// Takes raw gradients, per cell along columns and rows, to slopes.
    pub slope: Vec2,
}

/// Lines of equal height: where `scale · height + offset` is a whole number; the height relative to the anchor in raw units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContourStyle {
    /// Multiplies the height.
    pub scale: f32,
    /// Is added.
    pub offset: f32,
    /// Width in pixels.
    pub width: f32,
    /// Colour, linear.
    pub color: Vec3,
}

/// Normals that roughen the light on a terrain.
#[derive(Debug, Clone)]
pub struct Relief {
    /// The normals.
    pub map: ColorMap,
    /// How often they repeat per cell, along columns and rows.
    pub tiles: Vec2,
    /// Takes local slopes to raw gradients, along columns and rows.
    pub raw_per_slope: Vec2,
}

/// Small heights that roughen the light on a terrain.
#[derive(Debug, Clone)]
pub struct Bump {
    /// The heights.
    pub map: ColorMap,
    /// How often they repeat per cell, along columns and rows.
    pub tiles: Vec2,
    /// Takes differences of intensity, 0..1, from texel to texel to raw gradients, along columns and rows.
    pub raw_per_texel: Vec2,
}

/// Four textures that cover a terrain where a mask says.
#[derive(Debug, Clone)]
pub struct DetailMaps {
    /// Shares of the textures in red, green, blue and alpha; on the whole extent, first row north.
    pub mask: ColorMap,
    /// The textures.
    pub textures: [ColorMap; 4],
    /// How often they repeat per cell, along columns and rows.
    pub tiles: Vec2,
}

/// An image that colours a surface, and how it is sampled.
#[derive(Debug, Clone)]
pub struct ColorMap {
    /// The image.
    pub image: Arc<Image>,
    /// The filters, from the Complexity node's texture quality.
    pub filter: TextureFilter,
    /// What is beyond its border.
    pub wrap: [Wrap; 2],
}

/// Triangles with normals, in local coordinates.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// Corners.
    pub positions: Vec<Vec3>,
    /// Unit normals, one per corner.
    pub normals: Vec<Vec3>,
    /// Diffuse colours in linear light and opacity, one per corner; or none, where all have those of the material.
    pub colors: Vec<Vec4>,
    /// Texture coordinates, t upwards, one per corner; or none, where no texture is on it.
    pub uvs: Vec<Vec2>,
    /// Corners of the triangles, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// Lines or points of one width on the screen, in local coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct Strokes {
    /// Straight pieces: place and unit normal of both ends. A point has the same ends.
    pub pieces: Vec<[[Vec3; 2]; 2]>,
    /// Diffuse colours in linear light and opacity at both ends of each piece; or none, where all have those of the material.
    pub colors: Vec<[Vec4; 2]>,
    /// Whether they are points, which are drawn as squares; a line without length is nothing.
    pub dots: bool,
    /// Whether the normals mean anything; else strokes are not lit.
    pub lit: bool,
}

/// How a terrain is coloured for study.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum DebugColor {
    /// Material and colour map.
    #[default]
    Plain,
    /// Tiles green, strips red.
    Parts,
    /// A colour per level of the patch tree.
    Levels,
    /// The normal that shading uses, in world axes: red, green and blue are x, y and z, -1 black and 1 full.
    Normals,
    /// How far off each part is, as [`Instances::errors`] say, in the colours of [`error_color`].
    Errors,
}

/// Colours of errors with their places, in multiples of the error allowed. sRGB; between them linear light is mixed.
///
/// Up to the error allowed it is Viridis, whose even steps look even to people with any colour vision; what is more is red at once,
/// and dark red from four times on.
pub const ERROR_STOPS: [(f32, [u8; 3]); 8] = [
    (0.0, [68, 1, 84]),
    (0.2, [65, 68, 135]),
    (0.4, [42, 120, 142]),
    (0.6, [34, 168, 132]),
    (0.8, [122, 209, 81]),
    (1.0, [253, 231, 37]),
    // One part in 256 more, which floats between 0 and 4 resolve well.
    (1.0 + 1.0 / 256.0, [214, 47, 39]),
    (4.0, [70, 0, 10]),
];

/// The colour of an error, given in multiples of the error allowed, in linear light: [`ERROR_STOPS`].
///
/// ```
/// use seamount::action::error_color;
///
/// // What is allowed is yellow at the most, what is not is red.
/// assert!(error_color(1.0).y > 0.7 && error_color(1.01).y < 0.1);
/// assert_eq!(error_color(4.0), error_color(f32::INFINITY));
/// ```
#[must_use]
pub fn error_color(error: f32) -> Vec3 {
    mix_stops(&ERROR_STOPS, error)
}

/// The kinds of shape that shaders differ by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum GeometryKind {
    /// Terrain with 16-bit integer heights.
    TerrainU16,
    /// Terrain with heights as floats.
    TerrainF32,
    /// Loose triangles of a terrain with 16-bit integer heights: those of patches that a hole takes triangles from. Only
    /// terrains with holes in view draw them.
    LooseU16,
    /// Loose triangles of a terrain with heights as floats.
    LooseF32,
    /// Triangle mesh.
    #[default]
    Mesh,
    /// Lines or points of one width on the screen.
    Strokes,
}

impl GeometryKind {
    /// The kind for a map: tiles and strips, or its loose triangles.
    #[must_use]
    pub fn of_terrain(field: &HeightField, loose: bool) -> Self {
        match (field.samples(), loose) {
            (Samples::U16(_), false) => Self::TerrainU16,
            (Samples::F32(_), false) => Self::TerrainF32,
            (Samples::U16(_), true) => Self::LooseU16,
            (Samples::F32(_), true) => Self::LooseF32,
        }
    }

    /// Whether it is a terrain.
    #[must_use]
    pub fn is_terrain(self) -> bool {
        !matches!(self, Self::Mesh | Self::Strokes)
    }

    /// Whether it is loose triangles of a terrain.
    #[must_use]
    pub fn is_loose(self) -> bool {
        matches!(self, Self::LooseU16 | Self::LooseF32)
    }
}

/// The set of effects of one draw: all that shader text, bindings and vertex data depend on. What is not in here is not
/// in any of them. [`EFFECTS`](super::EFFECTS) lists them with their names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Effects {
    /// Which vertex stage.
    pub geometry: GeometryKind,
    /// Number of directional lights.
    pub directional_lights: u8,
    /// Number of point lights.
    pub point_lights: u8,
    /// Number of spot lights.
    pub spot_lights: u8,
    /// Whether the light of a point or spot light changes with distance.
    pub attenuation: bool,
    /// Whether the air hides what is far.
    pub fog: FogType,
    /// Whether what is behind shows through.
    pub transparency: bool,
    /// Whether any light makes highlights (specular colour not black).
    pub specular: bool,
    /// Whether a colour map multiplies the diffuse colour's place.
    pub color_map: bool,
    /// Whether an image of normals roughens the light.
    pub normal_map: bool,
    /// Whether an image of small heights roughens the light.
    pub bump_map: bool,
    /// Whether a terrain lies in its own shadow.
    pub shadow: bool,
    /// Filled, or with edges, or corners alone. [`Style::Invisible`] is not drawn at all.
    pub style: Style,
    /// Whether the colour map of a mesh lets through what is behind.
    pub color_map_opacity: bool,
    /// Whether the colour map is moved, turned or scaled.
    pub color_map_transform: bool,
    /// Whether there are colours by height or slope, and by which of them.
    pub ramp: Option<RampBy>,
    /// Whether there are lines of equal height.
    pub contours: bool,
    /// Whether four textures cover the ground by a mask.
    pub detail_textures: bool,
    /// Colours for study; replace colour map and diffuse colour.
    pub debug_color: DebugColor,
    /// Whether diffuse colour and opacity are those of the corners.
    pub vertex_colors: bool,
    /// Whether ambient light reaches the surface.
    pub ambient: bool,
    /// Whether the surface glows.
    pub emissive: bool,
    /// Whether the heights of a terrain blend between levels.
    pub morph: bool,
    /// Number of planes that cut off what is beyond them.
    pub clip_planes: u8,
    /// Whether faces are seen from behind as well, with the light on that side.
    pub two_sided: bool,
    /// Whether faces are drawn deeper, or less deep, than they are. No shader knows of it.
    pub polygon_offset: bool,
    /// Shaders of the scene's own.
    pub shaders: ShaderUses,
}

impl Effects {
    /// Whether any light is on.
    #[must_use]
    pub fn lit(&self) -> bool {
        self.directional_lights > 0 || self.point_lights > 0 || self.spot_lights > 0
    }

    /// The same picture with the least that makes it: what has no bearing beside the other effects is left out, so that draws
    /// that look the same share a shader. Without a light there is nothing to reflect, colours for study are instead of others, and
    /// a fragment shader of the scene's own may look at neither maps nor light.
    #[must_use]
    pub fn reduced(self) -> Self {
        let plain = self.debug_color == DebugColor::Plain;
        let fragment = self.shaders.fragment.filter(|_| plain);
        let lit = self.lit() && fragment.is_none_or(|uses| uses.lit);
        let maps = plain && fragment.is_none_or(|uses| uses.color);
        // What it lets through is no matter of colours.
        let color_map = self.color_map && (maps || plain && self.color_map_opacity);
        let lights = |count: u8| if lit { count } else { 0 };
        Self {
            shaders: ShaderUses { fragment, ..self.shaders },
            directional_lights: lights(self.directional_lights),
            point_lights: lights(self.point_lights),
            spot_lights: lights(self.spot_lights),
            attenuation: self.attenuation && lit && (self.point_lights > 0 || self.spot_lights > 0),
            ambient: self.ambient && lit,
            specular: self.specular && lit,
            emissive: self.emissive && lit,
            color_map,
            color_map_transform: self.color_map_transform && color_map,
            color_map_opacity: self.color_map_opacity && color_map,
            ramp: self.ramp.filter(|_| maps),
            contours: self.contours && plain,
            normal_map: self.normal_map && lit,
            bump_map: self.bump_map && lit,
            shadow: self.shadow && lit && self.directional_lights > 0,
            detail_textures: self.detail_textures && maps,
            transparency: self.transparency && plain,
            fog: if plain { self.fog } else { FogType::None },
            // They have no edges of their own.
            style: if self.geometry == GeometryKind::Strokes { Style::Filled } else { self.style },
            ..self
        }
    }

    /// Names of the effects in use, for people and reports: the kind of shape, then [`EFFECTS`](super::EFFECTS) in order.
    #[must_use]
    pub fn names(&self) -> Vec<String> {
        let kind = match self.geometry {
            GeometryKind::TerrainU16 => "terrain-u16",
            GeometryKind::TerrainF32 => "terrain-f32",
            GeometryKind::LooseU16 => "loose-terrain-u16",
            GeometryKind::LooseF32 => "loose-terrain-f32",
            GeometryKind::Mesh => "mesh",
            GeometryKind::Strokes => "strokes",
        };
        let used = super::EFFECTS.iter().filter(|effect| effect.is_on(self));
        std::iter::once(kind.to_owned()).chain(used.map(|effect| effect.name_in(self))).collect()
    }
}

/// Decodes an sRGB component, 0..1, to linear light (IEC 61966-2-1).
#[must_use]
pub fn linear_from_srgb(c: f32) -> f32 {
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

/// [`linear_from_srgb`] for the three components of a colour.
#[must_use]
pub fn linear_color(srgb: Vec3) -> Vec3 {
    Vec3::from_array(srgb.to_array().map(linear_from_srgb))
}

/// A position relative to the eye, subtracted in f64 and rounded once.
#[must_use]
pub(crate) fn relative(position: DVec3, eye: DVec3) -> Vec3 {
    (position - eye).as_vec3()
}
