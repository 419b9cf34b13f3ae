//! The rules of the house that no compiler checks: the ladder of modules, import cycles, lengths of
//! files, and words that were replaced. Every exception stands here with its date and reason.
//!
//! Sources are read line by line, without a parser: comments are left out, `use` trees expanded, and
//! paths in code found that begin with `crate::`, `super::` or an imported module of the crate. What
//! is renamed by `as` counts as imported from where it is renamed.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Modules from the bottom up: each imports only from those on lines above its own.
const LADDER: [&[&str]; 13] = [
    &["watch", "options", "math"],
    &["geometry", "solve", "exposures"],
    &["scene"],
    &["model"],
    &["reconstruct"],
    &["render"],
    &["gpu"],
    &["io"],
    &["study"],
    &["worker"],
    &["app"],
    &["cli"],
    &["main"],
];

/// Imports within one line of the ladder, downwards in the order of that line.
const BESIDE: [(&str, &str); 1] = [("options", "math")];

/// Longest file, in lines.
const LONGEST: usize = 430;

/// Files that were longer on 2026-11-22, with their lengths then. A file may not grow beyond its
/// entry; an entry goes when the file has come below [`LONGEST`].
const LONG: [(&str, usize); 3] = [
    ("src/cli/arguments.rs", 480),
    ("src/reconstruct/joint/system.rs", 660),
    ("src/study/chart.rs", 507),
];

/// Folders whose files import each other in no circle, those inside that count as one file, and
/// how many files a circle may have at most.
const CIRCLES: [(&str, &[&str], usize); 3] = [
    // The joint solve is rewritten; until then it counts as one file.
    ("reconstruct", &["reconstruct::joint"], 0),
    ("io", &[], 0),
    // 2026-11-26: a few files that show one thing together, as parts of the 3D view do, may.
    ("app", &[], 5),
];

/// Imports that close a circle, as importing and imported file, with the date of the entry and why
/// it is left. An entry goes with its import.
const CYCLES: [(&str, &str, &str); 8] = [
    ("reconstruct::joint", "reconstruct::options", WHOLE_OPTIONS_OF_JOINT),
    ("reconstruct::refine", "reconstruct::options", WHOLE_OPTIONS),
    ("reconstruct::textures", "reconstruct::options", WHOLE_OPTIONS),
    ("reconstruct::textures::light", "reconstruct::options", WHOLE_OPTIONS),
    ("io::exr", "io::picture", LIMITS),
    ("io::hdr", "io::picture", LIMITS),
    ("io::raw", "io::picture", LIMITS),
    ("io::raw", "io::photograph", "2026-11-22: EXIF times are read by photograph.rs for both"),
];
const WHOLE_OPTIONS: &str = "2026-11-22: takes all options; hand it those of the stages it reads";
const WHOLE_OPTIONS_OF_JOINT: &str = "2026-11-26: problem.rs takes all options, too";
const LIMITS: &str = "2026-11-22: sizes that are refused are declared beside the choice of reader";

/// Files of the window that compute in parallel themselves, and why.
const PARALLEL: [(&str, &str); 1] = [(
    "src/app/viewport/texels.rs",
    "2026-11-22: photographs are resampled for upload on a background thread",
)];

/// Controls that are off while the work goes on that is told beside them.
const OFF_WHILE_AT_WORK: [&str; 2] =
    ["ui.add_enabled_ui(!is_copying, |ui| {", "ui.add_enabled_ui(!own.is_running(), |ui| {"];

