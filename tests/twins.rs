//! Claims about every pass that runs on the device: it computes what its twin in `reference` computes. Each twin is fed
//! what the device itself had as input, so that errors do not pile up from pass to pass.
//!
//! Tolerances are bounds on single precision. [`ROUND`] times the number of roundings covers sums and products. Where a
//! pass reads a map, rounding of the place that it reads moves what is read by at most [`place_error`] times the map's
//! largest step; what that does to a ray through the cloud is asked from the twin itself, on a map that is raised by
//! just that. A real GPU rounds filter weights to 8 bits, 1/512 of a step, which no bound on rounding covers: there the
//! twins check the unfiltered samples, and `filtered_and_unfiltered_samples_agree` bounds what the filter adds.

#![expect(clippy::unwrap_used, reason = "a test stops where it fails")]
#![expect(clippy::panic, reason = "a test fails by panicking")]

#[path = "common/compare.rs"]
mod compare;
#[path = "common/twin_sky.rs"]
mod sky;
#[path = "common/twin.rs"]
mod twin;

use compare::Tolerance;
use glam::{DVec2, DVec4};
use serde_json::json;
use sky::{Sky, pattern, water, waves};
use skyloom::field::{Law, Noise};
use skyloom::gpu::HostMap;
use skyloom::gpu::layout::{Columns, Frame, Streets, Trails, Turned, View};
use skyloom::method::{Method, Transport};
use skyloom::reference::cloud::Shaded;
use skyloom::reference::{self, Map};
use skyloom::render::{Renderer, Stages, Watch};
use skyloom::slice::HostSlab;
use twin::{
    BEAM_REL, CANCEL, DIRECTION, ROUND, SLICE_REL, TABLE_REL, allowed, assert_size, check, check_each, check_map,
    is_software, largest, largest_step, lifted, map, maps, open, place_error, unfiltered, values,
};

/// Sum of four values and a product with a power of 2: three roundings.
const DOWNSAMPLE: Tolerance = Tolerance::new(0.0, 3.0 * ROUND);
/// Cells: an angle up to 2 pi (2.4e-7) and its sine (1.2e-7) make 1e-6 in a gradient noise; the bend is that times 0.22 *
/// 1.56 / (1.0888 * 0.2151), on two feature distances 4e-6; the steepest of the profiles, that of open cells, times 8.1,
/// gives 3.3e-5. The octaves add 1.4e-5 in the same way.
const CELLS: Tolerance = Tolerance::new(5e-5, 0.0);
/// What a half float may be off, however a device rounds to it.
const HALF: f64 = 1.0 / 1024.0;
/// An octave: two slopes of up to 1.4 at an angle that is known to 2.4e-7, and its sine to 1.2e-7; blends of four. Kept as halves.
const NOISE: Tolerance = Tolerance::new(2e-6, HALF);
/// Sixteen products of up to 1 and their sum.
const VELOCITY: Tolerance = Tolerance::new(16.0 * ROUND * 3.0, 0.0);
/// Up to thirteen products a layer and their sum, values of up to 6 in all.
const BLEND: f64 = 32.0 * ROUND * 6.0;
/// exp of a rounded exponent (3 ROUND of at most 3, and the driver's 1.1e-6), relative.
const WATER_EXP: f64 = 2e-6;
/// Products and roots from water path to the square of thickness, relative.
const WATER_REL: f64 = 16.0 * ROUND;
/// Software devices filter with full weights as we do; of the largest value of a texture. See [`place_error`]: 1e-5 of a
/// step, times the few texels that a path adds up.
const SOFTWARE_FILTER: f64 = 3e-4;
/// 1/512 of the largest step on each axis, which can be as large as the largest value; a path adds up a few.
const HARDWARE_FILTER: f64 = 2e-2;

/// Distance over which a ray crosses the layer, in domains.
fn reach_uv(frame: &Frame, cosine: f64) -> f64 {
    f64::from(frame.place.depth_m / frame.place.extent_m) * (1.0 - cosine * cosine).max(0.0).sqrt() / cosine
}

/// A thickness map as a device may read it at worst: see [`place_error`]. Its heights are rounded too.
fn raised(frame: &Frame, map: &Map, cosine: f64) -> Map {
    lifted(map, misread_m(frame, map, cosine))
}

fn misread_m(frame: &Frame, map: &Map, cosine: f64) -> f64 {
    place_error(map, reach_uv(frame, cosine)) + 4.0 * ROUND * f64::from(frame.place.depth_m)
}

