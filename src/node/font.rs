use std::sync::Arc;

use super::{FieldProblem, PropertyNode};
use crate::action::{FontBinding, PropertyContext, State};
use crate::scene::{DEFAULT_FONT, MOST_PIXELS};

crate::define_node! {
    /// The font of the text after it.
    ///
    /// Read by picks, render and boxes through the text; a font that can not be had is an error of these. It is read from its file
    /// when text needs it first.
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

impl PropertyNode for Font {
    fn apply(&self, state: &mut State, cx: &PropertyContext<'_>) {
        let file = (self.name != DEFAULT_FONT).then(|| cx.scene.resolve(cx.key, &self.name));
        state.font = Some(Arc::new(FontBinding { file, size: self.size, node: cx.key }));
    }
}
