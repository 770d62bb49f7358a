//! The command as a user meets it: exit status, output, and what is left on the disk.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use serde_json::Value;

fn seamount() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_seamount"));
    command.current_dir(env!("CARGO_MANIFEST_DIR"));
    command
}

fn run(args: &[&str]) -> Output {
    seamount().args(args).output().unwrap()
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

/// Standard output of a success.
fn good(args: &[&str]) -> String {
    let output = run(args);
    assert_eq!(output.status.code(), Some(0), "{args:?}: {}", text(&output.stderr));
    text(&output.stdout).to_owned()
}

fn json(args: &[&str]) -> Value {
    serde_json::from_str(&good(args)).unwrap()
}

/// The errors of a failure with this exit status.
fn bad(status: i32, args: &[&str]) -> String {
    let output = run(args);
    assert_eq!(output.status.code(), Some(status), "{args:?}: {}", text(&output.stderr));
    assert!(output.stdout.is_empty(), "{args:?}: {}", text(&output.stdout));
    text(&output.stderr).to_owned()
}

fn path(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn write(folder: &Path, name: &str, content: &str) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, content).unwrap();
    path
}

const FUJI: &str = "scenes/fuji.ron";
const CUBE: &str = "Scene(version: 1, root: Separator(children: [Def(\"box\", Cube(width: 4))]))";

#[test]
fn wrong_usage_has_exit_status_2() {
    for args in [
        &["render", FUJI][..],
        &["render", "-o", "a.png"],
        &["render", FUJI, "-o", "a.png", "--size", "0x0"],
        &["render", FUJI, "-o", "a.png", "--size", "12"],
        &["render", FUJI, "-o", "a.png", "--background", "blue"],
        &["pick", FUJI],
        &["pick", FUJI, "--ray", "1,2,3"],
        &["pick", FUJI, "--ray", "0,0,0,0,0,0"],
        &["pick", FUJI, "--ray", "0,0,NaN,0,0,1"],
        &["pick", FUJI, "--pixel", "-1,5"],
        &["pick", FUJI, "--pixel", "1280,5"],
        &["pick", FUJI, "--pixel", "1,1", "--ray", "0,0,9,0,0,-1"],
        &["generate", "--size", "1", "-o", "a.png"],
        &["generate", "--size", "5"],
        &["check"],
        &["fly"],
        &[],
    ] {
        let message = bad(2, args);
        assert!(!message.is_empty(), "{args:?}");
    }
    assert!(bad(2, &["pick", FUJI, "--pixel", "1280,5"]).contains("pixels count from 0,0 to 1279,719"));
}

#[test]
fn help_names_all_commands() {
    let help = good(&["--help"]);
    for command in ["render", "pick", "sight", "bbox", "check", "effects", "tree", "generate", "nodes"] {
        assert!(help.contains(command), "{help}");
        assert!(good(&[command, "--help"]).contains("Usage"));
    }
}

#[test]
fn nodes_are_described() {
    assert!(good(&["nodes"]).lines().any(|line| line.starts_with("Cube ") && line.contains("shape")));
    assert!(good(&["nodes", "Cube"]).contains("| `width` | number | `2.0` |"));
    let cube = json(&["nodes", "Cube", "--json"]);
    assert_eq!((&cube["kind"], &cube["fields"][0]["name"]), (&"Cube".into(), &"width".into()));
    let all = json(&["nodes", "--json"]);
    assert!(all.as_array().is_some_and(|all| all.len() > 40));
    assert!(bad(2, &["nodes", "Cub"]).contains("did you mean `Cube`?"));
}

#[test]
fn errors_say_where() {
    let folder = tempfile::tempdir().unwrap();
    let wrong = write(
        folder.path(),
        "wrong.ron",
        "Scene(version: 1, root: Separator(children: [\n  Cub(),\n  Cube(width: NaN),\n]))",
    );
    let errors = bad(1, &["bbox", path(&wrong)]);
    let lines: Vec<&str> = errors.lines().collect();
    assert_eq!(lines[0], format!("error: {}:2:3: unknown node `Cub`, did you mean `Cube`?", wrong.display()));
    assert!(lines[1].starts_with(&format!("error: {}:3:15: `width`: NaN", wrong.display())));
    assert_eq!(bad(1, &["tree", "none.ron"]), "error: there is no file none.ron: check the name and the folder\n");
    assert!(bad(1, &["bbox", "none.png"]).starts_with("error: there is no file none.png"));
    let bare = write(folder.path(), "bare.ron", "Scene(version: 1, root: Separator(children: [SeamlessTerrain]))");
    assert!(bad(1, &["bbox", path(&bare)]).starts_with(&format!("error: {}:1:46: ", bare.display())));
}

