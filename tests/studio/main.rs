//! The window, driven by the labels of its controls, without a display: drawn off screen by
//! whatever adapter the machine has; a software one will do.
#![cfg(feature = "studio")]

mod blink; // the model's faces over the photograph
mod charts; // corners of cards and charts
mod display; // photographs of 8 bits
mod dropping; // files that are dropped, numbers that are typed
mod edges; // things fitted to the lines of photographs
mod finding; // cameras by engines that are scripts
mod frames; // what a frame takes in a large scene
mod gestures; // each movement of the hand is one step of undo
mod hand; // mouse and keys in the 3D view
mod importing; // the import page
mod lighting; // known light
mod masks; // what is left out of photographs
mod modelling; // the Model page: captures from photographs alone
mod numbers; // values, plots and the guide
mod nothing_lost; // what a project holds stays there
mod panels; // every panel, page and dialog beside its stored picture
mod points; // planes and boxes from points that are drawn around
mod projects; // save, reopen, recovery, a moved capture
mod pictures; // the window and the 3D view beside stored pictures
mod relighting; // lights and objects that are set into the scene
mod rendering; // pictures that are written
mod runs; // run to the end, cancel
mod snapping; // corners where two lines cross
mod start; // the start page, errors, the palette
mod studies; // speed and stability of the open capture
mod tagging; // materials, undo and redo
mod tones; // tone mapping in the 3D view
mod viewport; // the 3D view: what is drawn and named
mod walk; // many actions in a row beside a plain model of them

#[path = "../shared/box_of_points.rs"]
mod box_of_points;
#[path = "../shared/displaced.rs"]
mod displaced;
#[path = "../shared/drawn_chart.rs"]
mod drawn_chart;
#[path = "../shared/skip.rs"]
mod skip;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use eframe::egui;
use egui_kittest::kittest::{NodeT as _, Queryable};
use egui_kittest::{Harness, Node};
use lobelia::app::{Launch, Studio};

/// How long a frame is taken to last.
const FRAME: Duration = Duration::from_millis(33);

#[expect(clippy::disallowed_methods, reason = "a window draws frames at intervals")]
fn pause(time: Duration) {
    std::thread::sleep(time);
}

/// A window with settings in a folder of its own.
struct Window {
    harness: Harness<'static, Studio>,
    _folder: Option<tempfile::TempDir>,
}

fn example() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/examples/corner")
}

/// A folder that is dropped onto the window.
#[derive(Debug)]
struct Dropped(PathBuf);

impl egui::DroppedFile for Dropped {
    fn path(&self) -> &Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        Err("a folder has none".to_owned())
    }
}

impl Window {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut window = Self::at(folder.path(), None);
        window._folder = Some(folder);
        window
    }

    /// A window that starts with a path, its settings in a folder that outlives it.
    fn at(home: &Path, path: Option<&Path>) -> Self {
        let launch = Launch {
            path: path.map(Path::to_owned),
            home: Some(home.to_owned()),
            own_dialogs: true,
            began: None,
        };
        let harness = Harness::builder()
            .with_size([1280.0, 720.0])
            .with_step_dt(FRAME.as_secs_f32())
            .with_max_steps(60)
            .wgpu()
            .build_eframe(move |cc| Studio::new(cc, launch).expect("the window opens"));
        Self { harness, _folder: None }
    }

    /// A window with the example open.
    fn with_example() -> Self {
        let mut window = Self::new();
        window.step();
        window.click("Open example");
        window.wait_for("Photographs (6)");
        window
    }

    /// As long as a hand takes for one thing: some frames, and what is looked up on the disk.
    fn step(&mut self) {
        let limit = Instant::now() + Duration::from_secs(60);
        let mut quiet = 0;
        while quiet < 3 {
            assert!(Instant::now() < limit, "the disk does not answer");
            self.harness.run_steps(1);
            if self.harness.state().waits_for_disk() {
                quiet = 0;
                pause(Duration::from_millis(1));
            } else {
                quiet += 1;
            }
        }
    }

    fn has(&self, label: &str) -> bool {
        self.harness.query_all_by_label(label).next().is_some()
    }

    fn has_part(&self, part: &str) -> bool {
        self.harness.query_all_by_label_contains(part).next().is_some()
    }

    fn node<'a>(&'a self, label: &'a str) -> Node<'a> {
        let found = self.harness.query_all_by_label(label).next();
        found.unwrap_or_else(|| panic!("nothing is labelled \"{label}\""))
    }

    /// The labels that contain something, in the order of the window.
    fn labels(&self, part: &str) -> Vec<String> {
        let nodes = self.harness.query_all_by_label_contains(part);
        let text = |node: Node| {
            let node = node.accesskit_node();
            node.value().or(node.label())
        };
        nodes.filter_map(text).collect()
    }

    /// Clicks as a hand does: waits for what still moves.
    fn click(&mut self, label: &str) {
        for _ in 0..30 {
            let before = self.node(label).rect();
            self.harness.run_steps(1);
            if self.node(label).rect() == before {
                break;
            }
        }
        self.node(label).click();
        self.step();
    }

    /// Clicks the last of several with that label: a dialog's, in front of all else.
    fn click_front(&mut self, label: &str) {
        let found = self.harness.query_all_by_label(label).last();
        found.unwrap_or_else(|| panic!("nothing is labelled \"{label}\"")).click();
        self.step();
    }

    /// Clicks what is described on hover or contains the words.
    fn menu(&mut self, menu: &str, entry: &str) {
        self.click(menu);
        self.harness.run_steps(5);
        let found = self.harness.query_all_by_label_contains(entry).next();
        found.unwrap_or_else(|| panic!("the menu {menu} has no \"{entry}\"")).click();
        self.step();
    }

    /// The same of a menu within a menu.
    fn submenu(&mut self, menu: &str, within: &str, entry: &str) {
        self.menu(menu, within);
        self.harness.run_steps(5);
        let found = self.harness.query_all_by_label_contains(entry).next();
        found.unwrap_or_else(|| panic!("{within} has no \"{entry}\"")).click();
        self.step();
    }

    fn key(&mut self, modifiers: egui::Modifiers, key: egui::Key) {
        self.harness.key_press_modifiers(modifiers, key);
        self.step();
    }

    /// Steps until something with that label is there.
    fn wait_for(&mut self, label: &str) {
        self.wait(&format!("\"{label}\""), |window| window.has(label));
    }

    fn wait(&mut self, what: &str, done: impl Fn(&Self) -> bool) {
        let limit = Instant::now() + Duration::from_secs(300);
        while !done(self) {
            assert!(Instant::now() < limit, "{what} did not come");
            self.harness.run_steps(1);
            // As often as the screen is drawn: frames without a pause would take the processor from the
            // work that is waited for.
            pause(FRAME);
        }
        self.step();
    }

    /// Replaces the text of a field.
    fn write(&mut self, label: &str, text: &str) {
        self.node(label).focus();
        self.step();
        self.key(egui::Modifiers::COMMAND, egui::Key::A);
        self.node(label).type_text(text);
        self.step();
    }
}
