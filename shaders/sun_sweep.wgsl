// Cloud along the rays towards places on the sun's disc, from all over a layer's base: a row of rays an invocation, at a cost that
// depends neither on how far they go nor on how much cloud they meet.
//
// A ray that starts at s meets the top of the column at u where it has climbed as high: s = u - height * per_metre. So what lies between two
// lines is met by all rays that start between there and the lines themselves, as a ramp from none to all of it over the starts from which one of
// the lines and the other are seen. Ramps are sums of sums: each is four numbers, and the rays' sums are made of all at once.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> disc: Disc;
@group(0) @binding(2) var thickness: texture_2d<f32>;
// In the end floats: how far along each ray is in cloud of the layer's extinction, from start to start 1.
@group(0) @binding(3) var<storage, read_write> swept: array<i32>;

// A row of rays.
struct Row {
    first: u32, // of its numbers
    last: i32,  // ray that starts in it
}

fn row_number(row: Row, at: i32) -> u32 {
    return row.first + u32(at) * SWEEP_STRIP;
}

@compute @workgroup_size(64, 1, 1)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.y >= disc.directions {
        return;
    }
    let way = disc.ways[id.y];
    let size = sweep_size(thickness, way);
    if i32(id.x) >= size.y {
        return;
    }
    let row = Row(sweep_number(sweep_rows(thickness), id.y, id.x, 0u), size.x * i32(disc.between));
    for (var i = 0; i < row.last + 2; i++) {
        swept[row_number(row, i)] = 0;
    }
    // Beyond, nothing is met by a ray that starts in the row.
    let ends = size.x + i32(ceil(frame.place.depth_m * way.per_metre / f32(disc.between)));
    var first = column_at(way, size, id.x, 0);
    for (var i = 0; i < ends; i++) {
        let other = column_at(way, size, id.x, i + 1);
        if max(first.x, other.x) > 0.0 {
            sweep_add(row, i, first, other, way.per_metre);
        }
        first = other;
    }
    var rise = 0;
    var sum = 0;
    for (var i = 0; i <= row.last; i++) {
        let at = row_number(row, i);
        rise += swept[at];
        sum += rise;
        swept[at] = bitcast<i32>(f32(sum) / SWEEP_PARTS);
    }
}

// The column where a row crosses a line.
fn column_at(way: DiscWay, size: vec2<i32>, row: u32, i: i32) -> vec4<f32> {
    let along = f32(select(i, size.x - 1 - i, way.backwards == 1u));
    // Lines go through the centres of texels, where the map is bent.
    let place = vec2<f32>(along / f32(disc.lines), (f32(row) + way.across * f32(i) + 0.5) / f32(disc.fine) - 0.5);
    let low = vec2<i32>(floor(place));
    let part = place - floor(place);
    let near = mix(texel_at(way, low), texel_at(way, low + vec2<i32>(1, 0)), part.x);
    let far = mix(texel_at(way, low + vec2<i32>(0, 1)), texel_at(way, low + 1), part.x);
    return mix(near, far, part.y);
}

fn texel_at(way: DiscWay, place: vec2<i32>) -> vec4<f32> {
    let flipped = way.flipped == 1u;
    let map = vec2<i32>(textureDimensions(thickness));
    let size = select(map, map.yx, flipped);
    let tiles = floor((vec2<f32>(place) + 0.5) / vec2<f32>(size));
    let at = place - vec2<i32>(tiles) * size;
    return textureLoad(thickness, select(at, at.yx, flipped), 0);
}

// Adds what is met by rays that start beyond `seen_from`, by those between the two a part of it.
fn sweep_ramp(row: Row, seen_from: vec2<f32>, weight: i32) {
    let low = min(seen_from.x, seen_from.y);
    let high = max(seen_from.x, seen_from.y);
    let width = max(high - low, 1e-6);
    // The first ray that meets any of it, and the first that meets all.
    let begin = max(i32(floor(low)) + 1, 0);
    let end = max(i32(ceil(high)), begin);
    let met = i32(round(f32(weight) * min((f32(begin) - low) / width, 1.0)));
    let each = select(0, i32(round(f32(weight) / width)), end > begin);
    let rest = weight - met - each * max(end - begin - 1, 0);
    sweep_count(row, begin, met);
    sweep_count(row, begin + 1, each - met);
    sweep_count(row, end, rest - each);
    sweep_count(row, end + 1, -rest);
}

fn sweep_count(row: Row, at: i32, count: i32) {
    swept[row_number(row, min(at, row.last + 1))] += count;
}
