//! Blanks, words and brackets of a text, found without a grammar.

/// What stands between words: white space as RON has it, and comments.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Blank {
    /// The first byte that is neither white space nor in a comment.
    pub(super) end: usize,
    /// Whether all block comments are closed; otherwise the text ends in one.
    pub(super) closed: bool,
}

/// The blank that starts at a byte; empty if there is none.
pub(super) fn blank(text: &str, from: usize) -> Blank {
    let bytes = text.as_bytes();
    let mut end = from;
    while let Some(&byte) = bytes.get(end) {
        match byte {
            b' ' | b'\n' | b'\r' | b'\t' | 0x0b | 0x0c => end += 1,
            b'/' if bytes.get(end + 1) == Some(&b'/') => {
                let comment = bytes.get(end..).unwrap_or_default();
                end += comment.iter().position(|&b| b == b'\n').unwrap_or(comment.len());
            }
            b'/' if bytes.get(end + 1) == Some(&b'*') => match after_block(bytes, end + 2) {
                Some(after) => end = after,
                None => return Blank { end: bytes.len(), closed: false },
            },
            0x80.. => match text.get(end..).and_then(|rest| rest.chars().next()) {
                Some(c @ ('\u{85}' | '\u{200E}' | '\u{200F}' | '\u{2028}' | '\u{2029}')) => end += c.len_utf8(),
                _ => break,
            },
            _ => break,
        }
    }
    Blank { end, closed: true }
}

/// The first byte after blanks, from a byte on.
pub(super) fn skip_blank(text: &str, from: usize) -> usize {
    blank(text, from).end
}

/// What follows a block comment whose opening ends at a byte. They nest.
fn after_block(bytes: &[u8], from: usize) -> Option<usize> {
    let (mut at, mut level) = (from, 1);
    while level > 0 {
        at += bytes.get(at..)?.iter().position(|b| matches!(b, b'/' | b'*'))?;
        match bytes.get(at..at + 2)? {
            b"/*" => (at, level) = (at + 2, level + 1),
            b"*/" => (at, level) = (at + 2, level - 1),
            _ => at += 1,
        }
    }
    Some(at)
}

/// The word that starts at a byte, without the `r#` of a raw one; none if something else stands there, such as a number or
/// the `r` of a raw string.
pub(super) fn word(text: &str, from: usize) -> Option<&str> {
    let rest = text.get(from..)?;
    let length = |rest: &str| {
        let bytes = rest.as_bytes();
        let plain = bytes.iter().position(|b| !(b.is_ascii_alphanumeric() || *b == b'_')).unwrap_or(bytes.len());
        match bytes.get(plain) {
            Some(0x80..) => rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len()),
            _ => plain,
        }
    };
    if rest.starts_with(|c: char| c.is_numeric()) {
        return None;
    }
    let word = rest.get(..length(rest)).filter(|word| !word.is_empty())?;
    match rest.get(word.len()..).and_then(|after| after.chars().next()) {
        Some('#') if word == "r" => {
            let raw = rest.get(2..)?;
            raw.get(..length(raw)).filter(|word| !word.is_empty())
        }
        Some('"' | '\'') => None,
        _ => Some(word),
    }
}

/// Where a value ends that starts at a byte: at the comma or closing bracket after it. None if its end can not be told so
/// simply: with comments, raw strings or letters in quotes, or when the text ends before.
pub(super) fn value_end(text: &str, from: usize) -> Option<usize> {
    let bytes = text.as_bytes();
    let (mut at, mut open) = (from, 0_usize);
    loop {
        match bytes.get(at)? {
            b'(' | b'[' | b'{' => open += 1,
            b')' | b']' | b'}' if open == 0 => return Some(at),
            b')' | b']' | b'}' => open -= 1,
            b',' if open == 0 => return Some(at),
            b'"' => at = quote_end(bytes, at)?,
            b'/' | b'\'' | b'#' => return None,
            _ => {}
        }
        at += 1;
    }
}

/// The quote that closes a string; none for a raw one.
fn quote_end(bytes: &[u8], quote: usize) -> Option<usize> {
    if quote.checked_sub(1).and_then(|before| bytes.get(before)) == Some(&b'r') {
        return None;
    }
    let mut at = quote + 1;
    loop {
        match bytes.get(at)? {
            b'"' => return Some(at),
            b'\\' => at += 2,
            _ => at += 1,
        }
    }
}

