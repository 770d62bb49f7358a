//! Heights that blend between levels: weights are graded, both sides of a side have the same bits, the error stays within τ,
//! and no drawn point jumps further than the stated bound.
//!
//! A share runs by default, all of it with `SEAMOUNT_SOAK=1`.
#![allow(missing_docs, reason = "a test")]

mod common;

use std::collections::HashMap;
use std::path::Path;

use common::{Rng, cracks, doubled_area};
use glam::{DAffine3, DVec2, DVec3};
use seamount::action::{Lens, Viewpoint};
use seamount::node::{SeamlessTerrain, lattice_view};
use seamount::prelude::*;
use seamount::terrain::{
    ActivePatch, Detail, DrawnSurface, HeightField, Hierarchy, LatticeFrame, LatticeView, LodEye, MorphPixelError,
    PatchTree, PixelProjection, Precision, Resolutions, Selection, Terrain, Urgency, Voids, generate, screen_error,
};

struct Map {
    name: &'static str,
    terrain: Terrain,
    frame: LatticeFrame,
}

fn soak() -> bool {
    std::env::var_os("SEAMOUNT_SOAK").is_some()
}

/// Maps of the scenes, and small ones: of a size that is a whole number of patches and not, the smallest there is, spikes.
fn maps() -> Vec<Map> {
    let metres = |x, y| SeamlessTerrain {
        size: Some(DVec2::new(x, y)),
        max_height: 65_535.0,
        base_height: -1_000.0,
        ..SeamlessTerrain::default()
    };
    let open = |name: &'static str, void, node: SeamlessTerrain| {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.png"));
        let field = Image::open(&path).unwrap().height_field(void).unwrap();
        let frame = node.frame(&field);
        Map { name, terrain: Terrain::new(field), frame }
    };
    let small = |name, field: HeightField| {
        let node = SeamlessTerrain { scale: 1000.0, max_height: 20.0, ..SeamlessTerrain::default() };
        let frame = node.frame(&field);
        Map { name, terrain: Terrain::new(field), frame }
    };
    let noise = |columns: u32, rows: u32, share: u32| {
        let mut rng = Rng(u64::from(columns));
        let samples =
            (0..columns * rows).map(|_| if rng.below(share) == 0 { rng.below(3000) as u16 } else { 300 }).collect();
        HeightField::from_u16(columns, rows, samples, Voids::default()).unwrap()
    };
    let floats = {
        let field = generate(129, 8).unwrap();
        let samples = (0..129 * 100).map(|i| field.raw(i % 129, i / 129) as f32 / 65_535.0).collect();
        HeightField::from_f32(129, 100, samples, Voids::default()).unwrap()
    };
    let mut maps = vec![
        open("fuji", Some(0.0), metres(90_600.0, 111_240.0)),
        open("jacksboro", None, metres(29_949.0, 31_796.0)),
        small("generated", generate(257, 7).unwrap()),
        small("cut", noise(344, 403, 40)),
        small("noise", noise(130, 70, 1)),
        small("floats", floats),
        small("2 × 2", noise(2, 2, 1)),
        small("3 × 5", noise(3, 5, 1)),
    ];
    if soak() {
        maps.push(open("andes", None, metres(93_840.0, 111_240.0)));
        maps.push(open("puget", None, metres(163_840.0, 163_840.0)));
        let walls = SeamlessTerrain { scale: 700.0, max_height: 100.0, ..SeamlessTerrain::default() };
        maps.push(open("walls", None, walls));
    }
    maps
}

impl Map {
    fn tree(&self, min: u32) -> std::sync::Arc<PatchTree> {
        self.terrain.tree(Resolutions::new(min, 2).unwrap())
    }

    fn extent(&self) -> DVec2 {
        let [dx, dy] = self.frame.cell_size;
        let [cu, cv] = self.frame.cells.map(f64::from);
        DVec2::new(cu * dx, cv * dy)
    }

