//! Events: handed round in random scenes against a plain recursion, with handled, grabbing, paths and lazy picks.

mod common;

use std::cell::Cell;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex};

use common::Rng;
use seamount::action::{
    ActionKind, ButtonState, Event, EventKind, EventType, HandleEventAction, Key, MouseButton, ShapeError,
};
use seamount::format::{parse, write_scene};
use seamount::node::Registry;
use seamount::prelude::*;

const SIZE: [u32; 2] = [80, 60];

/// What a function does once it has noted that it was called.
#[derive(Debug, Clone, Copy)]
struct Script {
    handles: bool,
    grabs: bool,
    releases: bool,
    /// Looks at what is under the pointer.
    looks: bool,
    /// Asks for all that is there.
    looks_at_all: bool,
    /// Only events with a time that this divides.
    every: u32,
}

impl Script {
    fn random(rng: &mut Rng) -> Self {
        let every = 1 + rng.below(3);
        let mut one_in = |n| rng.below(n) == 0;
        let (handles, grabs, releases) = (one_in(3), one_in(4), one_in(4));
        Self { handles, grabs, releases, looks: one_in(3), looks_at_all: one_in(5), every }
    }

    fn acts(&self, event: &Event) -> bool {
        (event.time as u32).is_multiple_of(self.every)
    }
}

/// Which node and function was called, at which place, and what it saw under the pointer.
type Call = (usize, usize, Path, Option<Option<DVec3>>);
type Log = Arc<Mutex<Vec<Call>>>;

/// An [`EventCallback`] as the reference knows it.
#[derive(Debug, Clone)]
struct Plan {
    key: NodeKey,
    path: Option<Path>,
    functions: Vec<(EventType, Script)>,
}

const TYPES: [EventType; 7] = [
    EventType::Any,
    EventType::Button,
    EventType::Key,
    EventType::MouseButton,
    EventType::MouseWheel,
    EventType::Location,
    EventType::Motion,
];

fn event(rng: &mut Rng, time: u32) -> Event {
    let state = if rng.below(2) == 0 { ButtonState::Pressed } else { ButtonState::Released };
    let kind = match rng.below(5) {
        0 => EventKind::Key { key: Key::Character('a'), state },
        1 => EventKind::MouseButton { button: MouseButton::Left, state },
        2 => EventKind::MouseWheel { delta: DVec2::Y },
        3 => EventKind::Location,
        _ => EventKind::Motion { translation: DVec3::X, rotation: DQuat::IDENTITY },
    };
    let position = DVec2::new(rng.range(0.0, 80.0), rng.range(0.0, 60.0));
    Event { time: f64::from(time), ..Event::new(kind, position) }
}

/// Written again for the reference.
fn is_of(events: EventType, kind: &EventKind) -> bool {
    let own = match kind {
        EventKind::Key { .. } => EventType::Key,
        EventKind::MouseButton { .. } => EventType::MouseButton,
        EventKind::MouseWheel { .. } => EventType::MouseWheel,
        EventKind::Location => EventType::Location,
        EventKind::Motion { .. } => EventType::Motion,
        _ => panic!("a new kind of event"),
    };
    let button = own == EventType::Key || own == EventType::MouseButton;
    events == EventType::Any || events == own || (events == EventType::Button && button)
}

/// A random scene with cubes in front of a camera, groups of all kinds, sharing, and nodes that wait for events.
struct World {
    scene: Scene,
    plans: Vec<Plan>,
    log: Log,
    /// How often the scene was picked.
    picks: Arc<AtomicU32>,
}

