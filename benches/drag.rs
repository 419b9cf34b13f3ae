//! What follows a corner that is dragged in a scene of 20 photographs and 30 boxes.
//!
//!     cargo bench --bench drag
//!
//! prints, besides Criterion's lines, the time from one place of the hand to the next: solved near the
//! solution before, and from nothing. An engine has placed the photographs; the scene has picked corners
//! alone, 2000 points of the engine besides, and found edges besides.

use std::f64::consts::TAU;
use std::sync::Arc;
use std::time::{Duration, Instant};

use criterion::Criterion;
use glam::{DMat3, DVec2, DVec3};
use lobelia::math::sampling::Random;
use lobelia::model::{
    AdjustOptions, Fit, FoundPoint, FoundPose, Lens, Model, Optic, Photograph, Place, Pose, Shape,
    Stroke, Support, Surfaces, Thing, solve, solve_near, things,
};
use lobelia::worker::{Command, JobEvent, Modelling, SolvedModel, Worker};

const SIZE: (usize, usize) = (640, 480);
const FOCAL_PX: f64 = 620.0;
const PHOTOGRAPHS: usize = 20;
const BOXES: usize = 30;
const POINTS: usize = 2000;

fn main() {
    let mut criterion =
        Criterion::default().measurement_time(Duration::from_secs(5)).configure_from_args();
    for (name, has_points, has_edges) in
        [("drawn", false, false), ("points", true, false), ("found edges", false, true)]
    {
        let model = scene(has_points, has_edges);
        let solution = solve(&model, &AdjustOptions::default()).expect("it can be solved");
        assert!(solution.is_usable(), "{:?}", solution.problems);
        let mut next = model.clone();
        if let Stroke::Pick { pixel, .. } = &mut next.strokes[3] {
            *pixel += DVec2::new(2.0, -1.0);
        }
        let near = || solve_near(&next, (&model, &solution)).expect("only a stroke has moved");
        criterion.bench_function(&format!("drag/{name}"), |bench| bench.iter(near));
        let of_near = median_ms(|| drop(near()));
        let drawn = drawn_ms(&model, &next);
        let of_all = median_ms(|| drop(solve(&next, &AdjustOptions::default())));
        println!(
            "drag/{name}: {} strokes, {of_near:.1} ms near the solution before ({} steps), {drawn:.1} ms until \
             its edges are drawn, {of_all:.1} ms from nothing, ratio {:.1}",
            model.strokes.len(),
            near().steps,
            of_all / of_near
        );
    }
    criterion.final_summary();
}

/// How long the window waits for a worker that solves the model near another and draws its edges.
fn drawn_ms(before: &Model, next: &Model) -> f64 {
    let mut worker = Worker::start(|| ()).expect("a thread");
    let mut answer = |what: Modelling| {
        let job = worker.send(Command::Model(what));
        let mut events = worker.events().iter();
        events.find(|own| own.job == job && own.what.is_ending()).expect("an answer").what
    };
    let mut solved = |model: &Model, near: Option<Arc<SolvedModel>>| {
        let model = Arc::new(model.clone());
        match answer(Modelling::Solve { model, near }) {
            JobEvent::ModelSolved(of) => {
                answer(Modelling::Draw { of: of.clone(), photograph: 0 });
                of
            }
            _ => panic!("it is not solved"),
        }
    };
    let near = solved(before, None);
    median_ms(|| drop(solved(next, Some(near.clone()))))
}

/// The median time of nine runs, in milliseconds.
fn median_ms(mut run: impl FnMut()) -> f64 {
    let time = |_| {
        let start = Instant::now();
        run();
        start.elapsed().as_secs_f64()
    };
    let mut times: Vec<f64> = (0..9).map(time).collect();
    times.sort_by(f64::total_cmp);
    1e3 * times[times.len() / 2]
}

fn pose(index: usize) -> Pose {
    let angle = index as f64 * TAU / PHOTOGRAPHS as f64;
    let position = DVec3::new(2.2 * angle.cos(), 2.2 * angle.sin(), 1.1 + 0.1 * (index % 3) as f64);
    let back = (position - DVec3::new(0.0, 0.0, 0.1)).normalize_or_zero();
    let x = DVec3::Z.cross(back).normalize_or_zero();
    Pose { world_from_camera: DMat3::from_cols(x, back.cross(x), back), position }
}

