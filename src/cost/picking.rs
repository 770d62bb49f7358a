//! Section 2: what picking costs on each surface, and how far off it is.

use std::hint::black_box;
use std::time::Instant;

use glam::DVec3;

use super::bench::median;
use super::report::{Figure, Picking, PickingFigures, PickingRow, PickingTimes, detail_name};
use super::{CostError, Plan, Run};
use crate::action::{ActionError, PickedPoint, Picker, Ray, RayPickAction, Surface};
use crate::node::DetailMode;

/// Surfaces and the settings that they are picked at; the exact one is the same at all.
const SURFACES: [(Surface, &[f64]); 3] =
    [(Surface::Coarse, &[1.0, 4.0, 16.0]), (Surface::Drawn, &[1.0, 4.0, 16.0]), (Surface::Exact, &[1.0])];

pub(super) const STEPS: usize = 4;

pub(super) fn measure(run: &mut Run<'_>, plan: &Plan) -> Result<(), CostError> {
    run.report.picking = Some(Picking::default());
    for class in ["camera", "grazing", "down", "along grid lines, 5° down"] {
        run.begin(&format!("picks: {class}"));
        let rays = rays(run, class, plan.rays)?;
        let truth = picks(&picker(run, Surface::Exact)?, &rays)?.0;
        for (surface, tolerances) in SURFACES {
            for &tolerance in tolerances {
                let detail = DetailMode::PixelError(tolerance);
                run.bench.set_detail(detail);
                let (found, ns_per_ray) = picks(&picker(run, surface)?, &rays)?;
                let name = match tolerances.len() {
                    1 => format!("{class}, {}", surface.name()),
                    _ => format!("{class}, {}, {}", surface.name(), detail_name(detail)),
                };
                let row = PickingRow {
                    name,
                    surface: surface.name().to_owned(),
                    rays: rays.len() as u32,
                    hits: truth.iter().flatten().count() as u32,
                    figures: figures(run, &rays, &truth, &found),
                    times: PickingTimes { ns_per_ray },
                };
                run.report.picking.get_or_insert_default().rows.push(row);
            }
        }
        run.finished()?;
    }
    Ok(())
}

fn picker<'r>(run: &'r Run<'_>, surface: Surface) -> Result<Picker<'r>, CostError> {
    let action = RayPickAction { surface, ..RayPickAction::pixel(0, 0, run.bench.size) };
    Ok(action.picker(&run.bench.scene)?)
}

/// First hits, and the time for each on this thread: of a second pass, which finds what is made once and keeps none of the hits,
/// since the room for all of them takes longer to get than some of the picks.
fn picks(picker: &Picker<'_>, rays: &[Ray]) -> Result<(Vec<Option<PickedPoint>>, f64), CostError> {
    let first = |ray| picker.pick(ray, false).map(|hits| hits.into_iter().next());
    let found: Vec<_> = rays.iter().map(first).collect::<Result<_, ActionError>>()?;
    let start = Instant::now();
    for ray in rays {
        black_box(picker.pick(ray, false)?);
    }
    Ok((found, start.elapsed().as_secs_f64() * 1e9 / rays.len().max(1) as f64))
}

