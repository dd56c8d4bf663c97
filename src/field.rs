//! Stage `field`: the thickness map of a layer at a time. Takes a pattern or an image, gives a periodic texture.
//!
//! Without turbulence a layer has one map for all times, in the frame that moves with the mean wind, which only shifts where
//! the map is read. Where the wind is turbulent, `eddies` displace it: `clock` tells which two
//! layers of displacement live at a time, `motion` follows them on the device, and what they displace (`synthetic`: octaves
//! of noise and cells; or an image) is blended and brought to the wanted distribution (`transfer`). A field is a function
//! of seed and time alone.

mod bytes;
mod clock;
mod columns;
pub(crate) mod eddies;
mod gamma;
mod image_metres;
mod lattices;
mod levels;
mod map;
mod motion;
mod octaves;
mod spectrum;
mod statistics;
mod streets;
mod synthetic;
mod trails;
mod transfer;

use crate::gpu::layout::{Blend, Eddies, Histogram, Step};
use crate::gpu::{Gpu, GpuError, HostMap, Pass, Target, binds, shaders};
use crate::image::Image;
use crate::scene::quantity::{FillValue, Quantity as _};
use crate::scene::{self, ExtinctionProfile, Shape, Thickness, Wind};
pub(crate) use bytes::FieldBytes;
pub(crate) use columns::ColumnMap;
use image_metres::metres;
pub(crate) use levels::{Levels, levels};
pub(crate) use map::Field;
use map::{Stands, bounds, count, find_bounds, read_bins};
use motion::{Displaced, Motion};
pub use spectrum::power_spectrum;
pub(crate) use spectrum::waves;
pub(crate) use statistics::mean_m;
pub use statistics::{Column, Profile, profile};
use std::time::Instant;
use synthetic::{Domain, Synthetic};
pub use synthetic::{Law, Noise, SyntheticStages};
pub use transfer::{Distribution, Transfer, calibrate, remap};

/// What a layer's field is made from, for all times. Holds what was computed last, so that the next time is near.
pub(crate) struct Source {
    kind: Kind,
    edge: FlatEdge,
    profile: ExtinctionProfile,
    motion: Option<Motion>,
}

/// The flat edge of a layer of a thickness, and its height above the ground.
enum FlatEdge {
    Base(f64),
    /// With the mean thickness of the cloud that hangs from it.
    Top(f64, f64),
}

enum Kind {
    Columns(Box<ColumnMap>),
    Uniform(f32),
    Synthetic(Box<Synthetic>),
    Image(Box<Picture>),
}

/// An image's thickness, and its own distribution.
struct Picture {
    image: Target,
    greatest_m: f32,
    /// Of the cloudy part.
    mean_m: f64,
    own: Distribution,
    gaussian: wgpu::Buffer,
}

/// Results of the stage's passes, for tests.
#[derive(Debug, Clone)]
pub struct FieldStages {
    /// Eddies and the last part of a step, where the field moves.
    pub motion: Option<MotionStages>,
    /// Displacement: two layers, domains.
    pub displacement: HostMap,
    /// How the field was put together.
    pub blend: Blend,
    /// Octaves, cells and transfer of a synthetic field.
    pub synthetic: Option<SyntheticStages>,
    /// Thickness of a moving image before it moved.
    pub image: Option<HostMap>,
    /// The blended field.
    pub field: Vec<f32>,
    /// Bins of its values.
    pub histogram: Histogram,
    /// Values in each of them.
    pub counts: Vec<u32>,
}

/// Results of the passes that move a field.
#[derive(Debug, Clone)]
pub struct MotionStages {
    /// Bands of the eddies.
    pub bands: Vec<HostMap>,
    /// Their phases in the last part of a step.
    pub eddies: Eddies,
    /// Velocity then.
    pub velocity: HostMap,
    /// The last part of a step.
    pub step: Step,
    /// Displacement before it.
    pub before: HostMap,
    /// Steps taken on the way to it.
    pub steps: u32,
    /// Life of a layer of displacement, s.
    pub life_s: f64,
}

/// Whether the eddies move a layer: what is the same everywhere has nothing to move.
pub(crate) fn moves(shape: &Shape, wind: &Wind) -> bool {
    let uneven = matches!(shape.thickness, Some(Thickness::Stratocumulus(_) | Thickness::Map { .. }));
    wind.turbulence_m_s.get() > 0.0 && uneven && !shape.has_maps()
}

/// Where the wind comes from, degrees, where it is what a layer's map lies along.
pub(crate) fn rows_from_deg(shape: &Shape, wind: &Wind) -> Option<f64> {
    match &shape.thickness {
        Some(Thickness::Stratocumulus(wanted)) if wanted.pattern.lies_along_the_wind() => Some(wind.from_deg.get()),
        _ => None,
    }
}

