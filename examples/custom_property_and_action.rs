//! A property of your own in the State of a walk, and an action of your own that asks for it: what does it all weigh?
//!
//! `cargo run --example custom_property_and_action -- FOLDER` writes the scene to FOLDER.

use std::sync::Arc;

use seamount::action::walk::{Go, Visitor, walk};
use seamount::action::{ActionError, Branches, PropertyContext, ShapeContext, State};
use seamount::define_node;
use seamount::format::{parse, save_scene};
use seamount::node::{FieldProblem, PropertyNode, Registry, ShapeNode};
use seamount::prelude::*;

define_node! {
    /// What the shapes that follow are made of. Read by [`WeightAction`].
    ///
    /// ```ron
    /// Density(density: 2700.0)
    /// ```
    pub struct Density: property {
        /// Mass per volume, from 0 up.
        pub density: f64 = 1000.0,
    }
    check |d: &Density| match d.density >= 0.0 {
        true => Vec::new(),
        false => vec![FieldProblem::new("density", format!("{} is negative: nothing weighs less than nothing", d.density))],
    };
}

/// The density in force at a place of the graph.
#[derive(Debug, Clone, Copy)]
struct CurrentDensity(f64);

impl PropertyNode for Density {
    fn apply(&self, state: &mut State, _: &PropertyContext<'_>) {
        // Restored at the end of a Separator like everything else in the State.
        state.set(CurrentDensity(self.density));
    }

    fn moves_shapes(&self) -> bool {
        false
    }
}

/// The mass of all shapes, taken as closed surfaces.
#[derive(Debug, Default)]
struct WeightAction {}

impl WeightAction {
    fn apply(&self, scene: &Scene) -> Result<f64, ActionError> {
        struct Weigh<'s> {
            scene: &'s Scene,
            mass: f64,
        }
        impl Visitor for Weigh<'_> {
            fn shape(&mut self, shape: &dyn ShapeNode, path: &Path, state: &Arc<State>) -> Result<Go, ActionError> {
                let density = state.get::<CurrentDensity>().map_or(1000.0, |d| d.0);
                let mut volume = 0.0;
                let cx = ShapeContext::new(self.scene, state, path);
                // The divergence theorem: the tetrahedra from the origin to all triangles, with their signs.
                let primitives = shape.primitives(&cx, &mut |t| {
                    let [a, b, c] = t.points;
                    volume += a.dot(b.cross(c)) / 6.0;
                });
                primitives.map_err(|e| cx.error(e))?;
                self.mass += volume * state.model.matrix3.determinant().abs() * density;
                Ok(Go::On)
            }
        }
        let mut weigh = Weigh { scene, mass: 0.0 };
        walk(scene, Branches::Seen(None), &mut weigh)?;
        Ok(weigh.mass)
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| ".".to_owned());
    let mut registry = Registry::default();
    registry.register::<Density>();
    let text = "Scene(version: 1, root: Separator(children: [
        Separator(children: [
            Density(density: 2.0),
            Scale(scale_factor: (1.0, 1.0, 3.0)),
            Cube(),
        ]),
        Cube(width: 1.0, height: 1.0, depth: 1.0),
    ]))";
    let scene = parse(text, &registry)?;
    let mass = WeightAction::default().apply(&scene)?;
    assert!((mass - (2.0 * 24.0 + 1000.0)).abs() < 1e-9);
    println!("{mass} in all");
    let path = std::path::Path::new(&folder).join("weights.ron");
    save_scene(&scene, &path)?;
    println!("written to {}", path.display());
    Ok(())
}
