#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing))]

use std::sync::{Arc, OnceLock};

use glam::{DAffine3, DVec3, Vec3};

use super::face_mesh::{index, inputs};
use super::face_sets::{VERTEX_PROPERTY, given, runs, stretches};
use super::{Binding, HitDetail, LineDetail, List, MeshInputs, PointDetail, ShapeHit, ShapeNode, Style, Triangle};
use crate::action::{Aabb, DrawContext, Near, PickCone, ShapeContext, ShapeError, Strokes};

/// A vertex of a line, or a point.
#[derive(Debug, Clone, Copy)]
struct Vertex {
    point: u32,
    /// Normal of the piece that ends here, and of the one that begins here.
    normals: [u32; 2],
}

/// A set of lines or points, ready for all questions.
#[derive(Debug, Default)]
struct StrokeSet {
    points: List<DVec3>,
    normals: List<DVec3>,
    vertices: Vec<Vertex>,
    /// The lines as runs of vertices; none for points.
    lines: Vec<std::ops::Range<usize>>,
    bounds: Option<Aabb>,
    /// As lines, and as points.
    drawn: [OnceLock<Option<Anchored>>; 2],
}

/// Strokes relative to a point.
type Anchored = (DVec3, Arc<Strokes>);

impl StrokeSet {
    /// The set of a shape at its place: the one made before if nothing that it depends on has changed. `build` adds the
    /// vertices.
    fn of(
        cx: &ShapeContext<'_>,
        build: impl FnOnce(&mut Builder<'_>) -> Result<(), ShapeError>,
    ) -> Result<Arc<StrokeSet>, ShapeError> {
        let key = cx.path.tail();
        cx.scene.resources().mesh(key, inputs(cx, key), |inputs| {
            let mut builder = Builder { inputs, vertices: Vec::new(), lines: Vec::new(), pieces: 0 };
            build(&mut builder)?;
            Ok(builder.finish())
        })
    }

    fn at(&self, vertex: &Vertex) -> DVec3 {
        self.points.get(vertex.point as usize).copied().unwrap_or_default()
    }

    fn normal(&self, number: u32) -> Option<DVec3> {
        self.normals.get(number as usize).copied()
    }

    /// The vertices of each line.
    fn runs(&self) -> impl Iterator<Item = &[Vertex]> {
        self.lines.iter().filter_map(|run| self.vertices.get(run.clone()))
    }

    fn lines(&self, sink: &mut dyn FnMut([DVec3; 2])) {
        for run in self.runs() {
            for pair in run.windows(2) {
                if let [a, b] = pair {
                    sink([self.at(a), self.at(b)]);
                }
            }
        }
    }

    /// The points of a set of points: lines have none.
    fn points(&self, sink: &mut dyn FnMut(DVec3)) {
        if self.lines.is_empty() {
            self.vertices.iter().for_each(|vertex| sink(self.at(vertex)));
        }
    }

    fn near(&self, near: &mut Near<'_>) {
        for (line, run) in self.runs().enumerate() {
            for (piece, pair) in run.windows(2).enumerate() {
                let [a, b] = pair else { continue };
                near.piece([self.at(a), self.at(b)], piece > 0, |along| {
                    let points = [a.point as usize, b.point as usize];
                    let (from, to) = (self.normal(a.normals[1]), self.normal(b.normals[0]));
                    let normal = from.zip(to).map(|(from, to)| from + (to - from) * along);
                    (HitDetail::Line(LineDetail { line, piece, points, along }), normal)
                });
            }
        }
        near.finish();
        if self.lines.is_empty() {
            for (index, vertex) in self.vertices.iter().enumerate() {
                near.point(self.at(vertex), || {
                    let detail = PointDetail { index, point: vertex.point as usize };
                    (HitDetail::Point(detail), self.normal(vertex.normals[0]))
                });
            }
        }
    }

    fn draw(&self, cx: &mut DrawContext<'_>) -> Result<(), ShapeError> {
        let dots = self.lines.is_empty() || cx.shape.state.draw_style.style == Style::Points;
        let [as_lines, as_points] = &self.drawn;
        let drawn = if dots { as_points } else { as_lines }.get_or_init(|| self.strokes(dots));
        let Some((anchor, strokes)) = drawn else { return Ok(()) };
        cx.draw_strokes(Arc::clone(strokes), &DAffine3::from_translation(*anchor))
    }

    fn strokes(&self, dots: bool) -> Option<Anchored> {
        // Relative to a vertex, so that large local coordinates keep their digits.
        let anchor = self.at(self.vertices.first()?);
        let end = |vertex: &Vertex, normal: u32| {
            let normal = self.normal(normal).map_or(Vec3::ZERO, DVec3::as_vec3);
            [(self.at(vertex) - anchor).as_vec3(), normal]
        };
        let lit = !self.normals.is_empty();
        let pieces = if dots {
            self.vertices.iter().map(|v| [end(v, v.normals[0]); 2]).collect()
        } else {
            let pairs = self.runs().flat_map(|run| run.windows(2));
            let piece = |pair: &[Vertex]| match pair {
                [a, b] => Some([end(a, a.normals[1]), end(b, b.normals[0])]),
                _ => None,
            };
            pairs.filter_map(piece).collect()
        };
        Some((anchor, Arc::new(Strokes { pieces, dots, lit })))
    }
}

/// Takes vertices and makes the set.
struct Builder<'i> {
    inputs: &'i MeshInputs,
    vertices: Vec<Vertex>,
    lines: Vec<std::ops::Range<usize>>,
    /// Number of straight pieces so far.
    pieces: usize,
}

