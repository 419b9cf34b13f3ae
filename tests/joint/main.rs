//! The joint problem of one channel (`reconstruct::joint::system`) against what is known of it by
//! other means: SciPy's answers, the limit of the alternation, its objective written once more,
//! and the statistics of its errors on made-up data. Nothing here computes an expectation with
//! the code that it checks.

/// Corners in memory, their materials and light known.
mod scenes;

/// The alternation's limit is the joint optimum, and its standstill is not.
mod alternation;
/// Exposures of photographs against gains that are known.
mod gains;
/// SciPy's answers on the same systems.
mod golden;
/// The reported value and slope, and the optimality of the answer, from the definition.
mod gradients;
/// Outliers and rows that are held out.
mod robust;
/// The answer does not depend on the start.
mod starts;
/// Tempting estimators that are wrong, and the direction that no data fix.
mod traps;
/// Suns, lamps that the artist gives, highlights.
mod lights;
/// Models that are grown as far as held-out samples bear them out.
mod grown;
/// What holds for the solve as a whole: starts do not matter, and errors are of unseen samples.
mod pipeline;
/// Cards of known reflectance, found by their corners.
mod charts;
/// What a mask leaves out is not there.
mod masks;
/// Runs that take over what earlier ones made.
mod kept;
/// Whole reconstructions of degenerate scenes, and cancelling one.
mod whole;
/// A sun that shines in through an opening.
mod window;
/// Lamps that photographs show in front of surfaces.
mod in_front;
/// What glossy surfaces mirror, where no photograph shows it.
mod mirrored;

/// A dielectric coat, as for the renderer.
#[path = "../render/coats.rs"]
mod coats;
/// Scenes built in memory, as for the paper's method.
#[path = "../paper/rooms.rs"]
#[expect(dead_code, reason = "the tests of the paper's method use the rest")]
mod rooms;
