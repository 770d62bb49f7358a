use std::io::{self, BufRead, BufReader, Read};
use std::path::PathBuf;

use rayon::prelude::*;
use seamount::action::{Picker, Surface};
use seamount::node::{FaceDetail, HitDetail, LineDetail, PointDetail, TextDetail};
use seamount::prelude::*;
use serde::Serialize;

use super::{Failure, Outcome, Output, SceneArg, in_file, load, size};

/// Find where a ray meets the scene.
///
/// Terrains are met on the four coarse triangles of each patch of the picture that the camera takes (without a camera, of
/// their finest patches), on the triangles of that picture, or exactly on every cell of the map. No graphics hardware is used.
#[derive(Debug, clap::Args)]
#[command(group = clap::ArgGroup::new("target").required(true))]
pub(super) struct Args {
    #[command(flatten)]
    scene: SceneArg,
    /// Through the centre of a pixel, counted from the top left
    #[arg(long, group = "target", value_name = "X,Y", value_parser = pixel)]
    pixel: Option<[u32; 2]>,
    /// Through a point of the picture: 0,0 is the bottom left corner, 1,1 the top right
    #[arg(long, group = "target", value_name = "X,Y", value_parser = normalized)]
    normalized: Option<[f64; 2]>,
    /// Along a ray: origin and direction in world coordinates
    #[arg(long, group = "target", value_name = "OX,OY,OZ,DX,DY,DZ", value_parser = ray, allow_hyphen_values = true)]
    ray: Option<Ray>,
    /// Along the rays in a file, six numbers a line, `-` for standard input
    ///
    /// Numbers are separated by commas or blanks. Prints a JSON object a line, in the same order; for a line that is no
    /// ray, empty ones included, an object with `error` and `line`, and goes on. The exit status is 0 even so.
    #[arg(long, group = "target", value_name = "FILE")]
    rays: Option<PathBuf>,
    /// Size of the picture that pixels refer to and detail is chosen for
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = size)]
    size: [u32; 2],
    /// Name of the camera; the first one if not given
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    /// Which surface of terrains is met
    #[arg(long, value_enum, default_value_t)]
    surface: SurfaceArg,
    /// All crossings in order of distance, instead of the first
    #[arg(long)]
    all: bool,
    /// Print an object with `hits`
    #[arg(long)]
    json: bool,
}

/// The surfaces by name.
#[derive(Debug, Clone, Copy, Default, clap::ValueEnum)]
pub(super) enum SurfaceArg {
    /// Four coarse triangles per patch, with the bound of their error
    #[default]
    Coarse,
    /// The very triangles that the picture shows
    Drawn,
    /// Every cell of the full-resolution map
    Exact,
}

impl From<SurfaceArg> for Surface {
    fn from(arg: SurfaceArg) -> Self {
        match arg {
            SurfaceArg::Coarse => Surface::Coarse,
            SurfaceArg::Drawn => Surface::Drawn,
            SurfaceArg::Exact => Surface::Exact,
        }
    }
}

pub(super) fn numbers<T: std::str::FromStr, const N: usize>(text: &str, what: &str) -> Result<[T; N], String> {
    let parsed: Result<Vec<T>, _> = text
        .split(|c: char| c == ',' || c.is_whitespace())
        .filter(|word| !word.is_empty())
        .map(|word| word.parse().map_err(|_| format!("{word:?} is no number; give {what}")))
        .collect();
    let parsed = parsed?;
    let count = parsed.len();
    parsed.try_into().map_err(|_| format!("{count} numbers instead of {N}: give {what}"))
}

fn pixel(text: &str) -> Result<[u32; 2], String> {
    numbers(text, "column and row as in 640,360, from 0 up")
}

fn normalized(text: &str) -> Result<[f64; 2], String> {
    let point: [f64; 2] = numbers(text, "a point as in 0.5,0.25, from the bottom left")?;
    let inside = point.iter().all(|v| (0.0..=1.0).contains(v));
    if inside { Ok(point) } else { Err("a point of the picture has coordinates from 0 to 1".to_owned()) }
}

fn ray(text: &str) -> Result<Ray, String> {
    let [ox, oy, oz, dx, dy, dz] = numbers(text, "origin and direction as in 0,0,100,0,0,-1")?;
    Ray::new(DVec3::new(ox, oy, oz), DVec3::new(dx, dy, dz)).map_err(|error| error.to_string())
}

