//! Writing: from a graph to a text that reads as the same graph.

use std::path::Path;

use slotmap::SecondaryMap;

use super::error::WriteError;
use super::{MAX_NESTING, VERSION};
use crate::node::{FieldValue, Node, NodeInfo, Texture2};
use crate::output::write_file;
use crate::scene::{NodeKey, Scene};

/// Longest line that fields are put on together.
const WIDTH: usize = 120;

/// The scene as text that can be read again.
///
/// Written is what can be reached from the root, with the fields that differ from their defaults. Nodes that occur more
/// than once are written once, with `Def`, and named by `Use` afterwards; those without a name get one (`shared_1`, …),
/// which they keep when read. File names are written as they are, and what a [`File`](crate::node::File) shows is left to its file.
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
    let mut writer = Writer {
        scene,
        names: names(scene),
        text: String::new(),
        written: SecondaryMap::new(),
        open: Vec::new(),
        fields: Vec::new(),
    };
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

/// New names for nodes that are shared and have none.
fn names(scene: &Scene) -> SecondaryMap<NodeKey, String> {
    let mut names = SecondaryMap::new();
    let mut seen = SecondaryMap::new();
    let mut pending = vec![scene.root()];
    let mut last = 0;
    // Depth first from left to right, so that numbers come in the order of the text. A node comes here once for each of
    // its places; what is below it is looked at once.
    while let Some(key) = pending.pop() {
        if seen.insert(key, ()).is_none() {
            // What a File shows are no children of its own.
            let has_own = scene.node(key).is_some_and(|node| node.info().children.is_some());
            pending.extend(scene.children(key).iter().rev().filter(|_| has_own));
        } else if scene.name(key).is_none() && !names.contains_key(key) {
            let name = loop {
                last += 1;
                let name = format!("shared_{last}");
                if scene.find(&name).is_none() {
                    break name;
                }
            };
            names.insert(key, name);
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
    names: SecondaryMap<NodeKey, String>,
    text: String,
    written: SecondaryMap<NodeKey, ()>,
    open: Vec<Open>,
    /// The fields of the node that is being written, and their values.
    fields: Vec<(&'static str, String)>,
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
        let name = self.scene.name(key).or_else(|| self.names.get(key).map(String::as_str));
        let name = name.map(|name| name.to_owned().write());
        let again = self.written.insert(key, ()).is_some();
        if let Some(name) = name.as_ref().filter(|_| again) {
            self.push(&["Use(", name, "),\n"]);
            return Ok(());
        }
        if self.scene.get::<Texture2>(key).is_some_and(|texture| texture.image.is_some()) {
            return Err(WriteError::ImageInMemory { path: self.path(key, index) });
        }
        let children = info.children.filter(|_| !self.scene.children(key).is_empty());

        let start = self.text.len();
        let after = if name.is_some() { "))" } else { ")" };
        if let Some(name) = &name {
            self.push(&["Def(", name, ", "]);
        }
        self.push(&[info.kind, "("]);
        self.fields(key, index, info)?;
        let fields = std::mem::take(&mut self.fields);
        let begin = self.text.len();
        for (k, (field, value)) in fields.iter().enumerate() {
            self.push(&[if k > 0 { ", " } else { "" }, field, ": ", value]);
        }
        if let Some(rule) = children {
            self.push(&[if fields.is_empty() { "" } else { ", " }, rule.field, ": ["]);
        }
        let line = self.text.get(start..).unwrap_or_default();
        let width = 4 * (self.open.len() + 1) + line.chars().count();
        if width > WIDTH && !fields.is_empty() {
            self.text.truncate(begin);
            for (field, value) in &fields {
                self.text.push('\n');
                self.indent();
                self.push(&["    ", field, ": ", value, ","]);
            }
            self.text.push('\n');
            self.indent();
            if let Some(rule) = children {
                self.push(&[rule.field, ": ["]);
            }
        }
        self.fields = fields;
        self.fields.clear();
        if children.is_some() {
            self.text.push('\n');
            let closing = if after.len() == 2 { "]))" } else { "])" };
            self.open.push(Open { key, next: 0, closing, index });
        } else {
            self.push(&[after, ",\n"]);
        }
        Ok(())
    }

    /// Appends parts of a line.
    fn push(&mut self, parts: &[&str]) {
        for part in parts {
            self.text.push_str(part);
        }
    }

    /// Closes the innermost group.
    fn close(&mut self) {
        if let Some(open) = self.open.pop() {
            self.indent();
            self.text.push_str(open.closing);
            self.text.push_str(",\n");
        }
    }

    /// Notes the fields of a node that differ from their defaults.
    fn fields(&mut self, key: NodeKey, index: usize, info: &'static NodeInfo) -> Result<(), WriteError> {
        let Some(node) = self.scene.node(key) else { return Ok(()) };
        let mut copy = None;
        for field in info.fields {
            let Some(value) = (field.write)(node) else { continue };
            let copy: &mut Box<dyn Node> = copy.get_or_insert_with(info.make);
            if (field.read)(copy.as_mut(), &value).is_err() {
                return Err(WriteError::Value { path: self.path(key, index), field: field.name, value });
            }
            self.fields.push((field.name, value));
        }
        Ok(())
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
