//! Masks: the tools that draw them, and the list of photographs that have one.

use std::sync::Arc;

use eframe::egui::{self, Button, DragValue};

use super::context::Context;
use super::numbers::cut;
use super::table::{Head, Rows, TableState, head, table_ui};
use crate::app::actions::{Action, Masking as Do, Select};
use crate::app::entry::{self, Unit};
use crate::app::jobs::Jobs;
use crate::app::project::Project;
use crate::app::viewport::{MASK_RADII, MaskTool, Viewport};
use crate::scene::{Capture, Image};

const HEADS: [Head; 3] = [
    head("Photograph", 180.0, "Click to look through it"),
    head("Masked", 70.0, "The part of the photograph that is left out"),
    head("From", 110.0, "Whether the mask is the capture's own, or was changed in this window"),
];

#[derive(Default)]
pub struct State {
    table: TableState,
    /// The part of each photograph that is masked, and of which capture.
    shares: Vec<Option<(Arc<Image>, f64)>>,
    of: Option<Arc<Capture>>,
}

impl State {
    fn follow(&mut self, capture: &Arc<Capture>) {
        if self.of.as_ref().is_some_and(|of| Arc::ptr_eq(of, capture)) {
            return;
        }
        let before = std::mem::take(&mut self.shares);
        let share = |(index, image): (usize, &Option<Arc<Image>>)| {
            let image = image.as_ref()?;
            let same = before.get(index).and_then(Option::as_ref);
            let known = same.filter(|(of, _)| Arc::ptr_eq(of, image)).map(|(_, share)| *share);
            let counted =
                || image.masked_count() as f64 / (image.width() * image.height()).max(1) as f64;
            Some((image.clone(), known.unwrap_or_else(counted)))
        };
        let images: Vec<Option<Arc<Image>>> =
            capture.photographs.iter().map(|own| own.image.clone()).collect();
        self.shares = images.iter().enumerate().map(share).collect();
        self.of = Some(capture.clone());
    }
}

pub fn show(ui: &mut egui::Ui, context: Context, state: &mut State) {
    let Context { project, viewport: view, jobs, actions, .. } = context;
    state.follow(&project.capture);
    ui.horizontal_wrapped(|ui| tools_ui(ui, project, view, actions));
    ui.horizontal_wrapped(|ui| suggest_ui(ui, project, jobs, actions));
    ui.separator();
    let photographs = &project.capture.photographs;
    let masks = &project.edit().masks;
    let share = |index: usize| state.shares[index].as_ref().map(|(_, share)| *share);
    let from = |index: usize| match share(index) {
        None => "no radiance",
        Some(_) if masks.contains_key(&photographs[index].name) => "this window",
        Some(share) if share > 0.0 => "the capture",
        Some(_) => "",
    };
    let compare = |column: usize, a: usize, b: usize| match column {
        1 => share(a).unwrap_or(-1.0).total_cmp(&share(b).unwrap_or(-1.0)),
        2 => from(a).cmp(from(b)),
        _ => a.cmp(&b),
    };
    let rows = Rows {
        identity: Arc::as_ptr(&project.capture) as usize,
        count: photographs.len(),
        selected: view.is_looking_through().or(project.selection.photograph),
        compare: &compare,
    };
    let clicked =
        table_ui(ui, "masks", &mut state.table, &HEADS, &rows, |ui, index, column| match column {
            0 => {
                cut(ui, &photographs[index].name);
            }
            1 => {
                let text = share(index)
                    .map_or_else(String::new, |share| format!("{:.1} %", 100.0 * share));
                ui.label(text);
            }
            _ => {
                ui.label(from(index));
            }
        });
    if let Some(photograph) = clicked {
        actions.push(Action::Select(Select::Photograph(photograph)));
        actions.push(Action::LookThrough(Some(photograph)));
    }
}

fn tools_ui(ui: &mut egui::Ui, project: &Project, view: &mut Viewport, actions: &mut Vec<Action>) {
    for tool in MaskTool::ALL {
        let is_own = view.masking.tool == Some(tool);
        let response = ui.selectable_label(is_own, tool.name()).on_hover_text(tool.help());
        if response.clicked() {
            let tool = (!is_own).then_some(tool);
            actions.push(Action::Masking(Do::Tool(tool)));
        }
    }
    ui.separator();
    let field = DragValue::new(&mut view.masking.radius_px)
        .speed(0.2)
        .range(MASK_RADII)
        .max_decimals(1)
        .suffix(" px");
    entry::number(ui, field, Unit::Plain)
        .accessible_name("Brush radius")
        .on_hover_text("Radius of the brush in pixels of the photograph; [ and ] over the 3D view");
    ui.checkbox(&mut view.masking.erases, "Erase")
        .on_hover_text("The tools keep pixels instead of leaving them out; Alt does the other");
    ui.separator();
    let shown = view.is_looking_through().or(project.selection.photograph);
    let has_image = |index: usize| {
        project.capture.photographs.get(index).is_some_and(|own| own.image.is_some())
    };
    let is_meant = shown.is_some_and(has_image);
    for (name, help, what) in [
        ("Clear", "Unmask all pixels of the photograph in view", Do::Clear),
        ("Invert", "Exchange pixels that are kept and pixels that are left out", Do::Invert),
    ] {
        let response = ui
            .add_enabled(is_meant, Button::new(name))
            .on_hover_text(help)
            .on_disabled_hover_text("Look through a photograph, or select one, first");
        if response.clicked() {
            actions.push(Action::Masking(what));
        }
    }
}

fn suggest_ui(ui: &mut egui::Ui, project: &Project, jobs: &Jobs, actions: &mut Vec<Action>) {
    if jobs.is_suggesting() {
        let part = jobs
            .suggesting()
            .map_or(0.0, |progress| progress.done as f32 / progress.total.max(1) as f32);
        ui.add(egui::ProgressBar::new(part).desired_width(140.0).text("Comparing"));
        let help = "Stop comparing; masks stay as they are";
        if ui.button("Cancel suggesting").on_hover_text(help).clicked() {
            actions.push(Action::Masking(Do::StopSuggesting));
        }
        return;
    }
    let count = project.capture.measurements().count();
    let response = ui
        .add_enabled(count >= 3, Button::new("Suggest masks"))
        .on_hover_text(
            "Find unmodelled things in front of the known surfaces, where three photographs or \
             more disagree. \
             It is added to the masks that are there",
        )
        .on_disabled_hover_text("At least three photographs that measure radiance are needed");
    if response.clicked() {
        actions.push(Action::Masking(Do::Suggest));
    }
    ui.weak("Hatched pixels are not used in a run.");
}
