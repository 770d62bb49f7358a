//! Heights, places, eyes and settings that break terrains: each ends in a right picture, box and pick, or in a clear error.
//! Nothing is NaN, nothing gapes, nothing hangs.
//!
//! Most cases need no GPU: the frame says which triangles are drawn, and these are judged one by one. Small pictures are
//! compared with rays cast at every triangle of the full-resolution surface.
#![allow(missing_docs, reason = "a test")]

mod common;

use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::{Arc, mpsc};
use std::time::Duration;

use common::Rng;
use glam::{DAffine3, DVec2, DVec3};
use seamount::action::{Geometry, ShapeError, TerrainDraw};
use seamount::node::{FieldProblem, HitDetail, Node};
use seamount::prelude::*;
use seamount::terrain::{HeightField, HeightFieldError, LatticeFrame, Samples, generate};

/// A case that takes this long hangs. Far above what any takes, so that a busy machine does not fail.
const HANGS: Duration = Duration::from_secs(60);

/// Runs a case in a thread of its own and fails when it does not end.
fn ends(case: impl FnOnce() + Send + 'static) {
    let (done, wait) = mpsc::channel();
    let thread = std::thread::spawn(move || {
        case();
        let _ = done.send(());
    });
    match wait.recv_timeout(HANGS) {
        Err(mpsc::RecvTimeoutError::Timeout) => panic!("the case does not end"),
        _ => thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)),
    }
}

/// A terrain and where it stands.
#[derive(Clone)]
struct Ground {
    map: Arc<Image>,
    terrain: SeamlessTerrain,
    place: Vec<Transform>,
}

impl Ground {
    /// A map as a terrain with cells of length 1 and heights 0..8 (16 bits) or as given (floats).
    fn new(width: u32, height: u32, pixels: Pixels) -> Self {
        let max_height = if matches!(pixels, Pixels::GrayF32(_)) { 1.0 } else { 8.0 };
        let terrain = SeamlessTerrain {
            size: Some(DVec2::new(f64::from(width - 1), f64::from(height - 1))),
            max_height,
            resolutions: (2, 3),
            ..SeamlessTerrain::default()
        };
        Self { map: Arc::new(Image::new(width, height, pixels).unwrap()), terrain, place: Vec::new() }
    }

    /// Hills of 24 × 20 cells.
    fn hills() -> Self {
        let wave = |i: u32| {
            let (c, r) = (f64::from(i % 25), f64::from(i / 25));
            (32_000.0 + 16_000.0 * (c * 0.7).sin() + 15_000.0 * (r * 0.9 + c * 0.2).cos()) as u16
        };
        Self::new(25, 21, Pixels::Gray16((0..25 * 21).map(wave).collect()))
    }

    fn place(mut self, transform: Transform) -> Self {
        self.place.push(transform);
        self
    }

    fn model(&self) -> DAffine3 {
        self.place.iter().fold(DAffine3::IDENTITY, |model, t| model * t.affine())
    }

    fn field(&self) -> HeightField {
        let field = self.map.height_field(self.terrain.void_sample).unwrap();
        if self.terrain.voids == VoidMode::Hole { field.with_holes() } else { field }
    }

    fn frame(&self) -> LatticeFrame {
        self.terrain.frame(&self.field())
    }

    fn scene(&self, camera: impl Node, detail: DetailMode) -> Scene {
        let mut scene = Scene::new();
        let root = scene.root();
        scene.add(root, camera).unwrap();
        scene.add(root, BaseColor { rgb: Color::WHITE.into() }).unwrap();
        scene.add(root, Texture2::from_image(Arc::clone(&self.map))).unwrap();
        for transform in &self.place {
            scene.add(root, transform.clone()).unwrap();
        }
        scene.add(root, SeamlessTerrain { detail, ..self.terrain.clone() }).unwrap();
        scene
    }

    /// A camera that sees all of it obliquely.
    fn overview(&self) -> PerspectiveCamera {
        PerspectiveCamera { orientation: AxisAngle::new(DVec3::X, 0.9), ..PerspectiveCamera::default() }
    }
}

const DETAILS: [DetailMode; 4] =
    [DetailMode::PixelError(1.0), DetailMode::PixelError(20.0), DetailMode::Precision(1.0), DetailMode::Full];

const SIZE: [u32; 2] = [64, 64];

fn action(size: [u32; 2]) -> RenderAction {
    RenderAction { background: Color::new(1.0, 0.0, 1.0), ..RenderAction::new(size[0], size[1]) }
}

/// Box, frame and picks of a ground through a camera at all kinds of detail.
fn check(name: &str, ground: &Ground, camera: impl Node + Clone) {
    check_in(name, ground, camera, SIZE);
}

fn check_in(name: &str, ground: &Ground, camera: impl Node + Clone, size: [u32; 2]) {
    for detail in DETAILS {
        check_at(name, ground, camera.clone(), size, detail);
    }
}

fn check_at(name: &str, ground: &Ground, camera: impl Node + Clone, size: [u32; 2], detail: DetailMode) {
    let name = format!("{name} at {detail:?}");
    let scene = ground.scene(camera.clone(), detail);
    let bounds = BoundingBoxAction::default().apply(&scene).unwrap();
    let frame = action(size).apply(&scene).unwrap_or_else(|error| panic!("{name}: {error}"));
    let field = ground.field();
    let Some(bounds) = bounds else {
        // All of it is hole.
        let samples = (0..field.rows()).flat_map(|r| (0..field.columns()).map(move |c| (c, r)));
        assert!({ samples }.all(|(c, r)| field.is_hole(c, r)), "{name} has no box");
        assert_eq!(frame.statistics.triangles, 0, "{name}");
        let ray = Ray::new(DVec3::new(7.3, 5.2, 1e6), DVec3::NEG_Z).unwrap();
        assert!(RayPickAction::ray(ray).apply(&scene).unwrap().is_empty(), "{name}");
        return;
    };
    assert!(bounds.min.is_finite() && bounds.max.is_finite(), "{name}: {bounds:?}");
    check_frame(&name, &frame);

    // Uncut, the mesh tiles the whole map.
    let uncut = Ground { terrain: SeamlessTerrain { culling: false, ..ground.terrain.clone() }, ..ground.clone() };
    let uncut = uncut.scene(camera, detail);
    let whole = action(size).apply(&uncut).unwrap();
    assert!(frame.statistics.triangles <= whole.statistics.triangles, "{name}");
    let Geometry::Terrain(draw) = &whole.draws[0].geometry else { panic!("{name} draws no terrain") };
    if !field.has_holes() {
        check_mesh(&name, draw);
    }
    check_picks(&name, ground, &scene, size);
}

