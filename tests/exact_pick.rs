//! Exact picks against references in f64 that share no code with them.
//!
//! * `Reference` finds all lines and diagonals that a ray crosses at once, sorts them, and takes the height above the
//!   surface at each from the triangle's plane: no tree, no stepping, no carried sign.
//! * `triangles` tries every triangle near the ray's path, borders included.
//! * `exact_gap` measures in integers how far a reported hit is from the surface.
//!
//! A fixed share of the rays runs by default. `SEAMOUNT_SOAK=1` runs a million in each class on each map, a larger
//! number that many.
//!
//! # The band
//!
//! With ε = 2⁻⁵³ the reference is off like the walk (see `ExactHit::error`): by at most 11 ε S, where S sums the
//! magnitudes that were added. A sign counts as certain beyond a band of 64 ε S. Between neighbouring certain points of
//! unequal sign there has to be exactly one hit, of equal sign none; where uncertain points lie between, one more pair of
//! hits is as right as none. The parameter of a hit may be off by (band / |df/dt|) + 8 ε |t|.
#![allow(missing_docs, reason = "a test")]

mod common;

use std::path::Path;

use common::Rng;
use glam::DVec3;
use rayon::prelude::*;
use seamount::scene::Image;
use seamount::terrain::pick::LatticeRay;
use seamount::terrain::{ExactHit, ExactSurface, HeightField, MinMaxPyramid, Voids, generate};

const EPSILON: f64 = f64::EPSILON / 2.0;

struct Map {
    name: String,
    field: HeightField,
    pyramid: MinMaxPyramid,
}

impl Map {
    fn new(name: &str, field: HeightField) -> Self {
        Self { name: name.to_owned(), pyramid: MinMaxPyramid::new(&field), field }
    }

    fn u16(name: &str, columns: u32, rows: u32, height: impl FnMut(u32) -> u16) -> Self {
        let samples = (0..columns * rows).map(height).collect();
        Self::new(name, HeightField::from_u16(columns, rows, samples, Voids::default()).unwrap())
    }

    fn surface(&self) -> ExactSurface<'_> {
        ExactSurface { field: &self.field, pyramid: &self.pyramid }
    }

    fn hits(&self, ray: &LatticeRay) -> Vec<ExactHit> {
        let mut hits = Vec::new();
        self.surface().intersect(ray, |hit| {
            hits.push(hit);
            true
        });
        hits
    }

    fn cells(&self) -> [f64; 2] {
        self.field.cells().map(f64::from)
    }
}

fn scene(name: &str, void: Option<f64>) -> Map {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    Map::new(name, Image::open(&path).unwrap().height_field(void).unwrap())
}

fn scenes() -> Vec<Map> {
    vec![
        scene("andes.png", None),
        scene("fuji.png", Some(0.0)),
        scene("jacksboro.png", None),
        scene("puget.png", None),
        scene("walls.png", None),
    ]
}

