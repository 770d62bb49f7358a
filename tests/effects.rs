//! Effects: a scene that does not ask for one holds no trace of it, and one that asks shows it where it belongs.
#![cfg(feature = "render")]

mod common;
#[path = "effects/pictures.rs"]
mod pictures;

use std::collections::BTreeSet;
use std::sync::Arc;

use common::gpu::{headless, linear};
use seamount::action::{BACKGROUNDS, Draw, EFFECTS, Explained, Frame};
use seamount::node::OffsetStyle;
use seamount::prelude::*;
use seamount::render::{DrawCost, draw_text};
use seamount::terrain::{LatticeLight, ShadowMap};
use wgpu::naga;

/// A pair of scenes, without an effect and with it.
struct Pair {
    /// Name of the effect in [`EFFECTS`].
    effect: &'static str,
    /// Effects that come along with it.
    brings: &'static [&'static str],
    /// Words of the shader that tell it.
    words: &'static [&'static str],
    /// Nodes before the ground.
    without: fn(&mut Build),
    with: fn(&mut Build),
    /// Whether the ground at a place has to look different, the same, or may be either.
    changes: fn(&PickedPoint) -> Option<bool>,
}

/// Adds nodes before the ground, and changes the ground.
struct Build {
    scene: Scene,
    group: NodeKey,
    terrain: SeamlessTerrain,
    /// What stands in place of the terrain, for effects that terrains do not have.
    mesh: Option<IndexedFaceSet>,
}

impl Build {
    fn add(&mut self, node: impl Node) -> &mut Self {
        self.scene.add(self.group, node).unwrap();
        self
    }
}

/// 33 × 33 samples of hills, 16 bits; 1 × 1 wide and up to 0.2 high.
fn hills() -> Image {
    let height = |c: f64, r: f64| 0.5 + 0.25 * (c * 0.5).sin() + 0.25 * (r * 0.37 + c * 0.1).cos();
    let samples = (0..33 * 33).map(|i| (height(f64::from(i % 33), f64::from(i / 33)) * 65535.0) as u16);
    Image::new(33, 33, Pixels::Gray16(samples.collect())).unwrap()
}

/// A cube that nothing acts on, and the ground in a separator with what `nodes` puts before it. The ground is drawn in full, so
/// that picks say what each pixel shows.
fn scene(nodes: impl FnOnce(&mut Build)) -> Scene {
    let mut scene = Scene::with_root(Separator::default());
    let root = scene.root();
    let (position, look_at) = (Some(DVec3::new(0.4, -1.2, 1.1)), Some(DVec3::new(0.5, 0.5, 0.0)));
    scene.add(root, PerspectiveCamera { position, look_at, ..Default::default() }).unwrap();
    let cube = scene.add(root, Separator::default()).unwrap();
    scene.add(cube, Transform { translation: DVec3::new(-0.3, 0.5, 0.2), ..Default::default() }).unwrap();
    scene.add(cube, Cube { width: 0.2, height: 0.2, depth: 0.2 }).unwrap();
    let group = scene.add(root, Separator::default()).unwrap();
    let terrain = SeamlessTerrain { detail: DetailMode::Full, max_height: 0.2, ..SeamlessTerrain::default() };
    let mut build = Build { scene, group, terrain, mesh: None };
    build.add(Texture2::from_image(Arc::new(hills())));
    nodes(&mut build);
    let terrain = build.terrain.clone();
    match build.mesh.take() {
        Some(mesh) => build.add(mesh),
        None => build.add(terrain),
    };
    build.scene
}

fn sun(b: &mut Build) {
    b.add(DirectionalLight { direction: DVec3::new(0.5, 0.3, -1.0), ..Default::default() });
}

/// So low that hills throw shadows.
const LOW: DVec3 = DVec3::new(0.8, 0.3, -0.3);

fn low_sun(b: &mut Build, shadow: bool) {
    b.add(DirectionalLight { direction: LOW, shadow, ..Default::default() });
}

fn fog(b: &mut Build, fog_type: FogType) {
    b.add(Environment { fog_type, fog_color: Color::new(0.5, 0.6, 0.7), fog_visibility: 3.0, ..Default::default() });
}

/// Triangles that are larger than a pixel.
fn coarse(b: &mut Build) {
    let samples = (0..25u32).map(|i| (i * 7919 % 25) as u16 * 2000).collect();
    b.add(Texture2::from_image(Image::new(5, 5, Pixels::Gray16(samples)).unwrap()));
}

/// Lit ground in levels of detail. Its border is level, so that the outline is the same whatever the detail.
fn bumps(b: &mut Build) {
    let bump = |i: u32| if [i % 33, i / 33].iter().all(|k| (5..28).contains(k)) { i * 7919 % 65_521 } else { 0 };
    let samples = Pixels::Gray16((0..33 * 33).map(|i| bump(i) as u16).collect());
    b.add(Texture2::from_image(Image::new(33, 33, samples).unwrap()));
    sun(b);
    b.terrain.max_height = 0.05;
    b.terrain.detail = DetailMode::PixelError(1.0);
}

/// A colour map whose west is white and whose east is red.
fn halves(b: &mut Build) {
    let image = Image::new(2, 1, Pixels::Rgba8(vec![[255, 255, 255, 255], [255, 0, 0, 255]])).unwrap();
    b.add(TextureUnit { unit: 1 }).add(Texture2::from_image(image));
}

/// As `halves`, with an east that nearly nothing is left of.
fn see_through_halves(b: &mut Build) {
    let image = Image::new(2, 1, Pixels::Rgba8(vec![[255; 4], [255, 255, 255, 10]])).unwrap();
    b.add(TextureUnit { unit: 1 }).add(Texture2::from_image(image));
}

