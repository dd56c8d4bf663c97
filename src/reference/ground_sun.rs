//! The sun's beam on the ground, with its 5-degree peak or without, as the view says. Twin of `shaders/ground_sun.wgsl`.

use super::frame::{image, vec2, vec3};
use super::map::Map;
use super::path::path_in_layer;
use super::sun::beam_through;
use super::sun_sweep::Swept;
use crate::gpu::layout::{Disc, Frame, View};
use glam::{DVec2, DVec3, DVec4};

/// What takes light out of the beam.
#[derive(Clone, Copy)]
struct Beam<'a> {
    frame: &'a Frame,
    transmittance: &'a Map,
    /// Parts of extinction; the fourth at 550 nm.
    out: DVec4,
}

impl Beam<'_> {
    /// Parts left after so many metres of cloud; the fourth at 550 nm, however little comes through in all.
    fn after(&self, path_m: f64) -> DVec4 {
        let left = beam_through(self.frame, self.transmittance, self.out.truncate(), path_m);
        left.extend((-self.out.w * f64::from(self.frame.medium.extinction_550) * path_m).exp())
    }
}

/// What one layer leaves at a place on the ground; `swept` are rays towards the directions of the disc, where they are swept.
fn at(beam: Beam<'_>, disc: &Disc, thickness: &Map, swept: &[Swept], uv: DVec2) -> DVec4 {
    let frame = beam.frame;
    let mut sum = DVec4::ZERO;
    for place in &disc.places[..disc.count as usize] {
        let base_uv = uv + vec2(place.shift_uv);
        let rays = match swept.get(place.direction as usize) {
            Some(swept) => {
                swept.about(frame, base_uv).map(|(weight, m)| (weight, m / f64::from(place.cosine))).to_vec()
            }
            None => vec![(1.0, path_in_layer(thickness, frame, base_uv, towards(disc, place.direction)))],
        };
        sum += rays.into_iter().map(|(weight, path_m)| weight * beam.after(path_m)).sum::<DVec4>();
    }
    sum / f64::from(disc.total)
}

fn towards(disc: &Disc, direction: u32) -> DVec3 {
    vec3(disc.ways[direction as usize].towards)
}

/// Parts of the beam that one layer leaves at each texel, row by row; the fourth at 550 nm, however little comes through in all. `disc` is all of the sun's.
pub fn main(frame: &Frame, disc: &Disc, view: &View, thickness: &Map, transmittance: &Map) -> Vec<DVec4> {
    let medium = &frame.medium;
    let out = if view.peak == 1 { vec3(medium.beam).extend(medium.beam_550.into()) } else { DVec4::ONE };
    let beam = Beam { frame, transmittance, out };
    let directions = if disc.fine > 0 { disc.directions } else { 0 };
    let sweep = |direction| Swept::new(frame, thickness, disc, towards(disc, direction));
    let swept: Vec<Swept> = (0..directions).map(sweep).collect();
    image(view, |uv| at(beam, disc, thickness, &swept, uv).to_array()).chunks(4).map(DVec4::from_slice).collect()
}
