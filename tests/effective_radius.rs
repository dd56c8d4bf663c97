//! Claims about maps of effective radius: the light of columns whose droplets are not those of the tables.
#![expect(clippy::unwrap_used, clippy::expect_used, reason = "a test stops where it fails")]

#[path = "common/sky.rs"]
mod sky;

use serde_json::{Value, json};
use sky::{LIBRARY, Sky, mean};
use skyloom::optics::Mix;
use skyloom::reference::monte_carlo::{Effort, SlabProblem, fluxes};
use skyloom::slab::radiance::{Completion, Side};
use skyloom::tables::{Detail, MixTables, Radiance};
use std::f64::consts::PI;
use std::ops::RangeInclusive;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError};

/// Texels a side of the maps.
const SIDE: u32 = 8;
/// Effective radius of the tables, and those of columns, µm.
const OWN_UM: f64 = 10.0;
const RADII_UM: RangeInclusive<f64> = 4.0..=30.0;

/// The one device of these tests.
fn device() -> MutexGuard<'static, Sky> {
    static DEVICE: LazyLock<Mutex<Sky>> = LazyLock::new(|| Mutex::new(Sky::open()));
    DEVICE.lock().unwrap_or_else(PoisonError::into_inner)
}

fn mix(effective_radius_um: f64) -> Mix {
    Mix::Gamma { effective_radius_um, broadness: 2.0, refractive_index: None }
}

fn tables(effective_radius_um: f64) -> Arc<MixTables> {
    LIBRARY.get(&mix(effective_radius_um), Some(Detail::Fine), &|_| ()).unwrap()
}

/// A layer on the ground, under a sun of irradiance 1 over black ground.
fn scene(zenith_deg: f64, layer: &Value) -> Value {
    json!({
        "domain": {"extent_m": 8000, "resolution": SIDE},
        "sun": {"zenith_deg": zenith_deg, "azimuth_deg": 0},
        "atmosphere": {"sun": 1, "sky": 0},
        "ground": {"albedo": 0},
        "layers": [layer],
    })
}

fn map(sky: &mut Sky, value: impl Fn(u32) -> f64) -> Value {
    let data = (0..SIDE * SIDE).map(|texel| value(texel) as f32).collect();
    json!({"image": sky.add_image(SIDE, SIDE, data)})
}

/// A layer of these optical depths and radii.
fn columns(sky: &mut Sky, depth: impl Fn(u32) -> f64, radius_um: impl Fn(u32) -> f64) -> Value {
    json!({"base_m": 0, "optical_depth": map(sky, depth), "effective_radius": map(sky, radius_um),
        "droplets": {"effective_radius_um": OWN_UM}})
}

#[test]
fn asymmetry_and_extinction_are_those_of_the_tables() {
    let radii = mix(OWN_UM).radii(&RADII_UM).unwrap();
    let own = &tables(OWN_UM).channels[1];
    for radius_um in [4.0, 6.4, 13.0, 30.0] {
        let channel = &tables(radius_um).channels[1];
        let turned = (1.0 - radii.asymmetry(radius_um)) / (1.0 - channel.asymmetry) - 1.0;
        let extinction = radii.relative_extinction(radius_um) * own.cross_section_um2 / channel.cross_section_um2 - 1.0;
        eprintln!("{radius_um} um: 1 - g {turned:+.5}, extinction {extinction:+.5}");
        // 0.2 % of the depth that counts is 0.2 % of the light that thick cloud lets through.
        assert!(turned.abs() < 0.002 && extinction.abs() < 0.002, "{radius_um}: {turned} {extinction}");
    }
    assert_eq!(radii.counts_as(3.0, OWN_UM).to_bits(), 3.0_f64.to_bits());
    assert!(Mix::HenyeyGreenstein { asymmetry: 0.8, albedo: 1.0 }.radii(&RADII_UM).is_none());
}

/// What comes through a column of other droplets, against Monte Carlo of those droplets themselves; and that the mean radius alone would be
/// further off where the cloud is thick.
#[test]
fn light_through_other_droplets_is_that_of_monte_carlo() {
    let mut sky = device();
    for radius_um in [4.0, 30.0] {
        let channels = tables(radius_um).channels.clone();
        for depth in [1.0, 4.0, 32.0] {
            for zenith_deg in [0.0_f64, 60.0] {
                let mu_sun = zenith_deg.to_radians().cos();
                let mut through = |radius_um: f64| {
                    let layer = columns(&mut sky, |_| depth, |_| radius_um);
                    let light = sky.render(&scene(zenith_deg, &layer), "irradiance", &[]);
                    [0, 1, 2].map(|channel| mean(&light, channel) / mu_sun)
                };
                let (found, ignored) = (through(radius_um), through(OWN_UM));
                for (c, limit) in [(1, 0.01), (0, 0.025), (2, 0.025)] {
                    let ratio = channels[c].cross_section_um2 / channels[1].cross_section_um2;
                    let (optical_depth, albedo) = (depth * ratio, channels[c].albedo);
                    let problem = SlabProblem { optical_depth, albedo, phase: &channels[c].phase, mu_sun };
                    let effort = Effort { photons: 100_000, seed: 1, relative_error: 0.0, time_limit: None };
                    let truth = fluxes(&problem, &effort, &|_| (), &AtomicBool::new(false)).unwrap().transmittance;
                    let off = found[c] / truth.value - 1.0;
                    let without = ignored[c] / truth.value - 1.0;
                    let noise = 3.0 * truth.standard_error / truth.value;
                    eprintln!(
                        "{radius_um} um, depth {depth}, sun {zenith_deg}, channel {c}: {:+.2} %, without the map {:+.2} %, noise {:.2}",
                        100.0 * off,
                        100.0 * without,
                        100.0 * noise
                    );
                    assert!(off.abs() < limit + noise, "{radius_um} {depth} {zenith_deg} {c}: {off}");
                    assert!(depth < 4.0 || off.abs() < 0.5 * without.abs() + noise, "{off} {without}");
                }
            }
        }
    }
}

