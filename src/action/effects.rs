//! The table of effects, and which node asked for which.

use std::cmp::Ordering;
use std::sync::Arc;

use super::frame::{DebugColor, Draw, Effects, Frame, GeometryKind};
use super::render::Render;
use super::walk::{Go, Visitor, walk};
use super::{ActionError, ActionKind, Aspect, Branches, Cameras, LightSource, RenderAction, State, View};
use crate::node::{FogType, RampBy, ShapeNode, Style};
use crate::scene::{Path, Scene};

/// One line of the table of [`EFFECTS`].
///
/// The name with underscores for hyphens is the flag under which the modules in `shaders/` know the effect.
#[derive(Debug, Clone, Copy)]
pub struct EffectInfo {
    /// Name, for reports.
    pub name: &'static str,
    count: fn(&Effects) -> u8,
    askers: fn(&State) -> Vec<Option<u64>>,
}

impl EffectInfo {
    /// How often a draw has the effect: the number of lights of a kind or of planes; 0 or 1 for others.
    #[must_use]
    pub fn count(&self, effects: &Effects) -> u8 {
        (self.count)(effects)
    }

    /// Whether a draw has the effect.
    #[must_use]
    pub fn is_on(&self, effects: &Effects) -> bool {
        self.count(effects) > 0
    }

    /// The name, with the number of lights or planes: `point-light×2`.
    #[must_use]
    pub fn name_in(&self, effects: &Effects) -> String {
        match self.name.ends_with("-light") || self.name.ends_with("-plane") {
            true => format!("{}×{}", self.name, self.count(effects)),
            false => self.name.to_owned(),
        }
    }
}

fn on(flag: bool) -> u8 {
    flag.into()
}

fn by(aspects: &[Aspect], state: &State) -> Vec<Option<u64>> {
    aspects.iter().map(|&aspect| state.credited(aspect)).collect()
}

fn by_lights(state: &State, kind: fn(&LightSource) -> bool) -> Vec<Option<u64>> {
    state.lights.iter().filter(|light| kind(&light.source)).map(|light| Some(light.visit)).collect()
}

fn by_texture(state: &State, unit: u32) -> Vec<Option<u64>> {
    // Without a texture there the shape brings its own image.
    state.texture(unit).map(|texture| Some(texture.visit)).into_iter().collect()
}

/// What the shape itself asks for.
fn by_shape(_: &State) -> Vec<Option<u64>> {
    Vec::new()
}

macro_rules! effects {
    ($($name:literal, $count:expr, $askers:expr;)*) => {
        &[$(EffectInfo { name: $name, count: $count, askers: $askers }),*]
    };
}