/// How fine a layer's field is, in words.
pub(crate) fn octaves_in_words(shape: &Shape, resolution: u32) -> String {
    match &shape.thickness {
        Some(Thickness::Stratocumulus(_)) => {
            format!("{resolution} texels, {} octaves: no wave below two texels", synthetic::octaves(resolution))
        }
        Some(Thickness::Uniform(_)) if !shape.has_maps() => "one texel".to_owned(),
        _ => "as fine as the image".to_owned(),
    }
}

/// What the images of a layer were made to.
pub(crate) enum Given<'a> {
    /// It has none.
    Nothing,
    /// The image of its thickness, which is all that it has.
    Thickness(&'a Image),
    /// Its columns.
    Columns(ColumnMap),
}

/// A field, and what the passes before its last one left.
struct Made {
    field: Field,
    displaced: Option<Displaced>,
    blend: Blend,
    histogram: Histogram,
    bins: wgpu::Buffer,
    synthetic: Option<(synthetic::Moment, Law)>,
}

impl Source {
    /// Makes what is the same at all times. `given` is what the layer's images were made to.
    pub(crate) fn new(
        gpu: &Gpu,
        layer: &scene::Layer,
        resolution: u32,
        extent_m: f64,
        given: Given<'_>,
        deadline: Option<Instant>,
    ) -> Result<Self, GpuError> {
        let (shape, wind) = (&layer.shape, &layer.wind);
        let stands = Stands { hangs: shape.hangs_from_m().is_some(), profile: shape.profile };
        let kind = match (given, &shape.thickness) {
            (Given::Columns(columns), _) => Kind::Columns(Box::new(columns)),
            (_, Some(Thickness::Uniform(metres))) => Kind::Uniform(metres.get() as f32),
            (_, Some(Thickness::Stratocumulus(wanted))) => {
                let [east, north, _] = upwind(wind);
                let domain = Domain { resolution, extent_m, upwind: [east, north] };
                Kind::Synthetic(Box::new(Synthetic::new(gpu, wanted, stands, domain, deadline)?))
            }
            (Given::Thickness(image), Some(Thickness::Map { scale_m, fill, .. })) => {
                Kind::Image(Box::new(Picture::new(gpu, image, scale_m.get(), *fill)))
            }
            (Given::Nothing, Some(Thickness::Map { .. })) | (_, None) => Kind::Uniform(0.0),
        };
        let (seed, mean_m) = match (&shape.thickness, &kind) {
            (Some(Thickness::Stratocumulus(wanted)), _) => (wanted.seed, wanted.mean_m.get()),
            (_, Kind::Image(picture)) => (0, picture.mean_m),
            _ => (0, 0.0),
        };
        let edge = match (&kind, shape.flat_base_m(), shape.hangs_from_m()) {
            (Kind::Columns(columns), ..) => FlatEdge::Base(columns.base_m),
            (_, Some(base_m), _) => FlatEdge::Base(base_m),
            (_, None, top_m) => FlatEdge::Top(top_m.unwrap_or(0.0), mean_m),
        };
        let motion = moves(shape, wind).then(|| Motion::new(gpu, seed, wind.turbulence_m_s.get(), extent_m));
        Ok(Self { kind, edge, profile: shape.profile, motion })
    }

    /// Bytes on the device and of what waits for it.
    pub(crate) fn size(&self) -> u64 {
        let kind = match &self.kind {
            Kind::Columns(columns) => size_of_val(columns.texels.as_slice()) as u64,
            Kind::Uniform(_) => 0,
            Kind::Synthetic(synthetic) => synthetic.size(),
            Kind::Image(picture) => picture.image.size() + picture.gaussian.size(),
        };
        kind + self.motion.as_ref().map_or(0, Motion::size)
    }

    /// The field at a time. `offset_uv`: where the mean wind has carried what is made anew for each time, so that its texels are
    /// those of the domain.
    pub(crate) fn at(
        &mut self,
        gpu: &Gpu,
        time_s: f64,
        offset_uv: [f64; 2],
        deadline: Option<Instant>,
    ) -> Result<Field, GpuError> {
        let thick = match &self.kind {
            Kind::Columns(columns) => return Field::of_columns(gpu, columns, deadline),
            Kind::Uniform(metres) => uniform(gpu, *metres, deadline)?,
            // An image that does not move is its own field.
            Kind::Image(picture) if self.motion.is_none() => {
                Field::of(gpu, picture.image.clone(), picture.greatest_m, deadline)?
            }
            Kind::Synthetic(_) | Kind::Image(_) => self.make(gpu, time_s, offset_uv, deadline)?.field,
        };
        match self.edge {
            FlatEdge::Base(base_m) => thick.on(base_m).with(gpu, self.profile, deadline),
            FlatEdge::Top(top_m, mean_m) => thick.hung(gpu, top_m, mean_m, self.profile, deadline),
        }
    }

