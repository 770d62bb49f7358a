use std::sync::Arc;

use glam::{DMat4, DVec2, DVec3, DVec4, Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::field::enum_field;
use super::text_layout::{Layout, Region};
use super::{FieldProblem, HitDetail, List, Node, ShapeHit, ShapeNode, Triangle};
use crate::action::{Aabb, DrawContext, Mesh, PickCone, Ray, ShapeContext, ShapeError, Viewpoint, inverse};
use crate::scene::{FontError, Image, Pixels, Typeface};

/// Where the strings of a text stand at its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum Justification {
    /// They begin there.
    #[default]
    Left,
    /// They end there.
    Right,
    /// Their middle is there.
    Center,
}

enum_field!(Justification: Left | Right | Center);

/// Which character of a text was hit.
///
/// ```
/// use seamount::node::{HitDetail, TextDetail};
/// use seamount::prelude::*;
///
/// let mut scene = Scene::new();
/// let root = scene.root();
/// let (position, look_at) = (Some(DVec3::Z * 9.0), Some(DVec3::ZERO));
/// scene.add(root, PerspectiveCamera { position, look_at, ..PerspectiveCamera::default() })?;
/// scene.add(root, Font { size: 20.0, ..Font::default() })?;
/// scene.add(root, Text2 { string: "ab".into(), ..Text2::default() })?;
/// // The baseline begins in the middle of the picture; letters of this font are 12 pixels wide.
/// let hits = RayPickAction::pixel(100 + 12 + 6, 50 - 5, [200, 100]).apply(&scene)?;
/// assert_eq!(hits[0].detail, HitDetail::Text(TextDetail { string: 0, character: 1 }));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct TextDetail {
    /// Number of the string, from 0.
    pub string: usize,
    /// Number of the character in the string, from 0.
    pub character: usize,
}

crate::define_node! {
    /// Text that faces the viewer, its size in pixels whatever the distance.
    ///
    /// The first string's baseline begins at the origin, as the picture shows it, on a whole pixel; the others follow below. All of it
    /// has the depth of the origin, and is seen if that is between the near and the far plane, and not cut off. The colour is
    /// the diffuse one of the material with its transparency, not lit; textures and DrawStyle do not change it, but for
    /// `Invisible`.
    ///
    /// Picked through the picture, by the cells of its characters and not their ink alone: the detail is a
    /// [`TextDetail`](crate::node::TextDetail), string and character. A ray of the world meets no text, or its place if PickStyle has
    /// boxes picked. Its box is the place, or, where the camera and the size of the picture are known, what it covers there. A view
    /// alone does not tell how far its picture is stretched: text is boxed as in one that is not. It has no triangles to call back
    /// or to count.
    ///
    /// Characters are put one after the other from left to right, without joining or reordering. One that the font does not have
    /// is a box. What is larger than the picture is only painted where the picture shows it, and a little beyond. A
    /// character that reaches further than eight ems, or is of more than 2²⁴ pixels, is a box as well.
    ///
    /// ```ron
    /// Translation(translation: (45300.0, 55600.0, 3776.0)),
    /// Font(size: 16.0),
    /// Text2(string: ["Fuji-san", "3776 m"], justification: Center)
    /// ```
    pub struct Text2: shape {
        /// The strings, from top to bottom.
        pub string: List<String> = List::from([String::new()]),
        /// Distance of baselines, in multiples of the font's size, from -10⁶ to 10⁶: upwards below 0.
        pub spacing: f64 = 1.0,
        /// Where the strings stand.
        pub justification: Justification = Justification::Left,
    }
    actions {
        Render: "draws it, in pixels large";
        BoundingBox: "holds its place; what it covers, if told the view";
        RayPick, HandleEvent: "meet its characters in the picture; a ray of the world does not";
    }
    check |text: &Text2| match text.spacing.abs() <= MOST_SPACING {
        true => Vec::new(),
        false => {
            let message = format!("{} does not work: from -{MOST_SPACING} to {MOST_SPACING} sizes of the font", text.spacing);
            vec![FieldProblem::new("spacing", message)]
        }
    };
}

/// Largest distance of baselines in sizes of the font: places of lines stay exact to far less than a pixel.
const MOST_SPACING: f64 = 1e6;

/// Pixels that are painted of a text larger than the picture beyond what is shown: so far it moves with the image that it has.
const MARGIN: f64 = 128.0;

/// Side up to which an image has a margin: what every device can hold.
const MOST_SIDE: f64 = 8192.0;

/// The place of a text in a picture.
#[derive(Debug, Clone, Copy)]
struct Place {
    /// Width and height of the picture in pixels.
    picture: [f64; 2],
    /// The pixel that the text hangs on: to the right and down from the top left corner.
    pixel: [f64; 2],
    /// The origin in clip space.
    clip: DVec4,
    /// Along the view, from the eye.
    depth: f64,
}

