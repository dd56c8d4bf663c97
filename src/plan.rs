//! How much to do about a request: method, table size, march and exchange, from the tolerance and the scene.
//!
//! Every choice names the error that is expected of it: relative, root mean square, as measured by `skyloom chart`
//! (docs/charts/slab.csv) and the tests. Each stage takes its cheapest choice whose own error stays below the tolerance,
//! or its finest where none does; [`expected_error`] tells what they come to together.

mod transport;

use crate::field;
use crate::method::{AirMethod, CumulusMethod, Reference, SlabMethod, Transport};
use crate::projection::Side;
use crate::request::Request;
use crate::scene::quantity::Quantity as _;
use crate::scene::{Atmosphere, GroundAlbedo, Layer, Scene};
use crate::spectrum::Spectrum;
use crate::tables::Detail;
use transport::Looked;

/// Part of the tolerance that the exchange between cloud and ground may leave.
const EXCHANGE_SHARE: f64 = 0.05;
/// Tolerance from which the maps of sunlight have one texel per transport length. Twice as many cost twice the stage; against
/// Monte Carlo in three dimensions they change light on the ground by 1 % of its error, and that seen of broken cloud
/// from above by 10 % of its error.
const COARSE_MAPS: f64 = 0.02;
/// Tolerance from which the exchange grid may be half as fine.
const COARSE_GRID: f64 = 0.1;

/// Texels a side of a synthetic field per texel of the texture, at most: what lies between could not be shown.
const FIELD_TEXELS_PER_TEXEL: u32 = 2;
/// Texels a side of a synthetic field, at least, unless the scene has fewer: below this, coverage and mean would be those of
/// a handful of texels.
const LEAST_FIELD_TEXELS: u32 = 128;

/// Tolerance from which a field may lack what is too fine to be shown. A texel is a point of the sky: without the finest
/// waves it is another point's value, by up to a few percent.
const COARSE_FIELD: f64 = 0.1;

/// Texels a side of a synthetic field, at most, that a texture has made finer than the scene: memory and time grow with their
/// number, not with that of the texture alone.
const FINEST_FIELD: u32 = 2048;

/// Texels a side of the scene's synthetic fields for a request: those of the scene, or of a larger texture of the ground where
/// columns thin out; but where the tolerance allows it no finer than the texture can show.
pub fn field_resolution(scene: &Scene, request: &Request) -> u32 {
    let thins_out = scene.layers.iter().any(|layer| layer.shape.thins_out());
    let asked = request.size.filter(|_| thins_out && request.wanted.projection().is_none());
    let finest = scene.resolution().max(asked.unwrap_or(0).min(FINEST_FIELD));
    // The thickness itself is exact.
    if request.wanted.tolerance().is_none_or(|tolerance| tolerance < COARSE_FIELD) {
        return finest;
    }
    let shown = request.size.map_or(Scene::MAX_SIDE, |size| FIELD_TEXELS_PER_TEXEL * size);
    finest.min(shown.max(LEAST_FIELD_TEXELS))
}

/// A method of slab light in words.
fn in_words(slab: SlabMethod) -> String {
    let name = slab.asked_as().name();
    slab.detail().map_or_else(
        || name.to_owned(),
        |detail| {
            let size = detail.size();
            let nodes = format!("{} x {} x {}", size.depths(), size.zeniths, size.azimuths);
            format!("{name}, {} ({nodes})", detail.name())
        },
    )
}

/// How a stratiform layer's thickness is made, and why so.
fn field_in_words(layer: &Layer, scene: &Scene, request: &Request) -> (String, &'static str) {
    let words = || field::octaves_in_words(&layer.shape, field_resolution(scene, request));
    match (layer.shape.is_even(), field::moves(&layer.shape, &layer.wind)) {
        (true, _) => ("one texel".to_owned(), "the thickness is the same everywhere"),
        (_, true) => (
            format!("map displaced by eddies, {}", words()),
            "turbulence; at most a life of 64 steps, from a checkpoint fewer",
        ),
        (_, false) => (format!("map moved by the mean wind, {}", words()), "no turbulence: made once, for all times"),
    }
}

/// The side from which clouds are seen, of the texture that shows them and nothing else.
fn seen_from(request: &Request) -> Option<Side> {
    request.wanted.plane().map(|plane| plane.side)
}

