//! The chart's picture.

use super::cases::{Case, Origin};
use super::errors::Found;
use super::method::METHODS;
use crate::chart::figure::{Axis, BLACK, Dash, Figure, GREY, Key, Mark, Panel, Stroke};

/// Range of errors that is drawn, percent.
const ERRORS: [f64; 2] = [0.1, 120.0];
/// The air whose errors are drawn against cost, and the last sun that counts there, degrees.
const COSTED: &str = "std";
const LAST_SUN_DEG: f64 = 90.0;
/// Times below this are drawn here.
const LEAST_SECONDS: f64 = 0.001;

pub(super) fn of(cases: &[Case], found: &[Found]) -> Figure {
    let of_case = |name: &str, nm: f64, own: bool| {
        let number = cases.iter().position(|case| {
            let is_own = case.origin == Origin::Own;
            (case.name, case.wavelength_nm, is_own) == (name, nm, own)
        });
        move |method: usize| -> Vec<&Found> {
            found.iter().filter(|found| found.method == method && Some(found.case) == number).collect()
        }
    };
    let line = |points: &[&Found], stroke: Stroke| {
        let place = |found: &&Found| [found.sun_deg, 100.0 * found.rms];
        Mark::Line(points.iter().map(place).collect(), stroke)
    };
    let dots = |points: &[&Found], colour, ring: bool| {
        let place = |found: &&Found| [found.sun_deg, 100.0 * found.rms, 100.0 * found.rms_error];
        Mark::Dots { points: points.iter().map(place).collect(), colour, ring }
    };
    let noise = Stroke { colour: GREY, width: 1.5, dash: Dash::Dotted };
    let marks = |name: &str, nm: f64| -> Vec<Mark> {
        let mut marks = Vec::new();
        for own in [false, true] {
            let of_method = of_case(name, nm, own);
            let noisy = of_method(0).iter().map(|found| [found.sun_deg, 100.0 * found.noise]).collect();
            marks.push(Mark::Line(noisy, noise));
            for (number, method) in METHODS.iter().enumerate() {
                let points = of_method(number);
                marks.push(line(&points, Stroke::solid(method.colour, 2.0)));
                marks.push(dots(&points, method.colour, own));
            }
        }
        marks
    };
    let panel = |title: &str, pieces: &[(&str, f64)]| Panel {
        title: title.to_owned(),
        x: Axis::linear("sun's zenith angle, degrees", [-2.0, 102.0], 10.0),
        y: Axis::log("rms error of radiance, %", ERRORS),
        marks: pieces.iter().flat_map(|(name, nm)| marks(name, *nm)).collect(),
    };
    let mut costs = Vec::new();
    for (nm, ring) in [(440.0, false), (640.0, true)] {
        for (number, method) in METHODS.iter().enumerate() {
            let points: Vec<&Found> = of_case(COSTED, nm, false)(number);
            let day: Vec<&&Found> = points.iter().filter(|found| found.sun_deg <= LAST_SUN_DEG).collect();
            let views = day.iter().map(|found| found.views as f64).sum::<f64>();
            let squares = day.iter().map(|found| found.views as f64 * found.rms * found.rms).sum::<f64>();
            if let Some(first) = day.first() {
                // Nothing but the sky's own integrals is made ready for light scattered once.
                let seconds = first.seconds.max(LEAST_SECONDS);
                let points = vec![[seconds, 100.0 * (squares / views).sqrt(), 0.0]];
                costs.push(Mark::Dots { points, colour: method.colour, ring });
            }
        }
    }
    let panels = vec![
        panel("aerosol 0.1, 440 nm", &[("std", 440.0), ("std in twilight", 440.0)]),
        panel("aerosol 0.1, 640 nm", &[("std", 640.0), ("std in twilight", 640.0)]),
        panel("aerosol 0.1, 440 nm, views to 0.3 degrees", &[("std at the horizon", 440.0)]),
        panel("molecules alone, 440 nm", &[("rayleigh", 440.0)]),
        panel("molecules alone, polarised, 440 nm", &[("rayleigh polarised", 440.0)]),
        panel("aerosol 0.5, 440 nm", &[("haze", 440.0)]),
        panel("aerosol 1, 440 nm", &[("thick", 440.0)]),
        panel("aerosol 0.03 over snow, 440 nm", &[("snow", 440.0)]),
        Panel {
            title: "cost against error, aerosol 0.1, suns to 90 degrees".to_owned(),
            x: Axis::log("seconds per air and wavelength", [LEAST_SECONDS / 2.0, 20.0]),
            y: Axis::log("rms error of radiance, %", ERRORS),
            marks: costs,
        },
    ];
    let methods = METHODS.iter().map(|method| (Key::Line(Stroke::solid(method.colour, 2.0)), method.name.to_owned()));
    let truths = vec![
        (Key::Dot { colour: BLACK, ring: false }, "against an independent program (cost: 440 nm)".to_owned()),
        (Key::Dot { colour: BLACK, ring: true }, "against Monte Carlo of this one (cost: 640 nm)".to_owned()),
        (Key::Line(noise), "noise of the truth, which is part of the errors".to_owned()),
    ];
    Figure {
        title: "Clear air: error against sun, and against cost".to_owned(),
        subtitle:
            "radiance in 6 to 25 views from the ground, at least 3 degrees from the sun, against Monte Carlo on a \
                   round Earth; bars: standard errors; optical depths of aerosol at 550 nm"
                .to_owned(),
        size: [1320, 1240],
        columns: 3,
        panels,
        legend: vec![methods.collect(), truths],
        scale: None,
    }
}
