// Air between the eye and what it sees, from a map of src/air_map.rs.

// Rows of the aerosol's phase function below the bands, and below those the rows of the colours' matrix.
const AEROSOL_ROWS: f32 = 256.0;
const COLOUR_ROWS: f32 = 3.0;
// A row between the bands and these.
const GUARD_ROWS: f32 = 1.0;

struct AirLight {
    light: vec3<f32>,   // what it adds
    through: vec3<f32>, // part that it leaves of what lies behind
}

// sun: towards it. horizon: elevation, radians; below: whether the map shows what lies below it.
fn air_light(
    map: texture_2d<f32>,
    clamped: sampler,
    direction: vec3<f32>,
    sun: vec3<f32>,
    horizon: f32,
    below: bool,
) -> AirLight {
    let size = vec2<f32>(textureDimensions(map));
    let rows = (size.y - GUARD_ROWS - AEROSOL_ROWS - COLOUR_ROWS) / 3.0;
    // Arcs of tangents: drivers compute those of sines badly.
    let elevation = atan2(direction.z, length(direction.xy));
    let reach = select(0.5 * PI, -0.5 * PI, below) - horizon;
    let row = sqrt(clamp((elevation - horizon) / reach, 0.0, 1.0)) * (rows - 1.0) + 0.5;
    let along = dot(direction.xy, sun.xy);
    let across = direction.x * sun.y - direction.y * sun.x;
    let straight = max(abs(along), abs(across)) < 1e-9;
    let azimuth = select(abs(atan2(across, along)), 0.0, straight);
    let u = (azimuth / PI * (size.x - 1.0) + 0.5) / size.x;
    let air = sample_clamped(map, clamped, vec2<f32>(u, row / size.y)).rgb;
    // Of the four wavelengths.
    let aureole = sample_clamped(map, clamped, vec2<f32>(u, (row + rows) / size.y));
    let through = sample_clamped(map, clamped, vec2<f32>(u, (row + 2.0 * rows) / size.y)).rgb;
    let away = atan2(length(cross(direction, sun)), dot(direction, sun));
    let first = 3.0 * rows + GUARD_ROWS;
    let phase_row = first + sqrt(clamp(away / PI, 0.0, 1.0)) * (AEROSOL_ROWS - 1.0) + 0.5;
    let once = exp(sample_clamped(map, clamped, vec2<f32>(u, phase_row / size.y))) * aureole;
    let colours = i32(first + AEROSOL_ROWS);
    let aerosol = vec3<f32>(
        dot(textureLoad(map, vec2<i32>(0, colours), 0), once),
        dot(textureLoad(map, vec2<i32>(0, colours + 1), 0), once),
        dot(textureLoad(map, vec2<i32>(0, colours + 2), 0), once),
    );
    return AirLight(max(air + aerosol, vec3<f32>(0.0)), through);
}
