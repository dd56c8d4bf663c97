//! Synthetic fields: octaves of noise with a -5/3 spectrum, and convective cells, streets or trails of cirrus.

use super::gamma::GammaLaw;
use super::lattices::turns;
use super::map::{Field, Stands, bounds, count, find_bounds, read_bins};
use super::octaves::octave_parts;
use super::streets::{rows, streets};
use super::trails;
use super::transfer::{self, Distribution, calibrate};
use crate::gpu::layout::{Blend, Cells, Columns, Histogram, Octaves, Streets, Trails, Transfer, Turned};
use crate::gpu::{Gpu, GpuError, HostMap, Pass, Target, binds, shaders};
use crate::scene::quantity::Quantity as _;
use crate::scene::{DepthLaw, Pattern, Stratocumulus};
use std::f64::consts::TAU;
use std::time::Instant;

/// Cycles per domain of the lowest octave of noise: `NOISE_LOWEST_PERIOD` of `shaders/shared/noise.wgsl`.
const LOWEST_PERIOD: u32 = 3;
/// Octaves of noise at most: 3 to 1536 cycles.
const MAX_OCTAVES: u32 = 10;
/// Octaves that share a texture, and textures.
const GROUP: u32 = 4;
const GROUPS: usize = 3;
/// Bytes of a texel of noise.
const HALF_TEXEL: u64 = 8;
/// Texels of a texture of noise per cycle of its finest octave, where the field is not finer than [`FINE`].
const TEXELS_PER_CYCLE: u32 = 8;
/// Up to this many texels a side noise is kept twice as fine as the field: it is read between texels, which takes
/// amplitude from its finest octave. Finer fields would need too much memory.
const FINE: u32 = 1024;
/// Part of the cells in the Gaussian field: a compromise between visible cells and a -5/3 spectrum.
const CELL_SHARE: f64 = 0.7;
/// Part of the streets: rows are to be seen, and broken by the octaves.
const STREET_SHARE: f64 = 0.8;
/// Part of cirrus: noise beside it has long waves alone, which thicken trails together.
const TRAIL_SHARE: f64 = 0.87;
/// Texels of the cells' map per cell: cells are smooth but for the creases between them.
const TEXELS_PER_CELL: u32 = 20;
/// Standard deviation of the gradient noise of `shaders/shared/noise.wgsl`.
const GRADIENT_NOISE_STD: f64 = 0.2151;
/// Ends of the bins of a Gaussian field, standard deviations.
pub(super) const RANGE: [f64; 2] = [-6.0, 6.0];
/// Ways of a cell's size at the speed of the eddies while the slowest of the cells' points goes round once.
const CELLS_PER_TURN: f64 = 12.0;
/// Wave number of the octaves and of the cells in cycles per period, as displacement decorrelates them: measured.
const OCTAVE_WAVES: f64 = 0.65;
const CELL_WAVES: f64 = 0.7;

/// What a synthetic field is made from at all times.
pub(super) struct Synthetic {
    wanted: Stratocumulus,
    /// Of columns; else there is a thickness with one extinction.
    gamma: Option<GammaLaw>,
    stands: Stands,
    extent_m: f64,
    resolution: u32,
    octaves: u32,
    groups: [Target; GROUPS],
    /// Uniforms of the groups that hold anything.
    filled: Vec<Noise>,
    /// Cells of a moment, or what lies along the wind.
    cells: Target,
    streets: Option<Streets>,
    trails: Option<Trails>,
    pub(super) gaussian: wgpu::Buffer,
}

/// The numbers of a moment.
#[derive(Clone, Copy)]
pub(super) struct Moment {
    pub(super) blend: Blend,
    pub(super) histogram: Histogram,
    /// None where the pattern has no cells.
    pub(super) cells: Option<Cells>,
}

/// The square that a field fills.
#[derive(Clone, Copy)]
pub(super) struct Domain {
    /// Texels a side.
    pub(super) resolution: u32,
    pub(super) extent_m: f64,
    /// Towards where the layer's wind comes from, east and north.
    pub(super) upwind: [f64; 2],
}

