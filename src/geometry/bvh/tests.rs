use glam::{DVec3, Vec2};

use super::*;
use crate::math::sampling::Random;

type Mesh = (Vec<Vec3>, Vec<[u32; 3]>);

fn ray(origin: Vec3, direction: Vec3) -> Ray {
    Ray { origin, direction: direction.normalize_or_zero(), t_min: 0.0, t_max: f32::INFINITY }
}

fn in_cube(random: &mut Random) -> Vec3 {
    2.0 * Vec3::new(random.uniform(), random.uniform(), random.uniform()) - 1.0
}

/// Triangles of all sizes, anyhow.
fn soup(count: usize, seed: u64) -> Mesh {
    let mut random = Random::new(seed, 0, 0);
    let mut positions = Vec::new();
    for _ in 0..count {
        let (center, size) = (in_cube(&mut random), random.uniform().powi(4));
        positions.extend([0; 3].map(|_| center + size * in_cube(&mut random)));
    }
    (positions, (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
}

/// A square over [0, cells]² in the plane where `axis` is 0.
fn grid(cells: u32, axis: usize) -> Mesh {
    let side = cells + 1;
    let place = |i: u32| Vec3::new((i % side) as f32, (i / side) as f32, 0.0);
    let turned = |p: Vec3| [Vec3::new(p.z, p.x, p.y), Vec3::new(p.y, p.z, p.x), p][axis];
    let cell = |i: u32| {
        let a = i / cells * side + i % cells;
        [[a, a + 1, a + side + 1], [a + side, a, a + side + 1]]
    };
    let positions = (0..side * side).map(|i| turned(place(i))).collect();
    (positions, (0..cells * cells).flat_map(cell).collect())
}

/// A closed cube [-1, 1]³ of `cells`² squares a face, with faces that share vertices by value.
fn cube(cells: u32) -> Mesh {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            let (points, faces) = grid(cells, axis);
            let first = positions.len() as u32;
            let scale = 2.0 / cells as f32;
            positions.extend(points.iter().map(|p| {
                let mut point = (*p * scale - 1.0).to_array();
                point[axis] = sign;
                Vec3::from(point)
            }));
            triangles.extend(faces.iter().map(|face| face.map(|vertex| vertex + first)));
        }
    }
    (positions, triangles)
}

