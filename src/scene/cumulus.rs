//! The layer of cumulus of a scene: what it holds, from JSON and back.

use super::model::{Droplets, Wind};
use super::quantity::*;
use super::read::{Object, Reader, describe};
use super::{parse, write};
use serde_json::{Value, json};

/// Part of the ground below cloud unless another is asked for: fair weather.
const COVERAGE: f64 = 0.12;
/// Widths of clouds unless others are asked for, metres.
const WIDTH_M: [f64; 2] = [300.0, 1500.0];
/// Depth of the soft edge unless another is asked for, metres.
const EDGE_M: f64 = 20.0;
/// Width of the widest cloud of a field, domains: a wider one would come near itself beyond the domain's edge.
const WIDEST: f64 = 1.0 / 3.0;
/// Fields of a layer of cumulus: those of every layer, those of both shapes, of a field, and of spheres.
pub(super) const FIELDS: [&str; 10] =
    ["kind", "base_m", "droplets", "wind", "edge_m", "coverage", "width_m", "seed", "spheres", "levels"];
/// Those that describe a field.
const FIELD: [&str; 2] = ["coverage", "width_m"];

/// A layer of cumulus: clouds of spheres upon spheres over a flat base.
#[derive(Debug, Clone, PartialEq)]
pub struct Cumulus {
    /// Its index in the scene's list of layers.
    pub(crate) place: usize,
    /// No cloud is below this height.
    pub base_m: BaseM,
    /// Where its clouds are.
    pub shape: CumulusShape,
    /// Depth over which the density rises from 0 at the surface to that of the droplets; 0 is a sharp edge.
    pub edge_m: EdgeM,
    /// What it is made of.
    pub droplets: Droplets,
    /// What carries it; turbulence has no effect.
    pub wind: Wind,
}

/// Where the clouds of a layer of cumulus are.
#[derive(Debug, Clone, PartialEq)]
pub enum CumulusShape {
    /// A synthetic field of clouds that are born, grow and vanish.
    Field {
        /// Part of the domain below cloud, in the mean over time.
        coverage: CumulusCoverage,
        /// Widths of full-grown clouds, least and greatest. No cloud is wider than a third of the domain.
        width_m: [CloudWidthM; 2],
        /// Picks one field of many alike.
        seed: u32,
    },
    /// Spheres that stay as they are.
    Spheres {
        /// Each as x, y and z of its centre above the ground's middle and its radius, metres.
        given: Vec<[f64; 4]>,
        /// Levels of smaller spheres that sit on them and on each other.
        levels: u32,
        /// Picks which of many alike those are.
        seed: u32,
    },
}

impl Cumulus {
    /// Most spheres that are given one by one.
    pub const MAX_SPHERES: usize = 100_000;

    /// Most levels of smaller ones upon them.
    pub const MAX_LEVELS: u32 = 3;

    /// Most of them that others sit on.
    pub const MAX_ROOTS: usize = 256;

    /// Its index in the scene's list of layers.
    pub fn place(&self) -> usize {
        self.place
    }

    /// Width of the widest cloud that a field in a domain of a side has, metres.
    pub fn widest_m(extent_m: f64) -> f64 {
        WIDEST * extent_m
    }

    /// Fields that change nothing, or not what they say, in a domain of a side.
    pub(super) fn notes(&self, extent_m: f64) -> Vec<(&'static str, String)> {
        let mut notes = Vec::new();
        if self.wind.turbulence_m_s.get() > 0.0 {
            let detail = "kept, without effect: cumulus grow and vanish by themselves";
            notes.push(("wind/turbulence_m_s", detail.to_owned()));
        }
        match &self.shape {
            CumulusShape::Field { width_m: [_, greatest], .. } if greatest.get() > Self::widest_m(extent_m) => {
                let detail =
                    format!("kept, but no cloud is wider than a third of the domain, {} m", Self::widest_m(extent_m));
                notes.push(("width_m", detail));
            }
            CumulusShape::Spheres { given: spheres, .. } => {
                let base_m = self.base_m.get();
                let below = spheres.iter().filter(|[_, _, z, radius_m]| z + radius_m <= base_m).count();
                if below > 0 {
                    let detail = format!("{below} of {} lie wholly below base_m, where no cloud is", spheres.len());
                    notes.push(("spheres", detail));
                }
            }
            CumulusShape::Field { .. } => {}
        }
        notes
    }
}

/// Reads the layer at a place of the list; of the domain its side.
pub(super) fn read(
    reader: &mut Reader,
    layer: &Object<'_>,
    place: usize,
    base_m: BaseM,
    extent_m: f64,
) -> Option<Cumulus> {
    let shape = shape(reader, layer, extent_m);
    let edge_m = reader.number_or(layer, "edge_m", EdgeM::try_from(EDGE_M).ok()?);
    let droplets = parse::droplets(reader, layer, None);
    let wind = parse::wind(reader, layer);
    Some(Cumulus { place, base_m, shape: shape?, edge_m, droplets: droplets?, wind: wind? })
}