/// Two triangles in the plane of the ground, in place of it.
fn mesh(b: &mut Build) {
    b.add(TextureUnit { unit: 0 }).add(Texture2::default());
    let point = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y].into();
    b.add(Coordinate3 { point });
    let coord_index = [0, 1, 2, -1, 0, 2, 3, -1].into();
    b.mesh = Some(IndexedFaceSet { coord_index, ..IndexedFaceSet::default() });
}

/// The same, over one in another colour: of two in one place the later is seen.
fn two_meshes(b: &mut Build) {
    mesh(b);
    let first = b.mesh.clone().unwrap();
    let under = b.scene.add(b.group, Separator::default()).unwrap();
    b.scene.add(under, BaseColor { rgb: Color::new(1.0, 0.0, 0.0).into() }).unwrap();
    b.scene.add(under, first).unwrap();
}

fn lamp() -> PointLight {
    PointLight { location: DVec3::new(0.5, 0.5, 0.5), ..Default::default() }
}

fn always(_: &PickedPoint) -> Option<bool> {
    Some(true)
}

fn may(_: &PickedPoint) -> Option<bool> {
    None
}

fn pairs() -> Vec<Pair> {
    vec![
        Pair {
            effect: "directional-light",
            brings: &["ambient"],
            words: &["directional", "DIRECTIONAL", "normal", "gradient", "lit_color"],
            without: |_| (),
            with: sun,
            changes: may,
        },
        Pair {
            effect: "point-light",
            brings: &[],
            words: &["PointLight", "POINT", "eye_from_rel", "position: vec3"],
            without: sun,
            with: |b| {
                sun(b);
                b.add(lamp());
            },
            changes: |hit| {
                let towards = DVec3::new(0.5, 0.5, 0.5) - hit.point;
                lit_by(hit, towards)
            },
        },
        Pair {
            effect: "spot-light",
            brings: &[],
            words: &["spot", "SPOT", "cone"],
            without: sun,
            with: |b| {
                sun(b);
                b.add(SpotLight {
                    location: DVec3::new(0.5, 0.5, 0.6),
                    cut_off_angle: 0.4,
                    drop_off_rate: 0.01,
                    ..Default::default()
                });
            },
            changes: |hit| {
                let towards = DVec3::new(0.5, 0.5, 0.6) - hit.point;
                let off_axis = (towards.z / towards.length()).acos();
                if off_axis > 0.41 { Some(false) } else { lit_by(hit, towards).filter(|_| off_axis < 0.39) }
            },
        },
        Pair {
            effect: "attenuation",
            brings: &[],
            words: &["attenuation", "weakening"],
            without: |b| {
                b.add(lamp());
            },
            with: |b| {
                b.add(Environment { attenuation: DVec3::new(2.0, 0.0, 1.0), ..Default::default() }).add(lamp());
            },
            changes: |hit| lit_by(hit, DVec3::new(0.5, 0.5, 0.5) - hit.point),
        },
        Pair {
            effect: "ambient",
            brings: &[],
            words: &["ambient"],
            without: |b| {
                b.add(Environment { ambient_color: Color::BLACK, ..Default::default() });
                sun(b);
            },
            with: sun,
            changes: always,
        },
        Pair {
            effect: "specular",
            brings: &[],
            words: &["specular", "half_way", "highlight", "towards_eye", "eye_from_rel"],
            without: sun,
            with: |b| {
                sun(b);
                b.add(Material { specular_color: Color::WHITE.into(), ..Default::default() });
            },
            changes: |hit| lit_by(hit, DVec3::new(-0.5, -0.3, 1.0)).filter(|lit| !lit),
        },
        Pair {
            effect: "emissive",
            brings: &[],
            words: &["emissive"],
            without: sun,
            with: |b| {
                sun(b);
                b.add(Material { emissive_color: Color::new(0.3, 0.0, 0.0).into(), ..Default::default() });
            },
            changes: always,
        },
        Pair {
            effect: "transparency",
            brings: &[],
            words: &["opacity = draw", "fragment_depth"],
            without: |_| (),
            with: |b| {
                b.add(Material { transparency: List::from(0.5), ..Default::default() });
            },
            changes: always,
        },
        Pair {
            effect: "haze",
            brings: &[],
            words: &["fog", "in_fog", "eye", "1.0 - x"],
            without: |_| (),
            with: |b| fog(b, FogType::Haze),
            changes: always,
        },
        Pair {
            effect: "fog",
            brings: &[],
            words: &["in_fog", "exp(-x)"],
            without: |_| (),
            with: |b| fog(b, FogType::Fog),
            changes: always,
        },
        Pair {
            effect: "smoke",
            brings: &[],
            words: &["in_fog", "exp(-x * x)"],
            without: |_| (),
            with: |b| fog(b, FogType::Smoke),
            changes: always,
        },
        Pair {
            effect: "color-map",
            brings: &[],
            words: &["color_map", "sampler", "texel", "lattice: vec2"],
            without: |_| (),
            with: halves,
            changes: |hit| Some(hit.uv.x > 0.5).filter(|_| (hit.uv.x - 0.5).abs() > 1e-3),
        },
        Pair {
            effect: "color-map-transform",
            brings: &[],
            words: &["color_uv"],
            without: halves,
            with: |b| {
                b.add(TextureUnit { unit: 1 });
                b.add(Texture2Transform { translation: DVec2::new(0.5, 0.0), ..Default::default() });
                halves(b);
            },
            changes: |hit| Some(true).filter(|_| (hit.uv.x - 0.5).abs() > 1e-3 && (1e-3..0.999).contains(&hit.uv.x)),
        },
        Pair {
            effect: "color-map",
            brings: &[],
            words: &["color_map", "sampler", "texel", "uv: vec2", "in.uv"],
            without: mesh,
            with: |b| {
                mesh(b);
                halves(b);
            },
            changes: |hit| Some(hit.uv.x > 0.5).filter(|_| (hit.uv.x - 0.5).abs() > 1e-3),
        },
        Pair {
            effect: "color-map-transform",
            brings: &[],
            words: &["color_uv"],
            without: |b| {
                mesh(b);
                halves(b);
            },
            with: |b| {
                mesh(b);
                halves(b);
                b.add(Texture2Transform { translation: DVec2::new(0.5, 0.0), ..Default::default() });
            },
            changes: |hit| Some(true).filter(|_| (hit.uv.x - 0.5).abs() > 1e-3),
        },
        Pair {
            effect: "color-map-opacity",
            brings: &["transparency"],
            words: &["opacity *= texel.a", "discard", "fragment_depth"],
            without: |b| {
                mesh(b);
                b.add(Texture2::from_image(Image::new(1, 1, Pixels::Gray8(vec![255])).unwrap()));
            },
            with: |b| {
                mesh(b);
                see_through_halves(b);
            },
            changes: |hit| Some(hit.uv.x > 0.5).filter(|_| (hit.uv.x - 0.5).abs() > 1e-3),
        },
        Pair {
            effect: "height-ramp",
            brings: &[],
            words: &["ramp", "relative_height"],
            without: |_| (),
            with: |b| {
                b.add(ColorRamp::default());
            },
            changes: always,
        },
        Pair {
            effect: "slope-ramp",
            brings: &[],
            words: &["ramp", "terrain_slope", "gradients", "atan"],
            without: |_| (),
            with: |b| {
                b.add(ColorRamp { by: RampBy::Slope, ramp: Ramp::Viridis, ..Default::default() });
            },
            changes: always,
        },
        Pair {
            effect: "contours",
            brings: &[],
            words: &["contour", "relative_height", "dpdx"],
            without: |_| (),
            with: |b| {
                b.add(ContourLines { interval: 0.1, ..Default::default() });
            },
            changes: |hit| {
                let lines = hit.object_point.z / 0.1;
                let away = 0.1 * (lines - lines.round()).abs();
                // A pixel shows up to 0.01 of height, and more where the ground is seen at a grazing angle.
                let facing = (DVec3::new(0.4, -1.2, 1.1) - hit.point).normalize().dot(hit.smooth_normal.normalize());
                (facing > 0.5 && !(1e-4..0.03).contains(&away)).then_some(away < 1e-4)
            },
        },
        Pair {
            effect: "detail-textures",
            brings: &[],
            words: &["detail_", "tiles", "sampler"],
            without: |_| (),
            with: |b| {
                let one = |color: [u8; 4]| Texture2::from_image(Image::new(1, 1, Pixels::Rgba8(vec![color])).unwrap());
                let shares = Pixels::Rgba8(vec![[255, 0, 0, 0], [0, 255, 0, 0]]);
                b.add(TextureUnit { unit: 2 }).add(Texture2::from_image(Image::new(2, 1, shares).unwrap()));
                for (unit, color) in [(3, [255; 4]), (4, [255, 0, 0, 255]), (5, [0; 4]), (6, [0; 4])] {
                    b.add(TextureUnit { unit }).add(one(color));
                }
                b.add(DetailTextures { size: 0.1, ..Default::default() });
            },
            changes: |hit| Some(hit.uv.x > 0.5).filter(|_| (hit.uv.x - 0.5).abs() > 1e-3),
        },
        Pair {
            effect: "normal-map",
            brings: &[],
            words: &["normal_map", "relief"],
            without: sun,
            with: |b| {
                sun(b);
                // Flat in the west, and turned east in the east.
                let normals =
                    Image::new(2, 1, Pixels::Rgba8(vec![[128, 128, 255, 255], [200, 128, 210, 255]])).unwrap();
                b.add(TextureUnit { unit: 7 }).add(Texture2::from_image(normals));
                b.add(NormalMap { size: 1.0, ..Default::default() });
            },
            // 128 is not quite 0, so the flat part may change by a trifle.
            changes: |hit| (hit.uv.x > 0.501 && hit.smooth_normal.normalize().z > 0.5).then_some(true),
        },
        Pair {
            effect: "bump-map",
            brings: &[],
            words: &["bump", "rough +="],
            without: sun,
            with: |b| {
                sun(b);
                // Rises eastwards up to the middle and falls again.
                let rise = (0..16u16).map(|i| i.min(16 - i) * 8000).collect();
                b.add(TextureUnit { unit: 8 });
                b.add(Texture2::from_image(Image::new(16, 1, Pixels::Gray16(rise)).unwrap()));
                b.add(BumpMap { size: 1.0, height: 0.5, ..Default::default() });
            },
            // But for the level tops; what is turned away from the light may stay so.
            changes: |hit| {
                let slope = |texels: f64| (hit.uv.x * 16.0 - texels).abs() > 1.1;
                (slope(0.5) && slope(8.5) && slope(16.5) && hit.smooth_normal.normalize().z > 0.9).then_some(true)
            },
        },
        Pair {
            effect: "shadow",
            brings: &[],
            words: &["shadow_depths", "shadow_share", "surface.share"],
            without: |b| low_sun(b, false),
            with: |b| low_sun(b, true),
            changes: |hit| {
                let field = hills().height_field(None).unwrap();
                // 32 cells per unit, rows to the south; 65535 raw units are 0.2 high.
                let towards = -LOW * DVec3::new(32.0, -32.0, 65_535.0 / 0.2);
                let map = ShadowMap::new(&field, &LatticeLight { towards, upwards: true });
                let dark = |du, dv| map.is_shadowed(hit.uv.x * 32.0 + du, (1.0 - hit.uv.y) * 32.0 + dv);
                let own = dark(0.0, 0.0);
                // Rounding decides on the border itself; a pixel is up to 1.5 cells.
                let around = [-1.5, 0.0, 1.5].map(|du| [-1.5, 0.0, 1.5].map(|dv| dark(du, dv)));
                let sure = around.as_flattened().iter().all(|&dark| dark == own);
                // What is turned away is dark already, but for the smoothing of normals far away.
                lit_by(hit, -LOW).filter(|&lit| sure && (lit || !own)).map(|_| own)
            },
        },
        Pair {
            effect: "color-by-part",
            brings: &[],
            words: &[],
            without: |_| (),
            with: |b| b.terrain.color_mode = ColorMode::Parts,
            changes: always,
        },
        Pair {
            effect: "color-by-error",
            brings: &[],
            words: &["error", "ramp", "patch_color"],
            without: |_| (),
            with: |b| b.terrain.color_mode = ColorMode::Errors,
            changes: always,
        },
        Pair {
            effect: "color-by-vertex",
            brings: &[],
            words: &["color: vec4", "in.color"],
            without: mesh,
            with: |b| {
                mesh(b);
                // The first half as it was.
                b.add(BaseColor { rgb: [Color::new(0.8, 0.8, 0.8), Color::WHITE].into() });
                b.add(MaterialBinding { value: Binding::PerFace });
            },
            changes: |hit| Some(hit.point.x < hit.point.y).filter(|_| (hit.point.x - hit.point.y).abs() > 1e-3),
        },
        Pair {
            effect: "color-by-normal",
            brings: &[],
            words: &["normal", "gradient", "linear_from_srgb"],
            without: |_| (),
            with: |b| b.terrain.color_mode = ColorMode::Normals,
            changes: always,
        },
        Pair {
            effect: "lines",
            brings: &[],
            words: &["edge", "shares", "discard"],
            without: coarse,
            with: |b| {
                coarse(b);
                b.add(DrawStyle { style: Style::Lines, ..Default::default() });
            },
            changes: may,
        },
        Pair {
            effect: "clip-plane",
            // What is cut open shows its inside.
            brings: &["two-sided"],
            words: &["clip_planes", "CLIP_PLANES", "discard", "eye_from_rel"],
            without: sun,
            with: |b| {
                sun(b);
                b.add(ClipPlane { plane: Plane { normal: DVec3::X, distance: 0.5 }, on: true });
            },
            changes: |hit| Some(hit.uv.x < 0.5).filter(|_| (hit.uv.x - 0.5).abs() > 1e-4),
        },
        Pair {
            effect: "polygon-offset",
            brings: &[],
            // Depth is moved by the rasteriser.
            words: &[],
            without: two_meshes,
            with: |b| {
                two_meshes(b);
                b.add(PolygonOffset { units: 4.0, ..Default::default() });
            },
            changes: always,
        },
        Pair {
            effect: "two-sided",
            brings: &[],
            words: &["front_facing", "-surface.normal"],
            // Upside down.
            without: |b| {
                sun(b);
                b.add(RotationXyz { axis: Axis::X, angle: std::f64::consts::PI });
                b.add(Translation { translation: DVec3::new(0.0, -1.0, 0.0) });
            },
            with: |b| {
                sun(b);
                b.add(RotationXyz { axis: Axis::X, angle: std::f64::consts::PI });
                b.add(Translation { translation: DVec3::new(0.0, -1.0, 0.0) });
                b.add(ShapeHints { vertex_ordering: VertexOrdering::Counterclockwise, ..Default::default() });
            },
            changes: always,
        },
        Pair {
            effect: "points",
            brings: &[],
            words: &["corner", "shares", "discard"],
            without: coarse,
            with: |b| {
                coarse(b);
                b.add(DrawStyle { style: Style::Points, point_size: 5.0, ..Default::default() });
            },
            changes: may,
        },
        Pair {
            effect: "lines-on-faces",
            brings: &[],
            words: &["edge", "shares", "mix(color, draw.lines"],
            without: coarse,
            with: |b| {
                coarse(b);
                b.add(DrawStyle { style: Style::FilledLines, ..Default::default() });
            },
            changes: may,
        },
        Pair {
            effect: "vertex-shader",
            brings: &[],
            words: &["vertex_shader", "struct Vertex", "local_from_rel", "clip_from_local"],
            // Level at the border, which stays where it is.
            without: bumps,
            with: |b| {
                bumps(b);
                let text = "fn vertex_shader(vertex: Vertex) -> vec3f { return vec3f(0.0, 0.0, -vertex.position.z); }";
                let source_program = ShaderSource::Wgsl(text.to_owned());
                let program = b.scene.add(b.group, ShaderProgram::default()).unwrap();
                b.scene.add(program, VertexShader { source_program, ..Default::default() }).unwrap();
            },
            changes: may,
        },
        Pair {
            effect: "fragment-shader",
            brings: &[],
            words: &["fragment_shader", "struct Fragment", "local_position"],
            without: sun,
            with: |b| {
                sun(b);
                // Red where the ground is high.
                let text = "fn fragment_shader(fragment: Fragment) -> vec3f {
                    return lit(fragment, select(vec3f(1.0), vec3f(1.0, 0.0, 0.0), fragment.position.z > 0.1));
                }";
                let source_program = ShaderSource::Wgsl(text.to_owned());
                let program = b.scene.add(b.group, ShaderProgram::default()).unwrap();
                b.scene.add(program, FragmentShader { source_program, ..Default::default() }).unwrap();
            },
            changes: |hit| Some(hit.object_point.z > 0.1).filter(|_| (hit.object_point.z - 0.1).abs() > 1e-5),
        },
        Pair {
            effect: "morph",
            brings: &[],
            words: &["morph", "weight"],
            without: bumps,
            with: |b| {
                bumps(b);
                b.terrain.morph = true;
            },
            changes: may,
        },
        Pair {
            effect: "color-by-level",
            brings: &[],
            words: &["level", "palette"],
            without: |_| (),
            with: |b| b.terrain.color_mode = ColorMode::Levels,
            changes: always,
        },
    ]
}

