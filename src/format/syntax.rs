//! What the parser's errors mean to somebody who writes a scene.

use ron::Error;

use super::error::Problem;
use crate::node::nearest;

/// What was to come when the parser gave up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Expecting {
    Scene,
    Node,
    Field,
    Value,
    Def,
    Use,
}

/// A mistake of syntax in words.
pub(super) fn message(error: &Error, expecting: Expecting) -> String {
    let text = match (error, expecting) {
        (_, Expecting::Scene) if no_word(error) => "a scene file starts with `Scene(version: 1, root: …)`",
        (_, Expecting::Node) if no_word(error) => {
            "a node is expected here, such as `Cube()`, `Def(\"name\", Cube())` or `Use(\"name\")`"
        }
        (_, Expecting::Field) if no_word(error) => {
            "the name of a field is expected here, as in `width: 2.0`, without quotes"
        }
        (Error::ExpectedStructLike, Expecting::Scene) => "`(` is expected here: `Scene(version: 1, root: …)`",
        (_, Expecting::Def | Expecting::Use) if is_shape(error) => return arguments(expecting).to_string(),
        (Error::ExpectedMapColon, _) => "`:` and a value are expected after the name of a field",
        (Error::ExpectedComma, _) => "`,` or the closing bracket is expected here",
        (Error::ExpectedStructLikeEnd, _) => "`)` is expected here",
        (Error::ExpectedArrayEnd, _) => "`]` is expected here",
        (Error::ExpectedStructLike, _) => "`(` is expected here",
        (Error::ExpectedArray, _) => "`[` is expected here",
        (Error::ExpectedStringEnd, _) => "the string is not closed: `\"` is missing at its end",
        (Error::UnclosedBlockComment, _) => "the comment is not closed: `*/` is missing at its end",
        (Error::TrailingCharacters, _) => "nothing may follow the `)` that closes the scene",
        (Error::ExceededRecursionLimit | Error::ExpectedRawValue, _) => "the value is nested too deep",
        (Error::UnexpectedChar(c), _) => return format!("the character {c:?} can not stand here"),
        (other, _) => return reason(other),
    };
    text.to_owned()
}

/// What stands in the parentheses of a Def or Use.
pub(super) fn arguments(word: Expecting) -> Problem {
    let text = match word {
        Expecting::Def => "Def takes a name and a node: `Def(\"name\", Cube())`",
        _ => "Use takes a name: `Use(\"name\")`",
    };
    Problem::Syntax(text.to_owned())
}

/// Whether something else than a word stands where a word should.
fn no_word(error: &Error) -> bool {
    matches!(
        error,
        Error::ExpectedIdentifier
            | Error::InvalidIdentifier(_)
            | Error::SuggestRawIdentifier(_)
            | Error::UnexpectedChar(_)
            | Error::Eof
    )
}

fn is_shape(error: &Error) -> bool {
    matches!(
        error,
        Error::ExpectedStructLike | Error::ExpectedStructLikeEnd | Error::ExpectedComma | Error::ExpectedIdentifier
    )
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