fn check_field(stages: &Stages) {
    let field = stages.field.as_ref().unwrap();
    if let Some(motion) = &field.motion {
        let velocity = reference::field_velocity::main(&motion.eddies, &maps(&motion.bands));
        check_map("field_velocity", &motion.velocity, &velocity, VELOCITY);
        let (velocity, before) = (map(&motion.velocity), map(&motion.before));
        let after = reference::field_displace::main(&motion.step, &velocity, &before);
        // Places are rounded twice; the way itself is a sum of products.
        let places = place_error(&before, 1.0) + f64::from(motion.step.length_uv) * place_error(&velocity, 1.0);
        check_map("field_displace", &field.displacement, &after, Tolerance::new(places + 1e-8, 8.0 * ROUND));
    }
    let displacement = map(&field.displacement);
    let blended = match (&field.synthetic, &field.image) {
        (Some(synthetic), _) => {
            for (octaves, noise) in &synthetic.octaves {
                match octaves {
                    Noise::Plain(octaves) => {
                        check_map("field_octaves", noise, &reference::field_octaves::main(octaves), NOISE);
                    }
                    Noise::Turned(octaves) => {
                        check_map("field_turned", noise, &reference::field_turned::main(octaves), turned(octaves));
                    }
                }
            }
            let (cells, cells_map) = &synthetic.cells;
            if let Some(cells) = cells {
                check_map("field_cells", cells_map, &reference::field_cells::main(cells), CELLS);
            }
            if let Some(streets) = &synthetic.streets {
                check_map("field_streets", cells_map, &reference::field_streets::main(streets), waves_of(streets));
            }
            let octaves: Vec<_> = synthetic.octaves.iter().map(|(_, noise)| map(noise)).collect();
            if let Some((trails, heads)) = &synthetic.trails {
                check_trails(trails, &octaves, heads, cells_map);
            }
            let cells_map = map(cells_map);
            let blended = reference::field_blend::main(&field.blend, &displacement, &octaves, &cells_map);
            let weights = [field.blend.low, field.blend.middle, field.blend.high];
            let of_octaves: f64 = octaves
                .iter()
                .zip(weights)
                .map(|(map, weights)| weights.iter().map(|w| f64::from(w.abs())).sum::<f64>() * place_error(map, 3.0))
                .sum();
            let of_cells = f64::from(field.blend.cells) * place_error(&cells_map, 3.0);
            (blended, of_octaves + of_cells + BLEND)
        }
        (None, Some(image)) => {
            let blended = reference::field_image::main(&field.blend, &displacement, &map(image));
            (blended, place_error(&map(image), 3.0) + BLEND * f64::from(stages.frame.place.depth_m))
        }
        _ => panic!("a field is synthetic or an image"),
    };
    let (blended, allowed) = blended;
    let blended: Vec<f64> = blended.texels.iter().map(|texel| texel[0]).collect();
    check("field_blend", &field.field, &blended, Tolerance::new(allowed, 0.0));

    // A value at the edge of a bin may fall on either side: sums up to each edge differ by few.
    let counts = reference::field_histogram::main(&field.histogram, field.counts.len(), &field.field);
    let (mut device, mut twin) = (0_i64, 0_i64);
    for (a, b) in field.counts.iter().zip(&counts) {
        (device, twin) = (device + i64::from(*a), twin + i64::from(*b));
        assert!((device - twin).abs() <= 3, "{device} values of {} up to an edge, not {twin}", field.field.len());
    }
    assert_eq!(device, twin);

    check_bounds(stages);
    let Some(synthetic) = &field.synthetic else { return };
    let transfer = match &synthetic.law {
        Law::Thickness(transfer) => transfer,
        Law::Columns(law, edges) => return check_columns(stages, law, edges),
    };
    // Thickness is a root: near the edge of a cloud, a rounding of the water path is a large part of it. Its square is
    // the water path itself.
    let thickness = reference::field_thickness::main(transfer, &field.field);
    assert_size("field_thickness", &stages.thickness, &thickness);
    let square: Vec<f64> = thickness.texels.iter().map(|texel| texel[0] * texel[0]).collect();
    let device: Vec<f32> = stages.thickness.data.iter().map(|height| height * height).collect();
    let scale = f64::from(transfer.scale_m).powi(2);
    let water = |gaussian: &f32| (f64::from(transfer.spread) * f64::from(*gaussian)).exp();
    let allowed: Vec<f64> = field
        .field
        .iter()
        .zip(&square)
        .map(|(gaussian, square)| scale * WATER_EXP * water(gaussian) + WATER_REL * square)
        .collect();
    check_each("field_thickness, squared", &device, &square, &allowed);
}

