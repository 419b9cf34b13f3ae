//! Options, each declared once.
//!
//! A stage lists its options with [`options!`](crate::options!): meaning, type, default, range
//! and unit. From that one declaration come the struct, its default, its check, the terminal's
//! flags and help, the options file's keys, and (in the studio) the controls.

/// What an option accepts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    Number,
    Integer,
    Switch,
    /// One of the named values.
    Choice(&'static [&'static str]),
    /// A number, or `auto` to have it chosen.
    NumberOrAuto,
}

/// One option as declared.
#[derive(Clone, Debug, PartialEq)]
pub struct Declaration {
    /// The stage's section in the options file and first half of the flag.
    pub section: &'static str,
    pub name: &'static str,
    /// Meaning, with the section of the paper where there is one.
    pub help: String,
    pub kind: Kind,
    /// Smallest and largest value accepted; none for switches and choices.
    pub range: Option<(f64, f64)>,
    /// Unit, empty for counts, ratios and choices.
    pub unit: &'static str,
    /// The default as text.
    pub default: String,
}

impl Declaration {
    /// Its flag without the dashes: `section.name`, or `name` for what concerns the whole
    /// command.
    pub fn flag(&self) -> String {
        match self.section {
            "general" | "render" => self.name.to_owned(),
            section => format!("{section}.{}", self.name),
        }
    }
}

/// An option's value is not acceptable.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("option {section}.{name}: {problem}")]
pub struct OptionError {
    pub section: String,
    pub name: String,
    pub problem: String,
}

/// A type that an option may have.
pub trait OptionValue: Sized {
    const KIND: Kind;
    /// Reads the value from text, or says what would be accepted.
    fn parse(text: &str) -> Result<Self, String>;
    fn text(&self) -> String;
    /// The value as a number to be held against the range; `None` where there is none.
    fn number(&self) -> Option<f64>;
}

impl OptionValue for f64 {
    const KIND: Kind = Kind::Number;
    fn parse(text: &str) -> Result<Self, String> {
        text.trim().parse().map_err(|_| format!("\"{text}\" is not a number"))
    }
    fn text(&self) -> String {
        self.to_string()
    }
    fn number(&self) -> Option<f64> {
        Some(*self)
    }
}

impl OptionValue for Option<f64> {
    const KIND: Kind = Kind::NumberOrAuto;
    fn parse(text: &str) -> Result<Self, String> {
        if text.trim() == "auto" {
            return Ok(None);
        }
        f64::parse(text).map(Some).map_err(|problem| format!("{problem} (nor \"auto\")"))
    }
    fn text(&self) -> String {
        self.map_or_else(|| "auto".to_owned(), |value| value.to_string())
    }
    fn number(&self) -> Option<f64> {
        *self
    }
}

impl OptionValue for usize {
    const KIND: Kind = Kind::Integer;
    fn parse(text: &str) -> Result<Self, String> {
        text.trim().parse().map_err(|_| format!("\"{text}\" is not a whole number of 0 or more"))
    }
    fn text(&self) -> String {
        self.to_string()
    }
    fn number(&self) -> Option<f64> {
        Some(*self as f64)
    }
}

impl OptionValue for bool {
    const KIND: Kind = Kind::Switch;
    fn parse(text: &str) -> Result<Self, String> {
        text.trim().parse().map_err(|_| format!("\"{text}\" is neither true nor false"))
    }
    fn text(&self) -> String {
        self.to_string()
    }
    fn number(&self) -> Option<f64> {
        None
    }
}

