//! Points, directions and reproducible random numbers.
//!
//! Every pattern is a pure function of a seed and an index, so that a ray is the same whichever
//! thread traces it.

use glam::{Vec2, Vec3};

/// A small counter-based generator (SplitMix64; Steele, Lea, Flood 2014). Its state is made
/// from a seed and up to two indices, so every sample, light or texel owns a stream.
#[derive(Clone, Debug)]
pub struct Random {
    state: u64,
}

impl Random {
    /// The stream `(stream, index)` of `seed`.
    pub fn new(seed: u64, stream: u64, index: u64) -> Self {
        let mut random = Self { state: seed ^ 0x9e37_79b9_7f4a_7c15 };
        random.state ^= random.next_u64().wrapping_add(stream.wrapping_mul(0xbf58_476d_1ce4_e5b9));
        random.state = random.next_u64() ^ index.wrapping_mul(0x94d0_49bb_1331_11eb);
        random
    }

    pub fn next_u64(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1).
    pub fn uniform(&mut self) -> f32 {
        (self.next_u64() >> 40) as f32 * (1.0 / (1u64 << 24) as f32)
    }

    /// Uniform in [0, 1)².
    pub fn point(&mut self) -> Vec2 {
        Vec2::new(self.uniform(), self.uniform())
    }

    /// Uniform among `0..count`; `count` must not be 0.
    pub fn below(&mut self, count: usize) -> usize {
        ((u128::from(self.next_u64()) * count as u128) >> 64) as usize
    }

    /// Puts `items` in a random order (Fisher–Yates).
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for i in (1..items.len()).rev() {
            items.swap(i, self.below(i + 1));
        }
    }
}

/// The side of the smallest square grid with at least `count` cells.
pub fn grid_side(count: usize) -> usize {
    (count as f64).sqrt().ceil() as usize
}

/// The step along rows and columns by which about `most` of `count` pixels are left, or all of fewer.
pub fn lattice_step(count: usize, most: usize) -> usize {
    grid_side(count.div_ceil(most.max(1))).max(1)
}

/// `side`² points, one jittered in each cell of a square grid over [0, 1)².
pub fn stratified(side: usize, random: &mut Random) -> impl Iterator<Item = Vec2> {
    (0..side * side).map(move |cell| {
        let corner = Vec2::new((cell % side) as f32, (cell / side) as f32);
        (corner + random.point()) / side as f32
    })
}

/// Maps [0, 1]² onto the unit disc, preserving area (Shirley and Chiu 1997, the concentric map).
pub fn square_to_disc(square: Vec2) -> Vec2 {
    use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};
    let p = 2.0 * square - Vec2::ONE;
    if p == Vec2::ZERO {
        return Vec2::ZERO;
    }
    let (radius, angle) = if p.x.abs() > p.y.abs() {
        (p.x, FRAC_PI_4 * (p.y / p.x))
    } else {
        (p.y, FRAC_PI_2 - FRAC_PI_4 * (p.x / p.y))
    };
    radius * Vec2::new(angle.cos(), angle.sin())
}

/// The inverse of [`square_to_disc`].
pub fn disc_to_square(disc: Vec2) -> Vec2 {
    use std::f32::consts::FRAC_PI_4;
    let radius = disc.length();
    if radius == 0.0 {
        return Vec2::splat(0.5);
    }
    let p = if disc.x.abs() > disc.y.abs() {
        let along = radius.copysign(disc.x);
        Vec2::new(along, along * (disc.y / disc.x).atan() / FRAC_PI_4)
    } else {
        let along = radius.copysign(disc.y);
        Vec2::new(along * (disc.x / disc.y).atan() / FRAC_PI_4, along)
    };
    0.5 * (p + Vec2::ONE)
}

/// Where [`square_to_uniform_hemisphere`] has a direction in the disc that its square goes to.
pub fn uniform_hemisphere_to_disc(direction: Vec3) -> Vec2 {
    direction.truncate() / (1.0 + direction.z.max(0.0)).sqrt()
}

/// Maps [0, 1]² onto directions about +z with density cos θ / π.
pub fn square_to_cosine_hemisphere(square: Vec2) -> Vec3 {
    let disc = square_to_disc(square);
    disc.extend((1.0 - disc.length_squared()).max(0.0).sqrt())
}

/// Maps [0, 1]² onto directions about +z with uniform density 1 / 2π.
pub fn square_to_uniform_hemisphere(square: Vec2) -> Vec3 {
    let disc = square_to_disc(square);
    let z = 1.0 - disc.length_squared();
    // A disc radius of r goes to height 1 − r², so equal areas go to equal solid angles.
    (disc * (2.0 - disc.length_squared()).max(0.0).sqrt()).extend(z)
}

