//! The measuring is measured: planted errors are found, the full mesh has none, two runs agree, and the report says what the
//! schema says.

use std::path::Path;
use std::process::Command;
use std::sync::LazyLock;

use seamount::cost::compare::compare;
use seamount::cost::{self, Drawing, DrawingRow, Eye, Options, Report, SCHEMA_VERSION, Watcher};
use seamount::prelude::*;
use serde_json::{Value, json};

/// A plain of 257 × 257 samples over 256 × 256, with a spike of a given height at a place that only the finest mesh has.
fn spike(height: f64) -> Scene {
    let mut samples = vec![0u16; 257 * 257];
    samples[SPIKE[1] * 257 + SPIKE[0]] = 65_535;
    let mut scene = Scene::new();
    let root = scene.root();
    let image = Image::new(257, 257, Pixels::Gray16(samples)).unwrap();
    scene.add(root, DirectionalLight::default()).unwrap();
    scene.add(root, Texture2::from_image(image)).unwrap();
    let terrain = SeamlessTerrain { scale: 256.0, max_height: height, ..SeamlessTerrain::default() };
    scene.add(root, terrain).unwrap();
    scene
}

/// Column and row: odd, so that a mesh with steps of two cells or more does not have it.
const SPIKE: [usize; 2] = [137, 85];

const SIZE: [u32; 2] = [160, 90];

fn options() -> Options {
    Options { quick: true, size: SIZE, command: "a test".to_owned(), ..Options::default() }
}

fn report(scene: Scene) -> Report {
    cost::run(scene, &options(), &mut ()).unwrap()
}

/// Several tests look at one run.
static SPIKE_REPORT: LazyLock<Report> = LazyLock::new(|| report(spike(1.0)));

fn drawing(report: &Report) -> &Drawing {
    report.drawing.as_ref().unwrap()
}

fn row<'r>(report: &'r Report, name: &str) -> &'r DrawingRow {
    drawing(report).rows.iter().find(|row| row.name == name).unwrap_or_else(|| panic!("no row {name}"))
}

/// Where a point is in the picture of an eye, in pixels; written down without the crate's cameras.
fn pixel(eye: &Eye, p: DVec3) -> DVec2 {
    let (position, look_at) = (DVec3::from(eye.position), DVec3::from(eye.look_at));
    let forward = (look_at - position).normalize();
    let up = if forward.truncate() == DVec2::ZERO { DVec3::Y } else { DVec3::Z };
    let right = forward.cross(up).normalize();
    let up = right.cross(forward);
    let focal = f64::from(SIZE[1]) / 2.0 / (eye.height_angle / 2.0).tan();
    let d = p - position;
    DVec2::new(d.dot(right), d.dot(up)) * (focal / d.dot(forward))
}

#[test]
fn a_planted_error_is_reported_as_it_is() {
    let report = &*SPIKE_REPORT;
    let [x, y] = [SPIKE[0] as f64, 256.0 - SPIKE[1] as f64];
    let (top, bottom) = (DVec3::new(x, y, 1.0), DVec3::new(x, y, 0.0));
    let mut found = 0;
    for eye in &drawing(report).eyes {
        // The grazing eye stands on the spike itself.
        if eye.name == "grazing" {
            continue;
        }
        let planted = pixel(eye, top).distance(pixel(eye, bottom));
        let half = 0.5 * DVec2::new(SIZE[0].into(), SIZE[1].into());
        let seen = pixel(eye, top).abs().cmple(half).all();
        // A mesh is flat and has all of the error, or has the spike and none of it.
        for row in drawing(report).rows.iter().filter(|row| row.eye == eye.name) {
            let error = row.figures.max_error_px;
            let all = (error - planted).abs() < 1e-9 * planted;
            assert!(error == 0.0 || !seen || all, "{}: {error} instead of {planted}", row.name);
            found += u32::from(all);
        }
    }
    assert!(found >= 4, "only {found} rows have the planted error");
    // τ says which: what is above it must not be left.
    for row in &drawing(report).rows {
        if let DetailMode::PixelError(tolerance) = row.detail {
            assert!(row.figures.max_error_px <= tolerance, "{}: {}", row.name, row.figures.max_error_px);
        }
    }
}

