//! The ground's albedo: one colour, or a map stretched over the domain, north up.

use crate::gpu::HostMap;
use crate::image::colour::{convert, srgb_to_linear};
use crate::image::{Colour, Image, ImageEncoding, MissingImage};
use crate::periodic::bilinear;
use crate::reference::Map;
use crate::scene::GroundAlbedo;
use crate::scene::quantity::Quantity as _;
use std::collections::HashMap;
use std::sync::Arc;

/// Albedos as the scene gives them: one texel, or those of its image.
pub(crate) struct GroundMap {
    width: usize,
    height: usize,
    /// Row 0 is the north edge.
    texels: Vec<[f64; 3]>,
}

/// Texels a side that show a ground's albedo as fine as it is: 1 for one colour, at least 2 for a map. Costs nothing.
pub(crate) fn texels_a_side(albedo: &GroundAlbedo, images: &HashMap<String, Arc<Image>>) -> u32 {
    match albedo {
        GroundAlbedo::Uniform(_) => 1,
        GroundAlbedo::Map { image, .. } => images.get(&image.0).map_or(1, |image| image.width.max(image.height)).max(2),
    }
}

impl GroundMap {
    /// The albedos of a ground. `images` are those of its scene, by SHA-256.
    ///
    /// # Errors
    /// When the image is not among them.
    pub(crate) fn new(albedo: &GroundAlbedo, images: &HashMap<String, Arc<Image>>) -> Result<Self, MissingImage> {
        match albedo {
            GroundAlbedo::Uniform(albedo) => {
                Ok(Self { width: 1, height: 1, texels: vec![albedo.map(|value| value.get())] })
            }
            GroundAlbedo::Map { image: name, linear } => {
                let image = images.get(&name.0).ok_or_else(|| MissingImage(name.0.clone()))?;
                Ok(Self {
                    width: image.width as usize,
                    height: image.height as usize,
                    texels: albedos(image, *linear).collect(),
                })
            }
        }
    }

    /// The mean over the ground.
    pub(crate) fn mean(&self) -> [f64; 3] {
        let sum = |c: usize| self.texels.iter().map(|texel| texel[c]).sum::<f64>();
        std::array::from_fn(|c| sum(c) / self.texels.len() as f64)
    }

    /// The map as it is, for tracers. The fourth channel is 0.
    pub(crate) fn exact(&self) -> Map {
        let texels = self.texels.iter().map(|[r, g, b]| [*r, *g, *b, 0.0]).collect();
        Map { width: self.width, height: self.height, texels }
    }

    /// The map brought to a grid of `texels` a side: the mean over each texel of as many bilinear samples as the map has
    /// texels there. The fourth channel is 0.
    pub(crate) fn means(&self, texels: u32) -> HostMap {
        let side = texels as usize;
        // As many samples as there are texels of the map, in each direction of its own.
        let (across, down) = (self.width.div_ceil(side), self.height.div_ceil(side));
        let inside =
            |texel: usize, part: usize, parts: usize| (texel as f64 + (part as f64 + 0.5) / parts as f64) / side as f64;
        let mut data = Vec::with_capacity(4 * side * side);
        for i in 0..side * side {
            let mut sum = [0.0; 3];
            for s in 0..across * down {
                let place = [inside(i % side, s % across, across), inside(i / side, s / across, down)];
                let found = bilinear([self.width, self.height], place, |x, y| self.texels[y * self.width + x]);
                (0..3).for_each(|c| sum[c] += found[c]);
            }
            let mean = sum.map(|value| (value / (across * down) as f64) as f32);
            data.extend([mean[0], mean[1], mean[2], 0.0]);
        }
        HostMap { width: texels, height: texels, channels: 4, data }
    }
}

