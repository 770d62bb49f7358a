//! What each effect costs: a base scene and the base with the effect, drawn in turn so that a busy machine slows both alike;
//! then all that go together. Run with `cargo bench --bench effects`; prints a table of frame time, size of the shader and bytes
//! on the graphics card, and how long a shadow takes to be made.
#![allow(missing_docs, reason = "a program")]

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Instant;

use seamount::action::{Explained, effect_names};
use seamount::prelude::*;
use seamount::render::Headless;
use seamount::terrain::{LatticeLight, ShadowMap};

const SIZE: [u32; 2] = [1280, 720];
const METRES: DVec2 = DVec2::new(90_600.0, 111_240.0);
const SUMMIT: DVec3 = DVec3::new(65_900.0, 40_100.0, 1_950.0);

/// A scene before its ground is added.
struct Build {
    scene: Scene,
    root: NodeKey,
    terrain: SeamlessTerrain,
    /// Stands in place of the terrain.
    mesh: Option<QuadMesh>,
    sun: Option<DirectionalLight>,
    map: Arc<Image>,
}

type Nodes = fn(&mut Build);

impl Build {
    fn add(&mut self, node: impl Node) -> &mut Self {
        self.add_to(self.root, node);
        self
    }

    fn add_to(&mut self, parent: NodeKey, node: impl Node) -> NodeKey {
        self.scene.add(parent, node).expect("the parent takes any node")
    }

    fn image(&mut self, unit: u32, side: u32, texel: impl Fn(u32) -> [u8; 4]) -> &mut Self {
        let texels = (0..side * side).map(texel).collect();
        let image = Image::new(side, side, Pixels::Rgba8(texels)).expect("as many texels as the image has");
        self.add(TextureUnit { unit }).add(Texture2::from_image(image))
    }

    fn lamp(&mut self) -> &mut Self {
        self.add(PointLight { location: DVec3::new(65_000.0, 30_000.0, 9_000.0), ..Default::default() })
    }

    fn air(&mut self, fog_type: FogType) {
        self.add(Environment { fog_type, fog_visibility: 90_000.0, ..dark() });
    }

    fn style(&mut self, style: Style) {
        self.add(DrawStyle { style, ..Default::default() });
    }

    fn program(&mut self) -> NodeKey {
        self.add_to(self.root, ShaderProgram::default())
    }
}

/// Air without ambient light, which is an effect of its own.
fn dark() -> Environment {
    Environment { ambient_color: Color::BLACK, ..Default::default() }
}

fn sun(b: &mut Build) {
    b.sun = Some(DirectionalLight { direction: DVec3::new(0.8, 0.75, -0.75), ..Default::default() });
}

fn color_map(b: &mut Build) {
    b.image(1, 1024, |i| [(i >> 3) as u8, (i >> 13) as u8, 128, 255]);
}

/// 300 × 300 of the 1201 × 1201 samples.
fn mesh(b: &mut Build) {
    let side = 300;
    let field = b.map.height_field(Some(0.0)).expect("the map has heights");
    let step = METRES / f64::from(side - 1);
    let point = |i: u32| {
        let [column, row] = [i % side, i / side].map(|k| k * 1200 / (side - 1));
        let place = DVec2::new(f64::from(i % side), f64::from(side - 1 - i / side)) * step;
        place.extend(field.raw(column, row) - 1000.0)
    };
    b.add(Coordinate3 { point: (0..side * side).map(point).collect::<Vec<_>>().into() });
    b.add(ShapeHints { vertex_ordering: VertexOrdering::Counterclockwise, ..Default::default() });
    b.mesh = Some(QuadMesh { vertices_per_column: side, vertices_per_row: side, ..Default::default() });
}

/// What effects are measured against.
const BASES: [(&str, Nodes); 4] =
    [("ground", |_| {}), ("ground in the sun", sun), ("ground with a colour map", color_map), ("mesh", mesh)];