#[test]
fn the_full_mesh_against_itself_is_zero() {
    for eye in ["above", "corner", "middle", "grazing"] {
        let figures = &row(&SPIKE_REPORT, &format!("{eye}, full mesh")).figures;
        assert_eq!((figures.max_error_px, figures.rms_error_px, figures.flip.value()), (0.0, 0.0, Some(0.0)));
        assert_eq!(figures.psnr_db.value(), None, "infinite");
    }
    // And the measure is not blind: the coarsest mesh is not the full one.
    let coarse = &row(&SPIKE_REPORT, "above, τ = 16 px").figures;
    assert!(coarse.triangles < row(&SPIKE_REPORT, "above, full mesh").figures.triangles);
}

/// All that is not a time, as JSON.
fn figures(report: &Report) -> Value {
    fn without_times(value: &mut Value) {
        match value {
            Value::Object(fields) => {
                fields.remove("times");
                fields.values_mut().for_each(without_times);
            }
            Value::Array(items) => items.iter_mut().for_each(without_times),
            _ => {}
        }
    }
    let mut value = serde_json::to_value(report).unwrap();
    without_times(&mut value);
    value
}

#[test]
fn two_runs_agree_in_all_that_is_not_a_time() {
    let again = report(spike(1.0));
    assert_eq!(figures(&SPIKE_REPORT), figures(&again));
    let [a, b] = [&*SPIKE_REPORT, &again].map(|r| serde_json::to_value(r).unwrap());
    let compared = compare(&a, &b, 0.0).unwrap();
    assert!(compared.passed() && compared.better.is_empty() && compared.notes.is_empty(), "{compared:?}");
    assert!(compared.same > 200 && compared.times.len() > 5, "{compared:?}");
    assert!(compared.times.iter().all(|time| time.name.contains("ms") || time.name.contains("ns")), "{compared:?}");
}

#[test]
fn data_json_is_the_schema() {
    let report = &*SPIKE_REPORT;
    let value = serde_json::to_value(report).unwrap();
    // Through values: reading decimals may be off in the last bit.
    assert_eq!(&serde_json::from_value::<Report>(value.clone()).unwrap(), report);
    let read: Report = serde_json::from_str(&value.to_string()).unwrap();
    assert_eq!((read.schema, read.complete, &read.about), (SCHEMA_VERSION, true, &report.about));
    assert_eq!(report.about.terrain, ["Separator", "SeamlessTerrain[2]"]);
    // A figure that is missing says why.
    let psnr = &value["drawing"]["rows"][0]["figures"]["psnr_db"];
    assert_eq!((&psnr["value"], psnr["reason"].as_str().is_some_and(|r| !r.is_empty())), (&Value::Null, true));
    // Every field is in the document.
    let document = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/cost-schema.md")).unwrap();
    fn names(value: &Value, into: &mut Vec<String>) {
        match value {
            Value::Object(fields) => {
                for (name, value) in fields {
                    into.push(name.clone());
                    names(value, into);
                }
            }
            Value::Array(items) => items.iter().for_each(|item| names(item, into)),
            _ => {}
        }
    }
    let mut all = Vec::new();
    names(&value, &mut all);
    all.sort();
    all.dedup();
    for name in all {
        // Names of detail settings are values, not fields.
        let setting = ["PixelError", "Precision"].contains(&name.as_str());
        assert!(setting || document.contains(&format!("`{name}`")), "docs/cost-schema.md does not know `{name}`");
    }
}

#[test]
fn the_page_stands_by_itself_and_says_what_is_missing() {
    let page = cost::html(&SPIKE_REPORT);
    assert_eq!(page.matches("<svg").count(), 3);
    for outside in ["src=", "href=", "<script", "@import", "url("] {
        assert!(!page.contains(outside), "the page refers to something outside: {outside}");
    }
    for section in ["1. Drawing", "2. Picking", "3. Effects", "4. Precision", "5. The published tables", "6. Cracks"] {
        assert!(page.contains(section), "{section}");
        assert!(cost::markdown(&SPIKE_REPORT).contains(section), "{section}");
    }
    assert!(page.contains("Where PSNR is –: the pictures are the same"));
}

