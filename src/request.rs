//! What is asked of a sky: one texture, at one time, seen one way, in one format.

pub use crate::encode::Format;
use crate::scene::{FieldError, Scene};
use std::fmt::Write as _;

/// A texture that can be asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TextureKind {
    /// Radiance leaving the clouds towards the viewer, premultiplied, and alpha.
    Cloud,
    /// Part of the sun's beam that reaches the ground.
    Shadow,
    /// Downward irradiance on the ground.
    Irradiance,
    /// Geometric thickness of cloud.
    Thickness,
}

impl TextureKind {
    /// Every texture.
    pub const ALL: [Self; 4] = [Self::Cloud, Self::Shadow, Self::Irradiance, Self::Thickness];

    /// Its name in addresses and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cloud => "cloud",
            Self::Shadow => "shadow",
            Self::Irradiance => "irradiance",
            Self::Thickness => "thickness",
        }
    }

    /// Names of its channels.
    pub fn channels(self) -> &'static [&'static str] {
        match self {
            Self::Cloud => &["R", "G", "B", "A"],
            Self::Irradiance => &["R", "G", "B"],
            Self::Shadow | Self::Thickness => &["Y"],
        }
    }
}

/// The side from which clouds are seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// From the ground: texels lie on the plane of the lowest base.
    Below,
    /// From the air: texels lie on the plane of the highest top.
    Above,
}

impl Method {
    /// Every method and its name.
    pub const ALL: [(&'static str, Self); 3] =
        [("analytic", Self::Analytic), ("tabulated", Self::Tabulated), ("reference", Self::Reference)];
}

/// Where the viewer is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Viewer {
    /// Far away: the same direction for every texel, as unit vector towards the viewer (east, north, up).
    Parallel([f64; 3]),
    /// At a point, metres (east, north, up).
    At([f64; 3]),
}

/// Which part of the ground's irradiance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Component {
    /// All light.
    Total,
    /// The sun's beam.
    Direct,
    /// All but the beam.
    Diffuse,
}

/// How linear light becomes a picture's display values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tonemap {
    /// Clipped at white.
    None,
    /// A shoulder towards white.
    Filmic,
}

/// Transfer of a PNG's samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// For eyes.
    Srgb,
    /// For masks: values as they are, without exposure or tone curve.
    Linear,
}

/// How slab light is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// The model of 2006, repaired: orders 0, 1, 2 in closed form; all higher orders isotropic, closed against the paper's
    /// fluxes for its own droplets (7 um, broadness 2), against exact ones for others.
    Analytic,
    /// Single scattering exact; all the rest from tables of the exact solution.
    Tabulated,
    /// Monte Carlo: minutes, for comparisons. A slab for every texel of a cloud; all layers in three dimensions for light
    /// on the ground.
    Reference,
}

/// How sunlight is carried through a cloud that is not the same everywhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Transport {
    /// Each column by itself, as if its neighbours were like it: what most renderers do. For comparison.
    Columns,
    /// A column as deep as the slanted ray to the sun that ends at its base; seen from above, slopes without their shadows.
    Tilted,
    /// Columns lit by what enters around them: the sunlit parts of the cloud's top, blurred as light spreads.
    Entry,
    /// The mean of the two above: each errs where the other does not.
    Blended,
}

impl Transport {
    /// Every method and its name, cheap to exact.
    pub const ALL: [(&'static str, Self); 4] =
        [("columns", Self::Columns), ("tilted", Self::Tilted), ("entry", Self::Entry), ("blended", Self::Blended)];

    /// Its name.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(_, method)| *method == self).map_or("", |(name, _)| name)
    }
}

/// A request for one texture. Fields that do not touch the texture keep their defaults, so that equal replies have
/// equal [`Request::canonical`] texts.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// Which texture.
    pub texture: TextureKind,
    /// In which format.
    pub format: Format,
    /// Seconds since the scene's start.
    pub time_s: f64,
    /// Texels a side; the scene's resolution when `None`.
    pub size: Option<u32>,
    /// `cloud`: seen from below or above.
    pub side: Side,
    /// `cloud`: where the viewer is.
    pub viewer: Viewer,
    /// `irradiance`: which part.
    pub component: Component,
    /// `shadow` and `irradiance`: light scattered by less than 5 degrees counts as beam.
    pub peak: bool,
    /// `cloud`: divide colour by alpha.
    pub straight_alpha: bool,
    /// Acceptable relative root-mean-square error.
    pub tolerance: f64,
    /// How slab light is computed; the plan's choice when `None`. `shadow` and `irradiance`: `Reference` or `None`.
    pub method: Option<Method>,
    /// How sunlight is carried through uneven cloud; the plan's choice when `None`.
    pub transport: Option<Transport>,
    /// Method `reference`: seed of its random numbers.
    pub seed: u64,
    /// Multiplies linear output.
    pub scale: f64,
    /// Exposure of a PNG, stops.
    pub exposure_stops: f64,
    /// Tone curve of a PNG.
    pub tonemap: Tonemap,
    /// Transfer of a PNG.
    pub encoding: Encoding,
    /// Bits a sample: EXR 16 or 32, PNG 8 or 16.
    pub depth: u32,
    /// One layer alone (0 = lowest); all when `None`.
    pub layer: Option<u32>,
}

