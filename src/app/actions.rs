//! Everything that a user can do. Panels only say what was asked for; one `match` does it, at the
//! end of the frame.

use std::collections::BTreeSet;
use std::path::PathBuf;

use super::change::Change;
use super::dialogs::{self, Palette, PathRequest};
use super::files;
use super::gesture::Gesture;
use super::import;
use super::jobs::studies::{Kind, SpeedRequest, StabilityRequest};
use super::layout::{Pane, Workspace};
use super::leaving::{AfterPrompt, leave, once_saved, proceed};
use super::lighting::{self, Lighting};
use super::masking::{self, Masking};
use super::modelling::begin::{self, NewAction};
use super::modelling::{self, ModelAction};
use super::picture_choices::PictureChoices;
use super::plots::{self, PlotFile, Plotted};
use super::project::{Project, Selection};
use super::relight::{Added, NewLight};
use super::relighting;
use super::report;
use super::scene_export::{self, ExportAction};
use super::selecting::select;
use super::state::State;
use super::studying;
use super::theme;
use super::viewport::Shading;

#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    Ask(PathRequest),
    Open(PathBuf),
    OpenExample,
    CancelOpening,
    /// Takes photographs for radiance by the curve of sRGB.
    TakeAsSrgb,
    Locate(PathBuf),
    Save,
    /// `replace` where another file of that name may go.
    SaveTo {
        file: PathBuf,
        replace: bool,
    },
    /// `replace` where results that are there may go.
    ExportTo {
        folder: PathBuf,
        replace: bool,
    },
    Close,
    Quit,
    /// The answer about unsaved work: save it first, or lose it.
    Unsaved {
        save: bool,
    },
    Recover(PathBuf),
    Discard(PathBuf),
    /// Offers what can be recovered at the next start again.
    NotNow(PathBuf),
    ForgetRecent(PathBuf),
    Undo,
    Redo,
    Change(Change),
    /// Moves something in the 3D view, until one of the next two ends that.
    Transform(Change),
    KeepTransform,
    LeaveTransform,
    /// Asks which material the selected surfaces shall have.
    AskMaterial,
    NewMaterialOfSelection,
    Select(Select),
    HideSelected,
    ShowAllSurfaces,
    Run,
    /// Runs although a study measures seconds; `afresh` as below.
    RunBesideStudy {
        afresh: bool,
    },
    /// Runs without taking anything over from earlier runs.
    RunAfresh,
    Cancel,
    /// Makes a photograph anew from the results.
    Compare(usize),
    /// Finds what the lights see of the photographed surfaces.
    Cover,
    Workspace(Workspace),
    ShowPane(Pane),
    ResetLayout,
    Theme(&'static str),
    Scale(f32),
    FrameAll,
    FrameSelection,
    LookThrough(Option<usize>),
    Relight(Relight),
    /// What is done about known lights.
    Lighting(Lighting),
    /// What is done about masks.
    Masking(Masking),
    Import(import::ImportAction),
    New(NewAction),
    Model(ModelAction),
    Study(Study),
    ExportScene(ExportAction),
    /// With `true` where a file of that name may go.
    SavePlot(Plotted, PlotFile, PathBuf, bool),
    ShowPalette,
    ShowShortcuts,
    ShowAbout,
    ShowGuide,
    ShowReport,
    Copy(String),
    DismissError(usize),
}

/// What is done about the relit scene.
#[derive(Clone, Debug, PartialEq)]
pub enum Relight {
    AddLight(NewLight),
    /// An OBJ mesh.
    AddObject(PathBuf),
    /// An image of light from all around.
    AddDome(PathBuf),
    Load(PathBuf),
    /// With `true` where a file of that name may go.
    Save(PathBuf, bool),
    /// Takes the selected light or object away.
    Remove,
    Duplicate,
    /// Puts the selected one on the surface below it.
    Drop,
    /// Points what could not be read of the project, by its index, at another file.
    Find(usize, PathBuf),
    /// Takes what could not be read out of the project.
    GiveUp(usize),
    /// Asks which pictures are made, and where to.
    AskPictures,
    /// The folder for them.
    PicturesFolder(PathBuf),
    Render(Box<PictureChoices>),
    StopRendering,
}

/// What is done about the studies.
#[derive(Clone, Debug, PartialEq)]
pub enum Study {
    /// Looks whether it is known what is true of the capture.
    Look,
    Speed(SpeedRequest),
    Stability(StabilityRequest),
    Cancel(Kind),
    /// Forgets what was found.
    Clear(Kind),
    Save(Kind, PathBuf),
    /// Sets the run's options as a setting of the study has them.
    Use(String),
}

/// What becomes selected.
#[derive(Clone, Debug, PartialEq)]
pub enum Select {
    Surface {
        surface: usize,
        mode: Mode,
    },
    /// From the anchor to a surface, of those that are in sight.
    Extend {
        to: usize,
        shown: BTreeSet<usize>,
    },
    Surfaces {
        surfaces: BTreeSet<usize>,
        add: bool,
    },
    AllSurfaces,
    Nothing,
    Material(usize),
    Sample(usize),
    /// The one that the results are furthest from.
    WorstSample,
    Light(usize),
    /// The one that the selected sample gets most light from.
    StrongestLight,
    Photograph(usize),
    Added(Added),
}

