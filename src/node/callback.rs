use std::fmt;
use std::sync::Arc;

use super::{List, PropertyNode, field::enum_field};
use crate::action::{ActionKind, PropertyContext, State};

enum_field!(ActionKind: Render | BoundingBox | RayPick | Search | Matrix | Callback | PrimitiveCount | HandleEvent | Other);

/// A function in a field of a node, shared by the copies of the node. Two are equal if they are one in memory.
pub struct Function<F: ?Sized>(pub Arc<F>);

impl<F: ?Sized> Clone for Function<F> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<F: ?Sized> PartialEq for Function<F> {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl<F: ?Sized> fmt::Debug for Function<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Function")
    }
}

/// What a [`Callback`] calls: it is given where the walk is and the State.
pub type CallbackFunction = Function<dyn Fn(&PropertyContext<'_>, &mut State) + Send + Sync>;

crate::define_node! {
    /// Calls a function of the program whenever an action comes by.
    ///
    /// The function is told which action it is, where it is, and may change the State for what follows, like a property that
    /// is written on the spot. Several threads may call it at once. It is called whenever such an action reaches the node:
    /// boxes and picks are not answered from memory then, and no frame is handed out a second time. Actions ask others on
    /// their way: rendering and picking find the camera by a search and need the box of the scene.
    ///
    /// A function can not be in a file; the node is written without it. Give the node a name, and the function when the file
    /// was read. Without a function it does nothing and costs nothing.
    ///
    /// ```ron
    /// Def("before the ground", Callback(actions: [Render]))
    /// ```
    pub struct Callback: property {
        /// The kinds of action that call the function; `Other` are those defined elsewhere.
        pub actions: List<ActionKind> = List::from(ActionKind::ALL),
    transient:
        /// The function.
        pub function: Option<CallbackFunction> = None,
    }
    actions {
        Render, BoundingBox, RayPick, Search, Matrix, Callback, PrimitiveCount, HandleEvent, Other:
            "call its function, which may change the State for what follows";
    }
}

impl Callback {
    /// A node that has all actions call a function.
    ///
    /// ```
    /// use std::sync::atomic::{AtomicU32, Ordering};
    /// use std::sync::Arc;
    ///
    /// use seamount::action::ActionKind;
    /// use seamount::prelude::*;
    ///
    /// let mut scene = Scene::new();
    /// let root = scene.root();
    /// let boxes = Arc::new(AtomicU32::new(0));
    /// let counter = Arc::clone(&boxes);
    /// scene.add(root, Callback::new(move |cx, state| {
    ///     if cx.action == ActionKind::BoundingBox {
    ///         counter.fetch_add(1, Ordering::Relaxed);
    ///     }
    ///     state.translate(DVec3::X);
    /// }))?;
    /// scene.add(root, Cube::default())?;
    /// let bounds = BoundingBoxAction::default().apply(&scene)?.expect("a cube");
    /// assert_eq!((bounds.max.x, boxes.load(Ordering::Relaxed)), (2.0, 1));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn new(function: impl Fn(&PropertyContext<'_>, &mut State) + Send + Sync + 'static) -> Self {
        Self { function: Some(Function(Arc::new(function))), ..Self::default() }
    }
}

impl PropertyNode for Callback {
    fn apply(&self, state: &mut State, cx: &PropertyContext<'_>) {
        if let Some(Function(function)) = self.function.as_ref().filter(|_| self.acts_on(cx.action)) {
            function(cx, state);
        }
    }

    fn acts_on(&self, action: ActionKind) -> bool {
        self.function.is_some() && self.actions.contains(&action)
    }
}
