// A cumulus layer on a plane over the domain: the texture cloud.
@group(0) @binding(CUMULUS_NEXT) var<uniform> view: View;
@group(0) @binding(CUMULUS_NEXT + 1u) var<storage, read_write> output: array<f32>;
@group(0) @binding(CUMULUS_NEXT + 2u) var<storage, read_write> held: array<vec3<f32>>;

// Of a texel's width, what of it a surface is drawn over.
const PLANE_SOFT: f32 = 0.7;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= view.size.x || id.y >= view.rows {
        return;
    }
    let texel = id.y * view.size.x + id.x;
    let at = 4u * texel;
    let before = vec4<f32>(output[at], output[at + 1u], output[at + 2u], output[at + 3u]);
    let projected = projection_ray(view, cumulus.extent_m, id.xy);
    let towards = -projected.seen;
    let perspective = view.perspective == 1u;
    // A parallel view looks from the plane on.
    let start = select(projected.position, view.eye, perspective);
    let up = select(towards.z, select(-1e-6, 1e-6, towards.z >= 0.0), abs(towards.z) < 1e-6);
    let ends = (vec2<f32>(cumulus.low_m, cumulus.top_m) - start.z) / up;
    let near_m = max(min(ends.x, ends.y), 0.0);
    let far_m = min(max(ends.x, ends.y), near_m + 64.0 * cumulus.extent_m);
    if near_m >= far_m {
        return;
    }
    let ray = CloudRay(start - vec3<f32>(cumulus.offset_m, 0.0), towards, towards, 0.0);
    let background = select(cumulus.below, cumulus.above, towards.z > 0.0);
    // No finer than a texel, where cubes of the volume are finer than that.
    let wide_m = min(cumulus.voxel_m, PLANE_SOFT * cumulus.extent_m / f32(view.size.x));
    let seen = cumulus_seen(ray, near_m, far_m, 0.0, wide_m, background);
    let alpha = cumulus_alpha(seen.depth);
    let left = 1.0 - before.a;
    let light = before.rgb + left * seen.radiance;
    output[at] = light.r;
    output[at + 1u] = light.g;
    output[at + 2u] = light.b;
    output[at + 3u] = before.a + left * alpha;
    if view.together == 1u {
        let held_before = held[texel];
        held[texel] = vec3<f32>(1.0 - (1.0 - held_before.xy) * (1.0 - alpha), held_before.z);
    }
}
