//! What a walk knows at a point of the graph: the sum of the properties before it.

use std::any::{Any, TypeId};
use std::ops::{Deref, DerefMut};
use std::path::PathBuf;
use std::sync::{Arc, LazyLock};

use glam::{DAffine2, DAffine3, DMat3, DVec2, DVec3, Vec3};

use super::memo::Memo;
use super::{ActionError, ActionKind, Attenuation, Cameras, Cone, PlacedCamera, ShapeError, Surface, Viewpoint};
use crate::node::{
    Background, Binding, BumpMap, ColorRamp, Complexity, ContourLines, DetailTextures, DrawStyle, Environment,
    LightModel, List, Material, NormalMap, PickStyleKind, PolygonOffset, ShaderSource, ShapeHints, Wrap, active_stage,
};
use crate::scene::{Image, NodeKey, Path, Scene};

/// The properties in force at a point of a walk.
///
/// Transforms come at nearly every shape and change where it is alone. All else is shared until it changes, and is read and written as
/// if it stood here: `state.material` is that of [`State::properties`].
#[derive(Debug, Clone)]
pub struct State {
    /// From local to world coordinates.
    pub model: DAffine3,
    /// The choice that a Switch inherits: that of the Switch before, or the number of the copy.
    pub switch: i32,
    /// Length of the unit that follows, in those of the world.
    pub unit_length: f64,
    /// All that does not say where things are.
    pub properties: Arc<Properties>,
}

impl Deref for State {
    type Target = Properties;

    fn deref(&self) -> &Properties {
        &self.properties
    }
}

impl DerefMut for State {
    fn deref_mut(&mut self) -> &mut Properties {
        Arc::make_mut(&mut self.properties)
    }
}

/// What the properties before a point of a walk have set, beside places.
#[derive(Debug, Clone)]
pub struct Properties {
    /// The material. No list of it is empty, unless somebody else than the nodes of this crate made it.
    pub material: Arc<Material>,
    /// Diffuse colours with their opacity as `0xRRGGBBAA`, instead of those of the material; empty for those.
    pub packed_colors: List<u32>,
    /// What the colours belong to.
    pub material_binding: Binding,
    /// Lights in world coordinates, in the order of the walk.
    pub lights: Arc<Vec<PlacedLight>>,
    /// Detail and texture quality.
    pub complexity: Complexity,
    /// The current texture unit.
    pub unit: u32,
    /// Textures by unit.
    pub textures: Arc<Vec<TextureBinding>>,
    /// Which unit carries what.
    pub program: Program,
    /// The camera met last.
    pub camera: Option<Arc<PlacedCamera>>,
    /// Points that sets of faces, lines and points refer to, in the coordinates of whoever uses them.
    pub coordinates: List<DVec3>,
    /// Normals for them; empty: worked out from the faces.
    pub normals: List<DVec3>,
    /// What the normals belong to.
    pub normal_binding: Binding,
    /// Texture coordinates for them; empty: worked out from the box.
    pub texture_coordinates: List<DVec2>,
    /// What is known of the faces.
    pub shape_hints: ShapeHints,
    /// How shapes are picked.
    pub pick_style: PickStyleKind,
    /// How faces are moved away in depth, if they are.
    pub polygon_offset: Option<PolygonOffset>,
    /// What cuts shapes off.
    pub clip_planes: Arc<Vec<PlacedPlane>>,
    /// What properties defined elsewhere have set; see [`State::set`].
    pub extensions: Extensions,
    /// Air and light from the surroundings.
    pub environment: Environment,
    /// Whether light is looked at.
    pub light_model: LightModel,
    /// Normals that roughen the light.
    pub normal_map: Option<Arc<NormalMap>>,
    /// Small heights that roughen the light.
    pub bump_map: Option<Arc<BumpMap>>,
    /// The font of text; the default one if none.
    pub font: Option<Arc<FontBinding>>,
    /// How faces are drawn.
    pub draw_style: DrawStyle,
    /// Colours by height or slope.
    pub color_ramp: Option<Arc<ColorRamp>>,
    /// Lines of equal height.
    pub contour_lines: Option<Arc<ContourLines>>,
    /// Four textures and their mask.
    pub detail_textures: Option<Arc<DetailTextures>>,
    /// What takes texture coordinates to those that are looked up, by unit, with the visit of the node; see
    /// [`PropertyContext::visit`].
    pub texture_transforms: Arc<Vec<(u32, DAffine2, u64)>>,
    /// What is behind everything.
    pub background: Option<Arc<Background>>,
    /// Which node set what.
    pub credits: Credits,
}

