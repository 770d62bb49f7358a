use std::sync::Arc;

use glam::{DAffine3, DVec2, DVec3, DVec4};
use serde::{Deserialize, Serialize};

use super::field::enum_field;
use super::{FieldProblem, FieldValue, HitDetail, ShapeHit, ShapeNode, TerrainDetail, TerrainTriangle, Triangle};
use crate::action::{
    Aabb, DebugColor, DrawContext, DrawOptions, Geometry, GeometryKind, Lens, Ray, ShapeContext, ShapeError, Surface,
    TerrainDraw, Viewpoint,
};
use crate::terrain::pick::{CoarseSurface, Fan, FanTree, LatticeRay, TerrainHit};
use crate::terrain::{
    ActivePatch, Detail, DrawnHit, DrawnPick, DrawnSurface, ExactHit, ExactSurface, Frustum, HeightField, Instances,
    LatticeFrame, LatticeView, LodEye, Part, PatchTree, PixelProjection, Precision, Resolutions, Samples, Selection,
    Side, Terrain,
};

/// How a terrain is coloured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, Default)]
pub enum ColorMode {
    /// By material and colour map.
    #[default]
    Plain,
    /// Tiles green and strips red, unlit, to see how patches are put together.
    Parts,
    /// A colour per level of the patch tree, unlit.
    Levels,
    /// The normals that shading uses as colours: red, green and blue are world x, y and z, -1 black and 1 full.
    Normals,
    /// How many pixels each tile and strip may be off at most, unlit: from violet, not at all, over green to yellow, as much as a
    /// `detail` of `PixelError` allows (with Complexity; one pixel with any other); more than that is red, and dark red from
    /// four times on. As the camera sees it that the detail is for; what it does not see is not off.
    Errors,
}

enum_field!(ColorMode: Plain | Parts | Levels | Normals | Errors);

/// How the detail of a terrain is chosen.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum DetailMode {
    /// The coarsest mesh whose every visible point lies within so many pixels of where full resolution would show it. From
    /// 0 (full resolution in view) up.
    PixelError(f64),
    /// The published metric with precision ρ, above 0: a side of length l at distance d from the eye has ρ · l / d times the
    /// largest resolution. 1 is coarse, 4 fine; it knows nothing of the roughness of the ground.
    Precision(f64),
    /// Every cell of the map.
    Full,
}

impl FieldValue for DetailMode {
    fn type_name() -> String {
        "PixelError(pixels) | Precision(number) | Full".to_owned()
    }

    fn is_finite(&self) -> bool {
        match self {
            DetailMode::PixelError(v) | DetailMode::Precision(v) => v.is_finite(),
            DetailMode::Full => true,
        }
    }
}

/// What becomes of samples without height.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, Default)]
pub enum VoidMode {
    /// They are interpolated smoothly from their border when the map is loaded.
    #[default]
    Fill,
    /// They are holes: no triangle has a void for a corner, at whatever detail, picks pass through and the box leaves them
    /// out. With `detail: PixelError(τ)` the outline of a hole is at most τ pixels from where it belongs, so that a hole, or a
    /// ridge beside it, may vanish where it is smaller than that; `Precision` knows nothing of holes.
    Hole,
}

enum_field!(VoidMode: Fill | Hole);

