//! What sets of faces are made into: triangles with normals and texture coordinates, their box and their tree of boxes.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing))]

use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use glam::{DAffine3, DVec2, DVec3};

use super::{
    Binding, FaceDetail, FaceType, HitDetail, List, PropertyNode, ShapeHints, ShapeHit, Triangle, VertexOrdering,
    VertexProperty,
};
use crate::action::{
    Aabb, ActionKind, Bvh, CornerData, Crossings, DrawContext, DrawOptions, Geometry, GeometryKind, Mesh,
    PropertyContext, Ray, ShapeContext, ShapeError, State, meet_triangle,
};
use crate::scene::NodeKey;

/// All that a mesh is made of beside the fields of its own node.
#[derive(Debug, Clone)]
pub(crate) struct MeshInputs {
    version: Option<u64>,
    pub(super) coordinates: List<DVec3>,
    pub(super) normals: List<DVec3>,
    pub(super) normal_binding: Binding,
    pub(super) material_binding: Binding,
    pub(super) texture_coordinates: List<DVec2>,
    hints: ShapeHints,
}

impl MeshInputs {
    /// Whether a mesh made of the others is the same. Lists are compared by identity, which is quick; equal lists elsewhere
    /// in memory make a mesh once more.
    pub(crate) fn same(&self, other: &Self) -> bool {
        self.version == other.version
            && self.coordinates.same(&other.coordinates)
            && self.normals.same(&other.normals)
            && self.normal_binding == other.normal_binding
            && self.material_binding == other.material_binding
            && self.texture_coordinates.same(&other.texture_coordinates)
            && self.hints == other.hints
    }
}

impl MeshInputs {
    /// Whether it belongs to an older state of the node than the other.
    pub(crate) fn outdated_by(&self, newer: &Self) -> bool {
        self.version < newer.version
    }
}

/// A corner of a face, a vertex of a line, or a point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Corner {
    /// Its index into the coordinates.
    pub(super) point: i64,
    /// Its place in the shape's lists of indices.
    pub(super) at: usize,
    /// Its number among all corners, or that of its point where the shape has no indices.
    pub(super) running: i64,
}

impl Corner {
    /// Of a shape without indices: everything per vertex has the number of the point.
    pub(super) fn plain(k: usize) -> Self {
        Self { point: k as i64, at: k, running: k as i64 }
    }
}

/// Lists of indices of a shape; empty for one that has none.
#[derive(Debug, Clone, Default)]
pub(super) struct Lists {
    pub(super) normal: List<i32>,
    pub(super) material: List<i32>,
    pub(super) texture: List<i32>,
}

/// The index at a place of a list, or what it is without the list; −1 beyond its end.
fn listed(list: &[i32], at: usize, otherwise: i64) -> i64 {
    match list {
        // Open Inventor writes [-1] for none.
        [] | [-1] => otherwise,
        list => list.get(at).map_or(-1, |&index| index.into()),
    }
}

impl Binding {
    /// The number of the normal or colour of a corner of a face of a part.
    pub(super) fn number(self, list: &[i32], part: usize, face: usize, corner: &Corner) -> i64 {
        match self {
            Binding::Overall => 0,
            Binding::PerPart => part as i64,
            Binding::PerPartIndexed => listed(list, part, part as i64),
            Binding::PerFace => face as i64,
            Binding::PerFaceIndexed => listed(list, face, face as i64),
            Binding::PerVertex => corner.running,
            Binding::PerVertexIndexed => listed(list, corner.at, corner.point),
        }
    }
}

#[derive(Debug, Clone, Copy)]
struct MeshTriangle {
    points: [u32; 3],
    normals: [u32; 3],
    uvs: [u32; 3],
    face: u32,
    part: u32,
}

