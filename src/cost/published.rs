//! Section 5: the published tables, done again.

use std::sync::Arc;

use super::bench::{Bench, gpu_figure, median, ms};
use super::report::{Eye, Figure, PublishedFigures, PublishedRow, PublishedTimes, detail_name};
use super::{CostError, Plan, Run};
use crate::action::{Frame, Geometry};
use crate::node::{DetailMode, SeamlessTerrain};

/// The views of the older table, by the names of our eyes.
const VIEWS: [&str; 3] = ["above", "corner", "middle"];

/// Three resolutions from 16 on, as in the published node.
const RESOLUTIONS: (u32, u32) = (16, 3);

/// Views and flights.
pub(super) const STEPS: usize = VIEWS.len() + 2;

pub(super) fn measure(run: &mut Run<'_>, plan: &Plan) -> Result<(), CostError> {
    let before = run.bench.scene.get::<SeamlessTerrain>(run.bench.main.key).map(|node| node.resolutions);
    run.bench.edit_terrains(|node| node.resolutions = RESOLUTIONS);
    let eyes = run.bench.main.eyes(run.bench.size);
    run.bench.set_detail(DetailMode::Precision(1.0));
    for eye in eyes.iter().filter(|eye| VIEWS.contains(&eye.name.as_str())) {
        run.begin(&format!("published view: {}", eye.name));
        for culling in [true, false] {
            for instanced in [true, false] {
                let mut row = row(&mut run.bench, std::slice::from_ref(eye), culling, instanced, plan.repeats)?;
                row.name = format!("{}, {}", eye.name, row.name);
                run.report.published.get_or_insert_default().views.push(row);
            }
        }
        run.finished()?;
    }
    let steps = (plan.flight_steps / 4).max(1);
    let flight: Vec<Eye> = (0..steps).map(|k| run.bench.main.flight(k, steps)).collect();
    for precision in [4.0, 1.0] {
        let detail = DetailMode::Precision(precision);
        run.begin(&format!("published flight, {}", detail_name(detail)));
        run.bench.set_detail(detail);
        for instanced in [true, false] {
            let mut row = row(&mut run.bench, &flight, true, instanced, 1)?;
            row.name = format!("flight, {}, {}", detail_name(detail), row.name);
            run.report.published.get_or_insert_default().flights.push(row);
        }
        run.finished()?;
    }
    if let Some(before) = before {
        run.bench.edit_terrains(|node| {
            node.resolutions = before;
            node.culling = true;
        });
    }
    Ok(())
}

/// Draws what some eyes see in one way: means of the counts, and of the times medians.
fn row(
    bench: &mut Bench,
    eyes: &[Eye],
    culling: bool,
    instanced: bool,
    repeats: usize,
) -> Result<PublishedRow, CostError> {
    bench.edit_terrains(|node| node.culling = culling);
    let (mut triangles, mut away, mut calls, mut parts) = (0.0, 0.0, 0.0, 0.0);
    let (mut encodings, mut gpus) = (Vec::new(), Vec::new());
    for eye in eyes {
        bench.look(eye, 0);
        let mut frame = bench.frame()?.clone();
        parts += f64::from(frame.statistics.draw_calls);
        away += bench.facing_away(culling)? as f64;
        if !instanced {
            separate(&mut frame);
        }
        for repeat in 0..repeats {
            let report = bench.headless.draw(&frame)?.report;
            if repeat == 0 {
                triangles += frame.statistics.triangles as f64;
                calls += f64::from(report.draw_calls);
            }
            encodings.push(ms(report.encode));
            gpus.push(report.gpu.map(ms));
        }
    }
    let eyes = eyes.len() as f64;
    let figures = PublishedFigures {
        triangles: triangles / eyes,
        facing_away: away / eyes,
        draw_calls: calls / eyes,
        parts_in_use: parts / eyes,
    };
    let frames: Vec<Option<f64>> =
        gpus.iter().zip(&encodings).map(|(gpu, encoding)| Some(gpu.as_ref()? + encoding)).collect();
    let frame_ms: Figure = gpu_figure(&frames, median);
    let times = PublishedTimes { encoding_ms: median(&mut encodings), gpu_ms: gpu_figure(&gpus, median), frame_ms };
    let name = format!(
        "{}, {}",
        if culling { "culled" } else { "not culled" },
        if instanced { "instanced" } else { "separate" }
    );
    Ok(PublishedRow { name, culling, instanced, figures, times })
}

/// A draw call for each part of each patch.
fn separate(frame: &mut Frame) {
    for draw in &mut frame.draws {
        if let Geometry::Terrain(terrain) = &mut draw.geometry {
            terrain.instances = Arc::new(terrain.instances.separated());
        }
    }
}
