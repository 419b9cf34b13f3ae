// The known geometry: flat triangles in the colour of their surface, and their edges.

@group(1) @binding(0) var surfaces: texture_2d<u32>;
@group(1) @binding(1) var photographs: texture_2d_array<f32>;
@group(1) @binding(2) var smooth_sampler: sampler;
@group(1) @binding(3) var depths: texture_2d_array<f32>;

struct Corner {
    @builtin(position) @invariant clip: vec4<f32>,
    @location(0) world: vec3<f32>,
    @location(1) heights: vec3<f32>,
    // The surface, and which edges are edges of polygons (bits 0 to 2) or creases (3 to 5).
    @location(2) @interpolate(flat) surface: u32,
    @location(3) @interpolate(flat) edges: u32,
}

fn known_of(surface: u32) -> vec4<u32> {
    return textureLoad(surfaces, vec2<u32>(surface % ROW, surface / ROW), 0);
}

@vertex
fn corner(
    @builtin(vertex_index) index: u32,
    @location(0) position: vec3<f32>,
    @location(1) tagged: u32,
) -> Corner {
    var out: Corner;
    out.world = position;
    out.surface = tagged & ((1u << SURFACE_BITS) - 1u);
    out.edges = tagged >> SURFACE_BITS;
    let which = index % 3u;
    out.heights = vec3<f32>(f32(which == 0u), f32(which == 1u), f32(which == 2u));
    out.clip = globals.clip_from_world * vec4<f32>(position, 1.0);
    if (known_of(out.surface).z & HIDDEN) != 0u {
        out.clip = NOWHERE;
    }
    return out;
}

// For a photograph's depth map; what is hidden on screen still hides things from the camera.
@vertex
fn bare(@location(0) position: vec3<f32>, @location(1) tagged: u32) -> @builtin(position) vec4<f32> {
    return globals.clip_from_world * vec4<f32>(position, 1.0);
}

// What the first photograph that sees a point shows there; w is 0 where none does, 0.5 where
// it is no measurement.
fn photographed(world: vec3<f32>, normal: vec3<f32>) -> vec4<f32> {
    let size = vec2<i32>(textureDimensions(depths));
    for (var i = 0u; i < globals.choice.z; i++) {
        let photograph = globals.candidates[i];
        let clip = photograph.clip_from_world * vec4<f32>(world, 1.0);
        if clip.w <= 0.0 || any(abs(clip.xy) >= vec2<f32>(clip.w)) {
            continue;
        }
        let towards = normalize(photograph.eye.xyz - world);
        let cosine = dot(normal, towards);
        if cosine <= 0.02 {
            continue;
        }
        let uv = clip.xy / clip.w * vec2<f32>(0.5, -0.5) + 0.5;
        let layer = i32(photograph.eye.w);
        let texel = min(vec2<i32>(uv * vec2<f32>(size)), size - 1);
        if photograph.range.z > 0.5 {
            // Pixels beside a silhouette mix what is before it with what is behind.
            var depth = 1.0;
            for (var k = 0; k < 9; k++) {
                let beside = clamp(texel + vec2<i32>(k % 3, k / 3) - 1, vec2<i32>(0), size - 1);
                depth = min(depth, textureLoad(depths, beside, layer, 0).x);
            }
            let near = photograph.range.x;
            let far = photograph.range.y;
            let nearest = near * far / (far - depth * (far - near));
            let slack = clip.w * (0.003 + photograph.range.w / cosine);
            if nearest + slack < clip.w {
                continue;
            }
        }
        let nearest = textureLoad(photographs, texel, layer, 0);
        if nearest.a < 0.25 {
            continue;
        }
        var seen = textureSampleLevel(photographs, smooth_sampler, uv, layer, 0.0);
        // A mean over pixels that are photographed and others that are not is neither.
        if abs(seen.a - nearest.a) > 0.01 {
            seen = nearest;
        }
        return vec4<f32>(seen.rgb * globals.screen.w, select(0.5, 1.0, seen.a > 0.75));
    }
    return vec4<f32>(0.0);
}

fn stripes(position: vec2<f32>, a: vec3<f32>, b: vec3<f32>) -> vec3<f32> {
    let phase = fract((position.x + position.y) / (16.0 * globals.up.w));
    return select(a, b, phase < 0.5);
}

@fragment
fn fill(in: Corner) -> @location(0) vec4<f32> {
    let known = known_of(in.surface);
    let eye = towards_eye(in.world);
    var normal = normalize(cross(dpdx(in.world), dpdy(in.world)));
    if dot(normal, eye) < 0.0 {
        normal = -normal;
    }
    // A lamp at the eye and light from above and from one side tell the faces of a box apart.
    let light = 0.62 + 0.2 * dot(normal, eye) + 0.14 * normal.z + 0.05 * (normal.x - normal.y);
    var color = vec3<f32>(0.72) * light;
    let shading = globals.choice.x;
    if shading == BY_PHOTOGRAPH {
        let seen = photographed(in.world, normal);
        if seen.w > 0.75 || (seen.w > 0.25 && globals.choice.y != FALSE_COLOR) {
            color = display(seen.rgb);
        } else if seen.w > 0.25 {
            color = INVALID;
        } else {
            color = vec3<f32>(0.4) * light;
        }
    } else if shading == BY_MATERIAL {
        color = unpack4x8unorm(known.x).rgb * light;
        if (known.z & UNASSIGNED) != 0u {
            color = stripes(in.clip.xy, vec3<f32>(0.58, 0.54, 0.58), vec3<f32>(0.74, 0.4, 0.68))
                * light;
        }
    } else if shading == BY_REFLECTANCE {
        color = unpack4x8unorm(known.y).rgb;
        if (known.z & UNKNOWN_REFLECTANCE) != 0u {
            color = stripes(in.clip.xy, vec3<f32>(0.42), vec3<f32>(0.5)) * light;
        }
    }
    if (known.z & SELECTED) != 0u {
        color = mix(color, globals.accent.rgb, 0.38);
    }
    return vec4<f32>(color, 1.0);
}

// How much of a line of a width in pixels covers a fragment, over the edges in a mask.
fn edge_cover(heights: vec3<f32>, slope: vec3<f32>, mask: u32, width: f32) -> f32 {
    let away = heights / max(slope, vec3<f32>(1e-12));
    var nearest = 1e6;
    // The edge opposite to a corner is where that corner's height vanishes.
    if (mask & 1u) != 0u { nearest = min(nearest, away.z); }
    if (mask & 2u) != 0u { nearest = min(nearest, away.x); }
    if (mask & 4u) != 0u { nearest = min(nearest, away.y); }
    return 1.0 - smoothstep(width - 0.5, width + 0.5, nearest);
}

@fragment
fn wire(in: Corner) -> @location(0) vec4<f32> {
    let slope = fwidth(in.heights);
    let scale = globals.up.w;
    var out = vec4<f32>(0.0);
    if globals.more.y == 1u {
        let cover = edge_cover(in.heights, slope, in.edges & 7u, 0.6 * scale);
        out = vec4<f32>(globals.wire.rgb, globals.wire.a * cover);
    }
    if (known_of(in.surface).z & SELECTED) != 0u {
        let cover = edge_cover(in.heights, slope, in.edges >> 3u, 1.6 * scale);
        out = mix(out, vec4<f32>(globals.accent.rgb, 1.0), cover);
    }
    if out.a < 0.02 {
        discard;
    }
    return out;
}
