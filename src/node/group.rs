use super::{ChildRule, GroupNode};

crate::define_node! {
    /// A group whose children change the State for what follows the group as well.
    ///
    /// Defaults: no fields. All actions walk all children in order. Use [`Separator`](crate::node::Separator) unless the
    /// changes are meant to leave the group; forgetting this is the usual mistake.
    ///
    /// ```ron
    /// Group(children: [Translation(translation: (0.0, 0.0, 10.0))])
    /// ```
    pub struct Group: group(ChildRule::ANY) {}
}

impl GroupNode for Group {}
