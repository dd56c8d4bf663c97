//! Charts: their error metric, their tables, and that the committed errors are those of this program.

#![expect(clippy::unwrap_used, reason = "a test stops where it fails")]

#[path = "common/library.rs"]
mod library;

use skyloom::chart::{CHARTS, Chart, ErrorSummary, SLAB_MEDIA, SlabRow, slab_errors};
use skyloom::method::SlabMethod;
use skyloom::plan::Plan;
use skyloom::request::Request;
use skyloom::scene::Scene;
use skyloom::tables::Detail;
use std::path::PathBuf;

fn committed(name: &str) -> Vec<Vec<String>> {
    let path: PathBuf = [env!("CARGO_MANIFEST_DIR"), "docs", "charts", name].iter().collect();
    let text = std::fs::read_to_string(path).unwrap();
    text.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

#[test]
fn the_error_metric_has_its_known_values() {
    // 98 errors of 1 %, one of -10 %, one of 50 %.
    let mut errors = vec![0.01; 98];
    errors.extend([-0.1, 0.5]);
    let summary = ErrorSummary::of(&errors);
    let mean_square: f64 = (98.0 * 1e-4 + 1e-2 + 0.25) / 100.0;
    assert!((summary.rms - mean_square.sqrt()).abs() < 1e-15);
    assert_eq!((summary.percentile99, summary.worst, summary.count), (0.1, 0.5, 100));
    let single = ErrorSummary::of(&[-0.2]);
    assert_eq!((single.rms, single.percentile99, single.worst), (0.2, 0.2, 0.2));
    assert_eq!(ErrorSummary::of(&[]), ErrorSummary::default());
    assert_eq!(ErrorSummary::of(&[0.1, f64::NAN]).worst, f64::INFINITY);
}

#[test]
fn tables_have_their_columns() {
    let columns = |name: &str| committed(name)[0].join(",");
    assert_eq!(
        columns("slab.csv"),
        "method,medium,ms_per_megatexel,ms_quartile1,ms_quartile3,reflected_rms,reflected_p99,transmitted_rms,transmitted_p99,near_sun_rms,near_sun_p99,\
         reflected_cases,transmitted_cases,near_sun_cases"
    );
    assert_eq!(
        columns("slab-fluxes.csv"),
        "side,order,sun_zenith_deg,thickness_m,tabulated,monte_carlo,monte_carlo_error,analytic,analytic_exact_fluxes,paper_repaired,\
         paper_printed"
    );
    assert_eq!(
        columns("slab-radiance.csv"),
        "side,thickness_m,sun_zenith_deg,view_deg,exact,monte_carlo,monte_carlo_error,tabulated_fine,analytic,\
         analytic_exact_fluxes,paper_repaired"
    );
    assert_eq!(
        columns("slab-modified.csv"),
        "side,phase_function,view_deg,order_1,orders_1_to_2,orders_1_to_3,orders_1_to_4,orders_1_to_5,all,all_error"
    );
    assert_eq!(columns("slab-validity.csv"), "method,map,side,x_from,x_to,y_from,y_to,rms_error");
    assert_eq!(columns("exchange.csv"), "case,kernel,solver,texels_per_height,passes,rms_percent,max_percent,ms");
    assert_eq!(
        columns("coupling.csv"),
        "scheme,sun_zenith_deg,optical_depth,ground_rms,ground_worst,sky_rms,sky_worst,up_rms,up_worst,ms"
    );
    assert_eq!(columns("light.csv"), "field,light,method,sun_zenith_deg,rms,rms_error,mean,mean_exact,ms");
    assert_eq!(
        columns("air.csv"),
        "method,set,truth,wavelength_nm,sun_zenith_deg,rms_percent,worst_percent,noise_percent,views,seconds_per_air,ms_per_sun"
    );
    assert_eq!(
        columns("cumulus.csv"),
        "method,cloud,set,rms_percent,energy_percent,us_per_pixel,cost_ratio,ms_per_sun"
    );
    assert_eq!(
        columns("sky-view.csv"),
        "field,look,eye_m,rays,texels_per_ray,coarseness,steps,high_rms,middle_rms,low_rms,mean_error,ms"
    );
    assert_eq!(
        columns("fields.csv"),
        "pattern,law,coverage_asked,spread_asked,seed,axes_4_8,axes_8_16,axes_16_32,axes_32_64,axes_64_128,axes_over_diagonals,\
         across_over_along,slope_8_32,slope_32_128,half_of_variance_m,cover,thickness_over_asked,depth_over_asked,spread,\
         fifth_of_depth,fifth_of_thickness,off_gamma"
    );
    assert_eq!(columns("fields-curves.csv"), "curve,pattern,law,coverage,resolution,size,x,y");
    assert_eq!(
        columns("frame.csv"),
        "texels_a_side,sun_zenith_deg,field_ms,light_ms,irradiance_ms,shadow_ms,cloud_ms,encode_ms,other_ms,frame_ms,\
         ns_per_texel"
    );
    assert_eq!(
        columns("formats.csv"),
        "picture,format,query,ms_per_megatexel,bytes_per_texel,rms_percent,worst_percent"
    );
    assert_eq!(columns("cumulus-growth.csv"), "set,value,spheres,index_ms,volume_ms,lattice_ms,shade_ms,ground_ms");
    for chart in CHARTS {
        let table = committed(&format!("{}.csv", chart.name));
        assert!(table.len() > 10 && table.iter().all(|row| row.len() == table[0].len()), "{}", chart.name);
    }
}

#[test]
fn every_method_is_summed_up_over_every_medium() {
    let table = committed("slab.csv");
    assert_eq!(table.len(), 1 + SlabRow::all().len() * (1 + SLAB_MEDIA));
    for (method, row) in SlabRow::all().iter().zip(&table[1..]) {
        assert_eq!([row[0].as_str(), row[1].as_str()], [method.name(), "all"]);
        // Cases of the media add up to those of all.
        for column in 11..14 {
            let count = |row: &Vec<String>| row[column].parse::<f64>().unwrap();
            let of_media = table[1..].iter().filter(|other| other[0] == row[0] && other[1] != "all").map(count);
            assert_eq!(of_media.sum::<f64>(), count(row));
        }
    }
}

/// Of the committed table: times of another day would be another machine's.
#[test]
fn cumulus_grow_dearer_far_slower_than_their_spheres() {
    let table = committed("cumulus-growth.csv");
    let cost = |count: &str| {
        let row = table.iter().find(|row| row[0] == "spheres" && row[1] == count).unwrap();
        row[3..].iter().map(|cell| cell.parse::<f64>().unwrap()).sum::<f64>()
    };
    assert!(cost("10000") <= 3.0 * cost("100"), "{} {}", cost("10000"), cost("100"));
    assert!(cost("64000") <= 3.0 * cost("500"), "{} {}", cost("64000"), cost("500"));
}

/// Henyey-Greenstein scatterers stand for the six media: they need no Mie theory.
#[test]
fn committed_errors_are_those_of_this_program() {
    // The finest tables take too long.
    let quick = |method: &SlabMethod| *method != SlabMethod::Tabulated(Detail::Finest);
    let methods: Vec<_> = SlabMethod::ALL.into_iter().filter(quick).map(SlabRow::Planned).collect();
    let (name, found) = slab_errors(&library::library(), SLAB_MEDIA - 1, &methods, &|_| ()).unwrap();
    let table = committed("slab.csv");
    for (method, errors) in methods.iter().zip(&found) {
        let row = table.iter().find(|row| row[0] == method.name() && row[1] == name).unwrap();
        for (at, summary) in errors.summaries().iter().enumerate() {
            for (column, value) in [(5 + 2 * at, summary.rms), (6 + 2 * at, summary.percentile99)] {
                let wanted: f64 = row[column].parse().unwrap();
                // Five digits are written; machines round differently.
                let allowed = 1e-3 * wanted + 1e-5;
                assert!((value - wanted).abs() <= allowed, "{} {}: {value}, {wanted}", method.name(), table[0][column]);
            }
            let count: usize = row[11 + at].parse().unwrap();
            assert_eq!(summary.count, count);
        }
    }
}

/// The plan quotes these charts: a change of a method must come with new charts.
#[test]
fn a_sample_of_each_chart_is_as_committed() {
    let library = library::library();
    let mut charts = 0;
    for chart in CHARTS {
        let Some(rows) = chart.sample(&library) else { continue };
        let table = committed(&format!("{}.csv", chart.name));
        for row in rows.unwrap() {
            let line = table.iter().find(|line| line.starts_with(&row.cells));
            let line = line.unwrap_or_else(|| panic!("{}: no row {:?}", chart.name, row.cells));
            for (column, value, error) in row.values {
                let at = table[0].iter().position(|name| name == column).unwrap();
                let wanted: f64 = line[at].parse().unwrap();
                // Five digits are written, devices round differently (1e-4: the light of a settled exchange has single
                // precision), and what is random lies within five standard errors: the committed
                // run is ten times as long, and adds little to them.
                let allowed = 2e-3 * wanted.abs() + 1e-4 + 5.0 * error;
                assert!(
                    (value - wanted).abs() <= allowed,
                    "{} {:?} {column}: {value}, {wanted}",
                    chart.name,
                    row.cells
                );
            }
        }
        charts += 1;
    }
    assert_eq!(charts, 10);
}

/// What the chart of fields shows. Limits are older than it: no direction is another (0.8 to 1.3 along axes over diagonals, of every
/// field), cover and means within 2 %, spread within 3 %, no part of the distribution further than 1 % off the gamma law, the
/// fifth percentile of broken cloud at most 0.15 of the mean; and noise alone falls with -5/3 within 0.15 down to 640 m.
#[test]
fn synthetic_fields_are_as_they_were_asked_for() {
    let table = committed("fields.csv");
    let at = |name: &str| table[0].iter().position(|column| column == name).unwrap();
    let mut fields = 0;
    for row in table[1..].iter().filter(|row| row[at("law")] == "gamma" && row[at("seed")] != "mean") {
        let number = |name: &str| row[at(name)].parse::<f64>().unwrap();
        let ratio = number("axes_over_diagonals");
        if row[at("pattern")] == "streets" {
            assert!(ratio > 1.3 && number("across_over_along") > 1.2, "{row:?}");
        } else {
            assert!((0.8..1.3).contains(&ratio), "{row:?}");
        }
        let kept =
            [number("cover") / number("coverage_asked"), number("thickness_over_asked"), number("depth_over_asked")];
        assert!(kept.iter().all(|kept| (kept - 1.0).abs() < 0.02), "{row:?}");
        assert!((number("spread") / number("spread_asked") - 1.0).abs() < 0.03, "{row:?}");
        assert!(number("off_gamma") < 0.01, "{row:?}");
        assert!(number("coverage_asked") > 0.9 || number("fifth_of_depth") <= 0.15, "{row:?}");
        fields += 1;
    }
    assert_eq!(fields, 2 * 4 * 8);
    // Cells and their noise together, from the cells' size down: within 0.4 down to 160 m. Without what makes up for the cells' smoothness: -2.3 to -2.6.
    let cells = table[1..].iter().filter(|row| {
        row[at("law")] == "gamma" && row[at("seed")] == "mean" && ["closed", "open"].contains(&&*row[at("pattern")])
    });
    let slopes: Vec<[f64; 2]> =
        cells.map(|row| ["slope_8_32", "slope_32_128"].map(|name| row[at(name)].parse().unwrap())).collect();
    assert_eq!(slopes.len(), 4);
    assert!(slopes.iter().flatten().all(|slope| (slope + 5.0 / 3.0).abs() < 0.4), "{slopes:?}");
    let noise = table[1..].iter().filter(|row| row[at("pattern")] == "fractal" && row[at("seed")] == "mean");
    let slopes: Vec<f64> = noise.map(|row| row[at("slope_8_32")].parse().unwrap()).collect();
    assert_eq!(slopes.len(), 4);
    assert!(slopes.iter().all(|slope| (slope + 5.0 / 3.0).abs() < 0.15), "{slopes:?}");
}

/// Textures of the gamma law that are larger than the scene's resolution have as much of every short wave as those of a scene of their
/// resolution, within a tenth; by the other law less than a fifth from two of the scene's texels on.
#[test]
fn a_larger_texture_adds_detail() {
    let table = committed("fields-curves.csv");
    let power = |law: &str, resolution: &str, cycles: &str| {
        let wanted = ["detail", "open", law, "0.55", resolution, "2048", cycles];
        table.iter().find(|row| row[..7] == wanted).unwrap()[7].parse::<f64>().unwrap()
    };
    // Two texels of 80 m are 6.25 cycles per km.
    let places = table[1..].iter().filter(|row| row[..6] == ["detail", "open", "gamma", "0.55", "256", "2048"]);
    let short: Vec<&String> = places.map(|row| &row[6]).filter(|x| x.parse::<f64>().unwrap() > 6.25).collect();
    assert!(short.len() > 6, "{short:?}");
    for cycles in short {
        let [gamma, other] = ["gamma", "lognormal"].map(|law| power(law, "256", cycles) / power(law, "2048", cycles));
        assert!((gamma - 1.0).abs() < 0.1 && other < 0.2, "{cycles} per km: {gamma}, {other}");
    }
}

/// What the chart of light shows: below a low sun the blended transport errs less than columns, the marched shadow far
/// less than a shifted column, and the mean of the light is kept within a tenth.
#[test]
fn light_errs_less_by_slanted_rays_than_by_columns() {
    let table = committed("light.csv");
    let row = |field: &str, light: &str, method: &str, sun: &str| {
        let row = table.iter().find(|row| row[..4] == [field, light, method, sun]).unwrap();
        [4, 5, 6, 7].map(|column| row[column].parse::<f64>().unwrap())
    };
    for field in ["overcast", "broken"] {
        for sun in ["60", "70", "80"] {
            let [columns, ..] = row(field, "base", "columns", sun);
            let [blended, noise, mean, exact] = row(field, "base", "blended", sun);
            assert!(blended + 4.0 * noise < 0.7 * columns, "{field} {sun}: {blended}, columns {columns}");
            assert!((mean / exact - 1.0).abs() < 0.1, "{field} {sun}: mean {mean}, exact {exact}");
        }
    }
    for sun in ["30", "60", "70", "80"] {
        let [marched, noise, ..] = row("broken", "ground direct", "marched", sun);
        let [tangent, ..] = row("broken", "ground direct", "column at h tan", sun);
        assert!(marched < 0.01 && noise < 0.01 && tangent > 0.1, "{sun}: {marched} +- {noise}, {tangent}");
    }
}

/// The plan counts on the largest error of this chart between 3 and 10 degrees from the horizontal, to a digit more than it tells.
#[test]
fn skies_err_by_what_the_plan_counts_on() {
    let table = committed("sky-view.csv");
    let planned = |rays: &str, steps: &str| {
        let rows = table.iter().filter(|row| row[1] == "planned" && row[3] == rays && row[6] == steps);
        let errors: Vec<f64> = rows.map(|row| row[8].parse().unwrap()).collect();
        assert_eq!(errors.len(), 4);
        errors.into_iter().fold(0.0, f64::max)
    };
    let scene = r#"{"layers": [{"base_m": 1000, "droplets": {"effective_radius_um": 7}, "thickness": {"kind": "stratocumulus",
        "pattern": "open", "mean_m": 300, "coverage": 0.55}}]}"#;
    let scene = Scene::from_json(scene.as_bytes()).unwrap();
    for (tolerance, rays, steps) in [("0.1", "4", "0.5"), ("0.02", "4", "1"), ("0.003", "8", "2")] {
        let query = [("tolerance".to_owned(), tolerance.to_owned())];
        let request = Request::parse("sky", "f32", &query).unwrap().of(&scene).unwrap();
        let found = Plan::new(&request, &scene).sky.error;
        let charted = planned(rays, steps);
        assert!((found - charted).abs() < 0.006, "{tolerance}: {found}, {charted}");
    }
}

