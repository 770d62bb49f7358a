//! Seamount: a retained scene graph in the manner of Open Inventor, drawn with wgpu, whose showpiece is the shape node
//! [`SeamlessTerrain`](node::SeamlessTerrain).
//!
//! # A first example
//!
//! ```
//! use seamount::prelude::*;
//!
//! // A hill of 5 × 5 samples, in memory.
//! let heights = vec![
//!     0.0, 0.0, 0.0, 0.0, 0.0, //
//!     0.0, 1.0, 2.0, 1.0, 0.0, //
//!     0.0, 2.0, 4.0, 2.0, 0.0, //
//!     0.0, 1.0, 2.0, 1.0, 0.0, //
//!     0.0, 0.0, 0.0, 0.0, 0.0,
//! ];
//! let mut scene = Scene::new();
//! let root = scene.root();
//! scene.add(root, Texture2::from_image(Image::new(5, 5, Pixels::GrayF32(heights))?))?;
//! scene.add(root, SeamlessTerrain { scale: 100.0, max_height: 10.0, ..SeamlessTerrain::default() })?;
//!
//! // Where does a ray from above meet the ground? Exactly, or on the coarse triangles with the bound of their error.
//! let ray = Ray::new(DVec3::new(50.0, 50.0, 1000.0), DVec3::NEG_Z)?;
//! let exact = RayPickAction { surface: Surface::Exact, ..RayPickAction::ray(ray) }.apply(&scene)?;
//! assert_eq!(exact[0].point, DVec3::new(50.0, 50.0, 40.0));
//! let coarse = RayPickAction::ray(ray).apply(&scene)?;
//! assert!((coarse[0].point.z - 40.0).abs() <= coarse[0].error_bound.expect("a terrain knows its error"));
//!
//! // And how large is it all?
//! let bounds = BoundingBoxAction::default().apply(&scene)?.expect("not empty");
//! assert_eq!(bounds.max, DVec3::new(100.0, 100.0, 40.0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Rooms
//!
//! * [`scene`]: the graph, its edits, names and resources.
//! * [`node`]: what can stand in a graph.
//! * [`action`]: what can be asked of it.
//! * [`terrain`]: the engine below `SeamlessTerrain`, usable by itself.
//! * [`format`](mod@format): scene files.
//! * `render`: pictures (feature `render`).
//! * `cost`: what accuracy costs, measured (feature `cost`).
//!
//! # Features
//!
//! `cli` (default) builds the command `seamount`; `cost` adds the measuring behind `seamount cost`, `render` drawing with wgpu.
//! Without them, the crate reads scenes, chooses detail, boxes and picks.
#![cfg_attr(not(test), deny(clippy::unwrap_used))]

pub mod action;
#[cfg(feature = "cost")]
pub mod cost;
pub mod format;
pub mod node;
pub mod output;
#[cfg(feature = "render")]
pub mod render;
pub mod scene;
pub mod terrain;

/// The README's code runs as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

/// What most programs need.
pub mod prelude {
    pub use glam::{DAffine3, DQuat, DVec2, DVec3};

    pub use crate::action::{
        Aabb, ActionError, BoundingBoxAction, CallbackAction, Frame, GroundPoint, HandleEventAction, Interest,
        MatrixAction, PickTarget, PickedPoint, PrimitiveCountAction, Ray, RayPickAction, RenderAction, SearchAction,
        Surface, View,
    };
    pub use crate::node::{
        Array, ArrayOrigin, Axis, AxisAngle, Background, BaseColor, Binding, BumpMap, Callback, ClipPlane, Color,
        ColorMode, ColorRamp, Complexity, Cone, ConePart, ContourLines, Coordinate3, Cube, Cylinder, CylinderPart,
        DetailMode, DetailTextures, DirectionalLight, DrawStyle, Environment, EventCallback, FaceSet, FaceType, File,
        FogType, Font, FragmentShader, FrustumCamera, Group, IndexedFaceSet, IndexedLineSet, IndexedTriangleStripSet,
        Info, Justification, Label, Length, LevelOfDetail, LightModel, LightingModel, LineSet, List, Lod, Material,
        MaterialBinding, Matrix, MatrixTransform, MultipleCopy, Node, Normal, NormalBinding, NormalMap,
        OrthographicCamera, PerspectiveCamera, PickStyle, PickStyleKind, Plane, PointLight, PointSet, PolygonOffset,
        QuadMesh, Ramp, RampBy, Reset, ResetTransform, Rotation, RotationXyz, Scale, SeamlessTerrain, Separator,
        ShaderParameter, ShaderProgram, ShaderSource, ShaderValue, ShapeHints, ShapeType, Sphere, SpotLight, Style,
        Switch, Text2, Texture2, Texture2Transform, TextureCoordinate2, TextureUnit, Transform, TransformSeparator,
        Translation, TriangleStripSet, Units, VertexOrdering, VertexProperty, VertexShader, ViewportMapping, VoidMode,
    };
    pub use crate::scene::{EditError, Image, NodeKey, Path, Pixels, Scene};
}
