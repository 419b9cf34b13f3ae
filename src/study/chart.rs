//! Charts as drawings: panels with a logarithmic scale upwards, series with marks, lines and
//! bands, and labels that keep clear of everything else.

use crate::io::drawing::{Anchor, Drawing, Form, Ink, Shape, text_width};

/// Panels under a title.
#[derive(Clone, Debug, Default)]
pub struct Chart {
    /// Stands above the panels.
    pub title: String,
    /// Sentences below the title.
    pub notes: Vec<String>,
    /// Row by row.
    pub panels: Vec<Panel>,
    /// Panels beside each other.
    pub columns: usize,
    /// Of a panel's plot, in pixels.
    pub size: [f32; 2],
}

/// One diagram: points of several series over two axes, the vertical one logarithmic.
#[derive(Clone, Debug)]
pub struct Panel {
    /// Stands above the plot.
    pub title: String,
    /// Stands below the horizontal axis.
    pub x_label: String,
    /// Stands beside the vertical axis.
    pub y_label: String,
    /// The horizontal axis.
    pub x: Scale,
    /// Later ones are drawn over earlier ones.
    pub series: Vec<Series>,
    /// Points of a front, drawn as the stairs that nothing is below.
    pub front: Vec<[f64; 2]>,
}

/// The horizontal axis.
#[derive(Clone, Debug)]
pub enum Scale {
    /// Logarithmic.
    Log,
    /// Named steps at 0, 1, 2 and so on.
    Steps(Vec<String>),
}

/// Points that belong together.
#[derive(Clone, Debug)]
pub struct Series {
    /// As the legend has it.
    pub name: String,
    /// Colour, by its role in the theme.
    pub ink: Ink,
    /// Shape of the points.
    pub form: Form,
    /// Whether the points are filled.
    pub filled: bool,
    /// Whether the points are joined.
    pub line: bool,
    /// From left to right.
    pub points: Vec<Point>,
}

/// One value, with its spread.
#[derive(Clone, Debug, Default)]
pub struct Point {
    /// On the scale of the panel.
    pub x: f64,
    /// In the unit of the panel, above 0.
    pub y: f64,
    /// Lowest and highest value at this x.
    pub band: Option<[f64; 2]>,
    /// Empty where it needs no name.
    pub label: String,
    /// Marked larger, by a star.
    pub stands_out: bool,
}

const TEXT: f32 = 12.0;
const SMALL: f32 = 11.0;
const LEFT: f32 = 62.0;
const RIGHT: f32 = 16.0;
const ABOVE: f32 = 30.0;
const BELOW: f32 = 50.0;
const MARGIN: f32 = 18.0;

/// Draws a chart.
pub fn draw(chart: &Chart) -> Drawing {
    let columns = chart.columns.clamp(1, chart.panels.len().max(1));
    let rows = chart.panels.len().div_ceil(columns);
    let [w, h] = chart.size;
    let cell = [LEFT + w + RIGHT, ABOVE + h + BELOW];
    let width = 2.0 * MARGIN + cell[0] * columns as f32;
    let mut shapes = Vec::new();
    let mut y = MARGIN + 14.0;
    shapes.push(text([MARGIN, y], &chart.title, 17.0, Anchor::Start, Ink::Text));
    for note in &chart.notes {
        for line in wrapped(note, SMALL, width - 2.0 * MARGIN) {
            y += 16.0;
            shapes.push(text([MARGIN, y], &line, SMALL, Anchor::Start, Ink::Quiet));
        }
    }
    y += 24.0;
    y = legend(&mut shapes, &chart.panels, y, width);
    for (index, panel) in chart.panels.iter().enumerate() {
        let corner = [
            MARGIN + LEFT + cell[0] * (index % columns) as f32,
            y + ABOVE + cell[1] * (index / columns) as f32,
        ];
        Plot::new(panel, corner, chart.size).draw(&mut shapes);
    }
    let height = y + cell[1] * rows as f32 + MARGIN;
    Drawing { width, height, description: chart.title.clone(), shapes }
}

