//! Clip planes: what is drawn is what is picked, for every kind of shape, and nothing is left of what is cut off.
#![cfg(feature = "render")]

mod common;

use std::sync::Arc;

use common::Rng;
use common::gpu::{LinearPicture, linear};
use seamount::format::parse;
use seamount::node::Registry;
use seamount::prelude::*;

const SIZE: [u32; 2] = [96, 72];

/// Four shapes beside each other, each in a colour of its own: red, green, blue, white.
fn shapes(scene: &mut Scene, group: NodeKey) {
    let colors = [Color::new(1.0, 0.0, 0.0), Color::new(0.0, 1.0, 0.0), Color::new(0.0, 0.0, 1.0), Color::WHITE];
    let samples: Vec<u16> = (0..17 * 17u32).map(|i| (i * 7919 % 40_000) as u16).collect();
    for (k, color) in colors.into_iter().enumerate() {
        let place = scene.add(group, Separator::default()).unwrap();
        scene.add(place, BaseColor { rgb: color.into() }).unwrap();
        let corner = DVec3::new(if k % 2 == 0 { -1.3 } else { 1.3 }, if k < 2 { -1.3 } else { 1.3 }, 0.0);
        scene.add(place, Translation { translation: corner }).unwrap();
        match k {
            0 => {
                scene.add(place, Cube::default()).unwrap();
            }
            1 => {
                scene.add(place, Complexity { value: 1.0, ..Complexity::default() }).unwrap();
                scene.add(place, Sphere { radius: 1.2 }).unwrap();
            }
            2 => {
                let points = [(-1.0, -1.0, 0.0), (1.0, -1.0, 0.5), (1.0, 1.0, -0.5), (-1.0, 1.0, 1.0), (0.0, 0.0, 1.5)];
                scene.add(place, Coordinate3 { point: points.into_iter().map(DVec3::from).collect() }).unwrap();
                let coord_index = List::from([0, 1, 4, -1, 1, 2, 4, -1, 2, 3, 4, -1, 3, 0, 4, -1, 0, 1, 2, 3]);
                scene.add(place, IndexedFaceSet { coord_index, ..IndexedFaceSet::default() }).unwrap();
            }
            _ => {
                scene.add(place, Translation { translation: DVec3::new(-1.2, -1.2, 0.0) }).unwrap();
                let image = Image::new(17, 17, Pixels::Gray16(samples.clone())).unwrap();
                scene.add(place, Texture2::from_image(Arc::new(image))).unwrap();
                let land =
                    SeamlessTerrain { scale: 2.4, max_height: 1.0, detail: DetailMode::Full, ..Default::default() };
                scene.add(place, land).unwrap();
            }
        }
    }
}

fn camera(scene: &mut Scene, k: usize) {
    let root = scene.root();
    let (position, look_at) = (Some(DVec3::new(3.0, -6.0, 5.0)), Some(DVec3::new(0.0, 0.2, 0.0)));
    let camera: Box<dyn Node> = match k % 2 {
        0 => Box::new(PerspectiveCamera { position, look_at, ..Default::default() }),
        _ => Box::new(OrthographicCamera { position, look_at, height: 6.5, ..Default::default() }),
    };
    let camera = scene.insert_boxed(camera);
    scene.add_child(root, camera).unwrap();
    scene.add(root, LightModel { model: LightingModel::BaseColor }).unwrap();
}

fn color_of(scene: &Scene, hit: &PickedPoint) -> [f32; 3] {
    let group = hit.path.nodes().nth_back(1).unwrap();
    let color = scene.children(group).iter().find_map(|&key| scene.get::<BaseColor>(key)).unwrap().rgb[0];
    color.linear().to_array()
}

/// Compares a picture with picks through the centres of its pixels; returns how many showed something. On an edge, where a
/// pick beside the centre meets another shape, rounding decides, and how finely a sphere is drawn.
fn compare(scene: &Scene, picture: &LinearPicture, what: &str) -> u32 {
    let action = RayPickAction { surface: Surface::Drawn, ..RayPickAction::pixel(0, 0, SIZE) };
    let picker = action.picker(scene).unwrap();
    let mut shown = 0;
    for (x, y) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))) {
        let at = |dx: f64, dy: f64| {
            let [w, h] = SIZE.map(f64::from);
            let place = [(f64::from(x) + dx) / w, (f64::from(y) + dy) / h];
            picker.pick_through(place[0], place[1], false).unwrap().into_iter().next()
        };
        let hit = at(0.5, 0.5);
        let beside = [(0.3, 0.5), (0.7, 0.5), (0.5, 0.3), (0.5, 0.7)].map(|(dx, dy)| at(dx, dy));
        let path = |hit: &Option<PickedPoint>| hit.as_ref().map(|hit| hit.path.clone());
        if beside.iter().any(|other| path(other) != path(&hit)) {
            continue;
        }
        let wanted = hit.as_ref().map_or([0.0; 3], |hit| color_of(scene, hit));
        let got = picture.at(x, y);
        assert_eq!(got[..3], wanted, "{what} at ({x}, {y}): {hit:?}");
        shown += u32::from(hit.is_some());
    }
    shown
}

