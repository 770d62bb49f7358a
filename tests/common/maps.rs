//! The five maps of the repository, for tests and benches that go over all of them.
#![allow(dead_code, missing_docs, unreachable_pub, reason = "each test and bench uses its own part of this module")]

use std::path::Path;

use glam::{DAffine3, DVec3};
use seamount::action::{Lens, Viewpoint};
use seamount::node::{SeamlessTerrain, lattice_view};
use seamount::prelude::*;
use seamount::terrain::{ActivePatch, HeightField, Hierarchy, LatticeFrame, LatticeView, LodEye, Selection, Terrain};

/// A map with everything that is derived from it, and where its node puts it.
#[derive(Debug)]
pub struct Map {
    pub name: &'static str,
    pub node: SeamlessTerrain,
    pub terrain: Terrain,
    pub frame: LatticeFrame,
}

/// Names of the maps in `scenes/` and the nodes that show them, four of them in metres.
pub fn nodes() -> [(&'static str, SeamlessTerrain); 5] {
    let metres = |x, y| SeamlessTerrain {
        size: Some(DVec2::new(x, y)),
        max_height: 65_535.0,
        base_height: -1_000.0,
        ..SeamlessTerrain::default()
    };
    [
        ("fuji", SeamlessTerrain { void_sample: Some(0.0), ..metres(90_600.0, 111_240.0) }),
        ("andes", metres(93_840.0, 111_240.0)),
        ("jacksboro", metres(29_949.0, 31_796.0)),
        ("puget", metres(163_840.0, 163_840.0)),
        ("walls", SeamlessTerrain { scale: 700.0, max_height: 100.0, ..SeamlessTerrain::default() }),
    ]
}

/// The image of a map.
pub fn image(name: &str) -> Image {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.png"));
    Image::open(&path).unwrap_or_else(|error| panic!("{error}"))
}

pub fn maps() -> Vec<Map> {
    let field = |name, node: &SeamlessTerrain| {
        image(name).height_field(node.void_sample).unwrap_or_else(|error| panic!("{error}"))
    };
    nodes().into_iter().map(|(name, node)| Map::new(name, field(name, &node), node)).collect()
}

/// A map of 4097² samples, 100 km wide with 4 km of relief.
pub fn generated() -> Map {
    let node = SeamlessTerrain { scale: 100_000.0, max_height: 4_000.0, ..SeamlessTerrain::default() };
    let field = seamount::terrain::generate(4097, 1).unwrap_or_else(|error| panic!("{error}"));
    Map::new("generated 4097²", field, node)
}

impl Map {
    fn new(name: &'static str, field: HeightField, node: SeamlessTerrain) -> Self {
        let frame = node.frame(&field);
        Self { name, node, terrain: Terrain::new(field), frame }
    }

    /// The active patches that meet the view volume: those that are drawn.
    pub fn visible(&self, tree: &Hierarchy, selection: &Selection, view: &LatticeView) -> Vec<ActivePatch> {
        let pyramid = self.terrain.pyramid();
        let outside = |patch: &ActivePatch| {
            let [low, high] = pyramid.patch_box(tree, patch.id);
            view.frustum.excludes(low, high)
        };
        selection.patches(tree).filter(|patch| !outside(patch)).collect()
    }

    /// Where the eye of [`Map::flight`] stands: u and v in cells, height in local units above the ground.
    fn stand(&self, k: u32, eyes: u32) -> [f64; 3] {
        let done = f64::from(k) / f64::from(eyes - 1);
        let [cu, cv] = self.frame.cells.map(f64::from);
        let angle = 2.4 * f64::from(k);
        let (u, v) = (0.5 + 0.4 * done * angle.cos(), 0.5 - 0.4 * done * angle.sin());
        [u * cu, v * cv, cu * self.frame.cell_size[0] * 0.2 * 0.01f64.powf(done)]
    }

    /// The eye of [`Map::flight`] as the published metric sees it, in cells.
    pub fn lod_eye(&self, k: u32, eyes: u32) -> LodEye {
        let [u, v, above] = self.stand(k, eyes);
        let [dx, dy] = self.frame.cell_size;
        LodEye::Point { u, v, height: above / (dx * dy).sqrt() }
    }

    /// Eye number `k` of `eyes` on a flight that spirals down from a fifth of the map's length above the ground to a few
    /// metres above it, looking ahead and down at first and level at last, in a picture of 1280 × 720.
    pub fn flight(&self, k: u32, eyes: u32) -> LatticeView {
        let done = f64::from(k) / f64::from(eyes - 1);
        let angle = 2.4 * f64::from(k);
        let [u, v, above] = self.stand(k, eyes);
        let ground = self.terrain.field().surface(u, v).unwrap_or(0.0);
        let eye = self.frame.local(DVec3::new(u, v, ground)) + above * DVec3::Z;
        let (yaw, pitch) = (angle + 2.0, -0.8 * (1.0 - done));
        let forward = DVec3::new(yaw.cos() * pitch.cos(), yaw.sin() * pitch.cos(), pitch.sin());
        let right = forward.cross(DVec3::Z).normalize();
        let view = Viewpoint {
            eye,
            right,
            up: right.cross(forward),
            forward,
            lens: Lens::Perspective { tan_half_height: 0.41 },
            center: DVec2::ZERO,
            aspect: 16.0 / 9.0,
            pixels: 720.0,
            near: 1.0,
            far: None,
        };
        lattice_view(&view, &DAffine3::IDENTITY, &self.frame)
    }
}
