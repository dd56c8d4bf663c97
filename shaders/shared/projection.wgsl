// The ray of a texel: how places and directions become texels (src/projection.rs).
struct Ray {
    position: vec3<f32>, // a point of it: east, north, up, metres
    seen: vec3<f32>,     // towards the viewer
}

fn projection_ray(view: View, extent_m: f32, pixel: vec2<u32>) -> Ray {
    let place = texel_place(view, pixel) - 0.5;
    let position = vec3<f32>(vec2<f32>(place.x, -place.y) * extent_m, view.plane_m);
    let to_eye = view.eye - position;
    return Ray(position, select(view.towards, to_eye / max(length(to_eye), 1e-6), view.perspective == 1u));
}