const GROUND: usize = 0;
const LIT: usize = 1;
const MAP: usize = 2;
const MESH: usize = 3;

/// How an effect is in the scene with all of them.
#[derive(Clone, Copy, PartialEq)]
enum In {
    /// With its own nodes.
    All,
    /// By a node that asks for others as well.
    Merged,
    /// It is not: it stands instead of another.
    None,
}

struct Row {
    base: usize,
    nodes: Nodes,
    place: In,
}

const fn row(base: usize, place: In, nodes: Nodes) -> Row {
    Row { base, nodes, place }
}

/// Effects, each as what is added to a base.
const ROWS: &[Row] = &[
    row(GROUND, In::All, sun),
    // Against other light, so that the gradients of the map, which all lights share, count once.
    row(LIT, In::All, |b| _ = b.lamp()),
    row(GROUND, In::None, |b| {
        b.add(Environment { attenuation: DVec3::new(1e-9, 0.0, 1.0), ..dark() }).lamp();
    }),
    row(LIT, In::All, |b| {
        b.add(SpotLight { location: DVec3::new(65_000.0, 30_000.0, 9_000.0), ..Default::default() });
    }),
    row(LIT, In::Merged, |b| _ = b.add(Environment::default())),
    row(LIT, In::Merged, |b| _ = b.add(Material { specular_color: Color::WHITE.into(), ..Default::default() })),
    row(LIT, In::Merged, |b| {
        b.add(Material { emissive_color: Color::new(0.1, 0.0, 0.0).into(), ..Default::default() });
    }),
    row(GROUND, In::Merged, |b| _ = b.add(Material { transparency: List::from(0.3), ..Default::default() })),
    row(GROUND, In::None, |b| b.air(FogType::Haze)),
    row(GROUND, In::Merged, |b| b.air(FogType::Fog)),
    row(GROUND, In::None, |b| b.air(FogType::Smoke)),
    row(GROUND, In::All, color_map),
    row(MAP, In::All, |b| {
        b.add(TextureUnit { unit: 1 }).add(Texture2Transform { rotation: 0.3, ..Default::default() });
    }),
    row(GROUND, In::All, |b| _ = b.add(ColorRamp::default())),
    row(GROUND, In::None, |b| _ = b.add(ColorRamp { by: RampBy::Slope, ..Default::default() })),
    row(GROUND, In::All, |b| _ = b.add(ContourLines::default())),
    row(GROUND, In::All, |b| {
        for unit in 2..7 {
            b.image(unit, 256, |i| [i as u8, (i >> 8) as u8, 90 * (unit as u8 % 3), 255]);
        }
        b.add(DetailTextures::default());
    }),
    row(LIT, In::All, |b| {
        b.image(7, 256, |i| [120 + (i % 16) as u8, 128, 240, 255]).add(NormalMap::default());
    }),
    row(LIT, In::All, |b| {
        b.image(8, 256, |i| [(i % 64) as u8; 4]).add(BumpMap::default());
    }),
    row(LIT, In::All, |b| b.sun.iter_mut().for_each(|sun| sun.shadow = true)),
    row(GROUND, In::All, |b| {
        // All of the world is above it, so that nothing less is drawn.
        b.add(ClipPlane { plane: Plane { normal: DVec3::Z, distance: -1e6 }, on: true });
    }),
    row(GROUND, In::All, |b| _ = b.add(PolygonOffset::default())),
    row(LIT, In::All, |b| {
        b.add(ShapeHints { vertex_ordering: VertexOrdering::Counterclockwise, ..Default::default() });
    }),
    row(GROUND, In::All, |b| {
        let program = b.program();
        let text = "fn vertex_shader(vertex: Vertex) -> vec3f { return vec3f(0.0); }";
        let source_program = ShaderSource::Wgsl(text.to_owned());
        b.add_to(program, VertexShader { source_program, ..Default::default() });
    }),
    row(GROUND, In::None, |b| {
        let program = b.program();
        let text = "fn fragment_shader(fragment: Fragment) -> vec3f { return lit(fragment, fragment.color); }";
        let source_program = ShaderSource::Wgsl(text.to_owned());
        b.add_to(program, FragmentShader { source_program, ..Default::default() });
    }),
    row(GROUND, In::None, |b| b.terrain.morph = true),
    row(GROUND, In::None, |b| b.terrain.color_mode = ColorMode::Parts),
    row(GROUND, In::None, |b| b.terrain.color_mode = ColorMode::Levels),
    row(GROUND, In::None, |b| b.terrain.color_mode = ColorMode::Normals),
    row(GROUND, In::None, |b| b.terrain.color_mode = ColorMode::Errors),
    row(MESH, In::None, |b| {
        let color = |i: u32| Color::new((i % 300) as f32 / 300.0, (i / 300) as f32 / 300.0, 0.5);
        b.add(Material { diffuse_color: (0..300 * 300).map(color).collect::<Vec<_>>().into(), ..Default::default() });
        b.add(MaterialBinding { value: Binding::PerVertex });
    }),
    row(MESH, In::None, |b| _ = b.image(1, 1024, |i| [(i >> 3) as u8, (i >> 13) as u8, 128, 128])),
    row(GROUND, In::None, |b| b.style(Style::Lines)),
    row(GROUND, In::None, |b| b.style(Style::Points)),
    row(GROUND, In::All, |b| b.style(Style::FilledLines)),
    row(GROUND, In::None, |b| _ = b.add(Background { color: Color::WHITE, zenith: None })),
    row(GROUND, In::All, |b| {
        b.add(Background { color: Color::new(0.8, 0.9, 1.0), zenith: Some(Color::new(0.3, 0.5, 0.8)) });
    }),
];

