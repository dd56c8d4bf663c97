//! The sun's beam on the ground. Twin of `shaders/ground_sun.wgsl`.

use super::frame::{image, vec2, vec3};
use super::map::Map;
use super::path::path_in_layer;
use super::sun::sun_through;
use super::sun_sweep::Swept;
use crate::gpu::layout::{Disc, Frame, View};
use glam::{DVec2, DVec3, DVec4};

/// What a layer leaves of the beam at a texel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroundSun {
    /// Parts left with the 5-degree peak; the fourth at 550 nm, however little comes through in all.
    pub beam: DVec4,
    /// Unscattered parts; the fourth at 550 nm.
    pub unscattered: DVec4,
}

/// What one layer leaves at a place on the ground; `swept` are rays towards the directions of the disc, where they are swept.
fn at(frame: &Frame, disc: &Disc, thickness: &Map, transmittance: &Map, swept: &[Swept], uv: DVec2) -> GroundSun {
    let (mut beam, mut unscattered) = (DVec4::ZERO, DVec4::ZERO);
    for place in &disc.places[..disc.count as usize] {
        let base_uv = uv + vec2(place.shift_uv);
        let rays = match swept.get(place.direction as usize) {
            Some(swept) => {
                swept.about(frame, base_uv).map(|(weight, m)| (weight, m / f64::from(place.cosine))).to_vec()
            }
            None => vec![(1.0, path_in_layer(thickness, frame, base_uv, towards(disc, place.direction)))],
        };
        let extinction = vec3(frame.medium.extinction).extend(frame.medium.extinction_550.into());
        for (weight, path_m) in rays {
            let at_550 = (-f64::from(frame.medium.beam_550) * extinction.w * path_m).exp();
            beam += weight * sun_through(frame, transmittance, path_m).beam.extend(at_550);
            unscattered += weight * (-extinction * path_m).map(f64::exp);
        }
    }
    let count = f64::from(disc.total);
    let beam = beam / count;
    GroundSun { beam, unscattered: (unscattered / count).min(beam.truncate().extend(1.0)) }
}

fn towards(disc: &Disc, direction: u32) -> DVec3 {
    vec3(disc.ways[direction as usize].towards)
}

/// What one layer leaves at each texel, row by row; `disc` is all of the sun's.
pub fn main(frame: &Frame, disc: &Disc, view: &View, thickness: &Map, transmittance: &Map) -> Vec<GroundSun> {
    let directions = if disc.fine > 0 { disc.directions } else { 0 };
    let sweep = |direction| Swept::new(frame, thickness, disc, towards(disc, direction));
    let swept: Vec<Swept> = (0..directions).map(sweep).collect();
    let parts = image(view, |uv| {
        let GroundSun { beam, unscattered } = at(frame, disc, thickness, transmittance, &swept, uv);
        let (beam, unscattered) = (beam.to_array(), unscattered.to_array());
        std::array::from_fn::<f64, 8, _>(|i| if i < 4 { beam[i] } else { unscattered[i - 4] })
    });
    let half = |values: &[f64]| DVec4::new(values[0], values[1], values[2], values[3]);
    parts.chunks(8).map(|parts| GroundSun { beam: half(&parts[..4]), unscattered: half(&parts[4..]) }).collect()
}
