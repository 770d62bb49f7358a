//! The report for people and for programs: `index.html`, `report.md` with its plots, and `data.json`.

use std::fmt::Write as _;
use std::path::Path;

use super::plots::{Kind, Plot, Series};
use super::report::{
    Cracks, Drawing, DrawingRow, EffectsCost, Figure, Picking, Precision, Published, PublishedRow, Report, detail_name,
};
use crate::node::DetailMode;
use crate::output::{OutputError, write_file};

/// Writes a report into a folder that is there: `index.html`, which needs no other file, `report.md` with its plots as SVG
/// files, and `data.json`. Each file is written whole or not at all, `data.json` last.
///
/// # Errors
///
/// When the system refuses.
pub fn write(report: &Report, folder: &Path) -> Result<(), OutputError> {
    let text = |name: &str, content: String| write_file(&folder.join(name), |out| out.write_all(content.as_bytes()));
    text("index.html", html(report))?;
    for block in document(report) {
        if let Block::Plot { file, svg, .. } = block {
            text(&file, svg)?;
        }
    }
    text("report.md", markdown(report))?;
    let mut json = serde_json::to_string_pretty(report)
        .map_err(|e| OutputError::Io { path: folder.join("data.json"), error: e.into() })?;
    json.push('\n');
    text("data.json", json)
}

/// The report as a page by itself.
#[must_use]
pub fn html(report: &Report) -> String {
    let mut out = String::from(HEAD);
    for block in document(report) {
        // Writing into a String does not fail.
        let _ = match block {
            Block::Heading(level, text) => writeln!(out, "<h{level}>{}</h{level}>", escaped(&text)),
            Block::Text(text) => writeln!(out, "<p>{}</p>", escaped(&text)),
            Block::Plot { svg, .. } => writeln!(out, "<figure>{svg}</figure>"),
            Block::Table { head, rows } => {
                let line = |tag: &str, cells: &[String]| {
                    let cells: String = cells.iter().map(|c| format!("<{tag}>{}</{tag}>", escaped(c))).collect();
                    format!("<tr>{cells}</tr>\n")
                };
                let body: String = rows.iter().map(|row| line("td", row)).collect();
                writeln!(out, "<table><thead>{}</thead><tbody>\n{body}</tbody></table>", line("th", &head))
            }
        };
    }
    out.push_str("</main></body></html>\n");
    out
}

/// The report as Markdown; plots are files beside it.
#[must_use]
pub fn markdown(report: &Report) -> String {
    let mut out = String::new();
    for block in document(report) {
        let _ = match block {
            Block::Heading(level, text) => writeln!(out, "{} {text}\n", "#".repeat(level)),
            Block::Text(text) => writeln!(out, "{text}\n"),
            Block::Plot { title, file, .. } => writeln!(out, "![{title}]({file})\n"),
            Block::Table { head, rows } => {
                let line = |cells: &[String]| format!("| {} |\n", cells.join(" | ").replace('\n', " "));
                let rule = "|---".repeat(head.len());
                let body: String = rows.iter().map(|row| line(row)).collect();
                writeln!(out, "{}{rule}|\n{body}", line(&head))
            }
        };
    }
    out
}

