//! The reader: one pass over the text, without recursion.
//!
//! Structure (kinds, brackets, names of fields, sharing) is read here, from bracket to bracket, and where every word and
//! value stands is known on the way. The text of a value goes to its field, and only when the field does not want it ron is
//! asked whether it is a value at all: what is none is a mistake of syntax and ends the reading. A mistake of meaning is
//! noted and the reading goes on with the best guess (a misspelt kind is read as the one it looks like), so that one reading
//! tells all mistakes. Nodes that are not finished are on a stack of their own, so that deep nesting costs memory, not the
//! thread's stack.

use std::borrow::Cow;
use std::collections::HashMap;

use serde::Deserialize;
use serde::de::IgnoredAny;

use super::error::{Mistake, Problem};
use super::scan::{self, Payload};
use super::syntax;
use super::text::{Places, offset, within};
use super::{MAX_NESTING, VERSION};
use crate::node::{
    FieldError, FieldInfo, FieldProblem, FieldValue, Font, Node, NodeInfo, Registry, ShaderSource, Texture2,
    active_stage, nearest, unknown_parameters,
};
use crate::scene::{FontError, ImageError, NodeKey, Position, Scene, TextError};

/// How deep brackets may be nested in a value. Fields take far less, and ron takes stack for each.
const VALUE_NESTING: usize = 64;

/// Where the value of a field of a node stands.
pub(super) type FieldPosition = ((NodeKey, &'static str), Position);

/// Why the reading ends before the text does.
#[derive(Debug)]
struct Stop {
    at: usize,
    problem: Problem,
    /// Whether the end of the text explains it, if that is where it happened.
    open: bool,
}

type Step<T> = Result<T, Box<Stop>>;

/// A mistake after which nothing can be made out.
fn stop<T>(at: usize, problem: Problem) -> Step<T> {
    Err(Box::new(Stop { at, problem, open: false }))
}

/// Something else stands there than what has to.
fn expected<T>(at: usize, what: &str) -> Step<T> {
    Err(Box::new(Stop { at, problem: Problem::Syntax(what.to_owned()), open: true }))
}

/// A name given by a Def.
#[derive(Debug)]
struct Defined {
    at: usize,
    /// The node; `None` if it could not be made.
    key: Option<NodeKey>,
    /// Whether its definition is still going on.
    open: bool,
}

/// A Use whose Def has not come, with what it takes to complain.
#[derive(Debug)]
struct Early<'t> {
    name: Cow<'t, str>,
    at: usize,
    path: Vec<String>,
}

/// A node that was read, and where.
#[derive(Debug, Clone, Copy)]
struct Child {
    key: NodeKey,
    at: usize,
}

/// A field that was given, and where its name and its value stand.
#[derive(Debug, Clone, Copy)]
struct Given {
    field: &'static str,
    at: usize,
    value: usize,
}

/// A Def around a node.
#[derive(Debug)]
struct Def<'t> {
    /// The name, if it is one.
    name: Option<Cow<'t, str>>,
    /// Whether nobody had this name.
    fresh: bool,
}

/// A node that is not finished.
#[derive(Debug)]
struct Open<'t> {
    word: &'t str,
    at: usize,
    def: Option<Def<'t>>,
    /// Place among the children of its parent.
    index: usize,
    /// The kind, or the one that was probably meant.
    info: Option<&'static NodeInfo>,
    /// The node; without one if the kind is not even near to one that is known.
    node: Option<Box<dyn Node>>,
    /// Whether the kind is what it says.
    known: bool,
    /// Whether all fields could be read.
    sound: bool,
    /// Where its own begin among all fields that were given, and among all children.
    given: usize,
    children: usize,
    /// How many elements its list has so far.
    elements: usize,
}

/// What comes next.
#[derive(Debug)]
enum Next {
    Node,
    Fields,
    /// A node is finished; nothing if it was too wrong to be made.
    Done(Option<Child>),
}

