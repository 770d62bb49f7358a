//! Light: what the shaders compute is what Open Inventor's equations say.
#![cfg(feature = "render")]

mod common;

use common::Rng;
use common::gpu::linear;
use glam::DQuat;
use seamount::action::Lens;
use seamount::prelude::*;

/// A lamp of any kind, as its node.
#[derive(Debug)]
enum Lamp {
    Directional(DirectionalLight),
    Point(PointLight),
    Spot(SpotLight),
}

fn color(rng: &mut Rng) -> Color {
    let mut c = || rng.unit() as f32;
    Color::new(c(), c(), c())
}

fn vector(rng: &mut Rng, half: f64) -> DVec3 {
    DVec3::new(rng.range(-half, half), rng.range(-half, half), rng.range(-half, half))
}

fn lamp(rng: &mut Rng) -> Lamp {
    let on = rng.below(5) > 0;
    let intensity = rng.range(0.1, 0.9) as f32;
    let color = color(rng);
    let location = vector(rng, 1.0).normalize() * rng.range(3.0, 9.0);
    match rng.below(3) {
        0 => Lamp::Directional(DirectionalLight {
            on,
            intensity,
            color,
            direction: vector(rng, 3.0),
            ..Default::default()
        }),
        1 => Lamp::Point(PointLight { on, intensity, color, location }),
        _ => Lamp::Spot(SpotLight {
            on,
            intensity,
            color,
            location,
            // About towards the middle, so that edges of cones are in the picture.
            direction: vector(rng, 1.5) - location,
            drop_off_rate: if rng.below(2) == 0 { 0.0 } else { rng.unit() as f32 * 0.3 },
            cut_off_angle: rng.range(0.1, 1.5),
        }),
    }
}

fn put(scene: &mut Scene, group: NodeKey, node: impl Node) {
    scene.add(group, node).unwrap();
}

struct Surface {
    point: DVec3,
    normal: DVec3,
    towards_eye: DVec3,
}

/// Open Inventor's lighting (that of OpenGL 1: "Lighting equation" in its specification, with Blinn's half-way vector) in f64,
/// in linear light; and how far the nearest edge is at which it jumps.
fn equation(material: &Material, environment: &Environment, lamps: &[Lamp], at: &Surface) -> ([f64; 3], f64) {
    let linear = |c: Color| c.linear().as_dvec3();
    let ambient = linear(environment.ambient_color) * f64::from(environment.ambient_intensity);
    let lit = lamps.iter().any(|lamp| match lamp {
        Lamp::Directional(l) => l.on,
        Lamp::Point(l) => l.on,
        Lamp::Spot(l) => l.on,
    });
    if !lit {
        return (linear(material.diffuse_color[0]).to_array(), 1.0);
    }
    let mut sum = linear(material.emissive_color[0]) + linear(material.ambient_color[0]) * ambient;
    let mut edge = 1.0f64;
    for lamp in lamps {
        let (on, intensity, color) = match lamp {
            Lamp::Directional(l) => (l.on, l.intensity, l.color),
            Lamp::Point(l) => (l.on, l.intensity, l.color),
            Lamp::Spot(l) => (l.on, l.intensity, l.color),
        };
        if !on {
            continue;
        }
        let from = |location: DVec3| {
            let to_light = location - at.point;
            let d = to_light.length();
            let a = environment.attenuation;
            (to_light / d, 1.0 / (a.x * d * d + a.y * d + a.z))
        };
        let (towards, mut share) = match lamp {
            Lamp::Directional(l) => (-l.direction.normalize(), 1.0),
            Lamp::Point(l) => from(l.location),
            Lamp::Spot(l) => from(l.location),
        };
        if let Lamp::Spot(l) = lamp {
            let cosine = (-towards).dot(l.direction.normalize());
            edge = edge.min((cosine - l.cut_off_angle.cos()).abs());
            share *= if cosine >= l.cut_off_angle.cos() {
                cosine.max(0.0).powf(128.0 * f64::from(l.drop_off_rate))
            } else {
                0.0
            };
        }
        let cosine = at.normal.dot(towards);
        // Highlights jump where light only just reaches the surface.
        edge = edge.min(cosine.abs());
        if cosine > 0.0 {
            let half_way = (towards + at.towards_eye).normalize();
            let highlight = at.normal.dot(half_way).max(0.0).powf(128.0 * f64::from(material.shininess[0]));
            let reflected = linear(material.diffuse_color[0]) * cosine + linear(material.specular_color[0]) * highlight;
            sum += linear(color) * f64::from(intensity) * share * reflected;
        }
    }
    (sum.to_array(), edge)
}