/// What the chart of air shows: simple methods miss much of the light in every set, moments as much of it as the plan
/// counts on, beside the noise of the truth.
#[test]
fn moments_err_less_than_simpler_methods_in_all_air() {
    let table = committed("air.csv");
    let number = |row: &Vec<String>, column: usize| row[column].parse::<f64>().unwrap();
    let mut compared = 0;
    for row in &table[1..] {
        let method = |name: &str| {
            let same = |other: &&Vec<String>| other[0] == name && other[1..5] == row[1..5];
            table.iter().find(same).map(|other| number(other, 5)).unwrap()
        };
        // Thin aerosol by the plan's choice for it, heavier by the other, from the ground and from above.
        let chosen = if ["haze", "thick"].iter().any(|heavy| row[1].starts_with(heavy)) {
            "moments fine"
        } else {
            "moments normal"
        };
        let limit = match number(row, 4) {
            ..=90.0 => 1.0,
            ..=96.0 => 2.5,
            _ => continue,
        };
        if row[0] == chosen {
            let (rms, noise) = (number(row, 5), number(row, 7));
            assert!(rms < limit + noise, "{row:?}");
            for simple in ["single scattering", "isotropic sum", "second order"] {
                // Where light is scattered once at most, as that of molecules in red light, two orders are nearly all.
                assert!(method(simple) > rms, "{simple}, {row:?}");
            }
            compared += 1;
        }
    }
    assert!(compared > 60, "{compared}");
}

