//! Where the characters of a text stand in the picture, and how they are painted.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing))]

use ab_glyph::GlyphId;

use super::{Justification, TextDetail};
use crate::scene::{Ink, MOST_REACH, Typeface};

/// A rectangle of whole pixels, to the right and down from the place of the text: from `min` up to `max`, which is not in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Region {
    pub(super) min: [f64; 2],
    pub(super) max: [f64; 2],
}

impl Region {
    pub(super) fn size(&self) -> [f64; 2] {
        let [[left, top], [right, bottom]] = [self.min, self.max];
        [right - left, bottom - top]
    }

    fn union(self, other: Self) -> Self {
        let ([a, b], [c, d]) = (self.min, other.min);
        let ([e, f], [g, h]) = (self.max, other.max);
        Self { min: [a.min(c), b.min(d)], max: [e.max(g), f.max(h)] }
    }

    /// Whether all of another is in it.
    pub(super) fn holds(&self, other: Self) -> bool {
        self.union(other) == *self
    }

    /// With as much more on the left and right, and above and below.
    pub(super) fn grown(self, [x, y]: [f64; 2]) -> Self {
        let ([left, top], [right, bottom]) = (self.min, self.max);
        Self { min: [left - x, top - y], max: [right + x, bottom + y] }
    }

    /// What is in both, if anything is.
    pub(super) fn intersection(self, other: Self) -> Option<Self> {
        let ([a, b], [c, d]) = (self.min, other.min);
        let ([e, f], [g, h]) = (self.max, other.max);
        let both = Self { min: [a.max(c), b.max(d)], max: [e.min(g), f.min(h)] };
        both.size().iter().all(|side| *side > 0.0).then_some(both)
    }

    pub(super) fn moved(self, [x, y]: [f64; 2]) -> Self {
        let ([left, top], [right, bottom]) = (self.min, self.max);
        Self { min: [left + x, top + y], max: [right + x, bottom + y] }
    }

    pub(super) fn has(&self, [x, y]: [f64; 2]) -> bool {
        let ([left, top], [right, bottom]) = (self.min, self.max);
        x >= left && x < right && y >= top && y < bottom
    }
}

/// A character.
#[derive(Debug, Clone, Copy)]
struct Cell {
    /// `None` without ink of its own.
    glyph: Option<GlyphId>,
    /// Whether the font does not know it, or has it larger than can be painted: a box is drawn.
    missing: bool,
    /// Where the pen is before it, and after it.
    from: f64,
    to: f64,
}

/// A string that is not empty.
#[derive(Debug)]
struct Line {
    /// Which of the strings.
    string: usize,
    baseline: f64,
    cells: Vec<Cell>,
    /// Around the line from its ascent to its descent, and all of its ink.
    region: Region,
}

/// The strings of a text with their characters, in pixels.
#[derive(Debug)]
pub(super) struct Layout<'f> {
    font: &'f Typeface,
    size: f64,
    lines: Vec<Line>,
}

impl<'f> Layout<'f> {
    pub(super) fn new(
        font: &'f Typeface,
        size: f64,
        strings: &[String],
        spacing: f64,
        justification: Justification,
    ) -> Self {
        let mut layout = Self { font, size, lines: Vec::new() };
        for (string, text) in strings.iter().enumerate().filter(|(_, text)| !text.is_empty()) {
            let mut cells: Vec<Cell> = Vec::new();
            let (mut pen, mut before) = (0.0, None);
            for character in text.chars() {
                // What moves the pen of a typewriter is a space here.
                let blank = character.is_whitespace() || character.is_control();
                let glyph = font.glyph(if character.is_control() { ' ' } else { character });
                let kern = before.zip(glyph).map_or(0.0, |(before, glyph)| font.kern(before, glyph));
                let from = pen + kern * size;
                // A kern of any size leaves the pen on the right of where it was.
                let from = from.max(cells.last().map_or(0.0, |cell| cell.from));
                if let Some(last) = cells.last_mut() {
                    last.to = from;
                }
                pen = from + font.advance(glyph).max(0.0) * size;
                let painted = glyph.filter(|&glyph| font.can_paint(glyph, size));
                cells.push(Cell { glyph: painted, missing: painted.is_none() && !blank, from, to: pen });
                before = glyph;
            }
            let start = match justification {
                Justification::Left => 0.0,
                // To a whole pixel, so that letters look the same.
                Justification::Center => (-0.5 * pen).round(),
                Justification::Right => (-pen).round(),
            };
            cells.iter_mut().for_each(|cell| (cell.from, cell.to) = (cell.from + start, cell.to + start));
            let baseline = (string as f64 * spacing * size).round();
            let [up, down] = font.reach().map(|reach| reach.max(0.0) * size);
            let mut region = Region { min: [start, baseline - up], max: [start + pen, baseline + down] };
            for ink in cells.iter().filter_map(|cell| layout.ink(cell, baseline)) {
                region = region.union(ink);
            }
            region = Region { min: region.min.map(f64::floor), max: region.max.map(f64::ceil) };
            layout.lines.push(Line { string, baseline, cells, region });
        }
        layout
    }

