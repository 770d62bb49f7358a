//! Places in a text.

use crate::scene::Position;

/// Bytes between two known positions.
const STEP: usize = 1024;

/// Finds line and column of a byte: a table of known positions, so that a lookup costs the same in a file of one line.
#[derive(Debug)]
pub(super) struct Places<'t> {
    text: &'t str,
    known: Vec<(usize, Position)>,
}

impl<'t> Places<'t> {
    pub(super) fn new(text: &'t str) -> Self {
        let mut known = Vec::with_capacity(text.len() / STEP + 1);
        let mut position = Position { line: 1, column: 1 };
        for (offset, c) in text.char_indices() {
            if offset >= known.len() * STEP {
                known.push((offset, position));
            }
            advance(&mut position, c);
        }
        Self { text, known }
    }

    /// Line and column of a byte of the text; beyond the end, those of the end.
    pub(super) fn position(&self, offset: usize) -> Position {
        let after = self.known.partition_point(|(known, _)| *known <= offset);
        let (mut at, mut position) = match self.known.get(after.wrapping_sub(1)) {
            Some(&known) => known,
            None => (0, Position { line: 1, column: 1 }),
        };
        for c in self.text.get(at..).unwrap_or_default().chars() {
            if at >= offset {
                break;
            }
            at += c.len_utf8();
            advance(&mut position, c);
        }
        position
    }

    /// Where a part of the text starts in it. The part has to be a slice of the text.
    pub(super) fn offset(&self, part: &str) -> usize {
        (part.as_ptr() as usize).wrapping_sub(self.text.as_ptr() as usize).min(self.text.len())
    }
}

fn advance(position: &mut Position, c: char) {
    if c == '\n' {
        *position = Position { line: position.line + 1, column: 1 };
    } else {
        position.column += 1;
    }
}

/// A position within a part of a text, seen from the whole: the part starts at `start`.
pub(super) fn within(start: Position, part: Position) -> Position {
    match part.line {
        0 | 1 => Position { line: start.line, column: start.column + part.column.saturating_sub(1) },
        line => Position { line: start.line + line - 1, column: part.column },
    }
}

/// The first byte from `from` on that is neither white space nor in a comment.
pub(super) fn skip_blank(text: &str, from: usize) -> usize {
    let mut rest = text.get(from..).unwrap_or_default();
    loop {
        rest = rest.trim_start();
        if let Some(comment) = rest.strip_prefix("//") {
            rest = comment.split_once('\n').map_or("", |(_, after)| after);
        } else if let Some(comment) = rest.strip_prefix("/*") {
            rest = after_block(comment);
        } else {
            return text.len() - rest.len();
        }
    }
}

/// What follows a block comment whose opening was just read. They nest.
fn after_block(mut rest: &str) -> &str {
    let mut level = 1;
    while level > 0 {
        let Some(at) = rest.find(['/', '*']) else { return "" };
        rest = rest.get(at..).unwrap_or_default();
        if let Some(after) = rest.strip_prefix("/*") {
            (level, rest) = (level + 1, after);
        } else if let Some(after) = rest.strip_prefix("*/") {
            (level, rest) = (level - 1, after);
        } else {
            rest = rest.get(1..).unwrap_or_default();
        }
    }
    rest
}

/// How a node's name is followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Payload {
    /// By nothing: no parentheses.
    None,
    /// By parentheses with named fields, or none.
    Named,
    /// By parentheses with values without names.
    Unnamed,
}

/// How what ends at byte `from` goes on.
pub(super) fn payload(text: &str, from: usize) -> Payload {
    let open = skip_blank(text, from);
    if !text.get(open..).is_some_and(|t| t.starts_with('(')) {
        return Payload::None;
    }
    let first = skip_blank(text, open + 1);
    let rest = text.get(first..).unwrap_or_default();
    if let Some((quoted, after)) = rest.strip_prefix('"').and_then(|r| r.split_once('"')) {
        // A field with its name in quotes, which the parser will mark.
        let after = text.len() - after.len();
        let named = !quoted.contains('\\') && text.get(skip_blank(text, after)..).is_some_and(|t| t.starts_with(':'));
        return if named { Payload::Named } else { Payload::Unnamed };
    }
    let word = rest.find(|c: char| !(c.is_alphanumeric() || c == '_' || c == '#')).unwrap_or(rest.len());
    if word == 0 {
        return if rest.is_empty() || rest.starts_with(')') { Payload::Named } else { Payload::Unnamed };
    }
    if rest.starts_with(|c: char| c.is_ascii_digit()) {
        return Payload::Unnamed;
    }
    // A word that is no value by its looks is a field, whose colon the parser will miss if it is not there.
    let after = skip_blank(text, first + word);
    match text.get(after..).and_then(|t| t.chars().next()) {
        Some(',' | ')' | '(' | '"') => Payload::Unnamed,
        _ => Payload::Named,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_count_characters_however_long_the_line() {
        let text = "aü€\n".to_owned() + &"x€".repeat(3000) + "\n!";
        let places = Places::new(&text);
        let mut expected = Position { line: 1, column: 1 };
        for (offset, c) in text.char_indices() {
            assert_eq!(places.position(offset), expected);
            advance(&mut expected, c);
        }
        assert_eq!(places.position(text.len()), expected);
        assert_eq!(places.position(usize::MAX), expected);
        assert_eq!(Places::new("").position(0), Position { line: 1, column: 1 });
    }

    #[test]
    fn blanks_are_white_space_and_comments() {
        for (text, rest) in [
            ("  x", "x"),
            ("// a\n x", "x"),
            ("/* a /* b */ c */x", "x"),
            ("/**/ /* ü */\t// €\nx", "x"),
            ("// open", ""),
            ("/* open", ""),
            ("/x", "/x"),
        ] {
            assert_eq!(&text[skip_blank(text, 0)..], rest, "{text}");
        }
    }

    #[test]
    fn payloads_are_told_apart() {
        for (text, expected) in [
            ("Cube", Payload::None),
            ("Cube, Cube()", Payload::None),
            ("Cube()", Payload::Named),
            ("Cube /* a */ ( // b\n )", Payload::Named),
            ("Cube(width: 1)", Payload::Named),
            ("Cube(width 1)", Payload::Named),
            ("Cube(1.0)", Payload::Unnamed),
            ("Cube([Cube])", Payload::Unnamed),
            ("Cube(Cube())", Payload::Unnamed),
            ("Cube(Plain, 1)", Payload::Unnamed),
            ("Cube(\"a\")", Payload::Unnamed),
            ("Cube(\"a\", 1: 2)", Payload::Unnamed),
            ("Cube(\"a\" : 1)", Payload::Named),
            ("Cube(", Payload::Named),
        ] {
            assert_eq!(payload(text, 4), expected, "{text}");
        }
    }
}