#[test]
fn charts_are_found_by_name() {
    for chart in CHARTS {
        assert_eq!(Chart::named(chart.name).map(|found| found.about), Some(chart.about));
    }
    assert!(Chart::named("slabs").is_none());
}

/// A relative error in per cent, as the README writes it.
fn per_cent(cell: &str) -> String {
    let value = 100.0 * cell.parse::<f64>().unwrap();
    match value {
        10.0.. => format!("{value:.0} %"),
        1.0.. => format!("{value:.1} %"),
        _ => format!("{value:.2} %"),
    }
}

#[test]
fn the_readme_quotes_the_chart() {
    let readme = include_str!("../README.md");
    let chart = include_str!("../docs/charts/slab.csv");
    let rows: Vec<Vec<&str>> = chart.lines().map(|line| line.split(',').collect()).collect();
    let fast = rows.iter().filter(|row| row[1] == "all" && row[0] != "reference");
    let mut found = 0;
    for row in fast {
        let errors: Vec<String> = row[5..11].iter().map(|cell| per_cent(cell)).collect();
        let milliseconds: f64 = row[2].parse().unwrap();
        let pairs: Vec<String> = errors.chunks(2).map(|pair| pair.join(", ")).collect();
        let line = format!("| {} | {milliseconds:.0} | {} |", row[0], pairs.join(" | "));
        assert!(readme.contains(&line), "the README lacks: {line}");
        found += 1;
    }
    assert_eq!(found, 7);
}

