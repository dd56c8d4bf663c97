// Cloud along a ray through the layer: its length, and the height at which it is seen.
//
// The ray crosses the base plane at base_uv and climbs along up (unit vector, up.z > 0). Cloud fills base to
// base + thickness, thickness being the bilinear, periodic map. Between the lines through texel centres a bilinear map is
// a parabola along the ray: the part of the piece counts along which the ray is below it, so the length is exact.
//
// Most pieces need no look at the map: the bounds (field_bounds) of a block of texels tell how far up all of it is cloud,
// and from where on none of it is.
//
// Where what is seen is not needed, the shader says so: PATH_SEEN is a constant of each.

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
    // In texels from the first one's centre, in the tile where the ray is. A cell is a square between four centres, named by
    // its low corner.
    var place = fract(way.start_uv) * size - 0.5;
    let slope = way.uv_per_metre * size;
    let forward = slope > vec2<f32>(0.0);
    // A ray along a line never meets another.
    let pitch = 1.0 / max(abs(slope), vec2<f32>(1e-12));
    var cell = path_cell(place, forward);
    var sum = 0.0;
    var left = 1.0;
    // Weighted ways and weights.
    var met = vec2<f32>(0.0);
    var done_m = 0.0;
    for (var i = 0u; i < most_steps && done_m < way.way_m && left >= unseen; i++) {
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
        var next_m = clamp(min(end.x, end.y), done_m, select(way.way_m, min(block.first_m, way.way_m), block.before));
        let next_place = place + slope * next_m;
        // Height of the cloud's top above the ray at both ends, and the part of the piece that is in cloud.
        let cloud = select(block.after, block.before, way.sense > 0.0);
        var first = select(-1.0, 1.0, cloud);
        var last = first;
        var inside = select(0.0, 1.0, cloud);
        if !(block.before || block.after) {
            let texels = gather_periodic(map, repeat, cell);
            let enters = place + slope * done_m - cell;
            let leaves = next_place - cell;
            first = path_bilinear(texels, enters) - way.from_m - way.sense * done_m;
            last = path_bilinear(texels, leaves) - way.from_m - way.sense * next_m;
            let middle = path_bilinear(texels, 0.5 * (enters + leaves)) - way.from_m - way.sense * 0.5 * (done_m + next_m);
            inside = path_inside(first, middle, last);
        }
        if inside > 0.0 {
            // A ray leaves the piece's cloud at one of its ends, but for a hump or a hollow in the middle.
            var part_m = inside * (next_m - done_m);
            let enter_m = select(next_m - part_m, done_m, first > 0.0);
            if PATH_SEEN && unseen > 0.0 {
                // No further than enough is hidden: blocks are wide, and neighbours are to end alike.
                let enough_m = (log(left / unseen) + 0.01) / per_metre;
                next_m = select(next_m, enter_m + enough_m, enough_m < part_m);
                part_m = min(part_m, enough_m);
            }
            sum += part_m;
            if PATH_SEEN {
                let x = per_metre * part_m;
                let passing = exp(-x);
                let kept = select(1.0 - passing, x * (1.0 - 0.5 * x), x < 1e-3);
                met += left * kept * vec2<f32>(enter_m + part_m * path_mean_depth(x), 1.0);
                left *= passing;
            }
        }
        let beyond = select(corner - 1.0, corner + block.side, forward);
        let within = clamp(path_cell(next_place, forward), corner, corner + block.side - 1.0);
        cell = select(within, beyond, end <= vec2<f32>(next_m));
        done_m = next_m;
    }
    return Stretch(sum, left, met, done_m);
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
