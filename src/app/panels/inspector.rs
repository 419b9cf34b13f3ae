//! All numbers of the selected object.

use eframe::egui;

use super::context::Context;
use super::inspect_light::light_ui;
use super::inspect_sample::{CropCache, sample_ui};
use super::inspect_texture::{TextureCache, textures_ui};
use super::materials::{found, identified_ui, interval_bar};
use super::no_radiance::no_radiance_ui;
use super::numbers::{
    count, counted, empty, list_color, outdated, reflectance_color, rgb, short, swatch,
};
use super::outliner::use_of;
use crate::app::actions::{Action, Select};
use crate::app::project::{Focus, Project};
use crate::app::relight::Added;
use crate::app::theme::CHANNEL_NAMES;
use crate::scene::{MaterialKind, Role};

pub type State = CropCache;

pub fn show(ui: &mut egui::Ui, context: Context, crops: &mut State) {
    let Context { project, viewport, jobs, actions, .. } = context;
    let coverage = jobs.coverage.as_ref();
    crops.exposure = viewport.exposure();
    egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        outdated(ui, project);
        let selection = &project.selection;
        match selection.focus {
            Focus::Nothing => overview(ui, project, crops, actions),
            Focus::Surfaces => surfaces(ui, project, crops, actions),
            Focus::Material => {
                if let Some(index) = selection.material {
                    material(ui, project, index, &mut crops.texture, actions);
                }
            }
            Focus::Sample => {
                if let Some(index) = selection.sample {
                    sample_ui(ui, project, index, crops, actions);
                }
            }
            Focus::Light => {
                if let Some(index) = selection.light {
                    light_ui(ui, project, index, coverage, &mut crops.mask, actions);
                }
            }
            Focus::Added => {
                let at = match selection.added {
                    Some(Added::Known(_)) => "The numbers of known lights are in Known light.",
                    _ => "The numbers of what was added are in the Relight panel.",
                };
                empty(ui, at);
            }
            Focus::Photograph => {
                if let Some(index) = selection.photograph {
                    photograph(ui, project, index, crops, actions);
                }
            }
        }
    });
}

/// Rows of a name and a value.
pub fn facts(ui: &mut egui::Ui, id: &str, rows: &[(&str, String)]) {
    // In a narrow panel names are broken into lines before numbers are.
    let names = (0.5 * ui.available_width()).max(70.0);
    egui::Grid::new(id).num_columns(2).spacing([12.0, 2.0]).show(ui, |ui| {
        for (name, value) in rows {
            ui.vertical(|ui| {
                ui.set_max_width(names);
                ui.add(egui::Label::new(egui::RichText::new(*name).weak()).wrap());
            });
            ui.vertical(|ui| ui.add(egui::Label::new(value.as_str()).wrap()));
            ui.end_row();
        }
    });
}

fn overview(
    ui: &mut egui::Ui,
    project: &Project,
    cache: &mut CropCache,
    actions: &mut Vec<Action>,
) {
    let capture = &project.capture;
    ui.heading(capture.name.as_str());
    let mut rows = vec![
        ("Triangles", count(capture.mesh.triangles.len())),
        ("Surfaces", count(capture.surfaces.len())),
        ("Photographs", count(capture.photographs.len())),
        ("Measure radiance", count(capture.measurements().count())),
        ("Materials", count(capture.materials.len())),
        ("Known lights", count(capture.lights.len())),
        ("Environment", format!("{:?}", capture.environment).to_lowercase()),
    ];
    if let Some(size) = cache.extents(ui.ctx(), project).and_then(|own| own.size) {
        rows.insert(1, ("Size", format!("{:.2} × {:.2} × {:.2} m", size.x, size.y, size.z)));
    }
    facts(ui, "overview", &rows);
    ui.add_space(6.0);
    no_radiance_ui(ui, project, actions);
    if !capture.warnings.is_empty() {
        ui.add_space(6.0);
        let color = ui.visuals().warn_fg_color;
        ui.colored_label(color, counted(capture.warnings.len(), "warning", "warnings"));
        for warning in capture.warnings.iter().take(20) {
            ui.label(warning.as_str());
        }
    }
    ui.add_space(6.0);
    ui.weak("Select a surface, material, photograph, sample or light to see its numbers.");
}

