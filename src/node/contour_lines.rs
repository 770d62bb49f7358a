use std::sync::Arc;

use super::{Color, FieldProblem, PropertyNode};
use crate::action::{Aspect, PropertyContext, State};

crate::define_node! {
    /// Draws lines of equal height on the terrains that follow.
    ///
    /// Read by the render action; the others ignore it. Lines are of one width on the screen, whatever the slope, and smooth;
    /// where they come closer than about four pixels they fade into the mean of what they cover. Level ground that lies just at
    /// the height of a line has none. They are ink: light does not change their colour.
    ///
    /// ```ron
    /// ContourLines(interval: 200.0)
    /// ```
    pub struct ContourLines: property {
        /// Whether there are lines; a node that is off takes earlier ones away.
        pub on: bool = true,
        /// Difference of height from line to line, in local z; above 0. One of them is at height 0.
        pub interval: f64 = 100.0,
        /// Width in pixels; above 0.
        pub width: f32 = 1.0,
        /// Colour, sRGB 0..1.
        pub color: Color = Color::new(0.35, 0.22, 0.12),
    }
    actions {
        Render: "draws them on terrains that follow";
    }
    check |c: &ContourLines| {
        [("interval", c.interval), ("width", c.width.into())]
            .into_iter()
            .filter(|(_, v)| !(*v > 0.0 && v.is_finite()))
            .map(|(field, v)| FieldProblem::new(field, format!("{v} does not work: a number above 0")))
            .collect()
    };
}

impl PropertyNode for ContourLines {
    fn apply(&self, state: &mut State, cx: &PropertyContext<'_>) {
        state.contour_lines = (self.on && self.interval > 0.0).then(|| Arc::new(self.clone()));
        state.credit(Aspect::ContourLines, cx);
    }

    fn moves_shapes(&self) -> bool {
        false
    }
}