fn small_maps() -> Vec<Map> {
    let mut rng = Rng(77);
    let noise = |rng: &mut Rng| (rng.bits() >> 48) as u16;
    let mut maps = vec![
        Map::u16("equal", 20, 13, |_| 1000),
        Map::u16("spike", 17, 17, |i| if i == 8 * 17 + 8 { 65535 } else { 0 }),
        Map::u16("terraces", 40, 33, |i| 256 * ((i % 40 / 3 + i / 40 / 4) % 5) as u16),
        Map::u16("2 × 2", 2, 2, |i| [0, 65535, 300, 7][i as usize]),
        Map::u16("random 3 × 5", 3, 5, |_| noise(&mut rng)),
        Map::u16("random 2 × 65", 2, 65, |_| noise(&mut rng)),
        Map::u16("random 70 × 2", 70, 2, |_| noise(&mut rng)),
        Map::u16("random 33 × 64", 33, 64, |_| noise(&mut rng)),
        Map::u16("low 50 × 50", 50, 50, |_| noise(&mut rng) >> 13),
        Map::new("generated 257", generate(257, 4).unwrap()),
    ];
    let floats = (0..31 * 23).map(|_| rng.range(-1.0, 1.0) as f32).collect();
    maps.push(Map::new("floats", HeightField::from_f32(31, 23, floats, Voids::default()).unwrap()));
    let wild = (0..31 * 23).map(|_| (rng.range(-1.0, 1.0) * 2f64.powi(rng.below(60) as i32 - 30)) as f32).collect();
    maps.push(Map::new("wild floats", HeightField::from_f32(31, 23, wild, Voids::default()).unwrap()));
    maps
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Class {
    Camera,
    Grazing,
    GridLine,
    Diagonal,
    Vertices,
    Down,
    DownOnLines,
    Tangent,
    Anything,
}

const CLASSES: [Class; 9] = [
    Class::Camera,
    Class::Grazing,
    Class::GridLine,
    Class::Diagonal,
    Class::Vertices,
    Class::Down,
    Class::DownOnLines,
    Class::Tangent,
    Class::Anything,
];

fn ray_of(class: Class, map: &Map, rng: &mut Rng) -> LatticeRay {
    let [cu, cv] = map.cells();
    let [low, high] = map.pyramid.full_range();
    let relief = (high - low).max(1.0);
    let whole = |rng: &mut Rng, n: f64| f64::from(rng.below(n as u32 + 1));
    let sign = |rng: &mut Rng| if rng.below(2) == 0 { 1.0 } else { -1.0 };
    let place = |rng: &mut Rng| DVec3::new(rng.range(0.0, cu), rng.range(0.0, cv), rng.range(low, high));
    let level = |rng: &mut Rng| {
        let (sin, cos) = rng.range(0.0, std::f64::consts::TAU).sin_cos();
        DVec3::new(cos, sin, 0.0)
    };
    // Raw units per cell of a slope of about 45° on a mountain.
    let steep = relief / 50.0;
    let mut far = f64::INFINITY;
    let mut near = 0.0;
    let (origin, direction) = match class {
        Class::Camera => {
            let eye = place(rng) + DVec3::Z * rng.range(0.0, relief);
            (eye, place(rng) - eye)
        }
        Class::Grazing => {
            let direction = level(rng) + DVec3::Z * rng.range(-0.0175, 0.0175) * steep;
            (place(rng) - direction * rng.range(0.0, 2.0) * cu.max(cv), direction)
        }
        Class::GridLine => {
            let slope = DVec3::Z * rng.range(-0.3, 0.1) * steep;
            let mut origin = place(rng);
            if rng.below(2) == 0 {
                origin.x = whole(rng, cu);
                (origin, DVec3::Y * sign(rng) * rng.range(0.1, 3.0) + slope)
            } else {
                origin.y = whole(rng, cv);
                (origin, DVec3::X * sign(rng) * rng.range(0.1, 3.0) + slope)
            }
        }
        Class::Diagonal => {
            let step = rng.range(0.1, 3.0) * sign(rng);
            let mut origin = place(rng);
            origin.x = origin.y.fract() + whole(rng, cu);
            (origin, DVec3::new(step, step, rng.range(-0.3, 0.1) * steep))
        }
        Class::Vertices => {
            let (c, r) = (rng.below(cu as u32 + 1), rng.below(cv as u32 + 1));
            let vertex = DVec3::new(f64::from(c), f64::from(r), map.field.raw(c, r));
            let direction = level(rng) * rng.range(0.1, 2.0) - DVec3::Z * rng.range(0.1, 2.0) * steep;
            (vertex - direction * rng.range(0.5, 100.0), direction)
        }
        Class::Down => (place(rng) + DVec3::Z * relief, -DVec3::Z * rng.range(0.5, 2.0)),
        Class::DownOnLines => {
            let mut origin = place(rng) + DVec3::Z * relief;
            match rng.below(4) {
                0 => origin.x = whole(rng, cu),
                1 => origin.y = whole(rng, cv),
                2 => (origin.x, origin.y) = (whole(rng, cu), whole(rng, cv)),
                _ => origin.x = (origin.y.fract() + whole(rng, cu)).min(cu),
            }
            (origin, -DVec3::Z)
        }
        Class::Tangent => {
            // Over a sample and level with the slope to a neighbour, or between the slopes to two.
            let (c, r) = (rng.below(cu as u32 + 1), rng.below(cv as u32 + 1));
            let vertex = DVec3::new(f64::from(c), f64::from(r), map.field.raw(c, r));
            let [i, j] = [rng.below(5), rng.below(5)].map(|k| i64::from(k) - 2);
            let neighbour = |s: i64| {
                let (c, r) = ((i64::from(c) + s * i).clamp(0, cu as i64), (i64::from(r) + s * j).clamp(0, cv as i64));
                map.field.raw(c as u32, r as u32)
            };
            let (after, before) = (neighbour(1) - vertex.z, vertex.z - neighbour(-1));
            let slope = if rng.below(2) == 0 { after } else { after + (before - after) * rng.unit() };
            let direction = DVec3::new(i as f64, j as f64, slope);
            (vertex - direction * rng.range(0.0, 9.0), direction)
        }
        Class::Anything => {
            let origin =
                DVec3::new(rng.range(-cu, 2.0 * cu), rng.range(-cv, 2.0 * cv), low + rng.range(-1.0, 2.0) * relief);
            if rng.below(2) == 0 {
                near = rng.range(0.0, 0.8);
                far = near + rng.range(0.0, 0.6);
            }
            (origin, place(rng) - origin)
        }
    };
    let direction = if direction == DVec3::ZERO { DVec3::new(0.5, 1.0, 0.0) } else { direction };
    LatticeRay { origin, direction, near, far }
}

/// f along a ray: parameter, value, half width of the band, and |df/dt| of the piece that ends here.
#[derive(Debug, Clone, Copy)]
struct Value {
    t: f64,
    f: f64,
    band: f64,
    slope: f64,
}

/// Half the width of the band of doubt at t in a cell. Rounding may also put a point beside its cell, so near the
/// surface the slopes of the cells around count.
fn band(map: &Map, ray: &LatticeRay, t: f64, f: f64, cell: [u32; 2]) -> f64 {
    let (o, d) = (ray.origin.abs(), (ray.direction * t).abs());
    let size = o + d + DVec3::ONE;
    let [c, r] = cell;
    let h = |c: u32, r: u32| map.field.raw(c, r);
    let slopes = |c, r| {
        let [a, b, e, g] = [h(c, r), h(c + 1, r), h(c, r + 1), h(c + 1, r + 1)];
        (b - a).abs().max((g - e).abs()) * size.x + (e - a).abs().max((g - b).abs()) * size.y + a.abs().max(g.abs())
    };
    let width = |slopes: f64| 64.0 * EPSILON * (size.z + slopes);
    // No cell of the map has a wider one: far from the surface that of the cell will do.
    let [low, high] = map.pyramid.full_range();
    if f.abs() > width((high - low) * (size.x + size.y) + low.abs().max(high.abs())) {
        return width(slopes(c, r));
    }
    let around = (c.saturating_sub(1)..=c + 1).flat_map(|c| (r.saturating_sub(1)..=r + 1).map(move |r| (c, r)));
    width(around.map(|(c, r)| slopes(c, r)).fold(0.0, f64::max))
}

/// All ends of pieces of f along the ray. For two triangles that meet, f is listed twice.
fn values(map: &Map, ray: &LatticeRay) -> Vec<Value> {
    let [cu, cv] = map.cells();
    let (o, d) = (ray.origin, ray.direction);
    let (mut near, mut far) = (ray.near, ray.far);
    for (o, d, n) in [(o.x, d.x, cu), (o.y, d.y, cv)] {
        if d == 0.0 {
            if o < 0.0 || o > n {
                return Vec::new();
            }
            continue;
        }
        let (a, b) = (-o / d, (n - o) / d);
        near = near.max(a.min(b));
        far = far.min(a.max(b));
    }
    if near > far {
        return Vec::new();
    }
    // Nothing can be hit above and below all heights.
    let [low, high] = map.pyramid.full_range();
    if d.z != 0.0 {
        let (a, b) = ((low - 1.0 - o.z) / d.z, (high + 1.0 - o.z) / d.z);
        near = near.max(a.min(b));
        far = far.min(a.max(b));
    } else if o.z < low || o.z > high {
        return Vec::new();
    }
    if near > far {
        return Vec::new();
    }
    let mut cuts = vec![near, far];
    for (o, d) in [(o.x, d.x), (o.y, d.y), (o.x - o.y, d.x - d.y)] {
        if d != 0.0 {
            let (a, b) = (o + d * near, o + d * far);
            let (first, last) = (a.min(b).floor() as i64, a.max(b).ceil() as i64);
            cuts.extend((first..=last).map(|k| (k as f64 - o) / d).filter(|&t| t > near && t < far));
        }
    }
    cuts.sort_by(f64::total_cmp);
    let mut values = Vec::with_capacity(2 * cuts.len());
    for pair in cuts.windows(2) {
        let middle = o + d * (0.5 * (pair[0] + pair[1]));
        let c = (middle.x.max(0.0) as u32).min(cu as u32 - 1);
        let r = (middle.y.max(0.0) as u32).min(cv as u32 - 1);
        let heights =
            [map.field.raw(c, r), map.field.raw(c + 1, r), map.field.raw(c, r + 1), map.field.raw(c + 1, r + 1)];
        let [a, b, e, g] = heights;
        let upper = middle.x - f64::from(c) >= middle.y - f64::from(r);
        let [gu, gv] = if upper { [b - a, g - b] } else { [g - e, e - a] };
        let f = |t: f64| {
            let p = o + d * t;
            p.z - (a + gu * (p.x - f64::from(c)) + gv * (p.y - f64::from(r)))
        };
        let slope = (d.z - gu * d.x - gv * d.y).abs();
        for &t in pair {
            values.push(Value { t, f: f(t), band: band(map, ray, t, f(t), [c, r]), slope });
        }
    }
    values
}

/// What a comparison has seen.
#[derive(Debug, Clone, Copy, Default)]
struct Seen {
    rays: u64,
    hits: u64,
    /// Hits with a parameter that is known to 10⁻⁹.
    sharp: u64,
}

impl Seen {
    fn add(self, other: Self) -> Self {
        Self { rays: self.rays + other.rays, hits: self.hits + other.hits, sharp: self.sharp + other.sharp }
    }
}

/// Compares the hits of one ray with the reference.
fn compare(map: &Map, ray: &LatticeRay) -> Result<Seen, String> {
    let hits = map.hits(ray);
    let fail = |what: &str| Err(format!("{what}\n{}: {ray:?}\n{hits:?}", map.name));
    for (k, hit) in hits.iter().enumerate() {
        check_hit(map, ray, hit)?;
        if k > 0 && (hits[k - 1].t > hit.t || hits[k - 1].entering == hit.entering) {
            return fail("out of order");
        }
    }
    if map.surface().first(ray) != hits.first().copied() {
        return fail("the first is another");
    }
    let mut seen = Seen { rays: 1, hits: hits.len() as u64, sharp: 0 };
    if ray.direction.x == 0.0 && ray.direction.y == 0.0 {
        let ground = map.field.surface(ray.origin.x, ray.origin.y);
        let expected = ground.map(|h| (h - ray.origin.z) / ray.direction.z);
        seen.sharp += hits.len() as u64;
        return match (expected.filter(|t| (ray.near..=ray.far).contains(t)), hits.as_slice()) {
            (None, []) => Ok(seen),
            (Some(t), [hit]) if (hit.t - t).abs() <= 1e-12 * t.abs() => Ok(seen),
            _ => fail("vertical"),
        };
    }
    let values = values(map, ray);
    if values.is_empty() {
        // Rounding decides whether a ray through a corner of the map meets it.
        let [cu, cv] = map.cells();
        let near = |x: f64, size: f64| x.min(size - x).abs();
        // A coordinate is known up to the roundings of a product, a difference and a sum.
        let off = |o: f64, d: f64, t: f64| 4.0 * EPSILON * (o.abs() + (d * t).abs() + 1.0);
        let corner = |hit: &ExactHit| {
            let (o, d) = (ray.origin, ray.direction);
            near(hit.point.x, cu) <= off(o.x, d.x, hit.t) && near(hit.point.y, cv) <= off(o.y, d.y, hit.t)
        };
        return if hits.iter().all(corner) { Ok(seen) } else { fail("invented") };
    }
    let mut hits = hits.iter().peekable();
    // The certain value before, and whether there were uncertain ones since (the ends of the ray are doubtful only if
    // they are near the surface).
    let mut last: Option<Value> = None;
    let mut doubt: Option<[f64; 2]> = None;
    let (mut flattest, mut widest) = (f64::INFINITY, 0.0f64);
    for value in values {
        flattest = flattest.min(value.slope);
        widest = widest.max(value.band);
        if value.f.abs() <= value.band {
            doubt = Some([doubt.map_or(value.t, |d| d[0]), value.t]);
            continue;
        }
        let mut between = 0;
        let mut entering = None;
        let mut t = f64::NAN;
        while let Some(hit) = hits.next_if(|hit| hit.t <= value.t) {
            between += 1;
            entering = Some(hit.entering);
            t = hit.t;
        }
        let turned = last.is_some_and(|l| (l.f > 0.0) != (value.f > 0.0));
        if let Some(last) = last
            && between % 2 != i32::from(turned)
        {
            let hits = map.hits(ray);
            return Err(format!("{between} hits between {last:?} and {value:?} on {}: {ray:?}\n{hits:#?}", map.name));
        }
        if doubt.is_none() && between != i32::from(turned) {
            return Err(format!("{between} hits between {last:?} and {value:?} on {}, no doubt: {ray:?}", map.name));
        }
        if entering.is_some_and(|e| e != (value.f < 0.0)) {
            return Err(format!("wrong way before {value:?} on {}: {ray:?}", map.name));
        }
        if let (true, 1, Some(last)) = (turned, between, last)
            // Two values at the same place differ by rounding only.
            && value.t > last.t
        {
            // Where there is doubt the zero lies there, or within a band's width in t.
            let zero = last.t + (value.t - last.t) * (last.f / (last.f - value.f));
            let [from, to] = doubt.unwrap_or([zero; 2]);
            let bound = 2.0 * widest / flattest + 8.0 * EPSILON * t.abs();
            if !(t >= from - bound && t <= to + bound) {
                return Err(format!("t {t}, expected {from}..{to} ± {bound} on {}: {ray:?}", map.name));
            }
            seen.sharp += u64::from(to - from + bound <= 1e-9 * t.abs());
        }
        last = Some(value);
        (doubt, flattest, widest) = (None, f64::INFINITY, value.band);
    }
    match hits.next() {
        Some(hit) if doubt.is_none() => Err(format!("invented {hit:?} on {}: {ray:?}", map.name)),
        _ => Ok(seen),
    }
}

/// What a hit says of itself has to be true.
fn check_hit(map: &Map, ray: &LatticeRay, hit: &ExactHit) -> Result<(), String> {
    let p = ray.origin + ray.direction * hit.t;
    let [c, r] = hit.cell;
    let fail = |what: &str| Err(format!("{what} on {}: {ray:?}\n{hit:?}", map.name));
    if c >= map.field.cells()[0] || r >= map.field.cells()[1] {
        return fail("cell");
    }
    let size = ray.origin.abs() + (ray.direction * hit.t).abs() + DVec3::ONE;
    // Rounding of t and of the point, in cells.
    let near = |a: f64, b: f64, size: f64| (a - b).abs() <= 16.0 * EPSILON * size;
    let inside =
        (0.0..=1.0).contains(&(hit.point.x - f64::from(c))) && (0.0..=1.0).contains(&(hit.point.y - f64::from(r)));
    // On a diagonal the two axes share the rounding.
    let both = size.x + size.y;
    if !inside || !near(p.x, hit.point.x, both) || !near(p.y, hit.point.y, both) {
        return fail("point");
    }
    if (p.z - hit.point.z).abs() > 2.0 * hit.error {
        return fail("height");
    }
    let corners = if hit.upper { [[c, r], [c + 1, r], [c + 1, r + 1]] } else { [[c, r], [c, r + 1], [c + 1, r + 1]] };
    let [x, y, z] = corners.map(|[c, r]| DVec3::new(f64::from(c), f64::from(r), map.field.raw(c, r)));
    let [wx, wy, wz] = hit.barycentric;
    let weighted = x * wx + y * wy + z * wz;
    let largest = x.z.abs().max(y.z.abs()).max(z.z.abs());
    if hit.barycentric.iter().any(|w| !(0.0..=1.0).contains(w))
        || (weighted - hit.point).truncate().abs().max_element() > 1e-11 * (1.0 + hit.point.truncate().max_element())
        || (weighted.z - hit.point.z).abs() > 1e-14 * largest
    {
        return fail("barycentric");
    }
    let [gu, gv] = hit.gradient;
    for (a, b) in [(x, y), (y, z)] {
        let rise = gu * (b.x - a.x) + gv * (b.y - a.y);
        if (rise - (b.z - a.z)).abs() > 1e-14 * largest {
            return fail("gradient");
        }
    }
    Ok(())
}

fn soak() -> bool {
    soak_rays().is_some()
}

/// Rays per class and map that `SEAMOUNT_SOAK` asks for.
fn soak_rays() -> Option<u64> {
    match std::env::var("SEAMOUNT_SOAK").ok()?.parse().ok()? {
        0 => None,
        1 => Some(1_000_000),
        count => Some(count),
    }
}

/// Compares `count` rays of a class, and checks that enough of them hit to mean something.
fn compare_class(map: &Map, class: Class, count: u64) {
    let chunk = 500;
    let seen = (0..count.div_ceil(chunk))
        .into_par_iter()
        .map(|part| {
            let mut rng = Rng(part * 1_000_003 + class as u64 * 7919);
            let mut seen = Seen::default();
            for _ in 0..chunk.min(count - part * chunk) {
                let ray = ray_of(class, map, &mut rng);
                seen = seen.add(compare(map, &ray).unwrap_or_else(|e| panic!("{class:?}: {e}")));
            }
            seen
        })
        .reduce(Seen::default, Seen::add);
    println!("{} {class:?}: {seen:?}", map.name);
    assert!(seen.hits > 0, "{} {class:?}: {seen:?}", map.name);
    if !matches!(class, Class::Tangent) && map.name.contains(".png") {
        assert!(seen.sharp as f64 >= 0.6 * seen.hits as f64, "{} {class:?}: {seen:?}", map.name);
    }
}

#[test]
fn real_maps_agree_with_the_reference() {
    let count = soak_rays().unwrap_or(1000);
    for map in scenes() {
        for class in CLASSES {
            compare_class(&map, class, count);
        }
    }
}

#[test]
fn small_maps_agree_with_the_reference() {
    let count = soak_rays().unwrap_or(2000);
    for map in small_maps() {
        for class in CLASSES {
            compare_class(&map, class, count);
        }
    }
}

/// Rays whose every parameter, place and height is exact in binary: directions with powers of two and differences that
/// are powers of two, places in eighths. No band, no tolerance on which crossings there are.
fn dyadic_ray(map: &Map, rng: &mut Rng) -> LatticeRay {
    const WAYS: [[f64; 2]; 6] = [[1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, -1.0], [2.0, 1.0], [1.0, 2.0]];
    let [u, v] = WAYS[rng.below(6) as usize];
    let sign = if rng.below(2) == 0 { 1.0 } else { -1.0 };
    let [cu, cv] = map.field.cells();
    let (c, r) = (rng.below(cu + 1), rng.below(cv + 1));
    // Through a sample, half of the time beside it, with the slope towards another sample or one in quarters.
    let vertex = DVec3::new(f64::from(c), f64::from(r), map.field.raw(c, r));
    let step = |n: u32, x: f64, cells: u32| (f64::from(n) + sign * x).clamp(0.0, f64::from(cells)) as u32;
    let slope = match rng.below(3) {
        0 => map.field.raw(step(c, u, cu), step(r, v, cv)) - vertex.z,
        1 => f64::from(rng.below(64)) / 4.0 - 8.0,
        _ => 0.0,
    };
    let direction = DVec3::new(u * sign, v * sign, slope);
    let mut origin = vertex - direction * f64::from(rng.below(40));
    if rng.below(2) == 0 {
        origin +=
            DVec3::new(f64::from(rng.below(9)) / 8.0, f64::from(rng.below(9)) / 8.0, f64::from(rng.below(3)) - 1.0);
    }
    let far = if rng.below(3) == 0 { f64::from(rng.below(60)) } else { f64::INFINITY };
    LatticeRay { origin, direction, near: 0.0, far }
}

/// Found by the long run: where the ray crosses a diagonal, the slope along v sees the rounding of u. The bound did not count it,
/// and was half of what the hit was off by.
#[test]
fn a_diagonal_far_from_the_origin_of_a_ray_is_within_the_bound() {
    let maps = small_maps();
    let map = maps.iter().find(|map| map.name == "low 50 × 50").unwrap();
    let ray = LatticeRay {
        origin: DVec3::new(126.80920945086491, 0.24342920790005218, 1.3682755536222682),
        direction: DVec3::new(-0.9996956326226583, 0.024670673180580232, 0.001208146275249709),
        near: 0.0,
        far: f64::INFINITY,
    };
    let hits = map.hits(&ray);
    assert!(hits.iter().any(|hit| hit.cell == [5, 3]));
    for hit in &hits {
        check_hit(map, &ray, hit).unwrap();
    }
}

/// The crossings by the definition: changes of sign, and ends of the ray or of the map on the surface. Where the ray runs
/// within the surface, its first point counts.
///
/// The signs are exact for dyadic rays; where between two values f is 0 is not, so the third number says by how much it may be off.
fn defined_crossings(map: &Map, ray: &LatticeRay) -> Vec<(f64, Option<bool>, f64)> {
    let values = values(map, ray);
    let mut found = Vec::new();
    let mut sign = 0.0;
    let mut zero = None;
    let mut before: Option<Value> = None;
    for value in values {
        if value.f == 0.0 {
            zero = zero.or(Some(value.t));
        } else {
            let now = value.f.signum();
            if zero.is_some() && (sign == 0.0 || sign != now) {
                found.extend(zero.map(|t| (t, Some(now < 0.0), 0.0)));
            } else if let (Some(before), true) = (before, sign != 0.0 && sign != now) {
                let t = before.t + (value.t - before.t) * (before.f / (before.f - value.f));
                let off = before.band.max(value.band) / before.slope.min(value.slope);
                found.push((t, Some(now < 0.0), off));
            }
            (sign, zero) = (now, None);
        }
        before = Some(value);
    }
    found.extend(zero.map(|t| (t, (sign != 0.0).then_some(sign > 0.0), 0.0)));
    found
}

#[test]
fn tangents_and_touches_are_decided_exactly() {
    let count = soak_rays().unwrap_or(3000) as usize;
    let mut maps = small_maps();
    maps.retain(|map| !map.name.contains("floats"));
    maps.extend(scenes());
    maps.par_iter().for_each(|map| {
        let mut rng = Rng(5);
        let mut hits = 0;
        for _ in 0..count {
            let ray = dyadic_ray(map, &mut rng);
            let ours: Vec<_> = map.hits(&ray).iter().map(|h| (h.t, h.entering)).collect();
            let expected = defined_crossings(map, &ray);
            let same = ours.len() == expected.len()
                && ours.iter().zip(&expected).all(|(a, b)| {
                    (a.0 - b.0).abs() <= 1e-13 * b.0.abs() + b.2 && b.1.is_none_or(|entering| a.1 == entering)
                });
            assert!(same, "{}: {ray:?}\nours {ours:?}\nexpected {expected:?}", map.name);
            hits += ours.len();
        }
        assert!(hits > count / 3, "{}: {hits}", map.name);
    });
}

/// How far the ray at the hit's t is from the triangle's plane, computed without rounding in 128-bit integers. The ray's
/// numbers have to be multiples of 2⁻¹².
fn exact_gap(map: &Map, ray: &LatticeRay, hit: &ExactHit) -> f64 {
    const ONE: f64 = 4096.0;
    // t = mantissa · 2^-shift
    let mut shift = 0;
    let mut mantissa = hit.t;
    while mantissa.fract() != 0.0 {
        mantissa *= 2.0;
        shift += 1;
    }
    assert!(shift < 66 && mantissa.abs() < 2f64.powi(53), "{}", hit.t);
    let fixed = |x: f64| (x * ONE) as i128;
    let [u, v, w] = [0, 1, 2].map(|k| (fixed(ray.origin[k]) << shift) + fixed(ray.direction[k]) * mantissa as i128);
    let unit = fixed(1.0) << shift;
    let [c, r] = hit.cell;
    let h = |c, r| map.field.raw(c, r) as i128;
    let [gu, gv] = hit.gradient.map(|g| g as i128);
    let gap = w - h(c, r) * unit - gu * (u - i128::from(c) * unit) - gv * (v - i128::from(r) * unit);
    gap as f64 / unit as f64
}

#[test]
fn hits_are_within_the_bound_that_they_carry() {
    let mut rng = Rng(9);
    let mut closest: f64 = 0.0;
    for map in scenes() {
        for k in 0..5000 {
            let mut ray = ray_of(CLASSES[k % CLASSES.len()], &map, &mut rng);
            let round = |x: f64| (x * 4096.0).round() / 4096.0;
            (ray.origin, ray.direction) = (ray.origin.map(round), ray.direction.map(round));
            for hit in map.hits(&ray).iter().filter(|hit| hit.t > 1e-3) {
                let gap = exact_gap(&map, &ray, hit).abs();
                assert!(gap <= hit.error, "{gap} beyond the bound: {ray:?}\n{hit:?}");
                closest = closest.max(gap / hit.error);
            }
        }
    }
    assert!(closest > 0.02, "the bound is never nearly reached: {closest}");
}

/// Möller and Trumbore's test with barycentric coordinates.
fn triangle(ray: &LatticeRay, [a, b, c]: [DVec3; 3]) -> Option<(f64, f64)> {
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
    // How deep inside the triangle: negative outside.
    let depth = u.min(v).min(1.0 - u - v);
    (t >= ray.near && t <= ray.far).then_some((t, depth))
}

#[test]
fn all_triangles_agree() {
    let mut rng = Rng(11);
    let mut maps = small_maps();
    maps.retain(|map| map.name != "wild floats");
    maps.push(scene("jacksboro.png", None));
    let (mut hits, mut deep) = (0, 0);
    for map in &maps {
        let [cu, cv] = map.field.cells();
        let sample = |c, r| DVec3::new(f64::from(c), f64::from(r), map.field.raw(c, r));
        let count = if soak() { 3000 } else { 6_000_000 / (cu * cv) }.clamp(30, 1000) as usize;
        for k in 0..count {
            let ray = ray_of(CLASSES[k % CLASSES.len()], map, &mut rng);
            let ours = map.hits(&ray);
            let mut theirs = Vec::new();
            for r in 0..cv {
                for c in 0..cu {
                    let (a, d) = (sample(c, r), sample(c + 1, r + 1));
                    theirs.extend(triangle(&ray, [a, sample(c + 1, r), d]));
                    theirs.extend(triangle(&ray, [a, sample(c, r + 1), d]));
                }
            }
            let close = |a: f64, b: f64| (a - b).abs() <= 1e-7 * (1.0 + a.abs());
            for hit in &ours {
                let found = theirs.iter().any(|&(t, depth)| depth >= -1e-6 && close(t, hit.t));
                // A ray in the plane of a triangle has no place in this reference.
                let d = ray.direction;
                let slope = d.z - hit.gradient[0] * d.x - hit.gradient[1] * d.y;
                assert!(
                    found || slope.abs() <= 1e-6 * d.z.abs().max(1.0),
                    "invented: {hit:?}\n{ray:?} on {}",
                    map.name
                );
            }
            for &(t, depth) in theirs.iter().filter(|(_, depth)| *depth > 1e-6) {
                assert!(
                    ours.iter().any(|hit| close(hit.t, t)),
                    "lost {t} ({depth}): {ray:?} on {}\n{ours:?}",
                    map.name
                );
                deep += 1;
            }
            hits += ours.len();
        }
    }
    assert!(hits > 4000 && deep > 3000, "{hits} hits, {deep} inside of triangles");
}

/// Rays straight down on the lines of a 10 × 10 field of size 40 × 40 are lost by others.
#[test]
fn rapier_issue_165() {
    let mut rng = Rng(165);
    let map = Map::u16("rapier", 11, 11, |_| (rng.bits() >> 48) as u16);
    // The reporter's points, y up there: (5, 10, 2.63113), (9.50162, 10, 5), (30, 10, 15.78678); with cells of several
    // sizes, on the lines and beside them.
    for size in [1.0, 2.5, 3.0, 5.0, 10.0] {
        for [x, z] in [[5.0, 2.63113], [9.50162, 5.0], [30.0, 15.78678]] {
            let (u, v) = (x / size, z / size);
            if u > 10.0 || v > 10.0 {
                continue;
            }
            let ray =
                LatticeRay { origin: DVec3::new(u, v, 1e5), direction: DVec3::NEG_Z, near: 0.0, far: f64::INFINITY };
            let hits = map.hits(&ray);
            assert_eq!(hits.len(), 1, "{ray:?}");
            assert_eq!(hits[0].point.truncate(), ray.origin.truncate());
            assert!((hits[0].point.z - map.field.surface(u, v).unwrap()).abs() < 1e-9);
        }
    }
}

fn ray(o: [f64; 3], d: [f64; 3]) -> LatticeRay {
    LatticeRay { origin: o.into(), direction: d.into(), near: 0.0, far: f64::INFINITY }
}

fn places(map: &Map, ray: &LatticeRay) -> Vec<([f64; 3], bool)> {
    map.hits(ray).iter().map(|h| (h.point.to_array(), h.entering)).collect()
}

/// A plain at 1000 with a ridge of 3000 from north to south at u = 8 and a spike of 50 000 at (4, 12).
fn ridge() -> Map {
    Map::u16("ridge", 17, 17, |i| match (i % 17, i / 17) {
        (8, _) => 3000,
        (4, 12) => 50_000,
        _ => 1000,
    })
}

#[test]
fn rays_that_say_nothing_hit_nothing() {
    let map = ridge();
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for k in 0..3 {
            let mut r = ray([3.0, 3.0, 9000.0], [0.1, 0.1, -1.0]);
            r.direction[k] = bad;
            assert_eq!(map.hits(&r), [], "direction {bad}");
            let mut r = ray([3.0, 3.0, 9000.0], [0.1, 0.1, -1.0]);
            r.origin[k] = bad;
            assert_eq!(map.hits(&r), [], "origin {bad}");
        }
    }
    assert_eq!(map.hits(&ray([3.0, 3.0, 1000.0], [0.0; 3])), []);
    assert_eq!(map.hits(&LatticeRay { near: f64::NAN, ..ray([3.0, 3.0, 9e3], [0.0, 0.0, -1.0]) }), []);
    assert_eq!(map.hits(&LatticeRay { near: 2.0, far: 1.0, ..ray([3.0, 3.0, 9e3], [0.0, 0.0, -1.0]) }), []);
}