impl Place {
    /// Nothing where the text is not seen.
    fn new(cx: &ShapeContext<'_>, view: &Viewpoint) -> Option<Self> {
        let model = &cx.state.model;
        let origin = model.translation;
        let depth = (origin - view.eye).dot(view.forward);
        let seen = depth >= view.near && view.far.is_none_or(|far| depth <= far);
        let cut = |plane: &crate::action::PlacedPlane| plane.normal.dot(origin - plane.point) < 0.0;
        // Picks meet nothing that is flattened.
        if !seen || cx.state.clip_planes.iter().any(cut) || inverse(&model.matrix3).is_none() {
            return None;
        }
        let clip = view.clip_from_eye() * (origin - view.eye).extend(1.0);
        // A picture may be stretched; the text in it is not.
        let unstretched = [(view.aspect * view.pixels).round(), view.pixels];
        let picture = cx.cameras.map_or(unstretched, |cameras| cameras.size().map(f64::from));
        let pixel = pixel_of(clip, picture)?.map(f64::round);
        Some(Self { picture, pixel, clip, depth })
    }

    /// What the picture shows of a region around the text; nothing beside the picture.
    fn shown(&self, region: Region) -> Option<Region> {
        let [x, y] = self.pixel;
        let picture = Region { min: [0.0; 2], max: self.picture };
        Some(region.moved([x, y]).intersection(picture)?.moved([-x, -y]))
    }

    /// What is painted of a region of which this much is shown: all of it, or of one larger than the picture what is near that.
    fn part(&self, region: Region, shown: Region) -> Region {
        if region.size().iter().zip(self.picture).all(|(side, most)| *side <= most) {
            return region;
        }
        let margin = shown.size().map(|side| (0.5 * (MOST_SIDE - side)).floor().clamp(0.0, MARGIN));
        shown.grown(margin).intersection(region).unwrap_or(shown)
    }

    /// From pixels of a part of the picture, to the right and down from its corner, to clip space.
    fn clip_from(&self, [x, y]: [f64; 2]) -> DMat4 {
        let ([width, height], w) = (self.picture, self.clip.w);
        DMat4::from_cols(
            DVec4::new(2.0 * w / width, 0.0, 0.0, 0.0),
            DVec4::new(0.0, -2.0 * w / height, 0.0, 0.0),
            DVec4::ZERO,
            DVec4::new(w * (2.0 * x / width - 1.0), w * (1.0 - 2.0 * y / height), self.clip.z, w),
        )
    }
}

/// Where a picture shows a place of clip space, in pixels to the right and down.
fn pixel_of(clip: DVec4, [width, height]: [f64; 2]) -> Option<[f64; 2]> {
    let [x, y] = [clip.x / clip.w, clip.y / clip.w];
    let pixel = [(0.5 + 0.5 * x) * width, (0.5 - 0.5 * y) * height];
    pixel.iter().all(|v| v.is_finite()).then_some(pixel)
}

/// What a text looked like last.
#[derive(Debug, Default)]
struct Painted {
    /// The text, with its font and the size of that.
    of: Option<(Text2, u64, f64)>,
    region: Option<Region>,
    part: Option<Region>,
    /// The part; nothing without ink.
    drawn: Option<(Arc<Mesh>, Arc<Image>)>,
}

impl Text2 {
    /// The font with its size.
    fn font(&self, cx: &ShapeContext<'_>) -> Result<(Arc<Typeface>, f64), ShapeError> {
        if let Some(problem) = self.problems().into_iter().next() {
            return Err(problem.into());
        }
        let font = cx.state.font.as_deref();
        let size = font.map_or(super::Font::default().size, |font| font.size);
        if !super::font::is_size(size) {
            return Err(FontError::Size(size).into());
        }
        let file = font.and_then(|font| font.file.as_deref());
        Ok((cx.scene.resources().typeface(file)?, size))
    }

    fn layout<'f>(&self, (font, size): &'f (Arc<Typeface>, f64)) -> Layout<'f> {
        Layout::new(font, *size, &self.string, self.spacing, self.justification)
    }
}

impl ShapeNode for Text2 {
    fn bounds(&self, cx: &ShapeContext<'_>) -> Result<Option<Aabb>, ShapeError> {
        if self.string.iter().all(String::is_empty) {
            return Ok(None);
        }
        let point = Aabb { min: DVec3::ZERO, max: DVec3::ZERO };
        let placed = cx.viewpoint.and_then(|view| Some((view, Place::new(cx, view)?)));
        let Some((view, place)) = placed else { return Ok(Some(point)) };
        let Some(region) = self.layout(&self.font(cx)?).region() else { return Ok(Some(point)) };
        let model = &cx.state.model;
        let Some(inverse) = inverse(&model.matrix3) else { return Ok(Some(point)) };
        let Region { min: [left, top], max: [right, bottom] } = region.moved(place.pixel);
        let corners = [[left, top], [right, top], [left, bottom], [right, bottom]].map(|[x, y]| {
            let (origin, direction) = view.ray(x / place.picture[0], y / place.picture[1]);
            let from_eye = origin - view.eye;
            let at = from_eye + direction * ((place.depth - from_eye.dot(view.forward)) / direction.dot(view.forward));
            inverse * (at - (model.translation - view.eye))
        });
        Ok(Aabb::of(corners.into_iter().filter(|corner| corner.is_finite())).or(Some(point)))
    }

