use std::sync::Arc;

use super::{ChildRule, GroupNode};
use crate::action::{Branches, GroupContext, State};

crate::define_node! {
    /// A group that shows one of its children, all or none.
    ///
    /// All actions walk what `which_child` shows, and so do searches unless they look for what is hidden as well. What the
    /// shown children change acts on what follows. Write and read keep all children.
    ///
    /// ```ron
    /// Switch(which_child: 1, children: [Cube(), Sphere()])
    /// ```
    pub struct Switch: group(ChildRule::ANY) {
        /// Number of the child, from 0; −1: none; −2: that of the Switch before this one, or the number of the copy inside
        /// an Array or MultipleCopy, modulo the number of children; −3: all. A number beyond the children shows none.
        pub which_child: i32 = Switch::NONE,
    }
    actions {
        Render, BoundingBox, RayPick, Search, Matrix, Callback, PrimitiveCount, HandleEvent:
            "walk the children that it shows; a search for what is hidden walks all";
    }
    check |s: &Switch| {
        if s.which_child < Switch::ALL {
            let message = format!("{} is no choice: a child from 0, -1 for none, -2 inherited or -3 for all", s.which_child);
            vec![super::FieldProblem::new("which_child", message)]
        } else {
            Vec::new()
        }
    };
}

impl Switch {
    /// No child.
    pub const NONE: i32 = -1;
    /// The choice of the Switch before, or the number of the copy.
    pub const INHERIT: i32 = -2;
    /// All children.
    pub const ALL: i32 = -3;
}

impl GroupNode for Switch {
    fn child_at(&self, step: usize, cx: &GroupContext<'_>, state: &mut Arc<State>) -> Option<usize> {
        let count = cx.children();
        let inherited = self.which_child == Switch::INHERIT;
        if step == 0 && !inherited {
            Arc::make_mut(state).switch = self.which_child;
        }
        if matches!(cx.branches, Branches::All) {
            return (step < count).then_some(step);
        }
        let which = if inherited { cx.switch } else { self.which_child };
        match usize::try_from(which) {
            Ok(which) if inherited => (step == 0 && count > 0).then(|| which % count),
            Ok(which) => (step == 0 && which < count).then_some(which),
            Err(_) => (which == Switch::ALL && step < count).then_some(step),
        }
    }
}
