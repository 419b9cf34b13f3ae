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
             It needs a screen (an X11 or Wayland session, which DISPLAY or WAYLAND_DISPLAY names) \
             and a graphics driver with Vulkan or OpenGL: your graphics card's, or Mesa's, which \
             draws without a card. On Debian and Ubuntu:\n  \
             sudo apt-get install libvulkan1 mesa-vulkan-drivers libgl1-mesa-dri libxkbcommon-x11-0 \
             libxcursor1 libxi6\n\
             In the terminal the same job is done by: lobelia reconstruct {shown} --out DIR"
        ))
    })
}
