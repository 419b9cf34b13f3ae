//! Find cameras: the engines, their settings, their log, and the result.

use eframe::egui;

use crate::app::actions::{Action, FindAction, ModelAction};
use crate::app::modelling::ModelPage;
use crate::app::panels::numbers::named;
use crate::app::theme;
use crate::io::engines::{Engine, Installed};
use crate::model::Model;

/// The way to the panel, and what was found, above the tools.
pub fn cameras_ui(ui: &mut egui::Ui, page: &ModelPage, model: &Model, actions: &mut Vec<Action>) {
    ui.strong("Cameras");
    let is_shown = page.finding.is_shown;
    let help = "Let an engine that is installed place the photographs by points that several of \
                them show";
    let button = egui::Button::selectable(is_shown, "Find cameras…");
    let button = button.min_size(egui::vec2(ui.available_width(), 0.0));
    if ui.add(button).on_hover_text(help).clicked() {
        ask(actions, FindAction::Show(!is_shown));
    }
    let count = model.photographs.iter().filter(|own| own.found.is_some()).count();
    if page.finding.is_running() {
        ui.horizontal(|ui| {
            ui.spinner();
            ui.weak("An engine is at work");
        });
    } else if count > 0 {
        ui.weak(format!("{count} of {} found", model.photographs.len()));
    }
    ui.add_space(8.0);
}

fn ask(actions: &mut Vec<Action>, what: FindAction) {
    actions.push(Action::Model(ModelAction::Find(what)));
}

/// The panel.
pub fn find_ui(ui: &mut egui::Ui, page: &ModelPage, model: &Model, actions: &mut Vec<Action>) {
    let own = &page.finding;
    ui.horizontal(|ui| {
        ui.strong("Find cameras");
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            let help = "Back to what is selected; a run goes on";
            let close = ui.small_button("Close").on_hover_text(help);
            if named(close, "Close Find cameras".to_owned()).clicked() {
                ask(actions, FindAction::Show(false));
            }
        });
    });
    ui.label(
        "An engine places the photographs by points that several of them show. They must overlap \
         and show texture; bare rooms need lines and corners instead.",
    );
    ui.add_space(6.0);
    ui.add_enabled_ui(!own.is_running(), |ui| {
        engines_ui(ui, page, actions);
        ui.add_space(4.0);
        let mut is_shared = own.search.is_shared;
        let help = "On: one camera, one zoom. Off: each photograph has a lens of its own, which \
                    needs more of them";
        let response = ui.checkbox(&mut is_shared, "Photographs of one size share a lens");
        if response.on_hover_text(help).changed() {
            ask(actions, FindAction::Shared(is_shared));
        }
    });
    ui.add_space(6.0);
    run_ui(ui, page, model, actions);
    match &own.outcome {
        Some(Ok(text)) => drop(ui.label(text)),
        Some(Err(text)) => drop(ui.colored_label(ui.visuals().error_fg_color, text)),
        None => {}
    }
    if model.has_found() && !own.is_running() {
        ui.add_space(4.0);
        let shown = model.photographs[page.shown].found.is_some();
        let help = "Take back where the engine placed the photograph that is looked at; lines and \
                    corners place it then";
        let by_hand = egui::Button::new("Place this one by hand").small();
        let by_hand = ui.add_enabled(shown, by_hand).on_hover_text(help);
        let why = "No engine has placed the photograph in view: lines and corners place it.";
        if by_hand.on_disabled_hover_text(why).clicked() {
            ask(actions, FindAction::Forget(Some(page.shown)));
        }
        let help = "Take back where the engine placed the photographs; strokes stay";
        if ui.small_button("Discard the cameras that were found").on_hover_text(help).clicked() {
            ask(actions, FindAction::Forget(None));
        }
    }
    log_ui(ui, page);
}

