//! A scene's sun over a place: it stands where the almanac says, moves with time, and whatever depends on it moves along.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]

mod common;

use common::sky::{Sky, hg_layer};
use serde_json::{Value, json};
use skyloom::scene::{Scene, SceneError};

/// 2003-10-17, 19:30:30 UTC over Golden, Colorado: NREL's published example.
fn golden() -> Value {
    json!({ "latitude_deg": 39.742476, "longitude_deg": -105.1786, "altitude_m": 1830.14, "utc": "2003-10-17T19:30:30Z" })
}

fn scene(sun: Value) -> Value {
    json!({
        "domain": { "extent_m": 20000, "resolution": 8 }, "sun": sun,
        "layers": [hg_layer(json!({ "kind": "uniform", "metres": 100 }), 0.03, 1.0)],
    })
}

#[test]
fn the_sun_stands_where_the_almanac_says() {
    let mut sky = Sky::open();
    let job = sky.job(&scene(golden()), "shadow", &[]);
    let [east, north, up] = job.illumination().towards_sun;
    // Zenith 50.11162 degrees with refraction, which lifts by 0.016 at most there; azimuth 194.340241.
    let (zenith, azimuth) = (up.acos().to_degrees(), east.atan2(north).to_degrees() + 360.0);
    assert!((zenith - 50.128).abs() < 0.002 && (azimuth - 194.340241).abs() < 1e-3, "{zenith}, {azimuth}");
}

#[test]
fn it_moves_with_time_and_textures_follow() {
    let mut sky = Sky::open();
    let [before, after] = ["0", "7200"].map(|time| sky.render(&scene(golden()), "irradiance", &[("time", time)]).data);
    // Two hours past noon in October: the light falls by about a quarter.
    assert!(after[1] < 0.9 * before[1] && after[1] > 0.4 * before[1], "{before:?}, {after:?}");
    // What stays on the device for one time is not taken for another.
    let again = sky.render(&scene(golden()), "irradiance", &[]).data;
    assert_eq!(before, again);
    let later = json!({ "latitude_deg": 39.742476, "longitude_deg": -105.1786, "altitude_m": 1830.14, "utc": "2003-10-17T21:30:30Z" });
    assert_eq!(sky.render(&scene(later), "irradiance", &[]).data, after);
}

#[test]
fn a_year_brings_the_sun_nearer_and_farther() {
    let mut sky = Sky::open();
    let mut nearness = |utc: &str| {
        let sun = json!({ "latitude_deg": 0, "longitude_deg": 0, "utc": utc });
        sky.job(&scene(sun), "shadow", &[]).illumination().nearness
    };
    // Perihelion 0.98333 and aphelion 1.01664 astronomical units (2026, published almanac), squared.
    assert!((nearness("2026-01-03T17:00:00Z") - 1.0342).abs() < 2e-4);
    assert!((nearness("2026-07-06T17:00:00Z") - 0.9675).abs() < 2e-4);
}

#[test]
fn wrong_places_and_times_are_named() {
    let refused = |sun: Value| match Scene::from_json(scene(sun).to_string().as_bytes()) {
        Err(SceneError::Invalid(errors)) => errors.into_iter().map(|error| error.pointer).collect::<Vec<_>>(),
        other => panic!("{other:?}"),
    };
    assert_eq!(
        refused(json!({ "latitude_deg": 91, "longitude_deg": 0, "utc": "2026-06-21T10:00:00Z" })),
        ["/sun/latitude_deg"]
    );
    assert_eq!(refused(json!({ "latitude_deg": 1, "longitude_deg": 0, "utc": "2026-06-31T10:00:00Z" })), ["/sun/utc"]);
    assert_eq!(refused(json!({ "latitude_deg": 1, "longitude_deg": 0, "utc": 5 })), ["/sun/utc"]);
    assert_eq!(refused(json!({ "latitude_deg": 1, "utc": "2026-06-21T10:00:00Z" })), ["/sun/longitude_deg"]);
    assert_eq!(refused(json!({ "latitude_deg": 1, "longitude_deg": 0 })), ["/sun/utc"]);
    assert_eq!(refused(json!({ "zenith_deg": 1, "latitude_deg": 0 })), ["/sun/zenith_deg"]);
}

