//! Callback nodes: which actions call them and when, what they may change, and that nothing is answered from memory then.

use std::sync::atomic::{AtomicI64, Ordering};
use std::sync::{Arc, Mutex};

use seamount::action::{ActionKind, State, ViewStatistics};
use seamount::format::{parse, write_scene};
use seamount::node::{Function, Registry};
use seamount::prelude::*;

/// What was called, in order.
type Log = Arc<Mutex<Vec<(ActionKind, Path)>>>;

fn logging(actions: impl Into<List<ActionKind>>, log: &Log) -> Callback {
    let log = Arc::clone(log);
    let note = move |action, path: &Path| log.lock().unwrap().push((action, path.clone()));
    Callback { actions: actions.into(), ..Callback::new(move |cx, _| note(cx.action, cx.path)) }
}

fn take(log: &Log) -> Vec<ActionKind> {
    std::mem::take(&mut *log.lock().unwrap()).into_iter().map(|(action, _)| action).collect()
}

/// A callback, a camera and a cube.
fn scene_with(callback: Callback) -> (Scene, NodeKey) {
    let mut scene = Scene::new();
    let root = scene.root();
    let (position, look_at) = (Some(DVec3::new(0.0, -20.0, 0.0)), Some(DVec3::ZERO));
    scene.add(root, PerspectiveCamera { position, look_at, ..PerspectiveCamera::default() }).unwrap();
    let key = scene.add(root, callback).unwrap();
    scene.add(root, Cube::default()).unwrap();
    (scene, key)
}

/// Asks a scene one question.
type Ask = fn(&Scene);

/// Every action with what it has the node called by: itself once, and the others that it asks on its way.
const ACTIONS: [(Ask, &[ActionKind]); 9] = {
    use ActionKind::*;
    [
        (|s| _ = RenderAction::new(8, 8).apply(s).unwrap(), &[BoundingBox, Render]),
        (|s| _ = RenderAction::new(8, 8).explain(s).unwrap(), &[BoundingBox, Render]),
        (|s| _ = BoundingBoxAction::default().apply(s).unwrap(), &[BoundingBox]),
        (|s| _ = RayPickAction::ray(along_y(0.0)).apply(s).unwrap(), &[BoundingBox, RayPick]),
        (|s| _ = s.height_at(0.0, 0.0).unwrap(), &[BoundingBox, RayPick]),
        (|s| _ = search("Cube").apply(s).unwrap(), &[Search]),
        (|s| _ = MatrixAction::new(search("Cube").apply(s).unwrap().remove(0)).apply(s).unwrap(), &[Search, Matrix]),
        (|s| CallbackAction::new().apply(s).unwrap(), &[BoundingBox, Callback]),
        (|s| _ = PrimitiveCountAction::default().apply(s).unwrap(), &[BoundingBox, PrimitiveCount]),
    ]
};

fn search(kind: &str) -> SearchAction {
    SearchAction { kind: Some(kind.to_owned()), ..SearchAction::default() }
}

fn along_y(x: f64) -> Ray {
    Ray::new(DVec3::new(x, -50.0, 0.3), DVec3::Y).unwrap()
}

#[test]
fn every_action_calls_once_each_time() {
    let log = Log::default();
    let (scene, _) = scene_with(logging(ActionKind::ALL, &log));
    for (number, (ask, expected)) in ACTIONS.iter().enumerate() {
        // The second time nothing has changed, and nothing is answered from memory.
        for _ in 0..2 {
            ask(&scene);
            assert_eq!(take(&log), *expected, "action {number}");
        }
    }
}

#[test]
fn only_the_chosen_actions_call() {
    for chosen in ActionKind::ALL {
        let log = Log::default();
        let (scene, _) = scene_with(logging([chosen], &log));
        for (ask, expected) in ACTIONS {
            ask(&scene);
            let expected: Vec<_> = expected.iter().copied().filter(|&action| action == chosen).collect();
            assert_eq!(take(&log), expected);
        }
    }
    let log = Log::default();
    let (scene, _) = scene_with(logging([], &log));
    ACTIONS.iter().for_each(|(ask, _)| ask(&scene));
    assert_eq!(take(&log), []);
}

#[test]
fn an_action_defined_elsewhere_calls_too() {
    struct Nothing;
    impl seamount::action::walk::Visitor for Nothing {}
    let log = Log::default();
    let (scene, _) = scene_with(logging(ActionKind::ALL, &log));
    seamount::action::walk::walk(&scene, seamount::action::Branches::All, &mut Nothing).unwrap();
    assert_eq!(take(&log), [ActionKind::Other]);
}

#[test]
fn each_occurrence_calls_with_its_path_up_to_the_end_of_the_walk() {
    let log = Log::default();
    let mut scene = Scene::new();
    let root = scene.root();
    let callback = scene.insert(logging([ActionKind::Search], &log));
    for _ in 0..2 {
        let group = scene.add(root, Separator::default()).unwrap();
        scene.add_child(group, callback).unwrap();
        scene.add(group, Cube::default()).unwrap();
    }
    let found = SearchAction { node: Some(callback), ..SearchAction::default() }.apply(&scene).unwrap();
    let called: Vec<Path> = std::mem::take(&mut *log.lock().unwrap()).into_iter().map(|(_, path)| path).collect();
    assert_eq!((called.len(), &called), (2, &found));
    // A search for the first ends before the second comes.
    SearchAction { interest: Interest::First, ..search("Cube") }.apply(&scene).unwrap();
    assert_eq!(take(&log).len(), 1);
    // What a Switch hides is not reached.
    let hidden = scene.add(root, Switch::default()).unwrap();
    scene.add_child(hidden, callback).unwrap();
    search("Cube").apply(&scene).unwrap();
    assert_eq!(take(&log).len(), 2);
}