/// Whether light from a direction reaches the ground, where rounding does not decide it.
fn lit_by(hit: &PickedPoint, towards: DVec3) -> Option<bool> {
    let cosine = hit.smooth_normal.normalize().dot(towards.normalize());
    (cosine.abs() > 0.05).then_some(cosine > 0.0)
}

const SIZE: [u32; 2] = [96, 72];

fn frame(nodes: fn(&mut Build)) -> (Scene, Frame) {
    let scene = scene(nodes);
    let frame = RenderAction::new(SIZE[0], SIZE[1]).apply(&scene).unwrap();
    (scene, frame)
}

/// What a WGSL module consists of: functions, bindings, what goes from vertex to fragment, and members of the uniforms.
fn parts(text: &str) -> BTreeSet<String> {
    let module = naga::front::wgsl::parse_str(text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(text)));
    let all = naga::valid::Capabilities::all();
    naga::valid::Validator::new(naga::valid::ValidationFlags::all(), all).validate(&module).unwrap();
    let functions = module.functions.iter().filter_map(|(_, f)| f.name.clone()).map(|n| format!("fn {n}"));
    let entries = module.entry_points.iter().map(|e| format!("entry {}", e.name));
    let globals = module.global_variables.iter().filter_map(|(_, g)| g.name.clone()).map(|n| format!("binding {n}"));
    let members = module.types.iter().flat_map(|(_, t)| match &t.inner {
        naga::TypeInner::Struct { members, .. } => {
            let name = t.name.clone().unwrap_or_default();
            members.iter().map(|m| format!("{name}.{}", m.name.as_deref().unwrap_or_default())).collect()
        }
        _ => Vec::new(),
    });
    functions.chain(entries).chain(globals).chain(members).collect()
}

