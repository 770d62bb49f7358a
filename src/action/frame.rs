//! What to draw, as plain data: the product of the render action and the only thing the renderer sees.
//!
//! A [`Frame`] is made without a GPU, can be sent to another thread, and holds no reference into the scene: maps, images
//! and meshes are shared by `Arc`. All matrices were multiplied in f64, relative to the eye, and rounded once.

use std::sync::Arc;

use glam::{DVec3, Mat3, Mat4, Vec3};

use crate::node::TextureFilter;
use crate::scene::Image;
use crate::terrain::{HeightField, Instances, Parts, Samples};

/// One picture's worth of drawing.
#[derive(Debug, Clone, Default)]
pub struct Frame {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Colour where nothing is drawn, linear light, 0..1.
    pub background: Vec3,
    /// What to draw, in the order of the walk.
    pub draws: Vec<Draw>,
    /// What the walk counted.
    pub statistics: Statistics,
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
}

/// A light in eye-relative world axes, linear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FrameLight {
    /// Parallel light.
    Directional {
        /// Unit vector towards the light.
        towards: Vec3,
        /// Colour times intensity.
        color: Vec3,
    },
    /// Light from a point.
    Point {
        /// Position relative to the eye.
        position: Vec3,
        /// Colour times intensity.
        color: Vec3,
    },
}

/// The shapes that a renderer knows how to draw.
#[derive(Debug, Clone)]
pub enum Geometry {
    /// Patches of a height map.
    Terrain(TerrainDraw),
    /// Triangles.
    Mesh(Arc<Mesh>),
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
    /// Colour map on the whole extent, first row north.
    pub color_map: Option<ColorMap>,
    /// Levels of the patch tree, for colouring by level.
    pub levels: u32,
    /// Lattice steps per unit at the finest level is 1; each level up multiplies by this.
    pub branching: u32,
}

/// An image that colours a surface, and how it is sampled.
#[derive(Debug, Clone)]
pub struct ColorMap {
    /// The image.
    pub image: Arc<Image>,
    /// The filters, from the Complexity node's texture quality.
    pub filter: TextureFilter,
}

/// Triangles with normals, in local coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    /// Corners.
    pub positions: Vec<Vec3>,
    /// Unit normals, one per corner.
    pub normals: Vec<Vec3>,
    /// Corners of the triangles, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
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
}

/// The kinds of shape that shaders differ by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
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
    Mesh,
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

    /// Whether it is loose triangles of a terrain.
    #[must_use]
    pub fn is_loose(self) -> bool {
        matches!(self, Self::LooseU16 | Self::LooseF32)
    }
}

/// The set of effects of one draw: all that shader text, bindings and vertex data depend on. What is not in here is not
/// in any of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Effects {
    /// Which vertex stage.
    pub geometry: GeometryKind,
    /// Number of directional lights.
    pub directional_lights: u8,
    /// Number of point lights.
    pub point_lights: u8,
    /// Whether any light makes highlights (specular colour not black).
    pub specular: bool,
    /// Whether a colour map multiplies the diffuse colour's place.
    pub color_map: bool,
    /// Colours for study; replace colour map and diffuse colour.
    pub debug_color: DebugColor,
    /// Whether ambient light reaches the surface.
    pub ambient: bool,
    /// Whether the surface glows.
    pub emissive: bool,
    /// Whether the heights of a terrain blend between levels.
    pub morph: bool,
}

impl Effects {
    /// Whether any light is on.
    #[must_use]
    pub fn lit(&self) -> bool {
        self.directional_lights > 0 || self.point_lights > 0
    }

    /// Names of the effects in use, for people and reports.
    #[must_use]
    pub fn names(&self) -> Vec<String> {
        let mut names = vec![match self.geometry {
            GeometryKind::TerrainU16 => "terrain-u16".to_owned(),
            GeometryKind::TerrainF32 => "terrain-f32".to_owned(),
            GeometryKind::LooseU16 => "loose-terrain-u16".to_owned(),
            GeometryKind::LooseF32 => "loose-terrain-f32".to_owned(),
            GeometryKind::Mesh => "mesh".to_owned(),
        }];
        let mut count = |n: u8, name: &str| {
            if n > 0 {
                names.push(format!("{name}×{n}"));
            }
        };
        count(self.directional_lights, "directional-light");
        count(self.point_lights, "point-light");
        let flags = [
            (self.ambient, "ambient"),
            (self.specular, "specular"),
            (self.emissive, "emissive"),
            (self.morph, "morph"),
            (self.color_map, "color-map"),
            (self.debug_color == DebugColor::Parts, "color-by-part"),
            (self.debug_color == DebugColor::Levels, "color-by-level"),
        ];
        names.extend(flags.into_iter().filter(|(on, _)| *on).map(|(_, name)| name.to_owned()));
        names
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