/// 100 random materials under up to eight random lights and random air, on a cube turned at random, through both kinds of camera:
/// each pixel within 2/255 of the equation.
#[test]
fn light_is_what_open_inventors_equations_say() {
    const SIZE: u32 = 26;
    let mut rng = Rng(5);
    let (mut compared, mut worst) = (0, 0.0f64);
    let mut most = [0; 3];
    for case in 0..100 {
        let dark = |rng: &mut Rng| if rng.below(2) == 0 { Color::BLACK } else { color(rng) };
        let material = Material {
            ambient_color: dark(&mut rng).into(),
            diffuse_color: color(&mut rng).into(),
            specular_color: dark(&mut rng).into(),
            emissive_color: dark(&mut rng).into(),
            shininess: List::from(rng.unit() as f32),
            transparency: List::from(0.0),
        };
        let weakens = rng.below(2) == 0;
        let environment = Environment {
            ambient_intensity: rng.unit() as f32,
            ambient_color: dark(&mut rng),
            attenuation: if weakens { DVec3::new(0.03, 0.1, 0.7) * rng.range(0.1, 2.0) } else { DVec3::Z },
            ..Environment::default()
        };
        let lamps: Vec<Lamp> = (0..case % 9).map(|_| lamp(&mut rng)).collect();
        let turn = DQuat::from_axis_angle(vector(&mut rng, 1.0).normalize(), rng.range(0.0, 6.0));
        let (axis, angle) = turn.to_axis_angle();
        let mut scene = Scene::new();
        let root = scene.root();
        let eye = vector(&mut rng, 1.0).normalize() * 9.0;
        let (position, look_at) = (Some(eye), Some(DVec3::ZERO));
        if rng.below(2) == 0 {
            scene.add(root, PerspectiveCamera { position, look_at, ..Default::default() }).unwrap();
        } else {
            scene.add(root, OrthographicCamera { position, look_at, height: 5.0, ..Default::default() }).unwrap();
        }
        scene.add(root, environment.clone()).unwrap();
        for lamp in &lamps {
            match lamp {
                Lamp::Directional(l) => scene.add(root, l.clone()).unwrap(),
                Lamp::Point(l) => scene.add(root, l.clone()).unwrap(),
                Lamp::Spot(l) => scene.add(root, l.clone()).unwrap(),
            };
        }
        scene.add(root, material.clone()).unwrap();
        scene.add(root, Transform { rotation: AxisAngle::new(axis, angle), ..Default::default() }).unwrap();
        scene.add(root, Cube::default()).unwrap();

        let action = RenderAction::new(SIZE, SIZE);
        let frame = action.apply(&scene).unwrap();
        let e = frame.draws[0].effects;
        for (most, count) in most.iter_mut().zip([e.directional_lights, e.point_lights, e.spot_lights]) {
            *most = count.max(*most);
        }
        let view = action.viewpoint(&scene).unwrap();
        let picture = linear().draw(&frame);
        let picker = RayPickAction::pixel(0, 0, [SIZE, SIZE]).picker(&scene).unwrap();
        let pick = |x: f64, y: f64| {
            let [x, y] = [x, y].map(|c| c / f64::from(SIZE));
            let hits = picker.pick(&picker.ray_through(x, y).unwrap(), false).unwrap();
            hits.first().map(|hit| (hit.point, hit.normal.normalize()))
        };
        for (x, y) in (0..SIZE).flat_map(|y| (0..SIZE).map(move |x| (x, y))) {
            let (px, py) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
            let Some((point, normal)) = pick(px, py) else { continue };
            // Next to an edge rounding decides which face a pixel shows.
            let near = [(0.05, 0.0), (-0.05, 0.0), (0.0, 0.05), (0.0, -0.05)].map(|(dx, dy)| pick(px + dx, py + dy));
            if near.iter().any(|near| near.is_none_or(|(_, n)| n.distance(normal) > 1e-6)) {
                continue;
            }
            let towards_eye = match view.lens {
                Lens::Perspective { .. } => (view.eye - point).normalize(),
                Lens::Orthographic { .. } => -view.forward,
            };
            let (want, edge) = equation(&material, &environment, &lamps, &Surface { point, normal, towards_eye });
            if edge < 1e-3 {
                continue;
            }
            compared += 1;
            for (got, want) in picture.at(x, y).into_iter().zip(want) {
                // What is brighter than white is white.
                let difference = (f64::from(got).min(1.0) - want.min(1.0)).abs();
                worst = worst.max(difference);
                assert!(
                    difference <= 2.0 / 255.0,
                    "case {case} at ({x}, {y}): {got} is not {want}; {lamps:?} {material:?}"
                );
            }
        }
    }
    println!("{compared} pixels, at most {:.3}/255 off; lights of a kind: {most:?}", worst * 255.0);
    assert!(compared > 10_000 && most.iter().all(|&n| n >= 3), "{compared} pixels, {most:?}");
}

