use serde::{Deserialize, Serialize};

use super::{ChildRule, Color, FieldProblem, FieldValue, PropertyNode, nearest};
use crate::action::{Program, PropertyContext, State};
use crate::scene::{NodeKey, Scene};

/// Where the text of a shader comes from.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum ShaderSource {
    /// No text: the built-in shader.
    #[default]
    BuiltIn,
    /// A file of WGSL; its name is relative to the folder of the file in which it stands.
    File(String),
    /// The WGSL itself.
    Wgsl(String),
}

impl FieldValue for ShaderSource {
    fn type_name() -> String {
        "BuiltIn | File(\"name.wgsl\") | Wgsl(\"text\")".to_owned()
    }
}

/// The value of a [`ShaderParameter`]. Vectors are named as in GLSL, matrices `MatCxR` by columns and rows as in WGSL; they are
/// given column by column.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum ShaderValue {
    /// The number of a texture unit whose image has colours in sRGB: they are linear light in the shader, 8 bits each.
    Texture(u32),
    /// The number of a texture unit whose image has numbers: they come as they are, 8 bits each, 255 as 1.
    Data(u32),
    /// A colour in sRGB: `vec3f` in linear light.
    Color(f32, f32, f32),
    /// `f32`.
    Float(f32),
    /// `vec2f`.
    Vec2(f32, f32),
    /// `vec3f`.
    Vec3(f32, f32, f32),
    /// `vec4f`.
    Vec4(f32, f32, f32, f32),
    /// `i32`.
    Int(i32),
    /// `vec2i`.
    IVec2(i32, i32),
    /// `vec3i`.
    IVec3(i32, i32, i32),
    /// `vec4i`.
    IVec4(i32, i32, i32, i32),
    /// `u32`.
    Uint(u32),
    /// `vec2u`.
    UVec2(u32, u32),
    /// `vec3u`.
    UVec3(u32, u32, u32),
    /// `vec4u`.
    UVec4(u32, u32, u32, u32),
    /// `mat2x2f`.
    Mat2([f32; 2], [f32; 2]),
    /// `mat2x3f`.
    Mat2x3([f32; 3], [f32; 3]),
    /// `mat2x4f`.
    Mat2x4([f32; 4], [f32; 4]),
    /// `mat3x2f`.
    Mat3x2([f32; 2], [f32; 2], [f32; 2]),
    /// `mat3x3f`.
    Mat3([f32; 3], [f32; 3], [f32; 3]),
    /// `mat3x4f`.
    Mat3x4([f32; 4], [f32; 4], [f32; 4]),
    /// `mat4x2f`.
    Mat4x2([f32; 2], [f32; 2], [f32; 2], [f32; 2]),
    /// `mat4x3f`.
    Mat4x3([f32; 3], [f32; 3], [f32; 3], [f32; 3]),
    /// `mat4x4f`.
    Mat4([f32; 4], [f32; 4], [f32; 4], [f32; 4]),
}

/// A value of numbers as a shader has it: scalars and vectors are one column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Numbers {
    /// The type in WGSL.
    pub(crate) wgsl: &'static str,
    pub(crate) columns: usize,
    pub(crate) rows: usize,
    /// The bits, column by column.
    pub(crate) words: [[u32; 4]; 4],
}

impl Numbers {
    fn new<T: Copy, const R: usize>(wgsl: &'static str, columns: &[[T; R]], bits: fn(T) -> u32) -> Self {
        let mut words = [[0; 4]; 4];
        for (column, values) in words.iter_mut().zip(columns) {
            column.iter_mut().zip(values).for_each(|(word, &value)| *word = bits(value));
        }
        Self { wgsl, columns: columns.len(), rows: R, words }
    }
}

