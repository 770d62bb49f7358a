//! Shaders of a scene's own: their texts, what these mention, and what they are given.

use std::hash::{Hash, Hasher};
use std::path::PathBuf;
use std::sync::Arc;

use glam::{Mat3, Mat4};

use super::frame::ColorMap;
use super::{DrawContext, ShapeError};
use crate::node::{ShaderParameter, ShaderSource, ShaderValue, Stage, active_stage, unknown_parameters};
use crate::scene::{NodeKey, NodePlace, Scene};

/// What shaders of a scene's own there are, and what they look at. What they do not look at is not made for them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct ShaderUses {
    /// The vertex shader, if there is one.
    pub vertex: Option<VertexUses>,
    /// The fragment shader, if there is one.
    pub fragment: Option<FragmentUses>,
}

/// What a vertex shader looks at beside the position.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct VertexUses {
    /// The normal.
    pub normal: bool,
    /// Column and row.
    pub lattice: bool,
    /// Texture coordinates.
    pub uv: bool,
    /// Heights anywhere.
    pub height: bool,
}

/// What a fragment shader looks at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct FragmentUses {
    /// The colour that maps and ramps give.
    pub color: bool,
    /// The material in the light of the scene.
    pub lit: bool,
    /// The place.
    pub position: bool,
    /// The normal.
    pub normal: bool,
    /// Column and row.
    pub lattice: bool,
    /// Texture coordinates.
    pub uv: bool,
    /// Heights anywhere.
    pub height: bool,
}

/// Where the text of a shader stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ShaderOrigin {
    /// In a file of its own.
    File(PathBuf),
    /// In a field of a node.
    Node(Box<NodePlace>),
}

impl std::fmt::Display for ShaderOrigin {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            ShaderOrigin::File(path) => write!(f, "{}", path.display()),
            ShaderOrigin::Node(place) => place.fmt(f),
        }
    }
}

/// The text of a shader, as it was written.
#[derive(Debug, Clone)]
pub struct ShaderText {
    /// The WGSL.
    pub text: Arc<str>,
    /// Where it stands; for errors.
    pub origin: ShaderOrigin,
}

/// The texts of a program, and the names that are declared for them: all that is compiled. Two are equal if they compile to the
/// same, wherever they stand.
#[derive(Debug, Clone)]
pub struct ProgramCode {
    /// The texts, each of them once.
    pub texts: Vec<ShaderText>,
    /// Name and type of the values that they mention.
    pub values: Vec<(String, &'static str)>,
    /// Names of the textures that they mention.
    pub textures: Vec<String>,
    /// What they look at.
    pub uses: ShaderUses,
}

impl ProgramCode {
    fn key(&self) -> (impl Iterator<Item = &str>, &[(String, &'static str)], &[String], ShaderUses) {
        (self.texts.iter().map(|text| &*text.text), &self.values, &self.textures, self.uses)
    }
}

impl PartialEq for ProgramCode {
    fn eq(&self, other: &Self) -> bool {
        let ((texts, values, textures, uses), (t, v, x, u)) = (self.key(), other.key());
        texts.eq(t) && (values, textures, uses) == (v, x, u)
    }
}

impl Eq for ProgramCode {}

impl Hash for ProgramCode {
    fn hash<H: Hasher>(&self, state: &mut H) {
        let (texts, values, textures, uses) = self.key();
        // Each draw of each frame is looked up: the lengths tell nearly all texts apart, and the comparison the rest.
        texts.for_each(|text| text.len().hash(state));
        (values, textures, uses).hash(state);
    }
}

/// Shaders of a scene's own with what they are given for a draw.
#[derive(Debug, Clone)]
pub struct DrawProgram {
    /// What is compiled.
    pub code: Arc<ProgramCode>,
    /// The values of the code, in its order.
    pub values: Arc<[ShaderValue]>,
    /// The textures of the code, in its order, and whether their images have colours or numbers.
    pub textures: Vec<(ColorMap, bool)>,
    /// From the coordinates of the geometry to local ones.
    pub local_from_rel: Mat4,
    /// Takes ways in local coordinates to clip space.
    pub clip_from_local: Mat4,
    /// Takes ways in local coordinates to world axes.
    pub eye_from_local: Mat3,
}

/// What the shaders of a program depend on beside its node.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ProgramBasis {
    /// Of the node and all below it.
    version: Option<u64>,
    /// Of what was read from files.
    files: u64,
    /// The file that names of files are relative to.
    source: Option<PathBuf>,
    /// Where the program stands; for errors.
    path: Vec<String>,
}

/// A program as the scene has it, the same for all that is drawn with it.
#[derive(Debug)]
pub(crate) struct Program {
    pub(super) code: Arc<ProgramCode>,
    values: Arc<[ShaderValue]>,
    /// Unit of each texture, and whether its image has colours.
    textures: Vec<(u32, bool)>,
}

/// The programs of a walk that were met last, by the visit of their nodes: with both stages, and with the vertex stage alone.
#[derive(Debug, Default)]
pub(super) struct Programs {
    visit: u64,
    both: Option<Arc<Program>>,
    vertex: Option<Arc<Program>>,
}

impl DrawContext<'_> {
    /// The scene's own shaders; without that of fragments where colours for study are instead.
    pub(super) fn program(&mut self, fragments: bool) -> Result<Option<Arc<Program>>, ShapeError> {
        let Some((key, visit)) = self.shape.state.program.own else { return Ok(None) };
        if self.programs.visit != visit {
            *self.programs = Programs { visit, ..Programs::default() };
        }
        let known = if fragments { &mut self.programs.both } else { &mut self.programs.vertex };
        if known.is_none() {
            *known = Some(Program::of(self.shape.scene, key, fragments)?);
        }
        Ok(known.clone().filter(|program| program.code.uses != ShaderUses::default()))
    }

