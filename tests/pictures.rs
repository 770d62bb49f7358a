//! Pictures: what is drawn is what the scene says. These tests need a graphics adapter (a software one does) and fail
//! without one.
#![cfg(feature = "render")]

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use seamount::action::{DebugColor, Effects, GeometryKind};
use seamount::prelude::*;
use seamount::render::{Headless, Picture, Renderer, RendererOptions, shader_text};
use seamount::scene::{Image, Pixels};
use seamount::terrain::Samples;

/// One device for all tests: making one takes longer than most pictures.
fn headless() -> MutexGuard<'static, Headless> {
    static HEADLESS: OnceLock<Mutex<Headless>> = OnceLock::new();
    let made = HEADLESS.get_or_init(|| Mutex::new(Headless::new(None).unwrap_or_else(|error| panic!("{error}"))));
    made.lock().unwrap_or_else(PoisonError::into_inner)
}

fn draw(scene: &Scene, action: &RenderAction) -> Picture {
    let frame = action.apply(scene).unwrap();
    headless().draw(&frame).unwrap()
}

fn folder(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// Decoded once for all tests.
fn fuji_image() -> Arc<Image> {
    static IMAGE: OnceLock<Arc<Image>> = OnceLock::new();
    Arc::clone(IMAGE.get_or_init(|| Arc::new(Image::open(&folder("scenes/fuji.png")).unwrap())))
}

const FUJI: DVec2 = DVec2::new(90_600.0, 111_240.0);
const SUMMIT: DVec3 = DVec3::new(65_900.0, 40_100.0, 3_776.0);

/// A terrain in metres, as the maps of `scenes/` code them.
fn metres(size: DVec2) -> SeamlessTerrain {
    SeamlessTerrain {
        size: Some(size),
        max_height: 65535.0,
        base_height: -1000.0,
        void_sample: Some(0.0),
        ..SeamlessTerrain::default()
    }
}

fn camera(position: DVec3, look_at: DVec3, height_angle: f64) -> PerspectiveCamera {
    PerspectiveCamera { position: Some(position), look_at: Some(look_at), height_angle, ..PerspectiveCamera::default() }
}

/// Colours by height, as atlases have them: sea, lowland, forest, rock, snow.
fn atlas(heights: &Image) -> Image {
    let field = heights.height_field(Some(0.0)).unwrap();
    let Samples::U16(samples) = field.samples() else { panic!("heights have 16 bits") };
    let stops: [(f32, [f32; 3]); 7] = [
        (0.0, [92.0, 138.0, 176.0]),
        (2.0, [120.0, 150.0, 88.0]),
        (600.0, [96.0, 130.0, 72.0]),
        (1500.0, [112.0, 122.0, 74.0]),
        (2400.0, [132.0, 110.0, 86.0]),
        (2900.0, [150.0, 130.0, 116.0]),
        (3300.0, [244.0, 246.0, 250.0]),
    ];
    let color = |&sample: &u16| {
        let height = f32::from(sample) - 1000.0;
        let above = stops.iter().position(|s| s.0 > height).unwrap_or(stops.len());
        let (low, high) = (stops[above.saturating_sub(1)], stops[above.min(stops.len() - 1)]);
        let t = if high.0 > low.0 { ((height - low.0) / (high.0 - low.0)).clamp(0.0, 1.0) } else { 0.0 };
        let mix = |k: usize| (low.1[k] + t * (high.1[k] - low.1[k])).round() as u8;
        [mix(0), mix(1), mix(2), 255]
    };
    Image::new(heights.width(), heights.height(), Pixels::Rgba8(samples.iter().map(color).collect())).unwrap()
}

/// Mount Fuji in the light of an evening in summer, from the west-north-west.
fn fuji(camera: PerspectiveCamera, colors: bool, change: impl FnOnce(&mut SeamlessTerrain)) -> Scene {
    let mut scene = Scene::new();
    let root = scene.root();
    scene.add(root, camera).unwrap();
    scene.add(root, DirectionalLight { direction: DVec3::new(1.0, -0.3, -0.6), ..Default::default() }).unwrap();
    let rock = if colors { Color::WHITE } else { Color::new(0.86, 0.82, 0.76) };
    scene.add(root, Material { ambient_color: rock.into(), diffuse_color: rock.into(), ..Default::default() }).unwrap();
    scene.add(root, Texture2::from_image(fuji_image())).unwrap();
    if colors {
        scene.add(root, Complexity { texture_quality: 1.0, ..Complexity::default() }).unwrap();
        scene.add(root, TextureUnit { unit: 1 }).unwrap();
        scene.add(root, Texture2::from_image(atlas(&fuji_image()))).unwrap();
    }
    let mut terrain = SeamlessTerrain { detail: DetailMode::Precision(3.0), ..metres(FUJI) };
    change(&mut terrain);
    scene.add(root, terrain).unwrap();
    scene
}

fn from_the_south() -> PerspectiveCamera {
    camera(DVec3::new(58_000.0, 8_000.0, 4_200.0), SUMMIT - DVec3::Z * 1500.0, 0.21)
}

fn from_above() -> PerspectiveCamera {
    camera(SUMMIT + DVec3::new(0.0, -0.1, 45_000.0), SUMMIT, 0.6)
}

fn grazing() -> PerspectiveCamera {
    camera(DVec3::new(48_000.0, 57_000.0, 2_000.0), SUMMIT - DVec3::Z * 1200.0, 0.3)
}

fn small(background: Color) -> RenderAction {
    RenderAction { background, ..RenderAction::new(512, 288) }
}

const SKY: Color = Color::new(0.72, 0.82, 0.93);

/// Compares with `tests/reference/NAME.png`, or writes it when the environment has `SEAMOUNT_WRITE_REFERENCE`.
///
/// Another driver may place samples of an edge elsewhere, filter textures with fewer bits and round colours differently:
/// that moves single pixels along edges by much and smooth places by a code or two. So the mean difference may be up to 1.5
/// of 255 codes, and one pixel in a hundred may differ by more than 40 codes. A patch that is missing, another light, a
/// turned map or another filter are beyond both.
fn matches_reference(name: &str, picture: &Picture) {
    let reference = folder("tests/reference").join(name).with_extension("png");
    if std::env::var_os("SEAMOUNT_WRITE_REFERENCE").is_some() {
        picture.save_png(&reference).unwrap();
        return;
    }
    let want = image::open(&reference).unwrap().into_rgba8();
    assert_eq!((want.width(), want.height()), (picture.width, picture.height));
    let want = want.into_raw();
    let total: u64 = picture.rgba.iter().zip(&want).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    let mean = total as f64 / (f64::from(picture.width * picture.height) * 3.0);
    let differs = |(a, b): (&[u8], &[u8])| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > 40);
    let far = picture.rgba.chunks_exact(4).zip(want.chunks_exact(4)).filter(|&pair| differs(pair)).count();
    if mean > 1.5 || far * 100 > want.len() / 4 {
        let actual = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}-actual.png"));
        picture.save_png(&actual).unwrap();
        panic!(
            "{name} differs from {}: by {mean:.2} codes on the mean, by more than 40 in {far} pixels; the picture is {}. \
             If it is right, set SEAMOUNT_WRITE_REFERENCE=1 to make it the reference",
            reference.display(),
            actual.display()
        );
    }
}

