//! The reconstruction core against what is known of it by other means: closed forms, numerical
//! quadrature, scenes whose answer is built in. Nothing here computes an expectation with the
//! code that it checks.

/// Scenes in memory, their photographs rendered by this crate's own ray caster.
mod rooms;

/// Light of small bright patches.
mod bright;
/// A cancelled job ends.
mod cancel;
/// k_ij (Eq. 10) against the irradiance from discs.
mod coupling;
/// Coverage masks and lobe directions (Section 4.2, Fig. 6).
mod coverage;
/// Captures with little or nothing in them.
mod degenerate;
/// Same capture and options, same bytes.
mod determinism;
/// Irradiance from known luminaires against closed forms.
mod emitters;
/// The inside of a sphere, where the light is known in closed form.
mod furnace;
/// Mirrors and clear glass.
mod mirrors;
/// The grey-world start (Section 5.2, Eq. 11).
mod normalization;
/// The modified Phong lobe (Eq. 12) against quadrature.
mod phong;
/// Where virtual lights are placed (Section 4.2, Fig. 5).
mod placement;
/// Emissions and reflectances come back from radiances made with the model itself.
mod recovery;
/// Eq. 13 on hand-made numbers.
mod reflectance;
/// Where samples are placed and what is read there (Section 4.1).
mod samples;
/// Texture maps (Section 5.5).
mod textures;