/// Values of types that this crate does not know, one of each.
#[derive(Debug, Clone, Default)]
pub struct Extensions(Arc<Vec<Extension>>);

type Extension = (TypeId, Arc<dyn Any + Send + Sync>);

/// Those at the start of every walk: they are made once.
static PROPERTIES: LazyLock<Arc<Properties>> = LazyLock::new(Arc::default);

impl Default for State {
    fn default() -> Self {
        Self { model: DAffine3::IDENTITY, switch: -1, unit_length: 1.0, properties: Arc::clone(&PROPERTIES) }
    }
}

impl Default for Properties {
    fn default() -> Self {
        Self {
            material: Arc::default(),
            packed_colors: List::default(),
            material_binding: Binding::Overall,
            lights: Arc::default(),
            complexity: Complexity::default(),
            unit: 0,
            textures: Arc::default(),
            program: Program::default(),
            camera: None,
            coordinates: List::default(),
            normals: List::default(),
            normal_binding: Binding::default(),
            texture_coordinates: List::default(),
            shape_hints: ShapeHints::default(),
            pick_style: PickStyleKind::default(),
            polygon_offset: None,
            clip_planes: Arc::default(),
            extensions: Extensions::default(),
            environment: Environment::default(),
            light_model: LightModel::default(),
            normal_map: None,
            bump_map: None,
            font: None,
            draw_style: DrawStyle::default(),
            color_ramp: None,
            contour_lines: None,
            detail_textures: None,
            texture_transforms: Arc::default(),
            background: None,
            credits: Credits::default(),
        }
    }
}

impl State {
    /// Local coordinates become those that `map` takes to the present ones.
    pub fn transform(&mut self, map: &DAffine3) {
        self.model = compose(&self.model, map);
    }

    /// [`State::transform`] by a translation.
    pub fn translate(&mut self, by: DVec3) {
        self.model.translation += self.model.matrix3 * by;
    }

    /// Sets a value of a type of your own, instead of the one that was in force: what a property defined elsewhere changes.
    pub fn set<T: Any + Send + Sync>(&mut self, value: T) {
        let extensions = Arc::make_mut(&mut self.extensions.0);
        extensions.retain(|(id, _)| *id != TypeId::of::<T>());
        extensions.push((TypeId::of::<T>(), Arc::new(value)));
    }

    /// The value of a type of your own that is in force.
    ///
    /// ```
    /// use seamount::action::State;
    ///
    /// #[derive(Debug, PartialEq)]
    /// struct Density(f64);
    ///
    /// let mut state = State::default();
    /// assert_eq!(state.get::<Density>(), None);
    /// state.set(Density(1000.0));
    /// assert_eq!(state.get(), Some(&Density(1000.0)));
    /// ```
    #[must_use]
    pub fn get<T: Any + Send + Sync>(&self) -> Option<&T> {
        let (_, value) = self.extensions.0.iter().find(|(id, _)| *id == TypeId::of::<T>())?;
        value.downcast_ref()
    }

    pub(crate) fn set_texture(&mut self, source: Option<TextureSource>, wrap: [Wrap; 2], cx: &PropertyContext<'_>) {
        let unit = self.unit;
        let textures = Arc::make_mut(&mut self.textures);
        textures.retain(|t| t.unit != unit);
        if let Some(source) = source {
            textures.push(TextureBinding { unit, source, wrap, node: cx.key, visit: cx.visit });
        }
    }

    /// Replaces the transform of texture coordinates on the current unit.
    pub(crate) fn set_texture_transform(&mut self, transform: DAffine2, cx: &PropertyContext<'_>) {
        let unit = self.unit;
        let transforms = Arc::make_mut(&mut self.texture_transforms);
        transforms.retain(|(known, ..)| *known != unit);
        if transform != DAffine2::IDENTITY {
            transforms.push((unit, transform, cx.visit));
        }
    }

    /// The transform of texture coordinates on a unit and the visit of its node, if it changes anything.
    #[must_use]
    pub fn texture_transform(&self, unit: u32) -> Option<(DAffine2, u64)> {
        let mut found = self.texture_transforms.iter();
        found.find(|(known, ..)| *known == unit).map(|&(_, transform, visit)| (transform, visit))
    }