crate::define_node! {
    /// A landscape over a map of heights, drawn with seamless patches (Livny, Kogan and El-Sana 2007) whose detail follows
    /// the camera.
    ///
    /// The map comes from the texture unit that carries heights (unit 0), colours from unit 1 if there is a texture. Local
    /// frame: x east along the columns, y north (row 0 has the largest y), z up, the origin at the south-west corner;
    /// height = `base_height` + intensity · `max_height`, intensity 0..1 at the file's full depth.
    ///
    /// Render draws tiles and strips of the active patches; ray pick tests four coarse triangles per active patch and says
    /// how far off they may be, or if so asked what is drawn or every cell; the bounding box is that of the full-resolution
    /// heights and needs no camera. Forgetting `TextureUnit(unit: 1)` before the colour map is the usual mistake: it replaces
    /// the heights.
    ///
    /// Example: `TextureUnit(unit: 0), Texture2(filename: "fuji.png"), SeamlessTerrain(size: (90600.0, 111240.0),
    /// max_height: 65535.0, base_height: -1000.0, void_sample: 0)`.
    pub struct SeamlessTerrain: shape {
        /// Length of the longer side in local units, cells square. Above 0.
        pub scale: f64 = 1.0,
        /// Lengths along x and y, where cells are not square; goes before `scale`. Above 0.
        pub size: Option<DVec2> = None,
        /// Height of intensity 1 above `base_height`, local units.
        pub max_height: f64 = 0.02,
        /// Height of intensity 0, local units.
        pub base_height: f64 = 0.0,
        /// The sample value, at the file's depth, that marks a void. None: no sample does.
        pub void_sample: Option<f64> = None,
        /// What becomes of voids.
        pub voids: VoidMode = VoidMode::Fill,
        /// How much detail is drawn and picked: by the error in pixels, by the published precision, or all there is.
        /// Complexity multiplies the allowed error by 4^(1 − 2·value). Without a camera it is full detail.
        pub detail: DetailMode = DetailMode::PixelError(1.0),
        /// Name of the camera whose view decides the detail, for drawing and picking alike, to look from outside at what it
        /// gets. None: the camera that the picture is taken from. A name that no camera has is an error.
        pub lod_camera: Option<String> = None,
        /// Smallest resolution of a patch's side, a power of two, and how many resolutions there are, 2 to 5, each twice
        /// the one before. The default was chosen by measurement: few triangles for a given error, with patches that are
        /// still few enough to choose among in no time.
        pub resolutions: (u32, u32) = (8, 2),
        /// Whether heights blend between levels as the camera moves, instead of jumping. The error stays within what `detail`
        /// allows, for more triangles; docs/morph.md has the figures. Needs two resolutions: with more a patch has more than
        /// one refinement. Full detail has nothing to blend.
        pub morph: bool = false,
        /// Whether patches outside the view are left out when drawing.
        pub culling: bool = true,
        /// How it is coloured.
        pub color_mode: ColorMode = ColorMode::Plain,
    }
    actions {
        Render: "draws the patches that the picture needs";
        BoundingBox: "holds its heights at full resolution";
        RayPick, HandleEvent: "meet its patches, what is drawn of them, or every cell of the map; events the first";
        Callback: "hands out the coarse triangles of its patches";
        PrimitiveCount: "counts them";
    }
    check SeamlessTerrain::check;
}

/// A terrain node with its map: all that the actions need.
pub(crate) struct Placed {
    pub(crate) terrain: Arc<Terrain>,
    pub(crate) tree: Arc<PatchTree>,
    pub(crate) frame: LatticeFrame,
}

/// What a ray can meet: the same for all rays of one picker.
struct Target {
    placed: Placed,
    /// The active patches; none are asked for on the exact surface.
    selection: Option<Arc<Selection>>,
    /// Their four triangles each, if those are met.
    fans: Option<Arc<FanTree>>,
}

impl SeamlessTerrain {
    fn check(&self) -> Vec<FieldProblem> {
        let mut problems = Vec::new();
        // Asked by every action: a message is written only where it is needed.
        let mut need = |field, good: bool, message: &dyn Fn() -> String| {
            if !good {
                problems.push(FieldProblem::new(field, message()));
            }
        };
        let positive = |v: f64| v > 0.0 && v.is_finite();
        need("scale", positive(self.scale), &|| format!("{} does not work: a length above 0", self.scale));
        if let Some(DVec2 { x, y }) = self.size {
            need("size", positive(x) && positive(y), &|| format!("({x}, {y}) does not work: two lengths above 0"));
        }
        need("max_height", self.max_height.is_finite(), &|| format!("{} is not a finite number", self.max_height));
        need("base_height", self.base_height.is_finite(), &|| format!("{} is not a finite number", self.base_height));
        match self.detail {
            DetailMode::PixelError(v) => {
                need("detail", v >= 0.0, &|| format!("a pixel error of {v} does not work: a number from 0 up"));
            }
            DetailMode::Precision(v) => {
                need("detail", positive(v), &|| format!("a precision of {v} does not work: a number above 0"));
            }
            DetailMode::Full => {}
        }
        if let Err(error) = Resolutions::new(self.resolutions.0, self.resolutions.1) {
            need("resolutions", false, &|| error.to_string());
        }
        let (min, count) = self.resolutions;
        need("morph", !self.morph || count == 2, &|| {
            format!(
                "morph works with two resolutions, where a patch has one refinement; resolutions ({min}, {count}) have \
                     {count}: give resolutions ({min}, 2), or morph false"
            )
        });
        problems
    }

