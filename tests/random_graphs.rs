//! Random graphs, edited at random: every action against a plain recursive reference, and after each edit against a scene
//! that was built anew.

use std::cell::RefCell;
use std::sync::{Arc, LazyLock};

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec2, DVec3};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use seamount::action::{
    ActionKind, CallbackAction, Event, EventKind, EventType, PrimitiveCount, PrimitiveCountAction, walk::Go,
};
use seamount::format::{load_files, parse, write_scene};
use seamount::node::{Array, ArrayOrigin, Function, MultipleCopy, Registry};
use seamount::prelude::*;
use tempfile::TempDir;

/// One step of building: what, where, and numbers for it.
type Step = (u8, u16, u16, [i8; 3]);

fn steps() -> impl Strategy<Value = Vec<Step>> {
    prop::collection::vec((0u8..40, any::<u16>(), any::<u16>(), prop::array::uniform3(-4i8..5)), 1..40)
}

fn cases() -> u32 {
    if std::env::var_os("SEAMOUNT_SOAK").is_some() { 20_000 } else { 300 }
}

fn is_group(scene: &Scene, key: NodeKey) -> bool {
    scene.node(key).is_some_and(|node| node.info().children.is_some_and(|rule| rule.only.is_none()))
}

/// Scene files that the graphs show: one moves what follows it, one has another in it, and one is nothing at all.
const FILES: [(&str, &str); 3] = [
    ("moves.ron", "Group(children: [Translation(translation: (0.3, 0, 0.7)), Cube(width: 1.1), Def(\"n1\", Cube())])"),
    (
        "nests.ron",
        "Separator(children: [Scale(scale_factor: (1, 2, 1)), File(name: \"moves.ron\"), Sphere(radius: 0.7)])",
    ),
    ("empty.ron", "Group()"),
];

static FOLDER: LazyLock<TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, root) in FILES {
        std::fs::write(folder.path().join(name), format!("Scene(version: 1, root: {root})")).expect("a file");
    }
    folder
});

/// Reads what is named and not shown. Where there is nothing to read nothing is edited, so that the index goes on from the last
/// edit.
fn load(scene: &mut Scene) {
    load_files(scene, &Registry::default()).unwrap_or_else(|error| panic!("{error}"));
}

/// How far a Callback moves what follows it.
const NUDGE: DVec3 = DVec3::new(0.25, 0.0, -0.5);

thread_local! {
    /// Where events have been, in this thread.
    static EVENTS: RefCell<Vec<Path>> = const { RefCell::new(Vec::new()) };
}

/// Gives nodes the functions that can not be in a file.
fn give_functions(scene: &mut Scene, keys: impl IntoIterator<Item = NodeKey>) {
    for key in keys {
        if let Some(mut callback) = scene.edit::<Callback>(key) {
            callback.function = Some(Function(Arc::new(|_, state| state.translate(NUDGE))));
        }
        if let Some(mut events) = scene.edit::<EventCallback>(key) {
            *events = EventCallback::new(EventType::Any, |cx| {
                EVENTS.with_borrow_mut(|events| events.push(cx.path().clone()));
                Ok(())
            });
        }
    }
}

/// All keys in the order in which they came.
struct Program {
    scene: Scene,
    keys: Vec<NodeKey>,
}

impl Program {
    fn new() -> Self {
        let mut scene = Scene::new();
        scene.set_source(FOLDER.path().join("random.ron"));
        let keys = vec![scene.root()];
        Self { scene, keys }
    }

    /// With something to look through.
    fn with_camera() -> Self {
        let mut program = Self::new();
        let camera = program.scene.add(program.scene.root(), camera()).expect("a child");
        program.keys.push(camera);
        program
    }

    fn group(&self, place: u16) -> NodeKey {
        let groups: Vec<NodeKey> = self.keys.iter().copied().filter(|&key| is_group(&self.scene, key)).collect();
        groups[place as usize % groups.len()]
    }

