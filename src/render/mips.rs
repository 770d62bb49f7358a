//! Smaller copies of textures, made on the CPU.

use half::f16;
use rayon::prelude::*;

use crate::action::linear_from_srgb;

/// One level of a texture.
#[derive(Debug)]
pub(super) struct Level<T> {
    pub width: u32,
    pub height: u32,
    pub texels: Vec<T>,
}

/// Number of levels of a full chain.
pub(super) fn full_chain(width: u32, height: u32) -> u32 {
    width.max(height).max(1).ilog2() + 1
}

/// Texels of a row that one texel of a row half as long covers, with their shares of it. An odd number of texels does not
/// halve evenly: then it covers a whole one and parts of its neighbours, so that the smaller copy stays in place.
fn taps(from: u32, to: u32, index: u32) -> [(u32, f32); 3] {
    if from == to {
        return [(index, 1.0), (0, 0.0), (0, 0.0)];
    }
    let first = index * 2;
    if from.is_multiple_of(2) {
        return [(first, 0.5), (first + 1, 0.5), (0, 0.0)];
    }
    let (n, i) = (to as f32, index as f32);
    let whole = 2.0 * n + 1.0;
    [(first, (n - i) / whole), (first + 1, n / whole), (first + 2, (i + 1.0) / whole)]
}

impl<T: Copy + Send + Sync> Level<T> {
    /// The next smaller level: each texel the mean of what it covers.
    pub(super) fn half<const N: usize>(
        &self,
        decode: impl Fn(T) -> [f32; N] + Sync,
        encode: impl Fn([f32; N]) -> T + Sync,
    ) -> Self {
        let (width, height) = ((self.width / 2).max(1), (self.height / 2).max(1));
        let Some(&any) = self.texels.first() else {
            return Self { width, height, texels: Vec::new() };
        };
        let mut texels = vec![any; width as usize * height as usize];
        texels.par_chunks_mut(width as usize).zip(0..height).for_each(|(row, y)| {
            let rows = taps(self.height, height, y);
            for (texel, x) in row.iter_mut().zip(0..width) {
                let columns = taps(self.width, width, x);
                let mut sum = [0.0; N];
                for (r, row_share) in rows.iter().filter(|(_, share)| *share > 0.0) {
                    for (c, share) in columns.iter().filter(|(_, share)| *share > 0.0) {
                        if let Some(&texel) = self.texels.get(*r as usize * self.width as usize + *c as usize) {
                            for (sum, value) in sum.iter_mut().zip(decode(texel)) {
                                *sum += share * row_share * value;
                            }
                        }
                    }
                }
                *texel = encode(sum);
            }
        });
        Self { width, height, texels }
    }
}

/// Halves gradients: the gradient of a mean is the mean of the gradients.
pub(super) fn half_gradients(level: &Level<[f16; 2]>) -> Level<[f16; 2]> {
    level.half(|t| t.map(f16::to_f32), |mean| mean.map(f16::from_f32))
}

/// Halves numbers.
pub(super) fn half_data(level: &Level<[u8; 4]>) -> Level<[u8; 4]> {
    level.half(|t| t.map(f32::from), |mean| mean.map(|c| (c + 0.5) as u8))
}

/// Halves colours in linear light, where means are means of light.
#[derive(Debug)]
pub(super) struct ColorHalver {
    decode: [f32; 256],
    /// For each of 4096 steps of linear light the nearest code is this one or the next.
    encode: Vec<u8>,
}

impl ColorHalver {
    const STEPS: usize = 4096;

    pub(super) fn new() -> Self {
        let decode: [f32; 256] = std::array::from_fn(|code| linear_from_srgb(code as f32 / 255.0));
        let mut code = 0;
        let encode = (0..=Self::STEPS)
            .map(|step| {
                let linear = step as f32 / Self::STEPS as f32;
                while code < 255 && decode[code + 1] <= linear {
                    code += 1;
                }
                code as u8
            })
            .collect();
        Self { decode, encode }
    }

    fn encode(&self, linear: f32) -> u8 {
        let step = ((linear * Self::STEPS as f32) as usize).min(Self::STEPS);
        let mut code = self.encode.get(step).copied().unwrap_or(255);
        // The nearest code, measured in light.
        while code < 255 && self.light(code) + self.light(code + 1) <= 2.0 * linear {
            code += 1;
        }
        code
    }

    fn light(&self, code: u8) -> f32 {
        self.decode[usize::from(code)]
    }

    pub(super) fn half(&self, level: &Level<[u8; 4]>) -> Level<[u8; 4]> {
        level.half(
            |[r, g, b, a]| [self.light(r), self.light(g), self.light(b), f32::from(a) / 255.0],
            |[r, g, b, a]| [self.encode(r), self.encode(g), self.encode(b), (a * 255.0).round() as u8],
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn level(width: u32, height: u32, f: impl Fn(u32, u32) -> f32) -> Level<f32> {
        let texels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| f(x, y)).collect();
        Level { width, height, texels }
    }

    /// A ramp stays the same ramp at the smaller size, whether the size is even or odd: nothing moves by more than a
    /// twentieth of a texel, which is how far the middle of the texels covered may be from the middle of the area.
    #[test]
    fn a_smaller_copy_stays_in_place() {
        for (w, h) in [(8, 6), (9, 7), (601, 3), (2, 2), (3, 1), (5, 1201)] {
            for along_x in [true, false] {
                let half = level(w, h, |x, y| if along_x { x as f32 } else { y as f32 }).half(|t| [t], |[t]| t);
                assert_eq!((half.width, half.height), ((w / 2).max(1), (h / 2).max(1)));
                for y in 0..half.height {
                    for x in 0..half.width {
                        let (i, to, from) = if along_x { (x, half.width, w) } else { (y, half.height, h) };
                        let want = (i as f32 + 0.5) * from as f32 / to as f32 - 0.5;
                        let got = half.texels[(y * half.width + x) as usize];
                        assert!((got - want).abs() <= 0.0501, "{w}×{h} ({x}, {y}): {got}, not {want}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_mean_is_kept_down_to_one_texel() {
        let mut l = level(13, 7, |x, y| ((x * 31 + y * 17) % 23) as f32);
        let mean = l.texels.iter().sum::<f32>() / l.texels.len() as f32;
        let levels = full_chain(l.width, l.height);
        for _ in 1..levels {
            l = l.half(|t| [t], |[t]| t);
        }
        assert_eq!(l.texels.len(), 1);
        assert!((l.texels[0] - mean).abs() < 1e-3, "{} {mean}", l.texels[0]);
    }

    #[test]
    fn colours_keep_their_code_and_mix_as_light() {
        let halver = ColorHalver::new();
        for code in 0..=255 {
            assert_eq!(halver.encode(halver.light(code)), code);
        }
        let board = Level { width: 2, height: 1, texels: vec![[0, 0, 0, 255], [255, 255, 255, 255]] };
        // Half the light of white is code 188, not 128.
        assert_eq!(halver.half(&board).texels, vec![[188, 188, 188, 255]]);
    }
}