    pub(crate) fn placed(&self, cx: &ShapeContext<'_>) -> Result<Placed, ShapeError> {
        if let Some(problem) = self.check().into_iter().next() {
            return Err(problem.into());
        }
        let unit = cx.state.program.height_unit;
        let image = cx.image(unit)?.ok_or(ShapeError::NoHeights { unit })?;
        let terrain = cx.scene.resources().terrain(&image, self.void_sample, self.voids == VoidMode::Hole)?;
        let tree = terrain.tree(Resolutions::new(self.resolutions.0, self.resolutions.1)?);
        let frame = self.frame(terrain.field());
        Ok(Placed { terrain, tree, frame })
    }

    /// Where the node puts a map: the map from lattice to local coordinates.
    #[must_use]
    pub fn frame(&self, field: &HeightField) -> LatticeFrame {
        let cells = field.cells();
        let cell_size = match self.size {
            Some(size) => [size.x / f64::from(cells[0]), size.y / f64::from(cells[1])],
            None => [self.scale / f64::from(cells[0].max(cells[1])); 2],
        };
        // For 16 bits `max_height` 65535 makes the step exactly 1.
        let z_step = match field.samples() {
            Samples::U16(_) => self.max_height / 65535.0,
            Samples::F32(_) => self.max_height,
        };
        LatticeFrame { cells, cell_size, base: self.base_height, z_step }
    }

    /// The view that the detail is for.
    fn lod_view(&self, cx: &ShapeContext<'_>) -> Result<Option<Viewpoint>, ShapeError> {
        match (&self.lod_camera, cx.cameras) {
            (Some(name), Some(cameras)) => {
                Ok(Some(cameras.viewpoint(Some(name)).map_err(|error| ShapeError::LodCamera(Box::new(error)))?))
            }
            _ => Ok(cx.viewpoint.copied()),
        }
    }

    /// What the choice of detail depends on.
    fn detail(&self, cx: &ShapeContext<'_>, placed: &Placed) -> Result<Detail, ShapeError> {
        let Some(view) = &self.lod_view(cx)? else { return Ok(Detail::Leaves) };
        let allowed = allowed(cx);
        Ok(match self.detail {
            DetailMode::Full => Detail::Leaves,
            DetailMode::Precision(precision) => lod_eye(view, cx, placed).map_or(Detail::Leaves, |eye| {
                let metric = Precision { precision: precision / allowed, eye };
                if self.morph { Detail::MorphPrecision(metric) } else { Detail::Precision(metric) }
            }),
            DetailMode::PixelError(tolerance) => {
                let tolerance = tolerance * allowed;
                let view = lattice_view(view, &cx.state.model, &placed.frame);
                if self.morph {
                    Detail::MorphPixelError { tolerance, view }
                } else {
                    Detail::PixelError { tolerance, view }
                }
            }
        })
    }

    /// What errors are coloured by, if they are.
    fn rating(&self, cx: &ShapeContext<'_>, placed: &Placed) -> Result<Option<Rating>, ShapeError> {
        let view = match self.color_mode {
            ColorMode::Errors => self.lod_view(cx)?,
            ColorMode::Plain | ColorMode::Parts | ColorMode::Levels | ColorMode::Normals => None,
        };
        Ok(view.map(|view| {
            let unit = match self.detail {
                DetailMode::PixelError(tolerance) => tolerance * allowed(cx),
                DetailMode::Precision(_) | DetailMode::Full => 1.0,
            };
            // Nothing and infinitely much are no measures.
            let unit = if unit > 0.0 && unit.is_finite() { unit } else { 1.0 };
            Rating { view: lattice_view(&view, &cx.state.model, &placed.frame), unit }
        }))
    }

    /// The active patches for a query: those that are drawn in a frozen view, otherwise those that the detail asks for.
    pub(crate) fn selection(&self, cx: &ShapeContext<'_>, placed: &Placed) -> Result<Arc<Selection>, ShapeError> {
        let kept = cx.kept.and_then(|kept| kept.downcast_ref::<History>()).and_then(|history| history.chosen(placed));
        match kept {
            Some(choice) => Ok(Arc::clone(&choice.selection)),
            None => Ok(placed.tree.select(&placed.terrain, &self.detail(cx, placed)?)),
        }
    }
}

/// What Complexity multiplies the allowed error by.
fn allowed(cx: &ShapeContext<'_>) -> f64 {
    4f64.powf(1.0 - 2.0 * cx.state.complexity.value)
}

