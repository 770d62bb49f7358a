//! Places in a text.

use crate::scene::Position;

/// Bytes between two known positions.
const STEP: usize = 256;

/// Finds line and column of a byte: a table of known positions, so that a lookup costs the same in a file of one line.
#[derive(Debug)]
pub(super) struct Places<'t> {
    text: &'t str,
    /// Positions of every STEP-th byte.
    known: Vec<Position>,
}

impl<'t> Places<'t> {
    pub(super) fn new(text: &'t str) -> Self {
        let mut position = Position { line: 1, column: 1 };
        let mut known = vec![position];
        for block in text.as_bytes().chunks(STEP) {
            position = after(position, block);
            known.push(position);
        }
        Self { text, known }
    }

    /// Line and column of a byte of the text; beyond the end, those of the end.
    pub(super) fn position(&self, offset: usize) -> Position {
        let offset = offset.min(self.text.len());
        let block = offset / STEP;
        let before = self.known.get(block).copied().unwrap_or(Position { line: 1, column: 1 });
        after(before, self.text.as_bytes().get(block * STEP..offset).unwrap_or_default())
    }
}

/// The position after some bytes: a character counts with its first one, so that they may be cut anywhere.
fn after(before: Position, bytes: &[u8]) -> Position {
    let characters = |bytes: &[u8]| bytes.iter().filter(|&&b| b & 0xc0 != 0x80).count();
    match bytes.iter().rposition(|&b| b == b'\n') {
        None => Position { column: before.column + characters(bytes), ..before },
        Some(last) => {
            let (lines, rest) = bytes.split_at(last);
            let line = before.line + 1 + lines.iter().filter(|&&b| b == b'\n').count();
            // The line break itself makes column 1.
            Position { line, column: characters(rest) }
        }
    }
}

/// A position within a part of a text, seen from the whole: the part starts at `start`.
pub(super) fn within(start: Position, part: Position) -> Position {
    match part.line {
        0 | 1 => Position { line: start.line, column: start.column + part.column.saturating_sub(1) },
        line => Position { line: start.line + line - 1, column: part.column },
    }
}

/// The byte at a position; the end of the text if it is beyond.
pub(super) fn offset(text: &str, Position { line, column }: Position) -> usize {
    let start: usize = text.split_inclusive('\n').take(line.saturating_sub(1)).map(str::len).sum();
    let rest = text.get(start..).unwrap_or_default();
    start + rest.char_indices().nth(column.saturating_sub(1)).map_or(rest.len(), |(at, _)| at)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_count_characters_however_long_the_line() {
        let text = "aü€\n".to_owned() + &"x€".repeat(3000) + "\n!\n\n" + &"ü\n".repeat(999);
        let places = Places::new(&text);
        let mut expected = Position { line: 1, column: 1 };
        for (at, c) in text.char_indices() {
            assert_eq!(places.position(at), expected);
            if at % 101 == 0 || at < 9 {
                assert_eq!(offset(&text, expected), at);
            }
            match c {
                '\n' => expected = Position { line: expected.line + 1, column: 1 },
                _ => expected.column += 1,
            }
        }
        assert_eq!(places.position(text.len()), expected);
        assert_eq!(places.position(usize::MAX), expected);
        assert_eq!(Places::new("").position(0), Position { line: 1, column: 1 });
    }
}