/// A sphere of radius 1: an octahedron whose edges are halved `levels` times.
fn sphere(levels: usize) -> Mesh {
    let axes = [Vec3::X, Vec3::Y, Vec3::Z];
    let mut faces: Vec<[Vec3; 3]> = (0..8)
        .map(|octant| [0, 1, 2].map(|i| if octant >> i & 1 == 1 { -axes[i] } else { axes[i] }))
        .collect();
    for _ in 0..levels {
        let halved = |[a, b, c]: [Vec3; 3]| {
            let [ab, bc, ca] = [
                (a + b).normalize_or_zero(),
                (b + c).normalize_or_zero(),
                (c + a).normalize_or_zero(),
            ];
            [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
        };
        faces = faces.into_iter().flat_map(halved).collect();
    }
    (faces.concat(), (0..faces.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
}

fn build((positions, triangles): &Mesh) -> RayCaster {
    RayCaster::build(positions, triangles)
}

fn portable(mesh: &Mesh) -> RayCaster {
    RayCaster { instructions: Instructions::Portable, ..build(mesh) }
}

/// The triangle's plane and barycentric coordinates in f64: t, and how far inside the ray passes.
fn exact(mesh: &Mesh, triangle: usize, ray: &Ray) -> (f64, f64) {
    let [a, b, c] = mesh.1[triangle].map(|vertex| mesh.0[vertex as usize].as_dvec3());
    let direction = ray.direction.as_dvec3();
    let from_a = ray.origin.as_dvec3() - a;
    let across = direction.cross(c - a);
    let volume = (b - a).dot(across);
    let u = from_a.dot(across) / volume;
    let other: DVec3 = from_a.cross(b - a);
    let v = direction.dot(other) / volume;
    ((c - a).dot(other) / volume, u.min(v).min(1.0 - u - v))
}

/// Our nearest hit must be one of the triangles' and no clear hit may be nearer.
fn agrees_with_exact(mesh: &Mesh, rays: impl Iterator<Item = Ray>) -> usize {
    let caster = build(mesh);
    let (mut hits, mut last) = (0, Blocker::default());
    for ray in rays {
        let hit = caster.closest(&ray);
        assert_eq!(caster.occluded(&ray), hit.is_some());
        assert_eq!(caster.occluded_after(&ray, &mut last), hit.is_some());
        if let Some(hit) = hit {
            let (t, inside) = exact(mesh, hit.triangle as usize, &ray);
            let slack = 1e-4 * (1.0 + t.abs());
            assert!((f64::from(hit.t) - t).abs() < slack || inside.abs() < 1e-3, "{ray:?} {hit:?}");
            assert!(inside > -1e-3, "{ray:?} {hit:?}");
            hits += 1;
        }
        let until = hit.map_or(f64::from(ray.t_max), |hit| f64::from(hit.t)) - 1e-4;
        for triangle in 0..mesh.1.len() {
            let (t, inside) = exact(mesh, triangle, &ray);
            let missed = inside > 1e-4 && t > f64::from(ray.t_min) + 1e-4 && t < until;
            assert!(!missed, "{ray:?} misses {triangle} at {t}, got {hit:?}");
        }
    }
    hits
}

#[test]
fn agrees_with_brute_force_in_f64() {
    let mut random = Random::new(7, 0, 0);
    for mesh in [soup(1, 1), soup(7, 2), soup(1000, 3), grid(12, 0), grid(12, 1), cube(5)] {
        let rays: Vec<Ray> = (0..600)
            .map(|_| {
                let origin = 3.0 * in_cube(&mut random);
                let target = mesh.0[random.below(mesh.0.len())] + 0.3 * in_cube(&mut random);
                Ray {
                    t_min: random.uniform(),
                    t_max: 1.0 + 9.0 * random.uniform(),
                    ..ray(origin, target - origin)
                }
            })
            .collect();
        assert!(agrees_with_exact(&mesh, rays.into_iter()) > 0);
    }
}

/// The promise of the module's first lines, to the bit: the tree and its boxes do not show.
#[test]
fn answers_as_if_every_triangle_were_tested() {
    let mut random = Random::new(8, 0, 0);
    for mesh in [soup(300, 4), grid(9, 2), cube(3), sphere(2)] {
        let caster = build(&mesh);
        let alone: Vec<RayCaster> =
            mesh.1.iter().map(|&triangle| RayCaster::build(&mesh.0, &[triangle])).collect();
        for number in 0..1500 {
            let origin = 2.0 * in_cube(&mut random);
            let corner = mesh.0[random.below(mesh.0.len())];
            let middle = 0.5 * (corner + mesh.0[random.below(mesh.0.len())]);
            let target = [corner, middle, in_cube(&mut random)][number % 3];
            let ray = ray(origin, target - origin);
            let each = alone.iter().enumerate().filter_map(|(index, one)| {
                Some(Hit { triangle: index as u32, ..one.closest(&ray)? })
            });
            let nearest = each.reduce(|a, b| if b.t < a.t { b } else { a });
            assert_eq!(caster.closest(&ray), nearest, "{ray:?}");
            assert_eq!(caster.occluded(&ray), nearest.is_some());
        }
    }
}

#[test]
fn instruction_sets_agree_to_the_bit() {
    let mut random = Random::new(9, 0, 0);
    for mesh in [soup(3000, 5), grid(20, 2), cube(8), sphere(3)] {
        let (best, plain) = (build(&mesh), portable(&mesh));
        let mut last = [Blocker::default(); 2];
        for number in 0..20_000 {
            let origin = 2.0 * in_cube(&mut random);
            let target = mesh.0[random.below(mesh.0.len())];
            let toward = [target - origin, in_cube(&mut random), Vec3::X, -Vec3::Z][number % 4];
            let ray = Ray { t_max: 4.0 * random.uniform(), ..ray(origin, toward) };
            assert_eq!(best.closest(&ray), plain.closest(&ray), "{ray:?}");
            let is_blocked = best.occluded(&ray);
            assert_eq!(is_blocked, plain.occluded(&ray), "{ray:?}");
            for (caster, last) in [&best, &plain].into_iter().zip(&mut last) {
                assert_eq!(caster.occluded_after(&ray, last), is_blocked, "{ray:?}");
            }
        }
    }
}

#[test]
fn batches_keep_the_order_for_any_number_of_threads() {
    let caster = build(&soup(500, 6));
    let mut random = Random::new(10, 0, 0);
    let rays: Vec<Ray> =
        (0..5000).map(|_| ray(2.0 * in_cube(&mut random), in_cube(&mut random))).collect();
    let hits: Vec<Option<Hit>> = rays.iter().map(|ray| caster.closest(ray)).collect();
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert_eq!(pool.install(|| caster.closest_batch(&rays)), hits);
        let occluded = pool.install(|| caster.occluded_batch(&rays));
        assert!(occluded.iter().zip(&hits).all(|(occluded, hit)| *occluded == hit.is_some()));
    }
}

/// Where the triangle test of the builder's crate lets every ray through (−0.0 from behind).
#[test]
fn no_ray_slips_through_a_grid() {
    for axis in 0..3 {
        let mesh = grid(15, axis);
        for caster in [build(&mesh), portable(&mesh)] {
            for [a, b, c] in mesh.1.iter().map(|face| face.map(|v| mesh.0[v as usize])) {
                for target in [a, b, c, (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0] {
                    for tilt in [Vec3::ZERO, Vec3::splat(0.1), Vec3::new(0.7, -0.3, 0.9)] {
                        for side in [-1.0, 1.0] {
                            let mut offset = tilt.to_array();
                            offset[axis] = side * 2.0;
                            // Tilted rays are aimed with rounding: keep them off the rim.
                            let rim = |i| i != axis && (target[i] == 0.0 || target[i] == 15.0);
                            if tilt != Vec3::ZERO && (0..3).any(rim) {
                                continue;
                            }
                            let offset = Vec3::from(offset);
                            let ray = ray(target + offset, -offset);
                            let hit = caster.closest(&ray).expect("a hit");
                            assert!((hit.t - offset.length()).abs() < 1e-5);
                            assert!(caster.occluded(&ray));
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn no_ray_escapes_from_a_closed_surface() {
    let mut random = Random::new(11, 0, 0);
    for mesh in [cube(1), cube(7), sphere(0), sphere(4)] {
        // Small and far from the origin, too, where rounding is coarse.
        for (scale, center) in [(1.0, Vec3::ZERO), (0.01, Vec3::new(1.0, 2.0, 3.0))] {
            let positions: Vec<Vec3> = mesh.0.iter().map(|p| center + scale * *p).collect();
            let caster = RayCaster::build(&positions, &mesh.1);
            for number in 0..60_000 {
                let origin = [Vec3::ZERO, 0.3 * in_cube(&mut random)][number % 2];
                let a = mesh.0[random.below(mesh.0.len())];
                let b = mesh.0[random.below(mesh.0.len())];
                let axis = [Vec3::X, Vec3::Y, Vec3::Z][random.below(3)];
                let sideways = axis + 1e-3 * in_cube(&mut random) * random.uniform().powi(8);
                let toward =
                    [a - origin, (a + b) / 2.0 - origin, in_cube(&mut random), -axis, sideways];
                let toward = toward[number % 5];
                if toward.length() < 1e-3 {
                    continue;
                }
                let ray = ray(center + scale * origin, toward);
                assert!(caster.closest(&ray).is_some(), "{ray:?} escapes");
                assert!(caster.occluded(&ray));
            }
        }
    }
}

#[test]
fn hits_have_distance_index_and_weights() {
    let positions = [Vec3::ZERO, Vec3::X * 4.0, Vec3::Y * 4.0];
    let caster = RayCaster::build(&positions, &[[0, 1, 2]]);
    for side in [-1.0, 1.0] {
        let hit = caster.closest(&ray(Vec3::new(1.0, 2.0, 5.0 * side), -Vec3::Z * side));
        assert_eq!(hit, Some(Hit { t: 5.0, triangle: 0, u: 0.25, v: 0.5 }));
    }
}

#[test]
fn the_interval_is_half_open() {
    let caster = build(&grid(1, 2));
    let hits = |t_min, t_max| {
        let ray = Ray { t_min, t_max, ..ray(Vec3::new(0.5, 0.25, 2.0), -Vec3::Z) };
        assert_eq!(caster.occluded(&ray), caster.closest(&ray).is_some());
        caster.occluded(&ray)
    };
    assert!(hits(0.0, f32::INFINITY));
    assert!(hits(2.0, 3.0));
    assert!(hits(-5.0, 2.0_f32.next_up()));
    assert!(!hits(0.0, 2.0));
    assert!(!hits(2.0_f32.next_up(), 3.0));
    assert!(!hits(3.0, 1.0));
    assert!(!hits(f32::NAN, f32::NAN));
}

#[test]
fn of_equally_near_triangles_the_first_is_hit() {
    let (positions, triangles) = grid(1, 2);
    let many: Vec<[u32; 3]> = (0..100).map(|_| triangles[0]).collect();
    for caster in [build(&(positions.clone(), many.clone())), portable(&(positions, many))] {
        let hit = caster.closest(&ray(Vec3::new(0.5, 0.25, 2.0), -Vec3::Z)).unwrap();
        assert_eq!(hit.triangle, 0);
    }
}

#[test]
fn nothing_is_hit_in_empty_and_degenerate_scenes() {
    let there = ray(Vec3::new(0.1, 0.1, 1.0), -Vec3::Z);
    let positions =
        [Vec3::ZERO, Vec3::X, Vec3::X * 2.0, Vec3::Y, Vec3::NAN, Vec3::INFINITY, Vec3::MAX];
    let useless: [[u32; 3]; 6] = [[0, 0, 0], [0, 1, 2], [0, 1, 1], [0, 1, 4], [0, 5, 3], [0, 1, 6]];
    for triangles in [&useless[..0], &useless[..1], &useless[..]] {
        let caster = RayCaster::build(&positions, triangles);
        assert_eq!(caster.closest(&there), None);
        assert!(!caster.occluded(&there));
    }
    let mut triangles = useless.to_vec();
    triangles.push([0, 1, 3]);
    assert_eq!(RayCaster::build(&positions, &triangles).closest(&there).unwrap().triangle, 6);
}

#[test]
fn odd_rays_and_huge_scenes_do_not_panic() {
    let mut random = Random::new(12, 0, 0);
    for scale in [1e-30, 1e-12, 1e12, 1e30] {
        let (positions, triangles) = soup(500, 7);
        let positions: Vec<Vec3> = positions.iter().map(|p| *p * 0.5 * scale).collect();
        let caster = RayCaster::build(&positions, &triangles);
        for _ in 0..1000 {
            let place = scale * in_cube(&mut random);
            let hit = caster.closest(&ray(place, in_cube(&mut random)));
            assert!(hit.is_none_or(|hit| (hit.triangle as usize) < triangles.len()));
        }
        for odd in [Vec3::NAN, Vec3::INFINITY, Vec3::ZERO] {
            let place = Vec3::new(0.1, 0.2, 0.3) * scale;
            for (origin, direction) in [(odd, Vec3::X), (place, odd), (odd, odd)] {
                if origin != Vec3::ZERO || direction == odd {
                    let odd = Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
                    assert_eq!(caster.closest(&odd), None, "{odd:?}");
                    assert!(!caster.occluded(&odd));
                }
            }
        }
    }
}

/// A tree so deep that the stack goes to the heap.
#[test]
fn a_large_stack_gives_the_same_hits() {
    let mesh = soup(2000, 8);
    let (caster, mut deep) = (build(&mesh), build(&mesh));
    deep.tree.stack_size = STACK + 1;
    let mut random = Random::new(13, 0, 0);
    for _ in 0..2000 {
        let ray = ray(2.0 * in_cube(&mut random), in_cube(&mut random));
        assert_eq!(deep.closest(&ray), caster.closest(&ray));
        assert_eq!(deep.occluded(&ray), caster.occluded(&ray));
    }
}

#[test]
fn weights_lead_to_the_point_of_the_ray() {
    let mesh = sphere(3);
    let caster = build(&mesh);
    let mut random = Random::new(14, 0, 0);
    for _ in 0..2000 {
        let place = Vec2::new(random.uniform(), random.uniform()) - 0.5;
        let ray = ray(place.extend(0.2), in_cube(&mut random));
        let hit = caster.closest(&ray).unwrap();
        let [a, b, c] = mesh.1[hit.triangle as usize].map(|vertex| mesh.0[vertex as usize]);
        let weighted = a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v;
        assert!(weighted.distance(ray.origin + hit.t * ray.direction) < 1e-5);
    }
}

/// Beams of all widths, some of them of rays that meet one triangle, against ray by ray.
#[test]
fn a_beam_meets_what_its_rays_meet() {
    let mut random = Random::new(21, 0, 0);
    let (mut one, mut each, mut none) = (0, 0, 0);
    let (mut rays, mut unclear) = (0, 0);
    for mesh in [soup(7, 2), soup(1000, 3), grid(12, 0), grid(12, 1), cube(5), sphere(3)] {
        for caster in [build(&mesh), portable(&mesh)] {
            for _ in 0..1500 {
                // From within, from outside, and from a corner or an edge's middle.
                let corner = mesh.0[random.below(mesh.0.len())];
                let origin = match random.below(4) {
                    0 => corner,
                    1 => 0.5 * (corner + mesh.0[random.below(mesh.0.len())]),
                    _ => 3.0 * random.uniform() * in_cube(&mut random),
                };
                let middle = mesh.0[random.below(mesh.0.len())] + 0.3 * in_cube(&mut random);
                let width = 10.0f32.powf(-4.0 * random.uniform());
                let directions: Vec<Vec3> = (0..1 + random.below(MOST_RAYS))
                    .map(|_| {
                        let towards = (middle - origin).normalize_or_zero();
                        (towards + width * in_cube(&mut random)).normalize_or_zero()
                    })
                    .collect();
                let Some(beam) = Beam::of(origin, directions.iter().copied()) else { continue };
                let ray = |place: usize| ray(origin, directions[place]);
                let mut met = vec![None; directions.len()];
                let outcome = caster.closest_of_beam(&beam, &ray, &mut met);
                match outcome {
                    Met::One(triangle) => {
                        met.fill(triangle);
                        one += usize::from(triangle.is_some());
                        none += usize::from(triangle.is_none());
                    }
                    Met::Each => each += 1,
                }
                for (place, triangle) in met.into_iter().enumerate() {
                    let expected = caster.closest(&ray(place)).map(|hit| hit.triangle);
                    rays += 1;
                    if triangle != expected {
                        // Slivers, and planes that rays run within, are met by chance: in f64 it must
                        // be a hit then, and no clear one may be nearer.
                        let exact = |triangle| exact(&mesh, triangle, &ray(place));
                        let found = triangle.map(|triangle| exact(triangle as usize));
                        let until = found.map_or(f64::INFINITY, |(t, _)| t) - 1e-4;
                        assert!(found.is_none_or(|(_, inside)| inside > -1e-3), "{outcome:?}");
                        for other in 0..mesh.1.len() {
                            let (t, inside) = exact(other);
                            let missed = inside > 1e-4 && t > 1e-4 && t < until;
                            assert!(!missed, "{:?}: {triangle:?} for {expected:?}", ray(place));
                        }
                        unclear += 1;
                    }
                }
            }
        }
    }
    assert!(one > 90 && each > 10_000 && none > 2000, "{one} {each} {none}");
    assert!(unclear * 10_000 < rays, "{unclear} of {rays}");
}
