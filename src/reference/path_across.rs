//! Cloud along the sun's rays, as maps of sunlight take it. Twin of `shaders/shared/path_across.wgsl`.

use super::columns::{Column, column_piece, is_ragged};
use super::frame::{MIN_COSINE, vec2};
use super::map::Map;
use super::path::{path_excess, path_slope};
use crate::gpu::layout::Frame;
use glam::{DVec2, DVec3, dvec2};

/// A way that is as fast on both axes counts as one along the first, however it is rounded.
const ACROSS_TIE: f64 = 1.0001;

/// Length of cloud of the layer's extinction, metres, along a ray that starts `from_m` above the base, at `start_uv`, and climbs along the
/// unit vector `up`: by the columns where it crosses lines through texel centres, across the axis along which it goes faster.
pub fn path_across(map: &Map, frame: &Frame, start_uv: DVec2, up: DVec3, from_m: f64) -> f64 {
    let slope = path_slope(frame, up);
    let uv_per_metre = slope / path_excess(map, frame, slope).max(1.0);
    let size = dvec2(map.width as f64, map.height as f64);
    let start = start_uv + vec2(frame.place.offset_uv);
    let (places, texels) = (start * size - 0.5, uv_per_metre * size);
    let flipped = texels.y.abs() > ACROSS_TIE * texels.x.abs();
    let (place, along) = if flipped { (places.y, texels.y) } else { (places.x, texels.x) };
    let pitch_m = along.abs().max(1e-9).recip();
    let first = if along > 0.0 { place.floor() + 1.0 - place } else { place - place.ceil() + 1.0 };
    let way_m = f64::from(frame.place.depth_m) - from_m;
    let at = |done_m: f64| map.sample_periodic((start + uv_per_metre * done_m).to_array());
    let (mut sum_m, mut done_m, mut next_m, mut before) = (0.0, 0.0, pitch_m * first, at(0.0));
    while done_m < way_m {
        let after = at(next_m);
        sum_m += (next_m - done_m) * across_cloud(frame, [before, after], [from_m + done_m, from_m + next_m]);
        (before, done_m, next_m) = (after, next_m, next_m + pitch_m);
    }
    sum_m / up.z.max(MIN_COSINE)
}

/// Part of the way between two columns, at those heights, that is in cloud, times its extinction relative to the layer's.
fn across_cloud(frame: &Frame, [first, last]: [Column; 2], heights_m: [f64; 2]) -> f64 {
    if is_ragged(frame) {
        return column_piece(first, last, heights_m)
            .map_or(0.0, |piece| piece.density * (piece.ends[1] - piece.ends[0]));
    }
    let [before, after] = [first[0] - heights_m[0], last[0] - heights_m[1]];
    (before.max(0.0) + after.max(0.0)) / (before.abs() + after.abs()).max(1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::path::path_in_layer;

    fn frame(depth_m: f32, ragged: u32) -> Frame {
        let mut frame = Frame::default();
        frame.place.extent_m = 2000.0;
        frame.place.depth_m = depth_m;
        frame.place.max_steps = 1024;
        frame.place.ragged = ragged;
        frame.medium.extinction_550 = 0.03;
        frame
    }

    fn towards(zenith_deg: f64, azimuth_deg: f64) -> DVec3 {
        let ((sine, cosine), (x, y)) = (zenith_deg.to_radians().sin_cos(), azimuth_deg.to_radians().sin_cos());
        DVec3::new(sine * x, sine * y, cosine)
    }

    /// Of even layers rays are exact: nothing changes between two lines.
    #[test]
    fn even_layers_are_slabs() {
        let sheet = Map::from_fn(16, 16, |_, _| [300.0, 0.0, 0.0, 0.0]);
        let columns = Map::from_fn(16, 16, |_, _| [300.0, 450.0, 50.0, 0.0]);
        for (zenith_deg, azimuth_deg) in [(0.0, 0.0), (30.0, 135.0), (60.0, 20.0), (80.0, 250.0)] {
            let up = towards(zenith_deg, azimuth_deg);
            for (map, depth_m, ragged) in [(&sheet, 300.0, 0), (&columns, 450.0, 1)] {
                let found = path_across(map, &frame(depth_m, ragged), dvec2(0.3, 0.7), up, 0.0) * up.z;
                // Rounding.
                assert!((found - 300.0).abs() < 1e-6, "{zenith_deg}, {azimuth_deg}: {found}");
            }
        }
    }

    /// Over waves of some texels they are those of rays that are exact for the map, but for what bends between two lines.
    #[test]
    fn rays_through_waves_are_nearly_exact() {
        let turn = |waves: f64, texel: usize| std::f64::consts::TAU * waves / 32.0 * texel as f64;
        let wave = |x: usize, y: usize| 150.0 + 150.0 * turn(2.0, x).sin() * (turn(3.0, y) + 1.0).cos();
        let sheet = Map::from_fn(32, 32, |x, y| [wave(x, y), 0.0, 0.0, 0.0]);
        let columns = Map::from_fn(32, 32, |x, y| [wave(x, y), 100.0 + wave(x, y), 100.0 - 0.3 * wave(x, y), 0.0]);
        for azimuth_deg in [0.0, 33.0, 135.0, 290.0] {
            let up = towards(60.0, azimuth_deg);
            for (map, depth_m, ragged) in [(&sheet, 300.0, 0), (&columns, 400.0, 1)] {
                let frame = frame(depth_m, ragged);
                let (mut square, mut sum, mut mean) = (0.0, 0.0, 0.0);
                for i in 0..400 {
                    let uv = dvec2(0.013 + 0.371 * f64::from(i), 0.027 + 0.211 * f64::from(i)).fract();
                    let exact = path_in_layer(map, &frame, uv, up);
                    let difference = path_across(map, &frame, uv, up, 0.0) - exact;
                    (square, sum, mean) =
                        (square + difference * difference / 400.0, sum + difference / 400.0, mean + exact / 400.0);
                }
                // From line to line a ray climbs by a fifth of the layer. Found: 0 to 0.033, most along a diagonal, and 0.002 of the mean.
                assert!(square.sqrt() < 0.04 * mean, "{azimuth_deg}, {ragged}: {} of {mean}", square.sqrt());
                assert!(sum.abs() < 0.005 * mean, "{azimuth_deg}, {ragged}: {sum} of {mean}");
            }
        }
    }
}