pub(super) fn run(args: &Args) -> Outcome {
    let [width, height] = args.size;
    if let Some([x, y]) = args.pixel
        && (x >= width || y >= height)
    {
        let message = format!(
            "pixel {x},{y} lies outside of the picture of {width}x{height}: pixels count from 0,0 to {},{}",
            width - 1,
            height - 1
        );
        return Err(Failure::Usage(message));
    }
    let scene = load(&args.scene.scene)?;
    let failed = in_file(&args.scene.scene);
    let action = RayPickAction {
        surface: args.surface.into(),
        camera: args.camera.clone(),
        ..RayPickAction::pixel(0, 0, args.size)
    };
    if let Some(path) = &args.rays {
        let picker = action.picker(&scene).map_err(&failed)?;
        return stream(args, path, &scene, &picker, &failed);
    }
    let target = match (args.ray, args.pixel, args.normalized) {
        (Some(ray), ..) => PickTarget::Ray(ray),
        (_, Some([x, y]), _) => PickTarget::Pixel(f64::from(x) + 0.5, f64::from(y) + 0.5),
        (.., Some([x, y])) => PickTarget::Normalized(x, y),
        (None, None, None) => return Err(Failure::Usage("give --pixel, --normalized, --ray or --rays".to_owned())),
    };
    let hits = RayPickAction { target, all: args.all, ..action }.apply(&scene).map_err(&failed)?;
    let mut out = Output::new();
    if args.json {
        out.json(&Hits::new(&hits, &scene))?;
    } else if hits.is_empty() {
        out.line("nothing hit")?;
    } else {
        for hit in &hits {
            out.line(sentence(hit, Some(hit.distance), &scene))?;
        }
    }
    out.flush()
}

/// A hit for people, with its distance from where somebody looks.
pub(super) fn sentence(hit: &PickedPoint, distance: Option<f64>, scene: &Scene) -> String {
    let (p, n) = (hit.point, hit.normal);
    let mut text = format!(
        "{} {} {}{}  normal {:.6} {:.6} {:.6}  {}",
        p.x,
        p.y,
        p.z,
        distance.map_or_else(String::new, |distance| format!("  distance {distance}")),
        n.x,
        n.y,
        n.z,
        hit.path.names(scene).join("/"),
    );
    if let Some(bound) = hit.error_bound.filter(|&bound| bound > 0.0) {
        text.push_str(&format!("  within {bound} of the ground"));
    }
    text
}

/// Most rays that are taken at once.
const CHUNK: usize = 4096;

/// Picks along the rays of a file. As many lines as have come are taken at once and shared among the processors; nothing
/// waits for more, so that a program on the other end of a pipe can ask line by line.
fn stream(
    args: &Args,
    path: &PathBuf,
    scene: &Scene,
    picker: &Picker<'_>,
    failed: &(impl Fn(ActionError) -> Failure + Sync),
) -> Outcome {
    let unreadable = |error| Failure::Error(format!("can not read the rays in {}: {error}", path.display()));
    let source: Box<dyn Read> = if path.as_os_str() == "-" {
        Box::new(io::stdin().lock())
    } else {
        Box::new(std::fs::File::open(path).map_err(unreadable)?)
    };
    let mut source = BufReader::with_capacity(1 << 18, source);
    let mut out = Output::new();
    let mut done = 0;
    let mut lines: Vec<Vec<u8>> = Vec::new();
    loop {
        lines.clear();
        let mut line = Vec::new();
        while source.read_until(b'\n', &mut line).map_err(unreadable)? > 0 {
            lines.push(std::mem::take(&mut line));
            if lines.len() >= CHUNK || !source.buffer().contains(&b'\n') {
                break;
            }
        }
        if lines.is_empty() {
            return out.flush();
        }
        let answers: Vec<Result<String, Failure>> = lines
            .par_iter()
            .with_min_len(16)
            .enumerate()
            .map(|(index, line)| answer(line, done + index + 1, args.all, scene, picker, failed))
            .collect();
        for answer in answers {
            out.line(answer?)?;
        }
        done += lines.len();
        out.flush()?;
    }
}

