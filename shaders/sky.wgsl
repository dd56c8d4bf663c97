// Output: radiance that arrives at the eye from each direction: clouds, and the sky or the ground behind them. Behind plain tiles there is the ground
// alone.
@group(0) @binding(0) var<uniform> backdrop: Backdrop;
@group(0) @binding(1) var<uniform> view: SkyView;
@group(0) @binding(2) var ground: texture_2d<f32>;
@group(0) @binding(3) var trilinear: sampler;
@group(0) @binding(4) var air_above: texture_2d<f32>; // from the eye to space
@group(0) @binding(5) var air_below: texture_2d<f32>; // from the eye to the ground
@group(0) @binding(6) var clamped: sampler;
@group(0) @binding(7) var<storage, read> clouds: array<f32>;
@group(0) @binding(8) var<storage, read> tiles: array<u32>;
@group(0) @binding(9) var<storage, read_write> output: array<f32>;
@group(0) @binding(10) var<uniform> air_colours: AirColours;

// Rays of a texel with the horizon in it, at least: its edge would show steps.
const SKY_EDGE_RAYS: u32 = 8u;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = sky_pixel(tiles[id.x / SKY_TILE], vec2<u32>(id.x % SKY_TILE, id.y));
    if pixel.x >= view.size.x || pixel.y >= view.rows {
        return;
    }
    let texel = pixel.y * view.size.x + pixel.x;
    let light = sky_backdrop(vec2<f32>(pixel + vec2<u32>(0u, view.first_row)) + 0.5);
    let left = 1.0 - clouds[4u * texel + 3u];
    for (var i = 0u; i < 3u; i++) {
        output[3u * texel + i] = clouds[4u * texel + i] + left * light[i];
    }
}

fn sky_backdrop(middle: vec2<f32>) -> vec3<f32> {
    let direction = sphere_direction(view, middle);
    if dot(direction, direction) == 0.0 {
        return vec3<f32>(0.0);
    }
    let h_m = view.eye.z;
    let cone = sphere_cone(view, direction);
    let half = 0.5 * cone.rise;
    let mixed = !SKY_PLAIN && misses_ground(h_m, direction.z + half);
    let distance_m = sinking_distance(h_m, direction.z, 0.0);
    let far = distance_m * f32(textureDimensions(ground).x) / backdrop.extent_m;
    let along = far * cone.rise / max(-cosine_at(h_m, direction.z, distance_m, 0.0), 1e-3);
    // Where the horizon crosses the texel, the ground is far away.
    let level = select(log2(max(far * cone.side, 1e-6)), 32.0, mixed);
    let wanted = u32(clamp(ceil(along / view.texels_per_ray), 1.0, f32(view.rays)));
    // A texel that is well above the horizon has but one.
    let above = !SKY_PLAIN && misses_ground(h_m, direction.z - cone.rise);
    let rays = select(select(wanted, max(view.rays, SKY_EDGE_RAYS), mixed), 1u, above);
    var sum = vec3<f32>(0.0);
    for (var i = 0u; i < rays; i++) {
        var towards = direction;
        if rays > 1u {
            towards = scattered_direction(view, middle, direction, i);
        }
        if !SKY_PLAIN && misses_ground(h_m, towards.z) {
            sum += air_light(air_above, clamped, towards, backdrop.sun, backdrop.horizon, false).light;
        } else {
            let way_m = ground_way(h_m, towards, sinking_distance(h_m, towards.z, 0.0));
            let place = view.eye.xy + towards.xy / max(length(towards.xy), 1e-12) * way_m;
            let shown = place + drift_m(view, backdrop.extent_m, place);
            let light = sample_level(ground, trilinear, domain_uv(shown, backdrop.extent_m), level).rgb;
            let air = air_light(air_below, clamped, towards, backdrop.sun, backdrop.horizon, true);
            sum += light * air.through + air.light;
        }
    }
    return sum / f32(rays);
}
