//! Reading TOML tables strictly: an unknown key is an error that names it and the nearest known one.

use crate::{Error, Result};
use glam::DVec3;
use toml::{Table, Value};

/// Magnitude of a number at the most, and of a size at the least: products of a few stay finite in f64, so that nothing
/// that is computed from a file becomes infinite or NaN.
const MOST: f64 = 1e30;
const LEAST: f64 = 1e-30;

/// A table that remembers where it stands, for messages.
pub(crate) struct Reader<'a> {
    table: &'a Table,
    place: String,
}

impl<'a> Reader<'a> {
    /// Checks the keys of `table` against `known`. `place` is empty for the whole file.
    pub(crate) fn new(table: &'a Table, place: &str, known: &[&str]) -> Result<Self> {
        for key in table.keys() {
            if !known.contains(&key.as_str()) {
                let nearest = known
                    .iter()
                    .max_by(|a, b| strsim::jaro_winkler(a, key).total_cmp(&strsim::jaro_winkler(b, key)));
                let hint = nearest.map_or(String::new(), |n| format!("; did you mean '{n}'?"));
                return Err(Error::invalid(format!("unknown key '{}'{hint}", dotted(place, key))));
            }
        }
        Ok(Self { table, place: place.to_owned() })
    }

    pub(crate) fn name(&self, key: &str) -> String {
        dotted(&self.place, key)
    }

    pub(crate) fn get(&self, key: &str) -> Option<&'a Value> {
        self.table.get(key)
    }

    fn wrong(&self, key: &str, expected: &str) -> Error {
        Error::invalid(format!("'{}' must be {expected}", self.name(key)))
    }

    fn required<T>(&self, key: &str, value: Option<T>) -> Result<T> {
        value.ok_or_else(|| Error::invalid(format!("'{}' is missing", self.name(key))))
    }

    pub(crate) fn number(&self, key: &str) -> Result<Option<f64>> {
        self.get(key)
            .map(|v| finite(v).ok_or_else(|| self.wrong(key, "a finite number of at most 1e30")))
            .transpose()
    }

    pub(crate) fn number_or(&self, key: &str, default: f64) -> Result<f64> {
        Ok(self.number(key)?.unwrap_or(default))
    }

    pub(crate) fn required_number(&self, key: &str) -> Result<f64> {
        let value = self.number(key)?;
        self.required(key, value)
    }

    /// A number above zero.
    pub(crate) fn required_size(&self, key: &str) -> Result<f64> {
        let value = self.required_number(key)?;
        if value >= LEAST {
            Ok(value)
        } else {
            Err(self.wrong(key, &format!("above 0 (at least {LEAST:e})")))
        }
    }

    pub(crate) fn integer(&self, key: &str, range: std::ops::RangeInclusive<i64>) -> Result<Option<i64>> {
        self.get(key)
            .map(|v| {
                v.as_integer().filter(|n| range.contains(n)).ok_or_else(|| {
                    self.wrong(key, &format!("a whole number from {} to {}", range.start(), range.end()))
                })
            })
            .transpose()
    }

    pub(crate) fn flag_or(&self, key: &str, default: bool) -> Result<bool> {
        self.get(key).map_or(Ok(default), |v| v.as_bool().ok_or_else(|| self.wrong(key, "true or false")))
    }

    pub(crate) fn text(&self, key: &str) -> Result<Option<&'a str>> {
        self.get(key).map(|v| v.as_str().ok_or_else(|| self.wrong(key, "a text in quotes"))).transpose()
    }

    pub(crate) fn required_text(&self, key: &str) -> Result<&'a str> {
        let value = self.text(key)?;
        self.required(key, value)
    }

    pub(crate) fn vector(&self, key: &str) -> Result<Option<DVec3>> {
        self.get(key)
            .map(|v| {
                let list = v.as_array().filter(|a| a.len() == 3);
                let parts = list.and_then(|a| Some([finite(&a[0])?, finite(&a[1])?, finite(&a[2])?]));
                parts
                    .map(DVec3::from_array)
                    .ok_or_else(|| self.wrong(key, "a list of three finite numbers of at most 1e30"))
            })
            .transpose()
    }

    pub(crate) fn required_vector(&self, key: &str) -> Result<DVec3> {
        let value = self.vector(key)?;
        self.required(key, value)
    }

    pub(crate) fn numbers(&self, key: &str) -> Result<Option<Vec<f64>>> {
        self.get(key)
            .map(|v| {
                let list = v.as_array().and_then(|a| a.iter().map(finite).collect());
                list.ok_or_else(|| self.wrong(key, "a list of finite numbers of at most 1e30"))
            })
            .transpose()
    }

    /// A unit vector.
    pub(crate) fn required_direction(&self, key: &str) -> Result<DVec3> {
        let v = self.required_vector(key)?;
        v.try_normalize().ok_or_else(|| self.wrong(key, "a direction, not the zero vector"))
    }

    pub(crate) fn table(&self, key: &str) -> Result<Option<&'a Table>> {
        self.get(key).map(|v| v.as_table().ok_or_else(|| self.wrong(key, "a table"))).transpose()
    }

    pub(crate) fn required_table(&self, key: &str) -> Result<&'a Table> {
        let value = self.table(key)?;
        self.required(key, value)
    }

    pub(crate) fn tables(&self, key: &str) -> Result<Vec<&'a Table>> {
        let Some(value) = self.get(key) else { return Ok(Vec::new()) };
        let list = value.as_array().and_then(|a| a.iter().map(Value::as_table).collect());
        list.ok_or_else(|| self.wrong(key, &format!("a list of tables ([[{}]])", self.name(key))))
    }
}

fn dotted(place: &str, key: &str) -> String {
    if place.is_empty() { key.to_owned() } else { format!("{place}.{key}") }
}

fn finite(value: &Value) -> Option<f64> {
    let number = match value {
        Value::Float(f) => *f,
        Value::Integer(i) => *i as f64,
        _ => return None,
    };
    (number.abs() <= MOST).then_some(number)
}

/// Parses TOML text, with the parser's message in one line.
pub(crate) fn parse(text: &str) -> Result<Table> {
    text.parse::<Table>().map_err(|e| {
        let before = |start: usize| text.bytes().take(start).filter(|b| *b == b'\n').count();
        let line = 1 + e.span().map_or(0, |s| before(s.start));
        Error::invalid(format!("line {line}: {}", e.message().replace('\n', " ")))
    })
}

/// The `type` key that chooses among variants, before the keys of the variant are known.
pub(crate) fn type_of<'a>(table: &'a Table, place: &str) -> Result<&'a str> {
    match table.get("type") {
        Some(Value::String(s)) => Ok(s),
        Some(_) => Err(Error::invalid(format!("'{}' must be a text in quotes", dotted(place, "type")))),
        None => Err(Error::invalid(format!("'{}' is missing", dotted(place, "type")))),
    }
}

/// Complaint about a `type` that is not among the known ones.
pub(crate) fn unknown_type(place: &str, got: &str, known: &[&str]) -> Error {
    Error::invalid(format!("'{}' is '{got}'; use one of: {}", dotted(place, "type"), known.join(", ")))
}