fn explain(map: &Arc<Image>, nodes: &[Nodes]) -> Result<Explained, Box<dyn std::error::Error>> {
    let scene = Scene::new();
    let terrain = SeamlessTerrain {
        size: Some(METRES),
        max_height: 65_535.0,
        base_height: -1_000.0,
        void_sample: Some(0.0),
        ..Default::default()
    };
    let mut b = Build { root: scene.root(), scene, terrain, mesh: None, sun: None, map: Arc::clone(map) };
    let position = Some(DVec3::new(82_000.0, 21_000.0, 3_000.0));
    b.add(PerspectiveCamera { position, look_at: Some(SUMMIT), ..Default::default() });
    b.add(Complexity { texture_quality: 1.0, ..Default::default() }).add(dark());
    b.add(TextureUnit { unit: 0 }).add(Texture2::from_image(Arc::clone(map)));
    nodes.iter().for_each(|nodes| nodes(&mut b));
    if let Some(sun) = b.sun.take() {
        b.add(sun);
    }
    match b.mesh.take() {
        Some(mesh) => b.add(mesh),
        None => {
            let terrain = b.terrain.clone();
            b.add(terrain)
        }
    };
    Ok(RenderAction::new(SIZE[0], SIZE[1]).explain(&b.scene)?)
}

/// A scene with a device of its own, so that nothing of another is on it.
struct Case {
    explained: Explained,
    headless: Headless,
    shader: u64,
    bytes: u64,
}

impl Case {
    fn new(map: &Arc<Image>, nodes: &[Nodes]) -> Result<Self, Box<dyn std::error::Error>> {
        let explained = explain(map, nodes)?;
        let mut headless = Headless::new(None)?;
        let bytes = headless.draw(&explained.frame)?.report.gpu_bytes;
        let draws = headless.costs(&explained.frame)?;
        let costs = draws.into_iter().chain(headless.sky_cost(&explained.frame)?);
        let shader = costs.map(|cost| cost.shader_bytes).sum();
        Ok(Self { explained, headless, shader, bytes })
    }

    fn draw(&mut self) -> Result<f64, Box<dyn std::error::Error>> {
        let start = Instant::now();
        self.headless.draw(&self.explained.frame)?;
        Ok(start.elapsed().as_secs_f64() * 1e3)
    }

