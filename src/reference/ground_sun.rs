//! The sun's beam on the ground. Twin of `shaders/ground_sun.wgsl`.

use super::frame::{MIN_COSINE, image, vec2, vec3};
use super::map::Map;
use super::path::path_in_layer;
use super::sun::sun_through;
use crate::gpu::layout::{Frame, View};
use glam::{DVec2, DVec3, DVec4, dvec2};

/// What a layer leaves of the beam at a texel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroundSun {
    /// Parts left with the 5-degree peak; the fourth at 550 nm, however little comes through in all.
    pub beam: DVec4,
    /// Unscattered parts; the fourth at 550 nm.
    pub unscattered: DVec4,
}

/// Direction towards a place on the sun's disc: a spiral of equal areas (Vogel 1979); one place is the middle.
fn disc_direction(frame: &Frame, i: u32) -> DVec3 {
    let sun = vec3(frame.sun.towards);
    let part = if frame.sun.discs > 1 { (f64::from(i) + 0.5) / f64::from(frame.sun.discs) } else { 0.0 };
    let radius = f64::from(frame.sun.radius) * part.sqrt();
    let (sin, cos) = (2.399_963_2 * f64::from(i)).sin_cos();
    let flat = dvec2(-sun.y, sun.x);
    let side = if flat.length() < 1e-6 { DVec3::X } else { flat.normalize().extend(0.0) };
    (sun + radius * (cos * side + sin * sun.cross(side))).normalize()
}

/// What one layer leaves at a place on the ground.
pub fn at(frame: &Frame, thickness: &Map, transmittance: &Map, uv: DVec2) -> GroundSun {
    let (mut beam, mut unscattered, mut count) = (DVec4::ZERO, DVec4::ZERO, 0.0);
    let sun = vec3(frame.sun.towards);
    for i in 0..frame.sun.discs {
        let towards = disc_direction(frame, i);
        if towards.z <= 0.0 && i > 0 {
            continue;
        }
        let apart = towards.truncate() / towards.z.max(MIN_COSINE) - sun.truncate() / f64::from(frame.sun.slant_cosine);
        let apart = apart * f64::from(frame.place.base_m / frame.place.extent_m);
        let apart = if frame.sun.discs > 1 { dvec2(apart.x, -apart.y) } else { DVec2::ZERO };
        let base_uv = uv + vec2(frame.place.shift_uv) + apart;
        let path_m = path_in_layer(thickness, frame, base_uv, towards);
        let extinction = vec3(frame.medium.extinction).extend(frame.medium.extinction_550.into());
        let at_550 = (-f64::from(frame.medium.beam_550) * extinction.w * path_m).exp();
        beam += sun_through(frame, transmittance, path_m).beam.extend(at_550);
        unscattered += (-extinction * path_m).map(f64::exp);
        count += 1.0;
    }
    let beam = beam / count;
    GroundSun { beam, unscattered: (unscattered / count).min(beam.truncate().extend(1.0)) }
}

/// What one layer leaves at each texel, row by row.
pub fn main(frame: &Frame, view: &View, thickness: &Map, transmittance: &Map) -> Vec<GroundSun> {
    let parts = image(view, |uv| {
        let GroundSun { beam, unscattered } = at(frame, thickness, transmittance, uv);
        let (beam, unscattered) = (beam.to_array(), unscattered.to_array());
        std::array::from_fn::<f64, 8, _>(|i| if i < 4 { beam[i] } else { unscattered[i - 4] })
    });
    let half = |values: &[f64]| DVec4::new(values[0], values[1], values[2], values[3]);
    parts.chunks(8).map(|parts| GroundSun { beam: half(&parts[..4]), unscattered: half(&parts[4..]) }).collect()
}