#[test]
fn each_effect_has_a_pair_of_scenes() {
    let tested: BTreeSet<&str> = pairs().iter().map(|pair| pair.effect).collect();
    let all: BTreeSet<&str> = EFFECTS.iter().map(|effect| effect.name).collect();
    assert_eq!(tested, all);
}

/// Without an effect neither text nor module nor bindings nor memory nor pipelines know of it; with it they do.
#[test]
fn what_is_not_asked_for_is_nowhere() {
    let format = wgpu::TextureFormat::Rgba8UnormSrgb;
    for pair in pairs() {
        let name = pair.effect;
        let ((_, without), (_, with)) = (frame(pair.without), frame(pair.with));
        let ground = |frame: &Frame| -> Draw { frame.draws.last().unwrap().clone() };
        let used = |frame: &Frame| -> BTreeSet<&str> {
            let effects = ground(frame).effects;
            EFFECTS.iter().filter(|e| e.is_on(&effects)).map(|e| e.name).collect()
        };
        let (before, after) = (used(&without), used(&with));
        let added: BTreeSet<&str> = after.difference(&before).copied().collect();
        let wanted: BTreeSet<&str> = pair.brings.iter().copied().chain([name]).collect();
        assert_eq!(added, wanted, "{name}: added");
        assert!(before.is_subset(&after), "{name}: {before:?} to {after:?}");

        let texts = [&without, &with].map(|frame| draw_text(&ground(frame), format).unwrap());
        for word in pair.words {
            assert!(!texts[0].contains(word), "{word} without {name}:\n{}", texts[0]);
            assert!(texts[1].contains(word), "no {word} with {name}:\n{}", texts[1]);
        }
        let [less, more] = texts.each_ref().map(|text| parts(text));
        if !pair.words.is_empty() && !name.starts_with("color-by") {
            assert!(less.is_subset(&more), "{name}: {:?}", less.difference(&more));
            // Sums and arguments are no parts.
            assert!(less.len() < more.len() || matches!(name, "ambient" | "two-sided"), "{name}: {more:?}");
        }

        // A renderer that has drawn nothing else.
        let mut fresh = seamount::render::Headless::new(None).unwrap();
        let first = fresh.draw(&without).unwrap().report;
        let cost = fresh.costs(&without).unwrap();
        let second = fresh.draw(&with).unwrap().report;
        let costs = fresh.costs(&with).unwrap();
        // Colours by part are two plain colours, which need no shader of their own.
        assert_eq!(second.pipelines_made > 0, name != "color-by-part", "{name}: {second:?}");
        let third = fresh.draw(&without).unwrap().report;
        assert_eq!(third.pipelines_made, 0, "{name}");
        assert!(second.gpu_bytes >= first.gpu_bytes, "{name}");
        let (cost, costs) = (cost.last().unwrap(), costs.last().unwrap());
        if name == "polygon-offset" {
            assert_eq!((costs, parts(&texts[1])), (cost, parts(&texts[0])), "{name}");
        } else if !name.starts_with("color-by") {
            assert!(costs.texture_bytes >= cost.texture_bytes, "{name}: {costs:?} after {cost:?}");
            assert!(costs.uniform_bytes >= cost.uniform_bytes, "{name}: {costs:?} after {cost:?}");
            assert!(costs.shader_bytes > cost.shader_bytes, "{name}: {costs:?} after {cost:?}");
        }
    }
}