/// A place on a turned lattice is a difference of two products, each rounded, of up to as many steps as the lattice has; a noise
/// changes by up to twice its way in a step, and there are two.
fn turned(octaves: &Turned) -> Tolerance {
    let steps = octaves.turns.as_flattened().iter().map(|step| f64::from(step.abs())).fold(0.0, f64::max);
    Tolerance::new(2e-6 + 8.0 * ROUND * steps, HALF)
}

/// Waves: an angle of up to half a turn whose part of a turn, up to 2, is rounded twice (1.5e-6), and its cosine (1.2e-7), by
/// amplitude; and their sum.
fn waves_of(streets: &Streets) -> Tolerance {
    let sum: f64 = streets.waves.iter().map(|wave| f64::from(wave[3])).sum();
    Tolerance::new(2e-6 * sum + ROUND * sum * f64::from(streets.count), 0.0)
}

/// Trails. Heads are sums of exponentials of noise, which is off by what its places are, up to two domains away: relative errors. Trails
/// are logarithms of sums of heads, off by what those read elsewhere are, of which the least a column holds is the worst; and by
/// the logarithm of the driver.
fn check_trails(trails: &Trails, octaves: &[Map], heads: &HostMap, drawn: &HostMap) {
    let weights = [trails.low, trails.middle, trails.high];
    let off = |(map, weights): (&Map, [f32; 4])| {
        weights.iter().map(|w| f64::from(w.abs())).sum::<f64>() * place_error(map, 2.0)
    };
    let of_octaves: f64 = octaves.iter().zip(weights).map(off).sum();
    check_map(
        "field_heads",
        heads,
        &reference::field_heads::main(trails, octaves),
        Tolerance::new(0.0, of_octaves + 4e-6),
    );
    let heads = map(heads);
    // What pushes trails aside is off by its own place, and heads change by that way.
    let aside_uv = f64::from(trails.aside_uv[0].hypot(trails.aside_uv[1])) * 1.5 * place_error(&octaves[0], 1.0);
    let pushed = 2.0 * aside_uv * f64::from(trails.width) * largest_step(&heads);
    let twin = reference::field_trails::main(trails, &octaves[0], &heads);
    let least = twin.texels.iter().map(|texel| texel[0]).fold(f64::INFINITY, f64::min);
    let ice = (least / f64::from(trails.per_unit) + f64::from(trails.centre)).exp();
    let allowed = ((place_error(&heads, 2.0) + pushed) / ice + 4e-6) * f64::from(trails.per_unit);
    check_map("field_trails", drawn, &twin, Tolerance::new(allowed, 0.0));
}

/// Columns of a synthetic field: a path between two edges of a bin, whose place is known to its rounding; the power and exp of the
/// driver, relative, make heights.
fn check_columns(stages: &Stages, law: &Columns, edges: &[f32]) {
    let field = stages.field.as_ref().unwrap();
    let twin = reference::field_columns::main(law, stages.thickness.width as usize, &field.field, edges);
    assert_size("field_columns", &stages.thickness, &twin);
    let steepest = edges.windows(2).map(|pair| f64::from(pair[1] - pair[0])).fold(0.0, f64::max);
    // Bins are numbered up to 2048.
    let path_m = steepest * 4.0 * ROUND * 2048.0;
    // The steepest of thickness is at a gap, where it is the root of a path that is known as well as that.
    let height_m = f64::from(law.scale_m) * path_m.powf(0.6) + 2e-5 * f64::from(law.clip_m);
    for (device, twin) in stages.thickness.data.chunks_exact(4).zip(&twin.texels) {
        for (channel, allowed) in [path_m, height_m, height_m].into_iter().enumerate() {
            let off = (f64::from(device[channel]) - twin[channel]).abs();
            assert!(off <= allowed, "field_columns: {device:?}, not {twin:?}; allowed {allowed}");
        }
    }
}

fn check_bounds(stages: &Stages) {
    let ragged = stages.thickness.channels == 4;
    let thickness = map(&stages.thickness);
    let twin =
        if ragged { reference::field_bounds::columns(&thickness) } else { reference::field_bounds::main(&thickness) };
    // Least and greatest values are not rounded.
    check_map("field_bounds", &stages.bounds, &twin, Tolerance::new(0.0, 0.0));
}

