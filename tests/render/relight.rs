//! A scene that is looked at while it is changed.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use lobelia::reconstruct::lights::VirtualLight;
use lobelia::reconstruct::lobes::Lobe;
use lobelia::render::Engine;
use lobelia::render::edits::{AddedLight, Edits, Shape, Surroundings};
use lobelia::scene::{Camera, Emitter};
use lobelia::worker::{
    Command, Job, JobEvent, LatestRequest, PreviewRequest, Relighting, Relit, Worker,
};

use crate::rooms::camera;
use crate::stage::{Stage, floor, reflectance};

/// A floor under a recovered lamp, photographed.
fn lit() -> Stage {
    let mut stage = floor(reflectance(0.5, 0.0, 1.0));
    stage.solved.light.lights.lights.push(VirtualLight::lamp(Vec3::new(0.0, 0.0, 2.0), 0.2));
    let lobe = Lobe { light: 0, direction: -Vec3::Z, exponent: 0.0 };
    stage.solved.light.lobes.lobes.push(lobe);
    stage.solved.light.lobes.first.push(1);
    stage.solved.light.emission.push([10.0, 8.0, 6.0]);
    stage.room.photograph(view(), |struck| [struck.position.x as f32 + 6.0, 1.0, 2.0]);
    stage
}

fn view() -> Camera {
    camera((48, 32), 40.0, DVec3::new(0.0, -4.0, 2.0), DVec3::ZERO)
}

fn lamp(emission: f64) -> Edits {
    let emitter = Emitter::Sphere { center: Vec3::new(0.5, 0.0, 1.0), radius_m: 0.1 };
    let emission = [emission; 3];
    let lamp =
        AddedLight { name: "lamp".into(), shape: Shape::Emitter(emitter), emission, is_on: true };
    Edits { lights: vec![lamp], surroundings: Surroundings::Open, ..Edits::default() }
}

struct Session {
    worker: Worker,
    job: Job,
    latest: LatestRequest,
}

impl Session {
    fn over(stage: &Stage) -> Self {
        let mut worker = Worker::start(|| ()).unwrap();
        let latest = LatestRequest::default();
        let job = worker.send(Command::Relight(Relighting {
            capture: Arc::new(stage.room.capture.clone()),
            solved: Arc::new(stage.solved.clone()),
            engine: Engine::Processor,
            latest: latest.clone(),
        }));
        Self { worker, job, latest }
    }

    fn request(&self, edits: Edits, photograph: Option<usize>, before: bool) -> u64 {
        let request = PreviewRequest { edits: Arc::new(edits), camera: view(), photograph, before };
        self.latest.put(request)
    }

    fn next(&self) -> JobEvent {
        self.worker.events().recv().unwrap().what
    }

    /// The answers to a wish until one that will do.
    fn answer(&self, number: u64, will_do: impl Fn(&Relit) -> bool) -> Arc<Relit> {
        loop {
            match self.next() {
                JobEvent::Relit(relit) if relit.number == number && will_do(&relit) => {
                    return relit;
                }
                JobEvent::Relit(_) | JobEvent::Started => {}
                other => panic!("{other:?}"),
            }
        }
    }
}

fn mean(pixels: &[([f32; 3], f32)]) -> f64 {
    pixels.iter().map(|(radiance, _)| f64::from(radiance[1])).sum::<f64>() / pixels.len() as f64
}

#[test]
fn pictures_get_finer_then_clearer() {
    let session = Session::over(&lit());
    let number = session.request(Edits::default(), None, false);
    let all = |number: u64| {
        let mut seen = Vec::new();
        loop {
            let relit = session.answer(number, |_| true);
            seen.push((relit.width, relit.paths));
            if relit.is_done {
                assert_eq!((relit.width, relit.height), (48, 32));
                assert!(relit.before.is_none());
                return seen;
            }
        }
    };
    let finer = [(48, 8), (48, 16), (48, 32), (48, 64), (48, 128), (48, 256)];
    let seen = all(number);
    assert_eq!(seen[..4], [(6, 2), (12, 2), (24, 4), (48, 4)]);
    assert_eq!(seen[4..], finer);
    // The lamp alone is traced on the coarser steps: all else stays as fine as it is.
    let seen = all(session.request(lamp(5.0), None, false));
    assert_eq!(seen[..4], [(48, 2), (48, 2), (48, 4), (48, 4)]);
    assert_eq!(seen[4..], finer);
    // Its strength is a number.
    let relit = session.answer(session.request(lamp(50.0), None, false), |_| true);
    assert!(relit.is_done && relit.traced == 0 && relit.paths == 256);
}

#[test]
fn what_is_not_changed_is_as_before_to_the_bit() {
    let session = Session::over(&lit());
    let number = session.request(Edits::default(), None, true);
    let relit = session.answer(number, |relit| relit.width == 48);
    assert_eq!(relit.before.as_ref(), Some(&relit.after));
    assert!(mean(&relit.after) > 0.0);

    // In a photograph, whatever it shows.
    let number = session.request(Edits::default(), Some(0), true);
    let relit = session.answer(number, |relit| relit.width == 48 && relit.paths >= 8);
    let stage = lit();
    let photograph = stage.room.capture.photographs[0].image.as_ref().unwrap();
    let mut measured = 0;
    for (index, (radiance, coverage)) in relit.after.iter().enumerate() {
        if let Some(seen) = photograph.radiance(index % 48, index / 48) {
            assert_eq!((*radiance, *coverage), (seen, 1.0));
            measured += 1;
        }
    }
    assert!(measured > 400, "{measured}");
}

#[test]
fn the_newest_wish_counts_and_light_adds_up() {
    let session = Session::over(&lit());
    let plain = session.request(Edits::default(), None, false);
    session.answer(plain, |_| true);
    let dim = session.request(lamp(5.0), None, false);
    let first = session.answer(dim, |_| true);
    // The answer to `dim` is left where it is.
    let bright = session.request(lamp(500.0), None, true);
    let relit = loop {
        let JobEvent::Relit(relit) = session.next() else { panic!("an ending") };
        if relit.number == bright {
            break relit;
        }
        assert!(!relit.is_done, "the old request was answered in full");
    };
    let before = relit.before.as_ref().expect("asked for");
    let (base, dim, bright) = (mean(before), mean(&first.after), mean(&relit.after));
    // The same paths: a hundred times the light is a hundred times the difference.
    let ratio = (bright - base) / (dim - base);
    assert!((ratio - 100.0).abs() < 5.0, "{base} {dim} {bright}: {ratio}");

    let off = Edits { original_light: 0.0, ..Edits::default() };
    let number = session.request(off, None, false);
    assert_eq!(mean(&session.answer(number, |_| true).after), 0.0);
    let off = Edits { groups: [("lamp 1".to_owned(), 0.0)].into(), ..Edits::default() };
    let number = session.request(off, None, false);
    assert_eq!(mean(&session.answer(number, |_| true).after), 0.0);
}

#[test]
fn a_session_ends_when_it_is_cancelled() {
    let session = Session::over(&lit());
    let number = session.request(lamp(5.0), None, false);
    session.answer(number, |relit| relit.width == 12);
    session.worker.cancel(session.job);
    loop {
        match session.next() {
            JobEvent::Cancelled => break,
            JobEvent::Relit(_) => {}
            other => panic!("{other:?}"),
        }
    }
}