fn check_frame(name: &str, frame: &Frame) {
    let loose = frame.draws.iter().filter(|draw| draw.effects.geometry.is_loose()).count();
    assert!(frame.draws.len() == 1 + loose && loose <= 1, "{name}");
    for draw in &frame.draws {
        assert!(draw.clip_from_rel.is_finite(), "{name}: {}", draw.clip_from_rel);
        assert!(draw.eye_from_rel.is_finite(), "{name}: {}", draw.eye_from_rel);
        assert!(draw.normal_from_rel.is_finite(), "{name}: {}", draw.normal_from_rel);
        let Geometry::Terrain(terrain) = &draw.geometry else { panic!("{name} draws no terrain") };
        let [columns, rows] = [terrain.heights.columns(), terrain.heights.rows()];
        assert!(terrain.anchor.0[0] < columns && terrain.anchor.0[1] < rows, "{name}: {:?}", terrain.anchor);
        assert!(terrain.anchor.1.is_finite(), "{name}");
        // No more than every cell of the map, filled up to whole patches.
        let r = terrain.parts.resolutions().max();
        let most = u64::from((columns - 1).next_multiple_of(r)) * u64::from((rows - 1).next_multiple_of(r)) * 2;
        assert!(draw.triangles() <= most, "{name}: {} triangles of {most}", draw.triangles());
    }
    let statistics = frame.statistics;
    assert!(statistics.patches_rendered + statistics.patches_culled <= statistics.patches_traversed, "{name}");
}

/// The triangles drawn tile the map: each inner edge belongs to two of them, in opposite directions; none is turned over.
fn check_mesh(name: &str, draw: &TerrainDraw) {
    let cells = [draw.heights.columns() - 1, draw.heights.rows() - 1];
    let mut edges: HashMap<([u32; 2], [u32; 2]), u32> = HashMap::new();
    let mut area = 0i64;
    for (part, instances) in draw.instances.ranges() {
        let triangles =
            &draw.parts.all_triangles()[draw.parts.range(*part).start as usize..][..draw.parts.range(*part).len()];
        for instance in &draw.instances.data()[instances.start as usize..instances.end as usize] {
            for triangle in triangles {
                let p: [[u32; 2]; 3] = triangle
                    .map(|p| [0, 1].map(|k| (instance.origin[k] + instance.step * u32::from(p[k])).min(cells[k])));
                let [a, b, c] = p.map(|p| p.map(i64::from));
                let doubled = (b[1] - a[1]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[1] - a[1]);
                assert!(doubled >= 0, "{name}: {p:?} is turned over");
                area += doubled;
                // Clamped to the border of the map a triangle may have no area: it draws nothing.
                if doubled > 0 {
                    for k in 0..3 {
                        *edges.entry((p[k], p[(k + 1) % 3])).or_default() += 1;
                    }
                }
            }
        }
    }
    assert_eq!(area, 2 * i64::from(cells[0]) * i64::from(cells[1]), "{name}: the mesh does not cover the map");
    for (&(a, b), &count) in &edges {
        let on_border = (0..2).any(|k| a[k] == b[k] && (a[k] == 0 || a[k] == cells[k]));
        let back = edges.get(&(b, a)).copied().unwrap_or(0);
        assert!(
            count == 1 && (back == 1 || on_border),
            "{name}: edge {a:?}..{b:?} is there {count} times, back {back}"
        );
    }
}

/// Rays through pixels and across the box: what they hit is finite, in the box, and as near to the surface as it says.
fn check_picks(name: &str, ground: &Ground, scene: &Scene, size: [u32; 2]) {
    let bounds = BoundingBoxAction::default().apply(scene).unwrap().unwrap();
    let extent = bounds.size().max_element();
    let (field, frame) = (ground.field(), ground.frame());
    let action = RayPickAction { all: true, ..RayPickAction::pixel(0, 0, size) };
    let picker = action.picker(scene).unwrap();
    let mut rays: Vec<Ray> = Vec::new();
    for (x, y) in [(0.5, 0.5), (0.0, 0.0), (1.0, 1.0), (0.25, 0.6), (0.75, 0.9), (0.4, 0.1)] {
        rays.push(picker.ray_through(x, y).unwrap());
    }
    let mut rng = Rng(5);
    for _ in 0..12 {
        let mut inside = || bounds.min + bounds.size() * DVec3::new(rng.unit(), rng.unit(), rng.unit());
        let (a, b) = (inside(), inside());
        if a != b {
            rays.push(Ray::new(a + (a - b) * 4.0, b - a).unwrap());
        }
    }
    rays.push(Ray::new(bounds.center() + DVec3::Z * extent, DVec3::NEG_Z).unwrap());
    for ray in rays {
        let hits = picker.pick(&ray, true).unwrap();
        for pair in hits.windows(2) {
            assert!(pair[0].distance <= pair[1].distance, "{name}");
        }
        for hit in &hits {
            let finite = hit.point.is_finite()
                && hit.normal.is_finite()
                && hit.object_point.is_finite()
                && hit.object_normal.is_finite()
                && hit.uv.is_finite()
                && hit.distance.is_finite();
            assert!(finite && hit.distance >= 0.0, "{name}: {hit:?}");
            assert!((hit.normal.length() - 1.0).abs() < 1e-9, "{name}: {hit:?}");
            let HitDetail::Terrain(detail) = &hit.detail else { panic!("{name}: {hit:?}") };
            // What rounding leaves: of the box's place and size, and of the way from the ray's origin.
            let reach =
                bounds.min.abs().max(bounds.max.abs()).max_element() + extent + (hit.point - ray.origin).length();
            let slack = 1e-12 * reach.max(ray.origin.length());
            let d = (bounds.min - hit.point).max(hit.point - bounds.max);
            assert!(d.max_element() <= slack, "{name}: {} is outside {bounds:?}", hit.point);
            let bound = hit.error_bound.expect("a bound");
            assert!(bound.is_finite() && bound >= 0.0, "{name}: {hit:?}");
            if !detail.wall && frame.z_step != 0.0 {
                let p = frame.lattice(hit.object_point);
                let [cu, cv] = frame.cells.map(f64::from);
                let raw = field.filled_surface(p.x.clamp(0.0, cu), p.y.clamp(0.0, cv)).unwrap();
                let off = (raw - p.z).abs() * frame.z_step.abs();
                // The steeper the ground, the more a rounded place matters.
                let shrink = ground.model().matrix3.inverse();
                let scale =
                    [shrink.x_axis, shrink.y_axis, shrink.z_axis].map(|a| a.length()).into_iter().fold(0.0, f64::max);
                let steep = 1.0 + frame.z_step.abs() * 65535.0 / frame.cell_size[0].min(frame.cell_size[1]);
                let slack = 1e-9 * (1.0 + off) + slack * scale * steep;
                assert!(off <= detail.error + slack, "{name}: {off} off, said to be at most {}", detail.error);
            }
        }
    }
}

