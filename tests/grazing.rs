//! Views of cloud close to the horizon: what a texel shows is the mean of what lies behind it, and neighbours agree as texels get
//! smaller. Point rays on a shortened way over the map show moiré there.
#![expect(clippy::unwrap_used, reason = "a test stops where it fails")]
#![expect(clippy::panic, reason = "a test fails by panicking")]

#[path = "common/compare.rs"]
mod compare;
#[path = "common/twin_sky.rs"]
mod sky;
#[path = "common/twin.rs"]
mod twin;

use sky::{Sky, pattern};
use skyloom::gpu::layout::View;
use skyloom::reference::{self, Map};
use skyloom::render::{Stages, Watch};
use twin::{map, open};

/// Texels a side of the field's map; at 89.9 degrees a ray through its layer is cut several thousand times.
const RESOLUTION: u32 = 256;
/// Texels a side of what is compared with it, each with several rays.
const EXACT_SIDE: u32 = 24;
const SIZES: [u32; 4] = [32, 64, 128, 256];

/// One channel of a square picture.
struct Picture {
    side: usize,
    texels: Vec<f64>,
}

impl Picture {
    fn new(data: &[f32], channel: usize) -> Self {
        let texels: Vec<f64> = data.iter().skip(channel).step_by(4).map(|value| f64::from(*value)).collect();
        Self { side: texels.len().isqrt(), texels }
    }

    fn mean(&self) -> f64 {
        self.texels.iter().sum::<f64>() / self.texels.len() as f64
    }

    /// Means over squares, as a picture of so many texels a side.
    fn coarser(&self, side: usize) -> Self {
        let block = self.side / side;
        let mean = |i: usize| {
            let (x, y) = (i % side * block, i / side * block);
            let rows = (0..block).flat_map(|row| (0..block).map(move |column| (row, column)));
            rows.map(|(row, column)| self.texels[(y + row) * self.side + x + column]).sum::<f64>()
                / (block * block) as f64
        };
        Self { side, texels: (0..side * side).map(mean).collect() }
    }

    /// Root mean square difference, relative to the mean.
    fn differs(&self, other: &Self) -> f64 {
        let pairs = self.texels.iter().zip(&other.texels);
        (pairs.map(|(a, b)| (a - b).powi(2)).sum::<f64>() / self.texels.len() as f64).sqrt() / other.mean()
    }

    /// The same of neighbours along the view (east and west).
    fn steps(&self) -> f64 {
        let rows = self.texels.chunks(self.side);
        let squares = rows.flat_map(|row| row.windows(2).map(|pair| (pair[0] - pair[1]).powi(2)));
        (squares.sum::<f64>() / (self.side * (self.side - 1)) as f64).sqrt() / self.mean()
    }
}

fn rendered(query: &[(&str, &str)]) -> Stages {
    let sky = Sky { resolution: RESOLUTION, thickness: pattern("open", 0.6), ..Sky::at(60.0) };
    open(true).inspect(&sky.job("cloud", query), &Watch::default()).unwrap()
}

/// The light of the twin along rays of which all of the way is exact.
fn exact(stages: &Stages) -> Vec<f64> {
    let mut frame = stages.frame;
    frame.place.max_steps = 1 << 30;
    let view = View { size: [EXACT_SIDE; 2], rows: EXACT_SIDE, first_row: 0, ..stages.view };
    let [transmittance, reflectance] = [&stages.tables.transmittance, &stages.tables.reflectance].map(map);
    let light_side = stages.light.from_below.len().isqrt();
    let light_map = |light: &[[f32; 3]]| Map::from_f32(light_side, light_side, 3, light.as_flattened());
    let (from_below, from_above) = (light_map(&stages.light.from_below), light_map(&stages.light.from_above));
    let sun_share = map(&stages.shares[stages.view.from_above as usize]);
    let maps = reference::cloud::Maps {
        transmittance: &transmittance,
        reflectance: &reflectance,
        from_below: &from_below,
        from_above: &from_above,
        sun_share: &sun_share,
        behind: &from_above,
        reaches: None,
    };
    let sunlight = reference::cloud::sunlight(&frame, &stages.tables, stages.slab.as_ref().unwrap());
    reference::cloud_plane::main(&frame, &view, &map(&stages.thickness), &maps, sunlight)
}

