//! Claims about the shaders' text that need no device: they are valid, and what they share with the host is the same on
//! both sides.

#![expect(clippy::unwrap_used, reason = "a test stops where it fails")]
#![expect(clippy::panic, reason = "a test fails by panicking")]

use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{Expression, Literal, Module, ShaderStage, TypeInner};
use skyloom::cumulus::{self, dressed};
use skyloom::gpu::layout::{
    self, AEROSOL_ROWS, AirColours, Backdrop, Blend, Blur, Cells, Columns, Cumulus, CumulusSurface, Disc, DiscPlace,
    DiscWay, Eddies, Frame, Histogram, LatticeLight, Medium, Octaves, Placement, Remainder, Share, SkyView, Step,
    Streets, Sun, SunMaps, Trails, Transfer, Turned, View,
};
use skyloom::gpu::shaders::{self, Shader};
use skyloom::projection::SphereLayout;
use skyloom::reference::{cloud_lattice, cloud_plane, cloud_sky, path_sampled, path_seen, sky, sphere};
use skyloom::reference::{cumulus as seen, cumulus_forward, cumulus_surface};
use skyloom::slab::fluxes;
use skyloom::slab::phases as tables;
use skyloom::slab::radiance::{aureole, table};
use std::mem::{offset_of, size_of};

/// Size of a struct and its fields in order, with their offsets.
type Layout = (u32, Vec<(String, u32)>);

fn parse(source: &str) -> Module {
    naga::front::wgsl::parse_str(source).unwrap_or_else(|error| panic!("{}", error.emit_to_string(source)))
}

fn parsed(shader: &Shader) -> Module {
    parse(&shader.source(true))
}

fn wgsl_layout(module: &Module, name: &str) -> Layout {
    let (_, ty) = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(name)).unwrap();
    let TypeInner::Struct { members, span } = &ty.inner else { panic!("{name} is not a struct") };
    (*span, members.iter().map(|member| (member.name.clone().unwrap(), member.offset)).collect())
}

macro_rules! host_layout {
    ($ty:ident { $($field:ident),* $(,)? }) => {{
        // Fails to compile when a field is left out.
        let $ty { $($field: _),* } = $ty::default();
        let fields = vec![$((stringify!($field).to_owned(), u32::try_from(offset_of!($ty, $field)).unwrap())),*];
        (stringify!($ty), (u32::try_from(size_of::<$ty>()).unwrap(), fields))
    }};
}

fn host_layouts() -> Vec<(&'static str, Layout)> {
    vec![
        host_layout!(Sun { towards, slant_cosine, irradiance, cosine, through_air, spare }),
        host_layout!(Medium {
            extinction,
            extinction_550,
            beam,
            beam_550,
            smooth_part,
            transport_550,
            smooth_albedo,
            spare,
            forward,
            forward_550,
        }),
        host_layout!(Placement { offset_uv, shift_uv, above_uv, extent_m, base_m, depth_m, max_steps, lowest, ragged }),
        host_layout!(SunMaps { sample_at, texels, columns }),
        host_layout!(DiscPlace { shift_uv, cosine, direction }),
        host_layout!(DiscWay { towards, across, per_metre, flipped, backwards, spare }),
        host_layout!(Disc { fine, directions, count, first, total, lines, between, row_numbers, ways, places }),
        host_layout!(Frame { sun, medium, place, maps }),
        host_layout!(View {
            towards,
            perspective,
            eye,
            plane_m,
            size,
            first_row,
            rows,
            from_above,
            part,
            peak,
            first,
            added,
            together,
            point,
            pointed,
            spare,
        }),
        host_layout!(SkyView {
            axis_x,
            kind,
            axis_y,
            rows,
            axis_z,
            first_row,
            eye,
            rising,
            size,
            first_turn,
            turns,
            half_width,
            half_height,
            steps,
            rays,
            texels_per_ray,
            coarseness,
            edge,
            horizon,
            together,
            drift,
            spare_1,
            spare_2,
        }),
        host_layout!(AirColours { phase, matrix }),
        host_layout!(Backdrop { sun, horizon, extent_m, spare, spare_2 }),
        host_layout!(Cumulus {
            sun,
            extent_m,
            irradiance,
            base_m,
            extinction,
            top_m,
            kept,
            low_m,
            albedo,
            floor_m,
            asymmetry,
            voxel_m,
            beam,
            band_m,
            above,
            edge_m,
            below,
            relief_m,
            offset_m,
            tile_m,
            sun_radius,
            cell_m,
            lattice_floor_m,
            published,
            inward_m
        }),
        host_layout!(CumulusSurface { glow_m, blob_m, ambient, diffuse, bump, corona, reached_m, traps, trap, spare }),
        host_layout!(Blur { axis, radius, sharpness }),
        host_layout!(LatticeLight {
            kept,
            reach,
            albedo,
            cell_m,
            asymmetry,
            sun_step_m,
            density,
            grey,
            spare_0,
            spare_1,
            in_air,
            spare_2,
        }),
        host_layout!(Share { entry_scale, entry_weight, reflect_scale, spare, in_air, spare_2 }),
        host_layout!(Remainder {
            depth_scale,
            depths,
            order1_albedo,
            zeniths,
            decay,
            azimuths,
            extrapolation,
            depths_per_octave,
        }),
        host_layout!(Octaves { seed, first, count, width }),
        host_layout!(Streets { width, count, spare_0, spare_1, waves }),
        host_layout!(Trails {
            low,
            middle,
            high,
            along_uv,
            bend_uv,
            aside_uv,
            centre,
            per_unit,
            width,
            steps,
            parts,
            spare,
        }),
        host_layout!(Turned { seed, first, count, width, turns }),
        host_layout!(Columns { low, per_unit, scale_m, clip_m, lift_m, over_m, hang_m, grows }),
        host_layout!(Cells { seed, kind, count, width, coarser, finer, turns, spare }),
        host_layout!(Eddies { cosines, sines }),
        host_layout!(Step { keep, length_uv, spare_0, spare_1, spare_2 }),
        host_layout!(Blend { low, middle, high, cells, first, second, width, height, spare, offset_uv }),
        host_layout!(Histogram { low, per_unit, count, spare }),
        host_layout!(Transfer { spread, threshold, scale_m, clip_m, width, height, spare_0, spare_1 }),
    ]
}

