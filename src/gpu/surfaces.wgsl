// Reflection at surfaces: src/render/looks.rs, src/scene/gloss.rs and src/render/scatter.rs in
// single precision.

/// Index of refraction of a coat, and of glass.
const INDEX: f32 = 1.5;

// What a triangle does with light; see `Look` in src/render/scene.rs.
const REFLECTS: u32 = 0u;
const TEXTURED: u32 = 1u;
const MIRROR: u32 = 2u;
const GLASS: u32 = 3u;
const PHOTOGRAPHED: u32 = 4u;
const LOOK_WORDS: u32 = 16u;

struct Brdf {
    diffuse: vec3f,
    exponent: f32,
    specular: vec3f,
    // Roughness of a coat; below 0 there is none.
    coat: f32,
}

// A surface point with the normal of the side that is meant.
struct Point {
    position: vec3f,
    normal: vec3f,
}

fn number(at: u32) -> f32 {
    return bitcast<f32>(small[at]);
}

fn triple(at: u32) -> vec3f {
    return vec3f(number(at), number(at + 1u), number(at + 2u));
}

fn texel(at: u32) -> vec3f {
    return vec3f(bitcast<f32>(large[at]), bitcast<f32>(large[at + 1u]), bitcast<f32>(large[at + 2u]));
}

fn corner_of(at: u32) -> vec2f {
    return vec2f(bitcast<f32>(large[at]), bitcast<f32>(large[at + 1u]));
}

// The diffuse reflectance of a texture: bilinear, texels beyond the edge repeat it.
fn textured(map: u32, triangle: u32, u: f32, v: f32) -> vec3f {
    let width = small[map];
    let height = small[map + 1u];
    let entry = large[small[map + 4u] + triangle - small[map + 5u]];
    let at = small[map + 3u] + 6u * entry;
    let uv = corner_of(at) * (1.0 - u - v) + corner_of(at + 2u) * u + corner_of(at + 4u) * v;
    let place = vec2f(uv.x, 1.0 - uv.y) * vec2f(f32(width), f32(height)) - 0.5;
    let low = floor(place);
    let part = place - low;
    let last = vec2f(f32(width - 1u), f32(height - 1u));
    let first = vec2u(clamp(low, vec2f(0.0), last));
    let second = vec2u(clamp(low + 1.0, vec2f(0.0), last));
    let texels = small[map + 2u];
    let top = mix(
        texel(texels + 3u * (first.y * width + first.x)),
        texel(texels + 3u * (first.y * width + second.x)), part.x);
    let bottom = mix(
        texel(texels + 3u * (second.y * width + first.x)),
        texel(texels + 3u * (second.y * width + second.x)), part.x);
    return mix(top, bottom, part.y);
}

fn brdf_of(look: u32) -> Brdf {
    return Brdf(triple(look + 1u), number(look + 7u), triple(look + 4u), number(look + 8u));
}

fn has_coat(brdf: Brdf) -> bool {
    return IS_GLOSSY && brdf.coat >= 0.0;
}

fn is_specular(brdf: Brdf) -> bool {
    return IS_GLOSSY && (brdf.coat >= 0.0 || any(brdf.specular > vec3f(0.0)));
}

fn strength(brdf: Brdf) -> vec3f {
    return select(brdf.specular, vec3f(1.0), brdf.coat >= 0.0);
}

fn fresnel(cosine: f32) -> f32 {
    let within = sqrt(1.0 - (1.0 - cosine * cosine) / (INDEX * INDEX));
    let across = (cosine - INDEX * within) / (cosine + INDEX * within);
    let along = (INDEX * cosine - within) / (INDEX * cosine + within);
    return 0.5 * (across * across + along * along);
}

// The directions of a reflection at a coat, by their cosines.
struct Reflected {
    light: f32,
    viewer: f32,
    half_sine2: f32,
    half_cosine2: f32,
    difference: f32,
}

fn reflected_by(normal: vec3f, mirror: vec3f, direction: vec3f) -> Reflected {
    let light = dot(normal, direction);
    let viewer = dot(normal, mirror);
    let sum = 2.0 * viewer * normal - mirror + direction;
    let size = length(sum);
    let half = select(normal, sum / size, size > 0.0);
    let across = cross(normal, half);
    let sine2 = min(dot(across, across), 1.0);
    return Reflected(light, viewer, sine2, 1.0 - sine2, clamp(dot(half, direction), 0.0, 1.0));
}

fn distribution(angles: Reflected, square: f32) -> f32 {
    let height = angles.half_sine2 + square * angles.half_cosine2;
    return square / (PI * height * height);
}

