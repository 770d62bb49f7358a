//! Section 3: what each effect costs.

use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3};

use super::bench::{gpu_figure, median, ms};
use super::report::{EffectFigures, EffectRow, EffectTimes, EffectsCost};
use super::{CostError, Options, Run};
use crate::action::{
    Attenuation, Coloring, Cone, ContourStyle, DebugColor, Draw, Effects, Fog, FrameLight, Geometry, LineStyle, RampMap,
};
use crate::node::{DetailMode, FogType, Ramp, RampBy, Style};
use crate::render::{Headless, shader_text};
use crate::terrain::LatticeLight;

/// An effect by its name, as what it changes in a draw that has none.
type Effect = (&'static str, fn(&mut Draw));

/// The effects that a draw can have. A new one is a line here.
const EFFECTS: [Effect; 19] = [
    ("none", |_| {}),
    ("one directional light", directional),
    ("one directional light, ambient light", |draw| {
        directional(draw);
        ambient(draw);
    }),
    ("one directional light, highlights", |draw| {
        directional(draw);
        specular(draw);
    }),
    ("one directional light, glow", |draw| {
        directional(draw);
        emissive(draw);
    }),
    ("one directional light, shadow", |draw| {
        directional(draw);
        shadow(draw);
    }),
    ("one point light", point),
    ("one spot light", spot),
    ("fog", fog),
    ("transparency", transparency),
    ("colour map", |draw| draw.effects.color_map = has_map(draw)),
    ("height ramp", height_ramp),
    ("contour lines", contours),
    ("lines on faces", lines),
    ("colours by part", |draw| draw.effects.debug_color = debug(draw, DebugColor::Parts)),
    ("colours by level", |draw| draw.effects.debug_color = debug(draw, DebugColor::Levels)),
    ("colours by normal", |draw| draw.effects.debug_color = debug(draw, DebugColor::Normals)),
    ("colours by error", |draw| {
        draw.effects.debug_color = debug(draw, DebugColor::Errors);
        if let Geometry::Terrain(terrain) = &mut draw.geometry {
            Arc::make_mut(&mut terrain.instances).rate_alike(0.5);
        }
    }),
    ("all that go together", |draw| {
        for effect in [directional, point, spot, ambient, specular, emissive, fog, transparency] {
            effect(draw);
        }
        draw.effects.color_map = has_map(draw);
        for effect in [height_ramp, contours, lines] {
            effect(draw);
        }
    }),
];

pub(super) const STEPS: usize = EFFECTS.len();

const REPEATS: usize = 3;

/// The format of [`Headless`] pictures.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;

pub(super) fn measure(run: &mut Run<'_>, options: &Options) -> Result<(), CostError> {
    run.report.effects = Some(EffectsCost::default());
    if let Some(eye) = run.bench.main.eyes(run.bench.size).into_iter().find(|eye| eye.name == "corner") {
        run.bench.look(&eye, 0);
    }
    run.bench.set_detail(DetailMode::PixelError(1.0));
    let scene = run.bench.frame()?.clone();
    for (name, effect) in EFFECTS {
        run.begin(&format!("effects: {name}"));
        let mut frame = scene.clone();
        frame.sky = None;
        for draw in &mut frame.draws {
            bare(draw);
            effect(draw);
        }
        let mut texts: Vec<String> =
            frame.draws.iter().map(|draw| shader_text(&draw.effects, FORMAT)).collect::<Result<_, _>>()?;
        texts.sort();
        texts.dedup();
        // A device that has seen nothing else: what it holds is what this takes.
        let mut headless = Headless::new(options.adapter.as_deref())?;
        headless.draw(&frame)?;
        let mut gpus = Vec::new();
        let mut report = None;
        for _ in 0..REPEATS {
            let drawn = headless.draw(&frame)?.report;
            gpus.push(drawn.gpu.map(ms));
            report.get_or_insert(drawn);
        }
        let report = report.unwrap_or_default();
        let row = EffectRow {
            name: name.to_owned(),
            effects: frame.draws.first().map(|draw| draw.effects.names()).unwrap_or_default(),
            figures: EffectFigures {
                shader_bytes: texts.iter().map(|text| text.len() as u64).sum(),
                device_bytes: report.gpu_bytes,
                bytes_per_frame: report.bytes_uploaded,
            },
            times: EffectTimes { gpu_ms: gpu_figure(&gpus, median) },
        };
        run.report.effects.get_or_insert_default().rows.push(row);
    }
    run.finished()
}

/// Takes all effects away but the blending of heights, which is part of the detail.
fn bare(draw: &mut Draw) {
    let Effects { geometry, morph, .. } = draw.effects;
    draw.effects = Effects { geometry, morph, ..Effects::default() };
    draw.coloring = Coloring::default();
    draw.lights = Arc::default();
    draw.ambient = Vec3::ZERO;
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

fn point(draw: &mut Draw) {
    draw.effects.point_lights += 1;
    let attenuation = Attenuation::NONE;
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

fn fog(draw: &mut Draw) {
    draw.effects.fog = FogType::Fog;
    // What a fog costs does not depend on how thick it is.
    draw.fog = Fog { color: Vec3::splat(0.7), rate: 1e-4 };
}

fn transparency(draw: &mut Draw) {
    draw.effects.transparency = true;
    draw.material.opacity = 0.5;
}

fn height_ramp(draw: &mut Draw) {
    if is_terrain(draw) {
        draw.effects.ramp = Some(RampBy::Height);
        draw.coloring.ramp = Some(RampMap { ramp: Ramp::Gray, scale: 1e-3, offset: 0.5, slope: Vec2::ZERO });
    }
}

fn contours(draw: &mut Draw) {
    if is_terrain(draw) {
        draw.effects.contours = true;
        draw.coloring.contours = Some(ContourStyle { scale: 1e-2, offset: 0.0, width: 1.0, color: Vec3::ZERO });
    }
}

fn lines(draw: &mut Draw) {
    draw.effects.style = Style::FilledLines;
    draw.lines = LineStyle { color: Vec3::ZERO, width: 1.0 };
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

fn has_map(draw: &Draw) -> bool {
    draw.coloring.color_map.is_some()
}

fn is_terrain(draw: &Draw) -> bool {
    matches!(draw.geometry, Geometry::Terrain(_))
}

/// Colours for study are for terrains.
fn debug(draw: &Draw, color: DebugColor) -> DebugColor {
    if is_terrain(draw) { color } else { DebugColor::Plain }
}
