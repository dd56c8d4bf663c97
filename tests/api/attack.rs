//! Every call that the description has is made with values made from its schemas, with such that do not fit, and with broken
//! ones. Whatever is sent, the answer is one that the description has, down to the fields of its document.

use serde_json::{Map, Value, json};

use crate::description::description;
use crate::harness::{Answer, Server, eventually, scene};
use crate::schema_tools::{Random, fault, value};

/// Small and quick, so that much can be asked for.
const SETTINGS: &str = "[limits]\nmax_side = 16\nleast_tolerance = 0.02\nfilm_frames = 3\nseries_values = 6\n\
                        bundle_texels = 4096\n[jobs]\ncount = 20\n";

/// Texts that are none of what is wanted.
const HOSTILE: [&str; 16] = [
    "",
    "-1",
    "1e999",
    "NaN",
    "inf",
    "-0",
    "0x10",
    "1,2,3,4,5",
    "\u{0}",
    "ä\u{1f300}\u{202e}",
    "%",
    "../../etc",
    "null",
    "{}",
    "99999999999999999999",
    "1 2",
];

/// How many calls; a longer attack is asked for by the environment.
fn calls() -> usize {
    std::env::var("SKYLOOM_ATTACK_CALLS").ok().and_then(|text| text.parse().ok()).unwrap_or(1500)
}

struct Attack<'a> {
    document: &'a Value,
    random: Random,
    /// Names that lead somewhere.
    known: [String; 3],
}

/// A call that is made.
struct Call {
    method: String,
    address: String,
    headers: Vec<(&'static str, &'static str)>,
    body: Vec<u8>,
}

fn encoded(text: &str) -> String {
    form_urlencoded::byte_serialize(text.as_bytes()).collect::<String>().replace('+', "%20")
}

