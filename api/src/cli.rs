//! The command line. Exit codes: 0 done, 1 failure, 2 bad usage, scene, query, image or settings, 3 a server whose graphics driver hangs.

use std::ffi::OsString;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;

use clap::{Arg, ArgAction, ArgMatches, Command, value_parser};
use skyloom::chart::CHARTS;
use skyloom::request::{QUERY_PARAMETERS, TextureKind};

use crate::config::{Config, Listen, LogFormat};
use crate::serve::{self, ServeError};
use crate::{logs, openapi};

mod chart;
mod fault;
mod film;
mod generate;
mod render;
mod store;
mod streams;

use fault::Fault;
use streams::{tell, to_stdout};

/// Exit code of a server whose graphics driver hangs.
pub const HUNG: u8 = 3;

/// Runs the command line of this process; gives its exit code.
pub fn main() -> u8 {
    match run(std::env::args_os()) {
        Ok(()) => 0,
        Err(fault) => {
            let (text, code) = match fault {
                Fault::Usage(text) => (text, 2),
                Fault::Failure(text) => (text, 1),
                Fault::Hung(text) => (text, HUNG),
            };
            // Nothing can be done when even stderr is closed.
            writeln!(std::io::stderr(), "{}", text.trim_end()).unwrap_or_default();
            code
        }
    }
}

fn run(arguments: impl IntoIterator<Item = OsString>) -> Result<(), Fault> {
    let matches = match command().try_get_matches_from(arguments) {
        Ok(matches) => matches,
        // Help and version go to stdout and are no fault.
        Err(error) if !error.use_stderr() => {
            return error.print().map_err(|error| Fault::Failure(error.to_string()));
        }
        Err(error) => return Err(Fault::Usage(error.to_string())),
    };
    match matches.subcommand() {
        Some(("serve", options)) => serve_command(options),
        Some((name, options)) => {
            logs::start("warn", LogFormat::Text);
            match name {
                "render" => render::command(options),
                "plan" => render::plan(options),
                "film" => film::command(options),
                "generate" => generate::command(options),
                "check" => check(options),
                "store" => store::command(options),
                "chart" => chart::command(options),
                "openapi" => print_openapi(),
                _ => list_adapters(),
            }
        }
        None => Err(Fault::Usage(command().render_help().to_string())),
    }
}

fn command() -> Command {
    let file = |name: &'static str| Arg::new(name).value_parser(value_parser!(PathBuf));
    let scene = || file("SCENE").required(true).help("Scene file (JSON); - reads it from stdin");
    Command::new("skyloom")
        .about("Sky lighting: cloud, shadow and irradiance textures computed from a description of the sky")
        .version(env!("CARGO_PKG_VERSION"))
        .arg_required_else_help(true)
        .after_help(
            "Examples:\n  skyloom serve                                  start the server, then open http://127.0.0.1:8080\n  \
             skyloom check scene.json                       is the scene valid, and what does it say in full?\n  \
             skyloom render scene.json irradiance.exr       one texture into a file, without a server\n  \
             skyloom chart                                  how exact and how fast is each method?\n  \
             skyloom store check                            is everything that the server keeps whole?\n  \
             skyloom adapters                               which graphics devices are there?\n\n\
             Exit codes: 0 done, 1 failure (no driver, disk full), 2 bad usage, scene, query or image, 3 a graphics driver hangs (serve).\n\
             SKYLOOM_LOG sets what is logged to stderr (error, warn, info, debug).",
        )
        .subcommand(
            Command::new("serve")
                .about("Serves skies over HTTP")
                .arg(file("config").long("config").value_name("FILE").help("Settings; config/skyloom.toml shows all of them"))
                .arg(
                    Arg::new("listen")
                        .long("listen")
                        .value_name("HOST:PORT")
                        .value_parser(value_parser!(Listen))
                        .help("Address or host name to listen on; port 0 picks a free one [default: 127.0.0.1:8080]"),
                )
                .arg(file("data").long("data").value_name("DIR").help("Folder of skies, images and tables [default: ./data]"))
                .after_help(
                    "Prints one line, `listening on http://ADDR:PORT`, on stdout; the log goes to stderr.\n\n\
                     Examples:\n  skyloom serve --listen 127.0.0.1:0 --data /var/lib/skyloom\n  \
                     curl --json @scene.json http://127.0.0.1:8080/v1/skies\n  \
                     curl -O http://127.0.0.1:8080/v1/skies/ID/irradiance.exr",
                ),
        )
        .subcommand(render_command(scene()))
        .subcommand(plan_command(scene()))
        .subcommand(film_command(scene()))
        .subcommand(generate_command())
        .subcommand(
            Command::new("check")
                .about("Checks a scene; prints it with every default spelled out")
                .arg(scene())
                .after_help(
                    "Errors are printed one a line as `file: pointer: what is wrong and what is allowed`, with exit code 2.\n\
                     Images may be named by path, relative to the scene file.\n\nExample:\n  skyloom check scene.json",
                ),
        )
        .subcommand(store::describe())
        .subcommand(chart_command())
        .subcommand(
            Command::new("openapi")
                .about("Prints the description of the HTTP service, OpenAPI 3.1")
                .after_help("A server answers with the same at /openapi.json.\n\nExample:\n  skyloom openapi >openapi.json"),
        )
        .subcommand(Command::new("adapters").about("Lists the graphics devices; a star marks the one that is used"))
}

