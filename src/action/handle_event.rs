//! Handing events to the nodes of a scene.

use std::cell::OnceCell;
use std::fmt;
use std::sync::Arc;

use super::walk::{Go, Visitor, walk};
use super::{ActionError, ActionKind, Branches, Event, PickTarget, PickedPoint, RayPickAction, State};
use crate::node::Role;
use crate::scene::{NodeKey, Path, Scene};

/// Hands an event to the nodes that wait for it, in the order of the walk, until one of them has handled it.
///
/// A node may *grab* events: from then on each goes to it first, and to the others only if it leaves it unhandled. Nodes ask
/// what is under the pointer through [`EventContext::picked`]; the scene is picked once for each event, and only if somebody
/// asks. Levels of detail are all walked, since no camera is asked for.
///
/// Nodes are given the scene to look at. What they want to change they say with [`EventContext::edit`]; it is done, in that
/// order, when the event was handed round.
///
/// # Example
///
/// ```
/// use seamount::action::{ButtonState, Event, EventKind, EventType, HandleEventAction, MouseButton};
/// use seamount::prelude::*;
///
/// // A click on the cube makes it larger.
/// let mut scene = Scene::new();
/// let root = scene.root();
/// let (position, look_at) = (Some(DVec3::Z * 9.0), Some(DVec3::ZERO));
/// scene.add(root, PerspectiveCamera { position, look_at, ..PerspectiveCamera::default() })?;
/// let cube = scene.add(root, Cube::default())?;
/// let clicked = EventCallback::new(EventType::MouseButton, move |cx| {
///     if cx.picked()?.is_some_and(|hit| hit.node() == Some(cube)) {
///         cx.edit(move |scene| scene.edit::<Cube>(cube).into_iter().for_each(|mut cube| cube.width *= 2.0));
///         cx.set_handled();
///     }
///     Ok(())
/// });
/// scene.add(root, clicked)?;
///
/// let mut action = HandleEventAction::new([640, 480]);
/// let press = EventKind::MouseButton { button: MouseButton::Left, state: ButtonState::Pressed };
/// assert!(action.apply(&mut scene, &Event::new(press, DVec2::new(320.0, 240.0)))?);
/// assert!(!action.apply(&mut scene, &Event::new(press, DVec2::new(2.0, 2.0)))?);
/// assert_eq!(scene.get::<Cube>(cube).map(|cube| cube.width), Some(4.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct HandleEventAction {
    /// Width and height of the picture in which events happen.
    pub size: [u32; 2],
    /// Name of the camera that the picture is taken with; the first one if not given.
    pub camera: Option<String>,
    /// How far from the pointer lines and points are picked, in pixels, from 0 up.
    pub radius: f64,
    /// The node that has grabbed events. Of a node that has left the scene nothing is heard any more.
    pub grabber: Option<NodeKey>,
}

impl HandleEventAction {
    /// For events in a picture of this size in pixels.
    #[must_use]
    pub fn new(size: [u32; 2]) -> Self {
        Self { size, camera: None, radius: RayPickAction::RADIUS, grabber: None }
    }

    /// Hands an event to the scene; says whether a node has handled it.
    ///
    /// # Errors
    ///
    /// What nodes return, such as errors of picking. The scene is as it was then, and the rest of the nodes do not get the
    /// event.
    pub fn apply(&mut self, scene: &mut Scene, event: &Event) -> Result<bool, ActionError> {
        let mut context = EventContext {
            scene,
            event,
            action: self,
            path: Path::default(),
            grabber: self.grabber.filter(|&key| scene.node(key).is_some()),
            handled: false,
            first: OnceCell::new(),
            all: OnceCell::new(),
            edits: Vec::new(),
        };
        let first = context.grabber;
        if let Some(key) = first {
            // It gets the event wherever it stands.
            context.path = Path::new(key);
            context.offer(key)?;
        }
        if !context.handled {
            walk(scene, Branches::Possible, &mut Handing { context: &mut context, first })?;
        }
        let EventContext { grabber, handled, edits, .. } = context;
        self.grabber = grabber;
        edits.into_iter().for_each(|edit| edit(scene));
        Ok(handled)
    }
}

/// A change of the scene that is made when the event was handed round.
type Change = Box<dyn FnOnce(&mut Scene)>;

