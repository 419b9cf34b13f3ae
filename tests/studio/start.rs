use std::process::Command;

use eframe::egui;
use egui_kittest::kittest::Queryable as _;

use crate::{Window, example};

#[test]
fn the_start_page_offers_what_there_is() {
    let mut window = Window::new();
    window.step();
    for label in ["Open capture…", "Open project…", "Open example", "Recent", "File", "Help"] {
        assert!(window.has(label), "{label}");
    }
    window.harness.run();
}

#[test]
fn a_wrong_path_gives_the_terminals_text_and_leaves_the_project() {
    let wrong = example().join("nowhere");
    let terminal = Command::new(env!("CARGO_BIN_EXE_lobelia")).arg("info").arg(&wrong).output();
    let printed = String::from_utf8(terminal.unwrap().stderr).unwrap();
    let text = printed.trim().strip_prefix("error: ").expect("an error").to_owned();

    let mut window = Window::with_example();
    window.menu("File", "Open capture…");
    window.write("Path", wrong.to_str().unwrap());
    window.click("Open");
    window.wait_for("This cannot be opened");
    assert!(window.has(&text), "the card says something else than: {text}");
    assert!(window.has("Photographs (6)"), "the open project is gone");
    window.click("Copy");
    window.click("Dismiss");
    assert!(!window.has("This cannot be opened"));
}

#[derive(Debug)]
struct Dropped(std::path::PathBuf);

impl egui::DroppedFile for Dropped {
    fn path(&self) -> &std::path::Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        std::fs::read(&self.0).map_err(|error| error.to_string())
    }
}

