//! Shaders of a scene's own: what they are given and may call, their parameters, and where their mistakes are reported.
#![cfg(feature = "render")]

mod common;

use std::sync::Arc;

use common::Rng;
use common::gpu::{headless, linear};
use seamount::action::{Explained, Frame, ShaderOrigin};
use seamount::prelude::*;
use seamount::render::{RenderError, check_shaders, draw_text};
use seamount::scene::{NodePlace, Position};

const SIZE: [u32; 2] = [72, 60];
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;

fn hills() -> Arc<Image> {
    let height = |c: f64, r: f64| 0.5 + 0.3 * (c * 0.4).sin() + 0.2 * (r * 0.31 + c * 0.15).cos();
    let samples = (0..41 * 33).map(|i| (height(f64::from(i % 41), f64::from(i / 41)) * 65535.0) as u16);
    Arc::new(Image::new(41, 33, Pixels::Gray16(samples.collect())).unwrap())
}

fn ground() -> SeamlessTerrain {
    SeamlessTerrain {
        size: Some(DVec2::new(400.0, 300.0)),
        max_height: 50.0,
        base_height: 10.0,
        detail: DetailMode::Full,
        ..Default::default()
    }
}

/// A scene, and the group that nodes are put into.
struct Build {
    scene: Scene,
    root: NodeKey,
}

impl Build {
    fn new() -> Self {
        let mut scene = Scene::new();
        let root = scene.root();
        let (position, look_at) = (Some(DVec3::new(250.0, -150.0, 420.0)), Some(DVec3::new(200.0, 150.0, 20.0)));
        scene
            .add(root, PerspectiveCamera { position, look_at, near_distance: Some(1.0), ..Default::default() })
            .unwrap();
        Self { scene, root }
    }

    fn add(&mut self, node: impl Node) -> NodeKey {
        self.scene.add(self.root, node).unwrap()
    }

    /// A program with a vertex and a fragment shader, where they have a text; parameters belong to both.
    fn program(&mut self, vertex: &str, fragment: &str, parameters: &[(&str, ShaderValue)]) -> NodeKey {
        let program = self.add(ShaderProgram::default());
        let source = |text: &str| ShaderSource::Wgsl(text.to_owned());
        let scene = &mut self.scene;
        let mut stages = Vec::new();
        if !vertex.is_empty() {
            let shader = VertexShader { source_program: source(vertex), ..Default::default() };
            stages.push(scene.add(program, shader).unwrap());
        }
        if !fragment.is_empty() {
            let shader = FragmentShader { source_program: source(fragment), ..Default::default() };
            stages.push(scene.add(program, shader).unwrap());
        }
        for stage in stages {
            for (name, value) in parameters {
                scene.add(stage, ShaderParameter { name: (*name).to_owned(), value: *value }).unwrap();
            }
        }
        program
    }

    fn fragment(&mut self, body: &str) -> NodeKey {
        self.program("", &fragment(body), &[])
    }

    fn vertex(&mut self, body: &str) -> NodeKey {
        self.program(&vertex(body), "", &[])
    }

    fn terrain(mut self) -> Scene {
        self.add(Texture2::from_image(hills()));
        self.add(ground());
        self.scene
    }
}

fn fragment(body: &str) -> String {
    format!("fn fragment_shader(fragment: Fragment) -> vec3f {{ {body} }}")
}

fn vertex(body: &str) -> String {
    format!("fn vertex_shader(vertex: Vertex) -> vec3f {{ {body} }}")
}

fn frame(scene: &Scene) -> Frame {
    RenderAction { background: Color::new(0.2, 0.0, 0.4), ..RenderAction::new(SIZE[0], SIZE[1]) }.apply(scene).unwrap()
}

fn rgba(width: u32, height: u32, texel: impl FnMut(u32) -> [u8; 4]) -> Image {
    Image::new(width, height, Pixels::Rgba8((0..width * height).map(texel).collect())).unwrap()
}

/// Calls `check` for each pixel of the ground with what it shows and its colour.
fn each_pixel(scene: &Scene, mut check: impl FnMut(&PickedPoint, [f32; 3], [u32; 2])) {
    let picture = linear().draw(&frame(scene));
    let picker = RayPickAction { surface: Surface::Exact, ..RayPickAction::pixel(0, 0, SIZE) }.picker(scene).unwrap();
    let mut seen = 0;
    for (x, y) in (0..SIZE[0]).flat_map(|x| (0..SIZE[1]).map(move |y| (x, y))) {
        let at = |dx: f64, dy: f64| {
            let [x, y] = [(x, dx, SIZE[0]), (y, dy, SIZE[1])].map(|(p, d, n)| (f64::from(p) + d) / f64::from(n));
            picker.pick(&picker.ray_through(x, y).unwrap(), false).unwrap().into_iter().next()
        };
        // Pixels on the border of the map are left out.
        let inside = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)].iter().all(|&(dx, dy)| at(dx, dy).is_some());
        if let (Some(hit), true) = (at(0.5, 0.5), inside) {
            let [r, g, b, _] = picture.at(x, y);
            check(&hit, [r, g, b], [x, y]);
            seen += 1;
        }
    }
    assert!(seen > 1000, "{seen} pixels of ground");
}

fn assert_near(got: [f32; 3], want: DVec3, tolerance: f64, at: [u32; 2]) {
    let near = got.iter().zip(want.to_array()).all(|(g, w)| (f64::from(*g) - w).abs() <= tolerance);
    assert!(near, "{got:?} is not {want} at {at:?}");
}

