//! The fields of the import page: files, units, surfaces and exposures.

use eframe::egui::{self, ComboBox, DragValue};

use super::path;
use crate::app::actions::{Action, Field, PathRequest};
use crate::app::entry;
use crate::app::import::ImportPage;
use crate::app::panels::numbers::counted;
use crate::app::panels::options::choice_row;
use crate::io::import::{Axis, Shot, Surfaces, Unit};
use crate::options::OptionGroup;

/// A button that asks for a path: its text, what it asks, its help.
type Choice = (&'static str, PathRequest, &'static str);

/// Width of the names before the controls.
const NAMES: f32 = 86.0;

pub fn fields_ui(ui: &mut egui::Ui, page: &mut ImportPage, actions: &mut Vec<Action>) {
    ui.add_space(4.0);
    ui.heading("Import");
    ui.add_space(2.0);
    files(ui, page, actions);
    section(ui, "Units and axes", |ui| units(ui, page));
    section(ui, "Surfaces", |ui| mesh(ui, page));
    section(ui, "Radiance", |ui| series(ui, page));
    ui.add_space(8.0);
}

fn section(ui: &mut egui::Ui, name: &str, body: impl FnOnce(&mut egui::Ui)) {
    ui.add_space(4.0);
    egui::CollapsingHeader::new(egui::RichText::new(name).strong())
        .id_salt(name)
        .default_open(true)
        .show_unindented(ui, body);
}

fn files(ui: &mut egui::Ui, page: &mut ImportPage, actions: &mut Vec<Action>) {
    let rows: [(Field, &str, &str, &[Choice]); 4] = [
        (
            Field::Cameras,
            "Cameras",
            "A COLMAP model's folder, transforms.json, cameras.sfm, the CSV of RealityCapture, the \
             XML of Metashape, bundle.out, reconstruction.json, or glTF",
            &[
                ("File…", PathRequest::ImportCameras, "Choose a file with cameras"),
                ("Folder…", PathRequest::ImportCameraFolder, "Choose a folder with cameras"),
            ],
        ),
        (
            Field::Images,
            "Image folder",
            "The folder of the photographs; they are looked for near the cameras where none is \
             given",
            &[("Browse…", PathRequest::ImportImages, "Choose the folder of the photographs")],
        ),
        (
            Field::Mesh,
            "Mesh file",
            "The mesh (OBJ, glTF, PLY, STL), where the cameras' file has none",
            &[("Browse…", PathRequest::ImportMesh, "Choose the mesh")],
        ),
        (
            Field::Out,
            "New capture",
            "The folder that becomes the capture: new, empty, or a capture to replace",
            &[("Browse…", PathRequest::ImportOut, "Choose the folder for the capture")],
        ),
    ];
    for (field, name, help, choices) in rows {
        ui.horizontal(|ui| {
            let label = cell(ui, name, help);
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                for (text, asked, help) in choices.iter().rev() {
                    let button = ui.button(*text).on_hover_text(*help);
                    let whole = format!("{name}: {text}");
                    if crate::app::panels::numbers::named(button, whole).clicked() {
                        actions.push(Action::Ask(*asked));
                    }
                }
                let text = &mut page.texts[field as usize];
                let whole = page.chosen[field as usize].as_str();
                let hover =
                    if whole.is_empty() { help.to_owned() } else { format!("{whole}\n{help}") };
                let edit = path::path_edit(ui, super::id(name), text);
                let response = edit.on_hover_text(hover).labelled_by(label.id);
                if response.lost_focus() {
                    page.chosen[field as usize].clone_from(text);
                }
            });
        });
    }
}

fn cell(ui: &mut egui::Ui, name: &str, help: &str) -> egui::Response {
    let size = egui::vec2(NAMES, ui.spacing().interact_size.y);
    let layout = egui::Layout::left_to_right(egui::Align::Center);
    let made = ui.allocate_ui_with_layout(size, layout, |ui| {
        ui.set_min_width(size.x);
        ui.add(egui::Label::new(name).truncate()).on_hover_text(help)
    });
    made.inner
}

fn row(
    ui: &mut egui::Ui,
    name: &str,
    help: &str,
    control: impl FnOnce(&mut egui::Ui) -> egui::Response,
) {
    ui.horizontal(|ui| {
        let label = cell(ui, name, help);
        control(ui).on_hover_text(help).labelled_by(label.id);
    });
}

/// A choice among named values.
fn combo<T: Copy + PartialEq>(
    ui: &mut egui::Ui,
    name: &str,
    value: &mut T,
    choices: &[(&str, T)],
) -> egui::Response {
    let now = choices.iter().find(|(_, own)| own == value).map_or("", |(text, _)| *text);
    ComboBox::from_id_salt(name)
        .selected_text(now)
        .width(130.0)
        .show_ui(ui, |ui| {
            for (text, own) in choices {
                ui.selectable_value(value, *own, *text);
            }
        })
        .response
}

const UNITS: [(&str, &str); 6] = [
    ("m", "metres"),
    ("cm", "centimetres"),
    ("mm", "millimetres"),
    ("km", "kilometres"),
    ("in", "inches"),
    ("ft", "feet"),
];

