//! The corners of the overlay of a few small triangles with the full-resolution surface, worked out once and evaluated at
//! many places: what the patches of one level have in common.
//!
//! The overlay (see [`super::errors`]) depends on the triangles' shape alone. Its corners are samples within a triangle, and
//! crossings of a triangle's edge with a grid line or a cell's diagonal: those lie between two neighbouring samples. So each
//! corner is a few offsets into the map and a few weights.

use std::collections::HashSet;

/// Overlay corners of some triangles, relative to a sample of a map of a certain width.
#[derive(Debug, Default)]
pub(super) struct Stencil {
    triangles: Vec<Triangle>,
    samples: Vec<Sample>,
    crossings: Vec<Crossing>,
}

/// Offsets of the corners, and where the triangle's samples end in the list.
#[derive(Debug)]
struct Triangle {
    corners: [u32; 3],
    end: usize,
}

/// A sample within a triangle that is no corner of it: its offset, and the weights of the second and third corner. They
/// are multiples of 1/area, and areas are powers of two: exact.
#[derive(Debug)]
struct Sample {
    at: u32,
    weights: [f32; 2],
}

/// A point at `s` between the samples `ends`, which the mesh joins by an edge, and at `t` between the samples `between`.
#[derive(Debug)]
struct Crossing {
    ends: [u32; 2],
    s: f64,
    between: [u32; 2],
    t: f64,
}

impl Stencil {
    /// For triangles given by their corners (column, row) from the reference sample, south and east of it, in a map of so
    /// many columns.
    pub(super) fn new(triangles: impl IntoIterator<Item = [[u32; 2]; 3]>, width: u32) -> Self {
        let mut stencil = Self::default();
        // Neighbours share edges.
        let mut edges = HashSet::new();
        let mut seen = HashSet::new();
        for corners in triangles {
            if seen.insert(corners) {
                stencil.add_samples(corners.map(|c| c.map(i64::from)), i64::from(width));
            }
            for (a, b) in [(0, 1), (1, 2), (0, 2)] {
                let (a, b) = (corners[a].min(corners[b]), corners[a].max(corners[b]));
                if edges.insert((a, b)) {
                    stencil.add_crossings(a.map(i64::from), b.map(i64::from), i64::from(width));
                }
            }
        }
        stencil
    }

    fn add_samples(&mut self, corners: [[i64; 2]; 3], width: i64) {
        let [p, q, r] = corners;
        let cross =
            |a: [i64; 2], b: [i64; 2], c: [i64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        let area = cross(p, q, r);
        if area == 0 {
            return;
        }
        let start = self.samples.len();
        let range = |axis: usize| {
            let all = corners.map(|c| c[axis]);
            all.into_iter().min().unwrap_or(0)..=all.into_iter().max().unwrap_or(0)
        };
        for v in range(1) {
            for u in range(0) {
                let x = [u, v];
                let parts = [cross(x, q, r), cross(p, x, r), cross(p, q, x)].map(|part| part * area.signum());
                if parts.iter().all(|&part| part >= 0) && !corners.contains(&x) {
                    let weights = [parts[1], parts[2]].map(|part| part as f32 / area.abs() as f32);
                    self.samples.push(Sample { at: (v * width + u) as u32, weights });
                }
            }
        }
        if self.samples.len() > start {
            let corners = corners.map(|[u, v]| (v * width + u) as u32);
            self.triangles.push(Triangle { corners, end: self.samples.len() });
        }
    }

    fn add_crossings(&mut self, a: [i64; 2], b: [i64; 2], width: i64) {
        let (du, dv) = (b[0] - a[0], b[1] - a[1]);
        // Along grid lines and cell diagonals there is nothing between samples.
        if du == 0 || dv == 0 || du == dv {
            return;
        }
        let offset = |u: i64, v: i64| (v * width + u) as u32;
        // Columns, rows and diagonals, and from a point on each the step to the next sample along it.
        for (steps, next) in [(du.abs(), [0, 1]), (dv.abs(), [1, 0]), ((du - dv).abs(), [1, 1])] {
            for k in 1..steps {
                let (u, v) = (a[0] + (k * du).div_euclid(steps), a[1] + (k * dv).div_euclid(steps));
                // How far along, in parts of `steps`: the same in both directions where both are needed.
                let along = (k * if next[0] == 1 { du } else { dv }).rem_euclid(steps);
                // At a sample: it is in the list of samples.
                if along == 0 {
                    continue;
                }
                self.crossings.push(Crossing {
                    ends: [offset(a[0], a[1]), offset(b[0], b[1])],
                    s: k as f64 / steps as f64,
                    between: [offset(u, v), offset(u + next[0], v + next[1])],
                    t: along as f64 / steps as f64,
                });
            }
        }
    }

    /// Largest distance of the triangles from the surface, with the reference at the first of `samples`.
    pub(super) fn worst<S: Copy + Into<f64>>(&self, samples: &[S]) -> f64 {
        let at = |offset: u32| -> f64 { samples[offset as usize].into() };
        let mut worst: f64 = 0.0;
        let mut start = 0;
        for triangle in &self.triangles {
            let [first, second, third] = triangle.corners.map(at);
            let (to_second, to_third) = (second - first, third - first);
            for &Sample { at: offset, weights: [b, c] } in &self.samples[start..triangle.end] {
                let drawn = first + f64::from(b) * to_second + f64::from(c) * to_third;
                worst = worst.max((at(offset) - drawn).abs());
            }
            start = triangle.end;
        }
        for &Crossing { ends, s, between, t } in &self.crossings {
            let [from, to] = ends.map(at);
            let [low, high] = between.map(at);
            worst = worst.max((low + t * (high - low) - from - s * (to - from)).abs());
        }
        worst
    }
}
