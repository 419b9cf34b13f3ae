// Virtual lights: discs lying on the bounding sphere or a surface, and glowing balls.

struct Corner {
    @builtin(position) clip: vec4<f32>,
    @location(0) place: vec2<f32>,
    @location(1) @interpolate(flat) color: vec3<f32>,
    // x: 1 for a ball; y: 1 for the picked light; z: opacity of the inside.
    @location(2) @interpolate(flat) kind: vec3<f32>,
}

@vertex
fn corner(
    @builtin(vertex_index) vertex: u32,
    @builtin(instance_index) instance: u32,
    @location(0) center: vec3<f32>,
    @location(1) radius: f32,
    @location(2) normal: vec3<f32>,
    @location(3) is_ball: u32,
    @location(4) color: vec3<f32>,
) -> Corner {
    let place = (vec2<f32>(f32(vertex & 1u), f32(vertex >> 1u)) * 2.0 - 1.0) * 1.05;
    var right = globals.right.xyz;
    var up = globals.up.xyz;
    var opacity = 1.0;
    if is_ball == 0u {
        let other = select(vec3<f32>(1.0, 0.0, 0.0), vec3<f32>(0.0, 0.0, 1.0), abs(normal.z) < 0.8);
        right = normalize(cross(other, normal));
        up = cross(normal, right);
        // Seen from behind, lights between the eye and the scene must not hide it.
        opacity = select(0.06, 0.3, dot(normal, towards_eye(center)) > 0.0);
    }
    let world = center + (right * place.x + up * place.y) * radius;
    var out: Corner;
    out.clip = globals.clip_from_world * vec4<f32>(lifted(world, 0.004), 1.0);
    out.place = place;
    out.color = color;
    out.kind = vec3<f32>(f32(is_ball), f32(instance == globals.more.x), opacity);
    return out;
}

@fragment
fn fill(in: Corner) -> @location(0) vec4<f32> {
    let away = length(in.place);
    let soft = fwidth(away);
    let cover = 1.0 - smoothstep(1.0 - soft, 1.0, away);
    if in.kind.x > 0.5 {
        let glow = mix(in.color, vec3<f32>(1.0), 0.7 * (1.0 - away * away));
        let rim = smoothstep(1.0 - 3.0 * soft, 1.0 - 2.0 * soft, away);
        let tint = mix(glow, mix(in.color, globals.accent.rgb, in.kind.y), rim);
        // A core that is seen from afar in a halo as large as the ball, which hides nothing.
        let core = 1.0 - smoothstep(0.3, 0.45, away);
        return vec4<f32>(tint, max(max(core, 0.8 * rim), 0.28) * cover);
    }
    let width = select(1.2, 3.0, in.kind.y > 0.5) * globals.up.w * soft;
    let ring = smoothstep(1.0 - width - soft, 1.0 - width, away);
    let color = select(in.color, globals.accent.rgb, in.kind.y > 0.5);
    let alpha = mix(in.kind.z, max(0.75, in.kind.z), ring) * cover;
    if alpha < 0.02 {
        discard;
    }
    return vec4<f32>(color, alpha * select(0.55, 1.0, in.kind.z > 0.1 || in.kind.y > 0.5));
}