impl ShaderValue {
    /// The type of the value in WGSL; `None` for textures, which are a `texture_2d<f32>` and a `sampler`.
    ///
    /// ```
    /// use seamount::node::ShaderValue;
    ///
    /// assert_eq!(ShaderValue::Float(0.5).wgsl_type(), Some("f32"));
    /// assert_eq!(ShaderValue::Color(1.0, 0.0, 0.0).wgsl_type(), Some("vec3f"));
    /// assert_eq!(ShaderValue::Texture(1).wgsl_type(), None);
    /// ```
    #[must_use]
    pub fn wgsl_type(&self) -> Option<&'static str> {
        self.numbers().map(|numbers| numbers.wgsl)
    }

    /// The unit of a texture, and whether its image has colours.
    #[must_use]
    pub fn texture(&self) -> Option<(u32, bool)> {
        match *self {
            ShaderValue::Texture(unit) => Some((unit, true)),
            ShaderValue::Data(unit) => Some((unit, false)),
            _ => None,
        }
    }

    /// What it consists of; `None` for textures.
    pub(crate) fn numbers(&self) -> Option<Numbers> {
        use ShaderValue as V;
        fn f<const R: usize>(wgsl: &'static str, columns: &[[f32; R]]) -> Numbers {
            Numbers::new(wgsl, columns, f32::to_bits)
        }
        fn i<const R: usize>(wgsl: &'static str, column: [i32; R]) -> Numbers {
            Numbers::new(wgsl, &[column], i32::cast_unsigned)
        }
        fn u<const R: usize>(wgsl: &'static str, column: [u32; R]) -> Numbers {
            Numbers::new(wgsl, &[column], |word| word)
        }
        Some(match *self {
            V::Texture(_) | V::Data(_) => return None,
            V::Color(r, g, b) => f("vec3f", &[Color::new(r, g, b).linear().to_array()]),
            V::Float(x) => f("f32", &[[x]]),
            V::Vec2(x, y) => f("vec2f", &[[x, y]]),
            V::Vec3(x, y, z) => f("vec3f", &[[x, y, z]]),
            V::Vec4(x, y, z, w) => f("vec4f", &[[x, y, z, w]]),
            V::Int(x) => i("i32", [x]),
            V::IVec2(x, y) => i("vec2i", [x, y]),
            V::IVec3(x, y, z) => i("vec3i", [x, y, z]),
            V::IVec4(x, y, z, w) => i("vec4i", [x, y, z, w]),
            V::Uint(x) => u("u32", [x]),
            V::UVec2(x, y) => u("vec2u", [x, y]),
            V::UVec3(x, y, z) => u("vec3u", [x, y, z]),
            V::UVec4(x, y, z, w) => u("vec4u", [x, y, z, w]),
            V::Mat2(x, y) => f("mat2x2f", &[x, y]),
            V::Mat2x3(x, y) => f("mat2x3f", &[x, y]),
            V::Mat2x4(x, y) => f("mat2x4f", &[x, y]),
            V::Mat3x2(x, y, z) => f("mat3x2f", &[x, y, z]),
            V::Mat3(x, y, z) => f("mat3x3f", &[x, y, z]),
            V::Mat3x4(x, y, z) => f("mat3x4f", &[x, y, z]),
            V::Mat4x2(x, y, z, w) => f("mat4x2f", &[x, y, z, w]),
            V::Mat4x3(x, y, z, w) => f("mat4x3f", &[x, y, z, w]),
            V::Mat4(x, y, z, w) => f("mat4x4f", &[x, y, z, w]),
        })
    }
}

impl FieldValue for ShaderValue {
    fn type_name() -> String {
        "Texture(unit) | Data(unit) | Color(r, g, b) | Float(x) | Vec2(x, y) … Vec4 | Int(x) | IVec2 … IVec4 | Uint(x) | \
         UVec2 … UVec4 | Mat2((x, y), (x, y)) … Mat4 | Mat2x3 … Mat4x3"
            .to_owned()
    }

    fn is_finite(&self) -> bool {
        self.numbers().is_none_or(|numbers| {
            let floats = numbers.wgsl.ends_with('f') || numbers.wgsl == "f32";
            !floats || numbers.words.as_flattened().iter().all(|&word| f32::from_bits(word).is_finite())
        })
    }
}

/// The parameters of the built-in program.
const KNOWN: [&str; 2] = ["height_map", "color_map"];

crate::define_node! {
    /// A named value for the shader it belongs to.
    ///
    /// `height_map` (in the vertex shader, unit 0 unless said otherwise) and `color_map` (in the fragment shader, unit 1) are
    /// known to every program: the texture units that carry heights and colours. A shader with a text of its own may have more;
    /// names are given once in a program, or with the same value.
    ///
    /// The text calls a value `parameters.NAME`, of the WGSL type that is said with each kind of value. A texture is called
    /// `NAME`, of type `texture_2d<f32>`, with the sampler `NAME_sampler`, filtered as the Complexity says and wrapped as
    /// its Texture2 says. What the text does not mention is not in the shader. A changed value compiles nothing.
    ///
    /// ```ron
    /// ShaderProgram(shader_object: [FragmentShader(
    ///     source_program: Wgsl("fn fragment_shader(fragment: Fragment) -> vec3f { return lit(fragment, parameters.tint); }"),
    ///     parameter: [ShaderParameter(name: "tint", value: Color(0.4, 0.6, 0.3))],
    /// )])
    /// ```
    pub struct ShaderParameter: property {
        /// Name, as the shader knows it: letters, digits and underscores, the first no digit.
        pub name: String = String::new(),
        /// Value.
        pub value: ShaderValue = ShaderValue::Texture(0),
    }
    actions {
        Render: "gives its value to the shader";
        BoundingBox, RayPick, HandleEvent, Callback, PrimitiveCount:
            "take heights from the unit that `height_map` names";
    }
    check ShaderParameter::check;
}

