//! Shader text for a set of effects, put together from the modules in `shaders/`.

use std::sync::Arc;

use wesl::{CompileOptions, Feature, Features, ManglerKind, ModulePath, VirtualResolver, Wesl};

use super::RenderError;
use crate::action::{
    DebugColor, Draw, EFFECTS, Effects, FragmentUses, GeometryKind, ProgramCode, ShaderUses, VertexUses,
};
use crate::node::{FogType, RampBy, Style};

/// All that shader text depends on: the effects that have a bearing, and the target.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct Variant {
    pub effects: Effects,
    /// Whether the shader has to encode what it writes.
    pub encode_srgb: bool,
    /// Shaders of the scene's own.
    pub program: Option<Arc<ProgramCode>>,
}

impl Variant {
    /// What a draw is drawn with.
    pub(super) fn of(draw: &Draw, format: wgpu::TextureFormat) -> Result<Self, RenderError> {
        Self::new(&draw.effects, draw.program.as_ref().map(|program| &program.code), format)
    }

    fn new(
        effects: &Effects,
        program: Option<&Arc<ProgramCode>>,
        format: wgpu::TextureFormat,
    ) -> Result<Self, RenderError> {
        let e = effects;
        let colors = e.ramp.is_some() || e.contours || e.detail_textures || e.normal_map || e.bump_map || e.shadow;
        if !e.geometry.is_terrain() && (colors || e.debug_color != DebugColor::Plain) {
            return Err(RenderError::Effects(
                "ramps, lines, reliefs, shadows and colours for study are for terrains alone",
            ));
        }
        if e.geometry == GeometryKind::Strokes && e.color_map {
            return Err(RenderError::Effects("lines and points have no textures"));
        }
        if e.geometry.is_terrain() && e.color_map_opacity {
            return Err(RenderError::Effects("nothing shows through the colour map of a terrain"));
        }
        if !e.geometry.is_terrain() && e.morph {
            return Err(RenderError::Effects("heights that blend between levels are for terrains alone"));
        }
        if e.geometry.is_terrain() && e.vertex_colors {
            return Err(RenderError::Effects("the corners of terrains have no colours"));
        }
        // Colours by part are two plain colours, which need no shader of their own.
        let debug_color = match effects.debug_color {
            DebugColor::Parts => DebugColor::Plain,
            other => other,
        };
        // And depth is moved by the rasteriser.
        let effects = Effects { debug_color, polygon_offset: false, ..effects.reduced() };
        // A program whose fragment shader does not count is another one.
        if program.map_or(ShaderUses::default(), |program| program.uses) != effects.shaders {
            return Err(RenderError::Effects("the draw does not have the shaders that its effects ask for"));
        }
        Ok(Self { effects, encode_srgb: encodes(format), program: program.cloned() })
    }

    pub(super) fn terrain(&self) -> bool {
        self.effects.geometry.is_terrain()
    }

    /// Whether heights are floats instead of integers.
    pub(super) fn float_heights(&self) -> bool {
        matches!(self.effects.geometry, GeometryKind::TerrainF32 | GeometryKind::LooseF32)
    }

    /// Whether it is lines or points.
    pub(super) fn strokes(&self) -> bool {
        self.effects.geometry == GeometryKind::Strokes
    }

    /// Whether fragments need to know how far the sides or corners of their triangle are.
    pub(super) fn edges(&self) -> bool {
        matches!(self.effects.style, Style::Lines | Style::FilledLines | Style::Points)
    }

    /// Whether some fragments of a triangle are not drawn.
    pub(super) fn cut(&self) -> bool {
        let e = &self.effects;
        matches!(e.style, Style::Lines | Style::Points) || e.clip_planes > 0 || e.color_map_opacity
    }

    /// Whether vertices are told their place in the patch by a list of indices, one after the other. Loose triangles have
    /// corners of their own anyway.
    pub(super) fn listed_places(&self) -> bool {
        self.edges() && self.terrain() && !self.effects.geometry.is_loose()
    }

    /// Whether vertices are told how far off they are.
    pub(super) fn errors(&self) -> bool {
        self.effects.debug_color == DebugColor::Errors
    }

    /// Whether the vertex stage says the colour.
    pub(super) fn color_by_patch(&self) -> bool {
        matches!(self.effects.debug_color, DebugColor::Levels | DebugColor::Errors)
    }

    /// Whether fragments read the gradients of a map.
    pub(super) fn gradients(&self) -> bool {
        let e = &self.effects;
        let normals = e.lit() || e.debug_color == DebugColor::Normals || self.fragment().normal;
        self.terrain() && (normals || e.ramp == Some(RampBy::Slope))
    }

    /// Whether vertices read them.
    pub(super) fn point_gradients(&self) -> bool {
        self.terrain() && self.vertex().normal
    }

