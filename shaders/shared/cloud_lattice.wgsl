// The sun's light of a layer relative to a slab's under the open sun: by the layer's lattice along the view ray, over the same
// lattice's light in a slab as deep. Both are looked at after the same optical depths, so that what that leaves out drops out: at even shares of the
// light that the ray scatters. Light scattered once is dressed
// with what is scattered forward on its way, as in cumulus. Twin: src/reference/cloud_lattice.rs.
@group(0) @binding(METHOD_NEXT) var<uniform> lattice: LatticeLight;
@group(0) @binding(METHOD_NEXT + 1) var within: texture_3d<f32>;     // green mean radiance, moments along x, y, z; above those means of red, blue, green, and the moment along z
@group(0) @binding(METHOD_NEXT + 2) var sun_depths: texture_3d<f32>; // lines by where they pass the base plane, heights
@group(0) @binding(METHOD_NEXT + 3) var slabs: texture_2d<f32>;      // heights, slabs by the root of their depth: green mean, moments towards the sun's side, across it and upwards; below those as above cubes
@group(0) @binding(METHOD_NEXT + 4) var dressed: texture_2d<f32>;    // light scattered once, three colours: angle, path at 550 nm
@group(0) @binding(METHOD_NEXT + 5) var around: sampler;
@group(0) @binding(METHOD_NEXT + 6) var evenly: sampler;

// Parts of a ray that are looked at, at most.
const LATTICE_SAMPLES: u32 = 4u;
const LATTICE_FEW: u32 = 2u;
// The last ends so much of its share before all is scattered, times what of all light is: in deep cloud it has no end, and its light is scattered about the
// middle of so much.
const LATTICE_LAST: f32 = 0.25;
// What a path counts more than its length.
const LATTICE_DETOUR: f32 = 0.005;
const LATTICE_PATH_SCALE: f32 = 0.2;
const LATTICE_PATH_LOG: f32 = 6.39859493; // ln 601
// No mean radiance: the least of a half float.
const LATTICE_DARK: f32 = 6e-8;
// What a slab's light is multiplied with, at most.
const LATTICE_MOST: f32 = 16.0;

// What of the light of a place goes through so much optical depth.
fn lattice_passes(depth: f32, ratio: vec3<f32>) -> vec3<f32> {
    return exp(-lattice.kept * ratio * depth);
}

// With all digits where x is small.
fn lattice_expm1(x: f32) -> f32 {
    return select(exp(x) - 1.0, x * (1.0 + 0.5 * x), abs(x) < 1e-3);
}

fn lattice_log1p(x: vec4<f32>) -> vec4<f32> {
    return select(log(1.0 + x), x * (1.0 - 0.5 * x), abs(x) < vec4<f32>(1e-3));
}

// Light scattered once, by the angle's place in the table and the path to and from where it is.
fn lattice_once(column: f32, path: f32) -> vec3<f32> {
    let rows = f32(textureDimensions(dressed).y);
    let stretched = path * (1.0 + LATTICE_DETOUR * path);
    let v = (log(1.0 + stretched / LATTICE_PATH_SCALE) / LATTICE_PATH_LOG * (rows - 1.0) + 0.5) / rows;
    return textureSampleLevel(dressed, evenly, vec2<f32>(column, v), 0.0).rgb;
}

// What a mean radiance of each colour and the moment against the view, relative to the mean, are as a source of what is scattered
// again.
fn lattice_more(mean: vec3<f32>, moment: f32) -> vec3<f32> {
    return max(mean * (1.0 - lattice.asymmetry * moment), vec3<f32>(0.0));
}

// What all places along a ray have in common.
struct LatticeRay {
    towards: vec3<f32>, // the viewer
    from_above: bool,
    ratio: vec3<f32>,   // extinction of each colour over that at 550 nm
    per_metre: f32,     // optical depth of a metre of height in cloud of the layer's extinction
    sun_way: vec2<f32>, // of the sun's rays over the map, a metre of height
    column: f32,        // of the angle between view and sun in the table of light scattered once
    facing: f32,        // the view's part along the sun's side
    all_m: f32,         // height of a slab as deep as the ray's cloud
    node: f32,          // of its depth in the table of slabs
    heights: f32,       // of the volume of depths towards the sun
}

fn lattice_ray(ray: ViewRay) -> LatticeRay {
    let sun = frame.sun.towards;
    let towards = -ray.seen;
    let extinction = frame.medium.extinction_550;
    let angle = 2.0 * atan2(length(towards - sun), length(towards + sun));
    let angles = f32(textureDimensions(dressed).x);
    let level = length(sun.xy);
    let all_m = ray.path_m * ray.cosine;
    let rows = f32(textureDimensions(slabs).y / 2u);
    return LatticeRay(
        towards,
        ray.from_above,
        frame.medium.extinction / extinction,
        extinction / ray.cosine,
        vec2<f32>(sun.x, -sun.y) / (frame.sun.slant_cosine * frame.place.extent_m),
        (sqrt(angle / PI) * (angles - 1.0) + 0.5) / angles,
        select(0.0, dot(towards.xy, sun.xy) / max(level, 1e-6), level > 1e-6),
        all_m,
        sqrt(min(all_m * extinction / lattice.reach, 1.0)) * (rows - 1.0),
        f32(textureDimensions(sun_depths).z),
    );
}

// What a ray finds in the lattice, and what it were in the slab.
struct LatticeLit {
    found: vec3<f32>,
    slab: vec3<f32>,
}

// Of a place that stands for so much of what the ray scatters, once the ray has passed so much optical depth.
fn lattice_lit(ray: LatticeRay, uv: vec2<f32>, height_m: f32, passed: f32, scattered: f32) -> LatticeLit {
    let passes = lattice_passes(passed, ray.ratio);
    // Depth that it stands for.
    let depth = scattered / (lattice.kept.g * passes.g);
    let share = depth * lattice.albedo * lattice.kept * ray.ratio * passes;
    let line = vec3<f32>(uv - ray.sun_way * height_m, (height_m / lattice.sun_step_m + 0.5) / ray.heights);
    let sun_depth = max(textureSampleLevel(sun_depths, around, line, 0.0).x, 0.0);
    let found = depth * lattice_once(ray.column, passed + sun_depth)
        + share * lattice_within(uv, height_m / lattice.cell_m + 1.0, ray.towards);
    // The same place of the slab.
    let passed_m = passed / ray.per_metre;
    let left_m = max(ray.all_m - passed_m, 0.0);
    let slab_m = select(passed_m, left_m, ray.from_above);
    let above = frame.medium.extinction_550 * select(left_m, passed_m, ray.from_above);
    let slab = depth * lattice_once(ray.column, passed + above / frame.sun.slant_cosine)
        + share * lattice_slab(slab_m / (lattice.density * lattice.cell_m) + 1.0, ray.node, vec2<f32>(ray.facing, ray.towards.z));
    return LatticeLit(found, slab);
}

// What the lattice multiplies a slab's light with.
fn lattice_over_slab(found: vec3<f32>, slab: vec3<f32>) -> vec3<f32> {
    let least = vec3<f32>(1e-12);
    return select(vec3<f32>(1.0), min(found / max(slab, least), vec3<f32>(LATTICE_MOST)), slab > least);
}
