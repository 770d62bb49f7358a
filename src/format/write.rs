//! Writing: from a graph to a text that reads as the same graph.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use super::error::WriteError;
use super::{MAX_NESTING, VERSION};
use crate::node::{FieldValue, NodeInfo, Texture2};
use crate::output::write_file;
use crate::scene::{NodeKey, Scene};

/// Longest line that fields are put on together.
const WIDTH: usize = 120;

/// The scene as text that can be read again.
///
/// Written is what can be reached from the root, with the fields that differ from their defaults. Nodes that occur more
/// than once are written once, with `Def`, and named by `Use` afterwards; those without a name get one (`shared_1`, …),
/// which they keep when read. File names are written as they are.
///
/// # Errors
///
/// When a texture's image is in memory alone, a field has a value that could not be read again (such as NaN), or nodes are
/// nested deeper than [`MAX_NESTING`].
///
/// # Example
///
/// ```
/// use seamount::prelude::*;
///
/// let mut scene = Scene::new();
/// let root = scene.root();
/// scene.add(root, Cube { width: 4.0, ..Cube::default() })?;
/// let text = seamount::format::write_scene(&scene)?;
/// assert_eq!(text, "\
/// Scene(
///     version: 1,
///     root: Separator(children: [
///         Cube(width: 4.0),
///     ]),
/// )
/// ");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_scene(scene: &Scene) -> Result<String, WriteError> {
    let mut writer =
        Writer { scene, names: names(scene), text: String::new(), written: HashSet::new(), open: Vec::new() };
    writer.text.push_str(&format!("Scene(\n    version: {VERSION},\n    root: "));
    writer.node(scene.root(), 0)?;
    while let Some(open) = writer.open.last_mut() {
        let index = open.next;
        open.next += 1;
        match scene.children(open.key).get(index) {
            Some(&child) => {
                writer.indent();
                writer.node(child, index)?;
            }
            None => writer.close(),
        }
    }
    writer.text.push_str(")\n");
    Ok(writer.text)
}

/// Writes the scene to a file, which appears whole or not at all.
///
/// # Errors
///
/// As for [`write_scene`], and when the file can not be written.
pub fn save_scene(scene: &Scene, path: impl AsRef<Path>) -> Result<(), WriteError> {
    let text = write_scene(scene)?;
    write_file(path.as_ref(), |out| out.write_all(text.as_bytes()))?;
    Ok(())
}

/// The names under which nodes are written: their own, and new ones for nodes that are shared and have none.
fn names(scene: &Scene) -> HashMap<NodeKey, String> {
    let mut names = HashMap::new();
    let mut seen = HashSet::new();
    let mut pending = vec![scene.root()];
    let mut last = 0;
    // Depth first from left to right, so that numbers come in the order of the text. A node comes here once for each of
    // its places; what is below it is looked at once.
    while let Some(key) = pending.pop() {
        if seen.insert(key) {
            names.extend(scene.name(key).map(|name| (key, name.to_owned())));
            pending.extend(scene.children(key).iter().rev());
        } else {
            names.entry(key).or_insert_with(|| {
                loop {
                    last += 1;
                    let name = format!("shared_{last}");
                    if scene.find(&name).is_none() {
                        return name;
                    }
                }
            });
        }
    }
    names
}

/// A group whose children are being written.
struct Open {
    key: NodeKey,
    next: usize,
    /// What closes it.
    closing: &'static str,
    /// For paths in errors.
    index: usize,
}

struct Writer<'s> {
    scene: &'s Scene,
    names: HashMap<NodeKey, String>,
    text: String,
    written: HashSet<NodeKey>,
    open: Vec<Open>,
}

impl Writer<'_> {
    /// Starts the line of a child.
    fn indent(&mut self) {
        for _ in 0..=self.open.len() {
            self.text.push_str("    ");
        }
    }

    /// Writes a node up to its children.
    fn node(&mut self, key: NodeKey, index: usize) -> Result<(), WriteError> {
        if self.open.len() >= MAX_NESTING {
            return Err(WriteError::TooDeep);
        }
        let Some(node) = self.scene.node(key) else { return Ok(()) };
        let info = node.info();
        let name = self.names.get(&key).map(FieldValue::write);
        if let Some(name) = name.as_ref().filter(|_| self.written.contains(&key)) {
            self.text.push_str(&format!("Use({name}),\n"));
            return Ok(());
        }
        self.written.insert(key);
        if self.scene.get::<Texture2>(key).is_some_and(|texture| texture.image.is_some()) {
            return Err(WriteError::ImageInMemory { path: self.path(key, index) });
        }
        let fields = self.fields(key, index, info)?;
        let children = info.children.filter(|_| !self.scene.children(key).is_empty());

        let (before, after) = match &name {
            Some(name) => (format!("Def({name}, "), "))"),
            None => (String::new(), ")"),
        };
        self.text.push_str(&format!("{before}{}(", info.kind));
        let list = children.map(|rule| format!("{}: [", rule.field));
        let one_line = fields.iter().chain(&list).cloned().collect::<Vec<_>>().join(", ");
        let column = 4 * (self.open.len() + 1) + before.chars().count() + info.kind.len();
        if column + one_line.chars().count() < WIDTH || fields.is_empty() {
            self.text.push_str(&one_line);
        } else {
            for field in fields {
                self.text.push('\n');
                self.indent();
                self.text.push_str(&format!("    {field},"));
            }
            self.text.push('\n');
            self.indent();
            self.text.extend(list);
        }
        if children.is_some() {
            self.text.push('\n');
            let closing = if after.len() == 2 { "]))" } else { "])" };
            self.open.push(Open { key, next: 0, closing, index });
        } else {
            self.text.push_str(after);
            self.text.push_str(",\n");
        }
        Ok(())
    }

    /// Closes the innermost group.
    fn close(&mut self) {
        if let Some(open) = self.open.pop() {
            self.indent();
            self.text.push_str(open.closing);
            self.text.push_str(",\n");
        }
    }

    /// The fields of a node that differ from their defaults.
    fn fields(&self, key: NodeKey, index: usize, info: &'static NodeInfo) -> Result<Vec<String>, WriteError> {
        let Some(node) = self.scene.node(key) else { return Ok(Vec::new()) };
        let mut fields = Vec::new();
        let mut copy = (info.make)();
        for field in info.fields {
            let Some(value) = (field.write)(node) else { continue };
            if (field.read)(copy.as_mut(), &value).is_err() {
                return Err(WriteError::Value { path: self.path(key, index), field: field.name, value });
            }
            fields.push(format!("{}: {value}", field.name));
        }
        Ok(fields)
    }

    /// The way to a node that is about to be written.
    fn path(&self, key: NodeKey, index: usize) -> Vec<String> {
        let open = self.open.iter().map(|open| (open.key, open.index));
        let mut path = crate::scene::Path::default();
        for (key, index) in open.chain([(key, index)]) {
            path.push(key, index);
        }
        path.names(self.scene)
    }
}
