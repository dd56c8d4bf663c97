//! Which WGSL files make which shader. Module scope has no order in WGSL, so the files are simply joined.

/// A compute shader: its entry point is `main`.
#[derive(Debug)]
pub struct Shader {
    /// Its name, and that of its file.
    pub label: &'static str,
    /// Invocations in a workgroup; a test compares it with the entry point's attribute.
    pub workgroup: [u32; 3],
    parts: &'static [&'static str],
    /// Whether it is for columns whose extinction grows with height. Of the others it costs nothing so.
    grows: bool,
    /// Whether it is for plain tiles of a sky alone.
    plain: bool,
}

/// The file of a shader: that of its name, unless it shares another's.
macro_rules! file_of {
    ($name:literal) => {
        $name
    };
    ($name:literal, $file:literal) => {
        $file
    };
}

macro_rules! wgsl {
    ($name:expr) => {
        include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/shaders/", $name, ".wgsl"))
    };
}

const FRAME: &str = wgsl!("shared/frame");
const FILTERED: &str = wgsl!("shared/sampling_filtered");
const LOADED: &str = wgsl!("shared/sampling_loaded");
const NOISE: &str = wgsl!("shared/noise");
const SHEET: &str = wgsl!("shared/sheet");
const COLUMNS: &str = wgsl!("shared/columns");
const LEVEL_SHEET: &str = wgsl!("shared/level_sheet");
const LEVEL_COLUMNS: &str = wgsl!("shared/level_columns");
const MARCH: &str = wgsl!("shared/march");
const PATH: &str = wgsl!("shared/path");
const PATH_COLUMNS: &str = wgsl!("shared/path_columns");
const PATH_SEEN: &str = wgsl!("shared/path_seen");
const PATH_UPRIGHT: &str = wgsl!("shared/path_upright");
const ACROSS: &str = wgsl!("shared/path_across");
const ACROSS_SHEET: &str = wgsl!("shared/across_sheet");
const ACROSS_COLUMNS: &str = wgsl!("shared/across_columns");
const PATH_LINES: &str = wgsl!("shared/path_lines");
const PATH_SAMPLED: &str = wgsl!("shared/path_sampled");
const PATH_SAMPLED_COLUMNS: &str = wgsl!("shared/path_sampled_columns");
const PROJECTION: &str = wgsl!("shared/projection");
const SLAB: &str = wgsl!("shared/slab");
const SUN: &str = wgsl!("shared/sun");
const SUN_RAY: &str = wgsl!("shared/sun_ray");
const SUN_SWEPT: &str = wgsl!("shared/sun_swept");
const SUN_HIGH: &str = wgsl!("shared/sun_high");
const SUN_LOW: &str = wgsl!("shared/sun_low");
const SWEEP: &str = wgsl!("shared/sweep");
const SWEEP_SHEET: &str = wgsl!("shared/sweep_sheet");
const SWEEP_COLUMNS: &str = wgsl!("shared/sweep_columns");
const SPHERE: &str = wgsl!("shared/sphere");
const AIR: &str = wgsl!("shared/air");
const CLOUD: &str = wgsl!("shared/cloud");
const CLOUD_RAY: &str = wgsl!("shared/cloud_ray");
const CLOUD_BINDS: &str = wgsl!("shared/cloud_binds");
const CLOUD_SLABS: &str = wgsl!("shared/cloud_slabs");
const SLABS_OF_VIEW: &str = wgsl!("shared/slabs_of_view");
const CLOUD_PLANE: &str = wgsl!("shared/cloud_plane");
const CLOUD_SHARE: &str = wgsl!("shared/cloud_share");
const CLOUD_LATTICE: &str = wgsl!("shared/cloud_lattice");
const ALONG_RAY: &str = wgsl!("shared/lattice_along");
const ALONG_UPRIGHT: &str = wgsl!("shared/lattice_upright");
const LATTICE_SHEET: &str = wgsl!("shared/lattice_sheet");
const LATTICE_COLUMNS: &str = wgsl!("shared/lattice_columns");
const CUMULUS: &str = wgsl!("shared/cumulus");
const CUMULUS_LIGHT: &str = wgsl!("shared/cumulus_light");
const PIECES: &str = wgsl!("shared/cumulus_pieces");
const SUN_RAYS: &str = wgsl!("shared/cumulus_sun_rays");
const SUN_READ: &str = wgsl!("shared/cumulus_sun_read");
const LATTICE: &str = wgsl!("shared/cumulus_lattice");
const OCTAVES: &str = wgsl!("shared/cumulus_octaves");
const FORWARD: &str = wgsl!("shared/cumulus_forward");
const SURFACE: &str = wgsl!("shared/cumulus_surface");
const SHADER: &str = wgsl!("shared/cumulus_shader");
const SHADER3: &str = wgsl!("shared/cumulus_shader3");
const CLOUD_SKY: &str = wgsl!("shared/cloud_sky");

