//! Lines and points: against dense samples and all of them one by one in f64, drawn where they are, and errors of meaning.

mod common;

use common::Rng;
use glam::DVec3;
use seamount::action::{CallbackAction, PrimitiveCount, PrimitiveCountAction, Viewpoint};
use seamount::format::{parse, write_scene};
use seamount::node::{HitDetail, LineDetail, PointDetail, Registry};
use seamount::prelude::*;

const SIZE: [u32; 2] = [160, 120];

fn scene_of(nodes: &str) -> Scene {
    let text = format!("Scene(version: 1, root: Separator(children: [{nodes}]))");
    parse(&text, &Registry::default()).unwrap_or_else(|e| panic!("{e}"))
}

/// Two cameras of each kind, looking at about the origin.
fn camera(k: u32) -> Box<dyn Node> {
    let (position, look_at) = (Some(DVec3::new(4.0, -7.0, 3.0)), Some(DVec3::new(0.2, 0.1, -0.3)));
    match k % 2 {
        0 => Box::new(PerspectiveCamera { position, look_at, ..PerspectiveCamera::default() }),
        _ => Box::new(OrthographicCamera { position, look_at, height: 6.0, ..OrthographicCamera::default() }),
    }
}

/// A scene with a camera and a shape below a transform that shears angles.
struct Set {
    scene: Scene,
    points: Vec<DVec3>,
    shape: NodeKey,
}

fn placed(k: u32, shape: impl Node, rng: &mut Rng, points: usize) -> Set {
    let mut scene = Scene::new();
    let root = scene.root();
    let camera = scene.insert_boxed(camera(k));
    scene.add_child(root, camera).unwrap();
    scene.add(root, Rotation { rotation: AxisAngle::new(DVec3::new(1.0, 2.0, 0.5), 0.7) }).unwrap();
    scene.add(root, Scale { scale_factor: DVec3::new(1.0, 0.4, -2.0) }).unwrap();
    let place = |rng: &mut Rng| DVec3::new(rng.range(-2.0, 2.0), rng.range(-4.0, 4.0), rng.range(-1.5, 1.5));
    let points: Vec<DVec3> = (0..points).map(|_| place(rng)).collect();
    scene.add(root, Coordinate3 { point: points.clone().into() }).unwrap();
    let shape = scene.add(root, shape).unwrap();
    Set { scene, points, shape }
}

/// A place of a picture in pixels and the depth there, for a point of the world: the projection, written down plainly.
fn project(view: &Viewpoint, p: DVec3) -> (DVec2, f64) {
    let clip = view.clip_from_eye() * (p - view.eye).extend(1.0);
    let ndc = clip.truncate() / clip.w;
    let [w, h] = SIZE.map(f64::from);
    (DVec2::new((ndc.x + 1.0) * 0.5 * w, (1.0 - ndc.y) * 0.5 * h), (p - view.eye).dot(view.forward))
}

fn pick(scene: &Scene, at: DVec2, all: bool) -> Vec<PickedPoint> {
    let target = PickTarget::Pixel(at.x, at.y);
    RayPickAction { target, all, ..RayPickAction::pixel(0, 0, SIZE) }.apply(scene).expect("a pick")
}

fn soak() -> u32 {
    if std::env::var_os("SEAMOUNT_SOAK").is_some() { 50 } else { 1 }
}

#[test]
fn points_within_five_pixels_are_met_and_no_others() {
    let mut rng = Rng(1);
    for k in 0..2 {
        let Set { scene, points, shape } = placed(k, PointSet::default(), &mut rng, 60);
        let view = RenderAction::new(SIZE[0], SIZE[1]).viewpoint(&scene).unwrap();
        let model = MatrixAction::new(path_to(&scene, shape)).apply(&scene).unwrap().unwrap();
        for _ in 0..400 * soak() {
            let at = DVec2::new(rng.range(0.0, 160.0), rng.range(0.0, 120.0));
            let mut expected = Vec::new();
            for (index, &p) in points.iter().enumerate() {
                let (pixel, depth) = project(&view, model.transform_point3(p));
                let distance = pixel.distance(at);
                // Rounding may decide within this.
                assert!((distance - 5.0).abs() > 1e-9);
                if distance < 5.0 {
                    expected.push((index, depth));
                }
            }
            expected.sort_by(|a, b| a.1.total_cmp(&b.1));
            let hits = pick(&scene, at, true);
            let got: Vec<usize> = hits.iter().map(|hit| point_of(hit).index).collect();
            assert_eq!(got, expected.iter().map(|e| e.0).collect::<Vec<_>>());
            for (hit, (index, depth)) in hits.iter().zip(&expected) {
                assert_eq!(hit.object_point, points[*index]);
                let ray = view.ray(at.x / 160.0, at.y / 120.0).1;
                assert!((hit.distance * ray.dot(view.forward) - depth).abs() < 1e-9);
                assert!((hit.normal + ray).length() < 1e-9, "it looks back along the ray");
            }
            let first = pick(&scene, at, false);
            assert_eq!(first.first(), hits.first());
        }
    }
}

