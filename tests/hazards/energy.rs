//! Hazards of energy: light that is negative, counted twice, or lost.

use crate::setup::{Parts, SHADER, Slab, cos_deg, device, henyey_greenstein};
use serde_json::json;
use skyloom::gpu::layout::MIN_COSINE;
use skyloom::optics::gauss_legendre;
use skyloom::render::Stages;
use skyloom::slab::closure::{LowOrders, Totals};
use skyloom::slab::fluxes::FluxTable;
use skyloom::slab::phases::{AUREOLE_COLUMNS, AUREOLE_HALF_SIN_MAX, AUREOLE_LOG2_MIN, PEAK_DEG, phase_angle};
use skyloom::tables::MixTables;
use std::f64::consts::PI;
use std::sync::Arc;

const SUNS: [f64; 7] = [0.0, 30.0, 60.0, 75.0, 84.0, 89.0, 89.9];

fn stages(zenith_deg: f64, asymmetry: f64, albedo: f64) -> (Stages, Arc<MixTables>) {
    let mut device = device();
    let slab = Slab::new(zenith_deg, 1.0, henyey_greenstein(asymmetry, albedo));
    let job = device.job(&slab.scene(), "cloud", &[("method", "analytic")]);
    (device.renderer.inspect(&job, &Default::default()).unwrap(), Arc::clone(&job.tables()[0]))
}

/// The closure of every mix, sun and depth: calls `each` with the column of the texture and its six rows.
fn closures(mut each: impl FnMut(&Stages, usize, [f64; 6])) {
    for (asymmetry, albedo) in [(0.85, 1.0), (0.2, 0.9), (0.95, 1.0), (-0.5, 1.0)] {
        for zenith in SUNS {
            let (stages, _) = stages(zenith, asymmetry, albedo);
            let width = stages.closure.width as usize;
            for column in 0..width {
                let row = |row: usize| f64::from(stages.closure.data[4 * (row * width + column) + 1]);
                each(&stages, column, std::array::from_fn(row));
            }
        }
    }
}

/// 8: what orders 1 and 2 leave to the higher orders must not be negative, which would make dark rims of thin edges.
#[test]
fn hazard_08_higher_orders_are_never_negative() {
    let (mut full, mut cut) = (0, 0);
    closures(|stages, column, [one, two, higher, one_through, two_through, higher_through]| {
        for factor in [one, two, one_through, two_through] {
            assert!((0.0..=1.0).contains(&factor), "sun {:?}, column {column}: {factor}", stages.frame.sun);
            if factor < 1.0 { cut += 1 } else { full += 1 }
        }
        for flux in [higher, higher_through] {
            assert!((0.0..=1.0).contains(&flux), "sun {:?}, column {column}: {flux}", stages.frame.sun);
        }
    });
    assert!(cut > 100 && full > 100, "both cases occur: {cut} {full}");
    // And rims as they come out.
    for zenith in [0, 30, 70, 85, 89] {
        let mut scene = Slab::new(zenith.into(), 1.0, henyey_greenstein(0.85, 1.0)).scene();
        scene["domain"]["resolution"] = json!(32);
        scene["layers"][0]["thickness"] = json!({ "kind": "stratocumulus", "coverage": 0.5, "mean_m": 1000 });
        for view in ["below", "above"] {
            let cloud = device().render(&scene, "cloud", &[("view", view), ("direction", "40,60")]).data;
            assert!(cloud.iter().all(|value| *value >= 0.0 && value.is_finite()), "sun {zenith} {view}");
        }
    }
}

