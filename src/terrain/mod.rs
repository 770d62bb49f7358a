//! The terrain engine: heights, patches, detail and picks. No scene graph and no GPU in it.

pub mod data;
pub mod drawn;
pub mod errors;
pub mod exact;
mod fill;
pub mod frustum;
pub mod generate;
pub mod height_field;
pub mod hierarchy;
pub mod instances;
pub mod measure;
pub mod parts;
pub mod pick;
pub mod pixel_error;
pub mod published;
pub mod pyramid;
pub mod selection;
mod stencil;

pub use data::{Detail, PatchTree, Terrain};
pub use drawn::{DrawnSurface, DrawnTriangle};
pub use errors::TileErrors;
pub use exact::{ExactHit, ExactSurface, SurfacePoint};
pub use frustum::Frustum;
pub use generate::generate;
pub use height_field::{HeightField, HeightFieldError, LatticeFrame, Samples, Voids};
pub use hierarchy::{Hierarchy, PatchId};
pub use instances::{Instance, Instances};
pub use measure::{ScreenError, screen_error};
pub use parts::{Part, Parts, Resolutions, ResolutionsError, Side, UnitVertex, parts_of};
pub use pixel_error::{LatticeView, PixelError, PixelProjection};
pub use pyramid::MinMaxPyramid;
pub use selection::{ActivePatch, Demand, Full, LodEye, Metric, Precision, Selection, side_vertices};
