use serde::{Deserialize, Serialize};

use super::{ChildRule, FieldProblem, FieldValue, PropertyNode, nearest};
use crate::action::{PropertyContext, State};

/// The value of a [`ShaderParameter`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum ShaderValue {
    /// The number of a texture unit.
    Texture(u32),
}

impl FieldValue for ShaderValue {
    fn type_name() -> String {
        "Texture(unit)".to_owned()
    }
}

crate::define_node! {
    /// A named value for the shader it belongs to.
    ///
    /// The built-in program knows `height_map` (in the vertex shader, unit 0 unless said otherwise) and `color_map` (in
    /// the fragment shader, unit 1): the texture units that carry heights and colours.
    ///
    /// ```ron
    /// ShaderParameter(name: "color_map", value: Texture(1))
    /// ```
    pub struct ShaderParameter: property {
        /// Name, as the shader knows it.
        pub name: String = String::new(),
        /// Value.
        pub value: ShaderValue = ShaderValue::Texture(0),
    }
    check ShaderParameter::check;
}

/// The parameters of the built-in program.
const KNOWN: [&str; 2] = ["height_map", "color_map"];

impl ShaderParameter {
    fn check(&self) -> Vec<FieldProblem> {
        if KNOWN.contains(&self.name.as_str()) {
            return Vec::new();
        }
        let known = "the built-in program knows height_map and color_map";
        let message = match nearest(&self.name, KNOWN.into_iter()) {
            Some(near) => format!("\"{}\" is unknown, did you mean \"{near}\"? {known}", self.name),
            None => format!("\"{}\" is unknown: {known}", self.name),
        };
        vec![FieldProblem::new("name", message)]
    }
}

impl PropertyNode for ShaderParameter {
    // Read by the program that contains it; by itself it does nothing.
    fn apply(&self, _: &mut State, _: &PropertyContext<'_>) {}
}

const PARAMETERS: ChildRule = ChildRule { field: "parameter", only: Some(&["ShaderParameter"]) };

crate::define_node! {
    /// The vertex stage of a [`ShaderProgram`]; here the built-in one with its parameters.
    ///
    /// ```ron
    /// VertexShader(is_active: false)
    /// ```
    pub struct VertexShader: property(PARAMETERS) {
        /// Whether its parameters count.
        pub is_active: bool = true,
    }
}

crate::define_node! {
    /// The fragment stage of a [`ShaderProgram`]; here the built-in one with its parameters.
    ///
    /// ```ron
    /// FragmentShader(is_active: false)
    /// ```
    pub struct FragmentShader: property(PARAMETERS) {
        /// Whether its parameters count.
        pub is_active: bool = true,
    }
}

impl PropertyNode for VertexShader {
    fn apply(&self, _: &mut State, _: &PropertyContext<'_>) {}
}

impl PropertyNode for FragmentShader {
    fn apply(&self, _: &mut State, _: &PropertyContext<'_>) {}
}

crate::define_node! {
    /// The program that draws what follows: which texture unit carries what.
    ///
    /// Without one, unit 0 carries heights and unit 1 colours. Read by all actions, since heights decide bounds and picks.
    ///
    /// ```ron
    /// ShaderProgram(shader_object: [VertexShader()])
    /// ```
    pub struct ShaderProgram: property(ChildRule {
        field: "shader_object",
        only: Some(&["VertexShader", "FragmentShader"]),
    }) {}
}

impl PropertyNode for ShaderProgram {
    fn apply(&self, state: &mut State, cx: &PropertyContext<'_>) {
        let mut program = crate::action::Program::default();
        for &stage in cx.scene.children(cx.key) {
            let active = cx.scene.get::<VertexShader>(stage).is_some_and(|s| s.is_active)
                || cx.scene.get::<FragmentShader>(stage).is_some_and(|s| s.is_active);
            if !active {
                continue;
            }
            for &parameter in cx.scene.children(stage) {
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
