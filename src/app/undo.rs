//! Undo and redo: a stack of states, shared by `Arc`s.

use std::sync::Arc;

const DEEPEST: usize = 500;

/// Of a project's tags, options and edits, or of a model.
pub struct History<T> {
    /// What each change was called, and the state before it.
    past: Vec<(String, Arc<T>)>,
    /// What each undone change was called, and the state after it.
    future: Vec<(String, Arc<T>)>,
}

impl<T> Default for History<T> {
    fn default() -> Self {
        Self { past: Vec::new(), future: Vec::new() }
    }
}

impl<T> History<T> {
    /// Notes a change by its name and the state before it.
    pub fn note(&mut self, name: String, before: Arc<T>) {
        self.past.push((name, before));
        if self.past.len() > DEEPEST {
            self.past.remove(0);
        }
        self.future.clear();
    }

    /// The state before the latest change, and the change's name.
    pub fn undo(&mut self, current: &Arc<T>) -> Option<(String, Arc<T>)> {
        let (name, state) = self.past.pop()?;
        self.future.push((name.clone(), current.clone()));
        Some((name, state))
    }

    pub fn redo(&mut self, current: &Arc<T>) -> Option<(String, Arc<T>)> {
        let (name, state) = self.future.pop()?;
        self.past.push((name.clone(), current.clone()));
        Some((name, state))
    }

    /// The same steps, their states put another way.
    pub fn map(&self, to: impl Fn(&Arc<T>) -> Arc<T>) -> Self {
        let steps = |own: &[(String, Arc<T>)]| -> Vec<(String, Arc<T>)> {
            own.iter().map(|(name, state)| (name.clone(), to(state))).collect()
        };
        Self { past: steps(&self.past), future: steps(&self.future) }
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
    use crate::app::edit::Edit;

    #[test]
    fn states_come_back_in_turn() {
        let mut history = History::<Edit>::default();
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
