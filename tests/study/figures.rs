//! The tables of the guide have the figures of the files that the scripts of `assets/study` write.

use std::collections::HashMap;
use std::path::Path;

type Line = HashMap<String, String>;

fn lines(name: &str) -> Vec<Line> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/study").join(name);
    let mut reader = csv::Reader::from_path(file).unwrap();
    reader.deserialize().collect::<Result<_, _>>().unwrap()
}

/// The cells of the rows of a page's tables.
fn rows(page: &str) -> Vec<Vec<&str>> {
    page.lines()
        .filter(|line| line.starts_with('|'))
        .map(|line| line.trim_matches('|').split('|').map(str::trim).collect())
        .collect()
}

fn rounded(line: &Line, key: &str, digits: usize) -> String {
    line[key].parse::<f64>().map_or_else(|_| String::new(), |value| format!("{value:.digits$}"))
}

#[test]
fn the_tables_of_validation_are_those_of_the_files() {
    let page = include_str!("../../assets/guide/validation.md");
    let rows = rows(page);
    let of_captures = include_str!("../../assets/study/captures.toml");
    let captures: toml::Table = of_captures.parse().unwrap();
    let (accuracy, pictures) = (lines("accuracy.csv"), lines("pictures.csv"));
    for capture in captures["capture"].as_array().unwrap() {
        let (name, what) = (capture["name"].as_str().unwrap(), capture["what"].as_str().unwrap());
        let of = |run: &str| {
            accuracy.iter().find(|line| line["capture"] == name && line["run"] == run).unwrap()
        };
        let joint = of("joint");
        let expected = [
            format!("`{name}`"),
            what.to_owned(),
            rounded(joint, "error", 4),
            rounded(joint, "one_scale", 4),
            rounded(of("pinned"), "error", 4),
            rounded(of("paper"), "error", 4),
            format!("{} of {}", joint["inside"], joint["intervals"]),
        ];
        assert!(rows.iter().any(|row| *row == expected), "{name}: {expected:?}");
        let picture = |run: &str, kind: &str| {
            let is_own = |line: &&Line| {
                line["capture"] == name && line["run"] == run && line["kind"] == kind
            };
            pictures.iter().find(is_own)
        };
        let Some(view) = picture("joint", "view") else { continue };
        let decibels = |line: Option<&Line>| {
            line.map_or_else(String::new, |line| format!("{} dB", rounded(line, "psnr", 1)))
        };
        let expected = [
            what.to_owned(),
            decibels(Some(view)),
            rounded(view, "flip", 3),
            decibels(picture("joint", "relit")),
            decibels(picture("joint", "inserted")),
            decibels(picture("joint", "light_only")),
            decibels(picture("paper", "view")),
        ];
        assert!(rows.iter().any(|row| *row == expected), "{name}: {expected:?}");
    }
}