/// Where the sun falls on the cloud's top, and how it spreads there.
fn check_entry(stages: &Stages, thickness: &Map, higher: &Map) {
    let frame = &stages.frame;
    let entry = |thickness| reference::sun_entry::main(frame, thickness);
    let (twin, other) = (entry(thickness), entry(higher));
    // A slope is a difference of two samples, over a texel; at low sun it is large against the cosine.
    let texel_m = f64::from(frame.place.extent_m) / thickness.width as f64;
    let slope = 4.0 * place_error(thickness, 1.0) / texel_m / f64::from(frame.sun.slant_cosine);
    let (values_of, other) = (values(&twin, &stages.entry), values(&other, &stages.entry));
    let bounds = allowed(&values_of, &other, Tolerance::new(slope + CANCEL, BEAM_REL + 8.0 * ROUND));
    check_each("sun_entry", &stages.entry.data, &values_of, &bounds);

    if stages.entry != stages.entering {
        let mut blurred = map(&stages.entry);
        for axis in [[1, 0], [0, 1]] {
            blurred = reference::blur::main(&skyloom::light::blur(axis, stages.blur_texels), &blurred);
        }
        // Sums of up to 193 positive terms and their weights, twice; exp of the driver.
        check_map("blur", &stages.entering, &blurred, Tolerance::new(1e-36, 2.0 * 400.0 * ROUND + 4e-6));
    }
}

/// Light of the layer's maps: every pass is fed with what the device itself had.
fn check_sunlight(stages: &Stages) {
    let (frame, tables) = (&stages.frame, &stages.tables);
    let [thickness, own_entry, entering, above, above_beam, transmittance, reflectance, diffuse] = [
        &stages.thickness,
        &stages.entry,
        &stages.entering,
        &stages.above,
        &stages.above_beam,
        &tables.transmittance,
        &tables.reflectance,
        &tables.diffuse,
    ]
    .map(map);
    let higher = raised(frame, &thickness, frame.sun.slant_cosine.into());

    // A lattice asks for no entry.
    if stages.lattice.is_none() {
        check_entry(stages, &thickness, &higher);
    }

    let base = |thickness| {
        let (transmittance, reflectance) = (&transmittance, &reflectance);
        if let Some(lattice) = &stages.lattice {
            let [down, up, factors] = [&lattice.down, &lattice.up, &lattice.factors].map(map);
            let (down, up, factors, above) = (&down, &up, &factors, &above);
            let maps =
                reference::lattice_light::Maps { thickness, transmittance, reflectance, down, up, factors, above };
            return reference::lattice_light::main(frame, &lattice.light, &maps);
        }
        let maps = reference::base_light::Maps {
            thickness,
            transmittance,
            reflectance,
            entry: &own_entry,
            blurred: &entering,
            above: &above,
        };
        reference::base_light::main(frame, &maps)
    };
    let (twin, other) = (base(&thickness), base(&higher));
    let places = place_error(&above, 1.0) * largest(&own_entry).max(1.0);
    for (name, gpu, twin, other) in [
        ("base_light, beam", &stages.beam, &twin.beam, &other.beam),
        ("base_light, tilted", &stages.tilted, &twin.tilted, &other.tilted),
        ("base_light, entered", &stages.entered, &twin.entered, &other.entered),
        ("base_light, reflected", &stages.reflected, &twin.reflected, &other.reflected),
    ] {
        assert_size(name, gpu, twin);
        let (twin, other) = (values(twin, gpu), values(other, gpu));
        // Differences of what comes through and the beam, parts of 1, times what enters.
        let scale = 1.0 + largest(&own_entry);
        let tolerance = Tolerance::new(TABLE_REL * scale + places, TABLE_REL);
        check_each(name, &gpu.data, &twin, &allowed(&twin, &other, tolerance));
    }

    let column = |thickness| reference::base_column::main(frame, thickness, &transmittance, &diffuse);
    let (twin, other) = (column(&thickness), column(&higher));
    for (i, (name, gpu)) in [
        ("base_column, sun", &stages.column),
        ("base_column, through", &stages.through),
        ("base_column, not reflected", &stages.not_reflected),
    ]
    .into_iter()
    .enumerate()
    {
        assert_size(name, gpu, &twin[i]);
        let (twin, other) = (values(&twin[i], gpu), values(&other[i], gpu));
        check_each(name, &gpu.data, &twin, &allowed(&twin, &other, Tolerance::new(0.0, TABLE_REL)));
    }

    let [beam, tilted, entered, reflected, column] =
        [&stages.beam, &stages.tilted, &stages.entered, &stages.reflected, &stages.column].map(map);
    let maps = reference::sun_share::Maps {
        beam: &beam,
        tilted: &tilted,
        entered: &entered,
        column: &column,
        reflected: &reflected,
        above: &above,
        above_beam: &above_beam,
    };
    let twin = reference::sun_share::main(frame, &stages.share, &maps);
    // A few sums and products of positive terms, a ratio.
    // Devices may flush what is below the smallest normal number.
    let tolerance = Tolerance::new(1e-36, 8.0 * ROUND);
    check_map("sun_share, below", &stages.shares[0], &twin[0], tolerance);
    let places = place_error(&above, 1.0) * largest(&own_entry) * f64::from(stages.share.reflect_scale[0]);
    check_map("sun_share, above", &stages.shares[1], &twin[1], Tolerance { abs: places + tolerance.abs, ..tolerance });
}

