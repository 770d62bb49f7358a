//! A map with everything that is derived from it, each made on first need and kept.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError, Weak};

use glam::DVec3;

use super::errors::TileErrors;
use super::height_field::{HeightField, SampleRect, Samples, Voids};
use super::hierarchy::Hierarchy;
use super::morph::{MorphErrors, MorphPixelError};
use super::parts::{Parts, Resolutions};
use super::pick::{FanErrors, FanTree};
use super::pixel_error::{LatticeView, PixelError};
use super::pyramid::MinMaxPyramid;
use super::selection::{ActivePatch, Full, LodEye, Precision, Selection};

/// A map of heights with its min/max tree and its patch trees.
#[derive(Debug)]
pub struct Terrain {
    field: Arc<HeightField>,
    pyramid: OnceLock<MinMaxPyramid>,
    extent: OnceLock<Option<[DVec3; 2]>>,
    trees: Trees,
}

type Trees = Mutex<HashMap<Resolutions, Arc<PatchTree>>>;

impl Terrain {
    /// Derives nothing yet.
    #[must_use]
    pub fn new(field: HeightField) -> Self {
        Self { field: Arc::new(field), pyramid: OnceLock::new(), extent: OnceLock::new(), trees: Mutex::default() }
    }

    /// The terrain with other samples in a rectangle of its map; `Err` gives it back if voids are concerned, which takes the
    /// whole map.
    pub(crate) fn with_samples(
        self: Arc<Self>,
        rect: SampleRect,
        with: &Samples,
        voids: Voids,
    ) -> Result<Self, Arc<Self>> {
        // The map itself is taken out, so that it is copied only if somebody else holds it.
        match Arc::try_unwrap(self) {
            Ok(Self { field, pyramid, extent, trees }) => match field.overwritten(rect, with, voids) {
                Ok(edited) => Ok(Self::update(edited, pyramid, &trees, rect)),
                Err(field) => Err(Arc::new(Self { field, pyramid, extent, trees })),
            },
            Err(shared) => match Arc::clone(&shared.field).overwritten(rect, with, voids) {
                Ok(edited) => Ok(Self::update(edited, shared.pyramid.clone(), &shared.trees, rect)),
                Err(_) => Err(shared),
            },
        }
    }

    /// The terrain of an edited map, with all that was derived from the old one brought up to date; what is shared with
    /// others is copied first. Where holes are concerned nothing is kept: they reach into all that is derived.
    pub(crate) fn edited(self: Arc<Self>, field: HeightField) -> Self {
        if self.field.has_holes() || field.has_holes() {
            return Self::new(field);
        }
        let changed = self.field.difference(&field);
        match Arc::try_unwrap(self) {
            Ok(Self { pyramid, trees, .. }) => Self::update(field, pyramid, &trees, changed),
            Err(shared) => Self::update(field, shared.pyramid.clone(), &shared.trees, changed),
        }
    }

    fn update(field: HeightField, mut pyramid: OnceLock<MinMaxPyramid>, trees: &Trees, changed: SampleRect) -> Self {
        if let Some(pyramid) = pyramid.get_mut() {
            pyramid.update(&field, changed);
        }
        let trees = trees.lock().unwrap_or_else(PoisonError::into_inner);
        let tree = |(&r, tree): (&Resolutions, &Arc<PatchTree>)| (r, Arc::new(tree.edited(&field, changed)));
        let trees = Mutex::new(trees.iter().map(tree).collect());
        Self { field: Arc::new(field), pyramid, extent: OnceLock::new(), trees }
    }

    /// The heights.
    #[must_use]
    pub fn field(&self) -> &Arc<HeightField> {
        &self.field
    }

    /// The smallest box around the ground in lattice coordinates: least and largest (column, row, raw height). What lies over
    /// holes is left out; `None` if nothing is ground. Found on first call.
    pub fn extent(&self) -> Option<[DVec3; 2]> {
        *self.extent.get_or_init(|| {
            let field = &self.field;
            if !field.has_holes() {
                let [low, high] = self.pyramid().full_range();
                let [cells_u, cells_v] = field.cells().map(f64::from);
                return Some([DVec3::new(0.0, 0.0, low), DVec3::new(cells_u, cells_v, high)]);
            }
            let samples = (0..field.rows()).flat_map(|r| (0..field.columns()).map(move |c| (c, r)));
            let ground = samples.filter(|&(c, r)| !field.is_hole(c, r));
            let points = ground.map(|(c, r)| DVec3::new(c.into(), r.into(), field.raw(c, r)));
            points.fold(None, |extent, p| match extent {
                None => Some([p; 2]),
                Some([low, high]) => Some([low.min(p), high.max(p)]),
            })
        })
    }

    /// The min/max tree, made on first call. It includes the lids over holes.
    pub fn pyramid(&self) -> &MinMaxPyramid {
        self.pyramid.get_or_init(|| MinMaxPyramid::new(&self.field))
    }

    /// The patch tree for these resolutions, made on first call.
    pub fn tree(&self, resolutions: Resolutions) -> Arc<PatchTree> {
        let mut trees = self.trees.lock().unwrap_or_else(PoisonError::into_inner);
        Arc::clone(
            trees.entry(resolutions).or_insert_with(|| Arc::new(PatchTree::new(self.field.cells(), resolutions))),
        )
    }
}

