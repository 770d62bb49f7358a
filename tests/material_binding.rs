//! Materials of several values: which part, face or corner has which colour, in pictures and against what picks say; what they
//! cost, and what is wrong with numbers that lead nowhere.
#![cfg(feature = "render")]

mod common;

use common::gpu::linear;
use glam::Vec3;
use seamount::action::{CallbackAction, Frame, Geometry, linear_color};
use seamount::format::parse;
use seamount::node::{FaceDetail, HitDetail, Registry};
use seamount::prelude::*;

const SIZE: [u32; 2] = [96, 72];

/// Told apart by any mix of two.
const PALETTE: [[f32; 3]; 8] = [
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [1.0, 1.0, 0.0],
    [0.0, 1.0, 1.0],
    [1.0, 0.0, 1.0],
    [1.0, 1.0, 1.0],
    [0.5, 0.25, 0.0],
];

fn color(k: usize) -> Vec3 {
    linear_color(Vec3::from_array(PALETTE[k]))
}

fn palette(count: usize) -> String {
    let colors: Vec<String> = PALETTE[..count].iter().map(|[r, g, b]| format!("({r:?}, {g:?}, {b:?})")).collect();
    format!("[{}]", colors.join(", "))
}

/// Unlit, from above, 4 wide and 3 high.
fn scene_of(nodes: &str) -> Scene {
    let camera = "OrthographicCamera(position: (2.0, 1.5, 10.0), look_at: (2.0, 1.5, 0.0), height: 3.0)";
    scene_with(camera, nodes)
}

fn scene_with(camera: &str, nodes: &str) -> Scene {
    let text = format!("Scene(version: 1, root: Separator(children: [{camera}, {nodes}]))");
    parse(&text, &Registry::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn frame(scene: &Scene) -> Frame {
    RenderAction::new(SIZE[0], SIZE[1]).apply(scene).unwrap_or_else(|e| panic!("{e}"))
}

/// Every pixel that shows a face has the colour that `want` gives for what is picked there, on a black ground.
fn check(scene: &Scene, want: impl Fn(&PickedPoint) -> Vec3) {
    let picture = linear().draw(&frame(scene));
    let picker = RayPickAction::pixel(0, 0, SIZE).picker(scene).unwrap();
    let mut seen = 0;
    for (x, y) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))) {
        let at = |dx: f64, dy: f64| {
            let [w, h] = SIZE.map(f64::from);
            let ray = picker.ray_through((f64::from(x) + dx) / w, (f64::from(y) + dy) / h).unwrap();
            picker.pick(&ray, false).unwrap().into_iter().next()
        };
        let near = [(0.5, 0.5), (-0.5, 0.5), (1.5, 0.5), (0.5, -0.5), (0.5, 1.5)].map(|(dx, dy)| at(dx, dy));
        let colors = near.each_ref().map(|hit| hit.as_ref().map(&want));
        // On an edge rounding decides, and the rim of what is round is drawn by corners.
        let Some(colors) = colors.into_iter().collect::<Option<Vec<_>>>() else { continue };
        if colors.iter().any(|c| (*c - colors[0]).abs().max_element() > 0.1) {
            continue;
        }
        let [r, g, b, _] = picture.at(x, y);
        let got = Vec3::new(r, g, b);
        // 16-bit floats have 11 bits.
        assert!((got - colors[0]).abs().max_element() < 2e-3, "({x}, {y}): {got} is not {}: {:?}", colors[0], near[0]);
        seen += 1;
    }
    assert!(seen > 200, "{seen}");
}

fn face(hit: &PickedPoint) -> FaceDetail {
    match hit.detail {
        HitDetail::Face(detail) => detail,
        other => panic!("{other:?}"),
    }
}

/// The mix of what a function gives for the corners of the triangle that was hit.
fn mixed(hit: &PickedPoint, of_point: impl Fn(usize) -> usize) -> Vec3 {
    let detail = face(hit);
    let weighted =
        detail.points.iter().zip(detail.barycentric).map(|(&point, weight)| color(of_point(point)) * weight as f32);
    weighted.sum()
}

/// Six points: two squares side by side.
const POINTS: &str = "Coordinate3(point: [(0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (4.0, 0.0, 0.0), \
                      (0.0, 3.0, 0.0), (2.0, 3.0, 0.0), (4.0, 3.0, 0.0)])";

