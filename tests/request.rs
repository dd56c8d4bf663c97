//! Requests: a query and what it means are each other's inverse, and equal replies have equal queries.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]

use proptest::prelude::*;
use serde_json::json;
use skyloom::request::{QUERY_PARAMETERS, Request, RequestError, TextureKind};
use skyloom::scene::Scene;

fn pairs(query: &[(&str, &str)]) -> Vec<(String, String)> {
    query.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect()
}

fn parse(file: &str, query: &[(&str, &str)]) -> Result<Request, RequestError> {
    let (texture, format) = file.split_once('.').unwrap();
    Request::parse(texture, format, &pairs(query))
}

/// The shortest query of a request, as an address has it.
fn text(request: &Request) -> String {
    let query: Vec<_> = request.to_query().into_iter().map(|(name, value)| format!("{name}={value}")).collect();
    format!("{}?{}", request.file_name(), query.join("&"))
}

fn scene(layers: usize) -> Scene {
    let layer = |i: usize| json!({ "base_m": 500 * (i + 1), "thickness": { "kind": "uniform", "metres": 10 } });
    let scene = json!({ "domain": { "resolution": 64 }, "layers": (0..layers).map(layer).collect::<Vec<_>>() });
    Scene::from_json(scene.to_string().as_bytes()).unwrap()
}

#[test]
fn defaults_are_an_empty_query() {
    for file in [
        "cloud.exr",
        "shadow.png",
        "irradiance.f32",
        "thickness.exr",
        "sky.exr",
        "sky.png",
        "compass.exr",
        "compass.png",
    ] {
        let request = parse(file, &[]).unwrap();
        assert_eq!(text(&request), format!("{file}?"));
        // Spelled out they mean the same; what is no default has words for it.
        for parameter in QUERY_PARAMETERS {
            let spelled = parse(file, &[(parameter.name, parameter.default)]);
            assert!(spelled.is_err() || spelled.unwrap() == request, "{file}, {}", parameter.name);
        }
    }
}

