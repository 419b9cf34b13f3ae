//! A capture of the example's photographs in which one thing lies beside its edges.

use std::fs;
use std::path::{Path, PathBuf};

use glam::DVec2;
use lobelia::io::model as files;
use lobelia::model::{AdjustOptions, Model, Place, Stroke, solve, to_edges};

/// The thing that lies beside its edges.
pub const THING: &str = "box1";
/// By how much its numbers are wrong: x, y, yaw, width, depth, height.
const WRONG: [f64; 6] = [0.04, -0.03, 0.03, 0.03, 0.03, -0.03];

/// The model of the example's room as it was drawn, and the same with the thing displaced; its
/// strokes agree in all photographs on the wrong place.
pub fn models() -> [Model; 2] {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut model = files::read(&root.join("tests/golden/model/corner-diffuse.json")).unwrap();
    // The example has the photographs of corner-diffuse at half their size.
    for photograph in &mut model.photographs {
        photograph.size = (photograph.size.0 / 2, photograph.size.1 / 2);
    }
    for lens in &mut model.lenses {
        lens.focal_px = lens.focal_px.map(|own| 0.5 * own);
        lens.principal_px = lens.principal_px.map(|own| 0.5 * own);
    }
    for stroke in &mut model.strokes {
        match stroke {
            Stroke::Line { from, to, .. } | Stroke::Edge { from, to, .. } => {
                (*from, *to) = (0.5 * *from, 0.5 * *to);
            }
            Stroke::Pick { pixel, .. } | Stroke::Rim { pixel, .. } => *pixel *= 0.5,
            Stroke::Position { .. } | Stroke::Length { .. } => {}
        }
    }
    let solution = solve(&model, &AdjustOptions::default()).unwrap();
    let thing = thing(&model);
    let mut wrong = solution.state.clone();
    for (value, by) in wrong.things[thing].iter_mut().flatten().zip(WRONG) {
        *value += by;
    }
    let displaced = to_edges::follow(&model, &solution.state, &wrong, thing);
    [model, displaced]
}

/// A capture of the example's photographs with that model.
pub fn capture(folder: &Path, model: &Model) -> PathBuf {
    let images = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/examples/corner/images");
    let mut images: Vec<PathBuf> =
        fs::read_dir(images).unwrap().map(|image| image.unwrap().path()).collect();
    images.sort();
    let capture = folder.join("capture");
    files::new_capture(&capture, &images, &lobelia::watch::Watch::new()).unwrap();
    files::save(&capture, model).unwrap();
    capture
}

/// Its index.
pub fn thing(model: &Model) -> usize {
    model.things.iter().position(|own| own.id == THING).unwrap()
}

/// How far the corners of the thing are shown from where another model shows them: the root mean
/// square, in pixels; and the strokes that are not about its corners are the same.
pub fn apart_px(a: &Model, b: &Model) -> f64 {
    assert_eq!(a.strokes.len(), b.strokes.len());
    let own = thing(a);
    let mut squares: Vec<f64> = Vec::new();
    for (a, b) in a.strokes.iter().zip(&b.strokes) {
        let is_own = |place: &Place| matches!(place, Place::Corner { thing, .. } if *thing == own);
        match (a, b) {
            _ if !a.places().iter().any(is_own) => assert!(is_same(a, b), "{a:?} {b:?}"),
            (Stroke::Pick { pixel: a, .. }, Stroke::Pick { pixel: b, .. }) => {
                squares.push(a.distance_squared(*b));
            }
            _ => {}
        }
    }
    assert!(squares.len() >= 12, "{} picks", squares.len());
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// The same to a billionth of a pixel: files keep fewer digits than memory.
fn is_same(a: &Stroke, b: &Stroke) -> bool {
    let pixels = |own: &Stroke| -> Vec<DVec2> {
        match own {
            Stroke::Line { from, to, .. } | Stroke::Edge { from, to, .. } => vec![*from, *to],
            Stroke::Pick { pixel, .. } | Stroke::Rim { pixel, .. } => vec![*pixel],
            Stroke::Position { .. } | Stroke::Length { .. } => Vec::new(),
        }
    };
    (a.name(), a.photograph(), a.places()) == (b.name(), b.photograph(), b.places())
        && pixels(a).iter().zip(pixels(b)).all(|(a, b)| a.distance(b) < 1e-9)
}