#[test]
fn fuji_from_the_south_in_colours_of_height() {
    let scene = fuji(from_the_south(), true, |_| ());
    matches_reference("fuji_south", &draw(&scene, &small(SKY)));
}

#[test]
fn fuji_from_above() {
    matches_reference("fuji_above", &draw(&fuji(from_above(), false, |_| ()), &small(SKY)));
}

#[test]
fn fuji_at_a_grazing_angle() {
    matches_reference("fuji_grazing", &draw(&fuji(grazing(), false, |_| ()), &small(SKY)));
}

#[test]
fn fuji_with_tiles_green_and_strips_red() {
    let scene = fuji(from_the_south(), false, |t| {
        (t.color_mode, t.resolutions, t.detail) = (ColorMode::Parts, (16, 3), DetailMode::Precision(1.0));
    });
    matches_reference("fuji_parts", &draw(&scene, &small(SKY)));
}

#[test]
fn fuji_coloured_by_level() {
    let scene = fuji(from_the_south(), false, |t| {
        (t.color_mode, t.resolutions, t.detail) = (ColorMode::Levels, (4, 2), DetailMode::Precision(6.0));
    });
    matches_reference("fuji_levels", &draw(&scene, &small(SKY)));
}

/// From an eye above it, ground without a gap hides what is behind it.
///
/// A ray from an eye over the map to a point under the map, inside its extent, starts above the ground and ends below it: it
/// has to meet the ground on the way, whatever the heights and the detail. So each pixel whose four corners see such points
/// is ground, and all of it: one sample that fell through a gap would colour the pixel.
#[test]
fn no_background_shows_through_the_ground() {
    let maps = [
        ("fuji", metres(FUJI)),
        ("andes", metres(DVec2::new(93_840.0, 111_240.0))),
        // Steps of the full range between neighbouring samples: whatever does not fit exactly, gapes.
        ("walls", SeamlessTerrain { size: Some(DVec2::new(701.0, 512.0)), max_height: 120.0, ..Default::default() }),
    ];
    let detail = [((2, 2), 1.0), ((8, 3), 2.0), ((16, 3), 0.4)];
    for (name, terrain) in maps {
        let map = Arc::new(Image::open(&folder("scenes").join(name).with_extension("png")).unwrap());
        let field = map.height_field(terrain.void_sample).unwrap();
        let Samples::U16(samples) = field.samples() else { panic!("heights have 16 bits") };
        let frame = terrain.frame(&field);
        let z = |raw: &u16| frame.local(DVec3::new(0.0, 0.0, f64::from(*raw))).z;
        let (low, high) = (z(samples.iter().min().unwrap()), z(samples.iter().max().unwrap()));
        let size = terrain.size.unwrap();
        let mut seen = 0;
        // Over the middle and towards the corners, high and low; straight down and obliquely.
        for (x, y) in [(0.5, 0.5), (0.2, 0.75), (0.83, 0.11)] {
            for (height, aside) in [(0.9, 0.0), (0.2, 0.0), (0.02, 0.0), (0.02, 0.3)] {
                for (resolutions, precision) in detail {
                    let below = DVec3::new(size.x * x, size.y * y, low);
                    let eye = below + DVec3::Z * (high - low + size.max_element() * height);
                    let look_at = below + (DVec3::new(size.x, size.y, 0.0) * 0.5 - below.with_z(0.0)) * aside;
                    let mut scene = Scene::new();
                    let root = scene.root();
                    scene.add(root, camera(eye, look_at, 0.9)).unwrap();
                    scene.add(root, BaseColor { rgb: Color::WHITE.into() }).unwrap();
                    scene.add(root, Texture2::from_image(Arc::clone(&map))).unwrap();
                    scene
                        .add(
                            root,
                            SeamlessTerrain {
                                resolutions,
                                detail: DetailMode::Precision(precision),
                                ..terrain.clone()
                            },
                        )
                        .unwrap();
                    let action = RenderAction { background: Color::new(1.0, 0.0, 1.0), ..RenderAction::new(300, 300) };
                    let view = action.viewpoint(&scene).unwrap();
                    let picture = draw(&scene, &action);
                    let over_ground = |px: u32, py: u32| {
                        let (origin, direction) = view.ray(f64::from(px) / 300.0, f64::from(py) / 300.0);
                        let end = origin + direction * ((low - origin.z) / direction.z);
                        direction.z < 0.0 && (0.0..=size.x).contains(&end.x) && (0.0..=size.y).contains(&end.y)
                    };
                    for (px, py) in (0..300).flat_map(|py| (0..300).map(move |px| (px, py))) {
                        if [(0, 0), (1, 0), (0, 1), (1, 1)].into_iter().all(|(dx, dy)| over_ground(px + dx, py + dy)) {
                            seen += 1;
                            let pixel = picture.pixel(px, py).unwrap();
                            assert!(
                                pixel == [255; 3],
                                "{name} from {eye} with {resolutions:?} at {precision}: {pixel:?} at ({px}, {py})"
                            );
                        }
                    }
                }
            }
        }
        assert!(seen > 1_000_000, "{name}: only {seen} pixels of ground were looked at");
    }
}

