use serde::{Deserialize, Serialize};

use super::{List, PropertyNode, Style, field::enum_field};
use crate::action::{Aspect, PropertyContext, State};

/// A way in which faces are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum OffsetStyle {
    /// Filled, with edges or without.
    Filled,
    /// As edges alone.
    Lines,
    /// As corners alone.
    Points,
}

enum_field!(OffsetStyle: Filled | Lines | Points);

crate::define_node! {
    /// Moves the faces that follow back in depth, so that lines and other faces in the same place are seen in front of them.
    ///
    /// Read by the render action; the others ignore it. Lines and points stay where they are. The faces are drawn where they
    /// were, but their depth is larger by `factor` times their slope (depth per pixel) and `units` times the smallest
    /// difference that depth can tell there. Negative numbers move them forward.
    ///
    /// ```ron
    /// PolygonOffset(factor: 1.0, units: 4.0)
    /// ```
    pub struct PolygonOffset: property {
        /// Multiplies the slope.
        pub factor: f32 = 1.0,
        /// Multiplies the smallest difference of depth; rounded to a whole number.
        pub units: f32 = 1.0,
        /// The styles in which faces are moved.
        pub styles: List<OffsetStyle> = List::from([OffsetStyle::Filled]),
        /// Whether they are moved at all.
        pub on: bool = true,
    }
    actions {
        Render: "draws the faces of what follows deeper than they are";
    }
}

impl PolygonOffset {
    /// Whether faces in a style are moved.
    pub(crate) fn moves(&self, style: Style) -> bool {
        let style = match style {
            Style::Filled | Style::FilledLines => OffsetStyle::Filled,
            Style::Lines => OffsetStyle::Lines,
            Style::Points => OffsetStyle::Points,
            Style::Invisible => return false,
        };
        self.styles.contains(&style)
    }
}

impl PropertyNode for PolygonOffset {
    fn apply(&self, state: &mut State, cx: &PropertyContext<'_>) {
        state.credit(Aspect::PolygonOffset, cx);
        state.polygon_offset = self.on.then(|| self.clone());
    }

    fn moves_shapes(&self) -> bool {
        false
    }
}
