//! Scene files within scene files: what every action finds through a File, and what is said of files that can not be had.

use std::path::Path as FilePath;

use seamount::action::{CallbackAction, PrimitiveCount, walk::Go};
use seamount::format::{self, Problem, ReadError, load_files, parse, read_scene, write_scene};
use seamount::node::Registry;
use seamount::prelude::*;
use seamount::scene::{Sensor, Watched};
use tempfile::TempDir;

/// A folder with scene files: their names, and their roots.
fn folder(files: &[(&str, &str)]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, root) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, format!("Scene(version: 1, root: {root})")).unwrap();
    }
    folder
}

fn read(folder: &TempDir, name: &str) -> Scene {
    read_scene(folder.path().join(name)).unwrap_or_else(|error| panic!("{error}"))
}

/// What is said of a file, with the folder left out.
fn complaints(folder: &TempDir, name: &str) -> Vec<String> {
    let path = folder.path().join(name);
    let said = |error: ReadError| {
        let prefix = format!("{}/", folder.path().display());
        error.to_string().replace(&prefix, "").lines().map(str::to_owned).collect::<Vec<_>>()
    };
    let found = said(read_scene(&path).expect_err("a mistake"));
    assert_eq!(said(format::check(&path, &Registry::default()).expect_err("a mistake")), found);
    found
}

fn bounds(scene: &Scene) -> Aabb {
    BoundingBoxAction::default().apply(scene).unwrap().expect("a shape")
}

fn down(x: f64) -> RayPickAction {
    RayPickAction::ray(Ray::new(DVec3::new(x, 0.1, 50.0), DVec3::NEG_Z).unwrap())
}

/// The scene with each File replaced by a Group with what is in the file, in one text: what all actions have to find.
const NESTED: &[(&str, &str)] = &[
    (
        "all.ron",
        r#"Separator(children: [
            OrthographicCamera(position: (0, 0, 40), height: 60),
            File(name: "parts/pair.ron"),
            Cube(width: 1),
            Separator(children: [Translation(translation: (0, 20, 0)), File(name: "parts/pair.ron")]),
        ])"#,
    ),
    (
        "parts/pair.ron",
        r#"Group(children: [
            Def("one", Sphere()),
            Translation(translation: (5, 0, 0)),
            BaseColor(rgb: (1, 0, 0)),
            File(name: "../solids/block.ron"),
        ])"#,
    ),
    ("solids/block.ron", r#"Separator(children: [Translation(translation: (0, 0, 3)), Def("one", Cube(width: 3))])"#),
];

const FLAT: &str = r#"Scene(version: 1, root: Separator(children: [
    OrthographicCamera(position: (0, 0, 40), height: 60),
    Def("file", Group(children: [Def("pair", Group(children: [
        Sphere(),
        Translation(translation: (5, 0, 0)),
        BaseColor(rgb: (1, 0, 0)),
        Group(children: [Separator(children: [Translation(translation: (0, 0, 3)), Cube(width: 3)])]),
    ]))])),
    Cube(width: 1),
    Separator(children: [Translation(translation: (0, 20, 0)), Group(children: [Use("pair")])]),
]))"#;

