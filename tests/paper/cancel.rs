//! A cancelled reconstruction ends with `Error::Cancelled` and delivers nothing more.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::SeqCst};

use lobelia::reconstruct::{Error, Stage, Update};
use lobelia::watch::Watch;

use crate::rooms::{box_room, quick};

/// Runs the box room, cancelling when `when` says so of an update; counts the updates after it.
fn cancelled_when(when: impl Fn(&Update) -> bool + Sync) -> (Result<(), Error>, usize) {
    let mut room = box_room();
    // With a texture, so that the last stage has something to do as well.
    room.capture.materials[0].textured = true;
    let watch = Watch::new();
    let (after, cancelled) = (AtomicUsize::new(0), AtomicBool::new(false));
    let result = lobelia::reconstruct::run(&room.capture, &quick(), &watch, &|update| {
        if cancelled.load(SeqCst) {
            after.fetch_add(1, SeqCst);
        } else if when(&update) {
            watch.cancel();
            cancelled.store(true, SeqCst);
        }
    });
    assert!(cancelled.load(SeqCst), "the moment to cancel never came");
    (result.map(|_| ()), after.load(SeqCst))
}

#[test]
fn every_stage_can_be_cancelled() {
    for stage in Stage::ALL {
        let (result, after) =
            cancelled_when(|update| matches!(update, Update::Stage(s) if *s == stage));
        assert!(matches!(result, Err(Error::Cancelled(_))), "{}: {result:?}", stage.name());
        assert_eq!(after, 0, "{} went on", stage.name());
    }
}

#[test]
fn an_iteration_can_be_the_last() {
    let (result, after) =
        cancelled_when(|update| matches!(update, Update::Iteration(i) if i.index == 2));
    assert!(matches!(result, Err(Error::Cancelled(_))), "{result:?}");
    assert_eq!(after, 0);
}

#[test]
fn a_job_cancelled_beforehand_does_not_begin() {
    let watch = Watch::new();
    watch.cancel();
    let products = AtomicUsize::new(0);
    let result = lobelia::reconstruct::run(&box_room().capture, &quick(), &watch, &|update| {
        products.fetch_add(usize::from(!matches!(update, Update::Stage(_))), SeqCst);
    });
    assert!(matches!(result, Err(Error::Cancelled(_))));
    assert_eq!(products.load(SeqCst), 0);
}

#[test]
fn a_cancel_from_another_thread_stops_a_stage_midway() {
    let room = box_room();
    let mut options = quick();
    // Hours of rays, if nobody looked at the watch within the stage.
    options.transport.rays = 1_000_000;
    options.lights.rays_per_sample = 100;
    let watch = Watch::new();
    let in_transport = AtomicBool::new(false);
    let result = std::thread::scope(|scope| {
        scope.spawn(|| {
            while !in_transport.load(SeqCst) {
                std::thread::yield_now();
            }
            watch.cancel();
        });
        lobelia::reconstruct::run(&room.capture, &options, &watch, &|update| {
            if matches!(update, Update::Stage(Stage::Transport)) {
                in_transport.store(true, SeqCst);
            }
        })
    });
    assert!(matches!(result, Err(Error::Cancelled(_))));
}
