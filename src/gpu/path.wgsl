// Paths from the camera into the scene: src/render/path.rs, which says what is estimated and how.
// Every thread traces the paths of one pixel.

struct Params {
    // Columns of the camera's rotation; its position.
    axis_x: vec3f,
    width: u32,
    axis_y: vec3f,
    height: u32,
    axis_z: vec3f,
    has_distortion: u32,
    eye: vec3f,
    reach: f32,
    focal: vec2f,
    principal: vec2f,
    radial: vec4f,
    bend: vec2f,
    // The first pixel of the dispatch, and their number.
    first_pixel: u32,
    pixels: u32,
    below: vec3f,
    // Paths [from, to) of every pixel; the surfaces of those from `surfaces_from` on count.
    from_path: u32,
    to_path: u32,
    surfaces_from: u32,
    seed: u32,
    reflections: u32,
    shell_low: vec3f,
    has_shell: u32,
    shell_high: vec3f,
    shell_albedo: f32,
    grid_low: vec3f,
    grid_side: u32,
    grid_cell: vec3f,
    offset_m: f32,
    // Of the geometry that light meets, of that which cameras see, and of the capture alone.
    tree_low: array<vec4f, 3>,
    tree_high: array<vec4f, 3>,
    tree_nodes: vec3u,
    photographed_tree: u32,
    tree_leaves: vec3u,
    layers: u32,
    original_light: f32,
    unseen_shines: u32,
    // Triangles of the capture; those of objects follow.
    known: u32,
    // Where parts of `small`, `large` and `choices` begin.
    look_of: u32,
    light_count: u32,
    choice_starts: u32,
    sky_cells: u32,
    sky_first: u32,
    sky_members: u32,
    lights: u32,
    added: u32,
    added_count: u32,
    photographs: u32,
    photograph_count: u32,
}

// What occurs in a scene (`Occurring` in src/render/packed): a recovered sky, surfaces whose light
// photographs tell, specular surfaces, glass, added lights that are sampled, recovered ones.
override HAS_SKY: bool = true;
override HAS_PHOTOGRAPHS: bool = true;
override IS_GLOSSY: bool = true;
override HAS_GLASS: bool = true;
override HAS_ADDED: bool = true;
override HAS_RECOVERED: bool = true;

@group(0) @binding(0) var<uniform> params: Params;
// Words of the trees.
@group(0) @binding(1) var<storage, read> tree: array<vec4u>;
// Unit normal of each triangle, and its product with a corner.
@group(0) @binding(2) var<storage, read> triangles: array<vec4f>;
// Tables that change with every edit.
@group(0) @binding(3) var<storage, read> small: array<u32>;
// Textures and environment maps.
@group(0) @binding(4) var<storage, read> large: array<u32>;
// Per bin of the grid the lights' cumulated probabilities, then where a search begins.
@group(0) @binding(5) var<storage, read> choices: array<u32>;
// Per pixel of every photograph its triangle and its radiance.
@group(0) @binding(6) var<storage, read> photographs: array<vec4u>;
// Parts of Sobol's points, see `sobol` in src/render/packed.
@group(0) @binding(7) var<storage, read> points: array<vec4u>;
// Per layer, then direct light, per pixel the sums of light and of the brightness of odd paths;
// then albedo and distance, normal and known, object.
@group(0) @binding(8) var<storage, read_write> film: array<vec4f>;

var<private> own_pixel: u32;
var<private> is_odd: f32;

// Sums in registers instead made an H100 slower by an eighth.
fn gather(layer: u32, depth: u32, light: vec3f) {
    let sums = vec4f(light, is_odd * (light.x + light.y + light.z) / 3.0);
    film[layer * params.pixels + own_pixel] += sums;
    if depth == 0u {
        film[params.layers * params.pixels + own_pixel] += sums;
    }
}

