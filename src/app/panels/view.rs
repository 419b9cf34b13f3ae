//! The 3D view as a panel: what is done with what happens in it.

use eframe::egui;

use super::context::Context;
use crate::app::actions::{Action, Charting, Masking, Mode, Select};
use crate::app::viewport::{Content, ViewportEvent};

pub type State = ();

pub fn show(ui: &mut egui::Ui, context: Context, (): &mut State) {
    let Context { project, viewport, jobs, actions, .. } = context;
    let charts = jobs.charts.wanted(project).clone();
    let content = Content { charts, relit: jobs.relit().cloned(), ..project.content() };
    let events = viewport.show(ui, &content);
    actions.extend(events.into_iter().map(action));
}

fn action(event: ViewportEvent) -> Action {
    Action::Select(match event {
        ViewportEvent::Moved { item, name, things } => {
            return Action::Transform(things.change(name, item));
        }
        ViewportEvent::Masked { photograph, shape, is_left_out } => {
            return Action::Masking(Masking::Draw { photograph, shape, is_left_out });
        }
        ViewportEvent::Cornered { photograph, corners_px } => {
            return Action::Charting(Charting::Corners { photograph, corners_px });
        }
        ViewportEvent::Kept => return Action::KeepTransform,
        ViewportEvent::LeftAsItWas => return Action::LeaveTransform,
        ViewportEvent::PickAdded(item) => Select::Added(item),
        ViewportEvent::PickSurface { surface: None, add: true } => {
            Select::Surfaces { surfaces: Default::default(), add: true }
        }
        ViewportEvent::PickSurface { surface: None, add: false } => Select::Nothing,
        ViewportEvent::PickSurface { surface: Some(surface), add } => {
            Select::Surface { surface, mode: if add { Mode::Toggle } else { Mode::Only } }
        }
        ViewportEvent::BoxSurfaces { surfaces, add } => Select::Surfaces { surfaces, add },
        ViewportEvent::PickSample(sample) => Select::Sample(sample),
        ViewportEvent::PickLight(light) => Select::Light(light),
        ViewportEvent::PickPhotograph(photograph) => Select::Photograph(photograph),
    })
}
