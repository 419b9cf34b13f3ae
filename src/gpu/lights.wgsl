// Added lights, and the recovered lights and their sky: src/scene/emitter.rs, src/render/added.rs,
// src/render/light.rs, src/render/lights.rs, src/render/sky.rs.

// Luminaires of known shape; see `Emitter`.
const RECTANGLE: u32 = 0u;
const SPHERE: u32 = 1u;
const POINT: u32 = 2u;
const SPOT: u32 = 3u;
const SUN: u32 = 4u;
// Added lights that are no luminaires.
const DOME: u32 = 5u;

// Kinds of recovered lights.
const DISC: u32 = 0u;
const LAMP: u32 = 1u;
const SKY: u32 = 2u;
const DISTANT_SUN: u32 = 3u;
const KNOWN: u32 = 4u;

const LIGHT_WORDS: u32 = 16u;
const LOBE_WORDS: u32 = 8u;
const CELL_WORDS: u32 = 12u;
const ADDED_WORDS: u32 = 8u;
/// As in src/render/added.rs: a panel may lie on the surface that a ray met.
const FLUSH: f32 = 1e-3;

fn ray_from(point: Point, direction: vec3f) -> Ray {
    return Ray(point.position + point.normal * params.offset_m, 0.0, direction, ENDLESS);
}

// The segment from a surface point to a point above its surface, up to which it is to be free; of
// no length where it is free without a look.
fn segment(point: Point, end: vec3f) -> Ray {
    let origin = point.position + point.normal * params.offset_m;
    let offset = end - origin;
    let size = length(offset);
    if size <= params.offset_m {
        return Ray(origin, 0.0, point.normal, 0.0);
    }
    return Ray(origin, 0.0, offset / size, size * (1.0 - 1e-4) - params.offset_m);
}

// Light that arrives where nothing is met by a ray.
struct Pending {
    ray: Ray,
    // 0 where nothing arrives.
    light: vec3f,
    layer: u32,
}

fn no_light() -> Pending {
    return Pending(Ray(vec3f(0.0), 0.0, vec3f(0.0), 0.0), vec3f(0.0), 0u);
}

struct Arrival {
    direction: vec3f,
    // The cosine at the surface point; 0 where nothing arrives.
    cosine: f32,
    // Where the light leaves the luminaire.
    origin: vec3f,
    strength: f32,
    is_distant: bool,
}

fn above(point: Point, direction: vec3f, origin: vec3f, strength: f32, is_distant: bool) -> Arrival {
    return Arrival(direction, max(dot(direction, point.normal), 0.0), origin, strength, is_distant);
}

fn towards(point: Point, origin: vec3f, strength: f32) -> Arrival {
    let offset = origin - point.position;
    let size = length(offset);
    if size <= 0.0 {
        return Arrival(vec3f(0.0), 0.0, origin, 0.0, false);
    }
    return above(point, offset / size, origin, strength, false);
}

fn spot_falloff(cosine: f32, full: f32, none: f32) -> f32 {
    if cosine >= full {
        return 1.0;
    }
    if cosine <= none {
        return 0.0;
    }
    let t = (cosine - none) / (full - none);
    return t * t * (3.0 - 2.0 * t);
}