/// All effects: name, how [`Effects`] says that a draw has it, and what of the State asked for it.
#[rustfmt::skip]
pub const EFFECTS: &[EffectInfo] = effects! {
    "directional-light", |e| e.directional_lights, |s| by_lights(s, |l| matches!(l, LightSource::Directional { .. }));
    "point-light",       |e| e.point_lights,       |s| by_lights(s, |l| matches!(l, LightSource::Point { .. }));
    "spot-light",        |e| e.spot_lights,        |s| by_lights(s, |l| matches!(l, LightSource::Spot { .. }));
    "attenuation",       |e| on(e.attenuation),    |s| by_lights(s, LightSource::attenuates);
    "ambient",           |e| on(e.ambient),        |s| by(&[Aspect::Environment, Aspect::Material], s);
    "specular",          |e| on(e.specular),       |s| by(&[Aspect::Material], s);
    "emissive",          |e| on(e.emissive),       |s| by(&[Aspect::Material], s);
    "transparency",      |e| on(e.transparency),   |s| by(&[Aspect::Material], s);
    "haze",              |e| on(e.fog == FogType::Haze),  |s| by(&[Aspect::Environment], s);
    "fog",               |e| on(e.fog == FogType::Fog),   |s| by(&[Aspect::Environment], s);
    "smoke",             |e| on(e.fog == FogType::Smoke), |s| by(&[Aspect::Environment], s);
    "color-map",         |e| on(e.color_map),      |s| by_texture(s, s.color_unit());
    "color-map-opacity", |e| on(e.color_map_opacity), |s| by_texture(s, s.color_unit());
    "color-map-transform", |e| on(e.color_map_transform),
                                                   |s| vec![s.texture_transform(s.color_unit()).map(|t| t.1)];
    "height-ramp",       |e| on(e.ramp == Some(RampBy::Height)), |s| by(&[Aspect::ColorRamp], s);
    "slope-ramp",        |e| on(e.ramp == Some(RampBy::Slope)),  |s| by(&[Aspect::ColorRamp], s);
    "contours",          |e| on(e.contours),       |s| by(&[Aspect::ContourLines], s);
    "detail-textures",   |e| on(e.detail_textures), |s| by(&[Aspect::DetailTextures], s);
    "normal-map",        |e| on(e.normal_map),     |s| by(&[Aspect::NormalMap], s);
    "bump-map",          |e| on(e.bump_map),       |s| by(&[Aspect::BumpMap], s);
    "shadow",            |e| on(e.shadow),         |s| vec![s.shadow_light().map(|(_, light)| light.visit)];
    "clip-plane",        |e| e.clip_planes,        |s| s.clip_planes.iter().map(|plane| Some(plane.visit)).collect();
    "polygon-offset",    |e| on(e.polygon_offset), |s| by(&[Aspect::PolygonOffset], s);
    "two-sided",         |e| on(e.two_sided),      |s| by(&[Aspect::ShapeHints], s);
    "vertex-shader",     |e| on(e.shaders.vertex.is_some()),   |s| vec![s.program.own.map(|(_, visit)| visit)];
    "fragment-shader",   |e| on(e.shaders.fragment.is_some()), |s| vec![s.program.own.map(|(_, visit)| visit)];
    "morph",             |e| on(e.morph),          by_shape;
    "color-by-part",     |e| on(e.debug_color == DebugColor::Parts), by_shape;
    "color-by-level",    |e| on(e.debug_color == DebugColor::Levels), by_shape;
    "color-by-normal",   |e| on(e.debug_color == DebugColor::Normals), by_shape;
    "color-by-error",    |e| on(e.debug_color == DebugColor::Errors), by_shape;
    "color-by-vertex",   |e| on(e.vertex_colors),  |s| by(&[Aspect::MaterialBinding, Aspect::Material], s);
    "lines",             |e| on(e.style == Style::Lines),       |s| by(&[Aspect::DrawStyle], s);
    "points",            |e| on(e.style == Style::Points),      |s| by(&[Aspect::DrawStyle], s);
    "lines-on-faces",    |e| on(e.style == Style::FilledLines), |s| by(&[Aspect::DrawStyle], s);
};

/// What may be behind all draws, by name: a colour, which costs nothing, or a sky.
pub const BACKGROUNDS: [&str; 2] = ["background", "sky"];

/// The names of all effects: those of draws, then what may be behind them.
///
/// ```
/// assert!(seamount::action::effect_names().any(|name| name == "specular"));
/// ```
pub fn effect_names() -> impl Iterator<Item = &'static str> {
    EFFECTS.iter().map(|effect| effect.name).chain(BACKGROUNDS)
}

/// An effect's name and the paths of the nodes that asked for it, from the root as in [`ActionError`]: the shape itself if no
/// other did, nothing if it is there by default, like ambient light.
pub type Asked = (String, Vec<Vec<String>>);

/// A frame, and who asked for what in it.
#[derive(Debug, Clone)]
pub struct Explained {
    /// The frame.
    pub frame: Frame,
    /// What is behind the draws, one of [`BACKGROUNDS`], if the scene says so.
    pub background: Option<Asked>,
    /// The effects of each draw, in the order of the frame.
    pub draws: Vec<DrawEffects>,
}

/// What one draw of a scene costs by its effects, and which nodes asked for them.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawEffects {
    /// The shape, from the root, as in [`ActionError`].
    pub path: Vec<String>,
    /// Its effects.
    pub effects: Effects,
    /// The kind of shape.
    pub geometry: GeometryKind,
    /// Who asked for each of them.
    pub asked: Vec<Asked>,
}

