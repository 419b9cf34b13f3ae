// Samples as discs of constant size on screen.

struct Corner {
    @builtin(position) clip: vec4<f32>,
    @location(0) place: vec2<f32>,
    @location(1) @interpolate(flat) color: vec3<f32>,
    // x: radius in pixels; y: 1 for the picked sample.
    @location(2) @interpolate(flat) size: vec2<f32>,
}

@vertex
fn corner(
    @builtin(vertex_index) vertex: u32,
    @builtin(instance_index) instance: u32,
    @location(0) position: vec3<f32>,
    @location(1) color: vec3<f32>,
    // 1 if the colour is a radiance.
    @location(2) is_radiance: u32,
) -> Corner {
    let picked = instance == globals.choice.w;
    let radius = select(2.75, 6.0, picked) * globals.up.w;
    let place = vec2<f32>(f32(vertex & 1u), f32(vertex >> 1u)) * 2.0 - 1.0;
    var out: Corner;
    // Far enough that a disc is not cut by a surface that it lies on aslant.
    let lift = 0.003 + 3.0 * radius / globals.screen.y;
    out.clip = globals.clip_from_world * vec4<f32>(lifted(position, min(lift, 0.05)), 1.0);
    let offset = place * (radius + 1.0) * 2.0 / globals.screen.xy * out.clip.w;
    out.clip = vec4<f32>(out.clip.xy + offset, out.clip.zw);
    out.place = place * (radius + 1.0);
    out.color = color;
    if is_radiance == 1u {
        out.color = display(color);
    }
    out.size = vec2<f32>(radius, f32(picked));
    return out;
}

@fragment
fn fill(in: Corner) -> @location(0) vec4<f32> {
    let away = length(in.place);
    let cover = clamp(in.size.x + 0.5 - away, 0.0, 1.0);
    if cover < 0.02 {
        discard;
    }
    // A dark rim keeps a disc visible on a surface of its own colour.
    let rim = select(1.0, 2.0, in.size.y > 0.5) * globals.up.w;
    let inside = clamp(in.size.x - rim + 0.5 - away, 0.0, 1.0);
    let edge = select(in.color * 0.35, globals.accent.rgb, in.size.y > 0.5);
    return vec4<f32>(mix(edge, in.color, inside), cover);
}
