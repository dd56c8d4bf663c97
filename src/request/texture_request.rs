//! A request for one texture, and whether a scene can meet it.

use super::wanted::{Cloud, Irradiance, Sky, TextureKind, Wanted};
use crate::encode::{Exposure, Format, Output, Picture};
use crate::method::{AirMethod, CumulusMethod};
use crate::scene::{Atmosphere, FieldError, Scene};

/// A request for one texture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Request {
    /// Which texture, and what of it.
    pub wanted: Wanted,
    /// Seconds since the scene's start.
    pub time_s: f64,
    /// Texels a side; the scene's resolution when `None`.
    pub size: Option<u32>,
    /// How it is put out.
    pub output: Output,
}

impl Request {
    /// Longest time since a scene's start, s (32 years).
    pub const MAX_TIME_S: f64 = 1e9;
    /// Tolerance unless another is asked for.
    pub const TOLERANCE: f64 = 0.02;

    /// Highest eye that looks at the sky, m: about where air ends.
    pub const MAX_EYE_M: f64 = 100_000.0;

    /// Texels at most where each is traced by itself: tenths of a second to minutes each.
    pub const MAX_TRACED_TEXELS: u64 = 128 * 128;

    /// The kind of texture.
    pub fn texture(&self) -> TextureKind {
        self.wanted.kind()
    }

    /// The file's format.
    pub fn format(&self) -> Format {
        self.output.format()
    }

    /// Name of the file, such as `cloud.exr`.
    pub fn file_name(&self) -> String {
        format!("{}.{}", self.texture().name(), self.format().extension())
    }

    /// Texels across and down.
    pub fn texels(&self, scene: &Scene) -> [u32; 2] {
        let size = self.size.unwrap_or(scene.resolution());
        // Maps of the domain are squares.
        self.wanted.projection().map_or([size; 2], |projection| projection.size(size))
    }

    /// The same request of a scene in its normal form: what the scene gives anyway is left out.
    ///
    /// # Errors
    /// The parameters that do not fit the scene.
    pub fn of(mut self, scene: &Scene) -> Result<Self, Vec<FieldError>> {
        self.check(scene)?;
        self.size = self.size.filter(|size| *size != scene.resolution());
        if scene.layer_count() <= 1
            && let Wanted::Cloud(Cloud { layer, .. }) | Wanted::Sky(Sky { layer, .. }) | Wanted::Thickness { layer } =
                &mut self.wanted
        {
            *layer = None;
        }
        if let (None, Wanted::Cloud(Cloud { cumulus, .. }) | Wanted::Sky(Sky { cumulus, .. })) =
            (&scene.cumulus, &mut self.wanted)
        {
            *cumulus = CumulusMethod::Lattice;
        }
        if let (
            Atmosphere::Given(_),
            Wanted::Cloud(Cloud { air, .. })
            | Wanted::Sky(Sky { air, .. })
            | Wanted::Irradiance(Irradiance { air, .. }),
        ) = (&scene.atmosphere, &mut self.wanted)
        {
            *air = AirMethod::Moments;
        }
        Ok(self)
    }

    /// What a scene adds to the rules of a request.
    fn check(&self, scene: &Scene) -> Result<(), Vec<FieldError>> {
        let count = scene.layer_count();
        let mut errors = Vec::new();
        let mut wrong = |name: &str, detail: String| errors.push(FieldError { pointer: name.to_owned(), detail });
        match (self.wanted.layer(), count) {
            (Some(layer), 0) => wrong("layer", format!("the scene has no layer {layer}: it has none at all")),
            (Some(layer), 1) if layer > 0 => wrong("layer", format!("the scene has no layer {layer}; allowed: 0")),
            (Some(layer), _) if layer as usize >= count => {
                wrong("layer", format!("the scene has no layer {layer}; allowed: 0 to {}", count - 1));
            }
            _ => {}
        }
        if let Some(sphere) = self.wanted.sphere() {
            let height_m = sphere.eye[2];
            if !(0.0..=Self::MAX_EYE_M).contains(&height_m) {
                let detail = format!("z = {height_m} m; allowed: 0, the ground, to {} m", Self::MAX_EYE_M);
                wrong("eye", detail);
            }
        }
        if self.wanted.reference().is_some() {
            self.check_reference(scene, &mut wrong);
        }
        if self.wanted.wavelength_nm().is_some() {
            if matches!(scene.atmosphere, Atmosphere::Given(_)) {
                let detail = "the scene's light is given in three colours; allowed: rgb, or a scene with air";
                wrong("wavelength", detail.to_owned());
            }
            if self.wanted.reference().is_some() {
                wrong("wavelength", "method reference gives colours; allowed: rgb, or another method".to_owned());
            }
            if matches!(self.output.picture(), Some(Picture::Display { exposure: Exposure::Ev100(_), .. })) {
                wrong("ev100", "light of one wavelength has no luminance; allowed: exposure".to_owned());
            }
        }
        if let (Some(Picture::Display { exposure: Exposure::Ev100(_), .. }), Atmosphere::Given(_)) =
            (self.output.picture(), &scene.atmosphere)
        {
            let detail =
                "the scene's light is in its own unit, and a camera's is cd/m2; allowed: exposure, or a scene with air";
            wrong("ev100", detail.to_owned());
        }
        if errors.is_empty() { Ok(()) } else { Err(errors) }
    }

    /// What cannot be traced.
    fn check_reference(&self, scene: &Scene, wrong: &mut impl FnMut(&str, String)) {
        if self.wanted.disc() == Some(true) {
            wrong("disc", "method reference draws no disc of the sun; allowed: false".to_owned());
        }
        if self.wanted.peak() == Some(true) {
            let detail = "method reference counts as beam what was not scattered at all; allowed: false";
            wrong("peak", detail.to_owned());
        }
        // Where all layers are stratiform the whole ground is traced at once.
        let one_by_one = self.wanted.projection().is_some() || scene.cumulus.is_some();
        let texels = self.texels(scene).into_iter().map(u64::from).product::<u64>();
        if one_by_one && texels > Self::MAX_TRACED_TEXELS {
            let detail = format!(
                "reference traces each of at most {} texels, which takes minutes to hours; this is {texels}",
                Self::MAX_TRACED_TEXELS
            );
            wrong("size", detail);
        }
    }
}
