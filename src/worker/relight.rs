//! Progressive rendering of a recovered scene while it is edited: a noisy picture within a moment
//! of every change, which becomes cleaner until the next.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use crate::geometry::bvh::RayCaster;
use crate::render::Engine;
use crate::render::preview::{Asked, Picture, Plan, Preview};
use crate::render::scene::Solved;
use crate::scene::{Capture, Views};
use crate::watch::{Cancelled, Watch};
use crate::worker::engine::{self, Chosen};
use crate::worker::event::JobEvent;

/// A session over one recovered scene; it lasts until it is cancelled.
#[derive(Clone, Debug)]
pub struct Relighting {
    /// The capture that was reconstructed.
    pub capture: Arc<Capture>,
    /// What was recovered.
    pub solved: Arc<Solved>,
    /// What traces the paths.
    pub engine: Engine,
    /// Where requests come in while this runs.
    pub latest: LatestRequest,
}

/// A picture that is asked for: which scene, from where.
pub type PreviewRequest = Asked;

/// The picture of a request, as far as it is refined.
#[derive(Clone, Debug)]
pub struct Relit {
    /// The number that [`LatestRequest::put`] gave the request.
    pub number: u64,
    /// As far as it is refined.
    pub picture: Picture,
    /// Why no graphics card traces it, though one may.
    pub no_card: Option<String>,
}

impl std::ops::Deref for Relit {
    type Target = Picture;

    fn deref(&self) -> &Picture {
        &self.picture
    }
}

/// A slot that holds the newest request alone: an older one that is not finished is dropped. Clones
/// share the slot.
#[derive(Clone, Debug, Default)]
pub struct LatestRequest(Arc<(Mutex<Slot>, Condvar)>);

#[derive(Debug, Default)]
struct Slot {
    request: Option<Arc<PreviewRequest>>,
    number: u64,
    /// Cancels the picture in progress.
    answering: Option<Watch>,
}

impl LatestRequest {
    /// Replaces the request before, whose picture is cancelled; returns the new request's number.
    pub fn put(&self, request: PreviewRequest) -> u64 {
        let mut slot = self.lock();
        slot.request = Some(Arc::new(request));
        slot.number += 1;
        if let Some(watch) = &slot.answering {
            watch.cancel();
        }
        self.0.1.notify_all();
        slot.number
    }

    /// Waits for a request with a number above `seen`.
    fn next(&self, seen: u64, watch: &Watch) -> Result<(u64, Arc<PreviewRequest>), Cancelled> {
        let mut slot = self.lock();
        loop {
            watch.check()?;
            if let Some(request) = slot.request.clone().filter(|_| slot.number > seen) {
                return Ok((slot.number, request));
            }
            // Cancelling a watch does not signal the condition variable, so it is polled.
            let waited = self.0.1.wait_timeout(slot, Duration::from_millis(50));
            slot = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// A request with a number above `seen`, where there is one.
    fn newer(&self, seen: u64) -> Option<(u64, Arc<PreviewRequest>)> {
        let slot = self.lock();
        slot.request.clone().filter(|_| slot.number > seen).map(|request| (slot.number, request))
    }

    /// A watch that is cancelled as soon as there is a request with a number above `number`.
    fn until_later(&self, number: u64, watch: &Watch) -> Watch {
        let part = watch.part();
        let mut slot = self.lock();
        if slot.number > number {
            part.cancel();
        }
        slot.answering = Some(part.clone());
        part
    }

    fn lock(&self) -> MutexGuard<'_, Slot> {
        self.0.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Renders requests until cancelled, on threads of low priority: refinement uses every core all the
/// time, and the window must stay responsive on a machine that has few.
pub(super) fn perform(
    relighting: &Relighting,
    watch: &Watch,
    emit: &(dyn Fn(JobEvent) + Sync),
) -> Result<JobEvent, Cancelled> {
    let threads = rayon::ThreadPoolBuilder::new()
        .thread_name(|_| "relight".to_owned())
        .start_handler(|_| lower_thread_priority())
        .build();
    match threads {
        Ok(threads) => threads.install(|| answer_all(relighting, watch, emit)),
        Err(_) => answer_all(relighting, watch, emit),
    }
}

/// Lowers the priority of this thread, where that is possible.
fn lower_thread_priority() {
    #[cfg(target_os = "linux")]
    // SAFETY: takes numbers only. On Linux, process 0 is the calling thread. Whether it succeeds
    // changes no result.
    unsafe {
        libc::setpriority(libc::PRIO_PROCESS, 0, 10);
    }
}

fn answer_all(
    relighting: &Relighting,
    watch: &Watch,
    emit: &(dyn Fn(JobEvent) + Sync),
) -> Result<JobEvent, Cancelled> {
    let Relighting { capture, solved, engine, latest } = relighting;
    let caster = RayCaster::build(&capture.mesh.positions, &capture.mesh.triangles);
    let views = Views::new(capture, &caster, watch)?;
    let Chosen { tracer, reason } = engine::tracer(*engine);
    let mut preview = Preview::by(tracer.clone(), &views, solved);
    let mut seen = 0;
    let show = |preview: &mut Preview, number: u64| {
        if let Some(picture) = preview.picture() {
            let failed =
                tracer.trouble().map(|trouble| format!("the graphics card failed: {trouble}"));
            let no_card = failed.or_else(|| reason.clone());
            emit(JobEvent::Relit(Arc::new(Relit { number, picture, no_card })));
        }
    };
    let mut plan: Option<Plan> = None;
    loop {
        // With nothing left to trace there is only a request to wait for.
        let newer =
            if plan.is_some() { latest.newer(seen) } else { Some(latest.next(seen, watch)?) };
        if let Some((number, request)) = newer {
            seen = number;
            preview.ask(Asked {
                photograph: request.photograph.filter(|&of| of < capture.photographs.len()),
                ..(*request).clone()
            });
            show(&mut preview, seen);
        } else if let Some(plan) = &plan {
            // While the view turns, or a light is moved, requests come faster than pictures are made:
            // what there is no picture without is never cancelled, or nothing would be shown.
            let answering =
                if plan.is_first { watch.clone() } else { latest.until_later(seen, watch) };
            // Cancelled by a newer request the loop goes on; cancelled by the session it ends.
            match preview.trace(plan, &answering) {
                Ok(()) => show(&mut preview, seen),
                Err(Cancelled) => watch.check()?,
            }
        }
        plan = preview.plan();
    }
}
