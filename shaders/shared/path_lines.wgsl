// Where samples of a map along a ray lie: on lines through the centres of a level's texels (or between them, where there are more samples),
// those that the ray crosses most of. What is missed between samples is then the same for rays side by side, where samples at heights of
// their own drew combs along slanted edges.
struct PathLines {
    first: f32,   // parts of the way up to the first line, and from one to the next
    spacing: f32,
    count: u32,   // of the lines, and the end
}

// Over the map the way goes from start by way_uv. steps: samples for each texel of the level that it crosses, counted along the axis on which
// it crosses more.
fn path_lines(map: texture_2d<f32>, level: f32, start: vec2<f32>, way_uv: vec2<f32>, steps: f32) -> PathLines {
    let per_texel = steps * exp2(-level);
    let per_uv = vec2<f32>(textureDimensions(map)) * per_texel;
    let lines = way_uv * per_uv;
    let places = start * per_uv - 0.5 * per_texel;
    let eastward = abs(lines.x) >= abs(lines.y);
    let crossed = select(lines.y, lines.x, eastward);
    let beyond = fract(select(places.y, places.x, eastward));
    let spacing = max(1.0 / max(abs(crossed), 1e-6), 1.0 / (PATH_MOST_STEPS - 2.0));
    let first = spacing * select(beyond, 1.0 - beyond, crossed > 0.0);
    let count = u32(clamp(ceil((1.0 - first) / spacing) + 1.0, 1.0, PATH_MOST_STEPS));
    return PathLines(first, spacing, count);
}

// Part of the way up to a sample.
fn path_part(lines: PathLines, i: u32) -> f32 {
    return min(lines.first + f32(i) * lines.spacing, 1.0);
}