/// A camera in the lattice coordinates of a terrain: linear functions, so it works for singular transforms too. `model` takes
/// the terrain's local coordinates to the world's.
#[must_use]
pub fn lattice_view(view: &Viewpoint, model: &DAffine3, frame: &LatticeFrame) -> LatticeView {
    let eye_from_local = DAffine3 { matrix3: model.matrix3, translation: model.translation - view.eye };
    let to_local = frame.to_local();
    let m = eye_from_local.matrix3 * to_local.matrix3;
    let t = eye_from_local.transform_point3(to_local.translation);
    let along = |axis: DVec3| DVec4::new(axis.dot(m.x_axis), axis.dot(m.y_axis), axis.dot(m.z_axis), axis.dot(t));
    let projection = match view.lens {
        Lens::Perspective { tan_half_height } => {
            PixelProjection::Perspective { focal: 0.5 * view.pixels / tan_half_height, tangents: view.window() }
        }
        Lens::Orthographic { half_height } => PixelProjection::Orthographic { scale: 0.5 * view.pixels / half_height },
    };
    LatticeView {
        frustum: view.frustum().pulled_back(&DAffine3 { matrix3: m, translation: t }),
        right: along(view.right),
        up: along(view.up),
        depth: along(view.forward),
        projection,
    }
}

/// Units per cell, the same in both directions, to compare heights and distances with cells.
fn mean_cell(frame: &LatticeFrame) -> f64 {
    (frame.cell_size[0] * frame.cell_size[1]).sqrt()
}

/// The eye in cells; `None` when the transform does not allow to say.
fn lod_eye(view: &Viewpoint, cx: &ShapeContext<'_>, placed: &Placed) -> Option<LodEye> {
    let model = cx.state.model;
    let inverse = inverse_of(&model)?;
    let cell = mean_cell(&placed.frame);
    let eye = match view.lens {
        Lens::Orthographic { half_height } => {
            // The distance from which a perspective camera of 45° would show the same height, in local units: lengths
            // across the view shrink by the cube root of the determinant on the mean.
            let shrink = inverse.matrix3.determinant().abs().cbrt();
            LodEye::Everywhere { distance: half_height / std::f64::consts::FRAC_PI_8.tan() * shrink / cell }
        }
        Lens::Perspective { .. } => {
            let p = placed.frame.lattice(inverse.transform_point3(view.eye));
            // One height for the whole frame: above the ground below the eye, or the nearest ground.
            let [u, v] = [p.x, p.y];
            let [cu, cv] = placed.frame.cells.map(f64::from);
            let ground = placed.terrain.field().filled_surface(u.clamp(0.0, cu), v.clamp(0.0, cv))?;
            LodEye::Point { u, v, height: (p.z - ground) * placed.frame.z_step / cell }
        }
    };
    let finite = match eye {
        LodEye::Point { u, v, height } => u.is_finite() && v.is_finite() && height.is_finite(),
        LodEye::Everywhere { distance } => distance.is_finite(),
    };
    finite.then_some(eye)
}

/// The inverse, unless the map is singular.
fn inverse_of(model: &DAffine3) -> Option<DAffine3> {
    crate::action::inverse(&model.matrix3)?;
    let inverse = model.inverse();
    inverse.is_finite().then_some(inverse)
}

/// What a terrain keeps from frame to frame.
#[derive(Debug, Default)]
struct History {
    choice: Option<Choice>,
    /// Whether the list is that of the choice, cut by this view volume.
    listed: bool,
    frustum: Option<Frustum>,
    /// What the parts of the list were rated by.
    rating: Option<Rating>,
    visible: Vec<ActivePatch>,
    /// Of the visible patches those that a hole takes triangles from; they are not among the others.
    holed: Vec<ActivePatch>,
    culled: u64,
    /// The last list comes last. Frames that are still in use, here or in another thread, hold the others.
    instances: Vec<Arc<Instances>>,
}

/// By what the errors of parts are told: as seen from a camera, in multiples of so many pixels.
#[derive(Debug, PartialEq)]
struct Rating {
    view: LatticeView,
    unit: f64,
}

/// Lists of instances that are kept: one that is drawn, one that waits to be drawn, one that is made.
const LISTS: usize = 3;

/// A selection with what it was made for.
#[derive(Debug)]
struct Choice {
    tree: Arc<PatchTree>,
    detail: Detail,
    selection: Arc<Selection>,
}

