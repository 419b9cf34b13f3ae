//! The shapes of lights, lobes, cameras and the ground grid.

use glam::{Vec2, Vec3};

use crate::app::project::Focus;
use crate::app::viewport::content::Content;
use crate::app::viewport::gpu::{Disc, Line, LobeShape};
use crate::app::viewport::projection::{Projection, Range};
use crate::app::viewport::thumbs;
use crate::reconstruct::lights::{LightKind, VirtualLight, VirtualLights};
use crate::reconstruct::lobes::Lobes;
use crate::reconstruct::solution::Solution;
use crate::scene::{Camera, Capture, Emitter, KnownLight};

const WARM: [f32; 3] = [0.96, 0.78, 0.32];
const IDLE: [f32; 3] = [0.62, 0.62, 0.62];

/// Virtual lights and their lobes.
#[derive(Default)]
pub struct LightShapes {
    /// One per light, so that a disc's index is the light's.
    pub discs: Vec<Disc>,
    pub lines: Vec<Line>,
    pub lobes: Vec<LobeShape>,
    /// Emission of the longest lobe, the mean of its channels.
    pub strongest: Option<f32>,
}

/// Shapes for the lights; a light's colour and the length of its lobes are their emission.
pub fn lights(
    capture: Option<&Capture>,
    lights: &VirtualLights,
    lobes: &Lobes,
    solution: Option<&Solution>,
) -> LightShapes {
    // Emissions of another set of lobes would colour the wrong ones.
    let emission = solution
        .map(|solution| &solution.emission)
        .filter(|emission| emission.len() == lobes.lobes.len());
    let strength = |lobe: usize| emission.map_or(0.0, |all| all[lobe].iter().sum::<f64>() / 3.0);
    // A lamp is small and shines alike all around: beside it every lobe would be short, so its
    // glow stands for it instead.
    let is_glow = |light: usize| {
        lights.lights.get(light).is_none_or(|light| {
            matches!(light.kind, LightKind::Lamp | LightKind::Sun) || is_sun(capture, light)
        })
    };
    let strongest = (0..lobes.lobes.len())
        .filter(|lobe| !is_glow(lobes.lobes[*lobe].light))
        .map(strength)
        .fold(0.0, f64::max);
    let reach_m = 0.3 * lights.sphere_radius_m.max(2.0 * lights.spacing_m);
    let mut shapes = LightShapes {
        strongest: emission.map(|_| strongest as f32).filter(|strongest| *strongest > 0.0),
        ..LightShapes::default()
    };
    for (index, light) in lights.lights.iter().enumerate() {
        let own = if index + 1 < lobes.first.len() { lobes.of(index) } else { 0..0 };
        let mut sum = [0.0f64; 3];
        for lobe in own.clone() {
            for (sum, value) in sum.iter_mut().zip(emission.map_or([0.0; 3], |all| all[lobe])) {
                *sum += value;
            }
        }
        let color = if emission.is_some() { hue(sum) } else { WARM };
        let (center, is_ball, radius) = placed(capture, lights, light);
        shapes.discs.push(Disc {
            center: center.to_array(),
            radius,
            normal: light.normal.to_array(),
            is_ball: u32::from(is_ball),
            color,
        });
        if light.kind == LightKind::Sun || is_sun(capture, light) {
            arrow(&mut shapes.lines, center, light.normal, 0.4 * lights.sphere_radius_m, color);
        } else if !is_ball {
            let tip = center + light.normal * 0.5 * radius;
            let color = [color[0], color[1], color[2], 0.7];
            shapes.lines.push(line(center, tip, color, 1.5));
        }
        if is_glow(index) {
            continue;
        }
        for lobe in own {
            let strength = strength(lobe);
            if emission.is_some() && (strength <= 0.0 || strongest <= 0.0) {
                continue;
            }
            // The square root keeps lobes of a hundredth of the strongest visible.
            let length = match emission {
                Some(_) => reach_m * (strength / strongest).sqrt() as f32,
                None => 0.25 * reach_m,
            };
            shapes.lobes.push(LobeShape {
                origin: center.to_array(),
                length,
                axis: lobes.lobes[lobe].direction.to_array(),
                exponent: lobes.lobes[lobe].exponent,
                color: emission.map_or(IDLE, |all| hue(all[lobe])),
            });
        }
    }
    shapes
}

