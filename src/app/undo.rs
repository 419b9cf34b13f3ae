//! Undo and redo of tags and options: states behind `Arc`s, which are small.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::change::Change;
use super::edit::Edit;

/// Changes of one value closer together than this are one drag.
const ONE_DRAG: Duration = Duration::from_millis(900);
const DEEPEST: usize = 500;

#[derive(Default)]
pub struct History {
    /// What each change was called, and the state before it.
    past: Vec<(String, Arc<Edit>)>,
    /// What each undone change was called, and the state after it.
    future: Vec<(String, Arc<Edit>)>,
    latest: Option<(Change, Instant)>,
}

impl History {
    /// Notes that `change` is about to alter `before`.
    pub fn note(&mut self, change: &Change, before: &Arc<Edit>) {
        let now = Instant::now();
        let continues = self.latest.as_ref().is_some_and(|(last, at)| {
            change.merges_with(last) && now - *at < ONE_DRAG && self.future.is_empty()
        });
        if !continues {
            self.past.push((change.name(), before.clone()));
            if self.past.len() > DEEPEST {
                self.past.remove(0);
            }
        }
        self.future.clear();
        self.latest = Some((change.clone(), now));
    }

    /// The state before the latest change, and the change's name.
    pub fn undo(&mut self, current: &Arc<Edit>) -> Option<(String, Arc<Edit>)> {
        self.latest = None;
        let (name, state) = self.past.pop()?;
        self.future.push((name.clone(), current.clone()));
        Some((name, state))
    }

    pub fn redo(&mut self, current: &Arc<Edit>) -> Option<(String, Arc<Edit>)> {
        self.latest = None;
        let (name, state) = self.future.pop()?;
        self.past.push((name.clone(), current.clone()));
        Some((name, state))
    }

    pub fn undo_name(&self) -> Option<&str> {
        self.past.last().map(|(name, _)| name.as_str())
    }

    pub fn redo_name(&self) -> Option<&str> {
        self.future.last().map(|(name, _)| name.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drag_is_undone_at_once() {
        let mut history = History::default();
        let state = |count: usize| {
            let mut edit = Edit::default();
            edit.options.samples.count = count;
            Arc::new(edit)
        };
        let option =
            |text: &str| Change::Option { section: "samples", name: "count", text: text.into() };
        history.note(&option("2"), &state(1));
        history.note(&option("3"), &state(2));
        history.note(&Change::DefaultOptions, &state(3));
        assert_eq!(history.undo_name(), Some("reset all options"));
        let (_, back) = history.undo(&state(3500)).unwrap();
        assert_eq!(back, state(3));
        let (name, back) = history.undo(&back).unwrap();
        assert_eq!((name.as_str(), &back), ("samples.count", &state(1)));
        assert!(history.undo(&back).is_none());
        assert_eq!(history.redo(&back).unwrap().1, state(3));
        history.note(&option("9"), &state(3));
        assert_eq!(history.redo_name(), None);
    }
}
