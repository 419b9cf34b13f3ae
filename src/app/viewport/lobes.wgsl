// Emission lobes: the surface of cosⁿ about an axis, as long as the emission is strong.

struct Corner {
    @builtin(position) clip: vec4<f32>,
    @location(0) world: vec3<f32>,
    @location(1) @interpolate(flat) color: vec3<f32>,
}

// A point of the lobe at a step along its meridian and about its axis.
fn point(ring: u32, segment: u32, exponent: f32) -> vec3<f32> {
    let t = f32(ring) / f32(RINGS);
    // Even steps in length put most points where a narrow lobe bends. A lobe that is alike in all
    // directions is half a ball.
    let radius = select(sin(0.5 * 3.14159265 * t), 1.0, exponent < 0.5);
    let cosine = select(pow(max(radius, 1e-4), 1.0 / max(exponent, 0.5)), t, exponent < 0.5);
    let sine = sqrt(max(1.0 - cosine * cosine, 0.0));
    let turn = 6.2831853 * f32(segment % SEGMENTS) / f32(SEGMENTS);
    return radius * vec3<f32>(sine * cos(turn), sine * sin(turn), cosine);
}

@vertex
fn corner(
    @builtin(vertex_index) vertex: u32,
    @location(0) origin: vec3<f32>,
    @location(1) length: f32,
    @location(2) axis: vec3<f32>,
    @location(3) exponent: f32,
    @location(4) color: vec3<f32>,
) -> Corner {
    let quad = vertex / 6u;
    var corners = array<vec2<u32>, 6>(
        vec2<u32>(0u, 0u), vec2<u32>(1u, 0u), vec2<u32>(1u, 1u),
        vec2<u32>(0u, 0u), vec2<u32>(1u, 1u), vec2<u32>(0u, 1u),
    );
    let step = corners[vertex % 6u];
    let local = point(quad / SEGMENTS + step.x, quad % SEGMENTS + step.y, exponent);
    let other = select(vec3<f32>(1.0, 0.0, 0.0), vec3<f32>(0.0, 0.0, 1.0), abs(axis.z) < 0.8);
    let right = normalize(cross(other, axis));
    let up = cross(axis, right);
    var out: Corner;
    out.world = origin + length * (right * local.x + up * local.y + axis * local.z);
    out.clip = globals.clip_from_world * vec4<f32>(out.world, 1.0);
    out.color = color;
    return out;
}

@fragment
fn fill(in: Corner) -> @location(0) vec4<f32> {
    let normal = normalize(cross(dpdx(in.world), dpdy(in.world)));
    let facing = abs(dot(normal, towards_eye(in.world)));
    return vec4<f32>(in.color * (0.45 + 0.55 * facing), 1.0);
}
