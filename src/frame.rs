//! From a moment to the host structs that the passes take: the only place where double precision becomes single.

use crate::gpu::layout::{Frame, Medium, Placement, Sun, SunMaps, View};
use crate::moment::Moment;
use crate::projection::{Projection, Side, Viewer};
use crate::request::{Component, Transport, Wanted};

fn single<const N: usize>(values: [f64; N]) -> [f32; N] {
    values.map(|value| value as f32)
}

/// One layer of a moment.
pub(crate) fn frame(moment: &Moment, number: usize) -> Frame {
    let (light, layer) = (&moment.illumination, &moment.layers[number]);
    Frame {
        sun: Sun {
            towards: single(light.towards_sun),
            slant_cosine: moment.slant_cosine() as f32,
            irradiance: single(light.beam),
            cosine: light.cosine() as f32,
            radius: (0.5 * light.sun_diameter) as f32,
            discs: layer.discs,
            spare: [0; 2],
        },
        medium: Medium {
            extinction: single(layer.extinction_per_m),
            extinction_550: layer.extinction_per_m[1] as f32,
            beam: single(layer.beam),
            beam_550: layer.beam[1] as f32,
            smooth_part: single(layer.smooth_part),
            transport_550: layer.transport_550 as f32,
            smooth_albedo: single(layer.smooth_albedo),
            spare: 0,
        },
        place: Placement {
            offset_uv: single(layer.offset_uv),
            shift_uv: single(layer.shift_uv),
            above_uv: single(layer.above_uv),
            extent_m: moment.extent_m as f32,
            base_m: layer.base_m as f32,
            depth_m: layer.depth_m as f32,
            max_steps: layer.max_steps,
            spare: [0; 2],
        },
        maps: SunMaps {
            sample_at: single(moment.grids.sample_at),
            texels: moment.grids.sun_texels,
            columns: match moment.plan.transport {
                // No sun, no rays to follow.
                _ if !light.is_day() => 1,
                Transport::Columns => 1,
                Transport::Tilted => 2,
                Transport::Entry | Transport::Blended => 0,
            },
        },
    }
}

/// A layer as it looks without the sun's light.
pub(crate) fn sunless(frame: &Frame) -> Frame {
    Frame { sun: Sun { irradiance: [0.0; 3], cosine: 0.0, ..frame.sun }, ..*frame }
}

/// What is asked for, as all of its rows.
pub(crate) fn view(moment: &Moment, wanted: &Wanted, size: [u32; 2]) -> View {
    let whole = View { size, rows: size[1], first: 1, peak: wanted.peak().unwrap_or(true).into(), ..View::default() };
    let part = match wanted.component() {
        None | Some(Component::Total) => 0,
        Some(Component::Direct { .. }) => 1,
        Some(Component::Diffuse { .. }) => 2,
    };
    let Some(Projection::Plane(plane)) = wanted.projection() else { return View { part, ..whole } };
    let view =
        View { from_above: (plane.side == Side::Above).into(), plane_m: moment.plane_m(plane.side) as f32, ..whole };
    match plane.viewer {
        Viewer::At(eye) => View { perspective: 1, eye: single(eye), ..view },
        Viewer::Parallel { .. } => View { towards: single(plane.towards().unwrap_or([0.0; 3])), ..view },
    }
}