#[test]
fn check_prints_mistakes_and_fails() {
    let folder = tempfile::tempdir().unwrap();
    let fine = write(folder.path(), "fine.ron", CUBE);
    let wrong = write(folder.path(), "wrong.ron", "Scene(version: 1, root: Group(children: [Cub, Cube(size: 1)]))");
    assert_eq!(good(&["check", path(&fine), FUJI, "scenes/walls.png"]), "");
    let output = run(&["check", path(&wrong), path(&fine), "none.ron", "Cargo.toml"]);
    assert_eq!(output.status.code(), Some(1));
    let lines: Vec<&str> = text(&output.stdout).lines().collect();
    assert_eq!(lines.len(), 4, "{lines:?}");
    assert_eq!(lines[0], format!("{}:1:42: unknown node `Cub`, did you mean `Cube`?", wrong.display()));
    assert!(lines[1].starts_with(&format!("{}:1:52: Cube has no field `size`", wrong.display())));
    assert!(lines[2].starts_with("none.ron: there is no file"));
    assert!(lines[3].starts_with("Cargo.toml:1:1: a scene file starts with"));
}

/// Mistakes in a scene's own shaders are found without drawing, and told as `render` tells them.
#[test]
fn check_compiles_shaders_as_render_does() {
    let folder = tempfile::tempdir().unwrap();
    write(
        folder.path(),
        "wrong.wgsl",
        "fn fragment_shader(fragment: Fragment) -> vec3f {\n    return vec3f(read);\n}\n",
    );
    let scene = |name: &str, camera: &str, source: &str| {
        let text = format!(
            "Scene(version: 1, root: Separator(children: [{camera}\n  ShaderProgram(shader_object: [\n    \
             FragmentShader(source_program: {source})\n  ]),\n  Cube(),\n]))"
        );
        write(folder.path(), name, &text)
    };
    let file = folder.path().join("wrong.wgsl");
    let inline = "Wgsl(\"fn fragment_shader(fragment: Fragment) -> vec3f { return vec3f(read); }\")";
    for camera in ["PerspectiveCamera(),", ""] {
        let good_one =
            scene("good.ron", camera, "Wgsl(\"fn fragment_shader(f: Fragment) -> vec3f { return f.color; }\")");
        assert_eq!(good(&["check", path(&good_one)]), "");
        for (name, source, place) in [
            ("file.ron", "File(\"wrong.wgsl\")", format!("{}:2:18: ", file.display())),
            ("inline.ron", inline, format!("{}:3:5: ", folder.path().join("inline.ron").display())),
        ] {
            let scene = scene(name, camera, source);
            let output = run(&["check", path(&scene)]);
            assert_eq!(output.status.code(), Some(1));
            let said = text(&output.stdout);
            assert!(said.starts_with(&place) && said.contains("`read`") && said.lines().count() == 1, "{said}");
            if !camera.is_empty() {
                let target = folder.path().join("never.png");
                let drawn = bad(1, &["render", path(&scene), "-o", path(&target), "--size", "8x8"]);
                assert!(drawn.contains(&format!("error: {said}")), "{drawn} does not say {said}");
                assert!(!target.exists());
            }
        }
    }
}

#[test]
fn bbox() {
    let found = json(&["bbox", FUJI, "--json"]);
    assert_eq!(found["empty"], false);
    assert_eq!(found["min"], serde_json::json!([0.0, 0.0, -16.0]));
    assert_eq!(found["max"], serde_json::json!([90600.0, 111_240.0, 3742.0]));
    let folder = tempfile::tempdir().unwrap();
    let empty = write(folder.path(), "empty.ron", "Scene(version: 1, root: Separator())");
    let found = json(&["bbox", path(&empty), "--json"]);
    assert_eq!(found, serde_json::json!({ "empty": true, "min": null, "max": null }));
    assert_eq!(good(&["bbox", path(&empty)]), "empty\n");
    // A map alone: cells of one unit, a relief of an eighth.
    let found = json(&["bbox", "scenes/walls.png", "--json"]);
    assert_eq!(found["max"], serde_json::json!([700.0, 511.0, 87.5]));
}

