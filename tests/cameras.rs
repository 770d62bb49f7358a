//! Windows beside the middle of the view (FrustumCamera), and pictures in places of other proportions (`viewport_mapping`).

mod common;

use common::Rng;
use glam::DVec4;
use seamount::action::{Cameras, Viewpoint};
use seamount::format::parse;
use seamount::node::Registry;
use seamount::prelude::*;

fn scene(nodes: &str) -> Scene {
    let text = format!("Scene(version: 1, root: Separator(children: [{nodes}]))");
    parse(&text, &Registry::default()).unwrap_or_else(|e| panic!("{e}"))
}

/// Where a place of the world is in the picture, (0, 0) top left to (1, 1) bottom right.
fn in_picture(view: &Viewpoint, place: DVec3) -> DVec2 {
    let clip: DVec4 = view.clip_from_eye() * (place - view.eye).extend(1.0);
    let ndc = clip.truncate() / clip.w;
    DVec2::new(0.5 + 0.5 * ndc.x, 0.5 - 0.5 * ndc.y)
}

/// A window around the middle is what the other camera with perspective has.
#[test]
fn a_window_around_the_middle_is_a_field_of_view() {
    let place = "position: (3.0, -9.0, 4.0), look_at: (0.0, 0.0, 1.0)";
    for size in [[300, 200], [200, 300], [64, 64]] {
        let view = |camera: &str| RenderAction::new(size[0], size[1]).viewpoint(&scene(camera)).unwrap();
        let tangent = (0.5f64 * 0.8).tan();
        let field = view(&format!("PerspectiveCamera({place}, height_angle: 0.8), Cube()"));
        let window = view(&format!(
            "FrustumCamera({place}, left: -{tangent}, right: {tangent}, bottom: -{tangent}, top: {tangent}), Cube()"
        ));
        assert_eq!(field, window, "{size:?}");
    }
}

/// What the node says is seen is seen, and as much more on two sides as the picture's proportions need.
#[test]
fn a_window_is_widened_about_its_middle() {
    let mut rng = Rng(1);
    for _ in 0..500 {
        let (left, bottom) = (rng.range(-2.0, 2.0), rng.range(-2.0, 2.0));
        let (right, top) = (left + rng.range(0.1, 3.0), bottom + rng.range(0.1, 3.0));
        let size = [1 + rng.below(900), 1 + rng.below(900)];
        let camera =
            FrustumCamera { position: Some(DVec3::ZERO), left, right, bottom, top, ..FrustumCamera::default() };
        let mut made = Scene::new();
        made.add(made.root(), camera).unwrap();
        let view = Cameras::new(&made, size).viewpoint(None).unwrap();
        // At a distance of 1 before the eye, which looks along -z.
        let [low, high] = [DVec3::new(left, bottom, -1.0), DVec3::new(right, top, -1.0)].map(|p| in_picture(&view, p));
        let (from, to) = (DVec2::new(low.x, high.y), DVec2::new(high.x, low.y));
        assert!((from + to - 1.0).abs().max_element() < 1e-9, "not in the middle: {from} {to}");
        let share = to - from;
        assert!((share.max_element() - 1.0).abs() < 1e-9 && share.min_element() <= 1.0 + 1e-9, "{share}");
        let pixels = share * DVec2::new(f64::from(size[0]), f64::from(size[1]));
        let proportions = (right - left) / (top - bottom);
        assert!((pixels.x / pixels.y / proportions - 1.0).abs() < 1e-9, "not square: {pixels}");
    }
}

