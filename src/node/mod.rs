//! The nodes of a scene: one file per node, typed public fields, Open Inventor's names and defaults.
//!
//! Three families keep the table of nodes × actions small:
//!
//! * a [`PropertyNode`] changes the [`State`] of a walk, the same in all actions;
//! * a [`GroupNode`] decides which children are walked and what of the State survives;
//! * a [`ShapeNode`] answers bounds, rays, primitives and drawing. Rays and drawing have defaults made from primitives, so a
//!   new shape needs two functions.
//!
//! A node is defined with [`define_node!`](crate::define_node), inside or outside this crate, and is a first-class
//! citizen either way. The macro makes the struct, its `Default` and its [`NodeInfo`] from one text, so that
//! documentation, reading and writing can not drift apart.

mod background;
mod base_color;
mod bump_map;
mod callback;
mod camera;
mod color_ramp;
mod complexity;
mod contour_lines;
mod copies;
mod cube;
mod detail_textures;
mod draw_style;
mod environment;
mod event_callback;
mod face_mesh;
mod face_sets;
mod field;
mod file;
mod font;
mod geometry;
mod group;
mod info;
mod light;
mod light_model;
mod line_sets;
mod lod;
mod material;
mod normal_map;
mod pick_style;
mod plain;
mod polygon_offset;
mod registry;
mod round;
mod seamless_terrain;
mod separator;
mod shader;
mod switch;
mod text2;
mod text_layout;
mod texture;
mod texture_transform;
mod transform;

use std::any::Any;
use std::fmt::Debug;
use std::sync::Arc;

use glam::{DVec2, DVec3};

pub use background::Background;
pub use base_color::BaseColor;
pub use bump_map::BumpMap;
pub use callback::{Callback, CallbackFunction, Function};
pub use camera::{CameraFields, FrustumCamera, OrthographicCamera, PerspectiveCamera, ViewportMapping};
pub(crate) use color_ramp::mix_stops;
pub use color_ramp::{ColorRamp, RAMP_STOPS, Ramp, RampBy};
pub use complexity::{Complexity, TextureFilter};
pub use contour_lines::ContourLines;
pub use copies::{Array, ArrayOrigin, MultipleCopy};
pub use cube::Cube;
pub use detail_textures::DetailTextures;
pub use draw_style::{DrawStyle, Style};
pub use environment::{Environment, FogType};
pub use event_callback::{EventCallback, EventFunction};
pub(crate) use face_mesh::MeshInputs;
pub use face_sets::{FaceSet, IndexedFaceSet, IndexedTriangleStripSet, QuadMesh, TriangleStripSet};
pub use field::{AxisAngle, Color, FieldError, FieldValue, List, Matrix, Plane};
pub use file::File;
pub use font::Font;
pub use geometry::{
    Binding, Coordinate3, FaceType, Normal, NormalBinding, ShapeHints, ShapeType, TextureCoordinate2, VertexOrdering,
    VertexProperty,
};
pub use group::Group;
pub use info::{Info, Label};
pub use light::{DirectionalLight, PointLight, SpotLight};
pub use light_model::{LightModel, LightingModel};
pub use line_sets::{IndexedLineSet, LineSet, PointSet};
pub use lod::{LevelOfDetail, Lod};
pub use material::{Material, MaterialBinding};
pub use normal_map::NormalMap;
pub use pick_style::{ClipPlane, PickStyle, PickStyleKind};
pub use plain::Plain;
pub use polygon_offset::{OffsetStyle, PolygonOffset};
pub use registry::Registry;
pub(crate) use registry::nearest;
pub use round::{Cone, ConePart, Cylinder, CylinderPart, Sphere};
#[cfg(feature = "cost")]
pub(crate) use seamless_terrain::Placed;
pub use seamless_terrain::{ColorMode, DetailMode, SeamlessTerrain, VoidMode, lattice_view};
pub use separator::{Separator, TransformSeparator};
#[cfg(feature = "render")]
pub(crate) use shader::Numbers;
pub use shader::{FragmentShader, ShaderParameter, ShaderProgram, ShaderSource, ShaderValue, VertexShader};
pub(crate) use shader::{Stage, active_stage, unknown_parameters};
pub use switch::Switch;
pub use text2::{Justification, Text2, TextDetail};
pub use texture::{ImageRef, Texture2, TextureUnit, Wrap};
pub use texture_transform::Texture2Transform;
pub use transform::{
    Axis, Length, MatrixTransform, Reset, ResetTransform, Rotation, RotationXyz, Scale, Transform, Translation, Units,
};

