// Points, directions and reproducible random numbers, as in src/math/sampling.rs, and the
// Owen-scrambled Sobol points of the crate sobol_burley (Burley 2020), whose tables are uploaded.

const PI: f32 = 3.14159265358979;
const LEAST: f32 = 1.17549435e-38;

// One path: its shuffled index in its set of points, whose bits are reversed, the seed of the set, and
// the state of further numbers.
var<private> point_index: u32;
var<private> point_seed: u32;
var<private> random_state: u32;
var<private> light_state: u32;

/// Points of one set; the next set has another seed.
const SET: u32 = 65536u;
/// Places of a path that have low-discrepancy numbers, see src/render/path.rs.
const PLACES: u32 = 28u;

fn hashed(value: u32) -> u32 {
    var n = value ^ 0xe6fe3bebu;
    n ^= n >> 16u;
    n *= 0x7feb352du;
    n ^= n >> 15u;
    n *= 0x846ca68bu;
    n ^= n >> 16u;
    return n;
}

// Path `index` of a pixel. Even and odd paths are two independent sets.
fn begin_path(seed: u32, pixel: u32, index: u32) {
    let half = index & 1u;
    let within = index >> 1u;
    let mixed = hashed(hashed(hashed(seed) ^ pixel) ^ (2u * (within / SET) + half));
    point_seed = mixed;
    let reversed = vec4u(reverseBits(within % SET));
    point_index = owen(reversed, vec4u(hashed(mixed ^ 0x79c68e4au))).x;
    random_state = hashed(mixed ^ hashed(within));
    light_state = hashed(random_state ^ 0x9e3779b9u);
}

// PCG (O'Neill 2014), its permutation RXS-M-XS with 32 bits.
fn advanced(state: u32) -> u32 {
    return state * 747796405u + 2891336453u;
}

fn output_of(state: u32) -> f32 {
    var word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    word = (word >> 22u) ^ word;
    return f32(word >> 8u) * (1.0 / 16777216.0);
}

fn uniform_number() -> f32 {
    random_state = advanced(random_state);
    return output_of(random_state);
}

fn light_number() -> f32 {
    light_state = advanced(light_state);
    return output_of(light_state);
}

fn owen(value: vec4u, scramble: vec4u) -> vec4u {
    var n = value;
    n ^= n * 0x3d20adeau;
    n += scramble;
    n *= (scramble >> vec4u(16u)) | vec4u(1u);
    n ^= n * 0x05526c56u;
    n ^= n * 0x53a22864u;
    return n;
}

fn hashed4(value: vec4u) -> vec4u {
    var n = value ^ vec4u(0xe6fe3bebu);
    n ^= n >> vec4u(16u);
    n *= 0x7feb352du;
    n ^= n >> vec4u(15u);
    n *= 0x846ca68bu;
    n ^= n >> vec4u(16u);
    return n;
}

// Four dimensions of the path's point.
fn four(dimensions: u32) -> vec4f {
    let table = dimensions * 64u;
    let sobol = points[table + (point_index >> 28u)]
        ^ points[table + 16u + ((point_index >> 24u) & 15u)]
        ^ points[table + 32u + ((point_index >> 20u) & 15u)]
        ^ points[table + 48u + ((point_index >> 16u) & 15u)];
    let scramble = vec4u(point_seed * 0x9c8f2d3bu) ^ vec4u(dimensions)
        ^ vec4u(0x912f69bau, 0x174f18abu, 0x691e72cau, 0xb40cc1b8u);
    let result = reverseBits(owen(sobol, hashed4(scramble)));
    return bitcast<vec4f>((result >> vec4u(9u)) | vec4u(0x3f800000u)) - vec4f(1.0);
}

// A direction to go on in, and a point of every added light.
fn numbers_of_place(depth: u32) -> vec4f {
    if depth < PLACES {
        return four(1u + depth);
    }
    return vec4f(uniform_number(), uniform_number(), uniform_number(), uniform_number());
}

// A choice among the recovered lights, and a point of the chosen one.
fn numbers_of_light(depth: u32, sample: u32) -> vec3f {
    if depth < PLACES {
        // Four samples at the first vertex, two at the second, one at each later one.
        let before = select(select(4u + depth, 4u, depth == 1u), 0u, depth == 0u);
        return four(1u + PLACES + before + sample).xyz;
    }
    return vec3f(light_number(), light_number(), light_number());
}

fn square_to_disc(square: vec2f) -> vec2f {
    let p = 2.0 * square - 1.0;
    if p.x == 0.0 && p.y == 0.0 {
        return vec2f(0.0);
    }
    if abs(p.x) > abs(p.y) {
        let angle = 0.25 * PI * (p.y / p.x);
        return p.x * vec2f(cos(angle), sin(angle));
    }
    let angle = 0.5 * PI - 0.25 * PI * (p.x / p.y);
    return p.y * vec2f(cos(angle), sin(angle));
}

fn square_to_cosine_hemisphere(square: vec2f) -> vec3f {
    let disc = square_to_disc(square);
    return vec3f(disc, sqrt(max(1.0 - dot(disc, disc), 0.0)));
}

fn square_to_uniform_cone(square: vec2f, cap: f32) -> vec3f {
    let disc = square_to_disc(square);
    let fall = cap * dot(disc, disc);
    return vec3f(disc * sqrt(max(cap * (2.0 - fall), 0.0)), 1.0 - fall);
}

fn mirrored(direction: vec3f, normal: vec3f) -> vec3f {
    return 2.0 * dot(normal, direction) * normal - direction;
}

// The direction in the world of one about a unit normal (Duff et al. 2017, as in glam).
fn about(normal: vec3f, local: vec3f) -> vec3f {
    let sign = select(-1.0, 1.0, normal.z >= 0.0);
    let a = -1.0 / (sign + normal.z);
    let b = normal.x * normal.y * a;
    let tangent = vec3f(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x);
    let bitangent = vec3f(b, sign + normal.y * normal.y * a, -normal.y);
    return tangent * local.x + bitangent * local.y + normal * local.z;
}
