// Cloud along a view's ray, and the place at which the viewer sees it.
//
// A ray close to the horizon crosses more of the map than one march may. It is marched exactly from the viewer's end on, a stretch
// of max_steps cuts after the other, until nothing more is seen or PATH_STRETCHES of them are done. What then remains adds to the
// depth of the cloud, and hardly to what is seen: it climbs as far on a shorter way over the map, which stands for the whole.

struct Seen {
    length_m: f32,     // of cloud of the layer's extinction
    hit_uv: vec2<f32>, // mean place of what the viewer sees
}

// Exact stretches of a ray, at most.
const PATH_STRETCHES: u32 = 8u;
// Less than this is not seen.
const PATH_UNSEEN: f32 = 1e-4;

// The ray crosses the base plane at base_uv and climbs along up.
fn path_seen(
    map: texture_2d<f32>,
    bounds: texture_2d<f32>,
    repeat: sampler,
    frame: Frame,
    base_uv: vec2<f32>,
    up: vec3<f32>,
    from_above: bool,
) -> Seen {
    let cosine = max(up.z, MIN_COSINE);
    let slope = path_slope(frame, up);
    let depth_m = frame.place.depth_m;
    let stretch_m = depth_m / max(1.0, path_excess(map, frame, slope));
    let per_metre = frame.medium.extinction_550 / cosine;
    var path_m = 0.0;
    var left = 1.0;
    // Weighted places and weights.
    var met = vec3<f32>(0.0);
    var done_m = 0.0;
    for (var i = 0u; i <= PATH_STRETCHES && done_m < depth_m; i++) {
        let rest_m = depth_m - done_m;
        let last = i == PATH_STRETCHES || left < PATH_UNSEEN;
        let rise_m = select(min(stretch_m, rest_m), rest_m, last);
        let way = slope / max(1.0, rise_m / stretch_m);
        // At its end before the viewer it goes on from where the one before ended.
        let start = base_uv + select(slope * done_m, slope * (depth_m - done_m) - way * rise_m, from_above);
        let from_m = select(done_m, depth_m - done_m - rise_m, from_above);
        let shift = frame.place.offset_uv;
        let part = path_stretch(map, bounds, repeat, start + shift, way, from_m, rise_m, per_metre, frame.place.max_steps);
        let seen = select(part.low, part.high, from_above);
        met += left * vec3<f32>(start * seen.y + way * seen.x, seen.y);
        left *= part.left;
        path_m += part.path_m;
        done_m += rise_m;
    }
    // Without cloud it is where the ray comes to the layer.
    let near = base_uv + slope * select(0.0, depth_m, from_above);
    return Seen(path_m / cosine, select(near, met.xy / max(met.z, 1e-30), met.z > 0.0));
}
