//! Section 6: how often both sides of a border disagree, by our rule and by older ones.

use super::report::{CrackFigures, CrackRow, Cracks};
use super::{CostError, Plan, Run};
use crate::node::lattice_view;
use crate::terrain::published::{NearestPrecision, disagreements, unforced};
use crate::terrain::{ActivePatch, Detail, Hierarchy, LodEye, Precision, Resolutions, ResolutionsError, Selection};

/// Resolutions that are tried: the published ones and ours.
const RESOLUTIONS: [(u32, u32); 2] = [(16, 3), (8, 2)];

pub(super) const STEPS: usize = RESOLUTIONS.len();

pub(super) fn measure(run: &mut Run<'_>, plan: &Plan) -> Result<(), CostError> {
    run.report.cracks = Some(Cracks { eyes: plan.crack_eyes, rules: Vec::new() });
    for (min, count) in RESOLUTIONS {
        run.begin(&format!("cracks, {count} resolutions from {min}"));
        // Constants that are valid.
        let Ok(resolutions): Result<_, ResolutionsError> = Resolutions::new(min, count) else { continue };
        let rules = rules(run, plan.crack_eyes, resolutions)?;
        run.report.cracks.get_or_insert_default().rules.extend(rules);
        run.finished()?;
    }
    Ok(())
}

/// The k-th number of the van der Corput sequence of a base, in 0..1: three of them place eyes evenly (Halton 1960).
fn halton(k: u32, base: u32) -> f64 {
    let (mut value, mut scale, mut rest) = (0.0, 1.0, k + 1);
    while rest > 0 {
        scale /= f64::from(base);
        value += scale * f64::from(rest % base);
        rest /= base;
    }
    value
}

fn rules(run: &mut Run<'_>, eyes: u32, resolutions: Resolutions) -> Result<Vec<CrackRow>, CostError> {
    let cells = run.bench.main.placed.terrain.field().cells();
    let tree = Hierarchy::new(cells, resolutions);
    let [cu, cv] = cells.map(f64::from);
    let places: Vec<[f64; 3]> =
        (0..eyes).map(|k| [halton(k, 2) * cu, halton(k, 3) * cv, halton(k, 5) * 0.3 * cu.max(cv)]).collect();
    let older = |by_level: &'static [f64]| {
        let tree = &tree;
        move |eye: [f64; 3]| unforced(tree, &NearestPrecision { precision: 1.0, by_level, eye })
    };
    let published =
        |precision: f64| move |[u, v, height]: [f64; 3]| Precision { precision, eye: LodEye::Point { u, v, height } };
    let made = |precision: f64| {
        let tree = &tree;
        move |eye| {
            let selection = Selection::of(tree, &published(precision)(eye));
            selection.patches(tree).collect::<Vec<_>>()
        }
    };
    let mut found = vec![
        row("ours, ρ = 1", &tree, &places, made(1.0)),
        row("ours, ρ = 0.5", &tree, &places, made(0.5)),
        row("older: nearest resolution, end point, ρ = 1", &tree, &places, older(&[1.0])),
        row("older: the same, ρ by depth 1, 0.9, 0.75", &tree, &places, older(&[1.0, 0.9, 0.75])),
        row("ours without making agree, ρ = 0.5", &tree, &places, |eye| unforced(&tree, &published(0.5)(eye))),
    ];
    // The error in pixels needs cameras: those of the flight.
    let main = &run.bench.main;
    let (terrain, frame, model) = (&main.placed.terrain, main.placed.frame, main.model);
    let patches = terrain.tree(resolutions);
    let mut views = Vec::new();
    for k in 0..eyes {
        let eye = run.bench.main.flight(k, eyes);
        run.bench.look(&eye, 0);
        views.push(lattice_view(&run.bench.viewpoint()?, &model, &frame));
    }
    let terrain = &run.bench.main.placed.terrain;
    let chosen = |view| {
        let selection = patches.select(terrain, &Detail::PixelError { tolerance: 1.0, view });
        selection.patches(patches.hierarchy()).collect::<Vec<_>>()
    };
    found.insert(0, row("ours, τ = 1 px", patches.hierarchy(), &views, chosen));
    for row in &mut found {
        row.name = format!("{} ({} resolutions from {})", row.name, resolutions.count(), resolutions.min());
    }
    Ok(found)
}

fn row<E: Clone>(name: &str, tree: &Hierarchy, eyes: &[E], rule: impl Fn(E) -> Vec<ActivePatch>) -> CrackRow {
    let (mut sides, mut figures) = (0, CrackFigures { cracked_eyes: 0, cracks: 0 });
    for eye in eyes {
        let patches = rule(eye.clone());
        sides += 4 * patches.len() as u64;
        let cracks = disagreements(tree, patches) as u64;
        figures.cracks += cracks;
        figures.cracked_eyes += u64::from(cracks > 0);
    }
    CrackRow { name: name.to_owned(), sides, figures }
}