    fn step(&mut self, (what, place, other, [a, b, c]): Step) {
        let parent = self.group(place);
        let v = DVec3::new(f64::from(a), f64::from(b), f64::from(c)) * 0.5;
        // No zero factor: what is flat has no inverse to compare with.
        let factor = |k: i8| if k == 0 { 1.5 } else { f64::from(k) * 0.5 };
        let node: Box<dyn Node> = match what {
            0 => Box::new(Group::default()),
            1 | 2 => Box::new(Separator::default()),
            3 => Box::new(TransformSeparator::default()),
            4 => Box::new(Switch { which_child: i32::from(a).max(-3) }),
            5 => Box::new(Array {
                origin: [ArrayOrigin::First, ArrayOrigin::Center, ArrayOrigin::Last][a.unsigned_abs() as usize % 3],
                num_elements1: u32::from(a.unsigned_abs() % 3),
                num_elements2: 1 + u32::from(b.unsigned_abs() % 2),
                separation1: v,
                separation2: DVec3::new(0.0, 3.0, f64::from(c)),
                ..Array::default()
            }),
            6 => Box::new(MultipleCopy {
                matrix: (0..a.unsigned_abs() % 3)
                    .map(|k| Matrix(DAffine3::from_translation(v * f64::from(k))))
                    .collect(),
            }),
            7 => Box::new(Lod { center: v, range: List::from([3.0, 6.0]) }),
            8 => Box::new(Translation { translation: v }),
            9 => Box::new(RotationXyz {
                angle: f64::from(a) * 0.4,
                axis: [Axis::X, Axis::Y, Axis::Z][b.unsigned_abs() as usize % 3],
            }),
            10 => Box::new(Scale { scale_factor: DVec3::new(factor(a), factor(b), factor(c)) }),
            11 => Box::new(Transform {
                translation: v,
                rotation: AxisAngle::new(DVec3::new(1.0, 2.0, f64::from(a)), f64::from(b)),
                scale_factor: DVec3::new(factor(c), 1.0, 0.5),
                scale_orientation: AxisAngle::new(DVec3::X, f64::from(a) * 0.3),
                center: DVec3::new(v.z, v.x, v.y),
            }),
            12 => Box::new(ResetTransform::default()),
            13 => {
                Box::new(Units { units: [Length::Feet, Length::Meters, Length::Yards][a.unsigned_abs() as usize % 3] })
            }
            14 => Box::new(MatrixTransform {
                matrix: Matrix(DAffine3 { matrix3: DMat3::from_rotation_z(f64::from(a)), translation: v }),
            }),
            15 | 16 => Box::new(Cube { width: factor(a).abs(), height: factor(b).abs(), ..Cube::default() }),
            17 => Box::new(Sphere { radius: factor(a).abs() }),
            18 => Box::new(PickStyle { style: PICK_STYLES[a.unsigned_abs() as usize] }),
            19 => {
                // Sharing; refused where it would make a cycle.
                let child = self.keys[other as usize % self.keys.len()];
                let _ = self.scene.add_child(parent, child);
                return;
            }
            20 => {
                let count = self.scene.children(parent).len();
                if count > 0 {
                    self.scene.remove_child(parent, other as usize % count).expect("a child");
                }
                return;
            }
            21 => {
                let key = self.keys[other as usize % self.keys.len()];
                if let Some(mut t) = self.scene.edit::<Translation>(key) {
                    t.translation += v;
                } else if let Some(mut s) = self.scene.edit::<Switch>(key) {
                    s.which_child = i32::from(b).max(-3);
                } else if let Some(mut s) = self.scene.edit::<Cube>(key) {
                    s.depth = factor(c).abs();
                } else if let Some(mut f) = self.scene.edit::<File>(key) {
                    f.name = FILES[place as usize % 3].0.to_owned();
                } else if let Some(mut c) = self.scene.edit::<Callback>(key) {
                    c.actions = callback_actions(a);
                } else if let Some(mut p) = self.scene.edit::<ClipPlane>(key) {
                    p.on = a > 0;
                } else if let Some(mut p) = self.scene.edit::<PickStyle>(key) {
                    p.style = PICK_STYLES[b.unsigned_abs() as usize];
                } else if let Some(mut p) = self.scene.edit::<Coordinate3>(key) {
                    p.point.make_mut()[0] += v;
                } else if let Some(mut c) = self.scene.edit::<BaseColor>(key) {
                    c.rgb = color([b, a, a]).into();
                } else if let Some(&own) = self.scene.children(key).first()
                    && let Some(mut p) = self.scene.edit::<VertexProperty>(own)
                {
                    p.vertex.make_mut()[0] += v;
                }
                load(&mut self.scene);
                return;
            }
            22 => {
                let key = self.keys[other as usize % self.keys.len()];
                if key != self.scene.root() {
                    self.scene.remove(key).expect("a node");
                    self.keys.retain(|&k| k != key);
                }
                return;
            }
            24 | 25 => {
                // Lines or points with coordinates of their own, which are edited later.
                let key = self.scene.insert_boxed(match a {
                    2.. => Box::new(LineSet::default()),
                    0 | 1 => Box::new(IndexedLineSet { coord_index: [0, 2, 1].into(), ..IndexedLineSet::default() }),
                    _ => Box::new(PointSet::default()),
                });
                let vertex = [v, DVec3::new(v.z, factor(a), v.x), DVec3::splat(factor(b))];
                self.scene
                    .add(key, VertexProperty { vertex: vertex.into(), ..VertexProperty::default() })
                    .expect("a list");
                self.keys.push(key);
                self.scene.add_child(parent, key).expect("a fresh node makes no cycle");
                return;
            }
            26 => Box::new(LevelOfDetail { screen_area: List::default() }),
            27 => Box::new(Callback { actions: callback_actions(a), function: None }),
            28 => Box::new(EventCallback::default()),
            29 | 30 => Box::new(File { name: FILES[a.unsigned_abs() as usize % 3].0.to_owned() }),
            31 => Box::new(ClipPlane {
                plane: Plane { normal: DVec3::new(v.x, v.y, 1.0 + v.z * v.z), distance: f64::from(b) * 0.37 },
                on: c < 3,
            }),
            // What moves no shape: the reference does not look at these.
            32 => Box::new(ShapeHints {
                vertex_ordering: [VertexOrdering::Clockwise, VertexOrdering::Counterclockwise][usize::from(a > 0)],
                shape_type: [ShapeType::Solid, ShapeType::UnknownShapeType][usize::from(b > 0)],
                ..ShapeHints::default()
            }),
            33 => Box::new(MaterialBinding { value: [Binding::Overall, Binding::PerFace][usize::from(a > 0)] }),
            34 => Box::new(BaseColor { rgb: color([a, b, c]).into() }),
            35 => Box::new(Coordinate3 { point: [v, DVec3::new(factor(c), v.x, v.y)].into() }),
            // Points of the coordinates in force.
            36 => Box::new(PointSet::default()),
            37 => {
                Box::new(Rotation { rotation: AxisAngle::new(DVec3::new(f64::from(b), 1.0, 0.5), f64::from(a) * 0.3) })
            }
            38 => Box::new(Info::default()),
            _ => {
                let key = self.keys[other as usize % self.keys.len()];
                let _ = self.scene.set_name(key, format!("n{a}"));
                return;
            }
        };
        let key = self.scene.insert_boxed(node);
        self.keys.push(key);
        give_functions(&mut self.scene, [key]);
        load(&mut self.scene);
        let index = other as usize % (self.scene.children(parent).len() + 1);
        self.scene.insert_child(parent, index, key).expect("a fresh node makes no cycle");
    }