#[test]
fn directions_need_no_length() {
    let map = ridge();
    let plain = map.hits(&ray([1.0, 2.5, 2000.0], [0.5, 0.25, -100.0]));
    assert_eq!(plain.len(), 1);
    for exponent in [-1070, -1022, -500, -40, 40, 500, 1000] {
        let scale = |x: f64| x * 2f64.powi(exponent / 2) * 2f64.powi(exponent - exponent / 2);
        let hits = map.hits(&ray([1.0, 2.5, 2000.0], [scale(0.5), scale(0.25), scale(-100.0)]));
        assert_eq!(hits.len(), 1, "2^{exponent}");
        assert!((hits[0].point - plain[0].point).abs().max_element() < 1e-2, "2^{exponent}: {hits:?}");
        if exponent.abs() <= 1000 {
            assert_eq!(hits[0].point, plain[0].point, "2^{exponent}");
        }
    }
    // Nearly vertical is vertical.
    assert_eq!(places(&map, &ray([2.0, 2.0, 5000.0], [1e-310, -1e-320, -1.0])), [([2.0, 2.0, 1000.0], true)]);
}

#[test]
fn vertices_lines_diagonals() {
    let map = ridge();
    for [u, v] in [[4.0, 7.25], [3.0, 3.0], [0.0, 0.0], [16.0, 16.0], [0.0, 5.5], [16.0, 5.5], [2.5, 2.5]] {
        assert_eq!(places(&map, &ray([u, v, 2000.0], [0.0, 0.0, -1.0])), [([u, v, 1000.0], true)]);
        assert_eq!(places(&map, &ray([u, v, 0.0], [0.0, 0.0, 3.0])), [([u, v, 1000.0], false)]);
    }
    assert_eq!(places(&map, &ray([4.0, 12.0, 1e6], [0.0, 0.0, -1.0])), [([4.0, 12.0, 50_000.0], true)]);
    // Oblique through a vertex, along a grid line, along a diagonal, in both senses.
    assert_eq!(places(&map, &ray([1.0, 4.0, 1200.0], [1.0, 1.0, -100.0])), [([3.0, 6.0, 1000.0], true)]);
    assert_eq!(places(&map, &ray([3.0, 4.0, 1200.0], [-1.0, -1.0, -100.0])), [([1.0, 2.0, 1000.0], true)]);
    assert_eq!(places(&map, &ray([-10.0, 6.0, 1150.0], [1.0, 0.0, -10.0])), [([5.0, 6.0, 1000.0], true)]);
    assert_eq!(places(&map, &ray([5.0, 26.0, 1150.0], [0.0, -1.0, -10.0])), [([5.0, 11.0, 1000.0], true)]);
    // Through the ridge: in and out, half way up on both sides.
    let through = [([7.5, 2.0, 2000.0], true), ([8.5, 2.0, 2000.0], false)];
    assert_eq!(places(&map, &ray([-5.0, 2.0, 2000.0], [1.0, 0.0, 0.0])), through);
}

