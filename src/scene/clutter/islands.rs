//! Masks without specks: medians, islands, holes and a border.

/// What is narrower than twice this and a pixel is dropped.
const HALF_THINNEST: usize = 2;

/// The median of each pixel's square of `2 reach + 1` pixels; beyond the border the nearest pixel is
/// meant.
pub(super) fn median(values: &[f32], (width, height): (usize, usize), reach: i64) -> Vec<f32> {
    let mut around = Vec::new();
    let places = (0..height as i64).flat_map(|y| (0..width as i64).map(move |x| (x, y)));
    places
        .map(|(x, y)| {
            around.clear();
            for v in y - reach..=y + reach {
                let v = v.clamp(0, height as i64 - 1) as usize;
                for u in x - reach..=x + reach {
                    around.push(values[v * width + u.clamp(0, width as i64 - 1) as usize]);
                }
            }
            let middle = around.len() / 2;
            *around.select_nth_unstable_by(middle, f32::total_cmp).1
        })
        .collect()
}

/// Drops what is thinner than some pixels, islands and holes below a part of the picture, and widens
/// what is left by a pixel.
pub(super) fn tidy(is_masked: &mut Vec<bool>, size: (usize, usize), smallest: f64) {
    let fewest = (smallest * (size.0 * size.1) as f64).ceil() as usize;
    // Edges of the known surfaces that are off by a pixel give lines.
    let kept: Vec<bool> = is_masked.iter().map(|own| !own).collect();
    let thick: Vec<bool> = widened(&kept, size, HALF_THINNEST).iter().map(|own| !own).collect();
    *is_masked = widened(&thick, size, HALF_THINNEST);
    turn_small(is_masked, size, true, fewest);
    turn_small(is_masked, size, false, fewest);
    *is_masked = widened(is_masked, size, 1);
}

/// Turns joined pixels of one kind into the other where there are fewer than some.
fn turn_small(is_masked: &mut [bool], (width, height): (usize, usize), kind: bool, fewest: usize) {
    let mut is_done = vec![false; is_masked.len()];
    let mut piece = Vec::new();
    for start in 0..is_masked.len() {
        if is_done[start] || is_masked[start] != kind {
            continue;
        }
        is_done[start] = true;
        piece.clear();
        piece.push(start);
        let mut next = 0;
        while let Some(&index) = piece.get(next) {
            next += 1;
            let (x, y) = (index % width, index / width);
            let left = (x > 0).then(|| index - 1);
            let right = (x + 1 < width).then_some(index + 1);
            let above = (y > 0).then(|| index - width);
            let below = (y + 1 < height).then_some(index + width);
            for beside in [left, right, above, below].into_iter().flatten() {
                if !is_done[beside] && is_masked[beside] == kind {
                    is_done[beside] = true;
                    piece.push(beside);
                }
            }
        }
        if piece.len() < fewest {
            piece.iter().for_each(|&index| is_masked[index] = !kind);
        }
    }
}

fn widened(is_masked: &[bool], (width, height): (usize, usize), reach: usize) -> Vec<bool> {
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    pixels
        .map(|(x, y)| {
            let rows = y.saturating_sub(reach)..=(y + reach).min(height - 1);
            let columns = x.saturating_sub(reach)..=(x + reach).min(width - 1);
            rows.flat_map(|v| columns.clone().map(move |u| v * width + u))
                .any(|index| is_masked[index])
        })
        .collect()
}
