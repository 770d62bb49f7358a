//! What the error in pixels saves: triangles against a uniform grid and against the published metric, at the same measured
//! error. The tables of `docs/accuracy.md`.
//!
//! `cargo bench --bench accuracy --no-default-features` prints them as Markdown, `-- --eyes 5` from fewer eyes. Nothing in
//! them is a time: every run gives the same numbers.

#[path = "../tests/common/maps.rs"]
mod maps;

use std::sync::Arc;

use maps::{Map, generated, maps};
use seamount::terrain::{
    Demand, DrawnSurface, Full, Hierarchy, Instances, LatticeView, LodEye, Metric, PatchId, PatchTree, PixelError,
    Precision, Resolutions, Selection, screen_error,
};

/// The same lattice step everywhere.
struct Uniform {
    level: u8,
    resolution: u8,
}

impl Metric for Uniform {
    fn demand(&self, _: &Hierarchy, patch: PatchId) -> Demand {
        if patch.level < self.level { Demand::Split } else { Demand::Keep([self.resolution; 4]) }
    }
}

/// A mesh as seen from one eye.
#[derive(Debug, Clone, Copy, Default)]
struct Seen {
    /// After culling.
    triangles: f64,
    /// Largest measured error in pixels.
    error: f64,
}

struct Viewed<'m> {
    map: &'m Map,
    tree: &'m PatchTree,
    view: LatticeView,
}

impl Viewed<'_> {
    fn see(&self, metric: &impl Metric) -> Seen {
        let Self { map, tree, view } = self;
        let hierarchy = tree.hierarchy();
        let selection = Selection::of(hierarchy, metric);
        let visible = map.visible(hierarchy, &selection, view);
        let mut instances = Instances::default();
        instances.update(hierarchy, tree.parts(), &visible);
        let field = map.terrain.field();
        let drawn = DrawnSurface { field, tree: hierarchy, parts: tree.parts(), selection: &selection };
        let error = screen_error(&drawn, &visible, view).max;
        Seen { triangles: instances.triangles() as f64, error }
    }

    fn pixel_error(&self, tolerance: f64) -> Seen {
        let field = self.map.terrain.field();
        let (errors, pyramid) = (self.tree.tile_errors(field), self.map.terrain.pyramid());
        self.see(&PixelError { tolerance, view: &self.view, errors, pyramid })
    }

    /// The coarsest uniform grid that is as good.
    fn uniform(&self, error: f64) -> Seen {
        let hierarchy = self.tree.hierarchy();
        let mut best = Seen::default();
        for level in (0..=hierarchy.depth()).rev() {
            // At r_min a patch has the steps of its parent at r_max.
            for resolution in (1..hierarchy.resolutions().count() as u8).rev() {
                let seen = self.see(&Uniform { level, resolution });
                if seen.error > error {
                    return best;
                }
                best = seen;
            }
        }
        best
    }

    /// The published metric at the smallest precision that is as good, to a 64th of an octave.
    fn precision(&self, error: f64, eye: LodEye) -> Seen {
        let see = |octave: f64| self.see(&Precision { precision: octave.exp2(), eye });
        let (mut low, mut high) = (-4.0, 16.0);
        let mut best = see(high);
        while high - low > 1.0 / 64.0 {
            let middle = 0.5 * (low + high);
            let seen = see(middle);
            if seen.error <= error { (high, best) = (middle, seen) } else { low = middle }
        }
        best
    }
}

struct Bench {
    map: Map,
    tree: Arc<PatchTree>,
    eyes: u32,
}

impl Bench {
    fn new(map: Map, eyes: u32) -> Self {
        let (min, count) = map.node.resolutions;
        let tree = map.terrain.tree(Resolutions::new(min, count).expect("valid"));
        Self { map, tree, eyes }
    }

    fn view(&self, k: u32) -> Viewed<'_> {
        Viewed { map: &self.map, tree: &self.tree, view: self.map.flight(k, self.eyes) }
    }

    /// Triangles that an error takes with each way of choosing detail.
    fn compare(&self, tolerance: f64) {
        let mut sums = [0.0; 5];
        for k in 0..self.eyes {
            let here = self.view(k);
            let ours = here.pixel_error(tolerance);
            let uniform = here.uniform(ours.error);
            let precision = here.precision(ours.error, self.map.lod_eye(k, self.eyes));
            let full = here.see(&Full);
            let row = [ours.error, ours.triangles, uniform.triangles, precision.triangles, full.triangles];
            sums = std::array::from_fn(|i| sums[i] + row[i] / f64::from(self.eyes));
        }
        let [error, ours, uniform, precision, full] = sums;
        let times = |other: f64| format!("{other:.0} ({:.1} ×)", other / ours);
        println!(
            "| {} | {tolerance} | {error:.2} | {ours:.0} | {} | {} | {} |",
            self.map.name,
            times(uniform),
            times(precision),
            times(full)
        );
    }

    /// How close the measured error comes to the one that was asked for.
    fn closeness(&self) {
        let mut row = String::new();
        for tolerance in [0.5, 1.0, 2.0, 4.0, 8.0] {
            let (mut sum, mut largest, mut count) = (0.0, 0.0f64, 0.0f64);
            for k in 0..self.eyes {
                let seen = self.view(k).pixel_error(tolerance);
                assert!(seen.error <= tolerance, "{}: {seen:?} for τ = {tolerance}", self.map.name);
                // Eyes that see only the finest ground say nothing about waste.
                if seen.error > 0.0 {
                    sum += seen.error / tolerance;
                    largest = largest.max(seen.error / tolerance);
                    count += 1.0;
                }
            }
            row += &format!(" {:.2}, {largest:.2} |", sum / count.max(1.0));
        }
        println!("| {} |{row}", self.map.name);
    }
}

fn main() {
    let mut arguments = std::env::args().skip_while(|argument| argument != "--eyes");
    let eyes = arguments.nth(1).map_or(20, |n| n.parse().expect("--eyes takes a number")).max(2);
    let all: Vec<Bench> = maps().into_iter().chain([generated()]).map(|map| Bench::new(map, eyes)).collect();
    println!("| map | τ, px | measured error, px | triangles | uniform grid | published metric | every cell |");
    println!("|---|---|---|---|---|---|---|");
    for tolerance in [1.0, 4.0] {
        all.iter().for_each(|bench| bench.compare(tolerance));
    }
    println!("\n| map | τ = 0.5 | 1 | 2 | 4 | 8 |\n|---|---|---|---|---|---|");
    all.iter().for_each(Bench::closeness);
}
