//! Hazards of the closed forms of orders 1 and 2: equal cosines, thin and thick slabs.

use crate::setup::{METHODS, SHADER, Slab, cos_deg, henyey_greenstein};
use serde_json::{Value, json};
use skyloom::reference::slab::{slab_order2_reflected, slab_order2_transmitted};
use skyloom::slab::analytic::{order2_reflected, order2_transmitted};
use skyloom::slab::fluxes::FluxTable;
use std::f64::consts::PI;

/// Light that scatters once goes at least 90 degrees away (`back`) or at most 90: where the other side is seen, only
/// orders from 2 on arrive.
fn half_sphere(back: bool) -> Value {
    let (ahead, behind) = if back { (0, 1) } else { (1, 0) };
    json!({ "phase_function": [[0, ahead], [85, ahead], [90, behind], [180, behind]], "albedo": 1 })
}

/// 1: views at the sun's own height and close to it, seen through the cloud. The limit is `b e^-b` and `b^2/2 e^-b`,
/// b = depth / mu.
#[test]
fn hazard_01_view_equals_sun_in_transmission() {
    for zenith in [30.0, 60.0, 80.0] {
        for depth in [0.01, 0.1, 1.0] {
            let slab = Slab::new(zenith, depth, henyey_greenstein(0.2, 0.9));
            for offset in [0.0, 1e-6, 1e-5, 1e-4, 1e-3, 0.01, 0.1, 1.0, -1e-5, -1e-3, -1.0] {
                // Seen 110 degrees off the sun's azimuth: no light of the forward peak.
                let seen = slab.seen("below", (zenith + offset, 70.0));
                let parts = seen.expected_parts();
                assert!(parts.order1 > 0.02 * parts.sum(), "order 1 is what this is about: {parts:?}");
                seen.check(parts.sum());
                if offset == 0.0 {
                    let b = seen.path().view;
                    let limit = seen.expected(|_| [b * (-b).exp(), 0.5 * b * b * (-b).exp()]);
                    seen.check(limit.sum());
                }
            }
        }
    }
}

/// 2: thin slabs. Light goes to `albedo P depth / (4 pi mu_v)` on both sides and alpha to `depth / mu_v`, with all
/// digits, so that colour over alpha keeps its value.
#[test]
fn hazard_02_thin_slab_is_linear_in_depth() {
    /// What the first neglected term, x / 2, may be at the thickest slab here.
    const SECOND_TERM: f64 = 2e-4;
    for (view, method) in ["below", "above"].into_iter().flat_map(|view| METHODS.map(|method| (view, method))) {
        for depth in [1e-4, 1e-5, 1e-6, 1e-7, 1e-9] {
            let seen = Slab::new(40.0, depth, henyey_greenstein(0.2, 0.9)).seen_by(view, (65.0, 70.0), method);
            let path = seen.depth() / cos_deg(65.0);
            if method == METHODS[0] {
                seen.check(seen.expected_parts().sum());
            }
            // P of the whole function: outside the peak the remainder carries it, 1 - albedo * forward times denser.
            let cosine = seen.angle().cos();
            let whole = (1.0 - 0.04) / (1.0 + 0.04 - 0.4 * cosine).powf(1.5) / (4.0 * PI);
            let limit = 0.9 * whole * path;
            // The table of phase functions and orders 2 and up.
            assert!(
                (seen.radiance() / limit - 1.0).abs() < 2e-3,
                "{method:?} {view} {depth}: {} {limit}",
                seen.radiance()
            );
            assert!((seen.alpha() / path - 1.0).abs() < SHADER + SECOND_TERM, "{view} {depth}: {}", seen.alpha());
        }
    }
}

