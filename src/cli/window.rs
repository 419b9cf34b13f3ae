//! `lobelia` and `lobelia CAPTURE`: the window.

use std::path::PathBuf;

use anyhow::anyhow;

use crate::cli::Ending;

pub(super) fn run(path: Option<PathBuf>) -> Result<(), Ending> {
    let shown = path.as_ref().map_or("CAPTURE".to_owned(), |path| path.display().to_string());
    crate::app::open(path).map_err(|problem| {
        // The window library puts the place in its own source in front.
        let problem = problem.rsplit_once(".rs:").map_or(problem.as_str(), |(_, rest)| {
            rest.split_once(": ").map_or(rest, |(_, reason)| reason)
        });
        Ending::Failed(anyhow!(
            "the window cannot be opened: {problem}\n\
             It needs an X11 or Wayland session (DISPLAY or WAYLAND_DISPLAY), and a graphics driver \
             with Vulkan or OpenGL: install your graphics card's, or mesa-vulkan-drivers, which \
             draws without a card.\n\
             In the terminal the same job is done by: lobelia reconstruct {shown} --out DIR"
        ))
    })
}