/// What does not light a shape changes neither shader nor uniforms: off, without intensity, black, or in another separator.
#[test]
fn lights_that_light_nothing_cost_nothing() {
    type Change = dyn Fn(&mut Scene, NodeKey);
    let scene = |change: &Change| {
        let mut scene = Scene::new();
        let root = scene.root();
        scene.add(root, PerspectiveCamera::default()).unwrap();
        scene.add(root, DirectionalLight::default()).unwrap();
        change(&mut scene, root);
        scene.add(root, Cube::default()).unwrap();
        let frame = RenderAction::new(32, 32).apply(&scene).unwrap();
        let mut headless = common::gpu::headless();
        let picture = headless.draw(&frame).unwrap();
        (frame.draws[0].effects, headless.costs(&frame).unwrap()[0], picture.rgba)
    };
    let base = scene(&|_, _| ());
    let none: [(&str, &Change); 9] = [
        ("off", &|s, r| put(s, r, SpotLight { on: false, ..Default::default() })),
        ("no intensity", &|s, r| put(s, r, PointLight { intensity: 0.0, ..Default::default() })),
        ("black", &|s, r| put(s, r, PointLight { color: Color::BLACK, ..Default::default() })),
        ("in another separator", &|s, r| {
            let other = s.add(r, Separator::default()).unwrap();
            s.add(other, SpotLight::default()).unwrap();
            s.add(other, Environment { ambient_intensity: 1.0, ..Default::default() }).unwrap();
        }),
        ("the default material", &|s, r| put(s, r, Material::default())),
        ("the default air", &|s, r| put(s, r, Environment::default())),
        ("the default model", &|s, r| put(s, r, LightModel::default())),
        ("a texture that nobody reads", &|s, r| {
            s.add(r, TextureUnit { unit: 7 }).unwrap();
            // The file is not there, and nobody looks.
            s.add(r, Texture2 { filename: "no such file.png".into(), ..Default::default() }).unwrap();
        }),
        ("weakening of sunlight", &|s, r| {
            put(s, r, Environment { attenuation: DVec3::ONE, ..Default::default() });
        }),
    ];
    for (what, change) in none {
        assert_eq!(scene(change), base, "{what}");
    }
    let lamp = PointLight { location: DVec3::Z * 5.0, ..Default::default() };
    let lamp = scene(&move |s, r| put(s, r, lamp.clone()));
    assert!(lamp.0 != base.0 && lamp.1.uniform_bytes > base.1.uniform_bytes && lamp.2 != base.2);
}

/// With the model BASE_COLOR lights are as if they were not there.
#[test]
fn base_color_ignores_light() {
    let scene = |lights: bool| {
        let mut scene = Scene::new();
        let root = scene.root();
        scene.add(root, PerspectiveCamera::default()).unwrap();
        if lights {
            scene.add(root, DirectionalLight::default()).unwrap();
            scene.add(root, PointLight::default()).unwrap();
        }
        scene
            .add(
                root,
                Material {
                    specular_color: Color::WHITE.into(),
                    emissive_color: Color::WHITE.into(),
                    ..Default::default()
                },
            )
            .unwrap();
        scene.add(root, LightModel { model: LightingModel::BaseColor }).unwrap();
        scene.add(root, Cube::default()).unwrap();
        let frame = RenderAction::new(32, 32).apply(&scene).unwrap();
        (frame.draws[0].effects, common::gpu::headless().draw(&frame).unwrap().rgba)
    };
    assert_eq!(scene(true), scene(false));
    assert!(!scene(true).0.lit());
}
