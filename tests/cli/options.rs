use std::fs;

use lobelia::options::Kind;
use lobelia::reconstruct::Options;

use crate::{Copy, Run, coarse, coarse_by, example, json, lobelia};

#[test]
fn flags_win_over_the_file() {
    let copy = Copy::new();
    let file = copy.folder.path().join("options.toml");
    fs::write(
        &file,
        "[refine]\nmax_iterations = 2 # small\nrms_tolerance = 0\n[samples]\nspacing_m = 0.3\n\
         [start]\nfloor = [0.7, 0.6, 0.5]\n",
    )
    .unwrap();
    let iterations = |flags: &[&str]| {
        let mut command = coarse_by("paper", &copy.capture(), &copy.out());
        command.args(["--samples.min_per_material", "0"]);
        Run::of(command.arg("--options").arg(&file).args(flags)).succeeds();
        let solution = json(&copy.out().join("solution.json"));
        (solution["iterations"].as_u64().unwrap(), solution["scene"]["samples"].as_u64().unwrap())
    };
    let (of_file, coarse_samples) = iterations(&[]);
    assert_eq!(of_file, 2);
    let (of_flag, samples) =
        iterations(&["--refine.max_iterations", "3", "--samples.spacing_m", "0.15"]);
    assert_eq!(of_flag, 3);
    assert!(samples > 2 * coarse_samples, "{samples} and {coarse_samples}");
}

#[test]
fn an_options_file_at_fault_is_named_with_the_place() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("options.toml");
    let cases: [(&str, &[&str]); 10] = [
        ("[samples]\ncount = 0\n", &["[samples] count", "0 is outside 1 to 2000000"]),
        ("[samples]\ncuont = 10\n", &["[samples] cuont", "no such option", "spacing_m"]),
        ("[sample]\ncount = 10\n", &["[sample] count", "no such section", "samples, lights"]),
        ("[samples]\nspacing_m = \"wide\"\n", &["spacing_m", "\"wide\" is not a number"]),
        ("[samples]\nreject_edges = 1\n", &["reject_edges", "neither true nor false"]),
        ("[photographs]\ngain = \"cubic\"\n", &["gain", "off, report, apply"]),
        ("[refine]\nridge = nan\n", &["[refine] ridge", "outside 0 to 1"]),
        ("[start]\nfloor = [0.5, 0.5, 1.5]\n", &["[start] floor", "three numbers from 0 to 1"]),
        ("count = 3\n", &["count", "no [section]"]),
        ("[samples]\ncount = 3\n\ncount = = 4\n", &["line 4"]),
    ];
    for (text, parts) in cases {
        fs::write(&file, text).unwrap();
        let mut command = coarse(&example(), &folder.path().join("out"));
        Run::of(command.arg("--options").arg(&file)).fails(1, parts).says(&["options.toml, "]);
    }
    // The line is named wherever the file says a value.
    fs::write(&file, "# mine\n[samples]\nwindow_px = 3\ncount = 0\n").unwrap();
    let mut command = coarse(&example(), &folder.path().join("out"));
    Run::of(command.arg("--options").arg(&file)).fails(1, &["line 4", "[samples] count"]);
    let mut command = coarse(&example(), &folder.path().join("out"));
    Run::of(command.arg("--options").arg(folder.path().join("lost.toml")))
        .fails(1, &["lost.toml", "cannot be read"]);
    assert!(!folder.path().join("out").exists());
}

#[test]
fn a_flag_at_fault_is_named_with_its_range() {
    let folder = tempfile::tempdir().unwrap();
    let cases: [(&[&str], &[&str]); 8] = [
        (&["--lobes.grid", "33"], &["lobes.grid", "33 is outside 1 to 32"]),
        (&["--lobes.grid", "-1"], &["lobes.grid", "\"-1\" is not a whole number"]),
        (&["--textures.texel_px", "0.01"], &["textures.texel_px", "outside 0.1 to 100 px"]),
        (&["--samples.spacing_m", "-0.1"], &["samples.spacing_m", "outside 0.000001 to 1000000 m"]),
        (&["--refine.ridge", "inf"], &["refine.ridge", "outside 0 to 1"]),
        (&["--start", "floor"], &["floor", "MATERIAL=R,G,B"]),
        (&["--start", "floor=1,2,3"], &["floor", "0 to 1"]),
        (&["--start", "flor=0.1,0.2,0.3"], &["\"flor\"", "floor, wall1"]),
    ];
    for (arguments, parts) in cases {
        // Without the coarse flags, since each may be given once.
        let mut command = lobelia();
        command.arg("reconstruct").arg(example()).arg("--out").arg(folder.path().join("out"));
        Run::of(command.args(arguments)).fails(1, parts);
    }
    assert!(!folder.path().join("out").exists());
}

#[cfg(feature = "studio")]
#[test]
fn without_a_display_the_bare_command_tells_the_way_out() {
    let mut command = lobelia();
    for session in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
        command.env_remove(session);
    }
    Run::of(&mut command).fails(1, &["mesa-vulkan-drivers", "reconstruct CAPTURE --out DIR"]);
}

#[cfg(not(feature = "studio"))]
#[test]
fn the_bare_command_prints_help() {
    Run::of(&mut lobelia()).fails(2, &["Usage"]);
}

#[test]
fn wrong_usage_ends_with_2() {
    let cases: [(&[&str], &str); 8] = [
        (&["rebuild"], "rebuild"),
        (&["reconstruct"], "--out <DIR>"),
        (&["reconstruct", "x"], "--out <DIR>"),
        (&["reconstruct", "x", "--out", "y", "--sampels.count", "9"], "--samples.count"),
        (&["reconstruct", "x", "--out", "y", "--photographs.gain", "cubic"], "report"),
        (&["reconstruct", "x", "--out", "y", "--threads", "0"], "threads"),
        (&["score", "x"], "<SOLUTION>"),
        (&["info", "x", "y"], "'y'"),
    ];
    for (arguments, part) in cases {
        Run::of(lobelia().args(arguments)).fails(2, &[part]);
    }
}

#[test]
fn help_lists_every_option_with_unit_and_default() {
    let help = Run::of(lobelia().args(["reconstruct", "--help"])).succeeds();
    // Long lines are wrapped.
    let text = help.out.split_whitespace().collect::<Vec<_>>().join(" ");
    let declarations = Options::default().declarations();
    assert!(declarations.len() > 25);
    for declaration in declarations {
        let flag = match declaration.section {
            "general" => format!("--{} <", declaration.name),
            section => format!("--{section}.{} <", declaration.name),
        };
        let (_, after) = text.split_once(&flag).unwrap_or_else(|| panic!("no {flag}"));
        let own = after.split(" --").next().unwrap();
        let default = format!("[default: {}]", declaration.default);
        assert!(own.contains(&default), "{flag}: {own}");
        assert!(own.contains(&format!("[{}]", declaration.unit)) || declaration.unit.is_empty());
        if let Kind::Choice(names) = declaration.kind {
            assert!(names.iter().all(|name| own.contains(name)), "{flag}: {own}");
        }
    }
    for flag in ["--out", "--options", "--threads", "--start", "--quiet"] {
        assert!(help.out.contains(flag), "{flag}");
    }
    let all = Run::of(lobelia().arg("--help")).succeeds();
    for command in ["reconstruct", "info", "score"] {
        assert!(all.out.contains(command), "{}", all.out);
    }
    let version = Run::of(lobelia().arg("--version")).succeeds();
    assert_eq!(version.out.trim(), format!("lobelia {}", env!("CARGO_PKG_VERSION")));
}
