//! What a View remembers: a still camera costs nothing, nothing stale is shown, and detail can be looked at from elsewhere.
#![allow(missing_docs, reason = "a test")]

mod common;

use std::sync::{Arc, mpsc};

use common::Rng;
use seamount::action::{ActionError, Geometry, ShapeError, TerrainDraw, ViewStatistics};
use seamount::node::HitDetail;
use seamount::prelude::*;
use seamount::terrain::{Instance, PatchId, generate};

struct Land {
    scene: Scene,
    camera: NodeKey,
    material: NodeKey,
    terrain: NodeKey,
}

fn camera(eye: DVec3) -> PerspectiveCamera {
    let look_at = Some(DVec3::new(50.0, 50.0, 0.0));
    PerspectiveCamera { position: Some(eye), look_at, ..PerspectiveCamera::default() }
}

fn land() -> Land {
    let field = generate(257, 3).unwrap();
    let pixels = (0..257).flat_map(|r| (0..257).map(move |c| (c, r))).map(|(c, r)| field.raw(c, r) as u16).collect();
    let mut scene = Scene::new();
    let root = scene.root();
    let eye = scene.add(root, camera(DVec3::new(20.0, -10.0, 20.0))).unwrap();
    let material = scene.add(root, Material::default()).unwrap();
    scene.add(root, Texture2::from_image(Image::new(257, 257, Pixels::Gray16(pixels)).unwrap())).unwrap();
    let node = SeamlessTerrain {
        scale: 100.0,
        max_height: 10.0,
        detail: DetailMode::PixelError(2.0),
        resolutions: (4, 2),
        ..SeamlessTerrain::default()
    };
    let terrain = scene.add(root, node).unwrap();
    Land { scene, camera: eye, material, terrain }
}

impl Land {
    fn move_to(&mut self, eye: DVec3) {
        *self.scene.edit::<PerspectiveCamera>(self.camera).unwrap() = camera(eye);
    }
}

fn drawn(frame: &Frame) -> &TerrainDraw {
    let Geometry::Terrain(draw) = &frame.draws[0].geometry else { panic!("a terrain") };
    draw
}

/// The instances of a frame, with the bits of their weights if they have any, in an order that does not depend on how they
/// were found.
fn instances(frame: &Frame) -> Vec<(usize, [u32; 2], u32, [u32; 5])> {
    let instances = &drawn(frame).instances;
    let mut found = Vec::new();
    for (part, range) in instances.ranges() {
        for k in range.start as usize..range.end as usize {
            let Instance { origin, step } = instances.data()[k];
            let weights = instances.weights().get(k).map_or([0; 5], |w| {
                let [n, e, s, west] = w.sides.map(f32::to_bits);
                [n, e, s, west, w.inside.to_bits()]
            });
            found.push((*part, origin, step, weights));
        }
    }
    found.sort_unstable();
    found
}

fn eyes() -> impl Iterator<Item = DVec3> {
    let mut rng = Rng(11);
    std::iter::repeat_with(move || DVec3::new(rng.range(-20.0, 120.0), rng.range(-20.0, 120.0), rng.range(9.0, 60.0)))
}

#[test]
fn a_still_camera_costs_nothing() {
    let land = land();
    let mut view = View::default();
    let action = RenderAction::new(320, 200);
    let first = Arc::clone(&drawn(action.apply_in(&land.scene, &mut view).unwrap()).instances);
    for _ in 0..10 {
        let frame = action.apply_in(&land.scene, &mut view).unwrap();
        assert!(Arc::ptr_eq(&drawn(frame).instances, &first));
    }
    assert_eq!(view.statistics(), ViewStatistics { frames: 11, walks: 1, selections: 1 });
}