impl Attack<'_> {
    /// A hostile text, a long one at times.
    fn hostile(&mut self) -> String {
        if self.random.once_in(20) { "9".repeat(3000) } else { (*self.random.pick(&HOSTILE)).to_owned() }
    }

    fn path(&mut self, template: &str, parameters: &[Value]) -> String {
        let mut path = template.to_owned();
        for parameter in parameters.iter().filter(|parameter| parameter["in"] == "path") {
            let name = parameter["name"].as_str().unwrap();
            let known = match name {
                "id" if template.starts_with("/v1/images") => {
                    Some(skyloom::image::sha256_hex(&grey_png(self.random.below(8) as u32 + 1)))
                }
                "id" => Some(self.known[usize::from(template.starts_with("/v1/jobs"))].clone()),
                "slug" => Some("busy".to_owned()),
                "file" => Some("sky.f32".to_owned()),
                "time" => Some(self.known[2].clone()),
                _ => value(self.document, &parameter["schema"], &mut self.random).as_str().map(str::to_owned),
            };
            let given = match self.random.below(12) {
                0 => encoded(&self.hostile()),
                1 => "%FF%00".to_owned(),
                _ => encoded(&known.unwrap()),
            };
            path = path.replace(&format!("{{{name}}}"), &given);
        }
        path
    }

    fn query(&mut self, template: &str, parameters: &[Value]) -> String {
        let mut pairs: Vec<(String, String)> = Vec::new();
        for parameter in parameters.iter().filter(|parameter| parameter["in"] == "query") {
            let needed = parameter["required"] == true;
            if !needed && !self.random.once_in(6) {
                continue;
            }
            let name = parameter["name"].as_str().unwrap();
            let made = value(self.document, &parameter["schema"], &mut self.random);
            let texts: Vec<String> = match made {
                Value::Array(list) => list.iter().filter_map(Value::as_str).map(str::to_owned).collect(),
                Value::String(text) => vec![text],
                other => vec![other.to_string()],
            };
            pairs.extend(texts.into_iter().map(|text| (name.to_owned(), text)));
        }
        let has = |pairs: &[(String, String)], name: &str| pairs.iter().any(|(given, _)| given == name);
        // Pictures are small, and streams end.
        if parameters.iter().any(|parameter| parameter["name"] == "size") {
            pairs.retain(|(name, _)| name != "size");
            pairs.push(("size".to_owned(), (1 + self.random.below(16)).to_string()));
        }
        if template.ends_with("/frames") {
            pairs.retain(|(name, _)| name != "count");
            pairs.push(("count".to_owned(), "1".to_owned()));
        }
        match self.random.below(8) {
            0 if !pairs.is_empty() => {
                let at = self.random.below(pairs.len());
                // What ends a stream stays.
                if pairs[at].0 != "count" {
                    pairs[at].1 = self.hostile();
                }
            }
            1 => {
                let name = self.hostile();
                if !has(&pairs, &name) {
                    pairs.push((name, "1".to_owned()));
                }
            }
            2 if !pairs.is_empty() => pairs.push(pairs[0].clone()),
            _ => {}
        }
        if pairs.is_empty() {
            return String::new();
        }
        form_urlencoded::Serializer::new("?".to_owned()).extend_pairs(pairs).finish()
    }

    fn body(&mut self, content: &Map<String, Value>) -> (Vec<(&'static str, &'static str)>, Vec<u8>) {
        let Some(json) = content.get("application/json") else {
            let mut image = grey_png(self.random.below(8) as u32 + 1);
            self.break_bytes(&mut image);
            return (vec![("content-type", "image/png")], image);
        };
        let mut made = value(self.document, &json["schema"], &mut self.random);
        let fields = made.as_object_mut().unwrap();
        // Scenes of all kinds are registered; what is rendered is cheap.
        if fields.contains_key("textures") {
            fields.insert("scene".to_owned(), scene());
            let is_job = json["schema"]["$ref"].as_str().is_some_and(|name| name.ends_with("job_order"));
            // One way of two, where a schema has both.
            if is_job && !self.random.once_in(4) {
                fields.remove("sky");
                fields.remove(if fields.contains_key("every") { "cron" } else { "every" });
                fields.entry("cron").or_insert(json!("*/5 * * * *"));
                if fields.contains_key("every") {
                    fields.remove("cron");
                }
                for name in ["catch_up", "ahead_s"] {
                    fields.remove(name);
                }
                fields.insert("paused".to_owned(), json!(!self.random.once_in(4)));
                let texture = fields["textures"][0].clone();
                fields.insert("textures".to_owned(), json!([texture]));
                if !self.random.once_in(8) {
                    fields.insert("name".to_owned(), json!(format!("sky-{}", self.random.below(4))));
                }
            }
        }
        if self.random.once_in(4) {
            self.break_value(&mut made);
        }
        let mut bytes = made.to_string().into_bytes();
        self.break_bytes(&mut bytes);
        let headers = match self.random.below(12) {
            0 => vec![("content-type", "text/plain")],
            1 => vec![("content-type", "application/json"), ("content-encoding", "gzip")],
            2 => vec![("content-type", "application/json"), ("content-encoding", "br")],
            _ => vec![("content-type", "application/json")],
        };
        (headers, bytes)
    }

    /// Puts something else in one place.
    fn break_value(&mut self, whole: &mut Value) {
        let inner: Vec<&mut Value> = match whole {
            Value::Object(map) => map.values_mut().collect(),
            Value::Array(list) => list.iter_mut().collect(),
            _ => Vec::new(),
        };
        if inner.is_empty() || self.random.once_in(3) {
            *whole = self.strange();
            return;
        }
        let at = self.random.below(inner.len());
        if let Some(inner) = inner.into_iter().nth(at) {
            self.break_value(inner);
        }
    }

    fn strange(&mut self) -> Value {
        let text = self.hostile();
        let all = [
            json!(null),
            json!(-1),
            json!(1e300),
            json!([]),
            json!({}),
            json!(text),
            json!([[[]]]),
            json!({ text: 1 }),
        ];
        self.random.pick(&all).clone()
    }

    /// Changes bytes, once in a while.
    fn break_bytes(&mut self, bytes: &mut Vec<u8>) {
        match self.random.below(10) {
            0 => bytes.truncate(self.random.below(bytes.len() + 1)),
            1 if !bytes.is_empty() => {
                let at = self.random.below(bytes.len());
                bytes[at] = self.random.next().to_le_bytes()[0];
            }
            _ => {}
        }
    }

    fn call(&mut self, method: &str, template: &str, operation: &Value) -> Call {
        let parameters = operation["parameters"].as_array().cloned().unwrap_or_default();
        let address = format!("{}{}", self.path(template, &parameters), self.query(template, &parameters));
        let (headers, body) = match operation["requestBody"]["content"].as_object() {
            Some(content) => self.body(content),
            None => (Vec::new(), Vec::new()),
        };
        Call { method: method.to_uppercase(), address, headers, body }
    }
}