/// Why a request was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RequestError {
    /// No texture of that name.
    #[error("no texture \"{0}\"; there are cloud, shadow, irradiance, thickness")]
    UnknownTexture(String),
    /// No format of that extension.
    #[error("no format \"{0}\"; there are exr, png, f32")]
    UnknownFormat(String),
    /// Wrong parameters; all of them are listed.
    #[error("{}", .0.iter().map(|e| format!("{}: {}", e.pointer, e.detail)).collect::<Vec<_>>().join("; "))]
    Invalid(Vec<FieldError>),
}

/// A query parameter, for help texts and command-line options.
#[derive(Debug, Clone, Copy)]
pub struct QueryParameter {
    /// Its name.
    pub name: &'static str,
    /// What it may be.
    pub values: &'static str,
    /// Its default.
    pub default: &'static str,
    /// What it does.
    pub meaning: &'static str,
}

const fn parameter(
    name: &'static str,
    values: &'static str,
    default: &'static str,
    meaning: &'static str,
) -> QueryParameter {
    QueryParameter { name, values, default, meaning }
}

/// Every query parameter.
pub const QUERY_PARAMETERS: &[QueryParameter] = &[
    parameter("time", "0 to 1e9", "0", "seconds since the scene's start"),
    parameter("size", "1 to 4096", "the scene's resolution", "texels a side"),
    parameter("view", "below | above", "below", "side from which the clouds are seen"),
    parameter(
        "direction",
        "ZENITH,AZIMUTH (0 to 89.9, -360 to 360)",
        "0,0",
        "towards the viewer, degrees: a parallel view",
    ),
    parameter("eye", "X,Y,Z (each -1e7 to 1e7)", "none", "viewer's place, metres: a perspective view of the plane"),
    parameter("component", "total | direct | diffuse", "total", "part of the irradiance"),
    parameter("peak", "true | false", "true", "light scattered by less than 5 degrees counts as the sun's beam"),
    parameter("alpha", "premultiplied | straight", "premultiplied", "how colour goes with alpha"),
    parameter("tolerance", "above 0 to 1", "0.02", "acceptable relative error, root mean square"),
    parameter("method", "tabulated | analytic | reference", "by tolerance", "how slab light is computed"),
    parameter(
        "transport",
        "columns | tilted | entry | blended",
        "by tolerance",
        "how sunlight is carried through uneven cloud",
    ),
    parameter("seed", "0 to 4294967295", "1", "random numbers of method reference: other seeds give other noise"),
    parameter("layer", "0 to 3", "all", "one layer alone, 0 = lowest; light still uses all"),
    parameter("scale", "1e-6 to 1e6", "1", "multiplies linear output"),
    parameter("exposure", "-20 to 20", "0", "exposure of a PNG, stops"),
    parameter("tonemap", "filmic | none", "filmic", "tone curve of a PNG"),
    parameter("encoding", "srgb | linear", "srgb", "transfer of a PNG; linear is for masks"),
    parameter("depth", "8 | 16 | 32", "16 (EXR), 8 (PNG), 32 (f32)", "bits a sample"),
];

impl Request {
    /// Longest time since a scene's start, s (32 years).
    pub const MAX_TIME_S: f64 = 1e9;