use crate::action::{
    Aabb, ActionError, ActionKind, DrawContext, EventContext, GroupContext, Near, PickCone, PropertyContext, Ray,
    ShapeContext, ShapeError, State, Surface,
};
use crate::terrain::{PatchId, Side};

/// A node of a scene graph. Implemented by [`define_node!`](crate::define_node).
pub trait Node: Any + Debug + Send + Sync {
    /// Kind, fields and documentation.
    fn info(&self) -> &'static NodeInfo;

    /// The family that the node belongs to, and its behaviour there.
    fn role(&self) -> Role<'_>;

    /// What is wrong with the values of the fields, beyond their types: ranges, contradictions.
    fn problems(&self) -> Vec<FieldProblem> {
        Vec::new()
    }

    /// A copy of the node.
    fn boxed_clone(&self) -> Box<dyn Node>;
}

/// A node type, known at compile time.
pub trait NodeType: Node + Default {
    /// Kind, fields and documentation.
    const INFO: &'static NodeInfo;
}

/// Which family a node belongs to.
#[derive(Debug)]
pub enum Role<'n> {
    /// Changes the State for what follows.
    Property(&'n dyn PropertyNode),
    /// Has children that are walked.
    Group(&'n dyn GroupNode),
    /// Has a place in space.
    Shape(&'n dyn ShapeNode),
}

/// A value of a field that can not be used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FieldProblem {
    /// Name of the field.
    pub field: &'static str,
    /// What is wrong and what would be right.
    pub message: String,
}

impl FieldProblem {
    /// A problem with a field.
    #[must_use]
    pub fn new(field: &'static str, message: impl Into<String>) -> Self {
        Self { field, message: message.into() }
    }
}

/// What there is to know about a kind of node: the one source of reading, writing and documentation.
#[derive(Debug)]
pub struct NodeInfo {
    /// The name in scene files.
    pub kind: &'static str,
    /// Family: `property`, `group` or `shape`.
    pub family: &'static str,
    /// Documentation, as in the source.
    pub doc: &'static str,
    /// What the kinds of action do with it; those that are not named pass it by. Searching and writing do with all kinds
    /// alike what they do.
    pub actions: &'static [ActionNote],
    /// Whether and which children it takes.
    pub children: Option<ChildRule>,
    /// Its fields in order.
    pub fields: &'static [FieldInfo],
    /// Makes one with default fields.
    pub make: fn() -> Box<dyn Node>,
}

impl NodeInfo {
    /// The field with this name.
    #[must_use]
    pub fn field(&self, name: &str) -> Option<&'static FieldInfo> {
        self.fields.iter().find(|f| f.name == name)
    }
}

/// What some kinds of action do with a kind of node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ActionNote {
    /// The actions.
    pub actions: &'static [ActionKind],
    /// What they do: the rest of a sentence that they begin.
    pub text: &'static str,
}

impl ActionNote {
    /// Of a property that does not say.
    pub const PROPERTY: &'static [ActionNote] =
        &[ActionNote { actions: &ActionKind::ALL, text: "give what follows the State that it changes" }];

    /// Of a group that does not say.
    pub const GROUP: &'static [ActionNote] =
        &[ActionNote { actions: &ActionKind::ALL, text: "walk its children in order" }];

