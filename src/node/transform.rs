use glam::{DAffine3, DMat3, DQuat, DVec3};
use serde::{Deserialize, Serialize};

use super::{AxisAngle, Matrix, PropertyNode, field::enum_field};
use crate::action::{PropertyContext, State};

crate::define_node! {
    /// Moves, turns and scales what follows.
    ///
    /// Applied to a point in this order: move `center` to the origin, turn by the inverse of `scale_orientation`, scale by
    /// `scale_factor`, turn by `scale_orientation`, turn by `rotation`, move back by `center`, move by `translation`
    /// (Open Inventor's order). All actions apply it.
    ///
    /// ```ron
    /// Transform(translation: (10.0, 0.0, 0.0), rotation: (0.0, 0.0, 1.0, 0.5))
    /// ```
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
    actions {
        Render, BoundingBox, RayPick, HandleEvent, Matrix, Callback: "place what follows by it";
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

crate::define_node! {
    /// Moves what follows. All actions apply it.
    ///
    /// ```ron
    /// Translation(translation: (10.0, 0.0, 0.0))
    /// ```
    pub struct Translation: property {
        /// Moved by this much, in local units.
        pub translation: DVec3 = DVec3::ZERO,
    }
    actions {
        Render, BoundingBox, RayPick, HandleEvent, Matrix, Callback: "place what follows by it";
    }
}

impl PropertyNode for Translation {
    fn apply(&self, state: &mut State, _: &PropertyContext<'_>) {
        state.translate(self.translation);
    }
}

crate::define_node! {
    /// Turns what follows about an axis through the origin. All actions apply it.
    ///
    /// ```ron
    /// Rotation(rotation: (0.0, 0.0, 1.0, 1.5708))
    /// ```
    pub struct Rotation: property {
        /// Axis and angle in radians, counter-clockwise seen against the axis.
        pub rotation: AxisAngle = AxisAngle::IDENTITY,
    }
    actions {
        Render, BoundingBox, RayPick, HandleEvent, Matrix, Callback: "place what follows by it";
    }
}

impl PropertyNode for Rotation {
    fn apply(&self, state: &mut State, _: &PropertyContext<'_>) {
        state.transform(&DAffine3::from_quat(self.rotation.quat()));
    }
}

/// One of the three axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum Axis {
    /// The first.
    #[default]
    X,
    /// The second.
    Y,
    /// The third.
    Z,
}

enum_field!(Axis: X | Y | Z);

crate::define_node! {
    /// Turns what follows about one of the axes. All actions apply it.
    ///
    /// ```ron
    /// RotationXyz(axis: Z, angle: 1.5708)
    /// ```
    pub struct RotationXyz: property {
        /// The angle in radians, counter-clockwise seen against the axis.
        pub angle: f64 = 0.0,
        /// The axis.
        pub axis: Axis = Axis::X,
    }
    actions {
        Render, BoundingBox, RayPick, HandleEvent, Matrix, Callback: "place what follows by it";
    }
}

impl PropertyNode for RotationXyz {
    fn apply(&self, state: &mut State, _: &PropertyContext<'_>) {
        let turn = match self.axis {
            Axis::X => DQuat::from_rotation_x,
            Axis::Y => DQuat::from_rotation_y,
            Axis::Z => DQuat::from_rotation_z,
        };
        state.transform(&DAffine3::from_quat(turn(self.angle)));
    }
}

crate::define_node! {
    /// Scales what follows along the axes. All actions apply it. What is scaled by zero is flat: it is boxed, not picked.
    ///
    /// ```ron
    /// Scale(scale_factor: (1.0, 1.0, 2.0))
    /// ```
    pub struct Scale: property {
        /// The factors; negative ones mirror.
        pub scale_factor: DVec3 = DVec3::ONE,
    }
    actions {
        Render, BoundingBox, RayPick, HandleEvent, Matrix, Callback: "place what follows by it";
    }
}

impl PropertyNode for Scale {
    fn apply(&self, state: &mut State, _: &PropertyContext<'_>) {
        state.transform(&DAffine3::from_scale(self.scale_factor));
    }
}

crate::define_node! {
    /// Transforms what follows by a matrix. All actions apply it.
    ///
    /// ```ron
    /// MatrixTransform(matrix: ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.5, 0.0, 1.0), (0.0, 0.0, 0.0)))
    /// ```
    pub struct MatrixTransform: property {
        /// From local coordinates to those of the parent: the images of the three axes and of the origin, the rows of an Open
        /// Inventor matrix.
        pub matrix: Matrix = Matrix::IDENTITY,
    }
    actions {
        Render, BoundingBox, RayPick, HandleEvent, Matrix, Callback: "place what follows by it";
    }
}

impl PropertyNode for MatrixTransform {
    fn apply(&self, state: &mut State, _: &PropertyContext<'_>) {
        state.transform(&self.matrix.0);
    }
}

/// What a [`ResetTransform`] forgets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum Reset {
    /// The transforms.
    #[default]
    Transform,
    /// The box so far.
    BoundingBox,
    /// Both.
    Both,
}

