//! How much of a synthetic field's variance each octave of its noise has.

/// Amplitude per octave, 2^(-1/3).
const OCTAVE_GAIN: f64 = 0.793_700_5;
/// Variance of cells by octave, those of waves `x` to `x / 2` of their size: most, where that is, and the width of a bell over `ln x` (measured:
/// 0.24, 0.36, 0.25, 0.07, 0.00 of closed cells from `x` = 1 on, 0.19, 0.33, 0.28, 0.11, 0.01 of open ones).
const CELLS_MOST: f64 = 0.36;
const CELLS_FINEST: f64 = 2.4;
const CELLS_WIDTH: f64 = 0.62;
/// Noise of an octave that has more of cells than of the spectrum, as a part of the latter.
const LEAST_NOISE: f64 = 0.15;
/// Ends of the search for the spectrum's height, and its halvings: one octave alone has all the variance.
const MOST_LEVEL: f64 = 1e4;
const HALVINGS: u32 = 60;

/// Variance of octaves, each by the cycles per domain of its longest wave, one after another twice as many; with that of cells or streets, `share` squared, it
/// is 1. `cells` of which something is to be made up for: how many there are across the domain.
pub(super) fn octave_parts(octaves: &[f64], share: f64, cells: Option<f64>) -> Vec<f64> {
    let noise = 1.0 - share * share;
    let Some(cells) = cells else {
        let falling = |o: usize| OCTAVE_GAIN.powi(2 * o as i32);
        let sum: f64 = (0..octaves.len()).map(falling).sum();
        return (0..octaves.len()).map(|o| noise / sum * falling(o)).collect();
    };
    // Cells are smooth but for their creases: what they lack of a -5/3 spectrum from their own size down is noise.
    let of_cells = |finest: f64| {
        let away = (finest / CELLS_FINEST).ln() / CELLS_WIDTH;
        share * share * CELLS_MOST * (-0.5 * away * away).exp()
    };
    let part = |level: f64, finest: f64| {
        let wanted = match finest {
            // Longer waves would hide the cells.
            longer if longer < 1.0 => 0.6 * level,
            shorter => level * shorter.powf(-2.0 / 3.0),
        };
        (wanted - of_cells(finest)).max(LEAST_NOISE * wanted)
    };
    let parts = |level: f64| octaves.iter().map(move |cycles| part(level, cycles / cells));
    let (mut low, mut high) = (0.0, MOST_LEVEL);
    for _ in 0..HALVINGS {
        let level = 0.5 * (low + high);
        if parts(level).sum::<f64>() < noise { low = level } else { high = level }
    }
    parts(low).collect()
}