#[test]
fn detail_is_chosen_again_when_camera_viewport_or_node_changed_and_only_then() {
    let mut land = land();
    let mut view = View::default();
    let mut action = RenderAction::new(320, 200);
    let mut made = |land: &Land, action: &RenderAction| {
        let before = view.statistics();
        let frame = instances(action.apply_in(&land.scene, &mut view).unwrap());
        assert_eq!(frame, instances(&action.apply(&land.scene).unwrap()), "not what a fresh view shows");
        let after = view.statistics();
        (after.walks - before.walks, after.selections - before.selections)
    };
    assert_eq!(made(&land, &action), (1, 1));
    assert_eq!(made(&land, &action), (0, 0));
    // The scene is walked for the new colour, but the same patches are drawn.
    land.scene.edit::<Material>(land.material).unwrap().shininess = List::from(0.5);
    assert_eq!(made(&land, &action), (1, 0));
    action.background = Color::WHITE;
    assert_eq!(made(&land, &action), (1, 0));
    land.move_to(DVec3::new(20.0, -10.0, 20.5));
    assert_eq!(made(&land, &action), (1, 1));
    action.size = [320, 201];
    assert_eq!(made(&land, &action), (1, 1));
    land.scene.edit::<SeamlessTerrain>(land.terrain).unwrap().detail = DetailMode::PixelError(1.0);
    assert_eq!(made(&land, &action), (1, 1));
    land.scene.edit::<SeamlessTerrain>(land.terrain).unwrap().resolutions = (2, 3);
    assert_eq!(made(&land, &action), (1, 1));
    land.scene.edit::<SeamlessTerrain>(land.terrain).unwrap().culling = false;
    assert_eq!(made(&land, &action), (1, 0));
    // Files may have changed: all is looked at again.
    land.scene.resources().forget();
    assert_eq!(made(&land, &action), (1, 1));
    // Another scene of the same version is another scene.
    let other = self::land();
    let mut view = View::default();
    action.apply_in(&self::land().scene, &mut view).unwrap();
    action.apply_in(&other.scene, &mut view).unwrap();
    assert_eq!(view.statistics().walks, 2);
}

/// The memory of old frames is used again, but never that of a frame which is still there.
#[test]
fn frames_that_are_kept_do_not_change() {
    for morph in [false, true] {
        frames_that_are_kept(morph);
    }
}

fn frames_that_are_kept(morph: bool) {
    let mut land = land();
    land.scene.edit::<SeamlessTerrain>(land.terrain).unwrap().morph = morph;
    let mut view = View::default();
    let action = RenderAction::new(320, 200);
    let mut kept: Vec<(Frame, Vec<_>)> = Vec::new();
    for eye in eyes().take(40) {
        land.move_to(eye);
        let frame = action.apply_in(&land.scene, &mut view).unwrap().clone();
        let expected = instances(&action.apply(&land.scene).unwrap());
        kept.push((frame, expected));
        if kept.len() > 7 {
            kept.swap_remove(3);
        }
        for (frame, expected) in &kept {
            assert_eq!(instances(frame), *expected);
        }
    }
}

/// A View keeps what belongs to an occurrence with it when the graph changes around it.
#[test]
fn shapes_that_come_and_go_do_not_mix_up_their_histories() {
    let mut land = land();
    let root = land.scene.root();
    let mut view = View::default();
    let action = RenderAction::new(320, 200);
    action.apply_in(&land.scene, &mut view).unwrap();
    // The same node a second time, then a cube before both, then the first occurrence goes.
    land.scene.add_child(root, land.terrain).unwrap();
    let frame = action.apply_in(&land.scene, &mut view).unwrap();
    assert_eq!((frame.draws.len(), view.statistics().selections), (2, 2));
    let cube = land.scene.insert(Cube::default());
    land.scene.insert_child(root, 1, cube).unwrap();
    let frame = action.apply_in(&land.scene, &mut view).unwrap();
    assert_eq!(frame.draws.len(), 3);
    land.scene.remove_child(root, 4).unwrap();
    let frame = action.apply_in(&land.scene, &mut view).unwrap();
    let fresh = action.apply(&land.scene).unwrap();
    assert_eq!((frame.draws.len(), fresh.draws.len()), (2, 2));
    assert_eq!(frame.statistics.triangles, fresh.statistics.triangles);
}

