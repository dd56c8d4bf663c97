// Light from the ground that arrives at the cloud base.
@group(0) @binding(0) var<uniform> exchange: Exchange;
@group(0) @binding(1) var up: texture_2d<f32>;
@group(0) @binding(2) var repeat: sampler;
@group(0) @binding(3) var arriving_out: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= exchange.texels || id.y >= exchange.texels {
        return;
    }
    let uv = (vec2<f32>(id.xy) + 0.5) / f32(exchange.texels);
    textureStore(arriving_out, id.xy, vec4<f32>(gather_light(up, repeat, exchange, uv), 0.0));
}