/// Words that were replaced by the field's own, and what stands in their place.
const BANNED: [(&str, &str); 26] = [
    ("PixelMap", "VisibilityBuffer: it is what rendering calls a visibility buffer"),
    ("Sightlines", "VisibilityCache"),
    ("Site", "SurfacePoint"),
    ("HiddenLight", "PatchRadiosity: radiosity of patches that no photograph shows"),
    ("hidden_light", "patch_radiosity"),
    ("first_hidden", "first_unphotographed"),
    ("Keeper", "StageCache"),
    ("run_keeping", "run_cached"),
    ("Happening", "JobEvent"),
    ("Wish", "PreviewRequest, SpeedRequest, StabilityRequest"),
    ("SpeedWish", "SpeedRequest"),
    ("StabilityWish", "StabilityRequest"),
    ("Desk", "LatestRequest"),
    ("give_way", "lower_thread_priority"),
    ("Takeaway", "SceneExport"),
    ("TakeElsewhere", "ExportScene"),
    ("Harm", "Degradation"),
    ("Way", "Variant: of the solve whose stability is compared"),
    ("Course", "DegradationCurve, or StudyProgress"),
    ("Stake", "UnsavedWork"),
    ("open_anyway", "open_unprompted"),
    ("asks_the_same", "same_reconstruction_inputs"),
    ("scholar", "study_worker"),
    ("is_telling", "is_significant"),
    ("so-manieth", "every k-th"),
    ("Filmic", "PBR Neutral: a view transform has the name by which it is published"),
];

/// A source file: its path from the root of the project, and its lines.
struct Source {
    path: String,
    text: String,
}

fn sources() -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut folders = vec![root.join("src")];
    let mut files: Vec<PathBuf> = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            match path.extension() {
                _ if path.is_dir() => folders.push(path),
                Some(extension) if extension == "rs" => files.push(path),
                _ => {}
            }
        }
    }
    files.sort();
    files
        .into_iter()
        .map(|file| Source {
            path: file.strip_prefix(root).unwrap().to_str().unwrap().replace('\\', "/"),
            text: fs::read_to_string(&file).unwrap(),
        })
        .collect()
}

/// The code of a file without line comments; comments behind code stay, as do strings.
fn code(text: &str) -> String {
    let is_code = |line: &&str| !line.trim_start().starts_with("//");
    text.lines().filter(is_code).collect::<Vec<_>>().join("\n")
}

/// The module of a file: `src/io/mesh/mod.rs` and `src/io/mesh.rs` are `["io", "mesh"]`.
fn module(path: &str) -> Vec<String> {
    let inner = path.trim_start_matches("src/").trim_end_matches(".rs");
    inner.split('/').filter(|part| *part != "mod").map(str::to_owned).collect()
}

/// Every path of a `use` tree: `a::{b, c::{d, self}}` is `a::b`, `a::c::d` and `a::c`.
fn expanded(tree: &str) -> Vec<String> {
    let tree = tree.trim();
    let tree =
        tree.split_once(" as ").filter(|_| !tree.contains('{')).map_or(tree, |(path, _)| path);
    let Some((prefix, rest)) = tree.split_once('{') else {
        return vec![tree.trim_end_matches("::self").to_owned()];
    };
    let body = rest.strip_suffix('}').unwrap_or(rest);
    let (mut parts, mut depth, mut part) = (Vec::new(), 0, String::new());
    for character in body.chars() {
        match character {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(std::mem::take(&mut part));
                continue;
            }
            _ => {}
        }
        part.push(character);
    }
    parts.push(part);
    let parts = parts.iter().filter(|part| !part.trim().is_empty());
    parts.flat_map(|part| expanded(&format!("{}{}", prefix.trim(), part.trim()))).collect()
}

/// The trees of all `use` statements of a file's code, and whether other files may take names from
/// there, too (`pub use`).
fn uses(code: &str) -> Vec<(String, bool)> {
    let mut uses = Vec::new();
    for statement in code.split(';') {
        // Behind an attribute or `pub(super)`, and not the end of a longer word.
        let starts = statement.match_indices("use ").filter(|(at, _)| {
            let before = statement[..*at].trim_end();
            statement[..*at].ends_with(['\n', ' ']) || before.is_empty()
        });
        if let Some((at, _)) = starts.last() {
            let tree = statement[at + 4..].split_whitespace().collect::<Vec<_>>().join(" ");
            let line = statement[..at].lines().last().unwrap_or_default();
            uses.push((tree, line.trim_start().starts_with("pub")));
        }
    }
    uses
}