impl World {
    fn new(rng: &mut Rng) -> Self {
        let mut scene = Scene::new();
        let root = scene.root();
        let camera = OrthographicCamera {
            position: Some(DVec3::Z * 50.0),
            look_at: Some(DVec3::ZERO),
            height: 12.0,
            ..OrthographicCamera::default()
        };
        scene.add(root, camera).unwrap();
        let picks = Arc::new(AtomicU32::new(0));
        let count = Arc::clone(&picks);
        let counter = Callback {
            actions: List::from([ActionKind::RayPick]),
            ..Callback::new(move |_, _| _ = count.fetch_add(1, Ordering::Relaxed))
        };
        scene.add(root, counter).unwrap();
        let log = Log::default();
        let (mut groups, mut plans, mut keys) = (vec![root], Vec::<Plan>::new(), Vec::new());
        for _ in 0..30 {
            let parent = groups[rng.below(groups.len() as u32) as usize];
            let at = DVec3::new(rng.range(-6.0, 6.0), rng.range(-5.0, 5.0), rng.range(-5.0, 5.0));
            let node: Box<dyn Node> = match rng.below(12) {
                0 => Box::new(Group::default()),
                1 => Box::new(Separator::default()),
                2 => Box::new(Switch { which_child: rng.below(5) as i32 - 3 }),
                3 => Box::new(Lod { range: List::from([40.0]), ..Lod::default() }),
                4 => Box::new(Array { num_elements1: 2, separation1: at * 0.5, ..Array::default() }),
                5 | 6 => Box::new(Translation { translation: at }),
                7 | 8 => Box::new(Cube { width: 4.0, height: 3.0, ..Cube::default() }),
                9 if !keys.is_empty() => {
                    // Sharing; refused where it would make a cycle.
                    let child = keys[rng.below(keys.len() as u32) as usize];
                    let _ = scene.add_child(parent, child);
                    continue;
                }
                _ => {
                    let number = plans.len();
                    let functions: Vec<(EventType, Script)> =
                        (0..rng.below(3)).map(|_| (TYPES[rng.below(7) as usize], Script::random(rng))).collect();
                    let mut node = EventCallback::default();
                    for (index, &(events, script)) in functions.iter().enumerate() {
                        let log = Arc::clone(&log);
                        node = node.and(events, move |cx| {
                            if !script.acts(cx.event) {
                                return Ok(());
                            }
                            let all = script.looks_at_all.then(|| cx.picked_all()).transpose()?;
                            let all = all.map(|hits| hits.first().map(|hit| hit.point));
                            let seen = script.looks.then(|| cx.picked()).transpose()?;
                            let seen = seen.map(|hit| hit.map(|hit| hit.point));
                            assert!(all.is_none() || seen.is_none() || all == seen);
                            log.lock().unwrap().push((number, index, cx.path().clone(), seen.or(all)));
                            if script.handles {
                                cx.set_handled();
                            }
                            if script.grabs {
                                cx.grab();
                            }
                            if script.releases {
                                cx.release();
                            }
                            Ok(())
                        });
                    }
                    let key = scene.add(parent, node).unwrap();
                    plans.push(Plan { key, path: None, functions });
                    keys.push(key);
                    continue;
                }
            };
            let key = scene.insert_boxed(node);
            scene.add_child(parent, key).unwrap();
            if scene.node(key).unwrap().info().children.is_some() {
                groups.push(key);
            }
            keys.push(key);
        }
        // Some wait for a click on a part of the way to a cube.
        let cubes = SearchAction { kind: Some("Cube".into()), ..SearchAction::default() }.apply(&scene).unwrap();
        for plan in &mut plans {
            if cubes.is_empty() || rng.below(2) == 0 {
                continue;
            }
            let cube = &cubes[rng.below(cubes.len() as u32) as usize];
            let steps: Vec<(NodeKey, usize)> = cube.nodes().zip([0].into_iter().chain(cube.indices())).collect();
            let from = rng.below(steps.len() as u32) as usize;
            let to = from + 1 + rng.below((steps.len() - from) as u32) as usize;
            let mut part = Path::new(steps[from].0);
            steps[from + 1..to].iter().for_each(|&(key, index)| part.push(key, index));
            scene.edit::<EventCallback>(plan.key).unwrap().path = Some(part.clone());
            plan.path = Some(part);
        }
        Self { scene, plans, log, picks }
    }
}

/// All places of nodes that wait for events in the order of the walk, by plain recursion.
fn places(scene: &Scene, plans: &[Plan]) -> Vec<(usize, Path)> {
    fn visit(
        scene: &Scene,
        key: NodeKey,
        path: &Path,
        switch: &Cell<i32>,
        plans: &[Plan],
        out: &mut Vec<(usize, Path)>,
    ) {
        if let Some(number) = plans.iter().position(|plan| plan.key == key) {
            out.push((number, path.clone()));
        }
        let before = switch.get();
        let (mut copies, mut only) = (1, None);
        if let Some(s) = scene.get::<Switch>(key) {
            let count = scene.children(key).len() as i32;
            let which = if s.which_child == -2 { before } else { s.which_child };
            let wraps = s.which_child == -2 && which >= 0 && count > 0;
            if s.which_child != -2 {
                switch.set(s.which_child);
            }
            only = (which != -3).then_some(if wraps { which % count } else { which });
        }
        if scene.get::<Array>(key).is_some() {
            copies = 2;
        }
        for copy in 0..copies {
            for (index, &child) in scene.children(key).iter().enumerate() {
                if scene.get::<Array>(key).is_some() && index == 0 {
                    switch.set(copy);
                }
                if scene.get::<Lod>(key).is_some() {
                    switch.set(before);
                }
                if only.is_none_or(|only| only == index as i32) {
                    let mut path = path.clone();
                    path.push(child, index);
                    visit(scene, child, &path, switch, plans, out);
                }
            }
        }
        if scene.get::<Group>(key).is_none() && scene.get::<Switch>(key).is_none() && !scene.children(key).is_empty() {
            switch.set(before);
        }
    }
    let mut out = Vec::new();
    visit(scene, scene.root(), &Path::new(scene.root()), &Cell::new(-1), plans, &mut out);
    out
}