#[test]
fn faces_and_corners_have_the_colours_that_the_binding_says() {
    let scene = |binding: &str, index: &str| {
        scene_of(&format!(
            "Material(diffuse_color: {}), MaterialBinding(value: {binding}), {POINTS}, \
             IndexedFaceSet(coord_index: [0, 1, 4, 3, -1, 1, 2, 5, 4, -1]{index})",
            palette(8)
        ))
    };
    check(&scene("Overall", ""), |_| color(0));
    for binding in ["PerFace", "PerPart"] {
        check(&scene(binding, ""), |hit| color(face(hit).face));
        // A binding that is not indexed does not look at indices.
        check(&scene(binding, ", material_index: [5, 4]"), |hit| color(face(hit).face));
    }
    for binding in ["PerFaceIndexed", "PerPartIndexed"] {
        check(&scene(binding, ""), |hit| color(face(hit).face));
        check(&scene(binding, ", material_index: [5, 4]"), |hit| color([5, 4][face(hit).face]));
    }
    // The first square has the corners 0 to 3, the second those from 4 on.
    let running = |hit: &PickedPoint| {
        let corners = [[0, 1, 4, 3], [1, 2, 5, 4]][face(hit).face];
        mixed(hit, |point| 4 * face(hit).face + corners.iter().position(|&c| c == point).unwrap())
    };
    check(&scene("PerVertex", ""), running);
    check(&scene("PerVertexIndexed", ""), |hit| mixed(hit, |point| point));
    let listed = ", material_index: [7, 6, 5, 4, -1, 3, 2, 1, 0, -1]";
    check(&scene("PerVertexIndexed", listed), |hit| {
        let corners = [[0, 1, 4, 3], [1, 2, 5, 4]][face(hit).face];
        mixed(hit, |point| 7 - 4 * face(hit).face - corners.iter().position(|&c| c == point).unwrap())
    });
}

#[test]
fn strips_and_meshes_have_parts() {
    let scene = |binding: &str, nodes: &str| {
        let colors = palette(8);
        scene_of(&format!("Material(diffuse_color: {colors}), MaterialBinding(value: {binding}), {nodes}"))
    };
    // Two strips of two triangles, one above the other.
    let strips = "Coordinate3(point: [(0.0, 0.0, 0.0), (4.0, 0.0, 0.0), (0.0, 1.0, 0.0), (4.0, 1.0, 0.0), \
                  (0.0, 2.0, 0.0), (4.0, 2.0, 0.0), (0.0, 3.0, 0.0), (4.0, 3.0, 0.0)])";
    let plain = format!("{strips}, TriangleStripSet(num_vertices: [4, 4])");
    check(&scene("PerPart", &plain), |hit| color(face(hit).part));
    check(&scene("PerFace", &plain), |hit| color(face(hit).face));
    check(&scene("PerVertex", &plain), |hit| mixed(hit, |point| point));
    let indexed = |list: &str| {
        format!(
            "{strips}, IndexedTriangleStripSet(coord_index: [0, 1, 2, 3, -1, 4, 5, 6, 7, -1], material_index: {list})"
        )
    };
    check(&scene("PerPartIndexed", &indexed("[6, 3]")), |hit| color([6, 3][face(hit).part]));
    check(&scene("PerFaceIndexed", &indexed("[6, 3, 2, 1]")), |hit| color([6, 3, 2, 1][face(hit).face]));
    check(&scene("PerVertex", &indexed("-1")), |hit| mixed(hit, |point| point));
    // Two rows of one quadrilateral.
    let mesh = "Coordinate3(point: [(0.0, 3.0, 0.0), (4.0, 3.0, 0.0), (0.0, 2.0, 0.0), (4.0, 2.0, 0.0), \
                (0.0, 0.0, 0.0), (4.0, 0.0, 0.0)]), QuadMesh(vertices_per_row: 2, vertices_per_column: 3)";
    check(&scene("PerPart", mesh), |hit| color(face(hit).part));
    check(&scene("PerVertex", mesh), |hit| mixed(hit, |point| point));
    let polygons = "Coordinate3(point: [(0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (0.0, 3.0, 0.0), \
                    (2.0, 0.0, 0.0), (4.0, 0.0, 0.0), (4.0, 3.0, 0.0), (2.0, 3.0, 0.0)]), FaceSet(num_vertices: [3, 4])";
    check(&scene("PerFace", polygons), |hit| color(face(hit).face));
    check(&scene("PerVertex", polygons), |hit| mixed(hit, |point| point));
}

