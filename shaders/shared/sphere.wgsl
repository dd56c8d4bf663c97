// Directions of the texels of a view of the whole sky, and rays over a curved Earth.
//
// Heights are those above the ground, which is a sphere. Differences of large numbers are never taken: in single precision
// the height on a ray, the horizon's dip and the distance to the ground would lose most of their digits.

const EARTH_RADIUS_M: f32 = 6371000.0;
// Kinds of view, as the host numbers them.
const SPHERE_EQUIRECT: u32 = 0u;
const SPHERE_OCTAHEDRAL: u32 = 1u;
const SPHERE_CUBE: u32 = 2u;
const SPHERE_FISHEYE: u32 = 3u;
// A ray that rises by less over a layer is taken to rise so much, metres.
const LEAST_RISE_M: f32 = 0.01;

// Texels a side of a tile of the picture, and the pixel of a tile that is named by its column and, above 16 bits, row.
const SKY_TILE: u32 = 16u;

fn sky_pixel(tile: u32, inside: vec2<u32>) -> vec2<u32> {
    return SKY_TILE * vec2<u32>(tile & 0xffffu, tile >> 16u) + inside;
}

// Sine of a quarter turn times x, x from -1 to 1: drivers' own may be off by 2^-11.
fn quarter_sine(x: f32) -> f32 {
    let s = x * x;
    return x * (1.57079632 - s * (0.64596409 - s * (0.07969262 - s * (0.00468175 - s * (0.00016044 - s * 3.5986e-6)))));
}

// Sine and cosine of so many turns.
fn turn(turns: f32) -> vec2<f32> {
    // Quarters from -2 to 2.
    let quarters = 4.0 * (turns - round(turns));
    let folded = select(quarters, sign(quarters) * 2.0 - quarters, abs(quarters) > 1.0);
    return vec2<f32>(quarter_sine(folded), quarter_sine(1.0 - abs(quarters)));
}

// Direction at a place of the picture, in texels from its upper left corner: east, north, up. Nothing (0, 0, 0) where the
// picture shows none.
fn sphere_direction(view: SkyView, texels: vec2<f32>) -> vec3<f32> {
    let place = texels / vec2<f32>(view.size);
    let right = 2.0 * place.x - 1.0;
    let top = 1.0 - 2.0 * place.y;
    switch view.kind {
        case SPHERE_EQUIRECT: {
            let around = turn(view.first_turn + view.turns * place.x);
            let level = quarter_sine(1.0 - abs(top));
            return vec3<f32>(level * around, quarter_sine(top));
        }
        case SPHERE_OCTAHEDRAL: {
            let up = 1.0 - abs(right) - abs(top);
            let far = max(-up, 0.0);
            let flat = vec2<f32>(right, top);
            return normalize(vec3<f32>(flat - select(vec2<f32>(-far), vec2<f32>(far), flat >= vec2<f32>(0.0)), up));
        }
        case SPHERE_CUBE: {
            let face = min(u32(6.0 * place.y), 5u);
            let down = 2.0 * (6.0 * place.y - f32(face)) - 1.0;
            var axis = vec3<f32>(1.0, -down, -right);
            switch face {
                case 1u: { axis = vec3<f32>(-1.0, -down, right); }
                case 2u: { axis = vec3<f32>(right, 1.0, down); }
                case 3u: { axis = vec3<f32>(right, -1.0, -down); }
                case 4u: { axis = vec3<f32>(right, -down, 1.0); }
                case 5u: { axis = vec3<f32>(-right, -down, -1.0); }
                default: {}
            }
            return normalize(view.axis_x * axis.x + view.axis_y * axis.y + view.axis_z * axis.z);
        }
        case SPHERE_FISHEYE: {
            let flat = vec2<f32>(right, top);
            let out = length(flat);
            if out > 1.0 {
                return vec3<f32>(0.0);
            }
            let zenith = turn(view.turns * out);
            return vec3<f32>(flat / max(out, 1e-12) * zenith.x, zenith.y);
        }
        default: {
            return normalize(view.axis_z + view.axis_x * (right * view.half_width) + view.axis_y * (top * view.half_height));
        }
    }
}

// Direction of one of a texel's rays: places are a Kronecker sequence on the golden ratio's generalisation to two dimensions
// (Roberts, 2018). Those that fall beside the picture look where the texel's middle does.
const SKY_SCATTER: vec2<f32> = vec2<f32>(0.75487767, 0.56984029);

fn scattered_direction(view: SkyView, middle: vec2<f32>, direction: vec3<f32>, ray: u32) -> vec3<f32> {
    let towards = sphere_direction(view, middle + fract((f32(ray) + 0.5) * SKY_SCATTER) - 0.5);
    return select(direction, towards, dot(towards, towards) > 0.0);
}

// Arc of a cosine (Abramowitz and Stegun 4.4.46, to 2e-8): drivers' own are rough.
fn zenith_angle(cosine: f32) -> f32 {
    let x = min(abs(cosine), 1.0);
    let low = 1.570796305 + x * (-0.2145988016 + x * (0.0889789874 + x * -0.0501743046));
    let high = 0.030891881 + x * (-0.0170881256 + x * (0.0066700901 + x * -0.0012624911));
    let angle = sqrt(1.0 - x) * (low + x * x * x * x * high);
    return select(angle, PI - angle, cosine < 0.0);
}

// How much of the sphere a texel shows, radians: from its lower edge to its upper one, and root of the solid angle. Only the
// equirect's texels are far from squares.
struct Cone {
    rise: f32,
    side: f32,
}

