use super::GroupNode;
use crate::action::{GroupContext, ShapeError};

crate::define_node! {
    /// Another scene file in place.
    ///
    /// All actions walk the root of that file as the only child of a Group: what it changes acts on what follows, unless it is a
    /// Separator. Paths lead through the File to what is in it. Names of nodes, and of images, shaders and further files, mean what
    /// they mean in the file in which they stand; a search by name finds the nodes of all files. A file that is named more than once
    /// is read once, and shared. It can not show itself, in whatever way.
    ///
    /// A file is read with the scene that names it. Of one that is named in code, or by another name than before, actions say that
    /// it is not loaded until [`load_files`](crate::format::load_files) was called. Write keeps the name alone: what is changed in
    /// the nodes of the file in code is in no file.
    ///
    /// ```ron
    /// File(name: "trees/oak.ron")
    /// ```
    pub struct File: group {
        /// Name of the scene file, relative to the folder of the file in which it stands. Empty shows nothing.
        pub name: String = String::new(),
    }
    actions {
        Render, BoundingBox, RayPick, Search, Matrix, Callback, PrimitiveCount, HandleEvent:
            "walk what is in the file, as the child of a Group";
    }
}

impl GroupNode for File {
    fn ready(&self, cx: &GroupContext<'_>) -> Result<(), ShapeError> {
        if cx.scene.shown_name(cx.key) == self.name {
            Ok(())
        } else {
            Err(ShapeError::NotLoaded { name: self.name.clone() })
        }
    }
}
