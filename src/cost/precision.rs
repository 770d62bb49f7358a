//! Section 4: what the distance from the origin costs, and what it would cost in f32.

use glam::{DMat4, DVec2, DVec3};

use super::report::{Eye, Figure, Precision, PrecisionFigures, PrecisionRow};
use super::{CostError, Run};
use crate::action::{PickedPoint, RayPickAction, Surface, Viewpoint};
use crate::node::DetailMode;

/// Along x and y: at the origin, the Earth's radius, where f32 steps by 1 and by 64, and the Sun's distance in metres.
pub(super) const OFFSETS: [f64; 5] = [0.0, 6.4e6, 1e7, 1e9, 1.5e11];

/// Columns and rows of rays through the picture.
const RAYS: [u32; 2] = [64, 36];

pub(super) fn measure(run: &mut Run<'_>) -> Result<(), CostError> {
    // One whose coordinates are no whole numbers.
    let eye = run.bench.main.flight(17, 200);
    run.report.precision = Some(Precision::default());
    run.bench.set_detail(DetailMode::PixelError(1.0));
    let mut origin = None;
    for offset in OFFSETS {
        let name = format!("offset {offset:e}");
        run.begin(&name);
        let shown = show(run, &eye, offset)?;
        let origin = origin.get_or_insert_with(|| shown.clone());
        let figures = difference(origin, &shown);
        let row = PrecisionRow { name, offset, picks: RAYS[0] * RAYS[1], figures };
        run.report.precision.get_or_insert_default().rows.push(row);
        run.finished()?;
    }
    run.bench.move_by(0.0);
    Ok(())
}

/// What is seen and picked at one offset.
#[derive(Clone)]
struct Shown {
    rgba: Vec<u8>,
    view: Viewpoint,
    /// By ray.
    picks: Vec<Option<PickedPoint>>,
}

fn show(run: &mut Run<'_>, eye: &Eye, offset: f64) -> Result<Shown, CostError> {
    let bench = &mut run.bench;
    bench.move_by(offset);
    bench.look(eye, 0);
    let rgba = bench.draw()?.0.rgba;
    let view = bench.viewpoint()?;
    let action = RayPickAction { surface: Surface::Exact, ..RayPickAction::pixel(0, 0, bench.size) };
    let picker = action.picker(&bench.scene)?;
    let mut picks = Vec::new();
    for y in 0..RAYS[1] {
        for x in 0..RAYS[0] {
            let at = |k: u32, of: u32| (f64::from(k) + 0.5) / f64::from(of);
            let ray = picker.ray_through(at(x, RAYS[0]), at(y, RAYS[1]))?;
            picks.push(picker.pick(&ray, false)?.into_iter().next());
        }
    }
    Ok(Shown { rgba, view, picks })
}

/// The largest of some numbers, or why there are none.
fn largest(values: impl Iterator<Item = f64>, none: &str) -> Figure {
    Figure::new(values.reduce(f64::max), none)
}

fn difference(origin: &Shown, here: &Shown) -> PrecisionFigures {
    let pixels = origin.rgba.chunks_exact(4).zip(here.rgba.chunks_exact(4));
    let differences = pixels.map(|(a, b)| a.iter().zip(b).map(|(a, b)| u32::from(a.abs_diff(*b))).max().unwrap_or(0));
    let (different_pixels, max_difference) =
        differences.fold((0, 0), |(count, most), off| (count + u64::from(off > 0), off.max(most)));
    let picks = || origin.picks.iter().zip(&here.picks);
    let here_hits = || here.picks.iter().flatten();
    let off_by = |(a, b): (&Option<PickedPoint>, &Option<PickedPoint>)| {
        Some(a.as_ref()?.object_point.distance(b.as_ref()?.object_point))
    };
    let no_hit = "no ray hits anything";
    PrecisionFigures {
        different_pixels,
        max_difference,
        lost_picks: picks().filter(|(a, b)| a.is_some() != b.is_some()).count() as u32,
        max_pick_error: largest(picks().filter_map(off_by), "no ray hits both here and at the origin"),
        f32_error_px: largest(here_hits().map(|b| f32_error(&here.view, b.point)), no_hit),
        f32_pick_error: largest(here_hits().map(|b| b.point.distance(b.point.as_vec3().as_dvec3())), no_hit),
    }
}

/// How far a point is off in the picture, in pixels, when position and matrix are rounded to f32 as they are in world
/// coordinates, and multiplied in f32.
fn f32_error(view: &Viewpoint, point: DVec3) -> f64 {
    let clip_from_world = view.clip_from_eye() * DMat4::from_translation(-view.eye);
    let exact = view.clip_from_eye() * (point - view.eye).extend(1.0);
    let rounded = clip_from_world.as_mat4() * point.as_vec3().extend(1.0);
    let half = DVec2::new(view.aspect, 1.0) * (0.5 * view.pixels);
    let pixel = |clip: glam::DVec4| DVec2::new(clip.x, clip.y) / clip.w * half;
    let off = pixel(exact).distance(pixel(rounded.as_dvec4()));
    // A point that f32 puts into the eye's plane is as far off as can be: the picture's diagonal stands for it.
    if off.is_finite() { off } else { 2.0 * half.length() }
}