#[test]
fn our_meshes_have_no_cracks_and_instancing_takes_one_call_per_part() {
    let report = &*SPIKE_REPORT;
    let rules = &report.cracks.as_ref().unwrap().rules;
    for rule in rules.iter().filter(|rule| rule.name.starts_with("ours, ")) {
        assert_eq!((rule.figures.cracked_eyes, rule.figures.cracks), (0, 0), "{}", rule.name);
    }
    assert!(rules.iter().any(|rule| rule.name.starts_with("older") && rule.figures.cracks > 0), "{rules:?}");
    let published = report.published.as_ref().unwrap();
    let mut more = 0;
    for row in published.views.iter().chain(&published.flights) {
        let figures = &row.figures;
        // From above a single patch is enough, which is a call for each part either way.
        assert!(figures.draw_calls == figures.parts_in_use || !row.instanced, "{row:?}");
        assert!(figures.draw_calls >= figures.parts_in_use, "{row:?}");
        more += u32::from(figures.draw_calls > figures.parts_in_use);
    }
    assert!(more >= 4, "only {more} ways to draw take more calls than there are parts");
    for view in ["above", "corner", "middle"] {
        let triangles = |culled: &str| {
            let name = format!("{view}, {culled}, instanced");
            published.views.iter().find(|row| row.name == name).unwrap().figures.triangles
        };
        let (on, off) = (triangles("culled"), triangles("not culled"));
        // Only behind the eye in the middle there are whole patches on so small a map.
        assert!(if view == "middle" { on < off } else { on == off }, "{view}: {on} and {off}");
    }
}

#[test]
fn picks_are_as_exact_as_their_surface_and_none_is_lost() {
    for row in &SPIKE_REPORT.picking.as_ref().unwrap().rows {
        assert_eq!(row.figures.lost, 0, "{}", row.name);
        assert!(row.hits > 100, "{}: {} hits say nothing", row.name, row.hits);
        if row.surface == "exact" {
            let worst = row.figures.max_vertical.value().unwrap();
            assert!(worst < 1e-9, "{}: {worst}", row.name);
        }
    }
    let precision = SPIKE_REPORT.precision.as_ref().unwrap();
    let [origin, .., far] = precision.rows.as_slice() else { panic!("rows") };
    assert_eq!((origin.figures.different_pixels, origin.figures.max_pick_error.value()), (0, Some(0.0)));
    // At 1.5e11 f64 has steps of 3e-5; f32 has steps of 16 384, over a map of 256.
    assert!(far.figures.max_pick_error.value().is_some_and(|off| off < 1e-2) && far.figures.lost_picks < 20, "{far:?}");
    assert!(far.figures.f32_pick_error.value().is_some_and(|off| off > 256.0), "{far:?}");
}

/// Neither the ground of another terrain nor a way through a hole is an error of the surface.
#[test]
fn exact_picks_have_no_error_beside_others_and_over_holes() {
    let mut scene = Scene::new();
    let root = scene.root();
    let map = |hole: bool| {
        let height = |i: usize| (1 + i * 7919 % 20_000) as u16;
        let sample =
            |i: usize| if hole && (5..12).contains(&(i / 33)) && (8..20).contains(&(i % 33)) { 0 } else { height(i) };
        Texture2::from_image(Image::new(33, 33, Pixels::Gray16((0..33 * 33).map(sample).collect())).unwrap())
    };
    let terrain = SeamlessTerrain {
        scale: 32.0,
        void_sample: Some(0.0),
        voids: seamount::node::VoidMode::Hole,
        ..SeamlessTerrain::default()
    };
    scene.add(root, map(true)).unwrap();
    scene.add(root, terrain.clone()).unwrap();
    scene.add(root, Translation { translation: DVec3::new(5.0, 7.0, 0.3) }).unwrap();
    scene.add(root, map(false)).unwrap();
    scene.add(root, terrain).unwrap();
    let report = report(scene);
    for row in &report.picking.as_ref().unwrap().rows {
        assert!(row.surface != "exact" || row.figures.max_vertical.value().is_some_and(|off| off < 1e-9), "{row:?}");
        assert!(row.surface != "exact" || row.figures.lost == 0, "{row:?}");
    }
    assert!(!cost::markdown(&report).contains("NaN"));
}

#[test]
fn effects_that_are_not_asked_for_cost_nothing() {
    let rows = &SPIKE_REPORT.effects.as_ref().unwrap().rows;
    let none = rows.iter().find(|row| row.name == "none").unwrap();
    let all = rows.iter().find(|row| row.name.starts_with("all")).unwrap();
    for row in rows {
        assert!(row.figures.shader_bytes >= none.figures.shader_bytes, "{}", row.name);
        assert!(row.figures.device_bytes >= none.figures.device_bytes, "{}", row.name);
        assert!(
            row.figures.shader_bytes <= all.figures.shader_bytes || row.name.starts_with("colours by"),
            "{}",
            row.name
        );
    }
}