    /// Whether walks of it stay short: sharing multiplies.
    fn is_small(&self) -> bool {
        let mut visits = 0;
        let counted = CallbackAction::new()
            .before(None, |_| {
                visits += 1;
                if visits > 2000 { Go::End } else { Go::On }
            })
            .apply(&self.scene);
        counted.is_ok() && visits <= 2000
    }
}

const PICK_STYLES: [PickStyleKind; 5] = [
    PickStyleKind::Shape,
    PickStyleKind::Unpickable,
    PickStyleKind::BoundingBox,
    PickStyleKind::ShapeOnTop,
    PickStyleKind::ShapeFrontfaces,
];

fn callback_actions(a: i8) -> List<ActionKind> {
    match a {
        2.. => List::from(ActionKind::ALL),
        0 | 1 => List::from([ActionKind::BoundingBox]),
        _ => List::from([ActionKind::RayPick, ActionKind::Render]),
    }
}

fn color([r, g, b]: [i8; 3]) -> Color {
    let part = |k: i8| f32::from(k.unsigned_abs() % 5) / 4.0;
    Color::new(part(r), part(g), part(b))
}

/// Far enough to see everything, and to choose levels of detail by.
fn camera() -> OrthographicCamera {
    let position = Some(DVec3::new(1.0, 2.0, 7.0));
    OrthographicCamera { position, height: 30.0, ..OrthographicCamera::default() }
}

