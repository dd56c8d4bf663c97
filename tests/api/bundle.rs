//! Textures of one moment in one reply, over a real socket, read by another program.

use std::io::Read as _;

use rawzip::{CompressionMethod, ZipArchive};
use serde_json::{Value, json};
use skyloom::image::sha256_hex;

use crate::harness::{Answer, Server, common, scene};

/// Files of an archive by name, as its directory has them; what stands before each of them must tell the same, for those who
/// unpack while it comes.
pub(crate) fn files(bytes: &[u8]) -> Vec<(String, Vec<u8>)> {
    let archive = ZipArchive::from_slice(bytes).unwrap();
    let (mut entries, mut found, mut at) = (archive.entries(), Vec::new(), 0);
    while let Some(entry) = entries.next_entry().unwrap() {
        assert_eq!(entry.compression_method(), CompressionMethod::STORE);
        let name = entry.file_path().try_normalize().unwrap().as_ref().to_owned();
        let own = archive.get_entry(entry.wayfinder()).unwrap();
        let mut file = Vec::new();
        own.verifying_reader(own.data()).read_to_end(&mut file).unwrap();
        let number = |place: usize| u32::from_le_bytes(bytes[at + place..][..4].try_into().unwrap()) as usize;
        assert_eq!((&bytes[at..at + 4], number(18), number(22)), (&b"PK\x03\x04"[..], file.len(), file.len()));
        let begin = at + 30 + name.len();
        assert_eq!((&bytes[at + 30..begin], &bytes[begin..begin + file.len()]), (name.as_bytes(), &file[..]));
        at = begin + file.len();
        found.push((name, file));
    }
    found
}

pub(crate) fn render(server: &Server, document: &Value, headers: &[(&str, &str)]) -> Answer {
    let headers = [&[("content-type", "application/json")], headers].concat();
    server.ask("POST", "/v1/render", &headers, document.to_string().as_bytes())
}

/// Broken cloud that nobody else registers.
pub(crate) fn moving(seed: u32) -> Value {
    let mut moving = scene();
    moving["layers"][0]["thickness"] = json!({ "kind": "stratocumulus", "coverage": 0.6, "seed": seed });
    moving["layers"][0]["wind"] = json!({ "speed_m_s": 8, "turbulence_m_s": 1 });
    moving
}

#[test]
fn a_bundle_has_what_a_registered_sky_gives_and_registers_nothing() {
    let common = common();
    let server = &common.server;
    let textures = [
        ("cloud.exr", "size=16"),
        ("cloud-2.exr", "size=16&view=above&direction=30%2C80"),
        ("shadow.png", "encoding=linear&size=16"),
        ("sky.ktx2", "projection=cube&size=8&mips=true"),
        ("irradiance.f32", ""),
    ];
    let links: Vec<_> = textures.iter().map(|(file, query)| format!("{}?{query}", file.replace("-2", ""))).collect();
    let document = json!({ "scene": moving(4711), "time": 90.5, "textures": links });
    let answer = render(server, &document, &[]);
    assert_eq!(answer.status, 200, "{}", answer.text());
    assert_eq!((answer.header("content-type"), answer.header("cache-control")), ("application/zip", "no-store"));
    assert_eq!(answer.header("content-length"), answer.body.len().to_string());
    let found = files(&answer.body);
    let index: Value = serde_json::from_slice(&found.last().unwrap().1).unwrap();
    assert_eq!((index["time_s"].as_f64(), index["sun"]["zenith_deg"].as_f64().unwrap().round()), (Some(90.5), 50.0));
    let id = index["id"].as_str().unwrap();
    server.get(&format!("/v1/skies/{id}")).problem(404);
    let sky = server.sky(&document["scene"]);
    assert!(sky.ends_with(id));
    assert_eq!(server.get(&sky).json()["scene"], index["scene"]);
    for (number, (file, query)) in textures.iter().enumerate() {
        let same = server.get(&format!("{sky}/{}?time=90.5&{query}", file.replace("-2", "")));
        assert_eq!(same.status, 200, "{}", same.text());
        assert_eq!(found[number].0, *file);
        assert!(found[number].1 == same.body, "{file}");
        let told = &index["textures"][number];
        let shape: Vec<_> = told["shape"].as_array().unwrap().iter().map(Value::to_string).collect();
        assert_eq!((told["file"].as_str(), shape.join(",").as_str()), (Some(*file), same.header("x-skyloom-shape")));
    }
    assert_eq!(found.len(), textures.len() + 1);
    // The same bytes once more.
    assert!(render(server, &document, &[]).body == answer.body);
}

