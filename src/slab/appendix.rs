//! Fluxes of the orders of scattering by the one-dimensional model of Bouthors et al. 2006 (appendix A), with its fitted parameters
//! (appendix B) for N0 = 300 per cubic centimetre, broadness 2, effective radius 7 um.

use crate::optics::Mix;

/// Droplets per cubic metre of the paper's cloud.
pub(crate) const DROPLETS_PER_M3: f64 = 3e8;

/// Transmittance of a metre of cloud for light of many scatterings.
const BETA: f64 = 0.9961;
/// Fitted parameters b, c, kappa_c, t, r at suns 0, 10, .. 90 degrees.
const FITTED: [[f64; 5]; 10] = [
    [1.1796, 0.0138, 0.0265, 0.8389, 0.0547],
    [1.1293, 0.0154, 0.0262, 0.8412, 0.0547],
    [1.1382, 0.0131, 0.0272, 0.8334, 0.0552],
    [1.0953, 0.0049, 0.0294, 0.8208, 0.0564],
    [0.9808, 0.0012, 0.0326, 0.8010, 0.0603],
    [0.9077, 0.0047, 0.0379, 0.7774, 0.0705],
    [0.7987, 0.0207, 0.0471, 0.7506, 0.0984],
    [0.6629, 0.0133, 0.0616, 0.7165, 0.1700],
    [0.5043, 0.0280, 0.0700, 0.7149, 0.3554],
    [0.3021, 0.0783, 0.0700, 0.1000, 0.9500],
];
/// The paper's extinction outside the forward peak, 1/m: N0 pi r_e^2, less the 51 % it puts into the peak.
const PRINTED_EXTINCTION_PER_M: f64 = 0.046_181 * 0.49;

/// Fluxes as fractions of the incident horizontal irradiance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OrderFluxes {
    /// Transmitted: orders 0, 1, 2, 3 and up.
    pub(crate) transmitted: [f64; 4],
    /// Reflected: orders 0 (nothing), 1, 2, 3 and up.
    pub(crate) reflected: [f64; 4],
}

/// Metres of the paper's cloud in an optical depth of 1, if the mix is the paper's: light depends on the optical depth alone, so
/// that other numbers of the same droplets are clouds of another thickness.
pub(crate) fn metres_per_depth(mix: &Mix, cross_section_um2: f64) -> Option<f64> {
    let of_paper = *mix == Mix::Gamma { effective_radius_um: 7.0, broadness: 2.0, refractive_index: None };
    of_paper.then(|| 1.0 / (DROPLETS_PER_M3 * cross_section_um2 * 1e-12))
}

/// What all orders together transmit, 0..=1; the rest is reflected.
pub(crate) fn total_transmittance(thickness_m: f64, mu_sun: f64) -> f64 {
    transmittance(thickness_m, parameters(mu_sun.acos().to_degrees())).clamp(0.0, 1.0)
}

/// Parameters at a sun, linear between the given ones.
fn parameters(zenith_deg: f64) -> [f64; 5] {
    let place = (zenith_deg / 10.0).clamp(0.0, 9.0);
    let low = (place as usize).min(8);
    std::array::from_fn(|i| FITTED[low][i] + (FITTED[low + 1][i] - FITTED[low][i]) * (place - low as f64))
}

/// What all orders together transmit.
fn transmittance(thickness_m: f64, [b, c, ..]: [f64; 5]) -> f64 {
    let correction = b + (1.0 - b) * (-c * thickness_m).exp();
    correction * BETA / (thickness_m - (thickness_m - 1.0) * BETA)
}

/// The model as it is printed.
pub(crate) fn printed(thickness_m: f64, zenith_deg: f64) -> OrderFluxes {
    let fitted = parameters(zenith_deg);
    let [_, _, kappa, t, r] = fitted;
    let depth = kappa * thickness_m;
    let through = |times: f64| (-times * depth).exp();
    let all = transmittance(thickness_m, fitted);
    let direct = (-PRINTED_EXTINCTION_PER_M * thickness_m / zenith_deg.to_radians().cos()).exp();
    let [once, twice_forward] = [t * depth * through(1.0), 0.5 * (t * depth).powi(2) * through(1.0)];
    let twice = twice_forward + 0.25 * r * r * (1.0 + (2.0 * depth - 1.0) * through(2.0)) * through(3.0);
    let [once_back, twice_back] = low_reflected(depth, t, r);
    OrderFluxes {
        transmitted: [direct, once, twice, all - direct - once - twice],
        reflected: [0.0, once_back, twice_back, 1.0 - all - once_back - twice_back],
    }
}