#[test]
fn air_has_names_and_errors_name_its_fields() {
    let with = |atmosphere: Value| {
        let scene = json!({ "atmosphere": atmosphere });
        Scene::from_json(scene.to_string().as_bytes())
    };
    for name in ["clear", "continental", "maritime", "dust", "haze", "mountain"] {
        let scene = with(json!(name)).unwrap();
        // A name stands for numbers, and the normal form of a normal form is itself.
        assert_eq!(Scene::from_json(scene.to_json().to_string().as_bytes()).unwrap(), scene);
        assert_eq!(scene.to_json()["sun"]["angular_diameter_deg"], json!(0.533));
    }
    for (atmosphere, pointer) in [
        (json!("hase"), "/atmosphere"),
        (json!({ "aerosol": { "optical_depth": 1.1 } }), "/atmosphere/aerosol/optical_depth"),
        (json!({ "aerosol": { "depth": 0.1 } }), "/atmosphere/aerosol/depth"),
        (json!({ "ozone_du": -1 }), "/atmosphere/ozone_du"),
        (json!({ "polarisation": "yes" }), "/atmosphere/polarisation"),
        (json!({ "sun": [1, 1, 1], "ozone_du": 300 }), "/atmosphere/sun"),
        (json!({ "aerosol": { "broadness": 3 } }), "/atmosphere/aerosol/effective_radius_um"),
        (json!({ "aerosol": { "effective_radius_um": 30 } }), "/atmosphere/aerosol/effective_radius_um"),
        (
            json!({ "aerosol": { "effective_radius_um": 1, "refractive_index": [1.4] } }),
            "/atmosphere/aerosol/refractive_index",
        ),
        (
            json!({ "aerosol": { "effective_radius_um": 1, "refractive_index": [1.4, -0.1] } }),
            "/atmosphere/aerosol/refractive_index/1",
        ),
        (
            json!({ "aerosol": { "effective_radius_um": 1, "refractive_index": 2.5 } }),
            "/atmosphere/aerosol/refractive_index",
        ),
        (json!({ "aerosol": { "phase_function": [[0, 1], [3, 2]] } }), "/atmosphere/aerosol/phase_function"),
    ] {
        let Err(SceneError::Invalid(errors)) = with(atmosphere.clone()) else { panic!("{atmosphere} was taken") };
        assert_eq!(errors.iter().map(|error| error.pointer.as_str()).collect::<Vec<_>>(), [pointer], "{errors:?}");
    }
}

/// One of three ways tells how particles scatter; two are refused by both names, and each keeps its numbers.
#[test]
fn aerosol_scatters_in_one_of_three_ways() {
    let with =
        |aerosol: Value| Scene::from_json(json!({ "atmosphere": { "aerosol": aerosol } }).to_string().as_bytes());
    let table = json!([[0, 100], [10, 9], [90, 1], [180, 2]]);
    let two = [
        (json!({ "asymmetry": 0.7, "phase_function": table }), "asymmetry", "phase_function"),
        (json!({ "asymmetry": 0.7, "broadness": 2 }), "asymmetry", "broadness"),
        (json!({ "phase_function": table, "effective_radius_um": 1 }), "phase_function", "effective_radius_um"),
    ];
    for (aerosol, first, second) in two {
        let Err(SceneError::Invalid(errors)) = with(aerosol.clone()) else { panic!("{aerosol} was taken") };
        assert_eq!(errors.len(), 1);
        assert_eq!(errors[0].pointer, format!("/atmosphere/aerosol/{first}"));
        assert!(errors[0].detail.contains(&format!("\"{second}\"")), "{errors:?}");
    }
    let normal = |aerosol: Value| {
        let scene = with(aerosol).unwrap();
        assert_eq!(Scene::from_json(scene.to_json().to_string().as_bytes()).unwrap(), scene);
        scene.to_json()["atmosphere"]["aerosol"].clone()
    };
    let spheres = normal(json!({ "effective_radius_um": 0.4 }));
    assert_eq!(
        spheres,
        json!({ "optical_depth": 0.1, "scale_height_m": 1200.0, "effective_radius_um": 0.4, "broadness": 2.0,
            "refractive_index": [1.45, 0.005] })
    );
    let given = normal(json!({ "effective_radius_um": 0.4, "refractive_index": 1.33, "angstrom": 1, "albedo": 0.9 }));
    assert_eq!(given["refractive_index"], json!([1.33, 0.0]));
    assert_eq!((&given["angstrom"], &given["albedo"]), (&json!(1.0), &json!(0.9)));
    let tabulated = normal(json!({ "phase_function": table, "albedo": 0.8 }));
    assert_eq!(tabulated["angstrom"], json!(1.3));
    assert_eq!(tabulated["phase_function"][1], json!([10.0, 9.0]));
    // Two points far apart leave open where the light goes: the scene's notes say so.
    let notes = with(json!({ "phase_function": [[0, 1000], [40, 1], [180, 1]] })).unwrap().notes();
    assert_eq!(notes[0].pointer, "/atmosphere/aerosol/phase_function");
}
