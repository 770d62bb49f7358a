//! The types that fields of nodes may have, and how they are read and written.

use std::fmt::Debug;
use std::ops::Deref;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3, Vec3};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

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
        let value: Self = parse(text)?;
        if value.is_finite() { Ok(value) } else { Err(FieldError::NotFinite) }
    }

    /// The value as RON on one line.
    fn write(&self) -> String {
        compact(self)
    }
}

fn parse<T: DeserializeOwned>(text: &str) -> Result<T, FieldError> {
    options().from_str(text).map_err(|e| FieldError::Syntax(Box::new(e)))
}

/// RON on one line.
fn compact(value: &impl Serialize) -> String {
    let config = ron::ser::PrettyConfig::new()
        .compact_arrays(true)
        .compact_structs(true)
        .separate_tuple_members(false)
        .depth_limit(0);
    // Fields are numbers, strings and enums of these: they always have a RON form.
    options().to_string_pretty(value, config).unwrap_or_default()
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
    Plane: "plane (x, y, z, distance)", |v| v.normal.is_finite() && v.distance.is_finite();
    Matrix: "matrix ((xx, xy, xz), (yx, yy, yz), (zx, zy, zz), (x, y, z)): images of the axes and of the origin", |v| v.0.is_finite();
}

/// As in Open Inventor, a list of one may be written without its brackets, and is.
impl<T: FieldValue> FieldValue for List<T> {
    fn type_name() -> String {
        format!("[{}, …] or one without brackets", T::type_name())
    }

    fn is_finite(&self) -> bool {
        self.iter().all(T::is_finite)
    }

    fn read(text: &str) -> Result<Self, FieldError> {
        if !past_comments(text).starts_with('[') {
            return T::read(text).map(|one| [one].into());
        }
        let list: Self = parse(text)?;
        if list.is_finite() { Ok(list) } else { Err(FieldError::NotFinite) }
    }

    fn write(&self) -> String {
        match &**self {
            [one] => one.write(),
            _ => compact(self),
        }
    }
}

/// What of a text in RON comes after blanks and comments.
fn past_comments(text: &str) -> &str {
    let mut rest = text.trim_start();
    loop {
        let after = if let Some(line) = rest.strip_prefix("//") {
            line.split_once('\n').map_or("", |(_, after)| after)
        } else if let Some(mut block) = rest.strip_prefix("/*") {
            // They nest.
            let mut depth = 1;
            while depth > 0 {
                let Some(mark) = block.find(['*', '/']) else { return "" };
                let here = block.get(mark..).unwrap_or_default();
                let (step, change) = match () {
                    () if here.starts_with("*/") => (2, -1),
                    () if here.starts_with("/*") => (2, 1),
                    () => (1, 0),
                };
                depth += change;
                block = here.get(step..).unwrap_or_default();
            }
            block
        } else {
            return rest;
        };
        rest = after.trim_start();
    }
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

/// A list in a field, shared: copies of a node, the State of a walk and what was made from the list hold the same one, so
/// that a copy costs nothing and identity tells whether what was made is current.
///
/// # Example
///
/// ```
/// use seamount::node::List;
///
/// let mut numbers = List::from([1, 2, 3]);
/// let copy = numbers.clone();
/// assert!(numbers.same(&copy));
/// numbers.make_mut()[0] = 7; // the copy keeps its own
/// assert_eq!((numbers[0], copy[0]), (7, 1));
/// ```
#[derive(Debug, Clone)]
pub struct List<T>(Option<Arc<[T]>>);

impl<T> List<T> {
    /// Whether both are one list in memory, not only equal ones.
    #[must_use]
    pub fn same(&self, other: &Self) -> bool {
        match (&self.0, &other.0) {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            (a, b) => a.is_none() && b.is_none(),
        }
    }
}

impl<T: Clone> List<T> {
    /// The elements to change; copied first where the list is shared.
    pub fn make_mut(&mut self) -> &mut [T] {
        self.0.as_mut().map_or(&mut [], Arc::make_mut)
    }
}

impl<T> Default for List<T> {
    fn default() -> Self {
        Self(None)
    }
}

impl<T> Deref for List<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        self.0.as_deref().unwrap_or_default()
    }
}

