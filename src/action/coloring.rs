//! Where the colours of surfaces come from: maps, ramps, lines.

use glam::{DAffine2, DAffine3, DMat2, DVec2, DVec3, Vec3};

use super::frame::{Bump, ColorMap, Coloring, ContourStyle, DetailMaps, Geometry, RampMap, Relief, TerrainDraw};
use super::{DrawContext, FragmentUses, ShapeError, inverse};
use crate::node::{LightingModel, RampBy, Role, TextureFilter, Wrap};
use crate::terrain::LatticeLight;

/// Turns (s, t) with t upwards to a place in an image, whose rows run down, and back.
const UPWARDS: DAffine2 = DAffine2 { matrix2: DMat2::from_cols(DVec2::X, DVec2::NEG_Y), translation: DVec2::Y };

/// The rows of a map, as uniforms have them.
fn rows(map: &DAffine2) -> [Vec3; 2] {
    let row = |k: usize| Vec3::new(map.x_axis[k] as f32, map.y_axis[k] as f32, map.translation[k] as f32);
    [row(0), row(1)]
}

impl DrawContext<'_> {
    /// The image on a texture unit as colours, filtered as the Complexity says; `None` if the unit is empty.
    ///
    /// # Errors
    ///
    /// When the image can not be had.
    pub fn color_map(&self, unit: u32) -> Result<Option<ColorMap>, ShapeError> {
        let state = self.shape.state;
        let filter = TextureFilter::of_quality(state.complexity.texture_quality);
        // Edge to edge nothing is beyond the border, and nothing is to mix with it.
        let wrap = match (state.texture_transform(unit), state.texture(unit)) {
            (Some(_), Some(texture)) => texture.wrap,
            _ => [Wrap::Clamp; 2],
        };
        Ok(self.shape.image(unit)?.map(|image| ColorMap { image, filter, wrap }))
    }

    /// What colours a shape beside its material. A fragment shader of the scene's own may not look at it.
    pub(super) fn coloring(
        &self,
        geometry: &Geometry,
        local_from_rel: &DAffine3,
        shader: Option<FragmentUses>,
    ) -> Result<Coloring, ShapeError> {
        match geometry {
            Geometry::Terrain(terrain) => self.terrain_coloring(terrain, local_from_rel, shader),
            Geometry::Mesh(mesh) if !mesh.uvs.is_empty() && shader.is_none_or(|uses| uses.color) => {
                self.mesh_coloring()
            }
            Geometry::Mesh(_) | Geometry::Strokes(_) => Ok(Coloring::default()),
        }
    }

    /// The texture of a mesh. Beyond the border of the image there is what the texture says, since the coordinates go wherever
    /// they were given.
    fn mesh_coloring(&self) -> Result<Coloring, ShapeError> {
        let state = self.shape.state;
        let unit = state.color_unit();
        let wrap = state.texture(unit).map(|texture| texture.wrap).unwrap_or_default();
        let color_map = self.color_map(unit)?.map(|map| ColorMap { wrap, ..map });
        let moved = state.texture_transform(unit).filter(|_| color_map.is_some());
        let color_uv = moved.map(|(transform, _)| rows(&(UPWARDS * transform)));
        Ok(Coloring { color_map, color_uv, ..Coloring::default() })
    }

    fn terrain_coloring(
        &self,
        terrain: &TerrainDraw,
        local_from_rel: &DAffine3,
        shader: Option<FragmentUses>,
    ) -> Result<Coloring, ShapeError> {
        let state = self.shape.state;
        let maps = shader.is_none_or(|uses| uses.color);
        let z_step = local_from_rel.matrix3.z_axis.z;
        let cell = DVec2::new(local_from_rel.matrix3.x_axis.x, local_from_rel.matrix3.y_axis.y);
        // Relative heights are 0 at the anchor.
        let anchor = local_from_rel.translation.z;

        let color_map = if maps { self.color_map(state.program.color_unit)? } else { None };
        let ramp = match state.color_ramp.as_ref().filter(|_| maps) {
            None => None,
            Some(ramp) => {
                let range = match (ramp.range, ramp.by) {
                    (Some(range), _) => range,
                    (None, RampBy::Height) => self.height_range()?,
                    (None, RampBy::Slope) => DVec2::new(0.0, std::f64::consts::FRAC_PI_4),
                };
                // A flat map has the colour in the middle of the ramp.
                let (from, length) = match range.y - range.x {
                    0.0 => (range.x - 0.5, 1.0),
                    length => (range.x, length),
                };
                let (per_value, zero) = match ramp.by {
                    RampBy::Height => (z_step, anchor),
                    RampBy::Slope => (1.0, 0.0),
                };
                Some(RampMap {
                    ramp: ramp.ramp,
                    scale: (per_value / length) as f32,
                    offset: ((zero - from) / length) as f32,
                    slope: (DVec2::splat(z_step) / cell).as_vec2(),
                })
            }
        };
        let contours = state.contour_lines.as_ref().map(|lines| ContourStyle {
            scale: (z_step / lines.interval) as f32,
            // Whole intervals change nothing; what is left is small, and exact.
            offset: (anchor / lines.interval).rem_euclid(1.0) as f32,
            width: lines.width,
            color: lines.color.linear(),
        });
        let detail = match state.detail_textures.as_ref().filter(|_| maps) {
            None => None,
            Some(detail) => {
                let need = |unit: u32, wrap: Wrap, what: &'static str| {
                    let map = self.color_map(unit)?.ok_or(ShapeError::NoTexture { unit, what })?;
                    Ok::<_, ShapeError>(ColorMap { wrap: [wrap; 2], ..map })
                };
                let texture = |k: u32| need(detail.first.saturating_add(k), Wrap::Repeat, "a detail texture");
                Some(Box::new(DetailMaps {
                    mask: need(detail.mask, Wrap::Clamp, "the mask of the detail textures")?,
                    textures: [texture(0)?, texture(1)?, texture(2)?, texture(3)?],
                    tiles: (cell.abs() / detail.size).as_vec2(),
                }))
            }
        };
        let lit = state.light_model.model == LightingModel::Phong && !state.lights.is_empty();
        let lit = lit && shader.is_none_or(|uses| uses.lit);
        let relief = match state.normal_map.as_ref().filter(|_| lit && z_step != 0.0) {
            None => None,
            Some(normals) => {
                let map = self.color_map(normals.unit)?;
                let map = map.ok_or(ShapeError::NoTexture { unit: normals.unit, what: "the normal map" })?;
                Some(Relief {
                    map: ColorMap { wrap: [Wrap::Repeat; 2], ..map },
                    tiles: (cell.abs() / normals.size).as_vec2(),
                    raw_per_slope: (cell / z_step).as_vec2(),
                })
            }
        };
        let bump = match state.bump_map.as_ref().filter(|_| lit && z_step != 0.0) {
            None => None,
            Some(bumps) => {
                let map = self.color_map(bumps.unit)?;
                let map = map.ok_or(ShapeError::NoTexture { unit: bumps.unit, what: "the bump map" })?;
                // Rows of the image and of the map both run south.
                let tiles = cell.abs() / bumps.size;
                let texels = DVec2::new(map.image.width().into(), map.image.height().into());
                Some(Bump {
                    map: ColorMap { wrap: [Wrap::Repeat; 2], ..map },
                    tiles: tiles.as_vec2(),
                    raw_per_texel: (tiles * texels * bumps.height / z_step).as_vec2(),
                })
            }
        };
        let moved = color_map.as_ref().and_then(|_| state.texture_transform(state.program.color_unit));
        let color_uv = moved.map(|(transform, _)| {
            // (column, row) to (s, t), t upwards; moved; and back to rows that run down.
            let cells = terrain.heights.cells().map(f64::from);
            rows(&(UPWARDS * transform * UPWARDS * DAffine2::from_scale(DVec2::from_array(cells).recip())))
        });
        let shadow = state.shadow_light().filter(|_| lit).and_then(|(towards, _)| {
            let towards = inverse(&state.model.matrix3)? * towards / DVec3::new(cell.x, cell.y, z_step);
            // A relief that is next to nothing throws no shadow, and neither does one that is flattened.
            towards.is_finite().then_some(LatticeLight { towards, upwards: z_step > 0.0 })
        });
        Ok(Coloring { color_map, ramp, contours, detail, relief, bump, shadow, color_uv })
    }

    /// The lowest and the highest local z of the shape.
    fn height_range(&self) -> Result<DVec2, ShapeError> {
        let Some(Role::Shape(shape)) = self.shape.path.tail().and_then(|key| self.shape.scene.role(key)) else {
            return Ok(DVec2::Y);
        };
        Ok(shape.bounds(&self.shape)?.map_or(DVec2::Y, |bounds| DVec2::new(bounds.min.z, bounds.max.z)))
    }
}
