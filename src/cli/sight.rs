use seamount::action::{Picker, Surface};
use seamount::prelude::*;

use super::pick::{Hits, SurfaceArg, numbers, sentence};
use super::{Failure, Outcome, Output, SceneArg, in_file, load, size};

/// Say whether two points see each other, or how high the ground is.
///
/// Terrains are met on every cell of their maps unless another surface is asked for. No graphics hardware is used.
#[derive(Debug, clap::Args)]
#[command(group = clap::ArgGroup::new("question").required(true))]
pub(super) struct Args {
    #[command(flatten)]
    scene: SceneArg,
    /// Between two points in world coordinates: the first obstacle, if there is one
    #[arg(long, group = "question", value_name = "AX,AY,AZ,BX,BY,BZ", value_parser = points, allow_hyphen_values = true)]
    between: Option<[DVec3; 2]>,
    /// The ground at a place of the world's x and y: the topmost point of all terrains there
    #[arg(long, group = "question", value_name = "X,Y", value_parser = place, allow_hyphen_values = true)]
    ground: Option<[f64; 2]>,
    /// Which surface of terrains is met
    #[arg(long, value_enum, default_value_t = SurfaceArg::Exact)]
    surface: SurfaceArg,
    /// Size of the picture that detail is chosen for
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = size)]
    size: [u32; 2],
    /// Name of the camera that detail is chosen for; the first one if not given
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    /// Print an object with `hits`: none if the points see each other, or there is no ground
    #[arg(long)]
    json: bool,
}

fn points(text: &str) -> Result<[DVec3; 2], String> {
    let [ax, ay, az, bx, by, bz] = numbers(text, "two points as in 0,0,2,500,300,2")?;
    finite([DVec3::new(ax, ay, az), DVec3::new(bx, by, bz)], |p| p.is_finite())
}

fn place(text: &str) -> Result<[f64; 2], String> {
    finite(numbers(text, "x and y as in 120,-35.5")?, |x: &f64| x.is_finite())
}

/// What is infinite or NaN is no place.
fn finite<T>(places: [T; 2], is_finite: impl Fn(&T) -> bool) -> Result<[T; 2], String> {
    if places.iter().all(is_finite) { Ok(places) } else { Err("a coordinate is not a finite number".to_owned()) }
}

pub(super) fn run(args: &Args) -> Outcome {
    let scene = load(&args.scene.scene)?;
    let failed = in_file(&args.scene.scene);
    let surface: Surface = args.surface.into();
    let action = RayPickAction { surface, camera: args.camera.clone(), ..RayPickAction::pixel(0, 0, args.size) };
    let picker: Picker<'_> = action.picker(&scene).map_err(&failed)?;
    let (found, nothing) = match (args.between, args.ground) {
        (Some([a, b]), _) => (picker.line_of_sight(a, b).map_err(&failed)?, "visible"),
        (None, Some([x, y])) => (picker.height_at(x, y).map_err(&failed)?.map(|ground| ground.picked), "no ground"),
        (None, None) => return Err(Failure::Usage("give --between or --ground".to_owned())),
    };
    let mut out = Output::new();
    if args.json {
        out.json(&Hits::new(found.as_slice(), &scene))?;
    } else {
        match &found {
            None => out.line(nothing)?,
            Some(hit) => out.line(sentence(hit, args.between.map(|_| hit.distance), &scene))?,
        }
    }
    out.flush()
}
