//! Reading: one streaming pass over the text with ron, in which every word and value keeps its place.
//!
//! ron hands over words and raw values as slices of the text, so their positions are exact; structure, names and sharing
//! are looked after here. A mistake of meaning is noted and the reading goes on with the best guess (a misspelt kind is
//! read as the one it looks like), so that one reading tells all mistakes.

use std::collections::HashMap;
use std::fmt;
use std::path::Path;

use ron::value::RawValue;
use serde::de::{DeserializeSeed, Deserializer, EnumAccess, IgnoredAny, MapAccess, SeqAccess, VariantAccess, Visitor};

use super::error::{Mistake, Problem, ReadError};
use super::syntax::{self, Expecting};
use super::text::{Payload, Places, payload, skip_blank, within};
use super::{MAX_NESTING, VERSION};
use crate::node::{
    FieldError, FieldInfo, FieldProblem, FieldValue, Node, NodeInfo, Registry, ShaderSource, Texture2, active_stage,
    nearest, unknown_parameters,
};
use crate::scene::{ImageError, NodeKey, Position, Scene, TextError};

/// Steps of recursion that ron takes per nested node: the list, its element, the enum, its payload and the field's value,
/// and three more for a `Def` around it.
const STEPS: usize = 8;

/// Steps left for the value of a field in the deepest node.
const VALUE_STEPS: usize = 128;

/// Stack for the deepest text that is read, for any build: the steps above, 8 KiB each. Memory that is not used costs
/// nothing.
const STACK: usize = (STEPS * (MAX_NESTING + 1) + VALUE_STEPS) * 8192;

/// Reads the scene in a file, with the nodes of this crate.
///
/// Image files that the scene names have to exist; they are decoded when an action needs them.
///
/// # Errors
///
/// When there is no such file, it can not be read, or something is wrong in it; see [`ReadError`].
///
/// # Example
///
/// ```no_run
/// let scene = seamount::format::read_scene("scenes/fuji.ron")?;
/// println!("{} nodes", scene.len());
/// # Ok::<(), seamount::format::ReadError>(())
/// ```
pub fn read_scene(path: impl AsRef<Path>) -> Result<Scene, ReadError> {
    read_scene_with(path, &Registry::default())
}

/// [`read_scene`] with the kinds of node in a registry, which may have some of your own.
///
/// # Errors
///
/// As for [`read_scene`].
pub fn read_scene_with(path: impl AsRef<Path>, registry: &Registry) -> Result<Scene, ReadError> {
    read_file(path.as_ref(), registry).map(|read| read.scene)
}

/// The scene in a text. File names in it are not looked at: there is no folder that they are relative to.
///
/// # Errors
///
/// [`ReadError::Mistakes`] when something is wrong in it.
///
/// # Example
///
/// A node of your own in a scene file:
///
/// ```
/// use seamount::define_node;
/// use seamount::action::{PropertyContext, State};
/// use seamount::node::{PropertyNode, Registry};
///
/// define_node! {
///     /// Moves what follows up.
///     pub struct Lift: property {
///         /// How far.
///         pub height: f64 = 1.0,
///     }
/// }
/// impl PropertyNode for Lift {
///     fn apply(&self, state: &mut State, _: &PropertyContext<'_>) {
///         state.translate(glam::DVec3::new(0.0, 0.0, self.height));
///     }
/// }
///
/// let mut registry = Registry::default();
/// registry.register::<Lift>();
/// let scene = seamount::format::parse("Scene(version: 1, root: Group(children: [Lift(height: 2.0)]))", &registry)?;
/// let lift = scene.children(scene.root())[0];
/// assert_eq!(scene.get::<Lift>(lift).unwrap().height, 2.0);
/// # Ok::<(), seamount::format::ReadError>(())
/// ```
pub fn parse(text: &str, registry: &Registry) -> Result<Scene, ReadError> {
    match read_text(text, registry, Scene::new()) {
        Ok(read) => Ok(read.scene),
        Err(mistakes) => Err(ReadError::Mistakes { path: None, mistakes }),
    }
}

