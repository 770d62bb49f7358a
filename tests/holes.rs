//! Voids as holes: no triangle that is drawn touches a void, picks pass through the same holes, boxes leave them out, and
//! with an error in pixels the outline of a hole is where it belongs to within that error.
//!
//! The judges look at every triangle and every sample in f64. A share of the cases runs by default, all of them with
//! `SEAMOUNT_SOAK=1`.
#![allow(missing_docs, reason = "a test")]

mod common;

use std::collections::HashMap;
use std::f64::consts::TAU;
use std::sync::Arc;

use common::Rng;
use glam::{DAffine3, DVec3};
use seamount::action::{Geometry, Lens, TerrainDraw, Viewpoint};
use seamount::node::{HitDetail, lattice_view};
use seamount::prelude::*;
use seamount::terrain::pick::{CoarseSurface, FanTree, LatticeRay};
use seamount::terrain::{
    Detail, DrawnSurface, ExactHit, ExactSurface, HeightField, Instances, LatticeFrame, LatticeView, LodEye,
    MinMaxPyramid, PatchTree, Resolutions, Selection, Terrain, Voids,
};

fn soak() -> bool {
    std::env::var_os("SEAMOUNT_SOAK").is_some()
}

type IsVoid = Box<dyn Fn(u32, u32) -> bool>;

/// Kinds of voids, for maps of at least 2 × 2 samples.
fn masks(columns: u32, rows: u32) -> Vec<(&'static str, IsVoid)> {
    let random = |seed: u64, percent: u32| -> IsVoid {
        Box::new(move |c, r| Rng(seed ^ u64::from(r) << 32 ^ u64::from(c)).below(100) < percent)
    };
    vec![
        ("alone", Box::new(move |c, r| (c, r) == (columns / 2 + 1, rows / 3))),
        ("on the lattice of all levels", Box::new(|c, r| (c, r) == (16, 16))),
        ("in the corner", Box::new(|c, r| (c, r) == (0, 0))),
        ("a block", Box::new(move |c, r| (columns / 4..columns / 2).contains(&c) && (rows / 4..rows / 2).contains(&r))),
        ("a ragged border", Box::new(move |c, r| c < 3 + (r * 7) % 4 || r + 3 > rows - (c * 5) % 3)),
        ("every other", Box::new(|c, r| (c + r) % 2 == 1)),
        ("every third", Box::new(|c, r| (c + 2 * r) % 3 == 0 && c % 2 == 0)),
        ("the columns at the border", Box::new(move |c, _| c == 0 || c + 1 == columns)),
        ("everything", Box::new(|_, _| true)),
        ("some", random(1, 4)),
        ("most", random(2, 60)),
        ("all but an island", Box::new(move |c, r| c.abs_diff(columns / 2).pow(2) + r.abs_diff(rows / 2).pow(2) > 40)),
        ("a bay", Box::new(move |c, r| c > columns / 3 && r > rows / 3 && (c + r) % 7 != 0)),
    ]
}

/// Hills with some noise, 0..40 raw units high: as steep as cells are wide. Voids are `65535`, or NaN.
fn land(columns: u32, rows: u32, floats: bool, void: &dyn Fn(u32, u32) -> bool) -> HeightField {
    let mut rng = Rng(u64::from(columns * 1000 + rows));
    let mut samples = Vec::new();
    for (c, r) in (0..rows).flat_map(|r| (0..columns).map(move |c| (c, r))) {
        let (x, y) = (f64::from(c), f64::from(r));
        let height =
            (16.0 + 8.0 * (x * 0.31).sin() + 6.0 * (y * 0.23 + x * 0.1).cos()).floor() + rng.range(0.0, 4.0).floor();
        samples.push(if void(c, r) { None } else { Some(height) });
    }
    if floats {
        let samples = samples.into_iter().map(|h| h.map_or(f32::NAN, |h| h as f32)).collect();
        HeightField::from_f32(columns, rows, samples, Voids::default()).unwrap()
    } else {
        let samples = samples.into_iter().map(|h| h.map_or(u16::MAX, |h| h as u16)).collect();
        HeightField::from_u16(columns, rows, samples, Voids { sample: Some(65_535.0) }).unwrap()
    }
}

/// A map with its voids as holes, and the same map with its voids filled.
struct Land {
    name: String,
    holes: Terrain,
    filled: Terrain,
}

fn lands() -> Vec<Land> {
    let mut lands = Vec::new();
    for (k, (columns, rows)) in [(33, 33), (45, 38), (20, 70), (2, 2), (3, 5)].into_iter().enumerate() {
        for (name, void) in masks(columns, rows) {
            let floats = k % 2 == 1;
            lands.push(Land {
                name: format!("{columns} × {rows}, {name}"),
                holes: Terrain::new(land(columns, rows, floats, &void).with_holes()),
                filled: Terrain::new(land(columns, rows, floats, &void)),
            });
        }
    }
    lands
}

fn samples(field: &HeightField) -> impl Iterator<Item = [u32; 2]> + use<> {
    let (columns, rows) = (field.columns(), field.rows());
    (0..rows).flat_map(move |r| (0..columns).map(move |c| [c, r]))
}

/// The corners of all full-resolution triangles, with what the definition says of them: ground if no corner is void.
fn triangles(field: &HeightField) -> impl Iterator<Item = ([[u32; 2]; 3], bool)> + '_ {
    let [cu, cv] = field.cells();
    let cells = (0..cv).flat_map(move |r| (0..cu).map(move |c| (c, r)));
    cells.flat_map(|(c, r)| {
        let corners = [[c, r], [c + 1, r], [c, r + 1], [c + 1, r + 1]];
        [[corners[0], corners[1], corners[3]], [corners[0], corners[2], corners[3]]]
            .map(|t| (t, t.iter().all(|&[c, r]| !field.is_void(c, r))))
    })
}

fn at(field: &HeightField, [c, r]: [u32; 2]) -> DVec3 {
    DVec3::new(c.into(), r.into(), field.raw(c, r))
}

/// A camera over, beside, near or far from a map whose cells and raw units are all as long as one another.
fn camera(rng: &mut Rng, field: &HeightField) -> LatticeView {
    let frame = LatticeFrame { cells: field.cells(), cell_size: [1.0, 1.0], base: 0.0, z_step: 1.0 };
    let [cu, cv] = field.cells().map(f64::from);
    let target = DVec3::new(rng.range(0.0, cu), rng.range(0.0, cv), 15.0);
    let (yaw, pitch) = (rng.range(0.0, TAU), -rng.range(0.02, 1.5));
    let forward = DVec3::new(yaw.cos() * pitch.cos(), yaw.sin() * pitch.cos(), pitch.sin());
    let distance = 10f64.powf(rng.range(0.7, 3.0));
    let right = forward.cross(DVec3::Z).normalize();
    let lens = if rng.below(4) == 0 {
        Lens::Orthographic { half_height: rng.range(5.0, 100.0) }
    } else {
        Lens::Perspective { tan_half_height: rng.range(0.2, 1.0) }
    };
    let view = Viewpoint {
        eye: frame.local(target) - forward * distance,
        right,
        up: right.cross(forward),
        forward,
        lens,
        center: rng.aside(),
        aspect: 1.5,
        pixels: 600.0,
        near: 1e-3,
        far: None,
    };
    lattice_view(&view, &DAffine3::IDENTITY, &frame)
}

