//! What the resolutions of a patch's sides cost: the table of `docs/resolutions.md`; and what morphing costs: that of
//! `docs/morph.md`.
//!
//! `cargo bench --bench resolutions --no-default-features` prints both as Markdown, with `morph` behind `--` the latter alone. For each (r_min, n): triangles, patches
//! and draw calls after culling, and the time of a selection, at an error of one pixel, as the mean over the same eyes on
//! five maps; and what the errors of the tiles take in time and memory.

#[path = "../tests/common/maps.rs"]
mod maps;

use std::hint::black_box;
use std::time::{Duration, Instant};

use maps::{Map, maps};
use seamount::node::SeamlessTerrain;
use seamount::terrain::{
    HeightField, Hierarchy, Instances, MorphErrors, MorphPixelError, Parts, PixelError, Resolutions, Selection,
    TileErrors, generate,
};

const EYES: u32 = 20;

/// Selections are short: the mean of so many is taken.
const REPEATS: u32 = 20;

#[derive(Default)]
struct Cost {
    triangles: f64,
    patches: f64,
    active: f64,
    calls: f64,
    selection: Duration,
}

impl Cost {
    fn add(&mut self, map: &Map, resolutions: Resolutions, morph: bool) {
        let tree = map.terrain.tree(resolutions);
        let errors = tree.tile_errors(map.terrain.field());
        // Made on first need.
        let morph_errors = morph.then(|| tree.morph_errors(map.terrain.field()));
        let pyramid = map.terrain.pyramid();
        let tree_shape = tree.hierarchy();
        let mut selection = Selection::new(tree_shape);
        let mut instances = Instances::default();
        for view in (0..EYES).map(|k| map.flight(k, EYES)) {
            let metric = PixelError { tolerance: 1.0, view: &view, errors, pyramid };
            let mut select = || match morph_errors {
                Some(errors) => {
                    let metric = MorphPixelError { tolerance: 1.0, view: &view, errors };
                    selection.update_morphing(tree_shape, black_box(&metric));
                }
                None => selection.update(tree_shape, black_box(&metric)),
            };
            select();
            let start = Instant::now();
            for _ in 0..REPEATS {
                select();
            }
            self.selection += start.elapsed() / REPEATS;
            let visible = map.visible(tree_shape, &selection, &view);
            instances.update(tree_shape, tree.parts(), &visible);
            instances.weigh(tree_shape, tree.parts(), &visible, &selection);
            self.triangles += instances.triangles() as f64;
            self.patches += visible.len() as f64;
            self.active += selection.patches(tree_shape).count() as f64;
            self.calls += instances.ranges().len() as f64;
        }
    }
}

/// The default resolutions with and without morphing.
fn morph_table(maps: &[Map], large: &HeightField) {
    let (min, count) = SeamlessTerrain::default().resolutions;
    let resolutions = Resolutions::new(min, count).expect("valid");
    println!("| map | triangles | with morph | drawn patches | with morph | selection, µs | with morph |");
    println!("|---|---|---|---|---|---|---|");
    for map in maps {
        let mut costs = [Cost::default(), Cost::default()];
        for (cost, morph) in costs.iter_mut().zip([false, true]) {
            cost.add(map, resolutions, morph);
        }
        let mean = |f: &dyn Fn(&Cost) -> f64| {
            let [without, with] = [f(&costs[0]), f(&costs[1])].map(|sum| sum / f64::from(EYES));
            format!("{without:.0} | {with:.0} ({:+.0} %)", 100.0 * (with / without - 1.0))
        };
        println!(
            "| {} | {} | {} | {} |",
            map.name,
            mean(&|cost| cost.triangles),
            mean(&|cost| cost.patches),
            mean(&|cost| cost.selection.as_secs_f64() * 1e6),
        );
    }
    let tree = Hierarchy::new(large.cells(), resolutions);
    let parts = Parts::new(resolutions);
    let start = Instant::now();
    let errors = black_box(MorphErrors::new(large, &tree, &parts));
    println!("\nErrors of 4097²: {:.2} s, {} bytes\n", start.elapsed().as_secs_f64(), errors.bytes());
}

fn main() {
    let maps = maps();
    let large = generate(4097, 1).expect("valid");
    morph_table(&maps, &large);
    if std::env::args().any(|argument| argument == "morph") {
        return;
    }
    let bytes = 2 * 4097 * 4097;
    let header: Vec<&str> = maps.iter().map(|map| map.name).collect();
    println!(
        "| r_min, n | triangles | of these {} | active | drawn | draw calls | selection, µs | µs per active | \
         errors of 4097², s | of the heights' bytes |",
        header.join(", ")
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for count in 2..=5 {
        for min in [2, 4, 8, 16, 32, 64] {
            // Larger ones fit no map here more than twice.
            let Some(resolutions) = Resolutions::new(min, count).ok().filter(|r| r.max() <= 128) else { continue };
            let mut total = Cost::default();
            let mut each = Vec::new();
            for map in &maps {
                let before = total.triangles;
                total.add(map, resolutions, false);
                each.push(format!("{:.0}", (total.triangles - before) / f64::from(EYES)));
            }
            let tree = Hierarchy::new([4096; 2], resolutions);
            let parts = Parts::new(resolutions);
            let start = Instant::now();
            let errors = black_box(TileErrors::new(&large, &tree, &parts));
            let seconds = start.elapsed().as_secs_f64();
            let views = f64::from(EYES) * maps.len() as f64;
            let micros = total.selection.as_secs_f64() * 1e6;
            println!(
                "| {min}, {count} | {:.0} | {} | {:.0} | {:.0} | {:.0} | {:.0} | {:.2} | {seconds:.2} | {:.1} % |",
                total.triangles / views,
                each.join(", "),
                total.active / views,
                total.patches / views,
                total.calls / views,
                micros / views,
                micros / total.active,
                100.0 * errors.bytes() as f64 / f64::from(bytes),
            );
        }
    }
}