/// The error of a scene that can not be drawn: the same from box, frame and pick.
fn refused(name: &str, scene: &Scene) -> ActionError {
    let frame = action(SIZE).apply(scene).expect_err(name);
    let pick = RayPickAction::pixel(0, 0, SIZE).apply(scene).expect_err(name);
    assert_eq!(frame.to_string(), pick.to_string(), "{name}");
    frame
}

mod heights {
    use super::*;

    #[test]
    fn all_equal() {
        ends(|| {
            for value in [0, 1, 30_000, 65_535] {
                let ground = Ground::new(70, 41, Pixels::Gray16(vec![value; 70 * 41]));
                let name = format!("all {value}");
                check(&name, &ground, ground.overview());
                // Without height there is nothing to gain from detail, wherever the eye is.
                let eye = DVec3::new(20.0, 20.0, 9.0);
                let camera = PerspectiveCamera { position: Some(eye), ..PerspectiveCamera::default() };
                let scene = ground.scene(camera, DetailMode::PixelError(0.0));
                assert!(action(SIZE).apply(&scene).unwrap().statistics.patches_traversed <= 16, "{name}");
            }
        });
    }

    #[test]
    fn a_spike_of_one_sample() {
        ends(|| {
            for at in [0, 16 * 33 + 16, 33 * 33 - 1, 12 * 33 + 7] {
                let mut samples = vec![0u16; 33 * 33];
                samples[at] = 65_535;
                let ground = Ground::new(33, 33, Pixels::Gray16(samples));
                check(&format!("spike at {at}"), &ground, ground.overview());
                // It is drawn up to its tip.
                let tip = DVec3::new((at % 33) as f64, (32 - at / 33) as f64, 8.0);
                let camera = PerspectiveCamera {
                    position: Some(tip + DVec3::new(3.0, -40.0, 6.0)),
                    look_at: Some(tip),
                    height_angle: 0.5,
                    ..PerspectiveCamera::default()
                };
                picture::matches(&format!("spike at {at}"), &ground, camera, [36, 36]);
            }
        });
    }

    #[test]
    fn walls_of_the_full_range() {
        ends(|| {
            for (name, high) in [
                ("columns", (|c, _| c % 2 == 0) as fn(u32, u32) -> bool),
                ("one wall", |c, _| c >= 7),
                ("chessboard", |c, r| (c + r) % 2 == 0),
                ("diagonal", |c, r| c > r),
            ] {
                let samples = (0..23 * 19).map(|i| if high(i % 23, i / 23) { 65_535 } else { 0 }).collect();
                let ground = Ground::new(23, 19, Pixels::Gray16(samples));
                check(name, &ground, ground.overview());
                picture::matches(name, &ground, ground.overview(), [36, 36]);
            }
        });
    }