#[test]
fn touching_is_no_crossing() {
    let map = ridge();
    // Along the crest, over the crest, over the spike.
    assert_eq!(places(&map, &ray([1.0, 2.5, 3000.0], [1.0, 0.0, 0.0])), []);
    assert_eq!(places(&map, &ray([1.0, 12.0, 50_000.0], [1.0, 0.0, 0.0])), []);
    assert_eq!(places(&map, &ray([7.0, 3.0, 3000.0], [1.0, 1.0, 0.0])), []);
    // In the plane of the plain, then into the ridge: where it met the surface first, which is where it starts.
    assert_eq!(
        places(&map, &ray([2.0, 3.5, 1000.0], [1.0, 0.0, 0.0])),
        [
            ([2.0, 3.5, 1000.0], true),
            // Behind the ridge it comes out into the plane of the plain and leaves the map there.
            ([9.0, 3.5, 1000.0], false),
        ]
    );
    // Along the crest it starts on the surface.
    assert_eq!(map.hits(&ray([8.0, 2.0, 3000.0], [0.0, 1.0, 0.0])).len(), 1);
}

#[test]
fn from_on_inside_below() {
    let map = ridge();
    assert_eq!(places(&map, &ray([5.0, 5.0, 1000.0], [0.0, 0.0, -1.0])), [([5.0, 5.0, 1000.0], true)]);
    assert_eq!(places(&map, &ray([5.0, 5.0, 1000.0], [1.0, 0.0, -1.0])), [([5.0, 5.0, 1000.0], true)]);
    assert_eq!(places(&map, &ray([5.0, 5.0, 1000.0], [0.25, 0.0, 999.0])), [([5.0, 5.0, 1000.0], false)]);
    // Inside the ridge.
    assert_eq!(places(&map, &ray([8.0, 5.0, 2000.0], [1.0, 0.0, 0.0])), [([8.5, 5.0, 2000.0], false)]);
    // Below everything, going up, level and down.
    assert_eq!(places(&map, &ray([4.0, 5.0, -500.0], [0.5, 0.0, 750.0])), [([5.0, 5.0, 1000.0], false)]);
    assert_eq!(places(&map, &ray([4.0, 5.0, -500.0], [1.0, 0.0, 0.0])), []);
    assert_eq!(places(&map, &ray([4.0, 5.0, -500.0], [1.0, 0.0, -1.0])), []);
    // From beside the map below the ground: there is no wall at the border.
    assert_eq!(places(&map, &ray([-1.0, 5.0, 500.0], [1.0, 0.0, 0.0])), []);
}

