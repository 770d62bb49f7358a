//! Heights that are changed in a rectangle: every answer is that of a scene made from the changed heights from scratch.
#![allow(missing_docs, reason = "a test")]

mod common;

use std::sync::Arc;

use common::Rng;
use glam::DVec3;
use seamount::action::{Ray, Surface};
use seamount::prelude::*;
use seamount::scene::{ImageError, SetHeightsError};
use seamount::terrain::{HeightField, MinMaxPyramid, SampleRect, Voids};

const SIZE: [u32; 2] = [48, 36];

#[derive(Clone)]
struct Case {
    columns: u32,
    rows: u32,
    pixels: Pixels,
    void_sample: Option<f64>,
}

impl Case {
    /// The scene with a texture of these pixels, and the texture's key.
    fn scene(&self) -> (Scene, NodeKey) {
        let mut scene = Scene::new();
        let root = scene.root();
        let eye = Some(DVec3::new(-0.3, -0.6, 0.8));
        let camera =
            PerspectiveCamera { position: eye, look_at: Some(DVec3::new(0.5, 0.4, 0.0)), ..Default::default() };
        scene.add(root, camera).unwrap();
        scene.add(root, DirectionalLight::default()).unwrap();
        let image = Image::new(self.columns, self.rows, self.pixels.clone()).unwrap();
        let texture = scene.add(root, Texture2::from_image(image)).unwrap();
        let terrain = SeamlessTerrain {
            max_height: 0.2,
            void_sample: self.void_sample,
            resolutions: (4, 2),
            detail: DetailMode::PixelError(0.5),
            ..SeamlessTerrain::default()
        };
        scene.add(root, terrain.clone()).unwrap();
        // The same map once more, without voids and of other patches.
        scene.add(root, Transform { translation: DVec3::new(0.0, 1.2, 0.0), ..Transform::default() }).unwrap();
        scene.add(root, SeamlessTerrain { void_sample: None, resolutions: (2, 3), ..terrain.clone() }).unwrap();
        // And with its voids as holes.
        scene.add(root, Transform { translation: DVec3::new(0.0, 1.2, 0.0), ..Transform::default() }).unwrap();
        scene.add(root, SeamlessTerrain { voids: VoidMode::Hole, ..terrain }).unwrap();
        (scene, texture)
    }

    /// Changes a rectangle here and returns the pixels of it.
    fn change(&mut self, rng: &mut Rng) -> (SampleRect, Pixels) {
        let (column, row) = (rng.below(self.columns), rng.below(self.rows));
        let small = rng.below(3) > 0;
        let extent = |rng: &mut Rng, left: u32| rng.below(if small { left.min(5) } else { left } + 1);
        let rect =
            SampleRect { column, row, columns: extent(rng, self.columns - column), rows: extent(rng, self.rows - row) };
        let count = rect.columns * rect.rows;
        let void = self.void_sample.is_some() && rng.below(3) == 0;
        fn put<T: Copy>(map: &mut [T], width: u32, rect: SampleRect, new: &[T]) {
            for (k, &value) in new.iter().enumerate() {
                let (c, r) = (k as u32 % rect.columns, k as u32 / rect.columns);
                map[((rect.row + r) * width + rect.column + c) as usize] = value;
            }
        }
        let new = match &mut self.pixels {
            Pixels::Gray8(map) => {
                let new: Vec<u8> = (0..count).map(|_| rng.bits() as u8).collect();
                put(map, self.columns, rect, &new);
                Pixels::Gray8(new)
            }
            Pixels::Gray16(map) => {
                let low = u16::from(!void);
                let new: Vec<u16> =
                    (0..count).map(|_| ((rng.bits() >> 49) as u16 * u16::from(rng.below(9) > 0)).max(low)).collect();
                put(map, self.columns, rect, &new);
                Pixels::Gray16(new)
            }
            Pixels::GrayF32(map) => {
                let value =
                    |rng: &mut Rng| if void && rng.below(4) == 0 { f32::NAN } else { rng.range(0.0, 1.0) as f32 };
                let new: Vec<f32> = (0..count).map(|_| value(rng)).collect();
                put(map, self.columns, rect, &new);
                Pixels::GrayF32(new)
            }
            Pixels::Rgba8(map) => {
                let new: Vec<[u8; 4]> = (0..count).map(|_| (rng.bits() as u32).to_le_bytes()).collect();
                put(map, self.columns, rect, &new);
                Pixels::Rgba8(new)
            }
            Pixels::Rgba16(_) => unreachable!("not among the cases"),
        };
        (rect, new)
    }
}

