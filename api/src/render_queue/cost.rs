//! What a job will cost, told before it waits.

use skyloom::plan::{Plan, field_resolution};
use skyloom::render::Job;
use skyloom::request::Request;
use skyloom::scene::Scene;

/// Texels from which a job is large. Below, a software device takes a second or two.
pub(super) const LARGE: f64 = 4e6;
/// Texels up to which a job is small: some tenths of a second, such as a texture of 512 a side or the first one under a new sun.
pub(super) const SMALL: f64 = 1.2e6;
/// Texels up to which a job is quick: a tenth of a second or two, on a software device.
pub(super) const QUICK: f64 = 4e5;
/// Light in cumulus is followed in three dimensions: so many texels' worth each.
const CUMULUS: f64 = 8.0;
/// Light in a layer that is solved in three dimensions: 0.1 to 0.5 s on two cores for domains of 5 to 80 km, in texels' worth of the layer.
const LATTICE: f64 = 5e5;

/// The cost of a job in texels of one layer.
pub(super) fn cost(job: &Job) -> f64 {
    of(job.texels(), job.scene(), job.request(), job.plan())
}

/// The same of a request in its normal form, told without the tables that its job takes.
pub(crate) fn cost_of(scene: &Scene, request: &Request) -> f64 {
    of(request.texels(scene), scene, request, &Plan::new(request, scene))
}

/// Texels for each layer that is seen through them, and those of the fields of the layers and of their light, though they may be there
/// already.
fn of(texels: [u32; 2], scene: &Scene, request: &Request, plan: &Plan) -> f64 {
    let [across, down] = texels.map(f64::from);
    let field = f64::from(field_resolution(scene, request));
    let layers = scene.layer_count() as f64;
    let depth = layers.max(1.0) + if scene.cumulus().is_some() { CUMULUS } else { 0.0 };
    let fields = if request.texture().shows_the_scene() { layers * field * field } else { 0.0 };
    across * down * depth + fields + LATTICE * plan.lattices(scene, request) as f64
}
