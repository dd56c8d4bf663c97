//! JSON Schema as far as this project's documents use it: whether a value fits, and values that fit.

use serde_json::{Map, Value, json};

/// Random numbers that are the same for the same seed (splitmix64, Steele, Lea and Flood 2014).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// Below a bound, which is above 0.
    pub(crate) fn below(&mut self, bound: usize) -> usize {
        usize::try_from(self.next() % bound as u64).unwrap()
    }

    /// True once in so many times.
    pub(crate) fn once_in(&mut self, times: usize) -> bool {
        self.below(times) == 0
    }

    pub(crate) fn pick<'a, T>(&mut self, list: &'a [T]) -> &'a T {
        &list[self.below(list.len())]
    }
}

/// A schema with what its references lead to.
fn resolved<'a>(document: &'a Value, schema: &'a Value) -> &'a Value {
    match schema.get("$ref").and_then(Value::as_str) {
        Some(to) => {
            let found = document.pointer(to.trim_start_matches('#'));
            resolved(document, found.unwrap_or_else(|| panic!("{to} leads nowhere")))
        }
        None => schema,
    }
}

fn has_type(value: &Value, name: &str) -> bool {
    match name {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "boolean" => value.is_boolean(),
        "null" => value.is_null(),
        "number" => value.is_number(),
        "integer" => value.as_f64().is_some_and(|number| number.fract() == 0.0),
        other => panic!("no type {other}"),
    }
}

/// Why a value does not fit; none if it does.
pub(crate) fn fault(document: &Value, schema: &Value, value: &Value) -> Option<String> {
    let schema = match resolved(document, schema) {
        Value::Bool(fits) => return (!fits).then(|| format!("{value} is too much")),
        other => other,
    };
    let types = match &schema["type"] {
        Value::Null => Vec::new(),
        Value::Array(types) => types.iter().filter_map(Value::as_str).collect(),
        one => vec![one.as_str().unwrap()],
    };
    if !types.is_empty() && !types.iter().any(|name| has_type(value, name)) {
        return Some(format!("{value} is no {}", types.join(", ")));
    }
    if let Some(words) = schema["enum"].as_array().filter(|words| !words.contains(value)) {
        return Some(format!("{value} is none of {words:?}"));
    }
    if let Some(wanted) = schema.get("const").filter(|wanted| *wanted != value) {
        return Some(format!("{value} is not {wanted}"));
    }
    if let Some(number) = value.as_f64() {
        let beyond = |key: &str, is: fn(f64, f64) -> bool| schema[key].as_f64().is_some_and(|end| is(number, end));
        let beyond = beyond("minimum", |n, end| n < end)
            || beyond("maximum", |n, end| n > end)
            || beyond("exclusiveMinimum", |n, end| n <= end);
        if beyond {
            return Some(format!("{number} is out of range"));
        }
    }
    let inner = match value {
        Value::Array(list) => in_list(document, schema, list),
        Value::Object(map) => in_object(document, schema, map),
        _ => None,
    };
    if inner.is_some() {
        return inner;
    }
    let forms = schema["anyOf"].as_array()?;
    let faults: Vec<String> = forms.iter().map_while(|form| fault(document, form, value)).collect();
    (faults.len() == forms.len()).then(|| format!("none of the forms fits: {}", faults.join("; ")))
}

fn in_list(document: &Value, schema: &Value, list: &[Value]) -> Option<String> {
    let length = |key: &str| schema[key].as_u64();
    let count = list.len() as u64;
    if length("minItems").is_some_and(|least| count < least) || length("maxItems").is_some_and(|most| count > most) {
        return Some(format!("{count} items"));
    }
    let first = schema["prefixItems"].as_array().map_or(&[][..], Vec::as_slice);
    list.iter().enumerate().find_map(|(i, item)| match (first.get(i), schema.get("items")) {
        (Some(own), _) | (None, Some(own)) => fault(document, own, item).map(|why| format!("/{i}: {why}")),
        (None, None) => None,
    })
}