#[test]
fn the_texts_quote_the_chart_of_cumulus() {
    let texts = [include_str!("../docs/method.md"), include_str!("../docs/charts/README.md")];
    let chart = include_str!("../docs/charts/cumulus.csv");
    let rows: Vec<Vec<&str>> = chart.lines().map(|line| line.split(',').collect()).collect();
    let whole: Vec<_> = rows.iter().filter(|row| row[1] == "all" && row[2] == "all").collect();
    let digits = |value: f64| if value < 10.0 { format!("{value:.1}") } else { format!("{value:.0}") };
    for row in &whole {
        let of = |set: &str| {
            let found = rows.iter().find(|other| other[..3] == [row[0], "all", set]).unwrap();
            digits(found[3].parse().unwrap())
        };
        let errors = ["front", "side", "top", "back", "above", "below", "sky"].map(of).join(" | ");
        let [ratio, milliseconds] = [6, 7].map(|column: usize| row[column].parse::<f64>().unwrap());
        let ratio = if ratio == 1.0 { "1".to_owned() } else { format!("{ratio:.2}") };
        let line = format!("| `{}` | {errors} | {ratio} | {milliseconds:.0} |", row[0]);
        assert!(texts.iter().all(|text| text.contains(&line)), "a text lacks: {line}");
    }
    assert_eq!(whole.len(), 10);
}

