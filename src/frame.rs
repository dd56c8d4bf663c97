//! From a moment to the host structs that the passes take: the only place where double precision becomes single.

use crate::cumulus::Volume;
use crate::cumulus::lattice::{Lighting, inward_m};
use crate::gpu::layout::{Backdrop, Cumulus, Frame, Medium, Placement, SkyView, Sun, SunMaps, View};
use crate::moment::Moment;
use crate::plan::SkyDetail;
use crate::projection::{Side, Sphere, SphereLayout, Viewer, camera_axes};
use crate::request::{Component, Transport, Wanted};
use crate::scene::Scene;
use crate::scene::quantity::Quantity as _;
use glam::DVec2;

fn single<const N: usize>(values: [f64; N]) -> [f32; N] {
    values.map(|value| value as f32)
}

fn sun(moment: &Moment) -> Sun {
    let light = &moment.illumination;
    Sun {
        towards: single(light.towards_sun),
        slant_cosine: moment.slant_cosine() as f32,
        irradiance: single(light.beam),
        cosine: light.cosine() as f32,
        through_air: single(light.air_below.ground_beam),
        spare: 0,
    }
}

/// One layer of a moment.
pub(crate) fn frame(moment: &Moment, number: usize) -> Frame {
    let (light, layer) = (&moment.illumination, &moment.layers[number]);
    Frame {
        sun: sun(moment),
        medium: Medium {
            extinction: single(layer.extinction_per_m),
            extinction_550: layer.extinction_per_m[1] as f32,
            beam: single(layer.beam),
            beam_550: layer.beam[1] as f32,
            smooth_part: single(layer.smooth_part),
            transport_550: layer.transport_550 as f32,
            smooth_albedo: single(layer.smooth_albedo),
            spare: 0,
            forward: single(layer.forward),
            forward_550: layer.forward[1] as f32,
        },
        place: Placement {
            offset_uv: single(layer.offset_uv),
            shift_uv: single(layer.shift_uv),
            above_uv: single(layer.above_uv),
            extent_m: moment.extent_m as f32,
            base_m: layer.base_m as f32,
            depth_m: layer.depth_m as f32,
            max_steps: layer.max_steps,
            lowest: (number == 0).into(),
            ragged: layer.ragged.into(),
        },
        maps: SunMaps {
            sample_at: single(moment.grids.sample_at),
            texels: moment.grids.sun_texels,
            columns: match moment.plan.transport {
                // No sun, no rays to follow.
                _ if !light.is_day() => 1,
                Transport::Columns => 1,
                Transport::Tilted | Transport::Lattice => 2,
                Transport::Entry | Transport::Blended => 0,
            },
        },
    }
}

/// Light on a scene without stratiform layers, as a layer of no cloud.
pub(crate) fn clear(moment: &Moment) -> Frame {
    Frame { sun: sun(moment), ..Frame::default() }
}

/// A layer of cumulus; side of the cubes of its lattice and its floor where its light is wanted.
pub(crate) fn cumulus(
    volume: &Volume,
    lighting: &Lighting,
    beam: [f64; 3],
    lattice: Option<[f64; 2]>,
    drift_m: DVec2,
    [tile_m, sun_diameter]: [f64; 2],
) -> Cumulus {
    let colour = |value: &dyn Fn(usize) -> f64| single([value(0), value(1), value(2)]);
    let scattering = &lighting.scattering;
    Cumulus {
        sun: single(lighting.towards_sun.to_array()),
        extent_m: volume.extent_m as f32,
        irradiance: single(lighting.sun),
        base_m: volume.base_m as f32,
        extinction: single(lighting.extinction_per_m),
        top_m: volume.top_m as f32,
        kept: colour(&|c| scattering[c].kept),
        low_m: volume.base_m.max(volume.floor_m) as f32,
        albedo: colour(&|c| scattering[c].albedo),
        floor_m: volume.floor_m as f32,
        asymmetry: colour(&|c| 3.0 * scattering[c].asymmetry),
        voxel_m: volume.voxel_m as f32,
        beam: single(beam),
        band_m: volume.band_m as f32,
        above: single(lighting.above),
        edge_m: volume.edge_m as f32,
        below: single(lighting.below),
        relief_m: volume.relief_m as f32,
        offset_m: single(drift_m.to_array()),
        tile_m: tile_m as f32,
        sun_radius: (0.5 * sun_diameter) as f32,
        cell_m: lattice.map_or(1.0, |[cell_m, _]| cell_m) as f32,
        lattice_floor_m: lattice.map_or(0.0, |[_, floor_m]| floor_m) as f32,
        inward_m: lattice.map_or(0.0, |[cell_m, _]| inward_m(cell_m, lighting.extinction_per_m[1])) as f32,
        ..Cumulus::default()
    }
}

