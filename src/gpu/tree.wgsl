// Ray casting through the trees of src/geometry/bvh, whose words are uploaded as they are: nodes of
// eight children, leaves of up to eight triangles. The triangle test is the watertight one of Woop,
// Benthin, Wald (JCGT 2013), four triangles at a time.

const NOTHING: u32 = 0xffffffffu;
const LEAF: u32 = 0x80000000u;
const ENDLESS: f32 = 3e38;
/// Words of four numbers in a node and in a leaf.
const NODE_WORDS: u32 = 16u;
const LEAF_WORDS: u32 = 20u;
/// As in src/geometry/bvh/ray.rs.
const WIDENING: f32 = 1.0 / 524288.0;
const LEAST_DIRECTION: f32 = 1e-18;
const EPSILON: f32 = 1.1920929e-7;

struct Ray {
    origin: vec3f,
    t_min: f32,
    direction: vec3f,
    t_max: f32,
}

struct Hit {
    t: f32,
    // NOTHING where nothing is met.
    triangle: u32,
    u: f32,
    v: f32,
}

// The numbers of a ray that a traversal needs, computed once.
struct Prepared {
    near_origin: vec3f,
    far_origin: vec3f,
    inverse: vec3f,
    // Per axis 1 where the ray runs downwards: which row of bounds it enters by.
    backward: vec3u,
    // The axes of the world that are x, y, z of the sheared space, in which the ray runs along z.
    axes: vec3u,
    origin: vec3f,
    shear: vec3f,
    t_min: f32,
}

fn permuted(value: vec3f, z: u32) -> vec3f {
    return select(select(value, value.zxy, z == 1u), value.yzx, z == 0u);
}

fn prepared_for(ray: Ray, which: u32) -> Prepared {
    var result: Prepared;
    let low = params.tree_low[which].xyz;
    let high = params.tree_high[which].xyz;
    let farthest = max(abs(ray.origin - low), abs(high - ray.origin));
    let widening = vec3f(max(max(farthest.x, farthest.y), farthest.z) * WIDENING)
        + abs(ray.origin) * EPSILON;
    let backward = ray.direction < vec3f(0.0);
    let size = abs(ray.direction);
    let inverse = 1.0 / max(size, vec3f(LEAST_DIRECTION));
    result.inverse = select(inverse, -inverse, backward);
    result.near_origin = ray.origin + select(widening, -widening, backward);
    result.far_origin = ray.origin + select(-widening, widening, backward);
    result.backward = select(vec3u(0u), vec3u(1u), backward);
    var z = select(2u, 1u, size.y >= size.z);
    if size.x >= size.y && size.x >= size.z {
        z = 0u;
    }
    result.axes = select(select(vec3u(0u, 1u, 2u), vec3u(2u, 0u, 1u), z == 1u), vec3u(1u, 2u, 0u), z == 0u);
    result.origin = permuted(ray.origin, z);
    let along = permuted(ray.direction, z);
    let scale = 1.0 / along.z;
    result.shear = vec3f(along.x * scale, along.y * scale, scale);
    result.t_min = ray.t_min;
    return result;
}

// Where four children of a node are entered: t, or ENDLESS for those that are not met.
fn entered(node: u32, half: u32, ray: Prepared, t_max: f32) -> vec4f {
    var near = vec4f(ray.t_min);
    var far = vec4f(t_max);
    for (var axis = 0u; axis < 3u; axis++) {
        let row = 2u * axis + ray.backward[axis];
        let first = bitcast<vec4f>(tree[node + 2u * row + half]);
        let last = bitcast<vec4f>(tree[node + 2u * (row ^ 1u) + half]);
        near = max(near, (first - ray.near_origin[axis]) * ray.inverse[axis]);
        far = min(far, (last - ray.far_origin[axis]) * ray.inverse[axis]);
    }
    return select(vec4f(ENDLESS), near, near <= far);
}

struct Met {
    // ENDLESS for triangles that are not met.
    t: vec4f,
    // Weights of the second and third corner as parts of `sum`.
    v: vec4f,
    w: vec4f,
    sum: vec4f,
}

// Four triangles of a leaf, those that are met within [t_min, t_max].
fn met_in_leaf(leaf: u32, half: u32, ray: Prepared, t_max: f32) -> Met {
    var x: array<vec4f, 3>;
    var y: array<vec4f, 3>;
    var z: array<vec4f, 3>;
    for (var corner = 0u; corner < 3u; corner++) {
        let row = leaf + 6u * corner + half;
        z[corner] = bitcast<vec4f>(tree[row + 2u * ray.axes.z]) - ray.origin.z;
        x[corner] = bitcast<vec4f>(tree[row + 2u * ray.axes.x]) - ray.origin.x - ray.shear.x * z[corner];
        y[corner] = bitcast<vec4f>(tree[row + 2u * ray.axes.y]) - ray.origin.y - ray.shear.y * z[corner];
    }
    let u = x[2] * y[1] - x[1] * y[2];
    let v = x[0] * y[2] - x[2] * y[0];
    let w = x[1] * y[0] - x[0] * y[1];
    let sum = u + v + w;
    let t = (u * z[0] + v * z[1] + w * z[2]) * ray.shear.z / sum;
    let least = min(min(u, v), w);
    let most = max(max(u, v), w);
    let inside = (least >= vec4f(0.0)) | (most <= vec4f(0.0));
    let ahead = (t >= vec4f(ray.t_min)) & (t <= vec4f(t_max)) & (sum != vec4f(0.0));
    // Places that hold no triangle.
    let there = tree[leaf + 18u + half] != vec4u(NOTHING);
    return Met(select(vec4f(ENDLESS), t, inside & ahead & there), v, w, sum);
}

