//! From a scene and a camera to a [`Frame`]: everything about a picture but the pixels.

use std::any::Any;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DMat4, DVec2, DVec3, Mat3, Vec2, Vec3};

use super::frame::{
    ColorMap, Coloring, DepthOffset, Draw, Effects, Fog, Frame, FrameLight, Geometry, GeometryKind, LineStyle, Mesh,
    Sky, Statistics, Strokes, SurfaceMaterial, relative,
};
use super::program::{DrawProgram, Programs, ShaderUses};
use super::state::{cofactors, compose};
use super::view::Kept;
use super::walk::{Go, Visitor, walk};
use super::{
    ActionError, ActionKind, Branches, Cameras, DebugColor, Lens, LightSource, PlacedCamera, PlacedLight, ShapeContext,
    ShapeError, State, View, Viewpoint,
};
use crate::node::{
    Background, Binding, Color, FogType, LightingModel, List, ShapeNode, Style, TextureFilter, Triangle, Wrap,
};
use crate::scene::{Image, Path, Scene};
use crate::terrain::Frustum;

/// Makes the [`Frame`] of a picture. Uses no GPU.
///
/// # Example
///
/// ```
/// use seamount::prelude::*;
///
/// let mut scene = Scene::new();
/// let root = scene.root();
/// scene.add(root, PerspectiveCamera::default())?;
/// scene.add(root, Cube::default())?;
/// let frame = RenderAction::new(640, 480).apply(&scene)?;
/// assert_eq!((frame.draws.len(), frame.statistics.triangles), (1, 12));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct RenderAction {
    /// Width and height of the picture in pixels, each at least 1.
    pub size: [u32; 2],
    /// Name of the camera; the first one if not given.
    pub camera: Option<String>,
    /// Colour where nothing is drawn, if the scene has no `Background`.
    pub background: Color,
}

impl RenderAction {
    /// A picture of this size through the first camera, black where nothing is.
    #[must_use]
    pub fn new(width: u32, height: u32) -> Self {
        Self { size: [width, height], camera: None, background: Color::BLACK }
    }

    /// The view that the picture is taken from.
    ///
    /// # Errors
    ///
    /// When there is no such camera, it can not be used, or a shape that near and far depend on can not be had.
    pub fn viewpoint(&self, scene: &Scene) -> Result<Viewpoint, ActionError> {
        Cameras::new(scene, self.size).viewpoint(self.camera.as_deref())
    }

    /// The frame, made from nothing. For one picture after the other see [`RenderAction::apply_in`].
    ///
    /// # Errors
    ///
    /// As for [`RenderAction::viewpoint`], and when a shape can not be had.
    pub fn apply(&self, scene: &Scene) -> Result<Frame, ActionError> {
        let mut view = View::default();
        self.apply_in(scene, &mut view)?;
        Ok(view.frame)
    }

    /// The frame, with what the view remembers of the last one: the same frame again without any work if neither the scene
    /// nor this action has changed since, otherwise a new one in the memory of the old ones. Clone it to keep it or to send it
    /// to another thread; a clone shares what is large.
    ///
    /// # Errors
    ///
    /// As for [`RenderAction::apply`].
    pub fn apply_in<'v>(&self, scene: &Scene, view: &'v mut View) -> Result<&'v Frame, ActionError> {
        if !view.is_current(self, scene) {
            let cameras = Cameras::new(scene, self.size);
            let (camera, viewpoint) = cameras.camera(self.camera.as_deref())?;
            view.begin();
            view.frame.crop = camera.crop(self.size);
            let branches = Branches::Seen(Some(&viewpoint));
            walk(scene, branches, &mut Render::new(self, scene, viewpoint, &cameras, view))?;
            view.end(self, scene);
        }
        Ok(&view.frame)
    }
}

impl Draw {
    fn is_finite(&self) -> bool {
        self.clip_from_rel.is_finite() && self.eye_from_rel.is_finite() && self.normal_from_rel.is_finite()
    }