/// A scene and where its fields stand.
#[derive(Debug)]
pub(super) struct Read {
    pub(super) scene: Scene,
    /// Positions of the values of all fields that are given.
    pub(super) fields: HashMap<(NodeKey, &'static str), Position>,
}

pub(super) fn read_file(path: &Path, registry: &Registry) -> Result<Read, ReadError> {
    let bytes = std::fs::read(path).map_err(|error| match error.kind() {
        std::io::ErrorKind::NotFound => ReadError::Missing { path: path.to_owned() },
        _ => ReadError::Unreadable { path: path.to_owned(), error },
    })?;
    let mistakes = |mistakes| ReadError::Mistakes { path: Some(path.to_owned()), mistakes };
    let text = decode(&bytes).map_err(|mistake| mistakes(vec![*mistake]))?;
    let mut scene = Scene::new();
    scene.set_source(path);
    read_text(text, registry, scene).map_err(mistakes)
}

/// The text in a file, without a byte order mark.
fn decode(bytes: &[u8]) -> Result<&str, Box<Mistake>> {
    let text = match std::str::from_utf8(bytes) {
        Ok(text) => text,
        Err(error) => {
            let (good, bad) = bytes.split_at(error.valid_up_to());
            let good = std::str::from_utf8(good).unwrap_or_default();
            let problem = Problem::NotUtf8 { byte: bad.first().copied().unwrap_or_default() };
            let position = Some(Places::new(good).position(good.len()));
            return Err(Box::new(Mistake { position, problem, path_in_tree: Vec::new() }));
        }
    };
    Ok(text.strip_prefix('\u{feff}').unwrap_or(text))
}

fn read_text(text: &str, registry: &Registry, scene: Scene) -> Result<Read, Vec<Mistake>> {
    let options = ron::Options::default().with_recursion_limit(STEPS * (MAX_NESTING + 1) + VALUE_STEPS);
    let mut reader = Reader {
        text,
        places: Places::new(text),
        registry,
        scene,
        fields: HashMap::new(),
        names: HashMap::new(),
        early: Vec::new(),
        mistakes: Vec::new(),
        end: None,
        path: Vec::new(),
        open: Vec::new(),
        expecting: Expecting::Scene,
    };
    let outcome = stacker::grow(STACK, || options.from_str_seed(text, SceneSeed(&mut reader)));
    reader.finish(outcome)
}

/// A name given by a Def.
struct Defined {
    position: Position,
    /// The node; `None` if it could not be made.
    key: Option<NodeKey>,
    /// Whether its definition is still going on.
    open: bool,
}

/// A Use whose Def has not come, with what it takes to complain.
struct Early<'t> {
    name: String,
    at: &'t str,
    path: Vec<String>,
}

struct Reader<'t, 'r> {
    text: &'t str,
    places: Places<'t>,
    registry: &'r Registry,
    scene: Scene,
    fields: HashMap<(NodeKey, &'static str), Position>,
    names: HashMap<String, Defined>,
    early: Vec<Early<'t>>,
    mistakes: Vec<Mistake>,
    /// The mistake that ended the reading, if it was found here and not by ron.
    end: Option<Mistake>,
    path: Vec<String>,
    /// Where the nodes stand that are being read.
    open: Vec<Position>,
    expecting: Expecting,
}

impl<'t> Reader<'t, '_> {
    fn position(&self, part: &str) -> Position {
        self.places.position(self.places.offset(part))
    }

    /// Where a value stands, without comments before it.
    fn value_position(&self, raw: &str) -> Position {
        self.places.position(self.places.offset(raw) + skip_blank(raw, 0))
    }

    fn end_of(&self, word: &str) -> usize {
        self.places.offset(word) + word.len()
    }

    fn mistake_at(&mut self, position: Position, problem: Problem) {
        let path_in_tree = self.path.clone();
        self.mistakes.push(Mistake { position: Some(position), problem, path_in_tree });
    }