fn surfaces(
    ui: &mut egui::Ui,
    project: &Project,
    cache: &mut CropCache,
    actions: &mut Vec<Action>,
) {
    let selected = &project.selection.surfaces;
    let capture = &project.capture;
    ui.heading(counted(selected.len(), "surface", "surfaces"));
    let extent = cache.extents(ui.ctx(), project).map(|own| own.sum(selected));
    let (triangles, area) = match extent {
        Some((triangles, area)) => (count(triangles), format!("{area:.3} m²")),
        None => Default::default(),
    };
    facts(ui, "surfaces", &[("Triangles", triangles), ("Area", area)]);
    ui.add_space(4.0);
    for &surface in selected.iter().take(60) {
        let role = match capture.surfaces[surface].role {
            Role::Material(index) => capture.materials[index].name.clone(),
            Role::Luminaire(light) => format!("visible light {}", capture.lights[light].name()),
            Role::Untagged => "no material".to_owned(),
        };
        ui.label(format!("{}: {role}", capture.surfaces[surface].name));
    }
    if ui.button("Assign material…").on_hover_text("Choose their material (M)").clicked() {
        actions.push(Action::AskMaterial);
    }
}

fn material(
    ui: &mut egui::Ui,
    project: &Project,
    index: usize,
    textures: &mut TextureCache,
    actions: &mut Vec<Action>,
) {
    let Some(own) = project.edit().materials.get(index) else { return };
    ui.horizontal(|ui| {
        swatch(ui, list_color(project, index));
        ui.heading(own.name.as_str());
    });
    let found_as = project.found_as(index).filter(|_| project.products.solved.is_some());
    let Some(result) = found_as else {
        empty(ui, "Its reflectance is found by a run.");
        return;
    };
    let found = found(project, result);
    identified_ui(ui, project, result, &found);
    if let Some(reflectance) = &found.reflectance {
        ui.horizontal(|ui| {
            let size = egui::vec2(ui.available_width().min(160.0), 28.0);
            let (rect, _) = ui.allocate_exact_size(size, egui::Sense::hover());
            ui.painter().rect_filled(rect, 2.0, reflectance_color(reflectance.diffuse));
        });
        ui.weak("Diffuse reflectance");
        for (channel, name) in CHANNEL_NAMES.iter().enumerate() {
            ui.horizontal(|ui| {
                let interval = found.certainty.and_then(|certainty| certainty.diffuse[channel]);
                interval_bar(ui, reflectance.diffuse[channel], interval, channel);
                let text = interval.map(|[low, high]| format!("[{low:.3}, {high:.3}]"));
                ui.weak(format!("{name} {}", text.unwrap_or_default()));
            });
        }
        if project.result_capture().materials[result].kind == MaterialKind::Specular {
            match reflectance.coat {
                Some(roughness) => {
                    facts(ui, "gloss", &[("Coat, roughness α", short(roughness))]);
                }
                None => {
                    let rows = [
                        ("Specular", rgb(reflectance.specular)),
                        ("Exponent", short(reflectance.exponent)),
                    ];
                    facts(ui, "gloss", &rows);
                }
            }
        }
    }
    textures_ui(ui, project, result, textures);
    let Some(derived) = &project.products.derived else { return };
    ui.add_space(6.0);
    ui.weak("Worst samples");
    for sample in derived.worst_of(result, 8) {
        let text = format!("Sample {sample}, error {}", short(derived.samples[sample].log_error));
        if ui.link(text).on_hover_text("Select this sample").clicked() {
            actions.push(Action::Select(Select::Sample(sample)));
        }
    }
}

fn photograph(
    ui: &mut egui::Ui,
    project: &Project,
    index: usize,
    cache: &mut CropCache,
    actions: &mut Vec<Action>,
) {
    let Some(photograph) = project.loaded.photographs.get(index) else { return };
    ui.heading(photograph.name.as_str());
    ui.label(use_of(photograph));
    no_radiance_ui(ui, project, actions);
    let camera = &photograph.camera;
    let p = camera.position;
    let across = 2.0 * (0.5 * camera.width as f64 / camera.focal_px.x).atan().to_degrees();
    let mut rows = vec![
        ("Size", format!("{} × {} pixels", camera.width, camera.height)),
        ("Position", format!("{:.3} {:.3} {:.3} m", p.x, p.y, p.z)),
        ("Angle across", format!("{across:.1}°")),
        ("Distortion", if camera.distortion.is_none() { "none" } else { "yes" }.to_owned()),
    ];
    if let Some(cloud) = &project.products.samples {
        rows.push(("Samples seen", count(cache.samples_seen(cloud, index))));
    }
    facts(ui, "photograph", &rows);
    let help = "See the geometry from where this photograph was taken";
    if ui.button("Look through").on_hover_text(help).clicked() {
        actions.push(Action::LookThrough(Some(index)));
    }
}