    /// A region that holds all of a text, told without a look at its characters.
    pub(super) fn bound(
        font: &Typeface,
        size: f64,
        strings: &[String],
        spacing: f64,
        justification: Justification,
    ) -> Region {
        let longest = strings.iter().map(|text| text.chars().count()).max().unwrap_or(0);
        // Each character goes on by its advance and a kern.
        let wide = longest as f64 * (font.widest() + 1.0) * size;
        let start = match justification {
            Justification::Left => 0.0,
            Justification::Center => -0.5 * wide,
            Justification::Right => -wide,
        };
        let last = strings.len().saturating_sub(1) as f64 * spacing * size;
        let [up, down] = font.reach().map(|reach| reach.max(MOST_REACH) * size);
        let lines = Region { min: [start, last.min(0.0) - up], max: [start + wide, last.max(0.0) + down] };
        // Half a pixel by the rounding of starts and baselines, and one by that of regions.
        lines.grown([MOST_REACH * size + 2.0, 2.0])
    }

    /// The region around everything; nothing if there is no character.
    pub(super) fn region(&self) -> Option<Region> {
        self.lines.iter().map(|line| line.region).reduce(Region::union)
    }

    /// Whether there is anything to be seen.
    pub(super) fn has_ink(&self) -> bool {
        self.lines.iter().any(|line| line.cells.iter().any(|cell| self.ink(cell, line.baseline).is_some()))
    }

    /// The box that is drawn for a character that the font does not know.
    fn missing_box(&self, cell: &Cell, baseline: f64) -> Region {
        let margin = 0.1 * (cell.to - cell.from);
        Region { min: [cell.from + margin, baseline - 0.7 * self.size], max: [cell.to - margin, baseline] }
    }

    fn ink(&self, cell: &Cell, baseline: f64) -> Option<Region> {
        if cell.missing {
            return Some(self.missing_box(cell, baseline));
        }
        let Ink { left, right, bottom, top } = self.font.ink(cell.glyph?)?;
        let [left, right] = [left, right].map(|x| cell.from + x * self.size);
        let [top, bottom] = [top, bottom].map(|y| baseline - y * self.size);
        Some(Region { min: [left, top], max: [right, bottom] })
    }

    /// The character at a place, to the right and down. Ink that reaches beyond the ends of a line is that of its first and last
    /// character.
    pub(super) fn at(&self, place: [f64; 2]) -> Option<TextDetail> {
        let line = self.lines.iter().find(|line| line.region.has(place))?;
        let last = line.cells.len() - 1;
        let [x, _] = place;
        let after = line.cells.iter().position(|cell| x < cell.to);
        Some(TextDetail { string: line.string, character: after.unwrap_or(last) })
    }

    /// How much of each pixel of a part of the picture is covered, row by row.
    pub(super) fn paint(&self, part: Region) -> Vec<f32> {
        let [width, height] = part.size().map(|side| side as usize);
        let mut shares = vec![0.0f32; width * height];
        let [left, top] = part.min;
        let mut put = |x: i64, y: i64, share: f32| {
            if let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y))
                && x < width
                && let Some(covered) = shares.get_mut(y * width + x)
            {
                *covered = (*covered + share).min(1.0);
            }
        };
        for line in &self.lines {
            for cell in &line.cells {
                let Some(ink) = self.ink(cell, line.baseline) else { continue };
                // A pixel more: what touches a pixel may be rounded into it.
                let ink = Region { min: ink.min.map(|v| v.floor() - 1.0), max: ink.max.map(|v| v.ceil() + 1.0) };
                if ink.intersection(part).is_none() {
                    continue;
                }
                match cell.glyph {
                    Some(glyph) => {
                        self.font.paint(glyph, self.size, [cell.from - left, line.baseline - top], &mut put);
                    }
                    None => {
                        let of = self.missing_box(cell, line.baseline).moved([-left, -top]);
                        frame(of, self.size, part.size(), &mut put);
                    }
                }
            }
        }
        shares
    }
}