#[test]
fn from_far_away() {
    let map = ridge();
    let far = map.hits(&ray([-1e9, 4.0, 1000.0 + 1e9], [1.0, 0.0, -1.0]));
    assert_eq!(far.len(), 1);
    assert!((far[0].point - DVec3::new(0.0, 4.0, 1000.0)).abs().max_element() < 1e-6, "{far:?}");
    let far = map.hits(&ray([2.0, -1e9 + 3.0, 1000.0 + 3e9], [0.0, 0.5, -1.5]));
    assert_eq!(far.len(), 1);
    assert!((far[0].point - DVec3::new(2.0, 3.0, 1000.0)).abs().max_element() < 1e-5, "{far:?}");
}

#[test]
fn borders_of_the_map() {
    let map = ridge();
    // Into the map and out of it exactly on the border of the surface.
    assert_eq!(places(&map, &ray([-1.0, 5.0, 1100.0], [1.0, 0.0, -100.0])), [([0.0, 5.0, 1000.0], true)]);
    assert_eq!(places(&map, &ray([15.0, 5.0, 1100.0], [1.0, 0.0, -100.0])), [([16.0, 5.0, 1000.0], true)]);
    // Over a corner only.
    assert_eq!(places(&map, &ray([-1.0, 1.0, 1000.0], [1.0, -1.0, 0.0])), [([0.0, 0.0, 1000.0], false)]);
    assert_eq!(places(&map, &ray([15.0, 17.0, 1000.0], [1.0, -1.0, 0.0])), [([16.0, 16.0, 1000.0], false)]);
    assert_eq!(places(&map, &ray([-1.0, 1.0, 1001.0], [1.0, -1.0, 0.0])), []);
    // Beside the map, and along its border.
    assert_eq!(places(&map, &ray([-1.0, 5.0, 2000.0], [0.0, 0.0, -1.0])), []);
    assert_eq!(places(&map, &ray([-1e-9, 5.0, 2000.0], [0.0, 1.0, -100.0])), []);
    for (border, other) in [(0.0, 3.0), (16.0, 3.0)] {
        let expected = [([border, 5.0, 1000.0], true)];
        assert_eq!(places(&map, &ray([border, other, 1200.0], [0.0, 1.0, -100.0])), expected);
        let expected = [([5.0, border, 1000.0], true)];
        assert_eq!(places(&map, &ray([other, border, 1200.0], [1.0, 0.0, -100.0])), expected);
    }
}

