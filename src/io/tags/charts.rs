//! `charts` of `tags.json`: charts of known reflectance, by their corners in photographs.

use std::path::Path;

use glam::DVec2;

use super::{deviation, reflectance};
use crate::io::error::suggestion;
use crate::io::json::Field;
use crate::io::{Error, chart_table};
use crate::math::rgb::Rgb;
use crate::scene::charts::{Chart, ChartView, Table};

/// Of photographic grey cards, which are made to reflect 18 %; copies of them are off by a few
/// hundredths of that.
const GREY: Rgb = [0.18; 3];
const GREY_SD: Rgb = [0.01; 3];

/// A chart whose photographs are not looked up yet: they are read after the tags.
#[derive(Clone, Debug, PartialEq)]
pub struct ChartTag {
    pub name: String,
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
    let table = table(field)?;
    let views = field.need("views")?;
    let items = views.items()?;
    if items.is_empty() {
        return Err(views.wrong_with(
            "no photograph is listed",
            "Give one photograph or more, each with the four corners",
        ));
    }
    let views = items.iter().map(|item| {
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
    Ok(ChartTag { name, table, views, size_m, place: field.path.clone() })
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

/// What a chart's patches reflect.
fn table(field: &Field) -> Result<Table, Error> {
    let kind = field.need("kind")?;
    let usual = match kind.text()? {
        "grey" => Some(GREY),
        "white" => None,
        "colorchecker" => return Ok(Table::color_checker()),
        "table" => {
            let file = field.need("table")?;
            let folder = field.file.parent().unwrap_or(Path::new(""));
            return chart_table::read(&folder.join(file.text()?.replace('\\', "/")));
        }
        other => {
            return Err(kind.wrong_with(
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
    let known_diffuse_sd = given.unwrap_or(match known_diffuse == GREY {
        true => GREY_SD,
        false => known_diffuse.map(|value| 0.05 * value),
    });
    Ok(Table::card(known_diffuse, known_diffuse_sd))
}

impl ChartTag {
    /// With its photographs as indices into `names`; or what is wrong, for a person.
    pub fn resolved(&self, names: &[&str]) -> Result<Chart, String> {
        let views = self.views.iter().map(|(name, corners_px)| {
            Ok(ChartView { photograph: photograph(name, names)?, corners_px: *corners_px })
        });
        Ok(Chart {
            name: self.name.clone(),
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
