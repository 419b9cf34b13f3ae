//! Values over the texels of a surface, computed where they change and interpolated where they do
//! not.

use rayon::prelude::*;

use crate::math::rgb::{CHANNELS, Radiance, Rgb};
use crate::reconstruct::textures::Place;
use crate::watch::{Cancelled, Watch};

/// Parts of a value that differ over a cell by less than this, together and relative to the whole,
/// are interpolated: more than the noise of the few rays, less than the shadows that would be seen
/// in a texture.
const SMOOTH: f64 = 0.1;

/// Side of the largest cells, in texels, that are interpolated where a polygon fills them only in part:
/// the values nearest to the corners may then be far from some texels, and all on one side of them.
const LARGEST_PARTIAL: usize = 4;

/// A value at texels that is a sum of parts, such as the irradiance from several lights.
pub(super) trait Sum: Sync {
    /// How many parts it has.
    fn parts(&self) -> usize;
    /// Sets the values of the listed parts at a texel that has a place.
    fn compute(&self, texel: usize, parts: &[usize], values: &mut [Radiance]);
    /// The other light at a texel. Changes of the parts are compared with the sum including it.
    fn base(&self, _texel: usize) -> Rgb {
        [0.0; CHANNELS]
    }
}

/// The texels of a surface, in square cells.
#[derive(Clone, Copy)]
pub(super) struct Grid<'a> {
    pub places: &'a [Option<Place>],
    pub width: usize,
    /// Side of the largest cells, in texels; a power of two, so that they can be halved.
    pub stride: usize,
    /// Cells of this side or less are interpolated however their values differ.
    pub finest: usize,
}

/// A square of texels.
#[derive(Clone, Copy)]
pub(super) struct Cell {
    left: usize,
    top: usize,
    side: usize,
}

impl Cell {
    fn quarters(self) -> [Self; 4] {
        let side = self.side / 2;
        [(0, 0), (side, 0), (0, side), (side, side)].map(|(right, below)| Self {
            left: self.left + right,
            top: self.top + below,
            side,
        })
    }

    fn holds(self, (x, y): (usize, usize)) -> bool {
        (self.left..self.left + self.side).contains(&x)
            && (self.top..self.top + self.side).contains(&y)
    }
}

/// A texel whose value was computed, and the parts of it.
struct Support {
    texel: usize,
    values: Vec<Radiance>,
}

