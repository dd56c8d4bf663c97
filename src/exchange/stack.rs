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

/// Layers as one cloud, seen from below.
#[derive(Clone, Debug)]
pub struct Stack<'a> {
    layers: &'a [Layer<'a>],
    angles: StackAngles<'a>,
    sky: [f64; 3],
    diffuse: Vec<[f32; 3]>,
    not_reflected: Vec<[f32; 3]>,
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

/// Light in one texel and colour as all that is above a layer leaves it.
struct Above<const N: usize> {
    /// Coming down if nothing came up.
    down: Moments<N>,
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

/// Light in one texel and colour on the faces of a layer, and what it keeps of it.
#[derive(Clone, Copy, Default)]
struct Faces {
    from_above: f64,
    from_below: f64,
    kept: f64,
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

impl<const N: usize> Above<N> {
    /// Nothing above sends light back.
    fn sky(sky: f64) -> Self {
        let down = std::array::from_fn(|k| if k == 0 { sky } else { 0.0 });
        Self { down, sent_back: [[0.0; N]; N], not_sent_back: 1.0 }
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

    /// What between this layer and all above it becomes of light on the way down, `arriving`, which goes to and fro there:
    /// the columns of `arriving` over `1 - sent back * reflected`, by elimination. The first pivot, which may be tiny, is formed
    /// without differences. Nothing else comes near 0: beyond the flux nothing goes to and fro for long.
    fn between<const M: usize>(&self, above: &Above<N>, arriving: [[f64; M]; N]) -> [[f64; M]; N] {
        let Above { sent_back, not_sent_back, .. } = above;
        let round_trip = product(sent_back, &self.reflected);
        let mut system: Matrix<N> =
            std::array::from_fn(|k| std::array::from_fn(|l| f64::from(u8::from(k == l)) - round_trip[k][l]));
        let others: f64 = (1..N).map(|k| sent_back[0][k] * self.reflected[k][0]).sum();
        let leaving = not_sent_back + (1.0 - not_sent_back) * self.not_reflected;
        system[0][0] = (leaving - others).max(LEAST_LEAVING);
        let mut solved = arriving;
        for pivot in 0..N {
            let (system_row, solved_row) = (system[pivot], solved[pivot]);
            for row in (0..N).filter(|row| *row != pivot) {
                let factor = system[row][pivot] / system_row[pivot];
                system[row].iter_mut().zip(system_row).skip(pivot).for_each(|(to, from)| *to -= factor * from);
                solved[row].iter_mut().zip(solved_row).for_each(|(to, from)| *to -= factor * from);
            }
        }
        std::array::from_fn(|k| solved[k].map(|value| value / system[k][k]))
    }

    /// Light on the top: what comes down, and what the layer sends up, its own light and that `through` it, and gets back.
    fn on_top(&self, above: &Above<N>, through: &Moments<N>) -> Moments<N> {
        let arriving = sum(&above.down, &applied(&above.sent_back, &sum(&self.up, through)));
        self.between(above, arriving.map(|moment| [moment])).map(|[moment]| moment)
    }

    /// The stack down to and with this layer, from the stack above it.
    fn add(&self, above: &Above<N>) -> Above<N> {
        let on_top = self.on_top(above, &[0.0; N]);
        let sent_down = self.between(above, product(&above.sent_back, &self.transmitted));
        let passing = product(&self.transmitted, &sent_down);
        let not_sent_back = self.not_reflected - passing[0][0];
        let mut sent_back: Matrix<N> =
            std::array::from_fn(|k| std::array::from_fn(|l| self.reflected[k][l] + passing[k][l]));
        sent_back[0][0] = 1.0 - not_sent_back;
        Above { down: sum(&self.down, &applied(&self.transmitted, &on_top)), sent_back, not_sent_back }
    }
}

impl<'a> Stack<'a> {
    /// Adds `layers`, from top to bottom, of `texels` texels each, under even skylight: its horizontal irradiance, >= 0. `angles`
    /// are those of all layers, or none.
    ///
    /// # Panics
    /// If a map has fewer texels.
    #[must_use]
    pub fn new(layers: &'a [Layer<'a>], angles: StackAngles<'a>, texels: usize, sky: [f64; 3]) -> Self {
        let mut stack = Self { layers, angles, sky, diffuse: Vec::new(), not_reflected: Vec::new() };
        let whole = |texel: usize| match angles {
            [] => stack.whole::<1>(texel),
            _ => stack.whole::<MOMENTS>(texel),
        };
        (stack.diffuse, stack.not_reflected) = (0..texels).into_par_iter().map(whole).unzip();
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

