//! What is made from all that: the texels, and their file.

use super::heights::Heights;
use super::tally::Tally;
use crate::encode::{Mips, Output};
use crate::field::FieldBytes;
use crate::job::Images;
use crate::moment::{has_flat_rays, swept_bytes};
use crate::plan::Plan;
use crate::request::{Component, Request};
use crate::scene::quantity::Quantity as _;
use crate::scene::{Layer, Scene, SunStand, direction};
use crate::shade::{SWEPT_BYTES, band_rows};

/// Mip levels of the fields, where rays are flat.
pub(super) fn levels(tally: &mut Tally, request: &Request, maps: &[FieldBytes]) {
    let sky = request.wanted.sphere().is_some();
    if sky || request.wanted.plane().is_some_and(|plane| has_flat_rays(plane.towards())) {
        tally.keep("fields", maps.iter().map(FieldBytes::levels).sum());
    }
}

/// A texel of the beam on the ground, four floats; and of the sums of several parts of the sun's disc.
const BEAM: u64 = 16;
const SUMS: u64 = 16;
/// Texels whose beams are made together, and of how many together they are kept.
const TOGETHER: u64 = 1 << 22;
const KEPT_BEAMS: u64 = 4 * TOGETHER;
/// The map of the ground below a sky: its light, radiance with mip levels, albedo.
const GROUND: u64 = 512 * 512 * (12 + 2 * 22 + 16);
/// A texel of a band of the sky: clouds, and what they hold.
const SKY: u64 = 32;
/// Copies of a band on its way to the host.
const READ: u64 = 3;

fn square(size: [u32; 2]) -> u64 {
    u64::from(size[0]) * u64::from(size[1])
}

/// Where the sun may stand: rays towards it are planned anew for each place.
fn suns(scene: &Scene) -> Vec<[f64; 3]> {
    match scene.sun.stand {
        SunStand::Direction { zenith_deg, azimuth_deg } => vec![direction(zenith_deg.get(), azimuth_deg.get())],
        SunStand::Over { .. } => {
            let zeniths = (0..=9).map(|step| f64::from(step) * 10.0);
            zeniths.flat_map(|zenith_deg| [0.0, 45.0].map(|azimuth_deg| direction(zenith_deg, azimuth_deg))).collect()
        }
    }
}

/// What makes the beam at so many texels of the ground: what is swept over each layer, and sums.
fn towards_sun(scene: &Scene, maps: &[FieldBytes], images: &Images, texels: u64, side: u32) -> u64 {
    let sums = if maps.len() > 1 { SUMS } else { 0 };
    let swept = |(layer, map): (&Layer, &FieldBytes)| {
        let Heights { base_m, deepest_m, least_m } = Heights::new(layer, images);
        let depths = [deepest_m, least_m];
        let looked = suns(scene).into_iter().flat_map(|sun| depths.map(|depth_m| (sun, depth_m)));
        let bytes =
            looked.map(|(sun, depth_m)| swept_bytes(scene, layer, map.size, sun, [base_m, depth_m], side, SWEPT_BYTES));
        bytes.max().unwrap_or(0)
    };
    let swept: u64 = scene.layers.iter().zip(maps).map(swept).sum();
    swept + sums * texels.min(TOGETHER)
}

/// The texels and their file.
pub(super) fn shown(
    tally: &mut Tally,
    scene: &Scene,
    request: &Request,
    plan: &Plan,
    maps: &[FieldBytes],
    images: &Images,
) {
    let size = request.texels(scene);
    let (texels, channels) = (square(size), request.wanted.channels().len() as u64);
    let float = size_of::<f32>() as u64;
    // All colours are made, also where one is wanted.
    let made = request.texture().channels().len() as u64;
    let band = u64::from(band_rows(size, 1.0)) * u64::from(size[0]);
    let mut passing = READ * float * made * band;
    let needs = request.texture().needs();
    let traced = plan.reference.is_some();
    if needs.ground_sun && !traced {
        let side = request.size.unwrap_or(scene.resolution());
        // Diffuse light without a peak is all light without the beam, and all light has the beam with its peak.
        let both = matches!(request.wanted.component(), Some(Component::Diffuse { peak: false }));
        let beams = texels * if both { 2 } else { 1 };
        tally.keep("beams", BEAM * beams.min(KEPT_BEAMS));
        // One more is made before another goes.
        let more = if beams > KEPT_BEAMS { BEAM * TOGETHER } else { 0 };
        passing += more + towards_sun(scene, maps, images, texels, side);
    }
    if request.wanted.sphere().is_some() && request.texture().shows_the_scene() {
        tally.pass("ground", BEAM * 512 * 512 + towards_sun(scene, maps, images, 512 * 512, 512));
        tally.keep("ground", GROUND);
        passing += SKY * band;
    }
    tally.keep("texels", float * made * texels * if traced { 2 } else { 1 });
    tally.pass("texels", passing);
    let file = match request.output {
        // Beside the file there are its levels but the first one; for those of mirrors all of them once more, with four channels.
        Output::Packed(packed) => {
            let levels = match packed.mips {
                Mips::None => 0,
                Mips::Means => channels.div_ceil(3),
                Mips::Specular => channels.div_ceil(3) + 6,
            };
            packed.bytes(size, channels as usize) + float * texels * levels
        }
        _ => float * texels * channels,
    };
    tally.pass_on_host("texels", file);
}