/// Results of a synthetic field's passes, for tests.
#[derive(Debug, Clone)]
pub struct SyntheticStages {
    /// Octaves of noise, four a map.
    pub octaves: Vec<(Noise, HostMap)>,
    /// Cells, where the pattern has them, and their map.
    pub cells: (Option<Cells>, HostMap),
    /// Streets, whose map is then in the place of the cells'.
    pub streets: Option<Streets>,
    /// Trails of cirrus, whose map is in that place too, and their heads.
    pub trails: Option<(Trails, HostMap)>,
    /// What makes cloud of the field's values.
    pub law: Law,
}

/// How four octaves of noise were made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Noise {
    /// On the lattices of the tile's axes.
    Plain(Octaves),
    /// On turned ones.
    Turned(Turned),
}

/// From a field's values to cloud.
#[derive(Debug, Clone, PartialEq)]
pub enum Law {
    /// To thickness.
    Thickness(Transfer),
    /// To columns, by paths at the edges of bins, m.
    Columns(Columns, Vec<f32>),
}

impl Noise {
    fn of(law: DepthLaw, octaves: Octaves) -> Self {
        let Octaves { seed, first, count, width } = octaves;
        match law {
            DepthLaw::Lognormal => Self::Plain(octaves),
            DepthLaw::Gamma(_) => {
                let turns = [0, 1, 2, 3].map(|i| turns(LOWEST_PERIOD, first + i));
                Self::Turned(Turned { seed, first, count, width, turns })
            }
        }
    }

    fn width(&self) -> u32 {
        match self {
            Self::Plain(octaves) => octaves.width,
            Self::Turned(octaves) => octaves.width,
        }
    }

    fn pass(&self, gpu: &Gpu, target: &Target) -> Pass {
        let (uniform, shader) = match self {
            Self::Plain(octaves) => (gpu.uniform("octaves", octaves), &shaders::FIELD_OCTAVES),
            Self::Turned(octaves) => (gpu.uniform("octaves", octaves), &shaders::FIELD_TURNED),
        };
        Pass::new(shader, [self.width(); 2], binds![&uniform, &target.levels[0]])
    }
}

/// Spread of the logarithm of water path: closed cells are even, open ones patchy.
pub(super) fn spread(pattern: Pattern) -> f64 {
    match pattern {
        Pattern::Closed => 0.5,
        Pattern::Open | Pattern::Streets => 0.9,
        Pattern::Fractal | Pattern::Cirrus => 0.6,
    }
}

/// Octaves of noise of a field: none is finer than two texels, it could not be shown.
pub(super) fn octaves(resolution: u32) -> u32 {
    (1..=MAX_OCTAVES).take_while(|o| o == &1 || LOWEST_PERIOD << (o - 1) <= resolution / 2).count() as u32
}

/// Texels a side of the textures of noise that hold anything, the coarsest octaves first.
fn widths(resolution: u32) -> impl Iterator<Item = u32> {
    let octaves = octaves(resolution);
    (0..octaves).step_by(GROUP as usize).map(move |first| {
        let finest = LOWEST_PERIOD << ((first + GROUP).min(octaves) - 1);
        let finer = if resolution <= FINE { 2 * resolution } else { resolution };
        (TEXELS_PER_CYCLE * finest).min(finer).max(1)
    })
}

/// Bytes of what a field of so many texels a side is made from: noise, cells or streets, and the values themselves.
pub(super) fn bytes(resolution: u32) -> u64 {
    let square = |side: u32| u64::from(side) * u64::from(side);
    let noise: u64 = widths(resolution).map(|side| HALF_TEXEL * square(side)).sum();
    noise + 2 * size_of::<f32>() as u64 * square(resolution)
}

