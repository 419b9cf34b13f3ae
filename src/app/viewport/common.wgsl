// What every shader shares, after the constants and structures of gpu.rs: the way from radiance to a
// colour on screen.

@group(0) @binding(0) var<uniform> globals: Globals;

const NOWHERE = vec4<f32>(2.0, 2.0, 2.0, 1.0);

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

// Khronos PBR Neutral, as in neutral.rs.
fn pbr_neutral(exposed: vec3<f32>) -> vec3<f32> {
    let low = min(exposed.r, min(exposed.g, exposed.b));
    let shine = select(0.04, low - low * low / 0.16, low <= 0.08);
    let base = exposed - shine;
    let peak = max(base.r, max(base.g, base.b));
    if peak <= 0.76 {
        return base;
    }
    let compressed = 1.0 - 0.24 * 0.24 / (peak - 0.52);
    let kept = 1.0 / (0.15 * (peak - compressed) + 1.0);
    return mix(vec3<f32>(compressed), base * (compressed / peak), kept);
}

// A colour on screen for a radiance.
fn display(radiance: vec3<f32>) -> vec3<f32> {
    let v = max(radiance * globals.screen.z, vec3<f32>(0.0));
    if globals.choice.y == PBR_NEUTRAL {
        return encode(pbr_neutral(v));
    }
    if globals.choice.y == FALSE_COLOR {
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
