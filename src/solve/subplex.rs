//! temporary
#[derive(Default)]
pub struct SubplexOptions {
    pub max_evaluations: usize,
}
pub struct SubplexReport {
    pub x: Vec<f64>,
}
pub fn subplex(
    mut objective: impl FnMut(&[f64]) -> f64,
    start: &[f64],
    _steps: &[f64],
    _options: &SubplexOptions,
) -> SubplexReport {
    objective(start);
    SubplexReport { x: start.to_vec() }
}
