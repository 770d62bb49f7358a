//! Picks on the coarse surface against brute force over the same triangles and walls, in f64.
#![allow(missing_docs, reason = "a test")]

mod common;

use common::Rng;
use glam::DVec3;
use seamount::terrain::pick::{CoarseSurface, Fan, FanErrors, FanTree, LatticeRay, TerrainHit, fan_error};
use seamount::terrain::{
    ActivePatch, Full, HeightField, Hierarchy, LodEye, Precision, Resolutions, Selection, Side, Voids, generate,
};

struct Scene {
    field: HeightField,
    fans: FanTree,
    tree: Hierarchy,
    selection: Selection,
    errors: FanErrors,
    patches: Vec<(ActivePatch, Fan)>,
}

impl Scene {
    fn new(field: HeightField, resolutions: Resolutions, precision: Option<Precision>) -> Self {
        let tree = Hierarchy::new(field.cells(), resolutions);
        let selection = match precision {
            Some(metric) => Selection::of(&tree, &metric),
            None => Selection::of(&tree, &Full),
        };
        let patches = selection.patches(&tree).map(|p| (p, Fan::new(&field, &tree, p.id))).collect();
        let errors = FanErrors::new(&field, &tree);
        Self { fans: FanTree::new(&field, &tree, &selection), field, tree, selection, errors, patches }
    }

    fn hits(&self, ray: &LatticeRay) -> Vec<TerrainHit> {
        let surface = CoarseSurface {
            field: &self.field,
            fans: &self.fans,
            tree: &self.tree,
            selection: &self.selection,
            errors: &self.errors,
        };
        let mut hits = Vec::new();
        surface.intersect(ray, |hit| {
            hits.push(hit);
            true
        });
        hits
    }

    /// All parameters at which the ray meets a triangle (borders included) or a wall.
    fn brute(&self, ray: &LatticeRay) -> Vec<f64> {
        let mut found = Vec::new();
        for (patch, fan) in &self.patches {
            for side in Side::ALL {
                // Clamped to the border of the map a triangle may have no area; seen from the side it would be a wall there.
                if fan.area(side) != 0.0 {
                    found.extend(triangle(ray, fan.triangle(side)));
                }
                found.extend(self.wall(ray, patch, fan, side));
            }
        }
        found.sort_by(f64::total_cmp);
        found
    }

    /// The vertical wall between this patch's side and the coarser patch across it, seen from the finer one.
    fn wall(&self, ray: &LatticeRay, patch: &ActivePatch, fan: &Fan, side: Side) -> Option<f64> {
        let mut across = self.tree.neighbour(patch.id, side)?;
        if self.selection.active(&self.tree, across).is_some() || self.selection.is_split(&self.tree, across) {
            return None;
        }
        across = self.tree.parent(across)?;
        let coarse = Fan::new(&self.field, &self.tree, across);
        let [a, b, _] = fan.triangle(side);
        let [d, c, _] = coarse.triangle(side.opposite());
        // The plane of the side: u or v is constant.
        let axis = usize::from(a.x != b.x);
        let t = (a[axis] - ray.origin[axis]) / ray.direction[axis];
        let p = ray.origin + ray.direction * t;
        let along = 1 - axis;
        let at = |a: DVec3, b: DVec3| a.z + (b.z - a.z) * (p[along] - a[along]) / (b[along] - a[along]);
        let inside = p[along] >= a[along].min(b[along]) && p[along] <= a[along].max(b[along]);
        let (fine, coarse) = (at(a, b), at(c, d));
        (inside && t >= ray.near && t <= ray.far && p.z >= fine.min(coarse) && p.z <= fine.max(coarse)).then_some(t)
    }
}

/// Möller and Trumbore's test in f64, borders included.
fn triangle(ray: &LatticeRay, [a, b, c]: [DVec3; 3]) -> Option<f64> {
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
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= ray.near && t <= ray.far).then_some(t)
}

