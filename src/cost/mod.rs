//! What accuracy costs: one run over a scene that measures what each step of accuracy takes in time and memory, and how far
//! off it is; behind `seamount cost`.
//!
//! [`run`] measures and hands out a [`Report`], plain data, whenever a piece of it is finished; [`write`](write()) makes three files
//! of it; [`compare`] holds one against another. Every number is measured in that run; a [`Figure`] that could not be says why.

mod bench;
pub mod compare;
mod cracks;
mod drawing;
mod effects;
pub mod flip;
mod picking;
mod plots;
mod precision;
mod published;
mod report;
mod write;

use std::path::PathBuf;
use std::time::Duration;

use thiserror::Error;

pub use report::*;
pub use write::{html, markdown, write};

use crate::action::ActionError;
use crate::render::RenderError;
use crate::scene::{EditError, Scene};
use bench::Bench;

/// What to measure with.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Fewer settings and repeats: under a minute where the full run takes under ten.
    pub quick: bool,
    /// Part of the name of the graphics adapter; hardware before software if not given.
    pub adapter: Option<String>,
    /// Width and height of the pictures in pixels.
    pub size: [u32; 2],
    /// What the report says of how it was made.
    pub command: String,
}

impl Default for Options {
    /// All of it at 1280 × 720.
    fn default() -> Self {
        Self { quick: false, adapter: None, size: [1280, 720], command: String::new() }
    }
}

/// Why a scene could not be measured.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CostError {
    /// There is nothing whose detail could be chosen.
    #[error("there is no SeamlessTerrain in the scene: only its detail has a cost to choose")]
    NoTerrain,
    /// The largest terrain can not be looked at from anywhere.
    #[error("{}: a transform before the terrain scales by zero, so that nothing of it can be seen: scale by something else", path.join("/"))]
    Flat {
        /// The way to it.
        path: Vec<String>,
    },
    /// The scene can not be looked at.
    #[error(transparent)]
    Action(#[from] ActionError),
    /// It can not be drawn.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// It can not be put on the bench.
    #[error(transparent)]
    Edit(#[from] EditError),
    /// The watcher wants no more.
    #[error("{0}")]
    Stopped(Box<dyn std::error::Error + Send + Sync>),
}

/// Is told how a run goes.
pub trait Watcher {
    /// A piece of work begins: the how manieth of how many, and what it is.
    fn begin(&mut self, step: usize, steps: usize, what: &str);

    /// A piece of the report is finished, and all before it.
    ///
    /// # Errors
    ///
    /// Ends the run with [`CostError::Stopped`].
    fn finished(&mut self, report: &Report) -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
        let _ = report;
        Ok(())
    }
}

/// Watches nothing.
impl Watcher for () {
    fn begin(&mut self, _: usize, _: usize, _: &str) {}
}

/// The run so far.
struct Run<'w> {
    bench: Bench,
    report: Report,
    watcher: &'w mut dyn Watcher,
    step: usize,
    steps: usize,
}

impl Run<'_> {
    fn begin(&mut self, what: &str) {
        self.watcher.begin(self.step, self.steps, what);
        self.step += 1;
    }

    fn finished(&mut self) -> Result<(), CostError> {
        if let Some(drawing) = &mut self.report.drawing {
            drawing.memory = drawing::memory(&self.bench);
        }
        self.watcher.finished(&self.report).map_err(CostError::Stopped)
    }
}