/// Value of a constant of a shader.
fn constant(module: &Module, name: &str) -> f64 {
    let (_, constant) = module
        .constants
        .iter()
        .find(|(_, constant)| constant.name.as_deref() == Some(name))
        .unwrap_or_else(|| panic!("no constant {name}"));
    match module.global_expressions[constant.init] {
        Expression::Literal(Literal::F32(value)) => f64::from(value),
        Expression::Literal(Literal::I32(value)) => f64::from(value),
        Expression::Literal(Literal::U32(value)) => f64::from(value),
        ref other => panic!("{name} is {other:?}"),
    }
}

fn assert_constants(shader: &Shader, expected: &[(&str, f64)]) {
    let module = parsed(shader);
    for (name, value) in expected {
        // The shader's constant is the host's, rounded to single precision.
        assert_eq!(constant(&module, name), f64::from(*value as f32), "{} {name}", shader.label);
    }
}

#[test]
fn constants_of_cumulus() {
    let steps = [
        ("CUMULUS_BLOCK", cumulus::BLOCK as f64),
        ("CUMULUS_STEP", cumulus::STEP),
        ("CUMULUS_ROUGH_STEP_M", cumulus::ROUGH_STEP_M),
    ];
    let pieces = [("CUMULUS_SHARES", seen::SHARES), ("CUMULUS_OPAQUE", seen::OPAQUE)];
    let sun_rays = [
        ("CUMULUS_NEAR_SUN", seen::NEAR_SUN),
        ("CUMULUS_AT_SUN", seen::AT_SUN),
        ("CUMULUS_NEAR_SUN_DEPTH", seen::NEAR_SUN_DEPTH),
        ("CUMULUS_AT_SUN_DEPTH", seen::AT_SUN_DEPTH),
    ];
    let lattice = [
        ("CUMULUS_DETOUR", dressed::DETOUR),
        ("CUMULUS_PATH_SCALE", dressed::PATH_SCALE),
        ("CUMULUS_PATH_LOG", dressed::PATH_BASE.ln()),
    ];
    let cumulus::Octaves { count, gain, amplitude, sun, asymmetry, view } = cumulus::Octaves::REFITTED;
    let octaves = [
        ("OCTAVES_COUNT", f64::from(count)),
        ("OCTAVES_GAIN", gain),
        ("OCTAVES_AMPLITUDE", amplitude),
        ("OCTAVES_SUN", sun),
        ("OCTAVES_ASYMMETRY", asymmetry),
        ("OCTAVES_VIEW", view),
    ];
    let forward = [
        ("FORWARD_OPAQUE", cumulus_forward::FORWARD_OPAQUE),
        ("FORWARD_SHARPEST", cumulus_forward::FORWARD_SHARPEST),
        ("FORWARD_BROADEST", cumulus_forward::FORWARD_BROADEST),
        ("FORWARD_LN_2", std::f64::consts::LN_2),
    ];
    let surface = [
        ("SURFACE_OPAQUE", cumulus_surface::SURFACE_OPAQUE),
        ("SURFACE_SHARPEST", cumulus_surface::SURFACE_SHARPEST),
        ("SURFACE_GRAIN", cumulus_surface::SURFACE_GRAIN),
    ];
    for shader in [&shaders::CUMULUS_GROUND, &shaders::CUMULUS_THICKNESS] {
        assert_constants(shader, &steps);
    }
    for shader in [&shaders::CUMULUS_PLANE_LATTICE, &shaders::CUMULUS_SKY_LATTICE] {
        assert_constants(shader, &[&steps[..], &pieces, &sun_rays, &lattice].concat());
    }
    let layers = [
        ("LATTICE_SAMPLES", cloud_lattice::SAMPLES.into()),
        ("LATTICE_FEW", cloud_lattice::FEW.into()),
        ("LATTICE_LAST", cloud_lattice::LAST),
        ("LATTICE_GAP", cloud_lattice::GAP),
        ("LATTICE_DARK", cloud_lattice::DARK),
        ("LATTICE_DETOUR", dressed::DETOUR),
        ("LATTICE_PATH_SCALE", dressed::PATH_SCALE),
        ("LATTICE_PATH_LOG", dressed::PATH_BASE.ln()),
        ("LATTICE_MOST", cloud_lattice::MOST),
    ];
    let planes = [("RAY_MOST_STEPS", cloud_lattice::RAY_MOST_STEPS), ("LATTICE_STEEP", cloud_lattice::STEEP_COSINE)];
    for shader in [&shaders::LATTICE_TABULATED, &shaders::LATTICE_TABULATED_COLUMNS] {
        assert_constants(shader, &[&layers[..], &planes].concat());
    }
    let far = ("LATTICE_FAR_LEVEL", cloud_lattice::FAR_LEVEL);
    for shader in [&shaders::SKY_LATTICE_TABULATED, &shaders::SKY_LATTICE_TABULATED_COLUMNS] {
        assert_constants(shader, &[&layers[..], &[far]].concat());
    }
    for shader in [&shaders::CUMULUS_PLANE_OCTAVES, &shaders::CUMULUS_SKY_OCTAVES] {
        assert_constants(shader, &[&steps[..], &pieces, &sun_rays, &octaves].concat());
    }
    assert_constants(&shaders::CUMULUS_SKY_FORWARD, &forward);
    for shader in [&shaders::CUMULUS_SKY_SHADER, &shaders::CUMULUS_SKY_SHADER3] {
        assert_constants(shader, &surface);
    }
}

