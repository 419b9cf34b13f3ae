//! Gestures: a value that follows the hand changes many times and is one step of undo.
//!
//! What begins a gesture is the hand, never a clock: a button of the pointer that is held, a field
//! that is typed in, or a transform in the 3D view. Changes of one value within a gesture are a
//! preview; its end makes them a step, and Escape takes them back without a trace.

use std::sync::Arc;

use eframe::egui::{self, Id, Key};

use super::change::Change;
use super::edit::Edit;

/// What the hand is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gesture {
    /// A button of the pointer is held, for the so manieth time.
    Press(u64),
    /// A field is typed in.
    Typing(Id),
    /// Something is moved in the 3D view, which says itself when that ends.
    Transform,
}

/// A change that is not a step of undo yet.
pub struct Preview {
    pub gesture: Gesture,
    /// The latest of the gesture.
    pub change: Change,
    /// The state before it.
    pub before: Arc<Edit>,
}

/// The hand as of this frame.
#[derive(Default)]
pub struct Hand {
    presses: u64,
    now: Option<Gesture>,
    /// The gesture goes on beyond this frame.
    goes_on: bool,
    escaped: bool,
}

impl Hand {
    /// Looks at the input of a frame, before any panel takes of it.
    pub fn look(&mut self, ctx: &egui::Context) {
        let (pressed, held, released, escaped) = ctx.input(|input| {
            let pointer = &input.pointer;
            let escaped = input.key_pressed(Key::Escape);
            (pointer.any_pressed(), pointer.any_down(), pointer.any_released(), escaped)
        });
        self.presses += u64::from(pressed);
        self.escaped = escaped;
        let typing = || ctx.memory(|memory| memory.focused()).map(Gesture::Typing);
        self.now = if held || released {
            Some(Gesture::Press(self.presses))
        } else if ctx.text_edit_focused() {
            typing()
        } else {
            None
        };
        self.goes_on = held || matches!(self.now, Some(Gesture::Typing(_)));
    }

    /// The gesture that a change of this frame belongs to.
    pub fn gesture(&self) -> Option<Gesture> {
        self.now
    }

    /// Whether a gesture ends with this frame.
    pub fn ends(&self, gesture: Gesture) -> bool {
        !self.goes_on || self.now != Some(gesture)
    }

    /// Whether Escape was pressed.
    pub fn escaped(&self) -> bool {
        self.escaped
    }
}