    /// Draw calls that it takes: what is transparent is drawn twice, first into depth alone.
    #[must_use]
    pub fn calls(&self) -> u32 {
        let once = match &self.geometry {
            Geometry::Terrain(terrain) if self.effects.geometry.is_loose() => {
                // Coloured by part, tiles and strips are two calls.
                let ranges = terrain.instances.loose_ranges().into_iter().filter(|range| !range.is_empty());
                let most = if self.effects.debug_color == DebugColor::Parts { 2 } else { 1 };
                ranges.count().min(most) as u32
            }
            Geometry::Terrain(terrain) => terrain.instances.ranges().len() as u32,
            Geometry::Mesh(_) | Geometry::Strokes(_) => 1,
        };
        once * (1 + u32::from(self.effects.transparency))
    }

    /// Where it comes among the draws of a frame, the smallest first.
    pub(super) fn order(&self) -> (bool, f64) {
        (self.effects.transparency, -self.distance)
    }

    /// Triangles that it draws.
    #[must_use]
    pub fn triangles(&self) -> u64 {
        match &self.geometry {
            Geometry::Terrain(terrain) if self.effects.geometry.is_loose() => {
                terrain.instances.loose().len() as u64 / 3
            }
            Geometry::Terrain(terrain) => terrain.instances.triangles(),
            Geometry::Mesh(mesh) => mesh.triangles.len() as u64,
            // Two each.
            Geometry::Strokes(strokes) => 2 * strokes.pieces.len() as u64,
        }
    }
}

/// The first camera, or the one with this name.
pub(super) fn find_camera(scene: &Scene, name: Option<&str>) -> Result<Arc<PlacedCamera>, ActionError> {
    struct Find<'s> {
        scene: &'s Scene,
        name: Option<&'s str>,
        found: Option<Arc<PlacedCamera>>,
        seen: Vec<String>,
        /// Held, so that no other camera gets its address.
        last: Option<Arc<PlacedCamera>>,
    }
    impl Find<'_> {
        fn look(&mut self, state: &State) {
            let Some(camera) = &state.camera else { return };
            if self.last.as_ref().is_some_and(|last| Arc::ptr_eq(last, camera)) || self.found.is_some() {
                return;
            }
            self.last = Some(Arc::clone(camera));
            let name = self.scene.name(camera.key);
            self.seen.extend(name.map(str::to_owned));
            if self.name.is_none() || self.name == name {
                self.found = Some(Arc::clone(camera));
            }
        }
    }
    impl Visitor for Find<'_> {
        fn action(&self) -> ActionKind {
            ActionKind::Search
        }
        fn enter(&mut self, _: &Path, state: &Arc<State>) -> Result<Go, ActionError> {
            self.look(state);
            Ok(if self.found.is_some() { Go::End } else { Go::On })
        }
        fn leave(&mut self, _: &Path, state: &Arc<State>) -> Result<Go, ActionError> {
            self.look(state);
            Ok(if self.found.is_some() { Go::End } else { Go::On })
        }
    }
    let mut find = Find { scene, name, found: None, seen: Vec::new(), last: None };
    walk(scene, Branches::Possible, &mut find)?;
    find.found.ok_or_else(|| match name {
        None => ActionError::NoCamera,
        Some(name) => ActionError::UnknownCamera {
            name: name.to_owned(),
            known: if find.seen.is_empty() {
                "no camera of this scene has a name: give it one with Def(\"name\", …)".to_owned()
            } else {
                format!("the cameras' names are {}", find.seen.join(", "))
            },
        },
    })
}

/// The sky as a camera sees it. Parallel rays all see the same place.
fn place_sky(background: &Background, view: &Viewpoint) -> Option<Sky> {
    let zenith = background.zenith?;
    let across = match view.lens {
        Lens::Perspective { tan_half_height: t } => [view.right * (t * view.aspect), view.up * t],
        Lens::Orthographic { .. } => [DVec3::ZERO; 2],
    };
    let middle = view.forward + across[0] * view.center.x + across[1] * view.center.y;
    let rays = [middle, across[0], across[1]].map(DVec3::as_vec3);
    Some(Sky { horizon: background.color.linear(), zenith: zenith.linear(), rays })
}