/// The mean brightness (0..255) of the pixels that are not background, and how many there are.
fn ground(picture: &Picture, background: [u8; 3]) -> (f64, usize) {
    let pixels = picture.rgba.chunks_exact(4).filter(|p| p[..3] != background);
    let (sum, count) =
        pixels.fold((0u64, 0), |(sum, n), p| (sum + p[..3].iter().map(|&c| u64::from(c)).sum::<u64>(), n + 1));
    (sum as f64 / (3.0 * count.max(1) as f64), count)
}

#[test]
fn a_cube_shows_its_faces_and_is_brightest_where_the_light_comes_from() {
    let mut scene = Scene::new();
    let root = scene.root();
    scene.add(root, camera(DVec3::new(4.0, -6.0, 5.0), DVec3::ZERO, 0.6)).unwrap();
    let light = scene.add(root, DirectionalLight::default()).unwrap();
    scene.add(root, Material { diffuse_color: Color::WHITE.into(), ..Default::default() }).unwrap();
    scene.add(root, Cube::default()).unwrap();
    let action = RenderAction::new(200, 200);
    let view = action.viewpoint(&scene).unwrap();
    // The pixel that shows the middle of a face.
    let show = |p: DVec3| {
        let clip = view.clip_from_eye() * (p - view.eye).extend(1.0);
        [clip.x / clip.w, -clip.y / clip.w].map(|c| ((c + 1.0) * 100.0) as u32)
    };
    let faces = [DVec3::X, DVec3::NEG_Y, DVec3::Z].map(|normal| (normal, show(normal)));
    for (from, _) in faces {
        scene.edit::<DirectionalLight>(light).unwrap().direction = -from * 3.0;
        let picture = draw(&scene, &action);
        for (normal, [x, y]) in faces {
            let [r, g, b] = picture.pixel(x, y).unwrap();
            if normal == from {
                assert_eq!([r, g, b], [255; 3], "lit from {from}");
            } else {
                // Ambient light alone: 0.2 of a material that reflects 0.0331 of it.
                assert!((1..=30).contains(&r) && r == g && g == b, "lit from {from}, {normal} is {r}");
            }
        }
        assert_eq!(picture.pixel(2, 2), Some([0; 3]));
    }
    // At 60° half of the light, in linear light: code 188.
    scene.edit::<DirectionalLight>(light).unwrap().direction = DVec3::new(-(3f64.sqrt()), 0.0, -1.0);
    let [x, y] = faces[2].1;
    let half = draw(&scene, &action).pixel(x, y).unwrap()[0];
    assert!((186..=191).contains(&half), "{half}");
}

