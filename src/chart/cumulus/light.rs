//! Every method of light in cumulus, and what it takes.

use super::truth::{Cloud, Picture, clouds};
use crate::chart::file::ChartError;
use crate::cumulus::dressed::{self, Scattering};
use crate::cumulus::lattice::{Lattice, Lighting};
use crate::cumulus::{Body, Coarse, Octaves, Ray, Surface, Volume};
use crate::method::CumulusMethod;
use crate::optics::{self, Mix};
use crate::reference::cumulus::CumulusLight;
use crate::reference::cumulus_forward::ForwardLight;
use crate::reference::cumulus_octaves::OctavesLight;
use crate::reference::cumulus_surface::SurfaceLight;
use glam::DVec3;
use rayon::prelude::*;

/// Rays end here: the next cloud of the domain that repeats is farther away.
const FARTHEST_M: f64 = 5500.0;

/// Side of a domain in which a cloud has 1 % more light than alone; in one of 4 km 3 to 6 %.
const ALONE_M: f64 = 8000.0;

/// A row of the chart: a method that can be asked for, or constants of octaves that cannot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Row {
    Asked(CumulusMethod),
    Octaves(&'static str, Octaves),
}

/// Rows, cheap to exact.
pub(super) fn rows() -> Vec<Row> {
    let mut rows: Vec<Row> = CumulusMethod::ALL.iter().map(|(_, method)| Row::Asked(*method)).collect();
    let others =
        [Row::Octaves("octaves of halves", Octaves::PUBLISHED), Row::Octaves("8 octaves", Octaves::REFITTED_8)];
    let place = rows.iter().position(|row| *row == Row::Asked(CumulusMethod::Octaves)).unwrap_or(0);
    rows.splice(place..place, others);
    rows
}

impl Row {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Asked(method) => method.name(),
            Self::Octaves(name, _) => name,
        }
    }
}

/// A cloud with what all methods take of it.
pub(super) struct Prepared {
    pub(super) cloud: Cloud,
    volume: Volume,
    /// The same in a domain so wide that copies of the cloud give it no light to speak of: the truth is of clouds alone.
    alone: Volume,
    coarse: Coarse,
}

/// The light of a method in a cloud under a sun.
pub(super) struct Light<'a> {
    row: Row,
    prepared: &'a Prepared,
    volume: &'a Volume,
    lighting: Lighting,
    lattice: Option<Lattice>,
    dressed: &'a [f64],
}

/// One kind of droplets, the same in all colours.
pub(super) struct Droplets {
    scattering: Scattering,
    dressed: Vec<f64>,
}

impl Droplets {
    pub(super) fn new() -> Result<Self, ChartError> {
        let mix = Mix::HenyeyGreenstein { asymmetry: 0.85, albedo: 1.0 };
        let [channel, ..] =
            optics::channels(&mix, &|_| ()).map_err(|_table| ChartError::Empty("droplets of cumulus"))?;
        Ok(Self { scattering: Scattering::new(&channel), dressed: dressed::table(&channel, 1.0) })
    }
}

impl Prepared {
    pub(super) fn all() -> Result<Vec<Self>, ChartError> {
        let prepare = |cloud: Cloud| {
            let volume = Volume::new(&cloud.body);
            let alone = Body { extent_m: ALONE_M, spheres: cloud.body.spheres.clone(), ..cloud.body };
            Self { coarse: Coarse::new(&volume), alone: Volume::new(&alone), volume, cloud }
        };
        Ok(clouds()?.into_iter().map(prepare).collect())
    }

    /// Lit by a sun, or by an even sky.
    pub(super) fn lit<'a>(&'a self, row: Row, droplets: &'a Droplets, sun: Option<&str>) -> Light<'a> {
        let lighting = Lighting {
            extinction_per_m: [self.cloud.extinction_per_m; 3],
            scattering: [droplets.scattering; 3],
            towards_sun: self.cloud.sun(sun.unwrap_or("top")),
            sun: [if sun.is_some() { 1.0 } else { 0.0 }; 3],
            above: [if sun.is_some() { 0.0 } else { 1.0 }; 3],
            below: [0.0; 3],
            returned: [0.0; 3],
        };
        // The wide domain's volume is too coarse for edges that the sun shines through.
        let is_wide = row == Row::Asked(CumulusMethod::Lattice) && !sun.is_some_and(|sun| sun.starts_with("back"));
        let volume = if is_wide { &self.alone } else { &self.volume };
        let lattice = match row {
            Row::Asked(CumulusMethod::Lattice) => Some(Lattice::solve(volume, &lighting)),
            Row::Asked(CumulusMethod::Octaves) | Row::Octaves(..) => Some(Lattice::unlit(volume, &lighting)),
            Row::Asked(_) => None,
        };
        Light { row, prepared: self, volume, lighting, lattice, dressed: &droplets.dressed }
    }
}

impl Light<'_> {
    pub(super) fn green(&self, ray: Ray) -> f64 {
        let Self { row, prepared, volume, lighting, lattice, dressed } = self;
        let background = DVec3::splat(lighting.above[1] * f64::from(ray.towards.z > 0.0));
        let by_octaves = |octaves: Octaves| {
            let seen = |lattice: &Lattice| {
                OctavesLight { volume, lattice, lighting, octaves }.seen(ray, FARTHEST_M, |_| 0.0, background)
            };
            lattice.as_ref().map(seen)
        };
        let by_surface = |surface: Surface| {
            let traps = surface.has_traps(lighting.extinction_per_m[1], &lighting.scattering[1], volume.root_m);
            let coarse = traps.then_some(&prepared.coarse);
            SurfaceLight { volume, lighting, coarse, surface }.seen(ray, FARTHEST_M, |_| 0.0, background)
        };
        let seen = match row {
            Row::Octaves(_, octaves) => by_octaves(*octaves),
            Row::Asked(method) => match (method, method.surface()) {
                (_, Some(surface)) => Some(by_surface(surface)),
                (CumulusMethod::Octaves, _) => by_octaves(Octaves::REFITTED),
                (CumulusMethod::Lattice, _) => lattice.as_ref().map(|lattice| {
                    let dressed = [*dressed; 3];
                    CumulusLight { volume, lattice, lighting, dressed }.seen(ray, FARTHEST_M, |_| 0.0, background)
                }),
                _ => {
                    let published = *method == CumulusMethod::ForwardPublished;
                    Some(ForwardLight { volume, lighting, published }.seen(ray, FARTHEST_M, |_| 0.0, background))
                }
            },
        };
        seen.map_or(f64::NAN, |seen| seen.radiance.y)
    }

    pub(super) fn picture(&self, picture: &Picture) -> Vec<f64> {
        picture.rays.par_iter().map(|&towards| self.green(Ray { from: picture.eye, towards })).collect()
    }
}