/// Without a place of its own a camera sees the whole box, and its picture is no larger than that needs.
#[test]
fn a_camera_that_looks_aside_finds_its_place() {
    let mut rng = Rng(2);
    for k in 0..500 {
        // An orthographic camera looks at the middle of its picture.
        let aside = if k % 3 == 0 { DVec2::ZERO } else { rng.aside() };
        let viewport_mapping = [
            ViewportMapping::AdjustCamera,
            ViewportMapping::LeaveAlone,
            ViewportMapping::CropViewportNoFrame,
            ViewportMapping::CropViewportFillFrame,
        ][rng.below(4) as usize];
        let aspect_ratio = rng.range(0.2, 5.0);
        let orientation = AxisAngle {
            axis: DVec3::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0), rng.range(-1.0, 1.0)),
            angle: rng.range(-3.0, 3.0),
        };
        let mut made = Scene::new();
        let root = made.root();
        let half = DVec2::new(rng.range(0.1, 1.0), rng.range(0.1, 1.0));
        let [low, high] = [half * (aside - 1.0), half * (aside + 1.0)];
        if k % 3 == 0 {
            let camera = OrthographicCamera { orientation, viewport_mapping, aspect_ratio, ..Default::default() };
            made.add(root, camera).unwrap();
        } else {
            let (left, bottom, right, top) = (low.x, low.y, high.x, high.y);
            let window = FrustumCamera { left, bottom, right, top, ..FrustumCamera::default() };
            made.add(root, FrustumCamera { orientation, viewport_mapping, ..window }).unwrap();
        }
        let scale = DVec3::new(rng.range(0.1, 9.0), rng.range(0.1, 9.0), rng.range(0.1, 9.0));
        let moved = Translation { translation: DVec3::new(rng.range(-50.0, 50.0), 7.0, 0.0) };
        made.add(root, moved).unwrap();
        made.add(root, Scale { scale_factor: scale }).unwrap();
        made.add(root, Cube::default()).unwrap();
        let bounds = BoundingBoxAction::default().apply(&made).unwrap().unwrap();
        let view = RenderAction::new(300, 200).viewpoint(&made).unwrap();
        // How much of the picture is the camera's own.
        let aspect = if k % 3 == 0 { aspect_ratio } else { half.x / half.y };
        let own = match viewport_mapping {
            ViewportMapping::AdjustCamera | ViewportMapping::LeaveAlone => DVec2::ONE,
            _ => DVec2::new((aspect / 1.5).min(1.0), (1.5 / aspect).min(1.0)),
        };
        let corners = bounds.corners().map(|c| in_picture(&view, c));
        let outermost = corners.iter().map(|p| ((*p * 2.0 - 1.0) / own).abs().max_element()).fold(0.0, f64::max);
        assert!((outermost - 1.0).abs() < 1e-9, "{k} {viewport_mapping:?}: {outermost}");
        assert!(bounds.corners().iter().all(|c| (*c - view.eye).dot(view.forward) > view.near), "{k}");
    }
}

/// Stretched pictures show what the node says, whatever the proportions.
#[test]
fn a_picture_that_is_left_alone_is_stretched() {
    for (camera, aspect) in [
        ("PerspectiveCamera(position: (0.0, 0.0, 4.0), viewport_mapping: LeaveAlone, aspect_ratio: 2.0)", 2.0),
        ("OrthographicCamera(position: (0.0, 0.0, 4.0), viewport_mapping: LeaveAlone, aspect_ratio: 0.5)", 0.5),
        ("FrustumCamera(position: (0.0, 0.0, 4.0), viewport_mapping: LeaveAlone, top: 1.5)", 0.5),
    ] {
        let made = scene(&format!("{camera}, Cube()"));
        let views: Vec<Viewpoint> = [[100, 100], [400, 100], [100, 400]]
            .into_iter()
            .map(|[w, h]| RenderAction::new(w, h).viewpoint(&made).unwrap())
            .collect();
        for (view, densest) in
            views.iter().zip([f64::max(100.0, 100.0 / aspect), f64::max(100.0, 400.0 / aspect), 400.0])
        {
            assert_eq!((view.aspect, view.lens), (aspect, views[0].lens), "{camera}");
            assert_eq!(view.pixels, densest, "{camera}");
        }
    }
}