fn detail(rng: &mut Rng, field: &HeightField) -> Detail {
    match rng.below(6) {
        0 => Detail::Leaves,
        1 => {
            let [u, v] = field.cells().map(|n| rng.range(0.0, f64::from(n)));
            let eye = LodEye::Point { u, v, height: rng.range(0.0, 30.0) };
            Detail::precision(10f64.powf(rng.range(-1.0, 1.0)), eye)
        }
        _ => Detail::PixelError { tolerance: 10f64.powf(rng.range(-0.5, 2.0)), view: camera(rng, field) },
    }
}

fn resolutions(rng: &mut Rng) -> Resolutions {
    Resolutions::new(2 << rng.below(2), 2 + rng.below(4)).unwrap()
}

/// The corners of all triangles that lists ask to be drawn, those without area left out, sorted.
fn listed(instances: &Instances, tree: &PatchTree, cells: [u32; 2]) -> Vec<[[u32; 2]; 3]> {
    let parts = tree.parts();
    let mut found = Vec::new();
    for (part, range) in instances.ranges() {
        let triangles = parts.range(*part);
        for instance in &instances.data()[range.start as usize..range.end as usize] {
            for triangle in &parts.all_triangles()[triangles.start as usize..triangles.end as usize] {
                found.push(triangle.map(|unit| {
                    [0, 1].map(|k| (instance.origin[k] + instance.step * u32::from(unit[k])).min(cells[k]))
                }));
            }
        }
    }
    found.extend(instances.loose().chunks_exact(3).map(|t| [t[0].point, t[1].point, t[2].point]));
    found.sort_unstable();
    found
}

fn doubled_area([a, b, c]: [[u32; 2]; 3]) -> i64 {
    let [a, b, c] = [a, b, c].map(|p| p.map(i64::from));
    (b[1] - a[1]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[1] - a[1])
}

#[test]
fn no_triangle_drawn_touches_a_void_and_the_lists_are_the_drawn_surface() {
    let mut rng = Rng(11);
    let (mut drawn_in_all, mut left_out) = (0, 0);
    for land in lands() {
        let field = land.holes.field();
        for _ in 0..if soak() { 60 } else { 8 } {
            let tree = land.holes.tree(resolutions(&mut rng));
            let selection = tree.select(&land.holes, &detail(&mut rng, field));
            let hierarchy = tree.hierarchy();
            let drawn = DrawnSurface { field, tree: hierarchy, parts: tree.parts(), selection: &selection };
            let holed = tree.holed(field);
            let (mut loose, mut whole) = (Vec::new(), Vec::new());
            let mut wanted = Vec::new();
            for patch in selection.patches(hierarchy) {
                for triangle in drawn.triangles(patch) {
                    for [c, r] in triangle.corners {
                        assert!(!field.is_void(c, r), "{}: {triangle:?} of {patch:?}", land.name);
                    }
                    wanted.push(triangle.corners);
                }
                if holed.get(hierarchy.index(patch.id)) == Some(&true) {
                    loose.push(patch)
                } else {
                    whole.push(patch)
                }
                left_out += selection_triangles(&tree, patch) - drawn.triangles(patch).count();
            }
            wanted.sort_unstable();
            drawn_in_all += wanted.len();
            let mut instances = Instances::default();
            instances.update(hierarchy, tree.parts(), &whole);
            instances.update_loose(&drawn, &loose);
            assert_eq!(listed(&instances, &tree, field.cells()), wanted, "{}", land.name);
            assert_eq!(instances.triangles() + instances.loose().len() as u64 / 3, wanted.len() as u64);
            // No list keeps what it had.
            instances.update(hierarchy, tree.parts(), &whole);
            assert!(instances.loose().is_empty());
        }
    }
    assert!(drawn_in_all > 10_000 && left_out > 10_000, "{drawn_in_all} drawn, {left_out} left out");
}

fn selection_triangles(tree: &PatchTree, patch: seamount::terrain::ActivePatch) -> usize {
    seamount::terrain::parts_of(patch.sides).into_iter().map(|part| tree.parts().triangles(part).len()).sum()
}

#[test]
fn full_detail_draws_each_triangle_of_the_ground_once() {
    for land in lands() {
        let field = land.holes.field();
        let mut wanted: Vec<[[u32; 2]; 3]> = triangles(field).filter(|(_, ground)| *ground).map(|(t, _)| t).collect();
        wanted.iter_mut().for_each(|t| t.sort_unstable());
        wanted.sort_unstable();
        let tree = land.holes.tree(Resolutions::new(4, 2).unwrap());
        let selection = tree.select(&land.holes, &Detail::Leaves);
        let drawn = DrawnSurface { field, tree: tree.hierarchy(), parts: tree.parts(), selection: &selection };
        let all = selection.patches(tree.hierarchy()).flat_map(|patch| drawn.triangles(patch));
        let mut found: Vec<_> = all.map(|t| t.corners).filter(|t| doubled_area(*t) > 0).collect();
        found.iter_mut().for_each(|t| t.sort_unstable());
        found.sort_unstable();
        assert_eq!(found, wanted, "{}", land.name);
        // Each sample of the ground is a corner of it: nothing is ground that is not drawn.
        for [c, r] in samples(field) {
            assert_eq!(!field.is_hole(c, r), wanted.iter().flatten().any(|&p| p == [c, r]), "{} ({c}, {r})", land.name);
        }
    }
}

/// A ray through a small map: in all directions; through samples, along grid lines and diagonals; straight down and up; from
/// within holes; from below.
fn ray(rng: &mut Rng, field: &HeightField) -> LatticeRay {
    let [cu, cv] = field.cells().map(f64::from);
    let place = |rng: &mut Rng| DVec3::new(rng.range(0.0, cu), rng.range(0.0, cv), rng.range(0.0, 34.0));
    let sample = |rng: &mut Rng| at(field, [rng.below(field.columns()), rng.below(field.rows())]);
    let whole = |rng: &mut Rng| f64::from(rng.below(9) as i32 - 4);
    let (origin, direction) = match rng.below(8) {
        0 => {
            let (a, b) = (place(rng), place(rng));
            (a - (b - a) * 3.0, b - a)
        }
        // Through a sample, exactly.
        1 | 2 => {
            let direction = DVec3::new(whole(rng), whole(rng), whole(rng) * 0.5 - 0.25);
            (sample(rng) - direction * 8.0, direction)
        }
        // Along a line of columns, of rows, or a diagonal.
        3 => {
            let along = [DVec3::X, DVec3::Y, DVec3::new(1.0, 1.0, 0.0)][rng.below(3) as usize];
            let direction = along.with_z(rng.range(-0.5, 0.5));
            (sample(rng) - direction * 50.0, direction)
        }
        // Vertical, anywhere, on lines and through samples.
        4 => {
            let p = if rng.below(2) == 0 { place(rng) } else { sample(rng) };
            let p = if rng.below(3) == 0 { DVec3::new(p.x, p.y.round(), p.z) } else { p };
            let down = rng.below(2) == 0;
            (p.with_z(if down { 100.0 } else { -100.0 }), if down { DVec3::NEG_Z } else { DVec3::Z })
        }
        // Along rays like those of a camera.
        5 | 6 => {
            let eye = DVec3::new(rng.range(-cu, 2.0 * cu), rng.range(-cv, 2.0 * cv), rng.range(-60.0, 90.0));
            (eye, place(rng) - eye)
        }
        // From within the map, on either side of the surface.
        _ => (place(rng), place(rng) - place(rng)),
    };
    LatticeRay { origin, direction, near: 0.0, far: f64::INFINITY }
}

