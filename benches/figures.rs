//! The first figures: loading, choosing detail, picking, boxing and drawing the Andes (1201²).
//!
//! `cargo bench --bench figures`. Ratios within one run are what counts; the README quotes them.
#![allow(missing_docs, reason = "criterion's macros make undocumented functions")]

use std::path::Path;

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use seamount::prelude::*;
use seamount::render::Headless;
use seamount::terrain::{LodEye, Precision, Resolutions, Selection, Terrain};

fn andes() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/andes.png")
}

/// The Andes seen from above the south-west, at a precision that fills the picture.
fn scene() -> Scene {
    let mut scene = Scene::new();
    let root = scene.root();
    let mut add = |node: Box<dyn Node>| {
        let key = scene.insert_boxed(node);
        scene.add_child(root, key).expect("the root is a group");
    };
    add(Box::new(PerspectiveCamera {
        position: Some(DVec3::new(10_000.0, -20_000.0, 15_000.0)),
        look_at: Some(DVec3::new(47_000.0, 56_000.0, 3_000.0)),
        ..PerspectiveCamera::default()
    }));
    add(Box::new(DirectionalLight { direction: DVec3::new(1.0, -0.5, -0.7), ..DirectionalLight::default() }));
    add(Box::new(Texture2 { filename: andes().display().to_string(), ..Texture2::default() }));
    add(Box::new(SeamlessTerrain {
        size: Some(DVec2::new(93_840.0, 111_240.0)),
        max_height: 65_535.0,
        base_height: -1_000.0,
        detail: DetailMode::Precision(4.0),
        ..SeamlessTerrain::default()
    }));
    scene
}

fn resolutions() -> Resolutions {
    let (min, count) = SeamlessTerrain::default().resolutions;
    Resolutions::new(min, count).expect("valid")
}

fn load(c: &mut Criterion) {
    let mut group = c.benchmark_group("load");
    group.sample_size(20);
    let path = andes();
    group.bench_function("decode the PNG alone", |b| b.iter(|| Image::open(&path).expect("the map is there")));
    let image = Image::open(&path).expect("the map is there");
    group.bench_function("heights and min/max tree", |b| {
        b.iter(|| {
            let terrain = Terrain::new(image.height_field(None).expect("a map"));
            terrain.pyramid().full_range()
        });
    });
    group.bench_function("errors of the coarse triangles, all patches", |b| {
        b.iter_batched(
            || {
                let terrain = Terrain::new(image.height_field(None).expect("a map"));
                let tree = terrain.tree(resolutions());
                (terrain, tree)
            },
            |(terrain, tree)| {
                tree.fan_errors(terrain.field());
                (terrain, tree)
            },
            BatchSize::LargeInput,
        );
    });
    group.finish();
}

fn selection(c: &mut Criterion) {
    let terrain = Terrain::new(Image::open(&andes()).expect("the map is there").height_field(None).expect("a map"));
    let tree = terrain.tree(resolutions());
    let tree = tree.hierarchy();
    let mut selection = Selection::new(tree);
    let mut group = c.benchmark_group("selection");
    for precision in [1.0, 4.0, 16.0] {
        let eye = LodEye::Point { u: 400.0, v: 900.0, height: 10.0 };
        let metric = Precision { precision, eye };
        selection.update(tree, &metric);
        let active = selection.patches(tree).count();
        group.bench_function(format!("ρ = {precision}: {active} active patches"), |b| {
            b.iter(|| selection.update(tree, &metric));
        });
    }
    group.finish();
}

fn ask(c: &mut Criterion) {
    let scene = scene();
    c.bench_function("bounding box of the scene", |b| {
        b.iter(|| BoundingBoxAction::default().apply(&scene).expect("a box"));
    });
    let picker = RayPickAction::pixel(0, 0, [1280, 720]).picker(&scene).expect("a camera");
    let rays: Vec<Ray> = (0..1000u32)
        .map(|k| {
            let (x, y) = (f64::from(k % 40) / 40.0, f64::from(k / 40) / 25.0);
            picker.ray_through(x, 0.3 + 0.7 * y).expect("a ray")
        })
        .collect();
    c.bench_function("1000 picks through pixels, coarse", |b| {
        b.iter(|| rays.iter().map(|r| picker.pick(r, false).expect("a pick").len()).sum::<usize>());
    });
    c.bench_function("one pick, everything included", |b| {
        b.iter(|| RayPickAction::pixel(640, 400, [1280, 720]).apply(&scene).expect("a pick"));
    });
}

fn draw(c: &mut Criterion) {
    let scene = scene();
    let action = RenderAction::new(1280, 720);
    let frame = action.apply(&scene).expect("a frame");
    let mut headless = Headless::new(None).expect("an adapter");
    let mut group = c.benchmark_group("frame");
    group.sample_size(20);
    group.bench_function(format!("to a Frame, {} triangles", frame.statistics.triangles), |b| {
        b.iter(|| action.apply(&scene).expect("a frame"));
    });
    group.bench_function(format!("draw and read back 1280 × 720 on {}", headless.adapter().name), |b| {
        b.iter(|| headless.draw(&frame).expect("a picture"));
    });
    group.finish();
}

criterion_group!(benches, load, selection, ask, draw);
criterion_main!(benches);