// The light that a point of the unit square stands for, above a surface point's horizon; lights
// nearer than `least_m` count as that far away.
fn arrival(emitter: u32, point: Point, least_m: f32, square: vec2f) -> Arrival {
    let nothing = Arrival(vec3f(0.0), 0.0, vec3f(0.0), 0.0, false);
    let kind = small[emitter];
    let least = max(least_m * least_m, LEAST);
    let first = triple(emitter + 1u);
    if kind == RECTANGLE {
        let c = triple(emitter + 7u);
        var to = first + square.y * (triple(emitter + 10u) - first) + square.x * (c - triple(emitter + 10u));
        var area = 2.0 * number(emitter + 17u);
        if square.x > square.y {
            let b = triple(emitter + 4u);
            to = first + square.x * (b - first) + square.y * (c - b);
            area = 2.0 * number(emitter + 16u);
        }
        let offset = to - point.position;
        let facing = -dot(offset, triple(emitter + 13u));
        if facing <= 0.0 {
            return nothing;
        }
        let reach = max(dot(offset, offset), least);
        return towards(point, to, area * facing / reach / sqrt(reach));
    }
    if kind == SPHERE {
        let axis = first - point.position;
        let radius = number(emitter + 4u);
        let distance2 = dot(axis, axis);
        let radius2 = radius * radius;
        if distance2 <= radius2 {
            let direction = about(point.normal, square_to_cosine_hemisphere(square));
            let along = dot(axis, direction);
            let beyond = max(along * along + radius2 - distance2, 0.0);
            let origin = point.position + direction * (along + sqrt(beyond));
            return above(point, direction, origin, PI / dot(direction, point.normal), false);
        }
        let sine2 = radius2 / distance2;
        let cap = sine2 / (1.0 + sqrt(1.0 - sine2));
        let distance = sqrt(distance2);
        let local = square_to_uniform_cone(square, cap);
        let off_axis = distance2 * dot(local.xy, local.xy);
        let half_chord = sqrt(max(radius2 - off_axis, 0.0));
        let entry = max(distance * local.z - half_chord, 0.0);
        let direction = about(axis / distance, local);
        return above(point, direction, point.position + direction * entry, 2.0 * PI * cap, false);
    }
    if kind == POINT {
        let offset = first - point.position;
        return towards(point, first, 1.0 / max(dot(offset, offset), least));
    }
    if kind == SPOT {
        let offset = point.position - first;
        let size = length(offset);
        let cosine = select(0.0, dot(offset / size, triple(emitter + 4u)), size > 0.0);
        let part = spot_falloff(cosine, number(emitter + 7u), number(emitter + 8u));
        if part == 0.0 {
            return nothing;
        }
        return towards(point, first, part / max(dot(offset, offset), least));
    }
    let cap = number(emitter + 4u);
    let direction = about(-first, square_to_uniform_cone(square, cap));
    return above(point, direction, vec3f(0.0), 1.0 / (1.0 - 0.5 * cap), true);
}

fn way_of(point: Point, arriving: Arrival) -> Ray {
    if arriving.is_distant {
        return ray_from(point, arriving.direction);
    }
    return segment(point, arriving.origin);
}

fn side_of(start: vec3f, end: vec3f, place: vec3f, normal: vec3f) -> f32 {
    return dot(cross(end - start, place - start), normal);
}

fn holds(a: vec3f, b: vec3f, c: vec3f, place: vec3f, normal: vec3f) -> bool {
    let sides = vec3f(side_of(a, b, place, normal), side_of(b, c, place, normal), side_of(c, a, place, normal));
    return all(sides >= vec3f(0.0)) || all(sides <= vec3f(0.0));
}

// Where a ray from a surface point meets a luminaire's shining side, and the strength with which
// `arrival` stands for that direction; a strength of 0 where it does not.
fn met_emitter(emitter: u32, point: Point, direction: vec3f) -> vec2f {
    let kind = small[emitter];
    let first = triple(emitter + 1u);
    if kind == RECTANGLE {
        let normal = triple(emitter + 13u);
        let facing = -dot(direction, normal);
        if facing <= 0.0 {
            return vec2f(0.0);
        }
        let distance = dot(point.position - first, normal) / facing;
        let place = point.position + direction * distance;
        let c = triple(emitter + 7u);
        var area = 0.0;
        if holds(first, triple(emitter + 4u), c, place, normal) {
            area = number(emitter + 16u);
        } else if holds(first, c, triple(emitter + 10u), place, normal) {
            area = number(emitter + 17u);
        }
        if distance <= 0.0 {
            return vec2f(0.0);
        }
        return vec2f(distance, 2.0 * area * facing / (distance * distance));
    }
    if kind != SPHERE {
        return vec2f(0.0);
    }
    let axis = first - point.position;
    let radius = number(emitter + 4u);
    let along = dot(axis, direction);
    let distance2 = dot(axis, axis);
    let radius2 = radius * radius;
    let chord2 = along * along + radius2 - distance2;
    if chord2 < 0.0 {
        return vec2f(0.0);
    }
    let half_chord = sqrt(chord2);
    if distance2 <= radius2 {
        let cosine = dot(direction, point.normal);
        return select(vec2f(0.0), vec2f(along + half_chord, PI / cosine), cosine > 0.0);
    }
    let sine2 = radius2 / distance2;
    let cap = sine2 / (1.0 + sqrt(1.0 - sine2));
    return select(vec2f(0.0), vec2f(along - half_chord, 2.0 * PI * cap), along > 0.0);
}

// Azimuth and polar angle of a direction, as images of all directions have them.
fn angles_of(direction: vec3f) -> vec2f {
    return vec2f(atan2(direction.x, direction.y), atan2(length(direction.xy), direction.z));
}

