//! Section 1: what detail costs when drawing, and how far off it is.

use std::time::Instant;

use super::bench::{Bench, gpu_figure, ms};
use super::flip::{PIXELS_PER_DEGREE, Reference};
use super::report::{
    Drawing, DrawingFigures, DrawingRow, Figure, FlightFigures, FlightRow, FlightTimes, Memory, MemoryRow, detail_name,
};
use super::{CostError, Plan, Run};
use crate::node::DetailMode;

/// Eyes that [`super::bench::Terrain::eyes`] makes.
pub(super) const EYES: usize = 4;

/// Settings of the flight; the published one was flown with the second and third.
pub(super) const FLIGHTS: [DetailMode; 3] =
    [DetailMode::PixelError(1.0), DetailMode::Precision(1.0), DetailMode::Precision(4.0)];

/// Steps of a flight of which the error is measured.
const MEASURED_STEPS: u32 = 5;

pub(super) fn measure(run: &mut Run<'_>, plan: &Plan) -> Result<(), CostError> {
    let eyes = run.bench.main.eyes(run.bench.size);
    run.report.drawing = Some(Drawing { eyes: eyes.clone(), ..Drawing::default() });
    // Errors of the tiles, the map on the device, pipelines: what is made once is no frame's cost.
    run.bench.set_detail(DetailMode::PixelError(8.0));
    if let Some(eye) = eyes.first() {
        run.bench.look(eye, 0);
        run.bench.draw()?;
    }
    let tolerances = plan.tolerances.iter().map(|&tolerance| DetailMode::PixelError(tolerance));
    let precisions = plan.precisions.iter().map(|&precision| DetailMode::Precision(precision));
    // The full mesh first: the others are held against its picture.
    let details = std::iter::once(DetailMode::Full).chain(tolerances).chain(precisions).map(|detail| (detail, true));
    let details: Vec<_> = details.chain(plan.whole_mesh.then_some((DetailMode::Full, false))).collect();
    for eye in &eyes {
        let mut full = None;
        for &(detail, culling) in &details {
            let not_culled = if culling { "" } else { ", not culled" };
            let name = format!("{}, {}{not_culled}", eye.name, detail_name(detail));
            run.begin(&name);
            run.bench.edit_terrains(|node| node.culling = culling);
            run.bench.set_detail(detail);
            let shot = run.bench.shoot(eye)?;
            let error = run.bench.error()?;
            let (full, reference) = full.get_or_insert_with(|| {
                let rgba = shot.picture.rgba.clone();
                let reference = Reference::new(&rgba, run.bench.size, PIXELS_PER_DEGREE);
                (rgba, reference)
            });
            let figures = DrawingFigures {
                triangles: shot.statistics.triangles,
                patches: shot.statistics.patches_rendered,
                draw_calls: shot.picture.report.draw_calls,
                bytes_per_frame: shot.picture.report.bytes_uploaded,
                max_error_px: error.max,
                rms_error_px: error.rms,
                psnr_db: psnr(full, &shot.picture.rgba),
                flip: Figure::new(
                    reference.as_ref().and_then(|reference| reference.flip(&shot.picture.rgba)),
                    "the pictures are not of one size",
                ),
            };
            let row = DrawingRow { name, eye: eye.name.clone(), detail, culling, figures, times: shot.times };
            run.report.drawing.get_or_insert_default().rows.push(row);
        }
        run.bench.edit_terrains(|node| node.culling = true);
        run.finished()?;
    }
    for detail in FLIGHTS {
        run.begin(&format!("flight, {}", detail_name(detail)));
        let row = fly(&mut run.bench, detail, plan.flight_steps)?;
        run.report.drawing.get_or_insert_default().flights.push(row);
        run.finished()?;
    }
    Ok(())
}

