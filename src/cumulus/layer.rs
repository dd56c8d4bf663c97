//! What a scene's layer of cumulus is at a time.

use super::body::{Body, Sphere};
use super::grown::grown;
use super::population::Field;
use crate::scene::quantity::Quantity;
use crate::scene::{self, Cumulus, CumulusShape, Wind};
use glam::{DVec2, DVec3, dvec2, dvec3};

/// The clouds of a layer at a time, s since the scene's start, where they would be without wind: see [`drift_m`]. The domain's side
/// and that of a texel are in metres.
///
/// The same in all its bits for the same arguments, whatever was asked before. Spheres below 15 m are left out, and where a texel is
/// coarser those below half of it, as long as they are small against their cloud; where clouds are does not depend on the texel. A
/// field has about 200,000 spheres at most: more are coarser, and more than 20,000 clouds are wider and fewer, so that the coverage
/// is what was asked for.
pub fn body(cumulus: &Cumulus, extent_m: f64, texel_m: f64, time_s: f64) -> Body {
    let (base_m, edge_m) = (cumulus.base_m.get(), cumulus.edge_m.get());
    let mut spheres = Vec::new();
    let mut add = |sphere: Sphere| {
        if sphere.centre.z + sphere.radius_m > base_m {
            spheres.push(sphere);
        }
    };
    let least_m = match &cumulus.shape {
        CumulusShape::Field { coverage, width_m, seed } => {
            let width_m = width_m.map(|width_m| width_m.get().min(Cumulus::widest_m(extent_m)));
            let field = Field::new(coverage.get(), width_m, *seed, base_m, [extent_m, texel_m]);
            field.spheres(time_s).into_iter().for_each(|(_, sphere)| add(sphere));
            field.least_m()
        }
        CumulusShape::Spheres { given, levels: 0, .. } => {
            for &[x, y, z, radius_m] in given {
                add(Sphere { centre: dvec3(x, y, z), radius_m });
            }
            spheres.iter().map(|sphere| sphere.radius_m).fold(0.5 * texel_m.max(30.0), f64::min)
        }
        CumulusShape::Spheres { given, levels, seed } => {
            let root = |&[x, y, z, radius_m]: &[f64; 4]| Sphere { centre: dvec3(x, y, z - base_m), radius_m };
            let roots: Vec<Sphere> = given.iter().map(root).collect();
            let (grown, least_m) = grown(&roots, *levels, *seed, [extent_m, texel_m]);
            for Sphere { centre, radius_m } in grown {
                add(Sphere { centre: centre + base_m * DVec3::Z, radius_m });
            }
            least_m
        }
    };
    Body { spheres, base_m, edge_m, relief_m: 0.5 * edge_m.min(least_m), extent_m }
}

/// How far the wind has carried the clouds to the east and to the north, modulo the domain's side: from 0 to below it.
pub fn drift_m(wind: &Wind, time_s: f64, extent_m: f64) -> DVec2 {
    let [east, north, _] = scene::direction(90.0, wind.from_deg.get());
    let way_m = wind.speed_m_s.get() * time_s;
    // Wind comes from its direction. What is less than a rounding below 0 would come out as the whole side.
    let within = |way_m: f64| {
        let way_m = way_m.rem_euclid(extent_m);
        if way_m < extent_m { way_m } else { 0.0 }
    };
    dvec2(within(-way_m * east), within(-way_m * north))
}
