//! Carries out actions: one `match` at the end of the frame over everything that a user can do. It
//! alone imports every file that carries something out.

use super::actions::{Action, ImportAction, ModelAction, PathRequest, Relight};
use super::asking;
use super::change::Change;
use super::changing;
use super::charting;
use super::dialogs::Palette;
use super::files;
use super::gesture::Gesture;
use super::import;
use super::jobs::studies::Kind;
use super::keeping;
use super::leaving::{leave, proceed};
use super::lighting;
use super::masking;
use super::modelling::{self, begin};
use super::opening::AfterPrompt;
use super::plots;
use super::project::Selection;
use super::relighting;
use super::report;
use super::saving;
use super::scene_export;
use super::selecting::select;
use super::state::State;
use super::studying;
use super::theme;
use super::viewport::Shading;
use super::workspaces::Workspace;
use crate::options::OptionValue;

pub fn apply(state: &mut State, action: Action) {
    match action {
        Action::Ask(asked) => asking::ask_path(state, asked),
        Action::Open(path) => leave(state, AfterPrompt::Open(path)),
        Action::OpenExample => {
            if let Some(path) = state.example.clone() {
                leave(state, AfterPrompt::Open(path));
            }
        }
        Action::CancelOpening => state.jobs.cancel_opening(),
        Action::TakeAsSrgb => state.jobs.take_as_srgb(state.project.as_ref()),
        Action::Locate(folder) => files::located(state, &folder),
        Action::Save => saving::save(state),
        Action::SaveTo { file, replace } => saving::save_where_asked(state, &file, replace),
        Action::ExportTo { folder, replace } => {
            if let Some(project) = &state.project {
                let is_own = project.solution.as_ref() == Some(&folder);
                if !replace && !is_own {
                    let results = folder.join("solution.json");
                    asking::ask_before_replacing(state, PathRequest::Export, folder, results);
                } else {
                    state.jobs.export(project, folder);
                }
            }
        }
        Action::Compare(photograph) => {
            if let Some(project) = &state.project {
                state.jobs.compare(project, photograph);
            }
        }
        Action::Cover => {
            if let Some(project) = &state.project {
                state.jobs.cover(project);
            }
        }
        Action::Close => leave(state, AfterPrompt::Close),
        Action::Quit => leave(state, AfterPrompt::Quit),
        Action::Unsaved { save } => {
            if save {
                saving::save_and_leave(state);
            } else if let Some(then) = state.dialogs.unsaved.take() {
                proceed(state, then);
            }
        }
        Action::Recover(file) => leave(state, AfterPrompt::Recover(file)),
        Action::NotNow(file) => keeping::not_now(state, &file),
        Action::Discard(file) => keeping::discard(state, &file),
        Action::ForgetRecent(path) => {
            state.settings.recent.retain(|other| *other != path);
            files::save_settings(state);
        }
        Action::Undo if state.is_modelling() => modelling::acting::undo(state, true),
        Action::Redo if state.is_modelling() => modelling::acting::undo(state, false),
        Action::Undo => changing::tell(state, "Undone", |project| project.undo()),
        Action::Redo => changing::tell(state, "Redone", |project| project.redo()),
        Action::Change(change) => changing::follow_hand(state, &change),
        Action::Transform(change) => {
            if let Some(Err(problem)) =
                state.project.as_mut().map(|own| own.preview(&change, Gesture::Transform))
            {
                state.messages.notice(problem);
            }
        }
        Action::KeepTransform => {
            if let Some(project) = &mut state.project {
                project.commit();
            }
        }
        Action::LeaveTransform => {
            if let Some(project) = &mut state.project {
                project.cancel_gesture();
            }
        }
        Action::AskMaterial => {
            let selected = state.project.as_ref().map(|project| &project.selection.surfaces);
            match selected {
                Some(surfaces) if !surfaces.is_empty() => state.dialogs.assign = true,
                _ => state.messages.notice("Select surfaces first."),
            }
        }
        Action::NewMaterialOfSelection => {
            let surfaces = state.project.as_ref().map(|project| project.selection.surfaces.clone());
            if let Some(surfaces) = surfaces {
                changing::change_project(state, &Change::NewMaterial { surfaces });
            }
        }
        Action::Select(what) => {
            if let Some(project) = &mut state.project {
                state.panels.follow(&what);
                select(project, what);
            }
        }
        Action::HideSelected => {
            if let Some(project) = &mut state.project {
                let Selection { surfaces, hidden, .. } = &mut project.selection;
                hidden.append(surfaces);
            }
        }
        Action::ShowAllSurfaces => {
            if let Some(project) = &mut state.project {
                project.selection.hidden.clear();
            }
        }
        Action::Run => ask_run(state, false),
        Action::RunAfresh => ask_run(state, true),
        Action::RunBesideStudy { afresh } => run(state, afresh),
        Action::ExportScene(what) => scene_export::apply(state, what),
        Action::Cancel if state.is_importing() => {
            import::acting::apply(state, ImportAction::Cancel)
        }
        Action::Cancel => {
            if let Some(project) = &mut state.project {
                state.jobs.cancel(project);
            }
        }
        Action::Workspace(workspace) => {
            state.layout.current = workspace;
            import::acting::apply(state, ImportAction::Hide);
            if let Some(page) = state.modelling.as_mut().filter(|_| state.project.is_some()) {
                page.is_shown = false;
            }
            let has_results =
                state.project.as_ref().is_some_and(|project| project.products.solved.is_some());
            if workspace == Workspace::Relight && has_results {
                state.viewport.settings.shading = Shading::Relit;
            }
        }
        Action::Masking(what) => masking::apply(state, what),
        Action::Charting(what) => charting::apply(state, what),
        Action::ShowPane(pane) => state.layout.show(pane),
        Action::ResetLayout => state.layout.reset(),
        Action::TraceOn(engine) => {
            state.settings.engine = engine.text();
            state.jobs.set_engine(engine);
            files::save_settings(state);
        }
        Action::Theme(theme) => {
            theme.clone_into(&mut state.settings.theme);
            theme::apply(&state.ctx, theme, state.settings.scale);
            files::save_settings(state);
        }
        Action::Scale(scale) => {
            state.settings.scale = scale.clamp(0.75, 2.0);
            theme::apply(&state.ctx, &state.settings.theme, state.settings.scale);
            files::save_settings(state);
        }
        Action::FrameAll if state.is_modelling() => {
            modelling::acting::apply(state, ModelAction::Fit)
        }
        Action::FrameAll => state.viewport.frame_all(),
        Action::FrameSelection => state.viewport.frame_selection(),
        Action::LookThrough(photograph) => state.viewport.look_through(photograph),
        Action::Relight(Relight::Remove) if state.is_modelling() => {
            modelling::acting::apply(state, ModelAction::Remove);
        }
        Action::Relight(Relight::Duplicate) if state.is_modelling() => {
            modelling::acting::apply(state, ModelAction::Duplicate);
        }
        Action::New(what) => begin::apply(state, what),
        Action::Model(what) => modelling::acting::apply(state, what),
        Action::Relight(what) => relighting::apply(state, what),
        Action::Lighting(what) => lighting::apply(state, what),
        Action::Import(what) => import::acting::apply(state, what),
        Action::Study(what) => studying::apply(state, what),
        Action::SavePlot(of, kind, path, replace) => plots::save(state, of, kind, path, replace),
        Action::ShowPalette => state.dialogs.palette = Some(Palette::default()),
        Action::ShowShortcuts => state.dialogs.shortcuts = true,
        Action::ShowGuide => drop(state.dialogs.guide.get_or_insert_default()),
        Action::ShowAbout => state.dialogs.about = true,
        Action::ShowReport => state.dialogs.report = Some(report::of(state)),
        Action::Copy(text) => state.ctx.copy_text(text),
        Action::DismissError(index) => {
            if index < state.messages.errors.len() {
                state.messages.errors.remove(index);
            }
        }
    }
}

/// A run beside a study of speed makes the seconds longer that it measures.
fn ask_run(state: &mut State, afresh: bool) {
    let studied = state.jobs.studies.running().map(|(kind, _)| kind);
    if studied == Some(Kind::Speed) && state.obstacle_to_run().is_none() {
        state.dialogs.run_beside_study = Some(afresh);
    } else {
        run(state, afresh);
    }
}

fn run(state: &mut State, afresh: bool) {
    if let Some(obstacle) = state.obstacle_to_run() {
        state.messages.notice(obstacle);
    } else if let Some(project) = &mut state.project {
        state.probe.restart();
        state.jobs.run(project, afresh);
    }
}