/// The reference's State, with matrices of another kind.
#[derive(Clone)]
struct Plain {
    model: DMat4,
    unit: f64,
    switch: i32,
    pick: PickStyleKind,
    planes: Vec<(DVec3, DVec3)>,
    points: Vec<DVec3>,
    color: Color,
}

/// A shape as the reference finds it.
struct Found {
    path: Path,
    state: Plain,
    key: NodeKey,
}

/// Which levels of detail are walked.
#[derive(Clone, Copy, PartialEq)]
enum Levels {
    /// The one that is seen from here; without a place, the finest.
    Seen(Option<DVec3>),
    All,
}

/// What the reference does: for which action it walks, and which levels.
type Mode = (ActionKind, Levels);

const BOXED: Mode = (ActionKind::BoundingBox, Levels::All);
const PICKED: Mode = (ActionKind::RayPick, Levels::Seen(None));

/// Walks as it is written in the documentation, by plain recursion.
fn reference(scene: &Scene, mode: Mode) -> (Vec<Found>, Vec<Path>) {
    fn children(
        scene: &Scene,
        key: NodeKey,
        only: Option<usize>,
        mode: Mode,
        path: &Path,
        state: &mut Plain,
        out: &mut (Vec<Found>, Vec<Path>),
    ) {
        for (index, &child) in scene.children(key).iter().enumerate() {
            if only.is_none_or(|only| only == index) {
                let mut path = path.clone();
                path.push(child, index);
                visit(scene, child, mode, &path, state, out);
            }
        }
    }
    fn visit(
        scene: &Scene,
        key: NodeKey,
        mode: Mode,
        path: &Path,
        state: &mut Plain,
        out: &mut (Vec<Found>, Vec<Path>),
    ) {
        out.1.push(path.clone());
        let count = scene.children(key).len();
        let before = state.clone();
        if scene.get::<Group>(key).is_some() || scene.get::<File>(key).is_some() {
            children(scene, key, None, mode, path, state, out);
        } else if scene.get::<Separator>(key).is_some() {
            children(scene, key, None, mode, path, state, out);
            *state = before;
        } else if scene.get::<TransformSeparator>(key).is_some() {
            children(scene, key, None, mode, path, state, out);
            (state.model, state.unit) = (before.model, before.unit);
        } else if let Some(s) = scene.get::<Switch>(key) {
            let mut which = s.which_child;
            if which == -2 {
                which = state.switch;
                if which >= 0 && count > 0 {
                    which %= count as i32;
                }
            } else {
                state.switch = which;
            }
            match which {
                -3 => children(scene, key, None, mode, path, state, out),
                0.. => children(scene, key, Some(which as usize), mode, path, state, out),
                _ => {}
            }
        } else if let Some(a) = scene.get::<Array>(key) {
            let mut number = 0;
            for k in 0..a.num_elements3 {
                for j in 0..a.num_elements2 {
                    for i in 0..a.num_elements1 {
                        let origin = |n: u32| match a.origin {
                            ArrayOrigin::First => 0.0,
                            ArrayOrigin::Center => f64::from(n - 1) / 2.0,
                            ArrayOrigin::Last => f64::from(n - 1),
                        };
                        let offset = a.separation1 * (f64::from(i) - origin(a.num_elements1))
                            + a.separation2 * (f64::from(j) - origin(a.num_elements2))
                            + a.separation3 * (f64::from(k) - origin(a.num_elements3));
                        let mut copy = before.clone();
                        copy.model *= DMat4::from_translation(offset);
                        copy.switch = number;
                        number += 1;
                        children(scene, key, None, mode, path, &mut copy, out);
                    }
                }
            }
        } else if let Some(m) = scene.get::<MultipleCopy>(key) {
            for (number, matrix) in m.matrix.iter().enumerate() {
                let mut copy = before.clone();
                copy.model *= DMat4::from(matrix.0);
                copy.switch = number as i32;
                children(scene, key, None, mode, path, &mut copy, out);
            }
        } else if scene.get::<Lod>(key).is_some() || scene.get::<LevelOfDetail>(key).is_some() {
            let seen = match (mode.1, scene.get::<Lod>(key)) {
                (Levels::All, _) => None,
                (Levels::Seen(Some(eye)), Some(lod)) => {
                    let distance = state.model.transform_point3(lod.center).distance(eye);
                    let far = lod.range.iter().filter(|range| **range <= distance).count();
                    Some(far.min(count.saturating_sub(1)))
                }
                // Of levels without areas the first is seen.
                _ => Some(0),
            };
            for index in 0..count {
                if seen.is_none_or(|seen| seen == index) {
                    children(scene, key, Some(index), mode, path, &mut before.clone(), out);
                }
            }
        } else if let Some(t) = scene.get::<Translation>(key) {
            state.model *= DMat4::from_translation(t.translation);
        } else if let Some(r) = scene.get::<RotationXyz>(key) {
            let axis = [DVec3::X, DVec3::Y, DVec3::Z][r.axis as usize];
            state.model *= DMat4::from_axis_angle(axis, r.angle);
        } else if let Some(s) = scene.get::<Scale>(key) {
            state.model *= DMat4::from_scale(s.scale_factor);
        } else if let Some(t) = scene.get::<Transform>(key) {
            let turn = |r: AxisAngle| DMat4::from_quat(DQuat::from_axis_angle(r.axis.normalize(), r.angle));
            let axes = turn(t.scale_orientation);
            state.model *= DMat4::from_translation(t.translation)
                * DMat4::from_translation(t.center)
                * turn(t.rotation)
                * axes
                * DMat4::from_scale(t.scale_factor)
                * axes.transpose()
                * DMat4::from_translation(-t.center);
        } else if let Some(m) = scene.get::<MatrixTransform>(key) {
            state.model *= DMat4::from(m.matrix.0);
        } else if scene.get::<ResetTransform>(key).is_some() {
            (state.model, state.unit) = (DMat4::IDENTITY, 1.0);
        } else if let Some(u) = scene.get::<Units>(key) {
            let length = u.units.meters();
            state.model *= DMat4::from_scale(DVec3::splat(length / state.unit));
            state.unit = length;
        } else if let Some(r) = scene.get::<Rotation>(key) {
            state.model *= DMat4::from_quat(DQuat::from_axis_angle(r.rotation.axis.normalize(), r.rotation.angle));
        } else if let Some(p) = scene.get::<PickStyle>(key) {
            state.pick = p.style;
        } else if let Some(c) = scene.get::<Callback>(key) {
            if c.actions.contains(&mode.0) {
                state.model *= DMat4::from_translation(NUDGE);
            }
        } else if let Some(p) = scene.get::<ClipPlane>(key) {
            if p.on {
                let normal = p.plane.normal.normalize();
                let place = state.model.transform_point3(normal * p.plane.distance);
                let covector = DMat3::from_mat4(state.model).inverse().transpose() * normal;
                state.planes.push((place, covector.normalize()));
            }
        } else if let Some(c) = scene.get::<Coordinate3>(key) {
            state.points = c.point.to_vec();
        } else if let Some(c) = scene.get::<BaseColor>(key) {
            state.color = c.rgb[0];
        } else if scene.node(key).is_some_and(|node| node.info().family == "property") {
            // Says nothing of places.
        } else {
            out.0.push(Found { path: path.clone(), state: state.clone(), key });
        }
    }
    let mut out = (Vec::new(), Vec::new());
    let mut state = Plain {
        model: DMat4::IDENTITY,
        unit: 1.0,
        switch: -1,
        pick: PickStyleKind::Shape,
        planes: Vec::new(),
        points: Vec::new(),
        color: Color::new(0.8, 0.8, 0.8),
    };
    visit(scene, scene.root(), mode, &Path::new(scene.root()), &mut state, &mut out);
    out
}