/// A set of faces, ready for all questions. The tree of boxes and what the GPU gets are made when they are needed first.
#[derive(Debug, Default)]
pub(crate) struct FaceMesh {
    points: List<DVec3>,
    normals: List<DVec3>,
    uvs: List<DVec2>,
    triangles: Vec<MeshTriangle>,
    /// Numbers of the colours at the corners of each triangle, where they differ.
    materials: Vec<[u32; 3]>,
    material_binding: Binding,
    bounds: Option<Aabb>,
    /// Whether only the normals tell which side is outside.
    outside_by_normals: bool,
    bvh: OnceLock<Bvh>,
    /// By what its corners carry, those used last at the end.
    drawn: Mutex<Vec<(CornerData, Drawn)>>,
}

/// Relative to a point; `None` if there is nothing.
type Drawn = Option<(DVec3, Arc<Mesh>)>;

/// In how many ways a mesh is kept for the GPU.
const WAYS: usize = 4;

impl FaceMesh {
    /// The mesh of a set of faces at its place: the one made before if nothing that it depends on has changed.
    ///
    /// `build` hands the faces to the builder.
    pub(super) fn of(
        cx: &ShapeContext<'_>,
        build: impl FnOnce(&mut Builder) -> Result<(), ShapeError>,
    ) -> Result<Arc<FaceMesh>, ShapeError> {
        let key = cx.path.tail();
        let inputs = inputs(cx, key);
        cx.scene.resources().mesh(key, inputs, |inputs| {
            let mut builder = Builder::new(inputs);
            build(&mut builder)?;
            builder.finish()
        })
    }

    pub(super) fn bounds(&self) -> Option<Aabb> {
        self.bounds
    }

    pub(super) fn primitives(&self, sink: &mut dyn FnMut(Triangle)) {
        for (k, t) in self.triangles.iter().enumerate() {
            sink(Triangle { materials: self.materials.get(k).copied().unwrap_or_default(), ..self.triangle(t) });
        }
    }

    fn triangle(&self, t: &MeshTriangle) -> Triangle {
        Triangle {
            points: self.corners(t),
            normals: t.normals.map(|k| self.normals.get(k as usize).copied().unwrap_or(DVec3::Z)),
            uvs: t.uvs.map(|k| self.uvs.get(k as usize).copied().unwrap_or_default()),
            materials: [0; 3],
        }
    }

    fn corners(&self, t: &MeshTriangle) -> [DVec3; 3] {
        t.points.map(|k| self.points.get(k as usize).copied().unwrap_or_default())
    }

    pub(super) fn ray(&self, ray: &Ray, first: bool, hits: &mut Vec<ShapeHit>) {
        let bvh = self.bvh.get_or_init(|| {
            let boxes: Vec<Aabb> = self
                .triangles
                .iter()
                .map(|t| {
                    let [a, b, c] = self.corners(t);
                    Aabb { min: a.min(b).min(c), max: a.max(b).max(c) }
                })
                .collect();
            Bvh::new(&boxes)
        });
        // By number of the triangle, so that the answer does not depend on the tree.
        let mut found = Vec::new();
        bvh.ray(ray, |index, far| {
            let Some(t) = self.triangles.get(index as usize) else { return far };
            match meet_triangle(ray, self.corners(t)) {
                Some(meeting) if meeting.t <= far => {
                    if first {
                        found.retain(|(_, m): &(u32, crate::action::Meeting)| m.t <= meeting.t);
                    }
                    found.push((index, meeting));
                    if first { meeting.t } else { far }
                }
                _ => far,
            }
        });
        found.sort_unstable_by_key(|(index, _)| *index);
        let mut crossings = Crossings::default();
        for (index, meeting) in found {
            let Some(t) = self.triangles.get(index as usize) else { continue };
            let triangle = self.triangle(t);
            if crossings.is_new(triangle.points, &meeting) {
                let detail = HitDetail::Face(FaceDetail {
                    face: t.face as usize,
                    part: t.part as usize,
                    points: t.points.map(|k| k as usize),
                    barycentric: meeting.weights,
                });
                hits.push(ShapeHit { detail, ..meeting.hit(&triangle) });
                if first {
                    return;
                }
            }
        }
    }

