use std::sync::Arc;

use super::face_mesh::{Builder, Corner, FaceMesh};
use super::{Binding, ChildRule, List, ShapeHit, ShapeNode, Triangle};
use crate::action::{Aabb, DrawContext, Ray, ShapeContext, ShapeError};

/// The list of a shape's own VertexProperty.
pub(super) const VERTEX_PROPERTY: ChildRule = ChildRule { field: "vertex_property", only: Some(&["VertexProperty"]) };

/// The shape's answers, all from its mesh.
macro_rules! mesh_shape {
    ($($name:ident)*) => {$(
        impl ShapeNode for $name {
            fn bounds(&self, cx: &ShapeContext<'_>) -> Result<Option<Aabb>, ShapeError> {
                Ok(self.mesh(cx)?.bounds())
            }

            fn primitives(&self, cx: &ShapeContext<'_>, sink: &mut dyn FnMut(Triangle)) -> Result<(), ShapeError> {
                self.mesh(cx)?.primitives(sink);
                Ok(())
            }

            fn ray(
                &self,
                cx: &ShapeContext<'_>,
                ray: &Ray,
                first: bool,
                hits: &mut Vec<ShapeHit>,
            ) -> Result<(), ShapeError> {
                self.mesh(cx)?.ray(ray, first, hits);
                Ok(())
            }

            fn draw(&self, cx: &mut DrawContext<'_>) -> Result<(), ShapeError> {
                self.mesh(&cx.shape)?.draw(cx)
            }
        }

        impl $name {
            fn mesh(&self, cx: &ShapeContext<'_>) -> Result<Arc<FaceMesh>, ShapeError> {
                FaceMesh::of(cx, |builder| self.build(cx, builder))
            }
        }
    )*};
}

mesh_shape!(IndexedFaceSet FaceSet IndexedTriangleStripSet TriangleStripSet QuadMesh);

/// Whether a list of indices is given: Open Inventor writes [-1] for none.
pub(super) fn given(indices: &[i32]) -> bool {
    !matches!(indices, [] | [-1])
}

/// The runs of corners between −1s, each with the place of its first corner in the list.
pub(super) fn runs(indices: &[i32]) -> impl Iterator<Item = (usize, &[i32])> {
    let mut start = 0;
    indices.split(|&k| k < 0).filter_map(move |run| {
        let at = start;
        start += run.len() + 1;
        (!run.is_empty()).then_some((at, run))
    })
}

/// Indices that the lists of an indexed set give to its corners.
struct Indices<'a> {
    normal_index: &'a [i32],
    texture_coord_index: &'a [i32],
    binding: Binding,
}

impl Indices<'_> {
    fn of(list: &[i32], k: usize, otherwise: i64) -> i64 {
        match given(list) {
            // Beyond the end of the list: no index.
            true => list.get(k).map_or(-1, |&index| i64::from(index)),
            false => otherwise,
        }
    }

    /// Corner number `k` of the list of indices, `running` without the −1s.
    fn corner(&self, k: usize, running: usize, point: i32) -> Corner {
        let point = i64::from(point);
        let normal = match self.binding {
            Binding::PerVertex => running as i64,
            _ => Self::of(self.normal_index, k, point),
        };
        Corner { point, normal, texture: Self::of(self.texture_coord_index, k, point) }
    }

    /// The normal of a face, or of its part.
    fn whole(&self, face: usize, part: usize) -> i64 {
        match self.binding {
            Binding::PerFace => face as i64,
            Binding::PerPart => part as i64,
            Binding::PerFaceIndexed => Self::of(self.normal_index, face, face as i64),
            _ => Self::of(self.normal_index, part, part as i64),
        }
    }
}

crate::define_node! {
    /// Polygons whose corners are indices into the coordinates.
    ///
    /// Boxed, drawn and picked as the triangles that its faces are cut into; a pick tells face, indices of the triangle's
    /// corners and weights. The tree of boxes that makes picks quick is made at the first pick and kept while coordinates,
    /// hints and the node stay the same. An index that leads nowhere is an error.
    ///
    /// ```ron
    /// Coordinate3(point: [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)]),
    /// IndexedFaceSet(coord_index: [0, 1, 2, 3, -1]),
    /// ```
    pub struct IndexedFaceSet: shape(VERTEX_PROPERTY) {
        /// The corners of each polygon as indices into the coordinates, −1 after each. Faces of fewer than three corners are
        /// left out.
        pub coord_index: List<i32> = List::from([0]),
        /// Indices of the normals, in the same places as `coord_index`, or one per face, as the NormalBinding says; [-1]:
        /// the same as `coord_index`.
        pub normal_index: List<i32> = List::from([-1]),
        /// Indices of the texture coordinates, in the same places as `coord_index`; [-1]: the same.
        pub texture_coord_index: List<i32> = List::from([-1]),
    }
}

