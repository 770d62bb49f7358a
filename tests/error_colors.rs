//! Errors as colours: what parts are said to be off bounds what they are off, and each pixel shows it.
#![cfg(feature = "render")]

mod common;

use std::collections::HashMap;

use common::Rng;
use common::gpu::linear;
use glam::{DAffine3, DVec3};
use seamount::action::{Lens, Viewpoint};
use seamount::node::{HitDetail, TerrainTriangle, lattice_view};
use seamount::prelude::*;
use seamount::terrain::errors::overlay_heights;
use seamount::terrain::{
    Detail, DrawnSurface, LatticeView, LodEye, Part, PatchId, Precision, Resolutions, Side, Terrain,
};

const SIZE: [u32; 2] = [120, 90];

/// Noisy hills of 45 × 38 samples: whole patches, and patches that the border cuts. 65535 marks a void.
fn land(void: impl Fn(u32, u32) -> bool) -> Image {
    let mut rng = Rng(5);
    let mut height = |c: u32, r: u32| {
        let hills = 0.4 + 0.25 * (f64::from(c) * 0.31).sin() + 0.2 * (f64::from(r) * 0.23).cos();
        (hills * 40_000.0 + rng.range(0.0, 3000.0)) as u16
    };
    let samples = (0..45 * 38).map(|i| (i % 45, i / 45)).map(|(c, r)| if void(c, r) { u16::MAX } else { height(c, r) });
    Image::new(45, 38, Pixels::Gray16(samples.collect())).unwrap()
}

fn some_voids(c: u32, r: u32) -> bool {
    (10..14).contains(&c) && (8..12).contains(&r) || (c, r) == (30, 20)
}

fn camera(rng: &mut Rng) -> Viewpoint {
    let eye = DVec3::new(rng.range(-0.5, 1.5), rng.range(-0.5, 1.5), rng.range(0.1, 1.0));
    let (yaw, pitch) = (rng.range(0.0, 6.3), rng.range(-1.5, 0.1));
    let forward = DVec3::new(yaw.cos() * pitch.cos(), yaw.sin() * pitch.cos(), pitch.sin());
    let right = forward.cross(DVec3::Z).normalize();
    let lens = match rng.below(4) {
        0 => Lens::Orthographic { half_height: rng.range(0.1, 1.0) },
        _ => Lens::Perspective { tan_half_height: rng.range(0.2, 1.0) },
    };
    let up = right.cross(forward);
    Viewpoint { eye, right, up, forward, lens, center: rng.aside(), aspect: 1.5, pixels: 300.0, near: 0.01, far: None }
}

/// The side, or the two sides, whose errors a part has.
fn sides(part: Part) -> [Side; 2] {
    match part {
        Part::Tile(side, _) => [side; 2],
        Part::Strip(side, ..) => [side, side.next()],
    }
}

