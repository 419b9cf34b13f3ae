//! The edges and faces that a thing has by its kind, wherever it is.

use super::{Shape, Thing};

/// The edges between corners, as pairs of indices into [`super::corner_names`].
pub fn edges(thing: &Thing) -> Vec<[usize; 2]> {
    let ring =
        |from: usize, count: usize| (0..count).map(move |i| [from + i, from + (i + 1) % count]);
    let raised = |count: usize| {
        let upright = (0..count).map(move |i| [i, count + i]);
        ring(0, count).chain(ring(count, count)).chain(upright)
    };
    match &thing.shape {
        Shape::Room { corners, openings, .. } => {
            let holes = (0..openings.len()).flat_map(|hole| ring(2 * corners + 4 * hole, 4));
            raised(*corners).chain(holes).collect()
        }
        Shape::Box { .. } => raised(4).collect(),
        Shape::Prism { corners } => raised(*corners).collect(),
        Shape::Polygon { corners } => ring(0, *corners).collect(),
        Shape::Cylinder => Vec::new(),
    }
}

/// The names of the faces, as [`super::Surfaces`] has them. The bottom of a thing, and side 1 of a
/// box that is flush with a wall, belong to the mesh only where they are named there.
pub fn face_names(thing: &Thing) -> Vec<String> {
    let numbered = |name: &str, count: usize| -> Vec<String> {
        (1..=count).map(|i| format!("{name}{i}")).collect()
    };
    let list = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
    match &thing.shape {
        Shape::Room { corners, .. } => {
            [list(&["floor"]), numbered("wall", *corners), list(&["ceiling"])].concat()
        }
        Shape::Box { .. } => [numbered("side", 4), list(&["top", "bottom"])].concat(),
        Shape::Prism { corners } => [numbered("side", *corners), list(&["top", "bottom"])].concat(),
        Shape::Cylinder => list(&["side", "top", "bottom"]),
        Shape::Polygon { .. } => list(&["front"]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::things::{Opening, Support, Surfaces, corner_names, faces};

    fn thing(shape: Shape) -> Thing {
        let on = match shape {
            Shape::Polygon { .. } => Support::Free,
            _ => Support::Floor,
        };
        let (id, held, surfaces) = ("a".to_owned(), Vec::new(), Surfaces::default());
        Thing { id, shape, on, held, surfaces }
    }

    /// Euler's formula on closed solids, and every corner at three edges.
    #[test]
    fn edges_close_the_solid() {
        for (shape, count) in [(Shape::Box { flush: None }, 4), (Shape::Prism { corners: 5 }, 5)] {
            let own = thing(shape);
            let (edges, names) = (edges(&own), corner_names(&own));
            assert_eq!((names.len() + count + 2) - edges.len(), 2);
            for corner in 0..names.len() {
                assert_eq!(edges.iter().filter(|edge| edge.contains(&corner)).count(), 3);
            }
        }
        let openings = vec![Opening { id: "door".into(), wall: 1 }];
        let room = thing(Shape::Room { corners: 4, rectilinear: true, openings });
        let (edges, names) = (edges(&room), corner_names(&room));
        assert_eq!(edges.len(), 12 + 4);
        assert_eq!(
            edges[12..].iter().map(|[a, b]| [&names[*a], &names[*b]]).next_back(),
            Some([&"door4".to_owned(), &"door1".to_owned()])
        );
    }

    /// Faces that are all named are all made.
    #[test]
    fn faces_have_these_names() {
        use glam::DVec3;
        for shape in [Shape::Box { flush: None }, Shape::Prism { corners: 3 }, Shape::Cylinder] {
            let mut own = thing(shape);
            let names = face_names(&own);
            let named = names.iter().map(|name| (name.clone(), Some(name.clone())));
            own.surfaces.named = named.collect();
            let corners: Vec<DVec3> =
                (0..corner_names(&own).len()).map(|i| DVec3::splat(i as f64)).collect();
            let circles = Some(([DVec3::ZERO, DVec3::Z], 1.0));
            let mut made: Vec<String> =
                faces(&own, &corners, circles).into_iter().map(|face| face.surface).collect();
            let mut names = names;
            made.sort();
            names.sort();
            assert_eq!(made, names);
        }
    }
}
