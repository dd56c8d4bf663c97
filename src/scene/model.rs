//! What a scene is made of: each value is valid, so that later stages need no checks.

use super::aerosol::Scatterers;
use super::air::Atmosphere;
use super::cumulus::{Cumulus, CumulusShape};
use super::image_reference::{ImagePurpose, ImageReference};
use super::quantity::*;
use super::shape::Shape;
use super::synthetic::Stratocumulus;
use super::{parse, write};
use crate::optics::{Mix, PhaseTable};
use crate::sun::{Place, Utc};
use sha2::{Digest, Sha256};
use std::error::Error;

/// One wrong field: where it is and what is allowed there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FieldError {
    /// JSON pointer into the scene (`/layers/0/base_m`), or the name of a query parameter.
    pub pointer: String,
    /// What was given and what is allowed.
    pub detail: String,
}

/// Why a scene was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// Not JSON; the text says where it breaks.
    #[error("not readable as JSON: {0}")]
    Unreadable(String),
    /// JSON, but with wrong fields; all of them are listed.
    #[error("{}", list(.0))]
    Invalid(Vec<FieldError>),
}

/// Turns what a scene gives for an image into the SHA-256 of the image, or says why it can't.
pub type Resolve<'a> = &'a mut dyn FnMut(&str) -> Result<String, Box<dyn Error>>;

/// Wrong fields in one line.
pub(crate) fn list(errors: &[FieldError]) -> String {
    errors.iter().map(|e| format!("{}: {}", e.pointer, e.detail)).collect::<Vec<_>>().join("; ")
}

/// A valid scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    pub(crate) domain: Domain,
    pub(crate) sun: Sun,
    pub(crate) atmosphere: Atmosphere,
    pub(crate) ground: Ground,
    /// The stratiform layers, bottom to top: each base lies above the one before.
    pub(crate) layers: Vec<Layer>,
    /// The layer of cumulus.
    pub(crate) cumulus: Option<Cumulus>,
}

/// The square tile that is computed, periodic in x and y, centred on the origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Domain {
    /// Side.
    pub extent_m: ExtentM,
    /// Texels a side of a synthetic field, and of a texture that asks for no other size: 1 to 4096.
    pub resolution: u32,
}

/// The sun.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sun {
    /// Where it stands.
    pub stand: SunStand,
    /// Across the disc, which blurs the edges of shadows; 0 is parallel light.
    pub angular_diameter_deg: AngularDiameterDeg,
}

/// Where the sun stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SunStand {
    /// Always in one direction.
    Direction {
        /// From straight up; above 90 the sun is below the horizon and gives no light.
        zenith_deg: ZenithDeg,
        /// Clockwise from north.
        azimuth_deg: AzimuthDeg,
    },
    /// Over a place: it moves with time.
    Over {
        /// The place.
        place: Place,
        /// When the scene's time is 0.
        start: Utc,
    },
}

/// The ground at z = 0, a diffuse reflector.
#[derive(Debug, Clone, PartialEq)]
pub struct Ground {
    /// Its albedo.
    pub albedo: GroundAlbedo,
}

/// One colour everywhere, or a map stretched over the domain.
#[derive(Debug, Clone, PartialEq)]
pub enum GroundAlbedo {
    /// The same everywhere.
    Uniform([Albedo; 3]),
    /// A map with north up.
    Map {
        /// Name of the image.
        image: ImageName,
        /// Take the samples of a PNG as linear; otherwise they are decoded as sRGB.
        linear: bool,
    },
}

/// SHA-256 of an image file, 64 lower-case hexadecimal digits.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ImageName(pub(crate) String);

/// A stratiform layer of cloud.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// Where its cloud is.
    pub shape: Shape,
    /// What it is made of.
    pub droplets: Droplets,
    /// What moves it.
    pub wind: Wind,
}

