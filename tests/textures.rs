//! Textures on meshes: each pixel shows the texel at the texture coordinate that a ray finds there.
#![cfg(feature = "render")]

mod common;

use std::sync::Arc;

use common::gpu::{headless, linear};
use glam::{DAffine2, DVec2};
use seamount::action::{CallbackAction, Geometry, ShapeContext, ShapeError, intersect_triangle, linear_color};
use seamount::define_node;
use seamount::format::parse;
use seamount::node::{Registry, ShapeNode, Triangle, Wrap};
use seamount::prelude::*;

const SIZE: [u32; 2] = [96, 72];
const SIDE: u32 = 8;

/// Texels that differ from all others, none of them dark.
fn texels() -> Vec<[u8; 4]> {
    let mut rng = common::Rng(5);
    (0..SIDE * SIDE)
        .map(|k| [64 + 3 * (k as u8), 64 + (rng.below(190) as u8), 64 + rng.below(190) as u8, 255])
        .collect()
}

fn image() -> Arc<Image> {
    Arc::new(Image::new(SIDE, SIDE, Pixels::Rgba8(texels())).expect("an image"))
}

const EYE: &str =
    "PerspectiveCamera(position: (1.4, 1.9, 4.0), look_at: (0.0, 0.0, 0.0)), LightModel(model: BaseColor),
    BaseColor(rgb: (1.0, 1.0, 1.0)),";

/// A scene whose textures are all the same image.
fn scene_of(nodes: &str) -> Scene {
    let text = format!("Scene(version: 1, root: Separator(children: [{nodes}]))");
    let mut scene = parse(&text, &Registry::default()).unwrap_or_else(|e| panic!("{e}"));
    for key in scene.children(scene.root()).to_vec() {
        if let Some(mut texture) = scene.edit::<Texture2>(key) {
            texture.image = Some(seamount::node::ImageRef(image()));
        }
    }
    scene
}

/// The colour of the nearest texel, in linear light.
fn look_up(uv: DVec2, wrap: [Wrap; 2]) -> [f32; 3] {
    let place = |x: f64, wrap: Wrap| {
        let texel = (x * f64::from(SIDE)).floor() as i64;
        match wrap {
            Wrap::Repeat => texel.rem_euclid(SIDE.into()),
            Wrap::Clamp => texel.clamp(0, i64::from(SIDE) - 1),
        }
    };
    let (column, row) = (place(uv.x, wrap[0]), i64::from(SIDE) - 1 - place(uv.y, wrap[1]));
    let [r, g, b, _] = texels()[(row * i64::from(SIDE) + column) as usize];
    linear_color(glam::Vec3::new(r.into(), g.into(), b.into()) / 255.0).to_array()
}

/// Draws the scene, and holds each pixel against the triangles one by one, and the pick against them. Returns how many pixels
/// were held against the image.
fn check(nodes: &str, moved: DAffine2, wrap: [Wrap; 2], pick_tolerance: f64) -> usize {
    let scene = scene_of(&format!("{EYE} {nodes}"));
    let picture = linear().draw(&RenderAction::new(SIZE[0], SIZE[1]).apply(&scene).expect("a frame"));
    let mut triangles = Vec::new();
    CallbackAction::new().triangles(None, |_, t| triangles.push(*t)).apply(&scene).expect("triangles");
    let picker = RayPickAction::pixel(0, 0, SIZE).picker(&scene).expect("a picker");
    let mut checked = 0;
    for (x, y) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))) {
        let ray = |dx: f64, dy: f64| {
            let [w, h] = SIZE.map(f64::from);
            picker.ray_through((f64::from(x) + 0.5 + dx) / w, (f64::from(y) + 0.5 + dy) / h).expect("a ray")
        };
        let nearest = |ray: &Ray| {
            let hits = triangles.iter().enumerate().filter_map(|(k, t)| Some((k, intersect_triangle(ray, t)?)));
            hits.min_by(|a, b| a.1.t.total_cmp(&b.1.t))
        };
        let ray_here = ray(0.0, 0.0);
        let Some((triangle, hit)) = nearest(&ray_here) else { continue };
        // A device snaps corners to 1/256 of a pixel: what is the same a little further is the same in the picture.
        let color = |uv: DVec2| look_up(moved.transform_point2(uv), wrap);
        let around = [(0.05, 0.0), (-0.05, 0.0), (0.0, 0.05), (0.0, -0.05)];
        let sure = |(dx, dy): (f64, f64)| {
            nearest(&ray(dx, dy)).is_some_and(|(k, other)| k == triangle && color(other.uv) == color(hit.uv))
        };
        if !around.into_iter().all(sure) {
            continue;
        }
        let picked = picker.pick(&ray_here, false).expect("a pick");
        if let Some(picked) = picked.first() {
            let facing = picked.normal.dot(ray_here.direction.normalize()).abs();
            // Along the silhouette of a round shape a ray leaves the triangles far from where it leaves the shape.
            if pick_tolerance < 1e-6 || facing > 0.5 {
                let off = (picked.uv - hit.uv).abs();
                // Around the back s starts again.
                let off = DVec2::new(if pick_tolerance > 1e-6 { off.x.min(1.0 - off.x) } else { off.x }, off.y);
                assert!(off.max_element() <= pick_tolerance, "{nodes} at ({x}, {y}): {} is not {}", picked.uv, hit.uv);
            }
        }
        let (got, want) = (picture.at(x, y), color(hit.uv));
        // Half floats have 11 bits; sRGB is decoded to at least 10 by the device.
        let close = got.iter().zip(want).all(|(g, w)| (g - w).abs() <= 2e-3);
        assert!(close, "{nodes} at ({x}, {y}), uv {}: {got:?} is not {want:?}", hit.uv);
        checked += 1;
    }
    checked
}

