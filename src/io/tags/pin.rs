//! Writes what was read of a chart into `tags.json`; the rest of the file is kept as it is.

use std::fmt::Write;
use std::ops::Range;
use std::path::Path;

use glam::{DMat3, DVec2};
use serde_json::{Value, json};

use super::charts::{self, ChartTag};
use crate::io::json::{self as reader, Field};
use crate::io::paths::{absolute, relative};
use crate::io::{Error, Fault, atomic};
use crate::scene::{Capture, MaterialKind};

/// A chart in a photograph, to be written.
#[derive(Clone, Debug, PartialEq)]
pub struct Pin<'a> {
    pub name: &'a str,
    /// The members that say what it reflects: `kind` and what belongs to it.
    pub kind: Value,
    /// `file_path` of the photograph.
    pub photograph: &'a str,
    pub corners_px: [DVec2; 4],
}

/// The kind of a chart that a table describes, for a `tags.json` in `folder`.
pub fn of_table(folder: &Path, table: &Path) -> Value {
    json!({"kind": "table", "table": relative(&absolute(folder), &absolute(table))})
}

/// A changed `tags.json` that is not written yet.
#[derive(Clone, Debug)]
pub struct Changed<'a> {
    file: &'a Path,
    text: String,
}

impl<'a> Changed<'a> {
    /// The file as it is; where there is none, one that says of `capture` what holds without.
    pub fn begin(file: &'a Path, capture: &Capture) -> Result<Self, Error> {
        let text = if file.exists() { reader::read_text(file)? } else { plain(capture) };
        let changed = Self { file, text };
        Field::root(file, &changed.value()?)?;
        Ok(changed)
    }

    /// With a chart; one of that name and kind is kept, and gets the photograph as well.
    pub fn pin(&mut self, pin: &Pin) -> Result<ChartTag, Error> {
        let corners: Vec<_> =
            pin.corners_px.iter().map(|corner| json!(corner.to_array())).collect();
        let view = json!({"file_path": pin.photograph, "corners": corners});
        let root = self.value()?;
        let charts = root.get("charts").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
        let own = charts.iter().position(|own| own.get("name") == Some(&json!(pin.name)));
        let mut chart =
            own.map_or_else(|| json!({"name": pin.name, "views": []}), |own| charts[own].clone());
        let place = own.unwrap_or(charts.len());
        if own.is_some() && chart.get("kind") != pin.kind.get("kind") {
            return Err(Error::Invalid(Fault::new(
                self.file,
                format!("charts[{place}]"),
                format!("the chart \"{}\" is of another kind", pin.name),
                "Give this one another name",
            )));
        }
        if let (Some(members), Some(kind)) = (chart.as_object_mut(), pin.kind.as_object()) {
            members.extend(kind.clone());
            let views = members.entry("views").or_insert_with(|| json!([]));
            if let Some(views) = views.as_array_mut() {
                views.retain(|own| own.get("file_path") != view.get("file_path"));
                views.push(view);
            }
        }
        self.put_chart(&chart_text(&chart), own);
        let root = self.value()?;
        let root = Field::root(self.file, &root)?;
        let items = root.need("charts")?.items()?;
        items.get(place).map_or_else(|| Err(root.wrong("the charts are no list")), charts::read)
    }

    /// Without a matrix: photographs are left as they are in their files.
    pub fn remove_color_matrix(&mut self) {
        let members = items(&self.text, self.text.find('{').unwrap_or(0));
        let Some(place) = place_of(&self.text, &members, "color_matrix") else { return };
        // The comma before it goes with it, or that after it.
        let range = match (place.checked_sub(1), members.get(place + 1)) {
            (Some(before), _) => members[before].end..members[place].end,
            (None, Some(after)) => members[place].start..after.start,
            (None, None) => members[place].clone(),
        };
        self.text.replace_range(range, "");
    }

    /// With the matrix by which photographs are multiplied.
    pub fn set_color_matrix(&mut self, matrix: &DMat3) {
        let row = |row: usize| json!(matrix.row(row).to_array()).to_string();
        let text = format!("[{}, {}, {}]", row(0), row(1), row(2));
        self.put_member("color_matrix", &text);
    }

