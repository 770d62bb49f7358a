use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

use super::{FieldProblem, List, PropertyNode, field::enum_field};
use crate::action::{Aspect, PropertyContext, State};

crate::define_node! {
    /// The points that the sets of faces, lines and points after it refer to, instead of those before.
    ///
    /// Boxes, picks, render, callbacks and counts use them through the shapes; on its own it is nothing to see.
    ///
    /// ```ron
    /// Coordinate3(point: [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
    /// ```
    pub struct Coordinate3: property {
        /// The points, in local coordinates of the shape that uses them.
        pub point: List<DVec3> = List::from([DVec3::ZERO]),
    }
    actions {
        Render, BoundingBox, RayPick, HandleEvent, Callback, PrimitiveCount:
            "take the points of sets of faces, lines and points from it";
    }
}

impl PropertyNode for Coordinate3 {
    fn apply(&self, state: &mut State, _: &PropertyContext<'_>) {
        state.coordinates = self.point.clone();
    }
}

crate::define_node! {
    /// The normals of the sets of faces after it, instead of those worked out from the faces.
    ///
    /// Read by picks, render and callbacks; [`NormalBinding`](crate::node::NormalBinding) says what they belong to. An
    /// empty list: worked out again.
    ///
    /// ```ron
    /// Normal(vector: [(0.0, 0.0, 1.0)])
    /// ```
    pub struct Normal: property {
        /// The normals, any length but zero, in local coordinates of the shape that uses them.
        pub vector: List<DVec3> = List::default(),
    }
    actions {
        Render: "lights sets of faces, lines and points by these normals";
        RayPick, HandleEvent, Callback: "say them with what is hit or handed out";
    }
    check |n: &Normal| {
        let zero = n.vector.iter().position(|v| *v == DVec3::ZERO);
        zero.map(|k| FieldProblem::new("vector", format!("normal number {k} has no length: it points nowhere")))
            .into_iter()
            .collect()
    };
}

impl PropertyNode for Normal {
    fn apply(&self, state: &mut State, _: &PropertyContext<'_>) {
        state.normals = self.vector.clone();
    }
}

/// What the normals or colours of a list belong to: the first to the first, the second to the second. With `Indexed` the shape's
/// list of indices says which.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum Binding {
    /// The first to all of the shape.
    Overall,
    /// One to each part: a strip, a row of quadrilaterals, a polygon.
    PerPart,
    /// One to each part, by index.
    PerPartIndexed,
    /// One to each face.
    PerFace,
    /// One to each face, by index.
    PerFaceIndexed,
    /// One to each corner of each face.
    PerVertex,
    /// One to each corner, by index; where the shape has no such indices, by those of the coordinates.
    #[default]
    PerVertexIndexed,
}

impl Binding {
    /// Whether it is one to each part, by index or not.
    #[must_use]
    pub fn is_per_part(self) -> bool {
        matches!(self, Self::PerPart | Self::PerPartIndexed)
    }

    /// Whether it is one to each face, by index or not.
    #[must_use]
    pub fn is_per_face(self) -> bool {
        matches!(self, Self::PerFace | Self::PerFaceIndexed)
    }

    /// Whether a list of indices says which.
    #[must_use]
    pub fn is_indexed(self) -> bool {
        matches!(self, Self::PerPartIndexed | Self::PerFaceIndexed | Self::PerVertexIndexed)
    }
}

enum_field!(Binding: Overall | PerPart | PerPartIndexed | PerFace | PerFaceIndexed | PerVertex | PerVertexIndexed);

crate::define_node! {
    /// What the normals of the sets of faces after it belong to.
    ///
    /// Read by picks, render and callbacks.
    ///
    /// ```ron
    /// NormalBinding(value: PerFace)
    /// ```
    pub struct NormalBinding: property {
        /// What each normal belongs to.
        pub value: Binding = Binding::PerVertexIndexed,
    }
    actions {
        Render: "lights sets of faces, lines and points by these normals";
        RayPick, HandleEvent, Callback: "say them with what is hit or handed out";
    }
}

impl PropertyNode for NormalBinding {
    fn apply(&self, state: &mut State, _: &PropertyContext<'_>) {
        state.normal_binding = self.value;
    }
}

crate::define_node! {
    /// The texture coordinates of the sets of faces after it, instead of those worked out from the shape's box: s along its longest
    /// side from 0 to 1, t along the second longest in the same scale.
    ///
    /// Read by render, picks and callbacks.
    ///
    /// ```ron
    /// TextureCoordinate2(point: [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
    /// ```
    pub struct TextureCoordinate2: property {
        /// The coordinates, (0, 0) at the lower left corner of the image and (1, 1) at the upper right.
        pub point: List<DVec2> = List::default(),
    }
    actions {
        Render: "lays textures over sets of faces by them";
        RayPick, HandleEvent: "say the texture coordinates of what was hit";
        Callback: "hands triangles out with them";
    }
}

impl PropertyNode for TextureCoordinate2 {
    fn apply(&self, state: &mut State, _: &PropertyContext<'_>) {
        state.texture_coordinates = self.point.clone();
    }
}