/// How detail is chosen: the inputs of a selection, comparable.
#[derive(Debug, Clone, PartialEq)]
pub enum Detail {
    /// The finest patches at their finest: the leaves of the tree, every cell of the map.
    Leaves,
    /// The paper's metric.
    Precision(Precision),
    /// The error in pixels.
    PixelError {
        /// τ in pixels.
        tolerance: f64,
        /// The camera.
        view: LatticeView,
    },
    /// The paper's metric with heights that blend between levels. The tree has to have two resolutions.
    MorphPrecision(Precision),
    /// The error in pixels with heights that blend between levels. The tree has to have two resolutions.
    MorphPixelError {
        /// τ in pixels.
        tolerance: f64,
        /// The camera.
        view: LatticeView,
    },
}

impl Detail {
    /// The paper's metric with an eye.
    #[must_use]
    pub fn precision(precision: f64, eye: LodEye) -> Self {
        Detail::Precision(Precision { precision, eye })
    }
}

/// Selections that are kept per tree: a picture and a few cameras that pick.
const RECENT: usize = 4;

/// A patch tree with the parts its patches are drawn from and the selections made lately.
#[derive(Debug)]
pub struct PatchTree {
    hierarchy: Hierarchy,
    parts: Arc<Parts>,
    fan_errors: OnceLock<FanErrors>,
    tile_errors: OnceLock<TileErrors>,
    morph_errors: OnceLock<MorphErrors>,
    holed: OnceLock<Vec<bool>>,
    recent: Mutex<Vec<(Detail, Arc<Selection>)>>,
    /// Selections are not kept alive by their fans.
    fans: Mutex<Vec<(Weak<Selection>, Arc<FanTree>)>>,
}

impl PatchTree {
    /// The tree over a map of so many cells.
    #[must_use]
    pub fn new(cells: [u32; 2], resolutions: Resolutions) -> Self {
        Self {
            hierarchy: Hierarchy::new(cells, resolutions),
            parts: Arc::new(Parts::new(resolutions)),
            fan_errors: OnceLock::new(),
            tile_errors: OnceLock::new(),
            morph_errors: OnceLock::new(),
            holed: OnceLock::new(),
            recent: Mutex::default(),
            fans: Mutex::default(),
        }
    }

    /// The same tree over an edited map: the errors of patches with samples in the rectangle are measured anew.
    fn edited(&self, field: &HeightField, changed: SampleRect) -> Self {
        let mut edited = Self {
            hierarchy: self.hierarchy.clone(),
            parts: Arc::clone(&self.parts),
            fan_errors: self.fan_errors.clone(),
            tile_errors: self.tile_errors.clone(),
            // Weights of patches reach into all around them: anew when they are next asked for.
            morph_errors: OnceLock::new(),
            holed: OnceLock::new(),
            recent: Mutex::default(),
            fans: Mutex::default(),
        };
        if let Some(errors) = edited.fan_errors.get_mut() {
            errors.update(field, &edited.hierarchy, changed);
        }
        if let Some(errors) = edited.tile_errors.get_mut() {
            errors.update(field, &edited.hierarchy, &edited.parts, changed);
        }
        edited
    }

    /// Which patches there are.
    #[must_use]
    pub fn hierarchy(&self) -> &Hierarchy {
        &self.hierarchy
    }

    /// The meshes of tiles and strips.
    #[must_use]
    pub fn parts(&self) -> &Arc<Parts> {
        &self.parts
    }

    /// The largest vertical error of the four coarse triangles of each patch, made on first call from the field that the
    /// tree belongs to.
    pub fn fan_errors(&self, field: &HeightField) -> &FanErrors {
        self.fan_errors.get_or_init(|| FanErrors::new(field, &self.hierarchy))
    }

    /// The vertical errors of all tiles, made on first call from the field that the tree belongs to.
    pub fn tile_errors(&self, field: &HeightField) -> &TileErrors {
        self.tile_errors.get_or_init(|| TileErrors::new(field, &self.hierarchy, &self.parts))
    }

    /// For each patch, by [`Hierarchy::index`], whether a hole takes samples from it; empty for a map without holes. Made on
    /// first call from the field that the tree belongs to.
    pub fn holed(&self, field: &HeightField) -> &[bool] {
        self.holed.get_or_init(|| {
            let tree = &self.hierarchy;
            let patches = (0..=tree.depth()).flat_map(|level| tree.patches(level));
            field.holes().map_or(Vec::new(), |holes| patches.map(|p| holes.any_in(tree.extent(p))).collect())
        })
    }

    /// The vertical errors of all patches with any weights, and how far the outlines of holes are off, made on first call from
    /// the field that the tree belongs to.
    pub fn morph_errors(&self, field: &HeightField) -> &MorphErrors {
        self.morph_errors.get_or_init(|| {
            let errors = MorphErrors::new(field, &self.hierarchy, &self.parts);
            // Nobody else asks for the errors of tiles: only holes need them.
            let outlines = if field.has_holes() { self.tile_errors(field).coverage() } else { None };
            match outlines {
                Some(outlines) => errors.with_outlines(&self.hierarchy, outlines),
                None => errors,
            }
        })
    }

