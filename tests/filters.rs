//! Filters of textures and of edges, in pixels: the lines of Open Inventor's table of texture quality, and antialiasing.
#![cfg(feature = "render")]

mod common;

use common::Rng;
use common::gpu::{Linear, linear};
use seamount::action::linear_from_srgb;
use seamount::prelude::*;

const SIZE: u32 = 48;

/// Texels along each side of the map; a power of two, so that a smaller copy is the mean of four.
const TEXELS: u32 = 256;

type Level = Vec<[f32; 3]>;

/// The colours of an image in linear light, and those of its smaller copies.
fn levels(codes: &[[u8; 4]]) -> Vec<Level> {
    let decode = |c: u8| linear_from_srgb(f32::from(c) / 255.0);
    let mut levels = vec![codes.iter().map(|&[r, g, b, _]| [r, g, b].map(decode)).collect::<Level>()];
    let mut side = TEXELS as usize;
    while side > 1 {
        let last = &levels[levels.len() - 1];
        let half = side / 2;
        let mean = |i: usize| {
            let corner = i / half * 2 * side + i % half * 2;
            let four = [corner, corner + 1, corner + side, corner + side + 1];
            std::array::from_fn(|k| four.iter().map(|&at| last[at][k]).sum::<f32>() / 4.0)
        };
        levels.push((0..half * half).map(mean).collect());
        side = half;
    }
    levels
}

/// A level at a place, rows running down, without filter or mixed from four texels; and whether rounding decides.
fn sample(level: &Level, place: DVec2, is_linear: bool) -> ([f64; 3], bool) {
    let side = (level.len() as f64).sqrt() as i64;
    let at = |c: i64, r: i64| level[(r.clamp(0, side - 1) * side + c.clamp(0, side - 1)) as usize].map(f64::from);
    let p = place * side as f64;
    if !is_linear {
        let near = (p - p.round()).abs().min_element() < 2e-3;
        return (at(p.x.floor() as i64, p.y.floor() as i64), near);
    }
    let p = p - 0.5;
    let (f, c, r) = (p - p.floor(), p.x.floor() as i64, p.y.floor() as i64);
    let mix = |a: [f64; 3], b: [f64; 3], f: f64| std::array::from_fn(|k| a[k] + f * (b[k] - a[k]));
    (mix(mix(at(c, r), at(c + 1, r), f.x), mix(at(c, r + 1), at(c + 1, r + 1), f.x), f.y), false)
}

/// Level ground of 1 × 1 from straight above under a map of random colours, drawn at so many texels to a pixel.
fn ground(texels: &[[u8; 4]], per_pixel: f64, texture_quality: f64) -> Scene {
    let mut scene = Scene::new();
    let root = scene.root();
    // Off the grid of texels, so that places in them are of all kinds.
    let at = DVec3::new(0.5 + 0.13 / f64::from(TEXELS), 0.5 - 0.29 / f64::from(TEXELS), 0.0);
    let height = f64::from(SIZE) * per_pixel / f64::from(TEXELS);
    let (position, look_at) = (Some(at + DVec3::Z), Some(at));
    scene.add(root, OrthographicCamera { position, look_at, height, ..Default::default() }).unwrap();
    scene.add(root, Material { diffuse_color: Color::WHITE.into(), ..Default::default() }).unwrap();
    scene.add(root, Complexity { texture_quality, ..Default::default() }).unwrap();
    scene.add(root, Texture2::from_image(Image::new(2, 2, Pixels::Gray16(vec![0; 4])).unwrap())).unwrap();
    scene.add(root, TextureUnit { unit: 1 }).unwrap();
    let map = Image::new(TEXELS, TEXELS, Pixels::Rgba8(texels.to_vec())).unwrap();
    scene.add(root, Texture2::from_image(map)).unwrap();
    scene.add(root, SeamlessTerrain::default()).unwrap();
    scene
}