/// Radiance of slabs at 12 degrees from the sun and more.
fn radiance(tables: &MixTables, radiance: &Radiance, side: Side, depth: f64, mu_sun: f64) -> Vec<f64> {
    let (channel, table) = (&tables.channels[1], &radiance[1]);
    let whole = |angle: f64| channel.phase.value(angle);
    let completion = Completion { scaling: table.scaling(), aureole: &tables.aureoles[1], phase: &whole };
    let slice = table.slice(mu_sun, 1.0);
    let views = (0..12 * 24).map(|i| ((f64::from(i / 24) + 0.5) / 12.0, PI * (f64::from(i % 24) + 0.5) / 24.0));
    let far = views.filter(|(mu, azimuth)| side.scattering_cosine(mu_sun, *mu, *azimuth) < 12.0_f64.to_radians().cos());
    let value = |(mu, azimuth): (f64, f64)| {
        completion.radiance(side, slice.remainder(side, depth, mu, azimuth), depth, mu_sun, mu, azimuth)
    };
    far.map(value).collect()
}

/// The table of docs/method.md, section 5.3: errors of columns of the least and the greatest of two radii, with and without the map. Limits are
/// about a tenth above what was found, as a guard of the table; that the way is right is shown by Monte Carlo, above.
#[test]
fn droplets_of_other_radii_err_as_is_said() {
    let own = tables(OWN_UM);
    let own_radiance = own.radiance(Detail::Fine, &|_| ());
    for (radii_um, limits) in [([7.0, 15.0], LIMITS_NEAR), ([4.0, 30.0], LIMITS_FAR)] {
        let radii = mix(OWN_UM).radii(&(radii_um[0]..=radii_um[1])).unwrap();
        for (depth, limits) in limits {
            // Largest of T in per cent, of R and the beam absolute; radiances R, T in per cent: root mean square of all views and suns.
            let (mut with, mut without) = ([0.0_f64; 5], [0.0_f64; 5]);
            for radius_um in radii_um {
                let truth = tables(radius_um);
                let truth_radiance = truth.radiance(Detail::Fine, &|_| ());
                for zenith_deg in [0.0_f64, 30.0, 60.0, 75.0] {
                    let mu = zenith_deg.to_radians().cos();
                    let exact = truth.fluxes[1].beam(depth, mu);
                    let bright = Side::BOTH.map(|side| radiance(&truth, &truth_radiance, side, depth, mu));
                    for (counted, errors) in [(radii.counts_as(depth, radius_um), &mut with), (depth, &mut without)] {
                        let flux = own.fluxes[1].beam(counted, mu);
                        let through = 100.0 * (flux.transmittance / exact.transmittance - 1.0).abs();
                        errors[0] = errors[0].max(through);
                        errors[1] = errors[1].max((flux.reflectance - exact.reflectance).abs());
                        errors[2] = errors[2].max(((-counted / mu).exp() - (-depth / mu).exp()).abs());
                        for (i, side) in Side::BOTH.into_iter().enumerate() {
                            let found = radiance(&own, &own_radiance, side, counted, mu);
                            let pairs = found.iter().zip(&bright[i]);
                            let off: f64 = pairs.map(|(found, exact)| (found - exact).powi(2)).sum();
                            let all: f64 = bright[i].iter().map(|exact| exact * exact).sum();
                            errors[3 + i] += 1e4 * off / all / 8.0;
                        }
                    }
                }
            }
            for errors in [&mut with, &mut without] {
                errors[3] = errors[3].sqrt();
                errors[4] = errors[4].sqrt();
            }
            eprintln!("{radii_um:?} um, depth {depth}: {with:.3?}, without {without:.3?}");
            assert!((0..5).all(|i| with[i] <= limits[i]), "{radii_um:?} {depth}: {with:?} {limits:?}");
        }
    }
}

