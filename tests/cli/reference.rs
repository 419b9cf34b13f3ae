//! The guide and the README: the pages of the reference are what the program and its sources say,
//! every link leads somewhere, and every flag that is named is one.
//!
//! LOBELIA_REFERENCE=write puts the pages in place after a change of the code.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use crate::{Run, lobelia};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn guide() -> PathBuf {
    root().join("assets/guide")
}

/// Every text for readers: its file and contents.
fn pages() -> Vec<(PathBuf, String)> {
    let entries = fs::read_dir(guide()).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<PathBuf> =
        entries.filter(|file| file.extension().is_some_and(|e| e == "md")).collect();
    files.extend(["README.md", "CONTRIBUTING.md", "CHANGELOG.md"].map(|name| root().join(name)));
    files.sort();
    files.into_iter().map(|file| (file.clone(), fs::read_to_string(&file).unwrap())).collect()
}

#[test]
fn the_reference_is_what_the_code_says() {
    let folder = tempfile::tempdir().unwrap();
    Run::of(lobelia().arg("reference").arg(folder.path())).succeeds();
    let written = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    let mut pages: Vec<(&str, String)> =
        vec![("commands.md", written("commands.md")), ("options.md", written("options.md"))];
    if cfg!(feature = "studio") {
        pages.push(("keys.md", written("keys.md")));
    }
    pages.push(("fields.md", fields()));
    pages.push(("messages.md", messages()));
    for (name, text) in pages {
        let file = guide().join(name);
        if std::env::var("LOBELIA_REFERENCE").is_ok_and(|value| value == "write") {
            fs::write(&file, &text).unwrap();
        }
        let stored = fs::read_to_string(&file).unwrap_or_default();
        let differs = stored.lines().zip(text.lines()).find(|(a, b)| a != b);
        assert!(
            stored == text,
            "{} is not what the code says: {differs:?}. Write it anew with LOBELIA_REFERENCE=write",
            file.display()
        );
    }
    for name in ["man/lobelia.1", "man/lobelia-reconstruct.1", "man/lobelia-study-speed.1"] {
        assert!(written(name).contains(".TH lobelia"), "{name}");
    }
    for name in ["bash/lobelia", "zsh/_lobelia", "fish/lobelia.fish"] {
        assert!(written(name).contains("transport.rays"), "{name}");
    }
}

/// What the fields of `solution.json` and `lights.json` mean, by the comments in their source.
fn fields() -> String {
    let source = fs::read_to_string(root().join("src/io/solution.rs")).unwrap();
    let mut text = "# Fields\n\n<!-- Written from src/io/solution.rs; change it instead. -->\n\nThe fields \
                    of `solution.json`, of the objects within it, and of `lights.json`. [Files](files.md) \
                    explains some at more length.\n"
        .to_owned();
    let (mut about, mut inside, mut is_file) = (Vec::new(), false, false);
    for line in source.lines().map(str::trim) {
        if let Some(comment) = line.strip_prefix("/// ") {
            about.push(comment.to_owned());
        } else if line.contains("derive(") {
            is_file = line.contains("Serialize");
        } else if let Some(name) = line.strip_prefix("pub struct ").filter(|_| is_file) {
            let name = name.trim_end_matches(" {");
            let about = std::mem::take(&mut about).join(" ");
            text += &format!("\n## {name}\n\n{about}\n\n| field | type | what |\n|---|---|---|\n");
            inside = true;
        } else if line == "}" {
            inside = false;
        } else if let Some((name, kind)) =
            line.strip_prefix("pub ").and_then(|l| l.split_once(": "))
        {
            let about = std::mem::take(&mut about).join(" ");
            if inside {
                let name = name.trim_end_matches('_');
                let kind = plain_type(kind.trim_end_matches(','));
                text += &format!("| `{name}` | {kind} | {} |\n", about.replace('|', "\\|"));
            }
        } else if !line.starts_with("#[") {
            about.clear();
        }
    }
    text
}

/// A Rust type in the words of JSON.
fn plain_type(kind: &str) -> String {
    let inner = |prefix: &str| kind.strip_prefix(prefix).and_then(|rest| rest.strip_suffix('>'));
    if let Some(kind) = inner("Option<") {
        return format!("{} or null", plain_type(kind));
    }
    if let Some(kind) = inner("Vec<") {
        return format!("list of {}", plain_type(kind));
    }
    match kind {
        "String" => "text",
        "bool" => "true or false",
        "usize" | "u64" => "whole number",
        "f64" => "number",
        "Rgb" | "[f64; 3]" => "three numbers",
        "[f64; 2]" => "two numbers",
        "Intervals" => "for each channel two numbers or null",
        "[bool; CHANNELS]" => "for each channel true or false",
        other => return format!("[{other}](#{})", other.to_lowercase()),
    }
    .to_owned()
}

