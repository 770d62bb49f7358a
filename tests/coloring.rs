//! Colours of a terrain: each pixel against what the nodes say, in f64.
#![cfg(feature = "render")]

mod common;

use std::sync::Arc;

use common::Rng;
use common::gpu::linear;
use seamount::node::TextureFilter;
use seamount::prelude::*;

const SIZE: [u32; 2] = [80, 80];

fn hills() -> Arc<Image> {
    let height = |c: f64, r: f64| 0.5 + 0.3 * (c * 0.4).sin() + 0.2 * (r * 0.31 + c * 0.15).cos();
    let samples = (0..41 * 41).map(|i| (height(f64::from(i % 41), f64::from(i / 41)) * 65535.0) as u16);
    Arc::new(Image::new(41, 41, Pixels::Gray16(samples.collect())).unwrap())
}

/// Unlit white ground of 400 × 400, 10 to 60 high, in full detail, seen at a slant; `nodes` come before it.
fn ground(nodes: impl FnOnce(&mut dyn FnMut(Box<dyn Node>))) -> Scene {
    ground_within(std::f64::consts::FRAC_PI_4, nodes)
}

/// The same with another angle of view.
fn ground_within(height_angle: f64, nodes: impl FnOnce(&mut dyn FnMut(Box<dyn Node>))) -> Scene {
    let mut scene = Scene::new();
    let root = scene.root();
    let (position, look_at) = (Some(DVec3::new(250.0, -150.0, 420.0)), Some(DVec3::new(200.0, 180.0, 20.0)));
    scene.add(root, PerspectiveCamera { position, look_at, height_angle, ..Default::default() }).unwrap();
    scene.add(root, BaseColor { rgb: Color::WHITE.into() }).unwrap();
    scene.add(root, Texture2::from_image(hills())).unwrap();
    nodes(&mut |node| {
        let key = scene.insert_boxed(node);
        scene.add_child(root, key).unwrap();
    });
    let terrain = SeamlessTerrain {
        scale: 400.0,
        max_height: 50.0,
        base_height: 10.0,
        detail: DetailMode::Full,
        ..Default::default()
    };
    scene.add(root, terrain).unwrap();
    scene
}

/// Calls `check` for each pixel of ground with what it shows and its colour.
fn each_pixel(scene: &Scene, mut check: impl FnMut(&PickedPoint, [f32; 3], [u32; 2])) {
    let frame = RenderAction::new(SIZE[0], SIZE[1]).apply(scene).unwrap();
    let picture = linear().draw(&frame);
    let action = RayPickAction { surface: Surface::Exact, ..RayPickAction::pixel(0, 0, SIZE) };
    let picker = action.picker(scene).unwrap();
    let mut seen = 0;
    for (x, y) in (0..SIZE[0]).flat_map(|x| (0..SIZE[1]).map(move |y| (x, y))) {
        let at = |dx: f64, dy: f64| {
            let ray =
                picker.ray_through((f64::from(x) + dx) / f64::from(SIZE[0]), (f64::from(y) + dy) / f64::from(SIZE[1]));
            picker.pick(&ray.unwrap(), false).unwrap().into_iter().next()
        };
        // Pixels on the border of the map are left out.
        let around = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)].map(|(dx, dy)| at(dx, dy));
        if let (Some(hit), true) = (at(0.5, 0.5), around.iter().all(Option::is_some)) {
            let [r, g, b, _] = picture.at(x, y);
            check(&hit, [r, g, b], [x, y]);
            seen += 1;
        }
    }
    assert!(seen > 1500, "{seen} pixels of ground");
}

fn assert_near(got: [f32; 3], want: [f32; 3], tolerance: f32, at: [u32; 2]) {
    let near = got.iter().zip(want).all(|(g, w)| (g - w).abs() <= tolerance);
    assert!(near, "{got:?} is not {want:?} at {at:?}");
}

#[test]
fn ramps_colour_by_height() {
    let samples = hills().height_field(None).unwrap();
    let seamount::terrain::Samples::U16(samples) = samples.samples() else { panic!("heights have 16 bits") };
    let z = |raw: u16| 10.0 + 50.0 * f64::from(raw) / 65535.0;
    let (low, high) = (z(*samples.iter().min().unwrap()), z(*samples.iter().max().unwrap()));
    for ramp in [Ramp::Hypsometric, Ramp::Gray, Ramp::Viridis, Ramp::Heat, Ramp::Signal] {
        for range in [None, Some(DVec2::new(20.0, 40.0)), Some(DVec2::new(50.0, 0.0))] {
            let scene = ground(|add| add(Box::new(ColorRamp { ramp, range, ..Default::default() })));
            let DVec2 { x: from, y: to } = range.unwrap_or(DVec2::new(low, high));
            each_pixel(&scene, |hit, got, at| {
                let place = (hit.object_point.z - from) / (to - from);
                // Half floats have 11 bits; steep parts of a ramp magnify rounding of the height.
                assert_near(got, ramp.color(place as f32).to_array(), 4e-3, at);
            });
        }
    }
}

