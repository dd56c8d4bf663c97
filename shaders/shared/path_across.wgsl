// Cloud along the sun's rays, as maps of sunlight take it: these are means over some texels of a layer's map, of which each is looked at in
// two places. A row of looks there leaves far more open than what is between two lines, so that a ray looks at columns only where it crosses
// a line through texel centres, across the axis along which it goes faster: the map is linear there, and from line to line heights and optical
// depth are taken to change evenly.

// Length of cloud of the layer's extinction along a ray that starts from_m above the base, at start_uv, and climbs along up (unit vector,
// up.z > 0). One that would be cut too often goes a shorter way over the map (march.wgsl).
fn path_across(
    map: texture_2d<f32>,
    bounds: texture_2d<f32>,
    frame: Frame,
    start_uv: vec2<f32>,
    up: vec3<f32>,
    from_m: f32,
) -> f32 {
    let whole = path_slope(frame, up);
    let size = vec2<f32>(textureDimensions(map));
    // Texels for each metre of height, along the axis whose lines are met, and across.
    let texels = whole / max(1.0, path_excess(map, frame, whole)) * size;
    let flipped = abs(texels.y) > ACROSS_TIE * abs(texels.x);
    let slope = select(texels, texels.yx, flipped);
    let sides = select(size, size.yx, flipped);
    let forward = slope.x > 0.0;
    let sense = select(-1.0, 1.0, forward);
    let pitch_m = 1.0 / max(abs(slope.x), 1e-9);
    // Across from line to line.
    let turn = slope.y * pitch_m;
    let place = fract(start_uv + frame.place.offset_uv) * size - 0.5;
    let start = select(place, place.yx, flipped);
    let way_m = frame.place.depth_m - from_m;
    var before = across_start(map, place, size);
    var line = select(ceil(start.x) - 1.0, floor(start.x) + 1.0, forward);
    var across = start.y + turn * abs(line - start.x);
    var next_m = pitch_m * abs(line - start.x);
    var done_m = 0.0;
    var sum_m = 0.0;
    // Whether up to the next line there is no cloud.
    var clear = false;
    for (var i = 0u; i <= frame.place.max_steps + 2u && done_m < way_m; i++) {
        // In the tile where the ray is.
        line -= sides.x * floor((line + 0.5) / sides.x);
        across -= sides.y * floor((across + 0.5) / sides.y);
        let part = across - floor(across);
        let low = select(floor(across), sides.y - 1.0, across < 0.0);
        let high = select(low + 1.0, 0.0, low + 1.5 > sides.y);
        let one = textureLoad(map, vec2<i32>(select(vec2<f32>(line, low), vec2<f32>(low, line), flipped)), 0);
        let other = textureLoad(map, vec2<i32>(select(vec2<f32>(line, high), vec2<f32>(high, line), flipped)), 0);
        let after = mix(one, other, part);
        if !clear {
            sum_m += (next_m - done_m) * across_cloud(before, after, from_m + vec2<f32>(done_m, next_m));
        }
        before = after;
        done_m = next_m;
        // As far as all that may be in the block of texels ahead is below the ray, or above it.
        let ahead = select(line - 1.0, line, forward);
        let cell = vec2<f32>(select(ahead, ahead + sides.x, ahead < 0.0), low);
        let block = floor(cell / f32(BOUNDS_TEXELS));
        let inside = cell - block * f32(BOUNDS_TEXELS);
        let ends = across_ends(textureLoad(bounds, vec2<i32>(select(block, block.yx, flipped)), 0).xy) - from_m;
        let along_left = select(inside.x + 1.0, f32(BOUNDS_TEXELS) - inside.x, forward);
        let across_left = select(inside.y + part, f32(BOUNDS_TEXELS) - inside.y - part, turn > 0.0);
        let lines = min(along_left, floor(across_left / max(abs(turn), 1e-6)));
        clear = lines >= 1.0 && (done_m >= ends.y || done_m + pitch_m * lines <= ends.x);
        let step = select(1.0, lines, clear);
        line += sense * step;
        across += turn * step;
        next_m = done_m + pitch_m * step;
    }
    return sum_m / max(up.z, MIN_COSINE);
}

// A way that is as fast on both axes counts as one along the first, however it is rounded.
const ACROSS_TIE: f32 = 1.0001;

// The map at a place given in texels from the first one's centre: between four of them, by hand, as filters of devices blend by coarse steps.
fn across_start(map: texture_2d<f32>, place: vec2<f32>, size: vec2<f32>) -> vec4<f32> {
    let below = floor(place);
    let low = vec2<i32>(select(below, size - 1.0, place < vec2<f32>(0.0)));
    let high = vec2<i32>(select(below + 1.0, vec2<f32>(0.0), below + 1.5 > size));
    let north = mix(textureLoad(map, low, 0), textureLoad(map, vec2<i32>(high.x, low.y), 0), place.x - below.x);
    let south = mix(textureLoad(map, vec2<i32>(low.x, high.y), 0), textureLoad(map, high, 0), place.x - below.x);
    return mix(north, south, place.y - below.y);
}