/// 10: all orders of both sides, and what is absorbed, add up to 1 for every sun and depth.
#[test]
fn hazard_10_orders_add_up_to_one() {
    /// Factors and fluxes were rounded to single precision, and so were the phase functions (2048 columns).
    const ROUNDED: f64 = 1e-6;
    for (asymmetry, albedo) in [(0.85, 1.0), (0.2, 0.9)] {
        for zenith in SUNS {
            let (stages, tables) = stages(zenith, asymmetry, albedo);
            let phase = |row: usize, angle: f64| {
                let half_sin = (0.5 * angle).sin();
                let side = |side: f64| 0.5 * (side * 2f64.sqrt()).sqrt();
                let place = if angle < PI / 2.0 { side(half_sin) } else { 1.0 - side((0.5 * angle).cos()) };
                let map = &stages.tables.phase;
                let place = (place * f64::from(map.width - 1)).clamp(0.0, f64::from(map.width - 1));
                let low = (place as usize).min(map.width as usize - 2);
                let at = |x: usize| f64::from(map.data[4 * (row * map.width as usize + x) + 1]);
                at(low) + (at(low + 1) - at(low)) * (place - low as f64)
            };
            let forward = albedo * tables.phases[1].forward_fraction;
            // In double precision, as the closure is.
            let sun = cos_deg(zenith).max(MIN_COSINE.into());
            let low = LowOrders {
                totals: Totals::Exact(&tables.fluxes[1]),
                albedo: (albedo - forward) / (1.0 - forward),
                forward_fraction: forward,
                forward_edge: PEAK_DEG.to_radians(),
                order1_phase: &|angle| phase(0, angle),
                order2_phase: &|angle| phase(1, angle),
            };
            let depths = FluxTable::optical_depths();
            for (column, orders) in low.fluxes(&depths, sun).iter().enumerate() {
                let width = stages.closure.width as usize;
                let row = |row: usize| f64::from(stages.closure.data[4 * (row * width + column) + 1]);
                let up = row(0) * orders.reflected[0] + row(1) * orders.reflected[1] + row(2);
                let through = row(3) * orders.transmitted[0] + row(4) * orders.transmitted[1] + row(5);
                let straight = (-(1.0 - forward) * depths[column] / sun).exp();
                let absorbed = tables.fluxes[1].absorptance(depths[column], sun);
                let sum = up + through + straight + absorbed;
                assert!((sum - 1.0).abs() < ROUNDED, "g {asymmetry}, sun {zenith}, depth {}: {sum}", depths[column]);
            }
        }
    }
}

/// 11: unscattered light is counted once. Alpha takes the unscattered part of what lies behind, so light of the sky seen
/// through a cloud and the sky itself add up to the exact transmittance; and light of the forward peak adds up to what
/// the peak took from the beam (the published sum of order 0 has 1.29 of the light at some depths).
#[test]
fn hazard_11_unscattered_light_is_counted_once() {
    for depth in [1e-3, 0.1, 0.5, 2.0, 3.68, 20.0] {
        for view in [0.0, 40.0, 80.0] {
            let slab = Slab { sky: 1.0, ..Slab::new(90.0, depth, henyey_greenstein(0.85, 1.0)) };
            let seen = slab.seen("below", (view, 0.0));
            let all = seen.radiance() + (1.0 - seen.alpha());
            let exact = seen.tables.fluxes[1].transmittance(seen.depth(), cos_deg(view));
            assert!((all - exact).abs() < SHADER, "depth {depth}, view {view}: {all} {exact}");
        }
    }
    // The aureole over all angles. Its table ends at 40 degrees and is linear between 256 angles.
    const TABLE: f64 = 2e-3;
    let (stages, tables) = stages(30.0, 0.85, 0.9);
    let map = &stages.tables.aureole;
    let forward = 0.9 * tables.phases[1].forward_fraction;
    let angle = |column: usize| {
        let place = column as f64 / (AUREOLE_COLUMNS - 1) as f64;
        2.0 * (place * place * AUREOLE_HALF_SIN_MAX).asin()
    };
    for row in 0..48 {
        let path = (AUREOLE_LOG2_MIN + row as f64 / 4.0).exp2();
        let value = |column: usize| f64::from(map.data[4 * (row * AUREOLE_COLUMNS + column) + 1]);
        let panel = |i: usize| {
            let (a, b) = (angle(i), angle(i + 1));
            PI * (b - a) * (a.sin() * value(i) + b.sin() * value(i + 1))
        };
        let flux: f64 = path * (0..AUREOLE_COLUMNS - 1).map(panel).sum::<f64>();
        // Times e^-(1 - forward) path: that factor is the shader's.
        let exact = -(-forward * path).exp_m1();
        assert!((flux / exact - 1.0).abs() < TABLE, "path {path}: {flux} {exact}");
    }
}