    fn names(&self) -> BTreeSet<String> {
        let draws = self.explained.draws.iter().flat_map(|draw| &draw.asked);
        let all = draws.chain(&self.explained.background);
        all.map(|(name, _)| name.split('×').next().unwrap_or_default().to_owned()).collect()
    }
}

fn median(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or(f64::NAN)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Without `--bench` it only shows that it works.
    let repeats = if std::env::args().any(|a| a == "--bench") { 7 } else { 1 };
    let map = Arc::new(Image::open("scenes/fuji.png".as_ref())?);
    let mut bases = Vec::new();
    for (_, nodes) in BASES {
        bases.push(Case::new(&map, &[nodes])?);
    }
    println!("| effect | against | frame, ms | shader, bytes | on the card, KiB |");
    println!("|---|---|---|---|---|");
    for ((name, _), base) in BASES.iter().zip(&mut bases) {
        let mut times = (0..repeats).map(|_| base.draw()).collect::<Result<Vec<f64>, _>>()?;
        println!("| {name} | | {:.0} | {} | {} |", median(&mut times), base.shader, base.bytes / 1024);
    }

    let mut named = BTreeSet::new();
    let mut parts = (0.0, 0i64);
    let all: Nodes = |b| {
        b.add(Environment { fog_type: FogType::Fog, fog_visibility: 90_000.0, ..Default::default() });
        b.add(Material {
            specular_color: Color::WHITE.into(),
            emissive_color: Color::new(0.1, 0.0, 0.0).into(),
            transparency: List::from(0.3),
            ..Default::default()
        });
    };
    let together = ROWS.iter().filter(|row| row.place == In::All).map(|row| row.nodes);
    let all: Vec<Nodes> = std::iter::once(all).chain(together).collect();
    for row in ROWS.iter().map(Some).chain([None]) {
        let (base, mut case) = match row {
            Some(row) => {
                let (_, nodes) = BASES.get(row.base).ok_or("no such base")?;
                (row.base, Case::new(&map, &[*nodes, row.nodes])?)
            }
            None => (GROUND, Case::new(&map, &all)?),
        };
        let (base_name, _) = BASES.get(base).ok_or("no such base")?;
        let base = bases.get_mut(base).ok_or("no such base")?;
        let mut more = Vec::new();
        for _ in 0..repeats {
            let without = base.draw()?;
            more.push(case.draw()? - without);
        }
        let (more, bytes) = (median(&mut more), case.bytes as i64 - base.bytes as i64);
        let added: Vec<String> = case.names().difference(&base.names()).cloned().collect();
        let name = if row.is_some() { added.join(", ") } else { "all that go together".to_owned() };
        let shader = case.shader as i64 - base.shader as i64;
        println!("| {name} | {base_name} | {more:+.0} | {shader:+} | {:+} |", bytes / 1024);
        named.extend(added);
        if row.is_some_and(|row| row.place != In::None) {
            parts = (parts.0 + more, parts.1 + bytes);
        }
    }
    println!("\nsum of the parts: {:+.0} ms, {:+} KiB", parts.0, parts.1 / 1024);

    let field = map.height_field(Some(0.0))?;
    // In cells, rows southward.
    let towards = DVec3::new(-0.9 / 75.5, 0.4 / 92.7, 0.16);
    let mut sweeps: Vec<f64> = (0..repeats)
        .map(|_| {
            let start = Instant::now();
            std::hint::black_box(ShadowMap::new(&field, &LatticeLight { towards, upwards: true }));
            start.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    println!("the shadow of {} × {} samples is made in {:.1} ms", field.columns(), field.rows(), median(&mut sweeps));

    let missing: Vec<&str> = effect_names().filter(|name| !named.contains(*name)).collect();
    if missing.is_empty() { Ok(()) } else { Err(format!("no row for {missing:?}").into()) }
}
