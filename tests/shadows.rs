//! Shadows of a terrain on itself: the map of shadow heights against its definition, against rays, and in pictures.

mod common;

use common::Rng;
use seamount::prelude::*;
use seamount::terrain::pick::LatticeRay;
use seamount::terrain::{ExactSurface, HeightField, LatticeLight, MinMaxPyramid, Samples, ShadowMap, Voids, generate};

/// A light's azimuth as the map sees it: one cell along the longer axis towards the light.
#[derive(Debug, Clone, Copy)]
struct Step {
    d: DVec2,
    climb: f64,
}

impl Step {
    fn new(light: &LatticeLight) -> Self {
        let along = light.towards.x.abs().max(light.towards.y.abs());
        Self { d: light.towards.truncate() / along, climb: light.towards.z / along }
    }

    /// The two points next to a sample on lines through whole rows (or columns) of the border away from the light, and the
    /// shares they have in the sample.
    fn beside(&self, field: &HeightField, c: u32, r: u32) -> [(DVec2, f64); 2] {
        let [last_u, last_v] = field.cells();
        let along_u = self.d.x.abs() >= self.d.y.abs();
        let (p, last, sign, k) =
            if along_u { (c, last_u, self.d.x, self.d.y) } else { (r, last_v, self.d.y, self.d.x) };
        let steps = if sign > 0.0 { p } else { last - p };
        let j = if along_u { r } else { c };
        let q = f64::from(j) - k * f64::from(steps);
        let share = q - q.floor();
        [(-share, 1.0 - share), (1.0 - share, share)].map(|(off, share)| {
            let (p, j) = (f64::from(p), f64::from(j) + off);
            (if along_u { DVec2::new(p, j) } else { DVec2::new(j, p) }, share)
        })
    }
}

/// The shadow height of a point by its definition: over all triangles of the ground, clipped to the ray from one step on.
fn shadow_height(field: &HeightField, step: Step, from: DVec2) -> f64 {
    let [cells_u, cells_v] = field.cells();
    let mut highest = f64::NEG_INFINITY;
    for (c, r) in (0..cells_v).flat_map(|r| (0..cells_u).map(move |c| (c, r))) {
        for upper in [true, false].into_iter().filter(|&upper| field.is_ground([c, r], upper)) {
            let (x, y) = (from.x - f64::from(c), from.y - f64::from(r));
            // Each side as a linear function along the ray that is at least 0 inside.
            let (dx, dy) = (step.d.x, step.d.y);
            let sides = if upper {
                [(1.0 - x, -dx), (x - y, dx - dy), (y, dy)]
            } else {
                [(x, dx), (y - x, dy - dx), (1.0 - y, -dy)]
            };
            let (mut near, mut far) = (1.0, f64::INFINITY);
            for (at, slope) in sides {
                if slope > 0.0 {
                    near = f64::max(near, -at / slope);
                } else if slope < 0.0 {
                    far = f64::min(far, -at / slope);
                } else if at < 0.0 {
                    far = f64::NEG_INFINITY;
                }
            }
            if near > far {
                continue;
            }
            let (h00, h11) = (field.raw(c, r), field.raw(c + 1, r + 1));
            for t in [near, far] {
                let (fu, fv) = (x + t * dx, y + t * dy);
                let height = if upper {
                    let h10 = field.raw(c + 1, r);
                    h00 + fu * (h10 - h00) + fv * (h11 - h10)
                } else {
                    let h01 = field.raw(c, r + 1);
                    h00 + fv * (h01 - h00) + fu * (h11 - h01)
                };
                highest = highest.max(height - t * step.climb);
            }
        }
    }
    highest
}