#[test]
fn tree_shows_names_sharing_and_values() {
    let folder = tempfile::tempdir().unwrap();
    let scene = write(
        folder.path(),
        "a.ron",
        "Scene(version: 1, root: Separator(children: [Def(\"g\", Group(children: [Cube(width: 2.0, depth: 3)])), Use(\"g\")]))",
    );
    assert_eq!(
        good(&["tree", path(&scene)]),
        "Separator\n  Group \"g\" (in 2 places)\n    Cube depth: 3.0\n  Group \"g\" (again)\n"
    );
    assert!(good(&["tree", "scenes/walls.png"]).contains("SeamlessTerrain"));
}

/// Each draw with its effects, who asked for them, and what they take.
#[test]
fn effects_lists_draws_with_what_they_ask_for() {
    let scene = "scenes/cubes.ron";
    let text = good(&["effects", scene, "--size", "64x48"]);
    assert!(
        text.lines().any(|l| l.trim_start().starts_with("point-light×1") && l.ends_with("PointLight[3]")),
        "{text}"
    );
    let rows: Vec<Value> = good(&["effects", scene, "--size", "64x48", "--json"])
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(rows.len(), 16);
    for row in &rows {
        let names: Vec<&str> = row["effects"].as_array().unwrap().iter().map(|e| e["name"].as_str().unwrap()).collect();
        assert_eq!(names, ["directional-light×1", "point-light×1", "ambient"]);
        assert_eq!(row["effects"][0]["asked_by"][0][1], "DirectionalLight[2]");
        assert_eq!((row["shader"].as_u64(), row["texture_bytes"].as_u64()), (Some(0), Some(0)), "one shader for all");
        assert!(row["shader_bytes"].as_u64() > Some(500) && row["uniform_bytes"].as_u64() > Some(100), "{row}");
    }
}

