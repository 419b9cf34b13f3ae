//! Charts of one's own: tables as CSV, against colour-science (`tests/golden/color/charts.py`).

use lobelia::io::{Error, chart_table};
use lobelia::scene::charts::Table;
use serde_json::Value;

use crate::{folder, message, put};

fn read(text: &str) -> Result<Table, Error> {
    let folder = folder();
    chart_table::read(&put(folder.path(), "own.csv", text))
}

#[test]
fn spectra_become_linear_colours() {
    let golden: Value = serde_json::from_str(include_str!("../golden/color/charts.json")).unwrap();
    let numbers = |value: &Value| -> Vec<f64> {
        value.as_array().unwrap().iter().map(|own| own.as_f64().unwrap()).collect()
    };
    let joined = |values: &[f64]| values.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
    let patches = golden["patches"].as_array().unwrap();
    // Backwards, with a mark before the text and remarks within: tables come so.
    let mut text = "\u{feff}# a chart\nname,row,column,".to_owned();
    text += &joined(&numbers(&golden["wavelengths"]));
    for (k, patch) in patches.iter().enumerate().rev() {
        let name = patch["name"].as_str().unwrap();
        let values = joined(&numbers(&patch["reflectance"]));
        text += &format!("\n{name}, {}, {},{values}", k / 6 + 1, k % 6 + 1);
    }
    let table = read(&text).unwrap();
    assert_eq!((table.rows, table.columns), (4, 6));
    for (patch, golden) in std::iter::zip(&table.patches, patches) {
        assert_eq!(patch.name, golden["name"].as_str().unwrap());
        let expected = numbers(&golden["rec709"]);
        for (found, expected) in std::iter::zip(patch.reflectance, expected) {
            assert!((found - expected).abs() < 1e-4, "{}: {found}, {expected}", patch.name);
        }
    }
    assert_eq!(table.pinned(), [18, 19, 20, 21, 22]);
}

#[test]
fn linear_colours_are_taken_as_they_are() {
    let table = read("Row,Column,Red,Green,Blue,sd\n1,1,0.5,0.4,-0.03,0.02\n1,2,1,1,1,\n").unwrap();
    assert_eq!(table.patches[0].reflectance, [0.5, 0.4, -0.03]);
    assert_eq!(table.patches[0].sd, [0.02; 3]);
    assert_eq!(table.patches[1].name, "1.2");
    assert_eq!(table.patches[1].sd, Table::usual_sd([1.0; 3]));
}

#[test]
fn tables_that_cannot_be_understood_are_named() {
    let refused = |text: &str, parts: &[&str]| {
        message(read(text), parts);
    };
    refused("", &["own.csv", "line 1"]);
    refused("row,column,red,green,blue\n", &["0 patches"]);
    refused("row,red,green,blue\n1,1,1,1\n", &["\"column\"", "missing"]);
    refused("row,column,red,green\n1,1,1,1\n", &["either"]);
    refused("row,column,red,green,blue,500\n1,1,1,1,1,1\n", &["either"]);
    refused("row,column,red,green,blue\n1,1,x,1,1\n", &["line 2", "red is \"x\""]);
    refused("row,column,red,green,blue\n1,1,40,30,20\n", &["line 2", "40", "0 to 1"]);
    refused("row,column,red,green,blue\n0,1,1,1,1\n", &["line 2", "row is \"0\""]);
    refused("row,column,red,green,blue\n1,1,1,1,1\n1,1,1,1,1\n", &["line 3", "there already"]);
    refused(
        "row,column,red,green,blue\n1,1,1,1,1\n2,2,1,1,1\n",
        &["2 patches", "some are missing"],
    );
    refused("row,column,red,green,blue\n1,1,1,1\n", &["line 2", "CSV"]);
    refused("row,column,500,600\n1,1,1,1\n", &["500 to 600"]);
    refused("row,column,40,700\n1,1,1,1\n", &["40 nm"]);
    refused("row,column,400,400,700\n1,1,1,1,1\n", &["twice"]);
    refused("row,column,400,700\n1,1,1,55\n", &["line 2", "55", "between 0 and 1"]);
}
