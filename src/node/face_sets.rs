use std::sync::Arc;

use super::face_mesh::{Builder, Corner, FaceMesh, Lists, draw_with_own};
use super::{ChildRule, List, ShapeHit, ShapeNode, Triangle};
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
                let mesh = self.mesh(&cx.shape)?;
                draw_with_own(cx, |cx| mesh.draw(cx))
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

/// The runs of corners between −1s, each with the place of its first corner in the list.
pub(super) fn runs(indices: &[i32]) -> impl Iterator<Item = (usize, &[i32])> {
    let mut start = 0;
    indices.split(|&k| k < 0).filter_map(move |run| {
        let at = start;
        start += run.len() + 1;
        (!run.is_empty()).then_some((at, run))
    })
}

/// The corners of a run of indices: `at` is the place of the first in the list, `running` its number without the −1s.
pub(super) fn corners(run: &[i32], at: usize, running: usize) -> impl ExactSizeIterator<Item = Corner> {
    run.iter().enumerate().map(move |(k, &point)| Corner {
        point: point.into(),
        at: at + k,
        running: (running + k) as i64,
    })
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
        /// Indices of the normals, in the same places as `coord_index`, or one per face, as the NormalBinding says; -1:
        /// the same as `coord_index`.
        pub normal_index: List<i32> = List::from([-1]),
        /// Indices of the colours, in the same places as `coord_index`, or one per face, as the MaterialBinding says; -1: the
        /// same as `coord_index`.
        pub material_index: List<i32> = List::from([-1]),
        /// Indices of the texture coordinates, in the same places as `coord_index`; -1: the same.
        pub texture_coord_index: List<i32> = List::from([-1]),
    }
}

impl IndexedFaceSet {
    fn build(&self, _: &ShapeContext<'_>, builder: &mut Builder<'_>) -> Result<(), ShapeError> {
        builder.lists = Lists {
            normal: self.normal_index.clone(),
            material: self.material_index.clone(),
            texture: self.texture_coord_index.clone(),
        };
        let mut running = 0;
        let mut polygon = Vec::new();
        for (face, (at, run)) in runs(&self.coord_index).enumerate() {
            if run.len() >= 3 {
                polygon.clear();
                polygon.extend(corners(run, at, running));
                builder.face("coord_index", face, face, &polygon)?;
            }
            running += run.len();
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
        /// Indices of the colours, in the same places as `coord_index`, or one per face or strip, as the MaterialBinding says; -1:
        /// the same as `coord_index`.
        pub material_index: List<i32> = List::from([-1]),
        /// Indices of the texture coordinates, in the same places as `coord_index`; -1: the same.
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
) -> Result<usize, ShapeError> {
    let mut face = first_face;
    for (k, triangle) in corners.windows(3).enumerate() {
        if let [a, b, c] = *triangle {
            let turned = if k % 2 == 0 { [a, b, c] } else { [b, a, c] };
            builder.face(field, face, part, &turned)?;
            face += 1;
        }
    }
    Ok(face)
}

impl IndexedTriangleStripSet {
    fn build(&self, _: &ShapeContext<'_>, builder: &mut Builder<'_>) -> Result<(), ShapeError> {
        builder.lists = Lists {
            normal: self.normal_index.clone(),
            material: self.material_index.clone(),
            texture: self.texture_coord_index.clone(),
        };
        let (mut running, mut face) = (0, 0);
        for (part, (at, run)) in runs(&self.coord_index).enumerate() {
            let corners: Vec<Corner> = corners(run, at, running).collect();
            running += run.len();
            face = strip(builder, "coord_index", &corners, face, part)?;
        }
        Ok(())
    }
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
        for (face, range) in
            stretches(self.start_index, &self.num_vertices, "num_vertices", builder.points())?.into_iter().enumerate()
        {
            if range.len() >= 3 {
                // The end first: a number beyond all points is not collected before it is refused.
                builder.face("num_vertices", face, face, &[Corner::plain(range.end - 1)])?;
                let corners: Vec<Corner> = range.map(Corner::plain).collect();
                builder.face("num_vertices", face, face, &corners)?;
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
        let mut face = 0;
        for (part, range) in
            stretches(self.start_index, &self.num_vertices, "num_vertices", builder.points())?.into_iter().enumerate()
        {
            if range.len() >= 3 {
                builder.face("num_vertices", face, part, &[Corner::plain(range.end - 1)])?;
                let corners: Vec<Corner> = range.map(Corner::plain).collect();
                face = strip(builder, "num_vertices", &corners, face, part)?;
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
                let at = |r: usize, c: usize| Corner::plain(start + (row + r) * columns + column + c);
                let face = row * (columns - 1) + column;
                let corners = [at(0, 0), at(1, 0), at(1, 1), at(0, 1)];
                builder.face("vertices_per_column", face, row, &corners)?;
            }
        }
        Ok(())
    }
}