fn scenes() -> Vec<Scene> {
    let mut scenes = Vec::new();
    let mut rng = Rng(3);
    for (size, min, count, precision) in
        [(129, 4, 3, 1.0), (200, 2, 2, 2.0), (97, 8, 2, 0.3), (65, 2, 4, 5.0), (150, 4, 2, 40.0)]
    {
        let land = generate(size, u64::from(size)).unwrap();
        let eye = LodEye::Point {
            u: rng.range(0.0, f64::from(size)),
            v: rng.range(0.0, f64::from(size)),
            height: rng.range(0.0, 40.0),
        };
        let resolutions = Resolutions::new(min, count).unwrap();
        scenes.push(Scene::new(land, resolutions, Some(Precision { precision, eye })));
    }
    // Not square, crossing the border of the patches, with noise from sample to sample.
    let noise = (0..83 * 41).map(|_| (rng.bits() >> 48) as u16).collect();
    let noise = HeightField::from_u16(83, 41, noise, Voids::default()).unwrap();
    scenes.push(Scene::new(noise, Resolutions::new(2, 3).unwrap(), None));
    scenes
}

fn random_ray(rng: &mut Rng, cells: [u32; 2]) -> LatticeRay {
    let [cu, cv] = cells.map(f64::from);
    let target = DVec3::new(rng.range(0.0, cu), rng.range(0.0, cv), rng.range(0.0, 65535.0));
    let from = DVec3::new(rng.range(-cu, 2.0 * cu), rng.range(-cv, 2.0 * cv), rng.range(-1e5, 2e5));
    let near = if rng.below(4) == 0 { rng.range(0.0, 1.0) } else { 0.0 };
    LatticeRay { origin: from, direction: target - from, near, far: f64::INFINITY }
}

/// The crossings of a ray, after they have been found to be those of brute force.
fn agreed(scene: &Scene, ray: &LatticeRay) -> Vec<TerrainHit> {
    let (ours, brute) = (scene.hits(ray), scene.brute(ray));
    // t counts in ray lengths; hits a billionth of that apart are one place.
    let close = |a: f64, b: f64| (a - b).abs() <= 1e-9 * (1.0 + a.abs());
    for hit in &ours {
        assert!(brute.iter().any(|&t| close(t, hit.t)), "invented: {hit:?}\n{ray:?}\n{brute:?}");
    }
    for &t in &brute {
        assert!(ours.iter().any(|hit| close(t, hit.t)), "lost: {t}\n{ray:?}\n{ours:?}\n{brute:?}");
    }
    for pair in ours.windows(2) {
        assert!(pair[0].t <= pair[1].t, "out of order: {ours:?}");
        assert_ne!(pair[0].entering, pair[1].entering, "{ours:?}");
    }
    ours
}

#[test]
fn crossings_agree_with_brute_force() {
    let mut rng = Rng(1);
    let (mut hits, mut walls) = (0, 0);
    for scene in scenes() {
        for _ in 0..2000 {
            let ours = agreed(&scene, &random_ray(&mut rng, scene.tree.cells()));
            walls += ours.iter().filter(|hit| hit.wall.is_some()).count();
            hits += ours.len();
        }
    }
    assert!(hits > 5000 && walls > 100, "{hits} hits, {walls} on walls");
}

/// Just beside a border of patches: a large patch on the other side of it, which the ray comes to later, was looked at first, and
/// those before it never.
#[test]
fn along_a_border_of_patches_each_is_looked_at_in_its_turn() {
    let mut rng = Rng(6);
    let mut hits = 0;
    for scene in scenes() {
        let size = scene.tree.size(scene.tree.depth());
        let cells = scene.tree.cells();
        for _ in 0..4000 {
            let [cu, cv] = cells.map(f64::from);
            let mut end = || {
                let beside = 10f64.powi(-3 - rng.below(5) as i32) * (2.0 * f64::from(rng.below(2)) - 1.0);
                (rng.range(-0.2, 1.2), beside, rng.range(0.0, 65535.0))
            };
            let (from, to) = (end(), end());
            let turned = rng.below(2) == 0;
            let (length, across) = if turned { (cv, cells[0]) } else { (cu, cells[1]) };
            let line = f64::from(rng.below(across / size) * size);
            let place = |(along, beside, height): (f64, f64, f64)| {
                let [u, v] = [along * length, line + beside];
                if turned { DVec3::new(v, u, height) } else { DVec3::new(u, v, height) }
            };
            let (from, to) = (place(from), place(to));
            let ray = LatticeRay { origin: from, direction: to - from, near: 0.0, far: f64::INFINITY };
            hits += agreed(&scene, &ray).len();
        }
    }
    assert!(hits > 5000, "{hits}");
}