    /// World height of the ground at a place, or of the nearest.
    fn ground(&self, place: DVec2) -> f64 {
        let p = self.frame.lattice(place.extend(0.0));
        let [cu, cv] = self.frame.cells.map(f64::from);
        let raw = self.terrain.field().surface(p.x.clamp(0.0, cu), p.y.clamp(0.0, cv)).unwrap();
        self.frame.base + raw * self.frame.z_step
    }

    fn lattice_view(&self, camera: &Viewpoint) -> LatticeView {
        lattice_view(camera, &DAffine3::IDENTITY, &self.frame)
    }

    fn mesh<'t>(&'t self, tree: &'t PatchTree, selection: &'t Selection) -> DrawnSurface<'t> {
        DrawnSurface { field: self.terrain.field(), tree: tree.hierarchy(), parts: tree.parts(), selection }
    }
}

fn viewpoint(eye: DVec3, yaw: f64, pitch: f64, lens: Lens) -> Viewpoint {
    let forward = DVec3::new(yaw.cos() * pitch.cos(), yaw.sin() * pitch.cos(), pitch.sin());
    let right = DVec3::new(yaw.sin(), -yaw.cos(), 0.0);
    let up = right.cross(forward);
    Viewpoint {
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
    }
}

/// An eye over, beside, under or on the map, looking anywhere but up; every fifth camera is orthographic, every seventh looks
/// straight down.
fn view(rng: &mut Rng, map: &Map, k: u32) -> Viewpoint {
    let extent = map.extent();
    let place = DVec2::new(rng.range(-0.2, 1.2), rng.range(-0.2, 1.2)) * extent;
    let above = match k % 6 {
        0 => 0.0,
        1 => -rng.unit() * 0.1 * extent.x,
        _ => rng.unit().powi(3) * extent.x + 2.0,
    };
    let pitch = if k % 7 == 6 { -std::f64::consts::FRAC_PI_2 } else { rng.range(-1.57, 0.05) };
    let lens = if k % 5 == 4 {
        Lens::Orthographic { half_height: rng.range(0.02, 0.6) * extent.x }
    } else {
        Lens::Perspective { tan_half_height: rng.range(0.1, 1.0) }
    };
    let camera = viewpoint(place.extend(map.ground(place) + above), rng.range(0.0, std::f64::consts::TAU), pitch, lens);
    Viewpoint { center: rng.aside(), ..camera }
}

/// Patches with weight touch complete patches only, nothing is forced, the mesh tiles the map, and every vertex has one height,
/// to the bit, whichever triangle of whichever patch it belongs to.
fn check(map: &Map, tree: &PatchTree, selection: &Selection, what: &str) -> usize {
    let name = map.name;
    let shape = tree.hierarchy();
    assert!(selection.morphs());
    let mut partly = 0;
    for level in 0..=shape.depth() {
        for id in shape.patches(level) {
            let own = selection.weights(shape, id).unwrap().inside;
            assert!((0.0..=1.0).contains(&own), "{name}, {what}: {own}");
            partly += usize::from(own > 0.0 && own < 1.0);
            let finer = shape.touching_below(id).find(|&c| selection.weights(shape, c).unwrap().inside > 0.0);
            assert!(finer.is_none() || own == 1.0, "{name}, {what}: {id:?} has {own} beside {finer:?}");
        }
    }
    assert_eq!(selection.forced(), 0, "{name}, {what}");
    let found = cracks(shape, selection);
    assert!(found.is_empty(), "{name}, {what}: {}", found[0]);
    let [cu, cv] = shape.cells().map(u64::from);
    assert_eq!(doubled_area(shape, selection), 2 * cu * cv);
    let mut heights: HashMap<[u32; 2], f64> = HashMap::new();
    for patch in selection.patches(shape) {
        for triangle in map.mesh(tree, selection).triangles(patch) {
            for (corner, height) in triangle.corners.into_iter().zip(triangle.heights) {
                let known = *heights.entry(corner).or_insert(height);
                assert_eq!(known.to_bits(), height.to_bits(), "{name}, {what}: {corner:?} at {known} and {height}");
            }
        }
    }
    partly
}

