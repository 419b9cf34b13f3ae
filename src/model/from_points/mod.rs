//! Things that are fitted to points which an engine found: a plane or a box, by the points inside of
//! an outline that is drawn on a photograph.
//!
//! Points inside the outline may lie behind the thing, or be wrong; the planes with the most
//! inliers are used. A plane becomes a polygon, the rectangle around its points. A box is upright,
//! has its faces where points lie in planes at right angles, and stands on the surface below it.
//! The corners of the new thing are marked in photographs that show its points, as if they had been
//! clicked there. It can therefore be edited like any drawn thing.

mod plane;
mod solid;

use glam::{DVec2, DVec3};

use super::things::{self, corner_names};
use super::unknowns::State;
use super::{FoundPoint, Model, ModelError, Place, Shape, Solution, Stroke, Support};
use crate::scene::Camera;

/// How far points may be from a face that they lie on, in pixels at their distance: an engine knows
/// the depth of a point less well than where a photograph shows it.
const REACH_PX: f64 = 4.0;
/// Points that are needed.
const LEAST: usize = 12;
/// The part of all points in the outline that must agree.
const AGREED: f64 = 0.25;
/// More points are thinned out.
const MOST: usize = 6000;
/// The sine of the angle within which a plane is taken to be level, where up is known: 3°.
const LEVEL: f64 = 0.052;
/// A photograph marks corners where it shows this part of the points.
const SHOWN: f64 = 0.1;
/// As many photographs mark them.
const PHOTOGRAPHS: usize = 4;
/// Corners may lie outside of a photograph by this part of its size.
const OUTSIDE: f64 = 0.5;

/// What is fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// A flat rectangle.
    Plane,
    /// An upright box.
    Box,
}

/// A thing that was fitted to points.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The model with it and its strokes.
    pub model: Model,
    /// Its index.
    pub thing: usize,
    /// Its corners in metres, before the strokes are solved.
    pub corners: Vec<DVec3>,
    /// Points in the outline, and those that lie on it.
    pub points: [usize; 2],
    /// How far these are from it, in pixels at their distance: root mean square.
    pub off_px: f64,
    /// Photographs that mark its corners.
    pub photographs: Vec<usize>,
}

impl Fitted {
    /// What was fitted, in words.
    pub fn words(&self) -> String {
        let [all, on] = self.points;
        format!(
            "{} is fitted to {on} of {all} points, which are off by {:.1} px. Its corners are marked in \
             {} photographs: drag them, or press E to fit it to edges.",
            self.model.things[self.thing].id,
            self.off_px,
            self.photographs.len()
        )
    }
}

/// A thing before it is a part of the model.
struct Form {
    shape: Shape,
    on: Support,
    corners: Vec<DVec3>,
    /// Whether a camera at that place could see a corner.
    sees: fn(&[DVec3], DVec3, usize) -> bool,
    /// Points on it, by their index among those in the outline.
    points: Vec<usize>,
    off: f64,
}

