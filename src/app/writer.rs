//! Writes files for the window: on a thread, so that a slow disk does not delay input, and in
//! order, so that the last request is the one that remains.

use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;

type Write = Box<dyn FnOnce() -> Result<(), String> + Send>;

/// A handle on the thread; dropping it waits until all is written.
pub struct Writer {
    orders: Option<Sender<Write>>,
    problems: Receiver<String>,
    thread: Option<JoinHandle<()>>,
}

impl Writer {
    pub fn start() -> std::io::Result<Self> {
        let (orders, queue) = channel::<Write>();
        let (sender, problems) = channel();
        let thread = std::thread::Builder::new().name("writer".to_owned()).spawn(move || {
            for write in queue {
                if let Err(problem) = write() {
                    // The window may be gone.
                    let _ = sender.send(problem);
                }
            }
        })?;
        Ok(Self { orders: Some(orders), problems, thread: Some(thread) })
    }

    pub fn send(&self, write: impl FnOnce() -> Result<(), String> + Send + 'static) {
        if let Some(orders) = &self.orders {
            // The thread ends only when this sender is dropped.
            let _ = orders.send(Box::new(write));
        }
    }

    /// Waits until all that was asked for so far is written, or has failed.
    pub fn wait(&self) {
        let (sender, done) = channel();
        self.send(move || sender.send(()).map_err(|error| error.to_string()));
        let _ = done.recv();
    }

    /// What could not be written since this was last asked.
    pub fn problems(&self) -> Vec<String> {
        self.problems.try_iter().collect()
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        self.orders = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
