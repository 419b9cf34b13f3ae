//! Evidence is joined within pieces of a photograph that have no strong edge inside: P. F.
//! Felzenszwalb, D. P. Huttenlocher, Efficient graph-based image segmentation (2004).

use super::small::{SmallView, blurred};

/// How large pieces are: a border is one where the step across it is above the largest step within
/// the two pieces by this over their size.
const SCALE: f32 = 1.57;
/// Pieces with fewer pixels go to a neighbour.
const FEWEST_PIXELS: usize = 12;
/// The photograph is smoothed before by this standard deviation, in pixels.
const SMOOTHING_PX: f32 = 0.5;
/// How much a piece's mean counts beside the pixel's own evidence.
const PIECE: f32 = 0.5;
/// Single pixels count in the mean of a piece between these.
const LIMITS: [f32; 2] = [-2.0, 3.0];

/// Evidence, each pixel's mixed with the mean of the piece that it is in.
pub(super) fn joined(view: &SmallView, evidence: &[f32]) -> Vec<f32> {
    let pieces = pieces(view);
    let mut sums = vec![(0.0f64, 0usize); evidence.len()];
    for (&piece, own) in pieces.iter().zip(evidence) {
        let sum = &mut sums[piece as usize];
        sum.0 += f64::from(own.clamp(LIMITS[0], LIMITS[1]));
        sum.1 += 1;
    }
    (pieces.iter().zip(evidence))
        .map(|(&piece, own)| {
            let (sum, count) = sums[piece as usize];
            PIECE * (sum / count as f64) as f32 + (1.0 - PIECE) * own
        })
        .collect()
}

/// For each pixel the piece that it is in, named by one of its pixels.
fn pieces(view: &SmallView) -> Vec<u32> {
    let (width, height) = view.size();
    let mut brightness: Vec<f32> =
        view.log.iter().map(|own| own.iter().sum::<f32>() / 3.0).collect();
    brightness.sort_by(f32::total_cmp);
    let middle = brightness.get(brightness.len() / 2).copied().unwrap_or(0.0);
    let near: Vec<_> =
        view.log.iter().map(|own| own.map(|own| (own - middle).clamp(-4.0, 4.0))).collect();
    let near = blurred(&near, (width, height), SMOOTHING_PX);
    let mut edges: Vec<(f32, u32, u32)> = Vec::with_capacity(4 * near.len());
    for y in 0..height {
        for x in 0..width {
            for (dx, dy) in [(1, 0), (0, 1), (1, 1), (1, -1)] {
                let (u, v) = (x as i64 + dx, y as i64 + dy);
                if u >= width as i64 || v < 0 || v >= height as i64 {
                    continue;
                }
                let (a, b) = (y * width + x, v as usize * width + u as usize);
                let step = near[a].iter().zip(near[b]).map(|(a, b)| (a - b) * (a - b)).sum::<f32>();
                edges.push((step.sqrt(), a as u32, b as u32));
            }
        }
    }
    // Equal steps in the order of the pixels, so that the pieces are the same at every run.
    edges.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut forest = Forest::new(near.len());
    for &(step, a, b) in &edges {
        let (a, b) = (forest.root(a), forest.root(b));
        if a != b && step < f32::min(forest.limit(a), forest.limit(b)) {
            forest.join(a, b, step);
        }
    }
    for &(step, a, b) in &edges {
        let (a, b) = (forest.root(a), forest.root(b));
        let fewest = forest.sizes[a as usize].min(forest.sizes[b as usize]);
        if a != b && (fewest as usize) < FEWEST_PIXELS {
            forest.join(a, b, step);
        }
    }
    (0..near.len() as u32).map(|pixel| forest.root(pixel)).collect()
}

struct Forest {
    parents: Vec<u32>,
    sizes: Vec<u32>,
    largest_steps: Vec<f32>,
}

impl Forest {
    fn new(count: usize) -> Self {
        Self {
            parents: (0..count as u32).collect(),
            sizes: vec![1; count],
            largest_steps: vec![0.0; count],
        }
    }

    fn root(&mut self, mut own: u32) -> u32 {
        while self.parents[own as usize] != own {
            let above = self.parents[self.parents[own as usize] as usize];
            self.parents[own as usize] = above;
            own = above;
        }
        own
    }

    fn limit(&self, root: u32) -> f32 {
        self.largest_steps[root as usize] + SCALE / self.sizes[root as usize] as f32
    }

    fn join(&mut self, a: u32, b: u32, step: f32) {
        self.parents[b as usize] = a;
        self.sizes[a as usize] += self.sizes[b as usize];
        self.largest_steps[a as usize] = step;
    }
}
