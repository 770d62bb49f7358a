//! What is kept on the GPU from frame to frame, as long as frames go on using it.

use std::collections::HashMap;
use std::hash::Hash;

use super::RenderError;

/// Frames after which something that is not drawn any more is given up: long enough for what goes in and out of view.
pub(super) const PATIENCE: u64 = 120;

/// Values by key, each with the frame that used it last.
#[derive(Debug)]
pub(super) struct Cache<K, V> {
    entries: HashMap<K, (V, u64)>,
}

impl<K, V> Default for Cache<K, V> {
    fn default() -> Self {
        Self { entries: HashMap::new() }
    }
}

impl<K: Eq + Hash, V> Cache<K, V> {
    /// The value, made if it is not there. A value that could not be made is tried again the next time.
    pub(super) fn get(
        &mut self,
        key: K,
        frame: u64,
        make: impl FnOnce() -> Result<V, RenderError>,
    ) -> Result<&V, RenderError> {
        use std::collections::hash_map::Entry;
        let (value, used) = match self.entries.entry(key) {
            Entry::Occupied(entry) => entry.into_mut(),
            Entry::Vacant(entry) => entry.insert((make()?, frame)),
        };
        *used = frame;
        Ok(value)
    }

    /// The value, if it is there.
    pub(super) fn peek(&self, key: &K) -> Option<&V> {
        self.entries.get(key).map(|(value, _)| value)
    }

    /// Drops what was not used for a while.
    pub(super) fn retire(&mut self, frame: u64) {
        self.entries.retain(|_, (_, used)| frame.saturating_sub(*used) <= PATIENCE);
    }

    pub(super) fn values(&self) -> impl Iterator<Item = &V> {
        self.entries.values().map(|(value, _)| value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_used_stays_and_what_is_not_goes() {
        let mut cache = Cache::default();
        for frame in 0..=PATIENCE + 1 {
            cache.get("used", frame, || Ok(frame)).unwrap();
            if frame == 0 {
                cache.get("once", frame, || Ok(frame)).unwrap();
            }
            cache.retire(frame);
            assert_eq!(cache.values().count(), if frame <= PATIENCE { 2 } else { 1 });
        }
        assert_eq!(cache.get("used", 0, || Ok(77)).unwrap(), &0, "made once");
        assert!(cache.get("broken", 0, || Err(RenderError::Effects("no"))).is_err());
        assert_eq!(cache.get("broken", 0, || Ok(1)).unwrap(), &1);
    }
}
