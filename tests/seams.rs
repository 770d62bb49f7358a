//! The mesh has no T-junctions and tiles the map, for any eye, precision, set of resolutions and size of map.
#![allow(missing_docs, reason = "a test")]

mod common;

use std::collections::HashMap;

use common::{cracks, doubled_area};
use proptest::prelude::*;
use seamount::terrain::{
    ActivePatch, Demand, Hierarchy, LodEye, Metric, Parts, PatchId, Precision, Resolutions, Selection, parts_of,
};

const SIZES: [[u32; 2]; 12] = [
    [1, 1],
    [2, 4],
    [7, 3],
    [1, 300],
    [31, 32],
    [64, 64],
    [65, 63],
    [127, 128],
    [256, 100],
    [343, 402],
    [511, 512],
    [700, 511],
];

fn resolutions() -> impl Strategy<Value = Resolutions> {
    (2u32..=5, 1u32..=4).prop_map(|(count, exponent)| {
        // Small resolutions make many patches, which is where patches can disagree.
        Resolutions::new((1 << exponent).min(512 >> (count - 1)), count).unwrap()
    })
}

/// An eye in units of the map's size: anywhere, or on a line of the finest patches, or on a lattice point.
fn eye(cells: [u32; 2]) -> impl Strategy<Value = LodEye> {
    let [cu, cv] = cells.map(f64::from);
    let place = (-0.5f64..1.5, -0.5f64..1.5, 0u8..4).prop_map(move |(a, b, kind)| {
        let (u, v) = (a * cu, b * cv);
        match kind {
            0 => (u, v),
            1 => (u.round(), v.round()),
            2 => ((u / 8.0).round() * 8.0, (v / 8.0).round() * 8.0),
            _ => ((u / 16.0).round() * 16.0, v),
        }
    });
    let height = prop_oneof![Just(0.0), -50.0f64..50.0, 0.0f64..2000.0, Just(1e9), 0.0f64..1e-3];
    let point = (place, height).prop_map(|((u, v), height)| LodEye::Point { u, v, height });
    let everywhere = (0.0f64..5000.0).prop_map(|distance| LodEye::Everywhere { distance });
    prop_oneof![9 => point, 1 => everywhere]
}

fn scene() -> impl Strategy<Value = (Hierarchy, Precision)> {
    (0..SIZES.len(), resolutions()).prop_flat_map(|(size, resolutions)| {
        let cells = SIZES[size];
        // Some precisions are powers of two, where ε meets the resolutions exactly.
        let precision = prop_oneof![1.0f64..16.0, (0i32..=4).prop_map(|k| f64::from(1 << k))];
        (eye(cells), precision)
            .prop_map(move |(eye, precision)| (Hierarchy::new(cells, resolutions), Precision { precision, eye }))
    })
}

/// Twice the signed areas of all triangles of a patch, clamped to the map.
fn triangle_area(tree: &Hierarchy, parts: &Parts, patch: ActivePatch) -> i64 {
    let cells = tree.cells().map(i64::from);
    let origin = tree.origin(patch.id).map(i64::from);
    let step = i64::from(tree.step(patch.id.level));
    let mut sum = 0;
    for part in parts_of(patch.sides) {
        for triangle in parts.triangles(part) {
            let [a, b, c] = triangle.map(|p| [0, 1].map(|k| (origin[k] + step * i64::from(p[k])).min(cells[k])));
            let doubled = (b[1] - a[1]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[1] - a[1]);
            assert!(doubled >= 0, "a triangle of {patch:?} turned over");
            sum += doubled;
        }
    }
    sum
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12_000, ..ProptestConfig::default() })]

    #[test]
    fn both_sides_of_every_inner_side_list_the_same_vertices((tree, metric) in scene()) {
        let selection = Selection::of(&tree, &metric);
        let found = cracks(&tree, &selection);
        prop_assert!(found.is_empty(), "{} cracks, first: {}", found.len(), found[0]);
        let [cu, cv] = tree.cells().map(u64::from);
        prop_assert_eq!(doubled_area(&tree, &selection), 2 * cu * cv);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    /// No triangle turns over and the areas of a patch's triangles sum to the patch's: they tile it without overlap.
    #[test]
    fn triangles_tile_the_map((tree, metric) in scene()) {
        let parts = Parts::new(tree.resolutions());
        let selection = Selection::of(&tree, &metric);
        for patch in selection.patches(&tree) {
            let [[u0, v0], [u1, v1]] = tree.extent(patch.id).map(|p| p.map(i64::from));
            prop_assert_eq!(triangle_area(&tree, &parts, patch), 2 * (u1 - u0) * (v1 - v0));
        }
    }

    /// What the metric demands of an active patch is met or exceeded, and every inner node was split for a reason.
    #[test]
    fn demands_are_met((tree, metric) in scene()) {
        let selection = Selection::of(&tree, &metric);
        for patch in selection.patches(&tree) {
            match metric.demand(&tree, patch.id) {
                Demand::Split => prop_assert_eq!(patch.id.level, tree.depth()),
                Demand::Keep(needs) => {
                    for (need, side) in needs.iter().zip(patch.sides) {
                        prop_assert!(side >= *need, "{patch:?} needs {needs:?}");
                    }
                }
            }
        }
    }
}

