//! What the caller keeps from picture to picture.

use std::any::Any;
use std::cmp::Ordering;

use super::frame::{Draw, Frame, Statistics};
use super::render::RenderAction;
use crate::scene::{Path, Scene};

/// What one shape keeps in a [`View`].
pub(super) type Kept = Box<dyn Any + Send + Sync>;

/// The history of one picture that is taken again and again: the last [`Frame`], the buffers it was made in, and what each
/// shape wants to remember. Owned by the caller, one for each window or camera; everything in it can be made anew, so a
/// fresh one gives the same pictures.
///
/// With a View a camera that stands still costs nothing: while neither the scene nor the picture's settings change,
/// [`RenderAction::apply_in`] hands out the last frame without looking at the graph. While the camera moves, the memory of the
/// frames before is used again: a terrain allocates nothing that grows with the number of its patches.
///
/// A View can be sent to another thread, and so can the frames made in it.
///
/// # Example
///
/// ```
/// use seamount::action::View;
/// use seamount::prelude::*;
///
/// let mut scene = Scene::new();
/// let root = scene.root();
/// let camera = scene.add(root, PerspectiveCamera { position: Some(DVec3::Z * 9.0), ..PerspectiveCamera::default() })?;
/// scene.add(root, Cube::default())?;
/// let action = RenderAction::new(640, 480);
/// let mut view = View::default();
/// for _ in 0..3 {
///     assert_eq!(action.apply_in(&scene, &mut view)?.draws.len(), 1);
/// }
/// // Three frames, but the scene was walked once.
/// assert_eq!((view.statistics().frames, view.statistics().walks), (3, 1));
///
/// if let Some(mut camera) = scene.edit::<PerspectiveCamera>(camera) {
///     camera.position = Some(DVec3::Z * 8.0);
/// }
/// action.apply_in(&scene, &mut view)?;
/// assert_eq!(view.statistics().walks, 2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Default)]
pub struct View {
    /// Keeps the detail that was chosen last while the camera moves, to see from elsewhere what it was. Patches outside the
    /// present view are still left out. What was never drawn in this View gets its detail once.
    pub freeze: bool,
    made_for: Option<MadeFor>,
    /// Whether the walk met a node that has to be met for each frame.
    acted: bool,
    pub(super) frame: Frame,
    kept: Vec<Slot>,
    next: usize,
    statistics: ViewStatistics,
}

/// What a frame depends on.
#[derive(Debug, PartialEq)]
struct MadeFor {
    scene: u64,
    version: u64,
    resources: u64,
    action: RenderAction,
    freeze: bool,
}

/// What an occurrence of a shape keeps.
#[derive(Debug)]
struct Slot {
    path: Path,
    kept: Option<Kept>,
    /// The walk that met it last.
    walk: u64,
}

/// What was done in a [`View`] since it was made.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ViewStatistics {
    /// Frames that were asked for.
    pub frames: u64,
    /// Frames for which the scene was walked; the others were the same as the one before.
    pub walks: u64,
    /// Choices of detail that were made anew, over all shapes.
    pub selections: u64,
}

impl View {
    /// Counts since the View was made.
    #[must_use]
    pub fn statistics(&self) -> ViewStatistics {
        self.statistics
    }

    /// Counts a frame; whether the last one will do.
    pub(super) fn is_current(&mut self, action: &RenderAction, scene: &Scene) -> bool {
        self.statistics.frames += 1;
        self.made_for.as_ref().is_some_and(|m| {
            m.scene == scene.id()
                && m.version == scene.version()
                && m.resources == scene.resources().version()
                && m.freeze == self.freeze
                && m.action == *action
        })
    }

    /// Starts a walk. The frame is no longer valid, its memory is free.
    pub(super) fn begin(&mut self) {
        self.statistics.walks += 1;
        self.made_for = None;
        self.acted = false;
        self.next = 0;
        self.frame.draws.clear();
        self.frame.statistics = Statistics::default();
    }

    /// Ends a walk: the frame is the one for this scene and action. What was kept for shapes that are gone is dropped.
    pub(super) fn end(&mut self, action: &RenderAction, scene: &Scene) {
        self.frame.size = action.size;
        let fills = self.frame.fills().iter().flatten().count() as u32;
        let Frame { draws, statistics, .. } = &mut self.frame;
        // Sorting keeps the order of what is equal and allocates, so it is left to those who need it.
        if draws.iter().any(|draw| draw.effects.transparency) {
            draws.sort_by(|a, b| a.order().partial_cmp(&b.order()).unwrap_or(Ordering::Equal));
        }
        statistics.draw_calls = draws.iter().map(Draw::calls).sum::<u32>() + fills;
        statistics.triangles = draws.iter().map(Draw::triangles).sum();
        let walk = self.statistics.walks;
        self.kept.retain(|slot| slot.walk == walk);
        self.statistics.selections += u64::from(self.frame.statistics.selections);
        self.made_for = (!self.acted).then(|| MadeFor {
            scene: scene.id(),
            version: scene.version(),
            resources: scene.resources().version(),
            action: action.clone(),
            freeze: self.freeze,
        });
    }

    /// The frame is good once: a node of the scene wants to be met for each.
    pub(super) fn acted(&mut self) {
        self.acted = true;
    }

    /// What the shape at this place kept the last time; it has to be given back with [`View::keep`].
    pub(super) fn take(&mut self, path: &Path) -> Option<Kept> {
        // Shapes come in the same order every time, unless the graph has changed.
        if self.kept.get(self.next).is_none_or(|slot| slot.path != *path) {
            match self.kept.iter().position(|slot| slot.path == *path) {
                Some(at) => self.next = at,
                None => {
                    self.next = self.kept.len();
                    self.kept.push(Slot { path: path.clone(), kept: None, walk: 0 });
                }
            }
        }
        let walk = self.statistics.walks;
        let slot = self.kept.get_mut(self.next)?;
        slot.walk = walk;
        slot.kept.take()
    }

    /// Gives back what [`View::take`] took last.
    pub(super) fn keep(&mut self, kept: Option<Kept>) {
        if let Some(slot) = self.kept.get_mut(self.next) {
            slot.kept = kept;
        }
        self.next += 1;
    }

    /// What the shape at this place keeps.
    pub(super) fn kept(&self, path: &Path) -> Option<&(dyn Any + Send + Sync)> {
        self.kept.iter().find(|slot| slot.path == *path)?.kept.as_deref()
    }
}

// Detail can be chosen in another thread than the one that draws.
const _: () = {
    const fn sendable<T: Send + Sync>() {}
    sendable::<View>();
    sendable::<Frame>();
};
