// Cumulus: a ray's way through the volume of a layer. Twin: src/cumulus/march.rs.
@group(0) @binding(0) var<uniform> cumulus: Cumulus;
@group(0) @binding(1) var volume: texture_3d<f32>; // depth below the surface of the spheres, 0 to 1: -band to band
@group(0) @binding(2) var leaps: texture_3d<u32>;  // blocks that a ray may leap, 0 where cloud may be
@group(0) @binding(3) var relief: texture_3d<f32>; // noise, -1 to 1
@group(0) @binding(4) var around: sampler;         // repeats as the domain does, ends above and below
@group(0) @binding(5) var tiling: sampler;         // repeats in all directions

const CUMULUS_BLOCK: f32 = 4.0;
// Steps of a view ray and of a sun ray, at most.
const CUMULUS_VIEW_STEPS: u32 = 2048u;
const CUMULUS_SUN_STEPS: u32 = 512u;
// A step at the surface, in cubes, and metres at most where noise is to be seen.
const CUMULUS_STEP: f32 = 0.4;
const CUMULUS_ROUGH_STEP_M: f32 = 8.0;
// No depth was looked up.
const CUMULUS_UNKNOWN: f32 = -1e9;

// A ray over a round Earth, from which it rises by half of bend times the square of its length.
struct CloudRay {
    start: vec3<f32>,
    towards: vec3<f32>,
    way: vec3<f32>, // the same over the domain, which a sky shows a little drawn out far from the eye: not of unit length there
    bend: f32,
}

// Where a march along it is.
struct CloudMarch {
    at_m: f32,
    depth: f32,    // below the surface there, if it is known
    length_m: f32, // of the last step, and the mean density on it
    density: f32,
}

// What all steps of a march have in common, found once: software devices would find it again at each, and divide each time.
struct CloudScale {
    corner: vec3<f32>,
    block_m: f32,
    per_side: vec3<f32>,  // of the volume, 1/m
    per_block: f32,       // 1/m
    blocks: vec3<f32>,
    rough_m: f32,         // a step at the surface
    per_blocks: vec2<f32>,
    per_tile: f32,        // 1/m
    per_edge: f32,        // 1/m
}

fn cumulus_scale() -> CloudScale {
    let corner = vec3<f32>(-0.5 * cumulus.extent_m, -0.5 * cumulus.extent_m, cumulus.floor_m);
    let block_m = CUMULUS_BLOCK * cumulus.voxel_m;
    let blocks = vec3<f32>(textureDimensions(leaps));
    let step_m = CUMULUS_STEP * cumulus.voxel_m;
    return CloudScale(
        corner,
        block_m,
        1.0 / (vec3<f32>(textureDimensions(volume)) * cumulus.voxel_m),
        1.0 / block_m,
        blocks,
        select(step_m, min(step_m, CUMULUS_ROUGH_STEP_M), cumulus.relief_m > 0.0),
        1.0 / blocks.xy,
        1.0 / cumulus.tile_m,
        1.0 / max(cumulus.edge_m, 1e-6),
    );
}

fn cumulus_place(ray: CloudRay, at_m: f32) -> vec3<f32> {
    return ray.start + ray.way * at_m + vec3<f32>(0.0, 0.0, 0.5 * ray.bend * at_m * at_m);
}

// Depth below the rugged surface.
fn cumulus_depth(scale: CloudScale, place: vec3<f32>) -> f32 {
    let depth = (2.0 * textureSampleLevel(volume, around, (place - scale.corner) * scale.per_side, 0.0).x - 1.0) * cumulus.band_m;
    if cumulus.relief_m > 0.0 && abs(depth) < cumulus.edge_m + cumulus.relief_m {
        return depth + cumulus.relief_m * textureSampleLevel(relief, tiling, place * scale.per_tile, 0.0).x;
    }
    return depth;
}

fn cumulus_filled(depth_m: f32, edge_m: f32) -> f32 {
    let depth = max(depth_m, 0.0);
    return select(depth - 0.5 * edge_m, depth * depth / max(2.0 * edge_m, 1e-6), depth < edge_m);
}

