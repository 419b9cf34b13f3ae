//! The table of the virtual lights.

use std::sync::Arc;

use eframe::egui;

use super::context::Context;
use super::numbers::{count, emission_color, empty, outdated, rgb, short, swatch, triple};
use super::table::{Head, Rows, TableState, head, table_ui};
use crate::app::actions::{Action, Select};
use crate::app::derived::kind_name;
use crate::app::project::Project;
use crate::reconstruct::lights::{LightKind, VirtualLight};

const HEADS: [Head; 8] = [
    head("#", 44.0, "The light's number"),
    head("Kind", 110.0, "A disc, lamp, part of the sky, the sun, or a known light"),
    head(
        "Position (m)",
        140.0,
        "Its centre in metres; for lights at infinity the direction of travel",
    ),
    head("Radius (m)", 76.0, "Of the disc or ball, in metres"),
    head("Lobes lit", 70.0, "Lobes with any emission, of all it has"),
    head("Strongest emission", 150.0, "Emission of its strongest lobe, red / green / blue"),
    head("Share (%)", 68.0, "Its part of the light of all samples from virtual lights"),
    head("Lit samples", 80.0, "Samples that get a thousandth or more of that light from it"),
];

/// Where a light is, in words.
pub fn place(light: &VirtualLight) -> String {
    let at_infinity = matches!(light.kind, LightKind::Sky | LightKind::Sun);
    let v = if at_infinity { light.normal } else { light.position };
    let text = triple(v, 2);
    if at_infinity { format!("along {text}") } else { text }
}

pub type State = TableState;

pub fn show(ui: &mut egui::Ui, context: Context, state: &mut State) {
    let Context { project, actions, .. } = context;
    let Some((lights, lobes)) = &project.products.lights else {
        empty(ui, "Virtual lights are placed by a run.");
        return;
    };
    let derived =
        project.products.derived.as_deref().filter(|d| d.lights.len() == lights.lights.len());
    ui.horizontal(|ui| {
        ui.label(format!(
            "{} lights, {} lobes",
            count(lights.lights.len()),
            count(lobes.lobes.len())
        ));
        outdated(ui, project);
    });
    let numbers = |index: usize| derived.map_or_else(Default::default, |d| d.lights[index]);
    let kind = |index: usize| kind_name(lights.lights[index].kind);
    let compare = |column: usize, a: usize, b: usize| {
        let by = |value: &dyn Fn(usize) -> f64| value(a).total_cmp(&value(b));
        match column {
            1 => kind(a).cmp(kind(b)),
            2 => by(&|index| f64::from(lights.lights[index].position.z)),
            3 => by(&|index| f64::from(lights.lights[index].radius_m)),
            4 => numbers(a).lit_lobes.cmp(&numbers(b).lit_lobes),
            // What no photograph constrains does not top the list.
            5 => (!numbers(a).is_unseen(), numbers(a).strongest)
                .partial_cmp(&(!numbers(b).is_unseen(), numbers(b).strongest))
                .unwrap_or(std::cmp::Ordering::Equal),
            6 => by(&|index| numbers(index).share),
            7 => numbers(a).lit_samples.cmp(&numbers(b).lit_samples),
            _ => a.cmp(&b),
        }
    };
    let identity =
        Arc::as_ptr(lights) as usize ^ derived.map_or(0, |d| std::ptr::from_ref(d) as usize);
    let rows = Rows {
        identity,
        count: lights.lights.len(),
        selected: project.selection.light,
        compare: &compare,
    };
    let clicked = table_ui(ui, "lights", state, &HEADS, &rows, |ui, index, column| {
        let light = &lights.lights[index];
        let own = numbers(index);
        let text = match column {
            0 => index.to_string(),
            1 => name(project, light),
            2 => place(light),
            3 if light.radius_m > 0.0 => format!("{:.3}", light.radius_m),
            4 if derived.is_some() => format!("{} of {}", own.lit_lobes, own.lobes),
            4 => lobes.of(index).len().to_string(),
            5 if derived.is_some() => {
                swatch(ui, emission_color(own.emission));
                rgb(own.emission)
            }
            6 if derived.is_some() => short(100.0 * own.share),
            7 if own.is_unseen() => {
                unseen_ui(ui);
                return;
            }
            7 if derived.is_some() => count(own.lit_samples),
            _ => String::new(),
        };
        ui.label(text);
    });
    if let Some(light) = clicked {
        actions.push(Action::Select(Select::Light(light)));
    }
}

/// The mark of light that no photograph constrains.
pub fn unseen_ui(ui: &mut egui::Ui) {
    let color = ui.visuals().warn_fg_color;
    ui.colored_label(color, "(!) unseen").on_hover_text(UNSEEN);
}

pub const UNSEEN: &str =
    "It sends its light where there is no sample: the photographs do not determine its strength";

/// A light's kind, and for a known one its name.
pub fn name(project: &Project, light: &VirtualLight) -> String {
    match light.kind {
        LightKind::Known(index) => match project.result_capture().lights.get(index) {
            Some(known) => format!("{} ({})", known.name(), known.kind()),
            None => kind_name(light.kind).to_owned(),
        },
        kind => kind_name(kind).to_owned(),
    }
}
