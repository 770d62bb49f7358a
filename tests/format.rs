//! Scenes in and out: what is written reads as the same graph.

use std::collections::HashMap;

use proptest::prelude::*;
use seamount::format::{self, MAX_NESTING, WriteError, parse, write_scene};
use seamount::node::{DetailMode, ImageRef, Registry, Wrap};
use seamount::prelude::*;

fn read(text: &str) -> Scene {
    parse(text, &Registry::default()).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// The graph as a list: kind, fields, name and children of each node, children by the number of the node in the order of
/// the first visit. Equal for two scenes exactly if they are the same graph.
fn shape_of(scene: &Scene, names: bool) -> Vec<(String, String, Option<String>, Vec<usize>)> {
    let mut numbers = HashMap::from([(scene.root(), 0)]);
    let mut order = vec![scene.root()];
    let mut shape = Vec::new();
    let mut next = 0;
    while let Some(&key) = order.get(next) {
        next += 1;
        let node = scene.node(key).expect("reachable");
        let children = scene
            .children(key)
            .iter()
            .map(|&child| {
                *numbers.entry(child).or_insert_with(|| {
                    order.push(child);
                    order.len() - 1
                })
            })
            .collect();
        let name = scene.name(key).filter(|_| names).map(str::to_owned);
        shape.push((node.info().kind.to_owned(), format!("{node:?}"), name, children));
    }
    shape
}

#[test]
fn a_scene_with_everything_reads_as_it_says() {
    let scene = read(
        r#"
        // A comment, /* and */ more.
        Scene(version: 1, root: Separator(children: [
            PerspectiveCamera(position: (1, 2.5, -3e2), look_at: Some((0, 0, 0)), near_distance: None,),
            Cube, Cube(), /* Cube(, */
            Def("ground \"ü\"\n", Group(children: [
                TextureUnit(unit: 0x10),
                Texture2(filename: r"C:\maps\a.png", wrap_s: Clamp),
                ShaderProgram(shader_object: [
                    VertexShader(parameter: [ShaderParameter(name: "height_map", value: Texture(3))]),
                    FragmentShader(is_active: false),
                ]),
            ])),
            Use("ground \"ü\"\n"),
        ]))
        "#,
    );
    let children = scene.children(scene.root()).to_vec();
    let camera: &PerspectiveCamera = scene.get(children[0]).unwrap();
    assert_eq!(camera.position, Some(DVec3::new(1.0, 2.5, -300.0)));
    assert_eq!((camera.look_at, camera.near_distance), (Some(DVec3::ZERO), None));
    assert_eq!(scene.get::<Cube>(children[1]), Some(&Cube::default()));
    assert_eq!(children[3], children[4]);
    assert_eq!(scene.name(children[3]), Some("ground \"ü\"\n"));
    let inner = scene.children(children[3]).to_vec();
    assert_eq!(scene.get::<TextureUnit>(inner[0]).unwrap().unit, 16);
    let texture: &Texture2 = scene.get(inner[1]).unwrap();
    assert_eq!(
        (texture.filename.as_str(), texture.wrap_s, texture.wrap_t),
        ("C:\\maps\\a.png", Wrap::Clamp, Wrap::Repeat)
    );
    let vertex = scene.children(inner[2])[0];
    let parameter: &ShaderParameter = scene.get(scene.children(vertex)[0]).unwrap();
    assert_eq!(parameter.value, ShaderValue::Texture(3));
    assert_eq!(scene.len(), 11);
    let position = scene.position(children[2]).unwrap();
    assert_eq!((position.line, position.column), (5, 19));
    // Positions of named nodes are those of the nodes.
    let position = scene.position(children[3]).unwrap();
    assert_eq!((position.line, position.column), (6, 35));
}

#[test]
fn what_is_written_is_readable() {
    let mut scene = Scene::new();
    let root = scene.root();
    scene.add(root, DirectionalLight { direction: DVec3::new(-1.0, 0.5, -0.6), ..Default::default() }).unwrap();
    let group = scene.add(root, Group::default()).unwrap();
    let cube = scene.add(group, Cube { width: 0.1, ..Default::default() }).unwrap();
    scene.add_child(root, cube).unwrap();
    let terrain = SeamlessTerrain {
        size: Some(DVec2::new(90600.0, 111_240.0)),
        max_height: 65535.0,
        base_height: -1000.0,
        void_sample: Some(0.0),
        resolutions: (8, 4),
        color_mode: ColorMode::Parts,
        ..Default::default()
    };
    let terrain = scene.add(root, terrain).unwrap();
    scene.set_name(terrain, "the ground, by its name").unwrap();
    let text = write_scene(&scene).unwrap();
    let expected = r#"Scene(
    version: 1,
    root: Separator(children: [
        DirectionalLight(direction: (-1.0, 0.5, -0.6)),
        Group(children: [
            Def("shared_1", Cube(width: 0.1)),
        ]),
        Use("shared_1"),
        Def("the ground, by its name", SeamlessTerrain(
            size: (90600.0, 111240.0),
            max_height: 65535.0,
            base_height: -1000.0,
            void_sample: 0.0,
            resolutions: (8, 4),
            color_mode: Parts,
        )),
    ]),
)
"#;
    assert_eq!(text, expected);
    assert_eq!(shape_of(&read(&text), false), shape_of(&scene, false));
}

