//! What the GPU draws of heights that blend between levels, against the surface that the engine tells.
#![cfg(feature = "render")]
#![allow(missing_docs, reason = "a test")]

mod common;

use std::sync::Arc;

use common::Rng;
use glam::DAffine3;
use seamount::action::{Draw, Geometry};
use seamount::node::lattice_view;
use seamount::prelude::*;
use seamount::render::{Headless, shader_text};
use seamount::terrain::{
    ActivePatch, Detail, DrawnSurface, Hierarchy, Instances, PatchId, Resolutions, Selection, Terrain, Urgency,
    generate,
};

/// A map that is no whole number of patches, as integers or as floats.
fn map(floats: bool) -> Arc<Image> {
    let field = generate(129, 12).unwrap();
    let raw = (0..90).flat_map(|r| (0..117).map(move |c| (c, r))).map(|(c, r)| field.raw(c, r));
    let pixels = if floats {
        Pixels::GrayF32(raw.map(|h| (h / 65_535.0) as f32).collect())
    } else {
        Pixels::Gray16(raw.map(|h| h as u16).collect())
    };
    Arc::new(Image::new(117, 90, pixels).unwrap())
}

/// Pixels; coarse, so that a small map has something to blend.
const TOLERANCE: f64 = 6.0;

fn node() -> SeamlessTerrain {
    SeamlessTerrain {
        scale: 116.0,
        max_height: 40.0,
        morph: true,
        resolutions: (4, 2),
        detail: DetailMode::PixelError(TOLERANCE),
        ..SeamlessTerrain::default()
    }
}

fn morph_weights(draw: &Draw) -> &[seamount::terrain::PatchWeights] {
    let Geometry::Terrain(terrain) = &draw.geometry else { panic!("a terrain") };
    terrain.instances.weights()
}

/// Straight down from above, four pixels to a cell, with the detail of a camera near the ground: the depth of each pixel against
/// the triangle of `DrawnSurface` there.
#[test]
fn the_gpu_draws_the_surface_that_the_engine_tells() {
    let mut headless = Headless::new(None).unwrap_or_else(|error| panic!("{error}"));
    let mut rng = Rng(8);
    for floats in [false, true] {
        let map = map(floats);
        for _ in 0..3 {
            let mut scene = Scene::new();
            let root = scene.root();
            let above = OrthographicCamera {
                position: Some(DVec3::new(58.0, 44.5, 100.0)),
                height: 89.0,
                ..OrthographicCamera::default()
            };
            scene.add(root, above).unwrap();
            let low = PerspectiveCamera {
                position: Some(DVec3::new(rng.range(0.0, 116.0), rng.range(-30.0, 10.0), rng.range(30.0, 60.0))),
                look_at: Some(DVec3::new(58.0, 70.0, 10.0)),
                height_angle: 1.3,
                ..PerspectiveCamera::default()
            };
            let low = scene.add(root, low).unwrap();
            scene.set_name(low, "low").unwrap();
            scene.add(root, Texture2::from_image(Arc::clone(&map))).unwrap();
            let node = SeamlessTerrain { lod_camera: Some("low".to_owned()), ..node() };
            scene.add(root, node.clone()).unwrap();
            let action = RenderAction::new(4 * 116, 4 * 89);
            let frame = action.apply(&scene).unwrap();
            assert!(frame.draws[0].effects.morph);
            let partly = morph_weights(&frame.draws[0]).iter().filter(|w| w.inside > 0.0 && w.inside < 1.0).count();
            assert!(partly > 50, "only {partly} parts blend");
            let depth = headless.draw_depth(&frame).unwrap();
            let view = action.viewpoint(&scene).unwrap();
            let far = view.far.unwrap();

            let terrain = Terrain::new(map.height_field(None).unwrap());
            let tree = terrain.tree(Resolutions::new(4, 2).unwrap());
            let placed = node.frame(terrain.field());
            let through = RenderAction { camera: Some("low".to_owned()), ..action };
            let lattice = lattice_view(&through.viewpoint(&scene).unwrap(), &DAffine3::IDENTITY, &placed);
            let selection = tree.select(&terrain, &Detail::MorphPixelError { tolerance: TOLERANCE, view: lattice });
            let mesh = DrawnSurface {
                field: terrain.field(),
                tree: tree.hierarchy(),
                parts: tree.parts(),
                selection: &selection,
            };
            let (mut looked_at, mut worst, mut blended): (u32, f64, u32) = (0, 0.0, 0);
            for patch in selection.patches(tree.hierarchy()) {
                for triangle in mesh.triangles(patch) {
                    let [a, b, c] = triangle.corners.map(|p| p.map(f64::from));
                    let area = (b[1] - a[1]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[1] - a[1]);
                    if area == 0.0 {
                        continue;
                    }
                    let pixels = |k: usize| {
                        let low = a[k].min(b[k]).min(c[k]);
                        let high = a[k].max(b[k]).max(c[k]);
                        (low * 4.0) as u32..(high * 4.0) as u32
                    };
                    let [ha, hb, hc] = triangle.heights;
                    for (x, y) in pixels(1).flat_map(|y| pixels(0).map(move |x| (x, y))) {
                        let p = [(f64::from(x) + 0.5) / 4.0, (f64::from(y) + 0.5) / 4.0];
                        let part = |q: [f64; 2], r: [f64; 2]| {
                            ((r[1] - q[1]) * (p[0] - q[0]) - (r[0] - q[0]) * (p[1] - q[1])) / area
                        };
                        let (wc, wa, wb) = (part(a, b), part(b, c), part(c, a));
                        // Away from edges, which a rasteriser may give to either neighbour.
                        if wa.min(wb).min(wc) < 1e-3 {
                            continue;
                        }
                        let height = placed.base + (wa * ha + wb * hb + wc * hc) * placed.z_step;
                        let z = f64::from(depth[(y * 4 * 116 + x) as usize]);
                        let drawn = view.eye.z - (far - z * (far - view.near));
                        worst = worst.max((drawn - height).abs());
                        looked_at += 1;
                        let full = terrain.field().surface(p[0], p[1]).unwrap();
                        blended += u32::from((full * placed.z_step - height).abs() > 0.01);
                    }
                }
            }
            println!(
                "{looked_at} pixels, {blended} of them off the full surface; heights differ by up to {worst:.2e} of 40"
            );
            assert!(looked_at > 100_000 && blended > 10_000);
            // Depth is a float over a range of some 40 units around: 2⁻²⁴ of it, and heights are floats of 65 535 steps.
            assert!(worst < 1e-4, "{worst}");
        }
    }
}

