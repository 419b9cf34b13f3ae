//! The studies: FLIP beside its authors' own, speed and stability as commands.

mod flip;
