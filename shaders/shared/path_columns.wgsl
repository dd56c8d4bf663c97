// Cloud along a ray through a layer whose columns have bases, tops and extinctions of their own (columns.wgsl).
//
// The ray is cut at the lines through texel centres, and each piece in two: within a half, heights and optical depth are
// taken to change evenly, which leaves out a quarter of how much a bilinear map bends along a diagonal. Blocks of texels
// without cloud at the ray's height are crossed at once: their bounds are the lowest base and the highest top.

// It ends early where less than `unseen` is left of light along it.
fn path_stretch(
    map: texture_2d<f32>,
    bounds: texture_2d<f32>,
    repeat: sampler,
    way: Way,
    per_metre: f32,
    most_steps: u32,
    unseen: f32,
) -> Stretch {
    let size = vec2<f32>(textureDimensions(map));
    // Flat rays look at a wide block first, once each time they come into one; for others that only costs.
    let coarsest = textureNumLevels(bounds) - 1u;
    let wide_side = f32(BOUNDS_TEXELS << coarsest);
    let flat = PATH_SEEN && unseen > 0.0 && coarsest > 0u;
    var tried = vec2<f32>(-1.0);
    var place = fract(way.start_uv) * size - 0.5;
    let slope = way.uv_per_metre * size;
    let forward = slope > vec2<f32>(0.0);
    // A ray along a line never meets another.
    let pitch = 1.0 / max(abs(slope), vec2<f32>(1e-12));
    var cell = path_cell(place, forward);
    var found = Stretch(0.0, 1.0, vec2<f32>(0.0), 0.0);
    var done_m = 0.0;
    for (var i = 0u; i < most_steps && done_m < way.way_m && found.left >= unseen; i++) {
        let tiles = size * floor((cell + 0.5) / size);
        cell -= tiles;
        place -= tiles;
        let wide_block = floor(cell / wide_side);
        let wide = flat && any(wide_block != tried);
        let block = path_block(bounds, select(0u, coarsest, wide), cell, way, done_m);
        if wide && !(block.before || block.after) {
            tried = wide_block;
            continue;
        }
        let corner = floor(cell / block.side) * block.side;
        let end = path_end(place, corner, block.side, pitch, forward);
        let next_m = clamp(min(end.x, end.y), done_m, select(way.way_m, min(block.first_m, way.way_m), block.before));
        let next_place = place + slope * next_m;
        if !(block.before || block.after) {
            let low = vec2<i32>(cell);
            let high = select(low + 1, vec2<i32>(0), low + 1 >= vec2<i32>(size));
            let north_west = textureLoad(map, low, 0);
            let north_east = textureLoad(map, vec2<i32>(high.x, low.y), 0);
            let south_west = textureLoad(map, vec2<i32>(low.x, high.y), 0);
            let south_east = textureLoad(map, high, 0);
            let enters = place + slope * done_m - cell;
            let leaves = next_place - cell;
            let halfway = 0.5 * (enters + leaves);
            let middle_m = 0.5 * (done_m + next_m);
            let first = mix(mix(north_west, north_east, enters.x), mix(south_west, south_east, enters.x), enters.y);
            let middle = mix(mix(north_west, north_east, halfway.x), mix(south_west, south_east, halfway.x), halfway.y);
            let last = mix(mix(north_west, north_east, leaves.x), mix(south_west, south_east, leaves.x), leaves.y);
            path_add(&found, first, middle, vec2<f32>(done_m, middle_m), way, per_metre);
            path_add(&found, middle, last, vec2<f32>(middle_m, next_m), way, per_metre);
        }
        let beyond = select(corner - 1.0, corner + block.side, forward);
        let within = clamp(path_cell(next_place, forward), corner, corner + block.side - 1.0);
        cell = select(within, beyond, end <= vec2<f32>(next_m));
        done_m = next_m;
    }
    found.done_m = done_m;
    return found;
}

// Adds a piece between two places of the way.
fn path_add(
    found: ptr<function, Stretch>,
    first: vec4<f32>,
    last: vec4<f32>,
    ends_m: vec2<f32>,
    way: Way,
    per_metre: f32,
) {
    let piece = column_piece(first, last, way.from_m + way.sense * ends_m);
    let inside_m = (piece.ends.y - piece.ends.x) * (ends_m.y - ends_m.x);
    let path_m = piece.density * inside_m;
    if path_m <= 0.0 {
        return;
    }
    (*found).path_m += path_m;
    if PATH_SEEN {
        let x = per_metre * path_m;
        let passing = exp(-x);
        let kept = select(1.0 - passing, x * (1.0 - 0.5 * x), x < 1e-3);
        let enter_m = mix(ends_m.x, ends_m.y, piece.ends.x);
        (*found).met += (*found).left * kept * vec2<f32>(enter_m + inside_m * path_mean_depth(x), 1.0);
        (*found).left *= passing;
    }
}
