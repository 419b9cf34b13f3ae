// The photograph that is looked through, over the mesh.

@group(1) @binding(0) var photograph: texture_2d<f32>;
@group(1) @binding(1) var near_sampler: sampler;

struct Corner {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
}

@vertex
fn corner(@builtin(vertex_index) index: u32) -> Corner {
    let uv = vec2<f32>(f32(index & 1u), f32(index >> 1u));
    let place = mix(globals.picture.xy, globals.picture.zw, uv);
    return Corner(vec4<f32>(place, 0.0, 1.0), uv);
}

@fragment
fn fill(in: Corner) -> @location(0) vec4<f32> {
    let size = vec2<i32>(textureDimensions(photograph));
    let texel = clamp(vec2<i32>(in.uv * vec2<f32>(size)), vec2<i32>(0), size - 1);
    let nearest = textureLoad(photograph, texel, 0);
    if nearest.a < 0.25 {
        discard;
    }
    var seen = textureSampleLevel(photograph, near_sampler, in.uv, 0.0);
    // As in mesh.wgsl: no mean over what is photographed and what is not.
    if abs(seen.a - nearest.a) > 0.01 {
        seen = nearest;
    }
    var color = display(seen.rgb * globals.screen.w);
    if seen.a < 0.75 && globals.choice.y == FALSE_COLOR {
        color = INVALID;
    }
    // At the edge of a relit scene the background is seen through a part of the pixel.
    let part = select(1.0, nearest.a - 1.0, nearest.a > 1.0);
    return vec4<f32>(color, globals.forward.w * part);
}
