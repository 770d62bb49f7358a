use serde::{Deserialize, Serialize};

use super::field::enum_field;
use super::{Color, FieldProblem, PropertyNode};
use crate::action::{Aspect, PropertyContext, State};

/// How shapes are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, Default)]
pub enum Style {
    /// Filled.
    #[default]
    Filled,
    /// Their edges alone, in the colours of the surface; what is behind shows between them.
    Lines,
    /// Filled, with their edges on top.
    FilledLines,
    /// Their corners alone, as squares.
    Points,
    /// Not at all. They can still be picked.
    Invisible,
}

enum_field!(Style: Filled | Lines | FilledLines | Points | Invisible);

crate::define_node! {
    /// Whether the shapes that follow are drawn filled, as a wire frame, both, or as points; and how large lines and points are.
    ///
    /// Read by the render action; the others ignore it. Edges are those of the triangles that are drawn, so that a terrain shows its
    /// detail. They are found in the fragment shader from the distance to the sides of the triangle: that gives any width,
    /// smooth, on every device, in the same draw as the faces. (Open Inventor's lines need a device that can draw
    /// polygons as lines, one pixel wide, and a second draw that fights the first for depth.) Corners are found the same way:
    /// of the square around a corner is drawn what lies on the faces.
    ///
    /// Sets of lines and points are lines and points in all styles but two: `Points` leaves of lines their points,
    /// `Invisible` nothing.
    ///
    /// ```ron
    /// DrawStyle(style: FilledLines, line_width: 1.5)
    /// ```
    pub struct DrawStyle: property {
        /// The style.
        pub style: Style = Style::Filled,
        /// Width of lines in pixels; above 0.
        pub line_width: f32 = 1.0,
        /// Width and height of points in pixels; above 0.
        pub point_size: f32 = 1.0,
        /// Colour of lines on filled faces, sRGB 0..1.
        pub line_color: Color = Color::new(0.1, 0.1, 0.1),
    }
    actions {
        Render: "draws what follows in this style";
    }
    check |d: &DrawStyle| {
        [("line_width", d.line_width), ("point_size", d.point_size)]
            .into_iter()
            .filter(|(_, v)| !(*v > 0.0 && v.is_finite()))
            .map(|(field, v)| FieldProblem::new(field, format!("{v} does not work: a number above 0")))
            .collect()
    };
}

impl PropertyNode for DrawStyle {
    fn apply(&self, state: &mut State, cx: &PropertyContext<'_>) {
        state.draw_style = self.clone();
        state.credit(Aspect::DrawStyle, cx);
    }

    fn moves_shapes(&self) -> bool {
        false
    }
}