/// 3: order 2 of a thin slab seen from the sunlit side, `1 - (1 + x) e^-x`, goes to `x^2 / 2`. With droplets that
/// scatter forward only, nothing of order 1 hides it.
#[test]
fn hazard_03_second_order_reflected_by_a_thin_slab() {
    for depth in [0.5, 0.1, 0.03, 0.01, 3e-3, 1e-3] {
        let seen = Slab::new(30.0, depth, half_sphere(false)).seen("above", (50.0, 20.0));
        let parts = seen.expected_parts();
        assert!(parts.order1 < 1e-6 * parts.sum() && parts.order2 > 0.05 * parts.sum(), "{depth}: {parts:?}");
        seen.check(parts.sum());
        if depth < 0.02 {
            let x = |path: crate::setup::Path| path.view + path.sun;
            // 0.5 mu_l / (mu_l + mu_v) is 0.5 b / x.
            let limit = seen.expected(|path| [0.0, 0.5 * path.view * (0.5 * x(path) - x(path).powi(2) / 3.0)]);
            let next = x(seen.path()).powi(2) / 4.0;
            assert!((limit.sum() / seen.radiance() - 1.0).abs() < next + SHADER, "{depth}: {limit:?}");
        }
    }
}

/// 4: the published closed form of the other half of order 2 (scattered back twice) goes as `2x - 1 + e^-2x` and is not
/// used; what stands for it, order 2 seen from the far side, must go to `b (a + b) / 4` as well.
#[test]
fn hazard_04_second_order_transmitted_by_a_thin_slab() {
    for depth in [0.5, 0.1, 0.03, 0.01, 3e-3, 1e-3] {
        let seen = Slab::new(30.0, depth, half_sphere(true)).seen("below", (50.0, 200.0));
        let parts = seen.expected_parts();
        assert!(parts.order1 < 1e-6 * parts.sum() && parts.order2 > 0.05 * parts.sum(), "{depth}: {parts:?}");
        assert!(seen.angle() > 20f64.to_radians(), "clear of the forward peak's light");
        seen.check(parts.sum());
        if depth < 0.02 {
            let limit = seen.expected(|path| [0.0, 0.25 * path.view * (path.view + path.sun)]);
            // The next terms are of relative order a and b.
            let next = seen.path().view + seen.path().sun;
            assert!((limit.sum() / seen.radiance() - 1.0).abs() < next, "{depth}: {limit:?}");
        }
    }
}

/// 9: order 2 vanishes as the square of the depth (the published term goes as the depth itself): halving the depth
/// quarters it, in the shaders' twin and in both precisions of the closed forms.
#[test]
fn hazard_09_second_order_vanishes_as_the_square_of_depth() {
    type Order = fn(f64) -> f64;
    let forms: [(&str, Order); 6] = [
        ("twin, reflected", |t| slab_order2_reflected(t / 0.8, t / 0.3)),
        ("twin, transmitted", |t| slab_order2_transmitted(t / 0.8, t / 0.3)),
        ("reflected", |t| order2_reflected(t, 0.8, 0.3)),
        ("transmitted", |t| order2_transmitted(t, 0.8, 0.3)),
        ("reflected, single", |t| order2_reflected(t as f32, 0.8, 0.3).into()),
        ("transmitted, single", |t| order2_transmitted(t as f32, 0.8, 0.3).into()),
    ];
    for (name, order) in forms {
        for depth in [1e-2, 1e-4, 1e-6, 1e-9] {
            let ratio = order(depth) / order(0.5 * depth);
            // The next term: (a + b) / 3 and less, halved.
            assert!((ratio / 4.0 - 1.0).abs() < 2.0 * depth + 1e-5, "{name} at {depth}: {ratio}");
        }
    }
    // And on the device, where order 2 is all but alone.
    let at = |depth| Slab::new(30.0, depth, half_sphere(true)).seen("below", (50.0, 200.0));
    let without_higher = |depth| {
        let seen = at(depth);
        seen.radiance() - seen.expected_parts().higher
    };
    let ratio = without_higher(0.01) / without_higher(0.005);
    assert!((ratio / 4.0 - 1.0).abs() < 0.02, "{ratio}");
}

