use std::sync::Arc;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::{ChildRule, GroupNode, List, Matrix, Restores, field::enum_field};
use crate::action::{GroupContext, State};

/// Which of the copies of an [`Array`] stands where the array stands, per direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum ArrayOrigin {
    /// The first.
    #[default]
    First,
    /// The middle, between two copies if their number is even.
    Center,
    /// The last.
    Last,
}

enum_field!(ArrayOrigin: First | Center | Last);

/// The child to walk when all children are walked once per copy, each copy from the state before the group. `place` is
/// called when a copy begins.
fn copy_at(
    step: usize,
    copies: usize,
    cx: &GroupContext<'_>,
    state: &mut Arc<State>,
    place: impl FnOnce(usize, &mut State),
) -> Option<usize> {
    let count = cx.children();
    let copy = step.checked_div(count).filter(|&copy| copy < copies)?;
    let child = step % count;
    if child == 0 {
        if let Some(entry) = cx.entry {
            state.clone_from(entry);
        }
        let state = Arc::make_mut(state);
        state.switch = i32::try_from(copy).unwrap_or(i32::MAX);
        place(copy, state);
    }
    Some(child)
}

crate::define_node! {
    /// Copies of its children in a row, a grid or a block.
    ///
    /// All actions walk the children once per copy, each from the State before the array, which is restored afterwards. The
    /// number of the copy is what a [`Switch`](crate::node::Switch) inside inherits. A path to a child means all its copies.
    ///
    /// ```ron
    /// Array(num_elements1: 10, separation1: (3.0, 0.0, 0.0), children: [Cube()])
    /// ```
    pub struct Array: group(ChildRule::ANY) {
        /// Which copy stands at the array's own place.
        pub origin: ArrayOrigin = ArrayOrigin::First,
        /// Number of copies in the first direction, the one that is counted first.
        pub num_elements1: u32 = 1,
        /// Number of copies in the second direction.
        pub num_elements2: u32 = 1,
        /// Number of copies in the third direction.
        pub num_elements3: u32 = 1,
        /// From one copy to the next in the first direction, local units.
        pub separation1: DVec3 = DVec3::X,
        /// From one copy to the next in the second direction, local units.
        pub separation2: DVec3 = DVec3::Y,
        /// From one copy to the next in the third direction, local units.
        pub separation3: DVec3 = DVec3::Z,
    }
    actions {
        Render, BoundingBox, RayPick, Search, Matrix, Callback, PrimitiveCount, HandleEvent:
            "walk the children once per copy";
    }
}

impl GroupNode for Array {
    fn child_at(&self, step: usize, cx: &GroupContext<'_>, state: &mut Arc<State>) -> Option<usize> {
        let [a, b, c] = [self.num_elements1, self.num_elements2, self.num_elements3].map(|n| n as usize);
        let copies = a.saturating_mul(b).saturating_mul(c);
        copy_at(step, copies, cx, state, |copy, state| {
            let place = |index: usize, count: usize| {
                let origin = match self.origin {
                    ArrayOrigin::First => 0.0,
                    ArrayOrigin::Center => (count as f64 - 1.0) * 0.5,
                    ArrayOrigin::Last => count as f64 - 1.0,
                };
                index as f64 - origin
            };
            state.translate(
                self.separation1 * place(copy % a, a)
                    + self.separation2 * place(copy / a % b, b)
                    + self.separation3 * place(copy / a / b, c),
            );
        })
    }

    fn restores(&self) -> Restores {
        Restores::Everything
    }
}

crate::define_node! {
    /// Copies of its children, each placed by a matrix.
    ///
    /// All actions walk the children once per matrix, each time from the State before the group, which is restored
    /// afterwards. The number of the copy is what a [`Switch`](crate::node::Switch) inside inherits. A path to a child means
    /// all its copies.
    ///
    /// ```ron
    /// MultipleCopy(
    ///     matrix: [((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (5.0, 0.0, 0.0))],
    ///     children: [Cube()],
    /// )
    /// ```
    pub struct MultipleCopy: group(ChildRule::ANY) {
        /// One matrix per copy, from the copy's coordinates to those of the group.
        pub matrix: List<Matrix> = List::from([Matrix::IDENTITY]),
    }
    actions {
        Render, BoundingBox, RayPick, Search, Matrix, Callback, PrimitiveCount, HandleEvent:
            "walk the children once per copy";
    }
}

impl GroupNode for MultipleCopy {
    fn child_at(&self, step: usize, cx: &GroupContext<'_>, state: &mut Arc<State>) -> Option<usize> {
        copy_at(step, self.matrix.len(), cx, state, |copy, state| {
            if let Some(Matrix(map)) = self.matrix.get(copy) {
                state.transform(map);
            }
        })
    }

    fn restores(&self) -> Restores {
        Restores::Everything
    }
}