/// The model with light scattered back twice as its integral gives it, the extinction outside the forward peak of the droplets' own
/// phase function, and no order below zero: what the low orders leave, in their turn, is the most a higher one gets.
pub(crate) fn repaired(thickness_m: f64, zenith_deg: f64, extinction_per_m: f64) -> OrderFluxes {
    let fitted = parameters(zenith_deg);
    let [_, _, kappa, t, r] = fitted;
    let depth = kappa * thickness_m;
    let all = transmittance(thickness_m, fitted);
    let direct = (-extinction_per_m * thickness_m / zenith_deg.to_radians().cos()).exp();
    let once = t * depth * (-depth).exp();
    // 2x - 1 + e^-2x without cancellation where it is small.
    let back_and_forth = if depth < 1e-3 {
        2.0 * depth * depth * (1.0 - 2.0 / 3.0 * depth)
    } else {
        2.0 * depth + (-2.0 * depth).exp_m1()
    };
    let twice = (0.5 * (t * depth).powi(2) + 0.25 * r * r * back_and_forth) * (-depth).exp();
    let [once_back, twice_back] = low_reflected(depth, t, r);
    OrderFluxes {
        transmitted: filled(all, [direct, once, twice]),
        reflected: filled(1.0 - all, [0.0, once_back, twice_back]),
    }
}

/// Reflected orders 1 and 2.
fn low_reflected(depth: f64, t: f64, r: f64) -> [f64; 2] {
    let once = -0.5 * r * (-2.0 * depth).exp_m1();
    [once, 0.5 * r * t * (1.0 - (2.0 * depth + 1.0) * (-2.0 * depth).exp())]
}

/// Orders that sum to `all`.
fn filled(all: f64, low: [f64; 3]) -> [f64; 4] {
    let mut left = all.max(0.0);
    let mut take = |wanted: f64| {
        let taken = wanted.clamp(0.0, left);
        left -= taken;
        taken
    };
    let [a, b, c] = low.map(&mut take);
    [a, b, c, left]
}

#[cfg(test)]
mod tests {
    use super::{printed, repaired};

    #[test]
    fn the_model_has_its_known_values() {
        // All orders: values computed apart from the paper's formula.
        for (thickness_m, zenith_deg, all) in
            [(1.0, 0.0, 0.999), (20.0, 80.0, 0.730), (100.0, 70.0, 0.540), (1000.0, 30.0, 0.223)]
        {
            let sum: f64 = repaired(thickness_m, zenith_deg, 0.02).transmitted.iter().sum();
            assert!((sum - all).abs() < 1e-3, "{thickness_m} m, {zenith_deg} degrees: {sum}");
            let sum: f64 = printed(thickness_m, zenith_deg).transmitted.iter().sum();
            assert!((sum - all).abs() < 1e-3, "{thickness_m} m, {zenith_deg} degrees: {sum}");
        }
        // The lowest reflected flux of orders 3 and up.
        assert!((printed(8.1, 82.0).reflected[3] + 0.036).abs() < 1e-3);
    }

    #[test]
    fn the_repaired_model_keeps_energy_and_sign() {
        for thickness_m in [0.0, 1e-4, 1.0, 8.0, 100.0, 3000.0] {
            for zenith_deg in [0.0, 28.0, 70.0, 85.0] {
                let fluxes = repaired(thickness_m, zenith_deg, 0.02);
                let all: Vec<f64> = fluxes.transmitted.into_iter().chain(fluxes.reflected).collect();
                assert!(all.iter().all(|flux| *flux >= 0.0) && (all.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            }
        }
    }
}
