//! The steps of one frame of the window, in their order.

use std::time::Instant;

use eframe::egui;

use super::actions::Action;
use super::gesture::Gesture;
use super::paced::Paced;
use super::pending::Pending;
use super::state::State;
use super::{
    Launch, asking, charting, commands, dispatch, dropping, entry, errands, file_dialog, files,
    import, jobs, keeping, modelling, panels, saving,
};
use crate::io::engines::Search;

/// The window.
pub struct Studio {
    state: State,
    input: Paced,
}

impl Studio {
    pub fn new(cc: &eframe::CreationContext<'_>, launch: Launch) -> Result<Self, String> {
        let path = launch.path.clone();
        let own_dialogs = launch.own_dialogs;
        let mut state = State::new(cc, launch)?;
        if !own_dialogs {
            let look = Pending::start("file dialogs", &state.ctx, file_dialog::exist);
            state.dialogs.looking_for_system = Some(look);
        }
        // A button that is held for long and then released was clicked: on a busy machine a quick click
        // takes as long.
        let forever = |options: &mut egui::Options| {
            options.input_options.max_click_duration = f64::INFINITY;
        };
        state.ctx.options_mut(forever);
        files::look_for_recent(&mut state);
        if let Some(path) = path {
            files::open_unprompted(&mut state, &path);
        }
        Ok(Self { state, input: Paced::default() })
    }

    /// Keeps unsaved work for recovery now rather than at the next half minute.
    pub fn autosave(&mut self) {
        keeping::autosave_now(&mut self.state);
    }

    /// How engines that find cameras are looked for and run.
    pub fn find_cameras_by(&mut self, search: Search) {
        if let Some(page) = &mut self.state.modelling {
            page.finding = modelling::finding::Finding::new(search.clone());
        }
        self.state.engines = search;
    }

    /// Whether the capture is drawn with all that its photographs show.
    pub fn is_drawn(&self) -> bool {
        self.state.viewport.is_ready()
    }

    /// Whether files are looked for, or saved.
    pub fn waits_for_disk(&self) -> bool {
        self.state.saves.are_under_way()
            || !self.state.errands.is_empty()
            || self.state.jobs.looking_into.is_some()
    }

    /// Whether a job of any kind is under way.
    pub fn is_busy(&self) -> bool {
        let page = self.state.import.as_ref();
        self.state.jobs.is_busy()
            || self.state.is_running()
            || self.waits_for_disk()
            || page.is_some_and(|page| page.is_busy() || page.is_checking())
            || self.state.modelling.as_ref().is_some_and(|page| page.is_busy())
    }
}

impl eframe::App for Studio {
    /// Keys and clicks are done one after the other, however many a slow frame has let come.
    fn raw_input_hook(&mut self, ctx: &egui::Context, input: &mut egui::RawInput) {
        if self.input.take(input, ctx.text_edit_focused()) {
            ctx.request_repaint();
        }
    }

    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut eframe::Frame) {
        let began = Instant::now();
        let state = &mut self.state;
        let ctx = ui.ctx().clone();
        let mut actions = Vec::new();

        let is_drawn = [state.viewport.has_geometry(), state.viewport.is_ready()];
        if let Some(report) = state.start.as_mut().and_then(|s| s.report(is_drawn[0], is_drawn[1]))
        {
            state.start = None;
            state.messages.info(report);
        }
        state.hand.look(&ctx);
        jobs::events::drain(state);
        import::follow::follow(state);
        modelling::follow::follow(state);
        asking::poll(state, &mut actions);
        keeping::autosave(state);
        files::found_recent(state);
        files::follow_reading(state);
        saving::follow(state);
        charting::follow(state);
        errands::follow(state, &mut actions);
        dropping::take(&ctx, state);
        // What is being typed comes before what is then done with it.
        let mut last = Vec::new();
        close_requested(&ctx, state, &mut last);
        commands::pressed(&ctx, state, &mut last);

        panels::menu::menu_ui(ui, state, &mut actions);
        panels::status::status_ui(ui, state, &mut actions);
        if let Some(page) = state.import.as_mut().filter(|page| page.is_shown) {
            panels::import::import_ui(ui, page, &mut actions);
        } else if let Some(page) = state.modelling.as_mut().filter(|page| page.is_shown) {
            panels::modelling::model_ui(ui, page, state.project.as_ref(), &mut actions);
        } else if state.project.is_some() {
            panels::workspace_ui(ui, state, &mut actions);
        } else {
            panels::start::start_ui(ui, state, &mut actions);
        }
        panels::cards::cards_ui(&ctx, state, &mut actions);
        panels::questions::questions_ui(&ctx, state, &mut actions);
        panels::palette::palette_ui(&ctx, state, &mut actions);

        if let Some(problem) = entry::problem(&ctx) {
            state.messages.notice(problem);
        }
        for action in actions.into_iter().chain(last) {
            dispatch::apply(state, action);
        }
        file_dialog::open_wanted(state, frame);
        end_gesture(state);
        modelling::follow::end_gesture(state);
        let edits = state.project.as_ref().map(|project| &project.edit().relight);
        let request = edits.and_then(|edits| state.viewport.request(edits));
        state.jobs.relight(state.project.as_ref(), request);
        state.was_typing = ctx.text_edit_focused();
        title(&ctx, state);
        if let Some(soon) = state.messages.expire() {
            ctx.request_repaint_after(soon);
        }
        if state.start.is_some() && state.viewport.is_ready() {
            // The report waits for the frame after.
            ctx.request_repaint();
        }
        state.probe.add(began.elapsed());
    }
}

/// A gesture that has ended is a step of undo; Escape takes it back.
fn end_gesture(state: &mut State) {
    let Some(project) = &mut state.project else { return };
    match project.gesture() {
        // The 3D view says itself how it ends.
        Some(Gesture::Transform) if state.viewport.is_moving() => {}
        Some(gesture) if gesture != Gesture::Transform && state.hand.escaped() => {
            project.cancel_gesture();
        }
        Some(Gesture::Press(_) | Gesture::Typing(_))
            if project.gesture().is_some_and(|own| !state.hand.ends(own)) => {}
        _ => project.commit(),
    }
}

/// The window's own close button asks about unsaved work too.
fn close_requested(ctx: &egui::Context, state: &State, actions: &mut Vec<Action>) {
    if ctx.input(|input| input.viewport().close_requested()) && !state.quitting {
        ctx.send_viewport_cmd(egui::ViewportCommand::CancelClose);
        commands::end_typing(ctx);
        actions.push(Action::Quit);
    }
}

fn title(ctx: &egui::Context, state: &mut State) {
    let page = state.modelling.as_ref();
    let is_drawn_on = page.is_some_and(|page| page.is_changed());
    let title = match &state.project {
        Some(project) => {
            let is_kept = !project.is_changed() && project.unsaved_results().is_none();
            let is_saved = is_kept && !is_drawn_on;
            let mark = if is_saved { "" } else { "*" };
            format!("{mark}{} - Lobelia", project.name())
        }
        None => match page {
            Some(page) => {
                let mark = if is_drawn_on { "*" } else { "" };
                format!("{mark}{} - Lobelia", crate::io::capture::name(&page.folder))
            }
            None => "Lobelia".to_owned(),
        },
    };
    if title != state.panels.title {
        ctx.send_viewport_cmd(egui::ViewportCommand::Title(title.clone()));
        state.panels.title = title;
    }
}