impl<T: PartialEq> PartialEq for List<T> {
    fn eq(&self, other: &Self) -> bool {
        self.same(other) || **self == **other
    }
}

impl<T> From<Vec<T>> for List<T> {
    fn from(list: Vec<T>) -> Self {
        // All empty lists are the same one.
        Self((!list.is_empty()).then(|| list.into()))
    }
}

impl<T, const N: usize> From<[T; N]> for List<T> {
    fn from(list: [T; N]) -> Self {
        Vec::from(list).into()
    }
}

/// Lists of one value, which Open Inventor's fields of several values take as well. One impl for all types would leave it open
/// what an array is made into.
macro_rules! list_of_one {
    ($($ty:ty)*) => {$(
        impl From<$ty> for List<$ty> {
            fn from(one: $ty) -> Self {
                [one].into()
            }
        }
    )*};
}

list_of_one!(Color f32 String);

impl From<&str> for List<String> {
    fn from(one: &str) -> Self {
        [one.to_owned()].into()
    }
}

impl<T> FromIterator<T> for List<T> {
    fn from_iter<I: IntoIterator<Item = T>>(list: I) -> Self {
        Vec::from_iter(list).into()
    }
}

impl<T: Serialize> Serialize for List<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.iter())
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for List<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Vec::deserialize(deserializer).map(Self::from)
    }
}

/// A plane as Open Inventor writes it: the points p with normal · p = distance. Its inner side is where the normal points.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(from = "(f64, f64, f64, f64)", into = "(f64, f64, f64, f64)")]
pub struct Plane {
    /// The normal, any length but zero.
    pub normal: DVec3,
    /// Distance of the plane from the origin along the normal's direction, local units.
    pub distance: f64,
}

impl From<(f64, f64, f64, f64)> for Plane {
    fn from((x, y, z, distance): (f64, f64, f64, f64)) -> Self {
        Self { normal: DVec3::new(x, y, z), distance }
    }
}

impl From<Plane> for (f64, f64, f64, f64) {
    fn from(p: Plane) -> Self {
        (p.normal.x, p.normal.y, p.normal.z, p.distance)
    }
}

/// An affine map in a field: the images of the three axes, then that of the origin. These are the rows of Open Inventor's
/// matrices without their last column, and the columns of glam's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(from = "(DVec3, DVec3, DVec3, DVec3)", into = "(DVec3, DVec3, DVec3, DVec3)")]
pub struct Matrix(pub DAffine3);

impl Matrix {
    /// The map that changes nothing.
    pub const IDENTITY: Matrix = Matrix(DAffine3::IDENTITY);
}

impl From<(DVec3, DVec3, DVec3, DVec3)> for Matrix {
    fn from((x, y, z, translation): (DVec3, DVec3, DVec3, DVec3)) -> Self {
        Self(DAffine3 { matrix3: DMat3::from_cols(x, y, z), translation })
    }
}

impl From<Matrix> for (DVec3, DVec3, DVec3, DVec3) {
    fn from(Matrix(m): Matrix) -> Self {
        (m.matrix3.x_axis, m.matrix3.y_axis, m.matrix3.z_axis, m.translation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_one_need_no_brackets() {
        let one = List::from(Color::new(1.0, 0.0, 0.5));
        for text in ["(1.0, 0.0, 0.5)", "[(1, 0, 0.5)]", " /* [ /* */ */ // [\n (1, 0, 0.5)", "/*[*/[(1, 0, 0.5),]"] {
            assert_eq!(List::<Color>::read(text), Ok(one.clone()), "{text}");
        }
        assert_eq!(one.write(), "(1.0, 0.0, 0.5)");
        let three = List::from([1, 2, 3]);
        assert_eq!((List::read("[1, 2, 3]"), three.write().as_str()), (Ok(three.clone()), "[1, 2, 3]"));
        let none = List::<i32>::default();
        assert_eq!((List::read("[]"), none.write().as_str()), (Ok(none.clone()), "[]"));
        for text in ["", "/*", "/* *", "//", "[1", "x"] {
            assert!(List::<i32>::read(text).is_err(), "{text}");
        }
    }
}
