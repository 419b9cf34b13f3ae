//! What a project takes over from a run, and what its masks do to the capture.

use std::collections::BTreeSet;

use super::*;
use crate::scene::{Role, Surface};

#[test]
fn results_are_matched_by_surfaces_not_by_names() {
    let surface = |index: usize| Surface {
        name: format!("s{index}"),
        role: Role::Material(index / 2),
        has_texcoords: false,
    };
    let mut surfaces: Vec<Surface> = (0..4).map(surface).collect();
    let mut materials = crate::io::tags::from_surfaces(&mut surfaces, &[]).materials;
    materials.truncate(2);
    for (index, name) in ["floor", "wall"].into_iter().enumerate() {
        materials[index].name = name.into();
        materials[index].surfaces = vec![2 * index, 2 * index + 1];
    }
    surfaces.iter_mut().enumerate().for_each(|(i, s)| s.role = Role::Material(i / 2));
    let loaded = Arc::new(Capture { surfaces, materials, ..Capture::default() });
    let mut project = Project::new(PathBuf::new(), loaded.clone(), 0.0);
    project.products.of = Some((project.edit().clone(), loaded));
    assert_eq!([0, 1].map(|index| project.found_as(index)), [Some(0), Some(1)]);
    // One surface of the floor does not make a new material the floor.
    let surfaces = BTreeSet::from([0]);
    project.change(&Change::NewMaterial { surfaces }).unwrap();
    project.change(&Change::Assign { surfaces: [1].into(), material: 0 }).unwrap();
    assert_eq!([0, 1, 2].map(|index| project.found_as(index)), [Some(0), Some(1), None]);
    project.change(&Change::Delete { material: 2 }).unwrap();
    project.change(&Change::Delete { material: 0 }).unwrap();
    let name = "floor".to_owned();
    project.change(&Change::Rename { material: 0, name }).unwrap();
    assert_eq!(project.found_as(0), Some(1), "the wall stays what it was found as");
    assert_eq!([0, 1].map(|index| project.listed_as(index)), [None, Some(0)]);
}

/// Photographs of which nothing changes stay the same ones: the stages of a run are kept by them.
#[test]
fn masks_come_and_go_and_photographs_that_have_none_stay() {
    let image = || Some(Arc::new(crate::scene::Image::new(2, 1, vec![[1.0; 3]; 2], None)));
    let camera = crate::scene::Camera::new(
        (2, 1),
        glam::DVec2::ONE,
        glam::DVec2::ONE,
        crate::scene::Distortion::default(),
        glam::DMat3::IDENTITY,
        glam::DVec3::ZERO,
    );
    let photograph = |name: &str| crate::scene::Photograph {
        name: name.into(),
        camera,
        image: image(),
        display: None,
    };
    let photographs = vec![photograph("a.exr"), photograph("b.exr")];
    let loaded = Arc::new(Capture { photographs, ..Capture::default() });
    let mut project = Project::new(PathBuf::new(), loaded.clone(), 0.0);
    let before = project.edit().clone();
    let mask = Arc::new(crate::scene::Mask::new((2, 1), &[true, false]));
    let masks = Arc::new([("a.exr".to_owned(), mask)].into());
    project.change(&Change::Masks { name: "paint mask", masks }).unwrap();
    let image =
        |project: &Project, index: usize| project.capture.photographs[index].image.clone().unwrap();
    let masked = image(&project, 0);
    assert_eq!((masked.masked_count(), masked.radiance(0, 0)), (1, None));
    assert!(!before.same_reconstruction_inputs(project.edit()));
    let plain = |index: usize| loaded.photographs[index].image.clone().unwrap();
    assert!(Arc::ptr_eq(&image(&project, 1), &plain(1)));
    project.change(&Change::DeleteEmpty).unwrap();
    let mut other = (**project.edit()).clone();
    other.given = Arc::new(GivenLight {
        environment: crate::scene::Environment::Open,
        ..(*other.given).clone()
    });
    project.set_edit(Arc::new(other));
    assert!(Arc::ptr_eq(&image(&project, 0), &masked), "the mask is as it was");
    project.undo();
    assert_eq!(image(&project, 0).masked_count(), 0);
}