#[test]
fn what_is_drawn_is_what_is_picked() {
    let mut rng = Rng(8);
    for k in 0..10 {
        let mut scene = Scene::with_root(Separator::default());
        camera(&mut scene, k);
        let root = scene.root();
        // None to eight planes, below a transform that the shapes are not below.
        let group = scene.add(root, Separator::default()).unwrap();
        let planes = [0, 1, 1, 2, 3, 6, 1, 2, 4, 8][k];
        let place = scene.add(group, Group::default()).unwrap();
        let turned = Transform {
            rotation: AxisAngle::new(DVec3::new(1.0, 2.0, 3.0), 0.4),
            scale_factor: DVec3::new(1.0, 2.0, -1.0),
            ..Transform::default()
        };
        let kept = scene.add(place, TransformSeparator::default()).unwrap();
        scene.add(kept, turned).unwrap();
        for _ in 0..planes {
            let normal = DVec3::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0), rng.range(-1.0, 1.0));
            // Most of the middle stays.
            let distance = rng.range(-1.0, if planes > 3 { -0.7 } else { 0.4 });
            scene.add(kept, ClipPlane { plane: Plane { normal, distance }, on: true }).unwrap();
            scene.add(kept, ClipPlane { plane: Plane { normal: -normal, distance: 9.0 }, on: false }).unwrap();
        }
        shapes(&mut scene, group);
        let frame = RenderAction::new(SIZE[0], SIZE[1]).apply(&scene).unwrap();
        assert!(frame.draws.iter().all(|draw| usize::from(draw.effects.clip_planes) == planes));
        let shown = compare(&scene, &linear().draw(&frame), &format!("{planes} planes, camera {k}"));
        assert!(shown > 100, "{shown} pixels with {planes} planes");
    }
}

/// Of a transparent shape the depth is drawn first: what is cut off must not hide what is behind.
#[test]
fn a_cut_off_part_of_something_transparent_hides_nothing() {
    let text = "Scene(version: 1, root: Separator(children: [
        OrthographicCamera(position: (0.0, 0.0, 10.0), look_at: (0.0, 0.0, 0.0), height: 4.0),
        LightModel(model: BaseColor),
        Separator(children: [
            ClipPlane(plane: (1.0, 0.0, 0.0, 0.0)), Material(diffuse_color: (1.0, 0.0, 0.0), transparency: 0.5),
            Translation(translation: (0.0, 0.0, 3.0)), Cube(),
        ]),
        Separator(children: [Material(diffuse_color: (0.0, 0.0, 1.0), transparency: 0.5), Cube()]),
    ]))";
    let scene = parse(text, &Registry::default()).unwrap_or_else(|e| panic!("{e}"));
    let picture = linear().draw(&RenderAction::new(40, 40).apply(&scene).unwrap());
    let close = |got: [f32; 4], want: [f32; 3]| got.iter().zip(want).all(|(g, w)| (g - w).abs() < 2e-3);
    assert!(close(picture.at(15, 20), [0.0, 0.0, 0.5]), "{:?}", picture.at(15, 20));
    assert!(close(picture.at(25, 20), [0.5, 0.0, 0.25]), "{:?}", picture.at(25, 20));
}

/// A solid that says so is hollow where it is cut open: nobody sees its faces from behind.
#[test]
fn a_solid_that_is_cut_open_shows_no_inside() {
    let mut scene = Scene::with_root(Separator::default());
    let root = scene.root();
    let (position, look_at) = (Some(DVec3::Z * 10.0), Some(DVec3::ZERO));
    scene.add(root, OrthographicCamera { position, look_at, height: 4.0, ..Default::default() }).unwrap();
    let hints = scene.add(root, ShapeHints::default()).unwrap();
    scene.add(root, ClipPlane { plane: Plane { normal: DVec3::NEG_Z, distance: 0.0 }, on: true }).unwrap();
    scene.add(root, Cube::default()).unwrap();
    let shown = |scene: &Scene| linear().draw(&RenderAction::new(40, 40).apply(scene).unwrap()).at(20, 20)[0] > 0.0;
    assert!(shown(&scene), "the bottom, from inside");
    {
        let mut hints = scene.edit::<ShapeHints>(hints).unwrap();
        (hints.vertex_ordering, hints.shape_type) = (VertexOrdering::Counterclockwise, ShapeType::Solid);
    }
    assert!(!shown(&scene));
}
