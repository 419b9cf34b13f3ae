// Takes the noise out of pictures: src/render/denoise.rs, which says how and why. Planes of numbers
// lie as they do there, one for each number of a row of pixels. Every thread makes one pixel.

struct Params {
    width: u32,
    height: u32,
    // Planes of light, before brightness and variance.
    planes: u32,
    // Pixels from a neighbour to the next one.
    step: i32,
}

// As in src/render/denoise and its kernel.
const LEAST: f32 = 1.17549435e-38;
const GUIDES: u32 = 7u;
const LIGHT: f32 = 8.0;
/// Pixels to each side whose variances are averaged.
const REACH: i32 = 3;
/// Neighbours to each side in a round, and all of them with the pixel.
const SIDE: i32 = 2;
const TAPS: u32 = 25u;

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> guides: array<f32>;
@group(0) @binding(2) var<storage, read> light: array<f32>;
@group(0) @binding(3) var<storage, read_write> result: array<f32>;

// Where a plane's number of a pixel is, of `planes` planes.
fn at(pixel: vec2u, planes: u32, plane: u32) -> u32 {
    return (pixel.y * planes + plane) * params.width + pixel.x;
}

fn is_inside(pixel: vec2i) -> bool {
    return all(pixel >= vec2i(0)) && pixel.x < i32(params.width) && pixel.y < i32(params.height);
}

struct Guide {
    // Unit normal; 1 where no surface is.
    normal: vec4f,
    distance_m: f32,
    slope: vec2f,
}

fn guide(pixel: vec2u) -> Guide {
    let first = at(pixel, GUIDES, 0u);
    let w = params.width;
    return Guide(
        vec4f(guides[first], guides[first + w], guides[first + 2u * w], guides[first + 3u * w]),
        guides[first + 4u * w],
        vec2f(guides[first + 5u * w], guides[first + 6u * w]));
}

// From 0 to 1, whether two pixels show one smooth surface; `further` of the exponent is against it.
fn alike(own: Guide, other: Guide, away: vec2f, further: f32) -> f32 {
    let change = 0.5 * (own.slope + other.slope) * away;
    let off = abs(other.distance_m - own.distance_m - (change.x + change.y));
    let steepest = abs(change.x) + abs(change.y);
    let scale = max(0.5 * steepest + 1e-3 * (own.distance_m + other.distance_m), LEAST);
    var near = max(dot(own.normal, other.normal), 0.0);
    for (var k = 0; k < 6; k++) {
        near *= near;
    }
    return near * exp(max(-off / scale - further, -60.0));
}

@compute @workgroup_size(32, 4)
fn smooth_variance(@builtin(global_invocation_id) id: vec3u) {
    let pixel = id.xy;
    if !is_inside(vec2i(pixel)) {
        return;
    }
    let planes = params.planes + 2u;
    let own = guide(pixel);
    var sum = 0.0;
    var weights = 0.0;
    for (var j = -REACH; j <= REACH; j++) {
        for (var i = -REACH; i <= REACH; i++) {
            let place = vec2i(pixel) + vec2i(i, j);
            if !is_inside(place) {
                continue;
            }
            let other = vec2u(place);
            let weight = alike(own, guide(other), vec2f(f32(i), f32(j)), 0.0);
            sum += weight * light[at(other, planes, params.planes + 1u)];
            weights += weight;
        }
    }
    for (var plane = 0u; plane <= params.planes; plane++) {
        let index = at(pixel, planes, plane);
        result[index] = light[index];
    }
    result[at(pixel, planes, params.planes + 1u)] = sum / weights;
}

fn spline(k: i32) -> f32 {
    return select(select(0.0625, 0.25, abs(k) == 1), 0.375, k == 0);
}

// One round.
@compute @workgroup_size(32, 4)
fn filtered(@builtin(global_invocation_id) id: vec3u) {
    let pixel = id.xy;
    if !is_inside(vec2i(pixel)) {
        return;
    }
    let planes = params.planes + 2u;
    let own = guide(pixel);
    let brightness = light[at(pixel, planes, params.planes)];
    let variance = light[at(pixel, planes, params.planes + 1u)];
    var weights: array<f32, TAPS>;
    // What the neighbours leave to the pixel itself, which lies in the middle.
    var left = 1.0;
    var tap = 0u;
    for (var j = -SIDE; j <= SIDE; j++) {
        for (var i = -SIDE; i <= SIDE; i++) {
            let away = params.step * vec2i(i, j);
            let place = vec2i(pixel) + away;
            var weight = 0.0;
            if is_inside(place) && (i != 0 || j != 0) {
                let other = vec2u(place);
                let there = light[at(other, planes, params.planes)];
                let apart_variance = light[at(other, planes, params.planes + 1u)];
                let noise = LIGHT * sqrt(0.5 * (variance + apart_variance));
                let least = 1e-6 * abs(brightness + there) + LEAST;
                let apart = (brightness - there) / (noise + least);
                weight = spline(i) * spline(j)
                    * alike(own, guide(other), vec2f(away), apart * apart);
            }
            weights[tap] = weight;
            left -= weight;
            tap++;
        }
    }
    weights[TAPS / 2u] = left;
    for (var plane = 0u; plane < planes; plane++) {
        let is_variance = plane == params.planes + 1u;
        var sum = 0.0;
        tap = 0u;
        for (var j = -SIDE; j <= SIDE; j++) {
            for (var i = -SIDE; i <= SIDE; i++) {
                let weight = weights[tap];
                tap++;
                let place = vec2i(pixel) + params.step * vec2i(i, j);
                if is_inside(place) {
                    let factor = select(weight, weight * weight, is_variance);
                    sum += factor * light[at(vec2u(place), planes, plane)];
                }
            }
        }
        result[at(pixel, planes, plane)] = sum;
    }
}
