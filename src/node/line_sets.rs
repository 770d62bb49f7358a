#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing))]

use std::sync::{Arc, Mutex, PoisonError};

use glam::{DAffine3, DVec3, Vec3};

use super::face_mesh::{Corner, Lists, color_number, draw_with_own, index, inputs};
use super::face_sets::{VERTEX_PROPERTY, corners, runs, stretches};
use super::{Binding, HitDetail, LineDetail, List, MeshInputs, PointDetail, ShapeHit, ShapeNode, Style, Triangle};
use crate::action::{Aabb, CornerData, DrawContext, Near, PickCone, ShapeContext, ShapeError, Strokes};

/// A vertex of a line, or a point.
#[derive(Debug, Clone, Copy, Default)]
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
    /// Numbers of the colours of each vertex, as its normals, where they differ.
    materials: Vec<[u32; 2]>,
    material_binding: Binding,
    /// The lines as runs of vertices; none for points.
    lines: Vec<std::ops::Range<usize>>,
    bounds: Option<Aabb>,
    /// As they were drawn last.
    drawn: Mutex<Option<(Way, Drawn)>>,
}

/// Whether it is drawn as points, and what the ends of pieces carry.
type Way = (bool, CornerData);

/// Strokes relative to a point; `None` if there is nothing.
type Drawn = Option<(DVec3, Arc<Strokes>)>;