    /// Of a shape that does not say.
    pub const SHAPE: &'static [ActionNote] = &[
        ActionNote { actions: &[ActionKind::Render], text: "draws it" },
        ActionNote { actions: &[ActionKind::BoundingBox], text: "holds its box" },
        ActionNote { actions: &[ActionKind::RayPick, ActionKind::HandleEvent], text: "meet it with rays" },
        ActionNote { actions: &[ActionKind::Callback], text: "hands out its triangles" },
        ActionNote { actions: &[ActionKind::PrimitiveCount], text: "counts them" },
    ];
}

/// What children a kind of node takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ChildRule {
    /// Name of the list in scene files: `children` for groups.
    pub field: &'static str,
    /// Kinds that are accepted; `None` for all.
    pub only: Option<&'static [&'static str]>,
}

impl ChildRule {
    /// Any node, in the list `children`.
    pub const ANY: ChildRule = ChildRule { field: "children", only: None };

    /// Whether a node of this kind may be a child.
    #[must_use]
    pub fn accepts(&self, kind: &str) -> bool {
        self.only.is_none_or(|only| only.contains(&kind))
    }

    /// The accepted kinds, for messages.
    #[must_use]
    pub fn describe(&self) -> String {
        self.only.map_or_else(|| "any node".to_owned(), |only| only.join(", "))
    }
}

/// One field of a kind of node.
#[derive(Debug)]
pub struct FieldInfo {
    /// The name in scene files and in code.
    pub name: &'static str,
    /// Documentation, as in the source.
    pub doc: &'static str,
    /// Type as a reader of scene files sees it.
    pub type_name: fn() -> String,
    /// The default as written in a scene file.
    pub default: fn() -> String,
    /// Sets the field from its text in RON.
    pub read: fn(&mut dyn Node, &str) -> Result<(), FieldError>,
    /// The field as RON, `None` if it has its default.
    pub write: fn(&dyn Node) -> Option<String>,
}

/// A node that changes the State of a walk for what follows it.
pub trait PropertyNode: Node {
    /// Changes the state.
    fn apply(&self, state: &mut State, cx: &PropertyContext<'_>);

    /// Whether what it changes decides where shapes are, their boxes or where rays meet them. What says no may be edited
    /// without boxes and picks being worked out again.
    fn moves_shapes(&self) -> bool {
        true
    }

    /// Whether it does more than change the State, so that each such action has to come by: then nothing is answered from
    /// memory.
    fn acts_on(&self, action: ActionKind) -> bool {
        let _ = action;
        false
    }

    /// Does what it wants with an event that is handed round; see [`HandleEventAction`](crate::action::HandleEventAction).
    ///
    /// # Errors
    ///
    /// Ends the action with this error.
    fn handle_event(&self, cx: &mut EventContext<'_>) -> Result<(), ActionError> {
        let _ = cx;
        Ok(())
    }
}

/// What of the State is afterwards what it was before a group.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Restores {
    /// Nothing: what the children change acts on what follows the group.
    #[default]
    Nothing,
    /// The place in space alone.
    Transform,
    /// Everything.
    Everything,
}

/// A node that has children.
pub trait GroupNode: Node {
    /// Which child to walk at this step of the visit, counted from 0; `None` ends the visit. The state may be changed
    /// before the child is walked; with [`Arc::make_mut`], since others may share it.
    fn child_at(&self, step: usize, cx: &GroupContext<'_>, state: &mut Arc<State>) -> Option<usize> {
        let _ = state;
        (step < cx.children()).then_some(step)
    }

    /// Whether its children are what it shows.
    ///
    /// # Errors
    ///
    /// Ends the action with this error.
    fn ready(&self, cx: &GroupContext<'_>) -> Result<(), ShapeError> {
        let _ = cx;
        Ok(())
    }

