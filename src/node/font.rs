use std::path::PathBuf;
use std::sync::Arc;

use super::{FieldProblem, PropertyNode};
use crate::action::{FontBinding, PropertyContext, State};
use crate::scene::{DEFAULT_FONT, MOST_PIXELS, NodeKey, Scene};

crate::define_node! {
    /// The font of the text after it.
    ///
    /// Read by picks and render through the text, and by boxes that are told a view; a font that can not be had is an error of
    /// these. That its file is missing is told when the scene is read; what is in it, when text needs it first.
    ///
    /// ```ron
    /// Font(size: 24.0),
    /// Text2(string: "Fuji-san"),
    /// ```
    pub struct Font: property {
        /// "defaultFont", which is always there (Hack, all letters of one width: Latin, Greek and Cyrillic), or a file (TrueType or
        /// OpenType), relative to the folder of the file in which it stands.
        pub name: String = DEFAULT_FONT.to_owned(),
        /// The em in pixels, above 0 up to 1024. Points of Open Inventor's are pixels.
        pub size: f64 = 10.0,
    }
    actions {
        Render: "draws text in it";
        BoundingBox: "holds what text in it covers, if told the view";
        RayPick, HandleEvent: "meet the characters of text where it puts them";
    }
    check |font: &Font| {
        let mut problems = Vec::new();
        if !is_size(font.size) {
            let message = format!("{} does not work: pixels from above 0 to {MOST_PIXELS}", font.size);
            problems.push(FieldProblem::new("size", message));
        }
        if font.name.is_empty() {
            let message = format!("a font has a name: \"{DEFAULT_FONT}\", or that of a file (.ttf or .otf)");
            problems.push(FieldProblem::new("name", message));
        }
        problems
    };
}

/// Whether a font may have this size.
pub(super) fn is_size(size: f64) -> bool {
    size > 0.0 && size <= MOST_PIXELS
}

impl Font {
    /// The file that this node of a scene names; `None` for the font that is always there.
    pub(crate) fn file(&self, scene: &Scene, key: NodeKey) -> Option<PathBuf> {
        (self.name != DEFAULT_FONT).then(|| scene.resolve(key, &self.name))
    }
}

impl PropertyNode for Font {
    fn apply(&self, state: &mut State, cx: &PropertyContext<'_>) {
        let file = self.file(cx.scene, cx.key);
        state.font = Some(Arc::new(FontBinding { file, size: self.size, node: cx.key }));
    }
}