    #[test]
    fn floats_that_are_no_numbers() {
        ends(|| {
            for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                let hill = |i: u32| ((i % 20) as f32 * 0.6).sin() + ((i / 20) as f32 * 0.5).cos() - 3.0;
                let samples = (0..20 * 20).map(|i| if i % 7 == 3 || (90..150).contains(&i) { bad } else { hill(i) });
                let ground = Ground::new(20, 20, Pixels::GrayF32(samples.collect()));
                assert!(ground.field().void_count() > 60);
                check(&bad.to_string(), &ground, ground.overview());
                picture::matches(&bad.to_string(), &ground, ground.overview(), [32, 32]);
            }
        });
    }

    #[test]
    fn floats_at_the_ends_of_their_range() {
        ends(|| {
            for size in [f32::MAX, 1e38, 1e30, 1e-30, f32::MIN_POSITIVE] {
                let samples = (0..9 * 9).map(|i| if i % 2 == 0 { size } else { -size }).collect();
                let mut ground = Ground::new(9, 9, Pixels::GrayF32(samples));
                // In units that make hills of them.
                ground.terrain.max_height = 1.0 / f64::from(size);
                // Differences of the largest do not exist as floats: such samples are void.
                assert_eq!(ground.field().void_count() > 0, size == f32::MAX);
                check(&size.to_string(), &ground, ground.overview());
            }
        });
    }

    fn with_voids(void: impl Fn(u32, u32) -> bool) -> Ground {
        let mut ground = Ground::hills();
        let Pixels::Gray16(samples) = ground.map.pixels() else { panic!("16 bits") };
        let samples =
            samples.iter().enumerate().map(|(i, &v)| if void(i as u32 % 25, i as u32 / 25) { 0 } else { v }).collect();
        ground.map = Arc::new(Image::new(25, 21, Pixels::Gray16(samples)).unwrap());
        ground.terrain.void_sample = Some(0.0);
        ground
    }

    #[test]
    fn voids() {
        ends(|| {
            type IsVoid = fn(u32, u32) -> bool;
            let cases: [(&str, IsVoid); 6] = [
                ("alone", |c, r| (c, r) == (11, 8)),
                ("in a corner", |c, r| (c, r) == (0, 0)),
                ("a block", |c, r| (5..14).contains(&c) && (6..17).contains(&r)),
                ("a ragged border", |c, r| c < 3 + (r * 7) % 4 || r > 17 - (c * 5) % 3),
                ("every other", |c, r| (c + r) % 2 == 1),
                ("all but one", |c, r| (c, r) != (24, 20)),
            ];
            for (name, void) in cases {
                let ground = with_voids(void);
                let field = ground.field();
                assert!(field.void_count() > 0, "{name}");
                // What is filled in stays within what surrounds it.
                let valid = |range: [f64; 2], (c, r)| {
                    if field.is_void(c, r) {
                        range
                    } else {
                        [range[0].min(field.raw(c, r)), range[1].max(field.raw(c, r))]
                    }
                };
                let all = || (0..21).flat_map(|r| (0..25).map(move |c| (c, r)));
                let [low, high] = all().fold([f64::INFINITY, f64::NEG_INFINITY], valid);
                assert!(all().all(|(c, r)| (low..=high).contains(&field.raw(c, r))), "{name}");
                check(name, &ground, ground.overview());
                picture::matches(name, &ground, ground.overview(), [32, 32]);
                let mut holes = ground;
                holes.terrain.voids = VoidMode::Hole;
                let name = format!("{name}, as holes");
                check(&name, &holes, holes.overview());
                picture::matches(&name, &holes, holes.overview(), [32, 32]);
            }
        });
    }

    #[test]
    fn nothing_but_voids() {
        ends(|| {
            let ground = with_voids(|_, _| true);
            assert_eq!(ground.field().void_count(), 25 * 21);
            check("all void", &ground, ground.overview());
            let floats = Ground::new(12, 9, Pixels::GrayF32(vec![f32::NAN; 12 * 9]));
            check("all NaN", &floats, floats.overview());
            for mut ground in [ground, floats] {
                ground.terrain.voids = VoidMode::Hole;
                check("nothing but a hole", &ground, ground.overview());
                let scene = ground.scene(ground.overview(), DetailMode::Full);
                assert_eq!(BoundingBoxAction::default().apply(&scene).unwrap(), None);
            }
        });
    }

    /// 8 bits make steps between plains: neighbours in one plane.
    #[test]
    fn terraces_of_8_bits() {
        ends(|| {
            let samples = (0..40 * 33).map(|i: u32| ((i % 40) / 6 * 30 + (i / 40) / 5 * 8) as u8).collect();
            let ground = Ground::new(40, 33, Pixels::Gray8(samples));
            check("terraces", &ground, ground.overview());
            picture::matches("terraces", &ground, ground.overview(), [36, 36]);
            // 8 bits become 16 exactly.
            let Samples::U16(samples) = ground.field().samples().clone() else { panic!("8 bits become 16") };
            assert!(samples.iter().all(|s| s % 257 == 0));
        });
    }

    #[test]
    fn no_surface_without_a_cell() {
        for (width, height) in [(1, 1), (1, 2), (2, 1), (1, 300), (300, 1), (0, 5), (0, 0)] {
            let count = (width * height) as usize;
            let mut ground = Ground::hills();
            ground.map = Arc::new(Image::new(width, height, Pixels::Gray16(vec![7; count])).unwrap());
            let scene = ground.scene(ground.overview(), DetailMode::PixelError(1.0));
            let error = refused("no cell", &scene);
            let ActionError::Shape { error: ShapeError::HeightField(error), .. } = &error else { panic!("{error:?}") };
            assert_eq!(*error, HeightFieldError::TooSmall { columns: width, rows: height });
            assert!(error.to_string().contains(&format!("at least 2 × 2 samples, this one has {width} × {height}")));
            assert!(BoundingBoxAction::default().apply(&scene).is_err());
        }
    }

    #[test]
    fn all_sizes_and_shapes() {
        ends(|| {
            let sizes = [
                (2, 2),
                (2, 3),
                (3, 2),
                (3, 5),
                (2, 100),
                (100, 2),
                (64, 64),
                (65, 65),
                (128, 129),
                (257, 257),
                (256, 17),
                (344, 403),
            ];
            for (width, height) in sizes {
                let mut rng = Rng(u64::from(width * 1000 + height));
                let samples = (0..width * height).map(|_| rng.bits() as u16).collect();
                let mut ground = Ground::new(width, height, Pixels::Gray16(samples));
                for resolutions in [(2, 2), (16, 3)] {
                    ground.terrain.resolutions = resolutions;
                    check(&format!("{width} × {height} with {resolutions:?}"), &ground, ground.overview());
                }
                if width * height < 600 {
                    picture::matches(&format!("{width} × {height}"), &ground, ground.overview(), [32, 32]);
                }
            }
        });
    }

    #[test]
    fn a_map_of_4097_by_4097() {
        ends(|| {
            let Samples::U16(samples) = generate(4097, 3).unwrap().samples().clone() else { panic!("16 bits") };
            let mut ground = Ground::new(4097, 4097, Pixels::Gray16(samples));
            ground.terrain.max_height = 300.0;
            ground.terrain.resolutions = (16, 3);
            let camera = PerspectiveCamera {
                position: Some(DVec3::new(2048.0, 100.0, 400.0)),
                look_at: Some(DVec3::new(2048.0, 3000.0, 0.0)),
                ..PerspectiveCamera::default()
            };
            // Once only, uncut: what it takes is the making of the error tree.
            ground.terrain.culling = false;
            let scene = ground.scene(camera, DetailMode::PixelError(1.0));
            let frame = action(SIZE).apply(&scene).unwrap();
            check_frame("4097²", &frame);
            let Geometry::Terrain(draw) = &frame.draws[0].geometry else { panic!("no terrain is drawn") };
            check_mesh("4097²", draw);
            assert!(frame.statistics.triangles < 4096 * 4096, "{:?}", frame.statistics);
            check_picks("4097²", &ground, &scene, SIZE);
        });
    }
}

mod placement {
    use super::*;

    fn scaled(factor: DVec3) -> Transform {
        Transform { scale_factor: factor, ..Transform::default() }
    }

    fn moved(by: DVec3) -> Transform {
        Transform { translation: by, ..Transform::default() }
    }

    fn turned(axis: DVec3, angle: f64) -> Transform {
        Transform { rotation: AxisAngle::new(axis, angle), ..Transform::default() }
    }

    #[test]
    fn scales_from_a_millionth_to_a_hundred_million() {
        ends(|| {
            for scale in [1e-6, 1e-3, 1.0, 1e4, 1e8] {
                let ground = Ground::hills().place(scaled(DVec3::splat(scale)));
                let name = format!("scale {scale}");
                check(&name, &ground, ground.overview());
                picture::matches(&name, &ground, ground.overview(), [32, 32]);
                // The same as a field of the node.
                let mut ground = Ground::hills();
                ground.terrain.size = None;
                ground.terrain.scale = scale;
                ground.terrain.max_height = scale * 0.3;
                check(&name, &ground, ground.overview());
                picture::matches(&name, &ground, ground.overview(), [32, 32]);
            }
        });
    }

    /// Flattened along an axis, or to a point: a picture of what is left, and no pick where there is no inside.
    #[test]
    fn scales_of_zero() {
        ends(|| {
            for factor in [DVec3::new(1.0, 1.0, 0.0), DVec3::new(0.0, 1.0, 1.0), DVec3::new(1.0, 0.0, 0.0), DVec3::ZERO]
            {
                let ground = Ground::hills().place(scaled(factor));
                let camera = PerspectiveCamera {
                    position: Some(DVec3::new(3.0, -20.0, 30.0)),
                    look_at: Some(DVec3::new(12.0, 10.0, 0.0)),
                    ..PerspectiveCamera::default()
                };
                check(&format!("scale {factor}"), &ground, camera.clone());
                check(&format!("scale {factor}"), &ground, ground.overview());
                picture::draw(&ground.scene(camera, DetailMode::PixelError(1.0)), [32, 32]);
            }
        });
    }