/// What is behind the draws comes first: a sky with its shader, a plain background that takes nothing.
#[test]
fn effects_lists_what_is_behind() {
    let folder = tempfile::tempdir().unwrap();
    for (background, name) in [("zenith: (0.1, 0.2, 0.8)", "sky"), ("color: (1.0, 0.0, 0.0)", "background")] {
        let text = format!(
            "Scene(version: 1, root: Separator(children: [PerspectiveCamera(), Background({background}),
             PolygonOffset(), Def(\"box\", Cube())]))"
        );
        let scene = write(folder.path(), "behind.ron", &text);
        let rows: Vec<Value> = good(&["effects", path(&scene), "--size", "64x48", "--json"])
            .lines()
            .map(|line| serde_json::from_str(line).unwrap())
            .collect();
        let [behind, cube] = rows.as_slice() else { panic!("{rows:?}") };
        assert_eq!(behind["path"], serde_json::json!(["Separator", "Background[1]"]));
        assert_eq!(
            (&behind["effects"][0]["name"], &behind["effects"][0]["asked_by"][0]),
            (&name.into(), &behind["path"])
        );
        assert_eq!(behind["shader"].is_null(), name == "background", "{behind}");
        assert_eq!(behind["shader_bytes"].as_u64() > Some(0), name == "sky", "{behind}");
        assert_eq!(cube["effects"][0]["name"], "polygon-offset");
        assert_eq!(cube["effects"][0]["asked_by"][0][1], "PolygonOffset[2]");
        assert!(good(&["effects", path(&scene), "--size", "64x48"]).starts_with("Separator/Background[1]\n"));
    }
}

#[test]
fn pick_one() {
    let folder = tempfile::tempdir().unwrap();
    let cube = write(folder.path(), "cube.ron", CUBE);
    let found = json(&["pick", path(&cube), "--ray", "0.5,0.5,9,0,0,-2", "--all", "--json"]);
    let hits = found["hits"].as_array().unwrap();
    assert_eq!(hits.len(), 2);
    assert_eq!(hits[0]["point"], serde_json::json!([0.5, 0.5, 1.0]));
    assert_eq!(hits[0]["normal"], serde_json::json!([0.0, 0.0, 1.0]));
    assert_eq!(hits[0]["distance"], 8.0);
    assert_eq!(hits[0]["path"], serde_json::json!(["Separator", "box"]));
    assert_eq!((&hits[0]["surface"], &hits[0]["error_bound"]), (&"exact".into(), &0.0.into()));
    assert!(hits[0]["terrain"].is_null() && hits[0]["uv"].is_array());
    assert_eq!((&hits[0]["object_point"], &hits[0]["object_normal"]), (&hits[0]["point"], &hits[0]["normal"]));
    assert!(hits[0]["detail"]["triangle"]["index"].is_u64() && hits[0]["on_top"] == false);
    let identity = serde_json::json!([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]]);
    assert_eq!((&hits[0]["local_to_world"], &hits[0]["world_to_local"]), (&identity, &identity));
    assert_eq!(json(&["pick", path(&cube), "--ray", "0,0,9,0,0,1", "--json"]), serde_json::json!({ "hits": [] }));
    assert_eq!(good(&["pick", path(&cube), "--ray", "0 0 9 0 0 1"]), "nothing hit\n");
    assert!(bad(1, &["pick", path(&cube), "--pixel", "0,0"]).contains("the scene has no camera"));

    // The middle of the same pixel, from the other corner.
    let through = |how: &str, at: &str| json(&["pick", FUJI, "--size", "128x64", how, at, "--json"]);
    assert_eq!(through("--normalized", "0.50390625,0.4921875"), through("--pixel", "64,32"));
    assert!(bad(2, &["pick", FUJI, "--normalized", "0.5,1.5"]).contains("from 0 to 1"));
    let found = json(&["pick", FUJI, "--pixel", "640,360", "--json"]);
    let hit = &found["hits"][0];
    assert_eq!(hit["surface"], "coarse");
    assert!(hit["error_bound"].as_f64().unwrap() > 0.0);
    let terrain = &hit["terrain"];
    assert_eq!(terrain["height"], hit["point"][2]);
    for field in ["level", "patch", "cell", "triangle", "wall", "void", "slope", "entering"] {
        assert!(!terrain[field].is_null(), "{field}");
    }
    // The cell is the one that the point lies in: 75.5 m wide, 1200 of them.
    assert_eq!(terrain["cell"]["column"].as_f64().unwrap(), (hit["point"][0].as_f64().unwrap() / 75.5).floor());
    assert!(bad(1, &["pick", FUJI, "--pixel", "1,1", "--camera", "none"]).contains("no camera named \"none\""));
}

#[test]
fn rays_give_a_line_each() {
    let folder = tempfile::tempdir().unwrap();
    let cube = write(folder.path(), "cube.ron", CUBE);
    let rays = folder.path().join("rays");
    let mut lines: Vec<u8> =
        b"0.5,0.5,9,0,0,-1\n\n1 2 3\nwords\n0,0,0,0,0,0\n  0 , 0 , 9 , 0 , 0 , 1 \r\n\xff\n1e999,0,0,0,0,1\n".to_vec();
    for i in 0..10_000 {
        lines.extend(format!("{},0,9,0,0,-1\n", f64::from(i) / 1000.0 - 5.0).bytes());
    }
    lines.extend(b"0,0,9,0,0,-1"); // without an end of line
    std::fs::write(&rays, lines).unwrap();
    let output = good(&["pick", path(&cube), "--rays", path(&rays)]);
    let answers: Vec<Value> = output.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(answers.len(), 10_009);
    assert_eq!(answers[0]["hits"][0]["point"], serde_json::json!([0.5, 0.5, 1.0]));
    for (index, message) in
        [(1, "0 numbers"), (2, "3 numbers"), (3, "\"words\""), (4, "zero"), (6, "UTF-8"), (7, "not a finite number")]
    {
        let answer = &answers[index];
        assert!(answer["error"].as_str().unwrap().contains(message), "{answer}");
        assert_eq!(answer["line"], index + 1);
        assert!(answer["hits"].is_null());
    }
    assert_eq!(answers[5], serde_json::json!({ "hits": [] }));
    for (i, answer) in answers[8..10_008].iter().enumerate() {
        let x = f64::from(i as u32) / 1000.0 - 5.0;
        let expected = if x.abs() <= 2.0 { 1 } else { 0 };
        assert_eq!(answer["hits"].as_array().unwrap().len(), expected, "{x}");
        if expected == 1 {
            assert!((answer["hits"][0]["point"][0].as_f64().unwrap() - x).abs() < 1e-12, "{x}: {answer}");
        }
    }
    assert_eq!(answers[10_008]["hits"].as_array().unwrap().len(), 1);
    assert!(bad(1, &["pick", path(&cube), "--rays", "none"]).contains("can not read the rays in none"));
}

