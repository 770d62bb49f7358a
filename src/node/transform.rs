use glam::{DAffine3, DMat3, DVec3};

use super::{AxisAngle, PropertyNode};
use crate::action::{PropertyContext, State};

crate::define_node! {
    /// Moves, turns and scales what follows.
    ///
    /// Applied to a point in this order: move `center` to the origin, turn by the inverse of `scale_orientation`, scale by
    /// `scale_factor`, turn by `scale_orientation`, turn by `rotation`, move back by `center`, move by `translation`
    /// (Open Inventor's order). All actions apply it.
    pub struct Transform: property {
        /// Moved by this much, in units of the parent.
        pub translation: DVec3 = DVec3::ZERO,
        /// Turned by this, axis and angle in radians.
        pub rotation: AxisAngle = AxisAngle::IDENTITY,
        /// Scaled by these factors; negative ones mirror.
        pub scale_factor: DVec3 = DVec3::ONE,
        /// The axes along which is scaled, as a rotation.
        pub scale_orientation: AxisAngle = AxisAngle::IDENTITY,
        /// The point that turning and scaling leave in place.
        pub center: DVec3 = DVec3::ZERO,
    }
}

impl Transform {
    /// The affine map from local coordinates to those of the parent.
    #[must_use]
    pub fn affine(&self) -> DAffine3 {
        let rotation = DMat3::from_quat(self.rotation.quat());
        let axes = DMat3::from_quat(self.scale_orientation.quat());
        let linear = rotation * axes * DMat3::from_diagonal(self.scale_factor) * axes.transpose();
        DAffine3 { matrix3: linear, translation: self.translation + self.center - linear * self.center }
    }
}

impl PropertyNode for Transform {
    fn apply(&self, state: &mut State, _: &PropertyContext<'_>) {
        state.transform(&self.affine());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_apply_in_open_inventors_order() {
        let t = Transform {
            translation: DVec3::new(10.0, 0.0, 0.0),
            rotation: AxisAngle::new(DVec3::Z, std::f64::consts::FRAC_PI_2),
            scale_factor: DVec3::new(2.0, 1.0, 1.0),
            center: DVec3::new(1.0, 0.0, 0.0),
            ..Transform::default()
        };
        // (3,0,0) - center = (2,0,0); scaled (4,0,0); turned (0,4,0); + center = (1,4,0); moved (11,4,0).
        let p = t.affine().transform_point3(DVec3::new(3.0, 0.0, 0.0));
        assert!((p - DVec3::new(11.0, 4.0, 0.0)).length() < 1e-12, "{p}");
    }
}
