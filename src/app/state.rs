//! The whole state of the window.

use std::collections::{BTreeSet, VecDeque};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use eframe::{egui, egui_wgpu};

use super::Launch;
use super::actions::{Action, Outcome, Relight};
use super::dialogs::Dialogs;
use super::gesture::Hand;
use super::import::ImportPage;
use super::jobs::Jobs;
use super::layout::Layout;
use super::messages::Messages;
use super::modelling::ModelPage;
use super::opening::AfterPrompt;
use super::panels::state::PanelState;
use super::pending::Pending;
use super::probe::{Probe, Start};
use super::project::Project;
use super::theme;
use super::unsaved::{Kept, Saves, UnsavedWork};
use super::viewport::Viewport;
use super::workspaces::Workspace;
use super::writer::Writer;
use crate::io::engines::Search;
use crate::io::settings::{self, LeftBehind, Recovery, Settings};
use crate::options::OptionValue;
use crate::render::Engine;

pub struct State {
    pub ctx: egui::Context,
    pub project: Option<Project>,
    pub jobs: Jobs,
    pub messages: Messages,
    pub settings: Settings,
    /// The user's folder for settings; `None` where there is none.
    pub home: Option<PathBuf>,
    pub recovery: Option<Arc<Recovery>>,
    /// Unsaved work of windows that crashed.
    pub left_behind: Vec<LeftBehind>,
    /// Recent projects and captures that are not where they were, once that is known.
    pub missing: BTreeSet<PathBuf>,
    pub looking: Option<Pending<BTreeSet<PathBuf>>>,
    pub writer: Writer,
    /// Looks at the disk that are under way.
    pub errands: VecDeque<Pending<Vec<Outcome>>>,
    pub autosaved: Instant,
    /// What was last kept for recovery.
    pub kept: Option<Kept>,
    pub saves: Saves,
    pub dialogs: Dialogs,
    pub layout: Layout,
    pub panels: PanelState,
    pub viewport: Viewport,
    /// The import page, once it was asked for.
    pub import: Option<Box<ImportPage>>,
    /// The Model page of the open capture, once it was asked for.
    pub modelling: Option<Box<ModelPage>>,
    /// How its engines are looked for and run.
    pub engines: Search,
    pub render: egui_wgpu::RenderState,
    /// The shipped guide.
    pub guide: Option<PathBuf>,
    /// Its first page for a browser, where it was shipped as one.
    pub guide_html: Option<PathBuf>,
    pub example: Option<PathBuf>,
    /// The graphics adapter in use.
    pub adapter: String,
    pub probe: Probe,
    /// Until the capture that the window was started with is drawn.
    pub start: Option<Start>,
    pub hand: Hand,
    pub quitting: bool,
    /// What comes once the results are on the disk.
    pub after_storing: Option<AfterPrompt>,
    /// Whether a text field had the focus at the end of the frame before.
    pub was_typing: bool,
}

impl State {
    pub fn new(cc: &eframe::CreationContext<'_>, launch: Launch) -> Result<Self, String> {
        let driver = Instant::now();
        let ctx = &cc.egui_ctx;
        let render = cc.wgpu_render_state.as_ref().ok_or("no graphics adapter was found")?;
        let no_thread = |error| format!("no thread can be started: {error}");
        let mut jobs = Jobs::start(ctx).map_err(no_thread)?;
        let writer = Writer::start().map_err(no_thread)?;
        let settings = launch.home.as_deref().map(Settings::read).unwrap_or_default();
        theme::install(ctx);
        theme::apply(ctx, &settings.theme, settings.scale);
        jobs.set_engine(Engine::parse(&settings.engine).unwrap_or(Engine::Auto));
        let guide = ["SUMMARY.md", "index.html"]
            .into_iter()
            .find_map(|file| shipped(["assets", "share/doc/lobelia"], "guide", file));
        let mut layout = Layout::default();
        layout.restore(&settings.layout);
        let left_behind = launch.home.as_deref().map(settings::left_behind).unwrap_or_default();
        // Without a place to keep it, unsaved work is not kept; all else works.
        let recovery = launch.home.as_deref().and_then(|home| Recovery::claim(home).ok());
        let recovery = recovery.map(Arc::new);
        Ok(Self {
            ctx: ctx.clone(),
            project: None,
            jobs,
            messages: Messages::default(),
            settings,
            home: launch.home,
            recovery,
            left_behind,
            missing: BTreeSet::new(),
            looking: None,
            writer,
            errands: VecDeque::new(),
            autosaved: Instant::now(),
            kept: None,
            saves: Saves::default(),
            dialogs: Dialogs { own_only: true, ..Dialogs::default() },
            layout,
            panels: PanelState::default(),
            viewport: Viewport::new(render),
            import: None,
            modelling: None,
            engines: Search::default(),
            render: render.clone(),
            example: shipped(["assets", "share/lobelia"], "examples/corner", "scene.obj"),
            guide_html: guide
                .as_ref()
                .map(|folder| folder.join("index.html"))
                .filter(|html| html.is_file()),
            guide,
            adapter: adapter(render),
            probe: Probe::default(),
            start: launch
                .began
                .filter(|_| launch.path.is_some())
                .map(|began| Start::new(began, driver)),
            hand: Hand::default(),
            quitting: false,
            after_storing: None,
            was_typing: false,
        })
    }