    fn mistake(&mut self, part: &str, problem: Problem) {
        self.mistake_at(self.position(part), problem);
    }

    /// Ends the reading with a mistake.
    fn end<E: serde::de::Error>(&mut self, part: &str, problem: Problem) -> E {
        let mistake =
            Mistake { position: Some(self.position(part)), problem, path_in_tree: std::mem::take(&mut self.path) };
        self.end = Some(mistake);
        E::custom("the reading has ended")
    }

    /// Reads the text of a field; `None` and a mistake if it is not of its type.
    fn value<T>(
        &mut self,
        field: &str,
        takes: impl FnOnce() -> String,
        raw: &'t str,
        read: impl FnOnce(&str) -> Result<T, FieldError>,
    ) -> Option<T> {
        let (position, problem) = match read(raw) {
            Ok(value) => return Some(value),
            Err(FieldError::NotFinite) => {
                let number = number_beyond_range(raw);
                let at = number.map_or_else(|| self.value_position(raw), |number| self.position(number));
                let number = number.unwrap_or(raw).to_owned();
                (at, Problem::NotFinite { field: field.to_owned(), number })
            }
            Err(FieldError::Syntax(error)) => {
                // A plain value is wrong as a whole. In a list it is where the parser stood, or started to read what then
                // turned out wrong.
                let position = match &error.code {
                    _ if !raw.contains(['(', '[', '{']) => Position { line: 1, column: 1 },
                    ron::Error::IntegerOutOfBounds
                    | ron::Error::InvalidValueForType { .. }
                    | ron::Error::ExpectedDifferentLength { .. }
                    | ron::Error::NoSuchEnumVariant { .. } => of_ron(error.span.start),
                    _ => of_ron(error.span.end),
                };
                let at = within(self.position(raw), position).max(self.value_position(raw));
                let reason = syntax::reason(&error.code);
                (at, Problem::WrongValue { field: field.to_owned(), takes: takes(), reason })
            }
        };
        self.mistake_at(position, problem);
        None
    }

    /// A name in a Def or Use.
    fn name(&mut self, word: &'static str, raw: &'t str) -> Option<String> {
        match String::read(raw) {
            Ok(name) => Some(name),
            Err(_) => {
                self.mistake_at(self.value_position(raw), Problem::Name { word });
                None
            }
        }
    }

    fn finish(mut self, outcome: Result<Option<NodeKey>, ron::error::SpannedError>) -> Result<Read, Vec<Mistake>> {
        let root = match outcome {
            Ok(root) => root,
            Err(error) => {
                let mistake = self.end.take().unwrap_or_else(|| self.syntax_mistake(&error));
                return Err(vec![mistake]);
            }
        };
        for Early { name, at, path } in std::mem::take(&mut self.early) {
            let problem = match self.names.get(&name) {
                Some(defined) => Problem::EarlyUse { name, definition: defined.position },
                None => {
                    let nearest = nearest(&name, self.names.keys().map(String::as_str)).map(str::to_owned);
                    Problem::UnknownUse { name, nearest }
                }
            };
            self.path = path;
            self.mistake(at, problem);
        }
        match root {
            Some(root) if self.mistakes.is_empty() => {
                let empty = self.scene.root();
                // Both keys are of this scene: these edits can not fail.
                if self.scene.set_root(root).is_ok() && empty != root {
                    let _ = self.scene.remove(empty);
                }
                Ok(Read { scene: self.scene, fields: self.fields })
            }
            _ => {
                self.mistakes.sort_by_key(|m| m.position);
                Err(self.mistakes)
            }
        }
    }