impl ShaderParameter {
    fn check(&self) -> Vec<FieldProblem> {
        let mut problems = Vec::new();
        let word = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let named = self.name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
            && self.name.chars().all(word)
            && !self.name.starts_with("__")
            && self.name != "_";
        if !named {
            problems.push(FieldProblem::new(
                "name",
                format!(
                    "\"{}\" is no name for a shader: letters, digits and underscores, starting with a letter, as in \
                     \"snow_line\"",
                    self.name
                ),
            ));
        }
        if KNOWN.contains(&self.name.as_str()) && !matches!(self.value, ShaderValue::Texture(_)) {
            let message = format!("{} is the unit of a texture, as in `Texture(1)`", self.name);
            problems.push(FieldProblem::new("value", message));
        }
        problems
    }
}

impl PropertyNode for ShaderParameter {
    // Read by the program that contains it; by itself it does nothing.
    fn apply(&self, _: &mut State, _: &PropertyContext<'_>) {}
}

const PARAMETERS: ChildRule = ChildRule { field: "parameter", only: Some(&["ShaderParameter"]) };

crate::define_node! {
    /// The vertex stage of a [`ShaderProgram`]: moves the corners of shapes.
    ///
    /// A text of its own defines a function that is called for each corner and returns by what it is moved, in local coordinates:
    ///
    /// ```wgsl
    /// fn vertex_shader(vertex: Vertex) -> vec3f { return vec3f(0.0, 0.0, 100.0 * vertex.normal.z); }
    /// ```
    ///
    /// `vertex.position` is where the corner is without it, `vertex.normal` the unit normal there; both in local coordinates. Of
    /// terrains there are also `vertex.lattice`, column and row in the map, `vertex.uv`, from (0, 0) in the south-west to (1, 1),
    /// and the function that displaces them: `terrain_height(lattice: vec2f) -> f32`, the local z of the full-resolution surface
    /// at a column and row, whole or not. All these depend on the place alone, so that the patches of a terrain still meet.
    ///
    /// Light, maps, ramps and contour lines stay those of the shape that is not moved. Boxes, picks, culling and the choice of
    /// detail know nothing of vertex shaders: what is moved far may be missed by picks, or left out near the border of the
    /// picture; with `culling: false` a terrain is drawn all the same.
    ///
    /// See [`FragmentShader`] for what both have in common.
    ///
    /// ```ron
    /// ShaderProgram(shader_object: [VertexShader(
    ///     source_program: Wgsl("fn vertex_shader(vertex: Vertex) -> vec3f { return vec3f(0.0, 0.0, 0.5 * vertex.position.z); }"),
    /// )])
    /// ```
    pub struct VertexShader: property(PARAMETERS) {
        /// Whether its text and its parameters count.
        pub is_active: bool = true,
        /// Its text. Open Inventor has two fields for it, `sourceType` and `sourceProgram`.
        pub source_program: ShaderSource = ShaderSource::BuiltIn,
    }
    actions {
        Render: "moves the corners of what follows";
        BoundingBox, RayPick, HandleEvent, Callback, PrimitiveCount:
            "take heights from the unit that its parameters name";
    }
    check |shader: &VertexShader| check_source(&shader.source_program);
}

crate::define_node! {
    /// The fragment stage of a [`ShaderProgram`]: the colours of shapes.
    ///
    /// A text of its own defines a function that returns the colour of the surface, in linear light:
    ///
    /// ```wgsl
    /// fn fragment_shader(fragment: Fragment) -> vec3f { return lit(fragment, fragment.color); }
    /// ```
    ///
    /// `fragment.color` is what the maps, ramps and textures of the scene give; white where there are none.
    /// `lit(fragment, color: vec3f) -> vec3f` is the material in that colour in the light of the scene, or as it is where nothing
    /// is lit: the function above draws what is drawn without it. `fragment.position` and the unit normal `fragment.normal` are in
    /// local coordinates, the normal without the relief of a NormalMap or BumpMap. Of terrains there are also `fragment.lattice`,
    /// `fragment.uv` and `terrain_height`, as in a [`VertexShader`]. Contour lines, edges, fog and transparency are put over the
    /// result; colours for study are instead of it.
    ///
    /// The text may define functions, structures and constants beside; it can not start with `enable` or the like. Both stages'
    /// texts are in one module, and a text that both name is there once. What a text does not mention is neither computed nor bound: the
    /// members of `Vertex` and `Fragment` are those that stand after a full stop in the text of the stage. A mistake is an error of
    /// the renderer, with its line and column in the text, and nothing is drawn.
    ///
    /// ```ron
    /// ShaderProgram(shader_object: [FragmentShader(
    ///     source_program: Wgsl("fn fragment_shader(fragment: Fragment) -> vec3f { return fragment.normal * 0.5 + 0.5; }"),
    /// )])
    /// ```
    pub struct FragmentShader: property(PARAMETERS) {
        /// Whether its text and its parameters count.
        pub is_active: bool = true,
        /// Its text. Open Inventor has two fields for it, `sourceType` and `sourceProgram`.
        pub source_program: ShaderSource = ShaderSource::BuiltIn,
    }
    actions {
        Render: "colours what follows";
    }
    check |shader: &FragmentShader| check_source(&shader.source_program);
}

fn check_source(source: &ShaderSource) -> Vec<FieldProblem> {
    match source {
        ShaderSource::File(name) if name.is_empty() => {
            vec![FieldProblem::new("source_program", "the file has no name: `BuiltIn` is the shader without a text")]
        }
        _ => Vec::new(),
    }
}

impl PropertyNode for VertexShader {
    fn apply(&self, _: &mut State, _: &PropertyContext<'_>) {}
}

impl PropertyNode for FragmentShader {
    fn apply(&self, _: &mut State, _: &PropertyContext<'_>) {}
}

/// The two stages of a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stage {
    Vertex,
    Fragment,
}

impl Stage {
    /// The function that a text for the stage has to define.
    pub(crate) fn function(self) -> &'static str {
        match self {
            Stage::Vertex => "vertex_shader",
            Stage::Fragment => "fragment_shader",
        }
    }

