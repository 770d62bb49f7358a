//! Text that faces the viewer: its ink against a rasteriser beside the scene, its cells against the ink, and all that may be wrong.
#![cfg(feature = "render")]

mod common;

use ab_glyph::{Font as _, FontArc, PxScale, ScaleFont as _, point};
use common::gpu::{LinearPicture, linear};
use seamount::action::{Draw, GeometryKind};
use seamount::format::{parse, read_scene, write_scene};
use seamount::node::{HitDetail, Registry, TextDetail};
use seamount::prelude::*;
use seamount::scene::FontError;

const SIZE: [u32; 2] = [120, 80];

/// The origin is the pixel corner (60, 40).
const EYE: &str =
    "PerspectiveCamera(position: (0.0, 0.0, 9.0), look_at: (0.0, 0.0, 0.0)), BaseColor(rgb: (1.0, 1.0, 1.0)),";

fn scene_of(nodes: &str) -> Scene {
    let text = format!("Scene(version: 1, root: Separator(children: [{nodes}]))");
    parse(&text, &Registry::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn picture(scene: &Scene) -> LinearPicture {
    linear().draw(&RenderAction::new(SIZE[0], SIZE[1]).apply(scene).unwrap_or_else(|e| panic!("{e}")))
}

/// Red of all pixels.
fn shares(scene: &Scene) -> Vec<f32> {
    picture(scene).texels.iter().map(|texel| texel[0]).collect()
}

fn pixels() -> impl Iterator<Item = (u32, u32)> {
    (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y)))
}

fn at(shares: &[f32], x: u32, y: u32) -> f32 {
    shares[(y * SIZE[0] + x) as usize]
}

fn detail(scene: &Scene, x: u32, y: u32) -> Option<TextDetail> {
    let hits = RayPickAction::pixel(x, y, SIZE).apply(scene).expect("a pick");
    match hits.first()?.detail {
        HitDetail::Text(detail) => Some(detail),
        _ => None,
    }
}

/// The characters that picks find, row by row.
fn cells(scene: &Scene) -> Vec<Option<TextDetail>> {
    let picker = RayPickAction::pixel(0, 0, SIZE).picker(scene).expect("a picker");
    let [w, h] = SIZE.map(f64::from);
    pixels()
        .map(|(x, y)| {
            let hits = picker.pick_through((f64::from(x) + 0.5) / w, (f64::from(y) + 0.5) / h, false).expect("a pick");
            hits.first().and_then(|hit| match hit.detail {
                HitDetail::Text(detail) => Some(detail),
                _ => None,
            })
        })
        .collect()
}

fn hack() -> FontArc {
    FontArc::try_from_slice(epaint_default_fonts::HACK_REGULAR).expect("a font")
}

/// Coverage of a string whose pen starts at a place of the picture, worked out by the rasteriser alone.
fn expected(font: &FontArc, size: f32, string: &str, pen: [f32; 2]) -> Vec<f32> {
    let scale = PxScale::from(size * font.height_unscaled() / font.units_per_em().expect("units"));
    let scaled = font.as_scaled(scale);
    let mut shares = vec![0.0f32; (SIZE[0] * SIZE[1]) as usize];
    let (mut x, mut before) = (pen[0], None);
    for c in string.chars() {
        let id = font.glyph_id(c);
        x += before.map_or(0.0, |before| scaled.kern(before, id));
        if let Some(glyph) = font.outline_glyph(id.with_scale_and_position(scale, point(x, pen[1]))) {
            let bounds = glyph.px_bounds();
            glyph.draw(|gx, gy, share| {
                let (px, py) = (bounds.min.x as i64 + i64::from(gx), bounds.min.y as i64 + i64::from(gy));
                if (0..i64::from(SIZE[0])).contains(&px) && (0..i64::from(SIZE[1])).contains(&py) {
                    let slot = &mut shares[(py * i64::from(SIZE[0]) + px) as usize];
                    *slot = (*slot + share.clamp(0.0, 1.0)).min(1.0);
                }
            });
        }
        x += scaled.h_advance(id);
        before = Some(id);
    }
    shares
}

fn width(font: &FontArc, size: f32, string: &str) -> f32 {
    let scale = PxScale::from(size * font.height_unscaled() / font.units_per_em().expect("units"));
    string.chars().map(|c| font.as_scaled(scale).h_advance(font.glyph_id(c))).sum()
}

