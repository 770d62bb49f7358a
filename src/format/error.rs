//! What can be wrong with a scene file.

use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::action::ShapeError;
use crate::output::OutputError;
use crate::scene::{EditError, ImageError, Position, TextError};

/// Why a scene could not be read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReadError {
    /// There is no such file.
    #[error("there is no file {path}: check the name and the folder", path = path.display())]
    Missing {
        /// The path that was tried.
        path: PathBuf,
    },
    /// The file could not be read.
    #[error("can not read {path}: {error}", path = path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        error: std::io::Error,
    },
    /// The file is not as it should be: the first mistake of syntax, or all mistakes of meaning. Printed one per line as
    /// `path:line:column: message`.
    #[error("{}", report(mistakes))]
    Mistakes {
        /// The file, if the text came from one. Mistakes may stand in others that it shows.
        path: Option<PathBuf>,
        /// What is wrong, file by file in the order of each. Never empty.
        mistakes: Vec<Mistake>,
    },
}

impl ReadError {
    /// The file, if the text came from one.
    #[must_use]
    pub fn path(&self) -> Option<&Path> {
        match self {
            ReadError::Missing { path } | ReadError::Unreadable { path, .. } => Some(path),
            ReadError::Mistakes { path, .. } => path.as_deref(),
        }
    }

    /// The mistakes in the text; empty when there was no text.
    #[must_use]
    pub fn mistakes(&self) -> &[Mistake] {
        match self {
            ReadError::Mistakes { mistakes, .. } => mistakes,
            _ => &[],
        }
    }
}

fn report(mistakes: &[Mistake]) -> String {
    mistakes.iter().map(Mistake::line).collect::<Vec<_>>().join("\n")
}

/// One thing that is wrong, and where.
#[derive(Debug, Clone)]
pub struct Mistake {
    /// The file, if the text came from one.
    pub file: Option<PathBuf>,
    /// Line and column; `None` only for what stands in no text.
    pub position: Option<Position>,
    /// What is wrong.
    pub problem: Problem,
    /// The node at fault from the root, of the file if it could not be read: its name where it has one, else kind and child index as `Separator[2]`. Empty
    /// outside of all nodes.
    pub path_in_tree: Vec<String>,
}

impl Mistake {
    /// The mistake as `path:line:column: message`, without what is not known.
    #[must_use]
    pub fn line(&self) -> String {
        let path = self.file.as_deref().map_or_else(String::new, |p| format!("{}:", p.display()));
        match self.position {
            Some(position) => format!("{path}{position}: {}", self.problem),
            None if path.is_empty() => self.problem.to_string(),
            None => format!("{path} {}", self.problem),
        }
    }
}

