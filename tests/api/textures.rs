//! Textures over HTTP: bytes, headers, caching.

use serde_json::{Value, json};

use crate::harness::{Server, common, eventually, scene};
use crate::images::ramp;

#[test]
fn a_texture_tells_its_shape_type_and_what_it_cost() {
    let common = common();
    let sky = common.server.sky(&scene());
    for (texture, channels) in [("cloud", 4), ("irradiance", 3), ("shadow", 1), ("thickness", 1)] {
        let answer = common.server.get(&format!("{sky}/{texture}.f32?size=16&time=3"));
        assert_eq!(answer.status, 200, "{}", answer.text());
        assert_eq!(answer.header("x-skyloom-shape"), format!("16,16,{channels}"));
        assert_eq!(answer.body.len(), 16 * 16 * channels * 4);
        assert!(answer.body.chunks_exact(4).all(|bytes| f32::from_le_bytes(bytes.try_into().unwrap()).is_finite()));
        assert!(answer.header("server-timing").contains(";dur="));
        assert_eq!(answer.header("content-type"), "application/octet-stream");
    }
    let png = common.server.get(&format!("{sky}/cloud.png?size=16"));
    assert_eq!(png.header("content-type"), "image/png");
    assert_eq!(image::load_from_memory(&png.body).unwrap().width(), 16);
    let exr = common.server.get(&format!("{sky}/cloud.exr?size=16"));
    assert!(exr.body.starts_with(&[0x76, 0x2f, 0x31, 0x01]));
}

#[test]
fn masks_and_scales_that_would_cut_values_off_are_refused_by_name() {
    let common = common();
    let sky = common.server.sky(&scene());
    let small = "size=8&encoding=linear";
    for texture in ["irradiance", "thickness", "cloud"] {
        let answer = common.server.get(&format!("{sky}/{texture}.png?{small}"));
        answer.names(422, "scale");
        let problem = answer.json();
        let detail = problem["errors"][0]["detail"].as_str().unwrap();
        let (_, scale) = detail.rsplit_once("or scale ").unwrap_or_else(|| panic!("{detail}"));
        // The scale that it proposes is one that fits.
        let answer = common.server.get(&format!("{sky}/{texture}.png?{small}&scale={scale}"));
        assert_eq!(answer.status, 200, "{}", answer.text());
    }
    assert_eq!(common.server.get(&format!("{sky}/shadow.png?{small}")).status, 200);
    common.server.get(&format!("{sky}/shadow.png?{small}&scale=1000")).names(422, "scale");
    common.server.goes_on();
}

#[test]
fn a_file_tells_what_it_shows_and_only_what_repeats_is_called_periodic() {
    let common = common();
    let sky = common.server.sky(&scene());
    let told = |query: &str| {
        let answer = common.server.get(&format!("{sky}/{query}&size=8"));
        let headers = exr::meta::MetaData::read_from_buffered(answer.body.as_slice(), false).unwrap().headers;
        headers[0].own_attributes.clone()
    };
    let own = |name: &str| exr::meta::attribute::Text::from(format!("skyloom:{name}").as_str());
    let names = |query: &str, wrap: &str, shown: &[&str]| {
        let told = told(query);
        assert_eq!(told.wrap_mode_name.unwrap().to_string(), wrap, "{query}");
        assert_eq!(told.white_luminance, None, "the scene's light has no known unit");
        for name in ["component", "direction", "eye", "layer", "peak", "view"] {
            let found = told.other.contains_key(&own(name));
            assert_eq!(found, shown.contains(&name), "{query}: {name}");
        }
        for name in ["projection", "expectedError", "unit", "scale", "version", "depth"] {
            assert!(told.other.contains_key(&own(name)), "{query}: {name}");
        }
        told.other
    };
    names("cloud.exr?eye=0,0,2", "clamp", &["eye", "view"]);
    names("shadow.exr?peak=false", "periodic", &["peak"]);
    names("irradiance.exr?component=direct", "periodic", &["component", "peak"]);
    // The one layer that there is: all of them.
    names("thickness.exr?layer=0", "periodic", &[]);
    let view = names("cloud.exr?view=above&direction=40,-30", "periodic", &["direction", "view"]);
    let direction = &view[&own("direction")];
    let exr::meta::attribute::AttributeValue::FloatVec2(found) = direction else { panic!("{direction:?}") };
    assert!((found.0 - 40.0).abs() < 1e-4 && (found.1 - 330.0).abs() < 1e-4, "{found:?}");
}