/// Optical depth of stratiform cloud that is the same everywhere, and the side from which it is seen, where that is one.
fn sheet(scene: &Scene, request: &Request) -> Option<(f64, Side)> {
    let depth = scene.sheet_depth()?;
    seen_from(request).map(|side| (depth, side))
}

fn duration_in_words(seconds: f64) -> String {
    match seconds {
        seconds if seconds < 90.0 => format!("{:.0} s", seconds.max(1.0)),
        seconds if seconds < 5400.0 => format!("{:.0} min", seconds / 60.0),
        seconds => format!("{:.0} h", seconds / 3600.0),
    }
}

/// How finely the clouds of a sky are looked at where many of them are one texel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkyDetail {
    /// Rays of a texel, at most.
    pub rays: u32,
    /// Texels of a map along the ground for each of them.
    pub texels_per_ray: f64,
    /// Mip levels of the map beyond that whose texels are as wide as the picture's.
    pub coarseness: f64,
    /// Samples of the map for each of its texels that a ray crosses.
    pub steps: f64,
    /// Relative error of a texel's light where broken clouds are many, 3 to 10 degrees from the horizontal, root mean square: the largest
    /// of the chart `sky-view`, that of an eye above them.
    pub error: f64,
}

/// How a sky is looked at, from so large a tolerance on (docs/charts/README.md, sky-view). The first saves a quarter, the finest costs two
/// thirds more; what they err differs near the horizon, where many clouds are one texel.
pub(crate) const SKY_DETAIL: [(SkyDetail, f64); 2] = [
    (SkyDetail { rays: 4, texels_per_ray: 8.0, coarseness: 1.0, steps: 0.5, error: 0.25 }, 0.1),
    (SkyDetail { rays: 4, texels_per_ray: 8.0, coarseness: 0.0, steps: 1.0, error: 0.11 }, 0.01),
];
/// The finest look.
pub(crate) const FINEST_SKY: SkyDetail =
    SkyDetail { rays: 8, texels_per_ray: 4.0, coarseness: 0.0, steps: 2.0, error: 0.10 };

/// Seconds of a core for a texel that is traced, times the square of the tolerance: of clear air, and of clouds of an optical
/// depth of 30 seen through all of them, which takes this long at least.
const AIR_TEXEL_S: f64 = 4e-5;
const CLOUD_TEXEL_S: f64 = 1.6e-3;
/// The same of clouds in air around a round Earth: 0.36 s at a tolerance of 0.2 was found on broken stratocumulus by day, with a margin.
/// Under low suns it is several times as much.
const GLOBE_TEXEL_S: f64 = 2e-2;
const LEAST_TEXEL_S: f64 = 0.1;

/// What a request will use.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plan {
    /// Relative error that is acceptable; the default where the texture is exact.
    pub tolerance: f64,
    /// How slab light is computed, if the texture shows any that is not traced.
    pub slab: Option<SlabMethod>,
    /// Monte Carlo, where it is asked for.
    pub reference: Option<Reference>,
    /// How sunlight is carried through uneven cloud.
    pub transport: Transport,
    /// How light in cumulus is computed.
    pub cumulus: CumulusMethod,
    /// How light that air scatters more than once is found.
    pub air: AirMethod,
    /// Texels of the maps of sunlight per transport length of the cloud: light is spread by about as much.
    pub texels_per_length: f64,
    /// Grid texels per height of the cloud base.
    pub texels_per_height: f64,
    /// Relative change at which the exchange between cloud and ground is taken as settled.
    pub exchange_change: f64,
    /// Rays and levels of a sky.
    pub sky: SkyDetail,
    /// What light is made of.
    pub spectrum: Spectrum,
}

/// The error expected of a whole plan: its stages err independently.
pub fn expected_error(choices: &[Choice]) -> f64 {
    choices.iter().map(|choice| choice.error * choice.error).sum::<f64>().sqrt()
}

/// Whether the error expected of a whole plan is within its tolerance.
pub fn meets_tolerance(choices: &[Choice], plan: &Plan) -> bool {
    expected_error(choices) <= plan.tolerance
}

/// One stage of a plan, in words.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// The stage.
    pub stage: &'static str,
    /// What it will do.
    pub choice: String,
    /// Why.
    pub reason: String,
    /// Relative error expected of it, root mean square; 0 where it is exact.
    pub error: f64,
}

