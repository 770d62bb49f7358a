//! Looks for study: wire frames and normals show what is really there.
#![cfg(feature = "render")]

mod common;

use common::gpu::{headless, linear};
use glam::DVec4;
use seamount::prelude::*;

const SIZE: [u32; 2] = [120, 90];

/// Four cells of ground, lifted at one corner, and a cube beside it, all in one style.
fn scene(style: Style, line_width: f32) -> Scene {
    let mut samples = vec![0; 9];
    samples[2] = 65535;
    let mut scene = Scene::new();
    let root = scene.root();
    let (position, look_at) = (Some(DVec3::new(-0.4, -1.5, 1.6)), Some(DVec3::new(0.2, 0.4, 0.0)));
    scene.add(root, PerspectiveCamera { position, look_at, ..Default::default() }).unwrap();
    scene.add(root, BaseColor { rgb: Color::WHITE.into() }).unwrap();
    scene
        .add(root, DrawStyle { style, line_width, line_color: Color::new(1.0, 0.0, 0.0), ..DrawStyle::default() })
        .unwrap();
    scene.add(root, Texture2::from_image(Image::new(3, 3, Pixels::Gray16(samples)).unwrap())).unwrap();
    scene
        .add(
            root,
            SeamlessTerrain { max_height: 0.3, resolutions: (2, 2), detail: DetailMode::Full, ..Default::default() },
        )
        .unwrap();
    // The heights are no texture of the cube's.
    scene.add(root, Texture2::default()).unwrap();
    scene.add(root, Transform { translation: DVec3::new(-0.5, 0.4, 0.0), ..Default::default() }).unwrap();
    scene.add(root, Cube { width: 0.5, height: 0.5, depth: 0.5 }).unwrap();
    scene
}

/// Distance in pixels from a pixel's centre to the nearest edge of the face that it shows, from the corners of the triangles.
fn nearest_edge(scene: &Scene, x: u32, y: u32) -> Option<f64> {
    let action = RayPickAction { surface: Surface::Exact, ..RayPickAction::pixel(x, y, SIZE) };
    let hit = action.apply(scene).unwrap().into_iter().next()?;
    let view = RenderAction::new(SIZE[0], SIZE[1]).viewpoint(scene).unwrap();
    let show = |p: DVec3| {
        let clip: DVec4 = view.clip_from_eye() * (p - view.eye).extend(1.0);
        DVec2::new(
            (clip.x / clip.w + 1.0) * 0.5 * f64::from(SIZE[0]),
            (1.0 - clip.y / clip.w) * 0.5 * f64::from(SIZE[1]),
        )
    };
    let at = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
    // The corners of the faces of the scene.
    let terrain = hit.path.names(scene).last().is_some_and(|n| n.starts_with("SeamlessTerrain"));
    let mut triangles: Vec<[DVec3; 3]> = Vec::new();
    if terrain {
        let height = |c: u32, r: u32| if (c, r) == (2, 0) { 0.3 } else { 0.0 };
        let point = |c: u32, r: u32| DVec3::new(f64::from(c) * 0.5, 1.0 - f64::from(r) * 0.5, height(c, r));
        for (c, r) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let [nw, ne, sw, se] = [point(c, r), point(c + 1, r), point(c, r + 1), point(c + 1, r + 1)];
            triangles.extend([[nw, sw, se], [nw, se, ne]]);
        }
    } else {
        let frame = RenderAction::new(SIZE[0], SIZE[1]).apply(scene).unwrap();
        let seamount::action::Geometry::Mesh(mesh) = &frame.draws[1].geometry else { panic!("a cube is a mesh") };
        // Meshes are relative to their first corner; the cube's is known by its box.
        let low = mesh.positions.iter().fold(glam::Vec3::INFINITY, |a, &b| a.min(b)).as_dvec3();
        let corner = DVec3::new(-0.5, 0.4, 0.0) - DVec3::splat(0.25) - low;
        let place = |&c: &u32| mesh.positions[c as usize].as_dvec3() + corner;
        triangles.extend(mesh.triangles.iter().map(|t| [place(&t[0]), place(&t[1]), place(&t[2])]));
    }
    let distance = |p: DVec2, q: DVec2| (q - p).perp_dot(at - p) / (q - p).length();
    // The triangle that the pixel is in, and the one nearest to the point picked where several are behind each other.
    let inside = triangles.iter().filter_map(|t| {
        let [a, b, c] = t.map(show);
        let sides = [distance(a, b), distance(b, c), distance(c, a)];
        // Counter-clockwise seen from outside, and y points down.
        let least = sides.iter().map(|s| -s).fold(f64::INFINITY, f64::min);
        let plane = (t[1] - t[0]).cross(t[2] - t[0]).normalize().dot(hit.point - t[0]).abs();
        (least >= 0.0 && plane < 1e-6).then_some(least)
    });
    inside.fold(None, |least: Option<f64>, d| Some(least.map_or(d, |l| l.min(d))))
}

