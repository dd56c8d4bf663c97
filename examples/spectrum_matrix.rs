//! Fits the matrix from four wavelengths to linear Rec.709 and prints it, with its errors and those of the one in use.
#![allow(clippy::print_stdout, reason = "the output of the command")]

use skyloom::spectrum::{Misfit, TO_REC709, bare_sun, fit, misfit, rec709};

fn main() {
    let tell = |name: &str, matrix: &[[f64; 4]; 3], misfit: Misfit| {
        println!("{name}:");
        matrix.iter().for_each(|row| println!("    [{:.4}, {:.4}, {:.4}, {:.4}],", row[0], row[1], row[2], row[3]));
        println!(
            "  on {} samples: {:.3} % rms, {:.2} % worst, luminance {:.3} % rms",
            misfit.samples,
            100.0 * misfit.rms,
            100.0 * misfit.worst,
            100.0 * misfit.luminance_rms
        );
        let sun: [f64; 3] = matrix.map(|row| row.iter().sum());
        println!("  bare sun {sun:.2?}");
    };
    if let Some(fit) = fit() {
        tell(&format!("fitted to {} samples", fit.samples), &fit.matrix, fit.misfit);
    }
    tell("in use", &TO_REC709, misfit(&TO_REC709));
    println!("bare sun by its whole spectrum {:.2?} klx, by the matrix {:.2?}", bare_sun(), rec709([1.0; 4]));
}