    fn make(
        &mut self,
        gpu: &Gpu,
        time_s: f64,
        offset_uv: [f64; 2],
        deadline: Option<Instant>,
    ) -> Result<Made, GpuError> {
        let offset_uv = offset_uv.map(|part| part as f32);
        let displaced = self.motion.as_mut().map(|motion| motion.follow(gpu, time_s, deadline)).transpose()?;
        let still;
        let displacement = match &self.motion {
            Some(motion) => &motion.displacement,
            None => {
                still = gpu.texture_from("displacement", [1, 1], 4, &[0.0; 4]);
                &still
            }
        };
        let weights = displaced.as_ref().map_or([1.0, 0.0], |displaced| displaced.weights);
        let spread = self.motion.as_ref().map_or(0.0, Motion::spread);
        let bins = gpu.storage("bins", transfer::BINS);
        match &self.kind {
            Kind::Synthetic(synthetic) => {
                let way = self.motion.as_ref().map_or(0.0, |motion| motion.way(time_s));
                let mut moment = synthetic.moment(weights, spread, way);
                moment.blend.offset_uv = offset_uv;
                let (field, law) =
                    synthetic.make(gpu, &moment, displacement, &bins, self.motion.is_some(), deadline)?;
                let (blend, histogram) = (moment.blend, moment.histogram);
                Ok(Made { field, displaced, blend, histogram, bins, synthetic: Some((moment, law)) })
            }
            Kind::Image(picture) => {
                let blend = Blend { offset_uv, ..picture.blend(weights) };
                let histogram = picture.histogram();
                let field = picture.make(gpu, &blend, &histogram, displacement, &bins, deadline)?;
                Ok(Made { field, displaced, blend, histogram, bins, synthetic: None })
            }
            Kind::Uniform(_) | Kind::Columns(_) => {
                let metres = if let Kind::Uniform(metres) = &self.kind { *metres } else { 0.0 };
                let field = uniform(gpu, metres, deadline)?;
                let (blend, histogram) = (Blend::default(), Histogram::default());
                Ok(Made { field, displaced, blend, histogram, bins, synthetic: None })
            }
        }
    }

    /// The field at a time with everything on the way to it; nothing where there are no passes.
    pub(crate) fn inspect(
        &mut self,
        gpu: &Gpu,
        time_s: f64,
        offset_uv: [f64; 2],
        deadline: Option<Instant>,
    ) -> Result<Option<FieldStages>, GpuError> {
        let passes = match &self.kind {
            Kind::Uniform(_) | Kind::Columns(_) => false,
            Kind::Synthetic(_) => true,
            Kind::Image(_) => self.motion.is_some(),
        };
        if !passes {
            return Ok(None);
        }
        let made = self.make(gpu, time_s, offset_uv, deadline)?;
        let read = |target: &Target| gpu.read_map(target, 0, deadline);
        let motion = match (&self.motion, &made.displaced) {
            (Some(motion), Some(displaced)) => {
                let now = motion.clock.at(time_s);
                Some(MotionStages {
                    bands: motion.bands.iter().map(read).collect::<Result<_, _>>()?,
                    eddies: motion.phases(now.step, now.part),
                    velocity: read(&motion.velocity)?,
                    step: displaced.last,
                    before: read(motion.state())?,
                    steps: displaced.steps,
                    life_s: motion.clock.life_s,
                })
            }
            _ => None,
        };
        let displacement = match &self.motion {
            Some(motion) => read(&motion.displacement)?,
            None => HostMap { width: 1, height: 1, channels: 4, data: vec![0.0; 4] },
        };
        let texels = (made.blend.width * made.blend.height) as usize;
        let (synthetic, image, gaussian) = match (&self.kind, made.synthetic) {
            (Kind::Synthetic(source), Some((moment, law))) => {
                (Some(source.inspect(gpu, &moment, law, deadline)?), None, Some(&source.gaussian))
            }
            (Kind::Image(picture), _) => (None, Some(read(&picture.image)?), Some(&picture.gaussian)),
            _ => (None, None, None),
        };
        let field = gaussian.map(|buffer| gpu.read(buffer, texels, deadline)).transpose()?.unwrap_or_default();
        let counts = read_bins(gpu, &made.bins, deadline)?;
        let (blend, histogram) = (made.blend, made.histogram);
        Ok(Some(FieldStages { motion, displacement, blend, synthetic, image, field, histogram, counts }))
    }
}

