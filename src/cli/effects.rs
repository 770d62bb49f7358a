use seamount::action::{Asked, Explained};
use seamount::prelude::*;
use seamount::render::{DrawCost, Headless};
use serde::Serialize;

use super::{DrawArgs, Outcome, Output, SceneArg, in_file, in_scene, load, size};

/// List what each draw of a scene calls for, and what that costs.
///
/// First what is behind them, if the scene says so: a plain background costs nothing. For each draw: its effects with the nodes that asked for them, the size of the shader made for them, and the bytes that it
/// holds on the graphics card. Draws with the same number of a shader share it; textures that several draws share are counted
/// with each of them.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    scene: SceneArg,
    /// Size of the picture that is drawn
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = size)]
    size: [u32; 2],
    #[command(flatten)]
    by: DrawArgs,
    /// Print an object per draw
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Row<'a> {
    path: &'a [String],
    effects: Vec<Effect<'a>>,
    /// None for a plain background.
    shader: Option<usize>,
    shader_bytes: u64,
    texture_bytes: u64,
    buffer_bytes: u64,
    uniform_bytes: u64,
}

#[derive(Serialize)]
struct Effect<'a> {
    name: &'a str,
    asked_by: &'a [Vec<String>],
}

pub(super) fn run(args: &Args) -> Outcome {
    let scene = load(&args.scene.scene)?;
    let [width, height] = args.size;
    let action = RenderAction { camera: args.by.camera.clone(), ..RenderAction::new(width, height) };
    let Explained { frame, background, draws } = action.explain(&scene).map_err(in_file(&args.scene.scene))?;
    let mut headless = Headless::new(args.by.adapter.as_deref())?;
    headless.draw(&frame).map_err(in_scene(&args.scene.scene))?;
    let costs = headless.costs(&frame)?;
    let mut out = Output::new();
    let mut list = |path: &[String], asked: &[Asked], cost: Option<&DrawCost>| match args.json {
        true => out.json(&row(path, asked, cost)),
        false => print(&mut out, path, asked, cost),
    };
    if let Some(asked) = &background {
        let path = asked.1.first().map_or(&[][..], Vec::as_slice);
        list(path, std::slice::from_ref(asked), headless.sky_cost(&frame)?.as_ref())?;
    }
    for (draw, cost) in draws.iter().zip(&costs) {
        list(&draw.path, &draw.asked, Some(cost))?;
    }
    out.flush()
}

fn row<'a>(path: &'a [String], asked: &'a [Asked], cost: Option<&DrawCost>) -> Row<'a> {
    let effects = asked.iter().map(|(name, asked_by)| Effect { name, asked_by });
    let shader = cost.map(|cost| cost.variant);
    let cost = cost.copied().unwrap_or_default();
    Row {
        path,
        effects: effects.collect(),
        shader,
        shader_bytes: cost.shader_bytes,
        texture_bytes: cost.texture_bytes,
        buffer_bytes: cost.buffer_bytes,
        uniform_bytes: cost.uniform_bytes,
    }
}

fn print(out: &mut Output, path: &[String], asked: &[Asked], cost: Option<&DrawCost>) -> Outcome {
    out.line(path.join("/"))?;
    for (name, asked_by) in asked {
        let by: Vec<String> = asked_by.iter().map(|path| path.join("/")).collect();
        let by = if by.is_empty() { "(default)".to_owned() } else { by.join(", ") };
        out.line(format_args!("  {name:<20} {by}"))?;
    }
    let Some(DrawCost { variant, shader_bytes, texture_bytes, buffer_bytes, uniform_bytes }) = cost else {
        return out.line("  no shader, nothing on the graphics card");
    };
    out.line(format_args!(
        "  shader {variant} of {shader_bytes} bytes; {texture_bytes} bytes of textures, {buffer_bytes} of buffers, \
         {uniform_bytes} of uniforms"
    ))
}