    pub(super) fn draw(&self, cx: &mut DrawContext<'_>) -> Result<(), ShapeError> {
        let data = cx.corner_data();
        let mut kept = self.drawn.lock().unwrap_or_else(PoisonError::into_inner);
        let drawn = match kept.iter().position(|(known, _)| *known == data) {
            Some(place) => kept.remove(place),
            None => {
                let drawn = self.drawn_with(&data)?;
                (data, drawn)
            }
        };
        let mesh = drawn.1.clone();
        kept.push(drawn);
        if kept.len() > WAYS {
            drop(kept.remove(0));
        }
        drop(kept);
        let Some((anchor, mesh)) = mesh else { return Ok(()) };
        let options = DrawOptions { two_sided: true, ..DrawOptions::plain(GeometryKind::Mesh) };
        cx.draw(Geometry::Mesh(mesh), &DAffine3::from_translation(anchor), options)
    }

    /// The mesh as a GPU gets it. Corners that look the same are one.
    fn drawn_with(&self, data: &CornerData) -> Result<Drawn, ShapeError> {
        // Relative to a corner, so that a mesh with large local coordinates keeps its digits.
        let anchor = self.triangles.first().and_then(|t| self.corners(t).first().copied());
        let Some(anchor) = anchor else { return Ok(None) };
        let mut mesh = Mesh::default();
        let mut known: HashMap<[u32; 4], u32> = HashMap::new();
        for (index, t) in self.triangles.iter().enumerate() {
            let triangle = self.triangle(t);
            let materials = data.colors.as_ref().and_then(|_| self.materials.get(index)).copied().unwrap_or_default();
            let [a, b, c] = triangle.points;
            let turned = self.outside_by_normals && (b - a).cross(c - a).dot(triangle.normals.into_iter().sum()) < 0.0;
            let mut corners = [0; 3];
            let uvs = if data.uvs { t.uvs } else { [0; 3] };
            let given = t.points.into_iter().zip(t.normals).zip(materials).zip(uvs);
            for ((corner, (((point, normal), material), uv)), k) in corners.iter_mut().zip(given).zip(0..) {
                let next = mesh.positions.len() as u32;
                *corner = *known.entry([point, normal, material, uv]).or_insert(next);
                if *corner == next {
                    let at = |of: &[DVec3; 3]| of.get(k).copied().unwrap_or_default();
                    if data.uvs {
                        mesh.uvs.push(triangle.uvs.get(k).copied().unwrap_or_default().as_vec2());
                    }
                    mesh.positions.push((at(&triangle.points) - anchor).as_vec3());
                    mesh.normals.push(at(&triangle.normals).as_vec3());
                    if let Some(colors) = &data.colors {
                        let color = colors.of(material, self.material_binding, ("face", t.face as usize))?;
                        mesh.colors.push(color);
                    }
                }
            }
            let [a, b, c] = corners;
            mesh.triangles.push(if turned { [a, c, b] } else { corners });
        }
        Ok(Some((anchor, Arc::new(mesh))))
    }
}

/// The State of a shape with its own VertexProperty, if it has one.
fn own_state(cx: &ShapeContext<'_>, key: Option<NodeKey>) -> Option<State> {
    let own = cx.scene.children(key?).first().copied()?;
    let property = cx.scene.get::<VertexProperty>(own)?;
    let mut state = cx.state.clone();
    // No visit of a walk: nobody asks this State who set what.
    let (scene, path, action) = (cx.scene, cx.path, ActionKind::Other);
    property.apply(&mut state, &PropertyContext { scene, key: own, path, action, visit: 0 });
    Some(state)
}