    /// The request with every default.
    pub fn new(texture: TextureKind, format: Format) -> Self {
        Self {
            texture,
            format,
            time_s: 0.0,
            size: None,
            side: Side::Below,
            viewer: Viewer::Parallel([0.0, 0.0, -1.0]),
            component: Component::Total,
            peak: true,
            straight_alpha: false,
            tolerance: 0.02,
            method: None,
            transport: None,
            seed: 1,
            scale: 1.0,
            exposure_stops: 0.0,
            tonemap: Tonemap::Filmic,
            encoding: Encoding::Srgb,
            depth: match format {
                Format::Exr => 16,
                Format::Png => 8,
                Format::F32 => 32,
            },
            layer: None,
        }
    }

    /// Reads a request from the names in an address and its decoded query pairs.
    ///
    /// # Errors
    /// An unknown texture or format, or every wrong, unknown or repeated parameter.
    pub fn parse(texture: &str, format: &str, query: &[(String, String)]) -> Result<Self, RequestError> {
        let found = TextureKind::ALL.into_iter().find(|kind| kind.name() == texture);
        let texture = found.ok_or_else(|| RequestError::UnknownTexture(texture.to_owned()))?;
        let found = Format::ALL.into_iter().find(|kind| kind.extension() == format);
        let format = found.ok_or_else(|| RequestError::UnknownFormat(format.to_owned()))?;
        let mut request = Self::new(texture, format);
        let mut errors = Vec::new();
        let mut wrong = |name: &str, detail: String| {
            errors.push(FieldError { pointer: name.to_owned(), detail });
        };
        let mut direction = None;
        let mut eye = None;
        for (i, (name, value)) in query.iter().enumerate() {
            let Some(parameter) = QUERY_PARAMETERS.iter().find(|p| p.name == name) else {
                let known: Vec<_> = QUERY_PARAMETERS.iter().map(|p| p.name).collect();
                wrong(name, format!("unknown parameter; there are {}", known.join(", ")));
                continue;
            };
            if query[..i].iter().any(|(earlier, _)| earlier == name) {
                wrong(name, "given more than once".to_owned());
                continue;
            }
            if request.set(name, value, &mut direction, &mut eye).is_none() {
                wrong(name, format!("\"{value}\" is not allowed; allowed: {}", parameter.values));
            }
        }
        if direction.is_some() && eye.is_some() {
            wrong("eye", "either direction or eye can be given".to_owned());
        }
        let (zenith, azimuth) = direction.unwrap_or((0.0, 0.0));
        let mut towards = crate::scene::direction(zenith, azimuth);
        if request.side == Side::Below {
            towards[2] = -towards[2];
        }
        request.viewer = eye.map_or(Viewer::Parallel(towards), Viewer::At);
        if errors.is_empty() { Ok(request.without_idle_fields()) } else { Err(RequestError::Invalid(errors)) }
    }

    /// Sets one parameter; `None` when the value is not allowed.
    fn set(
        &mut self,
        name: &str,
        value: &str,
        direction: &mut Option<(f64, f64)>,
        eye: &mut Option<[f64; 3]>,
    ) -> Option<()> {
        match name {
            "time" => self.time_s = number(value, 0.0, Self::MAX_TIME_S)?,
            "size" => self.size = Some(value.parse().ok().filter(|size| (1..=Scene::MAX_SIDE).contains(size))?),
            "view" => self.side = word(value, &[("below", Side::Below), ("above", Side::Above)])?,
            "direction" => {
                let (zenith, azimuth) = value.split_once(',')?;
                *direction = Some((number(zenith, 0.0, 89.9)?, number(azimuth, -360.0, 360.0)?));
            }
            "eye" => {
                let parts: Option<Vec<f64>> = value.split(',').map(|part| number(part, -1e7, 1e7)).collect();
                *eye = Some(parts?.try_into().ok()?);
            }
            "component" => {
                let words =
                    [("total", Component::Total), ("direct", Component::Direct), ("diffuse", Component::Diffuse)];
                self.component = word(value, &words)?;
            }
            "peak" => self.peak = word(value, &[("true", true), ("false", false)])?,
            "alpha" => self.straight_alpha = word(value, &[("premultiplied", false), ("straight", true)])?,
            "tolerance" => self.tolerance = number(value, f64::MIN_POSITIVE, 1.0)?,
            "method" => self.method = Some(word(value, &Method::ALL)?),
            "transport" => self.transport = Some(word(value, &Transport::ALL)?),
            "seed" => self.seed = value.parse::<u32>().ok()?.into(),
            "layer" => {
                self.layer = Some(value.parse().ok().filter(|layer| (*layer as usize) < Scene::MAX_LAYERS)?);
            }
            "scale" => self.scale = number(value, 1e-6, 1e6)?,
            "exposure" => self.exposure_stops = number(value, -20.0, 20.0)?,
            "tonemap" => self.tonemap = word(value, &[("filmic", Tonemap::Filmic), ("none", Tonemap::None)])?,
            "encoding" => self.encoding = word(value, &[("srgb", Encoding::Srgb), ("linear", Encoding::Linear)])?,
            "depth" => {
                let allowed: &[(&str, u32)] = match self.format {
                    Format::Exr => &[("16", 16), ("32", 32)],
                    Format::Png => &[("8", 8), ("16", 16)],
                    Format::F32 => &[("32", 32)],
                };
                self.depth = word(value, allowed)?;
            }
            _ => return None,
        }
        Some(())
    }

