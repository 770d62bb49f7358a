//! The obvious scene around a map of heights.

use std::path::{Path, PathBuf};

use glam::{DQuat, DVec3};
use thiserror::Error;

use crate::node::{
    AxisAngle, Color, ColorRamp, DirectionalLight, Material, PerspectiveCamera, SeamlessTerrain, Separator, Texture2,
    TextureUnit,
};
use crate::scene::{EditError, ImageError, Scene};
use crate::terrain::{HeightFieldError, Samples};

/// Why a map could not be shown.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MapError {
    /// The image can not be had.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The image is no map.
    #[error("{path}: {error}", path = path.display())]
    HeightField {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        error: HeightFieldError,
    },
    /// Scene files are text, and so are the names in them.
    #[error("{path}: the file's name is not UTF-8: give it another name", path = path.display())]
    Name {
        /// The file.
        path: PathBuf,
    },
    /// The scene could not be put together.
    #[error(transparent)]
    Edit(#[from] EditError),
}

/// Height of the relief against the longer side of the map.
const RELIEF: f64 = 1.0 / 8.0;

/// Makes the obvious scene around a map of heights: an image file of any kind that [`Image::open`](crate::scene::Image::open)
/// reads.
///
/// What is not known is chosen so that something is to be seen:
///
/// * cells are squares of one unit, the south-west corner is the origin;
/// * heights are exaggerated so that the highest point lies an eighth of the longer side above the lowest, which lies at 0.
///   All samples count as heights, none as a void;
/// * the camera looks north-north-west and down by 35°, from where it sees everything;
/// * it is coloured by height, as atlases are;
/// * the sun shines from the west-south-west, half way up.
///
/// # Errors
///
/// When the file can not be had or decoded, or is smaller than 2 × 2 samples.
///
/// # Example
///
/// ```no_run
/// use seamount::prelude::*;
///
/// let scene = seamount::format::scene_of_map("scenes/fuji.png")?;
/// let frame = RenderAction::new(1280, 720).apply(&scene)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn scene_of_map(path: impl AsRef<Path>) -> Result<Scene, MapError> {
    let path = path.as_ref();
    let filename = path.to_str().ok_or_else(|| MapError::Name { path: path.to_owned() })?;
    let mut scene = Scene::with_root(Separator::default());
    let image = scene.resources().image(path)?;
    let terrain = scene
        .resources()
        .terrain(&image, None, false)
        .map_err(|error| MapError::HeightField { path: path.to_owned(), error })?;

    let [columns, rows] = terrain.field().cells();
    let longer = f64::from(columns.max(rows));
    let [low, high] = terrain.pyramid().full_range();
    let full = match terrain.field().samples() {
        Samples::U16(_) => 65535.0,
        Samples::F32(_) => 1.0,
    };
    // A flat map stays flat whatever its heights are multiplied by.
    let step = if high > low { RELIEF * longer / (high - low) } else { 1.0 };

    let turn = DQuat::from_rotation_z(20f64.to_radians()) * DQuat::from_rotation_x(55f64.to_radians());
    let (axis, angle) = turn.to_axis_angle();

    let root = scene.root();
    scene.add(root, PerspectiveCamera { orientation: AxisAngle::new(axis, angle), ..Default::default() })?;
    scene.add(root, DirectionalLight { direction: DVec3::new(1.0, 0.4, -1.0), ..Default::default() })?;
    scene.add(
        root,
        Material { ambient_color: Color::WHITE.into(), diffuse_color: Color::WHITE.into(), ..Default::default() },
    )?;
    scene.add(root, ColorRamp::default())?;
    scene.add(root, TextureUnit { unit: 0 })?;
    scene.add(root, Texture2 { filename: filename.to_owned(), ..Default::default() })?;
    scene.add(
        root,
        SeamlessTerrain { scale: longer, max_height: step * full, base_height: -step * low, ..Default::default() },
    )?;
    Ok(scene)
}