/// A path that a module names, from the crate's root; `None` where it leads out of the crate, or
/// begins with a name of the module's own.
fn absolute(module: &[String], path: &str) -> Option<Vec<String>> {
    let parts: Vec<String> = path.split("::").map(|part| part.trim().to_owned()).collect();
    let up = parts.iter().take_while(|part| *part == "super").count();
    match parts[0].as_str() {
        "crate" => Some(parts[1..].to_vec()),
        "self" => Some([module, &parts[1..]].concat()),
        "super" => Some([&module[..module.len().checked_sub(up)?], &parts[up..]].concat()),
        _ => None,
    }
}

/// All paths into the crate that a file of a module names, from the crate's root: of `use` trees,
/// and in its code.
fn imports(module: &[String], text: &str) -> BTreeSet<Vec<String>> {
    let code = code(text);
    let mut paths: Vec<String> = uses(&code).iter().flat_map(|(tree, _)| expanded(tree)).collect();
    let is_part = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
    for root in ["crate::", "super::"] {
        for (at, _) in code.match_indices(root) {
            let rest = &code[at..];
            let end = rest.find(|c| !is_part(c)).unwrap_or(rest.len());
            // A `use` tree is read above; of `super::super::` the first counts.
            if !code[..at].ends_with(is_part) {
                paths.push(rest[..end].trim_end_matches(':').to_owned());
            }
        }
    }
    let paths = paths.iter().filter_map(|path| absolute(module, path));
    paths.filter(|path| !path.is_empty()).collect()
}

/// The names of an imported module that a file's code has: `files::open` of `app::files`.
fn names_of(module: &[String], text: &str) -> Vec<Vec<String>> {
    let Some(last) = module.last() else { return Vec::new() };
    let is_part = |c: char| c.is_alphanumeric() || c == '_';
    let (code, before) = (code(text), format!("{last}::"));
    let found = code.match_indices(&before).filter(|(at, _)| {
        let before = &code[..*at];
        !before.ends_with(is_part) && !before.ends_with(':')
    });
    let name = |(at, _): (usize, &str)| {
        let rest = &code[at + before.len()..];
        rest[..rest.find(|c| !is_part(c)).unwrap_or(rest.len())].to_owned()
    };
    found.map(|own| [module, &[name(own)]].concat()).collect()
}

/// The names that files hand on from others by `pub use`: as they are known there, and as they are
/// known where they come from.
fn handed_on(own: &[(Vec<String>, &Source)]) -> BTreeMap<Vec<String>, Vec<String>> {
    let is_module = |path: &[String]| own.iter().any(|(module, _)| *module == path);
    let mut names = BTreeMap::new();
    for (module, source) in own {
        let uses = uses(&code(&source.text));
        let paths = uses.iter().filter(|(_, is_public)| *is_public);
        for path in paths.flat_map(|(tree, _)| expanded(tree)) {
            let inner = || {
                let parts: Vec<String> = path.split("::").map(str::to_owned).collect();
                is_module(&[module, &parts[..1]].concat()).then(|| [module, &parts[..]].concat())
            };
            let Some(from) = absolute(module, &path).or_else(inner) else { continue };
            if let Some(name) = from.last().cloned() {
                names.insert([&module[..], &[name]].concat(), from);
            }
        }
    }
    names
}

/// Where a module stands in the ladder, and its place on that line.
fn rung(module: &str) -> Option<usize> {
    LADDER.iter().position(|line| line.contains(&module))
}

/// Imports of modules that are not below the importing one.
fn upwards(source: &Source) -> Vec<String> {
    let own = module(&source.path);
    let Some(from) = rung(&own[0]) else { return Vec::new() };
    let is_upwards = |other: &str| {
        let is_beside = BESIDE.contains(&(own[0].as_str(), other));
        other != own[0] && !is_beside && rung(other).is_some_and(|to| to >= from)
    };
    let paths = imports(&own, &source.text);
    let wrong = paths.iter().filter(|path| is_upwards(&path[0]));
    wrong.map(|path| format!("{} imports {}", source.path, path.join("::"))).collect()
}

