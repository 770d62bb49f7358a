//! The scene on the bench: under a camera of our own, looked at from fixed eyes, drawn again and again.

use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::{DAffine3, DVec3};

use super::report::{Eye, Figure, FrameTimes};
use super::{CostError, Options};
use crate::action::walk::{Go, Visitor, walk};
use crate::action::{
    ActionError, Branches, Cameras, Frame, RenderAction, ShapeContext, State, Statistics, View, Viewpoint,
};
use crate::node::{
    DetailMode, PerspectiveCamera, Placed, SeamlessTerrain, Separator, ShapeNode, Transform, lattice_view,
};
use crate::render::{Headless, Picture};
use crate::scene::{NodeKey, Path, Scene};
use crate::terrain::{ActivePatch, DrawnSurface, LatticeView, ScreenError, facing_away, screen_error};

/// The scene, its terrains, and what draws them.
pub(super) struct Bench {
    pub(super) scene: Scene,
    pub(super) headless: Headless,
    pub(super) size: [u32; 2],
    /// The occurrence with the most samples, whose extent the eyes are placed by.
    pub(super) main: Terrain,
    /// Nodes of all terrains.
    terrains: Vec<NodeKey>,
    camera: NodeKey,
    offset: NodeKey,
    view: View,
    /// For how long the drawing of one picture is repeated.
    patience: Duration,
    /// Most bytes on the device so far, of frames that every run draws.
    pub(super) device_bytes: u64,
}

/// One occurrence of a terrain.
pub(super) struct Terrain {
    pub(super) key: NodeKey,
    /// The way to it.
    pub(super) names: Vec<String>,
    pub(super) model: DAffine3,
    pub(super) placed: Placed,
    /// What `Complexity` multiplies the allowed error by.
    allowed: f64,
}

/// What one picture took.
pub(super) struct Shot {
    pub(super) statistics: Statistics,
    pub(super) picture: Picture,
    pub(super) times: FrameTimes,
}

/// Drawing is repeated until [`Bench::patience`] has passed, but not more often than this.
const REPEATS: usize = 5;

/// How often detail is chosen for a picture.
const SELECTIONS: u32 = 5;

pub(super) const NO_TIMESTAMPS: &str = "the adapter has no timestamp queries, or its clock jumped";

impl Bench {
    pub(super) fn new(mut scene: Scene, options: &Options, patience: Duration) -> Result<Self, CostError> {
        let found = occurrences(&scene)?;
        // Our camera comes first, so it takes the pictures; what is offset moves with it.
        let old = scene.root();
        let root = scene.insert(Separator::default());
        scene.set_root(root)?;
        let offset = scene.add(root, Transform::default())?;
        let camera = scene.add(root, PerspectiveCamera::default())?;
        scene.add_child(root, old)?;
        let terrains: Vec<NodeKey> = found.iter().map(|t| t.key).collect();
        let samples = |t: &Terrain| {
            let field = t.placed.terrain.field();
            u64::from(field.columns()) * u64::from(field.rows())
        };
        // The last of the largest.
        let main = found.into_iter().max_by_key(samples).ok_or(CostError::NoTerrain)?;
        if main.model.matrix3.determinant() == 0.0 {
            return Err(CostError::Flat { path: main.names });
        }
        for &key in &terrains {
            // The eye that looks decides.
            if let Some(mut node) = scene.edit::<SeamlessTerrain>(key) {
                node.lod_camera = None;
                node.culling = true;
            }
        }
        let headless = Headless::new(options.adapter.as_deref())?;
        let (size, view) = (options.size, View::default());
        Ok(Self { scene, headless, size, main, terrains, camera, offset, view, patience, device_bytes: 0 })
    }

    /// Moves scene and camera by this, along x and y.
    pub(super) fn move_by(&mut self, offset: f64) {
        if let Some(mut node) = self.scene.edit::<Transform>(self.offset) {
            node.translation = DVec3::new(offset, offset, 0.0);
        }
    }

