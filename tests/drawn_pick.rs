//! Picks on the drawn surface: against brute force over the same triangles in f64, and against the depth buffer.
//!
//! # What the depth buffer allows
//!
//! The rasteriser snaps vertices to 1/256 of a pixel, so each moves by at most 1/512 along either axis. Depth is linear
//! over a triangle of the picture, so what is stored at a pixel's centre is the depth of the surface at a place that is
//! moved by a convex combination of its corners' moves: at most 1/512 of a pixel. So the depth has to lie between the
//! picks through the centre and the corners of a square of 2/512 around it, give or take what depth changes over it (the
//! largest gradient of the triangles picked, times the square's side, for folds within the square), and rounding: vertices
//! are transformed in f32, whose sums are off by a few 2⁻²⁴ of the distance from the eye. Where one of the five rays hits
//! and another misses, either is right; everywhere else hit and miss have to agree. Silhouettes need no exception.
//! The ground is drawn from above only, so the first hit that goes into it is what counts.
#![allow(missing_docs, reason = "a test")]

mod common;

use common::Rng;
use glam::DVec3;
use seamount::action::{Picker, Ray, Surface};
use seamount::node::HitDetail;
use seamount::prelude::*;
use seamount::terrain::pick::LatticeRay;
use seamount::terrain::{
    DrawnHit, DrawnPick, DrawnSurface, DrawnTriangle, ExactSurface, Full, HeightField, Hierarchy, LodEye,
    MinMaxPyramid, MorphErrors, Parts, Precision, Resolutions, Selection, TileErrors, Voids, generate,
};

struct Land {
    field: HeightField,
    pyramid: MinMaxPyramid,
    tree: Hierarchy,
    parts: Parts,
    selection: Selection,
    errors: TileErrors,
    morph_errors: MorphErrors,
}

impl Land {
    fn new(field: HeightField, resolutions: Resolutions, precision: Option<Precision>) -> Self {
        let tree = Hierarchy::new(field.cells(), resolutions);
        let parts = Parts::new(resolutions);
        let selection = precision.map_or_else(|| Selection::of(&tree, &Full), |metric| Selection::of(&tree, &metric));
        let errors = TileErrors::new(&field, &tree, &parts);
        let morph_errors = MorphErrors::new(&field, &tree, &parts);
        Self { pyramid: MinMaxPyramid::new(&field), field, tree, parts, selection, errors, morph_errors }
    }

    /// The same with heights that blend between levels.
    fn morphing(mut self, metric: &Precision) -> Self {
        self.selection.update_morphing(&self.tree, metric);
        self
    }

    fn error(&self, hit: &DrawnHit) -> f64 {
        match self.selection.weights(&self.tree, hit.patch.id) {
            Some(weights) => hit.error_morphing(&self.tree, &weights, &self.morph_errors),
            None => hit.error(&self.tree, || &self.errors),
        }
    }

    fn drawn(&self) -> DrawnSurface<'_> {
        DrawnSurface { field: &self.field, tree: &self.tree, parts: &self.parts, selection: &self.selection }
    }

    fn triangles(&self) -> Vec<DrawnTriangle> {
        self.selection.patches(&self.tree).flat_map(|patch| self.drawn().triangles(patch)).collect()
    }

    fn hits(&self, ray: &LatticeRay) -> Vec<DrawnHit> {
        let mut hits = Vec::new();
        DrawnPick { drawn: self.drawn(), pyramid: &self.pyramid }.intersect(ray, |hit| {
            hits.push(hit);
            true
        });
        hits
    }
}

fn lands() -> Vec<Land> {
    let mut lands = Vec::new();
    let mut rng = Rng(3);
    for (size, min, count, precision) in
        [(129, 4, 3, 1.0), (97, 2, 2, 2.0), (90, 8, 2, 0.3), (65, 2, 4, 5.0), (110, 4, 2, 40.0)]
    {
        let field = generate(size, u64::from(size)).unwrap();
        let eye = LodEye::Point {
            u: rng.range(0.0, f64::from(size)),
            v: rng.range(0.0, f64::from(size)),
            height: rng.range(0.0, 40.0),
        };
        let (resolutions, metric) = (Resolutions::new(min, count).unwrap(), Precision { precision, eye });
        if count == 2 {
            let again = generate(size, u64::from(size)).unwrap();
            lands.push(Land::new(again, resolutions, None).morphing(&metric));
        }
        lands.push(Land::new(field, resolutions, Some(metric)));
    }
    // Not square, crossing the border of the patches, with noise from sample to sample; floats of all sizes.
    let samples: Vec<u16> = (0..83 * 41).map(|_| (rng.bits() >> 48) as u16).collect();
    let noise = HeightField::from_u16(83, 41, samples.clone(), Voids::default()).unwrap();
    let eye = LodEye::Point { u: 10.0, v: 30.0, height: 3.0 };
    let metric = Precision { precision: 1.5, eye };
    let morphing = HeightField::from_u16(83, 41, samples, Voids::default()).unwrap();
    lands.push(Land::new(morphing, Resolutions::new(4, 2).unwrap(), None).morphing(&metric));
    lands.push(Land::new(noise, Resolutions::new(2, 3).unwrap(), Some(metric)));
    let wild = (0..31 * 23).map(|_| (rng.range(-1.0, 1.0) * 2f64.powi(rng.below(60) as i32 - 30)) as f32).collect();
    lands.push(Land::new(
        HeightField::from_f32(31, 23, wild, Voids::default()).unwrap(),
        Resolutions::new(2, 2).unwrap(),
        None,
    ));
    lands
}