/// What is asked for, as all of its rows.
pub(crate) fn view(moment: &Moment, wanted: &Wanted, size: [u32; 2]) -> View {
    let whole = View { size, rows: size[1], first: 1, peak: wanted.peak().unwrap_or(true).into(), ..View::default() };
    let part = match wanted.component() {
        None | Some(Component::Total) => 0,
        Some(Component::Direct { .. }) => 1,
        Some(Component::Diffuse { .. }) => 2,
    };
    let Some(plane) = wanted.plane() else { return View { part, ..whole } };
    let view =
        View { from_above: (plane.side == Side::Above).into(), plane_m: moment.plane_m(plane.side) as f32, ..whole };
    match plane.viewer {
        Viewer::At(eye) => View { perspective: 1, eye: single(eye), ..view },
        Viewer::Parallel { .. } => View { towards: single(plane.towards().unwrap_or([0.0; 3])), ..view },
    }
}

/// How far each wave carries what drifts far from an eye, as a part of its length: far enough that copies of the domain stand in no rows, while
/// clouds are drawn out or turned by 0.14 (rms).
const DRIFT: f32 = 0.022;

/// Heights of the eye up to which nothing drifts and from which on all does, domains: rows are seen from above alone.
const DRIFT_HEIGHTS: [f64; 2] = [0.1, 0.4];

/// How far each wave of the drift carries what an eye sees of a scene far off, as a part of its length.
pub(crate) fn drift(scene: &Scene, sphere: &Sphere) -> f32 {
    let [none, all] = DRIFT_HEIGHTS.map(|height| height * scene.domain.extent_m.get());
    let part = ((sphere.eye[2] - none) / (all - none)).clamp(0.0, 1.0);
    if scene.is_synthetic() { DRIFT * (part * part * (3.0 - 2.0 * part)) as f32 } else { 0.0 }
}

/// A view of the sky, as all of its rows.
pub(crate) fn sky_view(sphere: &Sphere, detail: SkyDetail, size: [u32; 2], drift: f32) -> SkyView {
    let whole = SkyView {
        axis_x: [1.0, 0.0, 0.0],
        axis_y: [0.0, 1.0, 0.0],
        axis_z: [0.0, 0.0, 1.0],
        kind: sphere.layout.number() as u32,
        rows: size[1],
        eye: single(sphere.eye),
        size,
        turns: 1.0,
        rays: detail.rays,
        texels_per_ray: detail.texels_per_ray as f32,
        coarseness: detail.coarseness as f32,
        steps: detail.steps as f32,
        drift,
        ..SkyView::default()
    };
    match sphere.layout {
        SphereLayout::Octahedral => whole,
        SphereLayout::Equirect => SkyView { first_turn: sphere.axes.left_turn() as f32, ..whole },
        SphereLayout::Cube => {
            let [axis_x, axis_y, axis_z] = sphere.axes.cube().map(single);
            SkyView { axis_x, axis_y, axis_z, ..whole }
        }
        SphereLayout::Fisheye { fov_deg } => SkyView { turns: (0.5 * fov_deg / 360.0) as f32, ..whole },
        SphereLayout::Camera { look_deg, fov_deg, aspect } => {
            let [axis_x, axis_y, axis_z] = camera_axes(look_deg).map(single);
            let half_height = (0.5 * fov_deg).to_radians().tan();
            let half_width = (half_height * aspect) as f32;
            SkyView { axis_x, axis_y, axis_z, half_width, half_height: half_height as f32, ..whole }
        }
    }
}

/// What lies behind the clouds of a moment, for an eye that sees the horizon at an elevation (radians).
pub(crate) fn backdrop(moment: &Moment, horizon: f64) -> Backdrop {
    Backdrop {
        sun: single(moment.illumination.towards_sun),
        horizon: horizon as f32,
        extent_m: moment.extent_m as f32,
        spare: 0,
        spare_2: [0; 2],
    }
}
