//! Carries out the actions of the studies.

use super::actions::Study;
use super::change::Change;
use super::changing;
use super::jobs::studies::{Kind, events};
use super::keys;
use super::panels::numbers;
use super::state::State;
use crate::study::settings::Setting;
use crate::study::speed::OWN;

pub fn apply(state: &mut State, what: Study) {
    let State { project, jobs, messages, .. } = state;
    let Some(project) = project else { return };
    let kind = match &what {
        Study::Speed(_) => Some(Kind::Speed),
        Study::Stability(_) => Some(Kind::Stability),
        _ => None,
    };
    if let Some(obstacle) = kind.and_then(|kind| jobs.studies.obstacle(project, kind)) {
        messages.notice(obstacle);
        return;
    }
    match what {
        Study::Look => jobs.studies.look_for_truth(project),
        Study::Speed(request) => {
            if let Err(problem) = jobs.studies.begin_speed(project, &request) {
                messages.error("The study cannot begin", problem);
            }
        }
        Study::Stability(request) => jobs.studies.begin_stability(project, &request),
        Study::Cancel(kind) => jobs.studies.cancel(kind),
        Study::Clear(kind) => jobs.studies.clear(kind),
        Study::Save(kind, folder) => events::save(state, kind, folder),
        Study::Use(setting) => use_setting(state, &setting),
    }
}

/// Sets the run's options as a setting has them; what no setting decides on stays.
fn use_setting(state: &mut State, setting: &str) {
    let (Some(project), Some(study)) = (&state.project, &state.jobs.studies.speed) else { return };
    let now = &project.edit().options;
    let options = match Setting::named(setting) {
        Some(named) => named.upon(now, now.general.seed).ok(),
        None => (setting == OWN).then(|| study.progress.edit.options.clone()),
    };
    let Some(options) = options else { return };
    if options == *now {
        state.messages.notice(format!("The options are those of \"{setting}\" already."));
        return;
    }
    let place = study.places.iter().find(|place| place.setting == setting);
    let took = place.map_or_else(String::new, |place| {
        format!(", which took {}", numbers::duration(place.seconds))
    });
    let change = Change::Options { name: format!("setting {setting}"), options: Box::new(options) };
    changing::change_project(state, &change);
    let notice = format!("Run options set to \"{setting}\"{took}. Ctrl+Z takes it back.");
    state.messages.notice(keys::named(&state.ctx, &notice));
}
