//! Which coordinates are searched together.

/// Splits `moving` into subspaces of `smallest ..= largest` coordinates, in the order of how
/// much each moved (`progress`). Each subspace ends where the gap is widest between the mean
/// movement of its coordinates and that of all that remain, among sizes that leave a number
/// that can be split further.
pub fn partition(
    moving: &[usize],
    progress: &[f64],
    smallest: usize,
    largest: usize,
) -> Vec<Vec<usize>> {
    let mut order = moving.to_vec();
    order.sort_by(|&a, &b| progress[b].abs().total_cmp(&progress[a].abs()));
    let mut parts = Vec::new();
    let mut rest = order.as_slice();
    while !rest.is_empty() {
        let size = leading_size(rest, progress, smallest, largest);
        parts.push(rest[..size].to_vec());
        rest = &rest[size..];
    }
    parts
}

fn leading_size(rest: &[usize], progress: &[f64], smallest: usize, largest: usize) -> usize {
    let total: f64 = rest.iter().map(|&i| progress[i].abs()).sum();
    let mut best = (f64::NEG_INFINITY, rest.len().min(largest));
    let mut sum: f64 = rest.iter().take(smallest - 1).map(|&i| progress[i].abs()).sum();
    for size in smallest..=largest.min(rest.len()) {
        sum += progress[rest[size - 1]].abs();
        let left = rest.len() - size;
        if !splits(left, smallest, largest) {
            continue;
        }
        let mean_left = if left > 0 { (total - sum) / left as f64 } else { 0.0 };
        let gap = sum / size as f64 - mean_left;
        if gap > best.0 {
            best = (gap, size);
        }
    }
    best.1
}

/// Whether `count` is a sum of sizes in `smallest ..= largest`.
fn splits(count: usize, smallest: usize, largest: usize) -> bool {
    smallest * count.div_ceil(largest) <= count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_coordinate_is_in_one_subspace_of_an_allowed_size() {
        for count in 1..40 {
            let progress: Vec<f64> = (0..count).map(|i| ((i * 7919) % 13) as f64 - 6.0).collect();
            let moving: Vec<usize> = (0..count).collect();
            let parts = partition(&moving, &progress, 2, 5);
            assert!(parts.iter().all(|part| part.len() <= 5 && (part.len() >= 2 || count == 1)));
            let mut all: Vec<usize> = parts.concat();
            all.sort_unstable();
            assert_eq!(all, moving);
        }
    }

    #[test]
    fn coordinates_that_moved_alike_stay_together() {
        let progress = [0.0, 10.0, 0.1, -9.0, 11.0, 0.0];
        let parts = partition(&[0, 1, 2, 3, 4, 5], &progress, 2, 5);
        assert_eq!(parts[0], [4, 1, 3]);
        assert_eq!(parts.len(), 2);
    }
}