fn text(at: [f32; 2], text: &str, size: f32, anchor: Anchor, ink: Ink) -> Shape {
    Shape::Text { at, text: text.to_owned(), size, anchor, ink, upright: false }
}

/// A text in lines that are no wider than `width`.
fn wrapped(text: &str, size: f32, width: f32) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let Some(line) = lines.last_mut() else { continue };
        let longer = if line.is_empty() { word.to_owned() } else { format!("{line} {word}") };
        if line.is_empty() || text_width(&longer, size) <= width {
            *line = longer;
        } else {
            lines.push(word.to_owned());
        }
    }
    lines
}

/// Names every series once; gives the height at which it ends.
fn legend(shapes: &mut Vec<Shape>, panels: &[Panel], top: f32, width: f32) -> f32 {
    let mut named: Vec<&str> = Vec::new();
    let (mut x, mut y) = (MARGIN, top);
    let mut place =
        |name: &str, shapes: &mut Vec<Shape>, sample: &dyn Fn([f32; 2]) -> Vec<Shape>| {
            let wide = 26.0 + text_width(name, TEXT) + 20.0;
            if x + wide > width - MARGIN && x > MARGIN {
                x = MARGIN;
                y += 20.0;
            }
            shapes.extend(sample([x + 10.0, y - 4.0]));
            shapes.push(text([x + 26.0, y], name, TEXT, Anchor::Start, Ink::Text));
            x += wide;
        };
    for series in panels.iter().flat_map(|panel| &panel.series) {
        if named.contains(&series.name.as_str()) {
            continue;
        }
        named.push(&series.name);
        let sample = |[cx, cy]: [f32; 2]| {
            let mut sample = Vec::new();
            if series.line {
                let points = vec![[cx - 10.0, cy], [cx + 10.0, cy]];
                sample.push(Shape::Line { points, ink: series.ink, width: 1.8, dashed: false });
            }
            sample.push(mark(series, [cx, cy], 4.5));
            sample
        };
        place(&series.name, shapes, &sample);
    }
    if panels.iter().any(|panel| !panel.front.is_empty()) {
        let sample = |[cx, cy]: [f32; 2]| {
            let points = vec![[cx - 10.0, cy], [cx + 10.0, cy]];
            vec![Shape::Line { points, ink: Ink::Text, width: 1.4, dashed: true }]
        };
        place("Pareto front", shapes, &sample);
    }
    y + 6.0
}

fn mark(series: &Series, at: [f32; 2], radius: f32) -> Shape {
    Shape::Mark { at, form: series.form, radius, ink: series.ink, filled: series.filled }
}

/// A panel and where it is drawn.
struct Plot<'a> {
    panel: &'a Panel,
    corner: [f32; 2],
    size: [f32; 2],
    x_range: [f64; 2],
    y_range: [f64; 2],
}

impl<'a> Plot<'a> {
    fn new(panel: &'a Panel, corner: [f32; 2], size: [f32; 2]) -> Self {
        let points = || panel.series.iter().flat_map(|series| &series.points);
        let y = points().flat_map(|p| [p.y].into_iter().chain(p.band.into_iter().flatten()));
        let x_range = match &panel.x {
            Scale::Log => log_range(points().map(|p| p.x)),
            Scale::Steps(names) => [-0.4, names.len().max(1) as f64 - 0.6],
        };
        Self { panel, corner, size, x_range, y_range: log_range(y) }
    }

    fn x(&self, value: f64) -> f32 {
        let [low, high] = self.x_range;
        let part = match self.panel.x {
            Scale::Log => (value.max(1e-300) / low).ln() / (high / low).ln(),
            Scale::Steps(_) => (value - low) / (high - low),
        };
        self.corner[0] + self.size[0] * part as f32
    }