// Mean density between two depths below the surface, where the depth changes evenly from one to the other.
fn cumulus_mean(from_m: f32, to_m: f32, edge_m: f32) -> f32 {
    let change = to_m - from_m;
    let middle = 0.5 * (from_m + to_m);
    let even = select(select(0.0, 1.0, middle > 0.0), clamp(middle / max(edge_m, 1e-6), 0.0, 1.0), edge_m > 0.0);
    let mean = (cumulus_filled(to_m, edge_m) - cumulus_filled(from_m, edge_m)) / select(change, 1.0, abs(change) < 1e-3);
    return select(clamp(mean, 0.0, 1.0), even, abs(change) < 1e-3);
}

// One step on, or one look at the place that was reached by a leap. The surface is seen no sharper than over soft_m. Software devices
// run through both sides of a branch: a step takes one sample.
fn cumulus_march(scale: CloudScale, ray: CloudRay, march: CloudMarch, end_m: f32, soft_m: f32) -> CloudMarch {
    let edge_m = clamp(soft_m, cumulus.edge_m, max(cumulus.band_m, cumulus.edge_m));
    let widened = 0.5 * (edge_m - cumulus.edge_m);
    let unknown = march.depth == CUMULUS_UNKNOWN;
    let clear = -march.depth - cumulus.relief_m - widened;
    let full = march.depth - cumulus.edge_m - cumulus.relief_m - widened;
    let wanted_m = select(max(max(clear, full), max(scale.rough_m, soft_m)), 0.0, unknown);
    let to_m = min(march.at_m + wanted_m, end_m);
    let place = cumulus_place(ray, to_m);
    let block = floor((place - scale.corner) * scale.per_block);
    // In floats, which hold such whole numbers: software devices divide integers one by one.
    let count = scale.blocks;
    // To the middle of a block: where the quotient is whole, rounding must not take it to the one before.
    let wrapped = vec3<f32>(block.xy - count.xy * floor((block.xy + 0.5) * scale.per_blocks), clamp(block.z, 0.0, count.z - 1.0));
    let leap = textureLoad(leaps, vec3<i32>(wrapped), 0).x;
    let there = cumulus_depth(scale, place);
    let middle_z = 0.5 * (cumulus_place(ray, march.at_m).z + place.z);
    let base = select(1.0, clamp((middle_z - cumulus.base_m) * scale.per_edge, 0.0, 1.0), cumulus.edge_m > 0.0);
    let density = select(base * cumulus_mean(march.depth + widened, there + widened, edge_m), 0.0, unknown);
    // Out of the cube of clear blocks around this one.
    let towards = ray.way + vec3<f32>(0.0, 0.0, ray.bend * to_m);
    let reach = f32(leap) - 1.0;
    let faces = scale.corner + (block + select(vec3<f32>(-reach), vec3<f32>(1.0 + reach), towards >= vec3<f32>(0.0))) * scale.block_m;
    let out = abs((faces - place) / select(towards, vec3<f32>(1e-9), abs(towards) < vec3<f32>(1e-9)));
    let leap_m = min(out.x, min(out.y, out.z)) + 1e-3 * cumulus.voxel_m + 1e-6 * to_m;
    let leaps_on = leap > 0u;
    return CloudMarch(to_m + select(0.0, leap_m, leaps_on), select(there, CUMULUS_UNKNOWN, leaps_on), to_m - march.at_m, density);
}

// Length of cloud along a ray, as if it were of full density everywhere, up to about enough_m. The surface is seen as from a
// disc of so many radians.
fn cumulus_length(ray: CloudRay, near_m: f32, far_m: f32, enough_m: f32, disc: f32) -> f32 {
    let scale = cumulus_scale();
    var march = CloudMarch(near_m, CUMULUS_UNKNOWN, 0.0, 0.0);
    var length_m = 0.0;
    var step = 0u;
    // Left at its end: software devices run through the body once more where a loop is left at its head.
    loop {
        march = cumulus_march(scale, ray, march, far_m, disc * march.at_m);
        length_m += march.density * march.length_m;
        continuing {
            step++;
            break if step >= CUMULUS_SUN_STEPS || march.at_m >= far_m || length_m >= enough_m;
        }
    }
    return length_m;
}

// Where a straight ray from within or below the layer leaves it.
fn cumulus_leaves(start: vec3<f32>, towards: vec3<f32>) -> f32 {
    let up = select(towards.z, 1e-6, abs(towards.z) < 1e-6);
    let ends = select(cumulus.low_m, cumulus.top_m, up > 0.0);
    return clamp((ends - start.z) / up, 0.0, 4.0 * cumulus.extent_m);
}
