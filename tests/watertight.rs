//! White ground on magenta: nothing shows through, at any eye, with the detail that the error in pixels asks for.
//!
//! The judge is the picture of the whole mesh, every cell of the map: where it shows ground in a pixel and all around
//! it, a mesh that is at most a pixel off shows ground in that pixel; but for slivers of sky between its samples, which exact
//! picks tell. A share of the eyes runs by default, all of them with
//! `SEAMOUNT_SOAK=1`.
#![cfg(feature = "render")]
#![allow(missing_docs, reason = "a test")]

mod common;
#[path = "common/maps.rs"]
mod maps;

use std::sync::Arc;

use common::Rng;
use glam::{DVec2, DVec3};
use seamount::node::HitDetail;
use seamount::prelude::*;
use seamount::render::{Headless, Picture};

const SIZE: u32 = 512;

/// An eye above the ground: one in three close to it and looking along it, one in three over it, the others from beside it;
/// one in five with parallel rays.
fn camera(rng: &mut Rng, k: u32, terrain: &SeamlessTerrain, map: &Image) -> Box<dyn Node> {
    let field = map.height_field(terrain.void_sample).unwrap();
    let frame = terrain.frame(&field);
    let [cu, cv] = frame.cells.map(f64::from);
    let extent = frame.local(DVec3::new(cu, 0.0, 0.0)).truncate();
    let ground = |x: f64, y: f64| {
        let p = frame.lattice(DVec3::new(x, y, 0.0));
        let raw = field.surface(p.x.clamp(0.0, cu), p.y.clamp(0.0, cv)).unwrap();
        frame.local(p.with_z(raw)).z
    };
    let width = extent.max_element();
    let inside = |rng: &mut Rng| DVec2::new(rng.range(0.05, 0.95), rng.range(0.05, 0.95)) * extent;
    let (place, above) = match k % 3 {
        0 => (inside(rng), width * 10f64.powf(rng.range(-3.5, -1.5))),
        1 => (inside(rng), width * rng.range(0.02, 0.5)),
        _ => {
            let angle = rng.range(0.0, std::f64::consts::TAU);
            let out = extent * 0.5 + DVec2::from_angle(angle) * extent * rng.range(0.75, 1.2);
            (out, width * rng.range(0.01, 0.3))
        }
    };
    let eye = place.extend(ground(place.x, place.y) + above);
    let target = inside(rng);
    let at = target.extend(ground(target.x, target.y));
    if k % 5 == 4 {
        let height = width * rng.range(0.02, 0.4);
        Box::new(OrthographicCamera { position: Some(eye), look_at: Some(at), height, ..Default::default() })
    } else {
        let height_angle = rng.range(0.2, 1.6);
        Box::new(PerspectiveCamera { position: Some(eye), look_at: Some(at), height_angle, ..Default::default() })
    }
}

fn scene(map: &Arc<Image>, camera: &dyn Node, terrain: SeamlessTerrain) -> Scene {
    let mut scene = Scene::new();
    let root = scene.root();
    let camera = scene.insert_boxed(camera.boxed_clone());
    scene.add_child(root, camera).unwrap();
    scene.add(root, BaseColor { rgb: Color::WHITE.into() }).unwrap();
    scene.add(root, Texture2::from_image(Arc::clone(map))).unwrap();
    scene.add(root, terrain).unwrap();
    scene
}

fn draw(headless: &mut Headless, map: &Arc<Image>, camera: &dyn Node, terrain: SeamlessTerrain) -> Picture {
    let action = RenderAction { background: Color::new(1.0, 0.0, 1.0), ..RenderAction::new(SIZE, SIZE) };
    headless.draw(&action.apply(&scene(map, camera, terrain)).unwrap()).unwrap()
}

/// Whether there is background to be seen around a pixel that the four samples of a pixel have missed, such as the sky between a
/// ridge and ground that the near plane cuts: exact picks, 16 × 16 for each pixel.
fn has_a_sliver_of_sky(scene: &Scene, x: u32, y: u32) -> bool {
    const N: u32 = 16;
    let action = RenderAction::new(SIZE, SIZE);
    let near = action.viewpoint(scene).unwrap().near;
    let pick = RayPickAction { surface: Surface::Exact, ..RayPickAction::pixel(x, y, [SIZE, SIZE]) };
    let picker = pick.picker(scene).unwrap();
    let at = |pixel: u32, k: u32| (f64::from(pixel) - 1.0 + (f64::from(k) + 0.5) / f64::from(N)) / f64::from(SIZE);
    (0..3 * N).flat_map(|j| (0..3 * N).map(move |i| (i, j))).any(|(i, j)| {
        let ray = picker.ray_through(at(x, i), at(y, j)).unwrap();
        let seen = |hit: &PickedPoint| {
            matches!(hit.detail, HitDetail::Terrain(detail) if detail.entering) && hit.distance >= near
        };
        !picker.pick(&ray, true).unwrap().iter().any(seen)
    })
}

#[test]
fn no_background_shows_through_the_ground() {
    let eyes = if std::env::var_os("SEAMOUNT_SOAK").is_some() { 45 } else { 8 };
    let mut headless = Headless::new(None).unwrap_or_else(|error| panic!("{error}"));
    for (name, terrain) in maps::nodes() {
        let map = Arc::new(maps::image(name));
        let mut rng = Rng(99);
        let (mut looked_at, mut bad, mut slivers, mut coarser, mut blended) = (0u64, 0u64, 0u64, 0, 0);
        for k in 0..eyes {
            let camera = camera(&mut rng, k, &terrain, &map);
            let full = SeamlessTerrain { detail: DetailMode::Full, ..terrain.clone() };
            let want = draw(&mut headless, &map, &*camera, full.clone());
            let got = draw(&mut headless, &map, &*camera, terrain.clone());
            coarser += u32::from(want.rgba != got.rgba);
            let morphing = SeamlessTerrain { morph: true, ..terrain.clone() };
            let morphed = draw(&mut headless, &map, &*camera, morphing);
            blended += u32::from(morphed.rgba != got.rgba);
            let ground = |x: u32, y: u32| want.pixel(x, y) == Some([255; 3]);
            for (x, y) in (1..SIZE - 1).flat_map(|y| (1..SIZE - 1).map(move |x| (x, y))) {
                if (y - 1..=y + 1).all(|b| (x - 1..=x + 1).all(|a| ground(a, b))) {
                    looked_at += 1;
                    for (picture, how) in [(&got, "plain"), (&morphed, "morphed")] {
                        if picture.pixel(x, y) != Some([255; 3]) {
                            if has_a_sliver_of_sky(&scene(&map, &*camera, full.clone()), x, y) {
                                slivers += 1;
                                continue;
                            }
                            bad += 1;
                            println!(
                                "{name} eye {k}, {how}: {:?} at ({x}, {y}) through {camera:?}",
                                picture.pixel(x, y)
                            );
                        }
                    }
                }
            }
        }
        println!(
            "{name}: {eyes} eyes, {looked_at} pixels of ground, {coarser} pictures differ from the whole mesh, {blended} of those \
             that blend from those that do not, {slivers} pixels with a sliver of sky"
        );
        assert_eq!(bad, 0, "{name}: pixels that are not ground");
        assert!(
            slivers * 1_000_000 <= looked_at,
            "{name}: {slivers} pixels with slivers of sky are too many to be such"
        );
        assert!(looked_at > u64::from(eyes) * 40_000, "{name}: only {looked_at} pixels of ground were looked at");
    }
}
