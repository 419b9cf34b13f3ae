// Copies the finished picture into the window.

@group(0) @binding(0) var picture: texture_2d<f32>;

struct Corner {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
}

@vertex
fn corner(@builtin(vertex_index) index: u32) -> Corner {
    let uv = vec2<f32>(f32((index << 1u) & 2u), f32(index & 2u));
    return Corner(vec4<f32>(uv.x * 2.0 - 1.0, 1.0 - 2.0 * uv.y, 0.0, 1.0), uv);
}

fn texel(uv: vec2<f32>) -> vec4<f32> {
    let size = vec2<i32>(textureDimensions(picture));
    return textureLoad(picture, clamp(vec2<i32>(uv * vec2<f32>(size)), vec2<i32>(0), size - 1), 0);
}

@fragment
fn plain(in: Corner) -> @location(0) vec4<f32> {
    return vec4<f32>(texel(in.uv).rgb, 1.0);
}

// For a window whose format encodes by itself.
@fragment
fn decoded(in: Corner) -> @location(0) vec4<f32> {
    let v = texel(in.uv).rgb;
    let high = pow((v + 0.055) / 1.055, vec3<f32>(2.4));
    return vec4<f32>(select(high, v / 12.92, v <= vec3<f32>(0.04045)), 1.0);
}