#[test]
fn limits_around_the_hit() {
    let map = ridge();
    for direction in [[0.0, 0.0, -1.0], [0.001, 0.0, -1.0], [0.001, -0.002, -1.0]] {
        let mut limited = ray([5.0, 5.0, 2000.0], direction);
        for (near, far, count) in
            [(0.0, 999.0, 0), (0.0, 1000.0, 1), (1000.0, 1e9, 1), (1001.0, 1e9, 0), (1000.0, 1000.0, 1), (-1e9, 1e9, 1)]
        {
            (limited.near, limited.far) = (near, far);
            assert_eq!(map.hits(&limited).len(), count, "{near}..{far} along {direction:?}");
        }
    }
}

/// The same land seen through `at`, which says which sample of the old map a new one is.
fn rearranged(map: &Map, columns: u32, rows: u32, at: impl Fn(u32, u32) -> (u32, u32), scale: f32) -> Map {
    let samples = (0..rows)
        .flat_map(|r| (0..columns).map(move |c| (c, r)))
        .map(|(c, r)| {
            let (c, r) = at(c, r);
            map.field.raw(c, r) as f32 * scale
        })
        .collect();
    Map::new(&map.name, HeightField::from_f32(columns, rows, samples, Voids::default()).unwrap())
}

/// A ray whose coordinates are multiples of 2⁻¹², so that moving it by whole cells rounds nothing.
fn round_ray(class: Class, map: &Map, rng: &mut Rng) -> LatticeRay {
    let ray = ray_of(class, map, rng);
    let round = |x: f64| (x * 4096.0).round() / 4096.0;
    LatticeRay { origin: ray.origin.map(round), direction: ray.direction.map(round), ..ray }
}

