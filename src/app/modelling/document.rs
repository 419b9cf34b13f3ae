//! The model that is edited: the part that is saved, its undo history, and the gesture in progress.

use std::sync::Arc;

use crate::app::gesture::Gesture;
use crate::app::undo::History;
use crate::model::Model;

/// A model with its history.
pub struct Document {
    model: Arc<Model>,
    /// What the capture's file holds, or the empty model that needs none.
    saved: Arc<Model>,
    history: History<Model>,
    /// A gesture's name, and the model before it.
    preview: Option<(Gesture, String, Arc<Model>)>,
}

impl Document {
    /// A document of what was read.
    pub fn new(model: Model) -> Self {
        let model = Arc::new(model);
        Self { saved: model.clone(), model, history: History::default(), preview: None }
    }

    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// A change: a step of undo, or a part of what the hand is doing.
    pub fn change(&mut self, name: String, model: Arc<Model>, gesture: Option<Gesture>) {
        if *model == *self.model {
            return;
        }
        match (gesture, self.preview.take()) {
            (Some(now), Some((gesture, own, before))) if now == gesture && own == name => {
                self.preview = Some((gesture, own, before));
            }
            (now, preview) => {
                self.preview = preview;
                self.commit();
                match now {
                    Some(now) => self.preview = Some((now, name, self.model.clone())),
                    None => self.history.note(name, self.model.clone()),
                }
            }
        }
        self.model = model;
    }

    /// The gesture that is no step yet.
    pub fn gesture(&self) -> Option<Gesture> {
        self.preview.as_ref().map(|(gesture, ..)| *gesture)
    }

    /// The gesture ends: what it changed is a step.
    pub fn commit(&mut self) {
        if let Some((_, name, before)) = self.preview.take()
            && *before != *self.model
        {
            self.history.note(name, before);
        }
    }

    /// The gesture is given up: all is as before.
    pub fn cancel_gesture(&mut self) {
        if let Some((_, _, before)) = self.preview.take() {
            self.model = before;
        }
    }

    pub fn undo(&mut self) -> Option<String> {
        self.commit();
        let (name, state) = self.history.undo(&self.model)?;
        self.model = state;
        Some(name)
    }

    pub fn redo(&mut self) -> Option<String> {
        self.commit();
        let (name, state) = self.history.redo(&self.model)?;
        self.model = state;
        Some(name)
    }

    pub fn undo_name(&self) -> Option<&str> {
        match &self.preview {
            Some((_, name, _)) => Some(name),
            None => self.history.undo_name(),
        }
    }

    pub fn redo_name(&self) -> Option<&str> {
        self.history.redo_name()
    }

    pub fn mark_saved(&mut self, model: Arc<Model>) {
        self.saved = model;
    }

    pub fn is_changed(&self) -> bool {
        !Arc::ptr_eq(&self.saved, &self.model) && *self.saved != *self.model
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Point;

    fn with(count: usize) -> Arc<Model> {
        let points = (0..count).map(|index| Point { id: format!("p{index}") }).collect();
        Arc::new(Model { points, ..Model::default() })
    }

    #[test]
    fn a_gesture_is_one_step_and_can_be_given_up() {
        let mut document = Document::new(Model::default());
        let press = Some(Gesture::Press(1));
        for count in 1..4 {
            document.change("Draw".into(), with(count), press);
        }
        document.commit();
        assert_eq!((document.undo_name(), document.model().points.len()), (Some("Draw"), 3));
        // The same again, by another movement of the hand.
        document.change("Draw".into(), with(4), Some(Gesture::Press(2)));
        document.change("Draw".into(), with(5), Some(Gesture::Press(3)));
        document.cancel_gesture();
        assert_eq!(document.model().points.len(), 4);
        assert!(document.is_changed());
        document.undo();
        assert_eq!(document.model().points.len(), 3);
        document.mark_saved(document.model().clone());
        document.undo();
        assert_eq!(document.undo(), None);
        document.redo();
        assert!(!document.is_changed() && document.redo_name().is_some());
        // A gesture that ends where it began is no step.
        document.change("Draw".into(), with(6), press);
        document.change("Draw".into(), with(3), press);
        document.commit();
        assert_eq!(document.redo_name(), Some("Draw"));
    }
}
