//! Sets of faces: against all of their triangles one by one, closed surfaces, errors of meaning, and that what is kept is
//! current.

mod common;

use common::Rng;
use glam::DVec3;
use seamount::action::{CallbackAction, PrimitiveCountAction, intersect_triangle};
use seamount::format::parse;
use seamount::node::{FaceDetail, FaceSet, HitDetail, Registry, Triangle};
use seamount::prelude::*;

fn scene_of(nodes: &str) -> Scene {
    let text = format!("Scene(version: 1, root: Separator(children: [{nodes}]))");
    parse(&text, &Registry::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn triangles(scene: &Scene) -> Vec<Triangle> {
    let mut found = Vec::new();
    CallbackAction::new().triangles(None, |_, t| found.push(*t)).apply(scene).expect("triangles");
    found
}

fn pick(scene: &Scene, ray: Ray, all: bool) -> Vec<PickedPoint> {
    RayPickAction { all, ..RayPickAction::ray(ray) }.apply(scene).expect("a pick")
}

fn detail(point: &PickedPoint) -> FaceDetail {
    match point.detail {
        HitDetail::Face(detail) => detail,
        other => panic!("{other:?}"),
    }
}

/// A height field of n × n points as an IndexedFaceSet, with bits that make every coordinate exact.
fn field(n: i32, rng: &mut Rng) -> (Coordinate3, IndexedFaceSet) {
    let points: List<DVec3> =
        (0..n * n).map(|k| DVec3::new(f64::from(k % n), f64::from(k / n), f64::from(rng.below(64)) / 16.0)).collect();
    let mut indices = Vec::new();
    for row in 0..n - 1 {
        for column in 0..n - 1 {
            let a = row * n + column;
            indices.extend([a, a + 1, a + n + 1, -1, a, a + n + 1, a + n, -1]);
        }
    }
    (Coordinate3 { point: points }, IndexedFaceSet { coord_index: indices.into(), ..IndexedFaceSet::default() })
}

fn scene_with(nodes: (Coordinate3, IndexedFaceSet)) -> (Scene, NodeKey) {
    let mut scene = Scene::new();
    let root = scene.root();
    let points = scene.add(root, nodes.0).expect("a child");
    scene.add(root, nodes.1).expect("a child");
    (scene, points)
}

#[test]
fn the_tree_hides_no_triangle() {
    let mut rng = Rng(3);
    for n in [2, 3, 9, 40] {
        let (scene, _) = scene_with(field(n, &mut rng));
        let all = triangles(&scene);
        let size = f64::from(n);
        for k in 0..600 {
            // Every third ray aims at a corner, an edge or along an axis, where ties are.
            let target = match k % 3 {
                0 => all[rng.below(all.len() as u32) as usize].points[0],
                1 => DVec3::new(rng.range(0.0, size), f64::from(rng.below(n as u32)), rng.range(0.0, 4.0)),
                _ => DVec3::new(rng.range(0.0, size), rng.range(0.0, size), rng.range(0.0, 4.0)),
            };
            let from = match k % 4 {
                0 => target + DVec3::Z * 50.0,
                1 => DVec3::new(-1e6, rng.range(-1e6, 1e6), rng.range(10.0, 1e6)),
                _ => DVec3::new(rng.range(-9.0, 50.0), rng.range(-9.0, 50.0), rng.range(-9.0, 20.0)),
            };
            if from == target {
                continue;
            }
            let ray = Ray::new(from, target - from).expect("a ray");
            let brute: Vec<f64> = all.iter().filter_map(|t| intersect_triangle(&ray, t)).map(|hit| hit.t).collect();
            let first = pick(&scene, ray, false);
            let nearest = brute.iter().copied().min_by(f64::total_cmp);
            assert_eq!(first.first().map(|p| p.distance), nearest, "{ray:?}");
            // All crossings, once each: the same distances but for what edges and corners add.
            let hits = pick(&scene, ray, true);
            let got: Vec<f64> = hits.iter().map(|p| p.distance).collect();
            assert!(got.iter().all(|t| brute.contains(t)), "{got:?} {brute:?}");
            assert!(brute.iter().all(|t| got.iter().any(|g| (g - t).abs() <= 1e-9 * (1.0 + t))), "{got:?} {brute:?}");
            // Over a ridge a ray may come out where it went in, as far as numbers tell; the same way twice it may not.
            let side = |p: &PickedPoint| p.normal.dot(ray.direction) > 0.0;
            let twice = hits.windows(2).any(|w| w[0].distance == w[1].distance && side(&w[0]) == side(&w[1]));
            assert!(!twice, "one crossing twice: {hits:?}");
        }
    }
}

#[test]
fn a_ray_onto_a_height_field_is_never_lost() {
    let mut rng = Rng(11);
    let (scene, _) = scene_with(field(33, &mut rng));
    for k in 0..4000 {
        // On lattice lines, diagonals and points as well as between.
        let step = [1.0, 0.5, 0.25, 1.0 / 3.0][k % 4];
        let place = |rng: &mut Rng| (f64::from(rng.below(129)) * step).min(32.0);
        let (x, y) = (place(&mut rng), place(&mut rng));
        let down = Ray::new(DVec3::new(x, y, 1e5), DVec3::NEG_Z).expect("a ray");
        assert_eq!(pick(&scene, down, true).len(), 1, "{x} {y}");
    }
}

#[test]
fn what_is_kept_of_a_mesh_follows_every_edit() {
    let mut rng = Rng(5);
    let (mut scene, points) = scene_with(field(5, &mut rng));
    let down = Ray::new(DVec3::new(1.25, 1.5, 100.0), DVec3::NEG_Z).expect("a ray");
    let before = pick(&scene, down, false)[0].point;
    scene.edit::<Coordinate3>(points).expect("the points").point.make_mut().iter_mut().for_each(|p| p.z += 7.0);
    assert_eq!(pick(&scene, down, false)[0].point, before + DVec3::Z * 7.0);
    let bounds = BoundingBoxAction::default().apply(&scene).expect("a box").expect("not empty");
    assert!(bounds.min.z >= 7.0, "{bounds:?}");

    // One shape below two sets of points has a mesh for each.
    let root = scene.root();
    let shape = scene.children(root)[1];
    let other = scene.add(root, Separator::default()).expect("a child");
    scene.add(other, Translation { translation: DVec3::X * 100.0 }).expect("a child");
    scene.add(other, field(5, &mut rng).0).expect("a child");
    scene.add_child(other, shape).expect("a child");
    let there = Ray::new(DVec3::new(101.25, 1.5, 100.0), DVec3::NEG_Z).expect("a ray");
    for _ in 0..2 {
        assert_eq!(pick(&scene, down, false)[0].point, before + DVec3::Z * 7.0);
        assert!(pick(&scene, there, false)[0].point.z < 5.0);
    }
}

const SQUARE: &str = "Coordinate3(point: [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)])";

#[test]
fn all_sets_of_faces_show_the_same_square() {
    let strip = "Coordinate3(point: [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (1.0, 1.0, 0.0)])";
    let own = "VertexProperty(vertex: [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)])";
    let down = Ray::new(DVec3::new(0.3, 0.6, 5.0), DVec3::NEG_Z).expect("a ray");
    for nodes in [
        format!("{SQUARE}, IndexedFaceSet(coord_index: [0, 1, 2, 3])"),
        format!("{SQUARE}, FaceSet()"),
        format!("{SQUARE}, FaceSet(num_vertices: [4])"),
        format!("FaceSet(vertex_property: [{own}])"),
        format!("{strip}, TriangleStripSet()"),
        format!("{strip}, IndexedTriangleStripSet(coord_index: [0, 1, 2, 3, -1])"),
        "Coordinate3(point: [(0.0, 1.0, 0.0), (1.0, 1.0, 0.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)]), \
         QuadMesh(vertices_per_row: 2, vertices_per_column: 2)"
            .to_owned(),
        format!("ShapeHints(face_type: UnknownFaceType), {SQUARE}, FaceSet()"),
        format!("ShapeHints(vertex_ordering: Clockwise), {SQUARE}, IndexedFaceSet(coord_index: [3, 2, 1, 0, -1])"),
    ] {
        let scene = scene_of(&nodes);
        let hits = pick(&scene, down, true);
        assert_eq!(hits.len(), 1, "{nodes}");
        assert_eq!((hits[0].point, hits[0].normal), (DVec3::new(0.3, 0.6, 0.0), DVec3::Z), "{nodes}");
        assert!((hits[0].uv - glam::DVec2::new(0.3, 0.6)).length() < 1e-12, "{nodes}: {}", hits[0].uv);
        assert_eq!(PrimitiveCountAction::default().apply(&scene).expect("a count").triangles, 2, "{nodes}");
        assert_eq!(detail(&hits[0]).part, 0);
    }
}

#[test]
fn normals_go_where_their_binding_says() {
    let bound = |binding: &str, normals: &str, more: &str| {
        scene_of(&format!(
            "{SQUARE}, Normal(vector: [{normals}]), NormalBinding(value: {binding}), \
             IndexedFaceSet(coord_index: [0, 1, 2, -1, 0, 2, 3, -1]{more})"
        ))
    };
    let (x, y, z) = ("(1.0, 0.0, 0.0)", "(0.0, 1.0, 0.0)", "(0.0, 0.0, 1.0)");
    // The first face is right below the diagonal, the second left above.
    let at = |scene: &Scene, x: f64, y: f64| {
        let down = Ray::new(DVec3::new(x, y, 5.0), DVec3::NEG_Z).expect("a ray");
        pick(scene, down, false)[0].normal
    };
    let both = |scene: &Scene| (at(scene, 0.75, 0.25), at(scene, 0.25, 0.75));
    assert_eq!(both(&bound("Overall", x, "")), (DVec3::X, DVec3::X));
    assert_eq!(both(&bound("PerFace", &format!("{x}, {y}"), "")), (DVec3::X, DVec3::Y));
    assert_eq!(both(&bound("PerFaceIndexed", &format!("{x}, {y}"), ", normal_index: [1, 0]")), (DVec3::Y, DVec3::X));
    let corners = format!("{x}, {x}, {x}, {z}, {z}, {z}");
    assert_eq!(both(&bound("PerVertex", &corners, "")), (DVec3::X, DVec3::Z));
    let indexed = bound("PerVertexIndexed", &format!("{x}, {z}"), ", normal_index: [0, 0, 0, -1, 1, 1, 1, -1]");
    assert_eq!(both(&indexed), (DVec3::X, DVec3::Z));
    // Without indices of its own a normal has the index of its point.
    let by_point = bound("PerVertexIndexed", &format!("{y}, {y}, {y}, {y}"), "");
    assert_eq!(both(&by_point), (DVec3::Y, DVec3::Y));
}

#[test]
fn edges_below_the_crease_angle_are_smooth() {
    let roof = |angle: f64| {
        scene_of(&format!(
            "ShapeHints(crease_angle: {angle:?}), \
             Coordinate3(point: [(-1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), \
             (-1.0, 1.0, 0.0), (0.0, 1.0, 1.0), (1.0, 1.0, 0.0)]), \
             IndexedFaceSet(coord_index: [0, 1, 4, 3, -1, 1, 2, 5, 4, -1])"
        ))
    };
    // The two halves meet at a right angle.
    let ridge = |scene: &Scene| {
        let found = triangles(scene);
        found
            .iter()
            .flat_map(|t| t.points.into_iter().zip(t.normals))
            .filter(|(p, _)| p.z == 1.0)
            .map(|(_, n)| n)
            .collect::<Vec<_>>()
    };
    assert!(ridge(&roof(1.5)).iter().all(|n| n.x.abs() > 0.7));
    assert!(ridge(&roof(1.6)).iter().all(|n| n.x.abs() < 1e-12 && n.z.abs() > 0.99));
}

#[test]
fn a_polygon_with_a_notch_is_cut_along_its_ears() {
    // An arrow head: a fan from its first corner would cover the notch.
    let points = "Coordinate3(point: [(0.0, 0.0, 0.0), (2.0, 1.0, 0.0), (0.0, 2.0, 0.0), (1.0, 1.0, 0.0)])";
    let scene = scene_of(&format!("ShapeHints(face_type: UnknownFaceType), {points}, FaceSet()"));
    let hits = |x: f64, y: f64| {
        let down = Ray::new(DVec3::new(x, y, 5.0), DVec3::NEG_Z).expect("a ray");
        pick(&scene, down, true).len()
    };
    assert_eq!((hits(0.5, 1.0), hits(1.5, 1.0), hits(0.25, 0.25), hits(0.25, 1.75)), (0, 1, 1, 1));
    let area: f64 = triangles(&scene)
        .iter()
        .map(|t| (t.points[1] - t.points[0]).cross(t.points[2] - t.points[0]).length() / 2.0)
        .sum();
    assert!((area - 1.0).abs() < 1e-12, "{area}");
}

#[test]
fn an_index_that_leads_nowhere_is_told_with_its_place() {
    for (nodes, expected) in [
        (
            "IndexedFaceSet(coord_index: [0, 1, 2, -1])",
            "coord_index: face 0 needs points, and there are none: put Coordinate3",
        ),
        (
            "Coordinate3(point: [(0.0, 0.0, 0.0)]), IndexedFaceSet(coord_index: [0, 0, 7, -1])",
            "coord_index: face 0 refers to number 7 of the points: there are 1, from 0 to 0",
        ),
        (
            "Coordinate3(point: [(0.0, 0.0, 0.0)]), Normal(vector: [(0.0, 0.0, 1.0)]), \
             IndexedFaceSet(coord_index: [0, 0, 0, -1], normal_index: [0, 0, 3, -1])",
            "normal_index: face 0 refers to number 3 of the normals",
        ),
        ("Coordinate3(), FaceSet(num_vertices: [3])", "num_vertices: face 0 refers to number 2 of the points"),
        ("Coordinate3(), FaceSet(num_vertices: [2000000000])", "num_vertices: face 0 refers to number 1999999999"),
        ("Coordinate3(), FaceSet(start_index: -4, num_vertices: [3])", "start_index: -4 is no index"),
        ("Coordinate3(), FaceSet(num_vertices: [-7])", "num_vertices: -7 is no number of vertices"),
        (
            "Coordinate3(), QuadMesh(vertices_per_row: 60000, vertices_per_column: 60000)",
            "refers to number 60000 of the points",
        ),
    ] {
        let scene = scene_of(nodes);
        let error = BoundingBoxAction::default().apply(&scene).expect_err(nodes).to_string();
        assert!(error.contains(expected), "{nodes}: {error}");
        assert!(error.starts_with("1:"), "no position: {error}");
        let ray = Ray::new(DVec3::Z, DVec3::NEG_Z).expect("a ray");
        assert!(RayPickAction::ray(ray).apply(&scene).is_err());
    }
}

#[test]
fn round_shapes_are_met_where_their_surface_is() {
    let mut rng = Rng(17);
    // Implicit surfaces of the default shapes: below zero inside.
    type Inside = (&'static str, fn(DVec3) -> f64);
    let inside: [Inside; 3] = [
        ("Sphere()", |p| p.length() - 1.0),
        ("Cylinder()", |p| (p.x.hypot(p.z) - 1.0).max(p.y.abs() - 1.0)),
        ("Cone()", |p| (p.x.hypot(p.z) - (1.0 - p.y) * 0.5).max(-1.0 - p.y)),
    ];
    for (kind, distance) in inside {
        let scene = scene_of(kind);
        for k in 0..2000 {
            let scale = if k % 5 == 0 { 1e6 } else { 4.0 };
            let from = DVec3::new(rng.range(-scale, scale), rng.range(-scale, scale), rng.range(-scale, scale));
            let to = DVec3::new(rng.range(-1.2, 1.2), rng.range(-1.2, 1.2), rng.range(-1.2, 1.2));
            let Ok(ray) = Ray::new(from, to - from) else { continue };
            let hits = pick(&scene, ray, true);
            let far = from.length();
            for hit in &hits {
                assert!(distance(hit.point).abs() < 1e-9 + far * 1e-14, "{kind}: {hit:?}");
            }
            // What is inside in the middle between two crossings is inside for good: the shapes are convex.
            let expected = if distance(from) < 0.0 { 1 } else { 2 };
            assert!(hits.len() == expected || hits.is_empty(), "{kind}: {hits:?}");
            let margin = 1e-6 + far * 1e-9;
            if distance(to) < -margin {
                assert_eq!(hits.len(), expected, "{kind}: a ray is lost, {ray:?}");
            }
            let picked = pick(&scene, ray, false);
            assert_eq!(picked.first().map(|p| p.distance), hits.first().map(|p| p.distance));
        }
    }
}

#[test]
fn parts_that_are_not_there_are_not_met() {
    let down = Ray::new(DVec3::new(0.3, 9.0, 0.2), DVec3::NEG_Y).expect("a ray");
    let across = Ray::new(DVec3::new(-9.0, 0.5, 0.1), DVec3::X).expect("a ray");
    for (shape, vertical, horizontal) in [
        ("Cylinder(parts: [Sides])", 0, 2),
        ("Cylinder(parts: [Top])", 1, 0),
        ("Cylinder(parts: [Bottom, Top])", 2, 0),
        ("Cone(parts: [Bottom])", 1, 0),
        ("Cone(parts: [Sides])", 1, 2),
        ("Cone(parts: [])", 0, 0),
    ] {
        let scene = scene_of(shape);
        assert_eq!(pick(&scene, down, true).len(), vertical, "{shape}");
        assert_eq!(pick(&scene, across, true).len(), horizontal, "{shape}");
        assert_eq!(BoundingBoxAction::default().apply(&scene).expect("a box").is_none(), shape == "Cone(parts: [])");
    }
}

#[test]
fn an_empty_face_set_is_nothing() {
    let mut scene = Scene::new();
    let root = scene.root();
    for node in [Box::new(FaceSet::default()) as Box<dyn Node>, Box::new(IndexedFaceSet::default())] {
        let key = scene.insert_boxed(node);
        scene.add_child(root, key).expect("a child");
    }
    assert_eq!(BoundingBoxAction::default().apply(&scene).expect("a box"), None);
}