#[test]
fn ramps_colour_by_slope() {
    for range in [None, Some(DVec2::new(0.1, 0.4))] {
        let scene =
            ground(|add| add(Box::new(ColorRamp { ramp: Ramp::Gray, by: RampBy::Slope, range, ..Default::default() })));
        let DVec2 { x: from, y: to } = range.unwrap_or(DVec2::new(0.0, std::f64::consts::FRAC_PI_4));
        let (mut sum, mut count) = (0.0, 0);
        each_pixel(&scene, |hit, got, at| {
            let normal = hit.smooth_normal.normalize();
            let place = (normal.z.acos() - from) / (to - from);
            let want = Ramp::Gray.color(place as f32).to_array();
            // Seen at a slant the map is looked up in smaller copies, which smooth it.
            assert_near(got, want, 0.25, at);
            sum += f64::from((got[0] - want[0]).abs());
            count += 1;
        });
        let mean = sum / f64::from(count);
        println!("slopes are off by {mean} on the mean");
        assert!(mean < 0.02, "{mean} on the mean");
    }
}

/// Where a line is drawn its height is in the pixel, and where its height passes through the middle of a pixel it is drawn.
#[test]
fn contour_lines_are_at_their_heights() {
    for interval in [5.0, 2.5] {
        // Near enough that a cell covers many pixels.
        let scene = ground_within(0.12, |add| {
            add(Box::new(ContourLines { interval, width: 1.0, color: Color::BLACK, ..Default::default() }));
        });
        let picker = RayPickAction { surface: Surface::Exact, ..RayPickAction::pixel(0, 0, SIZE) };
        let picker = picker.picker(&scene).unwrap();
        let (mut lines, mut between) = (0, 0);
        each_pixel(&scene, |hit, got, [x, y]| {
            let height = |dx: f64, dy: f64| {
                let [px, py] =
                    [(x, dx, SIZE[0]), (y, dy, SIZE[1])].map(|(p, d, n)| (f64::from(p) + 0.5 + d) / f64::from(n));
                let hits = picker.pick(&picker.ray_through(px, py).unwrap(), false).unwrap();
                hits.first().map_or(hit.object_point.z, |hit| hit.object_point.z)
            };
            let z = hit.object_point.z;
            // Over the four pixels that share their slopes.
            let slope = |dx: f64, dy: f64| (height(dx, dy) - z, z - height(-dx, -dy));
            let ((right, left), (down, up)) = (slope(1.0, 0.0), slope(0.0, 1.0));
            let gradient = 0.5 * DVec2::new(right + left, down + up).length();
            let away = (z / interval - (z / interval).round()).abs() * interval / gradient;
            // Lines that come close fade, and where the slope changes within a pixel its distance is not one number.
            let bends = (right - left).abs().max((down - up).abs()) > 0.1 * gradient;
            if gradient / interval > 0.2 || gradient == 0.0 || bends {
                return;
            }
            let covered = 1.0 - got[0];
            if away < 0.3 {
                assert!(covered > 0.5, "{covered} of ({x}, {y}) is line, {away} pixels from one");
                lines += 1;
            }
            if away > 1.5 {
                assert!(covered < 0.02, "{covered} of ({x}, {y}) is line, {away} pixels from one");
                between += 1;
            }
        });
        assert!(lines > 100 && between > 100, "{lines} on lines, {between} between");
    }
}

/// Level ground at the height of a line is not all ink.
#[test]
fn a_lake_at_the_height_of_a_line_stays_clear() {
    let flat = Image::new(9, 9, Pixels::Gray16(vec![0; 81])).unwrap();
    let mut scene = Scene::new();
    let root = scene.root();
    scene.add(root, PerspectiveCamera { orientation: AxisAngle::new(DVec3::X, 0.5), ..Default::default() }).unwrap();
    scene.add(root, BaseColor { rgb: Color::WHITE.into() }).unwrap();
    scene.add(root, Texture2::from_image(flat)).unwrap();
    scene.add(root, ContourLines::default()).unwrap();
    scene.add(root, SeamlessTerrain::default()).unwrap();
    let picture = linear().draw(&RenderAction::new(32, 32).apply(&scene).unwrap());
    assert_eq!(picture.at(16, 16), [1.0; 4]);
}