    fn y(&self, value: f64) -> f32 {
        let [low, high] = self.y_range;
        let part = (value.max(1e-300) / low).ln() / (high / low).ln();
        self.corner[1] + self.size[1] * (1.0 - part as f32)
    }

    fn at(&self, point: &Point) -> [f32; 2] {
        [self.x(point.x), self.y(point.y)]
    }

    fn draw(&self, shapes: &mut Vec<Shape>) {
        self.axes(shapes);
        let stairs = self.stairs();
        if stairs.len() > 1 {
            shapes.push(Shape::Line {
                points: stairs.clone(),
                ink: Ink::Text,
                width: 1.4,
                dashed: true,
            });
        }
        let mut taken = Vec::new();
        for series in &self.panel.series {
            self.series(shapes, series, &mut taken);
        }
        for pair in stairs.windows(2) {
            let [a, b] = [pair[0], pair[1]];
            taken.push([
                a[0].min(b[0]) - 1.5,
                a[1].min(b[1]) - 1.5,
                a[0].max(b[0]) + 1.5,
                a[1].max(b[1]) + 1.5,
            ]);
        }
        self.labels(shapes, &mut taken);
    }

    fn axes(&self, shapes: &mut Vec<Shape>) {
        let ([left, top], [w, h]) = (self.corner, self.size);
        let line = |a: [f32; 2], b: [f32; 2], ink, width| Shape::Line {
            points: vec![a, b],
            ink,
            width,
            dashed: false,
        };
        shapes.push(text([left, top - 10.0], &self.panel.title, 13.0, Anchor::Start, Ink::Text));
        for (value, name) in log_ticks(self.y_range, h / 26.0) {
            let y = self.y(value);
            shapes.push(line([left, y], [left + w, y], Ink::Grid, 1.0));
            let at = [left - 6.0, y + 4.0];
            shapes.push(text(at, &name, SMALL, Anchor::End, Ink::Text));
        }
        match &self.panel.x {
            Scale::Log => {
                for (value, name) in log_ticks(self.x_range, w / 44.0) {
                    let x = self.x(value);
                    shapes.push(line([x, top], [x, top + h], Ink::Grid, 1.0));
                    let at = [x, top + h + 16.0];
                    shapes.push(text(at, &name, SMALL, Anchor::Middle, Ink::Text));
                }
            }
            Scale::Steps(names) => {
                for (step, name) in names.iter().enumerate() {
                    let x = self.x(step as f64);
                    shapes.push(line([x, top + h], [x, top + h + 4.0], Ink::Quiet, 1.0));
                    let at = [x, top + h + 16.0];
                    shapes.push(text(at, name, SMALL, Anchor::Middle, Ink::Text));
                }
            }
        }
        shapes.push(line([left, top], [left, top + h], Ink::Quiet, 1.0));
        shapes.push(line([left, top + h], [left + w, top + h], Ink::Quiet, 1.0));
        let at = [left + 0.5 * w, top + h + 35.0];
        shapes.push(text(at, &self.panel.x_label, TEXT, Anchor::Middle, Ink::Text));
        shapes.push(Shape::Text {
            at: [left - 46.0, top + 0.5 * h],
            text: self.panel.y_label.clone(),
            size: TEXT,
            anchor: Anchor::Middle,
            ink: Ink::Text,
            upright: true,
        });
    }

    fn stairs(&self) -> Vec<[f32; 2]> {
        let mut stairs: Vec<[f32; 2]> = Vec::new();
        for point in &self.panel.front {
            let place = [self.x(point[0]), self.y(point[1])];
            if let Some(last) = stairs.last().copied() {
                stairs.push([place[0], last[1]]);
            }
            stairs.push(place);
        }
        stairs
    }

