//! Light between ground and cloud base, and between layers of cloud, on the host.

#![expect(clippy::unwrap_used, reason = "a test stops where it fails")]

use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;
use skyloom::exchange::stack::{Layer, Stack};
use skyloom::exchange::{Exchanged, Kernel, Problem, Solver, exchange, gather};
use std::f64::consts::{PI, TAU};

const CONJUGATE: Solver = Solver::ConjugateGradients { passes: 6 };
const CONVERGED: Solver = Solver::ConjugateGradients { passes: 300 };

type Map = Vec<[f32; 3]>;

/// Maps of a problem.
#[derive(Clone, Debug)]
struct Sky {
    side: usize,
    height_texels: f64,
    albedo: Map,
    beam: Map,
    diffuse: Map,
    not_reflected: Map,
}

impl Sky {
    fn solve(&self, kernel: Kernel, solver: Solver, tolerance: f64) -> Exchanged {
        let problem = Problem {
            side: self.side,
            height_texels: self.height_texels,
            albedo: &self.albedo,
            beam: &self.beam,
            diffuse: &self.diffuse,
            not_reflected: &self.not_reflected,
        };
        exchange(&problem, kernel, solver, tolerance)
    }

    fn even(side: usize, albedo: f32, [beam, diffuse, not_reflected]: [f32; 3]) -> Self {
        let map = |value| vec![[value; 3]; side * side];
        let [albedo, beam, diffuse, not_reflected] = [albedo, beam, diffuse, not_reflected].map(map);
        Self { side, height_texels: 3.0, albedo, beam, diffuse, not_reflected }
    }

    /// Clouds of optical depth 60 under even light of 1: everywhere, or in half of the domain, with sunlit gaps. Colours
    /// are three fields of their own.
    fn clouds(side: usize, height_texels: f64, broken: bool, albedo: Map) -> Self {
        let fields = [1, 2, 3].map(|seed| fractal(side, seed));
        let texel = |i: usize, value: &dyn Fn(f64) -> f64| [0, 1, 2].map(|c| value(fields[c][i]) as f32);
        let map = |value: &dyn Fn(f64) -> f64| (0..side * side).map(|i| texel(i, value)).collect::<Map>();
        let depth = |field: f64| if broken { (100.0 * field).max(0.0) } else { (60.0 + 20.0 * field).max(1.0) };
        let through = |field: f64| 1.0 / (1.0 + 0.1 * depth(field));
        let gap = |field: f64| broken && depth(field) <= 0.0;
        Self {
            side,
            height_texels,
            albedo,
            beam: map(&|field| if gap(field) { 0.8 } else { 0.0 }),
            diffuse: map(&|field| if gap(field) { 0.2 } else { through(field) }),
            not_reflected: map(&through),
        }
    }
}

/// A smooth random field of mean 0 and variance 1 whose amplitudes fall as those of clouds do.
fn fractal(side: usize, seed: u64) -> Vec<f64> {
    let mut state = seed;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut field = vec![0.0; side * side];
    for octave in 0..side.ilog2() {
        for _ in 0..12 {
            let (angle, phase) = (TAU * random(), TAU * random());
            let cycles = (1.0 + random()) * f64::from(1 << octave);
            let [east, south] = [angle.cos(), angle.sin()].map(|part| (part * cycles).round());
            let amplitude = (6.0 * 2.5_f64).recip().sqrt() * cycles.powf(-1.0 / 3.0);
            for (i, value) in field.iter_mut().enumerate() {
                let place = (east * (i % side) as f64 + south * (i / side) as f64) / side as f64;
                *value += amplitude * (TAU * place + phase).cos();
            }
        }
    }
    field
}

fn even_ground(side: usize, albedo: f32) -> Map {
    vec![[albedo; 3]; side * side]
}

/// Water in the western half.
fn coast(side: usize, albedo: f32) -> Map {
    (0..side * side).map(|i| [if i % side < side / 2 { 0.06 } else { albedo }; 3]).collect()
}

