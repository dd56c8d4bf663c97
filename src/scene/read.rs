//! Reading fields out of JSON: every wrong field is noted with its pointer, and reading goes on to the next.

use super::model::FieldError;
use super::quantity::Quantity;
use super::spelling;
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
    /// Fields that a misspelt key was likely meant for: they count as given, so that a typo is one error and not two.
    meant: Vec<&'static str>,
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
    pub(super) fn object<'a>(
        &mut self,
        value: &'a Value,
        pointer: &str,
        allowed: &[&'static str],
    ) -> Option<Object<'a>> {
        let Value::Object(map) = value else {
            self.wrong(pointer, format!("{} where an object is expected", describe(value)));
            return None;
        };
        let mut object = Object { map, pointer: pointer.to_owned(), meant: Vec::new() };
        for key in map.keys().filter(|key| !allowed.contains(&key.as_str())) {
            let absent = allowed.iter().copied().filter(|known| !map.contains_key(*known));
            let detail = match spelling::nearest(key, absent) {
                Some(known) => {
                    object.meant.push(known);
                    did_you_mean(known)
                }
                None => format!("unknown field; allowed here: {}", allowed.join(", ")),
            };
            self.wrong(object.at(key), detail);
        }
        Some(object)
    }

    /// Notes that a field is missing, unless it is only misspelt.
    pub(super) fn missing(&mut self, object: &Object<'_>, key: &str, expected: impl std::fmt::Display) {
        if !object.meant.contains(&key) {
            self.wrong(object.at(key), format!("missing; {expected}"));
        }
    }

    /// Takes a value as an object of which nothing but its `kind` can be judged.
    pub(super) fn kind_alone<'a>(&mut self, value: &'a Value, pointer: &str) -> Option<Object<'a>> {
        const KIND: &str = "kind";
        let Value::Object(map) = value else { return self.object(value, pointer, &[]) };
        let mut object = Object { map, pointer: pointer.to_owned(), meant: Vec::new() };
        let misspelt = map.keys().find(|key| !map.contains_key(KIND) && spelling::nearest(key, [KIND]).is_some());
        if let Some(key) = misspelt {
            object.meant.push(KIND);
            self.wrong(object.at(key), did_you_mean(KIND));
        }
        Some(object)
    }

    /// The object under `key`, or `None` when it is absent or wrong.
    pub(super) fn child<'a>(&mut self, parent: &Object<'a>, key: &str, allowed: &[&'static str]) -> Option<Object<'a>> {
        let value = parent.value(key)?;
        self.object(value, &parent.at(key), allowed)
    }

    /// A number that must be there.
    pub(super) fn number<Q: Quantity>(&mut self, object: &Object<'_>, key: &str) -> Option<Q> {
        match object.value(key) {
            Some(value) => self.quantity(value, &object.at(key)),
            None => {
                self.missing(object, key, format_args!("a number is needed, {}", allowed::<Q>()));
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
        let number = self.plain(value, pointer, &allowed::<Q>())?;
        Q::try_from(number).map_err(|e| self.wrong(pointer, e.to_string())).ok()
    }

    /// A number whose range is judged elsewhere.
    pub(super) fn plain(&mut self, value: &Value, pointer: &str, expected: &str) -> Option<f64> {
        let number = value.as_f64();
        if number.is_none() {
            let given = describe(value);
            self.wrong(pointer, format!("{given} where a number is expected, {expected}{}", unquoted(value)));
        }
        number
    }

    /// A whole number with a default. Integral floats (64.0) count: JSON does not tell them apart.
    pub(super) fn integer_or(&mut self, object: &Object<'_>, key: &str, range: (u32, u32), default: u32) -> u32 {
        let Some(value) = object.value(key) else { return default };
        let number =
            value.as_f64().filter(|n| n.fract() == 0.0 && (f64::from(range.0)..=f64::from(range.1)).contains(n));
        match number {
            Some(number) => number as u32,
            None => {
                let expected = format!("is not a whole number from {} to {}{}", range.0, range.1, unquoted(value));
                self.wrong(object.at(key), format!("{} {expected}", describe(value)));
                default
            }
        }
    }

    /// Three numbers, red, green, blue; or one for all of them.
    pub(super) fn colour<Q: Quantity>(&mut self, value: &Value, pointer: &str) -> Option<[Q; 3]> {
        if value.is_number() {
            return self.quantity(value, pointer).map(|grey| [grey; 3]);
        }
        let Some([r, g, b]) = value.as_array().map(Vec::as_slice) else {
            let given = match value {
                Value::Array(list) => format!("a list of {}", list.len()),
                other => describe(other),
            };
            let expected = format!("three numbers [r, g, b] or one for all are expected, each {}", allowed::<Q>());
            self.wrong(pointer, format!("{given} where {expected}{}", unquoted(value)));
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
        let allowed = words.join(", ");
        match (object.value(key), found.and_then(|word| spelling::nearest(word, words.iter().copied()))) {
            (None, _) => self.missing(object, key, format_args!("allowed: {allowed}")),
            (Some(value), None) => {
                self.wrong(object.at(key), format!("{} is not known; allowed: {allowed}", describe(value)))
            }
            (Some(value), Some(meant)) => self.wrong(
                object.at(key),
                format!("{} is not known; did you mean \"{meant}\"? allowed: {allowed}", describe(value)),
            ),
        }
        None
    }
}

fn allowed<Q: Quantity>() -> String {
    format!("{} to {} {}", Q::RANGE.start(), Q::RANGE.end(), Q::UNIT).trim_end().to_owned()
}

fn did_you_mean(known: &str) -> String {
    format!("unknown field; did you mean \"{known}\"?")
}

/// What a text that was to be a number lacks.
fn unquoted(value: &Value) -> &'static str {
    let is_number = |text: &str| text.trim_start_matches(['+', '-', '.']).starts_with(|c: char| c.is_ascii_digit());
    match value {
        Value::String(text) if is_number(text) => "; numbers stand without quotes and with a decimal point: 12.5",
        _ => "",
    }
}

/// A value in words; texts as they are, long ones cut.
pub(super) fn describe(value: &Value) -> String {
    const SHOWN: usize = 40;
    match value {
        Value::Null => "null".to_owned(),
        Value::Bool(value) => value.to_string(),
        Value::Number(number) => number.to_string(),
        Value::String(text) => {
            let cut = if text.chars().nth(SHOWN).is_some() { "…" } else { "" };
            format!("the text {:?}", text.chars().take(SHOWN).chain(cut.chars()).collect::<String>())
        }
        Value::Array(_) => "a list".to_owned(),
        Value::Object(_) => "an object".to_owned(),
    }
}