/// What a node knows of an event, and what it can do with it.
pub struct EventContext<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The event.
    pub event: &'a Event,
    action: &'a HandleEventAction,
    path: Path,
    grabber: Option<NodeKey>,
    handled: bool,
    first: OnceCell<Option<PickedPoint>>,
    all: OnceCell<Vec<PickedPoint>>,
    edits: Vec<Change>,
}

impl fmt::Debug for EventContext<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { event, path, grabber, handled, .. } = self;
        f.debug_struct("EventContext")
            .field("event", event)
            .field("path", path)
            .field("grabber", grabber)
            .field("handled", handled)
            .finish_non_exhaustive()
    }
}

impl EventContext<'_> {
    /// The way to the node that has the event now; of a grabber, which gets it wherever it stands, the node alone.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What is under the pointer: the first hit through its place in the picture. None where nothing is, or without a
    /// camera.
    ///
    /// # Errors
    ///
    /// As for [`RayPickAction::apply`], but for a scene without a camera.
    pub fn picked(&self) -> Result<Option<&PickedPoint>, ActionError> {
        if let Some(all) = self.all.get() {
            return Ok(all.first());
        }
        if let Some(first) = self.first.get() {
            return Ok(first.as_ref());
        }
        let found = self.pick(false)?.pop();
        Ok(self.first.get_or_init(|| found).as_ref())
    }

    /// All that lies behind the pointer, in the order of picks.
    ///
    /// # Errors
    ///
    /// As for [`EventContext::picked`].
    pub fn picked_all(&self) -> Result<&[PickedPoint], ActionError> {
        if let Some(all) = self.all.get() {
            return Ok(all);
        }
        let found = self.pick(true)?;
        Ok(self.all.get_or_init(|| found))
    }

    fn pick(&self, all: bool) -> Result<Vec<PickedPoint>, ActionError> {
        let HandleEventAction { size, camera, radius, .. } = self.action;
        let target = PickTarget::Pixel(self.event.position.x, self.event.position.y);
        let (camera, radius) = (camera.clone(), *radius);
        let pick = RayPickAction { target, all, camera, radius, ..RayPickAction::pixel(0, 0, *size) };
        match pick.apply(self.scene) {
            Err(ActionError::NoCamera) => Ok(Vec::new()),
            picked => picked,
        }
    }

    /// The event is handled: no other node gets it.
    pub fn set_handled(&mut self) {
        self.handled = true;
    }

    /// Whether the event was handled, by another function of the same node for example.
    #[must_use]
    pub fn is_handled(&self) -> bool {
        self.handled
    }

    /// From the next event on the node that has the event now gets all of them first.
    pub fn grab(&mut self) {
        self.grabber = self.path.tail();
    }

    /// Events are handed round as usual again, whoever had grabbed them.
    pub fn release(&mut self) {
        self.grabber = None;
    }

    /// The node that has grabbed events.
    #[must_use]
    pub fn grabber(&self) -> Option<NodeKey> {
        self.grabber
    }

    /// Changes the scene when the event was handed round, after what was asked for before.
    pub fn edit(&mut self, edit: impl FnOnce(&mut Scene) + 'static) {
        self.edits.push(Box::new(edit));
    }

    /// Gives the event to the node at the end of the path.
    fn offer(&mut self, key: NodeKey) -> Result<(), ActionError> {
        let scene = self.scene;
        match scene.role(key) {
            Some(Role::Property(property)) => property.handle_event(self),
            _ => Ok(()),
        }
    }
}

/// Hands the event to all nodes but the one that had it first.
struct Handing<'c, 'a> {
    context: &'c mut EventContext<'a>,
    first: Option<NodeKey>,
}

impl Visitor for Handing<'_, '_> {
    fn action(&self) -> ActionKind {
        ActionKind::HandleEvent
    }

    fn enter(&mut self, path: &Path, _: &Arc<State>) -> Result<Go, ActionError> {
        let Some(key) = path.tail().filter(|&key| Some(key) != self.first) else { return Ok(Go::On) };
        // Only properties handle events, and most nodes are none.
        if matches!(self.context.scene.role(key), Some(Role::Property(_))) {
            self.context.path.clone_from(path);
            self.context.offer(key)?;
        }
        Ok(if self.context.handled { Go::End } else { Go::On })
    }
}