    /// Sets the detail of all terrains, such that what a `Complexity` node says is undone.
    pub(super) fn set_detail(&mut self, detail: DetailMode) {
        let allowed = self.main.allowed;
        let detail = match detail {
            DetailMode::PixelError(tolerance) => DetailMode::PixelError(tolerance / allowed),
            DetailMode::Precision(precision) => DetailMode::Precision(precision * allowed),
            DetailMode::Full => DetailMode::Full,
        };
        self.edit_terrains(|node| node.detail = detail);
    }

    pub(super) fn edit_terrains(&mut self, mut edit: impl FnMut(&mut SeamlessTerrain)) {
        for &key in &self.terrains {
            if let Some(mut node) = self.scene.edit::<SeamlessTerrain>(key) {
                edit(&mut node);
            }
        }
    }

    /// Looks from an eye, moved by so many parts in 2⁴⁰ of its distance: the picture stays the same, but nothing that is
    /// kept for the last one is of use.
    pub(super) fn look(&mut self, eye: &Eye, nudge: u32) {
        if let Some(mut camera) = self.scene.edit::<PerspectiveCamera>(self.camera) {
            let (position, look_at) = (DVec3::from(eye.position), DVec3::from(eye.look_at));
            let by = f64::from(nudge) * (look_at - position) / f64::from(1u32 << 20).powi(2);
            camera.position = Some(position + by);
            camera.look_at = Some(look_at);
            camera.height_angle = eye.height_angle;
        }
    }

    pub(super) fn action(&self) -> RenderAction {
        RenderAction::new(self.size[0], self.size[1])
    }

    /// The frame of the present camera.
    pub(super) fn frame(&mut self) -> Result<&Frame, CostError> {
        Ok(self.action().apply_in(&self.scene, &mut self.view)?)
    }

    /// Draws the present frame once.
    pub(super) fn draw(&mut self) -> Result<(Picture, Statistics), CostError> {
        let frame = self.action().apply_in(&self.scene, &mut self.view)?;
        Ok((self.headless.draw(frame)?, frame.statistics))
    }

    /// Draws what an eye sees a few times. Times are the medians.
    pub(super) fn shoot(&mut self, eye: &Eye) -> Result<Shot, CostError> {
        // Choosing is cheap, and drawing may take seconds: each is repeated by itself.
        let mut selections = Vec::new();
        for repeat in 1..=SELECTIONS {
            self.look(eye, repeat);
            let start = Instant::now();
            self.frame()?;
            selections.push(ms(start.elapsed()));
        }
        self.look(eye, 0);
        // What takes seconds is drawn once.
        let start = Instant::now();
        let (picture, statistics) = self.draw()?;
        self.device_bytes = self.device_bytes.max(picture.report.gpu_bytes);
        let (mut encodings, mut gpus) = (vec![ms(picture.report.encode)], vec![picture.report.gpu.map(ms)]);
        while encodings.len() < REPEATS && start.elapsed() < self.patience {
            let report = self.draw()?.0.report;
            encodings.push(ms(report.encode));
            gpus.push(report.gpu.map(ms));
        }
        let times = FrameTimes {
            selection_ms: median(&mut selections),
            repeats: encodings.len() as u32,
            encoding_ms: median(&mut encodings),
            gpu_ms: gpu_figure(&gpus, median),
        };
        Ok(Shot { statistics, picture, times })
    }

    /// The view of the present camera.
    pub(super) fn viewpoint(&self) -> Result<Viewpoint, CostError> {
        Ok(self.action().viewpoint(&self.scene)?)
    }

    /// How far what the present camera sees is from the full-resolution surface on the screen, over all terrains.
    pub(super) fn error(&self) -> Result<ScreenError, CostError> {
        let found = self.measure(true, screen_error)?;
        let points: u64 = found.iter().map(|e| e.points).sum();
        let squares: f64 = found.iter().map(|e| e.rms * e.rms * e.points as f64).sum();
        Ok(ScreenError {
            max: found.iter().map(|e| e.max).fold(0.0, f64::max),
            rms: if points > 0 { (squares / points as f64).sqrt() } else { 0.0 },
            points,
        })
    }

    /// How many triangles, of those in view or of all, turn their back to the present camera.
    pub(super) fn facing_away(&self, in_view: bool) -> Result<u64, CostError> {
        Ok(self.measure(in_view, facing_away)?.into_iter().sum())
    }