/// All or nothing, by level: the weights are 1 above a level and 0 from it on.
struct Down(u8);

impl Urgency for Down {
    fn urgency(&self, _: &Hierarchy, patch: PatchId) -> f64 {
        if patch.level < self.0 { f64::INFINITY } else { 0.0 }
    }
}

/// Pictures of instances with weights of 0 and 1 are those of the meshes they stand for, drawn without weights.
#[test]
fn weights_of_0_and_1_draw_the_meshes_they_stand_for() {
    let mut headless = Headless::new(None).unwrap_or_else(|error| panic!("{error}"));
    let map = map(false);
    let mut scene = Scene::new();
    let root = scene.root();
    let camera = PerspectiveCamera {
        position: Some(DVec3::new(20.0, -30.0, 50.0)),
        look_at: Some(DVec3::new(58.0, 60.0, 10.0)),
        ..PerspectiveCamera::default()
    };
    scene.add(root, camera).unwrap();
    scene.add(root, DirectionalLight { direction: DVec3::new(1.0, 0.3, -0.4), ..Default::default() }).unwrap();
    scene.add(root, Texture2::from_image(Arc::clone(&map))).unwrap();
    scene.add(root, SeamlessTerrain { morph: false, detail: DetailMode::Full, ..node() }).unwrap();
    let frame = RenderAction::new(512, 400).apply(&scene).unwrap();
    // Full detail has nothing to blend, whether asked to or not.
    assert!(!frame.draws[0].effects.morph && morph_weights(&frame.draws[0]).is_empty());

    let terrain = Terrain::new(map.height_field(None).unwrap());
    let tree = terrain.tree(Resolutions::new(4, 2).unwrap());
    let shape = tree.hierarchy();
    let with = |selection: &Selection, morph: bool| {
        let patches: Vec<ActivePatch> = selection.patches(shape).collect();
        let mut instances = Instances::default();
        instances.update(shape, tree.parts(), &patches);
        if morph {
            instances.weigh(shape, tree.parts(), &patches, selection);
            assert_eq!(instances.weights().len(), instances.data().len());
        }
        let mut frame = frame.clone();
        frame.draws[0].effects.morph = morph;
        let Geometry::Terrain(terrain) = &mut frame.draws[0].geometry else { panic!("a terrain") };
        terrain.instances = Arc::new(instances);
        frame
    };
    let mut pictures = Vec::new();
    for level in 0..=shape.depth() + 1 {
        let mut selection = Selection::new(shape);
        selection.update_morphing(shape, &Down(level));
        let blended = headless.draw(&with(&selection, true)).unwrap();
        let plain = headless.draw(&with(&selection, false)).unwrap();
        assert!(blended.rgba == plain.rgba, "level {level}");
        pictures.push(plain.rgba);
    }
    assert!(pictures.windows(2).all(|pair| pair[0] != pair[1]), "the levels look the same");
    let whole = headless.draw(&frame).unwrap().rgba;
    assert!(*pictures.last().unwrap() == whole, "all weights 1 is not the whole map");

    // Weights that are asked for but not there are an error, not a picture.
    let mut selection = Selection::new(shape);
    selection.update_morphing(shape, &Down(1));
    let mut broken = with(&selection, false);
    broken.draws[0].effects.morph = true;
    let error = headless.draw(&broken).unwrap_err().to_string();
    assert!(error.contains("no weights"), "{error}");
}

