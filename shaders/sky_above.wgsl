// Output: radiance that arrives at the eye from directions that do not meet the ground: clouds, and the sky behind them.
@group(0) @binding(0) var<uniform> backdrop: Backdrop;
@group(0) @binding(1) var<uniform> view: SkyView;
@group(0) @binding(2) var air: texture_2d<f32>;
@group(0) @binding(3) var clamped: sampler;
@group(0) @binding(4) var<storage, read> clouds: array<f32>;
@group(0) @binding(5) var<storage, read> tiles: array<u32>;
@group(0) @binding(6) var<storage, read_write> output: array<f32>;
@group(0) @binding(7) var<uniform> air_colours: AirColours;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = sky_pixel(tiles[id.x / SKY_TILE], vec2<u32>(id.x % SKY_TILE, id.y));
    if pixel.x >= view.size.x || pixel.y >= view.rows {
        return;
    }
    let texel = pixel.y * view.size.x + pixel.x;
    let direction = sphere_direction(view, vec2<f32>(pixel + vec2<u32>(0u, view.first_row)) + 0.5);
    let left = select(0.0, 1.0 - clouds[4u * texel + 3u], dot(direction, direction) > 0.0);
    let light = air_light(air, clamped, direction, backdrop.sun, backdrop.horizon, false).light;
    for (var i = 0u; i < 3u; i++) {
        output[3u * texel + i] = clouds[4u * texel + i] + left * light[i];
    }
}