#[test]
fn constants_of_swept_rays() {
    for shader in [&shaders::SUN_SWEEP, &shaders::SUN_SWEEP_COLUMNS, &shaders::GROUND_SWEPT, &shaders::GROUND_SWEPT_LOW]
    {
        assert_constants(shader, &[("SWEEP_STRIP", Disc::STRIP.into())]);
    }
}

#[test]
fn every_shader_is_valid_with_and_without_filtering() {
    for shader in shaders::ALL.iter().chain(shaders::GROWING).chain(shaders::PLAIN) {
        for filtering in [true, false] {
            let module = parse(&shader.source(filtering));
            let valid = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module);
            assert!(valid.is_ok(), "{}, filtering {filtering}: {:?}", shader.label, valid.err());
        }
    }
}

#[test]
fn workgroups_are_those_of_the_entry_points() {
    for shader in shaders::ALL {
        let module = parsed(shader);
        let [entry] = &module.entry_points[..] else { panic!("{} has not one entry point", shader.label) };
        assert_eq!((entry.name.as_str(), entry.stage), ("main", ShaderStage::Compute), "{}", shader.label);
        assert_eq!(entry.workgroup_size, shader.workgroup, "{}", shader.label);
    }
}

#[test]
fn bindings_are_numbered_without_gaps() {
    for shader in shaders::ALL {
        let module = parsed(shader);
        let mut bindings: Vec<_> = module
            .global_variables
            .iter()
            .filter_map(|(_, variable)| variable.binding)
            .map(|binding| (binding.group, binding.binding))
            .collect();
        bindings.sort_unstable();
        let expected: Vec<_> = (0..u32::try_from(bindings.len()).unwrap()).map(|binding| (0, binding)).collect();
        assert_eq!(bindings, expected, "{}", shader.label);
    }
}

#[test]
fn host_structs_are_those_of_the_shaders() {
    for shader in shaders::ALL {
        let module = parsed(shader);
        for (name, host) in host_layouts() {
            assert_eq!(wgsl_layout(&module, name), host, "{name} in {}", shader.label);
        }
    }
}