/// What the host reads of the lowest layer's maps: means over coarser texels; a map of one texel is the same everywhere.
/// Returns how many levels coarser.
fn check_means(stages: &Stages) -> u32 {
    let read = &stages.columns[0];
    let mut levels = 0;
    for (fine, read) in [
        (&stages.beam, &read.beam),
        (&stages.tilted, &read.tilted),
        (&stages.entered, &read.entered),
        (&stages.reflected, &read.reflected),
        (&stages.through, &read.through),
        (&stages.not_reflected, &read.not_reflected),
    ] {
        let mut level = map(fine);
        levels = 0;
        while level.texels.len() > read.len() {
            level = reference::downsample::main(&level);
            levels += 1;
        }
        let twin: Vec<f64> = level.texels.iter().cycle().take(read.len()).flatten().copied().collect();
        let device: Vec<f32> = read.iter().flatten().copied().collect();
        check("downsample", &device, &twin, Tolerance::new(0.0, DOWNSAMPLE.rel * f64::from(levels)));
        assert!(level.texels.len() == read.len() || level.texels.len() == 1);
    }
    levels
}

fn check_thickness(stages: &Stages) {
    let thickness = map(&stages.thickness);
    let twin = reference::thickness::main(&stages.frame, &stages.view, &thickness);
    check("thickness", &stages.output, &twin, Tolerance::new(place_error(&thickness, 1.0), 4.0 * ROUND));
}

/// What one layer leaves of the beam, with its peak where the view says so.
fn ground_sun(stages: &Stages, view: &View, thickness: &Map) -> Vec<DVec4> {
    reference::ground_sun::main(&stages.frame, &stages.disc, view, thickness, &map(&stages.tables.transmittance))
}

fn check_shadow(stages: &Stages) {
    let frame = &stages.frame;
    let thickness = map(&stages.thickness);
    let twin = |thickness: &Map| reference::shadow::main(frame, &ground_sun(stages, &stages.view, thickness));
    let (shadow, other) = (twin(&thickness), twin(&raised(frame, &thickness, frame.sun.slant_cosine.into())));
    check_each("shadow", &stages.output, &shadow, &allowed(&shadow, &other, Tolerance::new(CANCEL, BEAM_REL)));
}

fn check_irradiance(stages: &Stages) {
    let frame = &stages.frame;
    let (thickness, gathered) = (map(&stages.thickness), map(&stages.gathered));
    let twin = |thickness: &Map| {
        let [with_peak, beam] =
            [1, stages.view.peak].map(|peak| ground_sun(stages, &View { peak, ..stages.view }, thickness));
        reference::irradiance::main(frame, &stages.view, [&with_peak, &beam], &gathered)
    };
    let (light, other) = (twin(&thickness), twin(&raised(frame, &thickness, frame.sun.slant_cosine.into())));
    let sun = f64::from(frame.sun.irradiance[0] * frame.sun.cosine);
    let tolerance = Tolerance::new(place_error(&gathered, 1.0) + CANCEL * sun, BEAM_REL);
    check_each("irradiance", &stages.output, &light, &allowed(&light, &other, tolerance));
}

/// What rounding does to flat rays, in what it does to others.
const FLAT_VIEWS: f64 = 2.0;

