//! `charts` of `tags.json`: charts of known reflectance, by their corners in photographs.

use std::path::Path;
use std::sync::Arc;

use glam::DVec2;
use serde_json::{Value, json};

use super::{deviation, reflectance};
use crate::io::error::suggestion;
use crate::io::json::Field;
use crate::io::paths::absolute;
use crate::io::{Error, chart_table};
use crate::math::rgb::Rgb;
use crate::scene::Capture;
use crate::scene::charts::{self, Chart, ChartKind, ChartView, LaidChart, Table};

/// Of photographic grey cards, which are made to reflect 18 %; copies of them are off by a few
/// hundredths of that.
pub const GREY: Rgb = [0.18; 3];
pub const GREY_SD: Rgb = [0.01; 3];

/// A chart whose photographs are not looked up yet: they are read after the tags.
#[derive(Clone, Debug, PartialEq)]
pub struct ChartTag {
    pub name: String,
    pub kind: ChartKind,
    pub table: Table,
    /// Photographs by their `file_path`, the corners in each.
    pub views: Vec<(String, [DVec2; 4])>,
    /// The lengths of its first and its second side, if it stands free in space.
    pub size_m: Option<DVec2>,
    /// The place in the file.
    pub place: String,
}

pub(super) fn read(field: &Field) -> Result<ChartTag, Error> {
    let name_field = field.need("name")?;
    let name = name_field.text()?.to_owned();
    if name.is_empty() {
        return Err(name_field.wrong_with("the name is empty", "Give the chart a name of its own"));
    }
    let (kind, table) = table(field)?;
    let views = field.need("views")?.items()?;
    let views = views.iter().map(|item| {
        let image = item.need("file_path")?.text()?.to_owned();
        let corners = item.need("corners")?;
        let points = corners.items()?;
        let Ok(points) = <[Field; 4]>::try_from(points) else {
            return Err(corners.wrong_with(
                "a chart has four corners",
                "Give four positions [x, y] in pixels from the photograph's top left corner, in turn",
            ));
        };
        let mut corners_px = [DVec2::ZERO; 4];
        for (corner, point) in corners_px.iter_mut().zip(&points) {
            *corner = DVec2::from_array(point.numbers::<2>()?);
        }
        Ok((image, corners_px))
    });
    let views = views.collect::<Result<_, Error>>()?;
    let size_m = field.get("size").map(|field| size(&field)).transpose()?;
    Ok(ChartTag { name, kind, table, views, size_m, place: field.path.clone() })
}

/// The two lengths of a chart that stands free in space.
fn size(field: &Field) -> Result<DVec2, Error> {
    let size_m = DVec2::from_array(field.numbers::<2>()?);
    if size_m.is_finite() && size_m.min_element() > 0.0 {
        return Ok(size_m);
    }
    Err(field.wrong_with(
        "a length is not above 0",
        "Give two lengths in metres: from the first corner to the second, and from there to the third",
    ))
}

/// What a chart is, and what its patches reflect.
fn table(field: &Field) -> Result<(ChartKind, Table), Error> {
    let kind_field = field.need("kind")?;
    let (kind, usual) = match kind_field.text()? {
        "grey" => (ChartKind::Grey, Some(GREY)),
        "white" => (ChartKind::White, None),
        "colorchecker" => return Ok((ChartKind::ColorChecker, Table::color_checker())),
        "table" => {
            let file = field.need("table")?;
            let folder = field.file.parent().unwrap_or(Path::new(""));
            let file = folder.join(file.text()?.replace('\\', "/"));
            let table = chart_table::read(&file)?;
            return Ok((ChartKind::Table(file), table));
        }
        other => {
            return Err(kind_field.wrong_with(
                &format!("\"{other}\" is no kind of chart that is read"),
                "Give \"grey\" (a grey card), \"white\" (a white tile or paper of known reflectance), \
                 \"colorchecker\" (ColorChecker Classic, 24 patches), or \"table\" with the \
                 reflectances in a CSV file",
            ));
        }
    };
    let given = field.get("known_diffuse").map(|field| reflectance(&field)).transpose()?;
    let Some(known_diffuse) = given.or(usual) else {
        return Err(field.wrong_with(
            "whites differ, and its known_diffuse is not given",
            "Give the reflectance from its data sheet, linear red, green and blue",
        ));
    };
    let given = field.get("known_diffuse_sd").map(|field| deviation(&field)).transpose()?;
    let known_diffuse_sd = given.unwrap_or_else(|| card_sd(known_diffuse));
    Ok((kind, Table::card(known_diffuse, known_diffuse_sd)))
}

