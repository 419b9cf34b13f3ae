//! Numbers on their way out of the window: the value under the cursor, plots as files, the guide.

use std::fs;

use eframe::egui;
use egui_kittest::kittest::Queryable;

use crate::relighting::relit;
use crate::runs::coarse;
use crate::{Window, example};

const NONE: egui::Modifiers = egui::Modifiers::NONE;

/// The three numbers behind a word of the status bar, and the luminance.
fn told(window: &Window, word: &str) -> Option<[f64; 4]> {
    let text = window.labels(&format!("{word} ")).into_iter().find(|text| text.contains(" / "))?;
    let text = text.strip_prefix(&format!("{word} "))?.split("  ").next()?.to_owned();
    let (rgb, luminance) = text.split_once(", luminance ").unwrap_or((&text, "0"));
    let mut numbers = rgb.split(" / ").chain([luminance]).map(|own| own.parse().ok());
    Some([numbers.next()??, numbers.next()??, numbers.next()??, numbers.next()??])
}

/// Three digits after the point are written.
fn is_near(a: f64, b: f64) -> bool {
    (a - b).abs() <= 5.01e-4
}

#[test]
fn the_status_bar_tells_the_value_of_the_photograph_that_is_seen() {
    let mut window = Window::with_example();
    let view = window.node("Viewport").rect();
    window.harness.hover_at(view.center());
    window.step();
    window.key(NONE, egui::Key::Num0);
    for _ in 0..6 {
        if !window.has_part("000.exr ×") {
            window.key(NONE, egui::Key::Tab);
        }
    }
    let image = lobelia::io::exr::read(&example().join("images/000.exr")).unwrap();
    let (width, height) = (image.width as f32, image.height as f32);
    let scale = (view.width() / width).min(view.height() / height);
    for (x, y) in [(0, 0), (40, 25), (-30, 40), (-60, -20)] {
        // The middle of a pixel.
        let aside = egui::vec2(x as f32 + 0.5, y as f32 + 0.5) * scale;
        window.harness.hover_at(view.center() + aside);
        window.step();
        window.wait("a value", |window| told(window, "radiance").is_some());
        let [red, green, blue, luminance] = told(&window, "radiance").expect("a value");
        let column = (image.width as i32 / 2 + x) as usize;
        let row = (image.height as i32 / 2 + y) as usize;
        let pixel = image.pixels[row * image.width + column].map(f64::from);
        let written = format!("{red} {green} {blue} of {pixel:?} at {x} {y}");
        assert!(is_near(red, pixel[0]) && is_near(green, pixel[1]), "{written}");
        assert!(is_near(blue, pixel[2]), "{written}");
        let expected = 0.2126 * pixel[0] + 0.7152 * pixel[1] + 0.0722 * pixel[2];
        assert!(is_near(luminance, expected), "{luminance} instead of {expected}");
    }
}

#[test]
fn the_status_bar_tells_the_value_of_what_is_shown() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = relit(folder.path());
    window.wait("the first picture", |window| window.has_part("paths a pixel"));
    let view = window.node("Viewport").rect();
    window.harness.hover_at(view.center());
    window.step();
    window.wait("a value", |window| told(window, "radiance").is_some());
    let all = told(&window, "radiance").expect("the relit scene has a value");
    assert!(all[3] > 0.0, "{all:?}");
    // Without light there is no radiance.
    let field = "Factor on all of the recovered light";
    window.click(field);
    window.key(egui::Modifiers::COMMAND, egui::Key::A);
    window.harness.event(egui::Event::Text("0".to_owned()));
    window.step();
    window.key(NONE, egui::Key::Enter);
    window.harness.hover_at(view.center());
    window.wait("darkness", |window| {
        told(window, "radiance").is_some_and(|own| own[3] < 1e-3 * all[3])
    });
}

