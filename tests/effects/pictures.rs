//! A small picture of each effect, looked at before it was committed.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use seamount::render::Picture;

use super::*;

/// What makes the references anew; look at them before they are committed.
const WRITE: &str = "SEAMOUNT_WRITE_REFERENCE";

fn folder(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// The scenes by the name of their effect: those with it, of the first pair each, and what may be behind; seen from nearby.
fn scenes() -> Vec<(&'static str, Scene)> {
    let mut seen = BTreeSet::new();
    let first = |pair: &&Pair| seen.insert(pair.effect);
    let mut scenes: Vec<_> = pairs().iter().filter(first).map(|pair| (pair.effect, scene(pair.with))).collect();
    let behind = [None, Some(Color::new(0.2, 0.4, 0.8))];
    scenes.extend(BACKGROUNDS.into_iter().zip(behind).map(|(name, zenith)| {
        let behind = Background { color: Color::new(0.9, 0.8, 0.6), zenith };
        let scene = scene(|b| {
            sun(b);
            b.add(behind);
        });
        (name, scene)
    }));
    for (name, scene) in &mut scenes {
        let up = BACKGROUNDS.contains(name);
        let camera = scene.children(scene.root())[0];
        *scene.edit::<PerspectiveCamera>(camera).unwrap() = PerspectiveCamera {
            position: Some(DVec3::new(0.5, -0.35, 0.55)),
            look_at: Some(DVec3::new(0.5, 0.55, if up { 0.75 } else { 0.0 })),
            height_angle: if up { 1.6 } else { 0.8 },
            ..Default::default()
        };
        if matches!(*name, "color-by-level" | "color-by-error") {
            let kind = Some("SeamlessTerrain".to_owned());
            let found = SearchAction { kind, ..Default::default() }.apply(scene).unwrap();
            let terrain = found[0].tail().unwrap();
            scene.edit::<SeamlessTerrain>(terrain).unwrap().detail =
                DetailMode::PixelError(if *name == "color-by-error" { 2.0 } else { 8.0 });
        }
    }
    scenes
}

/// How far codes may be off the range of the pixels around: one for rounding to codes, one for filters, which need no more than
/// 8 bits of a weight (Vulkan's `subTexelPrecisionBits` may be 4, but of a step between texels that a pixel is small against),
/// one for sums and roots that differ in the last bits.
const CODES: u8 = 3;

/// What two drivers agree on is the colour of places, but not where in a pixel they look: samples of an edge may lie anywhere in
/// the pixel. What they see is in the reference less than a pixel away, or mixed from what is. So each code has to be in the range
/// of the 3 × 3 codes around it, [`CODES`] more or less. Where the picture is smooth that range is narrow, and edges are not
/// smoothed over; a whole picture that leans to one side of its ranges is told by the mean, which edges do not shift.
fn check(name: &str, picture: &Picture) -> Result<(), String> {
    let reference = folder("tests/reference/effects").join(name).with_extension("png");
    if std::env::var_os(WRITE).is_some() {
        return picture.save_png(&reference).map_err(|error| error.to_string());
    }
    let want = match image::open(&reference) {
        Ok(image) => image.into_rgba8(),
        Err(error) => return Err(format!("{name}: {}: {error}; set {WRITE}=1 to make it", reference.display())),
    };
    let [width, height] = [picture.width, picture.height];
    if want.dimensions() != (width, height) {
        return Err(format!("{name}: {} is of another size; set {WRITE}=1 to make it anew", reference.display()));
    }
    let mut difference = picture.clone();
    let (mut beyond, mut lean) = (0, 0i64);
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let around = (y.saturating_sub(1)..(y + 2).min(height))
            .flat_map(|y| (x.saturating_sub(1)..(x + 2).min(width)).map(move |x| (x, y)));
        let mut far = 0;
        for channel in 0..3 {
            let at = (y * width + x) as usize * 4 + channel;
            let got = picture.rgba[at];
            let range = around.clone().fold([255u8, 0], |[low, high], (x, y)| {
                let code = want.get_pixel(x, y)[channel];
                [low.min(code), high.max(code)]
            });
            let off = range[0].saturating_sub(got).max(got.saturating_sub(range[1]));
            far = far.max(off);
            lean += i64::from(got) - i64::from(want.get_pixel(x, y)[channel]);
            difference.rgba[at] = got.abs_diff(want.get_pixel(x, y)[channel]).saturating_mul(4);
        }
        beyond += u32::from(far > CODES);
    }
    let lean = lean as f64 / f64::from(3 * width * height);
    if beyond == 0 && lean.abs() <= 1.0 {
        return Ok(());
    }
    let actual = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}-actual.png"));
    let marked = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}-difference.png"));
    picture.save_png(&actual).and_then(|()| difference.save_png(&marked)).map_err(|error| error.to_string())?;
    Err(format!(
        "{name} is not {}: {beyond} pixels are beyond the range of those around, and codes are {lean:+.2} off on the mean. \
         The picture is {}, four times the difference {}. If it is right, set {WRITE}=1 to make it the reference, and look at it",
        reference.display(),
        actual.display(),
        marked.display(),
    ))
}

#[test]
fn effects_look_as_they_did_when_somebody_looked() {
    let mut wrong = Vec::new();
    let mut names = BTreeSet::new();
    for (name, scene) in scenes() {
        let frame = RenderAction::new(SIZE[0], SIZE[1]).apply(&scene).unwrap();
        let picture = headless().draw(&frame).unwrap();
        wrong.extend(check(name, &picture).err());
        names.insert(format!("{name}.png"));
    }
    let files = std::fs::read_dir(folder("tests/reference/effects")).unwrap();
    let files: BTreeSet<String> = files.map(|file| file.unwrap().file_name().into_string().unwrap()).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert_eq!(files, names, "references and effects");
}

/// The comparison sees what it is for: light from a little to the side, and a picture that is darker all over.
#[test]
fn the_comparison_tells_a_wrong_picture() {
    if std::env::var_os(WRITE).is_some() {
        return;
    }
    let (_, mut scene) = scenes().into_iter().find(|(name, _)| *name == "directional-light").unwrap();
    let draw = |scene: &Scene| headless().draw(&RenderAction::new(SIZE[0], SIZE[1]).apply(scene).unwrap()).unwrap();
    let right = draw(&scene);
    assert_eq!(check("directional-light", &right), Ok(()));
    let kind = Some("DirectionalLight".to_owned());
    let light = SearchAction { kind, ..Default::default() }.apply(&scene).unwrap()[0].tail().unwrap();
    scene.edit::<DirectionalLight>(light).unwrap().direction.x -= 0.1;
    let turned = draw(&scene);
    let error = check("directional-light", &turned).unwrap_err();
    assert!(error.contains(WRITE) && error.contains("directional-light-actual.png"), "{error}");
    let mut darker = right.clone();
    darker.rgba.iter_mut().for_each(|code| *code = code.saturating_sub(3));
    assert!(check("directional-light", &darker).is_err());
}
