//! Heights and lines of sight in world coordinates, against the engine's answers and a dense walk along the line.
#![allow(missing_docs, reason = "a test")]

mod common;

use common::Rng;
use seamount::node::HitDetail;
use seamount::prelude::*;
use seamount::terrain::{HeightField, generate};

/// A scene with one generated terrain under a transform, its map, and the matrix from its local frame to the world.
fn scene(turn: &Transform) -> (Scene, HeightField, SeamlessTerrain, DAffine3) {
    let field = generate(65, 2).unwrap();
    let samples = (0..65 * 65).map(|i| field.raw(i % 65, i / 65) as u16).collect();
    let terrain = SeamlessTerrain { scale: 64.0, max_height: 20.0, base_height: 3.0, ..SeamlessTerrain::default() };
    let mut scene = Scene::new();
    let root = scene.root();
    scene.add(root, turn.clone()).unwrap();
    scene.add(root, Texture2::from_image(Image::new(65, 65, Pixels::Gray16(samples)).unwrap())).unwrap();
    scene.add(root, terrain.clone()).unwrap();
    let matrix = DAffine3::from_scale_rotation_translation(
        turn.scale_factor,
        DQuat::from_axis_angle(turn.rotation.axis.normalize(), turn.rotation.angle),
        turn.translation,
    );
    (scene, field, terrain, matrix)
}

fn turns() -> Vec<Transform> {
    let turn = |translation, axis: DVec3, angle, scale_factor| Transform {
        translation,
        rotation: AxisAngle { axis, angle },
        scale_factor,
        ..Transform::default()
    };
    vec![
        Transform::default(),
        turn(DVec3::new(1e7, -1e7, 1e7), DVec3::Z, 0.0, DVec3::ONE),
        turn(DVec3::new(5.0, 6.0, 7.0), DVec3::Z, 1.0, DVec3::new(2.0, 3.0, 0.5)),
        turn(DVec3::ZERO, DVec3::Z, -2.0, DVec3::new(-1.0, 1.0, 2.0)),
        turn(DVec3::new(1.0, 1.0, 1.0), DVec3::new(1.0, 0.3, 0.1), 0.6, DVec3::new(1.0, 2.0, 1.0)),
    ]
}

/// Under transforms that keep z upright the height is that of the map, and the gradient that of finite differences.
#[test]
fn heights_are_those_of_the_map() {
    let mut rng = Rng(6);
    for turn in &turns()[..4] {
        let (scene, field, terrain, matrix) = scene(turn);
        let frame = terrain.frame(&field);
        let scale = turn.translation.length() + 100.0;
        let mut found = 0;
        for _ in 0..300 {
            // The middle of a triangle of a cell, or anywhere.
            let (u, v) = (f64::from(rng.below(64)) + 0.6, f64::from(rng.below(64)) + 0.3);
            let raw = field.surface(u, v).unwrap();
            let world = matrix.transform_point3(frame.local(DVec3::new(u, v, raw)));
            let ground = scene.height_at(world.x, world.y).unwrap().unwrap();
            // The place is off by its rounding, the height by that times the slope.
            let off = 64.0 * f64::EPSILON * scale * (1.0 + ground.gradient.length());
            assert!((ground.height - world.z).abs() <= off, "{} is not {}", ground.height, world.z);
            let h = 1e-2;
            let at = |dx: f64, dy: f64| scene.height_at(world.x + dx, world.y + dy).unwrap().unwrap().height;
            let slope = DVec2::new(at(h, 0.0) - at(-h, 0.0), at(0.0, h) - at(0.0, -h)) / (2.0 * h);
            let near = 1e-9 + 4.0 * off / h;
            assert!((slope - ground.gradient).abs().max_element() <= near, "{slope} is not {}", ground.gradient);
            found += 1;
        }
        assert_eq!(found, 300);
        let bounds = BoundingBoxAction::default().apply(&scene).unwrap().unwrap();
        assert_eq!(scene.height_at(bounds.min.x - 1.0, bounds.min.y).unwrap(), None);
        assert_eq!(scene.height_at(bounds.max.x, bounds.max.y + 1.0).unwrap(), None);
    }
}