/// A cropped picture has the proportions that were asked for, in the middle; nothing is picked beside it.
#[test]
fn nothing_is_picked_where_a_picture_is_cropped() {
    let wall = "Translation(translation: (0.0, 0.0, -5.0)), Cube(width: 1e5, height: 1e5, depth: 1.0)";
    for mapping in ["CropViewportFillFrame", "CropViewportLineFrame", "CropViewportNoFrame"] {
        for (ratio, size, [from, to]) in [
            (0.5, [60, 40], [[20, 0], [40, 40]]),
            (3.0, [60, 40], [[0, 10], [60, 30]]),
            (1.5, [60, 40], [[0, 0], [60, 40]]),
            (1e-3, [60, 40], [[29, 0], [30, 40]]),
            (1e3, [60, 40], [[0, 19], [60, 20]]),
        ] {
            let made = scene(&format!(
                "PerspectiveCamera(position: (0.0, 0.0, 4.0), viewport_mapping: {mapping}, aspect_ratio: {ratio:?}), {wall}"
            ));
            let picker = RayPickAction::pixel(0, 0, size).picker(&made).unwrap();
            for x in 0..size[0] {
                for y in 0..size[1] {
                    let met = RayPickAction::pixel(x, y, size).apply(&made).unwrap();
                    let inside = x >= from[0] && x < to[0] && y >= from[1] && y < to[1];
                    assert_eq!(!met.is_empty(), inside, "{mapping} {ratio} {x} {y}");
                    // A ray in the world knows nothing of the picture.
                    let at = |p: u32, of: u32| (f64::from(p) + 0.5) / f64::from(of);
                    let ray = picker.ray_through(at(x, size[0]), at(y, size[1])).unwrap();
                    assert!(!picker.pick(&ray, false).unwrap().is_empty());
                }
            }
        }
    }
}

#[test]
fn windows_that_are_none_are_refused_with_their_place() {
    for (camera, message) in [
        ("FrustumCamera(left: 1.0, right: 1.0)", "beyond left"),
        ("FrustumCamera(bottom: 0.5, top: -0.5)", "above bottom"),
        ("PerspectiveCamera(aspect_ratio: 0.0)", "above 0"),
        ("OrthographicCamera(viewport_mapping: CropViewportNoFrame, aspect_ratio: -2.0)", "above 0"),
    ] {
        let text = format!("Scene(version: 1, root: Separator(children: [{camera}, Cube()]))");
        let error = parse(&text, &Registry::default()).unwrap_err().to_string();
        assert!(error.contains(message) && error.contains("1:"), "{error}");
    }
    // Fields that are set in code are looked at when the camera is used.
    for camera in [
        FrustumCamera { left: 2.0, ..FrustumCamera::default() },
        FrustumCamera { top: f64::NAN, ..FrustumCamera::default() },
        FrustumCamera { right: f64::INFINITY, ..FrustumCamera::default() },
        FrustumCamera { right: f64::MAX, left: f64::MIN, ..FrustumCamera::default() },
    ] {
        let mut made = Scene::new();
        let root = made.root();
        if made.add(root, camera).is_ok() {
            made.add(root, Cube::default()).unwrap();
            RenderAction::new(30, 20).apply(&made).unwrap_err();
        }
    }
}

#[cfg(feature = "render")]
mod pictures {
    use super::*;
    use common::gpu::{LinearPicture, linear};

    const SIZE: [u32; 2] = [120, 80];

    fn draw(nodes: &str, size: [u32; 2]) -> LinearPicture {
        linear().draw(&RenderAction::new(size[0], size[1]).apply(&scene(nodes)).unwrap())
    }

    fn differ(a: [f32; 4], b: [f32; 4]) -> bool {
        a.iter().zip(b).any(|(a, b)| (a - b).abs() > 2.0 / 255.0)
    }

    const THINGS: &str = "Background(color: (0.2, 0.3, 0.4), zenith: (0.9, 0.1, 0.1)), DirectionalLight(),
        Sphere(radius: 2.0), Translation(translation: (3.0, 1.0, 0.5)), Rotation(rotation: (1.0, 1.0, 0.0, 0.7)), Cube(),
        DrawStyle(line_width: 3.0), Coordinate3(point: [(-9.0, 0.0, 0.0), (3.0, 4.0, 1.0)]), LineSet()";

    /// Four windows side by side show what the whole shows: sky, shapes, lines.
    #[test]
    fn tiles_of_a_picture_are_the_picture() {
        let place = "position: (2.0, -12.0, 5.0), look_at: (0.0, 0.0, 0.0), near_distance: Some(1.0)";
        let whole =
            draw(&format!("FrustumCamera({place}, left: -0.6, right: 0.6, bottom: -0.4, top: 0.4), {THINGS}"), SIZE);
        let [w, h] = SIZE.map(|n| n / 2);
        let mut others = 0;
        for (column, left) in [-0.6, 0.0].into_iter().enumerate() {
            for (row, bottom) in [0.0, -0.4].into_iter().enumerate() {
                let (right, top) = (left + 0.6, bottom + 0.4);
                let tile = draw(
                    &format!(
                        "FrustumCamera({place}, left: {left:?}, right: {right:?}, bottom: {bottom:?}, top: {top:?}), {THINGS}"
                    ),
                    [w, h],
                );
                for x in 0..w {
                    for y in 0..h {
                        let there = whole.at(x + w * column as u32, y + h * row as u32);
                        others += u32::from(differ(tile.at(x, y), there));
                    }
                }
            }
        }
        // Matrices are rounded to f32 for each: a sample on an edge may fall on the other side of it.
        assert!(others <= 10, "{others} pixels differ");
    }

