//! Claims about every scene of Henyey-Greenstein droplets.

use crate::setup::{METHODS, Slab, cos_deg, device, henyey_greenstein};
use proptest::prelude::*;
use proptest::test_runner::Config;
use serde_json::{Value, json};
use skyloom::gpu::layout::View;
use skyloom::optics::gauss_legendre;
use skyloom::reference::{Map, cloud, cloud_analytic, cloud_plane};
use skyloom::render::{Stages, Watch};
use std::f64::consts::{FRAC_PI_2, PI};

/// Mixes are few: each costs a second of tables.
fn mix() -> impl Strategy<Value = (f64, f64)> {
    prop_oneof![Just((0.85, 1.0)), Just((0.98, 0.9)), Just((0.0, 0.5)), Just((-0.9, 1.0)), Just((0.5, 0.0))]
}

fn thickness() -> impl Strategy<Value = Value> {
    let uniform = prop_oneof![Just(0.0), Just(100_000.0), 1e-3..3000.0]
        .prop_map(|metres: f64| json!({ "kind": "uniform", "metres": metres }));
    let pattern = prop_oneof![Just("closed"), Just("open"), Just("fractal")];
    let field = (pattern, 0.0..=1.0, 0.0..=4000.0, 1.0..1e6, any::<u32>()).prop_map(
        |(pattern, coverage, mean_m, cell_m, seed)| {
            json!({ "kind": "stratocumulus", "pattern": pattern, "coverage": coverage, "mean_m": mean_m,
                "cell_m": cell_m, "seed": seed })
        },
    );
    prop_oneof![uniform, field]
}

fn colour(most: f64) -> impl Strategy<Value = [f64; 3]> {
    prop_oneof![Just([0.0; 3]), Just([most; 3]), [0.0..=most, 0.0..=most, 0.0..=most]]
}

fn zenith() -> impl Strategy<Value = f64> {
    prop_oneof![Just(0.0), Just(90.0), Just(180.0), 0.0..90.0, 89.9..90.1]
}

fn log_uniform(low: f64, high: f64) -> impl Strategy<Value = f64> {
    (low.ln()..high.ln()).prop_map(f64::exp)
}

prop_compose! {
    fn scene()(
        (extent_m, base_m) in (log_uniform(1.0, 1e6), prop_oneof![Just(0.0), 1.0..20_000.0]),
        resolution in prop_oneof![Just(1), Just(5), Just(16)],
        (zenith, azimuth) in (zenith(), -360.0..=360.0),
        (sun, sky, albedo) in (colour(1.0), colour(1.0), colour(1.0)),
        (asymmetry, single) in mix(),
        extinction in log_uniform(1e-4, 1.0),
        thickness in thickness(),
        (speed, from) in (0.0..200.0, -360.0..360.0),
    ) -> Value {
        let mut droplets = henyey_greenstein(asymmetry, single);
        droplets["extinction_per_m"] = json!(extinction);
        json!({
            "domain": { "extent_m": extent_m, "resolution": resolution },
            "sun": { "zenith_deg": zenith, "azimuth_deg": azimuth },
            "atmosphere": { "sun": sun, "sky": sky },
            "ground": { "albedo": albedo },
            "layers": [{ "base_m": base_m, "thickness": thickness, "droplets": droplets,
                "wind": { "speed_m_s": speed, "from_deg": from } }],
        })
    }
}

fn config(cases: u32) -> Config {
    Config { cases, failure_persistence: None, max_shrink_iters: 64, ..Config::default() }
}