/// Mean of a colour.
fn mean(map: &[[f32; 3]], colour: usize) -> f64 {
    map.iter().map(|texel| f64::from(texel[colour])).sum::<f64>() / map.len() as f64
}

/// Largest difference of two maps, relative to the mean of the second, of the worst colour.
fn difference(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    let of =
        |c: usize| a.iter().zip(b).map(move |(a, b)| f64::from((a[c] - b[c]).abs())).fold(0.0, f64::max) / mean(b, c);
    [0, 1, 2].map(of).into_iter().fold(0.0, f64::max)
}

/// What enters less what leaves, relative to what enters.
fn imbalance(sky: &Sky, light: &Exchanged, colour: usize) -> f64 {
    let sum = |value: &dyn Fn(usize) -> f64| (0..sky.albedo.len()).map(value).sum::<f64>();
    let at = |map: &Map, i: usize| f64::from(map[i][colour]);
    let entering = sum(&|i| at(&sky.beam, i) + at(&sky.diffuse, i));
    let leaving = sum(&|i| {
        at(&light.irradiance, i) * (1.0 - at(&sky.albedo, i)) + at(&light.upwelling, i) * at(&sky.not_reflected, i)
    });
    leaving / entering - 1.0
}

/// The worst difference of a solution from `exact`, and its imbalance.
fn assert_close(sky: &Sky, light: &Exchanged, exact: &[[f32; 3]], tolerance: f64, what: &str) {
    let error = difference(&light.irradiance, exact);
    assert!(error <= tolerance, "{what}: off by {error:.4} of the mean after {} passes", light.passes);
    for colour in 0..3 {
        // Maps are in single precision; sums of a thousand texels and more round by less than one of them.
        let energy = imbalance(sky, light, colour);
        assert!(energy.abs() < 1e-6, "{what}: imbalance {energy:e}");
    }
}

/// Waves are multiplied by the transform of the kernel, which damps those along an axis and those aslant alike; K1 from
/// Abramowitz & Stegun, table 9.8.
#[test]
fn waves_are_damped_exactly() {
    let side = 32;
    let table = [
        (0.1, 9.853_844_780_9),
        (0.5, 1.656_441_120_0),
        (1.0, 0.601_907_230_2),
        (2.0, 0.139_865_881_8),
        (5.0, 0.004_044_613_445),
    ];
    for [east, south] in [[1, 0], [0, 3], [2, 5], [16, 16]] {
        for (x, k1) in table {
            let number = TAU * f64::hypot(east.into(), south.into()) / side as f64;
            let phase =
                |i: usize| TAU * (east as usize * (i % side) + south as usize * (i / side)) as f64 / side as f64;
            let map: Vec<_> =
                (0..side * side).map(|i| [1.0 + phase(i).cos(), 2.0 * phase(i).cos(), -phase(i).cos()]).collect();
            for (i, light) in gather(&map, x / number, Kernel::Fourier).iter().enumerate() {
                let wave = x * k1 * phase(i).cos();
                for (light, exact) in light.iter().zip([1.0 + wave, 2.0 * wave, -wave]) {
                    // The fit of K1 is within 3e-7 of the transform; the wave of the second colour is twice as high.
                    assert!((light - exact).abs() < 6e-7, "{east} {south} {x}: {light} for {exact}");
                }
            }
        }
    }
}

/// Even light stays even at any distance and with any kernel; at distance 0 every map stays as it is.
#[test]
fn even_light_stays_even() {
    for side in [1, 2, 16, 256] {
        for height in [0.0, 1e-9, 0.3, 2.0, 7.7, 1e4] {
            for kernel in [Kernel::PaperRings, Kernel::FourTapRings, Kernel::Fourier] {
                let map = vec![[1.0, 0.5, 3.0]; side * side];
                for light in gather(&map, height, kernel) {
                    let error = light
                        .iter()
                        .zip([1.0, 0.5, 3.0])
                        .map(|(light, exact)| (light / exact - 1.0).abs())
                        .fold(0.0, f64::max);
                    // Rounding of a transform, or of sums of 16 samples a ring.
                    assert!(error < 1e-12, "{side} {height} {kernel:?}: {error:e}");
                }
            }
        }
    }
    let map: Vec<_> = fractal(16, 5).into_iter().map(|value| [value, -value, 1.0]).collect();
    let at_hand = gather(&map, 0.0, Kernel::Fourier);
    assert!(map.iter().zip(&at_hand).all(|(a, b)| (a[0] - b[0]).abs() < 1e-13 && (a[1] - b[1]).abs() < 1e-13));
}