    /// A cropped picture is a part of the one that fills the place; around it is what the mapping says.
    #[test]
    fn a_cropped_picture_is_a_part_of_the_whole() {
        let camera = |mapping: &str| {
            format!(
                "PerspectiveCamera(position: (2.0, -12.0, 5.0), look_at: (0.0, 0.0, 0.0), viewport_mapping: {mapping},
                 aspect_ratio: 1.0), "
            )
        };
        let sky = THINGS.to_owned();
        let plain = sky.replace(", zenith: (0.9, 0.1, 0.1)", "");
        let background = Color::new(0.2, 0.3, 0.4).linear();
        let grey = Color::new(0.5, 0.5, 0.5).linear();
        let is = |p: [f32; 4], color: glam::Vec3| !differ(p, [color.x, color.y, color.z, 1.0]);
        for things in [sky, plain] {
            let whole = draw(&format!("{}{things}", camera("AdjustCamera")), SIZE);
            for (mapping, next, beyond) in [
                ("CropViewportFillFrame", grey, grey),
                ("CropViewportLineFrame", grey, background),
                ("CropViewportNoFrame", background, background),
            ] {
                let cropped = draw(&format!("{}{things}", camera(mapping)), SIZE);
                for x in 0..SIZE[0] {
                    for y in 0..SIZE[1] {
                        let p = cropped.at(x, y);
                        match x {
                            20..100 => {
                                assert!(!differ(p, whole.at(x, y)), "{mapping} {x} {y}: {p:?} {:?}", whole.at(x, y))
                            }
                            19 | 100 => assert!(is(p, next), "{mapping} {x} {y}: {p:?}"),
                            _ => assert!(is(p, beyond), "{mapping} {x} {y}: {p:?}"),
                        }
                    }
                }
            }
        }
    }

    /// In all mappings a pixel shows a shape where a pick through its middle meets one, but at outlines.
    #[test]
    fn what_is_drawn_is_picked() {
        let things = "LightModel(model: BaseColor), Rotation(rotation: (1.0, 1.0, 0.0, 0.7)), Cube(width: 4.0), Translation(translation: (3.0, 1.0, 0.5)), Cube()";
        for mapping in ["AdjustCamera", "LeaveAlone", "CropViewportFillFrame", "CropViewportNoFrame"] {
            for camera in [
                "PerspectiveCamera(aspect_ratio: 0.8, ",
                "OrthographicCamera(height: 9.0, aspect_ratio: 0.8, ",
                "FrustumCamera(left: -0.3, right: 0.8, bottom: -0.1, top: 0.6, ",
            ] {
                let nodes = format!(
                    "{camera} position: (2.0, -12.0, 5.0), look_at: (0.0, 0.0, 0.0), viewport_mapping: {mapping}),
                     Background(color: (0.0, 0.0, 1.0)), {things}"
                );
                let picture = draw(&nodes, SIZE);
                let made = scene(&nodes);
                let crop_color = [Color::new(0.5, 0.5, 0.5).linear(), Color::new(0.0, 0.0, 1.0).linear()];
                let (mut met, mut wrong) = (0, 0);
                for x in 0..SIZE[0] {
                    for y in 0..SIZE[1] {
                        let p = picture.at(x, y);
                        let empty = crop_color.iter().any(|c| !differ(p, [c.x, c.y, c.z, 1.0]));
                        let picked = !RayPickAction::pixel(x, y, SIZE).apply(&made).unwrap().is_empty();
                        met += u32::from(picked);
                        wrong += u32::from(picked == empty);
                    }
                }
                // One sample a pixel, in its middle: only where rounding to f32 moves an outline over it.
                assert!(met > 200 && wrong <= 4, "{mapping} {camera}: {met} {wrong}");
            }
        }
    }
}
