//! What the actions promise, one by one: boxes, rays, picked points, callbacks, searches, sensors; and shapes defined elsewhere.

mod common;

use common::Rng;
use glam::{DAffine3, DQuat, DVec2};
use seamount::action::walk::Go;
use seamount::action::{CallbackAction, PrimitiveCount, PrimitiveCountAction, RayError, ShapeContext, ShapeError};
use seamount::define_node;
use seamount::format::parse;
use seamount::node::{HitDetail, LineDetail, NodeType, PointDetail, Registry, ShapeNode, Triangle};
use seamount::prelude::*;
use seamount::scene::{Sensor, Watched};

const SIZE: [u32; 2] = [160, 120];

fn scene_of(nodes: &str) -> Scene {
    let text = format!("Scene(version: 1, root: Separator(children: [{nodes}]))");
    parse(&text, &Registry::default()).unwrap_or_else(|e| panic!("{e}"))
}

/// A turned, stretched and possibly mirrored place.
fn random_map(rng: &mut Rng) -> DAffine3 {
    let axis = DVec3::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0), 1.5).normalize();
    let sign = if rng.below(2) == 0 { 1.0 } else { -1.0 };
    let scale = DVec3::new(rng.range(0.3, 3.0), rng.range(0.3, 3.0), sign * rng.range(0.3, 3.0));
    let shift = DVec3::new(rng.range(-9.0, 9.0), rng.range(-9.0, 9.0), rng.range(-9.0, 9.0));
    DAffine3::from_scale_rotation_translation(scale, DQuat::from_axis_angle(axis, rng.range(0.0, 6.0)), shift)
}

fn placed(map: DAffine3, scene: &mut Scene) -> NodeKey {
    let group = scene.add(scene.root(), Separator::default()).unwrap();
    scene.add(group, MatrixTransform { matrix: Matrix(map) }).unwrap();
    group
}

#[test]
fn boxes_are_tight_through_turned_groups_in_turned_groups() {
    assert_eq!(BoundingBoxAction::default().apply(&Scene::new()).unwrap(), None);
    assert_eq!(BoundingBoxAction::default().oriented(&Scene::new()).unwrap(), None);
    let mut rng = Rng(3);
    for _ in 0..200 {
        let (outer, inner) = (random_map(&mut rng), random_map(&mut rng));
        let mut scene = Scene::new();
        let group = placed(outer, &mut scene);
        let nested = scene.add(group, Separator::default()).unwrap();
        scene.add(nested, MatrixTransform { matrix: Matrix(inner) }).unwrap();
        scene.add(nested, Cube { width: 1.0, height: 2.0, depth: 4.0 }).unwrap();
        let corners = Aabb { min: DVec3::new(-0.5, -1.0, -2.0), max: DVec3::new(0.5, 1.0, 2.0) }.corners();
        let expected = Aabb::of(corners.map(|c| outer.transform_point3(inner.transform_point3(c)))).unwrap();
        let found = BoundingBoxAction::default().apply(&scene).unwrap().unwrap();
        assert!((found.min - expected.min).abs().max_element() < 1e-12 * 1e3);
        assert!((found.max - expected.max).abs().max_element() < 1e-12 * 1e3);
        // With its matrix it is the cube itself.
        let oriented = BoundingBoxAction::default().oriented(&scene).unwrap().unwrap();
        let volume = 8.0 * (outer * inner).matrix3.determinant().abs();
        assert!((oriented.volume() - volume).abs() <= 1e-9 * volume, "{oriented:?}");
    }
}

#[test]
fn what_is_no_ray_is_an_error_however_it_was_made() {
    let scene = scene_of("Cube()");
    let good = Ray::new(DVec3::new(0.1, 0.2, 9.0), DVec3::NEG_Z).unwrap();
    let [nan, infinite] = [f64::NAN, f64::INFINITY];
    let rays = [
        Ray { origin: DVec3::new(nan, 0.0, 0.0), ..good },
        Ray { origin: DVec3::new(0.0, infinite, 0.0), ..good },
        Ray { direction: DVec3::new(0.0, nan, -1.0), ..good },
        Ray { direction: DVec3::new(0.0, 0.0, -infinite), ..good },
        Ray { direction: DVec3::ZERO, ..good },
        Ray { near: -1.0, ..good },
        Ray { near: nan, ..good },
        Ray { far: nan, ..good },
        Ray { near: 5.0, far: 4.0, ..good },
    ];
    for ray in rays {
        let made = Ray::new(ray.origin, ray.direction).and_then(|r| r.with_range(ray.near, ray.far));
        let error = RayPickAction::ray(ray).apply(&scene).unwrap_err();
        let ActionError::Ray(error) = error else { panic!("{error}") };
        assert_eq!(error.to_string(), made.unwrap_err().to_string(), "{ray:?}");
    }
    assert_eq!(Ray::new(DVec3::ZERO, DVec3::ZERO), Err(RayError::NoDirection));
    // Rays are half-lines: what is behind is not met, nor what is out of range.
    let met = |ray: Ray| RayPickAction { all: true, ..RayPickAction::ray(ray) }.apply(&scene).unwrap().len();
    assert_eq!((met(good), met(Ray { direction: DVec3::Z, ..good })), (2, 0));
    assert_eq!(met(Ray { origin: DVec3::ZERO, ..good }), 1);
    for (near, far, expected) in [(8.0, 10.0, 2), (8.5, 10.0, 1), (8.5, 9.5, 0), (0.0, 8.0, 1), (10.5, infinite, 0)] {
        assert_eq!(met(good.with_range(near, far).unwrap()), expected, "{near}..{far}");
    }
}

