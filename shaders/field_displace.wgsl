// One step of the two layers of displacement (xy, zw), in domains: each is carried along by the eddies and grows by their
// motion (semi-Lagrangian, midpoint rule). A layer that is born in this step starts from nothing.
@group(0) @binding(0) var<uniform> motion: Step;
@group(0) @binding(1) var velocity: texture_2d<f32>;
@group(0) @binding(2) var before: texture_2d<f32>;
@group(0) @binding(3) var after_out: texture_storage_2d<rgba32float, write>;

// Bilinear with all digits: what a device's filter rounds would add up over the steps.
fn blended(map: texture_2d<f32>, uv: vec2<f32>) -> vec4<f32> {
    let size = vec2<i32>(textureDimensions(map));
    let place = uv * vec2<f32>(size) - 0.5;
    let part = place - floor(place);
    let low = ((vec2<i32>(floor(place)) % size) + size) % size;
    let high = (low + 1) % size;
    let top = mix(textureLoad(map, low, 0), textureLoad(map, vec2<i32>(high.x, low.y), 0), part.x);
    let bottom = mix(textureLoad(map, vec2<i32>(low.x, high.y), 0), textureLoad(map, high, 0), part.x);
    return mix(top, bottom, part.y);
}

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = textureDimensions(after_out);
    if any(id.xy >= size) {
        return;
    }
    let uv = (vec2<f32>(id.xy) + 0.5) / vec2<f32>(size);
    let middle = uv - 0.5 * motion.length_uv * textureLoad(velocity, id.xy, 0).xy;
    let moved = motion.length_uv * blended(velocity, middle).xy;
    let carried = motion.keep * blended(before, uv - moved);
    textureStore(after_out, id.xy, carried + vec4<f32>(moved, moved));
}