    /// What a vertex shader of the scene's own looks at; nothing if there is none.
    fn vertex(&self) -> VertexUses {
        self.effects.shaders.vertex.unwrap_or_default()
    }

    /// What a fragment shader of the scene's own looks at; nothing if there is none.
    fn fragment(&self) -> FragmentUses {
        self.effects.shaders.fragment.unwrap_or_default()
    }

    /// Whether a mesh or a line has normals at its corners.
    pub(super) fn corner_normals(&self) -> bool {
        !self.terrain() && (self.effects.lit() || self.vertex().normal || self.fragment().normal)
    }

    /// Whether a mesh has texture coordinates at its corners.
    pub(super) fn corner_uvs(&self) -> bool {
        !self.terrain() && self.effects.color_map
    }

    /// Whether shaders of the scene's own ask for heights.
    fn terrain_height(&self) -> bool {
        self.terrain() && (self.vertex().height || self.fragment().height)
    }

    /// Whether shaders have to know about local coordinates.
    pub(super) fn local(&self) -> bool {
        self.local_positions() || self.local_normals() || self.terrain_height()
    }

    fn local_positions(&self) -> bool {
        self.effects.shaders.vertex.is_some() || self.fragment().position
    }

    /// Whether normals of a terrain are made in local coordinates.
    fn local_normals(&self) -> bool {
        self.terrain() && (self.vertex().normal || self.fragment().normal)
    }

    /// Whether fragments need to know where they are.
    pub(super) fn position(&self) -> bool {
        let e = &self.effects;
        e.point_lights > 0 || e.spot_lights > 0 || e.specular || e.fog != FogType::None || e.clip_planes > 0
    }

    /// Our part of the WGSL.
    pub(super) fn own_text(&self) -> Result<String, RenderError> {
        let e = &self.effects;
        let counts = format!(
            "const DIRECTIONAL = {}u;\nconst POINT = {}u;\nconst SPOT = {}u;\nconst CLIP_PLANES = {}u;\n",
            e.directional_lights, e.point_lights, e.spot_lights, e.clip_planes
        );
        let (vertex, fragment) = (self.vertex(), self.fragment());
        let from_lattice = self.terrain() && (fragment.lattice || fragment.uv);
        // What follows from several effects.
        let common = [
            ("terrain", self.terrain()),
            ("mesh", !self.terrain()),
            ("strokes", self.strokes()),
            ("loose", e.geometry.is_loose()),
            ("u16", !self.float_heights()),
            ("lit", e.lit()),
            ("turned_normals", e.two_sided && e.lit()),
            ("air", e.fog != FogType::None),
            ("position", self.position()),
            ("normals", e.lit() || e.debug_color == DebugColor::Normals),
            ("edges", self.edges()),
            ("cut", self.cut()),
            ("gradients", self.gradients()),
            (
                "lattice",
                self.gradients() || self.terrain() && e.color_map || e.detail_textures || e.shadow || from_lattice,
            ),
            ("relative_height", e.ramp == Some(RampBy::Height) || e.contours),
            ("ramp", e.ramp.is_some() || self.errors()),
            ("color_by_patch", self.color_by_patch()),
            ("albedo", e.color_map || e.ramp.is_some() || e.detail_textures),
            ("encode_srgb", self.encode_srgb),
            ("corner_normals", self.corner_normals()),
            ("local", self.local()),
            ("local_positions", self.local_positions()),
            ("local_normals", self.local_normals()),
            ("terrain_height", self.terrain_height()),
            ("any_uv", vertex.uv || fragment.uv),
            ("vertex_normal", vertex.normal),
            ("vertex_lattice", vertex.lattice),
            ("vertex_uv", vertex.uv),
            ("fragment_lit", fragment.lit),
            ("fragment_position", fragment.position),
            ("fragment_normal", fragment.normal),
            ("fragment_lattice", fragment.lattice),
            ("fragment_uv", fragment.uv),
        ];
        let flags = EFFECTS.iter().map(|effect| (effect.name.replace('-', "_"), effect.is_on(e)));
        // What the scene's own shaders call is called by nobody else.
        let offered: &[_] = if self.program.is_some() { &["lit", "terrain_height", "Vertex", "Fragment"] } else { &[] };
        translate("main", offered, &counts, flags.chain(common.map(|(name, on)| (name.to_owned(), on))))
    }
}

/// The WGSL of the sky for targets of this format.
pub(super) fn sky_text(format: wgpu::TextureFormat) -> Result<String, RenderError> {
    translate(
        "sky",
        &[],
        "",
        [("encode_srgb", encodes(format)), ("color_by_normal", false)]
            .into_iter()
            .map(|(name, on)| (name.to_owned(), on)),
    )
}