impl IndexedFaceSet {
    fn build(&self, _: &ShapeContext<'_>, builder: &mut Builder<'_>) -> Result<(), ShapeError> {
        let indices = Indices {
            normal_index: &self.normal_index,
            texture_coord_index: &self.texture_coord_index,
            binding: builder.binding(),
        };
        let mut running = 0;
        let mut corners = Vec::new();
        for (face, (at, run)) in runs(&self.coord_index).enumerate() {
            corners.clear();
            corners.extend(run.iter().enumerate().map(|(k, &point)| indices.corner(at + k, running + k, point)));
            running += run.len();
            if corners.len() >= 3 {
                builder.face("coord_index", face, face, indices.whole(face, face), &corners)?;
            }
        }
        Ok(())
    }
}

crate::define_node! {
    /// Strips of triangles whose corners are indices into the coordinates.
    ///
    /// Triangle k of a strip has the corners k, k + 1 and k + 2; every second one is turned over, so that all look the same
    /// way. Boxed, drawn and picked as [`IndexedFaceSet`].
    ///
    /// ```ron
    /// IndexedTriangleStripSet(coord_index: [0, 1, 2, 3, -1])
    /// ```
    pub struct IndexedTriangleStripSet: shape(VERTEX_PROPERTY) {
        /// The corners of each strip as indices into the coordinates, −1 after each.
        pub coord_index: List<i32> = List::from([0]),
        /// Indices of the normals, in the same places as `coord_index`, or one per face or strip, as the NormalBinding says;
        /// [-1]: the same as `coord_index`.
        pub normal_index: List<i32> = List::from([-1]),
        /// Indices of the texture coordinates, in the same places as `coord_index`; [-1]: the same.
        pub texture_coord_index: List<i32> = List::from([-1]),
    }
}

/// Adds the triangles of a strip; returns the number of the next face.
fn strip(
    builder: &mut Builder<'_>,
    field: &'static str,
    corners: &[Corner],
    first_face: usize,
    part: usize,
    normal: impl Fn(usize) -> i64,
) -> Result<usize, ShapeError> {
    let mut face = first_face;
    for (k, triangle) in corners.windows(3).enumerate() {
        if let [a, b, c] = *triangle {
            let turned = if k % 2 == 0 { [a, b, c] } else { [b, a, c] };
            builder.face(field, face, part, normal(face), &turned)?;
            face += 1;
        }
    }
    Ok(face)
}

impl IndexedTriangleStripSet {
    fn build(&self, _: &ShapeContext<'_>, builder: &mut Builder<'_>) -> Result<(), ShapeError> {
        let indices = Indices {
            normal_index: &self.normal_index,
            texture_coord_index: &self.texture_coord_index,
            binding: builder.binding(),
        };
        let (mut running, mut face) = (0, 0);
        for (part, (at, run)) in runs(&self.coord_index).enumerate() {
            let corners: Vec<Corner> =
                run.iter().enumerate().map(|(k, &point)| indices.corner(at + k, running + k, point)).collect();
            running += run.len();
            face = strip(builder, "coord_index", &corners, face, part, |face| indices.whole(face, part))?;
        }
        Ok(())
    }
}

/// The corner of a set without indices: everything per vertex has the number of the point.
fn plain(k: usize) -> Corner {
    let k = k as i64;
    Corner { point: k, normal: k, texture: k }
}

/// The runs of points that numbers of vertices in a field say, from a first one on; −1: all that are left.
pub(super) fn stretches(
    start: i32,
    counts: &[i32],
    counts_in: &'static str,
    points: usize,
) -> Result<Vec<std::ops::Range<usize>>, ShapeError> {
    let field = |field, message: String| ShapeError::Field { field, message };
    let mut at = usize::try_from(start)
        .map_err(|_| field("start_index", format!("{start} is no index: points are counted from 0")))?;
    let mut found = Vec::with_capacity(counts.len());
    for &count in counts {
        let end = match usize::try_from(count) {
            Ok(count) => at.saturating_add(count),
            Err(_) if count == -1 => points.max(at),
            Err(_) => {
                return Err(field(
                    counts_in,
                    format!("{count} is no number of vertices: from 0 up, or -1 for the rest"),
                ));
            }
        };
        found.push(at..end);
        at = end;
    }
    Ok(found)
}

