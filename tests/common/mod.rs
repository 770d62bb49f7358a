//! Helpers that several tests share.
#![allow(dead_code, missing_docs, unreachable_pub, reason = "each test uses its own part of this module")]

#[cfg(feature = "render")]
pub mod gpu;

use std::collections::HashMap;

use seamount::terrain::{ActivePatch, Hierarchy, Selection, Side, side_vertices};

/// Pieces of sides on which two active patches disagree, found without the code that makes them agree.
///
/// The side of each active patch is cut into its elementary edges. An edge inside the map is fine if exactly one other
/// patch has the same edge on its opposite side; on the border of the map it stands alone.
pub fn cracks(tree: &Hierarchy, selection: &Selection) -> Vec<String> {
    type Edge = ([u32; 2], [u32; 2]);
    let mut edges: HashMap<Edge, Vec<(ActivePatch, Side)>> = HashMap::new();
    for patch in selection.patches(tree) {
        for side in Side::ALL {
            let vertices: Vec<[u32; 2]> = side_vertices(tree, patch, side).collect();
            for pair in vertices.windows(2) {
                // Clamped to the border, an edge may shrink to a point.
                if pair[0] != pair[1] {
                    edges.entry((pair[0], pair[1])).or_default().push((patch, side));
                }
            }
        }
    }
    let cells = tree.cells();
    let mut found = Vec::new();
    for ((a, b), owners) in edges {
        let on_border = (0..2).any(|k| a[k] == b[k] && (a[k] == 0 || a[k] == cells[k]));
        let good = match owners.as_slice() {
            [_] => on_border,
            [(_, s), (_, t)] => *t == s.opposite(),
            // Patches that a clamp has flattened onto the border add edges there.
            _ => on_border,
        };
        if !good {
            found.push(format!("edge {a:?}..{b:?}: {owners:?}"));
        }
    }
    found
}

/// Twice the area that the active patches cover, in cells.
pub fn doubled_area(tree: &Hierarchy, selection: &Selection) -> u64 {
    selection
        .patches(tree)
        .map(|patch| {
            let [[u0, v0], [u1, v1]] = tree.extent(patch.id);
            2 * u64::from(u1 - u0) * u64::from(v1 - v0)
        })
        .sum()
}

/// A small generator for tests that need many numbers: splitmix64.
#[derive(Debug, Clone)]
pub struct Rng(pub u64);

impl Rng {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    pub fn below(&mut self, n: u32) -> u32 {
        (self.bits() % u64::from(n)) as u32
    }

    /// Where the middle of a camera's picture is: one camera of four looks beside it, up to so far that what lies straight
    /// ahead is not in the picture.
    pub fn aside(&mut self) -> glam::DVec2 {
        let aside = glam::DVec2::new(self.range(-3.0, 3.0), self.range(-2.0, 2.0));
        if self.below(4) == 0 { aside } else { glam::DVec2::ZERO }
    }
}
