//! Point sets with a minimum distance (Sections 4.1 and 4.2).