fn in_object(document: &Value, schema: &Value, map: &Map<String, Value>) -> Option<String> {
    let required = schema["required"].as_array().map_or(&[][..], Vec::as_slice);
    if let Some(name) = required.iter().filter_map(Value::as_str).find(|name| !map.contains_key(*name)) {
        return Some(format!("{name} is missing"));
    }
    map.iter().find_map(|(name, value)| match (schema["properties"].get(name), schema.get("additionalProperties")) {
        (Some(own), _) | (None, Some(own)) => fault(document, own, value).map(|why| format!("/{name}: {why}")),
        (None, None) => None,
    })
}

/// A value that fits a schema, as far as one schema alone can say.
pub(crate) fn value(document: &Value, schema: &Value, random: &mut Random) -> Value {
    let schema = resolved(document, schema);
    if let Some(words) = schema["enum"].as_array().or_else(|| schema["examples"].as_array()) {
        return random.pick(words).clone();
    }
    if let Some(only) = schema.get("const") {
        return only.clone();
    }
    let mut made = match schema["type"].as_str() {
        Some("object") => object(document, schema, random),
        Some("array") => {
            let first = schema["prefixItems"].as_array().cloned().unwrap_or_default();
            let least = schema["minItems"].as_u64().unwrap_or(0) as usize;
            let most = schema["maxItems"].as_u64().unwrap_or(3).min(least as u64 + 3) as usize;
            let count = least + random.below(most - least + 1);
            let item = |i: usize| first.get(i).cloned().unwrap_or_else(|| schema["items"].clone());
            (0..count).map(|i| value(document, &item(i), random)).collect()
        }
        Some("integer") => {
            let (low, high) = ends(schema, 1000.0);
            json!(low as i64 + random.below((high - low) as usize + 1) as i64)
        }
        Some("number") => {
            let (low, high) = ends(schema, 1e9);
            match random.below(6) {
                0 => json!(low),
                1 => json!(high),
                // Small numbers of wide ranges too.
                2 => json!((low + (high - low) * 1e-3).clamp(low, high)),
                _ => json!(low + (high - low) * (random.next() as f64 / u64::MAX as f64)),
            }
        }
        Some("boolean") => json!(random.once_in(2)),
        Some("string") => json!(random.pick(&["", "a", "sky", "ä\u{1f300}", "../..", "0"])),
        _ => Value::Null,
    };
    if let Some(forms) = schema["anyOf"].as_array() {
        let form = resolved(document, random.pick(forms));
        // A form that only demands fields of the object that is there.
        if let (Some(map), None) = (made.as_object_mut(), form.get("type")) {
            for name in form["required"].as_array().unwrap().iter().filter_map(Value::as_str) {
                map.insert(name.to_owned(), value(document, &schema["properties"][name], random));
            }
            return made;
        }
        return value(document, form, random);
    }
    made
}

fn ends(schema: &Value, wide: f64) -> (f64, f64) {
    let low = schema["minimum"].as_f64();
    let low = low.or_else(|| Some(schema["exclusiveMinimum"].as_f64()?.next_up().max(1e-6))).unwrap_or(-wide);
    (low, schema["maximum"].as_f64().unwrap_or(low.max(0.0) + wide))
}

fn object(document: &Value, schema: &Value, random: &mut Random) -> Value {
    let required = schema["required"].as_array().cloned().unwrap_or_default();
    let known = schema["properties"].as_object().cloned().unwrap_or_default();
    let given = known.iter().filter(|(name, _)| required.contains(&json!(name)) || random.once_in(2));
    let given: Vec<_> = given.map(|(name, own)| (name.clone(), own.clone())).collect();
    given.into_iter().map(|(name, own)| (name, value(document, &own, random))).collect::<Map<_, _>>().into()
}