/// White text on black shows the coverage, 8 bits of it, at the pen that justification and spacing say.
#[test]
fn ink_is_where_the_rasteriser_puts_it() {
    let font = hack();
    for size in [10.0f32, 16.0, 23.5] {
        for justification in ["Left", "Right", "Center"] {
            for (string, spacing) in [(["Fuji", ""], 1.0), (["Ågy;", "j|Q"], 1.5), (["above", "over"], -1.2)] {
                let nodes = format!(
                    "{EYE} Font(size: {size:?}), Text2(string: {string:?}, spacing: {spacing:?}, justification: {justification})"
                );
                let got = shares(&scene_of(&nodes));
                let mut want = vec![0.0f32; got.len()];
                for (k, string) in string.iter().enumerate() {
                    let wide = width(&font, size, string);
                    let start = match justification {
                        "Left" => 0.0,
                        "Right" => (-wide).round(),
                        _ => (-0.5 * wide).round(),
                    };
                    let baseline = 40.0 + (k as f32 * spacing * size).round();
                    let line = expected(&font, size, string, [60.0 + start, baseline]);
                    want.iter_mut().zip(line).for_each(|(w, l)| *w = (*w + l).min(1.0));
                }
                let inked = want.iter().filter(|share| **share > 0.1).count();
                assert!(inked > 30, "{nodes}: {inked}");
                for (x, y) in pixels() {
                    let (got, want) = (at(&got, x, y), at(&want, x, y));
                    // 1/255 by the image, half of 2⁻¹⁰ by the picture, and what f32 pens are off: a pixel's share changes by at most
                    // the height of it.
                    assert!((got - want).abs() < 6e-3, "{nodes} at ({x}, {y}): {got} is not {want}");
                }
            }
        }
    }
}

/// All ink is in cells, and cells tell the characters in their order, as wide as the font says.
#[test]
fn cells_hold_all_ink_in_order() {
    let strings = ["MiW.j", "", "(a b)"];
    for justification in ["Left", "Right", "Center"] {
        for camera in
            [EYE, "OrthographicCamera(position: (0.0, 0.0, 9.0), height: 8.0), BaseColor(rgb: (1.0, 1.0, 1.0)),"]
        {
            let nodes =
                format!("{camera} Font(size: 15.0), Text2(string: {strings:?}, justification: {justification})");
            let scene = scene_of(&nodes);
            let (shares, cells) = (shares(&scene), cells(&scene));
            let mut seen = Vec::new();
            for ((x, y), cell) in pixels().zip(&cells) {
                if at(&shares, x, y) > 0.0 {
                    assert!(cell.is_some(), "ink beside all cells at ({x}, {y}): {nodes}");
                    seen.extend(*cell);
                }
            }
            for (string, text) in strings.iter().enumerate() {
                for (character, letter) in text.chars().enumerate() {
                    let own = TextDetail { string, character };
                    assert_eq!(seen.contains(&own), letter != ' ', "{letter:?} of {nodes}");
                    // Columns of a cell: one letter after the other, of one width.
                    let columns: Vec<u32> =
                        pixels().zip(&cells).filter(|(_, c)| **c == Some(own)).map(|((x, _), _)| x).collect();
                    let wide = columns.iter().max().expect("a column") - columns.iter().min().expect("a column") + 1;
                    let advance = f64::from(width(&hack(), 15.0, "M"));
                    assert!((f64::from(wide) - advance).abs() <= 2.0, "{letter:?}: {wide} is not {advance}");
                }
                let order = |y: u32| {
                    let row =
                        (0..SIZE[0]).filter_map(|x| cells[(y * SIZE[0] + x) as usize].filter(|c| c.string == string));
                    row.map(|c| c.character).collect::<Vec<_>>()
                };
                assert!((0..SIZE[1]).all(|y| order(y).is_sorted()));
            }
            assert!(!cells.iter().flatten().any(|cell| cell.string == 1), "an empty string has no cells");
        }
    }
}