const OBLIQUE: [Class; 5] = [Class::Camera, Class::Grazing, Class::GridLine, Class::Diagonal, Class::Anything];

#[test]
fn moving_the_map_by_whole_cells_moves_the_hits() {
    let map = rearranged(&Map::new("land", generate(100, 3).unwrap()), 100, 100, |c, r| (c, r), 1.0);
    let mut rng = Rng(21);
    let (du, dv) = (13, 29);
    let cut = rearranged(&map, 100 - du, 100 - dv, |c, r| (c + du, r + dv), 1.0);
    let shift = DVec3::new(f64::from(du), f64::from(dv), 0.0);
    let mut hits = 0;
    for k in 0..20_000 {
        let ray = round_ray(OBLIQUE[k % OBLIQUE.len()], &cut, &mut rng);
        let moved = LatticeRay { origin: ray.origin + shift, ..ray };
        let whole = map.hits(&moved);
        for hit in cut.hits(&ray).iter().filter(|h| h.point.x.min(h.point.y) > 0.0) {
            let same = whole.iter().find(|w| w.t == hit.t).unwrap_or_else(|| panic!("{ray:?}\n{hit:?}\n{whole:?}"));
            assert_eq!(same.cell, [hit.cell[0] + du, hit.cell[1] + dv]);
            assert_eq!((same.upper, same.gradient, same.entering), (hit.upper, hit.gradient, hit.entering));
            hits += 1;
        }
    }
    assert!(hits > 5000, "{hits}");
}

#[test]
fn transposing_turning_and_scaling_turn_the_answer() {
    let map = rearranged(&Map::new("land", generate(90, 3).unwrap()), 90, 70, |c, r| (c, r), 1.0);
    let transposed = rearranged(&map, 70, 90, |c, r| (r, c), 1.0);
    let turned = rearranged(&map, 90, 70, |c, r| (89 - c, 69 - r), 1.0);
    let scaled = rearranged(&map, 90, 70, |c, r| (c, r), 1.0 / 1024.0);
    let mut rng = Rng(22);
    let mut count = 0;
    for k in 0..20_000 {
        let ray = round_ray(OBLIQUE[k % OBLIQUE.len()], &map, &mut rng);
        let (o, d) = (ray.origin, ray.direction);
        let hits = map.hits(&ray);
        let other = transposed.hits(&LatticeRay {
            origin: DVec3::new(o.y, o.x, o.z),
            direction: DVec3::new(d.y, d.x, d.z),
            ..ray
        });
        let half = turned.hits(&LatticeRay {
            origin: DVec3::new(89.0 - o.x, 69.0 - o.y, o.z),
            direction: DVec3::new(-d.x, -d.y, d.z),
            ..ray
        });
        let flat = DVec3::new(1.0, 1.0, 1.0 / 1024.0);
        let small = scaled.hits(&LatticeRay { origin: o * flat, direction: d * flat, ..ray });
        let ts = |hits: &[ExactHit]| hits.iter().map(|h| h.t).collect::<Vec<_>>();
        assert_eq!(ts(&hits), ts(&small), "{ray:?}");
        assert_eq!((hits.len(), hits.len()), (other.len(), half.len()), "{ray:?}");
        for ((a, b), c) in hits.iter().zip(&other).zip(&half) {
            let close = |x: f64, y: f64| (x - y).abs() <= 1e-9 * x.abs();
            assert!(close(a.t, b.t) && close(a.t, c.t), "{ray:?}\n{a:?}\n{b:?}\n{c:?}");
            assert_eq!((a.entering, a.entering), (b.entering, c.entering));
            // Unless rounding decides which of two triangles it is.
            if a.barycentric.iter().all(|&w| w > 1e-9) {
                assert_eq!((b.cell, b.upper), ([a.cell[1], a.cell[0]], !a.upper));
                assert_eq!((c.cell, c.upper), ([88 - a.cell[0], 68 - a.cell[1]], !a.upper));
                assert_eq!(b.gradient, [a.gradient[1], a.gradient[0]]);
                assert_eq!(c.gradient, a.gradient.map(|g| -g));
            }
        }
        count += hits.len();
    }
    assert!(count > 10_000, "{count}");
}

