//! Files within files: what File nodes show.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use super::error::{Mistake, Problem, ReadError};
use super::reader::{FieldPosition, Reader};
use super::text::Places;
use crate::node::{File, Registry};
use crate::scene::{NodeKey, Position, Scene, Shown, TextError, regular};

/// Reads the scene files that [`File`] nodes name and do not show yet: those made in code, or given another name.
///
/// Each file is read once however often it is named. What a File has shown and none shows any more is taken from the scene; when
/// it is named again, it is read again.
///
/// # Errors
///
/// [`ReadError::Mistakes`] when a file is missing, something is wrong in it or a file shows itself. All Files then show what they
/// did before.
///
/// # Example
///
/// ```
/// use seamount::node::Registry;
/// use seamount::prelude::*;
///
/// let folder = std::env::temp_dir().join("seamount_load_files");
/// std::fs::create_dir_all(&folder)?;
/// std::fs::write(folder.join("box.ron"), "Scene(version: 1, root: Cube(width: 4.0))")?;
///
/// let mut scene = Scene::new();
/// scene.set_source(folder.join("all.ron")); // names are relative to its folder
/// scene.add(scene.root(), File { name: "box.ron".into() })?;
/// seamount::format::load_files(&mut scene, &Registry::default())?;
/// let bounds = BoundingBoxAction::default().apply(&scene)?.expect("a cube");
/// assert_eq!(bounds.max.x, 2.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn load_files(scene: &mut Scene, registry: &Registry) -> Result<(), ReadError> {
    let path = scene.source().map(Path::to_owned);
    load(scene, registry, &mut Vec::new()).map_err(|mistakes| ReadError::Mistakes { path, mistakes })
}

/// [`load_files`] with the positions of fields: of those that are known, and then of those in the files too.
pub(super) fn load(
    scene: &mut Scene,
    registry: &Registry,
    fields: &mut Vec<FieldPosition>,
) -> Result<(), Vec<Mistake>> {
    // What was taken away since the last time is not to be found again.
    scene.remove_unshown_files();
    let mut pending = scene.stale_files();
    if pending.is_empty() {
        return Ok(());
    }
    pending.reverse();
    let own = scene.source().and_then(|path| path.canonicalize().ok());
    let first = scene.file_count();
    let mut loader = Loader {
        scene,
        registry,
        own,
        fields,
        positions: HashMap::new(),
        mistakes: Vec::new(),
        broken: HashSet::new(),
        before: Vec::new(),
    };
    loader.note_files(0);
    // Depth first: what a file names is shown before what stands after it, so that ways down to a node are always there to
    // tell a file that comes back to itself.
    while let Some(node) = pending.pop() {
        pending.extend(loader.show(node).into_iter().rev());
    }
    let Loader { scene, mut mistakes, before, .. } = loader;
    if mistakes.is_empty() {
        scene.remove_unshown_files();
        return Ok(());
    }
    for (node, shown) in before.into_iter().rev() {
        scene.show(node, shown);
    }
    scene.remove_files(first);
    mistakes.sort_by_key(|(file, mistake)| (*file, mistake.position));
    Err(mistakes.into_iter().map(|(_, mistake)| mistake).collect())
}

struct Loader<'r> {
    scene: &'r mut Scene,
    registry: &'r Registry,
    /// The scene's own file, without links.
    own: Option<PathBuf>,
    fields: &'r mut Vec<FieldPosition>,
    /// Where the names of files stand.
    positions: HashMap<NodeKey, Position>,
    /// With the numbers of their files.
    mistakes: Vec<(usize, Mistake)>,
    /// Files that could not be read: once is enough.
    broken: HashSet<PathBuf>,
    /// What Files showed before, in the order of the changes.
    before: Vec<(NodeKey, Shown)>,
}

