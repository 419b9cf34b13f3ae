//! Project files come back as they were, older versions too, and damaged ones are refused.

use super::*;

fn project(folder: &Path) -> ProjectFile {
    let mut options = Options::default();
    options.set("samples", "count", "321").unwrap();
    options.set_start("floor", [0.1, 0.2, 0.3]).unwrap();
    ProjectFile {
        capture: folder.join("captures/room"),
        original: None,
        tags: vec![Tag {
            name: "floor".into(),
            specular: true,
            textured: false,
            known_diffuse: Some([0.1, 0.2, 0.3]),
            known_diffuse_sd: None,
            surfaces: vec!["a".into(), "b".into()],
        }],
        lights: Some(vec![
            serde_json::json!({"kind": "point", "position": [0.0, 1.0, 2.0]}),
            serde_json::json!({"kind": "dome", "image": folder.join("sky.exr")}),
        ]),
        environment: Some(Environment::Open),
        charts: Some(vec![serde_json::json!({"name": "card", "table": folder.join("own.csv")})]),
        options,
        relight: Relight::Stored(serde_json::json!({"original_light": 0.5})),
        masks: Masks::from([("images/a.exr".to_owned(), mask())]),
        solution: Some(folder.join("results")),
        results: Some(folder.join("work/a.lobelia-data")),
        view: serde_json::json!({"exposure": 1.5}),
        layout: Value::Null,
    }
}

#[test]
fn a_project_comes_back_and_names_its_capture_relatively() {
    let folder = tempfile::tempdir().unwrap();
    let root = dunce::canonicalize(folder.path()).unwrap();
    std::fs::create_dir_all(root.join("captures/room")).unwrap();
    let file = root.join("work/a.lobelia");
    std::fs::create_dir_all(root.join("work")).unwrap();
    write(&file, &project(&root)).unwrap();
    assert_eq!(read(&file).unwrap(), project(&root));
    let text = std::fs::read_to_string(&file).unwrap();
    assert!(text.contains("\"../captures/room\"") && text.contains("\"../results\""), "{text}");
    assert!(text.contains("\"a.lobelia-data\"") && text.contains("\"../sky.exr\""), "{text}");
    assert!(text.contains("\"../own.csv\""), "{text}");
    assert!(text.contains("\"count\": \"321\"") && !text.contains("exponent"), "{text}");
}

#[test]
fn older_versions_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.lobelia");
    for head in ["", "\"version\": 1, ", "\"version\": 2, ", "\"version\": 3, ", "\"version\": 4, "]
    {
        let text = format!("{{{head}\"capture\": \"x\", \"materials\": []}}");
        std::fs::write(&file, text).unwrap();
        let read = read(&file).unwrap();
        assert!(read.capture.ends_with("x") && read.results.is_none());
        write_over(&file, &read).unwrap();
        assert!(std::fs::read_to_string(&file).unwrap().contains("\"version\": 5"));
    }
}

#[test]
fn other_versions_and_damaged_projects_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.lobelia");
    for (text, part) in [
        (r#"{"version": 6, "capture": "x", "materials": []}"#, "version 6"),
        (
            r#"{"version": 3, "capture": "x", "materials": [], "environment": "cave"}"#,
            "\"cave\" is no light model",
        ),
        (r#"{"version": "new", "capture": "x", "materials": []}"#, "version \"new\""),
        (r#"{"version": 1, "capture": "x"}"#, "materials"),
        (
            r#"{"version": 1, "capture": "x", "materials": [], "options": {"samples": {"count": "x"}}}"#,
            "options.samples.count",
        ),
        (
            r#"{"version": 1, "capture": "x", "materials": [{"name": "a", "specular": false, "surfaces": [], "known_diffuse": [2, 0, 0]}]}"#,
            "between 0 and 1",
        ),
        ("{", "not valid JSON"),
    ] {
        std::fs::write(&file, text).unwrap();
        let message = read(&file).unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    }
}

fn mask() -> Arc<crate::scene::Mask> {
    let left_out: Vec<bool> = (0..60).map(|index| index % 7 < 3).collect();
    Arc::new(crate::scene::Mask::new((10, 6), &left_out))
}

#[test]
fn a_mask_of_other_pixels_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.lobelia");
    for runs in ["1 2", "60 x", "", "18446744073709551615 60"] {
        let text = format!(
            r#"{{"version": 4, "capture": "x", "materials": [],
                "masks": {{"b.exr": {{"width": 10, "height": 6, "runs": "{runs}"}}}}}}"#
        );
        std::fs::write(&file, text).unwrap();
        let message = read(&file).unwrap_err().to_string();
        assert!(message.contains("masks, \"b.exr\"") && message.contains("10 x 6"), "{message}");
    }
}