/// Two terrains in one frame, one that morphs after one that does not and the other way round: each gets its own instances.
#[test]
fn terrains_with_and_without_weights_share_a_frame() {
    let mut headless = Headless::new(None).unwrap_or_else(|error| panic!("{error}"));
    let draw = |headless: &mut Headless, which: &[bool]| {
        let mut scene = Scene::new();
        let root = scene.root();
        let camera = PerspectiveCamera {
            position: Some(DVec3::new(116.0, -90.0, 90.0)),
            look_at: Some(DVec3::new(116.0, 60.0, 0.0)),
            ..PerspectiveCamera::default()
        };
        scene.add(root, camera).unwrap();
        scene.add(root, DirectionalLight::default()).unwrap();
        scene.add(root, Texture2::from_image(map(false))).unwrap();
        for (k, &morph) in which.iter().enumerate() {
            let part = scene.add(root, Separator::default()).unwrap();
            let translation = DVec3::X * 117.0 * f64::from(k as u32);
            scene.add(part, Transform { translation, ..Transform::default() }).unwrap();
            scene.add(part, SeamlessTerrain { morph, ..node() }).unwrap();
        }
        let frame = RenderAction::new(640, 300).apply(&scene).unwrap();
        let morphing: Vec<bool> = frame.draws.iter().map(|draw| draw.effects.morph).collect();
        assert_eq!(morphing, which);
        // In the order given, and the other way round.
        let mut turned = frame.clone();
        turned.draws.reverse();
        [headless.draw(&frame).unwrap().rgba, headless.draw(&turned).unwrap().rgba]
    };
    let (both, neither) = (draw(&mut headless, &[true, true]), draw(&mut headless, &[false, false]));
    for which in [[true, false], [false, true]] {
        let [mixed, turned] = draw(&mut headless, &which);
        assert!(mixed == turned, "{which:?} depends on the order");
        // The maps stand apart, left and right of the middle.
        for (k, pixel) in mixed.chunks_exact(4).enumerate() {
            let left = k % 640 < 318;
            if left || k % 640 > 322 {
                let of = if which[usize::from(!left)] { &both } else { &neither };
                assert_eq!(pixel, &of[0][4 * k..4 * k + 4], "pixel {k} of {which:?}");
            }
        }
    }
    assert!(both != neither, "nothing blends");
}