/// For each file of a folder the other files of it that it imports; a name that is handed on is
/// one of the file that it comes from. A module's file and those below it belong together: an
/// import of an ancestor, or by one, is no arrow. What lies in a folder of `whole` counts as one
/// file.
fn arrows(sources: &[Source], folder: &str, whole: &[&str]) -> BTreeMap<String, BTreeSet<String>> {
    let name = |path: &[String]| -> String {
        let name = path.join("::");
        let inside = |folder: &&&str| name == **folder || name.starts_with(&format!("{folder}::"));
        whole.iter().find(inside).map_or(name.clone(), |folder| (*folder).to_owned())
    };
    let own: Vec<(Vec<String>, &Source)> = sources
        .iter()
        .map(|source| (module(&source.path), source))
        .filter(|(module, _)| module[0] == folder)
        .collect();
    let modules: BTreeSet<&Vec<String>> = own.iter().map(|(module, _)| module).collect();
    let handed_on = handed_on(&own);
    let mut arrows: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (module, source) in &own {
        let to = arrows.entry(name(module)).or_default();
        let imports = imports(module, &source.text);
        let of_imported = imports.iter().filter(|path| modules.contains(path));
        let of_imported = of_imported.flat_map(|path| names_of(path, &source.text));
        for mut path in imports.iter().cloned().chain(of_imported) {
            let known = |path: &[String]| {
                let from = (1..=path.len()).find_map(|k| Some((k, handed_on.get(&path[..k])?)));
                from.map(|(k, from)| [&from[..], &path[k..]].concat())
            };
            // Names that two files hand to each other would have no end.
            for _ in 0..handed_on.len() {
                match known(&path) {
                    Some(from) if from != path => path = from,
                    _ => break,
                }
            }
            let file = (1..=path.len()).rev().map(|k| path[..k].to_vec());
            let Some(file) = file.into_iter().find(|file| modules.contains(file)) else { continue };
            if !file.starts_with(module)
                && !module.starts_with(&file)
                && name(&file) != name(module)
            {
                to.insert(name(&file));
            }
        }
    }
    arrows
}

/// The circles of imports: files of which each imports all the others of its circle, if not itself
/// then through others. A file in no circle is left out.
fn circles(arrows: &BTreeMap<String, BTreeSet<String>>) -> Vec<BTreeSet<String>> {
    let reached = |file: &String| {
        let mut reached = BTreeSet::new();
        let mut next: Vec<&String> = arrows.get(file).into_iter().flatten().collect();
        while let Some(file) = next.pop() {
            if reached.insert(file.clone()) {
                next.extend(arrows.get(file).into_iter().flatten());
            }
        }
        reached
    };
    let reached: BTreeMap<&String, BTreeSet<String>> =
        arrows.keys().map(|file| (file, reached(file))).collect();
    let circle = |(file, to): (&&String, &BTreeSet<String>)| -> BTreeSet<String> {
        let returns = |other: &&String| reached.get(other).is_some_and(|to| to.contains(*file));
        to.iter().filter(returns).cloned().collect()
    };
    let circles: BTreeSet<BTreeSet<String>> = reached.iter().map(circle).collect();
    circles.into_iter().filter(|circle| !circle.is_empty()).collect()
}

/// Whether a text has a word, not as part of a longer one.
fn has_word(text: &str, word: &str) -> bool {
    let is_part = |c: char| c.is_alphanumeric() || c == '_';
    text.match_indices(word).any(|(at, _)| {
        !text[..at].ends_with(is_part) && !text[at + word.len()..].starts_with(is_part)
    })
}

fn none(wrong: Vec<String>, rule: &str) {
    assert!(wrong.is_empty(), "{rule}:\n{}", wrong.join("\n"));
}