    /// What of the state is afterwards what it was before.
    fn restores(&self) -> Restores {
        Restores::Nothing
    }

    /// Whether [`GroupNode::child_at`] looks at the camera, as levels of detail do.
    fn looks_at_camera(&self) -> bool {
        false
    }
}

/// A triangle with what a hit on it needs to know, in local coordinates.
///
/// ```
/// use seamount::node::Triangle;
/// use seamount::prelude::*;
///
/// // What a shape does not know of its triangles may be left out.
/// let points = [DVec3::ZERO, DVec3::X, DVec3::Y];
/// let flat = Triangle { points, normals: [DVec3::Z; 3], ..Triangle::default() };
/// assert_eq!(flat.materials, [0; 3]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Triangle {
    /// Corners, counter-clockwise seen from outside.
    pub points: [DVec3; 3],
    /// Unit normals at the corners.
    pub normals: [DVec3; 3],
    /// Texture coordinates at the corners.
    pub uvs: [DVec2; 3],
    /// Numbers of the colours at the corners, of those of the Material and as its MaterialBinding says; 0 where all of the shape
    /// has the first.
    pub materials: [u32; 3],
}

/// What a shape says of a place where a ray meets it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapeHit {
    /// Ray parameter: the point is `origin + t · direction` of the local ray.
    pub t: f64,
    /// Point in local coordinates.
    pub point: DVec3,
    /// Normal of the surface in local coordinates, any length, towards its outer side.
    pub normal: DVec3,
    /// The normal that shading uses, any length.
    pub smooth_normal: DVec3,
    /// Texture coordinate.
    pub uv: DVec2,
    /// What only this kind of shape can say.
    pub detail: HitDetail,
}

/// Details of a hit by kind of shape.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum HitDetail {
    /// Nothing more to say.
    None,
    /// The triangle that was hit, counted in the order of [`ShapeNode::primitives`].
    Triangle {
        /// Its number.
        index: usize,
    },
    /// A place on a face of a set of faces.
    Face(FaceDetail),
    /// A place on a line.
    Line(LineDetail),
    /// A point of a set of points.
    Point(PointDetail),
    /// A character of a text.
    Text(TextDetail),
    /// A place on a terrain.
    Terrain(TerrainDetail),
}

/// Which face of a set of faces was hit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FaceDetail {
    /// Number of the face, from 0 in the order of the node: a polygon, a triangle of a strip, or a quadrilateral.
    pub face: usize,
    /// Number of the part: a strip, or a row of quadrilaterals; for polygons the face.
    pub part: usize,
    /// The triangle of the face that was hit: its corners as indices into the coordinates.
    pub points: [usize; 3],
    /// Weights of these corners at the point.
    pub barycentric: [f64; 3],
}

/// Which place of a set of lines was hit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineDetail {
    /// Number of the line, from 0 in the order of the node.
    pub line: usize,
    /// Number of the straight piece within the line, from 0.
    pub piece: usize,
    /// The ends of the piece as indices into the coordinates; of shapes without coordinates, counted along the line.
    pub points: [usize; 2],
    /// From the first end, 0, to the second, 1.
    pub along: f64,
}

/// Which point of a set of points was hit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PointDetail {
    /// Number of the point, from 0 in the order of the node.
    pub index: usize,
    /// The point as an index into the coordinates; of shapes without coordinates the same.
    pub point: usize,
}

/// Which triangle of a terrain was hit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TerrainTriangle {
    /// The coarse triangle of a patch at this side.
    Side(Side),
    /// A drawn triangle of the tile at this side.
    Tile(Side),
    /// A drawn triangle of the strip at the corner after this side, clockwise.
    Strip(Side),
    /// The north-east half of a cell.
    Upper,
    /// The south-west half of a cell.
    Lower,
}