/// What can be wrong in a scene file.
#[derive(Debug, Clone, Error)]
#[non_exhaustive]
pub enum Problem {
    /// The text is not RON, or not a scene by its structure.
    #[error("{0}")]
    Syntax(String),
    /// The bytes are no text.
    #[error("the file is not UTF-8 text from here on (byte 0x{byte:02x}): save it as UTF-8")]
    NotUtf8 {
        /// The first byte that is wrong.
        byte: u8,
    },
    /// Nodes within nodes without end.
    #[error("nodes are nested deeper than {limit} levels: take some of the groups away", limit = super::MAX_NESTING)]
    TooDeep,
    /// The file starts with something else.
    #[error("a scene file starts with `Scene(version: 1, root: …)`, not with `{found}`")]
    NotAScene {
        /// What it starts with.
        found: String,
    },
    /// The file is of another version.
    #[error("this file is of version {found}, this program reads version {reads}", reads = super::VERSION)]
    Version {
        /// The file's version.
        found: u64,
    },
    /// There is no version.
    #[error("the scene has no version: write `Scene(version: {reads}, root: …)`", reads = super::VERSION)]
    NoVersion,
    /// There is no root.
    #[error("the scene has no root: write `Scene(version: 1, root: Separator(children: [ … ]))`")]
    NoRoot,
    /// No kind of node has this name.
    #[error("unknown node `{found}`{}", did_you_mean(nearest.as_deref(), '`'))]
    UnknownNode {
        /// The word.
        found: String,
        /// The kind most like it.
        nearest: Option<String>,
    },
    /// The node has no such field.
    #[error("{kind} has no field `{found}`{}; {}", did_you_mean(nearest.as_deref(), '`'), has_fields(kind, fields))]
    UnknownField {
        /// Kind of the node.
        kind: String,
        /// The word.
        found: String,
        /// The field most like it.
        nearest: Option<String>,
        /// The fields that it has.
        fields: Vec<&'static str>,
    },
    /// A field is given more than once.
    #[error("`{field}` is given twice, the first time at {first}: take one away")]
    DuplicateField {
        /// The field.
        field: String,
        /// Where it stood first.
        first: Position,
    },
    /// Values stand in a node without saying which field they are for.
    #[error("the fields of {kind} have to be named; {}", has_fields(kind, fields))]
    UnnamedFields {
        /// Kind of the node.
        kind: String,
        /// The fields that it has.
        fields: Vec<&'static str>,
    },
    /// A value is not of the field's type.
    #[error("`{field}` takes {takes}: {reason}")]
    WrongValue {
        /// The field.
        field: String,
        /// The type it takes.
        takes: String,
        /// What is wrong with the value.
        reason: String,
    },
    /// A number is NaN, infinite or too large.
    #[error(
        "`{field}`: {number} is not a finite number that fits: no field takes NaN, inf or numbers beyond its range"
    )]
    NotFinite {
        /// The field.
        field: String,
        /// The number as it stands in the text.
        number: String,
    },
    /// A value is of the right type and can not be used all the same.
    #[error("`{field}`: {message}")]
    Field {
        /// The field.
        field: &'static str,
        /// What is wrong and what would be right.
        message: String,
    },
    /// Only groups have children.
    #[error("{kind} can not have children, only groups can: put it into a Separator together with them")]
    NoChildren {
        /// Kind of the node.
        kind: String,
    },
    /// A child where it may not be.
    #[error(transparent)]
    Child(EditError),
    /// Something else than a list of nodes.
    #[error("`{field}` takes a list of nodes in brackets, as in `{field}: [ … ]`")]
    NotAList {
        /// The field.
        field: String,
    },
    /// A name that is no string.
    #[error("a name is a string in quotes, as in `{word}(\"name\"{})`", if *word == "Def" { ", Cube()" } else { "" })]
    Name {
        /// `Def` or `Use`.
        word: &'static str,
    },
    /// There is no node of this name.
    #[error("there is no Def(\"{name}\", …) for this Use{}", did_you_mean(nearest.as_deref(), '"'))]
    UnknownUse {
        /// The name.
        name: String,
        /// The name most like it.
        nearest: Option<String>,
    },
    /// The name is given later.
    #[error("Use(\"{name}\") stands before its Def, which comes at {definition}: put the Def at the first place")]
    EarlyUse {
        /// The name.
        name: String,
        /// Where the Def stands.
        definition: Position,
    },
    /// A group in itself.
    #[error("Use(\"{name}\") stands inside the definition of \"{name}\": a group can not contain itself")]
    SelfUse {
        /// The name.
        name: String,
    },
    /// Two nodes of one name.
    #[error(
        "the name \"{name}\" is taken by the node at {first}: names are given once, Use(\"{name}\") shares the node"
    )]
    DuplicateDef {
        /// The name.
        name: String,
        /// Where it was given first.
        first: Position,
    },
    /// `Def` of something that is not a new node.
    #[error("Def names a new node, and a node has one name: {found} can not stand here")]
    DefOf {
        /// `Def` or `Use`.
        found: &'static str,
    },
    /// An image is missing or broken.
    #[error(transparent)]
    Image(ImageError),
    /// A shape can not be had.
    #[error(transparent)]
    Shape(ShapeError),
    /// A file that is to be shown is missing or no text.
    #[error(transparent)]
    File(TextError),
    /// A file shows itself.
    #[error("a file can not be in itself: {}; take one of these Files away", chain_of(chain))]
    FileCycle {
        /// The files on the way, each of which names the next; the first is the last.
        chain: Vec<PathBuf>,
    },
}

fn chain_of(files: &[PathBuf]) -> String {
    files.iter().map(|file| file.display().to_string()).collect::<Vec<_>>().join(" names ")
}

fn did_you_mean(nearest: Option<&str>, quote: char) -> String {
    nearest.map_or_else(String::new, |n| format!(", did you mean {quote}{n}{quote}?"))
}

fn has_fields(kind: &str, fields: &[&str]) -> String {
    match fields {
        [] => format!("{kind} has no fields"),
        [one] => format!("{kind} has the field {one}"),
        [rest @ .., last] => format!("{kind} has the fields {} and {last}", rest.join(", ")),
    }
}

/// Why a scene could not be written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum WriteError {
    /// A texture shows an image that is in no file.
    #[error("{}: the texture's image is in memory: save it as a file and give its `filename`", path.join("/"))]
    ImageInMemory {
        /// The texture from the root.
        path: Vec<String>,
    },
    /// A field has a value that can not be read again, such as NaN.
    #[error("{}: `{field}` can not be written, its value {value} could not be read again", path.join("/"))]
    Value {
        /// The node from the root.
        path: Vec<String>,
        /// The field.
        field: &'static str,
        /// Its value as it would be written.
        value: String,
    },
    /// Nodes are nested deeper than files may be.
    #[error("nodes are nested deeper than the {limit} levels that can be read again", limit = super::MAX_NESTING)]
    TooDeep,
    /// The file could not be written.
    #[error(transparent)]
    Output(#[from] OutputError),
}