#[test]
fn every_action_finds_what_it_finds_in_a_group() {
    let folder = folder(NESTED);
    let (nested, flat) = (read(&folder, "all.ron"), parse(FLAT, &Registry::default()).unwrap());
    assert_eq!(bounds(&nested), bounds(&flat));
    let oriented = |scene: &Scene| BoundingBoxAction::default().oriented(scene).unwrap();
    assert_eq!(oriented(&nested), oriented(&flat));
    let places = |paths: Vec<Path>| paths.iter().map(|p| p.indices().collect::<Vec<_>>()).collect::<Vec<_>>();
    for x in [0.05, 4.9, 5.1, 9.0] {
        let picked = |scene: &Scene| {
            let hits = RayPickAction { all: true, ..down(x) }.apply(scene).unwrap();
            let points: Vec<DVec3> = hits.iter().map(|hit| hit.point).collect();
            (points, places(hits.into_iter().map(|hit| hit.path).collect()))
        };
        assert_eq!(picked(&nested), picked(&flat), "{x}");
    }
    assert_eq!(down(5.1).apply(&nested).unwrap()[0].point.z, 4.0);
    for kind in ["Cube", "Sphere", "BaseColor", "Separator"] {
        let found = |scene: &Scene| {
            places(SearchAction { kind: Some(kind.into()), ..SearchAction::default() }.apply(scene).unwrap())
        };
        assert_eq!(found(&nested), found(&flat), "{kind}");
    }
    let count = |scene: &Scene| PrimitiveCountAction::default().apply(scene).unwrap();
    assert_eq!(count(&nested), count(&flat));
    assert!(count(&nested) != PrimitiveCount::default());
    let visited = |scene: &Scene| {
        let mut visited = Vec::new();
        let mut note = |visit: &seamount::action::Visit<'_>| visited.push(visit.path.indices().collect::<Vec<_>>());
        CallbackAction::new()
            .before(None, |visit| {
                note(visit);
                Go::On
            })
            .apply(scene)
            .unwrap();
        visited
    };
    assert_eq!(visited(&nested), visited(&flat));
    let drawn = |scene: &Scene| {
        let frame = RenderAction::new(64, 64).apply(scene).unwrap();
        frame.draws.iter().map(|draw| format!("{:?} {:?}", draw.material, draw.effects)).collect::<Vec<_>>()
    };
    assert_eq!(drawn(&nested), drawn(&flat));
    // What is in a file has the matrix of its place.
    let cube = SearchAction { name: Some("one".into()), ..SearchAction::default() }.apply(&nested).unwrap();
    let matrices = cube.iter().map(|p| MatrixAction::new(p.clone()).apply(&nested).unwrap().unwrap().translation);
    let expected = [DVec3::ZERO, DVec3::new(5.0, 0.0, 3.0), DVec3::new(5.0, 20.0, 0.0), DVec3::new(10.0, 20.0, 3.0)];
    assert_eq!(matrices.collect::<Vec<_>>(), expected, "the first File moves what follows it");
}

#[test]
fn paths_lead_through_files_to_what_is_in_them() {
    let folder = folder(NESTED);
    let scene = read(&folder, "all.ron");
    let hit = &down(5.1).apply(&scene).unwrap()[0];
    assert_eq!(hit.path.names(&scene), ["Separator", "File[1]", "Group[0]", "File[3]", "Separator[0]", "one"],);
    let cube = hit.path.tail().unwrap();
    assert!(scene.get::<Cube>(cube).is_some());
    assert!(scene.file(cube).unwrap().ends_with("solids/block.ron"));
    assert!(scene.position(cube).is_some());
    assert_eq!(scene.file(scene.root()), scene.source());
}

#[test]
fn a_file_named_twice_is_read_once_and_shared() {
    let folder = folder(NESTED);
    let scene = read(&folder, "all.ron");
    let files = SearchAction { kind: Some("File".into()), ..SearchAction::default() }.apply(&scene).unwrap();
    let shown: Vec<NodeKey> = files.iter().map(|p| scene.children(p.tail().unwrap())[0]).collect();
    assert_eq!(shown.len(), 4, "the pair stands in two places");
    assert_eq!((shown[0], shown[1]), (shown[2], shown[3]));
    // All nodes that were written in three files, each once.
    assert_eq!(scene.len(), 7 + 5 + 3);

    // Whatever the way to it.
    let names = ["a.ron", "./a.ron", "sub/../a.ron", folder.path().join("a.ron").to_str().unwrap()].map(str::to_owned);
    std::fs::create_dir(folder.path().join("sub")).unwrap();
    std::fs::write(folder.path().join("a.ron"), "Scene(version: 1, root: Cube)").unwrap();
    let mut scene = Scene::new();
    scene.set_source(folder.path().join("in_memory.ron"));
    let keys = names.map(|name| scene.add(scene.root(), File { name }).unwrap());
    load_files(&mut scene, &Registry::default()).unwrap();
    assert_eq!(keys.map(|key| scene.children(key)[0]), [scene.children(keys[0])[0]; 4]);
    assert_eq!(scene.len(), 6);
}

