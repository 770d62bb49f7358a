//! What each effect costs: a base scene, the base with each effect alone, and with all of them. Run with
//! `cargo bench --bench effects`; prints a table of frame time, size of the shader and bytes on the graphics card.
//!
//! Times are medians of many frames on one device, the variants in turn so that a busy machine slows all of them alike.
#![allow(missing_docs, reason = "a program")]

use std::sync::Arc;
use std::time::Instant;

use seamount::prelude::*;
use seamount::render::Headless;

const SIZE: [u32; 2] = [1280, 720];

type Nodes = fn(&mut Scene, NodeKey);

fn add(scene: &mut Scene, root: NodeKey, node: impl Node) {
    scene.add(root, node).expect("the root takes any node");
}

fn rgba(width: u32, height: u32, texel: impl Fn(u32) -> [u8; 4]) -> Image {
    let texels = (0..width * height).map(texel).collect();
    Image::new(width, height, Pixels::Rgba8(texels)).expect("as many texels as the image has")
}

/// Effects by themselves. Attenuation and highlights need a light to act on, which is counted with them.
const EFFECTS: &[(&str, Nodes)] = &[
    ("directional light", |s, r| {
        add(s, r, DirectionalLight { direction: DVec3::new(0.8, 0.75, -0.75), ..Default::default() });
    }),
    ("point light", |s, r| {
        add(s, r, PointLight { location: DVec3::new(65_000.0, 30_000.0, 9_000.0), ..Default::default() });
    }),
    ("spot light", |s, r| {
        add(s, r, SpotLight { location: DVec3::new(65_000.0, 30_000.0, 9_000.0), ..Default::default() });
    }),
    ("fog", |s, r| {
        add(s, r, Environment { fog_type: FogType::Fog, fog_visibility: 90_000.0, ..Default::default() });
    }),
    ("sky", |s, r| {
        add(s, r, Background { color: Color::new(0.8, 0.9, 1.0), zenith: Some(Color::new(0.3, 0.5, 0.8)) });
    }),
    ("colour map", |s, r| {
        add(s, r, TextureUnit { unit: 1 });
        add(s, r, Texture2::from_image(rgba(1024, 1024, |i| [(i >> 3) as u8, (i >> 13) as u8, 128, 255])));
    }),
    ("height ramp", |s, r| add(s, r, ColorRamp::default())),
    ("contour lines", |s, r| add(s, r, ContourLines::default())),
    ("detail textures", |s, r| {
        for unit in 2..7 {
            add(s, r, TextureUnit { unit });
            add(s, r, Texture2::from_image(rgba(256, 256, |i| [i as u8, (i >> 8) as u8, 90 * (unit as u8 % 3), 255])));
        }
        add(s, r, DetailTextures::default());
    }),
    ("lines on faces", |s, r| add(s, r, DrawStyle { style: Style::FilledLines, ..Default::default() })),
    ("transparency", |s, r| add(s, r, Material { transparency: List::from(0.3), ..Default::default() })),
];

fn scene(map: &Arc<Image>, effects: &[Nodes]) -> Scene {
    let mut scene = Scene::new();
    let root = scene.root();
    let look_at = Some(DVec3::new(65_900.0, 40_100.0, 1_950.0));
    let position = Some(DVec3::new(82_000.0, 21_000.0, 3_000.0));
    add(&mut scene, root, PerspectiveCamera { position, look_at, ..Default::default() });
    add(&mut scene, root, Complexity { texture_quality: 1.0, ..Default::default() });
    add(&mut scene, root, Texture2::from_image(Arc::clone(map)));
    for effect in effects {
        effect(&mut scene, root);
    }
    let terrain = SeamlessTerrain {
        size: Some(DVec2::new(90_600.0, 111_240.0)),
        max_height: 65_535.0,
        base_height: -1_000.0,
        void_sample: Some(0.0),
        ..Default::default()
    };
    add(&mut scene, root, terrain);
    scene
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // `cargo test` runs benchmarks to see that they work.
    let frames = if std::env::args().any(|a| a == "--bench") { 15 } else { 3 };
    let map = Arc::new(Image::open("scenes/fuji.png".as_ref())?);
    let mut cases: Vec<(String, Vec<Nodes>)> = vec![("base".into(), Vec::new())];
    cases.extend(EFFECTS.iter().map(|(name, nodes)| ((*name).into(), vec![*nodes])));
    cases.push(("all".into(), EFFECTS.iter().map(|(_, nodes)| *nodes).collect()));

    let mut rows = Vec::new();
    for (name, effects) in &cases {
        let scene = scene(&map, effects);
        let frame = RenderAction::new(SIZE[0], SIZE[1]).apply(&scene)?;
        // A device of its own, so that nothing of another case is on it.
        let mut headless = Headless::new(None)?;
        let bytes = headless.draw(&frame)?.report.gpu_bytes;
        let shader = headless.costs(&frame)?.iter().map(|cost| cost.shader_bytes).sum::<u64>();
        rows.push((name, frame, headless, shader, bytes, Vec::new()));
    }
    for _ in 0..frames {
        for (_, frame, headless, _, _, times) in &mut rows {
            let start = Instant::now();
            headless.draw(frame)?;
            times.push(start.elapsed().as_secs_f64() * 1e3);
        }
    }
    println!("| effect | frame, ms | against base | shader, bytes | on the card, KiB | against base |");
    println!("|---|---|---|---|---|---|");
    let mut base = None;
    let mut parts = (0.0, 0);
    for (name, _, _, shader, bytes, times) in &mut rows {
        times.sort_by(f64::total_cmp);
        let time = times.get(times.len() / 2).copied().unwrap_or(f64::NAN);
        let &mut (base_time, base_bytes) = base.get_or_insert((time, *bytes));
        let more = (time - base_time, bytes.wrapping_sub(base_bytes) / 1024);
        println!("| {name} | {time:.1} | {:+.1} | {shader} | {} | +{} |", more.0, *bytes / 1024, more.1);
        if *name != "all" {
            parts = (parts.0 + more.0, parts.1 + more.1);
        }
    }
    println!("\nsum of the parts: {:+.1} ms, +{} KiB", parts.0, parts.1);
    Ok(())
}