#[test]
fn a_damaged_capture_that_is_dropped_gives_the_terminals_text_and_leaves_the_project() {
    let folder = tempfile::tempdir().unwrap();
    let damaged = folder.path().join("damaged");
    std::fs::create_dir(&damaged).unwrap();
    std::fs::write(damaged.join("scene.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n").unwrap();
    std::fs::copy(example().join("transforms.json"), damaged.join("transforms.json")).unwrap();
    let terminal = Command::new(env!("CARGO_BIN_EXE_lobelia")).arg("info").arg(&damaged).output();
    let printed = String::from_utf8(terminal.unwrap().stderr).unwrap();
    let text = printed.trim().strip_prefix("error: ").expect("an error").to_owned();

    let mut window = Window::with_example();
    window.harness.input_mut().dropped_files.push(std::sync::Arc::new(Dropped(damaged)));
    window.wait_for("This cannot be opened");
    assert!(window.has(&text), "the card says something else than: {text}");
    assert!(window.has("Photographs (6)"), "the open project is gone");
}

#[test]
fn recent_captures_survive_their_files() {
    let home = tempfile::tempdir().unwrap();
    let mut window = Window::at(home.path(), Some(&example()));
    window.wait_for("Photographs (6)");
    drop(window);
    let settings = home.path().join("studio.json");
    let text = std::fs::read_to_string(&settings).unwrap();
    std::fs::write(&settings, text.replace("/corner", "/vanished")).unwrap();
    let mut window = Window::at(home.path(), None);
    window.wait_for("missing");
    assert!(window.has("vanished"));
    window.click("Take vanished off this list");
    assert!(!window.has("vanished"));
}

/// At the smallest window that is looked after, and larger text than is usual.
#[test]
fn no_entry_of_a_menu_is_out_of_reach() {
    let mut window = Window::with_example();
    for scale in ["Scale 100 %", "Scale 125 %", "Scale 150 %"] {
        window.submenu("View", "Size of text and controls", scale);
        let screen = window.harness.ctx.content_rect();
        for (menu, within, entries) in [
            ("File", None, ["Open capture…", "Export results…", "Quit"]),
            ("Edit", None, ["Undo", "Select all surfaces", "New material"]),
            ("View", None, ["Workspace Capture", "Panels", "Size of text and controls"]),
            ("View", Some("Panels"), ["Show outliner", "Show log", "Show stability"]),
            (
                "View",
                Some("Size of text and controls"),
                ["Scale 75 %", "Scale 125 %", "Scale 200 %"],
            ),
            ("Relight", None, ["Add area light", "Duplicate", "Render to files…"]),
            ("Help", None, ["Command palette…", "Keyboard shortcuts", "About"]),
        ] {
            window.click(menu);
            window.harness.run_steps(5);
            if let Some(within) = within {
                window.click(within);
                window.harness.run_steps(5);
            }
            for entry in entries {
                let found = window.harness.query_all_by_label_contains(entry).last();
                let place = found.unwrap_or_else(|| panic!("{menu} has no {entry}")).rect();
                assert!(screen.contains_rect(place), "{menu}, {entry}: {place} at {scale}");
            }
            window.key(egui::Modifiers::NONE, egui::Key::Escape);
            window.key(egui::Modifiers::NONE, egui::Key::Escape);
        }
    }
}

/// Twice the size of text leaves no room for all workspaces beside the menus: they are in one.
#[test]
fn workspaces_and_run_are_within_reach_at_twice_the_size() {
    let mut window = Window::with_example();
    assert!(window.has("Relight") && !window.has("Workspace: Capture"));
    window.submenu("View", "Size of text and controls", "Scale 200 %");
    let screen = window.harness.ctx.content_rect();
    window.click("Workspace: Capture");
    for tab in ["Model", "Capture", "Reconstruct", "Study"] {
        let place = window.node(tab).rect();
        assert!(screen.contains_rect(place), "{tab}: {place}");
    }
    window.click("Reconstruct");
    assert!(window.has("Workspace: Reconstruct"));
    let run = window.harness.query_all_by_label("Run");
    assert!(run.into_iter().any(|own| own.rect().right() > 0.9 * screen.right()), "the button");
    assert!(window.harness.query_all_by_label("Run").all(|own| screen.contains_rect(own.rect())));
}

/// What comes next is said, and done at a click.
#[test]
fn the_next_step_is_offered() {
    let mut window = Window::with_example();
    window.click("Next: check the materials (F2)");
    assert!(window.has("New material"), "the workspace for tagging");
    window.click("Next: run (Ctrl+R)");
    assert!(window.has("Cancel run"));
}

#[test]
fn the_palette_finds_and_does() {
    let mut window = Window::with_example();
    window.key(egui::Modifiers::COMMAND, egui::Key::P);
    window.harness.event(egui::Event::Text("light theme".into()));
    window.step();
    window.key(egui::Modifiers::NONE, egui::Key::Enter);
    assert!(!window.harness.ctx.global_style().visuals.dark_mode);
    window.harness.event(egui::Event::Text("?".into()));
    window.step();
    assert!(window.has("Keyboard shortcuts") && window.has("Run reconstruction"));
    window.harness.run();
}

#[test]
fn a_report_tells_what_was_used_and_what_happened() {
    lobelia::io::logfile::start(None, false);
    let mut window = Window::with_example();
    window.menu("File", "Open capture…");
    window.write("Path", "/nonexistent/capture");
    window.click("Open");
    window.wait_for("This cannot be opened");
    window.click("Dismiss");
    window.menu("Help", "Report a problem…");
    for part in [
        concat!("lobelia ", env!("CARGO_PKG_VERSION")),
        "Graphics adapter: ",
        "Capture: 6 photographs",
        "Options that differ from the defaults: none",
        "/nonexistent/capture",
    ] {
        assert!(window.has_part(part), "{part}");
    }
    window.click("Copy report");
    window.click("Close");
    assert!(!window.has_part("Graphics adapter: "));
}

#[test]
fn on_macos_texts_name_the_command_key() {
    // The fonts of the tests have no ⌘.
    let mut window = Window::new();
    window.harness.ctx.set_os(egui::os::OperatingSystem::Mac);
    window.step();
    window.node("Open capture…").hover();
    window.wait("the help of the button", |window| window.has_part("photographs (Cmd+O)"));
    window.click("Open example");
    window.wait_for("Photographs (6)");
    // The one that says what comes next.
    window.click("Reconstruct");
    window.wait_for("Next: run (Cmd+R)");
    window.menu("Help", "Keyboard shortcuts");
    window.wait_for("Snap to surfaces");
    // One letter is for one thing on the Model page and for another in the 3D view.
    assert!(window.has("Draw, on the Model page") && window.has("In the 3D view"));
    assert_eq!(window.labels("Ctrl"), [] as [String; 0]);
}