// π f/ρ_s for light from a direction, averaged over a light of this angular radius.
fn lobe_value(brdf: Brdf, normal: vec3f, mirror: vec3f, direction: vec3f, angle: f32) -> f32 {
    if has_coat(brdf) {
        let angles = reflected_by(normal, mirror, direction);
        if angles.light <= 0.0 || angles.viewer <= 0.0 {
            return 0.0;
        }
        let square = min(brdf.coat * brdf.coat + 0.25 * angle * angle, 1.0);
        let seen = sqrt(square + (1.0 - square) * angles.viewer * angles.viewer);
        let lit = sqrt(square + (1.0 - square) * angles.light * angles.light);
        let visible = 0.5 / (angles.viewer * lit + angles.light * seen);
        return PI * distribution(angles, square) * visible * fresnel(angles.difference);
    }
    let cosine = dot(mirror, direction);
    if cosine <= 0.0 {
        return 0.0;
    }
    let n = 1.0 / (1.0 / brdf.exponent + 0.25 * angle * angle);
    return 0.5 * (n + 2.0) * pow(cosine, n);
}

// f in 1/sr.
fn brdf_value(brdf: Brdf, normal: vec3f, mirror: vec3f, direction: vec3f) -> vec3f {
    if !is_specular(brdf) {
        return brdf.diffuse / PI;
    }
    let lobe = lobe_value(brdf, normal, mirror, direction, 0.0);
    return (brdf.diffuse + strength(brdf) * lobe) / PI;
}

// The part of the paths that the specular lobe sends on.
fn specular_part(brdf: Brdf, normal: vec3f, mirror: vec3f) -> f32 {
    if !is_specular(brdf) {
        return 0.0;
    }
    let diffuse = brdf.diffuse.x + brdf.diffuse.y + brdf.diffuse.z;
    var specular = brdf.specular.x + brdf.specular.y + brdf.specular.z;
    if has_coat(brdf) {
        specular = 3.0 * fresnel(clamp(dot(normal, mirror), 0.0, 1.0));
    }
    return select(0.0, specular / (diffuse + specular), specular > 0.0);
}

// Density by solid angle with which `scatter` chooses a direction.
fn density_of(brdf: Brdf, normal: vec3f, mirror: vec3f, direction: vec3f, cosine: f32) -> f32 {
    let part = specular_part(brdf, normal, mirror);
    var density = (1.0 - part) * cosine / PI;
    if part > 0.0 {
        if has_coat(brdf) {
            let angles = reflected_by(normal, mirror, direction);
            if angles.light > 0.0 && angles.viewer > 0.0 {
                density += part * distribution(angles, brdf.coat * brdf.coat) * sqrt(angles.half_cosine2)
                    / (4.0 * max(angles.difference, LEAST));
            }
        } else {
            let along = dot(mirror, direction);
            if along > 0.0 {
                density += part * (brdf.exponent + 1.0) / (2.0 * PI) * pow(along, brdf.exponent);
            }
        }
    }
    return density;
}

fn turned(axis: vec3f, height: f32, part: f32) -> vec3f {
    let across = sqrt(max(1.0 - height * height, 0.0));
    let angle = 2.0 * PI * part;
    return about(axis, vec3f(across * cos(angle), across * sin(angle), height));
}

struct Scattered {
    direction: vec3f,
    // By solid angle; 0 where the path ends.
    density: f32,
    // Reflectance times cosine over density.
    weight: vec3f,
}

fn scatter(brdf: Brdf, normal: vec3f, mirror: vec3f, square: vec2f) -> Scattered {
    let part = specular_part(brdf, normal, mirror);
    if part == 0.0 {
        let direction = about(normal, square_to_cosine_hemisphere(square));
        let cosine = dot(direction, normal);
        return Scattered(direction, max(cosine, 0.0) / PI, brdf.diffuse);
    }
    var direction: vec3f;
    if square.x < part {
        let across = square.x / part;
        if has_coat(brdf) {
            let tangent2 = brdf.coat * brdf.coat * across / max(1.0 - across, 1e-7);
            let half = turned(normal, 1.0 / sqrt(1.0 + tangent2), square.y);
            direction = mirrored(mirrored(mirror, normal), half);
        } else {
            direction = turned(mirror, pow(across, 1.0 / (brdf.exponent + 1.0)), square.y);
        }
    } else {
        let rest = min((square.x - part) / (1.0 - part), 0.99999994);
        direction = about(normal, square_to_cosine_hemisphere(vec2f(rest, square.y)));
    }
    let cosine = dot(direction, normal);
    if cosine <= 0.0 {
        return Scattered(direction, 0.0, vec3f(0.0));
    }
    let density = density_of(brdf, normal, mirror, direction, cosine);
    let value = brdf_value(brdf, normal, mirror, direction);
    return Scattered(direction, density, value * (cosine / max(density, LEAST)));
}