#[test]
fn what_is_wrong_is_named_in_the_document() {
    let common = common();
    let server = &common.server;
    let mut lost = scene();
    lost["layers"][0]["thickness"] = json!({ "kind": "image", "image": "ab".repeat(32), "scale_m": 100 });
    let asks = |scene: &Value, textures: &[&str]| render(server, &json!({ "scene": scene, "textures": textures }), &[]);
    let refused = asks(&lost, &["cloud.exr"]);
    refused.names(422, "/scene/layers/0/thickness/image");
    assert_eq!(refused.problem(422)["type"], "/problems/invalid-render");
    // What only the texels tell, of the second of three.
    let refused = asks(&scene(), &["shadow.f32?size=8", "irradiance.png?size=8&encoding=linear", "cloud.exr?size=8"]);
    refused.names(422, "/textures/1");
    assert!(refused.text().contains("scale: value"), "{}", refused.text());
    asks(&scene(), &["cloud.exr?size=8", "cloud.exr?size=0", "nothing.exr"]).names(422, "/textures/2");
    server.ask("POST", "/v1/render", &[("content-type", "text/plain")], b"{}").problem(415);
    server.ask("POST", "/v1/render", &[("content-type", "application/json")], b"{").problem(400);
    server.ask("GET", "/v1/render", &[], b"").problem(405);
    let foreign = [("origin", "https://evil.example")];
    render(server, &json!({ "scene": scene(), "textures": ["cloud.exr?size=8"] }), &foreign).problem(403);
}

#[test]
fn a_bundle_is_for_readers_within_the_servers_limits() {
    let data = tempfile::tempdir().unwrap();
    let key = |name: &str, rights: &str| {
        format!("{{ name = {name:?}, sha256 = {:?}, rights = [{rights}] }}", sha256_hex(name.as_bytes()))
    };
    let keys = [key("reader", "\"read\""), key("writer", "\"register\"")].join(", ");
    let limits = "[limits]\nbundle_textures = 2\nbundle_texels = 128\n";
    let server = Server::with_settings(data.path(), &format!("[access]\nkeys = [{keys}]\n{limits}"));
    let asks = |key: &str, textures: &[&str]| {
        let headers = [("authorization", key)];
        render(&server, &json!({ "scene": scene(), "textures": textures }), &headers[..usize::from(!key.is_empty())])
    };
    let reader = "Bearer reader";
    let answer = asks(reader, &["shadow.f32?size=8", "thickness.f32?size=8"]);
    assert_eq!((answer.status, files(&answer.body).len()), (200, 3), "{}", answer.text());
    for textures in [&["shadow.f32?size=8"; 3][..], &["shadow.f32?size=8", "cloud.f32?size=9"]] {
        asks(reader, textures).names(422, "/textures");
    }
    asks("", &["shadow.f32?size=8"]).problem(401);
    asks("Bearer writer", &["shadow.f32?size=8"]).problem(403);
}

#[test]
fn parts_of_one_file_have_the_texels_of_the_files() {
    use exr::prelude::{ReadChannels as _, ReadLayers as _, read};
    let common = common();
    let server = &common.server;
    let read = |bytes: &[u8]| {
        let reader = read().no_deep_data().largest_resolution_level().all_channels().all_layers().all_attributes();
        reader.from_buffered(std::io::Cursor::new(bytes)).unwrap()
    };
    // More rows than a block has, and an odd number of them.
    let textures =
        ["cloud.exr?size=37", "irradiance.exr?size=37&depth=32", "shadow.exr?size=37", "cloud.exr?size=37&view=above"];
    let document = json!({ "scene": moving(815), "time": 30, "format": "exr", "textures": textures });
    let answer = render(server, &document, &[]);
    assert_eq!((answer.status, answer.header("content-type")), (200, "image/x-exr"), "{}", answer.text());
    let whole = read(&answer.body);
    let names: Vec<_> =
        whole.layer_data.iter().map(|layer| layer.attributes.layer_name.clone().unwrap().to_string()).collect();
    assert_eq!(names, ["cloud", "irradiance", "shadow", "cloud-2"]);
    let sky = server.sky(&document["scene"]);
    for (part, link) in whole.layer_data.iter().zip(textures) {
        let own = read(&server.get(&format!("{sky}/{link}&time=30")).body);
        assert_eq!(own.layer_data.len(), 1);
        assert_eq!(part.channel_data, own.layer_data[0].channel_data, "{link}");
        assert_eq!(part.attributes.other, own.layer_data[0].attributes.other, "{link}");
    }
}