/// Where the value of a field goes.
enum Target {
    Field(&'static FieldInfo),
    Children(&'static str),
    Nowhere,
}

/// Reads one text into a scene.
#[derive(Debug)]
pub(super) struct Reader<'t, 'r> {
    text: &'t str,
    at: usize,
    places: Places<'t>,
    registry: &'r Registry,
    scene: &'r mut Scene,
    /// Number of the file in the scene.
    file: usize,
    fields: Vec<FieldPosition>,
    names: HashMap<Cow<'t, str>, Defined>,
    early: Vec<Early<'t>>,
    mistakes: Vec<Mistake>,
    open: Vec<Open<'t>>,
    given: Vec<Given>,
    children: Vec<Child>,
}

impl<'t, 'r> Reader<'t, 'r> {
    pub(super) fn new(text: &'t str, registry: &'r Registry, scene: &'r mut Scene, file: usize) -> Self {
        Self {
            text,
            at: 0,
            places: Places::new(text),
            registry,
            scene,
            file,
            fields: Vec::new(),
            names: HashMap::new(),
            early: Vec::new(),
            mistakes: Vec::new(),
            open: Vec::new(),
            given: Vec::new(),
            children: Vec::new(),
        }
    }

    /// Reads the text: its root, which has no parent yet, and where fields stand. Nodes that were made stay in the scene
    /// whether there are mistakes or not. Which file mistakes are in is left to who knows it.
    pub(super) fn read(mut self) -> Result<(NodeKey, Vec<FieldPosition>), Vec<Mistake>> {
        let root = match self.scene() {
            Ok(root) => root,
            Err(stop) => return Err(vec![self.ended(*stop)]),
        };
        for Early { name, at, path } in std::mem::take(&mut self.early) {
            let problem = match self.names.get(&name) {
                Some(defined) => {
                    Problem::EarlyUse { name: name.into_owned(), definition: self.places.position(defined.at) }
                }
                None => {
                    let nearest = nearest(&name, self.names.keys().map(Cow::as_ref)).map(str::to_owned);
                    Problem::UnknownUse { name: name.into_owned(), nearest }
                }
            };
            let position = Some(self.places.position(at));
            self.mistakes.push(Mistake { file: None, position, problem, path_in_tree: path });
        }
        match root {
            Some(root) if self.mistakes.is_empty() => Ok((root, self.fields)),
            _ => {
                self.mistakes.sort_by_key(|m| m.position);
                Err(self.mistakes)
            }
        }
    }

    /// The mistake that ended the reading.
    fn ended(&self, Stop { at, problem, open }: Stop) -> Mistake {
        let problem = match self.open.last() {
            _ if !open || at < self.text.trim_end().len() => problem,
            Some(node) => {
                let node = self.places.position(node.at);
                Problem::Syntax(format!("the file ends too early: a bracket is not closed in the node at {node}"))
            }
            None => Problem::Syntax("the file ends too early: a bracket is not closed".to_owned()),
        };
        Mistake { file: None, position: Some(self.places.position(at)), problem, path_in_tree: self.path() }
    }

    /// The way to the node that is being read.
    fn path(&self) -> Vec<String> {
        let label = |(depth, open): (usize, &Open<'_>)| match open.def.as_ref().and_then(|def| def.name.as_deref()) {
            Some(name) => name.to_owned(),
            None if depth == 0 => open.word.to_owned(),
            None => format!("{}[{}]", open.word, open.index),
        };
        self.open.iter().enumerate().map(label).collect()
    }

    fn mistake_at(&mut self, position: Position, problem: Problem) {
        let path_in_tree = self.path();
        self.mistakes.push(Mistake { file: None, position: Some(position), problem, path_in_tree });
    }

    fn mistake(&mut self, at: usize, problem: Problem) {
        self.mistake_at(self.places.position(at), problem);
    }

    /// Goes past white space and comments.
    fn blank(&mut self) -> Step<()> {
        let blank = scan::blank(self.text, self.at);
        self.at = blank.end;
        if blank.closed { Ok(()) } else { stop(blank.end, Problem::Syntax(syntax::COMMENT.to_owned())) }
    }

    fn peek(&self) -> Option<u8> {
        self.text.as_bytes().get(self.at).copied()
    }

    /// Goes past a sign and the blank after it, if it stands here.
    fn eat(&mut self, sign: u8) -> Step<bool> {
        let here = self.peek() == Some(sign);
        if here {
            self.at += 1;
            self.blank()?;
        }
        Ok(here)
    }

    /// Goes past a word and the blank after it, if one stands here.
    fn word(&mut self) -> Step<Option<&'t str>> {
        let Some(word) = scan::word(self.text, self.at) else { return Ok(None) };
        let raw = self.text.get(self.at..).is_some_and(|rest| rest.starts_with("r#"));
        self.at += word.len() + if raw { 2 } else { 0 };
        self.blank()?;
        Ok(Some(word))
    }

    /// Goes past the comma after a value, unless the list ends here.
    fn comma(&mut self, end: u8) -> Step<()> {
        if self.eat(b',')? || self.peek() == Some(end) { Ok(()) } else { expected(self.at, syntax::COMMA) }
    }

    /// The text of any value, which may have any type, as it stands here; goes past it.
    fn any_value(&mut self) -> Step<&'t str> {
        let (start, rest) = (self.at, self.text.get(self.at..).unwrap_or_default());
        let options = ron::Options::default().with_recursion_limit(VALUE_NESTING);
        let skipped = ron::Deserializer::from_str_with_options(rest, &options).and_then(|mut ron| {
            // What ron takes for the attributes of a file has no place in it.
            let ignored = match rest.starts_with('#') {
                true => Err(ron::Error::UnexpectedChar('#')),
                false => IgnoredAny::deserialize(&mut ron),
            };
            ignored.map_err(|error| ron.span_error(error))?;
            Ok(rest.len() - ron.remainder().len())
        });
        let value = match skipped {
            Ok(length) => rest.get(..length).unwrap_or_default(),
            Err(error) => {
                let at = start + offset(rest, of_ron(error.span.end));
                let problem = Problem::Syntax(syntax::message(&error.code));
                let open = !matches!(error.code, ron::Error::UnclosedBlockComment | ron::Error::ExpectedStringEnd);
                return Err(Box::new(Stop { at, problem, open }));
            }
        };
        self.at += value.len();
        self.blank()?;
        Ok(value)
    }

