use std::collections::HashSet;
use std::io::{self, IsTerminal, Write};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use seamount::action::{Frame, Statistics};
use seamount::format::check_target;
use seamount::prelude::*;
use seamount::render::Headless;
use serde::Serialize;

use super::{DrawArgs, Outcome, Output, SceneArg, in_file, in_scene, load, size};

/// Draw a scene into a picture.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    scene: SceneArg,
    /// The picture to write
    #[arg(short, long, value_name = "OUT.png")]
    output: PathBuf,
    /// Size of the picture
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = size)]
    size: [u32; 2],
    /// Colour where nothing is, sRGB, if the scene has no Background
    #[arg(long, value_name = "#rrggbb", default_value = "#c9dcee", value_parser = color)]
    background: Color,
    #[command(flatten)]
    by: DrawArgs,
    /// Print an object with what was drawn and how long it took
    #[arg(long)]
    json: bool,
}

fn color(text: &str) -> Result<Color, String> {
    let digits = text.strip_prefix('#').unwrap_or(text);
    let number = match digits.len() {
        6 if digits.bytes().all(|b| b.is_ascii_hexdigit()) => u32::from_str_radix(digits, 16).ok(),
        _ => None,
    };
    let [_, r, g, b] = number.ok_or("give a colour as in '#87a9c4'")?.to_be_bytes();
    Ok(Color::new(f32::from(r) / 255.0, f32::from(g) / 255.0, f32::from(b) / 255.0))
}

#[derive(Serialize)]
struct Report {
    adapter: Adapter,
    size: [u32; 2],
    triangles: u64,
    draw_calls: u32,
    patches: Patches,
    /// Per draw, the names of its effects.
    effects: Vec<Vec<String>>,
    times: Times,
}

#[derive(Serialize)]
struct Adapter {
    name: String,
    backend: String,
    kind: String,
    driver: String,
}

#[derive(Serialize)]
struct Patches {
    traversed: u64,
    culled: u64,
    rendered: u64,
}

/// In milliseconds.
#[derive(Serialize)]
struct Times {
    load: f64,
    selection: f64,
    encoding: f64,
    gpu: Option<f64>,
}

pub(super) fn run(args: &Args) -> Outcome {
    // Before anything that takes time.
    check_target(&args.output)?;
    let path = &args.scene.scene;
    let failed = in_file(path);
    let mut progress = Progress::new();

    let start = Instant::now();
    progress.step(&format!("reading {}", path.display()));
    let scene = load(path)?;
    decode(&scene, &mut progress);
    progress.step("finding the extent of the scene");
    let [width, height] = args.size;
    let action = RenderAction {
        camera: args.by.camera.clone(),
        background: args.background,
        ..RenderAction::new(width, height)
    };
    action.viewpoint(&scene).map_err(&failed)?;
    let load = start.elapsed();

    progress.step("choosing the detail");
    let start = Instant::now();
    let frame = action.apply(&scene).map_err(&failed)?;
    let selection = start.elapsed();

    progress.step("starting the graphics adapter");
    let mut headless = Headless::new(args.by.adapter.as_deref())?;
    progress.step(&format!("drawing with {}", headless.adapter().name));
    let picture = headless.draw(&frame).map_err(in_scene(path))?;
    progress.step(&format!("writing {}", args.output.display()));
    picture.save_png(&args.output)?;
    progress.end();

    let info = headless.adapter();
    let adapter = Adapter {
        name: info.name.clone(),
        backend: info.backend.to_string(),
        kind: format!("{:?}", info.device_type),
        driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
    };
    let times = Times {
        load: ms(load),
        selection: ms(selection),
        encoding: ms(picture.report.encode),
        gpu: picture.report.gpu.map(ms),
    };
    let report = Report::new(adapter, &frame, picture.report.draw_calls, times);
    let mut out = Output::new();
    if args.json {
        out.json(&report)?;
    } else {
        out.line(report.sentence(args))?;
    }
    out.flush()
}

fn ms(time: Duration) -> f64 {
    (time.as_secs_f64() * 1e6).round() / 1e3
}

/// Decodes the images of the scene, so that the times after it are those of choosing and drawing alone.
fn decode(scene: &Scene, progress: &mut Progress) {
    let mut seen = HashSet::from([scene.root()]);
    let mut pending = vec![scene.root()];
    let mut files = HashSet::new();
    while let Some(key) = pending.pop() {
        pending.extend(scene.children(key).iter().rev().filter(|&&child| seen.insert(child)));
        let Some(texture) = scene.get::<Texture2>(key) else { continue };
        let path = scene.resolve(key, &texture.filename);
        if texture.image.is_some() || texture.filename.is_empty() || !files.insert(path.clone()) {
            continue;
        }
        progress.step(&format!("decoding {}", path.display()));
        // A broken image that nobody needs is no reason to fail; who needs it will say where.
        let _ = scene.resources().image(&path);
    }
}

impl Report {
    fn new(adapter: Adapter, frame: &Frame, draw_calls: u32, times: Times) -> Self {
        let Statistics { triangles, patches_traversed, patches_culled, patches_rendered, .. } = frame.statistics;
        Self {
            adapter,
            size: frame.size,
            triangles,
            draw_calls,
            patches: Patches { traversed: patches_traversed, culled: patches_culled, rendered: patches_rendered },
            effects: frame.draws.iter().map(|draw| draw.effects.names()).collect(),
            times,
        }
    }

    /// The report for people, in one line.
    fn sentence(&self, args: &Args) -> String {
        let Times { load, selection, encoding, gpu } = &self.times;
        let gpu = gpu.map_or_else(|| "not measured".to_owned(), |gpu| format!("{gpu:.1} ms"));
        format!(
            "{}: {} × {} pixels, {} triangles in {} draw calls by {} ({}); load {load:.1} ms, selection {selection:.1} ms, \
             encoding {encoding:.1} ms, GPU {gpu}",
            args.output.display(),
            self.size[0],
            self.size[1],
            self.triangles,
            self.draw_calls,
            self.adapter.name,
            self.adapter.backend,
        )
    }
}

/// Tells on standard error what is being done: a spinner on a terminal, otherwise a line for each step.
struct Progress {
    spinner: Option<ProgressBar>,
}

impl Progress {
    fn new() -> Self {
        let spinner = io::stderr().is_terminal().then(|| {
            let spinner = ProgressBar::new_spinner();
            if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} {elapsed}") {
                spinner.set_style(style);
            }
            spinner.enable_steady_tick(Duration::from_millis(80));
            spinner
        });
        Self { spinner }
    }

    fn step(&mut self, what: &str) {
        match &self.spinner {
            Some(spinner) => spinner.set_message(what.to_owned()),
            // Progress that can not be told is no failure.
            None => drop(writeln!(io::stderr(), "{what}")),
        }
    }

    fn end(&mut self) {
        if let Some(spinner) = self.spinner.take() {
            spinner.finish_and_clear();
        }
    }
}

impl Drop for Progress {
    /// Takes the spinner away before an error is printed.
    fn drop(&mut self) {
        self.end();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colors() {
        assert_eq!(color("#ff0080"), Ok(Color::new(1.0, 0.0, 128.0 / 255.0)));
        for wrong in ["", "#", "#fff", "red", "#ff00zz", "#+f0080", "#€€"] {
            assert!(color(wrong).is_err(), "{wrong}");
        }
    }
}