impl Synthetic {
    pub(super) fn new(
        gpu: &Gpu,
        wanted: &Stratocumulus,
        stands: Stands,
        domain: Domain,
        deadline: Option<Instant>,
    ) -> Result<Self, GpuError> {
        let Domain { resolution, extent_m, upwind } = domain;
        let octaves = octaves(resolution);
        let filled: Vec<Noise> = (0..octaves)
            .step_by(GROUP as usize)
            .zip(widths(resolution))
            .map(|(first, width)| Noise::of(wanted.law, Octaves { seed: wanted.seed, first, count: octaves, width }))
            .collect();
        let group = |i: usize| {
            // Of the finest fields they are what takes most memory. What halves leave out, 2^-10 at most where a device cuts digits off, is far
            // below what shows: thickness changes by 0.04 %, root mean square.
            let width = filled.get(i).map_or(1, Noise::width);
            gpu.half("octaves", [width; 2])
        };
        let groups = [group(0), group(1), group(2)];
        let passes: Vec<Pass> = filled.iter().zip(&groups).map(|(noise, target)| noise.pass(gpu, target)).collect();
        gpu.run("field_octaves", deadline, &passes)?;
        let mut synthetic = Self {
            wanted: *wanted,
            gamma: match wanted.law {
                DepthLaw::Lognormal => None,
                DepthLaw::Gamma(spread) => Some(GammaLaw::new(wanted, spread.get())),
            },
            stands,
            extent_m,
            resolution,
            octaves,
            groups,
            filled,
            cells: gpu.texture_from("cells", [1, 1], 1, &[0.0]),
            streets: None,
            trails: None,
            gaussian: gpu.storage("field", resolution as usize * resolution as usize),
        };
        if let Some(cells) = synthetic.cells(0.0) {
            synthetic.cells = gpu.texture("cells", [cells.width; 2], 1, 1);
        }
        if wanted.pattern == Pattern::Streets {
            let streets = streets(wanted.seed, synthetic.rows(), upwind, resolution);
            synthetic.cells = gpu.texture("streets", [streets.width; 2], 1, 1);
            let binds = binds![&gpu.uniform("streets", &streets), &synthetic.cells.levels[0]];
            gpu.run("field_streets", deadline, &[Pass::new(&shaders::FIELD_STREETS, [streets.width; 2], binds)])?;
            synthetic.streets = Some(streets);
        }
        if wanted.pattern == Pattern::Cirrus {
            let trails = trails::trails(synthetic.rows(), &synthetic.cycles(), GRADIENT_NOISE_STD, upwind, resolution);
            let heads = trails::heads(gpu, &trails, &synthetic.groups, deadline)?;
            synthetic.cells = trails::draw(gpu, &trails, &synthetic.groups[0], &heads, deadline)?;
            synthetic.trails = Some(trails);
        }
        Ok(synthetic)
    }

    /// Bytes on the device.
    pub(super) fn size(&self) -> u64 {
        self.groups.iter().map(Target::size).sum::<u64>() + self.cells.size() + self.gaussian.size()
    }

    /// Cycles a tile of the longest waves of each octave of noise.
    fn cycles(&self) -> Vec<f64> {
        (0..self.octaves).map(|o| f64::from(LOWEST_PERIOD << o)).collect()
    }

    /// Streets a tile, or heads of cirrus, where the pattern has them.
    fn rows(&self) -> f64 {
        rows(self.extent_m, self.wanted.cell_m.get(), self.resolution)
    }