    /// ron's complaint in the words of a scene's author.
    fn syntax_mistake(&self, error: &ron::error::SpannedError) -> Mistake {
        let position = of_ron(error.span.end);
        if skip_blank(self.text, 0) == self.text.len() && !matches!(error.code, ron::Error::UnclosedBlockComment) {
            let text = "the file is empty: a scene starts with `Scene(version: 1, root: …)`".to_owned();
            let position = Some(Position { line: 1, column: 1 });
            return Mistake { position, problem: Problem::Syntax(text), path_in_tree: Vec::new() };
        }
        let end = self.text.trim_end();
        let problem = match self.open.last() {
            _ if matches!(error.code, ron::Error::UnclosedBlockComment | ron::Error::ExpectedStringEnd) => None,
            _ if position < self.places.position(end.len()) => None,
            Some(open) => Some(format!("the file ends too early: a bracket is not closed in the node at {open}")),
            None if error.code == ron::Error::TrailingCharacters => None,
            None => Some("the file ends too early: a bracket is not closed".to_owned()),
        };
        let problem = problem.unwrap_or_else(|| syntax::message(&error.code, self.expecting));
        Mistake { position: Some(position), problem: Problem::Syntax(problem), path_in_tree: self.path.clone() }
    }
}

fn of_ron(position: ron::error::Position) -> Position {
    Position { line: position.line, column: position.col }
}

/// The number in a text that is NaN, infinite or beyond the range of the type it was read as.
fn number_beyond_range(text: &str) -> Option<&str> {
    let words = || text.split(|c: char| !(c.is_ascii_alphanumeric() || "_+-.".contains(c))).filter(|w| !w.is_empty());
    let value = |word: &str| word.replace('_', "").trim_end_matches("f32").trim_end_matches("f64").parse::<f64>().ok();
    words()
        .find(|word| value(word).is_some_and(|v| !v.is_finite()))
        .or_else(|| words().find(|word| value(word).is_some_and(|v| !(v as f32).is_finite())))
}

/// A word of the text, as a slice of it.
struct Word;

impl<'t> DeserializeSeed<'t> for Word {
    type Value = &'t str;

    fn deserialize<D: Deserializer<'t>>(self, deserializer: D) -> Result<&'t str, D::Error> {
        deserializer.deserialize_identifier(self)
    }
}

impl<'t> Visitor<'t> for Word {
    type Value = &'t str;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a word")
    }

    fn visit_borrowed_str<E>(self, word: &'t str) -> Result<&'t str, E> {
        Ok(word)
    }
}

/// `Scene(version: 1, root: …)`.
struct SceneSeed<'a, 't, 'r>(&'a mut Reader<'t, 'r>);

impl<'t> DeserializeSeed<'t> for SceneSeed<'_, 't, '_> {
    type Value = Option<NodeKey>;

    fn deserialize<D: Deserializer<'t>>(self, deserializer: D) -> Result<Self::Value, D::Error> {
        deserializer.deserialize_enum("", &[], self)
    }
}

impl<'t> Visitor<'t> for SceneSeed<'_, 't, '_> {
    type Value = Option<NodeKey>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Scene")
    }

    fn visit_enum<A: EnumAccess<'t>>(self, data: A) -> Result<Self::Value, A::Error> {
        let reader = self.0;
        let (word, variant) = data.variant_seed(Word)?;
        if word != "Scene" {
            let problem = Problem::NotAScene { found: word.to_owned() };
            return Err(reader.end(word, problem));
        }
        variant.struct_variant(&[], SceneFields { reader, word })
    }
}

struct SceneFields<'a, 't, 'r> {
    reader: &'a mut Reader<'t, 'r>,
    word: &'t str,
}