/// Where the border of the map cuts a patch, slivers in its plane are met at one parameter, up to a handful. Only the next but
/// one crossing of the same patch said in which order they go in and out of the ground.
#[test]
fn slivers_at_one_place_are_in_turn_with_what_comes_after() {
    let mut rng = Rng(12);
    let (mut several, mut across) = (0, 0);
    let precisions = [0.05, 0.2, 0.5, 1.0, 2.0, 4.0];
    for (columns, precision) in [2, 4, 34].into_iter().flat_map(|columns| precisions.map(|p| (columns, p))) {
        for south in [false, true] {
            // Noise, or spikes far apart.
            let spike = |noise: u16| if noise < 4000 { 65_535 } else { 1000 };
            let noise = |rng: &mut Rng| (rng.bits() >> 48) as u16;
            let sample = |_| if columns < 34 { noise(&mut rng) } else { spike(noise(&mut rng)) };
            let samples: Vec<u16> = (0..columns * 300).map(sample).collect();
            let field = HeightField::from_u16(
                if south { 300 } else { columns },
                if south { columns } else { 300 },
                samples,
                Voids::default(),
            )
            .unwrap();
            let turned = |p: DVec3| if south { DVec3::new(p.y, p.x, p.z) } else { p };
            let border = f64::from(columns - 1);
            let metric = Precision {
                precision,
                eye: LodEye::Point {
                    u: if south { 150.0 } else { border / 2.0 },
                    v: if south { border / 2.0 } else { 150.0 },
                    height: 10.0,
                },
            };
            let land = Land::new(field, Resolutions::new(8, 3).unwrap(), Some(metric));
            for _ in 0..3000 {
                let origin = DVec3::new(border + 0.5, rng.range(0.0, 299.0), rng.range(0.0, 65_535.0));
                let direction = DVec3::new(-1.0, rng.range(-20.0, 20.0), rng.range(-30_000.0, 30_000.0));
                let ray =
                    LatticeRay { origin: turned(origin), direction: turned(direction), near: 0.0, far: f64::INFINITY };
                let hits = land.hits(&ray);
                for pair in hits.windows(2) {
                    assert_ne!(pair[0].entering, pair[1].entering, "{columns}: {origin} {direction} {hits:?}");
                }
                let slivers = hits.iter().take_while(|hit| hit.border.is_some()).count();
                several += usize::from(slivers > 3);
                across += usize::from(slivers > 1 && hits.get(slivers).is_some_and(|h| h.patch.id != hits[0].patch.id));
            }
        }
    }
    assert!(several > 3 && across > 3, "{several} times more than three slivers, {across} times another patch decides");
}

/// Classes of rays, by number.
const CLASSES: u32 = 8;