/// Directions along both axes, along diagonals and between; climbs from the zenith to below the horizon, for a relief.
fn lights(rng: &mut Rng, relief: f64, cells: f64) -> Vec<LatticeLight> {
    let mut azimuths = vec![];
    for (u, v) in [(1.0, 0.0), (1.0, 1.0), (0.5, 1.0), (0.25, -1.0)] {
        azimuths.extend([(u, v), (-v, u), (-u, -v), (v, -u)]);
    }
    azimuths.extend((0..6).map(|_| (rng.range(-1.0, 1.0), rng.range(-1.0, 1.0))));
    let climb = relief / cells;
    azimuths
        .into_iter()
        .enumerate()
        .map(|(k, (u, v))| {
            let climb = climb * [2.0, 0.5, 5.0, 0.0, 30.0, -0.5, 1.0][k % 7];
            LatticeLight { towards: DVec3::new(u, v, climb), upwards: true }
        })
        .collect()
}

fn relief(field: &HeightField) -> [f64; 2] {
    MinMaxPyramid::new(field).full_range()
}

/// Every sample of small maps, with and without holes.
#[test]
fn shadow_heights_are_those_of_the_definition() {
    let mut rng = Rng(11);
    let (mut compared, mut cast) = (0, 0);
    for (columns, rows) in [(2, 2), (3, 7), (9, 9), (12, 5), (2, 9)] {
        for holes in [false, true] {
            let samples = (0..columns * rows)
                .map(|_| if holes && rng.below(6) == 0 { 0 } else { 1 + rng.below(1000) as u16 })
                .collect();
            let mut field =
                HeightField::from_u16(columns, rows, samples, Voids { sample: holes.then_some(0.0) }).unwrap();
            if holes {
                field = field.with_holes();
            }
            let [low, high] = relief(&field);
            for light in lights(&mut rng, high - low, f64::from(columns.max(rows) - 1)) {
                let map = ShadowMap::new(&field, &light);
                let step = Step::new(&light);
                let unit = high - low + step.climb.abs();
                for (c, r) in (0..rows).flat_map(|r| (0..columns).map(move |c| (c, r))) {
                    let height: f64 = step
                        .beside(&field, c, r)
                        .into_iter()
                        .filter(|(_, share)| *share > 0.0)
                        // Ground that is lower than all of the map shades nothing, however low it is.
                        .map(|(point, share)| share * shadow_height(&field, step, point).max(low - unit))
                        .sum();
                    let want = (height - field.raw(c, r)) / unit;
                    let got = map.depth(c.into(), r.into());
                    // Rounding to f32, and of heights and climbs in f64.
                    let near = 1e-7 * (1.0 + want.abs());
                    assert!(
                        (got - want).abs() <= near,
                        "{columns} × {rows}, {light:?}, ({c}, {r}): {got} is not {want}"
                    );
                    compared += 1;
                    cast += u32::from(got > 0.0);
                }
            }
        }
    }
    println!("{cast} of {compared} samples in shadow");
    assert!(cast * 10 > compared && cast * 10 < compared * 9);
}

/// Whether ground a step or more away is in the light's way to a place, by exact rays from all points that a depth is
/// interpolated from, at the height of the place; `None` where they do not agree.
fn by_rays(surface: &ExactSurface<'_>, step: Step, u: f64, v: f64) -> Option<bool> {
    let field = surface.field;
    let direction = step.d.extend(step.climb);
    let height = field.surface(u, v)?;
    // A step on the ray may be in the ground already.
    let blocked = |point: DVec2| {
        let origin = point.extend(height) + direction;
        let ray = LatticeRay { origin, direction, near: 0.0, far: f64::INFINITY };
        field.surface(origin.x, origin.y).is_some_and(|ground| ground > origin.z) || surface.first(&ray).is_some()
    };
    let (c, r) = (u as u32, v as u32);
    let third = if u - f64::from(c) >= v - f64::from(r) { (c + 1, r) } else { (c, r + 1) };
    let around = [(c, r), third, (c + 1, r + 1)].into_iter().flat_map(|(c, r)| step.beside(field, c, r));
    let own = blocked(DVec2::new(u, v));
    around.filter(|(_, share)| *share > 0.0).all(|(point, _)| blocked(point) == own).then_some(own)
}