    /// The cells after the eddies have gone a way (m) at the root mean square of their speed.
    fn cells(&self, way_m: f64) -> Option<Cells> {
        let kind = match self.wanted.pattern {
            Pattern::Closed => 0,
            Pattern::Open => 1,
            Pattern::Fractal | Pattern::Streets | Pattern::Cirrus => return None,
        };
        let cell_m = self.wanted.cell_m.get();
        let wanted = (self.extent_m / cell_m).clamp(1.0, f64::from((self.resolution / 4).max(1)));
        let count = wanted.floor();
        // Mostly one lattice or the other; in between, both, with the variance of one.
        let t = ((wanted - count - 0.4) / 0.2).clamp(0.0, 1.0);
        let finer = t * t * (3.0 - 2.0 * t);
        let norm = finer.hypot(1.0 - finer);
        let width = (TEXELS_PER_CELL * (count as u32 + 1)).min(self.resolution.max(1));
        Some(Cells {
            seed: self.wanted.seed,
            kind,
            count: count as u32,
            width,
            coarser: ((1.0 - finer) / norm) as f32,
            finer: (finer / norm) as f32,
            turns: (way_m / (CELLS_PER_TURN * cell_m)).rem_euclid(1.0) as f32,
            spare: 0,
        })
    }

    /// `weights` of the two layers of displacement, `spread` of their difference on an axis (domains), way of the eddies
    /// so far (domains).
    pub(super) fn moment(&self, weights: [f64; 2], spread: f64, way: f64) -> Moment {
        let cells = self.cells(way * self.extent_m);
        // Part of what is not noise, and its wave number.
        let (share, cycles) = match cells {
            Some(cells) => (CELL_SHARE, CELL_WAVES * f64::from(cells.count)),
            None if self.streets.is_some() => (STREET_SHARE, self.rows()),
            None if self.trails.is_some() => (TRAIL_SHARE, self.rows()),
            None => (0.0, CELL_WAVES),
        };
        let octaves = self.cycles();
        let seen = cells.filter(|_| self.gamma.is_some());
        let parts = match self.trails {
            Some(_) => trails::patches(&octaves, self.rows(), 1.0 - share * share),
            None => octave_parts(&octaves, share, seen.map(|cells| f64::from(cells.count))),
        };
        // Two copies that are displaced against each other: their blend lacks variance by what they differ.
        let restored = |cycles: f64| {
            let correlation = (-0.5 * (TAU * cycles * spread).powi(2)).exp();
            let [a, b] = weights;
            (a * a + b * b + 2.0 * a * b * correlation).sqrt().recip()
        };
        let octave = |o: u32| {
            if o >= self.octaves {
                return 0.0;
            }
            let cycles = OCTAVE_WAVES * f64::from(LOWEST_PERIOD << o);
            (parts[o as usize].sqrt() / GRADIENT_NOISE_STD * restored(cycles)) as f32
        };
        let group = |i: u32| [octave(4 * i), octave(4 * i + 1), octave(4 * i + 2), octave(4 * i + 3)];
        let blend = Blend {
            low: group(0),
            middle: group(1),
            high: group(2),
            cells: (share * restored(cycles)) as f32,
            first: weights[0] as f32,
            second: weights[1] as f32,
            width: self.resolution,
            height: self.resolution,
            ..Blend::default()
        };
        let histogram = Histogram {
            low: RANGE[0] as f32,
            per_unit: (transfer::BINS as f64 / (RANGE[1] - RANGE[0])) as f32,
            count: self.resolution * self.resolution,
            spare: 0,
        };
        Moment { blend, histogram, cells }
    }

    /// Makes the field of a moment. `moves`: other times have other fields.
    pub(super) fn make(
        &self,
        gpu: &Gpu,
        moment: &Moment,
        displacement: &Target,
        bins: &wgpu::Buffer,
        moves: bool,
        deadline: Option<Instant>,
    ) -> Result<(Field, Law), GpuError> {
        let size = [self.resolution; 2];
        let mut passes = Vec::new();
        if let Some(cells) = &moment.cells {
            let binds = binds![&gpu.uniform("cells", cells), &self.cells.levels[0]];
            passes.push(Pass::new(&shaders::FIELD_CELLS, [cells.width; 2], binds));
        }
        let uniform = gpu.uniform("blend", &moment.blend);
        let [low, middle, high] = &self.groups;
        let binds = binds![&uniform, displacement, low, middle, high, &self.cells, &gpu.repeat, &self.gaussian];
        passes.push(Pass::new(&shaders::FIELD_BLEND, size, binds));
        passes.push(count(gpu, &moment.histogram, &self.gaussian, bins));
        gpu.run("field_blend", deadline, &passes)?;
        // Coverage and mean are met on the very field that was made, not on a model of it.
        let counts = read_bins(gpu, bins, deadline)?;
        let distribution = Distribution { low: RANGE[0], width: (RANGE[1] - RANGE[0]) / transfer::BINS as f64, counts };
        match &self.gamma {
            Some(gamma) => self.columns(gpu, gamma, &distribution, deadline),
            None => self.thickness(gpu, &distribution, moves, deadline),
        }
    }