    /// The textures of a program.
    pub(super) fn program_textures(&self, program: &Program) -> Result<Vec<(ColorMap, bool)>, ShapeError> {
        let textures = program.textures.iter().zip(&program.code.textures);
        let texture = |(&(unit, colors), name): (&(u32, bool), &String)| {
            let wrap = self.shape.state.texture(unit).map(|texture| texture.wrap).unwrap_or_default();
            let map = self.color_map(unit)?.ok_or_else(|| ShapeError::NoParameter { unit, name: name.clone() })?;
            Ok((ColorMap { wrap, ..map }, colors))
        };
        textures.map(texture).collect()
    }
}

impl Program {
    /// As it was made for the last frame, if nothing has changed.
    fn of(scene: &Scene, key: NodeKey, fragments: bool) -> Result<Arc<Self>, ShapeError> {
        let basis = ProgramBasis {
            version: scene.subtree_version(key),
            files: scene.resources().version(),
            source: scene.source().map(ToOwned::to_owned),
            path: scene.some_path(key).names(scene),
        };
        scene.resources().program((key, fragments), basis, || Self::new(scene, key, fragments))
    }

    fn new(scene: &Scene, key: NodeKey, fragments: bool) -> Result<Self, ShapeError> {
        let mut texts: Vec<ShaderText> = Vec::new();
        let mut uses = ShaderUses::default();
        let mut parameters: Vec<&ShaderParameter> = Vec::new();
        for &child in scene.children(key) {
            let Some((stage, source)) = active_stage(scene, child) else { continue };
            let (text, origin) = match source {
                ShaderSource::BuiltIn => {
                    if let Some((_, problem)) = unknown_parameters(scene, child).into_iter().next() {
                        return Err(problem.into());
                    }
                    continue;
                }
                ShaderSource::File(name) => {
                    let path = scene.resolve(child, name);
                    (scene.resources().text(&path)?, ShaderOrigin::File(path))
                }
                ShaderSource::Wgsl(text) => {
                    let place = NodePlace::new(scene, child, &scene.some_path(child));
                    (text.as_str().into(), ShaderOrigin::Node(Box::new(place)))
                }
            };
            if stage == Stage::Fragment && !fragments {
                continue;
            }
            let words = Words::new(&text);
            if words.function(stage.function()).is_none() {
                return Err(ShapeError::NoFunction { origin, signature: stage.signature() });
            }
            match stage {
                Stage::Vertex => uses.vertex = Some(words.vertex_uses()),
                Stage::Fragment => uses.fragment = Some(words.fragment_uses()),
            }
            for parameter in scene.children(child).iter().filter_map(|&key| scene.get::<ShaderParameter>(key)) {
                match parameters.iter().find(|known| known.name == parameter.name) {
                    None => parameters.push(parameter),
                    Some(known) if known.value == parameter.value => {}
                    Some(_) => return Err(ShapeError::ParameterTwice { name: parameter.name.clone() }),
                }
            }
            if !texts.iter().any(|known| known.text == text) {
                texts.push(ShaderText { text, origin });
            }
        }
        let words: Vec<Words<'_>> = texts.iter().map(|text| Words::new(&text.text)).collect();
        let (mut values, mut textures) = (Vec::new(), Vec::new());
        let (mut given, mut units) = (Vec::new(), Vec::new());
        for ShaderParameter { name, value } in parameters {
            match (value.wgsl_type(), value.texture()) {
                (Some(wgsl), _) if words.iter().any(|words| words.has(&["parameters", ".", name])) => {
                    values.push((name.clone(), wgsl));
                    given.push(*value);
                }
                (_, Some(texture)) if words.iter().any(|words| words.has(&[name])) => {
                    textures.push(name.clone());
                    units.push(texture);
                }
                _ => {}
            }
        }
        drop(words);
        let code = Arc::new(ProgramCode { texts, values, textures, uses });
        Ok(Self { code, values: given.into(), textures: units })
    }

