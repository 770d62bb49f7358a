//! The types that fields of nodes may have, and how they are read and written.

use std::fmt::Debug;
use std::ops::Deref;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3, Vec3};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::Plain;

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

    /// Reads a value from the start of a text where it is written plainly; `None` leaves it to RON, and is always right. For
    /// speed alone: what is read here has to be what RON reads.
    fn plain(text: &mut Plain<'_>) -> Option<Self> {
        let _ = text;
        None
    }

    /// Reads a value from its text in RON.
    ///
    /// # Errors
    ///
    /// When the text is not such a value, or a number in it is not finite.
    fn read(text: &str) -> Result<Self, FieldError> {
        read_value(text)
    }

    /// Appends the value as RON on one line.
    fn append(&self, text: &mut String) {
        text.push_str(&in_ron(self));
    }

    /// The value as RON on one line.
    fn write(&self) -> String {
        let mut text = String::new();
        self.append(&mut text);
        text
    }
}

/// A value from its text: the quick way, or that of ron.
fn read_value<T: FieldValue>(text: &str) -> Result<T, FieldError> {
    let mut plain = Plain::new(text);
    let value = match T::plain(&mut plain).filter(|_| plain.is_at_end()) {
        Some(value) => value,
        None => options().from_str(text).map_err(|e| FieldError::Syntax(Box::new(e)))?,
    };
    if value.is_finite() { Ok(value) } else { Err(FieldError::NotFinite) }
}

/// A value as ron writes it.
fn in_ron<T: Serialize>(value: &T) -> String {
    let config = ron::ser::PrettyConfig::new()
        .compact_arrays(true)
        .compact_structs(true)
        .separate_tuple_members(false)
        .depth_limit(0);
    // Fields are numbers, strings and enums of these: they always have a RON form.
    options().to_string_pretty(value, config).unwrap_or_default()
}

/// Appends values with commas between them.
fn append_all<'v, T: FieldValue + 'v>(values: impl IntoIterator<Item = &'v T>, brackets: [char; 2], text: &mut String) {
    text.push(brackets[0]);
    for (k, value) in values.into_iter().enumerate() {
        if k > 0 {
            text.push_str(", ");
        }
        value.append(text);
    }
    text.push(brackets[1]);
}

/// RON as Seamount reads it: `Some` may be left out.
fn options() -> ron::Options {
    ron::Options::default().with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME)
}

