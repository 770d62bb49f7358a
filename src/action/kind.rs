//! Which kinds of action there are.

use serde::{Deserialize, Serialize};

/// The kinds of action that walk a scene, for nodes that do something of their own when one comes by.
///
/// Writing a scene file is no walk: it lists each node once, whatever a Switch shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[non_exhaustive]
pub enum ActionKind {
    /// [`RenderAction`](super::RenderAction).
    Render,
    /// [`BoundingBoxAction`](super::BoundingBoxAction).
    BoundingBox,
    /// [`RayPickAction`](super::RayPickAction), and heights and lines of sight, which are picks.
    RayPick,
    /// [`SearchAction`](super::SearchAction); finding a camera is a search too.
    Search,
    /// [`MatrixAction`](super::MatrixAction).
    Matrix,
    /// [`CallbackAction`](super::CallbackAction).
    Callback,
    /// [`PrimitiveCountAction`](super::PrimitiveCountAction).
    PrimitiveCount,
    /// [`HandleEventAction`](super::HandleEventAction).
    HandleEvent,
    /// An action that is defined elsewhere, or a check of the scene.
    Other,
}

impl ActionKind {
    /// All kinds.
    pub const ALL: [ActionKind; 9] = [
        ActionKind::Render,
        ActionKind::BoundingBox,
        ActionKind::RayPick,
        ActionKind::Search,
        ActionKind::Matrix,
        ActionKind::Callback,
        ActionKind::PrimitiveCount,
        ActionKind::HandleEvent,
        ActionKind::Other,
    ];

    /// The name, as documentation has it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            ActionKind::Render => "render",
            ActionKind::BoundingBox => "bounding box",
            ActionKind::RayPick => "ray pick",
            ActionKind::Search => "search",
            ActionKind::Matrix => "matrix",
            ActionKind::Callback => "callback",
            ActionKind::PrimitiveCount => "primitive count",
            ActionKind::HandleEvent => "handle event",
            ActionKind::Other => "others",
        }
    }
}
