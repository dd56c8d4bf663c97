//! End to end: the real program, a real socket, a real data folder.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]

mod access;
mod attack;
mod bad_input;
mod bundle;
mod caching;
mod command_line;
mod crowds;
mod damage;
mod damaged_jobs;
mod deploy;
mod description;
mod disks;
mod film;
mod frames;
mod harness;
mod images;
mod jobs;
mod kept;
mod letter;
mod lifecycle;
mod load;
mod observed;
mod points;
#[cfg(feature = "s3")]
mod replicas;
#[path = "../common/schema.rs"]
mod schema_tools;
mod shares;
mod sun;
mod textures;
mod together;