/// The points of a set of lines or points; `None` of other shapes.
fn vertices(scene: &Scene, found: &Found) -> Option<Vec<DVec3>> {
    if scene.get::<Cube>(found.key).is_some() || scene.get::<Sphere>(found.key).is_some() {
        return None;
    }
    let own = scene.children(found.key).first().and_then(|&own| scene.get::<VertexProperty>(own));
    Some(own.map_or(found.state.points.clone(), |own| own.vertex.to_vec()))
}

/// Half the sizes of a shape's box.
fn half(scene: &Scene, key: NodeKey) -> DVec3 {
    match scene.get::<Cube>(key) {
        Some(c) => DVec3::new(c.width, c.height, c.depth) * 0.5,
        None => DVec3::splat(scene.get::<Sphere>(key).expect("a cube or a sphere").radius),
    }
}

fn reference_box(scene: &Scene) -> Option<Aabb> {
    let corners = reference(scene, BOXED).0.into_iter().flat_map(|found| {
        let bounds = match vertices(scene, &found) {
            Some(points) => Aabb::of(points),
            None => Some(Aabb { min: -half(scene, found.key), max: half(scene, found.key) }),
        };
        let corners = bounds.map(|bounds| bounds.corners().map(|c| found.state.model.transform_point3(c)));
        corners.into_iter().flatten()
    });
    Aabb::of(corners)
}

