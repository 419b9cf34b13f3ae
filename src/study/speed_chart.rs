//! Seconds against error as a chart: one panel for each measure, with the front.

use crate::io::drawing::{Form, Ink};
use crate::study::chart::{self, Chart, Panel, Point, Scale, Series, number};
use crate::study::front::front;
use crate::study::speed::{MEASURES, Place, quality_of};

use crate::io::drawing::Drawing;

/// Figures of the peer, with their source in the file's head.
const PEER: &str = include_str!("../../assets/study/mitsuba.csv");

/// The places that nothing beats in seconds and in one measure.
pub fn front_of(places: &[Place], measure: usize) -> Vec<&Place> {
    let points: Vec<[f64; 2]> = places
        .iter()
        .map(|place| [place.seconds, place.errors[measure].unwrap_or(f64::NAN)])
        .collect();
    front(&points).into_iter().map(|index| &places[index]).collect()
}

/// What can be said of the qualities and the methods, a sentence each.
pub fn verdicts(name: &str, places: &[Place]) -> Vec<String> {
    let measure = if places.iter().any(|place| place.errors[0].is_some()) { 0 } else { 2 };
    let verdicts = verdicts_by(places, measure).into_iter();
    verdicts.map(|verdict| format!("{name}: {verdict}")).collect()
}

/// The same by one measure, for a capture that needs no name.
pub fn verdicts_by(places: &[Place], measure: usize) -> Vec<String> {
    let best = front_of(places, measure);
    let mut verdicts = Vec::new();
    for place in places.iter().filter(|place| quality_of(place).is_some()) {
        let Some(error) = place.errors[measure] else { continue };
        let reached = best
            .iter()
            .filter(|other| other.seconds <= place.seconds)
            .filter_map(|other| other.errors[measure])
            .fold(f64::INFINITY, f64::min);
        let stands = if best.iter().any(|other| other.setting == place.setting) {
            "on the front".to_owned()
        } else {
            format!("{:.2} × the front's error for its time", error / reached)
        };
        verdicts.push(format!(
            "{} takes {} s for {} ({stands})",
            place.setting,
            number(place.seconds),
            number(error)
        ));
    }
    let joint: Vec<Place> = places.iter().filter(|place| !place.is_paper).cloned().collect();
    let joint_front = front_of(&joint, measure);
    let better = places.iter().filter(|paper| paper.is_paper).filter(|paper| {
        let error = paper.errors[measure].unwrap_or(f64::INFINITY);
        joint_front.iter().any(|joint| {
            paper.seconds < joint.seconds && joint.errors[measure].is_some_and(|e| error < e)
        })
    });
    let said = match better.count() {
        0 => "no setting of paper is both faster and more accurate than one of joint's front",
        1 => "one setting of paper is both faster and more accurate than one of joint's front",
        _ => "some settings of paper are both faster and more accurate than one of joint's front",
    };
    if places.iter().any(|place| place.is_paper) && !joint.is_empty() {
        verdicts.push(said.to_owned());
    }
    verdicts
}

/// Seconds against each measure of error, with the fronts of both methods.
pub fn chart(name: &str, places: &[Place], threads: usize) -> Drawing {
    let runs = places.iter().map(|place| place.runs).max().unwrap_or(0);
    let mut notes = vec![format!(
        "{} settings, {} {} each, {threads} threads. Seconds are those of the reconstruction, \
         without reading the files. Stars are the qualities draft, standard and fine; the front is \
         labelled.",
        places.len(),
        runs,
        if runs == 1 { "run" } else { "runs" },
    )];
    let told = verdicts("", places);
    notes.push(
        told.iter().map(|verdict| verdict.trim_start_matches(": ")).collect::<Vec<_>>().join("; ")
            + ".",
    );
    let panels: Vec<Panel> = (0..MEASURES.len())
        .filter(|&measure| places.iter().any(|place| place.errors[measure].is_some()))
        .map(|measure| panel(name, places, measure))
        .collect();
    chart::draw(&Chart {
        title: format!("Seconds against error: {name}"),
        notes,
        columns: if panels.len() > 1 { 2 } else { 1 },
        panels,
        size: [440.0, 330.0],
    })
}

fn panel(name: &str, places: &[Place], measure: usize) -> Panel {
    let (_, title, y_label) = MEASURES[measure];
    let best = front_of(places, measure);
    let of = |is_paper: bool| -> Vec<Point> {
        places
            .iter()
            .filter(|place| place.is_paper == is_paper)
            .filter_map(|place| {
                let stands_out = quality_of(place).is_some();
                let is_best = best.iter().any(|other| other.setting == place.setting);
                Some(Point {
                    x: place.seconds,
                    y: place.errors[measure]?,
                    band: None,
                    label: if is_best || stands_out {
                        place.setting.clone()
                    } else {
                        String::new()
                    },
                    stands_out,
                })
            })
            .collect()
    };
    let series = |name: &str, ink: usize, form, filled, line, points| Series {
        name: name.to_owned(),
        ink: Ink::Series(ink),
        form,
        filled,
        line,
        points,
    };
    let mut all = vec![
        series("joint", 0, Form::Circle, true, false, of(false)),
        series("paper (the published method)", 1, Form::Triangle, true, false, of(true)),
    ];
    for (light, ink, form) in
        [("environment map", 2, Form::Square), ("textured sphere", 3, Form::Diamond)]
    {
        let points = peer(name, light, measure);
        if !points.is_empty() {
            all.push(series(&format!("Mitsuba 3, {light}"), ink, form, false, true, points));
        }
    }
    all.retain(|series| !series.points.is_empty());
    Panel {
        title: title.to_owned(),
        x_label: "seconds".to_owned(),
        y_label: y_label.to_owned(),
        x: Scale::Log,
        series: all,
        front: best.iter().filter_map(|p| Some([p.seconds, p.errors[measure]?])).collect(),
    }
}

/// The peer's figures, for the capture that they were measured on.
fn peer(capture: &str, light: &str, measure: usize) -> Vec<Point> {
    let column = match measure {
        0 => 4,
        1 => 5,
        _ => return Vec::new(),
    };
    let point = |line: &str| -> Option<Point> {
        let cells: Vec<&str> = line.split(',').collect();
        let is_wanted = cells.first() == Some(&capture) && cells.get(1) == Some(&light);
        let number = |index: usize| cells.get(index)?.parse().ok();
        is_wanted.then_some(())?;
        Some(Point { x: number(2)?, y: number(column)?, ..Point::default() })
    };
    PEER.lines().filter(|line| !line.starts_with('#')).filter_map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_peer_stands_on_the_chart_of_its_capture_alone() {
        assert_eq!(peer("corner-diffuse", "textured sphere", 0).len(), 7);
        assert_eq!(peer("corner-diffuse", "environment map", 1)[3].y, 0.04);
        assert!(peer("corner-half", "textured sphere", 0).is_empty());
        assert!(peer("corner-diffuse", "textured sphere", 2).is_empty());
    }
}