fn random_image(rng: &mut Rng, width: u32, height: u32) -> Image {
    let mut texel = || [rng.below(256), rng.below(256), rng.below(256), rng.below(256)].map(|c| c as u8);
    let texels = (0..width * height).map(|_| texel()).collect();
    Image::new(width, height, Pixels::Rgba8(texels)).unwrap()
}

/// The texel at a texture coordinate whose rows run down, without filter: colour in linear light, and alpha.
fn texel(image: &Image, s: f64, t: f64, wrap: [Wrap; 2]) -> [f32; 4] {
    let place = |x: f64, n: u32, wrap: Wrap| match wrap {
        Wrap::Repeat => (x * f64::from(n)).floor().rem_euclid(f64::from(n)) as usize,
        Wrap::Clamp => (x * f64::from(n)).floor().clamp(0.0, f64::from(n) - 1.0) as usize,
    };
    let (column, row) = (place(s, image.width(), wrap[0]), place(t, image.height(), wrap[1]));
    let [r, g, b, a] = image.rgba8()[row * image.width() as usize + column];
    let [r, g, b] = [r, g, b].map(|c| seamount::action::linear_from_srgb(f32::from(c) / 255.0));
    [r, g, b, f32::from(a) / 255.0]
}

/// Whether a coordinate is so near the border of a texel that rounding decides.
fn on_border(x: f64, n: u32) -> bool {
    let x = x * f64::from(n);
    (x - x.round()).abs() < 2e-3
}

use seamount::node::Wrap;

/// The definition of Open Inventor's texture transform, with both ways to wrap.
#[test]
fn texture_transforms_move_turn_and_scale_and_wrap() {
    let mut rng = Rng(8);
    for wrap in [[Wrap::Repeat; 2], [Wrap::Clamp; 2], [Wrap::Repeat, Wrap::Clamp]] {
        for _ in 0..3 {
            let image = Arc::new(random_image(&mut rng, 5, 3));
            let mut pair = |low, high| DVec2::new(rng.range(low, high), rng.range(low, high));
            let transform = Texture2Transform {
                translation: pair(-1.0, 1.0),
                rotation: pair(-3.0, 3.0).x,
                scale_factor: pair(0.5, 2.5),
                center: pair(0.0, 1.0),
            };
            let scene = ground(|add| {
                add(Box::new(TextureUnit { unit: 1 }));
                add(Box::new(transform.clone()));
                add(Box::new(Texture2 {
                    wrap_s: wrap[0],
                    wrap_t: wrap[1],
                    ..Texture2::from_image(Arc::clone(&image))
                }));
            });
            let mut compared = 0;
            each_pixel(&scene, |hit, got, at| {
                let p = (hit.uv - transform.center) * transform.scale_factor;
                let (sin, cos) = transform.rotation.sin_cos();
                let p =
                    DVec2::new(cos * p.x - sin * p.y, sin * p.x + cos * p.y) + transform.center + transform.translation;
                let (s, t) = (p.x, 1.0 - p.y);
                if on_border(s, 5) || on_border(t, 3) {
                    return;
                }
                compared += 1;
                let [r, g, b, _] = texel(&image, s, t, wrap);
                assert_near(got, [r, g, b], 3e-3, at);
            });
            assert!(compared > 1000, "{compared}");
        }
    }
}

#[test]
fn four_textures_are_mixed_by_their_shares() {
    let mut rng = Rng(4);
    let mask = Arc::new(random_image(&mut rng, 3, 3));
    let textures: Vec<_> = (0..4).map(|_| Arc::new(random_image(&mut rng, 4, 2))).collect();
    let scene = ground(|add| {
        for (unit, image) in std::iter::once(&mask).chain(&textures).enumerate() {
            add(Box::new(TextureUnit { unit: unit as u32 + 2 }));
            add(Box::new(Texture2::from_image(Arc::clone(image))));
        }
        add(Box::new(DetailTextures { size: 130.0, ..Default::default() }));
    });
    let mut compared = 0;
    each_pixel(&scene, |hit, got, at| {
        let place = hit.object_point;
        // Tiles begin at the north-west corner, their rows run south.
        let (s, t) = (place.x / 130.0, (400.0 - place.y) / 130.0);
        let (u, v) = (hit.uv.x, 1.0 - hit.uv.y);
        if on_border(s, 4) || on_border(t, 2) || on_border(u, 3) || on_border(v, 3) {
            return;
        }
        compared += 1;
        // Shares are numbers, not colours.
        let [column, row] = [u, v].map(|x| (x * 3.0) as usize);
        let shares = mask.rgba8()[row * 3 + column].map(|c| f32::from(c) / 255.0);
        let colors: Vec<_> = textures.iter().map(|image| texel(image, s, t, [Wrap::Repeat; 2])).collect();
        let want = [0, 1, 2].map(|k| {
            let sum: f32 = colors.iter().zip(shares).map(|(color, share)| color[k] * share).sum();
            sum / shares.iter().sum::<f32>()
        });
        assert_near(got, want, 4e-3, at);
    });
    assert!(compared > 1000, "{compared}");
}