/// The shader that gives what would be there without it leaves every pixel as it is, to the bit, whatever else is asked for.
#[test]
fn the_surface_as_it_is_stays_as_it_is() {
    type Nodes = fn(&mut Build);
    let cases: [Nodes; 8] = [
        |_| (),
        |b| {
            b.add(DirectionalLight { direction: DVec3::new(0.5, 0.3, -1.0), ..Default::default() });
        },
        |b| {
            b.add(DirectionalLight { direction: DVec3::new(0.8, 0.3, -0.3), shadow: true, ..Default::default() });
            b.add(Material { specular_color: Color::WHITE.into(), ..Default::default() });
            b.add(PointLight { location: DVec3::new(100.0, 100.0, 100.0), ..Default::default() });
            b.add(Environment { fog_type: FogType::Fog, fog_visibility: 900.0, ..Default::default() });
        },
        |b| {
            b.add(DirectionalLight::default());
            b.add(ColorRamp { ramp: Ramp::Viridis, ..Default::default() });
            b.add(ContourLines { interval: 5.0, ..Default::default() });
        },
        |b| {
            b.add(ColorRamp { by: RampBy::Slope, ..Default::default() });
            b.add(TextureUnit { unit: 1 });
            b.add(Texture2::from_image(rgba(9, 7, |i| [i as u8 * 4, 255 - i as u8, 90, 255])));
            b.add(TextureUnit { unit: 0 });
        },
        |b| {
            b.add(DirectionalLight::default());
            b.add(Material { transparency: 0.4.into(), ..Default::default() });
            b.add(ClipPlane { plane: Plane { normal: DVec3::X, distance: 120.0 }, on: true });
        },
        |b| {
            b.add(DrawStyle { style: Style::FilledLines, ..Default::default() });
            b.add(LightModel { model: LightingModel::BaseColor });
            b.add(DirectionalLight::default());
        },
        |b| {
            b.add(DirectionalLight::default());
            b.add(DrawStyle { style: Style::Lines, ..Default::default() });
        },
    ];
    let mut gpu = linear();
    for (number, nodes) in cases.into_iter().enumerate() {
        let build = |own: bool| {
            let mut b = Build::new();
            nodes(&mut b);
            if own {
                b.program(&vertex("return vec3f(0.0);"), &fragment("return lit(fragment, fragment.color);"), &[]);
            }
            b.add(Translation { translation: DVec3::new(-30.0, 100.0, 80.0) });
            b.add(Sphere { radius: 40.0 });
            let ends = [DVec3::new(100.0, -100.0, 0.0), DVec3::new(180.0, -60.0, 30.0), DVec3::new(120.0, -90.0, 60.0)];
            b.add(Coordinate3 { point: ends.into() });
            b.add(Normal { vector: [DVec3::Z; 3].into() });
            b.add(LineSet::default());
            b.add(Translation { translation: DVec3::new(30.0, -100.0, -80.0) });
            frame(&b.terrain())
        };
        let (plain, own) = (build(false), build(true));
        assert!(own.draws.iter().all(|draw| draw.program.is_some()) && own.draws.len() == 3);
        let (plain, own) = (gpu.draw(&plain), gpu.draw(&own));
        let differ = plain.texels.iter().zip(&own.texels).filter(|(a, b)| a != b).count();
        assert_eq!(differ, 0, "case {number}");
    }
}

/// What fragments are given is what a pick says of the place.
#[test]
fn fragments_are_told_where_they_are() {
    let turned = RotationXyz { axis: Axis::Z, angle: 0.1 };
    let build = |body: &str| {
        let mut b = Build::new();
        // Members are in local coordinates, whatever is above.
        b.add(Translation { translation: DVec3::new(20.0, -15.0, 5.0) });
        b.add(turned.clone());
        b.fragment(body);
        b.terrain()
    };
    each_pixel(&build("return fragment.position / 400.0;"), |hit, got, at| {
        assert_near(got, hit.object_point / 400.0, 1e-3, at);
    });
    each_pixel(&build("return vec3f(fragment.uv, fragment.lattice.x / 40.0);"), |hit, got, at| {
        assert_near(got, DVec3::new(hit.uv.x, hit.uv.y, hit.uv.x), 1e-3, at);
    });
    let (mut sum, mut count) = (0.0, 0);
    each_pixel(&build("return fragment.normal;"), |hit, got, at| {
        // In local coordinates: turned back.
        let normal = DQuat::from_rotation_z(-0.1) * hit.smooth_normal.normalize();
        // Seen at a slant the map is looked up in smaller copies, which smooth it.
        assert_near(got, normal, 0.3, at);
        sum += (DVec3::from_array(got.map(f64::from)) - normal).length();
        count += 1;
    });
    assert!(sum / f64::from(count) < 0.03, "{} on the mean", sum / f64::from(count));
    // The map is drawn in full, so the drawn surface is the one that can be asked for.
    let same = "let z = terrain_height(fragment.lattice); return vec3f(z / 100.0, abs(z - fragment.position.z), 0.0);";
    each_pixel(&build(same), |hit, got, at| {
        assert_near(got, DVec3::new(hit.object_point.z / 100.0, 0.0, 0.0), 2e-3, at);
    });
}

/// Heights beyond the map are those of its border, and those of samples are exact.
#[test]
fn heights_can_be_asked_for_anywhere() {
    let mut b = Build::new();
    // 65535 high, so that a sample is its own height: exact in floats.
    b.fragment(
        "let inside = clamp(vec2f(round(fragment.lattice)), vec2f(0.0), vec2f(40.0, 32.0));
         let beyond = terrain_height(vec2f(-5.0, inside.y)) - terrain_height(vec2f(0.0, inside.y));
         let below = terrain_height(vec2f(inside.x, 1e6)) - terrain_height(vec2f(inside.x, 32.0));
         return vec3f(fract(terrain_height(inside)), beyond, below);",
    );
    b.add(Scale { scale_factor: DVec3::new(1.0, 1.0, 50.0 / 65535.0) });
    b.add(Texture2::from_image(hills()));
    b.add(SeamlessTerrain { max_height: 65535.0, base_height: 10.0, ..ground() });
    each_pixel(&b.scene, |_, got, at| assert_near(got, DVec3::ZERO, 0.0, at));
}