fn check_cloud(stages: &Stages) {
    let (frame, tables) = (&stages.frame, &stages.tables);
    let slab = stages.slab.as_ref().unwrap();
    let [thickness, transmittance, reflectance] =
        [&stages.thickness, &tables.transmittance, &tables.reflectance].map(map);
    let side = stages.light.from_below.len().isqrt();
    let light_map = |light: &[[f32; 3]]| Map::from_f32(side, side, 3, light.as_flattened());
    let (from_below, from_above) = (light_map(&stages.light.from_below), light_map(&stages.light.from_above));
    let sun_share = map(&stages.shares[stages.view.from_above as usize]);
    let view = &stages.view;
    let twin = |frame: &Frame, thickness: &Map| {
        let maps = reference::cloud::Maps {
            transmittance: &transmittance,
            reflectance: &reflectance,
            from_below: &from_below,
            from_above: &from_above,
            sun_share: &sun_share,
            behind: &from_above,
            reaches: None,
        };
        let sunlight = reference::cloud::sunlight(frame, tables, slab);
        let nothing = vec![Shaded::default(); (view.size[0] * view.rows) as usize];
        reference::cloud_plane::rays_behind(frame, view, thickness, &maps, sunlight, &nothing)
    };
    // Each ray by itself: the errors of several do not cancel.
    let flat =
        |rays: &[Vec<Shaded>]| -> Vec<f64> { rays.iter().flatten().flat_map(|ray| ray.texel().to_array()).collect() };
    let rays = twin(frame, &thickness);
    let cloud = flat(&rays);
    let cosine = if view.perspective == 1 { 1.0 } else { f64::from(view.towards[2]).abs() };
    let misread_m = misread_m(frame, &thickness, cosine);
    // Lower as well: a ray may miss the cloud that it only just touches, and meet another far away.
    let [higher, lower] = [misread_m, -misread_m].map(|by_m| flat(&twin(frame, &lifted(&thickness, by_m))));
    let mut turned_frame = *frame;
    turned_frame.sun.towards[0] += DIRECTION;
    let turned = flat(&twin(&turned_frame, &thickness));
    let light = largest(&from_above) + largest(&from_below);
    // Where the ray meets the cloud is known as well as its path is: a step of the share map, and of the light's.
    let reach = reach_uv(frame, cosine);
    let places = place_error(&from_below, reach) + place_error(&from_above, reach);
    let shares = place_error(&sun_share, reach) / largest(&sun_share).max(1e-30);
    let of_method = match slab {
        HostSlab::Forward(_) | HostSlab::Analytic(_) => TABLE_REL,
        HostSlab::Tabulated(_) => SLICE_REL,
    };
    let tolerance = Tolerance::new(CANCEL * light.max(1.0) + places, shares + of_method);
    let mut bounds = allowed(&cloud, &higher, tolerance);
    for other in [lower, turned] {
        bounds.iter_mut().zip(cloud.iter().zip(&other)).for_each(|(bound, (a, b))| *bound += (a - b).abs());
    }
    // Alpha knows nothing of light.
    let alpha = allowed(&cloud, &higher, Tolerance::new(CANCEL, BEAM_REL));
    bounds.iter_mut().zip(alpha).skip(3).step_by(4).for_each(|(bound, alpha)| *bound = alpha);
    // Where a flat ray only just misses a cloud it meets another far away, and what is behind is found more coarsely.
    if reference::path_seen::is_flat(view.towards.map(f64::from).into()) {
        bounds.iter_mut().for_each(|bound| *bound *= FLAT_VIEWS);
    }
    let texels = |values: &[f64]| -> Vec<f64> {
        let mut values = values.chunks(4);
        let mean = |rays: &Vec<Shaded>| {
            let sum = values.by_ref().take(rays.len()).fold([0.0; 4], |sum, ray| [0, 1, 2, 3].map(|c| sum[c] + ray[c]));
            sum.map(|sum| sum / rays.len() as f64)
        };
        rays.iter().flat_map(mean).collect()
    };
    check_each("cloud", &stages.output, &texels(&cloud), &texels(&bounds));
}

/// Alpha alone: where the ray meets the cloud does not matter.
fn check_alpha(stages: &Stages) {
    let (frame, view, thickness) = (&stages.frame, &stages.view, map(&stages.thickness));
    let alpha = |thickness: &Map| {
        let levels = reference::field_level::levels(thickness);
        reference::frame::image(view, |place| {
            let alpha = |place: &DVec2| {
                let path_m = reference::cloud_plane::view_ray(frame, view, &levels, *place).path_m;
                -(-f64::from(frame.medium.extinction_550) * path_m).exp_m1()
            };
            let places = reference::cloud_plane::view_places(frame, view, thickness, place);
            [places.iter().map(alpha).sum::<f64>() / places.len() as f64]
        })
    };
    let (twin, other) = (alpha(&thickness), alpha(&raised(frame, &thickness, view.towards[2].abs().into())));
    let device: Vec<f32> = stages.output.iter().skip(3).step_by(4).copied().collect();
    check_each("alpha", &device, &twin, &allowed(&twin, &other, Tolerance::new(CANCEL, BEAM_REL)));
}

const SUNS: [f64; 5] = [0.0, 50.0, 85.0, 89.9, 95.0];

fn skies(zenith_deg: f64) -> [Sky; 2] {
    [Sky::at(zenith_deg), Sky::hazy(zenith_deg)]
}

#[test]
fn fields_of_every_pattern() {
    for name in ["closed", "open", "fractal"] {
        for coverage in [1.0, 0.6] {
            eprintln!("{name}, coverage {coverage}");
            let sky = Sky { thickness: pattern(name, coverage), ..Sky::at(50.0) };
            check_field(&sky.stages("thickness", &[]));
        }
    }
}

