//! `skyloom store`: looks after what a server keeps.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::SystemTime;

use clap::{Arg, ArgAction, ArgMatches, Command, value_parser};
use skyloom::store::{StoreError, Upkeep};

use super::fault::Fault;
use super::render::LateBar;
use super::streams::to_stdout;
use crate::config::Config;
use crate::storage;
use crate::upkeep::{self, Removal};

/// The command and what it takes.
pub(super) fn describe() -> Command {
    let place = |command: Command| {
        let file = |name: &'static str| Arg::new(name).long(name).value_parser(value_parser!(PathBuf));
        command
            .arg(
                file("config")
                    .value_name("FILE")
                    .help("Settings of the server: where its store is, and what it may keep"),
            )
            .arg(file("data").value_name("DIR").help("Folder of the store [default: that of the settings, ./data]"))
    };
    let flag = |name: &'static str, help: &'static str| Arg::new(name).long(name).action(ArgAction::SetTrue).help(help);
    let check = Command::new("check")
        .about("Reads everything that is kept and tells each damaged or stray file, a line each")
        .arg(flag("repair", "Move what is damaged or stray into the folder `aside`, and remove what killed writers left"))
        .after_help(
            "Looked at are skies (the scene of the id), images (their SHA-256, and that they decode), tables and finished textures\n\
             (their checksum), jobs and frames (the hashes in their records). A server may go on meanwhile.\n\
             With --repair nothing that is damaged is lost: it is in `aside`. Tables, textures and frames are made again; skies,\n\
             images and jobs are mended by sending the same again.\n\n\
             Exit codes: 0 all is as it should be, or was repaired; 1 something is damaged or stray, or cannot be read.\n\n\
             Example:\n  skyloom store check --data /var/lib/skyloom",
        );
    let gc = Command::new("gc")
        .about("Removes what may go: beyond a quota, not used for long, left by killed writers or deleted jobs")
        .arg(flag("dry-run", "Tell what would go, and leave it"))
        .after_help(
            "By [store] of the settings: tables beyond table_bytes and textures beyond texture_bytes, those that were not used for\n\
             longest first; skies not used for sky_days; images that no sky and no job names, not used for image_days. A server does\n\
             the same by itself every hour; it may go on meanwhile.\n\n\
             Exit codes: 0 done, 1 the store cannot be read or changed.\n\n\
             Example:\n  skyloom store gc --config skyloom.toml --dry-run",
        );
    Command::new("store")
        .about("Looks after what a server keeps: check, gc")
        .subcommand_required(true)
        .arg_required_else_help(true)
        .subcommand(place(check))
        .subcommand(place(gc))
}

pub(super) fn command(options: &ArgMatches) -> Result<(), Fault> {
    match options.subcommand() {
        Some(("check", options)) => check(options),
        Some((_, options)) => gc(options),
        None => Err(Fault::Usage(describe().render_help().to_string())),
    }
}

/// Settings and the store that they tell.
fn open(options: &ArgMatches) -> Result<(Config, Box<dyn Upkeep>), Fault> {
    let mut config = match options.get_one::<PathBuf>("config") {
        Some(path) => Config::load(path).map_err(|error| Fault::Usage(error.to_string()))?,
        None => Config::default(),
    };
    if let Some(data) = options.get_one::<PathBuf>("data") {
        config.keep_in(data);
    }
    config.check_store().map_err(|error| Fault::Usage(error.to_string()))?;
    let data = &config.server.data;
    if config.store.bucket().is_none() && !data.is_dir() {
        return Err(Fault::Usage(format!("{}: there is no such folder", data.display())));
    }
    let store = storage::to_look_after(&config).map_err(failed)?;
    Ok((config, store))
}

fn failed(error: StoreError) -> Fault {
    Fault::Failure(error.to_string())
}

fn check(options: &ArgMatches) -> Result<(), Fault> {
    let (config, store) = open(options)?;
    let bar = LateBar::new("checking the store".to_owned());
    let found = upkeep::check(&*store, config.limits.image(), &|part| bar.set(part));
    drop(bar);
    let (findings, files, bytes) = found.map_err(failed)?;
    let mut text = String::new();
    for finding in &findings {
        let done = match (options.get_flag("repair"), finding.is_leftover) {
            (false, _) => String::new(),
            (true, true) => store.discard(&finding.path).map(|_| "; removed".to_owned()).map_err(failed)?,
            (true, false) => format!("; moved to {}", store.set_aside(&finding.path).map_err(failed)?),
        };
        writeln!(text, "{}: {}{done}", finding.path, finding.what).unwrap_or_default();
    }
    writeln!(text, "{files} files of {bytes} bytes: {}", count(findings.len())).unwrap_or_default();
    to_stdout(text.as_bytes())?;
    if findings.is_empty() || options.get_flag("repair") {
        return Ok(());
    }
    Err(Fault::Failure(format!("the store has {}; --repair moves it aside", count(findings.len()))))
}

fn count(findings: usize) -> String {
    if findings == 0 { "nothing damaged or stray".to_owned() } else { format!("{findings} damaged or stray") }
}

fn gc(options: &ArgMatches) -> Result<(), Fault> {
    let (config, store) = open(options)?;
    let (is_dry, now) = (options.get_flag("dry-run"), SystemTime::now());
    let outdated = upkeep::outdated(&*store, &config, now).map_err(failed)?;
    let leftovers = upkeep::leftovers(&*store, now).map_err(failed)?;
    let bar = LateBar::new("removing what may go".to_owned());
    let (mut text, mut bytes, mut gone) = (String::new(), 0, 0_usize);
    let steps = (outdated.len() + leftovers.len()).max(1);
    let both = outdated.iter().map(|removal| (removal, true)).chain(leftovers.iter().map(|removal| (removal, false)));
    for (number, (removal, is_key)) in both.enumerate() {
        let removed = match (is_dry, is_key) {
            (true, _) => Ok(true),
            (false, true) => upkeep::remove(&*store, removal),
            (false, false) => store.discard(&removal.path),
        };
        if removed.map_err(failed)? {
            let Removal { path, bytes: length, why } = removal;
            writeln!(text, "{path} ({length} bytes): {why}").unwrap_or_default();
            bytes += length;
            gone += 1;
        }
        bar.set((number + 1) as f64 / steps as f64);
    }
    drop(bar);
    let verb = if is_dry { "would go" } else { "are gone" };
    writeln!(text, "{gone} files of {bytes} bytes {verb}").unwrap_or_default();
    to_stdout(text.as_bytes())
}