/// Whether the steps of a part stand in a path one after the other.
fn contains(path: &Path, part: &Path) -> bool {
    let list = |path: &Path| path.nodes().zip([0].into_iter().chain(path.indices())).collect::<Vec<_>>();
    let (path, part) = (list(path), list(part));
    (0..path.len()).any(|at| {
        part.iter()
            .enumerate()
            .all(|(k, step)| path.get(at + k).is_some_and(|p| p.0 == step.0 && (k == 0 || p == step)))
    })
}

#[test]
fn events_go_round_as_in_a_plain_recursion() {
    let mut rng = Rng(21);
    let soak = if std::env::var_os("SEAMOUNT_SOAK").is_some() { 50 } else { 1 };
    let (mut called, mut handled_by_grabber, mut filtered, mut picked) = (0, 0, 0, 0);
    for _ in 0..150 * soak {
        let World { mut scene, plans, log, picks } = World::new(&mut rng);
        let mut action = HandleEventAction::new(SIZE);
        let mut grabber: Option<usize> = None;
        for time in 0..25 {
            let event = event(&mut rng, time);
            let target = PickTarget::Pixel(event.position.x, event.position.y);
            let all = RayPickAction { target, all: true, ..RayPickAction::pixel(0, 0, SIZE) }.apply(&scene).unwrap();
            let first = all.first().cloned();
            picks.store(0, Ordering::Relaxed);

            // What should happen.
            let (mut expected, mut handled, mut asked) = (Vec::new(), false, [false; 2]);
            let grabbed_before = grabber;
            let offers = grabber.map(|number| (number, Path::new(plans[number].key))).into_iter();
            let round = places(&scene, &plans).into_iter().filter(|(number, _)| Some(*number) != grabbed_before);
            for (turn, (number, path)) in offers.chain(round).enumerate() {
                let plan = &plans[number];
                if handled {
                    break;
                }
                if !plan.functions.iter().any(|(events, _)| is_of(*events, &event.kind)) {
                    continue;
                }
                if let Some(part) = &plan.path {
                    asked[0] |= !asked[1];
                    if !first.as_ref().is_some_and(|hit| contains(&hit.path, part)) {
                        filtered += 1;
                        continue;
                    }
                }
                for (index, (_, script)) in
                    plan.functions.iter().enumerate().filter(|(_, (events, _))| is_of(*events, &event.kind))
                {
                    if !script.acts(&event) {
                        continue;
                    }
                    asked[1] |= script.looks_at_all;
                    asked[0] |= script.looks && !asked[1];
                    let seen = (script.looks || script.looks_at_all).then(|| first.as_ref().map(|hit| hit.point));
                    expected.push((number, index, path.clone(), seen));
                    handled |= script.handles;
                    if script.grabs {
                        grabber = Some(number);
                    }
                    if script.releases {
                        grabber = None;
                    }
                }
                handled_by_grabber += usize::from(handled && turn == 0 && grabbed_before.is_some());
            }

            let got = action.apply(&mut scene, &event).unwrap();
            let log = std::mem::take(&mut *log.lock().unwrap());
            assert_eq!((got, &log), (handled, &expected), "{event:?}");
            assert_eq!(action.grabber, grabber.map(|number| plans[number].key));
            let made = picks.load(Ordering::Relaxed);
            assert_eq!(made, asked.into_iter().map(u32::from).sum::<u32>(), "picked only if asked, and once");
            called += log.len();
            picked += made;
        }
    }
    let counts = [called, handled_by_grabber, filtered, picked as usize];
    assert!(counts.iter().all(|&count| count > 50), "{counts:?}: calls, handled by a grabber, filtered, picks");
}

fn key_event() -> Event {
    Event::new(EventKind::Key { key: Key::Escape, state: ButtonState::Pressed }, DVec2::new(40.0, 30.0))
}

#[test]
fn edits_are_made_in_order_when_the_event_was_handed_round() {
    let mut scene = Scene::new();
    let root = scene.root();
    let cube = scene.add(root, Cube::default()).unwrap();
    let doubling = EventCallback::new(EventType::Any, move |cx| {
        cx.edit(move |scene| scene.edit::<Cube>(cube).unwrap().width *= 2.0);
        // Nothing has changed yet.
        assert_eq!(cx.scene.get::<Cube>(cube).unwrap().width, 2.0);
        Ok(())
    });
    let adding = EventCallback::new(EventType::Any, move |cx| {
        cx.edit(move |scene| scene.edit::<Cube>(cube).unwrap().width += 1.0);
        Ok(())
    });
    scene.add(root, doubling).unwrap();
    scene.add(root, adding).unwrap();
    let mut action = HandleEventAction::new(SIZE);
    assert!(!action.apply(&mut scene, &key_event()).unwrap());
    assert_eq!(scene.get::<Cube>(cube).unwrap().width, 5.0);
}

