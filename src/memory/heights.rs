//! Between which heights a layer's cloud lies, as far as its scene and its images tell before it is made.

use crate::job::Images;
use crate::scene::quantity::Quantity as _;
use crate::scene::{Edge, HeightMap, ImageName, Layer, Thickness};

/// Where a layer's cloud is, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Heights {
    /// Of its lowest base, no more than that.
    pub(super) base_m: f64,
    /// From its lowest base to its highest top, at most.
    pub(super) deepest_m: f64,
    /// The same, at least.
    pub(super) least_m: f64,
}

/// Deepest cloud of a synthetic field, in mean thicknesses: its soft clip, and how far columns that thin out are lifted.
const CLIP: f64 = 2.5;
const LIFT: f64 = 0.5;
/// Depth of a layer of which nothing is told, and that of the thinnest cloud that counts.
const UNKNOWN_M: f64 = 1000.0;
const LEAST_M: f64 = 1.0;

fn ends(images: &Images, name: &ImageName) -> Option<[f64; 2]> {
    let ends = images.get(&name.0)?.extremes().first()?;
    Some([ends.least, ends.greatest].map(f64::from))
}

/// Least and greatest height of an edge.
fn edge<Height>(edge: &Edge<Height>, images: &Images, flat: impl Fn(&Height) -> f64) -> Option<[f64; 2]> {
    let map = |map: &HeightMap| {
        let height_m = |sample: f64| map.offset_m.get() + map.scale_m.get() * sample;
        ends(images, &map.image).map(|ends| ends.map(height_m))
    };
    match edge {
        Edge::Open => None,
        Edge::Flat(height) => Some([flat(height); 2]),
        Edge::Map(heights) => map(heights),
    }
}

impl Heights {
    pub(super) fn new(layer: &Layer, images: &Images) -> Self {
        let shape = &layer.shape;
        let [least_m, deepest_m] = match &shape.thickness {
            Some(Thickness::Uniform(metres)) => [metres.get(); 2],
            Some(Thickness::Stratocumulus(field)) => {
                let lift = if shape.thins_out() { LIFT } else { 0.0 };
                [1.0, CLIP + lift].map(|times| times * field.mean_m.get())
            }
            Some(Thickness::Map { image, scale_m, .. }) => {
                ends(images, image).map_or([UNKNOWN_M; 2], |[_, greatest]| [scale_m.get() * greatest; 2])
            }
            None => [UNKNOWN_M; 2],
        };
        let base = edge(&shape.base, images, |base_m| base_m.get());
        let top = edge(&shape.top, images, |top_m| top_m.get());
        let (base_m, deepest_m) = match (base, top) {
            (Some([low_m, _]), Some([_, high_m])) => (low_m, high_m - low_m),
            (Some([low_m, high_m]), None) => (low_m, high_m - low_m + deepest_m),
            (None, Some([low_m, high_m])) => (low_m - deepest_m, high_m - low_m + deepest_m),
            (None, None) => (0.0, deepest_m),
        };
        let deepest_m = deepest_m.max(LEAST_M);
        Self { base_m: base_m.max(0.0), deepest_m, least_m: least_m.clamp(LEAST_M, deepest_m) }
    }
}