const REPEAT: [Wrap; 2] = [Wrap::Repeat; 2];

/// Sets of faces with the coordinates that they are given, by index or not, and with those of their box.
const SHAPES: [&str; 9] = [
    "Coordinate3(point: [(-1.4, -1.0, 0.2), (1.4, -1.0, 0.0), (1.4, 1.0, 0.3), (-1.4, 1.0, -0.5)]),
     IndexedFaceSet(coord_index: [0, 1, 2, -1, 0, 2, 3])",
    "Coordinate3(point: [(-1.4, -1.0, 0.2), (1.4, -1.0, 0.0), (1.4, 1.0, 0.3), (-1.4, 1.0, -0.5)]),
     TextureCoordinate2(point: [(0.2, 0.1), (0.9, 0.2), (0.8, 0.9), (0.1, 0.8), (0.5, 0.5)]),
     IndexedFaceSet(coord_index: [0, 1, 2, -1, 0, 2, 3], texture_coord_index: [3, 1, 4, -1, 0, 4, 2])",
    "Coordinate3(point: [(-1.4, -1.0, 0.2), (1.4, -1.0, 0.0), (1.4, 1.0, 0.3), (-1.4, 1.0, -0.5)]),
     TextureCoordinate2(point: [(0.2, 0.1), (0.9, 0.2), (0.8, 0.9), (0.1, 0.8)]), FaceSet()",
    "TriangleStripSet(vertex_property: [VertexProperty(
        vertex: [(-1.4, -1.0, 0.2), (1.4, -1.0, 0.0), (-1.4, 1.0, -0.5), (1.4, 1.0, 0.3)],
        tex_coord: [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)])])",
    "Coordinate3(point: [(-1.4, -1.0, 0.2), (1.4, -1.0, 0.0), (-1.4, 1.0, -0.5), (1.4, 1.0, 0.3)]),
     TextureCoordinate2(point: [(0.2, 0.1), (0.9, 0.2), (0.8, 0.9), (0.1, 0.8)]),
     IndexedTriangleStripSet(coord_index: [0, 1, 2, 3], texture_coord_index: [3, 2, 1, 0])",
    "Coordinate3(point: [(-1.4, -1.0, 0.2), (0.0, -1.0, 1.0), (1.4, -1.0, 0.0), (-1.4, 1.0, -0.5), (0.0, 1.0, 0.5), (1.4, 1.0, 0.3)]),
     ShapeHints(crease_angle: 3.0), QuadMesh(vertices_per_row: 3, vertices_per_column: 2)",
    "Cube()",
    "Cube(width: 3.0, height: 1.0)",
    // More texels than pixels, so that most are between.
    "Texture2Transform(scale_factor: (0.5, 0.25)), Cube()",
];