/// Random places of maps, light from all sides: where the rays from all points that a depth is interpolated from agree (the
/// others are the band of doubt, within a cell of a shadow's border), the map says what they say.
#[test]
fn what_lies_in_shadow_sees_no_light_by_exact_rays() {
    let mut rng = Rng(5);
    let fuji = Image::open(std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/fuji.png")))
        .unwrap()
        .height_field(Some(0.0))
        .unwrap();
    let rough = (0..65 * 33).map(|_| rng.below(3000) as u16).collect();
    let ridges = (0..129 * 129).map(|i| (1.0 + (f64::from(i % 129 + i / 258) * 0.2).sin()) as f32 * 40.0).collect();
    let fields = [
        ("fuji", fuji),
        ("generated", generate(257, 3).unwrap()),
        ("rough", HeightField::from_u16(65, 33, rough, Voids::default()).unwrap()),
        ("ridges", HeightField::from_f32(129, 129, ridges, Voids::default()).unwrap()),
    ];
    for (name, field) in fields {
        let pyramid = MinMaxPyramid::new(&field);
        let surface = ExactSurface { field: &field, pyramid: &pyramid };
        let [low, high] = pyramid.full_range();
        let [cu, cv] = field.cells().map(f64::from);
        let (mut sure, mut dark, mut asked, mut own) = (0, 0, 0, 0);
        // So low that a mountain's shadow is a tenth of the map long.
        let lights = lights(&mut rng, high - low, cu.min(cv) * 0.1);
        // Level rays over level ground touch it, which is no crossing but at the border of the map.
        for light in lights.into_iter().filter(|light| light.towards.z != 0.0) {
            let map = ShadowMap::new(&field, &light);
            let step = Step::new(&light);
            let direction = step.d.extend(step.climb);
            for _ in 0..40 {
                let (u, v) = (rng.range(0.0, cu), rng.range(0.0, cv));
                asked += 1;
                if let Some(own_ray) = by_rays(&surface, step, u, v) {
                    assert_eq!(map.is_shadowed(u, v), own_ray, "{name}, {light:?} at ({u}, {v})");
                    sure += 1;
                    dark += u32::from(own_ray);
                    // Only ground within a step can be in the way of what the map takes for lit: that is told by the normal.
                    let start = DVec3::new(u, v, field.surface(u, v).unwrap()) + direction * 1e-6;
                    let ray = LatticeRay { origin: start, direction, near: 0.0, far: f64::INFINITY };
                    own += u32::from(!own_ray && surface.first(&ray).is_some());
                }
            }
        }
        println!(
            "{name}: {asked} places, {sure} beyond doubt, {dark} of them dark; {own} shaded by their own slope alone"
        );
        assert!(sure * 10 > asked * 6, "{name}: {sure} of {asked} beyond doubt");
        assert!(dark * 20 > sure && dark * 20 < sure * 19, "{name}: {dark} of {sure} dark");
    }
}

/// Heights that run down are the same ground as their negatives that run up.
#[test]
fn shadows_do_not_ask_which_way_heights_run() {
    let field = generate(65, 2).unwrap();
    let Samples::U16(samples) = field.samples() else { panic!("16 bits") };
    let down = samples.iter().map(|s| 65_535 - s).collect();
    let down = HeightField::from_u16(65, 65, down, Voids::default()).unwrap();
    let towards = DVec3::new(0.8, -0.3, 900.0);
    let up = ShadowMap::new(&field, &LatticeLight { towards, upwards: true });
    let down = ShadowMap::new(&down, &LatticeLight { towards: towards * DVec3::new(1.0, 1.0, -1.0), upwards: false });
    assert!(up.depths().iter().zip(down.depths()).all(|(a, b)| (a - b).abs() < 1e-6));
    assert!(up.depths().iter().any(|&d| d > 0.0));
}

/// Light that no shadow can be told of throws none, and nothing breaks.
#[test]
fn vertical_and_extreme_light_leaves_no_shadow_and_no_nan() {
    let field = generate(33, 1).unwrap();
    for z in [1.0, -1.0, 0.0, 1e300, f64::MIN_POSITIVE] {
        for (u, v) in [(0.0, 0.0), (-0.0, 1e-300), (f64::MIN_POSITIVE, -f64::MIN_POSITIVE), (1e300, 1.0)] {
            for upwards in [true, false] {
                let map = ShadowMap::new(&field, &LatticeLight { towards: DVec3::new(u, v, z), upwards });
                assert!(map.depths().iter().all(|d| d.is_finite()), "({u}, {v}, {z})");
                if u == 0.0 && v == 0.0 {
                    assert!(map.depths().iter().all(|&d| d < 0.0));
                }
            }
        }
    }
}

#[cfg(feature = "render")]
mod pictures {
    use super::*;
    use crate::common::gpu::{headless, linear};

    const SIZE: [u32; 2] = [120, 120];

    struct Ground {
        scene: Scene,
        map: NodeKey,
        light: NodeKey,
        terrain: NodeKey,
    }

    /// Ground of 400 × 400 seen from straight above, by one light and nothing else: what lies in shadow is black.
    fn ground(direction: DVec3, shadow: bool) -> Ground {
        let field = generate(65, 4).unwrap();
        let Samples::U16(samples) = field.samples() else { panic!("16 bits") };
        let image = Image::new(65, 65, Pixels::Gray16(samples.clone())).unwrap();
        let mut scene = Scene::new();
        let root = scene.root();
        let (position, look_at) = (Some(DVec3::new(200.0, 200.0, 500.0)), Some(DVec3::new(200.0, 200.0, 0.0)));
        scene.add(root, OrthographicCamera { position, look_at, height: 380.0, ..Default::default() }).unwrap();
        scene.add(root, Environment { ambient_color: Color::BLACK, ..Default::default() }).unwrap();
        let light = scene.add(root, DirectionalLight { direction, shadow, ..Default::default() }).unwrap();
        let map = scene.add(root, Texture2::from_image(image)).unwrap();
        let terrain =
            SeamlessTerrain { scale: 400.0, max_height: 120.0, detail: DetailMode::Full, ..Default::default() };
        let terrain = scene.add(root, terrain).unwrap();
        Ground { scene, map, light, terrain }
    }

    fn frame(scene: &Scene) -> seamount::action::Frame {
        RenderAction::new(SIZE[0], SIZE[1]).apply(scene).unwrap()
    }

    /// By rays in world coordinates: black on the lee side, and as without shadows elsewhere.
    #[test]
    fn pictures_are_dark_where_rays_meet_ground_and_nowhere_else() {
        let direction = DVec3::new(1.0, 0.4, -0.35);
        let (plain, shaded) = (ground(direction, false), ground(direction, true));
        let mut gpu = linear();
        let (plain, picture) = (gpu.draw(&frame(&plain.scene)), gpu.draw(&frame(&shaded.scene)));
        let action = RayPickAction { surface: Surface::Exact, ..RayPickAction::pixel(0, 0, SIZE) };
        let picker = action.picker(&shaded.scene).unwrap();
        // 64 cells of 6.25, rows to the south, heights of up to 120.
        let towards = -direction * DVec3::new(1.0, -1.0, 65_535.0 / 120.0 * 6.25);
        let step = Step::new(&LatticeLight { towards, upwards: true });
        let field = generate(65, 4).unwrap();
        let surface = ExactSurface { field: &field, pyramid: &MinMaxPyramid::new(&field) };
        let (mut dark, mut light) = (0, 0);
        for (x, y) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))) {
            let at = |p: u32| (f64::from(p) + 0.5) / 120.0;
            let ray = picker.ray_through(at(x), at(y)).unwrap();
            let point = picker.pick(&ray, false).unwrap().into_iter().next().unwrap().point;
            let Some(own) = by_rays(&surface, step, point.x / 6.25, 64.0 - point.y / 6.25) else { continue };
            if own {
                assert_eq!(picture.at(x, y)[0], 0.0, "({x}, {y}) lies in shadow");
                dark += 1;
            } else {
                let (got, want) = (picture.at(x, y)[0], plain.at(x, y)[0]);
                // Two shaders, whose rounding may differ by a step of half floats.
                assert!((got - want).abs() <= want * 2e-3, "({x}, {y}) is lit: {got} is not {want}");
                light += 1;
            }
        }
        println!("{dark} dark and {light} lit pixels of {}", SIZE[0] * SIZE[1]);
        assert!(dark > 1000 && light > 1000, "{dark} dark and {light} lit");
    }

    /// The same ground under transforms, seen and lit in its own coordinates from where it was, so that of each much is in shadow.
    fn placed(model: DAffine3, shadow: bool) -> Scene {
        let plain = ground(DVec3::ZERO, false);
        let mut scene = plain.scene;
        let root = scene.root();
        let place = |local: DVec3| Some(model.transform_point3(local));
        let (position, look_at) = (place(DVec3::new(200.0, 200.0, 500.0)), place(DVec3::new(200.0, 200.0, 0.0)));
        let height = 300.0 * model.matrix3.determinant().abs().cbrt();
        let camera = scene.children(root)[0];
        *scene.edit::<OrthographicCamera>(camera).unwrap() =
            OrthographicCamera { position, look_at, height, ..Default::default() };
        let direction = model.transform_vector3(DVec3::new(1.0, 0.4, -0.35));
        *scene.edit::<DirectionalLight>(plain.light).unwrap() =
            DirectionalLight { direction, shadow, ..Default::default() };
        let at = scene.children(root).len() - 1;
        let (x, y, z) = (model.matrix3.x_axis, model.matrix3.y_axis, model.matrix3.z_axis);
        let matrix = scene.insert(MatrixTransform { matrix: (x, y, z, model.translation).into() });
        scene.insert_child(root, at, matrix).unwrap();
        scene
    }

    /// Turned, scaled, mirrored and sheared ground: each pixel by rays in the world, which know nothing of cells.
    #[test]
    fn shadows_under_transforms_are_those_of_rays_in_the_world() {
        let turned = DAffine3::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 1.1);
        let moved = DAffine3::from_translation(DVec3::new(-300.0, 70.0, 20.0));
        let scaled = DAffine3::from_scale(DVec3::new(2.0, 0.5, 1.5));
        let mirrored = |x, y, z| DAffine3::from_scale(DVec3::new(x, y, z));
        let mut sheared = DAffine3::IDENTITY;
        sheared.matrix3.y_axis = DVec3::new(0.4, 1.0, 0.2);
        sheared.matrix3.z_axis = DVec3::new(-0.3, 0.1, 1.0);
        let models = [
            ("turned", turned),
            ("scaled", scaled),
            ("mirrored west to east", mirrored(-1.0, 1.0, 1.0)),
            ("mirrored north to south", mirrored(1.0, -1.0, 1.0)),
            ("upside down", mirrored(1.0, 1.0, -1.0)),
            ("mirrored three times", mirrored(-1.0, -1.0, -1.0)),
            ("sheared", sheared),
            ("all of it", moved * turned * mirrored(-1.0, 1.0, 1.0) * sheared * scaled),
        ];
        let field = generate(65, 4).unwrap();
        for (name, model) in models {
            let (plain, shaded) = (placed(model, false), placed(model, true));
            let mut gpu = linear();
            let (plain, picture) = (gpu.draw(&frame(&plain)), gpu.draw(&frame(&shaded)));
            drop(gpu);
            let action = RayPickAction { surface: Surface::Exact, ..RayPickAction::pixel(0, 0, SIZE) };
            let picker = action.picker(&shaded).unwrap();
            let towards = -model.transform_vector3(DVec3::new(1.0, 0.4, -0.35));
            // One cell along the longer axis.
            let along = towards * 6.25;
            let step = Step::new(&LatticeLight { towards: DVec3::new(-1.0, 0.4, 0.35), upwards: true });
            let blocked = |local: DVec3| {
                let origin = model.transform_point3(local) + along;
                let ray = Ray::new(origin, towards).unwrap();
                // A ray that starts in the ground comes out of it.
                !picker.pick(&ray, false).unwrap().is_empty()
            };
            let (mut dark, mut light) = (0, 0);
            for (x, y) in (0..SIZE[1]).step_by(2).flat_map(|y| (0..SIZE[0]).step_by(2).map(move |x| (x, y))) {
                let at = |p: u32| (f64::from(p) + 0.5) / 120.0;
                let ray = picker.ray_through(at(x), at(y)).unwrap();
                let Some(hit) = picker.pick(&ray, false).unwrap().into_iter().next() else { continue };
                // The place, and the points that its depth of shadow is interpolated from, at its height.
                let place = hit.object_point;
                let (u, v) = (place.x / 6.25, 64.0 - place.y / 6.25);
                let (c, r) = (u as u32, v as u32);
                let third = if u - f64::from(c) >= v - f64::from(r) { (c + 1, r) } else { (c, r + 1) };
                let around = [(c, r), third, (c + 1, r + 1)].into_iter().flat_map(|(c, r)| step.beside(&field, c, r));
                let own = blocked(place);
                let agree = around
                    .filter(|(_, share)| *share > 0.0)
                    .all(|(point, _)| blocked(DVec3::new(point.x * 6.25, (64.0 - point.y) * 6.25, place.z)) == own);
                if !agree {
                    continue;
                }
                if own {
                    assert_eq!(picture.at(x, y)[0], 0.0, "{name}: ({x}, {y}) lies in shadow");
                    dark += 1;
                } else {
                    let (got, want) = (picture.at(x, y)[0], plain.at(x, y)[0]);
                    // Two shaders, whose rounding may differ by a step of half floats.
                    assert!((got - want).abs() <= want * 2e-3, "{name}: ({x}, {y}) is lit: {got} is not {want}");
                    light += 1;
                }
            }
            println!("{name}: {dark} dark and {light} lit pixels");
            assert!(dark > 200 && light > 200, "{name}: {dark} dark and {light} lit");
        }
    }

    /// Seen from straight above a pixel shows the same place whatever the triangles.
    #[test]
    fn shadows_stay_when_detail_changes() {
        let mut ground = ground(DVec3::new(1.0, 0.4, -0.35), true);
        let full = linear().draw(&frame(&ground.scene));
        ground.scene.edit::<SeamlessTerrain>(ground.terrain).unwrap().detail = DetailMode::PixelError(40.0);
        let coarse = frame(&ground.scene);
        assert!(coarse.statistics.triangles < 2 * 64 * 64 / 10, "{}", coarse.statistics.triangles);
        let coarse = linear().draw(&coarse);
        for (x, y) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))) {
            let (a, b) = (full.at(x, y)[0], coarse.at(x, y)[0]);
            // Places are interpolated in f32 over other triangles.
            assert!((a - b).abs() < 5e-3, "({x}, {y}): {a} and {b}");
        }
    }

    /// A renderer that has drawn other shadows draws what a new one does, in the memory of the first.
    #[test]
    fn moved_lights_and_edited_heights_move_shadows() {
        let mut ground = ground(DVec3::new(1.0, 0.4, -0.35), true);
        let mut gpu = headless();
        let first = gpu.draw(&frame(&ground.scene)).unwrap();
        let mut last = first.rgba;
        let mut differ = |ground: &Ground, gpu: &mut seamount::render::Headless| {
            let drawn = gpu.draw(&frame(&ground.scene)).unwrap();
            let fresh = seamount::render::Headless::new(None).unwrap().draw(&frame(&ground.scene)).unwrap();
            assert!(drawn.rgba == fresh.rgba);
            assert!(drawn.rgba != last);
            last = drawn.rgba;
            drawn.report
        };
        let mut turned = Vec::new();
        for k in 1..4 {
            ground.scene.edit::<DirectionalLight>(ground.light).unwrap().direction.y = -f64::from(k);
            turned.push(differ(&ground, &mut gpu).gpu_bytes);
        }
        assert!(turned.iter().all(|&bytes| bytes == first.report.gpu_bytes), "{turned:?}");
        // The same frame again sends no map.
        let again = gpu.draw(&frame(&ground.scene)).unwrap().report;
        assert!(again.bytes_uploaded < 65 * 65 * 4, "{again:?}");
        let wall = Pixels::Gray16(vec![65_535; 20 * 5]);
        let rect = seamount::terrain::SampleRect { column: 20, row: 30, columns: 20, rows: 5 };
        ground.scene.set_heights(ground.map, rect, &wall).unwrap();
        differ(&ground, &mut gpu);
    }
}
