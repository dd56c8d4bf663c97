//! Traces light through broken clouds in air, and writes `tests/data/broken_air`: about twenty minutes on
//! two idle cores. Arguments: the standard error of a texel at which a wavelength ends (0.025), and names of scenes, if not
//! all.
#![allow(clippy::print_stdout, reason = "what a program is for")]

#[path = "../tests/common/broken_air.rs"]
mod broken_air;

use broken_air::{Broken, MAPS, SCENES, SIDE, path, scene};
use skyloom::reference::monte_carlo::Effort;
use skyloom::reference::monte_carlo::field::{FieldLight, FluxMap, colour};
use skyloom::spectrum::WAVELENGTHS_NM;
use skyloom::{Renderer, RendererOptions, TableLibrary};
use std::error::Error;
use std::fmt::Write as _;
use std::time::Instant;

/// The standard error of a texel's diffuse light on the ground, relative, in the mean.
const RELATIVE_ERROR: f64 = 0.025;
const SEED: u64 = 20_260_101;

fn main() -> Result<(), Box<dyn Error>> {
    let (numbers, wanted): (Vec<String>, Vec<String>) =
        std::env::args().skip(1).partition(|argument| argument.parse::<f64>().is_ok());
    let relative_error = numbers.first().map_or(Ok(RELATIVE_ERROR), |number| number.parse())?;
    let mut renderer = Renderer::new(&RendererOptions::default())?;
    let library = TableLibrary::new(None);
    for (number, name) in SCENES.into_iter().enumerate() {
        if !wanted.is_empty() && !wanted.iter().any(|other| other == name) {
            continue;
        }
        let start = Instant::now();
        let broken = Broken::new(&mut renderer, &library, &scene(name))?;
        let effort = Effort { photons: 25_600_000, seed: SEED + 10 * number as u64, relative_error, time_limit: None };
        let light = broken.trace(&effort, &|_| ())?;
        std::fs::write(path(&format!("{name}.csv")), texels(&light))?;
        std::fs::write(path(&format!("{name}_means.csv")), means(&light))?;
        let photons: Vec<u64> = light.iter().map(|wave| wave.photons / 8).collect();
        println!("{name}: top at {:.1} m, {photons:?} photons, {:.0} s", broken.top_m(), start.elapsed().as_secs_f64());
    }
    Ok(())
}

/// Every texel at every wavelength, of the sun's irradiance on a plane that faces it above the air.
fn texels(light: &[FieldLight; 4]) -> String {
    let mut text = "row,column".to_owned();
    let mut maps = Vec::new();
    for (wave, nm) in light.iter().zip(WAVELENGTHS_NM) {
        for (map, name) in MAPS {
            // Writing to a String cannot fail.
            let _ = write!(text, ",{name}_{nm}");
            maps.push(wave.map(map).values.iter().map(|value| wave.incident * value).collect::<Vec<f64>>());
        }
    }
    text.push('\n');
    for texel in 0..SIDE * SIDE {
        let _ = write!(text, "{},{}", texel / SIDE, texel % SIDE);
        for map in &maps {
            let _ = write!(text, ",{:.4}", map[texel]);
        }
        text.push('\n');
    }
    text
}

/// Means over the domain: of the four wavelengths as the texels, of red, green and blue in klx.
fn means(light: &[FieldLight; 4]) -> String {
    let mut text = "channel,map,mean,standard_error,texel_error\n".to_owned();
    let mut row = |channel: &str, name: &str, mean: [f64; 2], texels: &[f64]| {
        let texel = texels.iter().sum::<f64>() / texels.len() as f64;
        let _ = writeln!(text, "{channel},{name},{:.5e},{:.1e},{texel:.1e}", mean[0], mean[1]);
    };
    let maps = MAPS.into_iter().chain([(FluxMap::TopDirect, "top_down_direct")]);
    for (map, name) in maps {
        for (wave, nm) in light.iter().zip(WAVELENGTHS_NM) {
            let mean = wave.mean(map);
            let errors: Vec<f64> = wave.map(map).standard_errors.iter().map(|error| wave.incident * error).collect();
            row(&nm.to_string(), name, [mean.value, mean.standard_error].map(|n| wave.incident * n), &errors);
        }
        let rgb = colour(light, map);
        for (c, channel) in ["R", "G", "B"].into_iter().enumerate() {
            let part = |values: &[f64]| values.iter().skip(c).step_by(3).copied().collect::<Vec<f64>>();
            let (values, errors) = (part(&rgb.values), part(&rgb.standard_errors));
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            let waves = light.each_ref().map(|wave| wave.incident * wave.mean(map).standard_error);
            let error = skyloom::spectrum::TO_REC709[c].iter().zip(waves).map(|(entry, e)| (entry * e).powi(2));
            row(channel, name, [mean, error.sum::<f64>().sqrt()], &errors);
        }
    }
    text
}
