use seamount::action::DrawEffects;
use seamount::prelude::*;
use seamount::render::{DrawCost, Headless};
use serde::Serialize;

use super::{DrawArgs, Outcome, Output, SceneArg, in_file, load, size};

/// List what each draw of a scene calls for, and what that costs.
///
/// For each draw: its effects with the nodes that asked for them, the size of the shader made for them, and the bytes that it
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
    shader: usize,
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
    let (frame, draws) = action.explain(&scene).map_err(in_file(&args.scene.scene))?;
    let mut headless = Headless::new(args.by.adapter.as_deref())?;
    headless.draw(&frame)?;
    let costs = headless.costs(&frame)?;
    let mut out = Output::new();
    for (draw, cost) in draws.iter().zip(&costs) {
        if args.json {
            out.json(&row(draw, cost))?;
        } else {
            print(&mut out, draw, cost)?;
        }
    }
    out.flush()
}

fn row<'a>(draw: &'a DrawEffects, cost: &DrawCost) -> Row<'a> {
    let effects = draw.asked.iter().map(|(name, asked_by)| Effect { name, asked_by });
    Row {
        path: &draw.path,
        effects: effects.collect(),
        shader: cost.variant,
        shader_bytes: cost.shader_bytes,
        texture_bytes: cost.texture_bytes,
        buffer_bytes: cost.buffer_bytes,
        uniform_bytes: cost.uniform_bytes,
    }
}

fn print(out: &mut Output, draw: &DrawEffects, cost: &DrawCost) -> Outcome {
    out.line(draw.path.join("/"))?;
    for (name, asked_by) in &draw.asked {
        let by: Vec<String> = asked_by.iter().map(|path| path.join("/")).collect();
        let by = if by.is_empty() { "(default)".to_owned() } else { by.join(", ") };
        out.line(format_args!("  {name:<20} {by}"))?;
    }
    let DrawCost { variant, shader_bytes, texture_bytes, buffer_bytes, uniform_bytes } = cost;
    out.line(format_args!(
        "  shader {variant} of {shader_bytes} bytes; {texture_bytes} bytes of textures, {buffer_bytes} of buffers, \
         {uniform_bytes} of uniforms"
    ))
}