/// Where nothing is split one patch fills the map, and the block at the top: it was looked at anew for each quarter of that.
#[test]
fn a_patch_that_fills_the_whole_map_is_looked_at_once() {
    let mut rng = Rng(8);
    let mut twice = 0;
    for size in [17, 33, 65, 129] {
        let noise = (0..size * size).map(|_| (rng.bits() >> 48) as u16).collect();
        let field = HeightField::from_u16(size, size, noise, Voids::default()).unwrap();
        let eye = LodEye::Point { u: 1e6, v: 0.0, height: 0.0 };
        let scene = Scene::new(field, Resolutions::new(2, 2).unwrap(), Some(Precision { precision: 1e-9, eye }));
        assert_eq!(scene.selection.patches(&scene.tree).count(), 1);
        let extent = DVec3::new(f64::from(size - 1), f64::from(size - 1), 65535.0);
        for _ in 0..4000 {
            let mut place = || DVec3::new(rng.range(0.0, 1.0), rng.range(0.0, 1.0), rng.range(0.0, 1.0)) * extent;
            let (from, to) = (place(), place());
            let ray = LatticeRay { origin: from, direction: to - from, near: 0.0, far: f64::INFINITY };
            twice += usize::from(agreed(&scene, &ray).len() == 2);
        }
    }
    assert!(twice > 50, "{twice}");
}

/// A ray comes from so far above that what it is above the ground is more than f32 can say, over one that is lower than any other:
/// the difference was infinite, and so was the way down.
#[test]
fn a_ray_whose_height_above_the_ground_is_beyond_f32_comes_down() {
    let lowest = -1e38f32;
    let mut heights = vec![lowest; 17 * 17];
    heights[16 * 17] = -lowest;
    let field = HeightField::from_f32(17, 17, heights, Voids::default()).unwrap();
    let scene = Scene::new(field, Resolutions::new(2, 2).unwrap(), None);
    let highest = -f64::from(lowest);
    let direction = DVec3::new(1.0, 0.0, -4e37);
    let ray = LatticeRay { origin: DVec3::new(5.9, 1.5, highest), direction, near: -100.0, far: 100.0 };
    let hits = agreed(&scene, &ray);
    assert_eq!(hits.len(), 1, "{hits:?}");
    assert!((hits[0].t - 2.0 * highest / 4e37).abs() < 1e-9, "{hits:?}");
}

/// Every picked point is where it says, and the full-resolution surface is within the bound that the hit carries.
#[test]
fn hits_carry_a_true_bound() {
    let mut rng = Rng(2);
    let mut closest: f64 = 0.0;
    for scene in scenes() {
        for _ in 0..2000 {
            let ray = random_ray(&mut rng, scene.tree.cells());
            for hit in scene.hits(&ray) {
                let p = ray.origin + ray.direction * hit.t;
                assert!((p - hit.point).abs().max_element() < 1e-6, "{p} {hit:?}");
                let [cu, cv] = scene.tree.cells().map(f64::from);
                let surface = scene.field.surface(p.x.clamp(0.0, cu), p.y.clamp(0.0, cv)).unwrap();
                let off = (surface - p.z).abs();
                assert!(off <= hit.error + 1e-6, "{off} is beyond {}", hit.error);
                closest = closest.max(off / hit.error);
            }
        }
    }
    assert!(closest > 0.8, "the bound is never nearly reached: {closest}");
}

/// A ray within the plane of the ground, but for rounding, meets it where it meets it first: with the patch, triangle and bound of
/// that place, not of the one where rounding takes it to the other side.
#[test]
fn a_ray_in_the_plane_of_the_ground_is_told_where_it_meets_it() {
    let mut rng = Rng(41);
    let mut found = 0;
    // A plane, and one that is folded; whole patches, and such that the border cuts.
    for (size, fold) in [([33, 33], 33), ([50, 35], 25), ([70, 41], 31)] {
        let [columns, rows]: [u32; 2] = size;
        let height = |c: u32, r: u32| (if c < fold { 5 * c } else { 5 * fold + 2 * (c - fold) } + r + 7) as u16;
        let samples = (0..rows).flat_map(|r| (0..columns).map(move |c| height(c, r))).collect();
        let field = HeightField::from_u16(columns, rows, samples, Voids::default()).unwrap();
        let scene = Scene::new(field, Resolutions::new(8, 2).unwrap(), None);
        for _ in 0..20_000 {
            let mut point = || {
                let [c, r] = [columns, rows].map(|n| rng.below(n));
                DVec3::new(c.into(), r.into(), scene.field.raw(c, r))
            };
            let (a, b) = (point(), point());
            let direction = b - a;
            let origin = a - direction * f64::from(rng.below(99));
            let tilt = DVec3::Z * 1e-13 * (f64::from(rng.below(3)) - 1.0);
            let ray = LatticeRay { origin, direction: direction + tilt, near: 0.0, far: f64::INFINITY };
            for hit in scene.hits(&ray) {
                found += 1;
                let fan = Fan::new(&scene.field, &scene.tree, hit.patch);
                let weights = fan.barycentric(hit.triangle, hit.point.x, hit.point.y);
                assert!(weights.iter().all(|w| (-1e-9..=1.0 + 1e-9).contains(w)), "{weights:?}: {hit:?} of {ray:?}");
                let ground = scene.field.surface(hit.point.x, hit.point.y).unwrap();
                assert!((hit.point.z - ground).abs() <= hit.error + 1e-9, "{ground}: {hit:?} of {ray:?}");
            }
        }
    }
    assert!(found > 10_000, "{found}");
}