fn ray_of(class: u32, land: &Land, rng: &mut Rng) -> LatticeRay {
    let [cu, cv] = land.tree.cells().map(f64::from);
    let [low, high] = land.pyramid.full_range();
    let whole = |rng: &mut Rng| DVec3::new(rng.below(cu as u32 + 1).into(), rng.below(cv as u32 + 1).into(), 0.0);
    let place = |rng: &mut Rng| DVec3::new(rng.range(0.0, cu), rng.range(0.0, cv), rng.range(low, high));
    let rise = (high - low) / cu;
    let (origin, direction) = match class {
        // From anywhere.
        0 => {
            let target = place(rng);
            let from = DVec3::new(
                rng.range(-cu, 2.0 * cu),
                rng.range(-cv, 2.0 * cv),
                rng.range(2.0 * low - high, 2.0 * high - low),
            );
            (from, target - from)
        }
        // Grazing.
        1 => {
            let (sin, cos) = rng.range(0.0, std::f64::consts::TAU).sin_cos();
            let d = DVec3::new(cos, sin, rise * rng.range(-0.02, 0.02));
            (place(rng) - d * 2.0 * cu, d)
        }
        // Along a grid line.
        2 => {
            let target = whole(rng) + DVec3::Z * rng.range(low, high);
            let d = if rng.below(2) == 0 { DVec3::X } else { DVec3::NEG_Y } + DVec3::Z * rise * rng.range(-1.0, 1.0);
            (target - d * 2.0 * cu, d)
        }
        // Along a diagonal of either kind.
        3 => {
            let target = whole(rng) + DVec3::Z * rng.range(low, high);
            let across = if rng.below(2) == 0 { 1.0 } else { -1.0 };
            let d = DVec3::new(1.0, across, rise * rng.range(-1.0, 1.0));
            (target - d * 2.0 * cu, d)
        }
        // Through two vertices.
        4 => {
            let (a, b) = (whole(rng), whole(rng));
            let raw = |p: DVec3| DVec3::new(p.x, p.y, land.field.raw(p.x as u32, p.y as u32));
            let d = if a == b { DVec3::new(1.0, 2.0, rise) } else { raw(b) - raw(a) };
            (raw(a) - d * 3.0, d)
        }
        // At the border of the map from outside.
        7 => {
            let mut p = place(rng);
            match rng.below(4) {
                0 => p.x = 0.0,
                1 => p.x = cu,
                2 => p.y = 0.0,
                _ => p.y = cv,
            }
            p.z = land.field.surface(p.x, p.y).unwrap() + (high - low) * rng.range(-0.05, 0.05);
            let d = DVec3::new(0.5 * cu - p.x, 0.5 * cv - p.y, (high - low) * rng.range(-0.3, 0.3));
            (p - d, d)
        }
        // Straight down and up, anywhere and on lines.
        5 => (place(rng) + DVec3::Z * (high - low), DVec3::NEG_Z),
        _ => {
            let mut p = whole(rng);
            if rng.below(2) == 0 {
                p.x = rng.range(0.0, cu);
            }
            (p + DVec3::Z * (low - 10.0), DVec3::Z)
        }
    };
    LatticeRay { origin, direction, near: 0.0, far: f64::INFINITY }
}

/// Where a ray meets a triangle, in f64 and borders included, with a slack around it: the parameter, how deep within the
/// triangle the place lies (least weight), negative outside, and how fast the ray's height above the triangle changes there.
fn meets(ray: &LatticeRay, triangle: &DrawnTriangle) -> Option<(f64, f64, f64)> {
    let [a, b, c] = [0, 1, 2].map(|k| {
        let [u, v] = triangle.corners[k];
        DVec3::new(u.into(), v.into(), triangle.heights[k])
    });
    let (e1, e2) = (b - a, c - a);
    let p = ray.direction.cross(e2);
    let det = e1.dot(p);
    if det == 0.0 {
        return None;
    }
    let s = ray.origin - a;
    let q = s.cross(e1);
    let t = e2.dot(q) / det;
    let (mut u, mut v) = (s.dot(p) / det, ray.direction.dot(q) / det);
    let area = e1.truncate().perp_dot(e2.truncate());
    if area != 0.0 {
        // Seen from above heights of very unequal size do not spoil the weights.
        let place = (s + ray.direction * t).truncate();
        (u, v) = (place.perp_dot(e2.truncate()) / area, e1.truncate().perp_dot(place) / area);
    }
    Some((t, u.min(v).min(1.0 - u - v), (det / area).abs()))
}

/// Every hit is one of brute force, and every one of brute force is hit, in order and with alternating signs.
#[test]
fn all_triangles_agree() {
    let mut rng = Rng(11);
    let count = if soak() { 20_000 } else { 250 };
    let (mut hits, mut borders) = ([0; CLASSES as usize], 0);
    for land in lands() {
        let triangles = land.triangles();
        for class in 0..CLASSES {
            for _ in 0..count {
                let ray = ray_of(class, &land, &mut rng);
                let ours = land.hits(&ray);
                let all: Vec<(f64, f64, f64)> = triangles.iter().filter_map(|t| meets(&ray, t)).collect();
                // The difference of heights of 10⁹ and less keeps about so many digits of them, seen along the ray; or the rounding
                // that the hit tells of: it is where the ray met the surface as far as that can say.
                let close = |t: f64, rate: f64, hit: &DrawnHit| {
                    let off = (t - hit.t).abs();
                    off <= 1e-9 * (1.0 + t.abs()) || off * rate <= hit.rounding
                };
                for hit in &ours {
                    let found = all.iter().any(|&(t, depth, rate)| depth >= -1e-7 && close(t, rate, hit));
                    // Or it runs within the triangle, and is told where it first met it.
                    let [gu, gv] = hit.gradient;
                    let rate = ray.direction.z - gu * ray.direction.x - gv * ray.direction.y;
                    let within = rate.abs() <= hit.rounding * ray.direction.truncate().abs().max_element();
                    assert!(found || within, "invented: {hit:?}\n{ray:?}");
                    let p = ray.origin + ray.direction * hit.t;
                    let off = hit.triangle.heights.iter().zip(hit.barycentric).map(|(h, w)| h * w).sum::<f64>() - p.z;
                    assert!(off.abs() <= hit.rounding, "{off} beyond {}: {hit:?}\n{ray:?}", hit.rounding);
                    borders += usize::from(hit.border.is_some());
                }
                for &(t, depth, rate) in &all {
                    if depth >= 1e-7 && t >= 0.0 {
                        assert!(ours.iter().any(|hit| close(t, rate, hit)), "lost: {t} {depth}\n{ray:?}\n{ours:?}");
                    }
                }
                for pair in ours.windows(2) {
                    assert!(pair[0].t <= pair[1].t, "out of order: {ours:?}");
                    assert_ne!(pair[0].entering, pair[1].entering, "{ray:?}\n{ours:?}");
                }
                hits[class as usize] += ours.len();
            }
        }
    }
    println!("hits by class {hits:?}, {borders} on slivers of the border");
    assert!(hits.iter().all(|&hits| hits > 500) && borders > 5, "{hits:?}, {borders} on the border");
}