/// The border of a box, in whole pixels: what of it is in an image of these sides.
fn frame(of: Region, size: f64, image: [f64; 2], put: &mut impl FnMut(i64, i64, f32)) {
    let [left, top] = of.min.map(|v| v.ceil() as i64);
    let [right, bottom] = of.max.map(|v| v.floor() as i64);
    let [most_x, most_y] = image.map(|side| side as i64);
    let width = ((size / 16.0).round() as i64).max(1);
    for y in top.max(0)..bottom.min(most_y) {
        for x in left.max(0)..right.min(most_x) {
            if x < left + width || x >= right - width || y < top + width || y >= bottom - width {
                put(x, y, 1.0);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    /// A font whose em is said to be of this many units.
    fn font(units: Option<u16>) -> std::sync::Arc<Typeface> {
        let scene = Scene::new();
        let Some(units) = units else { return scene.resources().typeface(None).unwrap() };
        let mut bytes = epaint_default_fonts::UBUNTU_LIGHT.to_vec();
        let head = bytes[12..].chunks(16).find(|record| record.starts_with(b"head")).unwrap();
        let head = u32::from_be_bytes(head[8..12].try_into().unwrap()) as usize;
        bytes[head + 18..head + 20].copy_from_slice(&units.to_be_bytes());
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("font.ttf");
        std::fs::write(&path, bytes).unwrap();
        scene.resources().typeface(Some(&path)).unwrap()
    }

    #[test]
    fn the_bound_holds_the_text() {
        let strings = |texts: &[&str]| texts.iter().map(|text| (*text).to_owned()).collect::<Vec<_>>();
        for units in [None, Some(1000), Some(300), Some(16)] {
            let font = font(units);
            for texts in [&["AVAToj|"][..], &["", "\u{4e2d}\u{4e2d}", "i"], &["W"], &["a\t b", "ÅÅÅÅÅÅÅÅ", ""]]
            {
                let strings = strings(texts);
                for size in [0.3, 10.0, 1024.0] {
                    for spacing in [1.0, -2.5, 1e6] {
                        for justification in [Justification::Left, Justification::Center, Justification::Right] {
                            let region = Layout::new(&font, size, &strings, spacing, justification).region().unwrap();
                            let bound = Layout::bound(&font, size, &strings, spacing, justification);
                            assert!(bound.holds(region), "{texts:?}, {size}, {spacing}: {region:?} in {bound:?}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn a_frame_costs_no_more_than_the_image() {
        let image = [30.0, 20.0];
        let huge = Region { min: [-1e9; 2], max: [1e9; 2] };
        frame(huge, 10.0, image, &mut |_, _, _| panic!("the border is far away"));
        // Against the definition: within a pixel of the edge, in the box and in the image.
        for of in [Region { min: [3.2, -4.0], max: [12.9, 9.1] }, Region { min: [-5.0, 2.0], max: [90.0, 50.0] }] {
            let mut got = Vec::new();
            frame(of, 10.0, image, &mut |x, y, _| got.push((x, y)));
            let inner = of.grown([-1.0; 2]);
            let within = |region: Region, x: f64, y: f64| {
                x >= region.min[0] && x + 1.0 <= region.max[0] && y >= region.min[1] && y + 1.0 <= region.max[1]
            };
            let whole = Region { min: of.min.map(f64::ceil), max: of.max.map(f64::floor) };
            let inner = Region { min: inner.min.map(f64::ceil), max: inner.max.map(f64::floor) };
            let all = (0..20i64).flat_map(|y| (0..30i64).map(move |x| (x, y)));
            let border = |&(x, y): &(i64, i64)| within(whole, x as f64, y as f64) && !within(inner, x as f64, y as f64);
            assert_eq!(got, all.filter(border).collect::<Vec<_>>());
        }
    }
}