/// Möller and Trumbore's test in f64, with what rounding may put beside the triangle: the parameter.
fn meets(ray: &LatticeRay, [a, b, c]: [DVec3; 3]) -> Option<f64> {
    const SLACK: f64 = 1e-9;
    let (e1, e2) = (b - a, c - a);
    let p = ray.direction.cross(e2);
    let det = e1.dot(p);
    if det == 0.0 {
        return None;
    }
    let s = ray.origin - a;
    let q = s.cross(e1);
    let (u, v) = (s.dot(p) / det, ray.direction.dot(q) / det);
    let t = e2.dot(q) / det;
    (u >= -SLACK && v >= -SLACK && u + v <= 1.0 + SLACK && t >= ray.near && t <= ray.far).then_some(t)
}

/// What a ray meets of a surface with holes.
#[derive(Debug)]
struct Met {
    from: f64,
    to: f64,
    /// +1 out of the ground, −1 into it, 0 where it only touches.
    change: i32,
    ground: bool,
    lid: bool,
}

/// All places where a ray meets the surface and the lids over its holes; `None` where rounding decides.
fn brute(field: &HeightField, ray: &LatticeRay) -> Option<Vec<Met>> {
    const APART: f64 = 1e-6;
    let mut all: Vec<(f64, bool)> =
        triangles(field).filter_map(|(t, ground)| Some((meets(ray, t.map(|p| at(field, p)))?, ground))).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut found: Vec<Met> = Vec::new();
    for (t, ground) in all {
        match found.last_mut() {
            Some(last) if t - last.to < APART => {
                last.to = t;
                last.ground |= ground;
                last.lid |= !ground;
            }
            _ => found.push(Met { from: t, to: t, change: 0, ground, lid: !ground }),
        }
    }
    // The part of the ray over the map.
    let (mut near, mut far) = (ray.near, 1e4f64);
    for axis in 0..2 {
        let (o, d, last) = (ray.origin[axis], ray.direction[axis], f64::from(field.cells()[axis]));
        if d != 0.0 {
            let (a, b) = ((0.0 - o) / d, (last - o) / d);
            (near, far) = (near.max(a.min(b)), far.min(a.max(b)));
        }
    }
    let above = |t: f64| {
        let p = ray.origin + ray.direction * t;
        let f = p.z - field.filled_surface(p.x, p.y)?;
        // Within the surface, or too close to say.
        (f.abs() > 1e-7).then_some(if f > 0.0 { 1 } else { -1 })
    };
    let mut before = near;
    let mut sign = None;
    for k in 0..found.len() {
        let after = found.get(k + 1).map_or(far, |next| next.from);
        let Met { from, to, .. } = found[k];
        if from - before < APART || after - to < APART {
            return None;
        }
        let s = match sign {
            Some(sign) => sign,
            None => above(0.5 * (before + from))?,
        };
        let e = above(0.5 * (to + after))?;
        found[k].change = (e - s) / 2;
        sign = Some(e);
        before = to;
    }
    Some(found)
}

#[test]
fn exact_picks_are_those_of_every_triangle_of_the_ground() {
    let mut rng = Rng(5);
    let (mut judged, mut hits_in_all, mut from_below, mut through) = (0, 0, 0, 0);
    for land in lands() {
        let field = land.holes.field();
        let surface = ExactSurface { field, pyramid: land.holes.pyramid() };
        for _ in 0..if soak() { 20_000 } else { 600 } {
            let ray = ray(&mut rng, field);
            if ray.direction == DVec3::ZERO {
                continue;
            }
            let mut hits: Vec<ExactHit> = Vec::new();
            surface.intersect(&ray, |hit| {
                hits.push(hit);
                true
            });
            assert_eq!(surface.first(&ray), hits.first().copied());
            for hit in &hits {
                assert!(field.is_ground(hit.cell, hit.upper), "{}: {ray:?} hits a hole: {hit:?}", land.name);
                let [c, r] = hit.cell.map(f64::from);
                let (fu, fv) = (hit.point.x - c, hit.point.y - r);
                assert!((0.0..=1.0).contains(&fu) && (0.0..=1.0).contains(&fv), "{hit:?}");
                assert!(if hit.upper { fu >= fv - 1e-12 } else { fv >= fu - 1e-12 }, "{hit:?}");
            }
            let Some(wanted) = brute(field, &ray) else { continue };
            judged += 1;
            let mut left = hits.as_slice();
            for met in &wanted {
                let here = |hit: &&ExactHit| hit.t >= met.from - 1e-7 && hit.t <= met.to + 1e-7;
                let count = left.iter().take_while(here).count();
                let what = || format!("{}: {ray:?} meets {met:?}, hits {hits:?}", land.name);
                match (met.change, met.ground, met.lid) {
                    // Touching alone, twice across in one place, or at a rim: what rounding makes of it.
                    (0, ..) => assert!(count <= 2, "{}", what()),
                    (_, true, true) => assert!(count <= 1, "{}", what()),
                    (_, false, _) => {
                        assert_eq!(count, 0, "{}", what());
                        through += 1;
                    }
                    (change, true, false) => {
                        assert_eq!(count, 1, "{}", what());
                        assert_eq!(left[0].entering, change < 0, "{}", what());
                        from_below += u32::from(change > 0);
                    }
                }
                left = &left[count..];
            }
            assert!(left.is_empty(), "{}: {ray:?} hits {left:?} where nothing is, of {wanted:?}", land.name);
            hits_in_all += hits.len();
        }
    }
    println!("{judged} rays, {hits_in_all} hits, {from_below} from below, {through} lids passed");
    assert!(judged > 10_000 && hits_in_all > 3_000 && from_below > 1_000 && through > 3_000);
}

