use super::PropertyNode;
use crate::action::{PropertyContext, State};

crate::define_node! {
    /// Text for people who read the scene file. All actions ignore it; write keeps it. As a child it stands for nothing.
    ///
    /// ```ron
    /// Info(string: "Surveyed in 2007")
    /// ```
    pub struct Info: property {
        /// The text.
        pub string: String = "<Undefined info>".to_owned(),
    }
    actions {}
}

impl PropertyNode for Info {
    fn apply(&self, _: &mut State, _: &PropertyContext<'_>) {}

    fn moves_shapes(&self) -> bool {
        false
    }
}

crate::define_node! {
    /// A word that programs find again, as a name that need not be unique. All actions ignore it; write keeps it.
    ///
    /// ```ron
    /// Label(label: "summit")
    /// ```
    pub struct Label: property {
        /// The word.
        pub label: String = "<Undefined label>".to_owned(),
    }
    actions {}
}

impl PropertyNode for Label {
    fn apply(&self, _: &mut State, _: &PropertyContext<'_>) {}

    fn moves_shapes(&self) -> bool {
        false
    }
}