/// A light from a point lights what is under it most; a highlight is where the mirror image of the lamp is, for both
/// kinds of camera.
#[test]
fn lamps_and_highlights_are_where_they_belong() {
    let scene = |perspective: bool, specular: bool| {
        let mut scene = Scene::new();
        let root = scene.root();
        let (position, look_at) = (Some(DVec3::Z * 10.0), Some(DVec3::ZERO));
        if perspective {
            scene.add(root, PerspectiveCamera { position, look_at, ..Default::default() }).unwrap();
        } else {
            scene.add(root, OrthographicCamera { position, look_at, height: 8.0, ..Default::default() }).unwrap();
        }
        scene.add(root, PointLight { location: DVec3::new(2.0, 0.0, 3.0), ..Default::default() }).unwrap();
        let specular_color = List::from(if specular { Color::WHITE } else { Color::BLACK });
        let diffuse_color = List::from(if specular { Color::BLACK } else { Color::WHITE });
        scene
            .add(root, Material { diffuse_color, specular_color, shininess: List::from(0.5), ..Default::default() })
            .unwrap();
        scene.add(root, Cube { width: 8.0, height: 8.0, depth: 0.0 }).unwrap();
        scene
    };
    let brightest = |scene: &Scene| {
        let picture = draw(scene, &RenderAction::new(200, 200));
        let value = |x: u32| picture.pixel(x, 100).unwrap()[1];
        let most = (0..200).map(value).max().unwrap();
        let places: Vec<u32> = (0..200).filter(|&x| value(x) == most).collect();
        f64::from(places.iter().sum::<u32>()) / places.len() as f64 + 0.5
    };
    // Pixels per unit: 200 / 8 in the orthographic picture, 100 / (10 tan 22.5°) in the other.
    let per_unit = [25.0, 100.0 / (10.0 * (std::f64::consts::FRAC_PI_8).tan())];
    for (perspective, per_unit) in [(false, per_unit[0]), (true, per_unit[1])] {
        let lamp = brightest(&scene(perspective, false));
        assert!((lamp - (100.0 + 2.0 * per_unit)).abs() < 2.0, "perspective {perspective}: lamp at {lamp}");
        // Mirrored in z = 0 the lamp is at (2, 0, -3): seen from (0, 0, 10) at 2 · 10/13, seen from straight above at 2.
        let mirror = if perspective { 2.0 * 10.0 / 13.0 } else { 2.0 };
        let highlight = brightest(&scene(perspective, true));
        assert!((highlight - (100.0 + mirror * per_unit)).abs() < 2.0, "perspective {perspective}: {highlight}");
    }
}