    fn primitives(&self, _: &ShapeContext<'_>, _: &mut dyn FnMut(Triangle)) -> Result<(), ShapeError> {
        Ok(())
    }

    fn beyond_box(&self) -> bool {
        true
    }

    fn near(
        &self,
        cx: &ShapeContext<'_>,
        cone: &PickCone,
        far: f64,
        hits: &mut Vec<ShapeHit>,
    ) -> Result<(), ShapeError> {
        let placed = cx.viewpoint.and_then(|view| Some((view, Place::new(cx, view)?)));
        let Some((view, place)) = placed else { return Ok(()) };
        let Ray { origin, direction, .. } = cone.ray;
        let t = (place.depth - (origin - view.eye).dot(view.forward)) / direction.dot(view.forward);
        if !(t >= 0.0 && t <= far) {
            return Ok(());
        }
        let at = origin - view.eye + direction * t;
        let Some([x, y]) = pixel_of(view.clip_from_eye() * at.extend(1.0), place.picture) else { return Ok(()) };
        let (font, at_pixel) = (self.font(cx)?, [x - place.pixel[0], y - place.pixel[1]]);
        // Most texts are far from what is picked, and need not be laid out.
        if !Layout::bound(&font.0, font.1, &self.string, self.spacing, self.justification).has(at_pixel) {
            return Ok(());
        }
        let detail = self.layout(&font).at(at_pixel);
        let model = &cx.state.model;
        let Some((detail, inverse)) = detail.zip(inverse(&model.matrix3)) else { return Ok(()) };
        let point = inverse * (at - (model.translation - view.eye));
        // It faces the viewer; the transpose takes back what picks do to normals.
        let normal = model.matrix3.transpose() * -view.forward;
        hits.push(ShapeHit {
            t,
            point,
            normal,
            smooth_normal: normal,
            uv: DVec2::ZERO,
            detail: HitDetail::Text(detail),
        });
        Ok(())
    }

    fn draw(&self, cx: &mut DrawContext<'_>) -> Result<(), ShapeError> {
        let font = self.font(&cx.shape)?;
        let Some(place) = Place::new(&cx.shape, cx.view) else { return Ok(()) };
        let mut painted = cx.take_kept::<Painted>();
        let of = (self.clone(), font.0.id(), font.1);
        if painted.of.as_ref() != Some(&of) {
            let region = self.layout(&font).region();
            *painted = Painted { of: Some(of), region, ..Painted::default() };
        }
        let shown = painted.region.and_then(|region| Some((region, place.shown(region)?)));
        if let Some((region, shown)) = shown
            && painted.part.is_none_or(|part| !part.holds(shown))
        {
            let (layout, part) = (self.layout(&font), place.part(region, shown));
            painted.drawn = if layout.has_ink() { Some(paint(&layout, part)?) } else { None };
            painted.part = Some(part);
        }
        let drawn = shown.and(painted.part).zip(painted.drawn.clone());
        cx.keep(painted);
        let Some((Region { min: [left, top], .. }, (mesh, image))) = drawn else { return Ok(()) };
        let [x, y] = place.pixel;
        cx.draw_on_picture(mesh, image, &place.clip_from([x + left, y + top]))
    }
}

/// A rectangle of pixels with an image whose alpha is the share of each pixel that is covered.
fn paint(layout: &Layout<'_>, part: Region) -> Result<(Arc<Mesh>, Arc<Image>), ShapeError> {
    let [width, height] = part.size();
    let texels = layout.paint(part).into_iter().map(|share| [255, 255, 255, (share * 255.0).round() as u8]).collect();
    let image = Image::new(width as u32, height as u32, Pixels::Rgba8(texels))?;
    let corners = [Vec2::ZERO, Vec2::Y, Vec2::ONE, Vec2::X];
    let size = Vec2::new(width as f32, height as f32);
    let mesh = Mesh {
        positions: corners.iter().map(|&corner| (corner * size).extend(0.0)).collect(),
        normals: vec![Vec3::Z; 4],
        colors: Vec::new(),
        uvs: corners.iter().map(|&corner| Vec2::new(corner.x, 1.0 - corner.y)).collect(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    Ok((Arc::new(mesh), Arc::new(image)))
}