/// Gathers the draws of a scene in a View.
pub(super) struct Render<'s> {
    scene: &'s Scene,
    viewpoint: Viewpoint,
    cameras: &'s Cameras<'s>,
    size: [u32; 2],
    view: &'s mut View,
    background: Option<Arc<Background>>,
    programs: Programs,
}

impl<'s> Render<'s> {
    pub(super) fn new(
        action: &RenderAction,
        scene: &'s Scene,
        viewpoint: Viewpoint,
        cameras: &'s Cameras<'s>,
        view: &'s mut View,
    ) -> Self {
        view.frame.background = action.background.linear();
        view.frame.sky = None;
        Self { scene, viewpoint, cameras, size: action.size, view, background: None, programs: Programs::default() }
    }

    /// What is behind everything, if a node said so before.
    pub(super) fn background(&self) -> Option<&Background> {
        self.background.as_deref()
    }

    /// What was gathered so far.
    pub(super) fn draws(&self) -> &[Draw] {
        &self.view.frame.draws
    }
}

impl Visitor for Render<'_> {
    fn action(&self) -> ActionKind {
        ActionKind::Render
    }

    fn acted(&mut self) {
        self.view.acted();
    }

    /// The first background is the one, as with cameras.
    fn leave(&mut self, _: &Path, state: &Arc<State>) -> Result<Go, ActionError> {
        if let (Some(background), None) = (&state.background, &self.background) {
            let frame = &mut self.view.frame;
            frame.background = background.color.linear();
            frame.sky = place_sky(background, &self.viewpoint);
            self.background = Some(Arc::clone(background));
        }
        Ok(Go::On)
    }

    fn shape(&mut self, shape: &dyn ShapeNode, path: &Path, state: &Arc<State>) -> Result<Go, ActionError> {
        // A camera acts on what follows it.
        if state.camera.is_some() {
            let shape_cx = ShapeContext {
                viewpoint: Some(&self.viewpoint),
                cameras: Some(self.cameras),
                ..ShapeContext::new(self.scene, state, path)
            };
            let kept = self.view.take(path);
            let first = self.view.frame.draws.len();
            let mut cx = DrawContext {
                shape: shape_cx,
                view: &self.viewpoint,
                size: self.size,
                freeze: self.view.freeze,
                kept,
                programs: &mut self.programs,
                draws: &mut self.view.frame.draws,
                statistics: &mut self.view.frame.statistics,
            };
            let drawn = shape.draw(&mut cx);
            let kept = cx.kept;
            self.view.keep(kept);
            drawn.map_err(|e| shape_cx.error(e))?;
            let drawn = self.view.frame.draws.get_mut(first..).unwrap_or_default();
            if drawn.iter().any(|draw| draw.effects.transparency) {
                // Of text the place, which is as deep as what is seen of it.
                let placed = ShapeContext { viewpoint: None, ..shape_cx };
                let middle = shape.bounds(&placed).map_err(|e| shape_cx.error(e))?;
                let middle = middle.map_or(DVec3::ZERO, |aabb| (aabb.min + aabb.max) * 0.5);
                let to_middle = state.model.transform_point3(middle) - self.viewpoint.eye;
                drawn.iter_mut().for_each(|draw| draw.distance = to_middle.dot(self.viewpoint.forward));
            }
            // In f64 there is room for more than a GPU can be told.
            if !self.view.frame.draws.iter().skip(first).all(Draw::is_finite) {
                return Err(shape_cx.error(ShapeError::BeyondFloats));
            }
        }
        Ok(Go::On)
    }
}