    #[test]
    fn no_height_by_the_node_itself() {
        ends(|| {
            let mut ground = Ground::hills();
            ground.terrain.max_height = 0.0;
            check("flat", &ground, ground.overview());
            picture::matches("flat", &ground, ground.overview(), [32, 32]);
        });
    }

    /// The ray's height in units of the relief is beyond f64: it was lost, or its point was NaN.
    #[test]
    fn next_to_no_height_by_the_node_itself() {
        for max_height in [1e-300, -1e-300, 1e-310, 5e-324, -5e-324] {
            for voids in [VoidMode::Fill, VoidMode::Hole] {
                let mut ground = Ground::hills();
                (ground.terrain.max_height, ground.terrain.voids) = (max_height, voids);
                let scene = ground.scene(ground.overview(), DetailMode::PixelError(1.0));
                let center = BoundingBoxAction::default().apply(&scene).unwrap().unwrap().center();
                for surface in [Surface::Coarse, Surface::Drawn, Surface::Exact] {
                    for aside in [DVec3::ZERO, DVec3::new(0.1, 0.02, 0.0)] {
                        let ray = Ray::new(center + DVec3::Z * 50.0 + 50.0 * aside, DVec3::NEG_Z - aside).unwrap();
                        let action = RayPickAction { surface, all: true, ..RayPickAction::ray(ray) };
                        let hits = action.apply(&scene).unwrap();
                        let name = format!("{max_height:e}, {surface:?}: {hits:?}");
                        let [hit] = &hits[..] else { panic!("{name}") };
                        assert!((hit.point - center).length() < 1e-12 * (1.0 + center.length()), "{name}");
                        assert!(matches!(hit.detail, HitDetail::Terrain(detail) if detail.entering), "{name}");
                    }
                }
            }
        }
    }

    /// The determinant is that of rounding, not zero: picks answered from an inverse of rounding.
    #[test]
    fn flattened_between_rotations() {
        let mut rng = Rng(8);
        for turn in [0.3, 1.1, 2.9] {
            let flat = Transform {
                rotation: AxisAngle::new(DVec3::new(1.0, 0.4, -0.7), turn),
                scale_factor: DVec3::new(2.5, 0.3, 0.0),
                scale_orientation: AxisAngle::new(DVec3::new(0.3, 0.5, 0.7), 0.9 * turn),
                ..Transform::default()
            };
            let ground = Ground::hills().place(flat);
            let scene = ground.scene(ground.overview(), DetailMode::PixelError(1.0));
            for surface in [Surface::Coarse, Surface::Drawn, Surface::Exact] {
                let picker = RayPickAction { surface, ..RayPickAction::pixel(0, 0, SIZE) }.picker(&scene).unwrap();
                for _ in 0..200 {
                    let mut place = || DVec3::new(rng.range(-9.0, 9.0), rng.range(-9.0, 9.0), rng.range(-9.0, 9.0));
                    let (from, to) = (place(), place());
                    let hits = picker.pick(&Ray::new(from, to - from).unwrap(), true).unwrap();
                    assert!(hits.is_empty(), "{surface:?} {turn}: {hits:?}");
                }
            }
        }
    }

    #[test]
    fn mirrored() {
        ends(|| {
            for factor in [
                DVec3::new(-1.0, 1.0, 1.0),
                DVec3::new(1.0, -1.0, 1.0),
                DVec3::new(-1.0, -1.0, 1.0),
                DVec3::new(1.0, 1.0, -1.0),
            ] {
                let ground = Ground::hills().place(scaled(factor));
                let name = format!("mirrored by {factor}");
                check(&name, &ground, ground.overview());
                picture::matches(&name, &ground, ground.overview(), [32, 32]);
            }
            let mut ground = Ground::hills();
            ground.terrain.max_height = -8.0;
            check("upside down", &ground, ground.overview());
            picture::matches("upside down", &ground, ground.overview(), [32, 32]);
        });
    }

    #[test]
    fn not_uniform_and_sheared() {
        ends(|| {
            let places = [
                ("long", vec![scaled(DVec3::new(50.0, 1.0, 1.0))]),
                ("thin", vec![scaled(DVec3::new(1.0, 1e-3, 1.0))]),
                ("high", vec![scaled(DVec3::new(1.0, 1.0, 40.0))]),
                ("sheared", vec![turned(DVec3::Z, 0.5), scaled(DVec3::new(3.0, 0.5, 1.0)), turned(DVec3::Z, -0.9)]),
                ("sheared up", vec![turned(DVec3::X, 0.4), scaled(DVec3::new(1.0, 2.5, 0.6)), turned(DVec3::Y, 0.3)]),
                (
                    "mirrored and sheared",
                    vec![turned(DVec3::ONE, 0.4), scaled(DVec3::new(-1.0, 2.5, 0.6)), turned(DVec3::Y, 0.3)],
                ),
            ];
            for (name, place) in places {
                let ground = Ground { place, ..Ground::hills() };
                check(name, &ground, ground.overview());
                picture::matches(name, &ground, ground.overview(), [32, 32]);
            }
            let mut ground = Ground::hills();
            ground.terrain.size = Some(DVec2::new(3000.0, 0.5));
            check("cells 120 × 0.025", &ground, ground.overview());
        });
    }

    /// f64 has room for more than a GPU can be told: that is said, while box and picks still answer.
    #[test]
    fn larger_than_floats() {
        for (scale, max_height) in [(1e60, 1.0), (1.0, 1e60), (1e-60, 1e100)] {
            let mut ground = Ground::hills().place(scaled(DVec3::splat(scale)));
            ground.terrain.max_height = max_height;
            let scene = ground.scene(ground.overview(), DetailMode::PixelError(1.0));
            let error = action(SIZE).apply(&scene).unwrap_err();
            assert!(matches!(error, ActionError::Shape { error: ShapeError::BeyondFloats, .. }), "{error}");
            check_picks("beyond floats", &ground, &scene, SIZE);
        }
    }

    #[test]
    fn far_from_the_origin() {
        ends(|| {
            for offset in [6.4e6, 1e7, 1.5e11] {
                for direction in [DVec3::X, DVec3::new(1.0, -1.0, 0.5), DVec3::NEG_Z] {
                    let ground = Ground::hills().place(moved(direction * offset)).place(scaled(DVec3::splat(100.0)));
                    let name = format!("{offset} along {direction}");
                    check(&name, &ground, ground.overview());
                    picture::matches(&name, &ground, ground.overview(), [32, 32]);
                }
            }
        });
    }
}

