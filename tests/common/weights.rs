//! What a graphics card filters less finely than a software device.

use std::sync::LazyLock;

/// A graphics card's filter weighs two texels by a number of 8 bits, a software device's by one of 24. Where one of its
/// weights is off by such a step, so is what it filters, as a part of what lies next to it; on an NVIDIA H100 light is off by
/// three quarters of this nearly everywhere.
const WEIGHT_STEP: f64 = 1.0 / 256.0;

/// What coarse weights of the device's filter may add to a difference from full ones, relative: nothing on a software device.
pub(crate) fn coarse_weights() -> f64 {
    static STEP: LazyLock<f64> = LazyLock::new(|| {
        let card = skyloom::gpu::adapters(None).iter().any(|adapter| adapter.chosen && adapter.kind != "software");
        if card { WEIGHT_STEP } else { 0.0 }
    });
    *STEP
}