/// Each line of the table, enlarged and shrunk, against the definition of the filters: every pixel's colour, but where the sample
/// lies on a border between texels.
#[test]
fn each_quality_filters_as_the_table_says() {
    let mut rng = Rng(3);
    let texels: Vec<[u8; 4]> =
        (0..TEXELS * TEXELS).map(|_| [rng.below(256), rng.below(256), rng.below(256), 255].map(|c| c as u8)).collect();
    let levels = levels(&texels);
    // Quality, linear when shrunk, linear when enlarged, smaller copies, linear between them.
    for (quality, min_linear, mag_linear, mipmaps, mip_linear) in [
        (0.3, false, false, false, false),
        (0.55, true, false, false, false),
        (0.65, false, false, true, false),
        (0.75, false, true, true, true),
        (0.85, true, true, true, false),
        (1.0, true, true, true, true),
    ] {
        // From a texel over 5 pixels to 2^0.4, 2^1.3 and 2^1.75 texels in a pixel.
        for per_pixel in [0.2, 0.6, 1.32, 2.46, 3.36] {
            let scene = ground(&texels, per_pixel, quality);
            let picture = linear().draw(&RenderAction::new(SIZE, SIZE).apply(&scene).unwrap());
            let lambda = f64::log2(per_pixel);
            let enlarged = lambda <= 0.0;
            let linear_here = if enlarged { mag_linear } else { min_linear };
            // Vulkan, section "texel filtering": without copies the first level; the nearest; or two.
            let (low, high) = match (enlarged || !mipmaps, mip_linear) {
                (true, _) => (0, 0),
                (false, false) => ((lambda + 0.5).ceil() as usize - 1, (lambda + 0.5).ceil() as usize - 1),
                (false, true) => (lambda as usize, lambda as usize + 1),
            };
            let (mut compared, mut shares) = (0, Vec::new());
            for (x, y) in (0..SIZE).flat_map(|y| (0..SIZE).map(move |x| (x, y))) {
                let offset = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5) - f64::from(SIZE) / 2.0;
                let middle = DVec2::new(0.5 + 0.13 / f64::from(TEXELS), 0.5 + 0.29 / f64::from(TEXELS));
                let place = middle + offset * per_pixel / f64::from(TEXELS);
                let ((a, near_a), (b, near_b)) =
                    (sample(&levels[low], place, linear_here), sample(&levels[high], place, linear_here));
                if near_a || near_b {
                    continue;
                }
                let [r, g, b_, _] = picture.at(x, y).map(f64::from);
                let got = [r, g, b_];
                // How much of the second level there is, if there is any.
                let dot = |p: [f64; 3], q: [f64; 3]| p.iter().zip(q).map(|(p, q)| p * q).sum::<f64>();
                let way: [f64; 3] = std::array::from_fn(|k| b[k] - a[k]);
                let length = dot(way, way);
                let share = if length > 0.01 { dot(std::array::from_fn(|k| got[k] - a[k]), way) / length } else { 0.0 };
                if length > 0.05 {
                    shares.push(share);
                }
                // Copies are of whole codes (half a code is 1/100 of linear light at most), weights have 8 bits along each axis.
                for k in 0..3 {
                    let want = a[k] + share * way[k];
                    let off = (got[k] - want).abs();
                    let loose = if low != high && length <= 0.01 { 0.1 } else { 0.0 };
                    assert!(off < 0.015 + loose, "{quality}, {per_pixel} at ({x}, {y}): {} is not {want}", got[k]);
                }
                compared += 1;
            }
            assert!(compared > 1500, "{compared}");
            if low != high {
                // Drivers may sharpen the blend of two levels, but all of one scale is blended alike.
                shares.sort_by(f64::total_cmp);
                let middle = shares[shares.len() / 2];
                let (first, last) = (shares[shares.len() / 20], shares[shares.len() * 19 / 20]);
                assert!(last - first < 0.1, "{quality}, {per_pixel}: shares from {first} to {last}");
                let want = lambda - lambda.floor();
                assert!((middle - want).abs() < 0.26 && middle > 0.0, "{quality}, {per_pixel}: {middle} is not {want}");
            }
        }
    }
}

