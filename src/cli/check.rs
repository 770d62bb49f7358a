use std::path::{Path, PathBuf};

use seamount::format;
use seamount::node::Registry;
use seamount::prelude::*;

use super::{Failure, Outcome, Output, is_map, load};

/// Look for mistakes in scenes.
///
/// Prints, per file, the first mistake of syntax or every one of meaning, as path:line:column: message. All images are
/// decoded and all shapes asked for their bounds. Exit status 1 if there is any mistake.
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
        Ok(_) => Ok(()),
        Err(error) if error.mistakes().is_empty() => Err(format!("{}: {error}", path.display())),
        Err(error) => Err(error.to_string()),
    }
}
