//! The outer loop: passes over `A` that price its columns, and solutions on the working ones.

use super::exchange::{self, State, violation};
use super::model::{FactorModel, GramModel, Model};
use super::system::{Point, System, norm};
use super::working::Working;
use super::{BoundedError, BoundedOptions, BoundedSolution, Path, PathChoice};
use crate::solve::kernels::dot;
use crate::watch::Watch;

/// Up to this many columns, all inner products cost less than the passes they save.
const FEW_COLUMNS: usize = 96;
/// A solution on the working columns should reduce their violations by this factor at least;
/// if not, their Gram matrix is too inaccurate.
const CONTRACTION: f64 = 0.1;
/// Passes without progress, on the orthogonal factor, before giving up.
const PATIENCE: usize = 4;
/// Columns that join the working set at once: this many, or this part of it if that is more.
const JOIN_AT_LEAST: usize = 32;
const JOIN_PART: usize = 8;
/// A column's place may be taken by another after it has been at a bound for this many solutions.
const KEEP: usize = 5;
/// Columns priced between complete passes: at most this many, or this part if that is more.
const SHORTLIST: usize = 512;
const SHORTLIST_PART: usize = 10;

pub fn solve(
    system: &System,
    point: Point,
    start: Option<&[f64]>,
    options: &BoundedOptions,
    watch: &Watch,
) -> Result<BoundedSolution, BoundedError> {
    let mut search = Search::new(system, point, options);
    let converged = search.run(options, watch)?;
    Ok(search.solution(start, converged))
}

struct Search<'a> {
    system: &'a System<'a>,
    point: Point,
    region: Region,
    working: Working,
    /// For how many solutions each place of the working set has been at a bound.
    idle: Vec<usize>,
    path: Path,
    /// Greatest violation, in the units of the scaled gradient, that counts as none.
    goal: f64,
    violations: Vec<f64>,
    /// Whether a column outside the working set was priced at the present point; those that
    /// were not do not join.
    fresh: Vec<bool>,
    iterations: usize,
    passes: usize,
}

impl<'a> Search<'a> {
    fn new(system: &'a System<'a>, point: Point, options: &BoundedOptions) -> Self {
        let n = system.columns;
        let region = Region::new(system);
        let path = match options.choice {
            PathChoice::Gram => Path::Gram,
            PathChoice::Auto if n <= FEW_COLUMNS => Path::Gram,
            _ => Path::Columns,
        };
        let goal = options.tolerance * system.scale;
        let (working, violations) = (Working::new(system), vec![0.0; n]);
        let (idle, iterations, passes) = (Vec::new(), 0, 1);
        let mut search = Self {
            system,
            point,
            region,
            working,
            idle,
            path,
            goal,
            violations,
            fresh: vec![true; n],
            iterations,
            passes,
        };
        let all = path == Path::Gram;
        let first: Vec<usize> = (0..n)
            .filter(|&j| if all { search.region.movable[j] } else { search.between(j) })
            .collect();
        search.extend(&first);
        search
    }

