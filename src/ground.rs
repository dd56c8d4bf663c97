//! The ground's albedo: one colour, or a map stretched over the domain, north up.

use crate::gpu::HostMap;
use crate::image::{Image, ImageEncoding};
use crate::reference::Map;
use crate::scene::GroundAlbedo;
use crate::scene::quantity::Quantity as _;
use std::collections::HashMap;
use std::sync::Arc;

pub(crate) struct GroundMap { width: usize, height: usize, texels: Vec<[f64; 3]> }

pub(crate) fn texels_a_side(albedo: &GroundAlbedo, images: &HashMap<String, Arc<Image>>) -> u32 {
    match albedo {
        GroundAlbedo::Uniform(_) => 1,
        GroundAlbedo::Map { image, .. } => {
            images.get(&image.0).map_or(1, |image| image.width.max(image.height)).max(2)
        }
    }
}

impl GroundMap {
    pub(crate) fn new(albedo: &GroundAlbedo, images: &HashMap<String, Arc<Image>>) -> Result<Self, String> {
        match albedo {
            GroundAlbedo::Uniform(albedo) => {
                Ok(Self { width: 1, height: 1, texels: vec![albedo.map(|value| value.get())] })
            }
            GroundAlbedo::Map { image: name, linear } => {
                let image = images.get(&name.0).ok_or_else(|| name.0.clone())?;
                Ok(Self {
                    width: image.width as usize,
                    height: image.height as usize,
                    texels: albedos(image, *linear),
                })
            }
        }
    }
    pub(crate) fn exact(&self) -> Map {
        let texels = self.texels.iter().map(|[r, g, b]| [*r, *g, *b, 0.0]).collect();
        Map { width: self.width, height: self.height, texels }
    }
    pub(crate) fn means(&self, texels: u32) -> HostMap {
        let data = resample(&self.texels, self.width, self.height, texels as usize);
        HostMap { width: texels, height: texels, channels: 4, data }
    }
}

fn rgb(channels: [f64; 3], fourth: f64) -> [f32; 4] {
    [channels[0] as f32, channels[1] as f32, channels[2] as f32, fourth as f32]
}

/// Linear albedos of an image.
fn albedos(image: &Image, linear: bool) -> Vec<[f64; 3]> {
    // An integer file is sRGB unless said otherwise; floats are linear.
    let decode = image.encoding == ImageEncoding::Integer && !linear;
    image.data.chunks(image.channels as usize).map(|texel| albedo(texel, decode)).collect()
}

fn albedo(texel: &[f32], decode: bool) -> [f64; 3] {
    let channel = |c: usize| {
        let value = f64::from(*texel.get(c).or(texel.first()).unwrap_or(&0.0)).clamp(0.0, 1.0);
        // IEC 61966-2-1.
        match decode {
            true if value <= 0.04045 => value / 12.92,
            true => ((value + 0.055) / 1.055).powf(2.4),
            false => value,
        }
    };
    [channel(0), channel(1), channel(2)]
}

/// A map stretched over the domain, brought to a grid: the mean of as many bilinear samples as there are texels.
fn resample(values: &[[f64; 3]], width: usize, height: usize, texels: usize) -> Vec<f32> {
    // As many samples as there are texels of the image, in each direction of its own.
    let (across, down) = (width.div_ceil(texels), height.div_ceil(texels));
    let at = |x: usize, y: usize| values[y * width + x];
    let sample = |u: f64, v: f64| {
        let (x, y) = (u * width as f64 - 0.5, v * height as f64 - 0.5);
        let wrap = |i: f64, n: usize| (i as isize).rem_euclid(n as isize) as usize;
        let (x0, y0) = (wrap(x.floor(), width), wrap(y.floor(), height));
        let (x1, y1) = ((x0 + 1) % width, (y0 + 1) % height);
        let (fx, fy) = (x - x.floor(), y - y.floor());
        let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
        std::array::from_fn::<f64, 3, _>(|c| {
            mix(mix(at(x0, y0)[c], at(x1, y0)[c], fx), mix(at(x0, y1)[c], at(x1, y1)[c], fx), fy)
        })
    };
    let mut data = Vec::with_capacity(4 * texels * texels);
    for i in 0..texels * texels {
        let mut sum = [0.0; 3];
        for s in 0..across * down {
            let inside = |texel: usize, part: usize, parts: usize| {
                (texel as f64 + (part as f64 + 0.5) / parts as f64) / texels as f64
            };
            let found = sample(inside(i % texels, s % across, across), inside(i / texels, s / across, down));
            (0..3).for_each(|c| sum[c] += found[c]);
        }
        data.extend(rgb(sum.map(|value| value / (across * down) as f64), 0.0));
    }
    data
}