/// Where a light is drawn, whether as a ball, and its radius. Lights at infinity are drawn on
/// the bounding sphere, from where their light comes.
pub fn placed(
    capture: Option<&Capture>,
    lights: &VirtualLights,
    light: &VirtualLight,
) -> (Vec3, bool, f32) {
    let least = 0.02 * lights.sphere_radius_m;
    let sphere = lights.sphere_radius_m;
    let far = lights.sphere_center - light.normal * sphere;
    match light.kind {
        LightKind::Sky => (far, false, 0.85 * sphere * light.half_angle.sin().abs().max(0.02)),
        LightKind::Sun => (far, true, 2.0 * least),
        LightKind::Lamp => (light.position, true, light.radius_m.max(least)),
        LightKind::Known(index) => match capture.and_then(|capture| capture.lights.get(index)) {
            Some(KnownLight::Shape { emitter: Emitter::Sun { .. }, .. }) => {
                (far, true, 2.0 * least)
            }
            Some(KnownLight::Shape { emitter: Emitter::Rectangle { .. }, .. }) => {
                (light.position, false, light.radius_m.max(least))
            }
            Some(KnownLight::Dome { .. }) => (far, false, 0.3 * sphere),
            _ => (light.position, true, light.radius_m.max(least)),
        },
        LightKind::Sphere | LightKind::Surface => (light.position, false, light.radius_m),
    }
}

fn is_sun(capture: Option<&Capture>, light: &VirtualLight) -> bool {
    let LightKind::Known(index) = light.kind else { return false };
    let known = capture.and_then(|capture| capture.lights.get(index));
    matches!(known, Some(KnownLight::Shape { emitter: Emitter::Sun { .. }, .. }))
}

/// The hue of an emission as bright as a screen shows it.
fn hue(emission: [f64; 3]) -> [f32; 3] {
    let most = emission.iter().copied().fold(0.0, f64::max);
    if most <= 0.0 || !most.is_finite() {
        return [0.3; 3];
    }
    emission.map(|value| (value.max(0.0) / most).powf(1.0 / 2.2) as f32)
}

fn arrow(lines: &mut Vec<Line>, from: Vec3, direction: Vec3, length: f32, color: [f32; 3]) {
    let color = [color[0], color[1], color[2], 1.0];
    let tip = from + direction * length;
    let (side, other) = direction.any_orthonormal_pair();
    lines.push(line(from, tip, color, 3.0));
    for barb in [side, -side, other, -other] {
        lines.push(line(tip, tip + (0.5 * barb - direction) * 0.2 * length, color, 3.0));
    }
}

/// The pyramids of the photographs' cameras, `depth` metres long; one of them accented.
pub fn frusta(
    capture: &Capture,
    selected: Option<usize>,
    accent: [f32; 4],
    plain: [f32; 4],
    depth: f32,
) -> Vec<Line> {
    let mut lines = Vec::new();
    for (index, photograph) in capture.photographs.iter().enumerate() {
        let (color, width) = if selected == Some(index) { (accent, 2.5) } else { (plain, 1.5) };
        let depth = thumbs::depth_of(index, selected, depth);
        let eye = photograph.camera.position.as_vec3();
        let corners = image_corners(&photograph.camera, depth);
        for k in 0..4 {
            lines.push(line(eye, corners[k], color, width));
            lines.push(line(corners[k], corners[(k + 1) % 4], color, width));
        }
        // A roof over the upper edge tells which way is up.
        let up = photograph.camera.world_from_camera.y_axis.as_vec3();
        let roof = 0.5 * (corners[0] + corners[1]) + up * 0.22 * depth;
        lines.push(line(corners[0], roof, color, width));
        lines.push(line(corners[1], roof, color, width));
    }
    lines
}

/// The image's corners at a depth: upper left, upper right, lower right, lower left.
pub fn image_corners(camera: &Camera, depth: f32) -> [Vec3; 4] {
    let range = Range { near: 0.01, far: 1.0 };
    let projection = Projection::image(camera, range);
    [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| {
        let ray = projection.ray(Vec2::new(x, y) * projection.size);
        ray.origin + ray.direction * depth / ray.direction.dot(projection.forward).max(0.05)
    })
}

