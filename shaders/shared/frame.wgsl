// Structs that the host fills. Their twins are in src/gpu/layout.rs; a reflection test compares the two.

// The sun at one moment.
struct Sun {
    towards: vec3<f32>,       // unit vector: east, north, up
    slant_cosine: f32,        // cosine of its zenith, at least MIN_COSINE: of rays and tables
    irradiance: vec3<f32>,    // facing it, 0 below the horizon
    cosine: f32,              // of its zenith, at least 0: 0 is night
    through_air: vec3<f32>,   // part of its beam that air among and below the clouds leaves on the ground
    spare: u32,
}

// What a layer is made of: red, green and blue are 650, 550 and 450 nm.
struct Medium {
    extinction: vec3<f32>,    // per metre
    extinction_550: f32,
    beam: vec3<f32>,          // part of extinction that takes light out of the 5-degree beam
    beam_550: f32,
    smooth_part: vec3<f32>,   // 1 - albedo * forward peak: extinction of the medium without its peak, relative
    transport_550: f32,       // 1 - asymmetry: extinction of transport, relative
    smooth_albedo: vec3<f32>, // single-scattering albedo of the medium without its peak
    spare: u32,
    forward: vec3<f32>,       // part of extinction that takes light out of the 25-degree beam
    forward_550: f32,
}

// Where a layer lies, and its field in the domain.
struct Placement {
    offset_uv: vec2<f32>,     // where the wind has carried the field
    shift_uv: vec2<f32>,      // from a ground point to where its sun ray crosses the layer's base
    above_uv: vec2<f32>,      // from a point of the base to where its sun ray crosses the base of the layer above
    extent_m: f32,            // side of the domain
    base_m: f32,              // height of the base plane: the lowest base
    depth_m: f32,             // no cloud is higher above it
    max_steps: u32,           // cuts of a ray through the layer
    lowest: u32,              // 1: below the layer there is the ground, 0: another layer
    ragged: u32,              // 1: columns have bases, tops and extinctions of their own: see columns.wgsl
}

// The layer's maps of sunlight.
struct SunMaps {
    sample_at: vec2<f32>,     // see sunlight_sample
    texels: u32,              // a side
    columns: u32,             // 1: each column is lit from straight above, as if its neighbours were like it; 2: light at
                              // the base is marched, but no part of the top is in the shadow of another; 0: neither
}

// One layer at one moment.
struct Frame {
    sun: Sun,
    medium: Medium,
    place: Placement,
    maps: SunMaps,
}

// A place on the sun's disc.
struct DiscPlace {
    shift_uv: vec2<f32>,      // from a point of the ground to where its ray crosses the layer's base, turned to its direction
    cosine: f32,              // of its zenith
    direction: u32,           // which of the directions its rays have within the layer
}

// Rays towards the sun's disc that are side by side within a layer.
struct DiscWay {
    towards: vec3<f32>,       // unit vector
    across: f32,              // rows that they go across for each line: this and the following are theirs where they are swept
    per_metre: f32,           // starts of rays that they go along for each metre of height
    flipped: u32,             // 1: along is the second axis of the map, southwards
    backwards: u32,           // 1: they go towards smaller texels
    spare: u32,
}

// Places on the sun's disc that are looked at together.
struct Disc {
    fine: u32,                // rows of rays that are swept over a layer for each of its map's texels across, 0: each ray is followed by itself
    directions: u32,
    count: u32,               // places
    first: u32,               // of all that are looked at, so many come before these
    total: u32,               // how many are looked at in all
    lines: u32,               // lines for each texel along, at which a row looks at columns
    between: u32,             // rays that start from each line on to the next
    row_numbers: u32,         // what is kept of a row
    ways: array<DiscWay, 32>,
    places: array<DiscPlace, 32>,
}

// One output texture, or a band of its rows.
struct View {
    towards: vec3<f32>,       // towards the viewer of a parallel view
    perspective: u32,         // 1: the view of a viewer at eye
    eye: vec3<f32>,           // the viewer of a perspective view, metres
    plane_m: f32,             // height of the plane that the texels lie in
    size: vec2<u32>,          // texels across and down
    first_row: u32,
    rows: u32,
    from_above: u32,
    part: u32,                // irradiance: 0 total, 1 direct, 2 diffuse
    peak: u32,                // 1: light scattered by less than 5 degrees counts as beam
    first: u32,               // 1: the layer is the first that is drawn, nothing lies before it
    added: vec3<f32>,         // irradiance: even light that falls on the ground beside that of the layers' exchange
    together: u32,            // 1: several layers are drawn, and carry each other's light on; 0: one by itself
    point: vec2<f32>,         // where the one texel lies that is shaded by itself, domains from the north-western corner
    pointed: u32,             // 1: there is a point
    spare: u32,
}

