//! Air: fog as Open Inventor defines it, and what is behind everything.
#![cfg(feature = "render")]

mod common;

use common::Rng;
use common::gpu::{Linear, headless, linear};
use seamount::prelude::*;

const SIZE: [u32; 2] = [40, 30];

/// Looking over a plane, so that distances of all sizes are in the picture.
fn plane(perspective: bool, environment: Environment) -> Scene {
    let mut scene = Scene::new();
    let root = scene.root();
    let (position, look_at) = (Some(DVec3::new(0.0, -40.0, 12.0)), Some(DVec3::ZERO));
    if perspective {
        scene.add(root, PerspectiveCamera { position, look_at, ..Default::default() }).unwrap();
    } else {
        scene.add(root, OrthographicCamera { position, look_at, height: 30.0, ..Default::default() }).unwrap();
    }
    scene.add(root, environment).unwrap();
    scene.add(root, BaseColor { rgb: Color::new(0.9, 0.4, 0.1).into() }).unwrap();
    scene.add(root, Cube { width: 400.0, height: 200.0, depth: 0.0 }).unwrap();
    scene
}

/// Each pixel against the definition, in linear light: what is left of the surface at the distance of the place that it shows.
#[test]
fn fog_thickens_as_open_inventor_defines_it() {
    let mut gpu = linear();
    let surface = Color::new(0.9, 0.4, 0.1).linear();
    for (fog_type, left) in [
        (FogType::Haze, (|d, v| 1.0 - d / v) as fn(f64, f64) -> f64),
        (FogType::Fog, |d, v| (-d * 256f64.ln() / v).exp()),
        (FogType::Smoke, |d, v| (-d * d * 256f64.ln() / (v * v)).exp()),
    ] {
        for perspective in [true, false] {
            for fog_visibility in [25.0, 60.0, 150.0, 0.0] {
                let fog_color = Color::new(0.2, 0.5, 0.9);
                let scene =
                    plane(perspective, Environment { fog_type, fog_color, fog_visibility, ..Default::default() });
                let action = RenderAction::new(SIZE[0], SIZE[1]);
                let view = action.viewpoint(&scene).unwrap();
                let picture = gpu.draw(&action.apply(&scene).unwrap());
                // Without a distance of its own the fog ends at the far end of the scene.
                let far = [(-200.0, -100.0), (200.0, -100.0), (200.0, 100.0), (-200.0, 100.0)]
                    .map(|(x, y)| (DVec3::new(x, y, 0.0) - view.eye).dot(view.forward))
                    .into_iter()
                    .fold(0.0, f64::max);
                let far = if perspective { far } else { view.far.unwrap() };
                let visibility = if fog_visibility > 0.0 { fog_visibility } else { far };
                let picker = RayPickAction::pixel(0, 0, SIZE).picker(&scene).unwrap();
                let (mut seen, mut last, mut column) = (0, 1.0, SIZE[0]);
                for (x, y) in (0..SIZE[0]).flat_map(|x| (0..SIZE[1]).rev().map(move |y| (x, y))) {
                    let [px, py] = [(x, SIZE[0]), (y, SIZE[1])].map(|(p, n)| (f64::from(p) + 0.5) / f64::from(n));
                    let hits = picker.pick(&picker.ray_through(px, py).unwrap(), false).unwrap();
                    let Some(hit) = hits.first() else { continue };
                    let to_point = hit.point - view.eye;
                    let distance = if perspective { to_point.length() } else { to_point.dot(view.forward) };
                    let share = left(distance, visibility).clamp(0.0, 1.0);
                    let want = fog_color.linear().lerp(surface, share as f32);
                    let got = picture.at(x, y);
                    for (got, want) in got.into_iter().zip(want.to_array()) {
                        // Half floats have 11 bits.
                        assert!(
                            (got - want).abs() < 2e-3,
                            "{fog_type:?} {visibility} at ({x}, {y}): {got} is not {want}"
                        );
                    }
                    // Up the picture it is further, and there is less of the surface.
                    if y == SIZE[1] - 1 || column != x {
                        (last, column) = (1.0, x);
                    }
                    assert!(share <= last, "{fog_type:?} at ({x}, {y})");
                    (seen, last) = (seen + 1, share);
                }
                assert!(seen > 400, "{seen}");
            }
        }
    }
}

