//! ꟻLIP, how different two pictures look when they are flipped between (Andersson, Nilsson, Akenine-Möller, Oskarsson,
//! Åström and Fairchild, "FLIP: A Difference Evaluator for Alternating Images", Proc. ACM Comput. Graph. Interact. Tech.
//! 3(2), 2020), for pictures of low dynamic range.
//!
//! Both pictures are filtered by what the eye resolves at this distance and compared in a colour space in which distances are
//! perceived ones; where edges or points appear or vanish the difference counts more. The numbers follow the authors' own
//! program to a few units of the fifth digit; it computes in f32, this in f64.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};
use rayon::prelude::*;

/// Pixels per degree of the authors' standard observer: a screen of 0.7 m and 3840 pixels width seen from 0.7 m.
pub const PIXELS_PER_DEGREE: f64 = 3840.0 * PI / 180.0;

/// Mean ꟻLIP of two pictures of sRGB pixels, four bytes each, row by row: 0 for the same, up to 1. `pixels_per_degree` says how
/// large a pixel is to the eye; see [`PIXELS_PER_DEGREE`].
///
/// `None` if a picture is not of this size.
///
/// # Example
///
/// ```
/// use seamount::cost::flip::{PIXELS_PER_DEGREE, flip};
///
/// let (black, white) = (vec![0; 4 * 64], vec![255; 4 * 64]);
/// assert_eq!(flip(&black, &black, [8, 8], PIXELS_PER_DEGREE), Some(0.0));
/// let most = flip(&black, &white, [8, 8], PIXELS_PER_DEGREE).expect("of one size");
/// assert!((most - 0.967).abs() < 0.01);
/// ```
#[must_use]
pub fn flip(reference: &[u8], test: &[u8], size: [u32; 2], pixels_per_degree: f64) -> Option<f64> {
    Reference::new(reference, size, pixels_per_degree)?.flip(test)
}

/// A picture that others are held against: [`flip`] with it for many, half the work of which is the same.
///
/// ```
/// use seamount::cost::flip::{PIXELS_PER_DEGREE, Reference};
///
/// let reference = Reference::new(&[0; 4 * 64], [8, 8], PIXELS_PER_DEGREE).expect("of this size");
/// assert_eq!(reference.flip(&[0; 4 * 64]), Some(0.0));
/// assert_eq!(reference.flip(&[0; 4 * 63]), None);
/// ```
#[derive(Debug, Clone)]
pub struct Reference {
    seen: Seen,
    size: [usize; 2],
    pixels_per_degree: f64,
}

impl Reference {
    /// A picture of sRGB pixels, four bytes each, row by row. `None` if it is not of this size.
    #[must_use]
    pub fn new(rgba: &[u8], size: [u32; 2], pixels_per_degree: f64) -> Option<Self> {
        let [width, height] = size.map(|n| n as usize);
        let bytes = width.checked_mul(height)?.checked_mul(4)?;
        (rgba.len() == bytes && bytes > 0).then(|| Self {
            seen: Seen::new(rgba, width, pixels_per_degree),
            size: [width, height],
            pixels_per_degree,
        })
    }

    /// Mean ꟻLIP of another picture against this one; `None` if it is not of the same size.
    #[must_use]
    pub fn flip(&self, test: &[u8]) -> Option<f64> {
        let [width, height] = self.size;
        if test.len() != 4 * width * height {
            return None;
        }
        let (reference, test) = (&self.seen, Seen::new(test, width, self.pixels_per_degree));
        let most = hyab(hunt_lab(DVec3::Y), hunt_lab(DVec3::Z)).powf(COLOR_EXPONENT);
        let row = |y: usize| -> f64 {
            (y * width..(y + 1) * width)
                .map(|i| {
                    let color = hyab(reference.colors[i], test.colors[i]).powf(COLOR_EXPONENT);
                    let color = redistributed(color, most);
                    let feature = |k: usize| (reference.features[k][i] - test.features[k][i]).abs();
                    let feature = (feature(0).max(feature(1)) / 2f64.sqrt()).sqrt();
                    color.powf(1.0 - feature)
                })
                .sum()
        };
        // Row sums in their order, so that the mean has the same bits however the rows were shared out.
        let rows: Vec<f64> = (0..height).into_par_iter().map(row).collect();
        Some(rows.iter().sum::<f64>() / (width * height) as f64)
    }
}

const COLOR_EXPONENT: f64 = 0.7;

/// Differences up to 0.4 of the largest fill 0..0.95 of the range.
fn redistributed(difference: f64, most: f64) -> f64 {
    let (knee, at_knee) = (0.4 * most, 0.95);
    if difference < knee {
        at_knee / knee * difference
    } else {
        at_knee + (difference - knee) / (most - knee) * (1.0 - at_knee)
    }
}

/// A picture as the eye sees it.
#[derive(Debug, Clone)]
struct Seen {
    /// Filtered colours in CIELAB, with the Hunt effect.
    colors: Vec<DVec3>,
    /// Strength of edges and of points.
    features: [Vec<f64>; 2],
}