/// Brute force in f64: no point of any part in view is further off than is said; a pixel error of τ never says more than τ.
#[test]
fn what_is_said_bounds_what_is_measured() {
    let node = SeamlessTerrain { max_height: 0.3, ..Default::default() };
    for holes in [false, true] {
        let field = land(|c, r| holes && some_voids(c, r)).height_field(Some(65_535.0)).unwrap();
        let terrain = Terrain::new(if holes { field.with_holes() } else { field });
        let (mut closest, mut said, mut cases) = (0.0f64, 0, 0);
        let mut rng = Rng(11);
        for k in 0..120 {
            // Only two resolutions can morph.
            let tree = terrain.tree(Resolutions::new([4, 2][k % 2], [2, 3][k % 2]).unwrap());
            let view = lattice_view(&camera(&mut rng), &DAffine3::IDENTITY, &node.frame(terrain.field()));
            let tolerance = rng.range(0.5, 20.0);
            let eye = LodEye::Point { u: rng.range(0.0, 44.0), v: rng.range(0.0, 37.0), height: rng.range(1.0, 20.0) };
            let precision = Precision { precision: rng.range(0.5, 3.0), eye };
            let morphs = k % 2 == 0;
            let details = [
                Detail::PixelError { tolerance, view: view.clone() },
                Detail::Precision(precision),
                Detail::Leaves,
                Detail::MorphPixelError { tolerance, view: view.clone() },
                Detail::MorphPrecision(precision),
            ];
            for (number, detail) in details.iter().enumerate().filter(|(number, _)| *number < 3 || morphs) {
                let selection = tree.select(&terrain, detail);
                let (field, parts) = (terrain.field(), tree.parts());
                let drawn = DrawnSurface { field, tree: tree.hierarchy(), parts, selection: &selection };
                for patch in selection.patches(tree.hierarchy()) {
                    let off = tree.pixels_off(&terrain, &selection, &view, patch);
                    if number % 3 == 0 {
                        let most = off.into_iter().fold(0.0, f64::max);
                        assert!(most <= tolerance * (1.0 + 1e-12), "{detail:?} {patch:?}: {off:?}");
                    }
                    if number == 2 {
                        assert_eq!(off, [0.0; 4], "every cell is drawn");
                    }
                    for triangle in drawn.triangles(patch) {
                        let limit = sides(triangle.part).map(|side| off[side as usize]).into_iter().fold(0.0, f64::max);
                        let measured = measured(&drawn, &view, triangle.corners, triangle.heights);
                        // Pixels of points that are some 100 pixels from the middle.
                        assert!(measured <= limit * (1.0 + 1e-9) + 1e-9, "{detail:?} {patch:?}: {measured} of {limit}");
                        if limit > 0.0 && limit.is_finite() {
                            closest = closest.max(measured / limit);
                            said += 1;
                        }
                        cases += 1;
                    }
                }
            }
        }
        println!("{said} of {cases} triangles are off; the closest bound is reached to {closest}");
        assert!(closest > 0.9 && said > 10_000, "{closest} {said}");
    }
}

/// The largest distance in the picture of what a triangle shows from where it belongs, where either is in view.
fn measured(drawn: &DrawnSurface<'_>, view: &LatticeView, corners: [[u32; 2]; 3], heights: [f64; 3]) -> f64 {
    let mut worst = 0.0f64;
    overlay_heights(drawn.field, corners, heights, |u, v, surface, shown| {
        let (p, q) = (DVec3::new(u, v, surface), DVec3::new(u, v, shown));
        if view.frustum.contains(p) || view.frustum.contains(q) {
            worst = worst.max(view.pixel(p).distance(view.pixel(q)));
        }
    });
    worst
}

/// The colours that are documented, written down anew: sRGB, mixed in linear light.
fn color(error: f64) -> [f64; 3] {
    let stops: [(f64, [f64; 3]); 8] = [
        (0.0, [68.0, 1.0, 84.0]),
        (0.2, [65.0, 68.0, 135.0]),
        (0.4, [42.0, 120.0, 142.0]),
        (0.6, [34.0, 168.0, 132.0]),
        (0.8, [122.0, 209.0, 81.0]),
        (1.0, [253.0, 231.0, 37.0]),
        (1.0 + 1.0 / 256.0, [214.0, 47.0, 39.0]),
        (4.0, [70.0, 0.0, 10.0]),
    ];
    let linear = |c: f64| {
        let c = c / 255.0;
        if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    };
    let error = error.clamp(0.0, 4.0);
    let at = (1..7).find(|&k| error <= stops[k].0).unwrap_or(7);
    let (from, to) = (stops[at - 1], stops[at]);
    let share = (error - from.0) / (to.0 - from.0);
    std::array::from_fn(|k| linear(from.1[k]) * (1.0 - share) + linear(to.1[k]) * share)
}

struct Look {
    node: SeamlessTerrain,
    complexity: f64,
    /// The error that is yellow.
    unit: f64,
}

