//! Shaders of a scene's own: a lake whose level is a parameter. The vertex shader lifts the ground that lies below it, the fragment
//! shader colours it; heights, detail, light and air go on as they are.
//!
//! ```text
//! cargo run --release --example own_shader [FOLDER]
//! ```

use std::path::PathBuf;

use seamount::prelude::*;
use seamount::render::{Headless, check_shaders};

/// Both functions may stand in one text. They are given local coordinates: here metres, as the terrain says.
const LAKE: &str = "
fn vertex_shader(vertex: Vertex) -> vec3f {
    // By what the place is moved.
    return vec3f(0.0, 0.0, max(parameters.level - vertex.position.z, 0.0));
}

fn fragment_shader(fragment: Fragment) -> vec3f {
    let depth = parameters.level - terrain_height(fragment.lattice);
    let water = mix(vec3f(0.2, 0.45, 0.5), vec3f(0.02, 0.1, 0.2), saturate(depth / 400.0));
    // A fringe of a metre and a half, so that the shore is smooth.
    return mix(lit(fragment, fragment.color), water, smoothstep(-1.5, 1.5, depth));
}
";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).map_or_else(|| PathBuf::from("target"), PathBuf::from);

    let mut scene = Scene::new();
    scene.set_source(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/built.ron"));
    let root = scene.root();
    let (position, look_at) = (Some(DVec3::new(60e3, 12e3, 14e3)), Some(DVec3::new(92e3, 40e3, 3e3)));
    scene.add(root, PerspectiveCamera { position, look_at, ..PerspectiveCamera::default() })?;
    scene.add(root, DirectionalLight { direction: DVec3::new(0.7, -0.9, -0.7), ..DirectionalLight::default() })?;
    scene.add(root, Material { diffuse_color: Color::new(0.8, 0.72, 0.65).into(), ..Material::default() })?;
    scene.add(root, Texture2 { filename: "andes.png".into(), ..Texture2::default() })?;
    let program = scene.add(root, ShaderProgram::default())?;
    let source_program = ShaderSource::Wgsl(LAKE.to_owned());
    let vertex = VertexShader { source_program: source_program.clone(), ..VertexShader::default() };
    let vertex = scene.add(program, vertex)?;
    let fragment = scene.add(program, FragmentShader { source_program, ..FragmentShader::default() })?;
    // The same node below both stages: one value for both.
    let value = ShaderValue::Float(2_600.0);
    let level = scene.add(vertex, ShaderParameter { name: "level".into(), value })?;
    scene.add_child(fragment, level)?;
    scene.add(
        root,
        SeamlessTerrain {
            size: Some(DVec2::new(93_840.0, 111_240.0)),
            max_height: 65_535.0,
            base_height: -1_000.0,
            // What lies below the picture may be lifted into it.
            culling: false,
            ..SeamlessTerrain::default()
        },
    )?;

    let action = RenderAction { background: Color::new(0.75, 0.84, 0.93), ..RenderAction::new(640, 360) };
    // Finds mistakes without a graphics card.
    check_shaders(&action.apply(&scene)?)?;
    let mut headless = Headless::new(None)?;
    for metres in [2_600.0, 3_400.0] {
        if let Some(mut level) = scene.edit::<ShaderParameter>(level) {
            level.value = ShaderValue::Float(metres);
        }
        let picture = headless.draw(&action.apply(&scene)?)?;
        let path = folder.join(format!("own_shader_{metres}.png"));
        picture.save_png(&path)?;
        println!("{}: {} pipelines compiled", path.display(), picture.report.pipelines_made);
    }

    // A mistake is told with its place, and nothing else is drawn instead.
    let wrong = ShaderSource::Wgsl(LAKE.replace("max(parameters", "maximum(parameters"));
    if let Some(mut stage) = scene.edit::<VertexShader>(vertex) {
        stage.source_program = wrong.clone();
    }
    if let Some(mut stage) = scene.edit::<FragmentShader>(fragment) {
        stage.source_program = wrong;
    }
    if let Err(error) = check_shaders(&action.apply(&scene)?) {
        println!("{error}");
    }
    Ok(())
}