/// The JSON object for a line.
fn answer(
    line: &[u8],
    number: usize,
    all: bool,
    scene: &Scene,
    picker: &Picker<'_>,
    failed: &(impl Fn(ActionError) -> Failure + Sync),
) -> Result<String, Failure> {
    let found = std::str::from_utf8(line).map_err(|_| "the line is not UTF-8 text".to_owned()).and_then(ray);
    let text = match found {
        Ok(ray) => serde_json::to_string(&Hits::new(&picker.pick(&ray, all).map_err(failed)?, scene)),
        Err(error) => serde_json::to_string(&NoRay { error, line: number }),
    };
    Ok(text?)
}

#[derive(Serialize)]
struct NoRay {
    error: String,
    line: usize,
}

#[derive(Serialize)]
pub(super) struct Hits {
    hits: Vec<Hit>,
}

impl Hits {
    pub(super) fn new(hits: &[PickedPoint], scene: &Scene) -> Self {
        Self { hits: hits.iter().map(|hit| Hit::new(hit, scene)).collect() }
    }
}

#[derive(Serialize)]
struct Hit {
    point: [f64; 3],
    normal: [f64; 3],
    distance: f64,
    uv: [f64; 2],
    path: Vec<String>,
    surface: &'static str,
    error_bound: Option<f64>,
    on_top: bool,
    object_point: [f64; 3],
    object_normal: [f64; 3],
    smooth_normal: [f64; 3],
    /// The images of the three axes and of the origin.
    local_to_world: [[f64; 3]; 4],
    world_to_local: [[f64; 3]; 4],
    /// What other shapes than terrains can say.
    detail: Option<Detail>,
    terrain: Option<Terrain>,
}

/// What a kind of shape can say, under the name of what was hit.
#[derive(Serialize)]
#[serde(rename_all = "snake_case")]
enum Detail {
    Triangle { index: usize },
    Face { face: usize, part: usize, points: [usize; 3], barycentric: [f64; 3] },
    Line { line: usize, piece: usize, points: [usize; 2], along: f64 },
    Point { index: usize, point: usize },
    Text { string: usize, character: usize },
}

/// What only a terrain can say.
#[derive(Serialize)]
struct Terrain {
    level: u8,
    patch: Place,
    cell: Place,
    triangle: &'static str,
    barycentric: [f64; 3],
    wall: bool,
    void: bool,
    height: f64,
    slope: f64,
    entering: bool,
}

#[derive(Serialize)]
struct Place {
    column: u32,
    row: u32,
}

impl Hit {
    fn new(hit: &PickedPoint, scene: &Scene) -> Self {
        let terrain = match hit.detail {
            HitDetail::Terrain(detail) => Some(Terrain {
                level: detail.patch.level,
                patch: Place { column: detail.patch.column, row: detail.patch.row },
                cell: Place { column: detail.cell[0], row: detail.cell[1] },
                triangle: detail.triangle.name(),
                barycentric: detail.barycentric,
                wall: detail.wall,
                void: detail.void,
                height: detail.height,
                slope: detail.slope,
                entering: detail.entering,
            }),
            _ => None,
        };
        let detail = match hit.detail {
            HitDetail::Triangle { index } => Some(Detail::Triangle { index }),
            HitDetail::Face(FaceDetail { face, part, points, barycentric }) => {
                Some(Detail::Face { face, part, points, barycentric })
            }
            HitDetail::Line(LineDetail { line, piece, points, along }) => {
                Some(Detail::Line { line, piece, points, along })
            }
            HitDetail::Point(PointDetail { index, point }) => Some(Detail::Point { index, point }),
            HitDetail::Text(TextDetail { string, character }) => Some(Detail::Text { string, character }),
            _ => None,
        };
        Self {
            point: hit.point.to_array(),
            normal: hit.normal.to_array(),
            distance: hit.distance,
            uv: hit.uv.to_array(),
            path: hit.path.names(scene),
            surface: hit.surface.name(),
            error_bound: hit.error_bound,
            on_top: hit.on_top,
            object_point: hit.object_point.to_array(),
            object_normal: hit.object_normal.to_array(),
            smooth_normal: hit.smooth_normal.to_array(),
            local_to_world: hit.local_to_world.to_cols_array_2d(),
            world_to_local: hit.world_to_local().to_cols_array_2d(),
            detail,
            terrain,
        }
    }
}
