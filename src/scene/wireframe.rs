//! The edges of a mesh, projected with a camera and its lens distortion, to be drawn over its
//! photograph.

use glam::{DVec2, DVec3, Vec2, Vec3};
use rayon::prelude::*;

use crate::geometry::bvh::{Ray, RayCaster};
use crate::geometry::mesh::Mesh;
use crate::scene::Camera;
use crate::watch::{Cancelled, Watch};

/// Faces that meet at more than this (25°) make a crease.
const CREASE_COSINE: f32 = 0.906;
/// Faces of one surface that meet at less than this (1°) are one face cut in triangles.
const FLAT_COSINE: f32 = 0.99985;
/// Longest piece of an edge that is drawn straight and hidden as a whole, in pixels.
const PIECE_PX: f64 = 8.0;
/// Halvings of an edge: a thousand pieces.
const DEEPEST: u32 = 10;
/// What lies nearer before an edge, as a part of the distance, is the edge's own surface.
const OWN_SURFACE: f64 = 4e-3;
/// Points of all strokes together: no screen shows more.
const MOST_POINTS: usize = 150_000;

/// A connected part of an edge in an image.
#[derive(Clone, Debug, PartialEq)]
pub struct Stroke {
    /// In pixels from the image's top left corner; some may lie outside.
    pub points: Vec<Vec2>,
    /// Behind other surfaces.
    pub is_hidden: bool,
}

/// The edges between faces, not those within a flat one; where these are more than `most`, only
/// borders and creases; where that does not suffice, the longest of them.
pub fn edges(mesh: &Mesh, most: usize) -> Vec<[Vec3; 2]> {
    // Every side of a triangle, sorted so that those between the same vertices are neighbours.
    let mut sides: Vec<[u32; 3]> = Vec::with_capacity(3 * mesh.triangles.len());
    for (index, triangle) in mesh.triangles.iter().enumerate() {
        for side in 0..3 {
            let (a, b) = (triangle[side], triangle[(side + 1) % 3]);
            sides.push([a.min(b), a.max(b), index as u32]);
        }
    }
    sides.par_sort_unstable();
    let (mut all, mut creases) = (Vec::new(), Vec::new());
    for shared in sides.chunk_by(|a, b| a[..2] == b[..2]) {
        let [a, b, first] = shared[0];
        let first = first as usize;
        let others = || shared[1..].iter().map(|side| side[2] as usize);
        let bends = |other: usize, cosine: f32| {
            mesh.surface[first] != mesh.surface[other]
                || mesh.normal(first).dot(mesh.normal(other)) < cosine
        };
        let is_within = |other: usize| {
            mesh.polygon.get(first) == mesh.polygon.get(other) || !bends(other, FLAT_COSINE)
        };
        if shared.len() > 1 && others().all(is_within) {
            continue;
        }
        let is_crease = shared.len() == 1 || others().any(|other| bends(other, CREASE_COSINE));
        let ends = [a, b].map(|vertex| mesh.positions[vertex as usize]);
        all.push(ends);
        if is_crease {
            creases.push(ends);
        }
    }
    if all.len() <= most {
        return all;
    }
    let length = |[a, b]: &[Vec3; 2]| a.distance_squared(*b);
    creases.sort_by(|a, b| length(b).total_cmp(&length(a)));
    creases.truncate(most);
    creases
}

/// The edges in the camera's image. Without a caster nothing is hidden. `watch` counts edges.
pub fn strokes(
    camera: &Camera,
    edges: &[[Vec3; 2]],
    caster: Option<&RayCaster>,
    watch: &Watch,
) -> Result<Vec<Stroke>, Cancelled> {
    watch.begin(edges.len() as u64);
    let drawn: Vec<Vec<Stroke>> = edges
        .par_iter()
        .map(|ends| {
            watch.tick()?;
            let ends = ends.map(|end| end.as_dvec3());
            let mut pen = Pen { camera, caster, strokes: Vec::new(), end: None };
            pen.draw(ends, ends.map(|end| camera.place(end)), 0);
            Ok(pen.strokes)
        })
        .collect::<Result<_, Cancelled>>()?;
    let mut pieces = 0;
    let whole = drawn.into_iter().flatten().take_while(|stroke| {
        pieces += stroke.points.len();
        pieces <= MOST_POINTS
    });
    Ok(whole.collect())
}

