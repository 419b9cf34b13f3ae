//! Numbers as people type them: `0.5`, `0,5`, `1/3`, `12 cm`. Anything else is refused with a
//! message, and the field keeps its value.

use std::cell::RefCell;
use std::rc::Rc;

use eframe::egui::{self, DragValue, Id, Response, Slider, Ui};

/// What a field's number is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    Plain,
    /// In metres.
    Length,
    /// In millimetres.
    Millimetres,
    /// In degrees.
    Angle,
}

impl Unit {
    /// What may stand after a number, and what it is in the field's unit.
    fn suffixes(self) -> &'static [(&'static str, f64)] {
        match self {
            Self::Plain => &[],
            Self::Length => &[("m", 1.0), ("cm", 0.01), ("mm", 0.001), ("km", 1000.0)],
            Self::Millimetres => &[("mm", 1.0), ("cm", 10.0), ("m", 1000.0)],
            Self::Angle => &[("deg", 1.0), ("°", 1.0), ("rad", 180.0 / std::f64::consts::PI)],
        }
    }
}

/// The number that was typed, or why it is none.
pub fn parse(text: &str, unit: Unit) -> Result<f64, String> {
    let text = text.trim();
    let number = text.trim_end_matches(|c: char| c.is_alphabetic() || "°%".contains(c));
    let (suffix, number) = (&text[number.len()..], number.trim_end());
    let refused = || {
        let units: Vec<&str> = unit.suffixes().iter().map(|(name, _)| *name).collect();
        let units = match units.as_slice() {
            [] => String::new(),
            units => format!(", with {} behind it", units.join(", ")),
        };
        format!("\"{text}\" is no number here. Write for example 0.5, 0,5 or 1/3{units}.")
    };
    let factor = match suffix {
        "" => 1.0,
        suffix => {
            let known = unit.suffixes().iter().find(|(own, _)| own.eq_ignore_ascii_case(suffix));
            known.ok_or_else(refused)?.1
        }
    };
    let part = |part: &str| {
        let part = part.trim().replace('−', "-");
        // A comma is the decimal sign of half of the world; beside a point it might be anything.
        let is_clear = !(part.contains(',') && part.contains('.'));
        let number = part.replace(',', ".").parse::<f64>();
        number.ok().filter(|_| is_clear).ok_or_else(refused)
    };
    let value = factor
        * match number.split_once('/') {
            Some((above, below)) => part(above)? / part(below)?,
            None => part(number)?,
        };
    if value.is_finite() {
        Ok(value)
    } else {
        Err(format!("\"{text}\" is not finite. The field keeps its number."))
    }
}

/// What a parser refused in this frame.
type Refused = Rc<RefCell<Option<String>>>;

fn parser(unit: Unit, refused: &Refused) -> impl Fn(&str) -> Option<f64> + use<> {
    let refused = refused.clone();
    move |text| match parse(text, unit) {
        Ok(value) => Some(value),
        Err(problem) => {
            *refused.borrow_mut() = Some(problem);
            None
        }
    }
}

/// Half a number is refused while it is typed, which is no news before the field is left.
fn tell(ui: &Ui, response: &Response, refused: &Refused) {
    if response.lost_focus()
        && let Some(problem) = refused.borrow_mut().take()
    {
        ui.data_mut(|data| data.insert_temp(problem_id(), problem));
    }
}

fn problem_id() -> Id {
    Id::unique("refused number")
}

/// What was refused since this was last asked.
pub fn problem(ctx: &egui::Context) -> Option<String> {
    ctx.data_mut(|data| data.remove_temp(problem_id()))
}

/// A draggable number.
pub fn number(ui: &mut Ui, field: DragValue<'_>, unit: Unit) -> Response {
    let refused = Refused::default();
    let response = ui.add(field.custom_parser(parser(unit, &refused)));
    tell(ui, &response, &refused);
    response
}

/// A slider with its number.
pub fn slider(ui: &mut Ui, slider: Slider<'_>, unit: Unit) -> Response {
    let refused = Refused::default();
    let response = ui.add(slider.custom_parser(parser(unit, &refused)));
    tell(ui, &response, &refused);
    response
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_as_people_write_them() {
        for (text, unit, expected) in [
            ("0.5", Unit::Plain, 0.5),
            (" 0,5 ", Unit::Plain, 0.5),
            ("−1e-3", Unit::Plain, -1e-3),
            ("1/4", Unit::Plain, 0.25),
            ("1,5 / 2", Unit::Plain, 0.75),
            ("12 cm", Unit::Length, 0.12),
            ("3/4m", Unit::Length, 0.75),
            ("5MM", Unit::Length, 0.005),
            ("2 cm", Unit::Millimetres, 20.0),
            ("90deg", Unit::Angle, 90.0),
            ("45 °", Unit::Angle, 45.0),
            ("1 rad", Unit::Angle, 180.0 / std::f64::consts::PI),
        ] {
            let value = parse(text, unit).unwrap();
            assert!((value - expected).abs() < 1e-12, "{text}: {value}");
        }
        for (text, unit) in [
            ("", Unit::Plain),
            ("nan", Unit::Plain),
            ("inf", Unit::Length),
            ("-infinity", Unit::Plain),
            ("1/0", Unit::Plain),
            ("0/0", Unit::Length),
            ("1e999", Unit::Plain),
            ("1.234,5", Unit::Plain),
            ("5 cm", Unit::Plain),
            ("5 deg", Unit::Length),
            ("1/2/3", Unit::Plain),
            ("m", Unit::Length),
        ] {
            assert!(parse(text, unit).is_err(), "{text}");
        }
        assert!(parse("wide", Unit::Length).unwrap_err().contains("with m, cm, mm, km behind"));
    }
}
