//! Shaders of a scene's own: what is declared for them, the bytes of their parameters, and where their mistakes stand.

use std::ops::Range;

use wgpu::naga;

use super::RenderError;
use super::shader::Variant;
use crate::action::{Draw, DrawProgram, Frame, ProgramCode, ShaderText, function_in};
use crate::node::{Numbers, Stage};
use crate::scene::Position;

/// Whether a variant has parameters that are numbers.
pub(super) fn has_values(variant: &Variant) -> bool {
    variant.program.as_ref().is_some_and(|program| !program.values.is_empty())
}

/// The shader of a draw: our part, what is declared for the scene's own shaders, and these as they were written.
struct Parts<'p> {
    text: String,
    declared: Range<usize>,
    written: Vec<(Range<usize>, &'p ShaderText)>,
}

impl<'p> Parts<'p> {
    fn new(variant: &'p Variant) -> Result<Self, RenderError> {
        let mut text = variant.own_text()?;
        let start = text.len();
        let Some(program) = &variant.program else {
            return Ok(Self { text, declared: start..start, written: Vec::new() });
        };
        text.push_str(&declarations(program));
        let declared = start..text.len();
        let mut written = Vec::new();
        for own in &program.texts {
            let start = text.len();
            text.push_str(&own.text);
            written.push((start..text.len(), own));
            text.push('\n');
        }
        Ok(Self { text, declared, written })
    }

    /// The error for a mistake with these places in the text, the first of which counts.
    fn error(&self, message: String, places: impl Iterator<Item = Range<usize>> + Clone) -> RenderError {
        let inside = |range: &Range<usize>, place: &Range<usize>| range.contains(&place.start) || *range == *place;
        let first = places.clone().next().unwrap_or_default();
        let word = |place: &Range<usize>| self.text.get(place.clone()).unwrap_or_default();
        if inside(&self.declared, &first) {
            let message = format!("the parameter `{}` can not have this name: {message}", word(&first));
            return RenderError::Parameter { message };
        }
        let find = |place: &Range<usize>| self.written.iter().find(|(range, _)| inside(range, place));
        if let Some((range, text)) = find(&first) {
            // The same word where it was before: among ours.
            let taken = message.starts_with("redefinition") && places.clone().any(|place| find(&place).is_none());
            let message = if taken { format!("{message}: the name is taken, choose another") } else { message };
            return mistake(text, first.start - range.start, message);
        }
        // Where we call a function that is not as it has to be.
        let line = self.text.get(..first.start).and_then(|before| before.rfind('\n')).map_or(0, |at| at + 1);
        let line = self.text.get(line..).and_then(|rest| rest.lines().next()).unwrap_or_default();
        for stage in [Stage::Vertex, Stage::Fragment] {
            let name = stage.function();
            let define = |text: &&(Range<usize>, &'p ShaderText)| function_in(&text.1.text, name).is_some();
            if let Some((_, text)) = self.written.iter().find(define)
                && line.contains(name)
            {
                let message = format!("the function has to be `fn {}`: {message}", stage.signature());
                return mistake(text, function_in(&text.text, name).unwrap_or(0), message);
            }
        }
        match self.written.first() {
            Some((_, text)) => mistake(text, 0, message),
            None => RenderError::Shader(message),
        }
    }
}

/// A mistake at an offset of a text.
fn mistake(text: &ShaderText, offset: usize, message: String) -> RenderError {
    let before = text.text.get(..offset).unwrap_or(&text.text);
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
    RenderError::UserShader { origin: text.origin.clone(), at: Position { line, column }, message }
}

/// What is declared for the parameters of a program.
fn declarations(program: &ProgramCode) -> String {
    let mut text = String::new();
    if !program.values.is_empty() {
        text.push_str("struct Parameters {\n");
        for (name, wgsl) in &program.values {
            text.push_str(&format!("    {name}: {wgsl},\n"));
        }
        text.push_str("}\n@group(2) @binding(0) var<uniform> parameters: Parameters;\n");
    }
    for (place, name) in program.textures.iter().enumerate() {
        let binding = super::bindings::Slot::Parameter(place as u16).binding();
        text.push_str(&format!("@group(1) @binding({binding}) var {name}: texture_2d<f32>;\n"));
        text.push_str(&format!("@group(1) @binding({}) var {name}_sampler: sampler;\n", binding + 1));
    }
    text
}

/// The whole WGSL of a variant.
pub(super) fn whole_text(variant: &Variant) -> Result<String, RenderError> {
    Ok(Parts::new(variant)?.text)
}

/// The whole WGSL of a variant. If shaders of the scene's own are in it, it was looked through for mistakes, which the device
/// would report at places of the whole.
pub(super) fn checked_text(variant: &Variant) -> Result<String, RenderError> {
    let parts = Parts::new(variant)?;
    if variant.program.is_none() {
        return Ok(parts.text);
    }
    let range = |span: naga::Span| span.to_range();
    let module = naga::front::wgsl::parse_str(&parts.text).map_err(|error| {
        let mut message = error.message().to_owned();
        error.notes().for_each(|note| message.push_str(&format!(" ({note})")));
        let places: Vec<_> = error.labels().filter_map(|(span, _)| range(span)).collect();
        parts.error(message, places.into_iter())
    })?;
    let mut validator =
        naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::all());
    validator.validate(&module).map_err(|error| {
        let mut message = error.as_inner().to_string();
        let mut cause: Option<&dyn std::error::Error> = std::error::Error::source(error.as_inner());
        while let Some(error) = cause {
            message.push_str(&format!(": {error}"));
            cause = error.source();
        }
        // From the mistake out to the function around it.
        let mut places: Vec<_> = error.spans().filter_map(|(span, _)| range(*span)).collect();
        places.sort_by_key(Range::len);
        parts.error(message, places.into_iter())
    })?;
    Ok(parts.text)
}