/// The texts quote the chart of light.
#[test]
fn the_texts_quote_the_chart_of_light() {
    let [readme, charts, method] =
        [include_str!("../README.md"), include_str!("../docs/charts/README.md"), include_str!("../docs/method.md")];
    let table = committed("light.csv");
    let rms = |field: &str, light: &str, method: &str, suns: &[&str]| {
        let of_sun = |sun: &&str| {
            let row = table.iter().find(|row| row[..4] == [field, light, method, sun]).unwrap();
            let [error, mean] = [4, 7].map(|column: usize| row[column].parse::<f64>().unwrap());
            let percent = 100.0 * error / mean;
            if percent < 9.95 { format!("{percent:.1}") } else { format!("{percent:.0}") }
        };
        suns.iter().map(of_sun).collect::<Vec<_>>()
    };
    let both = |light: &str, method: &str, suns: &[&str]| {
        ["overcast", "broken"].map(|field| rms(field, light, method, suns).join(", ")).join(" | ")
    };
    let has = |text: &str, line: &str| assert!(text.contains(line), "a text lacks: {line}");
    const SUNS: [&str; 5] = ["0", "30", "60", "70", "80"];
    for (number, name) in ["mean alone", "columns", "tilted", "entry", "blended", "lattice"].into_iter().enumerate() {
        let [base, ground] = ["base", "ground"].map(|light| format!("| {} |", both(light, name, &SUNS)));
        has(charts, &base);
        has(charts, &ground);
        if ["columns", "blended", "lattice"].contains(&name) {
            has(readme, &format!("{} {}", base.trim_end_matches(" |"), ground));
        }
        if number > 0 {
            let seen = |field: &str| {
                ["radiance from below", "radiance from above"]
                    .map(|light| rms(field, light, name, &["40", "60"]).join(", "))
                    .join(" | ")
            };
            has(charts, &format!("| {name} | {} | {} |", seen("overcast"), seen("broken")));
        }
        if ["tilted", "blended", "lattice"].contains(&name) {
            let [closed, broken] =
                ["overcast", "broken"].map(|field| rms(field, "base", name, &["60", "80"]).join(" and "));
            has(
                method,
                &format!("{closed} % under a closed cover at 60 and 80 degrees, {broken} % under a broken one"),
            );
        }
    }
}

