//! Scenes in, textures out, through the renderer itself. A machine without an adapter fails these tests: it never
//! skips them.
#![allow(dead_code, reason = "each test binary uses its part")]

#[path = "library.rs"]
mod library;

use serde_json::{Value, json};
use skyloom::image::{Image, ImageEncoding, sha256_hex};
use skyloom::projection::SphereLayout;
use skyloom::render::{Images, Job, RenderError, Renderer, RendererOptions, Texture, Watch};
use skyloom::request::Request;
use skyloom::scene::Scene;
use skyloom::tables::{MixTables, TableLibrary};
use std::f64::consts::PI;
use std::ops::{Deref, DerefMut};
use std::sync::{Arc, LazyLock, Mutex, PoisonError};

pub(crate) struct Sky {
    pub(crate) renderer: Lent,
    images: Images,
    last: Vec<Arc<MixTables>>,
}

/// A renderer that the next test takes over: opening one takes longer than most tests.
pub(crate) struct Lent {
    renderer: Option<Renderer>,
    /// Opened with the default options, as the next one wants it.
    again: bool,
}

static RENDERERS: Mutex<Vec<Renderer>> = Mutex::new(Vec::new());
/// Tables of all tests of a binary.
pub(crate) static LIBRARY: LazyLock<TableLibrary> = LazyLock::new(library::library);

impl Lent {
    fn take() -> Self {
        let used = RENDERERS.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let open = || Renderer::new(&RendererOptions::default()).expect("a Vulkan driver (see README)");
        Self { renderer: Some(used.unwrap_or_else(open)), again: true }
    }
}

impl Deref for Lent {
    type Target = Renderer;

    fn deref(&self) -> &Renderer {
        self.renderer.as_ref().expect("lent until it is dropped")
    }
}

impl DerefMut for Lent {
    fn deref_mut(&mut self) -> &mut Renderer {
        self.renderer.as_mut().expect("lent until it is dropped")
    }
}

impl Drop for Lent {
    fn drop(&mut self) {
        // A failed test may leave a broken device behind.
        if let Some(renderer) = self.renderer.take().filter(|_| self.again && !std::thread::panicking()) {
            RENDERERS.lock().unwrap_or_else(PoisonError::into_inner).push(renderer);
        }
    }
}

/// A layer of Henyey-Greenstein scatterers, which needs no Mie tables.
pub(crate) fn hg_layer(thickness: Value, extinction_per_m: f64, albedo: f64) -> Value {
    json!({ "base_m": 1000, "thickness": thickness,
        "droplets": { "henyey_greenstein": 0.85, "extinction_per_m": extinction_per_m, "albedo": albedo } })
}

pub(crate) fn mean(texture: &Texture, channel: usize) -> f64 {
    let channels = texture.channels.len();
    let values = texture.data.iter().skip(channel).step_by(channels);
    values.map(|value| f64::from(*value)).sum::<f64>() / (texture.data.len() / channels) as f64
}

/// Root of the solid angle of a texel of a sky so many texels high (a cube's face is), radians.
pub(crate) fn texel_side(layout: SphereLayout, size: u32, direction: [f64; 3]) -> f64 {
    let (near, texel) = (direction.map(f64::abs), 2.0 / f64::from(size));
    match layout {
        SphereLayout::Equirect => 0.5 * PI * texel * near[0].hypot(near[1]).sqrt(),
        SphereLayout::Octahedral => texel * near.iter().sum::<f64>().powf(1.5),
        SphereLayout::Cube => texel * near.into_iter().fold(0.0, f64::max).powf(1.5),
        SphereLayout::Fisheye { fov_deg } => {
            let zenith = direction[2].clamp(-1.0, 1.0).acos();
            let around = if zenith > 0.0 { zenith.sin().max(1e-3) / zenith } else { 1.0 };
            0.5 * texel * fov_deg.to_radians() * around.sqrt()
        }
        // In its middle.
        SphereLayout::Camera { fov_deg, .. } => 0.5 * texel * fov_deg.to_radians(),
    }
}

impl Sky {
    pub(crate) fn open() -> Self {
        Self::of(Lent::take())
    }

    pub(crate) fn with(options: &RendererOptions) -> Self {
        let renderer = Renderer::new(options).expect("a Vulkan driver (see README)");
        Self::of(Lent { renderer: Some(renderer), again: false })
    }

    fn of(renderer: Lent) -> Self {
        Self { renderer, images: Images::new(), last: Vec::new() }
    }

    pub(crate) fn add_image(&mut self, width: u32, height: u32, data: Vec<f32>) -> String {
        let bytes: Vec<u8> = data.iter().flat_map(|value| value.to_le_bytes()).collect();
        let name = sha256_hex(&bytes);
        let image = Image::new(width, height, 1, data, ImageEncoding::Float).expect("an image");
        self.images.insert(name.clone(), Arc::new(image));
        name
    }

    pub(crate) fn job(&mut self, scene: &Value, texture: &str, query: &[(&str, &str)]) -> Job {
        let job = self.prepare(scene, (texture, "f32"), query).expect("a job");
        self.last = job.tables().to_vec();
        job
    }

    /// A texture in a format, if the scene allows it.
    pub(crate) fn prepare(
        &self,
        scene: &Value,
        (texture, format): (&str, &str),
        query: &[(&str, &str)],
    ) -> Result<Job, RenderError> {
        let scene = Scene::from_json(scene.to_string().as_bytes()).expect("a valid scene");
        let query: Vec<_> = query.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect();
        let request = Request::parse(texture, format, &query).expect("a valid request");
        Job::prepare(Arc::new(scene), request, &self.images, &LIBRARY, &|_| ())
    }

    pub(crate) fn render(&mut self, scene: &Value, texture: &str, query: &[(&str, &str)]) -> Texture {
        let job = self.job(scene, texture, query);
        self.renderer.render(&job, &Watch::default()).expect("a texture")
    }

    /// Tables of the last scene's first mix.
    pub(crate) fn tables(&self) -> &MixTables {
        &self.last[0]
    }
}
