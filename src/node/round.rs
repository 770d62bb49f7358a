use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

use super::{FieldProblem, HitDetail, List, ShapeHit, ShapeNode, Triangle, field::enum_field};
use crate::action::{Aabb, DrawContext, Ray, ShapeContext, ShapeError};

fn lengths<const N: usize>(fields: [(&'static str, f64); N]) -> Vec<FieldProblem> {
    fields
        .into_iter()
        .filter(|(_, v)| !(*v >= 0.0 && v.is_finite()))
        .map(|(field, v)| FieldProblem::new(field, format!("{v} does not work: lengths go from 0 up")))
        .collect()
}

/// A place on a surface: its normal and texture coordinate.
type Look = (DVec3, DVec2);

/// Where a ray comes into a convex body and where it leaves it, with the surface it goes through there.
#[derive(Debug, Clone, Copy)]
struct Span {
    enter: (f64, Surface),
    leave: (f64, Surface),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Surface {
    Side,
    Top,
    Bottom,
}

impl Span {
    /// What is in both. On a rim, where two surfaces meet, the ray goes through one of them.
    fn intersection(self, other: Span) -> Option<Span> {
        let enter = if other.enter.0 > self.enter.0 { other.enter } else { self.enter };
        let leave = if other.leave.0 < self.leave.0 { other.leave } else { self.leave };
        (enter.0 <= leave.0).then_some(Span { enter, leave })
    }

    /// Where y is from −half to half.
    fn slab(ray: &Ray, half: f64) -> Option<Span> {
        let (y, dy) = (ray.origin.y, ray.direction.y);
        if dy == 0.0 {
            let (always, never) = ((f64::NEG_INFINITY, Surface::Bottom), (f64::INFINITY, Surface::Top));
            return (y.abs() <= half).then_some(Span { enter: always, leave: never });
        }
        let bottom = ((-half - y) / dy, Surface::Bottom);
        let top = ((half - y) / dy, Surface::Top);
        Some(if dy > 0.0 { Span { enter: bottom, leave: top } } else { Span { enter: top, leave: bottom } })
    }

    fn of_side(enter: f64, leave: f64) -> Span {
        Span { enter: (enter, Surface::Side), leave: (leave, Surface::Side) }
    }

    /// Appends its ends where they are on a surface that is there, and in the ray's range. A ray that touches has one.
    fn hits(self, ray: &Ray, hits: &mut Vec<ShapeHit>, look: impl Fn(Surface, DVec3) -> Option<Look>) {
        let ends = [Some(self.enter), (self.leave.0 > self.enter.0).then_some(self.leave)];
        for (t, surface) in ends.into_iter().flatten() {
            if t >= ray.near && t <= ray.far {
                let point = ray.at(t);
                if let Some((normal, uv)) = look(surface, point) {
                    hits.push(ShapeHit { t, point, normal, smooth_normal: normal, uv, detail: HitDetail::None });
                }
            }
        }
    }
}

/// Where the squared distance to a centre is not above a square, for a ray seen in the two or three coordinates that count:
/// from the nearest point on, so that a far origin does not cost digits of the difference.
fn ball(origin: DVec3, direction: DVec3, radius: f64) -> Option<(f64, f64)> {
    let square = direction.length_squared();
    if square == 0.0 {
        return (origin.length() <= radius).then_some((f64::NEG_INFINITY, f64::INFINITY));
    }
    let nearest = -origin.dot(direction) / square;
    let across = (origin + direction * nearest).length();
    // r² − a² as a product keeps the digits near the border.
    let inside = (radius - across) * (radius + across);
    (inside >= 0.0).then(|| {
        let half = (inside / square).sqrt();
        (nearest - half, nearest + half)
    })
}

/// s of the side of a round shape: from behind, around by the left as seen from above.
fn around(p: DVec3) -> f64 {
    p.x.atan2(p.z) / TAU + 0.5
}

/// Texture coordinate on a top (seen from above) or a bottom (seen from below).
fn lid(p: DVec3, radius: f64, top: bool) -> DVec2 {
    let scale = if radius > 0.0 { 0.5 / radius } else { 0.0 };
    DVec2::new(0.5 + p.x * scale, if top { 0.5 - p.z * scale } else { 0.5 + p.z * scale })
}

/// Point number k of n on a circle of radius 1 around y, from behind by the left. The last is the first, to the bit.
fn circle(k: usize, n: usize) -> DVec3 {
    let angle = TAU * (k % n) as f64 / n as f64;
    DVec3::new(-angle.sin(), 0.0, -angle.cos())
}

/// Slices of cones and cylinders.
fn slices(cx: &ShapeContext<'_>) -> usize {
    ((40.0 * cx.state.complexity.value) as usize).clamp(4, 128)
}

crate::define_node! {
    /// A sphere around the origin.
    ///
    /// Picked exactly, boxed by the cube around it; drawn, called back and counted as 29 slices of 30 · `Complexity.value` + 1
    /// stacks. The texture runs around from behind (−z) by the left (−x), and up from the south pole (−y).
    ///
    /// ```ron
    /// Sphere(radius: 2.0)
    /// ```
    pub struct Sphere: shape {
        /// The radius, local units, from 0 up.
        pub radius: f64 = 1.0,
    }
    check |s: &Sphere| lengths([("radius", s.radius)]);
}

impl ShapeNode for Sphere {
    fn bounds(&self, _: &ShapeContext<'_>) -> Result<Option<Aabb>, ShapeError> {
        Ok(Some(Aabb { min: DVec3::splat(-self.radius), max: DVec3::splat(self.radius) }))
    }

    fn primitives(&self, cx: &ShapeContext<'_>, sink: &mut dyn FnMut(Triangle)) -> Result<(), ShapeError> {
        const SLICES: usize = 29;
        let stacks = ((30.0 * cx.state.complexity.value) as usize + 1).max(3);
        let corner = |stack: usize, slice: f64, way: DVec3| {
            let angle = std::f64::consts::PI * stack as f64 / stacks as f64;
            // The poles are one point each, to the bit.
            let across = if stack == 0 || stack == stacks { 0.0 } else { angle.sin() };
            let normal = way * across - DVec3::Y * angle.cos();
            (normal * self.radius, normal, DVec2::new(slice / SLICES as f64, stack as f64 / stacks as f64))
        };
        let mut put = |corners: [(DVec3, DVec3, DVec2); 3]| {
            let (points, normals, uvs) = (corners.map(|c| c.0), corners.map(|c| c.1), corners.map(|c| c.2));
            sink(Triangle { points, normals, uvs, ..Triangle::default() });
        };
        for stack in 0..stacks {
            for slice in 0..SLICES {
                let (left, right) = (circle(slice, SLICES), circle(slice + 1, SLICES));
                let s = slice as f64;
                let at =
                    |up: usize, side: usize| corner(stack + up, s + side as f64, if side == 0 { left } else { right });
                let pole = |up: usize| corner(stack + up, s + 0.5, left);
                if stack == 0 {
                    put([pole(0), at(1, 1), at(1, 0)]);
                } else if stack + 1 == stacks {
                    put([at(0, 0), at(0, 1), pole(1)]);
                } else {
                    put([at(0, 0), at(0, 1), at(1, 1)]);
                    put([at(0, 0), at(1, 1), at(1, 0)]);
                }
            }
        }
        Ok(())
    }

    fn ray(&self, _: &ShapeContext<'_>, ray: &Ray, _: bool, hits: &mut Vec<ShapeHit>) -> Result<(), ShapeError> {
        if let Some((enter, leave)) = ball(ray.origin, ray.direction, self.radius) {
            Span::of_side(enter, leave).hits(ray, hits, |_, p| {
                let height = p.y.atan2(p.x.hypot(p.z)) / std::f64::consts::PI + 0.5;
                Some((p, DVec2::new(around(p), height)))
            });
        }
        Ok(())
    }
}

/// The parts of a [`Cylinder`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum CylinderPart {
    /// The side.
    Sides,
    /// The disc above, towards +y.
    Top,
    /// The disc below.
    Bottom,
}

enum_field!(CylinderPart: Sides | Top | Bottom);

crate::define_node! {
    /// A cylinder around the y axis, its middle at the origin.
    ///
    /// Picked exactly; drawn, called back and counted as 40 · `Complexity.value` slices. If a part is missing the inside is drawn as
    /// well, unless ShapeHints say that the shape is solid.
    ///
    /// ```ron
    /// Cylinder(radius: 0.5, height: 10.0, parts: [Sides])
    /// ```
    pub struct Cylinder: shape {
        /// The radius, local units, from 0 up.
        pub radius: f64 = 1.0,
        /// The height, local units, from 0 up.
        pub height: f64 = 2.0,
        /// The parts that are there.
        pub parts: List<CylinderPart> = List::from([CylinderPart::Sides, CylinderPart::Top, CylinderPart::Bottom]),
    }
    check |c: &Cylinder| lengths([("radius", c.radius), ("height", c.height)]);
}

/// The box of a round shape from the parts that are there.
fn round_bounds(radius: f64, height: f64, sides: bool, top: bool, bottom: bool) -> Option<Aabb> {
    let (low, high) = (-height * 0.5, height * 0.5);
    let y = match (sides || (top && bottom), top, bottom) {
        (true, ..) => (low, high),
        (_, true, _) => (high, high),
        (.., true) => (low, low),
        _ => return None,
    };
    Some(Aabb { min: DVec3::new(-radius, y.0, -radius), max: DVec3::new(radius, y.1, radius) })
}

/// The materials of a part by its number, as Open Inventor has them.
fn materials(cx: &ShapeContext<'_>, part: u32) -> [u32; 3] {
    [if cx.state.material_binding.is_per_part() { part } else { 0 }; 3]
}

/// The triangles of a disc at this height, as a fan.
fn disc(n: usize, radius: f64, y: f64, materials: [u32; 3], sink: &mut dyn FnMut(Triangle)) {
    let top = y > 0.0;
    let normal = if top { DVec3::Y } else { DVec3::NEG_Y };
    let corner = |k: usize| circle(k, n) * radius + DVec3::Y * y;
    for k in 1..n - 1 {
        let points = if top { [corner(0), corner(k), corner(k + 1)] } else { [corner(0), corner(k + 1), corner(k)] };
        sink(Triangle { points, normals: [normal; 3], uvs: points.map(|p| lid(p, radius, top)), materials });
    }
}

impl ShapeNode for Cylinder {
    fn bounds(&self, _: &ShapeContext<'_>) -> Result<Option<Aabb>, ShapeError> {
        let has = |part| self.parts.contains(&part);
        Ok(round_bounds(
            self.radius,
            self.height,
            has(CylinderPart::Sides),
            has(CylinderPart::Top),
            has(CylinderPart::Bottom),
        ))
    }

    fn primitives(&self, cx: &ShapeContext<'_>, sink: &mut dyn FnMut(Triangle)) -> Result<(), ShapeError> {
        let (n, half) = (slices(cx), self.height * 0.5);
        if self.parts.contains(&CylinderPart::Sides) {
            for k in 0..n {
                let corner = |k: usize, y: f64| {
                    let way = circle(k, n);
                    (way * self.radius + DVec3::Y * y, way)
                };
                let uv = |k: usize, t: f64| DVec2::new(k as f64 / n as f64, t);
                let (a, b, c, d) = (corner(k, -half), corner(k + 1, -half), corner(k + 1, half), corner(k, half));
                let [p, q, r, s] = [uv(k, 0.0), uv(k + 1, 0.0), uv(k + 1, 1.0), uv(k, 1.0)];
                let materials = materials(cx, 0);
                sink(Triangle { points: [a.0, b.0, c.0], normals: [a.1, b.1, c.1], uvs: [p, q, r], materials });
                sink(Triangle { points: [a.0, c.0, d.0], normals: [a.1, c.1, d.1], uvs: [p, r, s], materials });
            }
        }
        if self.parts.contains(&CylinderPart::Top) {
            disc(n, self.radius, half, materials(cx, 1), sink);
        }
        if self.parts.contains(&CylinderPart::Bottom) {
            disc(n, self.radius, -half, materials(cx, 2), sink);
        }
        Ok(())
    }

    fn ray(&self, _: &ShapeContext<'_>, ray: &Ray, _: bool, hits: &mut Vec<ShapeHit>) -> Result<(), ShapeError> {
        let flat = DVec3::new(1.0, 0.0, 1.0);
        let side = ball(ray.origin * flat, ray.direction * flat, self.radius).map(|(a, b)| Span::of_side(a, b));
        let span = side.zip(Span::slab(ray, self.height * 0.5)).and_then(|(side, slab)| side.intersection(slab));
        let Some(span) = span else { return Ok(()) };
        span.hits(ray, hits, |surface, p| {
            let (part, look) = match surface {
                Surface::Side => {
                    let t = if self.height > 0.0 { p.y / self.height + 0.5 } else { 0.5 };
                    (CylinderPart::Sides, (p * flat, DVec2::new(around(p), t)))
                }
                Surface::Top => (CylinderPart::Top, (DVec3::Y, lid(p, self.radius, true))),
                Surface::Bottom => (CylinderPart::Bottom, (DVec3::NEG_Y, lid(p, self.radius, false))),
            };
            self.parts.contains(&part).then_some(look)
        });
        Ok(())
    }

    fn draw(&self, cx: &mut DrawContext<'_>) -> Result<(), ShapeError> {
        let all = [CylinderPart::Sides, CylinderPart::Top, CylinderPart::Bottom];
        let open = !all.iter().all(|part| self.parts.contains(part));
        cx.draw_faces(open, |shape_cx, sink| self.primitives(shape_cx, sink))
    }
}

/// The parts of a [`Cone`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum ConePart {
    /// The side.
    Sides,
    /// The disc below, towards −y.
    Bottom,
}

enum_field!(ConePart: Sides | Bottom);

crate::define_node! {
    /// A cone around the y axis, its middle at the origin and its tip towards +y.
    ///
    /// Picked exactly; drawn, called back and counted as 40 · `Complexity.value` slices. If a part is missing the inside is drawn as
    /// well, unless ShapeHints say that the shape is solid.
    ///
    /// ```ron
    /// Cone(bottom_radius: 0.5, height: 1.0)
    /// ```
    pub struct Cone: shape {
        /// The radius of the bottom, local units, from 0 up.
        pub bottom_radius: f64 = 1.0,
        /// The height, local units, from 0 up.
        pub height: f64 = 2.0,
        /// The parts that are there.
        pub parts: List<ConePart> = List::from([ConePart::Sides, ConePart::Bottom]),
    }
    check |c: &Cone| lengths([("bottom_radius", c.bottom_radius), ("height", c.height)]);
}

impl Cone {
    /// The normal of the side in a direction, of any length: radius per height up, height per radius outwards.
    fn side_normal(&self, way: DVec3) -> DVec3 {
        way * self.height + DVec3::Y * self.bottom_radius
    }

    /// Where a ray is in the cone without end below its tip.
    fn side(&self, ray: &Ray) -> Option<Span> {
        let slope = if self.height > 0.0 { self.bottom_radius / self.height } else { return None };
        // From the nearest point on: squares of a far origin would have no digits left for the shape.
        let d = ray.direction;
        let start = -ray.origin.dot(d) / d.length_squared();
        let o = ray.at(start);
        // Below the tip by s = s₀ + t·ds: inside where x² + z² − (slope·s)² ≤ 0 and s ≥ 0.
        let (s, ds) = (self.height * 0.5 - o.y, -d.y);
        let a = d.x * d.x + d.z * d.z - slope * slope * ds * ds;
        let b = o.x * d.x + o.z * d.z - slope * slope * s * ds;
        let c = o.x * o.x + o.z * o.z - slope * slope * s * s;
        let (low, high) = roots(a, b, c)?;
        let below = |t: f64| s + t * ds >= 0.0;
        if a > 0.0 {
            // Both on the same half of the double cone.
            return below(low + (high - low) * 0.5).then(|| Span::of_side(start + low, start + high));
        }
        // Within the half that the ray goes down into, or came down from.
        Some(if ds > 0.0 {
            Span::of_side(start + high, f64::INFINITY)
        } else {
            Span::of_side(f64::NEG_INFINITY, start + low)
        })
    }
}

/// The roots of a·t² + 2·b·t + c in order, none lost to cancellation. For a = 0 the one root twice.
fn roots(a: f64, b: f64, c: f64) -> Option<(f64, f64)> {
    let inside = b * b - a * c;
    if inside < 0.0 || !inside.is_finite() {
        return None;
    }
    let q = -(b + inside.sqrt().copysign(b));
    if q == 0.0 {
        return (a != 0.0).then_some((0.0, 0.0));
    }
    let first = c / q;
    let second = if a == 0.0 { first } else { q / a };
    Some((first.min(second), first.max(second)))
}

impl ShapeNode for Cone {
    fn bounds(&self, _: &ShapeContext<'_>) -> Result<Option<Aabb>, ShapeError> {
        let has = |part| self.parts.contains(&part);
        Ok(round_bounds(self.bottom_radius, self.height, has(ConePart::Sides), false, has(ConePart::Bottom)))
    }

    fn primitives(&self, cx: &ShapeContext<'_>, sink: &mut dyn FnMut(Triangle)) -> Result<(), ShapeError> {
        let (n, half) = (slices(cx), self.height * 0.5);
        if self.parts.contains(&ConePart::Sides) {
            for k in 0..n {
                let corner = |k: usize| circle(k, n) * self.bottom_radius - DVec3::Y * half;
                let normal = |way: DVec3| crate::action::unit(self.side_normal(way)).unwrap_or(DVec3::Y);
                let (left, right) = (circle(k, n), circle(k + 1, n));
                let s = |k: f64| k / n as f64;
                sink(Triangle {
                    points: [corner(k), corner(k + 1), DVec3::Y * half],
                    normals: [normal(left), normal(right), normal((left + right) * 0.5)],
                    uvs: [
                        DVec2::new(s(k as f64), 0.0),
                        DVec2::new(s(k as f64 + 1.0), 0.0),
                        DVec2::new(s(k as f64 + 0.5), 1.0),
                    ],
                    materials: materials(cx, 0),
                });
            }
        }
        if self.parts.contains(&ConePart::Bottom) {
            disc(n, self.bottom_radius, -half, materials(cx, 1), sink);
        }
        Ok(())
    }

    fn ray(&self, _: &ShapeContext<'_>, ray: &Ray, _: bool, hits: &mut Vec<ShapeHit>) -> Result<(), ShapeError> {
        let span =
            self.side(ray).zip(Span::slab(ray, self.height * 0.5)).and_then(|(side, slab)| side.intersection(slab));
        let Some(span) = span else { return Ok(()) };
        span.hits(ray, hits, |surface, p| match surface {
            Surface::Bottom => {
                let look = (DVec3::NEG_Y, lid(p, self.bottom_radius, false));
                self.parts.contains(&ConePart::Bottom).then_some(look)
            }
            // The slab's upper end is the tip.
            Surface::Side | Surface::Top => {
                let t = if self.height > 0.0 { p.y / self.height + 0.5 } else { 0.5 };
                let way = crate::action::unit(DVec3::new(p.x, 0.0, p.z)).unwrap_or(DVec3::ZERO);
                let look = (self.side_normal(way), DVec2::new(around(p), t));
                self.parts.contains(&ConePart::Sides).then_some(look)
            }
        });
        Ok(())
    }

    fn draw(&self, cx: &mut DrawContext<'_>) -> Result<(), ShapeError> {
        let open = ![ConePart::Sides, ConePart::Bottom].iter().all(|part| self.parts.contains(part));
        cx.draw_faces(open, |shape_cx, sink| self.primitives(shape_cx, sink))
    }
}