/// A ray in the plane of a plain with a hole hits where it first meets the ground, not the lid.
#[test]
fn a_ray_within_the_surface_hits_where_the_ground_begins() {
    let (columns, rows) = (30, 12);
    let samples = (0..columns * rows)
        .map(|i| match i % columns {
            0..=3 => 0,
            c if c <= 20 => 10,
            c => 10 + (c - 20) as u16,
        })
        .collect();
    let field = HeightField::from_u16(columns, rows, samples, Voids { sample: Some(0.0) }).unwrap().with_holes();
    assert!((0..4).all(|c| field.raw(c, 5) == 10.0));
    let pyramid = MinMaxPyramid::new(&field);
    let surface = ExactSurface { field: &field, pyramid: &pyramid };
    for y in [7.25, 7.0] {
        let origin = DVec3::new(-5.0, y, 10.0);
        let ray = LatticeRay { origin, direction: DVec3::X, near: 0.0, far: f64::INFINITY };
        let hit = surface.first(&ray).expect("it goes into the hill");
        assert_eq!((hit.point, hit.entering), (DVec3::new(4.0, y, 10.0), true));
    }
}

#[test]
fn sight_and_heights_pass_through_holes() {
    let field = land(33, 33, false, &|c, r| (10..20).contains(&c) && (8..24).contains(&r)).with_holes();
    let pyramid = MinMaxPyramid::new(&field);
    let surface = ExactSurface { field: &field, pyramid: &pyramid };
    assert_eq!(surface.height_at(15.3, 12.1), None);
    // The rim belongs to the ground, from both sides.
    for (u, v) in [(9.0, 12.25), (20.0, 12.25), (14.5, 24.0), (14.5, 7.0), (9.0, 9.0)] {
        assert!(surface.height_at(u, v).is_some(), "({u}, {v})");
        assert_eq!(surface.height_at(u, v).map(|p| p.height), field.filled_surface(u, v));
    }
    let (scene, _) = scene_of(&field, DetailMode::Full, VoidMode::Hole);
    let sight = |a: [f64; 3], b: [f64; 3]| {
        let [a, b] = [a, b].map(|[u, v, w]| DVec3::new(u, 32.0 - v, w));
        let found = scene.line_of_sight(a, b).unwrap();
        // To be seen is to see.
        assert_eq!(found.is_some(), scene.line_of_sight(b, a).unwrap().is_some(), "{a} {b}");
        found.map(|hit| match hit.detail {
            HitDetail::Terrain(detail) => detail.entering,
            other => panic!("{other:?}"),
        })
    };
    let (above, below, aside) = ([15.0, 15.0, 60.0], [15.5, 15.0, -60.0], [28.0, 15.0, 60.0]);
    assert_eq!(sight(above, below), None);
    // Down through the hole and up through the ground.
    assert_eq!((sight(below, aside), sight(aside, below)), (Some(false), Some(true)));
    // Below the ground, though nothing was met on the way there: through the hole, and from beside the map.
    let under = [28.0, 15.0, -40.0];
    assert_eq!(sight([19.5, 15.0, 20.0], under), Some(false));
    assert_eq!(sight([50.0, 15.0, 5.0], under), Some(false));
}

/// The four triangles of a patch know nothing of the outline: a crossing counts where the full-resolution surface is ground.
#[test]
fn coarse_picks_are_those_of_the_lids_and_the_ground_where_there_is_ground() {
    let mut rng = Rng(21);
    let (mut counted, mut passed, mut walls) = (0, 0, 0);
    for land in lands() {
        let field = land.holes.field();
        for _ in 0..if soak() { 100 } else { 10 } {
            let resolutions = resolutions(&mut rng);
            let (tree, full) = (land.holes.tree(resolutions), land.filled.tree(resolutions));
            let selection: Arc<Selection> = tree.select(&land.holes, &detail(&mut rng, field));
            let pick = |terrain: &Terrain, tree: &PatchTree, ray: &LatticeRay| {
                let errors = tree.fan_errors(terrain.field());
                let field = terrain.field();
                let fans = FanTree::new(field, tree.hierarchy(), &selection);
                let surface =
                    CoarseSurface { field, fans: &fans, tree: tree.hierarchy(), selection: &selection, errors };
                let mut hits = Vec::new();
                surface.intersect(ray, |hit| {
                    hits.push(hit);
                    true
                });
                hits
            };
            for _ in 0..40 {
                let ray = ray(&mut rng, field);
                if ray.direction == DVec3::ZERO {
                    continue;
                }
                let mut wanted = pick(&land.filled, &full, &ray);
                passed += wanted.len();
                // By the definition: a triangle without a void that the place lies in or on the border of.
                wanted.retain(|hit| {
                    triangles(field).any(|(t, ground)| {
                        let [a, b, c] = t.map(|p| at(field, p));
                        let cross = |a: DVec3, b: DVec3| (b - a).truncate().perp_dot((hit.point - a).truncate());
                        let signs = [cross(a, b), cross(b, c), cross(c, a)];
                        ground && (signs.iter().all(|&s| s >= 0.0) || signs.iter().all(|&s| s <= 0.0))
                    })
                });
                counted += wanted.len();
                passed -= wanted.len();
                walls += wanted.iter().filter(|hit| hit.wall.is_some()).count();
                assert_eq!(pick(&land.holes, &tree, &ray), wanted, "{}: {ray:?}", land.name);
            }
        }
    }
    println!("{counted} hits, {walls} of them on walls, {passed} passed through holes");
    assert!(counted > 1_000 && passed > 1_000 && walls > 0);
}