fn small(triangles: Value, psnr: Value, ms: f64) -> Value {
    json!({
        "schema": SCHEMA_VERSION, "complete": true, "about": { "size": [1, 1] },
        "drawing": { "rows": [{
            "name": "a", "figures": { "triangles": triangles, "psnr_db": psnr }, "times": { "gpu_ms": ms }
        }] },
    })
}

#[test]
fn verdicts_of_a_comparison() {
    let old = small(json!(100), json!(40.0), 1.0);
    let null = json!({ "value": null, "reason": "equal" });
    for (new, worse, better) in [
        (small(json!(100), json!(40.0), 50.0), 0, 0),
        (small(json!(104), json!(39.0), 1.0), 0, 0),
        (small(json!(106), json!(40.0), 1.0), 1, 0),
        (small(json!(90), json!(40.0), 1.0), 0, 1),
        // Less signal over noise is less accurate, an infinite one more.
        (small(json!(100), json!(30.0), 1.0), 1, 0),
        (small(json!(100), null.clone(), 1.0), 0, 1),
        // A figure that can not be measured any more guards nothing.
        (small(null, json!(40.0), 1.0), 1, 0),
        (json!({ "schema": SCHEMA_VERSION, "about": { "size": [1, 1] } }), 2, 0),
    ] {
        let found = compare(&old, &new, 0.05).unwrap();
        assert_eq!((found.worse.len(), found.better.len()), (worse, better), "{new}: {found:?}");
    }
    let slower = compare(&old, &small(json!(100), json!(40.0), 3.0), 0.05).unwrap();
    assert_eq!((slower.times[0].name.as_str(), slower.times[0].max_ratio), ("drawing/gpu_ms", 3.0));
    // From nothing to something is worse by any threshold.
    assert!(!compare(&small(json!(0), json!(1), 1.0), &small(json!(1), json!(1), 1.0), 10.0).unwrap().passed());
    assert!(compare(&json!({}), &old, 0.05).is_err());
    let text = compare(&old, &small(json!("100"), json!(40.0), 1.0), 0.05).unwrap_err().to_string();
    assert!(text.starts_with("in the new file drawing/rows/a/triangles is \"100\":"), "{text}");
    let mut twice = old.clone();
    let row = twice["drawing"]["rows"][0].clone();
    twice["drawing"]["rows"].as_array_mut().unwrap().push(row);
    let twice = compare(&twice, &old, 0.05).unwrap_err().to_string();
    assert!(twice.starts_with("in the old file drawing/rows/a/") && twice.contains(" is there twice"), "{twice}");
    // An error that is none but for rounding, beside one that is; and a count of one beside a large one.
    let two = |small: f64| {
        json!({ "schema": SCHEMA_VERSION, "about": {}, "picking": { "rows": [
            { "name": "exact", "figures": { "max_vertical": small } }, { "name": "coarse", "figures": { "max_vertical": 9.0 } },
        ] } })
    };
    assert!(compare(&two(0.0), &two(2e-15), 0.0).unwrap().passed());
    assert!(!compare(&two(0.0), &two(1e-10), 0.0).unwrap().passed());
    let mut other = old.clone();
    other["about"]["size"] = json!([2, 1]);
    assert_eq!(compare(&old, &other, 0.05).unwrap().notes, ["size was [1,1] and is [2,1]"]);
}

fn seamount(args: &[&str]) -> std::process::Output {
    let root = env!("CARGO_MANIFEST_DIR");
    Command::new(env!("CARGO_BIN_EXE_seamount")).current_dir(root).args(args).output().unwrap()
}

#[test]
fn the_command_compares_and_says_so_by_its_exit_status() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, value: &Value| {
        let path = folder.path().join(name);
        std::fs::write(&path, value.to_string()).unwrap();
        path.to_str().unwrap().to_owned()
    };
    let old = file("old.json", &small(json!(100), json!(40.0), 1.0));
    let new = file("new.json", &small(json!(110), json!(40.0), 1.0));
    let status = |args: &[&str]| {
        let output = seamount(args);
        (output.status.code(), String::from_utf8(output.stdout).unwrap())
    };
    assert_eq!(status(&["cost", "--compare", &old, &old]).0, Some(0));
    let (code, said) = status(&["cost", "--compare", &old, &new]);
    assert_eq!(code, Some(1));
    assert!(said.contains("worse: drawing/rows/a/triangles: 100 -> 110"), "{said}");
    assert_eq!(status(&["cost", "--compare", &old, &new, "--threshold", "20"]).0, Some(0));
    assert_eq!(status(&["cost", "--compare", &old, &new, "--threshold", "-1"]).0, Some(2));
    assert_eq!(status(&["cost", "--compare", &old]).0, Some(2));
    assert_eq!(status(&["cost"]).0, Some(2));
    let garbage = folder.path().join("garbage.json");
    std::fs::write(&garbage, "{").unwrap();
    let output = seamount(&["cost", "--compare", &old, garbage.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8(output.stderr).unwrap().contains("garbage.json: this is no data.json"));
}