fn sphere_cone(view: SkyView, direction: vec3<f32>) -> Cone {
    let level = sqrt(max(1.0 - direction.z * direction.z, 1e-6));
    let texel = 2.0 / f32(view.size.x);
    switch view.kind {
        case SPHERE_EQUIRECT: {
            let rise = PI / f32(view.size.y);
            return Cone(rise, rise * sqrt(level));
        }
        case SPHERE_OCTAHEDRAL: {
            // The faces of an octahedron: the nearer a point of one is to the eye, the wider it is seen.
            let near = abs(direction.x) + abs(direction.y) + abs(direction.z);
            let side = texel * near * sqrt(near);
            return Cone(side, side);
        }
        case SPHERE_FISHEYE: {
            // From the middle outwards texels stay as high, and are the narrower around it; at the rim of a whole sphere all show one point.
            let rise = 2.0 * PI * view.turns * texel;
            let around = select(level / zenith_angle(direction.z), 1.0 - level * level / 6.0, direction.z > 0.995);
            return Cone(rise, rise * sqrt(around));
        }
        case SPHERE_CUBE: {
            // The cube's axes are those of east, north and up.
            let near = max(max(abs(direction.x), abs(direction.y)), abs(direction.z));
            return Cone(texel * near, texel * near * sqrt(near));
        }
        default: {
            let along = dot(direction, view.axis_z);
            let side = view.half_width * texel * along * sqrt(along);
            return Cone(side, side);
        }
    }
}

// Distance along a ray from height h_m to where it is at to_m: rising (or from its lowest point on), and sinking.
fn rising_distance(h_m: f32, up: f32, to_m: f32) -> f32 {
    let along = (EARTH_RADIUS_M + h_m) * up;
    let k = (to_m - h_m) * (2.0 * EARTH_RADIUS_M + to_m + h_m);
    let root = sqrt(max(along * along + k, 0.0));
    return select(root - along, k / max(along + root, 1e-6), up > 0.0);
}

fn sinking_distance(h_m: f32, up: f32, to_m: f32) -> f32 {
    let along = -(EARTH_RADIUS_M + h_m) * up;
    let k = (h_m - to_m) * (2.0 * EARTH_RADIUS_M + to_m + h_m);
    return max(k, 0.0) / max(along + sqrt(max(along * along - k, 0.0)), 1e-6);
}

// Height of the lowest point of a ray: below 0 if it meets the ground.
fn lowest_m(h_m: f32, up: f32) -> f32 {
    let level = sqrt(max(1.0 - up * up, 0.0));
    return select(h_m - (EARTH_RADIUS_M + h_m) * up * up / (1.0 + level), h_m, up >= 0.0);
}

// Whether a ray misses the ground; a level one of an eye on the ground does.
fn misses_ground(h_m: f32, up: f32) -> bool {
    return up >= 0.0 || lowest_m(h_m, up) > 0.0;
}

// Distance to that lowest point: that to its height has a root of a difference in which all digits are lost.
fn lowest_distance(h_m: f32, up: f32) -> f32 {
    return max(-(EARTH_RADIUS_M + h_m) * up, 0.0);
}

// Way over the ground below a point of a ray. Drivers compute arcs badly, and these are short: to a quarter of a radian the
// series is exact in single precision.
fn ground_way(h_m: f32, direction: vec3<f32>, distance_m: f32) -> f32 {
    let level = length(direction.xy);
    let t = distance_m * level / (EARTH_RADIUS_M + h_m + distance_m * direction.z);
    let s = t * t;
    let arc = t * (1.0 - s * (0.33333333 - s * (0.2 - s * (0.14285714 - s * (0.11111111 - s * 0.09090909)))));
    return EARTH_RADIUS_M * arc;
}

// Cosine of a ray's zenith where it has come so far, in the upright there.
fn cosine_at(h_m: f32, up: f32, distance_m: f32, at_m: f32) -> f32 {
    return ((EARTH_RADIUS_M + h_m) * up + distance_m) / (EARTH_RADIUS_M + at_m);
}

// What of the domain a sky shows far from the eye lies so far, metres, from the place that is looked at. The domain repeats, and from on high its
// copies would stand in rows: so they drift off, by waves some domains long, each to the side of where it runs, which keeps all areas. Near the eye
// nothing drifts.
const DRIFT_FROM_M: f32 = 10000.0; // half a domain at least

// Of one wave, the farther the longer it is. turns: cycles a domain east and north, and what of one has passed in the middle.
fn drift_wave(place: vec2<f32>, turns: vec3<f32>) -> vec2<f32> {
    return vec2<f32>(-turns.y, turns.x) * (turn(dot(place, turns.xy) + turns.z).x / dot(turns.xy, turns.xy));
}

fn drift_m(view: SkyView, extent_m: f32, place_m: vec2<f32>) -> vec2<f32> {
    let far = clamp((length(place_m - view.eye.xy) - max(DRIFT_FROM_M, 0.5 * extent_m)) / extent_m, 0.0, 1.0);
    let place = place_m / extent_m;
    let waves = drift_wave(place, vec3<f32>(0.04387, 0.16372, 0.05)) + drift_wave(place, vec3<f32>(-0.1931, 0.03405, 0.27))
        + drift_wave(place, vec3<f32>(-0.22165, 0.26415, 0.65)) + drift_wave(place, vec3<f32>(0.31506, 0.22061, 0.81));
    return view.drift * extent_m * far * far * (3.0 - 2.0 * far) * waves;
}