impl Seen {
    fn new(rgba: &[u8], width: usize, pixels_per_degree: f64) -> Self {
        let linear: Vec<f64> = (0..=255).map(linear).collect();
        let linear = |byte: u8| linear[usize::from(byte)];
        let opponent: Vec<DVec3> = rgba
            .par_chunks_exact(4)
            .map(|p| opponent_from_linear(DVec3::new(linear(p[0]), linear(p[1]), linear(p[2]))))
            .collect();
        let plane = |channel: usize| -> Vec<f64> { opponent.par_iter().map(|p| p[channel]).collect() };
        let filtered: Vec<Vec<f64>> = (0..3)
            .map(|channel| {
                let plane = plane(channel);
                // The contrast sensitivity of the channel is a sum of Gaussians, each of them separable.
                let parts: Vec<(f64, Vec<f64>)> = SENSITIVITY[channel]
                    .iter()
                    .map(|&[a, b]| {
                        let kernel =
                            sampled(radius(pixels_per_degree), |x| (-(PI * x / pixels_per_degree).powi(2) / b).exp());
                        let sum: f64 = kernel.iter().sum();
                        (a * (PI / b).sqrt() * sum * sum, scaled(&kernel, 1.0 / sum))
                    })
                    .collect();
                let total: f64 = parts.iter().map(|(weight, _)| weight).sum();
                let mut out = vec![0.0; plane.len()];
                for (weight, kernel) in parts {
                    let blurred = convolved(&plane, width, &kernel, &kernel);
                    out.par_iter_mut().zip(blurred).for_each(|(o, b)| *o += weight / total * b);
                }
                out
            })
            .collect();
        let colors = (0..opponent.len())
            .into_par_iter()
            .map(|i| {
                let linear = linear_from_opponent(DVec3::new(filtered[0][i], filtered[1][i], filtered[2][i]));
                hunt_lab(linear.clamp(DVec3::ZERO, DVec3::ONE))
            })
            .collect();

        let gray: Vec<f64> = opponent.par_iter().map(|p| (p.x + 16.0) / 116.0).collect();
        let deviation = 0.5 * 0.082 * pixels_per_degree;
        let reach = (3.0 * deviation).ceil() as i32;
        let gauss = |x: f64| (-x * x / (2.0 * deviation * deviation)).exp();
        let smooth = sampled(reach, gauss);
        let smooth = scaled(&smooth, 1.0 / smooth.iter().sum::<f64>());
        let edge = balanced(sampled(reach, |x| -x * gauss(x)));
        let point = balanced(sampled(reach, |x| (x * x / (deviation * deviation) - 1.0) * gauss(x)));
        let features = [edge, point].map(|kernel| {
            let across = convolved(&gray, width, &kernel, &smooth);
            let down = convolved(&gray, width, &smooth, &kernel);
            across.par_iter().zip(&down).map(|(x, y)| x.hypot(*y)).collect()
        });
        Self { colors, features }
    }
}

/// Weights and widths of the Gaussians of the contrast sensitivity: achromatic, red–green, blue–yellow.
const SENSITIVITY: [&[[f64; 2]]; 3] = [&[[1.0, 0.0047]], &[[1.0, 0.0053]], &[[34.1, 0.04], [13.5, 0.025]]];

/// Three standard deviations of the widest of them, in pixels.
fn radius(pixels_per_degree: f64) -> i32 {
    (3.0 * (0.04 / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as i32
}

fn sampled(reach: i32, f: impl Fn(f64) -> f64) -> Vec<f64> {
    (-reach..=reach).map(|x| f(f64::from(x))).collect()
}

fn scaled(kernel: &[f64], by: f64) -> Vec<f64> {
    kernel.iter().map(|k| k * by).collect()
}

/// Positive weights sum to 1, negative ones to −1.
fn balanced(kernel: Vec<f64>) -> Vec<f64> {
    let positive: f64 = kernel.iter().filter(|k| **k > 0.0).sum();
    let negative: f64 = -kernel.iter().filter(|k| **k < 0.0).sum::<f64>();
    kernel.into_iter().map(|k| k / if k > 0.0 { positive } else { negative }).collect()
}

/// A separable convolution, the border's values going on beyond it.
fn convolved(plane: &[f64], width: usize, across: &[f64], down: &[f64]) -> Vec<f64> {
    let height = plane.len() / width;
    let at = |i: usize, k: usize, reach: usize, last: usize| (i + k).saturating_sub(reach).min(last);
    let mut rows = vec![0.0; plane.len()];
    rows.par_chunks_mut(width).zip(plane.par_chunks(width)).for_each(|(out, row)| {
        // Written out at both ends, so that the loop over it has no border.
        let reach = across.len() / 2;
        let row: Vec<f64> = (0..width + 2 * reach).map(|x| row[at(x, 0, reach, width - 1)]).collect();
        for (weight, row) in across.iter().zip(row.windows(width)) {
            for (out, value) in out.iter_mut().zip(row) {
                *out += weight * value;
            }
        }
    });
    let mut found = vec![0.0; plane.len()];
    found.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        for (k, weight) in down.iter().enumerate() {
            let from = at(y, k, down.len() / 2, height - 1) * width;
            for (out, value) in out.iter_mut().zip(&rows[from..from + width]) {
                *out += weight * value;
            }
        }
    });
    found
}