/// Each pixel has the colour of what its part is said to be off; what a pixel error allows is nowhere red.
#[test]
fn each_pixel_shows_what_its_part_is_off() {
    let node = SeamlessTerrain {
        max_height: 0.3,
        resolutions: (4, 2),
        void_sample: Some(65_535.0),
        color_mode: ColorMode::Errors,
        ..Default::default()
    };
    let with = |detail: DetailMode| SeamlessTerrain { detail, ..node.clone() };
    let looks = [
        Look { node: with(DetailMode::PixelError(1.5)), complexity: 0.5, unit: 1.5 },
        Look { node: with(DetailMode::PixelError(3.0)), complexity: 0.25, unit: 6.0 },
        Look { node: with(DetailMode::PixelError(0.0)), complexity: 0.5, unit: 1.0 },
        Look { node: with(DetailMode::Precision(1.0)), complexity: 0.5, unit: 1.0 },
        Look { node: with(DetailMode::Full), complexity: 0.5, unit: 1.0 },
        Look {
            node: SeamlessTerrain { voids: VoidMode::Hole, ..with(DetailMode::PixelError(2.0)) },
            complexity: 0.5,
            unit: 2.0,
        },
        Look { node: SeamlessTerrain { morph: true, ..with(DetailMode::PixelError(2.0)) }, complexity: 0.5, unit: 2.0 },
        Look {
            node: SeamlessTerrain { morph: true, voids: VoidMode::Hole, ..with(DetailMode::Precision(1.0)) },
            complexity: 0.5,
            unit: 1.0,
        },
        Look {
            node: SeamlessTerrain { lod_camera: Some("other".into()), ..with(DetailMode::PixelError(1.0)) },
            complexity: 0.5,
            unit: 1.0,
        },
    ];
    let mut gpu = linear();
    let (mut red, mut allowed) = (0, 0);
    for Look { node, complexity, unit } in looks {
        let mut scene = Scene::new();
        let root = scene.root();
        let at = |x, y, z| PerspectiveCamera {
            position: Some(DVec3::new(x, y, z)),
            look_at: Some(DVec3::new(0.5, 0.45, 0.1)),
            ..Default::default()
        };
        scene.add(root, at(0.3, -0.5, 0.7)).unwrap();
        let other = scene.add(root, at(0.9, 0.2, 0.4)).unwrap();
        scene.set_name(other, "other").unwrap();
        scene.add(root, Complexity { value: complexity, ..Default::default() }).unwrap();
        scene.add(root, Texture2::from_image(land(some_voids))).unwrap();
        scene.add(root, node.clone()).unwrap();
        let action = RenderAction::new(SIZE[0], SIZE[1]);
        let picture = gpu.draw(&action.apply(&scene).unwrap());

        // The errors, without the scene.
        let field = land(some_voids).height_field(Some(65_535.0)).unwrap();
        let terrain = Terrain::new(if node.voids == VoidMode::Hole { field.with_holes() } else { field });
        let seen_from = RenderAction { camera: node.lod_camera.clone(), ..action }.viewpoint(&scene).unwrap();
        let view = lattice_view(&seen_from, &DAffine3::IDENTITY, &node.frame(terrain.field()));
        let tree = terrain.tree(Resolutions::new(4, 2).unwrap());
        let selection = tree.select(&terrain, &detail(&node, complexity, &terrain, &seen_from, &view));
        let off: HashMap<PatchId, [f64; 4]> = selection
            .patches(tree.hierarchy())
            .map(|patch| (patch.id, tree.pixels_off(&terrain, &selection, &view, patch)))
            .collect();

        let picker = RayPickAction { surface: Surface::Drawn, ..RayPickAction::pixel(0, 0, SIZE) };
        let picker = picker.picker(&scene).unwrap();
        let (mut seen, mut most) = (0, 0.0f64);
        for (x, y) in (0..SIZE[0]).flat_map(|x| (0..SIZE[1]).map(move |y| (x, y))) {
            let part = |dx: f64, dy: f64| {
                let [w, h] = SIZE.map(f64::from);
                let ray = picker.ray_through((f64::from(x) + dx) / w, (f64::from(y) + dy) / h).unwrap();
                let hit = picker.pick(&ray, false).unwrap().into_iter().next()?;
                let HitDetail::Terrain(detail) = hit.detail else { panic!("there is nothing but ground") };
                let sides = match detail.triangle {
                    TerrainTriangle::Tile(side) => [side; 2],
                    TerrainTriangle::Strip(side) => [side, side.next()],
                    other => panic!("{other:?} is not drawn"),
                };
                (!detail.wall).then_some((detail.patch, sides))
            };
            let Some((patch, sides)) = part(0.5, 0.5) else { continue };
            // On the border of a part rounding decides.
            let beside = [(0.4, 0.5), (0.6, 0.5), (0.5, 0.4), (0.5, 0.6)];
            if beside.iter().any(|&(dx, dy)| part(dx, dy) != Some((patch, sides))) {
                continue;
            }
            let error = sides.map(|side| off[&patch][side as usize]).into_iter().fold(0.0, f64::max) / unit;
            let (want, [r, g, b, _]) = (color(error), picture.at(x, y));
            let close = [r, g, b].iter().zip(want).all(|(&got, want)| (f64::from(got) - want).abs() < 2e-3);
            assert!(close, "({x}, {y}) is {r} {g} {b} and not {want:?}: {error} in {node:?}");
            (seen, most) = (seen + 1, most.max(error));
            // Red, and what has more red than green but is not yellow.
            let too_much = r > 2.0 * g && r > b;
            assert_eq!(too_much, error > 1.0, "({x}, {y}) is {r} {g} {b}: {error}");
            red += u32::from(too_much);
            allowed += u32::from(!too_much && error > 0.5);
        }
        println!("{:?}: {seen} pixels, up to {most}", node.detail);
        assert!(seen > 2000, "{seen}");
        match node.detail {
            DetailMode::PixelError(tolerance) if tolerance > 0.0 => assert!(most > 0.5 && most < 1.0 + 1e-12, "{most}"),
            DetailMode::Precision(_) => assert!(most > 1.0, "{most}"),
            DetailMode::PixelError(_) | DetailMode::Full => assert_eq!(most, 0.0),
        }
    }
    assert!(red > 500 && allowed > 500, "{red} {allowed}");
}