/// Form factor from a horizontal element to a rectangle in a parallel plane at distance 1 with one corner above the element
/// and sides x and y; negative sides count backwards. Howell, A Catalog of Radiation Heat Transfer Configuration Factors, B-3.
fn corner(x: f64, y: f64) -> f64 {
    let half = |a: f64, b: f64| a / (1.0 + a * a).sqrt() * (b / (1.0 + a * a).sqrt()).atan();
    (half(x, y) + half(y, x)) / TAU
}

/// Form factor to the rectangle of these ranges.
fn rectangle([west, east]: [f64; 2], [south, north]: [f64; 2]) -> f64 {
    corner(east, north) - corner(west, north) - corner(east, south) + corner(west, south)
}

/// A square cloud of even light: below it, and across its edge, the ground gets the form factors of the square.
#[test]
fn a_square_cloud_lights_the_ground_by_its_form_factor() {
    for (side, known) in [(1.0, 0.2395), (2.0, 0.5541), (4.0, 0.8310), (8.0, 0.9514)] {
        assert!((rectangle([-side / 2.0, side / 2.0], [-side / 2.0, side / 2.0]) - known).abs() < 5e-5);
    }
    let (texels, height) = (256, 8.0);
    let tile = texels as f64 / height;
    for side in [1.0, 2.0, 4.0, 8.0] {
        let half = side / 2.0;
        let place = |i: usize| (i as f64 + 0.5) / height - tile / 2.0;
        let inside = |i: usize| place(i % texels).abs() < half && place(i / texels).abs() < half;
        let map: Vec<_> = (0..texels * texels).map(|i| [f64::from(u8::from(inside(i))); 3]).collect();
        let light = gather(&map, height, Kernel::Fourier);
        let mut worst: f64 = 0.0;
        for (x, y) in (0..texels).flat_map(|x| [(x, texels / 2), (x, x), (x, texels / 2 + (4.0 * side) as usize)]) {
            // Squares of the tiles around; what is farther is less than area / (pi distance^2)^2, summed 1e-4.
            let mut exact = 0.0;
            for (i, j) in (-4..=4).flat_map(|i| (-4..=4).map(move |j| (i, j))) {
                let range = |place: f64, tiles: i32| [-half, half].map(|edge| edge - place + f64::from(tiles) * tile);
                exact += rectangle(range(place(x), i), range(place(y), j));
            }
            worst = worst.max((light[y * texels + x][0] - exact).abs());
        }
        // Texels of an eighth of the height hold the square's waves to a part in a thousand.
        assert!(worst < 0.003, "side {side}: {worst}");
    }
}

