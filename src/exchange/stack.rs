//! Diffuse light between layers of cloud, one above the other, in each column by itself.
//!
//! Layers are added from the top down: what is above a layer sends a part of the light from below back. From below the
//! whole stack is then one cloud: so much diffuse light leaves its base, so much of light from below does not come back.
//! Once the light from the ground is known, the light on both faces of every layer follows from the lowest upwards.
//! Layers do not shift light sideways.

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

/// Layers as one cloud, seen from below.
#[derive(Clone, Debug)]
pub struct Stack<'a> {
    layers: &'a [Layer<'a>],
    /// Above each layer: light coming down if nothing came up, and the part of light from below that is not sent back.
    above: Vec<Vec<[[f32; 3]; 2]>>,
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
    /// Diffuse light that leaves the topmost layer upwards: horizontal irradiance. With no layer, light from the ground.
    pub escaping: Vec<[f32; 3]>,
    /// Diffuse light that the layers absorb, mean over the texels: what each keeps of the light on its two faces. What they absorb
    /// of the sun's light before it is diffuse is not known here.
    pub absorbed: [f64; 3],
}

/// Least part of light between two layers that leaves there on a round trip.
const LEAST_LEAVING: f64 = 1e-12;

/// A layer in one texel and colour.
struct Column {
    down: f64,
    up: f64,
    transmitted: f64,
    absorbed: f64,
    not_reflected: f64,
}

impl Column {
    fn new(layer: &Layer<'_>, texel: usize, colour: usize) -> Self {
        let at = |map: &[[f32; 3]]| f64::from(map[texel][colour]);
        let not_reflected = at(layer.not_reflected);
        // More would be light from nowhere; tables of the two may differ by as much.
        let transmitted = at(layer.transmitted).min(not_reflected);
        Self {
            down: at(layer.down),
            up: at(layer.up),
            transmitted,
            absorbed: not_reflected - transmitted,
            not_reflected,
        }
    }

    /// Part of light on the top that leaves the gap above it on a round trip, 1 - R R', without differences.
    fn leaving(&self, above_not_reflected: f64) -> f64 {
        (above_not_reflected + (1.0 - above_not_reflected) * self.not_reflected).max(LEAST_LEAVING)
    }

    /// Light on the top: what comes `down`, and what the layer sends up, its own light and that `through` it, and gets back.
    fn on_top(&self, down: f64, above_not_reflected: f64, through: f64) -> f64 {
        let sent_back = (1.0 - above_not_reflected) * (self.up + through);
        (down + sent_back) / self.leaving(above_not_reflected)
    }

    /// The stack down to and with this layer, from the stack above it.
    fn add(&self, [down, above_not_reflected]: [f64; 2]) -> [f64; 2] {
        let on_top = self.on_top(down, above_not_reflected, 0.0);
        let leaving = self.leaving(above_not_reflected);
        let passing = (above_not_reflected + (1.0 - above_not_reflected) * self.absorbed) / leaving;
        [self.down + self.transmitted * on_top, self.absorbed + self.transmitted * passing]
    }
}

impl<'a> Stack<'a> {
    /// Adds `layers`, from top to bottom, of `texels` texels each, under even skylight: its horizontal irradiance, >= 0.
    ///
    /// # Panics
    /// If a map has fewer texels.
    #[must_use]
    pub fn new(layers: &'a [Layer<'a>], texels: usize, sky: [f64; 3]) -> Self {
        let mut above: Vec<_> = layers.iter().map(|_| vec![[[0.0; 3]; 2]; texels]).collect();
        let mut diffuse = vec![[0.0; 3]; texels];
        let mut not_reflected = diffuse.clone();
        for texel in 0..texels {
            for (colour, sky) in sky.iter().enumerate() {
                // Nothing above sends light back.
                let mut state = [*sky, 1.0];
                for (layer, above) in layers.iter().zip(&mut above) {
                    let [down, part] = state.map(|value| value as f32);
                    above[texel][0][colour] = down;
                    above[texel][1][colour] = part;
                    state = Column::new(layer, texel, colour).add(state);
                }
                diffuse[texel][colour] = state[0] as f32;
                not_reflected[texel][colour] = state[1] as f32;
            }
        }
        Self { layers, above, diffuse, not_reflected }
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
        let texels = self.diffuse.len();
        let mut escaping = upwelling[..texels].to_vec();
        let mut lights = Vec::with_capacity(self.layers.len());
        let mut kept = [0.0; 3];
        for (layer, above) in self.layers.iter().zip(&self.above).rev() {
            let from_below = escaping.clone();
            let mut from_above = vec![[0.0; 3]; texels];
            for (texel, [down, part]) in above.iter().enumerate() {
                for colour in 0..3 {
                    let column = Column::new(layer, texel, colour);
                    let through = column.transmitted * f64::from(from_below[texel][colour]);
                    let on_top = column.on_top(down[colour].into(), part[colour].into(), through);
                    from_above[texel][colour] = on_top as f32;
                    kept[colour] += column.absorbed * (on_top + f64::from(from_below[texel][colour]));
                    escaping[texel][colour] = (column.up + through + (1.0 - column.not_reflected) * on_top) as f32;
                }
            }
            lights.push(LayerLight { from_above, from_below });
        }
        lights.reverse();
        StackLight { layers: lights, escaping, absorbed: kept.map(|sum| sum / texels.max(1) as f64) }
    }
}
