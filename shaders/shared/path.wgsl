// Cloud along a ray through the layer: its length, and the height at which it is seen.
//
// The ray crosses the base plane at base_uv and climbs along up (unit vector, up.z > 0). Cloud fills base to
// base + thickness, thickness being the bilinear, periodic map. Between the lines through texel centres a bilinear map is
// a parabola along the ray: the part of the piece counts along which the ray is below it, so the length is exact.
//
// Most pieces need no look at the map: the bounds (field_bounds) of a block of texels tell how far up all of it is cloud,
// and from where on none of it is.
//
// Where the heights are not needed, the shader says so: PATH_SEEN is a constant of each.

// A ray from a height above the base to another, at start_uv, that goes so far for each metre of height.
fn path_stretch(
    map: texture_2d<f32>,
    bounds: texture_2d<f32>,
    repeat: sampler,
    start_uv: vec2<f32>,
    uv_per_metre: vec2<f32>,
    from_m: f32,
    way_m: f32,
    per_metre: f32,
    most_steps: u32,
) -> Stretch {
    let size = vec2<f32>(textureDimensions(map));
    // In texels from the first one's centre, in the tile where the ray is. A cell is a square between four centres, named by
    // its low corner.
    var place = fract(start_uv) * size - 0.5;
    let slope = uv_per_metre * size;
    let forward = slope > vec2<f32>(0.0);
    // A ray along a line never meets another.
    let pitch = 1.0 / max(abs(slope), vec2<f32>(1e-12));
    var cell = path_cell(place, forward);
    let block_side = f32(BOUNDS_TEXELS);
    var sum = 0.0;
    var left = 1.0;
    // Weighted heights and weights.
    var low = vec2<f32>(0.0);
    var high = vec2<f32>(0.0);
    var height_m = 0.0;
    // Steps end cells, blocks, or what lies below all tops of a block: fewer of the latter two than half the cells.
    for (var i = 0u; i < most_steps + most_steps / 2u + 8u && height_m < way_m; i++) {
        let tiles = size * floor((cell + 0.5) / size);
        cell -= tiles;
        place -= tiles;
        let block = floor(cell / block_side);
        let between = textureLoad(bounds, vec2<i32>(block), 0).xy - from_m;
        let below = height_m < between.x;
        let decided = below || height_m >= between.y;
        let side = select(1.0, block_side, decided);
        let corner = select(cell, block * block_side, decided);
        let end = path_end(place, corner, side, pitch, forward);
        let next_m = clamp(min(end.x, end.y), height_m, select(way_m, min(between.x, way_m), below));
        let next_place = place + slope * next_m;
        // Height of the cloud's top above the ray at both ends, and the part of the piece that is in cloud.
        var first = select(-1.0, 1.0, below);
        var last = first;
        var inside = select(0.0, 1.0, below);
        if !decided {
            let texels = gather_periodic(map, repeat, cell);
            let enters = place + slope * height_m - cell;
            let leaves = next_place - cell;
            first = path_bilinear(texels, enters) - from_m - height_m;
            last = path_bilinear(texels, leaves) - from_m - next_m;
            let middle = path_bilinear(texels, 0.5 * (enters + leaves)) - from_m - 0.5 * (height_m + next_m);
            inside = path_inside(first, middle, last);
        }
        if inside > 0.0 {
            // A ray leaves the piece's cloud at one of its ends, but for a hump or a hollow in the middle.
            let part_m = inside * (next_m - height_m);
            sum += part_m;
            if PATH_SEEN {
                let enter_m = select(next_m - part_m, height_m, first > 0.0);
                let leave_m = select(height_m + part_m, next_m, last > 0.0);
                let x = per_metre * part_m;
                let passing = exp(-x);
                let kept = select(1.0 - passing, x * (1.0 - 0.5 * x), x < 1e-3);
                let inside_m = part_m * path_mean_depth(x);
                low += left * kept * vec2<f32>(enter_m + inside_m, 1.0);
                high = passing * high + kept * vec2<f32>(leave_m - inside_m, 1.0);
                left *= passing;
            }
        }
        let beyond = select(corner - 1.0, corner + side, forward);
        cell = select(clamp(path_cell(next_place, forward), corner, corner + side - 1.0), beyond, end <= vec2<f32>(next_m));
        height_m = next_m;
    }
    return Stretch(sum, left, low, high);
}

// Value between the four texels of a cell, at a place from 0 to 1.
fn path_bilinear(texels: vec4<f32>, place: vec2<f32>) -> f32 {
    let rows = mix(texels.xz, texels.yw, place.x);
    return mix(rows.x, rows.y, place.y);
}

// Part of a piece along which a parabola is above 0, given its values at the start, in the middle and at the end.
fn path_inside(first: f32, middle: f32, last: f32) -> f32 {
    let least = min(first, min(middle, last));
    let most = max(first, max(middle, last));
    // a t^2 + b t + first, t from 0 to 1.
    let a = 2.0 * (first + last - 2.0 * middle);
    let b = 4.0 * middle - 3.0 * first - last;
    let straight = abs(a) <= 1e-4 * max(most, -least);
    let line = clamp(most / max(most - least, 1e-30), 0.0, 1.0);
    // The root without cancellation first; the other by their product.
    let inside = b * b - 4.0 * a * first;
    let root = sqrt(max(inside, 0.0));
    let q = -0.5 * (b + select(-root, root, b >= 0.0));
    let one = clamp(q / select(a, 1.0, straight), 0.0, 1.0);
    let other = clamp(first / select(q, 1.0, q == 0.0), 0.0, 1.0);
    let between = select(0.0, abs(one - other), inside > 0.0);
    return select(select(between, 1.0 - between, a > 0.0), line, straight);
}
