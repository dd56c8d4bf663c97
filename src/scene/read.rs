//! Reading fields out of JSON: every wrong field is noted with its pointer, and reading goes on to the next.

use super::{FieldError, quantity::Quantity};
use serde_json::{Map, Value};

/// Collects what is wrong with a document.
#[derive(Default)]
pub(super) struct Reader {
    pub(super) errors: Vec<FieldError>,
}

/// One JSON object, with the pointer that leads to it.
#[derive(Clone)]
pub(super) struct Object<'a> {
    map: &'a Map<String, Value>,
    pub(super) pointer: String,
}

impl Object<'_> {
    pub(super) fn has(&self, key: &str) -> bool {
        self.map.contains_key(key)
    }
    pub(super) fn at(&self, key: &str) -> String {
        format!("{}/{}", self.pointer, key.replace('~', "~0").replace('/', "~1"))
    }
}

impl<'a> Object<'a> {
    pub(super) fn value(&self, key: &str) -> Option<&'a Value> {
        self.map.get(key)
    }
}

impl Reader {
    pub(super) fn wrong(&mut self, pointer: impl Into<String>, detail: impl Into<String>) {
        self.errors.push(FieldError { pointer: pointer.into(), detail: detail.into() });
    }

    /// Takes a value as an object that may hold the `allowed` keys alone.
    pub(super) fn object<'a>(&mut self, value: &'a Value, pointer: &str, allowed: &[&str]) -> Option<Object<'a>> {
        let Value::Object(map) = value else {
            self.wrong(pointer, format!("{} where an object is expected", kind(value)));
            return None;
        };
        let object = Object { map, pointer: pointer.to_owned() };
        for key in map.keys().filter(|key| !allowed.contains(&key.as_str())) {
            self.wrong(object.at(key), format!("unknown field; allowed here: {}", allowed.join(", ")));
        }
        Some(object)
    }

    /// The object under `key`, or `None` when it is absent or wrong.
    pub(super) fn child<'a>(&mut self, parent: &Object<'a>, key: &str, allowed: &[&str]) -> Option<Object<'a>> {
        let value = parent.value(key)?;
        self.object(value, &parent.at(key), allowed)
    }

    /// A number that must be there.
    pub(super) fn number<Q: Quantity>(&mut self, object: &Object<'_>, key: &str) -> Option<Q> {
        match object.value(key) {
            Some(value) => self.quantity(value, &object.at(key)),
            None => {
                self.wrong(object.at(key), format!("missing; a number is needed, {}", allowed::<Q>()));
                None
            }
        }
    }

    /// A number that has a default.
    pub(super) fn number_or<Q: Quantity>(&mut self, object: &Object<'_>, key: &str, default: Q) -> Q {
        match object.value(key) {
            Some(value) => self.quantity(value, &object.at(key)).unwrap_or(default),
            None => default,
        }
    }

    pub(super) fn quantity<Q: Quantity>(&mut self, value: &Value, pointer: &str) -> Option<Q> {
        let Some(number) = value.as_f64() else {
            self.wrong(pointer, format!("{} where a number is expected, {}", kind(value), allowed::<Q>()));
            return None;
        };
        Q::try_from(number).map_err(|e| self.wrong(pointer, e.to_string())).ok()
    }

    /// A whole number with a default. Integral floats (64.0) count: JSON does not tell them apart.
    pub(super) fn integer_or(&mut self, object: &Object<'_>, key: &str, range: (u32, u32), default: u32) -> u32 {
        let Some(value) = object.value(key) else { return default };
        let number =
            value.as_f64().filter(|n| n.fract() == 0.0 && (f64::from(range.0)..=f64::from(range.1)).contains(n));
        match number {
            Some(number) => number as u32,
            None => {
                self.wrong(object.at(key), format!("{value} is not a whole number from {} to {}", range.0, range.1));
                default
            }
        }
    }

    /// Three numbers: red, green, blue.
    pub(super) fn colour<Q: Quantity>(&mut self, value: &Value, pointer: &str) -> Option<[Q; 3]> {
        let Some([r, g, b]) = value.as_array().map(Vec::as_slice) else {
            self.wrong(pointer, format!("three numbers [r, g, b] are expected, each {}", allowed::<Q>()));
            return None;
        };
        let mut channel = |value, i| self.quantity::<Q>(value, &format!("{pointer}/{i}"));
        match (channel(r, 0), channel(g, 1), channel(b, 2)) {
            (Some(r), Some(g), Some(b)) => Some([r, g, b]),
            _ => None,
        }
    }

    /// One of a list of words. `None` when it is absent or wrong; noted in both cases.
    pub(super) fn word<'a>(&mut self, object: &Object<'a>, key: &str, words: &[&str]) -> Option<&'a str> {
        let found = object.value(key).and_then(Value::as_str);
        if let Some(word) = found.filter(|word| words.contains(word)) {
            return Some(word);
        }
        let given = object.value(key).map_or_else(|| "missing".to_owned(), |value| format!("{value} is not known"));
        self.wrong(object.at(key), format!("{given}; allowed: {}", words.join(", ")));
        None
    }
}

fn allowed<Q: Quantity>() -> String {
    format!("{} to {} {}", Q::RANGE.start(), Q::RANGE.end(), Q::UNIT).trim_end().to_owned()
}

fn kind(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "true or false",
        Value::Number(_) => "a number",
        Value::String(_) => "text",
        Value::Array(_) => "a list",
        Value::Object(_) => "an object",
    }
}
