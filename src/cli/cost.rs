use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};

use indicatif::{ProgressBar, ProgressStyle};
use seamount::cost::{self, Options, Report, Watcher};

use super::{Failure, Outcome, Output, load, size};

/// Measure what each step of accuracy costs for a scene, or compare two such measurements.
///
/// Writes index.html (a page by itself), report.md with its plots, and data.json into a folder. What is finished is written
/// at once: an interrupted run leaves what it has.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Scene file, or height map
    #[arg(required_unless_present = "compare")]
    scene: Option<PathBuf>,
    /// The folder to write to; made if it is not there
    #[arg(short, long, value_name = "DIR", required_unless_present = "compare")]
    output: Option<PathBuf>,
    /// Fewer settings: under a minute without a GPU
    #[arg(long)]
    quick: bool,
    /// Part of the name of the graphics adapter; hardware before software if not given
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Size of the pictures
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = size)]
    size: [u32; 2],
    /// Instead: what became larger or less accurate from one data.json to another. Exit status 1 if anything did
    #[arg(long, num_args = 2, value_names = ["OLD.json", "NEW.json"], conflicts_with_all = ["scene", "output", "quick"])]
    compare: Option<Vec<PathBuf>>,
    /// By how much a figure may become worse
    #[arg(long, value_name = "PERCENT", default_value_t = 5.0, requires = "compare")]
    threshold: f64,
}

pub(super) fn run(args: &Args) -> Outcome {
    if let Some([old, new]) = args.compare.as_deref() {
        return compare(old, new, args.threshold);
    }
    let (Some(path), Some(folder)) = (&args.scene, &args.output) else {
        return Err(Failure::Usage("give a scene and a folder to write to".to_owned()));
    };
    let _made =
        Made::new(folder).map_err(|e| Failure::Error(format!("can not make the folder {}: {e}", folder.display())))?;
    let mut watcher = Writing { folder, bar: None };
    watcher.begin(0, 1, &format!("reading {}", path.display()));
    let scene = load(path)?;
    let options =
        Options { quick: args.quick, adapter: args.adapter.clone(), size: args.size, command: command(path, args) };
    let report =
        cost::run(scene, &options, &mut watcher).map_err(|e| Failure::Error(format!("{}: {e}", path.display())))?;
    watcher.end();
    let mut out = Output::new();
    out.line(sentence(&report, folder))?;
    out.flush()
}

/// The folders that had to be made: what of them is empty in the end, because the run failed before it had anything, goes again.
struct Made<'a>(Vec<&'a Path>);

impl<'a> Made<'a> {
    fn new(folder: &'a Path) -> io::Result<Self> {
        let missing = |path: &&Path| !path.as_os_str().is_empty() && !path.exists();
        let made = Self(folder.ancestors().take_while(missing).collect());
        std::fs::create_dir_all(folder)?;
        Ok(made)
    }
}

impl Drop for Made<'_> {
    fn drop(&mut self) {
        for folder in &self.0 {
            // Only one that is empty can be removed so, and there is nobody to tell if it can not.
            let _ = std::fs::remove_dir(folder);
        }
    }
}

/// The command as the report quotes it: without the folder, which is no part of what is measured.
fn command(path: &Path, args: &Args) -> String {
    let mut command = format!("seamount cost {}", path.display());
    if args.quick {
        command.push_str(" --quick");
    }
    if let Some(adapter) = &args.adapter {
        command.push_str(&format!(" --adapter {adapter:?}"));
    }
    if args.size != [1280, 720] {
        command.push_str(&format!(" --size {}x{}", args.size[0], args.size[1]));
    }
    command
}

fn sentence(report: &Report, folder: &Path) -> String {
    let rows = report.drawing.as_ref().map_or(0, |d| d.rows.len());
    format!("{}: index.html, report.md and data.json; {rows} pictures compared", folder.display())
}

/// Prints what changed; fails if anything became worse.
fn compare(old: &Path, new: &Path, threshold: f64) -> Outcome {
    if !(threshold >= 0.0 && threshold.is_finite()) {
        return Err(Failure::Usage(format!("a threshold of {threshold} % does not work: a number from 0 up")));
    }
    let [before, after] = [read(old)?, read(new)?];
    let found = cost::compare::compare(&before, &after, threshold / 100.0)?;
    let mut out = Output::new();
    for note in &found.notes {
        out.line(format_args!("note: {note}"))?;
    }
    let shown = |value: Option<f64>| value.map_or_else(|| "null".to_owned(), |v| v.to_string());
    for (verdict, changes) in [("worse", &found.worse), ("better", &found.better)] {
        for change in changes {
            out.line(format_args!("{verdict}: {}: {} -> {}", change.name, shown(change.old), shown(change.new)))?;
        }
    }
    for time in &found.times {
        out.line(format_args!(
            "time: {}: {:.2} x over {} rows, at most {:.2} x ({})",
            time.name, time.mean_ratio, time.rows, time.max_ratio, time.slowest
        ))?;
    }
    let (worse, better) = (found.worse.len(), found.better.len());
    out.line(format_args!("{worse} worse, {better} better, {} within {threshold} %, {} new", found.same, found.added))?;
    out.flush()?;
    if found.passed() { Ok(()) } else { Err(Failure::Silent) }
}

fn read(path: &Path) -> Result<serde_json::Value, Failure> {
    let failed = |what: String| Failure::Error(format!("{}: {what}", path.display()));
    let text = std::fs::read_to_string(path).map_err(|e| failed(e.to_string()))?;
    serde_json::from_str(&text).map_err(|e| failed(format!("this is no data.json of a report: {e}")))
}

/// Shows a bar on a terminal, otherwise a line for each step, and writes what is finished.
struct Writing<'a> {
    folder: &'a Path,
    bar: Option<ProgressBar>,
}

impl Writing<'_> {
    fn end(&mut self) {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
    }
}

impl Watcher for Writing<'_> {
    fn begin(&mut self, step: usize, steps: usize, what: &str) {
        if !io::stderr().is_terminal() {
            // Progress that can not be told is no failure.
            let _ = writeln!(io::stderr(), "{step}/{steps} {what}");
            return;
        }
        let bar = self.bar.get_or_insert_with(|| {
            let bar = ProgressBar::new(0);
            if let Ok(style) = ProgressStyle::with_template("{bar:30} {pos}/{len} {elapsed} {msg}") {
                bar.set_style(style);
            }
            bar.enable_steady_tick(std::time::Duration::from_millis(200));
            bar
        });
        bar.set_length(steps as u64);
        bar.set_position(step as u64);
        bar.set_message(what.to_owned());
    }

    fn finished(&mut self, report: &Report) -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
        Ok(cost::write(report, self.folder)?)
    }
}

impl Drop for Writing<'_> {
    /// Takes the bar away before an error is printed.
    fn drop(&mut self) {
        self.end();
    }
}
