//! The one walk over the graph that all actions share.
//!
//! Depth first, left to right. Properties change the [`State`]; groups decide which children are walked and what of the
//! state survives; shapes are handed to a visitor. The walk keeps its own stack, so that a deep graph costs memory, not
//! the thread's stack.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing))]

use std::sync::Arc;

use super::{ActionError, ActionKind, Branches, PropertyContext, State};
use crate::action::GroupContext;
use crate::node::{GroupNode, Restores, Role, ShapeNode};
use crate::scene::{NodeKey, Path, Scene};

/// Deepest nesting that is walked. Beyond what anybody writes; it bounds the memory of a walk.
pub const MAX_DEPTH: usize = 20_000;

/// Most nodes that one walk visits. Sharing lets a short file describe more occurrences than there is time for: 60 groups that
/// each hold the next one twice are 2⁶⁰. Such a scene ends in an error, not in a hang.
pub const MAX_VISITS: u64 = 50_000_000;

/// What a visitor wants of the walk when it has seen something.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Go {
    /// To go on.
    On,
    /// To leave this node out: its children are not walked, and it changes nothing.
    Past,
    /// To end the walk.
    End,
}

/// What a walk tells while it goes. A State that is to be kept is shared, not copied.
pub trait Visitor {
    /// The kind of action, for nodes that do something of their own.
    fn action(&self) -> ActionKind {
        ActionKind::Other
    }

    /// A property was met that does something of its own in this kind of action.
    fn acted(&mut self) {}

    /// A node is reached, before it acts.
    ///
    /// # Errors
    ///
    /// Ends the walk.
    fn enter(&mut self, path: &Path, state: &Arc<State>) -> Result<Go, ActionError> {
        let _ = (path, state);
        Ok(Go::On)
    }

    /// A node was walked; the state is what it leaves behind.
    ///
    /// # Errors
    ///
    /// Ends the walk.
    fn leave(&mut self, path: &Path, state: &Arc<State>) -> Result<Go, ActionError> {
        let _ = (path, state);
        Ok(Go::On)
    }

    /// A shape is reached.
    ///
    /// # Errors
    ///
    /// Ends the walk.
    fn shape(&mut self, shape: &dyn ShapeNode, path: &Path, state: &Arc<State>) -> Result<Go, ActionError> {
        let _ = (shape, path, state);
        Ok(Go::On)
    }
}

struct Level<'s> {
    group: &'s dyn GroupNode,
    key: NodeKey,
    step: usize,
    saved: Option<Arc<State>>,
    /// The choice of the Switch before.
    switch: i32,
}

/// Walks the scene from its root. Of groups that choose among their children, `branches` says which are walked.
///
/// # Errors
///
/// What the visitor returns, [`ActionError::TooDeep`] or [`ActionError::TooLarge`].
pub fn walk(scene: &Scene, branches: Branches<'_>, visitor: &mut dyn Visitor) -> Result<(), ActionError> {
    walk_from(scene, &Path::default(), (scene.root(), 0), Arc::default(), branches, visitor)
}

/// [`walk`] from another node than the root: child number `index` at the end of `path`, reached with this state.
pub(crate) fn walk_from(
    scene: &Scene,
    path: &Path,
    start: (NodeKey, usize),
    mut state: Arc<State>,
    branches: Branches<'_>,
    visitor: &mut dyn Visitor,
) -> Result<(), ActionError> {
    let action = visitor.action();
    let mut path = path.clone();
    let mut stack: Vec<Level<'_>> = Vec::new();
    let mut next = Some(start);
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
            let mut go = visitor.enter(&path, &state)?;
            if go == Go::On {
                match scene.role(key) {
                    Some(Role::Property(property)) => {
                        property.apply(
                            Arc::make_mut(&mut state),
                            &PropertyContext { scene, key, path: &path, action, visit: visits },
                        );
                        if property.acts_on(action) {
                            visitor.acted();
                        }
                        go = visitor.leave(&path, &state)?;
                        path.pop();
                    }
                    Some(Role::Shape(shape)) => {
                        go = visitor.shape(shape, &path, &state)?;
                        if go != Go::End {
                            go = visitor.leave(&path, &state)?;
                        }
                        path.pop();
                    }
                    Some(Role::Group(group)) => {
                        let cx = GroupContext { scene, key, path: &path, entry: None, switch: state.switch, branches };
                        group.ready(&cx).map_err(|error| ActionError::shape(error, scene, &path, None))?;
                        let saved = (group.restores() != Restores::Nothing).then(|| Arc::clone(&state));
                        stack.push(Level { group, key, step: 0, saved, switch: state.switch });
                    }
                    None => {
                        path.pop();
                    }
                }
            } else {
                path.pop();
            }
            if go == Go::End {
                return Ok(());
            }
        }
        let Some(level) = stack.last_mut() else {
            return Ok(());
        };
        let children = scene.children(level.key);
        let (entry, switch) = (level.saved.as_ref(), level.switch);
        let cx = GroupContext { scene, key: level.key, path: &path, entry, switch, branches };
        let step = level.step;
        level.step += 1;
        match level.group.child_at(step, &cx, &mut state) {
            Some(index) => next = children.get(index).map(|&child| (child, index)),
            None => {
                let group = level.group;
                match (group.restores(), stack.pop().and_then(|level| level.saved)) {
                    (Restores::Everything, Some(saved)) => state = saved,
                    (Restores::Transform, Some(saved)) if !Arc::ptr_eq(&saved, &state) => {
                        let state = Arc::make_mut(&mut state);
                        (state.model, state.unit_length) = (saved.model, saved.unit_length)
                    }
                    _ => {}
                }
                if visitor.leave(&path, &state)? == Go::End {
                    return Ok(());
                }
                path.pop();
            }
        }
    }
}
