//! The exchange of two colours: passes, and conjugate gradients.
//!
//! For conjugate gradients the unknown is `x = s E` with `s = sqrt(a)`. With the source `S = b + K d0` the three equations
//! become `A x = s S`, `A = 1 - s K R K s`, which is symmetric and has no eigenvalue below 0. Even light, `s`, is kept out
//! of the search: it is solved for first, and every direction is made conjugate to it. Then `u = K s x` carries as much
//! up as the ground sends up, so that energy balances after any number of steps.

use super::carrier::Carrier;
use super::pair::{Pair, add, both, dot, each, mean, times};

/// Least part of light that a cloud does not send back.
const LEAST_NOT_REFLECTED: f64 = 1e-9;
/// Residual, relative to the source, below which rounding is all that is left.
const ROUNDING: f64 = 1e-14;

/// How the exchange is solved. Each stops when a pass changes less than the tolerance. What conjugate gradients then leave
/// is below the tolerance (root of the mean square; single texels up to three times it); passes may leave several times it,
/// as each of them changes little less than the one before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Solver {
    /// At most so many times ground - cloud - ground, from light that has met the ground not yet.
    Passes(u32),
    /// The same from even light, all light multiplied after each pass so that as much leaves as enters.
    BalancedPasses(u32),
    /// Conjugate gradients. Energy balances after any number of passes. Meant for
    /// [`Kernel::Fourier`](super::carrier::Kernel::Fourier): the rings are not symmetric, so that with them it ends up to 1 % of
    /// the mean away from where passes settle (chart "exchange").
    ConjugateGradients {
        /// At most so many steps, each as dear as a pass ground - cloud - ground; the start and the end take one more each.
        passes: u32,
    },
}

pub(super) fn not_closed(not_reflected: Pair) -> Pair {
    each(not_reflected, both(LEAST_NOT_REFLECTED), f64::max)
}

pub(super) struct Inputs {
    pub(super) albedo: Vec<Pair>,
    pub(super) beam: Vec<Pair>,
    pub(super) diffuse: Vec<Pair>,
    pub(super) not_reflected: Vec<Pair>,
}

pub(super) struct Solved {
    pub(super) irradiance: Vec<Pair>,
    pub(super) gathered: Vec<Pair>,
    pub(super) upwelling: Vec<Pair>,
    pub(super) passes: u32,
    pub(super) change: f64,
}

/// Light that comes up, and how it was found.
struct Found {
    upwelling: Vec<Pair>,
    passes: u32,
    change: f64,
}

pub(super) fn solve(carrier: &Carrier, inputs: Inputs, solver: Solver, tolerance: f64) -> Solved {
    let dark = inputs.albedo.iter().all(|albedo| albedo.re <= 0.0 && albedo.im <= 0.0);
    let found = match solver {
        _ if dark => Found { upwelling: vec![Pair::default(); inputs.albedo.len()], passes: 0, change: 0.0 },
        Solver::Passes(passes) => by_passes(carrier, &inputs, passes, tolerance, false),
        Solver::BalancedPasses(passes) => by_passes(carrier, &inputs, passes, tolerance, true),
        Solver::ConjugateGradients { passes } => by_gradients(carrier, &inputs, passes, tolerance),
    };
    let positive = |light: Pair| each(light, Pair::default(), f64::max);
    let gathered: Vec<Pair> = below(carrier, &inputs, &found.upwelling).into_iter().map(positive).collect();
    Solved {
        irradiance: inputs.beam.iter().zip(&gathered).map(|(beam, gathered)| beam + gathered).collect(),
        gathered,
        upwelling: found.upwelling.into_iter().map(positive).collect(),
        passes: found.passes,
        change: found.change,
    }
}

/// Diffuse irradiance of the ground when so much comes up to the base.
fn below(carrier: &Carrier, inputs: &Inputs, upwelling: &[Pair]) -> Vec<Pair> {
    let base = inputs.diffuse.iter().zip(upwelling).zip(&inputs.not_reflected);
    let mut light: Vec<Pair> = base.map(|((diffuse, up), part)| diffuse + times(*up, both(1.0) - part)).collect();
    carrier.gather(&mut light);
    light
}

/// The larger colour of a ratio; 0 / 0 is 0.
fn worst_ratio(above: Pair, below: Pair) -> f64 {
    let ratio = each(above, below, |above, below| if above > 0.0 { above / below } else { 0.0 });
    ratio.re.max(ratio.im)
}

