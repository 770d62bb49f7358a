//! The terrain engine: heights, patches, detail and picks. No scene graph and no GPU in it.

mod axis;
pub mod coverage;
pub mod data;
pub mod drawn;
pub mod drawn_pick;
pub mod errors;
pub mod exact;
mod fan_tree;
mod fill;
pub mod frustum;
pub mod generate;
pub mod height_field;
pub mod hierarchy;
pub mod instances;
mod line;
pub mod measure;
pub mod morph;
pub mod parts;
pub mod pick;
pub mod pixel_error;
pub mod published;
pub mod pyramid;
pub mod selection;
mod shadow;
mod sign;
mod stencil;

pub use coverage::{Coverage, Displacement};
pub use data::{Detail, PatchTree, Terrain};
pub use drawn::{DrawnSurface, DrawnTriangle};
pub use drawn_pick::{DrawnHit, DrawnPick};
pub use errors::TileErrors;
pub use exact::{ExactHit, ExactSurface, SurfacePoint};
pub use frustum::Frustum;
pub use generate::generate;
pub use height_field::{HeightField, HeightFieldError, LatticeFrame, SampleRect, Samples, Voids};
pub use hierarchy::{Hierarchy, PatchId};
pub use instances::{Instance, Instances, LooseVertex};
pub use measure::{ScreenError, facing_away, screen_error};
pub use morph::{MorphErrors, MorphPixelError, PatchWeights, Urgency};
pub use parts::{Part, Parts, Resolutions, ResolutionsError, Side, UnitVertex, parts_of};
pub use pixel_error::{LatticeView, PixelError, PixelProjection};
pub use pyramid::MinMaxPyramid;
pub use selection::{ActivePatch, Demand, Full, LodEye, Metric, Precision, Selection, side_vertices};
pub use shadow::{LatticeLight, ShadowMap};

/// Random numbers for tests.
#[cfg(test)]
mod random {
    /// splitmix64
    pub(super) fn bits(state: &mut u64) -> u64 {
        *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = *state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }
}
