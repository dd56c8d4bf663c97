//! Light of a single wavelength.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]
#![allow(clippy::print_stdout, reason = "how far each comparison is off")]

mod common;

use common::sky::{Sky, hg_layer, mean};
use serde_json::{Value, json};
use skyloom::encode::Format;
use skyloom::projection::{Sphere, SphereLayout};
use skyloom::render::{RenderError, encode};
use skyloom::request::Axes;

/// The air of the set `std` of `data/sky/README.md`, without polarisation.
fn standard(zenith_deg: f64) -> Value {
    let aerosol = json!({ "optical_depth": 0.1, "asymmetry": 0.7, "albedo": 0.93, "scale_height_m": 1200 });
    json!({
        "domain": { "extent_m": 20000, "resolution": 8 },
        "sun": { "zenith_deg": zenith_deg, "azimuth_deg": 0 },
        "atmosphere": { "aerosol": aerosol, "polarisation": false },
        "ground": { "albedo": 0.2 },
    })
}

fn rows(name: &str) -> Vec<Vec<f64>> {
    let path = format!("{}/tests/data/sky/{name}.csv", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).unwrap();
    // The first field is the set's name.
    text.lines()
        .skip(1)
        .map(|line| line.split(',').skip(1).map(|field| field.parse().unwrap_or(0.0)).collect())
        .collect()
}

#[test]
fn light_of_one_wavelength_is_that_of_an_independent_solver() {
    let mut sky = Sky::open();
    radiance_is_that_of_an_independent_solver(&mut sky);
    irradiance_is_beer_s_law_and_clouds_are_between_their_channels(&mut sky);
    it_is_refused_where_it_means_nothing(&mut sky);
    files_say_the_wavelength(&mut sky);
}

/// Views 3 degrees and more from the sun; texels are those of a narrow picture of each.
fn radiance_is_that_of_an_independent_solver(sky: &mut Sky) {
    for nm in [440.0, 640.0] {
        let (mut squares, mut noise, mut count) = (0.0, 0.0, 0);
        for row in rows("std_ground") {
            let [wavelength, sun, eye_km, elevation, azimuth] = [row[0], row[1], row[2], row[3], row[4]];
            if wavelength != nm || ![30.0, 75.0].contains(&sun) || row[5] < 3.0 || row[2] > 0.0 {
                continue;
            }
            let height = format!("0,0,{}", (1000.0 * eye_km).max(1.0));
            let look = format!("{azimuth},{elevation}");
            let query = [
                ("projection", "camera"),
                ("fov", "1"),
                ("size", "1"),
                ("look", look.as_str()),
                ("eye", height.as_str()),
                ("wavelength", if nm == 440.0 { "440" } else { "640" }),
            ];
            let found = sky.render(&standard(sun), "sky", &query);
            assert_eq!((found.channels, found.data.len()), (&["Y"][..], 1));
            let off = f64::from(found.data[0]) / row[10] - 1.0;
            (squares, noise, count) = (squares + off * off, noise + (row[9] / row[10]).powi(2), count + 1);
        }
        let [rms, noise] = [squares, noise].map(|sum: f64| (sum / f64::from(count)).sqrt());
        println!("{nm} nm: {:.2} % rms of {count} views, noise of the truth {:.2} %", 100.0 * rms, 100.0 * noise);
        assert!(count > 20 && rms < 0.006 + noise, "{rms}");
    }
}