impl TerrainTriangle {
    /// The name, as the command prints it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            TerrainTriangle::Side(Side::North) => "north",
            TerrainTriangle::Side(Side::East) => "east",
            TerrainTriangle::Side(Side::South) => "south",
            TerrainTriangle::Side(Side::West) => "west",
            TerrainTriangle::Tile(Side::North) => "tile north",
            TerrainTriangle::Tile(Side::East) => "tile east",
            TerrainTriangle::Tile(Side::South) => "tile south",
            TerrainTriangle::Tile(Side::West) => "tile west",
            TerrainTriangle::Strip(Side::North) => "strip north-east",
            TerrainTriangle::Strip(Side::East) => "strip south-east",
            TerrainTriangle::Strip(Side::South) => "strip south-west",
            TerrainTriangle::Strip(Side::West) => "strip north-west",
            TerrainTriangle::Upper => "upper",
            TerrainTriangle::Lower => "lower",
        }
    }
}

/// What a hit on a terrain says beyond point and normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TerrainDetail {
    /// Which surface was hit.
    pub surface: Surface,
    /// The patch that was hit: an active one, or for exact picks the leaf of the tree in which the cell lies.
    pub patch: PatchId,
    /// Which triangle.
    pub triangle: TerrainTriangle,
    /// Weights of the triangle's corners at the point. Coarse: west to east along its side as seen from the centre
    /// (clockwise), then the centre. Drawn: in the order of [`DrawnTriangle::corners`](crate::terrain::DrawnTriangle). Exact:
    /// north-west, the third, south-east corner of the cell.
    pub barycentric: [f64; 3],
    /// Whether a vertical wall was hit: on the coarse surface one that closes the gap between patches of different size, on
    /// the drawn one a sliver in the plane of the map's border.
    pub wall: bool,
    /// Column and row of the map's cell below or above the point.
    pub cell: [u32; 2],
    /// Whether a corner of that cell is a void in the map, so that its height is an interpolation.
    pub void: bool,
    /// Height of the point: its local z.
    pub height: f64,
    /// Steepness in radians against the node's own horizontal, 0..π/2.
    pub slope: f64,
    /// No point of the full-resolution surface is vertically further from the picked one in this patch, along local z.
    pub error: f64,
    /// Whether the ray goes into the ground here; otherwise it comes out.
    pub entering: bool,
}

impl Default for TerrainDetail {
    /// The north-west corner of the first cell.
    fn default() -> Self {
        Self {
            surface: Surface::Exact,
            patch: PatchId { level: 0, column: 0, row: 0 },
            triangle: TerrainTriangle::Upper,
            barycentric: [1.0, 0.0, 0.0],
            wall: false,
            cell: [0, 0],
            void: false,
            height: 0.0,
            slope: 0.0,
            error: 0.0,
            entering: true,
        }
    }
}

