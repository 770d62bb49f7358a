use seamount::prelude::*;
use serde::Serialize;

use super::{Outcome, Output, SceneArg, in_file, load};

/// Print the smallest box around the scene.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    scene: SceneArg,
    /// Print an object with `empty`, `min` and `max`.
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Report {
    empty: bool,
    min: Option<[f64; 3]>,
    max: Option<[f64; 3]>,
}

pub(super) fn run(args: &Args) -> Outcome {
    let scene = load(&args.scene.scene)?;
    let found = BoundingBoxAction::default().apply(&scene).map_err(in_file(&args.scene.scene))?;
    let mut out = Output::new();
    if args.json {
        let (min, max) = (found.map(|b| b.min.to_array()), found.map(|b| b.max.to_array()));
        out.json(&Report { empty: found.is_none(), min, max })?;
    } else {
        match found {
            None => out.line("empty")?,
            Some(Aabb { min, max }) => {
                out.line(format_args!("min {} {} {}", min.x, min.y, min.z))?;
                out.line(format_args!("max {} {} {}", max.x, max.y, max.z))?;
            }
        }
    }
    out.flush()
}
