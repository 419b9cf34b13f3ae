//! Pictures against what is known of them by other means: closed forms, quadrature, energy.
//!
//! Estimates are compared by a z-test: the mean of many independent pixels must lie within 4.5 of
//! its standard errors (chance fails one such test in 150,000; seeds are fixed, so none fails by
//! chance twice), and that standard error must be small enough for the test to tell anything.

/// A scene in memory and the means of its pictures.
mod stage;

/// Bad luck: random edits, and what cannot be seen.
mod chaos;
/// The tracer of graphics cards beside that of the processor.
#[cfg(feature = "gpu")]
mod card;
/// Noise taken out.
mod denoise;
/// Same scene, options and seed, same bytes; and a cancelled picture.
mod determinism;
/// Textures, other materials, objects, the factor on the recovered light.
mod edits;
/// Scenes whose light is known everywhere.
mod furnace;
/// Glossy reflection against quadrature.
mod gloss;
/// Pictures as layers by light.
mod layers;
/// Direct light of every added light against closed forms.
mod lights;
/// Mirrors and clear glass under an even sky.
mod mirrors;
/// Light probes against closed forms and the path tracer.
mod probe;
/// Recovered lights against the coupling that they were solved with.
mod recovered;
/// A scene that is looked at while it is changed.
mod relight;
/// The box that stands for the unmodelled room.
mod surroundings;

/// A dielectric coat by formulas that the program does not share.
mod coats;
/// Scenes built in memory, as for the paper's method.
#[path = "../paper/rooms.rs"]
#[expect(dead_code, reason = "the tests of the paper's method use the rest")]
mod rooms;