mod eye {
    use super::*;

    fn look(position: DVec3, at: DVec3) -> PerspectiveCamera {
        PerspectiveCamera { position: Some(position), look_at: Some(at), ..PerspectiveCamera::default() }
    }

    /// Height of the hills over a place, in their own units.
    fn surface(ground: &Ground, x: f64, y: f64) -> DVec3 {
        let frame = ground.frame();
        let p = frame.lattice(DVec3::new(x, y, 0.0));
        frame.local(p.with_z(ground.field().surface(p.x, p.y).unwrap()))
    }

    /// Places that the choice of detail divides by, or compares for equality: patches at resolutions (2, 3) are 8, 32 cells
    /// wide, from the north-west corner.
    #[test]
    fn over_sides_corners_centres_and_vertices() {
        ends(|| {
            let ground = Ground::hills();
            for (name, x, y) in [
                ("a side", 8.0, 17.3),
                ("a side", 5.3, 12.0),
                ("a corner", 8.0, 12.0),
                ("a patch's centre", 12.0, 16.0),
                ("a diagonal", 13.5, 14.5),
                ("the map's corner", 0.0, 20.0),
                ("the map's border", 24.0, 3.3),
                ("a vertex", 11.0, 7.0),
            ] {
                for above in [0.0, 1e-12, 1e-6, 0.3, 5.0] {
                    let eye = surface(&ground, x, y) + DVec3::Z * above;
                    for at in [DVec3::new(12.0, 10.1, 2.0), eye - DVec3::Z, DVec3::new(-30.0, 40.0, 3.0)] {
                        check(&format!("{above} above {name}, looking at {at}"), &ground, look(eye, at));
                    }
                    if above > 0.1 {
                        let camera = look(eye, DVec3::new(12.0, 10.1, 2.0));
                        picture::matches(&format!("{above} above {name}"), &ground, camera, [32, 32]);
                    }
                }
            }
        });
    }

    #[test]
    fn under_the_ground_and_beside_it() {
        ends(|| {
            let ground = Ground::hills();
            for (name, eye, at) in [
                ("under it, looking down", DVec3::new(12.0, 10.0, -5.0), DVec3::new(12.0, 10.0, -9.0)),
                ("under it, looking up", DVec3::new(12.0, 10.0, -5.0), DVec3::new(12.3, 10.0, 9.0)),
                ("under it, looking along", DVec3::new(12.0, 10.0, 1.0), DVec3::new(30.0, 11.0, 1.0)),
                ("beside it", DVec3::new(-15.0, 10.0, 1.0), DVec3::new(12.0, 10.0, 2.0)),
                ("beside it, looking away", DVec3::new(-15.0, 10.0, 1.0), DVec3::new(-40.0, 10.0, 2.0)),
            ] {
                check(name, &ground, look(eye, at));
                picture::matches(name, &ground, look(eye, at), [32, 32]);
            }
        });
    }

    #[test]
    fn a_billion_away() {
        ends(|| {
            let ground = Ground::hills();
            let middle = DVec3::new(12.0, 10.0, 3.0);
            for towards in [DVec3::Z, DVec3::new(1.0, -0.3, 0.5), DVec3::Y] {
                let camera = look(middle + towards * 1e9, middle);
                check("1e9 away", &ground, camera.clone());
                picture::draw(&ground.scene(camera, DetailMode::PixelError(1.0)), [32, 32]);
                let telescope = PerspectiveCamera { height_angle: 4e-8, ..look(middle + towards * 1e9, middle) };
                check("1e9 away through a telescope", &ground, telescope.clone());
                picture::matches("1e9 away through a telescope", &ground, telescope, [32, 32]);
            }
        });
    }

    /// Ground to the horizon: 10⁹ units wide, the eye 2 above it.
    #[test]
    fn above_an_infinite_horizon() {
        ends(|| {
            let mut ground = Ground::hills();
            ground.terrain.size = Some(DVec2::splat(1e9));
            ground.terrain.max_height = 0.0;
            for at in [DVec3::new(5e8, 6e8, 2.0), DVec3::new(5e8 + 10.0, 5e8 + 30.0, 0.0)] {
                let camera = look(DVec3::new(5e8, 5e8, 2.0), at);
                check("the horizon", &ground, camera.clone());
                picture::matches("the horizon", &ground, camera, [32, 32]);
            }
        });
    }

    #[test]
    fn fields_of_view_from_nothing_to_everything() {
        ends(|| {
            let ground = Ground::hills();
            let (eye, at) = (DVec3::new(3.0, -30.0, 20.0), DVec3::new(11.0, 11.0, 3.0));
            for degrees in [1e-3f64, 0.1, 1.0, 60.0, 120.0, 170.0, 179.0] {
                let camera = PerspectiveCamera { height_angle: degrees.to_radians(), ..look(eye, at) };
                let name = format!("{degrees}° of view");
                check(&name, &ground, camera.clone());
                picture::matches(&name, &ground, camera, [32, 32]);
                let inside = PerspectiveCamera {
                    height_angle: degrees.to_radians(),
                    ..look(DVec3::new(12.3, 9.0, 9.0), DVec3::new(12.0, 12.0, 3.0))
                };
                picture::matches(&name, &ground, inside, [32, 32]);
            }
            for angle in [0.0, -1.0, PI, 7.0, f64::NAN, f64::INFINITY] {
                let camera = PerspectiveCamera { height_angle: angle, ..look(eye, at) };
                let scene = ground.scene(camera, DetailMode::PixelError(1.0));
                let error = refused("angle", &scene);
                assert!(matches!(error, ActionError::Camera { .. }), "{angle}: {error}");
            }
        });
    }

    #[test]
    fn viewports_of_every_shape() {
        ends(|| {
            let ground = Ground::hills();
            for size in [[1, 1], [1, 4000], [16384, 16], [1, 16384], [16384, 1]] {
                check_in(&format!("{size:?}"), &ground, ground.overview(), size);
                // The camera fits the ground into the narrow side; its middle is ground, or some of it.
                #[cfg(feature = "render")]
                {
                    let picture = picture::draw(&ground.scene(ground.overview(), DetailMode::PixelError(1.0)), size);
                    assert_ne!(picture.pixel(size[0] / 2, size[1] / 2), Some([255, 0, 255]), "{size:?}");
                }
            }
            for size in [[0, 5], [5, 0], [0, 0]] {
                let error = action(size).apply(&ground.scene(ground.overview(), DetailMode::Full)).unwrap_err();
                assert!(matches!(error, ActionError::Viewport(..)), "{error}");
            }
        });
    }