#[test]
fn the_size_of_a_texture_is_the_scenes_resolution_by_default() {
    let common = common();
    let sky = common.server.sky(&scene());
    assert_eq!(common.server.get(&format!("{sky}/shadow.f32")).header("x-skyloom-shape"), "64,64,1");
}

#[test]
fn a_known_tag_is_answered_304_without_a_body() {
    let common = common();
    let sky = common.server.sky(&scene());
    let path = format!("{sky}/shadow.f32?size=16");
    let tag = common.server.get(&path).header("etag").to_owned();
    assert!(tag.starts_with('"') && tag.ends_with('"') && tag.len() > 10, "{tag}");
    for list in [tag.clone(), format!("W/{tag}"), format!("\"other\", {tag}"), "*".to_owned()] {
        let answer = common.server.ask("GET", &path, &[("if-none-match", &list)], b"");
        assert_eq!((answer.status, answer.body.len()), (304, 0), "If-None-Match: {list}");
        assert_eq!(answer.header("etag"), tag);
    }
    assert_eq!(common.server.ask("GET", &path, &[("if-none-match", "\"other\"")], b"").status, 200);
}

#[test]
fn the_tag_is_the_same_for_equal_requests_and_differs_otherwise() {
    let common = common();
    let sky = common.server.sky(&scene());
    let tag = |query: &str| common.server.get(&format!("{sky}/{query}")).header("etag").to_owned();
    let one = tag("shadow.f32?size=16&time=1");
    assert_eq!(one, tag("shadow.f32?time=1.0&size=16"));
    for other in ["shadow.f32?size=16&time=2", "shadow.f32?size=17&time=1", "shadow.exr?size=16&time=1"] {
        assert_ne!(one, tag(other), "{other}");
    }
}

#[test]
fn head_gives_the_headers_of_get() {
    let common = common();
    // A size that no other test asks for.
    let path = format!("{}/shadow.f32?size=19", common.server.sky(&scene()));
    let before = common.server.ask("HEAD", &path, &[], b"");
    let get = common.server.get(&path);
    let head = common.server.ask("HEAD", &path, &[], b"");
    assert_eq!((head.status, head.body.len(), before.status, before.body.len()), (200, 0, 200, 0));
    // What is known without rendering is told before it.
    for name in ["etag", "content-type", "cache-control", "skyloom-expected-error", "skyloom-tolerance-met"] {
        assert_eq!(head.header(name), get.header(name), "{name}");
        assert_eq!(before.header(name), get.header(name), "{name}");
    }
    for name in ["content-length", "x-skyloom-shape"] {
        assert_eq!(head.header(name), get.header(name), "{name}");
    }
    assert_eq!(before.header("content-length"), "", "no length, as it is not known");
    let tag = head.header("etag").to_owned();
    assert_eq!(common.server.ask("HEAD", &path, &[("if-none-match", &tag)], b"").status, 304);
    assert_eq!(common.server.ask("HEAD", &format!("{path}&size=3"), &[], b"").status, 422);
}

#[test]
fn every_texture_tells_the_error_expected_of_it() {
    let common = common();
    let mut broken = scene();
    broken["layers"][0]["thickness"] = json!({ "kind": "stratocumulus", "coverage": 0.6, "seed": 3 });
    let skies = [common.server.sky(&scene()), common.server.sky(&broken)];
    for (sky, texture, query, met) in [
        (&skies[0], "thickness", "size=8", "true"),
        (&skies[0], "shadow", "size=8", "true"),
        (&skies[0], "cloud", "size=8&tolerance=0.05", "true"),
        (&skies[0], "cloud", "size=8&tolerance=0.001", "false"),
        (&skies[1], "irradiance", "size=8", "false"),
        (&skies[1], "irradiance", "size=8&tolerance=0.5", "true"),
        (&skies[1], "shadow", "size=8", "true"),
    ] {
        let plan = common.server.get(&format!("{sky}/plan?texture={texture}&{query}")).json();
        let expected = plan["expected_error"].as_f64().unwrap();
        assert_eq!(plan["meets_tolerance"].to_string(), met, "{plan}");
        // Rendered, then from memory.
        for _ in 0..2 {
            let answer = common.server.get(&format!("{sky}/{texture}.f32?{query}"));
            let told: f64 = answer.header("skyloom-expected-error").parse().unwrap();
            assert!((told - expected).abs() <= 0.005 * expected, "{texture} {query}: {told}, not {expected}");
            assert_eq!(answer.header("skyloom-tolerance-met"), met, "{texture} {query}");
        }
    }
}