fn cases() -> Vec<Case> {
    let mut rng = Rng(1);
    let count = |c: u32, r: u32| 0..c * r;
    vec![
        Case {
            columns: 90,
            rows: 70,
            pixels: Pixels::Gray16(count(90, 70).map(|i| 20_000 + (i % 90 * 30 + i / 90 * 7) as u16).collect()),
            void_sample: None,
        },
        Case {
            columns: 41,
            rows: 66,
            pixels: Pixels::Gray16(count(41, 66).map(|_| (rng.bits() >> 49) as u16).collect()),
            void_sample: Some(0.0),
        },
        Case { columns: 33, rows: 33, pixels: Pixels::Gray8(vec![9; 33 * 33]), void_sample: Some(7.0) },
        Case {
            columns: 30,
            rows: 20,
            pixels: Pixels::GrayF32(count(30, 20).map(|i| (i % 17) as f32 / 17.0).collect()),
            void_sample: Some(0.5),
        },
        Case { columns: 25, rows: 31, pixels: Pixels::Rgba8(vec![[9, 1, 77, 255]; 25 * 31]), void_sample: None },
        Case { columns: 2, rows: 2, pixels: Pixels::Gray16(vec![1, 2, 3, 4]), void_sample: None },
    ]
}

/// All that can be asked without a GPU, as text: bits and all.
fn answers(scene: &Scene) -> String {
    let mut rays = Vec::new();
    let mut rng = Rng(4);
    for _ in 0..90 {
        let target = DVec3::new(rng.range(0.0, 1.0), rng.range(0.0, 3.4), rng.range(0.0, 0.2));
        let from = DVec3::new(rng.range(-1.0, 2.0), rng.range(-1.0, 4.0), rng.range(0.1, 1.0));
        rays.push(Ray::new(from, target - from).unwrap());
    }
    let mut text = format!("{:?}\n", BoundingBoxAction::default().apply(scene).unwrap());
    for surface in [Surface::Coarse, Surface::Drawn, Surface::Exact] {
        let action = RayPickAction { surface, ..RayPickAction::pixel(0, 0, SIZE) };
        text.push_str(&format!("{:?}\n", action.picker(scene).unwrap().pick_many(&rays, true).unwrap()));
    }
    text
}

#[test]
fn every_answer_is_that_of_a_fresh_scene() {
    let mut rng = Rng(12);
    let edits = if std::env::var("SEAMOUNT_SOAK").is_ok_and(|v| v != "0") { 400 } else { 12 };
    for mut case in cases() {
        let (mut scene, texture) = case.scene();
        assert_eq!(answers(&scene), answers(&case.scene().0));
        for number in 0..edits {
            let (rect, pixels) = case.change(&mut rng);
            scene.set_heights(texture, rect, &pixels).unwrap();
            let fresh = case.scene().0;
            assert_eq!(answers(&scene), answers(&fresh), "edit {number}: {rect:?}");
        }
    }
}

#[cfg(feature = "render")]
#[test]
fn every_picture_is_that_of_a_fresh_scene() {
    let mut headless = seamount::render::Headless::new(None).unwrap_or_else(|error| panic!("{error}"));
    let mut rng = Rng(13);
    for mut case in cases() {
        let (mut scene, texture) = case.scene();
        let action = RenderAction::new(SIZE[0], SIZE[1]);
        let mut view = View::default();
        for _ in 0..4 {
            let (rect, pixels) = case.change(&mut rng);
            scene.set_heights(texture, rect, &pixels).unwrap();
            let ours = headless.draw(action.apply_in(&scene, &mut view).unwrap()).unwrap();
            let fresh = headless.draw(&action.apply(&case.scene().0).unwrap()).unwrap();
            assert!(ours.rgba == fresh.rgba, "{rect:?}");
        }
    }
}

/// The number of blocks that are computed anew is bounded by the rectangle, whatever the size of the map; and the tree is
/// that of the changed map.
#[test]
fn only_the_blocks_of_the_rectangle_are_computed() {
    let mut rng = Rng(3);
    for (columns, rows) in [(2, 2), (33, 5), (300, 201), (1025, 700)] {
        let mut samples: Vec<u16> = (0..columns * rows).map(|_| (rng.bits() >> 48) as u16).collect();
        let field = |s: &[u16]| HeightField::from_u16(columns, rows, s.to_vec(), Voids::default()).unwrap();
        let mut pyramid = MinMaxPyramid::new(&field(&samples));
        for _ in 0..20 {
            let (column, row) = (rng.below(columns), rng.below(rows));
            let rect = SampleRect {
                column,
                row,
                columns: 1 + rng.below((columns - column).min(40)),
                rows: 1 + rng.below((rows - row).min(40)),
            };
            for r in rect.row..rect.row + rect.rows {
                for c in rect.column..rect.column + rect.columns {
                    samples[(r * columns + c) as usize] = (rng.bits() >> 48) as u16;
                }
            }
            let changed = field(&samples);
            let count = pyramid.update(&changed, rect);
            // Blocks of 4, 8, 16, … cells that can hold samples of the rectangle: one more than fit in it, and their line.
            let bound: u64 = (2..12)
                .map(|bits| {
                    let blocks = |n: u32| u64::from((n >> bits) + 2);
                    blocks(rect.columns) * blocks(rect.rows)
                })
                .sum();
            assert!(count <= bound, "{count} of {bound} blocks for {rect:?}");
            let fresh = MinMaxPyramid::new(&changed);
            for bits in 2..12 {
                let size = 1 << bits;
                for j in 0..rows.div_ceil(size) {
                    for i in 0..columns.div_ceil(size) {
                        assert_eq!(pyramid.range(size, i, j), fresh.range(size, i, j), "{rect:?}: {size} {i} {j}");
                    }
                }
            }
        }
    }
}

