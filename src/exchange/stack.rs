//! Diffuse light between layers of cloud, one above the other, in each column by itself.
//!
//! Layers are added from the top down: what is above a layer sends a part of the light from below back. From below the
//! whole stack is then one cloud: so much diffuse light leaves its base, so much of light from below does not come back.
//! Once the light from the ground is known, the light on both faces of every layer follows from the lowest upwards.
//! Layers do not shift light sideways.
//!
//! Light of one layer is even. Between several it has moments over its angles ([`crate::slab::angles`]), and layers have
//! matrices between these. Light of sky and ground is even always.

use crate::slab::angles::{AngleSlice, Angles, MOMENTS};
use rayon::prelude::*;

/// A layer of cloud, as maps of as many texels each; colours are red, green, blue. Light is horizontal irradiance.
#[derive(Clone, Copy, Debug)]
pub struct Layer<'a> {
    /// Sunlight scattered in the layer that leaves its base downwards, >= 0.
    pub down: &'a [[f32; 3]],
    /// Sunlight scattered in the layer that leaves its top upwards, >= 0.
    pub up: &'a [[f32; 3]],
    /// Transmitted part of even light, 0..=1; 1 where there is no cloud. Taken as at most `not_reflected`.
    pub transmitted: &'a [[f32; 3]],
    /// Part of even light that does not come back, 1 - R, 0..=1; 1 where there is no cloud.
    pub not_reflected: &'a [[f32; 3]],
}

/// How the layers of a stack treat light by its angles, from top to bottom, for red, green and blue; none for one layer, whose
/// light is even.
pub type StackAngles<'a> = &'a [[AngleSlice; 3]];

/// Layers as one cloud, seen from below, and what light from the ground makes of the light on them.
#[derive(Clone, Debug)]
pub struct Stack {
    layers: usize,
    diffuse: Vec<[f32; 3]>,
    not_reflected: Vec<[f32; 3]>,
    /// By texel, colour, layer: on top and base.
    faces: Vec<[Parts<f32>; 2]>,
    /// By texel and colour.
    whole: Vec<Whole>,
}

/// Diffuse light on the faces of a layer: horizontal irradiance.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerLight {
    /// On its top.
    pub from_above: Vec<[f32; 3]>,
    /// On its base.
    pub from_below: Vec<[f32; 3]>,
}

/// All light of a stack.
#[derive(Clone, Debug, PartialEq)]
pub struct StackLight {
    /// On the layers, from top to bottom.
    pub layers: Vec<LayerLight>,
    /// The same but for sunlight that has only met layers: of sky and ground alone, and what layers make of that.
    pub of_sky_and_ground: Vec<LayerLight>,
    /// Diffuse light that leaves the topmost layer upwards: horizontal irradiance. With no layer, light from the ground.
    pub escaping: Vec<[f32; 3]>,
    /// Diffuse light that the layers absorb, mean over the texels: what each keeps of the light on its two faces. What they absorb
    /// of the sun's light before it is diffuse is not known here.
    pub absorbed: [f64; 3],
}

/// Least part of light between two layers that leaves there on a round trip.
const LEAST_LEAVING: f64 = 1e-12;

/// Moments of light; the first is its flux.
type Moments<const N: usize> = [f64; N];
/// Between moments.
type Matrix<const N: usize> = [[f64; N]; N];

/// Light by where it comes from: it is the sum of what layers scatter of the sun's, of the sky's, and of so much for each unit of light
/// from the ground.
#[derive(Clone, Copy, Debug, Default)]
struct Parts<T> {
    sun: T,
    sky: T,
    ground: T,
}

/// What leaves a stack upwards, and what its layers keep.
#[derive(Clone, Copy, Debug, Default)]
struct Whole {
    escaping: Parts<f32>,
    kept: Parts<f32>,
}

/// Light in one texel and colour as all that is above a layer leaves it.
struct Above<const N: usize> {
    /// Coming down if nothing came up. None of it is the ground's.
    sun: Moments<N>,
    sky: Moments<N>,
    /// Sent back of light from below.
    sent_back: Matrix<N>,
    /// One minus its first entry, with all digits.
    not_sent_back: f64,
}

/// A layer in one texel and colour.
struct Column<const N: usize> {
    down: Moments<N>,
    up: Moments<N>,
    transmitted: Matrix<N>,
    reflected: Matrix<N>,
    not_reflected: f64,
}

/// Light on the top of a layer, all that goes to and fro above it counted.
struct OnTop<const N: usize> {
    /// If nothing came through it from below.
    sun: Moments<N>,
    sky: Moments<N>,
    /// Of what comes through it from below.
    sent_back: Matrix<N>,
}