#[test]
fn the_status_bar_tells_the_reflectance_that_is_seen() {
    let folder = tempfile::tempdir().unwrap();
    let file = coarse(folder.path(), 150);
    let mut project: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(&file).unwrap()).unwrap();
    project["view"] = serde_json::json!({"shading": "reflectance"});
    fs::write(&file, project.to_string()).unwrap();
    let mut window = Window::at(folder.path(), Some(&file));
    window.wait_for("Photographs (6)");
    window.key(egui::Modifiers::COMMAND, egui::Key::R);
    window.wait("the end of the run", |window| !window.harness.state().is_busy());
    let view = window.node("Viewport").rect();
    window.harness.hover_at(view.center() + egui::vec2(0.0, 60.0));
    window.step();
    window.wait("a reflectance", |window| told(window, "reflectance").is_some());
    let own = told(&window, "reflectance").expect("the surface has a reflectance");
    assert!(own[..3].iter().all(|value| (0.0..=1.0).contains(value)), "{own:?}");
    assert!(told(&window, "radiance").is_none(), "one value is told: of what is seen");
}

#[test]
fn plots_are_saved_as_tables_and_drawings() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = relit(folder.path());
    let save = |window: &mut Window, entry: &str, name: &str| {
        let file = folder.path().join(name);
        window.menu("Save plot", entry);
        window.write("Path", file.to_str().unwrap());
        window.click_front("Save");
        window.wait(name, |_| file.is_file());
        fs::read_to_string(&file).unwrap()
    };
    window.key(NONE, egui::Key::F3);
    let table = save(&mut window, "Table (CSV)", "a.csv");
    assert!(table.starts_with("iteration,rms_r,"), "{table}");
    assert!(table.lines().count() > 2);
    let drawing = save(&mut window, "Drawing (SVG)", "a.svg");
    assert!(drawing.starts_with("<svg") && drawing.contains("Relative RMS"));
    window.click("Error per sample");
    let table = save(&mut window, "Table (CSV)", "b.csv");
    assert!(table.starts_with("x_m,y_m,z_m,") && table.contains(",floor,"), "{table}");
    assert!(table.lines().count() > 100);
    let drawing = save(&mut window, "Drawing (SVG)", "b.svg");
    assert!(drawing.contains("computed / measured radiance") && drawing.contains("wall1"));
    // What is there is not lost unasked.
    window.menu("Save plot", "Drawing (SVG)");
    window.write("Path", folder.path().join("b.svg").to_str().unwrap());
    window.click_front("Save");
    assert!(window.has("Replace") && window.has("Cancel"));
    window.click("Cancel");
}

#[test]
fn compare_reads_both_pictures_at_the_pointer() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = relit(folder.path());
    window.key(NONE, egui::Key::F4);
    window.click("Compare");
    window.wait("the first paths", |window| window.has("Render"));
    let picture = window
        .harness
        .query_all_by_label("Render")
        .map(|node| node.rect())
        .max_by(|a, b| a.height().total_cmp(&b.height()))
        .expect("a picture");
    assert!(picture.height() > 60.0, "{picture}");
    window.harness.hover_at(picture.center());
    window.wait("the values", |window| window.has_part(", luminance ") && window.has_part(" %"));
    assert_eq!(window.labels(", luminance ").len(), 2, "of the photograph and of the render");
}

#[test]
fn the_guide_opens_is_searched_and_leads_on() {
    let mut window = Window::new();
    window.step();
    window.menu("Help", "Guide");
    assert!(window.has("Known lights") && window.has("Speed"));
    let search = window.harness.get_by_role(egui::accesskit::Role::TextInput);
    search.focus();
    search.type_text("angular_diameter");
    window.step();
    assert!(window.has("Known lights") && !window.has("Speed"));
    window.click("Known lights");
    assert!(window.has("In the studio") && window.has_part("Selected surfaces shine"));
    window.harness.run_steps(5);
    assert!(window.has_part("\"angular_diameter\": 0.0093"));
    window.key(egui::Modifiers::COMMAND, egui::Key::A);
    let search = window.harness.get_by_role(egui::accesskit::Role::TextInput);
    search.focus();
    window.key(egui::Modifiers::COMMAND, egui::Key::A);
    let search = window.harness.get_by_role(egui::accesskit::Role::TextInput);
    search.type_text("nothing says this");
    window.step();
    assert!(window.has("No page has this in it."));
}