/// Each pixel against the distance to the sides of its triangle, for ground and cube, as wires alone and on faces.
#[test]
fn lines_are_where_the_sides_of_the_triangles_are() {
    for width in [1.0, 3.0] {
        let faces = scene(Style::FilledLines, width);
        let wires = scene(Style::Lines, width);
        let mut gpu = linear();
        let draw =
            |gpu: &mut common::gpu::Linear, s: &Scene| gpu.draw(&RenderAction::new(SIZE[0], SIZE[1]).apply(s).unwrap());
        let (on_faces, alone) = (draw(&mut gpu, &faces), draw(&mut gpu, &wires));
        let (mut lines, mut between) = (0, 0);
        for (x, y) in (0..SIZE[0]).flat_map(|x| (0..SIZE[1]).map(move |y| (x, y))) {
            let Some(distance) = nearest_edge(&faces, x, y) else { continue };
            let [r, g, ..] = on_faces.at(x, y);
            let half = f64::from(width) * 0.5;
            if distance < half - 0.6 || distance < half * 0.5 {
                assert!(r > 0.98 && g < 0.6, "{distance} from an edge, ({x}, {y}) is {r} {g}");
                assert_eq!(alone.at(x, y)[0], 1.0, "({x}, {y})");
                lines += 1;
            }
            // What is beyond the edge of a shape may be seen from a pixel's corner.
            if distance > half + 1.0 {
                assert!(g > 0.98, "{distance} from an edge, ({x}, {y}) is {r} {g}");
                between += 1;
            }
        }
        assert!(lines > 60 && between > 300, "{lines} on lines, {between} between");
        // Between wires there is nothing, or what is behind.
        let holes = alone.texels.iter().filter(|t| t[0] == 0.0).count();
        assert!(holes > on_faces.texels.iter().filter(|t| t[0] == 0.0).count() + 300);
    }
}

#[test]
fn what_is_invisible_is_not_drawn_but_picked() {
    let scene = scene(Style::Invisible, 1.0);
    assert!(RenderAction::new(32, 32).apply(&scene).unwrap().draws.is_empty());
    let down = Ray::new(DVec3::new(0.5, 0.5, 9.0), DVec3::NEG_Z).unwrap();
    assert_eq!(RayPickAction::ray(down).apply(&scene).unwrap().len(), 1);
}

/// The colour of a place is its normal, as numbers.
#[test]
fn normals_come_out_as_numbers() {
    let ramp = |i: u32| (i % 9) as u16 * 6000;
    let mut scene = Scene::new();
    let root = scene.root();
    let (position, look_at) = (Some(DVec3::new(0.5, 0.5, 3.0)), Some(DVec3::new(0.5, 0.5, 0.0)));
    scene.add(root, PerspectiveCamera { position, look_at, height_angle: 0.2, ..Default::default() }).unwrap();
    scene
        .add(root, Texture2::from_image(Image::new(9, 9, Pixels::Gray16((0..81).map(ramp).collect())).unwrap()))
        .unwrap();
    scene.add(root, SeamlessTerrain { color_mode: ColorMode::Normals, max_height: 1.0, ..Default::default() }).unwrap();
    let picture = headless().draw(&RenderAction::new(16, 16).apply(&scene).unwrap()).unwrap();
    // Rises by 6000/65535 per eighth eastwards.
    let normal = DVec3::new(-8.0 * 6000.0 / 65535.0, 0.0, 1.0).normalize();
    let want = normal.to_array().map(|c| ((c * 0.5 + 0.5) * 255.0).round() as i16);
    let got = picture.pixel(8, 8).unwrap();
    assert!(got.iter().zip(want).all(|(&g, w)| (i16::from(g) - w).abs() <= 2), "{got:?} is not {want:?}");
}