impl<'t> Visitor<'t> for SceneFields<'_, 't, '_> {
    type Value = Option<NodeKey>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("version and root")
    }

    fn visit_map<A: MapAccess<'t>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        let Self { reader, word } = self;
        let (mut version, mut root_at, mut root) = (None, None, None);
        loop {
            reader.expecting = Expecting::Field;
            let Some(field) = map.next_key_seed(Word)? else { break };
            let fields = vec!["version", "root"];
            let near = nearest(field, fields.iter().copied());
            if field != "version" && field != "root" {
                let nearest = near.map(str::to_owned);
                let problem = Problem::UnknownField { kind: "Scene".into(), found: field.to_owned(), nearest, fields };
                reader.mistake(field, problem);
            }
            let first = match near {
                Some("version") => version,
                Some("root") => root_at,
                _ => None,
            };
            if let Some(first) = first {
                reader.mistake(field, Problem::DuplicateField { field: field.to_owned(), first });
                map.next_value::<IgnoredAny>()?;
                continue;
            }
            match near {
                Some("version") => {
                    version = Some(reader.position(field));
                    reader.expecting = Expecting::Value;
                    let raw = map.next_value::<&RawValue>()?.get_ron();
                    let read = |text: &str| u32::read(text);
                    let found = reader.value("version", || "an integer".to_owned(), raw, read);
                    if let Some(found) = found.filter(|&found| found != VERSION) {
                        // What else a file of another version means is not known here.
                        let at = trimmed(raw);
                        let problem = Problem::Version { found: found.into() };
                        return Err(reader.end(at, problem));
                    }
                }
                Some(_) => {
                    root_at = Some(reader.position(field));
                    let seed = NodeSeed { reader: &mut *reader, depth: 1, index: None, name: None };
                    root = map.next_value_seed(seed)?;
                }
                None => {
                    map.next_value::<IgnoredAny>()?;
                }
            }
        }
        if version.is_none() {
            reader.mistake(word, Problem::NoVersion);
        }
        if root_at.is_none() {
            reader.mistake(word, Problem::NoRoot);
        }
        Ok(root.map(|child: Child| child.key))
    }
}

/// A raw value without comments before it.
fn trimmed(raw: &str) -> &str {
    raw.get(skip_blank(raw, 0)..).unwrap_or(raw)
}

/// A node that was read, and where.
#[derive(Clone, Copy)]
struct Child {
    key: NodeKey,
    position: Position,
}

/// A node: `Kind(…)`, `Def("name", Kind(…))` or `Use("name")`. Nothing if it was too wrong to be made.
struct NodeSeed<'a, 't, 'r> {
    reader: &'a mut Reader<'t, 'r>,
    depth: usize,
    /// Place among the children of the parent; none for the root.
    index: Option<usize>,
    /// For the node of a Def: its name, if it is one.
    name: Option<Option<String>>,
}

impl<'t> DeserializeSeed<'t> for NodeSeed<'_, 't, '_> {
    type Value = Option<Child>;

    fn deserialize<D: Deserializer<'t>>(self, deserializer: D) -> Result<Self::Value, D::Error> {
        self.reader.expecting = Expecting::Node;
        deserializer.deserialize_enum("", &[], self)
    }
}

impl<'t> Visitor<'t> for NodeSeed<'_, 't, '_> {
    type Value = Option<Child>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a node")
    }

    fn visit_enum<A: EnumAccess<'t>>(self, data: A) -> Result<Self::Value, A::Error> {
        let Self { reader, depth, index, name } = self;
        let (word, variant) = data.variant_seed(Word)?;
        if depth > MAX_NESTING {
            return Err(reader.end(word, Problem::TooDeep));
        }
        let position = reader.position(word);
        match (word, name.is_some()) {
            ("Def", true) => Err(reader.end(word, Problem::DefOf { found: "Def" })),
            ("Def", false) => {
                reader.expecting = Expecting::Def;
                variant.tuple_variant(2, DefArguments { reader, word, depth, index })
            }
            ("Use", in_def) => {
                reader.expecting = Expecting::Use;
                let key = variant.tuple_variant(1, UseArguments { reader: &mut *reader, word })?;
                if in_def {
                    reader.mistake(word, Problem::DefOf { found: "Use" });
                }
                Ok(key.map(|key| Child { key, position }))
            }
            _ => {
                let name = name.flatten();
                let label = match (&name, index) {
                    (Some(name), _) => name.clone(),
                    (None, Some(index)) => format!("{word}[{index}]"),
                    (None, None) => word.to_owned(),
                };
                reader.path.push(label);
                reader.open.push(position);
                let key = read_kind(reader, depth, word, variant)?;
                reader.open.pop();
                reader.path.pop();
                Ok(key.map(|key| Child { key, position }))
            }
        }
    }
}