/// A vertex shader that moves everything is a translation; one that adds the height is a map twice as high.
#[test]
fn vertices_are_moved_in_local_coordinates() {
    let depth = |scene: &Scene| headless().draw_depth(&frame(scene)).unwrap();
    let near = |a: &[f32], b: &[f32], what: &str| {
        // On outlines rounding decides.
        let differ = a.iter().zip(b).filter(|(a, b)| (*a - *b).abs() > 1e-5 * b.abs()).count();
        assert!(differ <= 4, "{what}: {differ} pixels differ");
        assert!(a.iter().filter(|depth| **depth > 0.0).count() > 200, "{what}");
    };
    let shape = |b: &mut Build| {
        b.add(Texture2::from_image(hills()));
        b.add(SeamlessTerrain { base_height: 0.0, ..ground() });
        b.add(Sphere { radius: 60.0 });
        let corners = [DVec3::ZERO, DVec3::new(300.0, 100.0, 90.0), DVec3::new(100.0, 300.0, 90.0)];
        b.add(Coordinate3 { point: corners.into() });
        b.add(DrawStyle { line_width: 3.0, ..Default::default() });
        b.add(LineSet::default());
    };
    let turned = RotationXyz { axis: Axis::Z, angle: 0.1 };
    let by = DVec3::new(30.0, 20.0, 40.0);
    let mut own = Build::new();
    own.add(turned.clone());
    own.vertex("return vec3f(30.0, 20.0, 40.0);");
    shape(&mut own);
    let mut moved = Build::new();
    moved.add(turned);
    moved.add(Translation { translation: by });
    shape(&mut moved);
    near(&depth(&own.scene), &depth(&moved.scene), "moved");

    for body in [
        "return vec3f(0.0, 0.0, vertex.position.z);",
        "return vec3f(0.0, 0.0, terrain_height(vertex.lattice));",
        "return vec3f(0.0, 0.0, terrain_height(vec2f(40.0, 32.0) * vec2f(vertex.uv.x, 1.0 - vertex.uv.y)));",
    ] {
        let mut own = Build::new();
        own.vertex(body);
        own.add(Texture2::from_image(hills()));
        own.add(SeamlessTerrain { base_height: 0.0, ..ground() });
        let mut high = Build::new();
        high.add(Texture2::from_image(hills()));
        high.add(SeamlessTerrain { base_height: 0.0, max_height: 100.0, ..ground() });
        near(&depth(&own.scene), &depth(&high.scene), body);
    }

    // Along the normal a sphere is a larger one.
    let sphere = |radius: f32| Sphere { radius: radius.into() };
    let mut own = Build::new();
    own.vertex("return 20.0 * vertex.normal;");
    own.add(sphere(60.0));
    let mut large = Build::new();
    large.add(sphere(80.0));
    near(&depth(&own.scene), &depth(&large.scene), "sphere");
}

/// Normals of vertices on a terrain are those of the map's gradients.
#[test]
fn vertices_are_told_their_normals() {
    let mut b = Build::new();
    // Where it does not agree with the differences of heights around, the ground goes far away.
    b.vertex(
        "let c = vertex.lattice;
         if (any(c < vec2f(1.0)) || any(c > vec2f(39.0, 31.0))) { return vec3f(0.0); }
         let dx = (terrain_height(c + vec2f(1.0, 0.0)) - terrain_height(c - vec2f(1.0, 0.0))) / 20.0;
         let dy = (terrain_height(c - vec2f(0.0, 1.0)) - terrain_height(c + vec2f(0.0, 1.0))) / 18.75;
         let off = length(normalize(vec3f(-dx, -dy, 1.0)) - vertex.normal);
         return vec3f(0.0, 0.0, select(0.0, -1e5, off > 2e-3));",
    );
    let own = b.terrain();
    let plain = Build::new().terrain();
    let [own, plain] = [&own, &plain].map(|scene| headless().draw_depth(&frame(scene)).unwrap());
    assert_eq!(own.iter().zip(&plain).filter(|(a, b)| (*a - *b).abs() > 1e-6).count(), 0);
}

/// Seen from above the ground hides what is behind it, however a function of the place moves it: patches of different detail, holes
/// and levels that blend meet exactly.
#[test]
fn moved_patches_still_meet() {
    let mut rng = Rng(11);
    let rough = |rng: &mut Rng, void: bool| {
        let samples = (0..129 * 129).map(|i| {
            let hole = void && [i % 129, i / 129].iter().all(|k| (40..60).contains(k));
            if hole { 0 } else { 1 + rng.below(60_000) as u16 }
        });
        Image::new(129, 129, Pixels::Gray16(samples.collect())).unwrap()
    };
    let bodies = [
        "return vec3f(0.0, 0.0, 9.0 * sin(0.7 * vertex.position.x) * cos(vertex.position.y));",
        "return 0.2 * vec3f(sin(vertex.position.yx * 0.9), 0.0) + vec3f(0.0, 0.0, 5.0 * vertex.normal.x);",
        "return vec3f(0.0, 0.0, terrain_height(vertex.lattice + vec2f(3.0, 1.5)));",
    ];
    for (body, (morph, void)) in
        bodies.iter().flat_map(|b| [(false, false), (true, false), (false, true)].map(|m| (b, m)))
    {
        let mut scene = Scene::new();
        let root = scene.root();
        // Over a corner, so that detail differs over the map.
        let camera = PerspectiveCamera {
            position: Some(DVec3::new(20.0, 20.0, 70.0)),
            look_at: Some(DVec3::new(60.0, 64.0, 0.0)),
            near_distance: Some(0.5),
            height_angle: 1.2,
            ..Default::default()
        };
        scene.add(root, camera).unwrap();
        let mut b = Build { scene, root };
        b.add(BaseColor { rgb: Color::WHITE.into() });
        b.vertex(body);
        b.add(Texture2::from_image(rough(&mut rng, void)));
        b.add(SeamlessTerrain {
            scale: 128.0,
            max_height: 12.0,
            void_sample: Some(0.0),
            voids: if void { VoidMode::Hole } else { VoidMode::Fill },
            morph,
            detail: DetailMode::Precision(1.5),
            culling: false,
            ..Default::default()
        });
        let action = RenderAction { background: Color::BLACK, ..RenderAction::new(400, 400) };
        let frame = action.apply(&b.scene).unwrap();
        let picture = linear().draw(&frame);
        let picker = RayPickAction { surface: Surface::Exact, ..RayPickAction::pixel(0, 0, [400, 400]) };
        let picker = picker.picker(&b.scene).unwrap();
        let mut inside = 0;
        for (x, y) in (0..400).flat_map(|y| (0..400).map(move |x| (x, y))) {
            let ray = picker.ray_through((f64::from(x) + 0.5) / 400.0, (f64::from(y) + 0.5) / 400.0).unwrap();
            // Where the ray meets the ground far from its border and from holes, whatever the height up to 30.
            let clear = |z: f64| {
                let p = ray.at((z - ray.origin.z) / ray.direction.z);
                let hole = void && (34.0..66.0).contains(&p.x) && (62.0..94.0).contains(&p.y);
                (4.0..124.0).contains(&p.x) && (4.0..124.0).contains(&p.y) && !hole
            };
            if clear(-10.0) && clear(10.0) && clear(30.0) {
                inside += 1;
                assert_eq!(picture.at(x, y)[0], 1.0, "a gap at ({x}, {y}): {body} {morph} {void}");
            }
        }
        assert!(inside > 20_000, "{inside}");
    }
}

