// One mip level of a layer's map from the one before it: the mean over what a texel covers, so that all cloud is kept. Sides
// that do not halve evenly are cut where the texels of the level end.
@group(0) @binding(0) var fine: texture_2d<f32>;

// Texels of the finer level that one covers, an axis, at most: its side is less than three of theirs.
const COVERED: u32 = 4u;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = textureDimensions(coarse);
    if any(id.xy >= size) {
        return;
    }
    let from_size = textureDimensions(fine);
    let first = id.xy * from_size / size;
    // Ends of the texel on each axis, in texels of the finer level.
    let ratio = vec2<f32>(from_size) / vec2<f32>(size);
    let low = vec2<f32>(id.xy) * ratio;
    let high = low + ratio;
    var sum = vec4<f32>(0.0);
    var covered = 0.0;
    for (var y = 0u; y < COVERED; y++) {
        for (var x = 0u; x < COVERED; x++) {
            let at = first + vec2<u32>(x, y);
            let overlap = max(min(vec2<f32>(at + 1u), high) - max(vec2<f32>(at), low), vec2<f32>(0.0));
            let weight = overlap.x * overlap.y;
            sum += weight * textureLoad(fine, min(at, from_size - 1u), 0);
            covered += weight;
        }
    }
    textureStore(coarse, id.xy, sum / covered);
}