    /// Notes that a property has set an aspect of the state.
    pub fn credit(&mut self, aspect: Aspect, cx: &PropertyContext<'_>) {
        if let Some(slot) = self.credits.0.get_mut(aspect as usize) {
            *slot = u32::try_from(cx.visit).unwrap_or(0);
        }
    }

    /// The node that set an aspect last; `None` if it has its default. See [`PropertyContext::visit`].
    #[must_use]
    pub fn credited(&self, aspect: Aspect) -> Option<u64> {
        self.credits.0.get(aspect as usize).filter(|&&visit| visit > 0).map(|&visit| visit.into())
    }

    /// The light that terrains throw a shadow of on themselves: the first one that asks for that. With the way towards it.
    #[must_use]
    pub fn shadow_light(&self) -> Option<(DVec3, &PlacedLight)> {
        self.lights.iter().find_map(|light| match light.source {
            LightSource::Directional { towards, shadow: true } => Some((towards, light)),
            _ => None,
        })
    }

    /// The unit of the texture that meshes show: that of the program's colours if there is a texture on it, or else unit 0, the
    /// one of scenes that name none.
    ///
    /// ```
    /// use seamount::action::State;
    ///
    /// let mut state = State::default();
    /// assert_eq!((state.color_unit(), state.texture(0).is_some()), (0, false));
    /// ```
    #[must_use]
    pub fn color_unit(&self) -> u32 {
        let unit = self.program.color_unit;
        if self.texture(unit).is_some() { unit } else { 0 }
    }

    /// The texture on a unit.
    #[must_use]
    pub fn texture(&self, unit: u32) -> Option<&TextureBinding> {
        self.textures.iter().find(|t| t.unit == unit)
    }
}

/// `outer · inner` in f64.
#[must_use]
pub(crate) fn compose(outer: &DAffine3, inner: &DAffine3) -> DAffine3 {
    DAffine3 {
        matrix3: outer.matrix3 * inner.matrix3,
        translation: outer.matrix3 * inner.translation + outer.translation,
    }
}

/// The inverse transpose of a linear map up to a positive factor, with entries of about 1: takes normals where `m` takes
/// points. Made from cross products, so it exists (as the limit) for singular maps too.
#[must_use]
pub(crate) fn normal_matrix(m: &DMat3) -> DMat3 {
    cofactors(m) * if m.determinant() < 0.0 { -1.0 } else { 1.0 }
}

/// The inverse of a linear map; `None` if it flattens space, as far as rounding can tell.
///
/// A scale of zero between rotations has a determinant of rounding, not of zero: the entries are off by a few ε times the
/// largest, and so is the determinant of a map with columns of unit length; 32 ε leaves room. Columns of very unequal length
/// flatten nothing.
#[must_use]
pub(crate) fn inverse(m: &DMat3) -> Option<DMat3> {
    let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis].map(|axis| axis / axis.length());
    let volume = x.dot(y.cross(z));
    let inverse = m.inverse();
    (volume.abs() > 16.0 * f64::EPSILON && inverse.is_finite()).then_some(inverse)
}

/// The cofactors of a linear map, determinant · inverse transpose, up to a positive factor, with entries of about 1.
#[must_use]
pub(crate) fn cofactors(m: &DMat3) -> DMat3 {
    // Their columns are the cross products of the map's columns.
    let largest = |m: &DMat3| m.x_axis.abs().max(m.y_axis.abs()).max(m.z_axis.abs()).max_element();
    let scale = largest(m);
    let scale = if scale > 0.0 && scale.is_finite() { scale } else { 1.0 };
    let (x, y, z) = (m.x_axis / scale, m.y_axis / scale, m.z_axis / scale);
    let found = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    let scale = largest(&found);
    if scale > 0.0 { found * (1.0 / scale) } else { found }
}

/// A light in world coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlacedLight {
    /// Colour in linear light times intensity.
    pub color: Vec3,
    /// Where it comes from.
    pub source: LightSource,
    /// The node that it is; see [`PropertyContext::visit`].
    pub visit: u64,
}