/// All kinds of values arrive, under their names, and a changed value compiles nothing.
#[test]
fn values_of_every_kind_arrive() {
    use ShaderValue as V;
    // As a sum of what stands in it, column c and row r weighted by 1 + c + 10 r.
    let kinds: [(V, &str, f32); 21] = [
        (V::Float(2.0), "p", 2.0),
        (V::Vec2(1.0, 2.0), "p.x + 11.0 * p.y", 23.0),
        (V::Vec3(1.0, 2.0, 3.0), "p.x + 11.0 * p.y + 21.0 * p.z", 86.0),
        (V::Vec4(1.0, 2.0, 3.0, 4.0), "p.x + 11.0 * p.y + 21.0 * p.z + 31.0 * p.w", 210.0),
        (V::Int(-5), "f32(p)", -5.0),
        (V::IVec2(-1, 2), "f32(p.x + 11 * p.y)", 21.0),
        (V::IVec3(-1, 2, 3), "f32(p.x + 11 * p.y + 21 * p.z)", 84.0),
        (V::IVec4(-1, 2, 3, 4), "f32(p.x + 11 * p.y + 21 * p.z + 31 * p.w)", 208.0),
        (V::Uint(5), "f32(p)", 5.0),
        (V::UVec2(1, 2), "f32(p.x + 11u * p.y)", 23.0),
        (V::UVec3(1, 2, 3), "f32(p.x + 11u * p.y + 21u * p.z)", 86.0),
        (V::UVec4(1, 2, 3, 4), "f32(p.x + 11u * p.y + 21u * p.z + 31u * p.w)", 210.0),
        (V::Mat2([1.0, 2.0], [3.0, 4.0]), "dot(p * vec2f(1.0, 2.0), vec2f(1.0, 10.0))", 107.0),
        (V::Mat2x3([1.0, 2.0, 3.0], [4.0, 5.0, 6.0]), "dot(p * vec2f(1.0, 2.0), vec3f(1.0, 10.0, 0.0))", 129.0),
        (
            V::Mat2x4([1.0, 0.0, 0.0, 2.0], [0.0, 3.0, 4.0, 0.0]),
            "dot(p * vec2f(1.0, 2.0), vec4f(1.0, 2.0, 3.0, 4.0))",
            45.0,
        ),
        (V::Mat3x2([1.0, 2.0], [3.0, 4.0], [5.0, 6.0]), "dot(p * vec3f(1.0, 2.0, 3.0), vec2f(1.0, 2.0))", 78.0),
        (
            V::Mat3([1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [4.0, 0.0, 3.0]),
            "dot(p * vec3f(1.0, 2.0, 3.0), vec3f(1.0, 2.0, 3.0))",
            48.0,
        ),
        (
            V::Mat3x4([1.0, 0.0, 0.0, 1.0], [0.0, 2.0, 0.0, 0.0], [4.0, 0.0, 3.0, 0.0]),
            "dot(p * vec3f(1.0, 2.0, 3.0), vec4f(1.0, 2.0, 3.0, 4.0))",
            52.0,
        ),
        (
            V::Mat4x2([1.0, 2.0], [3.0, 4.0], [5.0, 6.0], [7.0, 8.0]),
            "dot(p * vec4f(1.0, 2.0, 3.0, 4.0), vec2f(1.0, 2.0))",
            170.0,
        ),
        (
            V::Mat4x3([1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0], [1.0, 1.0, 1.0]),
            "dot(p * vec4f(1.0, 2.0, 3.0, 4.0), vec3f(1.0, 2.0, 3.0))",
            60.0,
        ),
        (
            V::Mat4([1.0, 0.0, 0.0, 5.0], [0.0, 2.0, 0.0, 0.0], [0.0, 0.0, 3.0, 0.0], [0.0, 0.0, 0.0, 4.0]),
            "dot(p * vec4f(1.0, 2.0, 3.0, 4.0), vec4f(1.0, 2.0, 3.0, 4.0))",
            120.0,
        ),
    ];
    let mut gpu = linear();
    for (value, sum, want) in kinds {
        let mut b = Build::new();
        let text =
            fragment(&format!("let p = parameters.p; return vec3f({sum}, parameters.before, parameters.after);"));
        b.program(
            "",
            &text,
            &[("before", V::Float(0.25)), ("p", value), ("unused", V::Vec2(1.0, 1.0)), ("after", V::Float(0.5))],
        );
        b.add(Translation { translation: DVec3::new(200.0, 150.0, 20.0) });
        b.add(Sphere { radius: 100.0 });
        let frame = frame(&b.scene);
        let got = gpu.draw(&frame).at(SIZE[0] / 2, SIZE[1] / 2);
        assert_eq!(got, [want, 0.25, 0.5, 1.0], "{value:?}");
        assert!(!draw_text(&frame.draws[0], FORMAT).unwrap().contains("unused"), "what is not mentioned is not there");
    }
}

#[test]
fn changed_values_compile_nothing_and_the_same_texts_share_a_shader() {
    let mut b = Build::new();
    let text = fragment("return parameters.tint;");
    let program = b.program("", &text, &[("tint", ShaderValue::Color(1.0, 0.0, 0.0))]);
    let other = b.add(Separator::default());
    b.add(Translation { translation: DVec3::new(200.0, 150.0, 20.0) });
    b.add(Sphere { radius: 60.0 });
    // Another program of the same text, from another node, in the same scene.
    let mut c = Build { scene: b.scene, root: other };
    c.program("", &text, &[("tint", ShaderValue::Color(0.0, 1.0, 0.0))]);
    c.add(Sphere { radius: 80.0 });
    let mut scene = c.scene;
    let mut gpu = headless();
    let first = frame(&scene);
    assert!(gpu.draw(&first).unwrap().report.pipelines_made <= 1);
    let costs = gpu.costs(&first).unwrap();
    assert_eq!(costs.iter().map(|cost| cost.variant).collect::<Vec<_>>(), [0, 0]);
    let tint = scene.children(scene.children(program)[0])[0];
    scene.edit::<ShaderParameter>(tint).unwrap().value = ShaderValue::Color(0.0, 0.0, 1.0);
    let second = gpu.draw(&frame(&scene)).unwrap();
    assert_eq!(second.report.pipelines_made, 0);
    let at = |x: u32, y: u32| &second.rgba[((y * SIZE[0] + x) * 4) as usize..][..4];
    assert_eq!(at(SIZE[0] / 2, SIZE[1] / 2), [0, 0, 255, 255]);
}

/// Textures come by their units, as colours or as numbers, with the filter of the Complexity and the wrap of their node.
#[test]
fn textures_come_by_their_units() {
    let image = Arc::new(rgba(2, 2, |i| {
        [[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [188, 188, 188, 100]][i as usize]
    }));
    let build = |wrap: seamount::node::Wrap, value: ShaderValue, quality: f64| {
        let mut b = Build::new();
        b.add(Complexity { texture_quality: quality, ..Default::default() });
        b.add(TextureUnit { unit: 5 });
        b.add(Texture2 { wrap_s: wrap, wrap_t: wrap, ..Texture2::from_image(Arc::clone(&image)) });
        b.add(TextureUnit { unit: 0 });
        let text = fragment("return textureSampleLevel(tiles, tiles_sampler, 3.0 * fragment.uv - 1.0, 0.0).rgb;");
        b.program("", &text, &[("tiles", value)]);
        b.terrain()
    };
    use seamount::node::Wrap;
    for (wrap, value, grey) in [
        (Wrap::Repeat, ShaderValue::Texture(5), seamount::action::linear_from_srgb(188.0 / 255.0)),
        (Wrap::Clamp, ShaderValue::Data(5), 188.0 / 255.0),
    ] {
        let mut compared = 0;
        each_pixel(&build(wrap, value, 0.3), |hit, got, at| {
            let place = |x: f64| match wrap {
                Wrap::Repeat => (2.0 * (3.0 * x - 1.0)).floor().rem_euclid(2.0),
                Wrap::Clamp => (2.0 * (3.0 * x - 1.0)).floor().clamp(0.0, 1.0),
            };
            let off = |x: f64| (6.0 * x - (6.0 * x).round()).abs() > 1e-2;
            if !off(hit.uv.x) || !off(hit.uv.y) {
                return;
            }
            compared += 1;
            let want = match (place(hit.uv.x), place(hit.uv.y)) {
                (0.0, 0.0) => DVec3::X,
                (1.0, 0.0) => DVec3::Y,
                (0.0, _) => DVec3::Z,
                _ => DVec3::splat(grey.into()),
            };
            assert_near(got, want, 1e-3, at);
        });
        assert!(compared > 900, "{compared}");
    }
    // Filtered, most places are between texels.
    let mut mixed = 0;
    each_pixel(&build(Wrap::Repeat, ShaderValue::Texture(5), 1.0), |_, got, _| {
        mixed += u32::from(got.iter().filter(|&&c| (0.02..0.98).contains(&c)).count() >= 2);
    });
    assert!(mixed > 500, "{mixed}");
    // A texture that no text mentions is neither decoded nor bound.
    let mut b = Build::new();
    b.add(TextureUnit { unit: 5 });
    b.add(Texture2 { filename: "no such tiles.png".into(), ..Default::default() });
    b.add(TextureUnit { unit: 0 });
    b.program("", &fragment("return vec3f(1.0); // tiles"), &[("tiles", ShaderValue::Texture(5))]);
    let text = draw_text(&frame(&b.terrain()).draws[0], FORMAT).unwrap();
    assert!(!text.contains("@group(1) @binding(32)"), "{text}");
}

/// What a text does not mention is not in the shader; the scene's maps and lights neither, if it does not ask for them.
#[test]
fn what_is_not_mentioned_is_not_there() {
    let build = |vertex: &str, fragment: &str| {
        let mut b = Build::new();
        b.add(DirectionalLight { shadow: true, ..Default::default() });
        b.add(ColorRamp::default());
        b.add(TextureUnit { unit: 1 });
        b.add(Texture2 { filename: "no such colours.png".into(), ..Default::default() });
        b.add(TextureUnit { unit: 0 });
        b.program(vertex, fragment, &[]);
        b.terrain()
    };
    let scene = build("", &fragment("return vec3f(1.0, 0.0, 0.0);"));
    // The colour map would not be found.
    let plain = frame(&scene);
    let names = plain.draws[0].effects.names();
    assert_eq!(names, ["terrain-u16", "fragment-shader"]);
    let text = draw_text(&plain.draws[0], FORMAT).unwrap();
    for word in
        ["normal", "gradient", "color_map", "ramp", "lattice: vec2", "local", "fn lit", "terrain_height", "Parameters"]
    {
        assert!(!text.contains(word), "{word}:\n{text}");
    }
    let error = RenderAction::new(8, 8).apply(&build("", &fragment("return fragment.color;"))).unwrap_err();
    assert!(error.to_string().contains("no such colours.png"), "{error}");
    for (word, body) in [
        ("gradients", "return fragment.normal;"),
        ("local_from_rel", "return fragment.position;"),
        ("fn terrain_height", "return vec3f(terrain_height(vec2f(0.0)));"),
        ("fn terrain_uv", "return fragment.uv.xyy;"),
        ("fn lit(", "return lit(fragment, vec3f(1.0));"),
    ] {
        let frame = frame(&build("", &fragment(body)));
        assert!(draw_text(&frame.draws[0], FORMAT).unwrap().contains(word), "{body}");
        assert!(!text.contains(word), "{word}");
        check_shaders(&frame).unwrap();
    }
    // Without shaders of its own a scene has no trace of them.
    let text = draw_text(&frame(&Build::new().terrain()).draws[0], FORMAT).unwrap();
    assert!(!text.contains("local") && !text.contains("Fragment") && !text.contains("Vertex"), "{text}");
    let mut b = Build::new();
    let program = b.fragment("return vec3f(1.0);");
    let stage = b.scene.children(program)[0];
    b.scene.edit::<FragmentShader>(stage).unwrap().is_active = false;
    assert!(frame(&b.terrain()).draws[0].program.is_none());
}

fn error_of(scene: &Scene) -> RenderError {
    let frame = frame(scene);
    let error = headless().draw(&frame).unwrap_err();
    let checked = check_shaders(&frame).unwrap_err();
    assert_eq!(error.to_string(), checked.to_string());
    error
}

/// Mistakes are reported where they stand in the text as it was written.
#[test]
fn mistakes_are_reported_where_they_stand() {
    let cases = [
        // A word that is not known.
        (
            "fn fragment_shader(fragment: Fragment) -> vec3f {\n    let é = 1.0; return vec3f(unknwon);\n}",
            (2, 31),
            "no definition in scope for identifier: `unknwon`",
        ),
        // The syntax.
        ("// é\nfn fragment_shader(fragment: Fragment) -> vec3f {\n    return vec3f(1.0)\n}\n", (4, 1), "expected"),
        // A member that is not there.
        ("fn fragment_shader(fragment: Fragment) -> vec3f { return fragment.colour; }", (1, 67), "`colour`"),
        // A type, found when the body is looked at.
        ("fn fragment_shader(fragment: Fragment) -> vec3f {\n\n    return vec2f(1.0);\n}", (3, 12), ""),
        // The wrong result, which our call would find.
        ("const A = 1;\nfn fragment_shader(fragment: Fragment) -> vec4f { return vec4f(1.0); }", (2, 1), "-> vec3f"),
        ("fn fragment_shader() -> vec3f { return vec3f(1.0); }", (1, 1), "fragment: Fragment"),
        // A name of ours.
        (
            "struct Draw { a: f32 }\nfn fragment_shader(fragment: Fragment) -> vec3f { return vec3f(1.0); }",
            (1, 8),
            "redefinition of `Draw`: the name is taken, choose another",
        ),
        // A parameter that is not there.
        (
            "fn fragment_shader(fragment: Fragment) -> vec3f {\n\treturn parameters.tnit;\n}",
            (2, 9),
            "no definition in scope for identifier: `parameters`",
        ),
    ];
    for (text, (line, column), words) in cases {
        let mut b = Build::new();
        b.program("", text, &[("tint", ShaderValue::Float(1.0))]);
        b.add(Cube::default());
        let error = error_of(&b.scene);
        let RenderError::UserShader { origin, at, message } = &error else { panic!("{error:?}") };
        assert_eq!((at, message.contains(words)), (&Position { line, column }, true), "{text}: {error}");
        let path = ["Separator", "ShaderProgram[1]", "FragmentShader[0]"].map(str::to_owned).to_vec();
        assert_eq!(origin, &ShaderOrigin::Node(Box::new(NodePlace { path, file: None, position: None })));
    }
    // Two texts, the second of which is wrong.
    let mut b = Build::new();
    b.program(&vertex("return vec3f(0.0);"), &fragment("\n return vec3f(1.0) + true;"), &[]);
    b.add(Cube::default());
    let RenderError::UserShader { origin, at, .. } = error_of(&b.scene) else { panic!() };
    assert_eq!(at.line, 2);
    assert!(origin.to_string().ends_with("FragmentShader[1]"), "{origin}");
    // Nothing else is drawn instead, and the renderer can be used on.
    let mut b = Build::new();
    b.add(Cube::default());
    assert!(headless().draw(&frame(&b.scene)).is_ok());
}

#[test]
fn names_that_shaders_can_not_have_are_told() {
    for (name, value) in [("draw", ShaderValue::Texture(0)), ("loop", ShaderValue::Float(0.0))] {
        let mut b = Build::new();
        b.add(Texture2::from_image(hills()));
        let text = format!("fn f() {{ _ = parameters.{name}; _ = {name}; }} {}", fragment("return vec3f(1.0);"));
        b.program("", &text, &[(name, value)]);
        b.add(Cube::default());
        let error = error_of(&b.scene);
        assert!(matches!(error, RenderError::Parameter { .. }), "{error:?}");
        assert!(error.to_string().contains(name) && error.to_string().contains("choose another name"), "{error}");
    }
    let problems = |name: &str| ShaderParameter { name: name.to_owned(), ..Default::default() }.problems().len();
    for bad in ["", "_", "__a", "1a", "a-b", "a b", "é"] {
        assert_eq!(problems(bad), 1, "{bad}");
    }
    for good in ["a", "_a", "snow_line", "A1"] {
        assert_eq!(problems(good), 0, "{good}");
    }
}

/// What can be told without compiling is an error of the render action.
#[test]
fn what_is_missing_is_told_by_the_action() {
    let error = |build: &dyn Fn(&mut Build)| {
        let mut b = Build::new();
        build(&mut b);
        b.add(Cube::default());
        // Boxes and picks do not look.
        BoundingBoxAction::default().apply(&b.scene).unwrap();
        RenderAction::new(8, 8).apply(&b.scene).unwrap_err().to_string()
    };
    let no_function = error(&|b| {
        b.program("", "fn fragment_shadr(fragment: Fragment) -> vec3f { return vec3f(1.0); }", &[]);
    });
    assert!(no_function.contains("no function `fragment_shader`") && no_function.contains("-> vec3f"), "{no_function}");
    let no_texture = error(&|b| {
        let text = fragment("return textureSample(rock, rock_sampler, fragment.position.xy).rgb;");
        b.program("", &text, &[("rock", ShaderValue::Texture(3))]);
    });
    assert!(no_texture.contains("rock") && no_texture.contains("unit 3"), "{no_texture}");
    let twice = error(&|b| {
        let program = b.program(&vertex("return vec3f(0.0);"), &fragment("return vec3f(1.0);"), &[]);
        for (stage, value) in b.scene.children(program).to_vec().into_iter().zip([1.0, 2.0]) {
            let value = ShaderValue::Float(value);
            b.scene.add(stage, ShaderParameter { name: "a".into(), value }).unwrap();
        }
    });
    assert!(twice.contains("two parameters of the name a"), "{twice}");
    let no_file = error(&|b| {
        let program = b.add(ShaderProgram::default());
        let source_program = ShaderSource::File("no such.wgsl".into());
        b.scene.add(program, FragmentShader { source_program, ..Default::default() }).unwrap();
    });
    assert!(no_file.contains("there is no file no such.wgsl"), "{no_file}");
}

/// Files are found beside the scene, one that both stages name is there once, and mistakes in them name the file.
#[test]
fn texts_come_from_files() {
    let folder = tempfile::tempdir().unwrap();
    let both = "fn half(x: f32) -> f32 { return 0.5 * x; }\n\
        fn vertex_shader(vertex: Vertex) -> vec3f { return vec3f(0.0, 0.0, half(2.0)); }\n\
        fn fragment_shader(fragment: Fragment) -> vec3f { return vec3f(half(1.0), parameters.a, 0.0); }\n";
    std::fs::write(folder.path().join("both.wgsl"), format!("\u{feff}{both}")).unwrap();
    let text = r#"Scene(version: 1, root: Separator(children: [
        PerspectiveCamera(),
        ShaderProgram(shader_object: [
            VertexShader(source_program: File("both.wgsl")),
            FragmentShader(
                source_program: File("both.wgsl"),
                parameter: [ShaderParameter(name: "a", value: Float(0.25))],
            ),
        ]),
        Sphere(),
    ]))"#;
    let path = folder.path().join("scene.ron");
    std::fs::write(&path, text).unwrap();
    let scene = seamount::format::read_scene(&path).unwrap();
    let frame = frame(&scene);
    assert_eq!(draw_text(&frame.draws[0], FORMAT).unwrap().matches("fn half").count(), 1);
    assert_eq!(linear().draw(&frame).at(SIZE[0] / 2, SIZE[1] / 2), [0.5, 0.25, 0.0, 1.0]);

    // A changed file is read when the scene's resources are forgotten.
    std::fs::write(folder.path().join("both.wgsl"), both.replace("half(1.0)", "halve(1.0)")).unwrap();
    scene.resources().forget();
    let error = error_of(&scene).to_string();
    let want =
        format!("{}:3:64: no definition in scope for identifier: `halve`", folder.path().join("both.wgsl").display());
    assert_eq!(error, want);

    std::fs::write(
        &path,
        text.replace(
            "VertexShader(source_program: File(\"both.wgsl\"))",
            "VertexShader(source_program: File(\"bth.wgsl\"))",
        ),
    )
    .unwrap();
    let error = seamount::format::read_scene(&path).unwrap_err().to_string();
    assert!(error.contains("scene.ron:4:42: there is no file") && error.contains("bth.wgsl"), "{error}");
}

