use std::path::{Path, PathBuf};

use seamount::action::ActionError;
use seamount::format;
use seamount::node::Registry;
use seamount::prelude::*;
use seamount::render::check_shaders;

use super::{Failure, Outcome, Output, in_file, in_scene, is_map, load};

/// Look for mistakes in scenes.
///
/// Prints, per file, the first mistake of syntax or every one of meaning, as path:line:column: message. All images are
/// decoded and all shapes asked for their bounds; a scene's own shaders are compiled for what the first camera sees, without a
/// graphics card. Exit status 1 if there is any mistake.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Scene files, or height maps
    #[arg(required = true, value_name = "SCENE")]
    scenes: Vec<PathBuf>,
}

pub(super) fn run(args: &Args) -> Outcome {
    let mut out = Output::new();
    let mut good = true;
    for path in &args.scenes {
        if let Err(message) = check(path) {
            good = false;
            out.line(message)?;
            out.flush()?;
        }
    }
    if good { Ok(()) } else { Err(Failure::Silent) }
}

/// What is wrong with a file; every line starts with its path.
fn check(path: &Path) -> Result<(), String> {
    if is_map(path) {
        let problem = match load(path) {
            Ok(scene) => BoundingBoxAction::default().apply(&scene).err().map(|error| error.to_string()),
            Err(Failure::Error(message)) => Some(message),
            Err(_) => None,
        };
        return problem.map_or(Ok(()), |message| Err(format!("{}: {message}", path.display())));
    }
    match format::check(path, &Registry::default()) {
        Ok(_) => match check_programs(path) {
            Err(Failure::Error(message)) => Err(message),
            _ => Ok(()),
        },
        Err(error) if error.mistakes().is_empty() => Err(format!("{}: {error}", path.display())),
        Err(error) => Err(error.to_string()),
    }
}

/// Compiles the shaders of a scene's own for what the first camera sees.
fn check_programs(path: &Path) -> Outcome {
    let mut scene = load(path)?;
    let programs = SearchAction { kind: Some("ShaderProgram".to_owned()), ..SearchAction::default() };
    if programs.apply(&scene).map_err(in_file(path))?.is_empty() {
        return Ok(());
    }
    let action = RenderAction::new(64, 64);
    let frame = match action.apply(&scene) {
        Err(ActionError::NoCamera) => {
            // One that sees everything, before all else.
            let root = scene.insert(Separator::default());
            scene.add(root, PerspectiveCamera::default())?;
            scene.add_child(root, scene.root())?;
            scene.set_root(root)?;
            action.apply(&scene)
        }
        made => made,
    };
    check_shaders(&frame.map_err(in_file(path))?).map_err(in_scene(path))
}