/// Where a ray down the middle of each of some places of the map meets which patch.
fn picked(pick: impl Fn(&Ray) -> Vec<PickedPoint>) -> Vec<PatchId> {
    let mut found = Vec::new();
    for k in 0..100 {
        let at = DVec3::new(f64::from(k % 10) * 9.9 + 0.33, f64::from(k / 10) * 9.9 + 0.77, 100.0);
        let hits = pick(&Ray::new(at, DVec3::NEG_Z).unwrap());
        let HitDetail::Terrain(detail) = hits[0].detail else { panic!("a terrain") };
        found.push(detail.patch);
    }
    found
}

#[test]
fn detail_follows_the_camera_that_is_named() {
    let modes = [DetailMode::PixelError(1.0), DetailMode::Precision(3.0)];
    for (mode, morph) in modes.into_iter().flat_map(|mode| [(mode, false), (mode, true)]) {
        let mut land = land();
        let root = land.scene.root();
        {
            let mut terrain = land.scene.edit::<SeamlessTerrain>(land.terrain).unwrap();
            (terrain.culling, terrain.detail, terrain.morph) = (false, mode, morph);
        }
        let low = land.scene.insert(camera(DVec3::new(90.0, 95.0, 12.0)));
        land.scene.insert_child(root, 1, low).unwrap();
        land.scene.set_name(low, "low").unwrap();
        let size = [320, 200];
        let through = |name: &str| RenderAction { camera: Some(name.to_owned()), ..RenderAction::new(320, 200) };
        let pick = |land: &Land, name: Option<&str>| {
            let action = RayPickAction { camera: name.map(str::to_owned), ..RayPickAction::pixel(0, 0, size) };
            let picker = action.picker(&land.scene).unwrap();
            picked(|ray| picker.pick(ray, false).unwrap())
        };

        let own = instances(&RenderAction::new(320, 200).apply(&land.scene).unwrap());
        let through_low = instances(&through("low").apply(&land.scene).unwrap());
        assert_ne!(own, through_low);
        let picked_through_low = pick(&land, Some("low"));
        assert_ne!(pick(&land, None), picked_through_low);

        land.scene.edit::<SeamlessTerrain>(land.terrain).unwrap().lod_camera = Some("low".to_owned());
        let frame = RenderAction::new(320, 200).apply(&land.scene).unwrap();
        assert_eq!(instances(&frame), through_low);
        assert_eq!(pick(&land, None), picked_through_low);
        // Only the detail follows it: the picture is taken from where it was.
        assert_eq!(RenderAction::new(320, 200).viewpoint(&land.scene).unwrap().eye, DVec3::new(20.0, -10.0, 20.0));

        // In a view the detail stays while the camera that looks moves, and changes with the other one.
        let mut view = View::default();
        let action = RenderAction::new(320, 200);
        for eye in eyes().take(5) {
            land.move_to(eye);
            assert_eq!(instances(action.apply_in(&land.scene, &mut view).unwrap()), through_low);
        }
        assert_eq!((view.statistics().walks, view.statistics().selections), (5, 1));
        *land.scene.edit::<PerspectiveCamera>(low).unwrap() = camera(DVec3::new(10.0, 95.0, 12.0));
        assert_ne!(instances(action.apply_in(&land.scene, &mut view).unwrap()), through_low);
        assert_eq!(view.statistics().selections, 2);
    }
}