/// The sky has the colour of the horizon at and below it and goes to that of the zenith by the sine of the elevation; it is
/// behind everything and changes nothing else.
#[test]
fn the_sky_is_behind_everything() {
    let (color, zenith) = (Color::new(0.8, 0.7, 0.6), Some(Color::new(0.1, 0.3, 0.8)));
    let scene = |sky: bool| {
        let mut scene = Scene::new();
        let root = scene.root();
        let (position, look_at) = (Some(DVec3::new(0.0, -6.0, 0.0)), Some(DVec3::new(0.0, 0.0, 2.0)));
        scene.add(root, PerspectiveCamera { position, look_at, height_angle: 1.4, ..Default::default() }).unwrap();
        scene.add(root, Cube::default()).unwrap();
        if sky {
            // At the end, and in a separator: it is the scene's all the same.
            let aside = scene.add(root, Separator::default()).unwrap();
            scene.add(aside, Background { color, zenith }).unwrap();
            scene.add(root, Background { color: Color::WHITE, zenith: None }).unwrap();
        }
        scene
    };
    let action = RenderAction::new(SIZE[0], SIZE[1]);
    let (with, without) = (scene(true), scene(false));
    let frames = [&with, &without].map(|scene| action.apply(scene).unwrap());
    assert!(frames[1].sky.is_none());
    let mut gpu = Linear::new();
    let plain = gpu.draw(&frames[1]);
    assert_eq!((plain.report.pipelines_made, plain.report.draw_calls), (1, 1), "without a sky there is nothing of it");
    let sky = gpu.draw(&frames[0]);
    assert_eq!((sky.report.pipelines_made, sky.report.draw_calls, frames[0].statistics.draw_calls), (1, 2, 2));
    let view = action.viewpoint(&with).unwrap();
    let depth = headless().draw_depth(&frames[1]).unwrap();
    let (mut above, mut below) = (0, 0);
    for (x, y) in (0..SIZE[0]).flat_map(|x| (0..SIZE[1]).map(move |y| (x, y))) {
        if depth[(y * SIZE[0] + x) as usize] > 0.0 {
            assert_eq!(sky.at(x, y), plain.at(x, y), "the cube at ({x}, {y})");
            continue;
        }
        let [px, py] = [(x, SIZE[0]), (y, SIZE[1])].map(|(p, n)| (f64::from(p) + 0.5) / f64::from(n));
        let elevation = view.ray(px, py).1.z;
        if elevation > 0.0 {
            above += 1
        } else {
            below += 1
        }
        let want = color.linear().lerp(zenith.unwrap().linear(), elevation.max(0.0) as f32);
        for (got, want) in sky.at(x, y).into_iter().zip(want.to_array()) {
            assert!((got - want).abs() < 2e-3, "({x}, {y}): {got} is not {want}");
        }
    }
    assert!(above > 300 && below > 100, "{above} above, {below} below");
}

/// A background colour is that of the picture where nothing is, and takes no draw.
#[test]
fn a_background_colour_costs_nothing() {
    let mut rng = Rng(3);
    for _ in 0..5 {
        let color = Color::new(rng.unit() as f32, rng.unit() as f32, rng.unit() as f32);
        let mut scene = Scene::new();
        let root = scene.root();
        scene.add(root, PerspectiveCamera::default()).unwrap();
        scene.add(root, Background { color, zenith: None }).unwrap();
        let frame = RenderAction::new(8, 8).apply(&scene).unwrap();
        let picture = headless().draw(&frame).unwrap();
        assert_eq!(picture.report.draw_calls, 0);
        let want = color.rgb().to_array().map(|c| (c * 255.0).round() as i16);
        let got = picture.pixel(4, 4).unwrap();
        assert!(got.iter().zip(want).all(|(&g, w)| (i16::from(g) - w).abs() <= 1), "{got:?} is not {want:?}");
    }
}