    /// The values of the code, in its order.
    pub(super) fn values(&self) -> Arc<[ShaderValue]> {
        Arc::clone(&self.values)
    }
}

/// The words and marks of a text in WGSL, without comments.
struct Words<'t>(Vec<&'t str>);

impl<'t> Words<'t> {
    fn new(text: &'t str) -> Self {
        let mut words = Vec::new();
        let mut rest = text;
        while let Some(first) = rest.chars().next() {
            let in_word = |c: char| c.is_alphanumeric() || c == '_';
            let length = if rest.starts_with("//") {
                // Line breaks of WGSL, section 3.2.
                rest.find(['\n', '\x0b', '\x0c', '\r', '\u{85}', '\u{2028}', '\u{2029}']).unwrap_or(rest.len())
            } else if rest.starts_with("/*") {
                block_comment(rest)
            } else if in_word(first) {
                rest.find(|c| !in_word(c)).unwrap_or(rest.len())
            } else {
                first.len_utf8()
            };
            let (word, after) = rest.split_at(length);
            if !(first.is_whitespace() || word.starts_with("//") || word.starts_with("/*")) {
                words.push(word);
            }
            rest = after;
        }
        Self(words)
    }

    /// Whether these words stand there one after the other.
    fn has(&self, sequence: &[&str]) -> bool {
        self.0.windows(sequence.len()).any(|words| words == sequence)
    }

    /// The words that the definition of a function starts with.
    fn function(&self, name: &str) -> Option<&'t str> {
        self.0.windows(2).find(|words| *words == ["fn", name]).and_then(|words| words.first().copied())
    }

    fn vertex_uses(&self) -> VertexUses {
        let member = |name| self.has(&[".", name]);
        VertexUses {
            normal: member("normal"),
            lattice: member("lattice"),
            uv: member("uv"),
            height: self.has(&["terrain_height", "("]),
        }
    }

    fn fragment_uses(&self) -> FragmentUses {
        let member = |name| self.has(&[".", name]);
        FragmentUses {
            color: member("color"),
            lit: self.has(&["lit", "("]),
            position: member("position"),
            normal: member("normal"),
            lattice: member("lattice"),
            uv: member("uv"),
            height: self.has(&["terrain_height", "("]),
        }
    }
}

/// Where a text defines a function, in bytes.
#[cfg(feature = "render")]
pub(crate) fn function_in(text: &str, name: &str) -> Option<usize> {
    // The words are slices of the text.
    Words::new(text).function(name).map(|word| word.as_ptr() as usize - text.as_ptr() as usize)
}

/// Length of the comment that a text starts with; they nest.
fn block_comment(text: &str) -> usize {
    let mut depth = 0;
    let mut at = 0;
    while let Some(next) = text.get(at..).and_then(|rest| rest.find(['*', '/'])) {
        at += next;
        match text.get(at..at + 2) {
            Some("/*") => depth += 1,
            Some("*/") => depth -= 1,
            _ => {
                at += 1;
                continue;
            }
        }
        at += 2;
        if depth == 0 {
            return at;
        }
    }
    text.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_those_outside_of_comments() {
        let words = Words::new("a.b /* c /* d */ .normal */ // lit(\n1.5f; é_2*x/y");
        assert_eq!(words.0, ["a", ".", "b", "1", ".", "5f", ";", "é_2", "*", "x", "/", "y"]);
        assert_eq!(words.fragment_uses(), FragmentUses::default());
        for open in ["/* a /* b */", "/", "/*", "/*/", "*/", "//"] {
            assert!(Words::new(open).0.len() <= 2, "{open}");
        }
        let uses = Words::new("lit (f, f . color) + terrain_height(f.uv)").fragment_uses();
        assert_eq!(uses, FragmentUses { lit: true, color: true, uv: true, height: true, ..Default::default() });
    }
}
