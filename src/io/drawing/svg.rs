//! A drawing as SVG.

use std::fmt::Write;

use super::font;
use super::{Anchor, Drawing, Form, Ink, Shape};

/// The text of an SVG file; also valid within an HTML page.
pub fn svg(drawing: &Drawing) -> String {
    let (w, h) = (drawing.width, drawing.height);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {w} {h}\" width=\"{w}\" \
         height=\"{h}\" role=\"img\">\n<title>{}</title>\n<style>{}@media \
         (prefers-color-scheme:dark){{{}}}</style>\n<rect class=\"f-paper\" width=\"{w}\" \
         height=\"{h}\"/>\n",
        escaped(&drawing.description),
        style(false),
        style(true),
    );
    for shape in &drawing.shapes {
        add(&mut out, shape);
    }
    out.push_str("</svg>\n");
    out
}

fn style(dark: bool) -> String {
    let series = (0..super::SERIES.len()).map(Ink::Series);
    let inks = [Ink::Paper, Ink::Text, Ink::Quiet, Ink::Grid].into_iter().chain(series);
    let rule = |ink: Ink| {
        let ([r, g, b], class) = (ink.rgb(dark), ink.class());
        let color = format!("#{r:02x}{g:02x}{b:02x}");
        format!(".f-{class}{{fill:{color}}}.l-{class}{{stroke:{color};fill:none}}")
    };
    inks.map(rule).collect()
}

fn add(out: &mut String, shape: &Shape) {
    // Writing into a string does not fail.
    let _ = match shape {
        Shape::Line { points, ink, width, dashed } => {
            let dash = if *dashed { " stroke-dasharray=\"5 4\"" } else { "" };
            writeln!(
                out,
                "<polyline class=\"l-{}\" stroke-width=\"{width}\" stroke-linejoin=\"round\"{dash} \
                 points=\"{}\"/>",
                ink.class(),
                list(points)
            )
        }
        Shape::Area { points, ink, opacity } => writeln!(
            out,
            "<polygon class=\"f-{}\" fill-opacity=\"{opacity}\" points=\"{}\"/>",
            ink.class(),
            list(points)
        ),
        Shape::Mark { at, form, radius, ink, filled } => {
            let class = ink.class();
            let look = if *filled {
                format!("class=\"f-{class}\"")
            } else {
                format!("class=\"l-{class}\" stroke-width=\"1.3\"")
            };
            match form {
                Form::Circle => writeln!(
                    out,
                    "<circle {look} cx=\"{:.2}\" cy=\"{:.2}\" r=\"{radius}\"/>",
                    at[0], at[1]
                ),
                form => writeln!(
                    out,
                    "<polygon {look} points=\"{}\"/>",
                    list(&form.corners(*at, *radius))
                ),
            }
        }
        Shape::Text { at, text, size, anchor, ink, upright } => {
            let anchor = match anchor {
                Anchor::Start => "start",
                Anchor::Middle => "middle",
                Anchor::End => "end",
            };
            let [x, y] = at;
            let turn = if *upright {
                format!(" transform=\"rotate(-90 {x:.2} {y:.2})\"")
            } else {
                String::new()
            };
            // Other fonts are as wide as the one that the place was reserved for.
            writeln!(
                out,
                "<text class=\"f-{}\" x=\"{x:.2}\" y=\"{y:.2}\" font-size=\"{size}\" \
                 text-anchor=\"{anchor}\" font-family=\"Ubuntu, 'Helvetica Neue', Arial, \
                 sans-serif\" textLength=\"{:.1}\" lengthAdjust=\"spacingAndGlyphs\"{turn}>{}</text>",
                ink.class(),
                font::width(text, *size),
                escaped(text)
            )
        }
    };
}

fn list(points: &[[f32; 2]]) -> String {
    points.iter().map(|[x, y]| format!("{x:.2},{y:.2}")).collect::<Vec<_>>().join(" ")
}

/// Text as XML and HTML want it.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