fn irradiance_is_beer_s_law_and_clouds_are_between_their_channels(sky: &mut Sky) {
    let fast = ("tolerance", "0.1");
    // Molecules alone weaken the beam as Hansen and Travis (1974) say.
    let mut clear = standard(0.0);
    clear["atmosphere"]["aerosol"] = json!({ "optical_depth": 0 });
    clear["atmosphere"]["ozone_du"] = json!(0);
    for (wavelength, depth) in [("300", 1.2077), ("550", 0.0973), ("1000", 0.00867)] {
        let found = sky.render(&clear, "irradiance", &[("component", "direct"), ("wavelength", wavelength), fast]);
        let ratio = f64::from(found.data[0]) / f64::exp(-depth);
        assert!((ratio - 1.0).abs() < 0.003, "{wavelength}: {ratio}");
    }
    // Ozone takes nearly all of the beam at 300 nm: 10 per 1000 Dobson units.
    clear["atmosphere"]["ozone_du"] = json!(300);
    let dark = sky.render(&clear, "irradiance", &[("component", "direct"), ("wavelength", "300"), fast]).data[0];
    assert!((f64::from(dark) / f64::exp(-1.2077 - 3.0) - 1.0).abs() < 0.01, "{dark}");

    // Without any air, light under clouds is what it is in colours: as much of the sun's.
    let mut cloudy = standard(50.0);
    cloudy["atmosphere"] = json!({ "aerosol": { "optical_depth": 0 }, "ozone_du": 0, "rayleigh": 0 });
    cloudy["ground"] = json!({ "albedo": [0.6, 0.3, 0.1] });
    cloudy["layers"] = json!([hg_layer(json!({ "kind": "uniform", "metres": 200 }), 0.03, 1.0)]);
    let mut own = cloudy.clone();
    own["atmosphere"] = json!({ "sun": 1, "sky": 0 });
    own["sun"]["angular_diameter_deg"] = json!(0.533);
    for texture in ["irradiance", "sky"] {
        let size = ("size", "8");
        let colours = sky.render(&own, texture, &[fast, size]);
        let colours = [0, 1, 2].map(|c| mean(&colours, c));
        for (wavelength, parts) in [
            ("1000", [1.0, 0.0, 0.0]),
            ("600", [0.5, 0.5, 0.0]),
            ("550", [0.0, 1.0, 0.0]),
            ("475", [0.0, 0.25, 0.75]),
            ("400", [0.0, 0.0, 1.0]),
        ] {
            let found = mean(&sky.render(&cloudy, texture, &[("wavelength", wavelength), fast, size]), 0);
            let wanted: f64 = colours.iter().zip(parts).map(|(value, part)| value * part).sum();
            assert!((found / wanted - 1.0).abs() < 1e-4, "{texture} at {wavelength}: {found}, not {wanted}");
        }
    }
}

fn it_is_refused_where_it_means_nothing(sky: &mut Sky) {
    let mut own = standard(30.0);
    own["atmosphere"] = json!({ "sun": 1, "sky": 0 });
    for (scene, query, field) in [
        (&own, vec![("wavelength", "500")], "wavelength"),
        (&standard(30.0), vec![("wavelength", "500"), ("method", "reference"), ("size", "4")], "wavelength"),
    ] {
        let Err(RenderError::Invalid(errors)) = sky.prepare(scene, ("sky", "f32"), &query) else { panic!("{query:?}") };
        assert_eq!(errors.iter().map(|error| error.pointer.as_str()).collect::<Vec<_>>(), [field]);
    }
    let picture = sky.prepare(&standard(30.0), ("sky", "png"), &[("wavelength", "500"), ("ev100", "12")]);
    assert!(matches!(picture, Err(RenderError::Invalid(errors)) if errors[0].pointer == "ev100"));
}

fn files_say_the_wavelength(sky: &mut Sky) {
    let query = [("wavelength", "440.5"), ("size", "2"), ("tolerance", "0.1")];
    let job = sky.prepare(&standard(30.0), ("sky", "exr"), &query).unwrap();
    assert_eq!(job.request().format(), Format::Exr);
    let texture = sky.renderer.render(&job, &Default::default()).unwrap();
    let bytes = encode(&texture, &job).unwrap().bytes;
    let text = String::from_utf8_lossy(&bytes);
    assert!(
        text.contains("skyloom:wavelength") && text.contains("1/sr of the sun's spectral irradiance above the air")
    );
    assert!(!text.contains("whiteLuminance"));
    let sphere = Sphere { layout: SphereLayout::Equirect, axes: Axes::Enu, eye: [0.0, 0.0, 2.0] };
    assert_eq!(job.request().wanted.sphere(), Some(&sphere));
}