#[test]
fn parts_of_plain_shapes_are_numbered_as_in_open_inventor() {
    let axes = [DVec3::Z, DVec3::NEG_Z, DVec3::NEG_X, DVec3::X, DVec3::Y, DVec3::NEG_Y];
    for (from, shape) in
        [(1.0, "Cube()"), (-1.0, "Cube()"), (1.0, "Cylinder()"), (-1.0, "Cylinder()"), (-1.0, "Cone()")]
    {
        let camera = format!(
            "OrthographicCamera(position: ({}, {}, {}), look_at: (0.0, 0.0, 0.0), height: 4.0)",
            4.0 * from,
            3.0 * from,
            5.0 * from
        );
        let scene = |binding: &str| {
            let colors = palette(6);
            scene_with(
                &camera,
                &format!("Material(diffuse_color: {colors}), MaterialBinding(value: {binding}), {shape}"),
            )
        };
        let part = |hit: &PickedPoint| {
            let axis = axes.iter().position(|axis| axis.dot(hit.object_normal) > 0.999);
            match (shape, axis) {
                ("Cube()", Some(face)) => color(face),
                ("Cylinder()", Some(4)) => color(1),
                ("Cylinder()", Some(5)) => color(2),
                ("Cone()", Some(5)) => color(1),
                _ => color(0),
            }
        };
        check(&scene("PerPart"), part);
        check(&scene("PerPartIndexed"), part);
        check(&scene("PerVertex"), |_| color(0));
        let faces = scene("PerFace");
        if shape == "Cube()" { check(&faces, part) } else { check(&faces, |_| color(0)) }
    }
    // Parts that are taken away leave the numbers of the others.
    let mut numbers = Vec::new();
    let scene = scene_of("MaterialBinding(value: PerPart), Cylinder(parts: [Bottom])");
    CallbackAction::new().triangles(None, |_, t| numbers.push(t.materials)).apply(&scene).unwrap();
    assert!(!numbers.is_empty() && numbers.iter().all(|n| *n == [2; 3]), "{numbers:?}");
}

/// Lines along x and points, thick enough to be hit in their middle.
#[test]
fn lines_and_points_have_colours() {
    let points = "Coordinate3(point: [(0.0, 0.5, 0.0), (2.0, 0.5, 0.0), (4.0, 0.5, 0.0), \
                  (0.0, 2.5, 0.0), (2.0, 2.5, 0.0), (4.0, 2.5, 0.0)]), DrawStyle(line_width: 9.0, point_size: 9.0)";
    let lines = "LineSet(num_vertices: [3, 3])";
    let indexed =
        |list: &str| format!("IndexedLineSet(coord_index: [0, 1, 2, -1, 3, 4, 5, -1], material_index: {list})");
    // At quarters of both lines.
    let at = |binding: &str, shape: &str| {
        let colors = palette(8);
        let scene = scene_of(&format!(
            "Material(diffuse_color: {colors}), MaterialBinding(value: {binding}), {points}, {shape}"
        ));
        let picture = linear().draw(&frame(&scene));
        let place = |x: f64, y: f64| {
            let [r, g, b, _] = picture.at((x * 24.0) as u32, 71 - (y * 24.0) as u32);
            Vec3::new(r, g, b)
        };
        [0.5, 2.5].map(|y| [1.0, 3.0].map(|x| place(x, y)))
    };
    let same = |got: [[Vec3; 2]; 2], want: [[Vec3; 2]; 2]| {
        for (g, w) in got.into_iter().flatten().zip(want.into_iter().flatten()) {
            // Half a pixel of 48 aside.
            assert!((g - w).abs().max_element() < 0.02, "{got:?} is not {want:?}");
        }
    };
    let mid = |a: usize, b: usize| (color(a) + color(b)) * 0.5;
    same(at("Overall", lines), [[color(0); 2]; 2]);
    same(at("PerPart", lines), [[color(0), color(1)], [color(2), color(3)]]);
    same(at("PerFace", lines), [[color(0); 2], [color(1); 2]]);
    same(at("PerVertex", lines), [[mid(0, 1), mid(1, 2)], [mid(3, 4), mid(4, 5)]]);
    same(at("PerPartIndexed", &indexed("[7, 6, 5, 4]")), [[color(7), color(6)], [color(5), color(4)]]);
    same(at("PerFaceIndexed", &indexed("[7, 6]")), [[color(7); 2], [color(6); 2]]);
    same(at("PerVertexIndexed", &indexed("-1")), [[mid(0, 1), mid(1, 2)], [mid(3, 4), mid(4, 5)]]);
    let listed = indexed("[5, 4, 3, -1, 2, 1, 0, -1]");
    same(at("PerVertexIndexed", &listed), [[mid(5, 4), mid(4, 3)], [mid(2, 1), mid(1, 0)]]);

    for binding in ["PerPart", "PerFace", "PerVertex"] {
        let colors = palette(6);
        let scene = scene_of(&format!(
            "Material(diffuse_color: {colors}), MaterialBinding(value: {binding}), Translation(translation: (0.5, 0.0, 0.0)), \
             Scale(scale_factor: (0.75, 1.0, 1.0)), {points}, PointSet()"
        ));
        let picture = linear().draw(&frame(&scene));
        for k in 0..6 {
            let (x, y) = ([12, 48, 84][k % 3], if k < 3 { 60 } else { 12 });
            let [r, g, b, _] = picture.at(x, y);
            assert_eq!(Vec3::new(r, g, b).round(), color(k).round(), "{binding} {k}");
        }
    }
}