/// Reads what follows the name of a kind, and makes the node.
fn read_kind<'t, V: VariantAccess<'t>>(
    reader: &mut Reader<'t, '_>,
    depth: usize,
    word: &'t str,
    variant: V,
) -> Result<Option<NodeKey>, V::Error> {
    let known = reader.registry.get(word);
    let mut info = known;
    if known.is_none() {
        let near = reader.registry.nearest(word).or_else(|| nearest(word, ["Def", "Use"].into_iter()));
        info = near.and_then(|kind| reader.registry.get(kind));
        let problem = Problem::UnknownNode { found: word.to_owned(), nearest: near.map(str::to_owned) };
        reader.mistake(word, problem);
    }
    let node = info.map(|info| (info.make)());
    let mut fields = NodeFields { reader, depth, info, node, given: Vec::new(), children: Vec::new(), sound: true };
    match payload(fields.reader.text, fields.reader.end_of(word)) {
        Payload::None => variant.unit_variant()?,
        Payload::Named => fields = variant.struct_variant(&[], fields)?,
        Payload::Unnamed => {
            if let Some(info) = info {
                let problem = Problem::UnnamedFields { kind: info.kind.to_owned(), fields: field_names(info) };
                fields.reader.mistake(word, problem);
            }
            variant.tuple_variant(0, IgnoredAny)?;
        }
    }
    if known.is_none() {
        return Ok(None);
    }
    Ok(fields.finish(word))
}

/// The fields of a kind as they may be written, its list of children included.
fn field_names(info: &NodeInfo) -> Vec<&'static str> {
    info.fields.iter().map(|f| f.name).chain(info.children.map(|rule| rule.field)).collect()
}

/// What stands in the parentheses of a node.
struct NodeFields<'a, 't, 'r> {
    reader: &'a mut Reader<'t, 'r>,
    depth: usize,
    /// The kind, or the one that was probably meant.
    info: Option<&'static NodeInfo>,
    node: Option<Box<dyn Node>>,
    /// Fields that were given, and the positions of their names and values.
    given: Vec<(&'static str, Position, Position)>,
    children: Vec<Child>,
    /// Whether all fields could be read.
    sound: bool,
}

