//! Everything that a user can do. Panels only say what was asked for; one `match` does it, at the
//! end of the frame.

use std::collections::BTreeSet;
use std::path::PathBuf;

use super::change::Change;
use super::derived;
use super::dialogs::{self, Palette, PathRequest};
use super::files;
use super::import;
use super::jobs::studies::{Kind, SpeedRequest, StabilityRequest};
use super::layout::{Pane, Workspace};
use super::leaving::{AfterPrompt, leave, once_saved, proceed};
use super::project::{Focus, Project, Selection};
use super::relight::{Added, NewLight};
use super::relighting;
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
    /// Asks which material the selected surfaces shall have.
    AskMaterial,
    NewMaterialOfSelection,
    Select(Select),
    HideSelected,
    ShowAllSurfaces,
    Run,
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
    Import(import::ImportAction),
    Study(Study),
    ShowPalette,
    ShowShortcuts,
    ShowAbout,
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
    /// Makes pictures from all photographs' places, into a folder.
    Render(PathBuf),
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
        Action::Locate(folder) => files::located(state, &folder),
        Action::Save => {
            files::save(state);
        }
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
            } else if files::save(state)
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
        Action::Undo => tell(state, "Undone", |project| project.undo()),
        Action::Redo => tell(state, "Redone", |project| project.redo()),
        Action::Change(change) => change_project(state, &change),
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
        Action::Run => run(state, false),
        Action::RunAfresh => run(state, true),
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
            let has_results =
                state.project.as_ref().is_some_and(|project| project.products.solved.is_some());
            if workspace == Workspace::Relight && has_results {
                state.viewport.settings.shading = Shading::Relit;
            }
        }
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
        Action::FrameAll => state.viewport.frame_all(),
        Action::FrameSelection => state.viewport.frame_selection(),
        Action::LookThrough(photograph) => state.viewport.look_through(photograph),
        Action::Relight(what) => relighting::apply(state, what),
        Action::Import(what) => import::apply(state, what),
        Action::Study(what) => studying::apply(state, what),
        Action::ShowPalette => state.dialogs.palette = Some(Palette::default()),
        Action::ShowShortcuts => state.dialogs.shortcuts = true,
        Action::ShowAbout => state.dialogs.about = true,
        Action::Copy(text) => state.ctx.copy_text(text),
        Action::DismissError(index) => {
            if index < state.messages.errors.len() {
                state.messages.errors.remove(index);
            }
        }
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

pub(super) fn select(project: &mut Project, what: Select) {
    let count = project.loaded.surfaces.len();
    let selection = &mut project.selection;
    selection.focus = match what {
        Select::Surface { surface, mode } => {
            match mode {
                Mode::Toggle => {
                    if !selection.surfaces.remove(&surface) {
                        selection.surfaces.insert(surface);
                    }
                }
                Mode::Only => selection.surfaces = BTreeSet::from([surface]),
            }
            selection.anchor = Some(surface);
            Focus::Surfaces
        }
        Select::Extend { to, shown } => {
            let anchor = *selection.anchor.get_or_insert(to);
            let range = shown.range(anchor.min(to)..=anchor.max(to));
            let Selection { surfaces, hidden, .. } = selection;
            surfaces.extend(range.filter(|surface| !hidden.contains(surface)));
            Focus::Surfaces
        }
        Select::Surfaces { surfaces, add } => {
            if !add {
                selection.surfaces.clear();
            }
            selection.anchor = surfaces.first().copied();
            selection.surfaces.extend(surfaces);
            Focus::Surfaces
        }
        Select::AllSurfaces => {
            selection.surfaces = (0..count).filter(|s| !selection.hidden.contains(s)).collect();
            Focus::Surfaces
        }
        Select::Nothing => {
            let hidden = std::mem::take(&mut selection.hidden);
            *selection = Selection { hidden, ..Selection::default() };
            Focus::Nothing
        }
        Select::Material(material) => {
            selection.material = Some(material);
            Focus::Material
        }
        Select::Sample(sample) => {
            selection.sample = Some(sample);
            Focus::Sample
        }
        Select::WorstSample => {
            let derived = project.products.derived.as_ref();
            selection.sample = derived.and_then(|derived| derived.worst()).or(selection.sample);
            Focus::Sample
        }
        Select::Light(light) => {
            selection.light = Some(light);
            Focus::Light
        }
        Select::StrongestLight => {
            let lit = project.products.whole.as_deref().zip(selection.sample);
            let lights = lit.map(|(whole, sample)| derived::irradiance_of(whole, sample).1);
            let Some(&(light, _)) = lights.as_ref().and_then(|lights| lights.first()) else {
                return;
            };
            selection.light = Some(light);
            Focus::Light
        }
        Select::Photograph(photograph) => {
            selection.photograph = Some(photograph);
            Focus::Photograph
        }
        Select::Added(item) => {
            selection.added = Some(item);
            Focus::Added
        }
    };
}
