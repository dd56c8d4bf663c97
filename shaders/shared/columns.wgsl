// A layer whose columns have bases, tops and extinctions of their own. A texel of its map: the thickness that a cloud of the
// layer's extinction had at the column's optical depth; top and base above the base plane; 1 where extinction grows with height, as in
// adiabatic cloud, of which shaders are told by COLUMN_GROWS. Between texels the first three are bilinear, so that optical depth is, and with it its mean.

// Height of a column's top above the base plane.
fn column_top(texel: vec4<f32>) -> f32 {
    return texel.y;
}

fn column_thickness(texel: vec4<f32>) -> f32 {
    return select(0.0, texel.y - texel.z, texel.x > 0.0);
}

// Heights that bound its cloud, above the base plane.
fn column_ends(texel: vec4<f32>) -> vec2<f32> {
    return texel.zy;
}

// Whether the heights of a block of columns tell of cloud.
fn column_counts(texel: vec4<f32>) -> bool {
    return texel.x > 0.0;
}

// The part of a piece of a ray that is in cloud.
struct ColumnPiece {
    ends: vec2<f32>, // as parts of the piece
    density: f32,    // extinction there, relative to the layer's
}

// Columns less thick than this have no cloud, metres.
const COLUMN_LEAST_M: f32 = 1e-3;

// Between two places of a ray, heights and optical depth change evenly: columns and heights of the ray there.
fn column_piece(first: vec4<f32>, last: vec4<f32>, heights_m: vec2<f32>) -> ColumnPiece {
    let under_top = column_positive(vec2<f32>(first.y, last.y) - heights_m);
    let over_base = column_positive(heights_m - vec2<f32>(first.z, last.z));
    let ends = vec2<f32>(max(under_top.x, over_base.x), min(under_top.y, over_base.y));
    if ends.y <= ends.x {
        return ColumnPiece(vec2<f32>(0.0), 0.0);
    }
    let middle = mix(first, last, 0.5 * (ends.x + ends.y));
    var density = middle.x / max(middle.y - middle.z, COLUMN_LEAST_M);
    if COLUMN_GROWS {
        let over_base_m = mix(vec2<f32>(heights_m.x - first.z), vec2<f32>(heights_m.y - last.z), ends);
        let deep_m = mix(vec2<f32>(first.y - first.z), vec2<f32>(last.y - last.z), ends);
        density *= column_growth(clamp(over_base_m / max(deep_m, vec2<f32>(COLUMN_LEAST_M)), vec2<f32>(0.0), vec2<f32>(1.0)));
    }
    return ColumnPiece(ends, density);
}

// Mean extinction between two parts of a column's height, relative to that of the whole: of adiabatic cloud it grows with the height above
// the base to the power of 2/3, and depth to that of 5/3.
fn column_growth(parts: vec2<f32>) -> f32 {
    let apart = parts.y - parts.x;
    let depths = pow(max(parts, vec2<f32>(1e-12)), vec2<f32>(5.0 / 3.0));
    let there = 5.0 / 3.0 * pow(max(0.5 * (parts.x + parts.y), 1e-12), 2.0 / 3.0);
    return select((depths.y - depths.x) / apart, there, abs(apart) < 0.01);
}

// Where from 0 to 1 what goes evenly from one value to another is above 0; ends the wrong way round where it is not.
fn column_positive(values: vec2<f32>) -> vec2<f32> {
    let above = values > vec2<f32>(0.0);
    let crossing = values.x / select(values.x - values.y, 1.0, above.x == above.y);
    let ends = vec2<f32>(select(crossing, 0.0, above.x), select(crossing, 1.0, above.y));
    return select(vec2<f32>(1.0, 0.0), ends, above.x || above.y);
}
