//! Scenes that are taken can be drawn.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use skyloom::image::{Image, ImageLimits, decode, sha256_hex};
use skyloom::memory::Memory;
use skyloom::render::{Fault, Images, Job, Renderer, RendererOptions, Watch};
use skyloom::request::{Request, TextureKind};
use skyloom::scene::Scene;
use skyloom::tables::TableLibrary;

use crate::schema_tools::Random;
use crate::{cases, kept, scene_maker, seed};

/// For so long scenes are rendered: a third of a minute, or five where a million are hunted.
fn render_time() -> Duration {
    Duration::from_millis((cases() as u64 * 3 / 10).max(20_000))
}

/// What of the scenes that are taken is rendered: those that take little, of fields as coarse as can be.
const RENDER_BYTES: u64 = 512 << 20;
const RENDER_TEXELS: u64 = 16;
/// Tables that take longer, and renders, are given up.
const RENDER_PATIENCE: Duration = Duration::from_secs(3);

/// Images that scenes name in a run, by their hashes: one of grey, and one of colours.
fn named_images() -> [(String, Image); 2] {
    let mut random = Random(seed());
    let mut samples = |count: usize| (0..count).map(|_| random.next().to_le_bytes()[0]).collect();
    let grey = image::GrayImage::from_raw(16, 16, samples(16 * 16)).unwrap();
    let colours = image::RgbImage::from_raw(8, 16, samples(3 * 8 * 16)).unwrap();
    [image::DynamicImage::from(grey), colours.into()].map(|picture| {
        let mut file = std::io::Cursor::new(Vec::new());
        picture.write_to(&mut file, image::ImageFormat::Png).unwrap();
        let file = file.into_inner();
        let limits = ImageLimits { max_side: 16, max_texels: 256 };
        (sha256_hex(&file), decode(&file, &limits).unwrap())
    })
}

/// Names those that there are, in place of those that a scene names: mostly of the kind that is needed there. Some scenes get images that had none.
fn with_images(scene: &mut Value, [grey, colours]: [&str; 2], has_some: bool, random: &mut Random) {
    if has_some {
        scene["ground"]["albedo"] = json!({ "image": colours, "linear": random.once_in(2) });
        for layer in scene["layers"].as_array_mut().unwrap() {
            if layer["thickness"].is_object() && random.once_in(2) {
                layer["thickness"] = json!({ "kind": "image", "image": grey, "scale_m": 10 + random.below(1000) });
            }
        }
    }
    let Ok(named) = Scene::from_json(scene.to_string().as_bytes()) else { return };
    for reference in named.image_references() {
        let is_grey = reference.pointer.starts_with("/layers") != random.once_in(16);
        *scene.pointer_mut(&reference.pointer).unwrap() = if is_grey { grey } else { colours }.into();
    }
}

/// A scene that is quickly drawn: most are of droplets and air without tables, which take seconds.
fn made_light(mut scene: Value, random: &mut Random) -> Value {
    let texels = scene["domain"]["resolution"].as_u64().unwrap();
    scene["domain"]["resolution"] = texels.min(RENDER_TEXELS).into();
    for layer in scene["layers"].as_array_mut().unwrap() {
        if layer["droplets"].get("effective_radius_um").is_some() && !random.once_in(16) {
            layer["droplets"] = json!({ "henyey_greenstein": 0.85, "albedo": 1, "extinction_per_m": 0.05 });
        }
    }
    if scene["atmosphere"].get("sky").is_none() && !random.once_in(4) {
        scene["atmosphere"] = json!({ "sun": [98, 94, 87], "sky": [2.6, 3.8, 6.2] });
    }
    scene
}

/// The end of tables in the making, from within.
struct GivenUp;