impl History {
    /// The choice, if it was made for this map.
    fn chosen(&self, placed: &Placed) -> Option<&Choice> {
        self.choice.as_ref().filter(|choice| Arc::ptr_eq(&choice.tree, &placed.tree))
    }

    /// Chooses the active patches; whether that took a new selection.
    fn choose(&mut self, placed: &Placed, detail: Detail) -> bool {
        if self.chosen(placed).is_some_and(|choice| choice.detail == detail) {
            return false;
        }
        self.choice = None;
        let selection = placed.tree.select(&placed.terrain, &detail);
        self.choice = Some(Choice { tree: Arc::clone(&placed.tree), detail, selection });
        self.listed = false;
        true
    }

    /// The parts to draw of the chosen patches that meet the view volume; of all without one. With their errors if there is a
    /// rating.
    fn list(&mut self, placed: &Placed, frustum: Option<Frustum>, rating: Option<Rating>) -> Arc<Instances> {
        if self.listed
            && self.frustum == frustum
            && self.rating == rating
            && let Some(last) = self.instances.last()
        {
            return Arc::clone(last);
        }
        let tree = placed.tree.hierarchy();
        let pyramid = placed.terrain.pyramid();
        let outside = |patch: &ActivePatch| {
            frustum.as_ref().is_some_and(|frustum| {
                let [low, high] = pyramid.patch_box(tree, patch.id);
                frustum.excludes(low, high)
            })
        };
        let holed = placed.tree.holed(placed.terrain.field());
        self.visible.clear();
        self.holed.clear();
        self.culled = 0;
        if let Some(choice) = &self.choice {
            for patch in choice.selection.patches(tree) {
                if outside(&patch) {
                    self.culled += 1;
                } else if holed.get(tree.index(patch.id)).is_some_and(|&holed| holed) {
                    self.holed.push(patch);
                } else {
                    self.visible.push(patch);
                }
            }
        }
        // The memory of a list that no frame holds any more, or new one.
        let free = self.instances.iter().position(|list| Arc::strong_count(list) == 1);
        let free = free.or((self.instances.len() >= LISTS).then_some(0));
        let mut list = free.map(|at| self.instances.remove(at)).unwrap_or_default();
        if Arc::get_mut(&mut list).is_none() {
            list = Arc::default();
        }
        if let Some(list) = Arc::get_mut(&mut list) {
            let parts = placed.tree.parts();
            list.update(tree, parts, &self.visible);
            if let Some(choice) = &self.choice {
                let selection = &choice.selection;
                list.weigh(tree, parts, &self.visible, selection);
                if !self.holed.is_empty() {
                    let drawn = DrawnSurface { field: placed.terrain.field(), tree, parts, selection };
                    list.update_loose(&drawn, &self.holed);
                }
                if let Some(Rating { view, unit }) = &rating {
                    let off = |patch| {
                        let pixels = placed.tree.pixels_off(&placed.terrain, selection, view, patch);
                        // What is allowed is at most one, whatever f64 rounds: f32 resolves less. And no f32 is infinite.
                        pixels.map(|pixels| (pixels / unit).min(f32::MAX.into()) as f32)
                    };
                    let drawn = DrawnSurface { field: placed.terrain.field(), tree, parts, selection };
                    list.rate(parts, &self.visible, off);
                    list.rate_loose(&drawn, &self.holed, off);
                }
            }
        }
        self.instances.push(Arc::clone(&list));
        (self.listed, self.frustum, self.rating) = (true, frustum, rating);
        list
    }
}

impl Placed {
    /// Lattice point (exact integers in u and v) near a local point, to be subtracted before rounding to f32.
    fn anchor(&self, local: DVec3) -> ([u32; 2], f32) {
        let p = self.frame.lattice(local);
        let clamp = |x: f64, last: u32| x.round().clamp(0.0, f64::from(last)) as u32;
        let [low, high] = self.terrain.pyramid().full_range();
        let w = if p.z.is_finite() { p.z.clamp(low, high) } else { low };
        let w = match self.terrain.field().samples() {
            Samples::U16(_) => w.round() as f32,
            Samples::F32(_) => w as f32,
        };
        ([clamp(p.x, self.frame.cells[0]), clamp(p.y, self.frame.cells[1])], w)
    }

    fn surface_normal(&self, [gu, gv]: [f64; 2]) -> DVec3 {
        let [dx, dy] = self.frame.cell_size;
        let s = self.frame.z_step;
        DVec3::new(-gu * s / dx, gv * s / dy, 1.0)
    }

