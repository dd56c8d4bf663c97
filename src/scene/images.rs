//! Whether the images that a scene names hold what the scene takes them for.

use super::image_reference::ImagePurpose;
use super::model::{FieldError, Scene};
use super::quantity::{Albedo, EffectiveRadiusUm, FillValue, OpticalDepth, Quantity, ThicknessM};
use super::shape::is_fill;
use crate::image::colour::convert;
use crate::image::{Colour, Extremes, Image, ImageEncoding, Matrix, number};
use std::collections::HashMap;
use std::ops::RangeInclusive;
use std::sync::Arc;

/// Conversion between primaries whose digits were rounded leads this far out of the range at most.
const ROUNDING: f64 = 1e-3;

/// A customary fill value that is so many times all others stands for "no data", perhaps.
const FAR_ABOVE: f32 = 2.0;
/// The same of the largest sample of an integer file, where cloud may end too.
const FAR_ABOVE_INTEGERS: f32 = 10.0;

/// What was found in a scene's images, each with the JSON pointer of the reference.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ImageFindings {
    /// Images that are missing, or hold what the field does not allow: the scene is to be refused.
    pub errors: Vec<FieldError>,
    /// What is allowed, but perhaps not meant.
    pub notes: Vec<FieldError>,
}

impl Scene {
    /// Holds the images that the scene names, by SHA-256, against what it takes them for. Images that are as they should
    /// be cost nothing: the ends of their ranges are known.
    pub fn check_images(&self, images: &HashMap<String, Arc<Image>>) -> ImageFindings {
        let mut found = ImageFindings::default();
        for reference in self.image_references() {
            let pointer = reference.pointer;
            let Some(image) = images.get(&reference.sha256) else {
                let detail = format!("the image {} is missing", reference.sha256);
                found.errors.push(FieldError { pointer, detail });
                continue;
            };
            let mut findings = Findings { pointer, image, found: &mut found };
            findings.emptiness();
            match reference.purpose {
                ImagePurpose::Albedo { linear } => findings.albedo(linear),
                ImagePurpose::Thickness { scale_m, fill } => findings.thickness(scale_m, fill),
                ImagePurpose::Height { scale_m, offset_m, most_m, fill } => {
                    let map = Scaled { scale: scale_m, offset: offset_m, fill };
                    findings.map("samples times scale_m plus offset_m", "m", &map, 0.0..=most_m);
                }
                ImagePurpose::OpticalDepth { scale, fill } => {
                    let map = Scaled { scale, offset: 0.0, fill };
                    findings.map("samples times scale", "optical depth", &map, OpticalDepth::RANGE);
                }
                ImagePurpose::EffectiveRadius { scale_um, fill } => {
                    let map = Scaled { scale: scale_um, offset: 0.0, fill };
                    findings.map("samples times scale_um", "µm", &map, EffectiveRadiusUm::RANGE);
                }
            }
        }
        self.check_shapes(images, &mut found);
        found
    }
}

/// What samples of a map stand for.
struct Scaled {
    scale: f64,
    offset: f64,
    fill: Option<FillValue>,
}

/// The image of one reference, and where to tell what is found.
struct Findings<'a> {
    pointer: String,
    image: &'a Image,
    found: &'a mut ImageFindings,
}

