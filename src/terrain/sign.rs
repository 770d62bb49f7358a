//! From heights to crossings: what the walks on all three surfaces have in common.
//!
//! Along a ray f(t), its height above the surface, is looked at in order, wherever it may change its slope. Only a change of its
//! sign is a crossing, mere touching is none; but a ray that starts or ends on the surface hits it there. Where f is 0, or so near
//! it that rounding could have given it its sign, nothing is decided: the sign is that of the next height that has one. If it is
//! another one, the crossing is where the ray first met the surface. So however rounding throws f to and fro around 0, at a corner that
//! several triangles share or on a ray within the surface, a crossing is found once and a touch never.

/// The sign of f so far. A contact `C` is a place on the surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sign<C> {
    /// +1 above, −1 below, 0 not known yet.
    pub(super) now: i8,
    /// Where f became 0, if it still is.
    pub(super) zero_since: Option<C>,
}

/// A change of the sign.
#[derive(Debug, Clone, Copy)]
pub(super) struct Turn<C> {
    /// Where the ray first met the surface, if f has been 0 in between.
    pub(super) zero_since: Option<C>,
    /// Whether the ray goes into the ground.
    pub(super) entering: bool,
}

fn sign(f: f64) -> i8 {
    if f > 0.0 { 1 } else { -1 }
}

impl<C: Copy> Sign<C> {
    pub(super) fn unknown() -> Self {
        Self { now: 0, zero_since: None }
    }

    /// Whether it matters if rounding could have given f its sign: where the sign is another than so far; where the ray starts
    /// on the surface there is none so far.
    #[inline(always)]
    pub(super) fn turns(&self, f: f64) -> bool {
        sign(f) == -self.now || self.now == 0 && self.zero_since.is_some()
    }

    /// Goes on to a height that has a sign.
    #[inline(always)]
    pub(super) fn pass(&mut self, f: f64) -> Option<Turn<C>> {
        let (before, zero_since) = (self.now, self.zero_since.take());
        self.now = sign(f);
        // Where nothing was known before, being on the surface counts: the ray starts there.
        (self.now != before && (before != 0 || zero_since.is_some()))
            .then_some(Turn { zero_since, entering: self.now < 0 })
    }

    /// Ends on the surface, if it does: where it met it first, and whether it came from above.
    pub(super) fn end(&mut self) -> Option<(C, bool)> {
        self.zero_since.take().map(|contact| (contact, self.now > 0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Crossings of a list of heights, by their numbers; what is below 1/1000 is in doubt.
    fn crossings(heights: &[f64]) -> Vec<(usize, bool)> {
        let (mut sign, mut found) = (Sign::unknown(), Vec::new());
        for (i, &f) in heights.iter().enumerate() {
            if f == 0.0 || sign.turns(f) && f.abs() < 1e-3 {
                sign.zero_since.get_or_insert(i);
            } else if let Some(turn) = sign.pass(f) {
                found.push((turn.zero_since.unwrap_or(i), turn.entering));
            }
        }
        found.extend(sign.end());
        found
    }

    #[test]
    fn a_crossing_is_found_once_and_a_touch_never() {
        assert_eq!(crossings(&[2.0, 1.0, -1.0, -2.0, 3.0]), [(2, true), (4, false)]);
        assert_eq!(crossings(&[2.0, 0.0, 1.0]), []);
        // Where it met the surface first, through whatever rounding makes of it.
        assert_eq!(crossings(&[2.0, -1e-9, 1e-9, 0.0, -1e-9, -2.0]), [(3, true)]);
        assert_eq!(crossings(&[2.0, -1e-9, -1e-9, 0.0, -1e-9, -2.0]), [(1, true)]);
        assert_eq!(crossings(&[2.0, -1e-9, 1e-9, -1e-9, 2.0]), []);
        // The ray starts or ends on the surface, or runs within it.
        assert_eq!(crossings(&[0.0, -1e-9, 1e-9, 2.0]), [(0, false)]);
        assert_eq!(crossings(&[0.0, 1e-9, -2.0]), [(0, true)]);
        assert_eq!(crossings(&[2.0, 0.0]), [(1, true)]);
        assert_eq!(crossings(&[0.0, 0.0, 0.0]), [(0, false)]);
        assert_eq!(crossings(&[1.0, 2.0]), []);
    }
}