#[test]
fn a_camera_that_is_not_there_is_named_with_those_that_are() {
    let mut land = land();
    land.scene.set_name(land.camera, "high").unwrap();
    land.scene.edit::<SeamlessTerrain>(land.terrain).unwrap().lod_camera = Some("hihg".to_owned());
    let drawing = RenderAction::new(32, 20).apply(&land.scene).unwrap_err();
    let picking = RayPickAction::pixel(16, 10, [32, 20]).apply(&land.scene).unwrap_err();
    for error in [drawing, picking] {
        let ActionError::Shape { error: ShapeError::LodCamera(inner), .. } = &error else { panic!("{error}") };
        assert!(matches!(inner.as_ref(), ActionError::UnknownCamera { name, .. } if name == "hihg"));
        let message = error.to_string();
        assert!(message.contains("SeamlessTerrain") && message.contains("\"hihg\""), "{message}");
        assert!(message.contains("the cameras' names are high"), "{message}");
    }
    // The box does not ask how it is drawn.
    assert!(BoundingBoxAction::default().apply(&land.scene).unwrap().is_some());
}

#[test]
fn a_frozen_view_keeps_its_detail() {
    for morph in [false, true] {
        a_frozen_view(morph);
    }
}

fn a_frozen_view(morph: bool) {
    let mut land = land();
    {
        let mut terrain = land.scene.edit::<SeamlessTerrain>(land.terrain).unwrap();
        (terrain.culling, terrain.morph) = (false, morph);
    }
    let action = RenderAction::new(320, 200);
    let pick = RayPickAction::pixel(0, 0, [320, 200]);
    let mut view = View::default();
    let kept = instances(action.apply_in(&land.scene, &mut view).unwrap());
    let picker = pick.picker(&land.scene).unwrap();
    let kept_picks = picked(|ray| picker.pick(ray, false).unwrap());
    view.freeze = true;
    let mut differs = 0;
    for eye in eyes().take(8) {
        land.move_to(eye);
        assert_eq!(instances(action.apply_in(&land.scene, &mut view).unwrap()), kept);
        let fresh = instances(&action.apply(&land.scene).unwrap());
        differs += u32::from(fresh != kept);
        // What is picked in the view is what it shows; elsewhere it is what would be shown.
        let picker = pick.picker_in(&land.scene, &view).unwrap();
        assert_eq!(picked(|ray| picker.pick(ray, false).unwrap()), kept_picks);
        let free = pick.picker(&land.scene).unwrap();
        assert_eq!(picked(|ray| free.pick(ray, false).unwrap()) == kept_picks, fresh == kept);
    }
    assert!(differs > 4, "the eyes see the same detail: nothing is tested");
    assert_eq!(view.statistics().selections, 1);
    // What is outside the present view is left out all the same.
    land.scene.edit::<SeamlessTerrain>(land.terrain).unwrap().culling = true;
    let frame = action.apply_in(&land.scene, &mut view).unwrap();
    assert!(frame.statistics.patches_culled > 0);
    // A terrain that this view has not drawn before has no detail to keep: it gets it once.
    let mut fresh = View::default();
    fresh.freeze = true;
    action.apply_in(&land.scene, &mut fresh).unwrap();
    assert_eq!(fresh.statistics().selections, 1);

    view.freeze = false;
    let thawed = instances(action.apply_in(&land.scene, &mut view).unwrap());
    assert_eq!(thawed, instances(&action.apply(&land.scene).unwrap()));
    assert_eq!(view.statistics().selections, 2);
}

/// One thread moves the camera and chooses detail, the other has the frames: they arrive whole and in order.
#[test]
fn detail_can_be_chosen_in_another_thread() {
    const FRAMES: usize = 30;
    let (send, receive) = mpsc::sync_channel::<Frame>(1);
    std::thread::scope(|threads| {
        threads.spawn(move || {
            let mut land = land();
            let mut view = View::default();
            for eye in eyes().take(FRAMES) {
                land.move_to(eye);
                let frame = RenderAction::new(320, 200).apply_in(&land.scene, &mut view).unwrap();
                send.send(frame.clone()).unwrap();
            }
            assert_eq!(view.statistics().selections, FRAMES as u64);
        });
        let mut land = land();
        for eye in eyes().take(FRAMES) {
            land.move_to(eye);
            let frame = receive.recv().unwrap();
            assert_eq!(instances(&frame), instances(&RenderAction::new(320, 200).apply(&land.scene).unwrap()));
        }
    });
}
