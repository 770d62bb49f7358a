//! The one walk over the graph that all actions share.
//!
//! Depth first, left to right. Properties change the [`State`]; groups decide which children are walked and what of the
//! state survives; shapes are handed to a visitor. The walk keeps its own stack, so that a deep graph costs memory, not
//! the thread's stack.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing))]

use std::ops::ControlFlow;
use std::sync::Arc;

use super::camera::PlacedCamera;
use super::{ActionError, PropertyContext, State};
use crate::node::{GroupNode, Role, ShapeNode};
use crate::scene::{NodeKey, Path, Scene};

/// Deepest nesting that is walked. Beyond what anybody writes; it bounds the memory of a walk.
pub const MAX_DEPTH: usize = 20_000;

/// Most nodes that one walk visits. Sharing lets a short file describe more occurrences than there is time for: 60 groups that
/// each hold the next one twice are 2⁶⁰. Such a scene ends in an error, not in a hang.
pub const MAX_VISITS: u64 = 50_000_000;

/// What a walk tells while it goes.
pub trait Visitor {
    /// A node is reached, before it acts.
    ///
    /// # Errors
    ///
    /// Ends the walk.
    fn enter(&mut self, path: &Path, state: &State) -> Result<ControlFlow<()>, ActionError> {
        let _ = (path, state);
        Ok(ControlFlow::Continue(()))
    }

    /// A node was walked; the state is what it leaves behind.
    fn leave(&mut self, path: &Path, state: &State) {
        let _ = (path, state);
    }

    /// A shape is reached.
    ///
    /// # Errors
    ///
    /// Ends the walk.
    fn shape(&mut self, shape: &dyn ShapeNode, path: &Path, state: &State) -> Result<ControlFlow<()>, ActionError> {
        let _ = (shape, path, state);
        Ok(ControlFlow::Continue(()))
    }
}

struct Level<'s> {
    group: &'s dyn GroupNode,
    key: NodeKey,
    step: usize,
    saved: Option<Box<State>>,
}

/// Walks the scene from its root.
///
/// # Errors
///
/// What the visitor returns, [`ActionError::TooDeep`] or [`ActionError::TooLarge`].
pub fn walk(scene: &Scene, visitor: &mut dyn Visitor) -> Result<(), ActionError> {
    let mut state = State::default();
    let mut path = Path::default();
    let mut stack: Vec<Level<'_>> = Vec::new();
    let mut next = Some((scene.root(), 0));
    let mut visits = 0;
    loop {
        if let Some((key, index)) = next.take() {
            visits += 1;
            if visits > MAX_VISITS {
                return Err(ActionError::TooLarge);
            }
            if stack.len() >= MAX_DEPTH {
                return Err(ActionError::TooDeep);
            }
            path.push(key, index);
            if visitor.enter(&path, &state)?.is_break() {
                return Ok(());
            }
            match scene.role(key) {
                Some(Role::Property(property)) => {
                    let camera = state.camera.as_ref().map(Arc::as_ptr);
                    property.apply(&mut state, &PropertyContext { scene, key, visit: visits });
                    // A camera does not know its own path.
                    if state.camera.as_ref().map(Arc::as_ptr) != camera
                        && let Some(placed) = &mut state.camera
                    {
                        let mut with_path = PlacedCamera::clone(placed);
                        with_path.path = path.clone();
                        *placed = Arc::new(with_path);
                    }
                    visitor.leave(&path, &state);
                    path.pop();
                }
                Some(Role::Shape(shape)) => {
                    if visitor.shape(shape, &path, &state)?.is_break() {
                        return Ok(());
                    }
                    visitor.leave(&path, &state);
                    path.pop();
                }
                Some(Role::Group(group)) => {
                    let saved = group.restores_state().then(|| Box::new(state.clone()));
                    stack.push(Level { group, key, step: 0, saved });
                }
                None => {
                    path.pop();
                }
            }
        }
        let Some(level) = stack.last_mut() else {
            return Ok(());
        };
        let children = scene.children(level.key);
        let step = level.step;
        level.step += 1;
        match level.group.child_at(step, children.len(), &mut state) {
            Some(index) => next = children.get(index).map(|&child| (child, index)),
            None => {
                if let Some(saved) = stack.pop().and_then(|level| level.saved) {
                    state = *saved;
                }
                visitor.leave(&path, &state);
                path.pop();
            }
        }
    }
}