/// The first hit is the first of all, and a range of parameters cuts the list without changing it.
#[test]
fn the_first_is_the_first_of_all_and_limits_cut_the_list() {
    let mut rng = Rng(5);
    for land in lands() {
        for class in 0..CLASSES {
            for _ in 0..60 {
                let ray = ray_of(class, &land, &mut rng);
                let all = land.hits(&ray);
                let mut first = None;
                DrawnPick { drawn: land.drawn(), pyramid: &land.pyramid }.intersect(&ray, |hit| {
                    first = Some(hit);
                    false
                });
                assert_eq!(first, all.first().copied());
                if let [a, b, ..] = all.as_slice()
                    && b.t - a.t > 1e-6 * b.t
                {
                    let middle = 0.5 * (a.t + b.t);
                    let count = |near, far| land.hits(&LatticeRay { near, far, ..ray }).len();
                    assert_eq!((count(0.0, middle), count(middle, f64::INFINITY)), (1, all.len() - 1), "{ray:?}");
                }
            }
        }
    }
}

/// The full-resolution surface is within the bound that a hit carries, and full detail carries none beyond rounding.
#[test]
fn hits_carry_a_true_bound() {
    let mut rng = Rng(2);
    let mut closest: f64 = 0.0;
    for land in lands() {
        let [cu, cv] = land.tree.cells().map(f64::from);
        for class in [0, 1, 5] {
            for _ in 0..500 {
                let ray = ray_of(class, &land, &mut rng);
                for hit in land.hits(&ray) {
                    if hit.border.is_some() {
                        continue;
                    }
                    let p = hit.point;
                    let surface = land.field.surface(p.x.clamp(0.0, cu), p.y.clamp(0.0, cv)).unwrap();
                    let off = (surface - p.z).abs();
                    let error = land.error(&hit);
                    assert!(off <= error, "{off} is beyond {error}: {hit:?}");
                    if error > 10.0 * hit.rounding {
                        closest = closest.max(off / error);
                    }
                }
            }
        }
    }
    assert!(closest > 0.8, "the bound is never nearly reached: {closest}");
}

