//! The kinds of node that users of Open Inventor look for, under the names that they know, and what each says of itself.

use seamount::format::plain;
use seamount::node::Registry;

/// By family, as in the documentation. A kind that is added is added here.
const KINDS: [(&str, &str); 3] = [
    ("group", "Group Separator TransformSeparator Switch Lod LevelOfDetail Array MultipleCopy File"),
    (
        "property",
        "Transform Translation Rotation RotationXyz Scale MatrixTransform ResetTransform Units PerspectiveCamera \
         OrthographicCamera FrustumCamera DirectionalLight PointLight SpotLight Environment LightModel Material BaseColor DrawStyle \
         ShapeHints Complexity PickStyle ClipPlane PolygonOffset Texture2 Texture2Transform TextureUnit \
         TextureCoordinate2 Coordinate3 Normal NormalBinding VertexProperty MaterialBinding Callback EventCallback Info Label ShaderProgram \
         VertexShader FragmentShader ShaderParameter Font",
    ),
    (
        "shape",
        "IndexedFaceSet FaceSet TriangleStripSet IndexedTriangleStripSet QuadMesh LineSet IndexedLineSet PointSet Cube \
         Sphere Cone Cylinder Text2 SeamlessTerrain",
    ),
];

#[test]
fn every_kind_is_known_in_its_family_and_has_an_example() {
    let registry = Registry::default();
    for (family, kinds) in KINDS {
        for kind in kinds.split_whitespace() {
            let info = registry.get(kind).unwrap_or_else(|| panic!("there is no {kind}"));
            assert_eq!(info.family, family, "{kind}");
            assert!(plain(info.doc).contains(&format!("{kind}(")), "{kind} has no example");
        }
    }
}
