// Air between the eye and what it sees, from a map of src/air_map.rs.
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
    asymmetry: f32,
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
    let aerosol = sample_clamped(map, clamped, vec2<f32>(u, (row + rows) / size.y)).rgb;
    let through = sample_clamped(map, clamped, vec2<f32>(u, (row + 2.0 * rows) / size.y)).rgb;
    // Henyey and Greenstein's phase function (1941) over 4 pi.
    let g = asymmetry;
    let away = 1.0 + g * g - 2.0 * g * dot(direction, sun);
    let phase = (1.0 - g * g) / (4.0 * PI * away * sqrt(away));
    return AirLight(max(air + phase * aerosol, vec3<f32>(0.0)), through);
}