/// Linear albedos of an image in Rec.709. Colours beyond it come to lie on its edge: `Scene::check_images` tells of those,
/// and refuses what is no albedo.
fn albedos(image: &Image, linear: bool) -> impl Iterator<Item = [f64; 3]> {
    // An integer file is sRGB unless said otherwise; floats are linear.
    let curved = image.encoding == ImageEncoding::Integer && !linear;
    // A grey keeps its value, as white goes to white.
    let matrix = match &image.colour {
        Colour::Primaries(matrix) if image.channels == 3 => Some(matrix),
        _ => None,
    };
    image.rgb().map(move |texel| {
        let texel = if curved { texel.map(srgb_to_linear) } else { texel };
        matrix.map_or(texel, |matrix| convert(matrix, texel).map(|value| value.clamp(0.0, 1.0)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    /// The map of a ground whose albedo is written so, with an image named by `a`s.
    fn ground(albedo: &str, image: Option<Image>) -> Result<GroundMap, MissingImage> {
        let text = format!(r#"{{"ground": {{"albedo": {albedo}}}}}"#).replace("NAME", &"a".repeat(64));
        let scene = Scene::from_json(text.as_bytes()).unwrap();
        let images = image.map(|image| ("a".repeat(64), Arc::new(image))).into_iter().collect();
        GroundMap::new(&scene.ground.albedo, &images)
    }

    fn mapped(image: Image, linear: bool) -> GroundMap {
        ground(&format!(r#"{{"image": "NAME", "linear": {linear}}}"#), Some(image)).unwrap()
    }

    fn image(width: u32, channels: u32, data: &[f32], encoding: ImageEncoding) -> Image {
        Image::new(width, data.len() as u32 / width / channels, channels, data.to_vec(), encoding).unwrap()
    }

    #[test]
    fn one_colour_is_the_same_on_every_grid() {
        let ground = ground("[0.1, 0.2, 0.7]", None).unwrap();
        assert_eq!(ground.exact().texels, [[0.1, 0.2, 0.7, 0.0]]);
        assert_eq!(ground.means(3).data, [0.1, 0.2, 0.7, 0.0].repeat(9));
    }

    #[test]
    fn a_missing_image_is_named() {
        assert_eq!(ground(r#"{"image": "NAME"}"#, None).err(), Some(MissingImage("a".repeat(64))));
    }

    #[test]
    fn integers_are_srgb_unless_linear_and_floats_are_linear() {
        // IEC 61966-2-1: half of the largest sample is 0.214 of the light.
        let first = |encoding, linear| mapped(image(1, 1, &[0.5], encoding), linear).exact().texels[0];
        assert!(first(ImageEncoding::Integer, false).iter().take(3).all(|value| (value - 0.214_041).abs() < 1e-6));
        for plain in [first(ImageEncoding::Integer, true), first(ImageEncoding::Float, false)] {
            assert_eq!(plain, [0.5, 0.5, 0.5, 0.0]);
        }
    }

    #[test]
    fn other_primaries_are_converted_and_ends_kept_in_range() {
        // Red and green of Rec.709 in ACEScg, by the inverse of the published matrix; then a colour outside Rec.709.
        let matrix = [
            [1.705_050_99, -0.621_792_12, -0.083_258_87],
            [-0.130_256_42, 1.140_804_74, -0.010_548_32],
            [-0.024_003_36, -0.128_968_98, 1.152_972_33],
        ];
        let data = [0.613_097_4, 0.070_193_72, 0.020_615_59, 0.339_523_14, 0.916_353_9, 0.109_569_77, 0.0, 0.5, 0.0];
        let image = image(3, 3, &data, ImageEncoding::Float).with_colour(Colour::Primaries(matrix));
        let found = mapped(image.clone(), false).exact();
        let wanted = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.570_402, 0.0]];
        for (found, wanted) in found.texels.iter().zip(wanted) {
            assert!((0..3).all(|c| (found[c] - wanted[c]).abs() < 1e-6), "{found:?}, not {wanted:?}");
            assert!((0..3).all(|c| (0.0..=1.0).contains(&found[c])));
        }
        // A grey is the same in all primaries, to the last bit.
        let grey = self::image(2, 1, &[0.1, 0.7], ImageEncoding::Float);
        let plain = mapped(grey.clone(), false).exact();
        assert_eq!(mapped(grey.with_colour(Colour::Primaries(matrix)), false).exact(), plain);
    }

    #[test]
    fn means_keep_the_mean_of_a_map_and_its_place() {
        let data: Vec<f32> = (0..24 * 12).map(|i| (i * 7919 % 101) as f32 / 101.0).collect();
        let ground = mapped(image(24, 1, &data, ImageEncoding::Float), false);
        let mean = data.iter().map(|value| f64::from(*value)).sum::<f64>() / data.len() as f64;
        for side in [1, 4, 12, 48] {
            let found: Vec<f64> = ground.means(side).data.chunks(4).map(|texel| texel[0].into()).collect();
            let found = found.iter().sum::<f64>() / found.len() as f64;
            assert!((found - mean).abs() < 1e-6, "{side}: {found}, not {mean}");
        }
        // North on top, west on the left.
        let corner = mapped(image(2, 1, &[1.0, 0.0, 0.0, 0.0], ImageEncoding::Float), false).means(2);
        assert_eq!(corner.data.chunks(4).map(|texel| texel[0]).collect::<Vec<_>>(), [1.0, 0.0, 0.0, 0.0]);
    }
}