#[test]
fn every_uniform_and_storage_struct_is_a_host_struct() {
    let known: Vec<_> = host_layouts().iter().map(|(name, _)| *name).collect();
    for shader in shaders::ALL {
        let module = parsed(shader);
        for (_, variable) in module.global_variables.iter().filter(|(_, variable)| variable.binding.is_some()) {
            let ty = &module.types[variable.ty];
            if matches!(ty.inner, TypeInner::Struct { .. }) {
                let name = ty.name.as_deref().unwrap();
                assert!(known.contains(&name), "{name} of {} has no twin on the host", shader.label);
            }
        }
    }
}

#[test]
fn the_comparison_sees_drift() {
    let source = |fields: &str| format!("struct Eddies {{ {fields} }}\nvar<private> eddies: Eddies;");
    let layout = |fields: &str| wgsl_layout(&parse(&source(fields)), "Eddies");
    let (_, host) = host_layout!(Eddies { cosines, sines });
    assert_eq!(layout("cosines: vec4<f32>, sines: vec4<f32>"), host);
    for drifted in [
        "sines: vec4<f32>, cosines: vec4<f32>",
        "cosines: vec4<f32>, sinuses: vec4<f32>",
        "cosines: vec4<f32>, sines: vec4<f32>, more: f32",
        "cosines: vec3<f32>, sines: f32",
        "cosines: vec4<f32>",
    ] {
        assert_ne!(layout(drifted), host, "{drifted}");
    }
}

#[test]
fn a_swap_in_the_real_text_is_seen() {
    let source = shaders::SHADOW.source(true);
    let swapped =
        source.replace("base_m: f32", "@@").replace("depth_m: f32", "base_m: f32").replace("@@", "depth_m: f32");
    assert_ne!(source, swapped);
    let (_, host) =
        host_layout!(Placement { offset_uv, shift_uv, above_uv, extent_m, base_m, depth_m, max_steps, lowest, ragged });
    assert_ne!(wgsl_layout(&parse(&swapped), "Placement"), host);
}

#[test]
fn constants_of_the_slab_tables() {
    let expected = [
        ("MIN_COSINE", f64::from(layout::MIN_COSINE)),
        ("PI", std::f64::consts::PI),
        ("SLAB_LOG2_DEPTH_MIN", f64::from(fluxes::FIRST_LOG2_DEPTH)),
        ("SLAB_DEPTH_MIN", f64::from(fluxes::FIRST_LOG2_DEPTH).exp2()),
        ("SLAB_NODES_PER_OCTAVE", fluxes::DEPTHS_PER_OCTAVE as f64),
        ("SLAB_DEPTH_NODES", fluxes::DEPTH_COUNT as f64),
        ("SLAB_ROOT_COSINE_MIN", fluxes::FIRST_ROOT_MU),
        ("SLAB_COSINE_NODES", fluxes::MU_COUNT as f64),
        ("PHASE_COLUMNS", tables::PHASE_COLUMNS as f64),
    ];
    for shader in [&shaders::BASE_LIGHT, &shaders::GROUND_SUN_LOW, &shaders::CLOUD_ANALYTIC] {
        assert_constants(shader, &expected);
    }
    let of_view = [
        ("SLABS_PER_OCTAVE", skyloom::shade::SLABS_PER_OCTAVE as f64),
        ("SLABS_COUNT", skyloom::shade::SLABS_COUNT as f64),
    ];
    for shader in [&shaders::SLABS_TABULATED, &shaders::CLOUD_UPRIGHT, &shaders::LATTICE_PARALLEL] {
        assert_constants(shader, &of_view);
    }
    assert_constants(&shaders::SLABS_FORWARD, &[("SLABS_ACROSS", skyloom::shade::SLABS_ACROSS as f64)]);
}

#[test]
fn constants_of_the_shade_tables() {
    let expected = [
        ("CLOSURE_ROWS", skyloom::slice::CLOSURE_ROWS as f64),
        ("AUREOLE_ROWS", tables::AUREOLE_ROWS as f64),
        ("AUREOLE_COLUMNS", tables::AUREOLE_COLUMNS as f64),
        ("AUREOLE_LOG2_MIN", tables::AUREOLE_LOG2_MIN),
        ("AUREOLE_ROWS_PER_OCTAVE", tables::AUREOLE_ROWS_PER_OCTAVE),
        ("AUREOLE_HALF_SIN_MAX", tables::AUREOLE_HALF_SIN_MAX),
    ];
    assert_constants(&shaders::CLOUD_ANALYTIC, &expected);
    let veil = [
        ("VEIL_ROWS", skyloom::slice::VEIL_ROWS as f64),
        ("VEIL_THICK", skyloom::slab::veil::THICK),
        ("VEIL_THICK_FROM", skyloom::slab::veil::THICK_FROM),
    ];
    assert_constants(&shaders::CLOUD_FORWARD, &veil);
}