/// Distances at which a ray goes through a shape's surface, and whether that counts before others.
fn reference_hits(scene: &Scene, ray: &Ray) -> Vec<(bool, f64, Path)> {
    let mut hits = Vec::new();
    for found in reference(scene, PICKED).0 {
        let style = found.state.pick;
        // A ray of the world meets no lines and points, unless their box is picked.
        let points = vertices(scene, &found);
        if style == PickStyleKind::Unpickable || points.is_some() && style != PickStyleKind::BoundingBox {
            continue;
        }
        let inverse = found.state.model.inverse();
        let (o, d) = (inverse.transform_point3(ray.origin), inverse.transform_vector3(ray.direction));
        let bounds = match points {
            Some(points) => Aabb::of(points),
            None => Some(Aabb { min: -half(scene, found.key), max: half(scene, found.key) }),
        };
        let Some(bounds) = bounds else { continue };
        if bounds.size().min_element() == 0.0 {
            // Both sides of a flat box are one: such rays are left out like those that graze.
            hits.extend([(false, 0.0, found.path.clone()), (false, 0.0, found.path)]);
            continue;
        }
        let (enter, leave) = if scene.get::<Sphere>(found.key).is_none() || style == PickStyleKind::BoundingBox {
            let (a, b) = ((bounds.min - o) / d, (bounds.max - o) / d);
            (a.min(b).max_element(), a.max(b).min_element())
        } else {
            let h = half(scene, found.key);
            let (qa, qb, qc) = (d.dot(d), o.dot(d), o.dot(o) - h.x * h.x);
            let root = (qb * qb - qa * qc).sqrt();
            ((-qb - root) / qa, (-qb + root) / qa)
        };
        if enter < leave {
            let both = [enter, leave];
            let sides = if style == PickStyleKind::ShapeFrontfaces { &both[..1] } else { &both[..] };
            let stays = |t: f64| {
                let point = ray.origin + ray.direction * t;
                found.state.planes.iter().all(|(place, normal)| (point - *place).dot(*normal) >= 0.0)
            };
            let counts = sides.iter().filter(|&&t| t >= 0.0 && stays(t));
            hits.extend(counts.map(|&t| (style == PickStyleKind::ShapeOnTop, t, found.path.clone())));
        }
    }
    hits.sort_by(|a, b| b.0.cmp(&a.0).then(a.1.total_cmp(&b.1)));
    hits
}

fn rays() -> Vec<Ray> {
    // Oblique, so that no ray runs along a face.
    [
        (DVec3::new(-20.1, 0.13, 0.21), DVec3::new(1.0, 0.0123, -0.0171)),
        (DVec3::new(0.31, 19.7, 0.11), DVec3::new(0.0137, -1.0, 0.0191)),
        (DVec3::new(0.17, 0.23, 0.41), DVec3::new(0.3, 0.5, 0.77)),
    ]
    .map(|(o, d)| Ray::new(o, d).expect("a ray"))
    .into()
}

fn pick(scene: &Scene, ray: Ray, all: bool) -> Vec<PickedPoint> {
    RayPickAction { all, ..RayPickAction::ray(ray) }.apply(scene).expect("a pick")
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * a.abs().max(b.abs()).max(1.0)
}