impl Shader {
    /// The whole source; `filtering` false for devices that do not filter 32-bit floats.
    pub fn source(&self, filtering: bool) -> String {
        let mut source = self.parts.concat();
        source.push_str(if self.grows {
            "const COLUMN_GROWS: bool = true;\n"
        } else {
            "const COLUMN_GROWS: bool = false;\n"
        });
        source.push_str(if self.plain {
            "const SKY_PLAIN: bool = true;\n"
        } else {
            "const SKY_PLAIN: bool = false;\n"
        });
        source.push_str(if filtering { FILTERED } else { LOADED });
        source
    }

    /// The same for columns whose extinction grows with height.
    pub(crate) fn growing(&'static self) -> &'static Self {
        ALL.iter().zip(GROWING).find(|(shader, _)| shader.label == self.label).map_or(self, |(_, growing)| growing)
    }

    /// The same for plain tiles of a sky: those of which one ray a texel is enough and far from the sun, or the ground all that is behind.
    pub(crate) fn plain(&self) -> Option<&'static Self> {
        PLAIN.iter().find(|plain| plain.label.strip_suffix("_plain") == Some(self.label))
    }
}

macro_rules! shaders {
    ($($id:ident: $name:literal $(of $file:literal)?, $workgroup:expr, [$($part:ident),*];)+) => {
        $(
            #[doc = concat!("`shaders/", file_of!($name $(, $file)?), ".wgsl`")]
            pub const $id: Shader = Shader {
                label: $name,
                workgroup: $workgroup,
                parts: &[FRAME, $($part,)* wgsl!(file_of!($name $(, $file)?))],
                grows: false,
                plain: false,
            };
        )+
        /// Every shader.
        pub const ALL: &[Shader] = &[$($id),+];
        /// Each of them for columns whose extinction grows with height.
        pub const GROWING: &[Shader] = &[$(Shader { label: concat!($name, "_growing"), grows: true, ..$id }),+];
        /// Each of both for plain tiles of a sky.
        pub const PLAIN: &[Shader] = &[
            $(Shader { label: concat!($name, "_plain"), plain: true, ..$id },)+
            $(Shader { label: concat!($name, "_growing_plain"), grows: true, plain: true, ..$id }),+
        ];
    };
}

const IMAGE: [u32; 3] = [16, 16, 1];

