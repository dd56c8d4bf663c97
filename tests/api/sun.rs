//! Skies of physical air and the sun over a place, over a socket.

use crate::harness::common;
use serde_json::{Value, json};

fn day() -> Value {
    json!({
        "domain": { "extent_m": 20000, "resolution": 8 },
        "sun": { "latitude_deg": 39.742476, "longitude_deg": -105.1786, "altitude_m": 1830.14, "utc": "2003-10-17T12:30:30-07:00" },
        "atmosphere": { "aerosol": { "optical_depth": 0.05 } },
    })
}

#[test]
fn the_sun_of_a_place_is_told_with_its_light_and_its_day() {
    let common = common();
    let sky = common.server.sky(&day());
    let sun = common.server.get(&format!("{sky}/sun.json")).json();
    // NREL's published example for SPA.
    assert!((sun["azimuth_deg"].as_f64().unwrap() - 194.340_241).abs() < 1e-3, "{sun}");
    assert!((sun["apparent_zenith_deg"].as_f64().unwrap() - 50.111_62).abs() < 2e-3, "{sun}");
    assert_eq!(sun["utc"], "2003-10-17T19:30:30Z");
    assert!(sun["day"]["sunrise"].as_str().unwrap().starts_with("2003-10-17T13:1"), "{sun}");
    // A clear noon in October: the sun shines with 80 to 120 klx on a plane that faces it, the sky with 5 to 20 on the ground.
    assert_eq!(sun["irradiance"]["unit"], "klx");
    let channel = |name: &str| sun["irradiance"][name][1].as_f64().unwrap();
    assert!((80.0..120.0).contains(&channel("facing_the_sun")), "{sun}");
    assert!((5.0..20.0).contains(&channel("sky")), "{sun}");
    // Twelve hours later it is night.
    let night = common.server.get(&format!("{sky}/sun.json?time=43200")).json();
    assert!(night["zenith_deg"].as_f64().unwrap() > 100.0, "{night}");
    assert_eq!(night["irradiance"]["facing_the_sun"], json!([0.0, 0.0, 0.0]));
}

#[test]
fn a_fixed_sun_has_no_day_and_wrong_parameters_are_named() {
    let common = common();
    let sky = common.server.sky(&json!({ "sun": { "zenith_deg": 30, "azimuth_deg": 90 } }));
    let sun = common.server.get(&format!("{sky}/sun.json")).json();
    assert!(
        (sun["zenith_deg"].as_f64().unwrap() - 30.0).abs() < 1e-9
            && (sun["azimuth_deg"].as_f64().unwrap() - 90.0).abs() < 1e-9
    );
    assert!(sun.get("day").is_none() && sun.get("utc").is_none(), "{sun}");
    // East, in the frame of each engine; its other numbers know no frame.
    for (axes, east) in [("unreal", "x east, y south, z up"), ("unity", "x east, y up, z north")] {
        let engine = common.server.get(&format!("{sky}/sun.json?axes={axes}")).json();
        assert_eq!(engine["axes"], format!("{axes}: {east}"));
        let up = usize::from(axes == "unreal") + 1;
        let direction = |i: usize| engine["direction"][i].as_f64().unwrap();
        assert!((direction(0) - 0.5).abs() < 1e-9 && (direction(up) - 0.75_f64.sqrt()).abs() < 1e-9, "{engine}");
        assert_eq!((&engine["zenith_deg"], &engine["irradiance"]), (&sun["zenith_deg"], &sun["irradiance"]));
    }
    for (query, pointer) in
        [("size=8", "size"), ("time=-1", "time"), ("axes=maya", "axes"), ("axes=usd&axes=usd", "axes")]
    {
        let answer = common.server.get(&format!("{sky}/sun.json?{query}"));
        assert_eq!(answer.status, 422, "{query}");
        assert_eq!(answer.json()["errors"][0]["pointer"], pointer, "{query}");
    }
}

#[test]
fn a_panorama_of_air_is_served_and_says_what_it_is() {
    let common = common();
    let sky = common.server.sky(&day());
    let shape = |query: &str| {
        let answer = common.server.get(&format!("{sky}/sky.f32?size=8&{query}"));
        assert_eq!(answer.status, 200, "{query}");
        answer.header("x-skyloom-shape").to_owned()
    };
    assert_eq!(shape(""), "8,16,3");
    assert_eq!(shape("projection=cube"), "48,8,3");
    assert_eq!(shape("projection=camera&aspect=1.5&look=180,20&fov=90"), "8,12,3");
    // It is brightest around the sun, which stands 40 degrees high in the south-south-west, or at the horizon below it.
    let data = common.server.get(&format!("{sky}/sky.f32?size=8&exposure=1")).body;
    let values: Vec<f32> = data.chunks(4).map(|bytes| f32::from_le_bytes(bytes.try_into().unwrap())).collect();
    let brightest = (0..8 * 16).max_by(|a, b| values[3 * a + 1].total_cmp(&values[3 * b + 1])).unwrap();
    assert!(matches!((brightest / 16, brightest % 16), (2 | 3, 8)), "texel {brightest}");
    // An eye in the ground is refused by name.
    let answer = common.server.get(&format!("{sky}/sky.f32?size=8&eye=0,0,-1"));
    assert_eq!((answer.status, answer.json()["errors"][0]["pointer"].clone()), (422, json!("eye")));
    let answer = common.server.get(&format!("{sky}/sky.f32?size=8&projection=camera&fov=175"));
    assert_eq!((answer.status, answer.json()["errors"][0]["pointer"].clone()), (422, json!("fov")));
}

/// Nine numbers say what the panorama shines on the ground: the diffuse irradiance, to the few per cent that nine functions hold.
#[test]
fn the_ambient_light_is_that_of_the_sky() {
    let common = common();
    let sky = common.server.sky(&day());
    let ambient = common.server.get(&format!("{sky}/ambient.json?eye=0,0,0")).json();
    let up = |i: usize| ambient["irradiance"][i][1].as_f64().unwrap();
    // The functions of the zenith: (0,0), (1,0) and (2,0).
    let found = 0.282_094_8 * up(0) + 0.488_602_5 * up(2) + 0.630_783_1 * up(6);
    let data = common.server.get(&format!("{sky}/irradiance.f32?component=diffuse&peak=false&size=1")).body;
    let told = f64::from(f32::from_le_bytes(data[4..8].try_into().unwrap()));
    assert!((found / told - 1.0).abs() < 0.05, "{found} klx, not {told}");
    // The frame of an engine names the zenith otherwise: (1,0) is z, here the south, and (1,-1) is y.
    assert_eq!(ambient["axes"], "enu: x east, y north, z up");
    let engine = common.server.get(&format!("{sky}/ambient.json?eye=0,0,0&axes=godot")).json();
    assert_eq!(engine["axes"], "godot: x east, y up, z south");
    let [level, turned] =
        [(&ambient, [1, 2]), (&engine, [2, 1])].map(|(told, order)| order.map(|i| told["radiance"][i][0].as_f64()));
    assert_eq!((level[0].map(|y| -y), level[1]), (turned[0], turned[1]));
    let answer = common.server.get(&format!("{sky}/ambient.json?size=8"));
    assert_eq!((answer.status, answer.json()["errors"][0]["pointer"].clone()), (422, json!("size")));
}
