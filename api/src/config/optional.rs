//! A place to listen at that may be left out, which an empty text says.

use serde::de::Error as _;
use serde::{Deserialize as _, Deserializer, Serializer};

use super::listen::Listen;

pub(super) fn serialize<S: Serializer>(place: &Option<Listen>, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_str(&place.as_ref().map_or_else(String::new, ToString::to_string))
}

pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Listen>, D::Error> {
    let text = String::deserialize(from)?;
    if text.is_empty() { Ok(None) } else { text.parse().map(Some).map_err(D::Error::custom) }
}