    /// Reads the text of a field, from a byte on; `None` and a mistake if it is not of its type.
    fn value<T>(
        &mut self,
        field: &str,
        takes: impl FnOnce() -> String,
        at: usize,
        raw: &'t str,
        read: impl FnOnce(&str) -> Result<T, FieldError>,
    ) -> Option<T> {
        let start = self.places.position(at);
        let (position, problem) = match read(raw) {
            Ok(value) => return Some(value),
            Err(FieldError::NotFinite) => {
                let number = number_beyond_range(raw);
                let before = number.map_or(0, |number| number.as_ptr() as usize - raw.as_ptr() as usize);
                let number = number.unwrap_or(raw).to_owned();
                (self.places.position(at + before), Problem::NotFinite { field: field.to_owned(), number })
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
                let reason = syntax::reason(&error.code);
                (within(start, position), Problem::WrongValue { field: field.to_owned(), takes: takes(), reason })
            }
        };
        self.mistake_at(position, problem);
        None
    }

    /// `Scene(version: 1, root: …)`.
    fn scene(&mut self) -> Step<Option<NodeKey>> {
        self.blank()?;
        let start = self.at;
        if start == self.text.len() {
            return stop(0, Problem::Syntax(syntax::EMPTY.to_owned()));
        }
        let Some(word) = self.word()? else { return expected(start, syntax::SCENE) };
        if word != "Scene" {
            return stop(start, Problem::NotAScene { found: word.to_owned() });
        }
        if !self.eat(b'(')? {
            return expected(self.at, syntax::SCENE_FIELDS);
        }
        let (mut version, mut root_at, mut root) = (None, None, None);
        while !self.eat(b')')? {
            let at = self.at;
            let field = self.field_name()?;
            let fields = vec!["version", "root"];
            let near = nearest(field, fields.iter().copied());
            if field != "version" && field != "root" {
                let nearest = near.map(str::to_owned);
                self.mistake(
                    at,
                    Problem::UnknownField { kind: "Scene".into(), found: field.to_owned(), nearest, fields },
                );
            }
            match near {
                Some("version") if version.is_none() => {
                    version = Some(at);
                    let at = self.at;
                    let raw = self.any_value()?;
                    let found = self.value("version", || "an integer".to_owned(), at, raw, u32::read);
                    if let Some(found) = found.filter(|&found| found != VERSION) {
                        // What else a file of another version means is not known here.
                        return stop(at, Problem::Version { found: found.into() });
                    }
                }
                Some("root") if root_at.is_none() => {
                    root_at = Some(at);
                    root = self.tree()?;
                }
                _ => {
                    let first = if near == Some("version") { version } else { root_at };
                    if let Some(first) = first.filter(|_| near.is_some()) {
                        let first = self.places.position(first);
                        self.mistake(at, Problem::DuplicateField { field: field.to_owned(), first });
                    }
                    self.any_value()?;
                }
            }
            self.comma(b')')?;
        }
        if self.at < self.text.len() {
            return stop(self.at, Problem::Syntax(syntax::END.to_owned()));
        }
        if version.is_none() {
            self.mistake(start, Problem::NoVersion);
        }
        if root_at.is_none() {
            self.mistake(start, Problem::NoRoot);
        }
        Ok(root.map(|child| child.key))
    }