impl Loader<'_> {
    /// Has a File node show what it names. Returns the File nodes in what was read for that.
    fn show(&mut self, node: NodeKey) -> Vec<NodeKey> {
        let Some(name) = self.scene.get::<File>(node).map(|file| file.name.clone()) else { return Vec::new() };
        if name.is_empty() {
            self.put(node, None);
            return Vec::new();
        }
        let path = self.scene.resolve(node, &name);
        let (canonical, bytes) = match self.find(node, &path) {
            Ok(Found::Known(root)) => {
                self.put(node, Some((root, name)));
                return Vec::new();
            }
            Ok(Found::Broken) => return Vec::new(),
            Ok(Found::New(canonical, bytes)) => (canonical, bytes),
            Err(problem) => {
                self.mistake(node, problem);
                return Vec::new();
            }
        };
        let file = self.scene.add_file(path.clone());
        let read = match decode(&bytes) {
            Ok(text) => Reader::new(text, self.registry, self.scene, file).read(),
            Err(mistake) => Err(vec![*mistake]),
        };
        match read {
            Ok((root, fields)) => {
                self.scene.set_root_of(canonical, root);
                self.put(node, Some((root, name)));
                let known = self.fields.len();
                self.fields.extend(fields);
                self.note_files(known)
            }
            Err(mistakes) => {
                self.broken.insert(canonical);
                let in_file = |mistake| (file, Mistake { file: Some(path.clone()), ..mistake });
                self.mistakes.extend(mistakes.into_iter().map(in_file));
                Vec::new()
            }
        }
    }

    /// The File nodes that have a name, by the fields from this one on, whose places are noted.
    fn note_files(&mut self, from: usize) -> Vec<NodeKey> {
        let mut files = Vec::new();
        for &((key, field), position) in self.fields.iter().skip(from) {
            if field == "name" && self.scene.get::<File>(key).is_some() {
                self.positions.insert(key, position);
                files.push(key);
            }
        }
        files
    }

    /// What there is at a path that a File node names.
    fn find(&self, node: NodeKey, path: &Path) -> Result<Found, Problem> {
        let refused = |error| Problem::File(TextError::of(path, error));
        let canonical = path.canonicalize().map_err(refused)?;
        let known = match self.own.as_ref() == Some(&canonical) {
            true => Some(self.scene.root()),
            false => self.scene.root_of(&canonical),
        };
        if let Some(root) = known {
            let cycle = self.scene.files_between(root, node);
            // The scene's own file contains itself even before the File stands below its root.
            let cycle = cycle.or_else(|| (root == self.scene.root()).then(|| vec![canonical]));
            return match cycle {
                Some(mut chain) => {
                    chain.extend(chain.first().cloned());
                    Err(Problem::FileCycle { chain })
                }
                None => Ok(Found::Known(root)),
            };
        }
        if self.broken.contains(&canonical) {
            return Ok(Found::Broken);
        }
        let bytes = regular(path).and_then(std::fs::read).map_err(refused)?;
        Ok(Found::New(canonical, bytes))
    }

    fn put(&mut self, node: NodeKey, what: Shown) {
        let before = self.scene.show(node, what);
        self.before.push((node, before));
    }

    /// Notes what is wrong with the file that a node names.
    fn mistake(&mut self, node: NodeKey, problem: Problem) {
        let mistake = Mistake {
            file: self.scene.file(node).map(Path::to_owned),
            position: self.positions.get(&node).copied().or_else(|| self.scene.position(node)),
            problem,
            path_in_tree: self.scene.some_path(node).names(self.scene),
        };
        self.mistakes.push((self.scene.file_number(node).unwrap_or(0), mistake));
    }
}

/// What a File node names.
enum Found {
    /// A file whose nodes are there; its root.
    Known(NodeKey),
    /// A file that could not be read.
    Broken,
    /// A file that is to be read: its path without links, and what is in it.
    New(PathBuf, Vec<u8>),
}

/// The text in a file, without a byte order mark.
pub(super) fn decode(bytes: &[u8]) -> Result<&str, Box<Mistake>> {
    let text = match std::str::from_utf8(bytes) {
        Ok(text) => text,
        Err(error) => {
            let (good, bad) = bytes.split_at(error.valid_up_to());
            let good = std::str::from_utf8(good).unwrap_or_default();
            let problem = Problem::NotUtf8 { byte: bad.first().copied().unwrap_or_default() };
            let position = Some(Places::new(good).position(good.len()));
            return Err(Box::new(Mistake { file: None, position, problem, path_in_tree: Vec::new() }));
        }
    };
    Ok(text.strip_prefix('\u{feff}').unwrap_or(text))
}
