//! Choosing detail: the time of a selection by its number of patches for both metrics, the errors of a 4097² map, and what
//! is drawn of it.
//!
//! `cargo bench --bench detail --no-default-features`
#![allow(missing_docs, reason = "criterion's macros make undocumented functions")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::{DAffine3, DVec2, DVec3};
use seamount::action::{Lens, Viewpoint};
use seamount::node::{SeamlessTerrain, lattice_view};
use seamount::terrain::{
    Hierarchy, Instances, LatticeView, LodEye, Metric, MinMaxPyramid, Parts, PixelError, Precision, Resolutions,
    Selection, TileErrors, generate,
};

fn resolutions() -> Resolutions {
    let (min, count) = SeamlessTerrain::default().resolutions;
    Resolutions::new(min, count).expect("the default is valid")
}

/// A selection with about so many patches: bisects a number that makes the metric finer the smaller it is.
fn about<M: Metric>(tree: &Hierarchy, patches: usize, metric: impl Fn(f64) -> M) -> (M, usize) {
    let mut selection = Selection::new(tree);
    let (mut low, mut high) = (-20.0f64, 20.0f64);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        selection.update(tree, &metric(middle.exp2()));
        if selection.patches(tree).count() > patches { low = middle } else { high = middle }
    }
    selection.update(tree, &metric(high.exp2()));
    (metric(high.exp2()), selection.patches(tree).count())
}

fn selecting(c: &mut Criterion, name: &str, tree: &Hierarchy, metric: &impl Metric, active: usize) {
    let mut selection = Selection::new(tree);
    let mut group = c.benchmark_group("selection");
    // Time per element is time per active patch.
    group.throughput(Throughput::Elements(active as u64));
    group.bench_function(format!("{name}, {active} active patches"), |b| b.iter(|| selection.update(tree, metric)));
    group.finish();
}

/// From above the south-west corner over most of the map, in a picture of 1280 × 720.
fn view(field: &seamount::terrain::HeightField) -> LatticeView {
    let node = SeamlessTerrain { scale: 100_000.0, max_height: 4_000.0, ..SeamlessTerrain::default() };
    let (eye, target) = (DVec3::new(5_000.0, 5_000.0, 6_000.0), DVec3::new(60_000.0, 60_000.0, 0.0));
    let forward = (target - eye).normalize();
    let right = forward.cross(DVec3::Z).normalize();
    let up = right.cross(forward);
    let lens = Lens::Perspective { tan_half_height: 0.41 };
    let view = Viewpoint {
        eye,
        right,
        up,
        forward,
        lens,
        center: DVec2::ZERO,
        aspect: 16.0 / 9.0,
        pixels: 720.0,
        near: 1.0,
        far: None,
    };
    lattice_view(&view, &DAffine3::IDENTITY, &node.frame(field))
}

fn detail(c: &mut Criterion) {
    let field = generate(4097, 1).expect("valid");
    let tree = Hierarchy::new(field.cells(), resolutions());
    let parts = Parts::new(resolutions());
    let pyramid = MinMaxPyramid::new(&field);

    let mut group = c.benchmark_group("errors");
    group.sample_size(10);
    group.bench_function("tiles of 4097²", |b| b.iter(|| TileErrors::new(&field, &tree, &parts)));
    group.finish();
    let errors = TileErrors::new(&field, &tree, &parts);
    let bytes = 2 * 4097 * 4097;
    println!(
        "errors: {} bytes for {} patches, {:.1} % of the heights' {bytes}\n",
        errors.bytes(),
        tree.len(),
        100.0 * errors.bytes() as f64 / f64::from(bytes)
    );

    let view = view(&field);
    let by_pixels = |tolerance| PixelError { tolerance, view: &view, errors: &errors, pyramid: &pyramid };
    let eye = LodEye::Point { u: 205.0, v: 3891.0, height: 200.0 };
    for patches in [100, 1_000, 10_000] {
        let (metric, active) = about(&tree, patches, by_pixels);
        selecting(c, &format!("τ = {:.3}", metric.tolerance), &tree, &metric, active);
        let (metric, active) = about(&tree, patches, |coarse| Precision { precision: 1.0 / coarse, eye });
        selecting(c, &format!("ρ = {:.2}", metric.precision), &tree, &metric, active);
    }

    let full = 2 * 4096 * 4096;
    for tolerance in [0.5, 1.0, 2.0, 4.0] {
        let selection = Selection::of(&tree, &by_pixels(tolerance));
        let patches: Vec<_> = selection.patches(&tree).collect();
        let mut instances = Instances::default();
        instances.update(&tree, &parts, &patches);
        println!(
            "τ = {tolerance}: {} triangles in {} patches before culling, 1/{:.0} of the full mesh's {full}",
            instances.triangles(),
            patches.len(),
            f64::from(full) / instances.triangles() as f64
        );
    }
}

criterion_group!(benches, detail);
criterion_main!(benches);
