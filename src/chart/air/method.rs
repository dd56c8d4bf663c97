//! The methods, made ready for an air, with their times.

use std::time::Instant;

use super::cases::Case;
use crate::atmosphere::{Air, Boundary, End, Layout, Method, Moments, Quality, SkyModel, SunSky, View, march};
use crate::chart::figure::{BLUE, GREEN, GREY, ORANGE, RED, TEAL};
use plotters::style::RGBColor;

/// Times that are taken; the shortest counts, as others use the cores too. Slow methods are timed once.
const ROUNDS: usize = 3;
/// Sun of which the texture is timed, degrees.
const TIMED_SUN_DEG: f64 = 60.0;

/// A method with its name and colour.
#[derive(Clone, Copy, Debug)]
pub(super) struct Named {
    pub(super) name: &'static str,
    pub(super) colour: RGBColor,
    way: Way,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Way {
    /// Light as a scalar always.
    Plain(Method),
    /// As the case has it.
    Moments(Quality),
}

/// Every method, the simplest first.
pub(super) const METHODS: [Named; 6] = [
    Named { name: "single scattering", colour: GREY, way: Way::Plain(Method::Single) },
    Named { name: "isotropic sum", colour: RED, way: Way::Plain(Method::Isotropic) },
    Named { name: "second order", colour: ORANGE, way: Way::Plain(Method::SecondOrder) },
    Named { name: "moments fast", colour: GREEN, way: Way::Moments(Quality::Fast) },
    Named { name: "moments normal", colour: BLUE, way: Way::Moments(Quality::Normal) },
    Named { name: "moments fine", colour: TEAL, way: Way::Moments(Quality::Fine) },
];

/// A method ready for an air.
pub(super) struct Prepared {
    pub(super) sky: Box<dyn SkyModel>,
    /// To make it ready.
    pub(super) seconds: f64,
    /// For the texture of one sun, on one core.
    pub(super) milliseconds: f64,
}

/// The shortest time of some, in seconds, and what was made.
fn timed<T>(rounds: usize, make: impl Fn() -> T) -> (T, f64) {
    let round = || {
        let start = Instant::now();
        let made = make();
        (made, start.elapsed().as_secs_f64())
    };
    (1..rounds).fold(round(), |best, _| {
        let next = round();
        if next.1 < best.1 { next } else { best }
    })
}

impl Named {
    /// Whether it takes more than a second or so.
    pub(super) fn is_slow(&self) -> bool {
        self.way == Way::Moments(Quality::Fine)
    }

    /// Makes it ready; times are those of single runs unless `measured`.
    pub(super) fn prepare(&self, case: &Case, measured: bool) -> Prepared {
        let rounds = if measured && !self.is_slow() { ROUNDS } else { 1 };
        let air = Air::new(case.air.medium(case.wavelength_nm), Boundary::ground(case.air.ground));
        let (sun, layout) = (TIMED_SUN_DEG.to_radians().cos(), Layout::default());
        match self.way {
            Way::Plain(method) => {
                let (sky, seconds) = timed(rounds, || method.prepare(air.clone(), &|_| ()));
                // These have no texture of their own: as many views, each on its own.
                let (_, texture) = timed(rounds, || {
                    let views = (0..layout.above).flat_map(|row| (0..layout.columns).map(move |column| (row, column)));
                    let view = |(row, column): (usize, usize)| {
                        let elevation_deg = 90.0 * (row as f64 / layout.above as f64).powi(2);
                        let view = View::new(elevation_deg, 180.0 * column as f64 / layout.columns as f64, sun);
                        march(&*sky, 1.0, sun, view, layout.steps).radiance()
                    };
                    views.map(view).sum::<f64>()
                });
                Prepared { sky, seconds, milliseconds: 1e3 * texture }
            }
            Way::Moments(quality) => {
                let solve = || Moments::solve(air.clone(), quality, case.polarised, &|_| ());
                let (moments, seconds) = timed(rounds, solve);
                let (_, texture) = timed(rounds, || SunSky::new(&moments, 1.0, sun, layout, End::Atmosphere));
                Prepared { sky: Box::new(moments), seconds, milliseconds: 1e3 * texture }
            }
        }
    }
}
