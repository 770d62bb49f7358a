use std::sync::Arc;

use super::{Color, PropertyNode};
use crate::action::{PropertyContext, State};

crate::define_node! {
    /// What is behind everything: a colour, or a sky whose colour goes from the horizon to the zenith.
    ///
    /// Open Inventor leaves the background to the viewer, so that the same scene looks different elsewhere; here a scene may
    /// say what belongs to it, as VRML does with a node of the same name. Of several the first in the scene is used, as with
    /// cameras, wherever it stands. Read by the render action, whose own background colour it replaces; the others ignore it.
    ///
    /// A plain colour costs nothing. The sky takes a shader and a triangle of its own; it changes with the sine of the
    /// elevation above the horizontal (world z points up) and is `color` from there down. Parallel rays all see one place of
    /// it.
    ///
    /// ```ron
    /// Background(color: (0.85, 0.9, 0.95), zenith: (0.3, 0.5, 0.8))
    /// ```
    pub struct Background: property {
        /// Colour, sRGB 0..1; of a sky that at and below the horizon.
        pub color: Color = Color::BLACK,
        /// Colour of the sky straight above. None: `color` everywhere.
        pub zenith: Option<Color> = None,
    }
    actions {
        Render: "puts it behind everything";
    }
}

impl PropertyNode for Background {
    fn apply(&self, state: &mut State, _: &PropertyContext<'_>) {
        state.background = Some(Arc::new(self.clone()));
    }

    fn moves_shapes(&self) -> bool {
        false
    }
}
