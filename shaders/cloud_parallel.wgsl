// Output: radiance that leaves the cloud towards the viewer, premultiplied, and alpha, of a parallel view. Sun and view are the same for all texels, so a
// slab's light is a function of its depth alone, whatever the method: cloud_slabs has made it.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> view: CloudView;
// What follows: the cloud's shape.
@group(0) @binding(SHAPE_NEXT) var<storage, read> slabs_of_view: array<vec4<f32>>;
@group(0) @binding(SHAPE_NEXT + 1u) var from_below: texture_2d<f32>;
@group(0) @binding(SHAPE_NEXT + 2u) var from_above: texture_2d<f32>;
@group(0) @binding(SHAPE_NEXT + 3u) var sun_share: texture_2d<f32>;
@group(0) @binding(SHAPE_NEXT + 4u) var repeat: sampler;
@group(0) @binding(SHAPE_NEXT + 5u) var<storage, read_write> output: array<f32>;
@group(0) @binding(SHAPE_NEXT + 6u) var behind: texture_2d<f32>; // even light beyond all layers that are drawn
@group(0) @binding(SHAPE_NEXT + 7u) var<storage, read_write> held: array<vec3<f32>>; // by what lies before: see left_of

// What comes after these.
const METHOD_NEXT: u32 = SHAPE_NEXT + 8u;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    cloud_texel(id.xy);
}

// One of the three vectors of a slab.
fn slab_of_view(depth: f32, which: u32) -> vec3<f32> {
    let octave = log2(max(depth, SLAB_DEPTH_MIN)) - SLAB_LOG2_DEPTH_MIN;
    let node = clamp(octave * SLABS_PER_OCTAVE, 0.0, f32(SLABS_COUNT - 1u));
    let low = min(u32(node), SLABS_COUNT - 2u);
    let at = 3u * low + which;
    return mix(slabs_of_view[at].rgb, slabs_of_view[at + 3u].rgb, node - f32(low));
}

fn slab_reflects(ray: ViewRay) -> vec3<f32> {
    return slab_of_view(ray.depth, 0u) * slab_thin_share(ray.depth);
}

fn slab_lets_through(ray: ViewRay) -> vec3<f32> {
    return mix(vec3<f32>(1.0), slab_of_view(ray.depth, 1u), slab_thin_share(ray.depth));
}

fn sunlight(ray: ViewRay) -> vec3<f32> {
    return slab_of_view(ray.depth, 2u) * slab_thin_share(ray.depth);
}
