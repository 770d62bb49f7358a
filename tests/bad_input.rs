//! What is said of files that are not as they should be: every message with its position, and no panic whatever comes.

use std::path::{Path, PathBuf};

use seamount::format::{self, Mistake, Problem, ReadError};
use seamount::node::Registry;
use seamount::prelude::*;
use seamount::scene::Position;

fn mistakes(text: &str) -> Vec<Mistake> {
    match format::parse(text, &Registry::default()) {
        Err(ReadError::Mistakes { mistakes, .. }) => mistakes,
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("read without complaint: {text}"),
    }
}

/// The mistakes of a scene with this root, as `line:column: message`. The root starts at 1:25.
fn complaints(root: &str) -> Vec<String> {
    mistakes(&format!("Scene(version: 1, root: {root})")).iter().map(|m| m.line()).collect()
}

/// The only mistake, and it stands under the caret line's `^`: a text of two lines per line, the second of them marking.
fn one(root: &str, marked: &str, message: &str) {
    let found = complaints(root);
    let column = 25 + root[..root.find(marked).expect("marked part of the text")].chars().count();
    assert_eq!(found, [format!("1:{column}: {message}")], "{root}");
}

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name)
}

#[test]
fn missing_scene() {
    let error = format::read_scene("no/such.ron").unwrap_err();
    assert!(matches!(error, ReadError::Missing { .. }));
    assert_eq!(error.to_string(), "there is no file no/such.ron: check the name and the folder");
}

#[test]
fn a_folder_instead_of_a_scene() {
    let folder = tempfile::tempdir().unwrap();
    let error = format::read_scene(folder.path()).unwrap_err();
    assert!(matches!(error, ReadError::Unreadable { .. }));
    assert!(error.to_string().starts_with("can not read "), "{error}");
}

#[test]
fn not_utf8() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ron");
    std::fs::write(&path, b"Scene(\n  // \xc3\xbc\xff\n").unwrap();
    let error = format::read_scene(&path).unwrap_err();
    let expected = "2:7: the file is not UTF-8 text from here on (byte 0xff): save it as UTF-8";
    assert_eq!(error.to_string(), format!("{}:{expected}", path.display()));
}

#[test]
fn a_byte_order_mark_is_no_mistake() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ron");
    std::fs::write(&path, "\u{feff}Scene(version: 1, root: Cube)").unwrap();
    assert_eq!(format::read_scene(&path).unwrap().len(), 1);
}

#[test]
fn misspelt_node() {
    one("Seperator()", "Sep", "unknown node `Seperator`, did you mean `Separator`?");
    one("Group(children: [Cube, cube])", "cube", "unknown node `cube`, did you mean `Cube`?");
    one("Xylophone(a: [1, 2])", "Xyl", "unknown node `Xylophone`");
    one("Group(children: [Usee(\"a\")])", "Usee", "unknown node `Usee`, did you mean `Use`?");
}

#[test]
fn what_is_inside_a_misspelt_node_is_read_as_what_was_meant() {
    let found = complaints("Seperator(children: [Def(\"a\", Cube(widht: 1)), Cub()]), ");
    assert_eq!(found.len(), 3, "{found:#?}");
    // A name given inside is known, a value of the wrong type is told.
    let found = complaints("Group(children: [Seperator(children: [Def(\"a\", Cube())]), Use(\"a\")])");
    assert_eq!(found, ["1:42: unknown node `Seperator`, did you mean `Separator`?"]);
}

#[test]
fn misspelt_field() {
    one(
        "Cube(widht: 2.0)",
        "widht",
        "Cube has no field `widht`, did you mean `width`?; Cube has the fields width, height and depth",
    );
    one("TextureUnit(number: 2)", "number", "TextureUnit has no field `number`; TextureUnit has the field unit");
    one("Group(width: 2)", "width", "Group has no field `width`; Group has the field children");
    one(
        "ShaderProgram(children: [])",
        "children",
        "ShaderProgram has no field `children`; ShaderProgram has the field shader_object",
    );
    // What stands there is looked at all the same.
    let found = complaints("Group(childern: [Cube(width: true)])");
    assert_eq!(found.len(), 2, "{found:#?}");
    assert_eq!(found[1], "1:54: `width` takes number: a number is expected here");
}

