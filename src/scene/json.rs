//! JSON text to values, strictly: a key that is given twice is an error, since the loser would silently be ignored. Values and
//! keys are counted, as in memory they are up to a hundred times as long as their text.

use super::encoding::{self, EncodingError};
use super::model::SceneError;
use serde::de::DeserializeSeed;
use serde_json::{Map, Number, Value};
use std::cell::Cell;
use std::fmt;

/// Most values: as many as all spheres and tables of a scene have.
const MAX_VALUES: u32 = 600_000;
/// Most keys of all objects together, many times those of a scene.
const MAX_KEYS: u32 = 4096;

/// Why bytes are no JSON. The message says where (line and column) and what was wrong.
#[derive(Debug, thiserror::Error)]
pub(super) enum JsonError {
    /// Not even text.
    #[error(transparent)]
    Encoding(#[from] EncodingError),
    /// Text, but not JSON, or a key twice.
    #[error("{error}{hint}")]
    Syntax { error: serde_json::Error, hint: &'static str },
}

/// Reads JSON as a scene is read: no key is given twice. For documents that have a scene in a field.
///
/// # Errors
/// [`SceneError::Unreadable`] where the text is no JSON.
pub fn strict_json(text: &[u8]) -> Result<Value, SceneError> {
    parse(text).map_err(|error| SceneError::Unreadable(error.to_string()))
}

/// Parses JSON and refuses duplicate keys.
pub(super) fn parse(bytes: &[u8]) -> Result<Value, JsonError> {
    let text = encoding::utf8(bytes)?;
    let mut reader = serde_json::Deserializer::from_slice(text);
    let explain = |error| JsonError::Syntax { hint: hint(text, &error), error };
    let left = Left { values: Cell::new(MAX_VALUES), keys: Cell::new(MAX_KEYS) };
    let value = Strict(&left).deserialize(&mut reader).map_err(explain)?;
    reader.end().map_err(explain)?;
    Ok(value)
}

/// What a decimal comma does to an object is hard to see in the parser's words, which ask for a key.
fn hint(text: &[u8], error: &serde_json::Error) -> &'static str {
    let before: usize =
        text.split_inclusive(|byte| *byte == b'\n').take(error.line().saturating_sub(1)).map(<[u8]>::len).sum();
    let read = text.get(..before + error.column()).unwrap_or(text);
    let whole = |text: &[u8]| text.iter().rposition(|byte| !byte.is_ascii_digit()).map_or(0, |at| at + 1);
    let digits = whole(read);
    match read.get(..digits).and_then(|rest| rest.strip_suffix(b",")) {
        Some(rest) if digits < read.len() && rest.last().is_some_and(u8::is_ascii_digit) => {
            " (numbers have a decimal point, not a comma)"
        }
        _ => "",
    }
}

/// What may still come.
struct Left {
    values: Cell<u32>,
    keys: Cell<u32>,
}

fn take<E: serde::de::Error>(left: &Cell<u32>, most: u32, what: &str) -> Result<(), E> {
    let rest = left.get().checked_sub(1).ok_or_else(|| E::custom(format_args!("more than {most} {what}")))?;
    left.set(rest);
    Ok(())
}

#[derive(Clone, Copy)]
struct Strict<'a>(&'a Left);

impl<'de> DeserializeSeed<'de> for Strict<'_> {
    type Value = Value;

    fn deserialize<D: serde::Deserializer<'de>>(self, reader: D) -> Result<Value, D::Error> {
        take(&self.0.values, MAX_VALUES, "values")?;
        reader.deserialize_any(self)
    }
}

impl<'de> serde::de::Visitor<'de> for Strict<'_> {
    type Value = Value;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("JSON")
    }
    fn visit_bool<E>(self, value: bool) -> Result<Value, E> {
        Ok(Value::Bool(value))
    }
    fn visit_i64<E>(self, value: i64) -> Result<Value, E> {
        Ok(Value::Number(value.into()))
    }
    fn visit_u64<E>(self, value: u64) -> Result<Value, E> {
        Ok(Value::Number(value.into()))
    }
    fn visit_f64<E: serde::de::Error>(self, value: f64) -> Result<Value, E> {
        Number::from_f64(value).map(Value::Number).ok_or_else(|| E::custom("a number must be finite"))
    }
    fn visit_str<E>(self, value: &str) -> Result<Value, E> {
        Ok(Value::String(value.to_owned()))
    }
    fn visit_unit<E>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }
    fn visit_seq<A: serde::de::SeqAccess<'de>>(self, mut items: A) -> Result<Value, A::Error> {
        let mut list = Vec::new();
        while let Some(item) = items.next_element_seed(self)? {
            list.push(item);
        }
        Ok(Value::Array(list))
    }
    fn visit_map<A: serde::de::MapAccess<'de>>(self, mut entries: A) -> Result<Value, A::Error> {
        let mut map = Map::new();
        while let Some(key) = entries.next_key::<String>()? {
            take(&self.0.keys, MAX_KEYS, "keys of objects")?;
            let value = entries.next_value_seed(self)?;
            if map.contains_key(&key) {
                return Err(serde::de::Error::custom(format!("the key \"{key}\" is given twice")));
            }
            map.insert(key, value);
        }
        Ok(Value::Object(map))
    }
}
