//! The study of stability as a page for whoever took the photographs.

use std::fmt::Write;

use crate::io::drawing::{escaped, svg};
use crate::study::degradation::Degradation;
use crate::study::stability::{BREAKS, DegradationCurve, Row, Variant};
use crate::study::{PANIC, stability_chart};

const STYLE: &str = "body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;\
    padding:0 1rem;background:#fff;color:#1c1e21}table{border-collapse:collapse;width:100%}\
    th,td{text-align:left;padding:.3rem .6rem;border-bottom:1px solid #dde0e4;vertical-align:top}\
    section{display:inline-block;vertical-align:top;width:100%;max-width:29rem;margin:.5rem 0}\
    svg{max-width:100%;height:auto}h2{margin-top:2rem}\
    @media(prefers-color-scheme:dark){body{background:#161a20;color:#eceef0}\
    th,td{border-color:#353c46}}";

/// A whole HTML page that needs nothing beside it.
pub fn page(
    capture: &str,
    rows: &[Row],
    curves: &[(Degradation, Variant, DegradationCurve)],
) -> String {
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
         content=\"width=device-width\">\n<title>How large errors of {0} may be</title>\n<style>{STYLE}</style>\n\
         <h1>How large errors of {0} may be</h1>\n",
        escaped(capture)
    );
    // Writing into a string does not fail.
    if let Some(opening) = opening(curves) {
        let _ = writeln!(page, "<p>{}</p>", escaped(&opening));
    }
    let _ = writeln!(page, "<p>{}</p>", escaped(&soundness(rows)));
    page.push_str(
        "<h2>In short</h2>\n<table><tr><th>Error of the capture<th>Tolerated up to<th>The result breaks at\
         <th>What to do\n",
    );
    let mut of_joint: Vec<&(Degradation, Variant, DegradationCurve)> =
        curves.iter().filter(|(_, variant, _)| *variant == Variant::Joint).collect();
    // What breaks first stands first.
    of_joint.sort_by(|a, b| severity(&b.2).total_cmp(&severity(&a.2)));
    for (degradation, _, curve) in &of_joint {
        let (tolerated, breaks) = limits(*degradation, curve);
        let _ = writeln!(
            page,
            "<tr><td>{}<td>{tolerated}<td>{breaks}<td>{}",
            degradation.title(),
            advice(*degradation)
        );
    }
    page.push_str(
        "</table>\n<h2>In pictures</h2>\n<p>The line is the middle of several runs, the \
                   band from the best to the worst; a star marks where a method breaks.</p>\n",
    );
    for of_degradation in curves.chunk_by(|a, b| a.0 == b.0) {
        let _ = writeln!(
            page,
            "<section>\n{}<p>{}</p></section>",
            svg(&stability_chart::one(of_degradation)),
            escaped(&sentence(of_degradation))
        );
    }
    page.push_str("</html>\n");
    page
}

/// The error on the unchanged capture, and the definition of breaking.
pub fn opening(curves: &[(Degradation, Variant, DegradationCurve)]) -> Option<String> {
    let clean = curves.iter().find(|(_, variant, _)| *variant == Variant::Joint)?.2.clean?;
    Some(format!(
        "As the capture is, the reflectances that are recovered have a mean error of {clean:.3}, on a \
         scale from 0 (black) to 1 (white). The capture was then degraded step by step, one property \
         at a time. The result breaks where its error is more than {BREAKS} times as large."
    ))
}

/// How much larger the error is at the mildest steps, by which degradations are sorted.
fn severity(curve: &DegradationCurve) -> f64 {
    let of = |(_, errors): &(f64, Option<[f64; 3]>)| errors.map_or(1e9, |[_, median, _]| median);
    let broken = curve.steps.iter().position(|(level, _)| Some(*level) == curve.breaks_at);
    let early = broken.map_or(0.0, |step| 1e3 / (1.0 + step as f64));
    let mean = curve.steps.iter().map(of).sum::<f64>() / curve.steps.len().max(1) as f64;
    early + mean / curve.clean.unwrap_or(1.0).max(1e-9)
}

/// The largest level that is tolerated, and the level at which the result breaks, in words.
fn limits(degradation: Degradation, curve: &DegradationCurve) -> (String, String) {
    let breaks = curve.breaks_at;
    let below = curve.steps.iter().map(|(level, _)| *level).take_while(|&l| Some(l) != breaks);
    let tolerated = below
        .last()
        .map_or("none of the steps that were tried".to_owned(), |l| degradation.step(l));
    let error = |level: f64| {
        let step = curve.steps.iter().find(|(l, _)| *l == level);
        match step.and_then(|(_, errors)| *errors) {
            Some([_, median, _]) => format!("an error of {median:.3}"),
            None => "no result".to_owned(),
        }
    };
    let breaks = breaks.map_or("not within what was tried".to_owned(), |level| {
        format!("{}: {}", degradation.step(level), error(level))
    });
    (tolerated, breaks)
}

/// For each variant the level of one degradation that it tolerates, or at which it breaks.
pub fn sentence(curves: &[(Degradation, Variant, DegradationCurve)]) -> String {
    let mut text = String::new();
    for (degradation, variant, curve) in curves {
        let (tolerated, breaks) = limits(*degradation, curve);
        let name = variant.name();
        let said = match curve.breaks_at {
            None => format!("{name} tolerates {tolerated}. "),
            Some(_) => format!("{name} breaks at {breaks}. "),
        };
        text.push_str(&said);
    }
    text
}

/// A remedy for a degradation.
pub fn advice(degradation: Degradation) -> &'static str {
    match degradation {
        Degradation::Noise => "Expose longer, or merge more exposures.",
        Degradation::Saturation => "Add shorter exposures; give the sensor's limit in tags.json.",
        Degradation::Misregistration => "Calibrate the cameras again, with more points.",
        Degradation::Lens => "Calibrate the lens; give k1, k2 in transforms.json.",
        Degradation::Focal => "Calibrate the focal length; do not zoom between photographs.",
        Degradation::Exposure => "Keep exposure, white balance and aperture fixed.",
        Degradation::Vignetting => {
            "Give the vignetting in transforms.json, or use a smaller aperture."
        }
        Degradation::FewerImages => "Take more photographs, from more sides.",
        Degradation::FewerSamples => "Raise --samples.count.",
        Degradation::MissingSurfaces => "Model what the photographs show.",
        Degradation::MovedVertices => "Fit the model to the photographs more exactly.",
        Degradation::MoreLights | Degradation::FewerLights => {
            "Leave the spacing of lights at its default."
        }
        Degradation::LightColor => "Nothing: colour of light is solved for.",
        Degradation::MergedTags => "Give every material a tag of its own.",
        Degradation::SplitTags => "Nothing: surfaces may be tagged apart.",
        Degradation::Texture => "Tag textured materials as textured.",
        Degradation::Start => "Nothing: start values hardly count.",
    }
}

/// Whether every run came to an end with finite numbers.
pub fn soundness(rows: &[Row]) -> String {
    let panicked = rows.iter().filter(|row| row.failure.as_deref() == Some(PANIC)).count();
    let infinite = rows.iter().filter(|row| row.failure.is_none() && !row.finite).count();
    let refused = rows.iter().filter(|row| row.failure.is_some()).count() - panicked;
    let mut text = format!(
        "Of {} runs, {panicked} stopped with an internal error, {infinite} gave a number that is \
         not finite",
        rows.len()
    );
    let _ = match refused {
        0 => write!(text, "."),
        count => write!(text, ", and {count} were refused with a message."),
    };
    text
}
