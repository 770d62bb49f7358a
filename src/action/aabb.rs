//! Axis-aligned boxes.

use glam::{DAffine3, DVec3};

/// A box along the axes, never empty: `min <= max` in each axis. Where there may be nothing, `Option<Aabb>` says so.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aabb {
    /// Smallest coordinates.
    pub min: DVec3,
    /// Largest coordinates.
    pub max: DVec3,
}

impl Aabb {
    /// The smallest box around some points, `None` without points.
    pub fn of(points: impl IntoIterator<Item = DVec3>) -> Option<Self> {
        points.into_iter().fold(None, |found, p| {
            Some(found.map_or(Aabb { min: p, max: p }, |b: Aabb| Aabb { min: b.min.min(p), max: b.max.max(p) }))
        })
    }

    /// The eight corners.
    #[must_use]
    pub fn corners(&self) -> [DVec3; 8] {
        let Aabb { min: a, max: b } = *self;
        std::array::from_fn(|k| {
            DVec3::new(
                if k & 1 == 0 { a.x } else { b.x },
                if k & 2 == 0 { a.y } else { b.y },
                if k & 4 == 0 { a.z } else { b.z },
            )
        })
    }

    /// The middle.
    #[must_use]
    pub fn center(&self) -> DVec3 {
        self.min + (self.max - self.min) * 0.5
    }

    /// Lengths along the axes.
    #[must_use]
    pub fn size(&self) -> DVec3 {
        self.max - self.min
    }

    /// The smallest box around both.
    #[must_use]
    pub fn union(&self, other: &Aabb) -> Aabb {
        Aabb { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The smallest box along the axes around this one transformed: per axis the extreme of each term is chosen, which
    /// visits the extreme corners without listing all eight.
    #[must_use]
    pub fn transformed(&self, map: &DAffine3) -> Aabb {
        let (mut min, mut max) = (map.translation, map.translation);
        for (column, (low, high)) in [
            (map.matrix3.x_axis, (self.min.x, self.max.x)),
            (map.matrix3.y_axis, (self.min.y, self.max.y)),
            (map.matrix3.z_axis, (self.min.z, self.max.z)),
        ] {
            let (a, b) = (column * low, column * high);
            min += a.min(b);
            max += a.max(b);
        }
        Aabb { min, max }
    }

    /// Whether the point is inside or on the border.
    #[must_use]
    pub fn contains(&self, p: DVec3) -> bool {
        self.min.cmple(p).all() && p.cmple(self.max).all()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    #[test]
    fn a_transformed_box_holds_its_corners_and_no_more() {
        let b = Aabb { min: DVec3::new(-1.0, 2.0, 0.5), max: DVec3::new(3.0, 2.5, 7.0) };
        let map = DAffine3::from_scale_rotation_translation(
            DVec3::new(2.0, -1.0, 0.3),
            DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.7),
            DVec3::new(10.0, -4.0, 1.0),
        );
        let expected = Aabb::of(b.corners().map(|c| map.transform_point3(c))).unwrap();
        let got = b.transformed(&map);
        assert!((got.min - expected.min).abs().max_element() < 1e-12);
        assert!((got.max - expected.max).abs().max_element() < 1e-12);
    }
}
