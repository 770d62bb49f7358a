//! Builds the scene of Mount Fuji in code, asks it for its box and for the ground under the middle of the picture, and
//! draws it without a window.
//!
//! ```text
//! cargo run --release --example build_scene [FOLDER]
//! ```

use std::path::PathBuf;

use seamount::format::write_scene;
use seamount::prelude::*;
use seamount::render::Headless;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).map_or_else(|| PathBuf::from("target"), PathBuf::from);

    let mut scene = Scene::new();
    // File names in a scene are relative to the scene's file, whether that exists or not.
    scene.set_source(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/built.ron"));
    let root = scene.root();
    scene.add(
        root,
        PerspectiveCamera {
            position: Some(DVec3::new(72_000.0, -28_000.0, 13_000.0)),
            look_at: Some(DVec3::new(65_500.0, 41_000.0, 1_200.0)),
            height_angle: 0.5,
            ..PerspectiveCamera::default()
        },
    )?;
    scene.add(root, DirectionalLight { direction: DVec3::new(1.0, 0.4, -0.6), ..DirectionalLight::default() })?;
    scene.add(root, Material { diffuse_color: Color::new(0.9, 0.9, 0.85).into(), ..Material::default() })?;
    let ground = scene.add(root, Separator::default())?;
    scene.set_name(ground, "ground")?;
    scene.add(ground, Complexity { texture_quality: 1.0, ..Complexity::default() })?;
    scene.add(ground, TextureUnit { unit: 0 })?;
    scene.add(ground, Texture2 { filename: "fuji.png".into(), ..Texture2::default() })?;
    let terrain = scene.add(
        ground,
        SeamlessTerrain {
            // 1201 × 1201 samples of 3 seconds of arc; metres are value − 1000, 0 is a void.
            size: Some(DVec2::new(90_600.0, 111_240.0)),
            max_height: 65_535.0,
            base_height: -1_000.0,
            void_sample: Some(0.0),
            detail: DetailMode::Precision(4.0),
            ..SeamlessTerrain::default()
        },
    )?;

    let bounds = BoundingBoxAction::default().apply(&scene)?.ok_or("the scene is empty")?;
    println!("box: {} .. {}", bounds.min, bounds.max);

    let hits = RayPickAction::pixel(640, 360, [1280, 720]).apply(&scene)?;
    let hit = hits.first().ok_or("nothing in the middle of the picture")?;
    let bound = hit.error_bound.unwrap_or(f64::INFINITY);
    println!("middle of the picture: {:.0} at {:.0} m, height within ± {bound:.0} m", hit.point, hit.distance);

    let frame =
        RenderAction { background: Color::new(0.75, 0.84, 0.93), ..RenderAction::new(1280, 720) }.apply(&scene)?;
    println!("{} triangles in {} draw calls", frame.statistics.triangles, frame.statistics.draw_calls);
    let mut headless = Headless::new(None)?;
    let path = folder.join("build_scene.png");
    headless.draw(&frame)?.save_png(&path)?;
    println!("drawn by {}: {}", headless.adapter().name, path.display());

    // Edits go through a guard; the next answer is current.
    if let Some(mut terrain) = scene.edit::<SeamlessTerrain>(terrain) {
        terrain.max_height *= 2.0;
        terrain.base_height *= 2.0;
    }
    let taller = BoundingBoxAction::default().apply(&scene)?.ok_or("the scene is empty")?;
    println!("twice as tall: {} .. {}", taller.min, taller.max);

    // The same scene as a file.
    println!("{}", write_scene(&scene)?);
    Ok(())
}
