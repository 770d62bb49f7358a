//! Edits keep the graph sound, walks keep the state where it belongs, and picks agree with brute force under transforms.
#![allow(missing_docs, reason = "a test")]

mod common;

use common::Rng;
use seamount::action::{ActionKind, ShapeContext, State, Surface};
use seamount::node::ShapeNode;
use seamount::prelude::*;

#[test]
fn edits_that_would_break_the_graph_are_refused_and_change_nothing() {
    let mut scene = Scene::new();
    let root = scene.root();
    let a = scene.add(root, Separator::default()).unwrap();
    let b = scene.add(a, Group::default()).unwrap();
    let cube = scene.add(b, Cube::default()).unwrap();
    let version = scene.version();
    assert_eq!(scene.add_child(b, a), Err(EditError::Cycle));
    assert_eq!(scene.add_child(a, a), Err(EditError::Cycle));
    assert_eq!(scene.add_child(b, root), Err(EditError::Cycle));
    assert_eq!(scene.add_child(cube, b), Err(EditError::NotAGroup { kind: "Cube" }));
    assert_eq!(scene.add(cube, Cube::default()), Err(EditError::NotAGroup { kind: "Cube" }));
    assert_eq!(scene.insert_child(a, 5, cube), Err(EditError::NoSuchChild { index: 5, count: 1 }));
    assert_eq!(scene.remove_child(a, 1), Err(EditError::NoSuchChild { index: 1, count: 1 }));
    assert_eq!(scene.remove(root).err(), Some(EditError::Root));
    let program = scene.insert(ShaderProgram::default());
    let refused = scene.add(program, Cube::default()).unwrap_err();
    assert!(refused.to_string().contains("VertexShader, FragmentShader"), "{refused}");
    assert_eq!(scene.children(a), [b]);
    assert_eq!(scene.version(), version + 1, "only the insertion counted");
}

#[test]
fn removing_a_node_leaves_no_dangling_key() {
    let mut scene = Scene::new();
    let root = scene.root();
    let group = scene.add(root, Separator::default()).unwrap();
    let cube = scene.add(group, Cube::default()).unwrap();
    scene.add_child(root, cube).unwrap();
    scene.add_child(root, cube).unwrap();
    scene.set_name(cube, "c").unwrap();
    assert_eq!(scene.parents(cube).len(), 3);
    scene.remove(cube).unwrap();
    assert_eq!((scene.children(root), scene.children(group).len()), (&[group][..], 0));
    assert_eq!((scene.find("c"), scene.node(cube).is_some()), (None, false));
    assert_eq!(scene.add_child(root, cube), Err(EditError::Removed));
    // The name is free again.
    scene.set_name(group, "c").unwrap();
    assert_eq!(scene.set_name(root, "c"), Err(EditError::NameTaken("c".into())));
}

#[test]
fn versions_rise_along_all_parents() {
    let mut scene = Scene::new();
    let root = scene.root();
    let left = scene.add(root, Separator::default()).unwrap();
    let right = scene.add(root, Separator::default()).unwrap();
    let cube = scene.add(left, Cube::default()).unwrap();
    scene.add_child(right, cube).unwrap();
    let other = scene.add(root, Cube::default()).unwrap();
    let before = [root, left, right, cube, other].map(|k| scene.subtree_version(k));
    scene.edit::<Cube>(cube).unwrap().width = 5.0;
    let after = [root, left, right, cube, other].map(|k| scene.subtree_version(k));
    for k in 0..4 {
        assert!(after[k] > before[k]);
    }
    assert_eq!(after[4], before[4]);
}

fn box_of(scene: &Scene) -> (DVec3, DVec3) {
    let b = BoundingBoxAction::default().apply(scene).unwrap().unwrap();
    (b.min, b.max)
}