/// Where the map's border cuts a patch, its centre may lie on the border. A ray along the border meets the triangles on both
/// sides of the centre there, without crossing a spoke: the one in the middle of the ray was taken for all of it.
#[test]
fn along_the_border_the_triangle_changes_at_a_centre_that_is_clamped_to_it() {
    let mut rng = Rng(4);
    let samples: Vec<u16> = (0..2 * 300).map(|_| (rng.bits() >> 48) as u16).collect();
    let mut count = 0;
    for (columns, rows, along) in [(300, 2, DVec3::X), (2, 300, DVec3::Y)] {
        let field = HeightField::from_u16(columns, rows, samples.clone(), Voids::default()).unwrap();
        let scene = Scene::new(field, Resolutions::new(4, 2).unwrap(), None);
        let border = DVec3::ONE - along;
        for _ in 0..500 {
            let [start, end] = [0; 2].map(|_| {
                let p = border + along * rng.range(0.0, 299.0);
                p.with_z(rng.range(0.0, 65_535.0))
            });
            let ray = LatticeRay { origin: start, direction: end - start, near: 0.0, far: 1.0 };
            for hit in scene.hits(&ray) {
                let p = start + (end - start) * hit.t;
                assert!((p - hit.point).abs().max_element() < 1e-6, "{p} {hit:?}");
                let fan = Fan::new(&scene.field, &scene.tree, hit.patch);
                let weights = fan.barycentric(hit.triangle, p.x, p.y);
                assert!(weights.iter().all(|&w| w > -1e-9), "{weights:?} {hit:?}");
                let off = (scene.field.surface(p.x, p.y).unwrap() - p.z).abs();
                assert!(off <= hit.error + 1e-6, "{off} is beyond {}", hit.error);
                count += 1;
            }
        }
    }
    assert!(count > 1000, "{count} hits");
}

/// The bound of a fan against a fine scan of the patch.
#[test]
fn fan_errors_are_those_of_a_dense_scan() {
    for (size, min) in [(33u32, 4), (41, 2), (30, 8)] {
        let field = generate(size, 5).unwrap();
        let tree = Hierarchy::new(field.cells(), Resolutions::new(min, 2).unwrap());
        for level in 0..=tree.depth() {
            for patch in tree.patches(level) {
                let fan = Fan::new(&field, &tree, patch);
                let [[u0, v0], [u1, v1]] = tree.extent(patch).map(|p| p.map(f64::from));
                let mut scan: f64 = 0.0;
                let steps = 8 * (u1 - u0).max(v1 - v0) as u32;
                for j in 0..=steps {
                    for i in 0..=steps {
                        let u = u0 + (u1 - u0) * f64::from(i) / f64::from(steps);
                        let v = v0 + (v1 - v0) * f64::from(j) / f64::from(steps);
                        let coarse = fan.height(fan.side_at(u, v), u, v);
                        scan = scan.max((coarse - field.surface(u, v).unwrap()).abs());
                    }
                }
                let bound = fan_error(&field, &tree, patch);
                assert!(scan <= bound + 1e-6, "{patch:?}: {scan} beyond {bound}");
                // A scan of eighths of a cell comes close to the maximum of a piecewise linear function.
                assert!(scan >= bound * 0.8, "{patch:?}: {bound} is far above {scan}");
            }
        }
    }
}

