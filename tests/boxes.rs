//! The box of a terrain contains every vertex drawn, whatever the detail, and at full detail is touched on every face.
#![allow(missing_docs, reason = "a test")]

mod common;

use common::Rng;
use seamount::action::{Geometry, TerrainDraw};
use seamount::prelude::*;
use seamount::terrain::{Parts, generate};

fn scene(columns: u32, rows: u32, terrain: SeamlessTerrain, transform: Transform, eye: DVec3) -> (Scene, NodeKey) {
    let land = generate(columns.max(rows), 9).unwrap();
    let pixels =
        (0..rows).flat_map(|r| (0..columns).map(move |c| (c, r))).map(|(c, r)| land.raw(c, r) as u16).collect();
    let image = Image::new(columns, rows, Pixels::Gray16(pixels)).unwrap();
    let mut scene = Scene::new();
    let root = scene.root();
    let camera =
        PerspectiveCamera { position: Some(eye), look_at: Some(eye - DVec3::Z), ..PerspectiveCamera::default() };
    scene.add(root, camera).unwrap();
    scene.add(root, transform).unwrap();
    scene.add(root, Texture2::from_image(image)).unwrap();
    let key = scene.add(root, terrain).unwrap();
    (scene, key)
}

/// World coordinates of all vertices that a frame draws.
fn vertices(draw: &TerrainDraw, scene: &Scene, key: NodeKey, transform: &Transform) -> Vec<DVec3> {
    let parts: &Parts = &draw.parts;
    let frame = scene.get::<SeamlessTerrain>(key).unwrap().frame(&draw.heights);
    let cells = draw.heights.cells();
    let mut found = Vec::new();
    for (part, range) in draw.instances.ranges() {
        for instance in &draw.instances.data()[range.start as usize..range.end as usize] {
            let triangles = parts.range(*part);
            for triangle in &parts.all_triangles()[triangles.start as usize..triangles.end as usize] {
                for [u, v] in triangle {
                    let c = (instance.origin[0] + instance.step * u32::from(*u)).min(cells[0]);
                    let r = (instance.origin[1] + instance.step * u32::from(*v)).min(cells[1]);
                    let lattice = DVec3::new(c.into(), r.into(), draw.heights.raw(c, r));
                    found.push(transform.affine().transform_point3(frame.local(lattice)));
                }
            }
        }
    }
    found
}

#[test]
fn the_box_contains_every_vertex_and_is_tight_at_full_detail() {
    let mut rng = Rng(5);
    for (columns, rows) in [(2, 2), (3, 5), (64, 65), (130, 77), (200, 200)] {
        for precision in [0.5, 2.0, 1e9] {
            let full = precision == 1e9;
            let transform = Transform {
                translation: DVec3::new(rng.range(-1e3, 1e3), 2.0, -7.0),
                scale_factor: DVec3::new(3.0, -0.5, 2.0),
                rotation: if full { AxisAngle::IDENTITY } else { AxisAngle::new(DVec3::new(1.0, 2.0, 3.0), 0.7) },
                ..Transform::default()
            };
            let terrain = SeamlessTerrain {
                scale: 100.0,
                max_height: 20.0,
                detail: DetailMode::Precision(precision),
                resolutions: (4, 2),
                culling: false,
                ..SeamlessTerrain::default()
            };
            let eye = DVec3::new(rng.range(0.0, 200.0), rng.range(-50.0, 50.0), 30.0);
            let (scene, key) = scene(columns, rows, terrain, transform.clone(), eye);
            let bounds = BoundingBoxAction::default().apply(&scene).unwrap().unwrap();
            let frame = RenderAction::new(64, 64).apply(&scene).unwrap();
            let Geometry::Terrain(draw) = &frame.draws[0].geometry else { panic!("a terrain") };
            let points = vertices(draw, &scene, key, &transform);
            // The vertices come from products of one order, the box from another: they differ by rounding.
            let slack = 1e-9;
            assert!(
                points
                    .iter()
                    .all(|p| (*p - bounds.min).min_element() > -slack && (bounds.max - *p).min_element() > -slack)
            );
            if full {
                let drawn = Aabb::of(points).unwrap();
                assert!((drawn.min - bounds.min).abs().max_element() < slack, "{drawn:?} {bounds:?}");
                assert!((drawn.max - bounds.max).abs().max_element() < slack, "{drawn:?} {bounds:?}");
                let [cu, cv] = draw.heights.cells().map(u64::from);
                // Two triangles per cell, and the flattened ones beyond the border.
                assert!(frame.statistics.triangles >= 2 * cu * cv);
            }
        }
    }
}

#[test]
fn a_transformed_empty_scene_has_no_box() {
    let mut scene = Scene::new();
    let root = scene.root();
    scene.add(root, Transform { translation: DVec3::ONE, ..Transform::default() }).unwrap();
    assert_eq!(BoundingBoxAction::default().apply(&scene).unwrap(), None);
}
