//! Films of drifting clouds: what changes from frame to frame is what the wind moves.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]
#![allow(clippy::print_stdout, reason = "how far each comparison is off")]

mod common;

use common::sky::{Sky, hg_layer};
use serde_json::{Value, json};

/// Picture of far clouds: from 2 to 8 degrees of elevation, 24 degrees wide, texels of half a degree; and so many times finer a side.
const ROWS: usize = 12;
const COLUMNS: usize = 48;
const FINER: usize = 6;

fn scene() -> Value {
    let field = json!({ "kind": "stratocumulus", "pattern": "open", "mean_m": 250, "coverage": 0.5, "cell_m": 3000, "seed": 7 });
    let mut layer = hg_layer(field, 0.04, 1.0);
    layer["wind"] = json!({ "speed_m_s": 10, "from_deg": 250 });
    json!({
        "domain": { "extent_m": 20_000, "resolution": 256 },
        "sun": { "zenith_deg": 50, "azimuth_deg": 150 },
        "atmosphere": "clear", "ground": { "albedo": 0.1 }, "layers": [layer],
    })
}

/// Green light of each texel of a frame, as the mean of so many texels a side.
fn frame(sky: &mut Sky, scene: &Value, time_s: f64, look: &str, finer: usize) -> Vec<f64> {
    let (time, size) = (time_s.to_string(), (ROWS * finer).to_string());
    let query =
        [("projection", "camera"), ("look", look), ("fov", "6"), ("aspect", "4"), ("size", &*size), ("time", &*time)];
    let found = sky.render(scene, "sky", &query);
    let mut sums = vec![0.0; ROWS * COLUMNS];
    for (i, texel) in found.data.chunks_exact(3).enumerate() {
        let (x, y) = (i % (COLUMNS * finer) / finer, i / (COLUMNS * finer) / finer);
        sums[y * COLUMNS + x] += f64::from(texel[1]) / (finer * finer) as f64;
    }
    sums
}

fn rms(values: impl Iterator<Item = f64> + Clone) -> f64 {
    (values.clone().map(|value| value * value).sum::<f64>() / values.count() as f64).sqrt()
}

/// Rms change from frame to frame of the mean light, of a second, and of the difference from another film.
fn changes(film: &[Vec<f64>], fine: &[Vec<f64>]) -> [f64; 2] {
    let mean = fine[0].iter().sum::<f64>() / fine[0].len() as f64;
    let frames = film.windows(2).zip(fine.windows(2));
    let [mut change, mut noise] = [0.0; 2];
    for (now, exact) in frames {
        change += rms(now[0].iter().zip(&now[1]).map(|(a, b)| b - a));
        let steps = now.iter().zip(exact).map(|(a, b)| a.iter().zip(b).map(|(a, b)| a - b).collect());
        let off: Vec<Vec<f64>> = steps.collect();
        noise += rms(off[0].iter().zip(&off[1]).map(|(a, b)| b - a));
    }
    [change, noise].map(|sum| sum / (film.len() - 1) as f64 / mean)
}

const FRAMES: i32 = 8;
/// In a second the wind goes 10 m, a tenth to a twenty-fifth of a texel's width, but past two to four rays of one, each as narrow as the
/// map's texels of 80 m, where 36 times as many show the mean: how much more their light may change. 2.0 to 2.7 times was measured.
const MORE_THAN_DRIFT: f64 = 3.3;
/// What the film's difference from the finer one changes by, of the mean light: 0.7 to 1.5 % was measured away from the sun, and 5.2 % within 20 degrees of its azimuth,
/// where rims of clouds are many times brighter than the rest.
const SHIMMER: [f64; 2] = [0.02, 0.065];

#[test]
fn far_clouds_change_by_little_more_than_the_wind_moves_them() {
    let mut sky = Sky::open();
    for (look, azimuth) in [("70,5", 70), ("160,5", 160), ("250,5", 250), ("340,5", 340)] {
        let [film, fine]: [Vec<Vec<f64>>; 2] =
            [1, FINER].map(|finer| (0..FRAMES).map(|t| frame(&mut sky, &scene(), f64::from(t), look, finer)).collect());
        let ([change, noise], [drift, _]) = (changes(&film, &fine), changes(&fine, &fine));
        println!(
            "azimuth {azimuth}: {:.2} % in a second, of 36 times the rays {:.2} %; difference of the two {:.2} %",
            100.0 * change,
            100.0 * drift,
            100.0 * noise
        );
        assert!(
            change < MORE_THAN_DRIFT * drift && noise < SHIMMER[usize::from(azimuth == 160)],
            "{change}, {drift}, {noise}"
        );
    }
}

/// Nothing moves without wind: not a bit of any texel.
#[test]
fn clouds_that_stand_do_not_flicker() {
    let mut sky = Sky::open();
    let mut still = scene();
    still["layers"][0]["wind"] = json!({ "speed_m_s": 0, "from_deg": 250 });
    let first = frame(&mut sky, &still, 0.0, "160,5", 1);
    for time_s in [0.04, 1.0, 7.0, 86_400.0] {
        assert_eq!(frame(&mut sky, &still, time_s, "160,5", 1), first, "after {time_s} s");
    }
}
