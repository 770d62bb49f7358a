//! Section 3: what each effect costs.

use std::collections::BTreeMap;
use std::sync::{Arc, LazyLock};

use glam::{DVec3, Mat3, Mat4, Vec2, Vec3, Vec4};

use super::bench::{gpu_figure, median, ms};
use super::report::{EffectFigures, EffectRow, EffectTimes, EffectsCost};
use super::{CostError, Options, Plan, Run};
use crate::action::{
    Attenuation, BACKGROUNDS, Bump, ColorMap, Coloring, Cone, ContourStyle, DebugColor, DepthOffset, DetailMaps, Draw,
    DrawProgram, Effects, Fog, FragmentUses, Frame, FrameLight, Geometry, LineStyle, ProgramCode, RampMap, Relief,
    ShaderOrigin, ShaderText, ShaderUses, Sky, VertexUses,
};
use crate::node::{DetailMode, FogType, Ramp, RampBy, Style, TextureFilter, Wrap};
use crate::render::Headless;
use crate::scene::{Image, Pixels};
use crate::terrain::LatticeLight;

/// An effect by its name, as what it changes in a frame that has none.
type Effect = (&'static str, fn(&mut Frame));

/// The effects that a frame can have. A new one is a line here.
#[rustfmt::skip]
const EFFECTS: [Effect; 38] = [
    ("none", |_| {}),
    ("one directional light", |f| each(f, directional)),
    ("one directional light, ambient light", |f| lit(f, ambient)),
    ("one directional light, highlights", |f| lit(f, specular)),
    ("one directional light, glow", |f| lit(f, emissive)),
    ("one directional light, shadow", |f| lit(f, shadow)),
    ("one directional light, normal map", |f| lit(f, normal_map)),
    ("one directional light, bump map", |f| lit(f, bump_map)),
    ("one point light", |f| each(f, |draw| point(draw, Attenuation::NONE))),
    ("one point light, weaker with distance", |f| each(f, weakening)),
    ("one spot light", |f| each(f, spot)),
    ("haze", |f| each(f, |draw| air(draw, FogType::Haze))),
    ("fog", |f| each(f, |draw| air(draw, FogType::Fog))),
    ("smoke", |f| each(f, |draw| air(draw, FogType::Smoke))),
    ("transparency", |f| each(f, transparency)),
    ("colour map", |f| each(f, |draw| draw.effects.color_map = has_map(draw))),
    ("colour map, moved", |f| each(f, moved_map)),
    ("texture that lets through what is behind", |f| each(f, see_through_map)),
    ("height ramp", |f| each(f, |draw| ramp(draw, RampBy::Height))),
    ("slope ramp", |f| each(f, |draw| ramp(draw, RampBy::Slope))),
    ("contour lines", |f| each(f, contours)),
    ("detail textures", |f| each(f, detail_textures)),
    ("colours of corners", |f| each(f, corner_colors)),
    ("clip plane", |f| each(f, clip_plane)),
    ("both sides", |f| each(f, |draw| draw.effects.two_sided = is_face(draw))),
    ("offset of depth", |f| each(f, depth_offset)),
    ("lines", |f| each(f, |draw| style(draw, Style::Lines))),
    ("points", |f| each(f, |draw| style(draw, Style::Points))),
    ("lines on faces", |f| each(f, |draw| style(draw, Style::FilledLines))),
    ("vertex shader", |f| each(f, vertex_shader)),
    ("fragment shader", |f| each(f, fragment_shader)),
    ("colours by part", |f| each(f, |draw| study(draw, DebugColor::Parts))),
    ("colours by level", |f| each(f, |draw| study(draw, DebugColor::Levels))),
    ("colours by normal", |f| each(f, |draw| study(draw, DebugColor::Normals))),
    ("colours by error", |f| each(f, |draw| study(draw, DebugColor::Errors))),
    ("background", |f| f.background = Vec3::splat(0.5)),
    ("sky", sky),
    ("all that go together", |f| {
        sky(f);
        let effects: &[fn(&mut Draw)] = &[
            directional, |draw| point(draw, Attenuation::NONE), weakening, spot, ambient, specular, emissive, shadow, normal_map,
            bump_map, |draw| air(draw, FogType::Fog), transparency, moved_map, |draw| ramp(draw, RampBy::Height), contours,
            detail_textures, corner_colors, clip_plane, |draw| draw.effects.two_sided = is_face(draw), depth_offset,
            |draw| style(draw, Style::FilledLines),
        ];
        effects.iter().for_each(|&effect| each(f, effect));
    }),
];

/// The effect that is part of the choice of detail and no change of a frame.
const MORPH: &str = "heights that blend between levels";

pub(super) const STEPS: usize = EFFECTS.len() + 1;

pub(super) fn measure(run: &mut Run<'_>, plan: &Plan, options: &Options) -> Result<(), CostError> {
    let tolerance_px = plan.effects_tolerance;
    run.report.effects = Some(EffectsCost { tolerance_px, rows: Vec::new() });
    if let Some(eye) = run.bench.main.eyes(run.bench.size).into_iter().find(|eye| eye.name == "corner") {
        run.bench.look(&eye, 0);
    }
    run.bench.set_detail(DetailMode::PixelError(tolerance_px));
    let mut morphs = Vec::new();
    run.bench.edit_terrains(|node| morphs.push(std::mem::replace(&mut node.morph, false)));
    let base = bare(run.bench.frame()?.clone());
    run.bench.edit_terrains(|node| node.morph = true);
    let morphing = bare(run.bench.frame()?.clone());
    let mut morphs = morphs.into_iter();
    run.bench.edit_terrains(|node| node.morph = morphs.next().unwrap_or_default());

    for (name, effect) in EFFECTS {
        run.begin(&format!("effects: {name}"));
        let mut frame = base.clone();
        effect(&mut frame);
        // What no shape of the scene can have, such as colours of corners on terrains, has no row.
        if name == "none" || names(&frame) != names(&base) {
            let row = row(name, &frame, plan, options)?;
            run.report.effects.get_or_insert_default().rows.push(row);
        }
    }
    run.begin(&format!("effects: {MORPH}"));
    let row = row(MORPH, &morphing, plan, options)?;
    run.report.effects.get_or_insert_default().rows.push(row);
    run.finished()
}

/// What a frame takes by itself.
fn row(name: &str, frame: &Frame, plan: &Plan, options: &Options) -> Result<EffectRow, CostError> {
    // A device that has seen nothing else: what it holds is what this takes.
    let mut headless = Headless::new(options.adapter.as_deref())?;
    headless.draw(frame)?;
    let costs = headless.costs(frame)?.into_iter().chain(headless.sky_cost(frame)?);
    // Draws that share a variant share its shader.
    let shaders: BTreeMap<usize, u64> = costs.map(|cost| (cost.variant, cost.shader_bytes)).collect();
    let mut gpus = Vec::new();
    let mut report = None;
    for _ in 0..plan.repeats {
        let drawn = headless.draw(frame)?.report;
        gpus.push(drawn.gpu.map(ms));
        report.get_or_insert(drawn);
    }
    let report = report.unwrap_or_default();
    Ok(EffectRow {
        name: name.to_owned(),
        effects: frame.draws.first().map(|draw| draw.effects.names()).unwrap_or_default(),
        figures: EffectFigures {
            shader_bytes: shaders.values().sum(),
            device_bytes: report.gpu_bytes,
            bytes_per_frame: report.bytes_uploaded,
        },
        times: EffectTimes { gpu_ms: gpu_figure(&gpus, median) },
    })
}

/// The effects of a frame: those of its draws, and what is behind them.
fn names(frame: &Frame) -> Vec<String> {
    let [background, sky] = BACKGROUNDS;
    let behind = match frame.sky {
        Some(_) => Some(sky),
        None => (frame.background != Vec3::ZERO).then_some(background),
    };
    frame.draws.iter().flat_map(|draw| draw.effects.names()).chain(behind.map(str::to_owned)).collect()
}

fn each(frame: &mut Frame, effect: fn(&mut Draw)) {
    frame.draws.iter_mut().for_each(effect);
}

/// An effect that there is nothing to see of without a light.
fn lit(frame: &mut Frame, effect: fn(&mut Draw)) {
    each(frame, directional);
    each(frame, effect);
}

/// Takes all effects away but the blending of heights.
fn bare(mut frame: Frame) -> Frame {
    (frame.sky, frame.background) = (None, Vec3::ZERO);
    for draw in &mut frame.draws {
        let Effects { geometry, morph, .. } = draw.effects;
        draw.effects = Effects { geometry, morph, ..Effects::default() };
        // The image itself stays, for the rows that ask for it.
        draw.coloring = Coloring { color_map: draw.coloring.color_map.take(), ..Coloring::default() };
        draw.lights = Arc::default();
        draw.ambient = Vec3::ZERO;
        draw.clip_planes = Arc::default();
        draw.depth_offset = DepthOffset::default();
        draw.program = None;
    }
    frame
}

fn light(draw: &mut Draw, light: FrameLight) {
    draw.lights = draw.lights.iter().copied().chain([light]).collect();
}

fn directional(draw: &mut Draw) {
    draw.effects.directional_lights += 1;
    light(
        draw,
        FrameLight::Directional { towards: Vec3::new(0.48, 0.6, 0.64), color: Vec3::splat(0.8), shadow: false },
    );
}

fn shadow(draw: &mut Draw) {
    if let Geometry::Terrain(_) = draw.geometry {
        draw.effects.shadow = true;
        // From the west. What a shadow costs does not depend on how long it is.
        draw.coloring.shadow = Some(LatticeLight { towards: DVec3::new(-1.0, 0.5, 1.0), upwards: true });
        if let Some(FrameLight::Directional { shadow, .. }) = Arc::make_mut(&mut draw.lights).first_mut() {
            *shadow = true;
        }
    }
}

fn point(draw: &mut Draw, attenuation: Attenuation) {
    draw.effects.point_lights += 1;
    // At the eye.
    light(draw, FrameLight::Point { position: Vec3::ZERO, color: Vec3::splat(0.4), attenuation });
}

fn spot(draw: &mut Draw) {
    draw.effects.spot_lights += 1;
    let cone = Cone { cos_cut_off: 0.7, exponent: 1.0 };
    // At the eye, downwards.
    let (position, direction) = (Vec3::ZERO, Vec3::NEG_Z);
    let attenuation = Attenuation::NONE;
    light(draw, FrameLight::Spot { position, color: Vec3::splat(0.4), attenuation, direction, cone });
}

fn weakening(draw: &mut Draw) {
    draw.effects.attenuation = true;
    point(draw, Attenuation { quadratic: 1e-9, ..Attenuation::NONE });
}

fn air(draw: &mut Draw, fog: FogType) {
    draw.effects.fog = fog;
    // What a fog costs does not depend on how thick it is.
    draw.fog = Fog { color: Vec3::splat(0.7), rate: 1e-4 };
}

fn transparency(draw: &mut Draw) {
    draw.effects.transparency = true;
    draw.material.opacity = 0.5;
}

fn ramp(draw: &mut Draw, by: RampBy) {
    if is_terrain(draw) {
        draw.effects.ramp = Some(by);
        draw.coloring.ramp = Some(RampMap { ramp: Ramp::Gray, scale: 1e-3, offset: 0.5, slope: Vec2::ONE });
    }
}

fn contours(draw: &mut Draw) {
    if is_terrain(draw) {
        draw.effects.contours = true;
        draw.coloring.contours = Some(ContourStyle { scale: 1e-2, offset: 0.0, width: 1.0, color: Vec3::ZERO });
    }
}

fn style(draw: &mut Draw, style: Style) {
    if is_face(draw) {
        draw.effects.style = style;
        draw.lines = LineStyle { color: Vec3::ZERO, width: 1.0 };
    }
}

fn ambient(draw: &mut Draw) {
    draw.effects.ambient = true;
    draw.ambient = Vec3::splat(0.2);
}

fn specular(draw: &mut Draw) {
    draw.effects.specular = true;
    draw.material.specular = Vec3::splat(0.3);
}

fn emissive(draw: &mut Draw) {
    draw.effects.emissive = true;
    draw.material.emissive = Vec3::splat(0.05);
}

fn moved_map(draw: &mut Draw) {
    if has_map(draw) {
        (draw.effects.color_map, draw.effects.color_map_transform) = (true, true);
        draw.coloring.color_uv = Some([Vec3::new(1e-3, 0.0, 0.3), Vec3::new(0.0, 1e-3, 0.3)]);
    }
}

fn see_through_map(draw: &mut Draw) {
    if has_map(draw) && !is_terrain(draw) {
        (draw.effects.color_map, draw.effects.color_map_opacity, draw.effects.transparency) = (true, true, true);
    }
}

/// An image of 256 × 256 texels that repeats.
fn tile() -> ColorMap {
    static IMAGE: LazyLock<Arc<Image>> = LazyLock::new(|| {
        // Bits of the place, so that neighbours differ.
        let texel = |i: u32| [(i >> 8) as u8, i as u8, (i ^ i >> 8) as u8, 255];
        let image = Image::new(256, 256, Pixels::Rgba8((0..256 * 256).map(texel).collect()));
        Arc::new(image.unwrap_or_else(|_| unreachable!("as many texels as the image has")))
    });
    let filter = TextureFilter::of_quality(1.0);
    ColorMap { image: Arc::clone(&IMAGE), filter, wrap: [Wrap::Repeat; 2] }
}

fn detail_textures(draw: &mut Draw) {
    if is_terrain(draw) {
        draw.effects.detail_textures = true;
        let textures = [tile(), tile(), tile(), tile()];
        draw.coloring.detail = Some(Box::new(DetailMaps { mask: tile(), textures, tiles: Vec2::ONE }));
    }
}

fn normal_map(draw: &mut Draw) {
    if is_terrain(draw) {
        draw.effects.normal_map = true;
        draw.coloring.relief = Some(Relief { map: tile(), tiles: Vec2::ONE, raw_per_slope: Vec2::ONE });
    }
}

fn bump_map(draw: &mut Draw) {
    if is_terrain(draw) {
        draw.effects.bump_map = true;
        draw.coloring.bump = Some(Bump { map: tile(), tiles: Vec2::ONE, raw_per_texel: Vec2::ONE });
    }
}

fn corner_colors(draw: &mut Draw) {
    let color = Vec4::new(0.5, 0.5, 0.5, 1.0);
    match &mut draw.geometry {
        Geometry::Mesh(mesh) => {
            let mesh = Arc::make_mut(mesh);
            mesh.colors = vec![color; mesh.positions.len()];
        }
        Geometry::Strokes(strokes) => {
            let strokes = Arc::make_mut(strokes);
            strokes.colors = vec![[color; 2]; strokes.pieces.len()];
        }
        Geometry::Terrain(_) => return,
    }
    draw.effects.vertex_colors = true;
}

fn clip_plane(draw: &mut Draw) {
    draw.effects.clip_planes = 1;
    // All of the world is in front of it, so that nothing less is drawn.
    draw.clip_planes = Arc::from([Vec4::W]);
}

fn depth_offset(draw: &mut Draw) {
    if is_face(draw) {
        draw.effects.polygon_offset = true;
        draw.depth_offset = DepthOffset { factor: 1.0, units: 1 };
    }
}

fn vertex_shader(draw: &mut Draw) {
    let text = "fn vertex_shader(vertex: Vertex) -> vec3f {\n    return vec3f(0.0);\n}";
    shader(draw, text, ShaderUses { vertex: Some(VertexUses::default()), fragment: None });
}

fn fragment_shader(draw: &mut Draw) {
    let text = "fn fragment_shader(fragment: Fragment) -> vec3f {\n    return fragment.color;\n}";
    let fragment = Some(FragmentUses { color: true, ..FragmentUses::default() });
    shader(draw, text, ShaderUses { vertex: None, fragment });
}

fn shader(draw: &mut Draw, text: &str, uses: ShaderUses) {
    let origin = ShaderOrigin::Node(Box::default());
    let texts = vec![ShaderText { text: text.into(), origin }];
    draw.effects.shaders = uses;
    draw.program = Some(Arc::new(DrawProgram {
        code: Arc::new(ProgramCode { texts, values: Vec::new(), textures: Vec::new(), uses }),
        values: Arc::default(),
        textures: Vec::new(),
        local_from_rel: Mat4::IDENTITY,
        clip_from_local: Mat4::IDENTITY,
        eye_from_local: Mat3::IDENTITY,
    }));
}

fn sky(frame: &mut Frame) {
    let (horizon, zenith) = (Vec3::splat(0.8), Vec3::new(0.1, 0.2, 0.6));
    frame.sky = Some(Sky { horizon, zenith, rays: [Vec3::Y, Vec3::X, Vec3::Z] });
}

fn has_map(draw: &Draw) -> bool {
    draw.coloring.color_map.is_some()
}

fn is_terrain(draw: &Draw) -> bool {
    matches!(draw.geometry, Geometry::Terrain(_))
}

fn is_face(draw: &Draw) -> bool {
    !matches!(draw.geometry, Geometry::Strokes(_))
}

/// Colours for study are for terrains.
fn study(draw: &mut Draw, color: DebugColor) {
    if let Geometry::Terrain(terrain) = &mut draw.geometry {
        draw.effects.debug_color = color;
        if color == DebugColor::Errors {
            Arc::make_mut(&mut terrain.instances).rate_alike(0.5);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::action::{RenderAction, effect_names};
    use crate::prelude::*;
    use crate::render::draw_text;

    /// A terrain with a colour map, and a mesh.
    fn frame(morph: bool) -> Frame {
        let image = |width, pixels| Arc::new(Image::new(width, width, pixels).unwrap());
        let mut scene = Scene::new();
        let root = scene.root();
        let (position, look_at) = (Some(DVec3::new(0.5, -1.0, 1.0)), Some(DVec3::new(0.5, 0.5, 0.0)));
        scene.add(root, PerspectiveCamera { position, look_at, ..Default::default() }).unwrap();
        let heights = (0..33 * 33u32).map(|i| (i * 7919 % 65_521) as u16).collect();
        scene.add(root, Texture2::from_image(image(33, Pixels::Gray16(heights)))).unwrap();
        scene.add(root, TextureUnit { unit: 1 }).unwrap();
        scene.add(root, Texture2::from_image(image(1, Pixels::Rgba8(vec![[255; 4]])))).unwrap();
        scene.add(root, SeamlessTerrain { morph, ..Default::default() }).unwrap();
        scene.add(root, Cube::default()).unwrap();
        bare(RenderAction::new(64, 64).apply(&scene).unwrap())
    }

    /// Whatever effect the library can name has a row, and all of them can be drawn.
    #[test]
    fn every_effect_has_a_row() {
        let mut found: BTreeSet<String> = names(&frame(true)).into_iter().collect();
        for (name, effect) in EFFECTS {
            let mut frame = frame(false);
            effect(&mut frame);
            for draw in &frame.draws {
                draw_text(draw, wgpu::TextureFormat::Rgba8UnormSrgb).unwrap_or_else(|error| panic!("{name}: {error}"));
            }
            found.extend(names(&frame));
        }
        // `point-light×1` is a point light.
        let found: BTreeSet<&str> = found.iter().filter_map(|name| name.split('×').next()).collect();
        let missing: Vec<&str> = effect_names().filter(|name| !found.contains(name)).collect();
        assert!(missing.is_empty(), "no row in EFFECTS asks for {missing:?}");
    }
}