/// The ground is seen from above and not from below, and lit by what shines on it, also where the transform mirrors it and
/// where heights run downwards or are all the same.
#[test]
fn the_ground_is_seen_from_above_however_it_is_mirrored() {
    let hill: Vec<u16> = (0..33 * 33).map(|i| if (i % 33 + i / 33) % 7 < 3 { 9000 } else { 20000 }).collect();
    let hill = Arc::new(Image::new(33, 33, Pixels::Gray16(hill)).unwrap());
    let one = DVec3::ONE;
    for scale in
        [one, one.with_x(-1.0), one.with_y(-1.0), one.with_z(-1.0), -one, one * -0.5, DVec3::new(-1.0, 2.0, 3.0)]
    {
        for max_height in [0.3, 0.0, -0.3] {
            for from_above in [true, false] {
                let mut scene = Scene::new();
                let root = scene.root();
                // Above is where local z points to.
                let side = if from_above { scale.z.signum() } else { -scale.z.signum() };
                let eye = DVec3::new(0.5 * scale.x, 0.5 * scale.y, 4.0 * side);
                // Rays are vertical: slanted ones would see the upper side of steep slopes through culled ground.
                let (position, look_at) = (Some(eye), Some(eye.with_z(0.0)));
                scene.add(root, OrthographicCamera { position, look_at, height: 1.5, ..Default::default() }).unwrap();
                scene.add(root, DirectionalLight { direction: DVec3::NEG_Z * side, ..Default::default() }).unwrap();
                scene.add(root, Transform { scale_factor: scale, ..Default::default() }).unwrap();
                scene.add(root, Material { diffuse_color: Color::WHITE.into(), ..Default::default() }).unwrap();
                scene.add(root, Texture2::from_image(Arc::clone(&hill))).unwrap();
                scene.add(root, SeamlessTerrain { max_height, ..Default::default() }).unwrap();
                let (brightness, count) = ground(&draw(&scene, &RenderAction::new(64, 64)), [0; 3]);
                let case = format!("scale {scale}, max_height {max_height}, from above {from_above}");
                if from_above {
                    assert!(count > 200 && brightness > 100.0, "{case}: {count} pixels of brightness {brightness}");
                } else {
                    assert_eq!(count, 0, "{case}");
                }
            }
        }
    }
}

