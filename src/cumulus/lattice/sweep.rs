//! One iteration: light runs along all lines, once each way.

use super::cells::Cells;
use super::lines::{Family, Lines};
use glam::{DVec4, Vec3, Vec4};
use rayon::prelude::*;

/// Mean radiance and its moments along x, y, z in a cube; lanes are red, green, blue.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct State(pub(super) [Vec4; 4]);

impl State {
    fn add(&mut self, weight: f32, flux: Vec3, passing: Vec4) {
        self.0[0] += weight * passing;
        self.0[1] += flux.x * passing;
        self.0[2] += flux.y * passing;
        self.0[3] += flux.z * passing;
    }
}

/// What is the same for all cubes.
pub(super) struct Border {
    /// Radiance from above and from below.
    pub(super) above: Vec4,
    pub(super) below: Vec4,
    pub(super) albedo: Vec4,
    /// Three times the asymmetry.
    pub(super) asymmetry: Vec4,
    pub(super) towards_sun: Vec3,
}

/// Weights of Lebedev's rule of degree 5: edges, diagonals.
const WEIGHTS: [f32; 2] = [1.0 / 15.0, 3.0 / 40.0];
/// Families that are summed together. The sums have the same order on any number of cores.
const GROUPS: [&[usize]; 4] = [&[0, 3], &[1, 4], &[2, 5], &[6]];

/// Sums over lines that leave the lattice below and above, of what light has gained over that of the border, weighted as flux.
pub(super) type Leaving = [DVec4; 2];

/// The state of the first `count` slots after an iteration, and what leaves. `state` is that of the cubes that hold cloud; light passes the
/// others unchanged.
pub(super) fn sweep(
    cells: &Cells,
    lines: &Lines,
    border: &Border,
    state: &[State],
    count: usize,
) -> (Vec<State>, Leaving) {
    let sums: Vec<(Vec<State>, Leaving)> = GROUPS
        .par_iter()
        .map(|group| {
            let (mut sum, mut leaving) = (vec![State::default(); count], Leaving::default());
            for &family in *group {
                run(cells, &lines.0[family], border, state, &mut sum, &mut leaving);
            }
            (sum, leaving)
        })
        .collect();
    let [a, b, c, d] = [0, 1, 2, 3].map(|group| sums[group].0.as_slice());
    let leaving = [0, 1].map(|side| sums.iter().map(|(_, leaving)| leaving[side]).sum());
    let next = (0..count)
        .into_par_iter()
        .map(|i| State(std::array::from_fn(|k| (a[i].0[k] + b[i].0[k]) + (c[i].0[k] + d[i].0[k]))))
        .collect();
    (next, leaving)
}

fn run(cells: &Cells, family: &Family, border: &Border, state: &[State], sum: &mut [State], leaving: &mut Leaving) {
    let step = family.step.map(|step| step as f32);
    let diagonal = usize::from(family.step[0] != 0 && family.step[2] != 0);
    let level = family.step[2] == 0;
    let forward = Vec3::from_array(step).normalize();
    for line in family.starts.windows(2) {
        let range = line[0] as usize..line[1] as usize;
        let (order, follow) = (&family.order[range.clone()], &family.follow[range]);
        for way in [1.0_f32, -1.0] {
            let towards = forward * way;
            // Light of the sun that is scattered along the line, per what arrives.
            let sun = Vec4::ONE - border.asymmetry * towards.dot(border.towards_sun);
            let along = [0, 1, 2].map(|i| border.asymmetry * towards[i]);
            let border_radiance = match () {
                () if level => 0.5 * (border.above + border.below),
                () if way > 0.0 => border.below,
                () => border.above,
            };
            let mut radiance = border_radiance;
            let weight = WEIGHTS[diagonal];
            let flux = towards * weight;
            let mut visit = |number: u32, follow: f32, keep: bool| {
                radiance = border_radiance + follow * (radiance - border_radiance);
                let number = number as usize;
                let Some(State([mean, x, y, z])) = state.get(number) else {
                    if let Some(sum) = sum.get_mut(number).filter(|_| keep) {
                        sum.add(weight, flux, radiance);
                    }
                    return;
                };
                let optics = &cells.optics[number];
                let scattered = optics.sun * sun + *mean + along[0] * *x + along[1] * *y + along[2] * *z;
                let source = (border.albedo * scattered).max(Vec4::ZERO);
                let from = radiance - source;
                if keep {
                    sum[number].add(weight, flux, source + from * optics.mean[diagonal]);
                }
                radiance = source + from * optics.transmittance[diagonal];
            };
            // A level line comes back to where it began: it is run through once for what arrives there.
            for keep in if level { &[false, true][..] } else { &[true][..] } {
                let last = order.len() - 1;
                for i in 0..=last {
                    match way > 0.0 {
                        true => visit(order[i], follow[i], *keep),
                        false => visit(order[last - i], follow[(last - i + 1) % (last + 1)], *keep),
                    }
                }
            }
            leaving[usize::from(way > 0.0)] += f64::from(flux.z.abs()) * (radiance - border_radiance).as_dvec4();
        }
    }
}