/// Every warning and error, by the texts in the sources; what differs from case to case is `…`.
fn messages() -> String {
    let mut text = "# Messages\n\n<!-- Written from the sources by tests/cli/reference.rs. -->\n\nErrors name the \
                    file, the place, what is wrong and what to do. The exit code is 1 (2 for wrong usage, 130 \
                    after Ctrl-C). Warnings mean that the rest is usable; they are printed, shown in the log, and \
                    kept in `solution.json`. `…` stands for a name or number. \
                    [Troubleshooting](troubleshooting.md) begins with what you see.\n"
        .to_owned();
    for (title, folder) in [
        ("Reconstruction", "src/reconstruct"),
        ("Cameras and geometry from photographs", "src/model"),
        ("Exposures", "src/exposures"),
        ("Files", "src/io"),
    ] {
        let mut found: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        for file in sources(&root().join(folder)) {
            let source = fs::read_to_string(&file).unwrap();
            let source = source.split("#[cfg(test)]").next().unwrap_or_default();
            let name = file.strip_prefix(root().join(folder)).unwrap().with_extension("");
            let name = name.to_string_lossy().replace('\\', "/").replace("/mod", "");
            let own =
                found.entry(name.split('/').next().unwrap_or_default().to_owned()).or_default();
            own.extend(texts(source));
        }
        text += &format!("\n## {title}\n");
        for (part, own) in found.iter().filter(|(_, own)| !own.is_empty()) {
            text += &format!("\n### {}\n\n", title_of(part));
            for message in own {
                text += &format!("- {message}\n");
            }
        }
    }
    text
}

fn title_of(part: &str) -> String {
    if part == "mod" { "general".to_owned() } else { part.replace('_', " ") }
}

fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            // What stands there goes into files.
            if !["export", "drawing"].iter().any(|name| path.ends_with(name)) {
                files.extend(sources(&path));
            }
        } else if path.extension().is_some_and(|e| e == "rs")
            && !["tests.rs", "fixture.rs"].iter().any(|name| path.ends_with(name))
        {
            files.push(path);
        }
    }
    files
}

/// The sentences among the string literals of a source: what is said to people has several words
/// and is no part of a file that is written.
fn texts(source: &str) -> Vec<String> {
    literals(source)
        .into_iter()
        .filter(|text| {
            text.split_whitespace().filter(|w| w.len() > 1 && w.chars().all(is_wordly)).count() >= 4
        })
        .filter(|text| !text.contains("\\\"") || text.matches("\\\"").count() % 2 == 0)
        .map(|text| placeholders(&text))
        .filter(|text| !text.contains(['{', '}', '<', '>', '=']) || text.contains("--"))
        .collect()
}

fn is_wordly(letter: char) -> bool {
    letter.is_alphabetic() || ",.;:'()-".contains(letter)
}

/// The string literals of a source, with continued lines joined; comments are left out.
fn literals(source: &str) -> Vec<String> {
    let mut found = Vec::new();
    let code: Vec<&str> =
        source.lines().filter(|line| !line.trim_start().starts_with("//")).collect();
    let code: Vec<char> = code.join("\n").chars().collect();
    let mut at = 0;
    while at < code.len() {
        match code[at] {
            // A character, not a lifetime.
            '\'' if code.get(at + 1) == Some(&'\\') => at += 3,
            '\'' if code.get(at + 2) == Some(&'\'') => at += 2,
            '"' => {
                // What holds in any case is said to no user.
                let before: String = code[at.saturating_sub(16)..at].iter().collect();
                let is_said = !["expect(", "unreachable!(", "reason = "]
                    .iter()
                    .any(|call| before.ends_with(call));
                let mut text = String::new();
                at += 1;
                while at < code.len() && code[at] != '"' {
                    if code[at] == '\\' {
                        match code.get(at + 1) {
                            Some('\n') => {
                                at += 1;
                                while code.get(at + 1).is_some_and(|c| c.is_whitespace()) {
                                    at += 1;
                                }
                            }
                            Some('n') => {
                                text.push(' ');
                                at += 1;
                            }
                            Some(other) => {
                                text.push(*other);
                                at += 1;
                            }
                            None => {}
                        }
                    } else {
                        text.push(code[at]);
                    }
                    at += 1;
                }
                found.extend(is_said.then_some(text));
            }
            _ => {}
        }
        at += 1;
    }
    found
}

/// `{name:.2}` as `…`.
fn placeholders(text: &str) -> String {
    let mut out = String::new();
    let mut depth = 0;
    let mut letters = text.replace("{{", "\u{1}").replace("}}", "\u{2}");
    letters = letters.trim().to_owned();
    for letter in letters.chars() {
        match letter {
            '{' => depth += 1,
            '}' => {
                depth -= 1;
                out.push('…');
            }
            _ if depth > 0 => {}
            letter => out.push(letter),
        }
    }
    let out = out.replace('\u{1}', "{").replace('\u{2}', "}");
    out.split_whitespace().collect::<Vec<_>>().join(" ").replace('|', "\\|").replace('*', "\\*")
}