/// What a render takes of memory is told before, and refused beyond the limit, with the size that fits.
#[test]
fn renders_that_take_too_much_memory_are_refused_before_they_begin() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::with_settings(data.path(), "[limits]\nrender_memory_bytes = 209715200\n");
    assert_eq!(server.get("/v1/limits").json()["limits"]["render_memory_bytes"], 200 << 20);
    let sky = server.sky(&scene());
    let plan = |query: &str| server.get(&format!("{sky}/plan?texture=cloud&{query}"));
    let bytes = |size: u32| plan(&format!("size={size}")).json()["memory_bytes"].as_u64().unwrap();
    assert!((10_000_000..bytes(1024)).contains(&bytes(64)));
    let refused = |problem: &Value, pointer: &str| {
        assert_eq!((&problem["errors"][0]["pointer"], &problem["errors"][1]), (&json!(pointer), &Value::Null));
        let detail = problem["errors"][0]["detail"].as_str().unwrap().to_owned();
        assert!(detail.contains("(limits.render_memory_bytes)"), "{detail}");
        detail
    };
    let detail = refused(&server.get(&format!("{sky}/cloud.f32?size=4096")).problem(422), "size");
    let most: u32 = detail.rsplit("allowed: 1 to ").next().unwrap().parse().unwrap();
    // The plan's own texture is an EXR of as many bytes at most.
    assert!((1000..4096).contains(&most) && bytes(most) <= 200 << 20, "{detail}");
    refused(&plan(&format!("size={}", most + 1)).problem(422), "size");
    assert_eq!(server.get(&format!("{sky}/cloud.f32?size=64")).status, 200);
    // The scene's own field, whatever the size, and an image that is not read before.
    let mut fine = scene();
    fine["domain"]["resolution"] = json!(4096);
    fine["layers"][0]["thickness"] = json!({ "kind": "stratocumulus" });
    let fine = server.sky(&fine);
    let detail = refused(&server.get(&format!("{fine}/thickness.f32?size=8")).problem(422), "/domain/resolution");
    assert!(detail.contains("fields"), "{detail}");
    let image = server.post_image("image/png", &ramp(3000)).json()["sha256"].clone();
    let mut mapped = scene();
    mapped["layers"][0]["thickness"] = json!({ "kind": "image", "image": image, "scale_m": 300 });
    mapped["layers"][0]["wind"] = json!({ "turbulence_m_s": 1 });
    let mapped = server.sky(&mapped);
    refused(&server.get(&format!("{mapped}/thickness.f32?size=8")).problem(422), "/domain/resolution");
    let series = server.get(&format!("{mapped}/point.json?at=0,0&from=0&to=0"));
    refused(&series.problem(422), "/domain/resolution");
}

#[test]
fn a_second_request_is_answered_from_memory_with_the_same_bytes() {
    let common = common();
    let path = format!("{}/irradiance.exr?size=33", common.server.sky(&scene()));
    let first = common.server.get(&path);
    let second = common.server.get(&path);
    assert!(second.header("server-timing").starts_with("cache;desc=hit"));
    assert_eq!(first.body, second.body);
}

#[test]
fn the_first_request_for_new_droplets_waits_for_their_tables_beyond_the_deadline_of_renders() {
    let data = tempfile::tempdir().unwrap();
    let settings = data.path().join("skyloom.toml");
    std::fs::write(&settings, "[queue]\ntimeout_s = 1\n").unwrap();
    let server = Server::start(&data.path().join("data"), &["--config", settings.to_str().unwrap()], &[]);
    // Start-up is not what is tested: on a busy machine it alone can take longer than the deadline.
    eventually("readiness", || (server.get("/health/ready").status == 200).then_some(()));
    let mut mie = scene();
    mie["layers"][0]["droplets"] = json!({ "effective_radius_um": 6.5, "broadness": 2, "number_per_cm3": 300 });
    let sky = server.sky(&mie);
    let state = || server.get(&sky).json()["tables"]["state"].as_str().unwrap().to_owned();
    assert_eq!(state(), "new");
    std::thread::scope(|scope| {
        let answer = scope.spawn(|| server.get(&format!("{sky}/irradiance.f32?size=8")));
        eventually("the tables", || (state() == "ready").then_some(()));
        assert_eq!(server.get("/health/live").status, 200);
        let answer = answer.join().unwrap();
        assert_eq!(answer.status, 200, "{}", answer.text());
    });
    assert_eq!(server.get(&sky).json()["tables"], json!({ "state": "ready", "progress": 1.0 }));
}

#[test]
fn readiness_names_the_adapter() {
    let common = common();
    let ready =
        eventually("readiness", || Some(common.server.get("/health/ready")).filter(|answer| answer.status == 200));
    assert!(!ready.json()["adapter"]["name"].as_str().unwrap().is_empty());
}