    pub fn write(&self) -> Result<(), Error> {
        self.value()?;
        atomic::write_bytes(self.file, self.text.as_bytes())
    }

    fn value(&self) -> Result<Value, Error> {
        reader::parse_bytes(self.file, self.text.as_bytes())
    }

    /// Puts a chart in the place of another, or behind the others.
    fn put_chart(&mut self, chart: &str, place: Option<usize>) {
        let Some(list) = member(&self.text, "charts") else {
            return self.put_member("charts", &format!("[\n    {chart}\n  ]"));
        };
        let items = items(&self.text, list.start);
        match (place.and_then(|place| items.get(place)), items.last()) {
            (Some(own), _) => self.text.replace_range(own.clone(), chart),
            (None, Some(last)) => self.text.insert_str(last.end, &format!(",\n    {chart}")),
            (None, None) => self.text.replace_range(list, &format!("[\n    {chart}\n  ]")),
        }
    }

    /// Sets a member of the file.
    fn put_member(&mut self, key: &str, value: &str) {
        if let Some(own) = member(&self.text, key) {
            return self.text.replace_range(own, value);
        }
        let start = self.text.find('{').unwrap_or(0);
        match items(&self.text, start).last() {
            Some(last) => self.text.insert_str(last.end, &format!(",\n  \"{key}\": {value}")),
            None => self.text.insert_str(start + 1, &format!("\n  \"{key}\": {value}\n")),
        }
    }
}

/// What holds without the file: every material of its own.
fn plain(capture: &Capture) -> String {
    let mut text = "{\n  \"materials\": [".to_owned();
    for (index, material) in capture.materials.iter().enumerate() {
        let surfaces: Vec<&str> =
            material.surfaces.iter().map(|&own| capture.surfaces[own].name.as_str()).collect();
        let kind = match material.kind {
            MaterialKind::Diffuse => "diffuse",
            MaterialKind::Specular => "specular",
        };
        let comma = if index > 0 { "," } else { "" };
        let (name, surfaces) = (json!(material.name), json!(surfaces));
        let _ = write!(
            text,
            "{comma}\n    {{ \"name\": {name}, \"kind\": \"{kind}\", \"surfaces\": {surfaces} }}"
        );
    }
    text + "\n  ]\n}\n"
}

/// A chart, its views on a line each.
fn chart_text(chart: &Value) -> String {
    let members = chart.as_object().into_iter().flatten().filter(|(key, _)| *key != "views");
    let members: Vec<String> =
        members.map(|(key, value)| format!("{}: {value}", json!(key))).collect();
    let views = chart.get("views").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
    let views: Vec<String> = views.iter().map(|view| format!("        {view}")).collect();
    format!("{{ {},\n      \"views\": [\n{} ] }}", members.join(", "), views.join(",\n"))
}

/// The value of a member of the outermost object.
fn member(text: &str, key: &str) -> Option<Range<usize>> {
    let members = items(text, text.find('{')?);
    let own = &members[place_of(text, &members, key)?];
    let after_key = own.start + json!(key).to_string().len();
    let colon = after_key + text[after_key..own.end].find(':')? + 1;
    let value = text[colon..own.end].trim_start();
    Some(own.end - value.len()..own.end)
}

/// Which member has a key; the last one of several, which is the one that counts.
fn place_of(text: &str, members: &[Range<usize>], key: &str) -> Option<usize> {
    let wanted = json!(key).to_string();
    members.iter().rposition(|own| text[own.clone()].starts_with(&wanted))
}

