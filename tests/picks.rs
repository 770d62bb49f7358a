//! Pick styles, clip planes and the order of hits.
#![allow(missing_docs, reason = "a test")]

mod common;

use common::Rng;
use glam::DVec3;
use seamount::format::parse;
use seamount::node::Registry;
use seamount::prelude::*;

fn scene_of(nodes: &str) -> Scene {
    let text = format!("Scene(version: 1, root: Separator(children: [{nodes}]))");
    parse(&text, &Registry::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn down() -> Ray {
    Ray::new(DVec3::new(0.3, 10.0, 0.2), DVec3::NEG_Y).expect("a ray")
}

fn heights(nodes: &str, all: bool) -> Vec<f64> {
    let action = RayPickAction { all, ..RayPickAction::ray(down()) };
    action.apply(&scene_of(nodes)).expect("a pick").iter().map(|p| p.point.y).collect()
}

#[test]
fn styles_say_how_shapes_are_picked() {
    let two = |style: &str| {
        format!(
            "Separator(children: [PickStyle(style: {style}), Translation(translation: (0.0, -5.0, 0.0)), Sphere(radius: 2.0)]), Cube()"
        )
    };
    let sphere = (4.0f64 - 0.3 * 0.3 - 0.2 * 0.2).sqrt();
    let close = |got: Vec<f64>, expected: &[f64]| {
        assert!(
            got.len() == expected.len() && got.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12),
            "{got:?} {expected:?}"
        );
    };
    close(heights(&two("Shape"), true), &[1.0, -1.0, -5.0 + sphere, -5.0 - sphere]);
    close(heights(&two("Unpickable"), true), &[1.0, -1.0]);
    close(heights(&two("BoundingBox"), true), &[1.0, -1.0, -3.0, -7.0]);
    close(heights(&two("ShapeFrontfaces"), true), &[1.0, -1.0, -5.0 + sphere]);
    close(heights(&two("ShapeOnTop"), true), &[-5.0 + sphere, -5.0 - sphere, 1.0, -1.0]);
    close(heights(&two("BoundingBoxOnTop"), true), &[-3.0, -7.0, 1.0, -1.0]);
    // The first alone is the first of all, whatever comes first in the graph.
    for style in ["Shape", "Unpickable", "BoundingBox", "ShapeFrontfaces", "ShapeOnTop", "BoundingBoxOnTop"] {
        close(heights(&two(style), false), &heights(&two(style), true)[..1]);
    }
}

#[test]
fn front_faces_are_found_behind_back_faces() {
    // Mirrored, so that normals and sides change places twice.
    let nodes = "PickStyle(style: ShapeFrontfaces), Scale(scale_factor: (1.0, -1.0, 1.0)), Cube()";
    assert_eq!(heights(nodes, true), [1.0]);
    // From inside, all faces look away.
    let inside = Ray::new(DVec3::new(0.1, 0.2, 0.3), DVec3::NEG_Y).expect("a ray");
    assert!(RayPickAction::ray(inside).apply(&scene_of(nodes)).expect("a pick").is_empty());
}

#[test]
fn clip_planes_add_up_and_move_with_transforms() {
    let cut = "Translation(translation: (0.0, 0.5, 0.0)), ClipPlane(plane: (0.0, -2.0, 0.0, 0.0))";
    let back = "Translation(translation: (0.0, -0.5, 0.0))";
    // Kept is what is below 0.5: the top of the cube is gone.
    assert_eq!(heights(&format!("{cut}, {back}, Cube()"), true), [-1.0]);
    assert_eq!(heights(&format!("{cut}, {back}, Cube()"), false), [-1.0]);
    assert_eq!(heights(&format!("{cut}, {back}, ClipPlane(plane: (0.0, 1.0, 0.0, -0.5)), Cube()"), true), [0.0; 0]);
    assert_eq!(heights("ClipPlane(plane: (0.0, -1.0, 0.0, 0.0), on: false), Cube()", true), [1.0, -1.0]);
    // Up to the end of the separator.
    assert_eq!(heights(&format!("Separator(children: [{cut}]), Cube()"), true), [1.0, -1.0]);
    // Parallel to the ray.
    assert_eq!(heights("ClipPlane(plane: (1.0, 0.0, 0.0, 0.5)), Cube()", true), [0.0; 0]);
    assert_eq!(heights("ClipPlane(plane: (1.0, 0.0, 0.0, 0.25)), Cube()", true), [1.0, -1.0]);
}

#[test]
fn a_crossing_on_an_edge_or_corner_counts_once() {
    let scene = scene_of("Cube()");
    for (origin, direction) in [
        // Through the middle of two faces, where their triangles meet; through two edges; through two corners.
        (DVec3::new(0.0, 9.0, 0.0), DVec3::NEG_Y),
        (DVec3::new(4.0, 4.0, 0.5), DVec3::new(-1.0, -1.0, 0.0)),
        (DVec3::splat(4.0), DVec3::splat(-1.0)),
    ] {
        let ray = Ray::new(origin, direction).expect("a ray");
        let hits = RayPickAction { all: true, ..RayPickAction::ray(ray) }.apply(&scene).expect("a pick");
        assert_eq!(hits.len(), 2, "{origin}: {hits:#?}");
    }
}

#[test]
fn picks_in_a_large_scene_do_not_depend_on_what_was_asked_before() {
    let build = || {
        let mut scene = Scene::new();
        let root = scene.root();
        let mut moves = Vec::new();
        for k in 0..400 {
            let separator = scene.add(root, Separator::default()).expect("a child");
            let translation = DVec3::new(f64::from(k % 20) * 3.0, 0.0, f64::from(k / 20) * 3.0);
            moves.push(scene.add(separator, Translation { translation }).expect("a child"));
            scene.add(separator, Cube::default()).expect("a child");
        }
        (scene, moves)
    };
    let ray = |k: usize| {
        let from = DVec3::new((k % 20) as f64 * 3.0 + 0.2, 50.0, (k / 20) as f64 * 3.0 + 0.1);
        Ray::new(from, DVec3::new(0.001, -1.0, 0.002)).expect("a ray")
    };
    let (mut asked, moves) = build();
    let (mut silent, silent_moves) = build();
    for k in 0..60 {
        let which = k * 37 % 400;
        let change = DVec3::new(0.0, (k % 7) as f64, 0.0);
        asked.edit::<Translation>(moves[which]).expect("a move").translation += change;
        silent.edit::<Translation>(silent_moves[which]).expect("a move").translation += change;
        if k % 20 == 19 {
            // Taken away and put back elsewhere in the order.
            for scene in [&mut asked, &mut silent] {
                let root = scene.root();
                let key = scene.remove_child(root, which).expect("a child");
                scene.insert_child(root, 0, key).expect("its place");
            }
        }
        let answer = |scene: &Scene| {
            let hits = RayPickAction { all: true, ..RayPickAction::ray(ray(which)) }.apply(scene).expect("a pick");
            let hits: Vec<_> = hits.into_iter().map(|p| (p.point, p.path.indices().collect::<Vec<_>>())).collect();
            (BoundingBoxAction::default().apply(scene).expect("a box"), hits)
        };
        // `silent` is asked for the first time at the end: what it knows then was never made before.
        let got = answer(&asked);
        assert!(!got.1.is_empty());
        if k == 59 {
            assert_eq!(got, answer(&silent));
        }
    }
}

/// What a picker keeps of one terrain is not taken for another's, nor what was worked out for files that have been forgotten for
/// those that replace them; whoever else picks with it at the same time.
#[test]
fn a_picker_keeps_what_it_looked_up_apart() {
    let folder = tempfile::tempdir().unwrap();
    let map = |name: &str, height: u8| {
        let file = folder.path().join(name);
        image::GrayImage::from_pixel(5, 5, image::Luma([height])).save(&file).unwrap();
        file.to_string_lossy().replace('\\', "/")
    };
    let (low, high) = (map("low.png", 51), map("high.png", 102));
    // Three unit squares side by side; the first and the last have one map.
    let square = |file: &str, x: f64| {
        format!(
            "Translation(translation: ({x}, 0.0, 0.0)), Texture2(filename: \"{file}\"), SeamlessTerrain(max_height: 1.0)"
        )
    };
    let scene = scene_of(&[square(&low, 0.0), square(&high, 1.0), square(&low, 1.0)].join(", "));
    let down: Vec<Ray> =
        (0..300).map(|i| Ray::new(DVec3::new(0.3 + f64::from(i % 3), 0.4, 9.0), DVec3::NEG_Z).unwrap()).collect();
    for surface in [Surface::Coarse, Surface::Drawn, Surface::Exact] {
        let picker = RayPickAction { surface, ..RayPickAction::ray(down[0]) }.picker(&scene).unwrap();
        let one = |ray: &Ray| picker.pick(ray, false).unwrap()[0].point.z;
        let expected = |i: usize| if i % 3 == 1 { 0.4 } else { 0.2 };
        std::thread::scope(|scope| {
            for _ in 0..3 {
                scope.spawn(|| {
                    for (i, ray) in down.iter().enumerate() {
                        assert!((one(ray) - expected(i)).abs() < 1e-6, "{surface:?} {i}");
                    }
                });
            }
            let many = picker.pick_many(&down, false).unwrap();
            assert!(
                many.iter().enumerate().all(|(i, hits)| (hits[0].point.z - expected(i)).abs() < 1e-6),
                "{surface:?}"
            );
        });
        // The second map is another now.
        map("high.png", 77);
        scene.resources().forget();
        assert!((one(&down[1]) - 77.0 / 255.0).abs() < 1e-6, "{surface:?}: {}", one(&down[1]));
        map("high.png", 102);
        scene.resources().forget();
    }
}

/// Of many rays the first that is none is told, whichever thread comes to it first.
#[test]
fn the_first_bad_ray_of_many_is_told() {
    let scene = scene_of("Cube()");
    let mut rays = vec![down(); 2000];
    rays[1900].direction = DVec3::ZERO;
    rays[700].origin = DVec3::NAN;
    let picker = RayPickAction::ray(down()).picker(&scene).unwrap();
    let told = |rays: &[Ray]| picker.pick_many(rays, false).unwrap_err().to_string();
    let [early, late] = [700, 1900].map(|i: usize| picker.pick(&rays[i], false).unwrap_err().to_string());
    assert_ne!(early, late);
    for _ in 0..20 {
        assert_eq!(told(&rays), early);
    }
    rays[700] = down();
    assert_eq!(told(&rays), late);
}

/// A plane is crossed at most once. Through its vertices, and along it, rounding makes f change its sign to and fro within the last
/// digits: one touch was listed as a way in and another out.
#[test]
fn a_plane_is_crossed_once_on_every_surface() {
    let mut rng = Rng(8);
    let pixels = (0..33 * 33).map(|i| (2 * (i % 33) + i / 33 + 1) as u16).collect();
    for resolutions in [(2, 2), (8, 2)] {
        let mut scene = Scene::new();
        let root = scene.root();
        let image = Image::new(33, 33, Pixels::Gray16(Vec::clone(&pixels))).expect("an image");
        scene.add(root, Texture2::from_image(image)).expect("a map");
        let terrain =
            SeamlessTerrain { size: Some(DVec2::splat(32.0)), max_height: 65535.0, resolutions, ..Default::default() };
        scene.add(root, terrain).expect("a terrain");
        for surface in [Surface::Coarse, Surface::Drawn, Surface::Exact] {
            let action = RayPickAction { surface, ..RayPickAction::pixel(0, 0, [1, 1]) };
            let picker = action.picker(&scene).expect("a picker");
            let mut found = 0;
            for _ in 0..20_000 {
                let [c, r] = [0; 2].map(|_| f64::from(rng.below(33)));
                let target = DVec3::new(c, 32.0 - r, 2.0 * c + r + 1.0);
                let [x, y] = [0; 2].map(|_| f64::from(rng.below(21)) - 10.0);
                // Its rise in the plane, and a little more or less, in decimals.
                let steeper =
                    [0.0, 1e-13, 1e-9, 1e-3, 0.7, 1e3][rng.below(6) as usize] * (f64::from(rng.below(3)) - 1.0);
                let direction = DVec3::new(x, y, 2.0 * x - y + steeper);
                let far = [8.0, 3.7, 1000.1][rng.below(3) as usize];
                let Ok(ray) = Ray::new(target - direction * far, direction) else { continue };
                let hits = picker.pick(&ray, true).expect("a pick");
                assert!(hits.len() <= 1, "{surface:?} {resolutions:?} {ray:?}: {hits:#?}");
                found += hits.len();
                // Into the surface at one of its samples, unless that is at the border.
                let inner = [c, r].iter().all(|x| (1.0..32.0).contains(x));
                assert!(hits.len() == 1 || steeper.abs() < 1e-6 || !inner, "{surface:?} {resolutions:?} {ray:?}");
            }
            assert!(found > 8000, "{surface:?}: {found}");
        }
    }
}

/// From below the raw surface at a corner between patches: a chain of triangles was broken there, and where it began again f = 0 counted
/// as above, so that a touch was told as a way out and in, and the end of a ray twice.
#[test]
fn a_touch_at_a_corner_of_patches_is_told_as_on_the_exact_surface() {
    type Case<'c> = (u32, &'c [(u32, u32)], DVec2, [f64; 6], usize);
    let valley: Vec<(u32, u32)> = (7..=16).map(|r| (r - 5, r)).collect();
    let cases: [Case<'_>; 4] = [
        (18, &valley, DVec2::new(1.0, 18.0), [-0.625, 23.29411764705882, 0.0, 0.0625, -1.0588235294117645, 0.0], 0),
        (18, &valley, DVec2::new(1.0, 18.0), [0.6875, 1.058823529411772, 0.0, -0.0625, 1.0588235294117645, 0.0], 0),
        (
            17,
            &[(11, 2), (12, 3), (13, 4), (16, 7)],
            DVec2::new(13.7, 1.0),
            [-11.98749999999998, 2.4375, 0.0, 0.8562499999999993, -0.0625, 0.0],
            1,
        ),
        (
            17,
            &[(6, 0), (7, 0), (12, 5), (12, 6)],
            DVec2::new(13.7, 1.0),
            [-72.78124999999993, 6.6875, 0.0, 0.8562499999999993, -0.0625, 0.0],
            1,
        ),
    ];
    for (rows, low, size, [ox, oy, oz, dx, dy, dz], count) in cases {
        let sample = |i: u32| if low.contains(&(i % 17, i / 17)) { 0 } else { 2 };
        let image = Image::new(17, rows, Pixels::Gray16((0..17 * rows).map(sample).collect())).expect("an image");
        let mut scene = Scene::new();
        let root = scene.root();
        scene.add(root, Texture2::from_image(image)).expect("a map");
        let terrain =
            SeamlessTerrain { size: Some(size), max_height: 65535.0, resolutions: (2, 2), ..Default::default() };
        scene.add(root, terrain).expect("a terrain");
        let ray = Ray::new(DVec3::new(ox, oy, oz), DVec3::new(dx, dy, dz)).expect("a ray");
        let told = |surface| {
            let action = RayPickAction { surface, all: true, ..RayPickAction::ray(ray) };
            action.apply(&scene).expect("a pick").len()
        };
        assert_eq!((told(Surface::Exact), told(Surface::Drawn)), (count, count), "{ray:?}");
    }
}