#[test]
fn reversing_the_ray_finds_the_same_crossings() {
    let mut rng = Rng(23);
    let mut count = 0;
    for map in [Map::new("land", generate(130, 3).unwrap()), scene("walls.png", None)] {
        for k in 0..10_000 {
            let ray = ray_of(OBLIQUE[k % OBLIQUE.len()], &map, &mut rng);
            let ray = LatticeRay { near: 0.0, far: 4096.0, ..ray };
            let back = LatticeRay { origin: ray.origin + ray.direction * ray.far, direction: -ray.direction, ..ray };
            let (there, mut again) = (map.hits(&ray), map.hits(&back));
            again.reverse();
            assert_eq!(there.len(), again.len(), "{ray:?}");
            for (a, b) in there.iter().zip(&again) {
                // Coming back the origin is far away and rounded.
                let slope = ray.direction.z - a.gradient[0] * ray.direction.x - a.gradient[1] * ray.direction.y;
                let bound = 4.0 * (a.error + b.error) / slope.abs() + 1e-11;
                assert!((a.t - (ray.far - b.t)).abs() <= bound, "{ray:?}\n{a:?}\n{b:?}");
                assert_ne!(a.entering, b.entering);
            }
            count += there.len();
        }
    }
    assert!(count > 10_000, "{count}");
}

/// Walks end: no ray on any map takes more steps than the map's size allows. The walk's own assertion would panic.
#[test]
fn steps_are_bounded() {
    let budget: u64 = if soak() { 1_000_000_000 } else { 3_000_000 };
    let mut rng = Rng(31);
    let (mut steps, mut fullest) = (0u64, 0.0f64);
    while steps < budget {
        let (columns, rows) = (2 + rng.below(90), 2 + rng.below(90));
        let flat = rng.below(16);
        let map = Map::u16("random", columns, rows, |_| (rng.bits() >> 48) as u16 >> flat);
        for k in 0..500 {
            let mut ray = ray_of(CLASSES[k % CLASSES.len()], &map, &mut rng);
            match rng.below(4) {
                0 => ray.direction.z = 0.0,
                1 => ray.origin = ray.origin.round(),
                2 => ray.direction *= 2f64.powi(rng.below(200) as i32 - 100),
                _ => {}
            }
            let taken = map.surface().steps(&ray);
            let limit = map.surface().step_limit();
            assert!(taken <= limit, "{taken} steps of {limit}: {ray:?}");
            fullest = fullest.max(f64::from(taken) / f64::from(limit));
            steps += u64::from(taken).max(1);
        }
    }
    assert!(fullest > 0.4, "{fullest}");
}

/// A map that stands far from the origin is picked as one that stands there: the same hits at the same parameters, bit for
/// bit, for the ray that is left when the offset is taken away. Those are judged above. What rounding has done to the ray's
/// origin before is not the pick's: a world of 10⁷ is known to 2⁻³⁰.
#[test]
fn maps_far_from_the_origin_are_picked_as_near_ones() {
    use seamount::action::Surface;
    use seamount::prelude::*;

    let count = soak_rays().unwrap_or(400);
    let offsets = [
        DVec3::new(148_376.0, 1234.0, -223_423.0),
        DVec3::new(1e7, 0.0, 0.0),
        DVec3::new(0.0, 1e7, 0.0),
        DVec3::new(0.0, 0.0, 1e7),
        DVec3::new(-1e7, 1e7, -1e7),
    ];
    for name in ["andes.png", "fuji.png", "jacksboro.png", "puget.png", "walls.png"] {
        let void = (name == "fuji.png").then_some(0.0);
        let map = scene(name, void);
        let image = std::sync::Arc::new(
            Image::open(&std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name)).unwrap(),
        );
        let [cu, cv] = map.cells();
        let place = |offset: DVec3| {
            let mut scene = Scene::new();
            let root = scene.root();
            scene.add(root, Transform { translation: offset, ..Transform::default() }).unwrap();
            scene.add(root, Texture2::from_image(std::sync::Arc::clone(&image))).unwrap();
            // A cell is 1, a step of height too: world coordinates are those of the lattice, turned to the north.
            let size = Some(DVec2::new(cu, cv));
            let terrain =
                SeamlessTerrain { size, max_height: 65_535.0, void_sample: void, ..SeamlessTerrain::default() };
            scene.add(root, terrain).unwrap();
            scene
        };
        let action = RayPickAction { surface: Surface::Exact, ..RayPickAction::pixel(0, 0, [64, 48]) };
        let near = place(DVec3::ZERO);
        let near = action.picker(&near).unwrap();
        for offset in offsets {
            let far = place(offset);
            let far = action.picker(&far).unwrap();
            for class in CLASSES {
                let hits: u64 = (0..count.div_ceil(500))
                    .into_par_iter()
                    .map(|part| {
                        let mut rng = Rng(part * 77 + class as u64);
                        let mut hits = 0;
                        for _ in 0..500.min(count - part * 500) {
                            let LatticeRay { origin, direction, .. } = ray_of(class, &map, &mut rng);
                            let origin = DVec3::new(origin.x, cv - origin.y, origin.z) + offset;
                            let direction = DVec3::new(direction.x, -direction.y, direction.z);
                            let there = Ray::new(origin, direction).unwrap();
                            let here = Ray { origin: there.origin - offset, ..there };
                            let (there, here) = (far.pick(&there, true).unwrap(), near.pick(&here, true).unwrap());
                            let t = |hits: &[PickedPoint]| hits.iter().map(|h| h.distance).collect::<Vec<_>>();
                            assert_eq!(t(&there), t(&here), "{name} {class:?} {offset}: {origin} {direction}");
                            for (there, here) in there.iter().zip(&here) {
                                assert_eq!(there.object_point, here.object_point);
                                assert_eq!((there.normal, there.detail), (here.normal, here.detail));
                                assert_eq!(there.point, here.point + offset);
                            }
                            hits += here.len() as u64;
                        }
                        hits
                    })
                    .sum();
                assert!(hits > 0, "{name} {class:?}");
            }
        }
    }
}