/// Draws with what a shape's own VertexProperty says.
pub(super) fn draw_with_own(
    cx: &mut DrawContext<'_>,
    draw: impl FnOnce(&mut DrawContext<'_>) -> Result<(), ShapeError>,
) -> Result<(), ShapeError> {
    match own_state(&cx.shape, cx.shape.path.tail()) {
        Some(state) => cx.with_state(&state, draw),
        None => draw(cx),
    }
}

/// What the mesh of a shape depends on, its own VertexProperty included.
pub(super) fn inputs(cx: &ShapeContext<'_>, key: Option<NodeKey>) -> MeshInputs {
    let own = own_state(cx, key);
    let state = own.as_ref().unwrap_or(cx.state);
    MeshInputs {
        version: key.and_then(|key| cx.scene.subtree_version(key)),
        coordinates: state.coordinates.clone(),
        normals: state.normals.clone(),
        normal_binding: state.normal_binding,
        material_binding: state.material_binding,
        texture_coordinates: state.texture_coordinates.clone(),
        hints: state.shape_hints.clone(),
    }
}

/// Takes faces and makes the mesh.
pub(super) struct Builder<'i> {
    inputs: &'i MeshInputs,
    /// What the indices of the shape say.
    pub(super) lists: Lists,
    triangles: Vec<MeshTriangle>,
    materials: Vec<[u32; 3]>,
    /// A normal per face, for those that are worked out.
    face_normals: Vec<DVec3>,
    /// Corners of the face: point, normal, texture coordinate, colour.
    polygon: Vec<[u32; 4]>,
}

impl<'i> Builder<'i> {
    fn new(inputs: &'i MeshInputs) -> Self {
        Self {
            inputs,
            lists: Lists::default(),
            triangles: Vec::new(),
            materials: Vec::new(),
            face_normals: Vec::new(),
            polygon: Vec::new(),
        }
    }

    /// Number of points that faces may refer to.
    pub(super) fn points(&self) -> usize {
        self.inputs.coordinates.len()
    }

    /// Adds a face. `indices`: the field that its corners come from, for messages.
    pub(super) fn face(
        &mut self,
        indices: &'static str,
        face: usize,
        part: usize,
        corners: &[Corner],
    ) -> Result<(), ShapeError> {
        let MeshInputs { coordinates, normals, normal_binding, material_binding, texture_coordinates, hints, .. } =
            self.inputs;
        let lists = &self.lists;
        self.polygon.clear();
        let mut around = DVec3::ZERO;
        let who = ("face", face);
        for corner in corners {
            let point =
                index(corner.point, coordinates.len(), indices, who, "points", "Coordinate3 or a vertex_property")?;
            let normal = match normals.is_empty() {
                true => 0,
                false => {
                    let number = normal_binding.number(&lists.normal, part, face, corner);
                    index(number, normals.len(), "normal_index", who, "normals", "Normal")?
                }
            };
            let uv = match texture_coordinates.is_empty() {
                true => point,
                false => index(
                    listed(&lists.texture, corner.at, corner.point),
                    texture_coordinates.len(),
                    "texture_coord_index",
                    who,
                    "texture coordinates",
                    "TextureCoordinate2",
                )?,
            };
            let material = color_number(material_binding.number(&lists.material, part, face, corner), who)?;
            self.polygon.push([point, normal, uv, material]);
        }
        let at = |corner: &[u32; 4]| coordinates.get(corner[0] as usize).copied().unwrap_or_default();
        let Some(&start) = self.polygon.first() else { return Ok(()) };
        // Newell's normal of a polygon, relative to a corner so that digits are not lost far from the origin.
        for pair in self.polygon.windows(2) {
            if let [a, b] = pair {
                around += (at(a) - at(&start)).cross(at(b) - at(&start));
            }
        }
        let clockwise = hints.vertex_ordering == VertexOrdering::Clockwise;
        if normals.is_empty() {
            let outwards = if clockwise { -around } else { around };
            // A face without area has no normal of its own.
            let unit = crate::action::unit(outwards).unwrap_or(DVec3::Z);
            let number = self.face_normals.len() as u32;
            self.face_normals.push(unit);
            for corner in &mut self.polygon {
                corner[1] = number;
            }
        }
        let colored = *material_binding != Binding::Overall;
        let (triangles, materials) = (&mut self.triangles, &mut self.materials);
        let mut add = |cut: [usize; 3], polygon: &[[u32; 4]]| {
            let [a, b, c] = cut.map(|k| polygon.get(k).copied().unwrap_or(start));
            let [a, b, c] = if clockwise { [a, c, b] } else { [a, b, c] };
            let of = |k: usize| [a, b, c].map(|corner| corner.get(k).copied().unwrap_or_default());
            let (face, part) = (face as u32, part as u32);
            triangles.push(MeshTriangle { points: of(0), normals: of(1), uvs: of(2), face, part });
            if colored {
                materials.push(of(3));
            }
        };
        if hints.face_type == FaceType::UnknownFaceType && self.polygon.len() > 3 {
            let points: Vec<DVec3> = self.polygon.iter().map(at).collect();
            for cut in ears(&points, around) {
                add(cut, &self.polygon);
            }
        } else {
            for k in 2..self.polygon.len() {
                add([0, k - 1, k], &self.polygon);
            }
        }
        Ok(())
    }