const HEAD: &str = "<!DOCTYPE html>
<html lang=\"en\"><head><meta charset=\"utf-8\"><title>What accuracy costs</title>
<style>
body { font: 15px/1.5 sans-serif; color: #222; background: #fff; margin: 0 }
main { max-width: 64rem; margin: 2rem auto; padding: 0 1rem }
table { border-collapse: collapse; margin: 1rem 0; font-size: 13px; display: block; overflow-x: auto }
th, td { padding: .2rem .6rem; border-bottom: 1px solid #ddd; text-align: right; white-space: nowrap }
th:first-child, td:first-child { text-align: left }
thead { border-bottom: 2px solid #888 }
figure { margin: 1rem 0 }
svg { max-width: 100%; height: auto }
</style></head><body><main>
";

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// A piece of the report.
enum Block {
    Heading(usize, String),
    Text(String),
    Table { head: Vec<String>, rows: Vec<Vec<String>> },
    Plot { title: String, file: String, svg: String },
}

fn heading(level: usize, text: &str) -> Block {
    Block::Heading(level, text.to_owned())
}

fn text(text: impl Into<String>) -> Block {
    Block::Text(text.into())
}

fn table(head: &[&str], rows: Vec<Vec<String>>) -> Block {
    Block::Table { head: head.iter().map(|&h| h.to_owned()).collect(), rows }
}

fn plot(file: &str, plot: &Plot) -> Block {
    match plot.svg() {
        Some(svg) => Block::Plot { title: plot.title.clone(), file: file.to_owned(), svg },
        None => text(format!("{}: nothing above 0 was measured, so there is no plot.", plot.title)),
    }
}

/// A number for people: whole from 1000 up, else three digits that count.
fn number(value: f64) -> String {
    if !value.is_finite() {
        // A ratio of nothing.
        return "–".to_owned();
    }
    let size = value.abs();
    if size >= 1000.0 || value == value.round() && size < 1e15 {
        let digits = format!("{size:.0}");
        let mut out = String::new();
        for (i, digit) in digits.chars().enumerate() {
            if i > 0 && (digits.len() - i).is_multiple_of(3) {
                out.push('\u{202f}');
            }
            out.push(digit);
        }
        return if value < 0.0 { format!("−{out}") } else { out };
    }
    if size < 1e-3 {
        return format!("{value:.1e}");
    }
    let decimals = (2 - size.log10().floor() as i32).max(0) as usize;
    format!("{value:.decimals$}")
}

fn figure(figure: &Figure) -> String {
    match figure {
        Figure::Value(value) => number(*value),
        Figure::Missing { .. } => "–".to_owned(),
    }
}

/// Why figures are missing, each reason once.
fn reasons<'f>(figures: impl Iterator<Item = (&'static str, &'f Figure)>) -> Vec<Block> {
    let mut seen: Vec<(&str, &str)> = Vec::new();
    for (name, figure) in figures {
        if let Figure::Missing { reason, .. } = figure
            && !seen.contains(&(name, reason))
        {
            seen.push((name, reason));
        }
    }
    seen.into_iter().map(|(name, reason)| text(format!("Where {name} is –: {reason}."))).collect()
}

fn document(report: &Report) -> Vec<Block> {
    let about = &report.about;
    let [width, height] = about.size;
    let mut blocks = vec![heading(1, "What accuracy costs")];
    let head = [
        ("command", about.command.clone()),
        ("seamount", about.version.clone()),
        ("adapter", about.adapter.clone()),
        ("driver", about.driver.clone()),
        ("processor", format!("{}, {} threads", about.processor, about.threads)),
        ("terrain", format!("{}, {} × {} samples", about.terrain.join("/"), about.samples[0], about.samples[1])),
        ("pictures", format!("{width} × {height} pixels")),
    ];
    blocks.push(table(&["", ""], head.into_iter().map(|(a, b)| vec![a.to_owned(), b]).collect()));
    blocks.push(text(
        "Every number was measured in this run. Times are medians of a few repeats and follow the load of the machine; all \
         other figures are the same in every run of the same command on the same adapter.",
    ));
    if !report.complete {
        blocks.push(text("The run did not come to its end: what it had measured until then is here."));
    }
    if let Some(drawing) = &report.drawing {
        drawing_blocks(drawing, &mut blocks);
    }
    if let Some(picking) = &report.picking {
        picking_blocks(picking, &mut blocks);
    }
    if let Some(effects) = &report.effects {
        effects_blocks(effects, &mut blocks);
    }
    if let Some(precision) = &report.precision {
        precision_blocks(precision, &mut blocks);
    }
    if let Some(published) = &report.published {
        published_blocks(published, &mut blocks);
    }
    if let Some(cracks) = &report.cracks {
        cracks_blocks(cracks, &mut blocks);
    }
    blocks
}

fn drawing_blocks(drawing: &Drawing, blocks: &mut Vec<Block>) {
    blocks.push(heading(2, "1. Drawing"));
    blocks.push(text(
        "Each eye with each setting: what is drawn, how far it is from the full-resolution surface on the screen (at every \
         sample and every crossing of edges in view), how different the picture is from that of the full mesh, and what it \
         took. Selection is everything from the scene to the list of what to draw.",
    ));
    summary(drawing, blocks);
    let series = |x: fn(&DrawingRow) -> Option<f64>, precisions: bool| -> Vec<Series> {
        let mut found = Vec::new();
        for (group, eye) in drawing.eyes.iter().enumerate() {
            let rows = || drawing.rows.iter().filter(|row| row.eye == eye.name && row.culling);
            let mut add = |name: String, kind: Kind, wanted: fn(DetailMode) -> bool| {
                let points: Vec<(f64, f64)> = rows()
                    .filter(|row| wanted(row.detail))
                    .filter_map(|row| Some((x(row)?, row.figures.max_error_px)))
                    .collect();
                if !points.is_empty() {
                    found.push(Series { name, group, kind, points });
                }
            };
            add(format!("{}, τ", eye.name), Kind::Line, |d| matches!(d, DetailMode::PixelError(_)));
            if precisions {
                add(format!("{}, ρ", eye.name), Kind::Thin, |d| matches!(d, DetailMode::Precision(_)));
            }
            add(format!("{}, full mesh", eye.name), Kind::Mark, |d| d == DetailMode::Full);
        }
        found
    };
    let asked = |row: &DrawingRow| match row.detail {
        DetailMode::PixelError(tolerance) => Some(tolerance),
        DetailMode::Full => Some(0.0),
        DetailMode::Precision(_) => None,
    };
    blocks.push(text("The full mesh has no error, which has no place on a logarithmic axis: it stands at its foot."));
    blocks.push(plot(
        "asked.svg",
        &Plot {
            title: "Error asked for and error measured".to_owned(),
            x: "τ asked for, pixels",
            y: "largest error measured, pixels",
            diagonal: true,
            series: series(asked, false),
        },
    ));
    blocks.push(plot(
        "time.svg",
        &Plot {
            title: "Error and time".to_owned(),
            x: "selection + encoding + GPU, ms",
            y: "largest error measured, pixels",
            diagonal: false,
            series: series(|row| row.times.frame_ms(), true),
        },
    ));
    blocks.push(plot(
        "triangles.svg",
        &Plot {
            title: "Error and triangles".to_owned(),
            x: "triangles drawn",
            y: "largest error measured, pixels",
            diagonal: false,
            series: series(|row| Some(row.figures.triangles as f64), true),
        },
    ));
    let rows = drawing.rows.iter().map(|row| {
        let (f, t) = (&row.figures, &row.times);
        vec![
            row.name.clone(),
            number(f.triangles as f64),
            number(f.patches as f64),
            f.draw_calls.to_string(),
            number(f.bytes_per_frame as f64),
            number(f.max_error_px),
            number(f.rms_error_px),
            figure(&f.psnr_db),
            figure(&f.flip),
            number(t.selection_ms),
            number(t.encoding_ms),
            figure(&t.gpu_ms),
        ]
    });
    blocks.push(table(
        &[
            "eye, setting",
            "triangles",
            "patches",
            "draw calls",
            "bytes per frame",
            "max error, px",
            "RMS error, px",
            "PSNR, dB",
            "ꟻLIP",
            "selection, ms",
            "encoding, ms",
            "GPU, ms",
        ],
        rows.collect(),
    ));
    let missing = drawing
        .rows
        .iter()
        .flat_map(|row| [("PSNR", &row.figures.psnr_db), ("ꟻLIP", &row.figures.flip), ("GPU", &row.times.gpu_ms)]);
    blocks.extend(reasons(missing));
    if !drawing.flights.is_empty() {
        blocks.push(heading(3, "In flight"));
        blocks.push(text(
            "Once round the middle of the map, above all ground, looking ahead and down; means over the steps (largest in \
             brackets).",
        ));
        let rows = drawing.flights.iter().map(|row| {
            let (f, t) = (&row.figures, &row.times);
            vec![
                row.name.clone(),
                row.steps.to_string(),
                format!("{} ({})", number(f.mean_triangles.round()), number(f.max_triangles as f64)),
                number(f.mean_patches.round()),
                format!("{} ({})", number(f.mean_draw_calls), f.max_draw_calls),
                number(f.mean_bytes_per_frame.round()),
                number(f.max_error_px),
                format!("{} ({})", number(t.mean_selection_ms), number(t.max_selection_ms)),
                number(t.mean_encoding_ms),
                format!("{} ({})", figure(&t.mean_gpu_ms), figure(&t.max_gpu_ms)),
            ]
        });
        blocks.push(table(
            &[
                "setting",
                "steps",
                "triangles",
                "patches",
                "draw calls",
                "bytes per frame",
                "max error, px",
                "selection, ms",
                "encoding, ms",
                "GPU, ms",
            ],
            rows.collect(),
        ));
    }
    for row in &drawing.memory {
        let m = &row.figures;
        blocks.push(text(format!(
            "Memory, the same for all settings: {} bytes of heights, {} bytes of errors of tiles ({} %), at most {} bytes on \
             the device.",
            number(m.heights_bytes as f64),
            number(m.errors_bytes as f64),
            number(100.0 * m.errors_bytes as f64 / m.heights_bytes as f64),
            number(m.device_bytes as f64),
        )));
    }
}

/// What one pixel of error saves, by eye and over all.
fn summary(drawing: &Drawing, blocks: &mut Vec<Block>) {
    let one = DetailMode::PixelError(1.0);
    let (mut rows, mut ratios) = (Vec::new(), [Vec::new(), Vec::new()]);
    let times = |ratio: Option<f64>| ratio.map_or_else(|| "not measured".to_owned(), |r| format!("{} ×", number(r)));
    for eye in &drawing.eyes {
        let of = |detail: DetailMode, culling: bool| {
            let found = |row: &&DrawingRow| row.eye == eye.name && row.detail == detail && row.culling == culling;
            drawing.rows.iter().find(found)
        };
        let (Some(one), Some(full)) = (of(one, true), of(DetailMode::Full, true)) else { continue };
        if one.figures.triangles == 0 {
            // Nothing is in view.
            continue;
        }
        let (Some(frame), Some(culled)) = (one.times.frame_ms(), full.times.frame_ms()) else { continue };
        let whole = of(DetailMode::Full, false).and_then(|row| row.times.frame_ms());
        let ours = one.times.selection_ms + one.times.encoding_ms;
        let faster = [Some(culled / frame), whole.map(|whole| whole / frame)];
        ratios.iter_mut().zip(faster).for_each(|(ratios, faster)| ratios.push(faster));
        rows.push(vec![
            eye.name.clone(),
            number(one.figures.max_error_px),
            format!("{} × fewer", number(full.figures.triangles as f64 / one.figures.triangles as f64)),
            format!("{} ms, not {} ms", number(frame), number(culled)),
            times(faster[0]),
            times(faster[1]),
            format!("{} %", number(100.0 * ours / frame)),
        ]);
    }
    if !rows.is_empty() {
        let none = String::new;
        let [culled, whole] = ratios.map(|ratios| times(geometric_mean(ratios)));
        rows.push(vec!["geometric mean".to_owned(), none(), none(), none(), culled, whole, none()]);
        blocks.push(text(format!("At {} instead of the full mesh:", detail_name(one))));
        blocks.push(table(
            &[
                "eye",
                "max error, px",
                "triangles",
                "frame",
                "faster",
                "faster than without culling",
                "selection + encoding, of the frame",
            ],
            rows,
        ));
    }
}

/// The mean of ratios, if all are known.
fn geometric_mean(ratios: Vec<Option<f64>>) -> Option<f64> {
    let count = ratios.len() as f64;
    let logs: Option<f64> = ratios.into_iter().map(|ratio| ratio.map(f64::ln)).sum();
    logs.map(|logs| (logs / count).exp())
}

fn picking_blocks(picking: &Picking, blocks: &mut Vec<Block>) {
    blocks.push(heading(2, "2. Picking"));
    blocks.push(text(
        "One thread, the walk over the scene included. Vertical: between the picked point and the ground below or above it; \
         horizontal: between the picked point and what the ray meets on the full-resolution surface. Lost are rays that start \
         above the ground, end below the lowest of it without leaving the map, and yet meet nothing.",
    ));
    let rows = picking.rows.iter().map(|row| {
        let f = &row.figures;
        vec![
            row.name.clone(),
            number(row.rays.into()),
            number(row.hits.into()),
            f.lost.to_string(),
            figure(&f.rms_vertical),
            figure(&f.max_vertical),
            figure(&f.median_horizontal),
            figure(&f.p95_horizontal),
            number(row.times.ns_per_ray.round()),
        ]
    });
    blocks.push(table(
        &[
            "rays, surface",
            "rays",
            "hits",
            "lost",
            "RMS vertical",
            "max vertical",
            "median horizontal",
            "95 % horizontal",
            "ns per ray",
        ],
        rows.collect(),
    ));
    let vertical = picking.rows.iter().map(|row| ("the vertical distance", &row.figures.max_vertical));
    let horizontal = picking.rows.iter().map(|row| ("the horizontal distance", &row.figures.median_horizontal));
    blocks.extend(reasons(vertical.chain(horizontal)));
}

fn effects_blocks(effects: &EffectsCost, blocks: &mut Vec<Block>) {
    blocks.push(heading(2, "3. Effects"));
    blocks.push(text(format!(
        "The picture from the corner at τ = {} px with each effect by itself, on a device that has drawn nothing else. What a \
         scene does not call for is not in the shader, in the bindings or in memory. Effects that no shape of the scene can have are left \
         out.",
        effects.tolerance_px
    )));
    let rows = effects.rows.iter().map(|row| {
        vec![
            row.name.clone(),
            row.effects.join(", "),
            number(row.figures.shader_bytes as f64),
            number(row.figures.device_bytes as f64),
            number(row.figures.bytes_per_frame as f64),
            figure(&row.times.gpu_ms),
        ]
    });
    blocks.push(table(
        &["effect", "of the first draw", "bytes of shader", "bytes on the device", "bytes per frame", "GPU, ms"],
        rows.collect(),
    ));
    blocks.extend(reasons(effects.rows.iter().map(|row| ("GPU", &row.times.gpu_ms))));
}

fn precision_blocks(precision: &Precision, blocks: &mut Vec<Block>) {
    blocks.push(heading(2, "4. Precision"));
    blocks.push(text(
        "Scene and camera moved along x and y by an offset, seen from a step of the flight. Picture and exact picks against those at the origin; and how far \
         the picked points would be off with positions and matrices in f32, in the picture and in the world.",
    ));
    let rows = precision.rows.iter().map(|row| {
        let f = &row.figures;
        vec![
            number(row.offset),
            number(f.different_pixels as f64),
            f.max_difference.to_string(),
            number(f.lost_picks.into()),
            figure(&f.max_pick_error),
            figure(&f.f32_error_px),
            figure(&f.f32_pick_error),
        ]
    });
    blocks.push(table(
        &[
            "offset",
            "pixels that differ",
            "by at most, of 255",
            "picks lost",
            "max pick error",
            "f32: pixels off",
            "f32: picks off",
        ],
        rows.collect(),
    ));
    let missing = precision.rows.iter().flat_map(|row| {
        let f = &row.figures;
        [("the pick error", &f.max_pick_error), ("f32", &f.f32_error_px), ("f32", &f.f32_pick_error)]
    });
    blocks.extend(reasons(missing));
}

fn published_blocks(published: &Published, blocks: &mut Vec<Block>) {
    blocks.push(heading(2, "5. The published tables, done again"));
    blocks.push(text(
        "ρ = 1 and three resolutions from 16 on, as in the older node; the flight is once round the map. Separate drawing takes \
         a call for every part of every patch.",
    ));
    let rows = published.views.iter().chain(&published.flights).map(|row| {
        let f = &row.figures;
        vec![
            row.name.clone(),
            number(f.triangles.round()),
            number(f.facing_away.round()),
            number(f.draw_calls),
            number(f.parts_in_use),
            number(row.times.encoding_ms),
            figure(&row.times.gpu_ms),
            figure(&row.times.frame_ms),
        ]
    });
    blocks.push(table(
        &[
            "view",
            "triangles",
            "of them facing away",
            "draw calls",
            "parts in use",
            "encoding, ms",
            "GPU, ms",
            "frame, ms",
        ],
        rows.collect(),
    ));
    let of = |name: &str| published.views.iter().chain(&published.flights).find(|row| row.name == name);
    let ratio = |over: String, under: String, what: fn(&PublishedRow) -> Option<f64>| {
        let ratio = what(of(&over)?)? / what(of(&under)?)?;
        ratio.is_finite().then(|| number(ratio))
    };
    let frame: fn(&PublishedRow) -> Option<f64> = |row| row.times.frame_ms.value();
    let triangles: fn(&PublishedRow) -> Option<f64> = |row| Some(row.figures.triangles);
    let calls: fn(&PublishedRow) -> Option<f64> = |row| Some(row.figures.draw_calls);
    let mut rows = Vec::new();
    let mut add = |name: String, theirs: &str, ours: Option<String>| {
        rows.push(vec![name, theirs.to_owned(), ours.unwrap_or_else(|| "–".to_owned())]);
    };
    for (view, counts, culling, buffers) in [
        ("above", "1", "1.01", "1.09"),
        ("corner", "0.36 and 0.50", "1.92", "2.35"),
        ("middle", "0.24 and 0.38", "2.12", "1.90"),
    ] {
        let row = |way: &str| format!("{view}, {way}");
        let (on, off) = (|| row("culled, instanced"), || row("not culled, instanced"));
        add(format!("{view}: triangles culled / not (theirs: vertices)"), counts, ratio(on(), off(), triangles));
        let left = of(&on())
            .zip(of(&off()))
            .map(|(on, off)| number((on.figures.triangles - on.figures.facing_away) / off.figures.triangles));
        add(format!("{view}: triangles culled by view and by facing / not"), counts, left);
        add(format!("{view}: frame not culled / culled"), culling, ratio(off(), on(), frame));
        let separate = row("culled, separate");
        add(
            format!("{view}: frame separate / instanced (theirs: direct / buffered)"),
            buffers,
            ratio(separate, on(), frame),
        );
    }
    for (precision, theirs_calls, theirs_frame) in [("4", "40.0", "1.36"), ("1", "5.8", "1.04")] {
        let row = |way: &str| format!("flight, ρ = {precision}, culled, {way}");
        let (one, many) = (|| row("instanced"), || row("separate"));
        add(
            format!("flight, ρ = {precision}: draw calls separate / instanced"),
            theirs_calls,
            ratio(many(), one(), calls),
        );
        add(format!("flight, ρ = {precision}: frame separate / instanced"), theirs_frame, ratio(many(), one(), frame));
    }
    blocks.push(table(&["ratio", "published", "here"], rows));
    blocks.push(text(
        "Directions to expect: from above nothing is out of view, so culling changes nothing; from the corner and from the \
         middle it leaves out what lies beside and behind, by how much depends on the angle of view and on where the eye stands. \
         Culling by view leaves out patches, before they are sent; culling by facing leaves out triangles, on the device, and is \
         always on: from above hardly any faces away, from low eyes those behind each ridge. A frame gains less than the counts where filling \
         pixels dominates, as on a software adapter, and more where vertices do. Their direct drawing sent all vertices in every \
         frame, their classic drawing made one call per patch; ours separate makes one call per part, without sending anything, \
         so it costs calls alone. Instanced drawing takes as many calls as there are parts in use.",
    ));
    let frames = published.views.iter().chain(&published.flights);
    blocks.extend(reasons(frames.map(|row| ("GPU", &row.times.gpu_ms))));
}

fn cracks_blocks(cracks: &Cracks, blocks: &mut Vec<Block>) {
    blocks.push(heading(2, "6. Cracks"));
    blocks.push(text(format!(
        "Both patches at a border must have the same vertices on it. Each rule with {} eyes over the map, ours by the error in \
         pixels with those of the flight; a crack is a step along a side that only one of its patches takes.",
        cracks.eyes,
    )));
    let rows = cracks.rules.iter().map(|row| {
        vec![
            row.name.clone(),
            number(row.sides as f64),
            number(row.figures.cracked_eyes as f64),
            number(row.figures.cracks as f64),
        ]
    });
    blocks.push(table(&["rule", "sides", "eyes with cracks", "cracks"], rows.collect()));
}
