//! Scene files: RON in and out, with the position of every mistake.
//!
//! # The language
//!
//! ```text
//! file  = Scene(version: 1, root: node)
//! node  = Kind(field: value, …, children: [node, …])      // Kind alone is Kind()
//!       | Def("name", Kind(…))                            // a node with a name
//!       | Use("name")                                     // the same node once more, after its Def
//! ```
//!
//! Kinds and their fields are those of a [`Registry`](crate::node::Registry); this module knows none of them by itself.
//! Children stand in the list that the kind names: `children` for groups, `shader_object` for a ShaderProgram,
//! `parameter` for its stages. Values are RON; `Some` may be left out. A comma may follow the last of a list. Comments are
//! `// …` and `/* … */`. A [`File`](crate::node::File) shows another scene file in place. A mistake of syntax ends the reading;
//! mistakes of meaning are collected, so that one reading tells all of them.
//!
//! # Example
//!
//! ```
//! use seamount::format;
//! use seamount::node::Registry;
//!
//! let text = r#"
//!     Scene(version: 1, root: Separator(children: [
//!         Def("box", Cube(width: 4.0)),
//!         Transform(translation: (10.0, 0.0, 0.0)),
//!         Use("box"),
//!     ]))
//! "#;
//! let scene = format::parse(text, &Registry::default())?;
//! assert_eq!(scene.len(), 3); // the cube is one node in two places
//! let again = format::parse(&format::write_scene(&scene)?, &Registry::default())?;
//! assert_eq!(again.len(), 3);
//!
//! let wrong = text.replace("Cube", "Cubs");
//! let error = format::parse(&wrong, &Registry::default()).unwrap_err();
//! assert_eq!(error.to_string(), "3:20: unknown node `Cubs`, did you mean `Cube`?");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing))]

mod check;
mod error;
mod files;
mod map;
mod read;
mod reader;
mod reference;
mod scan;
mod syntax;
mod text;
mod write;

pub use crate::output::{OutputError, check_target, write_file};
pub use check::check;
pub use error::{Mistake, Problem, ReadError, WriteError};
pub use files::load_files;
pub use map::{MapError, scene_of_map};
pub use read::{parse, read_scene, read_scene_with};
pub use reference::{describe, describe_node, plain};
pub use write::{save_scene, write_scene};

/// The version of the language that is read and written.
pub const VERSION: u32 = 1;

/// How deep nodes may be nested in a file; the root is at depth 1.
pub const MAX_NESTING: usize = 1000;
