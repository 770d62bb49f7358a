//! Seamount: a retained scene graph in the manner of Open Inventor with seamless level-of-detail terrain.
#![cfg_attr(not(test), deny(clippy::unwrap_used))]

pub mod action;
pub mod format;
pub mod node;
#[cfg(feature = "render")]
pub mod render;
pub mod scene;
pub mod terrain;

/// What most programs need.
pub mod prelude {
    pub use glam::{DAffine3, DQuat, DVec2, DVec3};

    pub use crate::action::{
        Aabb, ActionError, BoundingBoxAction, Frame, PickTarget, PickedPoint, Ray, RayPickAction, RenderAction,
        SearchAction, View,
    };
    pub use crate::node::{
        AxisAngle, BaseColor, Color, ColorMode, Complexity, Cube, DetailMode, DirectionalLight, FragmentShader, Group,
        Material, Node, OrthographicCamera, PerspectiveCamera, PointLight, SeamlessTerrain, Separator, ShaderParameter,
        ShaderProgram, ShaderValue, Texture2, TextureUnit, Transform, VertexShader, VoidMode,
    };
    pub use crate::scene::{EditError, Image, NodeKey, Path, Pixels, Scene};
}