fn dome_texel(dome: u32, x: i32, y: i32) -> vec3f {
    let width = i32(small[dome]);
    let height = i32(small[dome + 1u]);
    let column = ((x % width) + width) % width;
    let row = clamp(y, 0, height - 1);
    return texel(small[dome + 2u] + 3u * u32(row * width + column));
}

fn dome_radiance(dome: u32, direction: vec3f) -> vec3f {
    let angles = angles_of(direction);
    let place = vec2f(
        (angles.x + number(dome + 4u)) / (2.0 * PI) * f32(small[dome]) - 0.5,
        angles.y / PI * f32(small[dome + 1u]) - 0.5);
    let low = floor(place);
    let part = place - low;
    let at = vec2i(low);
    let top = mix(dome_texel(dome, at.x, at.y), dome_texel(dome, at.x + 1, at.y), part.x);
    let bottom = mix(dome_texel(dome, at.x, at.y + 1), dome_texel(dome, at.x + 1, at.y + 1), part.x);
    return number(dome + 3u) * mix(top, bottom, part.y);
}

fn dome_sum(dome: u32, cell: u32) -> f32 {
    return bitcast<f32>(large[small[dome + 7u] + cell]);
}

fn dome_probability(dome: u32, cell: u32) -> f32 {
    if cell == 0u {
        return dome_sum(dome, 0u);
    }
    return dome_sum(dome, cell) - dome_sum(dome, cell - 1u);
}

// The height of a row's upper edge.
fn dome_edge(dome: u32, row: u32) -> f32 {
    return cos(f32(row) / f32(small[dome + 6u]) * PI);
}

fn dome_solid_angle(dome: u32, row: u32) -> f32 {
    return (dome_edge(dome, row) - dome_edge(dome, row + 1u)) * 2.0 * PI / f32(small[dome + 5u]);
}

fn dome_density(dome: u32, direction: vec3f) -> f32 {
    let columns = small[dome + 5u];
    let rows = small[dome + 6u];
    let angles = angles_of(direction);
    let around = angles.x / (2.0 * PI);
    let column = min(u32((around - floor(around)) * f32(columns)), columns - 1u);
    let row = min(u32(angles.y / PI * f32(rows)), rows - 1u);
    return dome_probability(dome, row * columns + column) / dome_solid_angle(dome, row);
}