/// Wherever the picture shows ground there is ground within τ pixels, wherever it shows a hole there is a hole within τ.
///
/// Every triangle drawn, and every triangle of the ground, is looked at in a grid of points. The judge measures the way in the
/// picture to all samples of the other kind, on the surface with its lids: the nearest of them is at least as far as what is
/// promised of the nearest place.
#[test]
fn outlines_of_holes_are_within_the_pixels_allowed() {
    const N: u32 = 4;
    let grid: Vec<[f64; 3]> = (0..=N)
        .flat_map(|i| (0..=N - i).map(move |j| [i, j, N - i - j].map(|k| f64::from(k) / f64::from(N))))
        .collect();
    let mut rng = Rng(8);
    let (mut closed, mut opened, mut worst) = (0u64, 0u64, 0.0f64);
    for land in lands() {
        let field = land.holes.field();
        if samples(field).all(|[c, r]| field.is_hole(c, r)) {
            continue;
        }
        for number in 0..if soak() { 150 } else { 12 } {
            let morph = number % 3 == 2;
            let resolutions = resolutions(&mut rng);
            let resolutions = if morph { Resolutions::new(resolutions.min(), 2).unwrap() } else { resolutions };
            let tree = land.holes.tree(resolutions);
            let view = camera(&mut rng, field);
            let tolerance = 10f64.powf(rng.range(-0.5, 2.3));
            let detail = if morph {
                Detail::MorphPixelError { tolerance, view: view.clone() }
            } else {
                Detail::PixelError { tolerance, view: view.clone() }
            };
            let selection = tree.select(&land.holes, &detail);
            let hierarchy = tree.hierarchy();
            let drawn = DrawnSurface { field, tree: hierarchy, parts: tree.parts(), selection: &selection };
            let before = |p: DVec3| {
                view.depth.dot(p.extend(1.0)) > 0.0
                    || matches!(view.projection, seamount::terrain::PixelProjection::Orthographic { .. })
            };
            let nearest = |p: DVec3, hole: bool| {
                samples(field)
                    .filter(|&[c, r]| field.is_hole(c, r) == hole)
                    .map(|s| at(field, s))
                    .filter(|&q| before(q))
                    .map(|q| view.pixel(p).distance(view.pixel(q)))
                    .fold(f64::INFINITY, f64::min)
            };
            let mut judge = |p: DVec3, hole: bool| {
                let found = nearest(p, hole);
                assert!(
                    found <= tolerance * (1.0 + 1e-6) + 1e-9,
                    "{} at τ = {tolerance}: {p} is shown as {}, {found} pixels from the nearest",
                    land.name,
                    if hole { "a hole" } else { "ground" },
                );
                worst = worst.max(found / tolerance);
            };
            // What is drawn, by the cells that it may cover.
            let mut covers: HashMap<[u32; 2], Vec<[DVec3; 3]>> = HashMap::new();
            for triangle in selection.patches(hierarchy).flat_map(|patch| drawn.triangles(patch)) {
                if doubled_area(triangle.corners) == 0 {
                    continue;
                }
                let corners: [DVec3; 3] = std::array::from_fn(|k| {
                    let [c, r] = triangle.corners[k];
                    DVec3::new(c.into(), r.into(), triangle.heights[k])
                });
                let range = |axis: usize| {
                    let all = triangle.corners.map(|p| p[axis]);
                    all.into_iter().min().unwrap()..all.into_iter().max().unwrap()
                };
                for r in range(1) {
                    for c in range(0) {
                        covers.entry([c, r]).or_default().push(corners);
                    }
                }
                for weights in &grid {
                    let p = (0..3).map(|k| corners[k] * weights[k]).sum::<DVec3>();
                    if view.frustum.contains(p) && field.surface(p.x, p.y).is_none() {
                        judge(p, false);
                        closed += 1;
                    }
                }
            }
            for (triangle, _) in triangles(field).filter(|(_, ground)| *ground) {
                let corners = triangle.map(|p| at(field, p));
                let cell = [0, 1].map(|axis| triangle.iter().map(|p| p[axis]).min().unwrap());
                for weights in grid.iter().filter(|weights| weights.iter().all(|&w| w > 0.0)) {
                    let p = (0..3).map(|k| corners[k] * weights[k]).sum::<DVec3>();
                    let covered = covers.get(&cell).is_some_and(|all| {
                        all.iter().any(|&[a, b, c]| {
                            let cross = |a: DVec3, b: DVec3| (b - a).truncate().perp_dot((p - a).truncate());
                            // Counter-clockwise seen from above is clockwise in (u, v).
                            cross(a, b) <= 1e-9 && cross(b, c) <= 1e-9 && cross(c, a) <= 1e-9
                        })
                    });
                    if view.frustum.contains(p) && !covered {
                        judge(p, true);
                        opened += 1;
                    }
                }
            }
        }
    }
    println!(
        "{closed} points shown as ground, {opened} as holes that they are not; at worst {worst} of what is allowed"
    );
    assert!(closed > 500 && opened > 500, "{closed} {opened}");
    // A bound that is never half reached would cost triangles.
    assert!(worst > 0.5, "{worst}");
}

/// A plain of 128 × 128 cells, 128 long, with some voids, under a camera that looks straight down from a height.
fn plain(void: &[(u32, u32)], voids: VoidMode, height: f64) -> Scene {
    let samples = (0..129 * 129).map(|i| if void.contains(&(i % 129, i / 129)) { 0 } else { 1000 }).collect();
    let mut scene = Scene::new();
    let root = scene.root();
    let eye = DVec3::new(64.0, 64.0, height);
    scene
        .add(root, PerspectiveCamera { position: Some(eye), look_at: Some(eye.with_z(0.0)), ..Default::default() })
        .unwrap();
    scene.add(root, Texture2::from_image(Image::new(129, 129, Pixels::Gray16(samples)).unwrap())).unwrap();
    let terrain = SeamlessTerrain {
        scale: 128.0,
        void_sample: Some(0.0),
        voids,
        resolutions: (2, 2),
        culling: false,
        ..SeamlessTerrain::default()
    };
    scene.add(root, terrain).unwrap();
    scene
}

/// The corners of all triangles of a frame, in lattice coordinates.
fn frame_triangles(frame: &Frame) -> Vec<[[u32; 2]; 3]> {
    let mut all = Vec::new();
    for draw in &frame.draws {
        let Geometry::Terrain(terrain) = &draw.geometry else { panic!("a terrain") };
        let before = all.len();
        if draw.effects.geometry.is_loose() {
            all.extend(terrain.instances.loose().chunks_exact(3).map(|t| [t[0].point, t[1].point, t[2].point]));
        } else {
            all.extend(instanced(terrain));
        }
        assert_eq!((all.len() - before) as u64, draw.triangles());
    }
    assert_eq!(all.len() as u64, frame.statistics.triangles);
    all
}

fn instanced(draw: &TerrainDraw) -> Vec<[[u32; 2]; 3]> {
    let cells = draw.heights.cells();
    let mut all = Vec::new();
    for (part, range) in draw.instances.ranges() {
        let triangles = draw.parts.range(*part);
        for instance in &draw.instances.data()[range.start as usize..range.end as usize] {
            for unit in &draw.parts.all_triangles()[triangles.start as usize..triangles.end as usize] {
                all.push(
                    unit.map(|p| [0, 1].map(|k| (instance.origin[k] + instance.step * u32::from(p[k])).min(cells[k]))),
                );
            }
        }
    }
    all
}

/// One void does not keep a patch at the finest level for ever: far away the mesh is that of a plain without it, near by the
/// hole is open.
#[test]
fn a_void_alone_costs_nothing_from_far_away_and_is_open_from_near_by() {
    let size = [800, 600];
    let patches = |scene: &Scene| RenderAction::new(size[0], size[1]).apply(scene).unwrap().statistics.patches_rendered;
    for void in [(70, 61), (64, 64), (0, 0), (37, 90)] {
        // A cell covers 600 / (2 tan(22.5°) · height) pixels, and the map's widest triangles 64 cells.
        let far = 64.0 * 600.0 * 2.0;
        let (holed, without) = (plain(&[void], VoidMode::Hole, far), plain(&[], VoidMode::Hole, far));
        assert_eq!(patches(&holed), patches(&without), "{void:?}");
        assert_eq!(patches(&plain(&[void], VoidMode::Fill, 50.0)), patches(&without), "{void:?}");

        let near = plain(&[void], VoidMode::Hole, 150.0);
        let frame = RenderAction::new(size[0], size[1]).apply(&near).unwrap();
        assert!(frame.statistics.patches_rendered > patches(&without));
        // Around it the cells are those of the map: exactly the triangles at the void are not there.
        let around = |t: &[[u32; 2]; 3]| {
            t.iter().all(|p| p[0].abs_diff(void.0) <= 1 && p[1].abs_diff(void.1) <= 1) && doubled_area(*t) == 1
        };
        let found = frame_triangles(&frame).iter().filter(|t| around(t)).count();
        let map = HeightField::from_u16(129, 129, vec![0; 129 * 129], Voids::default()).unwrap();
        let mine = |t: &[[u32; 2]; 3]| t.iter().any(|&[c, r]| (c, r) == void);
        let wanted = triangles(&map)
            .filter(|(t, _)| {
                around(&{
                    let [a, b, c] = *t;
                    if doubled_area(*t) > 0 { [a, b, c] } else { [a, c, b] }
                }) && !mine(t)
            })
            .count();
        assert_eq!(found, wanted, "{void:?}");
    }
}

