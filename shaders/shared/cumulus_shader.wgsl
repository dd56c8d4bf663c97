// The later shader: what it has of its own. Twin: src/reference/cumulus_surface.rs.

fn surface_grain(reached: f32, noise: f32) -> f32 {
    return reached;
}

// By the distance from the coarser surface.
fn surface_trapped(crease: vec2<f32>) -> f32 {
    return clamp(1.0 - surface.blob_m * crease.x / surface.trap, 0.0, 1.0) * crease.y;
}

fn surface_even(up: f32) -> vec3<f32> {
    return cumulus_even(up);
}
