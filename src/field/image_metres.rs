//! What the samples of an image of thickness stand for.

use crate::image::Image;
use crate::scene::is_fill;
use crate::scene::quantity::FillValue;

/// Thickness by an image's first channel, metres; 0 where it has a fill value.
pub(super) fn metres(image: &Image, scale_m: f64, fill: Option<FillValue>) -> Vec<f32> {
    let first_channel = image.data.iter().step_by(image.channels as usize);
    let metres = |sample: f32| if is_fill(fill, sample) { 0.0 } else { (f64::from(sample) * scale_m) as f32 };
    first_channel.map(|sample| metres(*sample)).collect()
}