#[test]
fn a_picked_point_says_the_same_in_the_world_and_in_the_shape() {
    let mut rng = Rng(11);
    let mut met = 0;
    for _ in 0..400 {
        let map = random_map(&mut rng);
        let mut scene = Scene::new();
        let group = placed(map, &mut scene);
        let shape: Box<dyn Node> = match rng.below(4) {
            0 => Box::new(Sphere { radius: 2.0 }),
            1 => Box::new(Cone::default()),
            2 => Box::new(Cylinder::default()),
            _ => Box::new(Cube::default()),
        };
        let shape = scene.insert_boxed(shape);
        scene.add_child(group, shape).unwrap();
        let inside =
            map.transform_point3(DVec3::new(rng.range(-0.15, 0.15), rng.range(-0.15, 0.15), rng.range(-0.15, 0.15)));
        let origin = DVec3::new(rng.range(-40.0, 40.0), rng.range(-40.0, 40.0), rng.range(-40.0, 40.0));
        // Rays made in place may have a direction of any length.
        let ray = Ray { direction: (inside - origin) * rng.range(0.1, 5.0), ..Ray::new(origin, DVec3::X).unwrap() };
        for hit in (RayPickAction { all: true, ..RayPickAction::ray(ray) }).apply(&scene).unwrap() {
            met += 1;
            let near = |a: DVec3, b: DVec3| (a - b).length() < 1e-9 * (1.0 + a.length());
            assert!(near(hit.local_to_world.transform_point3(hit.object_point), hit.point));
            assert!(near(hit.world_to_local().transform_point3(hit.point), hit.object_point));
            assert!((hit.point.distance(origin) - hit.distance).abs() < 1e-9 * hit.distance);
            assert!(near(origin + ray.direction.normalize() * hit.distance, hit.point));
            for normal in [hit.normal, hit.object_normal, hit.smooth_normal] {
                assert!((normal.length() - 1.0).abs() < 1e-12);
            }
            let normals = map.matrix3.inverse().transpose();
            assert!(near((normals * hit.object_normal).normalize(), hit.normal));
            assert_eq!((hit.node(), hit.path.tail()), (Some(shape), Some(shape)));
        }
    }
    assert!(met >= 790, "{met}");
}

#[test]
fn callbacks_go_on_prune_and_end() {
    let scene = scene_of("Group(children: [Cube(), Group(children: [Cone()])]), Sphere(), Cube()");
    let walked = |on_cone: Go, on_group: Go, after_cube: Go| {
        let log = std::cell::RefCell::new(Vec::new());
        let note = |before: bool, visit: &seamount::action::Visit<'_>| {
            let kind = visit.node().unwrap().info().kind;
            log.borrow_mut().push(if before { kind.to_owned() } else { format!("/{kind}") });
        };
        CallbackAction::new()
            .before(None, |visit| {
                note(true, visit);
                Go::On
            })
            .before(Some("Cone"), |_| on_cone)
            .before(Some("Group"), |visit| if visit.path.len() == 3 { on_group } else { Go::On })
            .after(None, |visit| {
                note(false, visit);
                Go::On
            })
            .after(Some("Cube"), |_| after_cube)
            .apply(&scene)
            .unwrap();
        log.into_inner().join(" ")
    };
    let all = "Separator Group Cube /Cube Group Cone /Cone /Group /Group Sphere /Sphere Cube /Cube /Separator";
    assert_eq!(walked(Go::On, Go::On, Go::On), all);
    // What is left out has no end.
    assert_eq!(walked(Go::Past, Go::On, Go::On), all.replace("/Cone ", ""));
    assert_eq!(walked(Go::On, Go::Past, Go::On), all.replace("Cone /Cone /Group /Group", "/Group"));
    assert_eq!(walked(Go::End, Go::On, Go::On), "Separator Group Cube /Cube Group Cone");
    assert_eq!(walked(Go::On, Go::On, Go::End), "Separator Group Cube /Cube");
    assert_eq!(walked(Go::On, Go::On, Go::Past), all, "after a node there is nothing left to leave out");
}