/// Geometric thickness of a layer.
#[derive(Debug, Clone, PartialEq)]
pub enum Thickness {
    /// The same everywhere.
    Uniform(ThicknessM),
    /// A synthetic field.
    Stratocumulus(Stratocumulus),
    /// An image's first channel times a scale, bilinear and periodic.
    Map {
        /// Name of the image.
        image: ImageName,
        /// Metres for a sample of 1.
        scale_m: ThicknessM,
        /// The sample that stands for "no cloud".
        fill: Option<FillValue>,
    },
}

/// What scatters light in a layer.
#[derive(Debug, Clone, PartialEq)]
pub enum Droplets {
    /// Water droplets of a modified gamma distribution, by Mie theory.
    Gamma {
        /// Effective radius.
        effective_radius_um: EffectiveRadiusUm,
        /// Broadness.
        broadness: Broadness,
        /// Number density; without effect where `extinction_per_m` is given.
        number_per_cm3: NumberPerCm3,
        /// Overrides the extinction in all three channels.
        extinction_per_m: Option<ExtinctionPerM>,
        /// Overrides the real part of the refractive index: red, green, blue.
        refractive_index: Option<[RefractiveIndex; 3]>,
    },
    /// Henyey-Greenstein phase function, the same in all channels.
    HenyeyGreenstein {
        /// Mean cosine of the scattering angle.
        asymmetry: Asymmetry,
        /// Extinction.
        extinction_per_m: ExtinctionPerM,
        /// Single-scattering albedo.
        albedo: Albedo,
    },
    /// A phase function given as a table, the same in all channels.
    Tabulated {
        /// The table.
        table: PhaseTable,
        /// Extinction.
        extinction_per_m: ExtinctionPerM,
        /// Single-scattering albedo.
        albedo: Albedo,
    },
}

/// Mean wind of a layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wind {
    /// Speed.
    pub speed_m_s: SpeedMS,
    /// Where it comes from, clockwise from north.
    pub from_deg: AzimuthDeg,
    /// Speed of the eddies that move a field's parts against each other: root mean square of their velocity.
    pub turbulence_m_s: TurbulenceMS,
}

impl Scene {
    /// Most bytes of JSON that are read as a scene.
    pub const MAX_BYTES: usize = 4 * 1024 * 1024;
    /// Most layers of cloud.
    pub const MAX_LAYERS: usize = 4;
    /// Most texels a side of a field or texture.
    pub const MAX_SIDE: u32 = 4096;

    /// Reads a scene.
    ///
    /// # Errors
    /// [`SceneError::Unreadable`] when the text is not JSON; [`SceneError::Invalid`] with every wrong field otherwise.
    pub fn from_json(text: &[u8]) -> Result<Self, SceneError> {
        parse::scene(text, &mut |name| Ok(name.to_owned()))
    }

    /// Reads a scene whose images may be given as something else than their hash, such as a file path: `resolve` turns
    /// what is written there into the SHA-256 of the image, or says why it can't.
    ///
    /// # Errors
    /// As [`Scene::from_json`].
    pub fn with_image_names(text: &[u8], resolve: Resolve<'_>) -> Result<Self, SceneError> {
        parse::scene(text, resolve)
    }

    /// The scene as JSON with every default spelled out. Reading it back gives an equal scene.
    pub fn to_json(&self) -> serde_json::Value {
        write::scene(self)
    }

    /// Name of the scene: the first 32 hexadecimal digits of the SHA-256 of its normalised JSON.
    pub fn id(&self) -> String {
        let digest = Sha256::digest(self.to_json().to_string().as_bytes());
        digest.iter().take(16).map(|byte| format!("{byte:02x}")).collect()
    }

    /// Whether it has physical air; if not, it gives its light itself.
    pub fn is_in_air(&self) -> bool {
        matches!(self.atmosphere, Atmosphere::Air(_))
    }

    /// Whether nothing in the domain has a place that was given: its copies far off may then lie elsewhere.
    pub(crate) fn is_synthetic(&self) -> bool {
        let spheres = |cumulus: &Cumulus| matches!(cumulus.shape, CumulusShape::Spheres { .. });
        self.image_references().is_empty() && !self.cumulus.as_ref().is_some_and(spheres)
    }

