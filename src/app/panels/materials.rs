//! The table of reflectances, with intervals.

use std::sync::Arc;

use eframe::egui::{self, Sense, Stroke, StrokeKind, vec2};

use super::context::Context;
use super::numbers::{empty, outdated, reflectance_color, swatch};
use super::table::{Head, Rows, TableState, head, table_ui};
use crate::app::actions::{Action, Select};
use crate::app::project::Project;
use crate::app::theme::channel_color;
use crate::math::rgb::CHANNELS;
use crate::reconstruct::solution::MaterialCertainty;
use crate::scene::{Brdf, MaterialKind, Optics};

const HEADS: [Head; 8] = [
    head("Material", 120.0, "The material's name, in the colour it reflects"),
    head("Kind", 66.0, "Diffuse or specular"),
    head("Red", 118.0, "Diffuse reflectance in red, with its 95 % interval as a bar from 0 to 1"),
    head(
        "Green",
        118.0,
        "Diffuse reflectance in green, with its 95 % interval as a bar from 0 to 1",
    ),
    head("Blue", 118.0, "Diffuse reflectance in blue, with its 95 % interval as a bar from 0 to 1"),
    head(
        "Specular",
        120.0,
        "Specular reflectance, red / green / blue; a coat reflects as varnish does",
    ),
    head("Exponent", 66.0, "Exponent of the Phong lobe, or the roughness α of a coat"),
    head("Identified", 150.0, "Whether the photographs determine it"),
];

/// What is known of a material of the results.
pub struct Found {
    pub reflectance: Option<Brdf>,
    pub optics: Optics,
    pub certainty: Option<MaterialCertainty>,
}

pub fn found(project: &Project, material: usize) -> Found {
    let solved = project.products.solved.as_deref();
    let reflectance =
        solved.and_then(|solved| solved.reflectances.get(material).copied()).flatten();
    let certainty = solved.and_then(|solved| solved.certainty.get(material).copied()).flatten();
    let optics = solved.and_then(|solved| solved.optics.get(material).copied());
    Found { reflectance, optics: optics.unwrap_or_default(), certainty }
}

impl Found {
    /// Whether it is identified, or why not.
    pub fn identified(&self, project: &Project, material: usize) -> (bool, &'static str) {
        let known = project
            .result_capture()
            .materials
            .get(material)
            .is_some_and(|material| material.known_diffuse.is_some());
        match (&self.reflectance, &self.certainty) {
            (None, _) => match self.optics {
                Optics::Opaque => (false, "not measured in any photograph"),
                Optics::Mirror(_) => (true, "a mirror: it shows other surfaces"),
                Optics::Glass => (true, "clear glass: light passes it"),
            },
            _ if known => (true, "known"),
            (_, None) => (true, "not assessed by this method"),
            (_, Some(certainty)) if certainty.identified == [true; CHANNELS] => {
                (true, "identified")
            }
            (_, Some(certainty)) if certainty.identified == [false; CHANNELS] => {
                (false, "not identified: only the prior holds it")
            }
            _ => (false, "not identified in every channel"),
        }
    }
}

pub type State = TableState;