#[test]
fn searches_put_name_kind_and_node_together() {
    let mut scene =
        scene_of("Def(\"a\", Cube()), Use(\"a\"), Cube(), Def(\"b\", Cone()), Switch(children: [Use(\"a\")])");
    let named = scene.find("a").unwrap();
    let found = |action: &SearchAction, scene: &Scene| {
        let paths = action.apply(scene).unwrap();
        paths.iter().map(|path| path.indices().collect::<Vec<_>>()).collect::<Vec<_>>()
    };
    let all = SearchAction { name: Some("a".into()), ..SearchAction::default() };
    assert_eq!(found(&all, &scene), [[0], [1]]);
    assert_eq!(found(&SearchAction { interest: Interest::First, ..all.clone() }, &scene), [[0]]);
    assert_eq!(found(&SearchAction { interest: Interest::Last, ..all.clone() }, &scene), [[1]]);
    let hidden = SearchAction { hidden: true, ..all.clone() };
    assert_eq!(found(&hidden, &scene), [vec![0], vec![1], vec![4, 0]]);
    let node = SearchAction { node: Some(named), ..SearchAction::default() };
    assert_eq!(found(&node, &scene), [[0], [1]]);
    let cubes = SearchAction { kind: Some("Cube".into()), ..SearchAction::default() };
    assert_eq!(found(&cubes, &scene), [[0], [1], [2]]);
    assert!(found(&SearchAction { kind: Some("Cone".into()), ..all.clone() }, &scene).is_empty());
    // A sensor of a path is told when it leads elsewhere.
    let path = all.apply(&scene).unwrap().remove(1);
    let told = std::cell::Cell::new(0);
    let mut sensor = Sensor::new(&scene, Watched::Path(path), |_| told.set(told.get() + 1));
    scene.edit::<Cube>(named).unwrap().width = 3.0;
    assert!(sensor.check(&scene) && !sensor.check(&scene));
    let root = scene.root();
    scene.remove_child(root, 0).unwrap();
    assert!(sensor.check(&scene));
    assert_eq!(told.get(), 2);
}

define_node! {
    /// A tent of two triangles with its ridge as a line of two pieces, and a peg at each end of it. Says only what it is made of.
    pub struct Tent: shape {
        /// Height of the ridge.
        pub height: f64 = 1.0,
    }
}

impl Tent {
    fn ridge(&self) -> [DVec3; 3] {
        [DVec3::new(-2.0, 0.0, self.height), DVec3::new(0.1, 0.0, self.height + 0.1), DVec3::new(2.0, 0.0, self.height)]
    }

    fn pegs(&self) -> [DVec3; 2] {
        [DVec3::new(-3.0, 0.0, 0.0), DVec3::new(3.0, 0.0, 0.0)]
    }
}

impl ShapeNode for Tent {
    fn bounds(&self, _: &ShapeContext<'_>) -> Result<Option<Aabb>, ShapeError> {
        Ok(Aabb::of(self.ridge().into_iter().chain(self.pegs()).chain([DVec3::NEG_Y, DVec3::Y])))
    }

    fn primitives(&self, _: &ShapeContext<'_>, sink: &mut dyn FnMut(Triangle)) -> Result<(), ShapeError> {
        let [a, _, b] = self.ridge();
        sink(Triangle { points: [a, DVec3::NEG_Y, b], normals: [DVec3::NEG_Y; 3], ..Triangle::default() });
        sink(Triangle { points: [b, DVec3::Y, a], normals: [DVec3::Y; 3], ..Triangle::default() });
        Ok(())
    }

    fn lines(&self, _: &ShapeContext<'_>, sink: &mut dyn FnMut([DVec3; 2])) -> Result<(), ShapeError> {
        let [a, b, c] = self.ridge();
        sink([a, b]);
        sink([b, c]);
        Ok(())
    }

    fn points(&self, _: &ShapeContext<'_>, sink: &mut dyn FnMut(DVec3)) -> Result<(), ShapeError> {
        self.pegs().into_iter().for_each(sink);
        Ok(())
    }

    fn beyond_box(&self) -> bool {
        true
    }
}