    fn thickness(
        &self,
        gpu: &Gpu,
        distribution: &Distribution,
        moves: bool,
        deadline: Option<Instant>,
    ) -> Result<(Field, Law), GpuError> {
        let size = [self.resolution; 2];
        let spread = spread(self.wanted.pattern);
        let found = calibrate(distribution, self.wanted.coverage.get(), self.wanted.mean_m.get(), spread);
        let transfer = Transfer {
            spread: spread as f32,
            threshold: found.threshold as f32,
            scale_m: found.scale_m as f32,
            clip_m: found.clip_m as f32,
            width: self.resolution,
            height: self.resolution,
            ..Transfer::default()
        };
        let thickness = gpu.texture("thickness", size, 1, 1);
        let bounds = bounds(gpu, &thickness);
        let binds = binds![&gpu.uniform("transfer", &transfer), &self.gaussian, &thickness.levels[0]];
        let passes = [Pass::new(&shaders::FIELD_THICKNESS, size, binds), find_bounds(&thickness, &bounds)];
        gpu.run("field_thickness", deadline, &passes)?;
        // Rounding on the device can lift the thickest texel by a few units in the last place.
        let depth_m = (found.greatest_m * (1.0 + 1e-5)) as f32;
        let top_m = if moves && depth_m > 0.0 { transfer.clip_m } else { depth_m };
        Ok((Field::sheet(thickness, bounds, depth_m, top_m), Law::Thickness(transfer)))
    }

    fn columns(
        &self,
        gpu: &Gpu,
        gamma: &GammaLaw,
        distribution: &Distribution,
        deadline: Option<Instant>,
    ) -> Result<(Field, Law), GpuError> {
        let edges = gamma.edges(distribution);
        let law = gamma.columns(RANGE[0], transfer::BINS as f64 / (RANGE[1] - RANGE[0]), self.stands);
        let columns = gpu.texture("columns", [self.resolution; 2], 4, 1);
        let (uniform, on_device) = (gpu.uniform("columns", &law), gpu.storage_from("edges", &edges));
        let binds = binds![&uniform, &self.gaussian, &on_device, &columns.levels[0]];
        let pass = Pass::new(&shaders::FIELD_COLUMNS, [self.resolution; 2], binds);
        let lift_m = if self.stands.hangs { 0.0 } else { gamma.mean_lift_m() };
        let field = Field::made_columns(
            gpu,
            columns,
            pass,
            gamma.depth_m(self.stands.hangs),
            lift_m,
            self.stands.profile,
            deadline,
        )?;
        Ok((field, Law::Columns(law, edges)))
    }

    pub(super) fn inspect(
        &self,
        gpu: &Gpu,
        moment: &Moment,
        law: Law,
        deadline: Option<Instant>,
    ) -> Result<SyntheticStages, GpuError> {
        let read = |target: &Target| gpu.read_map(target, 0, deadline);
        let octaves = self.filled.iter().zip(&self.groups).map(|(group, map)| Ok((*group, read(map)?)));
        let heads = |trails: Trails| Ok((trails, read(&trails::heads(gpu, &trails, &self.groups, deadline)?)?));
        Ok(SyntheticStages {
            octaves: octaves.collect::<Result<_, GpuError>>()?,
            cells: (moment.cells, read(&self.cells)?),
            streets: self.streets,
            trails: self.trails.map(heads).transpose()?,
            law,
        })
    }
}