/// What stands between the quotes of a string that starts at a byte, if it is what it means: without escapes.
pub(super) fn quoted(text: &str, from: usize) -> Option<&str> {
    let inner = text.get(from..)?.strip_prefix('"')?;
    let end = inner.as_bytes().iter().position(|b| matches!(b, b'"' | b'\\'))?;
    inner.get(..end).filter(|_| inner.as_bytes().get(end) == Some(&b'"'))
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
    let at = |at: usize| text.as_bytes().get(at).copied();
    let open = skip_blank(text, from);
    if at(open) != Some(b'(') {
        return Payload::None;
    }
    let first = skip_blank(text, open + 1);
    if at(first) == Some(b'"') {
        // A field with its name in quotes, which will be marked.
        let named = quoted(text, first).is_some_and(|name| at(skip_blank(text, first + name.len() + 2)) == Some(b':'));
        return if named { Payload::Named } else { Payload::Unnamed };
    }
    let Some(word) = word(text, first) else {
        return if matches!(at(first), None | Some(b')')) { Payload::Named } else { Payload::Unnamed };
    };
    // A word that is no value by its looks is a field, whose colon will be missed if it is not there.
    let raw = if text.get(first..).is_some_and(|rest| rest.starts_with("r#")) { 2 } else { 0 };
    match at(skip_blank(text, first + raw + word.len())) {
        Some(b',' | b')' | b'(' | b'"') => Payload::Unnamed,
        _ => Payload::Named,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blanks_are_white_space_and_comments() {
        for (text, rest) in [
            ("  x", "x"),
            ("// a\n x", "x"),
            ("/* a /* b */ c */x", "x"),
            ("/**/ /* ü */\t// €\nx", "x"),
            ("\u{2028}\u{85}x", "x"),
            ("// open", ""),
            ("/x", "/x"),
            ("\u{3000}x", "\u{3000}x"),
        ] {
            assert_eq!(blank(text, 0), Blank { end: text.len() - rest.len(), closed: true }, "{text}");
        }
        for text in ["/* open", " /* open /* */ *", "/*"] {
            assert_eq!(blank(text, 0), Blank { end: text.len(), closed: false }, "{text}");
        }
    }

    #[test]
    fn words_are_names() {
        for (text, expected) in [
            ("Cube(", Some("Cube")),
            ("_a1: 2", Some("_a1")),
            ("größe", Some("größe")),
            ("r#type: 1", Some("type")),
            ("r", Some("r")),
            ("r\"raw\"", None),
            ("r#\"raw\"#", None),
            ("b'x'", None),
            ("1a", None),
            ("-a", None),
            ("", None),
        ] {
            assert_eq!(word(text, 0), expected, "{text}");
        }
    }

    #[test]
    fn values_end_where_their_brackets_close() {
        for (text, expected) in [
            ("1.5, 2", Some("1.5")),
            ("(1, [2, {3: 4}]) )", Some("(1, [2, {3: 4}]) ")),
            (r#""a, \") b" ]"#, Some(r#""a, \") b" "#)),
            ("None)", Some("None")),
            ("(1, 2", None),
            ("\"a", None),
            ("\"a\\", None),
            ("(1 /* , */, 2))", None),
            ("r\"a\\\", b", None),
            ("r#\"a\"#, b", None),
            ("',', b", None),
        ] {
            assert_eq!(value_end(text, 0).map(|end| &text[..end]), expected, "{text}");
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
            ("Cube(r#width: 1)", Payload::Named),
            ("Cube(1.0)", Payload::Unnamed),
            ("Cube([Cube])", Payload::Unnamed),
            ("Cube(Cube())", Payload::Unnamed),
            ("Cube(Plain, 1)", Payload::Unnamed),
            ("Cube(\"a\")", Payload::Unnamed),
            ("Cube(r\"a\")", Payload::Unnamed),
            ("Cube(\"a\", 1: 2)", Payload::Unnamed),
            ("Cube(\"a\" : 1)", Payload::Named),
            ("Cube(", Payload::Named),
        ] {
            assert_eq!(payload(text, 4), expected, "{text}");
        }
    }
}