/// A metric with no rhyme or reason: demands by hash. Agreement has to be made whatever is asked.
struct Chaos(u64);

impl Metric for Chaos {
    fn demand(&self, tree: &Hierarchy, patch: PatchId) -> Demand {
        let mut rng = common::Rng(self.0 ^ tree.index(patch) as u64);
        if rng.below(3) == 0 {
            return Demand::Split;
        }
        let n = tree.resolutions().count();
        Demand::Keep([0; 4].map(|_: u8| rng.below(n) as u8))
    }
}

#[test]
fn any_metric_is_made_to_agree() {
    for seed in 0..600u64 {
        let cells = SIZES[(seed % 12) as usize];
        let count = 2 + (seed / 12 % 4) as u32;
        let tree = Hierarchy::new(cells, Resolutions::new(2, count).unwrap());
        let selection = Selection::of(&tree, &Chaos(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15)));
        let found = cracks(&tree, &selection);
        assert!(found.is_empty(), "seed {seed}: {} cracks, first: {}", found.len(), found[0]);
    }
}

/// For ρ ≥ 1 the metric agrees by itself: the proof says that nothing has to be forced. Square maps of whole patches.
#[test]
fn precision_from_one_up_forces_nothing() {
    let mut rng = common::Rng(7);
    for count in 2..=5 {
        let resolutions = Resolutions::new(4, count).unwrap();
        let side = resolutions.max() * resolutions.branching();
        let tree = Hierarchy::new([side; 2], resolutions);
        for _ in 0..300 {
            let s = f64::from(side);
            let eye = LodEye::Point {
                u: rng.range(-s, 2.0 * s),
                v: rng.range(-s, 2.0 * s),
                height: rng.range(0.0, s) * rng.unit(),
            };
            let metric = Precision { precision: rng.range(1.0, 8.0), eye };
            assert_eq!(Selection::of(&tree, &metric).forced(), 0, "{metric:?}");
        }
    }
}

/// The harness sees cracks: the older published rule (nearest resolution, distance to the nearer end of the side) has
/// them.
#[test]
fn the_older_rule_is_seen_to_crack() {
    struct Older(f64, [f64; 3]);
    impl Metric for Older {
        fn demand(&self, tree: &Hierarchy, patch: PatchId) -> Demand {
            let size = f64::from(tree.size(patch.level));
            let [u, v] = tree.origin(patch).map(f64::from);
            let corners = [[u, v], [u + size, v], [u + size, v + size], [u, v + size]];
            let mut needs = [0; 4];
            for k in 0..4 {
                let distance =
                    |p: [f64; 2]| ((p[0] - self.1[0]).powi(2) + (p[1] - self.1[1]).powi(2) + self.1[2].powi(2)).sqrt();
                let d = distance(corners[k]).min(distance(corners[(k + 1) % 4]));
                let epsilon = self.0 * size / d;
                if epsilon > 1.0 {
                    return Demand::Split;
                }
                let max = f64::from(tree.resolutions().max());
                needs[k] = (0..tree.resolutions().count() as u8)
                    .min_by(|&a, &b| {
                        let off = |i| (f64::from(tree.resolutions().get(i)) - epsilon * max).abs();
                        off(a).total_cmp(&off(b))
                    })
                    .unwrap();
            }
            Demand::Keep(needs)
        }
    }
    /// Without the mechanism that makes patches agree: every patch as its own metric wants it.
    fn unforced(tree: &Hierarchy, metric: &impl Metric) -> usize {
        let mut vertices: HashMap<([u32; 2], [u32; 2]), i32> = HashMap::new();
        let mut pending: Vec<PatchId> = tree.roots().collect();
        while let Some(id) = pending.pop() {
            match metric.demand(tree, id) {
                Demand::Split if id.level < tree.depth() => pending.extend(tree.children(id)),
                demand => {
                    let top = (tree.resolutions().count() - 1) as u8;
                    let sides = if let Demand::Keep(sides) = demand { sides } else { [top; 4] };
                    for side in seamount::terrain::Side::ALL {
                        let patch = ActivePatch { id, sides };
                        let list: Vec<_> = seamount::terrain::side_vertices(tree, patch, side).collect();
                        for pair in list.windows(2) {
                            *vertices.entry((pair[0], pair[1])).or_default() += 1;
                        }
                    }
                }
            }
        }
        let last = tree.cells();
        vertices
            .iter()
            .filter(|((a, b), count)| **count != 2 && !(0..2).any(|k| a[k] == b[k] && (a[k] == 0 || a[k] == last[k])))
            .count()
    }
    let tree = Hierarchy::new([1024; 2], Resolutions::new(4, 3).unwrap());
    let mut rng = common::Rng(11);
    let (mut cracked, mut ours) = (0, 0);
    for _ in 0..100 {
        let eye = [rng.range(0.0, 1024.0), rng.range(0.0, 1024.0), rng.range(0.0, 300.0)];
        cracked += usize::from(unforced(&tree, &Older(1.0, eye)) > 0);
        let metric = Precision { precision: 1.0, eye: LodEye::Point { u: eye[0], v: eye[1], height: eye[2] } };
        ours += usize::from(unforced(&tree, &metric) > 0);
    }
    assert!(cracked > 20, "only {cracked} of 100 eyes cracked");
    assert_eq!(ours, 0);
}