/// Fits a plane or a box to the points in an outline that is drawn on a photograph.
pub fn fit(
    model: &Model,
    solution: &Solution,
    photograph: usize,
    outline: &[DVec2],
    wanted: Wanted,
) -> Result<Fitted, ModelError> {
    let name = model.photographs.get(photograph).map_or("", |own| &own.name);
    let error = |problem: String, remedy: &str| {
        ModelError::new(format!("photographs[{photograph}] ({name})"), problem, remedy)
    };
    let Some(camera) = solution.cameras.get(photograph).and_then(Option::as_ref) else {
        let remedy = "Find cameras, or draw on it first";
        return Err(error(format!("{name} is not placed yet"), remedy));
    };
    let found = inside(model, &solution.state, photograph, camera, outline);
    let count = found.len();
    if count < LEAST {
        let problem = format!("the outline holds {count} points, and {LEAST} are needed");
        let remedy = "Draw around more of the points that Points shows, or show corners by hand";
        return Err(error(problem, remedy));
    }
    let step = count.div_ceil(MOST);
    let found: Vec<(&FoundPoint, DVec3)> = found.into_iter().step_by(step).collect();
    let points: Vec<DVec3> = found.iter().map(|own| own.1).collect();
    let pixel = pixel(camera, &points);
    let form = match wanted {
        Wanted::Plane => flat(model, &solution.state, camera, &points, REACH_PX * pixel),
        Wanted::Box => upright(model, &solution.state, camera, &points, REACH_PX * pixel),
    };
    let form = form.map_err(|(problem, remedy)| error(problem.to_owned(), remedy))?;
    if (form.points.len() as f64) < AGREED * points.len() as f64 {
        let problem = format!(
            "only {} of {} points in the outline agree on where it lies",
            form.points.len(),
            points.len()
        );
        return Err(error(problem, "Draw closer around it"));
    }
    let own: Vec<&FoundPoint> = form.points.iter().map(|&index| found[index].0).collect();
    let photographs = showing(solution, photograph, &own, &form.corners);
    if photographs.len() < 2 {
        let problem = format!("no photograph but {name} shows these points and all corners");
        return Err(error(problem, "Draw around less of it, or show its corners by hand"));
    }
    let mut model = model.clone();
    let thing = model.add_thing(form.shape);
    model.things[thing].on = form.on;
    for &index in &photographs {
        let Some(Some(camera)) = solution.cameras.get(index) else { continue };
        for (corner, place) in form.corners.iter().enumerate() {
            if !(form.sees)(&form.corners, camera.position, corner) {
                continue;
            }
            if let Some(pixel) = camera.place(*place) {
                let at = Place::Corner { thing, corner };
                model.add_stroke(Stroke::Pick { photograph: index, at, pixel });
            }
        }
    }
    debug_assert_eq!(corner_names(&model.things[thing]).len(), form.corners.len());
    Ok(Fitted {
        model,
        thing,
        corners: form.corners,
        points: [points.len(), form.points.len()],
        off_px: form.off / pixel,
        photographs,
    })
}

/// The points that a photograph shows inside of an outline, with where they are in the world.
fn inside<'a>(
    model: &'a Model,
    state: &State,
    photograph: usize,
    camera: &Camera,
    outline: &[DVec2],
) -> Vec<(&'a FoundPoint, DVec3)> {
    let shown = model.found_points.iter().filter(|own| own.photographs.contains(&photograph));
    let placed = shown.map(|own| (own, state.found.point(own.position)));
    let is_inside = |place: DVec3| camera.project(place).is_some_and(|own| holds(outline, own.0));
    placed.filter(|own| is_inside(own.1)).collect()
}

/// Whether an outline goes around a place.
pub fn holds(outline: &[DVec2], place: DVec2) -> bool {
    let ends = outline.iter().zip(outline.iter().cycle().skip(1));
    let crosses = |(a, b): &(&DVec2, &DVec2)| {
        (a.y <= place.y) != (b.y <= place.y)
            && a.x + (b.x - a.x) * (place.y - a.y) / (b.y - a.y) > place.x
    };
    ends.filter(crosses).count() % 2 == 1
}

/// How large a pixel of the photograph is at the points, in metres.
fn pixel(camera: &Camera, points: &[DVec3]) -> f64 {
    let focal_px = 0.5 * (camera.focal_px.x + camera.focal_px.y);
    let depths = points.iter().filter_map(|own| Some(camera.project(*own)?.1)).collect();
    plane::median(depths) / focal_px
}

/// What is told of the world: whether the vertical is known, and the height of the floor.
fn told(state: &State) -> (bool, bool) {
    let [_, tilt, roll, _, _, _, height] = state.kept;
    let is_up_told = !tilt && !roll;
    (is_up_told, is_up_told && !height)
}

