use super::{ChildRule, GroupNode, Restores};

crate::define_node! {
    /// A group that keeps what its children change to itself: after it the State is what it was before.
    ///
    /// Defaults: no fields. A light, material or transform inside acts up to the end of the separator and no further.
    /// All actions walk all children in order.
    ///
    /// ```ron
    /// Separator(children: [Translation(translation: (0.0, 0.0, 10.0)), Cube()])
    /// ```
    pub struct Separator: group(ChildRule::ANY) {}
}

impl GroupNode for Separator {
    fn restores(&self) -> Restores {
        Restores::Everything
    }
}

crate::define_node! {
    /// A group that keeps the transforms of its children to itself; all else that they change acts on what follows.
    ///
    /// For lights and cameras that have a place of their own and shall reach beyond the group. Defaults: no fields. All
    /// actions walk all children in order.
    ///
    /// ```ron
    /// TransformSeparator(children: [Translation(translation: (0.0, 0.0, 100.0)), PointLight()])
    /// ```
    pub struct TransformSeparator: group(ChildRule::ANY) {}
}

impl GroupNode for TransformSeparator {
    fn restores(&self) -> Restores {
        Restores::Transform
    }
}