fn units(ui: &mut egui::Ui, page: &mut ImportPage) {
    let options = &mut page.options;
    let units = Unit::NAMES.map(|(name, metres)| {
        let word = UNITS.iter().find(|(own, _)| *own == name).map_or(name, |(_, word)| word);
        (word, Unit(metres))
    });
    let axes = Axis::NAMES.map(|(name, axis)| {
        let word = match name {
            "x" => "+x",
            "y" => "+y",
            "z" => "+z",
            other => other,
        };
        (word, axis)
    });
    row(ui, "Unit", "Unit of the source's coordinates (--units)", |ui| {
        combo(ui, "unit", &mut options.unit, &units)
    });
    row(
        ui,
        "Scale",
        "A factor on cameras and mesh, for sources without a unit such as COLMAP (--scale)",
        |ui| {
            let speed = 0.01 * options.scale;
            let field = DragValue::new(&mut options.scale).speed(speed).range(1e-9..=1e9);
            entry::number(ui, field.max_decimals(6), entry::Unit::Plain)
        },
    );
    row(ui, "Up", "The axis that points up in the source; it becomes +z (--up)", |ui| {
        combo(ui, "up", &mut options.up, &axes)
    });
    let same = [("as the cameras", None)];
    let own_units: Vec<_> =
        same.into_iter().chain(units.map(|(name, unit)| (name, Some(unit)))).collect();
    let own_axes: Vec<_> = [("as the cameras", None)]
        .into_iter()
        .chain(axes.map(|(name, axis)| (name, Some(axis))))
        .collect();
    row(ui, "Mesh unit", "Unit of the mesh's coordinates (--mesh-units)", |ui| {
        combo(ui, "mesh unit", &mut options.mesh_unit, &own_units)
    });
    row(ui, "Mesh up", "The axis that points up in the mesh (--mesh-up)", |ui| {
        combo(ui, "mesh up", &mut options.mesh_up, &own_axes)
    });
    ui.checkbox(&mut options.undistorted, "Photographs are undistorted").on_hover_text(
        "They were undistorted after their cameras were found: the lens terms are left out \
         (--undistorted)",
    );
    ui.checkbox(&mut options.undo_applied, "Undo nerfstudio's transform").on_hover_text(
        "Take back applied_transform and applied_scale, for a mesh from before these \
         (--undo-applied-transform)",
    );
}

fn mesh(ui: &mut egui::Ui, page: &mut ImportPage) {
    let options = &mut page.options;
    let choices = [
        ("what there is", Surfaces::Auto),
        ("materials", Surfaces::Materials),
        ("groups", Surfaces::Groups),
        ("objects", Surfaces::Objects),
        ("planar regions", Surfaces::Regions),
    ];
    let help = "What becomes a surface that can be tagged: materials, groups, objects, or connected \
                planar regions; what there is: the first of these that the mesh has (--surfaces)";
    row(ui, "Surfaces by", help, |ui| combo(ui, "surfaces", &mut options.surfaces, &choices));
    row(
        ui,
        "Planar to",
        "Largest angle within a planar region, where surfaces are made of regions (--planar-angle)",
        |ui| {
            let mut degrees = options.planar_angle.to_degrees();
            let field = DragValue::new(&mut degrees).speed(0.2).range(0.1..=90.0).max_decimals(1);
            let response = entry::number(ui, field.suffix("°"), entry::Unit::Angle);
            if response.changed() {
                options.planar_angle = degrees.to_radians();
            }
            response
        },
    );
    row(
        ui,
        "Weld within",
        "Vertices no farther apart than this become one; those at one place always do (--weld)",
        |ui| {
            let mut millimetres = 1e3 * options.weld_m;
            let field = DragValue::new(&mut millimetres).speed(0.05).range(0.0..=1e4);
            let field = field.max_decimals(3).suffix(" mm");
            let response = entry::number(ui, field, entry::Unit::Millimetres);
            if response.changed() {
                options.weld_m = 1e-3 * millimetres;
            }
            response
        },
    );
}

fn series(ui: &mut egui::Ui, page: &mut ImportPage) {
    let count = page.import.as_ref().map_or(0, |import| import.series.len());
    let can_merge = count > 0;
    ui.add_enabled_ui(can_merge, |ui| {
        let text = match count {
            0 => "Merge to radiance".to_owned(),
            _ => format!("Merge {} to radiance", counted(count, "series", "series")),
        };
        ui.checkbox(&mut page.merge, text)
            .on_hover_text(
                "Photographs that are one of several exposures become images of radiance in the \
                 capture (--series)",
            )
            .on_disabled_hover_text(
                "No photograph of a camera is one of several exposures by its EXIF data. Where \
                 there are no such data, give the times below.",
            );
    });
    let single = page.import.as_ref().is_some_and(|own| own.shots.iter().any(Shot::is_single_code));
    ui.add_enabled_ui(single, |ui| {
        ui.checkbox(&mut page.as_srgb, "Take single photographs for radiance (sRGB)")
            .on_hover_text(
                "JPEG, PNG and TIFF photographs become radiance by the curve of sRGB, an \
                 approximation: exposure series and RAW are better. Without it they are shown and \
                 measure nothing (--srgb)",
            )
            .on_disabled_hover_text(
                "No photograph is a JPEG, PNG or TIFF that could be taken for radiance.",
            );
    });
    row(
        ui,
        "Times",
        "Exposure times where EXIF does not say them: a list in the order of the files (1/8,1,8), \
         or the path of a table file,seconds (--times)",
        |ui| {
            let edit = egui::TextEdit::singleline(&mut page.times)
                .id(super::id("times"))
                .hint_text("from EXIF")
                .desired_width(f32::INFINITY);
            let response = ui.add(edit);
            if response.lost_focus() {
                page.chosen_times.clone_from(&page.times);
            }
            response
        },
    );
    if !(page.merge && can_merge) {
        return;
    }
    for declaration in page.merging.declarations() {
        let now = page.merging.get(declaration.name).unwrap_or_default();
        if let Some(text) = choice_row(ui, &declaration, &now) {
            // Controls keep to the range; what does not fit all the same changes nothing.
            let _ = page.merging.set(declaration.name, &text);
        }
    }
}