fn by_passes(carrier: &Carrier, inputs: &Inputs, passes: u32, tolerance: f64, balanced: bool) -> Found {
    let mut upwelling = vec![Pair::default(); inputs.albedo.len()];
    let mut change = 0.0;
    let mut irradiance = below(carrier, inputs, &upwelling);
    irradiance.iter_mut().zip(&inputs.beam).for_each(|(light, beam)| *light += beam);
    let entering = mean(&irradiance);
    if balanced {
        irradiance.fill(both(1.0));
    }
    for pass in 0..passes {
        upwelling = inputs.albedo.iter().zip(&irradiance).map(|(albedo, light)| times(*albedo, *light)).collect();
        carrier.gather(&mut upwelling);
        let mut scale = both(1.0);
        if balanced {
            let absorbed = inputs.albedo.iter().zip(&irradiance).map(|(a, light)| times(both(1.0) - a, *light));
            let lost = absorbed.sum::<Pair>() + dot(&inputs.not_reflected, &upwelling);
            let leaving = lost / irradiance.len() as f64;
            scale = each(entering, leaving, |entering, leaving| if leaving > 0.0 { entering / leaving } else { 1.0 });
            upwelling.iter_mut().for_each(|light| *light = times(*light, scale));
        }
        let mut next = below(carrier, inputs, &upwelling);
        next.iter_mut().zip(&inputs.beam).for_each(|(light, beam)| *light += beam);
        let square = next.iter().zip(&irradiance).map(|(next, light)| {
            let difference = next - times(scale, *light);
            times(difference, difference)
        });
        let square = square.sum::<Pair>() / next.len() as f64;
        change = worst_ratio(each(square, square, |square, _| square.sqrt()), mean(&next));
        irradiance = next;
        if change <= tolerance {
            return Found { upwelling, passes: pass + 1, change };
        }
    }
    Found { upwelling, passes, change }
}

/// `A` of the symmetric form, with maps to work in.
struct System<'a> {
    carrier: &'a Carrier,
    inputs: &'a Inputs,
    root: &'a [Pair],
    spare: [Vec<Pair>; 2],
}

impl System<'_> {
    /// `A x` into `lost`, as `(1 - a) x + s (1 - K R K) s x`: sums of what is lost, no differences.
    fn apply(&mut self, x: &[Pair], lost: &mut [Pair]) {
        let texels = lost.iter_mut().zip(x.iter().zip(self.root));
        texels.for_each(|(lost, (x, root))| *lost = times(*x, *root));
        self.carrier.lose(lost, &self.inputs.not_reflected, &mut self.spare);
        let texels = lost.iter_mut().zip(self.root).zip(x.iter().zip(&self.inputs.albedo));
        texels.for_each(|((lost, root), (x, albedo))| *lost = times(*lost, *root) + times(both(1.0) - albedo, *x));
    }
}

/// A step or a share; 0 for a colour that has nothing to search (black ground, no light, solved).
fn quotient(above: Pair, below: Pair) -> Pair {
    each(above, below, |above, below| if below > 0.0 { above / below } else { 0.0 })
}

fn by_gradients(carrier: &Carrier, inputs: &Inputs, passes: u32, tolerance: f64) -> Found {
    let root: Vec<Pair> = inputs.albedo.iter().map(|a| each(*a, *a, |a, _| a.max(0.0).sqrt())).collect();
    let mut residual = below(carrier, inputs, &vec![Pair::default(); root.len()]);
    let texels = residual.iter_mut().zip(&inputs.beam).zip(&root);
    texels.for_each(|((light, beam), root)| *light = times(*light + beam, *root));
    let nothing = dot(&residual, &residual) * ROUNDING.powi(2);

    let map = || vec![Pair::default(); root.len()];
    let mut system = System { carrier, inputs, root: &root, spare: [map(), map()] };
    let mut lost_even = map();
    system.apply(&root, &mut lost_even);
    let even_loss = dot(&root, &lost_even);
    let even = quotient(dot(&root, &residual), even_loss);
    let mut x: Vec<Pair> = root.iter().map(|root| times(even, *root)).collect();
    add(&mut residual, -even, &lost_even);

    let (mut direction, mut lost) = (map(), map());
    let mut before = Pair::default();
    let mut made = 0;
    let mut change = 0.0;
    while made < passes {
        let square = dot(&residual, &residual);
        let open = each(square, nothing, |square, nothing| if square > nothing { 1.0 } else { 0.0 });
        if open == Pair::default() {
            break;
        }
        let share = times(quotient(square, before), open);
        before = square;
        let towards_even = quotient(dot(&lost_even, &residual), even_loss);
        for ((direction, residual), root) in direction.iter_mut().zip(&residual).zip(&root) {
            *direction = residual - times(towards_even, *root) + times(share, *direction);
        }
        system.apply(&direction, &mut lost);
        let length = times(quotient(dot(&residual, &direction), dot(&direction, &lost)), open);
        add(&mut x, length, &direction);
        add(&mut residual, -length, &lost);
        made += 1;
        // s times the step of the irradiance: what the step sends up and gets back.
        let back = direction.iter().zip(&lost).map(|(direction, lost)| times(length, direction - lost));
        let step = back.map(|back| times(back, back)).sum::<Pair>();
        change = worst_ratio(step, dot(&x, &x)).sqrt();
        if change <= tolerance {
            break;
        }
    }
    let mut upwelling: Vec<Pair> = x.iter().zip(&root).map(|(x, root)| times(*x, *root)).collect();
    carrier.gather(&mut upwelling);
    Found { upwelling, passes: made, change }
}
