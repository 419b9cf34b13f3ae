use std::path::Path;

use eframe::egui;

use crate::{Window, example};

/// A project of the example with few samples, so that a run takes seconds.
pub fn coarse(folder: &Path, count: usize) -> std::path::PathBuf {
    let options = serde_json::json!({
        "samples": {"count": count.to_string(), "min_per_material": "10"},
        "joint": {"light_sets": "1"},
    });
    with_options(folder, &options)
}

/// A project of the example with options.
pub fn with_options(folder: &Path, options: &serde_json::Value) -> std::path::PathBuf {
    let tags: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(example().join("tags.json")).unwrap())
            .unwrap();
    let materials: Vec<serde_json::Value> = tags["materials"]
        .as_array()
        .unwrap()
        .iter()
        .map(|m| serde_json::json!({"name": m["name"], "specular": false, "surfaces": m["surfaces"]}))
        .collect();
    let project = serde_json::json!({
        "version": 1,
        "capture": example(),
        "materials": materials,
        "options": options,
    });
    let file = folder.join("coarse.lobelia");
    std::fs::write(&file, project.to_string()).unwrap();
    file
}

#[test]
fn a_run_fills_plot_and_tables() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::at(folder.path(), Some(&coarse(folder.path(), 150)));
    window.wait_for("Photographs (6)");
    window.click("Reconstruct");
    assert!(window.has("Run to see how the error falls."));
    window.key(egui::Modifiers::COMMAND, egui::Key::R);
    assert!(window.harness.state().is_busy());
    window.wait("the end of the run", |window| !window.harness.state().is_busy());
    assert!(!window.has("Run to see how the error falls."));
    assert!(window.has_part("relative RMS (%)"));
    window.click("Inspect");
    assert!(window.has_part("m apart"));
    // A row of the table, then where its light comes from.
    window.click("samples row 7");
    assert!(window.has("Sample 7") && window.has("known geometry"));
    window.click("Materials");
    assert!(window.has("Reflectances"));
    window.click("Error per sample");
    assert!(window.has_part("RMS of the logarithm"));
    window.click("Compare");
    window.wait("the first paths", |window| window.has_part("paths a pixel"));
    window.wait("the pictures", |window| window.has("Photograph") && window.has("Render"));
    assert!(window.has_part("relative RMS"));
    window.wait("what a viewer sees", |window| window.has_part("FLIP 0."));
    assert!(window.has_part("PSNR ") && window.has_part(" dB"));
    window.click("Slider");
    assert!(window.has("Photograph or render") && !window.has("Render"));
    window.click("Difference");
    assert!(window.has_part("+50 % orange") && !window.has("Photograph or render"));
    window.click("Lights");
    // The window of the 3D view has a switch of that name.
    window.submenu("View", "Panels", "Show lights");
    window.click("lights row 0");
    window.wait("the mask of a disc", |window| window.has_part("% of its hemisphere"));
    assert!(window.has_part("Lobes, by emission"));
    window.menu("Edit", "Select worst sample");
    assert!(window.has("Error (ln)"));
    window.menu("Edit", "Select strongest light");
    assert!(window.has_part("Lobes, by emission"));
    window.menu("File", "Close project");
    assert!(window.has_part("The results are not saved"));
    window.click("Cancel");
    window.harness.run();
}

