//! What the report says: the schema of `data.json`, described in `docs/cost-schema.md`.
//!
//! Rows keep apart what the same command finds again, `figures`, and what it does not, `times`. Both are objects of numbers,
//! and a row has a `name` that no other of its list has: [`super::compare`] needs to know no more than that.

use serde::{Deserialize, Serialize};

use crate::node::DetailMode;

/// Raised when a reader of `data.json` has to change.
pub const SCHEMA_VERSION: u32 = 1;

/// A number, or why there is none.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Figure {
    /// It was measured.
    Value(f64),
    /// It was not: `{"value": null, "reason": "…"}`.
    Missing {
        /// Always null.
        value: (),
        /// Why it could not be measured.
        reason: String,
    },
}

impl Figure {
    /// A number; with this reason none if it is missing or not finite.
    #[must_use]
    pub fn new(value: Option<f64>, reason: &str) -> Self {
        match value {
            Some(value) if value.is_finite() => Figure::Value(value),
            _ => Figure::Missing { value: (), reason: reason.to_owned() },
        }
    }

    /// The number, if there is one.
    #[must_use]
    pub fn value(&self) -> Option<f64> {
        match self {
            Figure::Value(value) => Some(*value),
            Figure::Missing { .. } => None,
        }
    }
}

/// All of `data.json`. A section that was not measured, or not yet, is `None`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// [`SCHEMA_VERSION`].
    pub schema: u32,
    /// Whether the run came to its end; if not, the last sections are missing or short.
    pub complete: bool,
    /// What was measured, and with what.
    pub about: About,
    /// Section 1.
    pub drawing: Option<Drawing>,
    /// Section 5.
    pub published: Option<Published>,
    /// Section 6.
    pub cracks: Option<Cracks>,
    /// Section 4.
    pub precision: Option<Precision>,
    /// Section 2.
    pub picking: Option<Picking>,
    /// Section 3.
    pub effects: Option<EffectsCost>,
}

/// The head of the report.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct About {
    /// Version of the crate.
    pub version: String,
    /// The command.
    pub command: String,
    /// Graphics adapter: name, backend and kind.
    pub adapter: String,
    /// Its driver.
    pub driver: String,
    /// Name of the processor; empty if the system does not say.
    pub processor: String,
    /// Threads that the processor runs at once.
    pub threads: u32,
    /// Width and height of the pictures in pixels.
    pub size: [u32; 2],
    /// Whether it is the short run.
    pub quick: bool,
    /// The terrain whose eyes are used, as a path in the scene.
    pub terrain: Vec<String>,
    /// Columns and rows of its samples.
    pub samples: [u32; 2],
}

/// A place to look from, in world coordinates.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Eye {
    /// What it is called in the rows.
    pub name: String,
    /// Where the camera stands.
    pub position: [f64; 3],
    /// The point in the middle of the picture.
    pub look_at: [f64; 3],
    /// Vertical field of view in radians.
    pub height_angle: f64,
}

/// Section 1: what detail costs when drawing, and how far off it is.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Drawing {
    /// Where the pictures were taken from.
    pub eyes: Vec<Eye>,
    /// Memory, the same for all settings.
    pub memory: Vec<MemoryRow>,
    /// Each eye with each setting.
    pub rows: Vec<DrawingRow>,
    /// Each setting of the flight.
    pub flights: Vec<FlightRow>,
}

/// What is kept for all settings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MemoryRow {
    /// Always `memory`.
    pub name: String,
    /// Bytes.
    pub figures: Memory,
}

/// Bytes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    /// Heights of the terrain.
    pub heights_bytes: u64,
    /// Errors of its tiles, from which the error in pixels is known.
    pub errors_bytes: u64,
    /// Most that the renderer held on the device: textures, targets and buffers.
    pub device_bytes: u64,
}

/// One eye and one setting.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DrawingRow {
    /// Eye and setting.
    pub name: String,
    /// The eye.
    pub eye: String,
    /// The setting.
    pub detail: DetailMode,
    /// Whether patches out of view were left out.
    pub culling: bool,
    /// What the same command finds again.
    pub figures: DrawingFigures,
    /// Milliseconds.
    pub times: FrameTimes,
}

