//! Which kinds of node a scene file may contain.

use std::collections::BTreeMap;

use super::{NodeInfo, NodeType};

/// The kinds of node that a reader knows, by name. The default has all of this crate.
///
/// # Example
///
/// ```
/// use seamount::node::Registry;
///
/// let registry = Registry::default();
/// assert!(registry.get("SeamlessTerrain").is_some());
/// assert_eq!(registry.nearest("Seperator"), Some("Separator"));
/// ```
#[derive(Debug, Clone)]
pub struct Registry {
    kinds: BTreeMap<&'static str, &'static NodeInfo>,
}

/// The one list of the nodes of this crate.
const BUILT_IN: &[&NodeInfo] = &[
    super::Array::INFO,
    super::Background::INFO,
    super::BaseColor::INFO,
    super::Callback::INFO,
    super::ClipPlane::INFO,
    super::ColorRamp::INFO,
    super::BumpMap::INFO,
    super::Complexity::INFO,
    super::Cone::INFO,
    super::ContourLines::INFO,
    super::Coordinate3::INFO,
    super::Cube::INFO,
    super::Cylinder::INFO,
    super::DetailTextures::INFO,
    super::DirectionalLight::INFO,
    super::DrawStyle::INFO,
    super::Environment::INFO,
    super::EventCallback::INFO,
    super::FaceSet::INFO,
    super::File::INFO,
    super::Font::INFO,
    super::FragmentShader::INFO,
    super::Group::INFO,
    super::IndexedFaceSet::INFO,
    super::IndexedLineSet::INFO,
    super::IndexedTriangleStripSet::INFO,
    super::Info::INFO,
    super::Label::INFO,
    super::LevelOfDetail::INFO,
    super::LightModel::INFO,
    super::LineSet::INFO,
    super::Lod::INFO,
    super::Material::INFO,
    super::MaterialBinding::INFO,
    super::MatrixTransform::INFO,
    super::MultipleCopy::INFO,
    super::Normal::INFO,
    super::NormalBinding::INFO,
    super::NormalMap::INFO,
    super::OrthographicCamera::INFO,
    super::FrustumCamera::INFO,
    super::PerspectiveCamera::INFO,
    super::PickStyle::INFO,
    super::PointLight::INFO,
    super::PointSet::INFO,
    super::PolygonOffset::INFO,
    super::QuadMesh::INFO,
    super::ResetTransform::INFO,
    super::Rotation::INFO,
    super::RotationXyz::INFO,
    super::Scale::INFO,
    super::SeamlessTerrain::INFO,
    super::Separator::INFO,
    super::ShaderParameter::INFO,
    super::ShaderProgram::INFO,
    super::ShapeHints::INFO,
    super::Sphere::INFO,
    super::SpotLight::INFO,
    super::Switch::INFO,
    super::Text2::INFO,
    super::Texture2::INFO,
    super::Texture2Transform::INFO,
    super::TextureCoordinate2::INFO,
    super::TextureUnit::INFO,
    super::Transform::INFO,
    super::TransformSeparator::INFO,
    super::Translation::INFO,
    super::TriangleStripSet::INFO,
    super::Units::INFO,
    super::VertexProperty::INFO,
    super::VertexShader::INFO,
];

impl Default for Registry {
    fn default() -> Self {
        Self { kinds: BUILT_IN.iter().map(|info| (info.kind, *info)).collect() }
    }
}

impl Registry {
    /// Adds a kind of node, or replaces the one of the same name.
    pub fn register<T: NodeType>(&mut self) {
        self.kinds.insert(T::INFO.kind, T::INFO);
    }

    /// The kind with this name.
    #[must_use]
    pub fn get(&self, kind: &str) -> Option<&'static NodeInfo> {
        self.kinds.get(kind).copied()
    }

    /// All kinds in alphabetical order.
    pub fn kinds(&self) -> impl Iterator<Item = &'static NodeInfo> + '_ {
        self.kinds.values().copied()
    }

    /// The known kind that looks most like a misspelt one, if any is near.
    #[must_use]
    pub fn nearest(&self, kind: &str) -> Option<&'static str> {
        nearest(kind, self.kinds.keys().copied())
    }
}

/// The candidate most like `word`, if it is near enough to be meant: at most a third of the letters differ.
pub(crate) fn nearest<'a>(word: &str, candidates: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let word = word.to_lowercase();
    candidates
        .map(|candidate| (strsim::damerau_levenshtein(&word, &candidate.to_lowercase()), candidate))
        .filter(|(distance, candidate)| *distance <= 1.max(candidate.len().max(word.len()) / 3))
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}
