//! The description of all kinds of node, from the same table that reads and writes them.

use super::{MAX_NESTING, VERSION};
use crate::action::ActionKind;
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
    page.push_str(ACTIONS);
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

/// What the actions do with nodes whatever their kind.
const ACTIONS: &str = "\
## Actions

What each action does with a kind of node stands with the kind. With all kinds alike:

- **Search** finds a node by its name, its kind or itself.
- **Write** writes its kind, its name and the fields that differ from their defaults. What only code can give, such as a function or
  an image in memory, is in no file.
- **Callback** calls functions before and after it; they are given the State, where they find what properties have changed.
- **Matrix** is the way from the coordinates at the end of a path to those of the world.
- **Primitive count** counts the triangles, lines and points that a callback is handed.
- **Handle event** hands events to EventCallbacks, and picks what is under the pointer where one of them asks for that.

";

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
    text.push_str(&describe_actions(info));
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

/// What each kind of action does with a kind of node, as a list.
fn describe_actions(info: &NodeInfo) -> String {
    let names = |actions: &[ActionKind]| {
        let named = actions.iter().filter(|&&action| action != ActionKind::Other || info.family == "property");
        named.map(|action| action.name()).collect::<Vec<_>>().join(", ")
    };
    let mut text = String::new();
    for note in info.actions {
        text.push_str(&format!("- {}: {}\n", names(note.actions), note.text));
    }
    let all_alike = [ActionKind::Search, ActionKind::Other];
    let named = |action: &ActionKind| info.actions.iter().any(|note| note.actions.contains(action));
    let passing: Vec<_> =
        ActionKind::ALL.into_iter().filter(|action| !all_alike.contains(action) && !named(action)).collect();
    match passing.as_slice() {
        [] => {}
        [one] => text.push_str(&format!("- {}: passes it by\n", one.name())),
        several => text.push_str(&format!("- {}: pass it by\n", names(several))),
    }
    if !named(&ActionKind::Search) {
        text.push_str("- search: finds it\n");
    }
    text.push_str(if info.children.is_some() {
        "- write: writes it and its children\n\n"
    } else {
        "- write: writes it\n\n"
    });
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