/// Along borders of the map and rims of holes there are triangles on one side of the line only, and of two directions one found
/// none of them. The full-resolution walk is the judge where all cells are drawn; at other detail each ray has to agree with its
/// reverse. All numbers are such that f64 computes them without rounding.
#[test]
fn borders_and_rims_are_hit_in_both_directions() {
    let mut rng = Rng(31);
    let (mut hits, mut along_border, mut over_holes) = (0, 0, 0);
    for round in 0..240 {
        let [columns, rows]: [u32; 2] = [3 + rng.below(9), 3 + rng.below(9)];
        let (flat, holes) = (round % 5 == 0, round % 2 == 1);
        let mut sample = |_| match rng.below(if holes { 8 } else { 1 << 20 }) {
            0 => 0,
            _ if flat => 256,
            _ => 1 + (rng.bits() >> 55) as u16,
        };
        let samples: Vec<u16> = (0..columns * rows).map(&mut sample).collect();
        let Ok(field) = HeightField::from_u16(columns, rows, samples, Voids { sample: holes.then_some(0.0) }) else {
            continue;
        };
        let field = if holes { field.with_holes() } else { field };
        let metric = Precision { precision: 0.7, eye: LodEye::Point { u: 0.0, v: 0.0, height: 1.0 } };
        let resolutions = Resolutions::new(2, 2).unwrap();
        let land = Land::new(field, resolutions, (round % 3 == 0).then_some(metric));
        for _ in 0..400 {
            let lattice = |rng: &mut Rng| [rng.below(columns), rng.below(rows)];
            let at = lattice(&mut rng);
            let [u, v] = at.map(f64::from);
            let height = land.field.raw(at[0], at[1]) + [0.0, 0.0, 1.0, -0.5][rng.below(4) as usize];
            // Edges of coarse triangles have other slopes: only lines of the grid meet them without rounding.
            let directions = if round % 3 == 0 { 2 } else { 6 };
            let [du, dv] = [[1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, -1.0], [1.0, 2.0], [2.0, 1.0]]
                [rng.below(directions) as usize];
            let rise = if rng.below(3) == 0 { 0.0 } else { f64::from(rng.below(128)) - 64.0 };
            let d = DVec3::new(du, dv, rise);
            let o = DVec3::new(u, v, height) - d * 16.0;
            let ray = LatticeRay { origin: o, direction: d, near: 0.0, far: 32.0 };
            let back = LatticeRay { origin: o + d * 32.0, direction: -d, ..ray };
            let (ours, mut again) = (land.hits(&ray), land.hits(&back));
            again.reverse();
            let places = |hits: &[DrawnHit]| hits.iter().map(|hit| hit.t).collect::<Vec<_>>();
            let again: Vec<f64> = again.iter().map(|hit| 32.0 - hit.t).collect();
            let agree = |a: &[f64], b: &[f64]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9);
            let exact = ExactSurface { field: &land.field, pyramid: &land.pyramid };
            let mut all = Vec::new();
            exact.intersect(&ray, |hit| {
                all.push(hit.t);
                true
            });
            // Where it runs within the surface, but for rounding, one end of that is told, on the way there and back another one.
            let within = |t: f64| {
                let (p, q) = (o + d * (t - 1e-3), o + d * (t + 1e-3));
                let on = |p: DVec3| land.field.filled_surface(p.x, p.y).is_none_or(|h| (h - p.z).abs() < 1e-9);
                on(p) || on(q)
            };
            if ours.iter().any(|hit| within(hit.t)) || again.iter().chain(&all).any(|&t| within(t)) {
                // In the plane of a flat map nothing is rounded.
                if flat && rise == 0.0 && round % 3 != 0 && !holes {
                    let found = [ours.is_empty(), again.is_empty(), all.is_empty()];
                    assert!(found == [true; 3] || found == [false; 3], "{ray:?}\n{ours:?}\n{again:?}\n{all:?}");
                }
                continue;
            }
            assert!(agree(&places(&ours), &again), "{ray:?}\n{ours:?}\n{again:?}");
            if round % 3 != 0 {
                assert!(agree(&places(&ours), &all), "{ray:?}\n{ours:?}\n{all:?}");
            }
            hits += ours.len();
            let [cu, cv] = land.tree.cells().map(f64::from);
            let border = du == 0.0 && (u == 0.0 || u == cu) || dv == 0.0 && (v == 0.0 || v == cv);
            along_border += if border { ours.len() } else { 0 };
            over_holes += if holes { ours.len() } else { 0 };
        }
    }
    println!("{hits} hits, {along_border} along the border, {over_holes} beside holes");
    assert!(hits > 10_000 && along_border > 1000 && over_holes > 3000, "{hits} {along_border} {over_holes}");
}

#[test]
fn rays_that_say_nothing_hit_nothing() {
    let land = &lands()[0];
    let good = LatticeRay {
        origin: DVec3::new(20.0, 20.0, 1e6),
        direction: DVec3::new(0.1, 0.1, -1e4),
        near: 0.0,
        far: f64::INFINITY,
    };
    assert_eq!(land.hits(&good).len() % 2, 1);
    for bad in [
        LatticeRay { origin: DVec3::new(f64::NAN, 0.0, 0.0), ..good },
        LatticeRay { origin: DVec3::new(0.0, f64::INFINITY, 0.0), ..good },
        LatticeRay { direction: DVec3::ZERO, ..good },
        LatticeRay { direction: DVec3::new(0.0, 1.0, f64::NAN), ..good },
        LatticeRay { near: f64::NAN, ..good },
        LatticeRay { near: 1e9, ..good },
        LatticeRay { near: 2.0, far: 1.0, ..good },
    ] {
        assert_eq!(land.hits(&bad), [], "{bad:?}");
    }
    // Directions need no length, and t counts in them.
    for scale in [2f64.powi(-600), 2f64.powi(-30), 2f64.powi(60), 2f64.powi(600)] {
        let scaled = land.hits(&LatticeRay { direction: good.direction * scale, ..good });
        let t: Vec<f64> = scaled.iter().map(|hit| hit.t * scale).collect();
        assert_eq!(t, land.hits(&good).iter().map(|hit| hit.t).collect::<Vec<_>>(), "{scale}");
    }
}

fn soak() -> bool {
    std::env::var("SEAMOUNT_SOAK").is_ok_and(|v| v != "0")
}