#[test]
fn special_rays() {
    // A flat map at 1000, a single spike in the middle.
    let mut samples = vec![1000u16; 33 * 33];
    samples[16 * 33 + 16] = 50_000;
    let field = HeightField::from_u16(33, 33, samples, Voids::default()).unwrap();
    let scene = Scene::new(field, Resolutions::new(4, 2).unwrap(), None);
    let ray = |o: [f64; 3], d: [f64; 3]| LatticeRay {
        origin: DVec3::from(o),
        direction: DVec3::from(d),
        near: 0.0,
        far: f64::INFINITY,
    };
    let first = |r: LatticeRay| scene.hits(&r).first().map(|h| (h.point, h.entering));
    // Straight down on a grid line, a corner, the border, and on the spike.
    for [u, v] in [[4.0, 7.3], [8.0, 8.0], [0.0, 0.0], [32.0, 32.0], [0.0, 5.5]] {
        assert_eq!(first(ray([u, v, 2000.0], [0.0, 0.0, -1.0])), Some((DVec3::new(u, v, 1000.0), true)));
        assert_eq!(first(ray([u, v, 0.0], [0.0, 0.0, 3.0])), Some((DVec3::new(u, v, 1000.0), false)));
    }
    assert_eq!(first(ray([16.0, 16.0, 1e6], [0.0, 0.0, -1.0])).unwrap().0.z, 50_000.0);
    // From on the surface: down hits at once, up never.
    assert_eq!(scene.hits(&ray([5.0, 5.0, 1000.0], [0.0, 0.0, -1.0]))[0].t, 0.0);
    assert_eq!(scene.hits(&ray([5.0, 5.0, 1000.0], [1.0, 0.0, -1.0]))[0].t, 0.0);
    // Nearly so: too steep for a reciprocal, a direction gave NaN.
    for tiny in [1e-290, 1e-304, 1e-305, 1e-310, 5e-324] {
        for [du, dv] in [[tiny, 0.0], [-tiny, 0.0], [tiny, tiny], [0.0, -tiny]] {
            let hits = scene.hits(&ray([5.3, 7.2, 2000.0], [du, dv, -1.0]));
            let right = |hit: &TerrainHit| {
                (hit.t - 1000.0).abs() < 1e-9 && hit.point.distance(DVec3::new(5.3, 7.2, 1000.0)) < 1e-9
            };
            assert!(hits.len() == 1 && right(&hits[0]), "{du:e} {dv:e}: {hits:?}");
        }
    }
    // Directions need no length, and t counts in them.
    for scale in [2f64.powi(-1000), 2f64.powi(-600), 2f64.powi(-30), 2f64.powi(60), 2f64.powi(600), 2f64.powi(1000)] {
        let hits = scene.hits(&ray([-10.0, 8.0, 1100.0], [0.25 * scale, 0.0, -scale]));
        assert_eq!(
            (hits.len(), hits[0].t * scale, hits[0].point),
            (1, 100.0, DVec3::new(15.0, 8.0, 1000.0)),
            "{scale}"
        );
    }
    // Along a grid line and along a diagonal, downwards.
    assert_eq!(first(ray([-10.0, 8.0, 1100.0], [0.2, 0.0, -1.0])).unwrap().0, DVec3::new(10.0, 8.0, 1000.0));
    assert_eq!(first(ray([-10.0, -10.0, 1100.0], [0.2, 0.2, -1.0])).unwrap().0, DVec3::new(10.0, 10.0, 1000.0));
    // Beside the map, and over it without coming down.
    assert_eq!(first(ray([-1.0, 5.0, 2000.0], [0.0, 0.0, -1.0])), None);
    assert_eq!(first(ray([-1.0, 5.0, 60_000.0], [1.0, 0.0, 0.0])), None);
    // From 10⁹ away.
    let far = scene.hits(&ray([-1e9, 4.0, 1000.0 + 1e9], [1.0, 0.0, -1.0]));
    assert_eq!(far.len(), 1);
    assert!((far[0].point.z - 1000.0).abs() < 1e-5, "{far:?}");
    // Through the spike: in and out.
    let through = scene.hits(&ray([-5.0, 16.0, 20_000.0], [1.0, 0.0, 0.0]));
    assert_eq!(through.iter().map(|h| h.entering).collect::<Vec<_>>(), [true, false]);
    // Limits around the hit.
    let mut limited = ray([5.0, 5.0, 2000.0], [0.0, 0.0, -1.0]);
    for (near, far, count) in [(0.0, 999.0, 0), (0.0, 1000.0, 1), (1000.0, 1e9, 1), (1001.0, 1e9, 0)] {
        (limited.near, limited.far) = (near, far);
        assert_eq!(scene.hits(&limited).len(), count, "{near}..{far}");
    }
}