    /// Whether the optimum was reached.
    fn run(&mut self, options: &BoundedOptions, watch: &Watch) -> Result<bool, BoundedError> {
        let mut progress = Progress::default();
        // Whether the gradients of all columns are those of the present point, from A.
        let mut complete = true;
        let mut exact = false;
        loop {
            watch.check()?;
            let largest = self.find_violations();
            let spent = self.iterations >= options.max_iterations;
            if !complete && (spent || largest <= self.goal) {
                self.price_all();
                complete = true;
                continue;
            }
            if spent || largest <= self.goal {
                return Ok(largest <= self.goal);
            }
            if complete {
                let members = self.working.members().iter();
                let inside = members.map(|&j| self.violations[j]).fold(0.0, f64::max);
                let stalled = progress.stalled(largest, self.objective());
                if stalled >= PATIENCE {
                    return Ok(false);
                }
                let inaccurate =
                    self.passes > 1 && inside > self.goal && inside > CONTRACTION * progress.before;
                exact |= inaccurate || stalled > 0;
            }
            // The greatest since the last complete pass: a shortlist may hold little by chance.
            progress.before = if complete { largest } else { progress.before.max(largest) };

            let limit = options.max_iterations - self.iterations;
            // Half the goal leaves room for what is lost between the model and A.
            let correction = Correction { goal: 0.5 * self.goal, limit, watch };
            self.iterations += if exact {
                let members = self.exact_members();
                let mut model = FactorModel::of(self.system, &members, &self.point);
                correction.apply(&mut model, &members, &self.region, &mut self.point)?
            } else {
                let wanted = self.most_violating(|j| !self.working.contains(j));
                self.extend(&wanted);
                let members = self.working.members();
                let gradient = members.iter().map(|&j| self.point.gradient[j]).collect();
                let mut model = GramModel::new(self.working.gram(), gradient);
                correction.apply(&mut model, members, &self.region, &mut self.point)?
            };
            self.grow_idle();
            watch.check()?;

            // Columns that violated before and still stand outside are the likeliest to join
            // next; only when they are used up are all columns looked at again.
            let shortlist = if exact { Vec::new() } else { self.shortlist() };
            complete = shortlist.is_empty() || self.passes == 1;
            if complete {
                self.price_all();
            } else {
                self.system.evaluate(&mut self.point, Some(&shortlist));
                self.fresh.fill(false);
                shortlist.iter().for_each(|&j| self.fresh[j] = true);
            }
        }
    }

    /// The columns outside the working set that violate most by their latest gradients,
    /// ascending.
    fn shortlist(&self) -> Vec<usize> {
        let columns = self.system.columns;
        let mut found: Vec<(f64, usize)> = (0..columns)
            .filter(|&j| !self.working.contains(j))
            .map(|j| (self.region.violation(j, self.point.y[j], self.point.gradient[j]), j))
            .filter(|&(violation, _)| violation > self.goal)
            .collect();
        found.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        found.truncate(SHORTLIST.max(columns / SHORTLIST_PART));
        let mut found: Vec<usize> = found.into_iter().map(|found| found.1).collect();
        found.sort_unstable();
        found
    }

    fn price_all(&mut self) {
        self.system.evaluate(&mut self.point, None);
        self.fresh.fill(true);
        self.passes += 1;
    }

    fn find_violations(&mut self) -> f64 {
        for j in 0..self.system.columns {
            let (y, gradient) = (self.point.y[j], self.point.gradient[j]);
            let known = self.fresh[j] || self.working.contains(j);
            self.violations[j] = if known { self.region.violation(j, y, gradient) } else { 0.0 };
        }
        self.violations.iter().copied().fold(0.0, f64::max)
    }

    fn objective(&self) -> f64 {
        let ridge = self.system.ridge;
        let Point { y, residual, .. } = &self.point;
        0.5 * (dot(residual, residual) + ridge * ridge * dot(y, y))
    }

    fn between(&self, j: usize) -> bool {
        self.region.between(j, self.point.y[j])
    }

    /// Takes columns into the working set, in the places of those that were long not needed.
    fn extend(&mut self, wanted: &[usize]) {
        let members = self.working.members();
        let mut spare: Vec<usize> = (0..members.len())
            .filter(|&p| self.idle[p] >= KEEP && self.violations[members[p]] == 0.0)
            .collect();
        spare.sort_by_key(|&p| std::cmp::Reverse(self.idle[p]));
        spare.truncate(wanted.len());
        self.working.extend(self.system, wanted, &spare);
        self.idle.resize(self.working.members().len(), 0);
        spare.iter().for_each(|&p| self.idle[p] = 0);
    }

    fn grow_idle(&mut self) {
        for (idle, &j) in self.idle.iter_mut().zip(self.working.members()) {
            *idle = if self.region.between(j, self.point.y[j]) { 0 } else { *idle + 1 };
        }
    }

