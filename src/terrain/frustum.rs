//! A view volume as half-spaces, tested against boxes in lattice coordinates.

use glam::{DAffine3, DMat3, DVec3, DVec4};

/// Half-spaces `n · p + d ≥ 0` whose intersection is what a camera sees. The far side is open.
#[derive(Debug, Clone, PartialEq)]
pub struct Frustum {
    planes: Vec<DVec4>,
}

impl Frustum {
    /// A view volume from its planes: (n, d) with `n · p + d ≥ 0` inside. The planes need not be normalised.
    #[must_use]
    pub fn new(planes: Vec<DVec4>) -> Self {
        Self { planes }
    }

    /// The half-spaces.
    #[must_use]
    pub fn planes(&self) -> &[DVec4] {
        &self.planes
    }

    /// The same volume in the coordinates that `map` takes to the present ones. Works for singular maps as well.
    #[must_use]
    pub fn pulled_back(&self, map: &DAffine3) -> Self {
        let DMat3 { x_axis, y_axis, z_axis } = map.matrix3;
        let planes = self
            .planes
            .iter()
            .map(|plane| {
                let n = plane.truncate();
                DVec4::new(n.dot(x_axis), n.dot(y_axis), n.dot(z_axis), n.dot(map.translation) + plane.w)
            })
            .collect();
        Self { planes }
    }

    /// Whether a point is inside or on the border.
    #[inline]
    #[must_use]
    pub fn contains(&self, p: DVec3) -> bool {
        self.planes.iter().all(|plane| plane.dot(p.extend(1.0)) >= 0.0)
    }

    /// Whether a box lies wholly outside one of the half-spaces. `false` may be wrong (a box outside near an edge), `true`
    /// never is: the comparison allows for the rounding of the three products and sums, at most 4 ulp of their
    /// magnitudes.
    #[inline]
    #[must_use]
    pub fn excludes(&self, low: DVec3, high: DVec3) -> bool {
        self.planes.iter().any(|plane| {
            let n = plane.truncate();
            let far = DVec3::new(
                if n.x >= 0.0 { high.x } else { low.x },
                if n.y >= 0.0 { high.y } else { low.y },
                if n.z >= 0.0 { high.z } else { low.z },
            );
            let terms = n * far;
            let slack = 4.0 * f64::EPSILON * (terms.abs().element_sum() + plane.w.abs());
            terms.element_sum() + plane.w < -slack
        })
    }
}
