// Light of a cumulus layer along a view ray, by shaders that take a cloud for its surface. Twin: src/reference/cumulus_surface.rs.
@group(0) @binding(6) var<uniform> surface: CumulusSurface;
@group(0) @binding(7) var coarse: texture_3d<f32>; // normals of the surface that blobs stand out of, 0 far from it

// Of what comes after the bindings of light.
const CUMULUS_NEXT: u32 = 8u;
// Stretches of cloud on a ray, at most.
const SURFACE_STRETCHES: u32 = 32u;
// Optical depth beyond which nothing is seen.
const SURFACE_OPAQUE: f32 = 12.0;
// No glow is sharper than the sun's disc.
const SURFACE_SHARPEST: f32 = 4.6e4;
// Of the share of the layer that a ray reaches, by the noise on the ball.
const SURFACE_GRAIN: f32 = 0.3;

fn surface_noise(place: vec3<f32>) -> vec3<f32> {
    let uvw = place / cumulus.tile_m;
    return vec3<f32>(
        textureSampleLevel(relief, tiling, uvw, 0.0).x,
        textureSampleLevel(relief, tiling, uvw + vec3<f32>(0.37, 0.61, 0.13), 0.0).x,
        textureSampleLevel(relief, tiling, uvw + vec3<f32>(0.71, 0.29, 0.53), 0.0).x,
    );
}

// Depth below the surface of the spheres, without noise.
fn surface_depth(place: vec3<f32>) -> f32 {
    let size = vec3<f32>(textureDimensions(volume));
    let corner = vec3<f32>(-0.5 * cumulus.extent_m, -0.5 * cumulus.extent_m, cumulus.floor_m);
    return (2.0 * textureSampleLevel(volume, around, (place - corner) / (size * cumulus.voxel_m), 0.0).x - 1.0) * cumulus.band_m;
}

fn surface_normal(place: vec3<f32>, to_eye: vec3<f32>) -> vec3<f32> {
    let x = vec3<f32>(cumulus.voxel_m, 0.0, 0.0);
    let falls = vec3<f32>(
        surface_depth(place - x.xyy) - surface_depth(place + x.xyy),
        surface_depth(place - x.yxy) - surface_depth(place + x.yxy),
        surface_depth(place - x.yyx) - surface_depth(place + x.yyx),
    );
    let size = length(falls);
    return select(to_eye, falls / max(size, 1e-6), size > 1e-3);
}

// Of light that a crease traps: the height of a place over the coarser surface in radii of a ball that sits on it with its middle, and
// the cosine of the sun on that surface; 1 and 0 where there is none.
fn surface_crease(place: vec3<f32>, normal: vec3<f32>) -> vec2<f32> {
    let size = vec3<f32>(textureDimensions(coarse));
    let corner = vec3<f32>(-0.5 * cumulus.extent_m, -0.5 * cumulus.extent_m, cumulus.lattice_floor_m);
    let found = textureSampleLevel(coarse, around, (place - corner) / (size * cumulus.cell_m), 0.0).xyz;
    let there = length(found);
    let coarser = found / max(there, 1e-6);
    let crease = vec2<f32>(clamp(dot(normal, coarser), 0.0, 1.0), max(dot(coarser, cumulus.sun), 0.0));
    return select(vec2<f32>(1.0, 0.0), crease, there > 1e-4);
}

// cone: width of what a texel shows, per metre of distance; wide_m: the same at any distance.
fn cumulus_seen(ray: CloudRay, near_m: f32, far_m: f32, cone: f32, wide_m: f32, background: vec3<f32>) -> CumulusSeen {
    var seen = CumulusSeen(vec3<f32>(0.0), 0.0);
    var corona = vec3<f32>(0.0);
    let scale = cumulus_scale();
    var march = CloudMarch(near_m, CUMULUS_UNKNOWN, 0.0, 0.0);
    var step = 0u;
    let away = cumulus_away(ray.towards);
    let light = cumulus.irradiance * cumulus.albedo / PI;
    let ratio = cumulus_ratio();
    var stretches = 0u;
    // Left at their ends: software devices run through the body once more where a loop is left at its head.
    loop {
        var entry_m = 0.0;
        var depth = 0.0;
        var deepest_m = 0.0;
        loop {
            let from_m = march.at_m;
            let was = march.depth;
            march = cumulus_march(scale, ray, march, far_m, cone * from_m + wide_m);
            let added = cumulus.extinction.g * march.density * march.length_m;
            // Where the step meets the surface.
            let crosses = was < 0.0 && was > CUMULUS_UNKNOWN && march.depth > 0.0;
            let before_m = march.length_m * select(0.0, was / (was - march.depth), crosses);
            entry_m = select(entry_m, from_m + before_m, depth == 0.0);
            depth += added;
            deepest_m = max(deepest_m, march.depth);
            let ends = depth > 0.0 && (added == 0.0 || seen.depth + depth >= SURFACE_OPAQUE);
            continuing {
                step++;
                break if ends || step >= CUMULUS_VIEW_STEPS || march.at_m >= far_m;
            }
        }
        if depth > 0.0 {
            let place = cumulus_place(ray, entry_m);
            let smooth_normal = surface_normal(place, -ray.towards);
            let noise = surface_noise(place);
            let turned = smooth_normal + surface.bump * noise;
            let turned_size = length(turned);
            let normal = select(smooth_normal, turned / max(turned_size, 1e-6), turned_size > 1e-3);
            let reached = surface_grain(clamp(deepest_m / surface.reached_m, 0.0, 1.0) * cumulus_alpha(depth), noise.x);
            let trapped = surface.traps * surface_trapped(surface_crease(place, smooth_normal));
            let body = surface.ambient + surface.diffuse * max(dot(normal, cumulus.sun), 0.0) + trapped;
            let exponent = surface.glow_m / max(depth / cumulus.extinction.g * reached, 1e-9);
            let glow = vec3<f32>(
                cumulus_lobe(away, min(exponent.r, SURFACE_SHARPEST)),
                cumulus_lobe(away, min(exponent.g, SURFACE_SHARPEST)),
                cumulus_lobe(away, min(exponent.b, SURFACE_SHARPEST)),
            );
            let share = cumulus_passes(seen.depth) - cumulus_passes(seen.depth + depth);
            let shines = exp(-ratio * seen.depth);
            seen.radiance += share * surface_even(normal.z) + shines * reached * light * body;
            // The glow of what lies before is seen through this one.
            corona = corona * exp(-ratio * depth) + shines * light * surface.corona * reached * (1.0 - reached) * glow;
            seen.depth += depth;
        }
        continuing {
            stretches++;
            let hidden = seen.depth >= SURFACE_OPAQUE;
            break if hidden || stretches >= SURFACE_STRETCHES || step >= CUMULUS_VIEW_STEPS || march.at_m >= far_m;
        }
    }
    seen.radiance += corona + cumulus_behind(seen.depth, background);
    return seen;
}