enum_field!(Reset: Transform | BoundingBox | Both);

crate::define_node! {
    /// Forgets the transforms before it: what follows is in the coordinates of the world, up to the end of the separator.
    ///
    /// All actions reset transforms and units; the bounding box action forgets the shapes before this node where it says so.
    ///
    /// ```ron
    /// ResetTransform(what_to_reset: Both)
    /// ```
    pub struct ResetTransform: property {
        /// What is forgotten.
        pub what_to_reset: Reset = Reset::Transform,
    }
    actions {
        Render, RayPick, HandleEvent, Matrix, Callback: "place what follows as if no transform stood before it";
        BoundingBox: "does the same, or forgets what was boxed so far, or both";
    }
}

impl PropertyNode for ResetTransform {
    fn apply(&self, state: &mut State, _: &PropertyContext<'_>) {
        if self.what_to_reset != Reset::BoundingBox {
            state.model = DAffine3::IDENTITY;
            state.unit_length = 1.0;
        }
    }
}

/// Units of length, with Open Inventor's names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[allow(missing_docs, reason = "the names say it")]
pub enum Length {
    #[default]
    Meters,
    Centimeters,
    Millimeters,
    Micrometers,
    /// The same as micrometres.
    Microns,
    Nanometers,
    Angstroms,
    Kilometers,
    Feet,
    Inches,
    /// 1/72 of an inch.
    Points,
    Yards,
    Miles,
    NauticalMiles,
}

enum_field!(Length: Meters | Centimeters | Millimeters | Micrometers | Microns | Nanometers | Angstroms | Kilometers
    | Feet | Inches | Points | Yards | Miles | NauticalMiles);

impl Length {
    /// How many metres it is: the international yard and pound agreement (1959) and the definition of the nautical mile
    /// (1929).
    ///
    /// ```
    /// assert_eq!(seamount::node::Length::Miles.meters(), 1609.344);
    /// ```
    #[must_use]
    pub fn meters(self) -> f64 {
        match self {
            Length::Meters => 1.0,
            Length::Centimeters => 1e-2,
            Length::Millimeters => 1e-3,
            Length::Micrometers | Length::Microns => 1e-6,
            Length::Nanometers => 1e-9,
            Length::Angstroms => 1e-10,
            Length::Kilometers => 1e3,
            Length::Feet => 0.3048,
            Length::Inches => 0.0254,
            Length::Points => 0.0254 / 72.0,
            Length::Yards => 0.9144,
            Length::Miles => 1609.344,
            Length::NauticalMiles => 1852.0,
        }
    }
}

crate::define_node! {
    /// Says in which units what follows is given; the world is in metres. All actions scale by it.
    ///
    /// Units do not add up: after feet, metres are metres again.
    ///
    /// ```ron
    /// Units(units: Feet)
    /// ```
    pub struct Units: property {
        /// The unit of lengths.
        pub units: Length = Length::Meters,
    }
    actions {
        Render, BoundingBox, RayPick, HandleEvent, Matrix, Callback: "measure what follows in this length";
    }
}

impl PropertyNode for Units {
    fn apply(&self, state: &mut State, _: &PropertyContext<'_>) {
        let length = self.units.meters();
        if length != state.unit_length {
            state.transform(&DAffine3::from_scale(DVec3::splat(length / state.unit_length)));
            state.unit_length = length;
        }
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
