//! What holds exactly: reciprocity, symmetry, continuity, limits, storage.

use std::f64::consts::PI;
use std::sync::{LazyLock, Mutex};

use skyloom::slab::radiance::{Aureole, RadianceTable, Side, TableSize};

use crate::{CLOUD, Medium, Random, cosine};

static TABLE: LazyLock<RadianceTable> = LazyLock::new(|| CLOUD[1].table(TableSize::FINE));

#[test]
fn light_may_go_both_ways() {
    let mut random = Random(3);
    for _ in 0..2000 {
        let depth = (22.0 * random.next() - 6.0).exp2();
        let (a, b, azimuth) = (cosine(90.0 * random.next()), cosine(90.0 * random.next()), PI * random.next());
        for side in Side::BOTH {
            let there = TABLE.remainder(side, depth, a, b, azimuth) / a;
            let back = TABLE.remainder(side, depth, b, a, azimuth) / b;
            assert!((there - back).abs() <= 1e-9 * there, "{side:?} {depth} {a} {b}: {there} {back}");
        }
    }
}

#[test]
fn nothing_is_negative() {
    let green = &CLOUD[1];
    let aureole = green.aureole();
    let completion = green.completion(TABLE.scaling(), &aureole);
    let mut random = Random(4);
    for _ in 0..20 {
        let mu_sun = cosine(90.0 * random.next());
        let slice = TABLE.slice(mu_sun, 0.5 + random.next());
        assert!(Side::BOTH.iter().all(|side| slice.texels(*side).iter().all(|value| *value >= 0.0)));
        for _ in 0..500 {
            let depth = (30.0 * random.next() - 12.0).exp2();
            let (mu_view, azimuth) = (cosine(90.0 * random.next()), PI * random.next());
            for side in Side::BOTH {
                let remainder = slice.remainder(side, depth, mu_view, azimuth);
                let whole = completion.radiance(side, remainder, depth, mu_sun, mu_view, azimuth);
                assert!(remainder >= 0.0 && whole >= 0.0 && whole.is_finite());
            }
        }
    }
}

#[test]
fn azimuth_means_nothing_at_the_zenith() {
    for (mu_sun, mu_view) in [(1.0, 0.4), (0.4, 1.0), (1.0, 1.0)] {
        let slice = TABLE.slice(mu_sun, 1.01);
        for side in Side::BOTH {
            for depth in [0.01, 0.7, 12.0, 500.0] {
                let first = slice.remainder(side, depth, mu_view, 0.0);
                for step in 0..50 {
                    let azimuth = PI * f64::from(step) / 50.0;
                    let value = slice.remainder(side, depth, mu_view, azimuth);
                    assert!((value / first - 1.0).abs() < 1e-6, "{side:?} {mu_sun} {mu_view} {depth}");
                }
            }
        }
    }
}

#[test]
fn steps_are_small() {
    // Relative change of the remainder per step; more where the scale (the second numbers) changes fast.
    let smooth = |what: &str, limit: f64, values: &[(f64, f64)]| {
        for (step, pair) in values.windows(2).enumerate() {
            let [(a, mu_a), (b, mu_b)] = [pair[0], pair[1]];
            let allowed = limit + 2.5 * (mu_a / mu_b - 1.0).abs();
            assert!((b / a - 1.0).abs() <= allowed, "{what}, step {step}: {a} {b}");
        }
    };
    let lowest = cosine(89.9);
    for side in Side::BOTH {
        for (sun, view, azimuth) in [(0.0, 30.0, 1.0), (60.0, 60.0, 0.0), (87.0, 85.0, 0.0), (70.0, 20.0, PI)] {
            let slice = TABLE.slice(cosine(sun), 1.005);
            // 0.2 % in depth, from far below the first node to far above the last.
            let of_depth = |k: i32| {
                let depth = (f64::from(k) / 350.0).exp2();
                let fall = TABLE.scaling().fall(TABLE.scaling().depth_scale * depth);
                (slice.remainder(side, depth, cosine(view), azimuth), fall)
            };
            smooth("depth", 0.012, &(-10 * 350..20 * 350).map(of_depth).collect::<Vec<_>>());
            for depth in [1e-3, 0.3, 4.0, 64.0, 1e4] {
                let of_view = |k: i32| {
                    let mu_view = cosine(0.05 * f64::from(k));
                    (slice.remainder(side, depth, mu_view, azimuth), mu_view.max(lowest))
                };
                smooth("view", 0.03, &(0..=1800).map(of_view).collect::<Vec<_>>());
                let of_azimuth = |k: i32| (slice.remainder(side, depth, cosine(view), 0.002 * f64::from(k)), 1.0);
                smooth("azimuth", 0.05, &(0..3200).map(of_azimuth).collect::<Vec<_>>());
                // Past the last node too, where the irradiance goes to 0.
                let of_sun = |k: i32| {
                    let mu_sun = cosine(0.05 * f64::from(k));
                    let remainder = TABLE.slice(mu_sun, 1.0).remainder(side, depth, cosine(view), azimuth);
                    (remainder / mu_sun, mu_sun.max(lowest))
                };
                for first in (0..1799).step_by(100) {
                    smooth("sun", 0.03, &[of_sun(first), of_sun(first + 1)]);
                }
                smooth("sun", 0.03, &(1780..1800).map(of_sun).collect::<Vec<_>>());
            }
        }
    }
}