    /// Takes note of the window's size, for the next start.
    pub fn remember_window(&mut self) {
        let scale = self.ctx.zoom_factor();
        let (size, is_maximized) = self.ctx.input(|input| {
            let own = input.viewport();
            (own.inner_rect.map(|rect| rect.size() * scale), own.maximized.unwrap_or(false))
        });
        self.settings.is_maximized = is_maximized;
        // A window that fills the screen keeps the size that it had before.
        if let Some(size) = size.filter(|_| !is_maximized) {
            self.settings.window = Some([size.x, size.y]);
        }
    }

    pub fn obstacle_to_run(&self) -> Option<&'static str> {
        match &self.project {
            None => Some("Open a capture first."),
            Some(project) => project.obstacle(),
        }
    }

    /// What leaving the project would lose, or, with `quitting`, ending the program.
    pub fn unsaved_work(&self, quitting: bool) -> UnsavedWork {
        let page = self.modelling.as_ref().filter(|page| page.is_changed());
        let model = page.and_then(|page| page.model().cloned());
        let Some(project) = &self.project else {
            return UnsavedWork { model, ..UnsavedWork::default() };
        };
        UnsavedWork {
            edit: project.is_changed().then(|| project.edit().clone()),
            run: project.run.as_ref().map(|run| run.job),
            results: project.unsaved_results().cloned(),
            // An export outlives its project, but not the program.
            export: self.jobs.exporting().filter(|_| quitting),
            study: self.jobs.studies.at_stake(),
            model,
        }
    }

    /// What comes next on the way from a capture to pictures, and how to do it.
    pub fn next_step(&self) -> Option<(&'static str, Action)> {
        let project = self.project.as_ref()?;
        let at = self.layout.current;
        let go = |text, workspace| Some((text, Action::Workspace(workspace)));
        if project.capture.materials.is_empty() && at != Workspace::Tag {
            return go("Next: give surfaces materials (F2)", Workspace::Tag);
        }
        if project.obstacle().is_some() {
            return None;
        }
        if project.products.solved.is_none() {
            return match at {
                Workspace::Capture => go("Next: check the materials (F2)", Workspace::Tag),
                _ => Some(("Next: run (Ctrl+R)", Action::Run)),
            };
        }
        if project.is_outdated() {
            return Some(("Changed since the run: run again (Ctrl+R)", Action::Run));
        }
        match at {
            Workspace::Capture | Workspace::Tag | Workspace::Reconstruct => {
                go("Next: look at the results (F4)", Workspace::Inspect)
            }
            Workspace::Inspect => go("Next: relight (F5)", Workspace::Relight),
            Workspace::Relight => {
                Some(("Next: render pictures (F12)", Action::Relight(Relight::AskPictures)))
            }
            Workspace::Study => None,
        }
    }

    /// Whether the import page is on the screen.
    pub fn is_importing(&self) -> bool {
        self.import.as_ref().is_some_and(|page| page.is_shown)
    }

    /// Whether the Model page is on the screen.
    pub fn is_modelling(&self) -> bool {
        !self.is_importing() && self.modelling.as_ref().is_some_and(|page| page.is_shown)
    }

    pub fn is_running(&self) -> bool {
        self.project.as_ref().is_some_and(|project| project.run.is_some())
    }
}

fn adapter(render: &eframe::egui_wgpu::RenderState) -> String {
    let info = render.adapter.get_info();
    format!("{} ({:?})", info.name, info.backend)
}

/// A shipped folder that has a file, beside the program as it is installed or where it was built.
fn shipped(places: [&str; 2], name: &str, file: &str) -> Option<PathBuf> {
    let program = std::env::current_exe().unwrap_or_default();
    let near_program = program.ancestors().skip(1).take(4).map(PathBuf::from);
    let current = std::env::current_dir().into_iter();
    current
        .chain(near_program)
        .flat_map(|base| places.map(|place| base.join(place).join(name)))
        .find(|folder| folder.join(file).is_file())
}