/// Where the value of a field goes.
enum Target {
    Field(&'static FieldInfo),
    Children(&'static str),
    Nowhere,
}

impl<'t> NodeFields<'_, 't, '_> {
    /// What a word in the place of a field means.
    fn target(&mut self, word: &'t str) -> Target {
        let Some(info) = self.info else {
            return if word == "children" { Target::Children("children") } else { Target::Nowhere };
        };
        let find = |name: &str| match info.children {
            Some(rule) if rule.field == name => Some(Target::Children(rule.field)),
            _ => info.field(name).map(Target::Field),
        };
        if let Some(target) = find(word) {
            return target;
        }
        self.sound = false;
        if word == "children" && info.children.is_none() {
            self.reader.mistake(word, Problem::NoChildren { kind: info.kind.to_owned() });
            return Target::Children("children");
        }
        let fields = field_names(info);
        let near = nearest(word, fields.iter().copied());
        let target = near.and_then(find).unwrap_or(Target::Nowhere);
        let problem = Problem::UnknownField {
            kind: info.kind.to_owned(),
            found: word.to_owned(),
            nearest: near.map(str::to_owned),
            fields,
        };
        self.reader.mistake(word, problem);
        target
    }

    /// Whether a field stands here for the first time; a mistake if not.
    fn first(&mut self, name: &'static str, word: &'t str) -> bool {
        let found = self.given.iter().find(|(given, ..)| *given == name).map(|&(_, at, _)| at);
        if let Some(first) = found {
            self.reader.mistake(word, Problem::DuplicateField { field: name.to_owned(), first });
        }
        found.is_none()
    }

    /// Puts the node into the scene.
    fn finish(self, word: &'t str) -> Option<NodeKey> {
        let Self { reader, info, node, given, children, sound, .. } = self;
        let node = node?;
        let position = reader.position(word);
        let at = |field: &str| given.iter().find(|(name, ..)| *name == field).map_or(position, |&(_, _, value)| value);
        // Values that could not be read would be complained about again.
        if sound {
            for problem in node.problems() {
                let field = problem.field;
                reader.mistake_at(at(field), Problem::Field { field, message: problem.message });
            }
        }
        let key = reader.scene.insert_boxed(node);
        reader.scene.set_position(key, position);
        // A node that can not have children was told so once, not for each child.
        let takes_children = info.is_some_and(|info| info.children.is_some());
        for child in children.into_iter().filter(|_| takes_children) {
            if let Err(error) = reader.scene.add_child(key, child.key) {
                reader.mistake_at(child.position, Problem::Child(error));
            }
        }
        if let Some((field, problem)) = missing_file(&reader.scene, key) {
            reader.mistake_at(at(field), problem);
        }
        for (parameter, FieldProblem { field, message }) in unknown_parameters(&reader.scene, key) {
            let position = reader.fields.get(&(parameter, field)).copied().unwrap_or(position);
            reader.mistake_at(position, Problem::Field { field, message });
        }
        reader.fields.extend(given.iter().map(|&(name, _, value)| ((key, name), value)));
        Some(key)
    }
}

/// Why the file that a node names can not be had, as far as can be told without opening it, and the field that names it.
fn missing_file(scene: &Scene, key: NodeKey) -> Option<(&'static str, Problem)> {
    scene.source()?;
    if let Some((_, ShaderSource::File(name))) = active_stage(scene, key) {
        let path = scene.resolve(name);
        let error = std::fs::metadata(&path).err()?;
        return Some(("source_program", Problem::Shape(TextError::of(&path, error).into())));
    }
    let filename = &scene.get::<Texture2>(key)?.filename;
    if filename.is_empty() {
        return None;
    }
    let path = scene.resolve(filename);
    let error = std::fs::metadata(&path).err()?;
    let error = match error.kind() {
        std::io::ErrorKind::NotFound => ImageError::Missing { path },
        _ => ImageError::Unreadable { path, error: error.into() },
    };
    Some(("filename", Problem::Image(error)))
}

impl<'t> Visitor<'t> for NodeFields<'_, 't, '_> {
    type Value = Self;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("fields")
    }

    fn visit_map<A: MapAccess<'t>>(mut self, mut map: A) -> Result<Self, A::Error> {
        loop {
            self.reader.expecting = Expecting::Field;
            let Some(word) = map.next_key_seed(Word)? else { return Ok(self) };
            let at = self.reader.position(word);
            let value = skip_blank(self.reader.text, skip_blank(self.reader.text, self.reader.end_of(word)) + 1);
            self.reader.expecting = Expecting::Value;
            match self.target(word) {
                Target::Field(field) if self.first(field.name, word) => {
                    let raw = map.next_value::<&RawValue>()?.get_ron();
                    self.given.push((field.name, at, self.reader.value_position(raw)));
                    if let Some(node) = &mut self.node {
                        let read = |text: &str| (field.read)(node.as_mut(), text);
                        self.sound &= self.reader.value(field.name, field.type_name, raw, read).is_some();
                    }
                }
                Target::Children(name) if self.first(name, word) => {
                    self.given.push((name, at, self.reader.places.position(value)));
                    if self.reader.text.get(value..).is_some_and(|rest| rest.starts_with('[')) {
                        let list = ListSeed { reader: &mut *self.reader, depth: self.depth + 1 };
                        self.children = map.next_value_seed(list)?;
                    } else {
                        map.next_value::<IgnoredAny>()?;
                        let position = self.reader.places.position(value);
                        self.reader.mistake_at(position, Problem::NotAList { field: name.to_owned() });
                    }
                }
                _ => {
                    map.next_value::<IgnoredAny>()?;
                }
            }
        }
    }
}