    fn finish(self) -> Result<FaceMesh, ShapeError> {
        let Self { inputs, mut triangles, materials, face_normals, .. } = self;
        let points = inputs.coordinates.clone();
        let used = || triangles.iter().flat_map(|t| t.points).filter_map(|k| points.get(k as usize).copied());
        let bounds = Aabb::of(used());
        let normals = if inputs.normals.is_empty() {
            let crease = inputs.hints.crease_angle;
            if crease > 0.0 { smooth(&mut triangles, &face_normals, points.len(), crease) } else { face_normals.into() }
        } else {
            inputs.normals.iter().map(|&n| crate::action::unit(n).unwrap_or(DVec3::Z)).collect()
        };
        let uvs = if inputs.texture_coordinates.is_empty() {
            box_coordinates(&points, bounds)
        } else {
            inputs.texture_coordinates.clone()
        };
        let ordering = inputs.hints.vertex_ordering;
        let outside_by_normals = !inputs.normals.is_empty() && ordering == VertexOrdering::UnknownOrdering;
        let material_binding = inputs.material_binding;
        Ok(FaceMesh {
            points,
            normals,
            uvs,
            triangles,
            materials,
            material_binding,
            bounds,
            outside_by_normals,
            ..FaceMesh::default()
        })
    }
}

/// The number of a colour, which is looked up when it is drawn. `who`: what has it, and its number.
pub(super) fn color_number(number: i64, who: (&str, usize)) -> Result<u32, ShapeError> {
    u32::try_from(number).map_err(|_| ShapeError::Field {
        field: "material_index",
        message: format!("there is no index for {} {}: the list is too short, or has {number} there", who.0, who.1),
    })
}

/// An index into a list, or what is wrong with it. `who`: what refers to it, and its number.
pub(super) fn index(
    value: i64,
    len: usize,
    field: &'static str,
    who: (&str, usize),
    what: &str,
    where_from: &str,
) -> Result<u32, ShapeError> {
    let (who, number) = who;
    match u32::try_from(value) {
        Ok(index) if (index as usize) < len => Ok(index),
        _ if len == 0 => Err(ShapeError::Field {
            field,
            message: format!("{who} {number} needs {what}, and there are none: put {where_from} before it"),
        }),
        _ => Err(ShapeError::Field {
            field,
            message: format!(
                "{who} {number} refers to number {value} of the {what}: there are {len}, from 0 to {}",
                len - 1
            ),
        }),
    }
}