#[test]
fn a_vertex_property_brings_colours_with_opacity() {
    let square = "vertex: [(0.0, 0.0, 0.0), (4.0, 0.0, 0.0), (4.0, 3.0, 0.0), (0.0, 3.0, 0.0)]";
    let own = |rest: &str| format!("FaceSet(vertex_property: [VertexProperty({square}{rest})])");
    let packed = ", ordered_rgba: [0xff0000ff, 0x00ff00ff, 0x0000ffff, 0xffff00ff]";
    // Its own colours: before those of the Material, and for this shape alone.
    let per_vertex = own(&format!("{packed}, material_binding: PerVertex"));
    check(&scene_of(&format!("Material(diffuse_color: (1.0, 1.0, 1.0)), {per_vertex}")), |hit| mixed(hit, |p| p));
    check(&scene_of(&own(packed)), |_| color(0));
    let after = format!("Separator(children: [Translation(translation: (0.0, 0.0, -1.0)), {per_vertex}]), {}", own(""));
    check(&scene_of(&format!("BaseColor(rgb: (1.0, 1.0, 1.0)), {after}")), |_| color(6));
    // In a group on all that follow, until the next material.
    let group = format!("VertexProperty({square}{packed}, material_binding: PerVertex), FaceSet()");
    check(&scene_of(&group), |hit| mixed(hit, |p| p));
    let next = format!("VertexProperty({square}{packed}), BaseColor(rgb: (1.0, 0.0, 1.0)), FaceSet()");
    check(&scene_of(&next), |_| color(5));

    // Half of red over the background.
    let scene = scene_of(&own(", ordered_rgba: 0xff000080"));
    let frame = frame(&scene);
    assert!(frame.draws[0].effects.transparency && !frame.draws[0].effects.vertex_colors);
    let got = linear().draw(&frame).at(48, 36);
    assert!((got[0] - 128.0 / 255.0).abs() < 2e-3, "{got:?}");
}

#[test]
fn transparency_may_differ_over_a_shape() {
    let scene = scene_of(&format!(
        "Separator(children: [BaseColor(rgb: (0.0, 0.0, 1.0)), Translation(translation: (2.0, 1.5, -2.0)), \
         Cube(width: 9.0, height: 9.0)]), \
         Material(diffuse_color: [(1.0, 0.0, 0.0), (1.0, 0.0, 0.0)], transparency: [0.0, 0.75]), \
         MaterialBinding(value: PerFace), {POINTS}, IndexedFaceSet(coord_index: [0, 1, 4, 3, -1, 1, 2, 5, 4, -1])"
    ));
    let picture = linear().draw(&frame(&scene));
    let near = |got: [f32; 4], want: [f32; 3]| got.iter().zip(want).all(|(g, w)| (g - w).abs() < 2e-3);
    assert!(near(picture.at(24, 36), [1.0, 0.0, 0.0]), "{:?}", picture.at(24, 36));
    assert!(near(picture.at(72, 36), [0.25, 0.0, 0.75]), "{:?}", picture.at(72, 36));
    // The last transparency goes on; what is wholly see-through is not drawn.
    let glass = format!("Material(diffuse_color: {}, transparency: 1.0), MaterialBinding(value: PerPart)", palette(6));
    assert!(frame(&scene_of(&format!("{glass}, Cube()"))).draws.is_empty());
}