type Limits = [(f64, [f64; 5]); 6];
const LIMITS_NEAR: Limits = [
    (0.5, [0.25, 0.0025, 0.009, 7.0, 2.0]),
    (1.0, [0.25, 0.0025, 0.014, 5.2, 2.2]),
    (2.0, [0.25, 0.0025, 0.0135, 3.5, 2.0]),
    (4.0, [0.25, 0.002, 0.0042, 2.4, 1.4]),
    (16.0, [0.25, 0.002, 0.0001, 1.7, 0.4]),
    (64.0, [0.25, 0.002, 0.0001, 1.5, 0.3]),
];
const LIMITS_FAR: Limits = [
    (0.5, [0.9, 0.0068, 0.028, 18.7, 5.4]),
    (1.0, [0.9, 0.0068, 0.044, 14.0, 5.9]),
    (2.0, [0.7, 0.0065, 0.040, 9.2, 5.2]),
    (4.0, [0.7, 0.0045, 0.0105, 6.2, 3.5]),
    (16.0, [0.6, 0.002, 0.0001, 4.3, 0.9]),
    (64.0, [0.6, 0.002, 0.0001, 3.9, 0.4]),
];

const LIGHT: [(&str, &[(&str, &str)]); 5] = [
    ("irradiance", &[]),
    ("shadow", &[]),
    ("thickness", &[]),
    ("cloud", &[("view", "above"), ("direction", "50,200")]),
    ("sky", &[("projection", "fisheye"), ("fov", "140"), ("size", "16"), ("eye", "0,0,0")]),
];

/// A map of the droplets' own radius changes no bit.
#[test]
fn droplets_of_their_own_radius_are_what_they_are() {
    let mut sky = device();
    let deep = |texel: u32| f64::from(texel % 7) * 1.5;
    let with = columns(&mut sky, deep, |_| OWN_UM);
    let mut without = with.clone();
    without.as_object_mut().unwrap().remove("effective_radius");
    for (texture, query) in LIGHT {
        let [with, without] = [&with, &without].map(|layer| sky.render(&scene(40.0, layer), texture, query).data);
        assert!(with == without && with.iter().any(|value| *value > 0.0), "{texture}");
    }
}

/// Each column has its own, and none where its radius is not known. Where a scene is traced, what it says is read alike.
#[test]
fn every_column_has_its_own_radius() {
    let mut sky = device();
    let query = &[("transport", "columns")];
    // Halves of 4 km, the middles of which are looked at: between, columns are blended.
    let halves = columns(&mut sky, |_| 9.0, |texel| if texel % SIDE < SIDE / 2 { 6.0 } else { 14.0 });
    let both = sky.render(&scene(30.0, &halves), "irradiance", query).data;
    for (radius_um, column) in [(6.0, 1), (14.0, 5)] {
        let even = columns(&mut sky, |_| 9.0, |_| radius_um);
        let alone = mean(&sky.render(&scene(30.0, &even), "irradiance", query), 1);
        let found = f64::from(both[3 * (3 * SIDE as usize + column) + 1]);
        assert!((found / alone - 1.0).abs() < 2e-3, "{radius_um}: {found}, alone {alone}");
    }
    let traced = sky.render(&scene(30.0, &halves), "irradiance", &[("method", "reference"), ("tolerance", "0.02")]);
    let fast = both.iter().skip(1).step_by(3).map(|value| f64::from(*value)).sum::<f64>() / f64::from(SIDE * SIDE);
    let off = mean(&traced, 1) / fast - 1.0;
    // What diffuses between halves changes the mean by next to nothing; the noise of the mean is far below that of a texel.
    assert!(off.abs() < 0.01, "{off}");

    let mut filled = columns(&mut sky, |_| 9.0, |texel| if texel % SIDE < SIDE / 2 { -9.0 } else { 14.0 });
    filled["effective_radius"]["fill"] = json!(-9);
    let shadow = sky.render(&scene(0.0, &filled), "shadow", &[]).data;
    let at = |column: usize| shadow[3 * SIDE as usize + column];
    assert!(at(1) == 1.0 && at(5) < 0.02, "{} {}", at(1), at(5));
}

/// Of a thickness and a number of droplets larger ones make denser cloud; a stated extinction is that of all.
#[test]
fn number_and_radius_make_the_extinction() {
    let mut sky = device();
    let thickness = json!({"kind": "uniform", "metres": 150});
    for (droplets, radius_um) in [
        (json!({"number_per_cm3": 80}), 14.0),
        (json!({"extinction_per_m": 0.06}), 6.0),
        (json!({"number_per_cm3": 80}), 7.0),
    ] {
        let with = |radius_um: f64| {
            let mut with = droplets.clone();
            with["effective_radius_um"] = json!(radius_um);
            with
        };
        let (own, exact) = (with(OWN_UM), with(radius_um));
        let by_map = json!({"base_m": 0, "thickness": thickness, "effective_radius": map(&mut sky, |_| radius_um), "droplets": own});
        let alone = json!({"base_m": 0, "thickness": thickness, "droplets": exact});
        let [by_map, alone] =
            [&by_map, &alone].map(|layer| mean(&sky.render(&scene(40.0, layer), "irradiance", &[]), 1));
        // 0.6 % of the method, 0.3 % of tables.
        assert!((by_map / alone - 1.0).abs() < 0.01, "{droplets} {radius_um}: {by_map}, not {alone}");
    }
}