#[test]
fn field_given_twice() {
    one("Cube(width: 2.0, width: 3.0)", "width: 3", "`width` is given twice, the first time at 1:30: take one away");
    one(
        "Group(children: [], children: [Cube])",
        "children: [C",
        "`children` is given twice, the first time at 1:31: take one away",
    );
}

#[test]
fn wrong_type() {
    one("Cube(width: \"2\")", "\"2\"", "`width` takes number: a number is expected here");
    one("Cube(width: /* two */ two)", "two)", "`width` takes number: a number is expected here");
    one("TextureUnit(unit: -1)", "-1", "`unit` takes integer: the integer is out of range");
    one("TextureUnit(unit: 1.5)", "1.5", "`unit` takes integer: there is more than it takes");
    one(
        "Transform(translation: (1.0, \"x\", 2.0))",
        "\"x\"",
        "`translation` takes (x, y, z): a number is expected here",
    );
    one("Transform(translation: (1.0, 2.0))", "))", "`translation` takes (x, y, z): 2 values given");
    one(
        "Transform(translation: (1.0, 2.0, 3.0, 4.0))",
        "4.0",
        "`translation` takes (x, y, z): there is more in the parentheses than it takes",
    );
    one("Texture2(filename: fuji)", "fuji)", "`filename` takes string: a string in quotes is expected here");
    one(
        "SeamlessTerrain(color_mode: Plains)",
        "Plains",
        "`color_mode` takes Plain | Parts | Levels | Normals | Errors: `Plains` is none of these, did you mean `Plain`?",
    );
    one("DirectionalLight(on: 1)", "1)", "`on` takes bool: `true` or `false` is expected here");
    one("Group(children: Cube())", "Cube", "`children` takes a list of nodes in brackets, as in `children: [ … ]`");
    one("Cube(2.0)", "Cube", "the fields of Cube have to be named; Cube has the fields width, height and depth");
    one("Group([Cube()])", "Group", "the fields of Group have to be named; Group has the field children");
}

#[test]
fn values_on_later_lines_have_their_own_positions() {
    let found = complaints("Transform(\n  translation: // ü\n    (1.0,\n      x, 2.0))");
    assert_eq!(found, ["4:7: `translation` takes (x, y, z): a number is expected here"]);
}

#[test]
fn numbers_that_are_not_finite() {
    let all = "is not a finite number that fits: no field takes NaN, inf or numbers beyond its range";
    one("Cube(width: NaN)", "NaN", &format!("`width`: NaN {all}"));
    one("Cube(width: -inf)", "-inf", &format!("`width`: -inf {all}"));
    one("Cube(width: 1e400)", "1e400", &format!("`width`: 1e400 {all}"));
    one("Transform(translation: (0.0, 1.0e400, 2.0))", "1.0e400", &format!("`translation`: 1.0e400 {all}"));
    one("DirectionalLight(intensity: 1e39)", "1e39", &format!("`intensity`: 1e39 {all}"));
    one("BaseColor(rgb: (0.1, -1e39, 0))", "-1e39", &format!("`rgb`: -1e39 {all}"));
    one("SeamlessTerrain(void_sample: Some(inf))", "inf", &format!("`void_sample`: inf {all}"));
    one("Transform(rotation: (0, 0, 1, NaN))", "NaN", &format!("`rotation`: NaN {all}"));
}

