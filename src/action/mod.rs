//! Actions: what can be asked of a scene. Each is a plain struct with public settings and an `apply`.
//!
//! Actions borrow the scene shared; several threads may ask at once. All of them walk the graph with the one walk of
//! [`walk`], which keeps the [`State`].

mod aabb;
mod bounding_box;
mod bvh;
mod callback;
mod camera;
mod cameras;
mod coloring;
mod colors;
mod effects;
mod error;
mod event;
mod frame;
mod ground;
mod handle_event;
mod index;
mod kind;
mod matrix;
mod memo;
mod pick_cone;
mod program;
mod ray;
mod ray_pick;
mod render;
mod search;
mod state;
mod view;
mod viewpoint;
pub mod walk;

pub use aabb::Aabb;
pub(crate) use bounding_box::bounds_below;
pub use bounding_box::{BoundingBoxAction, OrientedBox};
pub(crate) use bvh::Bvh;
pub use callback::{CallbackAction, PrimitiveCount, PrimitiveCountAction, Visit};
pub(crate) use camera::unit;
pub use camera::{CameraError, Crop, PixelArea, PlacedCamera, Surround};
pub use cameras::Cameras;
pub use colors::{CornerData, SurfaceColors};
pub use effects::{Asked, BACKGROUNDS, DrawEffects, EFFECTS, EffectInfo, Explained, effect_names};
pub use error::{ActionError, ShapeError};
pub use event::{ButtonState, Event, EventKind, EventType, Key, MouseButton};
pub use frame::{
    Attenuation, Bump, ColorMap, Coloring, Cone, ContourStyle, DebugColor, DepthOffset, DetailMaps, Draw, ERROR_STOPS,
    Effects, Fill, Fog, Frame, FrameLight, Geometry, GeometryKind, LineStyle, Mesh, RampMap, Relief, Sky, Statistics,
    Strokes, SurfaceMaterial, TerrainDraw, error_color, linear_color, linear_from_srgb,
};
pub use ground::GroundPoint;
pub use handle_event::{EventContext, HandleEventAction};
pub(crate) use index::{Index, IndexCache};
pub use kind::ActionKind;
pub use matrix::MatrixAction;
pub use pick_cone::{Near, PickCone};
#[cfg(feature = "render")]
pub(crate) use program::function_in;
pub use program::{DrawProgram, FragmentUses, ProgramCode, ShaderOrigin, ShaderText, ShaderUses, VertexUses};
pub(crate) use program::{Program as SceneProgram, ProgramBasis};
pub(crate) use ray::{Crossings, Meeting, meet_triangle};
pub use ray::{Ray, RayError, intersect_triangle};
pub use ray_pick::{PickTarget, PickedPoint, Picker, RayPickAction, Surface};
pub use render::{DrawContext, DrawOptions, RenderAction};
pub use search::{Interest, SearchAction};
pub use state::{
    Aspect, Branches, Credits, Extensions, FontBinding, GroupContext, LightSource, PlacedLight, PlacedPlane, Program,
    Properties, PropertyContext, ShapeContext, State, TextureBinding, TextureSource,
};
pub(crate) use state::{inverse, normal_matrix};
pub use view::{View, ViewStatistics};
pub use viewpoint::{Lens, Viewpoint};
