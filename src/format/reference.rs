//! The description of all kinds of node, from the same table that reads and writes them.

use super::{MAX_NESTING, VERSION};
use crate::node::{NodeInfo, Registry};

/// The language of scene files and every kind of node in a registry, as a page of Markdown.
///
/// `docs/scene-format.md` is this page for the nodes of this crate.
///
/// # Example
///
/// ```
/// use seamount::format::describe;
/// use seamount::node::Registry;
///
/// let page = describe(&Registry::default());
/// assert!(page.contains("### Cube"));
/// ```
#[must_use]
pub fn describe(registry: &Registry) -> String {
    let mut page = format!(
        "\
# Scene files

This page is written by `seamount nodes --markdown`; a test compares the two.

A scene file is text in [RON](https://github.com/ron-rs/ron), in UTF-8.

```text
file  = Scene(version: {VERSION}, root: node)
node  = Kind(field: value, …, children: [node, …])      // Kind alone is Kind()
      | Def(\"name\", Kind(…))                            // a node with a name
      | Use(\"name\")                                     // the same node once more, after its Def
```

- **Fields** that are left out have their defaults. Lengths are in the units of the scene, angles in radians, colours are sRGB from 0
  to 1. A number may not be NaN or infinite. `Some` may be left out.
- **Children** stand in the list that the kind names: `children` for groups, other names where only some kinds can stand.
- **Sharing**: `Use` means the very node that has the name, not a copy: what changes in one place changes in all. A name is given
  once, before it is used, and a node can not contain itself.
- **Files**: a File shows another scene file in place. Names of nodes are those of one file, and `Use` finds no others; relative
  names of files are relative to the folder of the file in which they stand.
- **Order** counts: the walk goes depth first from left to right, and a property acts on what follows it, up to the end of the
  nearest Separator.
- **Comments** are `// …` and `/* … */`; a comma may follow the last of a list.
- **Nesting** is at most {MAX_NESTING} deep.
- **Versions**: this is version {VERSION}. A file of another version is refused.
- **Writing** leaves out what has its default, writes nodes in several places once, and gives those that need one a name.

"
    );
    for (family, title, text) in FAMILIES {
        page.push_str(&format!("## {title}\n\n{text}\n\n"));
        for info in registry.kinds().filter(|info| info.family == *family) {
            page.push_str(&describe_node(info));
        }
    }
    page.truncate(page.trim_end().len());
    page.push('\n');
    page
}

/// Families with their titles, and what they have in common.
const FAMILIES: &[(&str, &str, &str)] = &[
    ("group", "Groups", "A group has children. What it does with them holds for all actions unless it says otherwise."),
    ("property", "Properties", "A property changes the State for what follows it."),
    (
        "shape",
        "Shapes",
        "A shape has a place in space. It is boxed by its local box transformed to the world, picked by rays in its local \
         coordinates, drawn with the material and lights in force, found by searches like every node, and handed to callbacks and \
         counts as primitives.",
    ),
];

/// One kind of node, its fields, their types and defaults, as a section of Markdown.
///
/// # Example
///
/// ```
/// use seamount::format::describe_node;
/// use seamount::node::{Cube, NodeType};
///
/// assert!(describe_node(Cube::INFO).contains("| `width` | number | `2.0` |"));
/// ```
#[must_use]
pub fn describe_node(info: &NodeInfo) -> String {
    let mut text = format!("### {}\n\n{}\n\n", info.kind, plain(info.doc));
    if let Some(rule) = info.children {
        text.push_str(&format!("Children: `{}: […]`, {}.\n\n", rule.field, rule.describe()));
    }
    if !info.fields.is_empty() {
        text.push_str("| Field | Type | Default | |\n|---|---|---|---|\n");
        for field in info.fields {
            let cell = |text: String| text.replace('|', "\\|");
            text.push_str(&format!(
                "| `{}` | {} | `{}` | {} |\n",
                field.name,
                cell((field.type_name)()),
                cell((field.default)()),
                cell(plain(field.doc).replace('\n', " ")),
            ));
        }
        text.push('\n');
    }
    text
}

/// Documentation without the marks that only rustdoc understands: the space after `///`, and links into the crate.
#[must_use]
pub fn plain(doc: &str) -> String {
    let lines: Vec<&str> = doc.lines().map(|line| line.strip_prefix(' ').unwrap_or(line).trim_end()).collect();
    let mut text = lines.join("\n").trim().to_owned();
    while let Some((before, rest)) = text.split_once("[`") {
        let Some((name, after)) = rest.split_once("`]") else { break };
        let after = match after.strip_prefix("(crate::") {
            Some(link) => link.split_once(')').map_or(after, |(_, after)| after),
            None => after,
        };
        text = format!("{before}`{name}`{after}");
    }
    text
}
