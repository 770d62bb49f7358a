//! Makes the colour map of Mount Fuji from its heights: forest, bare ground, rock, snow; steep ground is rock earlier.
//! `scenes/fuji_color.png` was made by it.
//!
//! ```text
//! cargo run --release --example color_map [FOLDER]
//! ```

use std::path::PathBuf;

use seamount::prelude::*;

/// Colours by height in metres, sRGB; between two of them they blend.
const TINTS: [(f64, [f64; 3]); 8] = [
    (0.0, [86.0, 122.0, 74.0]),
    (500.0, [72.0, 108.0, 62.0]),
    (1200.0, [64.0, 94.0, 54.0]),
    (1900.0, [98.0, 102.0, 62.0]),
    (2400.0, [126.0, 96.0, 78.0]),
    (2850.0, [118.0, 92.0, 82.0]),
    (3050.0, [226.0, 230.0, 236.0]),
    (4000.0, [250.0, 251.0, 253.0]),
];

const ROCK: [f64; 3] = [112.0, 98.0, 88.0];

fn mix(a: [f64; 3], b: [f64; 3], t: f64) -> [f64; 3] {
    std::array::from_fn(|k| a[k] + t * (b[k] - a[k]))
}

fn tint(metres: f64) -> [f64; 3] {
    let above = TINTS.iter().position(|(height, _)| *height > metres).unwrap_or(TINTS.len() - 1).max(1);
    let ((low, a), (high, b)) = (TINTS[above - 1], TINTS[above]);
    mix(a, b, ((metres - low) / (high - low)).clamp(0.0, 1.0))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).map_or_else(|| PathBuf::from("target"), PathBuf::from);
    let map = Image::open(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/fuji.png").as_ref())?;
    let field = map.height_field(Some(0.0))?;
    // Half the resolution of the heights is enough for colours: shading brings the detail.
    let size = 600;
    let picture = image::RgbImage::from_fn(size, size, |x, y| {
        let (c, r) = (2 * x + 1, 2 * y + 1);
        let metres = field.raw(c, r) - 1000.0;
        let [east, south] = field.gradient(c, r);
        let slope = (east / 75.5).hypot(south / 92.7);
        // Snow does not stay on walls, forest does not grow on them.
        let bare = ((slope - 0.55) / 0.5).clamp(0.0, 1.0);
        image::Rgb(mix(tint(metres), ROCK, bare).map(|c| c.round() as u8))
    });
    let path = folder.join("fuji_color.png");
    picture.save(&path)?;
    println!("{}", path.display());
    Ok(())
}