/// The normal of a face, or of its part, in a set without indices.
fn whole(binding: Binding, face: usize, part: usize) -> i64 {
    match binding {
        Binding::PerFace | Binding::PerFaceIndexed => face as i64,
        _ => part as i64,
    }
}

crate::define_node! {
    /// Polygons whose corners are the coordinates one after the other.
    ///
    /// Boxed, drawn and picked as [`IndexedFaceSet`].
    ///
    /// ```ron
    /// Coordinate3(point: [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)]),
    /// FaceSet(num_vertices: [3]),
    /// ```
    pub struct FaceSet: shape(VERTEX_PROPERTY) {
        /// The first point, counted from 0.
        pub start_index: i32 = 0,
        /// Number of corners of each polygon; −1: all points that are left.
        pub num_vertices: List<i32> = List::from([-1]),
    }
}

impl FaceSet {
    fn build(&self, _: &ShapeContext<'_>, builder: &mut Builder<'_>) -> Result<(), ShapeError> {
        let binding = builder.binding();
        for (face, range) in
            stretches(self.start_index, &self.num_vertices, "num_vertices", builder.points())?.into_iter().enumerate()
        {
            if range.len() >= 3 {
                // The end first: a number beyond all points is not collected before it is refused.
                builder.face("num_vertices", face, face, whole(binding, face, face), &[plain(range.end - 1)])?;
                let corners: Vec<Corner> = range.map(plain).collect();
                builder.face("num_vertices", face, face, whole(binding, face, face), &corners)?;
            }
        }
        Ok(())
    }
}

crate::define_node! {
    /// Strips of triangles whose corners are the coordinates one after the other.
    ///
    /// Triangle k of a strip has the corners k, k + 1 and k + 2; every second one is turned over, so that all look the same
    /// way. Boxed, drawn and picked as [`IndexedFaceSet`].
    ///
    /// ```ron
    /// TriangleStripSet(num_vertices: [4])
    /// ```
    pub struct TriangleStripSet: shape(VERTEX_PROPERTY) {
        /// The first point, counted from 0.
        pub start_index: i32 = 0,
        /// Number of points of each strip; −1: all that are left.
        pub num_vertices: List<i32> = List::from([-1]),
    }
}

impl TriangleStripSet {
    fn build(&self, _: &ShapeContext<'_>, builder: &mut Builder<'_>) -> Result<(), ShapeError> {
        let binding = builder.binding();
        let mut face = 0;
        for (part, range) in
            stretches(self.start_index, &self.num_vertices, "num_vertices", builder.points())?.into_iter().enumerate()
        {
            if range.len() >= 3 {
                builder.face("num_vertices", face, part, whole(binding, face, part), &[plain(range.end - 1)])?;
                let corners: Vec<Corner> = range.map(plain).collect();
                face = strip(builder, "num_vertices", &corners, face, part, |face| whole(binding, face, part))?;
            }
        }
        Ok(())
    }
}

crate::define_node! {
    /// A grid of quadrilaterals whose corners are the coordinates row by row.
    ///
    /// Boxed, drawn and picked as [`IndexedFaceSet`], each quadrilateral as two triangles.
    ///
    /// ```ron
    /// QuadMesh(vertices_per_row: 3, vertices_per_column: 2)
    /// ```
    pub struct QuadMesh: shape(VERTEX_PROPERTY) {
        /// The first point, counted from 0.
        pub start_index: i32 = 0,
        /// Number of rows.
        pub vertices_per_column: u32 = 1,
        /// Number of points in a row.
        pub vertices_per_row: u32 = 1,
    }
}

impl QuadMesh {
    fn build(&self, _: &ShapeContext<'_>, builder: &mut Builder<'_>) -> Result<(), ShapeError> {
        let binding = builder.binding();
        let (columns, rows) = (self.vertices_per_row as usize, self.vertices_per_column as usize);
        if columns < 2 || rows < 2 {
            return Ok(());
        }
        let count = i32::try_from(columns.saturating_mul(rows)).unwrap_or(i32::MAX);
        let start = stretches(self.start_index, &[count], "vertices_per_row", builder.points())?
            .first()
            .map_or(0, |range| range.start);
        for row in 0..rows - 1 {
            for column in 0..columns - 1 {
                let at = |r: usize, c: usize| plain(start + (row + r) * columns + column + c);
                let face = row * (columns - 1) + column;
                let corners = [at(0, 0), at(1, 0), at(1, 1), at(0, 1)];
                builder.face("vertices_per_column", face, row, whole(binding, face, row), &corners)?;
            }
        }
        Ok(())
    }
}
