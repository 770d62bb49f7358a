use std::sync::Arc;

use glam::DVec3;

use super::{ChildRule, FieldProblem, GroupNode, List, Restores};
use crate::action::{Branches, GroupContext, State};

/// The child to walk when one level of detail is chosen by what is seen, or all of them are walked, each from the state
/// before the group.
fn level_at(
    step: usize,
    cx: &GroupContext<'_>,
    state: &mut Arc<State>,
    choose: impl FnOnce(&crate::action::Viewpoint, &Arc<State>) -> usize,
) -> Option<usize> {
    let count = cx.children();
    match cx.branches {
        Branches::Seen(view) => {
            (step == 0 && count > 0).then(|| view.map_or(0, |view| choose(view, state)).min(count - 1))
        }
        Branches::All | Branches::Possible => {
            if let Some(entry) = cx.entry.filter(|_| step > 0) {
                state.clone_from(entry);
            }
            (step < count).then_some(step)
        }
    }
}

crate::define_node! {
    /// A group that shows one of its children, chosen by the distance of the eye: the finest first.
    ///
    /// Render, picks, callbacks and counts walk the child that is seen, without a camera the first; boxes and searches all of
    /// them, each as if it were the only one. The State is restored afterwards. To show nothing far away, let the last
    /// child be an `Info`.
    ///
    /// ```ron
    /// Lod(range: [100.0, 1000.0], children: [Sphere(), Cube(), Info()])
    /// ```
    pub struct Lod: group(ChildRule::ANY) {
        /// The point whose distance counts, local coordinates.
        pub center: DVec3 = DVec3::ZERO,
        /// Distances in units of the world: the first child is seen nearer than the first, the second nearer than the
        /// second, and so on. Children beyond the one after the last distance are never seen.
        pub range: List<f64> = List::default(),
    }
    actions {
        Render, RayPick, Callback, PrimitiveCount: "walk the child that is seen; without a camera the first";
        BoundingBox, Search, Matrix, HandleEvent: "walk all children, each as if it were the only one";
    }
    check |l: &Lod| {
        if l.range.windows(2).all(|pair| pair[0] <= pair[1]) {
            Vec::new()
        } else {
            vec![FieldProblem::new("range", "the distances have to rise: a child is seen nearer than its distance")]
        }
    };
}

impl GroupNode for Lod {
    fn child_at(&self, step: usize, cx: &GroupContext<'_>, state: &mut Arc<State>) -> Option<usize> {
        level_at(step, cx, state, |view, state| {
            let distance = (state.model.transform_point3(self.center) - view.eye).length();
            self.range.iter().position(|&range| distance < range).unwrap_or(self.range.len())
        })
    }

    fn restores(&self) -> Restores {
        Restores::Everything
    }

    fn looks_at_camera(&self) -> bool {
        true
    }
}

crate::define_node! {
    /// A group that shows one of its children, chosen by its size in the picture: the finest first.
    ///
    /// The size is that of the rectangle around the box of all children, in pixels, multiplied by `Complexity.value` + 0.5;
    /// at a value of 1 it is always the first child, at 0 the last. Render, picks, callbacks and counts walk the child that
    /// is seen, without a camera the first; boxes and searches all of them, each as if it were the only one. The State is
    /// restored afterwards.
    ///
    /// ```ron
    /// LevelOfDetail(screen_area: [10000.0, 100.0], children: [Sphere(), Cube(), Info()])
    /// ```
    pub struct LevelOfDetail: group(ChildRule::ANY) {
        /// Areas in pixels: the first child is seen when it is larger than the first, the second when larger than the
        /// second, and so on; the last child when smaller than all.
        pub screen_area: List<f64> = List::from([0.0]),
    }
    actions {
        Render, RayPick, Callback, PrimitiveCount: "walk the child that is seen; without a camera the first";
        BoundingBox, Search, Matrix, HandleEvent: "walk all children, each as if it were the only one";
    }
}

impl GroupNode for LevelOfDetail {
    fn child_at(&self, step: usize, cx: &GroupContext<'_>, state: &mut Arc<State>) -> Option<usize> {
        level_at(step, cx, state, |view, state| {
            let complexity = state.complexity.value;
            if complexity <= 0.0 {
                return usize::MAX;
            }
            if complexity >= 1.0 || self.screen_area.is_empty() {
                return 0;
            }
            // A shape that can not be boxed tells why when its level is walked.
            let Ok(bounds) = crate::action::bounds_below(cx, state) else { return 0 };
            let area = bounds.map_or(0.0, |bounds| view.area_of(&bounds)) * (complexity + 0.5);
            self.screen_area.iter().position(|&limit| area > limit).unwrap_or(usize::MAX)
        })
    }

    fn restores(&self) -> Restores {
        Restores::Everything
    }

    fn looks_at_camera(&self) -> bool {
        true
    }
}