fn check_against_reference(scene: &mut Scene) {
    check_events(scene);
    check_frame(scene);
    let got = BoundingBoxAction::default().apply(scene).expect("a box");
    match (got, reference_box(scene)) {
        (None, None) => {}
        (Some(a), Some(b)) => {
            let scale = b.min.abs().max(b.max.abs()).max_element().max(1.0);
            assert!((a.min - b.min).abs().max_element() < 1e-9 * scale, "{a:?} {b:?}");
            assert!((a.max - b.max).abs().max_element() < 1e-9 * scale, "{a:?} {b:?}");
        }
        (a, b) => panic!("{a:?} {b:?}"),
    }
    for ray in rays() {
        let expected = reference_hits(scene, &ray);
        let got = pick(scene, ray, true);
        let distances: Vec<f64> = got.iter().map(|p| p.distance).collect();
        // A ray that touches an edge or a sphere may count or not in either; such are left out on both sides.
        let grazing = expected.windows(2).any(|w| close(w[0].1, w[1].1));
        if !grazing {
            assert_eq!(distances.len(), expected.len(), "{distances:?} {expected:?}");
            for (p, (on_top, t, path)) in got.iter().zip(&expected) {
                assert!(close(p.distance, *t) && p.path == *path && p.on_top == *on_top, "{p:?} {t} {path:?}");
            }
        }
        let first = pick(scene, ray, false);
        assert_eq!(first.first().map(|p| p.distance), distances.first().copied());
    }
    let mut visited = Vec::new();
    let mut triangles = 0u64;
    CallbackAction::new()
        .before(None, |visit| {
            visited.push(visit.path.clone());
            Go::On
        })
        .triangles(None, |_, _| triangles += 1)
        .apply(scene)
        .expect("a walk");
    let (shapes, expected) = reference(scene, (ActionKind::Callback, Levels::Seen(None)));
    assert_eq!(visited, expected);
    let mut count = PrimitiveCount::default();
    for found in &shapes {
        count.triangles += if scene.get::<Cube>(found.key).is_some() { 12 } else { 0 };
        count.triangles += if scene.get::<Sphere>(found.key).is_some() { 870 } else { 0 };
        let points = vertices(scene, found).map_or(0, |points| points.len() as u64);
        count.lines += if scene.get::<PointSet>(found.key).is_none() { points.saturating_sub(1) } else { 0 };
        count.points += if scene.get::<PointSet>(found.key).is_some() { points } else { 0 };
    }
    assert_eq!(triangles, count.triangles);
    assert_eq!(PrimitiveCountAction::default().apply(scene).expect("a count"), count);

    // Copies have one path: it is found once if its copies follow each other.
    let cubes: Vec<Path> = reference(scene, (ActionKind::Search, Levels::All))
        .1
        .into_iter()
        .filter(|p| p.tail().is_some_and(|key| scene.get::<Cube>(key).is_some()))
        .collect();
    let found = |interest| {
        SearchAction { kind: Some("Cube".into()), interest, ..SearchAction::default() }.apply(scene).expect("a search")
    };
    let mut found_all = found(Interest::All);
    assert_eq!(found(Interest::First).first(), cubes.first());
    assert_eq!(found(Interest::Last).first(), cubes.last());
    let mut once = cubes;
    once.dedup();
    assert_eq!(found_all, once);
    found_all.dedup();
    for shape in reference(scene, (ActionKind::Matrix, Levels::All)).0.iter().take(5) {
        let matrix = MatrixAction::new(shape.path.clone()).apply(scene).expect("a walk").expect("it is there");
        // Of copies the first counts, and only paths without copies above are compared.
        let copies =
            shape.path.nodes().any(|key| scene.get::<Array>(key).is_some() || scene.get::<MultipleCopy>(key).is_some());
        let hidden = shape.path.nodes().any(|key| scene.get::<Switch>(key).is_some());
        if !copies && !hidden {
            let scale = shape.state.model.to_cols_array().iter().fold(1.0, |m: f64, x| m.max(x.abs()));
            let difference = DMat4::from(matrix).to_cols_array();
            let worst = difference
                .iter()
                .zip(shape.state.model.to_cols_array())
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max);
            assert!(worst < 1e-9 * scale, "{matrix:?} {:?}", shape.state.model);
        }
    }
}

/// Events come to all that wait for them, in the order of the walk.
fn check_events(scene: &mut Scene) {
    EVENTS.take();
    let event = Event::new(EventKind::Location, DVec2::ZERO);
    HandleEventAction::new([8, 8]).apply(scene, &event).expect("functions that do not fail");
    let waits = |path: &Path| path.tail().is_some_and(|key| scene.get::<EventCallback>(key).is_some());
    let places = reference(scene, (ActionKind::HandleEvent, Levels::All)).1;
    assert_eq!(EVENTS.take(), places.into_iter().filter(waits).collect::<Vec<_>>());
}