#[test]
fn the_plan_tells_what_a_tolerance_costs() {
    let common = common();
    let sky = common.server.sky(&scene());
    let plan = |query: &str| common.server.get(&format!("{sky}/plan?{query}")).json();
    let shade = |plan: &Value| {
        let stages = plan["stages"].as_array().unwrap().clone();
        stages.into_iter().find(|stage| stage["stage"] == "shade").unwrap()["choice"].as_str().unwrap().to_owned()
    };
    assert!(shade(&plan("tolerance=0.3")).contains("coarse"));
    assert!(shade(&plan("")).contains("tabulated, fine"));
    assert!(shade(&plan("method=analytic")).contains("analytic"));
    assert!(plan("texture=irradiance&tolerance=0.01")["expected_error"].as_f64().unwrap() >= 0.0);
    let text = common.server.get(&format!("{sky}/plan?tolerance=0.001")).text();
    let place = |field: &str| text.find(&format!("\"{field}\"")).unwrap();
    assert!(place("meets_tolerance") < place("expected_error") && place("expected_error") < place("stages"), "{text}");
    assert_eq!(plan("tolerance=0.001")["meets_tolerance"], false);
    assert_eq!(plan("tolerance=0.05")["meets_tolerance"], true);
    common.server.get(&format!("{sky}/plan?texture=fog")).problem(422);
    common.server.get(&format!("{sky}/plan?tolerance=2")).problem(422);
}

#[test]
fn monte_carlo_is_left_to_the_command_line() {
    let common = common();
    let sky = common.server.sky(&scene());
    let problem = common.server.get(&format!("{sky}/cloud.exr?method=reference")).problem(422);
    assert_eq!(problem["errors"][0]["pointer"], "method");
}

/// A scene in lux: what half floats hold is half, what they cannot hold is float and says why, and half on demand is refused.
#[test]
fn values_beyond_half_floats_are_written_as_floats() {
    let common = common();
    let mut bright = scene();
    bright["atmosphere"] = json!({ "sun": [127_000, 121_000, 113_000], "sky": [3000, 4000, 6000] });
    bright["layers"] = json!([]);
    let (usual, bright) = (common.server.sky(&scene()), common.server.sky(&bright));
    let depth = |path: String| common.server.get(&path).header("skyloom-depth").to_owned();
    assert_eq!(depth(format!("{usual}/irradiance.exr?size=9")), "16");
    assert_eq!(depth(format!("{usual}/irradiance.exr?size=9&depth=32")), "32");
    assert_eq!(depth(format!("{usual}/irradiance.png?size=9")), "8");
    let told = depth(format!("{bright}/irradiance.exr?size=9"));
    assert!(told.starts_with("32;reason=\"") && told.contains("65504"), "{told}");
    common.server.get(&format!("{bright}/irradiance.exr?size=9&depth=16")).names(422, "depth");
    assert_eq!(depth(format!("{bright}/irradiance.exr?size=9&depth=16&scale=0.001")), "16");
}

/// A compass needs nothing of the clouds: not even droplets that no table was ever made of.
#[test]
fn a_compass_is_drawn_without_tables() {
    let common = common();
    let mut scene = scene();
    scene["layers"][0]["droplets"] = json!({ "effective_radius_um": 11.37, "number_per_cm3": 41 });
    let sky = common.server.sky(&scene);
    let answer = common.server.get(&format!("{sky}/compass.png?size=32&axes=three"));
    assert_eq!(answer.status, 200, "{}", answer.text());
    let picture = image::load_from_memory(&answer.body).unwrap();
    assert_eq!((picture.width(), picture.height()), (64, 32));
    // Only the drawing took time.
    let timing = answer.header("server-timing");
    assert!(timing.contains("draw;dur=") && !timing.contains("field"), "{timing}");
    assert_ne!(common.server.get(&sky).json()["tables"]["state"], "ready");
    let plan = common.server.get(&format!("{sky}/plan?texture=compass")).json();
    assert_eq!((&plan["expected_error"], &plan["stages"][0]["stage"]), (&json!(0.0), &json!("draw")));
    common.server.get(&format!("{sky}/compass.png?axes=maya")).names(422, "axes");
    common.server.get(&format!("{sky}/sky.png?exposure=0&ev100=3")).names(422, "ev100");
    // One picture has one tag.
    let tag = |query: &str| common.server.get(&format!("{sky}/compass.png?size=32&{query}")).header("etag").to_owned();
    assert_eq!(tag("axes=unity"), tag("axes=unreal"));
    assert_ne!(tag("axes=unity"), tag("axes=godot"));
}