/// Where the normals of a set come from: its list of indices, if it has one.
#[derive(Clone, Copy)]
struct NormalsBy<'a> {
    list: &'a [i32],
    /// Place of the run's first vertex in the list.
    at: usize,
    /// Whether normals per vertex have the numbers of the points, instead of being counted.
    by_point: bool,
}

impl Builder<'_> {
    fn points(&self) -> usize {
        self.inputs.coordinates.len()
    }

    /// Adds vertices: of a line, or points by themselves. `points`: their indices, from `field`.
    fn run(
        &mut self,
        field: &'static str,
        points: impl ExactSizeIterator<Item = i64>,
        normals: NormalsBy<'_>,
        joined: bool,
    ) -> Result<(), ShapeError> {
        let MeshInputs { coordinates, normals: given_normals, normal_binding, .. } = self.inputs;
        let who = if joined { ("line", self.lines.len()) } else { ("point", self.vertices.len()) };
        let start = self.vertices.len();
        let listed = |place: usize, otherwise: i64| match given(normals.list) {
            true => normals.list.get(place).map_or(-1, |&index| i64::from(index)),
            false => otherwise,
        };
        let last = points.len().saturating_sub(1);
        for (k, point) in points.enumerate() {
            let sides = match *normal_binding {
                _ if given_normals.is_empty() => [0; 2],
                Binding::Overall => [0; 2],
                // The piece that ends here, and the one that begins here.
                Binding::PerPart | Binding::PerPartIndexed => {
                    let pieces = [self.pieces + k.saturating_sub(1), self.pieces + k.min(last.saturating_sub(1))];
                    match normal_binding {
                        Binding::PerPart => pieces.map(|piece| piece as i64),
                        _ => pieces.map(|piece| listed(piece, piece as i64)),
                    }
                }
                Binding::PerFace => [self.lines.len() as i64; 2],
                Binding::PerFaceIndexed => [listed(self.lines.len(), self.lines.len() as i64); 2],
                Binding::PerVertex if normals.by_point => [point; 2],
                Binding::PerVertex => [self.vertices.len() as i64; 2],
                Binding::PerVertexIndexed => [listed(normals.at + k, point); 2],
            };
            let point = index(point, coordinates.len(), field, who, "points", "Coordinate3 or a vertex_property")?;
            let normal = |number| match given_normals.is_empty() {
                true => Ok(0),
                false => index(number, given_normals.len(), "normal_index", who, "normals", "Normal"),
            };
            let [ends, begins] = sides;
            self.vertices.push(Vertex { point, normals: [normal(ends)?, normal(begins)?] });
        }
        if joined {
            self.lines.push(start..self.vertices.len());
            self.pieces += last;
        }
        Ok(())
    }

    /// [`Builder::run`] of points one after the other.
    fn stretch(&mut self, field: &'static str, range: std::ops::Range<usize>, joined: bool) -> Result<(), ShapeError> {
        if let Some(last) = range.end.checked_sub(1).filter(|_| !range.is_empty()) {
            let who = if joined { ("line", self.lines.len()) } else { ("point", last) };
            // The end first: a number beyond all points is not collected before it is refused.
            index(last as i64, self.points(), field, who, "points", "Coordinate3 or a vertex_property")?;
        }
        let none = NormalsBy { list: &[], at: 0, by_point: true };
        self.run(field, range.map(|k| k as i64), none, joined)
    }

    fn finish(self) -> StrokeSet {
        let Self { inputs, vertices, lines, .. } = self;
        let points = inputs.coordinates.clone();
        let used = vertices.iter().filter_map(|vertex| points.get(vertex.point as usize).copied());
        let bounds = Aabb::of(used);
        let normals = inputs.normals.iter().map(|&n| crate::action::unit(n).unwrap_or(DVec3::Z)).collect();
        StrokeSet { points, normals, vertices, lines, bounds, ..StrokeSet::default() }
    }
}