    /// The function with its parameter and what it returns.
    pub(crate) fn signature(self) -> &'static str {
        match self {
            Stage::Vertex => "vertex_shader(vertex: Vertex) -> vec3f",
            Stage::Fragment => "fragment_shader(fragment: Fragment) -> vec3f",
        }
    }
}

/// The stage that a node is, and its text; `None` if it is none or not active.
pub(crate) fn active_stage(scene: &Scene, key: NodeKey) -> Option<(Stage, &ShaderSource)> {
    let vertex = scene.get::<VertexShader>(key).map(|s| (s.is_active, Stage::Vertex, &s.source_program));
    let fragment = || scene.get::<FragmentShader>(key).map(|s| (s.is_active, Stage::Fragment, &s.source_program));
    vertex.or_else(fragment).filter(|(active, ..)| *active).map(|(_, stage, source)| (stage, source))
}

/// What is wrong with the parameters of a stage: the built-in one knows two.
pub(crate) fn unknown_parameters(scene: &Scene, key: NodeKey) -> Vec<(NodeKey, FieldProblem)> {
    if !matches!(active_stage(scene, key), Some((_, ShaderSource::BuiltIn))) {
        return Vec::new();
    }
    let unknown = |&parameter: &NodeKey| {
        let name = scene.get::<ShaderParameter>(parameter)?.name.as_str();
        if KNOWN.contains(&name) {
            return None;
        }
        let known = "the built-in program knows height_map and color_map";
        let message = match nearest(name, KNOWN.into_iter()) {
            Some(near) => format!("\"{name}\" is unknown, did you mean \"{near}\"? {known}"),
            None => format!("\"{name}\" is unknown: {known}"),
        };
        Some((parameter, FieldProblem::new("name", message)))
    };
    scene.children(key).iter().filter_map(unknown).collect()
}

crate::define_node! {
    /// The program that draws what follows: which texture unit carries what, and shaders of the scene's own.
    ///
    /// Without one, unit 0 carries heights and unit 1 colours. Read by all actions, since heights decide bounds and picks; the
    /// texts of its shaders are read by the render action alone.
    ///
    /// ```ron
    /// ShaderProgram(shader_object: [VertexShader()])
    /// ```
    pub struct ShaderProgram: property(ChildRule {
        field: "shader_object",
        only: Some(&["VertexShader", "FragmentShader"]),
    }) {}
    actions {
        Render: "draws what follows with its shaders";
        BoundingBox, RayPick, HandleEvent, Callback, PrimitiveCount: "take heights from the unit that it names";
    }
}

impl PropertyNode for ShaderProgram {
    fn apply(&self, state: &mut State, cx: &PropertyContext<'_>) {
        let mut program = Program::default();
        for &key in cx.scene.children(cx.key) {
            let Some((_, source)) = active_stage(cx.scene, key) else { continue };
            if *source != ShaderSource::BuiltIn {
                program.own = Some((cx.key, cx.visit));
            }
            for &parameter in cx.scene.children(key) {
                if let Some(ShaderParameter { name, value: ShaderValue::Texture(unit) }) = cx.scene.get(parameter) {
                    match name.as_str() {
                        "height_map" => program.height_unit = *unit,
                        "color_map" => program.color_unit = *unit,
                        _ => {}
                    }
                }
            }
        }
        state.program = program;
    }
}