/// Pictures of scenes, with eyes anywhere.
#[cfg(feature = "render")]
mod pictures {
    use super::*;
    use std::path::Path;
    use std::sync::Arc;

    use seamount::render::Headless;
    use seamount::scene::Pixels;

    struct Map {
        image: Arc<Image>,
        terrain: SeamlessTerrain,
    }

    fn maps() -> Vec<Map> {
        let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
        let open = |name| Arc::new(Image::open(&scenes.join(name)).unwrap());
        let plain = SeamlessTerrain::default();
        let floats = (0..70 * 50).map(|i| ((f64::from(i % 70) / 7.0).sin() * (f64::from(i / 70) / 5.0).cos()) as f32);
        vec![
            Map {
                image: open("fuji.png"),
                terrain: SeamlessTerrain {
                    size: Some(DVec2::new(90_600.0, 111_240.0)),
                    max_height: 65_535.0,
                    base_height: -1_000.0,
                    void_sample: Some(0.0),
                    ..plain.clone()
                },
            },
            Map {
                image: open("jacksboro.png"),
                terrain: SeamlessTerrain { scale: 30.0, max_height: -2.0, ..plain.clone() },
            },
            Map {
                image: open("fuji.png"),
                terrain: SeamlessTerrain {
                    scale: 30.0,
                    max_height: 65.0,
                    void_sample: Some(0.0),
                    voids: VoidMode::Hole,
                    ..plain.clone()
                },
            },
            Map { image: open("walls.png"), terrain: SeamlessTerrain { scale: 2.0, max_height: 0.2, ..plain.clone() } },
            Map {
                image: Arc::new(Image::new(70, 50, Pixels::GrayF32(floats.collect())).unwrap()),
                terrain: SeamlessTerrain { scale: 10.0, max_height: 0.5, resolutions: (2, 3), ..plain },
            },
        ]
    }

    /// A scene with a terrain under a transform, seen from somewhere over or beside it.
    fn scene(map: &Map, number: u32, rng: &mut Rng) -> Scene {
        let detail = match number % 4 {
            0 => DetailMode::PixelError(1.0),
            1 => DetailMode::PixelError(rng.range(2.0, 20.0)),
            2 => DetailMode::Precision(rng.range(0.5, 3.0)),
            _ => DetailMode::Precision(8.0),
        };
        let morph = map.terrain.resolutions.1 == 2 && number % 8 < 4;
        let terrain = SeamlessTerrain { detail, morph, ..map.terrain.clone() };
        let field = map.image.height_field(terrain.void_sample).unwrap();
        let frame = terrain.frame(&field);
        let [cu, cv] = field.cells().map(f64::from);
        let (low, high) = {
            let range = MinMaxPyramid::new(&field).full_range();
            let ends = range.map(|w| frame.local(DVec3::new(0.0, 0.0, w)).z);
            (ends[0].min(ends[1]), ends[0].max(ends[1]))
        };
        let turn = match number % 3 {
            0 => Transform::default(),
            1 => Transform {
                translation: DVec3::new(1e4, -3e4, 100.0),
                rotation: AxisAngle { axis: DVec3::new(0.3, 1.0, 0.2).normalize(), angle: rng.range(-3.0, 3.0) },
                ..Transform::default()
            },
            _ => Transform { scale_factor: DVec3::new(1.5, -1.0, 2.0), ..Transform::default() },
        };
        let mut scene = Scene::new();
        let root = scene.root();
        // The camera stands in the terrain's own frame, moved with it: over the map, grazing every third time.
        let side = frame.cell_size[0] * cu;
        let grazing = number % 3 == 1;
        let place = |rng: &mut Rng, spread: f64| {
            let u = rng.range(-spread, 1.0 + spread) * cu;
            let v = rng.range(-spread, 1.0 + spread) * cv;
            let ground = field.surface(u.clamp(0.0, cu), v.clamp(0.0, cv)).unwrap();
            frame.local(DVec3::new(u, v, ground))
        };
        let up = if grazing { rng.range(0.002, 0.02) } else { rng.range(0.05, 0.7) };
        let above = if terrain.max_height > 0.0 { 1.0 } else { -1.0 };
        let mut eye = place(rng, 0.1);
        eye.z = if grazing { eye.z + above * up * side } else { high.max(low) + up * side };
        let at = place(rng, 0.0);
        // Node's matrix applied by hand: what the transform does is tested elsewhere.
        scene.add(root, turn).unwrap();
        let position = (Some(eye), Some(at));
        let height_angle = rng.range(0.4, 1.2);
        if number % 5 == 4 {
            let height = side * rng.range(0.2, 0.8);
            let lens = OrthographicCamera { position: position.0, look_at: position.1, height, ..Default::default() };
            scene.add(root, lens).unwrap();
        } else {
            let lens = PerspectiveCamera {
                position: position.0,
                look_at: position.1,
                height_angle,
                ..PerspectiveCamera::default()
            };
            scene.add(root, lens).unwrap();
        }
        scene.add(root, Texture2::from_image(Arc::clone(&map.image))).unwrap();
        scene.add(root, terrain).unwrap();
        scene
    }

