// Light of a cumulus layer along a view ray: what all methods share. Twin: src/reference/cumulus.rs.

// What is seen along a ray.
struct CumulusSeen {
    radiance: vec3<f32>, // that the cloud sends, without what shines through unscattered
    depth: f32,          // optical depth at 550 nm
}

// 1 - exp(-depth), with all digits where the cloud is thin: colour may be divided by it.
fn cumulus_alpha(depth: f32) -> f32 {
    return select(1.0 - exp(-depth), depth * (1.0 - depth * (0.5 - depth * (0.16666667 - depth * 0.041666667))), depth < 0.1);
}

// Extinction of the colours against that at 550 nm.
fn cumulus_ratio() -> vec3<f32> {
    return cumulus.extinction / cumulus.extinction.g;
}

// What comes through of even light: all that goes on nearly straight.
fn cumulus_passes(depth: f32) -> vec3<f32> {
    return exp(-cumulus.kept * cumulus_ratio() * depth);
}

// What goes on nearly straight of the light behind, but for what is not scattered at all.
fn cumulus_behind(depth: f32, background: vec3<f32>) -> vec3<f32> {
    return background * (cumulus_passes(depth) - exp(-cumulus_ratio() * depth));
}

// Radiance of a white cloud under even light from the sky and from the ground, where its surface looks up by so much.
fn cumulus_even(up: f32) -> vec3<f32> {
    return cumulus.albedo * mix(cumulus.below, cumulus.above, 0.5 + 0.5 * clamp(up, -1.0, 1.0));
}

// 1 - the cosine of the angle between a view and the sun, with all digits near the sun.
fn cumulus_away(towards: vec3<f32>) -> f32 {
    let apart = towards - cumulus.sun;
    return 0.5 * dot(apart, apart);
}

// The cosine of that angle to a power, 0 behind.
fn cumulus_lobe(away: f32, exponent: f32) -> f32 {
    let near = -away * (1.0 + away * (0.5 + away * 0.33333333)); // ln(1 - away)
    let logarithm = select(log(max(1.0 - away, 1e-30)), near, away < 0.01);
    return select(0.0, exp(exponent * logarithm), away < 1.0);
}