    #[test]
    fn orthographic() {
        ends(|| {
            let ground = Ground::hills();
            for (tilt, height) in [(0.0, 30.0), (0.9, 30.0), (FRAC_PI_2, 30.0), (0.7, 1e-3), (1.2, 1e6), (PI, 30.0)] {
                let orientation = AxisAngle::new(DVec3::X, tilt);
                let back = orientation.quat().mul_vec3(DVec3::Z);
                let camera = OrthographicCamera {
                    position: Some(DVec3::new(12.0, 10.0, 3.0) + back * 60.0),
                    orientation,
                    height,
                    ..OrthographicCamera::default()
                };
                let name = format!("tilted by {tilt}, {height} high");
                check(&name, &ground, camera.clone());
                picture::matches(&name, &ground, camera, [32, 32]);
                let fitted = OrthographicCamera { orientation, ..OrthographicCamera::default() };
                check(&name, &ground, fitted.clone());
                picture::matches(&name, &ground, fitted, [32, 32]);
            }
        });
    }
}

mod detail {
    use super::*;

    fn rough() -> Ground {
        let mut rng = Rng(9);
        let samples = (0..130 * 97).map(|_| rng.bits() as u16).collect();
        Ground::new(130, 97, Pixels::Gray16(samples))
    }

    fn camera() -> PerspectiveCamera {
        PerspectiveCamera {
            position: Some(DVec3::new(20.0, 20.0, 12.0)),
            look_at: Some(DVec3::new(90.0, 70.0, 0.0)),
            ..PerspectiveCamera::default()
        }
    }

    fn triangles(ground: &Ground, detail: DetailMode) -> u64 {
        let mut ground = ground.clone();
        ground.terrain.culling = false;
        action(SIZE).apply(&ground.scene(camera(), detail)).unwrap().statistics.triangles
    }

    #[test]
    fn every_precision() {
        ends(|| {
            let ground = rough();
            let mut last = 0;
            for precision in [1e-3, 1e-2, 0.1, 0.5, 1.0, 2.0, 10.0, 100.0, 1e3] {
                check_at("ρ", &ground, camera(), SIZE, DetailMode::Precision(precision));
                let now = triangles(&ground, DetailMode::Precision(precision));
                assert!(now >= last, "{now} triangles at ρ = {precision}, {last} at less");
                last = now;
            }
            assert_eq!(last, triangles(&ground, DetailMode::Full));
            for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
                let error = refused("ρ", &ground.scene(camera(), DetailMode::Precision(bad)));
                assert!(error.to_string().contains("detail: a precision of"), "{error}");
            }
        });
    }

    #[test]
    fn every_tolerance() {
        ends(|| {
            let ground = rough();
            let mut last = u64::MAX;
            for tolerance in [0.0, 1e-9, 0.1, 1.0, 10.0, 1e3, 1e9, f64::MAX, f64::INFINITY] {
                check_at("τ", &ground, camera(), SIZE, DetailMode::PixelError(tolerance));
                let now = triangles(&ground, DetailMode::PixelError(tolerance));
                assert!(now <= last, "{now} triangles at τ = {tolerance}, {last} at less");
                last = now;
            }
            // Infinity allows every error there is: the roots at their coarsest. They are 32 cells wide.
            let coarsest = 2 * 2 * 2 * 130u64.div_ceil(32) * 97u64.div_ceil(32);
            assert!(last <= coarsest, "{last} triangles at τ = ∞, {coarsest} are enough");
            for bad in [-1.0, f64::NAN, f64::NEG_INFINITY] {
                let error = refused("τ", &ground.scene(camera(), DetailMode::PixelError(bad)));
                assert!(error.to_string().contains("detail: a pixel error of"), "{error}");
            }
        });
    }

    #[test]
    fn all_resolutions() {
        ends(|| {
            let mut ground = rough();
            for count in 0..=7 {
                for min in [0, 1, 2, 3, 4, 8, 16, 32, 48, 64, 128, 256, 512] {
                    ground.terrain.resolutions = (min, count);
                    let works = (2..=5).contains(&count)
                        && (2..=256).contains(&min)
                        && min.is_power_of_two()
                        && min << (count - 1) <= 512;
                    if works {
                        for detail in [DetailMode::PixelError(2.0), DetailMode::Precision(1.0), DetailMode::Full] {
                            check_at(&format!("({min}, {count})"), &ground, camera(), SIZE, detail);
                        }
                    } else {
                        let scene = ground.scene(camera(), DetailMode::PixelError(1.0));
                        let error = refused("resolutions", &scene);
                        assert!(error.to_string().contains("resolution"), "{error}");
                    }
                }
            }
        });
    }

    /// Complexity multiplies what is allowed by 4^(1 − 2·value): at its ends, and beyond.
    #[test]
    fn every_complexity() {
        ends(|| {
            let ground = rough();
            for value in [0.0, 0.5, 1.0, -1e3, 1e3] {
                for detail in [DetailMode::PixelError(1.0), DetailMode::PixelError(0.0), DetailMode::Precision(1.0)] {
                    let mut scene = ground.scene(camera(), detail);
                    let root = scene.root();
                    let complexity = scene.insert(Complexity { value, ..Complexity::default() });
                    scene.insert_child(root, 1, complexity).unwrap();
                    match action(SIZE).apply(&scene) {
                        Ok(frame) => check_frame(&format!("complexity {value}"), &frame),
                        Err(error) => assert!(error.to_string().contains("value"), "{error}"),
                    }
                }
            }
        });
    }

    #[test]
    fn fields_that_are_no_lengths() {
        for (field, change) in [
            ("scale", (|t, v| t.scale = v) as fn(&mut SeamlessTerrain, f64)),
            ("size", |t, v| t.size = Some(DVec2::new(1.0, v))),
            ("size", |t, v| t.size = Some(DVec2::new(v, 1.0))),
        ] {
            for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
                let mut ground = Ground::hills();
                change(&mut ground.terrain, bad);
                let error = refused(field, &ground.scene(ground.overview(), DetailMode::Full));
                assert!(error.to_string().contains(field), "{error}");
                assert!(ground.terrain.problems().iter().any(|p: &FieldProblem| p.field == field));
            }
        }
    }
}