#[test]
fn names_that_are_not_there() {
    one("Group(children: [Use(\"a\")])", "Use", "there is no Def(\"a\", …) for this Use");
    one(
        "Group(children: [Def(\"ground\", Cube), Use(\"grund\")])",
        "Use",
        "there is no Def(\"grund\", …) for this Use, did you mean \"ground\"?",
    );
    one(
        "Group(children: [Use(\"a\"), Def(\"a\", Cube)])",
        "Use",
        "Use(\"a\") stands before its Def, which comes at 1:56: put the Def at the first place",
    );
    one(
        "Group(children: [Def(\"a\", Cube), Def(\"a\", Group)])",
        "\"a\", Group",
        "the name \"a\" is taken by the node at 1:46: names are given once, Use(\"a\") shares the node",
    );
    one(
        "Group(children: [Def(\"a\", Group(children: [Cube, Use(\"a\")]))])",
        "Use",
        "Use(\"a\") stands inside the definition of \"a\": a group can not contain itself",
    );
    one("Use(\"a\")", "Use", "there is no Def(\"a\", …) for this Use");
    one("Group(children: [Def(1, Cube)])", "1,", "a name is a string in quotes, as in `Def(\"name\", Cube())`");
    one("Group(children: [Use(a)])", "a)", "a name is a string in quotes, as in `Use(\"name\")`");
    one(
        "Group(children: [Def(\"a\", Def(\"b\", Cube))])",
        "Def(\"b",
        "Def names a new node, and a node has one name: Def can not stand here",
    );
    one(
        "Group(children: [Def(\"a\", Cube), Def(\"b\", Use(\"a\"))])",
        "Use",
        "Def names a new node, and a node has one name: Use can not stand here",
    );
    for incomplete in ["Def", "Def()", "Def(\"a\")", "Def(\"a\", Cube, Cube)"] {
        let found = complaints(&format!("Group(children: [{incomplete}])"));
        assert_eq!(found.len(), 1);
        assert!(found[0].ends_with("Def takes a name and a node: `Def(\"name\", Cube())`"), "{found:?}");
    }
    for incomplete in ["Use", "Use()", "Use(\"a\", \"b\")"] {
        let found = complaints(&format!("Group(children: [{incomplete}])"));
        assert_eq!(found.len(), 1);
        assert!(found[0].ends_with("Use takes a name: `Use(\"name\")`"), "{found:?}");
    }
}

#[test]
fn a_mistake_in_a_shared_node_is_told_once() {
    let found = complaints("Group(children: [Def(\"a\", Cube(width: -1.0)), Use(\"a\"), Use(\"a\")])");
    assert_eq!(found, ["1:63: `width`: -1 does not work: lengths go from 0 up"]);
}

#[test]
fn values_that_can_not_be_used() {
    for value in ["0.0", "-2.5"] {
        let shown: f64 = value.parse().unwrap();
        one(
            &format!("SeamlessTerrain(scale: {value})"),
            value,
            &format!("`scale`: {shown} does not work: a length above 0"),
        );
    }
    one(
        "SeamlessTerrain(resolutions: (16, 1))",
        "(16",
        "`resolutions`: 1 resolutions do not work: 2 to 5 are needed (with one a split patch would have one child)",
    );
    one(
        "SeamlessTerrain(resolutions: (8, 3), morph: true)",
        "true)",
        "`morph`: morph works with two resolutions, where a patch has one refinement; resolutions (8, 3) have 3: give \
         resolutions (8, 2), or morph false",
    );
    one("PerspectiveCamera(near_distance: 0)", "0)", "`near_distance`: 0 does not work: it has to be above 0");
    one("Material(shininess: 2)", "2)", "`shininess`: 2 is out of range: it goes from 0 to 1");
    one(
        "ShaderProgram(shader_object: [VertexShader(parameter: [ShaderParameter(name: \"heightmap\")])])",
        "\"heightmap\"",
        "`name`: \"heightmap\" is unknown, did you mean \"height_map\"? the built-in program knows height_map and color_map",
    );
}

#[test]
fn children_where_they_can_not_be() {
    one(
        "Cube(children: [Cube])",
        "children",
        "Cube can not have children, only groups can: put it into a Separator together with them",
    );
    one(
        "ShaderProgram(shader_object: [VertexShader, Cube])",
        "Cube",
        "ShaderProgram can not have Cube as a child: it takes VertexShader, FragmentShader",
    );
}

#[test]
fn all_mistakes_of_meaning_are_told_in_the_order_of_the_file() {
    let found = complaints(
        "Separator(children: [\n  Use(\"later\"),\n  Cube(width: NaN),\n  Kube,\n  Def(\"later\", Cube(height: -1)),\n])",
    );
    let lines: Vec<&str> = found.iter().map(|m| m.split(": ").next().unwrap()).collect();
    assert_eq!(lines, ["2:3", "3:15", "4:3", "5:29"]);
}

