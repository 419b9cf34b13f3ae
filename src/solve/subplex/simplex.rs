//! The Nelder–Mead simplex (1965) in a subspace.

use super::Search;

const REFLECTION: f64 = 1.0;
const EXPANSION: f64 = 2.0;
const CONTRACTION: f64 = 0.5;
const SHRINKAGE: f64 = 0.5;

struct Vertex {
    /// Coordinates of the subspace only.
    at: Vec<f64>,
    value: f64,
}

/// Searches the coordinates `part` from the best point so far, with first vertices one of
/// `steps` away each, until the simplex is `reduction` of its first size; leaves the best
/// point in `search`.
pub fn search<F: FnMut(&[f64]) -> f64>(
    search: &mut Search<F>,
    part: &[usize],
    steps: &[f64],
    reduction: f64,
) {
    let mut point = search.x.clone();
    let mut evaluate = |search: &mut Search<F>, at: &[f64]| {
        for (&i, &value) in part.iter().zip(at) {
            point[i] = value;
        }
        search.evaluate(&point)
    };
    let origin: Vec<f64> = part.iter().map(|&i| search.x[i]).collect();
    let mut vertices = vec![Vertex { at: origin.clone(), value: search.value }];
    for (place, &i) in part.iter().enumerate() {
        let mut at = origin.clone();
        at[place] += steps[i];
        if at[place] == origin[place] || search.spent() {
            // A step below rounding spans nothing.
            continue;
        }
        let value = evaluate(search, &at);
        vertices.push(Vertex { at, value });
    }
    sort(&mut vertices);
    let goal = reduction * size(&vertices);

    while vertices.len() > 1 && !search.spent() && size(&vertices) > goal {
        let worst = vertices.len() - 1;
        let centre = centre(&vertices[..worst], part.len());
        let away = |factor: f64| -> Vec<f64> {
            let towards = centre.iter().zip(&vertices[worst].at);
            towards.map(|(centre, worst)| centre + factor * (centre - worst)).collect()
        };

        let at = away(REFLECTION);
        let reflected = Vertex { value: evaluate(search, &at), at };
        if reflected.value < vertices[0].value {
            let at = away(EXPANSION);
            let expanded = Vertex { value: evaluate(search, &at), at };
            vertices[worst] = if expanded.value < reflected.value { expanded } else { reflected };
        } else if reflected.value < vertices[worst - 1].value {
            vertices[worst] = reflected;
        } else {
            // Towards whichever of the worst and its reflection is better.
            let outside = reflected.value < vertices[worst].value;
            let at = away(if outside { CONTRACTION } else { -CONTRACTION });
            let contracted = Vertex { value: evaluate(search, &at), at };
            if contracted.value < reflected.value.min(vertices[worst].value) {
                vertices[worst] = contracted;
            } else {
                let (best, others) = vertices.split_first_mut().expect("a simplex has vertices");
                for vertex in others {
                    for (value, best) in vertex.at.iter_mut().zip(&best.at) {
                        *value = best + SHRINKAGE * (*value - best);
                    }
                    vertex.value = evaluate(search, &vertex.at);
                }
            }
        }
        sort(&mut vertices);
    }

    let best = &vertices[0];
    if best.value < search.value {
        search.value = best.value;
        for (&i, &value) in part.iter().zip(&best.at) {
            search.x[i] = value;
        }
    }
}

/// Best first; stable, so that ties keep the older vertex in front.
fn sort(vertices: &mut [Vertex]) {
    vertices.sort_by(|a, b| a.value.total_cmp(&b.value));
}

/// The mean of some vertices.
fn centre(vertices: &[Vertex], dimension: usize) -> Vec<f64> {
    let count = vertices.len() as f64;
    (0..dimension)
        .map(|i| vertices.iter().map(|vertex| vertex.at[i]).sum::<f64>() / count)
        .collect()
}

/// The largest distance (sum of coordinate differences) of a vertex from the best.
fn size(vertices: &[Vertex]) -> f64 {
    let distance = |vertex: &Vertex| -> f64 {
        vertex.at.iter().zip(&vertices[0].at).map(|(a, b)| (a - b).abs()).sum()
    };
    vertices.iter().map(distance).fold(0.0, f64::max)
}