/// The picture changes where the effect acts, and nowhere else: not on the cube, which stands in another separator, and not
/// where nothing is.
#[test]
fn effects_are_seen_where_they_act_and_nowhere_else() {
    let mut gpu = linear();
    for pair in pairs() {
        let name = pair.effect;
        let ((scene, without), (_, with)) = (frame(pair.without), frame(pair.with));
        let (before, after) = (gpu.draw(&without), gpu.draw(&with));
        let picker =
            RayPickAction { surface: Surface::Exact, ..RayPickAction::pixel(0, 0, SIZE) }.picker(&scene).unwrap();
        let mut changed = 0;
        for (x, y) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))) {
            let at = |dx: f64, dy: f64| {
                let [w, h] = SIZE.map(f64::from);
                let ray = picker.ray_through((f64::from(x) + dx) / w, (f64::from(y) + dy) / h).unwrap();
                picker.pick(&ray, false).unwrap().into_iter().next()
            };
            let kind = |hit: &Option<PickedPoint>| hit.as_ref().map(|hit| hit.path.clone());
            let hit = at(0.5, 0.5);
            // On an edge rounding decides what a pixel shows.
            if [(0.45, 0.5), (0.55, 0.5), (0.5, 0.45), (0.5, 0.55)]
                .iter()
                .any(|&(dx, dy)| kind(&at(dx, dy)) != kind(&hit))
            {
                continue;
            }
            let differs = before.at(x, y) != after.at(x, y);
            let wanted = match &hit {
                Some(hit) if !hit.path.names(&scene).last().is_some_and(|n| n.starts_with("Cube")) => {
                    (pair.changes)(hit)
                }
                _ => Some(false),
            };
            changed += u32::from(differs);
            if let Some(wanted) = wanted {
                assert_eq!(differs, wanted, "{name} at ({x}, {y}): {:?} to {:?}", before.at(x, y), after.at(x, y));
            }
        }
        assert!(changed > 50, "{name} changes {changed} pixels");
    }
}