proptest! {
    #![proptest_config(config(32))]

    /// Whatever is asked of whatever scene: finite, not negative, bounded; alpha and shadow are parts.
    #[test]
    fn textures_are_finite_and_bounded(
        scene in scene(),
        view in prop_oneof![Just("below"), Just("above")],
        (to, azimuth) in (prop_oneof![Just(0.0), Just(89.9), 0.0..89.9], -360.0..=360.0),
        time in prop_oneof![Just(0.0), 0.0..1e9],
        peak in any::<bool>(),
        method in prop_oneof![3 => Just(METHODS[0]), 1 => Just(METHODS[1])],
    ) {
        let (direction, time, peak) = (format!("{to},{azimuth}"), time.to_string(), peak.to_string());
        let mut device = device();
        let mut render = |texture, query: &[(&str, &str)]| device.render(&scene, texture, query).data;
        let query = [&[("view", view), ("direction", direction.as_str()), ("time", time.as_str())], method].concat();
        let cloud = render("cloud", &query);
        // The aureole of Henyey-Greenstein droplets of 0.98 is at most P(0) / 4 pi, 394, times the sun's 1.
        prop_assert!(cloud.iter().all(|value| value.is_finite() && (0.0..=400.0).contains(value)), "{cloud:?}");
        prop_assert!(cloud.iter().skip(3).step_by(4).all(|alpha| (0.0..=1.0).contains(alpha)), "{cloud:?}");
        let shadow = render("shadow", &[("time", &time), ("peak", &peak)]);
        prop_assert!(shadow.iter().all(|part| (0.0..=1.0).contains(part)), "{shadow:?}");
        for component in ["total", "direct", "diffuse"] {
            let light = render("irradiance", &[("component", component), ("time", &time), ("peak", &peak)]);
            // Sun and sky, 1 + pi, and what goes to and fro under a cloud that keeps it in: with grounds of albedo 1 it
            // is not more than even light as bright as the brightest.
            prop_assert!(light.iter().all(|value| value.is_finite() && (0.0..=60.0).contains(value)), "{light:?}");
        }
        let heights = render("thickness", &[("time", &time)]);
        prop_assert!(heights.iter().all(|height| (0.0..=1e5).contains(height)), "{heights:?}");
    }
}

/// Maps of a slab for the twin of the cloud shader, which answers any view without the device.
struct Twin {
    stages: Stages,
    maps: [Map; 8],
}

impl Twin {
    fn new(slab: &Slab) -> Self {
        let mut device = device();
        let job = device.job(&slab.scene(), "cloud", &[("method", "analytic")]);
        let stages = device.renderer.inspect(&job, &Watch::default()).unwrap();
        let tables = &stages.tables;
        let maps = [
            &stages.thickness,
            &tables.transmittance,
            &tables.reflectance,
            &stages.closure,
            &tables.phase,
            &tables.aureole,
            &stages.shares[0],
            &stages.shares[1],
        ]
        .map(|map| Map::from_f32(map.width as usize, map.height as usize, map.channels as usize, &map.data));
        Self { stages, maps }
    }

    /// Radiance (green) and alpha towards `zenith`, `azimuth` (radians; azimuth against that of the sun).
    fn at(&self, from_above: bool, zenith: f64, azimuth: f64) -> (f64, f64) {
        let side = if from_above { 1.0 } else { -1.0 };
        let towards = [zenith.sin() * azimuth.sin(), zenith.sin() * azimuth.cos(), side * zenith.cos()];
        let towards = towards.map(|part| part as f32);
        let view = View { towards, from_above: from_above.into(), ..self.stages.view };
        let [thickness, transmittance, reflectance, closure, phase, aureole, below, above] = &self.maps;
        let even = |light: &[[f32; 3]]| Map::from_f32(1, 1, 3, &light[0]);
        let (from_below, from_above_light) = (even(&self.stages.light.from_below), even(&self.stages.light.from_above));
        let maps = cloud::Maps {
            transmittance,
            reflectance,
            from_below: &from_below,
            from_above: &from_above_light,
            sun_share: if from_above { above } else { below },
            behind: if from_above { &from_below } else { &from_above_light },
            reaches: None,
        };
        let method = cloud_analytic::Maps { closure, phase, aureole };
        let frame = &self.stages.frame;
        let texel =
            cloud_plane::main(frame, &view, thickness, &maps, |ray| cloud_analytic::sunlight(frame, &method, ray));
        (texel[1], texel[3])
    }