impl Grid<'_> {
    /// The largest cells, row by row.
    pub fn cells(&self) -> Vec<Cell> {
        let (height, side) = (self.places.len() / self.width.max(1), self.stride);
        let columns = (0..self.width).step_by(side);
        let rows = (0..height).step_by(side);
        rows.flat_map(|top| columns.clone().map(move |left| Cell { left, top, side })).collect()
    }

    /// The texels of a cell that have a place.
    pub fn texels(&self, cell: Cell) -> Vec<usize> {
        let columns = cell.left..(cell.left + cell.side).min(self.width);
        let rows = cell.top..cell.top + cell.side;
        let texels = rows.flat_map(|y| columns.clone().map(move |x| y * self.width + x));
        texels.filter(|&texel| self.places.get(texel).is_some_and(Option::is_some)).collect()
    }

    /// The value at every placed texel.
    pub fn map(&self, sum: &impl Sum, watch: &Watch) -> Result<Vec<Option<Rgb>>, Cancelled> {
        let cells: Vec<Vec<(usize, Rgb)>> = self
            .cells()
            .into_par_iter()
            .map(|cell| self.within(cell, sum, watch))
            .collect::<Result<_, Cancelled>>()?;
        let mut found = vec![None; self.places.len()];
        for (texel, value) in cells.into_iter().flatten() {
            found[texel] = Some(value);
        }
        Ok(found)
    }

    /// The value at the placed texels of one of the largest cells.
    pub fn within(
        &self,
        cell: Cell,
        sum: &impl Sum,
        watch: &Watch,
    ) -> Result<Vec<(usize, Rgb)>, Cancelled> {
        let polygon = |texel: &usize| self.places[*texel].as_ref().map(|place| place.polygon);
        let mut texels = self.texels(cell);
        texels.sort_by_key(polygon);
        let all: Vec<usize> = (0..sum.parts()).collect();
        let mut found = Vec::new();
        for texels in texels.chunk_by(|a, b| polygon(a) == polygon(b)) {
            self.refine(cell, texels, (&[], &all), sum, watch, &mut found)?;
        }
        Ok(found)
    }

    /// Appends the value at some texels of a cell, which lie on one polygon. `known` are texels of the
    /// larger cell around it; there, parts that are not among `changing` were found to be smooth.
    fn refine(
        &self,
        cell: Cell,
        texels: &[usize],
        (known, changing): (&[&Support], &[usize]),
        sum: &impl Sum,
        watch: &Watch,
        found: &mut Vec<(usize, Rgb)>,
    ) -> Result<(), Cancelled> {
        let outermost = self.outermost(cell, texels);
        let is_known = |texel: usize| known.iter().find(|support| support.texel == texel);
        let mut computed = Vec::new();
        for &texel in outermost.iter().filter(|&&texel| is_known(texel).is_none()) {
            watch.check()?;
            let mut values = vec![[0.0; CHANNELS]; sum.parts()];
            for (support, weight) in known.iter().zip(self.weights(known, texel)) {
                for (value, of_support) in values.iter_mut().zip(&support.values) {
                    for c in 0..CHANNELS {
                        value[c] += weight as f32 * of_support[c];
                    }
                }
            }
            sum.compute(texel, changing, &mut values);
            computed.push(Support { texel, values });
        }
        let supports: Vec<&Support> = outermost
            .iter()
            .filter_map(|&texel| {
                let own = computed.iter().find(|support| support.texel == texel);
                own.or_else(|| is_known(texel).copied())
            })
            .collect();
        let changing = if supports.len() == texels.len() {
            Vec::new()
        } else if cell.side > LARGEST_PARTIAL && texels.len() < cell.side.pow(2) {
            changing.to_vec()
        } else if cell.side <= self.finest {
            Vec::new()
        } else {
            changes(&supports, sum, changing)
        };
        if changing.is_empty() {
            let totals: Vec<Rgb> = supports.iter().map(|support| total(&support.values)).collect();
            for &texel in texels {
                let mut value = [0.0; CHANNELS];
                for (total, weight) in totals.iter().zip(self.weights(&supports, texel)) {
                    for c in 0..CHANNELS {
                        value[c] += weight * total[c];
                    }
                }
                found.push((texel, value));
                watch.tick()?;
            }
            return Ok(());
        }
        for quarter in cell.quarters() {
            let own = |texel: &usize| quarter.holds(self.column_and_row(*texel));
            let texels: Vec<usize> = texels.iter().copied().filter(own).collect();
            if !texels.is_empty() {
                self.refine(quarter, &texels, (&supports, &changing), sum, watch, found)?;
            }
        }
        Ok(())
    }

    fn column_and_row(&self, texel: usize) -> (usize, usize) {
        (texel % self.width, texel / self.width)
    }

    /// The texels nearest to the corners of a cell, each once.
    fn outermost(&self, cell: Cell, texels: &[usize]) -> Vec<usize> {
        let (right, bottom) = (cell.left + cell.side - 1, cell.top + cell.side - 1);
        let corners =
            [(cell.left, cell.top), (right, cell.top), (cell.left, bottom), (right, bottom)];
        let mut outermost = Vec::with_capacity(4);
        for (x, y) in corners {
            let distance = |&&texel: &&usize| {
                let (column, row) = self.column_and_row(texel);
                x.abs_diff(column).pow(2) + y.abs_diff(row).pow(2)
            };
            let nearest = texels.iter().min_by_key(distance);
            outermost.extend(nearest.filter(|nearest| !outermost.contains(*nearest)));
        }
        outermost
    }

    /// The weights with which a value is interpolated at a texel: bilinear between the corners of a
    /// rectangle, else by the inverse of the squared distance.
    fn weights(&self, supports: &[&Support], texel: usize) -> Vec<f64> {
        let (x, y) = self.column_and_row(texel);
        let at: Vec<(usize, usize)> =
            supports.iter().map(|support| self.column_and_row(support.texel)).collect();
        if let [a, b, c, d] = at[..]
            && (a.1, b.0, c.0, c.1) == (b.1, d.0, a.0, d.1)
            && a.0 < b.0
            && a.1 < c.1
        {
            let part = |value: usize, low: usize, high: usize| {
                (value as f64 - low as f64) / (high - low) as f64
            };
            let (s, t) = (part(x, a.0, b.0), part(y, a.1, c.1));
            return vec![(1.0 - s) * (1.0 - t), s * (1.0 - t), (1.0 - s) * t, s * t];
        }
        let near = |&(column, row): &(usize, usize)| {
            1.0 / ((x.abs_diff(column).pow(2) + y.abs_diff(row).pow(2)) as f64).max(1e-9)
        };
        let sum: f64 = at.iter().map(near).sum();
        at.iter().map(|at| near(at) / sum).collect()
    }
}

