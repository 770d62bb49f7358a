//! What the resolutions of a patch's sides cost: the table of `docs/resolutions.md`; and what morphing costs: that of
//! `docs/morph.md`.
//!
//! `cargo bench --bench resolutions --no-default-features` prints both as Markdown, with `morph` behind `--` the latter alone. For each (r_min, n): triangles, patches
//! and draw calls after culling, and the time of a selection, at an error of one pixel, as the mean over the same eyes on
//! five maps; and what the errors of the tiles take in time and memory.

use std::hint::black_box;
use std::path::Path;
use std::time::{Duration, Instant};

use glam::{DAffine3, DVec2, DVec3};
use seamount::action::{Lens, Viewpoint};
use seamount::node::{SeamlessTerrain, lattice_view};
use seamount::prelude::*;
use seamount::terrain::{
    HeightField, Hierarchy, Instances, LatticeFrame, LatticeView, MorphErrors, MorphPixelError, Parts, PixelError,
    Resolutions, Selection, Terrain, TileErrors, generate,
};

const EYES: u32 = 20;

/// Selections are short: the mean of so many is taken.
const REPEATS: u32 = 20;

struct Map {
    name: &'static str,
    terrain: Terrain,
    views: Vec<LatticeView>,
}

fn maps() -> Vec<Map> {
    let metres = |x, y| SeamlessTerrain {
        size: Some(DVec2::new(x, y)),
        max_height: 65_535.0,
        base_height: -1_000.0,
        ..SeamlessTerrain::default()
    };
    let walls = SeamlessTerrain { scale: 700.0, max_height: 100.0, ..SeamlessTerrain::default() };
    [
        ("fuji", Some(0.0), metres(90_600.0, 111_240.0)),
        ("andes", None, metres(93_840.0, 111_240.0)),
        ("jacksboro", None, metres(29_949.0, 31_796.0)),
        ("puget", None, metres(163_840.0, 163_840.0)),
        ("walls", None, walls),
    ]
    .into_iter()
    .map(|(name, void, node)| {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.png"));
        let image = Image::open(&path).expect("the maps are in the repository");
        let field = image.height_field(void).expect("large enough");
        let frame = node.frame(&field);
        let terrain = Terrain::new(field);
        let views = (0..EYES).map(|k| view(&terrain, &frame, k)).collect();
        Map { name, terrain, views }
    })
    .collect()
}

/// Eye number k of a flight that spirals down from a fifth of the map's length above the ground to a few metres above it,
/// looking ahead and down at first and level at last, in a picture of 1280 × 720.
fn view(terrain: &Terrain, frame: &LatticeFrame, k: u32) -> LatticeView {
    let done = f64::from(k) / f64::from(EYES - 1);
    let [dx, dy] = frame.cell_size;
    let [cu, cv] = frame.cells.map(f64::from);
    let angle = 2.4 * f64::from(k);
    let (u, v) = (0.5 + 0.4 * done * angle.cos(), 0.5 + 0.4 * done * angle.sin());
    let ground = terrain.field().surface(u * cu, (1.0 - v) * cv).expect("on the map");
    let above = cu * dx * 0.2 * 0.01f64.powf(done);
    let eye = DVec3::new(u * cu * dx, v * cv * dy, frame.base + ground * frame.z_step + above);
    let (yaw, pitch) = (angle + 2.0, -0.8 * (1.0 - done));
    let forward = DVec3::new(yaw.cos() * pitch.cos(), yaw.sin() * pitch.cos(), pitch.sin());
    let right = forward.cross(DVec3::Z).normalize();
    let view = Viewpoint {
        eye,
        right,
        up: right.cross(forward),
        forward,
        lens: Lens::Perspective { tan_half_height: 0.41 },
        aspect: 16.0 / 9.0,
        pixels: 720.0,
        near: 1.0,
        far: None,
    };
    lattice_view(&view, &DAffine3::IDENTITY, frame)
}

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
        for view in &map.views {
            let metric = PixelError { tolerance: 1.0, view, errors, pyramid };
            let mut select = || match morph_errors {
                Some(errors) => {
                    selection.update_morphing(tree_shape, black_box(&MorphPixelError { tolerance: 1.0, view, errors }));
                }
                None => selection.update(tree_shape, black_box(&metric)),
            };
            select();
            let start = Instant::now();
            for _ in 0..REPEATS {
                select();
            }
            self.selection += start.elapsed() / REPEATS;
            let visible: Vec<_> = selection
                .patches(tree_shape)
                .filter(|patch| {
                    let [[u0, v0], [u1, v1]] = tree_shape.extent(patch.id);
                    let [low, high] = pyramid.range(tree_shape.size(patch.id.level), patch.id.column, patch.id.row);
                    let low = DVec3::new(u0.into(), v0.into(), low);
                    !view.frustum.excludes(low, DVec3::new(u1.into(), v1.into(), high))
                })
                .collect();
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