/// Each effect is put down to the node that asked for it, where several could have.
#[test]
fn effects_are_put_down_to_the_nodes_that_asked() {
    let mut scene = Scene::with_root(Separator::default());
    let root = scene.root();
    scene.add(root, PerspectiveCamera::default()).unwrap();
    let shine = scene.add(root, Material { specular_color: Color::WHITE.into(), ..Default::default() }).unwrap();
    scene.add(root, DirectionalLight::default()).unwrap();
    // The same node again, in a separator that ends before the cube.
    let aside = scene.add(root, Separator::default()).unwrap();
    scene.add(aside, PointLight::default()).unwrap();
    scene.add_child(aside, shine).unwrap();
    scene.add(root, SpotLight::default()).unwrap();
    scene.add(root, Cube::default()).unwrap();
    let explained = RenderAction::new(64, 64).explain(&scene).unwrap();
    let Explained { frame, draws: effects, background } = explained;
    assert_eq!(background, None);
    assert_eq!((frame.draws.len(), effects.len()), (1, 1));
    assert_eq!(frame.draws[0].effects, effects[0].effects);
    let asked: Vec<(&str, Vec<String>)> =
        effects[0].asked.iter().map(|(n, by)| (n.as_str(), by.iter().map(|p| p.join("/")).collect())).collect();
    let by = |path: &str| vec![format!("Separator/{path}")];
    let want = [
        ("directional-light×1", by("DirectionalLight[2]")),
        ("spot-light×1", by("SpotLight[4]")),
        ("ambient", by("Material[1]")),
        ("specular", by("Material[1]")),
    ];
    assert_eq!(asked, want);
}

/// What is behind all draws is put down to the first node that says so, with what it takes: a colour takes nothing.
#[test]
fn what_is_behind_is_put_down_to_the_node_that_asked() {
    for (zenith, name) in [None, Some(Color::WHITE)].into_iter().zip(BACKGROUNDS) {
        let mut scene = Scene::with_root(Separator::default());
        let root = scene.root();
        scene.add(root, PerspectiveCamera::default()).unwrap();
        scene.add(root, Cube::default()).unwrap();
        let aside = scene.add(root, Separator::default()).unwrap();
        scene.add(aside, Background { color: Color::WHITE, zenith }).unwrap();
        scene.add(root, Background { color: Color::BLACK, zenith: Some(Color::WHITE) }).unwrap();
        let Explained { frame, background, .. } = RenderAction::new(64, 64).explain(&scene).unwrap();
        let path = ["Separator", "Separator[2]", "Background[0]"].map(str::to_owned).to_vec();
        assert_eq!(background, Some((name.to_owned(), vec![path])));
        let mut gpu = headless();
        gpu.draw(&frame).unwrap();
        let cost = gpu.sky_cost(&frame).unwrap();
        assert_eq!(cost.is_some(), zenith.is_some());
        if let Some(DrawCost { variant, shader_bytes, texture_bytes, buffer_bytes, uniform_bytes }) = cost {
            // Horizon, zenith and three rays.
            assert_eq!((variant, texture_bytes, buffer_bytes, uniform_bytes), (1, 0, 0, 5 * 16));
            assert!(shader_bytes > 300, "{shader_bytes}");
        }
    }
}

/// An image that is not there, as whoever decodes it finds.
fn no_image(b: &mut Build, unit: u32) -> &mut Build {
    b.add(TextureUnit { unit }).add(Texture2 { filename: "no such file.png".into(), ..Default::default() })
}

/// Nodes in a separator that ends before the shape.
fn aside(b: &mut Build, nodes: fn(&mut Build)) {
    let group = b.group;
    b.group = b.scene.add(group, Separator::default()).unwrap();
    nodes(b);
    b.group = group;
}

/// Ground with light and a colour map.
fn mapped(b: &mut Build) {
    sun(b);
    halves(b);
}

type Nodes = fn(&mut Build);