/// Maps [0, 1]² onto directions about +z within a cone, with uniform density. `cap` is one minus
/// the cosine of the cone's half-angle, 0 to 2: its solid angle is 2π `cap`.
pub fn square_to_uniform_cone(square: Vec2, cap: f32) -> Vec3 {
    let disc = square_to_disc(square);
    // As for the hemisphere, whose cap is 1.
    let fall = cap * disc.length_squared();
    (disc * (cap * (2.0 - fall)).max(0.0).sqrt()).extend(1.0 - fall)
}

/// `count` unit vectors evenly spread over the sphere, turned about z.
pub fn fibonacci(count: usize, turn: f32) -> impl Iterator<Item = Vec3> {
    let golden = std::f32::consts::PI * (3.0 - 5.0f32.sqrt());
    (0..count).map(move |k| {
        let z = 1.0 - (2 * k + 1) as f32 / count as f32;
        let radius = (1.0 - z * z).max(0.0).sqrt();
        let angle = golden * k as f32 + turn;
        Vec3::new(radius * angle.cos(), radius * angle.sin(), z)
    })
}

/// The ideal specular direction of a unit direction away from a surface.
pub fn mirrored(direction: Vec3, normal: Vec3) -> Vec3 {
    2.0 * normal.dot(direction) * normal - direction
}

/// A right-handed orthonormal frame about a unit normal.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    pub tangent: Vec3,
    pub bitangent: Vec3,
    pub normal: Vec3,
}

impl Frame {
    pub fn about(normal: Vec3) -> Self {
        let (tangent, bitangent) = normal.any_orthonormal_pair();
        Self { tangent, bitangent, normal }
    }

    /// World direction of a direction given in the frame.
    pub fn to_world(&self, local: Vec3) -> Vec3 {
        self.tangent * local.x + self.bitangent * local.y + self.normal * local.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lattice_leaves_about_as_many_pixels_as_are_wanted() {
        // The root of count/most, rounded up; every pixel where they are few.
        for (count, most, step) in
            [(0, 10, 1), (100, 100, 1), (101, 100, 2), (400, 100, 2), (401, 100, 3)]
        {
            assert_eq!(lattice_step(count, most), step, "{count} of {most}");
        }
    }

    #[test]
    fn hemisphere_maps_have_the_mean_cosine_of_their_density() {
        // E[cos θ] is 1/2 for the uniform hemisphere and 2/3 for the cosine-weighted one.
        let side = 400;
        let mean = |map: fn(Vec2) -> Vec3| {
            let mut random = Random::new(1, 2, 3);
            let sum: f64 =
                stratified(side, &mut random).map(|square| f64::from(map(square).z)).sum();
            sum / (side * side) as f64
        };
        assert!((mean(square_to_uniform_hemisphere) - 0.5).abs() < 1e-4);
        assert!((mean(square_to_cosine_hemisphere) - 2.0 / 3.0).abs() < 1e-4);
    }

    #[test]
    fn hemisphere_maps_give_unit_vectors() {
        let mut random = Random::new(7, 0, 0);
        for _ in 0..1000 {
            let square = random.point();
            assert!((square_to_uniform_hemisphere(square).length() - 1.0).abs() < 1e-6);
            assert!((square_to_cosine_hemisphere(square).length() - 1.0).abs() < 1e-6);
            for cap in [0.0, 1e-6, 0.3, 1.0, 2.0] {
                let direction = square_to_uniform_cone(square, cap);
                assert!((direction.length() - 1.0).abs() < 1e-6);
                assert!(1.0 - direction.z <= cap + 1e-6);
            }
        }
    }

    #[test]
    fn maps_have_inverses() {
        let mut random = Random::new(8, 0, 0);
        for _ in 0..1000 {
            let square = random.point();
            let disc = square_to_disc(square);
            assert!((disc_to_square(disc) - square).length() < 1e-5, "{square}");
            let direction = square_to_uniform_hemisphere(square);
            assert!((uniform_hemisphere_to_disc(direction) - disc).length() < 1e-5, "{square}");
        }
        assert_eq!(disc_to_square(Vec2::ZERO), Vec2::splat(0.5));
    }

    #[test]
    fn streams_are_reproducible_and_differ() {
        let first = |seed, stream, index| Random::new(seed, stream, index).next_u64();
        assert_eq!(first(1, 2, 3), first(1, 2, 3));
        let mut seen: Vec<u64> = (0..30).map(|k| first(k / 9, (k / 3) % 3, k % 3)).collect();
        seen.sort_unstable();
        seen.dedup();
        assert_eq!(seen.len(), 30);
    }
}
