//! A dielectric coat by formulas of its own.

use glam::DVec3;

/// The BRDF of a rough dielectric of index 1.5 on a surface that faces up, in 1/sr, by the formulas
/// of Walter et al. 2007: GGX, Smith's shadowing by the function Λ, Fresnel's by the angles.
pub fn coat(roughness: f64, eye: DVec3, towards: DVec3) -> f64 {
    if eye.z <= 0.0 || towards.z <= 0.0 {
        return 0.0;
    }
    let half = (eye + towards).normalize_or_zero();
    let tangent2 =
        |direction: DVec3| (1.0 - direction.z * direction.z) / (direction.z * direction.z);
    let square = roughness * roughness;
    let distribution =
        square / (std::f64::consts::PI * half.z.powi(4) * (square + tangent2(half)).powi(2));
    let lambda = |direction: DVec3| 0.5 * ((1.0 + square * tangent2(direction)).sqrt() - 1.0);
    let shadowing = 1.0 / (1.0 + lambda(eye) + lambda(towards));
    let outside = half.dot(towards).clamp(0.0, 1.0 - 1e-12).acos();
    let inside = (outside.sin() / 1.5).asin();
    let across = (outside - inside).sin() / (outside + inside).sin();
    let along = (outside - inside).tan() / (outside + inside).tan();
    let fresnel = 0.5 * (across * across + along * along);
    distribution * shadowing * fresnel / (4.0 * eye.z * towards.z)
}