    /// Measures the mesh of each terrain: the patches that are in view, or all.
    fn measure<M>(
        &self,
        in_view: bool,
        what: fn(&DrawnSurface<'_>, &[ActivePatch], &LatticeView) -> M,
    ) -> Result<Vec<M>, CostError> {
        let cameras = Cameras::new(&self.scene, self.size);
        let viewpoint = cameras.viewpoint(None)?;
        let mut measure =
            Measure { scene: &self.scene, viewpoint, cameras: &cameras, in_view, what, found: Vec::new() };
        walk(&self.scene, Branches::Seen(Some(&viewpoint)), &mut measure)?;
        Ok(measure.found)
    }
}

/// Milliseconds.
pub(super) fn ms(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}

/// The middle of some numbers, the lower of two; 0 of none.
pub(super) fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len().saturating_sub(1) / 2).copied().unwrap_or(0.0)
}

/// A figure of the times that the GPU took, if each frame has one.
pub(super) fn gpu_figure(times: &[Option<f64>], of: impl Fn(&mut [f64]) -> f64) -> Figure {
    let times: Option<Vec<f64>> = times.iter().copied().collect();
    Figure::new(times.filter(|t| !t.is_empty()).map(|mut t| of(&mut t)), NO_TIMESTAMPS)
}

/// All terrains of a scene.
fn occurrences(scene: &Scene) -> Result<Vec<Terrain>, ActionError> {
    struct Collect<'s> {
        scene: &'s Scene,
        found: Vec<Terrain>,
    }
    impl Visitor for Collect<'_> {
        fn shape(&mut self, _: &dyn ShapeNode, path: &Path, state: &Arc<State>) -> Result<Go, ActionError> {
            if let Some(key) = path.tail()
                && let Some(node) = self.scene.get::<SeamlessTerrain>(key)
            {
                let cx = ShapeContext::new(self.scene, state, path);
                let placed = node.placed(&cx).map_err(|e| cx.error(e))?;
                let allowed = 4f64.powf(1.0 - 2.0 * state.complexity.value);
                let names = path.names(self.scene);
                self.found.push(Terrain { key, names, model: state.model, placed, allowed });
            }
            Ok(Go::On)
        }
    }
    let mut collect = Collect { scene, found: Vec::new() };
    walk(scene, Branches::Possible, &mut collect)?;
    Ok(collect.found)
}

struct Measure<'s, M> {
    scene: &'s Scene,
    viewpoint: Viewpoint,
    cameras: &'s Cameras<'s>,
    in_view: bool,
    what: fn(&DrawnSurface<'_>, &[ActivePatch], &LatticeView) -> M,
    found: Vec<M>,
}

impl<M> Visitor for Measure<'_, M> {
    fn shape(&mut self, _: &dyn ShapeNode, path: &Path, state: &Arc<State>) -> Result<Go, ActionError> {
        let Some(node) = path.tail().and_then(|key| self.scene.get::<SeamlessTerrain>(key)) else {
            return Ok(Go::On);
        };
        let cx = ShapeContext {
            viewpoint: Some(&self.viewpoint),
            cameras: Some(self.cameras),
            ..ShapeContext::new(self.scene, state, path)
        };
        let placed = node.placed(&cx).map_err(|e| cx.error(e))?;
        let selection = node.selection(&cx, &placed).map_err(|e| cx.error(e))?;
        let view = lattice_view(&self.viewpoint, &state.model, &placed.frame);
        let (tree, pyramid) = (placed.tree.hierarchy(), placed.terrain.pyramid());
        // Both surfaces of a patch lie in its box: none of its points counts if that is out of view.
        let visible = |patch: &ActivePatch| {
            let [low, high] = pyramid.patch_box(tree, patch.id);
            !(self.in_view && view.frustum.excludes(low, high))
        };
        let patches: Vec<ActivePatch> = selection.patches(tree).filter(visible).collect();
        let (field, parts) = (placed.terrain.field(), placed.tree.parts());
        let drawn = DrawnSurface { field, tree, parts, selection: &selection };
        self.found.push((self.what)(&drawn, &patches, &view));
        Ok(Go::On)
    }
}