/// The engines: which is taken, and how to get one that is missing.
fn engines_ui(ui: &mut egui::Ui, page: &ModelPage, actions: &mut Vec<Action>) {
    let own = &page.finding;
    ui.horizontal(|ui| {
        ui.weak("Engine");
        if own.engines.is_none() {
            ui.spinner();
        } else {
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let help = "Look again which engines are installed";
                if ui.small_button("Look again").on_hover_text(help).clicked() {
                    ask(actions, FindAction::Look);
                }
            });
        }
    });
    for engine in own.engines.iter().flatten() {
        ui.horizontal(|ui| {
            let name = engine.engine.name();
            let is_on = own.search.engine == Some(engine.engine);
            let radio = ui.radio(is_on, name).on_hover_text(about(engine.engine));
            if radio.clicked() {
                ask(actions, FindAction::Engine(engine.engine));
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                match &engine.program {
                    Some(program) => {
                        ui.weak("found").on_hover_text(program.display().to_string());
                    }
                    None => drop(ui.weak("not installed")),
                }
            });
        });
    }
    if let Some(missing) = own.chosen().filter(|own| own.program.is_none()) {
        install_ui(ui, missing);
    }
}

/// The line that installs an engine.
fn install_ui(ui: &mut egui::Ui, missing: &Installed) {
    egui::Frame::group(ui.style()).show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.label("Install it by this line in a terminal, then look again:");
        ui.add(egui::Label::new(egui::RichText::new(&missing.install).monospace()).wrap());
        if ui.small_button("Copy the line").on_hover_text("Copy it to the clipboard").clicked() {
            ui.ctx().copy_text(missing.install.clone());
        }
    });
}

fn about(engine: Engine) -> &'static str {
    match engine {
        Engine::OpenMvg => "Fast and small; a Python package",
        Engine::PyColmap => "COLMAP as a Python package; slower, finds more in hard cases",
        Engine::Colmap => "COLMAP as an installed program",
    }
}

/// The button, or how far the run is.
fn run_ui(ui: &mut egui::Ui, page: &ModelPage, model: &Model, actions: &mut Vec<Action>) {
    let own = &page.finding;
    if !own.is_running() {
        let obstacle = own.obstacle(model.photographs.len());
        let text = egui::RichText::new("Run");
        let (text, fill) = match obstacle {
            None => (text.color(egui::Color32::WHITE), theme::ACCENT),
            Some(_) => (text, ui.visuals().widgets.inactive.weak_bg_fill),
        };
        let button = egui::Button::new(text).fill(fill);
        let button = button.min_size(egui::vec2(ui.available_width(), 26.0));
        let response = ui
            .add_enabled(obstacle.is_none(), button)
            .on_hover_text("Find the cameras; you can go on drawing meanwhile")
            .on_disabled_hover_text(obstacle.unwrap_or_default());
        if named(response, "Run the engine".to_owned()).clicked() {
            ask(actions, FindAction::Start);
        }
        return;
    }
    let progress = own.progress();
    let part = progress.filter(|own| own.total > 0);
    let part = part.map_or(0.0, |own| own.done as f32 / own.total as f32);
    let text = match progress.filter(|own| own.total > 0) {
        Some(count) => format!("{}  {} of {}", own.step, count.done, count.total),
        None => own.step.clone(),
    };
    ui.add(egui::ProgressBar::new(part).text(text).animate(true));
    if ui.button("Cancel").on_hover_text("Stop the engine; nothing changes").clicked() {
        ask(actions, FindAction::Cancel);
    }
}

fn log_ui(ui: &mut egui::Ui, page: &ModelPage) {
    if page.finding.log.is_empty() {
        return;
    }
    ui.add_space(6.0);
    ui.weak("Log of the engine");
    egui::Frame::new().fill(ui.visuals().extreme_bg_color).inner_margin(4.0).show(ui, |ui| {
        let area = egui::ScrollArea::both().id_salt("engine log").max_height(150.0);
        area.auto_shrink([false, true]).stick_to_bottom(true).show(ui, |ui| {
            for line in &page.finding.log {
                let text = egui::RichText::new(line).monospace().small();
                ui.add(egui::Label::new(text).extend());
            }
        });
    });
}