#[test]
fn a_separator_keeps_what_a_group_lets_out() {
    for (leaks, expected) in [(false, 1.0), (true, 11.0)] {
        let mut scene = Scene::new();
        let root = scene.root();
        let group =
            if leaks { scene.add(root, Group::default()) } else { scene.add(root, Separator::default()) }.unwrap();
        let moved = Transform { translation: DVec3::new(10.0, 0.0, 0.0), ..Transform::default() };
        scene.add(group, moved).unwrap();
        scene.add(root, Cube::default()).unwrap();
        assert_eq!(box_of(&scene).1.x, expected);
    }
}

#[test]
fn lights_and_cameras_act_on_what_follows_them() {
    let mut scene = Scene::new();
    let root = scene.root();
    scene.add(root, Cube::default()).unwrap();
    scene.add(root, PerspectiveCamera::default()).unwrap();
    scene.add(root, Cube::default()).unwrap();
    let lit = scene.add(root, Separator::default()).unwrap();
    scene.add(lit, DirectionalLight::default()).unwrap();
    scene.add(lit, DirectionalLight { on: false, ..DirectionalLight::default() }).unwrap();
    scene.add(lit, Cube::default()).unwrap();
    scene.add(root, Cube::default()).unwrap();
    let frame = RenderAction::new(8, 8).apply(&scene).unwrap();
    // The first cube stands before the camera.
    assert_eq!(frame.draws.iter().map(|d| d.lights.len()).collect::<Vec<_>>(), [0, 1, 0]);
}

#[test]
fn a_camera_is_found_by_name_or_missed_with_the_names_there_are() {
    let mut scene = Scene::new();
    let root = scene.root();
    scene.add(root, Cube::default()).unwrap();
    let missing = RenderAction::new(8, 8).apply(&scene).unwrap_err();
    assert!(matches!(missing, ActionError::NoCamera), "{missing}");
    let key = scene.add(root, PerspectiveCamera::default()).unwrap();
    scene.set_name(key, "front").unwrap();
    let named = |name: &str| RenderAction { camera: Some(name.into()), ..RenderAction::new(8, 8) };
    assert!(named("front").apply(&scene).is_ok());
    let unknown = named("back").apply(&scene).unwrap_err().to_string();
    assert!(unknown.contains("back") && unknown.contains("front"), "{unknown}");
}

#[test]
fn ten_thousand_levels_are_walked() {
    let mut scene = Scene::new();
    let mut at = scene.root();
    for _ in 0..10_000 {
        at = scene.add(at, Separator::default()).unwrap();
    }
    let cube = scene.add(at, Cube::default()).unwrap();
    assert_eq!(box_of(&scene), (DVec3::splat(-1.0), DVec3::ONE));
    scene.edit::<Cube>(cube).unwrap().width = 4.0;
    assert_eq!(box_of(&scene).1.x, 2.0);
    let found = SearchAction { node: Some(cube), ..SearchAction::default() }.apply(&scene).unwrap();
    assert_eq!(found[0].len(), 10_002);
}

/// Sixty groups that each hold the next one twice are 2⁶⁰ cubes.
#[test]
fn a_tower_of_shared_groups_ends_in_an_error() {
    let mut scene = Scene::new();
    let mut at = scene.root();
    for _ in 0..60 {
        let next = scene.insert(Separator::default());
        scene.add_child(at, next).unwrap();
        scene.add_child(at, next).unwrap();
        at = next;
    }
    scene.add(at, Cube::default()).unwrap();
    let error = BoundingBoxAction::default().apply(&scene).unwrap_err();
    assert!(matches!(error, ActionError::TooLarge), "{error}");
}