    /// The normal for shading: the slopes at the corners of the cell, blended.
    fn smooth_normal(&self, cell: [u32; 2], point: DVec3) -> DVec3 {
        let field = self.terrain.field();
        let (fu, fv) = (point.x - f64::from(cell[0]), point.y - f64::from(cell[1]));
        let mut gradient = [0.0; 2];
        for (du, dv, weight) in
            [(0, 0, (1.0 - fu) * (1.0 - fv)), (1, 0, fu * (1.0 - fv)), (0, 1, (1.0 - fu) * fv), (1, 1, fu * fv)]
        {
            let corner = field.gradient(cell[0] + du, cell[1] + dv);
            gradient = [gradient[0] + weight * corner[0], gradient[1] + weight * corner[1]];
        }
        self.surface_normal(gradient)
    }

    /// A hit in the node's terms.
    fn hit(&self, t: f64, lattice: DVec3, gradient: [f64; 2], wall: Option<Side>, detail: TerrainDetail) -> ShapeHit {
        let point = self.frame.local(lattice);
        let surface_normal = self.surface_normal(gradient);
        let (normal, slope) = match wall {
            None => (surface_normal, surface_normal.truncate().length().atan()),
            Some(side) => {
                let outward = match side {
                    Side::North => DVec3::Y,
                    Side::East => DVec3::X,
                    Side::South => DVec3::NEG_Y,
                    Side::West => DVec3::NEG_X,
                };
                (outward, std::f64::consts::FRAC_PI_2)
            }
        };
        let field = self.terrain.field();
        let [c, r] = detail.cell;
        let void = [(0, 0), (1, 0), (0, 1), (1, 1)].into_iter().any(|(du, dv)| field.is_void(c + du, r + dv));
        let [cu, cv] = self.frame.cells.map(f64::from);
        ShapeHit {
            t,
            point,
            normal,
            smooth_normal: self.smooth_normal(detail.cell, lattice),
            uv: DVec2::new(lattice.x / cu, 1.0 - lattice.y / cv),
            detail: HitDetail::Terrain(TerrainDetail {
                wall: wall.is_some(),
                void,
                height: point.z,
                slope,
                error: detail.error * self.frame.z_step.abs(),
                entering: detail.entering != (self.frame.z_step < 0.0),
                ..detail
            }),
        }
    }

    fn cell(&self, u: f64, v: f64) -> [u32; 2] {
        let [cu, cv] = self.frame.cells;
        [(u.max(0.0) as u32).min(cu - 1), (v.max(0.0) as u32).min(cv - 1)]
    }

    fn coarse_hit(&self, hit: &TerrainHit) -> ShapeHit {
        // Weights are a matter of places: no heights are fetched from all over the map for them.
        let fan = Fan::flat(self.tree.hierarchy(), hit.patch);
        let detail = TerrainDetail {
            surface: Surface::Coarse,
            patch: hit.patch,
            triangle: TerrainTriangle::Side(hit.triangle),
            barycentric: fan.barycentric(hit.triangle, hit.point.x, hit.point.y),
            cell: self.cell(hit.point.x, hit.point.y),
            error: hit.error,
            entering: hit.entering,
            ..TerrainDetail::default()
        };
        self.hit(hit.t, hit.point, hit.gradient, hit.wall, detail)
    }

    fn drawn_hit(&self, hit: &DrawnHit, selection: &Selection) -> ShapeHit {
        let (field, tree) = (self.terrain.field(), self.tree.hierarchy());
        let error = match selection.weights(tree, hit.patch.id) {
            Some(weights) => hit.error_morphing(tree, &weights, self.tree.morph_errors(field)),
            None => hit.error(tree, || self.tree.tile_errors(field)),
        };
        let detail = TerrainDetail {
            surface: Surface::Drawn,
            patch: hit.patch.id,
            triangle: match hit.triangle.part {
                Part::Tile(side, _) => TerrainTriangle::Tile(side),
                Part::Strip(side, ..) => TerrainTriangle::Strip(side),
            },
            barycentric: hit.barycentric,
            cell: self.cell(hit.point.x, hit.point.y),
            error,
            entering: hit.entering,
            ..TerrainDetail::default()
        };
        self.hit(hit.t, hit.point, hit.gradient, hit.border, detail)
    }