/// Why a texture of a scene is wrong; `Ok(false)` where it was refused, or given up.
fn rendered(
    renderer: &mut Renderer,
    library: &TableLibrary,
    (scene, request, images): (&Arc<Scene>, Request, &Images),
) -> Result<bool, String> {
    let start = Instant::now();
    let goes_on = |_: f64| {
        if start.elapsed() > RENDER_PATIENCE {
            resume_unwind(Box::new(GivenUp));
        }
    };
    let watch = Watch { deadline: Some(start + 2 * RENDER_PATIENCE), ..Watch::default() };
    let work = || {
        let job = Job::prepare(Arc::clone(scene), request, images, library, &goes_on)?;
        renderer.render(&job, &watch)
    };
    match catch_unwind(AssertUnwindSafe(work)) {
        Err(payload) if payload.is::<GivenUp>() => Ok(false),
        Err(_) => Err("a panic".to_owned()),
        Ok(Err(error)) => match error.fault() {
            Fault::Nobody | Fault::Caller => Ok(false),
            _ => Err(error.to_string()),
        },
        Ok(Ok(texture)) => {
            let bad = |value: &&f32| !value.is_finite() || **value < 0.0;
            match texture.data.iter().find(bad) {
                Some(value) => Err(format!("a texel has {value}")),
                None if texture.data.len() % (texture.width * texture.height) as usize == 0 => Ok(true),
                None => Err("texels are missing".to_owned()),
            }
        }
    }
}

/// Scenes that are taken can be drawn: every texture of them is of finite numbers, none of them below 0.
#[test]
fn renders() {
    let schema = skyloom::scene::schema();
    let (made, mut random) = (scene_maker(&schema), Random(seed()));
    let (mut renderer, library) = (Renderer::new(&RendererOptions::default()).unwrap(), TableLibrary::new(None));
    let named = named_images();
    let hashes = named.each_ref().map(|(hash, _)| hash.as_str());
    let images: Images = named.iter().map(|(hash, image)| (hash.clone(), Arc::new(image.clone()))).collect();
    let (start, mut counts, mut wrong) = (Instant::now(), [0; 4], Vec::new());
    while start.elapsed() < render_time() && wrong.len() < 10 {
        let Ok(scene) = Scene::from_json(&made(&mut random)) else { continue };
        // Most have clouds.
        if scene.layer_count() == 0 && !random.once_in(8) {
            continue;
        }
        let mut normal = made_light(scene.to_json(), &mut random);
        with_images(&mut normal, hashes, counts[0] % 3 == 0, &mut random);
        let Ok(scene) = Scene::from_json(normal.to_string().as_bytes()) else { continue };
        let scene = Arc::new(scene);
        counts[0] += 1;
        counts[3] += usize::from(!scene.image_references().is_empty());
        // Two of the textures, so that there are more scenes.
        for kind in [*random.pick(&TextureKind::ALL), *random.pick(&TextureKind::ALL)] {
            let mut query = vec![("size".to_owned(), (4 + random.below(5)).to_string())];
            if [TextureKind::Cloud, TextureKind::Sky].contains(&kind) {
                query.push(("tolerance".to_owned(), random.pick(&["0.3", "1"]).to_string()));
            }
            if random.once_in(3) {
                query.push(("time".to_owned(), random.pick(&["1", "1000", "80000"]).to_string()));
            }
            let Ok(request) = Request::parse(kind.name(), "f32", &query).unwrap().of(&scene) else { continue };
            if Memory::new(&request, &scene, &images).bytes > RENDER_BYTES {
                continue;
            }
            match rendered(&mut renderer, &library, (&scene, request, &images)) {
                Ok(is_drawn) => counts[if is_drawn { 1 } else { 2 }] += 1,
                Err(why) => {
                    let place = kept("renders", normal.to_string().as_bytes());
                    wrong.push(format!("{}?{query:?}: {why}: {place}", kind.name()));
                    // It may be of no more use.
                    renderer = Renderer::new(&RendererOptions::default()).unwrap();
                }
            }
        }
    }
    let [scenes, drawn, given_up, of_images] = counts;
    eprintln!("renders: {scenes} scenes, {of_images} with images, {drawn} textures, {given_up} refused or given up");
    assert!(of_images > 0);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(drawn > given_up, "{drawn} drawn, {given_up} not");
}
