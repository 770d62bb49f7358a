//! What somebody did with keyboard, mouse or another device, as a program hands it to a scene.

use glam::{DQuat, DVec2, DVec3};
use serde::{Deserialize, Serialize};

/// Something that happened at a place of a picture.
///
/// # Example
///
/// ```
/// use seamount::action::{ButtonState, Event, EventKind, EventType, MouseButton};
/// use seamount::prelude::*;
///
/// let press = EventKind::MouseButton { button: MouseButton::Left, state: ButtonState::Pressed };
/// // The middle of the pixel in the top left corner.
/// let event = Event { shift: true, ..Event::new(press, DVec2::new(0.5, 0.5)) };
/// assert!(EventType::MouseButton.accepts(&event.kind) && !EventType::Key.accepts(&event.kind));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// What happened.
    pub kind: EventKind,
    /// Where the pointer was, in pixels from the top left corner of the picture, as picks count them: the middle of pixel
    /// (x, y) is (x + 0.5, y + 0.5). (Open Inventor counts from the bottom left.)
    pub position: DVec2,
    /// When, in seconds from a start that the program chooses.
    pub time: f64,
    /// Whether a shift key was down.
    pub shift: bool,
    /// Whether a control key was down.
    pub control: bool,
    /// Whether an alt key was down.
    pub alt: bool,
}

impl Event {
    /// Something that happened at a place of the picture, at time 0 and with no shift, control or alt key down.
    #[must_use]
    pub fn new(kind: EventKind, position: DVec2) -> Self {
        Self { kind, position, time: 0.0, shift: false, control: false, alt: false }
    }
}

/// What happened.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum EventKind {
    /// A key of the keyboard.
    Key {
        /// Which.
        key: Key,
        /// Whether it went down or up.
        state: ButtonState,
    },
    /// A button of the mouse.
    MouseButton {
        /// Which.
        button: MouseButton,
        /// Whether it went down or up.
        state: ButtonState,
    },
    /// The wheel of the mouse was turned.
    MouseWheel {
        /// By how many notches: to the right, and away from the user.
        delta: DVec2,
    },
    /// The pointer was moved to [`Event::position`].
    Location,
    /// A device that moves in space was moved.
    Motion {
        /// By how much, in units of the device.
        translation: DVec3,
        /// How it was turned.
        rotation: DQuat,
    },
}

/// Which way a key or button went.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ButtonState {
    /// Down.
    Pressed,
    /// Up.
    Released,
}

/// A button of a mouse.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum MouseButton {
    /// The first.
    Left,
    /// The second.
    Middle,
    /// The third.
    Right,
    /// One more, such as those on the side: 4 and up.
    Other(u8),
}

/// A key of a keyboard, by what it stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Key {
    /// One that writes a character, as it is written without shift: `a`, `7`, a blank.
    Character(char),
    /// A function key: 1 is F1.
    Function(u8),
    /// Enter or return.
    Enter,
    /// Escape.
    Escape,
    /// Backspace.
    Backspace,
    /// Delete.
    Delete,
    /// Insert.
    Insert,
    /// Tabulator.
    Tab,
    /// Home.
    Home,
    /// End.
    End,
    /// Page up.
    PageUp,
    /// Page down.
    PageDown,
    /// The arrow to the left.
    Left,
    /// The arrow to the right.
    Right,
    /// The arrow up.
    Up,
    /// The arrow down.
    Down,
    /// A shift key.
    Shift,
    /// A control key.
    Control,
    /// An alt key.
    Alt,
    /// A key with the sign of the system.
    Super,
    /// Any other, by a number of the program's.
    Other(u32),
}

/// Kinds of event that a node waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum EventType {
    /// All.
    #[default]
    Any,
    /// Keys, and buttons of the mouse.
    Button,
    /// Keys.
    Key,
    /// Buttons of the mouse.
    MouseButton,
    /// The wheel of the mouse.
    MouseWheel,
    /// The pointer being moved.
    Location,
    /// A device being moved in space.
    Motion,
}

impl EventType {
    /// Whether an event is of this type.
    #[must_use]
    pub fn accepts(self, kind: &EventKind) -> bool {
        match self {
            EventType::Any => true,
            EventType::Button => matches!(kind, EventKind::Key { .. } | EventKind::MouseButton { .. }),
            EventType::Key => matches!(kind, EventKind::Key { .. }),
            EventType::MouseButton => matches!(kind, EventKind::MouseButton { .. }),
            EventType::MouseWheel => matches!(kind, EventKind::MouseWheel { .. }),
            EventType::Location => matches!(kind, EventKind::Location),
            EventType::Motion => matches!(kind, EventKind::Motion { .. }),
        }
    }
}
