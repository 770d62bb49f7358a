use std::collections::{HashMap, HashSet};

use seamount::prelude::*;

use super::{Outcome, Output, SceneArg, load};

/// Print the graph as an indented tree.
///
/// A line per place of a node: its name, its kind, in how many places it stands if in more than one, and the values of the
/// fields that differ from their defaults. What is below a shared node is printed at its first place.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    scene: SceneArg,
}

pub(super) fn run(args: &Args) -> Outcome {
    let scene = load(&args.scene.scene)?;
    let mut out = Output::new();
    let mut seen = HashSet::new();
    let mut numbers = HashMap::new();
    let mut pending = vec![(scene.root(), 0)];
    while let Some((key, depth)) = pending.pop() {
        let first = seen.insert(key);
        out.line(format_args!("{:indent$}{}", "", describe(&scene, key, first, &mut numbers), indent = 2 * depth))?;
        if first {
            pending.extend(scene.children(key).iter().rev().map(|&child| (child, depth + 1)));
        }
    }
    out.flush()
}

fn describe(scene: &Scene, key: NodeKey, first: bool, numbers: &mut HashMap<NodeKey, usize>) -> String {
    let Some(node) = scene.node(key) else { return String::new() };
    let info = node.info();
    let mut line = info.kind.to_owned();
    let places = scene.parents(key).len();
    match scene.name(key) {
        Some(name) => line.push_str(&format!(" {name:?}")),
        // Shared nodes without a name, which only code makes, get a number.
        None if places > 1 => {
            let next = numbers.len() + 1;
            line.push_str(&format!(" #{}", numbers.entry(key).or_insert(next)));
        }
        None => {}
    }
    if !first {
        line.push_str(" (again)");
        return line;
    }
    if places > 1 {
        line.push_str(&format!(" (in {places} places)"));
    }
    for field in info.fields {
        if let Some(value) = (field.write)(node) {
            line.push_str(&format!(" {}: {value}", field.name));
        }
    }
    line
}