/// Normals at corners: the mean of those of the faces around a point that meet the corner's own face at less than the crease
/// angle.
fn smooth(triangles: &mut [MeshTriangle], faces: &[DVec3], points: usize, crease: f64) -> List<DVec3> {
    // The faces around each point, one after the other; a face of several triangles counts once.
    let mut around: Vec<Vec<u32>> = vec![Vec::new(); points];
    for t in triangles.iter() {
        for (point, face) in t.points.into_iter().zip(t.normals) {
            if let Some(list) = around.get_mut(point as usize)
                && !list.contains(&face)
            {
                list.push(face);
            }
        }
    }
    let of = |face: u32| faces.get(face as usize).copied().unwrap_or(DVec3::Z);
    let limit = crease.cos();
    let mut made: HashMap<(u32, u32), u32> = HashMap::new();
    let mut normals = Vec::new();
    for t in triangles.iter_mut() {
        for (point, normal) in t.points.into_iter().zip(&mut t.normals) {
            let face = *normal;
            *normal = *made.entry((point, face)).or_insert_with(|| {
                let own = of(face);
                let list = around.get(point as usize).map_or(&[][..], Vec::as_slice);
                let sum = list.iter().map(|&f| of(f)).filter(|n| n.dot(own) >= limit).sum();
                normals.push(crate::action::unit(sum).unwrap_or(own));
                normals.len() as u32 - 1
            });
        }
    }
    normals.into()
}

/// Open Inventor's default texture coordinates: s along the longest side of the box from 0 to 1, t along the second longest in
/// the same scale.
fn box_coordinates(points: &[DVec3], bounds: Option<Aabb>) -> List<DVec2> {
    let Some(bounds) = bounds else { return List::default() };
    let size = bounds.size();
    let mut axes = [0, 1, 2];
    // Stable: equal sides in the order x, y, z.
    axes.sort_by(|&a, &b| size[b].total_cmp(&size[a]));
    let [s, t, _] = axes;
    let scale = if size[s] > 0.0 { 1.0 / size[s] } else { 0.0 };
    points.iter().map(|&p| DVec2::new(p[s] - bounds.min[s], p[t] - bounds.min[t]) * scale).collect()
}

/// Cuts a polygon into triangles, one ear after the other (Meisters, "Polygons have ears", 1975). `around` is its normal. What is
/// no simple polygon is cut somehow, in as many triangles.
fn ears(points: &[DVec3], around: DVec3) -> Vec<[usize; 3]> {
    // Seen along the axis that the normal follows most, the polygon keeps its turns.
    let a = around.abs();
    let flat: Vec<DVec2> = points
        .iter()
        .map(|p| match () {
            () if a.x >= a.y && a.x >= a.z => DVec2::new(p.y, p.z) * DVec2::new(around.x.signum(), 1.0),
            () if a.y >= a.z => DVec2::new(p.z, p.x) * DVec2::new(around.y.signum(), 1.0),
            () => DVec2::new(p.x, p.y) * DVec2::new(around.z.signum(), 1.0),
        })
        .collect();
    let at = |k: usize| flat.get(k).copied().unwrap_or_default();
    let turn = |a: DVec2, b: DVec2, c: DVec2| (b - a).perp_dot(c - a);
    let mut left: Vec<usize> = (0..points.len()).collect();
    let mut found = Vec::with_capacity(points.len());
    while left.len() > 3 {
        let n = left.len();
        let corner = |k: usize| left.get(k % n).copied().unwrap_or_default();
        let ear = (0..n).find(|&k| {
            let [a, b, c] = [k + n - 1, k, k + 1].map(|k| at(corner(k)));
            turn(a, b, c) > 0.0
                && left
                    .iter()
                    .map(|&k| at(k))
                    .filter(|p| *p != a && *p != b && *p != c)
                    .all(|p| turn(a, b, p) < 0.0 || turn(b, c, p) < 0.0 || turn(c, a, p) < 0.0)
        });
        // Without an ear the rest is flat or crosses itself.
        let k = ear.unwrap_or(1);
        found.push([corner(k + n - 1), corner(k), corner(k + 1)]);
        left.remove(k);
    }
    if let [a, b, c] = left.as_slice() {
        found.push([*a, *b, *c]);
    }
    found
}