/// 18: reciprocity. Sky light seen from above is the plane albedo at the view angle, and its mean over all views the
/// reflected part of even light; single scattering keeps I(v, l) / mu_l = I(l, v) / mu_v.
#[test]
fn hazard_18_reciprocity() {
    let droplets = henyey_greenstein(0.85, 0.9);
    for depth in [0.2, 2.0, 30.0] {
        let slab = Slab { sky: 1.0, ..Slab::new(90.0, depth, droplets.clone()) };
        let (nodes, weights) = gauss_legendre(12);
        let mean: f64 = nodes
            .iter()
            .zip(&weights)
            .map(|(x, w)| {
                let mu = 0.5 + 0.5 * x;
                w * mu * slab.seen("above", (mu.acos().to_degrees(), 0.0)).radiance()
            })
            .sum();
        // Two tables of the same solution; linear between 65 cosines.
        let even = slab.seen("above", (0.0, 0.0)).tables.fluxes[1].reflectance_diffuse(depth);
        assert!((mean - even).abs() < 5e-4, "depth {depth}: {mean} {even}");
    }
    // What the device renders by tables, all orders together: light may go both ways through an even slab. The slice's texels
    // are square roots in half floats, 1e-3 of the light, twice. Below depth 100 of this absorbing cloud 1e-12 of the light
    // is left, whose root such texels cannot hold with any digits.
    for (view, depths) in [("above", [0.1, 1.0, 10.0, 300.0]), ("below", [0.1, 1.0, 10.0, 50.0])] {
        for depth in depths {
            for (a, b, azimuth) in [(20.0, 70.0, 130.0), (50.0, 85.0, 75.0), (0.0, 60.0, 0.0), (75.0, 80.0, 20.0)] {
                let at = |sun: f64, to: f64| {
                    let query: &[(&str, &str)] = &[("method", "tabulated")];
                    Slab::new(sun, depth, droplets.clone()).seen_by(view, (to, azimuth), query).radiance()
                        / cos_deg(sun)
                };
                let (forth, back) = (at(a, b), at(b, a));
                assert!((forth / back - 1.0).abs() < 4e-3, "{view} {depth} {a} {b}: {forth} {back}");
            }
        }
    }
    // Order 1 is reciprocal; the closure's factors, and with them the other orders, belong to one sun.
    for (view, other_azimuth) in [("above", 130.0), ("below", 130.0)] {
        for (a, b) in [(20.0, 70.0), (50.0, 85.0)] {
            let at = |sun: f64, to: f64| {
                let seen = Slab::new(sun, 1e-3, droplets.clone()).seen(view, (to, other_azimuth));
                let factor = seen.closure(if view == "above" { 0 } else { 3 });
                let Parts { order2, higher, .. } = seen.expected_parts();
                (seen.radiance() - order2 - higher) / factor / cos_deg(sun)
            };
            let (forth, back) = (at(a, b), at(b, a));
            assert!((forth / back - 1.0).abs() < 1e-4, "{view} {a} {b}: {forth} {back}");
        }
    }
}

/// 19: nothing is absorbed. Solvers by eigenvalues are singular there; doubling keeps R + T = 1 at every depth, also in
/// the textures that the device reads, where 1 - R must not be formed as a difference.
#[test]
fn hazard_19_albedo_of_exactly_one() {
    let (stages, tables) = stages(30.0, 0.85, 1.0);
    for depth in FluxTable::optical_depths() {
        for mu in [1e-4, 0.01, 0.3, 1.0] {
            let flux = tables.fluxes[1].beam(depth, mu);
            assert!((flux.reflectance + flux.transmittance - 1.0).abs() < 1e-12, "{depth} {mu}: {flux:?}");
            assert_eq!(flux.absorptance, 0.0);
        }
    }
    let (reflected, transmitted) = (&stages.tables.reflectance.data, &stages.tables.transmittance.data);
    assert!(reflected.iter().zip(transmitted).step_by(4).all(|(r, t)| (r + t - 1.0).abs() < 2e-7));
    let (through, not_reflected) = stages.tables.diffuse.data.split_at(stages.tables.diffuse.data.len() / 2);
    for (t, kept) in through.iter().zip(not_reflected).step_by(4) {
        assert!((kept / t - 1.0).abs() < 3e-7 && *t > 0.0, "{t} {kept}");
    }
    // Against the same mix with next to no absorption: no jump at 1.
    let almost = FluxTable::build(1.0 - 1e-9, &tables.channels[1].moments, &|_| ());
    for depth in [0.1, 10.0, 100.0] {
        let (one, near) = (tables.fluxes[1].beam(depth, 0.5), almost.beam(depth, 0.5));
        assert!((one.transmittance - near.transmittance).abs() < 1e-6, "{depth}: {one:?} {near:?}");
    }
    // The angles of the phase table span the sphere.
    assert!(phase_angle(0) == 0.0 && (phase_angle(2047) - PI).abs() < 1e-12);
}