    fn series(&self, shapes: &mut Vec<Shape>, series: &Series, taken: &mut Vec<[f32; 4]>) {
        let banded: Vec<(f64, [f64; 2])> =
            series.points.iter().filter_map(|p| Some((p.x, p.band?))).collect();
        if banded.len() > 1 {
            let low = banded.iter().map(|(x, band)| [self.x(*x), self.y(band[0])]);
            let high = banded.iter().rev().map(|(x, band)| [self.x(*x), self.y(band[1])]);
            let points = low.chain(high).collect();
            shapes.push(Shape::Area { points, ink: series.ink, opacity: 0.2 });
        }
        if series.line {
            let points: Vec<[f32; 2]> = series.points.iter().map(|p| self.at(p)).collect();
            for pair in points.windows(2) {
                // Labels keep off lines, too.
                for k in 0..=12 {
                    let part = k as f32 / 12.0;
                    let at: [f32; 2] =
                        std::array::from_fn(|c| pair[0][c] + part * (pair[1][c] - pair[0][c]));
                    taken.push(around(at, 2.0));
                }
            }
            shapes.push(Shape::Line { points, ink: series.ink, width: 1.8, dashed: false });
        }
        for point in &series.points {
            let at = self.at(point);
            taken.push(around(at, if point.stands_out { 8.0 } else { 5.0 }));
            if point.stands_out {
                // A rim of paper sets it off from what is behind.
                for (ink, radius) in [(Ink::Paper, 10.0), (series.ink, 8.0)] {
                    let (form, filled) = (Form::Star, true);
                    shapes.push(Shape::Mark { at, form, radius, ink, filled });
                }
            } else {
                shapes.push(mark(series, at, 4.0));
            }
        }
    }

    fn labels(&self, shapes: &mut Vec<Shape>, taken: &mut Vec<[f32; 4]>) {
        let [left, top] = self.corner;
        let inside = |r: &[f32; 4]| {
            r[0] >= left + 2.0
                && r[1] >= top + 1.0
                && r[2] <= left + self.size[0]
                && r[3] <= top + self.size[1] - 1.0
        };
        let mut labelled: Vec<&Point> = self
            .panel
            .series
            .iter()
            .flat_map(|series| &series.points)
            .filter(|point| !point.label.is_empty())
            .collect();
        // What stands out is named first, where there is most room.
        labelled.sort_by_key(|point| !point.stands_out);
        for point in labelled {
            let [x, y] = self.at(point);
            let wide = text_width(&point.label, SMALL);
            let place = |angle: f32, distance: f32| {
                let (cx, cy) = (x + distance * angle.cos(), y + distance * angle.sin());
                let start = cx - wide * 0.5 * (1.0 - angle.cos());
                [start - 2.0, cy - 7.0, start + wide + 2.0, cy + 6.0]
            };
            let candidates = [9.0f32, 14.0, 20.0, 28.0, 38.0, 50.0, 64.0, 80.0, 100.0, 125.0]
                .into_iter()
                .flat_map(|distance| {
                    [0.0f32, -45.0, 45.0, 180.0, -135.0, 135.0, -90.0, 90.0, -20.0, 20.0, -160.0]
                        .map(|angle| (angle.to_radians(), distance))
                });
            let free = candidates
                .map(|(angle, distance)| (place(angle, distance), distance))
                .find(|(rect, _)| inside(rect) && taken.iter().all(|other| !overlap(rect, other)));
            // Without room it is left to the table.
            let Some((rect, distance)) = free else { continue };
            if distance > 20.0 {
                let nearest = [x.clamp(rect[0], rect[2]), y.clamp(rect[1], rect[3])];
                let points = vec![[x, y], nearest];
                shapes.push(Shape::Line { points, ink: Ink::Quiet, width: 0.7, dashed: false });
            }
            let at = [rect[0] + 2.0, rect[3] - 3.0];
            shapes.push(text(at, &point.label, SMALL, Anchor::Start, Ink::Text));
            taken.push(rect);
        }
    }
}