#[test]
fn constants_of_the_radiance_slice() {
    let expected = [
        ("PHASE_ROWS", skyloom::slice::PHASE_ROWS as f64),
        ("SLICE_LOG2_DEPTH_MIN", f64::from(table::FIRST_LOG2_DEPTH)),
        ("SLICE_LOG2_DEPTH_SPARSE", f64::from(table::SPARSE_LOG2_DEPTH)),
        ("SLICE_ZENITH_MAX", table::LAST_ZENITH_DEG.to_radians()),
        ("SLICE_COSINE_MIN", table::LAST_ZENITH_DEG.to_radians().cos()),
        ("SLICE_DENSER", table::DENSER),
        ("NEAR_SUN_ROWS", aureole::ROWS as f64),
        ("NEAR_SUN_COLUMNS", aureole::COLUMNS as f64),
        ("NEAR_SUN_LOG2_MIN", f64::from(aureole::FIRST_LOG2_PATH)),
        ("NEAR_SUN_ROWS_PER_OCTAVE", aureole::ROWS_PER_OCTAVE as f64),
        ("NEAR_SUN_HALF_SIN_MAX", aureole::HALF_SIN_MAX),
    ];
    assert_constants(&shaders::CLOUD_TABULATED, &expected);
}

#[test]
fn constants_of_the_sky() {
    let sphere = [
        ("EARTH_RADIUS_M", sphere::EARTH_RADIUS_M),
        ("LEAST_RISE_M", sphere::LEAST_RISE_M),
        ("DRIFT_FROM_M", sphere::DRIFT_FROM_M),
    ];
    let kinds: Vec<_> = ["SPHERE_EQUIRECT", "SPHERE_OCTAHEDRAL", "SPHERE_CUBE", "SPHERE_FISHEYE"]
        .into_iter()
        .enumerate()
        .map(|(number, name)| {
            assert_eq!(format!("SPHERE_{}", SphereLayout::NAMES[number].to_uppercase()), name);
            (name, number as f64)
        })
        .collect();
    let flat = [
        ("FLAT_SLOPE", path_seen::FLAT_SLOPE),
        ("FLAT_MARCHES", f64::from(path_seen::FLAT_MARCHES)),
        ("FLAT_TEXELS", path_seen::FLAT_TEXELS),
        ("PATH_UNSEEN", path_seen::PATH_UNSEEN),
        ("PATH_MOST_STEPS", path_sampled::PATH_MOST_STEPS),
        ("VIEW_MOST_RAYS", cloud_plane::VIEW_MOST_RAYS),
        ("VIEW_RAY_SLOPE", cloud_plane::VIEW_RAY_SLOPE),
        ("VIEW_ASIDE", cloud_plane::VIEW_ASIDE),
    ];
    for shader in [&shaders::CLOUD_FORWARD, &shaders::CLOUD_ANALYTIC, &shaders::LATTICE_TABULATED_COLUMNS] {
        assert_constants(shader, &flat);
    }
    let clouds = [("SKY_OPAQUE", cloud_sky::SKY_OPAQUE), ("PATH_MOST_STEPS", path_sampled::PATH_MOST_STEPS)];
    for shader in [&shaders::SKY_FORWARD, &shaders::SKY_ANALYTIC, &shaders::SKY_TABULATED] {
        assert_constants(shader, &[&sphere[..], &kinds, &clouds].concat());
    }
    assert_constants(&shaders::SKY_ABOVE, &[("AEROSOL_ROWS", AEROSOL_ROWS as f64)]);
    assert_constants(&shaders::SKY, &[("SKY_EDGE_RAYS", f64::from(sky::SKY_EDGE_RAYS))]);
    // A tile is a workgroup.
    for shader in [&shaders::SKY_ANALYTIC, &shaders::SKY_TABULATED, &shaders::SKY, &shaders::SKY_ABOVE] {
        let tile = constant(&parsed(shader), "SKY_TILE");
        assert_eq!(shader.workgroup.map(f64::from), [tile, tile, 1.0], "{}", shader.label);
    }
}

#[test]
#[should_panic(expected = "cloud_analytic CLOSURE_ROWS")]
fn a_wrong_constant_is_seen() {
    assert_constants(&shaders::CLOUD_ANALYTIC, &[("CLOSURE_ROWS", 7.0)]);
}
