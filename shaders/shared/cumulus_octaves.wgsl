// Light of a piece of cumulus by octaves of light scattered once. Twin: src/reference/cumulus_octaves.rs.

// Of what comes after the bindings of light.
const CUMULUS_NEXT: u32 = 7u;
// Octaves; all of them, and the next one's strength, depth towards the sun, asymmetry and depth towards the eye against one's.
const OCTAVES_COUNT: u32 = 3u;
const OCTAVES_GAIN: f32 = 1.45;
const OCTAVES_AMPLITUDE: f32 = 0.34;
const OCTAVES_SUN: f32 = 0.25;
const OCTAVES_ASYMMETRY: f32 = 0.46;
const OCTAVES_VIEW: f32 = 0.38;

// 1 - exp(-depth) of three depths.
fn octaves_shown(depth: vec3<f32>) -> vec3<f32> {
    let thin = depth * (1.0 - depth * (0.5 - depth * (0.16666667 - depth * 0.041666667)));
    return select(1.0 - exp(-depth), thin, depth < vec3<f32>(0.1));
}

// Phase function of Henyey and Greenstein, whose integral is 1.
fn octaves_phase(asymmetry: vec3<f32>, away: f32) -> vec3<f32> {
    let wide = (1.0 - asymmetry) * (1.0 - asymmetry) + 2.0 * asymmetry * away;
    return (1.0 - asymmetry * asymmetry) / (4.0 * PI * pow(max(wide, vec3<f32>(1e-12)), vec3<f32>(1.5)));
}

// A piece of a ray that is shaded as one.
fn cumulus_piece(ray: CloudRay, angle: f32, at_m: f32, before: f32, piece: f32) -> vec3<f32> {
    let away = cumulus_away(ray.towards);
    let towards_sun = cumulus_towards_sun(ray, cumulus_place(ray, at_m), cumulus_middle(before, piece));
    // Of droplets with their forward peak.
    let albedo = cumulus.albedo * cumulus.kept + 1.0 - cumulus.kept;
    let forward = (1.0 - cumulus.kept) / max(albedo, vec3<f32>(1e-12));
    var sharpness = cumulus.asymmetry / 3.0 * (1.0 - forward) + forward;
    var strength = OCTAVES_GAIN * albedo;
    var sun = cumulus_ratio();
    var view = cumulus_ratio();
    var per_view = 1.0;
    var light = vec3<f32>(0.0);
    for (var i = 0u; i < OCTAVES_COUNT; i++) {
        let seen = exp(-view * before) * octaves_shown(view * piece) / per_view;
        light += strength * exp(-sun * towards_sun) * octaves_phase(sharpness, away) * seen;
        strength *= OCTAVES_AMPLITUDE * albedo;
        sharpness *= OCTAVES_ASYMMETRY;
        sun *= OCTAVES_SUN;
        view *= OCTAVES_VIEW;
        per_view *= OCTAVES_VIEW;
    }
    let share = cumulus_passes(before) - cumulus_passes(before + piece);
    return cumulus.irradiance * light + share * cumulus_even(-ray.towards.z);
}