#[test]
fn mistakes_say_where_in_the_tree_they_are() {
    let text = "Scene(version: 1, root: Separator(children: [Cube, Def(\"a\", Group(children: [Cube(width: NaN)]))]))";
    assert_eq!(mistakes(text)[0].path_in_tree, ["Separator", "a", "Cube[0]"]);
}

#[test]
fn syntax() {
    for (text, expected) in [
        ("", "1:1: the file is empty: a scene starts with `Scene(version: 1, root: …)`"),
        ("// nothing\n", "1:1: the file is empty: a scene starts with `Scene(version: 1, root: …)`"),
        ("Separator()", "1:1: a scene file starts with `Scene(version: 1, root: …)`, not with `Separator`"),
        ("(version: 1)", "1:1: a scene file starts with `Scene(version: 1, root: …)`"),
        ("Scene(version: 2, root: Cubicle(3))", "1:16: this file is of version 2, this program reads version 1"),
        ("Scene(root: Cubicle(3), version: 2)", "1:34: this file is of version 2, this program reads version 1"),
        ("Scene(version: \"1\", root: Cube)", "1:16: `version` takes an integer: an integer is expected here"),
        ("Scene(root: Cube)", "1:1: the scene has no version: write `Scene(version: 1, root: …)`"),
        (
            "Scene(version: 1)",
            "1:1: the scene has no root: write `Scene(version: 1, root: Separator(children: [ … ]))`",
        ),
        (
            "Scene(version: 1, root: 5)",
            "1:25: a node is expected here, such as `Cube()`, `Def(\"name\", Cube())` or `Use(\"name\")`",
        ),
        (
            "Scene(version: 1, root: [Cube])",
            "1:25: a node is expected here, such as `Cube()`, `Def(\"name\", Cube())` or `Use(\"name\")`",
        ),
        (
            "Scene(version: 1, root: Group(children: [Cube(), \"a\"]))",
            "1:50: a node is expected here, such as `Cube()`, `Def(\"name\", Cube())` or `Use(\"name\")`",
        ),
        (
            "Scene(version: 1, root: Cube, root: Cube)",
            "1:31: `root` is given twice, the first time at 1:19: take one away",
        ),
        (
            "Scene(version: 1, rot: Cube)",
            "1:19: Scene has no field `rot`, did you mean `root`?; Scene has the fields version and root",
        ),
        ("Scene(version: 1, root: Cube) Cube", "1:31: nothing may follow the `)` that closes the scene"),
        ("Scene(version: 1, root: Cube))", "1:30: nothing may follow the `)` that closes the scene"),
        (
            "Scene(version: 1, root: Group(children: [\n Cube\n Cube]))",
            "3:2: `,` or the closing bracket is expected here",
        ),
        ("Scene(version: 1, root: Cube(width 1))", "1:36: `:` and a value are expected after the name of a field"),
        (
            "Scene(version: 1, root: Cube(\"width\": 1))",
            "1:30: the name of a field is expected here, as in `width: 2.0`, without quotes",
        ),
        (
            "Scene(version: 1, root: Group(children: [\n  Cube(),\n",
            "3:1: the file ends too early: a bracket is not closed in the node at 1:25",
        ),
        ("Scene(version: 1, root: Cube()", "1:31: the file ends too early: a bracket is not closed"),
        ("Scene(version: 1, root: Cube /* a", "1:34: the comment is not closed: `*/` is missing at its end"),
    ] {
        let found: Vec<String> = mistakes(text).iter().map(|m| m.line()).collect();
        assert_eq!(found, [expected], "{text}");
    }
}

#[test]
fn a_mistake_of_syntax_hides_those_of_meaning() {
    let found = complaints("Group(children: [Cube(width: NaN), Cube(])");
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(matches!(mistakes("Scene(version: 1, root: Cube(]))")[0].problem, Problem::Syntax(_)));
}

