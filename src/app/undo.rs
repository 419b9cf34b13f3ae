//! Undo and redo of tags, options and edits: states behind `Arc`s, which are small.

use std::sync::Arc;

use super::edit::Edit;

const DEEPEST: usize = 500;

#[derive(Default)]
pub struct History {
    /// What each change was called, and the state before it.
    past: Vec<(String, Arc<Edit>)>,
    /// What each undone change was called, and the state after it.
    future: Vec<(String, Arc<Edit>)>,
}

impl History {
    /// Notes a change by its name and the state before it.
    pub fn note(&mut self, name: String, before: Arc<Edit>) {
        self.past.push((name, before));
        if self.past.len() > DEEPEST {
            self.past.remove(0);
        }
        self.future.clear();
    }

    /// The state before the latest change, and the change's name.
    pub fn undo(&mut self, current: &Arc<Edit>) -> Option<(String, Arc<Edit>)> {
        let (name, state) = self.past.pop()?;
        self.future.push((name.clone(), current.clone()));
        Some((name, state))
    }

    pub fn redo(&mut self, current: &Arc<Edit>) -> Option<(String, Arc<Edit>)> {
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
    fn states_come_back_in_turn() {
        let mut history = History::default();
        let state = |count: usize| {
            let mut edit = Edit::default();
            edit.options.samples.count = count;
            Arc::new(edit)
        };
        history.note("count".to_owned(), state(1));
        history.note("reset".to_owned(), state(3));
        assert_eq!(history.undo_name(), Some("reset"));
        let (_, back) = history.undo(&state(3500)).unwrap();
        assert_eq!(back, state(3));
        let (name, back) = history.undo(&back).unwrap();
        assert_eq!((name.as_str(), &back), ("count", &state(1)));
        assert!(history.undo(&back).is_none());
        assert_eq!(history.redo(&back).unwrap().1, state(3));
        history.note("count".to_owned(), state(3));
        assert_eq!(history.redo_name(), None);
    }
}
