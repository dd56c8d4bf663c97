//! A short test of the driver at start: what later passes rely on is tried once, and said aloud.

use super::device::Gpu;
use super::error::GpuError;
use super::pass::{Pass, binds};
use super::shaders;

/// Iterations that the shader's loop is asked for. Mesa 22.3's software driver silently stops at 65,535.
const ASKED_ITERATIONS: f32 = 200_000.0;
/// Largest error of the driver's square root, exponential and bilinear sample that is let through, relative. Real
/// devices filter with 8-bit weights (1/512 of the step, which is 1 here) and software ones in full floats.
const WORST_ERROR: f32 = 4e-3;

pub(super) fn run(gpu: &Gpu) -> Result<(), GpuError> {
    let pixels = gpu.texture_from("self-test", [2, 2], 1, &[0.0, 1.0, 2.0, 3.0]);
    let result = gpu.storage("self-test", 4);
    let binds = binds![&pixels, &gpu.repeat, &result];
    gpu.run("self-test", None, &[Pass::new(&shaders::SELF_TEST, [1, 1], binds)])?;
    let found = gpu.read(&result, 4, None)?;
    // A quarter of a texel from the first centre in x: 3/4 of 0 and 1/4 of 1.
    for (name, found, expected) in [
        ("bilinear filter", found[1], 0.25),
        ("exponential", found[2], 0.5_f32.exp2()),
        ("square root", found[3], 2.0_f32.sqrt()),
    ] {
        let error = (found - expected).abs();
        if error.is_nan() || error > WORST_ERROR * expected {
            let text = format!("self-test of {}: {name} gave {found}, not {expected}", gpu.summary.name);
            return Err(GpuError::Failed(text));
        }
    }
    if found[0] < ASKED_ITERATIONS {
        tracing::debug!(iterations = found[0], "the driver caps loops; passes stay below the cap");
    }
    Ok(())
}
