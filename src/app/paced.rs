//! Hands keys and clicks to the frames in their order, where frames take long.
//!
//! All that came since the last frame is handed to a frame at once, and what a key does is carried
//! out at the frame's end. Of Ctrl+P and the letters typed after it in one frame, the letters would
//! go to whatever had the focus before. So a frame takes one key that does something, or a run of
//! typed letters, or a run of what the mouse does; the rest waits for the frames after it. A frame
//! without input follows a key or a click, in which a dialog that it opened takes the focus.

use std::collections::{BTreeSet, VecDeque};

use eframe::egui::{Event, Key, RawInput};

use super::keys;

#[cfg(test)]
mod tests;

/// What has come and was not handed to a frame yet.
#[derive(Default)]
pub struct Paced {
    waiting: VecDeque<Event>,
    /// What was done in the frame before: a dialog may open in this one, which takes the focus.
    before: Option<Kind>,
    /// Keys that are held down as far as the system has told.
    down: BTreeSet<Key>,
}

/// What belongs into one frame.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// A key that does something.
    Key,
    /// Letters into a field, and the keys that move within it.
    Typed,
    /// A press or release of a mouse button.
    Button,
    /// What can come at any time: movements, releases of keys, the window's own news.
    Any,
}

impl Paced {
    /// Leaves in the input what one frame takes; says whether anything waits for the next.
    pub fn take(&mut self, input: &mut RawInput, is_typing: bool) -> bool {
        for event in input.events.drain(..) {
            match event {
                Event::Key { key, pressed: true, .. } => {
                    let is_repeated = !self.down.insert(key);
                    let is_behind = self.before.is_some() || !self.waiting.is_empty();
                    // A key that is held must not go on when it is no longer held; letters all count.
                    let is_dropped =
                        is_repeated && is_behind && kind(&event, is_typing) == Kind::Key;
                    if !is_dropped {
                        self.waiting.push_back(event);
                    }
                }
                Event::Key { key, pressed: false, .. } => {
                    self.down.remove(&key);
                    self.waiting.push_back(event);
                }
                Event::WindowFocused(false) => {
                    self.down.clear();
                    self.waiting.push_back(event);
                }
                _ => self.waiting.push_back(event),
            }
        }
        let before = self.before.take();
        let mut taken: Option<Kind> = None;
        while let Some(event) = self.waiting.front() {
            let kind = kind(event, is_typing);
            // The letter that a key stands for comes with it.
            let is_its_letter = taken == Some(Kind::Key) && matches!(event, Event::Text(_));
            let is_next = match (taken, kind) {
                (_, Kind::Any) => true,
                (None, _) if before.is_some() => kind == Kind::Button && before == Some(kind),
                (None, _) => true,
                (Some(Kind::Key), _) => is_its_letter && is_letter_of(input.events.last()),
                (Some(taken), _) => taken == kind,
            };
            if !is_next {
                break;
            }
            if kind != Kind::Any && !is_its_letter {
                taken = Some(kind);
            }
            input.events.extend(self.waiting.pop_front());
        }
        self.before = taken.filter(|kind| matches!(kind, Kind::Key | Kind::Button));
        !self.waiting.is_empty()
    }
}

fn kind(event: &Event, is_typing: bool) -> Kind {
    match event {
        Event::Key { key, pressed: true, modifiers, .. } => {
            let leaves = matches!(key, Key::Tab | Key::Enter | Key::Escape);
            let is_function = keys::is_function(*key);
            if is_typing && !leaves && !is_function && !modifiers.command && !modifiers.alt {
                Kind::Typed
            } else {
                Kind::Key
            }
        }
        Event::Copy | Event::Cut | Event::Paste(_) | Event::PasteImage(_) => Kind::Key,
        Event::Text(_) | Event::Ime(_) => Kind::Typed,
        Event::PointerButton { .. } | Event::MiddleClickPaste { .. } => Kind::Button,
        _ => Kind::Any,
    }
}

/// Whether a letter that comes now is that of the key before it.
fn is_letter_of(before: Option<&Event>) -> bool {
    matches!(before, Some(Event::Key { pressed: true, modifiers, .. })
        if !modifiers.command && !modifiers.ctrl)
}