    fn exact_hit(&self, hit: &ExactHit) -> ShapeHit {
        let detail = TerrainDetail {
            surface: Surface::Exact,
            patch: self.tree.hierarchy().leaf_at(hit.cell[0], hit.cell[1]),
            triangle: if hit.upper { TerrainTriangle::Upper } else { TerrainTriangle::Lower },
            barycentric: hit.barycentric,
            cell: hit.cell,
            error: hit.error,
            entering: hit.entering,
            ..TerrainDetail::default()
        };
        self.hit(hit.t, hit.point, hit.gradient, None, detail)
    }
}

impl ShapeNode for SeamlessTerrain {
    fn bounds(&self, cx: &ShapeContext<'_>) -> Result<Option<Aabb>, ShapeError> {
        let placed = self.placed(cx)?;
        // A map that is one hole has no box.
        Ok(placed.terrain.extent().and_then(|corners| Aabb::of(corners.map(|c| placed.frame.local(c)))))
    }

    /// The coarse surface: four triangles per active patch.
    fn primitives(&self, cx: &ShapeContext<'_>, sink: &mut dyn FnMut(Triangle)) -> Result<(), ShapeError> {
        let placed = self.placed(cx)?;
        let tree = placed.tree.hierarchy();
        let selection = self.selection(cx, &placed)?;
        let [cu, cv] = placed.frame.cells.map(f64::from);
        for patch in selection.patches(tree) {
            let fan = Fan::new(placed.terrain.field(), tree, patch.id);
            for side in Side::ALL {
                // Clockwise in (u, v), where v runs south, is clockwise from above: turn it.
                let [a, b, c] = fan.triangle(side);
                let corners = [a, c, b];
                // Clamped to the border of the map a triangle may have no area.
                if fan.area(side) == 0.0 {
                    continue;
                }
                let normal = placed.surface_normal(fan.gradient(side)).normalize();
                sink(Triangle {
                    points: corners.map(|p| placed.frame.local(p)),
                    normals: [normal; 3],
                    uvs: corners.map(|p| DVec2::new(p.x / cu, 1.0 - p.y / cv)),
                    ..Triangle::default()
                });
            }
        }
        Ok(())
    }

    fn ray(&self, cx: &ShapeContext<'_>, ray: &Ray, first: bool, hits: &mut Vec<ShapeHit>) -> Result<(), ShapeError> {
        let target = cx.remember(|| {
            let placed = self.placed(cx)?;
            let selection = match cx.surface {
                Surface::Coarse | Surface::Drawn => Some(self.selection(cx, &placed)?),
                Surface::Exact => None,
            };
            let fans = selection.as_ref().filter(|_| cx.surface == Surface::Coarse);
            let fans = fans.map(|selection| placed.tree.fans(placed.terrain.field(), selection));
            Ok(Target { placed, selection, fans })
        })?;
        let placed = &target.placed;
        let [dx, dy] = placed.frame.cell_size;
        let s = placed.frame.z_step;
        let d = ray.direction;
        // In units of a relief that is next to nothing, a ray starts so high up that it looks vertical, or beyond f64. Samples
        // go to 10³⁸: from 10¹⁰⁰ of them the relief is 10⁻⁶² of the height that the ray starts from, far below its rounding.
        let start = (ray.origin.z - placed.frame.base) / s;
        if s == 0.0 || start.is_nan() || start.abs() > 1e100 || !(d.z / s).is_finite() {
            flat(placed, cx.surface, ray, hits);
            return Ok(());
        }
        let lattice = LatticeRay {
            origin: placed.frame.lattice(ray.origin),
            direction: DVec3::new(d.x / dx, -d.y / dy, d.z / s),
            near: ray.near,
            far: ray.far,
        };
        let field = placed.terrain.field();
        let pyramid = placed.terrain.pyramid();
        let (tree, parts) = (placed.tree.hierarchy(), placed.tree.parts());
        match (&target.selection, &target.fans) {
            (Some(selection), Some(fans)) => {
                let errors = placed.tree.fan_errors(field);
                CoarseSurface { field, tree, selection, fans, errors }.intersect(&lattice, |hit| {
                    hits.push(placed.coarse_hit(&hit));
                    !first
                });
            }
            (Some(selection), None) => {
                let drawn = DrawnSurface { field, tree, parts, selection };
                DrawnPick { drawn, pyramid }.intersect(&lattice, |hit| {
                    hits.push(placed.drawn_hit(&hit, selection));
                    !first
                });
            }
            (None, _) => ExactSurface { field, pyramid }.intersect(&lattice, |hit| {
                hits.push(placed.exact_hit(&hit));
                !first
            }),
        }
        Ok(())
    }

