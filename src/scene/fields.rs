//! The fields of a scene as a table: what `docs/scene.md` says about each. Ranges are those of the types that hold them,
//! defaults those that the parser fills in.

use super::model::Scene;
use super::parse::{LAYER_KINDS, THICKNESS_KINDS};
use super::quantity::*;
use super::shape::{FLAT, PROFILES};
use super::synthetic::{DepthLaw, Pattern};
use serde_json::Value;
use std::fmt::Write as _;
use std::ops::RangeInclusive;

/// Fields that stand together.
#[derive(Debug)]
pub struct Group {
    /// What they belong to.
    pub title: &'static str,
    /// Where they are in a scene, as a JSON pointer.
    pub place: &'static str,
    /// The least scene that has them, as JSON: what it gives is needed, all else has a default.
    pub least: &'static str,
    /// The fields.
    pub fields: &'static [Field],
}

/// A field of a scene.
#[derive(Debug)]
pub struct Field {
    /// JSON pointer from the group's place.
    pub pointer: &'static str,
    /// Its values.
    pub allowed: Allowed,
    /// What it does; Markdown.
    pub meaning: &'static str,
}

/// Values of a field.
#[derive(Debug, Clone, PartialEq)]
pub enum Allowed {
    /// A number: its range, its unit.
    Number(RangeInclusive<f64>, &'static str),
    /// Three numbers, red, green, blue, or one for all.
    Colour(RangeInclusive<f64>),
    /// A whole number.
    Whole(RangeInclusive<u32>),
    /// One of some words.
    Words(&'static [&'static str]),
    /// Something else, in words.
    Other(&'static str),
}

const fn number<Q: Quantity>(pointer: &'static str, meaning: &'static str) -> Field {
    Field { pointer, allowed: Allowed::Number(Q::RANGE, Q::UNIT), meaning }
}

const fn colour<Q: Quantity>(pointer: &'static str, meaning: &'static str) -> Field {
    Field { pointer, allowed: Allowed::Colour(Q::RANGE), meaning }
}

const fn field(pointer: &'static str, allowed: Allowed, meaning: &'static str) -> Field {
    Field { pointer, allowed, meaning }
}

/// All fields.
pub const GROUPS: &[Group] = &[
    Group {
        title: "The scene",
        place: "",
        least: "{}",
        fields: &[
            number::<ExtentM>("/domain/extent_m", "side of the tile"),
            field(
                "/domain/resolution",
                Allowed::Whole(1..=Scene::MAX_SIDE),
                "texels a side of a synthetic field, and of a texture that asks for no `size`",
            ),
            number::<ZenithDeg>("/sun/zenith_deg", "from 90 on the sun gives no light"),
            number::<AzimuthDeg>("/sun/azimuth_deg", "clockwise from north; kept as 0 to below 360"),
            number::<AngularDiameterDeg>(
                "/sun/angular_diameter_deg",
                "across the sun's disc: blurs the edges of shadows; 0 is parallel light; 0.533, the sun's own, is the default in air",
            ),
            colour::<SunIrradiance>(
                "/atmosphere/sun",
                "irradiance of the sun on a plane facing it, above the clouds: klx, or your own unit; then give `sky` too",
            ),
            colour::<SkyRadiance>(
                "/atmosphere/sky",
                "radiance of the uniform sky: kcd/m², or your own unit; then give `sun` too",
            ),
            colour::<Albedo>(
                "/ground/albedo",
                "or `{\"image\": sha256, \"linear\": false}`: a map stretched over the domain, north up; a PNG is \
                 sRGB-decoded unless `linear` is true",
            ),
            field("/layers", Allowed::Other("0 to 4 layers"), "bottom to top: each base must be above the one before"),
        ],
    },
    Group {
        title: "`sun` over a place",
        place: "/sun",
        least: r#"{"sun": {"latitude_deg": 48, "longitude_deg": 11, "utc": "2026-06-21T10:00:00Z"}}"#,
        fields: &[
            number::<LatitudeDeg>("/latitude_deg", "north positive"),
            number::<LongitudeDeg>("/longitude_deg", "east positive"),
            number::<AltitudeM>("/altitude_m", "above the sea; moves the sun by less than 0.003 degrees"),
            field(
                "/utc",
                Allowed::Other("1600 to 2399, as RFC 3339 writes it"),
                "when `time` is 0; other offsets than `Z` are taken, and kept as UTC",
            ),
        ],
    },
    Group {
        title: "`atmosphere` of air",
        place: "/atmosphere",
        least: r#"{"atmosphere": {}}"#,
        fields: &[
            number::<AerosolDepth>("/aerosol/optical_depth", "of particles, vertical, at 550 nm"),
            number::<Angstrom>("/aerosol/angstrom", "the depth goes with wavelength to the power of minus this"),
            number::<AerosolAsymmetry>(
                "/aerosol/asymmetry",
                "mean cosine of the scattering angle, of Henyey and Greenstein's phase function",
            ),
            number::<Albedo>("/aerosol/albedo", "single-scattering albedo, the same at all wavelengths"),
            number::<AerosolScaleM>("/aerosol/scale_height_m", "height over which it thins to 1/e"),
            number::<OzoneDu>("/ozone_du", "column of ozone"),
            number::<RayleighColumn>("/rayleigh", "column of molecules, relative to the standard one at sea level"),
            field(
                "/polarisation",
                Allowed::Other("`true`, `false`"),
                "follow the polarisation of light scattered by molecules; without it blue light is up to 8 % off",
            ),
        ],
    },
    Group {
        title: "`aerosol` of a tabulated phase function, the same at all wavelengths",
        place: "/atmosphere/aerosol",
        least: r#"{"atmosphere": {"aerosol": {"phase_function": [[0, 10], [90, 1], [180, 2]]}}}"#,
        fields: &[field(
            "/phase_function",
            Allowed::Other("pairs `[degrees, value]`"),
            "in place of `asymmetry`; see below",
        )],
    },
    Group {
        title: "`aerosol` of spheres by Mie theory",
        place: "/atmosphere/aerosol",
        least: r#"{"atmosphere": {"aerosol": {"effective_radius_um": 0.3}}}"#,
        fields: &[
            number::<ParticleRadiusUm>("/effective_radius_um", "in place of `asymmetry`; r_e = (broadness+2) r_n"),
            number::<Broadness>("/broadness", "N(r) ~ r^(broadness-1) exp(-r/r_n)"),
            field(
                "/refractive_index",
                Allowed::Other("[1.01 to 2, 0 to 1], or the real part alone"),
                "`[real, imaginary]` at all wavelengths; the imaginary part absorbs, and is 0 where one number is given",
            ),
            number::<Angstrom>("/angstrom", "in place of the extinction's change with wavelength by Mie theory"),
            number::<Albedo>("/albedo", "in place of that by Mie theory"),
        ],
    },
    Group {
        title: "A layer",
        place: "/layers/0",
        least: r#"{"layers": [{"thickness": {"kind": "uniform", "metres": 100}}]}"#,
        fields: &[
            field(
                "/kind",
                Allowed::Words(&LAYER_KINDS),
                "of a `thickness`, heaps (one layer at most), or a thin sheet by its optical depth: each has a table of its own below",
            ),
            number::<BaseM>(
                "/base_m",
                "height of the flat base, above that of the layer before; with 0 in the lowest, `irradiance` is the flux \
                 through the base; a flat top and maps come below",
            ),
            field(
                "/thickness/kind",
                Allowed::Words(&THICKNESS_KINDS),
                "of `stratiform`; each with fields of its own, below; not with two edges, or with `optical_depth`",
            ),
            number::<SpeedMS>("/wind/speed_m_s", "mean wind"),
            number::<AzimuthDeg>("/wind/from_deg", "where it comes from, clockwise from north; kept as 0 to below 360"),
            number::<TurbulenceMS>(
                "/wind/turbulence_m_s",
                "root mean square speed of the eddies that move a field's parts against each other (a `stratocumulus` or \
                 an `image`; a uniform layer has nothing to move, cumulus grow and vanish by themselves, and the reply's `notes` \
                 say so)",
            ),
        ],
    },
    Group {
        title: "A layer with a flat top",
        place: "/layers/0",
        least: r#"{"layers": [{"flat": "top", "top_m": 1400, "thickness": {"kind": "uniform", "metres": 0}}]}"#,
        fields: &[
            field("/flat", Allowed::Words(&FLAT), "which edge is flat; `base` where it is left out"),
            number::<TopM>(
                "/top_m",
                "height of the flat top, in place of `base_m`: cloud hangs down from it by its thickness, or to a map `base`",
            ),
        ],
    },
    Group {
        title: "`base` and `top` as maps",
        place: "/layers/0/top",
        least: r#"{"layers": [{
            "top": {"scale_m": 1, "image": "0000000000000000000000000000000000000000000000000000000000000000"},
            "optical_depth": {"image": "0000000000000000000000000000000000000000000000000000000000000000"}}]}"#,
        fields: &[
            field("/image", Allowed::Other("sha256"), "as its upload answered; a path on the command line"),
            number::<ThicknessM>("/scale_m", "metres for a sample of 1"),
            number::<OffsetM>("/offset_m", "height above the ground of a sample of 0"),
            field("/fill", Allowed::Other("a number"), "the sample that stands for \"no cloud\", before it is scaled"),
        ],
    },
    Group {
        title: "`optical_depth`",
        place: "/layers/0/optical_depth",
        least: r#"{"layers": [{"optical_depth":
            {"image": "0000000000000000000000000000000000000000000000000000000000000000"}}]}"#,
        fields: &[
            field("/image", Allowed::Other("sha256"), "as its upload answered; a path on the command line"),
            number::<DepthScale>("/scale", "optical depth at 550 nm for a sample of 1; 0 to 1000 in all"),
            field("/fill", Allowed::Other("a number"), "the sample that stands for \"no cloud\", before it is scaled"),
        ],
    },
    Group {
        title: "`effective_radius`",
        place: "/layers/0/effective_radius",
        least: r#"{"layers": [{
            "optical_depth": {"image": "0000000000000000000000000000000000000000000000000000000000000000"},
            "effective_radius": {"image": "0000000000000000000000000000000000000000000000000000000000000000"}}]}"#,
        fields: &[
            field("/image", Allowed::Other("sha256"), "as its upload answered; a path on the command line"),
            number::<RadiusScaleUm>("/scale_um", "micrometres for a sample of 1; 0.5 to 50 µm in all"),
            field("/fill", Allowed::Other("a number"), "the sample that stands for \"no cloud\", before it is scaled"),
        ],
    },
    Group {
        title: "`profile`",
        place: "/layers/0",
        least: r#"{"layers": [{"profile": "uniform", "thickness": {"kind": "uniform", "metres": 0}}]}"#,
        fields: &[field(
            "/profile",
            Allowed::Words(&PROFILES),
            "how a column's extinction changes from its base to its top; `uniform` where it is left out",
        )],
    },
    Group {
        title: "A layer of kind `cumulus`",
        place: "/layers/0",
        least: r#"{"layers": [{"kind": "cumulus"}]}"#,
        fields: &[
            number::<CumulusCoverage>("/coverage", "part of the ground below cloud, in the mean over time"),
            field(
                "/width_m",
                Allowed::Other("[least, greatest], each 50 to 20000 m"),
                "widths of full-grown clouds; none is wider than a third of the domain",
            ),
            field("/seed", Allowed::Whole(0..=u32::MAX), "picks one field of many alike"),
            field(
                "/spheres",
                Allowed::Other("1 to 100000 of `[x, y, z, radius_m]`"),
                "in place of the three above: the cloud itself, see below",
            ),
            field(
                "/levels",
                Allowed::Other("0 to 3"),
                "with `spheres`: levels of smaller spheres that sit on them; 0 is the spheres alone",
            ),
            number::<EdgeM>(
                "/edge_m",
                "depth over which the density rises from 0 at the surface to that of the droplets; 0 is sharp",
            ),
        ],
    },
    Group {
        title: "A layer of kind `sheet`",
        place: "/layers/0",
        least: r#"{"layers": [{"kind": "sheet", "optical_depth": 0.4}]}"#,
        fields: &[
            field(
                "/optical_depth",
                Allowed::Other("0 to 1000, or a map as in the table before"),
                "at 550 nm, of all of the sheet or of its columns",
            ),
            number::<BaseM>("/base_m", "height of its flat base"),
            number::<ExtinctionPerM>(
                "/droplets/extinction_per_m",
                "of droplets of any kind, the same in all channels: the sheet is as thick as makes its optical depth",
            ),
        ],
    },
    Group {
        title: "`thickness` of kind `uniform`",
        place: "/layers/0/thickness",
        least: r#"{"layers": [{"thickness": {"kind": "uniform", "metres": 100}}]}"#,
        fields: &[number::<ThicknessM>("/metres", "the same everywhere")],
    },
    Group {
        title: "`thickness` of kind `image`",
        place: "/layers/0/thickness",
        least: r#"{"layers": [{"thickness": {"kind": "image", "scale_m": 500,
            "image": "0000000000000000000000000000000000000000000000000000000000000000"}}]}"#,
        fields: &[
            field("/image", Allowed::Other("sha256"), "as its upload answered; a path on the command line"),
            number::<ThicknessM>(
                "/scale_m",
                "metres for a sample of 1: red channel (0 to 1, or as it is in a float file) times `scale_m`, bilinear, \
                 periodic",
            ),
            field("/fill", Allowed::Other("a number"), "the sample that stands for \"no cloud\", before it is scaled"),
        ],
    },
    Group {
        title: "`thickness` of kind `stratocumulus`",
        place: "/layers/0/thickness",
        least: r#"{"layers": [{"thickness": {"kind": "stratocumulus"}}]}"#,
        fields: &[
            field(
                "/pattern",
                Allowed::Words(&Pattern::WORDS),
                "structure; `streets` and `cirrus` with `law`: `gamma` alone",
            ),
            number::<MeanThicknessM>("/mean_m", "mean thickness of the cloudy part"),
            number::<Coverage>(
                "/coverage",
                "part of the domain with more than 1 m of cloud (a tenth of `mean_m` where that is less); a gap is exactly 0",
            ),
            number::<CellM>(
                "/cell_m",
                "size of a convective cell. The domain holds whole cells: between two such sizes one pattern fades into \
                 the other. Of `streets`: distance of the rows; of `cirrus`: width of the heads that trails fall from",
            ),
            field("/seed", Allowed::Whole(0..=u32::MAX), "picks one field of many alike"),
        ],
    },
    Group {
        title: "A `stratocumulus` whose edges thin out",
        place: "/layers/0/thickness",
        least: r#"{"layers": [{"thickness": {"kind": "stratocumulus", "law": "gamma"}}]}"#,
        fields: &[
            field(
                "/law",
                Allowed::Words(&DepthLaw::WORDS),
                "how optical depth is distributed among cloudy columns; `lognormal` where it is left out: see below",
            ),
            number::<DepthSpread>(
                "/spread",
                "standard deviation of their optical depth relative to its mean: about 0.3 in overcast, 0.75 in the mean of \
                 measurements, 1 in broken cloud",
            ),
            number::<CellM>(
                "/cell_m",
                "size of a cell of `closed` and `open`: the least that satellites see; of `streets` 2500, the distance of the rows; \
                 of `cirrus` 1500, the width of a head",
            ),
        ],
    },
    Group {
        title: "`droplets` of water",
        place: "/layers/0/droplets",
        least: r#"{"layers": [{"thickness": {"kind": "uniform", "metres": 100}}]}"#,
        fields: &[
            number::<EffectiveRadiusUm>("/effective_radius_um", "r_e = (broadness+2) r_n"),
            number::<Broadness>("/broadness", "N(r) ~ r^(broadness-1) exp(-r/r_n)"),
            number::<NumberPerCm3>("/number_per_cm3", "droplets; without effect beside `extinction_per_m`"),
            number::<ExtinctionPerM>("/extinction_per_m", "the same in all channels, in place of that by Mie theory"),
            colour::<RefractiveIndex>("/refractive_index", "in place of the real parts of water's own"),
        ],
    },
    Group {
        title: "`droplets` of Henyey and Greenstein's phase function, the same in all channels",
        place: "/layers/0/droplets",
        least: r#"{"layers": [{"thickness": {"kind": "uniform", "metres": 100},
            "droplets": {"henyey_greenstein": 0.85, "extinction_per_m": 0.04}}]}"#,
        fields: &[
            number::<Asymmetry>("/henyey_greenstein", "mean cosine of the scattering angle"),
            number::<ExtinctionPerM>("/extinction_per_m", "extinction"),
            number::<Albedo>("/albedo", "single-scattering albedo"),
        ],
    },
    Group {
        title: "`droplets` of a tabulated phase function (ice, dust), the same in all channels",
        place: "/layers/0/droplets",
        least: r#"{"layers": [{"thickness": {"kind": "uniform", "metres": 100},
            "droplets": {"phase_function": [[0, 10], [90, 1], [180, 2]], "extinction_per_m": 0.04}}]}"#,
        fields: &[
            field("/phase_function", Allowed::Other("pairs `[degrees, value]`"), "see below"),
            number::<ExtinctionPerM>("/extinction_per_m", "extinction"),
            number::<Albedo>("/albedo", "single-scattering albedo"),
        ],
    },
];