impl Plan {
    /// Plans a request. The tolerance alone decides, so that equal requests are equal on every machine.
    pub fn new(request: &Request, scene: &Scene) -> Self {
        let tolerance = request.wanted.tolerance().unwrap_or(Request::TOLERANCE);
        let (reference, asked) = (request.wanted.reference(), request.wanted.transport());
        let shaded = request.texture().needs().slab && reference.is_none();
        Self {
            tolerance,
            slab: shaded.then(|| SlabMethod::within(tolerance, request.wanted.method(), sheet(scene, request))),
            reference,
            transport: asked.unwrap_or_else(|| transport::planned(tolerance, scene, Looked::of(request))),
            // Octaves err three times as much and save an eighth of a pixel: docs/charts/cumulus.csv.
            cumulus: request.wanted.cumulus().unwrap_or(CumulusMethod::Lattice),
            air: request.wanted.air().unwrap_or(AirMethod::Moments),
            texels_per_length: if tolerance >= COARSE_MAPS { 1.0 } else { 2.0 },
            texels_per_height: if tolerance >= COARSE_GRID { 2.0 } else { 4.0 },
            exchange_change: EXCHANGE_SHARE * tolerance,
            sky: SKY_DETAIL.iter().find(|(_, least)| tolerance >= *least).map_or(FINEST_SKY, |(detail, _)| *detail),
            spectrum: request.wanted.spectrum().unwrap_or(Spectrum::Visible),
        }
    }

    /// Size of the radiance tables, if any are used.
    pub fn detail(&self) -> Option<Detail> {
        self.slab?.detail()
    }

    /// Layers whose light is solved in three dimensions for a new sun or field, which takes some tenths of a second each.
    pub fn lattices(&self, scene: &Scene, request: &Request) -> usize {
        let solved =
            self.transport == Transport::Lattice && self.reference.is_none() && request.texture().needs().light;
        scene.layers.iter().filter(|layer| solved && !layer.shape.is_even()).count()
    }

    /// The plan in words, stage by stage, for a scene.
    pub fn explain(&self, scene: &Scene, request: &Request) -> Vec<Choice> {
        if self.reference.is_some() {
            return self.explain_traced(scene, request);
        }
        let mut choices = Vec::new();
        let mut add =
            |stage, choice: String, reason: String, error| choices.push(Choice { stage, choice, reason, error });
        if !request.texture().shows_the_scene() {
            add("draw", "marks and a grid of degrees".to_owned(), "a test picture of directions".to_owned(), 0.0);
            return choices;
        }
        if self.air != AirMethod::Moments {
            let choice = format!("{}: {}", self.air.name(), self.air.about());
            add("air", choice, "asked for".to_owned(), self.air.error());
        }
        if scene.layer_count() == 0 && request.wanted.sphere().is_some() {
            add("sky", "the ground and the sky".to_owned(), "there are no clouds".to_owned(), 0.0);
            return choices;
        }
        if scene.layer_count() == 0 {
            add("shade", "constant".to_owned(), "without clouds every texel is the same".to_owned(), 0.0);
            return choices;
        }
        if scene.cumulus.is_some() {
            let method = self.cumulus;
            let choice = format!("{}: {}", method.name(), method.about());
            let reason = match request.wanted.cumulus() {
                Some(CumulusMethod::Lattice) | None => {
                    "in three dimensions: none is more exact, and the next one saves little"
                }
                Some(_) => "asked for",
            };
            add("cumulus", choice, reason.to_owned(), method.error());
        }
        if scene.layers.is_empty() {
            return choices;
        }
        let uniform = scene.layers.iter().all(|layer| layer.shape.is_even());
        for layer in &scene.layers {
            let (choice, reason) = field_in_words(layer, scene, request);
            add("field", choice, reason.to_owned(), 0.0);
        }
        let needs = request.texture().needs();
        let (march, error) = match uniform {
            true => ("closed form", 0.0),
            // Exact but for rounding.
            false => ("cut at every texel: exact up to 1024 cuts", 0.001),
        };
        add("march", march.to_owned(), "optical depth along sun and view rays".to_owned(), error);
        if needs.light {
            let dark =
                matches!(&scene.ground.albedo, GroundAlbedo::Uniform(albedo) if albedo.iter().all(|a| a.get() == 0.0));
            let even = uniform && matches!(scene.ground.albedo, GroundAlbedo::Uniform(_));
            let (choice, error) = match uniform {
                true => ("one column".to_owned(), 0.0),
                false => {
                    let maps =
                        format!("{}, {} texels per transport length", self.transport.name(), self.texels_per_length);
                    (maps, transport::error(self.transport, scene, Looked::of(request)))
                }
            };
            let reason = match request.wanted.transport() {
                Some(_) => "asked for",
                None => transport::reason(self.tolerance, scene, Looked::of(request)),
            };
            add("sunlight", choice, reason.to_owned(), error);
            let (choice, reason, error) = match (dark, even) {
                (true, _) => ("no exchange".to_owned(), "the ground reflects nothing", 0.0),
                (_, true) => ("one texel".to_owned(), "cloud and ground are the same everywhere", 0.0),
                _ => (
                    format!(
                        "exact kernel, conjugate gradients to {:.1e}, {} texels per base height",
                        self.exchange_change, self.texels_per_height
                    ),
                    "light between cloud and ground",
                    self.exchange_change + if self.texels_per_height >= 4.0 { 0.002 } else { 0.01 },
                ),
            };
            add("exchange", choice, reason.to_owned(), error);
        }
        if request.wanted.sphere().is_some() {
            let SkyDetail { rays, steps, error, .. } = self.sky;
            let choice = format!("up to {rays} rays a texel, {steps} samples per texel of cloud");
            add(
                "sky",
                choice,
                "many clouds are one texel near the horizon".to_owned(),
                if uniform { 0.0 } else { error },
            );
        }
        if let Some(slab) = self.slab {
            let error = slab.error_of(sheet(scene, request));
            let reason = match request.wanted.method() {
                Some(_) => "asked for".to_owned(),
                None if error <= self.tolerance => format!("the cheapest within the tolerance of {}", self.tolerance),
                None => format!("the finest there is; the tolerance is {}", self.tolerance),
            };
            add("shade", in_words(slab), reason, error);
        }
        choices
    }

