//! Reading: from files and texts to scenes.

use std::path::Path;

use super::error::{Mistake, ReadError};
use super::files::{self, decode};
use super::reader::{FieldPosition, Reader};
use crate::node::Registry;
use crate::scene::Scene;

/// Reads the scene in a file, with the nodes of this crate.
///
/// Image files that the scene names have to exist; they are decoded when an action needs them. Scene files that it shows by
/// [`File`](crate::node::File) nodes are read with it.
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

/// The scene in a text. File names in it are not looked at: there is no folder that they are relative to. Say what it is by
/// [`Scene::set_source`], and read the scene files that are named by [`load_files`](super::load_files).
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
    pub(super) fields: Vec<FieldPosition>,
}

pub(super) fn read_file(path: &Path, registry: &Registry) -> Result<Read, ReadError> {
    let bytes = std::fs::read(path).map_err(|error| match error.kind() {
        std::io::ErrorKind::NotFound => ReadError::Missing { path: path.to_owned() },
        _ => ReadError::Unreadable { path: path.to_owned(), error },
    })?;
    let mistakes = |mistakes: Vec<Mistake>| {
        let in_file = |mistake: Mistake| Mistake { file: mistake.file.or_else(|| Some(path.to_owned())), ..mistake };
        ReadError::Mistakes { path: Some(path.to_owned()), mistakes: mistakes.into_iter().map(in_file).collect() }
    };
    let text = decode(&bytes).map_err(|mistake| mistakes(vec![*mistake]))?;
    let mut scene = Scene::new();
    scene.set_source(path);
    let mut read = read_text(text, registry, scene).map_err(mistakes)?;
    files::load(&mut read.scene, registry, &mut read.fields).map_err(mistakes)?;
    Ok(read)
}

fn read_text(text: &str, registry: &Registry, mut scene: Scene) -> Result<Read, Vec<Mistake>> {
    let empty = scene.root();
    let (root, fields) = Reader::new(text, registry, &mut scene, 0).read()?;
    // Both keys are of this scene: these edits can not fail.
    if scene.set_root(root).is_ok() && empty != root {
        let _ = scene.remove(empty);
    }
    Ok(Read { scene, fields })
}