#[test]
fn pixels_show_the_texels_that_picks_find() {
    for shape in SHAPES {
        let moved = if shape.starts_with("Texture2Transform") {
            Texture2Transform { scale_factor: DVec2::new(0.5, 0.25), ..Default::default() }.affine()
        } else {
            DAffine2::IDENTITY
        };
        let checked = check(&format!("Texture2(), {shape}"), moved, REPEAT, 1e-9);
        assert!(checked > 700, "{shape}: {checked} pixels");
    }
}

/// Round shapes are drawn as facets and picked exactly: facets show the image as their own coordinates say, and those are the
/// picked ones up to what the facets are off. With 29 slices and 31 stacks a ray at 60° meets them up to
/// (0.217² + 0.101²) / 8 · √3 of the radius aside: 0.0125, which is 0.004 of the way around where the sphere is half as wide; facets
/// at poles and tips miss up to half a slice.
#[test]
fn round_shapes_show_the_image_around_them() {
    let half_a_slice = |slices: f64| 0.5 / slices + 0.005;
    for (shape, tolerance) in [
        ("Sphere(radius: 1.2)", half_a_slice(29.0)),
        ("Cylinder(radius: 0.9)", 0.005),
        ("Cone(bottom_radius: 1.1)", half_a_slice(40.0)),
    ] {
        let checked =
            check(&format!("Complexity(value: 1.0), Texture2(), {shape}"), DAffine2::IDENTITY, REPEAT, tolerance);
        assert!(checked > 300, "{shape}: {checked} pixels");
    }
}

/// Beyond the border an image goes on as the texture says, with and without a transform.
#[test]
fn wraps_and_transforms_are_those_of_the_texture() {
    let square = "TextureCoordinate2(point: [(-1.3, -0.8), (1.9, -0.8), (1.9, 2.2), (-1.3, 2.2)]),
        Coordinate3(point: [(-1.4, -1.4, 0.0), (1.4, -1.4, 0.0), (1.4, 1.4, 0.0), (-1.4, 1.4, 0.0)]), FaceSet()";
    let turn =
        "Texture2Transform(translation: (0.3, -0.1), rotation: 0.7, scale_factor: (0.8, 1.7), center: (0.5, 0.25)),";
    let turned = Texture2Transform {
        translation: DVec2::new(0.3, -0.1),
        rotation: 0.7,
        scale_factor: DVec2::new(0.8, 1.7),
        center: DVec2::new(0.5, 0.25),
    };
    for s in [Wrap::Repeat, Wrap::Clamp] {
        for t in [Wrap::Repeat, Wrap::Clamp] {
            for (transform, moved) in [("", DAffine2::IDENTITY), (turn, turned.affine())] {
                for unit in ["", "TextureUnit(unit: 1),"] {
                    let nodes = format!("{unit} {transform} Texture2(wrap_s: {s:?}, wrap_t: {t:?}), {square}");
                    assert!(check(&nodes, moved, [s, t], 1e-9) > 500, "{nodes}");
                }
            }
        }
    }
}

fn middle(nodes: &str) -> [f32; 4] {
    let scene = scene_of(&format!("OrthographicCamera(position: (0.0, 0.0, 9.0), height: 2.0), {nodes}"));
    linear().draw(&RenderAction::new(9, 9).apply(&scene).expect("a frame")).at(4, 4)
}

/// In the middle of it is the texel in column 4 and, counted from below, row 4.
const FACE: &str = "Coordinate3(point: [(-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 1.0, 0.0), (-1.0, 1.0, 0.0)]),
    TextureCoordinate2(point: [(0.06, 0.06), (1.06, 0.06), (1.06, 1.06), (0.06, 1.06)]), FaceSet()";