fn around([x, y]: [f32; 2], radius: f32) -> [f32; 4] {
    [x - radius, y - radius, x + radius, y + radius]
}

fn overlap(a: &[f32; 4], b: &[f32; 4]) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

/// From a little below the least to a little above the largest value above 0.
fn log_range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let (mut low, mut high) = (f64::INFINITY, 0.0f64);
    for value in values.filter(|value| value.is_finite() && *value > 0.0) {
        low = low.min(value);
        high = high.max(value);
    }
    if low > high {
        return [0.1, 1.0];
    }
    let room = (high / low).max(2.0).powf(0.08);
    // A panel of a single value has a range, too.
    let spread = if high / low < 2.0 { (2.0 / (high / low)).sqrt() } else { 1.0 };
    [low / room / spread, high * room * spread]
}

/// Values at which a logarithmic scale is labelled, about `count` at most.
pub fn log_ticks([low, high]: [f64; 2], count: f32) -> Vec<(f64, String)> {
    let sets: [&[f64]; 4] =
        [&[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0], &[1.0, 2.0, 5.0], &[1.0, 3.0], &[1.0]];
    let decades = low.log10().floor() as i32..=high.log10().ceil() as i32;
    let ticks = |factors: &[f64]| -> Vec<f64> {
        decades
            .clone()
            .flat_map(|decade| factors.iter().map(move |f| f * 10f64.powi(decade)))
            .filter(|value| (low..=high).contains(value))
            .collect()
    };
    let fitting = sets.iter().map(|set| ticks(set)).find(|ticks| ticks.len() as f32 <= count);
    let ticks = fitting.unwrap_or_else(|| ticks(sets[3]));
    ticks.into_iter().map(|value| (value, number(value))).collect()
}

/// A number as short as it may be with two digits that count.
pub fn number(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return "0".to_owned();
    }
    let digits = (1 - value.abs().log10().floor() as i32).max(0) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_not_too_many() {
        let names = |range, count| -> Vec<String> {
            log_ticks(range, count).into_iter().map(|(_, name)| name).collect()
        };
        assert_eq!(names([0.3, 30.0], 7.0), ["0.5", "1", "2", "5", "10", "20"]);
        assert_eq!(names([0.001, 1000.0], 8.0), ["0.001", "0.01", "0.1", "1", "10", "100", "1000"]);
        for range in [[0.9, 1.1], [1e-9, 1e9], [0.15, 0.16]] {
            assert!(names(range, 6.0).len() <= 19);
        }
    }

    #[test]
    fn labels_overlap_nothing() {
        let points = (0..14)
            .map(|k| Point {
                x: 1.0 + 0.02 * f64::from(k % 5),
                y: 0.1 + 0.003 * f64::from(k / 3),
                label: format!("a setting of number {k}"),
                ..Point::default()
            })
            .collect();
        let panel = Panel {
            title: "t".into(),
            x_label: "x".into(),
            y_label: "y".into(),
            x: Scale::Log,
            series: vec![Series {
                name: "s".into(),
                ink: Ink::Series(0),
                form: Form::Circle,
                filled: true,
                line: false,
                points,
            }],
            front: Vec::new(),
        };
        let drawing = draw(&Chart {
            panels: vec![panel],
            columns: 1,
            size: [400.0, 300.0],
            ..Chart::default()
        });
        let labels: Vec<[f32; 4]> = drawing
            .shapes
            .iter()
            .filter_map(|shape| match shape {
                Shape::Text { at, text, size, .. } if text.starts_with("a setting") => {
                    Some([at[0], at[1] - 9.0, at[0] + text_width(text, *size), at[1] + 2.0])
                }
                _ => None,
            })
            .collect();
        assert!(labels.len() > 8, "{} of 14 labels found room", labels.len());
        for (k, a) in labels.iter().enumerate() {
            assert!(labels[..k].iter().all(|b| !overlap(a, b)));
        }
    }
}