    /// Without the sunlight that it scatters where it is not `sunlit`.
    fn column<const N: usize>(&self, layer: usize, [texel, colour]: [usize; 2], sunlit: bool) -> Column<N> {
        let column = Column::new(&self.layers[layer], self.angles.get(layer), texel, colour);
        if sunlit { column } else { Column { down: [0.0; N], up: [0.0; N], ..column } }
    }

    fn whole<const N: usize>(&self, texel: usize) -> ([f32; 3], [f32; 3]) {
        let colours = [0, 1, 2].map(|colour| {
            let from_sky = Above::<N>::sky(self.sky[colour]);
            (0..self.layers.len()).fold(from_sky, |above, layer| self.column(layer, [texel, colour], true).add(&above))
        });
        (colours.each_ref().map(|whole| whole.down[0] as f32), colours.map(|whole| whole.not_sent_back as f32))
    }

    /// Light on the faces of the layers from one on downwards, in a texel and colour, under what is `above` them, with the sunlight that
    /// they scatter or without; returns what they send up.
    fn descend<const N: usize>(
        &self,
        above: &Above<N>,
        (layer, place, sunlit): (usize, [usize; 2], bool),
        ground: f64,
        faces: &mut [Faces],
    ) -> Moments<N> {
        let Some((own, lower)) = faces.split_first_mut() else {
            return std::array::from_fn(|k| if k == 0 { ground } else { 0.0 });
        };
        let column = self.column::<N>(layer, place, sunlit);
        let below = self.descend(&column.add(above), (layer + 1, place, sunlit), ground, lower);
        let through = applied(&column.transmitted, &below);
        let on_top = column.on_top(above, &through);
        let kept = column.absorbed(&on_top) + column.absorbed(&below);
        *own = Faces { from_above: on_top[0], from_below: below[0], kept };
        sum(&sum(&column.up, &through), &applied(&column.reflected, &on_top))
    }

    /// Light on the faces of all layers in a texel and colour, from top to bottom; returns what escapes.
    fn lit<const N: usize>(&self, place: [usize; 2], ground: f64, sunlit: bool, faces: &mut [Faces]) -> f64 {
        self.descend(&Above::<N>::sky(self.sky[place[1]]), (0, place, sunlit), ground, faces)[0]
    }

    /// Light on all layers when the lowest base gets the irradiance `upwelling` from the ground.
    ///
    /// # Panics
    /// If the map has fewer texels than the layers.
    #[must_use]
    pub fn light(&self, upwelling: &[[f32; 3]]) -> StackLight {
        let (texels, count) = (self.diffuse.len(), self.layers.len());
        let of_texel = |texel: usize, sunlit: bool, faces: &mut [Faces]| {
            [0, 1, 2].map(|colour| {
                let (ground, faces) =
                    (upwelling[texel][colour].into(), &mut faces[colour * count..(colour + 1) * count]);
                let escaping = match self.angles {
                    [] => self.lit::<1>([texel, colour], ground, sunlit, faces),
                    _ => self.lit::<MOMENTS>([texel, colour], ground, sunlit, faces),
                };
                escaping as f32
            })
        };
        let solved = |sunlit: bool| {
            let mut faces = vec![Faces::default(); 3 * count * texels];
            let escaping: Vec<[f32; 3]> = match count {
                0 => upwelling[..texels].to_vec(),
                _ => {
                    let chunks = faces.par_chunks_exact_mut(3 * count).enumerate();
                    chunks.map(|(i, faces)| of_texel(i, sunlit, faces)).collect()
                }
            };
            (faces, escaping)
        };
        let index = |layer: usize, texel: usize, colour: usize| (3 * texel + colour) * count + layer;
        let layers = |faces: &[Faces]| -> Vec<LayerLight> {
            let map = |layer: usize, value: fn(&Faces) -> f64| -> Vec<[f32; 3]> {
                let at = |texel: usize, colour: usize| value(&faces[index(layer, texel, colour)]) as f32;
                (0..texels).map(|texel| [0, 1, 2].map(|colour| at(texel, colour))).collect()
            };
            let layer = |layer: usize| LayerLight {
                from_above: map(layer, |faces| faces.from_above),
                from_below: map(layer, |faces| faces.from_below),
            };
            (0..count).map(layer).collect()
        };
        let (faces, escaping) = solved(true);
        let kept = |colour: usize| {
            let of_texel = |texel: usize| (0..count).map(|layer| faces[index(layer, texel, colour)].kept).sum::<f64>();
            (0..texels).map(of_texel).sum::<f64>() / texels.max(1) as f64
        };
        let absorbed = [0, 1, 2].map(kept);
        // Of one layer they are the same.
        let of_sky_and_ground = if count > 1 { layers(&solved(false).0) } else { layers(&faces) };
        StackLight { layers: layers(&faces), of_sky_and_ground, escaping, absorbed }
    }
}
