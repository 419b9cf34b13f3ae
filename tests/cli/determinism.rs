use std::fs;
use std::path::Path;

use crate::{Copy, Run, coarse_by, files_below, json};

/// The bytes of a solution's files, seconds taken out.
pub fn contents(out: &Path) -> Vec<(String, Vec<u8>)> {
    let content = |name: String| {
        let file = out.join(&name);
        let bytes = match name.as_str() {
            "solution.json" => {
                let mut solution = json(&file);
                solution.as_object_mut().unwrap().remove("seconds").expect("seconds");
                solution.to_string().into_bytes()
            }
            "convergence.csv" => {
                let text = fs::read_to_string(&file).unwrap();
                let without = |line: &str| line.rsplit_once(',').unwrap().0.to_owned() + "\n";
                assert!(text.lines().next().unwrap().ends_with(",elapsed_s"));
                text.lines().map(without).collect::<String>().into_bytes()
            }
            _ => fs::read(&file).unwrap(),
        };
        (name, bytes)
    };
    files_below(out).into_iter().map(content).collect()
}

#[test]
fn threads_and_repetition_change_no_byte_and_the_seed_does() {
    let copy = Copy::new();
    // Textures and gloss have their own loops over threads.
    copy.edit("tags.json", |tags| {
        tags["materials"][0]["kind"] = "specular".into();
        tags["materials"][1]["textured"] = true.into();
    });
    let run = |arguments: &[&str]| {
        let out = copy.folder.path().join(arguments.concat());
        let mut command = coarse_by("paper", &copy.capture(), &out);
        command.args(["--textures.rays", "16", "--transport.glossy_rays", "64"]);
        command.args(["--textures.max_side", "96", "--refine.max_iterations", "4"]);
        Run::of(command.args(arguments)).succeeds();
        contents(&out)
    };
    let one = run(&["--threads", "1"]);
    assert_eq!(one.len(), 6, "with a texture and its unwrap");
    for arguments in [&["--threads", "2"][..], &["--threads", "7"], &["--seed", "1"]] {
        for ((name, left), (other, right)) in one.iter().zip(run(arguments)) {
            assert_eq!(*name, other);
            assert!(*left == right, "{name} differs with {arguments:?}");
        }
    }
    for ((name, left), (other, right)) in one.iter().zip(run(&["--seed", "2"])) {
        assert_eq!(*name, other);
        // Where a texture lies does not hang on random numbers.
        assert!(name.ends_with(".obj") || *left != right, "{name} does not change with the seed");
    }
}