/// The promise that a scene pays for what it calls for: off, there are no weights, no second vertex buffer and no word of it in
/// the shader; on, 20 bytes per instance.
#[test]
fn off_it_costs_nothing() {
    let mut headless = Headless::new(None).unwrap_or_else(|error| panic!("{error}"));
    let frame = |morph: bool| {
        let mut scene = Scene::new();
        let root = scene.root();
        let camera = PerspectiveCamera { position: Some(DVec3::new(58.0, -60.0, 60.0)), ..Default::default() };
        let camera = PerspectiveCamera { look_at: Some(DVec3::new(58.0, 60.0, 0.0)), ..camera };
        scene.add(root, camera).unwrap();
        scene.add(root, Texture2::from_image(map(false))).unwrap();
        scene.add(root, SeamlessTerrain { morph, ..node() }).unwrap();
        RenderAction::new(300, 200).apply(&scene).unwrap()
    };
    let format = wgpu::TextureFormat::Rgba8UnormSrgb;
    let (off, on) = (frame(false), frame(true));
    let words = ["morph", "sides", "inside", "@location(2)"];
    let text = |frame: &Frame| shader_text(&frame.draws[0].effects, format).unwrap();
    assert!(words.iter().all(|word| !text(&off).contains(word)), "{}", text(&off));
    assert!(words.iter().all(|word| text(&on).contains(word)), "{}", text(&on));
    assert!(off.draws[0].effects.names().iter().all(|name| name != "morph"));
    assert!(on.draws[0].effects.names().iter().any(|name| name == "morph"));
    assert!(morph_weights(&off.draws[0]).is_empty());

    // Once the map is there only uniforms and instances are sent.
    headless.draw(&on).unwrap();
    headless.draw(&off).unwrap();
    let instances = |frame: &Frame| {
        let Geometry::Terrain(terrain) = &frame.draws[0].geometry else { panic!("a terrain") };
        terrain.instances.data().len() as u64
    };
    let sent = |headless: &mut Headless, frame: &Frame| headless.draw(frame).unwrap().report.bytes_uploaded;
    let (sent_off, sent_on) = (sent(&mut headless, &off), sent(&mut headless, &on));
    let (count_off, count_on) = (instances(&off), instances(&on));
    // 16 bytes more of uniforms: the resolution.
    assert_eq!(sent_on - 32 * count_on, sent_off - 12 * count_off + 16);
}

/// Wires on faces, holes and heights that blend in one scene: lines are drawn on both kinds of triangle, and the surface below
/// stays where it is.
#[test]
fn lines_on_faces_with_holes_that_morph_leave_the_surface_alone() {
    let mut headless = Headless::new(None).unwrap_or_else(|error| panic!("{error}"));
    let field = generate(129, 12).unwrap();
    let void = |c: u32, r: u32| (40..60).contains(&c) && (30..50).contains(&r);
    let raw = (0..90).flat_map(|r| (0..117).map(move |c| (c, r)));
    let raw = raw.map(|(c, r)| if void(c, r) { 65_535 } else { field.raw(c, r).min(65_534.0) as u16 });
    let map = Arc::new(Image::new(117, 90, Pixels::Gray16(raw.collect())).unwrap());
    let frame = |style: Style| {
        let mut scene = Scene::new();
        let root = scene.root();
        let camera = PerspectiveCamera { position: Some(DVec3::new(58.0, -60.0, 60.0)), ..Default::default() };
        let camera = PerspectiveCamera { look_at: Some(DVec3::new(58.0, 60.0, 0.0)), ..camera };
        scene.add(root, camera).unwrap();
        scene.add(root, DrawStyle { style, line_color: Color::new(1.0, 0.0, 0.0), ..Default::default() }).unwrap();
        scene.add(root, Texture2::from_image(Arc::clone(&map))).unwrap();
        scene.add(root, SeamlessTerrain { voids: VoidMode::Hole, void_sample: Some(65_535.0), ..node() }).unwrap();
        RenderAction::new(300, 200).apply(&scene).unwrap()
    };
    let (plain, lines) = (frame(Style::Filled), frame(Style::FilledLines));
    assert_eq!(lines.draws.iter().map(|d| d.effects.geometry.is_loose()).collect::<Vec<_>>(), [false, true]);
    assert!(lines.draws.iter().all(|d| d.effects.morph && d.effects.style == Style::FilledLines));
    assert!(morph_weights(&lines.draws[0]).iter().any(|w| w.inside > 0.0 && w.inside < 1.0), "nothing blends");
    // Both kinds of triangle together, then each alone.
    for kept in [0..2, 0..1, 1..2] {
        let [plain, lines] = [&plain, &lines].map(|frame| {
            let mut frame = frame.clone();
            frame.draws = frame.draws[kept.clone()].to_vec();
            headless.draw(&frame).unwrap().rgba
        });
        let (mut surface, mut red) = (0, 0);
        for (before, after) in plain.chunks_exact(4).zip(lines.chunks_exact(4)) {
            // Where nothing was, nothing is; what a line covers goes from grey towards red.
            assert_eq!(before[0] == 0, after[0] == 0, "{before:?} to {after:?}");
            assert!(after[0] >= before[0] && after[1] <= before[1], "{before:?} to {after:?}");
            surface += u32::from(before[0] > 0);
            red += u32::from(after[0] > 220 && after[1] < 150);
        }
        assert!(surface > 200 && 20 * red > surface && red < surface, "{red} of {surface} pixels in {kept:?}");
    }
}
