//! Pictures do not depend on how far from the origin a scene stands, and move as smoothly there as anywhere.
#![cfg(feature = "render")]
#![allow(missing_docs, reason = "a test")]

use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use seamount::prelude::*;
use seamount::render::{Headless, Picture};

fn headless() -> MutexGuard<'static, Headless> {
    static HEADLESS: OnceLock<Mutex<Headless>> = OnceLock::new();
    let made = HEADLESS.get_or_init(|| Mutex::new(Headless::new(None).unwrap_or_else(|error| panic!("{error}"))));
    made.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Draws what stands under a transform that moves everything, camera and light included, or the terrain alone and the
/// camera by its own position.
fn draw(map: &Arc<Image>, terrain: &SeamlessTerrain, camera: &Camera, offset: DVec3, together: bool) -> Picture {
    let mut scene = Scene::new();
    let root = scene.root();
    let moved = Transform { translation: offset, ..Transform::default() };
    let stands = if together { DVec3::ZERO } else { offset };
    if together {
        scene.add(root, moved.clone()).unwrap();
    }
    let (eye, at) = (camera.eye + stands, camera.at + stands);
    if let Some(height) = camera.height {
        let lens =
            OrthographicCamera { position: Some(eye), look_at: Some(at), height, ..OrthographicCamera::default() };
        scene.add(root, lens).unwrap();
    } else {
        let lens = PerspectiveCamera { position: Some(eye), look_at: Some(at), ..PerspectiveCamera::default() };
        scene.add(root, lens).unwrap();
    }
    scene.add(root, DirectionalLight { direction: DVec3::new(1.0, -0.3, -0.6), ..Default::default() }).unwrap();
    scene.add(root, PointLight { location: camera.eye + stands, ..Default::default() }).unwrap();
    if !together {
        scene.add(root, moved).unwrap();
    }
    scene.add(root, Material { specular_color: Color::WHITE.into(), ..Default::default() }).unwrap();
    scene.add(root, Texture2::from_image(Arc::clone(map))).unwrap();
    scene.add(root, terrain.clone()).unwrap();
    let action = RenderAction { background: Color::new(1.0, 0.0, 1.0), ..RenderAction::new(camera.size, camera.size) };
    let frame = action.apply(&scene).unwrap();
    headless().draw(&frame).unwrap()
}

struct Camera {
    eye: DVec3,
    at: DVec3,
    /// Height of the picture if the camera is orthographic.
    height: Option<f64>,
    size: u32,
}

/// Largest difference of a colour, and the number of pixels with any.
fn difference(a: &Picture, b: &Picture) -> (u8, usize) {
    let off = |(p, q): (&[u8], &[u8])| p.iter().zip(q).map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0);
    let offs = a.rgba.chunks_exact(4).zip(b.rgba.chunks_exact(4)).map(off);
    offs.fold((0, 0), |(most, count), off| (most.max(off), count + usize::from(off > 0)))
}

const OFFSETS: [DVec3; 4] = [
    DVec3::new(6.4e6, 0.0, 0.0),
    DVec3::new(1e7, -1e7, 1e7),
    DVec3::new(1.5e11, 0.0, 0.0),
    DVec3::new(-1.5e11, 1.5e11, 1.5e11),
];

#[test]
fn the_picture_does_not_depend_on_the_distance_from_the_origin() {
    let map = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/fuji.png");
    let map = Arc::new(Image::open(&map).unwrap());
    let terrain = SeamlessTerrain {
        size: Some(DVec2::new(90_600.0, 111_240.0)),
        max_height: 65_535.0,
        base_height: -1_000.0,
        void_sample: Some(0.0),
        ..SeamlessTerrain::default()
    };
    let summit = DVec3::new(65_900.0, 40_100.0, 3_776.0);
    // Whole metres, so that the shifted places exist as f64.
    let cameras = [
        (DVec3::new(58_000.0, 8_000.0, 4_200.0), summit - DVec3::Z * 1_500.0, None),
        (DVec3::new(48_000.0, 57_000.0, 2_000.0), summit - DVec3::Z * 1_200.0, None),
        (DVec3::new(65_000.0, 38_000.0, 4_200.0), summit, None),
        (DVec3::new(10_000.0, -20_000.0, 40_000.0), summit, Some(60_000.0)),
    ];
    for (eye, at, height) in cameras {
        let camera = Camera { eye, at, height, size: 512 };
        // Blended heights take no part in where the scene stands: one way of moving it is enough for them.
        for (morph, ways) in [(false, &[false, true][..]), (true, &[false])] {
            let terrain = SeamlessTerrain { morph, ..terrain.clone() };
            let here = draw(&map, &terrain, &camera, DVec3::ZERO, false);
            let ground = here.rgba.chunks_exact(4).filter(|p| p[..3] != [255, 0, 255]).count();
            assert!(ground > 50_000, "from {eye} only {ground} pixels of ground are seen");
            for offset in OFFSETS {
                for &together in ways {
                    let there = draw(&map, &terrain, &camera, offset, together);
                    let (most, count) = difference(&here, &there);
                    println!("{offset}, together {together}, morph {morph}: up to {most} in {count} pixels");
                    assert!(most <= 1, "from {eye}, moved by {offset}: {count} pixels differ by up to {most}");
                }
            }
        }
    }
}

