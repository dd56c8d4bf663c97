// The sun's beam on the ground, with its 5-degree peak or without: what one layer leaves of it at each texel, multiplied with what the others leave. Means
// over the sun's disc, so that shadows have penumbras; over parts of it one after the other where all of them would take too much memory.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var<uniform> disc: Disc;
@group(0) @binding(3) var thickness: texture_2d<f32>;
// rgb: parts left of the beam; w: the same at 550 nm, however little comes through in all.
@group(0) @binding(4) var<storage, read_write> beam: array<vec4<f32>>;
// The same summed over the parts of the disc before this one; that of the first layer is in `beam` itself.
@group(0) @binding(5) var<storage, read_write> sums: array<vec4<f32>>;

// Part of extinction that takes light out of the beam.
fn out_of_beam() -> vec3<f32> {
    return select(vec3<f32>(1.0), frame.medium.beam, view.peak == 1u);
}

// What is left after so much cloud. Green is 550 nm.
fn light_after(path_m: f32) -> vec4<f32> {
    let left = exp(-out_of_beam() * frame.medium.extinction * path_m);
    return vec4<f32>(beam_bounded(left, path_m), left.g);
}

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= view.size.x || id.y >= view.rows {
        return;
    }
    let uv = texel_place(view, id.xy);
    let at = id.y * view.size.x + id.x;
    var left = vec4<f32>(0.0);
    if disc.first > 0u {
        left = beam[at];
        if view.first == 0u {
            left = sums[at];
        }
    }
    var i = 0u;
    loop {
        let place = disc.places[i];
        left += light_of(place, uv + place.shift_uv);
        continuing {
            i++;
            break if i >= disc.count;
        }
    }
    let unfinished = disc.first + disc.count < disc.total;
    if unfinished && view.first == 0u {
        sums[at] = left;
        return;
    }
    if !unfinished {
        left /= f32(disc.total);
        if view.first == 0u {
            left *= beam[at];
        }
    }
    beam[at] = left;
}