/// The image multiplies the colours, of the material, of corners, and in the light.
#[test]
fn the_image_multiplies_the_material() {
    let texel = look_up(DVec2::splat(0.56), REPEAT);
    let close = |got: [f32; 4], want: [f32; 3], what: &str| {
        assert!(got.iter().zip(want).all(|(g, w)| (g - w).abs() < 2e-3), "{what}: {got:?} is not {want:?}");
    };
    let grey = 0.5_f32;
    let dim = linear_color(glam::Vec3::splat(grey)).x;
    let unlit = "LightModel(model: BaseColor),";
    close(
        middle(&format!("{unlit} BaseColor(rgb: (0.5, 0.5, 0.5)), Texture2(), {FACE}")),
        texel.map(|c| c * dim),
        "unlit",
    );
    let corners = "BaseColor(rgb: [(0.5, 0.5, 0.5), (0.1, 0.9, 0.1)]), MaterialBinding(value: PerFace),";
    close(middle(&format!("{unlit} {corners} Texture2(), {FACE}")), texel.map(|c| c * dim), "by face");
    let light = "Environment(ambient_intensity: 0.0), DirectionalLight(direction: (0.0, -0.6, -0.8)),";
    close(
        middle(&format!("{light} BaseColor(rgb: (0.5, 0.5, 0.5)), Texture2(), {FACE}")),
        texel.map(|c| c * dim * 0.8),
        "in the light",
    );
    // Faces with edges have corners of their own.
    let large = "Coordinate3(point: [(-2.0, -2.0, 0.0), (4.0, -2.0, 0.0), (-2.0, 4.0, 0.0)]),
        TextureCoordinate2(point: [(-0.44, -0.44), (2.56, -0.44), (-0.44, 2.56)]), FaceSet()";
    for style in ["", "DrawStyle(style: FilledLines),"] {
        let got = middle(&format!("{unlit} {style} BaseColor(rgb: (1.0, 1.0, 1.0)), Texture2(), {large}"));
        close(got, texel, "with edges");
    }
}

/// The texture of the unit for colours goes before that of unit 0; other units, and textures that were taken away, are not seen.
#[test]
fn the_unit_for_colours_is_seen() {
    let unlit = "LightModel(model: BaseColor), BaseColor(rgb: (1.0, 1.0, 1.0)),";
    let texel = look_up(DVec2::splat(0.56), REPEAT);
    let program = "ShaderProgram(shader_object: [FragmentShader(parameter: [ShaderParameter(name: \"color_map\", value: Texture(3))])]),";
    for (nodes, shown) in [
        ("Texture2(),".to_owned(), true),
        ("TextureUnit(unit: 1), Texture2(),".to_owned(), true),
        ("TextureUnit(unit: 2), Texture2(),".to_owned(), false),
        (format!("{program} TextureUnit(unit: 3), Texture2(),"), true),
        (format!("{program} TextureUnit(unit: 1), Texture2(),"), false),
        (format!("{program} TextureUnit(unit: 0), Texture2(),"), true),
        ("Separator(children: [Texture2(filename: \"none.png\")]),".to_owned(), false),
    ] {
        let want = if shown { texel } else { [1.0; 3] };
        let got = middle(&format!("{unlit} {nodes} {FACE}"));
        assert!(got.iter().zip(want).all(|(g, w)| (g - w).abs() < 2e-3), "{nodes}: {got:?} is not {want:?}");
    }
}

/// Alpha of the image is opacity: what is behind shows through, and holes hide nothing, whichever of them is drawn first.
#[test]
fn what_is_behind_shows_through_the_image() {
    let image =
        |alpha: u8| Texture2::from_image(Image::new(1, 1, Pixels::Rgba8(vec![[255, 0, 0, alpha]])).expect("one"));
    let picture = |alpha: u8, order: [f64; 2]| {
        let mut scene = Scene::with_root(Separator::default());
        let root = scene.root();
        let camera = OrthographicCamera { position: Some(DVec3::Z * 9.0), height: 2.0, ..Default::default() };
        scene.add(root, camera).expect("a child");
        scene.add(root, BaseColor { rgb: Color::WHITE.into() }).expect("a child");
        for z in order {
            let place = scene.add(root, Separator::default()).expect("a child");
            scene.add(place, Translation { translation: DVec3::Z * z }).expect("a child");
            scene.add(place, if z > 0.0 { image(alpha) } else { image(128) }).expect("a child");
            if z < 0.0 {
                scene.add(place, BaseColor { rgb: Color::new(0.0, 0.0, 0.0).into() }).expect("a child");
            }
            scene.add(place, Cube { width: 3.0, height: 3.0, depth: 0.1 }).expect("a child");
        }
        let action = RenderAction { background: Color::WHITE, ..RenderAction::new(9, 9) };
        linear().draw(&action.apply(&scene).expect("a frame")).at(4, 4)
    };
    // The one behind is black and lets 127/255 of white through.
    let behind = 127.0 / 255.0;
    for order in [[1.0, -1.0], [-1.0, 1.0]] {
        for alpha in [0, 51, 255] {
            let a = f32::from(alpha) / 255.0;
            let want = [a + (1.0 - a) * behind, (1.0 - a) * behind, (1.0 - a) * behind];
            let got = picture(alpha, order);
            assert!(
                got.iter().zip(want).all(|(g, w)| (g - w).abs() < 2e-3),
                "{alpha} {order:?}: {got:?} is not {want:?}"
            );
        }
    }
}