/// Appends the values of a program as `struct Parameters` has them.
pub(super) fn write_values(program: &DrawProgram, out: &mut Vec<u8>) -> u64 {
    let start = out.len();
    for value in program.values.iter() {
        let Some(Numbers { columns, rows, words, .. }) = value.numbers() else { continue };
        // WGSL, section 14.4.1: a vector of three is aligned like one of four.
        let alignment = if rows == 3 { 16 } else { 4 * rows };
        for column in words.iter().take(columns) {
            out.resize(start + (out.len() - start).next_multiple_of(alignment), 0);
            column.iter().take(rows).for_each(|word| out.extend_from_slice(&word.to_ne_bytes()));
        }
        if columns > 1 {
            // All columns of a matrix are as long as their alignment.
            out.resize(start + (out.len() - start).next_multiple_of(alignment), 0);
        }
    }
    out.resize(start + (out.len() - start).next_multiple_of(16), 0);
    (out.len() - start) as u64
}

/// Looks for mistakes in the shaders of a scene's own without drawing, and without a device.
///
/// # Errors
///
/// [`RenderError::UserShader`] and [`RenderError::Parameter`].
///
/// # Example
///
/// ```
/// use seamount::prelude::*;
/// use seamount::render::check_shaders;
///
/// let mut scene = Scene::new();
/// let root = scene.root();
/// scene.add(root, PerspectiveCamera::default())?;
/// let program = scene.add(root, ShaderProgram::default())?;
/// let text = "fn fragment_shader(fragment: Fragment) -> vec3f {\n    return vec3f(read);\n}";
/// let source_program = ShaderSource::Wgsl(text.to_owned());
/// scene.add(program, FragmentShader { source_program, ..FragmentShader::default() })?;
/// scene.add(root, Cube::default())?;
/// let frame = RenderAction::new(64, 64).apply(&scene)?;
/// let error = check_shaders(&frame).unwrap_err().to_string();
/// assert!(error.contains("line 2, column 18: no definition in scope for identifier: `read`"), "{error}");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn check_shaders(frame: &Frame) -> Result<(), RenderError> {
    let mut checked: Vec<Variant> = Vec::new();
    for draw in frame.draws.iter().filter(|draw| draw.program.is_some()) {
        let variant = Variant::of(draw, wgpu::TextureFormat::Rgba8UnormSrgb)?;
        if !checked.contains(&variant) {
            checked_text(&variant)?;
            checked.push(variant);
        }
    }
    Ok(())
}