    fn draw(&self, cx: &mut DrawContext<'_>) -> Result<(), ShapeError> {
        let placed = self.placed(&cx.shape)?;
        let tree = placed.tree.hierarchy();
        let mut history = cx.take_kept::<History>();
        if !(cx.freeze && history.chosen(&placed).is_some()) {
            let detail = self.detail(&cx.shape, &placed)?;
            cx.statistics.selections += u32::from(history.choose(&placed, detail));
        }
        let frustum = self.culling.then(|| cx.local_frustum().pulled_back(&placed.frame.to_local()));
        let rating = self.rating(&cx.shape, &placed)?;
        let instances = history.list(&placed, frustum, rating);
        cx.statistics.patches_traversed += history.chosen(&placed).map_or(0, |c| c.selection.traversed().into());
        cx.statistics.patches_culled += history.culled;
        cx.statistics.patches_rendered += (history.visible.len() + history.holed.len()) as u64;
        cx.keep(history);

        let eye = inverse_of(&cx.shape.state.model).map_or(DVec3::ZERO, |i| i.transform_point3(cx.view.eye));
        let anchor = placed.anchor(eye);
        let anchor_point = DVec3::new(anchor.0[0].into(), anchor.0[1].into(), anchor.1.into());
        let [dx, dy] = placed.frame.cell_size;
        let local_from_rel = DAffine3 {
            matrix3: glam::DMat3::from_diagonal(DVec3::new(dx, -dy, placed.frame.z_step)),
            translation: placed.frame.local(anchor_point),
        };
        let options = DrawOptions {
            kind: GeometryKind::of_terrain(placed.terrain.field(), false),
            debug_color: match self.color_mode {
                ColorMode::Plain => DebugColor::Plain,
                ColorMode::Parts => DebugColor::Parts,
                ColorMode::Levels => DebugColor::Levels,
                ColorMode::Normals => DebugColor::Normals,
                ColorMode::Errors => DebugColor::Errors,
            },
            lit: self.color_mode == ColorMode::Plain,
            morph: instances.morphs(),
            two_sided: false,
        };
        let draw = TerrainDraw {
            heights: Arc::clone(placed.terrain.field()),
            parts: Arc::clone(placed.tree.parts()),
            instances,
            anchor,
            levels: u32::from(tree.depth()) + 1,
            branching: tree.resolutions().branching(),
        };
        let loose = (!draw.instances.loose().is_empty()).then(|| draw.clone());
        cx.draw(Geometry::Terrain(draw), &local_from_rel, options)?;
        if let Some(loose) = loose {
            let options = DrawOptions { kind: GeometryKind::of_terrain(placed.terrain.field(), true), ..options };
            cx.draw(Geometry::Terrain(loose), &local_from_rel, options)?;
        }
        Ok(())
    }
}

/// A terrain of no height, or next to none, is a rectangle, on all surfaces.
fn flat(placed: &Placed, surface: Surface, ray: &Ray, hits: &mut Vec<ShapeHit>) {
    let t = (placed.frame.base - ray.origin.z) / ray.direction.z;
    if !(t >= ray.near && t <= ray.far) {
        return;
    }
    // On the rectangle, whatever the height that rounding gives: it may be large in units of the relief.
    let point = placed.frame.lattice(ray.at(t)).with_z(0.0);
    // Through a hole the ray passes, and beside the map.
    let Some((cell, upper)) = placed.terrain.field().ground_at(point.x, point.y) else { return };
    let (fu, fv) = (point.x - f64::from(cell[0]), point.y - f64::from(cell[1]));
    let (triangle, barycentric) = if upper {
        (TerrainTriangle::Upper, [1.0 - fu, fu - fv, fv])
    } else {
        (TerrainTriangle::Lower, [1.0 - fv, fv - fu, fu])
    };
    let patch = placed.tree.hierarchy().leaf_at(cell[0], cell[1]);
    // In raw terms, as on the surfaces with a relief.
    let entering = (ray.direction.z < 0.0) != (placed.frame.z_step < 0.0);
    let error = placed.terrain.pyramid().full_range().map(f64::abs).into_iter().fold(0.0, f64::max);
    let detail =
        TerrainDetail { surface, patch, triangle, barycentric, cell, error, entering, ..TerrainDetail::default() };
    hits.push(placed.hit(t, point, [0.0, 0.0], None, detail));
}