/// The rectangle around the points of a plane.
fn flat(
    model: &Model,
    state: &State,
    camera: &Camera,
    points: &[DVec3],
    reach: f64,
) -> Result<Form, (&'static str, &'static str)> {
    const CLOSER: &str = "Draw closer around points of one plane";
    let (found, on) = plane::most(points, reach).ok_or(("the points show no plane", CLOSER))?;
    let middle = on.iter().map(|&own| points[own]).sum::<DVec3>() / on.len().max(1) as f64;
    let (is_up_told, is_floor_told) = told(state);
    let mut found = found.towards(camera.position - middle);
    // On the floor, or on the top of a thing, it lies there exactly.
    let mut support = Support::Free;
    if is_up_told && found.normal.z > 0.0 && found.normal.truncate().length() < LEVEL {
        let top = top_below(model, state, middle.truncate(), middle.z + reach);
        let near = |height: f64| (height - middle.z).abs() < 2.0 * reach;
        let lies = match top {
            Some((host, height)) if near(height) => Some((Support::Top(host), height)),
            _ if is_floor_told && near(0.0) => Some((Support::Floor, 0.0)),
            _ => None,
        };
        if let Some((on, height)) = lies {
            support = on;
            found = plane::Plane { normal: DVec3::Z, offset: height };
        }
    }
    let normal = found.normal;
    // As seen from before it: to the right and upwards, or in plan along x and y.
    let x = match normal.cross(DVec3::Z).length() < LEVEL {
        true => DVec3::X.reject_from(normal).normalize_or_zero(),
        false => DVec3::Z.cross(normal).normalize_or_zero(),
    };
    let y = normal.cross(x);
    let spread = |index: usize| DVec2::new(points[index].dot(x), points[index].dot(y));
    let places: Vec<DVec2> = on.iter().map(|&own| spread(own)).collect();
    let dense = plane::dense(&places);
    let places: Vec<DVec2> = dense.iter().map(|&own| places[own]).collect();
    let around = plane::rectangle(&places).ok_or(("the points lie on one line", CLOSER))?;
    let (low, high) = (around.low, around.high);
    if (high - low).min_element() <= reach {
        return Err(("the points lie on one line", CLOSER));
    }
    let corner = |a: f64, b: f64| {
        let place = a * around.axis + b * around.axis.perp();
        found.offset * normal + place.x * x + place.y * y
    };
    let corners = [(low.x, low.y), (high.x, low.y), (high.x, high.y), (low.x, high.y)];
    let on: Vec<usize> = dense.into_iter().map(|own| on[own]).collect();
    let squares = on.iter().map(|&own| found.distance(points[own]).powi(2)).sum::<f64>();
    Ok(Form {
        shape: Shape::Polygon { corners: 4 },
        on: support,
        corners: corners.map(|(a, b)| corner(a, b)).to_vec(),
        sees: |_, _, _| true,
        off: (squares / on.len().max(1) as f64).sqrt(),
        points: on,
    })
}

/// The box around the points of its faces.
fn upright(
    model: &Model,
    state: &State,
    camera: &Camera,
    points: &[DVec3],
    reach: f64,
) -> Result<Form, (&'static str, &'static str)> {
    let (is_up_told, is_floor_told) = told(state);
    let below = |place: DVec2, height: f64| {
        let top = top_below(model, state, place, height + reach).filter(|_| is_up_told);
        top.map(|own| (Support::Top(own.0), own.1))
            .or_else(|| is_floor_told.then_some((Support::Floor, 0.0)))
    };
    let floor = |place: DVec2, height: f64| Some(below(place, height)?.1);
    let eye = camera.position;
    let known = solid::Known { up: DVec3::Z, is_up_told, eye, reach, floor: &floor };
    let solid = solid::solid(points, &known).map_err(|reason| match reason {
        solid::NoBox::Shapeless => (
            "the points show no two faces at right angles of which one is level or upright",
            "Draw around more of it, or fit a plane",
        ),
        solid::NoBox::Flat => (
            "the points show one flat face, which is no box",
            "Draw around more of it, or fit a plane",
        ),
        solid::NoBox::Bottomless => (
            "the points show its top alone, and nothing tells where it ends below",
            "Draw around what it stands on, too, or show its corners by hand",
        ),
    })?;
    let (bottom, top) = (solid.corners[0], solid.corners[4]);
    let middle = solid.corners.iter().sum::<DVec3>().truncate() / 8.0;
    let on = below(middle, bottom.z).filter(|own| (own.1 - bottom.z).abs() < reach);
    debug_assert!(top.distance(bottom) > 0.0);
    Ok(Form {
        shape: Shape::Box { flush: None },
        on: on.map_or(Support::Floor, |own| own.0),
        corners: solid.corners,
        sees: sees_corner,
        points: solid.on,
        off: solid.off,
    })
}