/// Declares an enum whose values are chosen by name.
#[macro_export]
macro_rules! choices {
    ($(#[$meta:meta])* $name:ident { $($(#[$inner:meta])* $variant:ident = $text:literal),+ $(,)? }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum $name { $($(#[$inner])* $variant),+ }

        impl $crate::options::OptionValue for $name {
            const KIND: $crate::options::Kind = $crate::options::Kind::Choice(&[$($text),+]);
            fn parse(text: &str) -> Result<Self, String> {
                match text.trim() {
                    $($text => Ok(Self::$variant),)+
                    other => Err(format!("\"{other}\" is none of {}", [$($text),+].join(", "))),
                }
            }
            fn text(&self) -> String {
                match self { $(Self::$variant => $text.to_owned()),+ }
            }
            fn number(&self) -> Option<f64> {
                None
            }
        }
    };
}

/// Declares a stage's options: `name: type = default, range, "unit";` with a doc comment each.
/// The range is `None` or `Some((smallest, largest))`.
#[macro_export]
macro_rules! options {
    ($(#[$meta:meta])* $name:ident in $section:literal {
        $($(#[doc = $doc:literal])+ $field:ident: $type:ty = $default:expr, $range:expr, $unit:literal;)+
    }) => {
        $(#[$meta])*
        #[derive(Clone, Debug, PartialEq)]
        pub struct $name { $($(#[doc = $doc])+ pub $field: $type),+ }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default),+ }
            }
        }

        impl $crate::options::OptionGroup for $name {
            fn section(&self) -> &'static str {
                $section
            }
            fn declarations(&self) -> Vec<$crate::options::Declaration> {
                let default = Self::default();
                vec![$($crate::options::Declaration {
                    section: $section,
                    name: stringify!($field),
                    help: [$($doc.trim()),+].join(" "),
                    kind: <$type as $crate::options::OptionValue>::KIND,
                    range: $range,
                    unit: $unit,
                    default: $crate::options::OptionValue::text(&default.$field),
                }),+]
            }
            fn get(&self, name: &str) -> Option<String> {
                match name {
                    $(stringify!($field) => Some($crate::options::OptionValue::text(&self.$field)),)+
                    _ => None,
                }
            }
            fn set(&mut self, name: &str, text: &str) -> Result<(), $crate::options::OptionError> {
                let error = |problem| $crate::options::OptionError {
                    section: $section.to_owned(), name: name.to_owned(), problem,
                };
                match name {
                    $(stringify!($field) => {
                        let value = <$type as $crate::options::OptionValue>::parse(text)
                            .map_err(&error)?;
                        $crate::options::in_range(&value, $range, $unit).map_err(&error)?;
                        self.$field = value;
                    })+
                    _ => return Err(error(format!(
                        "there is no such option; [{}] has {}", $section,
                        [$(stringify!($field)),+].join(", ")))),
                }
                Ok(())
            }
            fn check(&self) -> Result<(), $crate::options::OptionError> {
                $($crate::options::in_range(&self.$field, $range, $unit).map_err(|problem| {
                    $crate::options::OptionError {
                        section: $section.to_owned(), name: stringify!($field).to_owned(), problem,
                    }
                })?;)+
                Ok(())
            }
        }
    };
}

/// The options of one stage, seen through their declarations.
pub trait OptionGroup {
    fn section(&self) -> &'static str;
    fn declarations(&self) -> Vec<Declaration>;
    /// The value of an option as text; `None` where there is no such option.
    fn get(&self, name: &str) -> Option<String>;
    /// Sets an option from text, within its range.
    fn set(&mut self, name: &str, text: &str) -> Result<(), OptionError>;
    /// Whether every value is within its range.
    fn check(&self) -> Result<(), OptionError>;
}

/// Holds a value against its range (used by the code that [`options!`](crate::options!) makes).
pub fn in_range<T: OptionValue>(
    value: &T,
    range: Option<(f64, f64)>,
    unit: &str,
) -> Result<(), String> {
    let (Some(number), Some((low, high))) = (value.number(), range) else {
        return Ok(());
    };
    if number >= low && number <= high {
        return Ok(());
    }
    let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
    Err(format!("{number} is outside {low} to {high}{unit}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    choices! {
        Colour { Red = "red", Blue = "blue" }
    }

    options! {
        Paint in "paint" {
            /// Thickness.
            thickness: f64 = 0.5, Some((0.0, 2.0)), "mm";
            /// Coats.
            coats: usize = 2, Some((1.0, 5.0)), "";
            /// Colour.
            colour: Colour = Colour::Red, None, "";
            /// Drying time.
            drying: Option<f64> = None, Some((0.0, 9.0)), "h";
        }
    }

    #[test]
    fn options_are_set_within_their_range() {
        let mut paint = Paint::default();
        paint.set("thickness", "1.5").unwrap();
        paint.set("colour", "blue").unwrap();
        paint.set("drying", "3").unwrap();
        assert_eq!(
            paint,
            Paint { thickness: 1.5, coats: 2, colour: Colour::Blue, drying: Some(3.0) }
        );
        paint.set("drying", "auto").unwrap();
        assert_eq!(paint.get("drying").unwrap(), "auto");
        for (name, text, word) in [
            ("thickness", "3", "outside 0 to 2 mm"),
            ("thickness", "NaN", "outside"),
            ("coats", "-1", "whole number"),
            ("coats", "0", "outside"),
            ("colour", "green", "none of red, blue"),
            ("gloss", "1", "no such option"),
        ] {
            let message = paint.set(name, text).unwrap_err().to_string();
            assert!(message.contains(word) && message.contains(name), "{message}");
        }
    }

    #[test]
    fn a_value_out_of_range_is_named_by_the_check() {
        let paint = Paint { coats: 9, ..Paint::default() };
        assert_eq!(paint.check().unwrap_err().name, "coats");
    }
}