#[test]
fn weights_are_graded_and_both_sides_have_the_same_heights() {
    let eyes = if soak() { 60 } else { 6 };
    for map in maps() {
        let mut rng = Rng(3);
        let mut partly = 0;
        for k in 0..eyes {
            let tree = map.tree([8, 2, 4][k as usize % 3]);
            let view = map.lattice_view(&view(&mut rng, &map, k));
            for tolerance in [0.0, 0.5, 2.0, 16.0, f64::INFINITY] {
                // Every cell of a large map, vertex by vertex, says no more than one of a small map.
                if tolerance == 0.0 && map.terrain.field().columns() > 500 {
                    continue;
                }
                let selection = tree.select(&map.terrain, &Detail::MorphPixelError { tolerance, view: view.clone() });
                partly += check(&map, &tree, &selection, &format!("eye {k}, τ = {tolerance}"));
            }
            let [cu, cv] = map.frame.cells.map(f64::from);
            let eye = match k % 3 {
                0 => LodEye::Everywhere { distance: rng.range(0.0, 3.0) * cu },
                1 => LodEye::Point { u: (cu * rng.unit()).round(), v: (cv * rng.unit()).round(), height: 0.0 },
                _ => LodEye::Point { u: cu * rng.unit(), v: cv * rng.unit(), height: cu * rng.unit() },
            };
            for precision in [0.3, 1.0, 4.0] {
                let selection = tree.select(&map.terrain, &Detail::MorphPrecision(Precision { precision, eye }));
                partly += check(&map, &tree, &selection, &format!("eye {k}, ρ = {precision} at {eye:?}"));
            }
        }
        println!("{}: {partly} patches in between", map.name);
        // A map of a cell or a few has nothing to blend: leaves of 2 × 2 samples are coarse and fine in one.
        assert!(partly > 0 || map.terrain.field().columns() < 4, "{}: nothing blends", map.name);
    }
}

#[test]
fn the_measured_error_is_within_the_allowed_one() {
    let eyes = if soak() { 60 } else { 6 };
    for map in maps() {
        let mut rng = Rng(42);
        let tree = map.tree(8);
        let (mut closeness, mut count): (f64, u32) = (0.0, 0);
        for k in 0..eyes {
            let view = map.lattice_view(&view(&mut rng, &map, k));
            for tolerance in [0.0, 0.5, 1.0, 4.0] {
                let selection = tree.select(&map.terrain, &Detail::MorphPixelError { tolerance, view: view.clone() });
                let patches: Vec<ActivePatch> = selection.patches(tree.hierarchy()).collect();
                let error = screen_error(&map.mesh(&tree, &selection), &patches, &view);
                assert!(error.max <= tolerance, "{} eye {k}: {error:?} for τ = {tolerance}", map.name);
                if error.max > 0.0 {
                    closeness += error.max / tolerance;
                    count += 1;
                }
            }
        }
        println!("{}: largest error / τ is {:.2} on the mean of {count}", map.name, closeness / f64::from(count));
        assert!(count > 0 || map.terrain.field().columns() < 4, "{}: no eye sees coarse ground", map.name);
    }
}

/// One frame of a flight: what is drawn at each sample, and how near the boxes of its patch and of those beside it are.
struct Flown {
    view: LatticeView,
    drawn: Vec<f64>,
    near: Vec<f64>,
    /// Whether the border of the map cuts the coarse cell that the sample lies in.
    cut: Vec<bool>,
}

