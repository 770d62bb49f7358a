use std::sync::Arc;

use super::{FieldProblem, PropertyNode};
use crate::action::{Aspect, PropertyContext, State};

crate::define_node! {
    /// Roughens the light on the terrains that follow with an image of small heights that repeats over them.
    ///
    /// The slopes of the image, by central differences, are added to those of the map, and to those of a `NormalMap` if there is one
    /// too. It changes the light alone, not the shape, and costs nothing where there is none. Images are read like maps of heights:
    /// grey at its full depth, of colours the intensity. Read by the render action; the others ignore it.
    ///
    /// ```ron
    /// TextureUnit(unit: 8),
    /// Texture2(filename: "rocks.png"),
    /// BumpMap(size: 500.0, height: 12.0)
    /// ```
    pub struct BumpMap: property {
        /// Whether it acts; a node that is off takes an earlier one away.
        pub on: bool = true,
        /// The texture unit of the image.
        pub unit: u32 = 8,
        /// Length in local units that the image covers before it repeats; above 0.
        pub size: f64 = 1000.0,
        /// Difference of height between black and white, local units; below 0 black is high.
        pub height: f64 = 10.0,
    }
    actions {
        Render: "roughens the light on terrains that follow";
    }
    check |b: &BumpMap| {
        let mut problems = Vec::new();
        if !(b.size > 0.0 && b.size.is_finite()) {
            problems.push(FieldProblem::new("size", format!("{} does not work: a length above 0", b.size)));
        }
        if !b.height.is_finite() {
            problems.push(FieldProblem::new("height", format!("{} is not a finite number", b.height)));
        }
        problems
    };
}

impl PropertyNode for BumpMap {
    fn apply(&self, state: &mut State, cx: &PropertyContext<'_>) {
        // Without height it is as smooth as without the node.
        let acts = self.on && self.size > 0.0 && self.height != 0.0;
        state.bump_map = acts.then(|| Arc::new(self.clone()));
        state.credit(Aspect::BumpMap, cx);
    }

    fn moves_shapes(&self) -> bool {
        false
    }
}
