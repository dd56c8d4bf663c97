// Tiling noise on hashed lattices: the period of a lattice is a whole number, so tiles meet exactly.

// Standard deviation of noise_gradient, measured over many lattices.
const GRADIENT_NOISE_STD: f32 = 0.2151;

// Cycles per domain of the lowest octave of a field.
const NOISE_LOWEST_PERIOD: i32 = 3;

// Hash of a lattice point (Jarzynski and Olano 2020, "pcg2d").
fn noise_hash(x: u32, y: u32) -> vec2<u32> {
    var v = vec2<u32>(x, y) * 1664525u + 1013904223u;
    v.x += v.y * 1664525u;
    v.y += v.x * 1664525u;
    v ^= v >> vec2<u32>(16u);
    v.x += v.y * 1664525u;
    v.y += v.x * 1664525u;
    return v ^ (v >> vec2<u32>(16u));
}

// Two uniform numbers in [0, 1) for a lattice point of a periodic lattice.
fn noise_pair(cell: vec2<i32>, period: i32, seed: u32) -> vec2<f32> {
    // Whole numbers below 2^23 by floats: devices divide these many times as fast. The half keeps the quotient away from whole ones.
    let tiles = vec2<i32>(floor((vec2<f32>(cell) + 0.5) / f32(period)));
    let wrapped = vec2<u32>(cell - period * tiles);
    let salt = noise_hash(seed, 0x9e3779b9u);
    let bits = noise_hash(wrapped.x ^ salt.x, wrapped.y ^ salt.y);
    return vec2<f32>(bits >> vec2<u32>(8u)) / 16777216.0;
}

fn noise_slope(cell: vec2<i32>, period: i32, seed: u32, from_cell: vec2<f32>) -> f32 {
    let angle = 2.0 * PI * noise_pair(cell, period, seed).x;
    return cos(angle) * from_cell.x + sin(angle) * from_cell.y;
}

// Gradient noise (Perlin 2002: quintic fade), mean 0, at a place in lattice units.
fn noise_gradient(place: vec2<f32>, period: i32, seed: u32) -> f32 {
    let cell = vec2<i32>(floor(place));
    let t = place - floor(place);
    let fade = t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let a = noise_slope(cell, period, seed, t);
    let b = noise_slope(cell + vec2<i32>(1, 0), period, seed, t - vec2<f32>(1.0, 0.0));
    let c = noise_slope(cell + vec2<i32>(0, 1), period, seed, t - vec2<f32>(0.0, 1.0));
    let d = noise_slope(cell + vec2<i32>(1, 1), period, seed, t - vec2<f32>(1.0, 1.0));
    return mix(mix(a, b, fade.x), mix(c, d, fade.x), fade.y);
}

// Gradient noise on a turned lattice: (a, b) of its steps along a row of the tile, (-b, a) along a column. Points of the lattice
// that the tile's sides lead to are the same: those with the same b x - a y modulo a^2 + b^2, where a and b have no common divisor.
fn noise_turned(uv: vec2<f32>, turn: vec2<i32>, seed: u32) -> f32 {
    let along = vec2<f32>(turn);
    let place = vec2<f32>(along.x * uv.x - along.y * uv.y, along.y * uv.x + along.x * uv.y);
    let cell = vec2<i32>(floor(place));
    let t = place - floor(place);
    let fade = t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let points = turn.x * turn.x + turn.y * turn.y;
    let salt = noise_hash(seed, 0x9e3779b9u);
    var slopes = vec4<f32>(0.0);
    for (var i = 0; i < 4; i++) {
        let corner = vec2<i32>(i & 1, i >> 1u);
        let step = cell + corner;
        let point = ((turn.y * step.x - turn.x * step.y) % points + points) % points;
        let bits = noise_hash(u32(point) ^ salt.x, salt.y);
        let angle = 2.0 * PI * (f32(bits.x >> 8u) / 16777216.0);
        let from_corner = t - vec2<f32>(corner);
        slopes[i] = cos(angle) * from_corner.x + sin(angle) * from_corner.y;
    }
    return mix(mix(slopes.x, slopes.y, fade.x), mix(slopes.z, slopes.w, fade.x), fade.y);
}

// Feature point of a cell, inside it. It goes round in a circle, one to three times in either sense while the slowest
// goes once.
fn noise_point(cell: vec2<i32>, period: i32, seed: u32, turns: f32) -> vec2<f32> {
    let way = noise_pair(cell, period, seed + 1u);
    let times = (1.0 + floor(3.0 * way.x)) * select(-1.0, 1.0, way.y < 0.5);
    let angle = 2.0 * PI * fract(2.0 * way.y + times * turns);
    return 0.15 + 0.7 * noise_pair(cell, period, seed) + 0.15 * vec2<f32>(cos(angle), sin(angle));
}

// Distance to the second nearest feature point minus that to the nearest, cell units (Worley 1996).
fn noise_cell_edge(place: vec2<f32>, period: i32, seed: u32, turns: f32) -> f32 {
    let cell = vec2<i32>(floor(place));
    let t = place - floor(place);
    var nearest = 9.0;
    var second = 9.0;
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            let neighbour = vec2<i32>(x, y);
            let away = length(vec2<f32>(neighbour) + noise_point(cell + neighbour, period, seed, turns) - t);
            second = min(second, max(nearest, away));
            nearest = min(nearest, away);
        }
    }
    return second - nearest;
}
