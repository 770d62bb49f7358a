//! What the documentation says that each action does with each kind of node is what happens: a scene with a node of the kind
//! and the same scene without it are put to every action, and the answers differ for those actions alone that are named.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path as FilePath;
use std::sync::{Arc, Mutex};

use glam::DVec2;
use seamount::action::walk::{Visitor, walk};
use seamount::action::{ActionKind, Branches, Event, EventKind, EventType};
use seamount::format::{load_files, parse};
use seamount::node::{NodeInfo, Registry};
use seamount::prelude::*;
use tempfile::TempDir;

const CAMERA: &str =
    "PerspectiveCamera(position: (3, -12, 8), look_at: (0, 0, 0), near_distance: 0.1, far_distance: 100)";
const LIGHT: &str = "DirectionalLight(direction: (0.3, 0.5, -1))";
const TERRAIN: &str =
    "Separator(children: [Translation(translation: (-4, -4, 0)), SeamlessTerrain(scale: 8, max_height: 3)])";
const POINTS: &str = "Coordinate3(point: [(-2, -2, 0), (2, -2, 0.5), (2, 2, 0), (-2, 2, 0.3)])";
const FACES: &str = "IndexedFaceSet(coord_index: [0, 1, 2, -1, 0, 2, 3, -1])";
const PIXELS: [u32; 2] = [64, 48];

/// What stands before a node of the kind, the node, and what follows it. Textures are there on units that are not named.
type Probe = (&'static str, String, &'static str, String);

