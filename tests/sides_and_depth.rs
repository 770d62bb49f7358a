//! Which sides of faces are drawn and lit (ShapeHints), and faces moved in depth (PolygonOffset).
#![cfg(feature = "render")]

mod common;

use common::gpu::{LinearPicture, linear};
use seamount::action::{CallbackAction, intersect_triangle};
use seamount::format::parse;
use seamount::node::Registry;
use seamount::prelude::*;

const SIZE: [u32; 2] = [60, 40];

fn picture(nodes: &str) -> LinearPicture {
    let text = format!("Scene(version: 1, root: Separator(children: [{nodes}]))");
    let scene = parse(&text, &Registry::default()).unwrap_or_else(|e| panic!("{e}"));
    linear().draw(&RenderAction::new(SIZE[0], SIZE[1]).apply(&scene).unwrap())
}

fn middle(nodes: &str) -> [f32; 3] {
    let [r, g, b, _] = picture(nodes).at(30, 20);
    [r, g, b]
}

/// From above and from below.
const EYES: [&str; 2] = [
    "OrthographicCamera(position: (0.0, 0.0, 10.0), look_at: (0.0, 0.0, 0.0), height: 4.0),",
    "OrthographicCamera(position: (0.0, 0.0, -10.0), look_at: (0.0, 0.0, 0.0), height: 4.0),",
];

/// A square whose corners run counter-clockwise seen from above.
const SQUARE: &str = "Coordinate3(point: [(-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 1.0, 0.0), (-1.0, 1.0, 0.0)]),
    IndexedFaceSet(coord_index: [0, 1, 2, 3])";

/// Open Inventor's table: back faces are left out when the ordering is known and the shape is solid.
#[test]
fn back_faces_of_solids_alone_are_left_out() {
    for (hints, above, below) in [
        ("", true, true),
        ("ShapeHints(shape_type: Solid),", true, true),
        ("ShapeHints(vertex_ordering: Counterclockwise),", true, true),
        ("ShapeHints(vertex_ordering: Clockwise),", true, true),
        ("ShapeHints(vertex_ordering: Counterclockwise, shape_type: Solid),", true, false),
        ("ShapeHints(vertex_ordering: Clockwise, shape_type: Solid),", false, true),
    ] {
        for mirror in ["", "Scale(scale_factor: (-1.0, 1.0, 1.0)),"] {
            for (eye, seen) in EYES.into_iter().zip([above, below]) {
                let got = middle(&format!("{eye} {mirror} {hints} {SQUARE}"))[0] > 0.0;
                assert_eq!(got, seen, "{hints} {mirror} {eye}");
            }
        }
    }
}

/// What is seen from both sides is as bright on one as on the other, under a light that shines from the eye; with normals that
/// are worked out and with given ones, however the corners run.
#[test]
fn light_falls_on_the_side_that_is_seen() {
    let light = "Environment(ambient_intensity: 0.0), Material(diffuse_color: (1.0, 1.0, 1.0)),";
    for normals in ["", "NormalBinding(value: Overall), Normal(vector: [(0.0, 0.0, 1.0)]),"] {
        for (ordering, indices) in [
            ("UnknownOrdering", "0, 1, 2, 3"),
            ("UnknownOrdering", "3, 2, 1, 0"),
            ("Counterclockwise", "0, 1, 2, 3"),
            ("Clockwise", "3, 2, 1, 0"),
        ] {
            for (eye, down) in EYES.into_iter().zip([-1.0, 1.0]) {
                let square = SQUARE.replace("0, 1, 2, 3", indices);
                let got = middle(&format!(
                    "{eye} {light} DirectionalLight(direction: (0.0, 0.6, {})),
                     ShapeHints(vertex_ordering: {ordering}), {normals} {square}",
                    0.8 * down
                ));
                assert!((got[0] - 0.8).abs() < 2e-3, "{normals} {ordering} {indices} {eye}: {got:?}");
                // From behind there is none.
                let dark = middle(&format!(
                    "{eye} {light} DirectionalLight(direction: (0.0, 0.6, {})),
                     ShapeHints(vertex_ordering: {ordering}), {normals} {square}",
                    -0.8 * down
                ));
                assert!(dark[0] == 0.0, "{normals} {ordering} {indices} {eye}: {dark:?}");
            }
        }
    }
}

