//! A terrain over heights made in code: a ripple, as floats in the units of the scene.
//!
//! ```text
//! cargo run --release --example heights_from_memory [FOLDER]
//! ```

use std::path::PathBuf;

use seamount::prelude::*;
use seamount::render::Headless;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).map_or_else(|| PathBuf::from("target"), PathBuf::from);

    // Row 0 is the north edge, column 0 the west edge.
    let side = 257u32;
    let heights = (0..side * side)
        .map(|i| {
            let (x, y) = ((i % side) as f32 / 256.0 - 0.5, (i / side) as f32 / 256.0 - 0.5);
            let r = (x * x + y * y).sqrt();
            (40.0 * r).cos() * (-6.0 * r).exp()
        })
        .collect();
    let image = Image::new(side, side, Pixels::GrayF32(heights))?;

    let mut scene = Scene::new();
    let root = scene.root();
    // No position: the camera stands where it sees everything.
    scene
        .add(root, PerspectiveCamera { orientation: AxisAngle::new(DVec3::X, 0.9), ..PerspectiveCamera::default() })?;
    scene.add(root, DirectionalLight { direction: DVec3::new(1.0, 0.5, -0.7), ..DirectionalLight::default() })?;
    scene.add(root, BaseColor { rgb: Color::new(0.35, 0.55, 0.75).into() })?;
    scene.add(root, Texture2::from_image(image))?;
    // Heights of 1 are 1 unit high on a ground of 10 units.
    scene.add(
        root,
        SeamlessTerrain {
            scale: 10.0,
            max_height: 1.0,
            detail: DetailMode::Precision(8.0),
            ..SeamlessTerrain::default()
        },
    )?;

    let down = Ray::new(DVec3::new(5.0, 5.0, 100.0), DVec3::NEG_Z)?;
    let hits = RayPickAction::ray(down).apply(&scene)?;
    println!("the middle is {:.3} high", hits.first().ok_or("no ground in the middle")?.point.z);

    let frame =
        RenderAction { background: Color::new(0.95, 0.95, 0.95), ..RenderAction::new(800, 500) }.apply(&scene)?;
    let path = folder.join("heights_from_memory.png");
    Headless::new(None)?.draw(&frame)?.save_png(&path)?;
    println!("{} triangles: {}", frame.statistics.triangles, path.display());
    Ok(())
}
