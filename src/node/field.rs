//! The types that fields of nodes may have, and how they are read and written.

use std::fmt::Debug;

use glam::{DQuat, DVec2, DVec3, Vec3};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// Why the text of a field could not be used.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum FieldError {
    /// It is not of the field's type; the error has its position within the text.
    Syntax(Box<ron::error::SpannedError>),
    /// A number is NaN or too large.
    NotFinite,
}

/// A type that a field of a node may have: any serde type with a name.
pub trait FieldValue: Clone + PartialEq + Debug + Serialize + DeserializeOwned {
    /// What a reader of scene files calls the type.
    fn type_name() -> String;

    /// Whether all numbers in it are finite. RON reads `NaN` and `1e400` without complaint; no field takes them.
    fn is_finite(&self) -> bool {
        true
    }

    /// Reads a value from its text in RON.
    ///
    /// # Errors
    ///
    /// When the text is not such a value, or a number in it is not finite.
    fn read(text: &str) -> Result<Self, FieldError> {
        let value: Self = options().from_str(text).map_err(|e| FieldError::Syntax(Box::new(e)))?;
        if value.is_finite() { Ok(value) } else { Err(FieldError::NotFinite) }
    }

    /// The value as RON on one line.
    fn write(&self) -> String {
        let config = ron::ser::PrettyConfig::new()
            .compact_arrays(true)
            .compact_structs(true)
            .separate_tuple_members(false)
            .depth_limit(0);
        // Fields are numbers, strings and enums of these: they always have a RON form.
        options().to_string_pretty(self, config).unwrap_or_default()
    }
}

/// RON as Seamount reads it: `Some` may be left out.
fn options() -> ron::Options {
    ron::Options::default().with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME)
}

macro_rules! plain_fields {
    ($($ty:ty: $name:expr, $finite:expr;)*) => {$(
        impl FieldValue for $ty {
            fn type_name() -> String {
                $name.to_owned()
            }

            fn is_finite(&self) -> bool {
                let finite: fn(&$ty) -> bool = $finite;
                finite(self)
            }
        }
    )*};
}

plain_fields! {
    f64: "number", |v| f64::is_finite(*v);
    f32: "number", |v| f32::is_finite(*v);
    bool: "bool", |_| true;
    u8: "integer", |_| true;
    u32: "integer", |_| true;
    i32: "integer", |_| true;
    String: "string", |_| true;
    DVec2: "(x, y)", |v| DVec2::is_finite(*v);
    DVec3: "(x, y, z)", |v| DVec3::is_finite(*v);
    Color: "color (r, g, b)", |v| v.rgb().is_finite();
    AxisAngle: "rotation (x, y, z, angle)", |v| v.axis.is_finite() && v.angle.is_finite();
    (u32, u32): "(integer, integer)", |_| true;
}

impl<T: FieldValue> FieldValue for Option<T> {
    fn type_name() -> String {
        format!("{} or None", T::type_name())
    }

    fn is_finite(&self) -> bool {
        self.as_ref().is_none_or(T::is_finite)
    }
}

/// Implements [`FieldValue`] for an enum of plain words that derives serde's traits.
macro_rules! enum_field {
    ($ty:ty: $($variant:ident)|+) => {
        impl $crate::node::FieldValue for $ty {
            fn type_name() -> String {
                [$(stringify!($variant)),+].join(" | ")
            }
        }
    };
}
pub(crate) use enum_field;

/// A colour as people pick them: sRGB components, 0..1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(from = "(f32, f32, f32)", into = "(f32, f32, f32)")]
pub struct Color {
    /// Red.
    pub r: f32,
    /// Green.
    pub g: f32,
    /// Blue.
    pub b: f32,
}

impl Color {
    /// Black.
    pub const BLACK: Color = Color::new(0.0, 0.0, 0.0);
    /// White.
    pub const WHITE: Color = Color::new(1.0, 1.0, 1.0);

    /// A colour from its sRGB components.
    #[must_use]
    pub const fn new(r: f32, g: f32, b: f32) -> Self {
        Self { r, g, b }
    }

    /// The components as a vector, sRGB.
    #[must_use]
    pub fn rgb(self) -> Vec3 {
        Vec3::new(self.r, self.g, self.b)
    }

    /// The components decoded to linear light.
    #[must_use]
    pub fn linear(self) -> Vec3 {
        crate::action::linear_color(self.rgb())
    }
}

impl From<(f32, f32, f32)> for Color {
    fn from((r, g, b): (f32, f32, f32)) -> Self {
        Self { r, g, b }
    }
}

impl From<Color> for (f32, f32, f32) {
    fn from(c: Color) -> Self {
        (c.r, c.g, c.b)
    }
}

/// A rotation as Open Inventor writes it: an axis and an angle in radians, counter-clockwise seen against the axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(from = "(f64, f64, f64, f64)", into = "(f64, f64, f64, f64)")]
pub struct AxisAngle {
    /// The axis, any length; a zero axis means no rotation.
    pub axis: DVec3,
    /// The angle in radians.
    pub angle: f64,
}

impl AxisAngle {
    /// No rotation.
    pub const IDENTITY: AxisAngle = AxisAngle { axis: DVec3::Z, angle: 0.0 };

    /// A rotation about an axis of any length by an angle in radians.
    #[must_use]
    pub const fn new(axis: DVec3, angle: f64) -> Self {
        Self { axis, angle }
    }

    /// The rotation as a unit quaternion.
    #[must_use]
    pub fn quat(self) -> DQuat {
        // Scaling by the largest component first keeps the length of tiny and huge axes from under- and overflowing.
        let scale = self.axis.abs().max_element();
        if scale == 0.0 || !scale.is_finite() {
            return DQuat::IDENTITY;
        }
        DQuat::from_axis_angle((self.axis / scale).normalize(), self.angle)
    }
}

impl From<(f64, f64, f64, f64)> for AxisAngle {
    fn from((x, y, z, angle): (f64, f64, f64, f64)) -> Self {
        Self { axis: DVec3::new(x, y, z), angle }
    }
}

impl From<AxisAngle> for (f64, f64, f64, f64) {
    fn from(r: AxisAngle) -> Self {
        (r.axis.x, r.axis.y, r.axis.z, r.angle)
    }
}
