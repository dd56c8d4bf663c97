// Cloud along a view's ray, and the place at which the viewer sees it.
//
// A ray is followed exactly from the viewer's end on. One close to the horizon crosses more of the map than that may take: it ends
// where nothing more is seen, or after as many lines as a flat ray may cross. What then remains adds to the depth of the cloud, and hardly
// to what is seen: it is looked at on a level of the map on which the whole ray crosses a few texels.

@group(0) @binding(2) var thickness: texture_2d<f32>;
@group(0) @binding(3) var bounds: texture_2d<f32>;

const PATH_SEEN: bool = true;
// What the pass binds after the cloud's shape.
const SHAPE_NEXT: u32 = 4u;
// Lines that are crossed exactly, at most, in those of a march towards the sun.
const FLAT_MARCHES: u32 = 8u;
// Less than this is not seen.
const PATH_UNSEEN: f32 = 1e-4;
// Texels that the whole of a flat ray crosses on the level on which its rest is looked at.
const FLAT_TEXELS: f32 = 24.0;

// The ray crosses the base plane at base_uv and climbs along up. The map of flat rays has levels.
fn path_seen(base_uv: vec2<f32>, up: vec3<f32>, from_above: bool) -> Seen {
    let cosine = max(up.z, MIN_COSINE);
    let slope = path_slope(frame, up);
    let depth_m = frame.place.depth_m;
    let per_metre = frame.medium.extinction_550 / cosine;
    let flat = length(up.xy) > FLAT_SLOPE * cosine;
    let exact_m = depth_m / max(1.0, path_excess(thickness, frame, slope) / f32(FLAT_MARCHES));
    // From the viewer on.
    let near_uv = base_uv + select(vec2<f32>(0.0), slope * depth_m, from_above);
    let sense = select(1.0, -1.0, from_above);
    let way = Way(near_uv + frame.place.offset_uv, sense * slope, select(0.0, depth_m, from_above), exact_m, sense);
    let steps = path_most_steps(FLAT_MARCHES * frame.place.max_steps);
    let exact = path_stretch(thickness, bounds, repeat, way, per_metre, steps, select(0.0, PATH_UNSEEN, flat));
    var path_m = exact.path_m;
    // Weighted ways and weights.
    var met = exact.met;
    let rest_m = depth_m - exact.done_m;
    // Less than a millionth of the layer is rounding.
    if rest_m > 1e-6 * depth_m {
        let size = textureDimensions(thickness);
        let crossed = depth_m * length(slope) * f32(max(size.x, size.y));
        let level = min(ceil(log2(max(crossed / FLAT_TEXELS, 1.0))), f32(textureNumLevels(thickness)) - 1.0);
        let from_m = select(exact.done_m, 0.0, from_above);
        let rest = path_sampled(thickness, repeat, level, frame, base_uv + slope * from_m, up, from_m, rest_m, 1.0);
        path_m += rest.length_m * cosine;
        let met_m = exact.done_m + select(rest.low_m, rest_m - rest.high_m, from_above);
        met += exact.left * (1.0 - exp(-frame.medium.extinction_550 * rest.length_m)) * vec2<f32>(met_m, 1.0);
    }
    // Without cloud it is where the ray comes to the layer.
    return Seen(path_m / cosine, near_uv + sense * slope * met.x / max(met.y, 1e-30));
}