/// Where light comes from, in world coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LightSource {
    /// Parallel light.
    Directional {
        /// Unit vector towards the light.
        towards: DVec3,
        /// Whether terrains throw a shadow of it on themselves.
        shadow: bool,
    },
    /// Light from a point.
    Point {
        /// Where it stands.
        position: DVec3,
        /// How it weakens with distance.
        attenuation: Attenuation,
    },
    /// Light from a point into a cone.
    Spot {
        /// Where it stands.
        position: DVec3,
        /// How it weakens with distance.
        attenuation: Attenuation,
        /// Unit vector along the axis, away from the light.
        direction: DVec3,
        /// Its shape.
        cone: Cone,
    },
}

/// A plane in world coordinates: what lies behind it, against the normal, is cut off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlacedPlane {
    /// The normal, towards what stays.
    pub normal: DVec3,
    /// A point of the plane.
    pub point: DVec3,
    /// The node that it is; see [`PropertyContext::visit`].
    pub visit: u64,
}

impl LightSource {
    /// Whether its light changes with distance.
    #[must_use]
    pub fn attenuates(&self) -> bool {
        match self {
            LightSource::Directional { .. } => false,
            LightSource::Point { attenuation, .. } | LightSource::Spot { attenuation, .. } => {
                *attenuation != Attenuation::NONE
            }
        }
    }
}

/// What of the State an effect may come from; for reports of which node asked for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(usize)]
pub enum Aspect {
    /// Colours and transparency.
    Material,
    /// Air and light from the surroundings.
    Environment,
    /// Whether light is looked at.
    LightModel,
    /// Colours by height or slope.
    ColorRamp,
    /// Lines of equal height.
    ContourLines,
    /// Four textures and their mask.
    DetailTextures,
    /// How faces are drawn.
    DrawStyle,
    /// Normals that roughen the light.
    NormalMap,
    /// Small heights that roughen the light.
    BumpMap,
    /// Which sides of faces are seen.
    ShapeHints,
    /// What colours belong to.
    MaterialBinding,
    /// How faces are moved away in depth.
    PolygonOffset,
}

impl Aspect {
    const COUNT: usize = Aspect::PolygonOffset as usize + 1;
}

/// The last node that set each [`Aspect`]: the visit, 0 for none. A walk has fewer than 2³² visits
/// ([`MAX_VISITS`](super::walk::MAX_VISITS)); small, since it is copied at every separator.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Credits([u32; Aspect::COUNT]);

/// Which texture unit carries what, and whether the scene has shaders of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Program {
    /// The unit with heights.
    pub height_unit: u32,
    /// The unit with colours.
    pub color_unit: u32,
    /// The [`ShaderProgram`](crate::node::ShaderProgram) whose shaders have texts of their own, and its visit; see
    /// [`PropertyContext::visit`].
    pub own: Option<(NodeKey, u64)>,
}

impl Default for Program {
    fn default() -> Self {
        Self { height_unit: 0, color_unit: 1, own: None }
    }
}

impl Program {
    /// The node of the program that an error is about: the stage whose text can not be had, or the program.
    fn culprit(&self, error: &ShapeError, scene: &Scene) -> Option<NodeKey> {
        let (program, _) = self.own?;
        match error {
            ShapeError::Text(error) => scene.children(program).iter().copied().find(|&stage| {
                let source = active_stage(scene, stage).map(|(_, source)| source);
                matches!(source, Some(ShaderSource::File(name)) if scene.resolve(stage, name) == error.path())
            }),
            ShapeError::ParameterTwice { .. } | ShapeError::NoParameter { .. } => Some(program),
            _ => None,
        }
    }
}

/// Where the image of a texture comes from.
#[derive(Debug, Clone)]
pub enum TextureSource {
    /// A file, decoded when it is needed.
    File(PathBuf),
    /// An image in memory.
    Memory(Arc<Image>),
}

/// A texture on a unit.
#[derive(Debug, Clone)]
pub struct TextureBinding {
    /// The unit.
    pub unit: u32,
    /// Its image.
    pub source: TextureSource,
    /// What is beyond its border, from left to right and from bottom to top.
    pub wrap: [Wrap; 2],
    /// The node that put it there.
    pub node: NodeKey,
    /// The occurrence of that node; see [`PropertyContext::visit`].
    pub visit: u64,
}

/// A font for text.
#[derive(Debug, Clone, PartialEq)]
pub struct FontBinding {
    /// Its file; `None` for the one that is always there.
    pub file: Option<PathBuf>,
    /// The em in pixels.
    pub size: f64,
    /// The node that chose it.
    pub node: NodeKey,
}