/// The scene of a map with voids in a place of its own, seen from above at an angle.
fn scene_of(field: &HeightField, detail: DetailMode, voids: VoidMode) -> (Scene, SeamlessTerrain) {
    let [columns, rows] = [field.columns(), field.rows()];
    let pixels =
        samples(field).map(|[c, r]| if field.is_void(c, r) { f32::NAN } else { field.raw(c, r) as f32 }).collect();
    let mut scene = Scene::new();
    let root = scene.root();
    let middle = DVec3::new(f64::from(columns) * 0.5, f64::from(rows) * 0.5, 10.0);
    let eye = middle + DVec3::new(-20.0, -35.0, 60.0);
    scene.add(root, PerspectiveCamera { position: Some(eye), look_at: Some(middle), ..Default::default() }).unwrap();
    scene.add(root, Texture2::from_image(Image::new(columns, rows, Pixels::GrayF32(pixels)).unwrap())).unwrap();
    let terrain = SeamlessTerrain {
        scale: f64::from(columns.max(rows) - 1),
        max_height: 1.0,
        resolutions: (2, 2),
        culling: false,
        detail,
        voids,
        ..SeamlessTerrain::default()
    };
    scene.add(root, terrain.clone()).unwrap();
    (scene, terrain)
}

#[test]
fn boxes_hold_what_is_drawn_and_leave_holes_out() {
    for land in lands() {
        let field = land.holes.field();
        let mut ground = samples(field).filter(|&[c, r]| !field.is_hole(c, r)).map(|p| at(field, p)).peekable();
        for detail in [DetailMode::Full, DetailMode::PixelError(8.0), DetailMode::Precision(0.5)] {
            let (scene, terrain) = scene_of(field, detail, VoidMode::Hole);
            let found = BoundingBoxAction::default().apply(&scene).unwrap();
            let frame = RenderAction::new(300, 200).apply(&scene).unwrap();
            // The image is of floats whatever the map is.
            let place = LatticeFrame { z_step: 1.0, ..terrain.frame(field) };
            let vertices = frame_triangles(&frame).into_iter().flatten().map(|p| place.local(at(field, p)));
            let drawn = vertices.fold(None, |all: Option<[DVec3; 2]>, p| match all {
                None => Some([p; 2]),
                Some([low, high]) => Some([low.min(p), high.max(p)]),
            });
            match (found, drawn) {
                (None, None) => assert!(ground.peek().is_none(), "{}", land.name),
                (Some(found), Some([low, high])) if detail == DetailMode::Full => {
                    assert_eq!((found.min, found.max), (low, high), "{}", land.name);
                }
                (Some(found), Some([low, high])) => {
                    assert!(found.min.cmple(low).all() && found.max.cmpge(high).all(), "{}", land.name);
                }
                // A coarse mesh may have no triangle that is free of voids.
                (Some(_), None) => assert!(detail != DetailMode::Full, "{}", land.name),
                (None, Some(_)) => panic!("{}: no box around what is drawn", land.name),
            }
        }
    }
}

#[test]
fn many_picks_are_picks_and_know_holes() {
    let mut rng = Rng(17);
    let field = land(45, 38, true, &|c, r| (10..30).contains(&c) && (8..24).contains(&r));
    let (scene, _) = scene_of(&field, DetailMode::PixelError(4.0), VoidMode::Hole);
    for surface in [Surface::Coarse, Surface::Exact] {
        let action = RayPickAction { surface, ..RayPickAction::pixel(0, 0, [300, 200]) };
        let picker = action.picker(&scene).unwrap();
        let rays: Vec<Ray> = (0..500).map(|_| picker.ray_through(rng.unit(), rng.unit()).unwrap()).collect();
        for all in [false, true] {
            let many = picker.pick_many(&rays, all).unwrap();
            let mut missed = 0;
            for (ray, many) in rays.iter().zip(&many) {
                assert_eq!(&picker.pick(ray, all).unwrap(), many);
                missed += u32::from(many.is_empty());
            }
            assert!((20..480).contains(&missed), "{missed}");
        }
    }
    // Beside a hole a cell has voids and is said to.
    let down = |x: f64, y: f64| Ray::new(DVec3::new(x, y, 100.0), DVec3::NEG_Z).unwrap();
    let pick = |ray| RayPickAction { surface: Surface::Exact, ..RayPickAction::ray(ray) }.apply(&scene).unwrap();
    assert!(pick(down(20.0, 20.0)).is_empty());
    let HitDetail::Terrain(inside) = pick(down(3.5, 3.2))[0].detail else { panic!("a terrain") };
    // Row 23 is the last of the hole, y = 37 − row; the lower triangle of the cell at its north-west corner (9, 7) is whole
    // but for the void at (10, 8); the cell (29, 7) has its upper triangle whole.
    let HitDetail::Terrain(rim) = pick(down(29.75, 37.0 - 7.25))[0].detail else { panic!("a terrain") };
    assert!(!inside.void && rim.void);
}

/// A flat terrain has holes too.
#[test]
fn a_terrain_of_no_height_is_picked_around_its_holes() {
    let field = land(33, 33, true, &|c, r| (10..20).contains(&c) && (8..24).contains(&r));
    let (mut scene, _) = scene_of(&field, DetailMode::Full, VoidMode::Hole);
    let key = *scene.children(scene.root()).last().unwrap();
    scene.edit::<SeamlessTerrain>(key).unwrap().max_height = 0.0;
    for surface in [Surface::Coarse, Surface::Exact] {
        let hits = |x: f64, y: f64| {
            let ray = Ray::new(DVec3::new(x, y, 5.0), DVec3::NEG_Z).unwrap();
            RayPickAction { surface, ..RayPickAction::ray(ray) }.apply(&scene).unwrap().len()
        };
        assert_eq!((hits(15.0, 15.0), hits(3.3, 3.1), hits(9.0, 15.0), hits(-1.0, 3.0)), (0, 1, 1, 0));
    }
}