/// Small pictures, judged by rays through every triangle of the full-resolution surface.
#[cfg(feature = "render")]
mod picture {
    use std::sync::{Mutex, OnceLock, PoisonError};

    use glam::DMat3;
    use seamount::action::{Lens, Viewpoint, intersect_triangle};
    use seamount::node::Triangle;
    use seamount::render::{Headless, Picture};

    use super::*;

    pub(super) fn draw(scene: &Scene, size: [u32; 2]) -> Picture {
        static HEADLESS: OnceLock<Mutex<Headless>> = OnceLock::new();
        let frame = action(size).apply(scene).unwrap();
        let made = HEADLESS.get_or_init(|| Mutex::new(Headless::new(None).unwrap_or_else(|error| panic!("{error}"))));
        made.lock().unwrap_or_else(PoisonError::into_inner).draw(&frame).unwrap()
    }

    /// Full resolution and at most half a pixel away from it: pixels that see ground all around are ground, those that see
    /// none around are background.
    pub(super) fn matches(name: &str, ground: &Ground, camera: impl Node + Clone, size: [u32; 2]) {
        let view = action(size).viewpoint(&ground.scene(camera.clone(), DetailMode::Full)).unwrap();
        let judge = Judge::new(ground, view);
        // Corners, middles of sides and centres of all pixels.
        let (columns, rows) = (2 * size[0] + 1, 2 * size[1] + 1);
        let seen: Vec<Seen> = (0..columns * rows)
            .map(|k| {
                judge.sees(
                    f64::from(k % columns) / 2.0 / f64::from(size[0]),
                    f64::from(k / columns) / 2.0 / f64::from(size[1]),
                )
            })
            .collect();
        for (detail, reach) in [(DetailMode::Full, 1), (DetailMode::PixelError(0.5), 2)] {
            let picture = draw(&ground.scene(camera.clone(), detail), size);
            let mut certain = 0;
            for (x, y) in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y))) {
                let pixel = picture.pixel(x, y).unwrap();
                let range = |at: u32, last: u32| (2 * at).saturating_sub(reach)..=(2 * at + 2 + reach).min(2 * last);
                let around = |what: Seen| {
                    range(y, size[1]).all(|b| range(x, size[0]).all(|a| seen[(b * columns + a) as usize] == what))
                };
                let (expected, what) = match (around(Seen::Ground), around(Seen::Sky)) {
                    (true, _) => ([255; 3], Seen::Ground),
                    (_, true) => ([255, 0, 255], Seen::Sky),
                    _ => continue,
                };
                certain += 1;
                // What is thinner than half a pixel the rays may have missed: look closer before complaining.
                if pixel != expected && judge.all_around(x, y, size, f64::from(reach) * 0.5, what) {
                    panic!("{name} at {detail:?}: pixel ({x}, {y}) is {pixel:?} where all rays see {what:?}");
                }
            }
            assert!(certain > 0, "{name}: nothing is certain");
        }
    }

    #[derive(Debug, Clone, Copy, PartialEq)]
    enum Seen {
        Ground,
        Sky,
        /// The ray runs along a triangle, or meets one close to the near plane: rounding decides.
        Unsure,
    }

    /// Casts rays at every triangle of the full-resolution surface, in local coordinates.
    struct Judge {
        triangles: Vec<Triangle>,
        model: DAffine3,
        inverse: DMat3,
        view: Viewpoint,
    }

    impl Judge {
        fn new(ground: &Ground, view: Viewpoint) -> Self {
            let model = ground.model();
            Self { triangles: triangles(ground), model, inverse: model.matrix3.inverse(), view }
        }

        /// What is at a point of the picture, (0, 0) top left to (1, 1) bottom right.
        fn sees(&self, x: f64, y: f64) -> Seen {
            let Viewpoint { lens, near, far, forward, .. } = self.view;
            let (origin, direction) = self.view.ray(x, y);
            let slant = match lens {
                Lens::Perspective { .. } => direction.dot(forward),
                Lens::Orthographic { .. } => 1.0,
            };
            // The translation is subtracted first: far from the origin the digits are there.
            let ray = Ray {
                origin: self.inverse * (origin - self.model.translation),
                direction: self.inverse * direction,
                near: near / slant,
                far: far.map_or(f64::INFINITY, |far| far / slant),
            };
            let mut found = Seen::Sky;
            for triangle in &self.triangles {
                if let Some(hit) = intersect_triangle(&ray, triangle) {
                    // Only the upper side is drawn.
                    let steep = ray.direction.dot(triangle.normals[0]) / ray.direction.length();
                    if steep.abs() < 1e-4 || hit.t < 1.01 * ray.near {
                        found = Seen::Unsure;
                    } else if steep < 0.0 {
                        return Seen::Ground;
                    }
                }
            }
            found
        }

        fn all_around(&self, x: u32, y: u32, size: [u32; 2], reach: f64, what: Seen) -> bool {
            const N: u32 = 40;
            let at = |from: u32, k: u32, size: u32| {
                let pixels = f64::from(from) - reach + (1.0 + 2.0 * reach) * f64::from(k) / f64::from(N);
                pixels / f64::from(size)
            };
            (0..=N).all(|j| (0..=N).all(|i| self.sees(at(x, i, size[0]), at(y, j, size[1])) == what))
        }
    }

    /// The full-resolution surface in local coordinates.
    fn triangles(ground: &Ground) -> Vec<Triangle> {
        let (field, frame) = (ground.field(), ground.frame());
        let [cu, cv] = frame.cells;
        let p = |c: u32, r: u32| frame.local(DVec3::new(c.into(), r.into(), field.raw(c, r)));
        let mut triangles = Vec::new();
        for (c, r) in (0..cv).flat_map(|r| (0..cu).map(move |c| (c, r))) {
            let (nw, ne, se, sw) = (p(c, r), p(c + 1, r), p(c + 1, r + 1), p(c, r + 1));
            for (points, upper) in [([nw, se, ne], true), ([nw, sw, se], false)] {
                if !field.is_ground([c, r], upper) {
                    continue;
                }
                let normal = (points[1] - points[0]).cross(points[2] - points[0]).normalize();
                triangles.push(Triangle { points, normals: [normal; 3], ..Triangle::default() });
            }
        }
        triangles
    }
}

/// Without a GPU the frames alone are judged.
#[cfg(not(feature = "render"))]
mod picture {
    use super::*;

    pub(super) fn draw(scene: &Scene, size: [u32; 2]) -> Frame {
        action(size).apply(scene).unwrap()
    }

    pub(super) fn matches(_: &str, _: &Ground, _: impl Node + Clone, _: [u32; 2]) {}
}