fn linear(byte: u8) -> f64 {
    let c = f64::from(byte) / 255.0;
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

/// CIE XYZ of linear sRGB, D65, with the primaries as exact fractions.
fn xyz_from_linear() -> DMat3 {
    let row = |a: f64, b: f64, c: f64, over: f64| DVec3::new(a, b, c) / over;
    DMat3::from_cols(
        row(10_135_552.0, 8_788_810.0, 4_435_075.0, 24_577_794.0),
        row(2_613_072.0, 8_788_810.0, 887_015.0, 12_288_897.0),
        row(1_425_312.0, 8_788_810.0, 70_074_185.0, 73_733_382.0),
    )
    .transpose()
}

fn white() -> DVec3 {
    xyz_from_linear() * DVec3::ONE
}

/// Linear sRGB to YCxCz, a linear opponent space.
fn opponent_from_linear(rgb: DVec3) -> DVec3 {
    let DVec3 { x, y, z } = xyz_from_linear() * rgb / white();
    DVec3::new(116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z))
}

fn linear_from_opponent(opponent: DVec3) -> DVec3 {
    let y = (opponent.x + 16.0) / 116.0;
    let xyz = DVec3::new(y + opponent.y / 500.0, y, y - opponent.z / 200.0) * white();
    xyz_from_linear().inverse() * xyz
}

/// CIELAB of a linear colour, chroma scaled by lightness (the Hunt effect).
fn hunt_lab(rgb: DVec3) -> DVec3 {
    let delta = 6.0 / 29.0f64;
    let f = |t: f64| if t > delta.powi(3) { t.cbrt() } else { t / (3.0 * delta * delta) + 4.0 / 29.0 };
    let DVec3 { x, y, z } = (xyz_from_linear() * rgb / white()).map(f);
    let lightness = 116.0 * y - 16.0;
    let chroma = 0.01 * lightness;
    DVec3::new(lightness, chroma * 500.0 * (x - y), chroma * 200.0 * (y - z))
}

/// The distance for large differences: lightness by itself, chroma as a length.
fn hyab(a: DVec3, b: DVec3) -> f64 {
    let d = a - b;
    d.x.abs() + d.y.hypot(d.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [96, 64];

    fn picture(color: impl Fn(u32, u32) -> [u32; 3]) -> Vec<u8> {
        let [w, h] = SIZE;
        (0..w * h).flat_map(|i| color(i % w, i / w).into_iter().chain([255])).map(|c| c as u8).collect()
    }

    /// What the authors' program (flip-evaluator 1.7) says of the same pictures. It sums in f32: its own mean and that of its
    /// own map differ by up to 6e-5.
    #[test]
    fn the_authors_program_says_the_same() {
        let [w, h] = SIZE;
        let checker = |x: u32, y: u32| [if (x / 8 + y / 8) % 2 == 1 { 200 } else { 60 }; 3];
        let ramp = picture(|x, y| [x * 255 / (w - 1), y * 255 / (h - 1), 128]);
        let shifted = picture(|x, y| [(x + 1) * 255 / w, y * 255 / (h - 1), 120]);
        let noise = picture(|x, y| {
            let bits = (y * w + x).wrapping_mul(2_654_435_761);
            [bits >> 8 & 255, bits >> 16 & 255, bits >> 24]
        });
        let [checker, moved] = [0, 1].map(|by| picture(|x, y| checker(x + by, y)));
        let [black, white, green, blue] =
            [[0; 3], [255; 3], [0, 255, 0], [0, 0, 255]].map(|color| picture(|_, _| color));
        for (a, b, expected) in [
            (&ramp, &shifted, 0.115_699),
            (&checker, &moved, 0.223_161),
            (&ramp, &noise, 0.798_371),
            (&ramp, &checker, 0.865_428),
            (&black, &white, 0.967_388),
            (&green, &blue, 1.0),
            (&noise, &noise, 0.0),
        ] {
            let found = flip(a, b, SIZE, PIXELS_PER_DEGREE).unwrap();
            assert!((found - expected).abs() < 2e-5, "{found} instead of {expected}");
        }
    }

    #[test]
    fn pictures_of_another_size_are_refused() {
        assert_eq!(flip(&[0; 16], &[0; 16], [3, 1], PIXELS_PER_DEGREE), None);
        assert_eq!(flip(&[], &[], [0, 5], PIXELS_PER_DEGREE), None);
    }
}