/// A list of nodes.
struct ListSeed<'a, 't, 'r> {
    reader: &'a mut Reader<'t, 'r>,
    depth: usize,
}

impl<'t> DeserializeSeed<'t> for ListSeed<'_, 't, '_> {
    type Value = Vec<Child>;

    fn deserialize<D: Deserializer<'t>>(self, deserializer: D) -> Result<Vec<Child>, D::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl<'t> Visitor<'t> for ListSeed<'_, 't, '_> {
    type Value = Vec<Child>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("nodes")
    }

    fn visit_seq<A: SeqAccess<'t>>(self, mut list: A) -> Result<Vec<Child>, A::Error> {
        let mut children = Vec::new();
        for index in 0.. {
            self.reader.expecting = Expecting::Node;
            let seed = NodeSeed { reader: &mut *self.reader, depth: self.depth, index: Some(index), name: None };
            match list.next_element_seed(seed)? {
                Some(child) => children.extend(child),
                None => break,
            }
        }
        Ok(children)
    }
}

/// `("name", node)` after `Def`.
struct DefArguments<'a, 't, 'r> {
    reader: &'a mut Reader<'t, 'r>,
    word: &'t str,
    depth: usize,
    index: Option<usize>,
}

impl<'t> Visitor<'t> for DefArguments<'_, 't, '_> {
    type Value = Option<Child>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a name and a node")
    }

    fn visit_seq<A: SeqAccess<'t>>(self, mut list: A) -> Result<Self::Value, A::Error> {
        let Self { reader, word, depth, index } = self;
        let Some(raw) = list.next_element::<&RawValue>()? else {
            return Err(reader.end(word, syntax::arguments(Expecting::Def)));
        };
        let raw = raw.get_ron();
        let name = reader.name("Def", raw);
        let position = reader.value_position(raw);
        let mut fresh = None;
        if let Some(name) = &name {
            match reader.names.get(name) {
                Some(defined) => {
                    let problem = Problem::DuplicateDef { name: name.clone(), first: defined.position };
                    reader.mistake_at(position, problem);
                }
                None => {
                    reader.names.insert(name.clone(), Defined { position, key: None, open: true });
                    fresh = Some(name.clone());
                }
            }
        }
        let seed = NodeSeed { reader: &mut *reader, depth, index, name: Some(name) };
        let child = list.next_element_seed(seed)?;
        reader.expecting = Expecting::Def;
        let Some(child) = child else {
            return Err(reader.end(word, syntax::arguments(Expecting::Def)));
        };
        if let Some(defined) = fresh.as_ref().and_then(|name| reader.names.get_mut(name)) {
            defined.open = false;
            defined.key = child.map(|child| child.key);
        }
        if let (Some(name), Some(child)) = (fresh, child) {
            // Names were checked above; only a Use in the place of the node has one already, which is a mistake by itself.
            let _ = reader.scene.set_name(child.key, name);
        }
        Ok(child)
    }
}

/// `("name")` after `Use`.
struct UseArguments<'a, 't, 'r> {
    reader: &'a mut Reader<'t, 'r>,
    word: &'t str,
}

impl<'t> Visitor<'t> for UseArguments<'_, 't, '_> {
    type Value = Option<NodeKey>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a name")
    }

    fn visit_seq<A: SeqAccess<'t>>(self, mut list: A) -> Result<Self::Value, A::Error> {
        let Self { reader, word } = self;
        let Some(raw) = list.next_element::<&RawValue>()? else {
            return Err(reader.end(word, syntax::arguments(Expecting::Use)));
        };
        let Some(name) = reader.name("Use", raw.get_ron()) else { return Ok(None) };
        match reader.names.get(&name) {
            Some(Defined { open: true, .. }) => {
                reader.mistake(word, Problem::SelfUse { name });
                Ok(None)
            }
            Some(defined) => Ok(defined.key),
            None => {
                reader.early.push(Early { name, at: word, path: reader.path.clone() });
                Ok(None)
            }
        }
    }
}
