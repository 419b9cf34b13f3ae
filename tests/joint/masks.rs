//! An intruder before rooms, one of them with an answer that is known in closed form.

use std::sync::Arc;

use glam::DVec3;
use lobelia::math::rgb::Radiance;
use lobelia::reconstruct::Reconstruction;
use lobelia::scene::Image;

use crate::rooms::{Room, box_room, run};
use crate::whole::{furnace, options};

const RHO: [[f64; 3]; 2] = [[0.8, 0.5, 0.1], [0.3, 0.6, 0.7]];

/// What the intruder covers of each photograph: of the second six what it leaves free in the first.
fn covers(photograph: usize, x: usize, y: usize) -> bool {
    let low = if photograph < 6 { 8 } else { 56 };
    (low..low + 32).contains(&x) && (20..70).contains(&y)
}

/// A room with something of one radiance painted over each photograph.
fn painted(mut room: Room, intruder: Radiance, with_masks: bool) -> Room {
    for (index, photograph) in room.capture.photographs.iter_mut().enumerate() {
        let image = photograph.image.as_ref().unwrap();
        let (width, height) = (image.width(), image.height());
        let pixel = |(k, pixel): (usize, Radiance)| {
            if covers(index, k % width, k / width) { intruder } else { pixel }
        };
        let pixels = image.pixels().enumerate().map(pixel).collect();
        let mut image = Image::new(width, height, pixels, None);
        if with_masks {
            image.mask(|x, y| covers(index, x, y));
        }
        photograph.image = Some(Arc::new(image));
    }
    room
}

/// The largest part by which a reflectance is off.
fn error(result: &Reconstruction) -> f64 {
    let found = result.solution.reflectances.iter().map(|found| found.unwrap().diffuse);
    let errors = found.zip(RHO).flat_map(|(found, rho)| std::iter::zip(found, rho));
    errors.map(|(found, rho)| (found / rho - 1.0).abs()).fold(0.0, f64::max)
}

#[test]
fn what_a_mask_covers_changes_no_bit() {
    let bits = |result: &Reconstruction| -> Vec<u64> {
        let diffuse = result.solution.reflectances.iter().flatten().flat_map(|r| r.diffuse);
        let emission = result.solution.emission.iter().flatten().copied();
        let irradiance = result.transport.irradiance.iter().flatten().map(|&v| f64::from(v));
        let texels = result.textures.iter().flat_map(|t| t.texels.iter().flatten());
        let samples = result.samples.samples.iter().flat_map(|s| s.radiance).map(f64::from);
        let all = diffuse.chain(emission).chain(irradiance).chain(samples);
        all.chain(texels.map(|&v| f64::from(v))).map(f64::to_bits).collect()
    };
    let solved = |intruder: Radiance| {
        let mut room = painted(box_room(), intruder, true);
        room.capture.materials[0].textured = true;
        bits(&run(&room, &options()).unwrap())
    };
    // A lamp, something black, and what no sensor gives.
    let bright = solved([1e6, 1e5, 1e4]);
    assert!(bright.len() > 5000, "{}", bright.len());
    assert!(bright == solved([0.0; 3]) && bright == solved([f32::NAN; 3]));
}

#[test]
fn behind_a_mask_the_scene_is_what_it_is() {
    let places = [DVec3::new(0.03, -0.02, 0.05), DVec3::new(-0.25, 0.2, -0.1)];
    let mut options = options();
    options.transport.rays = 1024;
    let mut solved = |masks: bool, omit_unmodelled: bool| {
        options.samples.omit_unmodelled = omit_unmodelled;
        run(&painted(furnace(RHO, &places), [0.9, 0.02, 0.4], masks), &options).unwrap()
    };
    let with = solved(true, false);
    assert!(error(&with) < 0.03, "{}", error(&with));
    let without = solved(false, false);
    assert!(error(&without) > 0.1, "{}", error(&without));
    // Without masks, the run finds by itself what is in front, if it is asked to.
    let found = solved(false, true);
    assert!(error(&found) < 0.05, "{}", error(&found));
    let notes = &found.solution.notes;
    assert!(notes.iter().any(|note| note.contains("things that are not modelled")), "{notes:?}");
    for view in &with.samples.views {
        assert!(!covers(view.photograph, view.pixel[0], view.pixel[1]));
    }
}