/// A terrain is seen from above; from below only if its hints say so.
#[test]
fn the_ground_is_seen_from_below_if_hints_say_so() {
    let mut scene = Scene::with_root(Separator::default());
    let root = scene.root();
    let (position, look_at) = (Some(DVec3::new(0.5, 0.5, -4.0)), Some(DVec3::new(0.5, 0.5, 0.0)));
    scene.add(root, PerspectiveCamera { position, look_at, ..Default::default() }).unwrap();
    let hints = scene.add(root, ShapeHints::default()).unwrap();
    scene.add(root, Texture2::from_image(Image::new(3, 3, Pixels::Gray16(vec![7; 9])).unwrap())).unwrap();
    scene.add(root, SeamlessTerrain::default()).unwrap();
    let shown =
        |scene: &Scene| linear().draw(&RenderAction::new(SIZE[0], SIZE[1]).apply(scene).unwrap()).at(30, 20)[0] > 0.0;
    assert!(!shown(&scene));
    scene.edit::<ShapeHints>(hints).unwrap().vertex_ordering = VertexOrdering::Counterclockwise;
    assert!(shown(&scene));
    scene.edit::<ShapeHints>(hints).unwrap().shape_type = ShapeType::Solid;
    assert!(!shown(&scene));
}

/// Two meshes in one plane, the first cut along the other diagonal, so that their depths differ by rounding alone.
fn coplanar(slope: f64, eye: &str, before_second: &str) -> LinearPicture {
    let points = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let points = points.map(|(x, y)| format!("({x:?}, {y:?}, {:?})", slope * (0.7 * x + 0.3 * y))).join(", ");
    picture(&format!(
        "{eye} LightModel(model: BaseColor), Coordinate3(point: [{points}]),
         BaseColor(rgb: (1.0, 0.0, 0.0)), IndexedFaceSet(coord_index: [0, 1, 2, 3]),
         BaseColor(rgb: (0.0, 1.0, 0.0)), {before_second} IndexedFaceSet(coord_index: [1, 2, 3, 0])"
    ))
}

#[test]
fn an_offset_decides_which_of_two_faces_in_one_plane_is_seen() {
    let perspective = "PerspectiveCamera(position: (0.3, -5.0, 2.0), look_at: (0.0, 0.0, 0.0)),";
    for (slope, eye) in [(0.0, EYES[0]), (0.5, EYES[0]), (0.0, perspective), (0.8, perspective)] {
        let count = |before: &str| {
            let picture = coplanar(slope, eye, before);
            let of = |channel: usize| picture.texels.iter().filter(|t| t[channel] > 0.0).count();
            [of(0), of(1)]
        };
        let [red, green] = count("PolygonOffset(factor: 1.0, units: 4.0),");
        assert!(red > 100 && green == 0, "behind: {red} {green}, {slope} {eye}");
        let [red, green] = count("PolygonOffset(factor: -1.0, units: -4.0),");
        assert!(green > 100 && red == 0, "in front: {red} {green}, {slope} {eye}");
        // What is off, or for another style, moves nothing: the same as without.
        let without = coplanar(slope, eye, "").texels;
        for idle in ["PolygonOffset(units: 4.0, on: false),", "PolygonOffset(units: 4.0, styles: [Lines, Points]),"] {
            assert!(coplanar(slope, eye, idle).texels == without, "{idle}");
        }
    }
}

/// The usual use: lines on faces, drawn first, are seen whole in front of faces that are moved back, and not moved themselves.
#[test]
fn lines_are_seen_in_front_of_faces_that_are_moved_back() {
    let with = |offset: &str| {
        picture(&format!(
            "PerspectiveCamera(position: (0.3, -5.0, 2.0), look_at: (0.0, 0.0, 0.0)), LightModel(model: BaseColor),
             Coordinate3(point: [(-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 1.0, 0.3), (-1.0, 1.0, 0.3)]), {offset}
             BaseColor(rgb: (0.0, 1.0, 0.0)), IndexedLineSet(coord_index: [0, 2, -1, 1, 3]),
             BaseColor(rgb: (1.0, 0.0, 0.0)), IndexedFaceSet(coord_index: [0, 1, 2, 3])"
        ))
    };
    let green = |picture: LinearPicture| picture.texels.iter().filter(|t| t[1] > 0.0).count();
    let alone = picture(
        "PerspectiveCamera(position: (0.3, -5.0, 2.0), look_at: (0.0, 0.0, 0.0)), LightModel(model: BaseColor),
         Coordinate3(point: [(-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 1.0, 0.3), (-1.0, 1.0, 0.3)]),
         BaseColor(rgb: (0.0, 1.0, 0.0)), IndexedLineSet(coord_index: [0, 2, -1, 1, 3])",
    );
    let whole = green(alone);
    assert!(whole > 30);
    assert!(green(with("")) < whole, "without an offset the faces hide some of it");
    assert_eq!(green(with("PolygonOffset(factor: 2.0, units: 4.0),")), whole);
}

