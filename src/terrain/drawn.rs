//! The surface that is on the screen: the very triangles of tiles and strips of the active patches, in f64.
//!
//! At every level of detail a triangle is drawn if none of its corners lies in a hole of the map; a hole so changes its
//! outline with the detail, by no more than the metric allows (see [`super::coverage`]).
//!
//! Whoever has to agree with a picture asks here: the pick on the drawn surface, the measure of the error on the screen, tests
//! that count vertices. What decides a triangle's place is written down once.

use super::errors::{place, unclamped};
use super::height_field::HeightField;
use super::hierarchy::Hierarchy;
use super::morph::morphed_height;
use super::parts::{Part, Parts, parts_of};
use super::selection::{ActivePatch, Selection};

/// A triangle as it is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DrawnTriangle {
    /// Which tile or strip it belongs to.
    pub part: Part,
    /// Corners on the lattice, clamped to the map; counter-clockwise seen from above. Two may be the same, or all three on a
    /// line, where the patch crosses the border of the map.
    pub corners: [[u32; 2]; 3],
    /// Raw heights of the corners.
    pub heights: [f64; 3],
    /// How much of its own sample is in the height of a corner that is new at its patch's refinement; 1 unless the selection
    /// morphs (see [`super::morph`]).
    pub weights: [f32; 3],
}

/// The triangles of a selection.
///
/// # Example
///
/// ```
/// use seamount::terrain::{DrawnSurface, Full, Hierarchy, Parts, Resolutions, Selection, generate};
///
/// let field = generate(33, 1)?;
/// let resolutions = Resolutions::new(8, 2)?;
/// let (tree, parts) = (Hierarchy::new(field.cells(), resolutions), Parts::new(resolutions));
/// let selection = Selection::of(&tree, &Full);
/// let drawn = DrawnSurface { field: &field, tree: &tree, parts: &parts, selection: &selection };
/// let triangles: usize = selection.patches(&tree).map(|patch| drawn.triangles(patch).count()).sum();
/// assert_eq!(triangles, 2 * 32 * 32); // every cell of the map
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct DrawnSurface<'t> {
    /// The heights.
    pub field: &'t HeightField,
    /// The patches.
    pub tree: &'t Hierarchy,
    /// The meshes that patches are put together from.
    pub parts: &'t Parts,
    /// Which patches are active.
    pub selection: &'t Selection,
}

impl<'t> DrawnSurface<'t> {
    /// The triangles of one active patch of the selection: those without a corner in a hole. A selection that morphs has its
    /// weights in the heights.
    pub fn triangles(&self, patch: ActivePatch) -> impl Iterator<Item = DrawnTriangle> + use<'t> {
        self.triangles_where(patch, |_| true)
    }

    /// The triangles of one active patch, but for those in boxes that are not wanted: `wanted` is asked about boxes, north-west
    /// and south-east corner on the lattice, that contain some of the patch's triangles each.
    pub fn triangles_where<W>(&self, patch: ActivePatch, wanted: W) -> impl Iterator<Item = DrawnTriangle> + use<'t, W>
    where
        W: Fn([[u32; 2]; 2]) -> bool + Copy,
    {
        let surface = *self;
        let triangles = self.with_lids_where(patch, wanted).map(|(triangle, _)| triangle);
        triangles.filter(move |triangle| !surface.is_lid(triangle))
    }

    /// [`DrawnSurface::triangles_where`] with those that are left out for a hole, at the heights that fill it; and with their corners
    /// before they are clamped to the map, where no two of a triangle, and no two edges, are the same.
    pub(super) fn with_lids_where<W>(
        &self,
        patch: ActivePatch,
        wanted: W,
    ) -> impl Iterator<Item = (DrawnTriangle, [[u32; 2]; 3])> + use<'t, W>
    where
        W: Fn([[u32; 2]; 2]) -> bool + Copy,
    {
        let Self { field, tree, parts, selection } = *self;
        let patch_weights = selection.weights(tree, patch.id);
        let (step, last) = (tree.step(patch.id.level), tree.resolutions().max());
        parts_of(patch.sides).into_iter().flat_map(move |part| {
            // Clamping to the map is monotone: a clamped box contains its clamped triangles.
            let groups = parts.groups(part, move |corners| wanted(place(tree, patch.id, corners)));
            groups.flatten().map(move |triangle| {
                let corners = place(tree, patch.id, *triangle);
                let weights = patch_weights.map_or([1.0; 3], |weights| triangle.map(|unit| weights.at(unit, last)));
                let heights = std::array::from_fn(|k| morphed_height(field, corners[k], step, weights[k]));
                (DrawnTriangle { part, corners, heights, weights }, unclamped(tree, patch.id, *triangle))
            })
        })
    }

    /// Whether a triangle is left out for a hole.
    pub(super) fn is_lid(&self, triangle: &DrawnTriangle) -> bool {
        triangle.corners.iter().any(|&[u, v]| self.field.is_hole(u, v))
    }
}