/// Boxes on a floor, each picked in three photographs, with errors of a pixel.
fn scene(has_points: bool, has_edges: bool) -> Model {
    let optic = Optic {
        focal_px: FOCAL_PX,
        principal_px: 0.5 * DVec2::new(SIZE.0 as f64, SIZE.1 as f64),
        radial: DVec2::ZERO,
    };
    let mut random = Random::new(1, 0, 0);
    let mut uniform = move || 2.0 * f64::from(random.uniform()) - 1.0;
    let seen =
        |photograph: usize, place: DVec3| Some(pose(photograph).project(&optic, place)?.pixel);
    let thing = |index: usize| Thing {
        id: format!("box{index}"),
        shape: Shape::Box { flush: None },
        on: Support::Floor,
        held: Vec::new(),
        surfaces: Surfaces::default(),
    };
    let photograph = |index: usize| Photograph {
        name: format!("{index}.png"),
        lens: 0,
        size: SIZE,
        found: Some(FoundPose { pose: pose(index), distance: 2.4 }),
    };
    let fit = Fit { focal: true, principal: false, k1: false, k2: false };
    let mut model = Model {
        lenses: vec![Lens {
            id: "lens".into(),
            focal_px: Some(FOCAL_PX),
            principal_px: None,
            radial: DVec2::ZERO,
            fit,
        }],
        photographs: (0..PHOTOGRAPHS).map(photograph).collect(),
        things: (0..BOXES).map(thing).collect(),
        ..Model::default()
    };
    let mut edges = Vec::new();
    for index in 0..BOXES {
        let middle = DVec2::new(0.6 * uniform(), 0.6 * uniform());
        let turn = DVec2::from_angle(uniform());
        let corner = |k: usize| {
            let (s, t) = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)][k % 4];
            let flat = middle + turn.rotate(DVec2::new(0.07 * s, 0.05 * t));
            flat.extend(if k < 4 { 0.0 } else { 0.12 })
        };
        let at = |corner: usize| Place::Corner { thing: index, corner };
        if index == 0 {
            for k in [0, 1] {
                model.strokes.push(Stroke::Position { at: at(k), position: corner(k), sd_m: 1e-3 });
            }
        }
        for k in 0..3 {
            let photograph = (7 * k + index) % PHOTOGRAPHS;
            for k in (0..8).filter(|k| k % 4 != index % 4) {
                let Some(pixel) = seen(photograph, corner(k)) else { continue };
                let pixel = pixel + DVec2::new(uniform(), uniform());
                model.strokes.push(Stroke::Pick { photograph, at: at(k), pixel });
            }
        }
        for (k, [a, b]) in things::edges(&model.things[index]).into_iter().enumerate() {
            for photograph in (0..PHOTOGRAPHS).filter(|own| has_edges && (own + k) % 4 == 0) {
                let ends = seen(photograph, corner(a)).zip(seen(photograph, corner(b)));
                let Some((from, to)) = ends else { continue };
                let between = [at(a), at(b)];
                edges.push(Stroke::Edge { photograph, between, from, to, sd_px: Some(0.1) });
            }
        }
    }
    model.strokes.extend(edges);
    let point = |_| {
        let position = DVec3::new(uniform(), uniform(), 0.2 * (1.0 + uniform()));
        let shown: Vec<(usize, DVec2)> = (0..PHOTOGRAPHS)
            .filter_map(|own| Some((own, seen(own, position)?)))
            .filter(|own| own.1.cmpge(DVec2::ZERO).all())
            .take(5)
            .collect();
        FoundPoint {
            position,
            photographs: shown.iter().map(|own| own.0).collect(),
            pixels: shown.iter().map(|own| own.1 + DVec2::new(uniform(), uniform())).collect(),
        }
    };
    if has_points {
        model.found_points = Arc::new((0..POINTS).map(point).collect());
    }
    model
}