/// The items of a list, or the members of an object, that begins at `start`, without what is about
/// them. The text is valid JSON.
fn items(text: &str, start: usize) -> Vec<Range<usize>> {
    let (mut found, mut depth, mut first) = (Vec::new(), 0, start + 1);
    let (mut in_string, mut escaped) = (false, false);
    for (at, byte) in text.bytes().enumerate().skip(start) {
        match byte {
            _ if escaped => escaped = false,
            b'\\' if in_string => escaped = true,
            b'"' => in_string = !in_string,
            _ if in_string => {}
            b'[' | b'{' => depth += 1,
            b']' | b'}' => depth -= 1,
            _ => {}
        }
        let ends = depth == 0 && !in_string;
        if ends || depth == 1 && !in_string && byte == b',' {
            let item = text[first..at].trim();
            if !item.is_empty() {
                let begin = at - text[first..at].trim_start().len();
                found.push(begin..begin + item.len());
            }
            first = at + 1;
        }
        if ends {
            break;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_written_by_hand_stays() {
        let text = "{ \"materials\": [\n  {\"name\": \"a, ] \\\" }\", \"surfaces\": [\"x\"]} ],\n\
                    \t\"saturation\" : 5.0}\n";
        let file = Path::new("tags.json");
        let mut changed = Changed { file, text: text.to_owned() };
        let pin = |name, x: f64| Pin {
            name,
            kind: json!({"kind": "grey"}),
            photograph: "images/1.exr",
            corners_px: [[x, 1.5], [9.0, 1.0], [9.0, 9.0], [1.0, 9.0]].map(DVec2::from_array),
        };
        changed.pin(&pin("one", 1.0)).unwrap();
        assert!(
            changed.text.starts_with(text.trim_end().trim_end_matches('}')),
            "{}",
            changed.text
        );
        changed.pin(&pin("two", 2.0)).unwrap();
        let tag = changed.pin(&pin("one", 3.0)).unwrap();
        assert_eq!(tag.views.len(), 1);
        assert_eq!(tag.views[0].1[0], DVec2::new(3.0, 1.5));
        let tag = changed.pin(&Pin { photograph: "images/2.exr", ..pin("one", 4.0) }).unwrap();
        assert_eq!(tag.views.len(), 2);
        let other = Pin { kind: json!({"kind": "colorchecker"}), ..pin("one", 1.0) };
        assert!(changed.pin(&other).unwrap_err().to_string().contains("another kind"));
        changed.set_color_matrix(&DMat3::from_diagonal([1.0, 2.0, 3.0].into()));
        changed.set_color_matrix(&DMat3::from_cols_array(&[1., 4., 7., 2., 5., 8., 3., 6., 10.]));
        let value = changed.value().unwrap();
        assert_eq!(value["saturation"], 5.0);
        assert_eq!(value["materials"][0]["name"], "a, ] \" }");
        assert_eq!(value["charts"].as_array().unwrap().len(), 2);
        assert_eq!(value["charts"][1]["name"], "two");
        assert_eq!(
            value["color_matrix"],
            json!([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 10.0]])
        );
        assert_eq!(changed.text.matches("color_matrix").count(), 1);
        let rows = DMat3::from_cols_array(&[1., 4., 7., 2., 5., 8., 3., 6., 10.]);
        let capture = Capture { color_matrix: Some(rows), ..Capture::default() };
        let correction = DMat3::from_diagonal([1.0, 2.0, 3.0].into());
        changed.set_color_matrix(&capture.corrected_by(&correction));
        assert_eq!(
            changed.value().unwrap()["color_matrix"],
            json!([[1.0, 2.0, 3.0], [8.0, 10.0, 12.0], [21.0, 24.0, 30.0]])
        );
        changed.remove_color_matrix();
        assert_eq!(changed.value().unwrap().as_object().unwrap().len(), 3);
        assert!(!changed.text.contains("color_matrix"), "{}", changed.text);
    }

    #[test]
    fn without_a_file_every_material_is_named() {
        let changed = Changed { file: Path::new("tags.json"), text: plain(&Capture::default()) };
        assert_eq!(changed.value().unwrap(), json!({"materials": []}));
        let mut changed = Changed { file: Path::new("tags.json"), text: "{}".to_owned() };
        changed.set_color_matrix(&DMat3::IDENTITY);
        assert_eq!(changed.value().unwrap()["color_matrix"][1], json!([0.0, 1.0, 0.0]));
        changed.remove_color_matrix();
        assert_eq!(changed.value().unwrap(), json!({}));
        changed.remove_color_matrix();
        let text = "{\"color_matrix\": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], \"charts\": []}";
        let mut changed = Changed { file: Path::new("tags.json"), text: text.to_owned() };
        changed.remove_color_matrix();
        assert_eq!(changed.text, "{\"charts\": []}");
    }
}