// The undistorted point whose distorted position is `p`, by Newton's method; z is 0 where none is
// found.
fn undistorted(p: vec2f) -> vec3f {
    if params.has_distortion == 0u {
        return vec3f(p, 1.0);
    }
    var q = p;
    for (var step = 0; step < 20; step++) {
        let error = distorted(q, params.radial, params.bend, params.below) - p;
        if length(error) < 1e-6 {
            break;
        }
        let h = 1e-3;
        let x = vec2f(h, 0.0);
        let y = vec2f(0.0, h);
        let dx = (distorted(q + x, params.radial, params.bend, params.below)
            - distorted(q - x, params.radial, params.bend, params.below)) / (2.0 * h);
        let dy = (distorted(q + y, params.radial, params.bend, params.below)
            - distorted(q - y, params.radial, params.bend, params.below)) / (2.0 * h);
        let determinant = dx.x * dy.y - dy.x * dx.y;
        if abs(determinant) < 1e-9 {
            return vec3f(0.0);
        }
        q -= vec2f(dy.y * error.x - dy.x * error.y, dx.x * error.y - dx.y * error.x) / determinant;
    }
    let left = length(distorted(q, params.radial, params.bend, params.below) - p);
    return select(vec3f(0.0), vec3f(q, 1.0), left < 1e-4 && length(q) <= params.reach);
}

// What a ray meets; `from_camera`, directly or by way of mirrors, glass reflects a part of it.
fn met_by(start: Ray, from_camera: bool) -> Hit {
    let which = select(0u, 1u, HAS_GLASS && from_camera);
    var ray = start;
    var hit: Hit;
    loop {
        hit = closest(ray, which);
        if which == 0u || hit.triangle == NOTHING || small[look_at(hit.triangle)] != GLASS {
            break;
        }
        let cosine = abs(dot(ray.direction, triangles[hit.triangle].xyz));
        if uniform_number() < fresnel(cosine) {
            break;
        }
        ray.t_min = hit.t + params.offset_m;
    }
    return hit;
}

fn look_at(triangle: u32) -> u32 {
    return small[params.look_of + triangle];
}

// Where a ray from within leaves the box of the surroundings, on the inner side.
fn shell_exit(origin: vec3f, direction: vec3f) -> Point {
    let far = select(params.shell_low, params.shell_high, direction > vec3f(0.0));
    let moves = abs(direction) > vec3f(1e-20);
    let along = select(vec3f(ENDLESS), max((far - origin) / direction, vec3f(0.0)), moves);
    var axis = 0u;
    if along.y < along.x {
        axis = 1u;
    }
    if along.z < min(along.x, along.y) {
        axis = 2u;
    }
    let unit = vec3f(vec3u(axis) == vec3u(0u, 1u, 2u));
    let normal = -unit * sign(direction);
    return Point(origin + direction * along[axis], normal);
}

// Light of a recovered light that a place reflects, divided by `over`.
fn reflected_light(
    point: Point, mirror: vec3f, brdf: Brdf, irradiance: vec3f, light: u32, over: f32,
) -> vec3f {
    var value = brdf.diffuse;
    if is_specular(brdf) {
        value += strength(brdf) * lobe_of_light(light, point, mirror, brdf);
    }
    return params.original_light / (PI * over) * value * irradiance;
}

fn samples_at(depth: u32) -> u32 {
    return select(select(1u, 2u, depth == 1u), 4u, depth == 0u);
}

// A sample of the recovered light at a place.
fn recovered_sample(
    point: Point, mirror: vec3f, brdf: Brdf, throughput: vec3f, depth: u32, sample: u32, bin: u32,
) -> Pending {
    let samples = samples_at(depth);
    let numbers = numbers_of_light(depth, sample);
    let found = chosen(bin, numbers.x);
    let light = params.lights + found.light * LIGHT_WORDS;
    let arriving = arriving_from(light, point, numbers.yz);
    if arriving.way.cosine <= 0.0 {
        return no_light();
    }
    let ray = way_to_light(light, point, arriving.way, numbers.yz);
    if ray.t_max < 0.0 {
        return no_light();
    }
    var over = f32(samples) * found.probability;
    if HAS_SKY && small[light] == SKY {
        let cosine = dot(ray.direction, point.normal);
        over += density_of(brdf, point.normal, mirror, ray.direction, cosine) * number(light + 12u);
    }
    let here = reflected_light(point, mirror, brdf, arriving.irradiance, light, over);
    return Pending(ray, throughput * here, small[light + 1u]);
}