// One output texture of the whole sky, or a band of its rows.
struct SkyView {
    axis_x: vec3<f32>,        // of a cube's faces, or to the right of a picture: east, north, up
    kind: u32,                // how directions become texels: see sphere_direction
    axis_y: vec3<f32>,        // towards the picture's top
    rows: u32,                // of the band
    axis_z: vec3<f32>,        // into the picture
    first_row: u32,           // of the band
    eye: vec3<f32>,           // place of the eye, metres
    rising: u32,              // 1: a layer is drawn along the part of each ray that rises, 0: that sinks
    size: vec2<u32>,          // texels across and down
    first_turn: f32,          // azimuth of the left edge, turns from north over east
    turns: f32,               // from the left edge to the right one, or from the middle to the edge
    half_width: f32,          // of the picture, one unit away
    half_height: f32,
    steps: f32,               // samples of the thickness map for each of its texels that a ray crosses
    rays: u32,                // of a texel, at most
    texels_per_ray: f32,      // of a map along the ground, for each of a texel's rays
    coarseness: f32,          // mip levels beyond that whose texels are as wide as the picture's
    edge: f32,                // sine of the elevation at which the layer begins or ends for the eye
    horizon: f32,             // elevation at which the map of the air before the layer begins, radians
    together: u32,            // as in View
    drift: f32,               // how far each wave of the drift carries what is seen far off, as a part of its length; 0: nothing
    spare_1: u32,
    spare_2: u32,
}

// A cumulus layer at one moment: where it is, what it is made of, how it is lit.
struct Cumulus {
    sun: vec3<f32>,           // unit vector towards it
    extent_m: f32,            // side of the domain
    irradiance: vec3<f32>,    // of the sun, facing it
    base_m: f32,              // no cloud is below
    extinction: vec3<f32>,    // per metre
    top_m: f32,               // no cloud is above
    kept: vec3<f32>,          // part of extinction without the forward peak
    low_m: f32,               // no cloud is below, where its spheres end above the base
    albedo: vec3<f32>,        // of scattering without the peak
    floor_m: f32,             // lower face of the volume
    asymmetry: vec3<f32>,     // three times that of scattering without the peak
    voxel_m: f32,             // side of its cubes
    beam: vec3<f32>,          // part of extinction that takes light out of the 5-degree beam
    band_m: f32,              // depths that it holds
    above: vec3<f32>,         // even radiance from the sky
    edge_m: f32,              // over which density rises from 0 to 1
    below: vec3<f32>,         // even radiance from the ground
    relief_m: f32,            // by which noise moves the surface
    offset_m: vec2<f32>,      // where the wind has carried the layer
    tile_m: f32,              // side of the noise's tile
    sun_radius: f32,          // of the sun's disc, radians
    cell_m: f32,              // side of the lattice's cubes
    lattice_floor_m: f32,     // lower face of the lattice
    published: u32,           // 1 where a veil is as it was published
    inward_m: f32,            // how far within the cloud the lattice is read
}

// Constants of a shader that takes a cumulus for its surface.
struct CumulusSurface {
    glow_m: vec3<f32>,        // exponent of the glow's cosine, times length on the ray and share of the layer
    blob_m: f32,              // radius of what stands out of the coarser surface
    ambient: f32,             // even light, of the sun's over pi
    diffuse: f32,             // light by the sun's cosine
    bump: f32,                // how far noise turns the normal
    corona: f32,              // strength of the glow
    reached_m: f32,           // depth at which a ray meets the body
    traps: f32,               // strength of light in creases
    trap: f32,                // where it is: metres, or the arctangent's coefficient
    spare: u32,
}

// What lies behind the clouds.
struct Backdrop {
    sun: vec3<f32>,           // unit vector towards it
    horizon: f32,             // elevation at which the ground ends, radians
    extent_m: f32,            // side of the domain
    spare: u32,
    spare_2: vec2<u32>,
}