    /// Flux of radiance through one side.
    fn flux(&self, from_above: bool, sun: f64) -> f64 {
        // Panels end where the phase function has edges: around the sun, whose image is at azimuth pi from below.
        let around = [0.0, 0.01, 0.03, 0.07, 0.12, 0.25, 0.5];
        let mut zeniths = vec![0.0, FRAC_PI_2];
        zeniths.extend(around.iter().flat_map(|away| [sun - away, sun + away]));
        zeniths.retain(|zenith| (0.0..=FRAC_PI_2).contains(zenith));
        zeniths.sort_by(f64::total_cmp);
        let middle = if from_above { 0.0 } else { PI };
        let mut sum = 0.0;
        for (zenith, weight) in panels(&zeniths) {
            // Towards small circles the same angles span more azimuth.
            let spread = 1.0 / sun.sin().max(0.05);
            let mut azimuths = vec![0.0, PI];
            azimuths.extend(around.iter().map(|away| away * spread).filter(|away| *away < PI));
            azimuths.sort_by(f64::total_cmp);
            for (azimuth, turn) in panels(&azimuths) {
                let radiance = self.at(from_above, zenith, middle + azimuth).0;
                sum += 2.0 * turn * weight * zenith.sin() * zenith.cos() * radiance;
            }
        }
        sum
    }
}

fn panels(ends: &[f64]) -> Vec<(f64, f64)> {
    let (nodes, weights) = gauss_legendre(6);
    let panel = |pair: &[f64]| {
        let (middle, half) = (0.5 * (pair[0] + pair[1]), 0.5 * (pair[1] - pair[0]));
        nodes.iter().zip(&weights).map(|(x, w)| (middle + half * x, half * w)).collect::<Vec<_>>()
    };
    ends.windows(2).filter(|pair| pair[1] > pair[0]).flat_map(panel).collect()
}

proptest! {
    #![proptest_config(config(12))]

    /// Light that leaves both sides of a slab that absorbs nothing, over black ground, is the light that enters: the
    /// radiance over all views, and what was not scattered.
    #[test]
    fn all_light_of_the_sun_leaves_the_slab(
        zenith in 0.0..85.0,
        depth in log_uniform(0.01, 300.0),
        asymmetry in prop_oneof![Just(0.85), Just(0.5)],
    ) {
        // Near the horizon part of the aureole, which the closure takes as transmitted, points upwards.
        let tolerance = if zenith < 75.0 { 1e-3 } else { 5e-3 };
        let twin = Twin::new(&Slab::new(zenith, depth, henyey_greenstein(asymmetry, 1.0)));
        let (cosine, angle) = (cos_deg(zenith), zenith.to_radians());
        let sum = twin.flux(true, angle) + twin.flux(false, angle) + cosine * (-depth / cosine).exp();
        prop_assert!((sum / cosine - 1.0).abs() < tolerance, "{}", sum / cosine);
    }
}

/// How much a texel may change when an argument moves by a ten-thousandth, relative to it and to the sun's 1.
const JUMP: f64 = 5e-3;

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() <= JUMP * a.abs().max(b.abs()) + 1e-5
}