    #[derive(Debug, Default, Clone, Copy)]
    struct Count {
        pixels: usize,
        ground: usize,
        /// Pixels at whose square some rays hit and some miss.
        rims: usize,
        /// Pixels for which the tolerance is below a thousandth of the depth.
        sharp: usize,
        /// Share of the tolerance that was needed, at most.
        worst: f64,
    }

    fn check(scene: &Scene, size: [u32; 2], headless: &mut Headless) -> Count {
        let action = RenderAction::new(size[0], size[1]);
        let view = action.viewpoint(scene).unwrap();
        let depth = headless.draw_depth(&action.apply(scene).unwrap()).unwrap();
        let pick = RayPickAction { surface: Surface::Drawn, ..RayPickAction::pixel(0, 0, size) };
        let picker = pick.picker(scene).unwrap();
        let shift = 1.0 / 512.0;
        let mut rays = Vec::new();
        for y in 0..size[1] {
            for x in 0..size[0] {
                for (dx, dy) in [(0.0, 0.0), (-shift, -shift), (shift, -shift), (-shift, shift), (shift, shift)] {
                    let (x, y) = (f64::from(x) + 0.5 + dx, f64::from(y) + 0.5 + dy);
                    rays.push(ray_through(&picker, x / f64::from(size[0]), y / f64::from(size[1])));
                }
            }
        }
        let clip = view.clip_from_eye();
        let project = |p: DVec3| {
            let clip = clip * (p - view.eye).extend(1.0);
            clip.z / clip.w
        };
        // The ground is drawn from above only, beyond the near plane.
        let seen = |hit: &PickedPoint| {
            let HitDetail::Terrain(detail) = hit.detail else { return false };
            detail.entering && project(hit.point) <= 1.0
        };
        let picks: Vec<Option<PickedPoint>> =
            picker.pick_many(&rays, true).unwrap().into_iter().map(|hits| hits.into_iter().find(seen)).collect();
        let mut count = Count::default();
        // One pixel along x and y, to tell how depth changes over the plane of a triangle.
        let step = [1.0 / f64::from(size[0]), 1.0 / f64::from(size[1])];
        for (pixel, (picks, rays)) in picks.chunks(5).zip(rays.chunks(5)).enumerate() {
            let stored = f64::from(depth[pixel]);
            let (x, y) = (pixel as u32 % size[0], pixel as u32 / size[0]);
            count.pixels += 1;
            let hits = picks.iter().flatten().count();
            count.rims += usize::from(hits % 5 != 0);
            if stored == 0.0 {
                assert!(hits < 5, "pixel {x}, {y} shows no ground, but is picked: {:?}", picks[0]);
                continue;
            }
            assert!(hits > 0, "pixel {x}, {y} shows ground, but is not picked");
            let (mut low, mut high, mut slack) = (f64::INFINITY, f64::NEG_INFINITY, 0.0f64);
            for (found, _) in picks.iter().zip(rays) {
                let Some(hit) = found else { continue };
                let here = project(hit.point);
                // Depth on the triangle's plane a 1/256 of a pixel further along each axis.
                let along = |dx: f64, dy: f64| {
                    let p = picker.viewpoint().unwrap();
                    let (x, y) = ((f64::from(x) + 0.5) * step[0], (f64::from(y) + 0.5) * step[1]);
                    let on = |x: f64, y: f64| {
                        let (o, d) = p.ray(x, y);
                        project(o + d * ((hit.point - o).dot(hit.normal) / d.dot(hit.normal)))
                    };
                    (on(x + dx, y + dy) - on(x, y)).abs() / 256.0
                };
                // Sums in f32 are off by a few units of the distance, and so is depth by that over the depth's own.
                let reach = (hit.point - view.eye).length() / (hit.point - view.eye).dot(view.forward);
                let units = 2f64.powi(-20) * here.abs() * reach + 2f64.powi(-22);
                let folds = along(step[0], 0.0) + along(0.0, step[1]);
                slack = slack.max(folds + if view.far.is_none() { units - 2f64.powi(-22) } else { units });
                (low, high) = (low.min(here), high.max(here));
            }
            let off = (low - stored).max(stored - high).max(0.0);
            assert!(
                off <= slack,
                "pixel {x}, {y}: depth {stored}, picked {low}..{high}, off by {off} of {slack}: {:?}",
                picks[0]
            );
            count.ground += 1;
            count.sharp += usize::from(high - low + slack < 1e-3 * stored);
            count.worst = count.worst.max(off / slack);
        }
        count
    }