/// How a click changes a selection of several.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    Only,
    Toggle,
}

pub fn apply(state: &mut State, action: Action) {
    match action {
        Action::Ask(asked) => dialogs::ask_path(state, asked),
        Action::Open(path) => leave(state, AfterPrompt::Open(path)),
        Action::OpenExample => {
            if let Some(path) = state.example.clone() {
                leave(state, AfterPrompt::Open(path));
            }
        }
        Action::CancelOpening => state.jobs.cancel_opening(),
        Action::TakeAsSrgb => state.jobs.take_as_srgb(state.project.as_ref()),
        Action::Locate(folder) => files::located(state, &folder),
        Action::Save if state.is_modelling() => drop(modelling::save(state)),
        Action::Save => drop(files::save(state)),
        Action::SaveTo { file, replace } => {
            if files::save_to(state, &file, replace)
                && let Some(then) = state.dialogs.unsaved.take()
            {
                once_saved(state, then);
            }
        }
        Action::ExportTo { folder, replace } => {
            if let Some(project) = &state.project {
                let is_own = project.solution.as_ref() == Some(&folder);
                if !replace && !is_own && folder.join("solution.json").exists() {
                    state.dialogs.replace = Some((PathRequest::Export, folder));
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
            if !save {
                if let Some(then) = state.dialogs.unsaved.take() {
                    proceed(state, then);
                }
            } else if files::save_all(state)
                && let Some(then) = state.dialogs.unsaved.take()
            {
                once_saved(state, then);
            }
        }
        Action::Recover(file) => leave(state, AfterPrompt::Recover(file)),
        Action::NotNow(file) => files::not_now(state, &file),
        Action::Discard(file) => files::discard(state, &file),
        Action::ForgetRecent(path) => {
            state.settings.recent.retain(|other| *other != path);
            files::save_settings(state);
        }
        Action::Undo if state.is_modelling() => modelling::undo(state, true),
        Action::Redo if state.is_modelling() => modelling::undo(state, false),
        Action::Undo => tell(state, "Undone", |project| project.undo()),
        Action::Redo => tell(state, "Redone", |project| project.redo()),
        Action::Change(change) => follow_hand(state, &change),
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
                change_project(state, &Change::NewMaterial { surfaces });
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
            import::apply(state, import::ImportAction::Cancel)
        }
        Action::Cancel => {
            if let Some(project) = &mut state.project {
                state.jobs.cancel(project);
            }
        }
        Action::Workspace(workspace) => {
            state.layout.current = workspace;
            import::apply(state, import::ImportAction::Hide);
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
        Action::ShowPane(pane) => state.layout.show(pane),
        Action::ResetLayout => state.layout.reset(),
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
        Action::FrameAll if state.is_modelling() => modelling::apply(state, ModelAction::Fit),
        Action::FrameAll => state.viewport.frame_all(),
        Action::FrameSelection => state.viewport.frame_selection(),
        Action::LookThrough(photograph) => state.viewport.look_through(photograph),
        Action::Relight(Relight::Remove) if state.is_modelling() => {
            modelling::apply(state, ModelAction::Remove);
        }
        Action::Relight(Relight::Duplicate) if state.is_modelling() => {
            modelling::apply(state, ModelAction::Duplicate);
        }
        Action::New(what) => begin::apply(state, what),
        Action::Model(what) => modelling::apply(state, what),
        Action::Relight(what) => relighting::apply(state, what),
        Action::Lighting(what) => lighting::apply(state, what),
        Action::Import(what) => import::apply(state, what),
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

/// A change that a panel proposes: a step of its own, or part of what the hand is doing.
fn follow_hand(state: &mut State, change: &Change) {
    let gesture = state.hand.gesture().filter(|_| change.is_of_value_of(change));
    let (Some(gesture), Some(project)) = (gesture, &mut state.project) else {
        return change_project(state, change);
    };
    if let Err(problem) = project.preview(change, gesture) {
        state.messages.notice(problem);
    }
}

pub(super) fn change_project(state: &mut State, change: &Change) {
    let Some(project) = &mut state.project else { return };
    match project.change(change) {
        Ok(()) => {
            let materials = &project.edit().materials;
            let shown = match change {
                Change::NewMaterial { .. } => Some(materials.len() - 1),
                Change::Merge { from, into } => Some(into - usize::from(into > from)),
                _ => None,
            };
            if let Some(material) = shown {
                select(project, Select::Material(material));
            }
        }
        Err(problem) => state.messages.notice(problem),
    }
}

fn tell(state: &mut State, word: &str, step: impl FnOnce(&mut Project) -> Option<String>) {
    if let Some(name) = state.project.as_mut().and_then(step) {
        state.messages.notice(format!("{word}: {name}"));
    }
}
