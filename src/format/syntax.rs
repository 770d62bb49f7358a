//! What the parser's errors mean to somebody who writes a scene.

use ron::Error;

use crate::node::nearest;

/// What was to come where something else stands.
pub(super) const SCENE: &str = "a scene file starts with `Scene(version: 1, root: …)`";
pub(super) const SCENE_FIELDS: &str = "`(` is expected here: `Scene(version: 1, root: …)`";
pub(super) const NODE: &str = "a node is expected here, such as `Cube()`, `Def(\"name\", Cube())` or `Use(\"name\")`";
pub(super) const FIELD: &str = "the name of a field is expected here, as in `width: 2.0`, without quotes";
pub(super) const COLON: &str = "`:` and a value are expected after the name of a field";
pub(super) const COMMA: &str = "`,` or the closing bracket is expected here";
pub(super) const END: &str = "nothing may follow the `)` that closes the scene";
pub(super) const DEF: &str = "Def takes a name and a node: `Def(\"name\", Cube())`";
pub(super) const USE: &str = "Use takes a name: `Use(\"name\")`";
pub(super) const COMMENT: &str = "the comment is not closed: `*/` is missing at its end";
pub(super) const EMPTY: &str = "the file is empty: a scene starts with `Scene(version: 1, root: …)`";

/// A value that is none, in words.
pub(super) fn message(error: &Error) -> String {
    let text = match error {
        Error::ExpectedMapColon => COLON,
        Error::ExpectedComma => COMMA,
        Error::ExpectedStructLikeEnd => "`)` is expected here",
        Error::ExpectedArrayEnd => "`]` is expected here",
        Error::ExpectedArray => "`[` is expected here",
        Error::ExpectedStringEnd => "the string is not closed: `\"` is missing at its end",
        Error::UnclosedBlockComment => COMMENT,
        Error::ExceededRecursionLimit => "the value is nested too deep",
        Error::UnexpectedChar(c) => return format!("the character {c:?} can not stand here"),
        other => return reason(other),
    };
    text.to_owned()
}

/// What is wrong with a value.
pub(super) fn reason(error: &Error) -> String {
    let text = match error {
        Error::ExpectedFloat => "a number is expected here",
        Error::ExpectedInteger => "an integer is expected here",
        Error::IntegerOutOfBounds => "the integer is out of range",
        Error::ExpectedBoolean => "`true` or `false` is expected here",
        Error::ExpectedString => "a string in quotes is expected here",
        Error::ExpectedIdentifier => "one of these words is expected here",
        Error::ExpectedStructLike | Error::ExpectedNamedStructLike(_) => "`(` is expected here",
        Error::ExpectedStructLikeEnd => "there is more in the parentheses than it takes",
        Error::ExpectedComma => "`,` or the closing bracket is expected here",
        Error::TrailingCharacters => "there is more than it takes",
        Error::ExpectedDifferentLength { found, .. } => {
            let s = if *found == 1 { "" } else { "s" };
            return format!("{found} value{s} given");
        }
        Error::NoSuchEnumVariant { expected, found, .. } => {
            return match nearest(found, expected.iter().copied()) {
                Some(near) => format!("`{found}` is none of these, did you mean `{near}`?"),
                None => format!("`{found}` is none of these"),
            };
        }
        other => {
            let text = other.to_string();
            let mut letters = text.chars();
            return letters.next().map_or(String::new(), |first| first.to_lowercase().chain(letters).collect());
        }
    };
    text.to_owned()
}
