//! Light and colour of a clear sky against libRadtran, whose spectra, air, aerosol and solver are its own.

use std::array::from_fn;

use skyloom::atmosphere::wavelength::{aerosol_depth, ozone_depth, rayleigh_depth};
use skyloom::atmosphere::{Aerosol, Air, Boundary, Medium, Moments, Quality, View, diffuse_fluxes, march};
use skyloom::spectrum::{WAVELENGTHS_NM, luminance, rec709};

use super::{Errors, cos_degrees, data};

/// Ozone of the US standard atmosphere (afglus) in Dobson units, and the Henyey-Greenstein aerosol that comes nearest to
/// libRadtran's default one, Shettle's of 1989: rural, 50 km of visibility, whose asymmetry is 0.63 to 0.66. Its depth is that
/// which libRadtran was told.
const OZONE_DU: f64 = 345.0;
const DEPTH_550: f64 = 0.1;
const ANGSTROM: f64 = 1.3;
const ASYMMETRY: f64 = 0.65;
const ALBEDO: f64 = 0.95;
const SCALE_HEIGHT_M: f64 = 1500.0;

/// Beam through parallel planes, as libRadtran has them: all that lies between the two is water vapour, oxygen and NO2, which take
/// little more than 0.3 % of the light for each time the way is as long as that to the zenith.
const GASES: f64 = 0.004;
/// Diffuse light by day: an albedo of the aerosol off by 0.02 makes 1.6 %, an asymmetry off by 0.01 0.3 %. At 80 degrees the gases
/// take 2 % of it as they do of the beam, and what the round Earth adds to the beam it adds to its scattered light.
const DIFFUSE: [(f64, f64); 3] = [(30.0, 0.015), (60.0, 0.015), (80.0, 0.04)];
/// Views: an asymmetry of 0.7 in place of 0.65 makes 6 % off the sun and 30 % at it, and an even Henyey-Greenstein function is not that of
/// each wavelength and height.
const VIEWS_RMS: [(f64, f64); 3] = [(30.0, 0.025), (60.0, 0.03), (80.0, 0.04)];
const VIEWS_WORST: f64 = 0.065;

/// The sky's four wavelengths, light as a scalar.
struct Sky([Moments; 4]);

impl Sky {
    fn new() -> Self {
        Self(WAVELENGTHS_NM.map(|nm| {
            let depth = aerosol_depth(DEPTH_550, ANGSTROM, nm);
            let aerosol = Aerosol::henyey_greenstein(depth, SCALE_HEIGHT_M, ALBEDO, ASYMMETRY);
            let air = Air::new(Medium::new(nm, 1.0, OZONE_DU, aerosol), Boundary::ground(0.2));
            Moments::solve(air, Quality::Normal, false, &|_| {})
        }))
    }

    /// The colour of something at each wavelength, lux or cd/m2.
    fn colour(&self, light: impl Fn(&Moments) -> f64) -> [f64; 3] {
        rec709(from_fn(|wave| light(&self.0[wave]))).map(|value| 1000.0 * value)
    }

    fn radiance(&self, sun: f64, zenith_deg: f64, azimuth_deg: f64) -> [f64; 3] {
        let view = View::new(90.0 - zenith_deg, azimuth_deg, sun);
        self.colour(|moments| march(moments, 0.0, sun, view, 64).radiance())
    }
}

/// Illuminance of a beam through parallel planes of air, on level ground.
fn plane_beam(sun: f64) -> f64 {
    let depth = |nm| rayleigh_depth(nm) + aerosol_depth(DEPTH_550, ANGSTROM, nm) + ozone_depth(OZONE_DU, nm);
    1000.0 * luminance(rec709(WAVELENGTHS_NM.map(|nm| sun * (-depth(nm) / sun).exp())))
}

#[test]
fn a_clear_sky_is_that_of_libradtran_but_for_gases_and_the_aerosol_s_kind() {
    let sky = Sky::new();
    for ((zenith_deg, most_diffuse), (_, most_views)) in DIFFUSE.into_iter().zip(VIEWS_RMS) {
        let sun = cos_degrees(zenith_deg);
        let mut views = Errors::default();
        for row in data("libradtran") {
            let numbers: Vec<f64> = [0, 2, 3, 4].map(|i| row[i].parse().unwrap_or(0.0)).to_vec();
            let [zenith, view_zenith, view_azimuth, wanted] = numbers[..] else { unreachable!() };
            if zenith != zenith_deg {
                continue;
            }
            let seen = || sky.radiance(sun, view_zenith, view_azimuth);
            let off = |found: f64| found / wanted - 1.0;
            match row[1].as_str() {
                "direct" => {
                    let round = luminance(sky.colour(|moments| moments.air.beam_on_boundary(sun)));
                    let (plane, round) = (off(plane_beam(sun)), off(round));
                    println!(
                        "sun {zenith_deg}: beam {:+.2} %, on a round Earth {:+.2} %",
                        100.0 * plane,
                        100.0 * round
                    );
                    assert!((0.0..GASES / sun).contains(&plane), "sun {zenith_deg}: {plane}");
                    // The way is shorter on the sphere, by 4 % of the light at 80 degrees and by next to nothing before.
                    assert!(round > plane - 1e-3 && round < plane + 0.05, "sun {zenith_deg}: {round}");
                }
                "diffuse" => {
                    let found = off(luminance(sky.colour(|moments| diffuse_fluxes(moments, 0.0, sun).down)));
                    println!("sun {zenith_deg}: diffuse {:+.2} %", 100.0 * found);
                    assert!(found.abs() < most_diffuse, "sun {zenith_deg}: {found}");
                }
                "luminance" => views.add(luminance(seen()), wanted, 0.0),
                channel => {
                    let place = ["red", "green", "blue"].iter().position(|name| *name == channel).unwrap();
                    let found = off(seen()[place]);
                    println!("sun {zenith_deg}: {channel} of the zenith {:+.2} %", 100.0 * found);
                    assert!(found.abs() < VIEWS_WORST, "sun {zenith_deg}, {channel}: {found}");
                }
            }
        }
        views.report(&format!("sun {zenith_deg}, views"));
        assert!(views.count == 10 && views.rms() < most_views && views.worst.abs() < VIEWS_WORST, "{views:?}");
    }
}
