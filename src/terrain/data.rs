//! A map with everything that is derived from it, each made on first need and kept.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::errors::TileErrors;
use super::height_field::HeightField;
use super::hierarchy::Hierarchy;
use super::morph::{MorphErrors, MorphPixelError};
use super::parts::{Parts, Resolutions};
use super::pick::FanErrors;
use super::pixel_error::{LatticeView, PixelError};
use super::pyramid::MinMaxPyramid;
use super::selection::{Full, LodEye, Precision, Selection};

/// A map of heights with its min/max tree and its patch trees.
#[derive(Debug)]
pub struct Terrain {
    field: Arc<HeightField>,
    pyramid: OnceLock<MinMaxPyramid>,
    trees: Mutex<HashMap<Resolutions, Arc<PatchTree>>>,
}

impl Terrain {
    /// Derives nothing yet.
    #[must_use]
    pub fn new(field: HeightField) -> Self {
        Self { field: Arc::new(field), pyramid: OnceLock::new(), trees: Mutex::default() }
    }

    /// The heights.
    #[must_use]
    pub fn field(&self) -> &Arc<HeightField> {
        &self.field
    }

    /// The min/max tree, made on first call.
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
    recent: Mutex<Vec<(Detail, Arc<Selection>)>>,
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
            recent: Mutex::default(),
        }
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

    /// The vertical errors of all patches with any weights, made on first call from the field that the tree belongs to.
    pub fn morph_errors(&self, field: &HeightField) -> &MorphErrors {
        self.morph_errors.get_or_init(|| MorphErrors::new(field, &self.hierarchy, &self.parts))
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
