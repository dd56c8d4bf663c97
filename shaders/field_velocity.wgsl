// Velocity of the eddies at one moment, relative to their root mean square. Each band of wave numbers turns at a rate of
// its own; its texture holds the velocity at a quarter turn's distance twice (xy, zw). Free of divergence by
// construction: every mode blows along its own crests.
@group(0) @binding(0) var<uniform> eddies: Eddies;
@group(0) @binding(1) var band_0: texture_2d<f32>;
@group(0) @binding(2) var band_1: texture_2d<f32>;
@group(0) @binding(3) var band_2: texture_2d<f32>;
@group(0) @binding(4) var band_3: texture_2d<f32>;
@group(0) @binding(5) var velocity_out: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= textureDimensions(velocity_out)) {
        return;
    }
    let a = textureLoad(band_0, id.xy, 0);
    let b = textureLoad(band_1, id.xy, 0);
    let c = textureLoad(band_2, id.xy, 0);
    let d = textureLoad(band_3, id.xy, 0);
    let cosines = eddies.cosines;
    let sines = eddies.sines;
    let velocity = cosines.x * a.xy + sines.x * a.zw + cosines.y * b.xy + sines.y * b.zw
        + cosines.z * c.xy + sines.z * c.zw + cosines.w * d.xy + sines.w * d.zw;
    textureStore(velocity_out, id.xy, vec4<f32>(velocity, 0.0, 0.0));
}
