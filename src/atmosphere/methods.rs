//! The methods of multiple scattering behind one signature.

use super::air::Air;
use super::isotropic::Isotropic;
use super::moments::Moments;
use super::quality::Quality;
use super::second_order::SecondOrder;

/// Air with its diffuse light: what [`super::march::march`] integrates along a view.
pub trait SkyModel: Send + Sync {
    /// The air.
    fn air(&self) -> &Air;
    /// Light that was scattered or reflected before, scattered towards the eye, per metre and steradian and per unit
    /// sun.
    ///
    /// `cosine` is that between view and sun; `sun_cosine` and `view_cosine` are local, at `height_m`.
    fn source(&self, height_m: f64, sun_cosine: f64, view_cosine: f64, cosine: f64) -> f64;
    /// Diffuse irradiance on the boundary per unit sun.
    fn irradiance(&self, sun_cosine: f64) -> f64;
}

/// How light that is scattered more than once is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Not at all.
    Single,
    /// An isotropic closed sum (S. Hillaire, 2020).
    Isotropic,
    /// Two orders (T. Nishita, Y. Dobashi, K. Kaneda, H. Yamashita, 1996).
    SecondOrder,
    /// Angular moments by height and sun, all orders.
    Moments {
        /// Resolution.
        quality: Quality,
        /// Follow Rayleigh's polarisation.
        polarised: bool,
    },
}

impl Method {
    /// Prepares the method for air; `progress` hears fractions up to 1.
    #[must_use]
    pub fn prepare(self, air: Air, progress: &(dyn Fn(f64) + Sync)) -> Box<dyn SkyModel> {
        let model: Box<dyn SkyModel> = match self {
            Self::Single => Box::new(Single(air)),
            Self::Isotropic => Box::new(Isotropic::new(air)),
            Self::SecondOrder => Box::new(SecondOrder::new(air)),
            Self::Moments { quality, polarised } => {
                return Box::new(Moments::solve(air, quality, polarised, progress));
            }
        };
        progress(1.0);
        model
    }
}

/// Light scattered once only.
#[derive(Debug)]
struct Single(Air);

impl SkyModel for Single {
    fn air(&self) -> &Air {
        &self.0
    }

    fn source(&self, _: f64, _: f64, _: f64, _: f64) -> f64 {
        0.0
    }

    fn irradiance(&self, _: f64) -> f64 {
        0.0
    }
}
