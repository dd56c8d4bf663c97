// Light of a cumulus layer along a view ray, as a veil that scatters forwards. Twin: src/reference/cumulus_forward.rs.

// Of what comes after the bindings of light.
const CUMULUS_NEXT: u32 = 6u;
// Optical depth beyond which nothing changes.
const FORWARD_OPAQUE: f32 = 100.0;
// Exponent of the cosine where the veil is thin, and where it is thick.
const FORWARD_SHARPEST: f32 = 32.0;
const FORWARD_BROADEST: f32 = 0.45;
const FORWARD_LN_2: f32 = 0.69314718;

// Part of a beam that goes straight through a slab of an optical depth and is scattered, of droplets of some scattering.
fn forward_through(depth: f32, kept: f32, scaled_albedo: f32, asymmetry: f32) -> f32 {
    let albedo = scaled_albedo * kept + 1.0 - kept;
    let scaled = kept * depth;
    let turned = (1.0 - asymmetry) * scaled;
    let through = (cumulus_alpha(scaled) / 3.0 - turned) / (1.3333333 + turned) + cumulus_alpha(depth);
    let lost = scaled * sqrt(3.0 * (1.0 - scaled_albedo) * (1.0 - scaled_albedo * asymmetry));
    let left = 2.0 * lost * exp(-lost) / max(cumulus_alpha(2.0 * lost), 1e-9);
    return albedo * max(through, 0.0) * select(left, 1.0 - lost * lost / 6.0, lost < 1e-3);
}

// cone: width of what a texel shows, per metre of distance; wide_m: the same at any distance.
fn cumulus_seen(ray: CloudRay, near_m: f32, far_m: f32, cone: f32, wide_m: f32, background: vec3<f32>) -> CumulusSeen {
    var depth = 0.0;
    let scale = cumulus_scale();
    var march = CloudMarch(near_m, CUMULUS_UNKNOWN, 0.0, 0.0);
    var step = 0u;
    // Left at its end: software devices run through the body once more where a loop is left at its head.
    loop {
        march = cumulus_march(scale, ray, march, far_m, cone * march.at_m + wide_m);
        depth += cumulus.extinction.g * march.density * march.length_m;
        continuing {
            step++;
            break if step >= CUMULUS_VIEW_STEPS || march.at_m >= far_m || depth >= FORWARD_OPAQUE;
        }
    }
    let away = cumulus_away(ray.towards);
    let depths = cumulus_ratio() * depth;
    var light = vec3<f32>(0.0);
    for (var c = 0u; c < 3u; c++) {
        // As it was published it grows with 1 - 2^-depth, and has no broadest lobe.
        let published = cumulus.published == 1u;
        let exponent = max(FORWARD_SHARPEST * exp2(-depths[c]), select(FORWARD_BROADEST, 0.0, published));
        let darkens = forward_through(depths[c], cumulus.kept[c], cumulus.albedo[c], cumulus.asymmetry[c] / 3.0);
        let grows = (cumulus.albedo[c] * cumulus.kept[c] + 1.0 - cumulus.kept[c]) * cumulus_alpha(FORWARD_LN_2 * depths[c]);
        let through = select(darkens, grows, published);
        light[c] = cumulus.irradiance[c] / PI * 0.5 * (exponent + 1.0) * cumulus_lobe(away, exponent) * through;
    }
    light += (1.0 - cumulus_passes(depth)) * cumulus_even(-ray.towards.z) + cumulus_behind(depth, background);
    return CumulusSeen(light, depth);
}