/// Rings against the exact kernel: what the paper's give below the middle of square clouds, and how far both are off
/// for clouds with sharp edges. Values measured apart, at 8 texels a height.
#[test]
fn rings_are_off_by_what_is_known() {
    let texels = 256;
    for (side, known) in [(1, 0.125), (2, 0.5), (4, 0.8), (8, 0.84)] {
        let inside = |i: usize| (i as i64 - 128 + 4 * side) / (8 * side) == 0 && i as i64 >= 128 - 4 * side;
        let map: Vec<_> =
            (0..texels * texels).map(|i| [f64::from(u8::from(inside(i % texels) && inside(i / texels))); 3]).collect();
        let light = gather(&map, 8.0, Kernel::PaperRings);
        // Squares are made of whole texels of the mip levels; the weights are rounded to 5 digits.
        let middle = light[texels / 2 * texels + texels / 2][0];
        assert!((middle - known).abs() < 1e-5, "side {side}: {middle}");
    }
    let sharp: Vec<_> = fractal(texels, 3).into_iter().map(|v| [f64::from(u8::from(v > 0.0)); 3]).collect();
    let exact = gather(&sharp, 8.0, Kernel::Fourier);
    for (kernel, known) in [(Kernel::PaperRings, 0.062), (Kernel::FourTapRings, 0.02)] {
        let light = gather(&sharp, 8.0, kernel);
        let square = light.iter().zip(&exact).map(|(a, b)| (a[0] - b[0]).powi(2)).sum::<f64>() / light.len() as f64;
        let mean = exact.iter().map(|a| a[0]).sum::<f64>() / light.len() as f64;
        // Other random clouds than those of the known values.
        let error = square.sqrt() / mean;
        assert!((error / known - 1.0).abs() < 0.15, "{kernel:?}: {error} for {known}");
    }
}

/// Ground and cloud as one dense system of equations, solved by elimination.
fn dense(sky: &Sky, colour: usize) -> DVector<f64> {
    let count = sky.side * sky.side;
    let mut point = vec![[0.0; 3]; count];
    point[0] = [1.0; 3];
    let kernel = gather(&point, sky.height_texels, Kernel::Fourier);
    let between = |i: usize, j: usize| {
        let axis = |i: usize, j: usize| (i + sky.side - j) % sky.side;
        kernel[axis(i / sky.side, j / sky.side) * sky.side + axis(i % sky.side, j % sky.side)][0]
    };
    let vector = |map: &Map| DVector::from_fn(count, |i, _| f64::from(map[i][colour]));
    let k = DMatrix::from_fn(count, count, between);
    let reflected = DMatrix::from_diagonal(&vector(&sky.not_reflected).map(|part| 1.0 - part));
    let albedo = DMatrix::from_diagonal(&vector(&sky.albedo));
    let source = vector(&sky.beam) + &k * vector(&sky.diffuse);
    let system = DMatrix::identity(count, count) - &k * reflected * &k * albedo;
    system.lu().solve(&source).unwrap()
}

/// Six steps are exact to 1 % of the mean in every texel: against elimination at 16 texels a side, against the settled
/// solution at 64. Energy balances to the rounding of the maps in both.
#[test]
fn six_steps_solve_the_exchange() {
    for (side, extent_heights) in [(16, 10.0), (16, 32.0), (64, 10.0), (64, 32.0)] {
        for broken in [false, true] {
            for (ground, map) in [("even", even_ground as fn(usize, f32) -> Map), ("coast", coast)] {
                for albedo in [0.1, 0.2, 0.8, 0.95, 1.0] {
                    let sky = Sky::clouds(side, side as f64 / extent_heights, broken, map(side, albedo));
                    let what = format!("{side} texels, {extent_heights} h, broken {broken}, {ground} {albedo}");
                    let settled = sky.solve(Kernel::Fourier, CONVERGED, 1e-12);
                    assert!(settled.change <= 1e-12, "{what}: {settled:?}");
                    if side == 16 {
                        let mut exact = settled.irradiance.clone();
                        let solved = [0, 1, 2].map(|colour| dense(&sky, colour));
                        exact
                            .iter_mut()
                            .enumerate()
                            .for_each(|(i, texel)| *texel = [0, 1, 2].map(|c| solved[c][i] as f32));
                        // Both are double precision; maps are written in single.
                        assert_close(&sky, &settled, &exact, 1e-6, &what);
                    }
                    assert_close(&sky, &sky.solve(Kernel::Fourier, CONJUGATE, 0.0), &settled.irradiance, 0.01, &what);
                }
            }
        }
    }
}

