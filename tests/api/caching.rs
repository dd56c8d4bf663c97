//! What caches may keep: for ever what an address with the present version means, and with questions what any other does.

use serde_json::{Value, json};

use crate::harness::{Common, common, scene};

const FOR_EVER: &str = "public, max-age=31536000, immutable";

fn sky(common: &Common, zenith_deg: u32) -> String {
    let mut own = scene();
    own["sun"]["zenith_deg"] = zenith_deg.into();
    common.server.sky(&own)
}

#[test]
fn only_the_present_version_is_for_ever_and_all_get_the_present_texture() {
    let common = common();
    let sky = sky(&common, 31);
    let version = common.server.version();
    let get = |query: &str| common.server.get(&format!("{sky}/shadow.f32?size=8{query}"));
    let bare = get("");
    assert_eq!((bare.status, bare.header("cache-control")), (200, "no-cache"), "{}", bare.text());
    let raw = version.replace("%2B", "+");
    let encoded = format!("&time=0&v={}", version.replace('.', "%2E"));
    for (query, caching) in [
        (format!("&v={version}"), FOR_EVER),
        (encoded, FOR_EVER),
        // A plus sign as it stands: no other version is spelled so.
        (format!("&v={raw}"), FOR_EVER),
        ("&v=0.0.1%2B0123456789ab".to_owned(), "no-cache"),
        (format!("&v={version}0"), "no-cache"),
        (format!("&v={}", &version[..version.len() - 1]), "no-cache"),
        (
            format!("&v={}", version.to_uppercase()),
            if version.to_uppercase() == version { FOR_EVER } else { "no-cache" },
        ),
    ] {
        let answer = get(&query);
        assert_eq!((answer.status, answer.header("cache-control")), (200, caching), "{query}");
        assert_eq!((answer.header("etag"), &answer.body), (bare.header("etag"), &bare.body), "{query}");
        let path = format!("{sky}/shadow.f32?size=8{query}");
        let known = common.server.ask("GET", &path, &[("if-none-match", bare.header("etag"))], b"");
        assert_eq!((known.status, known.body.len()), (304, 0), "{query}");
        assert_eq!((known.header("cache-control"), known.header("etag")), (caching, bare.header("etag")), "{query}");
        assert_eq!(common.server.ask("HEAD", &path, &[], b"").header("cache-control"), caching, "{query}");
    }
}

#[test]
fn a_version_that_is_none_is_refused_together_with_what_else_is_wrong() {
    let common = common();
    let sky = sky(&common, 32);
    let version = common.server.version();
    for path in ["cloud.exr", "plan", "frames"] {
        for query in [
            format!("v={version}&v={version}"),
            "v=1&size=8&v=2".to_owned(),
            "v=".to_owned(),
            // Appended to a link with ? instead of &.
            format!("v={version}?time=5"),
            format!("v={version}/cloud"),
            format!("v={}", "1".repeat(65)),
        ] {
            let answer = common.server.get(&format!("{sky}/{path}?{query}"));
            answer.names(422, "v");
            assert_eq!(answer.header("cache-control"), "no-store");
        }
        let answer = common.server.get(&format!("{sky}/{path}?v=1&v=2&size=0&tiem=3"));
        for parameter in ["v", "size", "tiem"] {
            answer.names(422, parameter);
        }
    }
    let unknown = common.server.get(&format!("{sky}/clout.exr?v=1&v=2"));
    assert_eq!(unknown.problem(404)["type"], "/problems/unknown-texture");
}

#[test]
fn every_link_to_a_texture_carries_the_version() {
    let common = common();
    let mut own = scene();
    own["sun"]["zenith_deg"] = 33.into();
    let posted = common.server.post_scene(own.to_string().as_bytes()).json();
    let shown = common.server.get(posted["links"]["self"].as_str().unwrap()).json();
    assert_eq!(posted["links"], shown["links"]);
    assert_eq!(posted["version"].as_str().unwrap().replace('+', "%2B"), common.server.version());
    for texture in ["cloud", "shadow", "irradiance", "thickness"] {
        let link = posted["links"][texture].as_str().unwrap();
        let answer = common.server.get(&format!("{link}&size=8"));
        assert_eq!((answer.status, answer.header("cache-control")), (200, FOR_EVER), "{link}: {}", answer.text());
    }
    let frames = posted["links"]["frames"].as_str().unwrap();
    let query = format!("every=3600&textures=cloud.png,irradiance.f32&size=8&v={}", common.server.version());
    let event = common.server.listen(&format!("{frames}?{query}")).next().unwrap();
    let links = event["textures"].as_object().unwrap();
    assert_eq!(links.len(), 2);
    for link in links.values().map(|link| link.as_str().unwrap()) {
        assert_eq!(link.matches("v=").count(), 1, "{link}");
        let answer = common.server.get(link);
        assert_eq!((answer.status, answer.header("cache-control")), (200, FOR_EVER), "{link}: {}", answer.text());
    }
}

#[test]
fn a_plan_is_asked_for_like_its_texture() {
    let common = common();
    let sky = sky(&common, 34);
    let plan = |query: &str| -> Value {
        let answer = common.server.get(&format!("{sky}/plan?{query}"));
        assert_eq!((answer.status, answer.header("cache-control")), (200, "no-cache"), "{}", answer.text());
        answer.json()
    };
    let bare = plan("texture=shadow&tolerance=0.1");
    assert_eq!(plan(&format!("v={}&texture=shadow&tolerance=0.1", common.server.version())), bare);
    assert_eq!(plan("tolerance=0.1&v=old&texture=shadow"), bare);
    assert_eq!(bare["tolerance"], json!(0.1));
}
