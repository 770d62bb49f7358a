//! Everything that can be said of a scene file without drawing it.

use std::collections::{HashMap, HashSet};
use std::path::Path as FilePath;
use std::sync::Arc;

use super::error::{Mistake, Problem, ReadError};
use super::read::read_file;
use crate::action::walk::{Go, Visitor, walk};
use crate::action::{ActionError, Branches, ShapeContext, ShapeError, State};
use crate::node::{Font, Registry, ShapeNode, Texture2};
use crate::scene::{NodeKey, Path, Position, Scene};

/// Most occurrences of nodes that are looked at: shared groups in shared groups can have more than could ever be walked.
const MOST: usize = 1_000_000;

/// Reads a scene and looks for all that its actions would stumble over: every image is decoded, every font is read,
/// and every shape is asked for its bounds. Returns the number of nodes.
///
/// # Errors
///
/// As for [`read_scene`](super::read_scene): the first mistake of syntax, or all mistakes of meaning. Those that can only be
/// seen in a graph without mistakes come when the others are gone.
pub fn check(path: impl AsRef<FilePath>, registry: &Registry) -> Result<usize, ReadError> {
    let path = path.as_ref();
    let read = read_file(path, registry)?;
    let fields = read.fields.iter().copied().collect();
    let mut check = Check { scene: &read.scene, fields, mistakes: Vec::new(), seen: HashSet::new(), left: MOST };
    if let Err(error) = walk(&read.scene, Branches::Possible, &mut check) {
        let problem = Problem::Shape(ShapeError::Other(error.to_string()));
        let file = Some(path.to_owned());
        check.mistakes.push((0, Mistake { file, position: None, problem, path_in_tree: Vec::new() }));
    }
    let mut mistakes = check.mistakes;
    if mistakes.is_empty() {
        return Ok(read.scene.len());
    }
    mistakes.sort_by_key(|(file, mistake)| (*file, mistake.position));
    let mistakes = mistakes.into_iter().map(|(_, mistake)| mistake).collect();
    Err(ReadError::Mistakes { path: Some(path.to_owned()), mistakes })
}

struct Check<'r> {
    scene: &'r Scene,
    fields: HashMap<(NodeKey, &'static str), Position>,
    /// With the numbers of their files.
    mistakes: Vec<(usize, Mistake)>,
    /// What was complained about, by the node at fault.
    seen: HashSet<(NodeKey, String)>,
    left: usize,
}

impl Check<'_> {
    /// Notes a problem of a node, or of one of its fields, once however often the node occurs.
    fn mistake(&mut self, key: NodeKey, field: Option<&'static str>, problem: Problem, path: &Path) {
        if self.seen.insert((key, problem.to_string())) {
            let position = field.and_then(|field| self.fields.get(&(key, field)).copied());
            let position = position.or_else(|| self.scene.position(key));
            let file = self.scene.file(key).map(FilePath::to_owned);
            let mistake = Mistake { file, position, problem, path_in_tree: path.names(self.scene) };
            self.mistakes.push((self.scene.file_number(key).unwrap_or(0), mistake));
        }
    }
}

impl Visitor for Check<'_> {
    fn enter(&mut self, path: &Path, _: &Arc<State>) -> Result<Go, ActionError> {
        let scene = self.scene;
        if let Some(key) = path.tail()
            && let Some(texture) = scene.get::<Texture2>(key)
            && !texture.filename.is_empty()
            && let Err(error) = scene.resources().image(&scene.resolve(key, &texture.filename))
        {
            self.mistake(key, Some("filename"), Problem::Image(error), path);
        }
        if let Some(key) = path.tail()
            && let Some(file) = scene.get::<Font>(key).and_then(|font| font.file(scene, key))
            && let Err(error) = scene.resources().typeface(Some(&file))
        {
            self.mistake(key, Some("name"), Problem::Shape(error.into()), path);
        }
        self.left -= 1;
        Ok(if self.left == 0 { Go::End } else { Go::On })
    }

    fn shape(&mut self, shape: &dyn ShapeNode, path: &Path, state: &Arc<State>) -> Result<Go, ActionError> {
        let cx = ShapeContext::new(self.scene, state, path);
        match (shape.bounds(&cx), path.tail()) {
            (Err(ShapeError::Image(_)), _) => {} // told at its texture
            (Err(error @ ShapeError::HeightField(_)), Some(key)) => {
                let texture = state.texture(state.program.height_unit).map(|texture| texture.node);
                let (key, field) = texture.map_or((key, None), |texture| (texture, Some("filename")));
                self.mistake(key, field, Problem::Shape(error), path);
            }
            (Err(error), Some(key)) => self.mistake(key, None, Problem::Shape(error), path),
            _ => {}
        }
        Ok(Go::On)
    }
}