/// The subsets of a list, written as a list.
fn subsets(parts: &[&str]) -> Vec<String> {
    let chosen = |bits: usize| (0..parts.len()).filter(|k| bits >> k & 1 == 1).map(|k| parts[k]).collect::<Vec<_>>();
    (0..1 << parts.len()).map(|bits| format!("[{}]", chosen(bits).join(", "))).collect()
}

/// An open cone or cylinder shows its inside: a pixel is drawn where a ray meets the shape, from whatever side, and it is as bright
/// as the other side would be under a light that shines the other way. Solids, and those that are said to be, hide theirs.
#[test]
fn the_inside_of_open_shapes_is_drawn_where_it_is_picked() {
    let shapes = subsets(&["Sides", "Top", "Bottom"])
        .into_iter()
        .map(|parts| format!("Cylinder(parts: {parts})"))
        .chain(subsets(&["Sides", "Bottom"]).into_iter().map(|parts| format!("Cone(parts: {parts})")));
    let eyes = [
        "PerspectiveCamera(position: (0.5, 4.0, 3.0), look_at: (0.0, 0.0, 0.0)),",
        "PerspectiveCamera(position: (1.0, -5.0, 1.5), look_at: (0.0, 0.0, 0.0)),",
        "PerspectiveCamera(position: (4.0, 0.3, -1.0), look_at: (0.0, 0.0, 0.0)),",
        // From within.
        "PerspectiveCamera(position: (0.1, -0.7, 0.2), look_at: (0.4, 2.0, 0.3)),",
    ];
    for shape in shapes {
        let closed = shape == "Cylinder(parts: [Sides, Top, Bottom])" || shape == "Cone(parts: [Sides, Bottom])";
        let mut seen = 0;
        for (number, eye) in eyes.into_iter().enumerate().filter(|(number, _)| !closed || *number < 3) {
            let nodes = format!("{eye} LightModel(model: BaseColor), {shape}");
            let text = format!("Scene(version: 1, root: Separator(children: [{nodes}]))");
            let scene = parse(&text, &Registry::default()).unwrap_or_else(|e| panic!("{e}"));
            let mut triangles = Vec::new();
            CallbackAction::new().triangles(None, |_, t| triangles.push(*t)).apply(&scene).unwrap();
            let picture = picture(&nodes);
            let picker = RayPickAction::pixel(0, 0, SIZE).picker(&scene).unwrap();
            for (x, y) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))) {
                // What is drawn is made of facets: only where they and the round shape are met alike, and a pixel around.
                let met = |dx: f64, dy: f64| {
                    let [w, h] = SIZE.map(f64::from);
                    let ray = picker.ray_through((f64::from(x) + 0.5 + dx) / w, (f64::from(y) + 0.5 + dy) / h).unwrap();
                    let facets = triangles.iter().any(|t| intersect_triangle(&ray, t).is_some());
                    (facets, !picker.pick(&ray, false).unwrap().is_empty())
                };
                let here = met(0.0, 0.0);
                let around = [(0.5, 0.0), (-0.5, 0.0), (0.0, 0.5), (0.0, -0.5)];
                if here.0 == here.1 && around.into_iter().all(|(dx, dy)| met(dx, dy) == here) {
                    assert_eq!(picture.at(x, y)[0] > 0.0, here.1, "{shape} from eye {number} at ({x}, {y})");
                    seen += u32::from(here.1);
                }
            }
        }
        assert!(shape.ends_with("[])") || seen > 200, "{shape}: {seen} pixels");
    }
    // Into a tube from above: the far wall is lit by what shines onto its inside, and not by what shines onto its outside.
    let tube = "Cylinder(parts: [Sides])";
    let eye = "OrthographicCamera(position: (0.0, 4.0, 4.0), look_at: (0.0, 0.0, 0.0), height: 4.0),
        Environment(ambient_intensity: 0.0),";
    let at = |nodes: &str| picture(nodes).at(30, 24)[0];
    let inside = at(&format!("{eye} DirectionalLight(direction: (0.0, 0.0, -1.0)), {tube}"));
    let outside = at(&format!("{eye} DirectionalLight(direction: (0.0, 0.0, 1.0)), {tube}"));
    assert!(inside > 0.3 && outside == 0.0, "{inside} {outside}");
    let solid = "ShapeHints(vertex_ordering: Counterclockwise, shape_type: Solid),";
    assert_eq!(at(&format!("{eye} LightModel(model: BaseColor), {solid} {tube}")), 0.0);
    assert!(at(&format!("{eye} LightModel(model: BaseColor), {tube}")) > 0.0);
}