/// The function moves what follows by a number that the scene knows nothing of: all answers follow it.
#[test]
fn what_the_function_changes_is_never_stale() {
    let shift = Arc::new(AtomicI64::new(0));
    let by = Arc::clone(&shift);
    let moving = move |state: &mut State| state.translate(DVec3::X * by.load(Ordering::Relaxed) as f64);
    let (scene, key) = scene_with(Callback::new(move |_, state| moving(state)));
    let action = RenderAction::new(64, 48);
    let mut view = View::default();
    let picker = RayPickAction::ray(along_y(0.0)).picker(&scene).unwrap();
    for x in [0, 3, 3, -2, 0] {
        shift.store(x, Ordering::Relaxed);
        let x = x as f64;
        let mut plain = Scene::new();
        let root = plain.root();
        let camera = scene.get::<PerspectiveCamera>(scene.children(scene.root())[0]).unwrap().clone();
        plain.add(root, camera).unwrap();
        plain.add(root, Translation { translation: DVec3::X * x }).unwrap();
        plain.add(root, Cube::default()).unwrap();
        let bounds = |scene: &Scene| BoundingBoxAction::default().apply(scene).unwrap();
        assert_eq!(bounds(&scene), bounds(&plain));
        let path = search("Cube").apply(&scene).unwrap().remove(0);
        assert_eq!(MatrixAction::new(path).apply(&scene).unwrap().unwrap().translation.x, x);
        for at in [x - 1.5, x + 0.5] {
            let hit = |hits: Vec<PickedPoint>| hits.first().map(|hit| (hit.point, hit.object_point));
            let expected = hit(RayPickAction::ray(along_y(at)).apply(&plain).unwrap());
            assert_eq!(hit(RayPickAction::ray(along_y(at)).apply(&scene).unwrap()), expected);
            assert_eq!(hit(picker.pick(&along_y(at), false).unwrap()), expected, "a picker made before");
        }
        let drawn = |frame: &Frame| frame.draws[0].clip_from_rel;
        assert_eq!(drawn(action.apply_in(&scene, &mut view).unwrap()), drawn(&action.apply(&plain).unwrap()));
    }
    assert_eq!(view.statistics(), ViewStatistics { frames: 5, walks: 5, selections: 0 });

    // Without the function, or when it is for other actions, a still scene costs nothing again.
    let mut scene = scene;
    scene.edit::<Callback>(key).unwrap().actions = List::from([ActionKind::Search]);
    for _ in 0..3 {
        action.apply_in(&scene, &mut view).unwrap();
    }
    assert_eq!(view.statistics().walks, 6);
}

/// The function comes when the file was read; it is not written.
#[test]
fn a_file_keeps_the_node_without_its_function() {
    let text = "Scene(version: 1, root: Separator(children: [
        Def(\"mover\", Callback(actions: [BoundingBox, RayPick])),
        Cube(),
    ]))";
    let mut scene = parse(text, &Registry::default()).unwrap();
    let key = scene.find("mover").unwrap();
    assert_eq!(scene.get::<Callback>(key).unwrap().function, None);
    let max = |scene: &Scene| BoundingBoxAction::default().apply(scene).unwrap().unwrap().max.z;
    assert_eq!(max(&scene), 1.0);
    scene.edit::<Callback>(key).unwrap().function = Some(Function(Arc::new(|_, state| state.translate(DVec3::Z))));
    assert_eq!(max(&scene), 2.0);
    let written = write_scene(&scene).unwrap();
    assert!(written.contains("Def(\"mover\", Callback(actions: [BoundingBox, RayPick]))"), "{written}");
    let again = parse(&written, &Registry::default()).unwrap();
    assert_eq!((max(&again), write_scene(&again).unwrap()), (1.0, written));
    // Copies share the function.
    let copy = scene.get::<Callback>(key).unwrap().clone();
    assert_eq!(Some(&copy), scene.get::<Callback>(key));
    assert_ne!(copy.function, Callback::new(|_, _| {}).function);

    let wrong = parse(&text.replace("RayPick", "RayPik"), &Registry::default()).unwrap_err().to_string();
    assert!(wrong.contains("2:50") || wrong.contains("RayPik"), "{wrong}");
}

#[test]
fn eight_threads_call_at_once() {
    let log = Log::default();
    let (scene, _) = scene_with(logging(ActionKind::ALL, &log));
    std::thread::scope(|threads| {
        for _ in 0..8 {
            threads.spawn(|| {
                for _ in 0..50 {
                    let hits = RayPickAction::ray(along_y(0.2)).apply(&scene).unwrap();
                    assert!((hits[0].point - DVec3::new(0.2, -1.0, 0.3)).length() < 1e-12);
                    assert_eq!(BoundingBoxAction::default().apply(&scene).unwrap().unwrap().max, DVec3::ONE);
                }
            });
        }
    });
    assert_eq!(take(&log).len(), 8 * 50 * 3);
}