fn chart_command() -> Command {
    let mut list = "Charts:\n".to_owned();
    for chart in CHARTS {
        writeln!(list, "  {:<16} {}", chart.name, chart.about).unwrap_or_default();
    }
    Command::new("chart")
        .about("Measures how exact and how fast each method is, and draws it: SVG pictures and CSV tables")
        .arg(Arg::new("NAME").action(ArgAction::Append).help("Charts to make [default: all]"))
        .arg(
            Arg::new("output")
                .short('o')
                .long("output")
                .value_name("DIR")
                .value_parser(value_parser!(PathBuf))
                .help("Folder to write to [default: docs/charts]"),
        )
        .after_help(format!("{list}\nExample:\n  skyloom chart slab-fluxes -o /tmp"))
}

/// `render` has an option for each query parameter of the server, by the same name.
fn render_command(scene: Arg) -> Command {
    let command = Command::new("render")
        .about("Renders one texture into a file, exactly as the server would answer it")
        .arg(scene)
        .arg(
            Arg::new("TEXTURE.FORMAT")
                .required(true)
                .help(format!("What to render: {}, as .exr, .png or .f32", TextureKind::names())),
        )
        .arg(
            Arg::new("output")
                .short('o')
                .long("output")
                .value_name("FILE")
                .value_parser(value_parser!(PathBuf))
                .help("File to write; - is stdout [default: TEXTURE.FORMAT]"),
        )
        .arg(
            Arg::new("adapter")
                .long("adapter")
                .value_name("NAME")
                .help("Part of the name of the graphics device to use [default: the best one]"),
        )
        .after_help(
            "Examples:\n  skyloom render scene.json cloud.png\n  \
             skyloom render scene.json irradiance.exr --time 600 --size 1024 -o ground.exr\n  \
             skyloom render scene.json shadow.f32 -o - | my-engine\n\n\
             Images in the scene may be named by path, relative to the scene file.",
        );
    with_query(command)
}

/// `plan` has the options of `render`, as far as they name a request.
fn plan_command(scene: Arg) -> Command {
    let command = Command::new("plan")
        .about("Says which methods, sizes and passes a texture would be made with, and the error expected of each")
        .arg(scene)
        .arg(Arg::new("TEXTURE.FORMAT").help("The texture, as for render [default: cloud.exr]"))
        .after_help("Example:\n  skyloom plan scene.json cloud.exr --tolerance 0.3");
    with_query(command)
}

/// `film` has the options of `render`, as far as they make pictures.
fn film_command(scene: Arg) -> Command {
    let number = |name: &'static str, value: &'static str| {
        Arg::new(name).long(name).value_name(value).value_parser(value_parser!(f64)).allow_hyphen_values(true)
    };
    let command = Command::new("film")
        .about("Renders a texture at many times: an animation (.gif), or a strip of pictures (.png)")
        .arg(scene)
        .arg(Arg::new("TEXTURE").help(format!("{} [default: cloud]", TextureKind::names())))
        .arg(number("every", "SECONDS").help("Time from frame to frame, of the scene [default: 10]"))
        .arg(
            Arg::new("count")
                .long("count")
                .value_name("1 to 10000")
                .value_parser(value_parser!(u32).range(1..=10_000))
                .help("Frames [default: 48]"),
        )
        .arg(number("fps", "0.1 to 50").help("Frames a second of the animation [default: 15]"))
        .arg(
            Arg::new("back")
                .long("back")
                .action(ArgAction::SetTrue)
                .help("Animation: show the frames backwards after the last, so that it repeats without a cut"),
        )
        .arg(
            Arg::new("behind")
                .long("behind")
                .value_name("#rrggbb")
                .value_parser(film::colour)
                .help("Colour behind the clouds [default: #2c3f63]"),
        )
        .arg(
            Arg::new("output")
                .short('o')
                .long("output")
                .value_name("FILE")
                .value_parser(value_parser!(PathBuf))
                .help("File to write, .gif or .png [default: film.gif]"),
        )
        .arg(
            Arg::new("adapter")
                .long("adapter")
                .value_name("NAME")
                .help("Part of the name of the graphics device to use"),
        )
        .after_help(
            "Example:\n  skyloom film scene.json cloud --eye=0,0,2 --size 256 --every 20 --count 60 -o clouds.gif\n\n\
             The first frame is at --time.",
        );
    with_query(command)
}

