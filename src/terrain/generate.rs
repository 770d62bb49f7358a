//! A procedural map for tests and benchmarks of any size: the same seed gives the same bits on every machine.
//!
//! Ridged multifractal noise (Musgrave, in Ebert et al., "Texturing and Modeling", 3rd edition, chapter 16): octaves of
//! gradient noise, each folded into ridges, squared and weighted by the octave before it, so that valleys stay smooth and
//! ridges get rough. Added is one low octave of plain noise for basins. The gradient noise is Perlin's with a quintic
//! blend; its lattice gradients come from a 64-bit integer hash (splitmix64), and only sums, products and comparisons of
//! f64 are used, which IEEE 754 fixes to the bit. Feature size is relative to the map: a map of twice the size shows the
//! same land with one more octave of detail.

use super::height_field::{HeightField, HeightFieldError, Voids};

fn hash(seed: u64, octave: u32, i: i64, j: i64) -> u64 {
    let mut x = seed
        .wrapping_add(u64::from(octave).wrapping_mul(0x9e37_79b9_7f4a_7c15))
        .wrapping_add((i as u64).wrapping_mul(0xbf58_476d_1ce4_e5b9))
        .wrapping_add((j as u64).wrapping_mul(0x94d0_49bb_1331_11eb));
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// One of eight gradients at a lattice point, dotted with the offset.
fn gradient(seed: u64, octave: u32, i: i64, j: i64, x: f64, y: f64) -> f64 {
    const DIAGONAL: f64 = std::f64::consts::FRAC_1_SQRT_2;
    match hash(seed, octave, i, j) >> 61 {
        0 => x,
        1 => -x,
        2 => y,
        3 => -y,
        4 => DIAGONAL * (x + y),
        5 => DIAGONAL * (x - y),
        6 => DIAGONAL * (y - x),
        _ => -DIAGONAL * (x + y),
    }
}

/// Gradient noise, within −1..1.
fn noise(seed: u64, octave: u32, x: f64, y: f64) -> f64 {
    let (fi, fj) = (x.floor(), y.floor());
    let (i, j) = (fi as i64, fj as i64);
    let (dx, dy) = (x - fi, y - fj);
    let blend = |t: f64| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let (bx, by) = (blend(dx), blend(dy));
    let n00 = gradient(seed, octave, i, j, dx, dy);
    let n10 = gradient(seed, octave, i + 1, j, dx - 1.0, dy);
    let n01 = gradient(seed, octave, i, j + 1, dx, dy - 1.0);
    let n11 = gradient(seed, octave, i + 1, j + 1, dx - 1.0, dy - 1.0);
    let (north, south) = (n00 + bx * (n10 - n00), n01 + bx * (n11 - n01));
    north + by * (south - north)
}

/// Ridges across the map at the lowest octave.
const FEATURES: f64 = 4.0;

/// Height at (x, y) in 0..1 of the map, about 0..1.
fn land(seed: u64, octaves: u32, x: f64, y: f64) -> f64 {
    let (mut px, mut py) = (x * FEATURES, y * FEATURES);
    let basin = 0.5 + 0.5 * noise(seed, 0, 0.5 * px, 0.5 * py);
    let (mut sum, mut amplitude, mut weight) = (0.0, 0.5, 1.0);
    for octave in 1..=octaves {
        let ridge = 1.0 - noise(seed, octave, px, py).abs();
        let signal = ridge * ridge * weight;
        sum += amplitude * signal;
        weight = (signal * 2.0).clamp(0.0, 1.0);
        amplitude *= 0.5;
        px *= 2.0;
        py *= 2.0;
    }
    basin * sum
}

/// A square map of `size` × `size` 16-bit samples, its values spread over 0..=65535.
///
/// # Errors
///
/// When `size` is below 2 or above [`HeightField::MAX_SIDE`].
///
/// # Example
///
/// ```
/// use seamount::terrain::generate;
///
/// let map = generate(33, 1)?;
/// assert_eq!((map.columns(), map.rows()), (33, 33));
/// assert_eq!(map.samples(), generate(33, 1)?.samples()); // the same seed, the same land
/// # Ok::<(), seamount::terrain::HeightFieldError>(())
/// ```
pub fn generate(size: u32, seed: u64) -> Result<HeightField, HeightFieldError> {
    use rayon::prelude::*;
    if size < 2 {
        return Err(HeightFieldError::TooSmall { columns: size, rows: size });
    }
    if size > HeightField::MAX_SIDE {
        return Err(HeightFieldError::TooLarge { columns: size, rows: size });
    }
    // Down to waves of two samples.
    let octaves = (1..24).find(|&k| FEATURES * f64::from(1u32 << k) >= f64::from(size)).unwrap_or(24);
    let scale = 1.0 / f64::from(size - 1);
    let n = size as usize;
    let mut heights = vec![0.0f32; n * n];
    heights.par_chunks_mut(n).enumerate().for_each(|(row, line)| {
        for (column, height) in line.iter_mut().enumerate() {
            *height = land(seed, octaves, column as f64 * scale, row as f64 * scale) as f32;
        }
    });
    let (low, high) =
        heights.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), &h| (low.min(h), high.max(h)));
    let factor = if high > low { 65535.0 / (high - low) } else { 0.0 };
    let samples = heights.par_iter().map(|&h| ((h - low) * factor).round() as u16).collect();
    HeightField::from_u16(size, size, samples, Voids::default())
}