#[test]
fn nesting_too_deep_is_told_where_it_begins() {
    for levels in [1001, 10_000, 100_000] {
        let text =
            format!("Scene(version: 1, root: {}Cube{})", "Group(children: [".repeat(levels), "])".repeat(levels));
        let found = mistakes(&text);
        assert_eq!(found.len(), 1);
        assert!(matches!(found[0].problem, Problem::TooDeep), "{:?}", found[0]);
        assert_eq!(found[0].position, Some(Position { line: 1, column: 25 + 1000 * 17 }));
        assert_eq!(
            found[0].problem.to_string(),
            "nodes are nested deeper than 1000 levels: take some of the groups away"
        );
    }
    // The same with names, which nest the text twice as deep, without an end, and in values.
    let names: String = (0..10_000).map(|i| format!("Def(\"{i}\", Group(children: [")).collect();
    assert!(matches!(mistakes(&format!("Scene(version: 1, root: {names}"))[0].problem, Problem::TooDeep));
    for open in ["(", "[", "a(", "{1:", "Some("] {
        for field in ["Cube(width: ", "Cube(unknown: ", "Unknown(", "Def("] {
            let deep = open.repeat(100_000);
            let found = mistakes(&format!("Scene(version: 1, root: {field}{deep}"));
            assert_eq!(found.len(), 1, "{open} {field}");
            assert_eq!(found[0].problem.to_string(), "the value is nested too deep", "{open} {field}");
        }
    }
}

/// Writes files into a folder and reads the scene among them.
fn read_with(files: &[(&str, &[u8])], root: &str) -> (String, Result<Scene, ReadError>, Result<usize, ReadError>) {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    let path = folder.path().join("scene.ron");
    std::fs::write(&path, format!("Scene(version: 1, root: {root})")).unwrap();
    let read = format::read_scene(&path);
    let checked = format::check(&path, &Registry::default());
    (folder.path().display().to_string(), read, checked)
}

fn png(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let image = image::ImageBuffer::<image::Luma<u16>, Vec<u16>>::from_fn(width, height, |x, y| {
        image::Luma([(x * 1000 + y * 77) as u16])
    });
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

const TERRAIN: &str = "Separator(children: [TextureUnit(unit: 0), Texture2(filename: \"map.png\"), SeamlessTerrain()])";

#[test]
fn missing_image() {
    let (folder, read, checked) = read_with(&[], TERRAIN);
    let expected = format!(
        "{folder}/scene.ron:1:87: there is no file {folder}/map.png: check the name, it is relative to the folder of the file in which it stands"
    );
    assert_eq!(read.unwrap_err().to_string(), expected);
    assert_eq!(checked.unwrap_err().to_string(), expected);
}

#[test]
fn images_that_are_no_maps() {
    let whole = png(5, 4);
    for (bytes, message) in [
        (png(1, 1), "a height map needs at least 2 × 2 samples, this one has 1 × 1".to_owned()),
        (png(7, 1), "a height map needs at least 2 × 2 samples, this one has 7 × 1".to_owned()),
        (zero_samples(), "can not decode".to_owned()),
        (whole[..whole.len() / 2].to_vec(), "can not decode".to_owned()),
        (whole[..20].to_vec(), "can not decode".to_owned()),
        (Vec::new(), "can not decode".to_owned()),
        (b"not a picture".to_vec(), "can not decode".to_owned()),
    ] {
        // Reading does not decode; checking and all actions do.
        let (folder, read, checked) = read_with(&[("map.png", &bytes)], TERRAIN);
        assert!(read.is_ok());
        let error = checked.unwrap_err();
        let line = error.to_string();
        assert!(line.starts_with(&format!("{folder}/scene.ron:1:87: ")), "{line}");
        assert!(line.contains(&message), "{line}");
        assert_eq!(error.mistakes().len(), 1, "{line}");
    }
}

/// A PNG whose header says that it is 0 × 0.
fn zero_samples() -> Vec<u8> {
    let mut bytes = png(5, 4);
    bytes[16..24].fill(0);
    // The checksum of the header (ISO 3309), as a writer of such a file would have put it.
    let crc = bytes[12..29].iter().fold(!0u32, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |c, _| if c & 1 == 1 { c >> 1 ^ 0xedb8_8320 } else { c >> 1 })
    });
    bytes[29..33].copy_from_slice(&(!crc).to_be_bytes());
    bytes
}