/// Picks of a terrain and a cube under rotated, mirrored and sheared transforms against all their triangles in world
/// coordinates.
#[test]
fn picks_under_transforms_agree_with_brute_force() {
    let mut rng = Rng(17);
    let heights = (0..21 * 17).map(|_| rng.range(0.0, 2.0) as f32).collect::<Vec<_>>();
    for case in 0..40 {
        let mut scene = Scene::new();
        let root = scene.root();
        let mut turn = || AxisAngle::new(DVec3::new(rng.unit(), rng.unit() - 0.5, rng.unit()), rng.range(-3.0, 3.0));
        let outer = Transform {
            rotation: turn(),
            scale_factor: DVec3::new(2.0, if case % 2 == 0 { -1.0 } else { 1.0 }, 0.3),
            scale_orientation: turn(),
            translation: if case % 3 == 0 { DVec3::new(1e7, -3e6, 5e5) } else { DVec3::ONE },
            ..Transform::default()
        };
        let inner = Transform { rotation: turn(), scale_factor: DVec3::new(1.0, 3.0, 1.0), ..Transform::default() };
        scene.add(root, outer.clone()).unwrap();
        scene.add(root, inner.clone()).unwrap();
        let image = Image::new(21, 17, Pixels::GrayF32(heights.clone())).unwrap();
        scene.add(root, Texture2::from_image(image)).unwrap();
        let terrain =
            SeamlessTerrain { scale: 10.0, max_height: 1.0, resolutions: (2, 2), ..SeamlessTerrain::default() };
        let key = scene.add(root, terrain).unwrap();
        scene.add(root, Cube { width: 4.0, ..Cube::default() }).unwrap();

        let model = {
            let (a, b) = (outer.affine(), inner.affine());
            glam::DAffine3 { matrix3: a.matrix3 * b.matrix3, translation: a.transform_point3(b.translation) }
        };
        let path = SearchAction { node: Some(key), ..SearchAction::default() }.apply(&scene).unwrap().remove(0);
        let mut state = State { model, ..State::default() };
        // The texture is what the walk would have found.
        let texture = scene.children(root)[2];
        let property = scene.get::<Texture2>(texture).unwrap();
        seamount::node::PropertyNode::apply(
            property,
            &mut state,
            &seamount::action::PropertyContext {
                scene: &scene,
                key: texture,
                path: &path,
                action: ActionKind::Other,
                visit: 1,
            },
        );
        let cx = ShapeContext::new(&scene, &state, &path);
        let mut triangles = Vec::new();
        let cube = Cube { width: 4.0, ..Cube::default() };
        scene.get::<SeamlessTerrain>(key).unwrap().primitives(&cx, &mut |t| triangles.push(t)).unwrap();
        cube.primitives(&cx, &mut |t| triangles.push(t)).unwrap();
        let world: Vec<[DVec3; 3]> = triangles.iter().map(|t| t.points.map(|p| model.transform_point3(p))).collect();

        let bounds = Aabb::of(world.iter().flatten().copied()).unwrap();
        // Positions have so many digits.
        let ulp = bounds.max.abs().max(bounds.min.abs()).max_element() * f64::EPSILON;
        for _ in 0..100 {
            let inside = |rng: &mut Rng| bounds.min + bounds.size() * DVec3::new(rng.unit(), rng.unit(), rng.unit());
            let (a, b) = (inside(&mut rng), inside(&mut rng));
            let ray = Ray::new(a - (b - a) * 3.0, b - a).unwrap();
            let hits = RayPickAction { all: true, ..RayPickAction::ray(ray) }.apply(&scene).unwrap();
            let mut brute: Vec<f64> = world.iter().filter_map(|t| plain_triangle(&ray, *t)).collect();
            brute.sort_by(f64::total_cmp);
            let tolerance = 1e-9 * bounds.size().length() + 64.0 * ulp;
            let near = |t: f64, u: f64| (t - u).abs() < tolerance;
            for hit in &hits {
                assert!(brute.iter().any(|&t| near(t, hit.distance)), "case {case}: invented {hit:?}");
                assert!((ray.at(hit.distance) - hit.point).length() < tolerance, "{hit:?}");
                assert!((hit.normal.length() - 1.0).abs() < 1e-12);
                // The normal stands on the triangle that was hit.
                let stands = world.iter().any(|t| {
                    let n = (t[1] - t[0]).cross(t[2] - t[0]).normalize();
                    plain_triangle(&ray, *t).is_some_and(|u| near(u, hit.distance))
                        && n.dot(hit.normal).abs() > 0.999_99
                });
                assert!(stands, "case {case}: {hit:?}");
            }
            for &t in &brute {
                assert!(hits.iter().any(|h| near(t, h.distance)), "case {case}: lost {t} of {brute:?}, {hits:?}");
            }
            let first = RayPickAction::ray(ray).apply(&scene).unwrap();
            assert_eq!(first.first().map(|h| h.distance), hits.first().map(|h| h.distance));
        }
    }
}