impl Group {
    /// The group as a table in Markdown.
    pub fn markdown(&self) -> String {
        let full = Scene::from_json(self.least.as_bytes()).map_or(Value::Null, |scene| scene.to_json());
        let least: Value = serde_json::from_str(self.least).unwrap_or_default();
        let mut text = "| field | range | default | meaning |\n|---|---|---|---|\n".to_owned();
        for Field { pointer, allowed, meaning } in self.fields {
            let at = format!("{}{pointer}", self.place);
            let default = match (least.pointer(&at), full.pointer(&at)) {
                (Some(_), _) => "needed".to_owned(),
                (None, Some(value)) => in_words(value),
                (None, None) => "none".to_owned(),
            };
            let name = pointer.trim_start_matches('/').replace('/', ".");
            // Writing to a String cannot fail.
            let _ = writeln!(text, "| `{name}` | {} | {default} | {meaning} |", allowed.in_words());
        }
        text
    }
}

impl Allowed {
    fn in_words(&self) -> String {
        let range = |range: &RangeInclusive<f64>| format!("{} to {}", short(*range.start()), short(*range.end()));
        match self {
            Self::Number(allowed, "") => range(allowed),
            Self::Number(allowed, unit) => format!("{} {unit}", range(allowed)),
            Self::Colour(allowed) => format!("{}, or [r, g, b]", range(allowed)),
            Self::Whole(allowed) => format!("{} to {}", allowed.start(), allowed.end()),
            Self::Words(words) => words.iter().map(|word| format!("`{word}`")).collect::<Vec<_>>().join(", "),
            Self::Other(words) => (*words).to_owned(),
        }
    }
}

/// A number, powers of ten from a million on as such.
fn short(number: f64) -> String {
    let power = number.abs().log10();
    if power >= 6.0 && power.fract() == 0.0 { format!("10^{power}") } else { number.to_string() }
}

fn in_words(value: &Value) -> String {
    match value {
        Value::Number(number) => number.as_f64().map_or_else(String::new, short),
        Value::String(word) => format!("`{word}`"),
        Value::Bool(value) => format!("`{value}`"),
        Value::Array(list) if list.is_empty() => "none".to_owned(),
        Value::Array(list) if list.iter().all(|item| Some(item) == list.first()) => {
            list.first().map_or_else(String::new, in_words)
        }
        Value::Array(list) => format!("[{}]", list.iter().map(in_words).collect::<Vec<_>>().join(", ")),
        other => other.to_string(),
    }
}