#[test]
fn the_smallest_map_works() {
    let (_, read, checked) = read_with(&[("map.png", &png(2, 2))], TERRAIN);
    assert_eq!((read.unwrap().len(), checked.unwrap()), (4, 4));
}

/// 8-bit and colour images are maps as well: 8 bits become 16, colours their intensity.
#[test]
fn images_of_other_depths_are_maps() {
    let encode = |image: image::DynamicImage| {
        let mut bytes = std::io::Cursor::new(Vec::new());
        image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        bytes.into_inner()
    };
    let grey = image::GrayImage::from_raw(2, 2, vec![0, 51, 102, 255]).unwrap();
    let colour = image::RgbImage::from_raw(2, 2, [[0u8; 3], [255, 0, 0], [0, 255, 0], [0, 0, 255]].concat()).unwrap();
    for (bytes, top) in [(encode(grey.into()), 1.0), (encode(colour.into()), 0.5870)] {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("map.png"), bytes).unwrap();
        let path = folder.path().join("scene.ron");
        let root = TERRAIN.replace("SeamlessTerrain()", "SeamlessTerrain(max_height: 1.0)");
        std::fs::write(&path, format!("Scene(version: 1, root: {root})")).unwrap();
        let bounds = BoundingBoxAction::default().apply(&format::read_scene(&path).unwrap()).unwrap().unwrap();
        assert_eq!(bounds.min.z, 0.0);
        assert!((bounds.max.z - top).abs() < 1e-6, "{}", bounds.max.z);
    }
}

#[test]
fn a_terrain_without_heights() {
    let (folder, _, checked) = read_with(&[], "Separator(children: [SeamlessTerrain])");
    assert_eq!(
        checked.unwrap_err().to_string(),
        format!(
            "{folder}/scene.ron:1:46: there is no height map on texture unit 0: put `TextureUnit(unit: 0)` and \
             `Texture2(filename: \"…\")` before the terrain"
        )
    );
}

#[test]
fn checking_tells_all_that_is_wrong_with_the_images_once() {
    let root = "Separator(children: [Texture2(filename: \"bad.png\"), Def(\"t\", Separator(children: [SeamlessTerrain])), \
                Use(\"t\"), Texture2(filename: \"map.png\"), Use(\"t\"), Texture2(filename: \"also_bad.png\")])";
    let (_, _, checked) = read_with(&[("bad.png", b"bad"), ("also_bad.png", b"worse"), ("map.png", &png(3, 3))], root);
    let error = checked.unwrap_err();
    let columns: Vec<usize> = error.mistakes().iter().map(|m| m.position.unwrap().column).collect();
    assert_eq!(columns, [65, 25 + root.find("\"also_bad").unwrap()], "{error}");
}

/// Groups shared by groups that are shared: 2^60 places in a text of a few lines.
#[test]
fn a_tower_of_shared_groups_is_read_and_checked() {
    let mut root = "Group(children: [Def(\"0\", Cube)".to_owned();
    for i in 0..60 {
        root += &format!(", Def(\"{}\", Group(children: [Use(\"{i}\"), Use(\"{i}\")]))", i + 1);
    }
    let (_, read, checked) = read_with(&[], &format!("{root}])"));
    assert_eq!((read.unwrap().len(), checked.unwrap()), (62, 62));
}

#[test]
fn no_camera() {
    let scene = format::parse("Scene(version: 1, root: Cube)", &Registry::default()).unwrap();
    let error = RenderAction::new(8, 8).apply(&scene).unwrap_err();
    assert!(error.to_string().starts_with("the scene has no camera: put a camera (PerspectiveCamera"), "{error}");
}

/// A generator of pseudo-random numbers (splitmix64), so that a failure can be repeated.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }
}

/// Where words, numbers and signs of a text begin and end.
fn tokens(text: &[u8]) -> Vec<std::ops::Range<usize>> {
    let class = |b: u8| if b.is_ascii_alphanumeric() || b"_.\"".contains(&b) { 0 } else { b };
    let mut tokens = Vec::new();
    let mut start = 0;
    for i in 1..=text.len() {
        if i == text.len() || class(text[i]) != class(text[i - 1]) || class(text[i]) != 0 {
            tokens.push(start..i);
            start = i;
        }
    }
    tokens
}

