use eframe::egui;
use egui_kittest::kittest::Queryable;

use crate::Window;

fn tag_floor_specular(window: &mut Window) {
    window.click("Tag");
    window.click("floor (1)");
    window.click("Specular");
}

#[test]
fn the_floor_becomes_specular_and_back_and_again() {
    let mut window = Window::with_example();
    tag_floor_specular(&mut window);
    assert!(window.has("specular"));
    window.click("Edit");
    window.harness.run_steps(5);
    assert!(window.has_part("Undo make specular"));
    window.key(egui::Modifiers::NONE, egui::Key::Escape);
    assert!(!window.has_part("Undo make specular"), "Escape closes a menu");
    window.key(egui::Modifiers::COMMAND, egui::Key::Z);
    assert!(!window.has("specular"));
    window.key(egui::Modifiers::COMMAND | egui::Modifiers::SHIFT, egui::Key::Z);
    assert!(window.has("specular"));
    window.harness.run();
}

#[test]
fn surfaces_are_assigned_and_unassigned_ones_stand_apart() {
    let mut window = Window::with_example();
    window.click("Tag");
    window.click("wall1");
    window.key(egui::Modifiers::NONE, egui::Key::M);
    window.click_front("wall2");
    assert!(window.has("wall2 (2)") && window.has("wall1 (0)"));
    window.key(egui::Modifiers::NONE, egui::Key::M);
    window.click("No material");
    assert!(window.has("1 surface has no material") && window.has("wall2 (1)"));
    window.key(egui::Modifiers::COMMAND, egui::Key::Z);
    assert!(!window.has("1 surface has no material") && window.has("wall2 (2)"));
}

#[test]
fn a_known_reflectance_and_a_name_are_given() {
    let mut window = Window::with_example();
    window.click("Tag");
    window.click("box1 (1)");
    window.click("Known reflectance");
    assert!(window.has("diffuse, known"));
    window.write("Name", "plaster");
    window.key(egui::Modifiers::NONE, egui::Key::Enter);
    assert!(window.has("plaster (1)"));
    window.harness.run();
}

#[test]
fn keys_belong_to_the_field_that_is_typed_in() {
    let mut window = Window::with_example();
    window.click("Tag");
    window.click("box1 (1)");
    window.click("Specular");
    window.node("Name").focus();
    window.step();
    window.node("Name").type_text("y");
    window.key(egui::Modifiers::COMMAND, egui::Key::Z);
    assert!(window.has("specular"), "Ctrl+Z takes text back, not a tag");
    window.key(egui::Modifiers::COMMAND, egui::Key::W);
    assert!(window.has("Photographs (6)"), "Ctrl+W deletes a word");
    window.write("Name", "plaster");
    window.key(egui::Modifiers::COMMAND, egui::Key::S);
    assert!(window.has("plaster (1)"), "what was typed is saved, too");
}

#[test]
fn alt_and_a_letter_is_not_the_letter() {
    let mut window = Window::with_example();
    window.click("Tag");
    window.key(egui::Modifiers::NONE, egui::Key::A);
    assert!(!window.has("Select surfaces to assign them"));
    window.key(egui::Modifiers::ALT, egui::Key::A);
    assert!(window.has("Select surfaces to assign them"));
}

#[test]
fn shift_takes_only_what_is_in_sight() {
    let mut window = Window::with_example();
    window.click("Tag");
    let search = window.harness.get_by_role(egui::accesskit::Role::TextInput);
    search.focus();
    search.type_text("1");
    window.step();
    window.click("wall1");
    // wall2 lies between them.
    window.node("box1").click_modifiers(egui::Modifiers::SHIFT);
    window.step();
    assert!(window.has("2 surfaces selected"));
}

#[test]
fn properties_stay_in_sight_of_many_materials_and_empty_ones_go() {
    let mut window = Window::with_example();
    window.key(egui::Modifiers::NONE, egui::Key::F2);
    window.key(egui::Modifiers::ALT, egui::Key::A);
    for _ in 0..40 {
        window.click("New material");
    }
    let screen = egui::Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(1280.0, 720.0));
    window.click("floor (1)");
    for label in ["Kind", "Specular"] {
        let place = window.node(label).rect();
        assert!(screen.contains_rect(place), "{label}: {place}");
    }
    window.click("Remove 40 empty materials");
    assert!(window.has("floor (1)") && !window.has_part("empty material"));
    window.key(egui::Modifiers::COMMAND, egui::Key::Z);
    assert!(window.has("Remove 40 empty materials"), "it was one step");
}