shaders! {
    SELF_TEST: "self_test", [1, 1, 1], [];
    FIELD_OCTAVES: "field_octaves", IMAGE, [NOISE];
    FIELD_TURNED: "field_turned", IMAGE, [NOISE];
    FIELD_CELLS: "field_cells", IMAGE, [NOISE];
    FIELD_STREETS: "field_streets", IMAGE, [];
    FIELD_HEADS: "field_heads", IMAGE, [];
    FIELD_TRAILS: "field_trails", IMAGE, [];
    FIELD_VELOCITY: "field_velocity", IMAGE, [];
    FIELD_DISPLACE: "field_displace", IMAGE, [];
    FIELD_BLEND: "field_blend", IMAGE, [];
    FIELD_IMAGE: "field_image", IMAGE, [];
    FIELD_HISTOGRAM: "field_histogram", [256, 1, 1], [];
    FIELD_REMAP: "field_remap", IMAGE, [];
    FIELD_THICKNESS: "field_thickness", IMAGE, [];
    FIELD_COLUMNS: "field_columns", IMAGE, [];
    FIELD_HANG: "field_hang", IMAGE, [];
    FIELD_BOUNDS: "field_bounds", IMAGE, [SHEET];
    FIELD_BOUNDS_COLUMNS: "field_bounds_columns" of "field_bounds", IMAGE, [COLUMNS];
    FIELD_BOUNDS_LEVEL: "field_bounds_level", IMAGE, [];
    FIELD_LEVEL: "field_level", IMAGE, [LEVEL_SHEET];
    FIELD_LEVEL_COLUMNS: "field_level_columns" of "field_level", IMAGE, [LEVEL_COLUMNS];
    DOWNSAMPLE: "downsample", IMAGE, [];
    SUN_ENTRY: "sun_entry", IMAGE, [SHEET, ACROSS, ACROSS_SHEET];
    SUN_ENTRY_COLUMNS: "sun_entry_columns" of "sun_entry", IMAGE, [COLUMNS, ACROSS, ACROSS_COLUMNS];
    BLUR: "blur", IMAGE, [];
    BASE_LIGHT: "base_light", IMAGE, [ACROSS, ACROSS_SHEET, SLAB, SUN];
    BASE_LIGHT_COLUMNS: "base_light_columns" of "base_light", IMAGE, [COLUMNS, ACROSS, ACROSS_COLUMNS, SLAB, SUN];
    LATTICE_LIGHT: "lattice_light", IMAGE, [ACROSS, ACROSS_SHEET, SLAB, SUN];
    LATTICE_LIGHT_COLUMNS: "lattice_light_columns" of "lattice_light", IMAGE, [COLUMNS, ACROSS, ACROSS_COLUMNS, SLAB, SUN];
    BASE_BEAM: "base_beam", IMAGE, [ACROSS, ACROSS_SHEET, SLAB, SUN];
    BASE_BEAM_COLUMNS: "base_beam_columns" of "base_beam", IMAGE, [COLUMNS, ACROSS, ACROSS_COLUMNS, SLAB, SUN];
    BASE_COLUMN: "base_column", IMAGE, [SLAB];
    SUN_SHARE: "sun_share", IMAGE, [];
    SUN_SWEEP: "sun_sweep", [64, 1, 1], [SWEEP, SWEEP_SHEET];
    SUN_SWEEP_COLUMNS: "sun_sweep_columns" of "sun_sweep", [64, 1, 1], [COLUMNS, SWEEP, SWEEP_COLUMNS];
    GROUND_SUN: "ground_sun", IMAGE, [MARCH, PATH, SUN_RAY, SUN_HIGH];
    GROUND_SUN_COLUMNS: "ground_sun_columns" of "ground_sun", IMAGE, [COLUMNS, MARCH, PATH_COLUMNS, SUN_RAY, SUN_HIGH];
    GROUND_SWEPT: "ground_swept" of "ground_sun", IMAGE, [SWEEP, SUN_SWEPT, SUN_HIGH];
    GROUND_SUN_LOW: "ground_sun_low" of "ground_sun", IMAGE, [MARCH, PATH, SUN_RAY, SLAB, SUN_LOW];
    GROUND_SUN_LOW_COLUMNS: "ground_sun_low_columns" of "ground_sun", IMAGE, [COLUMNS, MARCH, PATH_COLUMNS, SUN_RAY, SLAB, SUN_LOW];
    GROUND_SWEPT_LOW: "ground_swept_low" of "ground_sun", IMAGE, [SWEEP, SUN_SWEPT, SLAB, SUN_LOW];
    THICKNESS: "thickness", IMAGE, [SHEET];
    THICKNESS_COLUMNS: "thickness_columns" of "thickness", IMAGE, [COLUMNS];
    SHADOW: "shadow", IMAGE, [];
    IRRADIANCE: "irradiance", IMAGE, [];
    CLOUD_FORWARD: "cloud_forward", IMAGE, [PROJECTION, MARCH, PATH, PATH_LINES, PATH_SAMPLED, SLAB, CLOUD_RAY, CLOUD_BINDS, CLOUD, CLOUD_SHARE, PATH_SEEN, CLOUD_PLANE];
    CLOUD_FORWARD_COLUMNS: "cloud_forward_columns" of "cloud_forward", IMAGE,
        [PROJECTION, COLUMNS, MARCH, PATH_COLUMNS, PATH_LINES, PATH_SAMPLED_COLUMNS, SLAB, CLOUD_RAY, CLOUD_BINDS, CLOUD, CLOUD_SHARE, PATH_SEEN, CLOUD_PLANE];
    CLOUD_ANALYTIC: "cloud_analytic", IMAGE, [PROJECTION, MARCH, PATH, PATH_LINES, PATH_SAMPLED, SLAB, CLOUD_RAY, CLOUD_BINDS, CLOUD, CLOUD_SHARE, PATH_SEEN, CLOUD_PLANE];
    CLOUD_ANALYTIC_COLUMNS: "cloud_analytic_columns" of "cloud_analytic", IMAGE,
        [PROJECTION, COLUMNS, MARCH, PATH_COLUMNS, PATH_LINES, PATH_SAMPLED_COLUMNS, SLAB, CLOUD_RAY, CLOUD_BINDS, CLOUD, CLOUD_SHARE, PATH_SEEN, CLOUD_PLANE];
    CLOUD_TABULATED: "cloud_tabulated", IMAGE, [PROJECTION, MARCH, PATH, PATH_LINES, PATH_SAMPLED, SLAB, CLOUD_RAY, CLOUD_BINDS, CLOUD, CLOUD_SHARE, PATH_SEEN, CLOUD_PLANE];
    CLOUD_TABULATED_COLUMNS: "cloud_tabulated_columns" of "cloud_tabulated", IMAGE,
        [PROJECTION, COLUMNS, MARCH, PATH_COLUMNS, PATH_LINES, PATH_SAMPLED_COLUMNS, SLAB, CLOUD_RAY, CLOUD_BINDS, CLOUD, CLOUD_SHARE, PATH_SEEN, CLOUD_PLANE];
    LATTICE_FORWARD: "lattice_forward" of "cloud_forward", IMAGE,
        [PROJECTION, MARCH, PATH, PATH_LINES, PATH_SAMPLED, SLAB, CLOUD_RAY, CLOUD_BINDS, CLOUD, LATTICE_SHEET, CLOUD_LATTICE, ALONG_RAY, PATH_SEEN, CLOUD_PLANE];
    LATTICE_FORWARD_COLUMNS: "lattice_forward_columns" of "cloud_forward", IMAGE,
        [PROJECTION, COLUMNS, MARCH, PATH_COLUMNS, PATH_LINES, PATH_SAMPLED_COLUMNS, SLAB, CLOUD_RAY, CLOUD_BINDS, CLOUD, LATTICE_COLUMNS, CLOUD_LATTICE, ALONG_RAY, PATH_SEEN, CLOUD_PLANE];
    LATTICE_ANALYTIC: "lattice_analytic" of "cloud_analytic", IMAGE,
        [PROJECTION, MARCH, PATH, PATH_LINES, PATH_SAMPLED, SLAB, CLOUD_RAY, CLOUD_BINDS, CLOUD, LATTICE_SHEET, CLOUD_LATTICE, ALONG_RAY, PATH_SEEN, CLOUD_PLANE];
    LATTICE_ANALYTIC_COLUMNS: "lattice_analytic_columns" of "cloud_analytic", IMAGE,
        [PROJECTION, COLUMNS, MARCH, PATH_COLUMNS, PATH_LINES, PATH_SAMPLED_COLUMNS, SLAB, CLOUD_RAY, CLOUD_BINDS, CLOUD, LATTICE_COLUMNS, CLOUD_LATTICE, ALONG_RAY, PATH_SEEN, CLOUD_PLANE];
    LATTICE_TABULATED: "lattice_tabulated" of "cloud_tabulated", IMAGE,
        [PROJECTION, MARCH, PATH, PATH_LINES, PATH_SAMPLED, SLAB, CLOUD_RAY, CLOUD_BINDS, CLOUD, LATTICE_SHEET, CLOUD_LATTICE, ALONG_RAY, PATH_SEEN, CLOUD_PLANE];
    LATTICE_TABULATED_COLUMNS: "lattice_tabulated_columns" of "cloud_tabulated", IMAGE,
        [PROJECTION, COLUMNS, MARCH, PATH_COLUMNS, PATH_LINES, PATH_SAMPLED_COLUMNS, SLAB, CLOUD_RAY, CLOUD_BINDS, CLOUD, LATTICE_COLUMNS, CLOUD_LATTICE, ALONG_RAY, PATH_SEEN, CLOUD_PLANE];
    SLABS_FORWARD: "slabs_forward" of "cloud_forward", IMAGE, [SLAB, CLOUD_RAY, SLABS_OF_VIEW, CLOUD_SLABS];
    SLABS_ANALYTIC: "slabs_analytic" of "cloud_analytic", IMAGE, [SLAB, CLOUD_RAY, SLABS_OF_VIEW, CLOUD_SLABS];
    SLABS_TABULATED: "slabs_tabulated" of "cloud_tabulated", IMAGE, [SLAB, CLOUD_RAY, SLABS_OF_VIEW, CLOUD_SLABS];
    CLOUD_PARALLEL: "cloud_parallel", IMAGE,
        [PROJECTION, MARCH, PATH, PATH_LINES, PATH_SAMPLED, SLAB, CLOUD_RAY, SLABS_OF_VIEW, CLOUD, CLOUD_SHARE, PATH_SEEN, CLOUD_PLANE];
    CLOUD_PARALLEL_COLUMNS: "cloud_parallel_columns" of "cloud_parallel", IMAGE,
        [PROJECTION, COLUMNS, MARCH, PATH_COLUMNS, PATH_LINES, PATH_SAMPLED_COLUMNS, SLAB, CLOUD_RAY, SLABS_OF_VIEW, CLOUD, CLOUD_SHARE, PATH_SEEN, CLOUD_PLANE];
    LATTICE_PARALLEL: "lattice_parallel" of "cloud_parallel", IMAGE,
        [PROJECTION, MARCH, PATH, PATH_LINES, PATH_SAMPLED, SLAB, CLOUD_RAY, SLABS_OF_VIEW, CLOUD, LATTICE_SHEET, CLOUD_LATTICE, ALONG_RAY, PATH_SEEN, CLOUD_PLANE];
    LATTICE_PARALLEL_COLUMNS: "lattice_parallel_columns" of "cloud_parallel", IMAGE,
        [PROJECTION, COLUMNS, MARCH, PATH_COLUMNS, PATH_LINES, PATH_SAMPLED_COLUMNS, SLAB, CLOUD_RAY, SLABS_OF_VIEW, CLOUD, LATTICE_COLUMNS, CLOUD_LATTICE, ALONG_RAY, PATH_SEEN, CLOUD_PLANE];
    CLOUD_UPRIGHT: "cloud_upright" of "cloud_parallel", IMAGE,
        [PROJECTION, PATH_LINES, SLAB, CLOUD_RAY, SLABS_OF_VIEW, CLOUD, CLOUD_SHARE, PATH_UPRIGHT, CLOUD_PLANE];
    LATTICE_UPRIGHT: "lattice_upright" of "cloud_parallel", IMAGE,
        [PROJECTION, PATH_LINES, SLAB, CLOUD_RAY, SLABS_OF_VIEW, CLOUD, LATTICE_SHEET, CLOUD_LATTICE, ALONG_UPRIGHT, PATH_UPRIGHT, CLOUD_PLANE];
    LATTICE_UPRIGHT_COLUMNS: "lattice_upright_columns" of "cloud_parallel", IMAGE,
        [PROJECTION, COLUMNS, PATH_LINES, SLAB, CLOUD_RAY, SLABS_OF_VIEW, CLOUD, LATTICE_COLUMNS, CLOUD_LATTICE, ALONG_UPRIGHT, PATH_UPRIGHT, CLOUD_PLANE];
    SKY_FORWARD: "sky_forward" of "cloud_forward", IMAGE, [SPHERE, AIR, PATH_LINES, PATH_SAMPLED, SLAB, CLOUD_RAY, CLOUD_BINDS, CLOUD, CLOUD_SHARE, CLOUD_SKY];
    SKY_ANALYTIC: "sky_analytic" of "cloud_analytic", IMAGE, [SPHERE, AIR, PATH_LINES, PATH_SAMPLED, SLAB, CLOUD_RAY, CLOUD_BINDS, CLOUD, CLOUD_SHARE, CLOUD_SKY];
    SKY_TABULATED: "sky_tabulated" of "cloud_tabulated", IMAGE, [SPHERE, AIR, PATH_LINES, PATH_SAMPLED, SLAB, CLOUD_RAY, CLOUD_BINDS, CLOUD, CLOUD_SHARE, CLOUD_SKY];
    SKY_FORWARD_COLUMNS: "sky_forward_columns" of "cloud_forward", IMAGE,
        [SPHERE, AIR, COLUMNS, PATH_LINES, PATH_SAMPLED_COLUMNS, SLAB, CLOUD_RAY, CLOUD_BINDS, CLOUD, CLOUD_SHARE, CLOUD_SKY];
    SKY_ANALYTIC_COLUMNS: "sky_analytic_columns" of "cloud_analytic", IMAGE,
        [SPHERE, AIR, COLUMNS, PATH_LINES, PATH_SAMPLED_COLUMNS, SLAB, CLOUD_RAY, CLOUD_BINDS, CLOUD, CLOUD_SHARE, CLOUD_SKY];
    SKY_TABULATED_COLUMNS: "sky_tabulated_columns" of "cloud_tabulated", IMAGE,
        [SPHERE, AIR, COLUMNS, PATH_LINES, PATH_SAMPLED_COLUMNS, SLAB, CLOUD_RAY, CLOUD_BINDS, CLOUD, CLOUD_SHARE, CLOUD_SKY];
    SKY_LATTICE_FORWARD: "sky_lattice_forward" of "cloud_forward", IMAGE,
        [SPHERE, AIR, PATH_LINES, PATH_SAMPLED, SLAB, CLOUD_RAY, CLOUD_BINDS, CLOUD, LATTICE_SHEET, CLOUD_LATTICE, ALONG_RAY, CLOUD_SKY];
    SKY_LATTICE_FORWARD_COLUMNS: "sky_lattice_forward_columns" of "cloud_forward", IMAGE,
        [SPHERE, AIR, COLUMNS, PATH_LINES, PATH_SAMPLED_COLUMNS, SLAB, CLOUD_RAY, CLOUD_BINDS, CLOUD, LATTICE_COLUMNS, CLOUD_LATTICE, ALONG_RAY, CLOUD_SKY];
    SKY_LATTICE_ANALYTIC: "sky_lattice_analytic" of "cloud_analytic", IMAGE,
        [SPHERE, AIR, PATH_LINES, PATH_SAMPLED, SLAB, CLOUD_RAY, CLOUD_BINDS, CLOUD, LATTICE_SHEET, CLOUD_LATTICE, ALONG_RAY, CLOUD_SKY];
    SKY_LATTICE_ANALYTIC_COLUMNS: "sky_lattice_analytic_columns" of "cloud_analytic", IMAGE,
        [SPHERE, AIR, COLUMNS, PATH_LINES, PATH_SAMPLED_COLUMNS, SLAB, CLOUD_RAY, CLOUD_BINDS, CLOUD, LATTICE_COLUMNS, CLOUD_LATTICE, ALONG_RAY, CLOUD_SKY];
    SKY_LATTICE_TABULATED: "sky_lattice_tabulated" of "cloud_tabulated", IMAGE,
        [SPHERE, AIR, PATH_LINES, PATH_SAMPLED, SLAB, CLOUD_RAY, CLOUD_BINDS, CLOUD, LATTICE_SHEET, CLOUD_LATTICE, ALONG_RAY, CLOUD_SKY];
    SKY_LATTICE_TABULATED_COLUMNS: "sky_lattice_tabulated_columns" of "cloud_tabulated", IMAGE,
        [SPHERE, AIR, COLUMNS, PATH_LINES, PATH_SAMPLED_COLUMNS, SLAB, CLOUD_RAY, CLOUD_BINDS, CLOUD, LATTICE_COLUMNS, CLOUD_LATTICE, ALONG_RAY, CLOUD_SKY];
    CUMULUS_SKY_LATTICE: "cumulus_sky_lattice" of "cumulus_sky", IMAGE, [SPHERE, AIR, CUMULUS, CUMULUS_LIGHT, PIECES, SUN_RAYS, LATTICE];
    CUMULUS_SKY_OCTAVES: "cumulus_sky_octaves" of "cumulus_sky", IMAGE, [SPHERE, AIR, CUMULUS, CUMULUS_LIGHT, PIECES, SUN_RAYS, OCTAVES];
    CUMULUS_SKY_FORWARD: "cumulus_sky_forward" of "cumulus_sky", IMAGE, [SPHERE, AIR, CUMULUS, CUMULUS_LIGHT, FORWARD];
    CUMULUS_SKY_SHADER: "cumulus_sky_shader" of "cumulus_sky", IMAGE, [SPHERE, AIR, CUMULUS, CUMULUS_LIGHT, SURFACE, SHADER];
    CUMULUS_SKY_SHADER3: "cumulus_sky_shader3" of "cumulus_sky", IMAGE, [SPHERE, AIR, CUMULUS, CUMULUS_LIGHT, SURFACE, SHADER3];
    CUMULUS_PLANE_LATTICE: "cumulus_plane_lattice" of "cumulus_plane", IMAGE, [PROJECTION, CUMULUS, CUMULUS_LIGHT, PIECES, SUN_RAYS, LATTICE];
    CUMULUS_PLANE_LATTICE_ASIDE: "cumulus_plane_lattice_aside" of "cumulus_plane", IMAGE, [PROJECTION, CUMULUS, CUMULUS_LIGHT, PIECES, SUN_READ, LATTICE];
    CUMULUS_PLANE_OCTAVES: "cumulus_plane_octaves" of "cumulus_plane", IMAGE, [PROJECTION, CUMULUS, CUMULUS_LIGHT, PIECES, SUN_RAYS, OCTAVES];
    CUMULUS_PLANE_OCTAVES_ASIDE: "cumulus_plane_octaves_aside" of "cumulus_plane", IMAGE, [PROJECTION, CUMULUS, CUMULUS_LIGHT, PIECES, SUN_READ, OCTAVES];
    CUMULUS_PLANE_FORWARD: "cumulus_plane_forward" of "cumulus_plane", IMAGE, [PROJECTION, CUMULUS, CUMULUS_LIGHT, FORWARD];
    CUMULUS_PLANE_SHADER: "cumulus_plane_shader" of "cumulus_plane", IMAGE, [PROJECTION, CUMULUS, CUMULUS_LIGHT, SURFACE, SHADER];
    CUMULUS_PLANE_SHADER3: "cumulus_plane_shader3" of "cumulus_plane", IMAGE, [PROJECTION, CUMULUS, CUMULUS_LIGHT, SURFACE, SHADER3];
    CUMULUS_GROUND: "cumulus_ground", IMAGE, [CUMULUS];
    CUMULUS_THICKNESS: "cumulus_thickness", IMAGE, [CUMULUS];
    SKY_GROUND: "sky_ground", IMAGE, [];
    SKY: "sky", IMAGE, [SPHERE, AIR];
    SKY_ABOVE: "sky_above", IMAGE, [SPHERE, AIR];
}