/// `generate` takes a job as the server does.
fn generate_command() -> Command {
    let moment =
        |name: &'static str, help: &'static str| Arg::new(name).long(name).value_name("TIME").required(true).help(help);
    Command::new("generate")
        .about("Makes the frames of a job between two moments, as the server would have made them by the clock")
        .arg(
            Arg::new("JOB")
                .required(true)
                .value_parser(value_parser!(PathBuf))
                .help("Job file, .toml or JSON, as POST /v1/jobs takes it; `scene` may be the path of a scene file"),
        )
        .arg(moment("from", "First moment: RFC 3339, or seconds since 1970"))
        .arg(moment("to", "End: frames that are due before it are made"))
        .arg(
            Arg::new("output")
                .short('o')
                .long("output")
                .value_name("DIR")
                .value_parser(value_parser!(PathBuf))
                .help("Folder in which the job's own folder is made [default: .]"),
        )
        .arg(
            Arg::new("adapter")
                .long("adapter")
                .value_name("NAME")
                .help("Part of the name of the graphics device to use [default: the best one]"),
        )
        .after_help(
            "Example job (roof.toml), a sky every minute:\n  name = \"roof\"\n  scene = \"scene.json\"\n  every = \"1m\"\n  \
             textures = [{ texture = \"sky\", format = \"exr\", query = { size = 256 } }]\n\n\
             skyloom generate roof.toml --from 2026-06-21T00:00:00Z --to 2026-06-22T00:00:00Z -o frames\n\n\
             Writes frames/roof/20260621t000000z-sky.exr and so on, manifest.json with times and hashes, latest.json. Run again after\n\
             an interruption it goes on where it stopped: frames that are there, whole and of this job and version are left. All\n\
             frames are kept; `keep`, `ahead_s`, `catch_up` and `paused` are for the server.\n\
             Exit codes: 0 all frames are there, 1 failure (no driver, disk full), 2 wrong command line, job, scene or image.",
        )
}

fn with_query(command: Command) -> Command {
    QUERY_PARAMETERS.iter().fold(command, |command, parameter| {
        let mut help = parameter.meaning.to_owned();
        if !parameter.default.is_empty() {
            write!(help, " [default: {}]", parameter.default).unwrap_or_default();
        }
        command.arg(
            Arg::new(parameter.name)
                .long(parameter.name)
                .value_name(parameter.values)
                .help(help)
                .help_heading("Query (as in the texture's address)")
                .allow_hyphen_values(true)
                // Repeated options are passed on, so that they are refused in the server's words.
                .action(ArgAction::Append),
        )
    })
}

fn serve_command(options: &ArgMatches) -> Result<(), Fault> {
    let mut config = match options.get_one::<PathBuf>("config") {
        Some(path) => Config::load(path).map_err(|error| Fault::Usage(error.to_string()))?,
        None => Config::default(),
    };
    if let Some(listen) = options.get_one::<Listen>("listen") {
        config.server.listen.clone_from(listen);
    }
    if let Some(data) = options.get_one::<PathBuf>("data") {
        config.keep_in(data);
    }
    config.check().map_err(|error| Fault::Usage(error.to_string()))?;
    logs::start("info", config.log.format);
    serve::serve(config).map_err(|error| match error {
        ServeError::Hung => Fault::Hung(error.to_string()),
        _ => Fault::Failure(error.to_string()),
    })
}

fn check(options: &ArgMatches) -> Result<(), Fault> {
    let path = render::scene_path(options)?;
    let (scene, _images) = render::read_scene(path, render::Unknown::Kept)?;
    let text = serde_json::to_string_pretty(&scene.to_json()).map_err(|error| Fault::Failure(error.to_string()))?;
    to_stdout(format!("{text}\n").as_bytes())?;
    tell(path, &scene.notes());
    Ok(())
}

fn print_openapi() -> Result<(), Fault> {
    to_stdout(format!("{:#}\n", openapi::document()).as_bytes())
}

fn list_adapters() -> Result<(), Fault> {
    let adapters = skyloom::gpu::adapters(None);
    let mut text = String::new();
    for adapter in &adapters {
        let mark = if adapter.chosen { '*' } else { ' ' };
        writeln!(text, "{mark} {} ({}, {}; {})", adapter.name, adapter.backend, adapter.kind, adapter.driver)
            .unwrap_or_default();
    }
    if adapters.is_empty() {
        return Err(Fault::Failure(
            "no graphics device was found. Install a Vulkan driver: the graphics card's own, or the software driver \
             (Debian, Ubuntu: mesa-vulkan-drivers; Fedora: mesa-vulkan-drivers; Arch: vulkan-swrast)"
                .to_owned(),
        ));
    }
    to_stdout(text.as_bytes())
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]
mod tests {
    use super::*;

    #[test]
    fn the_command_is_consistent_and_has_an_option_for_every_query_parameter() {
        command().debug_assert();
        let command = command();
        let render = command.find_subcommand("render").unwrap();
        for parameter in QUERY_PARAMETERS {
            assert!(render.get_arguments().any(|argument| argument.get_long() == Some(parameter.name)));
        }
    }
}