#[test]
fn limits_of_depth() {
    let slice = TABLE.slice(0.5, 1.0);
    for side in Side::BOTH {
        for depth in [0.0, -3.0, f64::NAN] {
            assert_eq!(slice.remainder(side, depth, 0.5, 1.0), 0.0);
        }
        // Order 2 goes as the square of the depth.
        let ratio = slice.remainder(side, 2e-6, 0.5, 1.0) / slice.remainder(side, 1e-6, 0.5, 1.0);
        assert!((ratio - 4.0).abs() < 1e-4, "{ratio}");
        assert!(slice.remainder(side, f64::INFINITY, 0.5, 1.0).is_finite());
        assert_eq!(TABLE.slice(0.0, 1.0).remainder(side, 1.0, 0.5, 1.0), 0.0);
        assert_eq!(TABLE.slice(-0.5, 1.0).remainder(side, 1.0, 0.5, 1.0), 0.0);
    }
    // Without absorption, what passes a thick slab goes as the inverse of the depth.
    let pure = Medium::henyey_greenstein(1.0, 0.85).table(TableSize::COARSE);
    let through = |depth: f64| pure.remainder(Side::Transmitted, depth, 0.5, 0.5, 1.0);
    assert!((through(4e4) / through(8e4) - 2.0).abs() < 2e-3);
    assert!((through(4e6) / through(8e6) - 2.0).abs() < 2e-3);
}

#[test]
fn media_that_do_not_scatter_or_not_forward() {
    let black = Medium { albedo: 0.0, ..Medium::henyey_greenstein(0.0, 0.85) };
    let table = black.table(TableSize::COARSE);
    let aureole = black.aureole();
    let completion = black.completion(table.scaling(), &aureole);
    for side in Side::BOTH {
        for depth in [0.01, 1.0, 1e3] {
            let remainder = table.remainder(side, depth, 0.5, 0.6, 0.0);
            assert_eq!(completion.radiance(side, remainder, depth, 0.5, 0.6, 0.0), 0.0);
        }
    }
    for g in [0.0, -0.5, 0.99] {
        let medium = Medium::henyey_greenstein(0.99, g);
        let table = medium.table(TableSize::COARSE);
        let aureole = medium.aureole();
        assert!(
            Side::BOTH.iter().all(|side| table.slice(0.6, 1.0).texels(*side).iter().all(|value| value.is_finite()))
        );
        assert!(aureole.texels().iter().all(|value| value.is_finite()));
        // No peak, no correction.
        assert!(g > 0.9 || aureole.texels().iter().all(|value| value.abs() < 1e-6));
    }
}

#[test]
fn slices_meet_the_table_at_its_suns() {
    let size = TABLE.size();
    for node in [0, 1, 20, size.zeniths - 2, size.zeniths - 1] {
        let mu_sun = size.zenith(node).cos();
        let slice = TABLE.slice(mu_sun, 1.0);
        for side in Side::BOTH {
            for (depth, mu_view, azimuth) in [(0.2, 0.9, 0.3), (5.0, 0.3, 2.0), (900.0, 0.6, 1.0)] {
                let (a, b) = (
                    slice.remainder(side, depth, mu_view, azimuth),
                    TABLE.remainder(side, depth, mu_sun, mu_view, azimuth),
                );
                assert!((a / b - 1.0).abs() < 1e-5, "{node} {side:?}: {a} {b}");
            }
        }
    }
}

#[test]
fn result_does_not_depend_on_threads_and_progress_rises() {
    let medium = &CLOUD[1];
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let heard = Mutex::new(Vec::new());
    let alone = one.install(|| {
        RadianceTable::build(medium.albedo, &medium.moments, TableSize::COARSE, &|part| {
            heard.lock().unwrap().push(part)
        })
    });
    assert!(alone == medium.table(TableSize::COARSE));
    let heard = heard.into_inner().unwrap();
    assert!(heard.windows(2).all(|pair| pair[0] <= pair[1]) && heard.last() == Some(&1.0) && heard.len() > 10);
}

#[test]
fn tables_survive_storage() {
    let table = CLOUD[1].table(TableSize::COARSE);
    let bytes = table.to_bytes();
    assert!(RadianceTable::from_bytes(&bytes).unwrap() == table);
    assert!(RadianceTable::from_bytes(&bytes[..bytes.len() - 1]).is_none());
    assert!(RadianceTable::from_bytes(&[]).is_none());
    let with = |at: usize, new: &[u8]| {
        let mut bytes = bytes.clone();
        bytes[at..at + new.len()].copy_from_slice(new);
        RadianceTable::from_bytes(&bytes)
    };
    assert!(with(200, &f32::NAN.to_le_bytes()).is_none());
    assert!(with(200, &(-1f32).to_le_bytes()).is_none());
    assert!(with(4, &u32::MAX.to_le_bytes()).is_none());
    assert!(with(12, &f64::NAN.to_le_bytes()).is_none());
    let aureole = CLOUD[1].aureole();
    let bytes = aureole.to_bytes();
    assert!(Aureole::from_bytes(&bytes).unwrap() == aureole);
    assert!(Aureole::from_bytes(&bytes[1..]).is_none());
}