proptest! {
    #![proptest_config(config(16))]

    /// No jump anywhere: in thickness, the sun's height and azimuth, the view.
    #[test]
    fn radiance_is_continuous(
        zenith in prop_oneof![Just(0.0), 0.0..89.9],
        depth in log_uniform(1e-6, 1e4),
        (to, azimuth) in (0.0..89.8, 0.0..360.0),
        view in prop_oneof![Just("below"), Just("above")],
        (asymmetry, albedo) in prop_oneof![Just((0.85, 1.0)), Just((0.0, 0.5))],
    ) {
        let slab = Slab { sky: 0.2, ground: 0.3, ..Slab::new(zenith, depth, henyey_greenstein(asymmetry, albedo)) };
        let radiance = |slab: &Slab, to: f64, azimuth: f64| slab.seen(view, (to, azimuth)).radiance();
        let here = radiance(&slab, to, azimuth);
        let thicker = radiance(&Slab { optical_depth: depth * 1.0001, ..slab.clone() }, to, azimuth);
        prop_assert!(near(here, thicker), "thickness: {here} {thicker}");
        let step = 1e-4 * (90.0 - zenith);
        let lower = radiance(&Slab { zenith_deg: zenith + step, ..slab.clone() }, to, azimuth);
        prop_assert!(near(here, lower), "sun: {here} {lower}");
        let sideways = radiance(&Slab { azimuth_deg: 0.005, ..slab.clone() }, to, azimuth);
        prop_assert!(near(here, sideways), "sun's azimuth: {here} {sideways}");
        let turned = radiance(&slab, to + 1e-4 * (90.0 - to), azimuth);
        prop_assert!(near(here, turned), "view: {here} {turned}");
        // A whole turn is no turn.
        let wrapped = radiance(&slab, to, azimuth - 360.0);
        prop_assert!((here - wrapped).abs() <= 2e-6 * here + 1e-9, "azimuth: {here} {wrapped}");
    }
}

/// The sun through the horizon: light goes to that of the sky without a jump but for what the lowest cosine of the
/// tables, 1e-4, leaves.
#[test]
fn sunset_has_no_jump() {
    for depth in [0.0, 0.1, 5.0] {
        let slab = |zenith| Slab { sky: 0.2, ground: 0.3, ..Slab::new(zenith, depth, henyey_greenstein(0.85, 1.0)) };
        let suns = [89.99, 89.994, 89.995, 89.999, 89.9999, 90.0, 90.1];
        for view in ["below", "above"] {
            let seen = suns.map(|zenith| slab(zenith).seen(view, (50.0, 30.0)).radiance());
            for pair in seen.windows(2) {
                assert!((pair[0] - pair[1]).abs() < 2e-4, "{view} {depth}: {seen:?}");
            }
        }
        let light = suns.map(|zenith| slab(zenith).texture("irradiance", &[])[1]);
        for pair in light.windows(2) {
            assert!((pair[0] - pair[1]).abs() < 2e-4, "{depth}: {light:?}");
        }
    }
}

fn broken(resolution: u32) -> Value {
    let mut scene = Slab { sky: 0.2, ..Slab::new(55.0, 1.0, henyey_greenstein(0.85, 1.0)) }.scene();
    scene["domain"] = json!({ "extent_m": 6400, "resolution": resolution });
    scene["sun"]["azimuth_deg"] = json!(200);
    scene["layers"][0]["droplets"]["extinction_per_m"] = json!(0.02);
    scene["layers"][0]["thickness"] = json!({ "kind": "stratocumulus", "coverage": 0.7, "seed": 3 });
    scene["layers"][0]["wind"] = json!({ "speed_m_s": 10, "from_deg": 270 });
    scene
}

const REQUESTS: [(&str, &[(&str, &str)]); 5] = [
    ("cloud", &[("view", "below"), ("direction", "30,100"), ("method", "analytic")]),
    ("cloud", &[("view", "above"), ("direction", "55,10"), ("tolerance", "0.05")]),
    ("shadow", &[]),
    ("irradiance", &[]),
    ("thickness", &[]),
];

/// Half a tile of wind (320 s at 10 m/s over 6400 m) moves every texture by half its width, also those that were made on
/// coarser grids; a whole tile brings back the same numbers.
#[test]
fn half_a_tile_of_wind_moves_every_texture_by_half_a_tile() {
    const SIDE: usize = 32;
    let scene = broken(SIDE as u32);
    let mut device = device();
    for (texture, query) in REQUESTS {
        let mut at = |time: &str| {
            let query: Vec<_> = query.iter().copied().chain([("time", time)]).collect();
            device.render(&scene, texture, &query).data
        };
        let (start, half, whole) = (at("0"), at("320"), at("640"));
        assert_eq!(start, whole, "{texture}");
        let channels = start.len() / (SIDE * SIDE);
        let most = start.iter().copied().fold(0.0, f32::max);
        for (i, here) in start.iter().enumerate() {
            let (x, rest) = ((i / channels) % SIDE, (i % channels, i / channels / SIDE));
            let moved = half[(rest.1 * SIDE + (x + SIDE / 2) % SIDE) * channels + rest.0];
            // Places on the map are rounded differently: 1e-6 texels of maps that change within one.
            assert!((here - moved).abs() < 1e-4 * most, "{texture} {i}: {here} {moved}");
        }
    }
}

