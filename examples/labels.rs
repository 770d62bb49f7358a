//! Labels on the summits of a landscape: text faces the viewer and keeps its size, and a click tells which letter it meets.
//!
//! `cargo run --example labels -- FOLDER` writes the scene to FOLDER.

use std::path::PathBuf;

use seamount::action::PickTarget;
use seamount::format::save_scene;
use seamount::node::HitDetail;
use seamount::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut scene = Scene::new();
    let root = scene.root();
    let (position, look_at) = (Some(DVec3::new(50.0, -90.0, 60.0)), Some(DVec3::new(50.0, 50.0, 5.0)));
    scene.add(root, PerspectiveCamera { position, look_at, ..PerspectiveCamera::default() })?;
    scene.add(root, Cube { width: 300.0, height: 300.0, depth: 0.1 })?;
    scene.add(root, Font { size: 20.0, ..Font::default() })?;
    scene.add(root, Material { diffuse_color: Color::new(1.0, 0.9, 0.4).into(), ..Material::default() })?;
    for (name, summit) in [("West", DVec3::new(20.0, 40.0, 12.0)), ("East", DVec3::new(80.0, 60.0, 18.0))] {
        let place = scene.add(root, Separator::default())?;
        scene.add(place, Translation { translation: summit })?;
        let string = [name.to_owned(), format!("{:.0} m", summit.z)].into();
        scene.add(place, Text2 { string, justification: Justification::Center, ..Text2::default() })?;
    }

    // All letters that a row of the picture meets, from left to right.
    let size = [640, 400];
    let mut met = String::new();
    let mut last = None;
    for x in 0..size[0] {
        let target = PickTarget::Pixel(f64::from(x) + 0.5, 184.5);
        let hits = RayPickAction { target, ..RayPickAction::pixel(0, 0, size) }.apply(&scene)?;
        let Some((hit, HitDetail::Text(detail))) = hits.first().map(|hit| (hit, hit.detail)) else { continue };
        let text = hit.node().and_then(|node| scene.get::<Text2>(node));
        let letter = text.and_then(|text| text.string.get(detail.string)?.chars().nth(detail.character));
        if last != Some((hit.node(), detail)) {
            met.extend(letter);
        }
        last = Some((hit.node(), detail));
    }
    println!("row 184 shows: {met}");

    let folder = std::env::args().nth(1).map_or_else(std::env::temp_dir, PathBuf::from);
    let file = folder.join("labels.ron");
    save_scene(&scene, &file)?;
    println!("{}", file.display());
    Ok(())
}