/// Text outside of fenced blocks, and the lines within them.
fn split_fences(text: &str) -> (String, Vec<String>) {
    let (mut prose, mut fenced, mut inside) = (String::new(), Vec::new(), false);
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            inside = !inside;
        } else if inside {
            fenced.push(line.trim().to_owned());
        } else {
            prose.push_str(line);
            prose.push('\n');
        }
    }
    (prose, fenced)
}

/// What a heading is linked by: as GitHub and mdbook make it.
fn anchor(heading: &str) -> String {
    let text = heading.trim_start_matches('#').trim().to_lowercase();
    let kept = text.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

/// The targets of links and pictures of a text.
fn links(prose: &str) -> Vec<String> {
    let starts = prose.match_indices("](").map(|(at, _)| &prose[at + 2..]);
    starts.filter_map(|rest| Some(rest[..rest.find(')')?].to_owned())).collect()
}

#[test]
fn links_lead_somewhere_and_every_page_is_in_the_summary() {
    let pages = pages();
    let anchors: BTreeMap<&Path, BTreeSet<String>> = pages
        .iter()
        .map(|(file, text)| {
            let (prose, _) = split_fences(text);
            let headings = prose.lines().filter(|line| line.starts_with('#'));
            (file.as_path(), headings.map(anchor).collect())
        })
        .collect();
    let mut wrong = Vec::new();
    for (file, text) in &pages {
        for link in links(&split_fences(text).0) {
            if link.starts_with("http") {
                continue;
            }
            let (path, place) = link.split_once('#').unwrap_or((&link, ""));
            let target = match path {
                "" => file.clone(),
                _ => file.parent().unwrap().join(path),
            };
            let is_there = target.exists();
            let has_place = place.is_empty()
                || anchors.get(target.as_path()).is_some_and(|own| own.contains(place));
            // The book holds the guide's folder and nothing else.
            let is_inside = !file.starts_with(guide()) || !path.starts_with("..");
            if !(is_there && has_place && is_inside) {
                wrong.push(format!("{}: {link}", file.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "links that lead nowhere:\n{}", wrong.join("\n"));

    let summary = fs::read_to_string(guide().join("SUMMARY.md")).unwrap();
    let listed: BTreeSet<String> = links(&summary).into_iter().collect();
    let there: BTreeSet<String> = pages
        .iter()
        .filter(|(file, _)| file.starts_with(guide()))
        .map(|(file, _)| file.file_name().unwrap().to_string_lossy().into_owned())
        .filter(|name| name != "SUMMARY.md")
        .collect();
    assert_eq!(listed, there, "pages in the summary, and in the folder");
}

/// The flags within a text: `--samples.count`.
fn flags(text: &str) -> impl Iterator<Item = &str> {
    text.match_indices("--").filter_map(|(at, _)| {
        let begins = at == 0 || text[..at].ends_with([' ', '`', '(', '[']);
        let rest = &text[at + 2..];
        let is_part = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
        let end = rest.find(|c| !is_part(c)).unwrap_or(rest.len());
        let name = rest[..end].trim_end_matches('.');
        (begins && !name.is_empty() && !name.starts_with('-')).then_some(name)
    })
}

#[test]
fn flags_that_are_named_exist() {
    let reference = ["commands.md", "options.md"].map(|name| guide().join(name));
    let known: String = reference
        .iter()
        .map(|file| fs::read_to_string(file).unwrap())
        .collect::<Vec<_>>()
        .join("\n");
    let known: BTreeSet<&str> = flags(&known).chain(["help", "version"]).collect();
    let mut wrong = Vec::new();
    for (file, text) in pages().iter().filter(|(file, _)| !reference.contains(file)) {
        let (prose, fenced) = split_fences(text);
        // Code in a line that is a flag or a command of ours, and lines of commands of ours.
        let spans = prose.split('`').skip(1).step_by(2).map(str::to_owned);
        let is_own = |code: &String| {
            ["--", "lobelia ", "cargo run --release -- "]
                .iter()
                .any(|start| code.starts_with(start))
        };
        for code in spans.chain(fenced).filter(is_own) {
            let own = code.strip_prefix("cargo run --release").unwrap_or(&code);
            let unknown = flags(own).filter(|flag| !known.contains(flag));
            wrong.extend(unknown.map(|flag| format!("{}: --{flag}", file.display())));
        }
    }
    assert!(wrong.is_empty(), "flags that do not exist:\n{}", wrong.join("\n"));
}

#[test]
fn the_readme_is_one_page() {
    let readme = fs::read_to_string(root().join("README.md")).unwrap();
    assert!(readme.lines().count() <= 100, "{} lines", readme.lines().count());
    assert_eq!(readme.matches("![").count(), 1, "pictures");
}