    /// Puts the fields that do not touch the reply back to their defaults.
    fn without_idle_fields(self) -> Self {
        let idle = Self::new(self.texture, self.format);
        let (cloud, irradiance) = (self.texture == TextureKind::Cloud, self.texture == TextureKind::Irradiance);
        let marched = self.texture != TextureKind::Thickness;
        let traced = marched && self.method == Some(Method::Reference);
        let beam = self.texture == TextureKind::Shadow || irradiance;
        let picture = self.format == Format::Png;
        Self {
            side: if cloud { self.side } else { idle.side },
            viewer: if cloud { self.viewer } else { idle.viewer },
            // Light on the ground goes through tables of fluxes, whatever the cloud's method.
            method: if cloud || traced { self.method } else { idle.method },
            transport: if cloud || (irradiance && !traced) { self.transport } else { idle.transport },
            seed: if traced { self.seed } else { idle.seed },
            straight_alpha: cloud && self.straight_alpha,
            component: if irradiance { self.component } else { idle.component },
            peak: !beam || self.peak,
            tolerance: if marched { self.tolerance } else { idle.tolerance },
            exposure_stops: if picture { self.exposure_stops } else { idle.exposure_stops },
            tonemap: if picture { self.tonemap } else { idle.tonemap },
            encoding: if picture { self.encoding } else { idle.encoding },
            ..self
        }
    }

    /// What a scene adds to the rules of a request.
    ///
    /// # Errors
    /// The parameters that do not fit the scene.
    pub fn check(&self, scene: &Scene) -> Result<(), Vec<FieldError>> {
        let count = scene.layer_count();
        let mut errors = Vec::new();
        let mut wrong = |name: &str, detail: String| errors.push(FieldError { pointer: name.to_owned(), detail });
        match (self.layer, count) {
            (Some(layer), 0) => wrong("layer", format!("the scene has no layer {layer}: it has none at all")),
            (Some(layer), 1) if layer > 0 => wrong("layer", format!("the scene has no layer {layer}; allowed: 0")),
            (Some(layer), _) if layer as usize >= count => {
                wrong("layer", format!("the scene has no layer {layer}; allowed: 0 to {}", count - 1));
            }
            _ => {}
        }
        if self.method == Some(Method::Reference) {
            if self.texture == TextureKind::Cloud && count > 1 {
                let detail = format!(
                    "reference traces the cloud of a single layer; the scene has {count}; allowed: tabulated, analytic"
                );
                wrong("method", detail);
            }
            let parted = self.texture == TextureKind::Shadow
                || (self.texture == TextureKind::Irradiance && self.component != Component::Total);
            if parted && self.peak {
                let detail = "method reference counts as beam what was not scattered at all; allowed: false";
                wrong("peak", detail.to_owned());
            }
        }
        if errors.is_empty() { Ok(()) } else { Err(errors) }
    }

    /// A text that is equal for equal requests: part of cache keys.
    pub fn canonical(&self) -> String {
        let mut text = String::new();
        // Writing to a String cannot fail.
        let _ = write!(text, "{self:?}");
        text
    }
}

/// A finite number between two ends, both included.
fn number(text: &str, least: f64, most: f64) -> Option<f64> {
    text.parse::<f64>().ok().filter(|number| (least..=most).contains(number)).map(|number| number + 0.0)
}

fn word<T: Copy>(text: &str, words: &[(&str, T)]) -> Option<T> {
    words.iter().find(|(word, _)| *word == text).map(|(_, value)| *value)
}