impl Picture {
    fn new(gpu: &Gpu, image: &Image, scale_m: f64, fill: Option<FillValue>) -> Self {
        // The renderer has refused samples out of range.
        let metres = metres(image, scale_m, fill);
        let cloudy = metres.iter().filter(|metres| **metres > 0.0).map(|metres| f64::from(*metres));
        let (count, sum) = cloudy.fold((0.0, 0.0), |(count, sum), metres| (count + 1.0, sum + metres));
        let greatest_m = metres.iter().copied().fold(0.0, f32::max);
        Self {
            image: gpu.texture_from("image", [image.width, image.height], 1, &metres),
            own: Distribution::of(&metres, 0.0, f64::from(greatest_m.max(1e-3))),
            gaussian: gpu.storage("field", metres.len()),
            mean_m: if count > 0.0 { sum / count } else { 0.0 },
            greatest_m,
        }
    }

    fn blend(&self, [first, second]: [f64; 2]) -> Blend {
        let (width, height) = (self.image.width, self.image.height);
        Blend { first: first as f32, second: second as f32, width, height, ..Blend::default() }
    }

    fn histogram(&self) -> Histogram {
        let count = self.image.width * self.image.height;
        Histogram { low: self.own.low as f32, per_unit: (1.0 / self.own.width) as f32, count, spare: 0 }
    }

    fn make(
        &self,
        gpu: &Gpu,
        blend: &Blend,
        histogram: &Histogram,
        displacement: &Target,
        bins: &wgpu::Buffer,
        deadline: Option<Instant>,
    ) -> Result<Field, GpuError> {
        let size = [blend.width, blend.height];
        let uniform = gpu.uniform("blend", blend);
        let binds = binds![&uniform, displacement, &self.image, &gpu.repeat, &self.gaussian];
        let passes = [Pass::new(&shaders::FIELD_IMAGE, size, binds), count(gpu, histogram, &self.gaussian, bins)];
        gpu.run("field_image", deadline, &passes)?;
        let blended = Distribution { counts: read_bins(gpu, bins, deadline)?, ..self.own.clone() };
        let edges = gpu.storage_from("edges", &remap(&blended, &self.own));
        let thickness = gpu.texture("thickness", size, 1, 1);
        let bounds = bounds(gpu, &thickness);
        let binds = binds![&gpu.uniform("histogram", histogram), &self.gaussian, &edges, &thickness.levels[0]];
        let passes = [Pass::new(&shaders::FIELD_REMAP, size, binds), find_bounds(&thickness, &bounds)];
        gpu.run("field_remap", deadline, &passes)?;
        // Rounding on the device can lift the thickest texel by a few units in the last place.
        let greatest_m = self.greatest_m * (1.0 + 1e-5);
        Ok(Field::sheet(thickness, bounds, greatest_m, greatest_m))
    }
}

fn uniform(gpu: &Gpu, metres: f32, deadline: Option<Instant>) -> Result<Field, GpuError> {
    Field::of(gpu, gpu.texture_from("thickness", [1, 1], 1, &[metres]), metres, deadline)
}

/// Where the mean wind has carried a layer: as its map is made, and as it is read.
pub(crate) struct Offsets {
    pub(crate) made: [f64; 2],
    pub(crate) read: [f64; 2],
}

/// A map that is made anew for each time has its texels in the domain's, so that it is read where it was calibrated; one for
/// all times is read between its texels.
pub(crate) fn offsets(layer: &scene::Layer, time_s: f64, extent_m: f64) -> Offsets {
    let offset = wind_offset(&layer.wind, time_s, extent_m);
    match moves(&layer.shape, &layer.wind) {
        true => Offsets { made: offset, read: [0.0; 2] },
        false => Offsets { made: [0.0; 2], read: offset },
    }
}

/// How far the mean wind has carried a field by a time, as the offset to add to a place on the map: the map is read
/// upwind. Kept in f64 and brought to one tile, so that it is exact after years.
fn wind_offset(wind: &Wind, time_s: f64, extent_m: f64) -> [f64; 2] {
    // Rows of a map run southwards.
    let upwind = upwind(wind);
    let tiles = wind.speed_m_s.get() * time_s / extent_m;
    [(tiles * upwind[0]).rem_euclid(1.0), (-tiles * upwind[1]).rem_euclid(1.0)]
}

/// Wind comes *from* its direction: upwind is towards it.
fn upwind(wind: &Wind) -> [f64; 3] {
    scene::direction(90.0, wind.from_deg.get())
}