/// Everything is subtracted in f64 before it is rounded: ten thousand kilometres away the picture is the same. The offset
/// is a whole number, as are the coordinates, so that f64 holds their sum exactly.
#[test]
fn far_from_the_origin_the_picture_is_the_same() {
    let draw_at = |offset: DVec3| {
        let mut scene = Scene::new();
        let root = scene.root();
        scene.add(root, Transform { translation: offset, ..Default::default() }).unwrap();
        scene.add(root, camera(DVec3::new(58_000.0, 8_000.0, 4_200.0), SUMMIT, 0.3)).unwrap();
        scene.add(root, DirectionalLight { direction: DVec3::new(1.0, 0.0, -1.0), ..Default::default() }).unwrap();
        scene.add(root, PointLight { location: SUMMIT + DVec3::Z * 9000.0, ..Default::default() }).unwrap();
        scene.add(root, Material { specular_color: Color::WHITE.into(), ..Default::default() }).unwrap();
        scene.add(root, Texture2::from_image(fuji_image())).unwrap();
        scene.add(root, metres(FUJI)).unwrap();
        scene
            .add(root, Transform { translation: DVec3::new(60_000.0, 14_000.0, 3_500.0), ..Default::default() })
            .unwrap();
        scene.add(root, Cube { width: 900.0, height: 900.0, depth: 900.0 }).unwrap();
        draw(&scene, &small(SKY))
    };
    let (near, far) = (draw_at(DVec3::ZERO), draw_at(DVec3::new(1e7, -1e7, 1e7)));
    assert!(ground(&near, [184, 209, 237]).1 > 50_000);
    // The map's cells are not whole numbers: 75.5 and 92.7 m are rounded at 1e7 to 2e-9, so a sample may fall on the other
    // side of an edge, by chance; none was seen to.
    let differing = near.rgba.chunks_exact(4).zip(far.rgba.chunks_exact(4)).filter(|(a, b)| a != b).count();

    assert!(differing <= 3, "{differing} pixels differ");
}