/// Draws one edge from its first end to its last.
struct Pen<'a> {
    camera: &'a Camera,
    caster: Option<&'a RayCaster>,
    strokes: Vec<Stroke>,
    /// Where the last piece ended.
    end: Option<DVec3>,
}

impl Pen<'_> {
    fn draw(&mut self, ends: [DVec3; 2], pixels: [Option<DVec2>; 2], depth: u32) {
        let middle = 0.5 * (ends[0] + ends[1]);
        match pixels {
            [None, None] if depth >= 6 => return,
            [Some(a), Some(b)] => {
                if self.are_beside(a, b) {
                    return;
                }
                if a.distance(b) <= PIECE_PX || depth == DEEPEST {
                    self.piece(ends, [a, b], middle);
                    return;
                }
            }
            _ if depth == DEEPEST => return,
            _ => {}
        }
        let between = self.camera.place(middle);
        self.draw([ends[0], middle], [pixels[0], between], depth + 1);
        self.draw([middle, ends[1]], [between, pixels[1]], depth + 1);
    }

    /// Whether both pixels lie so far on one side of the image that even a bent edge between them
    /// does not reach it.
    fn are_beside(&self, a: DVec2, b: DVec2) -> bool {
        let size = DVec2::new(self.camera.width as f64, self.camera.height as f64);
        let margin = if self.camera.distortion.is_none() { DVec2::ZERO } else { 0.25 * size };
        a.max(b).cmplt(-margin).any() || a.min(b).cmpgt(size + margin).any()
    }

    fn piece(&mut self, ends: [DVec3; 2], pixels: [DVec2; 2], middle: DVec3) {
        let is_hidden = self.caster.is_some_and(|caster| {
            let way = middle - self.camera.position;
            let distance = way.length();
            caster.occluded(&Ray {
                origin: self.camera.position.as_vec3(),
                direction: way.normalize_or_zero().as_vec3(),
                t_min: 0.0,
                t_max: ((1.0 - OWN_SURFACE) * distance) as f32,
            })
        });
        let goes_on = self.end == Some(ends[0]);
        self.end = Some(ends[1]);
        let next = pixels[1].as_vec2();
        match self.strokes.last_mut().filter(|stroke| goes_on && stroke.is_hidden == is_hidden) {
            Some(stroke) => {
                // A straight lens leaves straight edges straight.
                if self.camera.distortion.is_none() && stroke.points.len() > 1 {
                    stroke.points.pop();
                }
                stroke.points.push(next);
            }
            None => {
                self.strokes.push(Stroke { points: vec![pixels[0].as_vec2(), next], is_hidden });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DMat3;

    use super::*;
    use crate::scene::Distortion;

    /// Looks along +y from the origin, z up.
    fn camera(distortion: Distortion) -> Camera {
        let axes = DMat3::from_cols(DVec3::X, DVec3::Z, -DVec3::Y);
        let (focal, middle) = (DVec2::splat(200.0), DVec2::new(160.0, 120.0));
        Camera::new((320, 300), focal, middle, distortion, axes, DVec3::ZERO)
    }

    /// A square at y = `depth` with half the side `half`.
    fn square(mesh: &mut Mesh, depth: f32, half: f32) {
        let base = mesh.positions.len() as u32;
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        mesh.positions.extend(corners.map(|(x, z)| Vec3::new(half * x, depth, half * z)));
        mesh.triangles.extend([[base, base + 1, base + 2], [base, base + 2, base + 3]]);
        mesh.surface.extend([0, 0]);
        mesh.polygon.extend([base, base]);
    }

    fn length(strokes: &[Stroke], is_hidden: bool) -> f32 {
        let own = strokes.iter().filter(|stroke| stroke.is_hidden == is_hidden);
        own.flat_map(|stroke| stroke.points.windows(2)).map(|p| p[0].distance(p[1])).sum()
    }

    #[test]
    fn a_square_before_another_hides_its_middle() {
        let mut mesh = Mesh::default();
        square(&mut mesh, 4.0, 1.0);
        // Stands before the lower half of the first, as high as to z = 0.
        let base = mesh.positions.len();
        square(&mut mesh, 2.0, 0.6);
        for corner in &mut mesh.positions[base..] {
            corner.z -= 0.6;
        }
        let edges = edges(&mesh, 100);
        assert_eq!(edges.len(), 8, "diagonals are no edges");
        let caster = RayCaster::build(&mesh.positions, &mesh.triangles);
        let camera = camera(Distortion::default());
        let all = strokes(&camera, &edges, Some(&caster), &Watch::new()).unwrap();
        // The back square is 100 pixels wide: its bottom edge and the lower halves of its sides
        // are behind the front one, which is 120 wide.
        assert!((length(&all, true) - 200.0).abs() < 2.0 * PIECE_PX as f32, "{all:?}");
        let seen = 200.0 + 4.0 * 120.0;
        assert!((length(&all, false) - seen).abs() < 2.0 * PIECE_PX as f32);
        // Without a caster all of it is seen, each edge in one straight stroke.
        let open = strokes(&camera, &edges, None, &Watch::new()).unwrap();
        assert!(open.iter().all(|stroke| stroke.points.len() == 2 && !stroke.is_hidden));
        assert_eq!(open.len(), 8);
    }

    #[test]
    fn strokes_follow_the_lens() {
        let barrel = Distortion { radial: [-0.2, 0.05, 0.0, 0.0], ..Distortion::default() };
        let camera = camera(barrel);
        let edge = [Vec3::new(-1.2, 2.0, 0.9), Vec3::new(1.2, 2.0, 0.9)];
        let drawn = strokes(&camera, &[edge], None, &Watch::new()).unwrap();
        assert_eq!(drawn.len(), 1);
        let points = &drawn[0].points;
        assert!(points.len() > 15);
        // The middle of the edge is nearer to the rim than its ends are.
        let middle = points[points.len() / 2];
        assert!(middle.y < points[0].y - 3.0, "{} {}", middle.y, points[0].y);
        let expected = camera.project(DVec3::new(0.0, 2.0, 0.9)).unwrap().0;
        assert!((middle - expected.as_vec2()).length() < PIECE_PX as f32);
    }

    #[test]
    fn what_is_behind_or_beside_is_not_drawn_and_what_leaves_the_image_is() {
        let camera = camera(Distortion::default());
        let draw = |a: Vec3, b: Vec3| strokes(&camera, &[[a, b]], None, &Watch::new()).unwrap();
        assert!(draw(Vec3::new(0.0, -1.0, 0.0), Vec3::new(1.0, -2.0, 0.0)).is_empty());
        assert!(draw(Vec3::new(9.0, 1.0, 0.0), Vec3::new(9.0, 1.0, 1.0)).is_empty());
        let through = draw(Vec3::new(0.1, -3.0, -0.1), Vec3::new(0.1, 5.0, -0.1));
        assert!(!through.is_empty());
        assert_eq!(edges(&Mesh::default(), 10).len(), 0);
    }

    #[test]
    fn of_too_many_edges_creases_stay() {
        let mut mesh = Mesh::default();
        for x in 0..=10 {
            // Bent a little from strip to strip, but for the first two.
            let height = (x as f32 - 2.0).max(0.0).powi(2) * 0.05;
            mesh.positions.extend([0.0, 1.0].map(|y| Vec3::new(x as f32, y, height)));
        }
        for strip in 0..10 {
            let [a, b] = [2 * strip, 2 * strip + 1];
            mesh.triangles.extend([[a, a + 2, b + 2], [a, b + 2, b]]);
            mesh.surface.extend([0, 0]);
            mesh.polygon.extend([strip, strip]);
        }
        // A border of 22, and nine lines within, of which one is flat.
        assert_eq!(edges(&mesh, 1000).len(), 30);
        assert_eq!(edges(&mesh, 25).len(), 22);
        assert_eq!(edges(&mesh, 5).len(), 5);
    }
}
