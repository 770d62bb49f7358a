//! What shapes keep from one ray to the next.

use std::any::Any;
use std::cell::RefCell;
use std::collections::HashMap;
use std::ops::Deref;
use std::sync::{Arc, Mutex, PoisonError};

use super::ShapeError;
use crate::node::ShapeHit;
use crate::scene::{Path, Scene};

/// What shapes have worked out for one ray and can use for the next: all that they would have to look up behind locks that the
/// threads of many picks share. A place is known by its path, which must stay where it is as long as this lives.
#[derive(Default)]
pub(crate) struct Memo {
    /// Of the files that it was worked out from.
    version: u64,
    /// By the address of the place's path.
    known: RefCell<HashMap<usize, Arc<dyn Any + Send + Sync>>>,
    /// Room for the hits of one shape.
    pub(super) hits: RefCell<Vec<ShapeHit>>,
}

impl std::fmt::Debug for Memo {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Memo").field("places", &self.known.borrow().len()).finish()
    }
}

impl Memo {
    /// What `make` makes, or what it made for this place and an earlier ray.
    pub(super) fn remember<T: Send + Sync + 'static>(
        &self,
        place: &Path,
        make: impl FnOnce() -> Result<T, ShapeError>,
    ) -> Result<Arc<T>, ShapeError> {
        let place = std::ptr::from_ref(place).addr();
        let known = self.known.borrow().get(&place).map(Arc::clone);
        if let Some(known) = known.and_then(|known| known.downcast().ok()) {
            return Ok(known);
        }
        let made = Arc::new(make()?);
        self.known.borrow_mut().insert(place, Arc::clone(&made) as Arc<dyn Any + Send + Sync>);
        Ok(made)
    }
}

/// The memos of one picker: one for each thread that picks at the same time.
#[derive(Debug, Default)]
pub(super) struct Memos(Mutex<Vec<Memo>>);

impl Memos {
    /// One that nobody else has as long as it is lent. What was worked out from files that have been forgotten since is not in it.
    pub(super) fn lend(&self, scene: &Scene) -> Lent<'_> {
        let version = scene.resources().version();
        let memo = self.0.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let memo = memo.filter(|memo| memo.version == version);
        Lent { memos: self, memo: memo.unwrap_or_else(|| Memo { version, ..Memo::default() }) }
    }
}

/// A memo that goes back to its picker.
pub(super) struct Lent<'m> {
    memos: &'m Memos,
    memo: Memo,
}

impl Deref for Lent<'_> {
    type Target = Memo;

    fn deref(&self) -> &Memo {
        &self.memo
    }
}

impl Drop for Lent<'_> {
    fn drop(&mut self) {
        let memo = std::mem::take(&mut self.memo);
        self.memos.0.lock().unwrap_or_else(PoisonError::into_inner).push(memo);
    }
}