/// A frame has all shapes that are seen, in their colours and cut by their planes.
fn check_frame(scene: &mut Scene) {
    let eye = camera().position;
    let camera = scene.insert(camera());
    scene.insert_child(scene.root(), 0, camera).expect("a fresh node makes no cycle");
    let frame = RenderAction::new(16, 16).apply(scene).expect("a frame");
    let drawn: Vec<_> = frame.draws.iter().map(|draw| (draw.material.diffuse, draw.clip_planes.len())).collect();
    let shapes = reference(scene, (ActionKind::Render, Levels::Seen(eye))).0;
    let there = shapes.iter().filter(|found| vertices(scene, found).is_none_or(|points| !points.is_empty()));
    let expected: Vec<_> = there.map(|found| (found.state.color.linear(), found.state.planes.len())).collect();
    scene.remove(camera).expect("a node");
    assert_eq!(drawn, expected);
}

/// All answers, for comparison to the bit.
fn answers(scene: &Scene) -> String {
    let bounds = BoundingBoxAction::default().apply(scene).expect("a box");
    let picks: Vec<_> = rays()
        .into_iter()
        .flat_map(|ray| pick(scene, ray, true))
        .map(|p| (p.point, p.normal, p.distance, p.path.indices().collect::<Vec<_>>()))
        .collect();
    let cubes: Vec<Vec<usize>> = SearchAction { kind: Some("Cube".into()), ..SearchAction::default() }
        .apply(scene)
        .expect("a search")
        .iter()
        .map(|p| p.indices().collect())
        .collect();
    format!("{bounds:?} {picks:?} {cubes:?}")
}

/// What there is to draw, or why there is nothing.
fn drawn(frame: Result<&Frame, ActionError>) -> String {
    let told = |frame: &Frame| format!("{:?}", (frame.background, &frame.draws));
    frame.map_or_else(|error| error.to_string(), told)
}

fn anew(scene: &Scene) -> Scene {
    let text = write_scene(scene).expect("text");
    let mut again = parse(&text, &Registry::default()).unwrap_or_else(|e| panic!("{e}\n{text}"));
    assert_eq!(write_scene(&again).expect("text"), text, "write then read is the identity");
    let mut keys = vec![again.root()];
    let mut next = 0;
    while let Some(&key) = keys.get(next) {
        next += 1;
        keys.extend(again.children(key).iter().filter(|child| !keys.contains(child)).copied().collect::<Vec<_>>());
    }
    give_functions(&mut again, keys);
    again.set_source(FOLDER.path().join("random.ron"));
    load(&mut again);
    again
}

proptest! {
    // The same graphs in every run; the long run's are others.
    #![proptest_config(ProptestConfig {
        cases: cases(),
        rng_seed: RngSeed::Fixed(u64::from(cases())),
        ..ProptestConfig::default()
    })]

    #[test]
    fn actions_answer_as_a_plain_recursion(steps in steps()) {
        let mut program = Program::new();
        for step in steps {
            program.step(step);
        }
        prop_assume!(program.is_small());
        check_against_reference(&mut program.scene);
    }

    #[test]
    fn edits_in_any_order_leave_no_stale_answer(steps in steps()) {
        let mut program = Program::new();
        for step in steps {
            program.step(step);
            if !program.is_small() {
                break;
            }
            prop_assert_eq!(answers(&program.scene), answers(&anew(&program.scene)));
        }
    }

    #[test]
    fn edits_in_any_order_leave_no_stale_frame(steps in steps()) {
        let mut program = Program::with_camera();
        let mut view = View::default();
        let action = RenderAction::new(16, 16);
        for step in steps {
            program.step(step);
            if !program.is_small() {
                break;
            }
            let kept = drawn(action.apply_in(&program.scene, &mut view));
            prop_assert_eq!(kept, drawn(action.apply(&anew(&program.scene)).as_ref().map_err(Clone::clone)));
        }
    }
}

#[test]
fn eight_threads_get_the_answers_of_one() {
    let mut program = Program::new();
    let mut seed = 7u64;
    for _ in 0..200 {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let n = |shift: u32| (seed >> shift) as u8;
        let small = |shift: u32| (n(shift) % 9) as i8 - 4;
        program.step((n(33) % 19, u16::from(n(40)), u16::from(n(48)), [small(20), small(25), small(30)]));
        if !program.is_small() {
            let last = program.keys.pop().expect("the node just added");
            program.scene.remove(last).expect("not the root");
        }
    }
    let expected = Arc::new(answers(&program.scene));
    std::thread::scope(|scope| {
        for _ in 0..8 {
            scope.spawn(|| {
                for _ in 0..4 {
                    assert_eq!(answers(&program.scene), *expected);
                }
            });
        }
    });
}