/// The job that there is to look at; gives the moment of its frame.
fn give_roof(server: &Server) -> String {
    let job = json!({ "name": "roof", "every": "1h", "scene": scene(),
        "textures": [{ "texture": "sky", "format": "f32", "query": { "size": 2 } }] });
    let given = server.ask("POST", "/v1/jobs", &[], job.to_string().as_bytes());
    assert!([200, 201].contains(&given.status), "{}", given.text());
    let latest = || Some(server.get("/v1/jobs/roof/latest.json")).filter(|latest| latest.status == 200);
    eventually("the frame of the job", latest).json()["at"].as_str().unwrap().to_owned()
}

/// A grey picture.
pub(crate) fn grey_png(side: u32) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::GrayImage::from_fn(side, side, |x, y| image::Luma([(x * 31 + y) as u8]))
        .write_to(&mut bytes, image::ImageFormat::Png)
        .unwrap();
    bytes.into_inner()
}

/// What is wrong with an answer, by the description of its call.
fn wrong(document: &Value, operation: &Value, answer: &Answer) -> Option<String> {
    let Some(told) = operation["responses"].get(answer.status.to_string()) else {
        return Some(format!("the status {} is not described", answer.status));
    };
    let media_type = answer.header("content-type").split(';').next().unwrap().to_owned();
    let content = told["content"].as_object().cloned().unwrap_or_default();
    if content.is_empty() {
        return (!answer.body.is_empty()).then(|| "a body is not described".to_owned());
    }
    let Some(described) = content.get(&media_type) else { return Some(format!("{media_type:?} is not described")) };
    if answer.status >= 400 && answer.json()["status"] != answer.status {
        return Some("the problem has another status".to_owned());
    }
    let schema = described.get("schema")?;
    fault(document, schema, &answer.json())
}

#[test]
fn whatever_is_sent_the_answer_is_one_that_is_described() {
    let document = description();
    let data = tempfile::tempdir().unwrap();
    let server = Server::with_settings(data.path(), SETTINGS);
    server.is_ready();
    let path = server.sky(&scene());
    let sky = path.rsplit('/').next().unwrap().to_owned();
    let frame = give_roof(&server);
    let seed = std::env::var("SKYLOOM_ATTACK_SEED").ok().and_then(|text| text.parse().ok()).unwrap_or(20_060_101);
    let mut attack = Attack { document: &document, random: Random(seed), known: [sky, "roof".to_owned(), frame] };
    let operations: Vec<(&String, &String, &Value)> = document["paths"]
        .as_object()
        .unwrap()
        .iter()
        .flat_map(|(path, methods)| methods.as_object().unwrap().iter().map(move |(method, own)| (path, method, own)))
        .collect();
    let mut seen: std::collections::BTreeMap<(String, u16), usize> = std::collections::BTreeMap::new();
    for number in 0..calls() {
        let (path, method, operation) = operations[number % operations.len()];
        // The sky stays, so that there is something to look at.
        if operation["operationId"] == "removeSky" && !attack.random.once_in(8) {
            continue;
        }
        let call = attack.call(method, path, operation);
        let answer = server.ask(&call.method, &call.address, &call.headers, &call.body);
        *seen.entry((operation["operationId"].to_string(), answer.status)).or_default() += 1;
        if let Some(wrong) = wrong(&document, operation, &answer) {
            let body = String::from_utf8_lossy(&call.body).chars().take(3000).collect::<String>();
            panic!("{} {} {body}\n{wrong}\n{} {}", call.method, call.address, answer.status, answer.text());
        }
        if operation["operationId"] == "removeSky" {
            server.sky(&scene());
        }
        if operation["operationId"] == "removeJob" && answer.status == 204 {
            attack.known[2] = give_roof(&server);
        }
    }
    // Each call was answered as it is meant to be, and refused.
    for (_, _, operation) in &operations {
        let id = operation["operationId"].to_string();
        let statuses: Vec<u16> = seen.keys().filter(|(seen, _)| *seen == id).map(|(_, status)| *status).collect();
        assert!(statuses.iter().any(|status| *status < 400), "{id}: {statuses:?}");
    }
    eprintln!("{seen:#?}");
    server.goes_on();
}