/// The colour map lies on the ground as a picture on the wall lies on it: first row north, first column west, edge to edge.
#[test]
fn the_colour_map_lies_north_up_and_edge_to_edge() {
    let colors = [[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [255, 255, 255, 255]];
    let mut scene = Scene::new();
    let root = scene.root();
    scene.add(root, OrthographicCamera { look_at: None, ..Default::default() }).unwrap();
    scene.add(root, BaseColor { rgb: Color::WHITE.into() }).unwrap();
    scene.add(root, Texture2::from_image(Image::new(5, 5, Pixels::Gray16(vec![7; 25])).unwrap())).unwrap();
    scene.add(root, TextureUnit { unit: 1 }).unwrap();
    scene.add(root, Texture2::from_image(Image::new(2, 2, Pixels::Rgba8(colors.to_vec())).unwrap())).unwrap();
    scene.add(root, SeamlessTerrain::default()).unwrap();
    let picture = draw(&scene, &RenderAction::new(100, 100));
    for (k, [r, g, b, _]) in colors.into_iter().enumerate() {
        let (column, row) = (k as u32 % 2, k as u32 / 2);
        for (x, y) in [(3, 3), (25, 25), (48, 48)] {
            let at = (column * 50 + x.min(46), row * 50 + y.min(46));
            assert_eq!(picture.pixel(at.0 + 1, at.1 + 1), Some([r, g, b]), "texel ({column}, {row}) at {at:?}");
        }
    }
}

/// Depth is near over distance, in floats: it can be turned back into a place on the ground.
#[test]
fn depth_gives_distances() {
    let mut scene = Scene::new();
    let root = scene.root();
    scene.add(root, camera(DVec3::new(0.0, 0.0, 10.0), DVec3::ZERO, 0.5)).unwrap();
    scene.add(root, Cube::default()).unwrap();
    let action = RenderAction::new(64, 48);
    let view = action.viewpoint(&scene).unwrap();
    let depth = headless().draw_depth(&action.apply(&scene).unwrap()).unwrap();
    assert_eq!(depth.len(), 64 * 48);
    let distance = view.near / f64::from(depth[24 * 64 + 32]);
    assert!((distance - 9.0).abs() < 1e-5, "{distance}");
    assert_eq!(depth[0], 0.0);
}

fn effects(geometry: GeometryKind) -> Effects {
    Effects { geometry, ..Effects::default() }
}

/// What is not asked for is not in the shader; what is asked for is.
#[test]
fn shaders_hold_what_was_asked_for_and_nothing_else() {
    type Change = fn(&mut Effects);
    // The change that asks for an effect, and the words that tell it.
    let all: [(Change, &[&str]); 7] = [
        (|e| e.directional_lights = 2, &["directional", "DIRECTIONAL"]),
        (|e| e.point_lights = 3, &["point[", "POINT", "eye_from_rel"]),
        (|e| e.specular = true, &["specular", "towards_eye", "half_way"]),
        (|e| e.color_map = true, &["color_map", "texel"]),
        (|e| e.ambient = true, &["ambient"]),
        (|e| e.emissive = true, &["emissive"]),
        (|e| e.morph = true, &["morph", "sides", "inside", "coarse"]),
    ];
    let format = wgpu::TextureFormat::Rgba8UnormSrgb;
    for geometry in [GeometryKind::TerrainU16, GeometryKind::TerrainF32, GeometryKind::Mesh] {
        for chosen in 0..1 << all.len() {
            let is_chosen = |k: usize| chosen >> k & 1 == 1;
            let mut wanted = effects(geometry);
            all.iter().enumerate().filter(|(k, _)| is_chosen(*k)).for_each(|(_, (change, _))| change(&mut wanted));
            if wanted.morph && geometry == GeometryKind::Mesh {
                assert!(shader_text(&wanted, format).is_err());
                continue;
            }
            let text = shader_text(&wanted, format).unwrap();
            let lit = wanted.lit();
            for (k, (_, words)) in all.iter().enumerate() {
                for word in *words {
                    // Highlights, ambient light and glow need a light to be seen with; highlights need positions too.
                    let needs_light = matches!(*word, "specular" | "towards_eye" | "half_way" | "ambient" | "emissive");
                    let there =
                        is_chosen(k) && (lit || !needs_light) || *word == "eye_from_rel" && lit && wanted.specular;
                    assert_eq!(text.contains(word), there, "{word} in {wanted:?}:\n{text}");
                }
            }
            let terrain = geometry != GeometryKind::Mesh;
            assert_eq!(text.contains("gradient"), terrain && lit, "{text}");
            assert_eq!(text.contains("normal"), lit, "{text}");
            assert_eq!(text.contains("texture_2d<u32>"), geometry == GeometryKind::TerrainU16, "{text}");
            assert_eq!(text.contains("sampler"), terrain && lit || wanted.color_map, "{text}");
            assert!(!text.contains("palette") && !text.contains("level") && !text.contains("srgb"), "{text}");
        }
    }
    let levels = Effects { debug_color: DebugColor::Levels, color_map: true, ..effects(GeometryKind::TerrainU16) };
    let text = shader_text(&levels, wgpu::TextureFormat::Rgba8Unorm).unwrap();
    assert!(text.contains("palette") && text.contains("srgb") && !text.contains("color_map"), "{text}");
    assert!(!text.contains("diffuse: vec4"), "{text}");
}

/// A second frame sends no map and compiles nothing; what an effect needs is there only if the effect is.
#[test]
fn a_scene_pays_for_what_it_asks_for() {
    let samples = 1201 * 1201;
    let frame = |scene: &Scene| small(SKY).apply(scene).unwrap();
    let mut headless = Headless::new(None).unwrap();
    let mut scene = fuji(from_the_south(), false, |t| t.color_mode = ColorMode::Parts);

    // Heights of two bytes; the rest are uniforms, instances and the indices of tiles and strips.
    let report = headless.draw(&frame(&scene)).unwrap().report;
    assert!((2 * samples..3 * samples).contains(&report.bytes_uploaded), "{report:?}");
    assert_eq!(report.pipelines_made, 1);
    // Gradients of four bytes and a third of that for smaller copies, but no second copy of the heights.
    let terrain = *scene.children(scene.root()).last().unwrap();
    scene.edit::<SeamlessTerrain>(terrain).unwrap().color_mode = ColorMode::Plain;
    let report = headless.draw(&frame(&scene)).unwrap().report;
    assert!((5 * samples..6 * samples).contains(&report.bytes_uploaded), "{report:?}");
    assert_eq!(report.pipelines_made, 1);
    let held = report.gpu_bytes;
    let again = frame(&scene);
    let report = headless.draw(&again).unwrap().report;
    assert!(report.bytes_uploaded < 100_000, "{report:?}");
    assert_eq!((report.pipelines_made, report.gpu_bytes, report.draw_calls), (0, held, again.statistics.draw_calls));
}

/// Where the ground is out of view it costs nothing, and the picture is background.
#[test]
fn an_empty_view_is_background() {
    let scene = fuji(camera(DVec3::Z * 1e5, DVec3::Z * 2e5, 0.5), true, |_| ());
    let mut headless = Headless::new(None).unwrap();
    let picture = headless.draw(&small(SKY).apply(&scene).unwrap()).unwrap();
    assert_eq!(ground(&picture, [184, 209, 237]).1, 0);
    assert_eq!((picture.report.pipelines_made, picture.report.draw_calls, picture.report.bytes_uploaded), (0, 0, 0));
}

#[test]
fn what_does_not_fit_the_device_is_an_error_that_names_the_limit() {
    let mut headless = Headless::new(None).unwrap();
    let long = 70_000;
    let mut scene = Scene::new();
    let root = scene.root();
    scene.add(root, PerspectiveCamera::default()).unwrap();
    scene.add(root, Cube::default()).unwrap();
    let cube = RenderAction::new(32, 32).apply(&scene).unwrap();
    let error = headless.draw(&RenderAction::new(long, 1).apply(&scene).unwrap()).unwrap_err().to_string();
    assert!(error.contains("70000 × 1") && error.contains("can not be drawn"), "{error}");

    let strip = Image::new(long, 2, Pixels::Gray16(vec![5; long as usize * 2])).unwrap();
    scene.add(root, Texture2::from_image(strip)).unwrap();
    scene.add(root, SeamlessTerrain::default()).unwrap();
    let error = headless.draw(&RenderAction::new(32, 32).apply(&scene).unwrap()).unwrap_err().to_string();
    assert!(error.contains("a height map of 70000 × 2") && error.contains("max_texture_dimension_2d"), "{error}");
    // And on it goes.
    assert!(ground(&headless.draw(&cube).unwrap(), [0; 3]).1 > 100);
}

#[test]
fn an_adapter_that_is_not_there_is_an_error_that_lists_those_that_are() {
    let present = headless().adapter().name.clone();
    let error = Headless::new(Some("no such adapter")).unwrap_err().to_string();
    assert!(error.contains("no such adapter") && error.contains(&present), "{error}");
    assert!(error.contains("mesa-vulkan-drivers"), "{error}");
    // Part of a name, in any case, will do.
    let part = present.to_uppercase();
    assert_eq!(Headless::new(part.split(' ').next()).unwrap().adapter().name, present);
}

/// A device, queue and target of the caller's, without sRGB encoding and with one sample: the same colours.
#[test]
fn a_target_that_does_not_encode_srgb_gets_encoded_colours() {
    let instance = wgpu::Instance::default();
    let wanted = headless().adapter().name.clone();
    let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
    let adapter = adapters.into_iter().find(|a| a.get_info().name == wanted).unwrap();
    let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor::default())).unwrap();
    let scene = fuji(from_the_south(), true, |_| ());
    let frame = small(SKY).apply(&scene).unwrap();
    let draw = |format| {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width: 512, height: 288, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let options = RendererOptions { samples: 1, ..RendererOptions::default() };
        let mut renderer = Renderer::new(&device, &queue, format, options);
        renderer.draw(&device, &queue, &frame, &texture.create_view(&Default::default())).unwrap();
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: 512 * 288 * 4,
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = device.create_command_encoder(&Default::default());
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(2048), rows_per_image: None };
        let copy = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
        encoder.copy_texture_to_buffer(texture.as_image_copy(), copy, texture.size());
        queue.submit([encoder.finish()]);
        buffer.slice(..).map_async(wgpu::MapMode::Read, |result| result.unwrap());
        device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        buffer.slice(..).get_mapped_range().unwrap().to_vec()
    };
    let (by_device, by_shader) = (draw(wgpu::TextureFormat::Rgba8UnormSrgb), draw(wgpu::TextureFormat::Rgba8Unorm));
    let worst = by_device.iter().zip(&by_shader).map(|(a, b)| a.abs_diff(*b)).max();
    assert!(worst <= Some(1), "{worst:?}");

    // A view of another size is refused, and the renderer says so instead of panicking.
    let small_view = device
        .create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width: 100, height: 100, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba8Unorm,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        })
        .create_view(&Default::default());
    let mut renderer = Renderer::new(&device, &queue, wgpu::TextureFormat::Rgba8Unorm, RendererOptions::default());
    let error = renderer.draw(&device, &queue, &frame, &small_view).unwrap_err().to_string();
    assert!(error.contains("refused drawing"), "{error}");
}
