//! The sun: a directional light, whose sharp shadows cannot be represented by lobes.

use glam::Vec3;
use rayon::prelude::*;

use crate::math::sampling::fibonacci;
use crate::reconstruct::Error;
use crate::reconstruct::joint::background::World;
use crate::reconstruct::joint::fit::{Fitted, ROUGH, fit};
use crate::reconstruct::joint::part::{Part, PartKind};
use crate::reconstruct::joint::problem::Problem;
use crate::reconstruct::joint::sun_gain::{Place, SunGain, column, is_above, pixels};
use crate::watch::Cancelled;

/// Directions over the sphere at which the search begins: about 5° apart.
const DIRECTIONS: usize = 1500;
/// Most rows of the first search.
const FIRST_ROWS: usize = 1200;
/// Most pixels of all photographs that the refinement uses. With rows alone, ten times fewer, the
/// errors of suns were up to 4° in random rooms with windows (window-0, -3, -4 and coat-2); with
/// pixels they are up to 0.34°.
const PIXELS: usize = 20_000;
/// Pixels by which the directions that are refined are chosen.
const FEW_PIXELS: usize = 5_000;
/// Local searches, from the strongest of the first directions.
const STARTS: usize = 3;

/// Possible directions of a sun, with the rows that it would light.
pub struct Directions {
    towards: Vec<Vec3>,
    /// Of each direction the next ones around it, and itself.
    neighbours: Vec<Vec<usize>>,
    rows: Vec<Place>,
    /// V cos θ per direction and row.
    columns: Vec<Vec<f32>>,
    /// Per direction whether its light would come through an opening.
    through_opening: Vec<bool>,
    few_pixels: Vec<Place>,
    pixels: Vec<Place>,
}

impl Directions {
    /// Directions above the horizon; none where none is looked for.
    ///
    /// # Errors
    /// If it is cancelled.
    pub fn new(problem: &Problem, is_wanted: bool) -> Result<Self, Cancelled> {
        let rows: Vec<Place> =
            problem.every(FIRST_ROWS).iter().map(|&row| Place::of_row(problem, row)).collect();
        let towards: Vec<Vec3> = fibonacci(if is_wanted { DIRECTIONS } else { 0 }, 0.0)
            .filter(|&towards| is_above(towards))
            .collect();
        let columns: Vec<Vec<f32>> = towards
            .par_iter()
            .map(|&towards| {
                problem.watch().check()?;
                Ok(column(problem.data.views, &rows, towards))
            })
            .collect::<Result<_, Cancelled>>()?;
        let neighbours = neighbours(&towards);
        let through_opening = through_opening(&neighbours, &columns);
        let pixels = |most: usize| pixels(problem, if is_wanted { most } else { 0 });
        let (few_pixels, pixels) = (pixels(FEW_PIXELS), pixels(PIXELS));
        Ok(Self { towards, neighbours, rows, columns, through_opening, few_pixels, pixels })
    }

    /// The directions towards a sun that lower the cost of a fit most, and by how much the cost
    /// falls with the first; none if no direction lowers it. In a room only directions through an
    /// opening are used: the shadows of unknown walls are unknown, and without them a sun cannot be
    /// distinguished from a lamp.
    pub fn first(&self, problem: &Problem, fitted: &Fitted) -> (Vec<Vec3>, f64) {
        let gain = SunGain::new(problem, fitted, &self.rows, None);
        let is_room = fitted.model.layout().is_some_and(|layout| layout.world == World::Room);
        let fall = |(column, &through_opening): (&Vec<f32>, &bool)| {
            if through_opening || !is_room { gain.fall(column) } else { 0.0 }
        };
        let falls: Vec<f64> =
            self.columns.par_iter().zip(&self.through_opening).map(fall).collect();
        let is_peak = |&k: &usize| {
            falls[k] > 0.0 && self.neighbours[k].iter().all(|&other| falls[other] <= falls[k])
        };
        let mut order: Vec<usize> = (0..falls.len()).filter(is_peak).collect();
        order.sort_by(|&a, &b| falls[b].total_cmp(&falls[a]).then(a.cmp(&b)));
        let fall = order.first().map_or(0.0, |&k| falls[k]);
        (order.iter().take(STARTS).map(|&k| self.towards[k]).collect(), fall)
    }

    /// The fit of least cost with a sun near one of these directions; `None` if none lowers the
    /// cost. [`SunGain`] dims all other light by one factor and cannot decide between directions:
    /// in a fit, the sky around the sun can become darker than the rest.
    ///
    /// # Errors
    /// If it is cancelled, or if the bounded least squares of a fit fails.
    pub fn add(
        &self,
        problem: &Problem,
        from: &Fitted,
        starts: &[Vec3],
    ) -> Result<Option<Fitted>, Error> {
        if starts.is_empty() {
            return Ok(None);
        }
        let gain = SunGain::new(problem, from, &self.few_pixels, None);
        let near = |&start: &Vec3| -> Result<Fitted, Error> {
            let towards = gain.climb(problem, &self.few_pixels, start)?;
            let model = from.model.with(Part::sun(problem, towards)?);
            fit(problem, &model, Some(from), ROUGH)
        };
        let fits = starts.iter().map(near).collect::<Result<Vec<_>, _>>()?;
        let best = fits.into_iter().min_by(|a, b| a.cost().total_cmp(&b.cost()));
        Ok(best.filter(|best| best.cost() < from.cost()))
    }