/// Programs are written as they are read.
#[test]
fn programs_survive_writing() {
    let text = r##"Scene(version: 1, root: Separator(children: [
        ShaderProgram(shader_object: [
            VertexShader(source_program: File("lift.wgsl"), parameter: [
                ShaderParameter(name: "a", value: Vec3(1, 2.5, -3)),
                ShaderParameter(name: "m", value: Mat2x3((1, 2, 3), (4, 5, 6))),
                ShaderParameter(name: "n", value: IVec2(-1, 2)),
                ShaderParameter(name: "t", value: Data(3)),
            ]),
            FragmentShader(source_program: Wgsl(r#"
                fn fragment_shader(fragment: Fragment) -> vec3f { return "vec3f"; }
            "#)),
        ]),
    ]))"##;
    let registry = seamount::node::Registry::default();
    let scene = seamount::format::parse(text, &registry).unwrap();
    let written = seamount::format::write_scene(&scene).unwrap();
    let again = seamount::format::parse(&written, &registry).unwrap();
    assert_eq!(seamount::format::write_scene(&again).unwrap(), written);
    let stages = |scene: &Scene| scene.children(scene.children(scene.root())[0]).to_vec();
    let (first, second) = (stages(&scene), stages(&again));
    assert_eq!(scene.get::<FragmentShader>(first[1]), again.get::<FragmentShader>(second[1]));
    let parameters = |scene: &Scene, stage: NodeKey| -> Vec<ShaderParameter> {
        scene.children(stage).iter().filter_map(|&key| scene.get(key).cloned()).collect()
    };
    let read = parameters(&scene, first[0]);
    assert_eq!(read, parameters(&again, second[0]));
    assert_eq!(read[0].value, ShaderValue::Vec3(1.0, 2.5, -3.0));
    assert_eq!(read[1].value, ShaderValue::Mat2x3([1.0, 2.0, 3.0], [4.0, 5.0, 6.0]));
    for (bad, words) in
        [("Vec3(1, 2)", "3"), ("Float(1e400)", "finite"), ("Vect3(1, 2, 3)", "Vec3"), ("1.0", "Texture")]
    {
        let text = format!("Scene(version: 1, root: Group(children: [ShaderParameter(name: \"a\", value: {bad})]))");
        let error = seamount::format::parse(&text, &registry).unwrap_err().to_string();
        assert!(error.contains("`value`") && error.contains(words), "{bad}: {error}");
    }
}