/// Colours that do not differ over a shape cost nothing, whatever the binding.
#[test]
fn one_colour_costs_no_vertex_data() {
    let of = |nodes: &str| frame(&scene_of(&format!("{nodes}, {POINTS}, FaceSet(num_vertices: [3, 3]), Cone()")));
    let plain = of("BaseColor()");
    for nodes in [
        "BaseColor(), MaterialBinding(value: PerVertex)",
        "BaseColor(rgb: [(0.8, 0.8, 0.8), (1.0, 0.0, 0.0)])",
        "Material(transparency: [0.0, 0.0]), MaterialBinding(value: PerFaceIndexed)",
        // An empty list leaves what was.
        "Material(diffuse_color: [], shininess: []), MaterialBinding(value: PerPart)",
    ] {
        let frame = of(nodes);
        for (got, want) in frame.draws.iter().zip(&plain.draws) {
            assert_eq!((got.effects, got.material), (want.effects, want.material), "{nodes}");
            let (Geometry::Mesh(got), Geometry::Mesh(want)) = (&got.geometry, &want.geometry) else { panic!() };
            assert_eq!(got, want, "{nodes}");
            assert!(got.colors.is_empty());
        }
    }
    // Corners that look the same are one; colours that differ take them apart.
    let colored = |binding: &str| {
        let colors = palette(8);
        let frame = frame(&scene_of(&format!(
            "BaseColor(rgb: {colors}), MaterialBinding(value: {binding}), {POINTS}, \
             IndexedFaceSet(coord_index: [0, 1, 4, 3, -1, 1, 2, 5, 4, -1]), Normal(vector: (0.0, 0.0, 1.0))"
        )));
        let Geometry::Mesh(mesh) = &frame.draws[0].geometry else { panic!() };
        assert_eq!(mesh.colors.len(), mesh.positions.len());
        mesh.positions.len()
    };
    assert_eq!((colored("PerVertexIndexed"), colored("PerFace")), (8, 8));
}

/// What is drawn follows each edit of colours, without anything else being made anew.
#[test]
fn edited_colours_are_drawn() {
    let mut scene = scene_of(&format!(
        "Def(\"colors\", Material(diffuse_color: [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])), Def(\"binding\", \
         MaterialBinding(value: PerFace)), {POINTS}, IndexedFaceSet(coord_index: [0, 1, 4, 3, -1, 1, 2, 5, 4, -1])"
    ));
    check(&scene, |hit| color(face(hit).face));
    let colors = scene.find("colors").unwrap();
    scene.edit::<Material>(colors).unwrap().diffuse_color.make_mut()[0] = Color::WHITE;
    check(&scene, |hit| color([6, 1][face(hit).face]));
    let binding = scene.find("binding").unwrap();
    scene.edit::<MaterialBinding>(binding).unwrap().value = Binding::Overall;
    check(&scene, |_| color(6));
}

#[test]
fn numbers_that_lead_nowhere_are_errors_with_their_place() {
    let error = |nodes: &str| {
        let scene = scene_of(&format!("Material(diffuse_color: {}), {nodes}", palette(3)));
        RenderAction::new(8, 8).apply(&scene).unwrap_err().to_string()
    };
    let faces = "IndexedFaceSet(coord_index: [0, 1, 4, 3, -1, 1, 2, 5, 4, -1]";
    let bound =
        |binding: &str, rest: &str| error(&format!("MaterialBinding(value: {binding}), {POINTS}, {faces}{rest})"));
    let far = bound("PerFaceIndexed", ", material_index: [0, 3]");
    assert!(far.contains("material_index: face 1 asks for colour number 3: there are 3, from 0 to 2"), "{far}");
    assert!(far.contains("IndexedFaceSet[4]") && far.starts_with("1:"), "{far}");
    let short = bound("PerVertexIndexed", ", material_index: [0, 1, 2, 0, -1, 1]");
    assert!(short.contains("material_index: there is no index for face 1: the list is too short"), "{short}");
    let few = bound("PerVertex", "");
    assert!(few.contains("MaterialBinding: face 0 asks for colour number 3"), "{few}");
    let cube = error("MaterialBinding(value: PerPart), Cube()");
    assert!(cube.contains("MaterialBinding: triangle 6 asks for colour number 3: there are 3"), "{cube}");
    let lines = error(&format!("MaterialBinding(value: PerPart), {POINTS}, LineSet()"));
    assert!(lines.contains("MaterialBinding: line 0 asks for colour number 3"), "{lines}");
}
