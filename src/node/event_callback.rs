use std::sync::Arc;

use super::{Function, PropertyNode};
use crate::action::{ActionError, EventContext, EventType, PropertyContext, State};
use crate::scene::Path;

/// What an [`EventCallback`] calls with an event.
pub type EventFunction = Function<dyn Fn(&mut EventContext<'_>) -> Result<(), ActionError> + Send + Sync>;

crate::define_node! {
    /// Calls functions of the program with what somebody does: keys, buttons and motion, see
    /// [`HandleEventAction`](crate::action::HandleEventAction).
    ///
    /// Each function comes with the type of event that it waits for. They are called in order, even when one of them says
    /// that the event is handled; other nodes do not get the event then. All other actions ignore the node.
    ///
    /// Functions can not be in a file; the node is written without them. Give it a name, and the functions when the file was
    /// read.
    ///
    /// ```ron
    /// Def("clicks", EventCallback())
    /// ```
    pub struct EventCallback: property {
    transient:
        /// The functions are called only where the picked path contains this one, as [`Path::contains`] says. None: for all
        /// events.
        pub path: Option<Path> = None,
        /// The functions, each with what it waits for.
        pub functions: Vec<(EventType, EventFunction)> = Vec::new(),
    }
    actions {
        HandleEvent: "calls its functions with the event";
    }
}

impl EventCallback {
    /// A node with a function for events of a type.
    #[must_use]
    pub fn new(
        events: EventType,
        function: impl Fn(&mut EventContext<'_>) -> Result<(), ActionError> + Send + Sync + 'static,
    ) -> Self {
        Self::default().and(events, function)
    }

    /// The same node with one more function.
    ///
    /// ```
    /// use seamount::action::EventType;
    /// use seamount::node::EventCallback;
    ///
    /// let node = EventCallback::new(EventType::Key, |_| Ok(())).and(EventType::Location, |cx| {
    ///     println!("the pointer is at {}", cx.event.position);
    ///     Ok(())
    /// });
    /// assert_eq!(node.functions.len(), 2);
    /// ```
    #[must_use]
    pub fn and(
        mut self,
        events: EventType,
        function: impl Fn(&mut EventContext<'_>) -> Result<(), ActionError> + Send + Sync + 'static,
    ) -> Self {
        self.functions.push((events, Function(Arc::new(function))));
        self
    }
}

impl PropertyNode for EventCallback {
    fn apply(&self, _: &mut State, _: &PropertyContext<'_>) {}

    fn moves_shapes(&self) -> bool {
        false
    }

    fn handle_event(&self, cx: &mut EventContext<'_>) -> Result<(), ActionError> {
        let kind = cx.event.kind;
        let mut waiting = self.functions.iter().filter(|(events, _)| events.accepts(&kind)).peekable();
        // Nobody waits: nothing has to be picked.
        if waiting.peek().is_none() {
            return Ok(());
        }
        if let Some(path) = &self.path
            && !cx.picked()?.is_some_and(|hit| hit.path.contains(path))
        {
            return Ok(());
        }
        waiting.try_for_each(|(_, Function(function))| function(cx))
    }
}
