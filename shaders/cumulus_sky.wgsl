// A cumulus layer on a picture of the sky: along the part of each ray that sinks, or that rises.
@group(0) @binding(CUMULUS_NEXT) var<uniform> view: SkyView;
@group(0) @binding(CUMULUS_NEXT + 1u) var air: texture_2d<f32>; // between the eye and the layer
@group(0) @binding(CUMULUS_NEXT + 2u) var clamped: sampler;
@group(0) @binding(CUMULUS_NEXT + 3u) var<storage, read> tiles: array<u32>;
@group(0) @binding(CUMULUS_NEXT + 4u) var<storage, read_write> output: array<f32>;
@group(0) @binding(CUMULUS_NEXT + 5u) var<storage, read_write> held: array<vec3<f32>>;
@group(0) @binding(CUMULUS_NEXT + 6u) var<uniform> air_colours: AirColours;

// Nothing behind is seen through more than this.
const SKY_OPAQUE: f32 = 0.9998;
// Of a texel's width, what of it a surface is drawn over.
const SKY_SOFT: f32 = 0.7;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = sky_pixel(tiles[id.x / SKY_TILE], vec2<u32>(id.x % SKY_TILE, id.y));
    if pixel.x >= view.size.x || pixel.y >= view.rows {
        return;
    }
    let texel = pixel.y * view.size.x + pixel.x;
    let at = 4u * texel;
    let before = vec4<f32>(output[at], output[at + 1u], output[at + 2u], output[at + 3u]);
    let direction = sphere_direction(view, vec2<f32>(pixel + vec2<u32>(0u, view.first_row)) + 0.5);
    if before.a >= SKY_OPAQUE || dot(direction, direction) == 0.0 {
        return;
    }
    // Where the ray is in the layer.
    let h_m = view.eye.z;
    let lowest = lowest_m(h_m, direction.z);
    let rising = view.rising == 1u;
    let near_z = select(min(h_m, cumulus.top_m), max(cumulus.low_m, max(lowest, 0.0)), rising);
    let far_z = select(max(cumulus.low_m, max(lowest, 0.0)), cumulus.top_m, rising);
    let turns = lowest > cumulus.low_m;
    var near_m = sinking_distance(h_m, direction.z, near_z);
    // A ray that turns in the layer is one with its rising part: of cloud in two parts neither knows of the light that the other scatters on, and a dark
    // line would go through it level with the eye.
    var far_m = select(sinking_distance(h_m, direction.z, far_z), rising_distance(h_m, direction.z, cumulus.top_m), turns);
    var meets = direction.z < 0.0 && near_z > far_z;
    if rising {
        near_m = rising_distance(h_m, direction.z, near_z);
        far_m = rising_distance(h_m, direction.z, cumulus.top_m);
        let sank = turns && direction.z < 0.0;
        meets = near_z < cumulus.top_m && (direction.z >= 0.0 || lowest > 0.0) && !sank;
    }
    if !meets || near_m >= far_m {
        return;
    }
    let cone = SKY_SOFT * sphere_cone(view, direction).side;
    let bend = (1.0 - direction.z * direction.z) / (EARTH_RADIUS_M + h_m);
    // Both its ends drift: so what stands upright does so in the domain.
    let near_drift_m = drift_m(view, cumulus.extent_m, view.eye.xy + direction.xy * near_m);
    let far_drift_m = drift_m(view, cumulus.extent_m, view.eye.xy + direction.xy * far_m);
    let drawn = (far_drift_m - near_drift_m) / max(far_m - near_m, 1.0);
    let start = view.eye + vec3<f32>(near_drift_m - drawn * near_m - cumulus.offset_m, 0.0);
    let ray = CloudRay(start, direction, direction + vec3<f32>(drawn, 0.0), bend);
    let background = select(cumulus.below, cumulus.above, direction.z > 0.0);
    let seen = cumulus_seen(ray, near_m, far_m, cone, 0.0, background);
    if seen.depth <= 0.0 {
        return;
    }
    let alpha = cumulus_alpha(seen.depth);
    let way = air_light(air, clamped, direction, cumulus.sun, view.horizon, !rising);
    let left = 1.0 - before.a;
    let light = before.rgb + left * (seen.radiance * way.through + alpha * way.light);
    output[at] = light.r;
    output[at + 1u] = light.g;
    output[at + 2u] = light.b;
    output[at + 3u] = before.a + left * alpha;
    if view.together == 1u {
        let held_before = held[texel];
        held[texel] = vec3<f32>(1.0 - (1.0 - held_before.xy) * (1.0 - alpha), held_before.z);
    }
}