    /// How many pixels what is drawn on the four sides of an active patch (north, east, south, west) may be off at most, as seen
    /// from a camera: by its vertical error, and by the outlines of holes. Infinite where there is no bound, 0 out of view. `terrain`
    /// is the one that the tree belongs to.
    ///
    /// # Example
    ///
    /// ```
    /// use glam::{DAffine3, DVec2, DVec3};
    /// use seamount::action::{Lens, Viewpoint};
    /// use seamount::node::{SeamlessTerrain, lattice_view};
    /// use seamount::terrain::{Detail, Resolutions, Terrain, generate};
    ///
    /// let (terrain, node) = (Terrain::new(generate(257, 1)?), SeamlessTerrain::default());
    /// let camera = Viewpoint {
    ///     eye: DVec3::new(0.5, -1.0, 0.5),
    ///     right: DVec3::X,
    ///     up: DVec3::Z,
    ///     forward: DVec3::Y,
    ///     lens: Lens::Perspective { tan_half_height: 0.8 },
    ///     center: DVec2::ZERO,
    ///     aspect: 1.5,
    ///     pixels: 480.0,
    ///     near: 0.01,
    ///     far: None,
    /// };
    /// let view = lattice_view(&camera, &DAffine3::IDENTITY, &node.frame(terrain.field()));
    /// let tree = terrain.tree(Resolutions::new(8, 2)?);
    /// let selection = tree.select(&terrain, &Detail::PixelError { tolerance: 2.0, view: view.clone() });
    /// for patch in selection.patches(tree.hierarchy()) {
    ///     let off = tree.pixels_off(&terrain, &selection, &view, patch);
    ///     assert!(off.iter().all(|&pixels| pixels <= 2.0 * (1.0 + 1e-12)), "{off:?}");
    /// }
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn pixels_off(
        &self,
        terrain: &Terrain,
        selection: &Selection,
        view: &LatticeView,
        patch: ActivePatch,
    ) -> [f64; 4] {
        let (tree, field) = (&self.hierarchy, terrain.field());
        match selection.weights(tree, patch.id) {
            Some(weights) => [self.morph_errors(field).pixels_drawn(tree, patch.id, &weights, view); 4],
            None => {
                let (errors, pyramid) = (self.tile_errors(field), terrain.pyramid());
                PixelError { tolerance: 0.0, view, errors, pyramid }.pixels(tree, patch)
            }
        }
    }

    /// The fans of a selection of this tree, made on first call for each of the last few selections; `field` is the one that
    /// the tree belongs to.
    pub fn fans(&self, field: &HeightField, selection: &Arc<Selection>) -> Arc<FanTree> {
        let mut kept = self.fans.lock().unwrap_or_else(PoisonError::into_inner);
        let this = Arc::as_ptr(selection);
        if let Some((_, fans)) = kept.iter().rev().find(|(of, _)| of.as_ptr() == this && of.strong_count() > 0) {
            return Arc::clone(fans);
        }
        kept.retain(|(of, _)| of.strong_count() > 0);
        if kept.len() >= RECENT {
            kept.remove(0);
        }
        let fans = Arc::new(FanTree::new(field, &self.hierarchy, selection));
        kept.push((Arc::downgrade(selection), Arc::clone(&fans)));
        fans
    }

    /// The active patches for this detail. The same detail gives the same selection without work; `terrain` is the one that
    /// the tree belongs to.
    pub fn select(&self, terrain: &Terrain, detail: &Detail) -> Arc<Selection> {
        let mut recent = self.recent.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(at) = recent.iter().position(|(d, _)| d == detail) {
            let found = recent.remove(at);
            let selection = Arc::clone(&found.1);
            recent.push(found);
            return selection;
        }
        // Use the buffers of the oldest again if nobody else holds them.
        let oldest = if recent.len() >= RECENT { Some(recent.remove(0).1) } else { None };
        let mut selection =
            oldest.and_then(|s| Arc::try_unwrap(s).ok()).unwrap_or_else(|| Selection::new(&self.hierarchy));
        match detail {
            Detail::Leaves => selection.update(&self.hierarchy, &Full),
            Detail::Precision(metric) => selection.update(&self.hierarchy, metric),
            Detail::PixelError { tolerance, view } => {
                let errors = self.tile_errors(terrain.field());
                let pyramid = terrain.pyramid();
                selection.update(&self.hierarchy, &PixelError { tolerance: *tolerance, view, errors, pyramid });
            }
            Detail::MorphPrecision(precision) => selection.update_morphing(&self.hierarchy, precision),
            Detail::MorphPixelError { tolerance, view } => {
                let errors = self.morph_errors(terrain.field());
                selection.update_morphing(&self.hierarchy, &MorphPixelError { tolerance: *tolerance, view, errors });
            }
        }
        let selection = Arc::new(selection);
        recent.push((detail.clone(), Arc::clone(&selection)));
        selection
    }
}
