use std::fs;

use exr::prelude::{ReadChannels, ReadLayers};

use crate::{Copy, Run, coarse, files_below, json};

#[test]
fn textures_are_written_with_their_unwrap_and_gloss_with_its_exponent() {
    let copy = Copy::new();
    copy.edit("tags.json", |tags| {
        tags["materials"][0]["kind"] = "specular".into();
        tags["materials"][1]["textured"] = true.into();
    });
    let mut command = coarse(&copy.capture(), &copy.out());
    command.args(["--textures.rays", "36", "--transport.glossy_rays", "100"]);
    let run = Run::of(command.args(["--textures.max_side", "128"])).succeeds();
    assert!(run.out.contains("specular") && run.out.contains("exponent"), "{}", run.out);
    let files = files_below(&copy.out());
    assert_eq!(
        files,
        [
            "convergence.csv",
            "lights.json",
            "samples.csv",
            "solution.json",
            "textures/wall1.exr",
            "textures/wall1.obj"
        ]
    );
    let solution = json(&copy.out().join("solution.json"));
    the_floor_is_glossy(&solution["materials"][0]);
    the_mean_is_of_the_seen_texels(&copy, &solution["materials"][1]);
    the_unwrap_covers_the_wall(&copy);

    // Switched off, nothing of it is written.
    let other = copy.folder.path().join("other");
    let mut command = coarse(&copy.capture(), &other);
    command.args(["--textures.enabled", "false", "--transport.glossy_rays", "100"]);
    Run::of(&mut command).succeeds();
    assert!(!other.join("textures").exists());
}

fn the_floor_is_glossy(floor: &serde_json::Value) {
    assert_eq!((&floor["name"], &floor["kind"]), (&"floor".into(), &"specular".into()));
    for channel in 0..3 {
        let (diffuse, specular) = (&floor["diffuse"][channel], &floor["specular"][channel]);
        let (diffuse, specular) = (diffuse.as_f64().unwrap(), specular.as_f64().unwrap());
        assert!(diffuse >= 0.0 && specular >= 0.0 && diffuse + specular <= 1.0 + 1e-9);
    }
    let is_black = floor["specular"].as_array().unwrap().iter().all(|v| v.as_f64() == Some(0.0));
    // An exponent of nothing is no number.
    assert_eq!(floor["exponent"].is_null(), is_black, "{floor}");
}

fn the_mean_is_of_the_seen_texels(copy: &Copy, wall: &serde_json::Value) {
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_file(copy.out().join("textures/wall1.exr"))
        .unwrap();
    let channel = |name: &str| -> Vec<f64> {
        let mut channels = image.layer_data.channel_data.list.iter();
        let channel = channels.find(|channel| channel.name == *name).expect("the channel");
        channel.sample_data.values_as_f32().map(f64::from).collect()
    };
    let seen = channel("seen");
    let count = seen.iter().sum::<f64>();
    assert!(seen.iter().all(|v| [0.0, 1.0].contains(v)) && count > 100.0);
    for (index, name) in ["R", "G", "B"].into_iter().enumerate() {
        let values = channel(name);
        assert!(values.iter().all(|v| v.is_finite() && *v >= 0.0));
        let sum: f64 = values.iter().zip(&seen).map(|(value, seen)| value * seen).sum();
        let diffuse = wall["diffuse"][index].as_f64().unwrap();
        // Texels are stored as halves.
        assert!((sum / count - diffuse).abs() < 1e-3, "{name}: {} and {diffuse}", sum / count);
    }
}

fn the_unwrap_covers_the_wall(copy: &Copy) {
    let text = fs::read_to_string(copy.out().join("textures/wall1.obj")).unwrap();
    let numbers = |kind: &str| -> Vec<Vec<f64>> {
        let own = text.lines().filter_map(|line| line.strip_prefix(kind));
        own.map(|line| line.split_whitespace().map(|word| word.parse().unwrap()).collect())
            .collect()
    };
    let (vertices, places) = (numbers("v "), numbers("vt "));
    assert_eq!((vertices.len(), places.len()), (6, 6), "two triangles");
    // The wall stands at x = 0 and is 3.3 m by 3 m.
    assert!(vertices.iter().all(|v| v[0] == 0.0));
    for (axis, size) in [(1, 3.3), (2, 3.0)] {
        let largest = vertices.iter().map(|v| v[axis]).fold(0.0, f64::max);
        assert!((largest - size).abs() < 1e-6);
    }
    assert!(places.iter().flatten().all(|v| (0.0..=1.0).contains(v)));
    assert!(text.contains("usemtl wall1"));
}