#[test]
fn scene_files_say_hole() {
    let (scene, terrain) = (Scene::new(), SeamlessTerrain { voids: VoidMode::Hole, ..SeamlessTerrain::default() });
    let mut scene = scene;
    scene.add(scene.root(), terrain.clone()).unwrap();
    let text = seamount::format::write_scene(&scene).unwrap();
    assert!(text.contains("voids: Hole"), "{text}");
    let again = seamount::format::parse(&text, &seamount::node::Registry::default()).unwrap();
    let key = again.children(again.root())[0];
    assert_eq!(again.get::<SeamlessTerrain>(key).unwrap().voids, VoidMode::Hole);
}

/// What has no holes pays nothing: the same frame, whatever is said of voids.
#[test]
fn a_map_without_voids_is_the_same_with_and_without_holes() {
    let field = land(45, 38, true, &|_, _| false);
    assert!(!field.with_holes().has_holes());
    let field = land(45, 38, true, &|_, _| false);
    let [holes, fill] = [VoidMode::Hole, VoidMode::Fill].map(|voids| {
        let (scene, _) = scene_of(&field, DetailMode::PixelError(1.0), voids);
        RenderAction::new(300, 200).apply(&scene).unwrap()
    });
    assert_eq!(holes.statistics, fill.statistics);
    assert_eq!(holes.draws.len(), 1);
    assert_eq!(holes.draws[0].effects, fill.draws[0].effects);
    assert_eq!(frame_triangles(&holes), frame_triangles(&fill));
}

#[cfg(feature = "render")]
mod picture {
    use std::path::Path;
    use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

    use glam::DVec2;
    use seamount::action::{DebugColor, Effects, GeometryKind};
    use seamount::render::{Headless, Picture, shader_text};

    use super::*;

    fn headless() -> MutexGuard<'static, Headless> {
        static HEADLESS: OnceLock<Mutex<Headless>> = OnceLock::new();
        let made = HEADLESS.get_or_init(|| Mutex::new(Headless::new(None).unwrap_or_else(|error| panic!("{error}"))));
        made.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn draw(scene: &Scene, size: [u32; 2]) -> Picture {
        let action = RenderAction { background: Color::new(1.0, 0.0, 1.0), ..RenderAction::new(size[0], size[1]) };
        let frame = action.apply(scene).unwrap();
        let picture = headless().draw(&frame).unwrap();
        assert_eq!(picture.report.draw_calls, frame.statistics.draw_calls);
        picture
    }

    const SIZE: u32 = 200;

    /// White ground on magenta.
    fn white(map: &Arc<Image>, eye: DVec3, target: DVec3, terrain: SeamlessTerrain) -> Scene {
        let mut scene = Scene::new();
        let root = scene.root();
        let camera = PerspectiveCamera { position: Some(eye), look_at: Some(target), ..PerspectiveCamera::default() };
        scene.add(root, camera).unwrap();
        scene.add(root, BaseColor { rgb: Color::WHITE.into() }).unwrap();
        scene.add(root, Texture2::from_image(Arc::clone(map))).unwrap();
        scene.add(root, terrain).unwrap();
        scene
    }