/// The topmost terrain counts, other shapes do not, and the ends of what can be asked are errors or nothing.
#[test]
fn the_topmost_terrain_counts() {
    let (mut scene, ..) = scene(&Transform::default());
    let below = scene.height_at(20.0, 30.0).unwrap().unwrap();
    let root = scene.root();
    scene.add(root, Transform { translation: DVec3::new(0.0, 0.0, 50.0), ..Transform::default() }).unwrap();
    let upper = SeamlessTerrain { scale: 64.0, max_height: 20.0, ..SeamlessTerrain::default() };
    scene.add(root, upper).unwrap();
    scene.add(root, Cube { width: 200.0, height: 200.0, depth: 200.0 }).unwrap();
    let above = scene.height_at(20.0, 30.0).unwrap().unwrap();
    assert!((above.height - below.height - 47.0).abs() < 1e-9, "{above:?}");
    assert_ne!(above.picked.path, below.picked.path);
    assert!(scene.height_at(f64::NAN, 0.0).is_err());
    assert!(scene.height_at(0.0, f64::INFINITY).is_err());
    assert_eq!(Scene::new().height_at(0.0, 0.0).unwrap(), None);
}

/// What is picked before all others need not be above them.
#[test]
fn the_topmost_terrain_counts_whichever_is_picked_first() {
    let mut scene = Scene::new();
    let root = scene.root();
    let plain = |z: u16| Texture2::from_image(Image::new(3, 3, Pixels::Gray16(vec![z; 9])).unwrap());
    let terrain = SeamlessTerrain { scale: 2.0, max_height: 65_535.0, ..SeamlessTerrain::default() };
    scene.add(root, plain(50)).unwrap();
    scene.add(root, terrain.clone()).unwrap();
    scene.add(root, PickStyle { style: PickStyleKind::ShapeOnTop }).unwrap();
    scene.add(root, plain(20)).unwrap();
    scene.add(root, terrain).unwrap();
    assert_eq!(scene.height_at(1.0, 1.0).unwrap().unwrap().height, 50.0);
}

/// Lines between points above the ground, against the height above ground at many points of the line, in the frame of the
/// map: where the line is clearly above everywhere it is free, where it is clearly below somewhere it is not, and the
/// obstacle is where it goes below first.
#[test]
fn lines_agree_with_a_dense_walk() {
    let mut rng = Rng(7);
    let (mut free, mut blocked) = (0, 0);
    for turn in turns() {
        let (scene, field, terrain, matrix) = scene(&turn);
        let frame = terrain.frame(&field);
        let exact = RayPickAction { surface: Surface::Exact, ..RayPickAction::pixel(0, 0, [64, 48]) };
        let picker = exact.picker(&scene).unwrap();
        for _ in 0..300 {
            let mut end = || {
                let (u, v) = (rng.range(0.0, 64.0), rng.range(0.0, 64.0));
                // Some ends on the ground.
                let up = if rng.below(3) == 0 { 0.0 } else { rng.range(100.0, 9000.0) };
                DVec3::new(u, v, field.surface(u, v).unwrap() + up)
            };
            let (a, b) = (end(), end());
            let world = |p: DVec3| matrix.transform_point3(frame.local(p));
            let found = picker.line_of_sight(world(a), world(b)).unwrap();
            const STEPS: u32 = 4000;
            let gap = |k: u32| {
                let p = a + (b - a) * (f64::from(k) / f64::from(STEPS));
                p.z - field.surface(p.x.clamp(0.0, 64.0), p.y.clamp(0.0, 64.0)).unwrap()
            };
            let first = (1..STEPS).find(|&k| gap(k) < -1e-4);
            let lowest = (1..STEPS).map(gap).fold(f64::INFINITY, f64::min);
            match (&found, first) {
                (Some(obstacle), Some(k)) => {
                    let along = (obstacle.point - world(a)).length() / (world(b) - world(a)).length();
                    let k = f64::from(k) / f64::from(STEPS);
                    // A line that starts on the ground and goes below may be seen only where it comes out again.
                    let HitDetail::Terrain(detail) = obstacle.detail else { panic!("{obstacle:?}") };
                    let starts_below = gap(0).abs() < 1e-6 && !detail.entering;
                    assert!(along <= k + 1e-6 || starts_below, "{along} {k} {obstacle:?}");
                    blocked += 1;
                }
                (None, None) => free += 1,
                (Some(obstacle), None) => assert!(lowest < 30.0, "{lowest}: {a} {b} {obstacle:?}"),
                (None, Some(k)) => panic!("blocked at {k} of {STEPS} by {}: {a} {b}", gap(k)),
            }
        }
    }
    assert!(free > 200 && blocked > 200, "{free} free, {blocked} blocked");
}