impl Terrain {
    /// A point above the ground in world coordinates: place in 0..1 of the extent from the south-west corner, height above
    /// the ground in parts of the longer side.
    fn over(&self, x: f64, y: f64, above: f64) -> DVec3 {
        let frame = &self.placed.frame;
        let field = self.placed.terrain.field();
        let [cu, cv] = frame.cells.map(f64::from);
        let (u, v) = (x * cu, (1.0 - y) * cv);
        let ground = field.filled_surface(u, v).unwrap_or(0.0);
        self.world(frame.local(DVec3::new(u, v, ground)) + DVec3::Z * above * self.side())
    }

    fn world(&self, local: DVec3) -> DVec3 {
        self.model.transform_point3(local)
    }

    /// Length of the longer side, local units.
    fn side(&self) -> f64 {
        let extent = self.extent();
        extent[0].max(extent[1])
    }

    /// Lengths along x and y, local units.
    pub(super) fn extent(&self) -> [f64; 2] {
        let frame = &self.placed.frame;
        [0, 1].map(|k| f64::from(frame.cells[k]) * frame.cell_size[k])
    }

    /// Lowest and highest local z.
    pub(super) fn heights(&self) -> [f64; 2] {
        let [low, high] = self.placed.terrain.pyramid().full_range().map(|w| self.placed.frame.local(DVec3::Z * w).z);
        [low.min(high), low.max(high)]
    }

    /// The fixed eyes.
    pub(super) fn eyes(&self, size: [u32; 2]) -> Vec<Eye> {
        let height_angle = PerspectiveCamera::default().height_angle;
        let eye = |name: &str, position: DVec3, look_at: DVec3| Eye {
            name: name.to_owned(),
            position: position.to_array(),
            look_at: look_at.to_array(),
            height_angle,
        };
        // Straight down, from where all of the map is in view.
        let t = (height_angle / 2.0).tan();
        let [x, y] = self.extent();
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        // In a picture higher than wide the angle is the horizontal one.
        let (tx, ty) = if aspect >= 1.0 { (t * aspect, t) } else { (t, t / aspect) };
        let [_, high] = self.heights();
        let top = high + (0.5 * x / tx).max(0.5 * y / ty);
        let above = self.world(DVec3::new(0.5 * x, 0.5 * y, top));
        let below = self.world(DVec3::new(0.5 * x, 0.5 * y, high));
        // From a cell's width above the highest sample, level, towards the furthest corner.
        let (frame, field) = (&self.placed.frame, self.placed.terrain.field());
        let mut summit = (f64::NEG_INFINITY, DVec3::ZERO);
        for r in 0..field.rows() {
            for c in 0..field.columns() {
                let p = DVec3::new(c.into(), r.into(), field.raw(c, r));
                let z = p.z * frame.z_step;
                if z > summit.0 {
                    summit = (z, p);
                }
            }
        }
        let summit = frame.local(summit.1) + DVec3::Z * frame.cell_size[0].max(frame.cell_size[1]);
        let far = |at: f64, side: f64| if at < 0.5 * side { side } else { 0.0 };
        let corner = DVec3::new(far(summit.x, x), far(summit.y, y), summit.z);
        vec![
            eye("above", above, below),
            eye("corner", self.over(0.0, 0.0, 0.1), self.over(0.5, 0.5, 0.0)),
            eye("middle", self.over(0.5, 0.5, 0.02), self.over(1.0, 0.5, 0.0)),
            eye("grazing", self.world(summit), self.world(corner)),
        ]
    }

    /// Step `k` of `steps` of a flight: once round the middle, above all ground, looking ahead and down.
    pub(super) fn flight(&self, k: u32, steps: u32) -> Eye {
        let [x, y] = self.extent();
        let [low, high] = self.heights();
        let angle = std::f64::consts::TAU * f64::from(k) / f64::from(steps);
        let place = |angle: f64, radius: f64, z: f64| {
            DVec3::new(x * (0.5 + radius * angle.cos()), y * (0.5 + radius * angle.sin()), z)
        };
        Eye {
            name: format!("step {k}"),
            position: self.world(place(angle, 0.35, high + 0.02 * self.side())).to_array(),
            look_at: self.world(place(angle + 1.0, 0.25, 0.5 * (low + high))).to_array(),
            height_angle: PerspectiveCamera::default().height_angle,
        }
    }
}