#[test]
fn a_picture_is_the_mean_of_finer_ones_and_gets_smoother() {
    for view in ["below", "above"] {
        for direction in ["89.9,90", "89,90"] {
            let picture = |size: u32| {
                let size = size.to_string();
                let query = [("view", view), ("direction", direction), ("size", &*size), ("method", "tabulated")];
                Picture::new(&rendered(&query).output, 1)
            };
            let pictures = SIZES.map(picture);
            let finest = &pictures[SIZES.len() - 1];
            let found: Vec<[f64; 3]> = pictures
                .iter()
                .map(|picture| {
                    let mean = picture.mean() / finest.mean() - 1.0;
                    [mean, picture.differs(&finest.coarser(picture.side)), picture.steps()]
                })
                .collect();
            eprintln!("{view}, {direction}: mean, rms, steps {found:.4?}");
            for ([mean, rms, steps], size) in found.iter().zip(SIZES) {
                assert!(mean.abs() < SAME_MEAN && *rms < SAME_TEXEL, "{view}, {direction}, {size}: {mean}, {rms}");
                assert!(*steps < STEP, "{view}, {direction}, {size}: neighbours differ by {steps}");
            }
            // Finer texels lie closer to each other, and what they show does too. From above, neighbours hardly differ at any size.
            for pair in found.windows(2).filter(|_| view == "below") {
                assert!(pair[1][2] < pair[0][2], "{view}, {direction}: {found:?}");
            }
            for [.., steps] in found.iter().filter(|_| view == "above") {
                assert!(*steps < STEP_FROM_ABOVE, "{view}, {direction}: {found:?}");
            }
        }
    }
}

/// The mean place of what a flat ray shows may lie between two clouds: it shows cloud all the same, not a dark speck.
#[test]
fn rays_between_clouds_show_no_specks() {
    let mut thickness = pattern("open", 0.6);
    thickness["law"] = "gamma".into();
    thickness["spread"] = 0.9.into();
    let sky = Sky { resolution: RESOLUTION, thickness, ..Sky::at(60.0) };
    let query = [("view", "above"), ("direction", "89.9,90"), ("method", "tabulated")];
    let stages = open(true).inspect(&sky.job("cloud", &query), &Watch::default()).unwrap();
    let picture = Picture::new(&stages.output, 1);
    let side = picture.side;
    let darkest = (0..side * side).map(|i| {
        let (x, y) = (i % side, i / side);
        let around =
            (0..9).map(|k| picture.texels[(y + side + k / 3 - 1) % side * side + (x + side + k % 3 - 1) % side]);
        let mut around: Vec<f64> = around.collect();
        around.sort_by(f64::total_cmp);
        picture.texels[i] / around[4]
    });
    let darkest = darkest.fold(f64::MAX, f64::min);
    eprintln!("the darkest texel has {darkest:.3} of the median around it");
    assert!(darkest > SPECK, "{darkest}");
}

#[test]
fn a_picture_is_the_mean_of_exact_rays() {
    for view in ["below", "above"] {
        for direction in ["89.9,90", "89.9,37", "89.5,200"] {
            let query = [("view", view), ("direction", direction), ("size", "32"), ("method", "tabulated")];
            let stages = rendered(&query);
            let truth: Vec<f32> = exact(&stages).iter().map(|value| *value as f32).collect();
            let [light, alpha] = [1, 3].map(|channel| {
                Picture::new(&stages.output, channel).mean() / Picture::new(&truth, channel).mean() - 1.0
            });
            eprintln!("{view}, {direction}: light {light:.4} and alpha {alpha:.4} off in the mean");
            assert!(light.abs() < EXACT_MEAN && alpha.abs() < 1e-3, "{view}, {direction}: {light}, {alpha}");
        }
    }
}

/// Of 32 to 256 texels a side, in the mean and each of the mean of the finest in it: a texel has a ray for each of the map's.
const SAME_MEAN: f64 = 0.008;
const SAME_TEXEL: f64 = 0.09;
/// Neighbours along the view, root mean square relative to the mean: 0.108 from below at the largest texels, which falls with their size, and
/// 0.010 from above.
const STEP: f64 = 0.11;
const STEP_FROM_ABOVE: f64 = 0.02;
/// A texel over the median of the three times three around it, where all is cloud.
const SPECK: f64 = 0.8;
/// Of some thousand rays, all of whose way is exact.
const EXACT_MEAN: f64 = 0.02;
