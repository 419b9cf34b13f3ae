//! Pictures of known outlines, for what is found in photographs. Shares no code with the program.

use glam::DVec2;

/// A picture of flat convex polygons with their greys, the first before the others, on a ground of
/// grey, in codes of sRGB. Each pixel is the mean radiance of 16 × 16 places in it, with Gaussian noise
/// of its code.
pub fn painted(
    (width, height): (usize, usize),
    polygons: &[(Vec<DVec2>, f64)],
    ground: f64,
    noise: f64,
) -> Vec<[u8; 3]> {
    const FINE: usize = 16;
    // How far a place is from the line through each side; of one sign inside.
    let sides = |corners: &[DVec2], place: DVec2| -> Vec<f64> {
        let next = corners.iter().cycle().skip(1);
        let pairs = corners.iter().zip(next);
        pairs.map(|(a, b)| (*b - *a).normalize().perp_dot(place - *a)).collect()
    };
    let grey = |place: DVec2| {
        let own = polygons.iter().find(|(corners, _)| {
            let sides = sides(corners, place);
            sides.iter().all(|side| *side >= 0.0) || sides.iter().all(|side| *side <= 0.0)
        });
        own.map_or(ground, |(_, grey)| *grey)
    };
    let mut state = 1_u64;
    let mut random = move || {
        // Marsaglia's xorshift.
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let pixel = |index: usize| {
        let first = DVec2::new((index % width) as f64, (index / width) as f64);
        let part = |k: usize| (k as f64 + 0.5) / FINE as f64;
        // Where no outline is near, one place tells the whole pixel.
        let is_even = !polygons.iter().any(|(corners, _)| {
            let ends = corners.iter().zip(corners.iter().cycle().skip(1));
            ends.into_iter().any(|(a, b)| from_segment(first + 0.5, [*a, *b]) < 1.0)
        });
        let mean = match is_even {
            true => grey(first + 0.5),
            false => {
                let places = (0..FINE * FINE).map(|k| DVec2::new(part(k % FINE), part(k / FINE)));
                let radiance = places.map(|place| radiance(grey(first + place))).sum::<f64>();
                code(radiance / (FINE * FINE) as f64)
            }
        };
        // The sum of four uniform numbers is near to Gaussian.
        let off = noise * ((0..4).map(|_| random()).sum::<f64>() - 2.0) * 3.0_f64.sqrt();
        [(mean + off).round().clamp(0.0, 255.0) as u8; 3]
    };
    (0..width * height).map(pixel).collect()
}

/// IEC 61966-2-1, with white as 255 and as 1.
fn radiance(code: f64) -> f64 {
    let code = code / 255.0;
    if code <= 0.04045 { code / 12.92 } else { ((code + 0.055) / 1.055).powf(2.4) }
}

fn code(radiance: f64) -> f64 {
    let code = match radiance {
        ..=0.003_130_8 => 12.92 * radiance,
        _ => 1.055 * radiance.powf(1.0 / 2.4) - 0.055,
    };
    255.0 * code
}

fn from_segment(place: DVec2, [a, b]: [DVec2; 2]) -> f64 {
    let part = ((place - a).dot(b - a) / a.distance_squared(b)).clamp(0.0, 1.0);
    a.lerp(b, part).distance(place)
}