    /// The name of a field with its colon.
    fn field_name(&mut self) -> Step<&'t str> {
        let Some(word) = self.word()? else { return expected(self.at, syntax::FIELD) };
        if self.eat(b':')? { Ok(word) } else { expected(self.at, syntax::COLON) }
    }

    /// A node with all that is below it.
    fn tree(&mut self) -> Step<Option<Child>> {
        let mut next = Next::Node;
        loop {
            next = match next {
                Next::Node => self.node()?,
                Next::Fields => self.node_fields()?,
                Next::Done(child) => {
                    let Some(parent) = self.open.last_mut() else { return Ok(child) };
                    parent.elements += 1;
                    self.children.extend(child);
                    self.comma(b']')?;
                    if self.eat(b']')? {
                        self.comma(b')')?;
                        Next::Fields
                    } else {
                        Next::Node
                    }
                }
            };
        }
    }

    /// The beginning of a node: `Kind(`, `Def("name", Kind(` or all of `Use("name")`.
    fn node(&mut self) -> Step<Next> {
        let at = self.at;
        let Some(word) = self.word()? else { return expected(at, syntax::NODE) };
        if self.open.len() >= MAX_NESTING {
            return stop(at, Problem::TooDeep);
        }
        match word {
            "Use" => self.shared(at).map(Next::Done),
            "Def" => {
                let def = self.def(at)?;
                let inner = self.at;
                match self.word()? {
                    None => expected(inner, syntax::NODE),
                    Some("Def") => stop(inner, Problem::DefOf { found: "Def" }),
                    Some("Use") => {
                        let child = self.shared(inner)?;
                        self.mistake(inner, Problem::DefOf { found: "Use" });
                        self.end_def(Some(def), child).map(Next::Done)
                    }
                    Some(word) => self.kind(inner, word, Some(def)),
                }
            }
            _ => self.kind(at, word, None),
        }
    }

    /// What follows the name of a kind, up to its first field.
    fn kind(&mut self, at: usize, word: &'t str, def: Option<Def<'t>>) -> Step<Next> {
        let kind = self.registry.get(word);
        let index = self.open.last().map_or(0, |parent| parent.elements);
        self.open.push(Open {
            word,
            at,
            def,
            index,
            info: kind,
            node: None,
            known: kind.is_some(),
            sound: true,
            given: self.given.len(),
            children: self.children.len(),
            elements: 0,
        });
        let mut info = kind;
        if kind.is_none() {
            let near = self.registry.nearest(word).or_else(|| nearest(word, ["Def", "Use"].into_iter()));
            info = near.and_then(|kind| self.registry.get(kind));
            self.mistake(at, Problem::UnknownNode { found: word.to_owned(), nearest: near.map(str::to_owned) });
        }
        if let Some(open) = self.open.last_mut() {
            (open.info, open.node) = (info, info.map(|info| (info.make)()));
        }
        match scan::payload(self.text, self.at) {
            Payload::None => self.close(),
            Payload::Named => {
                self.eat(b'(')?;
                Ok(Next::Fields)
            }
            Payload::Unnamed => {
                if let Some(info) = info {
                    let problem = Problem::UnnamedFields { kind: info.kind.to_owned(), fields: field_names(info) };
                    self.mistake(at, problem);
                }
                self.any_value()?;
                self.close()
            }
        }
    }

    /// Fields up to the end of the node, or to the first node of its list.
    fn node_fields(&mut self) -> Step<Next> {
        while !self.eat(b')')? {
            let at = self.at;
            let word = self.field_name()?;
            let value = self.at;
            match self.target(at, word) {
                Target::Field(field) if self.is_first(field.name, at) => {
                    self.given.push(Given { field: field.name, at, value });
                    self.field(field)?;
                }
                Target::Children(name) if self.is_first(name, at) => {
                    self.given.push(Given { field: name, at, value });
                    if self.eat(b'[')? {
                        if !self.eat(b']')? {
                            return Ok(Next::Node);
                        }
                    } else {
                        self.any_value()?;
                        self.mistake(value, Problem::NotAList { field: name.to_owned() });
                    }
                }
                _ => drop(self.any_value()?),
            }
            self.comma(b')')?;
        }
        self.close()
    }

    /// What a word in the place of a field means.
    fn target(&mut self, at: usize, word: &'t str) -> Target {
        let Some(info) = self.open.last().and_then(|open| open.info) else {
            return if word == "children" { Target::Children("children") } else { Target::Nowhere };
        };
        let find = |name: &str| match info.children {
            Some(rule) if rule.field == name => Some(Target::Children(rule.field)),
            _ => info.field(name).map(Target::Field),
        };
        if let Some(target) = find(word) {
            return target;
        }
        self.unsound();
        if word == "children" && info.children.is_none() {
            self.mistake(at, Problem::NoChildren { kind: info.kind.to_owned() });
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
        self.mistake(at, problem);
        target
    }

    fn unsound(&mut self) {
        if let Some(open) = self.open.last_mut() {
            open.sound = false;
        }
    }

    /// The fields that were given in the node that is being read.
    fn own_fields(&self) -> &[Given] {
        self.open.last().and_then(|open| self.given.get(open.given..)).unwrap_or_default()
    }

    /// Whether a field stands here for the first time in its node; a mistake if not.
    fn is_first(&mut self, name: &'static str, at: usize) -> bool {
        let Some(first) = self.own_fields().iter().find(|given| given.field == name) else { return true };
        let first = self.places.position(first.at);
        self.mistake(at, Problem::DuplicateField { field: name.to_owned(), first });
        false
    }

    /// Reads the value that stands here into a field of the node.
    fn field(&mut self, field: &'static FieldInfo) -> Step<()> {
        let (text, at) = (self.text, self.at);
        let node = self.open.last_mut().and_then(|open| open.node.as_mut());
        let raw = scan::value_end(text, at).and_then(|end| text.get(at..end)).filter(|raw| !raw.starts_with('#'));
        if let (Some(node), Some(raw)) = (node, raw)
            && (field.read)(node.as_mut(), raw).is_ok()
        {
            self.at += raw.len();
            return Ok(());
        }
        // Something is wrong, or the end is not where it seems. A value that is none ends the reading here.
        let raw = self.any_value()?;
        let Some(mut node) = self.open.last_mut().and_then(|open| open.node.take()) else { return Ok(()) };
        let read = |text: &str| (field.read)(node.as_mut(), text);
        let sound = self.value(field.name, field.type_name, at, raw, read).is_some();
        if let Some(open) = self.open.last_mut() {
            open.node = Some(node);
            open.sound &= sound;
        }
        Ok(())
    }

    /// Puts a node that is finished into the scene.
    fn close(&mut self) -> Step<Next> {
        // Whoever closes a node has opened it.
        let Some(open) = self.open.last_mut() else { return Ok(Next::Done(None)) };
        let (at, sound, known, takes_children) =
            (open.at, open.sound, open.known, open.info.is_some_and(|info| info.children.is_some()));
        let (own_fields, own_children) = (open.given, open.children);
        let node = open.node.take().filter(|_| known);
        let child = node.map(|node| {
            // Values that could not be read would be complained about again.
            for problem in if sound { node.problems() } else { Vec::new() } {
                let place = self.own_fields().iter().find(|given| given.field == problem.field);
                let place = place.map_or(at, |given| given.value);
                self.mistake(place, Problem::Field { field: problem.field, message: problem.message });
            }
            let key = self.scene.insert_of(self.file, node);
            self.scene.set_position(key, self.places.position(at));
            // A node that can not have children was told so once, not for each child.
            let list = if takes_children { own_children } else { self.children.len() };
            for place in list..self.children.len() {
                let Some(&child) = self.children.get(place) else { break };
                if let Err(error) = self.scene.add_child(key, child.key) {
                    self.mistake(child.at, Problem::Child(error));
                }
            }
            if let Some((field, problem)) = missing_file(self.scene, key) {
                let place = self.own_fields().iter().find(|given| given.field == field);
                self.mistake(place.map_or(at, |given| given.value), problem);
            }
            for (parameter, FieldProblem { field, message }) in unknown_parameters(self.scene, key) {
                let place = self.fields.iter().rev().find(|(known, _)| *known == (parameter, field));
                let place = place.map_or_else(|| self.places.position(at), |&(_, position)| position);
                self.mistake_at(place, Problem::Field { field, message });
            }
            let places = &self.places;
            let own = self.given.get(own_fields..).unwrap_or_default();
            self.fields.extend(own.iter().map(|given| ((key, given.field), places.position(given.value))));
            Child { key, at }
        });
        self.given.truncate(own_fields);
        self.children.truncate(own_children);
        let def = self.open.pop().and_then(|open| open.def);
        self.end_def(def, child).map(Next::Done)
    }

    /// `("name",` after `Def`.
    fn def(&mut self, word: usize) -> Step<Def<'t>> {
        if !self.eat(b'(')? {
            return expected(self.at, syntax::DEF);
        }
        if self.peek() == Some(b')') {
            return expected(word, syntax::DEF);
        }
        let at = self.at;
        let name = self.name("Def")?;
        if !self.eat(b',')? {
            return expected(if self.peek() == Some(b')') { word } else { self.at }, syntax::DEF);
        }
        if self.peek() == Some(b')') {
            return expected(word, syntax::DEF);
        }
        let mut fresh = false;
        if let Some(name) = &name {
            match self.names.get(name) {
                Some(defined) => {
                    let first = self.places.position(defined.at);
                    self.mistake(at, Problem::DuplicateDef { name: name.to_string(), first });
                }
                None => {
                    self.names.insert(name.clone(), Defined { at, key: None, open: true });
                    fresh = true;
                }
            }
        }
        Ok(Def { name, fresh })
    }

    /// What closes a Def, if there is one around the node.
    fn end_def(&mut self, def: Option<Def<'t>>, child: Option<Child>) -> Step<Option<Child>> {
        let Some(def) = def else { return Ok(child) };
        self.eat(b',')?;
        if !self.eat(b')')? {
            return expected(self.at, syntax::DEF);
        }
        if let Some(name) = def.name.filter(|_| def.fresh)
            && let Some(defined) = self.names.get_mut(&name)
        {
            (defined.open, defined.key) = (false, child.map(|child| child.key));
            if let Some(child) = child {
                // The name was checked; only a Use in the place of the node has one already, which is a mistake by itself.
                let _ = self.scene.set_name(child.key, name);
            }
        }
        Ok(child)
    }

    /// `("name")` after `Use`.
    fn shared(&mut self, word: usize) -> Step<Option<Child>> {
        if !self.eat(b'(')? {
            return expected(self.at, syntax::USE);
        }
        if self.peek() == Some(b')') {
            return expected(word, syntax::USE);
        }
        let name = self.name("Use")?;
        self.eat(b',')?;
        if !self.eat(b')')? {
            return expected(self.at, syntax::USE);
        }
        let Some(name) = name else { return Ok(None) };
        match self.names.get(&name) {
            Some(Defined { open: true, .. }) => {
                self.mistake(word, Problem::SelfUse { name: name.into_owned() });
                Ok(None)
            }
            Some(defined) => Ok(defined.key.map(|key| Child { key, at: word })),
            None => {
                self.early.push(Early { name, at: word, path: self.path() });
                Ok(None)
            }
        }
    }

    /// A name in a Def or Use; `None` and a mistake if it is none.
    fn name(&mut self, word: &'static str) -> Step<Option<Cow<'t, str>>> {
        let at = self.at;
        if let Some(name) = scan::quoted(self.text, at) {
            self.at += name.len() + 2;
            self.blank()?;
            return Ok(Some(Cow::Borrowed(name)));
        }
        let name = String::read(self.any_value()?).ok();
        if name.is_none() {
            self.mistake(at, Problem::Name { word });
        }
        Ok(name.map(Cow::Owned))
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

/// The fields of a kind as they may be written, its list of children included.
fn field_names(info: &NodeInfo) -> Vec<&'static str> {
    info.fields.iter().map(|f| f.name).chain(info.children.map(|rule| rule.field)).collect()
}

/// Why the file that a node names can not be had, as far as can be told without opening it, and the field that names it.
fn missing_file(scene: &Scene, key: NodeKey) -> Option<(&'static str, Problem)> {
    scene.file(key)?;
    if let Some((_, ShaderSource::File(name))) = active_stage(scene, key) {
        let path = scene.resolve(key, name);
        let error = std::fs::metadata(&path).err()?;
        return Some(("source_program", Problem::Shape(TextError::of(&path, error).into())));
    }
    if let Some(font) = scene.get::<Font>(key) {
        let path = font.file(scene, key)?;
        let error = std::fs::metadata(&path).err()?;
        return Some(("name", Problem::Shape(FontError::of(&path, error).into())));
    }
    let filename = &scene.get::<Texture2>(key)?.filename;
    if filename.is_empty() {
        return None;
    }
    let path = scene.resolve(key, filename);
    let error = std::fs::metadata(&path).err()?;
    let error = match error.kind() {
        std::io::ErrorKind::NotFound => ImageError::Missing { path },
        _ => ImageError::Unreadable { path, error: error.into() },
    };
    Some(("filename", Problem::Image(error)))
}
