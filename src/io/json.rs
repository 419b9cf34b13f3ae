//! Reads JSON; every error names the file and the field.

use std::path::Path;

use serde_json::Value;

use super::error::read_bounded;
use super::{Error, Fault};

/// Camera files of thousands of frames stay below a few megabytes.
const LARGEST: u64 = 64 << 20;

/// A value of a JSON file with the path by which it was reached.
#[derive(Clone)]
pub(crate) struct Field<'a> {
    pub file: &'a Path,
    pub path: String,
    pub value: &'a Value,
}

/// The text of a JSON file: valid UTF-8 without a byte order mark.
pub(crate) fn read_text(file: &Path) -> Result<String, Error> {
    decode(file, &read_bounded(file, LARGEST)?)
}

fn decode(file: &Path, bytes: &[u8]) -> Result<String, Error> {
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    String::from_utf8(bytes.to_vec()).map_err(|failure| {
        Error::Invalid(Fault::new(
            file,
            format!("byte {}", failure.utf8_error().valid_up_to()),
            "this is no UTF-8 text",
            "Save the file as UTF-8",
        ))
    })
}

/// The value of a JSON file. The tokens `NaN` and `Infinity`, which JSON does not have but some
/// camera tools write, become `null`, so that whoever reads the field can name it.
pub(crate) fn read(file: &Path) -> Result<Value, Error> {
    let text = read_text(file)?;
    parse(&text).map_err(|failure| broken(file, &failure))
}

/// The value of a JSON file whose bytes are at hand.
pub(crate) fn parse_bytes(file: &Path, bytes: &[u8]) -> Result<Value, Error> {
    parse(&decode(file, bytes)?).map_err(|failure| broken(file, &failure))
}

/// Says where a JSON file breaks off or is malformed.
pub(crate) fn broken(file: &Path, failure: &serde_json::Error) -> Error {
    let remedy = if failure.is_eof() {
        "The file seems to be cut off: copy or export it again"
    } else {
        "Correct the file there, or export it again"
    };
    let reason = failure.to_string();
    // serde_json appends the place, which stands in front here.
    let reason = reason.rsplit_once(" at line ").map_or(reason.as_str(), |(reason, _)| reason);
    let place = match failure.line() {
        0 => String::new(),
        line => format!("line {line}, column {}", failure.column()),
    };
    Error::Invalid(Fault::new(file, place, format!("this is not valid JSON ({reason})"), remedy))
}

fn parse(text: &str) -> Result<Value, serde_json::Error> {
    match serde_json::from_str(text) {
        Err(failure) if failure.is_syntax() => {
            let (replaced, found) = without_nan(text);
            if found { serde_json::from_str(&replaced) } else { Err(failure) }
        }
        outcome => outcome,
    }
}

/// The text with every `NaN`, `Infinity` and `-Infinity` outside of strings replaced by `null`,
/// and whether there was any. Everything else keeps its line.
fn without_nan(text: &str) -> (String, bool) {
    let (mut out, mut found) = (String::with_capacity(text.len()), false);
    let mut rest = text;
    while let Some(letter) = rest.chars().next() {
        if letter == '"' {
            let end = string_end(rest);
            out += &rest[..end];
            rest = &rest[end..];
            continue;
        }
        let token = ["NaN", "nan", "-NaN", "-nan", "Infinity", "-Infinity", "inf", "-inf"]
            .into_iter()
            .filter(|token| rest.starts_with(token))
            .max_by_key(|token| token.len());
        if let Some(token) = token {
            out += "null";
            rest = &rest[token.len()..];
            found = true;
        } else {
            out.push(letter);
            rest = &rest[letter.len_utf8()..];
        }
    }
    (out, found)
}

/// The length of the string literal at the start of `text`, quotes included.
fn string_end(text: &str) -> usize {
    let mut escaped = false;
    for (index, byte) in text.bytes().enumerate().skip(1) {
        match byte {
            _ if escaped => escaped = false,
            b'\\' => escaped = true,
            b'"' => return index + 1,
            _ => {}
        }
    }
    text.len()
}

impl<'a> Field<'a> {
    /// The whole file, which must be an object.
    pub fn root(file: &'a Path, value: &'a Value) -> Result<Self, Error> {
        let root = Self { file, path: String::new(), value };
        if value.is_object() {
            Ok(root)
        } else {
            Err(root.wrong("the file must hold one object {…}"))
        }
    }

    /// A member that is present and not `null`.
    pub fn get(&self, key: &str) -> Option<Self> {
        let value = self.value.get(key)?;
        (!value.is_null()).then(|| self.member(key, value))
    }

    /// A member that must be there.
    pub fn need(&self, key: &str) -> Result<Self, Error> {
        match self.value.get(key) {
            Some(Value::Null) | None => {
                Err(self.wrong(&format!("\"{key}\" is missing, or not a number where one is due")))
            }
            Some(value) => Ok(self.member(key, value)),
        }
    }

    fn member(&self, key: &str, value: &'a Value) -> Self {
        let path = if self.path.is_empty() { key.into() } else { format!("{}.{key}", self.path) };
        Self { file: self.file, path, value }
    }

    pub fn items(&self) -> Result<Vec<Self>, Error> {
        let Some(values) = self.value.as_array() else {
            return Err(self.wrong("this must be a list […]"));
        };
        let item = |(index, value)| Self {
            file: self.file,
            path: format!("{}[{index}]", self.path),
            value,
        };
        Ok(values.iter().enumerate().map(item).collect())
    }

    pub fn text(&self) -> Result<&'a str, Error> {
        self.value.as_str().ok_or_else(|| self.wrong("this must be text in quotes"))
    }

    pub fn truth(&self) -> Result<bool, Error> {
        self.value.as_bool().ok_or_else(|| self.wrong("this must be true or false"))
    }

    pub fn number(&self) -> Result<f64, Error> {
        match self.value.as_f64() {
            Some(number) if number.is_finite() => Ok(number),
            _ if self.value.is_null() => Err(self.wrong("this is not a number (NaN or null)")),
            _ => Err(self.wrong("this must be a finite number")),
        }
    }

    /// A list of exactly `N` numbers.
    pub fn numbers<const N: usize>(&self) -> Result<[f64; N], Error> {
        let items = self.items()?;
        if items.len() != N {
            return Err(self.wrong(&format!("{N} numbers are due here, not {}", items.len())));
        }
        let mut numbers = [0.0; N];
        for (number, item) in numbers.iter_mut().zip(items) {
            *number = item.number()?;
        }
        Ok(numbers)
    }

    /// A complaint about this field.
    pub fn wrong(&self, problem: &str) -> Error {
        self.wrong_with(problem, "Correct that field, or export the file again")
    }

    pub fn wrong_with(&self, problem: &str, remedy: &str) -> Error {
        Error::Invalid(Fault::new(self.file, self.path.clone(), problem, remedy))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nan_becomes_null_outside_of_strings_only() {
        let value = parse(r#"{"NaN \" NaN": [NaN, -Infinity, 1e3], "b": "NaN"}"#).unwrap();
        assert!(value["NaN \" NaN"][0].is_null() && value["NaN \" NaN"][1].is_null());
        assert_eq!(value["NaN \" NaN"][2], 1000.0);
        assert_eq!(value["b"], "NaN");
    }

    #[test]
    fn a_hundred_thousand_nested_lists_are_refused() {
        assert!(parse(&"[".repeat(100_000)).is_err());
    }
}
