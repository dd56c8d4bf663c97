//! Tables, fields, and what is found of clouds in three dimensions.

use super::droplets::extinction_per_m;
use super::heights::Heights;
use super::tally::Tally;
use crate::cumulus::CumulusBytes;
use crate::cumulus::lattice::layer_cubes;
use crate::field::FieldBytes;
use crate::job::Images;
use crate::method::{CumulusMethod, Transport};
use crate::plan::Plan;
use crate::request::Request;
use crate::scene::quantity::Quantity as _;
use crate::scene::{GroundAlbedo, Scene, Thickness};
use crate::tables::Detail;

/// Tables of a mix without its radiance: on the host by themselves, as rows of texels there and on the device, and a copy on its way.
const MIX: u64 = 12 << 20;
/// Tables of air at four wavelengths, and of air with clouds in it, as they are read and as they are used.
const AIR: u64 = 12 << 20;
/// Copies of a map while it is read back: a buffer of the device and one that the host sees, its floats with their padding and without.
const READ_BACK: u64 = 4;
/// A column as tracers take it.
const TRACED: u64 = 32;

/// What a radiance table of three colours takes.
fn radiance(detail: Detail) -> u64 {
    let size = detail.size();
    (3 * 2 * size_of::<f32>() * size.depths() * size.azimuths * size.zeniths * (size.zeniths + 1) / 2) as u64
}

/// Tables and images.
pub(super) fn tables(tally: &mut Tally, scene: &Scene, request: &Request, plan: &Plan, images: &Images) {
    let decoded: usize = images.values().map(|image| size_of::<f32>() * image.data.len()).sum();
    tally.keep("images", decoded as u64);
    if let GroundAlbedo::Map { image, .. } = &scene.ground.albedo {
        let texels = images.get(&image.0).map_or(0, |image| u64::from(image.width) * u64::from(image.height));
        tally.pass_on_host("images", 3 * size_of::<f64>() as u64 * texels);
    }
    let tabulated = plan.detail().filter(|_| request.texture().needs().slab).map_or(0, radiance);
    for _ in scene.mixes() {
        // Its file is read whole.
        tally.pass_on_host("tables", MIX + 2 * tabulated);
        tally.keep("tables", MIX + tabulated);
    }
    if scene.is_in_air() {
        tally.keep("tables", if scene.layer_count() > 0 { 2 * AIR } else { AIR });
    }
}

/// The fields of the layers, one after the other.
pub(super) fn fields(tally: &mut Tally, maps: &[FieldBytes], traced: bool) {
    for map in maps {
        if map.stays {
            tally.keep("fields", map.source);
        }
        tally.pass("fields", map.passing + map.map + if map.stays { 0 } else { map.source });
        tally.keep("fields", map.map);
    }
    if traced {
        for map in maps {
            tally.pass("maps of the clouds", READ_BACK * map.map);
            tally.keep("maps of the clouds", TRACED * map.map / map.texel);
        }
    }
}

/// A cube of a layer's lattice: its light as it is found, read and brought to the device, whatever it holds; and what is kept of one of
/// cloud until its light has settled, as for cumulus.
const CUBE: u64 = 150;
const CUBE_OF_CLOUD: f64 = 860.0;
/// Part of the cubes that hold cloud where columns are covered, about: tops are uneven.
const FILLED: f64 = 0.85;
/// A column of the map as the lattice takes it.
const COLUMN: u64 = 16;
/// Of what is found, per cube: on the host and on the device.
const FOUND: u64 = 2 * 72;

/// The lattices of stratiform layers.
pub(super) fn lattices(
    tally: &mut Tally,
    scene: &Scene,
    request: &Request,
    plan: &Plan,
    maps: &[FieldBytes],
    images: &Images,
) {
    if plan.transport != Transport::Lattice || !request.texture().needs().light {
        return;
    }
    for (layer, map) in scene.layers.iter().zip(maps).filter(|(layer, _)| !layer.shape.is_even()) {
        let Heights { deepest_m, least_m, .. } = Heights::new(layer, images);
        let cubes = layer_cubes(scene.extent_m(), [deepest_m, least_m], extinction_per_m(&layer.droplets)) as u64;
        let covered = match &layer.shape.thickness {
            Some(Thickness::Stratocumulus(field)) => field.coverage.get(),
            _ => 1.0,
        };
        let solved = cubes * CUBE + (cubes as f64 * CUBE_OF_CLOUD * FILLED * covered) as u64;
        let columns = COLUMN * map.map / map.texel;
        tally.pass("light in three dimensions", READ_BACK * map.map);
        tally.pass_on_host("light in three dimensions", map.map + columns + solved);
        tally.keep("light in three dimensions", cubes * FOUND);
    }
}

/// The layer of cumulus.
pub(super) fn cumulus(tally: &mut Tally, scene: &Scene, request: &Request, plan: &Plan, maps: &[FieldBytes]) {
    let Some(layer) = &scene.cumulus else { return };
    let needs = request.texture().needs();
    let lit = needs.light || needs.slab;
    if lit {
        for map in maps {
            tally.pass("maps of the clouds", READ_BACK * map.map);
            tally.keep("maps of the clouds", map.map);
        }
    }
    let of = CumulusBytes::new(layer, scene.extent_m(), extinction_per_m(&layer.droplets));
    let stage = "cumulus";
    tally.pass(stage, 3 * of.volume);
    tally.keep(stage, 2 * of.volume);
    match plan.cumulus {
        _ if !lit => {}
        CumulusMethod::Lattice => {
            tally.pass_on_host(stage, of.solved);
            tally.keep(stage, 2 * of.light);
        }
        CumulusMethod::Octaves => {
            tally.pass_on_host(stage, of.looked);
            tally.keep(stage, of.sun_depth);
        }
        CumulusMethod::Forward | CumulusMethod::ForwardPublished => {}
        _ => {
            tally.pass_on_host(stage, NORMALS * 5);
            tally.keep(stage, NORMALS);
        }
    }
}

/// Normals of a coarser surface, of 8 bytes on the device for each of two million cubes.
const NORMALS: u64 = 8 * 2_000_000;