/// Time moves textures without a jump: a thousandth of a second is 1/20,000 of a texel here. A view along the wall of a
/// cloud goes from nothing to black within a tenth of a second, by up to 0.025 in a thousandth.
#[test]
fn textures_are_continuous_in_time() {
    let scene = broken(32);
    let mut device = device();
    for (texture, query) in REQUESTS {
        for time in [0.0, 319.95, 639.95, 1e6] {
            let mut at = |time: f64| {
                let time = time.to_string();
                let query: Vec<_> = query.iter().copied().chain([("time", time.as_str())]).collect();
                device.render(&scene, texture, &query).data
            };
            let (here, later) = (at(time), at(time + 0.001));
            let most = here.iter().copied().fold(0.0, f32::max);
            let change = here.iter().zip(&later).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(change < 0.05 * most, "{texture} at {time}: {change} of {most}");
        }
    }
}

proptest! {
    #![proptest_config(config(8))]

    /// Seen straight up or down, and under a sun in the zenith, no azimuth matters.
    #[test]
    fn azimuth_does_not_matter_at_the_zenith(
        zenith in 0.0..89.9,
        depth in log_uniform(1e-4, 1e3),
        (first, second) in (-360.0..=360.0, -360.0..=360.0),
        view in prop_oneof![Just("below"), Just("above")],
    ) {
        let slab = Slab { sky: 0.2, ground: 0.3, ..Slab::new(zenith, depth, henyey_greenstein(0.85, 1.0)) };
        let straight = |azimuth: f64| slab.seen(view, (0.0, azimuth)).stages.output;
        prop_assert_eq!(straight(first), straight(second));
        // Turning the sun turns its direction's rounding.
        let turned = Slab { azimuth_deg: first, ..slab.clone() }.seen(view, (0.0, 0.0)).radiance();
        let here = slab.seen(view, (0.0, 0.0)).radiance();
        prop_assert!((turned / here - 1.0).abs() < 1e-5, "{turned} {here}");
        let noon = Slab { zenith_deg: 0.0, ..slab };
        let (a, b) = (noon.seen(view, (zenith, first)).radiance(), noon.seen(view, (zenith, second)).radiance());
        prop_assert!((a / b - 1.0).abs() < 1e-5, "{a} {b}");
    }

    /// Reciprocity of the method's low orders over all pairs of directions: I(v, l) / mu_l = I(l, v) / mu_v.
    #[test]
    fn low_orders_are_reciprocal(
        (sun, view) in (0.0..89.0, 0.0..89.0),
        depth in log_uniform(1e-5, 100.0),
        azimuth in 30.0..180.0,
        from_above in any::<bool>(),
    ) {
        let side = if from_above { "above" } else { "below" };
        let parts = |l: f64, v: f64| {
            let mut seen = Slab::new(l, depth, henyey_greenstein(0.5, 0.9)).seen(side, (v, azimuth));
            // The closure's factors belong to one sun: without them.
            let rows = seen.stages.closure.data.len() / 6;
            (0..6).for_each(|row| {
                let value = if row % 3 == 2 { 0.0 } else { 1.0 };
                seen.stages.closure.data[row * rows..(row + 1) * rows].fill(value);
            });
            let found = seen.expected_parts();
            [found.order1, found.order2].map(|part| part / cos_deg(l))
        };
        for (forth, back) in parts(sun, view).into_iter().zip(parts(view, sun)) {
            prop_assert!((forth - back).abs() <= 1e-4 * forth.abs(), "{forth} {back}");
        }
    }
}