/// Conjugate gradients stop where the irradiance is within the tolerance: root of the mean square, relative to the mean.
#[test]
fn steps_stop_within_the_tolerance() {
    for (broken, albedo) in [(false, 0.2), (true, 0.2), (false, 0.95), (true, 0.95), (true, 1.0)] {
        for ground in [even_ground as fn(usize, f32) -> Map, coast] {
            let sky = Sky::clouds(64, 2.0, broken, ground(64, albedo));
            let exact = sky.solve(Kernel::Fourier, CONVERGED, 1e-12).irradiance;
            for tolerance in [0.1, 0.01, 1e-3, 1e-4] {
                let light = sky.solve(Kernel::Fourier, CONVERGED, tolerance);
                for colour in 0..3 {
                    let pairs = light.irradiance.iter().zip(&exact);
                    let square =
                        pairs.map(|(light, exact)| f64::from(light[colour] - exact[colour]).powi(2)).sum::<f64>();
                    let error = (square / exact.len() as f64).sqrt() / mean(&exact, colour);
                    assert!(error <= tolerance, "{broken} {albedo} {tolerance}: {error} after {} steps", light.passes);
                }
            }
        }
    }
}

/// Every solver goes to the same light with the exact kernel.
#[test]
fn solvers_agree() {
    let sky = Sky::clouds(32, 3.2, true, coast(32, 0.6));
    let settled = sky.solve(Kernel::Fourier, CONVERGED, 1e-12);
    for solver in [Solver::Passes(200), Solver::BalancedPasses(200)] {
        let light = sky.solve(Kernel::Fourier, solver, 1e-9);
        assert!(light.passes < 200 && light.change <= 1e-9, "{solver:?}: {} passes", light.passes);
        assert_close(&sky, &light, &settled.irradiance, 1e-6, &format!("{solver:?}"));
    }
}

/// White ground under an even cloud that absorbs nothing gets all the light that falls on the cloud, however thick: what
/// comes through is bounced until it is absorbed somewhere, and there is nowhere.
#[test]
fn white_ground_gets_all_the_light() {
    for side in [1, 16] {
        for through in [0.5, 1e-3, 1e-6] {
            let sky = Sky::even(side, 1.0, [0.0, through, through]);
            let light = sky.solve(Kernel::Fourier, CONJUGATE, 1e-6);
            assert_eq!(light.passes, 0);
            // One rounding of the map; relative to it the solver's own, 1e-16 / 1e-6.
            assert!(light.irradiance.iter().flatten().all(|light| (light - 1.0).abs() < 1.2e-7), "{through}");
        }
        // No way out at all: whatever comes in stays, up to the least that a cloud is taken to let out.
        let sky = Sky::even(side, 1.0, [1.0, 0.0, 0.0]);
        let light = sky.solve(Kernel::Fourier, CONJUGATE, 1e-6);
        assert!(light.irradiance.iter().flatten().all(|light| light.is_finite() && *light <= 1.01e9));
        let nothing = Sky::even(side, 1.0, [0.0, 0.0, 0.0]).solve(Kernel::Fourier, CONJUGATE, 1e-6);
        assert!(nothing.irradiance.iter().flatten().all(|light| *light == 0.0));
    }
}

/// Black ground sends nothing back: no pass is made, and what it gets is the source.
#[test]
fn black_ground_needs_no_pass() {
    let sky = Sky::clouds(16, 2.0, true, even_ground(16, 0.0));
    let doubles = |texel: &[f32; 3]| texel.map(f64::from);
    let source = gather(&sky.diffuse.iter().map(doubles).collect::<Vec<_>>(), 2.0, Kernel::Fourier);
    for solver in [CONJUGATE, Solver::Passes(9), Solver::BalancedPasses(9)] {
        let light = sky.solve(Kernel::Fourier, solver, 1e-6);
        assert_eq!((light.passes, light.change), (0, 0.0));
        assert!(light.upwelling.iter().flatten().all(|light| *light == 0.0));
        for ((light, beam), source) in light.irradiance.iter().zip(&sky.beam).zip(&source) {
            assert!((0..3).all(|c| (f64::from(light[c]) - f64::from(beam[c]) - source[c]).abs() < 2e-7));
        }
    }
}

