// Straight lines of constant width on screen.

struct Corner {
    @builtin(position) clip: vec4<f32>,
    @location(0) color: vec4<f32>,
    @location(1) @interpolate(linear) across: f32,
    @location(2) @interpolate(flat) half_width: f32,
}

@vertex
fn corner(
    @builtin(vertex_index) vertex: u32,
    @location(0) start: vec3<f32>,
    @location(1) stop: vec3<f32>,
    @location(2) color: vec4<f32>,
    // In points.
    @location(3) width: f32,
) -> Corner {
    var a = globals.clip_from_world * vec4<f32>(start, 1.0);
    var b = globals.clip_from_world * vec4<f32>(stop, 1.0);
    var out: Corner;
    // Ends before the near plane are moved onto it.
    if a.z < 0.0 && b.z < 0.0 {
        out.clip = NOWHERE;
        return out;
    }
    if a.z < 0.0 {
        a = mix(b, a, b.z / (b.z - a.z) * 0.9999);
    } else if b.z < 0.0 {
        b = mix(a, b, a.z / (a.z - b.z) * 0.9999);
    }
    let half_screen = 0.5 * globals.screen.xy;
    let along = (b.xy / b.w - a.xy / a.w) * half_screen;
    let direction = along / max(length(along), 1e-6);
    let normal = vec2<f32>(-direction.y, direction.x);
    let side = f32(vertex & 1u) * 2.0 - 1.0;
    let end = select(a, b, vertex >= 2u);
    out.half_width = max(0.5 * width * globals.up.w, 0.5);
    out.across = side * (out.half_width + 0.75);
    let offset = normal * out.across / half_screen;
    out.clip = vec4<f32>(end.xy + offset * end.w, end.zw);
    out.color = color;
    return out;
}

@fragment
fn fill(in: Corner) -> @location(0) vec4<f32> {
    let cover = clamp(in.half_width + 0.5 - abs(in.across), 0.0, 1.0);
    return vec4<f32>(in.color.rgb, in.color.a * cover);
}