/// Rays of one class in world coordinates.
fn rays(run: &mut Run<'_>, class: &str, count: u32) -> Result<Vec<Ray>, CostError> {
    let eye_name = if class == "grazing" { "grazing" } else { "corner" };
    if let Some(eye) = run.bench.main.eyes(run.bench.size).into_iter().find(|eye| eye.name == eye_name) {
        run.bench.look(&eye, 0);
    }
    let side = f64::from(count).sqrt() as u32;
    let places = (0..side).flat_map(|y| (0..side).map(move |x| (x, y)));
    let at = |k: u32| (f64::from(k) + 0.5) / f64::from(side);
    if matches!(class, "camera" | "grazing") {
        let picker = picker(run, Surface::Exact)?;
        return places.map(|(x, y)| Ok(picker.ray_through(at(x), at(y))?)).collect();
    }
    let main = &run.bench.main;
    let [low, high] = main.heights();
    let cells = main.placed.frame.cells;
    let [x_side, y_side] = main.extent();
    let ray = |(x, y): (u32, u32)| {
        let (origin, direction) = if class == "down" {
            (DVec3::new(at(x) * x_side, at(y) * y_side, high + (high - low)), DVec3::NEG_Z)
        } else {
            // On a line of samples: a whole row from the south border.
            let row = (at(y) * f64::from(cells[1])).floor() / f64::from(cells[1]);
            let above = high + at(x) * (high - low);
            (DVec3::new(0.0, row * y_side, above), DVec3::new(5f64.to_radians().cos(), 0.0, -5f64.to_radians().sin()))
        };
        let direction = main.model.transform_vector3(direction);
        Ray::new(main.model.transform_point3(origin), direction).map_err(|e| ActionError::from(e).into())
    };
    places.map(ray).collect()
}

fn figures(
    run: &Run<'_>,
    rays: &[Ray],
    truth: &[Option<PickedPoint>],
    found: &[Option<PickedPoint>],
) -> PickingFigures {
    let main = &run.bench.main;
    let (frame, field) = (main.placed.frame, main.placed.terrain.field());
    let world_from_local = main.model.matrix3.z_axis.length();
    let inverse = main.model.inverse();
    let [low, _] = main.heights();
    let extent = main.extent();
    let inside = |p: DVec3| (0.0..=extent[0]).contains(&p.x) && (0.0..=extent[1]).contains(&p.y);
    let ground = |p: DVec3| {
        let lattice = frame.lattice(p);
        field.surface(lattice.x, lattice.y).map(|w| frame.local(DVec3::new(lattice.x, lattice.y, w)).z)
    };
    // From above the ground to below the lowest of it, over the map all the way: no surface can be missed.
    let must_hit = |ray: &Ray| {
        let (origin, direction) = (inverse.transform_point3(ray.origin), inverse.transform_vector3(ray.direction));
        let below = origin + direction * ((low - origin.z) / direction.z);
        direction.z < 0.0 && inside(origin) && inside(below) && ground(origin).is_some_and(|z| origin.z > z)
    };
    // Hits of other shapes, and of other terrains, lie on other grounds.
    let of_main = |hit: &PickedPoint| hit.node() == Some(main.key) && hit.local_to_world == main.model;
    let mut lost = 0;
    let (mut vertical, mut horizontal) = (Vec::new(), Vec::new());
    for ((ray, truth), found) in rays.iter().zip(truth).zip(found) {
        let Some(found) = found else {
            // Through a hole a ray passes rightly, and so misses the exact surface as well.
            lost += u32::from(must_hit(ray) && (truth.is_some() || !field.has_holes()));
            continue;
        };
        if !of_main(found) {
            continue;
        }
        if let Some(z) = ground(found.object_point) {
            vertical.push((found.object_point.z - z).abs() * world_from_local);
        }
        if let Some(truth) = truth.as_ref().filter(|truth| of_main(truth)) {
            let across = |p: DVec3| DVec3::new(p.x, p.y, 0.0);
            let off = across(found.object_point) - across(truth.object_point);
            horizontal.push(main.model.transform_vector3(off).length());
        }
    }
    horizontal.sort_by(f64::total_cmp);
    let none = "no ray meets both surfaces";
    let p95 = horizontal.get(horizontal.len() * 95 / 100).copied();
    let middle = (!horizontal.is_empty()).then(|| median(&mut horizontal));
    let mean_square = vertical.iter().map(|off| off * off).sum::<f64>() / vertical.len() as f64;
    let no_ground = "no ray is picked above or below the ground";
    PickingFigures {
        lost,
        rms_vertical: Figure::new(Some(mean_square.sqrt()), no_ground),
        max_vertical: Figure::new(vertical.iter().copied().reduce(f64::max), no_ground),
        median_horizontal: Figure::new(middle, none),
        p95_horizontal: Figure::new(p95, none),
    }
}