#[test]
fn results_that_were_read_with_the_project_are_shown() {
    let folder = tempfile::tempdir().unwrap();
    let file = coarse(folder.path(), 150);
    let mut window = Window::at(folder.path(), Some(&file));
    window.wait_for("Photographs (6)");
    window.key(egui::Modifiers::COMMAND, egui::Key::R);
    window.wait("the end of the run", |window| !window.harness.state().is_busy());
    let results = folder.path().join("results");
    // What is there already is not lost unasked.
    std::fs::create_dir(&results).unwrap();
    std::fs::write(results.join("solution.json"), "of another day").unwrap();
    window.menu("File", "Export results…");
    window.write("Path", results.to_str().unwrap());
    window.click_front("Export");
    window.wait_for("Replace the results?");
    let text = std::fs::read_to_string(results.join("solution.json")).unwrap();
    assert_eq!(text, "of another day");
    window.click("Replace");
    window.wait("the folder", |window| window.has_part("Results written to"));
    window.key(egui::Modifiers::COMMAND, egui::Key::S);
    drop(window);
    // As projects were before they had results of their own.
    let mut older: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&file).unwrap()).unwrap();
    assert!(older.as_object_mut().unwrap().remove("results").is_some());
    older["version"] = 1.into();
    std::fs::write(&file, older.to_string()).unwrap();

    // What the file says is what is shown, whatever was found.
    let solution = results.join("solution.json");
    let mut json: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&solution).unwrap()).unwrap();
    let material = &mut json["materials"][0];
    material["diffuse"] = serde_json::json!([0.111, 0.222, 0.333]);
    material["diffuse_interval"] = serde_json::json!([[0.1, 0.123], null, [0.3, 0.4]]);
    material["identified"] = serde_json::json!([true, false, true]);
    let name = material["name"].as_str().unwrap().to_owned();
    std::fs::write(&solution, json.to_string()).unwrap();
    let mut window = Window::at(folder.path(), Some(&file));
    window.wait_for("Photographs (6)");
    window.wait("the results", |window| !window.harness.state().is_busy());
    window.click("Inspect");
    window.click("Materials");
    assert!(!window.has_part("found by a run"));
    assert!(["0.111", "0.222", "0.333"].iter().all(|number| window.has(number)));
    assert!(window.has_part("not identified in every channel"));
    window.click("materials row 0");
    assert!(window.has_part("[0.100, 0.123]"), "the interval of {name}");
}

#[test]
fn a_run_is_cancelled_and_nothing_stays_behind() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::at(folder.path(), Some(&coarse(folder.path(), 60000)));
    window.wait_for("Photographs (6)");
    window.click("Reconstruct");
    window.click("Run reconstruction");
    // Status bar and panel name the stage; before it there is "Stage starting".
    window.wait("the first stage", |window| window.has("Stage samples"));
    window.click("Edit");
    window.key(egui::Modifiers::NONE, egui::Key::Escape);
    assert!(window.harness.state().is_busy(), "Escape closes the menu first");
    window.key(egui::Modifiers::NONE, egui::Key::Escape);
    window.wait("the cancelled run", |window| !window.harness.state().is_busy());
    assert!(window.has("The run was cancelled."));
    assert!(window.has("Run reconstruction"));
    window.click("Inspect");
    assert!(window.has("Samples are placed by the first stage of a run."));
}

#[test]
fn a_cancelled_run_gives_back_what_was_there() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::at(folder.path(), Some(&coarse(folder.path(), 150)));
    window.wait_for("Photographs (6)");
    window.click("Reconstruct");
    window.key(egui::Modifiers::COMMAND, egui::Key::R);
    // Run again before the numbers of each sample have been worked out.
    window.wait("the results", |window| window.has_part("Done in "));
    window.key(egui::Modifiers::COMMAND | egui::Modifiers::SHIFT, egui::Key::R);
    window.menu("File", "Close project");
    assert!(window.has_part("The reconstruction that runs would be cancelled"));
    window.click("Cancel");
    window.key(egui::Modifiers::NONE, egui::Key::Escape);
    window.wait("both", |window| !window.harness.state().is_busy());
    window.click("Error per sample");
    assert!(window.has_part("RMS of the logarithm"), "the numbers of each sample are lost");
}

#[test]
fn a_changed_option_runs_again_from_its_stage_on() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::at(folder.path(), Some(&coarse(folder.path(), 150)));
    window.wait_for("Photographs (6)");
    window.click("Reconstruct");
    assert!(!window.has_part("The next run"), "there is nothing to keep yet");
    window.key(egui::Modifiers::COMMAND, egui::Key::R);
    window.wait("the end of the run", |window| !window.harness.state().is_busy());
    assert!(window.has("The next run keeps every stage: nothing has changed."));
    // These stand far down the panel, out of the pointer's reach.
    window.node("Textures").click_accesskit();
    window.step();
    window.node("Enabled").click_accesskit();
    let kept = "The next run keeps samples, transport, solve and lights, and begins with textures.";
    window.wait_for(kept);
    window.click("Run reconstruction");
    window.wait("the end of the run", |window| !window.harness.state().is_busy());
    assert!(window.has_part("samples kept, lights kept, transport kept, solve kept, textures 0."));
    window.click("Run afresh");
    window.wait("the end of the run", |window| !window.harness.state().is_busy());
    assert!(!window.has_part("kept, "), "all of it was done anew");
}
