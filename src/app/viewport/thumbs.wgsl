// The photographs in the frusta of their cameras, framed.

@group(1) @binding(1) var photographs: texture_2d_array<f32>;
@group(1) @binding(2) var smooth_sampler: sampler;

struct Corner {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
    @location(1) @interpolate(flat) layer: i32,
    @location(2) @interpolate(flat) frame: vec4<f32>,
    // In pixels.
    @location(3) @interpolate(flat) width: f32,
}

@vertex
fn corner(
    @builtin(vertex_index) vertex: u32,
    @location(0) start: vec3<f32>,
    @location(1) layer: u32,
    @location(2) right: vec3<f32>,
    @location(3) down: vec3<f32>,
    @location(4) frame: vec4<f32>,
    @location(5) width: f32,
) -> Corner {
    // Two triangles of four corners: 0 1 2 and 2 1 3.
    let index = select(vertex, select(select(2u, 1u, vertex == 4u), 3u, vertex == 5u), vertex > 2u);
    let uv = vec2<f32>(f32(index & 1u), f32(index >> 1u));
    let place = globals.clip_from_world * vec4<f32>(start + uv.x * right + uv.y * down, 1.0);
    return Corner(place, uv, i32(layer), frame, width * globals.up.w);
}

@fragment
fn fill(in: Corner) -> @location(0) vec4<f32> {
    let across = dpdx(in.uv);
    let along = dpdy(in.uv);
    let pixel = max(abs(across) + abs(along), vec2<f32>(1e-6));
    // A picture far smaller than its texture is a mean over what a pixel covers.
    var sum = vec3<f32>(0.0);
    var seen = 0.0;
    var valid = true;
    for (var k = 0; k < 16; k++) {
        let part = (vec2<f32>(f32(k % 4), f32(k / 4)) - 1.5) * 0.25;
        let uv = in.uv + part.x * across + part.y * along;
        let texel = textureSampleLevel(photographs, smooth_sampler, uv, in.layer, 0.0);
        if texel.a > 0.25 {
            sum += texel.rgb;
            seen += 1.0;
            valid = valid && texel.a > 0.75;
        }
    }
    var color = vec3<f32>(0.2);
    if seen > 0.0 {
        color = display(sum / seen * globals.screen.w);
        if !valid && globals.choice.y == FALSE_COLOR {
            color = INVALID;
        }
    }
    let edge = min(in.uv, 1.0 - in.uv) / pixel;
    let cover = 1.0 - smoothstep(in.width - 0.5, in.width + 0.5, min(edge.x, edge.y));
    return vec4<f32>(mix(color, in.frame.rgb, cover), 1.0);
}