/// A white square turned by a little on black.
fn square() -> Scene {
    let mut scene = Scene::new();
    let root = scene.root();
    let (position, look_at) = (Some(DVec3::Z * 5.0), Some(DVec3::ZERO));
    scene.add(root, OrthographicCamera { position, look_at, height: 4.0, ..Default::default() }).unwrap();
    scene.add(root, BaseColor { rgb: Color::WHITE.into() }).unwrap();
    scene.add(root, RotationXyz { axis: Axis::Z, angle: 0.19 }).unwrap();
    scene.add(root, Cube { depth: 0.0, ..Default::default() }).unwrap();
    scene
}

/// With one sample a pixel is black or white; with four it is a number of quarters, in linear light, that is nearer to how much of
/// the pixel is covered; and what is not asked for takes no memory.
#[test]
fn samples_say_how_much_of_a_pixel_is_covered() {
    let frame = RenderAction::new(SIZE, SIZE).apply(&square()).unwrap();
    let (sin, cos) = 0.19f64.sin_cos();
    // By 32 × 32 points; off by less than a hundredth along an edge.
    let covered = |x: u32, y: u32| {
        let inside = (0..1024).filter(|i| {
            let part = |p: u32, k: u32| (f64::from(p) + (f64::from(k) + 0.5) / 32.0) / f64::from(SIZE) * 4.0 - 2.0;
            let (px, py) = (part(x, i % 32), -part(y, i / 32));
            (cos * px + sin * py).abs() <= 1.0 && (cos * py - sin * px).abs() <= 1.0
        });
        inside.count() as f64 / 1024.0
    };
    let mut measured = Vec::new();
    for samples in [1, 4] {
        let picture = Linear::with_samples(samples).draw(&frame);
        let (mut off, mut edge, mut partly) = (0.0, 0, 0);
        for (x, y) in (0..SIZE).flat_map(|y| (0..SIZE).map(move |x| (x, y))) {
            let [r, g, b, _] = picture.at(x, y);
            let steps = r * samples as f32;
            assert!(r == g && g == b && (steps - steps.round()).abs() < 1e-3, "{samples} at ({x}, {y}): {r}");
            let want = covered(x, y);
            if want == 0.0 || want == 1.0 {
                assert_eq!(f64::from(r), want, "{samples} at ({x}, {y})");
                continue;
            }
            // A sample of the middle decides right for half of the pixel; four spread ones leave less than half.
            let error = (f64::from(r) - want).abs();
            assert!(error < 0.6, "{samples} at ({x}, {y}): {r} is not {want}");
            partly += u32::from(steps.round() > 0.0 && (steps.round() as u32) < samples);
            off += error;
            edge += 1;
        }
        println!("{samples} samples: {:.3} off on the mean of {edge} pixels, {partly} mixed", off / f64::from(edge));
        assert!(edge > 60);
        assert_eq!(partly > 0, samples > 1);
        measured.push((off / f64::from(edge), picture.report.gpu_bytes));
    }
    let [(one, small), (four, large)] = measured[..] else { panic!() };
    assert!(four < 0.6 * one, "{four} with four samples, {one} with one");
    // Depth alone; and four times depth and colour.
    let pixels = u64::from(SIZE * SIZE);
    assert_eq!(large - small, 4 * pixels * (4 + 8) - pixels * 4);
}

/// A number of samples that no device has is an error, and no panic.
#[test]
fn samples_that_no_device_has_are_refused() {
    let frame = RenderAction::new(SIZE, SIZE).apply(&square()).unwrap();
    for samples in [0, 3] {
        let error = Linear::with_samples(samples).try_draw(&frame).err().map(|error| error.to_string());
        assert!(error.is_some_and(|e| e.contains("refused")), "{samples}");
    }
}
