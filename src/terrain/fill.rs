//! Smooth filling of voids at load.
//!
//! Pull and push: a pyramid of means of the valid samples is made (pull) until a level without voids is reached; then
//! each level's voids start from the level above and are relaxed towards the solution of Laplace's equation with the
//! valid samples as boundary (push). Means of neighbours never leave the range of what they average, so a filled void
//! has no peak of its own. Time and memory are linear in the number of samples.
//!
//! The scheme is that of Gortler et al., "The Lumigraph" (SIGGRAPH 1996), section 3.5, with relaxation in place of the
//! final filter.

use super::height_field::{BitGrid, Samples};

/// Relaxation sweeps per level. Each halves roughly the error of the shortest waves; longer ones were settled on the
/// levels above, so a handful is enough (after 8 the largest step that a further sweep makes on the Fuji map is under a
/// metre).
const SWEEPS: usize = 8;

struct Level {
    columns: usize,
    rows: usize,
    values: Vec<f64>,
    /// Whether the value was known before filling.
    valid: Vec<bool>,
}

impl Level {
    /// The level of half the size: means of the valid samples in each 2 × 2 block.
    fn pull(&self) -> Level {
        let (columns, rows) = (self.columns.div_ceil(2), self.rows.div_ceil(2));
        let mut level = Level { columns, rows, values: vec![0.0; columns * rows], valid: vec![false; columns * rows] };
        for r in 0..rows {
            for c in 0..columns {
                let (mut sum, mut count) = (0.0, 0.0);
                for (dc, dr) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let (cc, rr) = (2 * c + dc, 2 * r + dr);
                    if cc < self.columns && rr < self.rows && self.valid[rr * self.columns + cc] {
                        sum += self.values[rr * self.columns + cc];
                        count += 1.0;
                    }
                }
                if count > 0.0 {
                    level.values[r * columns + c] = sum / count;
                    level.valid[r * columns + c] = true;
                }
            }
        }
        level
    }

    /// Fills the voids: first from the level above, then by relaxation.
    fn push(&mut self, above: &Level) {
        let mut voids = Vec::new();
        for r in 0..self.rows {
            for c in 0..self.columns {
                let i = r * self.columns + c;
                if !self.valid[i] {
                    self.values[i] = above.values[(r / 2) * above.columns + c / 2];
                    voids.push((c, r));
                }
            }
        }
        for _ in 0..SWEEPS {
            for &(c, r) in &voids {
                let i = r * self.columns + c;
                let (mut sum, mut count) = (0.0, 0.0);
                let mut add = |j: usize| {
                    sum += self.values[j];
                    count += 1.0;
                };
                if c > 0 {
                    add(i - 1);
                }
                if c + 1 < self.columns {
                    add(i + 1);
                }
                if r > 0 {
                    add(i - self.columns);
                }
                if r + 1 < self.rows {
                    add(i + self.columns);
                }
                if count > 0.0 {
                    self.values[i] = sum / count;
                }
            }
        }
    }
}

/// Replaces the samples marked in `voids`. A map without any valid sample becomes flat at 0.
pub(super) fn fill(columns: u32, rows: u32, samples: &mut Samples, voids: &BitGrid) {
    let (columns, rows) = (columns as usize, rows as usize);
    let valid: Vec<bool> =
        (0..columns * rows).map(|i| !voids.get((i % columns) as u32, (i / columns) as u32)).collect();
    let values = valid
        .iter()
        .enumerate()
        .map(|(i, &valid)| match (valid, &*samples) {
            (false, _) => 0.0,
            (true, Samples::U16(s)) => f64::from(s[i]),
            (true, Samples::F32(s)) => f64::from(s[i]),
        })
        .collect();

    let mut levels = vec![Level { columns, rows, values, valid }];
    while let Some(last) = levels.last()
        && last.columns * last.rows > 1
        && last.valid.contains(&false)
    {
        let next = last.pull();
        levels.push(next);
    }
    // The top is either complete or one value (0 when nothing at all is known).
    for k in (0..levels.len().saturating_sub(1)).rev() {
        let (below, above) = levels.split_at_mut(k + 1);
        if let (Some(level), Some(above)) = (below.last_mut(), above.first()) {
            level.push(above);
        }
    }

    let Some(base) = levels.first() else { return };
    for (i, (&value, &valid)) in base.values.iter().zip(&base.valid).enumerate() {
        if !valid {
            match samples {
                Samples::U16(s) => s[i] = value.round() as u16,
                Samples::F32(s) => s[i] = value as f32,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::terrain::{HeightField, Voids};

    #[test]
    fn a_hole_in_a_plane_is_filled_within_the_range_of_its_border() {
        let (n, hole) = (64u32, 20..44u32);
        let samples = (0..n * n)
            .map(|i| {
                let (c, r) = (i % n, i / n);
                if hole.contains(&c) && hole.contains(&r) { 0 } else { 1000 + (10 * c + 3 * r) as u16 }
            })
            .collect();
        let field = HeightField::from_u16(n, n, samples, Voids { sample: Some(0.0) }).unwrap();
        assert_eq!(field.void_count(), 24 * 24);
        for r in hole.clone() {
            for c in hole.clone() {
                let plane = 1000.0 + f64::from(10 * c + 3 * r);
                // The border of the hole spans 300 raw units; the exact solution is the plane itself.
                assert!((field.raw(c, r) - plane).abs() < 20.0, "({c}, {r}): {} for {plane}", field.raw(c, r));
            }
        }
    }

    #[test]
    fn a_map_of_voids_alone_is_flat() {
        let field = HeightField::from_f32(5, 3, vec![f32::NAN; 15], Voids::default()).unwrap();
        assert!((0..15).all(|i| field.raw(i % 5, i / 5) == 0.0));
        assert_eq!(field.void_count(), 15);
    }
}