// How aerosol scatters, and what colours are made of: the same for all maps of air of an eye. A file that looks at such maps binds it
// as air_colours.
struct AirColours {
    phase: array<vec4<f32>, 256>, // logarithm of the phase function at the four wavelengths, over 4 pi
    matrix: array<vec4<f32>, 3>,  // rows of the matrix from these to colours
}

// A Gaussian blur along one axis of a periodic map.
struct Blur {
    axis: vec2<i32>,          // (1, 0) or (0, 1)
    radius: i32,              // texels to either side
    sharpness: f32,           // 1 / (2 sigma^2), texels
}

// How the maps of sunlight are put together: see sun_share.
struct Share {
    entry_scale: vec3<f32>,   // brings the mean of light by entry to that of light along the ray
    entry_weight: f32,        // of diffuse light by entry; the rest is by the ray
    reflect_scale: vec3<f32>, // brings the mean of reflected light by entry to that along the ray
    spare: u32,
    in_air: vec3<f32>,        // what air within the layer makes of light that comes through it
    spare_2: u32,
}

// How the light of a layer's lattice is read.
struct LatticeLight {
    kept: vec3<f32>, // part of extinction that takes light out of what the lattice counts as not scattered
    reach: f32,      // optical depth at 550 nm of the last of its factors, and of its slabs
    albedo: vec3<f32>, // of what it counts as scattered
    cell_m: f32,
    asymmetry: vec3<f32>, // three times that of what it counts as scattered
    sun_step_m: f32, // between two heights of the depths towards the sun
    density: f32,    // extinction of its slabs, relative to the layer's
    grey: u32,       // 1: all colours are alike
    spare_0: u32,
    spare_1: u32,
    in_air: vec3<f32>, // what air within the layer leaves of light that comes through it
    spare_2: u32,
}

// What the texels of a radiance slice are multiplied by, per channel.
struct Remainder {
    depth_scale: vec3<f32>,   // scaled optical depth per true one
    depths: f32,              // nodes of optical depth
    order1_albedo: vec3<f32>, // albedo of single scattering at the scaled depth
    zeniths: f32,             // nodes of view zenith
    decay: vec3<f32>,         // diffusion exponent per scaled depth
    azimuths: f32,            // nodes of azimuth
    extrapolation: vec3<f32>, // depth added by extrapolation at both faces, scaled
    depths_per_octave: f32,
}

// Octaves of a synthetic field that share a texture.
struct Octaves {
    seed: u32,
    first: u32,               // the first of the four
    count: u32,               // of the field: what is beyond is 0
    width: u32,               // texels a side
}

// Convective cells of a synthetic field at one moment.
struct Cells {
    seed: u32,
    kind: u32,                // 0 closed, 1 open
    count: u32,               // cells a side of the coarser lattice
    width: u32,               // texels a side
    coarser: f32,             // weight of that lattice, and of the one with one cell more
    finer: f32,
    turns: f32,               // of the slowest of the cells' points, 0 to 1
    spare: u32,
}

// Phases of the eddies' four bands at one moment.
struct Eddies {
    cosines: vec4<f32>,
    sines: vec4<f32>,
}

// A step of the displacement.
struct Step {
    keep: vec4<f32>,          // 0 where a layer is born, 1 elsewhere
    length_uv: f32,           // way at the root mean square of speed, domains
    spare_0: u32,
    spare_1: u32,
    spare_2: u32,
}

// How a field is put together at one moment.
struct Blend {
    low: vec4<f32>,           // amplitudes of octaves 0 to 3, 4 to 7, 8 to 11
    middle: vec4<f32>,
    high: vec4<f32>,
    cells: f32,               // amplitude of the cells
    first: f32,               // weights of the two layers of displacement
    second: f32,
    width: u32,               // texels
    height: u32,
    spare: u32,
    offset_uv: vec2<f32>,     // where the mean wind has carried the field
}

// Equal bins of a field's values.
struct Histogram {
    low: f32,                 // where the first begins
    per_unit: f32,            // bins
    count: u32,               // values
    spare: u32,
}

// Octaves of noise on turned lattices.
struct Turned {
    seed: u32,
    first: u32,               // of four octaves
    count: u32,               // octaves in all
    width: u32,               // texels a side
    turns: array<vec4<i32>, 4>, // of each: steps along and across a row of two lattices, no common divisor
}

