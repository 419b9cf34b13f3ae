// What photographs show of surface points: src/scene/views.rs and src/scene/agreement.rs.

const PHOTOGRAPH_WORDS: u32 = 32u;
/// Of a pixel that shows no triangle; the highest bit says that it is off every edge.
const NO_TRIANGLE: u32 = 0x7fffffffu;
const CLEAN: u32 = 0x80000000u;
/// Photographs asked for the radiance of a point, if they agree and at most.
const ENOUGH_VIEWS: u32 = 3u;
const MOST_VIEWS: u32 = 16u;
const AGREEMENT: f32 = 1.5;

// The pixel that a point projects into, or NOTHING.
fn pixel_of(photograph: u32, position: vec3f) -> u32 {
    let offset = position - triple(photograph + 4u);
    let local = vec3f(
        dot(triple(photograph + 8u), offset),
        dot(triple(photograph + 11u), offset),
        dot(triple(photograph + 14u), offset));
    if local.z >= 0.0 {
        return NOTHING;
    }
    var place = vec2f(local.x, -local.y) / -local.z;
    if small[photograph + 3u] != 0u {
        if length(place) > number(photograph + 30u) {
            return NOTHING;
        }
        let radial = vec4f(triple(photograph + 21u), number(photograph + 24u));
        let below = triple(photograph + 27u);
        place = distorted(place, radial, vec2f(number(photograph + 25u), number(photograph + 26u)), below);
    }
    let pixel = place * vec2f(number(photograph + 17u), number(photograph + 18u))
        + vec2f(number(photograph + 19u), number(photograph + 20u));
    let size = vec2f(f32(small[photograph]), f32(small[photograph + 1u]));
    if any(pixel < vec2f(0.0)) || any(pixel >= size) {
        return NOTHING;
    }
    let cell = vec2u(pixel);
    return small[photograph + 2u] + cell.y * small[photograph] + cell.x;
}

// OpenCV's lens distortion of a normalised image point.
fn distorted(p: vec2f, radial: vec4f, bend: vec2f, below: vec3f) -> vec2f {
    let r2 = dot(p, p);
    let over = 1.0 + r2 * (radial.x + r2 * (radial.y + r2 * (radial.z + r2 * radial.w)));
    let under = 1.0 + r2 * (below.x + r2 * (below.y + r2 * below.z));
    return p * (over / under) + vec2f(
        2.0 * bend.x * p.x * p.y + bend.y * (r2 + 2.0 * p.x * p.x),
        bend.x * (r2 + 2.0 * p.y * p.y) + 2.0 * bend.y * p.x * p.y);
}

// The pixel in which a photograph shows a surface point, or NOTHING.
fn shown_in(photograph: u32, point: Point) -> u32 {
    let eye = triple(photograph + 4u);
    let towards_eye = eye - point.position;
    if dot(towards_eye, point.normal) <= 0.0 {
        return NOTHING;
    }
    let pixel = pixel_of(photograph, point.position);
    if pixel == NOTHING {
        return NOTHING;
    }
    let seen = photographs[pixel].x;
    let triangle = seen & ~CLEAN;
    if (seen & CLEAN) != 0u && triangle != NO_TRIANGLE {
        let distance = length(towards_eye);
        let footprint = distance / min(number(photograph + 17u), number(photograph + 18u));
        let plane = triangles[triangle];
        let cosine = max(abs(dot(plane.xyz, towards_eye)) / distance, 0.02);
        // How far along the line of sight the point is off the pixel's tangent plane.
        let off_plane = abs(dot(plane.xyz, point.position) - plane.w) / cosine;
        if off_plane <= footprint {
            return pixel;
        }
        // Whether it is behind the plane, seen from the camera.
        let before = (dot(plane.xyz, eye) - plane.w) * (dot(plane.xyz, point.position) - plane.w) < 0.0;
        if before && off_plane > 4.0 * footprint {
            return NOTHING;
        }
    }
    return select(pixel, NOTHING, occluded(segment(point, eye), params.photographed_tree));
}

// Radiance of a pixel; -ENDLESS where it is no measurement.
fn measured(pixel: u32) -> vec3f {
    return bitcast<vec3f>(photographs[pixel].yzw);
}

fn rotated(value: u32, by: u32) -> u32 {
    return (value << by) | (value >> (32u - by));
}

// The radiance that a surface point sends all around, by the photographs that agree, of at most so
// many; w is how many were found that measure it.
fn photographed(point: Point, most: u32) -> vec4f {
    let count = params.photograph_count;
    if count == 0u {
        return vec4f(0.0);
    }
    let bits = bitcast<vec3u>(point.position);
    let mixed = (bits.x ^ rotated(bits.y, 11u) ^ rotated(bits.z, 22u)) * 0x9e3779b9u;
    let first = (mixed >> 8u) % count;
    var seen: array<vec3f, MOST_VIEWS>;
    var found = 0u;
    var darkest = ENDLESS;
    var brightest = 0.0;
    for (var k = 0u; k < count; k++) {
        let pixel = shown_in(params.photographs + (first + k) % count * PHOTOGRAPH_WORDS, point);
        if pixel == NOTHING {
            continue;
        }
        let radiance = measured(pixel);
        if radiance.x <= -ENDLESS {
            continue;
        }
        seen[found] = radiance;
        found++;
        let brightness = radiance.x + radiance.y + radiance.z;
        darkest = min(darkest, brightness);
        brightest = max(brightest, brightness);
        if found == most || found == ENOUGH_VIEWS && brightest <= AGREEMENT * darkest {
            break;
        }
    }
    var sum = vec3f(0.0);
    var agreeing = 0.0;
    for (var k = 0u; k < found; k++) {
        if seen[k].x + seen[k].y + seen[k].z <= AGREEMENT * darkest {
            sum += seen[k];
            agreeing += 1.0;
        }
    }
    return vec4f(sum / max(agreeing, 1.0), f32(found));
}