    /// The fit with its sun in the best direction near that which it has, if it has one that was found.
    ///
    /// # Errors
    /// As [`Directions::add`].
    pub fn settle(&self, problem: &Problem, fitted: Fitted) -> Result<Fitted, Error> {
        let Some(Part { slot, kind: PartKind::Sun(first), .. }) = fitted.model.sun().cloned()
        else {
            return Ok(fitted);
        };
        let gain = SunGain::new(problem, &fitted, &self.pixels, Some(slot));
        let towards = gain.climb(problem, &self.pixels, first)?;
        if towards == first {
            return Ok(fitted);
        }
        let model = fitted.model.replacing(slot, Part::sun(problem, towards)?);
        let moved = fit(problem, &model, Some(&fitted), ROUGH)?;
        Ok(if moved.cost() < fitted.cost() { moved } else { fitted })
    }
}

/// Of each direction the next ones around it, and itself.
fn neighbours(towards: &[Vec3]) -> Vec<Vec<usize>> {
    // On an even grid these are up to about 1.3 times as far apart as they are on average.
    let apart = 1.3 * (4.0 * std::f32::consts::PI / DIRECTIONS as f32).sqrt();
    let is_near = |a: Vec3, b: Vec3| a.dot(b) > apart.cos();
    let of = |&a: &Vec3| (0..towards.len()).filter(|&k| is_near(a, towards[k])).collect();
    towards.par_iter().map(of).collect()
}

/// Per direction whether it lies in an opening for most places that it reaches: in a connected set
/// of unoccluded directions that is less than a quarter of all.
fn through_opening(neighbours: &[Vec<usize>], columns: &[Vec<f32>]) -> Vec<bool> {
    let most = neighbours.len() / 4;
    let places = columns.first().map_or(0, Vec::len);
    let in_opening: Vec<Vec<usize>> = (0..places)
        .into_par_iter()
        .map(|place| {
            let mut is_left: Vec<bool> = columns.iter().map(|column| column[place] > 0.0).collect();
            let mut found = Vec::new();
            for first in 0..neighbours.len() {
                if !std::mem::take(&mut is_left[first]) {
                    continue;
                }
                let together = connected(first, neighbours, &mut is_left);
                if together.len() < most {
                    found.extend(together);
                }
            }
            found
        })
        .collect();
    let mut counts = vec![0; neighbours.len()];
    in_opening.into_iter().flatten().for_each(|direction| counts[direction] += 1);
    let reached = columns.iter().map(|column| column.iter().filter(|reach| **reach > 0.0).count());
    counts.iter().zip(reached).map(|(&count, reached)| 2 * count > reached).collect()
}

/// The directions that are reached from a first one over neighbours that are left, which are taken away.
fn connected(first: usize, neighbours: &[Vec<usize>], is_left: &mut [bool]) -> Vec<usize> {
    let mut together = vec![first];
    let mut next = 0;
    while let Some(&direction) = together.get(next) {
        next += 1;
        let around = neighbours[direction].iter();
        together.extend(around.filter(|&&neighbour| std::mem::take(&mut is_left[neighbour])));
    }
    together
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two of three places see the sky in a cone of 20°, the third sees all of it.
    #[test]
    fn a_sun_in_an_opening_is_told_from_one_in_the_open() {
        let towards: Vec<Vec3> = fibonacci(DIRECTIONS, 0.0).filter(|&d| is_above(d)).collect();
        let middle = Vec3::new(0.0, -0.7, 0.7).normalize_or_zero();
        let angle = |direction: Vec3| direction.angle_between(middle).to_degrees();
        let seen = |direction: Vec3| if angle(direction) < 20.0 { 1.0 } else { 0.0 };
        let columns: Vec<Vec<f32>> = towards.iter().map(|&d| vec![seen(d), seen(d), 1.0]).collect();
        let found = through_opening(&neighbours(&towards), &columns);
        for (&direction, found) in towards.iter().zip(found) {
            assert_eq!(found, angle(direction) < 20.0, "{direction}");
        }
        // Where most places see all of the sky there is no opening.
        let columns: Vec<Vec<f32>> = towards.iter().map(|&d| vec![seen(d), 1.0, 1.0]).collect();
        assert!(!through_opening(&neighbours(&towards), &columns).contains(&true));
    }

    #[test]
    fn every_direction_has_some_next_ones_around_it() {
        let towards: Vec<Vec3> = fibonacci(DIRECTIONS, 0.0).filter(|&d| is_above(d)).collect();
        for (k, around) in neighbours(&towards).iter().enumerate() {
            // Itself and four to eight more; at the horizon half of them.
            assert!(around.contains(&k) && (3..=9).contains(&around.len()), "{}", around.len());
        }
    }
}