// Plane waves of cloud streets.
struct Streets {
    width: u32,               // texels a side
    count: u32,               // waves
    spare_0: u32,
    spare_1: u32,
    waves: array<vec4<f32>, 32>, // of each: whole cycles a tile eastwards and southwards, phase in turns, amplitude
}

// Cirrus: ice that fell from generating cells.
struct Trails {
    low: vec4<f32>,           // amplitudes of octaves in the logarithm of ice where it forms
    middle: vec4<f32>,
    high: vec4<f32>,
    along_uv: vec2<f32>,      // from a trail's end to the head that it came from, straight on
    bend_uv: vec2<f32>,       // and aside
    aside_uv: vec2<f32>,      // way aside by a noise of 1
    centre: f32,              // mean logarithm of a column's ice
    per_unit: f32,            // over its standard deviation
    width: u32,               // texels a side
    steps: u32,               // samples of a trail
    parts: u32,               // samples of a step
    spare: u32,
}

// From the optical depths of a field to columns.
struct Columns {
    low: f32,                 // value at which the first bin begins
    per_unit: f32,            // bins
    scale_m: f32,             // thickness at a path of 1 m, without the clip
    clip_m: f32,              // thickness that is never reached
    lift_m: f32,              // height of the thinnest columns' bases above the base plane; none where they hang
    over_m: f32,              // thickness over which bases come down by a factor of e
    hang_m: f32,              // height of the flat top that columns hang from; 0 where they stand
    grows: u32,               // 1 where extinction grows with height, as in adiabatic cloud
}

// From a Gaussian field to thickness.
struct Transfer {
    spread: f32,              // of the logarithm of water path
    threshold: f32,           // water path below which there is no cloud
    scale_m: f32,             // thickness at a water path of 1 above the threshold
    clip_m: f32,              // thickness that is never reached
    width: u32,               // texels
    height: u32,
    spare_0: u32,
    spare_1: u32,
}

// Grazing rays are computed at this cosine at least: 0.006 degrees above the horizon.
const MIN_COSINE: f32 = 1e-4;
// Least part of the sun's light that layers let go on: what a layer makes of it is divided by it again.
const LEAST_LIT: f32 = 1e-20;
// Squares between texel centres in a block of a thickness map whose bounds are known, a side: see field_bounds.
const BOUNDS_TEXELS: u32 = 8u;
const PI: f32 = 3.14159265358979;

// Places in a texel of the maps of sunlight at which the thickness map is looked at: two, opposite each other, turned from
// texel to texel so that neither axis is preferred.
const SUNLIGHT_SAMPLES: u32 = 2u;

fn sunlight_sample(frame: Frame, texel: vec2<u32>, i: u32) -> vec2<f32> {
    let apart = select(frame.maps.sample_at, frame.maps.sample_at.yx, (texel.x + texel.y) % 2u == 1u);
    return (vec2<f32>(texel) + 0.5 + select(apart, -apart, i == 1u)) / f32(frame.maps.texels);
}

// Place on the domain of a point given in metres; row 0 of a map is the north edge.
fn domain_uv(position_m: vec2<f32>, extent_m: f32) -> vec2<f32> {
    return vec2<f32>(0.5 + position_m.x / extent_m, 0.5 - position_m.y / extent_m);
}

// Place of a texel's centre in the whole image, 0 to 1 from the north-west corner.
fn texel_place(view: View, pixel: vec2<u32>) -> vec2<f32> {
    let place = (vec2<f32>(f32(pixel.x), f32(pixel.y + view.first_row)) + 0.5) / vec2<f32>(view.size);
    return select(place, view.point, view.pointed == 1u);
}

// How far over the map a ray goes for each metre of height.
fn path_slope(frame: Frame, up: vec3<f32>) -> vec2<f32> {
    return vec2<f32>(up.x, -up.y) / (max(up.z, MIN_COSINE) * frame.place.extent_m);
}

// How often a ray through the whole layer would be cut, over how often it may be.
fn path_excess(map: texture_2d<f32>, frame: Frame, slope: vec2<f32>) -> f32 {
    let crossings = frame.place.depth_m * dot(abs(slope), vec2<f32>(textureDimensions(map)));
    return crossings / f32(frame.place.max_steps);
}
