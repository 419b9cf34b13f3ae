//! One answer that a thread works out, so that the window need not wait for it.

use std::sync::mpsc::{Receiver, TryRecvError, channel};

use eframe::egui;

/// An answer that is on its way.
pub struct Pending<T>(Receiver<T>);

/// What has come of it so far.
#[derive(Debug, PartialEq)]
pub enum Answer<T> {
    Waiting,
    Ready(T),
    /// The thread could not be started, or it panicked: nothing will come.
    Lost,
}

impl<T: Send + 'static> Pending<T> {
    /// Works an answer out on a thread of its own; a frame is drawn once it is there.
    pub fn start(
        name: &str,
        ctx: &egui::Context,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Self {
        let (sender, receiver) = channel();
        let waker = Waker(ctx.clone());
        let work = move || {
            // Dropped last, and when the work panics, too: the window finds what has come, or that
            // nothing will.
            let _waker = waker;
            let sender = sender;
            // Nobody may want it any more.
            let _ = sender.send(work());
        };
        let _ = std::thread::Builder::new().name(name.to_owned()).spawn(work);
        Self(receiver)
    }
}

impl<T> Pending<T> {
    pub fn answer(&self) -> Answer<T> {
        match self.0.try_recv() {
            Ok(answer) => Answer::Ready(answer),
            Err(TryRecvError::Empty) => Answer::Waiting,
            Err(TryRecvError::Disconnected) => Answer::Lost,
        }
    }

    /// Takes the answer once it is there; an answer that is there or lost leaves its place empty.
    pub fn take(place: &mut Option<Self>) -> Option<T> {
        let answer = place.as_ref().map_or(Answer::Lost, Self::answer);
        if answer.is_over() {
            *place = None;
        }
        match answer {
            Answer::Ready(answer) => Some(answer),
            Answer::Waiting | Answer::Lost => None,
        }
    }
}

impl<T> Answer<T> {
    /// Whether nothing more will come.
    pub fn is_over(&self) -> bool {
        !matches!(self, Self::Waiting)
    }
}

/// Asks for a frame when it goes.
struct Waker(egui::Context);

impl Drop for Waker {
    fn drop(&mut self) {
        self.0.request_repaint();
    }
}

#[cfg(test)]
mod tests;
