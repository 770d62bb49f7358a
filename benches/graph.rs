//! Coin's own shapes of work: 10 000 × (separator, translation, cube), and a set of faces of 513² points.
//!
//! Coin 4.0 on a like machine: box first 14–26 ms, cached 1.7 µs, after one change 4.3 ms; pick 4.3 ms; search by name of the last
//! 5–16 ms, by kind of all 17–26 ms; callback over 120 000 triangles 12–17 ms; pick in 513² points 41–85 ms.

use std::hint::black_box;

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use glam::DVec3;
use seamount::action::CallbackAction;
use seamount::prelude::*;

fn cubes() -> (Scene, Vec<NodeKey>) {
    let mut scene = Scene::new();
    let root = scene.root();
    let mut moves = Vec::new();
    for k in 0..10_000 {
        let separator = scene.add(root, Separator::default()).expect("a child");
        let translation = DVec3::new(f64::from(k % 100) * 3.0, f64::from(k / 100) * 3.0, 0.0);
        moves.push(scene.add(separator, Translation { translation }).expect("a child"));
        let cube = scene.add(separator, Cube::default()).expect("a child");
        scene.set_name(cube, format!("cube_{k}")).expect("a new name");
    }
    (scene, moves)
}

fn faces(n: i32) -> Scene {
    let mut scene = Scene::new();
    let root = scene.root();
    let height = |k: i32| f64::from((k * 7919) % 97) / 97.0;
    let point = (0..n * n).map(|k| DVec3::new(f64::from(k % n), f64::from(k / n), height(k))).collect();
    let mut indices = Vec::new();
    for row in 0..n - 1 {
        for column in 0..n - 1 {
            let a = row * n + column;
            indices.extend([a, a + 1, a + n + 1, -1, a, a + n + 1, a + n, -1]);
        }
    }
    scene.add(root, Coordinate3 { point }).expect("a child");
    scene.add(root, IndexedFaceSet { coord_index: indices.into(), ..IndexedFaceSet::default() }).expect("a child");
    scene
}

fn graph(c: &mut Criterion) {
    let mut group = c.benchmark_group("graph");
    group.sample_size(20);
    let bounds = |scene: &Scene| BoundingBoxAction::default().apply(scene).expect("a box");
    group.bench_function("box first", |b| {
        b.iter_batched_ref(|| cubes().0, |scene| black_box(bounds(scene)), BatchSize::LargeInput);
    });
    let (mut scene, moves) = cubes();
    group.bench_function("box cached", |b| b.iter(|| black_box(bounds(&scene))));
    let mut k = 0;
    group.bench_function("box after one translation changed", |b| {
        b.iter(|| {
            k = (k + 4001) % moves.len();
            scene.edit::<Translation>(moves[k]).expect("a translation").translation.z += 0.001;
            black_box(bounds(&scene))
        });
    });
    let ray = Ray::new(DVec3::new(150.2, 150.3, 99.0), DVec3::new(0.01, 0.01, -1.0)).expect("a ray");
    group.bench_function("pick", |b| b.iter(|| black_box(RayPickAction::ray(ray).apply(&scene).expect("a pick"))));
    group.bench_function("pick after one translation changed", |b| {
        b.iter(|| {
            k = (k + 4001) % moves.len();
            scene.edit::<Translation>(moves[k]).expect("a translation").translation.z += 0.001;
            black_box(RayPickAction::ray(ray).apply(&scene).expect("a pick"))
        });
    });
    let last = SearchAction { name: Some("cube_9999".into()), interest: Interest::First, ..SearchAction::default() };
    group.bench_function("search by name of the last", |b| b.iter(|| black_box(last.apply(&scene).expect("a search"))));
    let all = SearchAction { kind: Some("Cube".into()), ..SearchAction::default() };
    group.bench_function("search by kind of all", |b| b.iter(|| black_box(all.apply(&scene).expect("a search"))));
    group.bench_function("callback over 120 000 triangles", |b| {
        b.iter(|| {
            let mut sum = 0.0;
            CallbackAction::new().triangles(None, |_, t| sum += t.points[0].x).apply(&scene).expect("a walk");
            black_box(sum)
        });
    });
    let text = seamount::format::write_scene(&scene).expect("text");
    let registry = seamount::node::Registry::default();
    group.bench_function(format!("write {} kB", text.len() / 1000), |b| {
        b.iter(|| black_box(seamount::format::write_scene(&scene).expect("text")));
    });
    group.bench_function(format!("read {} kB", text.len() / 1000), |b| {
        b.iter(|| black_box(seamount::format::parse(&text, &registry).expect("a scene")));
    });
    let faces = faces(513);
    let ray = Ray::new(DVec3::new(150.2, 150.3, 99.0), DVec3::new(0.3, 0.2, -1.0)).expect("a ray");
    group.bench_function("pick in 513² points", |b| {
        b.iter(|| black_box(RayPickAction::ray(ray).apply(&faces).expect("a pick")));
    });
    group.finish();
}

criterion_group!(benches, graph);
criterion_main!(benches);
