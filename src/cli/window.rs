//! `lobelia` and `lobelia CAPTURE`: the window.

use std::path::PathBuf;

use anyhow::anyhow;

use crate::cli::Ending;

pub(super) fn run(path: Option<PathBuf>) -> Result<(), Ending> {
    let shown = path.as_ref().map_or("CAPTURE".to_owned(), |path| path.display().to_string());
    #[cfg(windows)]
    let is_without_console = leave_own_console();
    let opened = crate::app::open(path).map_err(|problem| explained(&problem, &shown));
    #[cfg(windows)]
    if is_without_console && let Err(problem) = &opened {
        let dialog = rfd::MessageDialog::new().set_level(rfd::MessageLevel::Error);
        dialog.set_title("Lobelia").set_description(problem).show();
    }
    opened.map_err(|problem| Ending::Failed(anyhow!(problem)))
}

/// Why the window cannot be opened, and what to do; `shown` is the capture that was to be opened.
fn explained(problem: &str, shown: &str) -> String {
    // The window library puts the place in its own source in front.
    let problem = problem
        .rsplit_once(".rs:")
        .map_or(problem, |(_, rest)| rest.split_once(": ").map_or(rest, |(_, reason)| reason));
    let needs = if cfg!(any(windows, target_os = "macos")) {
        "It needs a graphics driver with Vulkan, Metal, Direct3D 12 or OpenGL."
    } else {
        "It needs a screen (an X11 or Wayland session, which DISPLAY or WAYLAND_DISPLAY names) \
         and a graphics driver with Vulkan or OpenGL: your graphics card's, or Mesa's, which \
         draws without a card. On Debian and Ubuntu:\n  \
         sudo apt-get install libvulkan1 mesa-vulkan-drivers libgl1-mesa-dri libxkbcommon-x11-0 \
         libxcursor1 libxi6"
    };
    format!(
        "the window cannot be opened: {problem}\n{needs}\n\
         In the terminal the same job is done by: lobelia reconstruct {shown} --out DIR"
    )
}

/// Closes a console that Windows has opened for this program alone, as a double click does;
/// whether it did.
#[cfg(windows)]
fn leave_own_console() -> bool {
    use windows_sys::Win32::System::Console::{FreeConsole, GetConsoleProcessList};
    let mut processes = [0; 2];
    // SAFETY: as many numbers as are named can be written there.
    let count = unsafe { GetConsoleProcessList(processes.as_mut_ptr(), 2) };
    // SAFETY: takes nothing. The standard library takes a closed console for an output that
    // nobody reads.
    count == 1 && unsafe { FreeConsole() } != 0
}