/// Of one picture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DrawingFigures {
    /// Triangles drawn.
    pub triangles: u64,
    /// Active patches drawn.
    pub patches: u64,
    /// Draw calls.
    pub draw_calls: u32,
    /// Bytes sent to the device for the frame, the maps being there.
    pub bytes_per_frame: u64,
    /// Largest distance on the screen between the mesh and the full-resolution surface.
    pub max_error_px: f64,
    /// Root of the mean square of that distance.
    pub rms_error_px: f64,
    /// Peak signal-to-noise ratio against the picture of the full mesh, dB. Larger is better.
    pub psnr_db: Figure,
    /// Mean ꟻLIP against the picture of the full mesh, 0..1.
    pub flip: Figure,
}

/// Times of a frame, medians over the repeats.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrameTimes {
    /// From the scene to the list of what to draw: the walk, the choice of detail, culling, instances.
    pub selection_ms: f64,
    /// From the list to submitted commands.
    pub encoding_ms: f64,
    /// What the GPU took.
    pub gpu_ms: Figure,
    /// How often it was drawn: as often as there was time for.
    pub repeats: u32,
}

impl FrameTimes {
    /// All three together, if the GPU's is known.
    #[must_use]
    pub fn frame_ms(&self) -> Option<f64> {
        Some(self.selection_ms + self.encoding_ms + self.gpu_ms.value()?)
    }
}

/// One setting in flight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FlightRow {
    /// The setting.
    pub name: String,
    /// The setting.
    pub detail: DetailMode,
    /// Pictures taken.
    pub steps: u32,
    /// Pictures of which the error on the screen was measured.
    pub measured_steps: u32,
    /// What the same command finds again.
    pub figures: FlightFigures,
    /// Milliseconds.
    pub times: FlightTimes,
}

/// Over all steps of a flight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FlightFigures {
    /// Mean of the triangles drawn.
    pub mean_triangles: f64,
    /// Most triangles drawn.
    pub max_triangles: u64,
    /// Mean of the patches drawn.
    pub mean_patches: f64,
    /// Mean of the draw calls.
    pub mean_draw_calls: f64,
    /// Most draw calls.
    pub max_draw_calls: u32,
    /// Mean of the bytes sent.
    pub mean_bytes_per_frame: f64,
    /// Largest error on the screen over the measured steps, in pixels.
    pub max_error_px: f64,
}

/// Over all steps of a flight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FlightTimes {
    /// Mean of the selections, the first left out.
    pub mean_selection_ms: f64,
    /// Longest selection, the first left out.
    pub max_selection_ms: f64,
    /// Mean of the encodings, the first left out.
    pub mean_encoding_ms: f64,
    /// Mean of the GPU's times, the first left out.
    pub mean_gpu_ms: Figure,
    /// Longest of the GPU's times, the first left out.
    pub max_gpu_ms: Figure,
}

/// Section 5: the published tables, done again.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Published {
    /// Three views, culling on and off, instanced and separate.
    pub views: Vec<PublishedRow>,
    /// The flight, instanced and separate, ρ = 1 and 4.
    pub flights: Vec<PublishedRow>,
}

/// One way to draw one view, or the flight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PublishedRow {
    /// View and way of drawing.
    pub name: String,
    /// Whether patches out of view were left out.
    pub culling: bool,
    /// Whether all places of a part were drawn by one call.
    pub instanced: bool,
    /// What the same command finds again; means over the steps of a flight.
    pub figures: PublishedFigures,
    /// Milliseconds.
    pub times: PublishedTimes,
}

/// Of one picture, or the mean over a flight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PublishedFigures {
    /// Triangles drawn.
    pub triangles: f64,
    /// Those of them that turn their back to the eye: the device leaves them out before it fills a pixel.
    pub facing_away: f64,
    /// Draw calls.
    pub draw_calls: f64,
    /// Kinds of part in use: the fewest calls that drawing can take.
    pub parts_in_use: f64,
}

/// Of one picture, or the mean over a flight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PublishedTimes {
    /// From the list of what to draw to submitted commands.
    pub encoding_ms: f64,
    /// What the GPU took.
    pub gpu_ms: Figure,
    /// Both together.
    pub frame_ms: Figure,
}