/// The size is in pixels, whatever the distance, the lens, and the scale of the model; place and picture are as they are shown.
#[test]
fn size_and_looks_do_not_depend_on_the_distance() {
    let text = "Font(size: 14.0), Text2(string: \"Fuji\", justification: Center)";
    let want = shares(&scene_of(&format!("{EYE} {text}")));
    for nodes in [
        format!("{EYE} Translation(translation: (0.0, 0.0, -5000.0)), {text}"),
        format!("{EYE} Translation(translation: (0.0, 0.0, 7.0)), RotationXyz(axis: Y, angle: 1.2), {text}"),
        format!("{EYE} Scale(scale_factor: (30.0, 0.2, -7.0)), {text}"),
        format!(
            "OrthographicCamera(position: (0.0, 0.0, 1.0e6), height: 3.0), BaseColor(rgb: (1.0, 1.0, 1.0)), {text}"
        ),
        // A picture that is stretched.
        format!("PerspectiveCamera(position: (0.0, 0.0, 9.0), look_at: (0.0, 0.0, 0.0), viewport_mapping: LeaveAlone, aspect_ratio: 0.5),
            BaseColor(rgb: (1.0, 1.0, 1.0)), {text}"),
        // Within half a pixel it snaps to the same.
        format!(
            "OrthographicCamera(position: (0.0, 0.0, 9.0), height: 8.0), BaseColor(rgb: (1.0, 1.0, 1.0)),
            Translation(translation: (0.04, -0.04, 0.0)), {text}"
        ),
    ] {
        assert!(shares(&scene_of(&nodes)) == want, "{nodes}");
    }
    // A whole number of pixels away it is the same, as far away.
    let moved = shares(&scene_of(&format!(
        "OrthographicCamera(position: (0.0, 0.0, 9.0), height: 8.0), BaseColor(rgb: (1.0, 1.0, 1.0)),
         Translation(translation: (-2.0, 1.0, 0.0)), {text}"
    )));
    for (x, y) in pixels().filter(|(x, y)| x + 20 < SIZE[0] && *y >= 10) {
        assert_eq!(at(&moved, x, y - 10), at(&want, x + 20, y));
    }
}

/// A font of one's own is found beside the scene's file.
#[test]
fn a_font_may_come_from_a_file() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("own.ttf"), epaint_default_fonts::UBUNTU_LIGHT).expect("a file");
    std::fs::write(folder.path().join("broken.ttf"), b"no font at all").expect("a file");
    let scene = |font: &str| {
        let nodes = format!("{EYE}\n{font}, Text2(string: \"AVA fi\")");
        let text = format!("Scene(version: 1, root: Separator(children: [{nodes}]))");
        std::fs::write(folder.path().join("scene.ron"), text).expect("a file");
        read_scene(folder.path().join("scene.ron")).unwrap_or_else(|e| panic!("{e}"))
    };
    // One that is missing is told before anything is drawn, at its name.
    let missing = "Scene(version: 1, root: Separator(children: [\nFont(name: \"Helvetica\")]))";
    std::fs::write(folder.path().join("missing.ron"), missing).expect("a file");
    let error = read_scene(folder.path().join("missing.ron")).unwrap_err();
    let place = error.mistakes()[0].position.expect("a place");
    assert_eq!((place.line, place.column), (2, 12), "{error}");
    assert!(error.to_string().contains("there is no font"), "{error}");
    let font = FontArc::try_from_slice(epaint_default_fonts::UBUNTU_LIGHT).expect("a font");
    let got = shares(&scene("Font(name: \"own.ttf\", size: 20.0)"));
    let want = expected(&font, 20.0, "AVA fi", [60.0, 40.0]);
    for (x, y) in pixels() {
        let (got, want) = (at(&got, x, y), at(&want, x, y));
        assert!((got - want).abs() < 6e-3, "({x}, {y}): {got} is not {want}");
    }
    assert!(got.iter().filter(|share| **share > 0.5).count() > 50);

    for (name, words) in [
        ("Helvetica", ["there is no font", "Helvetica", "defaultFont", ".ttf"]),
        ("broken.ttf", ["broken.ttf", "is no font", "TrueType", ".otf"]),
        (".", ["can not read", "no regular file", "", ""]),
    ] {
        let mut scene = scene("Font(name: \"own.ttf\")");
        let font = scene.children(scene.root())[2];
        scene.edit::<Font>(font).expect("a font").name = name.to_owned();
        let view = RenderAction::new(SIZE[0], SIZE[1]);
        let drawn = view.apply(&scene).unwrap_err();
        let picked = RayPickAction::pixel(60, 39, SIZE).apply(&scene).unwrap_err();
        for error in [drawn, picked] {
            let ActionError::Shape { error: seamount::action::ShapeError::Font(_), place } = &error else {
                panic!("{error:?}")
            };
            assert_eq!(place.position.map(|p| p.line), Some(2), "the place of the Font: {error}");
            let message = error.to_string();
            assert!(words.iter().all(|word| message.contains(word)), "{message}");
        }
        // Where nothing is as large as in a picture, no font is read.
        assert!(BoundingBoxAction::default().apply(&scene).is_ok());
    }
}