/// What a property knows of its place.
#[derive(Debug, Clone, Copy)]
pub struct PropertyContext<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The property's own node.
    pub key: NodeKey,
    /// The way to it.
    pub path: &'a Path,
    /// The action that walks.
    pub action: ActionKind,
    /// Number of the occurrence: how many nodes the walk has entered, this one included. Tells occurrences of a shared node
    /// apart.
    pub visit: u64,
}

/// Which children are walked of a group that chooses among them.
#[derive(Debug, Clone, Copy)]
pub enum Branches<'a> {
    /// All, those that a Switch hides as well.
    All,
    /// Those that a Switch shows, and each level of detail as if it were the only one: a box holds whatever may be seen.
    Possible,
    /// Those that a Switch shows, and of levels of detail the one seen from here; without a camera the finest.
    Seen(Option<&'a Viewpoint>),
}

/// What a group knows of its place.
#[derive(Debug, Clone, Copy)]
pub struct GroupContext<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The group's own node.
    pub key: NodeKey,
    /// The way to the group.
    pub path: &'a Path,
    /// The State before the group, for groups that restore any of it.
    pub entry: Option<&'a Arc<State>>,
    /// What [`State::switch`] was before the group: children may change it.
    pub switch: i32,
    /// Which children are walked.
    pub branches: Branches<'a>,
}

impl GroupContext<'_> {
    /// Number of children.
    #[must_use]
    pub fn children(&self) -> usize {
        self.scene.children(self.key).len()
    }
}

/// What a shape knows of its place.
#[derive(Debug, Clone, Copy)]
pub struct ShapeContext<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The properties in force.
    pub state: &'a State,
    /// The way to the shape.
    pub path: &'a Path,
    /// The camera that detail is chosen for; without one it is the finest.
    pub viewpoint: Option<&'a Viewpoint>,
    /// Which surface of a terrain a ray is to meet; other questions do not look at it.
    pub surface: Surface,
    /// The other cameras of the scene, for shapes that ask for one by name.
    pub cameras: Option<&'a Cameras<'a>>,
    /// What the shape kept when it was drawn, where that decides: in a view that is frozen.
    pub kept: Option<&'a (dyn Any + Send + Sync)>,
    /// What shapes worked out for the rays before this one.
    pub(crate) memo: Option<&'a Memo>,
}

impl<'a> ShapeContext<'a> {
    /// A place in the scene, seen by no camera.
    #[must_use]
    pub fn new(scene: &'a Scene, state: &'a State, path: &'a Path) -> Self {
        Self { scene, state, path, viewpoint: None, surface: Surface::default(), cameras: None, kept: None, memo: None }
    }

    /// The image on a texture unit, decoded if need be; `None` if the unit is empty.
    ///
    /// # Errors
    ///
    /// When the image can not be had.
    pub fn image(&self, unit: u32) -> Result<Option<Arc<Image>>, ShapeError> {
        match self.state.texture(unit).map(|t| &t.source) {
            None => Ok(None),
            Some(TextureSource::Memory(image)) => Ok(Some(Arc::clone(image))),
            Some(TextureSource::File(path)) => Ok(Some(self.scene.resources().image(path)?)),
        }
    }

    /// What `make` makes, or what it made for this shape and an earlier ray.
    pub(crate) fn remember<T: Send + Sync + 'static>(
        &self,
        make: impl FnOnce() -> Result<T, ShapeError>,
    ) -> Result<Arc<T>, ShapeError> {
        match self.memo {
            Some(memo) => memo.remember(self.path, make),
            None => Ok(Arc::new(make()?)),
        }
    }

    /// A shape's error with its place, as actions return it. Errors of an image point at the texture node that asked for it.
    #[must_use]
    pub fn error(&self, error: ShapeError) -> ActionError {
        let unit = self.state.program.height_unit;
        let culprit = match &error {
            ShapeError::Image(image) => self
                .state
                .textures
                .iter()
                .find(|t| matches!((&t.source, image.path()), (TextureSource::File(f), Some(p)) if f == p)),
            ShapeError::HeightField(_) => self.state.texture(unit),
            _ => None,
        };
        let culprit = culprit.map(|texture| texture.node).or_else(|| self.state.program.culprit(&error, self.scene));
        let font = self.state.font.as_ref().filter(|_| matches!(error, ShapeError::Font(_))).map(|font| font.node);
        let culprit = culprit.or(font);
        ActionError::shape(error, self.scene, self.path, culprit)
    }
}