#[test]
fn an_error_leaves_the_scene_as_it_was() {
    let mut scene = Scene::new();
    let root = scene.root();
    let cube = scene.add(root, Cube::default()).unwrap();
    let calls = Arc::new(AtomicU32::new(0));
    let count = Arc::clone(&calls);
    let node = EventCallback::new(EventType::Key, move |cx| {
        cx.edit(move |scene| scene.edit::<Cube>(cube).unwrap().width = 9.0);
        cx.grab();
        Ok(())
    });
    scene.add(root, node).unwrap();
    scene.add(root, PerspectiveCamera::default()).unwrap();
    // No heights: what is under the pointer can not be had.
    let terrain = scene.add(root, SeamlessTerrain::default()).unwrap();
    let asks = EventCallback { path: Some(Path::new(terrain)), ..EventCallback::new(EventType::Key, |_| Ok(())) };
    scene.add(root, asks).unwrap();
    let counting = EventCallback::new(EventType::Any, move |_| {
        count.fetch_add(1, Ordering::Relaxed);
        Ok(())
    });
    scene.add(root, counting).unwrap();
    let mut action = HandleEventAction::new(SIZE);
    let error = action.apply(&mut scene, &key_event()).unwrap_err();
    assert!(matches!(error, ActionError::Shape { error: ShapeError::NoHeights { .. }, .. }), "{error}");
    assert_eq!((scene.get::<Cube>(cube).unwrap().width, action.grabber), (2.0, None));
    assert_eq!(calls.load(Ordering::Relaxed), 0);
    // Nobody waits for the wheel with a path: nothing is picked, and nothing is wrong.
    let wheel = Event::new(EventKind::MouseWheel { delta: DVec2::X }, DVec2::ZERO);
    assert!(!action.apply(&mut scene, &wheel).unwrap());
    assert_eq!(calls.load(Ordering::Relaxed), 1);
}

#[test]
fn a_grabber_that_is_gone_is_forgotten_and_without_a_camera_nothing_is_under_the_pointer() {
    let mut scene = Scene::new();
    let root = scene.root();
    scene.add(root, Cube::default()).unwrap();
    let grabs = EventCallback::new(EventType::Any, |cx| {
        assert!(cx.picked()?.is_none() && cx.picked_all()?.is_empty());
        cx.grab();
        cx.set_handled();
        Ok(())
    });
    let key = scene.add(root, grabs).unwrap();
    let mut action = HandleEventAction::new(SIZE);
    assert!(action.apply(&mut scene, &key_event()).unwrap());
    assert_eq!(action.grabber, Some(key));
    // Taken from its group it still has the events; removed from the scene it has not.
    scene.remove_child(root, 1).unwrap();
    assert!(action.apply(&mut scene, &key_event()).unwrap());
    scene.remove(key).unwrap();
    assert!(!action.apply(&mut scene, &key_event()).unwrap());
    assert_eq!(action.grabber, None);
}

#[test]
fn lines_are_under_the_pointer_within_the_radius() {
    let text = "Scene(version: 1, root: Separator(children: [
        OrthographicCamera(position: (0.0, 0.0, 10.0), look_at: (0.0, 0.0, 0.0), height: 6.0),
        Coordinate3(point: [(-1.0, 0.0, 0.0), (1.0, 0.0, 0.0)]), Def(\"line\", LineSet()),
        Def(\"clicks\", EventCallback()),
    ]))";
    let mut scene = parse(text, &Registry::default()).unwrap();
    assert!(write_scene(&scene).unwrap().contains("Def(\"clicks\", EventCallback())"));
    let line = scene.find("line").unwrap();
    let handles = EventCallback::new(EventType::Any, |cx| {
        cx.set_handled();
        Ok(())
    });
    let key = scene.find("clicks").unwrap();
    *scene.edit::<EventCallback>(key).unwrap() = EventCallback { path: Some(Path::new(line)), ..handles };
    // Ten pixels a unit.
    let mut action = HandleEventAction::new(SIZE);
    let mut at = |action: &mut HandleEventAction, y: f64| {
        action.apply(&mut scene, &Event { position: DVec2::new(40.0, 30.0 + y), ..key_event() }).unwrap()
    };
    assert_eq!([4.0, 6.0].map(|y| at(&mut action, y)), [true, false]);
    action.radius = 7.0;
    assert_eq!([4.0, 6.0, 8.0].map(|y| at(&mut action, y)), [true, true, false]);
}