/// The shape's answers, all from its set of strokes.
macro_rules! stroke_shape {
    ($($name:ident)*) => {$(
        impl ShapeNode for $name {
            fn bounds(&self, cx: &ShapeContext<'_>) -> Result<Option<Aabb>, ShapeError> {
                Ok(self.set(cx)?.bounds)
            }

            fn primitives(&self, _: &ShapeContext<'_>, _: &mut dyn FnMut(Triangle)) -> Result<(), ShapeError> {
                Ok(())
            }

            fn lines(&self, cx: &ShapeContext<'_>, sink: &mut dyn FnMut([DVec3; 2])) -> Result<(), ShapeError> {
                self.set(cx)?.lines(sink);
                Ok(())
            }

            fn points(&self, cx: &ShapeContext<'_>, sink: &mut dyn FnMut(DVec3)) -> Result<(), ShapeError> {
                self.set(cx)?.points(sink);
                Ok(())
            }

            fn beyond_box(&self) -> bool {
                true
            }

            fn near(
                &self,
                cx: &ShapeContext<'_>,
                cone: &PickCone,
                far: f64,
                hits: &mut Vec<ShapeHit>,
            ) -> Result<(), ShapeError> {
                self.set(cx)?.near(&mut Near::new(cx, cone, far, hits));
                Ok(())
            }

            fn draw(&self, cx: &mut DrawContext<'_>) -> Result<(), ShapeError> {
                self.set(&cx.shape)?.draw(cx)
            }
        }

        impl $name {
            fn set(&self, cx: &ShapeContext<'_>) -> Result<Arc<StrokeSet>, ShapeError> {
                StrokeSet::of(cx, |builder| self.build(builder))
            }
        }
    )*};
}

stroke_shape!(LineSet IndexedLineSet PointSet);

crate::define_node! {
    /// Lines from point to point, through the coordinates one after the other.
    ///
    /// Drawn as wide as [`DrawStyle`](crate::node::DrawStyle) says, in pixels, without smoothed joints; with style `Points` as
    /// their points. Lit only if there are normals: in the binding a part is a straight piece, a face a line. Boxed
    /// by its points, the width left out. Called back and counted as one line for each straight piece. Picked through the
    /// picture within [`RayPickAction::radius`](crate::action::RayPickAction) pixels; the hit is the point of the line that is
    /// nearest there, its detail says line, piece and points. Its normal looks back along the ray if there is no other.
    ///
    /// ```ron
    /// Coordinate3(point: [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0)]),
    /// DrawStyle(line_width: 2.0),
    /// LineSet(num_vertices: [3]),
    /// ```
    pub struct LineSet: shape(VERTEX_PROPERTY) {
        /// The first point, counted from 0.
        pub start_index: i32 = 0,
        /// Number of points of each line; −1: all that are left.
        pub num_vertices: List<i32> = List::from([-1]),
    }
}

impl LineSet {
    fn build(&self, builder: &mut Builder<'_>) -> Result<(), ShapeError> {
        for range in stretches(self.start_index, &self.num_vertices, "num_vertices", builder.points())? {
            builder.stretch("num_vertices", range, true)?;
        }
        Ok(())
    }
}

crate::define_node! {
    /// Lines from point to point, whose points are indices into the coordinates.
    ///
    /// Drawn, boxed, called back and picked as [`LineSet`]. An index that leads nowhere is an error.
    ///
    /// ```ron
    /// Coordinate3(point: [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0)]),
    /// IndexedLineSet(coord_index: [0, 1, 2, 0, -1]),
    /// ```
    pub struct IndexedLineSet: shape(VERTEX_PROPERTY) {
        /// The points of each line as indices into the coordinates, −1 after each.
        pub coord_index: List<i32> = List::from([0]),
        /// Indices of the normals, in the same places as `coord_index`, or one per piece or line, as the NormalBinding says;
        /// [-1]: the same as `coord_index`.
        pub normal_index: List<i32> = List::from([-1]),
    }
}

impl IndexedLineSet {
    fn build(&self, builder: &mut Builder<'_>) -> Result<(), ShapeError> {
        for (at, run) in runs(&self.coord_index) {
            let points = run.iter().map(|&point| i64::from(point));
            builder.run("coord_index", points, NormalsBy { list: &self.normal_index, at, by_point: false }, true)?;
        }
        Ok(())
    }
}

crate::define_node! {
    /// Points, the coordinates one after the other.
    ///
    /// Drawn as squares of [`DrawStyle`](crate::node::DrawStyle)'s `point_size` in pixels. Lit only if there are normals.
    /// Boxed by its points, their size left out. Called back, counted, and picked as points, within
    /// [`RayPickAction::radius`](crate::action::RayPickAction) pixels of the picked place of the picture; the detail says which.
    ///
    /// ```ron
    /// Coordinate3(point: [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0)]),
    /// DrawStyle(point_size: 3.0),
    /// PointSet(),
    /// ```
    pub struct PointSet: shape(VERTEX_PROPERTY) {
        /// The first point, counted from 0.
        pub start_index: i32 = 0,
        /// Number of points; −1: all that are left.
        pub num_points: i32 = -1,
    }
}

impl PointSet {
    fn build(&self, builder: &mut Builder<'_>) -> Result<(), ShapeError> {
        for range in stretches(self.start_index, &[self.num_points], "num_points", builder.points())? {
            builder.stretch("num_points", range, false)?;
        }
        Ok(())
    }
}
