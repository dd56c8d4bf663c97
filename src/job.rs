//! A texture to make, with everything that it takes. [`Job::prepare`] is the only way to one, so a job that exists can be
//! rendered.

mod contract;

pub use contract::{Fault, RenderError, Texture, Watch};

use crate::ground::GroundMap;
use crate::illumination::Illumination;
use crate::image::{Image, MissingImage};
use crate::plan::Plan;
use crate::request::Request;
use crate::scene::{Atmosphere, Scene};
use crate::tables::{AirMix, AirTables, MixTables, TableLibrary};
use std::collections::HashMap;
use std::sync::Arc;

/// Images by their SHA-256.
pub type Images = HashMap<String, Arc<Image>>;

/// The air of a scene, if it has any, as its tables depend on it. `images` are those that the scene names.
///
/// # Errors
/// The image of the ground's albedo is not among them.
pub fn air_mix(scene: &Scene, images: &Images, plan: &Plan) -> Result<Option<AirMix>, MissingImage> {
    let Atmosphere::Air(column) = &scene.atmosphere else { return Ok(None) };
    let ground = GroundMap::new(&scene.ground.albedo, images)?.mean();
    Ok(Some(AirMix::new(*column, ground, plan.tolerance)))
}

/// One texture to make.
#[derive(Debug, Clone)]
pub struct Job {
    scene: Arc<Scene>,
    scene_id: String,
    request: Request,
    plan: Plan,
    tables: Vec<Arc<MixTables>>,
    air: Option<Arc<AirTables>>,
    illumination: Illumination,
    images: Images,
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
        let plan = Plan::new(&request);
        let shown = request.texture().shows_the_scene();
        let mixes = if shown { scene.mixes() } else { Vec::new() };
        let air = match air_mix(&scene, &images, &plan)?.filter(|_| shown) {
            None => None,
            Some(mix) => Some(library.air(&mix, &|part| progress(part / (mixes.len() + 1) as f64))?),
        };
        // The air comes first.
        let (done, all) = (usize::from(air.is_some()), mixes.len() + usize::from(air.is_some()));
        let tables = mixes.iter().enumerate().map(|(i, mix)| {
            let part = |part: f64| progress(((done + i) as f64 + part) / all as f64);
            library.get(mix, plan.detail(), &part)
        });
        let tables = tables.collect::<Result<_, _>>()?;
        let scene_id = scene.id();
        let illumination = Illumination::new(&scene, air.as_deref(), request.time_s);
        Ok(Self { scene, scene_id, request, plan, tables, air, illumination, images })
    }

    /// The same at another time, s since the scene's start.
    pub fn at(&self, time_s: f64) -> Self {
        let illumination = Illumination::new(&self.scene, self.air.as_deref(), time_s);
        Self { request: Request { time_s, ..self.request }, illumination, ..self.clone() }
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

    /// Tables of the scene's mixes, one a layer, lowest first.
    pub fn tables(&self) -> &[Arc<MixTables>] {
        &self.tables
    }

    /// Tables of the scene's atmosphere, if it has air.
    pub fn air(&self) -> Option<&Arc<AirTables>> {
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