/// A point sees itself, ends on the ground see over it, an end below it does not see out, other shapes are in the way.
#[test]
fn ends_of_a_line() {
    for turn in turns() {
        let (mut scene, field, terrain, matrix) = scene(&turn);
        let frame = terrain.frame(&field);
        let world = |u: f64, v: f64, up: f64| {
            matrix.transform_point3(frame.local(DVec3::new(u, v, field.surface(u, v).unwrap() + up)))
        };
        for (u, v) in [(10.0, 10.0), (20.3, 40.1), (33.5, 33.5), (60.0, 1.25)] {
            let (ground, high) = (world(u, v, 0.0), world(u, v, 60_000.0));
            assert_eq!(scene.line_of_sight(ground, ground).unwrap(), None);
            assert_eq!(scene.line_of_sight(ground, high).unwrap(), None, "{turn:?}");
            assert_eq!(scene.line_of_sight(high, ground).unwrap(), None, "{turn:?}");
            assert!(scene.line_of_sight(world(u, v, -500.0), high).unwrap().is_some());
            assert!(scene.line_of_sight(high, world(u, v, -500.0)).unwrap().is_some());
            assert!(scene.line_of_sight(world(u, v, -500.0), world(u + 0.5, v, -500.0)).unwrap().is_some());
        }
        assert!(scene.line_of_sight(DVec3::NAN, DVec3::ZERO).is_err());
        assert!(scene.line_of_sight(DVec3::ZERO, DVec3::INFINITY).is_err());
        let (a, b) = (world(10.0, 30.0, 90_000.0), world(50.0, 30.0, 90_000.0));
        assert_eq!(scene.line_of_sight(a, b).unwrap(), None);
        let root = scene.root();
        let middle = frame.local(DVec3::new(30.0, 30.0, 0.0)).with_z(frame.base + 30.0);
        scene.add(root, Transform { translation: middle, ..Transform::default() }).unwrap();
        scene.add(root, Cube { width: 4.0, height: 4.0, depth: 40.0 }).unwrap();
        let obstacle = scene.line_of_sight(a, b).unwrap();
        assert!(obstacle.is_some_and(|o| !matches!(o.detail, seamount::node::HitDetail::Terrain(_))));
    }
}

/// The other surfaces can be asked too, and are as far off as they say.
#[test]
fn other_surfaces_can_be_asked() {
    let (scene, ..) = scene(&Transform::default());
    let with = |surface| RayPickAction { surface, ..RayPickAction::pixel(0, 0, [64, 48]) };
    for surface in [Surface::Coarse, Surface::Drawn] {
        let action = with(surface);
        let picker = action.picker(&scene).unwrap();
        for k in 1..60 {
            let (x, y) = (f64::from(k), f64::from(k * 37 % 64));
            let ground = picker.height_at(x, y).unwrap().unwrap();
            let exact = scene.height_at(x, y).unwrap().unwrap();
            assert_eq!(ground.picked.surface, surface);
            let bound = ground.picked.error_bound.unwrap() + exact.picked.error_bound.unwrap();
            assert!((ground.height - exact.height).abs() <= bound + 1e-12);
            // The ground itself is seen from above, also where the surface that is asked lies higher.
            let above = DVec3::new(x, y, 100.0);
            assert_eq!(picker.line_of_sight(above, above.with_z(exact.height)).unwrap(), None);
        }
    }
}