#[test]
fn modules_import_only_from_those_above_them() {
    let wrong = sources().iter().flat_map(upwards).collect();
    none(wrong, "imports against the ladder of src/lib.rs");
}

#[test]
fn files_do_not_import_each_other_in_a_circle() {
    let sources = sources();
    let mut wrong = Vec::new();
    for (folder, whole, most) in CIRCLES {
        let mut arrows = arrows(&sources, folder, whole);
        for (from, to, _) in CYCLES {
            if let Some(imports) = arrows.get_mut(from) {
                assert!(imports.remove(to), "{from} imports {to} no more: take it off the list");
            }
        }
        for circle in circles(&arrows).into_iter().filter(|circle| circle.len() > most) {
            wrong.push(format!("{} files, {most} at most:", circle.len()));
            for file in &circle {
                let inside: Vec<&str> =
                    arrows[file].intersection(&circle).map(String::as_str).collect();
                wrong.push(format!("    {file} imports {}", inside.join(", ")));
            }
        }
    }
    none(wrong, "files that import each other in a circle");
}

#[test]
fn files_are_short() {
    let mut wrong = Vec::new();
    for source in sources() {
        let lines = source.text.lines().count();
        let listed = LONG.iter().find(|(path, _)| *path == source.path);
        let most = listed.map_or(LONGEST, |(_, most)| *most);
        if lines > most {
            wrong.push(format!("{}: {lines} lines, {most} at most", source.path));
        } else if listed.is_some() && lines <= LONGEST {
            wrong.push(format!("{}: {lines} lines, so take it off the list", source.path));
        }
    }
    none(wrong, "look for the second subject in these files");
}

#[test]
fn the_window_leaves_parallel_work_to_the_worker() {
    let in_app = sources().into_iter().filter(|source| source.path.starts_with("src/app/"));
    let wrong = in_app.filter(|source| {
        has_word(&code(&source.text), "rayon")
            && !PARALLEL.iter().any(|(path, _)| *path == source.path)
    });
    none(wrong.map(|source| source.path).collect(), "rayon in src/app");
}

#[test]
fn what_is_disabled_says_why() {
    /// Lines within which the reason follows.
    const NEAR: usize = 24;
    let mut wrong = Vec::new();
    for source in sources().iter().filter(|source| source.path.starts_with("src/app/")) {
        let lines: Vec<&str> = source.text.lines().collect();
        for (at, line) in lines.iter().enumerate() {
            let is_control = line.contains(".add_enabled(") || line.contains(".add_enabled_ui(");
            if !is_control || OFF_WHILE_AT_WORK.contains(&line.trim()) {
                continue;
            }
            let near = &lines[at..lines.len().min(at + NEAR)];
            if !near.iter().any(|line| line.contains(".on_disabled_hover_text(")) {
                wrong.push(format!("{}:{}: {}", source.path, at + 1, line.trim()));
            }
        }
    }
    none(wrong, "give these controls on_disabled_hover_text");
}

#[test]
fn replaced_words_do_not_come_back() {
    let mut wrong = Vec::new();
    for source in sources() {
        for (number, line) in source.text.lines().enumerate() {
            // Sentences may begin with a word that is banned as a name.
            let is_comment = line.trim_start().starts_with("//");
            for (word, instead) in BANNED.iter().filter(|_| !is_comment) {
                if has_word(line, word) {
                    wrong.push(format!("{}:{}: {word}: {instead}", source.path, number + 1));
                }
            }
        }
    }
    none(wrong, "words that were replaced");
}

mod reads {
    use super::*;

    fn source(path: &str, text: &str) -> Source {
        Source { path: path.to_owned(), text: text.to_owned() }
    }

    fn paths(module: &str, text: &str) -> Vec<String> {
        let module: Vec<String> = module.split("::").map(str::to_owned).collect();
        imports(&module, text).into_iter().map(|path| path.join("::")).collect()
    }