    fn ray_through(picker: &Picker<'_>, x: f64, y: f64) -> Ray {
        picker.ray_through(x, y).unwrap()
    }

    /// What is picked is what is drawn, pixel by pixel.
    #[test]
    fn drawn_is_picked() {
        let mut headless = Headless::new(None).unwrap_or_else(|error| panic!("{error}"));
        let mut rng = Rng(40);
        let size = if soak() { [320, 240] } else { [64, 48] };
        let mut total = Count::default();
        let maps = maps();
        for number in 0..50 {
            let scene = scene(&maps[number as usize % maps.len()], number / 4 + number, &mut rng);
            let count = check(&scene, size, &mut headless);
            println!("{number}: {count:?}");
            total.pixels += count.pixels;
            total.ground += count.ground;
            total.rims += count.rims;
            total.sharp += count.sharp;
            total.worst = total.worst.max(count.worst);
        }
        println!("{total:?}");
        assert!(total.ground * 3 > total.pixels && total.sharp * 10 > total.ground * 9, "{total:?}");
    }

    /// Below one point the three surfaces are as far apart as their bounds say.
    #[test]
    fn coarse_and_exact_are_within_their_bounds_of_drawn() {
        let mut rng = Rng(8);
        let maps = maps();
        let mut pairs = 0;
        for number in 0..24 {
            let map = &maps[number as usize % maps.len()];
            let scene = scene(map, number, &mut rng);
            let pick = RayPickAction { all: true, ..RayPickAction::pixel(0, 0, [64, 48]) };
            let pickers = [Surface::Drawn, Surface::Coarse, Surface::Exact]
                .map(|surface| RayPickAction { surface, ..pick.clone() }.picker(&scene).unwrap());
            for y in (1..48).step_by(3) {
                for x in (1..64).step_by(3) {
                    // Along the terrain's own z through what is seen, which is where the bounds hold.
                    let through = pickers[0].ray_through(f64::from(x) / 64.0, f64::from(y) / 48.0).unwrap();
                    let Some(seen) = pickers[0].pick(&through, false).unwrap().pop() else { continue };
                    let up = scene_up(&scene, &seen);
                    let span = up * 1e6;
                    let ray = Ray::new(seen.point + span, -span).unwrap();
                    let [drawn, coarse, exact] = pickers.each_ref().map(|p| p.pick(&ray, false).unwrap().pop());
                    let Some(drawn) = drawn else { continue };
                    for other in [coarse, exact].into_iter().flatten() {
                        let off = (drawn.distance - other.distance).abs();
                        let bound = drawn.error_bound.unwrap() + other.error_bound.unwrap();
                        // Numbers of a million are known to 10⁻¹⁰.
                        assert!(off <= bound + 1e-9 * span.length(), "{off} beyond {bound}: {drawn:?} {other:?}");
                        pairs += 1;
                    }
                }
            }
        }
        assert!(pairs > 5000, "{pairs} pairs");
    }

    /// The direction of the terrain's own z, in world units per local unit.
    fn scene_up(scene: &Scene, hit: &PickedPoint) -> DVec3 {
        let transform = hit
            .path
            .nodes()
            .flat_map(|key| scene.children(key).to_vec())
            .find_map(|key| scene.get::<Transform>(key).cloned());
        let Transform { rotation, scale_factor, .. } = transform.unwrap();
        glam::DQuat::from_axis_angle(rotation.axis.normalize(), rotation.angle) * (DVec3::Z * scale_factor.z)
    }

    /// A frozen view is picked as it is drawn, wherever the camera has gone.
    #[test]
    fn a_frozen_view_is_picked_as_it_is_drawn() {
        let mut rng = Rng(9);
        let map = &maps()[0];
        let mut scene = scene(map, 0, &mut rng);
        let action = RenderAction::new(64, 48);
        let mut view = View::default();
        action.apply_in(&scene, &mut view).unwrap();
        let pick = RayPickAction { surface: Surface::Drawn, ..RayPickAction::pixel(0, 0, [64, 48]) };
        let ray = pick.picker(&scene).unwrap().ray_through(0.5, 0.6).unwrap();
        let before = pick.picker(&scene).unwrap().pick(&ray, true).unwrap();
        assert!(!before.is_empty());
        view.freeze = true;
        let camera =
            scene.children(scene.root()).iter().copied().find(|&k| scene.get::<PerspectiveCamera>(k).is_some());
        if let Some(mut camera) = scene.edit::<PerspectiveCamera>(camera.unwrap()) {
            camera.position = Some(DVec3::new(-9e5, -9e5, 9e5));
        }
        action.apply_in(&scene, &mut view).unwrap();
        assert_eq!(pick.picker_in(&scene, &view).unwrap().pick(&ray, true).unwrap(), before);
        assert_ne!(pick.picker(&scene).unwrap().pick(&ray, true).unwrap(), before);
    }
}