/// On every surface a line is blocked where it goes below the surface that is asked by more than twice its bound, and free where
/// it stays above, grazing lines included: what lies far from an end is no part of it. The judge walks along the line and asks
/// for the height at each place.
#[test]
fn an_end_on_the_ground_hides_no_hill() {
    // Hills so wide that four triangles per patch come near them: 20 high, the bound is about 1.
    let height =
        |i: u32| (30_000.0 + 20_000.0 * (f64::from(i % 65) / 9.0).sin() * (f64::from(i / 65) / 11.0).cos()) as u16;
    let mut scene = Scene::new();
    let root = scene.root();
    let pixels = Pixels::Gray16((0..65 * 65).map(height).collect());
    scene.add(root, Texture2::from_image(Image::new(65, 65, pixels).unwrap())).unwrap();
    scene.add(root, SeamlessTerrain { scale: 64.0, max_height: 30.0, ..SeamlessTerrain::default() }).unwrap();
    let mut rng = Rng(9);
    for surface in [Surface::Coarse, Surface::Drawn, Surface::Exact] {
        let action = RayPickAction { surface, ..RayPickAction::pixel(0, 0, [64, 48]) };
        let picker = action.picker(&scene).unwrap();
        let (mut free, mut blocked) = (0, 0);
        for k in 0..600 {
            // Ends on the exact ground or a little above, so that many lines graze it.
            let mut end = || {
                let (u, v) = (rng.range(0.0, 64.0), rng.range(0.0, 64.0));
                let up = if rng.below(2) == 0 { 0.0 } else { rng.range(0.0, 8.0) };
                DVec3::new(u, v, scene.height_at(u, v).unwrap().unwrap().height + up)
            };
            let (a, b) = (end(), end());
            let found = picker.line_of_sight(a, b).unwrap();
            const STEPS: u32 = 600;
            let (mut lowest, mut bound) = (f64::INFINITY, 0.0f64);
            for k in 1..STEPS {
                let p = a + (b - a) * (f64::from(k) / f64::from(STEPS));
                let ground = picker.height_at(p.x, p.y).unwrap().unwrap();
                lowest = lowest.min(p.z - ground.height);
                bound = bound.max(ground.picked.error_bound.unwrap());
            }
            if lowest < -2.0 * bound - 1e-9 {
                assert!(found.is_some(), "{surface:?} {k}: {a} {b} {lowest} {bound}");
                blocked += 1;
            } else if lowest > 1e-2 {
                assert_eq!(found, None, "{surface:?} {k}: {a} {b} {lowest}");
                free += 1;
            }
        }
        assert!(free > 20 && blocked > 50, "{surface:?}: {free} free, {blocked} blocked");
    }
}

/// A plain at 1000 with a ridge of 3000 from north to south: what blocks a line is where it goes in, or comes out of the ground that it
/// starts in.
#[test]
fn a_ridge_blocks_the_view() {
    let mut scene = Scene::new();
    let root = scene.root();
    let samples = (0..17 * 17).map(|i| if i % 17 == 8 { 3000 } else { 1000 }).collect();
    scene.add(root, Texture2::from_image(Image::new(17, 17, Pixels::Gray16(samples)).unwrap())).unwrap();
    let terrain = SeamlessTerrain { scale: 16.0, max_height: 65_535.0, ..SeamlessTerrain::default() };
    scene.add(root, terrain).unwrap();
    let at = |u: f64, v: f64, w: f64| DVec3::new(u, 16.0 - v, w);
    let blocked = |a, b| scene.line_of_sight(a, b).unwrap().map(|hit| hit.point);
    let there = |found: Option<DVec3>, p: DVec3| assert!(found.is_some_and(|q| q.distance(p) < 1e-9), "{found:?} {p}");
    there(blocked(at(2.0, 3.0, 1500.0), at(14.0, 3.0, 1500.0)), at(7.25, 3.0, 1500.0));
    there(blocked(at(2.0, 3.0, 2000.0), at(14.0, 3.0, 2000.0)), at(7.5, 3.0, 2000.0));
    assert_eq!(blocked(at(2.0, 3.0, 3000.0), at(14.0, 3.0, 3000.0)), None);
    assert_eq!(blocked(at(2.0, 3.0, 1000.0), at(8.0, 3.0, 3000.0)), None);
    assert!(blocked(at(2.0, 3.0, 900.0), at(2.0, 4.0, 9000.0)).is_some_and(|p| (p.z - 1000.0).abs() < 1e-9));
}

/// Ends on the ground as well as f64 can say see each other over a hollow, and straight up and down.
#[test]
fn ends_on_the_ground_see_the_sky_and_are_seen() {
    let mut rng = Rng(1);
    for turn in turns() {
        let (scene, field, terrain, matrix) = scene(&turn);
        let frame = terrain.frame(&field);
        let exact = RayPickAction { surface: Surface::Exact, ..RayPickAction::pixel(0, 0, [64, 48]) };
        let picker = exact.picker(&scene).unwrap();
        for _ in 0..2000 {
            let (u, v) = (rng.range(0.0, 64.0), rng.range(0.0, 64.0));
            let ground = DVec3::new(u, v, field.surface(u, v).unwrap());
            let sky = ground + DVec3::new(rng.range(-1e-3, 1e-3), rng.range(-1e-3, 1e-3), 1e5);
            let [ground, sky] = [ground, sky].map(|p| matrix.transform_point3(frame.local(p)));
            assert_eq!(picker.line_of_sight(ground, sky).unwrap(), None, "{turn:?}");
            assert_eq!(picker.line_of_sight(sky, ground).unwrap(), None, "{turn:?}");
        }
    }
}