/// Functions that pipelines start with.
const ENTRY_POINTS: [&str; 3] = ["vertex_main", "fragment_main", "fragment_depth"];

/// Puts a module and what its entry points need together, with what is offered to a text that follows. `counts` is the text of
/// one more module, with numbers.
fn translate(
    main: &str,
    offered: &[&str],
    counts: &str,
    flags: impl Iterator<Item = (String, bool)>,
) -> Result<String, RenderError> {
    let mut modules = VirtualResolver::new();
    for (name, source) in MODULES.into_iter().chain([("counts", counts)]) {
        modules.add_module(path(name)?, source.into());
    }
    let options = CompileOptions {
        features: Features {
            // A flag that is misspelt in a module is an error.
            default: Feature::Error,
            flags: flags.map(|(name, on)| (name, on.into())).collect(),
        },
        keep: Some(ENTRY_POINTS.iter().chain(offered).map(|&name| name.to_owned()).collect()),
        // Functions that the scene's own shaders define are not in the modules; naga looks for them afterwards.
        validate: offered.is_empty(),
        // The modules' names are distinct, and stay readable.
        ..CompileOptions::default()
    };
    let mut compiler = Wesl::new_barebones().set_custom_resolver(modules);
    compiler.set_options(options);
    compiler.set_mangler(ManglerKind::None);
    let mut result = compiler.compile(&path(main)?).map_err(|e| RenderError::Shader(e.to_string()))?;
    // The same text each time: modules come in any order.
    result.syntax.global_declarations.sort_by_cached_key(ToString::to_string);
    Ok(result.to_string())
}

/// Whether shaders encode sRGB for targets of this format: integers without an encoding of their own. Floats are given
/// linear light.
pub(super) fn encodes(format: wgpu::TextureFormat) -> bool {
    use wgpu::TextureFormat::{R16Float, R32Float, Rg11b10Ufloat, Rg16Float, Rg32Float, Rgba16Float, Rgba32Float};
    let floats =
        matches!(format, R16Float | R32Float | Rg16Float | Rg32Float | Rg11b10Ufloat | Rgba16Float | Rgba32Float);
    !format.is_srgb() && !floats
}

const MODULES: [(&str, &str); 20] = [
    ("fog", include_str!("../../shaders/fog.wesl")),
    ("ramp", include_str!("../../shaders/ramp.wesl")),
    ("contours", include_str!("../../shaders/contours.wesl")),
    ("detail_textures", include_str!("../../shaders/detail_textures.wesl")),
    ("normal_map", include_str!("../../shaders/normal_map.wesl")),
    ("bump_map", include_str!("../../shaders/bump_map.wesl")),
    ("shadow", include_str!("../../shaders/shadow.wesl")),
    ("edges", include_str!("../../shaders/edges.wesl")),
    ("clip", include_str!("../../shaders/clip.wesl")),
    ("strokes", include_str!("../../shaders/strokes.wesl")),
    ("sky", include_str!("../../shaders/sky.wesl")),
    ("main", include_str!("../../shaders/main.wesl")),
    ("draw", include_str!("../../shaders/draw.wesl")),
    ("terrain", include_str!("../../shaders/terrain.wesl")),
    ("morph", include_str!("../../shaders/morph.wesl")),
    ("gradients", include_str!("../../shaders/gradients.wesl")),
    ("color_map", include_str!("../../shaders/color_map.wesl")),
    ("levels", include_str!("../../shaders/levels.wesl")),
    ("lighting", include_str!("../../shaders/lighting.wesl")),
    ("srgb", include_str!("../../shaders/srgb.wesl")),
];

fn path(module: &str) -> Result<ModulePath, RenderError> {
    format!("package::{module}").parse().map_err(|e| RenderError::Shader(format!("{module}: {e:?}")))
}

/// The WGSL that draws with these effects into a target of this format, for tests and reports.
///
/// # Errors
///
/// [`RenderError::Effects`] when the effects contradict each other, or have shaders of a scene's own:
/// [`draw_text`](super::draw_text) knows these.
///
/// # Example
///
/// ```
/// use seamount::action::{Effects, GeometryKind};
/// use seamount::render::shader_text;
///
/// let mut effects = Effects { geometry: GeometryKind::TerrainU16, directional_lights: 1, ..Effects::default() };
/// let format = wgpu::TextureFormat::Rgba8UnormSrgb;
/// assert!(!shader_text(&effects, format)?.contains("specular"));
/// effects.specular = true;
/// assert!(shader_text(&effects, format)?.contains("specular"));
/// # Ok::<(), seamount::render::RenderError>(())
/// ```
pub fn shader_text(effects: &Effects, format: wgpu::TextureFormat) -> Result<String, RenderError> {
    Variant::new(effects, None, format)?.own_text()
}
