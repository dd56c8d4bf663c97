// What every method of slab light reads of a layer, and where it draws. Bindings 2 and 3 are the cloud's shape, as the view looks at it.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> view: CloudView;
@group(0) @binding(4) var transmittance: texture_2d<f32>;
@group(0) @binding(5) var reflectance: texture_2d<f32>;
@group(0) @binding(6) var from_below: texture_2d<f32>;
@group(0) @binding(7) var from_above: texture_2d<f32>;
@group(0) @binding(8) var sun_share: texture_2d<f32>;
@group(0) @binding(9) var repeat: sampler;
@group(0) @binding(10) var clamped: sampler;
@group(0) @binding(11) var<storage, read_write> output: array<f32>;
@group(0) @binding(12) var behind: texture_2d<f32>; // even light beyond all layers that are drawn
@group(0) @binding(13) var<storage, read_write> held: array<vec3<f32>>; // by what lies before: see left_of

// Parts of even light that a slab as deep as the ray's cloud sends back and lets through.
fn slab_reflects(ray: ViewRay) -> vec3<f32> {
    return slab_reflectance(reflectance, clamped, ray.depth, ray.cosine);
}

fn slab_lets_through(ray: ViewRay) -> vec3<f32> {
    return slab_transmittance(transmittance, clamped, ray.depth, ray.cosine);
}