/// A texture that is not there is an error that says which and what to do.
#[test]
fn a_missing_detail_texture_is_named() {
    let scene = ground(|add| add(Box::<DetailTextures>::default()));
    let error = RenderAction::new(8, 8).apply(&scene).unwrap_err().to_string();
    assert!(error.contains("mask") && error.contains("unit 2") && error.contains("Texture2"), "{error}");
    // Who draws no picture does not look.
    BoundingBoxAction::default().apply(&scene).unwrap();
}

/// Open Inventor's table, line by line: filter when shrunk, between smaller copies, when enlarged.
#[test]
fn texture_quality_is_open_inventors_table() {
    let (nearest, linear) = (false, true);
    // Up to this quality: min, mag, mipmaps, between mipmaps.
    let table = [
        (0.5, nearest, nearest, false, nearest),
        (0.6, linear, nearest, false, nearest),
        (0.7, nearest, nearest, true, nearest),
        (0.8, nearest, linear, true, linear),
        (0.9, linear, linear, true, nearest),
        (1.0, linear, linear, true, linear),
    ];
    for quality in (0..=1000).map(|k| f64::from(k) / 1000.0) {
        let line = table.iter().find(|line| quality <= line.0).unwrap();
        let &(_, min_linear, mag_linear, mipmaps, mip_linear) = line;
        let want = TextureFilter { min_linear, mag_linear, mipmaps, mip_linear };
        assert_eq!(TextureFilter::of_quality(quality), want, "{quality}");
    }
}

/// Level ground with one normal all over is lit as a plane with that normal is.
#[test]
fn normal_maps_turn_the_light() {
    let mut rng = Rng(6);
    for _ in 0..12 {
        let normal = DVec3::new(rng.range(-0.6, 0.6), rng.range(-0.6, 0.6), 1.0).normalize();
        let texel = normal.to_array().map(|c| ((c * 0.5 + 0.5) * 255.0).round() as u8);
        let stored = DVec3::from_array(texel.map(|c| f64::from(c) / 255.0 * 2.0 - 1.0)).normalize();
        let direction = DVec3::new(rng.range(-0.5, 0.5), rng.range(-0.5, 0.5), -1.0);
        let mut scene = Scene::new();
        let root = scene.root();
        scene
            .add(root, PerspectiveCamera { orientation: AxisAngle::new(DVec3::X, 0.3), ..Default::default() })
            .unwrap();
        scene.add(root, DirectionalLight { direction, ..Default::default() }).unwrap();
        scene
            .add(
                root,
                Material {
                    ambient_color: Color::BLACK.into(),
                    diffuse_color: Color::WHITE.into(),
                    ..Default::default()
                },
            )
            .unwrap();
        let flat = Image::new(9, 9, Pixels::Gray16(vec![30_000; 81])).unwrap();
        scene.add(root, Texture2::from_image(flat)).unwrap();
        scene.add(root, TextureUnit { unit: 7 }).unwrap();
        let [r, g, b] = texel;
        scene.add(root, Texture2::from_image(Image::new(1, 1, Pixels::Rgba8(vec![[r, g, b, 255]])).unwrap())).unwrap();
        scene.add(root, NormalMap { size: 0.3, ..Default::default() }).unwrap();
        let size = Some(DVec2::new(2.0, 0.7));
        scene.add(root, SeamlessTerrain { size, max_height: 0.5, ..Default::default() }).unwrap();
        let picture = linear().draw(&RenderAction::new(32, 32).apply(&scene).unwrap());
        let want = stored.dot(-direction.normalize()).max(0.0);
        let got = f64::from(picture.at(16, 16)[0]);
        assert!((got - want).abs() < 2e-3, "{got} is not {want} for {normal} under {direction}");
    }
}