/// The README quotes the chart of a frame.
#[test]
fn the_readme_quotes_the_chart_of_a_frame() {
    let table = committed("frame.csv");
    let of = |sun: &str, column: &str| {
        let at = table[0].iter().position(|name| name == column).unwrap();
        let row = table.iter().find(|row| row[..2] == ["512", sun]).unwrap();
        format!("{:.0}", row[at].parse::<f64>().unwrap())
    };
    let [field, light, irradiance, cloud, shadow, encoded, frame] =
        ["field_ms", "light_ms", "irradiance_ms", "cloud_ms", "shadow_ms", "encode_ms", "frame_ms"]
            .map(|column| of("60", column));
    let high = of("0", "frame_ms");
    let words = format!(
        "a frame takes {frame} ms with the sun at 60 degrees and its disc ({high} with the sun overhead): {field} ms for the field, \
         {light} for the maps of sunlight and the exchange, {irradiance} for irradiance with the direct beam on the ground, {cloud} for \
         the cloud, {shadow} for reading the shadow and {encoded} to write the cloud as OpenEXR."
    );
    let readme = include_str!("../README.md").split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(readme.contains(&words), "the README lacks: {words}");
}

/// Where texts end is reckoned from how many letters they have.
#[test]
fn no_text_of_a_chart_runs_out_of_it() {
    // A letter is about half as wide as its font's size is high; the legends reckon with 0.44.
    const WIDTH: f64 = 0.44;
    let folder: PathBuf = [env!("CARGO_MANIFEST_DIR"), "docs", "charts"].iter().collect();
    let attribute = |tag: &str, name: &str| {
        let (_, rest) = tag.split_once(&format!(" {name}=\"")).unwrap();
        rest.split_once('"').unwrap().0.to_owned()
    };
    let mut pictures = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|extension| extension != "svg") {
            continue;
        }
        pictures += 1;
        let picture = std::fs::read_to_string(&path).unwrap();
        let view_box = attribute(picture.split_once('>').unwrap().0, "viewBox");
        let [left, top, width, height] = <[f64; 4]>::try_from(
            view_box.split_whitespace().map(|number| number.parse().unwrap()).collect::<Vec<f64>>(),
        )
        .unwrap();
        let mut texts = 0;
        for piece in picture.split("<text").skip(1) {
            let (tag, rest) = piece.split_once('>').unwrap();
            let words = rest.split_once("</text>").unwrap().0.trim().replace("&apos;", "'").replace("&amp;", "&");
            let number = |name: &str| attribute(tag, name).parse::<f64>().unwrap();
            let (x, y, size) = (number("x"), number("y"), number("font-size"));
            let long = words.chars().count() as f64 * WIDTH * size;
            let [before, after] = match &*attribute(tag, "text-anchor") {
                "start" => [0.0, long],
                "middle" => [0.5 * long; 2],
                _ => [long, 0.0],
            };
            // What is turned stands along y, and reads upwards.
            let [from, to, along, across] = if tag.contains("rotate(270") {
                [top, top + height, y, x - left]
            } else {
                [left, left + width, x, y - top]
            };
            let most = if tag.contains("rotate(270") { width } else { height };
            assert!(
                along - before >= from && along + after <= to && (0.0..=most).contains(&across),
                "{}: '{words}' at {x}, {y}, {long} long, in {view_box}",
                path.display()
            );
            texts += 1;
        }
        assert!(texts > 10, "{}", path.display());
    }
    assert_eq!(pictures, 18);
}
