//! Clouds around sunset: the sun shines on them from their own height, through the air that lies on its way there, and for longer
//! than on the ground.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]
#![allow(clippy::print_stdout, reason = "how far each comparison is off")]

mod common;

use common::sky::{Sky, hg_layer, mean};
use serde_json::{Value, json};
use std::f64::consts::PI;

const EARTH_RADIUS_M: f64 = 6_371_000.0;
const AIR_TOP_M: f64 = 100_000.0;
/// Red light, one of whose optical depths is that of aerosol, and its air.
const WAVELENGTH_NM: f64 = 640.0;
const OPTICAL_DEPTH: f64 = 0.1;
/// Angular radius of the sun: within it of the horizon a part of its disc is up.
const SUN_RADIUS: f64 = 0.004_653;
/// Clear air in a quarter of the time; the beam does not depend on it.
const FAST: (&str, &str) = ("tolerance", "0.05");

/// Extinction of the air at a height, 1/m: molecules after Hansen and Travis, aerosol by Angstrom's law, ozone in a tent.
fn extinction(height_m: f64) -> f64 {
    let um = 1e-3 * WAVELENGTH_NM;
    let rayleigh = 0.008_569 * um.powi(-4) * (1.0 + 0.0113 * um.powi(-2) + 0.000_13 * um.powi(-4));
    let aerosol = OPTICAL_DEPTH * (um / 0.55).powf(-1.3);
    let ozone = 0.3 * 0.0804;
    let layer = |depth: f64, scale_m: f64| {
        depth / (scale_m * (1.0 - (-AIR_TOP_M / scale_m).exp())) * (-height_m / scale_m).exp()
    };
    let tent = (1.0 - (height_m - 25_000.0).abs() / 15_000.0).max(0.0) / 15_000.0;
    layer(rayleigh, 8000.0) + layer(aerosol, 1200.0) + ozone * tent
}

/// What reaches a height of a beam from a zenith angle, straight through air on a round Earth: by the trapezium's rule. `None` behind
/// the Earth.
fn transmittance(height_m: f64, zenith_deg: f64) -> Option<f64> {
    let (from, mu) = (EARTH_RADIUS_M + height_m, zenith_deg.to_radians().cos());
    let nearest = from * (1.0 - mu * mu).sqrt();
    if mu < 0.0 && nearest < EARTH_RADIUS_M {
        return None;
    }
    let way = (AIR_TOP_M + EARTH_RADIUS_M).powi(2) - nearest * nearest;
    let length = way.sqrt() - from * mu;
    let steps = 40_000;
    let height = |part: f64| {
        let along = from * mu + part * length;
        (nearest * nearest + along * along).sqrt() - EARTH_RADIUS_M
    };
    let sum: f64 = (0..=steps)
        .map(|i| {
            let end = if i == 0 || i == steps { 0.5 } else { 1.0 };
            end * extinction(height(f64::from(i) / f64::from(steps)))
        })
        .sum();
    Some((-sum * length / f64::from(steps)).exp())
}

/// Elevation of the sun above the horizon of a height, in radii of its disc.
fn above_horizon(height_m: f64, zenith_deg: f64) -> f64 {
    let dip = (EARTH_RADIUS_M / (EARTH_RADIUS_M + height_m)).acos();
    (0.5 * PI - zenith_deg.to_radians() + dip) / SUN_RADIUS
}

fn scene(zenith_deg: f64, layers: Value) -> Value {
    json!({
        "domain": { "extent_m": 20_000, "resolution": 32 },
        "sun": { "zenith_deg": zenith_deg, "azimuth_deg": 120, "angular_diameter_deg": 0 },
        "atmosphere": { "aerosol": { "optical_depth": OPTICAL_DEPTH } },
        "ground": { "albedo": 0.2 }, "layers": layers,
    })
}

fn high_layer(base_m: f64) -> Value {
    let mut layer = hg_layer(json!({ "kind": "uniform", "metres": 200 }), 0.01, 1.0);
    layer["base_m"] = json!(base_m);
    json!([layer])
}

const RED: [(&str, &str); 3] = [("wavelength", "640"), ("size", "4"), FAST];

fn suns() -> impl Iterator<Item = f64> {
    (0..=60).map(|step| 85.0 + 0.25 * f64::from(step))
}

#[test]
fn the_beam_at_a_height_is_that_of_the_way_through_round_air() {
    let mut sky = Sky::open();
    let air = sky.job(&scene(60.0, json!([])), "sky", &RED).air().unwrap().clone();
    let (mut most, mut lit, mut dark) = (0.0_f64, 0, 0);
    for height_m in [0.0, 300.0, 1000.0, 2500.0, 6000.0, 10_000.0, 14_000.0] {
        for zenith_deg in suns() {
            let found = air.clear.waves[0].air.disc_transmittance(height_m, zenith_deg.to_radians().cos());
            let radii = above_horizon(height_m, zenith_deg);
            if radii < -1.0 {
                assert_eq!(found, 0.0, "{height_m} m, sun at {zenith_deg}");
                dark += 1;
            } else if radii > 1.0 {
                let wanted = transmittance(height_m, zenith_deg).unwrap();
                // Of a beam of which a millionth is left, no more is asked than that it be little.
                let error = (found - wanted).abs() / (wanted + 1e-6);
                most = most.max(error);
                assert!(error < BEAM, "{height_m} m, sun at {zenith_deg}: {found}, {wanted}");
                lit += 1;
            }
        }
    }
    println!("{lit} suns on clouds, {dark} behind the Earth; largest error {most:.4}");
    assert!(lit > 150 && dark > 100);
}

