// Cloud along the rays of a view from straight above or below: each is in one column.

@group(0) @binding(2) var thickness: texture_2d<f32>;

// What the pass binds after the cloud's shape.
const SHAPE_NEXT: u32 = 3u;

// The first number of a column is its path in cloud of the layer's extinction, whatever the layer's columns are. Bilinear by hand, as along
// other rays: filters of devices blend by coarse steps.
fn path_seen(base_uv: vec2<f32>, up: vec3<f32>, from_above: bool) -> Seen {
    let size = vec2<f32>(textureDimensions(thickness));
    let place = fract(base_uv + frame.place.offset_uv) * size - 0.5;
    let low = floor(place);
    let texels = gather_periodic(thickness, repeat, select(low, low + size, low < vec2<f32>(0.0)));
    let rows = mix(texels.xz, texels.yw, place.x - low.x);
    return Seen(mix(rows.x, rows.y, place.y - low.y), base_uv);
}
