//! Rays against a map of heights: the exact and the coarse surface beside parry3d's height field and obvhs's wide BVH.
//!
//! `cargo bench --bench pick`. All peers get the same maps and rays in one run, on one thread; a table of the figures, the best
//! of many samples each, comes last. Our exact and coarse surfaces take turns: their ratios are asked for to some percent. Coarse
//! picks go over the finest patches ("leaves"), and over those that a camera above a corner of the map takes at one pixel of error
//! ("1 px"). Then `pick_many` over a scene, on one core and on two.
//! parry3d and obvhs know f32 only: they get the map centred, in metres, y up.
//! `SEAMOUNT_BENCH_MAPS=1201` or `4097` runs one map alone (the BVH of the larger needs about 10 GB).
#![allow(missing_docs, reason = "criterion's macros make undocumented functions")]

use std::hint::black_box;
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use criterion::{Criterion, criterion_group, criterion_main};
use glam::{DAffine3, DVec2, DVec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::{Ray, RayHit};
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;
use parry3d::math::Vector;
use parry3d::query::RayCast;
use parry3d::utils::Array2;
use seamount::action::{Lens, Ray as WorldRay, RayPickAction, Surface, Viewpoint};
use seamount::node::{SeamlessTerrain, Texture2, lattice_view};
use seamount::scene::{Image, Scene};
use seamount::terrain::pick::{CoarseSurface, FanErrors, FanTree, LatticeRay};
use seamount::terrain::{
    DrawnPick, DrawnSurface, ExactSurface, Full, HeightField, Hierarchy, LatticeView, MinMaxPyramid, Parts, PixelError,
    Resolutions, Selection, TileErrors, generate,
};

const RAYS: usize = 20_000;
const ROUNDS: usize = 30;
const CLASSES: [&str; 6] = ["camera", "grazing", "grid lines", "diagonals", "vertices", "down"];

/// A map with the size of its cells and heights in metres.
struct Map {
    name: &'static str,
    field: HeightField,
    cell: [f64; 2],
    step: f64,
}

/// splitmix64.
struct Rng(u64);

impl Rng {
    fn range(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        low + (high - low) * ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
}

impl Map {
    fn andes() -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/andes.png");
        let field = Image::open(&path).expect("the map is there").height_field(None).expect("a map");
        Self { name: "Andes 1201²", field, cell: [78.2, 92.7], step: 1.0 }
    }

    fn generated() -> Self {
        let field = generate(4097, 1).expect("a size that is allowed");
        Self { name: "generated 4097²", field, cell: [30.0, 30.0], step: 6000.0 / 65535.0 }
    }

    /// A ray from a lattice point in a direction given in metres (east, south, up).
    fn ray(&self, origin: DVec3, metres: DVec3) -> LatticeRay {
        let direction = metres / DVec3::new(self.cell[0], self.cell[1], self.step);
        LatticeRay { origin, direction, near: 0.0, far: f64::INFINITY }
    }

    fn rays(&self, class: &str) -> Vec<LatticeRay> {
        let mut rng = Rng(class.len() as u64);
        let [cu, cv] = self.field.cells().map(f64::from);
        let full = MinMaxPyramid::new(&self.field).full_range();
        let towards = |azimuth: f64, pitch: f64| {
            let (sin, cos) = azimuth.sin_cos();
            DVec3::new(cos, sin, pitch.to_radians().tan())
        };
        let mut rays = Vec::with_capacity(RAYS);
        let mut eye = DVec3::ZERO;
        let mut heading = 0.0;
        while rays.len() < RAYS {
            let turn = std::f64::consts::TAU;
            rays.push(match class {
                // Sixteen eyes above the ground of the map; rays through the pixels of pictures 60° wide, 15° down.
                "camera" => {
                    if rays.len() % (RAYS / 16) == 0 {
                        eye = DVec3::new(rng.range(0.1, 0.9) * cu, rng.range(0.1, 0.9) * cv, 0.0);
                        let ground = self.field.surface(eye.x, eye.y).unwrap_or(0.0);
                        eye.z = ground + rng.range(500.0, 3000.0) / self.step;
                        heading = rng.range(0.0, turn);
                    }
                    let azimuth = heading + rng.range(-30.0f64, 30.0).to_radians();
                    self.ray(eye, towards(azimuth, -15.0 + rng.range(-20.0, 20.0)))
                }
                // From beside the map, at the height of its upper half, level within 1°.
                "grazing" => {
                    let azimuth = rng.range(0.0, turn);
                    let target = DVec3::new(
                        rng.range(0.0, cu),
                        rng.range(0.0, cv),
                        full[0] + rng.range(0.5, 1.1) * (full[1] - full[0]),
                    );
                    let ray = self.ray(target, towards(azimuth, rng.range(-1.0, 1.0)));
                    let back = 1.5 * cu.hypot(cv) / ray.direction.truncate().length();
                    LatticeRay { origin: target - ray.direction * back, ..ray }
                }
                "grid lines" => {
                    let k = rng.range(0.0, cu).floor();
                    let origin = DVec3::new(k, rng.range(0.0, cv), full[1]);
                    let sign = if rng.range(0.0, 1.0) < 0.5 { 1.0 } else { -1.0 };
                    self.ray(origin, towards(0.25 * turn * sign, -5.0))
                }
                "diagonals" => {
                    let origin = DVec3::new(rng.range(0.0, cu).floor(), rng.range(0.0, cv).floor(), full[1]);
                    let slope = self.cell[0].hypot(self.cell[1]) * 5f64.to_radians().tan() / self.step;
                    let sign = if rng.range(0.0, 1.0) < 0.5 { 1.0 } else { -1.0 };
                    LatticeRay { origin, direction: DVec3::new(sign, sign, -slope), near: 0.0, far: f64::INFINITY }
                }
                "vertices" => {
                    let (c, r) = (rng.range(0.0, cu) as u32, rng.range(0.0, cv) as u32);
                    let target = DVec3::new(f64::from(c), f64::from(r), self.field.raw(c, r));
                    let away = self.ray(target, towards(rng.range(0.0, turn), rng.range(20.0, 70.0)));
                    let ahead = (full[1] + 1000.0 / self.step - target.z) / away.direction.z;
                    LatticeRay { origin: target + away.direction * ahead, direction: -away.direction, ..away }
                }
                _ => {
                    let origin = DVec3::new(rng.range(0.0, cu), rng.range(0.0, cv), full[1] + 1000.0 / self.step);
                    self.ray(origin, DVec3::NEG_Z)
                }
            });
        }
        rays
    }

    fn terrain(&self) -> SeamlessTerrain {
        let [cu, cv] = self.field.cells().map(f64::from);
        let size = Some(DVec2::new(cu * self.cell[0], cv * self.cell[1]));
        SeamlessTerrain { size, max_height: 65_535.0 * self.step, ..SeamlessTerrain::default() }
    }

    /// From above the south-west corner over most of the map, in a picture of 1280 × 720.
    fn view(&self) -> LatticeView {
        let terrain = self.terrain();
        let size = terrain.size.unwrap_or_default();
        let top = MinMaxPyramid::new(&self.field).full_range()[1] * self.step;
        let (eye, target) = ((0.05 * size).extend(top + 0.05 * size.x), (0.6 * size).extend(0.0));
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
        lattice_view(&view, &DAffine3::IDENTITY, &terrain.frame(&self.field))
    }

    /// A lattice point, or with `w` 0 a direction, as the peers want it.
    fn centred(&self, p: DVec3, w: f64) -> [f32; 3] {
        let [cu, cv] = self.field.cells().map(f64::from);
        [
            ((p.x - w * cu / 2.0) * self.cell[0]) as f32,
            (p.z * self.step) as f32,
            ((p.y - w * cv / 2.0) * self.cell[1]) as f32,
        ]
    }

    fn parry(&self) -> parry3d::shape::HeightField {
        let (columns, rows) = (self.field.columns(), self.field.rows());
        let mut heights = Array2::zeros(rows as usize, columns as usize);
        for r in 0..rows {
            for c in 0..columns {
                heights[(r as usize, c as usize)] = (self.field.raw(c, r) * self.step) as f32;
            }
        }
        let [cu, cv] = self.field.cells().map(f64::from);
        let scale = Vector::new((cu * self.cell[0]) as f32, 1.0, (cv * self.cell[1]) as f32);
        parry3d::shape::HeightField::new(heights, scale)
    }

    fn bvh(&self) -> Bvh {
        let [cu, cv] = self.field.cells();
        let corner = |c: u32, r: u32| {
            let p = DVec3::new(f64::from(c), f64::from(r), self.field.raw(c, r));
            Vec3A::from_array(self.centred(p, 1.0))
        };
        let mut triangles = Vec::with_capacity(2 * cu as usize * cv as usize);
        for r in 0..cv {
            for c in 0..cu {
                let (v0, v2) = (corner(c, r), corner(c + 1, r + 1));
                triangles.push(Triangle { v0, v1: corner(c + 1, r), v2 });
                triangles.push(Triangle { v0, v1: corner(c, r + 1), v2 });
            }
        }
        let bvh = build_cwbvh_from_tris(&triangles, BvhBuildParams::medium_build(), &mut Duration::default());
        let triangles = bvh.primitive_indices.iter().map(|&i| RtTriangle::from(&triangles[i as usize])).collect();
        Bvh { bvh, triangles }
    }
}

/// The wide BVH with the triangles in its order.
struct Bvh {
    bvh: CwBvh,
    triangles: Vec<RtTriangle>,
}

impl Bvh {
    fn bytes(&self) -> usize {
        size_of_val(self.bvh.nodes.as_slice()) + size_of_val(self.triangles.as_slice())
    }
}

/// Nanoseconds per ray, or whatever the title says, in the order of measuring.
static TABLE: Mutex<Vec<(String, f64)>> = Mutex::new(Vec::new());

fn note(title: String, value: f64) {
    let mut table = TABLE.lock().unwrap_or_else(PoisonError::into_inner);
    match table.iter_mut().find(|(t, _)| *t == title) {
        // The best sample: the machine is shared, and disturbances only add.
        Some((_, best)) => *best = best.min(value),
        None => table.push((title, value)),
    }
}

/// Passes over all rays: the shortest time of each in seconds, and what it found. Several of each in turns, so that what disturbs one
/// disturbs the others.
fn in_turns<R, const N: usize>(passes: [&dyn Fn() -> R; N]) -> [(f64, Option<R>); N] {
    let mut best = std::array::from_fn(|_| (f64::INFINITY, None));
    for _ in 0..ROUNDS {
        for (pass, (seconds, found)) in passes.iter().zip(&mut best) {
            for _ in 0..4 {
                let start = Instant::now();
                let result = pass();
                *seconds = seconds.min(start.elapsed().as_secs_f64());
                *found = Some(result);
            }
        }
    }
    best
}

/// Measures one peer on one class, a ray per iteration.
fn time<R>(c: &mut Criterion, map: &str, class: &str, peer: &str, rays: &[R], mut pick: impl FnMut(&R) -> bool) {
    let mut hits = 0;
    for ray in rays {
        hits += usize::from(pick(ray));
    }
    let mut next = 0;
    c.benchmark_group(format!("{map}, {class}")).bench_function(peer, |b| {
        b.iter_custom(|count| {
            let start = Instant::now();
            for _ in 0..count {
                black_box(pick(black_box(&rays[next])));
                next = if next + 1 == rays.len() { 0 } else { next + 1 };
            }
            let spent = start.elapsed();
            if count >= 100 {
                note(format!("{map}|{class}|{peer}"), spent.as_nanos() as f64 / count as f64);
            }
            spent
        });
    });
    note(format!("{map}|{class}|{peer} hits"), hits as f64);
}

fn once<R>(map: &Map, title: &str, work: impl FnOnce() -> R) -> R {
    let start = Instant::now();
    let result = work();
    note(format!("{}|{title}", map.name), start.elapsed().as_secs_f64() * 1e3);
    result
}

fn picks(c: &mut Criterion) {
    // Building on one thread, as the rays are.
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().expect("nobody has started the pool");
    let wanted = std::env::var("SEAMOUNT_BENCH_MAPS").unwrap_or_default();
    if wanted.is_empty() || wanted == "1201" {
        measure(c, &Map::andes());
        many(&Map::andes());
    }
    if wanted.is_empty() || wanted == "4097" {
        measure(c, &Map::generated());
    }
    print();
}

fn measure(c: &mut Criterion, map: &Map) {
    let field = &map.field;
    let mut pyramid = MinMaxPyramid::new(field);
    for _ in 0..5 {
        pyramid = once(map, "exact: build, ms", || MinMaxPyramid::new(field));
    }
    let (min, count) = SeamlessTerrain::default().resolutions;
    let tree = Hierarchy::new(field.cells(), Resolutions::new(min, count).expect("the default is valid"));
    let errors = once(map, "coarse: errors, ms", || FanErrors::new(field, &tree));
    let selection = Selection::of(&tree, &Full);
    let fans = once(map, "coarse: fans of all leaves, ms", || FanTree::new(field, &tree, &selection));
    let parts = Parts::new(tree.resolutions());
    let tiles = TileErrors::new(field, &tree, &parts);
    let (view, tolerance) = (map.view(), 1.0);
    let seen = Selection::of(&tree, &PixelError { tolerance, view: &view, errors: &tiles, pyramid: &pyramid });
    note(format!("{}|coarse: patches at 1 px", map.name), seen.patches(&tree).count() as f64);
    let seen_fans = once(map, "coarse: fans at 1 px, ms", || FanTree::new(field, &tree, &seen));
    let parry = once(map, "parry3d: build, ms", || map.parry());
    let bvh = once(map, "obvhs: build, ms", || map.bvh());
    let memory = [
        ("heights", field.samples().bytes()),
        ("exact: tree", pyramid.bytes()),
        ("coarse: fans", fans.bytes()),
        ("parry3d: heights", size_of_val(parry.heights().data())),
        ("obvhs: nodes and triangles", bvh.bytes()),
    ];
    for (title, bytes) in memory {
        note(format!("{}|{title}, MB", map.name), bytes as f64 / 1e6);
    }
    let exact = ExactSurface { field, pyramid: &pyramid };
    let coarse = CoarseSurface { field, tree: &tree, selection: &selection, fans: &fans, errors: &errors };
    let at_a_pixel = CoarseSurface { field, tree: &tree, selection: &seen, fans: &seen_fans, errors: &errors };
    let drawn = DrawnSurface { field, tree: &tree, parts: &parts, selection: &selection };
    let drawn = DrawnPick { drawn, pyramid: &pyramid };
    for class in CLASSES {
        let rays = map.rays(class);
        let coarse_pass = |coarse: &CoarseSurface| {
            let hits = |ray: &&LatticeRay| {
                let mut hit = None;
                coarse.intersect(black_box(ray), |h| {
                    hit = Some(h);
                    false
                });
                black_box(&hit).is_some()
            };
            rays.iter().filter(hits).count()
        };
        let exact_pass = || rays.iter().filter(|ray| black_box(&exact.first(black_box(ray))).is_some()).count();
        let best = in_turns([&exact_pass, &|| coarse_pass(&coarse), &|| coarse_pass(&at_a_pixel)]);
        for (name, (seconds, hits)) in ["exact", "leaves", "1 px"].into_iter().zip(best) {
            note(format!("{}|{class}|{name}", map.name), seconds * 1e9 / rays.len() as f64);
            note(format!("{}|{class}|{name} hits", map.name), hits.expect("a pass") as f64);
        }
        time(c, map.name, class, "drawn", &rays, |ray| {
            let mut hit = None;
            drawn.intersect(ray, |h| {
                hit = Some(h);
                false
            });
            hit.is_some()
        });
        let theirs: Vec<_> = rays
            .iter()
            .map(|ray| parry3d::query::Ray {
                origin: Vector::from_array(map.centred(ray.origin, 1.0)),
                dir: Vector::from_array(map.centred(ray.direction.normalize(), 0.0)).normalize(),
            })
            .collect();
        time(c, map.name, class, "parry3d", &theirs, |ray| {
            parry.cast_local_ray_and_get_normal(ray, f32::MAX, false).is_some()
        });
        let theirs: Vec<_> = rays
            .iter()
            .map(|ray| {
                let direction = Vec3A::from_array(map.centred(ray.direction.normalize(), 0.0)).normalize();
                Ray::new_inf(Vec3A::from_array(map.centred(ray.origin, 1.0)), direction)
            })
            .collect();
        time(c, map.name, class, "obvhs", &theirs, |ray| {
            let mut hit = RayHit::none();
            bvh.bvh.ray_traverse(*ray, &mut hit, |ray, id| bvh.triangles[id].intersect(ray))
        });
    }
}

/// `pick_many` on one core and on two: rays from above, a scene of one map.
fn many(map: &Map) {
    let mut scene = Scene::new();
    let root = scene.root();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/andes.png");
    scene.add(root, Texture2 { filename: path.display().to_string(), ..Texture2::default() }).expect("a node");
    scene.add(root, map.terrain()).expect("a node");
    let frame = map.terrain().frame(&map.field);
    let rays: Vec<WorldRay> = map
        .rays("camera")
        .iter()
        .map(|ray| {
            let (from, to) = (frame.local(ray.origin), frame.local(ray.origin + ray.direction));
            WorldRay::new(from, to - from).expect("a ray")
        })
        .collect();
    let pools = [1, 2].map(|threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool"));
    for surface in [Surface::Coarse, Surface::Exact] {
        let action = RayPickAction { surface, ..RayPickAction::pixel(0, 0, [1280, 720]) };
        let picker = action.picker(&scene).expect("a picker");
        let pass = |pool: &rayon::ThreadPool| pool.install(|| picker.pick_many(&rays, false)).expect("picks");
        let best = in_turns([&|| pass(&pools[0]), &|| pass(&pools[1])]);
        let [one, two] = best.map(|(seconds, found)| {
            let hits = found.expect("a pass").iter().filter(|hits| !hits.is_empty()).count();
            (seconds * 1e9 / rays.len() as f64, hits)
        });
        assert_eq!(one.1, two.1);
        let name = surface.name();
        note(format!("{}|pick_many, {name}: ns per ray on one core", map.name), one.0);
        note(format!("{}|pick_many, {name}: ns per ray on two cores", map.name), two.0);
        note(format!("{}|pick_many, {name}: times as fast on two cores", map.name), one.0 / two.0);
    }
}

fn print() {
    let table = TABLE.lock().unwrap_or_else(PoisonError::into_inner);
    let get = |title: String| table.iter().find(|(t, _)| *t == title).map(|&(_, value)| value);
    let mut maps: Vec<&str> = table.iter().filter_map(|(t, _)| t.split('|').next()).collect();
    maps.dedup();
    for map in maps {
        println!("\n{map}: ns per ray (share that hits)");
        println!(
            "{:<12}{:>16}{:>16}{:>16}{:>16}{:>16}{:>16}{:>9}{:>9}{:>9}{:>9}",
            "", "exact", "leaves", "1 px", "drawn", "parry3d", "obvhs", "×parry", "×obvhs", "leaves×", "1 px×"
        );
        for class in CLASSES {
            print!("{class:<12}");
            let ns = |peer: &str| get(format!("{map}|{class}|{peer}")).unwrap_or(f64::NAN);
            for peer in ["exact", "leaves", "1 px", "drawn", "parry3d", "obvhs"] {
                let share = get(format!("{map}|{class}|{peer} hits")).unwrap_or(0.0) / RAYS as f64;
                print!("{:>16}", format!("{:.0} ({:.2}%)", ns(peer), 100.0 * share));
            }
            let exact = ns("exact");
            let ratios = [ns("parry3d") / exact, ns("obvhs") / exact, exact / ns("leaves"), exact / ns("1 px")];
            println!("{:>9.1}{:>9.1}{:>9.2}{:>9.2}", ratios[0], ratios[1], ratios[2], ratios[3]);
        }
        for (title, value) in table.iter() {
            if let Some((m, what)) = title.split_once('|')
                && m == map
                && !what.contains('|')
            {
                println!("{what}: {value:.2}");
            }
        }
    }
}

fn config() -> Criterion {
    Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_millis(1500))
}

criterion_group! { name = benches; config = config(); targets = picks }
criterion_main!(benches);
