// Air between the eye and what it sees, from a map of src/air_map.rs.

// Steps of the aerosol's phase function from the sun to the opposite.
const AEROSOL_ROWS: f32 = 256.0;

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
    let rows = size.y / 3.0;
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
    let place = sqrt(clamp(away / PI, 0.0, 1.0)) * (AEROSOL_ROWS - 1.0);
    let step = min(u32(place), u32(AEROSOL_ROWS) - 2u);
    let once = exp(mix(air_colours.phase[step], air_colours.phase[step + 1u], place - f32(step))) * aureole;
    let aerosol = vec3<f32>(
        dot(air_colours.matrix[0], once), dot(air_colours.matrix[1], once), dot(air_colours.matrix[2], once)
    );
    return AirLight(max(air + aerosol, vec3<f32>(0.0)), through);
}