/// Nodes that have no bearing on a shape: what they are, what stands before them, and they themselves.
const IDLE: &[(&str, Nodes, Nodes)] = &[
    ("a light that is off", mapped, |b| _ = b.add(SpotLight { on: false, ..Default::default() })),
    ("a light without intensity", mapped, |b| _ = b.add(PointLight { intensity: 0.0, ..Default::default() })),
    ("a black light", mapped, |b| _ = b.add(DirectionalLight { color: Color::BLACK, ..Default::default() })),
    ("a shadow of a light that is off", mapped, |b| {
        b.add(DirectionalLight { on: false, shadow: true, direction: LOW, ..Default::default() });
    }),
    ("lights and air in another separator", mapped, |b| {
        aside(b, |b| {
            b.add(lamp()).add(SpotLight::default());
            low_sun(b, true);
            fog(b, FogType::Haze);
        });
    }),
    ("colours and relief in another separator", mapped, |b| {
        aside(b, |b| {
            no_image(b, 7);
            b.add(ColorRamp::default()).add(ContourLines::default()).add(DetailTextures::default());
            b.add(NormalMap::default()).add(BumpMap::default());
            b.add(Material { specular_color: Color::WHITE.into(), ..Default::default() });
            b.add(Texture2Transform { rotation: 1.0, ..Default::default() });
        });
    }),
    ("styles and planes in another separator", mapped, |b| {
        aside(b, |b| {
            b.add(DrawStyle { style: Style::FilledLines, ..Default::default() });
            b.add(PolygonOffset::default()).add(ClipPlane::default());
            b.add(ShapeHints { vertex_ordering: VertexOrdering::Counterclockwise, ..Default::default() });
        });
    }),
    ("a program in another separator", mapped, |b| {
        aside(b, |b| {
            let program = b.scene.add(b.group, ShaderProgram::default()).unwrap();
            let source_program = ShaderSource::Wgsl("fn fragment_shader(f: Fragment) -> vec3f { nonsense }".into());
            b.scene.add(program, FragmentShader { source_program, ..Default::default() }).unwrap();
        });
    }),
    ("the default material", mapped, |b| _ = b.add(Material::default())),
    ("the default air", mapped, |b| _ = b.add(Environment::default())),
    ("fog that is none, with a colour", mapped, |b| {
        b.add(Environment { fog_color: Color::BLACK, fog_visibility: 1.0, ..Default::default() });
    }),
    ("the default light model", mapped, |b| _ = b.add(LightModel::default())),
    ("the default style", mapped, |b| _ = b.add(DrawStyle::default())),
    ("widths that nobody asks for", mapped, |b| {
        b.add(DrawStyle { line_width: 7.0, point_size: 9.0, line_color: Color::WHITE, ..Default::default() });
    }),
    ("the default complexity", mapped, |b| _ = b.add(Complexity::default())),
    ("the default binding", mapped, |b| _ = b.add(MaterialBinding::default())),
    ("an image that nobody reads", mapped, |b| _ = no_image(b, 9)),
    ("a transform of an image that nobody reads", mapped, |b| {
        b.add(TextureUnit { unit: 9 }).add(Texture2Transform { rotation: 1.0, ..Default::default() });
    }),
    ("a transform that moves nothing", mapped, |b| {
        b.add(TextureUnit { unit: 1 }).add(Texture2Transform::default());
    }),
    ("a program without texts", mapped, |b| _ = b.add(ShaderProgram::default())),
    ("a plane that is off", mapped, |b| _ = b.add(ClipPlane { on: false, ..Default::default() })),
    ("an offset that is off", mapped, |b| {
        b.add(PolygonOffset { on: false, units: 9.0, ..Default::default() });
    }),
    ("an offset for other styles", mapped, |b| {
        b.add(PolygonOffset { styles: List::from([OffsetStyle::Lines]), ..Default::default() });
    }),
    ("weakening of sunlight", mapped, |b| {
        b.add(Environment { attenuation: DVec3::ONE, ..Default::default() });
        b.add(PointLight { on: false, ..Default::default() });
    }),
    ("relief without light", halves, |b| {
        no_image(b, 7);
        b.add(NormalMap::default());
        no_image(b, 8);
        b.add(BumpMap::default());
    }),
    ("highlights and glow without light", halves, |b| {
        b.add(Material {
            specular_color: Color::WHITE.into(),
            emissive_color: Color::WHITE.into(),
            ambient_color: Color::BLACK.into(),
            ..Default::default()
        });
    }),
    ("light that is not looked at", halves, |b| {
        b.add(LightModel { model: LightingModel::BaseColor });
        low_sun(b, true);
        b.add(lamp());
    }),
    (
        "colours beside colours for study",
        |b| b.terrain.color_mode = ColorMode::Levels,
        |b| {
            no_image(b, 1);
            b.add(ColorRamp::default()).add(ContourLines::default()).add(DetailTextures::default());
            b.add(Material { transparency: List::from(0.5), ..Default::default() });
            fog(b, FogType::Fog);
        },
    ),
    ("colours of terrains on a mesh", mesh, |b| {
        b.add(ColorRamp::default()).add(ContourLines::default()).add(DetailTextures::default());
        b.add(NormalMap::default()).add(BumpMap::default());
    }),
    (
        "a shadow of terrains on a mesh",
        |b| {
            mesh(b);
            low_sun(b, false);
        },
        |b| {
            b.add(DirectionalLight { on: false, shadow: true, ..Default::default() });
        },
    ),
];

