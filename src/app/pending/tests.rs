use std::sync::atomic::{AtomicBool, Ordering::SeqCst};
use std::sync::{Arc, Barrier};
use std::time::{Duration, Instant};

use eframe::egui;

use super::{Answer, Pending};

/// Waits until it is over.
fn end<T>(pending: &Pending<T>) -> Answer<T> {
    let limit = Instant::now() + Duration::from_secs(60);
    loop {
        match pending.answer() {
            Answer::Waiting => assert!(Instant::now() < limit, "nothing came"),
            over => return over,
        }
        std::thread::yield_now();
    }
}

/// A context that tells whether a frame was asked for.
fn context() -> (egui::Context, Arc<AtomicBool>) {
    let (ctx, asked) = (egui::Context::default(), Arc::new(AtomicBool::new(false)));
    let told = asked.clone();
    ctx.set_request_repaint_callback(move |_| told.store(true, SeqCst));
    (ctx, asked)
}

fn wait_for(asked: &AtomicBool) {
    let limit = Instant::now() + Duration::from_secs(60);
    while !asked.load(SeqCst) {
        assert!(Instant::now() < limit, "no frame was asked for");
        std::thread::yield_now();
    }
}

#[test]
fn an_answer_comes_once_and_asks_for_a_frame() {
    let (ctx, asked) = context();
    let barrier = Arc::new(Barrier::new(2));
    let worker = barrier.clone();
    let pending = Pending::start("test", &ctx, move || {
        worker.wait();
        7
    });
    assert_eq!(pending.answer(), Answer::Waiting);
    let mut place = Some(pending);
    assert_eq!(Pending::take(&mut place), None);
    assert!(place.is_some() && !asked.load(SeqCst));
    barrier.wait();
    wait_for(&asked);
    assert_eq!(Pending::take(&mut place), Some(7));
    assert!(place.is_none());
    assert_eq!(Pending::take(&mut place), None);
}

#[test]
fn work_that_panics_is_told_from_work_that_goes_on() {
    let (ctx, asked) = context();
    let pending: Pending<u8> = Pending::start("test", &ctx, || panic!("a test's own"));
    assert_eq!(end(&pending), Answer::Lost);
    wait_for(&asked);
    let mut place = Some(pending);
    assert_eq!(Pending::take(&mut place), None);
    assert!(place.is_none(), "nobody waits on");
}