/// Which parts change too much between texels to be interpolated: of those that may be, the fewest
/// with which all others together change by less than [`SMOOTH`]. None where the whole hardly
/// changes.
fn changes(supports: &[&Support], sum: &impl Sum, changing: &[usize]) -> Vec<usize> {
    let range = |values: &mut dyn Iterator<Item = f64>| {
        values.fold((f64::INFINITY, 0.0f64), |(low, high), value| (low.min(value), high.max(value)))
    };
    let totals: Vec<Rgb> = supports.iter().map(|support| total(&support.values)).collect();
    let bases: Vec<Rgb> = supports.iter().map(|support| sum.base(support.texel)).collect();
    let whole: Rgb = std::array::from_fn(|c| {
        totals.iter().zip(&bases).map(|(own, base)| own[c] + base[c]).fold(0.0, f64::max)
    });
    let is_smooth = |c: usize| {
        let (low, high) = range(&mut totals.iter().map(|total| total[c]));
        high - low <= SMOOTH * whole[c]
    };
    if (0..CHANNELS).all(is_smooth) {
        return Vec::new();
    }
    // The change of a part in the channel where it is largest, relative to the whole.
    let change = |part: usize| {
        let of_channel = |c: usize| {
            let (low, high) =
                range(&mut supports.iter().map(|support| f64::from(support.values[part][c])));
            (high - low) / whole[c].max(f64::MIN_POSITIVE)
        };
        (0..CHANNELS).map(of_channel).fold(0.0, f64::max)
    };
    let of_parts: Vec<f64> = (0..sum.parts()).map(change).collect();
    let mut left = changing.to_vec();
    left.sort_by(|&a, &b| of_parts[a].total_cmp(&of_parts[b]));
    // What is interpolated already counts first.
    let mut together: f64 =
        of_parts.iter().sum::<f64>() - left.iter().map(|&part| of_parts[part]).sum::<f64>();
    let is_interpolated = |&&part: &&usize| {
        together += of_parts[part];
        together <= SMOOTH
    };
    let interpolated = left.iter().take_while(is_interpolated).count();
    let mut left = left.split_off(interpolated);
    left.sort_unstable();
    left
}

fn total(parts: &[Radiance]) -> Rgb {
    let mut sum = [0.0; CHANNELS];
    for part in parts {
        for (sum, value) in sum.iter_mut().zip(part) {
            *sum += f64::from(*value);
        }
    }
    sum
}

#[cfg(test)]
mod tests;