/// Half a tile further, the same light.
#[test]
fn light_moves_with_the_maps() {
    let moved =
        |map: &Map| -> Map { (0..32 * 32).map(|i| map[(i / 32 + 16) % 32 * 32 + (i % 32 + 16) % 32]).collect() };
    let sky = Sky::clouds(32, 4.0, true, coast(32, 0.8));
    let there = Sky {
        albedo: moved(&sky.albedo),
        beam: moved(&sky.beam),
        diffuse: moved(&sky.diffuse),
        not_reflected: moved(&sky.not_reflected),
        ..sky.clone()
    };
    let [light, there] = [sky, there].map(|sky| sky.solve(Kernel::Fourier, CONJUGATE, 0.0));
    assert!(difference(&there.irradiance, &moved(&light.irradiance)) < 1e-6);
    assert!(difference(&there.upwelling, &moved(&light.upwelling)) < 1e-6);
}

fn maps() -> impl Strategy<Value = Sky> {
    let map = |least: f32, most: f32| prop::collection::vec(prop::array::uniform3(least..=most), 64);
    let not_reflected =
        prop::collection::vec(prop::array::uniform3(prop_oneof![0.0_f32..=1.0, Just(0.0), Just(1.0)]), 64);
    (0.0..20.0, map(0.0, 1.0), map(0.0, 10.0), map(0.0, 3.0), not_reflected).prop_map(
        |(height_texels, albedo, beam, diffuse, not_reflected)| Sky {
            side: 8,
            height_texels,
            albedo,
            beam,
            diffuse,
            not_reflected,
        },
    )
}

proptest! {
    /// Rough maps give finite light that is not negative, at most that of an even ground and cloud that are everywhere as
    /// bright as the brightest texel; energy balances. Waves that the grid does not hold may overshoot by a few percent.
    #[test]
    fn random_maps_give_bounded_light(sky in maps()) {
        let light = sky.solve(Kernel::Fourier, Solver::ConjugateGradients { passes: 100 }, 1e-9);
        for colour in 0..3 {
            let most = |map: &Map| map.iter().map(|texel| f64::from(texel[colour])).fold(0.0, f64::max);
            let least_out = sky.not_reflected.iter().map(|texel| f64::from(texel[colour])).fold(1.0, f64::min);
            let white = most(&sky.albedo);
            let bound = (most(&sky.beam) + most(&sky.diffuse)) / (1.0 - white + white * least_out);
            for light in light.irradiance.iter().chain(&light.gathered).chain(&light.upwelling) {
                prop_assert!(light[colour].is_finite() && light[colour] >= 0.0);
                prop_assert!(f64::from(light[colour]) <= 1.1 * bound, "{} > {bound}", light[colour]);
            }
            // Light that was below 0 and is raised to 0 comes from nowhere: below one texel of height only.
            if sky.height_texels >= 2.0 {
                prop_assert!(imbalance(&sky, &light, colour).abs() < 1e-6);
            }
        }
    }

    /// Adding layers gives what bouncing light between them does, bounce by bounce; what enters a stack that absorbs
    /// nothing leaves it.
    #[test]
    fn stacks_add_as_light_bounces(
        layers in prop::collection::vec((0.0_f32..1.0, 0.0_f32..0.5, 0.0_f32..1.0, 0.05_f32..=1.0, 0.3_f32..=1.0), 0..5),
        (sky, ground) in (0.0_f64..2.0, 0.0_f32..2.0),
    ) {
        let map = |value: f32| vec![[value; 3]];
        // Transmittances as parts of what is not reflected.
        let maps: Vec<_> = layers.iter().map(|&(down, up, _, out, part)| [map(down), map(up), map(out * part), map(out)]).collect();
        let layers: Vec<_> = maps.iter().map(|m| Layer { down: &m[0], up: &m[1], transmitted: &m[2], not_reflected: &m[3] }).collect();
        let stack = Stack::new(&layers, &[], 1, [sky; 3]);
        let light = stack.light(&[[ground; 3]]);

        let count = layers.len();
        let at = |map: &[[f32; 3]]| f64::from(map[0][0]);
        // Light coming down onto each layer, and below the last; light coming up onto each layer's base, and above the first.
        let (mut down, mut up) = (vec![0.0; count + 1], vec![0.0; count + 1]);
        for _ in 0..3000 {
            down[0] = sky;
            up[count] = ground.into();
            for (i, layer) in layers.iter().enumerate() {
                let (through, back) = (at(layer.transmitted), 1.0 - at(layer.not_reflected));
                let (above, below) = (down[i], up[i + 1]);
                down[i + 1] = at(layer.down) + through * above + back * below;
                up[i] = at(layer.up) + through * below + back * above;
            }
        }
        // Layers keep their light in single precision, and what they gather is some sums of it.
        let close = |light: f32, exact: f64| (f64::from(light) - exact).abs() <= 3e-6 * exact.max(1e-3);
        for (i, layer) in light.layers.iter().enumerate() {
            prop_assert!(close(layer.from_above[0][0], down[i]), "{} for {}", layer.from_above[0][0], down[i]);
            prop_assert!(close(layer.from_below[0][1], up[i + 1]), "{} for {}", layer.from_below[0][1], up[i + 1]);
        }
        prop_assert!(close(light.escaping[0][2], up[0]));
        let below = f64::from(stack.diffuse()[0][0]) + (1.0 - f64::from(stack.not_reflected()[0][0])) * f64::from(ground);
        prop_assert!(close(below as f32, down[count]), "{below} for {}", down[count]);
    }
}