pub fn show(ui: &mut egui::Ui, context: Context, state: &mut State) {
    let Context { project, actions, .. } = context;
    let Some(solved) = &project.products.solved else {
        empty(ui, "Reflectances are found by a run.");
        return;
    };
    ui.horizontal(|ui| {
        ui.label("Reflectances");
        outdated(ui, project);
    });
    let materials = &project.result_capture().materials;
    let all: Vec<Found> = (0..materials.len()).map(|index| found(project, index)).collect();
    let diffuse = |index: usize, c: usize| all[index].reflectance.map_or(-1.0, |r| r.diffuse[c]);
    let compare = |column: usize, a: usize, b: usize| match column {
        1 => (materials[a].kind as u8).cmp(&(materials[b].kind as u8)),
        2..=4 => diffuse(a, column - 2).total_cmp(&diffuse(b, column - 2)),
        5 => {
            let sum = |i: usize| all[i].reflectance.map_or(0.0, |r| r.specular.iter().sum::<f64>());
            sum(a).total_cmp(&sum(b))
        }
        6 => {
            let exponent = |i: usize| {
                let gloss = all[i].reflectance.and_then(|r| r.gloss());
                gloss.map_or(0.0, |(gloss, _)| gloss.exponent())
            };
            exponent(a).total_cmp(&exponent(b))
        }
        7 => all[a].identified(project, a).cmp(&all[b].identified(project, b)),
        _ => materials[a].name.cmp(&materials[b].name),
    };
    let selected = project.selection.material.and_then(|index| project.found_as(index));
    let rows = Rows {
        identity: Arc::as_ptr(solved) as usize,
        count: materials.len(),
        selected,
        compare: &compare,
    };
    let clicked = table_ui(ui, "materials", state, &HEADS, &rows, |ui, index, column| {
        let Found { reflectance, certainty, .. } = &all[index];
        let specular = materials[index].kind == MaterialKind::Specular;
        match (column, reflectance) {
            (0, _) => {
                let color = reflectance.map(|r| reflectance_color(r.diffuse));
                swatch(ui, color.unwrap_or(egui::Color32::TRANSPARENT));
                ui.label(materials[index].name.as_str());
            }
            (1, _) => {
                ui.label(if specular { "specular" } else { "diffuse" });
            }
            (2..=4, Some(reflectance)) => {
                let channel = column - 2;
                let interval = certainty.and_then(|certainty| certainty.diffuse[channel]);
                interval_bar(ui, reflectance.diffuse[channel], interval, channel);
            }
            (5, Some(reflectance)) if specular => {
                ui.label(match reflectance.coat {
                    Some(_) => "coat".to_owned(),
                    None => super::numbers::rgb(reflectance.specular),
                });
            }
            (6, Some(reflectance)) if specular => {
                ui.label(match reflectance.coat {
                    Some(roughness) => format!("α {}", super::numbers::short(roughness)),
                    None => super::numbers::short(reflectance.exponent),
                });
            }
            (7, _) => identified_ui(ui, project, index, &all[index]),
            _ => {
                ui.label("");
            }
        }
    });
    if let Some(material) = clicked.and_then(|result| project.listed_as(result)) {
        actions.push(Action::Select(Select::Material(material)));
    }
}

/// A value from 0 to 1 as a mark with its interval as a bar, and as a number.
pub fn interval_bar(ui: &mut egui::Ui, value: f64, interval: Option<[f64; 2]>, channel: usize) {
    let (rect, response) = ui.allocate_exact_size(vec2(56.0, 10.0), Sense::hover());
    let visuals = ui.visuals();
    let color = channel_color(channel, visuals.dark_mode);
    let line = Stroke::new(1.0, visuals.widgets.noninteractive.bg_stroke.color);
    let painter = ui.painter();
    painter.rect(rect, 1.0, visuals.extreme_bg_color, line, StrokeKind::Inside);
    let x = |value: f64| rect.left() + rect.width() * value.clamp(0.0, 1.0) as f32;
    if let Some([low, high]) = interval {
        let bar = egui::Rect::from_x_y_ranges(x(low)..=x(high), rect.shrink(2.0).y_range());
        painter.rect_filled(bar, 0.0, color.gamma_multiply(0.6));
    }
    let mark = Stroke::new(2.0, visuals.strong_text_color());
    painter.vline(x(value), rect.y_range(), mark);
    let text = match interval {
        Some([low, high]) => format!("{value:.3}, 95 % interval {low:.3} to {high:.3}"),
        None => format!("{value:.3}, no interval"),
    };
    response.on_hover_text(text);
    ui.label(format!("{value:.3}"));
}

/// A word and a mark, not only a colour.
pub fn identified_ui(ui: &mut egui::Ui, project: &Project, index: usize, found: &Found) {
    let (identified, why) = found.identified(project, index);
    if identified {
        ui.label(why);
    } else {
        let color = ui.visuals().warn_fg_color;
        ui.colored_label(color, format!("(!) {why}")).on_hover_text(
            "More photographs, light from other sides, or a known reflectance of this material or \
             one beside it would determine it.",
        );
    }
}