/// What may never end is refused before it is opened, whatever names it.
#[cfg(unix)]
#[test]
fn pipes_are_not_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let pipe = folder.path().join("pipe");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().expect("mkfifo").success());
    let scene = scene_of(&format!("{EYE} Font(name: {pipe:?}), Text2(string: \"a\")"));
    let refused = [
        RenderAction::new(9, 9).apply(&scene).unwrap_err().to_string(),
        scene.resources().text(&pipe).unwrap_err().to_string(),
        scene.resources().image(&pipe).unwrap_err().to_string(),
    ];
    assert!(refused.iter().all(|message| message.contains("pipe: it is no regular file")), "{refused:?}");
}

/// A font whose characters are many times its em large is drawn as boxes where they would take all memory.
#[test]
fn characters_too_large_to_paint_are_boxes() {
    let folder = tempfile::tempdir().expect("a folder");
    // With an em of fewer units everything is larger: 2048 are those of the font itself.
    let font = |units: u16| {
        let mut bytes = epaint_default_fonts::HACK_REGULAR.to_vec();
        let head = bytes[12..].chunks(16).find(|record| record.starts_with(b"head")).expect("a table");
        let head = u32::from_be_bytes(head[8..12].try_into().expect("four bytes")) as usize;
        assert_eq!(bytes[head + 18..head + 20], 2048u16.to_be_bytes());
        bytes[head + 18..head + 20].copy_from_slice(&units.to_be_bytes());
        let path = folder.path().join(format!("{units}.ttf"));
        std::fs::write(&path, bytes).expect("a file");
        path
    };
    let camera = "OrthographicCamera(position: (0.0, 0.0, 9.0), height: 8.0), BaseColor(rgb: (1.0, 1.0, 1.0)),";
    let large = |size: f64, x: f64| {
        let path = font(256);
        scene_of(&format!(
            "{camera} Font(name: {path:?}, size: {size:?}), Translation(translation: ({x:?}, 0.0, 0.0)),
             Text2(string: \"M\", justification: Right)"
        ))
    };
    // 4.8 ems wide: at 1024 pixels the right edge of the box is a tenth of that left of the pen; its border is 64 wide.
    let margin = 0.1 * f64::from(width(&hack(), 1024.0, "M")) * 8.0;
    let shares_of = shares(&large(1024.0, 0.1 * margin));
    for (x, y) in pixels().filter(|(x, y)| !(58..62).contains(x) && !(38..42).contains(y)) {
        assert_eq!(at(&shares_of, x, y), if x < 60 && y < 40 { 1.0 } else { 0.0 }, "({x}, {y})");
    }
    // A size that can be painted is: the letter of the font itself at eight times the size.
    let own = format!("{camera} Font(size: 64.0), Text2(string: \"M\", justification: Right)");
    assert!(shares(&large(8.0, 0.0)) == shares(&scene_of(&own)));
    // Larger than anything is: at any size a box.
    let path = font(64);
    let huge = scene_of(&format!("{camera} Font(name: {path:?}, size: 4.0), Text2(string: \"M\")"));
    assert!(shares(&huge).iter().filter(|share| **share == 1.0).count() > 20);
    assert!(shares(&huge).iter().all(|share| *share == 0.0 || *share == 1.0));
}

/// Text without a font, or with one that its fields do not allow.
#[test]
fn fields_out_of_range_are_refused() {
    for (nodes, words) in [
        ("Font(size: 0.0)", "`size`: 0 does not work"),
        ("Font(size: 2000.0)", "`size`: 2000 does not work"),
        ("Font(name: \"\")", "`name`: a font has a name"),
    ] {
        let text = format!("Scene(version: 1, root: Separator(children: [{nodes}]))");
        let error = parse(&text, &Registry::default()).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
    let mut scene = scene_of(&format!("{EYE} Font(), Text2(string: \"a\")"));
    let [font, text] = [2, 3].map(|k| scene.children(scene.root())[k]);
    for size in [f64::NAN, -1.0, 1e9, f64::INFINITY] {
        scene.edit::<Font>(font).expect("a font").size = size;
        let error = RenderAction::new(9, 9).apply(&scene).unwrap_err();
        let font_error =
            matches!(&error, ActionError::Shape { error: seamount::action::ShapeError::Font(FontError::Size(_)), .. });
        assert!(font_error, "{error}");
    }
    scene.edit::<Font>(font).expect("a font").size = 9.0;
    let view = RenderAction::new(9, 9).viewpoint(&scene).expect("a view");
    for spacing in [f64::NAN, 1e308, -1.1e6] {
        scene.edit::<Text2>(text).expect("a text").spacing = spacing;
        let errors = [
            RenderAction::new(9, 9).apply(&scene).map(|_| ()),
            RayPickAction::pixel(4, 4, [9, 9]).apply(&scene).map(|_| ()),
            BoundingBoxAction { view: Some(view), ..BoundingBoxAction::default() }.apply(&scene).map(|_| ()),
        ];
        assert!(errors.into_iter().all(|error| error.unwrap_err().to_string().contains("spacing")), "{spacing}");
    }
}

/// A character that the font does not have is the border of a box; blanks and control characters are nothing, and take room.
#[test]
fn missing_characters_are_boxes() {
    let scene = scene_of(&format!("{EYE} Font(size: 20.0), Text2(string: \"a\\t\u{4e2d} b\")"));
    let (shares, cells) = (shares(&scene), cells(&scene));
    let ink = |character: usize| -> Vec<(u32, u32, f32)> {
        let own = Some(TextDetail { string: 0, character });
        let inked = pixels().zip(&cells).filter(|((x, y), cell)| **cell == own && at(&shares, *x, *y) > 0.0);
        inked.map(|((x, y), _)| (x, y, at(&shares, x, y))).collect()
    };
    assert!(ink(1).is_empty() && ink(3).is_empty() && !ink(0).is_empty() && !ink(4).is_empty());
    let boxed = ink(2);
    let range = |of: fn(&(u32, u32, f32)) -> u32| {
        (boxed.iter().map(of).min().expect("ink"), boxed.iter().map(of).max().expect("ink"))
    };
    let ((left, right), (top, bottom)) = (range(|p| p.0), range(|p| p.1));
    assert!(right - left >= 6 && bottom - top >= 12, "{left}..{right}, {top}..{bottom}");
    for y in top..=bottom {
        for x in left..=right {
            let border = x == left || x == right || y == top || y == bottom;
            assert_eq!(at(&shares, x, y), if border { 1.0 } else { 0.0 }, "({x}, {y})");
        }
    }
}

fn draws(scene: &Scene) -> Vec<Draw> {
    RenderAction::new(SIZE[0], SIZE[1]).apply(scene).expect("a frame").draws
}

/// What has no characters is nothing; blanks alone can be picked, and are not drawn.
#[test]
fn empty_text_is_nothing() {
    for (strings, boxed, picked) in
        [("[]", false, false), ("\"\"", false, false), ("[\"\", \"\"]", false, false), ("\"  \"", true, true)]
    {
        let scene = scene_of(&format!("{EYE} Font(size: 20.0), Text2(string: {strings})"));
        assert!(draws(&scene).is_empty(), "{strings}");
        assert_eq!(BoundingBoxAction::default().apply(&scene).expect("a box").is_some(), boxed, "{strings}");
        assert_eq!(detail(&scene, 65, 38).is_some(), picked, "{strings}");
    }
}

/// However long or large a text, no more of it is painted than the picture has pixels and a margin of 128; and none of what the picture does not show.
#[test]
fn what_is_painted_is_bounded_by_the_picture() {
    let long = "0123456789".repeat(2000);
    for (nodes, shown) in [
        (format!("Font(size: 30.0), Text2(string: \"{long}\", justification: Center)"), true),
        ("Font(size: 1024.0), Text2(string: \"MMMM\", justification: Center)".to_owned(), true),
        ("Font(size: 12.0), Translation(translation: (1000.0, 0.0, 0.0)), Text2(string: \"away\")".to_owned(), false),
        ("Font(size: 12.0), Translation(translation: (1e300, 0.0, 0.0)), Text2(string: \"away\")".to_owned(), false),
        ("Font(size: 12.0), Translation(translation: (0.0, 0.0, 20.0)), Text2(string: \"behind\")".to_owned(), false),
        ("Font(size: 12.0), Text2(string: [\"\", \"far below\"], spacing: 1e6)".to_owned(), false),
    ] {
        let scene = scene_of(&format!("{EYE} {nodes}"));
        let draws = draws(&scene);
        assert_eq!(draws.len(), usize::from(shown), "{nodes:.60}");
        for draw in &draws {
            let image = &draw.coloring.color_map.as_ref().expect("an image").image;
            assert!(image.width() <= SIZE[0] + 256 && image.height() <= SIZE[1] + 256);
        }
        let inked = shares(&scene).iter().filter(|share| **share > 0.0).count();
        assert_eq!(inked > 0, shown, "{nodes:.60}: {inked}");
    }
    // The part that is seen is what would be seen of it all: the middle of digits in their order.
    let whole = format!("{EYE} Font(size: 30.0), Text2(string: \"0123456789\")");
    let cut = format!("{EYE} Font(size: 30.0), Text2(string: \"0123456789{}\")", "x".repeat(500));
    let (whole, cut) = (shares(&scene_of(&whole)), shares(&scene_of(&cut)));
    assert!(whole == cut);
}

/// The colour and transparency of the material, with no light on it and no texture, whatever the style.
#[test]
fn the_colour_is_that_of_the_material() {
    let text = "Font(size: 24.0), Text2(string: \"MM\")";
    let plain = picture(&scene_of(&format!("{EYE} {text}")));
    let looks = "Environment(ambient_intensity: 0.5), DirectionalLight(), DrawStyle(style: Lines), ShapeHints(vertex_ordering: Clockwise),
        Complexity(texture_quality: 1.0), Texture2Transform(scale_factor: (3.0, 0.2)), PolygonOffset(units: 5.0),";
    let half = "Material(diffuse_color: (1.0, 0.0, 0.0), transparency: 0.5, emissive_color: (0.0, 1.0, 0.0)),";
    let colored = picture(&scene_of(&format!("{EYE} {looks} {half} {text}")));
    for (plain, colored) in plain.texels.iter().zip(&colored.texels) {
        let want = [0.5 * plain[0], 0.0, 0.0];
        assert!(colored.iter().zip(want).all(|(c, w)| (c - w).abs() < 2e-3), "{colored:?} is not {want:?}");
    }
    let invisible = scene_of(&format!("{EYE} DrawStyle(style: Invisible), {text}"));
    assert!(draws(&invisible).is_empty());
}

/// It has the depth of its origin: what is before it hides it, what is behind it shows between the letters; and it is cut whole.
#[test]
fn it_is_as_deep_as_its_place() {
    let text = "Font(size: 24.0), Text2(string: \"MM\")";
    let cube = |z: f64| {
        format!(
            "Separator(children: [BaseColor(rgb: (0.0, 1.0, 0.0)), Translation(translation: (0.0, 0.0, {z:?})), Cube(width: 30.0, height: 30.0, depth: 0.1)])"
        )
    };
    let letters = picture(&scene_of(&format!("{EYE} {text}")));
    let unlit = format!("{EYE} LightModel(model: BaseColor),");
    for order in [format!("{unlit} {}, {text}", cube(-2.0)), format!("{unlit} {text}, {}", cube(-2.0))] {
        let over = picture(&scene_of(&order));
        for (alone, over) in letters.texels.iter().zip(&over.texels) {
            assert!((over[0] - alone[0]).abs() < 2e-3 && (over[1] - 1.0).abs() < 2e-3, "{over:?} over {alone:?}");
        }
    }
    for order in [format!("{unlit} {}, {text}", cube(2.0)), format!("{unlit} {text}, {}", cube(2.0))] {
        let scene = scene_of(&order);
        assert!(picture(&scene).texels.iter().all(|texel| texel[0] == 0.0), "{order}");
        assert_eq!(detail(&scene, 65, 35), None);
    }
    let planes = |distance: f64| format!("{EYE} ClipPlane(plane: (0.0, 1.0, 0.0, {distance:?})), {text}");
    assert!(shares(&scene_of(&planes(-1.0))) == letters.texels.iter().map(|t| t[0]).collect::<Vec<_>>());
    let cut = scene_of(&planes(0.001));
    assert!(draws(&cut).is_empty() && detail(&cut, 65, 35).is_none());
    assert!(detail(&scene_of(&planes(-1.0)), 65, 35).is_some());
}

/// A picked point lies in the plane of the text, where the ray goes, and faces the viewer.
#[test]
fn a_pick_is_on_the_plane_of_the_text() {
    let scene = scene_of(
        "PerspectiveCamera(position: (3.0, -2.0, 9.0), look_at: (0.4, 0.0, 0.0)), Rotation(rotation: (1.0, 2.0, 3.0, 0.8)),
         Scale(scale_factor: (2.0, 3.0, 0.5)), Font(size: 20.0), Text2(string: \"plane\", justification: Center)"
    );
    let picker = RayPickAction::pixel(0, 0, SIZE).picker(&scene).expect("a picker");
    let view = *picker.viewpoint().expect("a view");
    let mut met = 0;
    for (x, y) in pixels() {
        let place = [(f64::from(x) + 0.5) / f64::from(SIZE[0]), (f64::from(y) + 0.5) / f64::from(SIZE[1])];
        let ray = picker.ray_through(place[0], place[1]).expect("a ray");
        for hit in picker.pick_through(place[0], place[1], true).expect("a pick") {
            met += 1;
            assert!((hit.point - ray.at(hit.distance)).length() < 1e-9);
            assert!((hit.point - hit.local_to_world.transform_point3(hit.object_point)).length() < 1e-9);
            let off = (hit.point - hit.local_to_world.translation).dot(view.forward);
            assert!(off.abs() < 1e-9, "{off}");
            assert!((hit.normal + view.forward).length() < 1e-9, "{}", hit.normal);
        }
        // A ray of the world knows no pixels.
        assert!(picker.pick(&ray, true).expect("a pick").is_empty());
    }
    assert!(met > 500, "{met}");
    let unpickable =
        scene_of(&format!("{EYE} PickStyle(style: Unpickable), Font(size: 20.0), Text2(string: \"plane\")"));
    assert_eq!(detail(&unpickable, 65, 38), None);
    let boxed = scene_of(&format!("{EYE} PickStyle(style: BoundingBox), Font(size: 20.0), Text2(string: \"plane\")"));
    let hits = RayPickAction::pixel(65, 38, SIZE).apply(&boxed).expect("a pick");
    assert!(matches!(hits.as_slice(), [hit] if hit.detail == HitDetail::None), "{hits:?}");
    let picker = RayPickAction::pixel(0, 0, SIZE).picker(&boxed).expect("a picker");
    let ray = picker.ray_through(65.5 / 120.0, 38.5 / 80.0).expect("a ray");
    assert!(picker.pick(&ray, true).expect("a pick").is_empty());
}

/// Where the view is known the box holds all ink and no more than a pixel more; without one it is the place.
#[test]
fn the_box_is_what_the_text_covers() {
    for camera in [
        "PerspectiveCamera(position: (0.0, 0.0, 9.0), look_at: (0.0, 0.0, 0.0)),",
        "OrthographicCamera(position: (0.0, 0.0, 9.0), height: 8.0),",
    ] {
        let scene = scene_of(&format!(
            "{camera} Translation(translation: (-1.0, 0.5, 1.0)), Scale(scale_factor: (3.0, 0.3, 2.0)), BaseColor(rgb: (1.0, 1.0, 1.0)),
             Font(size: 18.0), Text2(string: [\"box\", \"Åj\"], justification: Right)"
        ));
        let place = BoundingBoxAction::default().apply(&scene).expect("a box").expect("text");
        assert_eq!((place.min, place.max), (DVec3::new(-1.0, 0.5, 1.0), DVec3::new(-1.0, 0.5, 1.0)));
        let view = RenderAction::new(SIZE[0], SIZE[1]).viewpoint(&scene).expect("a view");
        let action = BoundingBoxAction { view: Some(view), ..BoundingBoxAction::default() };
        let bounds = action.apply(&scene).expect("a box").expect("text");
        let corners = [bounds.min, bounds.max].map(|p| {
            let clip = view.clip_from_eye() * (p - view.eye).extend(1.0);
            let [w, h] = SIZE.map(f64::from);
            [(0.5 + 0.5 * clip.x / clip.w) * w, (0.5 - 0.5 * clip.y / clip.w) * h]
        });
        let (left, bottom, right, top) = (corners[0][0], corners[0][1], corners[1][0], corners[1][1]);
        let cells = cells(&scene);
        let covered: Vec<(u32, u32)> =
            pixels().zip(&cells).filter(|(_, cell)| cell.is_some()).map(|(p, _)| p).collect();
        let least = |of: fn(&(u32, u32)) -> u32| f64::from(covered.iter().map(of).min().expect("a pixel"));
        let most = |of: fn(&(u32, u32)) -> u32| f64::from(covered.iter().map(of).max().expect("a pixel")) + 1.0;
        let want = [least(|p| p.0), most(|p| p.1), most(|p| p.0), least(|p| p.1)];
        let got = [left, bottom, right, top];
        assert!(got.iter().zip(want).all(|(g, w)| (g - w).abs() < 1e-6), "{got:?} is not {want:?}");
    }
}

/// A moving camera paints nothing anew; a new string does.
#[test]
fn what_was_painted_is_kept() {
    let mut scene = scene_of(&format!("{EYE} Font(size: 18.0), Text2(string: \"kept\")"));
    let [camera, text] = [0, 3].map(|k| scene.children(scene.root())[k]);
    let (action, mut view) = (RenderAction::new(SIZE[0], SIZE[1]), View::default());
    let mut image = |scene: &Scene| {
        let frame = action.apply_in(scene, &mut view).expect("a frame");
        frame.draws[0].coloring.color_map.as_ref().expect("an image").image.id()
    };
    let first = image(&scene);
    scene.edit::<PerspectiveCamera>(camera).expect("a camera").position = Some(DVec3::new(1.0, 2.0, 12.0));
    assert_eq!(image(&scene), first);
    scene.edit::<Text2>(text).expect("a text").string = "new".into();
    assert_ne!(image(&scene), first);
}

/// What is larger than the picture is painted anew only when it has moved far, and looks as if it were painted each time.
#[test]
fn large_text_keeps_its_image_as_it_moves() {
    let digits = "0123456789".repeat(20);
    let mut scene = scene_of(&format!(
        "OrthographicCamera(position: (0.0, 0.0, 9.0), height: 8.0), BaseColor(rgb: (1.0, 1.0, 1.0)), Font(size: 100.0),
         Translation(), Text2(string: [\"{digits}\", \"{digits}\"], justification: Center)"
    ));
    let place = scene.children(scene.root())[3];
    let (action, mut view) = (RenderAction::new(SIZE[0], SIZE[1]), View::default());
    let mut images = std::collections::HashSet::new();
    // A pixel each frame, there and back.
    for step in (0..200).chain((0..200).rev()) {
        let moved = f64::from(step) / 10.0;
        scene.edit::<Translation>(place).expect("a place").translation = DVec3::new(moved, -0.2 * moved, 0.0);
        let frame = action.apply_in(&scene, &mut view).expect("a frame");
        images.insert(frame.draws[0].coloring.color_map.as_ref().expect("an image").image.id());
        if step % 45 == 7 {
            let kept: Vec<f32> = linear().draw(frame).texels.iter().map(|texel| texel[0]).collect();
            assert!(kept.contains(&1.0) && kept == shares(&scene), "{step}");
        }
    }
    assert!((2..=4).contains(&images.len()), "{}", images.len());
}

/// Without text there is nothing of it; with text there is one rectangle, in a shader that textures have as well.
#[test]
fn a_scene_without_text_pays_nothing() {
    let cube = "BaseColor(rgb: (1.0, 1.0, 1.0)), Cube()";
    let frame = |nodes: &str| RenderAction::new(SIZE[0], SIZE[1]).apply(&scene_of(nodes)).expect("a frame");
    let camera = "PerspectiveCamera(position: (0.0, 0.0, 9.0), look_at: (0.0, 0.0, 0.0)),";
    let without = frame(&format!("{camera} {cube}"));
    let font_alone = frame(&format!("{camera} Font(name: \"read by nobody.ttf\", size: 50.0), {cube}"));
    let with = frame(&format!("{camera} {cube}, Text2(string: \"text\")"));
    let mut fresh = seamount::render::Headless::new(None).expect("a device");
    let report = fresh.draw(&without).expect("a picture").report;
    let again = fresh.draw(&font_alone).expect("a picture").report;
    assert_eq!((again.pipelines_made, again.gpu_bytes), (0, report.gpu_bytes));
    let costs = fresh.costs(&without).expect("costs");
    assert_eq!(costs[0].texture_bytes, 0);
    fresh.draw(&with).expect("a picture");
    let costs = fresh.costs(&with).expect("costs");
    let text = &with.draws[1];
    assert_eq!((with.draws.len(), text.effects.geometry), (2, GeometryKind::Mesh));
    assert_eq!(costs[1].buffer_bytes, 4 * (24 + 8) + 6 * 4);
    let image = &text.coloring.color_map.as_ref().expect("an image").image;
    assert_eq!(costs[1].texture_bytes, u64::from(4 * image.width() * image.height()));
}

/// What is written is read again.
#[test]
fn text_goes_through_files() {
    let nodes = "Font(name: \"a b.otf\", size: 12.5), Text2(string: [\"one \\\"1\\\"\", \"\", \"zwei – ü\"], spacing: 1.25, justification: Center), Text2(string: \"one\")";
    let scene = scene_of(nodes);
    let text = write_scene(&scene).expect("a text");
    let again = parse(&text, &Registry::default()).unwrap_or_else(|e| panic!("{e}"));
    let strings =
        |scene: &Scene, k: usize| scene.get::<Text2>(scene.children(scene.root())[k]).expect("a text").clone();
    for k in [1, 2] {
        assert_eq!(strings(&scene, k), strings(&again, k));
    }
    assert_eq!(strings(&again, 1).string.len(), 3);
    assert_eq!(strings(&again, 1).justification, Justification::Center);
    assert_eq!(again.get::<Font>(again.children(again.root())[0]).expect("a font").size, 12.5);
}