// A direction and its density by solid angle.
fn dome_sample(dome: u32, square: vec2f) -> vec4f {
    let columns = small[dome + 5u];
    var low = 0u;
    var high = columns * small[dome + 6u] - 1u;
    while low < high {
        let middle = (low + high) / 2u;
        if dome_sum(dome, middle) <= square.x {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    let probability = dome_probability(dome, low);
    if probability <= 0.0 {
        return vec4f(0.0);
    }
    let rest = (square.x - (dome_sum(dome, low) - probability)) / probability;
    let row = low / columns;
    let edge = dome_edge(dome, row);
    let height = edge + square.y * (dome_edge(dome, row + 1u) - edge);
    let azimuth = (f32(low % columns) + clamp(rest, 0.0, 1.0)) / f32(columns) * 2.0 * PI;
    let across = sqrt(max(1.0 - height * height, 0.0));
    return vec4f(across * sin(azimuth), across * cos(azimuth), height, probability / dome_solid_angle(dome, row));
}

struct Direct {
    ray: Ray,
    direction: vec3f,
    cosine: f32,
    // Radiance divided by the density of its direction; 0 where nothing arrives.
    light: vec3f,
    // 0 for lights without extent, which are found in no other way.
    density: f32,
}

// Light of an added light from a direction that a point of the unit square stands for, were nothing
// in the way.
fn added_sample(added: u32, point: Point, square: vec2f) -> Direct {
    let emission = triple(added + 2u);
    let record = small[added + 5u];
    if small[added] == DOME {
        let sampled = dome_sample(record, square);
        let cosine = dot(sampled.xyz, point.normal);
        var light = vec3f(0.0);
        if sampled.w > 0.0 && cosine > 0.0 {
            light = dome_radiance(record, sampled.xyz) * emission / sampled.w;
        }
        return Direct(ray_from(point, sampled.xyz), sampled.xyz, cosine, light, sampled.w);
    }
    let arriving = arrival(record, point, params.offset_m, square);
    let kind = small[record];
    let density = select(0.0, 1.0 / arriving.strength, kind == RECTANGLE || kind == SPHERE);
    let is_there = arriving.cosine > 0.0 && arriving.strength >= LEAST;
    let light = select(vec3f(0.0), emission * arriving.strength, is_there);
    return Direct(way_of(point, arriving), arriving.direction, arriving.cosine, light, density);
}

struct MetLight {
    radiance: vec3f,
    // With which `added_sample` finds its direction; 0 where it is not met.
    density: f32,
    // What has to be free; of no length where it is.
    ray: Ray,
}

// An added light that a ray meets before `distance_m`.
fn added_met(added: u32, point: Point, direction: vec3f, distance_m: f32) -> MetLight {
    let emission = triple(added + 2u);
    let record = small[added + 5u];
    var met = MetLight(emission, 0.0, no_light().ray);
    if small[added] == DOME {
        if distance_m >= ENDLESS {
            met.radiance = dome_radiance(record, direction) * emission;
            met.density = dome_density(record, direction);
        }
        return met;
    }
    let found = met_emitter(record, point, direction);
    if found.y <= 0.0 {
        return met;
    }
    if found.x < distance_m {
        met.density = 1.0 / found.y;
    } else if found.x * (1.0 - FLUSH) - 1e2 * params.offset_m < distance_m {
        met.density = 1.0 / found.y;
        met.ray = segment(point, point.position + direction * found.x);
    }
    return met;
}

// The side of the grid over the scene that holds a surface point.
fn bin_of(point: Point) -> u32 {
    let side = params.grid_side;
    let place = (point.position - params.grid_low) / params.grid_cell;
    let cell = min(vec3u(max(place, vec3f(0.0))), vec3u(side - 1u));
    let size = abs(point.normal);
    var axis = 0u;
    if size.y > size.x {
        axis = 1u;
    }
    if size.z > max(size.x, size.y) {
        axis = 2u;
    }
    let sign = select(0u, 1u, point.normal[axis] < 0.0);
    return ((cell.z * side + cell.y) * side + cell.x) * 6u + 2u * axis + sign;
}

fn choice_sum(at: u32) -> f32 {
    return bitcast<f32>(choices[at]);
}

struct Chosen {
    light: u32,
    probability: f32,
}

// One of the recovered lights, chosen by a number in [0, 1).
fn chosen(bin: u32, choice: f32) -> Chosen {
    let count = params.light_count;
    let first = bin * count;
    let part = min(u32(choice * f32(count)), count - 1u);
    var index = choices[params.choice_starts + first + part];
    while index + 1u < count && choice_sum(first + index) <= choice {
        index++;
    }
    return Chosen(index, probability_of(first, index));
}

fn probability_of(first: u32, light: u32) -> f32 {
    if light == 0u {
        return choice_sum(first);
    }
    return choice_sum(first + light) - choice_sum(first + light - 1u);
}

// Light from one recovered light at a surface point, were nothing in the way.
struct Arriving {
    irradiance: vec3f,
    // For a known luminaire, whose `cosine` is else 1; 0 where nothing arrives.
    way: Arrival,
}

fn direction_to(light: u32, position: vec3f) -> vec3f {
    let kind = small[light];
    if kind == SKY || kind == DISTANT_SUN {
        return -triple(light + 8u);
    }
    let offset = triple(light + 4u) - position;
    let size = length(offset);
    return select(vec3f(0.0), offset / size, size > 0.0);
}

fn lobes_of(light: u32, from_light: vec3f) -> vec3f {
    var sum = vec3f(0.0);
    let first = small[light + 2u];
    for (var lobe = first; lobe < first + small[light + 3u] * LOBE_WORDS; lobe += LOBE_WORDS) {
        let exponent = number(lobe + 3u);
        var value = 1.0;
        if exponent != 0.0 {
            let cosine = max(dot(from_light, triple(lobe)), 0.0);
            value = select(0.0, pow(cosine, exponent), cosine > 0.0);
        }
        sum += value * triple(lobe + 4u);
    }
    return sum;
}

fn arriving_from(light: u32, point: Point, square: vec2f) -> Arriving {
    let kind = small[light];
    if kind == KNOWN {
        let way = arrival(small[light + 14u], point, params.offset_m, square);
        return Arriving(triple(small[light + 2u] + 4u) * way.cosine * way.strength, way);
    }
    var factor: f32;
    var direction: vec3f;
    if kind == SKY || kind == DISTANT_SUN {
        direction = -triple(light + 8u);
        factor = max(dot(direction, point.normal), 0.0);
        if kind == SKY {
            factor *= number(light + 12u);
        }
    } else {
        let offset = triple(light + 4u) - point.position;
        let distance = length(offset);
        direction = offset / max(distance, LEAST);
        let near = max(distance, 0.5 * number(light + 7u));
        factor = number(light + 13u) * max(dot(direction, point.normal), 0.0) / (near * near);
    }
    let way = Arrival(direction, select(0.0, 1.0, factor > 0.0), vec3f(0.0), 0.0, false);
    if factor <= 0.0 {
        return Arriving(vec3f(0.0), way);
    }
    return Arriving(factor * lobes_of(light, -direction), way);
}

// The direction to the place of a light at infinity for a point of the unit disc.
fn distant_direction(light: u32, disc: vec2f) -> vec3f {
    let spread = sin(0.5 * number(light + 11u)) * disc;
    let size2 = dot(spread, spread);
    let out = 2.0 * spread * sqrt(max(1.0 - size2, 0.0));
    return -about(triple(light + 8u), vec3f(out, 1.0 - 2.0 * size2));
}

// The ray to the place of a recovered light for a point of the unit square; `t_max` is below 0
// where that is below the horizon.
fn way_to_light(light: u32, point: Point, way: Arrival, square: vec2f) -> Ray {
    let kind = small[light];
    if kind == KNOWN {
        return way_of(point, way);
    }
    let disc = square_to_disc(square);
    if kind == SKY || kind == DISTANT_SUN {
        let direction = distant_direction(light, disc);
        var ray = ray_from(point, direction);
        ray.t_max = select(-1.0, ENDLESS, dot(direction, point.normal) > 0.0);
        return ray;
    }
    var axis = triple(light + 8u);
    if kind == LAMP {
        axis = direction_to(light, point.position);
    }
    let place = triple(light + 4u) + number(light + 7u) * about(axis, vec3f(disc, 0.0));
    var ray = segment(point, place);
    ray.t_max = select(-1.0, ray.t_max, dot(place - point.position, point.normal) > 0.0);
    return ray;
}

// π f/ρ_s of a specular surface for a light, averaged over its extent. A known luminaire counts as
// the ball that looks about as large, as on the processor.
fn lobe_of_light(light: u32, point: Point, mirror: vec3f, brdf: Brdf) -> f32 {
    let kind = small[light];
    var angle = number(light + 11u);
    if kind != SKY && kind != DISTANT_SUN {
        let distance = max(length(triple(light + 4u) - point.position), LEAST);
        angle = min(number(light + 7u) / distance, 1.0);
    }
    return lobe_value(brdf, point.normal, mirror, direction_to(light, point.position), angle);
}

// The cells of the sky that may hold a direction: the range of `sky_members`.
fn sky_bucket(direction: vec3f) -> vec2u {
    if params.sky_cells == NOTHING {
        return vec2u(0u);
    }
    let polar = atan2(length(direction.xy), direction.z);
    let around = atan2(direction.y, direction.x) / (2.0 * PI);
    let row = min(u32(polar / PI * 32.0), 31u);
    let column = min(u32((around - floor(around)) * 64.0), 63u);
    let at = params.sky_first + row * 64u + column;
    return vec2u(small[at], small[at + 1u]);
}

fn sky_cell(member: u32) -> u32 {
    return params.sky_cells + small[params.sky_members + member] * CELL_WORDS;
}

// sin² of half the angle to the middle, in that of the cell's edge.
fn off_cell(cell: u32, direction: vec3f) -> f32 {
    let off = 0.5 * length(direction - triple(cell)) / number(cell + 3u);
    return off * off;
}

// Radiance of the sky from a direction, and its layer; NOTHING in `layer` where there is none.
struct SkySeen {
    radiance: vec3f,
    layer: u32,
}

fn sky_seen(direction: vec3f) -> SkySeen {
    var seen = SkySeen(vec3f(0.0), NOTHING);
    var nearest = 1.0;
    let range = sky_bucket(direction);
    for (var member = range.x; member < range.y; member++) {
        let cell = sky_cell(member);
        let off = off_cell(cell, direction);
        if off < nearest || (off <= nearest && seen.layer == NOTHING) {
            nearest = off;
            seen = SkySeen(triple(cell + 6u), small[cell + 5u]);
        }
    }
    return seen;
}