fn probes() -> Vec<Probe> {
    let all = |parts: &[&str]| parts.join(", ");
    let seen =
        |kind, before: &[&str], node, after: &[&str]| (kind, all(&[&[CAMERA][..], before].concat()), node, all(after));
    let ground = |kind, before: &[&str], node| {
        seen(
            kind,
            &[&[LIGHT, "TextureUnit(unit: 0), Texture2(filename: \"map.png\")"][..], before].concat(),
            node,
            &[TERRAIN],
        )
    };
    let low = "TextureUnit(unit: 3), Texture2(filename: \"map.png\")";
    let lod = "Lod(range: [1], children: [Cube(), Sphere()])";
    let bumpy = "TextureUnit(unit: 7), Texture2(filename: \"colors.png\")";
    vec![
        seen("Transform", &[], "Transform(translation: (1, 0, 0))", &["Cube()"]),
        seen("Translation", &[], "Translation(translation: (1, 0, 0))", &["Cube()"]),
        seen("Rotation", &[], "Rotation(rotation: (0, 0, 1, 0.5))", &["Cube()"]),
        seen("RotationXyz", &[], "RotationXyz(angle: 0.5)", &["Cube()"]),
        seen("Scale", &[], "Scale(scale_factor: (1, 2, 1))", &["Cube()"]),
        seen(
            "MatrixTransform",
            &[],
            "MatrixTransform(matrix: ((1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 0)))",
            &["Cube()"],
        ),
        seen("ResetTransform", &["Translation(translation: (1, 0, 0))"], "ResetTransform()", &["Cube()"]),
        seen("Units", &[], "Units(units: Feet)", &["Cube()"]),
        ("PerspectiveCamera", String::new(), CAMERA, lod.to_owned()),
        ("OrthographicCamera", String::new(), "OrthographicCamera(position: (0, 0, 20), height: 8)", lod.to_owned()),
        ("FrustumCamera", String::new(), "FrustumCamera(position: (0, 0, 20), left: -0.1)", lod.to_owned()),
        seen("DirectionalLight", &[], LIGHT, &["Cube()"]),
        seen("PointLight", &[], "PointLight(location: (0, 0, 5))", &["Cube()"]),
        seen("SpotLight", &[], "SpotLight(location: (0, 0, 5))", &["Cube()"]),
        seen(
            "Environment",
            &[LIGHT],
            "Environment(fog_type: Fog, fog_color: (1, 0, 0), fog_visibility: 30)",
            &["Cube()"],
        ),
        seen("LightModel", &[LIGHT], "LightModel(model: BaseColor)", &["Cube()"]),
        seen("Material", &[], "Material(diffuse_color: (1, 0, 0))", &["Cube()"]),
        seen("BaseColor", &[], "BaseColor(rgb: (1, 0, 0))", &["Cube()"]),
        seen(
            "MaterialBinding",
            &["BaseColor(rgb: [(1, 0, 0), (0, 1, 0)])", POINTS],
            "MaterialBinding(value: PerFace)",
            &[FACES],
        ),
        seen("DrawStyle", &[], "DrawStyle(style: Lines)", &["Cube()"]),
        seen("ShapeHints", &[LIGHT, POINTS], "ShapeHints(vertex_ordering: Clockwise, shape_type: Solid)", &[FACES]),
        seen(
            "Complexity",
            &[],
            "Complexity(value: 0)",
            &["LevelOfDetail(screen_area: [1], children: [Cube(), Sphere()])"],
        ),
        seen("PickStyle", &[], "PickStyle(style: Unpickable)", &["Cube()"]),
        seen("ClipPlane", &[], "ClipPlane(plane: (0, 0, -1, 0))", &["Cube()"]),
        seen("PolygonOffset", &[], "PolygonOffset()", &["Cube()"]),
        seen("Texture2", &[LIGHT], "Texture2(filename: \"map.png\")", &[TERRAIN]),
        seen("TextureUnit", &["TextureUnit(unit: 3)"], "TextureUnit()", &["Texture2(filename: \"map.png\")", TERRAIN]),
        ground(
            "Texture2Transform",
            &["TextureUnit(unit: 1), Texture2(filename: \"colors.png\")"],
            "Texture2Transform(scale_factor: (2, 2))",
        ),
        seen("Coordinate3", &[], POINTS, &["FaceSet()"]),
        seen(
            "VertexProperty",
            &[],
            "VertexProperty(vertex: [(-2, -2, 0), (2, -2, 0.5), (2, 2, 0)], ordered_rgba: [0xff0000ff])",
            &["FaceSet()"],
        ),
        seen(
            "Normal",
            &[LIGHT, POINTS],
            "Normal(vector: [(0, 0.6, 0.8), (0.6, 0, 0.8), (0, -0.6, 0.8), (0, 0, 1)])",
            &[FACES],
        ),
        seen(
            "NormalBinding",
            &[LIGHT, POINTS, "Normal(vector: [(0, 0.6, 0.8), (0.6, 0, 0.8), (0, -0.6, 0.8), (0, 0, 1)])"],
            "NormalBinding(value: Overall)",
            &[FACES],
        ),
        seen(
            "TextureCoordinate2",
            &["Texture2(filename: \"colors.png\")", POINTS],
            "TextureCoordinate2(point: [(0, 0), (9, 0), (9, 9), (0, 5)])",
            &[FACES],
        ),
        seen("Info", &[], "Info(string: \"x\")", &["Cube()"]),
        seen("Label", &[], "Label(label: \"x\")", &["Cube()"]),
        (
            "ShaderProgram",
            all(&[CAMERA, low]),
            "ShaderProgram(shader_object: [
                VertexShader(parameter: [ShaderParameter(name: \"height_map\", value: Texture(3))]),
                FragmentShader(source_program: Wgsl(\"fn fragment_shader(f: Fragment) -> vec3f { return f.color; }\")),
            ])",
            TERRAIN.to_owned(),
        ),
        (
            "VertexShader",
            all(&[CAMERA, low, "ShaderProgram(shader_object: ["]),
            "VertexShader(parameter: [ShaderParameter(name: \"height_map\", value: Texture(3))])",
            all(&["])", TERRAIN]),
        ),
        (
            "FragmentShader",
            all(&[CAMERA, "ShaderProgram(shader_object: ["]),
            "FragmentShader(source_program: Wgsl(\"fn fragment_shader(f: Fragment) -> vec3f { return f.color; }\"))",
            "]), Cube()".to_owned(),
        ),
        (
            "ShaderParameter",
            all(&[CAMERA, low, "ShaderProgram(shader_object: [VertexShader(parameter: ["]),
            "ShaderParameter(name: \"height_map\", value: Texture(3))",
            all(&["])])", TERRAIN]),
        ),
        seen("Background", &[], "Background(color: (1, 0, 0))", &["Cube()"]),
        ground("ColorRamp", &[], "ColorRamp(ramp: Viridis)"),
        ground("ContourLines", &[], "ContourLines(interval: 0.5)"),
        ground(
            "DetailTextures",
            &[
                "TextureUnit(unit: 2), Texture2(filename: \"colors.png\"), TextureUnit(unit: 3)",
                "Texture2(filename: \"colors.png\"), TextureUnit(unit: 4), Texture2(filename: \"colors.png\")",
                "TextureUnit(unit: 5), Texture2(filename: \"colors.png\"), TextureUnit(unit: 6)",
                "Texture2(filename: \"colors.png\")",
            ],
            "DetailTextures(size: 2)",
        ),
        ground("NormalMap", &[bumpy], "NormalMap(size: 2)"),
        ground("BumpMap", &[bumpy], "BumpMap(unit: 7, size: 2, height: 0.5)"),
        seen("Cube", &[], "Cube()", &[]),
        seen("Sphere", &[], "Sphere()", &[]),
        seen("Cone", &[], "Cone()", &[]),
        seen("Cylinder", &[], "Cylinder()", &[]),
        seen("FaceSet", &[POINTS], "FaceSet()", &[]),
        seen("IndexedFaceSet", &[POINTS], FACES, &[]),
        seen("TriangleStripSet", &[POINTS], "TriangleStripSet()", &[]),
        seen("IndexedTriangleStripSet", &[POINTS], "IndexedTriangleStripSet(coord_index: [0, 1, 3, 2])", &[]),
        seen("QuadMesh", &[POINTS], "QuadMesh(vertices_per_row: 2, vertices_per_column: 2)", &[]),
        seen("LineSet", &[POINTS], "LineSet()", &[]),
        seen("IndexedLineSet", &[POINTS], "IndexedLineSet(coord_index: [0, 2, 1, 3])", &[]),
        seen("Font", &[], "Font(size: 30)", &["Text2(string: \"text\")"]),
        seen("Text2", &["Font(size: 30)"], "Text2(string: \"text\")", &[]),
        seen("PointSet", &["Coordinate3(point: [(0, 0, 0), (1, 1, 0)])"], "PointSet()", &[]),
        seen("SeamlessTerrain", &["Texture2(filename: \"map.png\")"], "SeamlessTerrain(scale: 3, max_height: 1)", &[]),
    ]
}

/// Which children of a group of three an action walks, in order: one that goes by what is seen, and one that goes by what may
/// be. The first two are probes, so that the third, which has something to see, is left out.
const GROUPS: &[(&str, &str, &[usize], &[usize])] = &[
    ("Group", "", &[0, 1], &[0, 1]),
    ("Separator", "", &[0, 1], &[0, 1]),
    ("TransformSeparator", "", &[0, 1], &[0, 1]),
    ("Switch", "which_child: 1", &[1], &[1]),
    ("Lod", "range: [1]", &[1], &[0, 1]),
    ("LevelOfDetail", "screen_area: [1e9, 0]", &[1], &[0, 1]),
    ("Array", "num_elements1: 2", &[0, 1, 0, 1], &[0, 1, 0, 1]),
    (
        "MultipleCopy",
        "matrix: [((1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, 0)), ((1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 0))]",
        &[0, 1, 0, 1],
        &[0, 1, 0, 1],
    ),
    ("File", "name: \"inner.ron\"", &[0, 1], &[0, 1]),
];

/// Actions that walk what is seen, and not all that may be.
const SEEN: [ActionKind; 4] =
    [ActionKind::Render, ActionKind::RayPick, ActionKind::Callback, ActionKind::PrimitiveCount];

fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let map = image::GrayImage::from_fn(9, 9, |x, y| image::Luma([(x * 53 + y * 29) as u8]));
    map.save(folder.path().join("map.png")).unwrap();
    let colors = image::RgbImage::from_fn(4, 4, |x, y| image::Rgb([(x * 60) as u8, (y * 60) as u8, 90]));
    colors.save(folder.path().join("colors.png")).unwrap();
    let inner = "Scene(version: 1, root: Group(children: [Def(\"0\", Callback()), Def(\"1\", Callback()), Cube()]))";
    std::fs::write(folder.path().join("inner.ron"), inner).unwrap();
    folder
}

fn scene(folder: &FilePath, nodes: &str) -> Scene {
    let text = format!("Scene(version: 1, root: Separator(children: [{nodes}]))").replace("[, ", "[");
    let mut scene = parse(&text, &Registry::default()).unwrap_or_else(|error| panic!("{error}\n{text}"));
    scene.set_source(folder.join("probe.ron"));
    load_files(&mut scene, &Registry::default()).unwrap();
    scene
}

/// The answers of all actions that look at more than the list of nodes.
fn answers(scene: &mut Scene) -> BTreeMap<&'static str, String> {
    let mut answers = BTreeMap::new();
    let mut note = |action: ActionKind, answer: String| drop(answers.insert(action.name(), answer));
    let [width, height] = PIXELS;
    let frame = RenderAction::new(width, height).apply(scene).map_err(|error| error.to_string());
    note(ActionKind::Render, format!("{:?}", frame.map(|frame| (frame.background, frame.sky, frame.draws))));
    // In a view as well, always the same one: it is asked for, and not the scene's.
    let mut looking = Scene::new();
    let (position, look_at) = (Some(DVec3::Z * 9.0), Some(DVec3::ZERO));
    let limits = (Some(0.1), Some(1e3));
    let camera = PerspectiveCamera {
        position,
        look_at,
        near_distance: limits.0,
        far_distance: limits.1,
        ..PerspectiveCamera::default()
    };
    looking.add(looking.root(), camera).unwrap();
    let view = RenderAction::new(width, height).viewpoint(&looking).unwrap();
    let boxes = [None, Some(view)].map(|view| {
        let action = BoundingBoxAction { view, ..BoundingBoxAction::default() };
        action.apply(scene).map_err(|error| error.to_string())
    });
    note(ActionKind::BoundingBox, format!("{boxes:?}"));
    let places = || (0..width).step_by(6).flat_map(|x| (0..height).step_by(6).map(move |y| (x, y)));
    let told = |hits: &[PickedPoint]| {
        hits.iter().map(|h| format!("{:?}", (h.point, h.normal, h.smooth_normal, h.uv, h.detail))).collect::<Vec<_>>()
    };
    let picks: Vec<_> = places()
        .map(|(x, y)| {
            let picked = RayPickAction { all: true, ..RayPickAction::pixel(x, y, PIXELS) }.apply(scene);
            picked.map(|hits| told(&hits)).map_err(|error| error.to_string())
        })
        .collect();
    note(ActionKind::RayPick, format!("{picks:?}"));
    let found = Arc::new(Mutex::new(String::new()));
    let to = Arc::clone(&found);
    let events = EventCallback::new(EventType::Location, move |cx| {
        let hits = cx.picked_all().map(told).map_err(|error| error.to_string());
        to.lock().unwrap().push_str(&format!("{hits:?}"));
        Ok(())
    });
    let events = scene.add(scene.root(), events).unwrap();
    for (x, y) in places() {
        let event = Event::new(EventKind::Location, DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5));
        HandleEventAction::new(PIXELS).apply(scene, &event).unwrap();
    }
    scene.remove(events).unwrap();
    note(ActionKind::HandleEvent, std::mem::take(&mut *found.lock().unwrap()));
    let primitives = Mutex::new(String::new());
    let placed = |model: &DAffine3, points: &[DVec3]| {
        let points: Vec<_> = points.iter().map(|&p| model.transform_point3(p)).collect();
        primitives.lock().unwrap().push_str(&format!("{points:?}"));
    };
    let mut callbacks = CallbackAction::new()
        .triangles(None, |visit, t| {
            placed(&visit.state.model, &t.points);
            primitives.lock().unwrap().push_str(&format!("{:?}", (t.normals, t.uvs, t.materials)));
        })
        .lines(None, |visit, line| placed(&visit.state.model, line))
        .points(None, |visit, point| placed(&visit.state.model, &[*point]));
    callbacks.size = PIXELS;
    let walked = callbacks.apply(scene);
    drop(callbacks);
    note(ActionKind::Callback, format!("{} {:?}", primitives.lock().unwrap(), walked.map_err(|e| e.to_string())));
    let count = PrimitiveCountAction { size: PIXELS, ..PrimitiveCountAction::default() }.apply(scene);
    note(ActionKind::PrimitiveCount, format!("{:?}", count.map_err(|error| error.to_string())));
    let mut last = Path::new(scene.root());
    if let Some(&key) = scene.children(scene.root()).last() {
        last.push(key, scene.children(scene.root()).len() - 1);
    }
    note(ActionKind::Matrix, format!("{:?}", MatrixAction::new(last).apply(scene).map_err(|error| error.to_string())));
    answers
}