#[test]
fn a_run_that_is_stopped_leaves_what_it_has() {
    struct Once<'f>(&'f Path);
    impl Watcher for Once<'_> {
        fn begin(&mut self, _: usize, _: usize, _: &str) {}
        fn finished(&mut self, report: &Report) -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
            cost::write(report, self.0)?;
            Err("enough".into())
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let error = cost::run(spike(1.0), &options(), &mut Once(folder.path())).unwrap_err();
    assert_eq!(error.to_string(), "enough");
    let data = std::fs::read(folder.path().join("data.json")).unwrap();
    let left: Report = serde_json::from_slice(&data).unwrap();
    assert!(!left.complete);
    // All settings of the first eye.
    assert_eq!(drawing(&left).rows.len() * 4, drawing(&SPIKE_REPORT).rows.len());
    assert_eq!(drawing(&left).rows[0].figures, drawing(&SPIKE_REPORT).rows[0].figures);
    let page = std::fs::read_to_string(folder.path().join("index.html")).unwrap();
    assert!(page.contains("did not come to its end"));
}

#[test]
fn a_scene_without_terrain_to_look_at_is_refused() {
    let mut scene = Scene::new();
    let root = scene.root();
    scene.add(root, Cube::default()).unwrap();
    let error = cost::run(scene, &options(), &mut ()).unwrap_err();
    assert!(error.to_string().contains("no SeamlessTerrain"), "{error}");
    let mut scene = spike(1.0);
    let root = scene.root();
    let squashed = scene.insert(Scale { scale_factor: DVec3::new(1.0, 0.0, 1.0) });
    scene.insert_child(root, 0, squashed).unwrap();
    let error = cost::run(scene, &options(), &mut ()).unwrap_err().to_string();
    assert!(
        error.starts_with("Separator/SeamlessTerrain[3]: a transform before the terrain scales by zero"),
        "{error}"
    );
}