/// 12: exponentials of thick slabs vanish. Seen from below the flux tables' light remains; from above the single
/// scattering of a half space. Nothing is NaN.
#[test]
fn hazard_12_thick_slab() {
    for depth in [60.0, 90.0, 110.0, 1000.0, 1e5] {
        let slab = Slab::new(40.0, depth, henyey_greenstein(0.2, 1.0));
        let below = slab.seen("below", (60.0, 70.0));
        below.check(below.expected(|_| [0.0, 0.0]).sum());
        assert!(below.radiance() > 0.0);
        let above = slab.seen("above", (60.0, 70.0));
        let half_space = cos_deg(40.0) / (cos_deg(40.0) + cos_deg(60.0));
        let parts = above.expected(|_| [half_space, 0.5 * half_space]);
        assert!(parts.order1 > 0.1 * parts.sum(), "{parts:?}");
        above.check(parts.sum());
        assert_eq!((below.alpha(), above.alpha()), (1.0, 1.0));
        let [shadow] = slab.texture("shadow", &[("peak", "false")])[..] else { panic!("one texel") };
        assert!((0.0..1e-20).contains(&shadow), "{shadow}");
    }
    // Transmitted light falls as 1 / (depth + constant), in the tables of radiance up to the half floats they are kept in.
    for (method, tolerance) in METHODS.into_iter().zip([1e-3, 1e-2]) {
        let slab = |depth| Slab::new(40.0, depth, henyey_greenstein(0.2, 1.0));
        let at = |depth| 1.0 / slab(depth).seen_by("below", (60.0, 70.0), method).radiance();
        let (first, second, third) = (at(512.0), at(1024.0), at(2048.0));
        let ratio = (third - second) / (second - first) / 2.0;
        assert!((ratio - 1.0).abs() < tolerance, "{method:?}: {first} {second} {third}");
    }
}

/// 20: depths beyond both ends of the tables, cosines beyond theirs. Below the first depth all is proportional to
/// depth; the last row stands for what is deeper; lower cosines count as the last.
#[test]
fn hazard_20_edges_of_the_tables() {
    let first = 2f64.powi(-16);
    for view in ["below", "above"] {
        let per_depth = |depth: f64| {
            let slab = Slab { sky: 1.0, ground: 0.5, ..Slab::new(40.0, depth, henyey_greenstein(0.2, 0.9)) };
            slab.seen(view, (60.0, 70.0)).radiance() / depth
        };
        let edge = per_depth(first);
        for depth in [first * 1.001, first * 0.999, first / 7.0] {
            // Light of the sky is a difference of numbers near 1: what rounding leaves of it.
            let cancelled = 2.0 / 16_777_216.0 / depth;
            let sunny = Slab::new(40.0, depth, henyey_greenstein(0.2, 0.9)).seen(view, (60.0, 70.0));
            sunny.check(sunny.expected_parts().sum());
            let error = (per_depth(depth) - edge).abs();
            assert!(error < 3.0 * cancelled + 2e-3 * edge, "{view} {depth}: {} {edge}", per_depth(depth));
        }
    }
    let table = FluxTable::build(1.0, &[1.0], &|_| ());
    let last = 2f64.powi(17);
    for mu in [1.0, 0.1, 1e-4] {
        for depth in [last, 2.0 * last, 1e9, f64::INFINITY] {
            let flux = table.beam(depth, mu);
            assert_eq!(flux, table.beam(last, mu));
            assert!((flux.reflectance + flux.transmittance - 1.0).abs() < 1e-12 && flux.transmittance < 2e-5);
        }
    }
    assert_eq!(table.beam(1.0, 1e-9), table.beam(1.0, 1e-4));
    // Deeper than the last row on the device: water of 50 um, 10,000 per cubic centimetre, has 157 per metre.
    let slab = Slab::new(89.999, 1e5, henyey_greenstein(0.2, 1.0));
    for view in ["below", "above"] {
        let radiance = slab.seen(view, (89.9, 10.0)).radiance();
        assert!((0.0..0.01).contains(&radiance), "{view} {radiance}");
    }
}