/// The table of optical depth at low suns, in which aerosol of a scale height of 1.2 km is steep.
const BEAM: f64 = 0.02;

/// Once the sun has set below a layer, what it sends to the base is the beam there times the sine of its depression; the rest
/// that the base gets of air is at most the light that goes up there in the mean.
#[test]
fn a_sun_that_has_set_shines_on_the_base_of_a_layer() {
    let mut sky = Sky::open();
    for base_m in [2000.0, 10_000.0] {
        let mut brightest = 0.0_f64;
        for zenith_deg in suns() {
            let job = sky.job(&scene(zenith_deg, high_layer(base_m)), "sky", &RED);
            let light = job.illumination();
            let added = light.air_below.layers[0][0].added[0];
            let rest = light.cover.as_ref().unwrap().with[0].at(base_m).up;
            let radii = above_horizon(base_m, zenith_deg);
            let sine = -zenith_deg.to_radians().cos();
            let beam = if radii > 1.0 { transmittance(base_m, zenith_deg).unwrap() } else { 0.0 };
            let wanted = beam * sine.max(0.0);
            if radii.abs() > 1.0 {
                let (least, most) = (wanted * (1.0 - BEAM), wanted * (1.0 + BEAM) + rest * 1.001);
                assert!(
                    (least..=most).contains(&added),
                    "{base_m} m, sun at {zenith_deg}: {added}, {wanted} and {rest}"
                );
            }
            brightest = brightest.max(wanted / (wanted + rest));
        }
        println!("base at {base_m} m: up to {brightest:.2} of the light from below is the sun's");
        let job = sky.job(&scene(112.0, high_layer(base_m)), "sky", &RED);
        assert_eq!(job.illumination().air_below.layers[0][0].added, [0.0; 3]);
    }
}

/// Cumulus under a setting sun gets darker step by step, and is black by night.
#[test]
fn cumulus_does_not_lose_its_sun_at_once() {
    let mut sky = Sky::open();
    let clouds = json!([{ "kind": "cumulus", "base_m": 1200, "coverage": 0.15, "width_m": [800, 1500], "seed": 4,
        "droplets": { "henyey_greenstein": 0.85, "extinction_per_m": 0.03, "albedo": 1 } }]);
    let mut light = |zenith_deg: f64| {
        let query = [("view", "below"), ("direction", "60,300"), ("size", "24"), FAST];
        mean(&sky.render(&scene(zenith_deg, clouds.clone()), "cloud", &query), 0)
    };
    let suns = [89.0, 89.8, 89.95, 90.05, 90.2, 91.0, 92.0, 93.0];
    let lights = suns.map(&mut light);
    println!("{lights:.4?}");
    for (sun, pair) in suns.windows(2).zip(lights.windows(2)) {
        assert!(pair[1] < pair[0] * 1.02, "sun at {sun:?}: {pair:?}");
        // No step: a tenth of a degree takes a third at most.
        let least = 0.02_f64.powf(sun[1] - sun[0]);
        assert!(pair[1] > least * pair[0], "sun at {sun:?}: {pair:?}");
    }
    assert_eq!(light(112.0), 0.0);
}

/// Light on the ground and at the zenith falls from step to step until the night, whatever stands in the air; from a sun 19 degrees
/// below the horizon on there is none.
#[test]
fn dusk_darkens_steadily_in_any_air() {
    let mut sky = Sky::open();
    let broken = json!({ "kind": "stratocumulus", "pattern": "open", "mean_m": 250, "coverage": 0.5, "seed": 7 });
    let cumulus = json!([{ "kind": "cumulus", "base_m": 1200, "coverage": 0.15, "width_m": [800, 1500], "seed": 4,
        "droplets": { "henyey_greenstein": 0.85, "extinction_per_m": 0.03, "albedo": 1 } }]);
    for (name, aerosol, layers, step_deg) in [
        ("clear", 0.1, json!([]), 1),
        ("haze", 0.5, json!([]), 1),
        ("overcast in haze", 0.5, high_layer(2000.0), 2),
        ("broken", 0.1, json!([hg_layer(broken, 0.03, 1.0)]), 2),
        ("cumulus", 0.1, cumulus, 4),
    ] {
        let mut before = [f64::INFINITY; 6];
        let mut most = 0.0_f64;
        let mut at = |zenith_deg: f64| {
            let mut scene = scene(zenith_deg, layers.clone());
            scene["atmosphere"]["aerosol"]["optical_depth"] = json!(aerosol);
            let zenith = [("projection", "camera"), ("look", "0,90"), ("fov", "60"), ("size", "8"), FAST];
            let shone = sky.render(&scene, "irradiance", &[("size", "8"), FAST]);
            let seen = sky.render(&scene, "sky", &zenith);
            [0, 1, 2, 3, 4, 5].map(|i| if i < 3 { mean(&shone, i) } else { mean(&seen, i - 3) })
        };
        for zenith_deg in (88..=108).step_by(step_deg).map(f64::from) {
            let now = at(zenith_deg);
            for i in 0..6 {
                most = most.max(now[i] / before[i]);
                // Deep dusk is bluer than any red of a screen: that channel ends at 0.
                let lit = now[i] < before[i] && now[i] > 0.0 || i % 3 == 0 && now[i] == 0.0;
                assert!(lit, "{name}, sun {zenith_deg}, {i}: {now:?} after {before:?}");
            }
            before = now;
        }
        println!("{name}: at most {most:.3} of the light {step_deg} degrees before");
        for zenith_deg in [109.5, 120.0, 180.0] {
            assert_eq!(at(zenith_deg), [0.0; 6], "{name}, sun {zenith_deg}");
        }
    }
}