/// What has no bearing on a shape changes neither its effects, shader, bindings and memory nor a bit of the picture.
#[test]
fn nodes_without_bearing_change_nothing() {
    let format = wgpu::TextureFormat::Rgba8UnormSrgb;
    for &(name, before, nodes) in IDLE {
        let [plain, idle] = [false, true].map(|idle| {
            let scene = scene(|b| {
                before(b);
                if idle {
                    nodes(b);
                }
            });
            RenderAction::new(SIZE[0], SIZE[1]).apply(&scene).unwrap_or_else(|error| panic!("{name}: {error}"))
        });
        let [a, b] = [&plain, &idle].map(|frame| frame.draws.last().unwrap());
        assert_eq!(a.effects, b.effects, "{name}");
        assert_eq!(draw_text(a, format).unwrap(), draw_text(b, format).unwrap(), "{name}");
        // Two renderers that have drawn nothing else; the first knows all that the second frame takes.
        let [mut fresh, mut other] = [(), ()].map(|()| seamount::render::Headless::new(None).unwrap());
        let first = fresh.draw(&plain).unwrap();
        let second = other.draw(&idle).unwrap();
        assert_eq!(other.costs(&idle).unwrap(), fresh.costs(&plain).unwrap(), "{name}");
        assert_eq!(second.report.gpu_bytes, first.report.gpu_bytes, "{name}");
        assert_eq!(fresh.draw(&idle).unwrap().report.pipelines_made, 0, "{name}");
        assert!(first.rgba == second.rgba, "{name}");
    }
}

/// Scenes with the same effects share a shader; the second draw compiles nothing.
#[test]
fn scenes_with_the_same_effects_share_a_shader() {
    let mut gpu = headless();
    let one = frame(|b| {
        sun(b);
        b.add(Material { diffuse_color: Color::new(0.1, 0.2, 0.3).into(), ..Default::default() });
    });
    gpu.draw(&one.1).unwrap();
    let other = frame(sun);
    assert_eq!(gpu.draw(&other.1).unwrap().report.pipelines_made, 0);
}

/// Of what is transparent the furthest is drawn first, after what is not; each shows the nearest of its surfaces.
#[test]
fn what_is_transparent_is_mixed_from_back_to_front() {
    let colors = [Color::new(1.0, 0.0, 0.0), Color::new(0.0, 1.0, 0.0), Color::new(0.0, 0.0, 1.0)];
    // The nearest first, so that the order of the walk is the wrong one.
    let mut scene = Scene::new();
    let root = scene.root();
    let (position, look_at) = (Some(DVec3::Z * 20.0), Some(DVec3::ZERO));
    scene.add(root, PerspectiveCamera { position, look_at, ..Default::default() }).unwrap();
    for (k, color) in colors.into_iter().enumerate() {
        let place = scene.add(root, Separator::default()).unwrap();
        let translation = DVec3::Z * (6.0 - 4.0 * k as f64);
        scene.add(place, Transform { translation, ..Default::default() }).unwrap();
        let transparency = List::from(if k == 1 { 0.0 } else { 0.25 + 0.25 * k as f32 });
        scene.add(place, Material { diffuse_color: color.into(), transparency, ..Default::default() }).unwrap();
        scene.add(place, Cube::default()).unwrap();
    }
    let hidden = scene.add(root, Material { transparency: List::from(1.0), ..Default::default() }).unwrap();
    scene.add(root, Transform { translation: DVec3::Z * 12.0, ..Default::default() }).unwrap();
    scene.add(root, Cube::default()).unwrap();
    let frame = RenderAction { background: Color::WHITE, ..RenderAction::new(32, 32) }.apply(&scene).unwrap();
    let opacities: Vec<f32> = frame.draws.iter().map(|d| d.material.opacity).collect();
    assert_eq!(opacities, [1.0, 0.25, 0.75], "what is not to be seen at all is not drawn");
    // The blue one is hidden by the green one, which shows through the red one.
    let got = linear().draw(&frame).at(16, 16);
    assert_eq!(got.map(|c| (c * 1000.0).round()), [750.0, 250.0, 0.0, 1000.0]);
    // With the green one half transparent all three mix.
    let green = scene.children(scene.children(root)[2])[1];
    scene.edit::<Material>(green).unwrap().transparency = List::from(0.5);
    assert!(scene.node(hidden).is_some());
    let frame = RenderAction { background: Color::WHITE, ..RenderAction::new(32, 32) }.apply(&scene).unwrap();
    let got = linear().draw(&frame).at(16, 16);
    // White, then blue 1/4: (0.75, 0.75, 1); green 1/2: (0.375, 0.875, 0.5); red 3/4.
    let want = [0.75 + 0.25 * 0.375, 0.25 * 0.875, 0.25 * 0.5, 1.0];
    assert!(got.iter().zip(want).all(|(g, w)| (g - w).abs() < 2e-3), "{got:?} is not {want:?}");
}

/// Who asks where something is looks at heights alone: no colour image is decoded for a box or a pick, and no picture is needed.
#[test]
fn boxes_and_picks_look_at_no_colours() {
    let scene = scene(|b| {
        b.add(TextureUnit { unit: 1 });
        // Whoever decodes it finds that it is not there.
        b.add(Texture2 { filename: "no such colours.png".into(), ..Default::default() });
        b.add(ColorRamp::default()).add(ContourLines::default()).add(DetailTextures::default());
    });
    assert!(BoundingBoxAction::default().apply(&scene).unwrap().is_some());
    let down = Ray::new(DVec3::new(0.5, 0.5, 9.0), DVec3::NEG_Z).unwrap();
    for surface in [Surface::Coarse, Surface::Exact] {
        let action = RayPickAction { surface, ..RayPickAction::ray(down) };
        assert_eq!(action.apply(&scene).unwrap().len(), 1);
    }
    let error = RenderAction::new(8, 8).apply(&scene).unwrap_err().to_string();
    assert!(error.contains("no such colours.png"), "{error}");
}
