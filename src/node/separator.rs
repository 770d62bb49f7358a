use super::{ChildRule, GroupNode};

crate::define_node! {
    /// A group that keeps what its children change to itself: after it the State is what it was before.
    ///
    /// Defaults: no fields. A light, material or transform inside acts up to the end of the separator and no further.
    /// All actions walk all children in order.
    pub struct Separator: group(ChildRule::ANY) {}
}

impl GroupNode for Separator {
    fn restores_state(&self) -> bool {
        true
    }
}