    /// Every image that the scene names, with the place where it does.
    pub fn image_references(&self) -> Vec<ImageReference> {
        let mut found = Vec::new();
        let mut name = |pointer: String, image: &ImageName, purpose| {
            found.push(ImageReference { pointer, sha256: image.0.clone(), purpose });
        };
        if let GroundAlbedo::Map { image, linear } = &self.ground.albedo {
            name("/ground/albedo/image".to_owned(), image, ImagePurpose::Albedo { linear: *linear });
        }
        for (number, layer) in self.layers.iter().enumerate() {
            let at = |field: &str| format!("/layers/{}/{field}/image", self.place(number));
            for (field, image, purpose) in layer.shape.images() {
                name(at(field), image, purpose);
            }
        }
        found
    }

    /// Fields that are accepted but change nothing in this scene, or leave open what is meant.
    pub fn notes(&self) -> Vec<FieldError> {
        let mut notes = Vec::new();
        let mut note = |i: usize, field: &str, detail: String| {
            notes.push(FieldError { pointer: format!("/layers/{i}/{field}"), detail });
        };
        for (number, layer) in self.layers.iter().enumerate() {
            if layer.wind.turbulence_m_s.get() > 0.0 && layer.shape.is_even() {
                let detail = "kept, without effect: a layer of the same thickness everywhere has nothing to move";
                note(self.place(number), "wind/turbulence_m_s", detail.to_owned());
            }
        }
        if let Some(cumulus) = &self.cumulus {
            for (field, detail) in cumulus.notes(self.extent_m()) {
                note(cumulus.place(), field, detail);
            }
        }
        for (number, droplets) in self.droplets().enumerate() {
            if let Droplets::Tabulated { table, .. } = droplets
                && let Some(doubt) = table.doubt()
            {
                note(self.place(number), "droplets/phase_function", doubt.to_string());
            }
        }
        if let Atmosphere::Air(air) = &self.atmosphere
            && let Scatterers::Tabulated { table, .. } = &air.aerosol.scatterers
            && let Some(doubt) = table.doubt()
        {
            let pointer = "/atmosphere/aerosol/phase_function".to_owned();
            notes.push(FieldError { pointer, detail: doubt.to_string() });
        }
        notes
    }

    /// Droplets of the stratiform layers, lowest first, and then of the cumulus.
    fn droplets(&self) -> impl Iterator<Item = &Droplets> {
        let cumulus = self.cumulus.iter().map(|cumulus| &cumulus.droplets);
        self.layers.iter().map(|layer| &layer.droplets).chain(cumulus)
    }

    /// The droplet mixes whose tables a rendering needs: those of the stratiform layers, lowest first, and last that of the
    /// cumulus.
    pub fn mixes(&self) -> Vec<Mix> {
        self.droplets().map(Droplets::mix).collect()
    }

    /// Where the layer of one of the [`Scene::mixes`] stands in the scene's list of layers.
    pub fn place(&self, number: usize) -> usize {
        match &self.cumulus {
            Some(cumulus) if number == self.layers.len() => cumulus.place(),
            Some(cumulus) if number >= cumulus.place() => number + 1,
            _ => number,
        }
    }

    /// Which of the stratiform layers, counted from the lowest, stands at a place of the scene's list; `None` for cumulus and
    /// where there is none.
    pub fn stratiform_index(&self, place: usize) -> Option<usize> {
        (0..self.layers.len()).find(|&number| self.place(number) == place)
    }

    /// Side of the domain, metres.
    pub fn extent_m(&self) -> f64 {
        self.domain.extent_m.get()
    }

    /// Number of layers of cloud of all kinds, 0 to [`Scene::MAX_LAYERS`].
    pub fn layer_count(&self) -> usize {
        self.stratiform_count() + usize::from(self.cumulus.is_some())
    }