fn path_to(scene: &Scene, key: NodeKey) -> Path {
    SearchAction { node: Some(key), ..SearchAction::default() }.apply(scene).unwrap().remove(0)
}

fn point_of(hit: &PickedPoint) -> PointDetail {
    match hit.detail {
        HitDetail::Point(detail) => detail,
        other => panic!("{other:?}"),
    }
}

fn line_of(hit: &PickedPoint) -> LineDetail {
    match hit.detail {
        HitDetail::Line(detail) => detail,
        other => panic!("{other:?}"),
    }
}

/// Each straight piece is sampled densely: the nearest sample says whether a line is within the radius, and no pick is further
/// from the picked place than any sample of its piece.
#[test]
fn lines_are_met_at_their_nearest_place_in_the_picture() {
    let mut rng = Rng(2);
    const STEPS: u32 = 2000;
    for k in 0..4 {
        let lines = LineSet { num_vertices: List::from([3, 2, 1, 5, -1]), ..LineSet::default() };
        let Set { scene, points, shape } = placed(k, lines, &mut rng, 15);
        let view = RenderAction::new(SIZE[0], SIZE[1]).viewpoint(&scene).unwrap();
        let model = MatrixAction::new(path_to(&scene, shape)).apply(&scene).unwrap().unwrap();
        let mut pieces = Vec::new();
        CallbackAction::new().lines(None, |_, piece| pieces.push(*piece)).apply(&scene).unwrap();
        assert_eq!(pieces.len(), 2 + 1 + 4 + 3);
        let mut met = 0;
        for _ in 0..100 * soak() {
            let [a, b] = pieces[rng.below(10) as usize];
            let place = project(&view, model.transform_point3(a + (b - a) * rng.unit())).0;
            let at = place + DVec2::new(rng.range(-7.0, 7.0), rng.range(-7.0, 7.0));
            let hits = pick(&scene, at, true);
            let first = pick(&scene, at, false);
            assert_eq!(first.first(), hits.first());
            let mut worst: f64 = 0.0;
            for &[a, b] in &pieces {
                let sample = |s: u32| {
                    let p = a + (b - a) * (f64::from(s) / f64::from(STEPS));
                    project(&view, model.transform_point3(p)).0
                };
                let samples: Vec<DVec2> = (0..=STEPS).map(sample).collect();
                let step = samples.windows(2).map(|w| w[0].distance(w[1])).fold(0.0, f64::max);
                worst = worst.max(step);
                let nearest = samples.iter().map(|p| p.distance(at)).fold(f64::INFINITY, f64::min);
                let here: Vec<&PickedPoint> = hits
                    .iter()
                    .filter(|hit| {
                        let [p, q] = line_of(hit).points.map(|index| points[index]);
                        (p, q) == (a, b)
                    })
                    .collect();
                assert!(here.len() <= 1);
                if let Some(hit) = here.first() {
                    met += 1;
                    let (pixel, depth) = project(&view, hit.point);
                    let distance = pixel.distance(at);
                    assert!(distance <= nearest + 1e-9 && distance >= nearest - step, "{distance} {nearest} {step}");
                    assert!(distance <= 5.0 + 1e-9);
                    let detail = line_of(hit);
                    let on_piece = a + (b - a) * detail.along;
                    assert!((hit.object_point - on_piece).length() < 1e-12);
                    let ray = view.ray(at.x / 160.0, at.y / 120.0).1;
                    assert!((hit.distance * ray.dot(view.forward) - depth).abs() < 1e-9);
                } else if nearest < 5.0 - step {
                    // It has to go on nearer beyond an end that it shares.
                    let end = samples[0].distance(at).min(samples[STEPS as usize].distance(at));
                    assert!(end <= nearest + 1e-12, "{nearest} of {a} {b} is missed at {at}");
                    assert!(hits.iter().any(|hit| project(&view, hit.point).0.distance(at) <= nearest + 1e-9));
                }
            }
            assert!(worst < 0.5, "{worst}");
        }
        assert!(met > 60, "{met}");
    }
}