/// Turned noise, and columns that stand or hang.
#[test]
fn fields_of_columns() {
    for (name, coverage, spread) in [
        ("closed", 1.0, 0.3),
        ("open", 0.6, 0.9),
        ("fractal", 0.4, 1.5),
        ("open", 0.0, 1.0),
        ("streets", 0.5, 0.9),
        ("cirrus", 0.8, 1.0),
    ] {
        let mut thickness = pattern(name, coverage);
        thickness["law"] = json!("gamma");
        thickness["spread"] = json!(spread);
        for (top_m, profile) in [(None, "uniform"), (Some(2400.0), "adiabatic")] {
            let sky = Sky { thickness: thickness.clone(), top_m, profile, ..Sky::at(50.0) };
            check_field(&sky.stages("thickness", &[]));
        }
    }
}

#[test]
fn fields_that_move() {
    let mut streets = pattern("streets", 0.5);
    streets["law"] = json!("gamma");
    let mut cirrus = pattern("cirrus", 0.8);
    cirrus["law"] = json!("gamma");
    for (thickness, name) in [
        (pattern("closed", 0.8), "closed"),
        (pattern("fractal", 0.5), "fractal"),
        (streets, "streets"),
        (cirrus, "cirrus"),
        (waves(), "image"),
    ] {
        for (turbulence_m_s, time) in [(1.5, "0"), (1.5, "1234.5"), (0.01, "100"), (50.0, "1e9")] {
            eprintln!("{name}, eddies of {turbulence_m_s} m/s, at {time} s");
            let sky = Sky { thickness: thickness.clone(), turbulence_m_s, ..Sky::at(50.0) };
            check_field(&sky.stages("thickness", &[("time", time)]));
        }
    }
}

#[test]
fn light_between_cloud_and_ground() {
    for sky in SUNS.into_iter().flat_map(skies) {
        eprintln!("sun at {}", sky.zenith_deg);
        let stages = sky.stages("irradiance", &[("time", "777")]);
        check_sunlight(&stages);
        check_means(&stages);
    }
    // A high base has a grid of the exchange that is coarser than the maps.
    let high = Sky { base_m: 5000.0, ..Sky::at(60.0) };
    assert_eq!(check_means(&high.stages("irradiance", &[])), 2);
    check_sunlight(&Sky { profile: "adiabatic", ..Sky::at(60.0) }.stages("irradiance", &[]));
    for (transport, _) in Transport::ALL {
        eprintln!("{transport}");
        check_sunlight(&Sky::at(60.0).stages("irradiance", &[("transport", transport)]));
    }
}

#[test]
fn light_of_a_white_ground_under_an_even_thick_cloud() {
    let thickness = json!({"kind": "uniform", "metres": 2000});
    let sky = Sky { thickness, albedo: [1.0, 0.9, 0.0], ..Sky::at(50.0) };
    let stages = sky.stages("irradiance", &[]);
    check_sunlight(&stages);
    check_means(&stages);
}

#[test]
fn thickness_that_the_wind_moved() {
    check_thickness(&Sky::at(50.0).stages("thickness", &[("time", "1234.5"), ("size", "96")]));
}

#[test]
fn shadows() {
    for sky in SUNS.into_iter().flat_map(skies) {
        for peak in ["true", "false"] {
            eprintln!("sun at {}, peak {peak}", sky.zenith_deg);
            check_shadow(&sky.stages("shadow", &[("peak", peak), ("time", "300"), ("size", "96")]));
        }
    }
}

#[test]
fn shadows_of_images_of_any_size() {
    for (number, size) in sky::WAVES_SIZES.iter().enumerate() {
        for zenith_deg in [0.0, 60.0, 85.0, 89.9, 89.9999] {
            eprintln!("{size:?}, sun at {zenith_deg}");
            let sky = Sky { thickness: sky::waves_of(number), ..Sky::hazy(zenith_deg) };
            let query = [("time", "300"), ("size", "96")];
            let stages = sky.stages("shadow", &query);
            check_bounds(&stages);
            check_shadow(&stages);
            if zenith_deg > 60.0 {
                check_shadow(&unfiltered().inspect(&sky.job("shadow", &query), &Watch::default()).unwrap());
            }
        }
    }
}

#[test]
fn views_along_lines_between_texels() {
    for (number, (width, _)) in sky::WAVES_SIZES.iter().enumerate() {
        for azimuth in ["0", "90", "180", "270"] {
            let sky = Sky { thickness: sky::waves_of(number), ..Sky::hazy(50.0) };
            // Rays that start at centres of texels and go along a row or column of them, through the whole domain.
            let (direction, size) = (format!("89.9,{azimuth}"), width.to_string());
            for view in ["below", "above"] {
                eprintln!("{width}, {view}, {direction}");
                check_alpha(&sky.stages("cloud", &[("view", view), ("direction", &direction), ("size", &size)]));
            }
        }
    }
}