/// A shape that only says what its lines and points are is met where the sets of this crate are that have the same.
#[test]
fn lines_and_points_of_a_shape_defined_elsewhere_are_picked_like_those_of_sets() {
    let tent = Tent::default();
    let mut registry = Registry::default();
    registry.register::<Tent>();
    let camera = "PerspectiveCamera(position: (1, -9, 4), look_at: (0, 0, 0.5)), Translation(translation: (0.3, 0, 0))";
    let scene = |shape: &str| {
        let text = format!("Scene(version: 1, root: Separator(children: [{camera}, {shape}]))");
        parse(&text, &registry).unwrap_or_else(|e| panic!("{e}"))
    };
    let list =
        |points: &[DVec3]| points.iter().map(|p| format!("({}, {}, {})", p.x, p.y, p.z)).collect::<Vec<_>>().join(", ");
    let sets = format!(
        "LineSet(vertex_property: [VertexProperty(vertex: [{}])]), PointSet(vertex_property: [VertexProperty(vertex: [{}])])",
        list(&tent.ridge()),
        list(&tent.pegs())
    );
    let (own, known) = (scene("Tent()"), scene(&sets));
    let count = PrimitiveCountAction::default().apply(&own).unwrap();
    assert_eq!(count, PrimitiveCount { triangles: 2, lines: 2, points: 2 });
    let (mut lines, mut pegs, mut faces) = (0, 0, 0);
    for (x, y) in (0..SIZE[0]).step_by(2).flat_map(|x| (0..SIZE[1]).step_by(2).map(move |y| (x, y))) {
        let picked = |scene: &Scene, radius: f64| {
            let action = RayPickAction { all: true, radius, ..RayPickAction::pixel(x, y, SIZE) };
            action.apply(scene).unwrap()
        };
        let of_strokes = |hits: Vec<PickedPoint>| {
            let strokes = hits.into_iter().filter(|hit| !matches!(hit.detail, HitDetail::Triangle { .. }));
            strokes.map(|hit| (hit.point, hit.normal, hit.distance, hit.detail)).collect::<Vec<_>>()
        };
        let (found, expected) = (of_strokes(picked(&own, 4.0)), of_strokes(picked(&known, 4.0)));
        assert_eq!(found, expected, "{x},{y}");
        for (.., detail) in found {
            match detail {
                HitDetail::Line(LineDetail { line, piece, points, .. }) => {
                    assert_eq!((line, points), (0, [piece, piece + 1]));
                    lines += 1;
                }
                HitDetail::Point(PointDetail { index, point }) => {
                    assert_eq!(index, point);
                    pegs += 1;
                }
                other => panic!("{other:?}"),
            }
        }
        // Its triangles are met as well, whatever the radius.
        faces += picked(&own, 0.0).iter().filter(|hit| matches!(hit.detail, HitDetail::Triangle { .. })).count();
    }
    assert!(lines > 20 && pegs > 4 && faces > 50, "{lines} {pegs} {faces}");
    let hit = &RayPickAction::pixel(80, 60, SIZE).apply(&own).unwrap()[0];
    assert_eq!(hit.path.names(&own), ["Separator", "Tent[2]"]);
    // It is drawn, and in files it is like others.
    let frame = RenderAction::new(SIZE[0], SIZE[1]).apply(&own).unwrap();
    assert_eq!((frame.draws.len(), frame.statistics.triangles), (1, 2));
    let text = seamount::format::write_scene(&own).unwrap();
    assert_eq!(seamount::format::write_scene(&parse(&text, &registry).unwrap()).unwrap(), text);
    assert_eq!(Tent::INFO.actions.len(), 5, "it does what shapes do");
    let wrong = parse("Scene(version: 1, root: Tent(heigth: 2.0))", &registry).unwrap_err();
    assert!(wrong.to_string().contains("did you mean `height`?"), "{wrong}");
}

/// Normals that belong to parts or faces belong to the points of a set: it has no other parts.
#[test]
fn each_point_of_a_set_has_its_normal_whatever_they_are_bound_to() {
    let points = "Coordinate3(point: [(0, 0, 0), (2, 0, 0), (0, 2, 0)])";
    let normals = "Normal(vector: [(0, 0, 2), (0, 3, 0), (1, 0, 0)])";
    let units = [DVec3::Z, DVec3::Y, DVec3::X];
    let places = [DVec2::ZERO, DVec2::new(2.0, 0.0), DVec2::new(0.0, 2.0)];
    let camera = "OrthographicCamera(position: (0, 0, 9), height: 8)";
    for binding in
        ["Overall", "PerPart", "PerPartIndexed", "PerFace", "PerFaceIndexed", "PerVertex", "PerVertexIndexed"]
    {
        let scene = scene_of(&format!("{camera}, {points}, {normals}, NormalBinding(value: {binding}), PointSet()"));
        for (number, place) in places.into_iter().enumerate() {
            // 15 pixels to the unit.
            let (x, y) = (80.0 + 15.0 * place.x, 60.0 - 15.0 * place.y);
            let hits = RayPickAction { target: PickTarget::Pixel(x, y), ..RayPickAction::pixel(0, 0, SIZE) };
            let hits = hits.apply(&scene).unwrap();
            let expected = if binding == "Overall" { units[0] } else { units[number] };
            assert_eq!(hits[0].detail, HitDetail::Point(PointDetail { index: number, point: number }));
            assert_eq!(hits[0].normal, expected, "{binding}");
        }
    }
}