fn plain_triangle(ray: &Ray, [a, b, c]: [DVec3; 3]) -> Option<f64> {
    let (e1, e2) = (b - a, c - a);
    let p = ray.direction.cross(e2);
    let det = e1.dot(p);
    let s = ray.origin - a;
    let q = s.cross(e1);
    let (u, v, t) = (s.dot(p) / det, ray.direction.dot(q) / det, e2.dot(q) / det);
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= ray.near && t <= ray.far).then_some(t)
}

/// `Exact` meets every cell of the map, with a bound that is rounding; `pick_many` gives the answers of one by one.
#[test]
fn exact_picks_lie_on_the_full_resolution_surface_and_within_the_coarse_bound() {
    let land = seamount::terrain::generate(129, 3).unwrap();
    let samples = (0..129 * 129).map(|i| land.raw(i % 129, i / 129) as u16).collect();
    let mut scene = Scene::new();
    let root = scene.root();
    let turn = AxisAngle::new(DVec3::new(1.0, 2.0, 9.0), 0.4);
    let transform = Transform { rotation: turn, scale_factor: DVec3::new(1.0, -2.0, 1.5), ..Transform::default() };
    scene.add(root, transform.clone()).unwrap();
    scene.add(root, Texture2::from_image(Image::new(129, 129, Pixels::Gray16(samples)).unwrap())).unwrap();
    let node = SeamlessTerrain { scale: 128.0, max_height: 30.0, resolutions: (4, 2), ..SeamlessTerrain::default() };
    scene.add(root, node.clone()).unwrap();
    let frame = node.frame(&land);

    let mut rng = Rng(4);
    let rays: Vec<Ray> = (0..2000)
        .map(|_| {
            let target = DVec3::new(rng.range(5.0, 123.0), rng.range(5.0, 123.0), 10.0);
            let from = target + DVec3::new(rng.range(-20.0, 20.0), rng.range(-20.0, 20.0), 60.0);
            let [a, b] = [from, target].map(|p| transform.affine().transform_point3(p));
            Ray::new(a, b - a).unwrap()
        })
        .collect();
    let with = |surface| RayPickAction { surface, ..RayPickAction::ray(rays[0]) };
    let exact = with(Surface::Exact).picker(&scene).unwrap();
    let coarse = with(Surface::Coarse).picker(&scene).unwrap();
    let many = exact.pick_many(&rays, false).unwrap();
    for (ray, many) in rays.iter().zip(&many) {
        let hits = exact.pick(ray, false).unwrap();
        assert_eq!(&hits, many);
        let hit = &hits[0];
        assert_eq!(hit.surface, Surface::Exact);
        let lattice = frame.lattice(hit.object_point);
        let ground = frame.local(DVec3::new(lattice.x, lattice.y, land.surface(lattice.x, lattice.y).unwrap()));
        assert!((ground.z - hit.object_point.z).abs() < 1e-9);
        assert!(hit.error_bound.unwrap() < 1e-9, "{hit:?}");
        assert!((ray.at(hit.distance) - hit.point).length() < 1e-9);
        // The coarse surface above or below the exact point is within the coarse hit's bound of it where they share a patch.
        for hit in coarse.pick(ray, true).unwrap() {
            let lattice = frame.lattice(hit.object_point);
            let ground = frame.base + land.surface(lattice.x, lattice.y).unwrap() * frame.z_step;
            let scale = transform.affine().matrix3.z_axis.length();
            assert!((ground - hit.object_point.z).abs() * scale <= hit.error_bound.unwrap() + 1e-9, "{hit:?}");
        }
    }
}