fn mutate(text: &[u8], random: &mut Random) -> Vec<u8> {
    let mut text = text.to_vec();
    for _ in 0..=random.below(3) {
        if text.is_empty() {
            break;
        }
        let at = random.below(text.len());
        let end = (at + 1 + random.below(12)).min(text.len());
        match random.below(7) {
            0 => drop(text.drain(at..end)),
            1 => {
                let copy = text[at..end].to_vec();
                text.splice(at..at, copy);
            }
            2 => text[at] = random.next() as u8,
            3 => text[at] = b"()[]{},:\"'/*#\\0-eN\n"[random.below(19)],
            4 => text.truncate(at),
            _ => {
                let tokens = tokens(&text);
                let (a, b) = (random.below(tokens.len()), random.below(tokens.len()));
                let (a, b) = (tokens[a.min(b)].clone(), tokens[a.max(b)].clone());
                if a != b {
                    let (first, second) = (text[a.clone()].to_vec(), text[b.clone()].to_vec());
                    text.splice(b, first);
                    text.splice(a, second);
                }
            }
        }
    }
    text
}

/// Whatever becomes of a scene's text: it is read, or told what is wrong at a place that exists; and what was read can be
/// written and read again.
#[test]
fn mutated_scenes_are_read_or_refused() {
    let mut scenes: Vec<PathBuf> = std::fs::read_dir(data("")).unwrap().map(|f| f.unwrap().path()).collect();
    scenes.retain(|path| path.extension().is_some_and(|e| e == "ron"));
    scenes.sort();
    assert!(!scenes.is_empty());
    // In memory where there is such a place: files are written by the thousand, and a disk takes milliseconds for each.
    let memory = Path::new("/dev/shm");
    let folder = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() }.unwrap();
    for file in std::fs::read_dir(data("")).unwrap().map(|f| f.unwrap().path()) {
        if file.extension().is_some_and(|e| e == "png" || e == "wgsl") {
            std::fs::write(folder.path().join(file.file_name().unwrap()), b"").unwrap();
        }
    }
    std::fs::create_dir(folder.path().join("parts")).unwrap();
    for file in std::fs::read_dir(data("parts")).unwrap().map(|f| f.unwrap().path()) {
        std::fs::copy(&file, folder.path().join("parts").join(file.file_name().unwrap())).unwrap();
    }
    let path = folder.path().join("mutated.ron");
    for (number, scene) in scenes.iter().enumerate() {
        let original = std::fs::read(scene).unwrap();
        let (mut good, mut random) = (0, Random(number as u64));
        for round in 0..3000 {
            let text = mutate(&original, &mut random);
            std::fs::write(&path, &text).unwrap();
            match format::read_scene(&path) {
                Ok(scene) => {
                    good += 1;
                    let written = format::write_scene(&scene).unwrap();
                    let again = format::parse(&written, &Registry::default());
                    assert!(again.is_ok(), "round {round}: {}\n{written}", again.unwrap_err());
                }
                Err(ReadError::Mistakes { mistakes, .. }) => {
                    assert!(!mistakes.is_empty());
                    let lines: Vec<usize> =
                        String::from_utf8_lossy(&text).split('\n').map(|line| line.chars().count()).collect();
                    for mistake in mistakes {
                        assert_eq!(mistake.file.as_ref(), Some(&path), "round {round}: {mistake:?}");
                        let Position { line, column } = mistake.position.unwrap();
                        assert!(line >= 1 && line <= lines.len(), "round {round}: {mistake:?}");
                        assert!(column >= 1 && column <= lines[line - 1] + 1, "round {round}: {mistake:?}");
                        assert!(!mistake.problem.to_string().is_empty());
                    }
                }
                Err(other) => panic!("round {round}: {other}"),
            }
        }
        // Mutations of comments and numbers leave a scene readable: both arms above were tried.
        assert!(good > 20 && good < 2900, "{good} of 3000 mutations of {} can be read", scene.display());
    }
}