crate::define_node! {
    /// Points, normals, colours and texture coordinates in one node.
    ///
    /// In the `vertex_property` of a set of faces, lines or points it acts on that shape alone; as a child of a group on all that
    /// follow.
    /// Lists that are empty leave what was in force.
    ///
    /// ```ron
    /// FaceSet(vertex_property: [VertexProperty(vertex: [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])])
    /// ```
    pub struct VertexProperty: property {
        /// Points, as in Coordinate3.
        pub vertex: List<DVec3> = List::default(),
        /// Normals, as in Normal.
        pub normal: List<DVec3> = List::default(),
        /// Texture coordinates, as in TextureCoordinate2.
        pub tex_coord: List<DVec2> = List::default(),
        /// What each normal belongs to; counts where there are normals.
        pub normal_binding: Binding = Binding::PerVertexIndexed,
        /// Diffuse colours with their opacity instead of those of the Material: 0xRRGGBBAA, sRGB, `0xff0000ff` for red.
        pub ordered_rgba: List<u32> = List::default(),
        /// What each colour belongs to, as in MaterialBinding; counts where there are colours.
        pub material_binding: Binding = Binding::Overall,
    }
    actions {
        Render, BoundingBox, RayPick, HandleEvent, Callback, PrimitiveCount:
            "take points, normals, colours and texture coordinates of sets of faces, lines and points from it";
    }
}

impl PropertyNode for VertexProperty {
    fn apply(&self, state: &mut State, cx: &PropertyContext<'_>) {
        if !self.vertex.is_empty() {
            state.coordinates = self.vertex.clone();
        }
        if !self.normal.is_empty() {
            (state.normals, state.normal_binding) = (self.normal.clone(), self.normal_binding);
        }
        if !self.ordered_rgba.is_empty() {
            (state.packed_colors, state.material_binding) = (self.ordered_rgba.clone(), self.material_binding);
            state.credit(Aspect::Material, cx);
            state.credit(Aspect::MaterialBinding, cx);
        }
        if !self.tex_coord.is_empty() {
            state.texture_coordinates = self.tex_coord.clone();
        }
    }
}

/// How the corners of faces run around, seen from outside.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum VertexOrdering {
    /// Not known; taken as counter-clockwise.
    #[default]
    UnknownOrdering,
    /// Clockwise: normals that are worked out point to the other side.
    Clockwise,
    /// Counter-clockwise.
    Counterclockwise,
}

enum_field!(VertexOrdering: UnknownOrdering | Clockwise | Counterclockwise);

/// Whether faces enclose a volume.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum ShapeType {
    /// Not known.
    #[default]
    UnknownShapeType,
    /// They do: nobody sees them from behind, and they are not drawn from there.
    Solid,
}

enum_field!(ShapeType: UnknownShapeType | Solid);

/// Whether faces may have corners that point inwards.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum FaceType {
    /// They may: faces are cut into triangles one ear after the other.
    UnknownFaceType,
    /// They do not: faces are cut into a fan of triangles.
    #[default]
    Convex,
}

enum_field!(FaceType: UnknownFaceType | Convex);

crate::define_node! {
    /// What is known of the shapes after it.
    ///
    /// Read by picks, render and callbacks through the normals and triangles that are made of sets of faces, and by render
    /// for which sides are drawn: of sets of faces both, and light falls on the side that is seen, unless the ordering is known and
    /// the shape is `Solid`; then only the outer one, as in Open Inventor. So are cones and cylinders that a part is missing of. Other
    /// shapes, terrains among them, are drawn from outside alone, unless the ordering is known and the shape is not `Solid`. Picks
    /// meet both sides.
    ///
    /// ```ron
    /// ShapeHints(vertex_ordering: Counterclockwise, crease_angle: 0.5)
    /// ```
    pub struct ShapeHints: property {
        /// How the corners of faces run around, seen from outside.
        pub vertex_ordering: VertexOrdering = VertexOrdering::UnknownOrdering,
        /// Whether the faces enclose a volume, so that nobody sees their back.
        pub shape_type: ShapeType = ShapeType::UnknownShapeType,
        /// Whether faces may have corners that point inwards.
        pub face_type: FaceType = FaceType::Convex,
        /// Where faces meet at less than this angle in radians the edge is smooth, in normals that are worked out; 0: no edge
        /// is.
        pub crease_angle: f64 = 0.0,
    }
    actions {
        Render: "draws the sides of what follows that can be seen";
        RayPick, HandleEvent, Callback: "make triangles and normals of sets of faces by it";
    }
    check |h: &ShapeHints| {
        if (0.0..=std::f64::consts::PI).contains(&h.crease_angle) {
            Vec::new()
        } else {
            let message = format!("{} is out of range: an angle in radians from 0 to π", h.crease_angle);
            vec![FieldProblem::new("crease_angle", message)]
        }
    };
}

impl PropertyNode for ShapeHints {
    fn apply(&self, state: &mut State, cx: &PropertyContext<'_>) {
        state.shape_hints = self.clone();
        state.credit(Aspect::ShapeHints, cx);
    }
}

impl ShapeHints {
    /// Whether both sides are seen of a shape: of one that does not say, and is taken to be seen from one or from both.
    pub(crate) fn both_sides(&self, otherwise: bool) -> bool {
        match (self.vertex_ordering, self.shape_type) {
            (VertexOrdering::UnknownOrdering, _) => otherwise,
            (_, shape_type) => shape_type == ShapeType::UnknownShapeType,
        }
    }
}
