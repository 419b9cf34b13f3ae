// What every shader shares: the view, and the way from radiance to a colour on screen.

struct Candidate {
    clip_from_world: mat4x4<f32>,
    // xyz: where the photograph was taken; w: its layer.
    eye: vec4<f32>,
    // x, y: near and far of its depth map; z: 1 once that is drawn; w: pixel size at 1 m.
    range: vec4<f32>,
}

struct Globals {
    clip_from_world: mat4x4<f32>,
    // xyz: the eye; w: 1 if orthographic.
    eye: vec4<f32>,
    // xyz: right; w: radius of the scene.
    right: vec4<f32>,
    // xyz: up; w: pixels of the screen per point.
    up: vec4<f32>,
    // xyz: forward; w: opacity of the photograph.
    forward: vec4<f32>,
    accent: vec4<f32>,
    wire: vec4<f32>,
    // The photograph's left, top, right and bottom in clip coordinates.
    picture: vec4<f32>,
    // x, y: size in pixels; z: exposure; w: radiance of 1 in the photographs' textures.
    screen: vec4<f32>,
    // Shading, tone mapping, number of candidates, picked sample.
    choice: vec4<u32>,
    // Picked light, 1 to draw the wireframe, 1 to shade lobes by their light, unused.
    more: vec4<u32>,
    candidates: array<Candidate, 32>,
}

@group(0) @binding(0) var<uniform> globals: Globals;

const NOWHERE = vec4<f32>(2.0, 2.0, 2.0, 1.0);
const INVALID = vec3<f32>(0.84, 0.235, 0.784);

fn magnitude(t: f32) -> vec3<f32> {
    let place = clamp(t, 0.0, 1.0) * f32(MAGNITUDES - 1u);
    let low = min(u32(place), MAGNITUDES - 2u);
    var table = MAGNITUDE;
    return mix(table[low], table[low + 1u], place - f32(low));
}

// The sRGB curve.
fn encode(linear: vec3<f32>) -> vec3<f32> {
    let v = clamp(linear, vec3<f32>(0.0), vec3<f32>(1.0));
    let high = 1.055 * pow(v, vec3<f32>(1.0 / 2.4)) - 0.055;
    return select(high, 12.92 * v, v <= vec3<f32>(0.0031308));
}

fn luminance(v: vec3<f32>) -> f32 {
    return dot(v, vec3<f32>(0.2126, 0.7152, 0.0722));
}

// A colour on screen for a radiance.
fn display(radiance: vec3<f32>) -> vec3<f32> {
    let v = max(radiance * globals.screen.z, vec3<f32>(0.0));
    if globals.choice.y == 1u {
        // A shoulder that reaches white at 8 and leaves the dark alone.
        return encode(v * (1.0 + v / 64.0) / (1.0 + v));
    }
    if globals.choice.y == 2u {
        return magnitude((log2(max(luminance(v), 1e-12)) + 8.0) / 10.0);
    }
    return encode(v);
}

fn towards_eye(world: vec3<f32>) -> vec3<f32> {
    if globals.eye.w > 0.5 {
        return -globals.forward.xyz;
    }
    return normalize(globals.eye.xyz - world);
}

// A point drawn a little nearer, by a part of its distance, so that it lies on top of the surface
// that carries it.
fn lifted(world: vec3<f32>, part: f32) -> vec3<f32> {
    if globals.eye.w > 0.5 {
        return world - globals.forward.xyz * globals.right.w * part;
    }
    return mix(world, globals.eye.xyz, part);
}