fn fly(map: &Map, tree: &PatchTree, camera: &Viewpoint, tolerance: f64, morph: bool) -> Flown {
    let view = map.lattice_view(camera);
    let detail = if morph {
        Detail::MorphPixelError { tolerance, view: view.clone() }
    } else {
        Detail::PixelError { tolerance, view: view.clone() }
    };
    let selection = tree.select(&map.terrain, &detail);
    let field = map.terrain.field();
    let shape = tree.hierarchy();
    let errors = tree.morph_errors(field);
    let depth = |id| {
        let [low, high] = errors.hull(shape, id);
        let d = view.depth;
        [(d.x, low.x, high.x), (d.y, low.y, high.y), (d.z, low.z, high.z)]
            .into_iter()
            .map(|(n, a, b)| (n * a).min(n * b))
            .sum::<f64>()
            + d.w
    };
    let width = field.columns() as usize;
    let samples = width * field.rows() as usize;
    let (mut drawn, mut near, mut cut) = (vec![f64::NAN; samples], vec![f64::INFINITY; samples], vec![false; samples]);
    for patch in selection.patches(shape) {
        let nearest = seamount::terrain::Side::ALL
            .into_iter()
            .filter_map(|side| shape.neighbour(patch.id, side))
            .map(depth)
            .fold(depth(patch.id), f64::min);
        let coarse = 2 * shape.step(patch.id.level);
        let whole = shape.cells().map(|n| f64::from(n / coarse * coarse));
        for triangle in map.mesh(tree, &selection).triangles(patch) {
            seamount::terrain::errors::overlay_heights(field, triangle.corners, triangle.heights, |u, v, _, height| {
                if u.fract() == 0.0 && v.fract() == 0.0 {
                    let at = v as usize * width + u as usize;
                    drawn[at] = height;
                    near[at] = near[at].min(nearest);
                    cut[at] |= u > whole[0] || v > whole[1];
                }
            });
        }
    }
    Flown { view, drawn, near, cut }
}

/// Largest jumps of a flight in pixels: of samples within whole cells, of those in cells that the border cuts, and the largest
/// share of the bound that a jump was.
#[derive(Debug, Default)]
struct Jumps {
    whole: f64,
    cut: f64,
    share: f64,
    points: u64,
}

fn jumps(map: &Map, start: &Viewpoint, step: DVec3, frames: u32, tolerance: f64, morph: bool) -> Jumps {
    let tree = map.tree(8);
    let field = map.terrain.field();
    let width = field.columns();
    let mut found = Jumps::default();
    let mut last: Option<Flown> = None;
    for k in 0..frames {
        let camera = Viewpoint { eye: start.eye + step * f64::from(k), ..*start };
        let now = fly(map, &tree, &camera, tolerance, morph);
        if let Some(last) = &last {
            for i in 0..now.drawn.len() {
                let (u, v) = (i as u32 % width, i as u32 / width);
                let place = |w: f64| DVec3::new(f64::from(u), f64::from(v), w);
                let surface = place(field.raw(u, v));
                let frames = [last, &now];
                let seen = |f: &Flown| f.view.frustum.contains(surface) && f.view.frustum.contains(place(f.drawn[i]));
                if !frames.into_iter().all(seen) {
                    continue;
                }
                found.points += 1;
                let off = |f: &Flown| f.view.pixel(place(f.drawn[i])) - f.view.pixel(surface);
                let jump = off(last).distance(off(&now));
                if last.cut[i] || now.cut[i] {
                    found.cut = found.cut.max(jump);
                    continue;
                }
                found.whole = found.whole.max(jump);
                // κ = 1 + r / sin θ, at the ray to the point: its angle is not larger than the largest of the box.
                let PixelProjection::Perspective { tangents: [_, tangents], .. } = now.view.projection else {
                    panic!()
                };
                let r = (1.0 + tangents.length_squared()).sqrt();
                let axes = |p: DVec3, w: f64| {
                    let p = p.extend(w);
                    DVec3::new(now.view.right.dot(p), now.view.up.dot(p), now.view.depth.dot(p))
                };
                let (vertical, ray) = (axes(DVec3::Z, 0.0), axes(surface, 1.0));
                let sine = vertical.cross(ray).length() / (vertical.length() * ray.length());
                let delta = step.length();
                let near = last.near[i].min(now.near[i]) - delta;
                if near > 0.0 {
                    let bound = 8.0 * tolerance * (1.0 + r / sine) * delta / near;
                    found.share = found.share.max(jump / bound);
                    assert!(
                        !morph || jump <= bound * (1.0 + 1e-9) + 1e-9,
                        "{} frame {k}: ({u}, {v}) jumps by {jump}, bound {bound}",
                        map.name
                    );
                }
            }
        }
        last = Some(now);
    }
    found
}