/// What is kept whatever the setting.
pub(super) fn memory(bench: &Bench) -> Vec<MemoryRow> {
    let placed = &bench.main.placed;
    let field = placed.terrain.field();
    let figures = Memory {
        heights_bytes: field.samples().bytes() as u64,
        errors_bytes: placed.tree.tile_errors(field).bytes() as u64,
        device_bytes: bench.device_bytes,
    };
    vec![MemoryRow { name: "memory".to_owned(), figures }]
}

fn fly(bench: &mut Bench, detail: DetailMode, steps: u32) -> Result<FlightRow, CostError> {
    bench.set_detail(detail);
    let (mut triangles, mut patches, mut calls, mut bytes) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let (mut selections, mut encodings, mut gpus) = (Vec::new(), Vec::new(), Vec::new());
    let (mut worst, mut measured) = (0.0f64, 0);
    for k in 0..steps {
        let eye = bench.main.flight(k, steps);
        bench.look(&eye, 0);
        let start = Instant::now();
        bench.frame()?;
        let selection = start.elapsed();
        let (picture, statistics) = bench.draw()?;
        bench.device_bytes = bench.device_bytes.max(picture.report.gpu_bytes);
        triangles.push(statistics.triangles as f64);
        patches.push(statistics.patches_rendered as f64);
        calls.push(f64::from(picture.report.draw_calls));
        bytes.push(picture.report.bytes_uploaded as f64);
        // The first frame finds nothing warm.
        if k > 0 {
            selections.push(ms(selection));
            encodings.push(ms(picture.report.encode));
            gpus.push(picture.report.gpu.map(ms));
        }
        if k % steps.div_ceil(MEASURED_STEPS) == 0 {
            worst = worst.max(bench.error()?.max);
            measured += 1;
        }
    }
    let figures = FlightFigures {
        mean_triangles: mean(&triangles),
        max_triangles: max(&triangles) as u64,
        mean_patches: mean(&patches),
        mean_draw_calls: mean(&calls),
        max_draw_calls: max(&calls) as u32,
        mean_bytes_per_frame: mean(&bytes),
        max_error_px: worst,
    };
    let times = FlightTimes {
        mean_selection_ms: mean(&selections),
        max_selection_ms: max(&selections),
        mean_encoding_ms: mean(&encodings),
        mean_gpu_ms: gpu_figure(&gpus, |times| mean(times)),
        max_gpu_ms: gpu_figure(&gpus, |times| max(times)),
    };
    Ok(FlightRow { name: detail_name(detail), detail, steps, measured_steps: measured, figures, times })
}

fn mean(values: &[f64]) -> f64 {
    if values.is_empty() { 0.0 } else { values.iter().sum::<f64>() / values.len() as f64 }
}

fn max(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

/// Peak signal-to-noise ratio of two pictures of RGBA bytes in dB, over red, green and blue as they are encoded.
fn psnr(reference: &[u8], test: &[u8]) -> Figure {
    let pixels = reference.chunks_exact(4).zip(test.chunks_exact(4));
    let squares: u64 = pixels.flat_map(|(a, b)| (0..3).map(|k| u64::from(a[k].abs_diff(b[k])).pow(2))).sum();
    if squares == 0 {
        return Figure::new(None, "the pictures are the same: infinite");
    }
    let mean = squares as f64 / (reference.len() / 4 * 3) as f64;
    Figure::new(Some(10.0 * (255.0 * 255.0 / mean).log10()), "the pictures have no pixels")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn psnr_of_known_pictures() {
        let gray = |value| vec![value; 4 * 25];
        assert_eq!(psnr(&gray(7), &gray(7)).value(), None);
        // Off by one everywhere: 20 log₁₀ 255.
        let one = psnr(&gray(7), &gray(8)).value().unwrap();
        assert!((one - 48.130_803_608_679_1).abs() < 1e-9, "{one}");
        assert!(psnr(&gray(0), &gray(255)).value().unwrap().abs() < 1e-9);
    }
}