/// Where two pieces of a line meet, the place is met once.
#[test]
fn a_corner_of_a_line_is_one_hit() {
    let scene = scene_of(
        "PerspectiveCamera(position: (0.0, 0.0, 10.0), look_at: (0.0, 0.0, 0.0)),
         Coordinate3(point: [(-1.0, 1.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (1.0, 1.0, 0.0)]),
         LineSet()",
    );
    // Two pixels below the corner.
    let hits = pick(&scene, DVec2::new(80.0, 62.0), true);
    assert_eq!(hits.len(), 1, "{hits:?}");
    assert_eq!(hits[0].point, DVec3::ZERO);
    assert_eq!(line_of(&hits[0]), LineDetail { line: 0, piece: 0, points: [0, 1], along: 1.0 });
    // Between the arms both are near, each at a place of its own.
    assert_eq!(pick(&scene, DVec2::new(80.0, 57.0), true).len(), 2);
    assert_eq!(pick(&scene, DVec2::new(80.0, 67.0), true).len(), 0);
}

/// What is behind the eye, or before near, has no place in the picture.
#[test]
fn a_line_through_the_eye_is_met_in_front_of_it_alone() {
    let scene = scene_of(
        "PerspectiveCamera(position: (0.0, 0.0, 0.0), look_at: (0.0, 1.0, 0.0), near_distance: 1.0, far_distance: 50.0),
         Coordinate3(point: [(0.5, -100.0, 0.0), (0.5, 100.0, 0.0), (0.0, -2.0, 0.0), (0.0, 0.5, 0.0)]),
         IndexedLineSet(coord_index: [0, 1]), PointSet(start_index: 2)",
    );
    for x in 0..160 {
        for hit in pick(&scene, DVec2::new(f64::from(x) + 0.5, 60.0), true) {
            assert!(hit.point.y >= 1.0 - 1e-12 && hit.point.y <= 50.0 + 1e-9, "{hit:?}");
        }
    }
    let far = pick(&scene, DVec2::new(81.0, 60.0), true);
    assert!((far[0].point.y - 50.0).abs() < 1e-9, "cut at far: {far:?}");
}

#[test]
fn a_clip_plane_cuts_lines_where_it_stands() {
    let scene = scene_of(
        "OrthographicCamera(position: (0.0, 0.0, 10.0), look_at: (0.0, 0.0, 0.0), height: 12.0),
         ClipPlane(plane: (1.0, 0.0, 0.0, 0.25)),
         Coordinate3(point: [(-3.0, 0.0, 0.0), (3.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.5, 1.0, 0.0)]),
         IndexedLineSet(coord_index: [0, 1]), PointSet(start_index: 2)",
    );
    // Ten pixels a unit: the plane stands at pixel 82.5.
    let x = |pixel: f64| pick(&scene, DVec2::new(pixel, 60.0), false).first().map(|hit| hit.point.x);
    assert_eq!(x(77.0), None);
    assert!((x(79.0).expect("within five pixels of the cut") - 0.25).abs() < 1e-12);
    assert!((x(90.0).expect("on the line") - 1.0).abs() < 1e-12);
    assert!(pick(&scene, DVec2::new(80.0, 50.0), true).iter().all(|hit| point_of(hit).point == 3));
}

#[test]
fn a_ray_of_the_world_knows_no_pixels_and_a_radius_has_a_size() {
    let mut scene = scene_of(
        "OrthographicCamera(position: (0.0, 0.0, 10.0), look_at: (0.0, 0.0, 0.0), height: 12.0),
         Coordinate3(point: [(0.0, 0.0, 0.0)]), PointSet()",
    );
    let down = Ray::new(DVec3::new(0.0, 0.0, 9.0), DVec3::NEG_Z).unwrap();
    assert!(RayPickAction::ray(down).apply(&scene).unwrap().is_empty());
    let at = |radius: f64| RayPickAction { radius, ..RayPickAction::pixel(87, 60, SIZE) }.apply(&scene);
    assert_eq!((at(7.0).unwrap().len(), at(8.0).unwrap().len()), (0, 1));
    assert_eq!(at(0.0).unwrap().len(), 0);
    for wrong in [-1.0, f64::NAN, f64::INFINITY] {
        assert!(at(wrong).unwrap_err().to_string().contains("radius"), "{wrong}");
    }
    let root = scene.root();
    let style = scene.insert(PickStyle { style: PickStyleKind::Unpickable });
    scene.insert_child(root, 0, style).unwrap();
    assert!(RayPickAction::pixel(80, 60, SIZE).apply(&scene).unwrap().is_empty());
}

#[test]
fn boxes_and_counts_are_those_of_the_points_in_use() {
    let scene = scene_of(
        "Coordinate3(point: [(9.0, 9.0, 9.0), (0.0, 0.0, 0.0), (1.0, 2.0, 0.0), (3.0, 0.0, -1.0)]),
         Translation(translation: (10.0, 0.0, 0.0)),
         IndexedLineSet(coord_index: [1, 2, -1, -1, 3, -1, 3, 2, 1]), PointSet(start_index: 1, num_points: 2),
         LineSet(start_index: 2)",
    );
    let bounds = BoundingBoxAction::default().apply(&scene).unwrap().unwrap();
    assert_eq!((bounds.min, bounds.max), (DVec3::new(10.0, 0.0, -1.0), DVec3::new(13.0, 2.0, 0.0)));
    let count = PrimitiveCountAction::default().apply(&scene).unwrap();
    assert_eq!(count, PrimitiveCount { triangles: 0, lines: 1 + 2 + 1, points: 2 });
    let again = parse(&write_scene(&scene).unwrap(), &Registry::default()).unwrap();
    assert_eq!(write_scene(&again).unwrap(), write_scene(&scene).unwrap());
    let mut points = Vec::new();
    CallbackAction::new().points(Some("PointSet"), |_, p| points.push(*p)).apply(&scene).unwrap();
    assert_eq!(points, [DVec3::ZERO, DVec3::new(1.0, 2.0, 0.0)]);
}

#[test]
fn what_refers_to_no_point_is_an_error_that_says_so() {
    for (nodes, wanted) in [
        ("LineSet(num_vertices: [2])", "there are none"),
        ("Coordinate3(), LineSet(num_vertices: [2])", "line 0 refers to number 1"),
        ("Coordinate3(), PointSet(num_points: 100000000)", "refers to number 99999999"),
        ("Coordinate3(), PointSet(start_index: -1)", "start_index"),
        ("Coordinate3(), IndexedLineSet(coord_index: [0, 4])", "coord_index: line 0 refers to number 4"),
        (
            "Coordinate3(), NormalBinding(value: PerFace), Normal(vector: [(1.0, 0.0, 0.0)]), IndexedLineSet(coord_index: [0, 0, -1, 0, 0])",
            "line 1 refers to number 1 of the normals",
        ),
        ("Coordinate3(), PointSet(num_points: -2)", "num_points: -2 is no number"),
    ] {
        let error = BoundingBoxAction::default().apply(&scene_of(nodes)).unwrap_err().to_string();
        assert!(error.contains(wanted), "{error}");
    }
}

#[test]
fn normals_belong_to_pieces_lines_or_points() {
    // A line from left to right in two pieces, and another one above it.
    let normal = |binding: &str, list: &str, at: f64, y: f64| {
        let scene = scene_of(&format!(
            "OrthographicCamera(position: (0.0, 0.0, 10.0), look_at: (0.0, 0.0, 0.0), height: 12.0),
             Normal(vector: [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (-1.0, 0.0, 0.0)]),
             NormalBinding(value: {binding}),
             Coordinate3(point: [(-2.0, 0.0, 0.0), (0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (-2.0, 3.0, 0.0), (2.0, 3.0, 0.0)]),
             IndexedLineSet(coord_index: [0, 1, 2, -1, 3, 4], normal_index: {list})"
        ));
        pick(&scene, DVec2::new(80.0 + 10.0 * at, 60.0 - 10.0 * y), true)[0].normal
    };
    let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z];
    let mid = |a: DVec3, b: DVec3| (a + b).normalize_or_zero();
    for (binding, list, left, right, above) in [
        ("Overall", "[-1]", x, x, x),
        ("PerPart", "[-1]", x, y, z),
        ("PerPartIndexed", "[2, 0, 1]", z, x, y),
        ("PerFace", "[-1]", x, x, y),
        ("PerFaceIndexed", "[1, 0]", y, y, x),
        ("PerVertexIndexed", "[-1]", mid(x, y), mid(y, z), mid(-z, -x)),
        ("PerVertexIndexed", "[0, 0, 2, -1, 1, 0]", x, mid(x, z), mid(y, x)),
        ("PerVertex", "[-1]", mid(x, y), mid(y, z), mid(-z, -x)),
    ] {
        for (at, height, wanted) in [(-1.0, 0.0, left), (1.0, 0.0, right), (0.0, 3.0, above)] {
            let got = normal(binding, list, at, height);
            assert!((got - wanted).length() < 1e-9, "{binding} {list} at {at} {height}: {got}");
        }
    }
}

#[cfg(feature = "render")]
mod drawn {
    use super::*;
    use common::gpu::linear;

    /// What is drawn of lines and points lies within half their width of where they project to, and all of it is drawn.
    #[test]
    fn strokes_are_drawn_where_they_project_to_and_as_wide_as_asked() {
        let mut rng = Rng(4);
        for (k, width) in (0..6).zip([1.0f32, 2.0, 3.0, 7.0, 1.0, 4.5]) {
            let dots = k % 3 == 2;
            let Set { mut scene, points, shape } = if dots {
                placed(k, PointSet::default(), &mut rng, 12)
            } else {
                placed(k, LineSet { num_vertices: List::from([4, -1]), ..LineSet::default() }, &mut rng, 7)
            };
            let root = scene.root();
            let style = scene.insert(DrawStyle { line_width: width, point_size: width, ..DrawStyle::default() });
            scene.insert_child(root, 0, style).unwrap();
            let view = RenderAction::new(SIZE[0], SIZE[1]).viewpoint(&scene).unwrap();
            let model = MatrixAction::new(path_to(&scene, shape)).apply(&scene).unwrap().unwrap();
            let pixel = |p: DVec3| project(&view, model.transform_point3(p)).0;
            let mut pieces = Vec::new();
            CallbackAction::new().lines(None, |_, piece| pieces.push(*piece)).apply(&scene).unwrap();
            let frame = RenderAction::new(SIZE[0], SIZE[1]).apply(&scene).unwrap();
            let picture = linear().draw(&frame);
            let half = f64::from(width) * 0.5;
            let (mut inside, mut outside) = (0, 0);
            for (x, y) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))) {
                let at = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                // How far within the nearest stroke, in pixels; negative beside all.
                let depth = if dots {
                    points.iter().map(|&p| half - (pixel(p) - at).abs().max_element()).fold(f64::MIN, f64::max)
                } else {
                    let within = |[a, b]: [DVec3; 2]| {
                        let (a, b) = (pixel(a), pixel(b));
                        let way = (b - a).normalize();
                        let along = (at - a).dot(way);
                        (half - (at - a).perp_dot(way).abs()).min(along).min(a.distance(b) - along)
                    };
                    pieces.iter().map(|&piece| within(piece)).fold(f64::MIN, f64::max)
                };
                let drawn = picture.at(x, y)[0] > 0.0;
                // Devices place corners to 1/256 of a pixel.
                if depth.abs() > 0.02 {
                    assert_eq!(drawn, depth > 0.0, "{k}: ({x}, {y}) is {depth} within");
                    *(if drawn { &mut inside } else { &mut outside }) += 1;
                }
            }
            assert!(inside > 10 && outside > 1000, "{inside} {outside}");
        }
    }

    /// A line that goes past the eye is drawn in front of it, and nowhere else.
    #[test]
    fn a_line_past_the_eye_is_drawn_in_front_of_it_alone() {
        let scene = scene_of(
            "PerspectiveCamera(position: (0.0, 0.0, 0.0), look_at: (0.0, 1.0, 0.0), near_distance: 0.5),
             DrawStyle(line_width: 3.0, point_size: 9.0),
             Coordinate3(point: [(0.1, 1000.0, -0.4), (0.3, -1000.0, -0.4), (0.0, -3.0, 0.0)]),
             IndexedLineSet(coord_index: [0, 1]), IndexedLineSet(coord_index: [1, 0]), PointSet(start_index: 2)",
        );
        let frame = RenderAction::new(SIZE[0], SIZE[1]).apply(&scene).unwrap();
        let picture = linear().draw(&frame);
        for (x, y) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))) {
            let drawn = picture.at(x, y)[0] > 0.0;
            let hit = RayPickAction { radius: 1.45, ..RayPickAction::pixel(x, y, SIZE) }.apply(&scene).unwrap();
            let missed = RayPickAction { radius: 1.55, ..RayPickAction::pixel(x, y, SIZE) }.apply(&scene).unwrap();
            // Past its cut end a line is picked, within the radius, and not drawn.
            assert!(!drawn || !missed.is_empty(), "({x}, {y})");
            assert!(drawn || hit.is_empty() || !(62..=110).contains(&y), "({x}, {y}) {hit:?}");
        }
        assert!(picture.texels.iter().filter(|t| t[0] > 0.0).count() > 100);
    }

    /// Open Inventor lights lines that have normals, and shows others in their plain colour.
    #[test]
    fn only_strokes_with_normals_are_lit() {
        let with = |normals: &str| {
            let scene = scene_of(&format!(
                "OrthographicCamera(position: (0.0, 0.0, 10.0), look_at: (0.0, 0.0, 0.0), height: 12.0),
                 Environment(ambient_intensity: 0.0),
                 DirectionalLight(direction: (0.0, 0.0, -1.0)),
                 Material(diffuse_color: (1.0, 1.0, 1.0)), DrawStyle(line_width: 4.0, point_size: 4.0), {normals}
                 Coordinate3(point: [(-4.0, 0.0, 0.0), (4.0, 0.0, 0.0), (0.0, 3.0, 0.0)]),
                 IndexedLineSet(coord_index: [0, 1]), PointSet(start_index: 2)"
            ));
            let picture = linear().draw(&RenderAction::new(SIZE[0], SIZE[1]).apply(&scene).unwrap());
            [picture.at(70, 60)[0], picture.at(80, 30)[0]]
        };
        let close = |got: [f32; 2], want: f32| got.iter().all(|g| (g - want).abs() < 2e-3);
        assert!(close(with(""), 1.0));
        let tilted = with("NormalBinding(value: Overall), Normal(vector: [(0.6, 0.0, 0.8)]),");
        assert!(close(tilted, 0.8), "{tilted:?}");
    }

    /// Style `Points` shows a square at each corner of faces, of a terrain as of a mesh, and of lines their points.
    #[test]
    fn style_points_shows_corners_alone() {
        let mesh = "Coordinate3(point: [(-3.0, -3.0, 0.0), (3.0, -3.0, 0.0), (3.0, 3.0, 0.0), (-3.0, 3.0, 0.0)]),";
        for shape in ["IndexedFaceSet(coord_index: [0, 1, 2, 3])", "IndexedLineSet(coord_index: [0, 1, 2, 3])"] {
            let scene = scene_of(&format!(
                "OrthographicCamera(position: (0.0, 0.0, 10.0), look_at: (0.0, 0.0, 0.0), height: 12.0),
                 DrawStyle(style: Points, point_size: 8.0), {mesh} {shape}"
            ));
            let picture = linear().draw(&RenderAction::new(SIZE[0], SIZE[1]).apply(&scene).unwrap());
            for (x, y) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))) {
                let at = DVec2::new(f64::from(x) + 0.5 - 80.0, f64::from(y) + 0.5 - 60.0).abs();
                let in_square = (at - 30.0).abs().max_element() < 4.0;
                let on_face = at.max_element() < 30.0;
                let wanted = in_square && (on_face || shape.starts_with("IndexedLine"));
                assert_eq!(picture.at(x, y)[0] > 0.0, wanted, "{shape} ({x}, {y})");
            }
        }
    }
}