#[test]
fn names_for_shared_nodes_do_not_clash() {
    let mut scene = Scene::new();
    let root = scene.root();
    let named = scene.add(root, Cube::default()).unwrap();
    scene.set_name(named, "shared_1").unwrap();
    for _ in 0..2 {
        let shared = scene.add(root, Group::default()).unwrap();
        scene.add_child(root, shared).unwrap();
    }
    let again = read(&write_scene(&scene).unwrap());
    assert_eq!(again.names(), ["shared_1", "shared_2", "shared_3"]);
    assert_eq!(shape_of(&again, false), shape_of(&scene, false));
    // Written a second time nothing changes any more.
    assert_eq!(write_scene(&again).unwrap(), write_scene(&read(&write_scene(&again).unwrap())).unwrap());
}

#[test]
fn nodes_that_nobody_reaches_are_not_written() {
    let mut scene = Scene::new();
    let lost = scene.insert(Cube::default());
    scene.set_name(lost, "lost").unwrap();
    assert_eq!(write_scene(&scene).unwrap(), "Scene(\n    version: 1,\n    root: Separator(),\n)\n");
}

#[test]
fn images_in_memory_can_not_be_written() {
    let mut scene = Scene::new();
    let root = scene.root();
    let group = scene.add(root, Group::default()).unwrap();
    let image = Image::new(2, 2, Pixels::Gray8(vec![0; 4])).unwrap();
    scene.add(group, Texture2::from_image(image)).unwrap();
    let error = write_scene(&scene).unwrap_err();
    assert!(matches!(error, WriteError::ImageInMemory { .. }));
    assert_eq!(
        error.to_string(),
        "Separator/Group[0]/Texture2[0]: the texture's image is in memory: save it as a file and give its `filename`"
    );
    if let Some(mut texture) = scene.edit::<Texture2>(scene.children(group)[0]) {
        texture.image = None::<ImageRef>;
    }
    assert!(write_scene(&scene).is_ok());
}

#[test]
fn values_that_could_not_be_read_again_are_not_written() {
    let mut scene = Scene::new();
    let root = scene.root();
    scene.add(root, Cube { height: f64::NAN, ..Default::default() }).unwrap();
    let error = write_scene(&scene).unwrap_err();
    assert_eq!(
        error.to_string(),
        "Separator/Cube[0]: `height` can not be written, its value NaN could not be read again"
    );
}

/// A chain of nodes, put together from the bottom, where an edit has no ancestors to tell.
fn nested(levels: usize) -> Scene {
    let mut scene = Scene::new();
    let mut child = scene.insert(Cube::default());
    for _ in 2..levels {
        let parent = scene.insert(Separator::default());
        scene.add_child(parent, child).unwrap();
        child = parent;
    }
    scene.add_child(scene.root(), child).unwrap();
    scene
}