/// What a stack makes of light in a texel and colour.
struct Found<const N: usize> {
    /// Sent up.
    up: Parts<Moments<N>>,
    kept: Parts<f64>,
    diffuse: f64,
    not_reflected: f64,
}

fn applied<const N: usize>(matrix: &Matrix<N>, light: &Moments<N>) -> Moments<N> {
    std::array::from_fn(|k| (0..N).map(|l| matrix[k][l] * light[l]).sum())
}

fn sum<const N: usize>(a: &Moments<N>, b: &Moments<N>) -> Moments<N> {
    std::array::from_fn(|k| a[k] + b[k])
}

fn product<const N: usize>(a: &Matrix<N>, b: &Matrix<N>) -> Matrix<N> {
    std::array::from_fn(|k| std::array::from_fn(|l| (0..N).map(|m| a[k][m] * b[m][l]).sum()))
}

/// A symmetric matrix from its first entry and the five others.
fn symmetric<const N: usize>(first: f64, [b, c, d, e, f]: [f64; 5]) -> Matrix<N> {
    let all: Matrix<MOMENTS> = [[first, b, c], [b, d, e], [c, e, f]];
    std::array::from_fn(|k| std::array::from_fn(|l| all[k][l]))
}

/// Even light.
fn even<const N: usize>(flux: f64) -> Moments<N> {
    std::array::from_fn(|k| if k == 0 { flux } else { 0.0 })
}

impl<T: Copy> Parts<T> {
    fn each<U>(&self, of: impl Fn(T) -> U) -> Parts<U> {
        Parts { sun: of(self.sun), sky: of(self.sky), ground: of(self.ground) }
    }

    fn with<U: Copy, V>(&self, other: &Parts<U>, of: impl Fn(T, U) -> V) -> Parts<V> {
        Parts { sun: of(self.sun, other.sun), sky: of(self.sky, other.sky), ground: of(self.ground, other.ground) }
    }
}

impl Parts<f64> {
    /// As it is kept: memory, not arithmetic, is what wide domains of several layers are short of.
    fn rounded(&self) -> Parts<f32> {
        self.each(|part| part as f32)
    }
}

impl Parts<f32> {
    fn of_sky_and_ground(&self, ground: f32) -> f64 {
        f64::from(self.sky) + f64::from(self.ground) * f64::from(ground)
    }

    fn all(&self, ground: f32) -> f64 {
        f64::from(self.sun) + self.of_sky_and_ground(ground)
    }
}

impl<const N: usize> Column<N> {
    fn new(layer: &Layer<'_>, angles: Option<&[AngleSlice; 3]>, texel: usize, colour: usize) -> Self {
        let at = |map: &[[f32; 3]]| f64::from(map[texel][colour]);
        let not_reflected = at(layer.not_reflected);
        // More would be light from nowhere; tables of the two may differ by as much.
        let transmitted = at(layer.transmitted).min(not_reflected);
        let Angles { down, up, transmitted: through, reflected: back } =
            angles.map_or_else(Angles::default, |angles| angles[colour].at(transmitted));
        let moments = |flux: f64, shape: [f64; MOMENTS - 1]| {
            std::array::from_fn(|k| if k == 0 { flux } else { flux * shape[k - 1] })
        };
        Self {
            down: moments(at(layer.down), down),
            up: moments(at(layer.up), up),
            transmitted: symmetric(transmitted, through),
            reflected: symmetric(1.0 - not_reflected, back),
            not_reflected,
        }
    }

    /// Of light on one of the faces.
    fn absorbed(&self, light: &Moments<N>) -> f64 {
        let parts = (1..N).map(|k| (self.transmitted[0][k] + self.reflected[0][k]) * light[k]);
        (self.not_reflected - self.transmitted[0][0]) * light[0] - parts.sum::<f64>()
    }