impl RenderAction {
    /// The frame, and which nodes asked for the effects of each of its draws and for what is behind them.
    ///
    /// # Errors
    ///
    /// As for [`RenderAction::apply`].
    ///
    /// # Example
    ///
    /// ```
    /// use seamount::prelude::*;
    ///
    /// let mut scene = Scene::new();
    /// let root = scene.root();
    /// scene.add(root, PerspectiveCamera::default())?;
    /// scene.add(root, DirectionalLight::default())?;
    /// scene.add(root, Cube::default())?;
    /// let explained = RenderAction::new(640, 480).explain(&scene)?;
    /// assert_eq!(explained.frame.draws.len(), explained.draws.len());
    /// assert_eq!(explained.background, None);
    /// assert_eq!(explained.draws[0].path, ["Separator", "Cube[2]"]);
    /// let (effect, asked_by) = &explained.draws[0].asked[0];
    /// assert_eq!((effect.as_str(), asked_by[0].join("/").as_str()), ("directional-light×1", "Separator/DirectionalLight[1]"));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn explain(&self, scene: &Scene) -> Result<Explained, ActionError> {
        let cameras = Cameras::new(scene, self.size);
        let viewpoint = cameras.viewpoint(self.camera.as_deref())?;
        let mut view = View::default();
        view.begin();
        let render = Render::new(self, scene, viewpoint, &cameras, &mut view);
        let mut explain = Explain { render, scene, paths: Vec::new(), background: None, found: Vec::new() };
        walk(scene, Branches::Seen(Some(&viewpoint)), &mut explain)?;
        // As the draws are sorted at the end.
        let background = explain.background;
        let mut found: Vec<_> = explain.found.into_iter().zip(view.frame.draws.iter().map(Draw::order)).collect();
        found.sort_by(|(_, a), (_, b)| a.partial_cmp(b).unwrap_or(Ordering::Equal));
        let draws = found.into_iter().map(|(effects, _)| effects).collect();
        view.end(self, scene);
        Ok(Explained { frame: view.frame, background, draws })
    }
}

/// Draws, and keeps where each occurrence of a node was met.
struct Explain<'s> {
    render: Render<'s>,
    scene: &'s Scene,
    /// By [`PropertyContext::visit`](super::PropertyContext::visit), less one.
    paths: Vec<Path>,
    background: Option<Asked>,
    found: Vec<DrawEffects>,
}

impl Visitor for Explain<'_> {
    fn action(&self) -> ActionKind {
        ActionKind::Render
    }

    fn enter(&mut self, path: &Path, _: &Arc<State>) -> Result<Go, ActionError> {
        self.paths.push(path.clone());
        Ok(Go::On)
    }

    fn leave(&mut self, path: &Path, state: &Arc<State>) -> Result<Go, ActionError> {
        let go = self.render.leave(path, state)?;
        if self.background.is_none()
            && let Some(background) = self.render.background()
        {
            // The node that is left has set it.
            let [plain, sky] = BACKGROUNDS;
            let name = if background.zenith.is_some() { sky } else { plain };
            self.background = Some((name.to_owned(), vec![path.names(self.scene)]));
        }
        Ok(go)
    }

    fn shape(&mut self, shape: &dyn ShapeNode, path: &Path, state: &Arc<State>) -> Result<Go, ActionError> {
        let before = self.render.draws().len();
        let go = self.render.shape(shape, path, state)?;
        let names = |visit: u64| Some(self.paths.get(usize::try_from(visit).ok()?.checked_sub(1)?)?.names(self.scene));
        for draw in self.render.draws().iter().skip(before) {
            let effects = draw.effects;
            let used = EFFECTS.iter().filter(|effect| effect.is_on(&effects));
            let asked = used.map(|effect| {
                let askers = (effect.askers)(state);
                let by = match askers.as_slice() {
                    [] => vec![path.names(self.scene)],
                    askers => askers.iter().flatten().filter_map(|&visit| names(visit)).collect(),
                };
                (effect.name_in(&effects), by)
            });
            let asked = asked.collect();
            self.found.push(DrawEffects { path: path.names(self.scene), effects, geometry: effects.geometry, asked });
        }
        Ok(go)
    }
}