/// In the 2 MiB of a test's thread, read, written, read again and dropped.
#[test]
fn deep_scenes_work_up_to_the_limit_and_are_refused_beyond() {
    for levels in [500, MAX_NESTING] {
        let scene = nested(levels);
        let again = read(&write_scene(&scene).unwrap());
        assert_eq!(again.len(), levels);
        assert_eq!(shape_of(&again, true), shape_of(&scene, true));
    }
    assert!(matches!(write_scene(&nested(MAX_NESTING + 1)), Err(WriteError::TooDeep)));
    assert!(matches!(write_scene(&nested(100_000)), Err(WriteError::TooDeep)));
    // Every level with a name, which is twice as deep in the text.
    let mut text = "Cube".to_owned();
    for level in (1..MAX_NESTING).rev() {
        text = format!("Def(\"{level}\", Group(children: [{text}]))");
    }
    assert_eq!(read(&format!("Scene(version: 1, root: {text})")).len(), MAX_NESTING);
}

/// Long scenes take time in proportion: a million characters on one line, with a mistake at its end.
#[test]
fn long_scenes_are_read() {
    let cubes = "Cube(width: 1.5), ".repeat(50_000);
    assert_eq!(read(&format!("Scene(version: 1, root: Group(children: [{cubes}]))")).len(), 50_001);
    let wrong = cubes.replace("1.5", "x");
    let error =
        parse(&format!("Scene(version: 1, root: Group(children: [{wrong}]))"), &Registry::default()).unwrap_err();
    assert_eq!(error.mistakes().len(), 50_000);
}

#[test]
fn saving_replaces_the_file_in_one_step() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.ron");
    let mut scene = Scene::new();
    format::save_scene(&scene, &path).unwrap();
    let root = scene.root();
    scene.add(root, Cube::default()).unwrap();
    format::save_scene(&scene, &path).unwrap();
    let read = format::read_scene(&path).unwrap();
    assert_eq!((read.len(), read.source()), (2, Some(path.as_path())));
    // What can not be written leaves the old file.
    scene.add(root, Cube { width: f64::INFINITY, ..Default::default() }).unwrap();
    assert!(format::save_scene(&scene, &path).is_err());
    assert_eq!(format::read_scene(&path).unwrap().len(), 2);
    let error = format::save_scene(&Scene::new(), folder.path().join("no/scene.ron")).unwrap_err();
    assert!(error.to_string().contains("make it first"), "{error}");
}

#[test]
fn every_scene_of_the_repository_is_in_order_and_survives_writing() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut count = 0;
    for path in std::fs::read_dir(folder).unwrap().map(|f| f.unwrap().path()) {
        if path.extension().is_some_and(|e| e == "ron") {
            format::check(&path, &Registry::default()).unwrap();
            let scene = format::read_scene(&path).unwrap();
            let mut again = read(&write_scene(&scene).unwrap());
            again.set_source(&path);
            format::load_files(&mut again, &Registry::default()).unwrap();
            assert_eq!(shape_of(&again, true), shape_of(&scene, true));
            count += 1;
        }
    }
    assert!(count >= 6);
}

#[test]
fn the_scene_around_a_map_shows_all_of_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.png");
    let map =
        image::ImageBuffer::<image::Luma<u16>, Vec<u16>>::from_fn(41, 21, |x, y| image::Luma([1000 + (x * y) as u16]));
    map.save(&path).unwrap();
    let scene = format::scene_of_map(&path).unwrap();
    let bounds = BoundingBoxAction::default().apply(&scene).unwrap().unwrap();
    assert!((bounds.min - DVec3::ZERO).length() < 1e-9 && (bounds.max - DVec3::new(40.0, 20.0, 5.0)).length() < 1e-9);
    let view = RenderAction::new(1280, 720).viewpoint(&scene).unwrap();
    for corner in bounds.corners() {
        let clip = view.clip_from_eye() * (corner - view.eye).extend(1.0);
        assert!(clip.x.abs() <= clip.w * 1.000_001 && clip.y.abs() <= clip.w * 1.000_001 && clip.w > 0.0, "{corner}");
    }
    // It can be saved, and read from there.
    format::save_scene(&scene, folder.path().join("map.ron")).unwrap();
    assert_eq!(format::read_scene(folder.path().join("map.ron")).unwrap().len(), scene.len());
    // A flat map is a scene as well.
    image::GrayImage::new(2, 2).save(&path).unwrap();
    let scene = format::scene_of_map(&path).unwrap();
    assert!(RenderAction::new(8, 8).apply(&scene).is_ok());
    assert!(format::scene_of_map(folder.path().join("none.png")).is_err());
}

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        any::<f64>().prop_filter("files have finite numbers", |v| v.is_finite()),
        -1e3..1e3,
        Just(-0.0),
        Just(f64::MIN_POSITIVE),
        Just(5e-324),
        Just(f64::MAX),
    ]
}