    #[test]
    fn files_belong_to_modules() {
        assert_eq!(module("src/io/mesh/mod.rs"), ["io", "mesh"]);
        assert_eq!(module("src/io/exr/write.rs"), ["io", "exr", "write"]);
        assert_eq!(module("src/watch.rs"), ["watch"]);
    }

    #[test]
    fn use_trees_are_expanded() {
        assert_eq!(expanded("a::{b, c::{d, self}, e as f}"), ["a::b", "a::c::d", "a::c", "a::e"]);
        assert_eq!(expanded("a::b as c"), ["a::b"]);
    }

    #[test]
    fn imports_are_found_wherever_they_stand() {
        let text = "//! crate::not\nuse std::fs;\nuse super::x::{self,\n    Y};\n\
                    // use crate::nor;\nfn f() {\n    crate::scene::g(self::z);\n}\n\
                    #[cfg(test)]\nmod tests {\n    use crate::io as files;\n}\n\
                    pub(super) use crate::watch::Watch;\npub use self::own::Thing;";
        let expected = ["io", "m::n::own::Thing", "m::x", "m::x::Y", "scene::g", "watch::Watch"];
        assert_eq!(paths("m::n", text), expected);
    }

    #[test]
    fn an_import_from_above_is_found() {
        let wrong = source("src/scene/views.rs", "use crate::{io, watch};");
        assert_eq!(upwards(&wrong), ["src/scene/views.rs imports io"]);
        let beside = source("src/geometry/mesh.rs", "use crate::solve::kernels;");
        assert_eq!(upwards(&beside).len(), 1);
        let sound = source("src/scene/views.rs", "use crate::geometry::bvh;\nuse crate::scene::X;");
        assert!(upwards(&sound).is_empty());
    }

    #[test]
    fn a_circle_is_found_and_a_family_is_none() {
        let files = |c: &str| {
            [
                source("src/io/mod.rs", "pub use self::a::A;"),
                source("src/io/a.rs", "use super::b::B;\nuse crate::io::Error;"),
                source("src/io/b.rs", "use crate::io::c;"),
                source("src/io/c.rs", c),
                source("src/io/c/d.rs", "use super::C;"),
            ]
        };
        assert!(circles(&arrows(&files("use self::d::D;"), "io", &[])).is_empty());
        let closed = circles(&arrows(&files("use super::a;"), "io", &[]));
        assert_eq!(closed, [BTreeSet::from(["io::a", "io::b", "io::c"].map(str::to_owned))]);
        // As one file with c, b imports nothing from another.
        let files =
            [source("src/io/j/b.rs", "use super::c;"), source("src/io/j/c.rs", "use super::b;")];
        assert!(circles(&arrows(&files, "io", &["io::j"])).is_empty());
        assert_eq!(circles(&arrows(&files, "io", &[])).len(), 1);
    }

    #[test]
    fn a_name_that_is_handed_on_is_of_the_file_that_has_it() {
        let files = |handed_on: &str| {
            [
                source("src/io/mod.rs", "mod a;\nmod b;"),
                source("src/io/a/mod.rs", handed_on),
                source("src/io/a/own.rs", "use crate::io::b::{B, C};"),
                source("src/io/a/other.rs", "pub struct Other;"),
                source("src/io/b.rs", "use super::a;\nfn f() {\n    a::made();\n}"),
            ]
        };
        let closed = circles(&arrows(&files("pub use own::{made, M};"), "io", &[]));
        assert_eq!(closed, [BTreeSet::from(["io::a::own", "io::b"].map(str::to_owned))]);
        assert!(circles(&arrows(&files("pub use other::made;"), "io", &[])).is_empty());
        // Not handed on, so `made` would be of the folder's own file.
        assert!(circles(&arrows(&files("use own::made;"), "io", &[])).is_empty());
    }

    #[test]
    fn words_are_whole() {
        assert!(has_word("let a = Site { x };", "Site") && has_word("Site", "Site"));
        assert!(!has_word("WebSite Sites my_Site", "Site"));
    }
}