/// The actions whose answers are compared, of those that a kind names.
fn named(info: &NodeInfo) -> BTreeSet<&'static str> {
    let all = info.actions.iter().flat_map(|note| note.actions);
    all.filter(|action| ![ActionKind::Search, ActionKind::Other].contains(action)).map(|action| action.name()).collect()
}

#[test]
fn properties_and_shapes_act_where_it_is_said_and_nowhere_else() {
    let folder = folder();
    let mut wrong = Vec::new();
    for (kind, before, node, after) in probes() {
        let info = Registry::default().get(kind).unwrap();
        let mut scene = scene(folder.path(), &format!("{before}, Def(\"probe\", {node}), {after}"));
        let probe = scene.find("probe").unwrap();
        assert_eq!(scene.node(probe).unwrap().info().kind, kind);
        // Once before, so that nothing is told apart by what is worked out at the first question.
        answers(&mut scene);
        let with = answers(&mut scene);
        let parent = scene.parents(probe)[0];
        let index = scene.children(parent).iter().position(|&key| key == probe).unwrap();
        scene.remove_child(parent, index).unwrap();
        let instead = if parent == scene.root() { Box::new(Info::default()) } else { (info.make)() };
        let instead = scene.insert_boxed(instead);
        scene.insert_child(parent, index, instead).unwrap();
        answers(&mut scene);
        let without = answers(&mut scene);
        let differ: BTreeSet<&str> = with.keys().copied().filter(|action| with[action] != without[action]).collect();
        if differ != named(info) {
            wrong.push(format!("{kind} is said to act in {:?}, and acts in {differ:?}", named(info)));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn groups_walk_the_children_that_it_is_said_they_walk() {
    struct Outside;
    impl Visitor for Outside {}
    let folder = folder();
    for &(kind, fields, seen, possible) in GROUPS {
        let info = Registry::default().get(kind).unwrap();
        let children = "Def(\"0\", Callback()), Def(\"1\", Callback()), Cube()";
        let comma = if fields.is_empty() { "" } else { ", " };
        let group = match kind {
            "File" => format!("{kind}({fields})"),
            _ => format!("{kind}({fields}{comma}children: [{children}])"),
        };
        let mut scene = scene(folder.path(), &format!("{CAMERA}, {group}, Cube()"));
        let walked: Arc<Mutex<Vec<(ActionKind, usize)>>> = Arc::default();
        for number in 0..2 {
            let found = SearchAction { name: Some(number.to_string()), hidden: true, ..SearchAction::default() };
            let key = found.apply(&scene).unwrap()[0].tail().unwrap();
            let walked = Arc::clone(&walked);
            let note = move |cx: &seamount::action::PropertyContext<'_>, _: &mut seamount::action::State| {
                walked.lock().unwrap().push((cx.action, number));
            };
            scene.edit::<Callback>(key).unwrap().function = Callback::new(note).function;
        }
        for action in ActionKind::ALL {
            walked.lock().unwrap().clear();
            let mut path = Path::new(scene.root());
            path.push(scene.children(scene.root())[2], 2);
            match action {
                ActionKind::Render => drop(RenderAction::new(64, 48).apply(&scene).unwrap()),
                ActionKind::BoundingBox => drop(BoundingBoxAction::default().apply(&scene).unwrap()),
                ActionKind::RayPick => drop(RayPickAction::pixel(32, 24, PIXELS).apply(&scene).unwrap()),
                ActionKind::Search => {
                    drop(SearchAction { kind: Some("Cone".into()), ..SearchAction::default() }.apply(&scene).unwrap());
                }
                ActionKind::Matrix => drop(MatrixAction::new(path).apply(&scene).unwrap()),
                ActionKind::Callback => CallbackAction::new().apply(&scene).unwrap(),
                ActionKind::PrimitiveCount => drop(PrimitiveCountAction::default().apply(&scene).unwrap()),
                ActionKind::HandleEvent => {
                    let event = Event::new(EventKind::Location, DVec2::ZERO);
                    HandleEventAction::new(PIXELS).apply(&mut scene, &event).unwrap();
                }
                _ => walk(&scene, Branches::Possible, &mut Outside).unwrap(),
            }
            let found: Vec<usize> =
                walked.lock().unwrap().iter().filter(|(by, _)| *by == action).map(|(_, number)| *number).collect();
            let expected = if SEEN.contains(&action) { seen } else { possible };
            assert_eq!(found, expected, "{kind}: {}", action.name());
        }
        // What walks in another way is said by itself.
        let ways = if seen == possible { 1 } else { 2 };
        assert_eq!(info.actions.len(), ways, "{kind}");
        for note in info.actions {
            let by_view = note.actions.iter().filter(|action| SEEN.contains(action)).count();
            assert!(ways == 1 || by_view == 0 || by_view == note.actions.len(), "{kind}");
        }
        let told: BTreeSet<_> = info.actions.iter().flat_map(|note| note.actions).map(|action| action.name()).collect();
        let others = ActionKind::ALL.into_iter().filter(|&action| action != ActionKind::Other);
        assert!(others.map(ActionKind::name).all(|action| told.contains(action)), "{kind}: {told:?}");
    }
}

#[test]
fn functions_are_called_in_the_actions_that_are_named() {
    let mut scene = Scene::new();
    let root = scene.root();
    scene.add(root, PerspectiveCamera::default()).unwrap();
    let called: Arc<Mutex<BTreeSet<&'static str>>> = Arc::default();
    let note = Arc::clone(&called);
    let callback = Callback::new(move |cx, _| {
        note.lock().unwrap().insert(cx.action.name());
    });
    scene.add(root, callback).unwrap();
    scene.add(root, Cube::default()).unwrap();
    answers(&mut scene);
    SearchAction::default().apply(&scene).unwrap();
    struct Outside;
    impl Visitor for Outside {}
    walk(&scene, Branches::Possible, &mut Outside).unwrap();
    let info = |kind: &str| Registry::default().get(kind).unwrap();
    let said: BTreeSet<_> =
        info("Callback").actions.iter().flat_map(|n| n.actions).map(|action| action.name()).collect();
    assert_eq!(*called.lock().unwrap(), said);
    // That EventCallback gets events, and nothing else, is what `answers` of every other kind rests on.
    assert_eq!(named(info("EventCallback")), BTreeSet::from(["handle event"]));
}

#[test]
fn every_kind_is_tried() {
    let tried: BTreeSet<&str> = probes()
        .iter()
        .map(|probe| probe.0)
        .chain(GROUPS.iter().map(|group| group.0))
        .chain(["Callback", "EventCallback"])
        .collect();
    let kinds: BTreeSet<&str> = Registry::default().kinds().map(|info| info.kind).collect();
    assert_eq!(tried, kinds);
}
