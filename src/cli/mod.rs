//! The command: one file per sub-command, and what they share.
//!
//! Results go to standard output, errors and progress to standard error. Exit status: 0 success, 1 failure, 2 wrong usage.

mod bbox;
mod check;
mod cost;
mod effects;
mod generate;
mod nodes;
mod pick;
mod render;
mod sight;
mod tree;

use std::error::Error;
use std::fmt::Display;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use seamount::action::ShaderOrigin;
use seamount::format;
use seamount::prelude::*;
use seamount::render::RenderError;
use serde::Serialize;

/// Scene graphs with seamless terrain: draw them, and ask where a ray meets the ground.
///
/// A SCENE is a scene file in RON, or a height map (PNG, TIFF, JPEG or PNM), around which the obvious scene is made.
#[derive(Debug, Parser)]
#[command(name = "seamount", version, max_term_width = 100)]
struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Render(render::Args),
    Pick(pick::Args),
    Sight(sight::Args),
    Bbox(bbox::Args),
    Check(check::Args),
    Effects(effects::Args),
    Tree(tree::Args),
    Generate(generate::Args),
    Nodes(nodes::Args),
    Cost(cost::Args),
}

/// Why the command ends without success.
#[derive(Debug)]
enum Failure {
    /// Something went wrong; what, and what to do.
    Error(String),
    /// The arguments can not be meant so.
    Usage(String),
    /// What had to be said was said.
    Silent,
    /// Nobody reads the output any more.
    OutputClosed,
}

impl<E: Error> From<E> for Failure {
    fn from(error: E) -> Self {
        Failure::Error(error.to_string())
    }
}

type Outcome = Result<(), Failure>;

/// Runs the command with the arguments of the process.
pub(crate) fn main() -> ExitCode {
    let outcome = match Args::parse().command {
        Command::Render(args) => render::run(&args),
        Command::Pick(args) => pick::run(&args),
        Command::Sight(args) => sight::run(&args),
        Command::Bbox(args) => bbox::run(&args),
        Command::Check(args) => check::run(&args),
        Command::Effects(args) => effects::run(&args),
        Command::Tree(args) => tree::run(&args),
        Command::Generate(args) => generate::run(&args),
        Command::Nodes(args) => nodes::run(&args),
        Command::Cost(args) => cost::run(&args),
    };
    match outcome {
        // A reader such as `head` that has seen enough is no failure.
        Ok(()) | Err(Failure::OutputClosed) => ExitCode::SUCCESS,
        Err(Failure::Silent) => ExitCode::FAILURE,
        Err(Failure::Error(message)) => {
            complain(&message);
            ExitCode::FAILURE
        }
        Err(Failure::Usage(message)) => {
            complain(&message);
            let _ = writeln!(io::stderr(), "\nFor more information, try '--help'.");
            ExitCode::from(2)
        }
    }
}

/// Says on standard error what is wrong, a line for each thing.
fn complain(message: &str) {
    let mut err = io::stderr().lock();
    for line in message.lines() {
        // There is nowhere left to report that this can not be reported.
        let _ = writeln!(err, "error: {line}");
    }
}

/// Standard output. A closed pipe ends the command quietly, a full disk with an error.
struct Output(io::BufWriter<io::StdoutLock<'static>>);

impl Output {
    fn new() -> Self {
        Self(io::BufWriter::new(io::stdout().lock()))
    }

    fn line(&mut self, line: impl Display) -> Outcome {
        writeln!(self.0, "{line}").map_err(output_failed)
    }

    fn json(&mut self, value: &impl Serialize) -> Outcome {
        self.line(serde_json::to_string(value)?)
    }

    fn flush(&mut self) -> Outcome {
        self.0.flush().map_err(output_failed)
    }
}

fn output_failed(error: io::Error) -> Failure {
    match error.kind() {
        io::ErrorKind::BrokenPipe => Failure::OutputClosed,
        _ => Failure::Error(format!("can not write to standard output: {error}")),
    }
}

/// Reads a scene file, or makes a scene around a map.
fn load(path: &Path) -> Result<Scene, Failure> {
    if is_map(path) { Ok(format::scene_of_map(path)?) } else { Ok(format::read_scene(path)?) }
}

/// Whether a file is a picture rather than a scene: by its name, or by how it begins.
fn is_map(path: &Path) -> bool {
    let extension = path.extension().and_then(|e| e.to_str()).map(str::to_lowercase);
    match extension.as_deref() {
        Some("ron") => false,
        Some("png" | "jpg" | "jpeg" | "tif" | "tiff" | "pnm" | "pgm" | "ppm" | "pbm" | "pam") => true,
        _ => {
            let mut start = Vec::new();
            let read =
                std::fs::File::open(path).and_then(|f| io::Read::read_to_end(&mut io::Read::take(f, 64), &mut start));
            read.is_ok() && image::guess_format(&start).is_ok()
        }
    }
}

/// Puts the file's name before errors that say where in the file they arose, so that they read `path:line:column: …`.
fn in_file(path: &Path) -> impl Fn(ActionError) -> Failure + Sync {
    let path = path.to_owned();
    move |error| match &error {
        ActionError::Shape { place, .. } if place.file.is_some() => Failure::Error(error.to_string()),
        ActionError::Shape { place, .. } if place.position.is_some() => {
            Failure::Error(format!("{}:{error}", path.display()))
        }
        _ => Failure::Error(format!("{}: {error}", path.display())),
    }
}

/// Puts the scene's name before mistakes in shaders that stand in it; those in files of their own have theirs.
fn in_scene(path: &Path) -> impl Fn(RenderError) -> Failure {
    let path = path.to_owned();
    move |error| match &error {
        RenderError::UserShader { origin: ShaderOrigin::Node(place), .. } if place.file.is_none() => {
            let colon = if place.position.is_some() { ":" } else { ": " };
            Failure::Error(format!("{}{colon}{error}", path.display()))
        }
        RenderError::Parameter { .. } => Failure::Error(format!("{}: {error}", path.display())),
        _ => Failure::Error(error.to_string()),
    }
}

/// Width and height as `1280x720`.
fn size(text: &str) -> Result<[u32; 2], String> {
    let sides =
        text.split_once(['x', 'X', '×']).and_then(|(w, h)| Some([w.trim().parse().ok()?, h.trim().parse().ok()?]));
    match sides {
        Some([0, _] | [_, 0]) => Err("a picture has at least 1x1 pixels".to_owned()),
        Some(size) => Ok(size),
        None => Err("give width and height in pixels as in 1280x720".to_owned()),
    }
}

/// A scene as an argument.
#[derive(Debug, clap::Args)]
struct SceneArg {
    /// Scene file, or height map
    scene: PathBuf,
}

/// What draws a scene, as arguments.
#[derive(Debug, clap::Args)]
struct DrawArgs {
    /// Name of the camera; the first one if not given
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    /// Part of the name of the graphics adapter; hardware before software if not given
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_arguments_are_consistent() {
        use clap::CommandFactory;
        Args::command().debug_assert();
    }

    #[test]
    fn sizes() {
        assert_eq!(size("1280x720"), Ok([1280, 720]));
        for wrong in ["0x0", "5x0", "", "5", "5x", "-1x5", "5x5x5", "1e3x2"] {
            assert!(size(wrong).is_err(), "{wrong}");
        }
    }
}