macro_rules! plain_fields {
    ($($ty:ty: $name:expr, $finite:expr, $plain:expr, $append:expr;)*) => {$(
        impl FieldValue for $ty {
            fn type_name() -> String {
                $name.to_owned()
            }

            fn is_finite(&self) -> bool {
                let finite: fn(&$ty) -> bool = $finite;
                finite(self)
            }

            fn plain(text: &mut Plain<'_>) -> Option<Self> {
                let plain: fn(&mut Plain<'_>) -> Option<$ty> = $plain;
                plain(text)
            }

            fn append(&self, text: &mut String) {
                let append: fn(&$ty, &mut String) = $append;
                append(self, text);
            }
        }
    )*};
}

/// Writes what is written as Rust writes it.
fn debug<T: Debug>(value: &T, text: &mut String) {
    use std::fmt::Write;
    // A string takes all that is written to it.
    let _ = write!(text, "{value:?}");
}

/// Writes numbers in parentheses.
fn tuple<T: FieldValue, const N: usize>(values: [T; N], text: &mut String) {
    append_all(&values, ['(', ')'], text);
}

/// Writes a string in quotes.
fn quoted(value: &str, text: &mut String) {
    // What has no escape in ron.
    let plain = |b: u8| matches!(b, b' '..=b'~') && !matches!(b, b'"' | b'\\' | b'\'');
    if value.bytes().all(plain) {
        text.push('"');
        text.push_str(value);
        text.push('"');
    } else {
        text.push_str(&in_ron(&value));
    }
}

plain_fields! {
    f64: "number", |v| f64::is_finite(*v), |t| t.number(), debug;
    f32: "number", |v| f32::is_finite(*v), |t| t.number(), debug;
    bool: "bool", |_| true, |t| t.word()?.parse().ok(), debug;
    u8: "integer", |_| true, |t| t.number(), debug;
    u32: "integer", |_| true, |t| t.number(), debug;
    i32: "integer", |_| true, |t| t.number(), debug;
    String: "string", |_| true, |t| t.string().map(str::to_owned), |v, text| quoted(v, text);
    DVec2: "(x, y)", |v| DVec2::is_finite(*v), |t| t.numbers().map(DVec2::from_array), |v, text| tuple(v.to_array(), text);
    DVec3: "(x, y, z)", |v| DVec3::is_finite(*v), |t| t.numbers().map(DVec3::from_array), |v, text| tuple(v.to_array(), text);
    Color: "color (r, g, b)", |v| v.rgb().is_finite(), |t| t.numbers().map(|[r, g, b]| Color { r, g, b }),
        |v, text| tuple([v.r, v.g, v.b], text);
    AxisAngle: "rotation (x, y, z, angle)", |v| v.axis.is_finite() && v.angle.is_finite(),
        |t| t.numbers().map(|[x, y, z, angle]| (x, y, z, angle).into()),
        |v, text| tuple([v.axis.x, v.axis.y, v.axis.z, v.angle], text);
    (u32, u32): "(integer, integer)", |_| true, |t| t.numbers().map(|[a, b]| (a, b)), |v, text| tuple([v.0, v.1], text);
    Plane: "plane (x, y, z, distance)", |v| v.normal.is_finite() && v.distance.is_finite(),
        |t| t.numbers().map(|[x, y, z, distance]| (x, y, z, distance).into()),
        |v, text| tuple([v.normal.x, v.normal.y, v.normal.z, v.distance], text);
    Matrix: "matrix ((xx, xy, xz), (yx, yy, yz), (zx, zy, zz), (x, y, z)): images of the axes and of the origin",
        |v| v.0.is_finite(),
        |t| t.array(|t| t.numbers().map(DVec3::from_array)).map(|[x, y, z, origin]| (x, y, z, origin).into()),
        |v, text| {
            let (x, y, z, origin) = (*v).into();
            tuple([x, y, z, origin], text);
        };
}

/// As in Open Inventor, a list of one may be written without its brackets, and is.
impl<T: FieldValue> FieldValue for List<T> {
    fn type_name() -> String {
        format!("[{}, …] or one without brackets", T::type_name())
    }

    fn is_finite(&self) -> bool {
        self.iter().all(T::is_finite)
    }

    fn plain(text: &mut Plain<'_>) -> Option<Self> {
        text.list(T::plain).map(Self::from)
    }

    fn read(text: &str) -> Result<Self, FieldError> {
        if past_comments(text).starts_with('[') { read_value(text) } else { T::read(text).map(|one| [one].into()) }
    }

    fn append(&self, text: &mut String) {
        match &**self {
            [one] => one.append(text),
            all => append_all(all, ['[', ']'], text),
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

    fn plain(text: &mut Plain<'_>) -> Option<Self> {
        let mut after = text.clone();
        if after.word() == Some("None") {
            *text = after;
            return Some(None);
        }
        T::plain(text).map(Some)
    }

    fn append(&self, text: &mut String) {
        match self {
            Some(value) => value.append(text),
            None => text.push_str("None"),
        }
    }
}

/// Implements [`FieldValue`] for an enum of plain words that derives serde's traits.
macro_rules! enum_field {
    ($ty:ty: $($variant:ident)|+) => {
        impl $crate::node::FieldValue for $ty {
            fn type_name() -> String {
                [$(stringify!($variant)),+].join(" | ")
            }

            fn plain(text: &mut $crate::node::Plain<'_>) -> Option<Self> {
                match text.word()? {
                    $(stringify!($variant) => Some(Self::$variant),)+
                    _ => None,
                }
            }

            fn append(&self, text: &mut String) {
                text.push_str(match self {
                    $(Self::$variant => stringify!($variant),)+
                });
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
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn lists_of_one_need_no_brackets() {
        let one = List::from(Color::new(1.0, 0.0, 0.5));
        for text in ["(1.0, 0.0, 0.5)", "[(1, 0, 0.5)]", " /* [ /* */ */ // [\n (1, 0, 0.5)", "/*[*/[(1, 0, 0.5),]"] {
            assert_eq!(List::<Color>::read(text), Ok(one.clone()), "{text}");
        }
        assert_eq!(one.write(), "(1.0, 0.0, 0.5)");
        for text in ["", "/*", "/* *", "//", "[1", "x"] {
            assert!(List::<i32>::read(text).is_err(), "{text}");
        }
    }

    /// What is written and read for speed is what ron writes and reads, to the bit.
    fn agrees<T: FieldValue>(value: T) {
        let text = value.write();
        // But for the mark that a word is a name, which ron puts before its own words and does without when reading.
        assert_eq!(text, in_ron(&value).trim_start_matches("r#"));
        let mut plain = Plain::new(&text);
        let ron: T = options().from_str(&text).unwrap();
        if let Some(read) = T::plain(&mut plain).filter(|_| plain.is_at_end()) {
            assert_eq!(format!("{read:?}"), format!("{ron:?}"), "{text}");
        } else {
            assert!(!value.is_finite() || text.contains(['\\', '\'']), "{text}");
        }
        assert_eq!(format!("{ron:?}"), format!("{value:?}"));
    }

    #[test]
    fn words_and_options_are_as_ron_has_them() {
        agrees(true);
        agrees(Some(false));
        agrees(None::<f64>);
        agrees(Some(DVec2::new(-0.0, 1e300)));
        agrees(Some("None".to_owned()));
        agrees(List::from([Some(1.0), None]));
        agrees(List::<i32>::default());
        agrees(super::super::FogType::None);
        agrees(super::super::Length::Yards);
        agrees(f64::NAN);
        agrees(-f64::INFINITY);
    }

    proptest! {
        #[test]
        fn numbers_and_strings_are_as_ron_has_them(
            a in any::<[f64; 3]>(), b in any::<[f32; 3]>(), c in any::<[i32; 2]>(), d in any::<u32>(), e in any::<u8>(),
            s in any::<String>(), n in 2..5_usize,
        ) {
            let v = DVec3::from_array(a);
            agrees(a[0]);
            agrees(b[0]);
            agrees(c[0]);
            agrees(d);
            agrees(e);
            agrees(s);
            agrees(v);
            agrees(DVec2::new(a[0], a[1]));
            agrees(Color::new(b[0], b[1], b[2]));
            agrees(AxisAngle::new(v, a[1]));
            agrees((d, u32::from(e)));
            agrees(Plane { normal: v, distance: a[2] });
            agrees(Matrix(DAffine3 { matrix3: DMat3::from_cols(v, -v, v * 2.0), translation: v }));
            agrees(List::from(vec![v; n]));
            agrees(List::from(vec![c[1]; n]));
        }

        /// Whatever the text, the fast way reads what ron reads or leaves it alone.
        #[test]
        fn any_text_is_as_ron_has_it(text in "[-+.eE_0-9 ()\\[\\],/*axfNoneSm\"]{0,12}") {
            fn same<T: FieldValue>(text: &str) {
                let mut plain = Plain::new(text);
                if let Some(value) = T::plain(&mut plain).filter(|_| plain.is_at_end()) {
                    let ron = options().from_str::<T>(text).map(|v| format!("{v:?}"));
                    assert_eq!(ron, Ok(format!("{value:?}")), "{text}");
                }
            }
            same::<f64>(&text);
            same::<f32>(&text);
            same::<i32>(&text);
            same::<u32>(&text);
            same::<u8>(&text);
            same::<DVec2>(&text);
            same::<Option<f64>>(&text);
            same::<List<f64>>(&text);
            same::<List<i32>>(&text);
            same::<String>(&text);
        }
    }
}