/// The ground below the scene in metres, every tenth line stronger; wider where the scene is so
/// large that metres would be too fine.
pub fn grid((low, high): (Vec3, Vec3), color: [f32; 4]) -> Vec<Line> {
    let size = (high - low).max_element().max(1.0);
    let step = 10f32.powf((size / 60.0).log10().ceil().max(0.0));
    let margin = 2.0 * step;
    let cell = |v: f32| (v / step).floor() as i64;
    let (x0, x1) = (cell(low.x - margin), cell(high.x + margin) + 1);
    let (y0, y1) = (cell(low.y - margin), cell(high.y + margin) + 1);
    // Just below, so that a floor is not striped by it.
    let z = low.z - 2e-3 * size;
    let mut lines = Vec::new();
    let strength = |k: i64| if k.rem_euclid(10) == 0 { 1.0 } else { 0.45 };
    let faded = |k: i64| [color[0], color[1], color[2], color[3] * strength(k)];
    for x in x0..=x1 {
        let at = |y: i64| Vec3::new(x as f32 * step, y as f32 * step, z);
        lines.push(line(at(y0), at(y1), faded(x), 1.0));
    }
    for y in y0..=y1 {
        let at = |x: i64| Vec3::new(x as f32 * step, y as f32 * step, z);
        lines.push(line(at(x0), at(x1), faded(y), 1.0));
    }
    lines
}

fn line(from: Vec3, to: Vec3, color: [f32; 4], width: f32) -> Line {
    Line { from: from.to_array(), to: to.to_array(), color, width }
}

/// The box around what was selected last; other selections may be left from before.
pub fn selected_box(capture: &Capture, content: &Content) -> Option<(Vec3, Vec3)> {
    let point = match content.focus {
        Focus::Nothing => return None,
        Focus::Surfaces | Focus::Material => {
            let (mesh, selected) = (&capture.mesh, &content.selected_surfaces);
            let mut corners = (0..mesh.triangles.len())
                .filter(|&triangle| selected.contains(&(mesh.surface[triangle] as usize)))
                .flat_map(|triangle| mesh.corners(triangle));
            let first = corners.next()?;
            return Some(corners.fold((first, first), |(low, high), p| (low.min(p), high.max(p))));
        }
        Focus::Sample => content.samples.as_ref()?.samples.get(content.selected_sample?)?.position,
        Focus::Light => {
            let (lights, _) = content.lights.as_ref()?;
            placed(Some(capture), lights, lights.lights.get(content.selected_light?)?).0
        }
        Focus::Added => {
            let item = content.selected_added?;
            content.things.middle(item, capture.mesh.bounds()?)?
        }
        Focus::Photograph => {
            capture.photographs.get(content.selected_photograph?)?.camera.position.as_vec3()
        }
    };
    Some((point, point))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lights_at_infinity_are_drawn_on_the_bounding_sphere() {
        let center = Vec3::new(1.0, 2.0, 3.0);
        let down = -Vec3::Z;
        let all = VirtualLights {
            lights: vec![
                VirtualLight::distant(LightKind::Sun, down, 0.005),
                VirtualLight::distant(LightKind::Sky, down, 0.2),
                VirtualLight::lamp(Vec3::X, 0.1),
            ],
            spacing_m: 0.5,
            sphere_center: center,
            sphere_radius_m: 4.0,
        };
        let lobes = Lobes { lobes: Vec::new(), first: vec![0; 4] };
        let shapes = lights(None, &all, &lobes, None);
        assert_eq!(shapes.discs[0].center, [1.0, 2.0, 7.0]);
        assert_eq!(shapes.discs[1].center, [1.0, 2.0, 7.0]);
        assert_eq!(shapes.discs.iter().map(|d| d.is_ball).collect::<Vec<_>>(), [1, 0, 1]);
        // The sun's arrow has a shaft and four barbs, the sky's disc a tick.
        assert_eq!(shapes.lines.len(), 6);
    }

    #[test]
    fn the_grid_covers_the_ground_and_stays_small() {
        let ends = |size: f32| (Vec3::ZERO, Vec3::splat(size));
        assert_eq!(grid(ends(3.0), [1.0; 4]).len(), 2 * 9);
        assert!(grid(ends(1e5), [1.0; 4]).len() < 300);
    }
}
