//! A texture to make, with everything that it takes. [`Job::prepare`] is the only way to one, so a job that exists can be
//! rendered.

mod contract;

pub use contract::{Fault, RenderError, Texture, Watch};

use crate::illumination::Illumination;
use crate::image::{Image, MissingImage};
use crate::plan::{Plan, SkyDetail};
use crate::request::{Request, TextureKind};
use crate::scene::Scene;
use crate::scene_air::{SceneAir, air_mix, covered_mix};
use crate::tables::{MixTables, TableLibrary};
use std::collections::HashMap;
use std::sync::Arc;

/// Images by their SHA-256.
pub type Images = HashMap<String, Arc<Image>>;

/// One texture to make.
#[derive(Debug, Clone)]
pub struct Job {
    scene: Arc<Scene>,
    scene_id: String,
    request: Request,
    plan: Plan,
    tables: Vec<Arc<MixTables>>,
    air: Option<SceneAir>,
    illumination: Illumination,
    images: Images,
    /// Places of the ground in place of a map of it, domains from the north-western corner.
    points: Arc<[[f64; 2]]>,
}

impl Job {
    /// Checks a request against its scene, plans it, and fetches the tables of the scene's droplet mixes, which takes seconds
    /// for mixes that were never used before. `images` are those that the scene names; `progress` gets 0 to 1.
    ///
    /// # Errors
    /// [`RenderError::Invalid`] where the request or an image does not fit the scene, [`RenderError::MissingImage`],
    /// [`RenderError::Tables`].
    pub fn prepare(
        scene: Arc<Scene>,
        request: Request,
        images: &Images,
        library: &TableLibrary,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<Self, RenderError> {
        let request = request.of(&scene).map_err(RenderError::Invalid)?;
        let named = |sha256: String| match images.get(&sha256) {
            Some(image) => Ok((sha256, Arc::clone(image))),
            None => Err(RenderError::from(MissingImage(sha256))),
        };
        let references = scene.image_references();
        let named = references.into_iter().map(|reference| named(reference.sha256));
        let images = named.collect::<Result<Images, _>>()?;
        let found = scene.check_images(&images);
        if !found.errors.is_empty() {
            return Err(RenderError::Invalid(found.errors));
        }
        let plan = Plan::new(&request, &scene);
        let shown = request.texture().shows_the_scene();
        let mixes = if shown { scene.mixes() } else { Vec::new() };
        let air = if shown { air_mix(&scene, &images, &plan, library, &|_| progress(0.0))? } else { None };
        // The air takes two parts of the work: without clouds, and with them when their droplets are known.
        let all = mixes.len() + if air.is_some() { 2 } else { 0 };
        let begun = |done: usize| move |part: f64| progress((done as f64 + part) / all as f64);
        let clear = air.as_ref().map(|mix| library.air(mix, &begun(0))).transpose()?;
        let first = usize::from(air.is_some());
        let tables = mixes.iter().enumerate().map(|(i, mix)| library.get(mix, plan.detail(), &begun(first + i)));
        let tables: Vec<Arc<MixTables>> = tables.collect::<Result<_, _>>()?;
        let air = match (air, clear) {
            (Some(mix), Some(clear)) => {
                let covered = covered_mix(&scene, &images, &mix, &tables)?;
                let covered = covered.map(|mix| library.covered(&mix, &begun(all - 1))).transpose()?;
                Some(SceneAir { clear, covered })
            }
            _ => None,
        };
        let scene_id = scene.id();
        let illumination = Illumination::new(&scene, air.as_ref(), request.time_s);
        let points = Arc::from([]);
        Ok(Self { scene, scene_id, request, plan, tables, air, illumination, images, points })
    }

    /// The same with its sky looked at in another way than planned: for charts.
    pub(crate) fn with_sky(mut self, sky: SkyDetail) -> Self {
        self.plan.sky = sky;
        self
    }

    /// The same at another time, s since the scene's start.
    pub fn at(&self, time_s: f64) -> Self {
        let illumination = Illumination::new(&self.scene, self.air.as_ref(), time_s);
        Self { request: Request { time_s, ..self.request }, illumination, ..self.clone() }
    }

    /// The same at points of the ground (metres east and north of the domain's middle; the domain repeats) in place of a map: a
    /// row each, whose first texel is all light and whose second is the sun's beam. A point has the light of a texel of the map
    /// whose centre is there, if the map has as many texels as the request says.
    ///
    /// # Errors
    /// [`RenderError::Defect`] for another texture than `irradiance`, and for method reference.
    pub fn at_points(&self, points: &[[f64; 2]]) -> Result<Self, RenderError> {
        if self.request.texture() != TextureKind::Irradiance || self.plan.reference.is_some() {
            return Err(RenderError::Defect("points of another texture than the irradiance"));
        }
        let extent_m = self.scene.extent_m();
        let place = |[east_m, north_m]: &[f64; 2]| {
            [east_m / extent_m + 0.5, 0.5 - north_m / extent_m].map(|part: f64| part.rem_euclid(1.0))
        };
        Ok(Self { points: points.iter().map(place).collect(), ..self.clone() })
    }

    /// Places of the ground, domains from the north-western corner; none for a map.
    pub fn points(&self) -> &[[f64; 2]] {
        &self.points
    }

    /// Texels across and down.
    pub fn texels(&self) -> [u32; 2] {
        // At most a few thousand.
        if self.points.is_empty() { self.request.texels(&self.scene) } else { [2, self.points.len() as u32] }
    }

    /// The scene.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// Its name, [`Scene::id`].
    pub fn scene_id(&self) -> &str {
        &self.scene_id
    }

    /// What is asked of it, in its normal form.
    pub fn request(&self) -> &Request {
        &self.request
    }

    /// How it is made.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Tables of the scene's mixes: one a stratiform layer, lowest first, and last those of the cumulus.
    pub fn tables(&self) -> &[Arc<MixTables>] {
        &self.tables
    }

    /// Extinction of the droplets of one of the stratiform layers at 550 nm, 1/m.
    pub(crate) fn extinction_550_per_m(&self, number: usize) -> f64 {
        let cross_sections = self.tables[number].channels.each_ref().map(|channel| channel.cross_section_um2);
        self.scene.layers[number].droplets.extinction_per_m(cross_sections)[1]
    }

    /// The light of the scene's air, if it has air.
    pub fn air(&self) -> Option<&SceneAir> {
        self.air.as_ref()
    }

    /// Light at the request's time.
    pub fn illumination(&self) -> &Illumination {
        &self.illumination
    }

    /// The images that the scene names.
    pub fn images(&self) -> &Images {
        &self.images
    }
}