    /// What between this layer and all above it becomes of light on the way down, which goes to and fro there: that over
    /// `1 - sent back * reflected`, by elimination. The first pivot, which may be tiny, is formed without differences. Nothing else
    /// comes near 0: beyond the flux nothing goes to and fro for long.
    fn on_top(&self, above: &Above<N>) -> OnTop<N> {
        let Above { sent_back, not_sent_back, .. } = above;
        let round_trip = product(sent_back, &self.reflected);
        let mut system: Matrix<N> =
            std::array::from_fn(|k| std::array::from_fn(|l| f64::from(u8::from(k == l)) - round_trip[k][l]));
        let others: f64 = (1..N).map(|k| sent_back[0][k] * self.reflected[k][0]).sum();
        let leaving = not_sent_back + (1.0 - not_sent_back) * self.not_reflected;
        system[0][0] = (leaving - others).max(LEAST_LEAVING);
        // What the layer sends up of its own light comes back as well.
        let mut sun = sum(&above.sun, &applied(sent_back, &self.up));
        let (mut sky, mut back) = (above.sky, *sent_back);
        for pivot in 0..N {
            let (from, share) = (system[pivot], 1.0 / system[pivot][pivot]);
            let (from_back, from_sun, from_sky) = (back[pivot], sun[pivot], sky[pivot]);
            for row in (0..N).filter(|row| *row != pivot) {
                let factor = system[row][pivot] * share;
                // Before the pivot all is 0 but for rounding.
                system[row].iter_mut().zip(from).skip(pivot).for_each(|(to, from)| *to -= factor * from);
                back[row].iter_mut().zip(from_back).for_each(|(to, from)| *to -= factor * from);
                sun[row] -= factor * from_sun;
                sky[row] -= factor * from_sky;
            }
        }
        for (k, row) in system.iter().enumerate() {
            let share = 1.0 / row[k];
            sun[k] *= share;
            sky[k] *= share;
            back[k] = back[k].map(|value| value * share);
        }
        OnTop { sun, sky, sent_back: back }
    }

    /// The stack down to and with this layer.
    fn add(&self, on_top: &OnTop<N>) -> Above<N> {
        let sent_down = product(&on_top.sent_back, &self.transmitted);
        let passing = product(&self.transmitted, &sent_down);
        let not_sent_back = self.not_reflected - passing[0][0];
        let mut sent_back: Matrix<N> =
            std::array::from_fn(|k| std::array::from_fn(|l| self.reflected[k][l] + passing[k][l]));
        sent_back[0][0] = 1.0 - not_sent_back;
        let sun = sum(&self.down, &applied(&self.transmitted, &on_top.sun));
        Above { sun, sky: applied(&self.transmitted, &on_top.sky), sent_back, not_sent_back }
    }
}

/// What is solved: the layers, the angles of their light, and the sky's.
struct Given<'a> {
    layers: &'a [Layer<'a>],
    angles: StackAngles<'a>,
    sky: [f64; 3],
}

impl Given<'_> {
    /// What a texel's layers make of light, in a colour.
    fn solve<const N: usize>(&self, place: [usize; 2], faces: &mut [[Parts<f32>; 2]]) -> Found<N> {
        let open = Above { sun: [0.0; N], sky: even(self.sky[place[1]]), sent_back: [[0.0; N]; N], not_sent_back: 1.0 };
        self.descend(open, 0, place, faces)
    }

    /// The same of the layers from one on downwards, under what is `above` them.
    fn descend<const N: usize>(
        &self,
        above: Above<N>,
        number: usize,
        [texel, colour]: [usize; 2],
        faces: &mut [[Parts<f32>; 2]],
    ) -> Found<N> {
        let Some((own, lower)) = faces.split_first_mut() else {
            return Found {
                up: Parts { sun: [0.0; N], sky: [0.0; N], ground: even(1.0) },
                kept: Parts::default(),
                diffuse: above.sun[0] + above.sky[0],
                not_reflected: above.not_sent_back,
            };
        };
        let column = Column::<N>::new(&self.layers[number], self.angles.get(number), texel, colour);
        // Nothing above the first sends light back.
        let on_top = match number {
            0 => OnTop { sun: above.sun, sky: above.sky, sent_back: above.sent_back },
            _ => column.on_top(&above),
        };
        let Found { up: below, kept, diffuse, not_reflected } =
            self.descend(column.add(&on_top), number + 1, [texel, colour], lower);
        let through = below.each(|light| applied(&column.transmitted, &light));
        let alone = Parts { sun: on_top.sun, sky: on_top.sky, ground: [0.0; N] };
        let arriving = alone.with(&through, |alone, through| sum(&alone, &applied(&on_top.sent_back, &through)));
        *own = [&arriving, &below].map(|light| light.each(|light| light[0]).rounded());
        let absorbed = arriving.with(&below, |down, up| column.absorbed(&down) + column.absorbed(&up));
        let kept = kept.with(&absorbed, |lower, own| lower + own);
        let mut up = through.with(&arriving, |through, down| sum(&through, &applied(&column.reflected, &down)));
        up.sun = sum(&up.sun, &column.up);
        Found { up, kept, diffuse, not_reflected }
    }
}

/// Texels that one task takes.
const TEXELS: usize = 64;