/// What the detail of a node stands for.
fn detail(node: &SeamlessTerrain, complexity: f64, terrain: &Terrain, eye: &Viewpoint, view: &LatticeView) -> Detail {
    let view = view.clone();
    let precision = |precision: f64| {
        let frame = node.frame(terrain.field());
        let [u, v, w] = frame.lattice(eye.eye).to_array();
        let [cu, cv] = terrain.field().cells().map(f64::from);
        let ground = terrain.field().filled_surface(u.clamp(0.0, cu), v.clamp(0.0, cv)).unwrap();
        let height = (w - ground) * frame.z_step / frame.cell_size[0];
        Precision { precision, eye: LodEye::Point { u, v, height } }
    };
    let tolerance = |pixels: f64| pixels * 4f64.powf(1.0 - 2.0 * complexity);
    match (node.detail, node.morph) {
        (DetailMode::PixelError(pixels), false) => Detail::PixelError { tolerance: tolerance(pixels), view },
        (DetailMode::PixelError(pixels), true) => Detail::MorphPixelError { tolerance: tolerance(pixels), view },
        (DetailMode::Precision(rho), false) => Detail::Precision(precision(rho)),
        (DetailMode::Precision(rho), true) => Detail::MorphPrecision(precision(rho)),
        (DetailMode::Full, _) => Detail::Leaves,
    }
}
