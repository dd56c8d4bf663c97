//! The one table of query parameters: name, range or words, default, meaning, how each is read and written.

use super::given::{CAMERA_FOV_DEG, FISHEYE_FOV_DEG, Given};
use super::texture_request::Request;
use super::wanted::Component;
use crate::axes::Axes;
use crate::encode::{Alpha, Coding, Exposure, Format, Mips, Output, Packed, Picture, Tonemap};
use crate::method::{AirMethod, CumulusMethod, Method, Reference, Transport};
use crate::projection::{Side, SphereLayout, Viewer};
use crate::scene::Scene;
use crate::spectrum::Spectrum;

/// A query parameter.
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
    /// Takes a value in; `None` when it is not allowed.
    pub(super) read: fn(&mut Given, &str) -> Option<()>,
    /// The value that a request has; `None` where the parameter does not touch it.
    pub(super) write: fn(&Request) -> Option<String>,
}

impl QueryParameter {
    /// Whether a text is one of its values, of a format that has them all but for `depth`, which goes with the format.
    pub fn takes(&self, text: &str) -> bool {
        (self.read)(&mut Given::new(Format::Exr), text).is_some()
    }
}

/// Every query parameter.
pub const QUERY_PARAMETERS: &[QueryParameter] = &[
    QueryParameter {
        name: "time",
        values: "0 to 1e9",
        default: "0",
        meaning: "seconds since the scene's start",
        read: |given, text| set(&mut given.time_s, number(text, 0.0, Request::MAX_TIME_S)),
        write: |request| Some(request.time_s.to_string()),
    },
    QueryParameter {
        name: "size",
        values: "1 to 4096",
        default: "the scene's resolution",
        meaning: "texels a side",
        read: |given, text| {
            let size = text.parse().ok().filter(|size| (1..=Scene::MAX_SIDE).contains(size))?;
            set(&mut given.size, Some(Some(size)))
        },
        write: |request| Some(request.size?.to_string()),
    },
    QueryParameter {
        name: "view",
        values: "below | above",
        default: "below",
        meaning: "side from which the clouds are seen",
        read: |given, text| set(&mut given.side, word(text, &Side::ALL)),
        write: |request| Some(request.wanted.plane()?.side.name().to_owned()),
    },
    QueryParameter {
        name: "direction",
        values: "ZENITH,AZIMUTH (0 to 89.9, -360 to 360)",
        default: "0,0",
        meaning: "towards the viewer, degrees: a parallel view; for `below` the zenith angle is measured from straight down",
        read: |given, text| {
            let (zenith, azimuth) = text.split_once(',')?;
            let (zenith_deg, azimuth_deg) = (number(zenith, 0.0, 89.9)?, number(azimuth, -360.0, 360.0)?);
            // Straight up has no azimuth, and -90 and 270 are one direction.
            let azimuth_deg = if zenith_deg == 0.0 { 0.0 } else { one_turn(azimuth_deg) };
            set(&mut given.direction, Some(Some(Viewer::Parallel { zenith_deg, azimuth_deg })))
        },
        write: |request| match request.wanted.plane()?.viewer {
            Viewer::Parallel { zenith_deg, azimuth_deg } => Some(format!("{zenith_deg},{azimuth_deg}")),
            Viewer::At(_) => None,
        },
    },
    QueryParameter {
        name: "eye",
        values: "X,Y,Z (each -1e7 to 1e7; of `sky` Z 0 to 1e5)",
        default: "none; of `sky` 0,0,2",
        meaning: "viewer's place, metres: of `cloud` a perspective view of the plane",
        read: |given, text| {
            let parts: Option<Vec<f64>> = text.split(',').map(|part| number(part, -1e7, 1e7)).collect();
            set(&mut given.eye, Some(Some(parts?.try_into().ok()?)))
        },
        write: |request| {
            let place = match request.wanted.sphere() {
                Some(sphere) => sphere.eye,
                None => match request.wanted.plane()?.viewer {
                    Viewer::Parallel { .. } => return None,
                    Viewer::At(place) => place,
                },
            };
            let [x, y, z] = place;
            Some(format!("{x},{y},{z}"))
        },
    },
    QueryParameter {
        name: "projection",
        values: "equirect | octahedral | cube | fisheye | camera",
        default: "equirect",
        meaning: "how directions become texels of `sky` and `compass`: `size` is the height, of a cube's face its side",
        read: |given, text| set(&mut given.layout, SphereLayout::NAMES.into_iter().find(|name| *name == text)),
        write: |request| Some(request.wanted.sphere()?.layout.name().to_owned()),
    },
    QueryParameter {
        name: "axes",
        values: Axes::WORDS,
        default: "enu",
        meaning: "frame of an engine: how `sky` and `compass` lie in it as `equirect` and `cube`, and directions in their EXR, in `sun.json` and `ambient.json`",
        read: |given, text| set(&mut given.axes, Axes::named(text)),
        write: |request| Some(request.wanted.sphere()?.axes.name().to_owned()),
    },
    QueryParameter {
        name: "look",
        values: "AZIMUTH,ELEVATION (-360 to 360, -90 to 90)",
        default: "0,0",
        meaning: "middle of a `camera`'s picture, degrees",
        read: |given, text| {
            let (azimuth, elevation) = text.split_once(',')?;
            let look = [one_turn(number(azimuth, -360.0, 360.0)?), number(elevation, -90.0, 90.0)?];
            set(&mut given.look_deg, Some(look))
        },
        write: |request| match request.wanted.sphere()?.layout {
            SphereLayout::Camera { look_deg: [0.0, 0.0], .. } => None,
            SphereLayout::Camera { look_deg: [azimuth, elevation], .. } => Some(format!("{azimuth},{elevation}")),
            _ => None,
        },
    },
    QueryParameter {
        name: "fov",
        values: "1 to 170 (camera), 1 to 360 (fisheye)",
        default: "60 (camera), 180 (fisheye)",
        meaning: "field of view, degrees: of a `camera` from the lower edge to the upper one, of a `fisheye` across the disc",
        read: |given, text| set(&mut given.fov_deg, Some(Some(number(text, 1.0, 360.0)?))),
        write: |request| match request.wanted.sphere()?.layout {
            SphereLayout::Camera { fov_deg: CAMERA_FOV_DEG, .. } => None,
            SphereLayout::Fisheye { fov_deg: FISHEYE_FOV_DEG } => None,
            SphereLayout::Camera { fov_deg, .. } | SphereLayout::Fisheye { fov_deg } => Some(fov_deg.to_string()),
            _ => None,
        },
    },
    QueryParameter {
        name: "aspect",
        values: "0.1 to 10",
        default: "1",
        meaning: "width over height of a `camera`'s picture",
        read: |given, text| set(&mut given.aspect, number(text, 0.1, 10.0)),
        write: |request| match request.wanted.sphere()?.layout {
            SphereLayout::Camera { aspect, .. } if aspect != 1.0 => Some(aspect.to_string()),
            _ => None,
        },
    },
    QueryParameter {
        name: "disc",
        values: "true | false",
        default: "false",
        meaning: "the sun's disc is drawn into `sky`",
        read: |given, text| set(&mut given.disc, word(text, &[("true", true), ("false", false)])),
        write: |request| Some(request.wanted.disc()?.to_string()),
    },
    QueryParameter {
        name: "wavelength",
        values: "rgb | 300 to 1000",
        default: "rgb",
        meaning: "nm: `sky` or `irradiance` of this wavelength alone, one channel Y, per unit of the sun's spectral irradiance above the air",
        read: |given, text| {
            let (least, most) = Spectrum::RANGE_NM.into_inner();
            let wavelength = || number(text, least, most).map(Spectrum::Wavelength);
            set(&mut given.spectrum, if text == "rgb" { Some(Spectrum::Visible) } else { wavelength() })
        },
        write: |request| match request.wanted.spectrum()? {
            Spectrum::Visible => Some("rgb".to_owned()),
            Spectrum::Wavelength(nm) => Some(nm.to_string()),
        },
    },
    QueryParameter {
        name: "component",
        values: "total | direct | diffuse",
        default: "total",
        meaning: "part of the irradiance",
        read: |given, text| set(&mut given.component, Component::NAMES.into_iter().find(|name| *name == text)),
        write: |request| Some(request.wanted.component()?.name().to_owned()),
    },
    QueryParameter {
        name: "peak",
        values: "true | false",
        default: "true",
        meaning: "light scattered by less than 5 degrees counts as the sun's beam",
        read: |given, text| set(&mut given.peak, word(text, &[("true", true), ("false", false)])),
        // Written for all textures that a beam is part of, so that it differs from the default where it does.
        write: |request| Some(request.wanted.peak().unwrap_or(true).to_string()),
    },
    QueryParameter {
        name: "alpha",
        values: "premultiplied | straight",
        default: "premultiplied",
        meaning: "how colour goes with alpha; a PNG is always straight",
        read: |given, text| set(&mut given.alpha, word(text, &Alpha::ALL)),
        write: |request| Some(request.output.linear().alpha.name().to_owned()),
    },
    QueryParameter {
        name: "tolerance",
        values: "above 0 to 1",
        default: "0.02",
        meaning: "acceptable relative error, root mean square",
        read: |given, text| set(&mut given.tolerance, number(text, f64::MIN_POSITIVE, 1.0)),
        write: |request| Some(request.wanted.tolerance()?.to_string()),
    },
    QueryParameter {
        name: "method",
        values: Method::WORDS,
        default: "by tolerance",
        meaning: "how slab light is computed; reference (Monte Carlo) is for the command line",
        read: |given, text| set(&mut given.method, Some(Some(word(text, &Method::ALL)?))),
        write: |request| Some(request.wanted.method()?.name().to_owned()),
    },
    QueryParameter {
        name: "transport",
        values: Transport::WORDS,
        default: "by tolerance, field and view",
        meaning: "how sunlight is carried through uneven cloud",
        read: |given, text| set(&mut given.transport, Some(Some(word(text, &Transport::ALL)?))),
        write: |request| Some(request.wanted.transport()?.name().to_owned()),
    },
    QueryParameter {
        name: "cumulus",
        values: CumulusMethod::WORDS,
        default: "lattice",
        meaning: "how light in cumulus is computed",
        read: |given, text| set(&mut given.cumulus, word(text, &CumulusMethod::ALL)),
        write: |request| Some(request.wanted.cumulus()?.name().to_owned()),
    },
    QueryParameter {
        name: "air",
        values: AirMethod::WORDS,
        default: "moments",
        meaning: "how light that air scatters more than once is found, where the scene has air",
        read: |given, text| set(&mut given.air, word(text, &AirMethod::ALL)),
        write: |request| Some(request.wanted.air()?.name().to_owned()),
    },
    QueryParameter {
        name: "seed",
        values: "0 to 4294967295",
        default: "1",
        meaning: "random numbers of method reference: other seeds give other noise",
        read: |given, text| set(&mut given.seed, text.parse().ok()),
        write: |request| {
            Some(request.wanted.reference().map_or(Reference::SEED, |reference| reference.seed).to_string())
        },
    },
    QueryParameter {
        name: "orders",
        values: "0 to 8",
        default: "0",
        meaning: "method reference: orders of scattering apart, as layers order1, order2, ... and higher of an EXR",
        read: |given, text| {
            set(&mut given.orders, text.parse().ok().filter(|orders| *orders <= Reference::MOST_ORDERS))
        },
        write: |request| Some(request.wanted.reference().map_or(0, |reference| reference.orders).to_string()),
    },
    QueryParameter {
        name: "layer",
        values: "0 to 3",
        default: "all",
        meaning: "one layer alone, 0 = lowest; light still uses all",
        read: |given, text| {
            let layer = text.parse().ok().filter(|layer| (*layer as usize) < Scene::MAX_LAYERS)?;
            set(&mut given.layer, Some(Some(layer)))
        },
        write: |request| Some(request.wanted.layer()?.to_string()),
    },
    QueryParameter {
        name: "scale",
        values: "1e-6 to 1e6",
        default: "1",
        meaning: "multiplies linear output: all formats but a PNG or WebP for eyes",
        read: |given, text| set(&mut given.scale, number(text, 1e-6, 1e6)),
        write: |request| Some(request.output.linear().scale.to_string()),
    },
    QueryParameter {
        name: "exposure",
        values: "-20 to 20 | auto",
        default: "0",
        meaning: "exposure of a picture (PNG, WebP): stops from the scene's own light, or by what the picture shows",
        read: |given, text| {
            let stops = || Some(Exposure::Stops(number(text, -20.0, 20.0)?));
            set(&mut given.exposure, Some(Some(if text == "auto" { Exposure::Auto } else { stops()? })))
        },
        write: |request| match request.output.picture() {
            Some(Picture::Display { exposure: Exposure::Stops(stops), .. }) => Some(stops.to_string()),
            Some(Picture::Display { exposure: Exposure::Auto, .. }) => Some("auto".to_owned()),
            _ => None,
        },
    },
    QueryParameter {
        name: "ev100",
        values: "-20 to 40",
        default: "none",
        meaning: "a fixed camera instead of `exposure`, where light is in cd/m2: 1.2 x 2^ev100 cd/m2 are white before `tonemap`",
        read: |given, text| set(&mut given.ev100, Some(Some(number(text, -20.0, 40.0)?))),
        write: |request| match request.output.picture() {
            Some(Picture::Display { exposure: Exposure::Ev100(ev100), .. }) => Some(ev100.to_string()),
            _ => None,
        },
    },
    QueryParameter {
        name: "tonemap",
        values: "filmic | none",
        default: "filmic",
        meaning: "tone curve of a picture (PNG, WebP) of light",
        read: |given, text| set(&mut given.tonemap, word(text, &Tonemap::ALL)),
        write: |request| match request.output.picture() {
            Some(Picture::Display { tonemap, .. }) => Some(tonemap.name().to_owned()),
            _ => None,
        },
    },
    QueryParameter {
        name: "dither",
        values: "true | false",
        default: "false",
        meaning: "an 8-bit picture (PNG, WebP) for eyes is rounded up or down by a pattern of noise, so that even skies show no bands",
        read: |given, text| set(&mut given.dither, word(text, &[("true", true), ("false", false)])),
        write: |request| match request.output.picture() {
            Some(Picture::Display { dither, .. }) => Some(dither.to_string()),
            _ => None,
        },
    },
    QueryParameter {
        name: "encoding",
        values: "srgb | linear",
        default: "srgb",
        meaning: "transfer of a PNG or WebP: a picture for eyes, or a mask of the values as they are",
        read: |given, text| set(&mut given.mask, word(text, &[("srgb", false), ("linear", true)])),
        write: |request| Some(request.output.picture()?.encoding().to_owned()),
    },
    QueryParameter {
        name: "depth",
        values: "8 | 16 (PNG), 8 (WebP), 16 | 32 (EXR, KTX2, DDS), 16 (f16), 32 (f32)",
        default: "8 (PNG, WebP); 16 where half floats hold the values, else 32 (EXR); 16 (KTX2, DDS, f16); 32 (f32)",
        meaning: "bits a sample",
        read: |given, text| {
            let allowed: &[(&str, u32)] = match given.format {
                Format::Exr | Format::Ktx2 | Format::Dds => &[("16", 16), ("32", 32)],
                Format::Png => &[("8", 8), ("16", 16)],
                Format::Webp => &[("8", 8)],
                Format::F16 => &[("16", 16)],
                Format::F32 => &[("32", 32)],
                // Of shared exponents there is one kind.
                Format::Hdr => &[],
            };
            set(&mut given.depth, Some(Some(word(text, allowed)?)))
        },
        write: |request| match request.output {
            Output::Exr { depth, .. } => depth.map(|depth| depth.bits().to_string()),
            Output::Png(picture) => Some(picture.depth().bits().to_string()),
            Output::Packed(Packed { coding: Coding::Float(depth), .. }) => Some(depth.bits().to_string()),
            Output::Packed(_) | Output::Webp(_) | Output::Hdr { .. } | Output::F16 { .. } | Output::F32 { .. } => None,
        },
    },
    QueryParameter {
        name: "coding",
        values: "float | rgb9e5 | bc6h | bc4",
        default: "float",
        meaning: "how KTX2 and DDS pack texels: floats of `depth` bits, three 9-bit mantissas and a shared exponent in 32 bits, or blocks of 4 x 4 texels, 8 or 4 bits each",
        read: |given, text| set(&mut given.coding, word(text, &Coding::WORDS)),
        write: |request| match request.output {
            Output::Packed(Packed { coding, .. }) => Some(coding.name().to_owned()),
            _ => None,
        },
    },
    QueryParameter {
        name: "mips",
        values: "true | false | specular",
        default: "false",
        meaning: "KTX2 and DDS have all mip levels, to one texel: means of light, or, of `projection=cube`, the sky in [ever rougher mirrors](#containers-for-devices)",
        read: |given, text| set(&mut given.mips, word(text, &Mips::ALL)),
        write: |request| match request.output {
            Output::Packed(Packed { mips, .. }) => {
                Mips::ALL.iter().find(|(_, same)| *same == mips).map(|(word, _)| (*word).to_owned())
            }
            _ => None,
        },
    },
];

/// An azimuth from -360 to 360 degrees as 0 to below 360.
fn one_turn(azimuth_deg: f64) -> f64 {
    let positive = if azimuth_deg < 0.0 { azimuth_deg + 360.0 } else { azimuth_deg };
    if positive >= 360.0 { positive - 360.0 } else { positive }
}

/// Puts a value in its place, if it is one.
fn set<T>(place: &mut T, value: Option<T>) -> Option<()> {
    *place = value?;
    Some(())
}

/// A finite number between two ends, both included.
fn number(text: &str, least: f64, most: f64) -> Option<f64> {
    text.parse::<f64>().ok().filter(|number| (least..=most).contains(number)).map(|number| number + 0.0)
}

fn word<T: Copy>(text: &str, words: &[(&str, T)]) -> Option<T> {
    words.iter().find(|(word, _)| *word == text).map(|(_, value)| *value)
}