/// A file, and queries of it.
type Group = (&'static str, &'static [&'static [(&'static str, &'static str)]]);

/// Spellings of one reply.
#[test]
fn equal_replies_have_one_query() {
    let same: &[Group] = &[
        ("cloud.f32", &[&[], &[("direction", "0,180")], &[("direction", "-0,-360")], &[("view", "below")]]),
        ("cloud.f32", &[&[("direction", "30,270")], &[("direction", "3e1,-90")], &[("direction", "30.0,-90.0")]]),
        ("cloud.exr", &[&[("direction", "30,0")], &[("direction", "30,360")], &[("direction", "30,-360")]]),
        ("cloud.exr", &[&[("direction", "30,0")], &[("direction", "30,-1e-20")]]),
        ("cloud.exr", &[&[("eye", "0,0,0")], &[("eye", "-0,0,-0")], &[("eye", "0,0,0"), ("component", "direct")]]),
        ("cloud.exr", &[&[], &[("seed", "9")], &[("exposure", "2")], &[("peak", "false")]]),
        // A picture's white goes with its light, and PNG has straight alpha by definition.
        ("cloud.png", &[&[], &[("scale", "7")], &[("alpha", "straight")], &[("depth", "8")]]),
        ("shadow.png", &[&[("encoding", "linear")], &[("encoding", "linear"), ("exposure", "1"), ("tonemap", "none")]]),
        ("shadow.png", &[&[], &[("tonemap", "none")], &[("tonemap", "filmic")], &[("layer", "0")]]),
        ("irradiance.f32", &[&[], &[("peak", "false")], &[("method", "analytic")], &[("alpha", "straight")]]),
        ("irradiance.exr", &[&[("method", "reference")], &[("method", "reference"), ("transport", "tilted")]]),
        ("sky.exr", &[&[], &[("eye", "0,0,2")], &[("projection", "equirect")], &[("look", "9,9")], &[("fov", "50")]]),
        ("sky.f32", &[&[("projection", "cube")], &[("projection", "cube"), ("aspect", "2"), ("view", "above")]]),
        ("sky.f32", &[&[("projection", "fisheye")], &[("projection", "fisheye"), ("fov", "180"), ("look", "1,2")]]),
        (
            "sky.png",
            &[
                &[("projection", "camera")],
                &[("projection", "camera"), ("fov", "60"), ("aspect", "1")],
                &[("projection", "camera"), ("look", "360,0")],
            ],
        ),
        // Pictures are the same in axes whose left edge is the same; only an EXR tells them apart.
        ("sky.f32", &[&[("axes", "unity")], &[("axes", "unreal")]]),
        ("sky.png", &[&[], &[("axes", "enu")], &[("axes", "godot")], &[("axes", "usd")], &[("disc", "false")]]),
        ("sky.f32", &[&[("projection", "camera")], &[("projection", "camera"), ("axes", "three")]]),
        (
            "compass.png",
            &[
                &[("projection", "cube"), ("axes", "godot")],
                &[("projection", "cube"), ("axes", "usd"), ("disc", "true")],
            ],
        ),
        ("compass.f32", &[&[], &[("layer", "1")], &[("tolerance", "0.5")], &[("method", "reference")]]),
        ("cloud.exr", &[&[], &[("axes", "unity")], &[("disc", "true")], &[("ev100", "3")]]),
        // Parts of a whole are not metered.
        ("shadow.png", &[&[], &[("exposure", "auto")], &[("ev100", "12")], &[("exposure", "0")]]),
        ("cloud.png", &[&[("exposure", "auto")], &[("exposure", "auto"), ("axes", "three")]]),
        ("thickness.exr", &[&[], &[("tolerance", "0.5")], &[("method", "reference"), ("seed", "3")]]),
    ];
    for (file, spellings) in same {
        let texts: Vec<_> = spellings.iter().map(|query| text(&parse(file, query).unwrap())).collect();
        assert!(texts.iter().all(|text| *text == texts[0]), "{texts:?}");
    }
}

#[test]
fn different_replies_have_different_queries() {
    let different: &[Group] = &[
        ("cloud.f32", &[&[], &[("view", "above")], &[("eye", "0,0,0")], &[("alpha", "straight")], &[("layer", "0")]]),
        ("cloud.exr", &[&[], &[("depth", "16")], &[("depth", "32")], &[("scale", "2")]]),
        ("cloud.f32", &[&[("method", "reference")], &[("method", "reference"), ("seed", "2")]]),
        ("irradiance.f32", &[&[("component", "direct")], &[("component", "direct"), ("peak", "false")]]),
        ("shadow.f32", &[&[], &[("peak", "false")], &[("time", "1")], &[("size", "3")], &[("tolerance", "0.1")]]),
        ("sky.f32", &[&[], &[("eye", "0,0,3")], &[("projection", "octahedral")], &[("projection", "camera")]]),
        (
            "sky.f32",
            &[
                &[("projection", "camera")],
                &[("projection", "camera"), ("look", "0,1")],
                &[("projection", "camera"), ("fov", "61")],
                &[("projection", "camera"), ("aspect", "2")],
                &[("projection", "fisheye"), ("fov", "61")],
            ],
        ),
        ("sky.exr", &[&[], &[("axes", "godot")], &[("axes", "usd")], &[("axes", "unity")], &[("axes", "unreal")]]),
        ("sky.f32", &[&[], &[("axes", "unity")], &[("axes", "three")], &[("disc", "true")]]),
        (
            "compass.png",
            &[
                &[("projection", "cube")],
                &[("projection", "cube"), ("axes", "unity")],
                &[("projection", "cube"), ("axes", "unreal")],
                &[("projection", "cube"), ("axes", "godot")],
                &[("projection", "cube"), ("axes", "three")],
                &[("eye", "0,0,3")],
            ],
        ),
        ("cloud.png", &[&[], &[("exposure", "auto")], &[("ev100", "0")], &[("ev100", "1")], &[("exposure", "1")]]),
        ("irradiance.png", &[&[], &[("exposure", "1")], &[("tonemap", "none")], &[("encoding", "linear")]]),
    ];
    for (file, queries) in different {
        let texts: Vec<_> = queries.iter().map(|query| text(&parse(file, query).unwrap())).collect();
        for (i, text) in texts.iter().enumerate() {
            assert!(!texts[..i].contains(text), "{texts:?}");
        }
    }
}

/// What a scene gives anyway is left out.
#[test]
fn the_normal_form_knows_the_scene() {
    let of =
        |file: &str, query: &[(&str, &str)], layers| text(&parse(file, query).unwrap().of(&scene(layers)).unwrap());
    assert_eq!(of("cloud.f32", &[("size", "64")], 1), "cloud.f32?");
    assert_eq!(of("cloud.f32", &[("size", "65")], 1), "cloud.f32?size=65");
    assert_eq!(of("cloud.f32", &[("layer", "0")], 1), "cloud.f32?");
    assert_eq!(of("thickness.f32", &[("layer", "0")], 2), "thickness.f32?layer=0");
    for (query, layers, wrong) in [
        (&[("layer", "1")][..], 1, &["layer"][..]),
        (&[("layer", "0")], 0, &["layer"]),
        (&[("layer", "3"), ("method", "reference")], 2, &["layer"]),
    ] {
        let errors = parse("cloud.f32", query).unwrap().of(&scene(layers)).unwrap_err();
        assert_eq!(errors.iter().map(|error| error.pointer.as_str()).collect::<Vec<_>>(), wrong);
    }
}

/// Numbers are written as machines write them; what a locale makes of them is refused by name, never read as another number.
#[test]
fn numbers_are_numbers() {
    for value in ["12.5", "12.50", "1.25e1", "+12.5", "012.5", "125e-1", "1.25E+1"] {
        assert_eq!(parse("cloud.f32", &[("time", value)]).unwrap().time_s, 12.5, "{value}");
    }
    for value in ["12,5", "1 200", "1_200", "1'200", "+12.5x", "", "NaN", "inf", "-0.1", "0x10", "1e10", "\u{0661}"] {
        match parse("cloud.f32", &[("time", value)]) {
            Err(RequestError::Invalid(errors)) => {
                assert_eq!(errors.len(), 1, "{value}");
                assert_eq!(errors[0].pointer, "time", "{value}");
            }
            other => panic!("{value}: {other:?}"),
        }
    }
    for (name, value) in [("direction", "40,5,20,3"), ("direction", "40"), ("eye", "0,0"), ("eye", "0,5,0,5,1200,0")] {
        assert!(parse("cloud.f32", &[(name, value)]).is_err(), "{name}={value}");
    }
}

/// What a sky's parameters cannot be is said by name: at once, or where the scene is known.
#[test]
fn errors_of_a_view_of_the_sky_name_the_field() {
    for (query, wrong) in [
        (&[("projection", "mercator")][..], "projection"),
        (&[("look", "0")], "look"),
        (&[("look", "0,91")], "look"),
        (&[("look", "361,0")], "look"),
        (&[("fov", "0")], "fov"),
        (&[("fov", "361"), ("projection", "fisheye")], "fov"),
        (&[("fov", "171"), ("projection", "camera")], "fov"),
        (&[("aspect", "0.09")], "aspect"),
        (&[("aspect", "NaN")], "aspect"),
        (&[("axes", "Unity")], "axes"),
        (&[("axes", "")], "axes"),
        (&[("disc", "1")], "disc"),
        (&[("exposure", "Auto")], "exposure"),
        (&[("exposure", "21")], "exposure"),
        (&[("ev100", "41")], "ev100"),
        (&[("ev100", "auto")], "ev100"),
        (&[("ev100", "3"), ("exposure", "0")], "ev100"),
        (&[("eye", "0,0")], "eye"),
        (&[("eye", "0,0,-1")], "eye"),
        (&[("eye", "0,0,100001")], "eye"),
        (&[("eye", "0,0,2"), ("direction", "10,10")], "eye"),
        (&[("method", "reference"), ("size", "300")], "size"),
    ] {
        let errors = match parse("sky.exr", query) {
            Err(RequestError::Invalid(errors)) => errors,
            Err(other) => panic!("{query:?}: {other:?}"),
            Ok(request) => request.of(&scene(1)).unwrap_err(),
        };
        let named: Vec<_> = errors.iter().map(|error| error.pointer.as_str()).collect();
        assert_eq!(named, [wrong], "{query:?}");
    }
}

/// A sky is traced whatever is in it, if it is small.
#[test]
fn a_traced_sky_is_small() {
    let scene = |more: &str| Scene::from_json(format!("{{{more}}}").as_bytes()).unwrap();
    let air = r#""atmosphere": "haze""#;
    let refused = |more: &str, size: &str| {
        let request = parse("sky.f32", &[("method", "reference"), ("size", size)]).unwrap();
        match request.of(&scene(more)) {
            Ok(_) => Vec::new(),
            Err(errors) => errors.iter().map(|error| format!("{}: {}", error.pointer, error.detail)).collect(),
        }
    };
    let cloudy = format!(r#"{air}, "layers": [{{"thickness": {{"kind": "uniform", "metres": 100}}}}]"#);
    let mapped = format!(r#"{air}, "ground": {{"albedo": {{"image": "{}"}}}}"#, "0".repeat(64));
    for more in [air, r#""atmosphere": {"sky": 1}"#, &cloudy, &mapped] {
        assert!(refused(more, "64").is_empty(), "{more}");
        let [found] = refused(more, "128").try_into().unwrap();
        assert!(found.starts_with("size: "), "{found}");
        assert!(found.contains("at most 16384 texels, which takes minutes to hours; this is 32768"), "{found}");
    }
}

/// The table in the documents is the one that queries are read by.
#[test]
fn the_documents_have_the_table() {
    let documents = include_str!("../docs/http.md");
    for parameter in QUERY_PARAMETERS {
        let cell = |text: &str| text.replace('|', "\\|");
        let row = format!(
            "| `{}` | {} | {} | {} |",
            parameter.name,
            cell(parameter.values),
            cell(parameter.default),
            parameter.meaning
        );
        assert!(documents.contains(&row), "docs/http.md lacks\n{row}");
    }
}

fn parameter() -> impl Strategy<Value = (String, String)> {
    let number = prop_oneof![Just(0.0), -400.0..400.0f64, 0.0..1.0f64, Just(-0.0), 1e-300..1e-290f64];
    let word = prop_oneof![
        Just("above"),
        Just("direct"),
        Just("diffuse"),
        Just("false"),
        Just("straight"),
        Just("reference"),
        Just("analytic"),
        Just("tabulated"),
        Just("tilted"),
        Just("linear"),
        Just("none"),
        Just("16"),
        Just("32"),
        Just("octahedral"),
        Just("cube"),
        Just("fisheye"),
        Just("camera"),
        Just("auto"),
        Just("true"),
        Just("unity"),
        Just("unity-builtin"),
        Just("unreal"),
        Just("three"),
        Just("usd"),
    ];
    let value = prop_oneof![
        number.clone().prop_map(|number| number.to_string()),
        (0.0..89.9f64, number.clone()).prop_map(|(a, b)| format!("{a},{b}")),
        (-400.0..400.0f64, -90.0..90.0f64).prop_map(|(a, b)| format!("{a},{b}")),
        [number.clone(), number.clone(), number].prop_map(|[a, b, c]| format!("{a},{b},{c}")),
        word.prop_map(str::to_owned),
        (0..5000u32).prop_map(|number| number.to_string()),
    ];
    (0..QUERY_PARAMETERS.len(), value).prop_map(|(i, value)| (QUERY_PARAMETERS[i].name.to_owned(), value))
}

proptest! {
    /// Whatever is accepted can be written as a query, and that query means the same.
    #[test]
    fn a_query_is_the_inverse_of_its_reading(
        kind in 0..TextureKind::ALL.len(),
        format in prop_oneof![Just("exr"), Just("png"), Just("f32")],
        query in proptest::collection::vec(parameter(), 0..24),
    ) {
        // Of each name the first value that is allowed.
        let texture = TextureKind::ALL[kind].name();
        let mut kept: Vec<(String, String)> = Vec::new();
        for pair in query {
            let longer: Vec<_> = kept.iter().cloned().chain([pair]).collect();
            if Request::parse(texture, format, &longer).is_ok() {
                kept = longer;
            }
        }
        let request = Request::parse(texture, format, &kept).unwrap();
        let written: Vec<_> = request.to_query().into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
        prop_assert!(written.len() <= kept.len(), "{written:?} of {kept:?}");
        let again = Request::parse(texture, format, &written);
        prop_assert_eq!(again, Ok(request), "{:?}", written);
    }
}

/// Unknown axes are told with all that there are.
#[test]
fn unknown_axes_are_told_with_those_there_are() {
    let Err(RequestError::Invalid(errors)) = parse("sky.exr", &[("axes", "maya")]) else { panic!("taken") };
    let all = "enu | unity | unity-builtin | unreal | godot | three | blender | usd";
    assert_eq!(errors[0].detail, format!("\"maya\" is not allowed; allowed: {all}"));
}