// Light of the sky from a direction that a surface chose, which sampling the sky might have found
// as well.
fn sky_met(
    point: Point, mirror: vec3f, brdf: Brdf, throughput: vec3f, depth: u32, direction: vec3f,
    density: f32, survives: f32,
) {
    let samples = f32(samples_at(depth));
    let first = bin_of(point) * params.light_count;
    let range = sky_bucket(direction);
    for (var member = range.x; member < range.y; member++) {
        let cell = sky_cell(member);
        if off_cell(cell, direction) > 1.0 {
            continue;
        }
        let index = small[cell + 4u];
        let light = params.lights + index * LIGHT_WORDS;
        let axis = triple(light + 8u);
        let factor = max(-dot(axis, point.normal), 0.0) * number(light + 12u);
        if factor <= 0.0 {
            continue;
        }
        let irradiance = factor * lobes_of(light, axis);
        let over = samples * probability_of(first, index) + density * number(light + 12u);
        let light_here =
            reflected_light(point, mirror, brdf, irradiance, light, over * survives);
        gather(small[light + 1u], depth, throughput * light_here);
    }
}

// A sample of an added light at a place.
fn added_at(
    added: u32, point: Point, mirror: vec3f, brdf: Brdf, throughput: vec3f, square: vec2f,
) -> Pending {
    let direct = added_sample(added, point, square);
    if all(direct.light == vec3f(0.0)) {
        return no_light();
    }
    var share = 1.0;
    if direct.density > 0.0 {
        let by_surface = density_of(brdf, point.normal, mirror, direct.direction, direct.cosine);
        share = direct.density / (direct.density + by_surface);
    }
    let value = brdf_value(brdf, point.normal, mirror, direct.direction);
    let light = throughput * value * direct.light * (direct.cosine * share);
    return Pending(direct.ray, light, small[added + 1u]);
}

fn largest(value: vec3f) -> f32 {
    return max(max(value.x, value.y), value.z);
}

struct First {
    albedo: vec3f,
    distance_m: f32,
    normal: vec3f,
    known: f32,
    object: f32,
}