/// What somebody still holds stays as it was; other textures of the same image too.
#[test]
fn others_keep_the_heights_of_before() {
    let case = cases().remove(0);
    let (mut scene, texture) = case.scene();
    let root = scene.root();
    let shared = Arc::clone(&scene.get::<Texture2>(texture).unwrap().image.as_ref().unwrap().0);
    let other = scene.insert(Texture2::from_image(Arc::clone(&shared)));
    scene.add_child(root, other).unwrap();
    scene.add(root, SeamlessTerrain { max_height: 0.2, base_height: 5.0, ..SeamlessTerrain::default() }).unwrap();
    let action = RenderAction::new(SIZE[0], SIZE[1]);
    let frame = action.apply(&scene).unwrap();
    let held = match &frame.draws[0].geometry {
        seamount::action::Geometry::Terrain(draw) => Arc::clone(&draw.heights),
        _ => unreachable!("there are terrains only"),
    };
    let before = held.samples().clone();
    let top = |scene: &Scene| BoundingBoxAction::default().apply(scene).unwrap().unwrap().max.z;
    let high = top(&scene);
    let version = scene.version();
    let rect = SampleRect { column: 10, row: 10, columns: 2, rows: 1 };
    scene.set_heights(texture, rect, &Pixels::Gray16(vec![65_535; 2])).unwrap();
    assert!(scene.version() > version);
    assert_eq!(held.samples(), &before);
    assert_eq!(shared.pixels(), &case.pixels);
    assert_eq!(top(&scene), high);
    scene.set_heights(other, rect, &Pixels::Gray16(vec![65_535; 2])).unwrap();
    assert_eq!(top(&scene), 5.2);
}

#[test]
fn what_does_not_fit_is_refused_and_changes_nothing() {
    let (mut scene, texture) = cases().remove(0).scene();
    let (before, version) = (answers(&scene), scene.version());
    let rect = |column, row, columns, rows| SampleRect { column, row, columns, rows };
    let gray = |count| Pixels::Gray16(vec![1; count]);
    let root = scene.root();
    let empty = scene.insert(Texture2::default());
    let missing = scene.insert(Texture2 { filename: "nowhere.png".to_owned(), ..Texture2::default() });
    let inserted = scene.version();
    let mut refused = |key, rect, pixels: &Pixels| scene.set_heights(key, rect, pixels).unwrap_err();
    for beyond in [rect(89, 0, 2, 1), rect(0, 70, 1, 1), rect(u32::MAX, 0, 2, 1), rect(0, 3, 1, u32::MAX)] {
        let error = refused(texture, beyond, &gray(2));
        assert!(matches!(error, SetHeightsError::Image(ImageError::Outside { .. })), "{error}");
        assert!(error.to_string().contains("90 × 70"), "{error}");
    }
    let error = refused(texture, rect(0, 0, 2, 2), &gray(3));
    assert!(matches!(error, SetHeightsError::Image(ImageError::WrongCount { given: 3, .. })), "{error}");
    let error = refused(texture, rect(0, 0, 2, 2), &Pixels::GrayF32(vec![0.0; 4]));
    assert_eq!(
        error.to_string(),
        "floats were given, but the picture is made of 16-bit grey: give samples of its own depth"
    );
    assert!(matches!(refused(root, rect(0, 0, 1, 1), &gray(1)), SetHeightsError::NoTexture));
    assert!(matches!(refused(empty, rect(0, 0, 1, 1), &gray(1)), SetHeightsError::NoImage));
    let error = refused(missing, rect(0, 0, 1, 1), &gray(1));
    assert!(matches!(error, SetHeightsError::Image(ImageError::Missing { .. })), "{error}");
    assert!(version < inserted && scene.version() == inserted);
    assert_eq!(answers(&scene), before);
    // Nothing at all is no mistake.
    scene.set_heights(texture, rect(90, 70, 0, 0), &gray(0)).unwrap();
    assert_eq!(answers(&scene), before);
}