/// Ground of 64 × 64 m in cells of a metre, rough, with its border in view: what is near shows the least jitter.
fn garden() -> (Arc<Image>, SeamlessTerrain) {
    let hill = |i: u32| {
        let (c, r) = (f64::from(i % 65), f64::from(i / 65));
        (20_000.0 + 9_000.0 * (c * 0.9).sin() + 9_000.0 * (r * 1.1).cos() + 6_000.0 * (c * r * 0.37).sin()) as u16
    };
    let map = Image::new(65, 65, Pixels::Gray16((0..65 * 65).map(hill).collect())).unwrap();
    let terrain = SeamlessTerrain { scale: 64.0, max_height: 3.0, ..SeamlessTerrain::default() };
    (Arc::new(map), terrain)
}

/// As near to a millimetre as f64 can say exactly at every one of these distances but the largest.
const STEP: f64 = 1.0 / 1024.0;

#[test]
fn steps_of_a_millimetre_show_the_same_everywhere() {
    let (map, terrain) = garden();
    let mut last = None;
    for step in 0..12 {
        let eye = DVec3::new(30.0 + f64::from(step) * STEP, 5.0, 3.5);
        let camera = Camera { eye, at: DVec3::new(32.0, 20.0, 1.0), height: None, size: 512 };
        let here = draw(&map, &terrain, &camera, DVec3::ZERO, false);
        for offset in &OFFSETS[..2] {
            let there = draw(&map, &terrain, &camera, *offset, false);
            let (most, count) = difference(&here, &there);
            assert!(most <= 1, "step {step}, moved by {offset}: {count} pixels differ by up to {most}");
        }
        // The steps are seen: pictures that do not move would agree as well.
        if let Some(last) = last {
            assert!(difference(&here, &last).1 > 1000, "step {step} shows nothing");
        }
        last = Some(here);
    }
}

/// A straight border of the ground, seen from above, against what projective geometry says: each step of 1 mm moves it
/// by the same fraction of a pixel, without a stop and without a jump.
#[test]
fn an_edge_moves_by_what_a_millimetre_is_worth() {
    let map = Arc::new(Image::new(65, 65, Pixels::Gray16(vec![0; 65 * 65])).unwrap());
    let terrain = SeamlessTerrain { scale: 64.0, max_height: 3.0, ..SeamlessTerrain::default() };
    let size = 512;
    let above = 2.0;
    // Pixels per metre on the ground, seen straight down with the default field of view.
    let scale = f64::from(size) / 2.0 / (std::f64::consts::FRAC_PI_8.tan() * above);
    for offset in [DVec3::ZERO, OFFSETS[0], OFFSETS[1]] {
        let edge = |step: u32| {
            // Straight down, the top of the picture turned by 0.3, so that the border slants through the rows of samples.
            let position = offset + DVec3::new(f64::from(step) * 0.001, 32.0, above);
            let mut scene = Scene::new();
            let root = scene.root();
            let orientation = AxisAngle::new(DVec3::Z, 0.3);
            scene.add(root, PerspectiveCamera { position: Some(position), orientation, ..Default::default() }).unwrap();
            scene.add(root, Transform { translation: offset, ..Transform::default() }).unwrap();
            scene.add(root, BaseColor { rgb: Color::WHITE.into() }).unwrap();
            scene.add(root, Texture2::from_image(Arc::clone(&map))).unwrap();
            scene.add(root, terrain.clone()).unwrap();
            let frame = RenderAction::new(size, size).apply(&scene).unwrap();
            let picture = headless().draw(&frame).unwrap();
            // Ground lies east of the border, to the right. Coverage is linear light: four samples give 0, 1/4, .. 1.
            let covered = |p: &[u8]| f64::from(seamount::action::linear_from_srgb(f32::from(p[0]) / 255.0));
            let area: f64 = picture.rgba.chunks_exact(4).map(covered).sum();
            area / f64::from(size)
        };
        // The border's distance from the middle in pixels along a row, summed over the rows, is its distance across over the
        // cosine of its slant.
        let per_step = 0.001 * scale / 0.3f64.cos();
        let places: Vec<f64> = (0..40).map(edge).collect();
        let (mut worst, mut smallest): (f64, f64) = (0.0, f64::INFINITY);
        for (step, pair) in places.windows(2).enumerate() {
            let moved = pair[1] - pair[0];
            worst = worst.max((moved - per_step).abs());
            smallest = smallest.min(moved);
            assert!(moved > 0.0, "moved by {offset}, step {step} goes back by {moved}");
        }
        let whole = places[39] - places[0];
        println!("{offset}: {per_step:.4} pixels a step, off by up to {worst:.4}; the whole way is {whole:.4}");
        assert!(worst < 0.05, "moved by {offset}: a step of {per_step} pixels is off by {worst}");
        assert!((whole - 39.0 * per_step).abs() < 0.05, "moved by {offset}: {whole} pixels in 39 steps of {per_step}");
        let middle = f64::from(size) / 2.0;
        assert!((places[0] - middle).abs() < 0.05, "moved by {offset}: the border is at {}", places[0]);
    }
}
