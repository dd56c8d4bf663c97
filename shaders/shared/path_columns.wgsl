// Cloud along a ray through a layer whose columns have bases, tops and extinctions of their own (columns.wgsl).
//
// The ray is cut at the lines through texel centres, and each piece in two: within a half, heights and optical depth are
// taken to change evenly, which leaves out a quarter of how much a bilinear map bends along a diagonal. Blocks of texels
// without cloud at the ray's height are crossed at once: their bounds are the lowest base and the highest top.

// A ray from a height above the base plane to another, at start_uv, that goes so far for each metre of height.
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
    var place = fract(start_uv) * size - 0.5;
    let slope = uv_per_metre * size;
    let forward = slope > vec2<f32>(0.0);
    // A ray along a line never meets another.
    let pitch = 1.0 / max(abs(slope), vec2<f32>(1e-12));
    var cell = path_cell(place, forward);
    let block_side = f32(BOUNDS_TEXELS);
    var sums = Stretch(0.0, 1.0, vec2<f32>(0.0), vec2<f32>(0.0));
    var height_m = 0.0;
    // Steps end cells, blocks, or what lies below all bases of a block: fewer of the latter two than half the cells.
    for (var i = 0u; i < most_steps + most_steps / 2u + 8u && height_m < way_m; i++) {
        let tiles = size * floor((cell + 0.5) / size);
        cell -= tiles;
        place -= tiles;
        let block = floor(cell / block_side);
        let between = textureLoad(bounds, vec2<i32>(block), 0).xy - from_m;
        let below = height_m < between.x;
        let clear = below || height_m >= between.y;
        let side = select(1.0, block_side, clear);
        let corner = select(cell, block * block_side, clear);
        let end = path_end(place, corner, side, pitch, forward);
        let next_m = clamp(min(end.x, end.y), height_m, select(way_m, min(between.x, way_m), below));
        let next_place = place + slope * next_m;
        if !clear {
            let low = vec2<i32>(cell);
            let high = (low + 1) % vec2<i32>(size);
            let north_west = textureLoad(map, low, 0);
            let north_east = textureLoad(map, vec2<i32>(high.x, low.y), 0);
            let south_west = textureLoad(map, vec2<i32>(low.x, high.y), 0);
            let south_east = textureLoad(map, high, 0);
            let enters = place + slope * height_m - cell;
            let leaves = next_place - cell;
            let halfway = 0.5 * (enters + leaves);
            let middle_m = 0.5 * (height_m + next_m);
            let first = mix(mix(north_west, north_east, enters.x), mix(south_west, south_east, enters.x), enters.y);
            let middle = mix(mix(north_west, north_east, halfway.x), mix(south_west, south_east, halfway.x), halfway.y);
            let last = mix(mix(north_west, north_east, leaves.x), mix(south_west, south_east, leaves.x), leaves.y);
            path_add(&sums, first, middle, vec2<f32>(height_m, middle_m), from_m, per_metre);
            path_add(&sums, middle, last, vec2<f32>(middle_m, next_m), from_m, per_metre);
        }
        let beyond = select(corner - 1.0, corner + side, forward);
        cell = select(clamp(path_cell(next_place, forward), corner, corner + side - 1.0), beyond, end <= vec2<f32>(next_m));
        height_m = next_m;
    }
    return sums;
}

// Adds a piece between two heights above the start.
fn path_add(
    sums: ptr<function, Stretch>,
    first: vec4<f32>,
    last: vec4<f32>,
    heights_m: vec2<f32>,
    from_m: f32,
    per_metre: f32,
) {
    let piece = column_piece(first, last, heights_m + from_m);
    let inside_m = (piece.ends.y - piece.ends.x) * (heights_m.y - heights_m.x);
    let path_m = piece.density * inside_m;
    if path_m <= 0.0 {
        return;
    }
    (*sums).path_m += path_m;
    if PATH_SEEN {
        let x = per_metre * path_m;
        let passing = exp(-x);
        let kept = select(1.0 - passing, x * (1.0 - 0.5 * x), x < 1e-3);
        let enter_m = mix(heights_m.x, heights_m.y, piece.ends.x);
        let met_m = inside_m * path_mean_depth(x);
        (*sums).low += (*sums).left * kept * vec2<f32>(enter_m + met_m, 1.0);
        (*sums).high = passing * (*sums).high + kept * vec2<f32>(enter_m + inside_m - met_m, 1.0);
        (*sums).left *= passing;
    }
}
