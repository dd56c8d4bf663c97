// The ray of a texel: how places and directions become texels (src/projection.rs).
struct Ray {
    position: vec3<f32>, // a point of it: east, north, up, metres
    seen: vec3<f32>,     // towards the viewer
}

fn projection_ray(view: View, extent_m: f32, pixel: vec2<u32>) -> Ray {
    return projection_ray_at(view, extent_m, texel_place(view, pixel));
}

// That of a place of the picture, from 0 to 1.
fn projection_ray_at(view: View, extent_m: f32, at: vec2<f32>) -> Ray {
    let place = at - 0.5;
    let position = vec3<f32>(vec2<f32>(place.x, -place.y) * extent_m, view.plane_m);
    let to_eye = view.eye - position;
    return Ray(position, select(view.towards, to_eye / max(length(to_eye), 1e-6), view.perspective == 1u));
}