fn shape(reader: &mut Reader, layer: &Object<'_>, extent_m: f64) -> Option<CumulusShape> {
    if let Some(value) = layer.value("spheres") {
        let levels = reader.integer_or(layer, "levels", (0, Cumulus::MAX_LEVELS), 0);
        let also = (!layer.has("levels")).then_some("seed");
        let beside: Vec<&str> = FIELD.into_iter().chain(also).filter(|key| layer.has(key)).collect();
        if !beside.is_empty() {
            let detail = format!(
                "stands beside {}; either a field or its spheres one by one can be given, with a seed where levels grow on them",
                beside.join(", ")
            );
            reader.wrong(layer.at("spheres"), detail);
            return None;
        }
        let seed = reader.integer_or(layer, "seed", (0, u32::MAX), 0);
        let given = spheres(reader, value, &layer.at("spheres"), layer.has("levels"), extent_m)?;
        return Some(CumulusShape::Spheres { given, levels, seed });
    }
    if layer.has("levels") {
        reader.wrong(layer.at("levels"), "stands without spheres, on which they are grown; a field has its own");
        return None;
    }
    let coverage = reader.number_or(layer, "coverage", CumulusCoverage::try_from(COVERAGE).ok()?);
    let width_m = match layer.value("width_m") {
        Some(value) => widths(reader, value, &layer.at("width_m")),
        None => Some([CloudWidthM::try_from(WIDTH_M[0]).ok()?, CloudWidthM::try_from(WIDTH_M[1]).ok()?]),
    };
    let seed = reader.integer_or(layer, "seed", (0, u32::MAX), 0);
    Some(CumulusShape::Field { coverage, width_m: width_m?, seed })
}

fn widths(reader: &mut Reader, value: &Value, pointer: &str) -> Option<[CloudWidthM; 2]> {
    let Some([least, greatest]) = value.as_array().map(Vec::as_slice) else {
        let (low, high) = CloudWidthM::RANGE.into_inner();
        let given = value.as_array().map_or_else(|| describe(value), |list| format!("a list of {}", list.len()));
        reader.wrong(
            pointer,
            format!("{given} where two numbers [least, greatest] are expected, each {low} to {high} m"),
        );
        return None;
    };
    let least = reader.quantity::<CloudWidthM>(least, &format!("{pointer}/0"));
    let greatest = reader.quantity::<CloudWidthM>(greatest, &format!("{pointer}/1"));
    let (least, greatest) = (least?, greatest?);
    if least > greatest {
        let (least, greatest) = (least.get(), greatest.get());
        reader.wrong(pointer, format!("the least width, {least} m, is above the greatest, {greatest} m"));
        return None;
    }
    Some([least, greatest])
}

/// Reads spheres; the first wrong one is told alone, as the others will be wrong in the same way.
fn spheres(reader: &mut Reader, value: &Value, pointer: &str, are_roots: bool, extent_m: f64) -> Option<Vec<[f64; 4]>> {
    let (most, with) = if are_roots { (Cumulus::MAX_ROOTS, " with levels") } else { (Cumulus::MAX_SPHERES, "") };
    let list = value.as_array().filter(|list| (1..=most).contains(&list.len()));
    let Some(list) = list else {
        let given = value.as_array().map_or_else(|| describe(value), |list| format!("a list of {}", list.len()));
        reader.wrong(pointer, format!("{given} where 1 to {most} spheres [x, y, z, radius_m] are expected{with}"));
        return None;
    };
    let mut spheres = Vec::with_capacity(list.len());
    for (i, sphere) in list.iter().enumerate() {
        let at = format!("{pointer}/{i}");
        let Some([x, y, z, radius_m]) = sphere.as_array().map(Vec::as_slice) else {
            reader.wrong(at, format!("{} where a sphere [x, y, z, radius_m] is expected", describe(sphere)));
            return None;
        };
        let mut place = |value, axis: usize| {
            let at = format!("{at}/{axis}");
            let place = reader.quantity::<SpherePlaceM>(value, &at)?.get();
            let within = place.abs() <= extent_m;
            if !within {
                reader.wrong(at, format!("{place} is outside -{extent_m} to {extent_m} m, the domain's side"));
            }
            within.then_some(place)
        };
        let (x, y) = (place(x, 0), place(y, 1));
        let z = reader.quantity::<SphereHeightM>(z, &format!("{at}/2"));
        let radius_m = reader.quantity::<SphereRadiusM>(radius_m, &format!("{at}/3"));
        let (sphere, half_m) = ([x?, y?, z?.get(), radius_m?.get()], 0.5 * extent_m);
        if sphere[3] > half_m {
            reader.wrong(format!("{at}/3"), format!("{} m is above {half_m} m, half of the domain's side", sphere[3]));
            return None;
        }
        spheres.push(sphere);
    }
    Some(spheres)
}

pub(super) fn write(cumulus: &Cumulus) -> Value {
    let mut text = json!({
        "kind": "cumulus",
        "base_m": cumulus.base_m.get(),
        "edge_m": cumulus.edge_m.get(),
        "droplets": write::droplets(&cumulus.droplets),
        "wind": write::wind(&cumulus.wind),
    });
    match &cumulus.shape {
        CumulusShape::Field { coverage, width_m, seed } => {
            text["coverage"] = json!(coverage.get());
            text["width_m"] = json!(width_m.map(Quantity::get));
            text["seed"] = json!(seed);
        }
        CumulusShape::Spheres { given, levels, seed } => {
            text["spheres"] = json!(given);
            // Scenes without are as they were before there were any.
            if *levels > 0 {
                text["levels"] = json!(levels);
                text["seed"] = json!(seed);
            }
        }
    }
    text
}