/// The whole WGSL that a draw is drawn with into a target of this format, with the scene's own shaders; for tests and reports.
///
/// # Errors
///
/// [`RenderError::Effects`] when the effects contradict each other or the rest of the draw. Mistakes in the scene's own shaders
/// are for [`check_shaders`].
///
/// # Example
///
/// ```
/// use seamount::prelude::*;
/// use seamount::render::draw_text;
///
/// let mut scene = Scene::new();
/// let root = scene.root();
/// scene.add(root, PerspectiveCamera::default())?;
/// scene.add(root, Cube::default())?;
/// let frame = RenderAction::new(64, 64).apply(&scene)?;
/// assert!(draw_text(&frame.draws[0], wgpu::TextureFormat::Rgba8UnormSrgb)?.contains("fn fragment_main"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn draw_text(draw: &Draw, format: wgpu::TextureFormat) -> Result<String, RenderError> {
    whole_text(&Variant::of(draw, format)?)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::action::ShaderUses;
    use crate::node::ShaderValue as V;

    /// The bytes are where WGSL's compiler looks for them: each kind of value after each other kind.
    #[test]
    fn values_lie_where_the_shader_reads_them() {
        let column = |k: usize| [1.0, 2.0, 3.0, 4.0].map(|x: f32| x + 10.0 * k as f32);
        let two = |k| [column(k)[0], column(k)[1]];
        let three = |k| [column(k)[0], column(k)[1], column(k)[2]];
        let kinds = [
            V::Float(1.5),
            V::Vec2(1.0, 2.0),
            V::Vec3(1.0, 2.0, 3.0),
            V::Vec4(1.0, 2.0, 3.0, 4.0),
            V::Color(0.0, 0.5, 1.0),
            V::Int(-7),
            V::IVec2(-1, 2),
            V::IVec3(-1, 2, 3),
            V::IVec4(-1, 2, 3, 4),
            V::Uint(7),
            V::UVec2(1, 2),
            V::UVec3(1, 2, 3),
            V::UVec4(1, 2, 3, 4),
            V::Mat2(two(0), two(1)),
            V::Mat2x3(three(0), three(1)),
            V::Mat2x4(column(0), column(1)),
            V::Mat3x2(two(0), two(1), two(2)),
            V::Mat3(three(0), three(1), three(2)),
            V::Mat3x4(column(0), column(1), column(2)),
            V::Mat4x2(two(0), two(1), two(2), two(3)),
            V::Mat4x3(three(0), three(1), three(2), three(3)),
            V::Mat4(column(0), column(1), column(2), column(3)),
        ];
        for first in kinds {
            for second in kinds {
                let values = [first, second, V::Float(9.0)];
                let named = |(k, v): (usize, &V)| Some((format!("p{k}"), v.wgsl_type()?));
                let code = Arc::new(ProgramCode {
                    texts: Vec::new(),
                    values: values.iter().enumerate().filter_map(named).collect(),
                    textures: Vec::new(),
                    uses: ShaderUses::default(),
                });
                let module = naga::front::wgsl::parse_str(&declarations(&code)).unwrap();
                let program = DrawProgram {
                    code,
                    values: values.into(),
                    textures: Vec::new(),
                    local_from_rel: Default::default(),
                    clip_from_local: Default::default(),
                    eye_from_local: Default::default(),
                };
                let mut bytes = vec![0xff; 5];
                let size = write_values(&program, &mut bytes);
                let bytes = &bytes[5..];
                assert_eq!(size as usize, bytes.len());
                let (_, parameters) =
                    module.types.iter().find(|(_, t)| t.name.as_deref() == Some("Parameters")).unwrap();
                let naga::TypeInner::Struct { members, span } = &parameters.inner else { panic!() };
                assert!(*span as usize <= bytes.len());
                for (member, value) in members.iter().zip(values) {
                    let numbers = value.numbers().unwrap();
                    let naga_size = module.types[member.ty].inner.size(module.to_ctx()) as usize;
                    let stride = if numbers.columns > 1 { naga_size / numbers.columns } else { 0 };
                    for (c, column) in numbers.words.iter().take(numbers.columns).enumerate() {
                        for (r, word) in column.iter().take(numbers.rows).enumerate() {
                            let at = member.offset as usize + c * stride + 4 * r;
                            assert_eq!(bytes[at..at + 4], word.to_ne_bytes(), "{first:?}, {second:?}: {member:?}");
                        }
                    }
                }
            }
        }
    }
}
