//! `model.json`: what a person drew on photographs and the things that it places ([`crate::model`]).
//!
//! ```json
//! { "format": "lobelia-model", "version": 1,
//!   "lenses": [ { "id": "lens", "focal_px": 820.0, "principal_px": [320, 240],
//!                 "k1": 0, "k2": 0, "fit": ["focal_px", "principal_px", "k1", "k2"] } ],
//!   "photographs": [ { "file_path": "images/000.exr", "lens": "lens", "w": 640, "h": 480 } ],
//!   "things": [
//!     { "id": "room", "kind": "room", "corners": 4, "rectilinear": true,
//!       "openings": [ { "id": "door", "wall": 2 } ], "hold": { "height": 2.4 },
//!       "surfaces": { "wall3": null, "ceiling": null } },
//!     { "id": "box1", "kind": "box", "on": "floor", "flush": "room.wall1", "surface": "box1" },
//!     { "id": "crate", "kind": "prism", "corners": 5, "on": "box1.top" },
//!     { "id": "can", "kind": "cylinder" },
//!     { "id": "poster", "kind": "polygon", "corners": 4, "on": "room.wall2" },
//!     { "id": "roof", "kind": "polygon", "corners": 4, "on": "free" } ],
//!   "points": [ { "id": "p1" } ],
//!   "strokes": [
//!     { "kind": "line", "photograph": "images/000.exr", "axis": "x", "from": [x, y], "to": [x, y] },
//!     { "kind": "pick", "photograph": "…", "at": "box1.top2", "pixel": [x, y] },
//!     { "kind": "edge", "photograph": "…", "between": ["box1.top1", "box1.top2"],
//!       "from": [x, y], "to": [x, y] },
//!     { "kind": "rim", "photograph": "…", "at": "can.top", "pixel": [x, y] },
//!     { "kind": "position", "at": "room.floor1", "position": [0, 0, 0], "sd_m": 0.001 },
//!     { "kind": "length", "between": ["room.floor1", "room.floor2"], "length_m": 3.5,
//!       "sd_m": 0.001 } ] }
//! ```
//!
//! Cameras that an engine found stand at the photographs, in coordinates of the engine's own:
//! `"found": { "rotation": [w, x, y, z], "position": [x, y, z], "distance": 3.1 }`, axes of the
//! camera as OpenGL's. `found_points` are its points: `"x y z  0@12.5,80 2@40,71.25"` with the
//! photographs that show them, counted from 0, and the pixels (version 2; without `@x,y` where they
//! are not known). `found_in_metres` says that the unit is the metre, which is then kept
//! where no length is given.
//!
//! An edge with `"sd_px": 0.25` (version 3) was not drawn: it is a line of the photograph that was
//! found to be that edge, as exactly as that. Only `format`, `version` and `photographs` must be there. Without `lenses` all photographs share
//! one. `w` and `h` are read from the image where they are missing, and `focal_px` from its EXIF.
//! `fit` names what of a lens is adjusted (`focal_px` alone by default). `hold` are typed numbers,
//! by the names in [`parameters`](crate::model::things::parameters). `surface` is the surface of all
//! faces of a thing, `surfaces` that of single ones; `null` leaves a face out. Without either a face
//! is the surface `thing.face`. Unknown fields are ignored.

mod begin;
mod cameras;
mod found;
mod lines;
mod mesh;
mod open;
mod points;
mod read;
mod strokes;
mod write;

pub use begin::new_capture;
pub use cameras::{Unplaced, orientation, unplaced, write_cameras};
pub use lines::{LONGEST, caster, lines, lines_of, photograph, show};
pub use mesh::{check_own, geometry, write_glb, write_obj};
pub use open::{Opened, forget, is_begun, keep, lacks_mesh, open, save};
pub use points::{POINTS, read_points, write_points};
pub use read::read;
pub use write::{to_text, write};

/// The file's name in a capture.
pub const NAME: &str = "model.json";
/// Beside it: what was drawn in the window and is not saved yet.
pub const UNSAVED: &str = "model.unsaved.json";
/// What the file says that it is.
const FORMAT: &str = "lobelia-model";
const VERSION: u64 = 3;
/// Standard deviation of typed positions and lengths that give none, in metres.
const TYPED_SD_M: f64 = 1e-3;