impl Stack {
    /// Adds `layers`, from top to bottom, of `texels` texels each, under even skylight: its horizontal irradiance, >= 0. `angles`
    /// are those of all layers, or none.
    ///
    /// # Panics
    /// If a map has fewer texels.
    #[must_use]
    pub fn new(layers: &[Layer<'_>], angles: StackAngles<'_>, texels: usize, sky: [f64; 3]) -> Self {
        let (given, count) = (Given { layers, angles, sky }, layers.len());
        let mut stack = Self {
            layers: count,
            diffuse: vec![[0.0; 3]; texels],
            not_reflected: vec![[0.0; 3]; texels],
            faces: vec![Default::default(); 3 * texels * count],
            whole: vec![Whole::default(); 3 * texels],
        };
        // With no layer there are no faces to cut up.
        let mut faces: Vec<&mut [[Parts<f32>; 2]]> = match count {
            0 => (0..texels.div_ceil(TEXELS)).map(|_| &mut [][..]).collect(),
            _ => stack.faces.chunks_mut(3 * TEXELS * count).collect(),
        };
        let maps = stack.diffuse.par_chunks_mut(TEXELS).zip(stack.not_reflected.par_chunks_mut(TEXELS));
        let tasks = maps.zip(stack.whole.par_chunks_mut(3 * TEXELS)).zip(faces.par_iter_mut()).enumerate();
        tasks.for_each(|(task, (((diffuse, not_reflected), whole), faces))| {
            for (at, (diffuse, not_reflected)) in diffuse.iter_mut().zip(not_reflected).enumerate() {
                for colour in [0, 1, 2] {
                    let own = 3 * at + colour;
                    let faces = &mut faces[own * count..(own + 1) * count];
                    let place = [task * TEXELS + at, colour];
                    (diffuse[colour], not_reflected[colour], whole[own]) = match angles {
                        [] => given.solve::<1>(place, faces).in_short(),
                        _ => given.solve::<MOMENTS>(place, faces).in_short(),
                    };
                }
            }
        });
        stack
    }

    /// Diffuse light that leaves the lowest base downwards when nothing comes from the ground.
    #[must_use]
    pub fn diffuse(&self) -> &[[f32; 3]] {
        &self.diffuse
    }

    /// Part of even light from below that does not come back.
    #[must_use]
    pub fn not_reflected(&self) -> &[[f32; 3]] {
        &self.not_reflected
    }

    /// Light on all layers when the lowest base gets the irradiance `upwelling` from the ground.
    ///
    /// # Panics
    /// If the map has fewer texels than the layers.
    #[must_use]
    pub fn light(&self, upwelling: &[[f32; 3]]) -> StackLight {
        let (texels, count) = (self.diffuse.len(), self.layers);
        let colours = [0, 1, 2];
        let layers = |value: fn(&Parts<f32>, f32) -> f64| -> Vec<LayerLight> {
            let map = |layer: usize, face: usize| -> Vec<[f32; 3]> {
                let at = |texel: usize, colour: usize| {
                    let parts = &self.faces[(3 * texel + colour) * count + layer][face];
                    value(parts, upwelling[texel][colour]) as f32
                };
                (0..texels).into_par_iter().map(|texel| colours.map(|colour| at(texel, colour))).collect()
            };
            (0..count).map(|layer| LayerLight { from_above: map(layer, 0), from_below: map(layer, 1) }).collect()
        };
        let whole = |texel: usize, colour: usize| (&self.whole[3 * texel + colour], upwelling[texel][colour]);
        let escaping = |texel: usize, colour: usize| {
            let (Whole { escaping, .. }, ground) = whole(texel, colour);
            escaping.all(ground) as f32
        };
        let kept = |colour: usize| {
            let of_texel = |texel: usize| {
                let (Whole { kept, .. }, ground) = whole(texel, colour);
                kept.all(ground)
            };
            (0..texels).map(of_texel).sum::<f64>() / texels.max(1) as f64
        };
        StackLight {
            layers: layers(Parts::all),
            of_sky_and_ground: layers(Parts::of_sky_and_ground),
            escaping: (0..texels).map(|texel| colours.map(|colour| escaping(texel, colour))).collect(),
            absorbed: colours.map(kept),
        }
    }
}

impl<const N: usize> Found<N> {
    /// Light that leaves the lowest base downwards, what of light from below does not come back, and what the ground's light makes.
    fn in_short(&self) -> (f32, f32, Whole) {
        let whole = Whole { escaping: self.up.each(|light| light[0]).rounded(), kept: self.kept.rounded() };
        (self.diffuse as f32, self.not_reflected as f32, whole)
    }
}
