//! Who sees whom: how high the ground is under some places around Mount Fuji, and what stands between them.
//!
//! ```text
//! cargo run --release --example line_of_sight [FOLDER]
//! ```
//!
//! Writes a table of what is seen from the summit into the folder (`target` if none is given).

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use seamount::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).map_or_else(|| PathBuf::from("target"), PathBuf::from);
    let scene = seamount::format::read_scene(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/fuji.ron"))?;
    // Everything that many questions have in common is found once.
    let exact = RayPickAction { surface: Surface::Exact, ..RayPickAction::pixel(0, 0, [1280, 720]) };
    let picker = exact.picker(&scene)?;
    let bounds = BoundingBoxAction::default().apply(&scene)?.ok_or("the scene is empty")?;

    // Eyes two metres above the ground, on a grid.
    let eyes = (0..12 * 12).map(|k| {
        let at = |k: i32, low: f64, high: f64| low + (high - low) * (f64::from(k) + 0.5) / 12.0;
        (at(k % 12, bounds.min.x, bounds.max.x), at(k / 12, bounds.min.y, bounds.max.y))
    });
    let mut places = Vec::new();
    for (x, y) in eyes {
        if let Some(ground) = picker.height_at(x, y)? {
            places.push((ground.picked.point + DVec3::Z * 2.0, ground.gradient.length()));
        }
    }
    let summit = places.iter().map(|&(p, _)| p).max_by(|a, b| a.z.total_cmp(&b.z)).ok_or("there is no ground")?;

    let mut table = String::from("x y height slope seen\n");
    let mut seen = 0;
    for &(eye, slope) in &places {
        let obstacle = picker.line_of_sight(summit, eye)?;
        seen += usize::from(obstacle.is_none());
        let verdict = obstacle.map_or_else(|| "yes".to_owned(), |o| format!("no, {:.0} m away", o.distance));
        writeln!(table, "{:.0} {:.0} {:.0} {slope:.2} {verdict}", eye.x, eye.y, eye.z)?;
    }
    let path = folder.join("line_of_sight.txt");
    seamount::output::write_file(&path, |file| std::io::Write::write_all(file, table.as_bytes()))?;
    println!("{seen} of {} places are seen from {:.0} m: {}", places.len(), summit.z, path.display());
    Ok(())
}
