// The sun's beam on the ground: what one layer leaves of it at each texel, multiplied with what the others leave. Means
// over the sun's disc, so that shadows have penumbras; over parts of it one after the other where all of them would take too much memory.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var<uniform> disc: Disc;
@group(0) @binding(3) var thickness: texture_2d<f32>;
// rgb: parts left of the beam with its 5-degree peak; w: the same at 550 nm, however little comes through in all.
@group(0) @binding(4) var<storage, read_write> beam: array<vec4<f32>>;
// rgb: unscattered parts; w: at 550 nm.
@group(0) @binding(5) var<storage, read_write> unscattered: array<vec4<f32>>;
// Of each texel, the two of these summed over the parts of the disc before this one; those of the first layer are in the two themselves.
@group(0) @binding(6) var<storage, read_write> sums: array<vec4<f32>>;

// Of a place on the disc. Green is 550 nm.
struct DiscLight {
    with_peak: vec4<f32>, // as `beam`
    without: vec4<f32>,   // as `unscattered`
}

// What is left after so much cloud.
fn light_after(path_m: f32) -> DiscLight {
    let beam = exp(-frame.medium.beam * frame.medium.extinction * path_m);
    let unscattered = exp(-frame.medium.extinction * path_m);
    return DiscLight(vec4<f32>(beam_bounded(beam, path_m), beam.g), vec4<f32>(unscattered, unscattered.g));
}

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= view.size.x || id.y >= view.rows {
        return;
    }
    let uv = texel_place(view, id.xy);
    let at = id.y * view.size.x + id.x;
    var with_peak = vec4<f32>(0.0);
    var without = vec4<f32>(0.0);
    if disc.first > 0u {
        with_peak = beam[at];
        without = unscattered[at];
        if view.first == 0u {
            with_peak = sums[2u * at];
            without = sums[2u * at + 1u];
        }
    }
    var i = 0u;
    loop {
        let place = disc.places[i];
        let light = light_of(place, uv + place.shift_uv);
        with_peak += light.with_peak;
        without += light.without;
        continuing {
            i++;
            break if i >= disc.count;
        }
    }
    let count = f32(disc.total);
    let unfinished = disc.first + disc.count < disc.total;
    if unfinished && view.first == 0u {
        sums[2u * at] = with_peak;
        sums[2u * at + 1u] = without;
        return;
    }
    if !unfinished {
        with_peak /= count;
        without = min(without / count, vec4<f32>(with_peak.rgb, 1.0));
        if view.first == 0u {
            with_peak *= beam[at];
            without *= unscattered[at];
        }
    }
    beam[at] = with_peak;
    unscattered[at] = without;
}
