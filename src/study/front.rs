//! The Pareto front: the points for which no other point is better in both coordinates.

/// Indices of the points that no other one is both at least as small as in x and in y and smaller
/// in one of them, by ascending x. Points that are not finite are no part of it.
pub fn front(points: &[[f64; 2]]) -> Vec<usize> {
    let mut order: Vec<usize> =
        (0..points.len()).filter(|&k| points[k].iter().all(|v| v.is_finite())).collect();
    order.sort_by(|&a, &b| {
        points[a][0].total_cmp(&points[b][0]).then(points[a][1].total_cmp(&points[b][1]))
    });
    let mut lowest = f64::INFINITY;
    order.retain(|&k| {
        let is_best = points[k][1] < lowest;
        if is_best {
            lowest = points[k][1];
        }
        is_best
    });
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_something_beats_is_no_part_of_the_front() {
        let points = [[2.0, 1.0], [1.0, 3.0], [2.0, 2.0], [3.0, 1.0], [f64::NAN, 0.0], [0.5, 4.0]];
        assert_eq!(front(&points), [5, 1, 0]);
        assert!(front(&[]).is_empty());
        // By definition: nothing beats a point of the front, something beats every other.
        let many: Vec<[f64; 2]> =
            (0..200).map(|k| [f64::from(k * 37 % 101), f64::from(k * 53 % 89)]).collect();
        let best = front(&many);
        for (k, p) in many.iter().enumerate() {
            let beaten =
                many.iter().any(|q| q[0] <= p[0] && q[1] <= p[1] && (q[0] < p[0] || q[1] < p[1]));
            assert!(!(beaten && best.contains(&k)));
            assert!(beaten || best.iter().any(|&b| many[b] == *p));
        }
    }
}