fn small() -> impl Strategy<Value = f32> {
    prop_oneof![any::<f32>().prop_filter("finite", |v| v.is_finite()), 0f32..1.0]
}

fn point() -> impl Strategy<Value = DVec3> {
    (number(), number(), number()).prop_map(|(x, y, z)| DVec3::new(x, y, z))
}

fn color() -> impl Strategy<Value = Color> {
    (small(), small(), small()).prop_map(|(r, g, b)| Color::new(r, g, b))
}

fn colors() -> impl Strategy<Value = List<Color>> {
    proptest::collection::vec(color(), 0..3).prop_map(List::from)
}

fn turn() -> impl Strategy<Value = AxisAngle> {
    (point(), number()).prop_map(|(axis, angle)| AxisAngle::new(axis, angle))
}

fn above_zero() -> impl Strategy<Value = f64> {
    prop_oneof![f64::MIN_POSITIVE..f64::MAX, 1e-9..1e9]
}

type Boxed = Box<dyn Node>;

/// Nodes without children and without problems, with all sorts of values in all of their fields.
fn leaf() -> impl Strategy<Value = std::sync::Arc<Boxed>> {
    let boxed = |node: Boxed| std::sync::Arc::new(node);
    prop_oneof![
        (point(), turn(), point(), turn(), point()).prop_map(
            |(translation, rotation, scale_factor, scale_orientation, center)| {
                Box::new(Transform { translation, rotation, scale_factor, scale_orientation, center }) as Boxed
            }
        ),
        (above_zero(), above_zero(), above_zero()).prop_map(|(width, height, depth)| Box::new(Cube {
            width,
            height,
            depth
        }) as Boxed),
        (proptest::option::of(point()), turn(), 0.1..3.0, proptest::option::of(1e-3..1e3)).prop_map(
            |(position, orientation, height_angle, near_distance)| {
                let far_distance = near_distance.map(|near: f64| near * 3.7);
                let camera = PerspectiveCamera {
                    position,
                    orientation,
                    height_angle,
                    near_distance,
                    far_distance,
                    aspect_ratio: height_angle,
                    viewport_mapping: ViewportMapping::CropViewportLineFrame,
                    look_at: None,
                };
                Box::new(camera) as Boxed
            }
        ),
        (-1e3..1e3, above_zero()).prop_map(|(left, width)| Box::new(FrustumCamera {
            left,
            right: left + width + 1.0,
            ..Default::default()
        }) as Boxed),
        (proptest::option::of(point()), above_zero()).prop_map(|(look_at, height)| Box::new(OrthographicCamera {
            look_at,
            height,
            ..Default::default()
        }) as Boxed),
        (any::<bool>(), 0f32..1e30, color(), -1e3..1e3).prop_map(|(on, intensity, color, x)| {
            Box::new(DirectionalLight { on, intensity, color, direction: DVec3::new(x, 1.0, -2.0), shadow: !on })
                as Boxed
        }),
        (color(), point())
            .prop_map(|(color, location)| Box::new(PointLight { color, location, ..Default::default() }) as Boxed),
        (colors(), colors(), colors(), proptest::collection::vec(0f32..=1.0, 0..3)).prop_map(
            |(ambient_color, diffuse_color, specular_color, shininess)| {
                let shininess = shininess.into();
                Box::new(Material { ambient_color, diffuse_color, specular_color, shininess, ..Default::default() })
                    as Boxed
            }
        ),
        colors().prop_map(|rgb| Box::new(BaseColor { rgb }) as Boxed),
        (0.0..=1.0, 0.0..=1.0)
            .prop_map(|(value, texture_quality)| Box::new(Complexity { value, texture_quality }) as Boxed),
        any::<u32>().prop_map(|unit| Box::new(TextureUnit { unit }) as Boxed),
        (any::<String>(), any::<bool>()).prop_map(|(filename, clamp)| {
            let wrap_t = if clamp { Wrap::Clamp } else { Wrap::Repeat };
            Box::new(Texture2 { filename, wrap_t, ..Default::default() }) as Boxed
        }),
        (
            above_zero(),
            proptest::option::of((above_zero(), above_zero())),
            number(),
            number(),
            proptest::option::of(number()),
            0..3usize,
            any::<bool>()
        )
            .prop_map(|(scale, size, max_height, base_height, void_sample, mode, culling)| {
                let size = size.map(|(x, y)| DVec2::new(x, y));
                let color_mode = [ColorMode::Plain, ColorMode::Parts, ColorMode::Levels][mode];
                let resolutions = [(16, 3), (2, 5), (64, 2)][mode];
                let detail = [DetailMode::PixelError(scale), DetailMode::Precision(scale), DetailMode::Full][mode];
                let terrain = SeamlessTerrain {
                    scale,
                    size,
                    max_height,
                    base_height,
                    void_sample,
                    color_mode,
                    culling,
                    resolutions,
                    detail,
                    ..Default::default()
                };
                Box::new(terrain) as Boxed
            }),
        any::<bool>().prop_map(|_| Box::new(ShaderProgram::default()) as Boxed),
    ]
    .prop_map(boxed)
}

