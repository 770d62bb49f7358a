//! Closures that are told when something in a scene has changed.

use std::fmt;

use super::{NodeKey, Path, Scene};

/// What a [`Sensor`] watches.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Watched {
    /// A node itself: its fields, its name, its list of children.
    Node(NodeKey),
    /// A node and everything below it.
    Subtree(NodeKey),
    /// The nodes along a path, and that it still leads where it led.
    Path(Path),
}

/// Calls a closure when what it watches has changed since it was last asked.
///
/// Edits are not interrupted: changes add up, and are told once when [`Sensor::check`] is called, such as before the next
/// picture. What was removed from the scene has changed as well, for the last time.
///
/// # Example
///
/// ```
/// use seamount::prelude::*;
/// use seamount::scene::{Sensor, Watched};
///
/// let mut scene = Scene::new();
/// let root = scene.root();
/// let cube = scene.add(root, Cube::default())?;
/// let mut told = 0;
/// let mut sensor = Sensor::new(&scene, Watched::Subtree(root), |_| told += 1);
/// assert!(!sensor.check(&scene));
/// scene.edit::<Cube>(cube).expect("a cube").width = 3.0;
/// scene.edit::<Cube>(cube).expect("a cube").height = 4.0;
/// assert!(sensor.check(&scene));
/// assert!(!sensor.check(&scene));
/// drop(sensor);
/// assert_eq!(told, 1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Sensor<'f> {
    watched: Watched,
    seen: Option<u64>,
    call: Box<dyn FnMut(&Scene) + 'f>,
}

impl fmt::Debug for Sensor<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Sensor").field("watched", &self.watched).field("seen", &self.seen).finish_non_exhaustive()
    }
}

impl<'f> Sensor<'f> {
    /// A sensor that has seen the scene as it is.
    pub fn new(scene: &Scene, watched: Watched, call: impl FnMut(&Scene) + 'f) -> Self {
        let seen = state_of(scene, &watched);
        Self { watched, seen, call: Box::new(call) }
    }

    /// Calls the closure if there was a change; says whether there was.
    pub fn check(&mut self, scene: &Scene) -> bool {
        let now = state_of(scene, &self.watched);
        let changed = now != self.seen;
        if changed {
            self.seen = now;
            (self.call)(scene);
        }
        changed
    }
}

/// The newest version of what is watched; `None` once it is gone.
fn state_of(scene: &Scene, watched: &Watched) -> Option<u64> {
    match watched {
        Watched::Node(key) => scene.node_version(*key),
        Watched::Subtree(key) => scene.subtree_version(*key),
        Watched::Path(path) => {
            let mut above: Option<NodeKey> = None;
            let mut newest = 0;
            for (key, index) in path.nodes().zip(std::iter::once(0).chain(path.indices())) {
                let there = above.map_or(key == scene.root(), |above| scene.children(above).get(index) == Some(&key));
                newest = scene.node_version(key).filter(|_| there)?.max(newest);
                above = Some(key);
            }
            Some(newest)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::node::{Cube, Separator, Translation};

    #[test]
    fn each_kind_of_sensor_is_told_of_its_own_changes_alone() {
        let mut scene = Scene::new();
        let root = scene.root();
        let group = scene.add(root, Separator::default()).unwrap();
        let cube = scene.add(group, Cube::default()).unwrap();
        let beside = scene.add(root, Translation::default()).unwrap();
        let mut path = Path::new(root);
        path.push(group, 0);
        path.push(cube, 0);
        let kinds = [Watched::Node(group), Watched::Subtree(group), Watched::Path(path)];
        let mut sensors: Vec<Sensor<'_>> = kinds.into_iter().map(|w| Sensor::new(&scene, w, |_| {})).collect();
        let mut told = |scene: &Scene| sensors.iter_mut().map(|s| s.check(scene)).collect::<Vec<_>>();

        scene.edit::<Translation>(beside).unwrap().translation.x = 1.0;
        assert_eq!(told(&scene), [false, false, false]);
        scene.edit::<Cube>(cube).unwrap().width = 1.0;
        assert_eq!(told(&scene), [false, true, true]);
        scene.add(group, Cube::default()).unwrap();
        assert_eq!(told(&scene), [true, true, true]);
        // The path ends elsewhere now, though no node on it but the root was edited.
        scene.remove_child(root, 0).unwrap();
        assert_eq!(told(&scene), [false, false, true]);
        assert_eq!(told(&scene), [false, false, false]);
        scene.remove(group).unwrap();
        assert_eq!(told(&scene), [true, true, false]);
    }
}