/// A program can ask ray by ray through a pipe: an answer comes before the next question.
#[test]
fn rays_are_answered_as_they_come() {
    let folder = tempfile::tempdir().unwrap();
    let cube = write(folder.path(), "cube.ron", CUBE);
    let mut child = seamount()
        .args(["pick", path(&cube), "--rays", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut questions = child.stdin.take().unwrap();
    let mut answers = BufReader::new(child.stdout.take().unwrap()).lines();
    for x in [0.0, 1.0, 3.0] {
        writeln!(questions, "{x},0,9,0,0,-1").unwrap();
        let answer: Value = serde_json::from_str(&answers.next().unwrap().unwrap()).unwrap();
        assert_eq!(answer["hits"].as_array().unwrap().len(), usize::from(x < 2.5));
    }
    drop(questions);
    assert!(answers.next().is_none());
    assert!(child.wait().unwrap().success());
}

#[test]
fn a_closed_pipe_is_no_failure() {
    let folder = tempfile::tempdir().unwrap();
    let children = "Cube(), ".repeat(50_000);
    let many = write(folder.path(), "many.ron", &format!("Scene(version: 1, root: Group(children: [{children}]))"));
    let mut child =
        seamount().args(["tree", path(&many)]).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut first = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut first).unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!((first.as_str(), output.status.code(), text(&output.stderr)), ("Group\n", Some(0), ""));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_a_failure() {
    let full = || std::fs::File::options().write(true).open("/dev/full").unwrap();
    let output = seamount().args(["tree", FUJI]).stdout(full()).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).starts_with("error: can not write to standard output"), "{}", text(&output.stderr));
    let message = bad(1, &["generate", "--size", "9", "-o", "/dev/full"]);
    assert!(message.contains("can not write /dev/full"), "{message}");
}

#[test]
fn generate_writes_the_same_map_for_the_same_seed() {
    let folder = tempfile::tempdir().unwrap();
    let map = |name: &str, seed: &str| {
        let file = folder.path().join(name);
        good(&["generate", "--size", "33", "--seed", seed, "-o", path(&file)]);
        file
    };
    let (a, b, c) = (map("a.png", "1"), map("b.png", "1"), map("c.png", "2"));
    assert_eq!(std::fs::read(&a).unwrap(), std::fs::read(&b).unwrap());
    assert_ne!(std::fs::read(&a).unwrap(), std::fs::read(&c).unwrap());
    let image::DynamicImage::ImageLuma16(image) = image::open(&a).unwrap() else { panic!("not of 16 bits") };
    assert_eq!(image.dimensions(), (33, 33));
    let expected = seamount::terrain::generate(33, 1).unwrap();
    for (x, y, value) in image.enumerate_pixels() {
        assert_eq!(f64::from(value.0[0]), expected.raw(x, y));
    }
    // The map is a scene.
    assert_eq!(json(&["bbox", path(&a), "--json"])["max"], serde_json::json!([32.0, 32.0, 4.0]));
}