    /// Optical depth of the one stratiform layer, where it is the same everywhere and its extinction is stated.
    pub(crate) fn sheet_depth(&self) -> Option<f64> {
        match self.layers.as_slice() {
            [Layer { shape, droplets, .. }] if shape.is_even() => match shape.thickness {
                Some(Thickness::Uniform(metres)) => Some(metres.get() * droplets.stated_extinction_per_m()?),
                _ => None,
            },
            _ => None,
        }
    }

    /// Number of stratiform layers.
    pub fn stratiform_count(&self) -> usize {
        self.layers.len()
    }

    /// The layer of cumulus, if there is one.
    pub fn cumulus(&self) -> Option<&Cumulus> {
        self.cumulus.as_ref()
    }

    /// Texels a side unless a request asks for another size.
    pub fn resolution(&self) -> u32 {
        self.domain.resolution
    }

    /// Height of the lowest cloud base, metres, as far as it is known without images and fields; 0 without any layer.
    pub fn base_m(&self) -> f64 {
        let bases = self.layers.iter().find_map(|layer| layer.shape.flat_base_m()).into_iter();
        bases.chain(self.cumulus().map(|cumulus| cumulus.base_m.get())).reduce(f64::min).unwrap_or(0.0)
    }
}

impl Droplets {
    /// The mix without its number density: what tables depend on.
    pub fn mix(&self) -> Mix {
        match self {
            Self::Gamma { effective_radius_um, broadness, refractive_index, .. } => Mix::Gamma {
                effective_radius_um: effective_radius_um.get(),
                broadness: broadness.get(),
                refractive_index: refractive_index.map(|index| index.map(Quantity::get)),
            },
            Self::HenyeyGreenstein { asymmetry, albedo, .. } => {
                Mix::HenyeyGreenstein { asymmetry: asymmetry.get(), albedo: albedo.get() }
            }
            Self::Tabulated { table, albedo, .. } => Mix::Tabulated { table: table.clone(), albedo: albedo.get() },
        }
    }

    /// Extinction per metre, if the scene states it: the same in all channels.
    pub(crate) fn stated_extinction_per_m(&self) -> Option<f64> {
        match self {
            Self::Gamma { extinction_per_m, .. } => extinction_per_m.map(Quantity::get),
            Self::HenyeyGreenstein { extinction_per_m, .. } | Self::Tabulated { extinction_per_m, .. } => {
                Some(extinction_per_m.get())
            }
        }
    }

    /// Extinction per metre of the three channels, given the mean extinction cross-sections per droplet in µm².
    pub fn extinction_per_m(&self, cross_section_um2: [f64; 3]) -> [f64; 3] {
        match self {
            Self::Gamma { extinction_per_m: Some(extinction), .. }
            | Self::HenyeyGreenstein { extinction_per_m: extinction, .. }
            | Self::Tabulated { extinction_per_m: extinction, .. } => [extinction.get(); 3],
            // 1 per cm³ = 1e6 per m³, 1 µm² = 1e-12 m².
            Self::Gamma { number_per_cm3, .. } => cross_section_um2.map(|area| number_per_cm3.get() * 1e-6 * area),
        }
    }
}

/// Unit vector (east, north, up) of a zenith angle and an azimuth, degrees. Straight angles come out exact: a sun at 180
/// degrees azimuth has no eastern part at all.
pub(crate) fn direction(zenith_deg: f64, azimuth_deg: f64) -> [f64; 3] {
    let (sin_zenith, cos_zenith) = sin_cos_deg(zenith_deg);
    let (sin_azimuth, cos_azimuth) = sin_cos_deg(azimuth_deg);
    [sin_zenith * sin_azimuth, sin_zenith * cos_azimuth, cos_zenith]
}

fn sin_cos_deg(degrees: f64) -> (f64, f64) {
    let quarter = (degrees / 90.0).round();
    let (sin, cos) = (degrees - 90.0 * quarter).to_radians().sin_cos();
    match (quarter as i64).rem_euclid(4) {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}