/// How a random graph is put together: each step takes a group made before and gives it a new node or one made before.
#[derive(Debug, Clone)]
enum Step {
    Leaf(usize, std::sync::Arc<Boxed>),
    Group(usize, bool),
    Share(usize, usize),
    Name(usize, String),
}

fn step() -> impl Strategy<Value = Step> {
    let name = prop_oneof![any::<String>(), "shared_[1-4]", Just("Use(\"x\")\\ \n\t\u{0}ü€\u{1F5FB}".to_owned())];
    prop_oneof![
        4 => (any::<usize>(), leaf()).prop_map(|(at, node)| Step::Leaf(at, node)),
        2 => (any::<usize>(), any::<bool>()).prop_map(|(at, separator)| Step::Group(at, separator)),
        2 => (any::<usize>(), any::<usize>()).prop_map(|(at, node)| Step::Share(at, node)),
        1 => (any::<usize>(), name).prop_map(|(at, name)| Step::Name(at, name)),
    ]
}

fn build(steps: &[Step]) -> Scene {
    let mut scene = Scene::new();
    let mut groups = vec![scene.root()];
    let mut all = groups.clone();
    for step in steps {
        match step {
            Step::Leaf(at, node) => {
                let key = scene.insert_boxed(node.boxed_clone());
                scene.add_child(groups[at % groups.len()], key).unwrap();
                all.push(key);
            }
            Step::Group(at, separator) => {
                let parent = groups[at % groups.len()];
                let added = if *separator {
                    scene.add(parent, Separator::default())
                } else {
                    scene.add(parent, Group::default())
                };
                let added = added.unwrap();
                groups.push(added);
                all.push(added);
            }
            // A cycle is refused, which is as good.
            Step::Share(at, node) => drop(scene.add_child(groups[at % groups.len()], all[node % all.len()])),
            Step::Name(at, name) => drop(scene.set_name(all[at % all.len()], name.clone())),
        }
    }
    scene
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    /// Structure, sharing and all fields survive, to the last bit; so do names, and once all shared nodes have one, nothing
    /// changes any more.
    #[test]
    fn written_scenes_read_as_the_same_graph(steps in proptest::collection::vec(step(), 0..40)) {
        let scene = build(&steps);
        let text = write_scene(&scene).unwrap();
        let again = read(&text);
        prop_assert_eq!(shape_of(&again, false), shape_of(&scene, false));
        for (before, after) in shape_of(&scene, true).into_iter().zip(shape_of(&again, true)) {
            prop_assert!(before.2.is_none() || before.2 == after.2);
        }
        let third = read(&write_scene(&again).unwrap());
        prop_assert_eq!(shape_of(&third, true), shape_of(&again, true));
    }
}