/// The standard deviation of a card for which none is given.
pub fn card_sd(reflectance: Rgb) -> Rgb {
    match reflectance == GREY {
        true => GREY_SD,
        false => reflectance.map(|value| 0.05 * value),
    }
}

/// Charts of a project, with what of them could not be read.
#[derive(Clone, Debug, Default)]
pub struct StoredCharts {
    /// The capture with the charts that could be read in place of its own.
    pub capture: Arc<Capture>,
    /// The capture's own.
    pub of_files: Arc<Vec<LaidChart>>,
    /// Charts that could not be read: they are kept, and written back.
    pub unread: Vec<Value>,
    /// Why they could not, and why others cannot be used, for a person.
    pub warnings: Vec<String>,
}

/// Reads charts in the form of `tags.json` and finds their positions; paths are relative to the folder
/// of `file`.
pub fn stored_charts(file: &Path, values: &[Value], capture: &Capture) -> StoredCharts {
    let names: Vec<&str> = capture.photographs.iter().map(|own| own.name.as_str()).collect();
    let mut stored = StoredCharts { of_files: capture.charts.clone(), ..StoredCharts::default() };
    let mut wanted = Vec::new();
    for (index, value) in values.iter().enumerate() {
        let item = Field { file, path: format!("charts[{index}]"), value };
        let chart = read(&item).map_err(|error| error.to_string()).and_then(|tag| {
            let of = |problem| format!("{}, {}: {problem}.", file.display(), tag.place);
            tag.resolved(&names).map_err(of)
        });
        match chart {
            Ok(chart) => wanted.push(chart),
            Err(problem) => {
                stored.warnings.push(problem);
                stored.unread.push(value.clone());
            }
        }
    }
    let own = capture.charts.iter().map(|own| &own.chart);
    let charts = match own.eq(&wanted) {
        true => capture.charts.clone(),
        false => Arc::new(charts::find(capture, wanted)),
    };
    stored.capture = Arc::new(capture.with_charts(charts));
    for own in stored.capture.charts.iter() {
        if let Err(problem) = &own.placed {
            stored.warnings.push(left_out(&own.chart.name, problem));
        }
    }
    stored
}

/// Says that a chart cannot be used, and why.
pub fn left_out(name: &str, problem: &str) -> String {
    format!("the chart \"{name}\" is left out, and nothing is pinned by it: {problem}.")
}

/// Charts as `tags.json` would have them, with those that could not be read; paths are absolute.
pub fn chart_values(charts: &[LaidChart], unread: &[Value], capture: &Capture) -> Vec<Value> {
    let own = charts.iter().map(|own| chart_value(&own.chart, capture));
    own.chain(unread.iter().cloned()).collect()
}

fn chart_value(chart: &Chart, capture: &Capture) -> Value {
    let views: Vec<Value> = (chart.views.iter())
        .map(|view| {
            let corners = view.corners_px.map(|corner| corner.to_array());
            json!({"file_path": capture.photographs[view.photograph].name, "corners": corners})
        })
        .collect();
    let (kind, file) = match &chart.kind {
        ChartKind::Grey => ("grey", None),
        ChartKind::White => ("white", None),
        ChartKind::ColorChecker => ("colorchecker", None),
        ChartKind::Table(file) => ("table", Some(absolute(file))),
    };
    let mut value = json!({"name": chart.name, "kind": kind, "views": views});
    if let Some(file) = file {
        value["table"] = json!(file.display().to_string());
    } else if let [card] = chart.table.patches.as_slice() {
        value["known_diffuse"] = json!(card.reflectance);
        value["known_diffuse_sd"] = json!(card.sd);
    }
    if let Some(size_m) = chart.size_m {
        value["size"] = json!(size_m.to_array());
    }
    value
}

impl ChartTag {
    /// With its photographs as indices into `names`; or what is wrong, for a person.
    pub fn resolved(&self, names: &[&str]) -> Result<Chart, String> {
        let views = self.views.iter().map(|(name, corners_px)| {
            Ok(ChartView { photograph: photograph(name, names)?, corners_px: *corners_px })
        });
        Ok(Chart {
            name: self.name.clone(),
            kind: self.kind.clone(),
            table: self.table.clone(),
            views: views.collect::<Result<_, String>>()?,
            size_m: self.size_m,
        })
    }
}

/// The photograph of a name, among those of a capture.
pub fn photograph(name: &str, names: &[&str]) -> Result<usize, String> {
    let plain = |name: &str| name.trim_start_matches("./").to_owned();
    let found = names.iter().position(|own| plain(own) == plain(name));
    found.ok_or_else(|| {
        let guess = suggestion(name, names.iter().copied())
            .map_or(String::new(), |guess| format!(" (did you mean \"{guess}\"?)"));
        format!("there is no photograph \"{name}\"{guess}")
    })
}