impl Findings<'_> {
    fn error(&mut self, detail: String) {
        self.found.errors.push(FieldError { pointer: self.pointer.clone(), detail });
    }

    fn note(&mut self, detail: String) {
        self.found.notes.push(FieldError { pointer: self.pointer.clone(), detail });
    }

    /// Tells of texels that the file has no samples for.
    fn emptiness(&mut self) {
        let (empty, texels) = (self.image.empty, self.image.texels());
        if empty > 0 {
            self.note(format!(
                "{empty} of {texels} texels are 0, as they lie outside the file's data window, in the display window alone"
            ));
        }
    }

    /// Tells of values out of range, but for those that stand for "no cloud".
    fn map(&mut self, how: &str, unit: &str, map: &Scaled, range: RangeInclusive<f64>) {
        let value = |sample: f32| map.offset + map.scale * f64::from(sample);
        let is_wrong = |sample: f32| !is_fill(map.fill, sample) && !range.contains(&value(sample));
        if let Some(wrong) = self.image.wrong_texels(|texel| texel.first().copied().filter(|sample| is_wrong(*sample)))
        {
            let (least, most) = (number(*range.start()), number(*range.end()));
            let (first, fill) =
                (number(value(wrong.value)), if map.fill.is_some() { "; others than `fill`" } else { "" });
            self.error(format!(
                "{how} must be {least} to {most} ({unit}), and are not in {wrong} ({unit} there: {first}){fill}: fill values \
                 for \"no data\", to be stated as `fill`, or another unit?"
            ));
        }
        if self.image.is_coloured() {
            self.note("the image is coloured; only its red channel is taken".to_owned());
        }
    }

    fn thickness(&mut self, scale_m: f64, fill: Option<FillValue>) {
        if fill.is_some() {
            let map = Scaled { scale: scale_m, offset: 0.0, fill };
            return self.map("samples times scale_m", "m", &map, ThicknessM::RANGE);
        }
        let Some(ends) = self.image.extremes().first() else { return };
        let metres = |sample: f32| f64::from(sample) * scale_m;
        let allowed = |sample: f32| ThicknessM::RANGE.contains(&metres(sample));
        if !(allowed(ends.least) && allowed(ends.greatest)) {
            let wrong = self.image.wrong_texels(|texel| texel.first().copied().filter(|sample| !allowed(*sample)));
            if let Some(wrong) = wrong {
                let (least, most) = (ThicknessM::RANGE.start(), ThicknessM::RANGE.end());
                let first = number(metres(wrong.value));
                self.error(format!(
                    "samples times scale_m must be {least} to {most} m, 0 where there is no cloud, and are not in {wrong} \
                     (times scale_m: {first} m): fill values for \"no data\", or another unit?"
                ));
            }
        } else if may_be_fill(ends, self.image.encoding) {
            self.note(format!(
                "{} texels have exactly {} and all others at most {}: is it a fill value for \"no data\"? It is taken as {} m \
                 of cloud",
                ends.at_greatest,
                stored(ends.greatest, self.image.encoding),
                stored(ends.next.unwrap_or(0.0), self.image.encoding),
                number(metres(ends.greatest)),
            ));
        }
        if self.image.is_coloured() {
            self.note("the image is coloured; of its channels only red is the thickness".to_owned());
        }
    }

    fn albedo(&mut self, linear: bool) {
        match (&self.image.colour, linear) {
            (Colour::Other(what), _) => {
                return self.error(format!(
                    "the file states {what}, which is not converted: convert the image to sRGB, or take the statement out \
                     if it is wrong"
                ));
            }
            (Colour::Linear, false) => {
                return self.error(
                    "the file states linear samples, and the scene takes them as sRGB: say \"linear\": true".to_owned(),
                );
            }
            (Colour::Srgb, true) => {
                self.note("the file states sRGB; its samples are taken as linear, as \"linear\" is true".to_owned());
            }
            _ => {}
        }
        let allowed = |value: f32| Albedo::RANGE.contains(&f64::from(value));
        if !self.image.extremes().iter().all(|ends| allowed(ends.least) && allowed(ends.greatest)) {
            let wrong = self.image.wrong_texels(|texel| texel.iter().copied().find(|value| !allowed(*value)));
            if let Some(wrong) = wrong {
                self.error(format!(
                    "albedo must be 0 to 1, and is not in {wrong}: percent, or fill values for \"no data\"?"
                ));
            }
        } else if let (Colour::Primaries(matrix), Some([least, most])) =
            (&self.image.colour, self.image.range_in_rec709())
        {
            self.conversion(matrix, least, most);
        }
    }

    /// What becomes of colours that are an albedo in the primaries of the file, least to most after conversion.
    fn conversion(&mut self, matrix: &Matrix, least: f64, most: f64) {
        let beyond = |is_beyond: fn(f64) -> bool| {
            self.image.wrong_texels(|texel| {
                let &[r, g, b] = texel else { return None };
                let converted = convert(matrix, [r, g, b].map(f64::from));
                converted.into_iter().find(|value| is_beyond(*value)).map(|value| value as f32)
            })
        };
        let above = if most > 1.0 + ROUNDING { beyond(|value| value > 1.0 + ROUNDING) } else { None };
        let below = if least < -ROUNDING { beyond(|value| value < -ROUNDING) } else { None };
        if let Some(wrong) = above {
            self.error(format!(
                "converted from the file's primaries (chromaticities) to Rec.709, albedo must be at most 1, and is not in \
                 {wrong}: colours so bright and saturated reflect more than arrives"
            ));
        }
        if let Some(clipped) = below {
            self.note(format!(
                "converted from the file's primaries (chromaticities) to Rec.709, albedo is below 0 in {clipped}: colours \
                 more saturated than Rec.709 can be are brought to its edge, 0"
            ));
        }
    }
}

/// Whether the greatest value looks like one that stands for "no data": a customary one, in several texels, far above all
/// others.
fn may_be_fill(ends: &Extremes, encoding: ImageEncoding) -> bool {
    let next = ends.next.unwrap_or(0.0);
    let above = match encoding {
        // Above nothing but 0 it is a mask.
        ImageEncoding::Integer => ends.greatest == 1.0 && next > 0.0 && ends.greatest > FAR_ABOVE_INTEGERS * next,
        ImageEncoding::Float => is_customary(ends.greatest.into()) && ends.greatest > FAR_ABOVE * next,
    };
    above && ends.at_greatest >= 2
}

/// 99, 999.9, 9999 and so on; 127, 255, 32767, 65535 and the like, or one less; and what is beyond all lengths.
fn is_customary(value: f64) -> bool {
    let digits = (10.0 * value).round();
    let nines = (digits - 10.0 * value).abs() < 1e-6 * value && digits >= 990.0 && {
        let text = format!("{digits}");
        text.strip_suffix('0').unwrap_or(&text).bytes().all(|digit| digit == b'9')
    };
    let full = [value + 1.0, value + 2.0].iter().any(|value| *value >= 128.0 && value.log2().fract() == 0.0);
    nines || full || value >= 1e10
}

/// A value as the file has it.
fn stored(value: f32, encoding: ImageEncoding) -> String {
    match encoding {
        ImageEncoding::Integer => format!("{} of the largest sample", number(value.into())),
        ImageEncoding::Float => number(value.into()),
    }
}