/// Whether a camera sees one of the three faces of a box that meet in a corner.
fn sees_corner(corners: &[DVec3], eye: DVec3, corner: usize) -> bool {
    let (ring, other) = (corner - corner % 4, 4 - (corner - corner % 4));
    let beside = [1, 3].map(|step| corners[ring + (corner + step) % 4]);
    let [a, b] = beside;
    // Outward along each of the three edges that end here.
    [a, b, corners[other + corner % 4]]
        .into_iter()
        .any(|from| (corners[corner] - from).dot(eye - corners[corner]) > 0.0)
}

/// The highest top of a thing below a place that is not above a height.
fn top_below(model: &Model, state: &State, place: DVec2, most: f64) -> Option<(usize, f64)> {
    let corners = state.corners(model);
    let values = state.constants();
    let top = |index: usize| {
        state.things.get(index)?.as_ref()?;
        let own = &model.things[index];
        if !own.shape.has_top() {
            return None;
        }
        if let Some((circles, radius)) = things::rims(&model.things, index, &values) {
            let middle = super::jet::position(&circles[1]);
            return (middle.truncate().distance(place) < radius.value).then_some((index, middle.z));
        }
        let ring = &corners[index][corners[index].len() / 2..];
        let outline: Vec<DVec2> = ring.iter().map(|own| own.truncate()).collect();
        holds(&outline, place).then_some((index, ring.first()?.z))
    };
    let tops = (0..model.things.len()).filter_map(top).filter(|own| own.1 <= most);
    tops.max_by(|a, b| a.1.total_cmp(&b.1))
}

/// The photographs that mark the corners: the one that was drawn on, and of those that show enough
/// of the points the ones that see them from the most different sides.
fn showing(
    solution: &Solution,
    first: usize,
    points: &[&FoundPoint],
    corners: &[DVec3],
) -> Vec<usize> {
    let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
    let sight = |index: usize| -> Option<DVec3> {
        let camera = solution.cameras[index].as_ref()?;
        let size = DVec2::new(camera.width as f64, camera.height as f64);
        let is_near = |corner: &DVec3| {
            camera.place(*corner).is_some_and(|pixel| {
                pixel.cmpge(-OUTSIDE * size).all() && pixel.cmple((1.0 + OUTSIDE) * size).all()
            })
        };
        let is_all_near = corners.iter().all(is_near);
        is_all_near.then(|| (middle - camera.position).normalize_or_zero())
    };
    let count = |index: usize| points.iter().filter(|own| own.photographs.contains(&index)).count();
    let shows = |index: &usize| count(*index) as f64 >= (SHOWN * points.len() as f64).max(3.0);
    let all = (0..solution.cameras.len()).filter(shows);
    let mut left: Vec<(usize, DVec3)> =
        all.filter_map(|index| Some((index, sight(index)?))).collect();
    let mut chosen: Vec<(usize, DVec3)> = Vec::new();
    while chosen.len() < PHOTOGRAPHS && !left.is_empty() {
        // By the cosine of the angle to the nearest that is chosen.
        let near = |own: &(usize, DVec3)| {
            chosen.iter().map(|other| own.1.dot(other.1)).fold(-1.0, f64::max)
        };
        let next = match left.iter().position(|own| own.0 == first) {
            Some(place) => place,
            None => {
                let places = (0..left.len()).map(|place| (place, near(&left[place])));
                places.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |own| own.0)
            }
        };
        chosen.push(left.remove(next));
    }
    let mut list: Vec<usize> = chosen.into_iter().map(|own| own.0).collect();
    list.sort_unstable();
    list
}

#[cfg(test)]
mod tests;