#[test]
fn no_drawn_point_jumps_in_a_slow_flight() {
    let mut most: [f64; 2] = [0.0; 2];
    let (tolerance, frames) = (1.0, if soak() { 60 } else { 8 });
    for map in maps() {
        if map.terrain.field().columns() < 100 {
            continue;
        }
        let mut all = [Jumps::default(), Jumps::default()];
        // Low over the ground and looking along it; higher, from beyond the south border, which is in view with the east one.
        for (place, above, yaw, pitch) in [((0.45, 0.2), 0.06, 1.4, -0.5), ((0.75, -0.15), 0.4, 1.3, -0.7)] {
            let extent = map.extent();
            let place = extent * DVec2::from(place);
            let above = above * extent.x;
            let eye = place.extend(map.ground(place) + above);
            let start = viewpoint(eye, yaw, pitch, Lens::Perspective { tan_half_height: 0.5 });
            let step = DVec3::new(0.3, 1.0, -0.1).normalize() * above * 2e-3;
            for (all, morph) in all.iter_mut().zip([true, false]) {
                let found = jumps(&map, &start, step, frames, tolerance, morph);
                all.whole = all.whole.max(found.whole);
                all.cut = all.cut.max(found.cut);
                all.share = all.share.max(found.share);
                all.points += found.points;
            }
        }
        let [with, without] = all;
        println!(
            "{}: {} samples; largest jump {:.4} px with and {:.4} px without; in cells that the border cuts {:.4} and {:.4}; \
             at most {:.2} of the bound",
            map.name, with.points, with.whole, without.whole, with.cut, without.cut, with.share
        );
        assert!(with.points > 1000, "{}: sees nothing", map.name);
        assert!(with.cut <= 1.75 * tolerance, "{}: {with:?}", map.name);
        assert!(with.whole > 0.0, "{}: nothing blends", map.name);
        most = [most[0].max(with.whole), most[1].max(without.whole)];
    }
    // On a small map a short flight may meet no change of the mesh.
    assert!(most[1] > 100.0 * most[0], "{most:?}");
}

/// A camera that sees no vertical error, or sees all from anywhere, or whose tolerance is 0 over 0, gets a number.
#[test]
fn urgency_is_never_nan() {
    for map in maps() {
        let tree = map.tree(8);
        let shape: &Hierarchy = tree.hierarchy();
        let errors = tree.morph_errors(map.terrain.field());
        let eye = map.extent().extend(0.0) * 0.5;
        for lens in [Lens::Orthographic { half_height: 1.0 }, Lens::Perspective { tan_half_height: 0.5 }] {
            for above in [0.0, 1.0, 1e9] {
                let camera = viewpoint(eye + DVec3::Z * above, 0.0, -std::f64::consts::FRAC_PI_2, lens);
                let camera = Viewpoint { forward: DVec3::NEG_Z, up: DVec3::X, ..camera };
                let view = map.lattice_view(&camera);
                for tolerance in [0.0, 1e-300, 1.0, 1e300, f64::INFINITY] {
                    let metric = MorphPixelError { tolerance, view: &view, errors };
                    for id in (0..=shape.depth()).flat_map(|level| shape.patches(level)) {
                        let e = metric.urgency(shape, id);
                        assert!(e >= 0.0, "{}: {e}", map.name);
                    }
                }
            }
        }
        for (precision, distance) in [(f64::INFINITY, 0.0), (f64::INFINITY, f64::INFINITY), (1.0, 0.0)] {
            let metric = Precision { precision, eye: LodEye::Everywhere { distance } };
            assert!(shape.roots().all(|id| metric.urgency(shape, id) >= 0.0));
        }
    }
}