/// What a shape is given to draw itself.
#[derive(Debug)]
pub struct DrawContext<'a> {
    /// Scene, state and path.
    pub shape: ShapeContext<'a>,
    /// The camera.
    pub view: &'a Viewpoint,
    /// Width and height of the picture in pixels.
    pub size: [u32; 2],
    /// Whether detail that was chosen before is to be kept; see [`View::freeze`].
    pub freeze: bool,
    kept: Option<Kept>,
    pub(super) programs: &'a mut Programs,
    draws: &'a mut Vec<Draw>,
    /// Counts to add to.
    pub statistics: &'a mut Statistics,
}

impl DrawContext<'_> {
    /// From local coordinates (of the shape) to world axes with the origin at the eye.
    #[must_use]
    pub fn eye_from_local(&self) -> DAffine3 {
        let model = self.shape.state.model;
        DAffine3 { matrix3: model.matrix3, translation: model.translation - self.view.eye }
    }

    /// Draws with another State in force.
    pub(crate) fn with_state<R>(&mut self, state: &State, draw: impl FnOnce(&mut DrawContext<'_>) -> R) -> R {
        let mut cx = DrawContext {
            shape: ShapeContext { state, ..self.shape },
            view: self.view,
            size: self.size,
            freeze: self.freeze,
            kept: self.kept.take(),
            programs: self.programs,
            draws: self.draws,
            statistics: self.statistics,
        };
        let made = draw(&mut cx);
        self.kept = cx.kept;
        made
    }

    /// What is in view, in local coordinates.
    #[must_use]
    pub fn local_frustum(&self) -> Frustum {
        self.view.frustum().pulled_back(&self.eye_from_local())
    }

    /// What this occurrence of the shape kept in the last frame, or the default. Give it to [`DrawContext::keep`] when done.
    #[must_use]
    pub fn take_kept<T: Any + Default + Send + Sync>(&mut self) -> Box<T> {
        let kept: Option<Box<dyn Any>> = self.kept.take().map(|kept| kept as Box<dyn Any>);
        kept.and_then(|kept| kept.downcast().ok()).unwrap_or_default()
    }

    /// Keeps a value for the next frame of the same [`View`], instead of any that was kept before.
    pub fn keep<T: Any + Send + Sync>(&mut self, value: Box<T>) {
        self.kept = Some(value);
    }

    /// Adds a draw. `local_from_rel` takes the coordinates that the geometry is given in to local ones; its products with
    /// model and view are made in f64 and rounded once. The anchor's translation should be small against the eye's
    /// distance; see [`TerrainDraw::anchor`](super::TerrainDraw::anchor).
    ///
    /// # Errors
    ///
    /// When an image that the State asks for can not be had.
    pub fn draw(
        &mut self,
        geometry: Geometry,
        local_from_rel: &DAffine3,
        options: DrawOptions,
    ) -> Result<(), ShapeError> {
        self.draw_placed(geometry, local_from_rel, options, None)
    }

    /// Draws an image flat on the picture, unlit, at the depth of the shape's origin: its alpha is how much of each pixel the shape
    /// covers. `clip_from_rel` takes the mesh to clip space.
    pub(crate) fn draw_on_picture(
        &mut self,
        mesh: Arc<Mesh>,
        image: Arc<Image>,
        clip_from_rel: &DMat4,
    ) -> Result<(), ShapeError> {
        // What is not said in the picture is said of the origin.
        let origin = DAffine3 { matrix3: DMat3::ZERO, translation: DVec3::ZERO };
        let options = DrawOptions { lit: false, ..DrawOptions::plain(GeometryKind::Mesh) };
        let filter = TextureFilter::of_quality(0.0);
        let cover = Cover { map: ColorMap { image, filter, wrap: [Wrap::Clamp; 2] }, clip_from_rel: *clip_from_rel };
        self.draw_placed(Geometry::Mesh(mesh), &origin, options, Some(cover))
    }

    fn draw_placed(
        &mut self,
        geometry: Geometry,
        local_from_rel: &DAffine3,
        options: DrawOptions,
        cover: Option<Cover>,
    ) -> Result<(), ShapeError> {
        let state = self.shape.state;
        let plain = options.debug_color == DebugColor::Plain;
        let style = &state.draw_style;
        let colored = match &geometry {
            Geometry::Mesh(mesh) => !mesh.colors.is_empty(),
            Geometry::Strokes(strokes) => !strokes.colors.is_empty(),
            Geometry::Terrain(_) => false,
        };
        let colors = state.colors();
        let first = colors.first();
        let invisible = if colored { colors.invisible() } else { first.w <= 0.0 };
        if invisible && plain || style.style == Style::Invisible {
            return Ok(());
        }
        let program = self.program(plain)?;
        let shaders = program.as_ref().map_or(ShaderUses::default(), |program| program.code.uses);
        let coloring = match &cover {
            Some(cover) => Coloring { color_map: Some(cover.map.clone()), ..Coloring::default() },
            None if plain => self.coloring(&geometry, local_from_rel, shaders.fragment)?,
            None => Coloring::default(),
        };
        // A terrain has no holes but its own.
        let texture = coloring.color_map.as_ref().filter(|_| matches!(geometry, Geometry::Mesh(_)));
        let pierced = texture.is_some_and(|map| !map.image.is_opaque());
        let eye_from_rel = compose(&self.eye_from_local(), local_from_rel);
        let unlit = state.light_model.model == LightingModel::BaseColor || !options.lit;
        let lights: Arc<[FrameLight]> = if unlit {
            Arc::default()
        } else {
            let shadow = state.shadow_light().filter(|_| coloring.shadow.is_some()).map(|(_, light)| light);
            let place = |light| place_light(light, self.view.eye, shadow.is_some_and(|s| std::ptr::eq(s, light)));
            state.lights.iter().map(place).collect()
        };
        let count = |f: fn(&FrameLight) -> bool| lights.iter().filter(|l| f(l)).count().min(255) as u8;
        let linear = |colors: &List<Color>| colors.first().map_or(Vec3::ZERO, |color| color.linear());
        let m = &state.material;
        let material = SurfaceMaterial {
            ambient: linear(&m.ambient_color),
            diffuse: first.truncate(),
            specular: linear(&m.specular_color),
            emissive: linear(&m.emissive_color),
            shininess: m.shininess.first().copied().unwrap_or_default(),
            opacity: first.w,
        };
        let ambient = state.environment.ambient();
        let faces = !matches!(geometry, Geometry::Strokes(_)) && cover.is_none();
        let offset = state.polygon_offset.as_ref().filter(|offset| faces && offset.moves(style.style));
        let eye = self.view.eye;
        let effects = Effects {
            geometry: options.kind,
            directional_lights: count(|l| matches!(l, FrameLight::Directional { .. })),
            point_lights: count(|l| matches!(l, FrameLight::Point { .. })),
            spot_lights: count(|l| matches!(l, FrameLight::Spot { .. })),
            attenuation: state.lights.iter().any(|light| light.source.attenuates()),
            fog: state.environment.fog_type,
            transparency: pierced || if colored { colors.see_through() } else { first.w < 1.0 },
            specular: material.specular != Vec3::ZERO,
            color_map: coloring.color_map.is_some(),
            color_map_opacity: pierced,
            debug_color: options.debug_color,
            style: if cover.is_some() { Style::Filled } else { style.style },
            color_map_transform: coloring.color_uv.is_some(),
            ramp: state.color_ramp.as_ref().filter(|_| coloring.ramp.is_some()).map(|ramp| ramp.by),
            normal_map: coloring.relief.is_some(),
            bump_map: coloring.bump.is_some(),
            shadow: coloring.shadow.is_some(),
            contours: coloring.contours.is_some(),
            detail_textures: coloring.detail.is_some(),
            ambient: material.ambient * ambient != Vec3::ZERO,
            emissive: material.emissive != Vec3::ZERO,
            vertex_colors: colored,
            morph: options.morph,
            clip_planes: state.clip_planes.len().min(255) as u8,
            shaders,
            polygon_offset: offset.is_some(),
            two_sided: faces && state.shape_hints.both_sides(options.two_sided || !state.clip_planes.is_empty()),
        }
        .reduced();
        // A mesh has an outside, which no map turns in. A terrain has an upper side, which local z points from: its
        // triangles are counter-clockwise seen from there, whether heights run up, down or not at all; in (u, v, w) they
        // look clockwise, since rows run south.
        let (mirrored, outwards) = match &geometry {
            Geometry::Mesh(_) | Geometry::Strokes(_) => {
                let mirrored = eye_from_rel.matrix3.determinant() < 0.0;
                (mirrored, !mirrored)
            }
            Geometry::Terrain(_) => {
                let mirrored = state.model.matrix3.determinant() < 0.0;
                (mirrored, mirrored)
            }
        };
        let normals = cofactors(&eye_from_rel.matrix3) * if outwards { 1.0 } else { -1.0 };
        let dots = match &geometry {
            Geometry::Strokes(strokes) => strokes.dots,
            Geometry::Mesh(_) | Geometry::Terrain(_) => style.style == Style::Points,
        };
        let clip_from_rel = match &cover {
            Some(cover) => cover.clip_from_rel,
            None => self.view.clip_from_eye() * DMat4::from(eye_from_rel),
        };
        let towards_eye = match self.view.lens {
            Lens::Perspective { .. } => None,
            Lens::Orthographic { .. } => Some((-self.view.forward).as_vec3()),
        };
        let program = match program {
            None => None,
            Some(program) => Some(Arc::new(DrawProgram {
                textures: self.program_textures(&program)?,
                values: program.values(),
                local_from_rel: DMat4::from(*local_from_rel).as_mat4(),
                clip_from_local: (self.view.clip_from_eye() * DMat4::from_mat3(state.model.matrix3)).as_mat4(),
                eye_from_local: state.model.matrix3.as_mat3(),
                code: Arc::clone(&program.code),
            })),
        };
        self.draws.push(Draw {
            effects,
            program,
            geometry,
            clip_from_rel: clip_from_rel.as_mat4(),
            eye_from_rel: DMat4::from(eye_from_rel).as_mat4(),
            normal_from_rel: Mat3::from_cols_array(&normals.to_cols_array().map(|x| x as f32)),
            mirrored,
            material,
            lights,
            ambient,
            towards_eye,
            fog: if effects.fog == FogType::None { Fog::default() } else { self.fog() },
            coloring,
            clip_planes: state
                .clip_planes
                .iter()
                .map(|plane| plane.normal.extend(plane.normal.dot(eye - plane.point)).as_vec4())
                .collect(),
            depth_offset: offset.map_or(DepthOffset::default(), |offset| DepthOffset {
                factor: offset.factor,
                units: offset.units.round() as i32,
            }),
            picture: Vec2::from_array(self.size.map(|side| side as f32)),
            lines: LineStyle {
                color: style.line_color.linear(),
                width: if dots { style.point_size } else { style.line_width },
            },
            distance: 0.0,
        });
        Ok(())
    }

    /// The fog of the air.
    fn fog(&self) -> Fog {
        let air = &self.shape.state.environment;
        let far = || self.shape.cameras.map_or(0.0, |cameras| cameras.furthest(self.view));
        let visibility = if air.fog_visibility > 0.0 { air.fog_visibility } else { far() };
        // 1/256 is left at the end.
        let exponent = 256f64.ln();
        let at_end = match air.fog_type {
            FogType::None => 0.0,
            FogType::Haze => 1.0,
            FogType::Fog => exponent,
            FogType::Smoke => exponent.sqrt(),
        };
        let rate = if visibility > 0.0 { at_end / visibility } else { 0.0 };
        Fog { color: air.fog_color.linear(), rate: rate as f32 }
    }

    /// Draws lines or points, as wide as the State says.
    ///
    /// # Errors
    ///
    /// As for [`DrawContext::draw`].
    pub fn draw_strokes(&mut self, strokes: Arc<Strokes>, local_from_rel: &DAffine3) -> Result<(), ShapeError> {
        let options = DrawOptions { lit: strokes.lit, ..DrawOptions::plain(GeometryKind::Strokes) };
        self.draw(Geometry::Strokes(strokes), local_from_rel, options)
    }

    /// Draws triangles as a mesh: what a shape does that knows nothing better.
    ///
    /// # Errors
    ///
    /// What `primitives` returns.
    pub fn draw_primitives(
        &mut self,
        primitives: impl FnOnce(&ShapeContext<'_>, &mut dyn FnMut(Triangle)) -> Result<(), ShapeError>,
    ) -> Result<(), ShapeError> {
        self.draw_faces(false, primitives)
    }

    /// [`DrawContext::draw_primitives`] of a shape that is open, so that its inside is seen where the State does not say
    /// otherwise; or closed.
    pub(crate) fn draw_faces(
        &mut self,
        open: bool,
        primitives: impl FnOnce(&ShapeContext<'_>, &mut dyn FnMut(Triangle)) -> Result<(), ShapeError>,
    ) -> Result<(), ShapeError> {
        let mut triangles: Vec<Triangle> = Vec::new();
        primitives(&self.shape, &mut |t| triangles.push(t))?;
        let Some(first) = triangles.first() else {
            return Ok(());
        };
        let data = self.corner_data();
        // A shape that gives no texture coordinates shows no texture.
        let mapped = data.uvs && triangles.iter().any(|t| t.uvs != [DVec2::ZERO; 3]);
        // Relative to a corner, so that a mesh with large local coordinates keeps its digits.
        let anchor = first.points[0];
        let mut mesh = Mesh::default();
        for (index, t) in triangles.iter().enumerate() {
            let start = mesh.positions.len() as u32;
            mesh.positions.extend(t.points.map(|p| relative(p, anchor)));
            mesh.normals.extend(t.normals.map(DVec3::as_vec3));
            if mapped {
                mesh.uvs.extend(t.uvs.map(DVec2::as_vec2));
            }
            if let Some(colors) = &data.colors {
                for number in t.materials {
                    mesh.colors.push(colors.of(number, Binding::Overall, ("triangle", index))?);
                }
            }
            mesh.triangles.push([start, start + 1, start + 2]);
        }
        let options = DrawOptions { two_sided: open, ..DrawOptions::plain(GeometryKind::Mesh) };
        self.draw(Geometry::Mesh(Arc::new(mesh)), &DAffine3::from_translation(anchor), options)
    }
}

/// What covers pixels of the picture, instead of a surface in space.
struct Cover {
    map: ColorMap,
    clip_from_rel: DMat4,
}

/// What decides the effects of a draw beside the State.
#[derive(Debug, Clone, Copy)]
pub struct DrawOptions {
    /// Which vertex stage.
    pub kind: GeometryKind,
    /// Colours for study.
    pub debug_color: DebugColor,
    /// Whether light is looked at.
    pub lit: bool,
    /// Whether heights blend between levels, by the weights of the instances.
    pub morph: bool,
    /// Whether faces are seen from behind as well, where the State does not say.
    pub two_sided: bool,
}

impl DrawOptions {
    /// Nothing beside the State.
    #[must_use]
    pub const fn plain(kind: GeometryKind) -> Self {
        Self { kind, debug_color: DebugColor::Plain, lit: true, morph: false, two_sided: false }
    }
}

fn place_light(light: &PlacedLight, eye: DVec3, shadow: bool) -> FrameLight {
    let color = light.color;
    match light.source {
        LightSource::Directional { towards, .. } => {
            FrameLight::Directional { towards: towards.as_vec3(), color, shadow }
        }
        LightSource::Point { position, attenuation } => {
            FrameLight::Point { position: relative(position, eye), color, attenuation }
        }
        LightSource::Spot { position, attenuation, direction, cone } => FrameLight::Spot {
            position: relative(position, eye),
            color,
            attenuation,
            direction: direction.as_vec3(),
            cone,
        },
    }
}