/// One layer is itself; gaps among layers change nothing, wherever they are; layers that absorb nothing keep all light,
/// even very thick ones: what is not reflected is then what is transmitted.
#[test]
fn stacks_of_special_layers() {
    let map = |value: f32| vec![[value, 0.5 * value, 0.25 * value]];
    let [down, up, through, out] = [0.3, 0.4, 0.5, 0.6].map(map);
    let cloud = Layer { down: &down, up: &up, transmitted: &through, not_reflected: &out };
    let (none, all) = (vec![[0.0; 3]], vec![[1.0; 3]]);
    let gap = Layer { down: &none, up: &none, transmitted: &all, not_reflected: &all };
    let alone = [cloud];
    let single = Stack::new(&alone, &[], 1, [0.0; 3]);
    assert_eq!((single.diffuse(), single.not_reflected()), (&down[..], &out[..]));
    let light = single.light(&[[2.0; 3]]);
    assert_eq!(light.layers[0].from_below, [[2.0; 3]]);
    let orders = [[gap, cloud, gap], [cloud, gap, gap], [gap, gap, cloud]];
    for order in orders {
        let stack = Stack::new(&order, &[], 1, [0.0; 3]);
        assert_eq!((stack.diffuse(), stack.not_reflected()), (single.diffuse(), single.not_reflected()));
        assert_eq!(stack.light(&[[2.0; 3]]).escaping, light.escaping);
    }
    let empty = Stack::new(&[], &[], 1, [PI; 3]);
    assert_eq!((empty.diffuse(), empty.not_reflected()), (&[[PI as f32; 3]][..], &all[..]));
    assert_eq!(empty.light(&[[2.0; 3]]).escaping, [[2.0; 3]]);

    for thick in [1.0, 0.1, 5e-4, 1e-7_f32] {
        let part = vec![[thick; 3]];
        let layer = Layer { down: &none, up: &none, transmitted: &part, not_reflected: &part };
        let layers = [layer; 4];
        let stack = Stack::new(&layers, &[], 1, [1.0; 3]);
        // Resistances add: 1 / T - 1 of four layers is four times that of one.
        let exact = 1.0 / (4.0 / f64::from(thick) - 3.0);
        for light in [stack.diffuse()[0][0], stack.not_reflected()[0][0]] {
            assert!((f64::from(light) / exact - 1.0).abs() < 2e-7, "{light} for {exact}");
        }
        // Even light from both sides stays even.
        let even = stack.light(&[[1.0; 3]]);
        for layer in &even.layers {
            // Ratios of numbers as small as the layer lets through, each rounded to single precision.
            assert!(
                (layer.from_above[0][0] - 1.0).abs() < 1e-6 && (layer.from_below[0][0] - 1.0).abs() < 1e-6,
                "{even:?}"
            );
        }
        assert!((even.escaping[0][0] - 1.0).abs() < 1e-6);
    }
}