fn trace(start: Ray) -> First {
    var first = First(vec3f(0.0), 0.0, vec3f(0.0), 0.0, 0.0);
    var ray = start;
    var throughput = vec3f(1.0);
    // Whether the ray comes from a camera or a mirror, where nothing was gathered.
    var from_camera = true;
    var from_point = Point(ray.origin, ray.direction);
    var from_density = 0.0;
    // From here on the recovered light is counted already, or not looked for.
    var is_counted = !HAS_RECOVERED;
    // Where recovered light was gathered before the ray, for the sky.
    var gathered_before = false;
    var last_mirror = vec3f(0.0);
    var last_brdf: Brdf;
    var last_throughput = vec3f(0.0);
    var last_survives = 1.0;
    for (var depth = 0u; depth <= params.reflections; depth++) {
        let hit = met_by(ray, from_camera);
        let before = depth - min(depth, 1u);
        var point: Point;
        var brdf: Brdf;
        // Whether the path ends here, and whether this is a mirror, which reflects alone.
        var is_end = false;
        var is_mirror = false;
        if hit.triangle != NOTHING {
            let normal = triangles[hit.triangle].xyz;
            point = Point(
                ray.origin + ray.direction * hit.t,
                select(normal, -normal, dot(normal, ray.direction) > 0.0));
            let look = look_at(hit.triangle);
            let kind = small[look];
            brdf = brdf_of(look);
            if kind == TEXTURED {
                brdf.diffuse = textured(look + 9u, hit.triangle, hit.u, hit.v);
            }
            let is_object = hit.triangle >= params.known;
            if depth == 0u {
                first = First(brdf.diffuse + brdf.specular, hit.t, point.normal, 1.0, f32(is_object));
            }
            is_mirror = kind == MIRROR || kind == GLASS;
            if HAS_PHOTOGRAPHS {
                let shines = kind == PHOTOGRAPHED;
                // What a camera sees there has to be guessed: what it would reflect.
                let is_asked = params.unseen_shines != 0u && depth > 0u && !is_object && !is_mirror;
                if !is_counted && (shines || is_asked) {
                    let shown = photographed(point, select(1u, MOST_VIEWS, shines));
                    is_counted = is_asked && shown.w == 0.0;
                    if shines && !is_counted {
                        gather(0u, before, throughput * shown.xyz * params.original_light);
                    }
                }
            }
            is_end = kind == PHOTOGRAPHED;
        } else {
            if HAS_SKY {
                if from_camera && !is_counted {
                    let sky = sky_seen(ray.direction);
                    if sky.layer != NOTHING {
                        gather(sky.layer, before, throughput * sky.radiance * params.original_light);
                    }
                }
                if gathered_before {
                    sky_met(from_point, last_mirror, last_brdf, last_throughput, before, ray.direction,
                        from_density, last_survives);
                }
            }
            is_end = depth == 0u || params.has_shell == 0u;
            is_counted = true;
            brdf = Brdf(vec3f(params.shell_albedo), 0.0, vec3f(0.0), -1.0);
            point = shell_exit(ray.origin, ray.direction);
        }
        is_end = is_end || depth == params.reflections && !is_mirror
            || is_counted && (!HAS_ADDED || params.added_count == 0u) && !is_mirror;

        // Light that the ray meets, then samples of the light here: what has to be free is looked at
        // in one place, or the shader would hold its code many times.
        let mirror = mirrored(-ray.direction, point.normal);
        let stays = !is_end && !is_mirror;
        var of_added = 0u;
        if HAS_ADDED {
            of_added = params.added_count;
        }
        var of_recovered = 0u;
        var bin = 0u;
        if HAS_RECOVERED {
            if stays && !is_counted && params.light_count > 0u {
                of_recovered = samples_at(depth);
                bin = bin_of(point);
            }
        }
        var numbers = vec4f(0.0);
        if stays {
            numbers = numbers_of_place(depth);
        }
        let count = of_added + of_recovered + select(0u, of_added, stays);
        for (var k = 0u; k < count; k++) {
            var pending: Pending;
            var of_depth = depth;
            if HAS_ADDED && k < of_added {
                let added = params.added + k * ADDED_WORDS;
                let met = added_met(added, from_point, ray.direction, hit.t);
                let share = select(from_density / (from_density + met.density), 1.0, from_camera);
                let light = select(vec3f(0.0), throughput * met.radiance * share, met.density > 0.0);
                pending = Pending(met.ray, light, small[added + 1u]);
                of_depth = before;
            } else if HAS_RECOVERED && k < of_added + of_recovered {
                pending = recovered_sample(point, mirror, brdf, throughput, depth, k - of_added, bin);
            } else {
                let added = params.added + (k - of_added - of_recovered) * ADDED_WORDS;
                pending = added_at(added, point, mirror, brdf, throughput, numbers.zw);
            }
            if all(pending.light == vec3f(0.0)) {
                continue;
            }
            if pending.ray.t_max > 0.0 && occluded(pending.ray, 0u) {
                continue;
            }
            gather(pending.layer, of_depth, pending.light);
        }
        if is_end {
            break;
        }
        if is_mirror {
            throughput *= brdf.diffuse;
            ray = ray_from(point, mirror);
            from_camera = true;
            from_point = Point(ray.origin, ray.direction);
            gathered_before = false;
            continue;
        }
        let scattered = scatter(brdf, point.normal, mirror, numbers.xy);
        if scattered.density <= 0.0 {
            break;
        }
        let further = throughput * scattered.weight;
        var survives = 1.0;
        if depth >= 2u {
            survives = min(largest(further), 0.95);
            if uniform_number() >= survives {
                break;
            }
        }
        if largest(further) <= 0.0 {
            break;
        }
        last_mirror = mirror;
        last_brdf = brdf;
        last_throughput = throughput;
        last_survives = survives;
        gathered_before = !is_counted;
        throughput = further / survives;
        ray = ray_from(point, scattered.direction);
        from_camera = false;
        from_point = point;
        from_density = scattered.density;
    }
    return first;
}

@compute @workgroup_size(64)
fn paths(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= params.pixels {
        return;
    }
    own_pixel = id.x;
    let pixel = params.first_pixel + id.x;
    let corner = vec2f(f32(pixel % params.width), f32(pixel / params.width));
    var albedo = vec4f(0.0);
    var normal = vec4f(0.0);
    var object = 0.0;
    for (var index = params.from_path; index < params.to_path; index++) {
        begin_path(params.seed, pixel, index);
        is_odd = f32(index & 1u);
        let place = (corner + four(0u).xy - params.principal) / params.focal;
        let ideal = undistorted(place);
        if ideal.z == 0.0 {
            continue;
        }
        let direction = normalize(
            params.axis_x * ideal.x - params.axis_y * ideal.y - params.axis_z);
        let first = trace(Ray(params.eye, 0.0, direction, ENDLESS));
        if index >= params.surfaces_from {
            albedo += vec4f(first.albedo, first.distance_m);
            normal += vec4f(first.normal, first.known);
            object += first.object;
        }
    }
    let after = (params.layers + 1u) * params.pixels + own_pixel;
    film[after] += albedo;
    film[after + params.pixels] += normal;
    film[after + 2u * params.pixels] += vec4f(object, 0.0, 0.0, 0.0);
}
