//! Why an action could not answer.

use thiserror::Error;

use super::{CameraError, RayError, ShaderOrigin};
use crate::node::FieldProblem;
use crate::scene::{FontError, ImageError, NodeKey, NodePlace, Path, Scene, TextError};
use crate::terrain::{HeightFieldError, ResolutionsError};

/// Why a shape could not be had.
#[derive(Debug, Clone, Error)]
#[non_exhaustive]
pub enum ShapeError {
    /// An image is missing or broken.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// An image is no map of heights.
    #[error("{0}")]
    HeightField(#[from] HeightFieldError),
    /// The resolutions do not work.
    #[error(transparent)]
    Resolutions(#[from] ResolutionsError),
    /// A terrain stands where no texture unit carries heights.
    #[error(
        "there is no height map on texture unit {unit}: put `TextureUnit(unit: {unit})` and \
         `Texture2(filename: \"…\")` before the terrain"
    )]
    NoHeights {
        /// The unit that should carry heights.
        unit: u32,
    },
    /// A texture unit that is asked for is empty.
    #[error(
        "{what} is to be on texture unit {unit}, but there is nothing: put `TextureUnit(unit: {unit})` and \
         `Texture2(filename: \"…\")` before the shape"
    )]
    NoTexture {
        /// The unit.
        unit: u32,
        /// What it should carry.
        what: &'static str,
    },
    /// A font can not be had.
    #[error(transparent)]
    Font(#[from] FontError),
    /// The text of a shader can not be had.
    #[error(transparent)]
    Text(#[from] TextError),
    /// The text of a shader does not have the function that is called.
    #[error("{origin}: the text has no function `{}`: write `fn {signature} {{ … }}`", signature.split('(').next().unwrap_or_default())]
    NoFunction {
        /// Where the text stands.
        origin: ShaderOrigin,
        /// The function, from its name on.
        signature: &'static str,
    },
    /// A shader asks for a texture where there is none.
    #[error(
        "the shader's parameter {name} is to be on texture unit {unit}, but there is nothing: put `TextureUnit(unit: {unit})` \
         and `Texture2(filename: \"…\")` before the shape"
    )]
    NoParameter {
        /// The unit.
        unit: u32,
        /// Name of the parameter.
        name: String,
    },
    /// Two parameters of a program have one name.
    #[error("the program has two parameters of the name {name} with different values: give them once, or the same")]
    ParameterTwice {
        /// The name.
        name: String,
    },
    /// A File node does not show the file that it names.
    #[error("the file \"{name}\" is not loaded: call `format::load_files` after naming a file in code")]
    NotLoaded {
        /// Its name in the node.
        name: String,
    },
    /// The camera that a shape takes its detail from can not be had.
    #[error("lod_camera: {0}")]
    LodCamera(Box<ActionError>),
    /// A field has a value that can not be used.
    #[error("{field}: {message}")]
    Field {
        /// Name of the field.
        field: &'static str,
        /// What is wrong.
        message: String,
    },
    /// A GPU can not be told where the shape is.
    #[error(
        "its size or its distance from the eye is beyond what 32-bit floats can say (about 1e38): use smaller numbers in \
         the transforms before it and in its own fields"
    )]
    BeyondFloats,
    /// Anything else; for shapes defined elsewhere.
    #[error("{0}")]
    Other(String),
}

impl From<FieldProblem> for ShapeError {
    fn from(problem: FieldProblem) -> Self {
        ShapeError::Field { field: problem.field, message: problem.message }
    }
}

/// Why an action could not answer, and where in the scene the reason stands.
#[derive(Debug, Clone, Error)]
#[non_exhaustive]
pub enum ActionError {
    /// A shape could not be had.
    #[error("{place}: {error}")]
    Shape {
        /// What is wrong.
        error: ShapeError,
        /// The node at fault.
        place: Box<NodePlace>,
    },
    /// There is no camera to look through.
    #[error(
        "the scene has no camera: put a camera (PerspectiveCamera, OrthographicCamera, FrustumCamera) before the shapes, for example \
         `PerspectiveCamera()`, which sees all of the scene"
    )]
    NoCamera,
    /// No camera has the name asked for.
    #[error("there is no camera named \"{name}\"; {known}")]
    UnknownCamera {
        /// The name.
        name: String,
        /// What cameras there are.
        known: String,
    },
    /// The camera can not be used.
    #[error("{}: {error}", path.join("/"))]
    Camera {
        /// What is wrong.
        error: CameraError,
        /// The camera, from the root.
        path: Vec<String>,
    },
    /// The ray is none.
    #[error(transparent)]
    Ray(#[from] RayError),
    /// The picture has no pixels.
    #[error("a picture of {0} × {1} pixels can not be: both have to be at least 1")]
    Viewport(u32, u32),
    /// The radius of a pick is none.
    #[error("a pick radius of {0} pixels can not be: a number from 0 up")]
    Radius(f64),
    /// The graph is nested too deep to be walked.
    #[error("the scene is nested deeper than {limit} levels", limit = super::walk::MAX_DEPTH)]
    TooDeep,
    /// Shared nodes make more occurrences than can be walked.
    #[error(
        "the scene has more than {limit} occurrences of nodes: shared groups within shared groups multiply",
        limit = super::walk::MAX_VISITS
    )]
    TooLarge,
}

impl ActionError {
    pub(crate) fn shape(error: ShapeError, scene: &Scene, path: &Path, culprit: Option<NodeKey>) -> Self {
        let key = culprit.or_else(|| path.tail()).unwrap_or(scene.root());
        ActionError::Shape { error, place: Box::new(NodePlace::new(scene, key, path)) }
    }
}