/// A node that has a place in space.
pub trait ShapeNode: Node {
    /// The smallest box around the shape in local coordinates; `None` when there is nothing.
    ///
    /// # Errors
    ///
    /// When the shape can not be had: a missing file, a field out of range.
    fn bounds(&self, cx: &ShapeContext<'_>) -> Result<Option<Aabb>, ShapeError>;

    /// Hands over the triangles of the shape.
    ///
    /// # Errors
    ///
    /// As for [`ShapeNode::bounds`].
    fn primitives(&self, cx: &ShapeContext<'_>, sink: &mut dyn FnMut(Triangle)) -> Result<(), ShapeError>;

    /// Hands over the pieces of lines of the shape; most have none.
    ///
    /// # Errors
    ///
    /// As for [`ShapeNode::bounds`].
    fn lines(&self, cx: &ShapeContext<'_>, sink: &mut dyn FnMut([DVec3; 2])) -> Result<(), ShapeError> {
        let _ = (cx, sink);
        Ok(())
    }

    /// Hands over the points of the shape; most have none.
    ///
    /// # Errors
    ///
    /// As for [`ShapeNode::bounds`].
    fn points(&self, cx: &ShapeContext<'_>, sink: &mut dyn FnMut(DVec3)) -> Result<(), ShapeError> {
        let _ = (cx, sink);
        Ok(())
    }

    /// Appends the places where a local ray meets the shape, with `t` in the ray's range, in any order, each crossing once.
    /// With `first` only the nearest is needed.
    ///
    /// # Errors
    ///
    /// As for [`ShapeNode::bounds`].
    fn ray(&self, cx: &ShapeContext<'_>, ray: &Ray, first: bool, hits: &mut Vec<ShapeHit>) -> Result<(), ShapeError> {
        let _ = first;
        let mut index = 0;
        let mut crossings = crate::action::Crossings::default();
        self.primitives(cx, &mut |triangle| {
            if let Some(meeting) = crate::action::meet_triangle(ray, triangle.points)
                && crossings.is_new(triangle.points, &meeting)
            {
                hits.push(ShapeHit { detail: HitDetail::Triangle { index }, ..meeting.hit(&triangle) });
            }
            index += 1;
        })
    }

    /// Whether rays that miss the box may meet the shape: lines and points are met from beside them, and text is as large
    /// as the picture makes it.
    fn beyond_box(&self) -> bool {
        false
    }

    /// Appends the places of lines and points within a cone around the ray, up to `far` along it, in any order; see
    /// [`Near`]. By default those of [`ShapeNode::lines`] and [`ShapeNode::points`]; asked for where
    /// [`ShapeNode::beyond_box`] says so.
    ///
    /// # Errors
    ///
    /// As for [`ShapeNode::bounds`].
    fn near(
        &self,
        cx: &ShapeContext<'_>,
        cone: &PickCone,
        far: f64,
        hits: &mut Vec<ShapeHit>,
    ) -> Result<(), ShapeError> {
        Near::new(cx, cone, far, hits).pieces_of(self, cx)
    }

    /// Appends what to draw.
    ///
    /// # Errors
    ///
    /// As for [`ShapeNode::bounds`].
    fn draw(&self, cx: &mut DrawContext<'_>) -> Result<(), ShapeError> {
        cx.draw_primitives(|shape_cx, sink| self.primitives(shape_cx, sink))
    }
}

/// Defines a node: the struct with public fields, its `Default`, and its [`NodeInfo`].
///
/// `family` is `property`, `group` or `shape`; implement [`PropertyNode`], [`GroupNode`] or [`ShapeNode`] for the type. Groups name
/// their [`ChildRule`]. Fields have documentation, a type that implements [`FieldValue`] and a default. Fields after
/// `transient` are not in files. An optional `actions` says what which kinds of action do with the node, where that is not what
/// they do with all of its family: [`ActionNote`]. An optional `check` names a function `fn(&T) -> Vec<FieldProblem>`.
///
/// # Example
///
/// ```
/// use seamount::define_node;
/// use seamount::node::{PropertyNode, NodeType};
/// use seamount::action::{PropertyContext, State};
///
/// define_node! {
///     /// Moves what follows up.
///     pub struct Lift: property {
///         /// How far, in local units.
///         pub height: f64 = 1.0,
///     }
///     actions {
///         Render, BoundingBox, RayPick, HandleEvent, Matrix, Callback: "place what follows higher";
///     }
/// }
///
/// impl PropertyNode for Lift {
///     fn apply(&self, state: &mut State, _: &PropertyContext<'_>) {
///         state.translate(glam::DVec3::new(0.0, 0.0, self.height));
///     }
/// }
///
/// assert_eq!(Lift::default().height, 1.0);
/// assert_eq!(Lift::INFO.fields[0].name, "height");
/// assert_eq!(Lift::INFO.actions[0].text, "place what follows higher");
/// ```
#[macro_export]
macro_rules! define_node {
    (
        $(#[doc = $doc:expr])*
        pub struct $name:ident : $family:ident $(($rule:expr))? {
            $(
                $(#[doc = $fdoc:expr])*
                pub $field:ident : $ty:ty = $default:expr,
            )*
            $(transient:
                $(
                    $(#[doc = $tdoc:expr])*
                    pub $tfield:ident : $tty:ty = $tdefault:expr,
                )*
            )?
        }
        $(actions { $($($action:ident),+ : $text:expr;)* })?
        $(check $check:expr;)?
    ) => {
        $(#[doc = $doc])*
        #[derive(Debug, Clone, PartialEq)]
        pub struct $name {
            $(
                $(#[doc = $fdoc])*
                pub $field: $ty,
            )*
            $($(
                $(#[doc = $tdoc])*
                pub $tfield: $tty,
            )*)?
        }

        impl ::std::default::Default for $name {
            fn default() -> Self {
                Self {
                    $($field: $default,)*
                    $($($tfield: $tdefault,)*)?
                }
            }
        }

        impl $crate::node::NodeType for $name {
            const INFO: &'static $crate::node::NodeInfo = &$crate::node::NodeInfo {
                kind: stringify!($name),
                family: stringify!($family),
                doc: concat!($($doc, "\n",)*),
                actions: $crate::define_node!(@actions $family $({ $($($action),+ : $text;)* })?),
                children: $crate::define_node!(@rule $($rule)?),
                fields: &[$(
                    $crate::node::FieldInfo {
                        name: stringify!($field),
                        doc: concat!($($fdoc, "\n",)*),
                        type_name: <$ty as $crate::node::FieldValue>::type_name,
                        default: || $crate::node::FieldValue::write(&<$name as ::std::default::Default>::default().$field),
                        read: |node, text| {
                            let value = <$ty as $crate::node::FieldValue>::read(text)?;
                            let node: &mut dyn ::std::any::Any = node;
                            if let Some(node) = node.downcast_mut::<$name>() {
                                node.$field = value;
                            }
                            Ok(())
                        },
                        write: |node| {
                            let node: &dyn ::std::any::Any = node;
                            let value = &node.downcast_ref::<$name>()?.$field;
                            let default = <$name as ::std::default::Default>::default().$field;
                            let text = $crate::node::FieldValue::write(value);
                            if *value != default {
                                return Some(text);
                            }
                            // What is equal is compared as text, which tells -0.0 from 0.0.
                            (text != $crate::node::FieldValue::write(&default)).then_some(text)
                        },
                    },
                )*],
                make: || ::std::boxed::Box::new(<$name as ::std::default::Default>::default()),
            };
        }

        impl $crate::node::Node for $name {
            fn info(&self) -> &'static $crate::node::NodeInfo {
                <$name as $crate::node::NodeType>::INFO
            }

            fn role(&self) -> $crate::node::Role<'_> {
                $crate::define_node!(@role $family self)
            }

            $(fn problems(&self) -> ::std::vec::Vec<$crate::node::FieldProblem> {
                ($check)(self)
            })?

            fn boxed_clone(&self) -> ::std::boxed::Box<dyn $crate::node::Node> {
                ::std::boxed::Box::new(self.clone())
            }
        }
    };
    (@actions property) => { $crate::node::ActionNote::PROPERTY };
    (@actions group) => { $crate::node::ActionNote::GROUP };
    (@actions shape) => { $crate::node::ActionNote::SHAPE };
    (@actions $family:ident { $($($action:ident),+ : $text:expr;)* }) => {
        &[$($crate::node::ActionNote { actions: &[$($crate::action::ActionKind::$action),+], text: $text },)*]
    };
    (@rule) => { None };
    (@rule $rule:expr) => { Some($rule) };
    (@role property $self:ident) => { $crate::node::Role::Property($self) };
    (@role group $self:ident) => { $crate::node::Role::Group($self) };
    (@role shape $self:ident) => { $crate::node::Role::Shape($self) };
}
