//! Schemas of query parameters, from the words in which their tables tell what is allowed.

use serde_json::{Value, json};

/// A number as queries have it.
const NUMBER: &str = r"-?[0-9]+(\.[0-9]+)?([eE][-+]?[0-9]+)?";

/// The schema of what words such as `1 to 4096`, `rgb | 300 to 1000`, `above 0 to 1` or `X,Y,Z (each …)` allow. `takes` says whether
/// a text is taken: words do not tell that a number has to be whole.
pub(super) fn schema(words: &str, takes: impl Fn(&str) -> bool) -> Value {
    let plain = without_remarks(words);
    if plain.starts_with(|letter: char| letter.is_ascii_uppercase()) {
        let more = plain.matches(',').count();
        return json!({ "type": "string", "pattern": format!("^{NUMBER}(,{NUMBER}){{{more}}}$"),
            "examples": [vec!["0"; more + 1].join(","), vec!["30"; more + 1].join(",")] });
    }
    let mut forms: Vec<Value> = Vec::new();
    let mut alternatives: Vec<Value> = Vec::new();
    for part in plain.split(['|', ',']).map(str::trim).filter(|part| !part.is_empty()) {
        match range(part) {
            Some((above, least, most)) => forms.push(number(above, least, most, &takes)),
            None => {
                let word = part.parse::<u32>().map_or_else(|_| json!(part), |number| json!(number));
                if !alternatives.contains(&word) {
                    alternatives.push(word);
                }
            }
        }
    }
    if alternatives == [json!("true"), json!("false")] {
        return json!({ "type": "boolean" });
    }
    if !alternatives.is_empty() {
        forms.push(json!({ "enum": alternatives }));
    }
    match forms.as_slice() {
        [one] => one.clone(),
        _ => json!({ "anyOf": forms }),
    }
}

fn without_remarks(words: &str) -> String {
    let mut depth = 0;
    let outside = words.chars().filter(|letter| match letter {
        '(' => {
            depth += 1;
            false
        }
        ')' => {
            depth -= 1;
            false
        }
        _ => depth == 0,
    });
    outside.collect::<String>().trim().to_owned()
}

fn range(part: &str) -> Option<(bool, f64, f64)> {
    let (least, most) = part.split_once(" to ")?;
    let (above, least) = least.strip_prefix("above ").map_or((false, least), |least| (true, least));
    Some((above, least.parse().ok()?, most.parse().ok()?))
}

fn number(above: bool, least: f64, most: f64, takes: &impl Fn(&str) -> bool) -> Value {
    if above {
        return json!({ "type": "number", "exclusiveMinimum": least, "maximum": most });
    }
    let middle = (least + 0.5).min(0.5 * (least + most));
    if takes(&middle.to_string()) {
        json!({ "type": "number", "minimum": least, "maximum": most })
    } else {
        json!({ "type": "integer", "minimum": least as i64, "maximum": most as i64 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_become_schemas() {
        let whole = |text: &str| text.parse::<u32>().is_ok();
        let any = |_: &str| true;
        assert_eq!(schema("1 to 4096", whole), json!({ "type": "integer", "minimum": 1, "maximum": 4096 }));
        assert_eq!(
            schema("rgb | 300 to 1000", any),
            json!({ "anyOf": [{ "type": "number", "minimum": 300.0, "maximum": 1000.0 }, { "enum": ["rgb"] }] })
        );
        assert_eq!(schema("above 0 to 1", any), json!({ "type": "number", "exclusiveMinimum": 0.0, "maximum": 1.0 }));
        assert_eq!(schema("true | false", any), json!({ "type": "boolean" }));
        assert_eq!(schema("8 | 16 (PNG), 16 | 32 (EXR), 16 (f16)", any), json!({ "enum": [8, 16, 32] }));
        let place = schema("X,Y,Z (each -1e7 to 1e7; of `sky` Z 0 to 1e5)", any);
        assert_eq!(place["examples"][0], "0,0,0");
    }
}