/// Measures a scene.
///
/// # Errors
///
/// When there is no terrain in it, or it can not be looked at or drawn.
///
/// # Example
///
/// ```no_run
/// use seamount::cost::{Options, run};
/// use seamount::format::read_scene;
///
/// let scene = read_scene("scenes/andes.ron")?;
/// let report = run(scene, &Options { quick: true, ..Options::default() }, &mut ())?;
/// for row in report.drawing.iter().flat_map(|drawing| &drawing.rows) {
///     println!("{}: {} triangles, {:.2} px", row.name, row.figures.triangles, row.figures.max_error_px);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn run(scene: Scene, options: &Options, watcher: &mut dyn Watcher) -> Result<Report, CostError> {
    let plan = Plan::new(options.quick);
    let steps = 1 + plan.steps();
    watcher.begin(0, steps, "decoding the maps and starting the graphics adapter");
    let bench = Bench::new(scene, options, plan.patience)?;
    let report = Report {
        schema: SCHEMA_VERSION,
        complete: false,
        about: about(&bench, options),
        drawing: None,
        published: None,
        cracks: None,
        precision: None,
        picking: None,
        effects: None,
    };
    let mut run = Run { bench, report, watcher, step: 1, steps };
    drawing::measure(&mut run, &plan)?;
    picking::measure(&mut run, &plan)?;
    effects::measure(&mut run, &plan, options)?;
    precision::measure(&mut run)?;
    published::measure(&mut run, &plan)?;
    cracks::measure(&mut run, &plan)?;
    run.report.complete = true;
    run.finished()?;
    Ok(run.report)
}

/// How much is measured.
struct Plan {
    /// τ.
    tolerances: Vec<f64>,
    /// ρ.
    precisions: Vec<f64>,
    /// Whether the full mesh is drawn once more without culling.
    whole_mesh: bool,
    flight_steps: u32,
    /// Eyes that each rule is tried with for cracks.
    crack_eyes: u32,
    /// Rays of each class, rounded down to a square.
    rays: u32,
    /// τ of the frame that effects are added to.
    effects_tolerance: f64,
    /// How often a frame is drawn again for the time that an effect, or a published way of drawing, takes.
    repeats: usize,
    /// For how long the other frames are drawn again.
    patience: Duration,
}

impl Plan {
    fn new(quick: bool) -> Self {
        if quick {
            Self {
                tolerances: vec![1.0, 4.0, 16.0],
                precisions: vec![1.0, 4.0],
                whole_mesh: false,
                flight_steps: 10,
                crack_eyes: 20,
                rays: 2_500,
                effects_tolerance: 4.0,
                repeats: 1,
                patience: Duration::from_millis(200),
            }
        } else {
            Self {
                tolerances: (-2..=5).map(|k| f64::from(k).exp2()).collect(),
                precisions: (0..=4).map(|k| f64::from(k).exp2()).collect(),
                whole_mesh: true,
                flight_steps: 200,
                crack_eyes: 300,
                rays: 40_000,
                effects_tolerance: 1.0,
                repeats: 3,
                patience: Duration::from_millis(500),
            }
        }
    }

    fn steps(&self) -> usize {
        drawing::EYES * (1 + self.tolerances.len() + self.precisions.len() + usize::from(self.whole_mesh))
            + drawing::FLIGHTS.len()
            + picking::STEPS
            + effects::STEPS
            + precision::OFFSETS.len()
            + published::STEPS
            + cracks::STEPS
    }
}

fn about(bench: &Bench, options: &Options) -> About {
    let adapter = bench.headless.adapter();
    let field = bench.main.placed.terrain.field();
    About {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        command: options.command.clone(),
        adapter: format!("{} ({}, {:?})", adapter.name, adapter.backend, adapter.device_type),
        driver: format!("{} {}", adapter.driver, adapter.driver_info).trim().to_owned(),
        processor: processor(),
        threads: std::thread::available_parallelism().map_or(1, |n| n.get() as u32),
        size: options.size,
        quick: options.quick,
        terrain: bench.main.names.clone(),
        samples: [field.columns(), field.rows()],
    }
}

/// The processor's name, where Linux says it.
fn processor() -> String {
    let info = std::fs::read_to_string(PathBuf::from("/proc/cpuinfo")).unwrap_or_default();
    let name = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    name.map_or_else(String::new, |(_, name)| name.trim().to_owned())
}
