//! Values in their plainest form, which most values of most files have: read without a parser of all of RON.

use std::str::FromStr;

/// A text that is read from its start while everything is as plain as it gets: numbers in decimal digits, words, strings
/// without escapes, brackets and commas between white space. Whoever meets anything else gives up, and RON has the last word.
///
/// # Example
///
/// ```
/// use seamount::node::Plain;
///
/// let mut text = Plain::new("(1, -2.5e3) ");
/// assert_eq!(text.numbers(), Some([1.0, -2500.0]));
/// assert!(text.is_at_end());
/// assert_eq!(Plain::new("(1, 0x10)").numbers::<f64, 2>(), None);
/// ```
#[derive(Debug, Clone)]
pub struct Plain<'t> {
    text: &'t str,
    at: usize,
}

impl<'t> Plain<'t> {
    /// Reads from the start of a text.
    #[must_use]
    pub fn new(text: &'t str) -> Self {
        Self { text, at: 0 }
    }

    /// The bytes from the next one that is no white space.
    fn rest(&mut self) -> &'t [u8] {
        let rest = self.text.as_bytes().get(self.at..).unwrap_or_default();
        let blank = rest.iter().position(|b| !matches!(b, b' ' | b'\n' | b'\r' | b'\t')).unwrap_or(rest.len());
        self.at += blank;
        rest.get(blank..).unwrap_or_default()
    }

    /// Whether only white space is left.
    pub fn is_at_end(&mut self) -> bool {
        self.rest().is_empty()
    }

    /// Goes past a sign, if it comes next.
    pub fn eat(&mut self, sign: u8) -> Option<()> {
        (self.rest().first() == Some(&sign)).then(|| self.at += 1)
    }

    /// What comes next, as long as it is made of such bytes, which have to be ASCII.
    fn run(&mut self, of: impl Fn(&u8) -> bool) -> Option<&'t str> {
        let rest = self.rest();
        let length = rest.iter().position(|b| !of(b)).unwrap_or(rest.len());
        let run = self.text.get(self.at..self.at + length);
        self.at += length;
        run
    }

    /// A number in decimal digits, as the type reads it.
    pub fn number<T: FromStr>(&mut self) -> Option<T> {
        self.run(|b| matches!(b, b'0'..=b'9' | b'.' | b'-' | b'+' | b'e' | b'E'))?.parse().ok()
    }

    /// Values in parentheses.
    pub fn array<T: Copy + Default, const N: usize>(
        &mut self,
        mut value: impl FnMut(&mut Self) -> Option<T>,
    ) -> Option<[T; N]> {
        let mut values = [T::default(); N];
        self.eat(b'(')?;
        for (k, slot) in values.iter_mut().enumerate() {
            if k > 0 {
                self.eat(b',')?;
            }
            *slot = value(self)?;
        }
        self.eat(b')')?;
        Some(values)
    }

    /// Numbers in parentheses.
    pub fn numbers<T: FromStr + Copy + Default, const N: usize>(&mut self) -> Option<[T; N]> {
        self.array(Self::number)
    }

    /// Letters, digits and underscores.
    pub fn word(&mut self) -> Option<&'t str> {
        self.run(|b| b.is_ascii_alphanumeric() || *b == b'_')
    }

    /// A string in quotes, without escapes.
    pub fn string(&mut self) -> Option<&'t str> {
        self.eat(b'"')?;
        let rest = self.text.get(self.at..)?;
        let length = rest.bytes().position(|b| matches!(b, b'"' | b'\\'))?;
        self.at += length;
        // At a backslash there is no quote to eat.
        (self.text.as_bytes().get(self.at) == Some(&b'"')).then(|| self.at += 1)?;
        rest.get(..length)
    }

    /// Values between brackets; a comma may follow the last.
    pub fn list<T>(&mut self, mut value: impl FnMut(&mut Self) -> Option<T>) -> Option<Vec<T>> {
        let mut list = Vec::new();
        self.eat(b'[')?;
        while self.eat(b']').is_none() {
            list.push(value(self)?);
            if self.eat(b',').is_none() {
                self.eat(b']')?;
                break;
            }
        }
        Some(list)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_plain_is_given_up() {
        for text in ["(1, 2)", " ( 1.0 ,\n2e0)", "(+1,2.)"] {
            assert_eq!(Plain::new(text).numbers(), Some([1.0, 2.0]), "{text}");
        }
        for text in ["(1, 2", "(1 2)", "(1, /**/ 2)", "(1_0, 2)", "(1, 2, 3)", "(1,)", "1, 2", "(inf, 1)", ""] {
            assert_eq!(Plain::new(text).numbers::<f64, 2>(), None, "{text}");
        }
        assert_eq!(Plain::new("\"aü\" x").string(), Some("aü"));
        for text in ["\"a\\n\"", "\"a", "a\"", "r\"a\""] {
            assert_eq!(Plain::new(text).string(), None, "{text}");
        }
        let list = |text| Plain::new(text).list(Plain::number::<i32>);
        assert_eq!(list("[1, -2,]"), Some(vec![1, -2]));
        assert_eq!(list("[]"), Some(vec![]));
        for text in ["[1", "[1 2]", "[,]", "[1,,2]", "(1)", "[1.0]"] {
            assert_eq!(list(text), None, "{text}");
        }
    }
}