#[test]
fn nothing_is_done_for_an_output_that_can_not_be() {
    let folder = tempfile::tempdir().unwrap();
    let nowhere = folder.path().join("none/a.png");
    for command in
        [&["render", "none.ron", "-o", path(&nowhere)][..], &["generate", "--size", "9", "-o", path(&nowhere)]]
    {
        // Said before the scene is even looked for.
        assert!(bad(1, command).contains("there is no folder"), "{command:?}");
    }
    assert!(bad(1, &["render", "none.ron", "-o", path(folder.path())]).contains("is a folder"));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

/// Needs an adapter; the software one will do. Without any, this fails.
#[test]
fn render_draws_and_reports() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.png");
    let args = ["render", "scenes/cubes.ron", "-o", path(&file), "--size", "64x48", "--background", "#ff00ff"];
    let sentence = good(&args);
    assert_eq!(sentence.lines().count(), 1);
    assert!(sentence.contains("64 × 48 pixels") && sentence.contains("triangles in"), "{sentence}");
    let picture = image::open(&file).unwrap().into_rgb8();
    assert_eq!(picture.dimensions(), (64, 48));
    let background = picture.pixels().filter(|p| p.0 == [255, 0, 255]).count();
    assert!(background > 0 && background < 64 * 48, "{background} pixels of background");

    let report = json(&[&args[..], &["--json"]].concat());
    assert_eq!(report["size"], serde_json::json!([64, 48]));
    assert!(report["adapter"]["name"].is_string());
    assert!(report["triangles"].as_u64().unwrap() > 0 && report["draw_calls"].as_u64().unwrap() > 0);
    assert_eq!(report["patches"], serde_json::json!({ "traversed": 0, "culled": 0, "rendered": 0 }));
    assert_eq!(report["effects"][0][0], "mesh");
    for time in ["load", "selection", "encoding"] {
        assert!(report["times"][time].as_f64().unwrap() >= 0.0);
    }
    assert!(report["times"].get("gpu").is_some());
    // Only the picture is there.
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn render_fails_without_touching_the_old_picture() {
    let folder = tempfile::tempdir().unwrap();
    let file = write(folder.path(), "a.png", "old");
    let cube = write(folder.path(), "cube.ron", CUBE);
    assert!(bad(1, &["render", path(&cube), "-o", path(&file)]).contains("the scene has no camera"));
    let message = bad(1, &["render", "scenes/cubes.ron", "-o", path(&file), "--adapter", "no such adapter"]);
    assert!(message.contains("no such adapter"), "{message}");
    assert_eq!(std::fs::read(&file).unwrap(), b"old");
}

#[test]
fn sight_and_heights() {
    let found = json(&["sight", FUJI, "--ground", "45300,55620", "--json"]);
    let hit = &found["hits"][0];
    assert_eq!(hit["surface"], "exact");
    let [x, y, z] = [0, 1, 2].map(|k| hit["point"][k].as_f64().unwrap());
    assert!((x - 45_300.0).abs() < 1e-6 && (y - 55_620.0).abs() < 1e-6, "{hit}");
    assert_eq!(good(&["sight", FUJI, "--ground=-5,5"]), "no ground\n");
    // From above the place is seen, from below it the sky is not.
    let between = |a: f64, b: f64| format!("--between={x},{y},{a},{x},{y},{b}");
    assert_eq!(good(&["sight", FUJI, &between(z + 1000.0, z + 1.0)]), "visible\n");
    assert!(good(&["sight", FUJI, &between(z - 10.0, z + 1000.0)]).contains("distance 10"));
    let drawn = json(&["sight", FUJI, "--ground", "45300,55620", "--surface", "drawn", "--json"]);
    assert_eq!(drawn["hits"][0]["surface"], "drawn");
    bad(2, &["sight", FUJI]);
    bad(2, &["sight", FUJI, "--ground", "1"]);
    for question in ["--ground=NaN,1", "--between=0,0,inf,1,1,1"] {
        assert!(bad(2, &["sight", FUJI, question]).contains("not a finite number"));
    }
}

#[test]
fn the_drawn_surface_names_tile_or_strip() {
    let found = json(&["pick", FUJI, "--pixel", "640,500", "--surface", "drawn", "--json"]);
    let terrain = &found["hits"][0]["terrain"];
    let triangle = terrain["triangle"].as_str().unwrap();
    assert!(triangle.starts_with("tile ") || triangle.starts_with("strip "), "{triangle}");
    assert!(found["hits"][0]["error_bound"].as_f64().unwrap() > 0.0);
}