    /// What the rays through points of the picture see: whether one of the crossings is of the upper side, which is drawn.
    struct Judge<'s> {
        picker: seamount::action::Picker<'s>,
    }

    impl Judge<'_> {
        /// (x, y) in pixels.
        fn ground(&self, x: f64, y: f64) -> bool {
            let ray = self.picker.ray_through(x / f64::from(SIZE), y / f64::from(SIZE)).unwrap();
            let hits = self.picker.pick(&ray, true).unwrap();
            hits.iter().any(|hit| matches!(&hit.detail, HitDetail::Terrain(detail) if detail.entering))
        }

        /// What all rays within `reach` pixels of a pixel see, on a grid of (n + 1)²; `None` if not all the same.
        fn around(&self, x: u32, y: u32, reach: f64, n: u32) -> Option<bool> {
            let at = |from: u32, k: u32| f64::from(from) - reach + (1.0 + 2.0 * reach) * f64::from(k) / f64::from(n);
            let mut all =
                (0..=n).flat_map(|j| (0..=n).map(move |i| (i, j))).map(|(i, j)| self.ground(at(x, i), at(y, j)));
            let first = all.next()?;
            all.all(|ground| ground == first).then_some(first)
        }
    }

    /// Pixels that see ground all around are ground, those that see a hole all around are background: at full detail within
    /// the pixel itself, else as far around as is allowed. So drawn and picked holes are the same, and nothing shows through
    /// where patches with holes meet patches without.
    #[test]
    fn holes_in_the_picture_are_those_that_picks_pass_through() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/fuji.png");
        let fuji = Arc::new(Image::open(&path).unwrap());
        let field = fuji.height_field(Some(0.0)).unwrap().with_holes();
        let terrain = SeamlessTerrain {
            size: Some(DVec2::new(90_600.0, 111_240.0)),
            max_height: 65_535.0,
            base_height: -1_000.0,
            void_sample: Some(0.0),
            voids: VoidMode::Hole,
            ..SeamlessTerrain::default()
        };
        let place = terrain.frame(&field);
        let holes: Vec<[u32; 2]> = samples(&field).filter(|&[c, r]| field.is_hole(c, r)).collect();
        println!("{} of {} samples are holes", holes.len(), field.columns() * field.rows());
        let mut rng = Rng(4);
        let (mut ground, mut hole) = (0, 0);
        for k in 0..if soak() { 24 } else { 4 } {
            let target = place.local(at(&field, holes[rng.below(holes.len() as u32) as usize]));
            let (yaw, pitch) = (rng.range(0.0, TAU), rng.range(0.25, 1.5));
            let distance = 10f64.powf(rng.range(2.7, 4.6));
            let eye = target + distance * DVec3::new(yaw.cos() * pitch.cos(), yaw.sin() * pitch.cos(), pitch.sin());
            for (detail, reach) in
                [(DetailMode::Full, 0.0), (DetailMode::PixelError(0.5), 0.5), (DetailMode::PixelError(2.0), 2.0)]
            {
                if detail == DetailMode::Full && k % 2 == 1 && !soak() {
                    continue;
                }
                let scene = white(&fuji, eye, target, SeamlessTerrain { detail, ..terrain.clone() });
                let action = RayPickAction { surface: Surface::Exact, ..RayPickAction::pixel(0, 0, [SIZE; 2]) };
                let judge = Judge { picker: action.picker(&scene).unwrap() };
                let picture = draw(&scene, [SIZE; 2]);
                for (x, y) in (0..SIZE).flat_map(|y| (0..SIZE).map(move |x| (x, y))) {
                    let pixel = picture.pixel(x, y).unwrap();
                    let Some(expected) = judge.around(x, y, reach, 2) else { continue };
                    *if expected { &mut ground } else { &mut hole } += 1;
                    let good = pixel == if expected { [255; 3] } else { [255, 0, 255] };
                    // What is thinner than the rays are apart they may have missed: look closer before complaining.
                    assert!(
                        good || judge.around(x, y, reach, 32) != Some(expected),
                        "eye {k} at {detail:?}: pixel ({x}, {y}) is {pixel:?}, all rays around see ground: {expected}"
                    );
                }
            }
        }
        println!("{ground} pixels of ground, {hole} of holes and sky");
        assert!(ground > 50_000 && hole > 5_000, "{ground} {hole}");
    }

    /// Loose triangles are coloured like the others: seen from straight above, what is not a hole looks as if there were none.
    #[test]
    fn loose_triangles_have_the_colours_of_the_others() {
        for floats in [false, true] {
            let void = |c: u32, r: u32| (10..20).contains(&c) && (8..24).contains(&r) || (c, r) == (5, 5);
            let field = land(33, 33, floats, &void);
            let pixels = samples(&field);
            let map = Arc::new(if floats {
                let value = |[c, r]: [u32; 2]| if void(c, r) { f32::NAN } else { field.raw(c, r) as f32 };
                Image::new(33, 33, Pixels::GrayF32(pixels.map(value).collect())).unwrap()
            } else {
                let value = |[c, r]: [u32; 2]| if void(c, r) { 65_535 } else { field.raw(c, r) as u16 };
                Image::new(33, 33, Pixels::Gray16(pixels.map(value).collect())).unwrap()
            });
            let colors = (0..64u8).map(|i| [i * 3, 255 - i, 90, 255]).collect();
            let colors = Arc::new(Image::new(8, 8, Pixels::Rgba8(colors)).unwrap());
            for (color_mode, lit, colored) in [
                (ColorMode::Plain, false, false),
                (ColorMode::Plain, true, false),
                (ColorMode::Plain, true, true),
                (ColorMode::Parts, false, false),
                (ColorMode::Levels, false, false),
            ] {
                let [fill, holes] = [VoidMode::Fill, VoidMode::Hole].map(|voids| {
                    let mut scene = Scene::new();
                    let root = scene.root();
                    let eye = DVec3::new(16.0, 16.0, 100.0);
                    let camera = OrthographicCamera {
                        position: Some(eye),
                        look_at: Some(eye.with_z(0.0)),
                        height: 34.0,
                        ..OrthographicCamera::default()
                    };
                    scene.add(root, camera).unwrap();
                    if lit {
                        scene.add(root, DirectionalLight::default()).unwrap();
                        scene.add(root, PointLight { location: eye, ..PointLight::default() }).unwrap();
                    }
                    scene.add(root, Material { specular_color: Color::WHITE.into(), ..Material::default() }).unwrap();
                    scene.add(root, Texture2::from_image(Arc::clone(&map))).unwrap();
                    if colored {
                        scene.add(root, TextureUnit { unit: 1 }).unwrap();
                        scene.add(root, Texture2::from_image(Arc::clone(&colors))).unwrap();
                    }
                    let terrain = SeamlessTerrain {
                        scale: 32.0,
                        max_height: if floats { 1.0 } else { 65_535.0 },
                        void_sample: (!floats).then_some(65_535.0),
                        resolutions: (4, 2),
                        detail: DetailMode::Full,
                        color_mode,
                        voids,
                        ..SeamlessTerrain::default()
                    };
                    scene.add(root, terrain).unwrap();
                    draw(&scene, [170, 170])
                });
                let (mut same, mut open) = (0, 0);
                for (x, y) in (0..170).flat_map(|y| (0..170).map(move |x| (x, y))) {
                    // A pixel is a fifth of a cell; the picture's border is half a cell around the map.
                    let [u, v] = [x, y].map(|k| (f64::from(k) + 0.5) / 5.0 - 1.0);
                    let near = |du: f64, dv: f64| field_ground(&field, u + du, v + dv);
                    let around = [-0.15, 0.15].into_iter().flat_map(|du| [-0.15, 0.15].map(|dv| near(du, dv)));
                    let around: Vec<Option<bool>> = around.collect();
                    if around.iter().all(|&ground| ground == Some(true)) {
                        same += 1;
                        assert_eq!(holes.pixel(x, y), fill.pixel(x, y), "({x}, {y}) {color_mode:?} {lit}");
                    } else if around.iter().all(|&ground| ground == Some(false)) {
                        open += 1;
                        assert_eq!(holes.pixel(x, y), Some([255, 0, 255]), "({x}, {y}) {color_mode:?}");
                    }
                }
                assert!(same > 15_000 && open > 3_000, "{same} {open}");
            }
        }
    }

    /// Whether a place is ground by the definition; `None` beside the map.
    fn field_ground(field: &HeightField, u: f64, v: f64) -> Option<bool> {
        let [cu, cv] = field.cells().map(f64::from);
        if !(u > 0.0 && v > 0.0 && u < cu && v < cv) {
            return None;
        }
        let (c, r) = (u as u32, v as u32);
        let third = if u.fract() > v.fract() { (c + 1, r) } else { (c, r + 1) };
        Some([(c, r), third, (c + 1, r + 1)].iter().all(|&(c, r)| !field.is_void(c, r)))
    }

    #[test]
    fn a_map_without_voids_looks_the_same_and_takes_the_same() {
        let field = land(45, 38, true, &|_, _| false);
        let pictures = [VoidMode::Fill, VoidMode::Hole].map(|voids| {
            let (scene, _) = scene_of(&field, DetailMode::PixelError(1.0), voids);
            let picture = Headless::new(None).unwrap().draw(&RenderAction::new(90, 60).apply(&scene).unwrap()).unwrap();
            let report = picture.report;
            (picture.rgba, report.bytes_uploaded, report.gpu_bytes, report.pipelines_made, report.draw_calls)
        });
        assert_eq!(pictures[0], pictures[1]);
    }

    /// Loose triangles have a vertex stage of their own, and nothing else in a shader knows of holes.
    #[test]
    fn shaders_without_holes_know_nothing_of_them() {
        let text = |geometry: GeometryKind, levels: bool, morph: bool| {
            let effects = Effects {
                geometry,
                directional_lights: 1,
                point_lights: 1,
                specular: true,
                color_map: !levels,
                debug_color: if levels { DebugColor::Levels } else { DebugColor::Plain },
                ambient: true,
                morph,
                ..Effects::default()
            };
            shader_text(&effects, wgpu::TextureFormat::Rgba8UnormSrgb).unwrap()
        };
        for (levels, morph) in [(false, false), (true, false), (false, true), (true, true)] {
            for (whole, loose) in
                [(GeometryKind::TerrainU16, GeometryKind::LooseU16), (GeometryKind::TerrainF32, GeometryKind::LooseF32)]
            {
                let (whole, loose) = (text(whole, levels, morph), text(loose, levels, morph));
                assert!(
                    whole.contains("vertex_index") && whole.contains("origin") && !whole.contains("loose"),
                    "{whole}"
                );
                assert!(!loose.contains("vertex_index") && !loose.contains("origin"), "{loose}");
                // The arithmetic of a vertex and all that comes after are the same.
                let after = |text: &str| text[text.find("fn relative_to_anchor").unwrap()..].to_owned();
                assert!(after(&whole).contains("fragment_main") || whole.contains("fragment_main"));
                let bindings = |text: &str| text.matches("@binding").count();
                assert_eq!(bindings(&whole), bindings(&loose));
            }
        }
    }
}