/// A stack over the ground: what enters leaves at the top or is absorbed, with the exchange at the fixed number of steps.
#[test]
fn energy_of_a_stack_over_ground_balances() {
    let sky = Sky::clouds(16, 2.0, true, coast(16, 0.8));
    let high = Sky::clouds(16, 2.0, false, even_ground(16, 0.0));
    let none = vec![[0.0; 3]; 256];
    let layer = |sky: &'_ Sky| -> [Map; 2] { [sky.diffuse.clone(), sky.not_reflected.clone()] };
    let ([high_down, high_out], [low_down, low_out]) = (layer(&high), layer(&sky));
    let layers = [
        Layer { down: &high_down, up: &none, transmitted: &high_out, not_reflected: &high_out },
        Layer { down: &low_down, up: &low_down, transmitted: &low_out, not_reflected: &low_out },
    ];
    let stack = Stack::new(&layers, &[], 256, [0.25; 3]);
    let whole = Sky { diffuse: stack.diffuse().to_vec(), not_reflected: stack.not_reflected().to_vec(), ..sky };
    let ground = whole.solve(Kernel::Fourier, CONJUGATE, 0.0);
    let light = stack.light(&ground.upwelling);
    for colour in 0..3 {
        let entering = 0.25 + mean(&whole.beam, colour) + mean(&high_down, colour) + 2.0 * mean(&low_down, colour);
        let absorbed = ground.irradiance.iter().zip(&whole.albedo).map(|(light, a)| light[colour] * (1.0 - a[colour]));
        let leaving = mean(&light.escaping, colour) + absorbed.map(f64::from).sum::<f64>() / 256.0;
        // Single precision, a few roundings in each texel.
        assert!((leaving / entering - 1.0).abs() < 2e-6, "{leaving} for {entering}");
    }
}

/// Planes that touch exchange light in place; those that nearly do are not far from it.
#[test]
fn touching_planes_exchange_in_place() {
    let side = 32;
    let texel = |i: usize, a: f32, b: f32| [a + (b - a) * ((i * 7919) % 101) as f32 / 101.0; 3];
    let albedo: Vec<_> = (0..side * side).map(|i| texel(i, 0.0, 1.0)).collect();
    let not_reflected: Vec<_> = (0..side * side).map(|i| texel(i + 5, 0.1, 1.0)).collect();
    let diffuse: Vec<_> = (0..side * side).map(|i| texel(i + 9, 0.2, 0.9)).collect();
    let beam = vec![[0.3; 3]; side * side];
    let solve = |height_texels: f64| {
        let problem = Problem {
            side,
            height_texels,
            albedo: &albedo,
            beam: &beam,
            diffuse: &diffuse,
            not_reflected: &not_reflected,
        };
        exchange(&problem, Kernel::Fourier, Solver::ConjugateGradients { passes: 60 }, 1e-9).irradiance
    };
    let touching = solve(0.0);
    for i in 0..side * side {
        let (a, kept) = (f64::from(albedo[i][0]), f64::from(not_reflected[i][0]));
        let exact = f64::from(beam[i][0] + diffuse[i][0]) / (1.0 - a + a * kept);
        assert!((f64::from(touching[i][0]) / exact - 1.0).abs() < 1e-5, "{} not {exact}", touching[i][0]);
    }
    let near = solve(0.002);
    let mean = touching.iter().map(|light| f64::from(light[0])).sum::<f64>() / (side * side) as f64;
    let square = near.iter().zip(&touching).map(|(a, b)| f64::from(a[0] - b[0]).powi(2)).sum::<f64>();
    // The shortest waves lose 2e-4 each way, and light goes to and fro several times.
    assert!((square / (side * side) as f64).sqrt() < 2e-3 * mean);
}