#[test]
fn irradiances() {
    for sky in SUNS.into_iter().flat_map(skies) {
        for query in [
            [("component", "total"), ("peak", "true")],
            [("component", "direct"), ("peak", "false")],
            [("component", "diffuse"), ("peak", "true")],
        ] {
            eprintln!("sun at {}, {query:?}", sky.zenith_deg);
            check_irradiance(&sky.stages("irradiance", &query));
        }
    }
}

/// Views of a cloud: straight, slanted, into the sun, close to the horizon, and of a viewer at a place.
const VIEWS: [&[(&str, &str)]; 8] = [
    &[("view", "below")],
    &[("view", "below"), ("direction", "50,330")],
    &[("view", "below"), ("direction", "75,40"), ("time", "300")],
    &[("view", "below"), ("eye", "300,-2000,2")],
    &[("view", "above")],
    &[("view", "above"), ("direction", "60,150"), ("size", "50")],
    &[("view", "above"), ("direction", "89,20")],
    &[("view", "above"), ("eye", "-4000,1000,12000")],
];

#[test]
fn clouds_of_every_view_and_sun() {
    let methods: Vec<&str> = Method::fast().map(Method::name).collect();
    for (number, sky) in SUNS.into_iter().flat_map(skies).enumerate() {
        for (view, turn) in VIEWS.into_iter().zip(number..) {
            // Each method meets every view and every sun, though not every pair of them: `water_droplets` has all methods in a view.
            let method = methods[turn % methods.len()];
            eprintln!("sun at {}, {view:?}, {method}", sky.zenith_deg);
            check_cloud(&sky.stages("cloud", &[view, &[("method", method)]].concat()));
        }
    }
}

fn rainy() -> Sky {
    Sky { droplets: water(), thickness: pattern("closed", 0.8), ..Sky::at(35.0) }
}

#[test]
fn water_droplets() {
    for view in VIEWS {
        for method in Method::fast().map(Method::name) {
            eprintln!("{view:?}, {method}");
            check_cloud(&rainy().stages("cloud", &[view, &[("method", method)]].concat()));
        }
    }
    let stages = rainy().stages("irradiance", &[]);
    check_sunlight(&stages);
    check_means(&stages);
    check_irradiance(&stages);
}

#[test]
fn unfiltered_samples() {
    for sky in [Sky::at(50.0), Sky::hazy(89.9)] {
        let stages = |texture| unfiltered().inspect(&sky.job(texture, &[("time", "300")]), &Watch::default()).unwrap();
        let cloud = stages("cloud");
        check_field(&cloud);
        check_sunlight(&cloud);
        check_means(&cloud);
        check_cloud(&cloud);
        check_thickness(&stages("thickness"));
        check_shadow(&stages("shadow"));
        check_irradiance(&stages("irradiance"));
    }
}

const TEXTURES: [&str; 4] = ["cloud", "shadow", "irradiance", "thickness"];

#[test]
fn filtered_and_unfiltered_samples_agree() {
    let mut filtered = open(true);
    let share = if is_software(&filtered) { SOFTWARE_FILTER } else { HARDWARE_FILTER };
    for texture in TEXTURES {
        let job = rainy().job(texture, &[]);
        let with = filtered.render(&job, &Watch::default()).unwrap().data;
        let without = unfiltered().render(&job, &Watch::default()).unwrap().data;
        let without: Vec<f64> = without.into_iter().map(f64::from).collect();
        let largest = without.iter().copied().fold(0.0, f64::max);
        check(texture, &with, &without, Tolerance::new(share * largest, share));
    }
}

#[test]
fn the_same_request_gives_the_same_bytes() {
    let mut fresh = open(true);
    let mut used = open(true);
    for texture in TEXTURES {
        let render = |renderer: &mut Renderer, sky: &Sky| {
            let texture = renderer.render(&sky.job(texture, &[]), &Watch::default()).unwrap();
            texture.data.into_iter().map(f32::to_bits).collect::<Vec<_>>()
        };
        let first = render(&mut used, &Sky::at(50.0));
        // More skies than a renderer keeps: the last is made anew.
        for zenith_deg in 0..12 {
            assert_ne!(render(&mut used, &rainy()), first, "{texture}");
            render(&mut used, &Sky::at(f64::from(zenith_deg)));
        }
        assert_eq!(render(&mut used, &Sky::at(50.0)), first, "{texture} again");
        assert_eq!(render(&mut fresh, &Sky::at(50.0)), first, "{texture} of a fresh renderer");
    }
}
