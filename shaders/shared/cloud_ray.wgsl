// A view ray through a layer, as a slab.
struct ViewRay {
    seen: vec3<f32>,    // towards the viewer
    hit_uv: vec2<f32>,  // where it shows the cloud: mean of what the viewer sees along it
    base_uv: vec2<f32>, // where it crosses the base plane, or begins within the layer
    cosine: f32,        // of its zenith
    path_m: f32,        // length of cloud along it
    depth: f32,         // optical depth of the slab at 550 nm
    from_above: bool,
    from_m: f32,        // height of base_uv above the base plane
    rise_m: f32,        // by how much it climbs within the layer
    way_uv: vec2<f32>,  // how far it goes over the map meanwhile
    level: f32,         // of the map, at which it is looked at
    steps: f32,         // samples for each texel of the level that it crosses
}

// The same ray of a slab of another optical depth.
fn deeper(ray: ViewRay, depth: f32) -> ViewRay {
    let path_m = depth / (frame.medium.extinction_550 * ray.cosine);
    return ViewRay(ray.seen, ray.hit_uv, ray.base_uv, ray.cosine, path_m, depth, ray.from_above, ray.from_m, ray.rise_m, ray.way_uv, ray.level, ray.steps);
}
