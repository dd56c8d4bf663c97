// The shader of 2000: what it has of its own. Twin: src/reference/cumulus_surface.rs.

fn surface_grain(reached: f32, noise: f32) -> f32 {
    // The body has none.
    return reached * (1.0 + SURFACE_GRAIN * noise * (1.0 - reached));
}

// By the angle from the coarser surface's normal.
fn surface_trapped(crease: vec2<f32>) -> f32 {
    return atan(surface.trap * (1.0 - crease.x)) / atan(surface.trap) * (surface.ambient + crease.y);
}

// A map by elevation: the ground's light below, white near the horizon, the sky's above.
fn surface_even(up: f32) -> vec3<f32> {
    let above = cumulus_even(1.0);
    let below = cumulus_even(-1.0);
    let horizon = 0.5 * (vec3<f32>((above.r + above.g + above.b) / 3.0) + below);
    return mix(horizon, select(below, above, up > 0.0), min(abs(up), 1.0));
}