impl StrokeSet {
    /// The set of a shape at its place: the one made before if nothing that it depends on has changed. `build` adds the
    /// vertices.
    fn of(
        cx: &ShapeContext<'_>,
        build: impl FnOnce(&mut Builder<'_>) -> Result<(), ShapeError>,
    ) -> Result<Arc<StrokeSet>, ShapeError> {
        let key = cx.path.tail();
        cx.scene.resources().mesh(key, inputs(cx, key), |inputs| {
            let mut builder = Builder {
                inputs,
                lists: Lists::default(),
                vertices: Vec::new(),
                materials: Vec::new(),
                lines: Vec::new(),
                pieces: 0,
            };
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
        let way = (dots, cx.corner_data());
        let mut kept = self.drawn.lock().unwrap_or_else(PoisonError::into_inner);
        let drawn = match &*kept {
            Some((known, drawn)) if *known == way => drawn.clone(),
            _ => {
                let drawn = self.strokes(&way)?;
                *kept = Some((way, drawn.clone()));
                drawn
            }
        };
        drop(kept);
        let Some((anchor, strokes)) = drawn else { return Ok(()) };
        cx.draw_strokes(strokes, &DAffine3::from_translation(anchor))
    }

    fn strokes(&self, (dots, data): &Way) -> Result<Drawn, ShapeError> {
        // Relative to a vertex, so that large local coordinates keep their digits.
        let Some(anchor) = self.vertices.first().map(|vertex| self.at(vertex)) else { return Ok(None) };
        // Pairs of vertices, with the line that they are on.
        let pairs: Vec<([usize; 2], usize)> = if *dots {
            (0..self.vertices.len()).map(|k| ([k; 2], k)).collect()
        } else {
            let lines = self.lines.iter().enumerate();
            lines.flat_map(|(line, run)| run.clone().skip(1).map(move |k| ([k - 1, k], line))).collect()
        };
        let end = |vertex: usize, side: usize| {
            let vertex = self.vertices.get(vertex).copied().unwrap_or_default();
            let normal = vertex.normals.get(side).and_then(|&normal| self.normal(normal));
            [(self.at(&vertex) - anchor).as_vec3(), normal.map_or(Vec3::ZERO, DVec3::as_vec3)]
        };
        // What begins at the first one, and ends at the second.
        let sides = if *dots { [0; 2] } else { [1, 0] };
        let both = |[a, b]: [usize; 2]| [(a, sides[0]), (b, sides[1])];
        let pieces = pairs.iter().map(|(pair, _)| both(*pair).map(|(vertex, side)| end(vertex, side))).collect();
        let mut colors = Vec::new();
        if let Some(given) = &data.colors {
            let color = |(vertex, side): (usize, usize), line: usize| {
                let material = self.materials.get(vertex).and_then(|sides| sides.get(side)).copied();
                let who = if self.lines.is_empty() { ("point", vertex) } else { ("line", line) };
                given.of(material.unwrap_or_default(), self.material_binding, who)
            };
            for (pair, line) in &pairs {
                let [a, b] = both(*pair);
                colors.push([color(a, *line)?, color(b, *line)?]);
            }
        }
        let lit = !self.normals.is_empty();
        Ok(Some((anchor, Arc::new(Strokes { pieces, colors, dots: *dots, lit }))))
    }
}

/// Takes vertices and makes the set.
struct Builder<'i> {
    inputs: &'i MeshInputs,
    lists: Lists,
    vertices: Vec<Vertex>,
    materials: Vec<[u32; 2]>,
    lines: Vec<std::ops::Range<usize>>,
    /// Number of straight pieces so far.
    pieces: usize,
}

impl Builder<'_> {
    fn points(&self) -> usize {
        self.inputs.coordinates.len()
    }

    /// Adds vertices: of a line, or points by themselves. `field`: where their points come from.
    fn run(
        &mut self,
        field: &'static str,
        corners: impl ExactSizeIterator<Item = Corner>,
        joined: bool,
    ) -> Result<(), ShapeError> {
        let MeshInputs { coordinates, normals, normal_binding, material_binding, .. } = self.inputs;
        let line = self.lines.len();
        let start = self.vertices.len();
        let last = corners.len().saturating_sub(1);
        for (k, corner) in corners.enumerate() {
            let who = if joined { ("line", line) } else { ("point", corner.at) };
            // The piece that ends here, and the one that begins here. A point is all there is of it.
            let parts = match joined {
                true => [self.pieces + k.saturating_sub(1), self.pieces + k.min(last.saturating_sub(1))],
                false => [corner.at; 2],
            };
            let face = if joined { line } else { corner.at };
            let point =
                index(corner.point, coordinates.len(), field, who, "points", "Coordinate3 or a vertex_property")?;
            let normal = |part| match normals.is_empty() {
                true => Ok(0),
                false => {
                    let number = normal_binding.number(&self.lists.normal, part, face, &corner);
                    index(number, normals.len(), "normal_index", who, "normals", "Normal")
                }
            };
            let [ends, begins] = parts;
            self.vertices.push(Vertex { point, normals: [normal(ends)?, normal(begins)?] });
            if *material_binding != Binding::Overall {
                let material =
                    |part| color_number(material_binding.number(&self.lists.material, part, face, &corner), who);
                self.materials.push([material(ends)?, material(begins)?]);
            }
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
        self.run(field, range.map(Corner::plain), joined)
    }

    fn finish(self) -> StrokeSet {
        let Self { inputs, vertices, materials, lines, .. } = self;
        let points = inputs.coordinates.clone();
        let used = vertices.iter().filter_map(|vertex| points.get(vertex.point as usize).copied());
        let bounds = Aabb::of(used);
        let normals = inputs.normals.iter().map(|&n| crate::action::unit(n).unwrap_or(DVec3::Z)).collect();
        let material_binding = inputs.material_binding;
        StrokeSet { points, normals, vertices, materials, material_binding, lines, bounds, ..StrokeSet::default() }
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
                let set = self.set(&cx.shape)?;
                draw_with_own(cx, |cx| set.draw(cx))
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
    /// their points. Lit only if there are normals: in the bindings a part is a straight piece, a face a line. Boxed
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
    actions {
        Render: "draws it, in pixels wide";
        BoundingBox: "holds its places, without their width";
        RayPick, HandleEvent: "meet it within a radius in the picture; a ray of the world does not";
        Callback: "hands out its lines";
        PrimitiveCount: "counts them";
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
        /// -1: the same as `coord_index`.
        pub normal_index: List<i32> = List::from([-1]),
        /// Indices of the colours, as those of the normals, as the MaterialBinding says; -1: the same as `coord_index`.
        pub material_index: List<i32> = List::from([-1]),
    }
    actions {
        Render: "draws it, in pixels wide";
        BoundingBox: "holds its places, without their width";
        RayPick, HandleEvent: "meet it within a radius in the picture; a ray of the world does not";
        Callback: "hands out its lines";
        PrimitiveCount: "counts them";
    }
}

impl IndexedLineSet {
    fn build(&self, builder: &mut Builder<'_>) -> Result<(), ShapeError> {
        builder.lists = Lists {
            normal: self.normal_index.clone(),
            material: self.material_index.clone(),
            texture: List::default(),
        };
        let mut running = 0;
        for (at, run) in runs(&self.coord_index) {
            builder.run("coord_index", corners(run, at, running), true)?;
            running += run.len();
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
    actions {
        Render: "draws it, in pixels wide";
        BoundingBox: "holds its places, without their width";
        RayPick, HandleEvent: "meet it within a radius in the picture; a ray of the world does not";
        Callback: "hands out its points";
        PrimitiveCount: "counts them";
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