define_node! {
    /// A square that says nothing of textures.
    pub struct Bare: shape {}
}

impl ShapeNode for Bare {
    fn bounds(&self, _: &ShapeContext<'_>) -> Result<Option<Aabb>, ShapeError> {
        Ok(Some(Aabb { min: DVec3::new(-1.0, -1.0, 0.0), max: DVec3::new(1.0, 1.0, 0.0) }))
    }

    fn primitives(&self, _: &ShapeContext<'_>, sink: &mut dyn FnMut(Triangle)) -> Result<(), ShapeError> {
        let [a, b, c, d] = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
        for points in [[a, b, c], [a, c, d]] {
            sink(Triangle { points, normals: [DVec3::Z; 3], ..Triangle::default() });
        }
        Ok(())
    }
}

/// Without a texture, or without texture coordinates, there are neither coordinates nor an image on the device; with them each
/// corner costs eight bytes.
#[test]
fn without_a_texture_nothing_is_paid() {
    let build = |texture: Option<Texture2>, shape: fn(&mut Scene)| {
        let mut scene = Scene::with_root(Separator::default());
        let root = scene.root();
        scene.add(root, PerspectiveCamera { position: Some(DVec3::Z * 9.0), ..Default::default() }).expect("a child");
        if let Some(texture) = texture {
            scene.add(root, texture).expect("a child");
        }
        shape(&mut scene);
        RenderAction::new(32, 32).apply(&scene).expect("a frame")
    };
    let add_cube = |scene: &mut Scene| {
        scene.add(scene.root(), Cube::default()).expect("a child");
    };
    let add_bare = |scene: &mut Scene| {
        scene.add(scene.root(), Bare::default()).expect("a child");
    };
    let texture = || Some(Texture2::from_image(image()));
    let mut gpu = headless();
    let mut costs = |frame: &Frame| {
        gpu.draw(frame).expect("a picture");
        gpu.costs(frame).expect("costs")[0]
    };
    let corners = |frame: &Frame| match &frame.draws[0].geometry {
        Geometry::Mesh(mesh) => (mesh.positions.len() as u64, mesh.uvs.len() as u64),
        other => panic!("{other:?}"),
    };
    let (without, with) = (build(None, add_cube), build(texture(), add_cube));
    let (bare, bare_with) = (build(None, add_bare), build(texture(), add_bare));
    assert_eq!((corners(&without), corners(&with)), ((36, 0), (36, 36)));
    assert_eq!((corners(&bare), corners(&bare_with)), ((6, 0), (6, 0)));
    let (cost, cost_with) = (costs(&without), costs(&with));
    assert_eq!(cost_with.buffer_bytes, cost.buffer_bytes + 36 * 8);
    assert_eq!((cost.texture_bytes, cost_with.texture_bytes), (0, u64::from(4 * SIDE * SIDE)));
    let (cost, cost_with) = (costs(&bare), costs(&bare_with));
    assert_eq!((cost_with.buffer_bytes, cost_with.texture_bytes), (cost.buffer_bytes, 0));
    assert_eq!(bare.draws[0].effects, bare_with.draws[0].effects);
}

/// What was kept of a mesh for the GPU follows the texture that comes and goes.
#[test]
fn a_texture_may_come_and_go() {
    let unlit = "OrthographicCamera(position: (0.0, 0.0, 9.0), height: 2.0), LightModel(model: BaseColor),
        BaseColor(rgb: (1.0, 1.0, 1.0)),";
    let mut scene = scene_of(&format!("{unlit} Texture2(), {FACE}"));
    let texture = scene.children(scene.root())[3];
    let pixel = |scene: &Scene| linear().draw(&RenderAction::new(9, 9).apply(scene).expect("a frame")).at(4, 4)[0];
    let want = look_up(DVec2::splat(0.56), REPEAT)[0];
    for _ in 0..2 {
        assert!((pixel(&scene) - want).abs() < 2e-3);
        let image = scene.edit::<Texture2>(texture).expect("a texture").image.take();
        assert_eq!(pixel(&scene), 1.0);
        scene.edit::<Texture2>(texture).expect("a texture").image = image;
    }
}