/// From frame to frame the code of a program is the same thing, whatever else is edited: nobody reads or compares its text again.
#[test]
fn a_program_is_read_once() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("own.wgsl");
    std::fs::write(&file, fragment("return parameters.a;")).unwrap();
    let mut b = Build::new();
    let camera = b.scene.children(b.scene.root())[0];
    let program = b.scene.add(b.scene.root(), ShaderProgram::default()).unwrap();
    let source_program = ShaderSource::File(file.to_str().unwrap().to_owned());
    let stage = b.scene.add(program, FragmentShader { source_program, ..Default::default() }).unwrap();
    let value = ShaderValue::Vec3(0.0, 0.0, 0.0);
    let parameter = b.scene.add(stage, ShaderParameter { name: "a".to_owned(), value }).unwrap();
    b.add(Cube::default());
    b.add(Cube::default());
    let mut scene = b.scene;
    let code = |scene: &Scene| {
        let frame = frame(scene);
        let codes: Vec<_> = frame.draws.iter().map(|draw| Arc::clone(&draw.program.as_ref().unwrap().code)).collect();
        assert_eq!(codes.len(), 2);
        assert!(Arc::ptr_eq(&codes[0], &codes[1]));
        (Arc::clone(&codes[0]), frame.draws[0].program.as_ref().unwrap().values.to_vec())
    };
    let first = code(&scene);
    scene.edit::<PerspectiveCamera>(camera).unwrap().height_angle *= 0.9;
    let moved = code(&scene);
    assert!(Arc::ptr_eq(&first.0, &moved.0), "a camera moved");
    // An edit of the program is seen, and what compiles to the same is equal.
    scene.edit::<ShaderParameter>(parameter).unwrap().value = ShaderValue::Vec3(1.0, 0.0, 0.0);
    let edited = code(&scene);
    assert_eq!((&edited.0, edited.1), (&first.0, vec![ShaderValue::Vec3(1.0, 0.0, 0.0)]));
    // The file is read again when it is asked for, and not before.
    std::fs::write(&file, fragment("return 0.5 * parameters.a;")).unwrap();
    assert!(Arc::ptr_eq(&code(&scene).0, &edited.0));
    scene.resources().forget();
    let read = code(&scene).0;
    assert!(read.texts[0].text.contains("0.5") && read != edited.0);
    // Where a text in place stands is told by the path of its node, also after it has another.
    let text = "fn fragment_shader(fragment: Fragment) -> vec3f { return vec3f(1.0) + parameters.a; }";
    scene.edit::<FragmentShader>(stage).unwrap().source_program = ShaderSource::Wgsl(text.to_owned());
    let origin = |scene: &Scene| code(scene).0.texts[0].origin.to_string();
    let before = origin(&scene);
    let root = scene.root();
    scene.set_name(root, "top").unwrap();
    assert_ne!(origin(&scene), before);
    assert!(origin(&scene).contains("top"));
}

