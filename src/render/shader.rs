//! Shader text for a set of effects, put together from the modules in `shaders/`.

use wesl::{CompileOptions, Feature, Features, ManglerKind, ModulePath, VirtualResolver, Wesl};

use super::RenderError;
use crate::action::{DebugColor, Effects, GeometryKind};

/// All that shader text depends on.
///
/// Less than [`Effects`]: what has no effect beside others is left out, so that variants that draw the same are the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Variant {
    pub geometry: GeometryKind,
    pub directional: u8,
    pub point: u8,
    pub ambient: bool,
    pub specular: bool,
    pub emissive: bool,
    pub color_map: bool,
    /// Coloured by level. (Colours by part are two plain colours, which need no shader.)
    pub levels: bool,
    pub morph: bool,
    /// Whether the shader has to encode what it writes.
    pub encode_srgb: bool,
}

impl Variant {
    pub(super) fn new(effects: &Effects, format: wgpu::TextureFormat) -> Result<Self, RenderError> {
        let terrain = effects.geometry != GeometryKind::Mesh;
        let plain = effects.debug_color == DebugColor::Plain;
        if !terrain && (effects.color_map || !plain) {
            return Err(RenderError::Effects("colour maps and colours for study are for terrains, not for meshes"));
        }
        if !terrain && effects.morph {
            return Err(RenderError::Effects("heights that blend between levels are for terrains, not for meshes"));
        }
        let lit = effects.lit();
        Ok(Self {
            geometry: effects.geometry,
            directional: effects.directional_lights,
            point: effects.point_lights,
            ambient: lit && effects.ambient,
            specular: lit && effects.specular,
            emissive: lit && effects.emissive,
            color_map: effects.color_map && plain,
            levels: effects.debug_color == DebugColor::Levels,
            morph: effects.morph,
            encode_srgb: !format.is_srgb(),
        })
    }

    pub(super) fn terrain(&self) -> bool {
        self.geometry != GeometryKind::Mesh
    }

    /// Whether heights are integers.
    pub(super) fn integers(&self) -> bool {
        matches!(self.geometry, GeometryKind::TerrainU16 | GeometryKind::LooseU16)
    }

    pub(super) fn lit(&self) -> bool {
        self.directional > 0 || self.point > 0
    }

    /// Whether fragments need to know where they are.
    pub(super) fn position(&self) -> bool {
        self.point > 0 || self.specular
    }

    /// The WGSL.
    pub(super) fn text(&self) -> Result<String, RenderError> {
        let counts = format!("const DIRECTIONAL = {}u;\nconst POINT = {}u;\n", self.directional, self.point);
        let mut modules = VirtualResolver::new();
        let sources = MODULES.iter().copied().chain([("counts", counts.as_str())]);
        for (name, source) in sources {
            modules.add_module(path(name)?, source.into());
        }
        let flags = [
            ("terrain", self.terrain()),
            ("mesh", !self.terrain()),
            ("loose", self.geometry.is_loose()),
            ("u16", self.integers()),
            ("lit", self.lit()),
            ("directional", self.directional > 0),
            ("point", self.point > 0),
            ("ambient", self.ambient),
            ("specular", self.specular),
            ("emissive", self.emissive),
            ("position", self.position()),
            ("color_map", self.color_map),
            ("levels", self.levels),
            ("morph", self.morph),
            ("encode_srgb", self.encode_srgb),
        ];
        let options = CompileOptions {
            features: Features {
                // A flag that is misspelt in a module is an error.
                default: Feature::Error,
                flags: flags.into_iter().map(|(name, on)| (name.to_owned(), on.into())).collect(),
            },
            // The modules' names are distinct, and stay readable.
            ..CompileOptions::default()
        };
        let mut compiler = Wesl::new_barebones().set_custom_resolver(modules);
        compiler.set_options(options);
        compiler.set_mangler(ManglerKind::None);
        let result = compiler.compile(&path("main")?).map_err(|e| RenderError::Shader(e.to_string()))?;
        Ok(result.to_string())
    }
}

const MODULES: [(&str, &str); 9] = [
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
/// [`RenderError::Effects`] when the effects contradict each other.
///
/// # Example
///
/// ```
/// use seamount::action::{DebugColor, Effects, GeometryKind};
/// use seamount::render::shader_text;
///
/// let mut effects = Effects {
///     geometry: GeometryKind::TerrainU16,
///     directional_lights: 1,
///     point_lights: 0,
///     specular: false,
///     color_map: false,
///     debug_color: DebugColor::Plain,
///     ambient: false,
///     emissive: false,
///     morph: false,
/// };
/// let format = wgpu::TextureFormat::Rgba8UnormSrgb;
/// assert!(!shader_text(&effects, format)?.contains("specular"));
/// effects.specular = true;
/// assert!(shader_text(&effects, format)?.contains("specular"));
/// # Ok::<(), seamount::render::RenderError>(())
/// ```
pub fn shader_text(effects: &Effects, format: wgpu::TextureFormat) -> Result<String, RenderError> {
    Variant::new(effects, format)?.text()
}
