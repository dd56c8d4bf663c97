// A Gaussian blur of a periodic map along one axis. Its weights add up to 1.
@group(0) @binding(0) var<uniform> blur: Blur;
@group(0) @binding(1) var map: texture_2d<f32>;
@group(0) @binding(2) var blurred_out: texture_storage_2d<r32float, write>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = vec2<i32>(textureDimensions(map));
    let here = vec2<i32>(id.xy);
    if any(here >= size) {
        return;
    }
    var sum = textureLoad(map, here, 0).x;
    var weights = 1.0;
    for (var i = 1; i <= blur.radius; i++) {
        let weight = exp(-blur.sharpness * f32(i * i));
        let ahead = (here + i * blur.axis) % size;
        let behind = (here - i * blur.axis + blur.radius * size) % size;
        sum += weight * (textureLoad(map, ahead, 0).x + textureLoad(map, behind, 0).x);
        weights += 2.0 * weight;
    }
    textureStore(blurred_out, here, vec4<f32>(sum / weights, 0.0, 0.0, 0.0));
}