// One of eight numbers.
fn picked(first: vec4f, second: vec4f, lane: u32) -> f32 {
    let four = select(first, second, lane >= 4u);
    let two = select(four.xy, four.zw, (lane & 2u) != 0u);
    return select(two.x, two.y, (lane & 1u) != 0u);
}

fn picked_word(first: vec4u, second: vec4u, lane: u32) -> u32 {
    let four = select(first, second, lane >= 4u);
    let two = select(four.xy, four.zw, (lane & 2u) != 0u);
    return select(two.x, two.y, (lane & 1u) != 0u);
}

// A bit for each of eight numbers that is below a limit.
fn below(first: vec4f, second: vec4f, limit: f32) -> u32 {
    let bits = select(vec4u(0u), vec4u(1u, 2u, 4u, 8u), first < vec4f(limit))
        + select(vec4u(0u), vec4u(16u, 32u, 64u, 128u), second < vec4f(limit));
    return bits.x + bits.y + bits.z + bits.w;
}

// The nearest hit from either side, and of equally near ones that of the lowest triangle.
fn closest(ray: Ray, which: u32) -> Hit {
    var best = Hit(ray.t_max, NOTHING, 0.0, 0.0);
    let nodes = params.tree_nodes[which];
    let leaves = params.tree_leaves[which];
    if nodes == NOTHING {
        return best;
    }
    let prepared = prepared_for(ray, which);
    var sum = 1.0;
    var waiting: array<u32, STACK>;
    var waiting_at: array<f32, STACK>;
    var count = 0u;
    var child = 0u;
    while child != NOTHING {
        var next = NOTHING;
        if (child & LEAF) != 0u {
            let leaf = leaves + (child & ~LEAF) * LEAF_WORDS;
            let first = met_in_leaf(leaf, 0u, prepared, best.t);
            var second = Met(vec4f(ENDLESS), vec4f(0.0), vec4f(0.0), vec4f(1.0));
            if tree[leaf + 19u].x != NOTHING {
                second = met_in_leaf(leaf, 1u, prepared, best.t);
            }
            var met = below(first.t, second.t, ENDLESS);
            while met != 0u {
                let lane = firstTrailingBit(met);
                met &= met - 1u;
                let t = picked(first.t, second.t, lane);
                let triangle = picked_word(tree[leaf + 18u], tree[leaf + 19u], lane);
                if t < best.t || (t == best.t && triangle < best.triangle) {
                    let v = picked(first.v, second.v, lane);
                    best = Hit(t, triangle, v, picked(first.w, second.w, lane));
                    sum = picked(first.sum, second.sum, lane);
                }
            }
        } else {
            let node = nodes + child * NODE_WORDS;
            let first = entered(node, 0u, prepared, best.t);
            // Few children leave the second four without any.
            var second = vec4f(ENDLESS);
            if tree[node + 13u].x != LEAF {
                second = entered(node, 1u, prepared, best.t);
            }
            var met = below(first, second, ENDLESS);
            var next_at = ENDLESS;
            while met != 0u {
                let lane = firstTrailingBit(met);
                met &= met - 1u;
                let at = picked(first, second, lane);
                let other = picked_word(tree[node + 12u], tree[node + 13u], lane);
                // The nearer of the two goes on, the other one waits.
                let is_nearer = at < next_at;
                let put_aside = select(other, next, is_nearer);
                let put_aside_at = select(at, next_at, is_nearer);
                next = select(next, other, is_nearer);
                next_at = select(next_at, at, is_nearer);
                if put_aside != NOTHING {
                    waiting[count] = put_aside;
                    waiting_at[count] = put_aside_at;
                    count++;
                }
            }
        }
        while next == NOTHING && count > 0u {
            count--;
            if waiting_at[count] <= best.t {
                next = waiting[count];
            }
        }
        child = next;
    }
    best.u /= sum;
    best.v /= sum;
    return best;
}

// Whether `closest` would find anything.
fn occluded(ray: Ray, which: u32) -> bool {
    let nodes = params.tree_nodes[which];
    let leaves = params.tree_leaves[which];
    if nodes == NOTHING {
        return false;
    }
    let prepared = prepared_for(ray, which);
    var waiting: array<u32, STACK>;
    var count = 1u;
    waiting[0] = 0u;
    var is_blocked = false;
    while count > 0u && !is_blocked {
        count--;
        let child = waiting[count];
        if (child & LEAF) != 0u {
            let leaf = leaves + (child & ~LEAF) * LEAF_WORDS;
            is_blocked = any(met_in_leaf(leaf, 0u, prepared, ray.t_max).t < vec4f(ray.t_max));
            if !is_blocked && tree[leaf + 19u].x != NOTHING {
                is_blocked = any(met_in_leaf(leaf, 1u, prepared, ray.t_max).t < vec4f(ray.t_max));
            }
        } else {
            let node = nodes + child * NODE_WORDS;
            let first = entered(node, 0u, prepared, ray.t_max);
            var second = vec4f(ENDLESS);
            if tree[node + 13u].x != LEAF {
                second = entered(node, 1u, prepared, ray.t_max);
            }
            var met = below(first, second, ENDLESS);
            // The builder sorts leaves to the front: they are looked at first.
            while met != 0u {
                let lane = firstLeadingBit(met);
                met ^= 1u << lane;
                waiting[count] = picked_word(tree[node + 12u], tree[node + 13u], lane);
                count++;
            }
        }
    }
    return is_blocked;
}
