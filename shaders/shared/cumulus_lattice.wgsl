// Light of a piece of cumulus by the lattice. Twin: src/reference/cumulus.rs.
@group(0) @binding(7) var light_red: texture_3d<f32>; // of each colour: mean radiance, moments along x, y, z
@group(0) @binding(8) var light_green: texture_3d<f32>;
@group(0) @binding(9) var light_blue: texture_3d<f32>;
@group(0) @binding(10) var dressed: texture_2d<f32>;  // light scattered once: angle, path
@group(0) @binding(11) var linear: sampler;

// Of what comes after the bindings of light.
const CUMULUS_NEXT: u32 = 12u;
// What a path counts more than its length.
const CUMULUS_DETOUR: f32 = 0.005;
const CUMULUS_PATH_SCALE: f32 = 0.2;
const CUMULUS_PATH_LOG: f32 = 6.39859493; // ln 601

// A piece of a ray that is shaded as one.
fn cumulus_piece(ray: CloudRay, angle: f32, at_m: f32, before: f32, piece: f32) -> vec3<f32> {
    let place = cumulus_place(ray, at_m);
    let uvw = cumulus_cube(cumulus_place(ray, at_m + cumulus.inward_m));
    let red = textureSampleLevel(light_red, around, uvw, 0.0);
    let green = textureSampleLevel(light_green, around, uvw, 0.0);
    let blue = textureSampleLevel(light_blue, around, uvw, 0.0);
    let towards = ray.towards + vec3<f32>(0.0, 0.0, ray.bend * at_m);
    let kept = cumulus.kept.g;
    let middle = cumulus_middle(before, piece);
    // Depth that the piece stands for in its middle.
    let depth = cumulus_alpha(kept * piece) * exp(kept * (middle - before)) / kept;
    let path = middle + cumulus_towards_sun(ray, place, middle);
    let stretched = path * (1.0 + CUMULUS_DETOUR * path);
    let table = vec2<f32>(textureDimensions(dressed));
    let u = (sqrt(angle / PI) * (table.x - 1.0) + 0.5) / table.x;
    let v = (log(1.0 + stretched / CUMULUS_PATH_SCALE) / CUMULUS_PATH_LOG * (table.y - 1.0) + 0.5) / table.y;
    let once = textureSampleLevel(dressed, linear, vec2<f32>(u, v), 0.0).rgb;
    let share = cumulus_passes(before) - cumulus_passes(before + piece);
    let mean = vec3<f32>(red.x, green.x, blue.x);
    let flux = vec3<f32>(dot(red.yzw, towards), dot(green.yzw, towards), dot(blue.yzw, towards));
    return cumulus.irradiance * once * depth + share * cumulus.albedo * max(mean - cumulus.asymmetry * flux, vec3<f32>(0.0));
}