#[test]
fn names_mean_what_they_mean_in_their_own_file() {
    let folder = folder(&[
        ("all.ron", r#"Group(children: [File(name: "b.ron"), Def("a", Cube()), Use("a"), Def("only here", Cone())])"#),
        ("b.ron", r#"Group(children: [Def("a", Sphere()), Use("a"), Def("only there", Cone())])"#),
        ("use.ron", r#"Group(children: [File(name: "b.ron"), Use("only there")])"#),
        ("used.ron", r#"Group(children: [Def("only here", Cone()), File(name: "uses.ron")])"#),
        ("uses.ron", r#"Group(children: [Use("only here")])"#),
    ]);
    let scene = read(&folder, "all.ron");
    assert!(scene.get::<Cube>(scene.find("a").unwrap()).is_some());
    assert_eq!((scene.names(), scene.find("only there")), (vec!["a", "only here"], None));
    let found = |name: &str| SearchAction { name: Some(name.into()), ..SearchAction::default() }.apply(&scene).unwrap();
    assert_eq!((found("a").len(), found("only there").len(), found("only here").len()), (4, 1, 1));

    let expected = r#"use.ron:1:63: there is no Def("only there", …) for this Use"#;
    assert_eq!(complaints(&folder, "use.ron"), [expected]);
    let expected = r#"uses.ron:1:42: there is no Def("only here", …) for this Use"#;
    assert_eq!(complaints(&folder, "used.ron"), [expected]);
}

#[test]
fn names_of_files_are_relative_to_the_file_in_which_they_stand() {
    let folder = folder(&[
        (
            "all.ron",
            r#"Group(children: [File(name: "deep/er/map.ron"), Texture2(filename: "map.png"), SeamlessTerrain()])"#,
        ),
        ("deep/er/map.ron", r#"Separator(children: [Texture2(filename: "../map.png"), SeamlessTerrain()])"#),
    ]);
    let save = |name: &str, side: u32| {
        image::GrayImage::from_pixel(side, side, image::Luma([9])).save(folder.path().join(name)).unwrap();
    };
    save("map.png", 4);
    save("deep/map.png", 7);
    let scene = read(&folder, "all.ron");
    bounds(&scene);
    let size = |terrain: usize| {
        let found = SearchAction { kind: Some("Texture2".into()), ..SearchAction::default() }.apply(&scene).unwrap();
        let key = found[terrain].tail().unwrap();
        let path = scene.resolve(key, &scene.get::<Texture2>(key).unwrap().filename);
        scene.resources().image(&path).unwrap().width()
    };
    assert_eq!((size(0), size(1)), (7, 4));
    assert_eq!(format::check(folder.path().join("all.ron"), &Registry::default()).unwrap(), scene.len());

    // The heights of what a File shows can be edited like others.
    let mut scene = scene;
    let inner =
        SearchAction { kind: Some("Texture2".into()), ..SearchAction::default() }.apply(&scene).unwrap()[0].tail();
    let rect = seamount::terrain::SampleRect { column: 6, row: 6, columns: 1, rows: 1 };
    scene.set_heights(inner.unwrap(), rect, &Pixels::Gray8(vec![255])).unwrap();

    // What is missing is missed where it was named, whether a map or a shader.
    std::fs::remove_file(folder.path().join("deep/map.png")).unwrap();
    let missing = "there is no file deep/er/../map.png: check the name, it is relative to the folder of the file in which it stands";
    assert_eq!(complaints(&folder, "all.ron"), [format!("deep/er/map.ron:1:65: {missing}")]);
    let shader =
        "Separator(children: [ShaderProgram(shader_object: [VertexShader(source_program: File(\"a.wgsl\"))])])";
    std::fs::write(folder.path().join("deep/er/map.ron"), format!("Scene(version: 1, root: {shader})")).unwrap();
    assert!(complaints(&folder, "all.ron")[0].starts_with("deep/er/map.ron:1:"));
    std::fs::write(folder.path().join("deep/er/a.wgsl"), "fn vertex_shader(vertex: Vertex) -> vec3f {}").unwrap();
    read(&folder, "all.ron");
}

#[test]
fn errors_of_actions_say_the_file_too() {
    let folder = folder(&[
        ("all.ron", r#"Group(children: [PerspectiveCamera(), File(name: "in/b.ron")])"#),
        ("in/b.ron", "Group(children: [\n  SeamlessTerrain(),\n])"),
    ]);
    let scene = read(&folder, "all.ron");
    let error = BoundingBoxAction::default().apply(&scene).unwrap_err();
    let file = folder.path().join("in/b.ron");
    let ActionError::Shape { place, .. } = &error else { panic!("{error:?}") };
    let position = place.position.unwrap();
    assert_eq!((place.file.as_ref(), position.line, position.column), (Some(&file), 2, 3));
    assert_eq!(place.path.join("/"), "Group/File[1]/Group[0]/SeamlessTerrain[0]");
    let expected = format!("{}:2:3: Group/File[1]/Group[0]/SeamlessTerrain[0]: there is no height map", file.display());
    assert!(error.to_string().starts_with(&expected), "{error}");
    // A check finds the same, as a mistake of that file.
    let error = format::check(folder.path().join("all.ron"), &Registry::default()).unwrap_err();
    assert_eq!(error.mistakes()[0].file.as_ref(), Some(&file));
    assert!(error.to_string().starts_with(&format!("{}:2:3: there is no height map", file.display())), "{error}");
}

#[test]
fn mistakes_of_all_files_are_told_in_order_each_with_its_file() {
    let folder = folder(&[
        (
            "all.ron",
            "Group(children: [\n  File(name: \"no.ron\"),\n  File(name: \"bad.ron\"),\n  File(name: \"bad.ron\"),\n  \
             File(name: \"worse.ron\"),\n  File(name: \"folder\"),\n  File(name: \"picture.ron\"),\n])",
        ),
        ("bad.ron", "Group(children: [\n  Cubs(),\n  Cube(width: -1),\n])"),
        ("worse.ron", "Group(children: [\n  File(name: \"no.ron\"),\n])"),
        ("folder/a.ron", "Cube()"),
    ]);
    std::fs::write(folder.path().join("picture.ron"), b"Scene(\xff").unwrap();
    let missing =
        "there is no file no.ron: check the name, it is relative to the folder of the file in which it stands";
    assert_eq!(
        complaints(&folder, "all.ron"),
        [
            format!("all.ron:2:14: {missing}"),
            "all.ron:6:14: can not read folder: it is no regular file".to_owned(),
            "bad.ron:2:3: unknown node `Cubs`, did you mean `Cube`?".to_owned(),
            "bad.ron:3:15: `width`: -1 does not work: lengths go from 0 up".to_owned(),
            format!("worse.ron:2:14: {missing}"),
            "picture.ron:1:7: the file is not UTF-8 text from here on (byte 0xff): save it as UTF-8".to_owned(),
        ]
    );
    let error = read_scene(folder.path().join("all.ron")).unwrap_err();
    assert_eq!(error.path(), Some(folder.path().join("all.ron").as_path()));
    assert_eq!(error.mistakes()[0].path_in_tree, ["Group", "File[0]"]);
    assert!(matches!(error.mistakes()[0].problem, Problem::File(_)));
    assert_eq!(error.mistakes()[4].path_in_tree, ["Group", "File[3]", "Group[0]", "File[0]"]);
}

#[test]
fn files_that_come_back_to_themselves_are_refused_with_the_way() {
    let folder = folder(&[
        ("one.ron", "Group(children: [\n  File(name: \"one.ron\"),\n])"),
        ("a.ron", r#"File(name: "in/b.ron")"#),
        ("in/b.ron", r#"File(name: "../a.ron")"#),
        ("x.ron", r#"Group(children: [Cube(), File(name: "y.ron")])"#),
        ("y.ron", r#"Group(children: [Cube(), File(name: "z.ron")])"#),
        ("z.ron", r#"Group(children: [Cube(), File(name: "in/../x.ron")])"#),
        ("to_y.ron", r#"Group(children: [File(name: "y.ron"), File(name: "x.ron")])"#),
    ]);
    let said = |files: &str| format!("a file can not be in itself: {files}; take one of these Files away");
    assert_eq!(complaints(&folder, "one.ron"), [format!("one.ron:2:14: {}", said("one.ron names one.ron"))]);
    let expected = said("a.ron names in/b.ron names a.ron");
    assert_eq!(complaints(&folder, "a.ron"), [format!("in/b.ron:1:36: {expected}")]);
    let expected = said("x.ron names y.ron names z.ron names x.ron");
    assert_eq!(complaints(&folder, "x.ron"), [format!("z.ron:1:61: {expected}")]);
    // Who only leads to a cycle is not to blame.
    let expected = said("y.ron names z.ron names in/../x.ron names y.ron");
    assert_eq!(complaints(&folder, "to_y.ron"), [format!("in/../x.ron:1:61: {expected}")]);

    // A cycle that is closed in code, where nothing of it is new.
    let mut scene = Scene::new();
    scene.set_source(folder.path().join("code.ron"));
    std::fs::write(folder.path().join("p.ron"), "Scene(version: 1, root: Group(children: [Def(\"f\", File())]))")
        .unwrap();
    std::fs::write(folder.path().join("q.ron"), "Scene(version: 1, root: Group(children: [Def(\"f\", File())]))")
        .unwrap();
    for name in ["p.ron", "q.ron"] {
        scene.add(scene.root(), File { name: name.into() }).unwrap();
    }
    load_files(&mut scene, &Registry::default()).unwrap();
    let inner = SearchAction { name: Some("f".into()), ..SearchAction::default() }.apply(&scene).unwrap();
    let [p, q] = [0, 1].map(|k: usize| inner[k].tail().unwrap());
    scene.edit::<File>(p).unwrap().name = "q.ron".into();
    scene.edit::<File>(q).unwrap().name = "p.ron".into();
    let before = scene.len();
    let error = load_files(&mut scene, &Registry::default()).unwrap_err();
    assert!(matches!(error.mistakes()[0].problem, Problem::FileCycle { .. }), "{error}");
    assert!(scene.children(p).is_empty() && scene.children(q).is_empty() && scene.len() == before);
    // Either of them alone is none. And a scene can not be in itself even before it is put there.
    scene.edit::<File>(q).unwrap().name = String::new();
    load_files(&mut scene, &Registry::default()).unwrap();
    std::fs::write(folder.path().join("code.ron"), "Scene(version: 1, root: Cube)").unwrap();
    scene.insert(File { name: "code.ron".into() });
    let error = load_files(&mut scene, &Registry::default()).unwrap_err();
    assert!(error.to_string().contains("can not be in itself"), "{error}");
}

#[test]
fn a_chain_of_a_thousand_files_is_read_and_walked() {
    let folder = tempfile::tempdir().unwrap();
    for k in 0..1000 {
        let next = if k == 999 { "Cube()".to_owned() } else { format!("File(name: \"{}.ron\")", k + 1) };
        let root = format!("Group(children: [Translation(translation: (1, 0, 0)), {next}])");
        std::fs::write(folder.path().join(format!("{k}.ron")), format!("Scene(version: 1, root: {root})")).unwrap();
    }
    let scene = read(&folder, "0.ron");
    assert_eq!(bounds(&scene).max.x, 1001.0);
    let hit = &down(1000.5).apply(&scene).unwrap()[0];
    assert_eq!(hit.path.len(), 2 * 1000);
    assert_eq!(format::check(folder.path().join("0.ron"), &Registry::default()).unwrap(), 3000);
    // And if the last one comes back to the first, the message names them all.
    std::fs::write(folder.path().join("999.ron"), "Scene(version: 1, root: File(name: \"0.ron\"))").unwrap();
    let error = read_scene(folder.path().join("0.ron")).unwrap_err();
    let Problem::FileCycle { chain } = &error.mistakes()[0].problem else { panic!("{error}") };
    assert_eq!((chain.len(), chain.first()), (1001, chain.last()));
}

#[test]
fn files_made_in_code_are_loaded_when_asked_for() {
    let folder =
        folder(&[("a.ron", "Cube(width: 4)"), ("b.ron", "Group(children: [Cube(width: 6)])"), ("c.ron", "Cubs()")]);
    let registry = Registry::default();
    let mut scene = Scene::new();
    let root = scene.root();
    scene.set_source(folder.path().join("all.ron"));
    let file = scene.add(root, File { name: "a.ron".into() }).unwrap();
    scene.add(root, Cube::default()).unwrap();
    // Nothing is shown in silence instead of what is named.
    let refused = |scene: &Scene| {
        let error = BoundingBoxAction::default().apply(scene).unwrap_err();
        assert!(error.to_string().contains("is not loaded: call `format::load_files`"), "{error}");
        assert!(SearchAction { kind: Some("Cube".into()), ..SearchAction::default() }.apply(scene).is_err());
        assert!(down(0.1).apply(scene).is_err());
    };
    refused(&scene);
    load_files(&mut scene, &registry).unwrap();
    assert_eq!(bounds(&scene).max.x, 2.0);
    let mut told = Sensor::new(&scene, Watched::Subtree(root), |_| {});
    scene.edit::<File>(file).unwrap().name = "b.ron".into();
    refused(&scene);
    load_files(&mut scene, &registry).unwrap();
    assert!(told.check(&scene));
    assert_eq!(bounds(&scene).max.x, 3.0);
    let version = scene.version();
    load_files(&mut scene, &registry).unwrap();
    assert_eq!(scene.version(), version, "there is nothing to do");

    // What can not be loaded leaves all as it was.
    scene.edit::<File>(file).unwrap().name = "a.ron".into();
    let other = scene.add(root, File { name: "c.ron".into() }).unwrap();
    let (nodes, shown) = (scene.len(), scene.children(file).to_vec());
    let error = load_files(&mut scene, &registry).unwrap_err();
    assert_eq!(error.mistakes().len(), 1, "{error}");
    assert_eq!((scene.len(), scene.children(file), scene.children(other).len()), (nodes, &shown[..], 0));
    scene.remove(other).unwrap();
    load_files(&mut scene, &registry).unwrap();
    assert_eq!(bounds(&scene).max.x, 2.0);
    let showing = scene.len();
    scene.edit::<File>(file).unwrap().name = String::new();
    load_files(&mut scene, &registry).unwrap();
    assert_eq!(bounds(&scene).max.x, 1.0);
    // What nobody shows any more is gone, and named again it is read again.
    assert_eq!(scene.len(), showing - 1);
    std::fs::write(folder.path().join("a.ron"), "Scene(version: 1, root: Cube(width: 7))").unwrap();
    scene.edit::<File>(file).unwrap().name = "a.ron".into();
    load_files(&mut scene, &registry).unwrap();
    assert_eq!((bounds(&scene).max.x, scene.len()), (3.5, showing));
    // So is what was only in it; what stands elsewhere stays.
    std::fs::write(
        folder.path().join("outer.ron"),
        "Scene(version: 1, root: Group(children: [File(name: \"a.ron\")]))",
    )
    .unwrap();
    let outer = scene.add(root, File { name: "outer.ron".into() }).unwrap();
    load_files(&mut scene, &registry).unwrap();
    assert_eq!(scene.len(), showing + 3);
    scene.edit::<File>(file).unwrap().name = String::new();
    load_files(&mut scene, &registry).unwrap();
    assert_eq!((bounds(&scene).max.x, scene.len()), (3.5, showing + 3));
    scene.edit::<File>(outer).unwrap().name = String::new();
    load_files(&mut scene, &registry).unwrap();
    assert_eq!((bounds(&scene).max.x, scene.len()), (1.0, 3 + 1));

    // A File that is taken away shows nothing, and another that names the same file reads it again.
    let again = scene.add(root, File { name: "a.ron".into() }).unwrap();
    load_files(&mut scene, &registry).unwrap();
    assert_eq!(bounds(&scene).max.x, 3.5);
    scene.remove(again).unwrap();
    std::fs::write(folder.path().join("a.ron"), "Scene(version: 1, root: Cube(width: 9))").unwrap();
    scene.add(root, File { name: "a.ron".into() }).unwrap();
    load_files(&mut scene, &registry).unwrap();
    assert_eq!((bounds(&scene).max.x, scene.len()), (4.5, 3 + 1 + 2));

    // In another folder the same name means another file.
    let elsewhere = self::folder(&[("a.ron", "Cube(width: 20)")]);
    scene.set_source(folder.path().join("another.ron"));
    assert_eq!(bounds(&scene).max.x, 4.5);
    scene.set_source(elsewhere.path().join("all.ron"));
    refused(&scene);
    load_files(&mut scene, &registry).unwrap();
    assert_eq!((bounds(&scene).max.x, scene.len()), (10.0, 3 + 1 + 2));
    std::fs::write(folder.path().join("a.ron"), "Scene(version: 1, root: Cube(width: 7))").unwrap();

    // A text becomes the scene of a file when it is told which.
    let mut scene = parse("Scene(version: 1, root: File(name: \"a.ron\"))", &registry).unwrap();
    refused(&scene);
    scene.set_source(folder.path().join("text.ron"));
    load_files(&mut scene, &registry).unwrap();
    assert_eq!(bounds(&scene).max.x, 3.5);
}

#[test]
fn what_a_file_shows_stands_nowhere_else() {
    let folder = folder(&[("a.ron", "Group(children: [Def(\"x\", Cube(width: 4))])")]);
    let mut scene = Scene::new();
    let root = scene.root();
    scene.set_source(folder.path().join("all.ron"));
    let file = scene.add(root, File { name: "a.ron".into() }).unwrap();
    load_files(&mut scene, &Registry::default()).unwrap();
    let group = scene.children(file)[0];
    let inner = scene.children(group)[0];
    let own = scene.insert(Cube::default());
    assert_eq!(scene.add_child(root, inner), Err(EditError::OtherFile));
    assert_eq!(scene.add_child(group, own), Err(EditError::OtherFile));
    assert_eq!(scene.set_root(group), Err(EditError::OtherFile));
    assert_eq!(scene.add_child(file, own), Err(EditError::NotAGroup { kind: "File" }));
    assert_eq!(scene.add(file, Cube::default()), Err(EditError::NotAGroup { kind: "File" }));
    // In it there are edits, and names, as anywhere; boxes follow.
    assert_eq!(bounds(&scene).max.x, 2.0);
    scene.edit::<Cube>(inner).unwrap().width = 8.0;
    assert_eq!(bounds(&scene).max.x, 4.0);
    let more = scene.add(group, Cube { width: 10.0, ..Cube::default() }).unwrap();
    assert_eq!(scene.set_name(more, "x"), Err(EditError::NameTaken("x".into())));
    scene.set_name(own, "x").unwrap();
    assert_eq!(bounds(&scene).max.x, 5.0);
    assert_eq!(scene.file(more), scene.file(inner));
    // What was taken away is read again, and nothing of it stays.
    let nodes = scene.len() - 1;
    scene.remove(group).unwrap();
    assert!(BoundingBoxAction::default().apply(&scene).is_err());
    load_files(&mut scene, &Registry::default()).unwrap();
    // But for what was added to it.
    assert_eq!((bounds(&scene).max.x, scene.len()), (2.0, nodes));
}

#[test]
fn writing_keeps_the_name_and_never_goes_into_the_file() {
    let folder = folder(NESTED);
    let mut scene = read(&folder, "all.ron");
    let text = write_scene(&scene).unwrap();
    assert_eq!(text.matches("File(name: \"parts/pair.ron\")").count(), 2, "{text}");
    assert!(!text.contains("Sphere") && !text.contains("Def("), "{text}");
    // Edits below a File are in no file, and neither are names there.
    let inner = SearchAction { name: Some("one".into()), ..SearchAction::default() }.apply(&scene).unwrap();
    scene.edit::<Sphere>(inner[0].tail().unwrap()).unwrap().radius = 9.0;
    assert_eq!(write_scene(&scene).unwrap(), text);
    format::save_scene(&scene, folder.path().join("again.ron")).unwrap();
    let again = read(&folder, "again.ron");
    assert_eq!(write_scene(&again).unwrap(), text);
    assert_eq!(again.len(), scene.len());
    // A File that is shared is written once.
    let file = SearchAction { kind: Some("File".into()), ..SearchAction::default() }.apply(&scene).unwrap()[0].tail();
    scene.add_child(scene.root(), file.unwrap()).unwrap();
    let text = write_scene(&scene).unwrap();
    assert!(text.contains("Def(\"shared_1\", File(name: \"parts/pair.ron\"))"), "{text}");
    assert_eq!(write_scene(&parse(&text, &Registry::default()).unwrap()).unwrap(), text);
}

#[test]
fn the_scene_in_the_folder_of_scenes_shows_another() {
    let path = FilePath::new(env!("CARGO_MANIFEST_DIR")).join("scenes/village.ron");
    let scene = read_scene(&path).unwrap();
    assert_eq!(format::check(&path, &Registry::default()).unwrap(), scene.len());
    let walls = SearchAction { name: Some("walls".into()), ..SearchAction::default() }.apply(&scene).unwrap();
    // Copies of an Array are one place.
    assert_eq!(walls.len(), 3);
    assert!(scene.file(walls[0].tail().unwrap()).unwrap().ends_with("parts/house.ron"));
}