/// Section 6: how often both sides of a border disagree.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Cracks {
    /// Eyes that each rule was tried with.
    pub eyes: u32,
    /// The rules.
    pub rules: Vec<CrackRow>,
}

/// One rule.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CrackRow {
    /// The rule and the resolutions it was tried with.
    pub name: String,
    /// Sides of active patches that were looked at.
    pub sides: u64,
    /// What the same command finds again.
    pub figures: CrackFigures,
}

/// Of one rule.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CrackFigures {
    /// Eyes that saw any crack.
    pub cracked_eyes: u64,
    /// Steps along a side that only one of its patches takes.
    pub cracks: u64,
}

/// Section 4: what the distance from the origin costs.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Precision {
    /// By offset.
    pub rows: Vec<PrecisionRow>,
}

/// One offset.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PrecisionRow {
    /// The offset.
    pub name: String,
    /// Along x and y, in world units.
    pub offset: f64,
    /// Picks that were compared.
    pub picks: u32,
    /// What the same command finds again.
    pub figures: PrecisionFigures,
}

/// Of one offset.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PrecisionFigures {
    /// Pixels that differ from the picture at the origin.
    pub different_pixels: u64,
    /// Largest difference of a colour, of 255.
    pub max_difference: u32,
    /// Rays that hit at the origin and miss here, or the other way round.
    pub lost_picks: u32,
    /// Largest distance between what a ray meets here and at the origin, in the terrain's own coordinates.
    pub max_pick_error: Figure,
    /// How far the same ground would be off on the screen with positions and matrices in f32, in pixels.
    pub f32_error_px: Figure,
    /// How far a picked point would be off if positions were f32, in world units.
    pub f32_pick_error: Figure,
}

/// Section 2: what picking costs on each surface.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Picking {
    /// Each surface with each class of rays and each setting.
    pub rows: Vec<PickingRow>,
}

/// One surface, one class of rays and one setting.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PickingRow {
    /// All three.
    pub name: String,
    /// The surface.
    pub surface: String,
    /// Rays that were cast.
    pub rays: u32,
    /// Of these, how many meet the full-resolution surface.
    pub hits: u32,
    /// What the same command finds again.
    pub figures: PickingFigures,
    /// Nanoseconds.
    pub times: PickingTimes,
}

/// Of one class of rays.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PickingFigures {
    /// Rays that hit nothing although they start above the ground and end below it.
    pub lost: u32,
    /// Root of the mean square of the vertical distance between the picked point and the ground below or above it, world units.
    pub rms_vertical: Figure,
    /// Largest of these distances.
    pub max_vertical: Figure,
    /// Median of the horizontal distance between the picked point and what the ray meets on the full-resolution surface.
    pub median_horizontal: Figure,
    /// 95 of 100 of these distances are not larger.
    pub p95_horizontal: Figure,
}

/// Of one class of rays.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PickingTimes {
    /// Per ray on one thread, the walk over the scene included.
    pub ns_per_ray: f64,
}

/// Section 3: what effects cost.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct EffectsCost {
    /// τ of the frame that they are added to, pixels.
    pub tolerance_px: f64,
    /// Each effect by itself, then all that go together.
    pub rows: Vec<EffectRow>,
}

/// One set of effects.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EffectRow {
    /// The effect.
    pub name: String,
    /// All effects of the draws.
    pub effects: Vec<String>,
    /// What the same command finds again.
    pub figures: EffectFigures,
    /// Milliseconds.
    pub times: EffectTimes,
}

/// Of one set of effects.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EffectFigures {
    /// Length of the WGSL.
    pub shader_bytes: u64,
    /// Bytes on the device.
    pub device_bytes: u64,
    /// Bytes sent for each frame.
    pub bytes_per_frame: u64,
}

/// Of one set of effects.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EffectTimes {
    /// What the GPU took.
    pub gpu_ms: Figure,
}

/// A setting of detail as rows call it.
#[must_use]
pub fn detail_name(detail: DetailMode) -> String {
    match detail {
        DetailMode::PixelError(tolerance) => format!("τ = {tolerance} px"),
        DetailMode::Precision(precision) => format!("ρ = {precision}"),
        DetailMode::Full => "full mesh".to_owned(),
    }
}