/// The report of effects names the program and counts its bytes.
#[test]
fn the_report_of_effects_names_the_program() {
    let mut b = Build::new();
    let text = fragment("return parameters.a + lit(fragment, fragment.color);");
    b.program(&vertex("return vec3f(0.0);"), &text, &[("a", ShaderValue::Vec3(0.0, 0.0, 0.0))]);
    b.add(DirectionalLight::default());
    b.add(Cube::default());
    let Explained { frame, draws, .. } = RenderAction::new(64, 64).explain(&b.scene).unwrap();
    let by: Vec<_> = draws[0].asked.iter().map(|(name, by)| (name.as_str(), by.concat().join("/"))).collect();
    let program = || "Separator/ShaderProgram[1]".to_owned();
    assert!(by.contains(&("vertex-shader", program())) && by.contains(&("fragment-shader", program())), "{by:?}");
    let mut gpu = headless();
    gpu.draw(&frame).unwrap();
    let with = gpu.costs(&frame).unwrap()[0];
    let mut b = Build::new();
    b.add(DirectionalLight::default());
    b.add(Cube::default());
    let plain = RenderAction::new(64, 64).apply(&b.scene).unwrap();
    gpu.draw(&plain).unwrap();
    let without = gpu.costs(&plain).unwrap()[0];
    assert!(with.shader_bytes > without.shader_bytes + text.len() as u64);
    // The three matrices of the vertex shader, and a vector.
    assert!(with.uniform_bytes >= without.uniform_bytes + 128 + 16, "{with:?} {without:?}");
}

/// Colours for study are instead of a fragment shader; a vertex shader still acts.
#[test]
fn colours_for_study_are_instead_of_fragment_shaders() {
    let mut b = Build::new();
    b.program(&vertex("return vec3f(0.0, 0.0, 20.0);"), &fragment("return vec3f(1.0, 0.0, 0.0);"), &[]);
    b.add(Texture2::from_image(hills()));
    b.add(SeamlessTerrain { color_mode: ColorMode::Levels, ..ground() });
    let names = frame(&b.scene).draws[0].effects.names();
    assert!(names.contains(&"vertex-shader".to_owned()) && !names.contains(&"fragment-shader".to_owned()), "{names:?}");
    headless().draw(&frame(&b.scene)).unwrap();
}