    /// The eligible columns that violate most: as many as a part of the working ones.
    fn most_violating(&self, eligible: impl Fn(usize) -> bool) -> Vec<usize> {
        let violations = &self.violations;
        let mut found: Vec<usize> =
            (0..violations.len()).filter(|&j| violations[j] > self.goal && eligible(j)).collect();
        found.sort_by(|&a, &b| violations[b].total_cmp(&violations[a]).then(a.cmp(&b)));
        let most = JOIN_AT_LEAST.max(self.working.members().len() / JOIN_PART);
        found.truncate(most);
        found
    }

    /// The columns for a solution on their orthogonal factor.
    fn exact_members(&self) -> Vec<usize> {
        let mut members: Vec<usize> =
            (0..self.system.columns).filter(|&j| self.between(j)).collect();
        members.extend(self.most_violating(|j| !self.between(j)));
        members
    }

    fn solution(self, start: Option<&[f64]>, converged: bool) -> BoundedSolution {
        let n = self.system.columns;
        let absolute = (0..n).map(|j| self.violations[j] * self.system.norm(j));
        BoundedSolution {
            x: self.system.unscaled(&self.point.y, start),
            residual_norm: norm(&self.point.residual),
            kkt_residual: self.violations.iter().copied().fold(0.0, f64::max) / self.system.scale,
            kkt_absolute: absolute.fold(0.0, f64::max),
            active: (0..n).filter(|&j| self.between(j)).count(),
            iterations: self.iterations,
            passes: self.passes,
            path: self.path,
            converged,
        }
    }
}

/// The box in scaled unknowns.
struct Region {
    lower: Vec<f64>,
    upper: Vec<f64>,
    /// Neither fixed by equal bounds nor a column of zeros.
    movable: Vec<bool>,
}

impl Region {
    fn new(system: &System) -> Self {
        let n = system.columns;
        let (lower, upper): (Vec<f64>, Vec<f64>) = (0..n).map(|j| system.scaled_bounds(j)).unzip();
        let movable = (0..n).map(|j| !system.is_zero(j) && lower[j] < upper[j]).collect();
        Self { lower, upper, movable }
    }

    fn between(&self, j: usize, y: f64) -> bool {
        self.movable[j] && self.lower[j] < y && y < self.upper[j]
    }

    fn violation(&self, j: usize, y: f64, gradient: f64) -> f64 {
        if self.movable[j] { violation(y, self.lower[j], self.upper[j], gradient) } else { 0.0 }
    }
}

/// A solution on some columns, starting at a point whose gradient is known.
struct Correction<'a> {
    goal: f64,
    limit: usize,
    watch: &'a Watch,
}

impl Correction<'_> {
    /// Moves `point`, bringing y and gradient (as the model has it) of `members` up to date; the
    /// number of iterations.
    fn apply<M: Model>(
        &self,
        model: &mut M,
        members: &[usize],
        region: &Region,
        point: &mut Point,
    ) -> Result<usize, BoundedError> {
        let pick = |values: &[f64]| members.iter().map(|&j| values[j]).collect::<Vec<f64>>();
        let mut state =
            State { y: pick(&point.y), lower: pick(&region.lower), upper: pick(&region.upper) };
        let free: Vec<usize> =
            (0..members.len()).filter(|&p| region.between(members[p], state.y[p])).collect();
        let iterations =
            exchange::solve(model, &mut state, &free, self.goal, self.limit, self.watch)?;
        for ((&j, &y), &gradient) in members.iter().zip(&state.y).zip(model.gradient()) {
            point.y[j] = y;
            point.gradient[j] = gradient;
        }
        Ok(iterations)
    }
}

/// Whether complete passes still help.
struct Progress {
    before: f64,
    violation: f64,
    objective: f64,
    count: usize,
}

impl Default for Progress {
    fn default() -> Self {
        let most = f64::INFINITY;
        Self { before: most, violation: most, objective: most, count: 0 }
    }
}

impl Progress {
    /// How many passes in a row have neither halved the violation nor lowered the objective.
    fn stalled(&mut self, violation: f64, objective: f64) -> usize {
        let helped = violation < 0.5 * self.violation || objective < self.objective * (1.0 - 1e-12);
        self.count = if helped { 0 } else { self.count + 1 };
        self.violation = self.violation.min(violation);
        self.objective = self.objective.min(objective);
        self.count
    }
}