#[test]
fn the_command_writes_its_three_files_and_nothing_half() {
    let folder = tempfile::tempdir().unwrap();
    let map = folder.path().join("map.png");
    let made = seamount(&["generate", "--size", "65", "--seed", "3", "-o", map.to_str().unwrap()]);
    assert!(made.status.success());
    let out = folder.path().join("report");
    let [map, out_name] = [&map, &out].map(|path| path.to_str().unwrap());
    let output = seamount(&["cost", map, "-o", out_name, "--quick", "--size", "64x36"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(String::from_utf8(output.stderr).unwrap().contains("corner, τ = 1 px"), "progress is told");
    let mut names: Vec<String> =
        out.read_dir().unwrap().map(|file| file.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    assert_eq!(names, ["asked.svg", "data.json", "index.html", "report.md", "time.svg", "triangles.svg"]);
    let report: Report = serde_json::from_slice(&std::fs::read(out.join("data.json")).unwrap()).unwrap();
    assert!(report.complete && report.about.size == [64, 36] && report.about.samples == [65, 65]);
    assert!(report.about.command.ends_with("map.png --quick --size 64x36"), "{}", report.about.command);

    let output = seamount(&["cost", "scenes/cubes.ron", "-o", out_name]);
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8(output.stderr).unwrap().contains("scenes/cubes.ron: there is no SeamlessTerrain"));
    // What was there is still there, and nothing new is.
    assert!(out.join("data.json").exists());
    let (outer, inner) = (folder.path().join("outer"), folder.path().join("outer/inner"));
    assert_eq!(seamount(&["cost", "scenes/cubes.ron", "-o", inner.to_str().unwrap()]).status.code(), Some(1));
    assert!(!outer.exists());
}

/// Killed in the middle of its work, whatever it is about, the command leaves whole files of what is finished.
#[test]
fn a_command_that_is_killed_leaves_what_it_has() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().to_str().unwrap();
    let mut child = Command::new(env!("CARGO_BIN_EXE_seamount"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(["cost", "scenes/jacksboro.png", "--quick", "--size", "160x90", "-o", path])
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let data = folder.path().join("data.json");
    while !data.exists() {
        assert!(child.try_wait().unwrap().is_none(), "it ended before it wrote anything");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let report: Report = serde_json::from_str(&std::fs::read_to_string(data).unwrap()).unwrap();
    assert!(!report.complete && !drawing(&report).rows.is_empty());
}

/// Of a roof with its ridge from north to south: from low in the west the eastern half turns its back, from above nothing.
#[test]
fn triangles_that_face_away_are_counted() {
    use seamount::action::{Lens, Viewpoint};
    use seamount::node::lattice_view;
    use seamount::terrain::{
        ActivePatch, DrawnSurface, Full, HeightField, Hierarchy, Parts, Resolutions, Selection, Voids, facing_away,
    };
    let samples = (0..33 * 33).map(|i| 1000 * (16 - (i % 33 - 16i32).unsigned_abs() as u16)).collect();
    let field = HeightField::from_u16(33, 33, samples, Voids::default()).unwrap();
    let node = SeamlessTerrain { scale: 32.0, max_height: 65.535, ..SeamlessTerrain::default() };
    let resolutions = Resolutions::new(8, 2).unwrap();
    let (tree, parts) = (Hierarchy::new(field.cells(), resolutions), Parts::new(resolutions));
    let selection = Selection::of(&tree, &Full);
    let patches: Vec<ActivePatch> = selection.patches(&tree).collect();
    let mesh = DrawnSurface { field: &field, tree: &tree, parts: &parts, selection: &selection };
    let count = |eye: DVec3, forward: DVec3, lens: Lens, mirror: f64| {
        let right = if forward.x == 0.0 { DVec3::X } else { forward.cross(DVec3::Z).normalize() };
        let up = right.cross(forward);
        let view = Viewpoint {
            eye,
            right,
            up,
            forward,
            lens,
            center: DVec2::ZERO,
            aspect: 1.0,
            pixels: 100.0,
            near: 0.1,
            far: None,
        };
        let model = DAffine3::from_scale(DVec3::new(mirror, 1.0, 1.0));
        facing_away(&mesh, &patches, &lattice_view(&view, &model, &node.frame(&field)))
    };
    let perspective = Lens::Perspective { tan_half_height: 0.5 };
    let parallel = Lens::Orthographic { half_height: 40.0 };
    let half = 32 * 32;
    // The slope is one in one: at a height of 10 beside it, the far side can not be seen.
    assert_eq!(count(DVec3::new(-50.0, 16.0, 10.0), DVec3::X, perspective, 1.0), half);
    assert_eq!(count(DVec3::new(16.0, 16.0, 100.0), DVec3::NEG_Z, perspective, 1.0), 0);
    assert_eq!(count(DVec3::new(16.0, 16.0, -100.0), DVec3::Z, perspective, 1.0), 2 * half);
    assert_eq!(count(DVec3::new(-50.0, 16.0, 10.0), DVec3::X, parallel, 1.0), half);
    assert_eq!(count(DVec3::new(0.0, 16.0, 100.0), DVec3::new(0.6, 0.0, -0.8), parallel, 1.0), 0);
    // Mirrored, the western half is where the eastern was.
    assert_eq!(count(DVec3::new(50.0, 16.0, 10.0), DVec3::NEG_X, perspective, -1.0), half);
}

/// Where nothing could be compared there is no error of 0, but a reason: of a map so small that far from the origin no two of
/// its corners are apart.
#[test]
fn what_could_not_be_measured_is_told() {
    let mut scene = Scene::new();
    let root = scene.root();
    let pixels = Pixels::Gray16((0..33 * 33).map(|i| (1 + i * 7919 % 20_000) as u16).collect());
    scene.add(root, Texture2::from_image(Image::new(33, 33, pixels).unwrap())).unwrap();
    scene.add(root, SeamlessTerrain { scale: 1e-9, max_height: 1e-10, ..SeamlessTerrain::default() }).unwrap();
    let report = report(scene);
    let far = report.precision.as_ref().unwrap().rows.last().unwrap().figures.clone();
    assert_eq!((far.max_pick_error.value(), far.lost_picks > 0), (None, true), "{far:?}");
    let text = cost::markdown(&report);
    assert!(text.contains("Where the pick error is –: no ray hits both here and at the origin."), "{text}");
}