    /// The same of a texture by Monte Carlo.
    fn explain_traced(&self, scene: &Scene, request: &Request) -> Vec<Choice> {
        let (in_air, sphere) = (matches!(scene.atmosphere, Atmosphere::Air(_)), request.wanted.sphere().is_some());
        let choice = |stage, choice: String, reason: String, error| Choice { stage, choice, reason, error };
        let texels = request.texels(scene).into_iter().map(f64::from).product::<f64>();
        let exact = 1.0 / (self.tolerance * self.tolerance);
        let asked = |texel_s: f64| format!("asked for; up to {} on one core", duration_in_words(texels * texel_s));
        let mapped = matches!(scene.ground.albedo, GroundAlbedo::Map { .. });
        if sphere && in_air && scene.layer_count() == 0 {
            let words = "reference (Monte Carlo on a round Earth)".to_owned();
            let texel_s = if mapped { GLOBE_TEXEL_S } else { AIR_TEXEL_S };
            return vec![choice("sky", words, asked(texel_s * exact), 0.5 * self.tolerance)];
        }
        if scene.layer_count() == 0 && !sphere {
            let reason = "without clouds every texel is the same".to_owned();
            return vec![choice("shade", "constant".to_owned(), reason, 0.0)];
        }
        let field = |layer: &Layer| {
            let (words, reason) = field_in_words(layer, scene, request);
            choice("field", words, reason.to_owned(), 0.0)
        };
        let mut choices: Vec<Choice> = scene.layers.iter().map(field).collect();
        // Texels of the ground are traced together where all layers are stratiform, and all clouds a little for each.
        let one_by_one = request.wanted.projection().is_some() || scene.cumulus.is_some();
        let texel_s = if sphere && in_air { GLOBE_TEXEL_S } else { CLOUD_TEXEL_S };
        let reason = if one_by_one { asked((texel_s * exact).max(LEAST_TEXEL_S)) } else { "asked for".to_owned() };
        let words = match sphere && in_air {
            true => "reference (Monte Carlo in three dimensions on a round Earth)".to_owned(),
            false => "reference (Monte Carlo in three dimensions)".to_owned(),
        };
        choices.push(choice("light", words, reason, 0.5 * self.tolerance));
        choices
    }
}
