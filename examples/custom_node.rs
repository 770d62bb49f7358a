//! A shape of your own from two functions: it is drawn, boxed, picked, read and written like those of the crate.
//!
//! `cargo run --example custom_node -- FOLDER` writes the scene to FOLDER.

use glam::DVec2;
use seamount::action::{ShapeContext, ShapeError};
use seamount::define_node;
use seamount::format::{parse, save_scene};
use seamount::node::{FieldProblem, Registry, ShapeNode, Triangle};
use seamount::prelude::*;

define_node! {
    /// A pyramid on a square, its base in the plane z = 0.
    ///
    /// ```ron
    /// Pyramid(side: 230.0, height: 146.6)
    /// ```
    pub struct Pyramid: shape {
        /// Length of the sides of the base, local units, from 0 up.
        pub side: f64 = 2.0,
        /// Height of the tip, local units.
        pub height: f64 = 1.0,
    }
    check |p: &Pyramid| match p.side >= 0.0 {
        true => Vec::new(),
        false => vec![FieldProblem::new("side", format!("{} does not work: lengths go from 0 up", p.side))],
    };
}

impl ShapeNode for Pyramid {
    fn bounds(&self, _: &ShapeContext<'_>) -> Result<Option<Aabb>, ShapeError> {
        let half = self.side / 2.0;
        Ok(Some(Aabb {
            min: DVec3::new(-half, -half, self.height.min(0.0)),
            max: DVec3::new(half, half, self.height.max(0.0)),
        }))
    }

    fn primitives(&self, _: &ShapeContext<'_>, sink: &mut dyn FnMut(Triangle)) -> Result<(), ShapeError> {
        let half = self.side / 2.0;
        let base = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 0.0) * half);
        let tip = DVec3::Z * self.height;
        let mut triangle = |points: [DVec3; 3]| {
            let normal = (points[1] - points[0]).cross(points[2] - points[0]).normalize_or(DVec3::Z);
            sink(Triangle {
                points,
                normals: [normal; 3],
                uvs: points.map(|p| DVec2::new(p.x, p.y) / self.side + 0.5),
                ..Triangle::default()
            });
        };
        for k in 0..4 {
            triangle([base[k], base[(k + 1) % 4], tip]);
        }
        triangle([base[0], base[2], base[1]]);
        triangle([base[0], base[3], base[2]]);
        Ok(())
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| ".".to_owned());

    // One line, and scene files may contain it.
    let mut registry = Registry::default();
    registry.register::<Pyramid>();
    let text = "Scene(version: 1, root: Separator(children: [
        PerspectiveCamera(),
        Translation(translation: (10.0, 0.0, 0.0)),
        Pyramid(side: 4.0, height: 3.0),
    ]))";
    let scene = parse(text, &registry)?;

    // Boxed, drawn, and picked on its own triangles.
    let bounds = BoundingBoxAction::default().apply(&scene)?.ok_or("empty")?;
    assert_eq!(bounds.max, DVec3::new(12.0, 2.0, 3.0));
    let frame = RenderAction::new(320, 240).apply(&scene)?;
    assert_eq!(frame.statistics.triangles, 6);
    let hits = RayPickAction::ray(Ray::new(DVec3::new(11.0, 0.5, 50.0), DVec3::NEG_Z)?).apply(&scene)?;
    assert_eq!(hits[0].point, DVec3::new(11.0, 0.5, 1.5));
    println!("picked {} on {}", hits[0].point, hits[0].path.names(&scene).join("/"));

    // Mistakes are told as for the crate's own nodes.
    let wrong = parse(&text.replace("side", "sied"), &registry).expect_err("a misspelt field");
    println!("{wrong}");
    assert!(wrong.to_string().contains("did you mean `side`?"));

    let path = std::path::Path::new(&folder).join("pyramid.ron");
    save_scene(&scene, &path)?;
    let again = seamount::format::read_scene_with(&path, &registry)?;
    assert_eq!(BoundingBoxAction::default().apply(&again)?, Some(bounds));
    println!("written to {}", path.display());
    Ok(())
}
