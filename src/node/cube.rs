use glam::{DVec2, DVec3};

use super::{FieldProblem, ShapeNode, Triangle};
use crate::action::{Aabb, ShapeContext, ShapeError};

crate::define_node! {
    /// A box around the origin, its faces along the axes.
    ///
    /// Drawn, boxed and picked as its twelve triangles, two per face. Faces may have materials of their own: front (towards +z),
    /// back, left (−x), right, top (+y), bottom.
    ///
    /// ```ron
    /// Cube(width: 4.0)
    /// ```
    pub struct Cube: shape {
        /// Length along x, local units, from 0 up.
        pub width: f64 = 2.0,
        /// Length along y, local units, from 0 up.
        pub height: f64 = 2.0,
        /// Length along z, local units, from 0 up.
        pub depth: f64 = 2.0,
    }
    check |c: &Cube| {
        [("width", c.width), ("height", c.height), ("depth", c.depth)]
            .into_iter()
            .filter(|(_, v)| !(*v >= 0.0 && v.is_finite()))
            .map(|(field, v)| FieldProblem::new(field, format!("{v} does not work: lengths go from 0 up")))
            .collect()
    };
}

impl ShapeNode for Cube {
    fn bounds(&self, _: &ShapeContext<'_>) -> Result<Option<Aabb>, ShapeError> {
        let half = DVec3::new(self.width, self.height, self.depth) * 0.5;
        Ok(Some(Aabb { min: -half, max: half }))
    }

    fn primitives(&self, cx: &ShapeContext<'_>, sink: &mut dyn FnMut(Triangle)) -> Result<(), ShapeError> {
        let half = DVec3::new(self.width, self.height, self.depth) * 0.5;
        // Per face: its normal, its direction of s and its direction of t as seen from outside.
        let faces = [
            (DVec3::Z, DVec3::X, DVec3::Y),
            (DVec3::NEG_Z, DVec3::NEG_X, DVec3::Y),
            (DVec3::NEG_X, DVec3::Z, DVec3::Y),
            (DVec3::X, DVec3::NEG_Z, DVec3::Y),
            (DVec3::Y, DVec3::X, DVec3::NEG_Z),
            (DVec3::NEG_Y, DVec3::X, DVec3::Z),
        ];
        let binding = cx.state.material_binding;
        for (face, (normal, s, t)) in (0..).zip(faces) {
            let materials = [if binding.is_per_part() || binding.is_per_face() { face } else { 0 }; 3];
            let corner = |a: f64, b: f64| ((normal + s * a + t * b) * half, DVec2::new(a, b) * 0.5 + 0.5);
            let [p, q, r, o] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
            for corners in [[p, q, r], [p, r, o]] {
                let (points, uvs) = (corners.map(|c| c.0), corners.map(|c| c.1));
                sink(Triangle { points, normals: [normal; 3], uvs, materials });
            }
        }
        Ok(())
    }
}
